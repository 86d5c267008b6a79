/*
 * population.c - number counts, sizes and the make-up of galaxies.
 *
 * Counts: COSMOS2020 and HDF-N, continued beyond magnitude 27.  Sizes: median
 * 0.36" 10^(-0.105 (m - 22.25)), sigma_ln 0.45.  Exponential discs and de
 * Vaucouleurs bulges are sums of six and eight Gaussians (rms error of the
 * profiles 0.13 % and 0.6 %); knots and spiral arms make them irregular.
 */
#include "population.h"
#include "shapelet.h"
#include <math.h>

static const double pi = 3.14159265358979324;

/* ---- counts ---- */

enum { KNOTS = 12 };
static const double knot_mag[KNOTS] = {18, 20, 22.25, 23.25, 24.25, 25.25, 26.25, 27.25, 28.25, 29.25, 30.25, 31.25};
static const double knot_count[KNOTS] = {.08, .65, 4.5, 9.6, 20, 33.4, 54, 84, 128, 185, 260, 350};   /* per mag per arcmin^2 */

/* Piece that holds m (the end pieces go on), ln N at its lower knot and slope d ln N / dm. */
static int piece(double m, double *start, double *slope)
{
    int i = 0;
    while (i < KNOTS - 2 && m >= knot_mag[i + 1])
        i++;
    *start = log(knot_count[i]);
    *slope = (log(knot_count[i + 1]) - *start) / (knot_mag[i + 1] - knot_mag[i]);
    return i;
}

/* Integral over lo..hi of exp(start + slope (m - at)). */
static double integral(double start, double slope, double at, double lo, double hi)
{
    return exp(start + slope * (lo - at)) * expm1(slope * (hi - lo)) / slope;
}

/* Upper end of piece i, or hi. */
static double piece_end(int i, double hi)
{
    return i < KNOTS - 2 && knot_mag[i + 1] < hi ? knot_mag[i + 1] : hi;
}

double counts_between(double lo, double hi)
{
    double sum = 0, start, slope;
    while (lo < hi) {
        int i = piece(lo, &start, &slope);
        double end = piece_end(i, hi);
        sum += integral(start, slope, knot_mag[i], lo, end);
        lo = end;
    }
    return sum;
}

double counts_magnitude(double lo, double hi, double u)
{
    double rest = u * counts_between(lo, hi), start, slope;
    while (lo < hi) {
        int i = piece(lo, &start, &slope);
        double end = piece_end(i, hi), all = integral(start, slope, knot_mag[i], lo, end);
        if (rest <= all || end == hi) {
            double m = lo + log1p(slope * rest / exp(start + slope * (lo - knot_mag[i]))) / slope;
            return m < end ? m : end;
        }
        rest -= all;
        lo = end;
    }
    return hi;
}

/* ---- profiles ---- */

/* Radius that holds half of the flux, by bisection to the last bit. */
static double half_light(const struct profile *p)
{
    double lo = 0, hi = 10;
    for (int i = 0; i < 80; i++) {
        double r = 0.5 * (lo + hi), inside = 0;
        for (int k = 0; k < p->n; k++)
            inside -= p->weight[k] * expm1(-0.5 * r * r / p->variance[k]);
        *(inside < 0.5 ? &lo : &hi) = r;
    }
    return 0.5 * (lo + hi);
}

/* Scale to flux 1 and half-light radius 1. */
static struct profile normalised(struct profile p)
{
    double sum = 0;
    for (int k = 0; k < p.n; k++)
        sum += p.weight[k];
    for (int k = 0; k < p.n; k++)
        p.weight[k] /= sum;
    double r = half_light(&p);
    for (int k = 0; k < p.n; k++)
        p.variance[k] /= r * r;
    return p;
}

struct profiles population_profiles(void)
{
    static const struct profile exponential = {6, {.00267, .01917, .0833, .28365, .83254, 2.25479},
                                               {.00064, .00803, .05344, .21781, .45395, .26472}};
    static const struct profile vaucouleurs = {8, {.00008, .00044, .00219, .01013, .04606, .21605, 1.12708, 8.01051},
                                               {.00235, .00812, .02333, .05663, .11642, .19943, .2718, .26346}};
    return (struct profiles){normalised(exponential), normalised(vaucouleurs)};
}

/* ---- one galaxy ---- */

double population_size(const struct population *p, double m)
{
    return p->size * pow(10, p->slope * (m - 22.25));
}

int galaxy_order(double mag)
{
    return mag < 26 ? 12 : mag < 28 ? 8 : 4;
}

/* Beta(4,2): the second largest of five uniforms. */
static double second_largest(const double u[5])
{
    double first = 0, second = 0;
    for (int i = 0; i < 5; i++)
        if (u[i] > first) {
            second = first;
            first = u[i];
        } else if (u[i] > second) {
            second = u[i];
        }
    return second;
}

/* Poisson by inversion, at most KNOTS_MAX (mean <= 6: probability beyond is 3e-9). */
static int poisson(double mean, double u)
{
    double term = exp(-mean), sum = term;
    int k = 0;
    while (u > sum && k < KNOTS_MAX)
        sum += term *= mean / ++k;
    return k;
}

static double clip(double x, double lo, double hi)
{
    return x < lo ? lo : x > hi ? hi : x;
}

void galaxy_draw(const struct population *p, const struct rng *r, uint64_t id, double mag, struct galaxy *g)
{
    double u[5], face = rng_uniform(r, id, DRAW_INCLINE);
    *g = (struct galaxy){.mag = mag};
    g->re = population_size(p, mag) * exp(p->scatter * rng_normal(r, id, DRAW_SIZE));
    int dominated = rng_uniform(r, id, DRAW_KIND) < clip(0.35 - 0.05 * (mag - 21), 0.15, 0.35);
    for (uint32_t i = 0; i < 5; i++)
        u[i] = rng_uniform(r, id, DRAW_BULGE + i);
    g->bt = dominated ? second_largest(u) : -expm1(log1p(-u[0]) / 8);     /* Beta(4,2), Beta(1,8) */
    g->q = sqrt(0.22 * 0.22 + (1 - 0.22 * 0.22) * face * face);
    g->q_bulge = sqrt(0.6 * 0.6 + (1 - 0.6 * 0.6) * face * face);
    g->pa = pi * rng_uniform(r, id, DRAW_ANGLE);
    g->clumpy = fmin(0.75, 0.45 * exp(0.5 * rng_normal(r, id, DRAW_CLUMPY)) * (1 - g->bt));
    g->n_knots = poisson(4 * clip(g->re / 0.2, 0.4, 1.5), rng_uniform(r, id, DRAW_KNOTS));
    g->arms = !dominated && g->re > 0.25 && rng_uniform(r, id, DRAW_ARMS) < 0.6;
    g->pitch = pi / 180 * (12 + 23 * rng_uniform(r, id, DRAW_PITCH)) * (rng_uniform(r, id, DRAW_WINDING) < 0.5 ? -1 : 1);
    g->phase = 2 * pi * rng_uniform(r, id, DRAW_PHASE);
    g->shift_x = 0.40 * rng_normal(r, id, DRAW_SHIFT_X);
    g->shift_y = 0.40 * rng_normal(r, id, DRAW_SHIFT_Y);
    for (int k = 0; k < g->n_knots; k++) {
        uint32_t at = DRAW_KNOT + 4 * (uint32_t)k;
        double radius = -log(rng_uniform(r, id, at) * rng_uniform(r, id, at + 1)) / 1.678;      /* Gamma(2) */
        double angle = 2 * pi * rng_uniform(r, id, at + 2);
        radius = fmin(radius, 2.5);
        g->knot_x[k] = radius * cos(angle) + g->shift_x;
        g->knot_y[k] = radius * sin(angle) + g->shift_y;
        g->knot_size[k] = 0.20 * exp(0.35 * rng_normal(r, id, at + 3));
    }
}

/* The map of a circle to an ellipse of the same area: turn(pa) diag(1,q)/sqrt(q). */
struct map {
    double xx, xy, yx, yy;
};

static struct map ellipse(double q, double pa)
{
    double a = 1 / sqrt(q), b = sqrt(q);
    return (struct map){a * cos(pa), -b * sin(pa), a * sin(pa), b * cos(pa)};
}

/* A Gaussian of variance v (before the map) at (x, y) (before the map), smoothed by s2. */
static int add_mapped(struct gaussians *out, double flux, double v, double x, double y, const struct map *m, double s2)
{
    return gaussians_add(out, flux, m->xx * x + m->xy * y, m->yx * x + m->yy * y, v * (m->xx * m->xx + m->xy * m->xy) + s2,
                         v * (m->xx * m->yx + m->xy * m->yy), v * (m->yx * m->yx + m->yy * m->yy) + s2);
}

/* Two opposite arms r = 0.4 re .. 2.2 re, Gaussians evenly in ln r, weighted like the disc per ln r. */
static int add_arms(struct gaussians *out, const struct galaxy *g, double flux, const struct map *m, double s2)
{
    double radius[ARM_GAUSSIANS], weight[ARM_GAUSSIANS], sum = 0;
    for (int k = 0; k < ARM_GAUSSIANS; k++) {
        radius[k] = 0.4 * pow(2.2 / 0.4, k / (ARM_GAUSSIANS - 1.0));
        weight[k] = radius[k] * radius[k] * exp(-1.678 * radius[k]);
        sum += weight[k];
    }
    int st = OK;
    for (int k = 0; k < 2 * ARM_GAUSSIANS && !st; k++) {
        double r = radius[k / 2], angle = g->phase + log(r / 0.4) / tan(g->pitch) + pi * (k % 2);
        st = add_mapped(out, 0.5 * flux * weight[k / 2] / sum, 0.22 * 0.22 * g->re * g->re, g->re * r * cos(angle),
                        g->re * r * sin(angle), m, s2);
    }
    return st;
}

int galaxy_gaussians(const struct population *p, const struct profiles *f, const struct galaxy *g, struct gaussians *out)
{
    struct gaussians s = {0};
    double s2 = p->smoothing * p->smoothing, r2 = g->re * g->re, disc = 1 - g->bt;
    struct map m = ellipse(g->q, g->pa), mb = ellipse(g->q_bulge, g->pa);
    int st = OK, parts = (g->n_knots > 0) + g->arms;
    double lumps = parts ? g->clumpy * disc / parts : 0;       /* knots and arms share evenly */
    for (int k = 0; k < f->exponential.n && !st; k++)
        st = add_mapped(&s, (disc - parts * lumps) * f->exponential.weight[k], r2 * f->exponential.variance[k], 0, 0, &m, s2);
    for (int k = 0; k < f->vaucouleurs.n && !st; k++)
        st = add_mapped(&s, g->bt * f->vaucouleurs.weight[k], r2 * f->vaucouleurs.variance[k], 0, 0, &mb, s2);
    for (int k = 0; k < g->n_knots && !st; k++) {
        double x = g->re * g->knot_x[k], y = g->re * g->knot_y[k], v = r2 * g->knot_size[k] * g->knot_size[k] + s2;
        st = gaussians_add(&s, lumps / g->n_knots, m.xx * x + m.xy * y, m.yx * x + m.yy * y, v, 0, v);
    }
    if (g->arms && !st)
        st = add_arms(&s, g, lumps, &m, s2);
    if (!st)
        *out = s;
    return st;
}

/* Flux of a shapelet series: beta sum c I_n1 I_n2, I_n the integral of phi_n (0 for odd n). */
static double series_flux(int nmax, double beta, const double *c)
{
    double line[GAUSSIANS_NMAX + 1], sum = 0;
    shapelet_line_integrals(nmax, line);
    for (int n = 0; n <= nmax; n += 2)
        for (int n1 = 0; n1 <= n; n1 += 2)
            sum += c[n * (n + 1) / 2 + n1] * line[n1] * line[n - n1];
    return beta * sum;
}

int galaxy_project(const struct population *p, const struct galaxy *g, const struct gaussians *s, int nmax, double *c,
                   struct galaxy_fit *fit)
{
    enum { COUNT = (GAUSSIANS_NMAX + 1) * (GAUSSIANS_NMAX + 2) / 2, TRIES = 7 };
    double buffer[2][COUNT], best = -1;
    int which = 0, n = (nmax + 1) * (nmax + 2) / 2;
    struct galaxy_fit got = {0};
    double size = sqrt(g->re * g->re + 1.3862943611198906 * p->smoothing * p->smoothing);   /* half light after smoothing */
    for (int i = 0; i < TRIES; i++) {
        double beta = size * (0.25 + 0.70 * i / (TRIES - 1)), sum = 0;
        int st = gaussians_project(s, nmax, beta, buffer[!which]);
        if (st)
            return st;
        for (int k = 0; k < n; k++)
            sum += buffer[!which][k] * buffer[!which][k];
        if (sum > best) {
            best = sum;
            which = !which;
            got.beta = beta;
        }
    }
    got.flux = series_flux(nmax, got.beta, buffer[which]);
    if (!(got.flux > 0))
        return E_RANGE;
    got.power = best / gaussians_power(s);
    for (int k = 0; k < n; k++)
        c[k] = buffer[which][k] / got.flux;
    *fit = got;
    return OK;
}
