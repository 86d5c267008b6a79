# 16384 x 16384 pixels through dither, addnoise and drizzle in 32 MiB and a band of rows.
perl -e 'my @c = ("SIMPLE  =                    T", "BITPIX  =                  -32", "NAXIS   =                    2", "NAXIS1  =                16385", "NAXIS2  =                16385",
    "EXPTIME =               2000.0", "PIXSCALE=                 0.05", "CTYPE1  = \x27RA---TAN\x27", "CTYPE2  = \x27DEC--TAN\x27", "CRVAL1  = 150.0", "CRVAL2  = 2.2", "CRPIX1  = 8193.0",
    "CRPIX2  = 8193.0", "CD1_1   = -1.388888888888889E-5", "CD1_2   = 0.0", "CD2_1   = 0.0", "CD2_2   = 1.388888888888889E-5", "END");
    my $s = join "", map { sprintf "%-80s", $_ } @c; print $s, " " x (2880 - length($s) % 2880);
    my $r = pack "f>*", map { 3 + $_ % 7 } 0 .. 16384; print $r for 1 .. 16385; print "\0" x (2880 - 4 * 16385 ** 2 % 2880)' >big.fits
kib() { /usr/bin/time -f '%M %e s, CPU %U + %S s' -o kib.txt "$@" || return; tail -1 kib.txt | cut -d' ' -f2- >&2; tail -1 kib.txt | cut -d' ' -f1; }
limit=$((32 * 1024 + 64 * 16384 * 4 / 1024 + 8192))
between "dither, KiB" "$(kib dither -n 2 big.fits -o d.fits)" 1 $limit
printf '# DX DY\n0 0\n0.3 0.6\n' >off.txt
between "dither between small pixels, KiB" "$(kib dither -n 2 --offsets off.txt big.fits -o o.fits)" 1 $limit
rm big.fits o.fits
between "addnoise, KiB" "$(kib addnoise --sky-rate 10 d.fits -o n.fits)" 1 $limit
rm d.fits
between "drizzle, KiB" "$(kib drizzle n.fits -x 0.05 --pixfrac 0.5 --flat -o z.fits)" 1 $limit
near "NAXIS1" "$(card z.fits NAXIS1)" 16384 0
rm z.fits
between "drizzle with weights, variances, masks, WHT, VAR and CTX, KiB" "$(kib drizzle n.fits -x 0.05 --pixfrac 0.5 --weight n.fits --var n.fits --mask n.fits -o z.fits)" 1 $limit
rm z.fits
between "the same, drops on many pixels each, KiB" "$(kib drizzle n.fits -x 0.05 --pixfrac 0.8 --rotation 10 --size 16384,16384 --weight n.fits --var n.fits -o z.fits)" 1 $limit
