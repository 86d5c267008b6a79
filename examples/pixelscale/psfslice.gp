# Cross-sections of the PSF with charge diffusion, linear and logarithmic.
load "style.gp"
cut(s) = sprintf("< ./slice %s/psf-%s.fits", dir, s)
draw = "\
set multiplot layout 1,2; \
set xlabel 'offset / arcsec'; set xrange [-0.6:0.6]; set xtics 0.3; set key top left Left reverse samplen 1; \
set ylabel 'relative to the peak'; unset logscale y; set yrange [0:1.4]; set ytics 0.2; set format y '%.1f'; \
plot for [i=1:words(list)] cut(word(list, i)) with lines ls i title sprintf('σ_{ch} = %s\"', word(list, i)); \
set yrange [1e-5:2]; set ytics autofreq; set logscale y; set format y '10^{%L}'; unset key; set ylabel ''; \
plot for [i=1:words(list)] cut(word(list, i)) with lines ls i notitle; \
unset multiplot"
list = system(sprintf("ls %s/psf-*.fits | sed 's/.*psf-//; s/.fits//' | awk '{ a[NR] = $1 } END { print a[1]; for (i = 2; i < NR; i++) if (a[i] == \"0.040\") print a[i]; if (NR > 1) print a[NR] }' | uniq | tr '\\n' ' '", dir))
do for [t in "svg pdf png"] {
    eval(t eq "svg" ? svg("psfslice") : t eq "pdf" ? pdf("psfslice") : png("psfslice"))
    eval(draw)
}
set output
