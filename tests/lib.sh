# lib.sh - sourced by tests/cmd/*.sh and tests/peer/*.sh.
# Every check prints one line: "ok - ...", "not ok - ..." or "skip - ...".
# The runner sets BIN (programs), BUILD (objects, tools), TOP (project) and SHARED
# (reference data, may be missing) and starts each script in an empty directory of its own.
LC_ALL=C
export LC_ALL
PATH=$BIN:$BUILD/tool:$PATH
failures=0

pass() { echo "ok - $*"; }
fail() { echo "not ok - $*"; failures=$((failures + 1)); }
skip() { echo "skip - $*"; }

# ok WHAT COMMAND...: the command must succeed
ok() {
    local what=$1; shift
    if "$@" >cmd.out 2>cmd.err; then pass "$what"
    else fail "$what (exit $?: $* : $(head -c 300 cmd.err))"; fi
}
# fails WHAT STATUS COMMAND...: that exit status, one line on stderr
fails() {
    local what=$1 want=$2 got=0; shift 2
    "$@" >cmd.out 2>cmd.err || got=$?
    if [ $got -ne "$want" ]; then fail "$what (exit $got, not $want: $*: $(head -c 300 cmd.err))"
    elif [ "$(wc -l <cmd.err)" -ne 1 ]; then fail "$what (stderr has $(wc -l <cmd.err) lines: $(head -c 300 cmd.err))"
    else pass "$what: $(cut -c1-120 cmd.err)"; fi
}
# same WHAT FILE FILE: identical bytes
same() {
    if cmp -s "$2" "$3"; then pass "$1"; else fail "$1 ($2 and $3 differ)"; fi
}
# near WHAT GOT WANT TOLERANCE: numbers; a word or nan never passes
near() {
    if awk -v g="$2" -v w="$3" -v t="$4" 'BEGIN { if (g !~ /^[-+0-9.eE]+$/) exit 1; d = g - w; if (d < 0) d = -d; exit !(d <= t) }'
    then pass "$1: $2 (want $3 +- $4)"; else fail "$1: $2 (want $3 +- $4)"; fi
}
# between WHAT GOT LO HI
between() {
    if awk -v g="$2" -v a="$3" -v b="$4" 'BEGIN { if (g !~ /^[-+0-9.eE]+$/) exit 1; exit !(g >= a && g <= b) }'
    then pass "$1: $2 (in $3..$4)"; else fail "$1: $2 (not in $3..$4)"; fi
}
# col FILE NAME: a column of a text catalogue, one value a line
col() { awk -v n="$2" '/^#/ { line = $0; next } !c { k = split(line, h, " "); for (i = 2; i <= k; i++) if (h[i] == n) c = i - 1; if (!c) exit 1 } { print $c }' "$1"; }
# key FILE NAME: a "# Keyword:" value of a text catalogue
key() { sed -n "s/^# Keyword: $2 = //p" "$1" | head -1; }
# card FILE NAME: the value of a FITS card of the primary header
card() { fold -w80 "$1" | grep -a -m1 "^$(printf %-8s "$2")=" | sed "s/^.\{10\} *//; s/ *\/.*//; s/ *$//; s/^'\(.*\)'$/\1/; s/ *$//"; }
# small_chain: one small file of each kind, from psf.fits to cut.txt
small_chain() {
    psfgen --pupil-grid 64 --size 32 -o psf.fits
    galgen --field 12 -n 30 --models models.txt -o scene.txt
    simage scene.txt --models models.txt -p psf.fits -x 0.1 --size 120,120 -o true.fits
    simage scene.txt --models models.txt -p psf.fits -x 0.1 --subpixel 2 --size 121,121 -o half.fits
    galgen --field 12 --stars -n 25 | simage - -p psf.fits -x 0.1 --size 120,120 | addnoise --depth 27.7 -o stars.fits
    addnoise --depth 27.7 true.fits -o noisy.fits
    dither -n 2 half.fits -o dith.fits
    detect noisy.fits -o cat.txt
    detect stars.fits -o scat.txt
    rrgshape --stars-only stars.fits scat.txt -o stars.rrg
    rrgshape noisy.fits cat.txt --stars stars.rrg -o shapes.txt
    cutcat shapes.txt --stars stars.rrg --snr 3 -o cut.txt
}
