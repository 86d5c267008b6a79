/*
 * drizzle.c - drops of input pixels on the output grid.
 */
#include "drizzle.h"
#include "overlap.h"
#include "simd.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SMALL 9.6e-7          /* a drop of this side is a point */
#define LEAST 1e-12           /* parts of a drop below this are rounding */
#define FWHM_SIGMA 2.3548     /* of the kernel as STScI defines it: 8e-6 below 2 sqrt(2 ln 2) */

/* Nearest multiple of 2^-20, |v| < 2^31. */
static double rounded(double v)
{
    const double magic = 0x1.8p32;
    return (v + magic) - magic;
}

/* Flux and weight of a pixel as one. */
typedef double pair __attribute__((vector_size(16), aligned(8), may_alias));

/* ---- drops ---- */

struct job {
    const struct drizzle_map *map;
    const struct drizzle_input *in;
    struct drizzle_band *band;
    enum drizzle_kernel kernel;
    double pixfrac;
    double *row;             /* room for one row of overlaps */
};

/* The cells of an interval, and the part of it in the first, the inner and the last. */
struct span {
    long first, last;
    double head, body, tail;
};

/* Of a drop of the given half width; both are rounded, so all drops have one size. */
static struct span span_of(double centre, double half_width)
{
    const double c = rounded(centre) + 0.5, h = rounded(fabs(half_width));
    const double lo = c - h, hi = c + h, width = hi - lo;
    struct span s = {.first = (long)floor(lo), .head = 1};
    s.last = s.first;
    if (width > SMALL) {
        s.last = (long)ceil(hi) - 1;
        if (s.last > s.first) {
            s.body = 1 / width;
            s.head = ((double)(s.first + 1) - lo) * s.body;
            s.tail = (hi - (double)s.last) * s.body;
        }
    } else {
        s.last = s.first = (long)floor(0.5 * (lo + hi));
    }
    return s;
}

static double part_of(const struct span *s, long i)
{
    return i == s->first ? s->head : i == s->last ? s->tail : s->body;
}

/* Weight of pixel i of an input row; 0 for what must not count. */
static inline double weight_at(const struct drizzle_input *in, size_t i)
{
    const double w = in->weight ? in->w * (double)in->weight[i] : in->w;
    const int good = !isnan(in->pix[i]) && !(in->bad && in->bad[i]) && !(in->var && !(in->var[i] >= 0));
    return w > 0 && w < INFINITY && good ? w : 0;
}

/* One input pixel: value and variance in the output's unit, weight, bit of its exposure. */
struct drop {
    double d, v, w;
    uint32_t bit;
};

/* 0 when pixel i of the input does not count. */
static inline int drop_at(const struct drizzle_input *in, size_t i, struct drop *p)
{
    p->w = weight_at(in, i);
    p->d = in->scale * (double)in->pix[i];
    p->v = in->var ? in->scale * in->scale * (double)in->var[i] : 0;
    p->bit = in->bit;
    return p->w > 0;
}

/* Part a of a drop on pixel `at`. */
static inline void put(struct drizzle_band *b, size_t at, const struct drop *p, double wa)
{
    b->sum[2 * at] += wa * p->d;
    b->sum[2 * at + 1] += wa;
    if (b->context)
        b->context[at] |= p->bit;
    if (b->var)
        b->var[at] += wa * wa * p->v;
}

/* The drop of spans x and y. */
static void put_box(struct job *j, const struct span *x, const struct span *y, const struct drop *p)
{
    struct drizzle_band *b = j->band;
    const long top = b->y0 + b->ny - 1;
    b->split |= x->last > x->first || y->last > y->first;
    for (long r = y->first < b->y0 ? b->y0 : y->first; r <= (y->last < top ? y->last : top); r++) {
        const double wr = p->w * part_of(y, r);
        const size_t at = (size_t)(r - b->y0) * (size_t)b->nx;
        for (long c = x->first < 0 ? 0 : x->first; c <= (x->last < b->nx - 1 ? x->last : b->nx - 1); c++)
            put(b, at + (size_t)c, p, wr * part_of(x, c));
    }
}

/* What an aligned map does with each column. */
struct columns {
    struct span *span;
    int *cell;               /* the one cell of the band that gets all, -1: see the span */
};

/* One row of drops between the spans of its columns and s. */
static void row_boxes(struct job *j, const struct columns *col, const struct span *s, size_t row)
{
    const struct drizzle_input *in = j->in;
    struct drizzle_band *b = j->band;
    const size_t at = (size_t)(s->first - b->y0) * (size_t)b->nx;
    const int single = s->first == s->last;
    for (long x = 0; x < in->nx; x++) {
        struct drop p;
        if (!drop_at(in, row + (size_t)x, &p))
            continue;
        if (single && col->cell[x] >= 0)
            put(b, at + (size_t)col->cell[x], &p, p.w);
        else
            put_box(j, &col->span[x], s, &p);
    }
}

/* n drops of one row, `stride` cells apart, from the first cell of `sum` and `context` on. */
static void row_combed(const struct drizzle_input *in, const float *pix, long n, long stride, double *sum, uint32_t *context)
{
    const double w = in->w, scale = in->scale;
    for (long x = 0; x < n; x++) {
        const double d = scale * (double)pix[x];
        if (!isnan(d))
            *(pair *)(sum + 2 * stride * x) += (pair){w * d, w};
    }
    for (long x = 0; x < n && context; x++)
        if (!isnan(scale * (double)pix[x]))
            context[stride * x] |= in->bit;
}

/* Rows of drops that all fall on one cell each, at even distances. */
static int rows_combed(struct job *j)
{
    const struct drizzle_map *m = j->map;
    const struct drizzle_input *in = j->in;
    const struct drizzle_comb *comb = in->comb;
    struct drizzle_band *b = j->band;
    for (long y = 0; y < in->ny; y++) {
        const struct span s = span_of(m->y0 + m->yy * (double)(in->y0 + y), 0.5 * j->pixfrac * m->yy);
        if (s.first < b->y0 || s.first >= b->y0 + b->ny)
            continue;
        const size_t at = (size_t)(s.first - b->y0) * (size_t)b->nx + (size_t)comb->cell;
        row_combed(in, in->pix + (size_t)y * (size_t)in->nx + comb->first, comb->end - comb->first, comb->stride,
                   b->sum + 2 * at, b->context ? b->context + at : NULL);
    }
    return OK;
}

/* Axes along axes: every column has its span, every row one. */
static int rows_aligned(struct job *j)
{
    const struct drizzle_map *m = j->map;
    const struct drizzle_input *in = j->in;
    struct drizzle_band *b = j->band;
    const double half = 0.5 * j->pixfrac;
    const size_t n = (size_t)in->nx;
    if (in->comb && in->comb->stride && !in->weight && !in->bad && !in->var && in->w > 0)
        return rows_combed(j);
    struct columns col = {malloc(n * sizeof *col.span), malloc(n * sizeof *col.cell)};
    const int st = col.span && col.cell ? OK : E_NOMEM;
    for (size_t x = 0; x < n && st == OK; x++) {
        const struct span s = col.span[x] = span_of(m->x0 + m->xx * (double)x, half * m->xx);
        col.cell[x] = s.first == s.last && s.first >= 0 && s.first < b->nx ? (int)s.first : -1;
    }
    for (long y = 0; y < in->ny && st == OK; y++) {
        const struct span s = span_of(m->y0 + m->yy * (double)(in->y0 + y), half * m->yy);
        if (s.last >= b->y0 && s.first < b->y0 + b->ny)
            row_boxes(j, &col, &s, (size_t)y * n);
    }
    free(col.span);
    free(col.cell);
    return st;
}

/* Any quadrilateral. */
static void put_quad(struct job *j, const double X[4], const double Y[4], const struct drop *p)
{
    struct drizzle_band *b = j->band;
    const double area = overlap_area(X, Y);
    const double x0 = fmin(fmin(X[0], X[1]), fmin(X[2], X[3])), x1 = fmax(fmax(X[0], X[1]), fmax(X[2], X[3]));
    const double y0 = fmin(fmin(Y[0], Y[1]), fmin(Y[2], Y[3])), y1 = fmax(fmax(Y[0], Y[1]), fmax(Y[2], Y[3]));
    if (!(x1 > 0 && y1 > (double)b->y0 && x0 < (double)b->nx && y0 < (double)(b->y0 + b->ny)))
        return;
    if (!(fabs(area) > SMALL * SMALL)) {
        const struct span px = span_of(0.5 * (x0 + x1) - 0.5, 0);
        const struct span py = span_of(0.5 * (y0 + y1) - 0.5, 0);
        put_box(j, &px, &py, p);
        return;
    }
    long first = (long)floor(x0), last = (long)ceil(x1) - 1, low = (long)floor(y0), high = (long)ceil(y1) - 1;
    b->split |= last > first || high > low;
    first = first < 0 ? 0 : first;
    last = last > b->nx - 1 ? b->nx - 1 : last;
    low = low < b->y0 ? b->y0 : low;
    high = high > b->y0 + b->ny - 1 ? b->y0 + b->ny - 1 : high;
    for (long r = low; r <= high; r++) {
        overlap_row(X, Y, r, first, last - first + 1, j->row);
        const size_t at = (size_t)(r - b->y0) * (size_t)b->nx + (size_t)first;
        for (long c = 0; c <= last - first; c++) {
            const double a = j->row[c] / area;
            if (a > LEAST)
                put(b, at + (size_t)c, p, p->w * a);
        }
    }
}

/* A square of the mean scale along the output axes; a point when pixfrac is 0. */
static void drop_box(struct job *j, double x, double y, const struct drop *p)
{
    const double half = j->kernel == DRIZZLE_POINT ? 0 : 0.5 * j->pixfrac * j->map->scale;
    double X, Y;
    drizzle_map_at(j->map, x, y, &X, &Y);
    const struct span sx = span_of(X, half), sy = span_of(Y, half);
    put_box(j, &sx, &sy, p);
}

static double sinc(double x)
{
    return fabs(x) < 1e-8 ? 1 : sin(M_PI * x) / (M_PI * x);
}

/* Lanczos window of order n, x in its own unit. */
static double lanczos(double x, int n)
{
    return fabs(x) < n ? sinc(x) * sinc(x / n) : 0;
}

double drizzle_reach(enum drizzle_kernel kernel, double pixfrac, const struct drizzle_map *map)
{
    const double side = pixfrac * map->scale;
    switch (kernel) {
    case DRIZZLE_GAUSSIAN: return fmax(2.5 * side / FWHM_SIGMA, 1.2 * map->scale) + 1;
    case DRIZZLE_LANCZOS2: return 2 * side + 1;
    case DRIZZLE_LANCZOS3: return 3 * side + 1;
    case DRIZZLE_SQUARE:
        if (!map->node_x)
            return 0.5 * pixfrac * fmax(fabs(map->xx) + fabs(map->xy), fabs(map->yx) + fabs(map->yy)) + 1;
        return 2 * side + 2;
    case DRIZZLE_POINT: case DRIZZLE_TURBO: break;
    }
    return 0.5 * side + 1;
}

/* Gaussian and Lanczos: values at pixel centres. */
static void drop_smooth(struct job *j, double x, double y, const struct drop *p)
{
    struct drizzle_band *b = j->band;
    const double side = j->pixfrac * j->map->scale, reach = drizzle_reach(j->kernel, j->pixfrac, j->map) - 1;
    const double steep = FWHM_SIGMA * FWHM_SIGMA / (2 * side * side);
    const int order = j->kernel == DRIZZLE_LANCZOS2 ? 2 : 3, gauss = j->kernel == DRIZZLE_GAUSSIAN;
    double X, Y;
    drizzle_map_at(j->map, x, y, &X, &Y);
    X = rounded(X);
    Y = rounded(Y);
    long x0 = (long)floor(X - reach + 0.5), x1 = (long)floor(X + reach + 0.5);
    long y0 = (long)floor(Y - reach + 0.5), y1 = (long)floor(Y + reach + 0.5);
    b->split = 1;
    x0 = x0 < 0 ? 0 : x0;
    x1 = x1 > b->nx - 1 ? b->nx - 1 : x1;
    y0 = y0 < b->y0 ? b->y0 : y0;
    y1 = y1 > b->y0 + b->ny - 1 ? b->y0 + b->ny - 1 : y1;
    if (x0 > x1 || y0 > y1)
        return;
    for (long c = x0; c <= x1; c++) {
        const double t = (double)c - X;
        j->row[c - x0] = gauss ? exp(-steep * t * t) : lanczos(t / side, order);
    }
    for (long r = y0; r <= y1; r++) {
        const double t = (double)r - Y;
        const double line = p->w * (gauss ? steep / M_PI * exp(-steep * t * t) : lanczos(t / side, order));
        const size_t at = (size_t)(r - b->y0) * (size_t)b->nx;
        for (long c = x0; c <= x1; c++)
            put(b, at + (size_t)c, p, line * j->row[c - x0]);
    }
}

/* ---- the square kernel of any map: OVERLAP_LANES drops at a time ---- */

static inline long below(double v)
{
    const long i = (long)v;
    return i - (v < (double)i);
}

/* Least whole number that is not below v, 0 <= v < 2^31. */
static inline int above(double v)
{
    const int i = (int)v;
    return i + (v > (double)i);
}

/* Cells that an interval of this length can touch. */
static int cells(double length)
{
    const double n = ceil(length) + 1;
    return n < 2 ? 2 : n <= OVERLAP_WINDOW ? (int)n : OVERLAP_WINDOW + 1;
}

/* The drop of an affine map, relative to its centre; corners are multiples of 2^-20. */
struct shape {
    struct overlap_edges edges;      /* the same in every lane */
    double x[4], y[4];
    double x0, x1, y0, y1;
    int nx, ny;                      /* window, cells */
};

/* 0 when the shape has no area or is too large. */
static int shape_make(struct shape *s, const struct drizzle_map *m, double pixfrac)
{
    static const double side[4][2] = {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}};
    for (int k = 0; k < 4; k++) {
        s->x[k] = rounded(pixfrac * (m->xx * side[k][0] + m->xy * side[k][1]));
        s->y[k] = rounded(pixfrac * (m->yx * side[k][0] + m->yy * side[k][1]));
    }
    const double area = overlap_area(s->x, s->y);
    s->x0 = fmin(fmin(s->x[0], s->x[1]), fmin(s->x[2], s->x[3]));
    s->x1 = fmax(fmax(s->x[0], s->x[1]), fmax(s->x[2], s->x[3]));
    s->y0 = fmin(fmin(s->y[0], s->y[1]), fmin(s->y[2], s->y[3]));
    s->y1 = fmax(fmax(s->y[0], s->y[1]), fmax(s->y[2], s->y[3]));
    s->nx = cells(s->x1 - s->x0);
    s->ny = cells(s->y1 - s->y0);
    if (!(fabs(area) > SMALL * SMALL) || s->nx > OVERLAP_WINDOW || s->ny > OVERLAP_WINDOW)
        return 0;
    double x[4][OVERLAP_LANES], y[4][OVERLAP_LANES], factor[OVERLAP_LANES];
    for (int i = 0; i < OVERLAP_LANES; i++) {
        factor[i] = 1 / area;
        for (int k = 0; k < 4; k++) {
            x[k][i] = s->x[k];
            y[k][i] = s->y[k];
        }
    }
    overlap_edges_make(&s->edges, x, y, factor);
    return 1;
}

/* Drops waiting for their areas. */
struct batch {
    int n, nx, ny;
    struct drop drop[OVERLAP_LANES];
    long i0[OVERLAP_LANES], j0[OVERLAP_LANES];           /* corner of the window */
    int wide[OVERLAP_LANES], high[OVERLAP_LANES];        /* cells of it that the drop touches, from there on */
    double fx[OVERLAP_LANES], fy[OVERLAP_LANES];         /* centre in the window, of a shape */
    double x[OVERLAP_LANES];                             /* input pixel, of a grid's drop */
    double X[4][OVERLAP_LANES], Y[4][OVERLAP_LANES];     /* its corners */
    int odd[OVERLAP_LANES];                              /* must go through put_quad */
    struct overlap_edges edges;
    double area[OVERLAP_WINDOW * OVERLAP_WINDOW * OVERLAP_LANES];
};

/* A drop whose window lies in the band. */
static inline __attribute__((always_inline))
void spread(double *sum, size_t stride, const double *area, int nx, int ny, const struct drop *p)
{
    const pair d = {p->d, 1};
    for (int r = 0; r < ny; r++, sum += stride)
        for (int c = 0; c < nx; c++, area += OVERLAP_LANES) {
            const double wa = p->w * *area;
            *(pair *)(sum + 2 * c) += (pair){wa, wa} * d;
        }
}

static void mark(uint32_t *context, size_t stride, const double *area, int nx, int ny, uint32_t bit)
{
    for (int r = 0; r < ny; r++, context += stride)
        for (int c = 0; c < nx; c++, area += OVERLAP_LANES)
            context[c] |= *area > 0 ? bit : 0;
}

/* What of it falls on the band. */
static void spread_part(struct drizzle_band *b, const struct batch *t, int l)
{
    const long j1 = b->y0 + b->ny;
    for (long r = t->j0[l] < b->y0 ? b->y0 : t->j0[l]; r < t->j0[l] + t->ny && r < j1; r++)
        for (long c = t->i0[l] < 0 ? 0 : t->i0[l]; c < t->i0[l] + t->nx && c < b->nx; c++) {
            const double a = t->area[((r - t->j0[l]) * t->nx + c - t->i0[l]) * OVERLAP_LANES + l];
            if (a > 0)
                put(b, (size_t)((r - b->y0) * b->nx + c), &t->drop[l], t->drop[l].w * a);
        }
}

static void flush(struct job *j, struct batch *t)
{
    struct drizzle_band *b = j->band;
    if (t->n == 0)
        return;
    overlap_lanes(&t->edges, t->nx, t->ny, LEAST, t->area);
    b->split = 1;
    for (int l = 0; l < t->n; l++) {
        const long i = t->i0[l], r = t->j0[l] - b->y0;
        const struct drop *p = &t->drop[l];
        if (t->odd[l]) {
            const double X[4] = {t->X[0][l], t->X[1][l], t->X[2][l], t->X[3][l]};
            const double Y[4] = {t->Y[0][l], t->Y[1][l], t->Y[2][l], t->Y[3][l]};
            put_quad(j, X, Y, p);
            continue;
        }
        const int inside = i >= 0 && i + t->nx <= b->nx && r >= 0 && r + t->ny <= b->ny && fabs(p->d) < INFINITY;
        if (!inside || b->var) {
            spread_part(b, t, l);
            continue;
        }
        const size_t at = (size_t)r * (size_t)b->nx + (size_t)i, stride = (size_t)b->nx;
        double *sum = b->sum + 2 * at;
        if (t->nx == 2 && t->ny == 2)
            spread(sum, 2 * stride, t->area + l, 2, 2, p);
        else if (t->nx == 3 && t->ny == 3)
            spread(sum, 2 * stride, t->area + l, 3, 3, p);
        else if (t->nx == 4 && t->ny == 4)
            spread(sum, 2 * stride, t->area + l, 4, 4, p);
        else
            spread(sum, 2 * stride, t->area + l, t->nx, t->ny, p);
        if (b->context)
            mark(b->context + at, stride, t->area + l, t->nx, t->ny, p->bit);
    }
    t->n = 0;
}

/* The edges of a shape to the centres of a batch. */
WIDE static void place(const struct shape *s, struct batch *t)
{
    for (int k = 0; k < 4; k++) {
        const struct overlap_edges *e = &s->edges;
        struct overlap_edges *to = &t->edges;
        for (int i = 0; i < OVERLAP_LANES; i++) {
            to->ax[k][i] = t->fx[i] + e->ax[k][i];
            to->bx[k][i] = t->fx[i] + e->bx[k][i];
            to->ay[k][i] = t->fy[i] + e->ay[k][i];
            to->by[k][i] = t->fy[i] + e->by[k][i];
        }
    }
}

/* The smallest window that holds all drops of a batch. */
static void fit_window(struct batch *t)
{
    t->nx = t->ny = 2;
    for (int l = 0; l < t->n; l++) {
        t->nx = t->wide[l] > t->nx ? t->wide[l] : t->nx;
        t->ny = t->high[l] > t->ny ? t->high[l] : t->ny;
    }
}

/* Pixels lo..hi of one row, an affine map; centre and corners are rounded apart, so that all drops have one shape. */
static void row_shapes(struct job *j, const struct shape *s, struct batch *t, long y, long lo, long hi)
{
    const struct drizzle_map *m = j->map;
    const struct drizzle_input *in = j->in;
    const struct drizzle_band *b = j->band;
    const size_t row = (size_t)(y - in->y0) * (size_t)in->nx;
    const double X0 = m->x0 + m->xy * (double)y, Y0 = m->y0 + m->yy * (double)y;
    const double right = (double)b->nx, low = (double)b->y0, high = (double)(b->y0 + b->ny);
    memcpy(&t->edges, &s->edges, sizeof t->edges);
    for (long x = lo; x <= hi; x++) {
        const double X = rounded(X0 + m->xx * (double)x) + 0.5, Y = rounded(Y0 + m->yx * (double)x) + 0.5;
        const int l = t->n;
        if (!drop_at(in, row + (size_t)x, &t->drop[l])
            || !(X + s->x1 > 0 && X + s->x0 < right && Y + s->y1 > low && Y + s->y0 < high))
            continue;
        t->i0[l] = below(X + s->x0);
        t->j0[l] = below(Y + s->y0);
        t->fx[l] = X - (double)t->i0[l];
        t->fy[l] = Y - (double)t->j0[l];
        t->wide[l] = above(t->fx[l] + s->x1);
        t->high[l] = above(t->fy[l] + s->y1);
        if (++t->n == OVERLAP_LANES) {
            place(s, t);
            fit_window(t);
            flush(j, t);
        }
    }
    place(s, t);
    fit_window(t);
    flush(j, t);
}

/* Pixels lo..hi of one row, drops of an affine map that no window holds. */
static void row_large(struct job *j, long y, long lo, long hi)
{
    static const double side[4][2] = {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}};
    const struct drizzle_map *m = j->map;
    const size_t row = (size_t)(y - j->in->y0) * (size_t)j->in->nx;
    for (long x = lo; x <= hi; x++) {
        double X[4], Y[4], cx, cy;
        struct drop p;
        if (!drop_at(j->in, row + (size_t)x, &p))
            continue;
        drizzle_map_at(m, (double)x, (double)y, &cx, &cy);
        for (int k = 0; k < 4; k++) {
            const double u = j->pixfrac * side[k][0], v = j->pixfrac * side[k][1];
            X[k] = rounded(m->xx * u + m->xy * v) + rounded(cx) + 0.5;
            Y[k] = rounded(m->yx * u + m->yy * v) + rounded(cy) + 0.5;
        }
        put_quad(j, X, Y, &p);
    }
}

/* Two lines of a grid, through the lower and the upper corners of a row of drops. */
struct lines {
    double *X[2], *Y[2];
};

/* The node to the left, for interpolation. */
static inline int node(const struct drizzle_map *m, double g)
{
    const int n = (int)g, last = (int)m->gx - 2;
    return n < 0 ? 0 : n > last ? last : n;
}

/* The corners of a batch, rounded, in cells. */
WIDE static void corners(const struct drizzle_map *m, double pixfrac, const struct lines *s, struct batch *t)
{
    static const double side[4] = {-0.5, 0.5, 0.5, -0.5};
    const double per_pixel = 1 / (double)m->step;            /* a power of two */
    for (int k = 0; k < 4; k++) {
        const double shift = 1 + pixfrac * side[k], *X = s->X[k / 2], *Y = s->Y[k / 2];
        const int one = node(m, (t->x[0] + shift) * per_pixel);
        if (one == node(m, (t->x[t->n - 1] + shift) * per_pixel)) {
            const double x0 = X[one], x1 = X[one + 1], y0 = Y[one], y1 = Y[one + 1];
            for (int i = 0; i < OVERLAP_LANES; i++) {
                const double u = (t->x[i] + shift) * per_pixel - one;
                t->X[k][i] = rounded(x0 + u * (x1 - x0)) + 0.5;
                t->Y[k][i] = rounded(y0 + u * (y1 - y0)) + 0.5;
            }
            continue;
        }
        for (int i = 0; i < OVERLAP_LANES; i++) {
            const double g = (t->x[i] + shift) * per_pixel;
            const int n = node(m, g);
            const double u = g - n;
            t->X[k][i] = rounded(X[n] + u * (X[n + 1] - X[n])) + 0.5;
            t->Y[k][i] = rounded(Y[n] + u * (Y[n + 1] - Y[n])) + 0.5;
        }
    }
}

static inline double least4(double a, double b, double c, double d)
{
    const double p = a < b ? a : b, q = c < d ? c : d;
    return p < q ? p : q;
}

static inline double most4(double a, double b, double c, double d)
{
    return -least4(-a, -b, -c, -d);
}

/* Windows and edges of a batch of corners. */
static void frame(struct batch *t)
{
    double x[4][OVERLAP_LANES], y[4][OVERLAP_LANES], factor[OVERLAP_LANES];
    double (*X)[OVERLAP_LANES] = t->X, (*Y)[OVERLAP_LANES] = t->Y;
    for (int i = 0; i < t->n; i++) {
        const double area = 0.5 * ((X[2][i] - X[0][i]) * (Y[3][i] - Y[1][i]) - (X[3][i] - X[1][i]) * (Y[2][i] - Y[0][i]));
        const double x0 = least4(X[0][i], X[1][i], X[2][i], X[3][i]), x1 = most4(X[0][i], X[1][i], X[2][i], X[3][i]);
        const double y0 = least4(Y[0][i], Y[1][i], Y[2][i], Y[3][i]), y1 = most4(Y[0][i], Y[1][i], Y[2][i], Y[3][i]);
        const long i0 = below(x0), j0 = below(y0);
        const double fi = (double)i0, fj = (double)j0, wide = x1 - fi, high = y1 - fj;
        t->odd[i] = !(fabs(area) > SMALL * SMALL) || !(wide <= OVERLAP_WINDOW) || !(high <= OVERLAP_WINDOW);
        t->i0[i] = i0;
        t->j0[i] = j0;
        factor[i] = t->odd[i] ? 0 : 1 / area;
        for (int k = 0; k < 4; k++) {
            x[k][i] = t->odd[i] ? 0 : X[k][i] - fi;
            y[k][i] = t->odd[i] ? 0 : Y[k][i] - fj;
        }
        t->wide[i] = t->odd[i] ? 2 : above(wide);
        t->high[i] = t->odd[i] ? 2 : above(high);
    }
    fit_window(t);
    for (int i = t->n; i < OVERLAP_LANES; i++) {
        factor[i] = 0;
        for (int k = 0; k < 4; k++)
            x[k][i] = y[k][i] = 0;
    }
    overlap_edges_make(&t->edges, x, y, factor);
}

/* 1 when no drop of the pixels between nodes n and n + 1 of the lines comes within `reach` of the band. */
static int misses(const struct drizzle_band *b, const struct lines *s, long n, double reach)
{
    const double *p = s->Y[0] + n, *q = s->Y[1] + n;
    return least4(p[0], p[1], q[0], q[1]) - reach > (double)(b->y0 + b->ny) || most4(p[0], p[1], q[0], q[1]) + reach < (double)b->y0;
}

static void finish(struct job *j, struct batch *t, const struct lines *s)
{
    if (t->n == 0)
        return;
    corners(j->map, j->pixfrac, s, t);
    frame(t);
    flush(j, t);
}

/* One row of a map with a grid, cell by cell. */
static void row_quads(struct job *j, struct batch *t, const struct lines *s, long y, double reach)
{
    const struct drizzle_map *m = j->map;
    const long nx = j->in->nx;
    const size_t row = (size_t)(y - j->in->y0) * (size_t)nx;
    drizzle_map_line(m, (double)y - 0.5 * j->pixfrac, s->X[0], s->Y[0]);
    drizzle_map_line(m, (double)y + 0.5 * j->pixfrac, s->X[1], s->Y[1]);
    for (long n = 0; n < m->gx - 1; n++) {
        const long first = n * m->step - 1, end = first + m->step;
        if (misses(j->band, s, n, reach))
            continue;
        for (long x = first < 0 ? 0 : first; x < (end < nx ? end : nx); x++) {
            if (drop_at(j->in, row + (size_t)x, &t->drop[t->n]))
                t->x[t->n++] = (double)x;
            if (t->n == OVERLAP_LANES)
                finish(j, t, s);
        }
    }
    finish(j, t, s);
}

/* Part of [*lo, *hi] where c + m x lies in [a, b]. */
static void narrow(double c, double m, double a, double b, double *lo, double *hi)
{
    if (!(fabs(m) > 1e-12)) {
        if (!(c >= a && c <= b))
            *hi = *lo - 1;
        return;
    }
    const double p = (a - c) / m, q = (b - c) / m;
    *lo = fmax(*lo, fmin(p, q));
    *hi = fmin(*hi, fmax(p, q));
}

/* Pixels lo..hi of row y of the image, any kernel but square. */
static void row_others(struct job *j, long y, long lo, long hi)
{
    const struct drizzle_input *in = j->in;
    const size_t row = (size_t)(y - in->y0) * (size_t)in->nx;
    const int box = j->kernel == DRIZZLE_POINT || j->kernel == DRIZZLE_TURBO;
    for (long x = lo; x <= hi; x++) {
        struct drop p;
        if (!drop_at(in, row + (size_t)x, &p))
            continue;
        if (box)
            drop_box(j, (double)x, (double)y, &p);
        else
            drop_smooth(j, (double)x, (double)y, &p);
    }
}

/* Every pixel of the rows whose drop can reach the band. */
static int rows_general(struct job *j)
{
    const struct drizzle_map *m = j->map;
    const struct drizzle_input *in = j->in;
    const struct drizzle_band *b = j->band;
    const double reach = drizzle_reach(j->kernel, j->pixfrac, m) + 1;
    const double low = (double)b->y0 - reach, high = (double)(b->y0 + b->ny) + reach;
    const size_t gx = m->node_x ? (size_t)m->gx : 1;
    struct shape *shape = malloc(sizeof *shape);
    struct batch *t = calloc(1, sizeof *t);
    double *line = malloc(4 * gx * sizeof *line);
    j->row = malloc(((size_t)b->nx + 2) * sizeof *j->row);
    const int st = shape && t && line && j->row ? OK : E_NOMEM;
    const int square = j->kernel == DRIZZLE_SQUARE;
    const struct lines lines = {{line, line + gx}, {line + 2 * gx, line + 3 * gx}};
    const int shaped = st == OK && square && !m->node_x && shape_make(shape, m, j->pixfrac);
    for (long y = in->y0; y < in->y0 + in->ny && st == OK; y++) {
        double lo = 0, hi = (double)(in->nx - 1);
        if (!m->node_x) {
            narrow(m->x0 + m->xy * (double)y, m->xx, -reach, (double)b->nx + reach, &lo, &hi);
            narrow(m->y0 + m->yy * (double)y, m->yx, low, high, &lo, &hi);
        }
        if (!(lo <= hi))
            continue;
        if (shaped)
            row_shapes(j, shape, t, y, (long)ceil(lo), (long)hi);
        else if (square && m->node_x)
            row_quads(j, t, &lines, y, reach);
        else if (square)
            row_large(j, y, (long)ceil(lo), (long)hi);
        else
            row_others(j, y, (long)ceil(lo), (long)hi);
    }
    free(j->row);
    free(line);
    free(shape);
    free(t);
    return st;
}

int drizzle_rows(enum drizzle_kernel kernel, double pixfrac, const struct drizzle_map *map,
                 const struct drizzle_input *in, struct drizzle_band *band)
{
    if (!(pixfrac >= 0 && pixfrac <= 8) || !(in->w >= 0 && in->w < INFINITY) || !isfinite(in->scale))
        return E_RANGE;
    struct job j = {.map = map, .in = in, .band = band, .kernel = kernel, .pixfrac = pixfrac};
    if (pixfrac * map->scale <= SMALL || kernel == DRIZZLE_POINT) {
        j.kernel = DRIZZLE_POINT;
        j.pixfrac = 0;
    }
    const int parallel = !map->node_x && map->xy == 0 && map->yx == 0;
    if (parallel && (j.kernel == DRIZZLE_SQUARE || j.kernel == DRIZZLE_POINT))
        return rows_aligned(&j);
    return rows_general(&j);
}

/* Any of n drops along an axis on two cells? */
static int axis_splits(double x0, double xx, double half, long n)
{
    for (long i = 0; i < n; i++) {
        const struct span s = span_of(x0 + xx * (double)i, half * xx);
        if (s.last > s.first)
            return 1;
    }
    return 0;
}

int drizzle_splits(enum drizzle_kernel kernel, double pixfrac, const struct drizzle_map *m, long nx, long ny)
{
    const double half = 0.5 * pixfrac;
    if (kernel == DRIZZLE_POINT || pixfrac * m->scale <= SMALL)
        return 0;
    if ((kernel != DRIZZLE_SQUARE && kernel != DRIZZLE_TURBO) || m->node_x)
        return 1;
    if (m->xy == 0 && m->yx == 0)
        return axis_splits(m->x0, m->xx, half, nx) || axis_splits(m->y0, m->yy, half, ny);
    if (m->xx == 0 && m->yy == 0)
        return axis_splits(m->x0, m->xy, half, ny) || axis_splits(m->y0, m->yx, half, nx);
    return 1;
}

void drizzle_comb_make(struct drizzle_comb *comb, enum drizzle_kernel kernel, double pixfrac, const struct drizzle_map *m,
                       long nx, long ny, long width)
{
    *comb = (struct drizzle_comb){0};
    if ((kernel != DRIZZLE_SQUARE && kernel != DRIZZLE_POINT) || m->node_x || m->xy != 0 || m->yx != 0 ||
        drizzle_splits(kernel, pixfrac, m, nx, ny))
        return;
    const double half = kernel == DRIZZLE_POINT ? 0 : 0.5 * pixfrac;
    struct drizzle_comb c = {0};
    for (long x = 0; x < nx; x++) {
        const long cell = span_of(m->x0 + m->xx * (double)x, half * m->xx).first;
        if (cell < 0 || cell >= width)
            continue;
        if (c.end == 0) {
            c.first = x;
            c.cell = cell;
        } else if (c.end == c.first + 1) {
            c.stride = cell - c.cell;
        }
        if (cell != c.cell + c.stride * (x - c.first))
            return;
        c.end = x + 1;
    }
    if (c.stride != 0)
        *comb = c;
}

double drizzle_noise_factor(enum drizzle_kernel kernel, double pixfrac, double ratio)
{
    const double r = pixfrac * ratio;
    if (kernel == DRIZZLE_POINT || !(r > 0))
        return 1;
    if (kernel == DRIZZLE_SQUARE || kernel == DRIZZLE_TURBO)
        return r >= 1 ? r / (1 - 1 / (3 * r)) : 1 / (1 - r / 3);
    /* 1 / mean over phases of sum k^2 / (sum k)^2, k along one axis */
    enum { PHASES = 64 };
    const long reach = (long)(3 * r) + 2;
    double mean = 0;
    for (int p = 0; p < PHASES; p++) {
        double sum = 0, squares = 0;
        for (long i = -reach; i <= reach; i++) {
            const double t = ((double)i + (p + 0.5) / PHASES - 0.5) / r;
            const double k = kernel == DRIZZLE_GAUSSIAN ? exp(-0.5 * FWHM_SIGMA * FWHM_SIGMA * t * t)
                                                        : lanczos(t, kernel == DRIZZLE_LANCZOS2 ? 2 : 3);
            sum += k;
            squares += k * k;
        }
        mean += squares / (sum * sum) / PHASES;
    }
    return 1 / mean;
}
