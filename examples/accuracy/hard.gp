# The first formula one thinks of against the one in use.
load "../pixelscale/style.gp"
set xtics autofreq
f = dir."/hard.txt"
rows(p) = "< awk '$1 == \"".p."\"' ".f
small = 1e-17
set logscale y
set format y "10^{%T}"
set key top left
do for [t in "svg pdf png"] {
    eval(t eq "svg" ? svg("hard") : t eq "pdf" ? pdf("hard") : png("hard"))
    set multiplot layout 2,2
    set ylabel "error"
    unset logscale x
    set xlabel "order n"
    plot rows("order") using 2:($3+small) with linespoints ls 3 title "naive", rows("order") using 2:($4+small) with linespoints ls 1 title "used"
    set logscale x
    set xlabel "pixel / {/Symbol b}"
    plot rows("pixel/beta") using 2:($3+small) with linespoints ls 3 notitle, rows("pixel/beta") using 2:($4+small) with linespoints ls 1 notitle
    set xlabel "|g|"
    plot rows("shear") using 2:($3+small) with linespoints ls 3 notitle, rows("shear") using 2:($4+small) with linespoints ls 1 notitle
    set format x "10^{%T}"; set key center left
    set xlabel "Poisson mean"; set ylabel "share of wrong draws"; unset logscale y; set format y "%g"; set yrange [-0.1:1.1]
    plot rows("mean") using 2:3 with linespoints ls 3 title "sum, float", rows("mean") using 2:4 with linespoints ls 4 title "sum, double", rows("mean") using 2:5 with linespoints ls 1 title "used"
    set format x "%g"; set key top left
    set logscale y; set format y "10^{%T}"; set autoscale y
    unset multiplot
}
set output
