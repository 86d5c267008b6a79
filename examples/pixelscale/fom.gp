# Error of the power spectrum for a survey of fixed lifetime, relative to Sim 1 at
# 0.10 arcsec: lower is better.  Left: shot noise alone (the paper's figure); right:
# with a C_l as large as the shot noise of Sim 1 at 0.10 arcsec.
load "style.gp"
set xlabel theta_ccd
set ylabel "log_{10} ΔC_l, relative"
set offsets 0.01, 0.01, 0, 0
set xtics 0.08
do for [t in "svg pdf png"] {
    eval(out(t, "fom"))
    set multiplot layout 1,2
    eval(above)
    set label 1 "C_l = 0" at graph 0.05, 0.06
    plot [0.02:0.30] 0 with lines lc rgb "#888888" dt 3 notitle, for [i=1:4] s=word(sets, i) own("errors-exact", s, "LOGDC LOGDCERR") using 1:2:3 with yerrorlines ls i title name(s)
    set label 1 "C_l = shot noise at 0.10\""
    set ylabel ""
    unset key
    plot [0.02:0.30] 0 with lines lc rgb "#888888" dt 3 notitle, for [i=1:4] s=word(sets, i) own("errors-exact", s, "LOGDC1") using 1:2 with linespoints ls i notitle
    unset multiplot
}
set output
