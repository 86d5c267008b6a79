# examples/threshold on a small field: the noise of a pixel hides that objects fall with pixel scale.
if make -s -C "$TOP/examples/threshold" TOP="$(dirname "$BIN")" OUT="$PWD/out" FIELD=50 SCALES="0.04 0.10 0.16" "$PWD/out/threshold.txt" >make.txt 2>&1
then pass "the table is made"; else fail "make: $(tail -3 make.txt)"; fi
at() { awk -v s="$1" '$1 == s { print '"$2"' }' out/threshold.txt; }
between "filtered noise: objects less false ones at 0.16 arcsec over those at 0.04" "$(awk "BEGIN { print $(at 0.16 '$4 - $5') / $(at 0.04 '$4 - $5') }")" 0.3 0.65
between "noise of a pixel: the same" "$(awk "BEGIN { print $(at 0.16 '$2 - $3') / $(at 0.04 '$2 - $3') }")" 1.1 2
near "the two at 0.10 arcsec" "$(at 0.10 '$2 - $4')" 0 0.5
between "1.5 sigma of a pixel in sigma of the filtered image at 0.04 arcsec, over that at 0.16" "$(awk "BEGIN { print $(at 0.04 '$6') / $(at 0.16 '$6') }")" 4 6
