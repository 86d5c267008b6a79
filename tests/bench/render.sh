# 6000 default galaxies with PSF, charge diffusion, pixel and g = 0.05.
cpu "psfgen, defaults" psfgen -o psf.fits
cpu "galgen, 6000 galaxies" galgen -n 6000 --models models.txt -o scene.txt
for x in 0.10 0.16 0.04; do
    n=$(awk "BEGIN { printf \"%.0f\", 163.84 / $x }")
    # sky noise at 27.7: 170 electrons per arcsec
    for f in 0.005 0.02; do
        floor=$(awk "BEGIN { print $f * 170 * $x }")
        cpu "simage $x\", 1e-7 and floor of $f sky noise" simage scene.txt --models models.txt -p psf.fits -x $x --size $n,$n --shear 0.05,0 --accuracy 1e-7 --floor "$floor" -o out.fits
    done
    cpu "simage $x\", 1e-4" simage scene.txt --models models.txt -p psf.fits -x $x --size $n,$n --shear 0.05,0 --accuracy 1e-4 -o out.fits
    cpu "simage $x\", no PSF" simage scene.txt --models models.txt -x $x --size $n,$n --shear 0.05,0 -o out.fits
done
