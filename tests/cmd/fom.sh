# fom: catalogues whose answers are known; groups, pairs, undefined values.

# shapes NAME SET SCALE G1 G2 SLOPE N SEED: N galaxies with P = 1.25 and e = e0 + 1.25 SLOPE g, same e0 for one seed
shapes() {
    awk -v set="$2" -v scale="$3" -v g1="$4" -v g2="$5" -v slope="$6" -v n="$7" -v seed="$8" 'BEGIN { srand(seed)
        printf "# Keyword: SETNAME = %s\n# Keyword: CCDSCALE = %s\n# Keyword: PIXSCALE = %s\n# Keyword: SHEAR1 = %s\n# Keyword: SHEAR2 = %s\n", set, scale, scale, g1, g2
        printf "# Keyword: AREA = 4\n# Keyword: SEED = %d\n# Keyword: NDET = %d\n", seed, 2 * n
        print "# NUMBER X_IMAGE Y_IMAGE E1 E2 E1ERR E2ERR P11 P22 CUT"
        for (i = 1; i <= n; i++) { a = rand(); b = rand(); if (a == 0) a = 0.5; r = 0.25 * sqrt(-2 * log(a))
            printf "%d %.3f %.3f %.9f %.9f 0.05 0.05 1.25 1.25 0\n", i, 30 * (i % 40), 30 * int(i / 40), r * cos(6.2831853 * b) + 1.25 * slope * g1, r * sin(6.2831853 * b) + 1.25 * slope * g2 } }' >"$1"
}
nine() { # PREFIX SET SCALE SLOPE N SEED
    local k=0 g
    for g in "0 0" "-0.05 0" "-0.025 0" "0.025 0" "0.05 0" "0 -0.05" "0 -0.025" "0 0.025" "0 0.05"; do
        set -- "$1" "$2" "$3" "$4" "$5" "$6" $g
        shapes "$1$k" "$2" "$3" "$7" "$8" "$4" "$5" "$6"; k=$((k + 1))
    done
}
nine a sim1 0.10 0.95 400 1; nine b sim1 0.06 0.97 400 2; nine c sim1 0.14 0.93 300 3; nine d sim2 0.10 0.9 400 4
ok "one group" fom a? -o one.cat
near "one row" "$(grep -vc '^#' one.cat)" 1 0
near "images" "$(col one.cat NIMAGES)" 9 0
near "n_gal" "$(col one.cat N_GAL)" 100 1e-9
near "detected" "$(col one.cat N_DET)" 200 1e-9
fom a0 -q -o single.cat; near "one image: error of the count sqrt(800)/4" "$(col single.cat N_DETERR)" 7.0710678 1e-6
near "sigma_e: its error, sigma/(2 sqrt n) of normal values to the scatter of their kurtosis" "$(paste <(col one.cat SIGMA_EERR) <(col one.cat SIGMA_E) | awk '{ print $1 / $2 * 2 * sqrt(400) }')" 1 0.2
near "G" "$(col one.cat G)" 1.25 1e-9
near "slope by pairs" "$(col one.cat BPAIR1)" 0.95 1e-6
near "slope by pairs, component 2" "$(col one.cat BPAIR2)" 0.95 1e-6
near "slope of the fit within 5 of its errors" "$(paste <(col one.cat B1) <(col one.cat B1SE) | awk '{ d = ($1 - 0.95) / $2; print (d < 5 && d > -5) }')" 1 0
near "SE of the fit, 12.65 sigma/sqrt(n)" "$(paste <(col one.cat B1SE) <(col one.cat SIGMA1) | awk '{ print $1 / $2 * 20 }')" 12.649 0.001
near "sigma of a 2-D normal of 0.25, over G and the slope" "$(col one.cat SIGMA_GAMMA)" 0.298 0.02
near "common objects" "$(col one.cat NPAIR1)" 400 0
ok "four groups" fom a? b? c? d? --reference-set sim1 --reference-scale 0.10 -o all.cat
near "rows sorted by set and scale" "$(paste <(col all.cat SETNAME) <(col all.cat CCDSCALE) | sort -c -k1,1 -k2,2g && echo 1)" 1 0
near "reference has log10 dC = 0" "$(col all.cat LOGDC | sed -n 2p)" 0 1e-12
near "line over three scales" "$(col all.cat LINE1A | head -1)" 1 1e-4
near "its change with scale" "$(col all.cat LINE1B | head -1)" -0.5 1e-3
near "sim2 has no line: its own slope" "$(col all.cat LINE1 | tail -1)" 0.9 1e-6
fom a? b? c? d? --reference-set sim1 -j 2 -o again.cat; near "order and threads: same numbers" "$(diff <(grep -v '^#' all.cat) <(grep -v '^#' again.cat) | wc -l)" 0 0
fom d? c? b? a? --reference-set sim1 --reference-scale 0.10 -o back.cat; near "operands in another order: same rows" "$(diff <(grep -v '^#' all.cat) <(grep -v '^#' back.cat) | wc -l)" 0 0
ok "table for people" fom a? b? --table -o table.txt
near "table has a line a group and one above" "$(wc -l <table.txt)" 3 0

# selection: galaxies with e1 > 0.1 fail, in every image by its own e1: response -r (u + r), r = phi/Phi at u = .1/.25
nine s sel 0.10 1 4000 7
for k in 0 1 2 3 4 5 6 7 8; do awk '/^#/ { print; next } { $10 = $4 > 0.1 ? 2 : 0; print }' s$k >t$k; done
ok "own selection in each image" fom t? --draws 0 --reference-set sel -o sel.cat
near "selection bias" "$(col sel.cat MSEL1)" -0.5284 "$(awk -v s="$(col sel.cat MSEL1SE)" 'BEGIN { print 4 * s + 0.002 }')"
near "measurement bias: none" "$(col sel.cat BPAIR1)" 1 1e-6
near "total = measurement + selection" "$(paste <(col sel.cat MTOT1) <(col sel.cat MSEL1) | awk '{ print $1 - $2 }')" 0 0.03

# bins: galaxies with NUMBER up to 200 answer by 0.9, the others by 1.1; DISTANCE of a grid of 30 x 30 pixels of 0.1"
for k in 0 1 2 3 4 5 6 7 8; do g=$(key a$k SHEAR1) h=$(key a$k SHEAR2)
    awk -v g="$g" -v h="$h" '/^#/ { print; next } { s = $1 <= 200 ? -0.05 : 0.15; $4 += 1.25 * s * g; $5 += 1.25 * s * h; print }' a$k >bin$k; done
ok "bins of a column" fom bin? --bins NUMBER:0,200.5,1000 -o bins.cat
near "a row for each bin" "$(col bins.cat BINLO | tr '\n' ' ' | tr -d ' ')" 0200.5 0
near "slope of the first bin" "$(col bins.cat BPAIR1 | head -1)" 0.9 1e-6
near "slope of the second bin" "$(col bins.cat BPAIR2 | tail -1)" 1.1 1e-6
near "objects of the first bin" "$(col bins.cat NPAIR1 | head -1)" 200 0
near "both bins together" "$(fom bin? -q -o both.cat; col both.cat BPAIR1)" 1 1e-6
ok "bins of the distance" fom a? --bins DISTANCE:0,2.9,3.1,9 -q -o dist.cat
near "all of a grid have neighbours at 3 arcsec" "$(col dist.cat NPAIR1 | tr '\n' ' ' | tr -d ' ')" 04000 0
# 150 objects of 2 pixels of 0.1", the others of 4; 250 with S/N 10, the others with 50
for k in 0 1 2 3 4 5 6 7 8; do awk '/^# NUMBER/ { print $0, "D_RRG FLUX_AUTO FLUXERR_AUTO"; next } /^#/ { print; next } { print $0, $1 <= 150 ? 2 : 4, 100, $1 <= 250 ? 10 : 2 }' a$k >size$k; done
ok "bins of the size" fom size? --bins SIZE:0.1,0.3,0.5 -q -o size.cat
near "150 objects of 0.2 arcsec, 250 of 0.4" "$(col size.cat NPAIR1 | tr -d '\n')" 150250 0
ok "bins of the signal to noise" fom size? --bins SNR:5,20,100 -q -o size.cat
near "250 objects of 10, 150 of 50" "$(col size.cat NPAIR1 | tr -d '\n')" 250150 0
# object 7 leaves the bin in one image, object 9 is in it in one image only
for k in 0 1 2 3 4 5 6 7 8; do awk -v k=$k '/^#/ { print; next } { s = $1 <= 300; if ($1 == 7 && k == 1) s = 0; if ($1 == 9 && k != 0) s = 0; if ($1 == 305 && k != 0) s = 1; $1 = s; print }' a$k >all$k; done
fom all? -q --bins NUMBER:0.5,2 -o some.cat; fom all? -q --bins NUMBER:0.5,2 --bins-everywhere -o every.cat
near "bins by the g = 0 image" "$(col some.cat NPAIR1)" 300 0
near "--bins-everywhere: without those that leave it" "$(col every.cat NPAIR1)" 298 0
near "of the component whose images they leave it in" "$(col every.cat NPAIR2)" 299 0
fails "--bins-everywhere without bins" 2 fom a0 --bins-everywhere
fails "bins without edges" 2 fom a0 --bins NUMBER
fails "bins of falling edges" 2 fom a0 --bins NUMBER:2,1
fails "bins of an unknown column" 1 fom a0 --bins MAG:1,2
fails "bins of SNR without fluxes" 1 fom a0 --bins SNR:1,2

# leakage: e = e0 + 1.25 0.03 e_psf, two PSFs of e1 = +-0.05
for k in 1 -1; do awk -v s=$k '/^#/ { print; if (!n++) printf "# Keyword: EPSF1 = %s\n# Keyword: EPSF2 = 0.001\n", 0.002 + 0.05 * s; next } { $4 += 1.25 * 0.03 * 0.05 * s; print }' a0 >psf$k; done
ok "leakage" fom --against psf psf1 psf-1 -q -o leak.cat
near "leakage: slope against the PSF" "$(col leak.cat BPAIR1)" 0.03 1e-6
near "no spread of PSFs in component 2: undefined" "$(col leak.cat BPAIR2 | grep -c nan)" 1 0
fails "leakage without the PSF's ellipticity" 1 fom --against psf a0 a1

# the best scale: spread 1/theta with n ~ exp(-(theta/.1)^2): y = theta^-1 / n is least at theta = .1/sqrt 2
for x in 0.04 0.05 0.06 0.07 0.08 0.09 0.10; do
    for g in "0.05 0" "-0.05 0" "0 0.05" "0 -0.05"; do shapes "opt$x $g" opt $x $g 1 "$(awk "BEGIN { print int(3000 * exp(-($x / .1) ^ 2)) }")" 5; done; done
ok "best scale" fom opt0.*" "* -q -o opt.cat
between "best scale, arcsec" "$(col opt.cat OPTSCALE | head -1)" 0.066 0.076
between "its error" "$(col opt.cat OPTSCALEERR | head -1)" 0.0001 0.01
near "reference scale: no error against itself" "$(col opt.cat LOGDCBS | tail -1)" 0 0
between "error of another against it" "$(col opt.cat LOGDCBS | sed -n 4p)" 0.001 0.2
fom opt0.*" "* -q -s 2 -o opts.cat; ok "another seed, another error" test "$(col opt.cat LOGDCBS | head -1)" != "$(col opts.cat LOGDCBS | head -1)"
ok "three scales are too few" fom opt0.04* opt0.07* opt0.10* -q -o opt3.cat
near "three scales: undefined" "$(col opt3.cat OPTSCALE | sort -u | grep -c nan)" 1 0
ok "five scales, least at the end of the range" fom opt0.04* opt0.05* opt0.06* opt0.07* -q --draws 0 -o opt4.cat
near "least at the end: a minimum beyond it is not given" "$(col opt4.cat OPTSCALE | head -1 | awk '{ print ($1 == "nan" || $1 < 0.07) }')" 1 0

# opposite noise: the same sky, other pairs
for k in 0 1 4; do sed 's/^# Keyword: AREA = 4/&\n# Keyword: MIRROR = 1/' a$k >mirror$k; done
ok "a sky under opposite noises" fom a0 a1 a4 mirror? -q -o mirror.cat
near "opposite noises: one sky" "$(col mirror.cat NFIELDS)" 1 0
near "opposite noises: pairs of both" "$(col mirror.cat NPAIR1)" 800 0
near "no error by skies with one" "$(col mirror.cat B1JK | grep -c nan)" 1 0

# undefined, exit 0, a warning
shapes few0 few 0.10 0 0 1 3 9; shapes few1 few 0.10 0.05 0 1 3 9
ok "three galaxies" fom few0 few1 -o few.cat
grep -q undefined cmd.err && pass "three galaxies: warning says undefined" || fail "no warning: $(cat cmd.err)"
near "three galaxies: G is nan" "$(col few.cat G | grep -c nan)" 1 0
grep '^#' few0 >none0; ok "no survivor" fom none0 -o none.cat
grep -q 'none0: no galaxy is left' cmd.err && grep -q 'undefined.*SIGMA_GAMMA' cmd.err && pass "no survivor: warnings" || fail "no survivor: no warning: $(cat cmd.err)"
near "no survivor: everything else is nan, nothing infinite" "$(paste -d' ' <(col none.cat G) <(col none.cat SIGMA_E) <(col none.cat SIGMA_EERR) <(col none.cat STDERR) <(col none.cat N_EFF) <(col none.cat LOGDC) <(col none.cat LOGDCBS) <(col none.cat KURT1) | tr ' ' '\n' | grep -cx nan)" 8 0
near "the table says it too" "$(fom -q --table none0 | tail -1 | grep -o undefined | wc -l)" 13 0
near "no survivor: n_gal 0" "$(col none.cat N_GAL)" 0 0
fom few0 few1 --table -q >few.txt; grep -q undefined few.txt && pass "undefined in the table" || fail "no undefined in $(cat few.txt)"
sed 's/ 0.05 / nan /' a4 >nan4; ok "rows without an error" fom a0 nan4 -o nan.cat
fails "no operand reads standard input, here empty" 1 fom
fails "--reference-set that no catalogue has" 1 fom a0 a1 --reference-set nosuch -o nosuch.cat
if [ -e nosuch.cat ]; then fail "it left an output"; else pass "and no output"; fi
ok "a reference scale that is not there: undefined, with a warning" fom a0 a1 --reference-set sim1 --reference-scale 0.3 -o noscale.cat
grep -q LOGDC cmd.err && near "LOGDC is nan" "$(col noscale.cat LOGDC | grep -c nan)" 1 0 || fail "no warning names LOGDC: $(cat cmd.err)"
awk '/^#/ { print; next } { $4 = 0.1; $5 = 0.1; print }' a0 >flat0; ok "zero variance" fom flat0 -o flat.cat
near "zero variance: no kurtosis" "$(col flat.cat KURT1 | grep -c nan)" 1 0
grep -q undefined cmd.err && pass "zero variance: a warning" || fail "zero variance: no warning"
for k in 1 2; do sed 's/SHEAR1 = .*/SHEAR1 = 0.05/' a1 >equal$k; done; ok "all-equal shears" fom equal1 equal2 -o equal.cat
near "all-equal shears: no slope" "$(paste <(col equal.cat B1) <(col equal.cat BPAIR1) | grep -c 'nan.*nan')" 1 0
grep -q 'undefined.*B1' cmd.err && pass "all-equal shears: a warning" || fail "all-equal shears: no warning"
fails "no such file" 1 fom a0 nothere
grep -v SHEAR1 a0 >nog; fails "no SHEAR1" 1 fom nog
sed 's/ P11 / P99 /' a0 >nop; fails "no response column" 1 fom nop
head -c 4000 a0 >cut; sed -i '$ s/ [^ ]*$//; $ s/ [^ ]*$//' cut; fails "truncated catalogue" 1 fom cut
fails "output is an input" 1 fom a0 -o a0
