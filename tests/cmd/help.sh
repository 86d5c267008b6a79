# The examples that --help shows work as they stand there, beside files of the names they use.
small_chain
cp true.fits clean.fits; cp noisy.fits field.fits; cp noisy.fits image.fits; cp half.fits fine.fits; cp dith.fits four.fits
cp cat.txt image.cat; cp scat.txt stars.cat; cp shapes.txt image.shapes
sed 's/^# Keyword: SETNAME.*//; s/^# Keyword: PIXSCALE/# Keyword: SETNAME = sim1\n&/' cut.txt >sim1-0.10-a.use
galgen --field 12 --stars -n 25 -o stars.txt
drizzle four.fits -o a.fits; addnoise -q -s 2 --depth 27 four.fits | drizzle - -o b.fits; drizzle four.fits --flat -o grid.fits
mkdir made
n=0
for p in "$BIN"/*; do
    name=$(basename "$p")
    "$name" --help | sed '1,/^examples:/d; s/^ *//' >lines
    while read -r line; do
        rm -rf made; mkdir made; cp ./*.fits ./*.txt ./*.cat ./*.shapes ./*.rrg ./*.use made
        n=$((n + 1))
        if (cd made && bash -e -o pipefail -c "$line") >out 2>err; then pass "$line"; else fail "$line: $(head -c 300 err)"; fi
    done <lines
done
between "examples" "$n" 22 40
