# The cost that --check prints against CPU seconds: simage's drawing (whole run less a --check run), addnoise.
galgen -n 3000 --field 110 --models models.txt -o scene.txt
psfgen -o psf.fits
predicted() { "$@" --check 2>&1 | sed -n 's/.*about \([-+.0-9e]*\) s.*/\1/p' | tail -1; }
RUNS=3
against() { # LABEL BEGIN COMMAND...: BEGIN 1: less the time of --check
    local label=$1 less=$2 p m b=0 i; shift 2
    p=$(predicted "$@")
    m=$(for ((i = 0; i < RUNS; i++)); do seconds "$@"; done | median)
    [ "$less" = 0 ] || b=$(for ((i = 0; i < RUNS; i++)); do seconds "$@" --check; done | median)
    awk -v l="$label" -v p="$p" -v m="$m" -v b="$b" 'BEGIN { t = m - b; if (t < 0.001) t = 0.001; r = p / t
        printf "%-44s predicted %7.3f s, measured %7.3f s, ratio %5.2f%s\n", l, p, t, r, r > 2 || r < 0.5 ? "  beyond a factor 2" : "" }'
}
for x in 0.04 0.10 0.16; do
    n=$(awk -v x=$x 'BEGIN { printf "%.0f", 110 / x }')
    for e in 1e-2 1e-4 1e-5; do
        against "simage $x\", $e" 1 simage scene.txt --models models.txt -p psf.fits -x $x --size "$n,$n" --shear 0.03,0.04 --accuracy $e -o image.fits
    done
    against "simage $x\", no PSF" 1 simage scene.txt --models models.txt -x $x --size "$n,$n" --shear 0.03,0.04 -o image.fits
done
for rate in 0.1 5 50 5000; do
    against "addnoise, sky $rate electron/s/arcsec^2" 0 addnoise image.fits --sky-rate $rate -o noisy.fits
done
