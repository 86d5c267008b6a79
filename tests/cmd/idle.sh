# Options that would do nothing beside others, and inputs that contradict a header or come twice, are refused: nothing is ignored without a word.
small_chain
idle() { # OPTION COMMAND...: exit 2, the option named; without it the command works (its last words are the option and its value)
    local o=$1; shift
    fails "${1} $o" 2 "$@" -o made
    if grep -q -- "--$o would do nothing" cmd.err && [ ! -e made ]; then pass "told"; else fail "$1 $o: $(cat cmd.err)"; fi
}
idle psf-scale simage scene.txt --models models.txt -x 0.1 --psf-scale 3
idle psf-cutoff simage scene.txt --models models.txt -x 0.1 --psf-cutoff 1
idle psf addnoise true.fits --depth 27.7 --psf psf.fits
idle psf-scale addnoise true.fits --depth 27.7 --psf-scale 0.1
idle depth-definition addnoise true.fits --sky 22 --depth-definition area
fails "addnoise: another EXPTIME than the header's" 1 addnoise -T 500 --depth 27 true.fits -o made
fails "addnoise: another pixel than the header's" 1 addnoise -x 0.5 --depth 27 true.fits -o made
ok "addnoise: the header's own values" addnoise -T 2000 -x 0.1 --depth 27 true.fits -o same.fits
idle weight-type detect noisy.fits --weight-type rms
idle clean-slope detect noisy.fits --no-clean --clean-slope 3
idle deblend-contrast detect noisy.fits --deblend-levels 1 --deblend-contrast 0.1
for o in columns=NUMBER apertures=1 flux-fraction=0.3 format=ldac measure=noisy.fits; do idle ${o%=*} detect noisy.fits --negative --$o; done
perl -e 'local $/; $_ = <STDIN>; for (my $i = 0; $i < 5760; $i += 80) { my $k = substr($_, $i, 8); if ($k eq "PIXSCALE") { substr($_, $i, 80) = sprintf("%-80s", "PIXSCALE=                 0.05") }
    if ($k =~ /^(CTYPE|CRVAL|CRPIX)/) { substr($_, $i, 1) = "X" } } print' <noisy.fits >fine.fits
fails "detect: measured in an image of other pixels" 1 detect noisy.fits --measure fine.fits -o made
for o in psf=none stars=stars.rrg fixed-width=3 fourth=plain psf-correction=first pixel=0.2 no-recenter centroid-term; do idle "${o%=*}" rrgshape --stars-only stars.fits scat.txt "--$o"; done
idle max-stars rrgshape noisy.fits cat.txt --stars stars.rrg --max-stars 3
idle star-average rrgshape noisy.fits cat.txt --psf none --star-average median
idle pixel rrgshape noisy.fits cat.txt --stars stars.rrg --pixel 0.2
idle pixel rrgshape noisy.fits cat.txt --psf none --pixel 0.2
for o in fourth=plain psf-correction=first; do idle ${o%=*} rrgshape noisy.fits cat.txt --psf none --$o; done
for o in width=2 width-min=0.2 width-max=0.5; do idle ${o%=*} rrgshape noisy.fits cat.txt --stars stars.rrg --fixed-width 3 --$o; done
for o in library=models.txt models=made.txt mag-range=20,22 nmax=4 size=0.3 size-scatter=0.1 smoothing=0.1; do idle ${o%=*} galgen --stars -n 4 --$o; done
for o in nmax=4 size=0.3 size-scatter=0.1 smoothing=0.1; do idle ${o%=*} galgen --library models.txt -n 4 --$o; done
idle wavelengths psfgen --wavelengths 3
idle wavelengths psfgen --bandwidth 0 --wavelengths 3
for o in strut-angle=10 strut-width=0.1; do idle ${o%=*} psfgen --struts 0 --$o; done
idle strut-angle psfgen --strut-width 0 --strut-angle 10
idle obscuration-offset psfgen --obscuration 0 --obscuration-offset 0.1,0
ok "psfgen: a band has wavelengths" psfgen --bandwidth 200 --wavelengths 3 --pupil-grid 32 --size 16 -o band.fits
idle pixscale addnoise true.fits --read-noise 3 --pixscale 0.1
fails "addnoise: no sky to subtract" 1 addnoise true.fits --read-noise 3 --subtract-sky -o made
ok "addnoise: sky of 0, typed" addnoise true.fits --sky-rate 0 --subtract-sky -o none.fits
perl -pe 's/EXPTIME =/XXPTIME =/' true.fits >timeless.fits
fails "addnoise: a zeropoint without a time" 1 addnoise timeless.fits -z 25 -o made
ok "addnoise: a zeropoint with a time" addnoise true.fits -z 25 -o zero.fits
near "MAGZERO" "$(card zero.fits MAGZERO)" "$(awk 'BEGIN { print 25 + 2.5 * log(2000) / log(10) }')" 1e-4
fails "detect: an rms of nothing" 2 detect noisy.fits --rms 0 -o made
# noise twice, noise shared between exposures, one of several images, labels of other objects, cuts without their column
fails "addnoise: an image that has noise" 1 addnoise noisy.fits -o made
grep -q NOISSEED cmd.err && pass "the keyword is named" || fail "$(cat cmd.err)"
ok "dither: a noisy image" dither -n 2 noisy.fits -o parts.fits
grep -q "share it" cmd.err && pass "told" || fail "dither: $(cat cmd.err)"
for p in "detect parts.fits" "rrgshape parts.fits cat.txt --psf none" "dither -n 2 parts.fits"; do
    # shellcheck disable=SC2086
    fails "$p: several images" 1 $p -o made
    grep -q "4 images named SCI" cmd.err && pass "told" || fail "$p: $(cat cmd.err)"
done
ok "one of them named" detect "parts.fits[SCI,2]" -o part.cat
detect noisy.fits --check-image segmentation=seg.fits -o seg.cat
detect --threshold 8 noisy.fits --check-image segmentation=less.fits -o less.cat
ok "rrgshape: its own labels" rrgshape noisy.fits seg.cat --stars stars.rrg --segmentation seg.fits -o seg.out
cutcat --only-where --where 'NUMBER > 20' seg.cat -o some.cat
ok "rrgshape: labels of a catalogue that was cut" rrgshape noisy.fits some.cat --stars stars.rrg --segmentation seg.fits -o seg.out
fails "rrgshape: labels of another catalogue" 1 rrgshape noisy.fits seg.cat --stars stars.rrg --segmentation less.fits -o made
grep -q "lie on labels of others" cmd.err && pass "told" || fail "rrgshape: $(cat cmd.err)"
cutcat --only-where --columns NUMBER,E1,E2,D_RRG,FLUX_AUTO,FLUXERR_AUTO shapes.txt -o bare.txt
ok "cutcat: no classes, none asked for" cutcat bare.txt --stars stars.rrg --star-prob 1 --flags 0 -o bare.use
fails "cutcat: --star-prob without STAR_PROB" 1 cutcat bare.txt --stars stars.rrg --star-prob 0.5 -o made
fails "cutcat: --flags without FLAGS_RRG" 1 cutcat bare.txt --stars stars.rrg --flags 3 -o made
ln -s cut.txt link.txt
fails "fom: a catalogue twice" 2 fom cut.txt cut.txt
fails "fom: by another name" 2 fom cut.txt shapes.txt link.txt
# maps of another place on the sky, and maps without a pixel: each is named
perl -e 'local $/; $_ = <STDIN>; for (my $i = 0; $i < 11520; $i += 80) { if (substr($_, $i, 8) eq "CRVAL1  ") { substr($_, $i, 80) = sprintf("%-80s", "CRVAL1  =                 10.0") } } print' <noisy.fits >afar.fits
perl -e 'local $/; $_ = <STDIN>; for (my $i = 0; $i < 11520; $i += 80) { if (substr($_, $i, 8) =~ /^CRPIX1/) { my $v = substr($_, $i + 10, 20) + .3; substr($_, $i, 80) = sprintf("%-80s", sprintf("CRPIX1  = %20.10f", $v)) } } print' <noisy.fits >near.fits
for o in measure weight mask; do
    fails "detect: --$o of another field" 1 detect noisy.fits --$o afar.fits -o made
    grep -q "^detect: afar.fits: its WCS places" cmd.err && pass "told" || fail "--$o: $(cat cmd.err)"
done
ok "detect: measured .3 pixels away" detect noisy.fits --measure near.fits -o near.cat
perl -e 'local $/; $_ = <STDIN>; for (my $i = 0; $i < 11520; $i += 80) { if (substr($_, $i, 8) =~ /^CRPIX1/) { my $v = substr($_, $i + 10, 20) + .4; substr($_, $i, 80) = sprintf("%-80s", sprintf("CRPIX1  = %20.10f", $v)) } } print' <near.fits >next.fits
fails "detect: measured .7 pixels away" 1 detect noisy.fits --measure next.fits -o made
side=$(card noisy.fits NAXIS1)
perl "$TOP/tests/fits.pl" make zero.fits "$side" "$side" 0
perl "$TOP/tests/fits.pl" make one.fits "$side" "$side" 1
for o in "weight zero" "measure-weight zero" "mask one"; do
    # shellcheck disable=SC2086
    set -- $o
    fails "detect: --$1 without a pixel" 1 detect noisy.fits --measure noisy.fits --$1 $2.fits -o made
    grep -q "^detect: $2.fits: no usable pixel" cmd.err && pass "$2.fits is named" || fail "--$1: $(cat cmd.err)"
done
# standard input, asked for twice: by an operand and an option, by two options, in a pair
once() { # COMMAND...: exit 2 before anything is read
    fails "$* <file" 2 "$@" -o made
    if grep -q "can be read once only" cmd.err && [ ! -e made ]; then pass "told"; else fail "$*: $(cat cmd.err)"; fi
}
once detect - --weight - <noisy.fits
# shellcheck disable=SC2094
once detect noisy.fits --weight - --mask - <noisy.fits
once simage --models - -x 0.1 scene.txt -p - <models.txt
once simage --models - -x 0.1 <scene.txt
# shellcheck disable=SC2094
once drizzle dith.fits --weight - --mask - <dith.fits
once rrgshape noisy.fits - --stars stars.fits,- <cat.txt
# shellcheck disable=SC2094
once rrgshape noisy.fits cat.txt --stars -,- <cat.txt
perl "$TOP/tests/fits.pl" make mask.fits 120 120 0
ok "once, by an option" detect noisy.fits --mask - -o masked.cat <mask.fits
