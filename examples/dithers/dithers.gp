# Noise correlation, usable galaxies and slope against the size of the drop, for three kinds of dither.
set terminal pngcairo size 1300,460 font "sans,11" background "white"
set output dir."/dithers.png"
set multiplot layout 1,3
set border lw 1.2
set tics nomirror out
set grid lc rgb "#dddddd" lw 0.6
set key top left samplen 2
set xrange [0.24:1.05]
set xtics ("point" 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1)
set xlabel "drop, pixels of the exposure"
cases = "ideal random rolled"
colour(i) = word("#0072b2 #d55e00 #009e73", i)
of(c) = sprintf("< awk '$1 == \"%s\" { $2 = $2 == \"point\" ? 0.3 : $2; gsub(/ - /, \" nan \"); gsub(/ - /, \" nan \"); print }' %s/table.txt", c, dir)
set ylabel "noise correlation"
plot for [i=1:3] of(word(cases, i)) using 2:4 with points pt 4+2*i lc rgb colour(i) title word(cases, i).", measured", \
     of("random") using 2:($2 > 0.36 ? $3 : 1/0) with lines lc rgb "black" title "NOISECOR, drops split"
set key bottom right
set ylabel "usable galaxies per arcmin^2"
plot for [i=1:3] of(word(cases, i)) using 2:8 with linespoints pt 4+2*i lc rgb colour(i) title word(cases, i)
set ylabel "slope by common objects, both shears"
plot for [i=1:3] of(word(cases, i)) using ($2 + 0.006 * (i - 2)):(($10 + $12) / 2):(sqrt($11**2 + $13**2) / 2) with yerrorlines pt 4+2*i lc rgb colour(i) title word(cases, i)
unset multiplot
