# psfgen: error over the peak against processor time, by pupil grid and by wavelengths.
load "../pixelscale/style.gp"
set xtics autofreq
f = dir."/psfgen.txt"
rows(p) = "< awk '$2 == \"".p."\"' ".f
set logscale xy
set format y "10^{%T}"
set key bottom left
set xtics (1, 2, 4, 8, 16, 64, 256, 1024)
set xrange [*:*] noextend
do for [t in "svg pdf png"] {
    eval(t eq "svg" ? svg("psfgen") : t eq "pdf" ? pdf("psfgen") : png("psfgen"))
    set multiplot layout 1,2
    set ylabel "error / peak"
    set xlabel "pupil grid M"
    plot rows("grid") using 3:4 with linespoints ls 1 title "largest", rows("grid") using 3:5 with linespoints ls 2 title "rms"
    set xlabel "wavelengths in a band of 20 %"
    plot rows("waves") using 3:4 with linespoints ls 1 notitle, rows("waves") using 3:5 with linespoints ls 2 notitle
    unset multiplot
}
set output
