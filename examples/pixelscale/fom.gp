# Error of the power spectrum for a survey of fixed lifetime, relative to Sim 1
# at 0.10 arcsec: lower is better.
load "style.gp"
f = dir."/fom-exact.cat"
rows(s, c) = sprintf("< ./pick %s %s CCDSCALE %s", f, s, c)
name(s) = s eq "sim1" ? "Sim 1" : s eq "sim1d" ? "Sim 1 drizzled" : s eq "sim2" ? "Sim 2" : "Sim 2 drizzled"
sets = "sim1 sim1d sim2 sim2d"
set xlabel "CCD pixel scale {/Symbol q}_{ccd} / arcsec"
set ylabel "log_{10} {/Symbol D}C_l, relative"
set offsets 0.01, 0.01, 0.02, 0.02
do for [t in "svg pdf png"] {
    eval(t eq "svg" ? svg("fom") : t eq "pdf" ? pdf("fom") : png("fom"))
    plot 0 with lines lc rgb "#888888" dt 3 notitle, \
        for [i=1:4] s=word(sets, i) rows(s, "LOGDC LOGDCERR") using 1:2:3 with yerrorlines ls i title name(s)
}
set output
