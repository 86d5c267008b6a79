# Faults of output and input: full disk, closed pipe, kill at random moments,
# output equal to input, closed descriptors, file size limit.  The program is
# the copier that the unit tests build, and fits2png.
# shellcheck disable=SC2002,SC2010,SC2016   # pipes are what is tested; $0 is for the inner shell
copy=
for d in "$BIN/../unit" "$TOP/build/unit"; do
    if [ -x "$d/test_fitscopy" ]; then copy=$(cd "$d" && pwd)/test_fitscopy; break; fi
done
if [ -z "$copy" ]; then fail "test_fitscopy is not built"; exit 1; fi

# A 1500 x 1000 image of 16-bit noise: 3 MB in, 6 MB out.
{
    printf '%-80s' "SIMPLE  =                    T" "BITPIX  =                   16" "NAXIS   =                    2" \
        "NAXIS1  =                 1500" "NAXIS2  =                 1000" "OBJECT  = 'noise'" END
    printf '%2320s' ''
    head -c 3000000 /dev/urandom
    head -c 960 /dev/zero
} >in.fits
ok "a good file is copied" "$copy" in.fits ref.fits
good() { [ "$(cat in.fits | cksum)" = "$sum_in" ] && cmp -s "$1" ref.fits; }
sum_in=$(cat in.fits | cksum)
mkdir box
leftovers() { # WHAT: nothing but final names in box
    local left; left=$(ls -A box | grep -vx 'out.fits')
    if [ -z "$left" ]; then pass "$1: nothing is left"; else fail "$1: left $left"; fi
    rm -rf box; mkdir box
}

# the same bytes every way
"$copy" in.fits - >o1; cat in.fits | "$copy" - o2; "$copy" - o3 <in.fits; gzip -c in.fits >in.fits.gz; "$copy" in.fits.gz o4
cat in.fits.gz | "$copy" - - | cat >o5
for i in 1 2 3 4 5; do same "file, pipe, redirection, gzip, gzip through pipes ($i)" o$i ref.fits; done
rm -f o?

# full device and disk
fails "standard output to a full device" 1 bash -c '"$0" in.fits - >/dev/full' "$copy"
fails "a full device by name" 1 "$copy" in.fits /dev/full
mkdir disk; trap "umount disk 2>/dev/null" EXIT
if [ "$(id -u)" = 0 ] && mount -t tmpfs -o size=4m none disk 2>mount.err; then
    fails "a full disk" 1 "$copy" in.fits disk/out.fits
    if [ -z "$(ls -A disk)" ]; then pass "a full disk: nothing is left"; else fail "a full disk: left $(ls -A disk)"; fi
    echo earlier >disk/out.fits
    fails "a full disk with an earlier file" 1 "$copy" in.fits disk/out.fits
    if [ "$(cat disk/out.fits)" = earlier ] && [ "$(ls -A disk)" = out.fits ]; then pass "a full disk: the earlier file stays"
    else fail "a full disk: $(ls -lA disk)"; fi
    fails "standard output into a full disk" 1 bash -c '"$0" in.fits - >disk/o' "$copy"
    if [ ! -s disk/o ]; then pass "a full disk: standard output is cut back to nothing"; else fail "a full disk: half a file on standard output"; fi
    rm -f disk/*; head -c 4000000 /dev/zero >disk/filler
    fails "fits2png on a full disk" 1 fits2png --zoom 4 in.fits -o disk/out.png
    if [ ! -e disk/out.png ]; then pass "fits2png on a full disk: no picture"; else fail "fits2png left a picture"; fi
    rm disk/filler
    # a spool that does not fit: 16 MB in double, TMPDIR on the small disk
    fails "no room for the spool" 1 env TMPDIR="$PWD/disk" "$copy" -d in.fits -
    umount disk; trap - EXIT
else
    skip "a full disk: tmpfs cannot be mounted here"
fi

# a reader that goes away
gone() { # WHAT COMMAND...: exit 1 and one line, although nobody reads
    local what=$1; shift
    "$@" 2>gone.err | true
    local st=${PIPESTATUS[0]}
    if [ "$st" -eq 1 ] && [ "$(wc -l <gone.err)" -eq 1 ]; then pass "$what: $(cat gone.err)"; else fail "$what: exit $st: $(head -c 200 gone.err)"; fi
}
gone "closed pipe" "$copy" in.fits -
gone "closed pipe, SIGPIPE ignored" bash -c 'trap "" PIPE; exec "$0" in.fits -' "$copy"
gone "closed pipe, beyond the memory spool" "$copy" -d in.fits -

# killed at random moments
RANDOM=1
default=                             # a shell's background jobs ignore INT; undo that where env can
if env --default-signal=INT true 2>/dev/null; then default="env --default-signal=INT"; fi
strike() { # SIGNAL TIMES
    local sig=$1 wrong=0 whole=0 i
    for ((i = 0; i < $2; i++)); do
        rm -f box/out.fits
        [ $((i % 2)) -eq 0 ] || cp ref.fits box/out.fits        # an earlier file, that must stay whole
        $default "$copy" in.fits box/out.fits 2>/dev/null &
        sleep "0.0$(printf %02d $((RANDOM % 30)))"
        kill "-$sig" $! 2>/dev/null
        wait $! 2>/dev/null
        if [ -e box/out.fits ]; then
            if cmp -s box/out.fits ref.fits; then whole=$((whole + 1)); else wrong=$((wrong + 1)); fi
        elif [ $((i % 2)) -eq 1 ]; then wrong=$((wrong + 1)); fi
    done
    if [ $wrong -eq 0 ]; then pass "$2 times $sig at random moments: $whole whole files, no part of one"
    else fail "$sig: $wrong of $2 runs left a part of a file"; fi
}
strike KILL 50
rm -rf box; mkdir box                # after KILL a temporary name may stay
strike TERM 15; leftovers TERM
strike INT 15; leftovers INT
strike HUP 15; leftovers HUP

# two at once
"$copy" in.fits box/out.fits & "$copy" in.fits box/out.fits & wait
if good box/out.fits; then pass "two runs, one output: whole"; else fail "two runs, one output: broken"; fi
leftovers "two runs"

# output equal to an input
ln -s in.fits link.fits; ln in.fits hard.fits
fails "output is the input" 1 "$copy" in.fits in.fits
fails "output is the input by another name" 1 "$copy" in.fits "$PWD/./in.fits"
fails "output is a link to the input" 1 "$copy" in.fits link.fits
fails "output is a hard link to the input" 1 "$copy" in.fits hard.fits
fails "output is the input's HDU" 1 "$copy" 'in.fits[0]' in.fits
fails "output is the file on standard input" 1 bash -c '"$0" - in.fits <in.fits' "$copy"
fails "standard output is the input" 1 bash -c '"$0" in.fits - >>in.fits' "$copy"
if good ref.fits; then pass "the input is unchanged"; else fail "the input was changed"; fi
rm link.fits hard.fits

# other targets
fails "a folder" 1 "$copy" in.fits box
fails "a missing folder" 1 "$copy" in.fits nowhere/out.fits
ln -s nothing dangling
fails "a link to nothing" 1 "$copy" in.fits dangling
mkfifo fifo
cat fifo >from_fifo & "$copy" in.fits fifo; wait
same "a FIFO gets everything" from_fifo ref.fits
mkdir locked; chmod 555 locked
if [ "$(id -u)" != 0 ]; then fails "a folder that may not be written" 1 "$copy" in.fits locked/out.fits
elif command -v setpriv >/dev/null; then
    chmod 755 . ; fails "a folder that may not be written" 1 setpriv --reuid=65534 --clear-groups "$copy" in.fits "$PWD/locked/out.fits"
else skip "a folder that may not be written: root may"; fi

# descriptors closed at the start
"$copy" in.fits c1 <&-; "$copy" in.fits c2 >&-; "$copy" in.fits c3 2>&-; "$copy" in.fits c4 <&- >&- 2>&-
for i in 1 2 3 4; do same "descriptors closed at the start ($i)" c$i ref.fits; done
fails "standard input closed" 1 bash -c '"$0" - x.fits <&-' "$copy"
fails "standard output closed" 1 bash -c '"$0" in.fits - >&-' "$copy"
"$copy" nothing.fits - >closed.out 2>&- && fail "an error with standard error closed" || { [ ! -s closed.out ] && pass "an error with standard error closed stays out of the output"; }
rm -f c?

# file size limit, with the signal's default and ignored
for how in 'true' 'trap "" XFSZ'; do
    fails "file size limit ($how)" 1 bash -c "$how; ulimit -f 1000; exec \"\$0\" in.fits box/out.fits" "$copy"
    if [ -e box/out.fits ]; then fail "file size limit: a file"; fi
    leftovers "file size limit"
done
# few descriptors, small stack, no home, removed folder
ok "five descriptors" bash -c 'ulimit -n 6; exec "$0" in.fits c1' "$copy"
ok "256 KiB of stack" bash -c 'ulimit -s 256; exec "$0" in.fits c2' "$copy"
ok "junk environment" env -i LC_ALL=xx TZ=zz COLUMNS=-1 "$copy" in.fits c3
for i in 1 2 3; do same "and the bytes are the same ($i)" c$i ref.fits; done
in=$PWD/in.fits; mkdir gone; (cd gone && rmdir ../gone && "$copy" "$in" out.fits 2>../gone.err); st=$?
if [ $st -eq 1 ] && [ "$(wc -l <gone.err)" -eq 1 ]; then pass "a removed working folder: $(cat gone.err)"; else fail "a removed working folder: exit $st"; fi
