# detect: a field made here with known objects; options, outputs, hard cases.
# mk NX NY 'awk expression of x y (from 1)' [CARD...]: a 16-bit FITS image; n() is unit Gaussian noise.
mk() {
    local nx=$1 ny=$2 expr=$3; shift 3
    { printf '%-80s' "SIMPLE  =                    T" "BITPIX  =                   16" "NAXIS   =                    2" \
        "NAXIS1  = $(printf %20d "$nx")" "NAXIS2  = $(printf %20d "$ny")" "$@" END; } >mk.hdr
    local pad=$(( (2880 - $(wc -c <mk.hdr) % 2880) % 2880 ))
    [ $pad -eq 0 ] || printf '%*s' $pad '' >>mk.hdr
    cat mk.hdr
    awk -v nx="$nx" -v ny="$ny" 'function u() { s = (s * 16807) % 2147483647; return s / 2147483647 }
        function n(a, k) { a = -6; for (k = 0; k < 12; k++) a += u(); return a }
        function g(x0, y0, f, w) { return f / (6.2831853 * w * w) * exp(-((x - x0) ^ 2 + (y - y0) ^ 2) / (2 * w * w)) }
        BEGIN { s = 4711; for (y = 1; y <= ny; y++) for (x = 1; x <= nx; x++) {
            v = ('"$expr"'); v = int(v + 32768.5) - 32768; if (v < 0) v += 65536; printf "%c%c", int(v / 256), v % 256 }
            for (i = nx * ny * 2; i % 2880; i++) printf "%c", 0 }'
}
C=("PIXSCALE=                  0.1" "MAGZERO =                 30.0" "GAIN    =                  1.0" "PSFFWHM =                 0.25"
   "EXPTIME =               2000.0" "SETNAME = 'sim1'" "SEED    = '7'" "SHEAR1  =                 0.05"
   "CTYPE1  = 'RA---TAN'" "CTYPE2  = 'DEC--TAN'" "CRVAL1  =                150.0" "CRVAL2  =                  2.2"
   "CRPIX1  =                 80.5" "CRPIX2  =                 80.5" "CD1_1   =            -2.778E-5" "CD2_2   =             2.778E-5")
mk 160 160 '400 + 20 * n() + g(40.3, 50.6, 30000, 2) + g(120.7, 30.2, 10000, 3) + g(60, 120, 20000, 2) + g(69, 120, 15000, 2) + g(130, 130, 5000, 2.5)' "${C[@]}" >f.fits
ok "a field with five objects" detect f.fits -o f.cat
near "objects" "$(grep -vc '^#' f.cat)" 5 0
same "from standard input" f.cat <(detect - <f.fits | sed 's/detect -$/detect f.fits/')
detect -j 2 f.fits -o f2.cat; same "1 and 2 threads: same bytes" f.cat f2.cat
row() { awk -v x="$2" -v y="$3" -v c="$4" '/^#/ { k = split($0, h, " "); next } ($2 - x)^2 + ($3 - y)^2 < 4 { for (i = 2; i <= k; i++) if (h[i] == c) print $(i - 1) }' "$1"; }
near "position of the brightest" "$(row f.cat 40.3 50.6 X_IMAGE)" 40.3 0.03
near "its row" "$(row f.cat 40.3 50.6 Y_IMAGE)" 50.6 0.03
near "AUTO flux of 30000" "$(row f.cat 40.3 50.6 FLUX_AUTO)" 29900 600
near "its magnitude" "$(row f.cat 40.3 50.6 MAG_AUTO)" 18.81 0.03
# 3.5 * sqrt(area pi 49) pixels of noise 20, plus photons
between "FLUXERR_AUTO" "$(row f.cat 40.3 50.6 FLUXERR_AUTO)" 250 420
near "FWHM of sigma 2" "$(row f.cat 40.3 50.6 FWHM_IMAGE)" 4.71 0.1
near "FLUX_RADIUS of sigma 2" "$(row f.cat 40.3 50.6 FLUX_RADIUS)" 2.36 0.08
near "BACKGROUND" "$(row f.cat 40.3 50.6 BACKGROUND)" 400 2
near "BACKRMS" "$(row f.cat 40.3 50.6 BACKRMS)" 20 0.8
near "blended pair flagged 2" "$(row f.cat 60 120 FLAGS)" 2 1
near "its other half" "$(row f.cat 69 120 FLUX_AUTO)" 15000 900
near "right ascension grows to the left" "$(row f.cat 40.3 50.6 ALPHA_J2000)" 150.001117 2e-6
for k in "PIXSCALE 0.1" "MAGZERO 30" "GAIN 1" "EXPTIME 2000" "SETNAME sim1" "SEED 7" "SHEAR1 0.05" "PSFFWHM 0.25"; do
    if [ "$(key f.cat "${k% *}")" = "${k#* }" ]; then pass "keyword $k"; else fail "keyword $k: '$(key f.cat "${k% *}")'"; fi
done
near "AREA" "$(key f.cat AREA)" 0.0711111 1e-6
near "no NaN in the catalogue" "$(grep -v '^#' f.cat | grep -ci nan)" 0 0
for c in NUMBER X_IMAGE Y_IMAGE ALPHA_J2000 DELTA_J2000 FLUX_AUTO FLUXERR_AUTO MAG_AUTO MAGERR_AUTO A_IMAGE B_IMAGE THETA_IMAGE \
    FWHM_IMAGE FLUX_RADIUS ISOAREA_IMAGE BACKGROUND BACKRMS FLUX_MAX STAR_PROB FLAGS; do col f.cat $c >/dev/null || fail "no column $c"; done

# check images, regions, columns, apertures
ok "check images and region" detect f.fits -o g.cat --region f.reg --check-image segmentation=seg.fits --check-image background=b.fits \
    --check-image filtered=fl.fits --check-image objects=ob.fits --check-image rms=r.fits --check-image subtracted=s.fits
same "they leave the catalogue alone" <(grep -v HISTORY f.cat) <(grep -v HISTORY g.cat)
near "ellipses in the region file" "$(grep -c '^ellipse' f.reg)" 5 0
near "segmentation is 32-bit" "$(card seg.fits BITPIX)" 32 0
pix() { dd if="$1" bs=1 skip=$(( $(LC_ALL=C grep -abo 'END *' "$1" | awk -F: '{ print (int($1 / 2880) + 1) * 2880; exit }') + 4 * (($3 - 1) * 160 + $2 - 1) )) count=4 2>/dev/null | od -An -tx1 | tr -d ' \n'; }
near "its label is NUMBER" "$((16#$(pix seg.fits 40 51)))" "$(row f.cat 40.3 50.6 NUMBER)" 0
near "0 on the sky" "$((16#$(pix seg.fits 10 150)))" 0 0
if command -v fitsverify >/dev/null; then for f in seg b fl ob r s; do ok "fitsverify $f.fits" fitsverify -q $f.fits; done; else skip "fitsverify is not installed"; fi
detect f.fits --columns NUMBER,X_IMAGE,FLUX_ISO,XWIN_IMAGE -o c.cat
near "columns asked for" "$(grep -v '^#' c.cat | head -1 | wc -w)" 4 0
detect f.fits --apertures 0.6,1.2 --columns +KRON_RADIUS -o a.cat
near "aperture of radius 6 px, sigma 2" "$(row a.cat 40.3 50.6 FLUX_APER_2)" 29670 700
near "and of 3 px" "$(row a.cat 40.3 50.6 FLUX_APER)" 20150 400
fails "a column that does not exist" 2 detect f.fits --columns NUMBER,NOPE -o x.cat
grep -q "'NOPE'" cmd.err && pass "and is named" || fail "it is not named: $(cat cmd.err)"
fails "before the image is read" 2 detect none.fits --columns +NOPE
fails "an aperture's column without apertures" 1 detect f.fits --columns NUMBER,MAG_APER -o x.cat
detect f.fits --apertures 0.6,1.2 --columns NUMBER,X_IMAGE,Y_IMAGE,MAG_APER_2 -o na.cat
near "apertures named in the list: their eight columns" "$(grep -v '^#' na.cat | head -1 | wc -w)" 11 0
detect f.fits -o u.fits
near "flux in electrons, where GAIN is 1 and BUNIT missing" "$(fold -w80 u.fits | grep -ac "^TUNIT.*'electron'")" 5 0
sed "s/^\(.*\)EXPTIME =               2000.0 /\1BUNIT   = 'nJy     '           /" f.fits >njy.fits
detect njy.fits -o u.fits
near "in BUNIT, where that is something else" "$(fold -w80 u.fits | grep -ac "^TUNIT.*'nJy *'")" 5 0
perl -pe 's/CRVAL1  = .{20}/sprintf "%-30s", "CRVAL1  = 150,5"/e' f.fits >comma.fits
detect comma.fits -o comma.cat 2>comma.err
near "a comma in CRVAL1: no positions on the sky" "$(grep -c '^# Column.*ALPHA_J2000' comma.cat)" 0 0
grep -qx 'detect: comma.fits: WCS: CRVAL1 is not a number: correct the keyword: no positions on the sky' comma.err && pass "and a warning" || fail "warning: $(cat comma.err)"
fails "a check image that does not exist" 2 detect f.fits --check-image what=x.fits
fails "an even median filter" 2 detect f.fits --back-filter 2
[ ! -e x.cat ] && pass "no output after an error" || fail "x.cat exists"

# thresholds, cleaning, deblending, negative image
near "high threshold" "$(detect f.fits -t 200 | grep -vc '^#')" 0 0
near "without deblending the pair is one" "$(detect f.fits --deblend-contrast 1 | grep -vc '^#')" 4 0
near "same with one level" "$(detect f.fits --deblend-levels 1 | grep -vc '^#')" 4 0
# about 1.6e-4 per pixel for 5 pixels above 3 sigma of noise filtered with 2.5 px
between "false detections on the negated image at 3 sigma" "$(detect --negative f.fits)" 1 12
near "at 5 sigma" "$(detect --negative -t 5 f.fits)" 0 0
detect f.fits --threshold 1.5 --threshold-noise pixel -v -o /dev/null 2>v.txt
between "-v tells the threshold in pixel noise" "$(sed -n 's/.*threshold \([0-9.]*\) rms.*/\1/p' v.txt)" 1.4999 1.5001

# weights and masks
mk 160 160 '(x > 35 && x < 46 && y > 40 && y < 60) ? 0 : 1' >w.fits
mk 160 160 '(x > 35 && x < 46 && y > 40 && y < 60) ? 1 : 0' >m.fits
near "zero weight hides an object" "$(detect f.fits -w w.fits | grep -v '^#' | awk '($2 - 40.3)^2 + ($3 - 50.6)^2 < 9 && $20 < 32' | wc -l)" 0 0
near "so does a mask" "$(detect f.fits --mask m.fits | grep -v '^#' | awk '($2 - 40.3)^2 + ($3 - 50.6)^2 < 9 && $20 < 32' | wc -l)" 0 0
near "the others stay" "$(detect f.fits -w w.fits | awk '!/^#/ && $20 < 32' | wc -l)" 4 0
mk 160 160 '20' >rms.fits
near "rms map of 20: the same objects" "$(detect f.fits -w rms.fits --weight-type rms | grep -vc '^#')" 5 0
near "rms map of 20000: none" "$(detect f.fits -w <(mk 160 160 20000) --weight-type rms | grep -vc '^#')" 0 0
mk 160 160 'x < 110 ? 4 : 1' >var.fits
mk 160 160 'x < 110 ? 1 : 4' >inv.fits
detect f.fits -w var.fits --weight-type variance -o var.cat; detect f.fits -w inv.fits -o inv.cat
same "relative variances of 4 and 1 are weights of 1 and 4" <(grep -v '^#' var.cat) <(grep -v '^#' inv.cat)
near "twice the noise where the variance is four times that of the rest" "$(awk "BEGIN { print $(row var.cat 40.3 50.6 BACKRMS) / $(row var.cat 120.7 30.2 BACKRMS) }")" 2 0.001
mk 160 160 '(x > 35 && x < 46 && y > 40 && y < 60) ? 0 : 9' >var.fits
near "variance 0 is no weight: an object is hidden" "$(detect f.fits -w var.fits --weight-type variance | awk '!/^#/ && ($2 - 40.3)^2 + ($3 - 50.6)^2 < 9 && $20 < 32' | wc -l)" 0 0
near "and the others stay" "$(detect f.fits -w var.fits --weight-type variance | awk '!/^#/ && $20 < 32' | wc -l)" 4 0
mk 80 160 1 >small.fits
fails "a weight map of another size" 1 detect f.fits -w small.fits

# values times 1e20 and 1e-20
for e in 20 -20; do
    mk 160 160 '400 + 20 * n() + g(40.3, 50.6, 30000, 2) + g(120.7, 30.2, 10000, 3) + g(60, 120, 20000, 2) + g(69, 120, 15000, 2) + g(130, 130, 5000, 2.5)' \
        "BSCALE  =                1E$e" "MAGZERO =                 30.0" "PIXSCALE=                  0.1" "PSFFWHM =                 0.25" >s.fits
    detect s.fits -o s.cat
    near "objects in values times 1e$e" "$(grep -vc '^#' s.cat)" 5 0
    near "no NaN there" "$(grep -v '^#' s.cat | grep -ci nan)" 0 0
done

# hard images: an answer or one line, never a NaN in an unflagged row
mk 64 64 7 >const.fits
fails "a constant image" 1 detect const.fits
ok "a constant image with its noise given" detect const.fits --rms 1 -q -o const.cat
near "holds nothing" "$(grep -vc '^#' const.cat)" 0 0
mk 64 64 '(x + y) % 2 ? 100 : -100' >checker.fits
ok "checkerboard" detect checker.fits -q -o k.cat
mk 1 1 5 >one.fits
fails "a single pixel has no noise" 1 detect -q one.fits
ok "1 x 1 with noise given" detect -q --rms 1 --min-area 1 one.fits -o o.cat
for size in "1 300" "300 1" "3 3" "2 200"; do
    mk ${size% *} ${size#* } '100 + 5 * n() + (x == 1 && y == 3 ? 200 : 0)' >thin.fits
    ok "${size% *} x ${size#* }" detect -q --min-area 1 thin.fits -o thin.cat
    near "its rows: NaN" "$(grep -v '^#' thin.cat | grep -ci nan)" 0 0
done
mk 128 128 'x > 8 ? 1000 + 3 * n() : 3 * n()' >plateau.fits
ok "a plateau over nearly everything" detect -q plateau.fits -o p.cat
mk 200 200 '3 * n() + (x % 3 == 1 && y % 3 == 1 && x > 90 ? 3000 : 0)' >many.fits
ok "thousands of one-pixel objects" detect -q -k 0 --min-area 1 --rms 3 many.fits -o many.cat
between "all 2479 found, and noise above 3 sigma" "$(awk '!/^#/' many.cat | wc -l)" 2479 2520
near "none with NaN" "$(grep -v '^#' many.cat | grep -ci nan)" 0 0
{ head -c 2880 const.fits | sed 's/BITPIX  =                   16/BITPIX  =                  -32/'; awk 'BEGIN { for (i = 0; i < 4096; i++) printf "\177\300%c%c", 0, 0; for (i = 16384; i % 2880; i++) printf "%c", 0 }'; } >nan.fits
fails "all NaN" 1 detect nan.fits
grep -q "no usable pixel" cmd.err || fail "all NaN: $(cat cmd.err)"

# further fractions, another image for the photometry, apertures drawn, FITS_LDAC
detect f.fits --flux-fraction 0.5,0.2,0.8 -o fr.cat
near "FLUX_RADIUS of 0.5 is the default's" "$(row fr.cat 40.3 50.6 FLUX_RADIUS)" "$(row f.cat 40.3 50.6 FLUX_RADIUS)" 0
near "of 0.2, sigma 2 and the pixel" "$(row fr.cat 40.3 50.6 FLUX_RADIUS_2)" 1.36 0.06
near "of 0.8" "$(row fr.cat 40.3 50.6 FLUX_RADIUS_3)" 3.61 0.15
mk 160 160 '100 + 10 * n() + g(40.3, 50.6, 9000, 2) + g(120.7, 30.2, 20000, 3)' "${C[@]/MAGZERO =                 30.0/MAGZERO =                 31.0}" >other.fits
ok "detect in one image, measure in another" detect f.fits --measure other.fits --columns +FLUX_ISO -o dual.cat
near "the same objects" "$(grep -vc '^#' dual.cat)" 5 0
near "at the same places" "$(row dual.cat 40.3 50.6 X_IMAGE)" "$(row f.cat 40.3 50.6 X_IMAGE)" 0
near "AUTO flux of the other" "$(row dual.cat 40.3 50.6 FLUX_AUTO)" 8970 300
near "isophotal flux of the other" "$(row dual.cat 40.3 50.6 FLUX_ISO)" 8800 300
near "its zero point" "$(row dual.cat 40.3 50.6 MAG_AUTO)" 21.12 0.04
near "its sky" "$(row dual.cat 40.3 50.6 BACKGROUND)" 100 1.5
near "nothing where it is empty" "$(row dual.cat 130 130 FLUX_AUTO)" 0 700
same "measured in itself: the catalogue of one image" <(grep -v '^#' f.cat) <(detect f.fits --measure f.fits | grep -v '^#')
mk 160 160 'x < 110 ? 1 : 4' >ow.fits
detect f.fits --measure other.fits --measure-weight ow.fits --columns +FLUXERR_ISO -o dw.cat
near "its own weight map: four times the weight, half the noise" "$(awk "BEGIN { print $(row dw.cat 120.7 30.2 BACKRMS) / $(row dw.cat 40.3 50.6 BACKRMS) }")" 0.5 0.001
near "at the noise measured" "$(row dw.cat 40.3 50.6 BACKRMS)" 10 1
mk 160 160 'x < 100 ? 1 : 0' >ow.fits
detect f.fits --measure other.fits --measure-weight ow.fits -o dw.cat
near "no weight there: flagged" "$(row dw.cat 120.7 30.2 FLAGS | awk '{ print int($1 / 32) % 2 }')" 1 0
near "without flux" "$(row dw.cat 120.7 30.2 FLUX_AUTO)" 0 0
fails "weight of another image without that image" 2 detect f.fits --measure-weight ow.fits
mk 80 160 1 >small.fits
fails "another image of another size" 1 detect f.fits --measure small.fits
ok "apertures drawn" detect f.fits --apertures 1.2 --check-image apertures=ap.fits -o ap.cat
hexreal() { perl -e 'print unpack "f>", pack "H*", $ARGV[0]' "$1"; }
near "a pixel on the circle of 6 px" "$(hexreal "$(pix ap.fits 46 51)")" 200 15
detect f.fits -o f.ldac; detect f.fits --format ldac -o f3.fits
same "FITS_LDAC by name and by option" <(tail -c +2881 f.ldac | tr -d '\0' | sed 's/CHECKSUM=[^/]*//g; s/f3.fits/f.ldac/g' | head -c 2000) <(tail -c +2881 f3.fits | tr -d '\0' | sed 's/CHECKSUM=[^/]*//g' | head -c 2000)
grep -aq "EXTNAME = 'LDAC_IMHEAD'" f.ldac && grep -aq "EXTNAME = 'LDAC_OBJECTS'" f.ldac && pass "its two tables" || fail "no LDAC tables"
if command -v fitsverify >/dev/null; then ok "fitsverify f.ldac" fitsverify -e -q f.ldac; ok "fitsverify ap.fits" fitsverify -q ap.fits; fi
if /usr/bin/python3 -c 'import astropy' 2>/dev/null; then
    near "astropy reads the header and the rows" "$(/usr/bin/python3 -c "
from astropy.io import fits
h = fits.open('f.ldac'); c = h[1].data[0][0]
print(len(h[2].data) if len(c) and ''.join(c).startswith('SIMPLE') and 'CRVAL1' in ''.join(c) else 0)")" 5 0
else skip "astropy is not there: FITS_LDAC is not read by others"; fi

# more hard images, in float32
F="$TOP/tests/fits.pl"
perl "$F" make zero.fits 64 64 0
fails "all zero" 1 detect zero.fits
perl "$F" make flat.fits 200 200 '1e7 + (($x * 7919 + $y * 104729 + $x * $y * 31) % 7) - 3 + ($x > 95 && $x < 105 && $y > 95 && $y < 105 ? 12 : 0)'
ok "sky 1e7" detect -q flat.fits -o flat.cat
near "the object of 12 per pixel on it" "$(row flat.cat 101 101 FLUX_ISO 2>/dev/null; awk '!/^#/ && ($2 - 101)^2 + ($3 - 101)^2 < 2 && !n++ { print 1 }' flat.cat)" 1 0
perl "$F" make spiral.fits 201 201 'my ($u, $v) = ($x - 100, $y - 100); my $r = sqrt($u * $u + $v * $v); my $t = atan2($v, $u); my $k = ($r / 6 - $t / 6.2831853); $k -= int($k) - ($k < 0); ($r > 4 && $r < 90 && $k < 0.4 ? 100 : 0) + (($x * 13 + $y * 7) % 5)'
ok "one spiral component" detect -q --rms 2 -k 0 --deblend-contrast 1 --back-size 201 spiral.fits -o spiral.cat
near "is one object" "$(grep -vc '^#' spiral.cat)" 1 0
ok "the same with deblending" detect -q --rms 2 -k 0 --back-size 201 spiral.fits -o spiral.cat
near "no NaN in it" "$(grep -v '^#' spiral.cat | grep -ci nan)" 0 0
perl "$F" make islands.fits 160 160 'my $g = 3 * exp(-(($x - 80) ** 2 + ($y - 80) ** 2) / 18) * 100; my $v = 50 + (($x * 31 + $y * 17 + $x * $y) % 11) - 5 + $g; $v = 200 if $v > 200; ($x - 30) ** 2 + ($y - 30) ** 2 < 60 ? "nan" + 0 : ($x - 120) ** 2 + ($y - 40) ** 2 < 40 ? "inf" + 0 : $v' "SATURATE=                200.0"
ok "islands of NaN and infinity, a saturated plateau" detect -q islands.fits -o islands.cat
near "the plateau is there, flagged 4" "$(awk '/^#/ { k = split($0, h, " "); for (i = 2; i <= k; i++) c[h[i]] = i - 1; next } ($2 - 81)^2 + ($3 - 81)^2 < 2 { print int($c["FLAGS"] / 4) % 2 }' islands.cat)" 1 0
near "no NaN there" "$(grep -v '^#' islands.cat | grep -ci nan)" 0 0
mk 160 160 'x > 80 ? 0 : 1' >half.fits
ok "half without weight" detect -q f.fits -w half.fits -o half.cat
near "its objects, and none beyond" "$(awk '!/^#/ { n++; if ($2 > 82) b++ } END { print n + 100 * b }' half.cat)" 3 0
near "no NaN among them" "$(grep -v '^#' half.cat | grep -ci nan)" 0 0
head -c 30000 f.fits >cut.fits
fails "truncated input" 1 detect cut.fits
fails "missing input" 1 detect none.fits
fails "output is the input" 1 detect f.fits -o f.fits
ok "--check does nothing" detect --check f.fits -o never.cat
[ ! -e never.cat ] && pass "--check wrote no file" || fail "--check wrote never.cat"
if [ -e /dev/full ]; then fails "full device" 1 detect f.fits -o /dev/full; fi

# every output has a file of its own; header numbers are numbers; PIXSCALE agrees with the WCS
galgen --field 20 --stars -n 16 | simage - -x 0.1 --size 200,200 | addnoise --sky-rate 10 -o one.fits
fails "check image and catalogue of one name" 2 detect one.fits --check-image rms=d -o ./d
fails "region and catalogue of one name" 2 detect one.fits --region d -o d
fails "two check images of one name" 2 detect one.fits --check-image rms=z --check-image background=z -o d
fails "check image and catalogue on standard output" 2 detect one.fits --check-image rms=-
sed 's/^\(.*PIXSCALE= *\)0\.1 /\10.2 /' one.fits >two.fits
fails "PIXSCALE that contradicts the WCS" 1 detect two.fits -o d
sed "s/GAIN    =                  1.0 /GAIN    = 'one     '           /" one.fits >three.fits
if cmp -s one.fits three.fits; then fail "GAIN was not replaced"; fi
fails "GAIN that is no number" 1 detect three.fits -o d
detect one.fits --check-image segmentation="$PWD/seg.fits" -o path.cat
if grep -q "HISTORY.*$PWD" path.cat; then fail "a path in HISTORY"; else pass "no path in HISTORY"; fi
detect one.fits -o table.fits
if command -v fitsverify >/dev/null; then ok "fitsverify finds nothing in a table" fitsverify -q table.fits; else skip "fitsverify is not installed"; fi
