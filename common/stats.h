/*
 * stats.h - means, spreads, shapes of distributions, straight lines, and errors
 * by leaving out and by drawing again.
 *
 * Quantities that need more values than there are come out as NaN, never as
 * 0/0: a program writes them as "undefined".
 */
#ifndef PIXSHEAR_STATS_H
#define PIXSHEAR_STATS_H

#include "err.h"
#include <stddef.h>
#include <stdint.h>

struct stats {
    size_t n;
    double mean;              /* n >= 1 */
    double var;               /* sum (x - mean)^2 / (n - 1); n >= 2 */
    double skew, skew_err;    /* mu3/mu2^1.5; n >= 3 and var > 0 */
    double kurt, kurt_err;    /* mu4/mu2^2 - 3; n >= 4 and var > 0 */
};

/*
 * Two passes with compensated sums: 1e7 values offset by 1e6 sigma keep 1e-9.
 * skew_err, kurt_err are sqrt(6/n), sqrt(24/n), right for normal values.
 */
void stats_sum(size_t n, const double *x, struct stats *out);

/* Median; x is reordered; NaN for n = 0. No NaN among the values. */
double stats_median(size_t n, double *x);

/* Compensated sum (Neumaier): start with {0}. */
struct sum {
    double s, c;
};
void sum_add(struct sum *s, double x);
double sum_value(const struct sum *s);

struct line_fit {
    size_t n;
    double a, se_a;           /* y = a + b x */
    double b, se_b;
    double chi2;              /* sum ((y - a - b x)/s)^2 */
    long dof;                 /* n - 2 */
};

/*
 * Weighted straight line through n points with standard errors s of y
 * (NULL: all 1, errors from the scatter).  E_RANGE with n < 2 or an s <= 0,
 * E_SINGULAR when all x are equal; out is NaN then.
 */
MUST_CHECK int stats_line(size_t n, const double *x, const double *y, const double *s, struct line_fit *out);

struct ratio {
    size_t n;
    double value;             /* sum a / sum b */
    double se;                /* sd(a - value b) / (sqrt(n) |mean b|) */
    double jackknife;         /* leaving out one pair at a time */
    double bootstrap;         /* `draws` resamplings, seed */
};

/*
 * Ratio of means of n pairs with three errors.  b NULL means 1.  E_RANGE with
 * n < 2, E_SINGULAR when sum b = 0; out is NaN then.
 */
MUST_CHECK int stats_ratio(size_t n, const double *a, const double *b, long draws, uint64_t seed, struct ratio *out);

/*
 * index[i], i < m, of resampling `draw`: numbers in 0..n-1 with replacement; the
 * same for the same seed, whatever was drawn before.  n > 0.
 */
void stats_resample(size_t n, size_t m, uint64_t seed, uint64_t draw, uint32_t *index);

#endif
