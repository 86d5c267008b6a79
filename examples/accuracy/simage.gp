# simage: error found against error requested, and what it costs.
load "../pixelscale/style.gp"
set xtics autofreq
f = dir."/simage.txt"
rows(p) = "< awk '$2 == \"".p."\"' ".f
set logscale xy
set format "10^{%T}"
set key top left
set xtics ("10^{-1}" 1e-1, "10^{-3}" 1e-3, "10^{-5}" 1e-5, "10^{-7}" 1e-7)
set ytics 100
do for [t in "svg pdf png"] {
    eval(t eq "svg" ? svg("simage") : t eq "pdf" ? pdf("simage") : png("simage"))
    set multiplot layout 2,2
    set xlabel "accuracy requested"; set xrange [2e-1:5e-9]
    set key top right
    set ylabel "worst pixel error / peak"
    plot x with lines lc rgb "#888888" dt 3 title "requested", \
        for [i=1:4] p=word("0.04 0.10 0.16 none", i) rows(p) using 3:5 with linespoints ls i notitle
    set ylabel "error of the flux"
    plot for [i=1:4] p=word("0.04 0.10 0.16 none", i) rows(p) using 3:6 with linespoints ls i notitle
    set ylabel "error of the second moment"
    plot for [i=1:4] p=word("0.04 0.10 0.16 none", i) rows(p) using 3:7 with linespoints ls i notitle
    set key top left
    set ylabel "ms per galaxy"
    plot for [i=1:4] p=word("0.04 0.10 0.16 none", i) rows(p) using 3:9 with linespoints ls i title (p eq "none" ? "no PSF" : p."\"")
    unset multiplot
}
set output
