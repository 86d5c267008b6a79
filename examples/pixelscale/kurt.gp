# Kurtosis - 3 and skewness of the shear estimates.
load "style.gp"
set xlabel theta_ccd
set offsets 0.01, 0.01, 0.1, 0.1
set xtics 0.08
do for [t in "svg pdf png"] {
    eval(out(t, "kurt"))
    set multiplot layout 1,2
    set ylabel "kurtosis - 3 of γ_1"
    eval(above)
    plot [0.02:0.30] 0 with lines lc rgb "#888888" dt 3 notitle, for [i=1:4] s=word(sets, i) fom("exact", s, "KURT1 KURT1ERR") using 1:2:3 with yerrorbars ls i title name(s)
    set ylabel "skewness of γ_1"
    unset key
    plot [0.02:0.30] 0 with lines lc rgb "#888888" dt 3 notitle, for [i=1:4] s=word(sets, i) fom("exact", s, "SKEW1 SKEW1ERR") using 1:2:3 with yerrorbars ls i notitle
    unset multiplot
}
set output
