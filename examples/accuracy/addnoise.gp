# addnoise: chi-square of a million pixels, in standard deviations, and time per pixel.
load "../pixelscale/style.gp"
set xtics autofreq
f = dir."/addnoise.txt"
set logscale x
set format x "10^{%T}"
set xlabel "mean / electron"
do for [t in "svg pdf png"] {
    eval(t eq "svg" ? svg("addnoise") : t eq "pdf" ? pdf("addnoise") : png("addnoise"))
    set multiplot layout 1,2
    set ylabel "({/Symbol c}^2 - n) / (2n)^{1/2}"; set yrange [-5:5]
    plot 0 with lines lc rgb "#888888" dt 3 notitle, f using 2:3 with linespoints ls 1 notitle
    set ylabel "ns per pixel, whole program"; set yrange [0:*]
    plot f using 2:5 with linespoints ls 3 notitle
    unset multiplot
}
set output
