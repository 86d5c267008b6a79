# The smallest size that is kept, in pixels and in arcsec.
load "style.gp"
which = system(sprintf("grep -q '^sim2 ' %s/dcut.cat && echo sim2 || echo sim1", dir))
set xlabel theta_ccd
set ylabel "d_{cut} / pixel"
set y2label "d_{cut} / arcsec"
set ytics nomirror
set y2tics
set yrange [0:*]
set y2range [0:*]
set key bottom right
do for [t in "svg pdf png"] {
    eval(out(t, "dcut"))
    plot [0.02:0.30] 1 with lines lc rgb "#888888" dt 3 title "one pixel", \
        own("dcut", which, "DCUT") using 1:2 with linespoints ls 1 title "pixels", \
        own("dcut", which, "DCUT_NOFLOOR") using 1:2 with lines ls 2 title "pixels, without 0.4", \
        own("dcut", which, "DCUT_ARCSEC") using 1:2 axes x1y2 with linespoints ls 3 title "arcsec (right)"
}
set output
