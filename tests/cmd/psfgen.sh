# psfgen: the study's widths, keywords, files that others read, hard cases.
fwhm() { # OPTION...: PSFFWHM of what psfgen makes
    psfgen "$@" -n 64 -x 0.05 -o w.fits 2>w.err && card w.fits PSFFWHM
}
ok "defaults" psfgen -o psf.fits
near "default: true FWHM of the chPSF" "$(card psf.fits PSFFWHM)" 0.1227 0.00006
ok "with a pixel of 0.10\"" psfgen --pixel 0.10 -o epsf.fits
near "default: true FWHM of the ePSF at 0.10\"" "$(card epsf.fits PSFFWHM)" 0.1467 0.00006
near "no diffusion: FWHM" "$(fwhm --diffusion 0)" 0.08277 0.00002
near "clear 2 m telescope" "$(fwhm --obscuration 0 --struts 0)" 0.1241 0.00006
near "clear 2 m telescope, Airy disc 1.02899 lambda/D" "$(fwhm --obscuration 0 --struts 0 --diffusion 0)" 0.087021 0.000002
near "obscuration 0.40, 0.05 waves of Z6, pixel" "$(fwhm --obscuration 0.4 --zernike 6:0.05 --pixel 0.1)" 0.1552 0.00006
# size scales with lambda / D
near "twice the wavelength" "$(fwhm --wavelength 1640 -d 0)" 0.16554 0.00004
near "twice the diameter, vanes too" "$(fwhm -D 4 --strut-width 0.08 -d 0)" 0.04138 0.00002
for t in snap hst euclid roman; do ok "preset $t" psfgen --telescope=$t -n 64 -x 0.05 -o $t.fits; done
between "hst at 814 nm: FWHM" "$(card hst.fits PSFFWHM)" 0.066 0.070
between "euclid: FWHM" "$(card euclid.fits PSFFWHM)" 0.105 0.120
between "roman F158: FWHM" "$(card roman.fits PSFFWHM)" 0.130 0.145
near "roman: collecting area 3.757 m^2" "$(card roman.fits TELAREA)" 3.757 0.002
near "snap: clear area" "$(card psf.fits TELAREA)" 2.775 0.0005

for k in "PIXELSCL 0.02" "CHDIFF 0.04" "PIXRESP F" "TELDIAM 2.0" "OBSCUR 0.3" "NSTRUTS 3" "WAVELEN 820.0" "CRPIX1 257.0"; do
    set -- $k
    v=$(card psf.fits "$1")
    if [ "$v" = "$2" ] || [ "$v" = "${2%.0}" ]; then pass "$1 = $v"; else fail "$1 = '$v', not $2"; fi
done
[ "$(card epsf.fits PIXRESP)" = T ] && near "PIXSIZE" "$(card epsf.fits PIXSIZE)" 0.1 1e-12 || fail "PIXRESP of a PSF with a pixel"
grep -aq "HISTORY psfgen .*--pixel 0.1 " epsf.fits && pass "HISTORY" || fail "HISTORY has no command line"
if command -v fitsverify >/dev/null; then ok "fitsverify" fitsverify -e psf.fits epsf.fits; else skip "fitsverify is not installed"; fi

# same bytes
ok "again, two threads, elsewhere" sh -c 'mkdir -p d && cd d && psfgen -j 2 -o ../again.fits'
same "same bytes for 1 and 2 threads and another directory" psf.fits again.fits
psfgen >pipe.fits && same "standard output is the same" psf.fits pipe.fits
psfgen --telescope snap --diameter 2 -o explicit.fits
near "an option that repeats the default changes nothing" "$(card explicit.fits PSFFWHM)" "$(card psf.fits PSFFWHM)" 0

# the file against its definition, by other means
python=$(for p in python3 /usr/bin/python3; do "$p" -c 'import numpy, astropy.io.fits' 2>/dev/null && { echo "$p"; break; }; done)
if [ -n "$python" ]; then
    psfgen --zernike 8:0.06,3:-0.2 --pixel 0.05 -n 80 -x 0.03 -o odd.fits
    psfgen --zernike 2:0.5,3:0.25 -d 0 -n 65 -x 0.02 -o tilt.fits
    "$python" - >py.txt 2>py.err <<'END'
import numpy as np
from astropy.io import fits
def read(name):
    f = fits.open(name)
    o = f["OTF"]; h = o.header; d = o.data.astype(float)
    u = (np.arange(h["NAXIS1"]) + 1 - h["CRPIX1"]) * h["CDELT1"]
    return f[0].data.astype(float), f[0].header, d[0] + 1j * d[1], u, h["CDELT1"]
im, h, t, u, du = read("odd.fits")
n = h["NAXIS1"]
x = (np.arange(n) + 1 - h["CRPIX1"]) * h["CDELT1"]
e = np.exp(2j * np.pi * np.outer(x, u))
direct = (e @ t @ e.T).real * (du * h["CDELT1"]) ** 2
print("dft", np.abs(direct - im).max() / im.max())
print("zero", abs(t[len(u) // 2, len(u) // 2] - 1))
print("hermitian", np.abs(t - t[::-1, ::-1].conj()).max())
# Z2 = .5: 2 lambda/D = .1691" to the right, Z3 = .25: .0846" up
peak = np.unravel_index(np.argmax(read("tilt.fits")[0]), (65, 65))
print("right", peak[1] - 32, "up", peak[0] - 32)
im, h, t, u, du = read("psf.fits")
print("real", np.abs(t.imag).max(), "edge", np.abs(t[0]).max() + np.abs(t[:, 0]).max())
print("cut", abs(u[-1] - 2 / 820e-9 * np.pi / 180 / 3600))
# a pupil of ours: 0/1 cells, 2000 across
m = 2000; p = (np.arange(m) + .5) / m - .5; X, Y = np.meshgrid(p, p); r = np.hypot(X, Y)
a = (r < .5) & (r > .15)
for k in range(3):
    c, s = np.cos(np.pi / 2 + 2 * np.pi * k / 3), np.sin(np.pi / 2 + 2 * np.pi * k / 3)
    a &= ~((X * c + Y * s > 0) & (abs(Y * c - X * s) < .01))
worst = 0
for i, j in ((64, 0), (0, 64), (-40, 100), (128, 128), (20, -200), (3, 1)):
    q = np.zeros_like(a); sx, sy = round(i / 256 * m), round(j / 256 * m)
    ys = slice(max(0, -sy), m - max(0, sy)); yt = slice(max(0, sy), m - max(0, -sy))
    xs = slice(max(0, -sx), m - max(0, sx)); xt = slice(max(0, sx), m - max(0, -sx))
    want = (a[ys, xs] & a[yt, xt]).sum() / a.sum() * np.exp(-2 * np.pi ** 2 * .04 ** 2 * ((i * du) ** 2 + (j * du) ** 2))
    worst = max(worst, abs(t[256 + j, 256 + i].real - want))
print("pupil", worst)
END
    v() { awk -v k="$1" '{ for (i = 1; i < NF; i++) if ($i == k) print $(i + 1) }' py.txt; }
    between "image is the inverse transform of the OTF, of the peak (float32)" "$(v dft)" 0 6e-8
    near "0.5 waves of Z2 move the image right by 2 lambda/D, samples" "$(v right)" 8 0
    near "0.25 waves of Z3 move it up by lambda/D" "$(v up)" 4 0
    between "T(0) - 1" "$(v zero)" 0 1e-15
    between "T is Hermitian" "$(v hermitian)" 0 1e-15
    between "without aberration T is real" "$(v real)" 0 0
    between "and ends at 0" "$(v edge)" 0 1e-15
    between "cut-off is D/lambda" "$(v cut)" 0 1e-10
    between "T against counted cells of a pupil of 2000 x 2000" "$(v pupil)" 0 1.5e-3
else
    skip "numpy or astropy is not installed: OTF not checked against sums"
fi

# PSFs from elsewhere
near "flux 1" "$(card psf.fits PSFFLUX)" 1 1e-15
ok "our own file through --from" psfgen --from psf.fits -o back.fits
near "keeps the FWHM" "$(card back.fits PSFFWHM)" "$(card psf.fits PSFFWHM)" 2e-7
ok "and takes the pixel" psfgen --from psf.fits --pixel 0.1 -o back2.fits
near "FWHM of the ePSF" "$(card back2.fits PSFFWHM)" 0.1467 0.00006
fails "diffusion twice" 1 psfgen --from psf.fits --diffusion 0.02 -o no.fits
fails "a pixel twice" 1 psfgen --from epsf.fits --pixel 0.1 -o no.fits
ok "unless forced" psfgen --from psf.fits --diffusion 0.03 --force -o twice.fits
near "CHDIFF adds in squares" "$(card twice.fits CHDIFF)" 0.05 1e-12
ok "the image of the file, without its OTF" psfgen --from 'psf.fits[0]' -o plain.fits
near "has the FWHM" "$(card plain.fits PSFFWHM)" 0.12268 0.00002
ok "from standard input" sh -c 'psfgen --from - -o stdin.fits < psf.fits'
near "the same" "$(card stdin.fits PSFFWHM)" "$(card back.fits PSFFWHM)" 0
if [ -r "$SHARED/data/hdf/wfpc2_f814w_psf.fits" ]; then
    ok "a public WFPC2 PSF" psfgen -v --from "$SHARED/data/hdf/wfpc2_f814w_psf.fits" -o wf.fits
    grep -q 'flux 1.0000219, FWHM 0.0652' cmd.err && pass "its flux is told and kept" || fail "WFPC2 PSF: $(head -1 cmd.err)"
else
    skip "no WFPC2 PSF"
fi
# as others write them: STPSF (PIXELSCL, no CRPIX, extensions of other samplings), TinyTim (PIXSCALE), GalSim (GS_SCALE, LINEAR
# coordinates whose CRPIX is not the PSF): a Gaussian of 0.06", its origin in the middle
F="perl $TOP/tests/fits.pl"
E='exp(-(($x-31.5)**2+($y-31.5)**2)/72)/(72*atan2(0,-1))'
$F make stpsf.fits 64 64 "$E" "PIXELSCL=                 0.01" "OVERSAMP=                    4" "EXTNAME = 'OVERSAMP'"
$F add stpsf.fits 16 16 '$x==8&&$y==8' "EXTNAME = 'DET_SAMP'" "PIXELSCL=                 0.04"
$F make tiny.fits 64 64 "$E" "INSTRUME= 'WFPC2'" "PIXSCALE=                 0.01"
$F make galsim.fits 64 64 "$E" "GS_WCS  = 'PixelScale'" "GS_SCALE=                 0.01" "CTYPE1  = 'LINEAR  '" "CTYPE2  = 'LINEAR  '" "CRVAL1  =                  0.0" \
    "CRVAL2  =                  0.0" "CRPIX1  =                  0.0" "CRPIX2  =                  0.0" "CD1_1   =                 0.01" "CD1_2   =                  0.0" \
    "CD2_1   =                  0.0" "CD2_2   =                 0.01"
for p in stpsf tiny galsim; do
    ok "a PSF like $p's" psfgen --from $p.fits --scale 0.01 --size 64 -o got.fits
    near "$p: FWHM of sigma 0.06\"" "$(card got.fits PSFFWHM)" 0.141289 2e-5
    near "$p: the samples come back (T is cut at 1e-6), of the peak" "$(pix diff got.fits $p.fits | cut -d' ' -f1)" 0 1e-6
    printf '# X_IMAGE Y_IMAGE FLUX TYPE\n16.5 16.5 1 star\n' >star.txt
    simage star.txt -p $p.fits -x 0.04 --size 32,32 -T 1 --accuracy 1e-4 -o got.fits
    near "$p: a star's middle" "$($F dump got.fits 0 | awk '{ s += $3; x += $1 * $3; y += $2 * $3 } END { printf "%.9f", (x + y) / s }')" 31 1e-5
done
# a PSFEx model of degree 1: planes g, .1 g, -.2 g with g a Gaussian of 2 samples, .4 pixel each
if [ -n "$python" ]; then
    "$python" - <<'END' 2>py.err
import numpy as np
from astropy.io import fits
y, x = np.mgrid[:31, :31] - 15.
g = np.exp(-(x * x + y * y) / 8) / (8 * np.pi) / .4 ** 2          # flux per pixel, as PSFEx writes
def write(name, planes, **more):
    c = [fits.Column("FLAG", "J", array=[7]), fits.Column("PSF_MASK", "%dE" % planes.size, dim=str(planes.shape[::-1]), array=[planes.astype("f4")])]
    t = fits.BinTableHDU.from_columns(c, name="PSF_DATA")
    t.header.update(dict(POLNAXIS=2, POLGRP1=1, POLNAME1="X_IMAGE", POLZERO1=500., POLSCAL1=1000., POLGRP2=1, POLNAME2="Y_IMAGE", POLZERO2=300.,
                         POLSCAL2=500., POLNGRP=1, POLDEG1=1, PSF_FWHM=2., PSF_SAMP=.4, PSFNAXIS=3, PSFAXIS1=31, PSFAXIS2=31, PSFAXIS3=len(planes)) | more)
    fits.HDUList([fits.PrimaryHDU(), t]).writeto(name)
write("model.psf", np.array([g, .1 * g, -.2 * g]))
write("broken.psf", np.array([g, .1 * g, -.2 * g]), POLDEG1=2)
END
    ok "a PSFEx model" psfgen --from model.psf --psf-scale 0.1 -X 700 -Y 800 -o ex.fits
    near "its flux at (700, 800): 1 + .1 * .2 - .2 * 1" "$(card ex.fits PSFFLUX)" 0.82 1e-6
    near "its FWHM" "$(card ex.fits PSFFWHM)" 0.188386 2e-6
    near "holds the pixel of its image" "$(card ex.fits PIXSIZE)" 0.1 1e-12
    fails "a PSFEx model without a place" 1 psfgen --from model.psf --psf-scale 0.1 -o no.fits
    fails "a PSFEx model without a pixel scale" 1 psfgen --from model.psf -X 1 -Y 1 -o no.fits
    fails "a PSFEx model with another pixel" 1 psfgen --from model.psf --psf-scale 0.1 -X 1 -Y 1 --pixel 0.1 -o no.fits
    fails "a PSFEx model that contradicts itself" 1 psfgen --from broken.psf --psf-scale 0.1 -X 1 -Y 1 -o no.fits
    sed "s/'2883E/'2883J/" model.psf >whole.psf      # the same bytes called whole numbers
    fails "a PSFEx model of whole numbers" 1 psfgen --from whole.psf --psf-scale 0.1 -X 1 -Y 1 -o no.fits
    head -c 9000 model.psf >cut.psf
    fails "a PSFEx model cut short" 1 psfgen --from cut.psf --psf-scale 0.1 -X 1 -Y 1 -o no.fits
fi
printf '%s\n' 'not a FITS file' >bad.fits
fails "not FITS" 1 psfgen --from bad.fits -o no.fits
fails "missing file" 1 psfgen --from none.fits -o no.fits
head -c 5000 psf.fits >cut.fits
fails "truncated" 1 psfgen --from cut.fits -o no.fits
head -c 1060000 psf.fits >cut2.fits
fails "truncated in the OTF" 1 psfgen --from cut2.fits -o no.fits
fails "onto its own input" 1 psfgen --from psf.fits -o psf.fits
fails "telescope and file" 2 psfgen --from psf.fits --diameter 2 -o no.fits
fails "--force without a file" 2 psfgen --force -o no.fits

# hard cases
ok "one sample" psfgen --size 1 -o one.fits
ok "even side" psfgen --size 100 -o even.fits
near "even: centre between samples" "$(card even.fits CRPIX1)" 50.5 0
# a thin ring is J0(.995 pi D r / lambda)^2: half at 1.12638 (an obscuration of 0 is the Airy disc above)
near "obscuration 0.99: FWHM" "$(fwhm --obscuration 0.99 --struts 0 --diffusion 0)" 0.060947 0.00001
fails "obscuration 1" 1 psfgen --obscuration 1 -o no.fits
fails "vanes that cover everything" 1 psfgen --strut-width 5 -o no.fits
fails "core far below a sample" 1 psfgen --wavelength 5 --diffusion 0 --size 9 -o no.fits
fails "core wider than the image" 1 psfgen --wavelength 20000 --size 9 -o no.fits
fails "image far larger than the core" 1 psfgen --wavelength 1 -o no.fits
fails "image longer than the grid asked for" 2 psfgen --pupil-grid 64 --scale 0.1 -o no.fits
ok "a long image takes a larger grid" psfgen --scale 0.1 --size 300 -o long.fits
near "its grid" "$(card long.fits PUPILN)" 448 0
fails "aberration too steep" 1 psfgen --zernike 4:90 -o no.fits
fails "memory" 1 psfgen --max-memory 1M -o no.fits
fails "one coordinate of a PSFEx position" 2 psfgen --from psf.fits --x-image 3 -o no.fits
for z in 4:0.1,5:0.1,4:0.2 0:1 4 4:nan 4:0.1,x 1.5:1 4:0.1, 9999:1; do fails "--zernike $z" 2 psfgen --zernike "$z" -o no.fits; done
for a in "--diameter -1" "--obscuration 1.1" "--size 0" "--wavelength nan" "--diffusion -1" "--telescope jwst" "--bandwidth 1e9" "--bandwidth 2000" "extra"; do
    # shellcheck disable=SC2086
    fails "$a" 2 psfgen $a -o no.fits
done
[ -e no.fits ] && fail "a failed run left a file" || pass "failed runs leave no file"
ok "--check" psfgen --check -o no.fits
[ -e no.fits ] && fail "--check wrote a file" || pass "--check writes nothing"
grep -q 'pupil: 256 cells' cmd.err && pass "--check tells the plan" || fail "--check: $(cat cmd.err)"
fails "full device" 1 psfgen -o /dev/full
# a core of 0.02" at the smallest diffusion: continuous
near "diffusion tends to none" "$(fwhm --diffusion 1e-7)" "$(fwhm --diffusion 0)" 1e-7

# a band: two Gauss-Legendre wavelengths with photon weights d(lambda)/lambda are the sum of two monochromatic images
B="--struts 0 --diffusion 0 --scale 0.02 --size 129"
psfgen $B --bandwidth 164 --wavelengths 2 -o two.fits
a=$(awk 'BEGIN { printf "%.12g", 820 - 82 / sqrt(3) }') b=$(awk 'BEGIN { printf "%.12g", 820 + 82 / sqrt(3) }')
psfgen $B --wavelength "$a" -o blue.fits; psfgen $B --wavelength "$b" -o red.fits
for f in two blue red; do $F dump $f.fits 0 >$f.txt; done
near "two wavelengths = their weighted images, of the peak" "$(paste two.txt blue.txt red.txt | awk -v a="$a" -v b="$b" '{ w = b / (a + b); d = $3 - w * $6 - (1 - w) * $9; if (d < 0) d = -d; if (d > m) m = d; if ($3 > p) p = $3 } END { print m / p }')" 0 2e-7
# +-20 % about the same mean wavelength of the photons (328 / ln 1.492 = 820 nm)
near "ePSF over a band of +-20 %: FWHM" "$(fwhm --pixel 0.1 --wavelength 831.3 --bandwidth 328)" "$(fwhm --pixel 0.1)" 0.0001
# an obscuration off the axis keeps the area
psfgen --struts 0 --diffusion 0 --size 65 --obscuration 0.3 --obscuration-offset 0.1,0.05 -v -o off.fits 2>off.txt
near "an obscuration off the axis: area" "$(card off.fits TELAREA)" "$(awk 'BEGIN { print atan2(0, -1) * (1 - 0.09) }')" 1e-3
