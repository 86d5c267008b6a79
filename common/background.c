/*
 * background.c - sky level and noise on meshes; see background.h.
 *
 * Each cell is copied once into a buffer that stays in cache.  Clipped sums of
 * a sample of it set the range of a histogram of 1024 bins over +-5 of that rms; the
 * clipping about the median and the final median, mean and rms are looked up in
 * the histogram's running sums.  Whole-numbered data get bins of whole width,
 * so that a bin never holds more numbers than its neighbour.
 */
#include "background.h"
#include "darksky.h"
#include "simd.h"
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BINS = 1024, SAMPLE = 512, LANES = 8 };

/* Counts in bins. */
struct histogram {
    double lo, width;
    uint32_t tally[BINS + 2], *count;   /* count = tally + 1: without what is out of range */
};

/* What the bins lo .. hi-1 hold: number, sum of k, sum of k^2; and where its median was found. */
struct range {
    int lo, hi;
    int64_t n, k, kk;
    int64_t below;                      /* number in the bins below lo */
    int at;                             /* a bin, and the number in the bins below it */
    int64_t below_at;
};

typedef double v8 __attribute__((vector_size(64), aligned(8), may_alias));

/* Number, sum and sum of squares of t with |t - centre| <= reach; n, at most SAMPLE + LANES, is a multiple of LANES. */
WIDE static void clipped_sums(const double *t, long n, double centre, double reach, double out[3])
{
    double weight[SAMPLE + LANES];
    v8 c = {0}, s = {0}, q = {0};
    for (long i = 0; i < n; i++)
        weight[i] = fabs(t[i] - centre) <= reach ? 1 : 0;
    for (long i = 0; i < n; i += LANES) {
        v8 v = *(const v8 *)(const void *)(t + i), w = *(const v8 *)(const void *)(weight + i);
        c += w;
        s += w * v;
        q += w * v * v;
    }
    out[0] = out[1] = out[2] = 0;
    for (int j = 0; j < LANES; j++) {
        out[0] += c[j];
        out[1] += s[j];
        out[2] += q[j];
    }
}

/*
 * Centre (minus pivot) and rms of a regular sample by 2-sigma clipping until it
 * stands still; *whole = 1 when the sample has whole numbers below 2^23 only.
 */
WIDE static void sample_values(const float *restrict p, long n, double pivot, double *restrict t, int *whole)
{
    int32_t broken = 0;
    for (long i = 0; i < n; i++) {
        t[i] = (double)p[i] - pivot;
        float near = fabsf(p[i]) < 8388608.0f ? p[i] : 0.5f;
        broken |= (float)(int32_t)near != near;
    }
    *whole = !broken;
}

static void rough(const float *v, long n, double pivot, double *centre, double *sigma, int *whole)
{
    double t[SAMPLE + LANES], c = 0, reach = INFINITY, s = 0;
    float p[SAMPLE];
    long m = n < SAMPLE ? n : SAMPLE;
    long step = n / m, rest = n % m, at = 0, over = 0;
    for (long i = 0; i < m; i++) {         /* at = i n / m */
        p[i] = v[at];
        at += step;
        over += rest;
        if (over >= m) {
            over -= m;
            at++;
        }
    }
    sample_values(p, m, pivot, t, whole);
    for (long i = 0; m % LANES; i++)       /* repeat a few */
        t[m++] = t[i];
    for (int pass = 0; pass < 30; pass++) {
        double sum[3];
        clipped_sums(t, m, c, reach, sum);
        if (!(sum[0] > 0))
            break;
        double mean = sum[1] / sum[0], var = sum[2] / sum[0] - mean * mean;
        double now = var > 0 ? sqrt(var) : 0;
        if (pass > 1 && now > 0.9 * s)
            break;
        c = mean;
        s = now;
        reach = 2 * s;
        if (!(s > 0))
            break;
    }
    *centre = c;
    *sigma = s;
}

/* Bin of every value, 0 below and BINS + 1 above the range. */
WIDE static void bins_of(const float *restrict v, long n, float lo, float scale, int32_t *restrict bin)
{
    for (long i = 0; i < n; i++) {
        float t = (v[i] - lo) * scale + 1;
        t = t > 0 ? t : 0;
        t = t < BINS + 1 ? t : BINS + 1;
        bin[i] = (int32_t)t;
    }
}

static void histogram_fill(struct histogram *h, const float *v, long n, double centre, double sigma, int whole)
{
    enum { PIECE = 1024, TABLES = 4 };     /* so that equal neighbours do not wait for each other */
    int32_t bin[PIECE];
    uint32_t tally[TABLES][BINS + 2];
    h->width = 10 * sigma / BINS;
    h->lo = (double)(float)(centre - 5 * sigma);
    if (whole && sigma < 1e5) {
        h->width = ceil(h->width);
        h->lo = floor(centre - h->width * BINS / 2) + 0.5;
    }
    memset(tally, 0, sizeof tally);
    h->count = h->tally + 1;
    for (long i = 0; i < n; i += PIECE) {
        long m = n - i < PIECE ? n - i : PIECE, k = 0;
        bins_of(v + i, m, (float)h->lo, (float)(1 / h->width), bin);
        for (; k + TABLES <= m; k += TABLES) {
            tally[0][bin[k]]++;
            tally[1][bin[k + 1]]++;
            tally[2][bin[k + 2]]++;
            tally[3][bin[k + 3]]++;
        }
        for (; k < m; k++)
            tally[0][bin[k]]++;
    }
    for (int b = 0; b < BINS + 2; b++)
        h->tally[b] = tally[0][b] + tally[1][b] + tally[2][b] + tally[3][b];
}

/* Add sign times the bins from .. to-1. */
WIDE static void range_add(struct range *r, const uint32_t *count, int from, int to, int64_t sign)
{
    uint64_t n = 0, k = 0, kk = 0;
    for (int b = from; b < to; b++) {
        n += count[b];
        k += (uint64_t)count[b] * (uint32_t)b;
        kk += (uint64_t)count[b] * (uint32_t)(b * b);
    }
    r->n += sign * (int64_t)n;
    r->k += sign * (int64_t)k;
    r->kk += sign * (int64_t)kk;
}

/* All bins, the search for the median to begin in the middle. */
static struct range range_all(const struct histogram *h)
{
    struct range r = {.at = BINS / 2};
    range_add(&r, h->count, 0, BINS / 2, 1);
    r.below_at = r.n;
    range_add(&r, h->count, BINS / 2, BINS, 1);
    r.hi = BINS;
    return r;
}

static void range_cut(struct range *r, const struct histogram *h, int lo, int hi)
{
    int64_t before = r->n;
    range_add(r, h->count, r->lo, lo, -1);
    r->below += before - r->n;
    range_add(r, h->count, hi, r->hi, -1);
    r->lo = lo;
    r->hi = hi;
}

/*
 * Median of the range in bin units (bin b has its centre at b): linear
 * between the middles of neighbouring occupied bins, so that data with a coarse
 * quantum give the same answer as if spread over it.
 */
static double range_median(struct range *r, const struct histogram *h)
{
    double half = 0.5 * (double)(r->below + r->below + r->n);
    int a = r->at;                 /* the last bin with not more than half below it */
    int64_t below = r->below_at;
    while (a > r->lo && (a >= r->hi || (double)below > half))
        below -= h->count[--a];
    while (a + 1 < r->hi && (double)(below + h->count[a]) <= half)
        below += h->count[a++];
    r->at = a;
    r->below_at = below;
    double middle = (double)below + 0.5 * h->count[a];
    int step = half >= middle ? 1 : -1, other = a + step;
    while (other >= r->lo && other < r->hi && h->count[other] == 0)
        other += step;
    if (other < r->lo || other >= r->hi)
        return a;
    /* the bins between are empty */
    double there = (double)(step > 0 ? below + h->count[a] : below - h->count[other]) + 0.5 * h->count[other];
    return a + (half - middle) / (there - middle) * (other - a);
}

static int clamp_bin(double b)
{
    return b < 0 ? 0 : b > BINS ? BINS : (int)b;
}

void background_clip(const float *v, long n, double gain, double removed, double *level, double *sigma)
{
    double pivot = (double)v[n / 2], centre, s;
    int whole;
    rough(v, n, pivot, &centre, &s, &whole);
    centre += pivot;
    *level = centre;
    *sigma = 0;
    if (!(s > 8 * DBL_EPSILON * fabs(centre)))
        return;
    struct histogram h;
    histogram_fill(&h, v, n, centre, s, whole);

    struct range r = range_all(&h);
    double mean = 0, median = 0, rms = 0;
    for (int pass = 0; pass < 50; pass++) {
        double m = (double)r.n;
        if (!(m > 0))
            return;
        mean = (double)r.k / m;
        double var = (double)r.kk / m - mean * mean;
        rms = var > 0 ? sqrt(var) : 0;
        median = range_median(&r, &h);
        int a = clamp_bin(floor(median - 3 * rms + 0.5)), b = clamp_bin(ceil(median + 3 * rms + 0.5));
        a = a > r.lo ? a : r.lo;
        b = b < r.hi ? b : r.hi;
        if ((a == r.lo && b == r.hi) || a >= b)
            break;
        range_cut(&r, &h, a, b);
    }
    mean = h.lo + (mean + 0.5) * h.width;
    median = h.lo + (median + 0.5) * h.width;
    rms *= h.width;
    if (!(rms > 0)) {
        *level = median;
        return;
    }
    /* photon noise of level B at gain g: third moment B/g^2 puts the median B/(6 g^2 rms^2) below the mean */
    double photon = gain > 0 ? (centre + removed) / (gain * rms * rms) : 0;
    if (photon > 0 && photon < 1.3)
        median += (photon < 1 ? photon : 1) / (6 * gain);
    *level = fabs(mean - median) < 0.3 * rms ? 2.5 * median - 1.5 * mean : median;
    *sigma = rms;
}

double background_median(double *v, long n)
{
    long lo = 0, hi = n - 1, k = n / 2;
    while (lo < hi) {              /* quickselect, middle pivot */
        double p = v[lo + (hi - lo) / 2];
        long i = lo, j = hi;
        while (i <= j) {
            while (v[i] < p)
                i++;
            while (v[j] > p)
                j--;
            if (i <= j) {
                double t = v[i];
                v[i++] = v[j];
                v[j--] = t;
            }
        }
        if (k <= j)
            hi = j;
        else if (k >= i)
            lo = i;
        else
            break;
    }
    if (n % 2)
        return v[k];
    double below = v[0];           /* everything left of k is <= v[k] */
    for (long i = 1; i < k; i++)
        below = v[i] > below ? v[i] : below;
    return below + 0.5 * (v[k] - below);
}

/* ---- the cells ---- */

struct cells {
    const struct pixels *im;
    const float *rms_map;
    const struct background_params *p;
    long mx, my;
    double *level, *sigma;         /* my*mx; NaN: no use */
    long *bad;                     /* my: bad pixels of a row of cells */
    struct darksky *dark;          /* NULL: not asked for */
};

/* Are all of them finite? */
WIDE static int all_finite(const float *v, long n)
{
    int32_t bad = 0;
    for (long i = 0; i < n; i++)
        bad |= !(fabsf(v[i]) <= FLT_MAX);
    return !bad;
}

/* Copy the good pixels of one cell; returns how many. */
static long gather(const struct cells *c, long x0, long x1, long y0, long y1, float *buf)
{
    const size_t stride = (size_t)c->im->nx;
    const long nx = x1 - x0, ny = y1 - y0;
    const float *rms = c->rms_map ? c->rms_map + (size_t)y0 * stride + (size_t)x0 : NULL;
    pixels_box(c->im, (struct box){x0, y0, nx, ny}, buf);
    int good = all_finite(buf, nx * ny);
    for (long y = 0; rms && y < ny && good; y++)
        good = all_finite(rms + (size_t)y * stride, nx);
    if (good)
        return nx * ny;
    long n = 0;
    for (long y = 0; y < ny; y++, rms = rms ? rms + stride : NULL)
        for (long x = 0; x < nx; x++)
            if (fabsf(buf[y * nx + x]) <= FLT_MAX && (!rms || rms[x] <= FLT_MAX))
                buf[n++] = buf[y * nx + x];
    return n;
}

static int measure_rows(void *ctx, long begin, long end, int worker)
{
    (void)worker;
    const struct cells *c = ctx;
    long nx = c->im->nx, ny = c->im->ny;
    double gain = c->dark ? c->p->gain : 0;
    size_t room = (size_t)(nx / c->mx + 1) * (size_t)(ny / c->my + 1);
    float *buf = malloc(room * sizeof *buf);
    int st = buf ? OK : E_NOMEM;
    for (long j = begin; j < end && !st; j++) {
        long y0 = j * ny / c->my, y1 = (j + 1) * ny / c->my;
        c->bad[j] = nx * (y1 - y0);
        for (long i = 0; i < c->mx; i++) {
            long x0 = i * nx / c->mx, x1 = (i + 1) * nx / c->mx;
            long n = gather(c, x0, x1, y0, y1, buf), at = j * c->mx + i;
            c->level[at] = c->sigma[at] = NAN;
            c->bad[j] -= n;
            if (n > 0 && n * 4 >= (x1 - x0) * (y1 - y0))
                background_clip(buf, n, gain, c->p->removed, &c->level[at], &c->sigma[at]);
            else if (n > 0 && c->mx * c->my == 1)
                background_clip(buf, n, gain, c->p->removed, &c->level[at], &c->sigma[at]);
        }
        if (c->dark && !st)
            st = darksky_rows(c->dark, c->im, c->rms_map, y0, y1);
    }
    free(buf);
    return st;
}

/* The level once more, from the blocks between objects. */
static int darken_rows(void *ctx, long begin, long end, int worker)
{
    (void)worker;
    const struct cells *c = ctx;
    long nx = c->im->nx, ny = c->im->ny;
    int st = OK;
    for (long j = begin; j < end; j++)
        for (long i = 0; i < c->mx && !st; i++)
            if (c->sigma[j * c->mx + i] > 0)
                st = darksky_level(c->dark, i * nx / c->mx, (i + 1) * nx / c->mx, j * ny / c->my, (j + 1) * ny / c->my,
                                   c->sigma[j * c->mx + i], &c->level[j * c->mx + i]);
    return st;
}

/*
 * Give cells without a value the mean of their good neighbours, ring by ring:
 * every pass fills the cells that touch a good one.
 */
static int fill_bad(double *level, double *sigma, long mx, long my)
{
    size_t n = (size_t)mx * (size_t)my, left = 0;
    for (size_t i = 0; i < n; i++)
        left += isnan(level[i]) ? 1 : 0;
    if (left == n)
        return E_DATA;
    double *next = malloc(2 * n * sizeof *next);
    if (!next)
        return E_NOMEM;
    while (left > 0) {
        memcpy(next, level, n * sizeof *next);
        memcpy(next + n, sigma, n * sizeof *next);
        for (long j = 0; j < my; j++)
            for (long i = 0; i < mx; i++) {
                double s = 0, q = 0;
                int m = 0;
                if (!isnan(level[j * mx + i]))
                    continue;
                for (long v = j > 0 ? j - 1 : 0; v <= j + 1 && v < my; v++)
                    for (long u = i > 0 ? i - 1 : 0; u <= i + 1 && u < mx; u++)
                        if (!isnan(level[v * mx + u])) {
                            s += level[v * mx + u];
                            q += sigma[v * mx + u];
                            m++;
                        }
                if (m) {
                    next[j * mx + i] = s / m;
                    next[(long)n + j * mx + i] = q / m;
                    left--;
                }
            }
        memcpy(level, next, n * sizeof *next);
        memcpy(sigma, next + n, n * sizeof *next);
    }
    free(next);
    return OK;
}

static long least(long a, long b, long c)
{
    long m = a < b ? a : b;
    return m < c ? m : c;
}

/* Median of 9 values by exchanges that leave the middle one at 4 (Paeth 1990). */
static double median_of_nine(double v[9])
{
    static const unsigned char swap[19][2] = {{1, 2}, {4, 5}, {7, 8}, {0, 1}, {3, 4}, {6, 7}, {1, 2}, {4, 5}, {7, 8}, {0, 3},
                                              {5, 8}, {4, 7}, {3, 6}, {1, 4}, {2, 5}, {4, 7}, {4, 2}, {6, 4}, {4, 2}};
    for (int i = 0; i < 19; i++) {
        double *a = &v[swap[i][0]], *b = &v[swap[i][1]], low = *a < *b ? *a : *b, high = *a < *b ? *b : *a;
        *a = low;
        *b = high;
    }
    return v[4];
}

/*
 * Median over side x side cells from v into out.  At the border the window
 * shrinks on both sides alike, so that a slope stays what it is.
 */
static int median_filter(const double *v, long mx, long my, long side, double *out)
{
    long r = side / 2, w = least(side, mx, mx), h = least(side, my, my);
    double *box = malloc((size_t)w * (size_t)h * sizeof *box);
    if (!box)
        return E_NOMEM;
    for (long j = 0; j < my; j++)
        for (long i = 0; i < mx; i++) {
            long n = 0, ri = least(r, i, mx - 1 - i), rj = least(r, j, my - 1 - j);
            for (long b = j - rj; b <= j + rj; b++)
                for (long a = i - ri; a <= i + ri; a++)
                    box[n++] = v[b * mx + a];
            out[j * mx + i] = n == 9 ? median_of_nine(box) : background_median(box, n);
        }
    free(box);
    return OK;
}

/* ---- splines ---- */

/* Second derivatives of the natural spline through n values `step` apart, unit spacing; w: n scratch. */
static void natural(const double *v, long n, long step, double *d2, double *w)
{
    d2[0] = 0;
    if (n > 1)
        d2[(n - 1) * step] = 0;
    if (n < 3)
        return;
    w[0] = 0;
    for (long i = 1; i < n - 1; i++) {     /* d[i-1] + 4 d[i] + d[i+1] = 6 (v[i-1] - 2 v[i] + v[i+1]) */
        double rhs = 6 * (v[(i - 1) * step] - 2 * v[i * step] + v[(i + 1) * step]);
        double p = 4 - w[i - 1];
        w[i] = 1 / p;
        d2[i * step] = (rhs - d2[(i - 1) * step]) / p;
    }
    for (long i = n - 2; i > 0; i--)
        d2[i * step] -= w[i] * d2[(i + 1) * step];
}

/* Node tables: values, d2/dx2, d2/dy2 of both. */
static int mesh_new(struct mesh *m, const struct pixels *im, long mx, long my, const double *v,
                    double pivot)
{
    size_t n = (size_t)mx * (size_t)my, side = (size_t)(mx > my ? mx : my);
    double *node = malloc(4 * n * sizeof *node), *w = malloc(side * sizeof *w);
    long *first = malloc(((size_t)mx + 1) * sizeof *first);
    if (!node || !w || !first) {
        free(node);
        free(w);
        free(first);
        return E_NOMEM;
    }
    for (long k = 0; k <= mx; k++)
        first[k] = (long)ceil(((double)k + 0.5) * (double)im->nx / (double)mx - 0.5);
    double *dx = node + n, *dy = node + 2 * n, *dxy = node + 3 * n;
    for (size_t i = 0; i < n; i++)
        node[i] = v[i] - pivot;
    for (long j = 0; j < my; j++)
        natural(node + j * mx, mx, 1, dx + j * mx, w);
    for (long i = 0; i < mx; i++) {
        natural(node + i, my, mx, dy + i, w);
        natural(dx + i, my, mx, dxy + i, w);
    }
    free(w);
    *m = (struct mesh){im->nx, im->ny, mx, my, pivot, node, first, NULL};
    return OK;
}

/* The cubic on node interval [k, k+1] or a line beyond: c0 + t (c1 + t (c2 + t c3)), t from node k. */
static void cubic(double v0, double v1, double a, double b, double c[4])
{
    c[0] = v0;
    c[1] = v1 - v0 - (2 * a + b) / 6;
    c[2] = a / 2;
    c[3] = (b - a) / 6;
}

/* Where a pixel row lies between the rows of nodes. */
struct place {
    long j;                /* node row below */
    double u;              /* distance from it, nodes */
    int outside;           /* -1 below the first, 1 above the last, else 0 */
};

static struct place place_of(const struct mesh *m, long y)
{
    double t = ((double)y + 0.5) * (double)m->my / (double)m->ny - 0.5;
    long j = (long)floor(t);
    j = j < 0 ? 0 : j > m->my - 2 ? m->my - 2 : j;
    return (struct place){j, t - (double)j, t < 0 ? -1 : t > (double)(m->my - 1) ? 1 : 0};
}

/* Between two nodes of values v0, v1 and second derivatives a, b. */
static inline double between(double v0, double v1, double a, double b, struct place p)
{
    double c[4], u = p.u;
    cubic(v0, v1, a, b, c);
    if (p.outside < 0)
        return c[0] + u * c[1];
    if (p.outside > 0)
        return c[0] + c[1] + c[2] + c[3] + (u - 1) * (c[1] + 2 * c[2] + 3 * c[3]);
    return c[0] + u * (c[1] + u * (c[2] + u * c[3]));
}

/* Value and x second derivative of column k at a pixel row, into v[0..1]. */
static void column_at(const struct mesh *m, long k, struct place p, double v[2])
{
    size_t n = (size_t)m->mx * (size_t)m->my;
    long at = p.j * m->mx;
    for (int part = 0; part < 2; part++) {
        const double *f = m->node + (size_t)part * n + k, *d = f + 2 * n;
        v[part] = m->my == 1 ? f[0] : between(f[at], f[at + m->mx], d[at], d[at + m->mx], p);
    }
}

/* The same from the table of rows, or made here when there is none. */
static void column_of_row(const struct mesh *m, long k, long y, double v[2])
{
    if (m->row) {
        const float *f = m->row + 2 * ((size_t)y * (size_t)m->mx + (size_t)k);
        v[0] = (double)f[0];
        v[1] = (double)f[1];
    } else {
        column_at(m, k, place_of(m, y), v);
    }
}

/* Every second place of row gets one of mx columns: v and d are the values and second derivatives at the row of nodes below. */
WIDE static void fill_row(const double *restrict v, const double *restrict d, long mx, struct place p, float *restrict row)
{
    for (long k = 0; k < mx; k++)
        row[2 * k] = (float)between(v[k], v[mx + k], d[k], d[mx + k], p);
}

/* Rows of the table of rows. */
static int fill_rows(void *ctx, long begin, long end, int worker)
{
    const struct mesh *m = ctx;
    size_t n = (size_t)m->mx * (size_t)m->my;
    (void)worker;
    for (long y = begin; y < end; y++) {
        struct place p = place_of(m, y);
        for (int part = 0; part < 2; part++) {
            const double *f = m->node + (size_t)part * n;
            float *row = m->row + 2 * y * m->mx + part;
            for (long k = 0; k < m->mx && m->my == 1; k++)
                row[2 * k] = (float)f[k];
            if (m->my > 1)
                fill_row(f + p.j * m->mx, f + 2 * n + (size_t)(p.j * m->mx), m->mx, p, row);
        }
    }
    return OK;
}

/* Fill the table of rows. */
static int mesh_rows(struct mesh *m, struct par_team *team)
{
    m->row = malloc(2 * (size_t)m->ny * (size_t)m->mx * sizeof *m->row);
    return m->row ? par_team_for(team, m->ny, 64, fill_rows, m) : E_NOMEM;
}

/* Pixels from .. to-1 of a row: the cubic c at t = start + (place - anchor) * spacing of the mesh. */
struct piece {
    int32_t from, to;          /* relative to the first pixel asked for */
    int32_t shift;             /* of that pixel from the anchor */
    float start, c[4];
};

enum { PIECES = 16 };

/* The cubic of the interval from node k on (-1 and mx - 1: the lines beyond the outermost nodes) in row y. */
static struct piece piece_of(const struct mesh *m, long k, long y, double h, long x0)
{
    if (m->mx == 1) {
        double v[2];
        column_of_row(m, 0, y, v);
        return (struct piece){.c = {(float)v[0]}};
    }
    long i = k < 0 ? 0 : k > m->mx - 2 ? m->mx - 2 : k;
    double v0[2], v1[2], c[4];
    column_of_row(m, i, y, v0);
    column_of_row(m, i + 1, y, v1);
    cubic(v0[0], v1[0], v0[1], v1[1], c);
    if (k < 0)
        c[2] = c[3] = 0;
    if (k == m->mx - 1) {              /* the line at the end of the last interval */
        double slope = c[1] + 2 * c[2] + 3 * c[3], last = c[0] + c[1] + c[2] + c[3];
        c[0] = last - slope;
        c[1] = slope;
        c[2] = c[3] = 0;
    }
    long anchor = k < 0 ? 0 : m->first[k];
    return (struct piece){0, 0, (int32_t)(x0 - anchor), (float)(((double)anchor + 0.5) * h - 0.5 - (double)i),
                          {(float)c[0], (float)c[1], (float)c[2], (float)c[3]}};
}

/* The node interval of pixel x: -1 .. mx - 1. */
static long interval_of(const struct mesh *m, double h, long x)
{
    if (m->mx == 1)
        return 0;
    long k = (long)floor(((double)x + 0.5) * h - 0.5 + 1e-9);
    k = k < -1 ? -1 : k > m->mx - 1 ? m->mx - 1 : k;
    while (k >= 0 && m->first[k] > x)
        k--;
    return k;
}

/* Where the piece from node k on ends, of n pixels from x0. */
static long piece_end(const struct mesh *m, long k, long x0, long n)
{
    return k == m->mx - 1 || m->first[k + 1] > x0 + n ? n : m->first[k + 1] - x0;
}

/*
 * The pieces of row y from pixel x0 + *done on, at most PIECES, of n pixels asked
 * for; *k is the next interval, *done how many pixels they cover.
 */
static int next_pieces(const struct mesh *m, double h, long y, long x0, long n, long *k, long *done,
                       struct piece p[PIECES])
{
    int count = 0;
    for (; *done < n && count < PIECES; (*k)++) {
        long stop = piece_end(m, *k, x0, n);
        if (stop <= *done)
            continue;
        p[count] = piece_of(m, *k, y, h, x0);
        p[count].from = (int32_t)*done;
        p[count++].to = (int32_t)stop;
        *done = stop;
    }
    return count;
}

/* The same bits wherever a piece begins. */
static inline float piece_at(const struct piece *p, float dt, int i)
{
    float t = p->start + dt * (float)(p->shift + i);
    return p->c[0] + t * (p->c[1] + t * (p->c[2] + t * p->c[3]));
}

WIDE static void fill_pieces(const struct piece *p, int count, float dt, float *restrict out)
{
    for (int k = 0; k < count; k++) {
        struct piece q = p[k];
        for (int i = q.from; i < q.to; i++)
            out[i] = piece_at(&q, dt, i);
    }
}

/* v = finite(v) ? (v - pivot) - mesh : blank */
WIDE static void subtract_pieces(const struct piece *p, int count, float dt, float pivot, float blank, float *restrict v)
{
    for (int k = 0; k < count; k++) {
        struct piece q = p[k];
        for (int i = q.from; i < q.to; i++) {
            float d = (v[i] - pivot) - piece_at(&q, dt, i);
            v[i] = fabsf(d) <= FLT_MAX ? d : blank;
        }
    }
}

/* The same pixels of one piece in `rows` rows, each with its cubic; the rows of v are so far apart. */
WIDE static void subtract_column(const struct piece *p, long rows, float dt, float pivot, float blank, float *restrict v,
                                 size_t stride)
{
    for (long r = 0; r < rows; r++, v += stride) {
        struct piece q = p[r];
        for (int i = q.from; i < q.to; i++) {
            float d = (v[i] - pivot) - piece_at(&q, dt, i);
            v[i] = fabsf(d) <= FLT_MAX ? d : blank;
        }
    }
}

void mesh_row(const struct mesh *m, long y, long x0, long n, float *out)
{
    struct piece p[PIECES];
    double h = (double)m->mx / (double)m->nx;
    for (long done = 0, k = interval_of(m, h, x0); done < n;) {
        int count = next_pieces(m, h, y, x0, n, &k, &done, p);
        fill_pieces(p, count, (float)h, out);
    }
}

double mesh_at(const struct mesh *m, long x, long y)
{
    float v;
    mesh_row(m, y, x, 1, &v);
    return m->pivot + (double)v;
}

void background_subtract(const struct background *b, long y, long x0, long n, float blank, float *v)
{
    const struct mesh *m = &b->level;
    struct piece p[PIECES];
    double h = (double)m->mx / (double)m->nx;
    for (long done = 0, k = interval_of(m, h, x0); done < n;) {
        int count = next_pieces(m, h, y, x0, n, &k, &done, p);
        subtract_pieces(p, count, (float)h, (float)m->pivot, blank, v);
    }
}

void background_subtract_box(const struct background *b, struct box box, float blank, float *v)
{
    enum { ROWS = 64 };
    const struct mesh *m = &b->level;
    struct piece p[ROWS];
    double h = (double)m->mx / (double)m->nx;
    for (long done = 0, k = interval_of(m, h, box.x0); done < box.nx; k++) {
        long stop = piece_end(m, k, box.x0, box.nx);
        if (stop <= done)
            continue;
        for (long y = 0; y < box.ny; y += ROWS) {
            long rows = box.ny - y < ROWS ? box.ny - y : ROWS;
            for (long r = 0; r < rows; r++) {
                p[r] = piece_of(m, k, box.y0 + y + r, h, box.x0);
                p[r].from = (int32_t)done;
                p[r].to = (int32_t)stop;
            }
            subtract_column(p, rows, (float)h, (float)m->pivot, blank, v + y * box.nx, (size_t)box.nx);
        }
        done = stop;
    }
}

/* ---- all together ---- */

/* Cells without noise are no sky when other cells have some. */
static void drop_dead_cells(struct cells *c)
{
    size_t n = (size_t)c->mx * (size_t)c->my;
    int alive = 0;
    for (size_t i = 0; i < n; i++)
        alive |= c->sigma[i] > 0;
    for (size_t i = 0; alive && i < n; i++)
        if (!(c->sigma[i] > 0))
            c->level[i] = c->sigma[i] = NAN;
}

static int finish(struct background *b, struct cells *c)
{
    size_t n = (size_t)c->mx * (size_t)c->my;
    double *level = malloc(3 * n * sizeof *level);
    if (!level)
        return E_NOMEM;
    double *sigma = level + n, *sorted = level + 2 * n;
    struct background out = {0};
    for (long j = 0; j < c->my; j++)
        out.bad += c->bad[j];
    int st = median_filter(c->level, c->mx, c->my, c->p->filter, level);
    if (!st)
        st = median_filter(c->sigma, c->mx, c->my, c->p->filter, sigma);
    if (!st) {
        memcpy(sorted, level, n * sizeof *sorted);
        out.mean_level = background_median(sorted, (long)n);
        memcpy(sorted, sigma, n * sizeof *sorted);
        out.mean_rms = background_median(sorted, (long)n);
        st = mesh_new(&out.level, c->im, c->mx, c->my, level, (double)(float)out.mean_level);
    }
    if (!st)
        st = mesh_new(&out.rms, c->im, c->mx, c->my, sigma, (double)(float)out.mean_rms);
    if (!st)
        st = mesh_rows(&out.level, c->p->team);
    free(level);
    if (st)
        background_free(&out);
    else
        *b = out;
    return st;
}

int background_measure(struct background *b, const struct pixels *im, const float *rms_map,
                       const struct background_params *p)
{
    if (p->cell < 4 || p->filter < 1 || p->filter % 2 == 0)
        return E_RANGE;
    struct cells c = {.im = im, .rms_map = rms_map, .p = p};
    c.mx = (im->nx + p->cell / 2) / p->cell;
    c.my = (im->ny + p->cell / 2) / p->cell;
    c.mx = c.mx < 1 ? 1 : c.mx;
    c.my = c.my < 1 ? 1 : c.my;
    size_t n = (size_t)c.mx * (size_t)c.my;
    c.level = malloc(2 * n * sizeof *c.level);
    c.bad = malloc((size_t)c.my * sizeof *c.bad);
    if (!c.level || !c.bad) {
        free(c.level);
        free(c.bad);
        return E_NOMEM;
    }
    c.sigma = c.level + n;
    struct darksky dark = {0};
    c.dark = p->dark ? &dark : NULL;
    int st = p->dark ? darksky_new(&dark, im) : OK;
    if (!st)
        st = par_team_for(p->team, c.my, 1, measure_rows, &c);
    if (!st && p->dark)
        st = par_team_for(p->team, c.my, 1, darken_rows, &c);
    darksky_free(&dark);
    if (!st) {
        drop_dead_cells(&c);
        st = fill_bad(c.level, c.sigma, c.mx, c.my);
    }
    if (!st)
        st = finish(b, &c);
    free(c.level);
    free(c.bad);
    return st;
}

void background_free(struct background *b)
{
    free(b->level.node);
    free(b->level.first);
    free(b->level.row);
    free(b->rms.node);
    free(b->rms.first);
    *b = (struct background){0};
}
