# A million objects on one pixel: the exact sum, time and memory (33 MiB with the image).
awk 'BEGIN { print "# DX DY FLUX TYPE RE"; for (i = 0; i < 1000000; i++) printf "0.03 0.01 %d star 0.1\n", i % 2 ? 1 : 1 + i % 7 }' >many.txt
total=$(awk '!/^#/ { s += $3 } END { printf "%.0f", s }' many.txt)
near "objects" "$(grep -vc '^#' many.txt)" 1000000 0
printf '# DX DY FLUX TYPE RE\n0.03 0.01 %s star 0.1\n' "$total" >one.txt
psfgen -o psf.fits
# run WHAT SECONDS MB COMMAND...: succeeds within these (CPU; resident)
run() {
    local what=$1 seconds=$2 mb=$3; shift 3
    if ! command -v /usr/bin/time >/dev/null; then skip "/usr/bin/time is not installed: $what not measured"; "$@"; return; fi
    if /usr/bin/time -f '%U %S %M' "$@" 2>time.txt; then pass "$what"; else fail "$what: $(head -c 300 time.txt)"; fi
    between "$what: CPU seconds" "$(tail -1 time.txt | awk '{ print $1 + $2 }')" 0 "$seconds"
    between "$what: MB" "$(tail -1 time.txt | awk '{ print $3 / 1024 }')" 1 "$mb"
}
run "without a PSF" 10 33 simage many.txt -x 0.1 --size 100,100 -T 1 -q -o a.fits
simage one.txt -x 0.1 --size 100,100 -T 1 -o b.fits
near "the sum, to float32" "$(pix sum a.fits | awk -v t="$total" '{ printf "%.12g", $1 / t }')" 1 6e-8
near "the pixels of one object of that flux, of the peak" "$(pix diff a.fits b.fits | cut -d' ' -f1)" 0 6e-8
run "with a PSF, accuracy 1e-4" 120 33 simage many.txt -p psf.fits -x 0.1 --size 100,100 -T 1 --accuracy 1e-4 -q -o a.fits
simage one.txt -p psf.fits -x 0.1 --size 100,100 -T 1 --accuracy 1e-4 -o b.fits
near "the same stamp a million times, of the peak" "$(pix diff a.fits b.fits | cut -d' ' -f1)" 0 2e-7
# faint ones on a bright one are not lost
awk 'BEGIN { print "# DX DY FLUX TYPE RE\n0 0 1e7 star 0.1"; for (i = 1; i < 1000000; i++) print "0 0 0.01 star 0.1" }' >faint.txt
simage faint.txt -x 0.1 --size 9,9 -T 1 -q -o c.fits
near "999999 faint points on a bright one: flux" "$(pix sum c.fits)" 10009999.99 0.5
