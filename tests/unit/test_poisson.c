/*
 * test_poisson.c - against quantiles and tails summed with 60 decimal digits
 * (the exact sums of e^-m m^j/j!), GSL's incomplete gamma functions, and the
 * statistics of many draws.
 */
#include "check.h"
#include "poisson.h"
#include "rng.h"
#include <gsl/gsl_cdf.h>
#include <gsl/gsl_randist.h>
#include <stdlib.h>
#include <string.h>

enum { NU = 11 };

/* 2^-53, 1e-12, 1e-5, .01, .3, .5, .75, .999, 1-1e-7, 1-1e-12, 1-2^-53 */
static const double levels[NU] = {0x1p-53, 1e-12, 1e-5, 0.01, 0.3, 0.5, 0.75, 0.999,
                                  1 - 1e-7, 1 - 1e-12, 1 - 0x1p-53};
static const struct { double mean; double k[NU]; } quantiles[] = {
    {1e-30, {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}},
    {1e-09, {0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1}},
    {0.01, {0, 0, 0, 0, 0, 0, 0, 1, 3, 4, 6}},
    {0.7, {0, 0, 0, 0, 0, 1, 1, 4, 8, 12, 15}},
    {3.5, {0, 0, 0, 0, 2, 3, 5, 11, 17, 23, 28}},
    {7.999, {0, 0, 0, 2, 6, 8, 10, 18, 27, 35, 41}},
    {8.001, {0, 0, 0, 2, 6, 8, 10, 18, 27, 35, 41}},
    {12.25, {0, 0, 1, 5, 10, 12, 15, 24, 34, 44, 51}},
    {30, {0, 1, 10, 18, 27, 30, 34, 48, 63, 76, 85}},
    {68.5, {13, 19, 36, 50, 64, 68, 74, 95, 116, 134, 147}},
    {428, {270, 291, 343, 381, 417, 428, 442, 493, 540, 581, 609}},
    {1000.0, {752, 786, 868, 927, 983, 1000, 1021, 1099, 1169, 1230, 1270}},
    {9999.5, {9190, 9304, 9576, 9768, 9947, 9999, 10067, 10310, 10524, 10711, 10831}},
    {10000.5, {9191, 9305, 9577, 9769, 9948, 10000, 10068, 10311, 10525, 10712, 10832}},
    {100000.0, {97415, 97784, 98654, 99265, 99834, 100000, 100213, 100979, 101649, 102233, 102607}},
    {1000000.0, {991802, 992974, 995738, 997674, 999475, 1000000, 1000674, 1003092, 1005204, 1007043, 1008221}},
    {16777216.0, {16743601, 16748411, 16759750, 16767688, 16775068, 16777216, 16779979, 16789875, 16798517, 16806037, 16810853}},
    {1000000000.0, {999740403, 999777558, 999865135, 999926435, 999983417, 1000000000, 1000021329, 1000097723, 1000164422, 1000222458, 1000259619}},
};
static const struct { double k, mean, lower, upper; } tails[] = {
    {0, 3.5, 3.01973834223185008674e-02, 9.69802616577681519949e-01},
    {20, 3.5, 9.99999999813081630329e-01, 1.86918362017848292944e-10},
    {2, 30, 4.50101664801212381795e-11, 9.99999999954989782225e-01},
    {60, 30, 9.99999551535978192796e-01, 4.48464021800268001717e-07},
    {300, 428, 3.85487935890375952922e-11, 9.99999999961451169206e-01},
    {560, 428, 9.99999999527330096782e-01, 4.72669885436750005755e-10},
    {9200, 9999.5, 2.77917024772206682007e-16, 9.99999999999999666933e-01},
    {10800, 10000.5, 9.99999999999998556710e-01, 1.41489164615284497670e-15},
    {9300, 10000.5, 7.09023916794276927588e-13, 9.99999999999291011576e-01},
    {10000, 10000.5, 5.00664894750515565569e-01, 4.99335105249484489942e-01},
    {992000, 1000000, 5.73382974357413053671e-16, 9.99999999999999444888e-01},
    {1000000, 1000000, 5.00265961486283661230e-01, 4.99734038513716338770e-01},
    {1008000, 1000000, 9.99999999999999333866e-01, 6.74508535668813784808e-16},
};

static void exact_values(void)
{
    struct check c = check_begin("quantiles of 18 means at 11 levels, 60-digit sums");
    for (size_t i = 0; i < sizeof quantiles / sizeof *quantiles; i++)
        for (int j = 0; j < NU; j++)
            check_close(&c, poisson_inverse(levels[j], quantiles[i].mean), quantiles[i].k[j], 1e-9);
    check_end(&c);
    struct check d = check_begin("smaller tail, relative");
    for (size_t i = 0; i < sizeof tails / sizeof *tails; i++) {
        double lo, up;
        poisson_tails(tails[i].k, tails[i].mean, &lo, &up);
        int low = tails[i].k < tails[i].mean;
        check_close(&d, low ? lo : up, low ? tails[i].lower : tails[i].upper,
                    2e-13 * (low ? tails[i].lower : tails[i].upper));
    }
    check_end(&d);
    check_that(isnan(poisson_inverse(0.5, -1)) && isnan(poisson_inverse(0.5, NAN))
               && isnan(poisson_inverse(0.5, INFINITY)) && isnan(poisson_inverse(0, 3))
               && isnan(poisson_inverse(1, 3)) && isnan(poisson_inverse(NAN, 3)),
               "impossible means and levels give NaN");
    check_that(poisson_inverse(1 - 0x1p-53, 0) == 0, "mean 0 draws 0");
}

/* Every draw satisfies the definition, by GSL; draws close to a tie are counted apart. */
static void definition(void)
{
    const struct rng r = rng_stream(5, 0, RNG_TEST);
    long wrong = 0, ties = 0, n = 0;
    for (int i = 0; i < 60000; i++) {
        double mean = exp(log(1e-3) + rng_uniform(&r, (uint64_t)i, 0) * log(1e3 / 1e-3));
        double u = rng_uniform(&r, (uint64_t)i, 1), k = poisson_inverse(u, mean);
        double at = gsl_cdf_poisson_P((unsigned)k, mean), below = k > 0 ? gsl_cdf_poisson_P((unsigned)k - 1, mean) : 0;
        ties += fabs(at - u) < 1e-12 || fabs(below - u) < 1e-12;
        wrong += !(at >= u - 1e-12 && below < u + 1e-12);
        n++;
    }
    check_that(wrong == 0 && ties < 5, "definition holds in %ld draws of means 1e-3..1e3 (%ld ties)", n, ties);
}

/*
 * The series with its bound: at the levels where the distribution steps (the
 * worst place for floor), a little above and below.
 */
static void at_steps(void)
{
    const double means[] = {8, 8.5, 9, 10, 12, 15, 20, 30, 47.3, 68, 107, 200, 428, 1000, 3000, 1e4, 1e5, 1e6};
    long wrong = 0, n = 0;
    for (size_t i = 0; i < sizeof means / sizeof *means; i++) {
        double m = means[i], root = sqrt(m);
        for (double z = -6; z <= 6; z += 0.05) {
            double k = floor(m + z * root), lo, up;
            if (k < 0)
                continue;
            poisson_tails(k, m, &lo, &up);
            double p = lo < 0.5 ? lo : 1 - up, e = 1e-8 * (lo < up ? lo : up);
            if (!(p - e > 0 && p + e < 1 && p + e > p && p - e < p))
                continue;
            wrong += poisson_inverse(p - e, m) != k;
            wrong += poisson_inverse(p + e, m) != k + 1;
            n += 2;
        }
    }
    check_that(wrong == 0 && n > 5000, "both sides of %ld steps of the distribution, 1e-8 apart", n);
}

static void large_means(void)
{
    const struct rng r = rng_stream(6, 0, RNG_TEST);
    const double means[] = {1e9, 1e11, 9.9e11, 1.01e12, 1e13, 1e15};
    struct check c = check_begin("means 1e9..1e15 against the Cornish-Fisher series in long double, in steps");
    for (size_t i = 0; i < sizeof means / sizeof *means; i++)
        for (int j = 0; j < 300; j++) {
            double u = rng_uniform(&r, (uint64_t)j, (uint32_t)i), w = rng_normal_inverse(u);
            long double root = sqrtl((long double)means[i]);
            long double y = means[i] + root * w + (2 + (long double)w * w) / 6 - w * (2 + (long double)w * w) / (72 * root);
            /* the score itself is known to some 1e-15 relative */
            check_close(&c, poisson_inverse(u, means[i]), (double)(y - 0.5L),
                        0.501 + (double)root * fabs(w) * 4e-15 + means[i] * 2.3e-16);
        }
    check_end(&c);
}

/* For one u the draw never falls when the mean rises, over every switch of method. */
static void monotone(void)
{
    const struct rng r = rng_stream(7, 0, RNG_TEST);
    long falls = 0, n = 0;
    for (int j = 0; j < 200; j++) {
        double u = rng_uniform(&r, (uint64_t)j, 0), last = 0;
        if (j < 20)
            u = j < 10 ? exp2(-4 * j - 3) : 1 - exp2(-4 * (j - 10) - 3);
        for (double mean = 1e-6; mean < 1e6; mean *= 1.013, n++) {
            double k = poisson_inverse(u, mean);
            falls += !(k >= last);
            last = k;
        }
        for (double mean = 7.99; mean < 8.01; mean += 1e-4, n++)
            falls += poisson_inverse(u, mean) > poisson_inverse(u, mean + 1e-4);
        for (double mean = 9999; mean < 10001; mean += 0.01, n++)
            falls += poisson_inverse(u, mean) > poisson_inverse(u, mean + 0.01);
    }
    check_that(falls == 0, "monotone in the mean: %ld pairs", n);
}

/* Chi-square of n draws, cells with an expectation of at least 20; z-score by Wilson and Hilferty. */
static double chi_square(double mean, long n, uint32_t index, double *draw_mean)
{
    enum { CELLS = 4096 };
    static double count[CELLS], u[4096], m[4096], k[4096];
    memset(count, 0, sizeof count);
    const struct rng r = rng_stream(11, 0, RNG_TEST);
    const double base = floor(fmax(0, mean - 9 * sqrt(mean) - 10)), width = ceil((18 * sqrt(mean) + 40) / CELLS);
    double total = 0;
    for (long i = 0; i < n; i += 4096) {
        long here = n - i < 4096 ? n - i : 4096;
        rng_uniform_run(&r, (uint64_t)i, index, here, u);
        for (long j = 0; j < here; j++)
            m[j] = mean;
        poisson_inverse_run(here, u, m, k);
        for (long j = 0; j < here; j++) {
            total += k[j] - mean;
            count[(int)fmin(fmax((k[j] - base) / width, 0), CELLS - 1)]++;
        }
    }
    *draw_mean = total / (double)n / sqrt(mean / (double)n);
    double chi = 0, seen = 0, want = 0, done = 0;
    int cells = 0;
    for (int i = 0; i < CELLS; i++) {
        double lo = i ? gsl_cdf_poisson_P((unsigned)(base + i * width - 1), mean) : 0;
        double hi = i < CELLS - 1 ? gsl_cdf_poisson_P((unsigned)(base + (i + 1) * width - 1), mean) : 1;
        seen += count[i];
        want += (hi - lo) * (double)n;
        if ((want >= 20 && (double)n - done - want >= 20) || i == CELLS - 1) {
            if (want > 0)
                chi += (seen - want) * (seen - want) / want;
            cells++;
            done += want;
            seen = want = 0;
        }
    }
    double dof = cells - 1;
    return dof < 1 ? 0 : (cbrt(chi / dof) - 1 + 2 / (9 * dof)) / sqrt(2 / (9 * dof));
}

static void statistics(long n)
{
    const double means[] = {0.01, 0.5, 3, 7.9, 8.1, 12, 30, 97, 428, 3000, 2e4, 1e6};
    struct check c = check_begin("chi-square of many draws at 12 means (z-score, limit 4.5)");
    struct check d = check_begin("their mean (z-score, limit 4.5)");
    for (uint32_t i = 0; i < sizeof means / sizeof *means; i++) {
        double z_mean, z = chi_square(means[i], n, i, &z_mean);
        check_close(&c, z, 0, 4.5);
        check_close(&d, z_mean, 0, 4.5);
    }
    check_end(&c);
    check_end(&d);
}

/*
 * Two fields whose means differ by d: the draws differ by a whole number of
 * mean d, so their difference has a variance of at least f(1-f), f = d's
 * fraction; the stretch of the distribution adds d^2/4m and E|stretch|.
 */
static void coupling(void)
{
    static const struct { double m, d; } pairs[] = {{428, 2}, {428, 0.3}, {68, 0.5}, {97, 1}, {5000, 10}, {4, 0.2}};
    const struct rng r = rng_stream(3, 0, RNG_TEST);
    enum { N = 200000 };
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
        double m = pairs[i].m, d = pairs[i].d, s = 0, ss = 0;
        for (int j = 0; j < N; j++) {
            double u = rng_uniform(&r, (uint64_t)j, 0);
            double diff = poisson_inverse(u, m + d) - poisson_inverse(u, m) - d;
            s += diff;
            ss += diff * diff;
        }
        double var = ss / N - s * s / N / N, f = d - floor(d), stretch = d / (2 * sqrt(m));
        double bound = f * (1 - f) + stretch * stretch + 0.8 * stretch;
        check_that(var <= 1.02 * bound && var >= 0.9 * f * (1 - f),
                   "coupling at mean %g, +%g: residual variance %.4f (%.4f %% of the mean), bound %.4f",
                   m, d, var, 100 * var / m, bound);
    }
}

/* Runs of means small, large and mixed, and of none, in place: as one by one. */
static void runs(void)
{
    enum { N = 5000 };
    static double u[N], k[N];
    const struct rng r = rng_stream(12, 0, RNG_TEST);
    const double lo[] = {1e-3, 1e-3, 4, 20}, hi[] = {7.9, 1e3, 16, 900};
    size_t wrong = 0;
    for (int kind = 0; kind < 4; kind++) {
        double *v = k;
        double mean[N];
        for (int i = 0; i < N; i++) {
            u[i] = i % 997 == 5 ? 1 - 1e-6 : i % 991 == 7 ? 0.9990000001 : i % 1009 == 9 ? NAN : rng_uniform(&r, (uint64_t)(N * kind + i), 0);
            mean[i] = v[i] = i % 883 == 3 ? 0 : i % 887 == 4 ? -1 : exp(log(lo[kind]) + rng_uniform(&r, (uint64_t)(N * kind + i), 1) * log(hi[kind] / lo[kind]));
        }
        poisson_inverse_run(N, u, v, v);
        for (int i = 0; i < N; i++) {
            const double one = poisson_inverse(u[i], mean[i]);
            wrong += !(v[i] == one || (isnan(v[i]) && isnan(one)));
        }
    }
    check_that(wrong == 0, "20000 draws in runs, small, large and mixed means, in place: as one by one (%zu differ)", wrong);
}

int main(void)
{
    const char *large = getenv("POISSON_DRAWS");
    runs();
    exact_values();
    definition();
    at_steps();
    large_means();
    monotone();
    statistics(large ? atol(large) : 1000000);
    coupling();
    return check_status();
}
