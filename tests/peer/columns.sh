# Every column whose name is Source Extractor's against its own, on unblended objects with S/N > 10 of one field.
sex=$(command -v source-extractor || command -v sex)
if [ -z "$sex" ]; then skip "source-extractor is not installed: columns are not compared"; exit 0; fi
galgen --field 90 -s 5 -o scene.txt --models models.txt
psfgen -o psf.fits
simage scene.txt --models models.txt -p psf.fits -x 0.10 --size 896,896 --accuracy 1e-3 -o clean.fits
addnoise -q --depth 27.7 --read-noise 3 clean.fits -o field.fits
awk 'BEGIN { print "CONV NORM"; s = 1.5 / 2.35482; for (j = -2; j <= 2; j++) { for (i = -2; i <= 2; i++) printf "%.6f ", exp(-(i * i + j * j) / (2 * s * s)); print "" } }' >k.conv
scalars="X_IMAGE Y_IMAGE FLAGS FLUX_AUTO FLUXERR_AUTO MAG_AUTO MAGERR_AUTO X2_IMAGE Y2_IMAGE XY_IMAGE ERRX2_IMAGE ERRY2_IMAGE ERRXY_IMAGE ERRA_IMAGE
    ERRB_IMAGE ERRTHETA_IMAGE A_IMAGE B_IMAGE THETA_IMAGE ELLIPTICITY FLUX_ISO FLUXERR_ISO MAG_ISO MAGERR_ISO KRON_RADIUS XWIN_IMAGE YWIN_IMAGE MU_MAX
    FLUX_MAX ISOAREAF_IMAGE ISOAREA_IMAGE XPEAK_IMAGE YPEAK_IMAGE XMIN_IMAGE XMAX_IMAGE YMIN_IMAGE YMAX_IMAGE BACKGROUND THRESHOLD ALPHA_J2000 DELTA_J2000"
{ printf '%s\n' $scalars; printf '%s\n' 'FLUX_APER(2)' 'FLUXERR_APER(2)' 'MAG_APER(2)' 'MAGERR_APER(2)' 'FLUX_RADIUS(3)'; } >p.param
"$sex" -dd >empty.sex 2>/dev/null
"$sex" field.fits -c empty.sex -CATALOG_NAME sex.cat -CATALOG_TYPE ASCII_HEAD -PARAMETERS_NAME p.param -FILTER Y -FILTER_NAME k.conv -DETECT_MINAREA 5 \
    -DETECT_THRESH 1.5 -ANALYSIS_THRESH 1.5 -MAG_ZEROPOINT "$(card field.fits MAGZERO)" -GAIN 1 -GAIN_KEY NONE -SATUR_LEVEL 1e9 -SATUR_KEY NONE \
    -PHOT_APERTURES 5,12 -PHOT_FLUXFRAC 0.2,0.5,0.8 -PIXEL_SCALE 0.1 -VERBOSE_TYPE QUIET 2>sex.err
detect -q field.fits --kernel 0.15 --threshold 1.5 --threshold-noise pixel --min-area 5 --apertures 0.5,1.2 --flux-fraction 0.2,0.5,0.8 \
    --columns "$(echo $scalars | tr ' ' ,),FLUX_RADIUS" -o mine.cat
# NAME mine theirs for each pair within half a pixel
awk '/^#/ && FNR == NR { if ($3 in s) next; s[$3] = $2; if (last != "" && $2 - s[last] > 1) for (k = 1; k < $2 - s[last]; k++) s[last "_" (k + 1)] = s[last] + k; last = $3; next }
    FNR == NR { if (FNR && !widened) { widened = 1; for (k = 1; s[last] + k <= NF; k++) s[last "_" (k + 1)] = s[last] + k }
        a[++n] = $0; x[n] = $(s["X_IMAGE"]); y[n] = $(s["Y_IMAGE"]); next }
    /^#/ { m = split($0, h, " "); for (i = 2; i <= m; i++) c[h[i]] = i - 1; next }
    { for (i = 1; i <= n; i++) { dx = x[i] - $c["X_IMAGE"]; dy = y[i] - $c["Y_IMAGE"]; if (dx * dx + dy * dy < 0.25) { split(a[i], t, " ")
        if (t[s["FLAGS"]] == 0 && $c["FLAGS"] == 0 && t[s["FLUX_AUTO"]] > 10 * t[s["FLUXERR_AUTO"]]) { pairs++
            for (k in s) if (k in c) printf "%s %.9g %.9g\n", k, $c[k], t[s[k]] } } } }
    END { print "PAIRS", pairs, pairs }' sex.cat mine.cat >cells.txt
between "pairs" "$(awk '$1 == "PAIRS" { print $2 }' cells.txt)" 150 2000
# at NAME PART VALUE: of the values of an expression in mine (m) and theirs (t), the one at that part of their order
at() { awk -v n="$1" '$1 == n { m = $2; t = $3; printf "%.9g\n", ('"$3"') }' cells.txt | sort -g | awk -v p="$2" '{ v[NR] = $1 } END { i = int(p * NR + 0.5); print NR ? v[i < 1 ? 1 : i] : "none" }'; }
ratio() { # TOLERANCE SPREAD NAME...: the median ratio is 1, two thirds of them within the spread
    local tol=$1 spread=$2 n; shift 2
    for n; do
        near "$n over Source Extractor's" "$(at "$n" 0.5 't == 0 ? 1 : m / t')" 1 "$tol"
        between "$n: two thirds of the ratios differ by less than" "$(at "$n" 0.67 't == 0 ? 0 : (m > t ? m - t : t - m) / (t < 0 ? -t : t)')" 0 "$spread"
    done
}
differ() { # TOLERANCE SPREAD NAME...
    local tol=$1 spread=$2 n; shift 2
    for n; do
        near "$n less Source Extractor's" "$(at "$n" 0.5 'm - t')" 0 "$tol"
        between "$n: two thirds of the differences are less than" "$(at "$n" 0.67 'm > t ? m - t : t - m')" 0 "$spread"
    done
}
equal() { local n; for n; do between "$n: part that is equal" "$(awk -v n="$n" '$1 == n { a++; e += $2 == $3 } END { print a ? e / a : "none" }' cells.txt)" 0.85 1; done; }
differ 0.0001 0.001 X_IMAGE Y_IMAGE XWIN_IMAGE YWIN_IMAGE
differ 2e-8 2e-7 ALPHA_J2000 DELTA_J2000
ratio 0.0002 0.001 X2_IMAGE Y2_IMAGE A_IMAGE B_IMAGE
differ 0.0001 0.001 XY_IMAGE ELLIPTICITY
differ 0.005 0.05 THETA_IMAGE
ratio 0.005 0.03 ERRX2_IMAGE ERRY2_IMAGE ERRA_IMAGE ERRB_IMAGE
differ 1e-5 0.0002 ERRXY_IMAGE
differ 0.2 2 ERRTHETA_IMAGE
ratio 0.0005 0.001 FLUX_ISO FLUXERR_ISO FLUX_MAX THRESHOLD
ratio 0.0005 0.005 FLUX_AUTO FLUXERR_AUTO MAGERR_AUTO MAGERR_ISO
differ 0.0005 0.003 MAG_AUTO MAG_ISO MU_MAX
# Source Extractor samples the border of a circle 5 x 5 times, ours is exact
ratio 0.002 0.005 FLUX_APER FLUX_APER_2 FLUXERR_APER FLUXERR_APER_2 MAGERR_APER MAGERR_APER_2
differ 0.002 0.006 MAG_APER MAG_APER_2
ratio 0.0005 0.005 KRON_RADIUS
ratio 0.004 0.015 FLUX_RADIUS FLUX_RADIUS_2 FLUX_RADIUS_3
differ 0.05 0.2 BACKGROUND
# Source Extractor gives the peak of the filtered image, ours the brightest pixel
equal ISOAREAF_IMAGE ISOAREA_IMAGE XPEAK_IMAGE YPEAK_IMAGE XMIN_IMAGE XMAX_IMAGE YMIN_IMAGE YMAX_IMAGE
