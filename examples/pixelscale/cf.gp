# Slope of measured against input shear with its line over the scales, and what
# the line leaves: as public code treats the fourth moments (the paper's 0.8),
# and with exact ones.  Full symbols g_1, open ones g_2.
load "style.gp"
set xrange [0.03:0.30]
set xtics 0.08

set format y "%.2f"
shade(s) = s eq "sim1" ? "#0072b2" : s eq "sim1d" ? "#56b4e9" : s eq "sim2" ? "#d55e00" : "#e69f00"
do for [t in "svg pdf png"] {
    eval(out(t, "cf"))
    set multiplot
    do for [v in "plain exact"] {
        left = v eq "plain" ? 0 : 0.5
        set size 0.5,0.68; set origin left,0.32
        set title v eq "plain" ? "plain fourth moments, first-order PSF" : "exact fourth moments"
        set yrange [0.65:1.35]
        set ytics 0.1
        set xlabel ""
        set ylabel v eq "plain" ? "slope of γ_i against g_i" : ""
        if (v eq "plain") { set key top left Left reverse samplen 1 } else { unset key }
        plot 1 with lines lc rgb "#888888" dt 3 notitle, \
            for [i=1:4] for [c=1:2] s=word(sets, i) fom(v, s, sprintf("BPAIR%d BPAIR%dSE", c, c)) using ($1+.0005*i):2:3 with yerrorbars pt (c == 1 ? 5 : 4) ps .5 lc rgb shade(s) title c == 1 ? name(s) : "", \
            for [i=1:4] for [c=1:2] s=word(sets, i) fom(v, s, sprintf("LINE%d", c)) using 1:2 with lines lc rgb shade(s) dt c notitle
        set size 0.5,0.34; set origin left,0
        unset title
        set yrange [-0.12:0.12]
        set ytics 0.1
        set xlabel theta_ccd
        set ylabel v eq "plain" ? "slope - line" : ""
        plot 0 with lines lc rgb "#888888" dt 3 notitle, \
            for [i=1:4] for [c=1:2] s=word(sets, i) fom(v, s, sprintf("BPAIR%d BPAIR%dSE LINE%d", c, c, c)) using ($1+.0005*i):($2-$4):3 with yerrorbars pt (c == 1 ? 5 : 4) ps .5 lc rgb shade(s) notitle
    }
    unset multiplot
}
set output
