# Numbers in the headers of catalogues: one that is none ("0,1") is refused by every program that would use it, with file, keyword
# and text, in text and in FITS alike; it used to count as missing, and a default or another keyword was taken.
small_chain
grep -v '^# Keyword: NUSED' cut.txt >use.txt

refused() { # KEYWORD FILE COMMAND...: the file, with a comma in the keyword, in the place of BAD
    local k=$1 f=$2 bad; shift 2
    { echo "# Keyword: $k = 0,1"; grep -v "^# Keyword: $k = " "$f"; } >bad.txt
    cutcat --only-where bad.txt -o text.fits
    perl -pe "s/^.*?\K($k {0,7}= )'0,1     '/\${1}0,1       /s" text.fits >bare.fits
    if cmp -s text.fits bare.fits; then fail "$k: the FITS file has no such card"; fi
    for bad in bad.txt text.fits bare.fits; do
        fails "$1, $k in $bad" 1 "${@/BAD/$bad}" -o made
        if grep -q "$bad.*$k.*0,1" cmd.err && [ ! -e made ]; then pass "$1: file, keyword and text are told"; else fail "$1, $k in $bad: $(cat cmd.err)"; fi
        rm -f made
    done
}
for k in CCDSCALE PIXSCALE SHEAR1 SHEAR2 AREA EPSF2 NDET NSNRCUT MIRROR; do refused $k use.txt fom BAD; done
for k in DSTAR PIXSCALE; do refused $k stars.rrg cutcat shapes.txt --stars BAD; done
refused DSTAROWN stars.rrg cutcat shapes.txt --dstar own --stars BAD
refused DSTAR shapes.txt cutcat BAD
refused PIXSCALE shapes.txt cutcat BAD --stars stars.rrg
refused NUSED cut.txt cutcat BAD --stars stars.rrg
for k in DSTAR DSTARERR DSTARW DSTAROWN PIXSCALE; do refused $k stars.rrg rrgshape noisy.fits cat.txt --stars BAD; done
refused PIXSCALE cat.txt rrgshape noisy.fits BAD --psf none
refused PIXSCALE scat.txt rrgshape noisy.fits cat.txt --stars stars.fits,BAD
refused FIELD scene.txt simage BAD --models models.txt -x 0.1

# "nan" is what our own programs write for a number that they do not have; it is missing, as ever
sed 's/^# Keyword: AREA = .*/# Keyword: AREA = nan/' use.txt >nan.txt
ok "a keyword that is nan is missing" fom nan.txt -o nan.out
for v in 0 -1; do
    sed "s/^# Keyword: CCDSCALE = .*/# Keyword: CCDSCALE = $v/" use.txt >low.txt; fails "CCDSCALE = $v" 1 fom low.txt
    sed "s/^# Keyword: AREA = .*/# Keyword: AREA = $v/" use.txt >low.txt; fails "AREA = $v" 1 fom low.txt
done
sed 's/^# Keyword: PIXSCALE = .*/# Keyword: PIXSCALE = -0.1/' cat.txt >low.txt; fails "PIXSCALE = -0.1 in a catalogue" 1 rrgshape noisy.fits low.txt --psf none
