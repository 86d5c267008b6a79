# What examples/README.md says one can change, changed: each command line of its table
# works as written and changes what it names.  One scale, small fields, no figures.
command -v make >/dev/null || { skip "make is missing: changes of the experiment not tested"; return 0 2>/dev/null || exit 0; }
mkdir -p here/examples
cp -r "$TOP/examples/pixelscale" here/examples/
ln -s "$BIN" here/bin
cd here/examples/pixelscale || exit 1
rm -rf quick* paper* tiny*
readme=$TOP/examples/README.md
small="FIGURES= PICTURES= EXTRA= paper.stars=25"
one="single=0.16 drizzled= EXTEND= EXTENDD= paper.size=40.96"
few="SHEARS=0"
run() { # OUT ARGUMENT...: a small paper run with these arguments
    local out=$1; shift
    eval "make -s -j2 paper OUT=$out $small $* >log 2>&1" || fail "make paper $*: $(tail -2 log)"
}
# the example as README.md has it (DELIMITED by backquotes), or a failure
written() { grep -qF -- "$1" "$readme" || fail "examples/README.md no longer says $1"; }
count() { # FILE COLUMN: of Sim 1, exact fourth moments
    awk -v c="$2" '/^#/ { line = $0; next } line != "" { k = split(line, h, " "); for (i = 2; i <= k; i++) if (h[i] == c) n = i - 1; line = "" } $1 == "sim1" { print $n; exit }' "$1"/fom-exact.cat
}
less() { # WHAT COLUMN OUT
    if awk -v a="$(count "$3" "$2")" -v b="$(count base "$2")" 'BEGIN { exit !(a > 0 && a < b) }'; then pass "$1: $2 falls from $(count base "$2") to $(count "$3" "$2")"; else fail "$1: $2 was $(count base "$2"), is $(count "$3" "$2")"; fi
}
run base "$one" "$few"
change() { # OUT COLUMN EXAMPLE: it must make COLUMN smaller
    written "$3"
    run "$1" "$one" "$few" "$3"
    less "$3" "$2" "$1"
}
change depth N_DET "DEPTH=26.5"
change point N_DET "DEPTHDEF=point5"
change snr N_GAL "SNR=20"
near "SNR=20: the same detections" "$(count snr N_DET)" "$(count base N_DET)" 0
change each N_GAL "DSTAR=each"
change cuts N_GAL "CUTS=\"--size-factor 1.5 --where 'MAG_AUTO<26'\""
change threshold N_DET "THRESHOLD=3"
written 'GALGEN="--smoothing 0 --size 0.30"'
run population "$one" "$few" 'GALGEN="--smoothing 0 --size 0.30"'
less 'GALGEN="--smoothing 0 --size 0.30"' N_SIZECUT population
written "TELESCOPE=euclid"
run euclid single=0.16 drizzled= EXTEND= EXTENDD= paper.size=40.96 "$few" TELESCOPE=euclid
near "TELESCOPE=euclid: its mirror" "$(card euclid/psf-0.040.fits TELDIAM)" 1.2 0.01
written 'single="0.05 0.10" drizzled=0.10 EXTEND= EXTENDD='
run scales 'single="0.05 0.10" drizzled=0.10 EXTEND= EXTENDD=' paper.size=20.48 "$few"
same "the scales asked for, no others" <(cd scales && ls -- *-stars.rrg) <(printf '%s-stars.rrg\n' sim1-0.05 sim1-0.10 sim1d-0.10 sim2-0.05 sim2-0.10 sim2d-0.10)
written 'SHEARS="0 1a 1d"'
run shears "$one" 'SHEARS="0 1a new"' shear.new=0.1,0
same "the shears asked for" <(cd shears && ls -- sim1-*.exact.use.fits) <(printf 'sim1-0.16-%s.exact.use.fits\n' 0 1a new)
near "a shear of one's own" "$(cutcat --only-where shears/sim1-0.16-new.exact.use.fits | sed -n 's/^# Keyword: SHEAR1 = //p')" 0.1 0
written "SEED=2"
run seed "$one" "$few" SEED=2
if cmp -s base/sky.scene seed/sky.scene; then fail "SEED=2: the same sky"; else pass "SEED=2: another sky"; fi
written "SKY=own OUT=paper-own"
run own "$one" "$few" SKY=own
ok "SKY=own: a sky for each scale" test -s own/sim1-0.16.scene -a ! -e own/sky.scene
written "paper.size=327.68"
area=$(cutcat --only-where base/sim1-0.16-0.exact.use.fits | sed -n 's/^# Keyword: AREA = //p')
near "paper.size sets the area" "$area" "$(awk 'BEGIN { print (40.96 / 60) ^ 2 }')" 0.001
written "ACCURACY=1e-4"
run accuracy "$one" "$few" ACCURACY=1e-4
near "ACCURACY=1e-4: n_gal as at 1e-6, within a galaxy of 0.47 arcmin^2" "$(count accuracy N_GAL)" "$(count base N_GAL)" 2.2
