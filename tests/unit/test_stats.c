/* test_stats.c - moments of large offset samples, line fits, resampling. */
#include "check.h"
#include "rng.h"
#include "stats.h"
#include <stdlib.h>

/* Exact moments of the values -1 (p n times) and +1, shifted and scaled. */
static void offset(void)
{
    size_t n = 10000000;
    double *x = malloc(n * sizeof *x);
    struct stats s;
    if (!x)
        return;
    /* a quarter at 2, three quarters at -1..: mean 0.25 a + .75 b, closed forms */
    for (size_t i = 0; i < n; i++)
        x[i] = 1e6 + (i % 4 == 0 ? 3 : -1);
    stats_sum(n, x, &s);
    struct check c = check_begin("1e7 values offset by 1e6: mean, variance, skewness, kurtosis of a two-valued sample");
    double p = 0.25, m2 = 16 * p * (1 - p);
    check_close(&c, s.mean, 1e6, 1e-9);
    check_close(&c, s.var, m2 * 1e7 / (1e7 - 1), 1e-11);
    check_close(&c, s.skew, (1 - 2 * p) / sqrt(p * (1 - p)), 1e-11);
    check_close(&c, s.kurt, (1 - 6 * p * (1 - p)) / (p * (1 - p)), 1e-11);
    check_close(&c, s.kurt_err, sqrt(24e-7), 1e-15);
    check_end(&c);
    struct rng r = rng_stream(31, 0, RNG_TEST);
    for (size_t i = 0; i < 1000000; i++)
        x[i] = 1e6 + rng_normal(&r, i, 0);
    stats_sum(1000000, x, &s);
    c = check_begin("1e6 normal values offset by 1e6: within 5 standard errors of 0, 1, 0, 0");
    check_close(&c, s.mean, 1e6, 5e-3);
    check_close(&c, s.var, 1, 5 * sqrt(2e-6));
    check_close(&c, s.skew, 0, 5 * s.skew_err);
    check_close(&c, s.kurt, 0, 5 * s.kurt_err);
    check_end(&c);
    free(x);
}

static void few(void)
{
    struct stats s;
    double x[4] = {2, 2, 2, 2};
    stats_sum(0, x, &s);
    check_that(isnan(s.mean) && isnan(s.var) && isnan(s.skew) && isnan(s.kurt), "no value: everything undefined");
    stats_sum(1, x, &s);
    check_that(s.mean == 2 && isnan(s.var) && isnan(s.skew), "one value: a mean only");
    stats_sum(4, x, &s);
    check_that(s.var == 0 && isnan(s.skew) && isnan(s.kurt), "equal values: variance 0, no skewness");
    double y[3] = {1, 2, 4};
    stats_sum(3, y, &s);
    check_that(isfinite(s.skew) && isnan(s.kurt), "three values: skewness, no kurtosis");
}

static void medians(void)
{
    struct rng r = rng_stream(32, 0, RNG_TEST);
    struct check c = check_begin("median: half below, half above, 500 random samples with ties");
    for (uint32_t t = 0; t < 500; t++) {
        double x[60], y[60];
        size_t n = 1 + (size_t)(58 * rng_uniform(&r, t, 0)), below = 0, above = 0;
        for (size_t i = 0; i < n; i++)
            x[i] = y[i] = t % 3 ? floor(10 * rng_uniform(&r, t, (uint32_t)i + 1)) : rng_uniform(&r, t, (uint32_t)i + 1);
        double m = stats_median(n, x);
        for (size_t i = 0; i < n; i++) {
            below += y[i] < m;
            above += y[i] > m;
        }
        check_close(&c, 2 * below <= n && 2 * above <= n, 1, 0.1);
    }
    check_close(&c, isnan(stats_median(0, NULL)), 1, 0.1);
    double four[4] = {4, 1, 3, 2};
    check_close(&c, stats_median(4, four), 2.5, 1e-15);
    check_end(&c);
}

static void lines(void)
{
    static const double g[9] = {-.05, -.025, 0, .025, .05, 0, 0, 0, 0};
    double s[9], y[9];
    struct line_fit f;
    for (int i = 0; i < 9; i++) {
        s[i] = 0.01;
        y[i] = 0.003 + 0.8 * g[i];
    }
    struct check c = check_begin("nine shears: exact line, SE(b) = 12.65 s");
    check_close(&c, stats_line(9, g, y, s, &f), OK, 0.1);
    check_close(&c, f.b, 0.8, 1e-13);
    check_close(&c, f.a, 0.003, 1e-15);
    check_close(&c, f.se_b / 0.01, 1 / sqrt(6.25e-3), 1e-9);
    check_close(&c, f.se_a / 0.01, 1 / 3., 1e-9);
    check_close(&c, f.chi2, 0, 1e-20);
    check_close(&c, (double)f.dof, 7, 0.1);
    check_end(&c);

    /* scatter of fits to 4000 noisy realisations against the formulas */
    enum { M = 4000 };
    struct rng r = rng_stream(33, 0, RNG_TEST);
    double sb = 0, qb = 0, sa = 0, qa = 0, chi = 0;
    for (int i = 0; i < 9; i++)
        s[i] = 0.002 * (1 + i);
    for (uint32_t t = 0; t < M; t++) {
        for (int i = 0; i < 9; i++)
            y[i] = 0.003 + 0.8 * g[i] + s[i] * rng_normal(&r, t, (uint32_t)i);
        if (stats_line(9, g, y, s, &f))
            check_that(0, "fit");
        sb += f.b;
        qb += f.b * f.b;
        sa += f.a;
        qa += f.a * f.a;
        chi += f.chi2;
    }
    c = check_begin("errors of the fit against 4000 noise realisations (each known to 1.1 %; 5 sigma)");
    check_close(&c, sqrt(qb / M - sb / M * sb / M) / f.se_b, 1, 0.056);
    check_close(&c, sqrt(qa / M - sa / M * sa / M) / f.se_a, 1, 0.056);
    check_close(&c, chi / M, 7, 5 * sqrt(14. / M));
    check_end(&c);

    static const double at[4] = {0, 1, 2, 3}, value[4] = {0, 1, 2, 4};     /* residuals .2 -.1 -.4 .3 about -.2 + 1.3 x */
    c = check_begin("four points without errors: theirs is the scatter, sqrt(0.3/2)");
    check_close(&c, stats_line(4, at, value, NULL, &f), OK, 0.1);
    check_close(&c, f.b, 1.3, 1e-14);
    check_close(&c, f.a, -0.2, 1e-14);
    check_close(&c, f.chi2, 0.3, 1e-14);
    check_close(&c, f.se_b, sqrt(0.15 / 5), 1e-14);
    check_close(&c, f.se_a, sqrt(0.15 * (1 / 4. + 1.5 * 1.5 / 5)), 1e-14);
    check_end(&c);

    double x[3] = {1, 1, 1};
    check_that(stats_line(3, x, y, NULL, &f) == E_SINGULAR && isnan(f.b), "all-equal shears: no slope");
    check_that(stats_line(1, g, y, s, &f) == E_RANGE && isnan(f.b), "one point: no slope");
    s[0] = 0;
    check_that(stats_line(9, g, y, s, &f) == E_RANGE, "zero error: refused");
    double off[3] = {1e6, 1e6 + 1, 1e6 + 2}, z[3] = {1, 3, 5};
    c = check_begin("abscissae offset by 1e6");
    check_close(&c, stats_line(3, off, z, NULL, &f), OK, 0.1);
    check_close(&c, f.b, 2, 1e-12);
    check_end(&c);
}

static void ratios(void)
{
    enum { N = 400, M = 400 };
    struct rng r = rng_stream(34, 0, RNG_TEST);
    double a[N], b[N], s = 0, q = 0, se = 0, jk = 0;
    struct ratio f;
    for (uint32_t t = 0; t < M; t++) {
        for (uint32_t i = 0; i < N; i++) {
            b[i] = 1.3 + 0.4 * rng_normal(&r, t, 2 * i);
            a[i] = 1.05 * b[i] + 0.2 * rng_normal(&r, t, 2 * i + 1);
        }
        if (stats_ratio(N, a, b, 0, 1, &f))
            check_that(0, "ratio");
        s += f.value;
        q += f.value * f.value;
        se += f.se / M;
        jk += f.jackknife / M;
    }
    double spread = sqrt(q / M - s / M * s / M);
    struct check c = check_begin("ratio: its errors against 400 realisations (known to 3.5 %; 4 sigma)");
    check_close(&c, se / spread, 1, 0.14);
    check_close(&c, jk / spread, 1, 0.14);
    check_close(&c, s / M, 1.05, 5 * spread / 20);
    if (stats_ratio(N, a, b, 1000, 7, &f))
        check_that(0, "ratio");
    check_close(&c, f.bootstrap / f.se, 1, 0.15);
    check_close(&c, f.jackknife / f.se, 1, 0.05);
    check_end(&c);
    struct ratio again;
    check_that(stats_ratio(N, a, b, 1000, 7, &again) == OK && again.bootstrap == f.bootstrap, "same seed, same bootstrap");
    check_that(stats_ratio(N, a, b, 1000, 8, &again) == OK && again.bootstrap != f.bootstrap, "another seed, another bootstrap");
    check_that(stats_ratio(1, a, b, 10, 1, &f) == E_RANGE && isnan(f.value), "one pair: undefined");
    double zero[2] = {1, -1};
    check_that(stats_ratio(2, a, zero, 10, 1, &f) == E_SINGULAR && isnan(f.value), "denominators that cancel: undefined");
}

int main(void)
{
    offset();
    few();
    medians();
    lines();
    ratios();
    return check_status();
}
