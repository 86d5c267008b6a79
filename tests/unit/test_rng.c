/* test_rng.c - known answers, same bits by every path, statistics of the streams. */
#include "rng.h"
#include "check.h"
#include <gsl/gsl_cdf.h>
#include <stdlib.h>
#include <string.h>

/* Random123's published answers for philox4x32-10 (Salmon et al. 2011). */
static void known_answers(void)
{
    static const uint32_t in[3][6] = {
        {0, 0, 0, 0, 0, 0},
        {~0u, ~0u, ~0u, ~0u, ~0u, ~0u},
        {0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344, 0xa4093822, 0x299f31d0},
    };
    static const uint32_t want[3][4] = {
        {0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8},
        {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd},
        {0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1},
    };
    for (int i = 0; i < 3; i++) {
        uint32_t got[4];
        rng_philox(in[i], in[i] + 4, got);
        check_that(!memcmp(got, want[i], sizeof got), "philox4x32-10 known answer %d", i);
    }
}

/* The vectorised run gives the bits of single draws, for every phase and length. */
static void runs(void)
{
    struct rng r = rng_stream(7, 3, RNG_SHOT);
    double u[700];
    long bad = 0, n = 0;
    for (uint64_t start = 0; start < 5; start++)
        for (long len = 0; len <= 600; len += len < 140 ? 1 : 77) {
            u[len] = -1;
            rng_uniform_run(&r, (start << 40) + start, 2, len, u);
            for (long i = 0; i < len; i++, n++)
                bad += u[i] != rng_uniform(&r, (start << 40) + start + (uint64_t)i, 2);
            bad += u[len] != -1;
        }
    check_that(bad == 0 && n > 10000, "runs equal single draws: %ld of %ld differ", bad, n);
}

/* chi-square of 256 cells, serial correlation and correlation between neighbouring seeds. */
static void uniformity(void)
{
    enum { N = 1 << 20 };
    double *u = malloc(N * sizeof *u), *v = malloc(N * sizeof *v);
    struct rng a = rng_stream(1, 0, RNG_TEST), b = rng_stream(2, 0, RNG_TEST);
    rng_uniform_run(&a, 0, 0, N, u);
    rng_uniform_run(&b, 0, 0, N, v);
    long cell[256] = {0};
    double serial = 0, cross = 0, low = 1, high = 0;
    for (int i = 0; i < N; i++) {
        cell[(int)(u[i] * 256)]++;
        serial += (u[i] - 0.5) * (u[(i + 1) % N] - 0.5);
        cross += (u[i] - 0.5) * (v[i] - 0.5);
        low = fmin(low, u[i]);
        high = fmax(high, u[i]);
    }
    double chi2 = 0, e = N / 256.0;
    for (int i = 0; i < 256; i++)
        chi2 += ((double)cell[i] - e) * ((double)cell[i] - e) / e;
    double p = gsl_cdf_chisq_Q(chi2, 255);
    check_that(p > 1e-3 && p < 1 - 1e-3, "2^20 uniforms in 256 cells: chi2 %.1f, p %.3f", chi2, p);
    check_that(fabs(serial) * 12 / sqrt(N) < 4, "serial correlation %.2f sigma", serial * 12 / sqrt(N));
    check_that(fabs(cross) * 12 / sqrt(N) < 4, "correlation of seeds 1 and 2: %.2f sigma", cross * 12 / sqrt(N));
    check_that(low > 0 && high < 1, "open interval: %.3g .. 1 - %.3g", low, 1 - high);
    free(u);
    free(v);
}

static void normal(void)
{
    /* the C library's erfc is the reference: p(z(p)) = p.  An error of z by eps gives z^2 eps in p;
     * log, sqrt, the rational function and z / sqrt(2) round about five times */
    struct check c = check_begin("normal inverse: erfc gives p back, 1e-300 to 1 - 1e-15");
    for (double p = 1e-300; p < 0.5; p *= 1.7) {
        double z = rng_normal_inverse(p), y = rng_normal_inverse(1 - p);
        check_close(&c, 0.5 * erfc(-z / sqrt(2)), p, p * (1 + z * z) * 1.1e-15);
        if (p > 1e-15)
            check_close(&c, 0.5 * erfc(y / sqrt(2)), 1 - (1 - p), p * (1 + y * y) * 1.1e-15);
    }
    check_end(&c);
    struct rng r = rng_stream(5, 0, RNG_TEST);
    enum { N = 200000 };
    double s1 = 0, s2 = 0, s4 = 0;
    for (uint64_t i = 0; i < N; i++) {
        double z = rng_normal(&r, i, 0);
        s1 += z;
        s2 += z * z;
        s4 += z * z * z * z;
    }
    check_that(fabs(s1) / sqrt(N) < 4, "normal mean: %.2f sigma", s1 / sqrt(N));
    check_that(fabs(s2 / N - 1) < 4 * sqrt(2.0 / N), "normal variance %.5f", s2 / N);
    check_that(fabs(s4 / N - 3) < 4 * sqrt(96.0 / N), "normal fourth moment %.4f", s4 / N);
}

/* Standard score of a chi-square (Wilson and Hilferty). */
static double score(double chi, double dof)
{
    return (cbrt(chi / dof) - 1 + 2 / (9 * dof)) / sqrt(2 / (9 * dof));
}

/* n draws, made as read noise is, in cells of 0.05 sigma with 20 or more expected; *mean: score of their mean. */
static double normal_cells(uint32_t exposure, long n, double *mean)
{
    enum { CELLS = 280, RUN = 1024 };
    static double u[RUN];
    const struct rng r = rng_stream(9, exposure, RNG_READ);
    long cell[CELLS] = {0}, dof = -1;
    double sum = 0, chi = 0, want = 0, seen = 0;
    for (long i = 0; i < n; i += RUN) {
        const int m = n - i < RUN ? (int)(n - i) : RUN;
        rng_uniform_run(&r, (uint64_t)i, 0, m, u);
        for (int k = 0; k < m; k++) {
            const double z = rng_normal_inverse(u[k]);
            sum += z;
            cell[(int)floor(fmax(-6.99, fmin(6.99, z)) * 20) + CELLS / 2]++;
        }
    }
    for (int k = 0; k < CELLS; k++) {
        const double lo = (k - CELLS / 2) / 20.0, hi = lo + 0.05;
        want += (double)n * (lo < 0 ? 0.5 * (erfc(-hi / sqrt(2)) - erfc(-lo / sqrt(2))) : 0.5 * (erfc(lo / sqrt(2)) - erfc(hi / sqrt(2))));
        seen += (double)cell[k];
        if (want >= 20) {
            chi += (seen - want) * (seen - want) / want;
            dof++;
            want = seen = 0;
        }
    }
    *mean = sum / sqrt((double)n);
    return score(chi, (double)dof);
}

static void normal_statistics(long n)
{
    struct check c = check_begin("chi-square of many normal draws in 12 streams (z-score, limit 4.5)");
    struct check d = check_begin("their mean (z-score, limit 4.5)");
    for (uint32_t i = 0; i < 12; i++) {
        double mean, z = normal_cells(i, n, &mean);
        check_close(&c, z, 0, 4.5);
        check_close(&d, mean, 0, 4.5);
    }
    check_end(&c);
    check_end(&d);
}

int main(void)
{
    const char *large = getenv("NORMAL_DRAWS");
    known_answers();
    runs();
    uniformity();
    normal();
    normal_statistics(large ? atol(large) : 200000);
    return check_status();
}
