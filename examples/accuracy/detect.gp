# detect: errors against the truth, by setting; time on the right axis.
load "../pixelscale/style.gp"
set xtics autofreq
f = dir."/detect.txt"
rows(p) = "< awk '$2 == \"".p."\"' ".f
set logscale x
set ytics nomirror; set y2tics; set y2label "CPU time / s"; set y2range [0:*]; set yrange [0:*]
do for [t in "svg pdf png"] {
    eval(t eq "svg" ? svg("detect") : t eq "pdf" ? pdf("detect") : png("detect"))
    set multiplot layout 2,2
    set key center right
    set xlabel "deblending levels"; set ylabel "objects missed, of 691"; set xtics (1, 2, 4, 8, 16, 32, 64)
    plot rows("levels") using 3:5 with linespoints ls 1 title "missed", rows("levels") using 3:11 axes x1y2 with linespoints ls 4 title "time"
    set key top left
    set xlabel "background cell / pixel"; set ylabel "magnitude"; set xtics (16, 32, 64, 128, 256, 512); set yrange [-0.02:0.04]
    plot rows("mesh") using 3:6 with linespoints ls 1 title "bias", rows("mesh") using 3:7 with linespoints ls 3 title "scatter", rows("mesh") using 3:11 axes x1y2 with linespoints ls 4 title "time"
    set yrange [0:0.09]; set y2range [0:0.1]; set key top left; unset logscale x
    set xlabel "filter's FWHM / arcsec"; set ylabel "scatter"; set xtics 0.1
    plot rows("kernel") using 3:8 with linespoints ls 1 title "position / pixel", rows("kernel") using 3:9 with linespoints ls 3 title "ellipticity", rows("kernel") using 3:11 axes x1y2 with linespoints ls 4 title "time"
    set logscale x; set yrange [0:*]; set y2range [0:*]
    set key center left
    set xlabel "deblending contrast"; set ylabel "objects missed, of 691"; set xtics (0.001, 0.005, 0.02, 0.1)
    plot rows("contrast") using 3:5 with linespoints ls 1 title "missed", rows("contrast") using 3:11 axes x1y2 with linespoints ls 4 title "time"
    unset multiplot
}
set output
