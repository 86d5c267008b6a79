# Peak memory of detect on images that are full of runs: 32 MiB + 12 bytes a pixel + 450 for each row of the catalogue.
if ldd "$BIN/detect" | grep -qE 'asan|tsan'; then skip "a sanitizer reserves far more memory than the program takes"; exit 0; fi
# noisy FILE SIDE EXPRESSION: of the pixel $x, $y and unit Gaussian noise $g, float32
noisy() {
    perl -e 'my ($n, $expr) = @ARGV; my $s = 99; my @g = map { my $a = -6; for (1 .. 12) { $s = ($s * 16807) % 2147483647; $a += $s / 2147483647 } $a } 0 .. 65535;
        my @c = ("SIMPLE  =                    T", "BITPIX  =                  -32", "NAXIS   =                    2", sprintf("NAXIS1  = %20d", $n), sprintf("NAXIS2  = %20d", $n),
            "PIXSCALE=                  0.1", "GAIN    =                  1.0", "MAGZERO =                 30.0", "END");
        my $h = join "", map { sprintf "%-80s", $_ } @c; print $h, " " x (2880 - length($h) % 2880);
        my $f = eval "sub { my (\$y) = \@_; pack q(f>*), map { my \$x = \$_; \$s = (\$s * 16807) % 2147483647; my \$g = \$g[\$s & 65535]; $expr } 0 .. $n - 1 }" or die $@;
        print $f->($_) for 0 .. $n - 1; print "\0" x ((2880 - 4 * $n * $n % 2880) % 2880)' "$2" "$3" >"$1"
}
# bounded WHAT SIDE: the image hard.fits
bounded() {
    local what=$1 side=$2 j rows kib
    for j in 1 2; do
        peak peak.txt detect -q -j $j -k 0 --rms 2 --min-area 1 -t 2 hard.fits -o hard$j.cat || fail "$what"
        rows=$(grep -vc '^#' hard$j.cat) kib=$(cut -d' ' -f1 peak.txt)
        between "$what, -j $j, $rows rows: bytes a pixel beyond 32 MiB and 450 a row" "$(awk "BEGIN { print ($kib * 1024 - 33554432 - 450 * $rows) / $side ^ 2 }")" -30 12
    done
    same "$what: same bytes" hard1.cat hard2.cat
}
noisy hard.fits 2000 '(($x + $y) % 2 ? 20 : 0) + $g'
bounded "a checkerboard with noise" 2000
near "one object of two million pixels, flagged 64, 16 and 8" "$(awk '/^#/ { k = split($0, h, " "); for (i = 2; i <= k; i++) c[h[i]] = i - 1; next } $c["ISOAREA_IMAGE"] > 1.9e6 { s += $c["FLAGS"] } END { print s + 0 }' hard1.cat)" 88 0
noisy hard.fits 1200 '($x % 4 < 1 || $y == 0 ? 30 : 0) + $g'
bounded "a comb" 1200
noisy hard.fits 1200 'exp($g)'
bounded "log-normal noise" 1200
