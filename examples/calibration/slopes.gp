# Multiplicative bias by common objects: against scale, S/N, size and isolation.
set terminal pngcairo size 1200,900 font "sans,11"
set output dir."/slopes.png"
set multiplot layout 2,2
set xzeroaxis lt 1 lc rgb "gray50"
set key top right
value(f, set, col) = sprintf("< awk '/^#/ { l = $0; next } !k { n = split(l, h, \" \"); for (i = 2; i <= n; i++) a[h[i]] = i - 1; k = 1 } $(a[\"SETNAME\"]) == \"%s\" { print $(a[\"CCDSCALE\"]), (\"BINLO\" in a) ? $(a[\"BINLO\"]) : 0, (\"BINLO\" in a) ? $(a[\"BINHI\"]) : 0, $(a[\"%s\"]) - 1, $(a[\"%sSE\"]) }' %s/%s.cat", set, col, col, dir, f)
set xlabel "pixel scale, arcsec"
set ylabel "m"
set xrange [0.03:0.18]
plot value("fom-exact", "sim1", "BPAIR1") using 1:4:5 with yerrorlines title "exact, shear 1", \
     value("fom-exact", "sim1", "BPAIR2") using ($1+.001):4:5 with yerrorlines title "exact, shear 2", \
     value("fom-centroid", "sim1", "BPAIR1") using 1:4:5 with yerrorlines title "with centroid term, 1", \
     value("fom-plain", "sim1", "BPAIR1") using 1:4:5 with yerrorlines title "plain, 1", \
     value("fom-plain", "sim1", "BPAIR2") using ($1+.001):4:5 with yerrorlines title "plain, 2", \
     value("fom-plain", "sim1d", "BPAIR1") using 1:4:5 with yerrorbars title "plain, interlaced, 1"
set xrange [*:*]
set logscale x
set xlabel "signal to noise"
plot for [x in "0.05 0.10 0.16"] value("bins-snr", "sim1", "BPAIR1") using ($1==x+0 ? sqrt($2*($3>1000?3*$2:$3)) : 1/0):4:5 with yerrorlines title "exact, ".x."\""
unset logscale x
set xlabel "observed rms size, arcsec"
plot for [x in "0.05 0.10 0.16"] value("bins-size", "sim1", "BPAIR1") using ($1==x+0 ? ($2+$3)/2 : 1/0):4:5 with yerrorlines title "exact, ".x."\"", \
     for [x in "0.05 0.10 0.16"] value("bins-plain-size", "sim1", "BPAIR1") using ($1==x+0 ? ($2+$3)/2 : 1/0):4:5 with yerrorlines title "plain, ".x."\""
set xlabel "nearest other detection, arcsec"
plot for [x in "0.05 0.10 0.16"] value("bins-isolation", "sim1", "BPAIR1") using ($1==x+0 ? ($3>100?4:($2+$3)/2) : 1/0):4:5 with yerrorlines title "exact, ".x."\""
unset multiplot
