# Usable galaxies against magnitude and size.
load "style.gp"
hist(k) = sprintf("< awk -v s=%%s -v x=%%s '$1 == s && $2 == x && $3 == \"%s\" { print $4, $5 }' %s/magsizehist.cat", k, dir)
list = system(sprintf("awk '!/^#/ && !seen[$1 $2]++ { printf \"%%s-%%s \", $1, $2 }' %s/magsizehist.cat", dir))
part(f, i) = i == 1 ? f[1:strstrt(f, "-")-1] : f[strstrt(f, "-")+1:*]
do for [t in "svg pdf png"] {
    eval(out(t, "magsizehist"))
    set multiplot layout 1,2
    eval(above)
    set yrange [0:*]
    set ylabel "usable galaxies / arcmin^{-2} per bin"
    set xlabel "AB magnitude"
    set xrange [20:29]
    set xtics 2
    plot for [i=1:words(list)] f=word(list, i) sprintf(hist("MAG"), part(f, 1), part(f, 2)) using ($1+.125):2 with steps ls i title sprintf("%s %s\"", name(part(f, 1)), part(f, 2))
    set ylabel ""
    set xlabel "log_{10} (FWHM / arcsec)"
    set xrange [-1.2:0.3]
    set xtics 0.4
    unset key
    plot for [i=1:words(list)] f=word(list, i) sprintf(hist("SIZE"), part(f, 1), part(f, 2)) using ($1+.025):2 with steps ls i notitle
    unset multiplot
}
set output
