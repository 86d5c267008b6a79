# Detection and photometry at three pixel scales of one field of 163.84", FITS tables on both sides.
galgen --field 163.84 -n 6000 -s 3 -o s.txt --models m.txt
psfgen -o psf.fits
sex=$(command -v source-extractor || command -v sex)
[ -n "$sex" ] || echo "source-extractor is not installed: no comparison"
[ -z "$sex" ] || "$sex" -dd >empty.sex
printf '%s\n' NUMBER X_IMAGE Y_IMAGE ALPHA_J2000 DELTA_J2000 FLUX_AUTO FLUXERR_AUTO MAG_AUTO MAGERR_AUTO A_IMAGE B_IMAGE THETA_IMAGE \
    FWHM_IMAGE FLUX_RADIUS ISOAREA_IMAGE BACKGROUND THRESHOLD FLUX_MAX CLASS_STAR FLAGS >p.param
cp /usr/share/source-extractor/default.nnw default.nnw 2>/dev/null || sed -i /CLASS_STAR/d p.param
for scale in 0.04 0.10 0.16; do
    n=$(awk "BEGIN { print int(163.84 / $scale + 0.5) }")
    simage s.txt --models m.txt -p psf.fits -x $scale --size "$n,$n" --accuracy 1e-3 -o clean.fits
    addnoise --depth 27.7 clean.fits -o "f$scale.fits"
    awk -v f="$(awk "BEGIN { print 0.15 / $scale }")" 'BEGIN { print "CONV NORM"; s = f / 2.35482; r = int(3 * s) + 1
        for (j = -r; j <= r; j++) { for (i = -r; i <= r; i++) printf "%.6f ", exp(-(i * i + j * j) / (2 * s * s)); print "" } }' >k.conv
    mine="detect f$scale.fits -q --kernel 0.15 --threshold 1.5 --threshold-noise pixel -o mine.fits"
    if [ -z "$sex" ]; then cpu "detect, $n x $n pixels of $scale\"" bash -c "$mine"; continue; fi
    versus "detect, $n x $n pixels of $scale\", source-extractor" "$mine" "$sex f$scale.fits -c empty.sex -CATALOG_NAME sex.fits \
        -CATALOG_TYPE FITS_1.0 -PARAMETERS_NAME p.param -FILTER_NAME k.conv -DETECT_THRESH 1.5 -ANALYSIS_THRESH 1.5 -GAIN 1 -BACK_SIZE 64 -VERBOSE_TYPE QUIET"
done
# Wall time of the kernel (-v) on one and two threads in turn, and what two processes side by side get out of this machine.
found() { detect -v -j "$1" "f$scale.fits" --kernel 0.15 --threshold 1.5 --threshold-noise pixel -o "mine$2.fits" 2>&1 | awk '/found and measured in/ { print $6 }'; }
for scale in 0.04 0.10 0.16; do
    for ((i = 0; i < 3 * RUNS; i++)); do
        one=$(found 1 1) two=$(found 2 1)
        found 1 1 >found1 & found 1 2 >found2; wait
        echo "$one $two $(cat found1 found2 | sort -g | tail -1)"
    done >found
    printf '%-40s %.4f s, two threads %.4f s, %.2f times faster, two processes %.2f times the work\n' "detect, kernel, $scale\"" \
        "$(cut -d' ' -f1 found | median)" "$(cut -d' ' -f2 found | median)" \
        "$(awk '{ print $1 / $2 }' found | median)" "$(awk '{ print 2 * $1 / $3 }' found | median)"
done
for j in 1 2; do cpu "detect, 4096 x 4096, -j $j: CPU of all threads" detect -q -j $j f0.04.fits --kernel 0.15 --threshold 1.5 --threshold-noise pixel -o mine.fits; done
