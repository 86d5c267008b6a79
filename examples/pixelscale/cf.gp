# Slope of measured against input shear: as public code treats the fourth
# moments (the paper's 0.8), and with exact ones.
load "style.gp"
rows(v, s, c) = sprintf("< ./pick %s/fom-%s.cat %s CCDSCALE %s", dir, v, s, c)
name(s) = s eq "sim1" ? "Sim 1" : s eq "sim1d" ? "Sim 1 drizzled" : s eq "sim2" ? "Sim 2" : "Sim 2 drizzled"
sets = "sim1 sim1d sim2 sim2d"
set xlabel "CCD pixel scale {/Symbol q}_{ccd} / arcsec"
set ylabel "slope d{/Symbol g}_1 (measured) / dg_1 (input)"
set xrange [0.03:0.25]
set xtics 0.04
set format y "%.2f"
set yrange [0.6:1.2]
do for [t in "svg pdf png"] {
    eval(t eq "svg" ? svg("cf") : t eq "pdf" ? pdf("cf") : png("cf"))
    set multiplot layout 1,2
    do for [v in "plain exact"] {
        set title v eq "plain" ? "plain fourth moments, first-order PSF" : "exact"
        set key bottom left Left reverse samplen 1
        if (v eq "exact") { unset key; set ylabel "" }
        else { set ylabel "slope d{/Symbol g}_1 (measured) / dg_1 (input)" }
        plot 1 with lines lc rgb "#888888" dt 3 notitle, \
            for [i=1:4] s=word(sets, i) rows(v, s, "BPAIR1 BPAIR1SE") using 1:2:3 with yerrorbars ls i title name(s)
    }
    unset multiplot
}
set output
