# --check of every program: the plan on standard error, each line with the program's name, nothing on standard output, no file.
psfgen --pupil-grid 64 --size 32 -o psf.fits
galgen --field 20 --models m.txt -o scene.txt
simage scene.txt --models m.txt -p psf.fits -x 0.1 --set s -o true.fits
addnoise --depth 27.7 true.fits -o im.fits
detect -q im.fits -o im.cat
rrgshape im.fits im.cat --psf psf.fits -o im.rrg
cutcat im.rrg -o im.use
plan() { # PROGRAM ARGUMENT...
    local st=0
    "$@" --check -o never.fits >plan.out 2>plan.err </dev/null || st=$?
    if [ $st -eq 0 ] && [ ! -s plan.out ] && [ -s plan.err ] && ! grep -qv "^$1: " plan.err; then pass "$* --check: the plan is on standard error"
    else fail "$* --check: exit $st, $(wc -c <plan.out) bytes on standard output: $(head -c 200 plan.err)"; fi
    if [ -e never.fits ]; then fail "$* --check wrote a file"; rm -f never.fits; else pass "$* --check writes nothing"; fi
}
plan psfgen
plan galgen
plan galgen --stars
plan simage scene.txt --models m.txt -p psf.fits -x 0.1
plan dither -n 2 true.fits
plan addnoise --depth 27.7 true.fits
plan drizzle im.fits
plan detect im.fits
plan rrgshape im.fits im.cat --psf psf.fits
plan rrgshape im.fits im.cat --stars-only
plan cutcat im.rrg
plan fom im.use
st=0; fits2png im.fits --check -o never.png >plan.out 2>plan.err || st=$?
if [ $st -eq 0 ] && [ ! -s plan.out ] && grep -q '^fits2png: ' plan.err && [ ! -e never.png ]; then pass "fits2png --check"; else fail "fits2png --check: exit $st $(cat plan.out plan.err)"; fi
near "every program is here" "$(find "$BIN" -type f | wc -l)" 11 0
# -v tells the seconds of the kernel: some, and less than the whole run
for p in "addnoise --depth 27.7 true.fits" "galgen -n 200 --models m2.txt" "psfgen --pupil-grid 256" "simage scene.txt --models m.txt -p psf.fits -x 0.1" "detect im.fits"; do
    # shellcheck disable=SC2086
    { TIMEFORMAT=%R; time $p -v -o told.fits 2>told.txt; } 2>whole.txt
    between "$p: seconds of the kernel, in $(cat whole.txt) s" "$(sed -n 's/.* in \([0-9.]*\) s$/\1/p' told.txt | head -1)" 1e-4 "$(cat whole.txt)"
done
