# Peak memory of simage: 32 MiB + 4 B/pixel + 1 MiB/thread + 8 B/coefficient at every accuracy.
if ldd "$BIN/simage" | grep -qE 'asan|tsan'; then skip "a sanitizer reserves far more memory than the program takes"; exit 0; fi
galgen -n 6000 --models models.txt -o scene.txt
psfgen -o psf.fits
coefficients=$(awk '!/^#/ { n += NF - 10 } END { print n }' models.txt)
# strict requests draw 8 galaxies of the 6000, the brightest and others: stamps as large in less time
grep -v '^#' scene.txt | sort -g -k4 | head -3 | awk '{ print $1 }' >bright
awk 'FNR == NR { b[$1]; next } !/^#/ && ++n > 5 && !($1 in b) { $2 = 99999 } { print }' bright scene.txt >few.txt
bounded() { # SCENE PIXEL THREADS OPTION...
    local scene=$1 x=$2 j=$3 n limit; shift 3
    n=$(awk -v x="$x" 'BEGIN { printf "%.0f", 163.84 / x }')
    limit=$(awk -v n="$n" -v c="$coefficients" -v j="$j" 'BEGIN { printf "%.0f", 1024 * (32 + j) + (4 * n * n + 8 * c) / 1024 }')
    peak peak.txt simage "$scene" --models models.txt -x "$x" --size "$n,$n" --shear 0.05,0.03 -q -j "$j" "$@" -o out.fits || fail "simage $*"
    between "simage $x\", -j $j, $scene, $*: peak KiB" "$(cut -d' ' -f1 peak.txt)" 4000 "$limit"
}
for x in 0.04 0.10 0.16; do
    bounded scene.txt $x 1
    for e in 1e-2 1e-3 1e-4; do bounded scene.txt $x 1 -p psf.fits --accuracy $e; done
    for f in 0.005 0.02; do bounded scene.txt $x 2 -p psf.fits --accuracy 1e-7 --floor "$(awk "BEGIN { print $f * 170 * $x }")"; done
    for e in 1e-5 1e-6 1e-7; do bounded few.txt $x 1 -p psf.fits --accuracy $e; done
    bounded few.txt $x 2 -p psf.fits --accuracy 1e-8
    [ -z "$LARGE" ] || for j in 1 2; do bounded scene.txt $x $j -p psf.fits; done
done
# larger than the image, without a PSF
printf '# DX DY MAG TYPE RE\n0 0 18 gauss 60\n' >huge.txt
coefficients=1 bounded huge.txt 0.04 1
# a list of any length: stars, Gaussians, Sersic profiles of 40 Gaussians each, with the truth beside it, from a pipe
awk 'BEGIN { print "# Column 1: DX [,f64] x\n# Column 2: DY [,f64] y\n# Column 3: FLUX [,f64] f\n# Column 4: TYPE [,str8] t\n# Column 5: RE [,f64] r\n# Column 6: N [,f64] n"
    print "# DX DY FLUX TYPE RE N"; for (i = 0; i < 400000; i++) printf "0.03 0.01 %d star 0.1 1.5\n", 1 + i % 7 }' >many.txt
sed 's/star/gauss/' many.txt >gauss.txt
sed 's/star/sersic/' many.txt | head -3007 >sersic.txt
limit=$(awk 'BEGIN { printf "%.0f", 1024 * 33 + 4 * 1e4 / 1024 }')
for o in many.txt "many.txt -p psf.fits --accuracy 1e-2" "gauss.txt --truth t.txt" "sersic.txt -p psf.fits --accuracy 1e-2" "sersic.txt --shear 0.05,0.03"; do
    peak peak.txt simage $o -x 0.1 --size 100,100 -q -o out.fits || fail "simage $o"
    between "simage $o, $(grep -vc '^#' ${o%% *}) objects: peak KiB" "$(cut -d' ' -f1 peak.txt)" 4000 "$limit"
done
peak peak.txt simage - -x 0.1 --size 100,100 -q -o out.fits <many.txt
between "simage, 400000 objects from a pipe: peak KiB" "$(cut -d' ' -f1 peak.txt)" 4000 "$limit"
ok "400000 objects in 10 MB" simage many.txt -x 0.1 --size 100,100 --max-memory 10M -q -o out.fits
fails "an image of 100 MB in 50 MB, before the list is read" 1 simage many.txt -x 0.1 --size 5000,5000 --max-memory 50M -o none.fits
fails "the same told by --check" 1 simage many.txt -x 0.1 --size 5000,5000 --max-memory 50M --check
