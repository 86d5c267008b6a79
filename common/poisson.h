/*
 * poisson.h - Poisson numbers as the exact inverse of the distribution.
 *
 * The draw for a uniform u is the smallest k with sum_{j<=k} e^-m m^j/j! >= u.
 * It is exact (not a normal approximation at any mean) and, for one u, never
 * falls when the mean rises: images whose means differ little share their noise.
 */
#ifndef PIXSHEAR_POISSON_H
#define PIXSHEAR_POISSON_H

#define POISSON_MAX_MEAN 1e15

/*
 * The quantile of u, 0 < u < 1, for a mean of 0..1e15; NaN for any other
 * mean.  For u > 1/2 the upper tail 1 - u decides, so both tails are as
 * exact as u itself.
 */
double poisson_inverse(double u, double mean);

/* k[i] = poisson_inverse(u[i], mean[i]) for 0 <= i < n, same bits, vectorised. k may be mean. */
void poisson_inverse_run(long n, const double *u, const double *mean, double *k);

/*
 * P(K <= k) and P(K > k), k a whole number >= 0, mean > 0.  Relative error of
 * the smaller one below 2e-13 for means to 1e6 and tails above 1e-17.
 */
void poisson_tails(double k, double mean, double *lower, double *upper);

#endif
