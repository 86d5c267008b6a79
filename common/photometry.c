/*
 * photometry.c - measurements on a stamp around one object; see photometry.h.
 *
 * The stamp is cut once, background subtracted, neighbours and bad pixels
 * replaced; everything else reads the stamp.
 */
#include "photometry.h"
#include "grow.h"
#include "simd.h"
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LANES = 8, PIECE = 64 };           /* PIECE: pixels looked at at once where some may be bad */
static const double KRON_REACH = 6;        /* ellipse of the Kron radius, rms radii */
static const double FWHM_SIGMA = 2.3548200450309493;

struct stamp {
    long x0, y0, nx, ny;
    float *v;                              /* nx*ny, above background */
    unsigned char *replaced;               /* 1: neighbour or bad, mirrored or zero */
    int any_replaced;
    double cx, cy;                         /* the object inside the stamp */
};

struct photometry_work {
    struct stamp stamp;
    double *line;                          /* weights of columns and rows */
    struct growth *growth;
    size_t cap_v, cap_replaced, cap_line;
};

int photometry_work_new(struct photometry_work **w)
{
    *w = calloc(1, sizeof **w);
    if (!*w)
        return E_NOMEM;
    int st = growth_new(&(*w)->growth);
    if (st) {
        free(*w);
        *w = NULL;
    }
    return st;
}

void photometry_work_free(struct photometry_work *w)
{
    if (!w)
        return;
    free(w->stamp.v);
    free(w->stamp.replaced);
    free(w->line);
    growth_free(w->growth);
    free(w);
}

/* ---- the stamp ---- */

static const float *rms_from(const struct field *f, long x, long y)
{
    return f->p->rms_map ? f->p->rms_map + (size_t)y * (size_t)f->im->nx + (size_t)x : NULL;
}

static int is_good(const struct field *f, long x, long y)
{
    const float *rms = rms_from(f, x, y);
    return fabsf(pixels_at(f->im, x, y)) <= FLT_MAX && (!rms || *rms <= FLT_MAX);
}

static int usable(const struct field *f, long x, long y, int32_t own)
{
    int32_t label = labels_at(f->label, x, y);
    return (label == 0 || label == own) && is_good(f, x, y);
}

WIDE static int finite_run(const float *v, long n)
{
    int bad = 0;
    for (long i = 0; i < n; i++)
        bad |= !(fabsf(v[i]) <= FLT_MAX);
    return !bad;
}

/* bad[i] = 1 where pixel x + i of row y is bad; returns whether one is. */
static int mark_bad(const struct field *f, long x, long y, long n, unsigned char *bad)
{
    int any = 0;
    for (long done = 0; done < n; done += PIECE) {
        float v[PIECE];
        const long many = n - done < PIECE ? n - done : PIECE;
        const float *rms = rms_from(f, x + done, y);
        pixels_row(f->im, y, x + done, many, v);
        if (finite_run(v, many) && (!rms || finite_run(rms, many)))
            continue;
        for (long i = 0; i < many; i++)
            if (!(fabsf(v[i]) <= FLT_MAX) || (rms && !(rms[i] <= FLT_MAX)))
                any = bad[done + i] = 1;
    }
    return any;
}

/* Mark what row y of the stamp has of other objects and of bad pixels; 1 when there is any. */
static int mark_row(const struct field *f, const struct stamp *s, long y, int32_t own)
{
    const struct labels *l = f->label;
    unsigned char *mark = s->replaced + y * s->nx;
    long row = s->y0 + y, end = s->x0 + s->nx;
    int any = 0;
    for (size_t i = labels_from(l, row, s->x0); i < l->row[row + 1] && l->run[i].x0 < end; i++) {
        if (l->run[i].label == own)
            continue;
        long a = l->run[i].x0 > s->x0 ? l->run[i].x0 : s->x0, b = l->run[i].x1 < end ? l->run[i].x1 : end;
        memset(mark + (a - s->x0), 1, (size_t)(b - a));
        any = 1;
    }
    return f->b->bad ? mark_bad(f, s->x0, row, s->nx, mark) | any : any;
}

/* The marked pixels of row y: the pixel mirrored at the object when that is free, else 0. */
static void mirror_row(const struct field *f, struct stamp *s, double cx, double cy, long y, int32_t own)
{
    const unsigned char *mark = s->replaced + y * s->nx;
    float *v = s->v + y * s->nx;
    long my = lround(2 * cy - (double)(s->y0 + y)), inside_y = my - s->y0;
    for (long x = 0; x < s->nx; x++) {
        if (!mark[x])
            continue;
        long mx = lround(2 * cx - (double)(s->x0 + x)), inside_x = mx - s->x0;
        v[x] = 0;
        if (inside_x >= 0 && inside_y >= 0 && inside_x < s->nx && inside_y < s->ny) {
            long m = inside_y * s->nx + inside_x;
            v[x] = s->replaced[m] ? 0 : s->v[m];
        } else if (mx >= 0 && my >= 0 && mx < f->im->nx && my < f->im->ny && usable(f, mx, my, own)) {
            v[x] = pixels_at(f->im, mx, my);
            background_subtract(f->b, my, mx, 1, 0, &v[x]);
        }
    }
}

/* Cut |x - cx| <= hx, |y - cy| <= hy out of the image. */
static int cut_stamp(const struct field *f, double cx, double cy, double hx, double hy, int32_t own,
                     struct photometry_work *w)
{
    struct stamp *s = &w->stamp;
    long nx = f->im->nx, ny = f->im->ny;
    long x0 = cx - hx > 0 ? (long)ceil(cx - hx) : 0, y0 = cy - hy > 0 ? (long)ceil(cy - hy) : 0;
    long x1 = cx + hx < (double)(nx - 1) ? (long)floor(cx + hx) + 1 : nx;
    long y1 = cy + hy < (double)(ny - 1) ? (long)floor(cy + hy) + 1 : ny;
    size_t n = (size_t)(x1 - x0) * (size_t)(y1 - y0);
    int st = grow(&s->v, &w->cap_v, n + LANES, sizeof *s->v);
    if (!st)
        st = grow(&s->replaced, &w->cap_replaced, n, 1);
    if (st)
        return st;
    s->x0 = x0;
    s->y0 = y0;
    s->nx = x1 - x0;
    s->ny = y1 - y0;
    s->cx = cx - (double)x0;
    s->cy = cy - (double)y0;
    s->any_replaced = 0;
    memset(s->replaced, 0, n);
    memset(s->v + n, 0, LANES * sizeof *s->v);
    const struct box box = {x0, y0, s->nx, s->ny};
    pixels_box(f->im, box, s->v);
    background_subtract_box(f->b, box, 0, s->v);
    for (long y = 0; y < s->ny; y++)
        s->any_replaced |= mark_row(f, s, y, own);
    for (long y = 0; y < s->ny && s->any_replaced; y++)
        mirror_row(f, s, cx, cy, y, own);
    return OK;
}

/* ---- ellipses ---- */

struct ellipse {
    double cxx, cyy, cxy;                  /* cxx x^2 + cyy y^2 + cxy x y = r^2 */
    double ext_x, ext_y;                   /* half sides of the box for r = 1 */
    double shear, wide;                    /* cxy / 2 cxx and 1 / cxx: of the rows */
};

static struct ellipse ellipse_of(double xx, double xy, double yy)
{
    double det = xx * yy - xy * xy;
    return (struct ellipse){yy / det, xx / det, -2 * xy / det, sqrt(xx), sqrt(yy), -xy / yy, det / yy};
}

/* Columns of stamp row y inside radius r: [*a, *b). */
static void row_range(const struct stamp *s, const struct ellipse *e, double r, long y, long *a, long *b)
{
    double dy = (double)y - s->cy, half = e->shear * dy, d = half * half - (e->cyy * dy * dy - r * r) * e->wide;
    *a = *b = 0;
    if (!(d >= 0))
        return;
    d = sqrt(d);
    double lo = s->cx - half - d, hi = s->cx - half + d;
    lo = lo > 0 ? lo : 0;
    hi = hi < (double)(s->nx - 1) ? hi : (double)(s->nx - 1);
    if (!(hi >= lo))
        return;
    long first = (long)lo;
    first += (double)first < lo;
    *a = first;
    *b = (long)hi + 1 > first ? (long)hi + 1 : first;
}

/* Adds sums of v and v r over n pixels, r^2 = a dx^2 + b dx + c >= 0 from dx on. */
WIDE static void kron_row(const float *v, long n, double dx, double a, double b, double c, double out[2])
{
    double s[LANES] = {0}, q[LANES] = {0};
    long whole = n - n % LANES;
    for (long i = 0; i < whole; i += LANES)
        for (int j = 0; j < LANES; j++) {
            double f = (double)v[i + j], x = dx + (double)(i + j), r2 = c + x * (b + x * a);
            s[j] += f;
            q[j] += f * sqrt(r2 > 0 ? r2 : 0);
        }
    for (long i = whole; i < n; i++) {
        double f = (double)v[i], x = dx + (double)i, r2 = c + x * (b + x * a);
        s[0] += f;
        q[0] += f * sqrt(r2 > 0 ? r2 : 0);
    }
    for (int j = 0; j < LANES; j++) {
        out[0] += s[j];
        out[1] += q[j];
    }
}

/* Kron's first-moment radius in rms radii, from the ellipse of 6; 0 without flux. */
static double kron_radius(const struct stamp *s, const struct ellipse *e)
{
    double sum[2] = {0};
    for (long y = 0; y < s->ny; y++) {
        long a, b;
        row_range(s, e, KRON_REACH, y, &a, &b);
        double dy = (double)y - s->cy;
        if (b > a)
            kron_row(s->v + y * s->nx + a, b - a, (double)a - s->cx, e->cxx, e->cxy * dy, e->cyy * dy * dy, sum);
    }
    return sum[0] > 0 && sum[1] > 0 ? sum[1] / sum[0] : 0;
}

WIDE static double sum_of(const float *v, long n)
{
    double s[LANES] = {0}, sum = 0;
    long whole = n - n % LANES;
    for (long i = 0; i < whole; i += LANES)
        for (int j = 0; j < LANES; j++)
            s[j] += (double)v[i + j];
    for (long i = whole; i < n; i++)
        sum += (double)v[i];
    for (int j = 0; j < LANES; j++)
        sum += s[j];
    return sum;
}

struct aperture_sum {
    double flux, variance;
    long area, replaced;
};

/* Pixels whose centres are inside radius r; noise variance of the pixels alone. */
static struct aperture_sum ellipse_sum(const struct field *f, const struct stamp *s,
                                       const struct ellipse *e, double r)
{
    struct aperture_sum t = {0};
    for (long y = 0; y < s->ny; y++) {
        long a, b;
        row_range(s, e, r, y, &a, &b);
        t.area += b - a;
        const float *v = s->v + y * s->nx;
        const float *rms = f->p->rms_map
                         ? f->p->rms_map + (size_t)(s->y0 + y) * (size_t)f->im->nx + (size_t)s->x0 : NULL;
        if (b > a)
            t.flux += sum_of(v + a, b - a);
        for (long x = a; x < b && s->any_replaced; x++)
            t.replaced += s->replaced[y * s->nx + x];
        for (long x = a; rms && x < b; x++)
            t.variance += rms[x] <= FLT_MAX ? (double)rms[x] * (double)rms[x] : 0;
    }
    if (!f->p->rms_map)
        t.variance = (double)t.area * f->p->noise * f->p->noise;
    return t;
}

/* Variance of sums of sky over that of independent pixels. */
static double correlation(const struct field *f)
{
    return f->p->noise_cor > 0 ? f->p->noise_cor * f->p->noise_cor : 1;
}

/* variance: the sum over pixels of the sky's. */
static double flux_error(const struct field *f, double variance, double flux)
{
    variance *= correlation(f);
    if (f->p->gain > 0 && flux > 0)
        variance += flux / f->p->gain;
    return sqrt(variance);
}

/* ---- circles ---- */

/* Exact circular aperture of radius r (pixels). */
static struct aperture_sum circle_sum(const struct field *f, const struct stamp *s, double r)
{
    struct aperture_sum t = {0};
    double area = 0;
    for (long y = 0; y < s->ny; y++)
        for (long x = 0; x < s->nx; x++) {
            double w = circle_overlap((double)x - s->cx, (double)y - s->cy, r);
            if (!(w > 0))
                continue;
            area += w;
            t.flux += w * (double)s->v[y * s->nx + x];
            if (f->p->rms_map) {
                float rms = f->p->rms_map[(size_t)(s->y0 + y) * (size_t)f->im->nx + (size_t)(s->x0 + x)];
                t.variance += rms <= FLT_MAX ? w * (double)rms * (double)rms : 0;
            }
        }
    if (!f->p->rms_map)
        t.variance = area * f->p->noise * f->p->noise;
    t.area = (long)area;
    return t;
}

/* ---- the Gaussian core ---- */

/* A Gaussian of variance w2; step2 = exp(-1 / w2). */
struct gauss {
    double w2, step2;
};

static struct gauss gauss_of(double w2)
{
    return (struct gauss){w2, exp(-1 / w2)};
}

/* w[i] = exp(-(i - c)^2 / 2 w2) over its largest value, for 0 <= i < n, by steps from the peak outwards. */
static void gaussian_line(const struct gauss *g, double c, long n, double *w)
{
    double near = nearbyint(c);
    long top = near > 0 ? near < (double)(n - 1) ? (long)near : n - 1 : 0;
    double d = (double)top - c;
    w[top] = 1;
    double up = exp(-(d + 0.5) / g->w2), down = g->step2 / up;
    for (long i = top + 1; i < n; i++, up *= g->step2)
        w[i] = w[i - 1] * up;
    for (long i = top; i-- > 0; down *= g->step2)
        w[i] = w[i + 1] * down;
}

/* Weights of columns (n, a multiple of LANES) and rows, with the distances from the centre. */
struct weights {
    const double *wx, *dx, *wy, *dy;
    long n, rows;
};

typedef double v8 __attribute__((vector_size(64), aligned(8), may_alias));
typedef float f8 __attribute__((vector_size(32), aligned(4), may_alias));

/* Sums of v W, v W r^2, v W dx, v W dy, LANES columns at a time. */
WIDE static void stamp_sums(const float *v, long stride, const struct weights *w, double out[4])
{
    v8 t[4] = {{0}};
    for (long x = 0; x < w->n; x += LANES) {
        v8 s0 = {0}, s1 = {0}, s2 = {0};   /* of the rows: weighted by wy, wy dy, wy dy^2 */
        for (long y = 0; y < w->rows; y++) {
            double w0 = w->wy[y], w1 = w0 * w->dy[y], w2 = w1 * w->dy[y];
            v8 f = __builtin_convertvector(*(const f8 *)(const void *)(v + y * stride + x), v8);
            s0 += w0 * f;
            s1 += w1 * f;
            s2 += w2 * f;
        }
        v8 wx = *(const v8 *)(const void *)(w->wx + x), dx = *(const v8 *)(const void *)(w->dx + x);
        t[0] += wx * s0;
        t[1] += wx * (s2 + dx * dx * s0);
        t[2] += wx * dx * s0;
        t[3] += wx * s1;
    }
    for (int k = 0; k < 4; k++) {
        out[k] = 0;
        for (int j = 0; j < LANES; j++)
            out[k] += t[k][j];
    }
}

/*
 * Sums of I W, I W r^2 and first moments for W proportional to exp(-r^2 / 2 w2), within 4 sqrt(w2); of W^2 into *squares
 * unless that is NULL.  line: room for 5 (sides + LANES).
 */
static void weighted_sums(const struct stamp *s, double cx, double cy, const struct gauss *g, double *line, double out[4],
                          double *squares)
{
    double reach = 4 * sqrt(g->w2);
    long x0 = cx - reach > 0 ? (long)ceil(cx - reach) : 0, y0 = cy - reach > 0 ? (long)ceil(cy - reach) : 0;
    long x1 = cx + reach < (double)(s->nx - 1) ? (long)floor(cx + reach) + 1 : s->nx;
    long y1 = cy + reach < (double)(s->ny - 1) ? (long)floor(cy + reach) + 1 : s->ny;
    memset(out, 0, 4 * sizeof *out);
    if (squares)
        *squares = 0;
    if (x1 <= x0 || y1 <= y0)
        return;
    long n = x1 - x0, wide = (n + LANES - 1) / LANES * LANES, rows = y1 - y0;
    double *wx = line, *dx = line + wide, *wy = line + 2 * wide, *dy = wy + rows, line2 = 0, rows2 = 0;
    gaussian_line(g, cx - (double)x0, n, wx);
    gaussian_line(g, cy - (double)y0, rows, wy);
    for (long i = n; i < wide; i++)        /* the stamp has room for LANES more */
        wx[i] = 0;
    for (long i = 0; i < wide; i++)
        dx[i] = (double)(x0 + i) - cx;
    for (long y = 0; y < rows; y++)
        dy[y] = (double)(y0 + y) - cy;
    struct weights w = {wx, dx, wy, dy, wide, rows};
    stamp_sums(s->v + y0 * s->nx + x0, s->nx, &w, out);
    if (!squares)
        return;
    for (long i = 0; i < n; i++)
        line2 += wx[i] * wx[i];
    for (long y = 0; y < rows; y++)
        rows2 += wy[y] * wy[y];
    *squares = line2 * rows2;
}

struct core {
    double variance;                       /* per axis, pixel^2 */
};

/*
 * The circular Gaussian that fits best by least squares: the width w at which
 * the weighted second moment is w^2/2, by secant steps in ln w^2.  0 when there
 * is none between 0.3 px and the stamp.
 */
static struct core fit_core(const struct stamp *s, double cx, double cy, double start, double *line)
{
    double w2 = start > 0.3 ? start : 0.3, most = 0.25 * (double)(s->nx * s->nx + s->ny * s->ny);
    double u_last = 0, f_last = 0;
    for (int i = 0; i < 50; i++) {
        double t[4];
        struct gauss g = gauss_of(w2);
        weighted_sums(s, cx, cy, &g, line, t, NULL);
        if (!(t[0] > 0 && t[1] > 0))
            break;
        double m = 0.5 * t[1] / t[0];              /* per axis */
        double next = m < 0.9 * w2 ? m * w2 / (w2 - m) : 10 * w2;
        next = next > 0.25 * w2 ? next < 4 * w2 ? next : 4 * w2 : 0.25 * w2;
        if (fabs(next - w2) < 1e-3 * w2)
            return (struct core){next};
        double u = log(w2), f = log(next) - u, step = f;
        double slope = i > 0 ? (f - f_last) / (u - u_last) : -1;
        if (slope < -0.2 && slope > -2)            /* else it is not a settled approach */
            step = -f / slope;
        u_last = u;
        f_last = f;
        w2 = exp(u + step);
        if (!(w2 > 0.09 && w2 < most))
            break;
    }
    return (struct core){0};
}

/*
 * Windowed centroid (Bertin's XWIN): Gaussian of FWHM = twice the half-light
 * radius, at least 2 px, steps of twice the offset until that is less than 2e-4 px.
 * From the second on they are stretched by what the last one left of the offset
 * lets expect (secant): a wide object in a narrow window needs many plain steps.
 */
static void window_centroid(const struct stamp *s, double sigma, double *line, double *cx, double *cy)
{
    double x = s->cx, y = s->cy, last_x = 0, last_y = 0, step_x = 0, step_y = 0;
    struct gauss g = gauss_of(sigma * sigma);
    for (int i = 0; i < 16; i++) {
        double t[4];
        weighted_sums(s, x, y, &g, line, t, NULL);
        if (!(t[0] > 0))
            return;
        double dx = 2 * t[2] / t[0], dy = 2 * t[3] / t[0], step2 = step_x * step_x + step_y * step_y, slope = 1;
        if (step2 > 0)
            slope = ((last_x - dx) * step_x + (last_y - dy) * step_y) / step2;
        slope = slope > 0.2 ? slope < 2 ? slope : 2 : 0.2;
        step_x = dx / slope;
        step_y = dy / slope;
        last_x = dx;
        last_y = dy;
        x += step_x;
        y += step_y;
        if (!(fabs(x - s->cx) < 4 * sigma + 1 && fabs(y - s->cy) < 4 * sigma + 1))
            return;
        if (dx * dx + dy * dy < 4e-8) {
            *cx = x;
            *cy = y;
            return;
        }
    }
}

/* Variance of the PSF with its pixel if both were Gaussian, pixel^2. */
static double point_variance(double psf_fwhm)
{
    double sigma = psf_fwhm / FWHM_SIGMA;
    return sigma * sigma + 1 / 12.0;
}

/*
 * Measured on simulated stars and galaxies of 0.04, 0.10 and 0.16" (obscured
 * 2 m pupil, FWHM 0.123"): ln of the ratio is 0.24, 0.30, 0.30 for stars (0 for
 * a Gaussian PSF, wings add the rest) with a phase scatter of 0.005, 0.034,
 * 0.15; 0.92 +- 0.24 for galaxies.
 */
double star_probability(double log_ratio, double snr, double psf_fwhm)
{
    if (!(psf_fwhm > 0))
        return 0.5;
    if (!(snr > 0))
        return 0;
    double noise2 = 4 / (snr * snr), phase = 0.15 * exp(-(point_variance(psf_fwhm) - 0.19) / 0.1);
    double star2 = 0.09 * 0.09 + phase * phase + noise2, galaxy2 = 0.24 * 0.24 + noise2;
    double star = exp(-0.5 * (log_ratio - 0.22) * (log_ratio - 0.22) / star2) / sqrt(star2);
    double galaxy = exp(-0.5 * (log_ratio - 0.92) * (log_ratio - 0.92) / galaxy2) / sqrt(galaxy2);
    double odds = 1 / (1 + 225 / (snr * snr));
    return odds * star / (odds * star + galaxy + 1e-30);
}

/* ln of the weighted second moment over that of a Gaussian of the PSF's width, and its S/N. */
static double measure_star(const struct field *f, const struct stamp *s, double rms, double *line)
{
    if (!(f->p->psf_fwhm > 0))
        return 0.5;
    double t0 = point_variance(f->p->psf_fwhm), w2 = 2.4 * t0 + 0.5, t[4], squares, cx = s->cx, cy = s->cy;
    struct gauss g = gauss_of(w2);
    window_centroid(s, sqrt(w2), line, &cx, &cy);
    weighted_sums(s, cx, cy, &g, line, t, &squares);
    if (!(t[0] > 0 && t[1] > 0))
        return 0;
    double ratio = 0.5 * t[1] / t[0] * (t0 + w2) / (t0 * w2);
    return star_probability(log(ratio), t[0] / (rms * sqrt(squares)), f->p->psf_fwhm);
}

/* ---- all together ---- */

static void from_blob(const struct field *f, const struct blob *b, struct object *o)
{
    blob_moments(b, &o->x, &o->y, &o->xx, &o->xy, &o->yy);
    ellipse_axes(o->xx, o->xy, o->yy, &o->a, &o->b, &o->theta);
    long x = lround(o->x), y = lround(o->y);
    o->background = mesh_at(&f->b->level, x, y);
    o->rms = mesh_at(&f->b->rms, x, y);
    double rms = f->p->noise;
    if (f->p->rms_map) {
        double there = (double)f->p->rms_map[(size_t)b->ypeak * (size_t)f->im->nx + (size_t)b->xpeak];
        rms = there <= FLT_MAX ? there : o->rms;       /* a bad pixel of the image of the photometry */
        o->rms = rms;
    }
    o->flux_iso = b->flux;
    o->err_iso = flux_error(f, (double)b->n * rms * rms, b->flux);
    o->area = b->n;
    o->area_above = b->above;
    o->peak = b->peak;
    o->threshold = b->threshold;
    o->xpeak = b->xpeak;
    o->ypeak = b->ypeak;
    o->xmin = b->xmin;
    o->xmax = b->xmax;
    o->ymin = b->ymin;
    o->ymax = b->ymax;
    o->flags = b->flags;
    if (b->xmin == 0 || b->ymin == 0 || b->xmax == f->im->nx - 1 || b->ymax == f->im->ny - 1)
        o->flags |= DETECT_EDGE;
    if (b->peak + o->background >= f->p->saturation)
        o->flags |= DETECT_SATURATED;
}

/*
 * Errors of the centroid sum g x / sum g, g the filtered image: sum of
 * (x - centroid)^2 times the variance rms^2 + f/gain of a pixel, over
 * (sum g)^2; the sky's noise is correlated over less than an object.  On one
 * line of pixels a pixel's width is added.
 */
static void position_errors(const struct field *f, const struct blob *b, int32_t own, struct object *o)
{
    const struct labels *l = f->label;
    double photon = f->p->gain > 0 ? 1 / f->p->gain : 0, cor = correlation(f), rms2 = f->p->noise * f->p->noise, s[4] = {0};
    for (long y = b->ymin; y <= b->ymax; y++)
        for (size_t i = labels_from(l, y, b->xmin); i < l->row[y + 1] && l->run[i].x0 <= b->xmax; i++)
            for (long x = l->run[i].x0; x < l->run[i].x1 && l->run[i].label == own; x += PIECE) {
                float v[PIECE];
                long n = l->run[i].x1 - x < PIECE ? l->run[i].x1 - x : PIECE;
                unsigned char bad[PIECE] = {0};
                const float *map = rms_from(f, x, y);
                pixels_row(f->im, y, x, n, v);
                background_subtract(f->b, y, x, n, 0, v);
                if (f->b->bad)
                    mark_bad(f, x, y, n, bad);
                for (long k = 0; k < n; k++) {
                    if (bad[k])
                        continue;
                    double rms = map ? (double)map[k] : 0;
                    double var = cor * (map ? rms * rms : rms2) + (v[k] > 0 ? (double)v[k] * photon : 0);
                    double dx = (double)(x + k) - o->x, dy = (double)y - o->y;
                    s[0] += var * dx * dx;
                    s[1] += var * dx * dy;
                    s[2] += var * dy * dy;
                    s[3] += var / 12;
                }
            }
    double line = s[0] * s[2] - s[1] * s[1] < s[3] * s[3] ? s[3] : 0;
    o->err_xx = (s[0] + line) / (b->s * b->s);
    o->err_xy = s[1] / (b->s * b->s);
    o->err_yy = (s[2] + line) / (b->s * b->s);
}

/* Is a pixel of the object at this place or next to it? */
static int beside_own(const struct field *f, long x, long y, int32_t own)
{
    for (long v = y > 0 ? y - 1 : 0; v <= y + 1 && v < f->im->ny; v++)
        for (long u = x > 0 ? x - 1 : 0; u <= x + 1 && u < f->im->nx; u++)
            if (labels_at(f->label, u, v) == own)
                return 1;
    return 0;
}

/* A bad pixel inside or next to the isophote. */
static int touches_bad(const struct field *f, const struct blob *b, int32_t own)
{
    if (f->b->bad == 0)
        return 0;
    long nx = f->im->nx, ny = f->im->ny;
    long x0 = b->xmin > 0 ? b->xmin - 1 : 0, x1 = b->xmax + 1 < nx ? b->xmax + 1 : nx - 1;
    long y0 = b->ymin > 0 ? b->ymin - 1 : 0, y1 = b->ymax + 1 < ny ? b->ymax + 1 : ny - 1;
    for (long y = y0; y <= y1; y++)
        for (long x = x0, end; x <= x1; x = end) {
            unsigned char bad[PIECE] = {0};
            end = x1 + 1 - x < PIECE ? x1 + 1 : x + PIECE;
            if (!mark_bad(f, x, y, end - x, bad))
                continue;
            for (long i = x; i < end; i++)
                if (bad[i - x] && beside_own(f, i, y, own))
                    return 1;
        }
    return 0;
}

/* 1 when the ellipse's box leaves the image. */
static int leaves_image(const struct field *f, const struct object *o, double hx, double hy)
{
    return o->x - hx < -0.5 || o->y - hy < -0.5 || o->x + hx > (double)f->im->nx - 0.5
        || o->y + hy > (double)f->im->ny - 0.5;
}

static int measure_auto(const struct field *f, int32_t own, struct photometry_work *w, struct object *o)
{
    struct ellipse e = ellipse_of(o->xx, o->xy, o->yy);
    double r = KRON_REACH;
    int st = cut_stamp(f, o->x, o->y, r * e.ext_x, r * e.ext_y, own, w);
    if (st)
        return st;
    double kron = f->p->kron_factor * kron_radius(&w->stamp, &e);
    double most = f->p->kron_factor * KRON_REACH;
    o->kron_radius = kron > f->p->kron_min ? kron < most ? kron : most : f->p->kron_min;
    if (o->kron_radius > r) {
        r = o->kron_radius;
        st = cut_stamp(f, o->x, o->y, r * e.ext_x, r * e.ext_y, own, w);
        if (st)
            return st;
    }
    struct aperture_sum t = ellipse_sum(f, &w->stamp, &e, o->kron_radius);
    o->flux_auto = t.flux;
    o->err_auto = flux_error(f, t.variance, t.flux);
    if (t.replaced * 10 > t.area)
        o->flags |= DETECT_CROWDED;
    if (leaves_image(f, o, o->kron_radius * e.ext_x, o->kron_radius * e.ext_y) || !(t.flux > 0))
        o->flags |= DETECT_APERTURE;
    return OK;
}

/* FLUX_RADIUS, its further fractions into more[], and that of half the flux. */
static int measure_radii(const struct field *f, struct photometry_work *w, struct object *o, double *more, double *half)
{
    const struct stamp *s = &w->stamp;
    o->flux_radius = *half = sqrt(o->a * o->b);
    for (size_t k = 0; k < f->p->nfractions; k++)
        more[k] = o->flux_radius;
    if (!(o->flux_auto > 0))
        return OK;
    int st = growth_open(w->growth, s->v, s->nx, s->ny, s->cx, s->cy, o->kron_radius * o->a);
    if (!st)
        st = growth_radius(w->growth, f->p->flux_fraction * o->flux_auto, &o->flux_radius);
    for (size_t k = 0; k < f->p->nfractions && !st; k++)
        st = growth_radius(w->growth, f->p->fraction[k] * o->flux_auto, &more[k]);
    if (!st && f->p->windowed)
        st = growth_radius(w->growth, 0.5 * o->flux_auto, half);
    return st;
}

static int measure_sizes(const struct field *f, struct photometry_work *w, struct object *o, double *more)
{
    const struct stamp *s = &w->stamp;
    o->fwhm = FWHM_SIGMA * sqrt(0.5 * (o->xx + o->yy));
    o->xwin = o->x;
    o->ywin = o->y;
    o->star_prob = 0.5;
    double half;
    int st = measure_radii(f, w, o, more, &half);
    if (!st)
        st = grow(&w->line, &w->cap_line, 5 * (size_t)(s->nx + s->ny + LANES), sizeof *w->line);
    if (st)
        return st;
    double *line = w->line;
    if (!f->p->plain_sizes) {
        struct core c = fit_core(s, s->cx, s->cy, 0.25 * (o->xx + o->yy), line);
        if (c.variance > 0)
            o->fwhm = FWHM_SIGMA * sqrt(c.variance);
        o->star_prob = measure_star(f, s, f->p->rms_map ? o->rms : f->p->noise, line);
    }
    if (f->p->windowed) {
        double cx = s->cx, cy = s->cy;
        window_centroid(s, 2 * (half > 1 ? half : 1) / FWHM_SIGMA, line, &cx, &cy);
        o->xwin = cx + (double)s->x0;
        o->ywin = cy + (double)s->y0;
    }
    return OK;
}

static int measure_apertures(const struct field *f, int32_t own, struct photometry_work *w,
                             struct object *o, double *aperture)
{
    for (size_t k = 0; k < f->p->napertures; k++) {
        double r = 0.5 * f->p->aperture[k];
        int st = cut_stamp(f, o->x, o->y, r + 1, r + 1, own, w);
        if (st)
            return st;
        struct aperture_sum t = circle_sum(f, &w->stamp, r);
        aperture[2 * k] = t.flux;
        aperture[2 * k + 1] = flux_error(f, t.variance, t.flux);
        if (leaves_image(f, o, r, r))
            o->flags |= DETECT_APERTURE;
    }
    return OK;
}

/* Sums of the unfiltered pixels of the isophote, from this image. */
static struct blob sum_again(const struct field *f, const struct blob *blob, int32_t own)
{
    struct blob b = *blob;
    b.flux = 0;
    b.above = 0;
    b.peak = -INFINITY;
    const struct labels *l = f->label;
    for (long y = b.ymin; y <= b.ymax; y++)
        for (size_t i = labels_from(l, y, b.xmin); i < l->row[y + 1] && l->run[i].x0 <= b.xmax; i++)
            for (int32_t x = l->run[i].x0; x < l->run[i].x1 && l->run[i].label == own; x++) {
                float v = pixels_at(f->im, x, y);
                background_subtract(f->b, y, x, 1, 0, &v);
                b.flux += (double)v;
                b.above += (double)v > b.threshold;
                if ((double)v > b.peak) {
                    b.peak = (double)v;
                    b.xpeak = x;
                    b.ypeak = (int32_t)y;
                }
            }
    return b;
}

/* A value of a float32 column. */
static void limit(double *v, long *flags)
{
    if (fabs(*v) <= FLT_MAX)
        return;
    *v = copysign(FLT_MAX, *v);
    *flags |= DETECT_APERTURE;
}

int photometry_measure(const struct field *f, const struct blob *blob, int32_t index,
                       struct photometry_work *w, struct object *out, double *aperture)
{
    struct object o = {0};
    struct blob here = f->found ? sum_again(f, blob, index + 1) : *blob;
    from_blob(f, &here, &o);
    if (f->p->errors)
        position_errors(f->found ? f->found : f, blob, index + 1, &o);
    int st = measure_auto(f, index + 1, w, &o);
    if (!st)
        st = measure_sizes(f, w, &o, aperture ? aperture + 2 * f->p->napertures : NULL);
    if (!st)
        st = measure_apertures(f, index + 1, w, &o, aperture);
    if (st)
        return st;
    if (touches_bad(f, blob, index + 1))
        o.flags |= DETECT_ISOPHOTE;
    limit(&o.flux_iso, &o.flags);
    limit(&o.err_iso, &o.flags);
    limit(&o.flux_auto, &o.flags);
    limit(&o.err_auto, &o.flags);
    for (size_t k = 0; k < 2 * f->p->napertures; k++)
        limit(&aperture[k], &o.flags);
    *out = o;
    return OK;
}
