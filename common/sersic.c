/* sersic.c - Sersic profiles as mixtures of Gaussians. */
#include "sersic.h"
#include "simd.h"
#include <math.h>
#include <stdlib.h>

#define CELLS 8                /* of ln(n - 1/2), from SERSIC_NARROW to SERSIC_MAX */
#define DEGREES 12             /* values of n in a cell */
#define TERMS 4096
#define ANGLES 96
#define FAINTEST -34.0         /* ln of the flux of the faintest Gaussian tabulated, over the brightest's */
#define WIDE_SHARE 0.02        /* of eps: light put nearer than it is */
#define NARROW_SHARE 0.02      /* of a pixel's tolerance: light put less near */

/* Regularised incomplete gamma function P(a, x) by its series; a <= 16, x <= 30. */
static double gamma_p(double a, double x)
{
    double term = exp(-x + a * log(x) - lgamma(a + 1)), sum = term;
    for (int k = 1; k < 500 && term > 1e-17 * sum; k++)
        sum += term *= x / (a + k);
    return sum;
}

/* b with P(2n, b) = 1/2: half the light inside r = RE.  From Ciotti and Bertin's (1999) series, then Newton's steps. */
static double sersic_b(double n)
{
    double b = 2 * n - 1.0 / 3 + 4 / (405 * n);
    for (int i = 0; i < 6; i++)
        b -= (gamma_p(2 * n, b) - 0.5) / exp(-b + (2 * n - 1) * log(b) - lgamma(2 * n));
    return b;
}

/* ---- the stable law ---- */

/* What the density of ln t needs of the index a. */
struct law {
    double a;
    double peak;               /* ln A(0) */
    int terms;
    double term[TERMS];        /* of the series in t^-a */
    double angle[ANGLES];      /* A(u) / A(0) */
};

static void law_new(struct law *w, double a)
{
    w->a = a;
    w->peak = log(1 - a) + a / (1 - a) * log(a);
    const double most = 4 / (1 - a);       /* powers beyond fall steeply for all t that the series is used for */
    w->terms = (int)fmin(TERMS, 40 + 4 * most);
    for (int k = 1; k <= w->terms; k++)
        w->term[k - 1] = (k % 2 ? 1 : -1) * exp(lgamma(1 + k * a) - lgamma(1.0 + k)) * sin(M_PI * fmod(k * a, 2)) / M_PI;
    for (int i = 0; i < ANGLES; i++) {
        const double u = (i + 0.5) * M_PI / ANGLES;
        w->angle[i] = exp(log(sin((1 - a) * u)) + a / (1 - a) * log(sin(a * u)) - 1 / (1 - a) * log(sin(u)) - w->peak);
    }
}

/*
 * ln of the density of ln t of the one-sided stable law, exp(-s^a) = E exp(-s t).  With W = A(0) t^(-a/(1-a)): where W is small the
 * series sum over k of (-1)^(k+1) Gamma(1 + k a) / k! sin(pi k a) t^(-k a) / pi, else Kanter's (1975) average over u of
 * W(u) exp(-W(u)) a/(1-a), W(u) = A(u) t^(-a/(1-a)), which ends before the u that the series is for.
 */
static double law_log_density(const struct law *w, double lnt)
{
    const double first = exp(w->peak - w->a / (1 - w->a) * lnt), z = exp(-w->a * lnt);
    double sum = 0;
    if (first < 2) {
        double power = 1;
        for (int k = 0; k < w->terms; k++) {
            power *= z;
            sum += w->term[k] * power;
        }
        return log(sum);
    }
    for (int i = 0; i < ANGLES; i++)
        sum += w->angle[i] * exp(-first * (w->angle[i] - 1));
    return log(sum / ANGLES * w->a / (1 - w->a)) + log(first) - first;
}

/* ---- the rule ---- */

/*
 * Step in y.  Where the law is wide the error is about exp(-pi^2 / step) / 5; for n near 1/2 it falls more slowly: measured
 * (tests/unit/test_sersic.c).
 */
static double step_for(double n, double eps)
{
    const double e = fmin(fmax(eps, 1e-9), 1e-3), wide = M_PI * M_PI / -log(e), narrow = 0.42 + 0.03 * fmin(0, log10(e / 1e-5));
    const double u = (n - 0.5) * (n - 0.5) / (0.25 * 0.25);
    return wide * (narrow + u) / (1 + u);
}

/* A profile's Gaussians, numbered by y / step. */
struct rule {
    struct law law;
    double centre, width;      /* of ln t */
    double step;
    double scale;              /* ln sigma = scale - ln t / 2 */
};

static void rule_new(struct rule *r, double n, double eps)
{
    const double a = 1 / (2 * n);
    law_new(&r->law, a);
    r->centre = (1 - a) / a * (r->law.peak - log(2 * n - 0.5));     /* about the largest flux */
    r->width = 0.8 * (1 - a) / a;
    r->step = step_for(n, eps);
    r->scale = -0.5 * M_LN2 - n * log(sersic_b(n));
}

/* ln sigma and ln flux, not normalised, of Gaussian k. */
static void rule_gaussian(const struct rule *r, int k, double *sigma, double *flux)
{
    const double y = k * r->step;
    double x = y * r->width / (1 + r->width);          /* y = x + asinh(x / width): rises, bends once */
    if (fabs(y) > 1)
        x = y - copysign(fmin(fabs(y) - 1e-3 * fmin(1, r->width), asinh(fabs(y) / r->width)), y);
    for (int i = 0; i < 60; i++) {
        const double move = (x + asinh(x / r->width) - y) / (1 + 1 / hypot(r->width, x));
        x -= move;
        if (fabs(move) < 1e-15 * (fabs(x) + r->width))
            break;
    }
    const double lnt = r->centre + x;
    *sigma = r->scale - 0.5 * lnt;
    *flux = law_log_density(&r->law, lnt) - lnt - log(1 + 1 / hypot(r->width, x));
}

/* First and last Gaussian that are not too faint. */
static void rule_range(const struct rule *r, int *first, int *last)
{
    double sigma, flux, best = -INFINITY;
    for (int way = -1; way <= 1; way += 2) {
        int *end = way < 0 ? first : last;
        for (*end = 0; abs(*end) < SERSIC_PARTS / 2 - 2; *end += way) {
            rule_gaussian(r, *end, &sigma, &flux);
            best = fmax(best, flux);
            if (!(flux > best + FAINTEST))
                break;
        }
    }
}

int sersic_direct(double n, double eps, double *sigma, double *flux)
{
    struct rule r;
    int first, last;
    double sum = 0;
    if (!(n >= SERSIC_NARROW && n <= SERSIC_MAX))
        return 0;
    rule_new(&r, n, eps);
    rule_range(&r, &first, &last);
    for (int k = first; k <= last; k++) {
        rule_gaussian(&r, k, &sigma[k - first], &flux[k - first]);
        sigma[k - first] = exp(sigma[k - first]);
        sum += flux[k - first] = exp(flux[k - first]);
    }
    for (int k = 0; k <= last - first; k++)
        flux[k] /= sum;
    return last - first + 1;
}

/* ---- polynomials in n ---- */

struct cell {
    int count;                 /* of Gaussians; 0: not made yet */
    double sigma[DEGREES][SERSIC_PARTS], flux[DEGREES][SERSIC_PARTS];   /* logarithms, at the n of Chebyshev's points */
};

struct sersic {
    double eps;
    double width;              /* of a cell, in ln(n - 1/2) */
    double point[DEGREES], weight[DEGREES];   /* Chebyshev's points of -1..1, and their barycentric weights */
    struct cell cell[CELLS];
};

int sersic_new(struct sersic **s, double eps)
{
    struct sersic *made = calloc(1, sizeof *made);     /* cells in use alone are ever touched */
    if (!made)
        return E_NOMEM;
    made->eps = eps;
    made->width = log((SERSIC_MAX - 0.5) / (SERSIC_NARROW - 0.5)) / CELLS;
    for (int j = 0; j < DEGREES; j++) {
        made->point[j] = cos((j + 0.5) * M_PI / DEGREES);
        made->weight[j] = (j % 2 ? -1 : 1) * sin((j + 0.5) * M_PI / DEGREES);
    }
    *s = made;
    return OK;
}

void sersic_free(struct sersic *s)
{
    free(s);
}

/* n at point j of cell c. */
static double index_at(const struct sersic *s, int c, int j)
{
    return 0.5 + (SERSIC_NARROW - 0.5) * exp((c + 0.5 * (s->point[j] + 1)) * s->width);
}

static void cell_make(struct sersic *s, int c)
{
    struct cell *e = &s->cell[c];
    struct rule r;
    int first = 0, last = 0;
    for (int j = 0; j < DEGREES; j += DEGREES - 1) {       /* what both ends need */
        int lo, hi;
        rule_new(&r, index_at(s, c, j), s->eps);
        rule_range(&r, &lo, &hi);
        first = lo < first ? lo : first;
        last = hi > last ? hi : last;
    }
    for (int j = 0; j < DEGREES; j++) {
        double sum = 0;
        rule_new(&r, index_at(s, c, j), s->eps);
        for (int k = first; k <= last; k++) {
            rule_gaussian(&r, k, &e->sigma[j][k - first], &e->flux[j][k - first]);
            sum += exp(e->flux[j][k - first]);
        }
        for (int k = first; k <= last; k++)
            e->flux[j][k - first] -= log(sum);
    }
    e->count = last - first + 1;
}

/* Weights of the values at the points for the polynomial's value at x. */
static void weights_at(const struct sersic *s, double x, double weight[DEGREES])
{
    double sum = 0;
    for (int j = 0; j < DEGREES; j++) {
        const double d = x - s->point[j];
        if (d == 0) {
            for (int i = 0; i < DEGREES; i++)
                weight[i] = i == j;
            return;
        }
        sum += weight[j] = s->weight[j] / d;
    }
    for (int j = 0; j < DEGREES; j++)
        weight[j] /= sum;
}

/* Sum over points j of weight[j] value[j][k]. */
WIDE static void combine(const double weight[DEGREES], const double (*value)[SERSIC_PARTS], int count, double *to)
{
    for (int k = 0; k < count; k++)
        to[k] = weight[0] * value[0][k];
    for (int j = 1; j < DEGREES; j++)
        for (int k = 0; k < count; k++)
            to[k] += weight[j] * value[j][k];
}

/* Every Gaussian of the profile; n >= SERSIC_NARROW. */
static int whole(struct sersic *s, double n, double *sigma, double *flux)
{
    const double at = log((n - 0.5) / (SERSIC_NARROW - 0.5)) / s->width;
    const int c = at < 0 ? 0 : at < CELLS ? (int)at : CELLS - 1;
    const struct cell *e = &s->cell[c];
    double weight[DEGREES];
    if (!e->count)
        cell_make(s, c);
    weights_at(s, 2 * (at - c) - 1, weight);
    combine(weight, e->sigma, e->count, sigma);
    combine(weight, e->flux, e->count, flux);
    for (int k = 0; k < e->count; k++) {
        sigma[k] = exp(sigma[k]);
        flux[k] = exp(flux[k]);
    }
    return e->count;
}

/* Gather what is too wide or too narrow to be told from its neighbours; the sum becomes 1. */
static int gather(int n, double wide, double narrow, double *sigma, double *flux)
{
    int first = 0, last = n - 1;
    double sum = 0;
    for (; first < last && flux[first] + flux[first + 1] < wide; first++)
        flux[first + 1] += flux[first];
    for (; last > first && flux[last] + flux[last - 1] < narrow; last--)
        flux[last - 1] += flux[last];
    for (int k = first; k <= last; k++)
        sum += flux[k];
    for (int k = first; k <= last; k++) {
        sigma[k - first] = sigma[k];
        flux[k - first] = flux[k] / sum;
    }
    return last - first + 1;
}

int sersic_gaussians(struct sersic *s, double n, double pixel, double tol, double *sigma, double *flux)
{
    if (!(n >= SERSIC_MIN && n <= SERSIC_MAX))
        return 0;
    if (n == SERSIC_MIN) {
        sigma[0] = SIGMA_PER_RE;
        flux[0] = 1;
        return 1;
    }
    int count = whole(s, fmax(n, SERSIC_NARROW), sigma, flux);
    double peak = 0;           /* light in the middle pixel, no less than a quarter of it */
    for (int k = 0; k < count; k++)
        peak += flux[k] * fmin(1, pixel * pixel / (2 * M_PI * sigma[k] * sigma[k]));
    count = gather(count, WIDE_SHARE * s->eps, NARROW_SHARE * fmax(s->eps * peak, tol), sigma, flux);
    if (n < SERSIC_NARROW) {
        const double share = (n - 0.5) / (SERSIC_NARROW - 0.5);
        for (int k = 0; k < count; k++)
            flux[k] *= share;
        for (int k = count++; k > 0; k--) {
            sigma[k] = sigma[k - 1];
            flux[k] = flux[k - 1];
        }
        sigma[0] = SIGMA_PER_RE;
        flux[0] = 1 - share;
    }
    return count;
}
