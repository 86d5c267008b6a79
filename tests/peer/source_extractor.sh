# detect against Source Extractor at the same settings on a field made here, both scored against the scene list.
sex=$(command -v source-extractor || command -v sex)
if [ -z "$sex" ]; then skip "source-extractor is not installed: detect is not compared"; exit 0; fi
for p in galgen psfgen simage addnoise; do [ -x "$BIN/$p" ] || { skip "$p is not built: detect is not compared"; exit 0; }; done
N=1000 SCALE=0.10
galgen -n 2200 --field 100 -s 21 -o scene.txt --models models.txt
psfgen -o psf.fits
simage scene.txt --models models.txt -p psf.fits -x $SCALE --size $N,$N --accuracy 1e-4 -o clean.fits
addnoise --depth 27.7 clean.fits -o field.fits
zp=$(card field.fits MAGZERO)
awk 'BEGIN { print "CONV NORM"; s = 1.5 / 2.35482; for (j = -2; j <= 2; j++) { for (i = -2; i <= 2; i++) printf "%.6f ", exp(-(i * i + j * j) / (2 * s * s)); print "" } }' >k.conv
printf '%s\n' NUMBER X_IMAGE Y_IMAGE FLUX_AUTO FLUXERR_AUTO MAG_AUTO A_IMAGE B_IMAGE FLUX_RADIUS ISOAREA_IMAGE FLAGS BACKGROUND THRESHOLD >p.param
"$sex" -dd >empty.sex 2>/dev/null
"$sex" field.fits -c empty.sex -CATALOG_NAME sex.cat -CATALOG_TYPE ASCII_HEAD -PARAMETERS_NAME p.param -FILTER Y -FILTER_NAME k.conv \
    -DETECT_MINAREA 5 -DETECT_THRESH 1.5 -ANALYSIS_THRESH 1.5 -DEBLEND_NTHRESH 32 -DEBLEND_MINCONT 0.005 -CLEAN Y -CLEAN_PARAM 1 \
    -MAG_ZEROPOINT "$zp" -GAIN 1 -GAIN_KEY NONE -SATUR_LEVEL 1000000000 -SATUR_KEY NONE -BACK_SIZE 64 -BACK_FILTERSIZE 3 -PIXEL_SCALE 0 -VERBOSE_TYPE QUIET 2>sex.err
detect field.fits --kernel 0.15 --threshold 1.5 --threshold-noise pixel --min-area 5 --columns NUMBER,X_IMAGE,Y_IMAGE,FLUX_AUTO,FLUXERR_AUTO,MAG_AUTO,A_IMAGE,B_IMAGE,FLUX_RADIUS,ISOAREA_IMAGE,FLAGS,BACKGROUND,THRESHOLD -o mine.cat
between "objects of Source Extractor" "$(grep -vc '^#' sex.cat)" 300 3000

# pairs within 2 px, mutual nearest: columns of A then columns of B
awk '!/^#/ { if (FNR == NR) { a[++n] = $0; ax[n] = $2; ay[n] = $3; g = int($2 / 8) "," int($3 / 8); c[g] = c[g] " " n }
    else { b[++m] = $0; bx[m] = $2; by[m] = $3 } }
    END { for (j = 1; j <= m; j++) { best = 4; u = int(bx[j] / 8); v = int(by[j] / 8)
        for (p = u - 1; p <= u + 1; p++) for (q = v - 1; q <= v + 1; q++) { k = split(c[p "," q], w, " ")
            for (i = 1; i <= k; i++) { d = (ax[w[i]] - bx[j])^2 + (ay[w[i]] - by[j])^2
                if (d < best) { best = d; to[j] = w[i] } if (!((w[i]) in near) || d < near[w[i]]) { near[w[i]] = d; from[w[i]] = j } } } }
      for (j = 1; j <= m; j++) if (to[j] && from[to[j]] == j) print a[to[j]], b[j] }' sex.cat mine.cat >pairs.txt
med() { sort -g | awk '{ v[NR] = $1 } END { print NR ? (v[int((NR + 1) / 2)] + v[int(NR / 2) + 1]) / 2 : "none" }'; }
all=$(awk '!/^#/ && $4 > 5 * $5' sex.cat | wc -l)
found=$(awk '$4 > 5 * $5' pairs.txt | wc -l)
between "of Source Extractor's $all objects with S/N > 5 found" "$(awk -v a="$found" -v b="$all" 'BEGIN { print a / b }')" 0.97 1
near "AUTO magnitudes of the common ones, median difference" "$(awk '$4 > 5 * $5 { print $19 - $6 }' pairs.txt | med)" 0 0.02
near "their scatter (median modulus)" "$(awk '$4 > 5 * $5 { d = $19 - $6; print d < 0 ? -d : d }' pairs.txt | med)" 0 0.05
near "ratio of the errors" "$(awk '$4 > 5 * $5 { print $18 / $5 }' pairs.txt | med)" 1 0.05
near "A_IMAGE of unblended ones" "$(awk '$11 == 0 && $24 == 0 { print $20 / $7 }' pairs.txt | med)" 1 0.005
near "positions of unblended ones, median distance" "$(awk '$11 == 0 && $24 == 0 { print sqrt(($2 - $15)^2 + ($3 - $16)^2) }' pairs.txt | med)" 0 0.01
near "FLUX_RADIUS" "$(awk '$11 == 0 && $24 == 0 { print $22 / $9 }' pairs.txt | med)" 1 0.02
near "threshold" "$(awk '{ print $26 / $13 }' pairs.txt | head -1)" 1 0.01
near "background, units of 17 electrons rms" "$(awk '{ print ($25 - $12) / 17 }' pairs.txt | med)" 0 0.04

# Both against the scene as compare_detect.py does it: pairs nearer than 0.3" in order of distance, each object once, then those within
# 2 mag.  Prints matched, purity; brighter than 25.5 the median position error, magnitude bias and its median deviation; completeness to 26;
# rms position error brighter than 25.5.  Writes their magnitude errors, "number error", to CATALOGUE.dm.
score() {
    awk -v n=$N -v s=$SCALE -v weights="${WEIGHTS:-0}" '
        function in_field(x, y) { return x > 10 && y > 10 && x < n - 9 && y < n - 9 && !(weights && dead(x, y)) }
        function dead(x, y) { return x > n / 2 - 2 && x < n / 2 + 8 || x < n / 12 + 4 && y > n / 2 - 2 && y < n * 5 / 8 + 4 }
        /^#/ { if (FNR == NR && $2 !~ /^[0-9]/) for (i = 2; i <= NF; i++) h[$i] = i - 1; next }
        FNR == NR { px = $h["DX"] / s + (n + 1) / 2; py = $h["DY"] / s + (n + 1) / 2
            if (in_field(px, py)) { x[++t] = px; y[t] = py; g = int(px / 8) "," int(py / 8); c[g] = c[g] " " t; print "0 T", t, $h["MAG"] }; next }
        !in_field($2, $3) { next }
        { print "0 O", ++all, $6; u = int($2 / 8); v = int($3 / 8)
          for (p = u - 1; p <= u + 1; p++) for (q = v - 1; q <= v + 1; q++) { k = split(c[p "," q], w, " ")
            for (i = 1; i <= k; i++) { d = sqrt(($2 - x[w[i]])^2 + ($3 - y[w[i]])^2); if (d * s < 0.3) printf "%.9g P %d %d\n", d, w[i], all } } }' scene.txt "$1" |
    LC_ALL=C sort -g | awk -v dm_file="$1.dm" '
        $2 == "T" { m[$3] = $4; if ($4 < 26) deep++ }
        $2 == "O" { mine[$3] = $4; all++ }
        $2 == "P" && !($3 in ut) && !($4 in uo) { ut[$3] = uo[$4] = 1; dm = mine[$4] - m[$3]
            if (dm < 2 && dm > -2) { ok++; if (m[$3] < 26) seen++; if (m[$3] < 25.5) { pos[++b] = $1; mag[b] = dm; square += $1 * $1; print $3, dm >dm_file } } }
        function middle(a, k,  i, j, v) { for (i = 2; i <= k; i++) { v = a[i]; for (j = i - 1; j > 0 && a[j] > v; j--) a[j + 1] = a[j]; a[j + 1] = v } return a[int((k + 1) / 2)] }
        END { bias = middle(mag, b); for (i = 1; i <= b; i++) { d = mag[i] - bias; dev[i] = d < 0 ? -d : d }
            print ok, ok / all, middle(pos, b), bias, middle(dev, b), seen / deep, sqrt(square / b) }'
}
read -r ms ps ds bs ss cs rs < <(score sex.cat)
read -r mm pm dm bm sm cm rm < <(score mine.cat)
echo "# at 1.5 sigma both: Source Extractor matched $ms purity $ps position $ds px bias $bs mag; detect $mm $pm $dm $bm"
between "matched, over Source Extractor's, at the same settings" "$(awk -v a="$mm" -v b="$ms" 'BEGIN { print a / b }')" 0.99 1.2
between "purity less Source Extractor's" "$(awk -v a="$pm" -v b="$ps" 'BEGIN { print a - b }')" -0.005 0.1
between "completeness to 26 less Source Extractor's" "$(awk -v a="$cm" -v b="$cs" 'BEGIN { print a - b }')" -0.005 0.1
between "magnitude bias less Source Extractor's" "$(awk -v a="$bm" -v b="$bs" 'BEGIN { print a - b }')" -0.05 0.002
# the same level in electrons needs the same threshold
k=$(awk '{ print 1.5 * (1 + ($12 - $25) / $26) * $13 / $26 }' pairs.txt | med)
between "threshold that gives the same level" "$k" 1.45 1.5
between "position error over Source Extractor's" "$(awk -v a="$dm" -v b="$ds" 'BEGIN { print a / b }')" 0.5 1.02

# no_worse NAME: pairs of magnitude errors, Source Extractor's and ours, of the same objects.  Bias and scatter are no worse within two
# of their own errors (bootstrap over the objects), which are told.
no_worse() {
    local n ba bb sa sb db edb rs ers
    read -r n ba bb sa sb db edb rs ers < <(perl "$TOP/tests/paired.pl")
    echo "# $1: $n common objects; bias $ba and $bb mag, |ours| less |its| $db +- $edb; scatter $sa and $sb, ratio $rs +- $ers"
    between "$1: magnitude bias less Source Extractor's, beyond two errors of $edb" "$(awk -v d="$db" -v e="$edb" 'BEGIN { print d - 2 * e }')" -0.3 0
    between "$1: magnitude scatter over Source Extractor's, less two errors of $ers" "$(awk -v d="$rs" -v e="$ers" 'BEGIN { print d - 2 * e }')" 0.3 1
    between "$1: these errors" "$(awk -v a="$edb" -v b="$ers" 'BEGIN { print a < 0.01 && b < 0.2 }')" 1 1
}

# Four more fields, stars and galaxies, three of them with a rising sky, two with dead columns, a dead box and a third at half
# exposure.  Read noise makes the values real numbers: on whole ones Source Extractor's histogram puts the sky of 46 electrons
# 0.3 further off.  Within 3 pixels of a dead one nothing is scored (Source Extractor interpolates there and finds the results).
field() { # NAME SEED SCALE SIZE SLOPE EXPOSURE
    local name=$1 seed=$2 scale=$3 n=$4 f
    f=$(awk "BEGIN { print $n * $scale }")
    galgen --field "$f" -s "$seed" -o g.txt --models gm.txt
    galgen --stars -n 25 --field "$f" -s "$((seed + 100))" -o t.txt
    { cat g.txt; awk '!/^#/ { print $1 + 900000, $2, $3, 20.5 + 0.2 * NR, "star", 0, 0, 0, 0, 0 }' t.txt; } >scene.txt
    simage scene.txt --models gm.txt -p psf.fits -x "$scale" --size "$n,$n" --accuracy 1e-3 -o clean.fits
    addnoise -q --depth 27.7 --read-noise 3 -s "$seed" clean.fits -o noisy.fits
    "${BUILD:-$TOP/build}/tool/spoil" noisy.fits field.fits weight.fits "$seed" "$5" "$6"
    local zp weights=() mine=() w=0
    zp=$(card field.fits MAGZERO)
    if [ "$6" != 1 ]; then w=1 weights=(-WEIGHT_TYPE MAP_WEIGHT -WEIGHT_IMAGE weight.fits); mine=(-w weight.fits); fi
    awk -v f="$(awk "BEGIN { print 0.15 / $scale }")" 'BEGIN { print "CONV NORM"; s = f / 2.35482; r = int(3 * s) + 1
        for (j = -r; j <= r; j++) { for (i = -r; i <= r; i++) printf "%.6f ", exp(-(i * i + j * j) / (2 * s * s)); print "" } }' >k.conv
    "$sex" field.fits -c empty.sex -CATALOG_NAME sex.cat -CATALOG_TYPE ASCII_HEAD -PARAMETERS_NAME p.param -FILTER Y -FILTER_NAME k.conv \
        -DETECT_MINAREA 5 -DETECT_THRESH 1.5 -ANALYSIS_THRESH 1.5 -MAG_ZEROPOINT "$zp" -GAIN 1 -GAIN_KEY NONE -SATUR_LEVEL 1e9 -SATUR_KEY NONE \
        -BACK_SIZE 64 -BACK_FILTERSIZE 3 -PIXEL_SCALE 0 -VERBOSE_TYPE QUIET "${weights[@]}" 2>sex.err
    mine+=(-q field.fits --kernel 0.15 --threshold 1.5 --threshold-noise pixel --min-area 5 --columns NUMBER,X_IMAGE,Y_IMAGE,FLUX_AUTO,FLUXERR_AUTO,MAG_AUTO,BACKGROUND)
    detect "${mine[@]}" -o mine.cat
    read -r ms ps ds bs ss cs rs < <(N=$n SCALE=$scale WEIGHTS=$w score sex.cat)
    read -r mm pm dm bm sm cm rm < <(N=$n SCALE=$scale WEIGHTS=$w score mine.cat)
    echo "# $name: Source Extractor: matched $ms purity $ps position $ds px bias $bs scatter $ss completeness $cs; detect: $mm $pm $dm $bm $sm $cm"
    echo "$ms $ps $ds $bs $ss $mm $pm $dm $bm $sm" >>fields.txt
    between "$name: matched, over Source Extractor's" "$(awk -v a="$mm" -v b="$ms" 'BEGIN { print a / b }')" 0.99 1.3
    between "$name: purity less Source Extractor's" "$(awk -v a="$pm" -v b="$ps" 'BEGIN { print a - b }')" -0.005 0.1
    between "$name: completeness to 26 less Source Extractor's" "$(awk -v a="$cm" -v b="$cs" 'BEGIN { print a - b }')" -0.005 0.1
    between "$name: rms position error over Source Extractor's" "$(awk -v a="$rm" -v b="$rs" 'BEGIN { print a / b }')" 0.5 1.02
    awk 'FNR == NR { a[$1] = $2; next } $1 in a { print a[$1], $2 }' sex.cat.dm mine.cat.dm | tee -a four.pairs >field.pairs
    no_worse "$name" <field.pairs
    [ "$5$6" = 01 ] || return 0
    # the sky is known here: ours is Source Extractor's, and that between the objects is nearer the truth
    local known ours theirs dark
    column() { grep -v '^#' "$1" | awk "{ print $2 }" | med; }
    known=$(card field.fits SKYLEVEL) ours=$(column mine.cat '$7') theirs=$(column sex.cat '$12')
    detect "${mine[@]}" --back-type dark -o dark.cat
    dark=$(column dark.cat '$7')
    echo "# $name: sky less the true one: Source Extractor $(awk "BEGIN { print $theirs - $known }") electrons, mode $(awk "BEGIN { print $ours - $known }"), dark $(awk "BEGIN { print $dark - $known }")"
    near "$name: sky, and Source Extractor's" "$ours" "$theirs" 0.05
    between "$name: error of --back-type dark over Source Extractor's" "$(awk "BEGIN { a = $dark - $known; b = $theirs - $known; print sqrt(a * a / (b * b)) }")" 0 0.8
}
if [ -x "${BUILD:-$TOP/build}/tool/spoil" ]; then
    field "0.04 arcsec" 31 0.04 2560 0 1
    field "0.16 arcsec, rising sky" 32 0.16 1024 60 1
    field "0.04 arcsec, weights" 33 0.04 2560 5 0.5
    field "0.16 arcsec, weights" 34 0.16 1024 60 0.5
    between "position error over Source Extractor's" "$(awk '{ s += log($8 / $3) } END { print exp(s / NR) }' fields.txt)" 0.5 1.02
    no_worse "all four fields" <four.pairs
else skip "build/tool/spoil is not built: four fields are not compared"; fi

# the reference field, where it is
if [ -e "$SHARED/truth/detect/A_100.fits.gz" ] && python3=$(command -v /usr/bin/python3) && "$python3" -c 'import astropy, scipy' 2>/dev/null; then
    detect "$SHARED/truth/detect/A_100.fits.gz" --kernel 0.15 --threshold 1.5 --threshold-noise pixel --min-area 5 -o A.cat
    if "$python3" "$SHARED/tools/compare_detect.py" A.cat "$SHARED/truth/detect/truth_A.fits.gz" --ref "$SHARED/truth/detect/sextractor_A_100.fits.gz" \
        --scale 0.10 --size 1638 --ref-completeness-loss 0 --ref-purity-loss 0.005 --max-bias 0.0606 --max-pos-rms 0.1754 --min-completeness 0.867 >A.txt
    then pass "A_100: $(grep '^catalogue' A.txt | cut -c1-220)"; else fail "A_100: $(grep -E 'FAIL|^cat' A.txt | tr '\n' ' ')"; fi
    scatter() { sed -n "s/^$1: .* scatter \([0-9.]*\), position.*/\1/p" A.txt; }
    between "A_100: scatter of magnitudes, at most Source Extractor's" "$(scatter catalogue)" 0.05 "$(scatter reference)"
else skip "the reference field or astropy is not there: A_100 is not scored"; fi
if [ -e "$SHARED/data/hdf/hdfn_f814w.fits" ] && python3=$(command -v /usr/bin/python3) && "$python3" -c 'import astropy' 2>/dev/null; then
    detect "$SHARED/data/hdf/hdfn_f814w.fits" -w "$SHARED/data/hdf/hdfn_f814w_weight.fits" --kernel 0.12758 --pixscale 0.03987 --threshold 1.5 \
        --threshold-noise pixel --gain 865200 -z 22.09 -o hdf.cat
    "$python3" - "$SHARED/truth/detect/sextractor_hdf.fits.gz" >hdf.ref <<'P'
import sys
from astropy.io import fits
for r in fits.open(sys.argv[1])[1].data:
    print(r['NUMBER'], r['X_IMAGE'], r['Y_IMAGE'], r['FLUX_AUTO'] / r['FLUXERR_AUTO'], r['MAG_AUTO'])
P
    awk 'FNR == NR { if (!/^#/) { x[++n] = $2; y[n] = $3; m[n] = $(c) } next } $4 > 5 { all++; for (i = 1; i <= n; i++) if ((x[i] - $2)^2 + (y[i] - $3)^2 < 9) { ok++; print m[i] - $5 >"hdf.dm"; break } } END { print all, ok }' \
        c="$(grep '^# NUMBER' hdf.cat | tail -1 | tr ' ' '\n' | grep -n '^MAG_AUTO$' | cut -d: -f1 | awk '{ print $1 - 1 }')" hdf.cat hdf.ref >hdf.n
    read -r want got <hdf.n
    near "HDF section with its weight: found of $want with S/N > 5" "$got" "$want" 0
    near "their AUTO magnitudes, median difference" "$(med <hdf.dm)" 0 0.05
    # galaxies of magnitudes 22.5 to 25.5 through the telescope's PSF (charge diffusion and drizzling as a Gaussian) put among the real ones
    cat >add.py <<'P'
import sys
from astropy.io import fits
h = fits.open(sys.argv[1])
h[0].data = h[0].data + fits.getdata(sys.argv[2])
h.writeto(sys.argv[3], overwrite=True)
P
    hdf="$SHARED/data/hdf" conf="$SHARED/truth/detect/conf"
    for k in {1..12}; do
        galgen -n 20 --field 19.6 -s $((400 + k)) -o g.txt --models gm.txt
        awk '/^#/ { print; next } { $4 = 22.5 + 0.5 * (n++ % 7); print }' g.txt >s.txt
        simage s.txt --models gm.txt -p "$hdf/wfpc2_f814w_psf.fits" --diffusion 0.0515 -x 0.03987 -z 22.08 -T 1 --size 512,512 --accuracy 1e-3 -q -o inj.fits
        "$python3" add.py "$hdf/hdfn_f814w.fits" inj.fits both.fits
        "$sex" both.fits -c "$conf/hdf.sex" -CATALOG_NAME s.cat -CATALOG_TYPE ASCII_HEAD -PARAMETERS_NAME p.param -FILTER_NAME "$conf/ghdf.conv" \
            -MAG_ZEROPOINT 22.08 -WEIGHT_IMAGE "$hdf/hdfn_f814w_weight.fits" -VERBOSE_TYPE QUIET 2>sex.err
        detect both.fits -q -w "$hdf/hdfn_f814w_weight.fits" --kernel 0.12758 --pixscale 0.03987 --threshold 1.5 --threshold-noise pixel \
            --gain 865200 -z 22.08 -c NUMBER,X_IMAGE,Y_IMAGE,MAG_AUTO -o m.cat
        awk -v k=$k '!/^#/ { print k, "T", $2 / 0.03987 + 256.5, $3 / 0.03987 + 256.5, $4 }' s.txt
        awk -v k=$k '!/^#/ { print k, "S", $2, $3, $6 }' s.cat
        awk -v k=$k '!/^#/ { print k, "M", $2, $3, $4 }' m.cat
    done >hdf.all
    # within 0.3 arcsec and 2 mag, 20 pixels off the border
    awk '$2 == "T" { if ($3 > 20 && $4 > 20 && $3 < 493 && $4 < 493) { k[++n] = $1; x[n] = $3; y[n] = $4; m[n] = $5 } next }
        { for (i = n; i > 0 && k[i] == $1; i--) { d = ($3 - x[i])^2 + ($4 - y[i])^2; e = $5 - m[i]
            if (d < 56.6 && e * e < 4 && (!((i, $2) in best) || d < best[i, $2])) { best[i, $2] = d; error[i, $2] = e } } }
        END { for (i = 1; i <= n; i++) { s += (i, "S") in best; o += (i, "M") in best
            if ((i, "S") in best && (i, "M") in best) print error[i, "S"], error[i, "M"] } print n, s, o >"hdf.found" }' hdf.all >hdf.pairs
    read -r n s o <hdf.found
    between "HDF section: of $n galaxies put in, found, over Source Extractor's $s" "$(awk -v a="$o" -v b="$s" 'BEGIN { print a / b }')" 0.99 1.2
    no_worse "HDF section, against the truth" <hdf.pairs
else skip "the HDF section or astropy is not there"; fi
