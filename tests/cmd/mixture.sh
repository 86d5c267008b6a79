# A second, independent answer to what a shear does: a galaxy of five elliptical, off-centre Gaussians is sheared exactly by
# moving and reshaping them (S -> M S M', x0 -> M x0); simage draws them as such, and as shapelets that it shears itself.
cat >galaxy.txt <<'END'
0.55 0 0 0.07 0.02 0.05
0.2 0.12 -0.05 0.04 -0.01 0.06
0.1 -0.1 0.13 0.03 0 0.03
0.1 0.05 0.16 0.05 0.015 0.04
0.05 -0.14 -0.12 0.035 0 0.045
END
# shapelets of scale B to order 40 by the recurrence for Gaussians
perl -e 'my ($B, $N) = (0.22, 40); my %c; my $pi = atan2(0, -1); open my $g, "<", "galaxy.txt";
    while (<$g>) { my ($f, $x, $y, $a, $b, $d) = split; my $w = $B * $B; my $det = ($a + $w) * ($d + $w) - $b * $b; my @T = (($d + $w) / $det, -$b / $det, ($a + $w) / $det);
        my @A = (1 - 2 * $w * $T[0], -2 * $w * $T[1], 1 - 2 * $w * $T[2]); my @v = map { $_ * sqrt(2) * $B } $T[0] * $x + $T[1] * $y, $T[1] * $x + $T[2] * $y;
        my %k = ("0,0" => $f * $B / sqrt($det * $pi) * exp(-0.5 * ($T[0] * $x * $x + 2 * $T[1] * $x * $y + $T[2] * $y * $y)));
        for my $n (1 .. $N) { for my $i (0 .. $n) { my $j = $n - $i;
            if ($i) { my $m = $i - 1; $k{"$i,$j"} = ($v[0] * $k{"$m,$j"} + $A[0] * sqrt($m) * ($k{($m - 1) . ",$j"} // 0) + $A[1] * sqrt($j) * ($k{"$m," . ($j - 1)} // 0)) / sqrt($i) }
            else { my $m = $j - 1; $k{"$i,$j"} = ($v[1] * $k{"$i,$m"} + $A[2] * sqrt($m) * ($k{"$i," . ($m - 1)} // 0)) / sqrt($j) } } }
        $c{$_} += $k{$_} for keys %k }
    print "# ID BETA NMAX MAG COEFFS\n1 $B $N 20"; for my $n (0 .. $N) { printf " %.17g", $c{"$_," . ($n - $_)} for 0 .. $n } print "\n"' >m.txt
printf '# DX DY FLUX TYPE MODEL\n0.03 -0.02 1 shapelet 1\n' >shapelet.txt
# gauss G1 G2: the Gaussians after the shear
gauss() {
    perl -e 'my ($g1, $g2) = @ARGV; my $pi = atan2(0, -1); my $n = sqrt(1 - $g1 * $g1 - $g2 * $g2); my ($p, $q, $r) = ((1 + $g1) / $n, $g2 / $n, (1 - $g1) / $n);
        print "# DX DY FLUX TYPE RE Q PA\n"; open my $g, "<", "galaxy.txt";
        while (<$g>) { my ($f, $x, $y, $a, $b, $d) = split; my ($A, $B, $D) = ($p * $p * $a + 2 * $p * $q * $b + $q * $q * $d, $p * $q * $a + ($p * $r + $q * $q) * $b + $q * $r * $d, $q * $q * $a + 2 * $q * $r * $b + $r * $r * $d);
            my $h = sqrt((($A - $D) / 2) ** 2 + $B * $B); my $t = ($A + $D) / 2;
            printf "%.15g %.15g %.15g gauss %.15g %.15g %.15g\n", 0.03 + $p * $x + $q * $y, -0.02 + $q * $x + $r * $y, $f, sqrt(2 * log 2) * ($A * $D - $B * $B) ** 0.25,
                sqrt(($t - $h) / ($t + $h)), atan2(2 * $B, $A - $D) / 2 * 180 / $pi }' -- "$1" "$2"
}
psfgen -M 64 --size 65 -o psf.fits
S="-x 0.1 --size 64,64 -T 1"
of() { pix diff "$1" "$2" | cut -d' ' -f1; }
for p in "" "-p psf.fits"; do
    for g in "0 0" "0.03 -0.04" "0.2 0.1" "-0.3 0.4"; do
        set -- $g
        gauss "$1" "$2" >gauss.txt
        simage gauss.txt $p $S --accuracy 1e-7 -o gauss.fits
        simage shapelet.txt --models m.txt $p $S --accuracy 1e-7 -g "$1,$2" -o exact.fits
        near "exact shear, g = $g${p:+, PSF}: shapelets and Gaussians, of the peak" "$(of gauss.fits exact.fits)" 0 2e-7
    done
done
# order 4: what is left is of fifth order in the exponent
error() { gauss "$1" 0.01 >gauss.txt; simage gauss.txt $S --accuracy 1e-8 -o gauss.fits
    simage shapelet.txt --models m.txt $S --accuracy 1e-8 -g "$1,0.01" --shear-order "$2" -o four.fits; of gauss.fits four.fits; }
a=$(error 0.1 4) b=$(error 0.2 4)
between "order 4 at g = .1, of the peak" "$a" 1e-6 1e-3
between "order 4: error at .2 over that at .1 (2^5 and more: the exponent is atanh g)" "$(awk -v a="$a" -v b="$b" 'BEGIN { print b / a }')" 28 45
near "order 8 at g = .1, of the peak" "$(error 0.1 8)" 0 1e-6
