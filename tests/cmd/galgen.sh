# galgen: counts, sizes, determinism, library, stars, faults.

# a small real-looking library of our own: 60 galaxies, magnitudes 20.5 .. 26.4
ok "a library" galgen -n 60 --mag-range 20.5,26.4 -s 9 --models lib.txt -o libscene.txt

# ---- default field ----
ok "default field" galgen --models m.txt -o s.txt
near "805 galaxies per arcmin^2" "$(grep -vc '^#' s.txt)" 6003 0
same "IDs of scene and catalogue" <(col s.txt MODEL) <(col m.txt ID)
same "magnitudes of scene and catalogue" <(col s.txt MAG) <(col m.txt MAG)
near "AREA" "$(key s.txt AREA)" 7.45654 1e-5
near "number of types" "$(col s.txt TYPE | sort -u | grep -c '^shapelet$')" 1 0
# positions inside the field, uniform: mean of each coordinate within 4.5 sigma
for c in DX DY; do
    near "mean $c" "$(col s.txt $c | awk '{ s += $1 } END { print s / NR }')" 0 2.75
    near "variance of $c" "$(col s.txt $c | awk '{ s += $1 * $1 } END { print s / NR }')" 2236.96 116
    between "largest |$c|" "$(col s.txt $c | awk '{ x = $1 < 0 ? -$1 : $1; if (x > m) m = x } END { print m }')" 80 81.92
done
# chi^2 of magnitudes against the knots of the counts (10 bins of known share), 99.99 % point of 9 degrees: 33.7
chi2=$(col s.txt MAG | awk '
function n(m,  i) { for (i = 1; i < 11 && m >= K[i + 1]; i++); return exp(log(V[i]) + (log(V[i + 1]) - log(V[i])) * (m - K[i]) / (K[i + 1] - K[i])) }
BEGIN { split("18 20 22.25 23.25 24.25 25.25 26.25 27.25 28.25 29.25 30.25 31.25", K, " "); split(".08 .65 4.5 9.6 20 33.4 54 84 128 185 260 350", V, " ")
        split("20 23 24 25 26 27 28 28.8 29.6 30.2 30.8", E, " ")
        for (b = 1; b <= 10; b++) for (m = E[b] + .0005; m < E[b + 1]; m += .001) { P[b] += n(m); T += n(m) } }
{ for (b = 1; b < 10 && $1 >= E[b + 1]; b++); O[b]++ }
END { for (b = 1; b <= 10; b++) { e = NR * P[b] / T; x += (O[b] - e) ^ 2 / e } print x }')
between "chi^2 of the magnitudes, 9 degrees of freedom" "$chi2" 0.5 33.7
# median half-light radius in three magnitude ranges
for m in 24 26 28 30; do
    got=$(awk '!/^#/ { print $4, $7 }' s.txt | awk -v m=$m '$1 >= m - .5 && $1 < m + .5 { print $2 / (.36 * 10 ^ (-.105 * ($1 - 22.25))) }' | sort -g | awk '{ v[NR] = $1 } END { print v[int((NR + 1) / 2)] }')
    between "median size at $m over the recipe's" "$got" 0.86 1.16
done
# captured power and order by magnitude
near "orders by magnitude" "$(awk '!/^#/ { w = $4 < 26 ? 12 : $4 < 28 ? 8 : 4; if ($3 != w || NF != 10 + (w + 1) * (w + 2) / 2) bad++ } END { print bad + 0 }' m.txt)" 0 0
med=$(awk '!/^#/ && $4 < 26 { print $6 }' m.txt | sort -g | awk '{ v[NR] = $1 } END { print v[int(NR / 20) + 1], v[int(NR / 4)], v[int(NR / 2)] }')
read -r p5 p25 p50 <<<"$med"
near "captured power, m < 26, order 12, 5 %" "$p5" 0.88 0.03
near "captured power, m < 26, order 12, 25 %" "$p25" 0.98 0.03
near "captured power, m < 26, order 12, 50 %" "$p50" 0.99 0.01
# every row has unit flux: order 0 and 2 terms done here by hand for order 2
ok "order 2" galgen -n 50 --nmax 2 --models m2.txt -o s2.txt
flux=$(awk '!/^#/ { s = 1.8827925275534298 ^ 2; k = sqrt(.5); f = $2 * s * ($11 + k * ($14 + $16)); d = f - 1; if (d < 0) d = -d; if (d > w) w = d } END { print w }' m2.txt)
between "unit flux to nine digits" "$flux" 0 1e-8

# ---- same bytes ----
ok "two threads" galgen --models m.txt -o s_2.txt -j 2
same "scene with 2 threads" s.txt s_2.txt
mkdir other
ok "seven threads elsewhere" bash -c 'cd other && galgen -j 7 --models m.txt > s.txt'
same "scene in another folder" s.txt other/s.txt
same "catalogue in another folder, 7 threads" m.txt other/m.txt
ok "fewer galaxies" galgen -n 100 --models m100.txt -o s100.txt
same "the first 100 do not depend on the others" <(grep -v '^#' s.txt | head -100) <(grep -v '^#' s100.txt)
same "nor do their coefficients" <(grep -v '^#' m.txt | head -100) <(grep -v '^#' m100.txt)
ok "another seed" galgen -n 100 -s 2 --models x.txt -o y.txt
near "galaxies that seeds 1 and 2 share" "$(cat <(col y.txt MAG) <(col s100.txt MAG) | sort | uniq -d | wc -l)" 0 0
near "no date, user or path in the files" "$(grep -cE "$(id -un)@|/tmp|20[0-9][0-9]-[0-9][0-9]-" s.txt)" 0 0

# ---- options ----
ok "a bright range" galgen --mag-range 20,25 --models b.txt -o b_s.txt
near "-n from the counts of the range" "$(grep -vc '^#' b_s.txt)" 332 3
between "largest magnitude" "$(col b_s.txt MAG | sort -g | tail -1)" 24.5 25
ok "none" galgen -n 0 --models none.txt -o none_s.txt
near "no rows" "$(grep -vc '^#' none_s.txt)" 0 0
ok "check" galgen --check
near "--check writes one line" "$(galgen --check 2>&1 | wc -l)" 1 0
ok "twice the size" galgen -n 100 --size 0.72 --models x.txt -o y.txt
near "twice the size" "$(paste <(col y.txt RE) <(col s100.txt RE) | awk '{ d = $1 / $2 - 2; if (d < 0) d = -d; if (d > w) w = d } END { print w }')" 0 1e-7

# ---- stars ----
ok "stars" galgen --stars -o stars.txt
near "400 stars" "$(grep -vc '^#' stars.txt)" 400 0
near "of magnitude 21" "$(col stars.txt MAG | sort -u)" 21 0
near "closest pair, arcsec: at least 0.4 of a cell" "$(paste <(col stars.txt DX) <(col stars.txt DY) | awk '{ x[NR] = $1; y[NR] = $2; for (i = 1; i < NR; i++) { d = ($1 - x[i]) ^ 2 + ($2 - y[i]) ^ 2; if (m == "" || d < m) m = d } } END { print (sqrt(m) >= 3.27) }')" 1 0
# phase at 0.1": uniform in ten bins, 99.99 % point of 9 degrees
between "chi^2 of the phase in 0.1 arcsec" "$(cat <(col stars.txt DX) <(col stars.txt DY) | awk '{ p = ($1 + 100) * 10; p -= int(p); O[int(10 * p)]++ } END { for (b = 0; b < 10; b++) x += (O[b] - NR / 10) ^ 2 / (NR / 10); print x }')" 0.5 33.7
ok "seven stars" galgen --stars -n 7 --star-mag 18.5 --field 20 -o seven.txt
near "seven stars" "$(awk '!/^#/ && $4 == 18.5 && $2 ^ 2 < 100 && $3 ^ 2 < 100' seven.txt | wc -l)" 7 0

# ---- library ----
ok "from a library" galgen --library lib.txt -o l.txt
near "all models come from the library" "$(sort -u <(col l.txt MODEL) | cat - <(col lib.txt ID | sort -u) | sort | uniq -d | wc -l)" "$(col l.txt MODEL | sort -u | wc -l)" 0
between "models used" "$(col l.txt MODEL | sort -u | wc -l)" 40 60
near "mean parity" "$(col l.txt PARITY | awk '{ s += $1 } END { print s / NR }')" 0 0.06
near "mean rotation" "$(col l.txt ROT | awk '{ s += $1 } END { print s / NR }')" 180 6.1
# dilation is the ratio of median sizes at the two magnitudes; the model's is one of the eight nearest
cat > check.awk <<'A'
FNR == NR { if (!/^#/) { lib[$1] = $4; n++ } next }
/^#/ { next }
{ d = $9 / 10 ^ (-.105 * ($4 - lib[$6])) - 1; if (d < 0) d = -d; if (d > w) w = d
  r = 0; a = $4 - lib[$6]; if (a < 0) a = -a
  for (i in lib) { b = $4 - lib[i]; if (b < 0) b = -b; r += b < a - 1e-9 }
  if (r > 7) far++ }
END { print w, far + 0 }
A
read -r w far <<<"$(awk -f check.awk lib.txt l.txt)"
between "dilation follows the size relation" "$w" 0 1e-6
near "galaxies whose model is not among the 8 nearest in magnitude" "$far" 0 0
ok "own magnitudes" galgen --library lib.txt --library-mags own -n 500 -o own.txt
near "magnitude of model and galaxy agree, dilation 1" "$(awk 'FNR == NR { if (!/^#/) m[$1] = $4; next } !/^#/ && ($4 != m[$6] || $9 != 1)' lib.txt own.txt | wc -l)" 0 0
ok "library with --models" galgen --library lib.txt --models copy.txt -n 5 -o x.txt
same "--models gets the library's rows" <(grep -v '^#' lib.txt) <(grep -v '^#' copy.txt)
ok "library from standard input" bash -c 'galgen --library - -n 5 < lib.txt > y.txt'
same "and the same galaxies" <(grep -v '^#' x.txt) <(grep -v '^#' y.txt)
if [ -f "$SHARED/data/hdf/hdfn_shapelets.txt" ]; then
    ok "galaxies of the HDF" galgen --library "$SHARED/data/hdf/hdfn_shapelets.txt" -o hdf.txt
    between "its models used" "$(col hdf.txt MODEL | sort -u | wc -l)" 20 28
else
    skip "galaxies of the HDF: ../shared is not here"
fi

# ---- through FITS ----
ok "catalogues as FITS" galgen -n 100 --models m100.fits -o s100.fits
ok "a FITS library" galgen --library m100.fits -n 30 -o f1.txt
ok "the text library" galgen --library m100.txt -n 30 -o f2.txt
same "FITS and text libraries give the same galaxies" <(grep -v '^#' f1.txt) <(grep -v '^#' f2.txt)


# ---- the field turned ----
ok "turned by 90" galgen -n 100 --turn 90 --models m90.txt -o s90.txt
same "the coefficients stay" <(grep -v '^#' m90.txt) <(grep -v '^#' m100.txt)
near "(x,y) goes to (-y,x), ROT 90" "$(paste <(grep -v '^#' s90.txt) <(grep -v '^#' s100.txt) | awk '$2 != -$14 || $3 != $13 || $11 != 90' | wc -l)" 0 0
ok "library turned by 270" galgen --library lib.txt -n 30 --turn 270 -o l270.txt
ok "library not turned" galgen --library lib.txt -n 30 -o l0.txt
near "ROT grows by 270" "$(paste <(col l270.txt ROT) <(col l0.txt ROT) | awk '{ d = ($1 - $2 + 720) % 360 - 270; if (d < 0) d = -d; if (d > w) w = d } END { print w }')" 0 1e-6
if [ -x "$BIN/simage" ]; then
    values() { tail -c $((2880 * 56)) "$1" | head -c 160000 | od -An -v -w4 --endian=big -tf4; }
    ok "turned by 180" galgen -n 40 --field 20 --turn 180 --models m40.txt -o s180.txt
    ok "not turned" galgen -n 40 --field 20 --models m40.txt -o s0.txt
    ok "an image of it" simage s180.txt --models m40.txt -x 0.1 --size 200,200 -o i180.fits
    ok "and of the field itself" simage s0.txt --models m40.txt -x 0.1 --size 200,200 -o i0.fits
    read -r diff peak <<<"$(paste <(values i180.fits) <(values i0.fits | tac) | awk '{ d = $1 - $2; if (d < 0) d = -d; if (d > w) w = d; if ($1 > p) p = $1 } END { print w + 0, p }')"
    between "peak, electrons" "$peak" 10 1e6
    between "difference of the image turned back, electrons" "$diff" 0 "$(awk -v p="$peak" 'BEGIN { print 2e-6 * p }')"
else
    skip "turned image: simage is not built"
fi

# ---- compressed ----
gzip -k m100.txt m100.fits
for f in m100.txt.gz m100.fits.gz m100.fits; do
    ok "a library $f" galgen --library $f -n 30 -o f3.txt
    same "$f gives the same galaxies" <(grep -v '^#' f3.txt) <(grep -v '^#' f2.txt)
    ok "$f from standard input" bash -c "galgen --library - -n 30 < $f > f3.txt"
    same "$f from standard input gives the same galaxies" <(grep -v '^#' f3.txt) <(grep -v '^#' f2.txt)
    ok "$f through a pipe" bash -c "cat $f | galgen --library - -n 30 > f3.txt"
    same "$f through a pipe gives the same galaxies" <(grep -v '^#' f3.txt) <(grep -v '^#' f2.txt)
    ok "$f through a pipe, byte by byte" bash -c "dd bs=1 if=$f count=300000 2>/dev/null | galgen --library - -n 30 > f3.txt"
    same "$f byte by byte gives the same galaxies" <(grep -v '^#' f3.txt) <(grep -v '^#' f2.txt)
done
head -c 3000 m100.txt.gz > cut.gz
fails "gzip cut off" 1 galgen --library cut.gz -n 3
fails "gzip cut off, through a pipe" 1 bash -c 'cat cut.gz | galgen --library - -n 3'
fails "FITS cut off, through a pipe" 1 bash -c 'head -c 9000 m100.fits | galgen --library - -n 3'
fails "FITS through a pipe, more than --max-memory" 1 bash -c 'cat m100.fits | galgen --library - -n 3 --max-memory 20K'

# ---- faults ----
fails "no place for coefficients" 2 galgen
fails "range turned round" 2 galgen --mag-range 25,20 --models x
fails "no number" 2 galgen -n 1.5abc --models x
fails "nan" 2 galgen --field nan --models x
fails "negative field" 2 galgen --field -3 --models x
fails "unknown option" 2 galgen --model x
fails "an operand" 2 galgen --stars x
fails "stars and library" 2 galgen --stars --library lib.txt
fails "both on standard output" 2 galgen --models -
fails "too many" 2 galgen --field 100000 --models x
fails "missing library" 1 galgen --library absent.txt
fails "library is the output" 1 galgen --library lib.txt -o lib.txt
fails "no folder" 1 galgen -n 3 --models none/m.txt
fails "memory" 1 galgen -n 1000000 --models big.txt --max-memory 10M
fails "full device" 1 bash -c 'galgen --stars > /dev/full'
near "no file of a failed run is left" "$(ls big.txt none 2>/dev/null | wc -l)" 0 0
