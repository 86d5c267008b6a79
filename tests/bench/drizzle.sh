# Whole processes per Mpixel of input, and the C core of python3-drizzle in the same run where installed.
image() { # FILE N TURN SCALE CTYPE [CARD...]: a 20-bit pattern, N x N, TAN turned by TURN radian
    perl -e 'my ($n, $t, $s, $type, @more) = @ARGV; my ($c, $d) = (cos($t) * $s / 3600, sin($t) * $s / 3600);
        my @k = ("SIMPLE  =                    T", "BITPIX  =                  -32", "NAXIS   =                    2", sprintf("NAXIS1  = %20d", $n), sprintf("NAXIS2  = %20d", $n),
        "EXPTIME =               2000.0", "BUNIT   = \x27electron\x27", "CTYPE1  = \x27RA---$type\x27", "CTYPE2  = \x27DEC--$type\x27", "CRVAL1  = 150.0", "CRVAL2  = 2.2",
        sprintf("CRPIX1  = %20.3f", ($n + 1) / 2), sprintf("CRPIX2  = %20.3f", ($n + 1) / 2), sprintf("CD1_1   = %20.14G", -$c), sprintf("CD1_2   = %20.14G", $d),
        sprintf("CD2_1   = %20.14G", $d), sprintf("CD2_2   = %20.14G", $c), @more, "END");
        my $h = join "", map { sprintf "%-80s", $_ } @k; print $h, " " x ((2880 - length($h) % 2880) % 2880);
        my $r = pack "f>*", map { 100 + ($_ * 7919) % 23 } 0 .. $n - 1; print $r for 1 .. $n; print "\0" x ((2880 - 4 * $n * $n % 2880) % 2880)' "${@:2}" >"$1"
}
permpix() { # LABEL MPIX COMMAND...: CPU ms per Mpixel, median and least
    local i
    "${@:3}" >/dev/null 2>&1
    for ((i = 0; i < RUNS; i++)); do seconds "${@:3}"; done >times
    awk -v l="$1" -v m="$(median <times)" -v b="$(sort -g times | head -1)" -v n="$2" 'BEGIN { printf "%-60s %6.1f ms/Mpix, least %6.1f\n", l, m / n * 1000, b / n * 1000 }'
}
image fine.fits 4097 0 0.1 TAN
dither -n 2 fine.fits -o four.fits
image turned.fits 2048 0.3 0.2 TAN
image same.fits 2048 0 0.2 TAN
image half.fits 4096 0 0.1 TAN
image bent.fits 2048 0.3 0.2 TPV "PV1_1   = 1.0" "PV1_4   = 1E-3" "PV2_1   = 1.0" "PV2_7   = 0.2" "PV1_8   = 0.3"
permpix "drizzle, half-pixel shifts, pixfrac 0.5, onto halves" 16.777 drizzle four.fits -x 0.1 --pixfrac 0.5 --flat -o out.fits
permpix "the same with WHT and CTX" 16.777 drizzle four.fits -x 0.1 --pixfrac 0.5 -o out.fits
permpix "drizzle, half-pixel shifts, pixfrac 1, onto halves" 16.777 drizzle four.fits -x 0.1 --pixfrac 1 --flat -o out.fits
permpix "drizzle, 17 degrees, pixfrac 0.8, onto pixels of one size" 4.194 drizzle turned.fits --like same.fits --pixfrac 0.8 --flat -o out.fits
permpix "drizzle, 17 degrees, pixfrac 0.8, onto halves" 4.194 drizzle turned.fits --like half.fits --pixfrac 0.8 --flat -o out.fits
permpix "drizzle, TPV, pixfrac 0.8, onto pixels of one size" 4.194 drizzle bent.fits --like same.fits --pixfrac 0.8 --flat -o out.fits
python3=/usr/bin/python3
if ! $python3 -c 'import drizzle, numpy' 2>/dev/null; then echo "python3-drizzle is not installed: no comparison"; return 0; fi
RUNS=$RUNS $python3 - <<'END'
# cdrizzle.tdriz alone: the pixel map is given, nothing is read or written
import os, time, numpy as np
from drizzle import cdrizzle
n, t = 2048, 0.3
y, x = np.mgrid[0:n, 0:n].astype(float)
c = (n - 1) / 2
def run(label, ratio, turn, shift, pixfrac):
    m = int(n * ratio)
    u, v = x - c, y - c
    pixmap = np.dstack((ratio * (np.cos(turn) * u - np.sin(turn) * v) + (m - 1) / 2 + shift, ratio * (np.sin(turn) * u + np.cos(turn) * v) + (m - 1) / 2 + shift))
    sci = np.fromfunction(lambda j, i: 100 + (i * 7919) % 23, (n, n)).astype(np.float32)
    one = np.ones((n, n), np.float32)
    best = []
    for k in range(int(os.environ['RUNS'])):
        out, wht, ctx = np.zeros((m, m), np.float32), np.zeros((m, m), np.float32), np.zeros((m, m), np.int32)
        s = time.process_time()
        cdrizzle.tdriz(sci, one, pixmap, out, wht, ctx, uniqid=1, xmin=0, xmax=n - 1, ymin=0, ymax=n - 1, scale=1 / ratio, pixfrac=pixfrac, kernel='square', in_units='cps', expscale=1.0, wtscale=1.0, fillstr='INDEF')
        best.append(time.process_time() - s)
    print('%-60s %6.1f ms/Mpix, least %6.1f' % (label, np.median(best) / n**2 * 1e9, min(best) / n**2 * 1e9))
run('C core of python3-drizzle, half-pixel shift, pixfrac 0.5', 2, 0, 0.5, 0.5)
run('C core, 17 degrees, pixfrac 0.8, pixels of one size', 1, t, 0, 0.8)
run('C core, 17 degrees, pixfrac 0.8, onto halves', 2, t, 0, 0.8)
END
