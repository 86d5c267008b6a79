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

# pixels of what scale: a catalogue or stars of another image's pixels, and stars that do not say of which
scaled() { sed "s/^\(# Keyword: PIXSCALE = \).*/\1$2/" "$1"; }
bare() { grep -v "^# Keyword: PIXSCALE" "$1"; }
scaled cat.txt 0.05 >cat.05; bare cat.txt >cat.none; scaled stars.rrg 0.05 >stars.05; bare stars.rrg >stars.none; bare scat.txt >scat.none; scaled scat.txt 0.05 >scat.05
perl -pe "s/PIXSCALE= /HIDDEN  = /; s/CTYPE1  /CTYPX1  /; s/CTYPE2  /CTYPX2  /" noisy.fits >none.fits
if cmp -s none.fits noisy.fits; then fail "none.fits has still its scale"; fi
fails "a catalogue of other pixels" 1 rrgshape noisy.fits cat.05 --psf none
fails "stars' catalogue of other pixels" 1 rrgshape noisy.fits cat.txt --stars stars.fits,scat.05
fails "star moments of other pixels" 1 rrgshape noisy.fits cat.txt --stars stars.05
fails "star moments that do not say of which pixels" 1 rrgshape noisy.fits cat.txt --stars stars.none
fails "star moments, and an image that does not say of which pixels" 1 rrgshape none.fits cat.none --fixed-width 2 --stars stars.rrg
fails "stars' image, and one that does not say of which pixels" 1 rrgshape none.fits cat.none --fixed-width 2 --stars stars.fits,scat.txt
ok "nobody tells: moments in pixels" rrgshape none.fits cat.none --fixed-width 2 --stars stars.none -o pixels.txt
rrgshape noisy.fits cat.txt --fixed-width 2 --stars stars.rrg -o known.txt
same "and they are the same" <(col pixels.txt E1) <(col known.txt E1)
rrgshape none.fits cat.none -x 0.1 --fixed-width 2 --stars stars.rrg -o known.two; same "or --pixscale tells" <(col known.two E1) <(col known.txt E1)
# Source Extractor's catalogues have no PIXSCALE; the image knows it
rrgshape noisy.fits cat.none --stars stars.fits,scat.none -o known.one; rrgshape noisy.fits cat.txt --stars stars.fits,scat.txt -o known.two
same "catalogues without PIXSCALE are of their image's pixels" <(col known.one E1) <(col known.two E1)

# a column HISTORY: the text written of it could not be read
printf '# A B\n1 2\n' >a.txt; cutcat --only-where a.txt -o a.fits; perl -pe "s/'A       '/'HISTORY '/" a.fits >history.fits
fails "a FITS table with a column HISTORY" 1 cutcat --only-where history.fits

# numbers of images, PSFs and FITS tables: the same
spoilt() { # FILE KEYWORD VALUE: every card of that name, else the first HISTORY, holds the value
    perl -e 'local $/; binmode STDIN; $_ = <STDIN>; my ($k, $v) = @ARGV; my $new = sprintf("%-80s", sprintf("%-8s= %20s", $k, $v)); my $n = 0;
        for (my $i = 0; $i < length; $i += 80) { if (substr($_, $i, 10) eq sprintf("%-8s= ", $k)) { substr($_, $i, 80) = $new; $n++ } }
        for (my $i = 0; !$n && $i < length; $i += 80) { if (substr($_, $i, 8) eq "HISTORY ") { substr($_, $i, 80) = $new; $n++ } } print' "$2" "$3" <"$1"
}
number() { # KEYWORD VALUE FILE COMMAND...: with BAD the spoilt file
    local k=$1 v=$2; spoilt "$3" "$k" "$v" >bad.fits; shift 3
    fails "$1, $k = $v" 1 "${@/BAD/bad.fits}" -o made
    if grep -q "bad.fits.*$k" cmd.err && [ ! -e made ]; then pass "file and keyword are told"; else fail "$1, $k: $(cat cmd.err)"; fi
    rm -f made
}
for k in SHEAR1 SHEAR2 CHDIFF EXPNUM SKYSUB PSFFWHM; do number $k 0,5 noisy.fits detect BAD; done
number SKYSUB 1 noisy.fits detect BAD
number EXPNUM 1.5 true.fits addnoise --depth 27 BAD
number SHEAR1 0,05 noisy.fits rrgshape BAD cat.txt --psf none
number UCUT 3,7 psf.fits simage scene.txt --models models.txt -x 0.1 -p BAD
perl "$TOP/tests/fits.pl" make plain.fits 33 33 'exp(-(($x-16)**2+($y-16)**2)/18)' 'PIXELSCL=                 0.02' 'CRPIX1  =                 17.0' 'CRPIX2  =                 17.0' 'HISTORY a PSF'
ok "a plain PSF is read" simage scene.txt --models models.txt -x 0.1 -p plain.fits -o made; rm -f made
for k in PIXELSCL CRPIX1 CRPIX2 UCUT; do number $k 1,7 plain.fits simage scene.txt --models models.txt -x 0.1 -p BAD; done
number PIXELSCL 0,02 plain.fits addnoise --depth 27 --depth-definition point5 -p BAD true.fits
printf '# A B\n1 2.5\n' >a.txt; cutcat --only-where a.txt -o a.fits
for k in TSCAL1 TZERO1 TNULL1 TSCAL2 TZERO2; do number $k 1,5 a.fits cutcat --only-where BAD; done
number TSCAL2 0 a.fits cutcat --only-where BAD
spoilt a.fits TSCAL2 2.0D0 >scaled.fits; cutcat --only-where scaled.fits -o scaled.txt
near "TSCAL2 = 2.0D0 doubles the column" "$(col scaled.txt B)" 5 0
cutcat --only-where models.txt -o m.fits; n=$(($(grep -m1 '^# ID' models.txt | wc -w) - 1))
number TNULL$n 1 m.fits galgen -n 2 --library BAD
number THEAP x m.fits galgen -n 2 --library BAD

# a PSF: what tells its sampling must agree and be of square pixels; an option that the OTF would not heed; its flux
F="perl $TOP/tests/fits.pl"
told() { if grep -q "$1" cmd.err; then pass "told"; else fail "not told '$1': $(cat cmd.err)"; fi; }
P='exp(-(($x-16)**2+($y-16)**2)/18)/(18*atan2(0,-1))'
S="simage scene.txt --models models.txt -x 0.1"
psf() { $F make p.fits 33 33 "$P" "$@"; }
tan() { # XSIDE YSIDE CARD...: a PSF with a WCS of these pixels, arcsec
    local a b; a=$(awk -v s="$1" 'BEGIN { printf "%.14g", -s / 3600 }'); b=$(awk -v s="$2" 'BEGIN { printf "%.14g", s / 3600 }'); shift 2
    psf "CTYPE1  = 'RA---TAN'" "CTYPE2  = 'DEC--TAN'" "CRPIX1  =                 17.0" "CRPIX2  =                 17.0" "CRVAL1  =                150.0" "CRVAL2  =                  2.2" \
        "CD1_1   = $a" "CD1_2   =                  0.0" "CD2_1   =                  0.0" "CD2_2   = $b" "$@"
}
for c in "PIXSCALE=                 0.05" "GS_SCALE=                0.021"; do
    psf "PIXELSCL=                 0.02" "$c"
    fails "PIXELSCL 0.02 beside $c" 1 $S -p p.fits -o made; told "differ: give --psf-scale"
    fails "addnoise" 1 addnoise --depth 27 --depth-definition point5 -p p.fits true.fits -o made; told "differ: give --psf-scale"
    ok "and with --psf-scale" $S -p p.fits --psf-scale 0.02 -o made
done
psf "PIXELSCL=                 0.02" "PIXSCALE=           0.02000001"; ok "nearly the same are the same" $S -p p.fits -o made
tan 0.02 0.02; ok "the sampling of a WCS" $S -p p.fits -o wcs.fits
psf "PIXELSCL=                 0.02"; $S -p p.fits -o key.fits; near "is that of the keyword" "$(pix diff wcs.fits key.fits | cut -d' ' -f1)" 0 1e-6
rm -f made
tan 0.02 0.02 "PIXELSCL=                 0.01"; fails "PIXELSCL 0.01 beside a WCS of 0.02" 1 $S -p p.fits -o made; told "WCS's 0.02 arcsec differ"
tan 0.02 0.03; fails "a PSF of rectangular pixels" 1 $S -p p.fits -o made; told "not square"
fails "psfgen --from one" 1 psfgen --from p.fits -o made; told "not square"
fails "--psf-scale with an OTF" 1 $S -p psf.fits --psf-scale 0.05 -o made; told "the extension OTF is read"
fails "psfgen --from --psf-scale with an OTF" 1 psfgen --from psf.fits --psf-scale 0.05 -o made; told "the extension OTF is read"
ok "but with its image" $S -p "psf.fits[0]" --psf-scale 0.05 -o made; rm -f made
psf "PIXELSCL=                 0.02"; ok "a PSF of flux 1" $S -p p.fits -o made; [ -s cmd.err ] && fail "warned: $(cat cmd.err)" || pass "no word"
$F make half.fits 33 33 "0.5*$P" "PIXELSCL=                 0.02"; ok "a PSF of flux 0.5" $S -p half.fits -o made; told "its flux is 0.5, not 1"
ok "normalised" $S -p half.fits --psf-normalise -o made; [ -s cmd.err ] && fail "warned: $(cat cmd.err)" || pass "no word"

# images of pixels that are not square: told to 1.5, as HST's cameras have them, refused beyond
rect() { # RATIO: noisy.fits whose pixels are higher than wide
    spoilt noisy.fits CD1_1 "$(awk -v r="$1" 'BEGIN { printf "%.14g", -0.1 / 3600 / sqrt(r) }')" >one.fits
    spoilt one.fits CD2_2 "$(awk -v r="$1" 'BEGIN { printf "%.14g", 0.1 / 3600 * sqrt(r) }')" >rect.fits
}
rect 1.005; ok "pixels of 1 : 1.005" detect rect.fits -o made; [ -s cmd.err ] && fail "warned: $(cat cmd.err)" || pass "no word"
rect 1.12; ok "pixels of 1 : 1.12" detect rect.fits -o made; told "by a factor 1.120"
ok "rrgshape" rrgshape rect.fits cat.txt --psf none -o made; told "by a factor 1.120"; rm made
rect 4; fails "pixels of 1 : 4" 1 detect rect.fits -o made; told "by a factor 4"
fails "rrgshape" 1 rrgshape rect.fits cat.txt --psf none -o made; told "by a factor 4"
spoilt true.fits CD1_1 -1.3e-5 >one.fits; spoilt one.fits CD2_2 5.934995e-5 >rect.fits
fails "depth of a point in them" 1 addnoise --depth 27 --depth-definition point5 -p p.fits rect.fits -o made; told "by a factor"
ok "that of an area needs no squares" addnoise --depth 27 rect.fits -o made
ok "drizzle makes squares of them" drizzle rect.fits -x 0.1 --size 120,120 -o made

# units of a list's columns: another than the column's is refused, spellings of its own are not; a logical is no number
list() { # COLUMN UNIT: a list with that unit
    printf '# Column 1: DX [%s,f64] place along x\n# Column 2: DY [%s,f64] place along y\n# Column 3: FLUX [%s,f64] electrons per second\n# Column 4: TYPE [,str8] kind of it\n# DX DY FLUX TYPE\n0.5 0.5 100 star\n' "$1" "$1" "$2" >list.txt
}
I="simage list.txt -x 0.1 --size 32,32 -o made"
for u in arcsec Arcseconds '"' ''; do list "$u" electron/s; ok "DX in '$u'" $I; done
for u in 'electrons/s' 'e-/s' 'electron s-1'; do list arcsec "$u"; ok "FLUX in '$u'" $I; done
rm made
for u in arcmin pixel deg mas; do list "$u" electron/s; fails "DX in $u" 1 $I; told "DX is in '$u', not in arcsec"; done
for u in mag adu/s electron Jy; do list arcsec "$u"; fails "FLUX in $u" 1 $I; told "FLUX is in '$u', not in electron/s"; done
list arcsec electron/s; cutcat --only-where list.txt -o list.fits
perl -pe "s/TUNIT1  = 'arcsec  '/TUNIT1  = 'arcmin  '/" list.fits >arcmin.fits
fails "DX in arcmin, in FITS" 1 ${I/list.txt/arcmin.fits}; told "DX is in 'arcmin'"
perl -e 'print map { sprintf "%-80s", $_ } "SIMPLE  =                    T", "BITPIX  =                    8", "NAXIS   =                    0", "END"; print " " x 2560;
    my @c = ("XTENSION= \x27BINTABLE\x27", "BITPIX  =                    8", "NAXIS   =                    2", "NAXIS1  =                   21", "NAXIS2  =                    1", "PCOUNT  =                    0",
    "GCOUNT  =                    1", "TFIELDS =                    4", "TTYPE1  = \x27DX      \x27", "TFORM1  = \x27L       \x27", "TTYPE2  = \x27DY      \x27", "TFORM2  = \x27D       \x27",
    "TTYPE3  = \x27FLUX    \x27", "TFORM3  = \x27D       \x27", "TTYPE4  = \x27TYPE    \x27", "TFORM4  = \x274A      \x27", "END");
    print map({ sprintf "%-80s", $_ } @c), " " x (2880 - 80 * @c); my $d = "T" . pack("d>d>", 0.5, 100) . "star"; print $d, "\0" x (2880 - length $d)' >logical.fits
fails "DX as a logical" 1 ${I/list.txt/logical.fits}; told "DX must hold numbers"
perl -pe "s/TFORM1  = 'L       '/TFORM1  = 'B       '/" logical.fits >bytes.fits; ok "a byte is a number" ${I/list.txt/bytes.fits}
sed '/^#.*BETA/s/arcsec/pixel/' models.txt >pixels.txt
if cmp -s models.txt pixels.txt; then fail "pixels.txt has still arcsec"; fi
rm -f made; fails "BETA in pixels" 1 simage scene.txt --models pixels.txt -x 0.1 -o made; told "BETA is in 'pixel'"
