# Tile-compressed images: the same pixels and header as the uncompressed image;
# broken ones and a decoder that crashes are a clean error.
copy=
for d in "$BIN/../unit" "$TOP/build/unit"; do
    if [ -x "$d/test_fitscopy" ]; then copy=$(cd "$d" && pwd)/test_fitscopy; break; fi
done
if [ -z "$copy" ]; then fail "test_fitscopy is not built"; exit 1; fi
if ! command -v fpack >/dev/null; then skip "fpack is not installed: tile-compressed images are not tested"; exit 0; fi
memory=yes
if ldd "$copy" | grep -qE 'asan|tsan'; then memory=; fi    # sanitizers reserve far more

# image FILE BITPIX NX NY CARD...: noise about 1000 (8 bit: 100)
image() {
    perl -e 'my ($b, $nx, $ny, @c) = @ARGV; srand 5; my $s = 1;
        my @h = ("SIMPLE  =                    T", map({ sprintf "%-8s= %20d", @$_ } ["BITPIX", $b], ["NAXIS", 2], ["NAXIS1", $nx], ["NAXIS2", $ny]), @c, "END");
        my $h = join "", map { sprintf "%-80s", $_ } @h; print $h, " " x (-length($h) % 2880);
        my $f = { 8 => "C", 16 => "s>", 32 => "l>", -32 => "f>", -64 => "d>" }->{$b}; my $d = "";
        for (1 .. $nx * $ny) { my $v = $b == 8 ? 100 : 1000; $v += 10 * (rand() + rand() + rand() - 1.5); $v *= 77 if $b == 32; $d .= pack $f, $v }
        print $d, "\0" x (-length($d) % 2880);' -- "${@:2}" >"$1"
}
compare() { # WHAT PLAIN PACKED
    "$copy" "$2" a.fits 2>e && "$copy" "$3" b.fits 2>>e || { fail "$1: $(cat e)"; return; }
    same "$1" a.fits b.fits
}
image i16.fits 16 301 157 "BZERO   =                32768" "OBJECT  = 'thing'" "EXPTIME =                100.5" "CRVAL1  = 150.0"
image i32.fits 32 301 157 "BLANK   =                77000" "BSCALE  =                  0.5"
image u8.fits 8 301 157
image f32.fits -32 301 157 "OBJECT  = 'thing'"
image f64.fits -64 301 157
for t in i16 i32 u8; do
    for how in r g1 g2 h p; do
        [ $t$how = i32p ] && continue                 # fpack cannot
        fpack -$how -O $t.$how.fz $t.fits
        compare "$t, fpack -$how" $t.fits $t.$how.fz
    done
done
for t in f32 f64; do
    for how in g1 g2; do
        fpack -$how -q 0 -O $t.$how.fz $t.fits
        compare "$t without loss, fpack -$how" $t.fits $t.$how.fz
    done
    for how in r g1 h; do                             # dithered: the same numbers as funpack's
        rm -f q.fz u.fits; fpack -$how -q 4 -O q.fz $t.fits; funpack -O u.fits q.fz
        compare "$t quantised, fpack -$how" u.fits q.fz
    done
done
fpack -r -w -O w.fz i16.fits; compare "one tile" i16.fits w.fz
fpack -g1 -t 50,40 -O t.fz i16.fits; compare "tiles of 50 x 40" i16.fits t.fz
fpack -d -O d.fz i16.fits; fails "tiles that are not compressed (cfitsio forgets BZERO)" 1 "$copy" d.fz b.fits
compare "the HDU by number" i16.fits 'i16.r.fz[1]'
fails "an HDU that is not there" 1 "$copy" 'i16.r.fz[2]' b.fits
"$copy" i16.fits a.fits
"$copy" - b.fits <i16.r.fz; same "redirected" a.fits b.fits
cat i16.r.fz | "$copy" - b.fits; same "through a pipe" a.fits b.fits
gzip -c i16.r.fz >z.gz; "$copy" z.gz b.fits; same "gzip of it" a.fits b.fits

# several extensions
perl "$TOP/tests/fits.pl" make m.fits 40 30 '$x' "EXTEND  =                    T"
perl "$TOP/tests/fits.pl" add m.fits 60 20 '$x*$y' "EXTNAME = 'SCI     '" "EXTVER  = 1"
perl "$TOP/tests/fits.pl" add m.fits 50 25 '$x+3*$y' "EXTNAME = 'SCI     '" "EXTVER  = 2"
fpack -g2 -q 0 -O m.fz m.fits
compare "the first image" 'm.fits[0]' 'm.fz[1]'
compare "by name" 'm.fits[SCI]' 'm.fz[sci]'
compare "by name and version" 'm.fits[SCI,2]' 'm.fz[SCI,2]'
ok "a program reads it" fits2png i16.r.fz -o p1.png; fits2png i16.fits -o p2.png; same "and sees the same" p1.png p2.png
image noisy.fits 16 200 200 "PIXSCALE=                  0.1"
fpack -r -O noisy.fz noisy.fits; detect noisy.fits -o c1 2>/dev/null; detect noisy.fz -o c2 2>/dev/null
same "detect finds the same" <(grep -v '^# HISTORY' c1 | sed s/noisy.fits//) <(grep -v '^# HISTORY' c2 | sed s/noisy.fz//)

# ---- broken ones: within a second and 64 MiB
try() { # WHAT STATUS: bad.fz; STATUS 1: must fail cleanly, -1: or work
    local st=0 why="" kib ms wall
    mkdir c; cp bad.fz c; (cd c && exec peak ../cost "$copy" bad.fz out.fits) >o 2>e || st=$?
    read -r kib ms wall <cost
    [ $st -eq 1 ] || { [ $st -eq 0 ] && [ $2 -lt 0 ]; } || why="exit $st"
    [ $st -ne 1 ] || [ "$(wc -l <e)" -eq 1 ] || why="$why, $(wc -l <e) lines"
    [ $st -ne 1 ] || grep -q 'bad.fz: ' e || why="$why, does not name the file"
    LC_ALL=C grep -q '[^ -~]' e && why="$why, control characters"
    [ $st -eq 0 ] || [ "$(ls -A c)" = bad.fz ] || why="$why, left $(ls -A c)"
    [ $ms -lt 1000 ] && [ $wall -lt 10000 ] || [ -z "$memory" ] || why="$why, took $ms ms, $wall in all"
    [ -z "$memory" ] || [ $kib -lt 65536 ] || why="$why, took $kib KiB"
    rm -rf c
    if [ -z "$why" ]; then quiet=$((quiet + 1)); [ -z "$say" ] || pass "$1: $(cut -c1-150 e) ($kib KiB, $ms ms)"; else fail "$1: $why: $(head -c 200 e)"; fi
}
quiet=0 say=yes
edit() { perl -0pe "$2" "$1" >bad.fz; }
edit i16.r.fz 's/ZNAXIS1 = +301/ZNAXIS1 =                60000/'; try "ZNAXIS1 larger than the tiles" 1
edit i16.r.fz 's/ZNAXIS1 = +301/ZNAXIS1 =           4000000000/'; try "ZNAXIS1 of 4e9" 1
edit i16.r.fz 's/ZNAXIS2 = +157/ZNAXIS2 =                  158/'; try "more rows than tiles" 1
edit i16.r.fz 's/ZNAXIS2 = +157/ZNAXIS2 =                   -1/'; try "ZNAXIS2 of -1" 1
edit i16.r.fz 's/ZNAXIS  = +2/ZNAXIS  =                 2000/'; try "ZNAXIS of 2000" 1
edit i16.r.fz 's/ZTILE1  = +301/ZTILE1  =                    0/'; try "ZTILE1 of 0" 1
edit i16.r.fz 's/ZTILE1  = +301/ZTILE1  =                    1/'; try "more tiles than rows" 1
edit i16.r.fz 's/ZBITPIX = +16/ZBITPIX =                   17/'; try "ZBITPIX of 17" 1
edit i16.r.fz "s/ZCMPTYPE= 'RICE_1  '/ZCMPTYPE= 'MAGIC   '/"; try "an unknown algorithm" 1
edit i16.r.fz 's/ZCMPTYPE/ZZMPTYPE/'; try "no algorithm" 1
edit w.fz 's/ZNAXIS1 = +301/ZNAXIS1 =                65535/; s/ZNAXIS2 = +157/ZNAXIS2 =                65535/; s/ZTILE1  = +301/ZTILE1  =                65535/; s/ZTILE2  = +157/ZTILE2  =                65535/'
try "one tile of 65535 x 65535" 1
edit i16.r.fz "s/TFORM1  = '1PB/TFORM1  = '1PE/"; try "tiles of another type" -1
edit i16.r.fz "s/COMPRESSED_DATA/COMPRESSED_DATE/"; try "no column of tiles" 1
edit i16.g1.fz "s/ZCMPTYPE= 'GZIP_1  '/ZCMPTYPE= 'RICE_1  '/"; try "gzip taken for Rice" -1
edit i16.r.fz "s/ZCMPTYPE= 'RICE_1  '/ZCMPTYPE= 'GZIP_1  '/"; try "Rice taken for gzip" 1
edit i16.r.fz "s/ZCMPTYPE= 'RICE_1  '   /ZCMPTYPE= 'HCOMPRESS_1'/"; try "Rice taken for Hcompress" 1
edit u8.r.fz "s/ZCMPTYPE= 'RICE_1  '/ZCMPTYPE= 'PLIO_1  '/"; try "Rice taken for PLIO" -1
head -c 20000 i16.r.fz >bad.fz; try "a heap that is cut off" 1
say=
for t in i16.r i16.g1 i16.g2 i16.h i16.p f32.g2 w; do     # a byte, or a run of them, changed somewhere in the table or heap
    for ((i = 0; i < 12; i++)); do
        perl -e 'srand $ARGV[1]; local $/; open F, "<:raw", $ARGV[0]; $_ = <F>; my $n = 1 + int rand 40; my $at = index($_, "XTENSION");
            $at += 2880 * (1 + int((index(substr($_, $at), "END" . " " x 77)) / 2880)); my $p = $at + int rand(rand() < .3 ? 1000 : length($_) - $at - $n);
            substr($_, $p, $n) = join "", map { chr int rand 256 } 1 .. $n; binmode STDOUT; print' ${t%.fz}.fz $i >bad.fz
        try "$t, damage $i" -1
    done
done
[ $quiet -ge 90 ] && pass "$quiet broken files survived"

# ---- the library itself: not there, crashing, hanging, greedy, ending, writing
name=$(grep -ao 'libcfitsio\.so[.0-9]*' "$copy" | head -1)
if [ -z "$memory" ] || ! ${CC:-cc} -shared -fPIC -O1 -w -Wl,-soname,"$name" -o "$name" "$TOP/tests/fakefits.c" 2>e; then
    skip "a crash of the decoder: no compiler, or a sanitizer's build: $(head -c 100 e)"
    exit 0
fi
image square.fits 16 100 100; fpack -r -O square.fz square.fits; mkdir box
for how in crash hang flood exit; do
    fails "the decoder: $how" 1 peak cost env LD_LIBRARY_PATH="$PWD" FAKE=$how FAKE_SIDE=100 "$copy" square.fz box/out.fits
    read -r kib ms wall <cost
    between "the decoder: $how: KiB" $kib 100 65536
    between "the decoder: $how: ms" $ms 0 1000
done
fails "the decoder sees another size" 1 env LD_LIBRARY_PATH="$PWD" FAKE_SIDE=99 "$copy" square.fz box/out.fits
if [ -z "$(ls -A box)" ]; then pass "and nothing is left"; else fail "left $(ls -A box)"; fi
env LD_LIBRARY_PATH="$PWD" FAKE=write FAKE_SIDE=100 "$copy" square.fz - >o 2>e
if [ ! -e stray ] && [ ! -s e ] && ! grep -aq noise o; then pass "the decoder writes nowhere"; else fail "the decoder wrote: $(ls; head -c 100 e)"; fi
echo nonsense >"$name"
fails "a library that cannot be loaded" 1 env LD_LIBRARY_PATH="$PWD" "$copy" square.fz box/out.fits
