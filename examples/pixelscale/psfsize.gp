# FWHM of the PSF before (dashed) and after the pixels (lines), and of stars as detected.
load "style.gp"
set xlabel theta_ccd
set ylabel "FWHM / arcsec"
set yrange [0.08:*]
set offsets 0.01, 0.01, 0, 0
set key top left Left reverse
do for [t in "svg pdf png"] {
    eval(out(t, "psfsize"))
    plot [0.02:0.30] own("psfsize", "sim1", "CHPSF") using 1:2 with lines lc rgb "#0072b2" dt 2 title "Sim 1, before the pixels", \
        own("psfsize", "sim2", "CHPSF") using 1:2 with lines lc rgb "#d55e00" dt 2 title "Sim 2, before the pixels", \
        for [i=1:4] s=word(sets, i) own("psfsize", s, "EPSF") using 1:2 with lines ls i notitle, \
        for [i=1:4] s=word(sets, i) own("psfsize", s, "STARS STARSERR") using 1:2:3 with yerrorbars ls i dt 1 title name(s)
}
set output
