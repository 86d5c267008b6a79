# PSFEx: a real model of 400 simulated stars through psfgen --from, against PSFEx's own
# reconstructions and against the PSF that the stars were drawn with.
for p in psfex source-extractor; do
    if ! command -v $p >/dev/null; then
        skip "$p is not installed: no real PSFEx model was read (apt-get install psfex source-extractor)"
        return 0
    fi
done
F="perl $TOP/tests/fits.pl"
psfgen -o psf.fits
galgen --stars --field 60 -o stars.txt
printf 'NUMBER\nX_IMAGE\nY_IMAGE\nFLUX_RADIUS\nFLUX_APER(1)\nFLUXERR_APER(1)\nELONGATION\nFLAGS\nSNR_WIN\nVIGNET(45,45)\n' >p.param
printf 'CONV NORM\n1 2 1\n2 4 2\n1 2 1\n' >d.conv
source-extractor -dd >d.sex 2>/dev/null
psfex -dd >d.psfex 2>/dev/null
# model SCALE SAMPLING SIZE DEGREE: c.psf and snap_c.fits from stars on pixels of SCALE
model() {
    local n
    n=$(awk -v x="$1" 'BEGIN { print int(60 / x) }')
    simage stars.txt -p psf.fits -x "$1" --size "$n,$n" -o true.fits
    addnoise --depth 27.7 true.fits -o noisy.fits
    source-extractor noisy.fits -c d.sex -CATALOG_TYPE FITS_LDAC -CATALOG_NAME c.ldac -PARAMETERS_NAME p.param -FILTER_NAME d.conv -DETECT_THRESH 5 \
        -PHOT_APERTURES 30 -GAIN 1 -GAIN_KEY NONE_ -SATUR_LEVEL 1e9 -SATUR_KEY NONE_ -PIXEL_SCALE "$1" -VERBOSE_TYPE QUIET \
        -STARNNW_NAME /usr/share/source-extractor/default.nnw >sex.log 2>&1
    psfex c.ldac -c d.psfex -PSF_SAMPLING "$2" -PSF_SIZE "$3,$3" -PSFVAR_DEGREES "$4" -PSFVAR_NSNAP 5 -BASIS_TYPE PIXEL -PSF_ACCURACY 0.001 \
        -SAMPLE_FWHMRANGE 0.5,10 -CHECKPLOT_DEV NULL -CHECKPLOT_TYPE NONE -CHECKIMAGE_TYPE SNAPSHOTS -CHECKIMAGE_NAME snap.fits -WRITE_XML N -NTHREADS 1 >psfex.log 2>&1
}
# over A B FACTOR: largest |a - FACTOR b| over the largest |a|, of two dumps
over() { paste "$1" "$2" | awk -v f="$3" '{ d = $3 - f * $6; if (d < 0) d = -d; if (d > m) m = d; if ($3 > p) p = $3 } END { print m / p }'; }

# stars on 0.10": undersampled. PSFEx's own reconstruction is its samples, flux per pixel.
model 0.1 0.5 65 0
between "stars that PSFEx took" "$(grep -aoE '[0-9]+/[0-9]+' psfex.log | tail -1 | cut -d/ -f1)" 300 400
ok "its model" psfgen --from c.psf --psf-scale 0.1 --scale 0.05 --size 65 -o from.fits
$F dump from.fits 0 >from.txt; $F dump snap_c.fits 0 | head -4225 >snap.txt
near "PSFEx's own reconstruction of 65 x 65 samples, of the peak" "$([ "$(wc -l <snap.txt)" = 4225 ] && over from.txt snap.txt 0.25)" 0 1e-6
between "the flux of the model, 1 for stars inside its normalising aperture" "$(card from.fits PSFFLUX)" 0.98 1.02
near "the pixel is in it" "$(card from.fits PIXSIZE)" 0.1 1e-12
fails "so that another is refused" 1 psfgen --from c.psf --psf-scale 0.1 --pixel 0.1 -o no.fits
# used as a PSF: the stars again, without noise, against the PSF that they have
psfgen --from c.psf --psf-scale 0.1 --normalise -o model.fits 2>/dev/null
ok "simage with the model" simage stars.txt -p model.fits -x 0.1 --size 600,600 --accuracy 1e-4 -o again.fits
between "stars of 0.10\": largest error, of the peak (PSFEx's own, its pixels are 1.4 to the FWHM)" "$(pix diff true.fits again.fits | cut -d' ' -f1)" 0 0.1

# a model that varies: five by five snapshots, evaluated where PSFEx evaluates them
model 0.1 0.5 33 2
$F dump snap_c.fits 0 >snap.txt
near "snapshots: samples" "$(wc -l <snap.txt)" 27225 0
for at in "0 0" "3 1" "4 4"; do
    set -- $at
    pos() { perl -ne 'BEGIN { $/ = \80 } print $1 if /^'"$1"' *= *([-+.0-9eE]+)/' c.psf; }
    x=$(awk -v z="$(pos POLZERO1)" -v s="$(pos POLSCAL1)" -v k="$1" 'BEGIN { printf "%.12g", z + ((k + .5) / 5 - .5) * s }')
    y=$(awk -v z="$(pos POLZERO2)" -v s="$(pos POLSCAL2)" -v k="$2" 'BEGIN { printf "%.12g", z + ((k + .5) / 5 - .5) * s }')
    psfgen --from c.psf --psf-scale 0.1 -X "$x" -Y "$y" --scale 0.05 --size 33 -o from.fits 2>/dev/null
    $F dump from.fits 0 >from.txt
    awk -v i="$1" -v j="$2" '$1 >= 33 * i && $1 < 33 * i + 33 && $2 >= 33 * j && $2 < 33 * j + 33' snap.txt >one.txt
    near "snapshot $at at ($x, $y), of the peak" "$(over from.txt one.txt 0.25)" 0 2e-6
done

# stars on 0.04", well sampled: the model is the PSF with its pixel
model 0.04 1 45 0
psfgen --pixel 0.04 --scale 0.04 --size 45 -o epsf.fits
psfgen --from c.psf --psf-scale 0.04 --scale 0.04 --size 45 -o from.fits 2>/dev/null
$F dump from.fits 0 >from.txt; $F dump epsf.fits 0 >epsf.txt
flux=$(paste epsf.txt from.txt | awk '{ a += $3 * $6; b += $6 * $6 } END { print a / b }')
between "stars of 0.04\": flux of the PSF over the model's (PSFEx counts inside its aperture of 0.6\")" "$flux" 0.9 1.1
near "model and the PSF with its pixel, of the peak" "$(over epsf.txt from.txt "$flux")" 0 0.01
near "FWHM" "$(card from.fits PSFFWHM)" "$(card epsf.fits PSFFWHM)" 0.003
