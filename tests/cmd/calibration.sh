# examples/calibration, a very small one: every result is made, an interrupted run goes on, plain is below exact.
if ! command -v gnuplot >/dev/null; then skip "no gnuplot: the calibration's figure cannot be made"; exit 0; fi
run() { make -s -j2 -C "$TOP/examples/calibration" OUT="$PWD/out" FIELD=40.96 FIELDS=1 MORE=0 SCALES=0.10 DRIZZLED= WEAK_FIELDS=1 GRID_FIELDS=1 \
    SHEARS_sim1="0 1a 1d 2a 2d" SHEARS_weak="0 1e 1f 1g 1h 2e 2f 2g 2h" "$@"; }
ok "one field first" run "$PWD/out/sim1-0.10-01.done"
stamp=$(stat -c %Y.%Z out/sim1-0.10-01-1a-mirror-exact.fits)
ok "the whole" run
near "what was there stays" "$stamp" "$(stat -c %Y.%Z out/sim1-0.10-01-1a-mirror-exact.fits)" 0
near "figure" "$(head -c 4 out/slopes.png | grep -ac PNG)" 1 0
near "sections of the table" "$(grep -c '^==' out/table.txt)" 30 0
# the paper's formula, 12.65 sigma/sqrt(n) for nine images; two of 0.05 here: sigma/(0.05 sqrt(2 n))
for k in fit small; do
    near "$k: error of the slope by the paper's formula" "$(paste <(col out/$k-exact.cat B1SE) <(col out/$k-exact.cat SIGMA1) <(col out/$k-exact.cat N_GAL) | awk '{ print $1 / ($2 / sqrt($3 * 0.46694) / 0.0707107) }')" 1 0.05
done
near "all fields are the first ones when there are no more" "$(col out/fit-exact.cat B1)" "$(fom -q --draws 0 out/sim1-0.10-*-own-exact.fits -o x.cat && col x.cat B1)" 0
between "more galaxies without the 0.4" "$(paste <(col out/small-plain.cat N_GAL) <(col out/fit-plain.cat N_GAL) | awk '{ print $1 / $2 }')" 1.02 2
near "no images are left" "$(find out -name '*.part*' | wc -l)" 0 0
exact=$("$BIN/fom" -q --draws 0 out/sim1-0.10-*-{0,1a,1d}-forced-exact.fits -o x.cat && col x.cat BPAIR1)
plain=$("$BIN/fom" -q --draws 0 out/sim1-0.10-*-{0,1a,1d}-forced-plain.fits -o x.cat && col x.cat BPAIR1)
between "slope with exact fourth moments" "$exact" 0.85 1.15
between "with plain ones 8 to 22 % less, of the same galaxies" "$(awk -v a="$plain" -v b="$exact" 'BEGIN { print a / b }')" 0.78 0.92
"$BIN/fom" -q --draws 0 out/sim1-0.10-*-{0,1a,1d}-{forced,mirror}-exact.fits -o x.cat
near "opposite noises are of one sky" "$(col x.cat NFIELDS)" 1 0
ok "nothing to do the second time" run -q "$PWD/out/table.txt"
