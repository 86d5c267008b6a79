# addnoise: means and variances of every effect, header keywords, the keys of
# the draws, depth, hard pixels, threads, pipes, faults.
# shellcheck disable=SC2016
F="perl $TOP/tests/fits.pl"
pc="PIXSCALE=                  0.1"; ex="EXPTIME =               2000.0"; bu="BUNIT   = 'electron'"
mz=$(awk 'BEGIN { printf "MAGZERO = %.12f", 26.65 + 2.5 * log(2000) / log(10) }')
$F make flat.fits 300 200 0 "$pc" "$ex" "$bu" "$mz"
$F make fifty.fits 300 200 50 "$pc" "$ex" "$bu" "$mz"
stat() { $F stat "$1" "${3:-0}" | cut -d' ' -f"$2"; }
n=60000

# source noise only; sky by rate; depth; dark, read noise, qe, gain, subtraction. Limits 4.5 sigma.
try() { # WHAT MEAN VARIANCE OPTION...
    local what=$1 mean=$2 var=$3; shift 3
    ok "$what runs" addnoise "$@" -o t.fits
    near "$what: mean" "$(stat t.fits 1)" "$mean" "$(awk -v v="$var" "BEGIN { print 4.5 * sqrt(v / $n) }")"
    near "$what: variance" "$(stat t.fits 2)" "$var" "$(awk -v v="$var" "BEGIN { print 4.5 * v * sqrt((2 + 1 / v) / $n) }")"
}
try "source alone" 50 50 fifty.fits
try "--sky-rate 14.45" 289 289 --sky-rate 14.45 flat.fits
near "SKYLEVEL" "$(card t.fits SKYLEVEL)" 289 1e-9
try "--sky 23.3" "$(awk 'BEGIN { print 20 * 10 ^ (-0.4 * (23.3 - 26.65)) }')" "$(awk 'BEGIN { print 20 * 10 ^ (-0.4 * (23.3 - 26.65)) }')" --sky 23.3 flat.fits
sky=$(awk 'BEGIN { print 20 * 2000 * 10 ^ (-0.8 * (27.7 - 26.65)) / (100 * 0.2) }')
try "--depth 27.7" "$sky" "$sky" --depth 27.7 flat.fits
# 10 sigma in 0.2 arcsec^2: 20 pixels of sky
near "--depth 27.7 is 10 sigma" "$(awk -v b="$(card t.fits SKYLEVEL)" 'BEGIN { print 2000 * 10 ^ (-0.4 * (27.7 - 26.65)) / sqrt(20 * b) }')" 10 1e-6
try "dark, read noise" 90 106 --dark 0.02 --read-noise 4 fifty.fits
near "RDNOISE" "$(card t.fits RDNOISE)" 4 0
try "--qe 0.5" 25 25 --qe 0.5 fifty.fits
near "--qe: MAGZERO" "$(card t.fits MAGZERO)" "$(awk 'BEGIN { printf "%.9f", 26.65 + 2.5 * log(1000) / log(10) }')" 1e-8
try "--gain 2.5" 20 8 --gain 2.5 fifty.fits
[ "$($F card t.fits 0 BUNIT)" = adu ] && pass "BUNIT adu" || fail "BUNIT $($F card t.fits 0 BUNIT)"
near "--gain: GAIN" "$(card t.fits GAIN)" 2.5 0
near "--gain: MAGZERO" "$(card t.fits MAGZERO)" "$(awk 'BEGIN { printf "%.9f", 26.65 + 2.5 * log(800) / log(10) }')" 1e-8
try "--subtract-sky" 50 339 --sky-rate 14.45 --subtract-sky fifty.fits
[ "$(card t.fits SKYSUB)" = T ] && pass "SKYSUB T" || fail "SKYSUB $(card t.fits SKYSUB)"
addnoise -q --saturate 60 fifty.fits -o t.fits
near "--saturate: maximum" "$(stat t.fits 4)" 60 0

# point-source depth: Gaussian PSF of sigma 0.1", A = 4 pi sigma^2
$F make psf.fits 101 101 'exp(-(($x-50)**2+($y-50)**2)/200)' "PIXELSCL=                 0.01"
addnoise --depth 27 --depth-definition point5 -p psf.fits flat.fits -o t.fits
near "point5: 5 sigma of a point source" "$(awk -v b="$(card t.fits SKYLEVEL)" 'BEGIN { A = 4 * 3.14159265358979 * 0.01; print 2000 * 10 ^ (-0.4 * (27 - 26.65)) / sqrt(A * b / 0.01) }')" 5 1e-5

# keys: extensions alone and together, seed, exposure number, threads
$F make four.fits 0 0 0
for i in 1 2 3 4; do $F add four.fits 40 30 '$x' "EXTNAME = 'SCI     '" "EXTVER  = $i" "EXPNUM  = $i" "$pc" "EXPTIME =                500.0" "TOTTIME =               2000.0" "$mz" "$bu"; done
ok "four exposures" addnoise --sky-rate 30 four.fits -o joined.fits
near "HDUs" "$($F count joined.fits)" 5 0
for i in 1 3; do
    addnoise --sky-rate 30 "four.fits[SCI,$i]" -o one.fits
    $F dump joined.fits $i >a.txt; $F dump one.fits 0 >b.txt
    same "exposure $i split and joined" a.txt b.txt
done
$F dump joined.fits 1 >a.txt; $F dump joined.fits 2 >b.txt
cmp -s a.txt b.txt && fail "exposures share their noise" || pass "exposures have noise of their own"
near "SKYLEVEL of a quarter exposure" "$($F card joined.fits 2 SKYLEVEL)" 150 1e-9
addnoise --depth 27.7 four.fits -o d.fits
near "depth refers to TOTTIME: four quarter skies" "$(awk -v b="$($F card d.fits 1 SKYLEVEL)" -v z="${mz#*= }" 'BEGIN { z -= 2.5 * log(500) / log(10); print 2000 * 10 ^ (-0.4 * (27.7 - z)) / sqrt(20 * 4 * b) }')" 10 1e-6
addnoise -j 1 --sky-rate 20 --read-noise 3 fifty.fits -o a.fits
addnoise -j 2 --sky-rate 20 --read-noise 3 fifty.fits -o b.fits
same "1 and 2 threads" a.fits b.fits
addnoise --sky-rate 20 --read-noise 3 - <fifty.fits >c.fits
$F dump a.fits 0 >a.txt; $F dump c.fits 0 >c.txt
same "pipe and file, same pixels" a.txt c.txt
addnoise -s 2 --sky-rate 20 --read-noise 3 fifty.fits -o c.fits; $F dump c.fits 0 >c.txt
cmp -s a.txt c.txt && fail "--seed changes nothing" || pass "--seed changes the noise"

# two fields 1 % apart share their noise
$F make near.fits 300 200 50.5 "$pc" "$ex" "$bu" "$mz"
addnoise --sky-rate 20 fifty.fits -o a.fits; addnoise --sky-rate 20 near.fits -o b.fits
$F dump a.fits 0 | cut -d' ' -f3 >a.txt; $F dump b.fits 0 | cut -d' ' -f3 >b.txt
between "correlation of their noise" "$(paste a.txt b.txt | awk '{ a += $1; b += $2; aa += $1 * $1; bb += $2 * $2; ab += $1 * $2 } END { print (ab - a * b / NR) / sqrt((aa - a * a / NR) * (bb - b * b / NR)) }')" 0.999 1

# the opposite noise
addnoise --sky-rate 20 --read-noise 3 --mirror fifty.fits -o c.fits; addnoise --sky-rate 20 --read-noise 3 fifty.fits -o a.fits
$F dump a.fits 0 | cut -d' ' -f3 >a.txt; $F dump c.fits 0 | cut -d' ' -f3 >c.txt
between "correlation of a noise with the opposite one" "$(paste a.txt c.txt | awk '{ a += $1; b += $2; aa += $1 * $1; bb += $2 * $2; ab += $1 * $2 } END { print (ab - a * b / NR) / sqrt((aa - a * a / NR) * (bb - b * b / NR)) }')" -1 -0.99
near "its variance over the other's (60000 pixels: 5 sigma)" "$(paste a.txt c.txt | awk '{ a += $1; b += $2; aa += $1 * $1; bb += $2 * $2 } END { print (bb - b * b / NR) / (aa - a * a / NR) }')" 1 0.02
near "keyword MIRROR" "$(card c.fits MIRROR)" 1 0

# hard pixels
$F make hard.fits 4 1 '(9**9**9/9**9**9, -30, 3e7, 9**9**9)[$x]' "$ex" "$bu" "$pc"
addnoise --sky-rate 0.5 hard.fits -o t.fits 2>warn.txt
near "warnings of hard pixels" "$(wc -l <warn.txt)" 3 0
$F dump t.fits 0 | awk '{ print tolower($3) }' | tr '\n' ' ' | sed 's/-nan/nan/g' >t.txt
if grep -qE '^nan 0 (29|30)[0-9e.+]* nan $' t.txt; then pass "NaN stays, negative draws 0, infinite gives NaN"; else fail "hard pixels: $(cat t.txt)"; fi

# refusals
fails "two skies" 2 addnoise --sky 23 --depth 27 flat.fits
fails "point depth without PSF" 2 addnoise --depth 27 --depth-definition point5 flat.fits
$F make bare.fits 8 8 1
fails "no EXPTIME" 1 addnoise --sky-rate 1 bare.fits -o no.fits
grep -q -- --exptime cmd.err || fail "the message does not name --exptime"
fails "no PIXSCALE" 1 addnoise -T 100 --sky-rate 1 bare.fits -o no.fits
fails "no MAGZERO" 1 addnoise -T 100 -x 0.1 --sky 22 bare.fits -o no.fits
ok "all by options" addnoise -T 100 -x 0.1 -z 25 --sky 22 bare.fits -o yes.fits
near "MAGZERO from options" "$(card yes.fits MAGZERO)" 30 1e-9
$F make rate.fits 8 8 1 "BUNIT   = 'electron/s'"
fails "a rate image" 1 addnoise rate.fits -o no.fits
head -c 4000 fifty.fits >cut.fits
if addnoise fifty.fits >/dev/full 2>err.txt; then fail "a full device gave success"; else pass "a full device: $(cat err.txt)"; fi
fails "truncated input" 1 addnoise cut.fits -o no.fits
fails "missing input" 1 addnoise none.fits -o no.fits
fails "output is the input" 1 addnoise fifty.fits -o fifty.fits
[ ! -e no.fits ] && pass "no output left behind" || fail "a failed run left an output"
ok "--check" addnoise --check --depth 27.7 flat.fits -o no.fits
[ ! -e no.fits ] && pass "--check writes nothing" || fail "--check wrote"

# exposures of one file without numbers of their own would share their noise
$F make two.fits 0 0 0
for k in 1 2; do $F add two.fits 16 16 50 "EXTNAME = 'SCI     '" "EXTVER  = $k" "$pc" "$ex" "$bu" "$mz"; done
fails "two exposures without EXPNUM" 1 addnoise two.fits -o no.fits
perl -pe "s/EXTVER  = (\\d)/EXPNUM  = \$1/g" two.fits >numbered.fits
ok "two exposures with EXPNUM" addnoise numbered.fits -o t.fits
$F dump t.fits 1 >a.txt; $F dump t.fits 2 >b.txt
cmp -s a.txt b.txt && fail "they have the same noise" || pass "they have different noise"
perl -pe "s/EXTVER  = (\\d)/EXPNUM  = 7/g" two.fits >numbered.fits
fails "two exposures of one EXPNUM" 1 addnoise numbered.fits -o no.fits

# the level of saturation of the input in the units of the output
$F make full.fits 8 8 50 "$pc" "$ex" "$bu" "$mz" "SATURATE= 50000."
addnoise --gain 4 full.fits -o t.fits
near "SATURATE of 50000 electrons in adu of 4" "$(card t.fits SATURATE)" 12500 1e-9
addnoise --gain 4 --sky-rate 20 --subtract-sky full.fits -o t.fits
near "less the sky that is taken off" "$(awk -v s="$(card t.fits SATURATE)" -v l="$(card t.fits SKYLEVEL)" 'BEGIN { print s + l }')" 12500 1e-6

# the scene's seed stays, the noise's goes beside it, and the input is named by its sum
$F make seeded.fits 8 8 50 "$pc" "$ex" "$bu" "$mz" "SEED    = '12      '"
ok "noise on a scene of seed 12" addnoise -s 34 seeded.fits -o t.fits
[ "$(card t.fits SEED) $(card t.fits NOISSEED)" = "12 34" ] && pass "SEED 12, NOISSEED 34" || fail "SEED $(card t.fits SEED), NOISSEED $(card t.fits NOISSEED)"
dither -n 1 seeded.fits -o parts.fits
ok "noise on a file with sums" addnoise -s 35 parts.fits -o u.fits
sum=$($F card parts.fits 1 DATASUM)
[ -n "$sum" ] && grep -aq "HISTORY read DATASUM $sum " u.fits && pass "HISTORY names DATASUM $sum" || fail "HISTORY without DATASUM '$sum'"
