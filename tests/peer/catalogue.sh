# Do other people's readers understand our catalogues?  Names, units, types and every number.
ok "a scene and its models" galgen -n 200 --models m.txt -o s.txt
# the data of an image of 600 x 600 pixels: the last 500 blocks
pixels() { tail -c 1440000 "$1"; }
ok "an image" simage s.txt --models m.txt -x 0.1 --size 600,600 -o image.fits
ok "stars" galgen --stars -o stars.txt
py=$(for p in python3 /usr/bin/python3; do "$p" -c 'import numpy' 2>/dev/null && { command -v "$p"; break; }; done)
if [ -n "$py" ]; then
    "$py" - <<'P' >numpy.out 2>numpy.err
import numpy as np
t = np.genfromtxt('s.txt', names=True, dtype=None, encoding=None)
print(','.join(t.dtype.names), len(t), t['TYPE'][0], t['ID'].dtype.kind)
a = np.loadtxt('stars.txt', usecols=(0, 1, 2, 3))
print(a.shape[0], a[:, 3].min(), a[:, 3].max())
P
    same "numpy genfromtxt(names=True) and loadtxt" numpy.out <(printf '%s\n' "ID,DX,DY,MAG,TYPE,MODEL,RE,Q,PA,BT 200 shapelet i" "400 21.0 21.0")
else
    skip "numpy is not here"
fi
py=$(for p in python3 /usr/bin/python3; do "$p" -c 'import astropy' 2>/dev/null && { command -v "$p"; break; }; done)
if [ -n "$py" ]; then
    "$py" - <<'P' >astropy.out 2>astropy.err
from astropy.io import ascii
t = ascii.read('s.txt')
print(','.join(t.colnames), len(t), t['DX'].unit, t['DX'].description)
rows = [l.split() for l in open('s.txt') if l[0] != '#']
print(all(float(r[i]) == float(t[c][k]) for k, r in enumerate(rows) for i, c in enumerate(t.colnames) if c != 'TYPE'))
P
    "$py" -c "
from astropy.table import Table
Table.read('s.txt', format='ascii').write('ap.fits')" 2>>astropy.err
    ok "astropy's FITS table as a scene" simage ap.fits --models m.txt -x 0.1 --size 600,600 -o ap_image.fits
    same "gives the same pixels" <(pixels ap_image.fits) <(pixels image.fits)
    same "astropy ascii.read" astropy.out <(printf '%s\n' "ID,DX,DY,MAG,TYPE,MODEL,RE,Q,PA,BT 200 arcsec Position from the field centre, rightwards" True)
else
    skip "astropy is not here"
fi
if command -v asttable >/dev/null; then
    asttable s.txt -i >table.out 2>table.err
    near "asttable: columns with unit and type" "$(grep -cE '^[0-9]+ +(ID +n/a +int64|DX +arcsec +float64|TYPE +n/a +string|PA +deg +float64) ' table.out)" 4 0
    near "asttable: rows" "$(sed -n 's/^Number of rows: //p' table.out)" 200 0
    same "asttable: numbers" <(asttable s.txt -cDX | awk '{ printf "%.7f\n", $1 }') <(col s.txt DX | awk '{ printf "%.7f\n", $1 }')
    asttable s.txt --output=g.txt 2>>table.err
    ok "asttable's text table as a scene" simage g.txt --models m.txt -x 0.1 --size 600,600 -o g_image.fits
    same "gives the same pixels" <(pixels g_image.fits) <(pixels image.fits)
else
    skip "asttable is not here"
fi
printf '%s\n' '#   1 NUMBER          Running object number' '#   2 X_IMAGE         Object position along x   [pixel]' '1 2.5' >se.txt
fails "a Source Extractor header is understood, its columns are not a library" 1 galgen --library se.txt -n 1
near "the cause is the missing column" "$(grep -c 'no column ID' cmd.err)" 1 0
if command -v fitsverify >/dev/null; then
    ok "the same as FITS" galgen -n 200 --models m.fits -o s.fits
    ok "fitsverify: scene" bash -c 'fitsverify -q s.fits | grep -q "verification OK"'
    ok "fitsverify: models" bash -c 'fitsverify -q m.fits | grep -q "verification OK"'
else
    skip "fitsverify is not here"
fi
