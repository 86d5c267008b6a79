/*
 * lanes.c - mixed-radix transforms (Stockham's, sign +) of eight sequences side
 * by side: columns in full length n, rows as complex sequences of length n/2 whose
 * real and imaginary parts are the even and odd pixels.
 */
#include "lanes.h"
#include "simd.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LANES 8
#define STAGES 16
#define RADIX_MAX 8192

/* Eight doubles; the compiler splits them to what the processor has. Loads need no alignment. */
typedef double v8 __attribute__((vector_size(64), aligned(8)));

/* One length: factors and turns exp(2 pi i k / n), k < n. */
struct sequence {
    int n, stages;
    int radix[STAGES];
    double *c, *s;
};

struct lanes {
    int n, rows;
    struct sequence column, row;
    double *c, *s;         /* exp(2 pi i k / n), k <= n/2: of the rows */
    double *own;           /* the same when the columns' length is not n, owned */
};

/* re and im of n sequences of elements, `step` doubles from one element to the next. */
struct signal {
    double *re, *im;
    size_t step;
};

static int sequence_new(struct sequence *q, int n)
{
    static const int order[4] = {4, 5, 3, 2};
    int rest = n;
    *q = (struct sequence){.n = n};
    for (int i = 0; i < 4; i++)
        while (rest % order[i] == 0) {
            q->radix[q->stages++] = order[i];
            rest /= order[i];
        }
    for (int p = 7; rest > 1; p += 2)
        while (rest % p == 0) {
            q->radix[q->stages++] = p;
            rest /= p;
        }
    if (q->stages == 1 && q->radix[0] > 5)
        q->radix[q->stages++] = 1;     /* so that no stage but those of small radix works in place */
    q->c = malloc(2 * (size_t)n * sizeof *q->c);
    if (!q->c)
        return E_NOMEM;
    q->s = q->c + n;
    for (int k = 0; k < n; k++) {
        q->c[k] = cos(2 * M_PI * k / n);
        q->s[k] = sin(2 * M_PI * k / n);
    }
    return OK;
}

/* exp(2 pi i k / n), k <= n/2, for transforms whose columns are of another length. */
static int own_turns(struct lanes *p, int n)
{
    const int h = n / 2 + 1;
    p->own = malloc(2 * (size_t)h * sizeof *p->own);
    if (!p->own)
        return E_NOMEM;
    p->c = p->own;
    p->s = p->own + h;
    for (int k = 0; k < h; k++) {
        p->c[k] = cos(2 * M_PI * k / n);
        p->s[k] = sin(2 * M_PI * k / n);
    }
    return OK;
}

int lanes_new_rows(struct lanes **made, int n, int rows)
{
    if (n < 2 || n > RADIX_MAX || n % 2 || rows < 2 || rows > RADIX_MAX)
        return E_RANGE;
    struct lanes *p = calloc(1, sizeof *p);
    int st = p ? OK : E_NOMEM;
    if (st == OK)
        st = sequence_new(&p->column, rows);
    if (st == OK)
        st = sequence_new(&p->row, n / 2);
    if (st == OK && rows != n)
        st = own_turns(p, n);
    if (st) {
        lanes_free(p);
        return st;
    }
    p->n = n;
    p->rows = rows;
    if (rows == n) {
        p->c = p->column.c;
        p->s = p->column.s;
    }
    *made = p;
    return OK;
}

int lanes_new(struct lanes **made, int n)
{
    return lanes_new_rows(made, n, n);
}

void lanes_free(struct lanes *p)
{
    if (!p)
        return;
    free(p->column.c);
    free(p->row.c);
    free(p->own);
    free(p);
}

size_t lanes_scratch(const struct lanes *p)
{
    return 6 * LANES * (size_t)(p->n > p->rows ? p->n : p->rows) + 16 * LANES;
}

/* ---- stages ---- */

/* What one stage does: in[q + s (p + m k)] -> out[q + s (r p + k)], turned by exp(2 pi i p k / (r m)). */
struct stage {
    int m, s;
    const double *c, *sn;  /* turns of the whole length */
};

static inline const v8 *at(const double *x, size_t i, size_t step)
{
    return (const v8 *)(x + i * step);
}

WIDE static void stage_2(const struct stage *g, const struct signal *in, const struct signal *out)
{
    const size_t m = (size_t)g->m, s = (size_t)g->s;
    for (size_t p = 0; p < m; p++) {
        const double c = g->c[p * s], d = g->sn[p * s];
        for (size_t q = 0; q < s; q++) {
            const size_t i = q + s * p, o = q + s * 2 * p;
            const v8 ar = *at(in->re, i, in->step), ai = *at(in->im, i, in->step);
            const v8 br = *at(in->re, i + s * m, in->step), bi = *at(in->im, i + s * m, in->step);
            const v8 er = ar - br, ei = ai - bi;
            *(v8 *)(out->re + o * out->step) = ar + br;
            *(v8 *)(out->im + o * out->step) = ai + bi;
            *(v8 *)(out->re + (o + s) * out->step) = er * c - ei * d;
            *(v8 *)(out->im + (o + s) * out->step) = er * d + ei * c;
        }
    }
}

WIDE static void stage_3(const struct stage *g, const struct signal *in, const struct signal *out)
{
    const size_t m = (size_t)g->m, s = (size_t)g->s;
    const double h = 0.86602540378443864676;
    for (size_t p = 0; p < m; p++) {
        const double c1 = g->c[p * s], d1 = g->sn[p * s], c2 = g->c[2 * p * s], d2 = g->sn[2 * p * s];
        for (size_t q = 0; q < s; q++) {
            const size_t i = q + s * p, o = q + s * 3 * p;
            const v8 ar = *at(in->re, i, in->step), ai = *at(in->im, i, in->step);
            const v8 br = *at(in->re, i + s * m, in->step), bi = *at(in->im, i + s * m, in->step);
            const v8 cr = *at(in->re, i + 2 * s * m, in->step), ci = *at(in->im, i + 2 * s * m, in->step);
            const v8 sr = br + cr, si = bi + ci, tr = h * (ci - bi), ti = h * (br - cr);
            const v8 ur = ar - 0.5 * sr, ui = ai - 0.5 * si;
            const v8 xr = ur + tr, xi = ui + ti, yr = ur - tr, yi = ui - ti;
            *(v8 *)(out->re + o * out->step) = ar + sr;
            *(v8 *)(out->im + o * out->step) = ai + si;
            *(v8 *)(out->re + (o + s) * out->step) = xr * c1 - xi * d1;
            *(v8 *)(out->im + (o + s) * out->step) = xr * d1 + xi * c1;
            *(v8 *)(out->re + (o + 2 * s) * out->step) = yr * c2 - yi * d2;
            *(v8 *)(out->im + (o + 2 * s) * out->step) = yr * d2 + yi * c2;
        }
    }
}

WIDE static void stage_4(const struct stage *g, const struct signal *in, const struct signal *out)
{
    const size_t m = (size_t)g->m, s = (size_t)g->s;
    for (size_t p = 0; p < m; p++) {
        const double c1 = g->c[p * s], d1 = g->sn[p * s], c2 = g->c[2 * p * s], d2 = g->sn[2 * p * s];
        const double c3 = g->c[3 * p * s], d3 = g->sn[3 * p * s];
        for (size_t q = 0; q < s; q++) {
            const size_t i = q + s * p, o = q + s * 4 * p;
            const v8 ar = *at(in->re, i, in->step), ai = *at(in->im, i, in->step);
            const v8 br = *at(in->re, i + s * m, in->step), bi = *at(in->im, i + s * m, in->step);
            const v8 cr = *at(in->re, i + 2 * s * m, in->step), ci = *at(in->im, i + 2 * s * m, in->step);
            const v8 dr = *at(in->re, i + 3 * s * m, in->step), di = *at(in->im, i + 3 * s * m, in->step);
            const v8 er = ar + cr, ei = ai + ci, fr = ar - cr, fi = ai - ci;
            const v8 hr = br + dr, hi = bi + di, kr = di - bi, ki = br - dr;   /* i (b - d) */
            const v8 xr = fr + kr, xi = fi + ki, yr = er - hr, yi = ei - hi, zr = fr - kr, zi = fi - ki;
            *(v8 *)(out->re + o * out->step) = er + hr;
            *(v8 *)(out->im + o * out->step) = ei + hi;
            *(v8 *)(out->re + (o + s) * out->step) = xr * c1 - xi * d1;
            *(v8 *)(out->im + (o + s) * out->step) = xr * d1 + xi * c1;
            *(v8 *)(out->re + (o + 2 * s) * out->step) = yr * c2 - yi * d2;
            *(v8 *)(out->im + (o + 2 * s) * out->step) = yr * d2 + yi * c2;
            *(v8 *)(out->re + (o + 3 * s) * out->step) = zr * c3 - zi * d3;
            *(v8 *)(out->im + (o + 3 * s) * out->step) = zr * d3 + zi * c3;
        }
    }
}

WIDE static void stage_5(const struct stage *g, const struct signal *in, const struct signal *out)
{
    const size_t m = (size_t)g->m, s = (size_t)g->s, is = in->step * s * m, os = out->step * s;
    const double a1 = 0.30901699437494742410, a2 = -0.80901699437494742410;   /* cos 72, cos 144 */
    const double b1 = 0.95105651629515357212, b2 = 0.58778525229247312917;    /* sin 72, sin 144 */
    for (size_t p = 0; p < m; p++) {
        double c[5], d[5];
        for (size_t k = 1; k < 5; k++) {
            c[k] = g->c[k * p * s];
            d[k] = g->sn[k * p * s];
        }
        for (size_t q = 0; q < s; q++) {
            const double *re = in->re + (q + s * p) * in->step, *im = in->im + (q + s * p) * in->step;
            double *to_re = out->re + (q + s * 5 * p) * out->step, *to_im = out->im + (q + s * 5 * p) * out->step;
            const v8 xr = *(const v8 *)re, xi = *(const v8 *)im;
            const v8 pr = *at(re, 1, is) + *at(re, 4, is), pi = *at(im, 1, is) + *at(im, 4, is);
            const v8 mr = *at(re, 1, is) - *at(re, 4, is), mi = *at(im, 1, is) - *at(im, 4, is);
            const v8 qr = *at(re, 2, is) + *at(re, 3, is), qi = *at(im, 2, is) + *at(im, 3, is);
            const v8 nr = *at(re, 2, is) - *at(re, 3, is), ni = *at(im, 2, is) - *at(im, 3, is);
            const v8 ur = xr + a1 * pr + a2 * qr, ui = xi + a1 * pi + a2 * qi;
            const v8 wr = xr + a2 * pr + a1 * qr, wi = xi + a2 * pi + a1 * qi;
            const v8 er = b1 * mr + b2 * nr, ei = b1 * mi + b2 * ni;
            const v8 fr = b2 * mr - b1 * nr, fi = b2 * mi - b1 * ni;
            const v8 y1r = ur - ei, y1i = ui + er, y4r = ur + ei, y4i = ui - er;
            const v8 y2r = wr - fi, y2i = wi + fr, y3r = wr + fi, y3i = wi - fr;
            *(v8 *)to_re = xr + pr + qr;
            *(v8 *)to_im = xi + pi + qi;
            *(v8 *)(to_re + os) = y1r * c[1] - y1i * d[1];
            *(v8 *)(to_im + os) = y1r * d[1] + y1i * c[1];
            *(v8 *)(to_re + 2 * os) = y2r * c[2] - y2i * d[2];
            *(v8 *)(to_im + 2 * os) = y2r * d[2] + y2i * c[2];
            *(v8 *)(to_re + 3 * os) = y3r * c[3] - y3i * d[3];
            *(v8 *)(to_im + 3 * os) = y3r * d[3] + y3i * c[3];
            *(v8 *)(to_re + 4 * os) = y4r * c[4] - y4i * d[4];
            *(v8 *)(to_im + 4 * os) = y4r * d[4] + y4i * c[4];
        }
    }
}

/* Any radix r, by definition: turn p k / (r m) + j k / r. n = r m s. */
WIDE static void stage_any(const struct stage *g, int r, const struct signal *in, const struct signal *out)
{
    const size_t m = (size_t)g->m, s = (size_t)g->s, n = (size_t)r * m * s;
    for (size_t p = 0; p < m; p++)
        for (size_t k = 0; k < (size_t)r; k++)
            for (size_t q = 0; q < s; q++) {
                v8 re = {0}, im = {0};
                for (size_t j = 0; j < (size_t)r; j++) {
                    const size_t turn = (p * k * s + j * k % (size_t)r * m * s) % n;
                    const double c = g->c[turn], d = g->sn[turn];
                    const v8 x = *at(in->re, q + s * (p + m * j), in->step);
                    const v8 y = *at(in->im, q + s * (p + m * j), in->step);
                    re += x * c - y * d;
                    im += x * d + y * c;
                }
                *(v8 *)(out->re + (q + s * ((size_t)r * p + k)) * out->step) = re;
                *(v8 *)(out->im + (q + s * ((size_t)r * p + k)) * out->step) = im;
            }
}

/* Eight transforms: from `in` to `out` (may be the same) by way of a and b, n x 8 each. */
static void sequence_run(const struct sequence *f, const struct signal *in, const struct signal *out,
                         const struct signal *a, const struct signal *b)
{
    struct stage g = {.s = 1, .c = f->c, .sn = f->s};
    const struct signal *from = in;
    int rest = f->n;
    for (int i = 0; i < f->stages; i++) {
        const int r = f->radix[i];
        const struct signal *to = i == f->stages - 1 ? out : from == a ? b : a;
        rest /= r;
        g.m = rest;
        switch (r) {
        case 2: stage_2(&g, from, to); break;
        case 3: stage_3(&g, from, to); break;
        case 4: stage_4(&g, from, to); break;
        case 5: stage_5(&g, from, to); break;
        default: stage_any(&g, r, from, to); break;
        }
        g.s *= r;
        from = to;
    }
}

/* ---- rows ---- */

static inline __attribute__((always_inline)) void transpose(const v8 *x, v8 *y)
{
    v8 a[8], b[8];
    for (int i = 0; i < 8; i += 2) {
        a[i] = __builtin_shufflevector(x[i], x[i + 1], 0, 8, 2, 10, 4, 12, 6, 14);
        a[i + 1] = __builtin_shufflevector(x[i], x[i + 1], 1, 9, 3, 11, 5, 13, 7, 15);
    }
    for (int i = 0; i < 8; i += 4)
        for (int k = 0; k < 2; k++) {
            b[i + k] = __builtin_shufflevector(a[i + k], a[i + k + 2], 0, 1, 8, 9, 4, 5, 12, 13);
            b[i + k + 2] = __builtin_shufflevector(a[i + k], a[i + k + 2], 2, 3, 10, 11, 6, 7, 14, 15);
        }
    for (int k = 0; k < 4; k++) {
        y[k] = __builtin_shufflevector(b[k], b[k + 4], 0, 1, 2, 3, 8, 9, 10, 11);
        y[k + 4] = __builtin_shufflevector(b[k], b[k + 4], 4, 5, 6, 7, 12, 13, 14, 15);
    }
}

/* Eight rows of x, `ld` apart (clamped to `last`), columns 0..m-1: to[k] holds column k of them. */
WIDE static void gather(const double *x, size_t ld, int last, int m, double *to)
{
    for (int k = 0; k < m; k += LANES) {
        v8 in[8], out[8];
        for (int j = 0; j < 8; j++)
            in[j] = *(const v8 *)(x + (size_t)(j < last ? j : last) * ld + k);
        transpose(in, out);
        for (int j = 0; j < 8; j++)
            *(v8 *)(to + (size_t)(k + j) * LANES) = out[j];
    }
}

/* The half-length sequence Z of eight rows X: Z = X[k] + X*[h-k] + i exp(2 pi i k/n) (X[k] - X*[h-k]), k < h. */
WIDE static void half_length(int h, const double *c, const double *s, const double *re, const double *im,
                             double *z_re, double *z_im)
{
    const v8 first = *(const v8 *)re, last = *(const v8 *)(re + (size_t)h * LANES);
    *(v8 *)z_re = first + last;
    *(v8 *)z_im = first - last;
    for (int k = 1; k < h; k++) {
        const size_t i = (size_t)k * LANES, j = (size_t)(h - k) * LANES;
        const v8 ar = *(const v8 *)(re + i), ai = *(const v8 *)(im + i), br = *(const v8 *)(re + j), bi = *(const v8 *)(im + j);
        const v8 dr = ar - br, di = ai + bi;
        *(v8 *)(z_re + i) = ar + br - (dr * s[k] + di * c[k]);
        *(v8 *)(z_im + i) = ai - bi + (dr * c[k] - di * s[k]);
    }
}

/* Even and odd pixels of eight rows, h of each, to `rows` rows of out, `stride` apart. */
WIDE static void scatter(int h, const double *even, const double *odd, int rows, int n, size_t stride, double *out)
{
    for (int k = 0; k < h; k += 4) {
        v8 in[8], x[8];
        for (int j = 0; j < 4; j++) {
            const int i = k + j < h ? k + j : h - 1;
            in[2 * j] = *(const v8 *)(even + (size_t)i * LANES);
            in[2 * j + 1] = *(const v8 *)(odd + (size_t)i * LANES);
        }
        transpose(in, x);
        for (int j = 0; j < rows; j++) {
            double *to = out + (size_t)j * stride + 2 * k;
            if (k + 4 <= h)
                *(v8 *)to = x[j];
            else
                memcpy(to, &x[j], (size_t)(n - 2 * k) * sizeof *to);
        }
    }
}

/* What `scratch` holds: two signals of n or rows elements, then for eight rows h + 1 columns (x) and the half-length sequence (z). */
struct scratch {
    struct signal a, b, x, z;
};

static struct scratch scratch_of(const struct lanes *p, double *mem)
{
    const size_t size = LANES * (size_t)(p->n > p->rows ? p->n : p->rows), h = (size_t)p->n / 2;
    const size_t xs = LANES * (h + LANES), zs = LANES * h;
    double *x = mem + 4 * size, *z = x + 2 * xs;
    return (struct scratch){{mem, mem + size, LANES}, {mem + 2 * size, mem + 3 * size, LANES}, {x, x + xs, LANES}, {z, z + zs, LANES}};
}

void lanes_columns(const struct lanes *p, int k, double *re, double *im, int ld, double *scratch)
{
    const struct scratch s = scratch_of(p, scratch);
    const struct signal column = {re + k, im + k, (size_t)ld};
    sequence_run(&p->column, &column, &column, &s.a, &s.b);
}

void lanes_rows(const struct lanes *p, int y, int m, const double *re, const double *im, int ld, double *scratch, double *out, size_t stride)
{
    const struct scratch s = scratch_of(p, scratch);
    const int n = p->n, h = n / 2, rows = p->rows - y < LANES ? p->rows - y : LANES;
    m = m > h + 1 ? h + 1 : m;
    gather(re + (size_t)y * (size_t)ld, (size_t)ld, rows - 1, m, s.x.re);
    gather(im + (size_t)y * (size_t)ld, (size_t)ld, rows - 1, m, s.x.im);
    for (int k = m; k <= h; k++) {
        memset(s.x.re + (size_t)k * LANES, 0, LANES * sizeof *s.x.re);
        memset(s.x.im + (size_t)k * LANES, 0, LANES * sizeof *s.x.im);
    }
    half_length(h, p->c, p->s, s.x.re, s.x.im, s.z.re, s.z.im);
    sequence_run(&p->row, &s.z, &s.z, &s.a, &s.b);
    scatter(h, s.z.re, s.z.im, rows, n, stride, out);
}

void lanes_run(const struct lanes *p, int m, double *re, double *im, int ld, double *scratch, double *out)
{
    m = m > p->n / 2 + 1 ? p->n / 2 + 1 : m;
    for (int k = 0; k < m; k += LANES)
        lanes_columns(p, k, re, im, ld, scratch);
    for (int y = 0; y < p->rows; y += LANES)
        lanes_rows(p, y, m, re, im, ld, scratch, out + (size_t)y * (size_t)p->n, (size_t)p->n);
}
