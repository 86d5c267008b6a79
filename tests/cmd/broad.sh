# simage: objects far larger than any stamp, through a PSF, against the same convolution in closed form:
# a Gaussian PSF on a Gaussian galaxy is a Gaussian, which has closed-form pixels without a PSF.
perl "$TOP/tests/fits.pl" make psf.fits 161 161 'exp(-(($x-80)**2+($y-80)**2)/128)' "PIXELSCL=                 0.01" >/dev/null
P="-p psf.fits --psf-normalise --psf-cutoff 12"
# wider RE: the half-light radius after a PSF of rms 0.08"
wider() { awk -v r="$1" 'BEGIN { printf "%.15g", sqrt(r * r + 2 * log(2) * 0.0064) }'; }
try() { # scale RE method shape
    printf '# DX DY FLUX TYPE RE Q PA\n0.31 -0.17 1 gauss %s 1 0\n' "$2" >with.txt
    printf '# DX DY FLUX TYPE RE Q PA\n0.31 -0.17 1 gauss %s 1 0\n' "$(wider "$2")" >without.txt
    simage with.txt $P -x "$1" --size 200,120 -T 1e6 --method "$3" -o a.fits 2>said.txt
    simage without.txt -x "$1" --size 200,120 -T 1e6 --accuracy 1e-9 -o b.fits
    near "RE $2\" at $1\", $3: of the peak, against closed form" "$(pix diff a.fits b.fits | cut -d' ' -f1)" 0 1e-5
    [ -s said.txt ] && fail "RE $2\" at $1\", $3: $(cat said.txt)"
}
for c in "0.04 30" "0.04 40" "0.04 50" "0.04 100" "0.1 100" "0.1 1000" "0.1 200000"; do try $c stamp; done
for c in "0.04 20" "0.04 100" "0.1 5" "0.1 20" "0.1 30" "0.1 50"; do try $c field; done

# sheared: a Gaussian stays one; along the axes its widths are known
printf '# DX DY FLUX TYPE RE\n3 -2 1 gauss 60\n' >with.txt
simage with.txt $P -x 0.1 --size 200,120 -T 1e6 --shear 0.3,0.2 -o a.fits
# covariance s2 A A^T + psf2: Q and PA of the sum
awk 'BEGIN { g = 0.3; h = 0.2; s = 3600 / (2 * log(2)); n = 1 - g * g - h * h; p = 0.0064
    xx = s * ((1 + g) ^ 2 + h * h) / n + p; yy = s * ((1 - g) ^ 2 + h * h) / n + p; xy = s * 2 * h / n
    t = xx + yy; d = sqrt((xx - yy) ^ 2 + 4 * xy * xy); a = (t + d) / 2; b = (t - d) / 2
    printf "# DX DY FLUX TYPE RE Q PA\n3 -2 1 gauss %.15g %.15g %.15g\n", sqrt(sqrt(a * b) * 2 * log(2)), sqrt(b / a), atan2(2 * xy, xx - yy) * 90 / atan2(0, -1) }' >without.txt
simage without.txt -x 0.1 --size 200,120 -T 1e6 --accuracy 1e-9 -o b.fits
near "RE 60\", g = (0.3,0.2): of the peak" "$(pix diff a.fits b.fits | cut -d' ' -f1)" 0 1e-5
# in pieces, on two threads, and beside the image
printf '# DX DY FLUX TYPE RE\n0 0 1 gauss 60\n-150 40 2 gauss 70\n0 0 1 star 0.1\n' >two.txt
simage two.txt $P -x 0.1 --size 1300,1100 -T 1e6 -o a.fits
simage two.txt $P -x 0.1 --size 1300,1100 -T 1e6 -j 2 -o b.fits
same "two large objects and a star: same bytes on two threads" a.fits b.fits
printf '# DX DY FLUX TYPE RE\n0 0 1 gauss %s\n-150 40 2 gauss %s\n' "$(wider 60)" "$(wider 70)" >two.txt
simage two.txt -x 0.1 --size 1300,1100 -T 1e6 --accuracy 1e-9 -o b.fits
printf '# DX DY FLUX TYPE RE\n0 0 1 star 0.1\n' >star.txt
simage star.txt $P -x 0.1 --size 1300,1100 -T 1e6 -o c.fits
for i in a b c; do pix sum $i.fits; done >sums.txt
near "their light, of the sum" "$(awk '{ s[NR] = $1 } END { printf "%.9g", s[1] / (s[2] + s[3]) }' sums.txt)" 1 1e-6
# large and thin beyond reason: left out, and told
printf '# DX DY FLUX TYPE RE Q PA\n0 0 1 gauss 300 0.001 30\n' >thin.txt
simage thin.txt $P -x 0.1 --size 1000,1000 -o a.fits 2>said.txt
grep -q "1 objects cannot be drawn" said.txt && pass "$(cat said.txt)" || fail "too thin: $(cat said.txt)"
near "and is not in the image" "$(pix sum a.fits | cut -d' ' -f1)" 0 0
