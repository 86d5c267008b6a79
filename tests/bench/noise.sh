# Photon noise, sky-dominated: 4096 x 4096 pixels of about 430 electrons.
galgen --field 40.96 -n 100 --stars -o s.txt
simage s.txt -x 0.01 --size 4096,4096 -o flat.fits
for rate in 21.5 0.05 200; do
    rate=$(awk "BEGIN { print $rate * 1e-2 / 1e-4 / 2000 * 10 * 2000 / 2000 }")
    cpu "addnoise, 16.8 Mpixel, sky $rate electron/s/arcsec^2" addnoise --sky-rate "$rate" flat.fits -o noisy.fits
done
