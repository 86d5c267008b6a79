# rrgshape: errors of ellipticity by the weight's end, rows of the stars' moments and stars; of the shear by simage's accuracy.
load "../pixelscale/style.gp"
set xtics autofreq
f = dir."/rrgshape.txt"
rows(p) = "< awk '$2 == \"".p."\"' ".f
set logscale y
set format y "10^{%T}"
set key top right
do for [t in "svg pdf png"] {
    eval(t eq "svg" ? svg("rrgshape") : t eq "pdf" ? pdf("rrgshape") : png("rrgshape"))
    set multiplot layout 2,2
    set ytics nomirror; set y2tics; set y2label "µs per object"; set y2range [0:*]
    set xlabel "end of the weight / its width"; set ylabel "rms error of e (raw moments)"
    plot rows("cut") using 3:4 with linespoints ls 1 title "error", rows("cut") using 3:6 axes x1y2 with linespoints ls 4 title "time"
    set xlabel "rows of the star-moment file"; set ylabel "rms error of e (corrected)"
    plot rows("widths") using 3:4 with linespoints ls 1 title "error", rows("widths") using 3:6 axes x1y2 with linespoints ls 4 title "time"
    unset y2tics; unset y2label; set logscale x
    set xtics (25, 50, 100, 200, 400); set xrange [20:500]
    set xlabel "stars of magnitude 21"
    plot rows("stars") using 3:4 with linespoints ls 1 notitle
    set xtics autofreq; set xrange [10:3000]
    set xlabel "simage, µs per galaxy"; set ylabel "error of the shear, |{/Symbol D}m|"
    plot "< awk '$2 == \"simage\" && $3 !~ /floor/' ".f using 6:4 with linespoints ls 1 title "accuracy", \
         "< awk '$2 == \"simage\" && $3 ~ /floor/' ".f using 6:4 with linespoints ls 3 title "1e-6 and a floor"
    unset multiplot
    unset logscale x; set xrange [*:*]
}
set output
