# A million one-pixel objects, and a plateau of four million pixels: time linear, nothing lost.
grid() { # SIDE EXPRESSION: 16-bit image of SIDE x SIDE pixels, noise of a cheap generator
    { printf '%-80s' "SIMPLE  =                    T" "BITPIX  =                   16" "NAXIS   =                    2" \
        "NAXIS1  = $(printf %20d "$1")" "NAXIS2  = $(printf %20d "$1")" "MAGZERO =                 30.0" "PIXSCALE=                  0.1" END; printf '%*s' 2240 ''; }
    awk -v n="$1" 'BEGIN { s = 99; for (y = 1; y <= n; y++) for (x = 1; x <= n; x++) { s = (s * 16807) % 2147483647; r = s / 2147483647 * 12
        v = int('"$2"'); printf "%c%c", int(v / 256), v % 256 } for (i = n * n * 2; i % 2880; i++) printf "%c", 0 }'
}
for side in 750 3000; do
    grid $side 'r + (x % 3 == 1 && y % 3 == 1 ? 3000 : 0)' >dots$side.fits
    start=$(date +%s%N)
    ok "$((side * side / 9)) one-pixel objects" detect -k 0 --min-area 1 --rms 3.5 -t 50 dots$side.fits -o dots$side.fits.cat
    near "all found" "$(grep -vc '^#' dots$side.fits.cat)" $((side * side / 9)) 0
    near "no NaN" "$(grep -v '^#' dots$side.fits.cat | grep -ci nan)" 0 0
    eval "t$side=$(( ($(date +%s%N) - start) / 1000000 ))"
done
between "time of 16 times as many objects over 16 times the time" "$(awk "BEGIN { print $t3000 / 16 / $t750 }")" 0.2 2
grid 2000 'x > 3 ? 20000 + r : r' >plateau.fits
ok "a plateau over all but three columns" detect --rms 3.5 --back-size 2000 plateau.fits -o p.cat
