/*
 * gaussians.h - sums of elliptical Gaussians and their exact shapelet
 * coefficients (no quadrature).
 *
 * With T = (S + beta^2 I)^-1, A = (S - beta^2 I) T, b = sqrt(2) beta T x0 for a
 * Gaussian of flux f, centre x0 and covariance S,
 *
 *   c_00 = f beta sqrt(det T / pi) exp(-x0' T x0 / 2),
 *   sqrt(n_i + 1) c_{n+e_i} = b_i c_n + sum_j A_ij sqrt(n_j) c_{n-e_j}
 *
 * in the order and normalisation of shapelet.h.  |A| < 1, so the recurrence is stable.
 */
#ifndef PIXSHEAR_GAUSSIANS_H
#define PIXSHEAR_GAUSSIANS_H

#include "err.h"

#define GAUSSIANS_MAX 72       /* Gaussians in a sum */
#define GAUSSIANS_NMAX 30      /* highest order projected */

/* Lengths in one unit u; the first n_central stand at the origin. */
struct gaussians {
    int n, n_central;
    double flux[GAUSSIANS_MAX];
    double x[GAUSSIANS_MAX], y[GAUSSIANS_MAX];
    double sxx[GAUSSIANS_MAX], sxy[GAUSSIANS_MAX], syy[GAUSSIANS_MAX];   /* u^2 */
};

/* Append; those at the origin are cheapest when they come first. Beyond GAUSSIANS_MAX: E_RANGE. */
MUST_CHECK int gaussians_add(struct gaussians *g, double flux, double x, double y, double sxx, double sxy, double syy);

/*
 * c = the (nmax+1)(nmax+2)/2 coefficients at scale beta, 0 <= nmax <=
 * GAUSSIANS_NMAX, beta > 0.  Rounding error about 1e-15 of the largest.
 */
MUST_CHECK int gaussians_project(const struct gaussians *g, int nmax, double beta, double *c);

/* Integral of the square of the sum, u^-2: what sum c^2 tends to for large nmax. */
double gaussians_power(const struct gaussians *g);

#endif
