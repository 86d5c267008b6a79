# What each effect of pixshear(7) costs: 6000 galaxies on 1638 x 1638 pixels of 0.10", accuracy 1e-4; 1 Mpixel of noise.
psfgen --diffusion 0 -o psf.fits
galgen -n 6000 --models models.txt -o scene.txt
S="scene.txt --models models.txt -x 0.1 --size 1638,1638 --accuracy 1e-4 -o out.fits"
P="$S -p psf.fits"
cpu "simage, nothing but light at pixel centres" simage $S --no-pixel
cpu " pixel" simage $S
cpu " pixel, shear along x" simage $S -g 0.05,0
cpu " pixel, shear in any direction" simage $S -g 0.03,0.04
cpu " pixel, series of order 4" simage $S -g 0.03,0.04 --shear-order 4
cpu "simage, PSF" simage $P --no-pixel
cpu " pixel" simage $P
for o in "--diffusion 0.04" "--jitter 0.02" "--ipc 0.01" "--pixel 0.1,0.08" "--pixel-edge 0.02,0.02" "-g 0.05,0" "-g 0.03,0.04" "-g 0.03,0.04 --shear-order 4"; do
    cpu " pixel, $o" simage $P $o
done
simage $P -o sky.fits
cpu " pixel, distortion (--wcs)" simage $P --wcs sky.fits
awk '/^#/ { if (/^# ID/ && !/Keyword/) print $0 " G1 G2"; else print; next } { print $0, 0.1, 0.05 }' scene.txt >own.txt
cpu " pixel, own shears" simage own.txt ${P#scene.txt}
simage scene.txt --models models.txt -p psf.fits -x 0.1 --size 1024,1024 --accuracy 1e-4 -o true.fits
cpu "addnoise, photons, mean of a few" addnoise true.fits -o out.fits
for o in "--sky-rate 21" "--sky-rate 21 --dark 0.001" "--sky-rate 21 --read-noise 4" "--sky-rate 21 --saturate 1000" "--sky-rate 21 --gain 2" "--sky-rate 21 --qe 0.9" "--sky-rate 21 --subtract-sky"; do
    cpu " photons, $o" addnoise true.fits $o -o out.fits
done
cpu "psfgen, discs alone" psfgen --diffusion 0 --struts 0 -o p.fits
for o in "--struts 3" "--struts 3 --zernike 4:0.05" "--struts 3 --bandwidth 160" "--struts 0 --diffusion 0.04" "--struts 0 --pixel 0.1"; do
    cpu " $o" psfgen --diffusion 0 $o -o p.fits
done
