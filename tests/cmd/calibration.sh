# examples/calibration, a very small one: every result is made, an interrupted run goes on, plain is below exact.
if ! command -v gnuplot >/dev/null; then skip "no gnuplot: the calibration's figure cannot be made"; exit 0; fi
run() { make -s -j2 -C "$TOP/examples/calibration" OUT="$PWD/out" FIELD=40.96 FIELDS=1 MORE=0 SCALES=0.10 DRIZZLED= WEAK_FIELDS=1 GRID_FIELDS=1 \
    SHEARS_sim1="0 1a 1d 2a 2d" SHEARS_weak="0 1e 1f 1g 1h 2e 2f 2g 2h" "$@"; }
ok "one field first" run "$PWD/out/sim1-0.10-01.done"
stamp=$(stat -c %Y.%Z out/sim1-0.10-01-1a-mirror-exact.fits)
ok "the whole" run
near "what was there stays" "$stamp" "$(stat -c %Y.%Z out/sim1-0.10-01-1a-mirror-exact.fits)" 0
near "figure" "$(head -c 4 out/slopes.png | grep -ac PNG)" 1 0
near "sections of the table" "$(grep -c '^==' out/table.txt)" 26 0
near "no images are left" "$(find out -name '*.part*' | wc -l)" 0 0
exact=$("$BIN/fom" -q --draws 0 out/sim1-0.10-*-{0,1a,1d}-forced-exact.fits -o x.cat && col x.cat BPAIR1)
plain=$("$BIN/fom" -q --draws 0 out/sim1-0.10-*-{0,1a,1d}-forced-plain.fits -o x.cat && col x.cat BPAIR1)
between "slope with exact fourth moments" "$exact" 0.85 1.15
between "with plain ones 8 to 22 % less, of the same galaxies" "$(awk -v a="$plain" -v b="$exact" 'BEGIN { print a / b }')" 0.78 0.92
"$BIN/fom" -q --draws 0 out/sim1-0.10-*-{0,1a,1d}-{forced,mirror}-exact.fits -o x.cat
near "opposite noises are of one sky" "$(col x.cat NFIELDS)" 1 0
ok "nothing to do the second time" run -q "$PWD/out/table.txt"
