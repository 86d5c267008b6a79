# detect on images that break detectors, with every column: a clear error or flagged rows, never a NaN, linear time.
F="$TOP/tests/fits.pl"
ALL=+ISOAREAF_IMAGE,FLUX_ISO,FLUXERR_ISO,MAG_ISO,MAGERR_ISO,KRON_RADIUS,X2_IMAGE,Y2_IMAGE,XY_IMAGE,ERRX2_IMAGE,ERRY2_IMAGE,ERRXY_IMAGE
ALL=$ALL,ERRA_IMAGE,ERRB_IMAGE,ERRTHETA_IMAGE,ELLIPTICITY,XWIN_IMAGE,YWIN_IMAGE,MU_MAX,THRESHOLD
ALL=$ALL,XPEAK_IMAGE,YPEAK_IMAGE,XMIN_IMAGE,XMAX_IMAGE,YMIN_IMAGE,YMAX_IMAGE
K=("PIXSCALE=                  0.1" "MAGZERO =                 30.0" "GAIN    =                  1.0" "PSFFWHM =                 0.25")
# img FILE NX NY EXPRESSION CARD...: n() in it is a normal deviate
N='do { $main::s //= 4711; my $a = -6; for (1 .. 12) { $main::s = ($main::s * 16807) % 2147483647; $a += $main::s / 2147483647 } $a }'
img() { perl "$F" make "$1" "$2" "$3" "${4//n()/$N}" "${@:5}"; }
# rows WHAT LO HI FILE OPTIONS: so many rows, every column finite
rows() {
    local what=$1 lo=$2 hi=$3; shift 3
    if ! detect -q --columns "$ALL" --apertures 0.3,1 --flux-fraction 0.5,0.2,0.9 "$@" -o rows.cat 2>cmd.err; then fail "$what: $(head -c 300 cmd.err)"; return; fi
    between "$what: rows" "$(grep -vc '^#' rows.cat)" "$lo" "$hi"
    near "$what: values that are not finite" "$(grep -v '^#' rows.cat | grep -Eio '(^| )[-+]?(nan|inf)' | wc -l)" 0 0
}
# flag BIT X Y: 1 when the object nearest there, within 3 pixels, has it
flag() { awk -v b="$1" -v x="$2" -v y="$3" '/^#/ { k = split($0, h, " "); for (i = 2; i <= k; i++) c[h[i]] = i - 1; next }
    { d = ($c["X_IMAGE"] - x)^2 + ($c["Y_IMAGE"] - y)^2; if (d < 9 && (!n++ || d < m)) { m = d; f = int($c["FLAGS"] / b) % 2 } } END { print n ? f : "none" }' rows.cat; }

img const.fits 64 64 7 "${K[@]}"
fails "constant" 1 detect -q const.fits
grep -q 'no noise' cmd.err || fail "constant: not said: $(cat cmd.err)"
rows "constant, noise given" 0 0 const.fits --rms 1
img zero.fits 64 64 0 "${K[@]}"
fails "zero" 1 detect -q zero.fits
rows "zero, noise given" 0 0 zero.fits --rms 1
img nan.fits 64 64 '"nan" + 0' "${K[@]}"
fails "all NaN" 1 detect -q nan.fits
fails "all NaN, noise given" 1 detect -q --rms 1 nan.fits
img inf.fits 64 64 '9 ** 9 ** 9' "${K[@]}"
fails "all infinite" 1 detect -q inf.fits
img checker.fits 64 64 '($x + $y) % 2 ? 100 : -100' "${K[@]}"
rows "checkerboard" 0 0 checker.fits
rows "checkerboard, unfiltered: bright pixels touch at their corners" 1 1 checker.fits -k 0 --min-area 1 -t 0.5
near "all of them" "$(col rows.cat ISOAREA_IMAGE)" 2048 0
near "and their light" "$(col rows.cat FLUX_ISO)" 204800 0.01
img pixel.fits 64 64 '5 * n() + ($x == 30 && $y == 40 ? 1000 : 0)' "${K[@]}"
rows "a single bright pixel" 1 1 pixel.fits -k 0 --min-area 1 -t 10
near "at its place" "$(col rows.cat X_IMAGE)" 31 1e-4
near "of its flux (noise 5, isophote of one pixel)" "$(col rows.cat FLUX_ISO)" 1000 15
rows "filtered" 1 1 pixel.fits -t 10
img corner.fits 64 64 '5 * n() + ($x + $y == 0 ? 1000 : 0)' "${K[@]}"
rows "a single bright pixel in the corner" 1 1 corner.fits -k 0 --min-area 1 -t 10
near "flagged 8 and 16" "$(flag 8 1 1)$(flag 16 1 1)" 11 0
img one.fits 1 1 5 "${K[@]}"
fails "1 x 1 has no noise" 1 detect -q one.fits
rows "1 x 1, noise given: all sky" 0 0 one.fits --rms 1 --min-area 1
for size in "3 3" "1 200" "200 1" "2 150" "150 2"; do
    img thin.fits ${size% *} ${size#* } '100 + 5 * n() + ($x == 1 && $y < 3 || $y == 1 && $x < 3 ? 300 : 0)' "${K[@]}"
    # 3 x 3 are too few to tell sky from object; noise gives at most one of a pixel or two in 200 to 300 pixels
    [ "$size" = "3 3" ] && few="0 0" || few="1 2"
    for rms in "--rms 5" ""; do
        # shellcheck disable=SC2086
        rows "${size/ / x } ${rms:-noise measured}" $few thin.fits --min-area 1 $rms
        [ "$size" = "3 3" ] || near "the bright pixels" "$(col rows.cat FLUX_MAX | sort -gr | head -1)" 300 20
        [ "$size" = "3 3" ] || near "at their place" "$(awk '/^#/ { k = split($0, h, " "); for (i = 2; i <= k; i++) c[h[i]] = i - 1; next } $c["FLUX_MAX"] > 250 { print $c["X_IMAGE"] + $c["Y_IMAGE"] }' rows.cat)" 3.6 0.6
    done
done
img whole.fits 128 128 '$x + $y < 2 ? 0 : 1000 + 3 * n()' "${K[@]}"
rows "a plateau over the whole image is sky" 0 0 whole.fits
img frame.fits 128 128 '($x > 1 ? 1000 : 0) + n() / 100' "${K[@]}"
rows "a plateau over all but two columns is sky" 0 0 frame.fits
img slab.fits 128 128 '($x < 40 ? 0 : 1000) + 3 * n()' "${K[@]}"
rows "a plateau over two thirds is sky" 0 0 slab.fits
img spiral.fits 201 201 'my ($u, $v) = ($x - 100, $y - 100); my $r = sqrt($u * $u + $v * $v); my $t = atan2($v, $u); my $k = ($r / 6 - $t / 6.2831853);
    $k -= int($k) - ($k < 0); ($r > 4 && $r < 90 && $k < 0.4 ? 100 : 0) + 2 * n()' "${K[@]}"
rows "a spiral" 1 1 spiral.fits --rms 2 -k 0 --deblend-contrast 1 --back-size 201
rows "a spiral, deblended: no part has .005 of its light above the saddle" 1 1 spiral.fits --rms 2 -k 0 --back-size 201
img high.fits 200 200 '1e7 + int(10 + n()) - 10 + (($x - 80) ** 2 + ($y - 120) ** 2 < 60 ? 1 : 0)' "${K[@]}"
rows "sky 1e7, an object of 1 per pixel in noise of 1" 1 2 high.fits -k 0.6 -t 5
near "at its place" "$(awk '/^#/ { k = split($0, h, " "); for (i = 2; i <= k; i++) c[h[i]] = i - 1; next } { print sqrt(($c["X_IMAGE"] - 81)^2 + ($c["Y_IMAGE"] - 121)^2) }' rows.cat | sort -g | head -1)" 0 1
near "its sky" "$(col rows.cat BACKGROUND | head -1)" 1e7 1
for e in 1e20 1e-20 -1; do
    img scaled.fits 160 160 "$e * (400 + 20 * n() + 30000 / 25.1327 * exp(-((\$x - 39.3) ** 2 + (\$y - 49.6) ** 2) / 8) + 15000 / 25.1327 * exp(-((\$x - 99.3) ** 2 + (\$y - 49.6) ** 2) / 8))" "${K[@]}"
    if [ $e = -1 ]; then rows "negated" 0 0 scaled.fits -t 5; continue; fi
    rows "values times $e" 2 2 scaled.fits
    near "flux over the factor, and of the other half of it" "$(col rows.cat FLUX_AUTO | sort -g | awk -v e=$e '{ v[NR] = $1 / e } END { print v[2] / v[1] }')" 2 0.1
done
# values whose filtered sums leave float32: found where they are, flagged where a flux is beyond it, in FITS tables too
for v in 1e37 2e38 3e38; do
    img huge.fits 100 100 "(\$x > 45 && \$y > 50) ? $v : \$x * 7919 % 13" "${K[@]}"
    rows "a corner of $v" 1 20 huge.fits
    near "the largest object holds it, flagged 16" "$(awk '/^#/ { k = split($0, h, " "); for (i = 2; i <= k; i++) c[h[i]] = i - 1; next } $c["FLUX_MAX"] > 9e36 && $c["X_IMAGE"] > 60 && $c["Y_IMAGE"] > 60 { s += int($c["FLAGS"] / 16) % 2 } END { print s + 0 }' rows.cat)" 1 0
    detect -q --columns +FLUX_ISO huge.fits -o huge.cat.fits
    cutcat --only-where --where "FLUX_MAX>9e36" huge.cat.fits -o huge.txt 2>cmd.err
    near "finite in its FITS table" "$(col huge.txt FLUX_ISO | awk '$1 > 9e36 && $1 < 3.5e38' | wc -l)" 1 0
    for side in 3 5; do
        img huge.fits 100 100 "abs(\$x - 50) < $side / 2 && abs(\$y - 40) < $side / 2 ? $v : \$x * 7919 % 13" "${K[@]}"
        rows "a square of $side with $v" 1 30 huge.fits
        near "at its place" "$(awk '/^#/ { k = split($0, h, " "); for (i = 2; i <= k; i++) c[h[i]] = i - 1; next } $c["FLUX_MAX"] > 9e36 { print sqrt(($c["X_IMAGE"] - 51)^2 + ($c["Y_IMAGE"] - 41)^2) }' rows.cat)" 0 0.01
    done
done
img huge.fits 100 100 '1e37 * n() + 1e40 * exp(-(($x - 50) ** 2 + ($y - 40) ** 2) / 18)' "${K[@]}"
rows "a Gaussian whose centre is infinite, on noise of 1e37" 1 3 huge.fits -t 5
near "flagged 32" "$(flag 32 51 41)" 1 0
img huge.fits 100 100 '($x + $y) % 2 ? 3e38 : -3e38' "${K[@]}"
rows "a checkerboard of +-3e38, filtered" 0 0 huge.fits --rms 1e30
img sat.fits 160 160 'my $v = 50 + 3 * n() + 3000 * exp(-(($x - 80) ** 2 + ($y - 80) ** 2) / 200) + 300 * exp(-(($x - 30) ** 2 + ($y - 120) ** 2) / 18); $v > 200 ? 200 : $v' "${K[@]}" "SATURATE=                200.0"
rows "saturated plateaus" 2 4 sat.fits
near "the large one flagged 4" "$(flag 4 81 81)" 1 0
near "the small one too" "$(flag 4 31 121)" 1 0
img islands.fits 160 160 'my $g = 300 * exp(-(($x - 80) ** 2 + ($y - 80) ** 2) / 18) + 300 * exp(-(($x - 37) ** 2 + ($y - 30) ** 2) / 18);
    ($x - 30) ** 2 + ($y - 30) ** 2 < 60 ? "nan" + 0 : ($x - 120) ** 2 + ($y - 40) ** 2 < 40 ? 9 ** 9 ** 9 : ($x - 84) ** 2 + ($y - 80) ** 2 < 3 ? -9 ** 9 ** 9 : 50 + 4 * n() + $g' "${K[@]}"
rows "islands of NaN and infinity, objects that touch them" 2 4 islands.fits
near "object with a hole of minus infinity flagged 32" "$(flag 32 80 81)" 1 0
near "object beside NaN flagged 32" "$(awk '/^#/ { k = split($0, h, " "); for (i = 2; i <= k; i++) c[h[i]] = i - 1; next } ($c["X_IMAGE"] - 39)^2 + ($c["Y_IMAGE"] - 31)^2 < 50 { print int($c["FLAGS"] / 32) % 2; exit }' rows.cat)" 1 0
# bright objects cut by dead columns, dead rows and a hole stay in one piece, where they are; deeper holes stay holes
img cut.fits 200 200 'my $g = 0; for my $p ([41, 40], [120, 41], [40, 121], [121, 121], [160, 160]) { $g += 5000 * exp(-(($x - $p->[0]) ** 2 + ($y - $p->[1]) ** 2) / 12.5) }
    ($x > 37 && $x < 43 && $y < 80) || ($y > 118 && $y < 123 && $x < 80) || (abs($x - 120) < 3 && abs($y - 42) < 3) || $x > 183 ? "nan" + 0 : 50 + 4 * n() + $g' "${K[@]}"
rows "objects cut by dead columns and rows" 5 5 cut.fits -t 10
for p in 41,40 120,41 40,121 121,121 160,160; do
    near "cut or not, the object at $p is there" "$(awk -v p="$p" 'BEGIN { split(p, q, ",") } /^#/ { k = split($0, h, " "); for (i = 2; i <= k; i++) c[h[i]] = i - 1; next }
        { d = sqrt(($c["X_IMAGE"] - 1 - q[1])^2 + ($c["Y_IMAGE"] - 1 - q[2])^2); if (!n++ || d < m) m = d } END { print m }' rows.cat)" 0 0.6
done
near "the cut ones flagged 32, not the others" "$(flag 32 42 41)$(flag 32 121 42)$(flag 32 41 122)$(flag 32 122 122)$(flag 32 161 161)" 11100 0
img noise.fits 200 200 '50 + 4 * n()' "${K[@]}"
perl "$F" make stripes.fits 200 200 '$x % 20 < 8 ? 0 : 1'
near "bridges between noise are no objects: stripes of 8 dead columns" "$(detect -q -t 2 -k 0 --min-area 4 --rms 4 -w stripes.fits noise.fits | grep -vc '^#')" 0 "$(detect -q -t 2 -k 0 --min-area 4 --rms 4 noise.fits | grep -vc '^#')"
img field.fits 160 160 '100 + 4 * n() + 300 * exp(-(($x - 80) ** 2 + ($y - 40) ** 2) / 18) + 300 * exp(-(($x - 40) ** 2 + ($y - 100) ** 2) / 18)' "${K[@]}"
img half.fits 160 160 '$x > 79 ? 0 : 1'
rows "half without weight, an object across the border" 2 2 field.fits -w half.fits
near "which is flagged 32" "$(awk '/^#/ { k = split($0, h, " "); for (i = 2; i <= k; i++) c[h[i]] = i - 1; next } $c["Y_IMAGE"] < 60 { print int($c["FLAGS"] / 32) % 2 }' rows.cat)" 1 0
rows "its other half in the mask" 2 2 field.fits --mask <(perl "$F" make mask.fits 160 160 '$x > 79 ? 1 : 0'; cat mask.fits)
rows "measured in an image whose other half has no weight" 2 2 field.fits -t 5 --measure field.fits --measure-weight half.fits
near "flagged 32 there" "$(flag 32 81 41)" 1 0
img edge.fits 120 120 '10 + n() + 100 * exp(-($x ** 2 + $y ** 2) / 18) + 100 * exp(-(($x - 119) ** 2 + ($y - 60) ** 2) / 18)' "${K[@]}"
rows "objects cut by the border" 2 2 edge.fits
near "flagged 8" "$(awk '/^#/ { k = split($0, h, " "); for (i = 2; i <= k; i++) c[h[i]] = i - 1; next } { s += int($c["FLAGS"] / 8) % 2 } END { print s }' rows.cat)" 2 0

# a million one-pixel objects: all found, time linear
dots() { perl -e 'my ($n) = @ARGV; my @c = ("SIMPLE  =                    T", "BITPIX  =                  -32", "NAXIS   =                    2",
    sprintf("NAXIS1  = %20d", $n), sprintf("NAXIS2  = %20d", $n), "PIXSCALE=                  0.1", "GAIN    =                  1.0", "MAGZERO =                 30.0", "END");
    my $h = join "", map { sprintf "%-80s", $_ } @c; print $h . " " x (2880 - length $h); my $dot = (pack("f>", 0) . pack("f>", 3000) . pack("f>", 0)) x ($n / 3); my $no = pack("f>", 0) x $n;
    print $no, $dot, $no for 1 .. $n / 3; print "\0" x ((2880 - $n * $n * 4 % 2880) % 2880)' "$1"; }
for n in 750 3000; do
    dots $n >dots.fits
    TIMEFORMAT='%U'
    { time detect -q -k 0 --min-area 1 --rms 3 dots.fits -o dots.cat.fits 2>cmd.err; } 2>time.txt
    between "$((n * n / 9)) one-pixel objects: all found" "$(card_of_rows() { fold -w80 "$1" | grep -a '^NAXIS2  =' | tail -1 | tr -dc '0-9 ' | awk '{ print $2 }'; }; card_of_rows dots.cat.fits)" $((n * n / 9)) $((n * n / 9))
    eval "t$n=$(cat time.txt)"
done
between "16 times as many: processor time over 16 times the time" "$(awk "BEGIN { t = $t750 > 0.02 ? $t750 : 0.02; print $t3000 / 16 / t }")" 0.02 2
# progress: on a terminal after half a second, gone at the end; never into a file, never with -q
if command -v script >/dev/null; then
    slow="-k 0 --min-area 1 --rms 3 --columns $ALL --apertures 0.3,1 dots.fits -o bar.cat.fits"
    script -qec "detect $slow" /dev/null </dev/null >bar.txt 2>&1
    near "progress on a terminal: rising" "$(tr '\r' '\n' <bar.txt | sed -n 's/^detect \[#* *\] *\([0-9]*\)%.*/\1/p' | awk 'NR == 1 { a = $1 } $1 < last { bad = 1 } { last = $1 } END { print (NR > 1 && last > a && last <= 100 && !bad) + 0 }')" 1 0
    near "and wiped out at the end" "$(tail -c 6 bar.txt | LC_ALL=C tr -dc '\r\033K[' | od -An -tx1 | tr -d ' \n' | grep -c '0d1b5b4b$')" 1 0
    script -qec "detect -q $slow" /dev/null </dev/null >bar.txt 2>&1
    near "none with -q" "$(wc -c <bar.txt)" 0 0
    detect $slow 2>bar.txt
    near "none into a file" "$(grep -c '%' bar.txt)" 0 0
else skip "script is not there: progress on a terminal is not tested"; fi
