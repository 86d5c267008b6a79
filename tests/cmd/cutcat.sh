# cutcat: the paper's cuts, counts, marks; bad input.
cat >in.cat <<'T'
# Keyword: DSTAR = 0.6
# Keyword: DSTAROWN = 0.9
# Keyword: SHEAR1 = 0.05
# NUMBER E1 E2 D_RRG D_PSF FLUX_AUTO FLUXERR_AUTO STAR_PROB FLAGS_RRG MAG_AUTO
1 0.1 0.2 1.2 0.7 100 5 0.1 0 25.5
2 0.1 0.2 1.2 0.7 100 5 0.95 0 20
3 0.8 0.6 1.2 0.7 100 5 0.1 64 25
4 nan nan 1.2 0.7 100 5 0.1 32 25
5 0.1 0.2 1.046 0.7 100 5 0.1 0 25
6 0.1 0.2 1.047 0.7 100 5 0.1 0 25
7 0.1 0.2 nan 0.7 100 5 0.1 1 25
8 0.1 0.2 1.2 0.7 49 5 0.1 0 26.5
9 0.1 0.2 1.3 0.7 100 5 0.1 8 25
T
ok "default cuts" cutcat in.cat -o use.cat -v
near "one line on stderr with the counts" "$(wc -l <cmd.err)" 1 0
near "rows used" "$(col use.cat NUMBER | tr '\n' ' ' | tr -d ' ')" 16 0
i=0
for k in "NDET 9" "NSTARCUT 8" "NELLCUT 6" "NSIZECUT 3" "NSNRCUT 2" "NUSED 2" "DSTAR 0.6" "SHEAR1 0.05"; do
    set -- $k; near "keyword $1" "$(key use.cat "$1")" "$2" 0
done
near "d_cut = 1.2 sqrt(.36 + .4)" "$(key use.cat DCUT)" "$(awk 'BEGIN { printf "%.17g", 1.2 * sqrt(.76) }')" 1e-15
cutcat in.cat --mark -o mark.cat
near "--mark keeps all rows" "$(col mark.cat NUMBER | wc -l)" 9 0
near "column CUT" "$(col mark.cat CUT | tr '\n' ' ' | tr -d ' ')" "012640484" 0
cutcat mark.cat --mark -o again.cat
near "marking again gives the same" "$(paste <(col mark.cat CUT) <(col again.cat CUT) | awk '$1 != $2' | wc -l)" 0 0
cutcat in.cat --size-floor 0 -o f0.cat; near "without the 0.4: object 5 is used too" "$(key f0.cat NUSED)" 3 0
cutcat in.cat --dstar own -o own.cat; near "d* with own widths: limit 1.317" "$(key own.cat NUSED)" 0 0
cutcat in.cat --dstar each -o each.cat; near "d* at each object's width: limit 1.132" "$(col each.cat NUMBER | tr -d '\n')" 1 0
cutcat in.cat --where 'MAG_AUTO<25.2' --where 'NUMBER != 1' -o w.cat; near "--where twice" "$(col w.cat NUMBER | tr -d '\n')" 6 0
cutcat in.cat --snr 0 --star-prob 1 --max-ellipticity 2 --flags 0 -o loose.cat; near "loose cuts leave those with a size and an ellipticity" "$(col loose.cat NUMBER | tr -d '\n')" 123689 0
{ cat in.cat; echo "10 0 0 0.71 0.7 100 5 0.1 0 20"; echo "11 0 0 0.71 0.7 100 5 0.1 0 26"; echo "12 0 0 0.80 0.7 100 5 0.1 0 20"; echo "13 0 0 nan 0.7 100 5 0.1 1 20"; } >loc.cat
cutcat loc.cat --star-locus 23,0.05 --mark -o loc.out
near "--star-locus: bright and of a star's size, nothing else" "$(col loc.out CUT | awk '$1 % 2 { printf "%d ", NR }' | tr -d ' ')" 210 0
near "counted with the stars" "$(key loc.out NSTARCUT)" 11 0
cutcat loc.cat --star-locus 23,0.15 --star-prob 1 --mark -o loc.out
near "a wider locus; stars by it alone" "$(col loc.out CUT | awk '$1 % 2 { printf "%d ", NR }' | tr -d ' ')" 1012 0
fails "--star-locus: two numbers" 2 cutcat loc.cat --star-locus 23
sed 's/MAG_AUTO/MAG/' loc.cat >nomag.cat; fails "--star-locus without magnitudes" 1 cutcat nomag.cat --star-locus 23,0.05
sed 's/ D_PSF / D_OLD /' loc.cat >nopsf.cat; fails "--star-locus without the size of a star" 1 cutcat nopsf.cat --star-locus 23,0.05
cutcat in.cat -s 5 >pipe.cat; cutcat - <in.cat >pipe2.cat; near "pipe: the same rows" "$(diff <(grep -v '^#' pipe.cat) <(grep -v '^#' pipe2.cat) | wc -l)" 0 0
cutcat in.cat -j 2 -o j2.cat; same "threads" use.cat j2.cat
ok "nothing survives" cutcat in.cat --snr 1e6 -o none.cat
near "nothing survives: a header and no row" "$(grep -vc '^#' none.cat)" 0 0
ok "an empty catalogue" cutcat none.cat --snr 0 -o none2.cat
{ printf '# Keyword: DSTAR = 0.9\n# WIDTH\n1\n'; } >stars.rrg
cutcat in.cat --stars stars.rrg -o s.cat; near "--stars wins over the catalogue" "$(key s.cat DSTAR)" 0.9 0
# d* is in pixels: both files must tell the same ones, or neither
scaled() { sed "1i # Keyword: PIXSCALE = $2" "$1"; }
scaled in.cat 0.1 >in.1; scaled stars.rrg 0.1 >stars.1; scaled stars.rrg 0.05 >stars.05; scaled stars.rrg nan >stars.nan
ok "stars of the same pixels" cutcat in.1 --stars stars.1 -o s1.cat
near "their d*" "$(key s1.cat DSTAR)" 0.9 0
fails "stars of other pixels" 1 cutcat in.1 --stars stars.05
fails "stars that do not say of which pixels" 1 cutcat in.1 --stars stars.rrg
fails "stars whose pixels are no number" 1 cutcat in.1 --stars stars.nan
fails "a catalogue that does not say of which pixels" 1 cutcat in.cat --stars stars.1
cutcat in.cat --columns MAG_AUTO,NUMBER -o cols.cat
near "--columns: in the order of the input" "$(grep '^# NUMBER' cols.cat | tail -1 | grep -cx '# NUMBER MAG_AUTO')" 1 0
near "--columns: the same rows" "$(col cols.cat NUMBER | tr -d '\n')" 16 0
cutcat in.cat --columns NUMBER --mark -o cols.cat; near "--columns with --mark" "$(col cols.cat CUT | tr -d '\n')" "012640484" 0
fails "--columns: no such column" 1 cutcat in.cat --columns NUMBER,MAG
fails "star file without DSTAR" 1 cutcat in.cat --stars stars.rrg --dstar own
grep -v DSTAR in.cat >nod.cat; fails "no d* anywhere" 1 cutcat nod.cat
cutcat in.cat --where 'FLUX_AUTO/FLUXERR_AUTO < 15 || NUMBER >= 4 && NUMBER<7 && !(FLAGS_RRG&32 = 32)' --only-where -o expr.cat
near "--where with arithmetic, bits and logic" "$(col expr.cat NUMBER | tr -d '\n')" 568 0
cutcat in.cat --only-where --where 'hypot(E1,E2) < 0.5' --where 'D_RRG > 1.5*D_PSF' -o expr.cat; near "columns against each other; a missing value fails" "$(col expr.cat NUMBER | tr -d '\n')" 1289 0
fails "malformed condition" 2 cutcat in.cat --where 'MAG_AUTO<'
fails "a condition without a comparison" 2 cutcat in.cat --where 'MAG_AUTO+1'
fails "a column that is not there" 1 cutcat in.cat --where 'MAG_AUTO<x'
fails "unknown column" 1 cutcat in.cat --where 'MAGAUTO<3'
sed 's/D_RRG/D_OLD/' in.cat >bad.cat; fails "no shapes" 1 cutcat bad.cat
fails "missing file" 1 cutcat nothere.cat
head -n 6 in.cat >cut.cat; printf "3 0.1 0.2 1" >>cut.cat; fails "truncated row" 1 cutcat cut.cat
fails "output is the input" 1 cutcat in.cat -o in.cat
fails "output is the star file" 1 cutcat in.cat --stars stars.rrg -o stars.rrg

# a second run keeps the detector's count, star files keep what their catalogue knew
psfgen --pupil-grid 64 --size 32 -o psf.fits
galgen --field 30 --stars -n 49 | simage - -p psf.fits -x 0.1 --size 300,300 --set s | addnoise --depth 27.7 -o st.fits
detect st.fits -o st.cat
rrgshape --stars-only st.fits st.cat -o st.rrg
if [ -n "$(key st.rrg AREA)" ] && [ "$(key st.rrg AREA)" = "$(key st.cat AREA)" ]; then pass "AREA travels into the star file"; else fail "AREA of the star file: $(key st.rrg AREA)"; fi
rrgshape st.fits st.cat --psf psf.fits -o all.rrg
cutcat all.rrg --stars st.rrg --star-prob 1 --size-factor 0 --size-floor 0 -o once.use
cutcat once.use --stars st.rrg --snr 50 -o twice.use
near "NDET after two runs" "$(key twice.use NDET)" "$(grep -vc '^#' all.rrg)" 0

# any comparison on any catalogue, with nothing else asked of it
printf '%s\n' '# ID NAME X' '1 a 1.5' '2 b 2.5' '3 c nan' '4 b 4' >any.txt
fails "a catalogue without shapes" 1 cutcat any.txt --where 'X>2' -o any.out
ok "--only-where" cutcat any.txt --only-where --where 'X>2' --where 'NAME=b' -o any.out
fails "--only-where and another cut" 2 cutcat any.txt --only-where --snr 3
same "keeps the rows that hold" <(col any.out ID) <(printf '2\n4\n')
ok "--only-where on its result" cutcat any.out --only-where --where 'X<3' --mark -o any.two
same "marks" <(col any.two CUT) <(printf '0\n16\n')

# the 0.4 on a field of galaxies: what it removes lies between 1.2 d* and 1.2 sqrt(d*^2 + 0.4)
galgen --field 50 --models m.txt | simage - --models m.txt -p psf.fits -x 0.1 --set g | addnoise --depth 27.7 -o g.fits
detect -q g.fits --threshold 1.5 --threshold-noise pixel -o g.cat; rrgshape -q g.fits g.cat --psf psf.fits -o g.rrg
cutcat g.rrg -o with.use; cutcat g.rrg --size-floor 0 -o without.use
with=$(key with.use NUSED) without=$(key without.use NUSED)
between "more are used without the 0.4 ($with with it)" "$without" $((with * 103 / 100 + 1)) $((with * 3))
near "d_cut without it: 1.2 d*" "$(awk -v a="$(key without.use DCUT)" -v b="$(key without.use DSTAR)" 'BEGIN { print a / b }')" 1.2 1e-9
near "the others lie between both limits" "$(paste <(col without.use NUMBER) <(col without.use D_RRG) | awk -v lo="$(key without.use DCUT)" -v hi="$(key with.use DCUT)" '$2 >= lo && $2 < hi' | wc -l)" $((without - with)) 0
near "in the star and ellipticity cuts nothing changes" "$(key without.use NELLCUT)" "$(key with.use NELLCUT)" 0
near "|e| > 1 never counts" "$(paste <(col with.use E1) <(col with.use E2) | awk '$1 * $1 + $2 * $2 >= 1' | wc -l)" 0 0
