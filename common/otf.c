/*
 * otf.c - transfer functions: bicubic spline of a table, exact transform of PSF
 * samples, factors of charge diffusion and pixel.
 *
 * The spline has cubic B-splines on every node and none outside the table:
 * along each axis (c[i-1] + 4 c[i] + c[i+1]) / 6 = T[i] with c = 0 beyond the
 * ends, a diagonally dominant tridiagonal system.
 */
#include "otf.h"
#include "fft.h"
#include "simd.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N_MAX = 16385 };    /* table side: 2 GiB per plane */

void otf_free(struct otf *t)
{
    free(t->re);
    free(t->im);
    free(t->sre);
    free(t->sim);
    free(t->p);
    *t = (struct otf){0};
}

void otf_keep_spline(struct otf *t)
{
    if (!t->sre)
        return;
    free(t->re);
    free(t->im);
    t->re = t->im = NULL;
}

int otf_is_real(const struct otf *t)
{
    return t->n > 0 && !t->im && !t->sim;
}

/* Solve for spline coefficients along columns, all columns at once: c[i*step + k], k < step. */
WIDE static void solve_columns(int n, const double *ratio, double *c, size_t step)
{
    for (int i = 0; i < n; i++) {
        double *row = c + (size_t)i * step, r = ratio[i];
        const double *up = i ? row - step : NULL;
        if (!up)
            for (size_t k = 0; k < step; k++)
                row[k] *= 6 * r;
        else
            for (size_t k = 0; k < step; k++)
                row[k] = (6 * row[k] - up[k]) * r;
    }
    for (int i = n - 2; i >= 0; i--) {
        double *row = c + (size_t)i * step, *down = row + step;
        double r = ratio[i];
        for (size_t k = 0; k < step; k++)
            row[k] -= r * down[k];
    }
}

/* The same along one row. */
static void solve_row(int n, const double *ratio, double *c)
{
    c[0] *= 6 * ratio[0];
    for (int i = 1; i < n; i++)
        c[i] = (6 * c[i] - c[i - 1]) * ratio[i];
    for (int i = n - 2; i >= 0; i--)
        c[i] -= ratio[i] * c[i + 1];
}

/* Spline coefficients of n x n samples, allocated; NULL without memory. */
static double *coefficients(int n, const double *ratio, const double *v)
{
    size_t bytes = (size_t)n * (size_t)n * sizeof *v;
    double *c = malloc(bytes);
    if (!c)
        return NULL;
    memcpy(c, v, bytes);
    for (int i = 0; i < n; i++)
        solve_row(n, ratio, c + (size_t)i * (size_t)n);
    solve_columns(n, ratio, c, (size_t)n);
    return c;
}

static int all_finite(size_t n, const double *v)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        sum += v[i] * 0;
    return sum == 0;
}

int otf_nodes(struct otf *t, int n, double du, double ucut, double *re, double *im)
{
    if (n < 1 || n > N_MAX || n % 2 == 0 || !(du > 0) || !isfinite(du) || !(ucut > 0) ||
        !isfinite(ucut))
        return E_RANGE;
    size_t count = (size_t)n * (size_t)n;
    if (!all_finite(count, re) || (im && !all_finite(count, im)))
        return E_RANGE;
    *t = (struct otf){.n = n, .du = du, .ucut = ucut, .re = re, .im = im};
    return OK;
}

int otf_spline(struct otf *t)
{
    int n = t->n;
    if (n < 1 || t->sre)
        return n < 1 ? E_RANGE : OK;
    double *ratio = malloc((size_t)n * sizeof *ratio), *sre = NULL, *sim = NULL;
    if (ratio) {
        ratio[0] = 0.25;
        for (int i = 1; i < n; i++)
            ratio[i] = 1 / (4 - ratio[i - 1]);
        sre = coefficients(n, ratio, t->re);
        sim = t->im ? coefficients(n, ratio, t->im) : NULL;
    }
    free(ratio);
    if (!sre || (t->im && !sim)) {
        free(sre);
        free(sim);
        return E_NOMEM;
    }
    t->sre = sre;
    t->sim = sim;
    return OK;
}

int otf_tabulate(struct otf *t, int n, double du, double ucut, const double *re, const double *im)
{
    if (n < 1 || n > N_MAX)
        return E_RANGE;
    size_t bytes = (size_t)n * (size_t)n * sizeof *re;
    double *a = malloc(bytes), *b = im ? malloc(bytes) : NULL;
    struct otf made = {0};
    int status = a && (b || !im) ? OK : E_NOMEM;
    if (status == OK) {
        memcpy(a, re, bytes);
        if (b)
            memcpy(b, im, bytes);
        status = otf_nodes(&made, n, du, ucut, a, b);
    }
    if (status) {
        free(a);
        free(b);
        return status;
    }
    status = otf_spline(&made);
    if (status)
        otf_free(&made);
    else
        *t = made;
    return status;
}

int otf_sample(struct otf *t, int nx_p, int ny_p, const double *p, double scale, double cx, double cy,
               double ucut)
{
    if (nx_p < 1 || ny_p < 1 || nx_p > N_MAX || ny_p > N_MAX || !(scale > 0) || !isfinite(scale) ||
        !isfinite(cx) || !isfinite(cy) || !(ucut > 0) || !isfinite(ucut))
        return E_RANGE;
    size_t count = (size_t)nx_p * (size_t)ny_p;
    if (!all_finite(count, p))
        return E_RANGE;
    struct otf made = {.nx_p = nx_p, .ny_p = ny_p, .scale = scale, .cx = cx, .cy = cy, .ucut = ucut};
    made.p = malloc(count * sizeof *p);
    if (!made.p)
        return E_NOMEM;
    memcpy(made.p, p, count * sizeof *p);
    *t = made;
    return OK;
}

/* First of the four nodes round u (may lie outside the table) and their weights. */
struct knot {
    int first;
    double w[4];
};

static struct knot knot_at(const struct otf *t, double u)
{
    struct knot k = {.first = -8};
    if (!(fabs(u) <= t->ucut * (1 + 1e-12)))
        return k;
    double x = u / t->du + (t->n - 1) / 2;
    if (!(x > -2 && x < t->n + 1))
        return k;
    double f = x - floor(x), g = 1 - f;
    k.first = (int)floor(x) - 1;
    k.w[0] = g * g * g / 6;
    k.w[1] = (4 - 3 * f * f * (1 + g)) / 6;
    k.w[2] = (4 - 3 * g * g * (1 + f)) / 6;
    k.w[3] = f * f * f / 6;
    return k;
}

/* line[i] = sum of four rows of c, first..first+3, columns lo..hi-1; rows outside the table are 0. */
WIDE static void mix_rows(int n, const double *c, const struct knot *k, int lo, int hi, double *line)
{
    memset(line + lo, 0, (size_t)(hi - lo) * sizeof *line);
    for (int r = 0; r < 4; r++) {
        int row = k->first + r;
        if (row < 0 || row >= n)
            continue;
        const double *from = c + (size_t)row * (size_t)n;
        double w = k->w[r];
        for (int i = lo; i < hi; i++)
            line[i] += w * from[i];
    }
}

/* Knots of a row of frequencies, and the nodes that they touch. */
struct otf_columns {
    int n;
    int lo, hi;
    struct knot knot[];
};

int otf_columns_new(struct otf_columns **made, const struct otf *t, int nx, const double *ux)
{
    if (t->n < 1 || !t->sre || nx < 1)
        return E_RANGE;
    struct otf_columns *c = malloc(sizeof *c + (size_t)nx * sizeof *c->knot);
    if (!c)
        return E_NOMEM;
    c->n = nx;
    c->lo = t->n;
    c->hi = 0;
    for (int i = 0; i < nx; i++) {
        const struct knot k = c->knot[i] = knot_at(t, ux[i]);
        if (k.first == -8)
            continue;
        c->lo = k.first < c->lo ? k.first : c->lo;
        c->hi = k.first + 4 > c->hi ? k.first + 4 : c->hi;
    }
    c->lo = c->lo < 0 ? 0 : c->lo;
    c->hi = c->hi > t->n ? t->n : c->hi;
    *made = c;
    return OK;
}

void otf_columns_free(struct otf_columns *c)
{
    free(c);
}

/* Spline values of one row of one plane, columns 0..m-1. */
static void plane_row(int n, const double *plane, const struct otf_columns *c, int m, const struct knot *ky, double *line,
                      double *row)
{
    if (ky->first == -8 || c->lo >= c->hi) {
        memset(row, 0, (size_t)m * sizeof *row);
        return;
    }
    mix_rows(n, plane, ky, c->lo, c->hi, line + 4);
    for (int i = 0; i < m; i++) {
        const struct knot *k = &c->knot[i];
        const double *at = line + 4 + k->first, *w = k->w;
        row[i] = k->first == -8 ? 0 : w[0] * at[0] + w[1] * at[1] + w[2] * at[2] + w[3] * at[3];
    }
}

void otf_row(const struct otf *t, const struct otf_columns *c, int m, double uy, double *line, double *re, double *im)
{
    const struct knot k = knot_at(t, uy);
    m = m < c->n ? m : c->n;
    plane_row(t->n, t->sre, c, m, &k, line, re);
    if (t->sim)
        plane_row(t->n, t->sim, c, m, &k, line, im);
    else if (im)
        memset(im, 0, (size_t)m * sizeof *im);
}

static int table_grid(const struct otf *t, int nx, const double *ux, int ny, const double *uy, double *re,
                      double *im)
{
    struct otf_columns *c = NULL;
    double *line = calloc((size_t)t->n + 8, sizeof *line);
    int st = line ? otf_columns_new(&c, t, nx, ux) : E_NOMEM;
    for (int j = 0; st == OK && j < ny; j++) {
        const size_t at = (size_t)j * (size_t)nx;
        otf_row(t, c, nx, uy[j], line, re + at, im ? im + at : NULL);
    }
    otf_columns_free(c);
    free(line);
    return st;
}

int otf_grid(const struct otf *t, int nx, const double *ux, int ny, const double *uy, double *re, double *im)
{
    if (nx < 1 || ny < 1 || (!im && !otf_is_real(t)))
        return E_RANGE;
    if (t->p)
        return otf_from_samples(t->nx_p, t->ny_p, t->p, t->scale, t->cx, t->cy, t->ucut, nx, ux, ny, uy,
                                re, im);
    if (!t->sre)
        return E_RANGE;
    return table_grid(t, nx, ux, ny, uy, re, im);
}

/* exp(-2 pi i u x) for n values u. */
static void phases(int n, const double *u, double x, double *re, double *im)
{
    for (int i = 0; i < n; i++) {
        double turn = remainder(u[i] * x, 1);
        re[i] = cos(2 * M_PI * turn);
        im[i] = -sin(2 * M_PI * turn);
    }
}

/* sre += p * re, sim += p * im */
WIDE static void add_real(int n, double p, const double *re, const double *im, double *sre, double *sim)
{
    for (int i = 0; i < n; i++) {
        sre[i] += p * re[i];
        sim[i] += p * im[i];
    }
}

/* (sre, sim) += (a + ib)(re + i im) */
WIDE static void add_complex(int n, double a, double b, const double *re, const double *im, double *sre,
                             double *sim)
{
    for (int i = 0; i < n; i++) {
        sre[i] += a * re[i] - b * im[i];
        sim[i] += a * im[i] + b * re[i];
    }
}

static int by_products(int nx_p, int ny_p, const double *p, double scale, double cx, double cy, int nx,
                       const double *ux, int ny, const double *uy, double *re, double *im)
{
    size_t m = (size_t)nx;
    double *ex = malloc(2 * m * (size_t)nx_p * sizeof *ex);
    double *f = calloc(2 * m * (size_t)ny_p, sizeof *f);
    double *ey = malloc(2 * (size_t)ny * sizeof *ey);
    int status = ex && f && ey ? OK : E_NOMEM;
    if (status == OK) {
        for (int x = 0; x < nx_p; x++)
            phases(nx, ux, (x - cx) * scale, ex + 2 * m * (size_t)x, ex + 2 * m * (size_t)x + m);
        memset(re, 0, m * (size_t)ny * sizeof *re);
        memset(im, 0, m * (size_t)ny * sizeof *im);
        for (int y = 0; y < ny_p; y++) {
            double *row = f + 2 * m * (size_t)y;
            for (int x = 0; x < nx_p; x++) {
                const double *e = ex + 2 * m * (size_t)x;
                add_real(nx, p[(size_t)y * (size_t)nx_p + (size_t)x], e, e + m, row, row + m);
            }
            phases(ny, uy, (y - cy) * scale, ey, ey + ny);
            for (int j = 0; j < ny; j++)
                add_complex(nx, ey[j], ey[ny + j], row, row + m, re + (size_t)j * m, im + (size_t)j * m);
        }
    }
    free(ex);
    free(f);
    free(ey);
    return status;
}

/* 1 when u rises in equal steps, to rounding. */
static int regular(int n, const double *u, double *step)
{
    if (n < 2)
        return 0;
    *step = (u[n - 1] - u[0]) / (n - 1);
    double slack = 8 * 2.3e-16 * fmax(fabs(u[0]), fabs(u[n - 1]));
    for (int i = 0; i < n; i++)
        if (!(fabs(u[i] - (u[0] + i * *step)) <= slack))
            return 0;
    return *step > 0;
}

static int by_zoom(int nx_p, int ny_p, const double *p, double scale, double cx, double cy, int nx, double ux0,
                   double dux, int ny, double uy0, double duy, double *re, double *im)
{
    size_t count = (size_t)nx * (size_t)ny, count_p = (size_t)nx_p * (size_t)ny_p;
    double *in = malloc(2 * count_p * sizeof *in), *out = malloc(2 * count * sizeof *out);
    int status = in && out ? OK : E_NOMEM;
    if (status == OK) {
        for (size_t i = 0; i < count_p; i++) {
            in[2 * i] = p[i];
            in[2 * i + 1] = 0;
        }
        struct fft_grid from = {nx_p, ny_p, -cx, -cy}, to = {nx, ny, ux0 / dux, uy0 / duy};
        status = fft_zoom(&from, in, &to, out, dux * scale, duy * scale, -1);
    }
    for (size_t i = 0; status == OK && i < count; i++) {
        re[i] = out[2 * i];
        im[i] = out[2 * i + 1];
    }
    free(in);
    free(out);
    return status;
}

int otf_from_samples(int nx_p, int ny_p, const double *p, double scale, double cx, double cy, double ucut,
                     int nx, const double *ux, int ny, const double *uy, double *re, double *im)
{
    if (nx_p < 1 || ny_p < 1 || nx < 1 || ny < 1 || !(scale > 0) || !(ucut > 0))
        return E_RANGE;
    double dux, duy;
    int status;
    /* below some 10^7 multiplications the products cost less than the set-up of transforms */
    double work = (double)nx_p * ny_p * nx + 2.0 * ny_p * nx * ny;
    if (work > 1e7 && regular(nx, ux, &dux) && regular(ny, uy, &duy))
        status = by_zoom(nx_p, ny_p, p, scale, cx, cy, nx, ux[0], dux, ny, uy[0], duy, re, im);
    else
        status = by_products(nx_p, ny_p, p, scale, cx, cy, nx, ux, ny, uy, re, im);
    if (status)
        return status;
    double limit = ucut * (1 + 1e-12);
    for (int j = 0; j < ny; j++)
        for (int i = 0; i < nx; i++)
            if (!(fabs(ux[i]) <= limit && fabs(uy[j]) <= limit))
                re[(size_t)j * (size_t)nx + (size_t)i] = im[(size_t)j * (size_t)nx + (size_t)i] = 0;
    return OK;
}

void otf_diffusion(int n, const double *u, double sigma, double *f)
{
    if (sigma == 0)
        return;
    double k = -2 * M_PI * M_PI * sigma * sigma;
    for (int i = 0; i < n; i++)
        f[i] *= exp(k * u[i] * u[i]);
}

void otf_box(int n, const double *u, double width, double *f)
{
    for (int i = 0; i < n; i++) {
        double t = M_PI * u[i] * width;
        if (fabs(t) < 1e-4)
            f[i] *= 1 - t * t / 6;
        else
            f[i] *= sin(t) / t;
    }
}

void otf_neighbours(int n, const double *u, double pitch, double *c)
{
    for (int i = 0; i < n; i++)
        c[i] = 2 * cos(2 * M_PI * u[i] * pitch);
}
