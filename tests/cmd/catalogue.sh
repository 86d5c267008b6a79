# Malformed catalogues: exit status 1 and one line that names file and cause, through galgen --library.
H='# ID BETA NMAX MAG COEFFS'
bad() { # WHAT PATTERN: standard input is the catalogue
    local what=$1 want=$2 got=0
    cat >bad.cat
    galgen --library bad.cat -n 3 -o out.txt >cmd.out 2>cmd.err || got=$?
    if [ $got -eq 1 ] && [ "$(wc -l <cmd.err)" -eq 1 ] && grep -q "^galgen: bad.cat: .*$want" cmd.err && [ ! -e out.txt ]; then pass "$what: $(cut -c1-110 cmd.err)"
    else fail "$what (exit $got: $(head -c 300 cmd.err))"; rm -f out.txt; fi
}
good() { # WHAT: standard input must be read
    cat >good.cat
    ok "$1" galgen --library good.cat -n 3 -o out.txt
    rm -f out.txt
}
n=0
row() { printf '%s\n' "$H" "1 0.1 0 24 5.64"; [ $# -eq 0 ] || printf '%s\n' "$@"; }

bad "empty file" "the file is empty" </dev/null
row "2 0.1 0 25 1.5abc" | bad "letters behind a number" "line 3: column COEFFS: '1.5abc' is not a number"
row "2 0.1x 0 25 1" | bad "letters in BETA" "line 3: column BETA: '0.1x' is not a number"
row "2 0,1 0 25 1" | bad "decimal comma" "line 3: column BETA: '0,1'"
row "2 0x1p-3 0 25 1" | bad "hexadecimal" "line 3: column BETA: '0x1p-3'"
row "2 inf 0 25 1" | bad "infinity" "line 3: column BETA: 'inf'"
row "2 -Infinity 0 25 1" | bad "infinity in full" "line 3: column BETA: '-Infinity'"
row "2 1e999 0 25 1" | bad "overflow" "line 3: column BETA: '1e999' is too large"
row "2 0.1 0 25 1e999" | bad "overflow of a coefficient" "line 3: column COEFFS: '1e999' is too large"
row "2 nan 0 25 1" | bad "BETA nan" "row 2 (ID 2): BETA nan"
row "2 0.1 0 25 nan" | bad "coefficient nan" "row 2 (ID 2): coefficient 1 is not finite"
row "2 0.1 0 nan 1" | bad "MAG nan" "row 2: MAG is not a number"
row "2 0.1 nan 25 1" | bad "NMAX nan" "column NMAX must hold whole numbers"
row "2 0 0 25 1" | bad "BETA 0" "row 2 (ID 2): BETA 0 must be > 0"
row "2 -0.1 0 25 1" | bad "BETA negative" "row 2 (ID 2): BETA -0.1 must be > 0"
row "2 0.1 -1 25 1" | bad "NMAX -1" "NMAX -1 must be in 0..60"
row "2 0.1 61 25 1" | bad "NMAX 61" "NMAX 61 must be in 0..60"
row "2 0.1 99999999999999999999 25 1" | bad "NMAX beyond int64" "line 3: column NMAX: '99999999999999999999' is too large"
row "2 0.1 4294967296 25 1" | bad "NMAX that wraps to 0" "NMAX 4294967296 must be in 0..60"
row "2 0.1 1.0 25 1 2 3" | bad "NMAX not whole" "column NMAX must hold whole numbers"
row "2 0.1 1 25 1 2" | bad "a coefficient too few" "2 COEFFS where NMAX 1 needs 3"
row "2 0.1 1 25 1 2 3 4" | bad "a coefficient too many" "4 COEFFS where NMAX 1 needs 3"
row "2 0.1 1 25" | bad "no coefficients" "line 3: 4 cells where the header names 5 columns"
row "2 0.1" | bad "row cut off" "line 3: 2 cells"
row "1 0.1 0 25 1" | bad "ID twice" "rows 1 and 2 both have ID 1"
row "1.5 0.1 0 25 1" | bad "ID not whole" "column ID must hold whole numbers"
row "2 0.1 0 25 1" "# ID BETA MAG NMAX COEFFS" "3 0.1 25 0 1" | bad "a second header" "line 4: a second header with other columns"
printf '%s\n' "1 0.1 0 24 5.64" | bad "no header" "no column names"
printf '%s\n' "# id beta nmax mag coeffs" "1 0.1 0 24 5.64" | bad "names in small letters" "no column names"
printf '%s\n' "# ID BETA NMAX MAG" "1 0.1 0 24" | bad "no COEFFS" "no column COEFFS"
printf '%s\n' "# BETA NMAX MAG COEFFS" "0.1 0 24 5" | bad "no ID" "no column ID"
printf '%s\n' "# ID BETA NMAX COEFFS" "1 0.1 0 5" | bad "no MAG" "MAG is not a number"
printf '%s\n' "# ID COEFFS NMAX MAG BETA" "1 5 0 24 0.1" | bad "COEFFS not last" "COEFFS must be the last column"
printf '%s\n' "# ID BETA BETA NMAX MAG COEFFS" "1 1 1 0 24 5" | bad "a name twice" "names column BETA twice"
printf '%s\n' "$H" "# Column 2: SIZE [arcsec,f64] some size" "1 0.1 0 24 5" | bad "two names of a column" "calls column 2 both SIZE and BETA"
printf '%s\n' "$H" "# Column 1: ID [,f128] a number" "1 0.1 0 24 5" | bad "unknown type" "line 2: type 'f128' is unknown"
printf '%s\n' "$H" "# Column 1: ID [,i64 a number" "1 0.1 0 24 5" | bad "open bracket" "line 2: a bracket is not closed"
printf '%s\n' "$H" "# Column x: ID [,i64] a number" "1 0.1 0 24 5" | bad "column without number" "line 2: '# Column'"
printf '%s\n' "$H" "# Column 0: ID [,i64] a number" "1 0.1 0 24 5" | bad "column 0" "line 2: column number 0 is not in 1..4096"
printf '%s\n' "$H" "# Column 4000000000: ID [,i64] a number" "1 0.1 0 24 5" | bad "column 4e9" "line 2: column number 4000000000 is not in 1..4096"
printf '%s\n' "$H" "# Column 1: ID [,i64] a number" "1e2 0.1 0 24 5" | bad "1e2 as a whole number" "line 3: column ID: '1e2' is not a whole number"
printf '%s\n' "$H" "# Keyword: SEED 5" "1 0.1 0 24 5" | bad "keyword without =" "line 2: a Keyword line"
printf '%s\n' "$H" "# Keyword: SEED = 5" "# Keyword: SEED = 6" "1 0.1 0 24 5" | bad "keyword twice" "line 3: keyword SEED is given twice"
printf '%s\n' "$H" | bad "no rows" "the catalogue is empty"
printf '%s\n1 0.1 0 24 5\0 6\n' "$H" | bad "NUL byte" "line 2: a NUL byte"
{ row; head -c 70000 /dev/zero | tr '\0' 1; echo; } | bad "line of 70000 bytes" "line 3: longer than 65536 bytes"
{ row; printf '2 0.1 0 25'; for ((n = 0; n < 4200; n++)); do printf ' 1'; done; echo; } | bad "4204 cells" "line 3: more than 4096 cells"
head -c 100000 /dev/urandom | tr '\0\n' '\1\2' | sed 's/^S/T/; s/^\x1f/T/' | bad "noise" ""
printf 'SIMPLE  =                    T' | bad "FITS cut off" ""
printf '\x1f\x8b\x08\x00' | bad "gzip cut off" ""
row "2 0.1 0 25 --5" | bad "two signs" "'--5' is not a number"
row "2 0.1 0 25 5e" | bad "exponent without digits" "'5e' is not a number"
row "2 0.1 0 25 5d3" | bad "Fortran exponent" "'5d3' is not a number"
row "2 0.1 0 25 1_0" | bad "underscore" "'1_0' is not a number"
row "2 0.1 0 25 *****" | bad "stars" "'\*\*\*\*\*' is not a number"
row "2 0.1 0 25 $(printf '\033[2J')" | bad "control characters" "is not a number"
near "control characters are not passed on" "$(tr -d '\n' <cmd.err | tr -cd '\000-\037' | wc -c)" 0 0

# ---- what must work ----
row | good "one row"
row "2 +.1e0 0 2500E-2 -5." | good "all forms of numbers"
row | tr ' ' '\t' | good "tabs"
row | sed 's/$/\r/' | good "CRLF"
row | head -c -1 | good "no newline at the end"
printf '\n%s\n\n# a comment\n   \n  2   0.1 0 25 3   \n' "$H" | good "empty lines, comments, blanks"
printf '#   1 ID     Number of it\n#   2 BETA   Scale [arcsec]\n#   3 NMAX   Order\n#   4 MAG    Magnitude [mag]\n#   5 COEFFS Coefficients\n1 0.1 1 24 5 1 1\n' | good "Source Extractor's header"
printf '# words about it\n# ID BETA NMAX MAG EXTRA COEFFS\n1 0.1 0 24 word 5\n2 0.1 0 24 other 5\n' | good "a column of words that nobody asked for"
{ printf '%s\n' "$H"; awk 'BEGIN { printf "1 0.1 60 24"; for (i = 0; i < 1891; i++) printf " %.17g", 1 / (i + 3); print "" }'; } | good "order 60, 36 kB in a line"

# ---- round trip through every program's reader and writer ----
{ row "2 0.3333333333333333 2 25.125 1 -2e-300 3.0000000000000004 4 5e+20 6"; } >in.cat
ok "read and write" galgen --library in.cat --models once.cat -n 1 -o x.txt
ok "read and write again" galgen --library once.cat --models twice.cat -n 1 -o x.txt
same "rows come back bit by bit" <(grep -v '^#' in.cat) <(grep -v '^#' once.cat)
same "and headers too" <(grep -v HISTORY once.cat) <(grep -v HISTORY twice.cat)
near "the history grows" "$(grep -c '^# HISTORY' twice.cat)" 2 0

# ---- cost of bad input: under 64 MiB and 1 s ----
head -c 1000000 /dev/zero | tr '\0' 'A' | sed 's/^/# /' >wide.cat
{ printf '#'; for ((n = 0; n < 4096; n++)); do printf ' C%d' $n; done; echo; for ((n = 0; n < 100; n++)); do echo "1 2 3"; done; } >columns.cat
for f in wide columns; do
    if ldd "$BIN/galgen" | grep -qE 'asan|tsan'; then skip "$f.cat in little memory: a sanitizer reserves far more"; continue; fi
    got=0
    peak cost timeout 20 galgen --library $f.cat -n 1 -o out.txt 2>cmd.err || got=$?
    read -r kib ms wall <cost
    near "$f.cat: exit status" $got 1 0
    between "$f.cat: KiB" $kib 100 65536
    between "$f.cat: ms of the processor" $ms 0 1000
done
