/*
 * poisson.c - quantiles of the Poisson distribution, exact and fast.
 *
 * P(K < y) = Q(y, m), the incomplete gamma function, is continuous in y; the
 * draw is floor of the y that solves Q(y, m) = Phi(w) = u.  With s = w/sqrt(m)
 *
 *   y = m F(s) + C0(s) + C1(s)/m + C2(s)/m^2 + ...,
 *
 * where F solves 1 - F + F ln F = s^2/2 (the uniform expansion of Temme 1979,
 * SIAM J. Math. Anal. 10, 757, inverted for its first argument; Giles 2016,
 * ACM TOMS 42, 2 has F and C0).  Where y is farther from a whole number than
 * the error of the truncated series, floor(y) is the exact answer; elsewhere
 * the distribution itself decides.  At a mean of 428 that is 1 draw in 10^8.
 */
#include "poisson.h"
#include "rng.h"
#include "simd.h"
#include <math.h>
#include <string.h>

enum { BLOCK = 256, LANES = 8, STEPS = 4 };

#define SERIES_LO 8.0       /* means for which the series is used */
#define SERIES_HI 1e12
#define SERIES_S 0.6        /* and its largest |w|/sqrt(mean) */
#define TEMME_MEAN 1e4      /* above it tails come from the uniform expansion */

/* x - log(1 + x), full relative precision for x > -1. */
static double log_gap(double x)
{
    if (!(fabs(x) < 0.3))
        return x - log1p(x);
    const double v = x / (2 + x), v2 = v * v;
    double odd = 0, p = v * v2;
    for (int j = 3; j < 35; j += 2) {
        odd += p / j;
        p *= v2;
    }
    return x * v - 2 * odd;
}

/* e^-m m^k / k!; for k >= 16 by Stirling's series with the large terms taken together. */
static double probability(double k, double mean)
{
    if (k < 16) {
        double p = exp(-mean);
        for (int j = 1; j <= (int)k; j++)
            p *= mean / j;
        return p;
    }
    const double r = 1 / (k * k);
    const double stirling = (1.0 / 12 - r * (1.0 / 360 - r * (1.0 / 1260 - r * (1.0 / 1680
        - r * (1.0 / 1188 - r * (691.0 / 360360)))))) / k;
    return exp(-stirling - k * log_gap((mean - k) / k)) / sqrt(2 * M_PI * k);
}

/*
 * Q(a, m) = erfc(eta sqrt(a/2))/2 + R, eta^2/2 = m/a - 1 - ln(m/a),
 * R = exp(-a eta^2/2)/sqrt(2 pi a) sum_n c_n(eta) a^-n (DLMF 8.12.3-8.12.11).
 * The polynomials are cut for |eta| < 0.1 and a > 9000: 1e-15 of the smaller tail.
 */
static void tails_uniform(double a, double mean, double *lower, double *upper)
{
    const double mu = (mean - a) / a;
    const double half = log_gap(mu);
    const double eta = copysign(sqrt(2 * half), mu);
    const double c0 = -1.0 / 3 + eta * (1.0 / 12 + eta * (-2.0 / 135 + eta * (1.0 / 864
        + eta * (1.0 / 2835 + eta * (-139.0 / 777600 + eta * (1.0 / 25515
        + eta * -2.18544851067999198e-06))))));
    const double c1 = -1.0 / 540 + eta * (-1.0 / 288 + eta * (1.0 / 378 + eta * (-77.0 / 77760)));
    const double c2 = 25.0 / 6048 + eta * (-139.0 / 51840);
    const double rest = exp(-a * half) / sqrt(2 * M_PI * a) * (c0 + (c1 + c2 / a) / a);
    *lower = 0.5 * erfc(eta * sqrt(0.5 * a)) + rest;
    *upper = 0.5 * erfc(-eta * sqrt(0.5 * a)) - rest;
}

void poisson_tails(double k, double mean, double *lower, double *upper)
{
    if (mean > TEMME_MEAN && fabs(mean - k) < 0.09 * mean) {
        tails_uniform(k + 1, mean, lower, upper);
        return;
    }
    double sum = 0;
    if (k < mean) {                      /* the terms fall below k ... */
        double term = probability(k, mean);
        for (double j = k; term > sum * 1e-17; j--) {
            sum += term;
            term *= j / mean;
        }
        *lower = sum;
        *upper = 1 - sum;
    } else {                             /* ... or above it */
        double term = probability(k + 1, mean);
        for (double j = k + 2; term > sum * 1e-17; j++) {
            sum += term;
            term *= mean / j;
        }
        *upper = sum;
        *lower = 1 - sum;
    }
}

/* P(K <= k) >= u? */
static int reached(double k, double u, double mean)
{
    double lower, upper;
    poisson_tails(k, mean, &lower, &upper);
    return u <= 0.5 ? lower >= u : upper <= 1 - u;
}

/* The smallest k that is reached, from a guess, by doubling steps and bisection. */
static double search(double guess, double u, double mean)
{
    double lo, hi = guess > 0 ? floor(guess) : 0;    /* lo not reached, hi reached */
    double step = 1;
    if (reached(hi, u, mean)) {
        lo = hi - 1;
        while (lo >= 0 && reached(lo, u, mean)) {
            hi = lo;
            step *= 2;
            lo = hi - step;
        }
        if (lo < 0)
            lo = -1;
    } else {
        do {
            lo = hi;
            hi = lo + step;
            step *= 2;
        } while (!reached(hi, u, mean));
    }
    while (hi - lo > 1) {
        double mid = lo + floor(0.5 * (hi - lo));
        if (reached(mid, u, mean))
            hi = mid;
        else
            lo = mid;
    }
    return hi;
}

/* Eight doubles; the compiler splits them to what the processor has. */
typedef double v8 __attribute__((vector_size(64)));
typedef long long l8 __attribute__((vector_size(64)));

/* Draws of small means, eight by eight: terms p (at first e^-mean) are added until the sum reaches u. n is a multiple of LANES. */
WIDE static void sum_terms(int n, const double *u, const double *mean, const double *p, double *k)
{
    for (int i = 0; i < n; i += LANES) {
        const v8 goal = *(const v8 *)(u + i), m = *(const v8 *)(mean + i), one = (v8){0} + 1;
        v8 term = *(const v8 *)(p + i), sum = term, terms = {0};
        for (double j = 1, more = 1; more > 0;) {
            for (int step = 0; step < STEPS; step++, j++) {
                terms += (v8)((l8)one & (l8)(sum < goal));
                term *= m / j;
                sum += term;
            }
            more = 0;
            for (int lane = 0; lane < LANES; lane++)
                more += sum[lane] < goal[lane];
        }
        *(v8 *)(k + i) = terms;
    }
}

/* Is its draw made by sum_terms? */
static int is_small(double u, double mean)
{
    return mean >= 0 && mean < SERIES_LO && u > 0 && u < 0.999;
}

/* Draws of the small means of a block, -1 for others. Returns their number. */
static int inverse_small(int n, const double *u, const double *mean, double *k)
{
    __attribute__((aligned(64))) double goal[BLOCK], m[BLOCK], p[BLOCK], draw[BLOCK];
    int at[BLOCK], found = 0;
    for (int i = 0; i < n; i++) {
        k[i] = -1;
        if (is_small(u[i], mean[i])) {
            goal[found] = u[i];
            m[found] = mean[i];
            p[found] = exp(-mean[i]);
            at[found++] = i;
        }
    }
    int end = found;
    for (; end % LANES; end++)
        goal[end] = m[end] = p[end] = 0;
    sum_terms(end, goal, m, p, draw);
    for (int i = 0; i < found; i++)
        k[at[i]] = draw[i];
    return found;
}

/* The exact draw where the series cannot say, of other means. */
static double inverse_slow(double u, double mean)
{
    if (!(mean >= 0 && mean <= POISSON_MAX_MEAN && u > 0 && u < 1))
        return NAN;
    if (!(mean > 0))
        return 0;
    const double w = rng_normal_inverse(u), root = sqrt(mean);
    return search(mean + root * w + (2 + w * w) / 6 - w * (2 + w * w) / (72 * root), u, mean);
}

/*
 * Normal score of the middle 85 %: w = q R(0.180625 - q^2), q = u - 1/2, R a
 * least-squares rational of degree 5/5, relative error 2.2e-12.
 */
WIDE static void scores(int n, const double *restrict u, double *restrict w)
{
    for (int i = 0; i < n; i++) {
        const double q = u[i] - 0.5, r = 0.180625 - q * q;
        const double num = 3.38713287278891650e+00 + r * (9.16999498700310767e+01
            + r * (8.10590721581036746e+02 + r * (2.65802339935536111e+03
            + r * (2.68450910881852178e+03 + r * 3.81640295920347057e+02))));
        const double den = 1 + r * (3.00782872011297400e+01 + r * (3.07649714073768052e+02
            + r * (1.25413441109145515e+03 + r * (1.83002094621815218e+03
            + r * 6.18907816675256754e+02))));
        w[i] = q * num / den;
    }
}

/*
 * k = floor(y); sure = the distance of y from the nearest whole number minus the
 * bound on its error (<= 0 or NaN: the series does not decide); reach = s^2.
 * Coefficients: expansion in s of the equations above, rational numbers rounded.
 * Bound: twice the largest error found against the distribution on means
 * 8..1e6 and |s| <= 0.6 (tests/unit/test_poisson.c), plus rounding.
 */
WIDE static void series(int n, const double *restrict w, const double *restrict mean,
                        const double *restrict roots, double *restrict k, double *restrict sure,
                        double *restrict reach)
{
    for (int i = 0; i < n; i++) {
        const double m = mean[i], root = roots[i], inv = 1 / m, s = w[i] * root * inv;
        /* F(s) = 1 + s + s^2/6 + s^3 f: the large terms are added last. */
        const double f = -1.38888888888888881e-02 + s * (3.70370370370370385e-03
            + s * (-1.33101851851851849e-03 + s * (5.58495002939447403e-04
            + s * (-2.58051330099941223e-04 + s * (1.27376053301979240e-04
            + s * (-6.59805096181848391e-05 + s * (3.54587748277734532e-05
            + s * (-1.96169759744291864e-05 + s * (1.11105031848820911e-05
            + s * (-6.41582959177012736e-06 + s * 3.76565942391419047e-06))))))))));
        const double c0 = 1.0 / 3 + s * (-1.0 / 36 + s * (8.64197530864197448e-03
            + s * (-3.52366255144032905e-03 + s * (1.65343915343915335e-03
            + s * (-8.46004596969103192e-04 + s * (4.58771528730376446e-04
            + s * (-2.59278864080497305e-04 + s * (1.51099110108788513e-04
            + s * -9.01555305712325311e-05))))))));
        const double c1 = -1.97530864197530860e-02 + s * (1.72582304526748970e-02
            + s * (-1.27106603958455806e-02 + s * (9.00855229494632731e-03
            + s * (-6.32503755960546043e-03 + s * 4.43418210727077738e-03))));
        const double c2 = -6.27082108563590027e-04 + s * (1.87027102793563705e-03
            + s * -2.85097364658407201e-03);
        const double s2 = s * s;
        const double y = m + (root * w[i] + (m * s2 * (1.0 / 6 + s * f) + (c0 + inv * (c1 + inv * c2))));
        const double low = floor(y), part = y - low;
        const double error = 8e-3 * inv * inv * inv + 2e-3 * s2 * s2 * s2
            + 4e-15 * m + 1e-11 * root * fabs(w[i]);
        k[i] = low;
        sure[i] = 0.5 - fabs(part - 0.5) - error;
        reach[i] = s2;
    }
}

static void inverse_block(int n, const double *u, const double *mean, double *k)
{
    double w[BLOCK], root[BLOCK], guess[BLOCK], sure[BLOCK], reach[BLOCK], small[BLOCK];
    if (inverse_small(n, u, mean, small) == n) {
        memcpy(k, small, (size_t)n * sizeof *k);
        return;
    }
    scores(n, u, w);
    for (int i = 0; i < n; i++) {
        root[i] = sqrt(mean[i]);         /* here: a call that may set errno stops vectorisation */
        if (!(fabs(u[i] - 0.5) <= 0.425))
            w[i] = u[i] > 0 && u[i] < 1 ? rng_normal_inverse(u[i]) : NAN;
    }
    series(n, w, mean, root, guess, sure, reach);
    for (int i = 0; i < n; i++) {
        if (sure[i] > 0 && reach[i] <= SERIES_S * SERIES_S && mean[i] >= SERIES_LO && mean[i] <= SERIES_HI)
            k[i] = guess[i];
        else
            k[i] = small[i] < 0 ? inverse_slow(u[i], mean[i]) : small[i];
    }
}

void poisson_inverse_run(long n, const double *u, const double *mean, double *k)
{
    for (long i = 0; i < n; i += BLOCK) {
        long left = n - i;
        inverse_block((int)(left < BLOCK ? left : BLOCK), u + i, mean + i, k + i);
    }
}

double poisson_inverse(double u, double mean)
{
    double k;
    poisson_inverse_run(1, &u, &mean, &k);
    return k;
}
