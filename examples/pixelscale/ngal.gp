# Detected galaxies, those left after each cut, and the usable ones (thick).
# Error bars hold the variance from field to field (64 parts of the sky).
load "style.gp"
set xlabel theta_s
set ylabel "galaxies / arcmin^{-2}"
set yrange [0:520]
set xtics 0.08
set xrange [0.02:0.30]
set key font ",10" samplen 1.5
cuts = "N_DET N_ELLCUT N_SIZECUT"
left(c) = c eq "N_DET" ? "detected" : c eq "N_ELLCUT" ? "|e| < 1" : "large enough"
do for [t in "svg pdf png"] {
    eval(out(t, "ngal"))
    set multiplot layout 1,2
    do for [g=1:2] {
        set title g == 1 ? "Sim 1" : "Sim 2"
        set key top right
        plot 0 lc rgb "#888888" notitle, for [i=1:2] for [j=1:3] s=word(sets, 2*g-2+i) fom("exact", s, word(cuts, j)) using ($1*step(s)):2 with lines lc rgb (i == 1 ? "#0072b2" : "#d55e00") dt j+1 lw 1 \
                title i == 1 ? left(word(cuts, j)) : "", \
            for [i=1:2] s=word(sets, 2*g-2+i) own("errors-exact", s, "N_GAL N_GALERR") using ($1*step(s)):2:3 with yerrorlines lc rgb (i == 1 ? "#0072b2" : "#d55e00") pt (i == 1 ? 7 : 5) ps .6 lw 1.8 \
                title i == 1 ? "usable, single" : "usable, drizzled"
    }
    unset multiplot
}
set output
