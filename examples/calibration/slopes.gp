# Multiplicative bias by common objects: against scale, S/N, size and isolation.
set terminal pngcairo size 1200,900 font "sans,11"
set output dir."/slopes.png"
set multiplot layout 2,2
set xzeroaxis lt 1 lc rgb "gray50"
set key top right
of(f, set, col) = sprintf("< awk '/^#/ { l = $0; next } !k { n = split(l, h, \" \"); for (i = 2; i <= n; i++) a[h[i]] = i - 1; k = 1 } $(a[\"SETNAME\"]) == \"%s\" { print $(a[\"CCDSCALE\"]), (\"BINLO\" in a) ? $(a[\"BINLO\"]) : 0, (\"BINLO\" in a) ? $(a[\"BINHI\"]) : 0, $(a[\"%s\"]) - 1, $(a[\"%sSE\"]) }' %s/%s.cat", set, col, col, dir, f)
set xlabel "pixel scale, arcsec"
set ylabel "m"
set xrange [0.03:0.18]
plot of("fom-exact", "sim1", "BPAIR1") using 1:4:5 with yerrorlines title "exact, shear 1", \
     of("fom-exact", "sim1", "BPAIR2") using ($1+.001):4:5 with yerrorlines title "exact, shear 2", \
     of("fom-centroid", "sim1", "BPAIR1") using 1:4:5 with yerrorlines title "with centroid term, 1", \
     of("fom-plain", "sim1", "BPAIR1") using 1:4:5 with yerrorlines title "plain, 1", \
     of("fom-plain", "sim1", "BPAIR2") using ($1+.001):4:5 with yerrorlines title "plain, 2", \
     of("fom-plain", "sim1d", "BPAIR1") using 1:4:5 with yerrorbars title "plain, interlaced, 1"
set xrange [*:*]
set logscale x
set xlabel "signal to noise"
plot for [theta in "0.05 0.10 0.16"] of("bins-snr", "sim1", "BPAIR1") using ($1==real(theta) ? sqrt($2*($3>1000?3*$2:$3)) : 1/0):4:5 with yerrorlines title "exact, ".theta."\""
unset logscale x
set xlabel "observed rms size, arcsec"
plot for [theta in "0.05 0.10 0.16"] of("bins-size", "sim1", "BPAIR1") using ($1==real(theta) ? ($2+$3)/2 : 1/0):4:5 with yerrorlines title "exact, ".theta."\"", \
     for [theta in "0.05 0.10 0.16"] of("bins-plain-size", "sim1", "BPAIR1") using ($1==real(theta) ? ($2+$3)/2 : 1/0):4:5 with yerrorlines title "plain, ".theta."\""
set xlabel "nearest other detection, arcsec"
plot for [theta in "0.05 0.10 0.16"] of("bins-isolation", "sim1", "BPAIR1") using ($1==real(theta) ? ($3>100?4:($2+$3)/2) : 1/0):4:5 with yerrorlines title "exact, ".theta."\""
unset multiplot
