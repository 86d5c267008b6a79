/*
 * overlap.c - polygon and pixel.
 */
#include "overlap.h"
#include "simd.h"
#include <math.h>

double overlap_area(const double x[4], const double y[4])
{
    return 0.5 * ((x[2] - x[0]) * (y[3] - y[1]) - (x[3] - x[1]) * (y[2] - y[0]));
}

/*
 * A piece of an edge inside one row, from xa to xb (cells counted from 0 at the
 * left of the window of n), rising by -h: to its right lies area h times width.
 */
static void add_piece(double xa, double xb, double h, long n, double *sum)
{
    if (xa > xb) {
        double t = xa;
        xa = xb;
        xb = t;
    }
    const double right = (double)n;
    if (xa >= right)
        return;
    if (xb <= 0) {
        sum[0] += h;
        return;
    }
    const double slope = xb > xa ? h / (xb - xa) : 0;
    if (xa < 0) {                          /* what is left of the window covers all of it */
        sum[0] += slope * -xa;
        h -= slope * -xa;
        xa = 0;
    }
    if (xb > right) {
        h -= slope * (xb - right);
        xb = right;
    }
    long ia = (long)xa, ib = (long)xb;
    if (ia == ib) {
        double m = 0.5 * (xa + xb) - (double)ia;
        sum[ia] += h * (1 - m);
        sum[ia + 1] += h * m;
        return;
    }
    double step = (double)(ia + 1) - xa, part = slope * step;
    sum[ia] += 0.5 * part * step;
    sum[ia + 1] += part * (1 - 0.5 * step);
    for (long i = ia + 1; i < ib; i++) {
        sum[i] += 0.5 * slope;
        sum[i + 1] += 0.5 * slope;
    }
    step = xb - (double)ib;
    part = slope * step;
    sum[ib] += part * (1 - 0.5 * step);
    sum[ib + 1] += 0.5 * part * step;
}

static double clamp(double v, double lo, double hi)
{
    return v < lo ? lo : v > hi ? hi : v;
}

void overlap_row(const double x[4], const double y[4], long row, long first, long n, double *area)
{
    const double bottom = (double)row, top = bottom + 1, left = (double)first;
    for (long i = 0; i < n + 2; i++)
        area[i] = 0;
    for (int k = 0; k < 4; k++) {
        const int l = (k + 1) & 3;
        const double ya = clamp(y[k], bottom, top), yb = clamp(y[l], bottom, top);
        if (!(ya < yb || yb < ya))
            continue;
        const double slope = (x[l] - x[k]) / (y[l] - y[k]);
        const double xa = ya < y[k] || ya > y[k] ? x[k] + (ya - y[k]) * slope : x[k];
        const double xb = yb < y[l] || yb > y[l] ? x[k] + (yb - y[k]) * slope : x[l];
        add_piece(xa - left, xb - left, ya - yb, n, area);
    }
    double sum = 0;
    for (long i = 0; i < n; i++) {
        sum += area[i];
        area[i] = sum;
    }
}

WIDE static void make_edges(struct overlap_edges *restrict e, const double (*restrict x)[OVERLAP_LANES],
                            const double (*restrict y)[OVERLAP_LANES], const double *restrict factor)
{
    for (int k = 0; k < 4; k++) {
        const int n = (k + 1) & 3;
        for (int i = 0; i < OVERLAP_LANES; i++) {
            const int up = y[n][i] > y[k][i];
            const double ax = up ? x[k][i] : x[n][i], ay = up ? y[k][i] : y[n][i];
            const double bx = up ? x[n][i] : x[k][i], by = up ? y[n][i] : y[k][i];
            const double dx = bx - ax, dy = by - ay, rise = dy > 0 ? (up ? factor[i] : -factor[i]) : 0;
            e->ax[k][i] = ax;
            e->ay[k][i] = ay;
            e->bx[k][i] = bx;
            e->by[k][i] = by;
            e->x_per_y[k][i] = dy > 0 ? dx / dy : 0;
            e->rise[k][i] = rise;
            e->step[k][i] = fabs(dx) > 0 ? 0.5 * rise * fabs(dy / dx) : 0;
        }
    }
}

void overlap_edges_make(struct overlap_edges *e, const double x[4][OVERLAP_LANES], const double y[4][OVERLAP_LANES],
                        const double factor[OVERLAP_LANES])
{
    make_edges(e, x, y, factor);
}

static inline double least_of(double a, double b)
{
    return a < b ? a : b;
}

static inline double most_of(double a, double b)
{
    return a > b ? a : b;
}

/*
 * One row of cells: adds to right[t] what the border from (x0, y0) to (x1, y1)
 * has to the right of t = 0..nx-1.  With x running evenly from lo to hi the
 * mean of max(x - t, 0) is max(lo - t, 0) + min(max(hi - t, 0), w)^2 / 2w.
 */
static inline __attribute__((always_inline))
void add_edge(int nx, double x0, double x1, double h, double step, double *right)
{
    const double lo = least_of(x0, x1), hi = most_of(x0, x1), w = hi - lo;
    right[0] += h * (0.5 * (lo + hi));
    for (int t = 1; t < nx; t++) {
        const double u = least_of(most_of(hi - t, 0), w);
        right[t * OVERLAP_LANES] += h * most_of(lo - t, 0) + step * (u * u);
    }
}

/* x0, y0: where each lane's edge k enters row r; moved to where it leaves. */
static inline __attribute__((always_inline))
void add_row(const struct overlap_edges *e, int k, int nx, double top,
             double *restrict x0, double *restrict y0, double *restrict right)
{
    for (int i = 0; i < OVERLAP_LANES; i++) {
        const double ay = e->ay[k][i], by = e->by[k][i], y1 = least_of(most_of(top, ay), by);
        const double x1 = y1 < by ? e->ax[k][i] + (y1 - ay) * e->x_per_y[k][i] : e->bx[k][i];
        add_edge(nx, x0[i], x1, e->rise[k][i] * (y1 - y0[i]), e->step[k][i], right + i);
        x0[i] = x1;
        y0[i] = y1;
    }
}

static inline __attribute__((always_inline))
void cover(const struct overlap_edges *e, int nx, int ny, double least, double *restrict area)
{
    for (int i = 0; i < nx * ny * OVERLAP_LANES; i++)
        area[i] = 0;
    for (int k = 0; k < 4; k++) {
        double x0[OVERLAP_LANES], y0[OVERLAP_LANES];
        for (int i = 0; i < OVERLAP_LANES; i++) {
            x0[i] = e->ax[k][i];
            y0[i] = e->ay[k][i];
        }
        for (int r = 0; r < ny; r++)
            add_row(e, k, nx, r + 1, x0, y0, area + r * nx * OVERLAP_LANES);
    }
    for (int c = 0; c < nx * ny; c++) {
        double *cell = area + c * OVERLAP_LANES;
        const double next = (c + 1) % nx ? 1 : 0;
        const double *right = next > 0 ? cell + OVERLAP_LANES : cell;
        for (int i = 0; i < OVERLAP_LANES; i++) {
            const double a = cell[i] - next * right[i];
            cell[i] = a > least ? a : 0;
        }
    }
}

WIDE static void cover_any(const struct overlap_edges *e, int nx, int ny, double least, double *area)
{
    switch (nx) {
    case 2: cover(e, 2, ny, least, area); break;
    case 3: cover(e, 3, ny, least, area); break;
    case 4: cover(e, 4, ny, least, area); break;
    case 5: cover(e, 5, ny, least, area); break;
    default: cover(e, nx, ny, least, area); break;
    }
}

void overlap_lanes(const struct overlap_edges *e, int nx, int ny, double least, double *area)
{
    cover_any(e, nx, ny, least, area);
}
