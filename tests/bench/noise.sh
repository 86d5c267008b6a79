# Photon noise of a blank sky: 4096 x 4096 pixels with means of 5, 72 (0.1" pixels at depth 27.7 have 284) and 430 electrons.
printf '# DX DY MAG TYPE RE\n0 0 40 gauss 0.3\n' >dark.txt
simage dark.txt -x 0.1 --size 4096,4096 -T 2000 -o flat.fits
for mean in 5 72 430; do
    cpu "addnoise, 16.8 Mpixel, mean $mean" addnoise --sky-rate "$(awk "BEGIN { print $mean / 2000 / 0.01 }")" flat.fits -o noisy.fits
done
