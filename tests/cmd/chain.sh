# The chain from end to end at the experiment's settings, one full field of Sim 1
# at 0.10 arcsec: galaxy density, noise-free slopes, shared noise, same bytes.
x=0.10 n=1638
common="-x $x --size $n,$n -T 2000 --accuracy 1e-6 --floor 0.085 --set sim1"
found="--threshold 1.5 --threshold-noise pixel --min-area 5 --back-type dark"
psfgen -o psf.fits
galgen --models models.txt -o scene.txt
galgen --stars -s 501 | simage - -p psf.fits $common | addnoise --depth 27.7 -s 501 -o stars.fits
detect $found --check-image segmentation=stars.seg.fits stars.fits -o stars.cat
rrgshape --stars-only --segmentation stars.seg.fits stars.fits stars.cat -o stars.rrg
for g in 0,0 -0.05,0 0.05,0 0,-0.05 0,0.05; do
    simage scene.txt --models models.txt -p psf.fits $common --shear $g -o true_$g.fits
done
for g in 0,0 -0.05,0 0.05,0; do addnoise --depth 27.7 true_$g.fits -o noisy_$g.fits; done
detect $found --check-image segmentation=seg.fits noisy_0,0.fits -o g0.cat
rrgshape noisy_0,0.fits g0.cat --stars stars.rrg --segmentation seg.fits -o g0.rrg
cutcat g0.rrg --stars stars.rrg --snr 10 -o g0.use
used=$(grep -vc '^#' g0.use)
between "usable galaxies per square arcminute" "$(awk "BEGIN { print $used / ($n * $n * $x * $x / 3600) }")" 90 120

# noise-free images at the catalogue of the unsheared noisy one, objects common to all
slope() { # LABEL OPTIONS...: shapes, cuts, fom -> slopes of common objects
    local g label=$1; shift
    for g in 0,0 -0.05,0 0.05,0 0,-0.05 0,0.05; do
        rrgshape true_$g.fits g0.cat --stars stars.rrg --segmentation seg.fits --no-background "$@" -o s_$g.rrg
        cutcat s_$g.rrg --stars stars.rrg --snr 10 --mark -o s_$g.use
    done
    fom s_*.use -o $label.cat
}
slope exact
slope plain --fourth plain --psf-correction first
for c in 1 2; do
    between "noise-free slope $c, exact moments" "$(col exact.cat BPAIR$c)" 1.00 1.10
    between "noise-free slope $c, plain moments, first-order PSF" "$(col plain.cat BPAIR$c)" 0.75 0.90
done

read -r corr pixels < <(pix noise true_-0.05,0.fits noisy_-0.05,0.fits true_0.05,0.fits noisy_0.05,0.fits 0.01)
between "correlation of the noise of g = +-0.05, $pixels pixels" "$corr" 0.999 1
between "pixels compared" "$pixels" 2000000 3000000

# two threads, another directory, another run: the same bytes, all along the chain
mkdir elsewhere
cp scene.txt models.txt elsewhere
( cd elsewhere
  psfgen -j 2 -o psf.fits
  simage scene.txt -j 2 --models ./models.txt -p ../elsewhere/psf.fits $common --shear 0,0 >true_0,0.fits
  addnoise -j 2 --depth 27.7 ../elsewhere/true_0,0.fits -o noisy_0,0.fits
  cp ../stars.rrg .
  detect -j 2 $found --check-image segmentation=seg.fits noisy_0,0.fits >g0.cat
  rrgshape -j 2 noisy_0,0.fits g0.cat --stars ./stars.rrg --segmentation seg.fits >g0.rrg
  cutcat -j 2 g0.rrg --stars stars.rrg --snr 10 >g0.use )
for f in psf.fits noisy_0,0.fits seg.fits g0.cat g0.rrg g0.use; do same "same bytes elsewhere with two threads: $f" $f elsewhere/$f; done
near "lines of HISTORY that end in blanks" "$(grep -c '^# HISTORY.* $' g0.use)" 0 0
between "lines of HISTORY" "$(grep -c "^# HISTORY" g0.use)" 6 20
