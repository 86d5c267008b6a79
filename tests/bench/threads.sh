# Kernels of addnoise, galgen and psfgen on one and two threads in turn, by the seconds that -v tells: medians of pairs;
# and what two processes side by side get out of this machine, which no program beats.
# two LABEL COMMAND...: the command with -v -j N -o oN.fits added; its line "... in S s"
two() {
    local label=$1 i one; shift
    kernel() { "${@:3}" -v -j "$1" -o "o$2.fits" 2>&1 | sed -n 's/.* \(drawn\|made\) in \([0-9.]*\) s$/\2/p'; }
    for ((i = 0; i < RUNS; i++)); do
        one=$(kernel 1 1 "$@")
        echo "$one $(kernel 2 2 "$@") $(kernel 1 3 "$@" >other & kernel 1 4 "$@" >mine; wait; cat other mine | sort -g | tail -1)"
    done >pairs
    awk -v l="$label, kernel" -v one="$(awk '{ print $1 }' pairs | median)" -v t="$(awk '{ print $1 / $2 }' pairs | median)" -v p="$(awk '{ print 2 * $1 / $3 }' pairs | median)" \
        'BEGIN { printf "%-40s %7.4f s, two threads %.2f times faster, two processes %.2f times the work\n", l, one, t, p }'
    cmp o1.fits o2.fits || echo "$label: one and two threads differ"
}
printf '# DX DY MAG TYPE RE\n0 0 40 gauss 0.3\n' >dark.txt
simage dark.txt -x 0.1 --size 2048,2048 -T 2000 -o flat.fits
for mean in 5 72 430; do
    two "addnoise, 4.2 Mpixel, mean $mean" addnoise --sky-rate "$(awk "BEGIN { print $mean / 2000 / 0.01 }")" flat.fits
done
two "galgen, 6000 galaxies" galgen --models models.txt -n 6000
two "psfgen, pupil grid 256" psfgen
two "psfgen, pupil grid 1024" psfgen --pupil-grid 1024
two "psfgen, a band" psfgen --bandwidth 200
