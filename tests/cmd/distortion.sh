# simage --wcs: positions and shapes through distorted, turned and mirrored world coordinates,
# against the same objects placed and shaped by hand.
F="perl $TOP/tests/fits.pl"
psfgen -M 64 --size 65 -o psf.fits
of() { pix diff "$1" "$2" | cut -d' ' -f1; }      # largest difference over the peak
near_wcs() { # NAME CD... : a blank image with this WCS, 121 x 101 pixels
    local name=$1; shift
    $F make "$name" 121 101 0 "CTYPE1  = '$1'" "CTYPE2  = '$2'" "CRVAL1  =                150.0" "CRVAL2  =                  2.2" \
        "CRPIX1  = $3" "CRPIX2  = $4" "CD1_1   = $5" "CD1_2   = $6" "CD2_1   = $7" "CD2_2   = $8" "${@:9}"
}
awk 'BEGIN { printf "# ID BETA NMAX MAG COEFFS\n1 0.2 2 20"; printf " 1.2 0.3 -0.2 0.15 0.25 -0.1\n" }' >m.txt
cat >s.txt <<'END'
# DX DY FLUX TYPE MODEL ROT PARITY G1 G2
1.23 -2.05 1 shapelet 1 20 1 0.1 -0.05
-3.3 1.4 2 shapelet 1 75 -1 -0.02 0.2
0.52 0.11 1 star 1 0 1 0 0
END
S="--models m.txt -p psf.fits -x 0.1 --accuracy 1e-6"
c=0.0000277777777777778

# a plain TAN is the default, off the middle too
near_wcs plain.fits RA---TAN DEC--TAN 61 51 -$c 0 0 $c
simage s.txt $S --size 121,101 -g 0.05,0.02 -o a.fits
ok "a plain TAN" simage s.txt $S --wcs plain.fits -g 0.05,0.02 -o b.fits
near "size of its image" "$(card b.fits NAXIS1)$(card b.fits NAXIS2)" 121101 0
near "the same pixels as without, of the peak" "$(of a.fits b.fits)" 0 3e-7
simage s.txt $S --wcs plain.fits -g 0.05,0.02 --method field -o f.fits
near "and in one convolution" "$(of b.fits f.fits)" 0 2e-6
sed 's/DX DY/RA DEC/' s.txt | awk '/^#/ { print; next } { $1 = sprintf("%.12f", 150 - $1 / 3600 / cos(2.2 * atan2(0, -1) / 180)); $2 = sprintf("%.12f", 2.2 + $2 / 3600); print }' >sky.txt
simage sky.txt $S --wcs plain.fits -g 0.05,0.02 -o c.fits
near "positions as RA, Dec, of the peak" "$(of b.fits c.fits)" 0 2e-6
awk '/^#/ { sub("DX DY", "X_IMAGE Y_IMAGE"); print; next } { $1 = 61 + $1 * 10; $2 = 51 + $2 * 10; print }' s.txt >pixel.txt
simage pixel.txt $S --wcs plain.fits -g 0.05,0.02 -o c.fits
near "positions in pixels, of the peak" "$(of b.fits c.fits)" 0 3e-7

# turned by 30 degrees: the same scene turned, and the shear with it
t=$(awk -v c=$c 'BEGIN { a = atan2(0, -1) / 6; printf "%.18g %.18g %.18g %.18g", -c * cos(a), c * -sin(a), c * -sin(a), c * cos(a) }')
near_wcs turned.fits RA---TAN DEC--TAN 61 51 $t
awk 'BEGIN { a = atan2(0, -1) / 6; C = cos(a); D = sin(a) } /^#/ { print; next } { x = $1; y = $2; $1 = sprintf("%.15g", C * x - D * y); $2 = sprintf("%.15g", D * x + C * y)
    $6 += 30; g = $8; h = $9; $8 = sprintf("%.15g", g * cos(2 * a) - h * sin(2 * a)); $9 = sprintf("%.15g", g * sin(2 * a) + h * cos(2 * a)); print }' s.txt >turned.txt
g=$(awk 'BEGIN { a = atan2(0, -1) / 3; printf "%.15g,%.15g", 0.05 * cos(a) - 0.02 * sin(a), 0.05 * sin(a) + 0.02 * cos(a) }')
simage turned.txt $S --size 121,101 -g "$g" -o a.fits
ok "a WCS turned by 30 degrees" simage s.txt $S --wcs turned.fits -g 0.05,0.02 -o b.fits
near "the scene and the shear turned, of the peak" "$(of a.fits b.fits)" 0 3e-7
simage s.txt $S --size 121,101 -g 0.05,0.02 -o a.fits
between "and it shows" "$(of a.fits b.fits)" 0.1 2

# east to the right: mirrored in x, that is parity, half a turn, and the shear's second component
near_wcs east.fits RA---TAN DEC--TAN 61 51 $c 0 0 $c
awk '/^#/ { print; next } { $1 = -$1; $6 = 180 - $6; $7 = -$7; $9 = -$9; print }' s.txt >east.txt
simage east.txt $S --size 121,101 -g 0.05,-0.02 -o a.fits
ok "east to the right" simage s.txt $S --wcs east.fits -g 0.05,0.02 -o b.fits
near "the scene mirrored, of the peak" "$(of a.fits b.fits)" 0 3e-7

# SIP of 5 % at the borders: positions by Newton's method, shapes by the covariance D M C M' D'
near_wcs sip.fits RA---TAN-SIP DEC--TAN-SIP 55 48 -$c 0 0 $c "A_ORDER =                    3" "B_ORDER =                    3" "A_2_0   =               4.0E-4" \
    "A_1_1   =              -3.0E-4" "A_0_3   =               5.0E-6" "B_0_2   =              -2.5E-4" "B_1_1   =               3.5E-4" "B_3_0   =              -4.0E-6"
cat >g.txt <<'END'
# DX DY FLUX TYPE RE Q PA G1 G2
3.1 2.2 1 gauss 0.3 0.7 40 0.1 -0.2
-4.2 -3.5 1 gauss 0.25 0.5 -70 0 0.05
4.4 -2.9 2 gauss 0.4 1 0 0 0
END
G1=0.04 G2=-0.03 perl -ne 'if (/^#/) { print "# X_IMAGE Y_IMAGE FLUX TYPE RE Q PA\n"; next } my ($dx, $dy, $f, $t, $re, $q, $pa, $g1, $g2) = split; my $pi = atan2(0, -1); my $s = 0.1;
    sub A { my ($u, $v) = @_; ($u + 4e-4 * $u * $u - 3e-4 * $u * $v + 5e-6 * $v ** 3, $v - 2.5e-4 * $v * $v + 3.5e-4 * $u * $v - 4e-6 * $u ** 3) }
    sub J { my ($u, $v) = @_; (1 + 8e-4 * $u - 3e-4 * $v, -3e-4 * $u + 1.5e-5 * $v * $v, 3.5e-4 * $v - 1.2e-5 * $u * $u, 1 - 5e-4 * $v + 3.5e-4 * $u) }
    my @m = A(61 - 55, 51 - 48); my @w = ($dx / $s + $m[0], $dy / $s + $m[1]); my ($u, $v) = @w;     # DX, DY count from the middle of the image
    for (1 .. 50) { my @a = A($u, $v); my @j = J($u, $v); my $d = $j[0] * $j[3] - $j[1] * $j[2]; my ($p, $q) = ($w[0] - $a[0], $w[1] - $a[1]); $u += ($j[3] * $p - $j[1] * $q) / $d; $v += ($j[0] * $q - $j[2] * $p) / $d }
    my @j = J($u, $v); my $d = $j[0] * $j[3] - $j[1] * $j[2]; my @D = ($j[3] / $d, -$j[1] / $d, -$j[2] / $d, $j[0] / $d);
    sub mul { my ($a, $b) = @_; [$a->[0] * $b->[0] + $a->[1] * $b->[2], $a->[0] * $b->[1] + $a->[1] * $b->[3], $a->[2] * $b->[0] + $a->[3] * $b->[2], $a->[2] * $b->[1] + $a->[3] * $b->[3]] }
    sub sh { my ($a, $b) = @_; my $n = sqrt(1 - $a * $a - $b * $b); [(1 + $a) / $n, $b / $n, $b / $n, (1 - $a) / $n] }
    my $M = mul(mul(\@D, sh($ENV{G1}, $ENV{G2})), sh($g1, $g2)); my $r = $pa * $pi / 180; my ($c, $z) = (cos $r, sin $r);
    my $C = [$c * $c / $q + $z * $z * $q, $c * $z * (1 / $q - $q), $c * $z * (1 / $q - $q), $z * $z / $q + $c * $c * $q]; my $T = [$M->[0], $M->[2], $M->[1], $M->[3]];
    my $N = mul(mul($M, $C), $T); my $det = $N->[0] * $N->[3] - $N->[1] ** 2; my $h = sqrt((($N->[0] - $N->[3]) / 2) ** 2 + $N->[1] ** 2); my $tr = ($N->[0] + $N->[3]) / 2;
    printf "%.15g %.15g %s gauss %.15g %.15g %.15g\n", $u + 55, $v + 48, $f, $re * $det ** 0.25, sqrt(($tr - $h) / ($tr + $h)), atan2(2 * $N->[1], $N->[0] - $N->[3]) / 2 * 180 / $pi' g.txt >hand.txt
for p in "-p psf.fits" ""; do
    simage hand.txt $p -x 0.1 --size 121,101 --accuracy 1e-6 -o a.fits
    ok "a SIP distortion${p:+, PSF}" simage g.txt $p -x 0.1 --wcs sip.fits -g 0.04,-0.03 --accuracy 1e-6 -o b.fits
    near "as placed and shaped by hand${p:+, PSF}, of the peak" "$(of a.fits b.fits)" 0 3e-6
    simage g.txt $p -x 0.1 --size 121,101 -g 0.04,-0.03 --accuracy 1e-6 -o c.fits
    between "and it shows${p:+, PSF}" "$(of c.fits b.fits)" 0.1 2
done
near "flux is kept" "$(pix sum b.fits)" "$(awk 'BEGIN { print 8000 }')" 0.01
[ "$($F card b.fits 0 CTYPE1)" = RA---TAN-SIP ] && near "the WCS is in the image: A_2_0" "$(card b.fits A_2_0)" 4e-4 1e-12 || fail "CTYPE1 $(card b.fits CTYPE1)"
simage s.txt $S --wcs sip.fits -j 2 -o b2.fits; simage s.txt $S --wcs sip.fits -o b1.fits
same "1 and 2 threads" b1.fits b2.fits

fails "pixels that are not the WCS's" 1 simage s.txt --models m.txt -x 0.2 --wcs plain.fits -o no.fits
fails "--wcs and --subpixel" 2 simage s.txt --models m.txt -x 0.1 -N 2 --wcs plain.fits -o no.fits
$F make none.fits 8 8 0
fails "no WCS" 1 simage s.txt --models m.txt -x 0.1 --wcs none.fits -o no.fits
fails "no such file" 1 simage s.txt --models m.txt -x 0.1 --wcs absent.fits -o no.fits
fails "onto the WCS's file" 1 simage s.txt --models m.txt -x 0.1 --wcs plain.fits -o plain.fits
fails "the truth onto the WCS's file" 1 simage s.txt --models m.txt -x 0.1 --wcs plain.fits --truth plain.fits -o no.fits

# galactic axes: (150, 2.2) there is (63.605103, 54.039755) of J2000, as astropy has it; other frames are refused by name
near_wcs galactic.fits GLON-TAN GLAT-TAN 61 51 -$c 0 0 $c
printf '# RA DEC FLUX TYPE\n63.605103 54.039755 100 star\n' >one.txt
ok "a star through galactic axes" simage one.txt -p psf.fits -x 0.1 --wcs galactic.fits --truth truth.txt -o g.fits
near "lies at CRPIX, x" "$(col truth.txt X_IMAGE)" 61 0.3; near "and y" "$(col truth.txt Y_IMAGE)" 51 0.3
detect g.fits --rms 0.1 -o g.cat
near "detect tells its RA" "$(col g.cat ALPHA_J2000)" 63.605103 2e-5; near "and Dec" "$(col g.cat DELTA_J2000)" 54.039755 1e-5
ok "drizzled to a grid of RA and Dec" drizzle g.fits --size 121,101 -o d.fits
detect "d.fits[SCI]" --rms 0.1 -o d.cat
near "it is still there, RA" "$(col d.cat ALPHA_J2000)" 63.605103 2e-5; near "and Dec" "$(col d.cat DELTA_J2000)" 54.039755 1e-5
for f in "FK4 of EQUINOX 1950|RADESYS = 'FK4'|EQUINOX =               1950.0" "FK5 of EQUINOX 1975|RADESYS = 'FK5'|EQUINOX =               1975.0" "axes ELON|X|X"; do
    IFS='|' read -r what one two <<<"$f"
    if [ "$one" = X ]; then near_wcs other.fits ELON-TAN ELAT-TAN 61 51 -$c 0 0 $c; else near_wcs other.fits RA---TAN DEC--TAN 61 51 -$c 0 0 $c "$one" "$two"; fi
    fails "simage --wcs, $what" 1 simage one.txt -p psf.fits -x 0.1 --wcs other.fits -o no.fits
    if grep -q "$what" cmd.err; then pass "is told"; else fail "simage: $(cat cmd.err)"; fi
    ok "detect, $what" detect other.fits --rms 0.1 -o o.cat
    grep -q "$what.*no positions on the sky" cmd.err && pass "is warned of" || fail "detect: $(cat cmd.err)"
    if grep -q ALPHA_J2000 o.cat; then fail "ALPHA_J2000 of $what"; else pass "and gives no ALPHA_J2000"; fi
done
