# 16384 x 16384 pixels through dither, addnoise and drizzle in 32 MiB and a band of rows.
perl -e 'my @c = ("SIMPLE  =                    T", "BITPIX  =                  -32", "NAXIS   =                    2", "NAXIS1  =                16385", "NAXIS2  =                16385",
    "EXPTIME =               2000.0", "PIXSCALE=                 0.05", "CTYPE1  = \x27RA---TAN\x27", "CTYPE2  = \x27DEC--TAN\x27", "CRVAL1  = 150.0", "CRVAL2  = 2.2", "CRPIX1  = 8193.0",
    "CRPIX2  = 8193.0", "CD1_1   = -1.388888888888889E-5", "CD1_2   = 0.0", "CD2_1   = 0.0", "CD2_2   = 1.388888888888889E-5", "END");
    my $s = join "", map { sprintf "%-80s", $_ } @c; print $s, " " x (2880 - length($s) % 2880);
    my $r = pack "f>*", map { 3 + $_ % 7 } 0 .. 16384; print $r for 1 .. 16385; print "\0" x (2880 - 4 * 16385 ** 2 % 2880)' >big.fits
kib() { /usr/bin/time -f %M -o kib.txt "$@" && tail -1 kib.txt; }
limit=$((32 * 1024 + 64 * 16384 * 4 / 1024 + 8192))
between "dither, KiB" "$(kib dither -n 2 big.fits -o d.fits)" 1 $limit
rm big.fits
between "addnoise, KiB" "$(kib addnoise --sky-rate 10 d.fits -o n.fits)" 1 $limit
rm d.fits
between "drizzle, KiB" "$(kib drizzle n.fits -x 0.05 --pixfrac 0.5 --flat -o z.fits)" 1 $limit
near "NAXIS1" "$(card z.fits NAXIS1)" 16384 0
