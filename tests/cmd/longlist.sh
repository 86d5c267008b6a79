# Scene lists longer than the block that simage plans and draws at a time (16384 objects).
galgen --field 12 -n 40 --models m.txt -o g.txt
psfgen --pupil-grid 64 --size 32 -o psf.fits
S="-x 0.1 --size 60,50 --models m.txt -q"
# 40005 objects of all types: two blocks and a rest, and rows that end inside a block of the reader
awk 'function w() { print "# Column 1: ID [,i64] i\n# Column 2: DX [,f64] x\n# Column 3: DY [,f64] y\n# Column 4: FLUX [,f64] f\n# Column 5: TYPE [,str8] t\n# Column 6: MODEL [,i64] m\n# Column 7: RE [,f64] r\n# Column 8: N [,f64] n\n# Keyword: SEED = 9\n# ID DX DY FLUX TYPE MODEL RE N" }
    BEGIN { w(); split("star gauss shapelet star star", type, " "); for (i = 0; i < 40005; i++)
        printf "%d %.4f %.4f %.6g %s %d %.4f 1.5\n", i + 1, (i * 37 % 600 - 300) / 100, (i * 91 % 500 - 250) / 100, 1e-3 * (1 + i % 11), type[1 + i % 5], 1 + i % 40, 0.02 + i % 7 / 100 }' >long.txt
slice() { awk -v a="$1" -v b="$2" '/^#/ || (++n >= a && n <= b)' long.txt; }
slice 1 16384 >part1.txt; slice 16385 32768 >part2.txt; slice 32769 99999 >part3.txt
sum() { pix sum "$1"; }
diff() { pix diff "$1" "$2" | cut -d' ' -f1; }
tac long.txt | grep -v '^#' >rows.txt
grep '^#' long.txt | cat - rows.txt >back.txt
for o in "" "-p psf.fits --accuracy 1e-2 --shear 0.05,0.02" "-p psf.fits --accuracy 1e-2 --method field"; do
    ok "long list $o" simage long.txt $S $o --truth t.txt -o long.fits
    cp t.txt t1.txt
    ok "the same, two threads" simage long.txt $S $o -j 2 --truth t.txt -o long2.fits
    same "long list $o: same bytes for 1 and 2 threads" long.fits long2.fits
    same "long list $o: the same truth" t1.txt t.txt
    for k in 1 2 3; do simage part$k.txt $S $o -o part$k.fits; done
    near "long list $o: the light of its three parts, relative" "$(awk -v a="$(sum long.fits)" -v b="$(sum part1.fits)" -v c="$(sum part2.fits)" -v d="$(sum part3.fits)" 'BEGIN { print a / (b + c + d) - 1 }')" 0 2e-8
    simage - $S $o --truth t.txt -o pipe.fits <long.txt
    near "long list $o: from a pipe" "$(diff long.fits pipe.fits)" 0 0
    simage back.txt $S $o -o back.fits
    near "long list $o: the last first, so that blocks differ: of the brightest pixel" "$(diff long.fits back.fits)" 0 2e-7
done
simage part1.txt $S -p psf.fits --accuracy 1e-2 --shear 0.05,0.02 -o one.fits
for k in 2 3; do simage part$k.txt $S -p psf.fits --accuracy 1e-2 --shear 0.05,0.02 -o part$k.fits; done
simage long.txt $S -p psf.fits --accuracy 1e-2 --shear 0.05,0.02 -o long.fits
# every row is in the truth, in order, once
same "the truth has all rows in order" <(col t.txt ID) <(col long.txt ID)
same "with their columns" <(col t.txt TYPE) <(col long.txt TYPE)
near "and places: the last" "$(awk -v x="$(col t.txt X_IMAGE | tail -1)" -v d="$(col long.txt DX | tail -1)" 'BEGIN { print x - 30.5 - d / 0.1 }')" 0 1e-9
simage long.txt $S --truth t.fits -o long.fits
ok "truth as FITS: all rows" cutcat t.fits --only-where -o all.txt
same "in order" <(col all.txt ID) <(col long.txt ID)
# the plan counts all blocks
simage long.txt $S -p psf.fits --accuracy 1e-2 --check 2>plan.txt
near "--check counts all objects" "$(awk '/parts$/ { print $(NF - 1) }' plan.txt)" 40005 0
near "and all stamps" "$(awk '/ stamps of / || /outside or dark/ { n += $2 } END { print n }' plan.txt)" 40005 0
simage - $S -p psf.fits --accuracy 1e-2 --check <long.txt 2>pipe.txt
same "--check of a pipe" pipe.txt plan.txt
# one that cannot be drawn in each block: counted together
sed -e '/^#/!s/$/ 0 0/' -e 's/ RE N$/ RE N G2 ROT/' -e 's/^# Keyword: SEED.*/# Column 9: G2 [,f64] g\n# Column 10: ROT [,f64] r/' long.txt |
    awk '/^#/ { print; next } ++n % 16384 == 7 { $5 = "gauss"; $9 = "0.9999999999" } { print }' >thin.txt
simage thin.txt ${S/ -q/} -o thin.fits 2>warn.txt
grep -q ': 3 objects cannot be drawn' warn.txt && pass "3 thin ones counted" || fail "thin ones: $(cat warn.txt)"
# an error in a late row: named by its number in the list, and nothing is left
awk '/^#/ || ++n != 39999 { print; next } { $4 = "1e31"; print }' long.txt >late.txt
fails "a bad number in row 39999" 1 simage late.txt $S --truth none.txt -o none.fits
grep -q 'row 39999: FLUX 1e+31' cmd.err && pass "named by its row" || fail "late row: $(cat cmd.err)"
[ ! -e none.fits ] && [ ! -e none.txt ] && pass "nothing is left" || fail "left: $(ls none.*)"
# lists that end where a block of the reader does
for n in 2048 4096 16384; do
    slice 1 $n >even.txt
    simage even.txt $S -o even.fits -v --truth t.txt 2>v.txt
    near "a list of $n rows" "$(awk '/parts$/ { print $(NF - 1) }' v.txt)" $n 0
    near "and its truth" "$(grep -vc '^#' t.txt)" $n 0
done
