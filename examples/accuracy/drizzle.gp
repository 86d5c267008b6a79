# drizzle: difference from exact overlaps of squares, and time, by kernel.
load "../pixelscale/style.gp"
set xtics autofreq
f = dir."/drizzle.txt"
rows(p) = "< awk '$3 == \"".p."\"' ".f
set logscale xy
set format y "10^{%T}"
set xlabel "ns per input pixel, whole program"
set ylabel "rms difference from square drops / rms of the image"
set key outside top center horizontal
set xrange [40:1500]; set yrange [1e-8:5]
set xtics (50, 100, 200, 500, 1000)
do for [t in "svg pdf png"] {
    eval(t eq "svg" ? svg("drizzle") : t eq "pdf" ? pdf("drizzle") : png("drizzle"))
    plot rows("1") using 7:5 with points ls 1 ps 1.2 title "drop of 1 pixel", rows("0.8") using 7:5 with points ls 3 ps 1.2 title "0.8", \
         rows("0.5") using 7:5 with points ls 4 ps 1.2 title "0.5", rows("1") using 7:($5*1.9):2 with labels left font ",10" notitle
}
set output
