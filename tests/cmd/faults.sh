# Every program, with the n-th allocation, write, read, sync, rename, link, open,
# close or mapping failing: it fails cleanly (status 1, one line, no output, nothing
# left behind) or succeeds with the same bytes.
so=$BUILD/fault.so
if ldd "$BIN/psfgen" | grep -qE 'asan|tsan'; then skip "a sanitizer's build cannot preload a fault library"; exit 0; fi
[ -f "$so" ] || { fail "no $so"; exit 1; }

small_chain
printf '# DX DY\n0 0\n0.3 -1.2\n' >offsets.txt
printf '# EXPNUM DX DY\n1 0 0\n2 .5 0\n3 .5 .5\n4 0 .5\n' >shifts.txt
echo dith.fits >list.txt
awk 'BEGIN { print "CONV NORM"; for (j = 0; j < 30; j++) { for (i = 0; i < 30; i++) printf "%g ", (i - 15) ^ 2 + (j - 15) ^ 2 < 200; print "" } }' >disc.conv
ls >inputs

clean_run() { # LABEL: judge the run in $st with output out, reference ref
    if [ $st -eq 0 ]; then
        cmp -s out$ext ref$ext || echo "$1: exit 0 with other bytes"
        [ ! -e second.ref ] || cmp -s second second.ref || echo "$1: exit 0 with other bytes in the second output"
    elif [ $st -ne 1 ]; then echo "$1: exit $st: $(head -c 200 err)"
    else
        [ "$(wc -l <err)" -eq 1 ] || echo "$1: $(wc -l <err) lines: $(head -c 200 err)"
        [ -e out$ext ] && echo "$1: left an output"
        [ -e second ] && echo "$1: left the second output"
    fi
    ls -A | grep -vxF -f inputs | grep -vxE '(out|ref)(\.png|\.fits)?|second(\.ref)?|err|inputs|count|wrong' | sed "s/^/$1: left /"
}

sweep() { # NAME COMMAND...: the command writes to "out", and where it has two outputs to "second"
    local name=$1 kind n total step st; shift
    "$@" -o ref$ext 2>err || { fail "$name does not run: $(cat err)"; return; }
    [ ! -e second ] || mv second second.ref
    : >wrong
    local runs=0
    for kind in malloc write read fsync rename linkat open close mmap; do
        rm -f out$ext
        FAULT_KIND=$kind FAULT_AT=0 FAULT_COUNT=count LD_PRELOAD=$so "$@" -o out$ext 2>err
        total=$(cat count); step=$((total / 12 + 1))
        for ((n = 1; n <= total; n += n < 6 ? 1 : step)); do
            for last in '' 1; do
                rm -f out$ext second
                st=0
                FAULT_KIND=$kind FAULT_AT=$n ${last:+env FAULT_LAST=1} env LD_PRELOAD=$so timeout 20 "$@" -o out$ext >/dev/null 2>err || st=$?
                clean_run "$kind $n of $total${last:+ and later}" >>wrong
                runs=$((runs + 1))
            done
        done
    done
    if [ -s wrong ]; then fail "$name: $(wc -l <wrong) of $runs: $(head -4 wrong | tr '\n' ';')"
    else pass "$name: $runs faults survived"; fi
    rm -f out$ext ref$ext second second.ref
}
# asked not to wait for the disk, nothing does; the bytes are the same
synced() { FAULT_KIND=fsync FAULT_AT=0 FAULT_COUNT=count LD_PRELOAD=$so "$@" addnoise --depth 27.7 true.fits -o "out$#"; cat count; }
near "an output and its folder are synced" "$(synced env)" 2 0
near "PIXSHEAR_SYNC=0: nothing is" "$(synced env PIXSHEAR_SYNC=0)" 0 0
near "any other value: as ever" "$(synced env PIXSHEAR_SYNC=no)" 2 0
same "and the bytes are the same" out1 out2
rm -f out1 out2 count
ext=
sweep psfgen psfgen --pupil-grid 64 --size 32
sweep galgen galgen --field 12 -n 30 --stars
sweep simage simage scene.txt --models models.txt -p psf.fits -x 0.1 --size 60,60
sweep simage simage scene.txt --models models.txt -x 0.1 --wcs true.fits
sweep dither dither -n 2 half.fits
sweep "dither between small pixels" dither -q -n 2 --offsets offsets.txt half.fits
sweep addnoise addnoise --depth 27.7 true.fits
sweep drizzle drizzle dith.fits -x 0.1 --pixfrac 0.5
sweep "drizzle by lists" drizzle @list.txt --shift shifts.txt --var @list.txt --mask @list.txt -x 0.07
sweep detect detect noisy.fits
sweep rrgshape rrgshape noisy.fits cat.txt --stars stars.rrg
sweep "rrgshape with two outputs" rrgshape noisy.fits cat.txt --stars stars.rrg --plain second
sweep "rrgshape with a region file" rrgshape noisy.fits cat.txt --psf none --region second
sweep "detect with a kernel" detect noisy.fits --kernel-file disc.conv
sweep "detect with two outputs" detect noisy.fits --check-image segmentation=second
sweep "galgen with two outputs" galgen --field 12 -n 10 --models second
sweep "simage with two outputs" simage scene.txt --models models.txt -x 0.1 --size 60,60 --truth second
sweep cutcat cutcat shapes.txt --stars stars.rrg --snr 3
sweep fom fom cut.txt
# rows that wait on disk: more than the 4 MiB that stay in memory
awk 'BEGIN { print "# Column 1: A [,i64] a number\n# Column 2: B [,f64] another\n# A B"; for (i = 0; i < 300000; i++) print i, i / 7 }' >many.txt
cutcat many.txt --only-where -o many.fits
ls >inputs
ext=.fits
sweep "cutcat of many blocks" cutcat many.fits --only-where
ext=
ext=.png
sweep fits2png fits2png noisy.fits
