# Shapes of a field of 0.10" pixels and of larger ones; cuts and figures of merit of nine images.
galgen --field 163.84 -s 3 -o s.txt --models m.txt
psfgen -o psf.fits
simage s.txt --models m.txt -p psf.fits -x 0.1 --size 1638,1638 --accuracy 1e-3 -o clean.fits
addnoise --depth 27.7 clean.fits -o f.fits
detect f.fits -q --threshold 1.5 --threshold-noise pixel --check-image segmentation=seg.fits -o f.cat.fits
detect f.fits -q --threshold 1.5 --threshold-noise pixel -o f.cat
rrgshape -q f.fits f.cat --psf psf.fits -o f.rrg
n=$(grep -vc '^#' f.cat)
# the same rows ten times over
{ grep '^#' f.cat; for i in 1 2 3 4 5 6 7 8 9 10; do grep -v '^#' f.cat; done; } >ten.cat
cpu "rrgshape, $n objects on 1638 x 1638 pixels, PSF file, masks" rrgshape -q f.fits f.cat --psf psf.fits --segmentation seg.fits -o o.rrg
cpu "the same, catalogues in FITS" rrgshape -q f.fits f.cat.fits --psf psf.fits --segmentation seg.fits -o o.fits
one=$(for ((i = 0; i < RUNS; i++)); do seconds rrgshape -q f.fits f.cat --psf none -o o.fits; done | median)
ten=$(for ((i = 0; i < RUNS; i++)); do seconds rrgshape -q f.fits ten.cat --psf none -o o.fits; done | median)
awk -v a="$one" -v b="$ten" -v n="$n" 'BEGIN { printf "%-64s %8.1f us\n", "rrgshape, one more object, reading and writing included", (b - a) / (9 * n) * 1e6 }'
cpu "cutcat, $n objects, text" cutcat -q f.rrg --mark -o f.use
cpu "cutcat, $n objects, 13 columns to FITS" cutcat -q f.rrg --mark -o f.use.fits \
    --columns NUMBER,ALPHA_J2000,DELTA_J2000,FLUX_AUTO,FLUXERR_AUTO,D_RRG,D_PSF,E1,E2,E1ERR,E2ERR,P11,P22
k=0
for g in "0 0" "-0.05 0" "-0.025 0" "0.025 0" "0.05 0" "0 -0.05" "0 -0.025" "0 0.025" "0 0.05"; do
    sed "s/^# Keyword: SHEAR1 = .*/# Keyword: SHEAR1 = ${g% *}/; s/^# Keyword: SHEAR2 = .*/# Keyword: SHEAR2 = ${g#* }/" f.use >u$k.use; k=$((k + 1))
done
cpu "fom, 9 images of $n objects, text" fom -q u?.use -o o.fom
