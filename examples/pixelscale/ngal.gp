# Usable galaxies per square arcminute against the pixel scale of the image.
load "style.gp"
f = dir."/fom-exact.cat"
rows(s, c) = sprintf("< ./pick %s %s CCDSCALE %s", f, s, c)
step(s) = s eq "sim1d" || s eq "sim2d" ? 0.5 : 1
name(s) = s eq "sim1" ? "Sim 1" : s eq "sim1d" ? "Sim 1 drizzled" : s eq "sim2" ? "Sim 2" : "Sim 2 drizzled"
sets = "sim1 sim1d sim2 sim2d"
set xlabel "pixel scale of the image {/Symbol q}_s / arcsec"
set ylabel "usable galaxies n_{gal} / arcmin^{-2}"
set yrange [0:*]
set xrange [0.02:*]
set offsets 0.01, 0.01, 0, 0
do for [t in "svg pdf png"] {
    eval(t eq "svg" ? svg("ngal") : t eq "pdf" ? pdf("ngal") : png("ngal"))
    plot for [i=1:4] s=word(sets, i) rows(s, "N_GAL N_GALERR") using ($1*step(s)):2:3 with yerrorlines ls i title name(s)
}
set output
