# A million one-pixel objects, a plateau of four million pixels, 16384 and 32768 pixels a side: time linear, memory bounded, nothing lost.
# seconds in the program, in the system and KiB of the command, into $user, $system and $kib.  Linear is the program: handing out
# the same pages took the system 0.13 to 2.8 s at 16384 a side, as its host had them at hand or not.
measured() { /usr/bin/time -f '%U %S %M' -o used.txt "$@" && read -r user system kib < <(tail -1 used.txt); }
grid() { # SIDE EXPRESSION: 16-bit image of SIDE x SIDE pixels, noise of a cheap generator
    { printf '%-80s' "SIMPLE  =                    T" "BITPIX  =                   16" "NAXIS   =                    2" \
        "NAXIS1  = $(printf %20d "$1")" "NAXIS2  = $(printf %20d "$1")" "MAGZERO =                 30.0" "PIXSCALE=                  0.1" END; printf '%*s' 2240 ''; }
    awk -v n="$1" 'BEGIN { s = 99; for (y = 1; y <= n; y++) for (x = 1; x <= n; x++) { s = (s * 16807) % 2147483647; r = s / 2147483647 * 12
        v = int('"$2"'); printf "%c%c", int(v / 256), v % 256 } for (i = n * n * 2; i % 2880; i++) printf "%c", 0 }'
}
used=()
for side in 750 3000; do
    grid $side 'r + (x % 3 == 1 && y % 3 == 1 ? 3000 : 0)' >dots$side.fits
    ok "$((side * side / 9)) one-pixel objects" measured detect -k 0 --min-area 1 --rms 3.5 -t 50 dots$side.fits -o dots$side.fits.cat
    near "all found" "$(grep -vc '^#' dots$side.fits.cat)" $((side * side / 9)) 0
    near "no NaN" "$(grep -v '^#' dots$side.fits.cat | grep -ci nan)" 0 0
    used[side]=$user
done
between "CPU of 16 times as many objects over 16 times the CPU" "$(awk "BEGIN { print ${used[3000]} / 16 / ${used[750]} }")" 0.2 2
grid 2000 'x > 3 ? 20000 + r : r' >plateau.fits
ok "a plateau over all but three columns" detect --rms 3.5 --back-size 2000 plateau.fits -o p.cat
measured detect --rms 3.5 --back-size 2000 plateau.fits -o p.cat
between "bytes a pixel of the plateau, less 16 MiB" "$(awk "BEGIN { print ($kib - 16384) * 1024 / 2000 ^ 2 }")" 1 12
# noise, and an object in each 128 x 128 pixels; 128 rows repeated
wide() { # SIDE
    perl -e 'my $n = shift; my $s = 99;
        my @c = ("SIMPLE  =                    T", "BITPIX  =                   16", "NAXIS   =                    2", sprintf("NAXIS1  = %20d", $n), sprintf("NAXIS2  = %20d", $n),
            "MAGZERO =                 30.0", "PIXSCALE=                  0.1", "GAIN    =                  1.0", "END");
        my $h = join "", map { sprintf "%-80s", $_ } @c; print $h, " " x (2880 - length($h) % 2880);
        my $rows = "";
        for my $y (0 .. 127) { $rows .= pack "n*", map { $s = ($s * 16807) % 2147483647; my $v = 100 + 14 * ($s / 2147483647 - 0.5); my ($u, $w) = ($_ % 128 - 64, $y - 64);
            int($v + 0.5 + (abs($u) < 8 && abs($w) < 8 ? 300 * exp(-($u * $u + $w * $w) / 8) : 0)) } 0 .. $n - 1; }
        print $rows for 1 .. $n / 128; print "\0" x ((2880 - 2 * $n * $n % 2880) % 2880)' "$1"
}
for side in 4096 16384 32768; do
    wide $side >wide.fits
    ok "$side x $side pixels" measured detect -q wide.fits -t 10 -o wide.cat.fits
    echo "# $side x $side: $user s of CPU and $system s of the system, $kib KiB"
    between "bytes a pixel, less 16 MiB" "$(awk "BEGIN { print ($kib - 16384) * 1024 / $side ^ 2 }")" 1 6
    near "objects, one in each 128 x 128 pixels" "$(grep -a -o 'NAXIS2  = *[0-9]*' wide.cat.fits | tail -1 | grep -o '[0-9]*$')" $((side * side / 16384)) 0
    used[side]=$user
    rm wide.fits
done
between "CPU a pixel of 16384 over 4096 a side" "$(awk "BEGIN { print ${used[16384]} / 16 / ${used[4096]} }")" 0.3 2
between "CPU a pixel of 32768 over 16384 a side" "$(awk "BEGIN { print ${used[32768]} / 4 / ${used[16384]} }")" 0.3 2
