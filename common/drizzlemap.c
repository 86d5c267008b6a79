/*
 * drizzlemap.c - from input to output pixels: an affine map, or a grid of nodes.
 */
#include "drizzle.h"
#include <math.h>
#include <stdlib.h>

#define GRID_START 64
#define AFFINE_ERROR 3e-7     /* px */
#define PARALLEL 5e-7         /* px over the image */

static void affine_at(const struct drizzle_map *m, double x, double y, double *X, double *Y)
{
    *X = m->x0 + m->xx * x + m->xy * y;
    *Y = m->y0 + m->yx * x + m->yy * y;
}

static double between(double a, double b, double t)
{
    return a + t * (b - a);
}

void drizzle_map_line(const struct drizzle_map *m, double y, double *X, double *Y)
{
    const double gy = (y + 1) / (double)m->step;
    long j = (long)gy;
    j = j < 0 ? 0 : j > m->gy - 2 ? m->gy - 2 : j;
    const double v = gy - (double)j;
    const size_t k = (size_t)j * (size_t)m->gx, l = k + (size_t)m->gx;
    for (long i = 0; i < m->gx; i++) {
        X[i] = between(m->node_x[k + (size_t)i], m->node_x[l + (size_t)i], v);
        Y[i] = between(m->node_y[k + (size_t)i], m->node_y[l + (size_t)i], v);
    }
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
    *X = between(between(px[k], px[l], v), between(px[k + 1], px[l + 1], v), u);
    *Y = between(between(py[k], py[l], v), between(py[k + 1], py[l + 1], v), u);
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
