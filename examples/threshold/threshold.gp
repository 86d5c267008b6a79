# Objects against pixel scale, by two thresholds; data, level, out from the Makefile.
set terminal pngcairo size 1000,480 font ",11"
set output out
set multiplot layout 1,2
set xlabel "pixel scale (arcsec)"
set xrange [0.03:0.21]
set yrange [0:*]
set key top right
set title "objects less false ones, same sky"
set ylabel "per square arcminute"
plot data using 1:($4-$5) with linespoints pt 7 lw 2 lc rgb "#1b6ca8" title sprintf("%.1f sigma of the filtered image", level), \
     data using 1:($2-$3) with linespoints pt 5 lw 2 lc rgb "#c8553d" title "1.5 sigma of a pixel", \
     data using 1:5 with linespoints pt 6 dt 2 lc rgb "#1b6ca8" title "false, filtered", \
     data using 1:3 with linespoints pt 4 dt 2 lc rgb "#c8553d" title "false, pixel"
set title "what 1.5 sigma of a pixel asks for"
set ylabel "sigma of the filtered image"
plot data using 1:6 with linespoints pt 5 lw 2 lc rgb "#c8553d" title "1.5 sigma of a pixel", \
     level with lines dt 2 lc rgb "#1b6ca8" title "constant"
unset multiplot
