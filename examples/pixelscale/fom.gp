# Error of the power spectrum for a survey of fixed lifetime, relative to Sim 1 at 0.10 arcsec: lower is better.
load "style.gp"
set xlabel theta_ccd
set ylabel "log_{10} {/Symbol D}C_l, relative"
set offsets 0.01, 0.01, 0, 0
set key top right
do for [t in "svg pdf png"] {
    eval(out(t, "fom"))
    plot [0.02:0.26] 0 with lines lc rgb "#888888" dt 3 notitle, for [i=1:4] s=word(sets, i) fom("exact", s, "LOGDC LOGDCERR") using 1:2:3 with yerrorlines ls i title name(s)
}
set output
