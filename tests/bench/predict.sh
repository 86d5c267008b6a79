# The cost that --check prints against CPU seconds (whole run less a --check run, which reads the same files).
galgen -n 6000 --field 163.84 --models models.txt -o scene.txt
psfgen -o psf.fits
predicted() { "$@" --check 2>&1 | sed -n 's/.*about \(.* and \)*\([-+.0-9e]*\) s\b.*/\2/p' | tail -1; }
against() { # LABEL COMMAND...
    local label=$1 p m b i; shift
    p=$(predicted "$@")
    m=$(for ((i = 0; i < RUNS; i++)); do seconds "$@"; done | median)
    b=$(for ((i = 0; i < RUNS; i++)); do seconds "$@" --check; done | median)
    awk -v l="$label" -v p="$p" -v m="$m" -v b="$b" 'BEGIN { t = m - b; if (t < 0.001) t = 0.001; r = p / t
        printf "%-44s predicted %7.3f s, measured %7.3f s, ratio %5.2f%s\n", l, p, t, r, (r > 2 || r < 0.5) ? "  beyond a factor 2" : "" }' | tee -a told
}
for x in 0.16 0.10 0.04; do
    n=$(awk -v x=$x 'BEGIN { printf "%.0f", 163.84 / x }')
    scene="simage scene.txt --models models.txt -x $x --size $n,$n --shear 0.03,0.04 -o image.fits"
    for e in 1e-2 1e-4 "1e-7 --floor 1" 1e-5; do
        [ "$x$e" = 0.041e-5 ] || against "simage $x\", $e" $scene -p psf.fits --accuracy $e
    done
    against "simage $x\", no PSF" $scene
    against "simage $x\", shear of order 4" $scene --shear-order 4 -p psf.fits --accuracy 1e-4
done
against "simage 0.04\", one convolution" $scene -p psf.fits --accuracy 1e-4 --method field
for q in 0.9 0.6 0.3 0.1; do
    awk -v q=$q 'BEGIN { srand(1); print "# DX DY FLUX TYPE RE Q PA"; for (i = 0; i < 3000; i++) print 160 * rand() - 80, 160 * rand() - 80, 1000, "gauss", 0.3, q, 180 * rand() }' >gauss.txt
    against "simage 0.10\", 3000 Gaussians, axis ratio $q, no PSF" simage gauss.txt -x 0.1 --size 1638,1638 -o round.fits
done
awk 'BEGIN { srand(1); print "# DX DY FLUX TYPE RE N Q PA"; for (i = 0; i < 600; i++) print 160 * rand() - 80, 160 * rand() - 80, 100, "sersic", 0.05 + 0.3 * rand(), 0.5 + 5.5 * rand(), 0.2 + 0.8 * rand(), 180 * rand() }' >sersic.txt
against "simage 0.10\", 600 Sersic profiles, no PSF" simage sersic.txt -x 0.1 --size 1638,1638 -o round.fits
against "simage 0.10\", 600 Sersic profiles, 1e-4" simage sersic.txt -x 0.1 --size 1638,1638 -p psf.fits --accuracy 1e-4 -o round.fits
for rate in 0.1 5 50 5000; do against "addnoise, sky $rate electron/s/arcsec^2" addnoise image.fits --sky-rate $rate -o noisy.fits; done
against "dither, 2 x 2" dither -n 2 noisy.fits -o four.fits
for kernel in square point turbo gaussian lanczos2 lanczos3; do
    against "drizzle, $kernel, half-pixel shifts" drizzle four.fits -x 0.04 --kernel $kernel --pixfrac 0.5 -o deep.fits
    against "drizzle, $kernel, turned" drizzle noisy.fits --rotation 20 --kernel $kernel --pixfrac 0.8 -o deep.fits
done
for more in "" "--bandwidth 200" "--pupil-grid 1024"; do against "psfgen $more" psfgen $more -o made.fits; done
against "galgen, 6000 galaxies" galgen -n 6000 --models made.txt -o made2.txt
against "detect, 0.04\"" detect noisy.fits -o found.fits
for x in 0.10 0.16; do
    n=$(awk -v x=$x 'BEGIN { printf "%.0f", 163.84 / x }')
    simage scene.txt --models models.txt -x $x --size "$n,$n" -p psf.fits --accuracy 1e-3 | addnoise --depth 27.7 -o noisy.fits
    against "detect, $x\"" detect noisy.fits -o found.fits
done
beyond=$(grep -c beyond told) || true
echo "$(wc -l <told) predictions, $beyond beyond a factor 2"
[ "$beyond" = 0 ]
