# Distribution of the shear estimates; dashed: the Gaussian of the same rms.
load "style.gp"
one = "< awk -v s=%s -v x=%s '$1 == s && $2 == x { print $3, $4, $6 }' ".dir."/gammahist.cat"
list = system(sprintf("awk '!/^#/ && !seen[$1 $2]++ { printf \"%%s-%%s \", $1, $2 }' %s/gammahist.cat", dir))
part(f, i) = i == 1 ? f[1:strstrt(f, "-")-1] : f[strstrt(f, "-")+1:*]
set xlabel "shear estimate γ_1"
set ylabel "probability density"
set xrange [-1.5:1.5]
set xtics 0.5
do for [t in "svg pdf png"] {
    eval(out(t, "gammahist"))
    plot for [i=1:words(list)] f=word(list, i) sprintf(one, part(f, 1), part(f, 2)) using ($1+.025):2 with histeps ls i dt 1 title sprintf("%s %s\"", name(part(f, 1)), part(f, 2)), \
        sprintf(one, part(word(list, 1), 1), part(word(list, 1), 2)) using ($1+.025):3 with lines lc rgb "#888888" dt 2 title "Gaussian of the first"
}
set output
