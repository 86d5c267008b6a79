# lib.sh - sourced by tests/bench/*: whole processes, CPU seconds (user +
# system), runs in turn, medians; ratios are taken pair by pair, so that they
# hold when the machine's speed drifts.
LC_ALL=C; export LC_ALL
RUNS=${RUNS:-5}
seconds() { # COMMAND...: CPU seconds of one run
    local t
    t=$( { TIMEFORMAT='%U %S'; time "$@" >/dev/null 2>bench.err; } 2>&1 ) || { echo "bench: failed: $*: $(head -c 300 bench.err)" >&2; return 1; }
    awk '{ print $1 + $2 }' <<<"$t"
}
median() { sort -g | awk '{ v[NR] = $1 } END { print NR % 2 ? v[(NR + 1) / 2] : (v[NR / 2] + v[NR / 2 + 1]) / 2 }'; }
# cpu LABEL COMMAND...: prints the median
cpu() {
    local label=$1 i; shift
    "$@" >/dev/null 2>&1
    for ((i = 0; i < RUNS; i++)); do seconds "$@"; done | median | awk -v l="$label" '{ printf "%-64s %8.3f s\n", l, $1 }'
}
# versus LABEL "COMMAND A" "COMMAND B": medians of both and of the ratio B/A
versus() {
    local i a b
    (eval "$2"; eval "$3") >/dev/null 2>&1
    for ((i = 0; i < RUNS; i++)); do
        a=$(seconds eval "$2") b=$(seconds eval "$3")
        echo "$a $b"
    done >pairs
    printf '%-52s %8.3f s, peer %8.3f s, ratio %6.2f\n' "$1" "$(cut -d' ' -f1 pairs | median)" "$(cut -d' ' -f2 pairs | median)" \
        "$(awk '{ print $2 / ($1 > 0 ? $1 : 0.001) }' pairs | median)"
}
