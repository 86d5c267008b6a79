# Peak memory of simage with all galaxies at the default accuracy as well.
# shellcheck disable=SC2034
LARGE=1
. "$TOP/tests/cmd/memory.sh"
