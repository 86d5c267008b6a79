/*
 * lanes_stages.h - the kernels of lanes.c in one precision.  lanes.c includes it once for each, with
 * REAL, VEC (WIDTH of them), NAME(x) and a function NAME(transpose) defined: no header for others.
 */

/* re and im of n sequences of elements, `step` numbers from one element to the next. */
struct NAME(signal) {
    REAL *re, *im;
    size_t step;
};

/* ---- stages ---- */

/* What one stage does: in[q + s (p + m k)] -> out[q + s (r p + k)], turned by exp(2 pi i p k / (r m)). */
struct NAME(stage) {
    int m, s;
    const REAL *c, *sn;    /* turns of the whole length */
};

static inline const VEC *NAME(at)(const REAL *x, size_t i, size_t step)
{
    return (const VEC *)(x + i * step);
}

/* Element i of the result, turned by c + i d. With p = 0 there is nothing to turn. */
static inline __attribute__((always_inline)) void NAME(put)(const struct NAME(signal) *out, size_t i, const VEC *re, const VEC *im, size_t p, REAL c, REAL d)
{
    *(VEC *)(out->re + i * out->step) = p ? *re * c - *im * d : *re;
    *(VEC *)(out->im + i * out->step) = p ? *re * d + *im * c : *im;
}

static inline __attribute__((always_inline)) void NAME(part_2)(const struct NAME(stage) *g, size_t p, const struct NAME(signal) *in, const struct NAME(signal) *out)
{
    const size_t m = (size_t)g->m, s = (size_t)g->s;
    const REAL c = g->c[p * s], d = g->sn[p * s];
    for (size_t q = 0; q < s; q++) {
        const size_t i = q + s * p, o = q + s * 2 * p;
        const VEC ar = *NAME(at)(in->re, i, in->step), ai = *NAME(at)(in->im, i, in->step);
        const VEC br = *NAME(at)(in->re, i + s * m, in->step), bi = *NAME(at)(in->im, i + s * m, in->step);
        const VEC y0r = ar + br, y0i = ai + bi;
        const VEC y1r = ar - br, y1i = ai - bi;
        NAME(put)(out, o, &y0r, &y0i, 0, 1, 0);
        NAME(put)(out, o + s, &y1r, &y1i, p, c, d);
    }
}

static inline __attribute__((always_inline)) void NAME(part_3)(const struct NAME(stage) *g, size_t p, const struct NAME(signal) *in, const struct NAME(signal) *out)
{
    const size_t m = (size_t)g->m, s = (size_t)g->s;
    const REAL h = (REAL)0.86602540378443864676, half = (REAL)0.5;
    const REAL c1 = g->c[p * s], d1 = g->sn[p * s], c2 = g->c[2 * p * s], d2 = g->sn[2 * p * s];
    for (size_t q = 0; q < s; q++) {
        const size_t i = q + s * p, o = q + s * 3 * p;
        const VEC ar = *NAME(at)(in->re, i, in->step), ai = *NAME(at)(in->im, i, in->step);
        const VEC br = *NAME(at)(in->re, i + s * m, in->step), bi = *NAME(at)(in->im, i + s * m, in->step);
        const VEC cr = *NAME(at)(in->re, i + 2 * s * m, in->step), ci = *NAME(at)(in->im, i + 2 * s * m, in->step);
        const VEC sr = br + cr, si = bi + ci, tr = h * (ci - bi), ti = h * (br - cr);
        const VEC ur = ar - half * sr, ui = ai - half * si;
        const VEC y0r = ar + sr, y0i = ai + si;
        const VEC y1r = ur + tr, y1i = ui + ti;
        const VEC y2r = ur - tr, y2i = ui - ti;
        NAME(put)(out, o, &y0r, &y0i, 0, 1, 0);
        NAME(put)(out, o + s, &y1r, &y1i, p, c1, d1);
        NAME(put)(out, o + 2 * s, &y2r, &y2i, p, c2, d2);
    }
}

static inline __attribute__((always_inline)) void NAME(part_4)(const struct NAME(stage) *g, size_t p, const struct NAME(signal) *in, const struct NAME(signal) *out)
{
    const size_t m = (size_t)g->m, s = (size_t)g->s;
    const REAL c1 = g->c[p * s], d1 = g->sn[p * s], c2 = g->c[2 * p * s], d2 = g->sn[2 * p * s];
    const REAL c3 = g->c[3 * p * s], d3 = g->sn[3 * p * s];
    for (size_t q = 0; q < s; q++) {
        const size_t i = q + s * p, o = q + s * 4 * p;
        const VEC ar = *NAME(at)(in->re, i, in->step), ai = *NAME(at)(in->im, i, in->step);
        const VEC br = *NAME(at)(in->re, i + s * m, in->step), bi = *NAME(at)(in->im, i + s * m, in->step);
        const VEC cr = *NAME(at)(in->re, i + 2 * s * m, in->step), ci = *NAME(at)(in->im, i + 2 * s * m, in->step);
        const VEC dr = *NAME(at)(in->re, i + 3 * s * m, in->step), di = *NAME(at)(in->im, i + 3 * s * m, in->step);
        const VEC er = ar + cr, ei = ai + ci, fr = ar - cr, fi = ai - ci;
        const VEC hr = br + dr, hi = bi + di, kr = di - bi, ki = br - dr;   /* i (b - d) */
        const VEC y0r = er + hr, y0i = ei + hi;
        const VEC y1r = fr + kr, y1i = fi + ki;
        const VEC y2r = er - hr, y2i = ei - hi;
        const VEC y3r = fr - kr, y3i = fi - ki;
        NAME(put)(out, o, &y0r, &y0i, 0, 1, 0);
        NAME(put)(out, o + s, &y1r, &y1i, p, c1, d1);
        NAME(put)(out, o + 2 * s, &y2r, &y2i, p, c2, d2);
        NAME(put)(out, o + 3 * s, &y3r, &y3i, p, c3, d3);
    }
}

static inline __attribute__((always_inline)) void NAME(part_5)(const struct NAME(stage) *g, size_t p, const struct NAME(signal) *in, const struct NAME(signal) *out)
{
    const size_t m = (size_t)g->m, s = (size_t)g->s, is = in->step * s * m;
    const REAL a1 = (REAL)0.30901699437494742410, a2 = (REAL)-0.80901699437494742410;   /* cos 72, cos 144 */
    const REAL b1 = (REAL)0.95105651629515357212, b2 = (REAL)0.58778525229247312917;    /* sin 72, sin 144 */
    REAL c[5], d[5];
    for (size_t k = 1; k < 5; k++) {
        c[k] = g->c[k * p * s];
        d[k] = g->sn[k * p * s];
    }
    for (size_t q = 0; q < s; q++) {
        const REAL *re = in->re + (q + s * p) * in->step, *im = in->im + (q + s * p) * in->step;
        const size_t o = q + s * 5 * p;
        const VEC xr = *(const VEC *)re, xi = *(const VEC *)im;
        const VEC pr = *NAME(at)(re, 1, is) + *NAME(at)(re, 4, is), pi = *NAME(at)(im, 1, is) + *NAME(at)(im, 4, is);
        const VEC mr = *NAME(at)(re, 1, is) - *NAME(at)(re, 4, is), mi = *NAME(at)(im, 1, is) - *NAME(at)(im, 4, is);
        const VEC qr = *NAME(at)(re, 2, is) + *NAME(at)(re, 3, is), qi = *NAME(at)(im, 2, is) + *NAME(at)(im, 3, is);
        const VEC nr = *NAME(at)(re, 2, is) - *NAME(at)(re, 3, is), ni = *NAME(at)(im, 2, is) - *NAME(at)(im, 3, is);
        const VEC ur = xr + a1 * pr + a2 * qr, ui = xi + a1 * pi + a2 * qi;
        const VEC wr = xr + a2 * pr + a1 * qr, wi = xi + a2 * pi + a1 * qi;
        const VEC er = b1 * mr + b2 * nr, ei = b1 * mi + b2 * ni;
        const VEC fr = b2 * mr - b1 * nr, fi = b2 * mi - b1 * ni;
        const VEC y0r = xr + pr + qr, y0i = xi + pi + qi;
        const VEC y1r = ur - ei, y1i = ui + er;
        const VEC y2r = wr - fi, y2i = wi + fr;
        const VEC y3r = wr + fi, y3i = wi - fr;
        const VEC y4r = ur + ei, y4i = ui - er;
        NAME(put)(out, o, &y0r, &y0i, 0, 1, 0);
        NAME(put)(out, o + s, &y1r, &y1i, p, c[1], d[1]);
        NAME(put)(out, o + 2 * s, &y2r, &y2i, p, c[2], d[2]);
        NAME(put)(out, o + 3 * s, &y3r, &y3i, p, c[3], d[3]);
        NAME(put)(out, o + 4 * s, &y4r, &y4i, p, c[4], d[4]);
    }
}

WIDE static void NAME(stage_2)(const struct NAME(stage) *g, const struct NAME(signal) *in, const struct NAME(signal) *out)
{
    NAME(part_2)(g, 0, in, out);
    for (size_t p = 1; p < (size_t)g->m; p++)
        NAME(part_2)(g, p, in, out);
}

WIDE static void NAME(stage_3)(const struct NAME(stage) *g, const struct NAME(signal) *in, const struct NAME(signal) *out)
{
    NAME(part_3)(g, 0, in, out);
    for (size_t p = 1; p < (size_t)g->m; p++)
        NAME(part_3)(g, p, in, out);
}

WIDE static void NAME(stage_4)(const struct NAME(stage) *g, const struct NAME(signal) *in, const struct NAME(signal) *out)
{
    NAME(part_4)(g, 0, in, out);
    for (size_t p = 1; p < (size_t)g->m; p++)
        NAME(part_4)(g, p, in, out);
}

WIDE static void NAME(stage_5)(const struct NAME(stage) *g, const struct NAME(signal) *in, const struct NAME(signal) *out)
{
    NAME(part_5)(g, 0, in, out);
    for (size_t p = 1; p < (size_t)g->m; p++)
        NAME(part_5)(g, p, in, out);
}

/* Any radix r, by definition: turn p k / (r m) + j k / r. n = r m s. */
WIDE static void NAME(stage_any)(const struct NAME(stage) *g, int r, const struct NAME(signal) *in, const struct NAME(signal) *out)
{
    const size_t m = (size_t)g->m, s = (size_t)g->s, n = (size_t)r * m * s;
    for (size_t p = 0; p < m; p++)
        for (size_t k = 0; k < (size_t)r; k++)
            for (size_t q = 0; q < s; q++) {
                VEC re = {0}, im = {0};
                for (size_t j = 0; j < (size_t)r; j++) {
                    const size_t turn = (p * k * s + j * k % (size_t)r * m * s) % n;
                    const REAL c = g->c[turn], d = g->sn[turn];
                    const VEC x = *NAME(at)(in->re, q + s * (p + m * j), in->step);
                    const VEC y = *NAME(at)(in->im, q + s * (p + m * j), in->step);
                    re += x * c - y * d;
                    im += x * d + y * c;
                }
                *(VEC *)(out->re + (q + s * ((size_t)r * p + k)) * out->step) = re;
                *(VEC *)(out->im + (q + s * ((size_t)r * p + k)) * out->step) = im;
            }
}

/* WIDTH transforms: from `in` to `out` (may be the same) by way of a and b, n x WIDTH each. */
static void NAME(sequence_run)(const struct sequence *f, const struct NAME(signal) *in, const struct NAME(signal) *out,
                               const struct NAME(signal) *a, const struct NAME(signal) *b)
{
    struct NAME(stage) g = {.s = 1, .c = f->NAME(c), .sn = f->NAME(s)};
    const struct NAME(signal) *from = in;
    int rest = f->n;
    for (int i = 0; i < f->stages; i++) {
        const int r = f->radix[i];
        const struct NAME(signal) *to = i == f->stages - 1 ? out : from == a ? b : a;
        rest /= r;
        g.m = rest;
        switch (r) {
        case 2: NAME(stage_2)(&g, from, to); break;
        case 3: NAME(stage_3)(&g, from, to); break;
        case 4: NAME(stage_4)(&g, from, to); break;
        case 5: NAME(stage_5)(&g, from, to); break;
        default: NAME(stage_any)(&g, r, from, to); break;
        }
        g.s *= r;
        from = to;
    }
}

/* ---- rows ---- */

/* WIDTH rows of x, `ld` apart (clamped to `last`), columns 0..m-1: to[k] holds column k of them. */
WIDE static void NAME(gather)(const REAL *x, size_t ld, int last, int m, REAL *to)
{
    for (int k = 0; k < m; k += WIDTH) {
        VEC in[WIDTH], out[WIDTH];
        for (int j = 0; j < WIDTH; j++)
            in[j] = *(const VEC *)(x + (size_t)(j < last ? j : last) * ld + k);
        NAME(transpose)(in, out);
        for (int j = 0; j < WIDTH; j++)
            *(VEC *)(to + (size_t)(k + j) * WIDTH) = out[j];
    }
}

/* The half-length sequence Z of WIDTH rows X: Z = X[k] + X*[h-k] + i exp(2 pi i k/n) (X[k] - X*[h-k]), k < h. */
WIDE static void NAME(half_length)(int h, const REAL *c, const REAL *s, const REAL *re, const REAL *im,
                                  REAL *z_re, REAL *z_im)
{
    const VEC first = *(const VEC *)re, last = *(const VEC *)(re + (size_t)h * WIDTH);
    *(VEC *)z_re = first + last;
    *(VEC *)z_im = first - last;
    for (int k = 1; k < h; k++) {
        const size_t i = (size_t)k * WIDTH, j = (size_t)(h - k) * WIDTH;
        const VEC ar = *(const VEC *)(re + i), ai = *(const VEC *)(im + i), br = *(const VEC *)(re + j), bi = *(const VEC *)(im + j);
        const VEC dr = ar - br, di = ai + bi;
        *(VEC *)(z_re + i) = ar + br - (dr * s[k] + di * c[k]);
        *(VEC *)(z_im + i) = ai - bi + (dr * c[k] - di * s[k]);
    }
}

/* Even and odd pixels of WIDTH rows, h of each, to `rows` rows of out, `stride` apart. */
WIDE static void NAME(scatter)(int h, const REAL *even, const REAL *odd, int rows, int n, size_t stride, REAL *out)
{
    for (int k = 0; k < h; k += WIDTH / 2) {
        VEC in[WIDTH], x[WIDTH];
        for (int j = 0; j < WIDTH / 2; j++) {
            const int i = k + j < h ? k + j : h - 1;
            in[2 * j] = *(const VEC *)(even + (size_t)i * WIDTH);
            in[2 * j + 1] = *(const VEC *)(odd + (size_t)i * WIDTH);
        }
        NAME(transpose)(in, x);
        for (int j = 0; j < rows; j++) {
            REAL *to = out + (size_t)j * stride + 2 * k;
            if (k + WIDTH / 2 <= h)
                *(VEC *)to = x[j];
            else
                memcpy(to, &x[j], (size_t)(n - 2 * k) * sizeof *to);
        }
    }
}

/* What `scratch` holds: two signals of n or rows elements, then for WIDTH rows h + 1 columns (x) and the half-length sequence (z). */
struct NAME(scratch) {
    struct NAME(signal) a, b, x, z;
};

static struct NAME(scratch) NAME(scratch_of)(const struct lanes *p, REAL *mem)
{
    const size_t size = WIDTH * (size_t)(p->n > p->rows ? p->n : p->rows), h = (size_t)p->n / 2;
    const size_t xs = WIDTH * (h + WIDTH), zs = WIDTH * h;
    REAL *x = mem + 4 * size, *z = x + 2 * xs;
    return (struct NAME(scratch)){{mem, mem + size, WIDTH}, {mem + 2 * size, mem + 3 * size, WIDTH}, {x, x + xs, WIDTH}, {z, z + zs, WIDTH}};
}


static void NAME(columns)(const struct lanes *p, int k, REAL *re, REAL *im, int ld, REAL *scratch)
{
    const struct NAME(scratch) s = NAME(scratch_of)(p, scratch);
    const struct NAME(signal) column = {re + k, im + k, (size_t)ld};
    NAME(sequence_run)(&p->column, &column, &column, &s.a, &s.b);
}

static void NAME(rows)(const struct lanes *p, int y, int m, const REAL *re, const REAL *im, int ld, REAL *scratch, REAL *out, size_t stride)
{
    const struct NAME(scratch) s = NAME(scratch_of)(p, scratch);
    const int n = p->n, h = n / 2, rows = p->rows - y < WIDTH ? p->rows - y : WIDTH;
    m = m > h + 1 ? h + 1 : m;
    NAME(gather)(re + (size_t)y * (size_t)ld, (size_t)ld, rows - 1, m, s.x.re);
    NAME(gather)(im + (size_t)y * (size_t)ld, (size_t)ld, rows - 1, m, s.x.im);
    for (int k = m; k <= h; k++) {
        memset(s.x.re + (size_t)k * WIDTH, 0, WIDTH * sizeof *s.x.re);
        memset(s.x.im + (size_t)k * WIDTH, 0, WIDTH * sizeof *s.x.im);
    }
    NAME(half_length)(h, p->NAME(c), p->NAME(s), s.x.re, s.x.im, s.z.re, s.z.im);
    NAME(sequence_run)(&p->row, &s.z, &s.z, &s.a, &s.b);
    NAME(scatter)(h, s.z.re, s.z.im, rows, n, stride, out);
}

static void NAME(run)(const struct lanes *p, int m, REAL *re, REAL *im, int ld, REAL *scratch, REAL *out)
{
    m = m > p->n / 2 + 1 ? p->n / 2 + 1 : m;
    for (int k = 0; k < m; k += WIDTH)
        NAME(columns)(p, k, re, im, ld, scratch);
    for (int y = 0; y < p->rows; y += WIDTH)
        NAME(rows)(p, y, m, re, im, ld, scratch, out + (size_t)y * (size_t)p->n, (size_t)p->n);
}
