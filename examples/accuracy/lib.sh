# lib.sh - sourced with the directory of results: work there, and measure.
LC_ALL=C
export LC_ALL
top=$(cd ../.. && pwd)
PATH=$top/bin:$top/build/tool:$PATH
mkdir -p "$1"
cd "$1"
# cpu COMMAND...: CPU seconds, the least of two runs
cpu() {
    local i
    for i in 1 2; do
        { TIMEFORMAT='%U %S'; time "$@" >/dev/null 2>cpu.err; } 2>&1 | awk '{ print $1 + $2 }'
    done | sort -g | sed -n 1p
}
# pick FILE NAME...: columns of a text catalogue, a line a row
pick() {
    awk -v want="${*:2}" 'BEGIN { n = split(want, w, " ") }
        /^#/ { line = $0; next } !c[1] { k = split(line, h, " "); for (i = 2; i <= k; i++) for (j = 1; j <= n; j++) if (h[i] == w[j]) c[j] = i - 1 }
        { for (j = 1; j <= n; j++) printf "%s%s", $(c[j]), j < n ? " " : "\n" }' "$1"
}
