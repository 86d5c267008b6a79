# Catalogues of many blocks of rows through cutcat, fom and rrgshape: the rows that awk finds, in memory that does not grow with them.
rows=120000
awk -v n=$rows 'BEGIN { print "# Column 1: ID [,i64] number of the row\n# Column 2: NAME [,str6] a word\n# Column 3: X [px,f64] some value\n# Column 4: Y [px,f32] another value"
    for (k = 5; k <= 12; k++) printf "# Column %d: P%d [,f64] to fill\n", k, k
    printf "# ID NAME X Y"; for (k = 5; k <= 12; k++) printf " P%d", k; print ""
    for (i = 1; i <= n; i++) { printf "%d w%d %.6f %g", i, i * (i > n - 9), sin(i), i % 97; for (k = 5; k <= 12; k++) printf " %.5f", cos(i * k); print "" } }' >in.txt
awk '!/^#/ && $3 < 0.5 && $2 != "w7" { print $1, $2, $3 }' in.txt >want
cut_it() { cutcat "$1" --only-where --where 'X<0.5' --where 'NAME!=w7' --columns ID,NAME,X -o "$2"; }
cut_it in.txt out.txt; same "text" <(grep -v '^#' out.txt | awk '{ printf "%d %s %.6f\n", $1, $2, $3 }') want
cut_it in.txt out.fits; cutcat out.fits --only-where -o out.again
same "to FITS and back" <(grep -v '^#' out.again | awk '{ printf "%d %s %.6f\n", $1, $2, $3 }') want
near "rows of the FITS table" "$(fold -w 80 out.fits 2>/dev/null | grep -a -m1 NAXIS2 | awk '{ print $3 }')" "$(wc -l <want)" 0
near "words as long as the longest, which is in the last block" "$(fold -w 80 out.fits 2>/dev/null | grep -a -m1 TFORM2 | tr -cd '0-9' | sed 's/^2//')" 7 0
cutcat in.txt --only-where -o in.fits; cut_it in.fits two.fits; same "FITS to FITS" <(tail -c +20000 out.fits) <(tail -c +20000 two.fits)
cut_it - pipe.txt <in.txt; same "standard input" <(grep -v '^#' pipe.txt) <(grep -v '^#' out.txt)
# shellcheck disable=SC2002
cat in.txt | cut_it - - >pipe.txt; same "pipes on both sides" <(grep -v '^#' pipe.txt) <(grep -v '^#' out.txt)
gzip -k in.txt; cut_it in.txt.gz zip.txt; same "gzip" <(grep -v '^#' zip.txt) <(grep -v '^#' out.txt)
grep -v Column in.txt >plain.txt; cut_it plain.txt plain.out; same "a header without types" <(grep -v '^#' plain.out | awk '{ printf "%d %s %.6f\n", $1, $2, $3 }') want
# shellcheck disable=SC2002
cat plain.txt | cut_it - plain.two; same "without types from a pipe" <(grep -v '^#' plain.two) <(grep -v '^#' plain.out)
cutcat in.txt --only-where --where 'X<0.5' --where 'NAME!=w7' --mark -o mark.txt
near "--mark: all rows" "$(grep -vc '^#' mark.txt)" $rows 0
same "marks" <(grep -v '^#' mark.txt | awk '$13 == 0 { print $1 }') <(cut -d' ' -f1 want)
awk -v n=$rows 'NR == 5 + 8 + n - 3 { $3 = "1.5x" } { print }' in.txt >bad.txt
fails "a bad number in the last block" 1 cutcat bad.txt --only-where -o bad.out
if grep -q 'line [0-9]*: column X' cmd.err && [ ! -e bad.out ]; then pass "its line: $(cat cmd.err)"; else fail "bad.txt: $(cat cmd.err)"; fi
if TMPDIR=/nowhere cutcat in.txt --only-where -o no.txt 2>tmp.err || [ -e no.txt ]; then fail "no folder for the spool"; else pass "no folder for the spool: $(cat tmp.err)"; fi

# rows of any length, over several blocks
awk 'BEGIN { print "# ID COEFFS"; for (i = 1; i <= 9000; i++) { printf "%d", i; for (k = 0; k <= i % 40; k++) printf " %d", i + k; print "" } }' >ragged.txt
awk '/^#/ || $1 >= 4000' ragged.txt >ragged.want
cutcat ragged.txt --only-where --where 'ID>=4000' -o ragged.out; same "rows of any length" <(grep -v '^#' ragged.out) <(grep -v '^#' ragged.want)
cutcat ragged.txt --only-where --where 'ID>=4000' -o ragged.fits; cutcat ragged.fits --only-where -o ragged.out; same "to FITS and back" <(grep -v '^#' ragged.out) <(grep -v '^#' ragged.want)

# rrgshape: the objects of a small catalogue, again and again, have the same shapes again and again
psfgen --size 64 -o psf.fits
galgen -n 60 --field 20 --models m.txt -o s.txt
simage s.txt --models m.txt -p psf.fits -x 0.1 --size 200,200 --accuracy 1e-2 | addnoise --depth 27.7 -o f.fits
detect -q f.fits --threshold 1.5 --threshold-noise pixel -o one.cat
objects=12000
often() { # FILE: its rows up to so many
    grep -v '^#' "$1" | awk -v n=$objects '{ r[m++] = $0 } END { for (i = 0; i < n && m; i++) print r[i % m] }'
}
{ grep '^#' one.cat; often one.cat; } >many.cat
awk '/^# NUMBER/ { print $0, "WORD"; next } /^#/ { print; next } { print $0, ++n < 11990 ? "w" : "w" n }' many.cat >words.cat
shapes() { rrgshape -q f.fits "$1" --psf psf.fits --plain "$2.plain$3" --region "$2.reg" -o "$2.out$3"; }
shapes one.cat one
for f in out plain; do often one.$f >want.$f; done
rows_of() { grep -v '^#' "$1"; }
shapes many.cat many; same "shapes of text" <(rows_of many.out) want.out; same "--plain" <(rows_of many.plain) want.plain
near "one ellipse for each object" "$(grep -c '^ellipse' many.reg)" "$(often one.out | awk '$22 != "nan" && $23 != "nan"' | wc -l)" 0
cp many.out text.out; shapes many.cat many .fits; cutcat many.out.fits --only-where -o many.out; cutcat many.plain.fits --only-where -o many.plain
same "to FITS and back" <(rows_of many.out) want.out; same "--plain to FITS and back" <(rows_of many.plain) want.plain
cutcat many.cat --only-where -o in.cat.fits; shapes in.cat.fits many; same "from FITS" <(rows_of many.out) want.out
# shellcheck disable=SC2002
cat many.cat | shapes - many; same "from a pipe" <(rows_of many.out) want.out
rrgshape -q -j 2 f.fits many.cat --psf psf.fits --plain two.plain -o two.out; same "two threads" <(rows_of two.out) want.out; same "two threads, --plain" <(rows_of two.plain) want.plain
shapes words.cat words; same "words, as long as they are" <(rows_of words.out | cut -d' ' -f 1-20,22-) want.out
near "and the longest, of the last block, in the header" "$(grep -c '^# Column 21: WORD .*str6' words.out)" 1 0
shapes many.out again; same "columns that are there already" <(rows_of again.out) want.out
near "--check counts" "$(rrgshape f.fits many.cat --psf none --check 2>&1 | awk '{ print $3 }')" $objects 0
near "-v counts" "$(rrgshape -v f.fits many.cat --psf none -o v.out 2>&1 | tail -1 | awk '{ print $3 }')" $objects 0
rm -f bad.*
awk '!/^#/ && ++n == 11990 { $3 = "1.5x" } { print }' many.cat >wrong.cat
fails "a bad number in the last block of objects" 1 shapes wrong.cat bad
awk '!/^#/ && ++n == 11990 { NF-- } { print }' many.cat >wrong.cat
fails "a short row" 1 shapes wrong.cat bad
if grep -q "header names $(grep '^# NUMBER' one.cat | tail -1 | awk '{ print NF - 1 }') columns" cmd.err; then pass "the columns of the file are counted"; else fail "columns: $(cat cmd.err)"; fi
awk '!/^#/ && ++n == 11990 { sub("NUMBER", "OTHER", head); print head } /^# NUMBER/ { head = $0 } { print }' many.cat >wrong.cat
fails "a second header among the rows" 1 shapes wrong.cat bad
if ls bad.* >/dev/null 2>&1; then fail "left: $(echo bad.*)"; else pass "no catalogue, no region file"; fi

if ldd "$BIN/cutcat" | grep -qE 'asan|tsan'; then skip "a sanitizer reserves far more memory than the program takes"; exit 0; fi
small() { # WHAT COMMAND...: 120000 rows of 13 columns are 12 MB of numbers, and 13 of text
    local what=$1; shift
    peak peak.txt "$@" >cmd.out 2>cmd.err || fail "$*: $(cat cmd.err)"
    between "$what: KiB" "$(cut -d' ' -f1 peak.txt)" 2000 20000
}
small "text" cutcat in.txt --only-where -o mem.out
small "FITS" cutcat in.fits --only-where -o mem.fits
small "text to a pipe" cutcat in.txt --only-where
small "without types" cutcat plain.txt --only-where -o mem.out
awk -v n=60000 'BEGIN { print "# Keyword: SETNAME = big\n# Keyword: PIXSCALE = 0.1\n# Keyword: SHEAR1 = 0\n# Keyword: SHEAR2 = 0\n# Keyword: AREA = 2500"
    printf "# NUMBER X_IMAGE Y_IMAGE E1 E2 E1ERR E2ERR P11 P22"; for (k = 0; k < 40; k++) printf " FILL%d", k; print ""
    for (i = 0; i < n; i++) { printf "%d %d %d %.3f %.3f 0.05 0.05 1.25 1.25", i + 1, 30 * (i % 300), 30 * int(i / 300), sin(i) / 2, cos(i) / 2; for (k = 0; k < 40; k++) printf " 1.5"; print "" } }' >g.txt
small "fom keeps what it uses: 49 columns" fom -q --draws 0 g.txt -o g.cat
small "shapes of 12000 objects, text" rrgshape -q f.fits many.cat --psf none -o mem.out
small "shapes to FITS, twice" rrgshape -q f.fits in.cat.fits --psf none --plain mem.plain.fits -o mem.fits
small "shapes to a pipe" rrgshape -q f.fits in.cat.fits --psf none
