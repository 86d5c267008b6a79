# detect --kernel-file: any filter, from FITS images and from text.
perl "$TOP/tests/fits.pl" make spots.fits 300 280 'my $v = 40 + sin(7 * $x * $x + 3 * $x * $y + 11 * $y * $y) + sin(5 * $x + 13 * $x * $y * $y); for my $s ([60, 50, 300], [150, 130, 90], [210.4, 220.7, 150], [40, 200, 40]) { my $d = ($x - $s->[0]) ** 2 + ($y - $s->[1]) ** 2; $v += $s->[2] * exp(-$d / 8) if $d < 300 } $v' \
    'PIXSCALE=                  0.1' 'GAIN    =                  1.0' 'MAGZERO =                 30.0'
gauss() { awk -v f="$1" -v w="$2" -v h="$3" 'BEGIN { print "'"$4"'"; s = f / sqrt(8 * log(2)); for (j = 0; j < h; j++) { for (i = 0; i < w; i++) printf "%.17g ", 7 * exp(-((i - int(w / 2)) ^ 2 + (j - int(h / 2)) ^ 2) / (2 * s * s)); print "" } }'; }
rows() { grep -v '^#' "$1"; }
detect -q -k 0.3 spots.fits -o gauss.cat
between "objects of the Gaussian" "$(rows gauss.cat | wc -l)" 4 9

# the same Gaussian as numbers: 3 pixels of FWHM are cut at 4 from the centre
gauss 3 9 9 'CONV NORM' >g.conv
detect -q --kernel-file g.conv spots.fits -o text.cat
near "the same Gaussian as text: objects" "$(rows text.cat | wc -l)" "$(rows gauss.cat | wc -l)" 0
near "and their positions" "$(paste <(col gauss.cat X_IMAGE) <(col text.cat X_IMAGE) | awk '{ d = $1 - $2; if (d < 0) d = -d; if (d > m) m = d } END { print m + 0 }')" 0 1e-5
perl "$TOP/tests/fits.pl" make g.fits 9 9 '3e8 * exp(-(($x - 4) ** 2 + ($y - 4) ** 2) * 4 * log(2) / 9)'
detect -q --kernel-file g.fits spots.fits -o image.cat
near "as a FITS image: positions" "$(paste <(col gauss.cat X_IMAGE) <(col image.cat X_IMAGE) | awk '{ d = $1 - $2; if (d < 0) d = -d; if (d > m) m = d } END { print m + 0 }')" 0 1e-5
detect -q --kernel-file - spots.fits <g.fits | rows /dev/stdin >stream.txt
same "from standard input" stream.txt <(rows image.cat)
detect -v --check --kernel-file g.conv spots.fits 2>told.txt >/dev/null
ok "it is a product" grep -q 'kernel 9 x 9 (a row times a column)' told.txt

# one value scales the filtered image and nothing else
printf 'CONV NORM\n-5\n' >minus.conv
printf 'CONV NONORM\n# twice\n\n 2e0 \n' >two.conv
printf 'CONV\n5\n' >one.conv
detect -q -k 0 spots.fits -o none.cat
detect -q --kernel-file one.conv spots.fits -o one.cat
same "CONV with 1 x 1 is no filter" <(rows none.cat) <(rows one.cat)
detect -q --kernel-file two.conv spots.fits -c NUMBER,X_IMAGE,Y_IMAGE,FLUX_AUTO,A_IMAGE,THETA_IMAGE -o two.cat --check-image filtered=two.fits
detect -q -k 0 spots.fits -c NUMBER,X_IMAGE,Y_IMAGE,FLUX_AUTO,A_IMAGE,THETA_IMAGE -o none2.cat --check-image filtered=once.fits
same "twice the image finds the same" <(rows two.cat) <(rows none2.cat)
near "and is twice the image" "$(paste <(perl "$TOP/tests/fits.pl" dump two.fits 0) <(perl "$TOP/tests/fits.pl" dump once.fits 0) | awk '{ d = $3 - 2 * $6; if (d < 0) d = -d; if (d > m) m = d } END { print m + 0 }')" 0 1e-6
near "a negative kernel on the negated image" "$(detect -q --kernel-file minus.conv --negative spots.fits)" "$(rows none.cat | wc -l)" 0
between "which are" "$(rows none.cat | wc -l)" 4 9

# a kernel without sum: noise is the root of the sum of squares
cat >hat.conv <<'K'
CONV NONORM
 0 -1 -2 -1  0
-1  0  2  0 -1
-2  2  8  2 -2
-1  0  2  0 -1
 0 -1 -2 -1  0
K
perl "$TOP/tests/fits.pl" make noise.fits 400 400 'my $g = -6; for (1 .. 12) { $main::s = (($main::s // 5) * 16807) % 2147483647; $g += $main::s / 2147483647 } 100 + 3 * $g' 'PIXSCALE=                  0.1'
detect -v --kernel-file hat.conv --min-area 1 -t 3.5 noise.fits -o hat.cat --check-image filtered=hat.fits 2>hat.err
near "noise of the mexican hat" "$(sed -n 's/.*filtered noise \([0-9.]*\);.*/\1/p' hat.err)" 10.198 0.001
near "variance of the filtered noise" "$(perl "$TOP/tests/fits.pl" stat hat.fits 0 | awk '{ print $2 / 9 / 104 }')" 1 0.02
# 160,000 pixels above 3.5 sigma: 37.2, some of them neighbours
between "false detections at 3.5 sigma" "$(rows hat.cat | wc -l)" 20 50
between "and on the negated image" "$(detect -q --kernel-file hat.conv --min-area 1 -t 3.5 --negative noise.fits)" 20 50
detect -q --kernel-file hat.conv spots.fits -o hat.cat
between "the hat finds the four" "$(rows hat.cat | wc -l)" 4 8
near "numbers in its rows" "$(rows hat.cat | grep -ci 'nan\|inf')" 0 0

# each way of filtering: the same bytes from any number of threads, with bad pixels and a weight map, too
perl "$TOP/tests/fits.pl" make bad.fits 300 280 '$x > 200 && $y > 150 && $y < 190 ? "nan" : $x == 33 ? "nan" : 40 + sin(7 * $x * $x + 3 * $x * $y + 11 * $y * $y) + 200 * exp(-(($x - 150) ** 2 + ($y - 130) ** 2) / 8)' 'PIXSCALE=                  0.1' 'GAIN    =                  1.0' 'MAGZERO =                 30.0'
perl "$TOP/tests/fits.pl" make weight.fits 300 280 '$y == 100 ? 0 : 1 + $x / 300'
gauss 3.1 12 7 'CONV NORM' >product.conv
awk 'BEGIN { print "CONV NORM"; for (j = 0; j < 7; j++) { for (i = 0; i < 8; i++) printf "%g ", (i - 3) ^ 2 + (j - 3) ^ 2 < 12; print "" } }' >whole.conv
awk 'BEGIN { print "CONV NORM"; for (j = 0; j < 41; j++) { for (i = 0; i < 44; i++) printf "%g ", (i - 21) ^ 2 + (j - 20) ^ 2 < 400; print "" } }' >tiles.conv
for k in product:times whole:whole tiles:tiles; do
    f=${k%:*}
    detect -v --check --kernel-file "$f.conv" bad.fits 2>told.txt >/dev/null
    ok "$f: that way" grep -q "kernel.*(.*${k#*:}" told.txt
    for j in 1 2 3; do
        detect -q -j $j -t 5 --kernel-file "$f.conv" -w weight.fits bad.fits -o made.cat --check-image filtered=made.fits
        mv made.cat "$f$j.cat"; mv made.fits "$f$j.fits"
    done
    between "$f: objects" "$(rows "${f}1.cat" | wc -l)" 1 9
    same "$f: two threads" "${f}1.cat" "${f}2.cat"
    same "$f: three threads" "${f}1.cat" "${f}3.cat"
    same "$f: the filtered image" "${f}1.fits" "${f}2.fits"
    near "$f: numbers in the rows" "$(rows "${f}1.cat" | grep -ci 'nan\|inf')" 0 0
done

# larger than the image
perl "$TOP/tests/fits.pl" make small.fits 7 5 '10 + sin(9 * $x * $x + 5 * $x * $y + 7 * $y) + ($x == 3 && $y == 2 ? 90 : 0)' 'PIXSCALE=                  0.1'
detect -q --kernel-file tiles.conv --rms 1 --min-area 1 small.fits --check-image filtered=f.fits --check-image subtracted=s.fits -o small.cat
near "a disc larger than the image: its sum everywhere" "$(perl "$TOP/tests/fits.pl" stat f.fits 0 | awk '{ print $4 - $3 }')" 0 1e-6
near "and that is the image's sum over the disc's area" "$(perl "$TOP/tests/fits.pl" stat f.fits 0 | awk '{ print $1 * 1245 }')" "$(perl "$TOP/tests/fits.pl" stat s.fits 0 | awk '{ print $6 }')" 1e-3

bad() { # WHAT, the file's text on standard input
    cat >bad.conv
    fails "$1" 1 detect spots.fits --kernel-file bad.conv -o made
    [ ! -e made ] || fail "$1: left an output"
}
bad "no kernel at all" </dev/null
bad "no numbers" <<<'CONV NORM'
bad "only comments" <<<$'CONV NORM\n# nothing'
bad "rows of different lengths" <<<$'CONV NORM\n1 2 1\n1 2'
bad "a word" <<<$'CONV NORM\n1 x 1'
bad "nan" <<<$'CONV NORM\n1 nan 1'
bad "1e999" <<<$'CONV NORM\n1 1e999 1'
bad "zeros" <<<$'CONV NORM\n0 0 0'
bad "zeros, NONORM" <<<$'CONV NONORM\n0 0 0'
bad "too large, NONORM" <<<$'CONV NONORM\n1 1e30 0'
bad "another word on the first line" <<<$'CONV MAYBE\n1 1'
bad "too many words" <<<$'CONV NORM 3x3\n1 1'
bad "neither text nor FITS" <<<'1 2 1'
printf 'CONV NORM\n1 \0 1\n' | bad "a byte of value 0"
perl "$TOP/tests/fits.pl" make bad.fits 3 3 '$x ? 1 : "nan"'
fails "a NaN in the image" 1 detect spots.fits --kernel-file bad.fits -o made
perl "$TOP/tests/fits.pl" make zero.fits 3 3 '0'
fails "an image of zeros" 1 detect spots.fits --kernel-file zero.fits -o made
fails "a file that is not there" 1 detect spots.fits --kernel-file nowhere.conv -o made
fails "two filters" 2 detect spots.fits --kernel-file g.conv -k 0.2 -o made
fails "standard input twice" 2 detect - --kernel-file - -o made
fails "the kernel as output" 1 detect spots.fits --kernel-file g.conv -o g.conv
awk 'BEGIN { print "CONV NORM"; for (j = 0; j < 401; j++) { for (i = 0; i < 401; i++) printf "%g ", (i - 200) ^ 2 + (j - 200) ^ 2 < 40000; print "" } }' >large.conv
fails "more memory than allowed" 1 detect spots.fits --kernel-file large.conv --max-memory 40e6 -o made
ok "as much as needed" detect -q spots.fits --kernel-file large.conv --max-memory 60e6 -o made
