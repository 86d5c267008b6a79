# fits2png: levels, stretches, orientation, holes, crop, zoom, refusals.

# image NX NY BITPIX [CARD...]: primary HDU with the data from standard input
image() {
    local nx=$1 ny=$2 bitpix=$3; shift 3
    {
        printf '%-80s' "SIMPLE  =                    T" "BITPIX  = $(printf %20d "$bitpix")" \
            "NAXIS   =                    2" "NAXIS1  = $(printf %20d "$nx")" "NAXIS2  = $(printf %20d "$ny")" "$@" END
        cat
    } >raw.tmp
    local n; n=$(wc -c <raw.tmp)
    local head=$(((6 + $#) * 80)) body
    body=$((n - head))
    head -c $head raw.tmp; head -c $(((2880 - head % 2880) % 2880)) /dev/zero | tr '\0' ' '
    tail -c $body raw.tmp; head -c $(((2880 - body % 2880) % 2880)) /dev/zero
}
# rows FILE: the shades of a PNG, one row a line, "." where transparent (an independent decoder)
rows() {
    python3 - "$1" <<'PY'
import struct, sys, zlib
d = open(sys.argv[1], 'rb').read()
assert d[:8] == b'\x89PNG\r\n\x1a\n'
at, idat, seen = 8, b'', []
while at < len(d):
    n, kind = struct.unpack('>I4s', d[at:at + 8]); body = d[at + 8:at + 8 + n]
    assert zlib.crc32(kind + body) == struct.unpack('>I', d[at + 8 + n:at + 12 + n])[0]
    seen.append(kind); at += 12 + n
    if kind == b'IHDR': w, h, depth, colour = struct.unpack('>IIBB', body[:10])
    if kind == b'IDAT': idat += body
assert seen[-1] == b'IEND' and depth == 8 and colour in (0, 4)
step = 2 if colour == 4 else 1
raw, above = zlib.decompress(idat), bytes(w * step)
assert len(raw) == h * (w * step + 1)
for y in range(h):
    f, line = raw[y * (w * step + 1)], bytearray(raw[y * (w * step + 1) + 1:(y + 1) * (w * step + 1)])
    for i in range(len(line)):
        left = line[i - step] if i >= step else 0
        line[i] = (line[i] + (0, left, above[i])[f]) & 255
    above = line
    print(*('.' if step == 2 and line[i + 1] == 0 else str(line[i]) for i in range(0, len(line), step)))
PY
}
if ! command -v python3 >/dev/null; then skip "fits2png: python3 is not installed, pictures are not decoded"; rows() { :; }; fi

shows() { # WHAT FILE ROW...: the picture has these rows from the top
    local what=$1 file=$2; shift 2
    if [ "$(rows "$file")" = "$(printf '%s\n' "$@")" ]; then pass "$what"
    else fail "$what: $(rows "$file" | tr '\n' '|')"; fi
}
printf '\000\001\002\003\004\005\377\200\100\300\013\014' | image 4 3 8 >a.fits
if command -v python3 >/dev/null; then
    ok "linear, levels given" fits2png --stretch linear --low 0 --high 255 a.fits -o a.png
    shows "y grows upwards, a unit is a shade" a.png "64 192 11 12" "4 5 255 128" "0 1 2 3"
    ok "crop" fits2png --stretch linear --low 0 --high 255 --crop 2,1,2,2 a.fits -o c.png
    shows "crop counts from 1" c.png "5 255" "1 2"
    ok "zoom" fits2png --stretch linear --low 0 --high 255 --crop 2,1,2,1 --zoom 3 a.fits -o z.png
    shows "zoom repeats pixels" z.png "1 1 1 2 2 2" "1 1 1 2 2 2" "1 1 1 2 2 2"
    printf '\000\001\002\003\004\005\377\200\100\300\013\014' | image 4 3 8 "BLANK   =                   11" >b.fits
    ok "blank pixels" fits2png --stretch linear --low 0 --high 255 b.fits -o b.png
    shows "blank pixels are transparent" b.png "64 192 . 12" "4 5 255 128" "0 1 2 3"
    # asinh: 1000 pixels 0..9 each 100 times: median 5, 16th percentile 1, sigma 4: low -3, soft 8, high max(9, 25) = 25
    for ((i = 0; i < 100; i++)); do printf '\000\001\002\003\004\005\006\007\010\011'; done | image 10 100 8 >d.fits
    ok "asinh by default" fits2png d.fits -o d.png
    want=$(awk 'function asinh(x) { return log(x + sqrt(x * x + 1)) } BEGIN { for (v = 0; v < 10; v++) printf "%s%d", v ? " " : "", int(255 * asinh((v + 3) / 8) / asinh(28 / 8) + .5) }')
    if [ "$(rows d.png | sort -u)" = "$want" ]; then pass "levels from median and 16th percentile: $want"
    else fail "levels: $(rows d.png | sort -u | head -2), want $want"; fi
    ok "log" fits2png --stretch log --low 0 --high 9 d.fits -o l.png
    want=$(awk 'BEGIN { for (v = 0; v < 10; v++) printf "%s%d", v ? " " : "", int(255 * log(1 + v / 8) / log(1 + 9 / 8) + .5) }')
    if [ "$(rows l.png | sort -u)" = "$want" ]; then pass "log: $want"; else fail "log: $(rows l.png | head -1), want $want"; fi
    head -c 4000 /dev/zero | image 40 100 8 >flat.fits
    ok "a flat image" fits2png flat.fits -o flat.png
    if [ "$(rows flat.png | tr ' ' '\n' | sort -u)" = 0 ]; then pass "a flat image is black"; else fail "flat image: $(rows flat.png | head -1)"; fi
fi
for ((i = 0; i < 70; i++)); do printf '\177\300\000\000'; done | image 10 7 -32 >nan.fits
ok "nothing but NaN" fits2png nan.fits -o nan.png
fits2png a.fits >p.png; fits2png <a.fits -o q.png; fits2png - -o r.png < <(cat a.fits); fits2png a.fits -o s.png
same "to standard output" p.png s.png; same "from a file on standard input" q.png s.png; same "from a pipe" r.png s.png
gzip -k a.fits; fits2png a.fits.gz -o g.png; same "from gzip" g.png s.png
if command -v pngcheck >/dev/null; then ok "pngcheck finds nothing" pngcheck -q s.png b.png nan.png; fi

fails "output that is no PNG" 2 fits2png a.fits -o a.jpg
fails "unknown stretch" 2 fits2png --stretch sqrt a.fits -o x.png
fails "crop with three numbers" 2 fits2png --crop 1,1,2 a.fits -o x.png
fails "crop of half a pixel" 2 fits2png --crop 1.5,1,2,2 a.fits -o x.png
fails "crop outside" 1 fits2png --crop 2,2,4,2 a.fits -o x.png
fails "low above high" 1 fits2png --low 5 --high 5 a.fits -o x.png
fails "a pipe beyond --max-memory" 1 bash -c "cat a.fits | fits2png --max-memory 4K - -o x.png"
ok "a pipe within --max-memory" bash -c "cat a.fits | fits2png --max-memory 6K - -o y.png"
fails "no such file" 1 fits2png nothing.fits -o x.png
fails "an empty file" 1 fits2png /dev/null -o x.png
ln -s /dev/full full.png
fails "a full device" 1 fits2png a.fits -o full.png
fails "a full standard output" 1 bash -c "fits2png a.fits >/dev/full"
ok "--check writes nothing" fits2png --check a.fits -o x.png
if [ -e x.png ]; then fail "a failed run left x.png"; else pass "no failed run left a picture"; fi
if [ -n "$(find . -name '.*.tmp')" ]; then fail "temporary files: $(find . -name '.*.tmp')"; else pass "no temporary file is left"; fi
