# The pipeline that README.md tells people to type works as it stands there.
awk '/^## /{ on = /pipeline/ } on && /^    /' "$TOP/README.md" | grep -v '^    export PATH' >pipeline.sh
between "lines of the pipeline" "$(wc -l <pipeline.sh)" 4 8
if bash -e -o pipefail pipeline.sh >out 2>&1; then pass "it runs"; else fail "it fails: $(tail -c 300 out)"; fi
between "objects found in one square arcminute" "$(grep -vc '^#' field.cat)" 80 400
if head -c 8 field.png | od -c | head -1 | grep -q 'P   N   G'; then pass "a picture comes out"; else fail "field.png is no PNG"; fi
