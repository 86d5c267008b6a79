/*
 * growth.c - radii of circles that hold given fluxes; see growth.h.
 *
 * Pixels are summed by rings of width 1 of their centres' distance, as far out as
 * needed.  The ring in which the sum passes the flux gives a guess; only pixels
 * of the rings near it are cut exactly, in Newton steps: the overlap of a
 * rectangle with a circle and its derivative come from one formula.
 */
#include "growth.h"
#include "grow.h"
#include "simd.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { NEAR = 2, LANES = 8 };  /* NEAR: rings on both sides of the guess */
enum { X0, Y0, X1, Y1, VALUE, SUM, SLOPE, PARTS };

struct growth {
    const float *v;
    long nx, ny, rings, known; /* rings as far as `reach`; how many of them are summed */
    double cx, cy, reach;
    int32_t *ring;             /* of the pixels of a row */
    double *sum;               /* by ring */
    double *cut;               /* PARTS arrays of `room` rectangles near the circle, in the first quadrant */
    size_t cap_ring, cap_sum, cap_cut;
    long ncut, room;
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
    int st = grow(&g->ring, &g->cap_ring, (size_t)nx, sizeof *g->ring);
    if (!st)                               /* the farthest pixel has a ring below 2 rings + 4 */
        st = grow(&g->sum, &g->cap_sum, (size_t)(2 * rings + 4), sizeof *g->sum);
    if (st)
        return st;
    g->v = v;
    g->nx = nx;
    g->ny = ny;
    g->cx = cx;
    g->cy = cy;
    g->reach = reach;
    g->rings = rings;
    g->known = 0;
    return OK;
}

/* The pixels a .. b-1 of n whose centres are within `far` of c. */
static void span(double c, double far, long n, long *a, long *b)
{
    *a = c > far ? (long)(c - far) : 0;
    *b = c + far + 1 < (double)n ? (long)(c + far) + 1 : n;
}

/* Sum the rings 0 .. known-1 (what is beyond them in sum[] is not complete). */
static void sum_rings(struct growth *g, long known)
{
    long x0, x1, y0, y1;
    span(g->cx, (double)known, g->nx, &x0, &x1);
    span(g->cy, (double)known, g->ny, &y0, &y1);
    g->known = known;
    memset(g->sum, 0, (size_t)(2 * known + 4) * sizeof *g->sum);
    for (long y = y0; y < y1 && x1 > x0; y++) {
        const float *row = g->v + y * g->nx + x0;
        rings_of((float)((double)x0 - g->cx), (float)((double)y - g->cy), x1 - x0, g->ring);
        for (long i = 0; i < x1 - x0; i++)
            g->sum[g->ring[i]] += (double)row[i];
    }
}

static void add_rectangle(struct growth *g, double x0, double y0, double x1, double y1, double v)
{
    double *c = g->cut + g->ncut++;
    c[X0 * g->room] = x0;
    c[Y0 * g->room] = y0;
    c[X1 * g->room] = x1;
    c[Y1 * g->room] = y1;
    c[VALUE * g->room] = v;
}

/* A pixel at (dx, dy); across an axis it is cut there, its parts turned into the first quadrant. */
static void add_pixel(struct growth *g, double dx, double dy, double v)
{
    double x = fabs(dx) - 0.5, y = fabs(dy) - 0.5, near_x = x > 0 ? x : 0, near_y = y > 0 ? y : 0;
    add_rectangle(g, near_x, near_y, x + 1, y + 1, v);
    if (x < 0)
        add_rectangle(g, 0, near_y, -x, y + 1, v);
    if (y < 0)
        add_rectangle(g, near_x, 0, x + 1, -y, v);
    if (x < 0 && y < 0)
        add_rectangle(g, 0, 0, -x, -y, v);
}

/* The pixels from .. to-1 of row y whose rings are first .. last. */
static void collect_run(struct growth *g, long y, long from, long to, long first, long last)
{
    if (to <= from)
        return;
    double dy = (double)y - g->cy;
    rings_of((float)((double)from - g->cx), (float)dy, to - from, g->ring);
    for (long x = from; x < to; x++)
        if (g->ring[x - from] >= first && g->ring[x - from] <= last)
            add_pixel(g, (double)x - g->cx, dy, (double)g->v[y * g->nx + x]);
}

/* Collect the pixels of the rings k - NEAR .. k + NEAR; *inside: the flux of those within. */
static int collect(struct growth *g, long k, double *inside)
{
    long first = k > NEAR ? k - NEAR : 0, last = k + NEAR, a, b, c, d;
    span(g->cx, (double)last + 2, g->nx, &a, &b);
    span(g->cy, (double)last + 2, g->ny, &c, &d);
    *inside = 0;
    for (long j = 0; j < first; j++)
        *inside += g->sum[j];
    g->ncut = 0;
    /* at most the pixels of the box, and four parts of those across an axis */
    size_t room = b > a && d > c ? (size_t)((b - a) * (d - c) + 2 * (b - a) + 2 * (d - c) + 16) : 16;
    int st = grow(&g->cut, &g->cap_cut, PARTS * room, sizeof *g->cut);
    if (st)
        return st;
    g->room = (long)room;
    for (long y = c; y < d && b > a; y++) {
        double dy = (double)y - g->cy, in2 = (double)(first * first) - dy * dy, in = in2 > 4 ? sqrt(in2) - 1 : 0;
        long left = b, right = b;          /* what lies between is nearer than ring `first` */
        if (in > 0) {
            left = (long)floor(g->cx - in) + 1;
            right = (long)floor(g->cx + in);
            left = left < a ? a : left < b ? left : b;
            right = right < left ? left : right < b ? right : b;
        }
        collect_run(g, y, a, left, first, last);
        collect_run(g, y, right, b, first, last);
    }
    while (g->ncut % LANES)
        add_rectangle(g, 1, 1, 1, 1, 0);
    return OK;
}

/*
 * Overlap of n rectangles with the circle of radius r, times their values, into
 * sum[], and twice its derivative by r^2, into slope[].  c: arrays X0 to VALUE,
 * `room` apart.  The arc of angle u between the points at a and b has sin(u/2)^2 = z <= 1/2;
 * the polynomial is asin(sqrt z)/sqrt z within 4e-10 (Chebyshev).
 */
WIDE static void overlaps(const double *restrict c, long room, long n, double r, double *restrict sum,
                          double *restrict slope)
{
    const double *x0 = c, *y0 = c + Y0 * room, *x1 = c + X1 * room, *y1 = c + Y1 * room, *v = c + VALUE * room;
    double r2 = r * r, quarter = 0.25 / r2;
    for (long i = 0; i < n; i++) {
        double a = r2 - y1[i] * y1[i], b = r2 - y0[i] * y0[i];
        a = sqrt(a > 0 ? a : 0);
        b = sqrt(b > 0 ? b : 0);
        a = a > x0[i] ? a : x0[i];
        a = a < x1[i] ? a : x1[i];
        b = b < x1[i] ? b : x1[i];
        b = b > a ? b : a;
        double ha = r2 - a * a, hb = r2 - b * b;
        ha = sqrt(ha > 0 ? ha : 0);
        hb = sqrt(hb > 0 ? hb : 0);
        double dh = ha - hb, z = ((b - a) * (b - a) + dh * dh) * quarter;
        z = b > a ? z : 0;
        z = z < 0.5 ? z : 0.5;
        double p = 0.9999999997208244 + z * (0.1666667753383435 + z * (0.07499305723602248 + z * (0.0448136838643679 +
                   z * (0.02826846168768248 + z * (0.03717695363414592 + z * (-0.04439638506191897 + z *
                   (0.1674860232289666 + z * (-0.2027115864671941 + z * 0.1463625823269831))))))));
        double u = 2 * sqrt(z) * p;
        double area = (a - x0[i]) * (y1[i] - y0[i]) + 0.5 * (b * hb - a * ha + r2 * u) - y0[i] * (b - a);
        sum[i] = v[i] * area;
        slope[i] = v[i] * u;
    }
}

/* Flux inside radius r > 0, from the pixels collected; *slope: its derivative by r^2. */
static double flux_within(const struct growth *g, double inside, double r, double *slope)
{
    double sum = inside, s = 0;
    double *to = g->cut + SUM * g->room, *slopes = g->cut + SLOPE * g->room;
    overlaps(g->cut, g->room, g->ncut, r, to, slopes);
    double lane[2][LANES] = {{0}};
    for (long i = 0; i < g->ncut; i += LANES)
        for (int j = 0; j < LANES; j++) {
            lane[0][j] += to[i + j];
            lane[1][j] += slopes[i + j];
        }
    for (int j = 0; j < LANES; j++) {
        sum += lane[0][j];
        s += lane[1][j];
    }
    *slope = 0.5 * s;
    return sum;
}

/* Root of flux_within = flux between lo and hi by Newton steps in r^2, halving where they leave the bracket. */
static double solve(const struct growth *g, double inside, double flux, double lo, double hi, double guess)
{
    double r = guess;
    for (int i = 0; i < 40; i++) {
        double slope, here = flux_within(g, inside, r, &slope) - flux, next = r * r - here / slope;
        if (here >= 0)
            hi = r;
        else
            lo = r;
        next = slope > 0 && next > 0 ? sqrt(next) : -1;
        int good = next >= lo && next <= hi;
        if (fabs(here) < 5e-4 * flux || !(hi - lo > 2e-4 * hi))
            return good ? next : r;
        r = good ? next : 0.5 * (lo + hi);
    }
    return r;
}

int growth_radius(struct growth *g, double flux, double *radius)
{
    double sum = 0, inside, slope;
    long k = 0;
    for (;; k++) {
        if (k >= g->known && g->known < g->rings) {
            long more = g->known ? 2 * g->known : g->rings / 2 + 1;
            sum_rings(g, more < g->rings ? more : g->rings);
        }
        if (k >= g->rings || !(sum + g->sum[k] < flux))
            break;
        sum += g->sum[k];
    }
    *radius = g->reach;
    int st = collect(g, k, &inside);
    if (st)
        return st;
    double most = (double)(k + NEAR), hi = most < g->reach ? most : g->reach;
    if (k == g->rings && flux_within(g, inside, hi, &slope) < flux)
        return OK;
    double lo = k > NEAR ? (double)(k - NEAR + 1) : 0;
    double guess = k < g->rings ? sqrt((double)(k * k) + (2.0 * (double)k + 1) * (flux - sum) / g->sum[k]) : hi;
    guess = guess < hi ? guess : hi;
    guess = guess > lo ? guess : 0.5 * (lo + hi);
    *radius = solve(g, inside, flux, lo, hi, guess);
    return OK;
}
