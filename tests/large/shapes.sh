# A million objects through rrgshape, cutcat and fom: time linear in the objects, memory constant or
# (fom) linear and within what the man pages say, --max-memory kept.
psfgen -o psf.fits
galgen --field 30 --models m.txt -o s.txt
simage s.txt --models m.txt -p psf.fits -x 0.1 | addnoise --depth 27.7 -o f.fits
detect -q f.fits --threshold 1.5 --threshold-noise pixel -o f.cat
n=$(grep -vc '^#' f.cat)
for rows in 100000 1000000; do
    { grep '^#' f.cat; grep -v '^#' f.cat | awk -v n="$n" -v rows=$rows '{ r[NR] = $0 } END { for (i = 0; i < rows; i++) print r[i % n + 1] }'; } >in.$rows
done
# run NAME ROWS COMMAND...: sets tNAME_ROWS (processor, ms) and mNAME_ROWS (KiB)
run() {
    local name=$1 rows=$2 kib ms; shift 2
    if peak peak.txt "$@" >cmd.out 2>cmd.err; then pass "$name, $rows objects: KiB, CPU ms, wall ms: $(cat peak.txt)"; else fail "$name, $rows objects: $(tail -1 cmd.err)"; fi
    read -r kib ms _ <peak.txt
    eval "t${name}_$rows=$ms m${name}_$rows=$kib"
}
for rows in 100000 1000000; do
    run rrgshape $rows rrgshape -q f.fits in.$rows --psf psf.fits -o out.$rows
    run cutcat $rows cutcat -q out.$rows --mark -o use.$rows.fits
    near "rows of the last" "$(cutcat use.$rows.fits --check 2>&1 | awk '{ print $3 }')" $rows 0
done
# images of 1000 x 1000 places 3 arcsec apart, under +-0.05
for rows in 100000 1000000; do
    for g in -0.05 0 0.05; do
        awk -v g=$g -v n=$rows 'BEGIN { srand(1); printf "# Keyword: SETNAME = big\n# Keyword: PIXSCALE = 0.1\n# Keyword: SHEAR1 = %s\n# Keyword: SHEAR2 = 0\n# Keyword: AREA = 2500\n", g
            print "# NUMBER X_IMAGE Y_IMAGE E1 E2 E1ERR E2ERR P11 P22"
            for (i = 0; i < n; i++) printf "%d %d %d %.6f %.6f 0.05 0.05 1.25 1.25\n", i + 1, 30 * (i % 1000), 30 * int(i / 1000), 0.5 * (rand() - 0.5) + 1.25 * 0.95 * g, 0.5 * (rand() - 0.5) }' >g$g.$rows
    done
    run fom $rows fom -q --draws 20 g-0.05.$rows g0.$rows g0.05.$rows -o fom.$rows
    near "slope put in" "$(col fom.$rows BPAIR1)" 0.95 1e-5
done
for rows in 100000 1000000; do
    run plain $rows rrgshape -q f.fits in.$rows --psf psf.fits --plain out.fits --region out.reg -o out.$rows.fits
done
# linear NAME: time of the two runs
linear() {
    local t=t$1_1000000 u=t$1_100000
    between "$1: time of ten times as many objects over ten times the time" "$(awk -v t="${!t}" -v u="${!u}" 'BEGIN { print t / 10 / u }')" 0.3 1.4
}
linear rrgshape; linear plain; linear fom
# 32 MiB and 4 bytes for each of 300 x 300 pixels
for k in rrgshape plain; do
    m=m${k}_1000000 l=m${k}_100000
    between "$k: KiB for a million objects" "${!m}" 1000 33120
    between "$k: bytes for one object more" "$(awk -v a="${!m}" -v b="${!l}" 'BEGIN { print 1024 * (a - b) / 900000 }')" -5 5
done
between "cutcat: KiB for a million objects" "$mcutcat_1000000" 1000 32768
between "fom: bytes for one object more" "$(awk -v a="$mfom_1000000" -v b="$mfom_100000" 'BEGIN { print 1024 * (a - b) / 900000 }')" 50 420
# refused before the memory is taken
fails "--max-memory 30M: fom" 1 fom g0.1000000 -o no --max-memory 30M
peak peak.txt fom g0.1000000 -o no --max-memory 30M >cmd.out 2>cmd.err
between "its memory, KiB" "$(cut -d' ' -f1 peak.txt)" 1000 60000
if [ -e no ]; then fail "a refused run left an output"; else pass "nothing was written"; fi
