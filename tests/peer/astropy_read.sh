# What astropy writes we read, what we write astropy and fitsverify read: every
# type of pixel and column, and every FITS file of the reference data.
copy=
for d in "$BIN/../unit" "$TOP/build/unit"; do
    if [ -x "$d/test_fitscopy" ]; then copy=$(cd "$d" && pwd)/test_fitscopy; break; fi
done
if [ -z "$copy" ]; then fail "test_fitscopy is not built"; exit 1; fi
python=
for p in python3 /usr/bin/python3; do $p -c 'import astropy' 2>/dev/null && { python=$p; break; }; done
if [ -z "$python" ]; then skip "astropy is not installed: FITS is not compared with it"; exit 0; fi

cat >make.py <<'PY'
import gzip, warnings, numpy as np
from astropy.io import fits
from astropy.table import Table
rng = np.random.default_rng(1)
for t in 'u1 i2 i4 i8 f4 f8 u2 u4 u8 i1'.split():
    info = np.iinfo(t) if t[0] in 'iu' else None
    d = rng.integers(info.min, info.max, (37, 53), dtype=t, endpoint=True) if info else rng.normal(0, 1e5, (37, 53)).astype(t)
    if not info: d[3, 4] = np.nan; d[5, 6] = np.inf
    fits.PrimaryHDU(d).writeto(f'im_{t}.fits')
h = fits.PrimaryHDU(rng.normal(100, 10, (37, 53))); h.scale('int16', bscale=0.01, bzero=100); h.writeto('im_scaled.fits')
h = fits.PrimaryHDU(rng.integers(-5, 5, (37, 53)).astype('i4')); h.header['BLANK'] = 3; h.writeto('im_blank.fits')
x = fits.ImageHDU(rng.normal(size=(11, 13)).astype('f4'), name='SCI'); x.header['HIERARCH a long key'] = 1.5
x.header['OBSERVER'] = "it's " * 30
fits.HDUList([fits.PrimaryHDU(), fits.BinTableHDU(Table({'a': [1, 2]})), x]).writeto('im_ext.fits', checksum=True)
with gzip.open('im_gzip.fits', 'wb') as f: f.write(open('im_f4.fits', 'rb').read())
for t in 'i2 i4 i8 f4 f8 u1 u2 u4'.split(): pass
n = 100
t = Table({'B': rng.integers(0, 255, n).astype('u1'), 'I': rng.integers(-32768, 32767, n).astype('i2'), 'J': rng.integers(-2**31, 2**31 - 1, n).astype('i4'),
           'K': rng.integers(-2**63, 2**63 - 1, n), 'E': rng.normal(size=n).astype('f4'), 'D': rng.normal(size=n), 'L': rng.integers(0, 2, n).astype(bool),
           'A': np.array(['word%d' % (i * i) for i in range(n)]), 'U': rng.integers(0, 2**32 - 1, n).astype('u4'), 'W': rng.integers(0, 65535, n).astype('u2')})
t['D'].unit = 'arcsec'; t['D'][7] = np.nan; t.meta['EXPTIME'] = 2000.5
t.write('tab_types.fits')
c = fits.BinTableHDU.from_columns([fits.Column('ID', 'K', array=np.arange(5)), fits.Column('COEFFS', 'PD()', array=np.array([rng.normal(size=k + 1) for k in range(5)], dtype=object))])
c.writeto('tab_ragged.fits')
PY
cat >compare.py <<'PY'
import sys, warnings, numpy as np
from astropy.io import fits
warnings.simplefilter('ignore')
def image(name):
    with fits.open(name) as f:
        for h in f:
            if isinstance(h, (fits.PrimaryHDU, fits.ImageHDU)) and h.header['NAXIS'] >= 2: return h.data, h.header
def compare(kind, a, b, c):
    bad = []
    with warnings.catch_warnings():
        warnings.simplefilter('error')                     # a wrong checksum is a warning
        for n in (b, c):
            if n != '-':
                f = fits.open(n, checksum=True); f.verify('exception'); f[-1].data; f.close()
    if kind == 'image':
        da, ha = image(a); db, hb = image(b)
        d64 = da.astype('f8')
        if da.dtype.kind == 'f' and da.dtype.itemsize == 4 and 'BSCALE' in open(a, 'rb').read(28800).decode('latin1'):
            ok64 = np.allclose(db, d64, rtol=2e-7, atol=0, equal_nan=True)      # astropy scales in float32
        else: ok64 = np.array_equal(db, d64, equal_nan=True)
        if c != '-':
            dc, hc = image(c)
            with np.errstate(over='ignore'): want = d64.astype('f4')
            ok32 = dc.dtype == '>f4' and (np.array_equal(dc, want, equal_nan=True) or (da.dtype.itemsize == 8 and da.dtype.kind in 'iu' and np.array_equal(dc, da.astype('f4')))
                   or (not np.array_equal(db, d64, equal_nan=True) and np.allclose(dc, d64, rtol=2e-7)))
        else: ok32 = True
        skip = ('SIMPLE XTENSION BITPIX NAXIS NAXIS1 NAXIS2 NAXIS3 EXTEND PCOUNT GCOUNT BSCALE BZERO BLANK CHECKSUM DATASUM LONGSTRN COMMENT HISTORY').split()
        ok_h = all(hb[k] == v for k, v in ha.items() if k and k.upper() not in skip) and list(map(str, ha.get('HISTORY', []))) == list(map(str, hb.get('HISTORY', [])))
        bad += ['double'] * (not ok64) + ['float'] * (not ok32) + ['cards'] * (not ok_h)
    else:
        ta = [h for h in fits.open(a) if isinstance(h, fits.BinTableHDU)][0]; tb = fits.open(b)[1]
        for i, n in enumerate(ta.columns.names):
            p, q = ta.data[n], tb.data.field(i)
            if ta.columns[i].format[0] in 'PQ' or ta.columns[i].format[1:2] in ('P', 'Q'): ok = all(np.array_equal(x, y) for x, y in zip(p, q))
            elif p.dtype.kind in 'US': ok = list(p) == list(q)
            elif p.dtype.kind == 'b': ok = np.array_equal(p, q == 1)
            elif p.dtype.kind in 'iu': ok = q.dtype.kind == 'i' and all(int(x) == int(y) for x, y in zip(p, q))
            else: ok = np.array_equal(p, q, equal_nan=True)
            if not ok or len(p) != len(q): bad.append(n)
            if (ta.columns[i].unit or '') != (tb.columns[i].unit or ''): bad.append('unit of ' + n)
        if 'EXPTIME' in ta.header and tb.header['EXPTIME'] != ta.header['EXPTIME']: bad.append('EXPTIME')
    return ' '.join(bad)
for line in sys.stdin:
    what, *args = line.split()
    try: bad = compare(*args)
    except Exception as e: bad = repr(e)
    print(f'not ok - {what}: differs: {bad}' if bad else f'ok - {what}: all that is in it is as astropy reads it', flush=True)
PY
$python make.py
command -v fitsverify >/dev/null || skip "fitsverify is not installed"
n=0
: >list
one() { # WHAT FILE: copy it and put it on the list
    n=$((n + 1))
    if "$copy" -d "$2" d$n.fits 2>e; then
        if "$copy" "$2" f$n.fits 2>e; then echo "$1 image $2 d$n.fits f$n.fits"
        elif grep -q planes e; then echo "$1 image $2 d$n.fits -"
        else echo "not ok - $1: $(cat e)" >&3; fi
    elif grep -q 'has no image' e && "$copy" -t "$2" d$n.fits 2>e; then echo "$1 table $2 d$n.fits -"
    else echo "not ok - $1: $(cat e)" >&3; fi >>list
} 3>&1
for f in im_*.fits tab_*.fits; do one "$f" "$f"; done
"$copy" -d - p.fits <im_f8.fits; "$copy" -d im_f8.fits q.fits; same "a pipe and a file give the same" p.fits q.fits
if [ -d "$SHARED/truth" ]; then
    for f in "$SHARED"/data/hdf/*.fits "$SHARED"/truth/*/*.fits "$SHARED"/truth/*/*.fits.gz; do one "${f#"$SHARED"/}" "$f"; done
else
    skip "no reference data in $SHARED"
fi
$python compare.py <list >result
cat result
if [ "$(wc -l <result)" -eq "$(wc -l <list)" ]; then pass "$(wc -l <list) files compared"; else fail "astropy compared $(wc -l <result) files of $(wc -l <list)"; fi
if command -v fitsverify >/dev/null; then
    fitsverify -q d*.fits f*.fits | grep -v '^verification OK' >verify
    if [ -s verify ]; then fail "fitsverify: $(head -3 verify | tr '\n' ' ')"; else pass "fitsverify finds nothing in $(ls d*.fits f*.fits | wc -l) files"; fi
fi
