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
