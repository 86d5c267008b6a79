# dither: exact sums, the layout and keywords of the contract, interlacing back.
# shellcheck disable=SC2016
F="perl $TOP/tests/fits.pl"
cards=("PIXSCALE=                  0.1" "CCDSCALE=                  0.2" "EXPTIME =               2000.0" "BUNIT   = 'electron'" "MAGZERO =                 34.0" \
    "CTYPE1  = 'RA---TAN'" "CTYPE2  = 'DEC--TAN'" "CRPIX1  =                 10.5" "CRPIX2  =                  9.0" "CRVAL1  =                150.0" "CRVAL2  =                  2.2" \
    "CD1_1   = -2.777777777777778E-5" "CD1_2   =                  0.0" "CD2_1   =                  0.0" "CD2_2   =  2.777777777777778E-5" "HISTORY made for a test")
$F make h.fits 21 19 '(($x * 7919 + $y * 104729) % 1009) * 4' "${cards[@]}"
ok "dither -n 2" dither -n 2 h.fits -o d.fits
near "HDUs" "$($F count d.fits)" 5 0
near "primary is empty" "$($F card d.fits 0 NAXIS)" 0 0
$F dump h.fits 0 >h.txt
# exposure e at (a,b): D[j][i] = sum of 2 x 2 / 4, sides floor((n-1)/2)
check() { # EXTENSION A B
    $F dump d.fits "$1" >d.txt
    near "exposure $1: pixels" "$(wc -l <d.txt)" 90 0
    near "exposure $1: pixels that differ from direct sums" "$(awk -v a="$2" -v b="$3" 'NR == FNR { h[$1, $2] = $3; next }
        { x = 2 * $1 + a; y = 2 * $2 + b; s = (h[x, y] + h[x + 1, y] + h[x, y + 1] + h[x + 1, y + 1]) / 4; if (s != $3) bad++ } END { print bad + 0 }' h.txt d.txt)" 0 0
    near "exposure $1: DITHERX" "$($F card d.fits "$1" DITHERX)" "$(awk "BEGIN { print $2 / 2 }")" 0
    near "exposure $1: DITHERY" "$($F card d.fits "$1" DITHERY)" "$(awk "BEGIN { print $3 / 2 }")" 0
    near "exposure $1: CRPIX1" "$($F card d.fits "$1" CRPIX1)" "$(awk "BEGIN { print (10.5 - 1 - $2 - .5) / 2 + 1 }")" 1e-12
    near "exposure $1: CRPIX2" "$($F card d.fits "$1" CRPIX2)" "$(awk "BEGIN { print (9 - 1 - $3 - .5) / 2 + 1 }")" 1e-12
    near "exposure $1: EXPNUM" "$($F card d.fits "$1" EXPNUM)" "$1" 0
    near "exposure $1: EXTVER" "$($F card d.fits "$1" EXTVER)" "$1" 0
}
check 1 0 0; check 2 1 0; check 3 1 1; check 4 0 1
near "EXPTIME" "$($F card d.fits 2 EXPTIME)" 500 0
near "TOTTIME" "$($F card d.fits 2 TOTTIME)" 2000 0
near "PIXSCALE" "$($F card d.fits 2 PIXSCALE)" 0.2 1e-15
near "CCDSCALE" "$($F card d.fits 2 CCDSCALE)" 0.2 0
near "CD1_1" "$($F card d.fits 2 CD1_1)" -5.555555555555556e-5 1e-19
near "MAGZERO: a quarter of the electrons" "$($F card d.fits 2 MAGZERO)" "$(awk 'BEGIN { printf "%.12f", 34 - 2.5 * log(4) / log(10) }')" 1e-10
if [ "$($F card d.fits 2 EXTNAME)" = SCI ]; then pass "EXTNAME SCI"; else fail "EXTNAME $($F card d.fits 2 EXTNAME)"; fi

# sums in the overlap: total electrons of the four exposures = sum of all 2 x 2 cells
dither -n 1 h.fits -o one.fits; $F dump one.fits 1 >one.txt
same "-n 1 is the image" one.txt h.txt
dither -n 3 h.fits -o nine.fits
near "-n 3: HDUs" "$($F count nine.fits)" 10 0
near "-n 3: NAXIS1" "$($F card nine.fits 9 NAXIS1)" 6 0
near "-n 3: exposure 9 DITHERX" "$($F card nine.fits 9 DITHERX)" 0.6666666666666666 1e-15
dither -n 2 <h.fits >p.fits; for i in 1 2 3 4; do $F dump p.fits $i; done >p.txt; for i in 1 2 3 4; do $F dump d.fits $i; done >d.txt
same "pipe and file, same pixels" p.txt d.txt
dither -j 2 -n 2 h.fits -o d2.fits; same "1 and 2 threads" d.fits d2.fits
# NaN stays local
$F make nan.fits 9 9 '$x == 4 && $y == 4 ? 9**9**9/9**9**9 : 1' "${cards[@]}"
dither -n 2 nan.fits -o n.fits
near "a NaN reaches one pixel per exposure" "$($F stat n.fits 1 | cut -d' ' -f5)" 15 0
# rates keep their value
$F make rate.fits 9 9 1 "BUNIT   = 'electron/s'" "EXPTIME =                100.0"
dither rate.fits -o r.fits
near "rates are added, not divided" "$($F stat r.fits 1 | cut -d' ' -f1)" 4 0

# a list of offsets: exact sums at multiples of a small pixel, beyond one pixel too
printf '# DX DY\n0 0\n1.5 0.5\n0.5 2\n' >off.txt
ok "--offsets" dither -n 2 --offsets off.txt h.fits -o l.fits
near "--offsets: HDUs" "$($F count l.fits)" 4 0
near "--offsets: EXPTIME a third" "$($F card l.fits 2 EXPTIME)" 666.6666666666666 1e-9
near "--offsets: DITHERX" "$($F card l.fits 2 DITHERX)" 1.5 0
near "--offsets: CRPIX1" "$($F card l.fits 2 CRPIX1)" "$(awk 'BEGIN { print (10.5 - 1 - 3 - .5) / 2 + 1 }')" 1e-12
near "--offsets: NAXIS" "$($F card l.fits 2 NAXIS1)$($F card l.fits 2 NAXIS2)" 97 0
$F dump l.fits 2 >l.txt
near "--offsets: pixels that differ from direct sums" "$(awk 'NR == FNR { h[$1, $2] = $3; next }
    { x = 2 * $1 + 3; y = 2 * $2 + 1; s = (h[x, y] + h[x + 1, y] + h[x, y + 1] + h[x + 1, y + 1]) / 3; d = s - $3; if (d * d > 1e-12 * s * s) bad++ } END { print bad + 0 }' h.txt l.txt)" 0 0
# negative ones leave out pixels at the beginning of all
printf '# DX DY\n0 0\n-0.5 0.5\n' >off.txt
dither -n 2 --offsets off.txt h.fits -o l.fits
near "negative offset: DITHERX" "$($F card l.fits 2 DITHERX)" -0.5 0
near "negative offset: CRPIX1" "$($F card l.fits 2 CRPIX1)" "$(awk 'BEGIN { print (10.5 - 1 - 1 - .5) / 2 + 1 }')" 1e-12
$F dump l.fits 2 >l.txt
near "negative offset: pixels that differ from direct sums" "$(awk 'NR == FNR { h[$1, $2] = $3; next }
    { x = 2 * $1 + 1; y = 2 * $2 + 1; s = (h[x, y] + h[x + 1, y] + h[x, y + 1] + h[x + 1, y + 1]) / 2; if (s != $3) bad++ } END { print bad + 0 }' h.txt l.txt)" 0 0

# any offset: shifted as a band-limited image, against renderings of the displaced sky; largest error over the peak
psfgen --pupil-grid 64 --size 128 -o psf.fits
printf '# DX DY MAG TYPE\n0.3 0.7 22 star\n-3.1 2.23 21 star\n' >sky.txt
shifted() { # N DX DY LIMIT: pixels of 0.2", small ones N times smaller
    awk -v n="$1" -v dx="$2" -v dy="$3" -v CONVFMT=%.12g '/^#/ { print; next } { a = 0.2 * (0.5 - 0.5 / n); print $1 + a - 0.2 * dx, $2 + a - 0.2 * dy, $3, $4 }' sky.txt >moved.txt
    simage -q sky.txt -p psf.fits -x 0.2 --subpixel "$1" --size $((60 * $1 + $1 - 1)),$((60 * $1 + $1 - 1)) --accuracy 1e-7 -o small.fits
    simage -q moved.txt -p psf.fits -x 0.2 --size 60,60 --accuracy 1e-7 -o direct.fits
    printf '# DX DY\n%s %s\n' "$2" "$3" >off.txt
    dither -v -n "$1" --offsets off.txt small.fits -o moved.fits 2>log.txt
    near "shift by $2, $3 of $1 small pixels a pixel: error over the peak" "$(pix diff "moved.fits[SCI,1]" direct.fits | cut -d' ' -f1)" 0 "$4"
}
shifted 8 .13 .41 1e-6
shifted 8 .06 0 1e-6
shifted 4 .13 .41 2e-4
between "its error is told, and is no smaller" "$(sed -n 's/.*right to about \([0-9.e-]*\) of.*/\1/p' log.txt)" 9e-5 1e-2
shifted 2 .13 .41 0.06
grep -q "may be wrong by" log.txt && pass "small pixels that are too large: $(cut -c1-120 log.txt | tail -1)" || fail "no warning at small pixels of 0.1 arcsec"
near "shifted: CRPIX1" "$($F card moved.fits 1 CRPIX1)" "$(awk 'BEGIN { print (61 - 1 - 0.26 - .5) / 2 + 1 }')" 1e-9
$F make one.fits 200 200 3 "${cards[@]}"
dither -n 2 --offsets off.txt one.fits -o c.fits
near "a constant stays one, to the border" "$($F stat c.fits 1 | awk '{ print $4 - $3 }')" 0 1e-5
printf '# DX DY\n0 0\n3e6 0\n' >off.txt
fails "an offset beyond 1e6 small pixels" 1 dither -n 2 --offsets off.txt h.fits -o no.fits

$F make small.fits 8 8 1
fails "too few pixels" 1 dither -n 5 small.fits -o no.fits
fails "-n 0" 2 dither -n 0 small.fits
$F make sip.fits 9 9 1 "CTYPE1  = 'RA---TAN-SIP'" "CTYPE2  = 'DEC--TAN-SIP'" "CRVAL1  = 150.0" "CRVAL2  = 2.2" "CD1_1   = -2E-5" "CD2_2   = 2E-5" "A_ORDER =                    2" "A_2_0   = 1E-5" "B_ORDER =                    2"
fails "SIP" 1 dither sip.fits -o no.fits
head -c 3000 h.fits >cut.fits
if dither h.fits >/dev/full 2>err.txt; then fail "a full device gave success"; else pass "a full device: $(cat err.txt)"; fi
fails "truncated input" 1 dither cut.fits -o no.fits
[ ! -e no.fits ] && pass "no output left behind" || fail "a failed run left an output"
