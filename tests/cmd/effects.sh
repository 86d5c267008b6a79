# Only the effects a scene calls for: an effect that is off has no byte in the image, and
# no function of its kernel is entered (callgrind); one that is on enters its own and no other's.
PSF="-M 64 --size 65 -o"
psfgen --diffusion 0 $PSF psf.fits
cat >o.txt <<'END'
# DX DY FLUX TYPE RE
0.03 0.01 1 gauss 0.15
-0.1 0.2 1 star 0.1
END
sed 's/ RE/ RE G1 G2/; s/0.15$/0.15 0.03 0.04/; s/0.1$/0.1 0 0/' o.txt >own.txt
sed 's/ RE/ RE N/; s/gauss 0.15/sersic 0.15 1/; s/0.1$/0.1 1/' o.txt >sersic.txt
printf '# ID BETA NMAX MAG COEFFS\n1 0.15 1 20 1.88063194515918 0 0.3\n' >m.txt
printf '# DX DY FLUX TYPE MODEL\n0.03 0.01 1 shapelet 1\n' >model.txt
printf '# DX DY FLUX TYPE MODEL ROT\n0.03 0.01 1 shapelet 1 30\n' >turned.txt
printf '# DX DY FLUX TYPE MODEL PARITY\n0.03 0.01 1 shapelet 1 -1\n' >mirror.txt
printf '# RA DEC FLUX TYPE RE\n150 2.2 1 gauss 0.15\n' >sky.txt
S="-x 0.1 --size 24,24 --accuracy 1e-2"
data() { perl -0777 -pe 's/(HISTORY |CHECKSUM).{72}//gs; s/END {77,}/END/' "$1" >"$1.data"; }

# no byte
simage o.txt -p psf.fits $S -o a.fits; data a.fits
simage o.txt $S -o b.fits; data b.fits
for o in "--diffusion 0" "--jitter 0" "--ipc 0" "--pixel-edge 0,0" "--shear 0,0" "--shear 0,0 --shear-order 4" "--shear -0,-0" "--subpixel 1"; do
   
    simage o.txt -p psf.fits $S $o -o c.fits; data c.fits
    sed -i 's/SHEARORD=                    4/SHEARORD=                    0/; s/ -0\.0 /  0.0 /g' c.fits.data
    cmp -s a.fits.data c.fits.data && pass "simage $o: no byte" || fail "simage $o: bytes differ from none"
    case $o in *diff* | *jit* | *ipc* | *edge*) continue ;; esac
   
    simage o.txt $S $o -o c.fits; data c.fits
    sed -i 's/SHEARORD=                    4/SHEARORD=                    0/; s/ -0\.0 /  0.0 /g' c.fits.data
    cmp -s b.fits.data c.fits.data && pass "simage without a PSF $o: no byte" || fail "simage without a PSF $o: bytes differ from none"
done
simage o.txt -p psf.fits $S --pixel 0.1,0.1 -o c.fits
near "simage --pixel of the pixel: no byte, of the peak" "$(pix diff a.fits c.fits | cut -d' ' -f1)" 0 0
addnoise a.fits -o n.fits; data n.fits
for o in "--sky-rate 0" "--dark 0" "--read-noise 0" "--gain 1" "--qe 1"; do
   
    addnoise $o a.fits -o c.fits; data c.fits
    cmp -s n.fits.data c.fits.data && pass "addnoise $o: no byte" || fail "addnoise $o: bytes differ from none"
done
addnoise --saturate 1e9 a.fits -o c.fits
near "addnoise --saturate above every pixel: no byte" "$(pix diff n.fits c.fits | cut -d' ' -f2)" 0 0
psfgen $PSF p.fits --diffusion 0; data p.fits
for o in "--zernike 4:0" "--bandwidth 0" "--obscuration-offset 0,0"; do
   
    psfgen --diffusion 0 $PSF c.fits $o; data c.fits
    sed -i 's/ZERN4   = .\{70\}//' c.fits.data; sed 's/ZERN4   = .\{70\}//' p.fits.data >p.data
    near "psfgen $o: the image has no byte" "$(pix diff p.fits c.fits | cut -d' ' -f2)" 0 0
done

# what they do: IPC keeps the flux and moves 4 A of a lone pixel; jitter and diffusion are the same Gaussian
simage o.txt -p psf.fits $S --accuracy 1e-6 --jitter 0.03 -o j.fits
simage o.txt -p psf.fits $S --accuracy 1e-6 --diffusion 0.03 -o d.fits
near "jitter = diffusion of that rms" "$(pix diff j.fits d.fits | cut -d' ' -f2)" 0 0
simage o.txt -p psf.fits $S --accuracy 1e-6 --jitter 0.04 --diffusion 0.03 -o j.fits
simage o.txt -p psf.fits $S --accuracy 1e-6 --diffusion 0.05 -o d.fits
near "0.03 and 0.04 are 0.05, of the peak" "$(pix diff j.fits d.fits | cut -d' ' -f1)" 0 1e-7
simage o.txt -p psf.fits $S --accuracy 1e-6 -o plain.fits
simage o.txt -p psf.fits $S --accuracy 1e-6 --ipc 0.01 -o ipc.fits
F="perl $TOP/tests/fits.pl"
$F dump plain.fits 0 >plain.txt; $F dump ipc.fits 0 >ipc.txt
near "IPC = the 3 x 3 kernel on the pixels, of the peak" "$(awk 'NR == FNR { v[$1, $2] = $3; if ($3 > p) p = $3; next }
    $1 > 0 && $1 < 23 && $2 > 0 && $2 < 23 { e = $3 - 0.96 * v[$1, $2] - 0.01 * (v[$1 - 1, $2] + v[$1 + 1, $2] + v[$1, $2 - 1] + v[$1, $2 + 1])
    if (e < 0) e = -e; if (e > m) m = e } END { print m / p }' plain.txt ipc.txt)" 0 1e-6
simage o.txt -p psf.fits -x 0.05 --size 49,49 --accuracy 1e-6 -N 1 -o small.fits
simage o.txt -p psf.fits -x 0.05 --size 48,48 --accuracy 1e-6 --pixel 0.1,0.05 -o wide.fits
simage o.txt -p psf.fits -x 0.05 --size 49,48 --accuracy 1e-6 -o narrow.fits
$F dump wide.fits 0 >wide.txt; $F dump narrow.fits 0 >narrow.txt
# centres of 48 pixels lie on edges of 49: two neighbours, halved, are the wide response
near "a response of two pixels = the mean of two, of the peak" "$(awk 'NR == FNR { v[$1, $2] = $3; next }
    { e = $3 - (v[$1, $2] + v[$1 + 1, $2]) / 2; if (e < 0) e = -e; if (e > m) m = e; if ($3 > p) p = $3 } END { print m / p }' narrow.txt wide.txt)" 0 4e-6
# edges: a trapezoid is the box averaged over places within EX and EY (Gauss-Legendre, 4 x 4 of them)
awk 'function node(i) { return i == 1 ? -.861136311594053 : i == 2 ? -.339981043584856 : i == 3 ? .339981043584856 : .861136311594053 }
    function weight(i) { return i == 1 || i == 4 ? .173927422568727 : .326072577431273 }
    /^#/ { print; next } { for (i = 1; i <= 4; i++) for (j = 1; j <= 4; j++) printf "%.15g %.15g %.15g %s %s\n", $1 + .015 * node(i), $2 + .02 * node(j), $3 * weight(i) * weight(j), $4, $5 }' o.txt >spread.txt
simage o.txt -p psf.fits $S --accuracy 1e-6 --pixel 0.1,0.08 --pixel-edge 0.03,0.04 -o edge.fits
simage spread.txt -p psf.fits $S --accuracy 1e-7 --pixel 0.1,0.08 -o spread.fits
near "a trapezoid response = the box spread over its edges, of the peak" "$(pix diff edge.fits spread.fits | cut -d' ' -f1)" 0 1e-6
simage o.txt -p psf.fits $S --accuracy 1e-6 --pixel 0.1,0.08 -o box.fits
between "and not the box, of the peak" "$(pix diff edge.fits box.fits | cut -d' ' -f1)" 1e-3 1
near "PIXEDGE2" "$(card edge.fits PIXEDGE2)" 0.04 1e-15
# the convolution of the whole field knows the same effects
for o in "--jitter 0.03" "--ipc 0.01" "--pixel 0.12,0.08" "--pixel-edge 0.04,0.06" "--diffusion 0.04 --jitter 0.02 --ipc 0.02 --pixel 0.1,0.08 --pixel-edge 0.02,0"; do
    simage o.txt -p psf.fits $S --accuracy 1e-6 $o -o stamps.fits
    simage o.txt -p psf.fits $S --accuracy 1e-6 $o --method field -o whole.fits
    near "$o: stamps and field, of the peak" "$(pix diff stamps.fits whole.fits | cut -d' ' -f1)" 0 1e-6
done
# a width that tends to none: differences fall as its square
simage o.txt -p psf.fits $S --accuracy 1e-7 -o none.fits
for o in diffusion jitter; do
    for s in 0.004 0.002 1e-5; do
        simage o.txt -p psf.fits $S --accuracy 1e-7 --$o $s -o some.fits
        pix diff none.fits some.fits | cut -d' ' -f1 >"d$s"
    done
    between "$o of 0.004\" over 0.002\": difference from none" "$(awk -v a="$(cat d0.004)" -v b="$(cat d0.002)" 'BEGIN { print a / b }')" 3.8 4.1
    near "$o of 1e-5\": of the peak" "$(cat d1e-5)" 0 3e-7
done
psfgen --diffusion 0 --pixel 0.1 $PSF epsf.fits
fails "edges on a PSF with a pixel" 1 simage o.txt -p epsf.fits $S --pixel-edge 0.01,0 -o no.fits
fails "edges longer than the pixel" 2 simage o.txt -p psf.fits $S --pixel-edge 0.11,0 -o no.fits
fails "edges without a PSF" 2 simage o.txt $S --pixel-edge 0.01,0 -o no.fits
fails "edges and --no-pixel" 2 simage o.txt -p psf.fits $S --no-pixel --pixel-edge 0.01,0 -o no.fits

# no function
if ldd "$BIN/psfgen" | grep -qE 'asan|tsan'; then
    skip "a sanitizer's build cannot run under valgrind: which functions are entered is not checked"
    return 0
fi
if ! command -v valgrind >/dev/null; then
    skip "valgrind is not installed: which functions are entered is not checked"
    return 0
fi
entered() { # NAME COMMAND...: functions in NAME.fn, instructions in NAME.ir
    local n=$1; shift
    valgrind --tool=callgrind --callgrind-out-file="$n.cg" "$@" >/dev/null 2>"$n.err" || fail "$n: $(tail -1 "$n.err")"
    sed -n 's/^c\?fn=([0-9]*) //p' "$n.cg" | sort -u >"$n.fn"
    sed -n 's/^summary: *//p; s/^totals: *//p' "$n.cg" | head -1 >"$n.ir"
}
# own NAME FUNCTIONS: NAME.fn has these of all kernels of its program and no other; "+" stands for any
own() {
    local n=$1 want=" $2 " f all=$3 wrong=""
    for f in $all; do
        if grep -qE "^$f(\$|[.'])" "$n.fn"; then case $want in *" $f "* | *" $f? "*) ;; *) wrong="$wrong entered:$f" ;; esac
        else case $want in *" $f "*) wrong="$wrong not-entered:$f" ;; esac; fi
    done
    if [ -z "$wrong" ]; then pass "$n enters${2:+ $2}, none of the other $(wc -w <<<"$all") kernels; $(cat "$n.ir") instructions"
    else fail "$n:$wrong"; fi
}
K="stamp_fourier stamp_grid_new wings_new psf_read otf_diffusion otf_neighbours otf_box stamp_closed shapelet_pixel shear_matrix_coeff shear_apply shear_series \
shapelet_rotate_by shapelet_mirror shear_exact sersic_gaussians sky_to_pixel distort models_open"
I="-x 0.1 --size 12,12 --accuracy 1e-1 -o x.fits"
P="-p psf.fits"
F1="stamp_fourier stamp_grid_new wings_new psf_read"
{
entered nothing simage o.txt $I --no-pixel;                own nothing "stamp_closed" "$K"
entered pixel simage o.txt $I;                             own pixel "stamp_closed shapelet_pixel" "$K"
entered shear simage o.txt $I --no-pixel -g 0.03,0.04;     own shear "stamp_closed shear_matrix_coeff shear_exact shear_apply" "$K"
entered series simage o.txt $I --no-pixel -g 0.03,0.04 --shear-order 4; own series "stamp_closed shear_series shear_apply" "$K"
entered own-shear simage own.txt $I --no-pixel;            own own-shear "stamp_closed shear_exact" "$K"
entered models simage model.txt --models m.txt $I --no-pixel;     own models "stamp_closed models_open" "$K"
entered rotation simage turned.txt --models m.txt $I --no-pixel;  own rotation "stamp_closed models_open shapelet_rotate_by" "$K"
entered parity simage mirror.txt --models m.txt $I --no-pixel;    own parity "stamp_closed models_open shapelet_mirror" "$K"
entered sersic simage sersic.txt $I --no-pixel;            own sersic "stamp_closed sersic_gaussians" "$K"
entered sky-position simage sky.txt $I --no-pixel;         own sky-position "stamp_closed sky_to_pixel" "$K"
entered distortion simage o.txt $I --no-pixel --wcs b.fits; own distortion "stamp_closed distort sky_to_pixel shear_exact" "$K"
entered psf simage o.txt $I $P --no-pixel;                 own psf "$F1" "$K"
entered psf-pixel simage o.txt $I $P;                      own psf-pixel "$F1 otf_box" "$K"
entered psf-diffusion simage o.txt $I $P --no-pixel --diffusion 0.04; own psf-diffusion "$F1 otf_diffusion" "$K"
entered psf-jitter simage o.txt $I $P --no-pixel --jitter 0.01; own psf-jitter "$F1 otf_diffusion" "$K"
entered psf-ipc simage o.txt $I $P --no-pixel --ipc 0.01;  own psf-ipc "$F1 otf_neighbours" "$K"
}
entered psf-edge simage o.txt $I $P --pixel-edge 0.02,0.02;  own psf-edge "$F1 otf_box" "$K"
# calls NAME FUNCTION: how often it was called
calls() { awk -v f="$2" '/^c?fn=/ { id = $1; sub(/^c?fn=/, "", id); if (NF > 1) name[id] = $2 }
    /^cfn=/ { to = id } /^calls=/ { split($1, c, "="); if (name[to] ~ "^" f "([.\x27]|$)") n += c[2] } END { print n + 0 }' "$1.cg"; }
near "edges: one more factor for each table" "$(awk -v a="$(calls psf-edge otf_box)" -v b="$(calls psf-pixel otf_box)" 'BEGIN { print a / b }')" 2 0
N="poisson_inverse_run noise_depth_sky noise_psf_area"
simage o.txt -x 0.1 --size 12,12 -T 1 -o s.fits
entered photons addnoise s.fits -o x.fits;                         own photons "poisson_inverse_run" "$N"
entered sky addnoise s.fits --sky 25 --dark 0.1 -o x.fits;           own sky "poisson_inverse_run" "$N"
entered depth addnoise s.fits --depth 27 -o x.fits;                own depth "poisson_inverse_run noise_depth_sky" "$N"
entered read-noise addnoise s.fits --read-noise 4 -o x.fits;       own read-noise "poisson_inverse_run" "$N"
simage o.txt -x 0.1 --size 300,300 -T 1 -o large.fits
entered large addnoise large.fits -o x.fits
entered large-off addnoise large.fits --gain 1 --qe 1 --dark 0 --sky-rate 0 --read-noise 0 -o x.fits
near "gain, efficiency, dark, sky and read noise of nothing: instructions over those without" "$(awk -v a="$(cat large-off.ir)" -v b="$(cat large.ir)" 'BEGIN { print a / b }')" 1 0.002
near "photons: one number a pixel" "$(calls photons rng_uniform_run)" 1 0
near "read noise: two" "$(calls read-noise rng_uniform_run)" 2 0
Z="zernike otf_diffusion otf_box fft_run pupil_annulus"
G="--size 33 -M 32 -o x.fits --telescope snap"
{
entered discs psfgen $G --diffusion 0 --struts 0;                  own discs "pupil_annulus" "$Z"
entered struts psfgen $G --diffusion 0;                            own struts "fft_run" "$Z"
entered aberration psfgen $G --diffusion 0 --zernike 4:0.05;       own aberration "zernike fft_run" "$Z"
entered psfgen-diffusion psfgen $G --diffusion 0.04 --struts 0;    own psfgen-diffusion "otf_diffusion pupil_annulus" "$Z"
entered band psfgen $G --diffusion 0 --struts 0 --bandwidth 80;   own band "pupil_annulus" "$Z"
near "a band: as many closed forms as wavelengths" "$(awk -v a="$(calls band pupil_annulus)" -v b="$(calls discs pupil_annulus)" 'BEGIN { print a / b }')" 8 0
entered psfgen-pixel psfgen $G --diffusion 0 --pixel 0.1 --struts 0; own psfgen-pixel "otf_box pupil_annulus" "$Z"
}
