# rrgshape: reference stamps, field and stars; pipes, formats, hard cases.

# stamp NX NY "x y peak sigma ...": an 8-bit FITS image of round Gaussians (steps of 0.1, centres from 1)
stamp() {
    awk -v nx="$1" -v ny="$2" -v list="$3" 'function card(s) { printf "%-80s", s; cards++ }
    BEGIN { card("SIMPLE  =                    T"); card("BITPIX  =                    8"); card("NAXIS   =                    2")
        card(sprintf("NAXIS1  = %20d", nx)); card(sprintf("NAXIS2  = %20d", ny)); card("PIXSCALE=                  0.1"); card("BSCALE  =                  0.1"); card("BZERO   =                 -0.1")
        card("GAIN    =                  1.0"); card("SHEAR1  =                 0.05"); card("SHEAR2  =                  0.0"); card("SETNAME = '\''test    '\''"); card("END")
        while (cards % 36) card("")
        n = split(list, v, " ")
        for (y = 1; y <= ny; y++) for (x = 1; x <= nx; x++) { s = 0
            for (k = 1; k < n; k += 4) s += v[k + 2] * exp(-((x - v[k]) ^ 2 + (y - v[k + 1]) ^ 2) / (2 * v[k + 3] ^ 2))
            v10 = int(10 * s + 1.5); if (v10 > 255) v10 = 255; printf "%c", v10 }   # awk may not write a byte 0
        for (k = nx * ny; k % 2880; k++) printf " " }'
}
rows() { printf '# NUMBER X_IMAGE Y_IMAGE A_IMAGE B_IMAGE\n'; cat; }

truth=$SHARED/truth/rrg
if [ -d "$truth" ]; then
    for k in field stars; do rows <"$truth/${k}_010.cat" >$k.cat; done
    ok "star-moment file" rrgshape --stars-only "$truth/stars_010.fits" stars.cat -x 0.1 -o stars.rrg
    near "24 widths" "$(col stars.rrg WIDTH | wc -l)" 24 0
    near "smallest width, 0.8 px" "$(col stars.rrg WIDTH | head -1)" 0.8 1e-12
    near "largest width, 1 arcsec" "$(col stars.rrg WIDTH | tail -1)" 10 1e-12
    ok "field against star moments" rrgshape "$truth/field_010.fits" field.cat -x 0.1 --stars stars.rrg --width-min 0.1 --width-max 100 -o field.out
    col field.out FLAGS_RRG >flags
    near "6 of 64 at the edge" "$(grep -cx 4 flags)" 6 0
    worst() { # COLUMN-OF-TRUTH OUR-NAME SCALE: largest difference over a scale column of the truth
        paste <(grep -v '^#' "$truth/field_010.truth" | awk -v c="$1" -v s="$3" '{ print $c, s ? $s : 1 }') <(col field.out "$2") |
            awk '{ d = ($1 - $3) / $2; if (d < 0) d = -d; if (d > w) w = d } END { print w + 0 }'
    }
    # the truth's centroids stop within 1e-6 px and are printed with 8 digits, 5e-6 px at most
    near "field_010.truth: worst X_RRG, px" "$(worst 2 X_RRG 0)" 0 6e-6
    near "field_010.truth: worst Y_RRG, px" "$(worst 3 Y_RRG 0)" 0 6e-6
    for k in "6 JXX_RAW 6" "7 JXY_RAW 6" "8 JYY_RAW 8" "9 JXXXX_RAW 9" "10 JXXXY_RAW 9" "11 JXXYY_RAW 9" "12 JXYYY_RAW 9" "13 JYYYY_RAW 13" "5 S_RRG 5" "14 D_RRG 0" "4 WIDTH 0"; do
        set -- $k
        near "field_010.truth: worst $2" "$(worst "$1" "$2" "$3")" 0 1e-6
    done
    # stars by their mean at 24 widths here, by their median in the truth
    near "field_010.truth: corrected Jxx" "$(worst 18 JXX 18)" 0 2e-2
    rrgshape --stars-only "$truth/stars_010.fits" stars.cat -x 0.1 --star-average median -o median.rrg &&
        rrgshape "$truth/field_010.fits" field.cat -x 0.1 --stars median.rrg --width-min 0.1 --width-max 100 -o field.out
    near "field_010.truth: corrected Jxx, median of the stars" "$(worst 18 JXX 18)" 0 2e-3
    near "field_010.truth: E1, median of the stars" "$(worst 22 E1 0)" 0 2e-3
    ok "stars measured in the same run" rrgshape "$truth/field_010.fits" field.cat -x 0.1 --stars "$truth/stars_010.fits,stars.cat" -o both.out
    rrgshape "$truth/field_010.fits" field.cat -x 0.1 --stars stars.rrg -o file.out
    near "the same E1 as through the file" "$(paste <(col both.out E1) <(col file.out E1) | awk '$1 != $2' | wc -l)" 0 0
    near "keyword DSTAR" "$(key file.out DSTAR)" 0.615 0.002
    ok "stars corrected with themselves" rrgshape "$truth/stars_010.fits" stars.cat -x 0.1 --stars stars.rrg --fixed-width 1.7 -o self.out
    near "mean corrected size of a star at a width between the knots" "$(paste <(col self.out JXX) <(col self.out JYY) | awk '{ s += $1 + $2 } END { print s / NR }')" 0 2e-5

    stampcat() { # NAME X Y: the catalogue of one stamp
        echo "1 $2 $3 1 1" | rows >"$1.cat"
    }
    while read -r name x y w; do
        stampcat $name $x $y
        rrgshape "$truth/$name.fits" $name.cat --psf none --no-recenter --fixed-width $w -o $name.out || fail "$name"
    done < <(awk '!/^#/ { print $1, $3, $4, $5 }' "$truth/truth.txt")
    k=5; worst=0
    for c in S_RRG JXX_RAW JXY_RAW JYY_RAW JXXXX_RAW JXXXY_RAW JXXYY_RAW JXYYY_RAW JYYYY_RAW; do
        k=$((k + 1))
        w=$(awk '!/^#/ { print $1 }' "$truth/truth.txt" | while read -r name; do
            echo "$(awk -v n="$name" -v k=$((k + 2)) '$1 == n { print $k, $9 }' "$truth/truth.txt") $(col $name.out $c)"; done |
            awk -v c=$c '{ s = c ~ /XXXX|YYYY/ ? $1 : c == "S_RRG" ? $1 : 1; d = ($1 - $3) / s; if (d < 0) d = -d; if (d > w) w = d } END { print w + 0 }')
        near "truth group 2 through the program: worst $c" "$w" 0 1e-12
    done
    for h in zero:1 negative:1 noise_only:1 nan_core:2 nan_outside:0 delta_pixel:0 edge:268 tiny_flux:0 sn5:0 pedestal:0; do
        name=hard_${h%:*}
        stampcat $name 21 21
        w=3; [ $name = hard_delta_pixel ] && w=1.5
        rrgshape "$truth/$name.fits" $name.cat --psf none --fixed-width $w -o $name.out || fail "$name"
        near "$name: FLAGS_RRG" "$(col $name.out FLAGS_RRG | awk '{ print $1 - ($1 >= 32 && $1 < 64 ? 32 : 0) }')" "${h#*:}" 0
        if [ "${h#*:}" = 0 ] && grep -v '^#' $name.out | grep -q nan && [ "$(col $name.out FLAGS_RRG)" = 0 ]; then fail "$name: nan without a flag"; else pass "$name: no nan without a flag"; fi
    done
else
    skip "no reference stamps in $truth"
fi

# the rest needs no reference data
stamp 64 64 "20.3 30.1 20 2.5 45 40 15 2" >im.fits
printf '1 20 30 2.5 2.5\n2 45.2 40.1 2 2\n3 -50 3 1 1\n4 nan 3 1 1\n5 30 30 nan -1\n' | rows >im.cat
ok "no correction" rrgshape im.fits im.cat --psf none -o im.out
near "Jxx of a Gaussian of 2.5 px under w = 3.75 px" "$(col im.out JXX_RAW | head -1)" 4.327 0.01
near "centroid, first pixel is 1" "$(col im.out X_RRG | head -1)" 20.3 0.01
near "position off the image: NOFLUX, EDGE" "$(col im.out FLAGS_RRG | sed -n 3p)" 5 0
near "position not a number: NOFLUX" "$(col im.out FLAGS_RRG | sed -n 4p)" 1 0
near "size not a number: smallest width" "$(col im.out WIDTH | sed -n 5p)" 1 0
near "shear of the image travels" "$(key im.out SHEAR1)" 0.05 0
near "all input columns are kept" "$(col im.out A_IMAGE | head -1)" 2.5 0
rrgshape im.fits im.cat --psf none -j 2 -o two.out; same "one and two threads" im.out two.out
rrgshape im.fits im.cat --psf none >pipe.out; same "standard output" im.out pipe.out
ok "--region" rrgshape im.fits im.cat --psf none --region im.reg -o reg.out
near "the first object's ellipse: 2 sqrt(Jxx) = 4.16" "$(grep -m1 '^ellipse(20\.[23]' im.reg | cut -d, -f3)" 4.16 0.02
near "one for each with a position that is a number" "$(grep -c '^ellipse' im.reg)" 4 0
near "red where there is a flag" "$(grep -c 'color=red text' im.reg)" "$(paste <(col reg.out FLAGS_RRG) <(col reg.out X_RRG) | grep -v nan | awk '$1' | wc -l)" 0
fails "--region is the output" 2 rrgshape im.fits im.cat --psf none --region reg.out -o reg.out
stamp 64 64 "27 30 20 2" >map.fits; cp map.fits map.kept
for o in im.cat map.fits; do
    fails "--region is an input, $o, by its name" 2 rrgshape im.fits im.cat --psf none --weight map.fits --segmentation map.fits --region $o -o reg.out
    ln -f $o one.reg
    fails "--region is an input, $o, by another name" 1 rrgshape im.fits im.cat --psf none --weight map.fits --segmentation map.fits --region one.reg -o reg.out
    rm one.reg
done
same "and stays" map.fits map.kept
printf '1 1e300 30 1e300 1e300\n2 20 30 2.5 2.5\n' | rows >far.cat
ok "--region of a position beyond everything" rrgshape im.fits far.cat --psf none --region far.reg -o far.out
if LC_ALL=C grep -vqxE '#.*|global.*|image|ellipse\([-0-9.,]*\) # (color=red )?text=\{[0-9]+\}' far.reg; then fail "the region file has other lines: $(head -c 400 far.reg)"; else pass "ellipses and nothing else"; fi
near "one ellipse for the other" "$(grep -c '^ellipse' far.reg)" 1 0
psfgen --size 64 -o p.fits
ok "--plain" rrgshape im.fits im.cat --psf p.fits --plain plain.out -o exact.out
rrgshape im.fits im.cat --psf p.fits -o exact.one; rrgshape im.fits im.cat --psf p.fits --fourth plain --psf-correction first -o plain.one
for f in exact plain; do
    for w in out one; do grep -v '^# HISTORY' $f.$w >$f.$w.rows; done
    same "--plain: the $f catalogue is that of a run of its own" $f.out.rows $f.one.rows
done
ok "and they differ" test "$(col exact.out E1 | head -1)" != "$(col plain.out E1 | head -1)"
fails "--plain is the output" 2 rrgshape im.fits im.cat --psf none --plain reg.out -o reg.out
fails "--plain is --region" 2 rrgshape im.fits im.cat --psf none --plain reg --region reg -o reg.out
fails "--plain is an input" 1 rrgshape im.fits im.cat --psf none --plain im.cat -o reg.out
fails "--plain with --stars-only" 2 rrgshape im.fits im.cat --stars-only --plain a.out -o reg.out
awk 'BEGIN { for (i = 1; i <= 5000; i++) print i, 20, 30, 2.5, 2.5 }' | rows >many.cat
ok "3 MB are enough for any number of objects" rrgshape im.fits many.cat --psf none --plain plain.out --max-memory 3M -o reg.out
fails "1.5 MB are not" 1 rrgshape im.fits many.cat --psf none --max-memory 1500K -o reg.out
rrgshape - im.cat --psf none <im.fits >pipe.out
near "image from a pipe" "$(paste <(col im.out JXX_RAW) <(col pipe.out JXX_RAW) | awk '$1 != $2' | wc -l)" 0 0
rrgshape im.fits im.out --psf none -o again.out
near "measuring again replaces the columns" "$(paste <(col im.out JXX_RAW) <(col again.out JXX_RAW) | awk '$1 != $2' | wc -l)" 0 0
near "no column twice" "$(grep "^# NUMBER" again.out | tail -1 | tr ' ' '\n' | sort | uniq -d | wc -l)" 0 0
stamp 64 64 "20.3 30.1 20 2.5 27 30 20 2" >two.fits
printf '1 20 30 2.5 2.5\n' | rows >one.cat
stamp 64 64 "27 30 20 2" >seg0.fits
# labels: 2 right of x = 23.5, else 1 (bytes 21 and 11)
{ head -c 2880 seg0.fits; awk 'BEGIN { for (y = 1; y <= 64; y++) for (x = 1; x <= 64; x++) printf "%c", (x > 23.5 ? 21 : 11); for (k = 4096; k % 2880; k++) printf " " }'; } >seg.fits
rrgshape two.fits one.cat --psf none --no-recenter -o open.out; rrgshape two.fits one.cat --psf none --no-recenter --segmentation seg.fits -o masked.out
between "neighbour seen without a mask: Jxx" "$(col open.out JXX_RAW)" 6 12
between "neighbour masked: Jxx" "$(col masked.out JXX_RAW)" 4 5.2
near "CROWDED: 17 % of the weight masked" "$(col masked.out FLAGS_RRG)" 128 0
echo '# NUMBER X_IMAGE Y_IMAGE A_IMAGE B_IMAGE' >empty.cat
ok "empty catalogue" rrgshape im.fits empty.cat --psf none -o empty.out
near "empty catalogue gives a header only" "$(grep -vc '^#' empty.out)" 0 0
# a weight map: 0.1 (1 of 11 steps) everywhere, so as 1/variance a variance of 10
{ head -c 2880 seg0.fits; awk 'BEGIN { for (k = 0; k < 4096; k++) printf "%c", 2; for (; k % 2880; k++) printf " " }'; } >wht.fits
rrgshape im.fits one.cat --psf none --weight wht.fits -o rel.out; rrgshape im.fits one.cat --psf none -o now.out
near "a constant relative weight changes nothing" "$(col rel.out S_RRG)" "$(col now.out S_RRG)" 0
near "nor the error" "$(col rel.out SERR_RRG)" "$(col now.out SERR_RRG)" 1e-9
sed "s/SETNAME = 'test    '/WHTTYPE = 'IVM     '/" wht.fits >ivm.fits
rrgshape im.fits one.cat --psf none --weight ivm.fits -o ivm.out
# pi w^2 10 of sky and the object's own light at gain 1: 10 x 44.2 + sum W^2 I, w = 3.75
between "1/variance: error of the flux" "$(col ivm.out SERR_RRG)" 21.0 35
sed "s/SETNAME = 'test    '/NOISECOR=        2.4/" im.fits >cor.fits; rrgshape cor.fits one.cat --psf none -o cor.out
near "NOISECOR 2.4: error of the flux 2.4 times as large" "$(paste <(col cor.out SERR_RRG) <(col now.out SERR_RRG) | awk '{ print $1 / $2 }')" 2.4 1e-9
near "NOISECOR: error of Jxx likewise" "$(paste <(col cor.out JXXERR_RAW) <(col now.out JXXERR_RAW) | awk '{ print $1 / $2 }')" 2.4 1e-9
near "NOISECOR: the moments stay" "$(col cor.out JXX_RAW)" "$(col now.out JXX_RAW)" 0
fails "image and catalogue from one pipe" 2 rrgshape - - --psf none
fails "catalogue and star moments from one pipe" 2 rrgshape im.fits - --stars -
fails "catalogue and stars from one pipe" 2 rrgshape im.fits - --stars im.fits,-
rrgshape --stars-only im.fits im.cat --check 2>plan.txt; near "--check of stars: one line" "$(wc -l <plan.txt)" 1 0
fails "neither stars nor PSF" 2 rrgshape im.fits im.cat
fails "both stars and PSF" 2 rrgshape im.fits im.cat --psf none --stars x
fails "one operand" 2 rrgshape im.fits --psf none
fails "bad number" 2 rrgshape im.fits im.cat --psf none --width 1.5abc
fails "no such image" 1 rrgshape none.fits im.cat --psf none
fails "no such star file" 1 rrgshape im.fits im.cat --stars none.rrg
fails "a catalogue is no star file" 1 rrgshape im.fits im.cat --stars im.cat
sed 's/A_IMAGE/A_OTHER/' im.cat >bad.cat; fails "column missing" 1 rrgshape im.fits bad.cat --psf none
head -c 5000 im.fits >short.fits; fails "truncated image" 1 rrgshape short.fits im.cat --psf none -o short.out
if [ -e short.out ]; then fail "truncated image leaves an output"; else pass "truncated image leaves no output"; fi
stamp 32 32 "9 9 9 1" >small.fits; fails "segmentation of another size" 1 rrgshape im.fits im.cat --psf none --segmentation small.fits
for k in "PIXSCALE=                  0.1/PIXSCALE=                 -0.1" "GAIN    =                  1.0/GAIN    =                  0.0" "GAIN    =                  1.0/GAIN    = 'one'               " "SHEAR2  =                  0.0/EXPTIME =                  0.0" \
    "SHEAR2  =                  0.0/NOISECOR=                  1,2" "SHEAR2  =                  0.0/SKYLEVEL=                  x.0"; do
    sed "s/$k/" im.fits >odd.fits; fails "image with ${k#*/}" 1 rrgshape odd.fits im.cat --psf none
done
perl "$TOP/tests/fits.pl" make cube.fits 8 8 1 'PIXSCALE=                  0.1'; perl -pi -e 's/NAXIS   =                    2/NAXIS   =                    3/; s/EXTEND  =                    T/NAXIS3  =                    3/' cube.fits
fails "a cube" 1 rrgshape cube.fits im.cat --psf none
if [ -x "$BIN/psfgen" ]; then
    ok "PSF of the default telescope" psfgen -o psf.fits
    ok "moments of the exact ePSF" rrgshape im.fits im.cat --psf psf.fits -o psf.out
    # issue of the definition of d*: .615 px for the stars of ../shared (clear annulus), a little more with vanes and diffusion
    between "d* of the ePSF at 0.10 arcsec, w = 0.1 arcsec, px" "$(key psf.out DSTAR)" 0.55 0.70
    near "the galaxy of 2.5 px before the PSF: JXX below the raw one" "$(paste <(col psf.out JXX_RAW) <(col psf.out JXX) | awk 'NR == 1 { print ($1 > $2) }')" 1 0
    # an interlaced image: the pixel of 0.2" collected the light, so d* (in pixels of 0.1") is larger
    sed "s/SHEAR2  =                  0.0/PIXFRAC =                  0.5/; s/SETNAME = 'test    '/CCDSCALE=        0.2/" im.fits >dr.fits
    rrgshape dr.fits im.cat --psf psf.fits -o dr.out; rrgshape im.fits im.cat --psf psf.fits --pixel 0.2 -o px.out
    near "drizzled image: pixel of the CCD" "$(key dr.out DSTAR)" "$(key px.out DSTAR)" 1e-12
    between "d* with a pixel of 0.2 arcsec" "$(key dr.out DSTAR)" 0.65 0.80
    near "a known PSF adds no error" "$(col psf.out E1ERR_STARS | head -1)" 0 0

    # errors by the stars: one galaxy corrected with the stars of 12 fields of 36 stars; its e scatters as E1ERR_STARS says
    for s in 1 2 3 4 5 6 7 8 9 10 11 12; do
        galgen --field 16 --stars -n 36 -s $s | simage - -p psf.fits -x 0.1 --size 160,160 | addnoise --depth 27.7 -s $s -o st.fits
        detect -q st.fits -o st.cat; rrgshape -q --stars-only st.fits st.cat -o st.rrg && rrgshape -q im.fits im.cat --stars st.rrg -o st$s.out
    done
    scatter() { for s in 1 2 3 4 5 6 7 8 9 10 11 12; do echo "$(col st$s.out $1 | sed -n 2p) $(col st$s.out $1ERR_STARS | sed -n 2p)"; done |
        awk '{ a += $1; b += $1 * $1; v += $2 * $2 } END { print sqrt((b - a * a / NR) / (NR - 1) / (v / NR)) }'; }
    # a spread by 12 values is known to 21 %; three of them
    for o in st.fits st.cat; do
        cp $o kept
        fails "stars measured in the same run: the output is $o" 1 rrgshape -q im.fits im.cat --stars st.fits,st.cat -o $o
        ln -f $o one.reg
        fails "the region file is $o by another name" 1 rrgshape -q im.fits im.cat --stars st.fits,st.cat --region one.reg -o reg.out
        rm one.reg
        same "and $o stays" $o kept
    done
    near "E1ERR_STARS against the scatter of E1 over 12 star fields" "$(scatter E1)" 1 0.63
    near "E2ERR_STARS against the scatter of E2" "$(scatter E2)" 1 0.63
    near "noise and stars add to E1ERR" "$(paste <(col st1.out E1ERR) <(col st1.out E1ERR_STARS) <(col psf.out E1ERR) | awk 'NR == 2 { print $1 / sqrt($2 * $2 + $3 * $3) }')" 1 0.02
    galgen --field 36 --stars -n 100 | simage - -p psf.fits -x 0.1 --size 360,360 | addnoise --depth 27.7 -o st.fits
    detect -q st.fits -o st.cat; rrgshape -q --stars-only st.fits st.cat -o st.rrg; rrgshape -q im.fits im.cat --stars st.rrg -o st.out
    rrgshape -q --stars-only --max-stars 25 st.fits st.cat -o few.rrg; rrgshape -q im.fits im.cat --stars few.rrg -o few.out
    near "--max-stars 25: so many at the smallest width" "$(col few.rrg NSTARS | head -1)" 25 0
    between "25 stars for 100: twice the error (a spread by 25 is known to 14 %: 3 sigma)" "$(paste <(col few.out E1ERR_STARS) <(col st.out E1ERR_STARS) | awk 'NR == 2 { print $1 / $2 }')" 1.2 2.8
else
    skip "psfgen is not built: --psf FILE"
fi
