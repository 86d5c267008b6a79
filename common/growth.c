/*
 * growth.c - radii of circles that hold given fluxes; see growth.h.
 *
 * One pass sums the pixels by rings of width 1 of their centres' distance.  The
 * ring in which the sum passes the flux gives a guess; only pixels of the rings
 * near it are cut exactly, in false-position steps.
 */
#include "growth.h"
#include "grow.h"
#include "simd.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { NEAR = 2 };             /* rings on both sides of the guess */

struct cut {                   /* a pixel near the circle */
    double v, dx, dy;
};

struct growth {
    const float *v;
    long nx, rings, x0, x1, y0, y1;    /* pixels that are looked at */
    double cx, cy, reach;
    int32_t *ring;             /* of every pixel looked at */
    double *sum;               /* by ring */
    struct cut *cut;
    size_t cap_ring, cap_sum, cap_cut;
    long ncut;
};

int growth_new(struct growth **g)
{
    *g = calloc(1, sizeof **g);
    return *g ? OK : E_NOMEM;
}

void growth_free(struct growth *g)
{
    if (!g)
        return;
    free(g->ring);
    free(g->sum);
    free(g->cut);
    free(g);
}

/* ---- overlaps ---- */

/* Area inside the circle of [x0, x1] x [y0, y1], 0 <= x0 < x1, 0 <= y0 < y1, corner (x0, y0) inside. */
static double arc_area(double x0, double y0, double x1, double y1, double r)
{
    double r2 = r * r;
    if (x1 * x1 + y1 * y1 <= r2)
        return (x1 - x0) * (y1 - y0);
    double a = r2 > y1 * y1 ? sqrt(r2 - y1 * y1) : 0;      /* the arc crosses the top at a and the bottom at b */
    double b = sqrt(r2 - y0 * y0);
    a = a > x0 ? a : x0;
    b = b < x1 ? b : x1;
    if (!(b > a))
        return ((a < x1 ? a : x1) - x0) * (y1 - y0);
    double ha = sqrt(r2 - a * a), hb = sqrt(r2 - b * b > 0 ? r2 - b * b : 0);
    double sine = (b * ha - a * hb) / r2;                  /* of the angle of the arc */
    double angle = sine < 0.9 ? asin(sine) : atan2(sine, (a * b + ha * hb) / r2);
    return (a - x0) * (y1 - y0) + 0.5 * (b * hb - a * ha + r2 * angle) - y0 * (b - a);
}

double circle_overlap(double dx, double dy, double r)
{
    if (!(r > 0))
        return 0;
    dx = fabs(dx);
    dy = fabs(dy);
    double far_x = dx + 0.5, far_y = dy + 0.5, x = dx - 0.5, y = dy - 0.5;
    if (far_x * far_x + far_y * far_y <= r * r)
        return 1;
    double near_x = x > 0 ? x : 0, near_y = y > 0 ? y : 0;
    if (near_x * near_x + near_y * near_y >= r * r)
        return 0;
    /* a pixel across an axis is cut there, its parts turned into the first quadrant */
    double sum = arc_area(near_x, near_y, far_x, far_y, r);
    if (x < 0)
        sum += arc_area(0, near_y, -x, far_y, r);
    if (y < 0)
        sum += arc_area(near_x, 0, far_x, -y, r);
    if (x < 0 && y < 0)
        sum += arc_area(0, 0, -x, -y, r);
    return sum;
}

/* ---- rings ---- */

/* floor of the distance of n pixels from the centre, first one at dx. */
WIDE static void rings_of(float dx, float dy, long n, int32_t *restrict ring)
{
    for (int i = 0; i < (int)n; i++) {
        float d = dx + (float)i;
        ring[i] = (int32_t)sqrtf(d * d + dy * dy);
    }
}

int growth_open(struct growth *g, const float *v, long nx, long ny, double cx, double cy, double reach)
{
    long rings = (long)reach + 1;
    double far = (double)rings;
    g->x0 = cx > far ? (long)(cx - far) : 0;
    g->y0 = cy > far ? (long)(cy - far) : 0;
    g->x1 = cx + far + 1 < (double)nx ? (long)(cx + far) + 1 : nx;
    g->y1 = cy + far + 1 < (double)ny ? (long)(cy + far) + 1 : ny;
    long w = g->x1 - g->x0, h = g->y1 - g->y0;
    int st = grow(&g->ring, &g->cap_ring, (size_t)(w > 0 && h > 0 ? w * h : 1), sizeof *g->ring);
    if (!st)                               /* the farthest pixel has a ring below 2 rings + 4 */
        st = grow(&g->sum, &g->cap_sum, (size_t)(2 * rings + 4), sizeof *g->sum);
    if (st)
        return st;
    g->v = v;
    g->nx = nx;
    g->cx = cx;
    g->cy = cy;
    g->reach = reach;
    g->rings = rings;
    memset(g->sum, 0, (size_t)(2 * rings + 4) * sizeof *g->sum);
    for (long y = g->y0; y < g->y1; y++) {
        int32_t *ring = g->ring + (y - g->y0) * w;
        const float *row = v + y * nx + g->x0;
        rings_of((float)((double)g->x0 - cx), (float)((double)y - cy), w, ring);
        for (long i = 0; i < w; i++)
            g->sum[ring[i]] += (double)row[i];
    }
    return OK;
}

/* Collect the pixels of the rings k - NEAR .. k + NEAR; returns the flux of those inside. */
static int collect(struct growth *g, long k, double *inside)
{
    long w = g->x1 - g->x0, first = k > NEAR ? k - NEAR : 0, last = k + NEAR;
    double far = (double)last + 2;
    long a = g->cx - far > (double)g->x0 ? (long)(g->cx - far) : g->x0;
    long b = g->cx + far < (double)g->x1 ? (long)(g->cx + far) : g->x1;
    long c = g->cy - far > (double)g->y0 ? (long)(g->cy - far) : g->y0;
    long d = g->cy + far < (double)g->y1 ? (long)(g->cy + far) : g->y1;
    *inside = 0;
    for (long j = 0; j < first; j++)
        *inside += g->sum[j];
    g->ncut = 0;
    if (b <= a || d <= c)
        return OK;
    int st = grow(&g->cut, &g->cap_cut, (size_t)((b - a) * (d - c)), sizeof *g->cut);
    if (st)
        return st;
    for (long y = c; y < d; y++) {
        const int32_t *ring = g->ring + (y - g->y0) * w - g->x0;
        const float *row = g->v + y * g->nx;
        for (long x = a; x < b; x++) {
            g->cut[g->ncut] = (struct cut){(double)row[x], (double)x - g->cx, (double)y - g->cy};
            g->ncut += ring[x] >= first && ring[x] <= last;
        }
    }
    return OK;
}

/* Flux inside radius r, from the pixels collected. */
static double flux_within(const struct growth *g, double inside, double r)
{
    double sum = inside;
    for (long i = 0; i < g->ncut; i++)
        sum += g->cut[i].v * circle_overlap(g->cut[i].dx, g->cut[i].dy, r);
    return sum;
}

/* Root of flux_within = flux by false position in r^2 (Illinois rule), between lo and hi; slope: flux per r^2. */
static double solve(const struct growth *g, double inside, double flux, double lo, double hi, double guess,
                    double slope)
{
    double f_lo = 0, f_hi = 0, r = guess;
    int known_lo = 0, known_hi = 0, last = 0;
    for (int i = 0; i < 40; i++) {
        double here = flux_within(g, inside, r) - flux;
        if (fabs(here) < 5e-4 * flux || !(hi - lo > 2e-4 * hi))
            return r;
        if (here >= 0) {
            hi = r;
            f_hi = here;
            f_lo *= last == 1 ? 0.5 : 1;
            known_hi = 1;
            last = 1;
        } else {
            lo = r;
            f_lo = here;
            f_hi *= last == -1 ? 0.5 : 1;
            known_lo = 1;
            last = -1;
        }
        double next = known_lo && known_hi ? lo * lo - f_lo / (f_hi - f_lo) * (hi * hi - lo * lo) : r * r - here / slope;
        next = next > 0 ? sqrt(next) : 0;
        r = next > lo && next < hi ? next : 0.5 * (lo + hi);
    }
    return r;
}

int growth_radius(struct growth *g, double flux, double *radius)
{
    double sum = 0;
    long k = 0;
    for (; k < g->rings && sum + g->sum[k] < flux; k++)
        sum += g->sum[k];
    *radius = g->reach;
    double inside;
    int st = collect(g, k, &inside);
    if (st)
        return st;
    double most = (double)(k + NEAR), hi = most < g->reach ? most : g->reach;
    if (k == g->rings && flux_within(g, inside, hi) < flux)
        return OK;
    double lo = k > NEAR ? (double)(k - NEAR + 1) : 0;
    double guess = k < g->rings ? sqrt((double)(k * k) + (2.0 * (double)k + 1) * (flux - sum) / g->sum[k]) : hi;
    guess = guess < hi ? guess : hi;
    guess = guess > lo ? guess : 0.5 * (lo + hi);
    *radius = solve(g, inside, flux, lo, hi, guess, g->sum[k] / (2.0 * (double)k + 1));
    return OK;
}
