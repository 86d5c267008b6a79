# 6000 default galaxies with PSF, charge diffusion, pixel and g = 0.05.
cpu "psfgen, defaults" psfgen -o psf.fits
cpu "galgen, 6000 galaxies" galgen -n 6000 --models models.txt -o scene.txt
for x in 0.10 0.16 0.04; do
    n=$(awk "BEGIN { printf \"%.0f\", 163.84 / $x }")
    # sky noise at 27.7: 170 electrons per arcsec
    for f in 0.005 0.02; do
        floor=$(awk "BEGIN { print $f * 170 * $x }")
        cpu "simage $x\", 1e-7 and floor of $f sky noise" simage scene.txt --models models.txt -p psf.fits -x $x --size $n,$n --shear 0.05,0 --accuracy 1e-7 --floor "$floor" -o out.fits
    done
    cpu "simage $x\", 1e-4" simage scene.txt --models models.txt -p psf.fits -x $x --size $n,$n --shear 0.05,0 --accuracy 1e-4 -o out.fits
    cpu "simage $x\", no PSF" simage scene.txt --models models.txt -x $x --size $n,$n --shear 0.05,0 -o out.fits
done
# Drawing alone on two threads, and what two processes side by side get out of this machine: no program does better than that.
drawn() { simage -v -j "$1" scene.txt --models models.txt -p psf.fits -x "$x" --size "$n,$n" --shear 0.05,0 --accuracy "$2" -o "out$3.fits" 2>&1 | awk '/drawn in/ { print $4 }'; }
for x in 0.10 0.16 0.04; do
    n=$(awk "BEGIN { printf \"%.0f\", 163.84 / $x }")
    for accuracy in 1e-4 1e-5; do
        for ((i = 0; i < RUNS; i++)); do
            one=$(drawn 1 $accuracy) two=$(drawn 2 $accuracy)
            drawn 1 $accuracy 1 >drawn1 & drawn 1 $accuracy 2 >drawn2; wait
            echo "$one $two $(cat drawn1 drawn2 | sort -g | tail -1)"
        done >drawn
        pairs() { awk "{ print $1 }" drawn | median; }
        best() { sort -g -k"$1" drawn | awk -v k="$1" 'NR == 1 { print $k }'; }
        awk -v l="drawing $x\", $accuracy" -v one="$(pairs '$1')" -v two="$(pairs '$1 / $2')" -v all="$(pairs '2 * $1 / $3')" -v a="$(best 1)" -v b="$(best 2)" -v c="$(best 3)" \
            'BEGIN { printf "%-24s %6.3f s, two threads: median of pairs %.2f, best/best %.2f; two processes: %.2f, %.2f\n", l, one, two, a / b, all, 2 * a / c }'
    done
done
