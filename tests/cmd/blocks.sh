# Catalogues of many blocks of rows through cutcat and fom: the rows that awk finds, in memory that does not grow with them.
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
