# Every program in bad surroundings: few descriptors, a small stack, no home, junk
# locale and time zone, a removed working folder, closed descriptors, two runs on
# one output; and bad files in all of them: one line, under 64 MiB and 1 s.
memory=yes patience=20
if ldd "$BIN/psfgen" | grep -qE 'asan|tsan'; then memory=; patience=200; fi    # sanitizers reserve far more, and are slow
small_chain

in=$PWD
commands() { # prints one command a line; inputs by whole names
    cat <<END
psfgen --pupil-grid 64 --size 32
galgen --field 12 -n 30 --stars
simage $in/scene.txt --models $in/models.txt -p $in/psf.fits -x 0.1 --size 60,60
dither -n 2 $in/half.fits
addnoise --depth 27.7 $in/true.fits
drizzle $in/dith.fits -x 0.1 --pixfrac 0.5
detect $in/noisy.fits
rrgshape $in/noisy.fits $in/cat.txt --stars $in/stars.rrg
cutcat $in/shapes.txt --stars $in/stars.rrg --snr 3
fom $in/cut.txt
fits2png $in/noisy.fits
END
}
target() { if [ "$1" = fits2png ]; then echo fits2png.png; else echo "$1.out"; fi; }    # the output of a program
mkdir ref box
while read -r c; do $c -o "ref/$(target ${c%% *})" 2>/dev/null; done < <(commands)

around() { # WHAT COMMAND...: every program, started by COMMAND, gives its bytes
    local what=$1 c name wrong=; shift
    while read -r c; do
        name=$(target ${c%% *}); rm -f box/*
        "$@" $c -o "$in/box/$name" >o 2>e </dev/null || wrong="$wrong $name: exit $?: $(head -c 150 e);"
        cmp -s ref/$name box/$name || wrong="$wrong $name: other bytes;"
        [ "$(ls -A box)" = $name ] || wrong="$wrong $name: left $(ls -A box);"
    done < <(commands)
    if [ -z "$wrong" ]; then pass "$what: eleven programs, the same bytes"; else fail "$what:$wrong"; fi
}
around "ten descriptors" bash -c 'ulimit -n 10; exec "$@"' -
[ -z "$memory" ] || around "256 KiB of stack" bash -c 'ulimit -s 256; exec "$@"' -
[ -z "$memory" ] || around "256 KiB of stack, three threads" bash -c 'ulimit -s 256; p=$1; shift; exec "$p" -j 3 "$@"' -
around "no home" env -u HOME
around "no environment" env -i "PATH=$PATH"
around "a junk locale and time zone" env LC_ALL=xx_YY.nonsense LANG=zz LANGUAGE=:: TZ=/nowhere:x TMPDIR=/nowhere COLUMNS=-1 OMP_NUM_THREADS=x
if locale -a 2>/dev/null | grep -qix 'de_DE.utf8'; then around "a decimal comma" env LC_ALL=de_DE.UTF-8; fi
around "descriptors closed" bash -c '"$@" <&- >&- 2>&-' -
around "a removed working folder" bash -c 'd=$(mktemp -d) && cd "$d" && rmdir "$d" && exec "$@"' -
around "a folder that cannot be written" bash -c 'cd / && exec "$@"' -

wrong=
while read -r c; do
    name=$(target ${c%% *}); rm -f box/*
    $c -o box/$name 2>/dev/null & $c -o box/$name 2>/dev/null & wait
    cmp -s ref/$name box/$name && [ "$(ls -A box)" = $name ] || wrong="$wrong $name"
done < <(commands)
if [ -z "$wrong" ]; then pass "two runs, one output: whole"; else fail "two runs, one output:$wrong"; fi

# ---- bad files in every place where a program reads one ----
mkdir bad
: >bad/empty
head -c 300000 /dev/urandom | tr 'S\037#' 'xyz' >bad/noise
head -c 900000 /dev/zero >bad/zeros
head -c 5000 true.fits >bad/cut.fits
head -c -60 cat.txt >bad/cut.txt
perl -pe 's/NAXIS1  = +120/NAXIS1  =                65535/; s/NAXIS2  = +120/NAXIS2  =                65535/' true.fits >bad/huge.fits
perl -pe 's/NAXIS1  = +120/NAXIS1  =           9999999999/' true.fits >bad/overflow.fits
{ head -c 2880 true.fits; head -c 400000000 /dev/zero; } | gzip -1n >bad/bomb.gz
head -c 500000000 /dev/zero | tr '\0' '#' | gzip -1n >bad/line.gz
head -c 900000 /dev/zero | tr '\0' '1' >bad/digits
awk 'BEGIN { print "# ID A"; for (i = 0; i < 100000; i++) print i, i "x" }' >bad/rows
awk 'BEGIN { printf "#"; for (i = 0; i < 4096; i++) printf " C%d", i; print ""; for (i = 0; i < 100; i++) print "1 2 3" }' >bad/columns
perl -e 'print map { sprintf "%-80s", $_ } "SIMPLE  = T"; print map { sprintf "%-80s", "HISTORY $_" } 1 .. 12000' >bad/history
printf 'SIMPLE  =                    T' >bad/start
mkdir bad/folder
runs=0 wrong=
try() { # COMMAND...
    local st=0 kib ms wall
    local to; to=box/$(target "$1")
    peak cost timeout "$patience" "$@" -o $to >o 2>e </dev/null || st=$?
    read -r kib ms wall <cost; runs=$((runs + 1))
    [ $st -eq 1 ] && [ "$(wc -l <e)" -eq 1 ] && grep -q "^$1: .*bad/" e && [ ! -e $to ] && ! LC_ALL=C grep -q '[^ -~]' e || wrong="$wrong $*: exit $st: $(head -c 200 e);"
    [ -z "$memory" ] || { [ $kib -lt 65536 ] && [ $ms -lt 1000 ]; } || wrong="$wrong $*: $kib KiB, $ms ms;"
    [ $kib -le $most ] || most=$kib
    rm -f box/*
}
rm -f box/*; most=0
for f in bad/*; do
    try fits2png $f
    try addnoise --depth 27 $f
    try addnoise --depth 27 --depth-definition point5 -p $f true.fits
    try dither $f
    try drizzle -x 0.1 $f
    try drizzle dith.fits --like $f
    try detect $f
    try detect --weight $f noisy.fits
    try rrgshape --psf none $f cat.txt
    try rrgshape --psf none noisy.fits $f
    try rrgshape --stars $f noisy.fits cat.txt
    try psfgen --from $f
    try simage -p $f scene.txt --models models.txt -x 0.1
    try simage $f -p psf.fits -x 0.1 --size 100,100
    try simage scene.txt --models $f -p psf.fits -x 0.1
    try galgen --library $f -n 3
    try cutcat $f
    try fom $f
done
if [ -z "$wrong" ]; then pass "$runs runs with bad files: one line each, at most $most KiB"; else fail "bad files: $(head -c 3000 <<<"$wrong")"; fi
