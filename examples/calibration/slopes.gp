# Multiplicative bias by common objects: against scale, S/N, size and isolation.
set terminal pngcairo size 1400,1100 font "sans,11"
set output dir."/slopes.png"
set multiplot layout 2,2
set key outside bottom center horizontal maxrows 4 samplen 2 font ",9"
set bmargin 7.5
of(f, set, col, err) = sprintf("< awk '/^#/ { l = $0; next } !k { n = split(l, h, \" \"); for (i = 2; i <= n; i++) a[h[i]] = i - 1; k = 1 } $(a[\"SETNAME\"]) == \"%s\" { print $(a[\"CCDSCALE\"]), (\"BINLO\" in a) ? $(a[\"BINLO\"]) : 0, (\"BINLO\" in a) ? $(a[\"BINHI\"]) : 0, $(a[\"%s\"]) - 1, $(a[\"%s\"]) }' %s/%s.cat", set, col, err, dir, f)
pair(f, set, k) = of(f, set, "BPAIR".k, "BPAIR".k."BK")
scales = "0.05 0.10 0.16"
colour(k) = word("#1b6ca8 #d1495b #2e933c", k)
set xlabel "pixel scale, arcsec"
set ylabel "m"
set xrange [0.03:0.18]
plot 0 lc rgb "gray50" notitle, pair("forced-exact", "sim1", "1") using 1:4:5 with yerrorlines lw 2 lc rgb colour(1) title "exact, shear 1", \
     pair("forced-exact", "sim1", "2") using ($1+.001):4:5 with yerrorlines dt 2 lc rgb colour(1) title "exact, shear 2", \
     pair("clean-exact", "sim1", "1") using ($1-.001):4:5 with yerrorlines lc rgb "gray40" title "without noise", \
     pair("own-exact", "sim1", "1") using ($1-.002):4:5 with yerrorlines lc rgb "orange" title "own detection", \
     pair("forced-centroid", "sim1", "1") using ($1+.002):4:5 with yerrorlines lc rgb colour(3) title "centroid term", \
     pair("forced-plain", "sim1", "1") using 1:4:5 with yerrorlines lw 2 lc rgb colour(2) title "plain, shear 1", \
     pair("forced-plain", "sim1", "2") using ($1+.001):4:5 with yerrorlines dt 2 lc rgb colour(2) title "plain, shear 2", \
     pair("own-plain", "sim1d", "1") using 1:4:5 with yerrorbars pt 6 lc rgb "black" title "plain, interlaced"
set xrange [*:*]
set logscale x
set xlabel "signal to noise"
set xrange [10:200]
plot 0 lc rgb "gray50" notitle, for [k=1:3] pair("bins-snr", "sim1", "1") using ($1==real(word(scales,k)) ? sqrt($2*($3>1000?3*$2:$3)) : 1/0):4:5 with yerrorlines lw 2 lc rgb colour(k) title word(scales,k)."\" exact", \
     for [k=1:3] pair("bins-own-snr", "sim1", "1") using ($1==real(word(scales,k)) ? 1.02*sqrt($2*($3>1000?3*$2:$3)) : 1/0):4:5 with yerrorlines dt 2 lc rgb colour(k) title "own detection", \
     for [k=1:3] pair("bins-clean-snr", "sim1", "1") using ($1==real(word(scales,k)) ? .98*sqrt($2*($3>1000?3*$2:$3)) : 1/0):4:5 with yerrorlines dt 3 lc rgb colour(k) title "without noise"
unset logscale x
set xlabel "observed rms size, arcsec"
set xrange [0.05:0.4]
plot 0 lc rgb "gray50" notitle, for [k=1:3] pair("bins-size", "sim1", "1") using ($1==real(word(scales,k)) ? ($2+$3)/2 : 1/0):4:5 with yerrorlines lw 2 lc rgb colour(k) title word(scales,k)."\" exact", \
     for [k=1:3] pair("bins-plain-size", "sim1", "1") using ($1==real(word(scales,k)) ? ($2+$3)/2 : 1/0):4:5 with yerrorlines dt 2 lc rgb colour(k) title word(scales,k)."\" plain"
set xlabel "nearest other detection, arcsec"
set xrange [0:4.5]
plot 0 lc rgb "gray50" notitle, for [k=1:3] pair("bins-isolation", "sim1", "1") using ($1==real(word(scales,k)) ? ($3>100?4:($2+$3)/2) : 1/0):4:5 with yerrorlines lw 2 lc rgb colour(k) title word(scales,k)."\" exact", \
     for [k=1:3] pair("bins-own-isolation", "sim1", "1") using ($1==real(word(scales,k)) ? ($3>100?4.05:($2+$3)/2+.03) : 1/0):4:5 with yerrorlines dt 2 lc rgb colour(k) title "own detection", \
     for [k=1:3] pair("bins-clean-isolation", "sim1", "1") using ($1==real(word(scales,k)) ? ($3>100?3.95:($2+$3)/2-.03) : 1/0):4:5 with yerrorlines dt 3 lc rgb colour(k) title "without noise"
unset multiplot
