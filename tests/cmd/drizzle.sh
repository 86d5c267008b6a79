# drizzle: the paper's interlace as an exact copy, grids, units, keywords, weights,
# context, order and threads, the reference images, refusals.
# shellcheck disable=SC2016
F="perl $TOP/tests/fits.pl"
wcs() { # CRPIX1 CRPIX2 SCALE_DEG
    printf '%s\n' "CTYPE1  = 'RA---TAN'" "CTYPE2  = 'DEC--TAN'" "CRVAL1  = 150.0" "CRVAL2  = 2.2" "CRPIX1  = $1" "CRPIX2  = $2" "CD1_1   = -$3" "CD1_2   = 0.0" "CD2_1   = 0.0" "CD2_2   = $3"
}
common=("BUNIT   = 'electron'" "MAGZERO = 34.0" "EXPTIME = 2000.0" "CCDSCALE= 0.2" "PIXSCALE= 0.1")
mapfile -t W < <(wcs 20.5 18.0 2.777777777777778E-5)
expr='100 + 50 * exp(-(($x - 19) ** 2 + ($y - 17) ** 2) / 60)'
$F make fine.fits 41 37 "$expr" "${common[@]}" "${W[@]}"
dither -n 2 fine.fits -o four.fits
addnoise -s 3 four.fits -o noisy.fits

# ---- interlace: every output pixel is one input pixel, bit for bit
ok "interlace" drizzle noisy.fits -x 0.1 --pixfrac 0.5 -o d.fits
near "HDUs: SCI, WHT, CTX" "$($F count d.fits)" 4 0
near "NAXIS1" "$($F card d.fits 1 NAXIS1)" 40 0
near "NAXIS2" "$($F card d.fits 1 NAXIS2)" 36 0
for e in 1 2 3 4; do $F dump noisy.fits $e | awk -v a="$(awk "BEGIN { print ($e == 2 || $e == 3) }")" -v b="$(awk "BEGIN { print ($e > 2) }")" '{ print 2 * $1 + a, 2 * $2 + b, $3 }'; done | sort -k2n -k1n >want.txt
$F dump d.fits 1 | sort -k2n -k1n >got.txt
same "an exact copy of the four exposures" got.txt want.txt
near "EXPTIME" "$($F card d.fits 1 EXPTIME)" 2000 0
near "GAIN" "$($F card d.fits 1 GAIN)" 1 0
near "MAGZERO: of the whole exposure" "$($F card d.fits 1 MAGZERO)" 34 1e-9
near "PIXSCALE" "$($F card d.fits 1 PIXSCALE)" 0.1 1e-9
near "CCDSCALE" "$($F card d.fits 1 CCDSCALE)" 0.2 0
near "NOISECOR" "$($F card d.fits 1 NOISECOR)" 1 0
near "NCOMBINE" "$($F card d.fits 1 NCOMBINE)" 4 0
# pixel (k,l) is centred on the corner of the small pixels: CRPIX moves by half of one
near "CRPIX1" "$($F card d.fits 1 CRPIX1)" 20 1e-7
near "CRPIX2" "$($F card d.fits 1 CRPIX2)" 17.5 1e-7
[ "$($F card d.fits 1 EXPNUM)$($F card d.fits 1 DITHERX)" = "" ] && pass "no EXPNUM, DITHERX left" || fail "EXPNUM or DITHERX left"
near "WHT: seconds" "$($F stat d.fits 2 | cut -d' ' -f1)" 500 0
near "WHT: the same everywhere" "$($F stat d.fits 2 | cut -d' ' -f2)" 0 0
near "CTX at (1,1): third exposure" "$($F dump d.fits 3 | awk '$1 == 1 && $2 == 1 { print $3 }')" 4 0
drizzle noisy.fits -x 0.1 --pixfrac 0.5 --flat -o flat.fits
$F dump flat.fits 0 | sort -k2n -k1n >flat.txt
same "--flat: the same image, in the primary" flat.txt got.txt
near "--flat: one HDU" "$($F count flat.fits)" 1 0
dither -n 2 fine.fits | addnoise -s 3 | drizzle -x 0.1 --pixfrac 0.5 --flat >p.fits
$F dump p.fits 0 | sort -k2n -k1n >p.txt
same "through pipes" p.txt got.txt

# ---- a list of displacements: the same sums as the WCS gives
printf '# EXPNUM DX DY\n1 0 0\n2 .5 0\n3 .5 .5\n4 0 .5\n' >shift.txt
drizzle noisy.fits -x 0.1 --pixfrac 0.5 --shift shift.txt -o s.fits
for h in 1 2 3; do $F dump d.fits $h >a.txt; $F dump s.fits $h >b.txt; same "--shift: HDU $h as through the WCS" a.txt b.txt; done
near "--shift: CRPIX1 as through the WCS" "$($F card s.fits 1 CRPIX1)" "$($F card d.fits 1 CRPIX1)" 1e-9
printf '# DX DY FILE\n0 .5 noisy.fits[SCI,4]\n.5 0 noisy.fits[SCI,2]\n.5 .5 noisy.fits[SCI,3]\n0 0 noisy.fits[SCI,1]\n' >file.txt
drizzle noisy.fits -x 0.1 --pixfrac 0.5 --shift file.txt --flat -o s2.fits
$F dump s2.fits 0 >b.txt; $F dump d.fits 1 >a.txt; same "--shift: rows named by FILE" a.txt b.txt
# without a WCS: a ramp turned by a right angle about its middle, and one of half-size pixels
$F make ramp.fits 20 20 '100 + 3 * $x + 7 * $y'; $F make turn.fits 20 20 '100 + 3 * (20 - 1 - $y + 2) + 7 * ($x - 1)'
printf '# DX DY ROT SCALE\n0 0 0 1\n2 -1 90 1\n' >turn.txt
drizzle ramp.fits turn.fits --shift turn.txt -o t.fits
near "--shift: ROT 90: pixels that differ from the ramp" "$($F dump t.fits 1 | perl -ne '@a = split; next if $a[2] =~ /nan/i; $b++ if abs($a[2] - (100 + 3 * $a[0] + 7 * ($a[1] - 1))) > 1e-4; $n++; END { print $n == 20 * 20 + 20 * 20 - 18 * 19 ? $b + 0 : "pixels $n" }')" 0 0
near "--shift: without a scale no PIXSCALE" "$($F card t.fits 1 PIXSCALE | wc -w)" 0 0
$F make fineramp.fits 20 20 '25 + 0.75 * 0.5 * ($x + 9.5) + 1.75 * 0.5 * ($y + 9.5)'
printf '# DX DY ROT SCALE\n0 0 0 0.5\n0 0 0 1\n' >scale.txt
drizzle fineramp.fits --units mean --shift <(head -2 scale.txt) -x 1 -o t.fits
near "--shift: SCALE 0.5: its sum" "$($F stat t.fits 1 | cut -d' ' -f5)" 100 0
near "--shift: SCALE 0.5: pixels that differ from the ramp" "$($F dump t.fits 1 | perl -ne '@a = split; next if $a[2] =~ /nan/i; $b++ if abs($a[2] - (100 + 3 * $a[0] + 7 * $a[1])) > 1e-4; END { print $b + 0 }')" 0 0
drizzle ramp.fits --shift <(printf '# DX DY\n0 0\n') -x 0.5 --pixfrac 0.5 -o t.fits
near "--shift: -x in pixels of the frame" "$($F card t.fits 1 NAXIS1)" 39 0
printf '# DX DY\n0 0\n' >one.txt; fails "--shift: too few rows" 1 drizzle noisy.fits --shift one.txt -o no.fits
printf '# DX EXPNUM\n0 1\n' >bad.txt; fails "--shift: no DY" 1 drizzle noisy.fits --shift bad.txt -o no.fits
printf '# EXPNUM DX DY\n1 0 0\n2 1 1\n2 3 3\n4 0 0\n' >bad.txt; fails "--shift: two rows for one" 1 drizzle noisy.fits --shift bad.txt -o no.fits
printf '# EXPNUM DX DY\n1 0 0\n2 1 nan\n3 3 3\n4 0 0\n' >bad.txt; fails "--shift: nan" 1 drizzle noisy.fits --shift bad.txt -o no.fits
printf '# EXPNUM DX DY\n1 0 0\n2 1 0\n3 3 3\n' >bad.txt; fails "--shift: a missing row" 1 drizzle noisy.fits --shift bad.txt -o no.fits
printf '# DX DY SCALE\n0 0 0\n' >bad.txt; fails "--shift: scale 0" 1 drizzle ramp.fits --shift bad.txt -o no.fits
fails "--shift and --rotation" 2 drizzle noisy.fits --shift shift.txt --rotation 3 -o no.fits
cp shift.txt shift.list; fails "output is the list" 1 drizzle noisy.fits --shift shift.list -o shift.list

# ---- order of the operands, threads
for e in 1 2 3 4; do addnoise -q --saturate 1e9 -s 3 "four.fits[SCI,$e]" -o e$e.fits; done
drizzle e1.fits e2.fits e3.fits e4.fits -x 0.07 --pixfrac 0.9 -o o1.fits
drizzle e3.fits e1.fits e4.fits e2.fits -x 0.07 --pixfrac 0.9 -o o2.fits
same "order of the operands" o1.fits o2.fits
drizzle -j 2 e1.fits e2.fits e3.fits e4.fits -x 0.07 --pixfrac 0.9 -o o2.fits
same "1 and 2 threads" o1.fits o2.fits
# the key of the noise does not depend on which exposure comes first
near "NOISSEED: one for all" "$($F card o1.fits 1 NOISSEED)" 3 0
for e in 1 2 3; do addnoise -q -s 1$e "four.fits[SCI,$e]" -o k$e.fits; done
drizzle k1.fits k2.fits k3.fits -o k.fits
near "NOISSEED: the sum of three" "$($F card k.fits 1 NOISSEED)" 36 0
# lists of operands
printf '# exposures\n e2.fits\ne1.fits \n\n' >two.lst; printf 'e4.fits\n' >rest.lst
drizzle @two.lst e3.fits @rest.lst -x 0.07 --pixfrac 0.9 -o o2.fits
same "@list: the same bytes" o1.fits o2.fits
printf 'a\001b\n' >bin.lst; fails "@list: not a list" 1 drizzle @bin.lst -o no.fits
printf '# nothing\n' >no.lst; fails "@list: empty" 1 drizzle @no.lst -o no.fits
fails "@list: missing" 1 drizzle @gone.lst -o no.fits
cp e1.fits @two.lst; drizzle @two.lst -x 0.1 -o o3.fits; near "@list: a file of that very name wins" "$($F card o3.fits 1 NCOMBINE)" 1 0; rm @two.lst
drizzle -j 7 --kernel lanczos3 e1.fits e2.fits -x 0.07 -o o1.fits; drizzle --kernel lanczos3 e1.fits e2.fits -x 0.07 -o o2.fits
same "1 and 7 threads, lanczos3" o1.fits o2.fits
# without EXPNUM the content decides
mapfile -t W1 < <(wcs 8.0 8.0 5.555555555555556E-5); mapfile -t W2 < <(wcs 8.3 7.9 5.555555555555556E-5)
$F make a.fits 15 15 '$x + $y' "EXPTIME = 100.0" "${W1[@]}"
$F make b.fits 15 15 '2 * $x + 7' "EXPTIME = 300.0" "${W2[@]}"
drizzle a.fits b.fits -o o1.fits; drizzle b.fits a.fits -o o2.fits
same "order of operands without EXPNUM" o1.fits o2.fits

# ---- flux and units: two exposures of a constant rate of 2 per second and input pixel
$F make a.fits 15 15 200 "EXPTIME = 100.0" "BUNIT   = 'electron'" "MAGZERO = 30.0" "${W1[@]}"
$F make b.fits 15 15 600 "EXPTIME = 300.0" "BUNIT   = 'electron'" "MAGZERO = $(awk 'BEGIN { printf "%.12f", 30 + 2.5 * log(3) / log(10) }')" "${W2[@]}"
middle() { $F dump "$1" 1 | awk '$1 == 15 && $2 == 15 { print $3 }'; }
for u in total:200 rate:0.5 mean:125; do
    drizzle a.fits b.fits -x 0.1 --units ${u%:*} -o u.fits
    near "--units ${u%:*}" "$(middle u.fits)" ${u#*:} 1e-4
    # value of a pixel as a magnitude: the same in every unit
    near "--units ${u%:*}: MAGZERO" "$(awk -v v="$(middle u.fits)" -v z="$($F card u.fits 1 MAGZERO)" 'BEGIN { print z - 2.5 * log(v) / log(10) }')" "$(awk 'BEGIN { print 25 - 2.5 * log(0.5) / log(10) }')" 1e-5
    near "--units ${u%:*}: GAIN times value = electrons" "$(awk -v v="$(middle u.fits)" -v g="$($F card u.fits 1 GAIN)" 'BEGIN { print v * g }')" 200 1e-3
done
# what was collected in EXPTIME: a stack can go through drizzle again with the exposures it was made of
for u in total mean; do
    drizzle a.fits b.fits -x 0.1 --units $u -o u.fits
    near "--units $u: MAGZERO - 2.5 log10(EXPTIME)" "$(awk -v z="$($F card u.fits 1 MAGZERO)" -v t="$($F card u.fits 1 EXPTIME)" 'BEGIN { printf "%.10f", z - 2.5 * log(t) / log(10) }')" 25 1e-8
    ok "--units $u: and again with an exposure" drizzle u.fits a.fits -o again.fits
    near "--units $u: TOTTIME" "$($F card u.fits 1 TOTTIME)" 400 1e-9
done
$F make adu.fits 15 15 200 "EXPTIME = 100.0" "BUNIT   = 'adu'" "${W1[@]}"
drizzle adu.fits --units rate -o u.fits
[ "$($F card u.fits 1 BUNIT)" = adu/s ] && pass "--units rate: BUNIT adu/s" || fail "--units rate: BUNIT $($F card u.fits 1 BUNIT)"
drizzle a.fits b.fits -x 0.1 --units rate -o u.fits
[ "$($F card u.fits 1 BUNIT)" = electron/s ] && pass "--units rate: BUNIT" || fail "--units rate: BUNIT $($F card u.fits 1 BUNIT)"
near "NOISECOR, r = 2" "$($F card u.fits 1 NOISECOR)" 2.4 1e-9
drizzle a.fits -o same.fits --flat
near "one exposure on its own grid: unchanged" "$($F stat same.fits 0 | cut -d' ' -f1-5 | tr ' ' _ | sed 's/^200_0_200_200_225$/1/')" 1 0

# total flux is kept by a turned grid that holds everything
mapfile -t T < <(printf '%s\n' "CTYPE1  = 'RA---TAN'" "CTYPE2  = 'DEC--TAN'" "CRVAL1  = 150.0" "CRVAL2  = 2.2" "CRPIX1  = 40.3" "CRPIX2  = 41.1" "CD1_1   = -2.0E-5" "CD1_2   = 1.3E-5" "CD2_1   = 1.3E-5" "CD2_2   = 2.0E-5")
$F make grid.fits 80 80 0 "${T[@]}"
drizzle a.fits --like grid.fits --units mean --pixfrac 0.7 -o turned.fits
paste -d' ' <($F dump turned.fits 1) <($F dump turned.fits 2 | cut -d' ' -f3) >sw.txt
near "turned: sum of the weights = seconds times pixels" "$(awk '{ s += $4 } END { printf "%.6f", s }' sw.txt)" 22500 0.01
near "turned: weighted flux" "$(awk '$4 > 0 { s += $3 * $4 } END { printf "%.6f", s }' sw.txt)" "$(awk 'BEGIN { printf "%.6f", 22500 * 200 * (2.0 ^ 2 + 1.3 ^ 2) / 5.555555555555556 ^ 2 }')" 0.6
near "blank where nothing fell" "$($F dump turned.fits 1 | awk '$1 == 0 && $2 == 0 { print (tolower($3) ~ /nan/) }')" 1 0
drizzle a.fits --like grid.fits --fill 0 -o turned.fits
near "--fill 0" "$($F dump turned.fits 1 | awk '$1 == 0 && $2 == 0 { print $3 }')" 0 0

# ---- weights: a map that blinds one exposure
$F make wa.fits 15 15 '1'; $F make wb.fits 15 15 '$x < 8 ? 0 : 3'
$F make c.fits 15 15 1000 "EXPTIME = 100.0" "BUNIT   = 'electron'" "${W1[@]}"
drizzle a.fits c.fits --weight wa.fits --weight wb.fits --units mean -o w.fits
near "weight map: left" "$($F dump w.fits 1 | awk '$1 == 3 && $2 == 5 { print $3 }')" 200 0
near "weight map: right, (200 + 3 * 1000)/4" "$($F dump w.fits 1 | awk '$1 == 12 && $2 == 5 { print $3 }')" 800 1e-4
near "weight map: sum" "$($F dump w.fits 2 | awk '$1 == 12 && $2 == 5 { print $3 }')" 4 0
near "context: one exposure on the left" "$($F dump w.fits 3 | awk '$1 == 3 && $2 == 5 { print ($3 == 1 || $3 == 2) }')" 1 0
near "context: both on the right" "$($F dump w.fits 3 | awk '$1 == 12 && $2 == 5 { print $3 }')" 3 0
$F make nan.fits 15 15 '$x == 7 && $y == 7 ? 9**9**9/9**9**9 : 200' "EXPTIME = 100.0" "BUNIT   = 'electron'" "${W1[@]}"
drizzle nan.fits a.fits --units mean -o n.fits
near "a NaN pixel is filled by the other exposure" "$($F dump n.fits 1 | awk '$1 == 7 && $2 == 7 { print $3 }')" 200 0

# 33 exposures: two context planes
$F make many.fits 0 0 0
for i in $(seq 33); do $F add many.fits 3 3 1 "EXTNAME = 'SCI     '" "EXTVER  = $i" "EXPNUM  = $i" "EXPTIME = 10.0" "${W1[@]}"; done
drizzle many.fits -o m.fits
near "33 exposures: planes" "$($F card m.fits 3 NAXIS3)" 2 0
near "33 exposures: first plane full" "$($F dump m.fits 3 | head -1 | cut -d' ' -f3)" -1 0
near "33 exposures: second plane" "$($F dump m.fits 3 | tail -1 | cut -d' ' -f3)" 1 0

# the 0/360 seam
mapfile -t S1 < <(wcs 8.0 8.0 5.555555555555556E-5 | sed 's/= 150.0/= 0.0005/'); mapfile -t S2 < <(wcs 8.0 8.0 5.555555555555556E-5 | sed 's/= 150.0/= 359.9995/')
$F make s1.fits 15 15 7 "EXPTIME = 1.0" "${S1[@]}"; $F make s2.fits 15 15 7 "EXPTIME = 1.0" "${S2[@]}"
ok "across the 0/360 seam" drizzle s1.fits s2.fits -o seam.fits
between "seam: side of the output, 0.001 deg = 18 px apart" "$($F card seam.fits 1 NAXIS1)" 33 34

# the pole, two exposures a quarter of a turn apart: a ramp meets itself turned
for i in 1 2; do $F make p$i.fits 40 40 '10 + $x' "EXPTIME = 10.0" "CTYPE1  = 'RA---TAN'" "CTYPE2  = 'DEC--TAN'" "CRVAL1  = $((i * 90)).0" "CRVAL2  = 89.9999" "CRPIX1  = 20.5" "CRPIX2  = 20.5" "CD1_1   = -5E-5" "CD1_2   = 0.0" "CD2_1   = 0.0" "CD2_2   = 5E-5"; done
drizzle p1.fits p2.fits --units mean -o pole.fits
near "pole: flux of both" "$(paste -d' ' <($F dump pole.fits 1) <($F dump pole.fits 2 | cut -d' ' -f3) | awk '$4 > 0 { s += $3 * $4 } END { printf "%.3f", s / 10 / 1600 / 2 }')" 29.5 1e-3
near "pole: pixels fall on pixels, NOISECOR" "$($F card pole.fits 1 NOISECOR)" 1 0

# ---- variances: sum (w a s)^2 var / (sum w a)^2, by hand; inverse-variance weights; masks
at() { $F dump "$1" "$2" | awk -v x="$3" -v y="$4" '$1 == x && $2 == y { print $3 }'; }
$F make va.fits 15 15 50; $F make vc.fits 15 15 200
drizzle a.fits c.fits --var va.fits --var vc.fits --units mean -o v.fits
near "HDUs: SCI, WHT, VAR, CTX" "$($F count v.fits)" 5 0
near "VAR: (100^2 50 + 100^2 200)/200^2" "$(at v.fits 3 5 5)" 62.5 1e-5
drizzle a.fits c.fits --var va.fits --var vc.fits --units total -o v.fits
near "VAR of a total: times (200/100)^2" "$(at v.fits 3 5 5)" 250 1e-4
drizzle a.fits c.fits --var va.fits --var vc.fits --units mean --weight-type ivm -o v.fits
near "ivm: (200/50 + 1000/200)/(1/50 + 1/200)" "$(at v.fits 1 5 5)" 360 1e-4
near "ivm: VAR 1/(1/50 + 1/200)" "$(at v.fits 3 5 5)" 40 1e-5
[ "$($F card v.fits 1 WHTTYPE)" = IVM ] && pass "WHTTYPE IVM" || fail "WHTTYPE $($F card v.fits 1 WHTTYPE)"
$F make ia.fits 15 15 0.02; $F make ic.fits 15 15 0.005
drizzle a.fits c.fits --weight ia.fits --weight ic.fits --units mean --weight-type ivm -o v2.fits
near "ivm from maps of 1/var: the same" "$(at v2.fits 1 5 5)" 360 1e-4
$F make ma.fits 15 15 '$x == 5 ? 4 : 0'; $F make mc.fits 15 15 '$y == 7 ? -1 : 0'
drizzle a.fits c.fits --mask ma.fits --mask mc.fits --units mean -o m.fits
near "mask: only the second exposure" "$(at m.fits 1 5 5)" 1000 1e-4
near "mask: only the first" "$(at m.fits 1 6 7)" 200 1e-5
near "mask: both elsewhere" "$(at m.fits 1 6 6)" 600 1e-4
near "mask: nothing left" "$($F dump m.fits 1 | awk '$1 == 5 && $2 == 7 { print (tolower($3) ~ /nan/) }')" 1 0
# noise of a real stack against VAR: white noise of variance 100, drops spread over pixels
$F make flat.fits 120 120 100 "EXPTIME = 100.0" "BUNIT   = 'electron'" "${W1[@]}"; $F make hundred.fits 120 120 100
addnoise -s 5 flat.fits -o white.fits
drizzle white.fits -x 0.13 --pixfrac 0.9 --var hundred.fits --units mean -o w.fits
between "variance of the pixels over mean VAR" "$(awk "BEGIN { print $($F stat w.fits 1 | cut -d' ' -f2) / $($F stat w.fits 3 | cut -d' ' -f1) }")" 0.93 1.07

# ---- a chosen grid
drizzle a.fits --rotation 30 --size 61,41 --center 150.0005,2.2002 -x 0.1 -o g.fits
[ "$($F card g.fits 1 NAXIS1)x$($F card g.fits 1 NAXIS2)" = 61x41 ] && pass "--size" || fail "--size"
near "--center" "$($F card g.fits 1 CRVAL1)" 150.0005 0
near "--rotation: CD1_2 = scale sin 30" "$($F card g.fits 1 CD1_2)" "$(awk 'BEGIN { printf "%.15g", 0.5 * 0.1 / 3600 }')" 1e-18
drizzle a.fits --rotation 30 -o g.fits --units mean
near "--rotation alone: the grid holds all seconds" "$($F dump g.fits 2 | awk '{ s += $3 } END { print s }')" 22500 0.1
fails "--like and --rotation" 2 drizzle a.fits --like grid.fits --rotation 3 -o no.fits
fails "--weight-type ivm without maps" 2 drizzle a.fits --weight-type ivm -o no.fits

# ---- 256 exposures: eight planes, bit e set where exposure e is
for ((e = 0; e < 256; e++)); do
    mapfile -t We < <(wcs "$((8 - e % 16)).0" "$((8 - e / 16)).0" 5.555555555555556E-5)
    if [ $e = 0 ]; then $F make many.fits 0 0 0; fi
    $F add many.fits 3 3 $((e + 1)) "EXTNAME = 'SCI'" "EXTVER  = $((e + 1))" "EXPNUM  = $((e + 1))" "EXPTIME = 1.0" "${We[@]}"
done
ok "256 exposures" drizzle many.fits --units mean -o many.out.fits
near "CTX planes" "$($F card many.out.fits 3 NAXIS3)" 8 0
$F dump many.out.fits 3 >ctx.txt
near "every bit set on nine pixels" "$(perl -ne '@a = split; $b = $a[2] & 0xffffffff; $n++ while $b && ($b & 1 ? ++$s : 1) && ($b >>= 1); END { print $s }' ctx.txt)" 2304 0
# pixel (0,0) of the output belongs to exposure 0 alone, its last corner to exposure 255
near "the first bit alone in the first corner" "$(awk 'NR == 1 { print $3 }' ctx.txt)" 1 0
near "the last bit alone in the last corner" "$(tail -1 ctx.txt | cut -d' ' -f3)" -2147483648 0

# ---- reference images
truth=$SHARED/truth/drizzle
if [ -d "$truth" ] && python3=$(command -v /usr/bin/python3) && $python3 -c 'import astropy' 2>/dev/null; then
    compare() { ok "$1" $python3 "$SHARED/tools/compare_drizzle.py" out.fits "$truth/$2.fits.gz" --wht 'out.fits[WHT]' "$truth/$2.fits.gz[WHT]" "${@:3}"; }
    maps() { for i in 0 1 2 3; do printf -- '--weight\n%s\n' "$truth/$1_in$i.fits.gz[WHT]"; done; }
    # sum of SCI times WHT over the reference's
    flux() { near "$1: weighted flux over the reference's" "$($python3 -c "
import sys, numpy as np
from astropy.io import fits
def total(f):
    with fits.open(f) as h: return np.nansum(next(x.data for x in h if x.data is not None).astype(float) * h['WHT'].data.astype(float))
print('%.9f' % (total('out.fits') / total(sys.argv[1])))" "$truth/$1.fits.gz")" 1 1e-6; }
    for k in square:0.5 point:0.5 square:1.0; do
        n=shift_${k%:*}_pf${k#*:}_exact; mapfile -t M < <(maps shift)
        drizzle "$truth"/shift_in[0-3].fits.gz "${M[@]}" --like "$truth/$n.fits.gz" --kernel ${k%:*} --pixfrac ${k#*:} --units mean -o out.fits
        compare "$n, 2e-6 rms" $n --rtol 1e-7
        flux $n
    done
    mapfile -t M < <(maps rot)
    drizzle "$truth"/rot_in[0-3].fits.gz "${M[@]}" --like "$truth/rot_square_pf0.8_exact.fits.gz" --pixfrac 0.8 --units mean -o out.fits
    compare "rot_square_pf0.8_exact, 2e-5 rms" rot_square_pf0.8_exact --rtol 0 --atol 2e-5 --watol 2e-5
    flux rot_square_pf0.8_exact
    for k in turbo:0.5 gaussian:1.0; do
        n=shift_${k%:*}_pf${k#*:}; mapfile -t M < <(maps shift)
        drizzle "$truth"/shift_in[0-3].fits.gz "${M[@]}" --like "$truth/$n.fits.gz" --kernel ${k%:*} --pixfrac ${k#*:} --units mean -o out.fits
        compare "$n, 1e-5 rms away from the frame" $n --border 8 --atol 1e-5
    done
    # lanczos: the exact function gives our image; STScI's table of it, nearest entry of steps of 0.003 input pixels, theirs
    mapfile -t M < <(maps shift)
    for k in 2 3; do
        drizzle "$truth"/shift_in[0-3].fits.gz "${M[@]}" --like "$truth/shift_lanczos3_pf1.0.fits.gz" --kernel lanczos$k --units mean -o l$k.fits
    done
    $python3 - "$truth" >lanczos.txt <<'END'
import sys, numpy as np
from astropy.io import fits
def kernel(t, n, step):
    t = np.round(abs(t) / step) * step if step else abs(t)
    return np.sinc(t) * np.sinc(t / n) if t < n else 0.0
truth = sys.argv[1]
ref = fits.getdata(truth + '/shift_lanczos3_pf1.0.fits.gz').astype(float)
inner = np.s_[16:-16, 16:-16]
def stack(n, step):
    num, den = np.zeros((480, 480)), np.zeros((480, 480))
    for e, (a, b) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1))):
        with fits.open(truth + '/shift_in%d.fits.gz' % e) as h:
            w = h['WHT'].data.astype(float); d = w * 0.25 * h[0].data
        for j in range(-2 * n, 2 * n + 1):
            for i in range(-2 * n, 2 * n + 1):
                k = kernel(i / 2, n, step) * kernel(j / 2, n, step)
                y, x = 2 * np.arange(240) + b + j, 2 * np.arange(240) + a + i
                my, mx = (y >= 0) & (y < 480), (x >= 0) & (x < 480)
                num[np.ix_(y[my], x[mx])] += k * d[np.ix_(my, mx)]; den[np.ix_(y[my], x[mx])] += k * w[np.ix_(my, mx)]
    return num / den
for n in (2, 3):
    print('exact%d %.3g' % (n, np.std((stack(n, 0) - fits.getdata('l%d.fits' % n, 1))[inner]) / np.std(ref[inner])))
print('table3 %.3g' % (np.std((stack(3, 0.003) - ref)[inner]) / np.std(ref[inner])))
print('theirs3 %.3g' % (np.std((fits.getdata('l3.fits', 1) - ref)[inner]) / np.std(ref[inner])))
END
    of() { sed -n "s/^$1 //p" lanczos.txt; }
    near "lanczos2 against direct sums of the function, rms" "$(of exact2)" 0 1e-7
    near "lanczos3 against direct sums of the function, rms" "$(of exact3)" 0 1e-7
    near "STScI's lanczos3 against direct sums over a table with steps of 0.003, rms" "$(of table3)" 0 2e-6
    near "which is all that differs from ours, rms" "$(of theirs3)" 6.9e-4 1e-5
else
    skip "reference images or astropy are missing"
fi

# ---- refusals
$F make bare.fits 8 8 1 "EXPTIME = 1.0"
fails "no WCS" 1 drizzle bare.fits -o no.fits
fails "two grids" 2 drizzle a.fits --like grid.fits -x 0.1 -o no.fits
fails "weights for one of two" 2 drizzle a.fits b.fits --weight wa.fits -o no.fits
$F make small.fits 7 7 1
fails "weights of another size" 1 drizzle a.fits --weight small.fits -o no.fits
$F make notime.fits 8 8 1 "${W1[@]}"
fails "no EXPTIME and --units rate" 1 drizzle notime.fits --units rate -o no.fits
fails "a grid of 10^9 pixels" 1 drizzle a.fits -x 1e-5 -o no.fits
mapfile -t Z < <(wcs 8.0 8.0 0.0)
$F make zero.fits 8 8 1 "${Z[@]}"
fails "a singular WCS" 1 drizzle zero.fits -o no.fits
if drizzle a.fits >/dev/full 2>err.txt; then fail "a full device gave success"; else pass "a full device: $(cat err.txt)"; fi
fails "output is an input" 1 drizzle a.fits -o a.fits
head -c 3000 a.fits >cut.fits
fails "truncated input" 1 drizzle cut.fits -o no.fits
[ ! -e no.fits ] && pass "no output left behind" || fail "a failed run left an output"

# exposures of different photometric systems are not added
galgen --field 4 --stars -n 4 -o few.txt
simage few.txt -x 0.1 --size 40,40 -T 500 | addnoise --sky-rate 10 -o e1.fits
simage few.txt -x 0.1 --size 40,40 -T 500 -z 28 | addnoise --sky-rate 10 -o e2.fits
simage few.txt -x 0.1 --size 40,40 -T 1000 | addnoise --sky-rate 10 -o e3.fits
simage few.txt -x 0.1 --size 40,40 -T 500 | addnoise --sky-rate 10 --gain 3 -o e4.fits
simage few.txt -x 0.1 --size 40,40 -T 500 | addnoise --sky-rate 10 --gain 2 -o e5.fits
fails "zero points 26.65 and 28" 1 drizzle e1.fits e2.fits -o x.fits
ok "exposure times 500 and 1000" drizzle e1.fits e3.fits -o x.fits
fails "gains 3 and 2" 1 drizzle e4.fits e5.fits -o x.fits

# ---- hard geometries: seconds (sum of WHT) and weighted flux are kept, to 1e-6, on a grid that holds everything
matrix() { # CRPIX1 CRPIX2 CD1_1 CD1_2 CD2_1 CD2_2, the last in units of 0.2 arcsec
    printf '%s\n' "CTYPE1  = 'RA---TAN'" "CTYPE2  = 'DEC--TAN'" "CRVAL1  = 150.0" "CRVAL2  = 2.2" "CRPIX1  = $1" "CRPIX2  = $2"
    awk -v a="$3" -v b="$4" -v c="$5" -v d="$6" 'BEGIN { u = 0.2 / 3600; printf "CD1_1   = %.17G\nCD1_2   = %.17G\nCD2_1   = %.17G\nCD2_2   = %.17G\n", a * u, b * u, c * u, d * u }'
}
kept() { # WHAT PIXELS AREA OPTIONS...: exposure x.fits of so many pixels, 100 s, pixels 1 to PIXELS; A_out/A_in
    drizzle x.fits "${@:4}" --units mean -o k.fits
    paste -d' ' <($F dump k.fits 1) <($F dump k.fits 2 | cut -d' ' -f3) | awk '$4 > 0 { w += $4; f += $3 * $4 } END { printf "%.9g %.9g\n", w, f }' >kept.txt
    near "$1: seconds over pixels" "$(awk -v n="$2" '{ printf "%.9f", $1 / (100 * n) }' kept.txt)" 1 1e-6
    near "$1: weighted flux" "$(awk -v n="$2" -v a="$3" '{ printf "%.9f", $2 / (100 * a * n * (n + 1) / 2) }' kept.txt)" 1 1e-6
}
exposure() { mapfile -t Wx < <(matrix "$@"); $F make x.fits 12 12 '1 + $x + 12 * $y' "EXPTIME = 100.0" "BUNIT   = 'electron'" "${Wx[@]}"; }
mapfile -t Wg < <(matrix 50 50 -1 0 0 1); $F make g.fits 99 99 0 "${Wg[@]}"
mapfile -t Wg < <(matrix 100 100 -0.5 0 0 0.5); $F make gh.fits 199 199 0 "${Wg[@]}"
exposure 6.5 6.5 -1 0 0 1;                            kept "as it is" 144 1 --like g.fits --pixfrac 1
exposure 6.5 6.5 1 0 0 1;                             kept "flipped" 144 1 --like g.fits --pixfrac 0.9
exposure 6.5 6.2 1 0 0 1;                             kept "flipped, onto halves" 144 0.25 --like gh.fits --pixfrac 1
exposure 6.5 6.5 0 1 1 0;                             kept "90 degrees" 144 1 --like g.fits
exposure 6.3 6.1 0 -1 1 0;                            kept "90 degrees and flipped, onto halves" 144 0.25 --like gh.fits --pixfrac 0.7
exposure 6.5 6.5 -0.7071067811865476 0.7071067811865476 0.7071067811865476 0.7071067811865476; kept "45 degrees" 144 1 --like g.fits
kept "45 degrees, onto halves" 144 0.25 --like gh.fits --pixfrac 0.5
for k in point turbo; do kept "45 degrees, $k" 144 1 --like g.fits --kernel $k --pixfrac 0.8; done
exposure 6.5 6.5 -1 1 1 -0.9999;                      kept "nearly singular, lines 1e-4 apart" 144 10000 --like g.fits
exposure 6.5 6.5 -1 1 1 -0.99999999;                  kept "nearly singular, lines 1e-8 apart" 144 100000000 --like g.fits
exposure 6.5 6.5 -1 0.9 0 1e-3;                       kept "sheared to slivers" 144 1000 --like g.fits
exposure 6.5 6.5 -1 1 1 -1
fails "singular" 1 drizzle x.fits --like g.fits -o no.fits
exposure 6.500000008 6.499999994 -1 0 0 1
drizzle x.fits --like <(cat x.fits) --units mean --flat -o k.fits
same "edges on edges but for 1e-8 pixels: a copy" <($F dump x.fits 0) <($F dump k.fits 0)
mapfile -t Wg < <(matrix 6.50000001 6.49999999 -1 0 0 1); $F make g1.fits 12 12 0 "${Wg[@]}"
drizzle x.fits --like g1.fits --units mean --flat -o k.fits
same "edges on edges of another grid but for 1e-8 pixels: a copy" <($F dump x.fits 0) <($F dump k.fits 0)
exposure 6.5 6.5 -1 0 0 1
drizzle x.fits -x 200 --units mean -o k.fits
near "scale ratio 1e-3: one pixel" "$($F card k.fits 1 NAXIS1)" 1 0
near "scale ratio 1e-3: its value" "$(awk -v v="$($F stat k.fits 1 | cut -d' ' -f1)" 'BEGIN { printf "%.9f", v / (1e6 * 72.5) }')" 1 1e-6
near "scale ratio 1e-3: its seconds" "$($F stat k.fits 2 | cut -d' ' -f1)" 14400 0.01
mapfile -t Wg < <(matrix 200.5 200.5 -0.001 0 0 0.001); $F make tiny.fits 400 400 0 "${Wg[@]}"
exposure 6 6 -1 0 0 1; drizzle x.fits --like tiny.fits --units mean -o k.fits
near "scale ratio 1e3: the same everywhere, seconds of a pixel over 1e6" "$($F stat k.fits 2 | awk '{ printf "%.9g %.9g", $3, $4 }' | awk '{ print ($1 > 99.9999e-6 && $2 < 100.0001e-6) }')" 1 0
near "scale ratio 1e3: value of pixel (5,5) over 1e6" "$($F stat k.fits 1 | awk '{ printf "%.9f", ($3 + $4) / 2 * 1e6 }')" 66 1e-4
# blind exposures
$F make none.fits 15 15 0
drizzle a.fits c.fits --weight wa.fits --weight none.fits --units mean -o k.fits
near "zero weights: the other exposure alone" "$($F stat k.fits 1 | awk '{ print $3 == 200 && $4 == 200 }')" 1 0
near "zero weights: no bit in CTX" "$($F stat k.fits 3 | awk '{ print $3 == $4 && ($3 == 1 || $3 == 2) }')" 1 0
drizzle c.fits --weight none.fits --units mean -o k.fits
near "zero weights alone: blank" "$($F stat k.fits 1 | cut -d' ' -f5)" 0 0
near "zero weights alone: WHT 0" "$($F stat k.fits 2 | cut -d' ' -f4)" 0 0
$F make nans.fits 15 15 '9**9**9/9**9**9' "EXPTIME = 100.0" "BUNIT   = 'electron'" "${W1[@]}"
drizzle nans.fits --units mean -o k.fits
near "all NaN: blank" "$($F stat k.fits 1 | cut -d' ' -f5)" 0 0
mapfile -t Wf < <(matrix 5006 6 -1 0 0 1); $F make far.fits 15 15 5 "EXPTIME = 100.0" "BUNIT   = 'electron'" "${Wf[@]}"
drizzle a.fits far.fits --like g.fits --units mean -o k.fits; drizzle a.fits --like g.fits --units mean -o k1.fits
same "an exposure wholly outside adds nothing" <($F dump k1.fits 1) <($F dump k.fits 1)
near "wholly outside: its bit is nowhere" "$($F stat k.fits 3 | cut -d' ' -f4)" 1 1
drizzle far.fits --like g.fits -o k.fits
near "wholly outside alone: blank" "$($F stat k.fits 1 | cut -d' ' -f5)" 0 0
drizzle s1.fits s2.fits --units mean -o seam.fits
near "across the seam: seconds" "$($F stat seam.fits 2 | cut -d' ' -f6)" 450 1e-3
drizzle bare.fits -o no.fits 2>err.txt; grep -q "no usable WCS.*--shift" err.txt && pass "a missing WCS is named: $(cat err.txt)" || fail "a missing WCS: $(cat err.txt)"
# pixfrac 0, 1e-9 and points; turned too
exposure 6.3 6.4 -0.9 0.3 0.35 0.8
for k in "--pixfrac 0" "--pixfrac 1e-9" "--kernel turbo --pixfrac 0" "--kernel point --pixfrac 0.7"; do
    # shellcheck disable=SC2086
    drizzle x.fits --like g.fits $k -o k.fits; $F dump k.fits 1 >k.txt; $F dump k.fits 2 >>k.txt
    [ "$k" = "--pixfrac 0" ] && cp k.txt points.txt
    same "$k: points" k.txt points.txt
done

# ---- NOISECOR in detect: errors of sums over the sky grow by it, positions do not move
blob='100 * exp(-(($x - 50) ** 2 + ($y - 48) ** 2) / 18) + (($x * 7919 + $y * 104729) % 1009) / 250'
$F make plain.fits 100 100 "$blob"; $F make corr.fits 100 100 "$blob" "NOISECOR=                  2.4"
for f in plain corr; do detect -q --gain 0 $f.fits --columns +FLUXERR_ISO,ERRX2_IMAGE -o $f.cat; done
for c in FLUXERR_AUTO FLUXERR_ISO; do near "NOISECOR 2.4: $c" "$(paste <(col corr.cat $c) <(col plain.cat $c) | awk 'NR == 1 { print $1 / $2 }')" 2.4 1e-5; done
near "NOISECOR 2.4: FLUX_AUTO stays" "$(col corr.cat FLUX_AUTO | head -1)" "$(col plain.cat FLUX_AUTO | head -1)" 0
# the spread of fluxes of equal stars in a stack of correlated noise, over FLUXERR_AUTO
awk 'BEGIN { print "# DX DY MAG TYPE"; for (j = 0; j < 20; j++) for (i = 0; i < 20; i++) printf "%.3f %.3f 23 star\n", (i - 9.5) * 3 + (i * 7 + j * 3) % 10 * 0.02, (j - 9.5) * 3 + (i * 3 + j * 7) % 10 * 0.02 }' >stars.txt
psfgen --pupil-grid 64 --size 64 -o psf.fits
simage -q stars.txt -p psf.fits -x 0.2 --subpixel 2 --size 641,641 --accuracy 1e-5 -o stars.fits
dither -n 2 stars.fits | addnoise --depth 26.5 | drizzle -x 0.1 --pixfrac 1 --flat -o stack.fits
detect -q --threshold 5 stack.fits -o stack.cat
near "stack of pixfrac 1: NOISECOR" "$($F card stack.fits 0 NOISECOR)" 2.4 1e-9
between "stack of pixfrac 1: spread of the fluxes of 400 stars over their FLUXERR_AUTO" "$(paste -d' ' <(col stack.cat FLUX_AUTO) <(col stack.cat FLUXERR_AUTO) | sort -g | awk '{ f[NR] = $1; e += $2 } END { lo = int(NR * 0.16) + 1; hi = int(NR * 0.84); printf "%.3f", (f[hi] - f[lo]) / 2 / (e / NR) }')" 0.85 1.3

# ---- exposures that do not belong together ----
mapfile -t Wp < <(printf '%s\n' "CTYPE1  = 'RA---TAN'" "CTYPE2  = 'DEC--TAN'" "CRVAL1  = 150.0" "CRVAL2  = 2.2" "CRPIX1  = 8.0" "CRPIX2  = 8.0" "CD1_1   = -2.0E-5" "CD1_2   = 0.0" "CD2_1   = 0.0" "CD2_2   = 2.0E-5")
pair() { $F make "$1" 15 15 "$2" "EXPTIME = 100.0" "BUNIT   = 'electron'" "${Wp[@]}" "${@:3}"; }
pair p1.fits 10 "MAGZERO = 30.0"; pair p2.fits 11 "MAGZERO = 30.0"; pair p3.fits 12; pair p4.fits 13 "SKYSUB  =                    T" "MAGZERO = 30.0"
cp p1.fits copy.fits; ln -s p1.fits link.fits
ok "two exposures" drizzle p1.fits p2.fits -o p.fits
near "their MAGZERO" "$($F card p.fits 1 MAGZERO)" 30.752575 1e-6
for f in p1.fits copy.fits link.fits; do fails "an exposure twice, as $f" 1 drizzle p1.fits $f p2.fits -o twice.fits; done
drizzle p1.fits p3.fits -o p.fits; near "MAGZERO of one of two is not that of their sum" "$($F card p.fits 1 MAGZERO | grep -c .)" 0 0
drizzle p3.fits p1.fits -o p.fits; near "nor in the other order" "$($F card p.fits 1 MAGZERO | grep -c .)" 0 0
fails "sky subtracted from one of two" 1 drizzle p1.fits p4.fits -o p.fits
