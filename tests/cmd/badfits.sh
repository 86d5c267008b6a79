# Malformed FITS files made from a good one.  Class F: must fail cleanly (status
# 1, one line that names the file, no output, no control characters); class W:
# must work.  All within a second and 64 MiB.
copy=
for d in "$BIN/../unit" "$TOP/build/unit"; do
    if [ -x "$d/test_fitscopy" ]; then copy=$(cd "$d" && pwd)/test_fitscopy; break; fi
done
if [ -z "$copy" ]; then fail "test_fitscopy is not built"; exit 1; fi
memory=yes
if ldd "$copy" | grep -qE 'asan|tsan'; then memory=; fi    # sanitizers reserve far more

# cards CARD...: header blocks
cards() {
    printf '%-80.80s' "$@"
    head -c $(((2880 - $# * 80 % 2880) % 2880)) /dev/zero | tr '\0' ' '
}
# data N: N bytes and padding
data() { awk -v n="$1" 'BEGIN { for (i = 0; i < n; i++) printf "%c", 65 + i % 26 }'; head -c $(((2880 - $1 % 2880) % 2880)) /dev/zero; }
S='SIMPLE  =                    T' B='BITPIX  =                   16' N='NAXIS   =                    2'
X='NAXIS1  =                   20' Y='NAXIS2  =                   30' E=END
XT="XTENSION= 'IMAGE   '" P='PCOUNT  =                    0' G='GCOUNT  =                    1'
primary() { cards "$S" "$B" "$N" "$X" "$Y" "$@" $E; data 1200; }
empty() { cards "$S" "$B" 'NAXIS   =                    0' $E; }
table() { # ROWBYTES ROWS PCOUNT CARD...: an empty primary and the header of a binary table
    local a=$1 b=$2 c=$3; shift 3
    empty
    cards "XTENSION= 'BINTABLE'" 'BITPIX  =                    8' "$N" "NAXIS1  = $a" "NAXIS2  = $b" "PCOUNT  = $c" "$G" "$@" $E
}

: >count
# try CLASS WHAT [OPTION]: the file comes from standard input
try() {
    local class=$1 what=$2 option=$3 st=0 kib ms wall
    echo >>count; rm -rf c; mkdir c; cat >c/bad.fits
    cp c/bad.fits before
    (cd c && { [ -z "$memory" ] || ulimit -v 130000; } && exec peak ../cost timeout 20 "$copy" $option bad.fits out.fits) >o 2>e || st=$?
    read -r kib ms wall <cost
    local why=
    if [ $class = F ]; then
        [ $st -eq 1 ] || why="exit $st"
        [ "$(wc -l <e)" -eq 1 ] || why="$why, $(wc -l <e) lines"
        grep -q 'bad.fits: ' e || why="$why, does not name the file"
        LC_ALL=C grep -q '[^ -~]' e && why="$why, control characters"
        [ "$(ls -A c)" = bad.fits ] || why="$why, left $(ls -A c)"
    else
        [ $st -eq 0 ] || why="exit $st"
        [ -s e ] && why="$why, says something"
        [ -f c/out.fits ] || why="$why, no output"
    fi
    cmp -s before c/bad.fits || why="$why, changed the input"
    [ $ms -lt 1000 ] || why="$why, took $ms ms"
    [ -z "$memory" ] || [ $kib -lt 65536 ] || why="$why, took $kib KiB"
    if [ -n "$why" ]; then fail "$what: $why: $(head -c 200 e)"
    else pass "$what: $(cut -c1-150 e)"; fi
}

# ---- as they should be
primary | try W "a good file"
primary "EXTEND  =                    T" | try W "with EXTEND"
cards "$S" "$B" "$N" 'NAXIS1  = 20 / free format' 'NAXIS2  = +30' $E > h; { cat h; data 1200; } | try W "free format"
{ empty; cards "$XT" "$B" "$N" "$X" "$Y" "$P" "$G" $E; data 1200; } | try W "image in an extension"
{ empty; cards "XTENSION= 'DUMP    '" 'BITPIX  =                    8' 'NAXIS   =                    1' 'NAXIS1  = 100' "$P" "$G" $E; data 100; cards "$XT" "$B" "$N" "$X" "$Y" "$P" "$G" $E; data 1200; } | try W "an unknown extension before the image"
{ primary; head -c 5760 /dev/zero; } | try W "blocks of zeros at the end"
{ primary; head -c 1000 /dev/zero; } | try W "zeros at the end"
{ primary; cards "special record"; } | try W "a special record at the end"
primary "BLANK   =                   -1" | try W "BLANK"
cards "$S" "$B" 'NAXIS   =                    4' "$X" "$Y" 'NAXIS3  = 1' 'NAXIS4  = 1' $E > h; { cat h; data 1200; } | try W "axes of length 1"
{ cards "$S" 'BITPIX  = 8' 'NAXIS   = 3' 'NAXIS1  = 0' 'NAXIS2  = 2' 'NAXIS3  = 1' 'GROUPS  = T' 'PCOUNT  = 3' 'GCOUNT  = 4' $E; data 20; cards "$XT" "$B" "$N" "$X" "$Y" "$P" "$G" $E; data 1200; } | try W "random groups before the image"
primary "LONG    = 'abc&'" "CONTINUE  'def'" | try W "CONTINUE"
primary "HIERARCH ESO DET = 5" | try W "HIERARCH"
primary "BROKEN  = 'no end" | try W "a string without an end that nobody needs"
cards "$S" 'BITPIX  =                  -32' "$N" "$X" "$Y" $E > h; { cat h; for ((i = 0; i < 600; i++)); do printf '\177\300\0\0'; done; head -c 480 /dev/zero; } | try W "nothing but NaN"

# ---- length
: | try F "an empty file"
printf x | try F "one byte"
head -c 100000 /dev/zero | try F "zeros"
head -c 100000 /dev/urandom | try F "garbage"
seq 1 5000 | try F "a text file"
primary | head -c 2879 | try F "cut in the header"
primary | head -c 2880 | try F "cut after the header"
primary | head -c 3000 | try F "cut in the data"
primary | head -c 5759 | try F "cut by one byte"
{ primary; printf 'XTENSION'; } | try F "cut at the second header"
{ primary; cards "$XT" "$B" "$N" "$X" "$Y" "$P" "$G" $E; data 1200; } | head -c 9000 | try F "cut in the second data"
{ primary; echo junk; } | try F "a few bytes at the end"
{ primary; primary; } | try F "two files in one"
for ((i = 0; i < 300; i++)); do printf '%-2880s' "$S"; done | try F "no END"
cards "$S" "$B" "$N" 'NAXIS1  = 65535' 'NAXIS2  = 65535' $E | try F "8 GB announced, none there"
cards "$S" "$B" "$N" 'NAXIS1  = 4294967296' 'NAXIS2  = 4294967296' $E | try F "a size that overflows 64 bits to 0"
cards "$S" "$B" "$N" 'NAXIS1  = 9223372036854775807' 'NAXIS2  = 9223372036854775807' $E | try F "a size that overflows"
cards "$S" "$B" "$N" 'NAXIS1  = 99999999999999999999' "$Y" $E | try F "an axis that overflows"
{ empty; cards "$XT" "$B" "$N" "$X" "$Y" 'PCOUNT  = 9223372036854775807' "$G" $E; data 1200; } | try F "PCOUNT that overflows"
{ empty; cards "$XT" "$B" "$N" "$X" "$Y" "$P" 'GCOUNT  = 4611686018427387904' $E; data 1200; } | try F "GCOUNT that overflows"

# ---- mandatory cards
cards 'SIMPLE  =                    F' "$B" "$N" "$X" "$Y" $E > h; { cat h; data 1200; } | try F "SIMPLE = F"
cards "SIMPLE  = 'T'" "$B" "$N" "$X" "$Y" $E > h; { cat h; data 1200; } | try F "SIMPLE as text"
cards "$B" "$N" "$X" "$Y" $E > h; { cat h; data 1200; } | try F "no SIMPLE"
cards "$S" "$N" "$B" "$X" "$Y" $E > h; { cat h; data 1200; } | try F "BITPIX after NAXIS"
cards "$S" "$N" "$X" "$Y" $E > h; { cat h; data 1200; } | try F "no BITPIX"
for v in 0 1 -8 17 24 -16 128 "'16'" 16.5 1E1 T "" ; do
    cards "$S" "BITPIX  = $v" "$N" "$X" "$Y" $E > h; { cat h; data 1200; } | try F "BITPIX = $v"
done
for v in -1 1000 3 2.0 x "'2'" "2 2" 1 ""; do
    cards "$S" "$B" "NAXIS   = $v" "$X" "$Y" $E > h; { cat h; data 1200; } | try F "NAXIS = $v with two axes"
done
for v in -20 20.0 2x0 "" "'20'" 0x14 "2 0" 21000 1e9; do
    cards "$S" "$B" "$N" "NAXIS1  = $v" "$Y" $E > h; { cat h; data 1200; } | try F "NAXIS1 = $v"
done
cards "$S" "$B" "$N" "$Y" "$X" $E > h; { cat h; data 1200; } | try F "NAXIS2 before NAXIS1"
cards "$S" "$B" "$N" "$X" "COMMENT" "$Y" $E > h; { cat h; data 1200; } | try F "a comment between the axes"
cards "$S" "$B" "$N" 'NAXIS1  =                    0' "$Y" $E | try F "an axis of length 0"
primary 'NAXIS1  =                   40' | try F "NAXIS1 twice"
primary 'BITPIX  =                    8' | try F "BITPIX twice"
primary 'NAXIS3  =                   40' | try F "NAXIS3 beyond NAXIS"
{ empty; cards "$XT" "$B" "$N" "$X" "$Y" $E; data 1200; } | try F "an extension without PCOUNT"
{ empty; cards "$XT" "$B" "$N" "$X" "$Y" "$G" "$P" $E; data 1200; } | try F "GCOUNT before PCOUNT"
{ empty; cards "$XT" "$B" "$N" "$X" "$Y" "$P" 'GCOUNT  = 0' $E; data 1200; } | try F "GCOUNT = 0"
{ empty; cards "$XT" "$B" "$N" "$X" "$Y" 'PCOUNT  = -2400' "$G" $E; data 1200; } | try F "a negative PCOUNT"
{ empty; cards "XTENSION=  5" "$B" "$N" "$X" "$Y" "$P" "$G" $E; data 1200; } | try F "XTENSION as a number"

# ---- text
primary | sed '1s/SIMPLE  =/SIMPLE  :/' | try F "a colon for ="
primary "OBJECT  = 'a$(printf '\t')b'" | try F "a tab in the header"
grep -q "card 6 has a byte 0x09" e && pass "and the card is counted right" || fail "card: $(cat e)"
primary "OBJECT  = 'a$(printf '\351')b'" | try F "a Latin-1 letter in the header"
primary "OBJECT  = 'a$(printf '\033')[31m'" | try F "an escape sequence in the header"
primary "OBJECT  = 'x'" | tr 'x' '\0' | try F "a NUL in the header"
primary | tr ' ' '\n' | try F "newlines for blanks"
cards "$S" "$B" "$N" "$X" "$Y" $E "AFTER   = 1" > h; { cat h; data 1200; } | try F "cards after END"
for c in "BSCALE  = 0.0" "BSCALE  = 1,5" "BSCALE  = nan" "BZERO   = 1e999" "BZERO   = 'x'" "BLANK   = 1.5" "BLANK   = x"; do
    primary "$c" | try F "$c"
done

# ---- no image
empty | try F "no data at all"
cards "$S" "$B" 'NAXIS   =                    1' "$X" $E > h; { cat h; data 40; } | try F "one axis"
cards "$S" 'BITPIX  = 8' 'NAXIS   = 3' "$X" "$Y" 'NAXIS3  = 2' $E > h; { cat h; data 1200; } | try F "a cube"
cards "$S" 'BITPIX  = 8' "$N" 'NAXIS1  = 70000' 'NAXIS2  = 1' $E > h; { cat h; data 70000; } | try F "a side longer than 65535"
{ table 4 5 0 'TFIELDS = 1' "TFORM1  = 'J'"; data 20; } | try F "a table for an image"
{ table 8 5 0 'ZIMAGE  =                    T' 'TFIELDS = 1' "TFORM1  = '1PB(0)'"; data 40; } | try F "a tile-compressed image"

# ---- gzip
primary | gzip -n | try W "gzip"
{ primary | head -c 3000 | gzip -n; primary | tail -c +3001 | gzip -n; } | try W "gzip in two members"
{ primary | gzip -n; head -c 100 /dev/zero; } | try W "gzip with zeros behind"
primary | gzip -n | head -c 100 | try F "gzip, cut"
primary | gzip -n | head -c -4 | try F "gzip, cut in its length"
primary | gzip -n | head -c 10 | try F "gzip, only its header"
{ primary | gzip -n | head -c -8; printf 'abcdefgh'; } | try F "gzip with a wrong checksum"
{ primary | gzip -n; echo junk; } | try F "gzip with junk behind"
{ printf '\037\213'; head -c 5000 /dev/urandom; } | try F "garbage that begins like gzip"
primary | gzip -n | gzip -n | try F "gzip in gzip"
head -c 100000000 /dev/zero | gzip -1n | try F "100 MB of zeros in gzip"
{ cards "$S" "$B" "$N" 'NAXIS1  = 65535' 'NAXIS2  = 65535' $E; head -c 1000 /dev/zero; } | gzip -n | try F "8 GB announced in gzip"
{ cards "$S" "$B" 'NAXIS   =                    0'; head -c 60000000 /dev/zero | tr '\0' ' '; } | gzip -1n | try F "60 MB of blank cards in gzip"
{ empty; cards "$XT" 'BITPIX  = 8' 'NAXIS   = 0' "$P" "$G" $E >x; for ((i = 0; i < 12; i++)); do cat x x >y; mv y x; done; cat x x x; } | gzip -1n | try F "12000 HDUs in gzip"
{ empty; cards "$XT" 'BITPIX  = 8' 'NAXIS   = 0' "$P" "$G" $E >x; for ((i = 0; i < 11; i++)); do cat x x >y; mv y x; done; cat x; cards "$XT" "$B" "$N" "$X" "$Y" "$P" "$G" $E; data 1200; } | try W "an image behind 2048 HDUs"

# ---- tables
{ table 12 5 0 'TFIELDS = 2' "TTYPE1  = 'ID'" "TFORM1  = 'J'" "TTYPE2  = 'NAME'" "TFORM2  = '8A'"; data 60; } | try W "a table" -t
{ table 9 2 0 'TFIELDS = 2' "TFORM1  = 'L'" "TFORM2  = 'D'"; printf 'TFFFFFFFFFFFFFFFFF'; data 0; head -c 2862 /dev/zero; } | try W "logical, no names" -t
{ table 8 2 16 'TFIELDS = 1' "TTYPE1  = 'C'" "TFORM1  = '1PD(1)'"; printf '\0\0\0\1\0\0\0\0\0\0\0\1\0\0\0\10'; data 2864; } | try W "variable length" -t
{ table 8 2 16 'TFIELDS = 1' "TTYPE1  = 'C'" "TFORM1  = '1PD(1)'"; printf '\0\0\0\1\0\0\0\20\0\0\0\1\0\0\0\10'; data 2864; } | try F "a cell outside the heap" -t
{ table 8 2 16 'TFIELDS = 1' "TTYPE1  = 'C'" "TFORM1  = '1PD(1)'"; printf '\377\377\377\377\0\0\0\0\0\0\0\1\0\0\0\10'; data 2864; } | try F "a cell of -1 values" -t
{ table 8 2 16 'TFIELDS = 1' "TTYPE1  = 'C'" "TFORM1  = '1PD(1)'"; printf '\0\0\0\2\0\0\0\0\0\0\0\2\0\0\0\0'; data 2864; } | try F "cells that share the heap" -t
for c in "12A4" "3J" "2D" "M" "8X" "C" "Z" "" "99999999999J" "1PA(3)" "2PD" "-1J" "0J"; do
    { table 4 5 0 'TFIELDS = 1' "TTYPE1  = 'A'" "TFORM1  = '$c'"; data 20; } | try F "TFORM $c" -t
done
for v in 0 -1 1000 x 2; do
    { table 4 5 0 "TFIELDS = $v" "TTYPE1  = 'A'" "TFORM1  = 'J'"; data 20; } | try F "TFIELDS = $v with one column" -t
done
{ table 5 4 0 'TFIELDS = 1' "TTYPE1  = 'A'" "TFORM1  = 'J'"; data 20; } | try F "NAXIS1 that is not the columns' width" -t
{ table 8 2 0 'TFIELDS = 2' "TTYPE1  = 'A'" "TFORM1  = 'J'" "TTYPE2  = 'a'" "TFORM2  = 'J'"; data 16; } | try F "two columns of one name" -t
{ table 0 1000000000 0 'TFIELDS = 0'; } | try F "10^9 rows without a byte" -t
{ table 4 1 0 'TFIELDS = 1' "TTYPE1  = 'A'" "TFORM1  = '4A'"; printf '\1\2\3\4'; data 2876; } | try F "control characters in a word" -t
{ table 1 1 0 'TFIELDS = 1' "TTYPE1  = 'A'" "TFORM1  = 'L'"; printf 'x'; data 2879; } | try F "a logical that is neither" -t
{ table 8 1 0 'TFIELDS = 1' "TTYPE1  = 'A'" "TFORM1  = 'K'" "TZERO1  = 9223372036854775807"; printf '\177\377\377\377\377\377\377\377'; data 2872; } | try F "a whole number beyond 63 bits" -t
primary | try F "an image for a table" -t
n=$(wc -l <count)
if [ "$n" -ge 110 ]; then pass "$n files tried"; else fail "only $n files"; fi
