/*
 * drizzle.c - drops of input pixels on the output grid.
 */
#include "drizzle.h"
#include "overlap.h"
#include "simd.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define GRID_START 64
#define AFFINE_ERROR 3e-7     /* px */
#define PARALLEL 5e-7         /* px over the image */
#define SMALL 9.6e-7          /* a drop of this side is a point */
#define LEAST 1e-12           /* parts of a drop below this are rounding */
#define FWHM_SIGMA 2.3548

/* Nearest multiple of 2^-20, |v| < 2^31. */
static double rounded(double v)
{
    const double magic = 0x1.8p32;
    return (v + magic) - magic;
}

/* ---- maps ---- */

static void affine_at(const struct drizzle_map *m, double x, double y, double *X, double *Y)
{
    *X = m->x0 + m->xx * x + m->xy * y;
    *Y = m->y0 + m->yx * x + m->yy * y;
}

void drizzle_map_at(const struct drizzle_map *m, double x, double y, double *X, double *Y)
{
    if (!m->node_x) {
        affine_at(m, x, y, X, Y);
        return;
    }
    const double gx = (x + 1) / (double)m->step, gy = (y + 1) / (double)m->step;
    long i = (long)gx, j = (long)gy;
    i = i < 0 ? 0 : i > m->gx - 2 ? m->gx - 2 : i;
    j = j < 0 ? 0 : j > m->gy - 2 ? m->gy - 2 : j;
    const double u = gx - (double)i, v = gy - (double)j;
    const size_t k = (size_t)j * (size_t)m->gx + (size_t)i, l = k + (size_t)m->gx;
    const double *px = m->node_x, *py = m->node_y;
    *X = (1 - v) * (px[k] + u * (px[k + 1] - px[k])) + v * (px[l] + u * (px[l + 1] - px[l]));
    *Y = (1 - v) * (py[k] + u * (py[k + 1] - py[k])) + v * (py[l] + u * (py[l + 1] - py[l]));
}

void drizzle_map_bounds(const struct drizzle_map *m, double x0, double y0, double x1, double y1,
                        double lo[2], double hi[2])
{
    const double step = m->node_x ? (double)m->step : INFINITY, slack = m->node_x ? 1e-3 : 1e-6;
    lo[0] = lo[1] = INFINITY;
    hi[0] = hi[1] = -INFINITY;
    /* a bilinear cell has its extremes in its corners, so nodes and borders suffice */
    for (double y = y0;; y = fmin(y1, (floor((y + 1) / step) + 1) * step - 1)) {
        for (double x = x0;; x = fmin(x1, (floor((x + 1) / step) + 1) * step - 1)) {
            double p[2];
            drizzle_map_at(m, x, y, &p[0], &p[1]);
            for (int k = 0; k < 2; k++) {
                lo[k] = fmin(lo[k], p[k] - slack);
                hi[k] = fmax(hi[k], p[k] + slack);
            }
            if (!(x < x1))
                break;
        }
        if (!(y < y1))
            break;
    }
}

/* Largest distance of the map from the transformation over a lattice of nx x ny points. */
static int worst_error(const struct drizzle_map *m, double x0, double y0, double dx, double dy, long nx, long ny,
                       drizzle_transform *fn, void *ctx, double *worst)
{
    double *b = malloc(4 * (size_t)nx * sizeof *b);
    if (!b)
        return E_NOMEM;
    double *x = b, *y = b + nx, *X = y + nx, *Y = X + nx;
    int st = OK;
    for (long j = 0; j < ny && st == OK; j++) {
        for (long i = 0; i < nx; i++) {
            x[i] = x0 + dx * (double)i;
            y[i] = y0 + dy * (double)j;
        }
        st = fn(ctx, (size_t)nx, x, y, X, Y);
        for (long i = 0; i < nx && st == OK; i++) {
            double px, py;
            drizzle_map_at(m, x[i], y[i], &px, &py);
            double e = fmax(fabs(px - X[i]), fabs(py - Y[i]));
            if (!(e <= *worst))
                *worst = isnan(e) ? INFINITY : e;
        }
    }
    free(b);
    return st;
}

/* Affine map through three corners; *error is its worst on an 17 x 17 lattice. */
static int fit_affine(struct drizzle_map *m, long nx, long ny, drizzle_transform *fn, void *ctx, double *error)
{
    const double w = (double)nx, h = (double)ny;
    const double x[3] = {-0.5, w - 0.5, -0.5}, y[3] = {-0.5, -0.5, h - 0.5};
    double X[3], Y[3];
    int st = fn(ctx, 3, x, y, X, Y);
    if (st)
        return st;
    m->xx = (X[1] - X[0]) / w;
    m->xy = (X[2] - X[0]) / h;
    m->yx = (Y[1] - Y[0]) / w;
    m->yy = (Y[2] - Y[0]) / h;
    const double most = fmax(w, h);
    if (fabs(m->xy) * most < PARALLEL && fabs(m->yx) * most < PARALLEL)
        m->xy = m->yx = 0;
    if (fabs(m->xx) * most < PARALLEL && fabs(m->yy) * most < PARALLEL)
        m->xx = m->yy = 0;
    m->x0 = X[0] + 0.5 * (m->xx + m->xy);
    m->y0 = Y[0] + 0.5 * (m->yx + m->yy);
    return worst_error(m, -0.5, -0.5, w / 16, h / 16, 17, 17, fn, ctx, error);
}

/* Nodes every m->step pixels from -1 to beyond the far side. */
static int fill_grid(struct drizzle_map *m, long nx, long ny, drizzle_transform *fn, void *ctx)
{
    m->gx = (nx + 1) / m->step + 2;
    m->gy = (ny + 1) / m->step + 2;
    const size_t n = (size_t)m->gx * (size_t)m->gy;
    m->node_x = malloc(n * sizeof *m->node_x);
    m->node_y = malloc(n * sizeof *m->node_y);
    double *x = malloc(2 * (size_t)m->gx * sizeof *x);
    int st = m->node_x && m->node_y && x ? OK : E_NOMEM;
    for (long j = 0; j < m->gy && st == OK; j++) {
        for (long i = 0; i < m->gx; i++) {
            x[i] = (double)(i * m->step - 1);
            x[m->gx + i] = (double)(j * m->step - 1);
        }
        const size_t k = (size_t)j * (size_t)m->gx;
        st = fn(ctx, (size_t)m->gx, x, x + m->gx, m->node_x + k, m->node_y + k);
    }
    free(x);
    return st;
}

int drizzle_map_make(struct drizzle_map *m, long nx, long ny, drizzle_transform *fn, void *ctx)
{
    if (nx < 1 || ny < 1)
        return E_RANGE;
    struct drizzle_map new = {0};
    double error = 0;
    int st = fit_affine(&new, nx, ny, fn, ctx, &error);
    for (long step = GRID_START; st == OK && !(error <= (new.node_x ? DRIZZLE_MAP_ERROR : AFFINE_ERROR)); step /= 2) {
        drizzle_map_free(&new);
        if (step < 1)
            return E_NOCONV;
        new.step = step;
        st = fill_grid(&new, nx, ny, fn, ctx);
        const double half = 0.5 * (double)step;
        error = 0;
        if (st == OK && step > 1)
            st = worst_error(&new, -1 + half, -1, half, half, 2 * new.gx - 3, 2 * new.gy - 1, fn, ctx, &error);
    }
    if (st == OK) {
        const double cx = 0.5 * (double)(nx - 1), cy = 0.5 * (double)(ny - 1);
        double ax, ay, bx, by, px, py, qx, qy;
        drizzle_map_at(&new, cx - 0.5, cy, &ax, &ay);
        drizzle_map_at(&new, cx + 0.5, cy, &bx, &by);
        drizzle_map_at(&new, cx, cy - 0.5, &px, &py);
        drizzle_map_at(&new, cx, cy + 0.5, &qx, &qy);
        new.scale = sqrt(fabs((bx - ax) * (qy - py) - (by - ay) * (qx - px)));
        if (!(new.scale > 1e-9 && new.scale < 1e9))
            st = E_SINGULAR;
    }
    if (st)
        drizzle_map_free(&new);
    else
        *m = new;
    return st;
}

void drizzle_map_free(struct drizzle_map *m)
{
    free(m->node_x);
    free(m->node_y);
    m->node_x = m->node_y = NULL;
}

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
static double weight_at(const struct drizzle_input *in, size_t i)
{
    if (!in->weight)
        return isnan(in->pix[i]) ? 0 : in->w;
    const double w = in->w * (double)in->weight[i];
    return w > 0 && !isnan(in->pix[i]) ? w : 0;
}

static inline void put(struct drizzle_band *b, size_t at, double flux, double weight, uint32_t bit)
{
    b->flux[at] += flux;
    b->weight[at] += weight;
    if (b->context)
        b->context[at] |= bit;
}

/* The drop of spans x and y. */
static void put_box(struct job *j, const struct span *x, const struct span *y, double d, double w)
{
    struct drizzle_band *b = j->band;
    const long top = b->y0 + b->ny - 1;
    b->split |= x->last > x->first || y->last > y->first;
    for (long r = y->first < b->y0 ? b->y0 : y->first; r <= (y->last < top ? y->last : top); r++) {
        const double wr = w * part_of(y, r);
        const size_t at = (size_t)(r - b->y0) * (size_t)b->nx;
        for (long c = x->first < 0 ? 0 : x->first; c <= (x->last < b->nx - 1 ? x->last : b->nx - 1); c++) {
            const double wa = wr * part_of(x, c);
            put(b, at + (size_t)c, wa * d, wa, j->in->bit);
        }
    }
}

/* Axes along axes: every column has its span, every row one. */
static void drop_aligned(struct job *j, const struct span *columns)
{
    const struct drizzle_map *m = j->map;
    const struct drizzle_input *in = j->in;
    struct drizzle_band *b = j->band;
    const double half = 0.5 * j->pixfrac;
    for (long y = 0; y < in->ny; y++) {
        const double Y = (double)(in->y0 + y);
        const struct span s = span_of(m->y0 + m->yy * Y, half * m->yy);
        if (s.last < b->y0 || s.first >= b->y0 + b->ny)
            continue;
        const size_t row = (size_t)y * (size_t)in->nx;
        const size_t at = (size_t)(s.first - b->y0) * (size_t)b->nx;
        for (long x = 0; x < in->nx; x++) {
            const struct span *c = &columns[x];
            const double w = weight_at(in, row + (size_t)x);
            if (!(w > 0))
                continue;
            const double d = in->scale * (double)in->pix[row + (size_t)x];
            if (s.first == s.last && c->first == c->last) {
                if (c->first >= 0 && c->first < b->nx)
                    put(b, at + (size_t)c->first, w * d, w, in->bit);
            } else {
                put_box(j, c, &s, d, w);
            }
        }
    }
}

static int rows_aligned(struct job *j)
{
    const struct drizzle_map *m = j->map;
    const double half = 0.5 * j->pixfrac;
    struct span *columns = malloc((size_t)j->in->nx * sizeof *columns);
    if (!columns)
        return E_NOMEM;
    for (long x = 0; x < j->in->nx; x++) {
        columns[x] = span_of(m->x0 + m->xx * (double)x, half * m->xx);
    }
    drop_aligned(j, columns);
    free(columns);
    return OK;
}

/* Any quadrilateral. */
static void put_quad(struct job *j, const double X[4], const double Y[4], double d, double w)
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
        put_box(j, &px, &py, d, w);
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
                put(b, at + (size_t)c, w * a * d, w * a, j->in->bit);
        }
    }
}

/* Any map: centre and corners are rounded apart where it is affine, so that all drops have one shape. */
static void drop_square(struct job *j, double x, double y, double d, double w)
{
    static const double side[4][2] = {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}};
    const struct drizzle_map *m = j->map;
    double X[4], Y[4], cx = 0, cy = 0;
    if (!m->node_x)
        affine_at(m, x, y, &cx, &cy);
    for (int k = 0; k < 4; k++) {
        const double u = j->pixfrac * side[k][0], v = j->pixfrac * side[k][1];
        if (m->node_x) {
            drizzle_map_at(m, x + u, y + v, &X[k], &Y[k]);
        } else {
            X[k] = m->xx * u + m->xy * v;
            Y[k] = m->yx * u + m->yy * v;
        }
        X[k] = rounded(X[k]) + rounded(cx) + 0.5;
        Y[k] = rounded(Y[k]) + rounded(cy) + 0.5;
    }
    put_quad(j, X, Y, d, w);
}

/* A square of the mean scale along the output axes; a point when pixfrac is 0. */
static void drop_box(struct job *j, double x, double y, double d, double w)
{
    const double half = j->kernel == DRIZZLE_POINT ? 0 : 0.5 * j->pixfrac * j->map->scale;
    double X, Y;
    drizzle_map_at(j->map, x, y, &X, &Y);
    const struct span sx = span_of(X, half), sy = span_of(Y, half);
    put_box(j, &sx, &sy, d, w);
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
static void drop_smooth(struct job *j, double x, double y, double d, double w)
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
        const double line = w * (gauss ? steep / M_PI * exp(-steep * t * t) : lanczos(t / side, order));
        const size_t at = (size_t)(r - b->y0) * (size_t)b->nx;
        for (long c = x0; c <= x1; c++) {
            const double wa = line * j->row[c - x0];
            put(b, at + (size_t)c, wa * d, wa, j->in->bit);
        }
    }
}

/* ---- parallelograms: the square kernel of an affine map ---- */

enum { WINDOW = 8, STRIDE = WINDOW + 2 };    /* cells; larger drops take put_quad */

/* An edge of the drop from its lower to its upper end, relative to the drop's centre. */
struct edge {
    double ax, ay, bx, by;
    double x_per_y, step;    /* dx/dy; |dy/dx| * rise */
    double rise;             /* part of the drop to the right of 1 pixel of height */
};

struct shape {
    struct edge edge[4];
    int edges;               /* level ones are left out: nothing lies to their right */
    double x[4], y[4];       /* corners, multiples of 2^-20 */
    double x0, x1, y0, y1;
};

/* 0 when the shape has no area. */
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
    s->edges = 0;
    for (int k = 0; k < 4; k++) {
        const int l = (k + 1) & 3, up = s->y[l] > s->y[k], lo = up ? k : l, hi = up ? l : k;
        const double dx = s->x[hi] - s->x[lo], dy = s->y[hi] - s->y[lo];
        if (!(dy > 0))
            continue;
        const double rise = (up ? -1 : 1) / area;
        s->edge[s->edges++] = (struct edge){
            .ax = s->x[lo], .ay = s->y[lo], .bx = s->x[hi], .by = s->y[hi],
            .x_per_y = dx / dy, .rise = rise, .step = dx < 0 || dx > 0 ? rise * fabs(dy / dx) : 0,
        };
    }
    return fabs(area) > SMALL * SMALL;
}

/* A piece of an edge inside one row of cells, from x = xa <= xb, with h to its right. */
static inline void piece(double *sum, double xa, double xb, double h, double step)
{
    const int ia = (int)xa, ib = (int)xb;
    if (ia == ib) {
        const double m = h * (0.5 * (xa + xb) - ia);
        sum[ia] += h - m;
        sum[ia + 1] += m;
        return;
    }
    const double first = ia + 1 - xa, last = xb - ib;
    const double p = step * first, q = 0.5 * p * first;
    sum[ia] += q;
    sum[ia + 1] += p - q;
    for (int i = ia + 1; i < ib; i++) {
        sum[i] += 0.5 * step;
        sum[i + 1] += 0.5 * step;
    }
    const double t = step * last, u = 0.5 * t * last;
    sum[ib] += t - u;
    sum[ib + 1] += u;
}

/* Adds the edges of a shape centred at (X, Y) of the window; as overlap_row, for all rows. */
static inline void cover(const struct shape *s, double X, double Y, double *sum)
{
    for (int k = 0; k < s->edges; k++) {
        const struct edge *e = &s->edge[k];
        const double ax = X + e->ax, ay = Y + e->ay, by = Y + e->by;
        double x = ax, y = ay;
        int r = (int)ay;
        for (;;) {
            const int end = r + 1 >= by;
            const double top = end ? by : r + 1, next = end ? X + e->bx : ax + (top - ay) * e->x_per_y;
            const double h = e->rise * (top - y);
            if (x < next)
                piece(sum + r * STRIDE, x, next, h, e->step);
            else
                piece(sum + r * STRIDE, next, x, h, e->step);
            if (end)
                break;
            x = next;
            y = top;
            r++;
        }
    }
}

static inline long below(double v)
{
    const long i = (long)v;
    return i - (v < (double)i);
}

/* One drop at (X, Y), in cells. */
static inline void drop_shape(struct job *j, const struct shape *s, double X, double Y, double d, double w)
{
    struct drizzle_band *b = j->band;
    if (!(X + s->x1 > 0 && X + s->x0 < (double)b->nx && Y + s->y1 > (double)b->y0
          && Y + s->y0 < (double)(b->y0 + b->ny)))
        return;
    const long i0 = below(X + s->x0), j0 = below(Y + s->y0);
    const int nx = (int)(below(X + s->x1) - i0) + 1, ny = (int)(below(Y + s->y1) - j0) + 1;
    double sum[WINDOW * STRIDE];
    for (int i = 0; i < ny * STRIDE; i++)
        sum[i] = 0;
    cover(s, X - (double)i0, Y - (double)j0, sum);
    const int c0 = i0 < 0 ? (int)-i0 : 0, c1 = i0 + nx > b->nx ? (int)(b->nx - i0) : nx;
    const int r0 = j0 < b->y0 ? (int)(b->y0 - j0) : 0, r1 = j0 + ny > b->y0 + b->ny ? (int)(b->y0 + b->ny - j0) : ny;
    b->split = 1;
    for (int r = r0; r < r1; r++) {
        const size_t at = (size_t)((j0 + r - b->y0) * b->nx + i0 + c0);
        const double *line = sum + r * STRIDE;
        double *flux = b->flux + at, *weight = b->weight + at;
        double a = 0;
        for (int c = 0; c < c0; c++)
            a += line[c];
        for (int c = c0; c < c1; c++) {
            a += line[c];
            if (a > LEAST) {
                const double wa = w * a;
                flux[c - c0] += wa * d;
                weight[c - c0] += wa;
                if (b->context)
                    b->context[at + (size_t)(c - c0)] |= j->in->bit;
            }
        }
    }
}

/* Pixels lo..hi of one row. */
WIDE static void row_shapes(struct job *j, const struct shape *s, long y, long lo, long hi)
{
    const struct drizzle_map *m = j->map;
    const struct drizzle_input *in = j->in;
    const size_t row = (size_t)(y - in->y0) * (size_t)in->nx;
    const double X0 = m->x0 + m->xy * (double)y, Y0 = m->y0 + m->yy * (double)y;
    for (long x = lo; x <= hi; x++) {
        const double w = weight_at(in, row + (size_t)x);
        if (w > 0)
            drop_shape(j, s, rounded(X0 + m->xx * (double)x) + 0.5, rounded(Y0 + m->yx * (double)x) + 0.5,
                       in->scale * (double)in->pix[row + (size_t)x], w);
    }
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

/* Every pixel of the rows whose drop can reach the band. */
static int rows_general(struct job *j)
{
    const struct drizzle_map *m = j->map;
    const struct drizzle_input *in = j->in;
    const struct drizzle_band *b = j->band;
    const double reach = drizzle_reach(j->kernel, j->pixfrac, m) + 1;
    const double low = (double)b->y0 - reach, high = (double)(b->y0 + b->ny) + reach;
    struct shape shape = {.edges = 0};
    const int shaped = j->kernel == DRIZZLE_SQUARE && !m->node_x && shape_make(&shape, m, j->pixfrac)
        && shape.x1 - shape.x0 < WINDOW - 2 && shape.y1 - shape.y0 < WINDOW - 2;
    j->row = malloc(((size_t)b->nx + 2) * sizeof *j->row);
    if (!j->row)
        return E_NOMEM;
    for (long y = 0; y < in->ny; y++) {
        const double Y = (double)(in->y0 + y);
        double lo = 0, hi = (double)(in->nx - 1);
        if (!m->node_x) {
            narrow(m->x0 + m->xy * Y, m->xx, -reach, (double)b->nx + reach, &lo, &hi);
            narrow(m->y0 + m->yy * Y, m->yx, low, high, &lo, &hi);
        }
        if (!(lo <= hi))
            continue;
        if (shaped) {
            row_shapes(j, &shape, in->y0 + y, (long)ceil(lo), (long)hi);
            continue;
        }
        const size_t row = (size_t)y * (size_t)in->nx;
        for (long x = (long)ceil(lo); x <= (long)hi; x++) {
            const double w = weight_at(in, row + (size_t)x);
            if (!(w > 0))
                continue;
            const double d = in->scale * (double)in->pix[row + (size_t)x];
            if (j->kernel == DRIZZLE_SQUARE)
                drop_square(j, (double)x, Y, d, w);
            else if (j->kernel == DRIZZLE_POINT || j->kernel == DRIZZLE_TURBO)
                drop_box(j, (double)x, Y, d, w);
            else
                drop_smooth(j, (double)x, Y, d, w);
        }
    }
    free(j->row);
    return OK;
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
