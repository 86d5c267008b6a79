# The experiment, tiny: killed with SIGKILL at any moment and started again, it
# ends with the same bytes as a run that nobody disturbed.
command -v make >/dev/null && command -v gnuplot >/dev/null || { skip "make or gnuplot is missing: interrupted runs not tested"; return 0 2>/dev/null || exit 0; }
mkdir -p here/examples
cp -r "$TOP/examples/pixelscale" here/examples/
ln -s "$BIN" here/bin
cd here/examples/pixelscale || exit 1
rm -rf quick* paper* tiny*
# the catalogues of two fields under three shears, and the pictures' numbers
catalogues() { (cd "$1" && find . -maxdepth 1 \( -name '*.use.fits' -o -name '*.cat' -o -name '*.rrg' -o -name '*.scene' -o -name '*.models' -o -name 'table.txt' -o -name 'psf*.fits' \) | sort | xargs sha256sum); }
begin=$(date +%s%N)
make -s tiny >log 2>&1 || fail "the tiny experiment fails: $(tail -3 log)"     # has a table, no figures
alone=$(($(date +%s%N) - begin))    # nanoseconds, the measure of the moments below
catalogues tiny >whole
between "catalogues of an undisturbed run" "$(grep -c use whole)" 24 24
rm -rf tiny
kills=0
for part in 0.04 0.09 0.06 0.03 0.08 0.05; do
    setsid make -s -j2 tiny FIGURES= PICTURES= >log 2>&1 &
    leader=$!
    sleep "$(awk "BEGIN { print $part * $alone / 1e9 }")"
    kill -9 -- -$leader 2>/dev/null && kills=$((kills + 1))
    wait $leader 2>/dev/null
done
between "runs killed" $kills 3 6
make -s -j2 tiny FIGURES= PICTURES= >log 2>&1 || fail "the resumed run fails: $(tail -3 log)"
catalogues tiny >resumed
same "six times killed and resumed: the same bytes" whole resumed
ok "no temporary file is left" test -z "$(find tiny -name '.*.tmp' -o -path 'tiny/work/*')"

# an image that is asked for again is made again, the catalogues stay
rm tiny/sim1-0.10-1a.plain.use.fits
make -s tiny FIGURES= PICTURES= KEEP=1 >log 2>&1
catalogues tiny >again
same "a lost catalogue is made again, the same bytes" whole again
ok "KEEP=1 keeps image and segmentation" test -s tiny/work/sim1-0.10-1a.fits -a -s tiny/work/sim1-0.10-1a.seg.fits
# a step that fails names itself and leaves nothing
rm tiny/sim1-0.10-1a.plain.use.fits
make -s tiny FIGURES= PICTURES= SNR=nonsense >log 2>&1 && fail "a failing step must fail the run" || pass "a failing step fails the run"
ok "and names itself" grep -q '^cutcat: ' log
ok "and leaves nothing half-made" test ! -e tiny/sim1-0.10-1a.plain.use.fits -a -z "$(find tiny -name '.*.tmp')"

# other galaxies and depths are other folders' business: the same sky for all scales, own galaxies when asked for
ok "all scales show one sky" test -s tiny/sky.scene -a ! -e tiny/sim1-0.10.scene
make -s tiny FIGURES= PICTURES= SKY=own OUT=tiny-own tiny.fields=sim1-0.10 tiny.shears=0 >log 2>&1 || fail "SKY=own: $(tail -1 log)"
ok "SKY=own: each scale its own" test -s tiny-own/sim1-0.10.scene -a ! -e tiny-own/sky.scene

# figures of what has no numbers, or of a run without the scale that they show: told, not half made
make -s tiny FIGURES="ngal cf" >log 2>&1 && fail "figures of three galaxies must fail"
ok "figures of three galaxies: told why" grep -q "^optimum: tiny: no scale has all its numbers .*FIGURES= makes the table alone" log
make -s quick OUT=one quick.fields=sim1-0.14 quick.size=40.96 >log 2>&1 && fail "figures without the reference scale must fail"
ok "figures without 0.10 arcsec: told before the run" grep -q "^figures show Sim 1 at 0.10 arcsec" log
ok "and nothing was made" test ! -e one/sim1-0.14-stars.rrg
