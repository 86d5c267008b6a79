# Pages and programs agree: every option of the table is in the page with its
# letter, the page has no other, mandoc finds nothing, the examples run.
have_mandoc=$(command -v mandoc)
[ -n "$have_mandoc" ] || skip "mandoc is not installed: pages are not linted"
page_options() { # FILE: "name letter" of every ".It Fl" item
    sed -n 's/^\.It Fl //p' "$1" | sed 's/\\-/-/g' | awk '{
        letter = "-"; name = ""
        for (i = 1; i <= NF; i++) {
            w = $i
            if (w == "Fl" || w == "," || w == "Ns") continue
            if (w == "Ar" || w == "Cm" || w == "=" || w == "Oo") break
            if (w ~ /^-[a-z]/) name = substr(w, 2)
            else if (length(w) == 1) letter = w
            else if (name == "") name = w
        }
        sub(/[=,].*/, "", name)
        if (name != "") print name, letter }' | sort -u |
        grep -vE '^(output|seed|threads|max-memory|check|verbose|quiet|help|version|completion) '
}
for f in "$TOP"/man/*.[17]; do
    n=$(basename "${f%.*}")
    if [ -n "$have_mandoc" ]; then
        mandoc -T lint -W warning "$f" >lint.txt 2>&1
        if [ -s lint.txt ]; then fail "$n: mandoc: $(head -3 lint.txt | tr '\n' ' ')"; else pass "$n: mandoc finds nothing"; fi
    fi
    [ -x "$BIN/$n" ] || continue
    "$n" --completion | awk -F'\t' '$4 == "own" { sub(/^--/, "", $1); sub(/=$/, "", $1); print $1, $2 }' | sort >table.txt
    page_options "$f" >page.txt
    if diff table.txt page.txt >diff.txt; then pass "$n: the page has the $(wc -l <table.txt) options of the program"
    else fail "$n: page and program differ: $(grep '^[<>]' diff.txt | tr '\n' ' ')"; fi
    for s in NAME SYNOPSIS DESCRIPTION OPTIONS "EXIT STATUS" EXAMPLES ACCURACY "SEE ALSO"; do
        grep -qx "\.Sh $s" "$f" || fail "$n: the page has no section $s"
    done
done
for p in "$BIN"/*; do [ -f "$TOP/man/$(basename "$p").1" ] || fail "no page for $(basename "$p")"; done

# literal blocks of EXAMPLES, run as one script in an empty directory
for f in "$TOP"/man/*.1; do
    n=$(basename "${f%.1}")
    awk '/^\.Sh/ { on = /EXAMPLES/ } on && /^\.Bd -literal/ { lit = 1; next } /^\.Ed/ { lit = 0 } lit' "$f" |
        sed 's/\\e/\\/g; s/\\(aq/'"'"'/g; s/\\-/-/g; s/^\\&//; s/^[$%] //' >"$n.sh"
    if [ ! -s "$n.sh" ]; then fail "$n: no examples"; continue; fi
    mkdir "dir-$n"
    if (cd "dir-$n" && bash -e -o pipefail "../$n.sh") >"$n.out" 2>&1; then pass "$n: its examples run"
    else fail "$n: examples: $(tail -c 300 "$n.out" | tr '\n' ' ')"; fi
    rm -rf "dir-$n"
done
