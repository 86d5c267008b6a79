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
# a long list: 208 bytes for each object more, and --max-memory counts them before they are taken
awk 'BEGIN { print "# DX DY FLUX TYPE RE"; for (i = 0; i < 400000; i++) printf "0.03 0.01 %d star 0.1\n", 1 + i % 7 }' >many.txt
limit=$(awk 'BEGIN { printf "%.0f", 1024 * 33 + (4 * 1e4 + 208 * 4e5) / 1024 }')
for o in "" "-p psf.fits --accuracy 1e-2"; do
    peak peak.txt simage many.txt -x 0.1 --size 100,100 -q $o -o out.fits || fail "simage many.txt $o"
    between "simage, 400000 objects, $o: peak KiB" "$(cut -d' ' -f1 peak.txt)" 40000 "$limit"
done
fails "400000 objects in 40 MB" 1 simage many.txt -x 0.1 --size 100,100 --max-memory 40M -o out.fits
sed 's/star/sersic/; s/RE$/RE N/; s/0.1$/0.1 4/' many.txt | head -100000 >sersic.txt
fails "the parts of 1e5 Sersic profiles in 100 MB" 1 simage sersic.txt -x 0.1 --size 100,100 --max-memory 100M -o out.fits
ok "400000 objects in 100 MB" simage many.txt -x 0.1 --size 100,100 --max-memory 100M -q -o out.fits
