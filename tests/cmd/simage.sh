# simage: flux and positions by hand, header, dither identity, sizes, types,
# shear, threads, faults.
F="perl $TOP/tests/fits.pl"
cat >one.txt <<'END'
# DX DY FLUX TYPE
0 0 2 star
END
stat() { $F stat "$1" "${3:-0}" | cut -d' ' -f"$2"; }
ok "a star without PSF" simage one.txt -x 0.1 --size 5,7 -o star.fits
near "its flux, 2 e/s for 2000 s" "$(stat star.fits 4)" 4000 0
near "the rest is empty" "$(stat star.fits 1)" "$(awk 'BEGIN { printf "%.12f", 4000 / 35 }')" 1e-6
for k in "BUNIT electron" "EXPTIME 2000." "GAIN 1." "PIXSCALE 0.1" "CCDSCALE 0.1" "SHEAR1 0." "ACCURACY 1E-05" "FLOOR 0." "PIXRESP T" "CRPIX1 3." "CRPIX2 4."; do
    set -- $k
    got=$(card star.fits "$1")
    case $2 in
    [a-zA-Z]*) [ "$got" = "$2" ] && pass "$1 = $2" || fail "$1 = $got, not $2" ;;
    *) near "$1" "$got" "$2" 1e-12 ;;
    esac
done
near "MAGZERO" "$(card star.fits MAGZERO)" "$(awk 'BEGIN { printf "%.12f", 26.65 + 2.5 * log(2000) / log(10) }')" 1e-9
[ -z "$(card star.fits PSFFILE)" ] && pass "no PSFFILE without a PSF" || fail "PSFFILE without a PSF"

# a Gaussian galaxy of half-light radius 0.3": half the light inside, pixel integrals by erf
cat >gauss.txt <<'END'
# DX DY MAG TYPE RE
0.02 -0.03 20 gauss 0.3
END
ok "a Gaussian without PSF" simage gauss.txt -x 0.1 --size 61,61 --accuracy 1e-9 -o g.fits
flux=$(awk 'BEGIN { printf "%.6f", 2000 * 10 ^ (-0.4 * (20 - 26.65)) }')
near "flux = 10^(-0.4 (m - zeropoint)) T" "$(stat g.fits 1)" "$(awk -v f="$flux" 'BEGIN { printf "%.9f", f / 3721 }')" "$(awk -v f="$flux" 'BEGIN { print 6e-8 * f / 3721 }')"
ok "sheared along x" simage gauss.txt -x 0.1 --size 61,61 --shear 0.2,0 -o gx.fits
ok "sheared, series of order 8" simage gauss.txt -x 0.1 --size 61,61 --shear 0.05,0.02 --shear-order 8 --accuracy 1e-8 -o g8.fits
ok "sheared, exact" simage gauss.txt -x 0.1 --size 61,61 --shear 0.05,0.02 --accuracy 1e-8 -o ge.fits
ok "sheared, order 1" simage gauss.txt -x 0.1 --size 61,61 --shear 0.05,0.02 --shear-order 1 --accuracy 1e-8 -o g1.fits
peak=$(stat ge.fits 4)
diffmax() { # largest |a - b|
    perl -e 'my @v; for my $f (@ARGV) { open my $h, "<:raw", $f or die; local $/; my $d = <$h>; my $o = 0; my $end = 0;
        until ($end) { my $b = substr($d, $o, 2880); $o += 2880; $end = $b =~ /(?:^|.{80})*?END {77}/s && grep { substr($b, 80 * $_, 80) =~ /^END {77}$/ } 0 .. 35; }
        push @v, [unpack "f>*", substr($d, $o, 4 * $ENV{NPIX})]; }
        my $m = 0; for my $i (0 .. $ENV{NPIX} - 1) { my $x = abs($v[0][$i] - $v[1][$i]); $m = $x if $x > $m } printf "%.9g\n", $m' "$1" "$2"
}
export NPIX=3721
near "order 8 = exact, of the peak" "$(diffmax g8.fits ge.fits | awk -v p="$peak" '{ print $1 / p }')" 0 3e-7
between "order 1 is not, of the peak" "$(diffmax g1.fits ge.fits | awk -v p="$peak" '{ print $1 / p }')" 1e-4 5e-3

# types: a Sersic profile of n = 1/2 is a Gaussian; n = 4 keeps its flux and half-light radius
sed 's/gauss 0.3/sersic 0.3 0.5/; s/ RE/ RE N/' gauss.txt >s05.txt
ok "Sersic n = 0.5" simage s05.txt -x 0.1 --size 61,61 --accuracy 1e-9 -o s05.fits
near "n = 0.5 = Gaussian" "$(diffmax g.fits s05.fits)" 0 0
printf '# DX DY FLUX TYPE RE N Q PA\n0 0 1 sersic 0.5 1 0.6 30\n' >disc.txt
ok "an inclined disc" simage disc.txt -x 0.1 --size 401,401 -T 1 --accuracy 1e-7 -o disc.fits
near "its flux" "$(awk -v m="$(stat disc.fits 1)" 'BEGIN { print m * 160801 }')" 1 1e-3

# PSF from a Gaussian image of rms 0.08": flux, phase, subpixels, interlacing
$F make psf.fits 161 161 'exp(-(($x-80)**2+($y-80)**2)/128)' "PIXELSCL=                 0.01" >/dev/null
S="-p psf.fits --psf-normalise --psf-cutoff 12"
printf '# X_IMAGE Y_IMAGE FLUX TYPE RE\n20.3 21.7 1 gauss 0.2\n22 19 0.3 star 0.1\n' >two.txt
ok "with a PSF" simage two.txt $S -x 0.1 --size 40,42 --shear 0.03,0.04 --accuracy 1e-7 -o p.fits
near "PSF: flux" "$(awk -v m="$(stat p.fits 1)" 'BEGIN { print m * 1680 }')" 2600 0.01
[ "$(card p.fits PSFFILE)" = psf.fits ] && pass "PSFFILE" || fail "PSFFILE $(card p.fits PSFFILE)"
# sum of two widths: Gaussian PSF and Gaussian galaxy: peak of exp(-r2/2s2), s2 = .08^2 + .2^2/(2 ln 2) + pixel
printf '# DX DY FLUX TYPE RE\n0 0 1 gauss 0.2\n' >c.txt
ok "one Gaussian through a Gaussian PSF" simage c.txt $S -x 0.02 --size 141,141 --accuracy 1e-8 -T 1 -o c.fits
near "its peak pixel" "$(stat c.fits 4)" "$(awk 'BEGIN { s = 0.0064 + 0.04 / (2 * log(2)); printf "%.9f", 0.0004 / (2 * atan2(0, -1) * s) * (1 - 0.0004 / (12 * s)) }')" 2e-9
printf '# DX DY FLUX TYPE RE\n0.013 -0.021 1 gauss 0.2\n-0.3 0.4 2 star 0.2\n' >d.txt
ok "detector pixels" simage d.txt $S -x 0.1 --size 32,32 --accuracy 1e-9 -o full.fits
ok "half pixels" simage d.txt $S -x 0.1 -N 2 --size 64,64 --accuracy 1e-9 -o half.fits
near "PIXSCALE of half pixels" "$(card half.fits PIXSCALE)" 0.05 1e-15
near "CCDSCALE of half pixels" "$(card half.fits CCDSCALE)" 0.1 1e-15
perl -e 'my @v; for my $f (["full.fits", 1024], ["half.fits", 4096]) { open my $h, "<:raw", $f->[0] or die; local $/; my $d = <$h>; my $o = 0;
    for (;;) { my $b = substr $d, $o, 2880; $o += 2880; last if grep { substr($b, 80 * $_, 80) =~ /^END {77}$/ } 0 .. 35 } push @v, [unpack "f>*", substr $d, $o, 4 * $f->[1]] }
    my ($m, $p) = (0, 0); for my $y (0 .. 31) { for my $x (0 .. 31) { my $f = $v[0][32 * $y + $x]; my $s = 0;
    $s += $v[1][64 * (2 * $y + $_->[0]) + 2 * $x + $_->[1]] for [0,0],[0,1],[1,0],[1,1]; my $e = abs($s - $f); $m = $e if $e > $m; $p = $f if $f > $p } } printf "%.3g\n", $m / $p' >inter
near "2 x 2 half pixels = one pixel, of the peak (float32)" "$(cat inter)" 0 2e-7

# size from the list
printf '# Keyword: FIELD = 1.24\n# DX DY FLUX TYPE\n0 0 1 star\n' >field.txt
ok "size from FIELD" simage field.txt -x 0.1 -o f.fits
near "NAXIS1 = round(FIELD / scale)" "$(card f.fits NAXIS1)" 12 0
ok "size from FIELD, half pixels" simage field.txt -x 0.1 -N 2 -o f.fits
near "NAXIS1 = N n + N - 1" "$(card f.fits NAXIS1)" 25 0
# a sky position and the same place in pixels
printf '# RA DEC FLUX TYPE\n150 2.2 1 star\n' >sky.txt
ok "RA DEC" simage sky.txt -x 0.1 --size 5,7 -T 4000 -o k.fits
near "the field centre is the middle" "$(diffmax k.fits star.fits)" 0 0

# bytes do not depend on threads or place
galgen --field 20 -n 150 --models m.txt -o scene.txt
for p in "" "$S"; do
    ok "1 thread${p:+ with a PSF}" simage scene.txt --models m.txt $p -x 0.1 --shear 0.03,0.02 -o a.fits
    ok "2 threads${p:+ with a PSF}" simage scene.txt --models m.txt $p -x 0.1 --shear 0.03,0.02 -j 2 -o b.fits
    same "same bytes${p:+ with a PSF}" a.fits b.fits
done
mkdir -p sub && (cd sub && simage ../scene.txt --models ../m.txt -p ../psf.fits --psf-normalise --psf-cutoff 12 -x 0.1 --shear 0.03,0.02 -o b.fits)
same "same bytes in another directory" a.fits sub/b.fits
simage - --models m.txt $S -x 0.1 --shear 0.03,0.02 <scene.txt >c.fits
near "list and image through pipes" "$(diffmax c.fits a.fits)" 0 0
fitsverify -q a.fits >v.txt 2>&1 && pass "fitsverify" || { command -v fitsverify >/dev/null && fail "fitsverify: $(cat v.txt)" || skip "fitsverify is not there"; }

# plan: what is not asked for is not made
simage scene.txt --models m.txt -x 0.1 --check >plan.out 2>plan.txt && [ ! -s plan.out ] && pass "--check writes no image" || fail "--check"
grep -q ' 0 transforms' plan.txt && pass "no PSF: no transform" || fail "no PSF: $(grep transforms plan.txt)"
simage scene.txt --models m.txt $S -x 0.1 --check 2>plan.txt
grep -q ' effects: PSF pixel$' plan.txt && pass "effects listed" || fail "effects: $(grep effects plan.txt)"

# an object that cannot be drawn is left out, counted, and the run goes on
printf '# X_IMAGE Y_IMAGE FLUX TYPE\n9e6 3 1 star\n3 3 1 star\n' >far.txt
ok "an object 9e6 pixels away" simage far.txt -x 0.1 --size 5,5 -o far.fits
near "the other is drawn" "$(stat far.fits 4)" 2000 0
# the other side of the sky is outside, too
printf '# RA DEC FLUX TYPE\n150 2.2 1 star\n330 -2.2 1 star\n150 -89 1 star\n' >behind.txt
for o in "" "--wcs far.fits"; do
    for p in "" "-p psf.fits" "-p psf.fits --method field"; do
        [ -n "$o$p" ] || p=-q
        # shellcheck disable=SC2086
        simage behind.txt -x 0.1 --size 5,5 $o $p -v -o behind.fits 2>said.txt
        near "behind the sky $o $p: objects that cannot be drawn" "$(grep -c "cannot be drawn" said.txt)" 0 0
        [ "${p%field}" != "$p" ] || near "those outside or dark" "$(sed -n 's/simage: \([0-9]*\) outside or dark/\1/p' said.txt)" 2 0
        # shellcheck disable=SC2086
        head -2 behind.txt | simage - -x 0.1 --size 5,5 $o $p -q -o front.fits
        near "the image is that of the other" "$(diffmax front.fits behind.fits)" 0 0
    done
done
ok "behind the sky: the list with positions" simage behind.txt -x 0.1 --size 5,5 --truth truth.txt -o behind.fits
near "its place in the image" "$(col truth.txt X_IMAGE | sed -n 2p | grep -ci nan)" 1 0
printf '# DX DY FLUX TYPE\n' >empty.txt
ok "an empty list" simage empty.txt -x 0.1 --size 5,5 -o e.fits
near "gives zeros" "$(stat e.fits 4)" 0 0

# faults
fails "no pixel scale" 2 simage one.txt --size 5,5
fails "no size" 2 simage one.txt -x 0.1
fails "a number with a tail" 2 simage one.txt -x 0.1x --size 5,5
fails "shear of 1" 2 simage one.txt -x 0.1 --size 5,5 --shear 0.8,0.7
fails "a declination of 91" 2 simage one.txt -x 0.1 --size 5,5 --center 0,91
fails "a declination of -91" 2 simage one.txt -x 0.1 --size 5,5 --center=0,-91
fails "diffusion without a PSF" 2 simage one.txt -x 0.1 --size 5,5 --diffusion 0.04
fails "half a pixel" 2 simage one.txt -x 0.1 --size 5.5,5
fails "no such list" 1 simage none.txt -x 0.1 --size 5,5
fails "no models" 1 simage scene.txt -x 0.1 -o x.fits
$F make noscale.fits 21 21 1 "BUNIT   = 'electron'" >/dev/null
fails "a PSF without a scale" 1 simage one.txt -x 0.1 --size 5,5 -p noscale.fits -o x.fits
head -c 5000 psf.fits >cut.fits
fails "a PSF cut short" 1 simage one.txt -x 0.1 --size 5,5 -p cut.fits -o x.fits
$F make diffused.fits 21 21 'exp(-(($x-10)**2+($y-10)**2)/20)' "PIXELSCL=                 0.01" "CHDIFF  =                 0.04" >/dev/null
fails "diffusion twice" 1 simage one.txt -x 0.1 --size 5,5 -p diffused.fits --psf-normalise --diffusion 0.04 -o x.fits
$F make pixel.fits 21 21 'exp(-(($x-10)**2+($y-10)**2)/20)' "PIXELSCL=                 0.01" "PIXRESP =                    T" "PIXSIZE =                  0.2" >/dev/null
fails "a pixel twice" 1 simage one.txt -x 0.1 --size 5,5 -p pixel.fits --psf-normalise -o x.fits
fails "an unknown type" 1 simage <(printf '# DX DY FLUX TYPE\n0 0 1 blob\n') -x 0.1 --size 5,5 -o x.fits
[ ! -e x.fits ] && pass "no output after a fault" || fail "output after a fault"

# diffusion on top of a PSF without it = a PSF that holds it; one PSF serves every pixel scale
psfgen --diffusion 0 -o sharp.fits
psfgen -o soft.fits
printf '# DX DY FLUX TYPE RE\n0.03 0.01 1 gauss 0.15\n-0.5 0.4 1 star 0.1\n' >pair.txt
ok "diffusion in the PSF" simage pair.txt -p soft.fits -x 0.1 --size 61,61 --shear 0.02,0.05 --accuracy 1e-5 -o soft_i.fits
ok "diffusion by simage" simage pair.txt -p sharp.fits --diffusion "$(card soft.fits CHDIFF)" -x 0.1 --size 61,61 --shear 0.02,0.05 --accuracy 1e-5 -o sharp_i.fits
near "the same image, of the peak" "$(diffmax soft_i.fits sharp_i.fits | awk -v p="$(stat soft_i.fits 4)" '{ print $1 / p }')" 0 1e-5
near "CHDIFF" "$(card sharp_i.fits CHDIFF)" "$(card soft_i.fits CHDIFF)" 1e-12
near "PSFFWHM of the sum" "$(card sharp_i.fits PSFFWHM)" "$(card soft_i.fits PSFFWHM)" 1e-4
ok "without diffusion" simage pair.txt -p sharp.fits -x 0.1 --size 61,61 --shear 0.02,0.05 --accuracy 1e-5 -o none_i.fits
between "makes a difference, of the peak" "$(diffmax none_i.fits sharp_i.fits | awk -v p="$(stat soft_i.fits 4)" '{ print $1 / p }')" 0.02 1.5

# one convolution of the whole field: another road to the same pixels, with wings that never end
for x in 0.04 0.1 0.16; do
    ok "stamps at $x" simage pair.txt -p soft.fits -x $x --size 150,140 --shear 0.02,0.05 --accuracy 1e-6 -o stamps.fits
    ok "the field at once at $x" simage pair.txt -p soft.fits -x $x --size 150,140 --shear 0.02,0.05 --accuracy 1e-6 --method field -o whole.fits
    near "largest difference at $x, of the peak" "$(NPIX=21000 diffmax stamps.fits whole.fits | awk -v p="$(stat stamps.fits 4)" '{ print $1 / p }')" 0 1e-6
done
# at 1e-7, where wings count: those that would fold back beyond the margin (3.8e-6 of the second one's peak beyond 13") make it wider or are stamps
for type in "star 1 1" "gauss 2 1" "gauss 0.1 1" "sersic 0.3 2"; do
    printf '# DX DY FLUX TYPE RE N\n0.31 0.17 1e5 %s\n' "$type" >wing.txt
    simage wing.txt -p soft.fits -x 0.1 --size 80,81 --accuracy 1e-7 -o stamps.fits
    simage wing.txt -p soft.fits -x 0.1 --size 80,81 --accuracy 1e-7 --method field -v -o whole.fits 2>v.txt
    near "$type: stamps and field at 1e-7, of the peak" "$(NPIX=6400 diffmax stamps.fits whole.fits | awk -v p="$(stat stamps.fits 4)" '{ print $1 / p }')" 0 2e-7
    grep -q "margin of .*; $(case $type in "gauss 2 1") echo 1 ;; "sersic 0.3 2") echo '[0-9]*' ;; *) echo 0 ;; esac) parts reach" v.txt && pass "told by -v" || fail "margin: $(grep margin v.txt)"
done
for o in "--no-pixel" "-N 2 --no-pixel" "--shear-order 4"; do
    ok "stamps $o" simage pair.txt -p soft.fits -x 0.1 --size 150,140 --shear 0.02,0.05 --accuracy 1e-6 $o -o stamps.fits
    ok "field $o" simage pair.txt -p soft.fits -x 0.1 --size 150,140 --shear 0.02,0.05 --accuracy 1e-6 $o --method field -o whole.fits
    near "largest difference, $o, of the peak" "$(NPIX=21000 diffmax stamps.fits whole.fits | awk -v p="$(stat stamps.fits 4)" '{ print $1 / p }')" 0 1e-6
done
simage scene.txt --models m.txt -p soft.fits -x 0.1 --size 200,200 --shear 0.03,0.02 --accuracy 1e-7 --floor 0.05 -o stamps.fits
simage scene.txt --models m.txt -p soft.fits -x 0.1 --size 200,200 --shear 0.03,0.02 --accuracy 1e-7 --floor 0.05 --method field -o whole.fits
near "150 galaxies, floor 0.05: largest difference, electrons (errors of 150 objects)" "$(NPIX=40000 diffmax stamps.fits whole.fits)" 0 0.3
simage scene.txt --models m.txt -p soft.fits -x 0.1 --size 200,200 --shear 0.03,0.02 --accuracy 1e-7 --floor 0.05 --method field -j 2 -o whole2.fits
same "the field: same bytes for 1 and 2 threads" whole.fits whole2.fits
fails "--method field without a PSF" 2 simage one.txt -x 0.1 --size 5,5 --method field
fails "--method field beyond --max-memory" 1 simage pair.txt -p soft.fits -x 0.1 --size 2000,2000 --method field --max-memory 50M -o big.fits

# hard cases: everywhere, any size, any order
cat >where.txt <<'END'
# X_IMAGE Y_IMAGE FLUX TYPE RE
8 8 1 star 0.1
8.5 16 1 star 0.1
16.5 16.5 1 star 0.1
0.5 24 1 star 0.1
1e9 3 1 star 0.1
3 -1e9 1 gauss 0.1
1e30 1e30 1 gauss 0.1
-30 10 1 gauss 0.1
0.5 0.5 1 gauss 0.05
END
simage where.txt -x 0.1 --size 40,40 -T 1 -v -o where.fits 2>v.txt && pass "objects on centres, edges, corners, borders, 1e9 and 1e30 away" || fail "positions: $(cat v.txt)"
near "3.5 stars and a quarter of a Gaussian are inside" "$(awk -v m="$(stat where.fits 1)" 'BEGIN { print m * 1600 }')" 3.75 2e-4
grep -q '^simage: 4 outside or dark' v.txt && pass "4 outside, counted" || fail "outside: $(grep outside v.txt)"
ok "positions with a PSF" simage where.txt -p soft.fits -x 0.1 --size 40,40 -T 1 --accuracy 1e-5 -o where.fits
ok "positions, whole field" simage where.txt -p soft.fits -x 0.1 --size 40,40 -T 1 --accuracy 1e-5 --method field -o whole.fits
near "stamps and field at borders, of a star's peak" "$(NPIX=1600 diffmax where.fits whole.fits | awk -v p="$(stat where.fits 4)" '{ print $1 / p }')" 0 1e-5
# magnitudes 0 and 40 side by side
printf '# DX DY MAG TYPE\n-1 0 0 star\n1 0 40 star\n' >mags.txt
ok "magnitudes 0 and 40" simage mags.txt -x 0.1 --size 41,41 -T 1 -o mags.fits
near "their flux, over that of magnitude 0" "$(awk -v m="$(stat mags.fits 1)" 'BEGIN { print m * 1681 / exp(0.4 * 26.65 * log(10)) }')" 1 1e-6
printf '# DX DY MAG TYPE\n1 0 40 star\n' >faint.txt
simage faint.txt -x 0.1 --size 41,41 -T 1 -o faint.fits
near "the faint one: 10^(-0.4 13.35) electrons" "$(stat faint.fits 4)" 4.5709e-6 1e-10
# larger than the image: a Gaussian of RE 50" on 4" has the surface brightness of its middle
printf '# DX DY FLUX TYPE RE\n0 0 1 gauss 50\n' >wide.txt
for p in "" "-p soft.fits"; do
    ok "larger than the image${p:+, PSF}" simage wide.txt $p -x 0.1 --size 40,40 -T 1e6 --accuracy 1e-6 -o wide.fits
done
simage wide.txt -x 0.1 --size 40,40 -T 1e6 --accuracy 1e-6 -o w0.fits
near "its peak pixel" "$(stat w0.fits 4)" "$(awk 'BEGIN { s = 2500 / (2 * log(2)); printf "%.9f", 1e4 / (2 * atan2(0, -1) * s) }')" 1e-5
near "with a PSF, whose wings beyond 50\" hold 3e-4" "$(stat wide.fits 4)" "$(stat w0.fits 4)" 4e-4
# the slow corner: order 60, beta .01 pixel, no PSF, strong shear at an angle: its flux, or left out in time
awk 'BEGIN { printf "# ID BETA NMAX MAG COEFFS\n1 0.001 60 20"; for (n = 0; n <= 60; n++) for (k = 0; k <= n; k++) printf " %.17g", n ? 0 : 1 / (2 * sqrt(atan2(0, -1)) * 0.001); print "" }' >m60.txt
for g in "0.3 0.2" "0.9 0.3" "0.6 0.7998"; do
    printf '# DX DY FLUX TYPE MODEL G1 G2\n0.01 0.02 1000 shapelet 1 %s\n' "$g" >thin.txt
    near "order 60, beta .01 pixel, g = $g: 0 for drawn or counted in less than 10 s" "$( (ulimit -t 10; simage thin.txt --models m60.txt -x 0.1 --size 100,100 -q -o thin.fits; echo $?) 2>/dev/null | tail -1)" 0 0
    [ "$g" = "0.6 0.7998" ] || near "its flux" "$(awk -v m="$(stat thin.fits 1)" 'BEGIN { print m * 10000 / 2e6 }')" 1 1e-5
done
# a shear of .9999 and its undoing, zeros of both signs, the smallest number
printf '# DX DY FLUX TYPE RE G1 G2\n0 0 1000 gauss 0.3 0.9999 0\n' >strong.txt
printf '# DX DY FLUX TYPE RE\n0 0 1000 gauss 0.3\n' >round.txt
simage round.txt -x 0.1 --size 61,61 -T 1 --accuracy 1e-9 -o plain.fits
simage strong.txt -x 0.1 --size 61,61 -T 1 --accuracy 1e-9 --shear -0.9999,0 -o undone.fits
near "g = .9999 undone, of the peak" "$(diffmax plain.fits undone.fits | awk -v p="$(stat plain.fits 4)" '{ print $1 / p }')" 0 3e-7
for g in 0,0 -0,-0 5e-324,0 0,5e-324; do
    simage round.txt -x 0.1 --size 61,61 -T 1 --accuracy 1e-9 --shear $g -o zero.fits
    near "g = $g changes nothing" "$(diffmax plain.fits zero.fits)" 0 0
done

# the independent renderer's truth: shapelets with an exact shear, PSF given as samples
T=$SHARED/truth/galsim
if [ -d "$T" ]; then
    for n in 01 03 05 11; do
        for x in 0.05 0.10; do
            for kind in nopsf psf; do
                gzip -dc "$T/truth_${n}_${kind}_$x.fits.gz" >truth.fits
                perl -e 'open my $h, "<:raw", "truth.fits" or die; local $/; my $d = <$h>; my %k; my $o = 0;
                    for (;;) { my $c = substr $d, $o, 80; $o += 80; last if $c =~ /^END /; $k{$1} = $2 if $c =~ /^(\w+)\s*=\s*([-+.0-9eE]+)/ } $o = 2880 * int(($o + 2879) / 2880);
                    my @v = unpack "d>*", substr $d, $o, 8 * 4096; open my $t, ">", "truth.val"; print $t "$_\n" for @v;
                    open my $m, ">", "tm.txt"; print $m "# ID BETA NMAX MAG COEFFS\n1 $k{BETA} $k{NMAX} 20"; printf $m " %.17g", $k{"C$_"} for 0 .. ($k{NMAX} + 1) * ($k{NMAX} + 2) / 2 - 1; print $m "\n";
                    my $g = sqrt($k{GAMMA1} ** 2 + $k{GAMMA2} ** 2); my $f = $g > 0 ? (exp(2 * $g) - 1) / (exp(2 * $g) + 1) / $g : 0;
                    open my $s, ">", "ts.txt"; printf $s "# DX DY FLUX TYPE MODEL G1 G2\n%.17g %.17g 1 shapelet 1 %.17g %.17g\n", $k{OFFX}, $k{OFFY}, $f * $k{GAMMA1}, $f * $k{GAMMA2}'
                psf='' requests=1e-7
                [ $kind = psf ] && psf="-p $T/psf_chpsf_0.01.fits.gz --psf-scale 0.01 --psf-cutoff 11.9" requests="1e-2 1e-3 1e-4 1e-5 1e-6 1e-7"
              for eps in $requests; do
                simage ts.txt --models tm.txt -x $x --size 64,64 -T 1 --accuracy $eps $psf -q -o t.fits
                near "truth $n $kind $x\", request $eps: file, of the peak" "$(perl -e 'open my $h, "<:raw", "t.fits" or die; local $/; my $d = <$h>; my $o = 0;
                    for (;;) { my $c = substr $d, $o, 80; $o += 80; last if $c =~ /^END /; } $o = 2880 * int(($o + 2879) / 2880);
                    my @v = unpack "f>*", substr $d, $o, 4 * 4096; open my $t, "<", "truth.val"; my @t = split /\n/, <$t>; my ($m, $p) = (0, 0);
                    for (0 .. 4095) { my $e = abs($v[$_] - $t[$_]); $m = $e if $e > $m; $p = $t[$_] if $t[$_] > $p } printf "%.3g\n", $m / $p')" 0 $eps
              done
            done
        done
    done
else
    skip "truth/galsim is not there"
fi

# a scene says one thing only; a set's name is a word that catalogues can carry
printf '# DX DY RA DEC MAG TYPE\n0 0 150 2.2 20 star\n' >two.txt
fails "two pairs of positions" 1 simage two.txt -x 0.1 --size 16,16 -o x.fits
printf '# DX DY MAG FLUX TYPE\n0 0 20 5 star\n' >both.txt
fails "MAG and FLUX" 1 simage both.txt -x 0.1 --size 16,16 -o x.fits
printf '# DX DY MAG TYPE\n0 0 20 star\n' >one.txt
fails "a name of two words" 2 simage one.txt -x 0.1 --size 16,16 --set 'a b' -o x.fits

# the truth beside the image: where detect finds a lone star, and how bright
printf '%s\n' "# ID DX DY MAG TYPE NOTE" "7 1.23 -0.47 20 star mine" >truth.txt
ok "--truth" simage truth.txt -p soft.fits -x 0.1 --size 101,101 --shear 0.03,0 --truth t.cat -o t.fits
near "--truth: X_IMAGE" "$(col t.cat X_IMAGE)" 63.3 1e-9
near "--truth: Y_IMAGE" "$(col t.cat Y_IMAGE)" 46.3 1e-9
near "--truth: FLUX_IMAGE" "$(col t.cat FLUX_IMAGE)" "$(awk 'BEGIN { printf "%.9f", 2000 * 10 ^ (-0.4 * (20 - 26.65)) }')" 1e-3
addnoise -q --depth 27.7 t.fits | detect - -q -o d.cat
near "--truth: ALPHA_J2000, arcsec" "$(awk -v a="$(col t.cat ALPHA_J2000)" -v b="$(col d.cat ALPHA_J2000)" 'BEGIN { print (a - b) * 3600 }')" 0 0.005
near "--truth: DELTA_J2000, arcsec" "$(awk -v a="$(col t.cat DELTA_J2000)" -v b="$(col d.cat DELTA_J2000)" 'BEGIN { print (a - b) * 3600 }')" 0 0.005
same "--truth: other columns stay" <(col t.cat NOTE) <(echo mine)
grep -q '^# Keyword: SHEAR1 = 0.03$' t.cat && pass "--truth: keywords of the image" || fail "--truth: no SHEAR1"
fails "--truth over the output" 2 simage truth.txt -p soft.fits -x 0.1 --size 101,101 --truth t.fits -o t.fits

# the file's flux when nothing leaves the image: float32 rounds every pixel
printf '# DX DY FLUX TYPE RE\n0.013 -0.021 1 gauss 0.2\n' >alone.txt
for p in "--accuracy 1e-7" "-p soft.fits --accuracy 1e-5"; do
    simage alone.txt $p -x 0.1 --size 801,801 -T 1 -o f.fits
    near "flux in the file, $p" "$(pix sum f.fits)" 1 6e-8
done

# wavelengths so small and so large that the core (lambda/D = 0.004" and 2") is far below a pixel and wider than a grid of 9 samples:
# a lone star, its pixels and its light against the sum over the nodes of the transfer function that psfgen makes with pixels of 0.1"
printf '# DX DY FLUX TYPE\n0 0 1 star\n' >lone.txt
small="--wavelength 40 --pupil-grid 1536"
large="--wavelength 20000"
psfgen $small -x 0.005 --size 65 -o p40.fits
psfgen $small -x 0.1 --size 41 --pixel 0.1 -o e40.fits
ok "a star at 40 nm" simage lone.txt -p p40.fits -x 0.1 --size 401,401 -T 1 --accuracy 1e-6 -o s.fits
near "40 nm: flux within 40\"" "$(pix sum s.fits)" 1 1e-6
simage lone.txt -p p40.fits -x 0.1 --size 41,41 -T 1 --accuracy 1e-6 -o s.fits
near "40 nm: pixels within 4\", of the peak" "$(pix diff e40.fits s.fits | cut -d' ' -f1)" 0 1e-6
for c in "2e-6:" "1e-6:--struts 0"; do                   # vanes: 1.8e-6 are those of a pupil of 256 cells
    o=${c#*:}
    psfgen $large $o -o p20.fits
    psfgen $large $o --pupil-grid 1024 -x 0.1 --size 401 --pixel 0.1 -o e20.fits
    simage lone.txt -p p20.fits -x 0.1 --size 401,401 -T 1 --accuracy 1e-6 -o s.fits
    near "20 um${o:+, $o}: flux within 40\"" "$(pix sum s.fits)" "$(pix sum e20.fits)" 2e-5
    near "20 um${o:+, $o}: pixels, of the peak" "$(pix diff e20.fits s.fits | cut -d' ' -f1)" 0 "${c%%:*}"
done
# far from the core of a ring, 1 - 2 lambda/D / (pi^2 (1 - .3) r) is inside r; the mean of 1/r along the square of half a side h is 2 sqrt(2) / (pi h)
near "20 um, no vanes: flux within 40\", by hand to lowest order" "$(pix sum s.fits)" "$(awk 'BEGIN { p = atan2(0, -1); printf "%.9f", 1 - 2e-5 * 206264.806 / (p * p * 0.7) * 2 * sqrt(2) / (p * 20.05) }')" 5e-4

# columns that a type does not use are not looked at; ID is a label
printf '# DX DY FLUX TYPE\n0.03 0.01 1 star\n0.2 -0.1 2 star\n' >bare.txt
printf '# ID DX DY FLUX TYPE RE G1 G2 ROT PARITY DILATION N Q PA\n7 0.03 0.01 1 star nan 5 5 nan 3 -1 99 0 nan\n7 0.2 -0.1 2 star 0 0 0 0 0 0 0 0 0\n' >full.txt
printf '# ID DX DY FLUX TYPE\n-3 0.03 0.01 1 star\n-3 0.2 -0.1 2 star\n' >ids.txt
for p in "" "-p soft.fits"; do
    simage bare.txt $p -x 0.1 --size 20,20 --accuracy 1e-3 -o a.fits
    ok "stars with columns of galaxies${p:+, PSF}" simage full.txt $p -x 0.1 --size 20,20 --accuracy 1e-3 -o b.fits
    near "draw the same${p:+, PSF}" "$(NPIX=400 diffmax a.fits b.fits)" 0 0
    ok "an ID used twice${p:+, PSF}" simage ids.txt $p -x 0.1 --size 20,20 --accuracy 1e-3 -o b.fits
    near "draws both${p:+, PSF}" "$(NPIX=400 diffmax a.fits b.fits)" 0 0
done
