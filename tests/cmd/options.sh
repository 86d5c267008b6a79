# Every program's command line: the same words mean the same, mistakes exit 2
# with one line, --help fits a screen, data only on standard output.
bad_numbers() { # PROGRAM: prints a line for every numeric option that takes a bad number
    "$1" --completion | awk -F'\t' '$4 == "own" && $1 ~ /=$/ && $3 !~ /FILE|NAME|TYPE|EXPR|LIST/ { print substr($1, 1, length($1) - 1) }' |
    while read -r o; do
        for bad in 1.5abc nan 1e400 ''; do
            st=0
            "$1" "$o" "$bad" </dev/null >num.out 2>num.err || st=$?
            if [ $st -ne 2 ] || [ "$(wc -l <num.err)" -ne 1 ] || [ -s num.out ]; then
                echo "$o '$bad': exit $st: $(head -c 200 num.err)"
            fi
        done
    done
}
for p in "$BIN"/*; do
    n=$(basename "$p")
    st=0
    "$n" --help >help.txt 2>help.err || st=$?
    if [ $st -eq 0 ] && [ ! -s help.err ] && grep -q "^usage: $n " help.txt; then pass "$n --help"; else fail "$n --help (exit $st)"; fi
    between "$n --help, lines" "$(wc -l <help.txt)" 12 75
    near "$n --help, lines longer than 120 characters" "$(awk 'length > 120' help.txt | wc -l)" 0 0
    near "$n --help, lines that tell two defaults" "$(grep -c 'default.*\[[^]]*\]$' help.txt)" 0 0
    if "$n" --version | grep -qx "$n (pixshear) [0-9.]*"; then pass "$n --version"; else fail "$n --version"; fi
    for o in --output --seed --threads --max-memory --check --verbose --quiet --help --version; do
        grep -q -- "$o" help.txt || fail "$n --help lacks $o"
    done
    fails "$n: unknown option" 2 "$n" --no-such-option
    fails "$n: unknown letter" 2 "$n" -@
    fails "$n: misspelt option" 2 "$n" --sede 3
    grep -qx -- "$n: unknown option --sede: did you mean --seed?" cmd.err || fail "$n: --sede did not name --seed: $(cat cmd.err)"
    for bad in 0 257 1.5 abc '' nan 99999999999999999999; do fails "$n: --threads '$bad'" 2 "$n" --threads "$bad"; done
    for bad in -1 1.5 0x10 1e3 18446744073709551616; do fails "$n: --seed '$bad'" 2 "$n" --seed "$bad"; done
    for bad in 1X -5 nan inf; do fails "$n: --max-memory '$bad'" 2 "$n" --max-memory="$bad"; done
    bad_numbers "$n" >bad.txt
    if [ -s bad.txt ]; then fail "$n: bad numbers: $(head -5 bad.txt | tr '\n' ';')"; else pass "$n: bad numbers are usage errors"; fi
    if "$n" --help >/dev/full 2>err; then fail "$n --help to a full device succeeded"; else pass "$n --help to a full device fails"; fi
done

# letters that are decided mean the same in every program that has them
for p in "$BIN"/*; do "$p" --completion; done | awk -F'\t' '{ sub(/=$/, "", $1); print $2, $1 }' | sort -u >letters.txt
for l in "o output" "s seed" "j threads" "q quiet" "v verbose" "h help" "V version" "p psf" "z zeropoint" "T exptime"; do
    set -- $l
    if [ "$(grep "^$1 " letters.txt)" = "$1 --$2" ]; then pass "-$1 is --$2 everywhere"; else fail "-$1 is $(grep "^$1 " letters.txt | tr '\n' ' ')"; fi
done
