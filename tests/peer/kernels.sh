# detect --kernel-file against scipy's correlation and Source Extractor with the same file.
python3=$(command -v /usr/bin/python3)
if [ -z "$python3" ] || ! "$python3" -c 'import astropy, scipy' 2>/dev/null; then skip "astropy or scipy is not installed: filtered images are not compared"; exit 0; fi
for p in galgen psfgen simage addnoise; do [ -x "$BIN/$p" ] || { skip "$p is not built: kernels are not compared"; exit 0; }; done
galgen -n 700 --field 40 -s 77 -o scene.txt --models models.txt
psfgen -o psf.fits
simage scene.txt --models models.txt -p psf.fits -x 0.1 --size 400,380 -q | addnoise -q --depth 27.7 --read-noise 3 -o field.fits

# kernels of all kinds: a product, a disc, even sides, one that looks elsewhere, hats, and large ones
"$python3" - <<'P'
import numpy as np
rng = np.random.default_rng(8)
def write(name, k, norm='NORM'):
    with open(name + '.conv', 'w') as f:
        f.write('CONV %s\n# %s\n' % (norm, name))
        for r in k: f.write(' '.join('%.9g' % v for v in r) + '\n')
def gauss(w, h, fx, fy, c=0):
    x, y = np.arange(w) - w // 2, np.arange(h)[:, None] - h // 2
    sx, sy = fx / 2.3548, fy / 2.3548
    return np.exp(-.5 * (x**2 / sx**2 + y**2 / sy**2 - 2 * c * x * y / sx / sy) / (1 - c * c))
write('product', gauss(7, 9, 2, 3))
write('tilted', .2 * gauss(7, 7, 2.5, 2.5, .6), 'NONORM')
write('even', gauss(8, 6, 2.5, 2, -.5))
k = np.zeros((5, 7)); k[0, 1] = 1; k[1, 1] = .5; k[0, 2] = .25
write('aside', k)
x, y = np.arange(11) - 5., np.arange(11)[:, None] - 5.
r = (x**2 + y**2) / (2 * 1.5**2)
write('hat', (1 - r) * np.exp(-r))
write('noise', rng.normal(size=(6, 5)))
write('large', np.where((np.arange(30) - 14)**2 + (np.arange(27)[:, None] - 13)**2 < 160, 1, 0) + .2 * rng.normal(size=(27, 30)))
P
cat >compare.py <<'P'
# compare.py KERNEL FILTERED SUBTRACTED: largest difference of FILTERED and of SUBTRACTED filtered by scipy, over the largest value
import sys, numpy as np
from astropy.io import fits
from scipy.ndimage import correlate
lines = open(sys.argv[1]).read().split('\n')
k = np.array([[float(v) for v in l.split()] for l in lines[1:] if l.strip() and l[0] != '#'])
if 'NONORM' not in lines[0]: k = k / np.abs(k).sum()
f, s = (np.nan_to_num(fits.getdata(n).astype(float)) for n in sys.argv[2:4])
want = correlate(s, k, mode='constant')
print('%.3g' % (np.abs(f - want).max() / np.abs(want).max()))
P
sex=$(command -v source-extractor || command -v sex)
"$sex" -dd >empty.sex 2>/dev/null
printf '%s\n' NUMBER X_IMAGE Y_IMAGE FLUX_AUTO FLUXERR_AUTO MAG_AUTO >p.param
ways=
for k in product tilted even aside hat noise large; do
    detect -q --kernel-file $k.conv --threshold 1.5 --threshold-noise pixel --min-area 5 --columns NUMBER,X_IMAGE,Y_IMAGE,FLUX_AUTO,FLUXERR_AUTO,MAG_AUTO field.fits -o $k.cat \
        --check-image filtered=f.fits --check-image subtracted=s.fits
    detect -v --check --kernel-file $k.conv field.fits 2>&1 | sed -n "s/.*(\(.*\)), gain.*/\1/p" >way.txt
    ways="$ways $(head -c 1 way.txt)"
    # sums of float32 values, 6e-8 each
    between "$k ($(cat way.txt)): filtered image against scipy's" "$("$python3" compare.py $k.conv f.fits s.fits)" 0 1e-6
    if [ -z "$sex" ]; then skip "source-extractor is not installed: catalogues are not compared"; continue; fi
    [ $k != large ] || continue        # has at most 1024 pixels, but 32 rows of memory
    "$sex" field.fits -c empty.sex -CATALOG_NAME sex.cat -CATALOG_TYPE ASCII_HEAD -PARAMETERS_NAME p.param -FILTER Y -FILTER_NAME $k.conv \
        -DETECT_MINAREA 5 -DETECT_THRESH 1.5 -ANALYSIS_THRESH 1.5 -MAG_ZEROPOINT "$(card field.fits MAGZERO)" -GAIN 1 -GAIN_KEY NONE -SATUR_LEVEL 1e9 -SATUR_KEY NONE \
        -BACK_SIZE 64 -BACK_FILTERSIZE 3 -PIXEL_SCALE 0 -VERBOSE_TYPE QUIET -CHECKIMAGE_TYPE FILTERED,-BACKGROUND -CHECKIMAGE_NAME sf.fits,ss.fits 2>sex.err
    between "$k: Source Extractor's filtered image is the same sum" "$("$python3" compare.py $k.conv sf.fits ss.fits)" 0 1e-6
    awk '!/^#/ { if (FNR == NR) { x[++n] = $2; y[n] = $3; sn[n] = $4 / $5; next } for (i = 1; i <= n; i++) if ((x[i] - $2) ^ 2 + (y[i] - $3) ^ 2 < 1) { if (!hit[i]++) ok++; break } all++ }
        END { for (i = 1; i <= n; i++) if (sn[i] > 5) { sure++; found += hit[i] > 0 } print n, all, ok, sure, found }' sex.cat $k.cat >counts.txt
    read -r n all both sure found <counts.txt
    between "$k: objects, over Source Extractor's $n" "$(awk "BEGIN { print $all / $n }")" 0.95 1.05
    between "$k: of its $sure with S/N > 5 found within a pixel" "$(awk "BEGIN { print $found / $sure }")" 0.97 1
    between "$k: of all common" "$(awk "BEGIN { print $both / $n }")" 0.9 1
done
near "all three ways were taken" "$(tr ' ' '\n' <<<"$ways" | grep . | sort -u | wc -l)" 3 0
