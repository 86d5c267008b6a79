/*
 * sersic.h - Sersic profiles as mixtures of Gaussians.
 *
 * exp(-b (r/RE)^(1/n)), n >= 1/2, is exactly a mixture of Gaussians: exp(-s^a), a = 1/(2n), is the Laplace
 * transform of the one-sided stable law of index a, s = b^(2n) (r/RE)^2.  The integral over its ln t is a trapezium
 * rule in y, y = x + asinh(x / w), x = ln t - centre, w of the order of the law's width: even steps in ln sigma where
 * the law is wide, finer ones where it is narrow (n near 1/2).  The error falls exponentially with the step,
 * which follows from the accuracy asked for: 16 to 45 Gaussians for 1e-4 of the peak, 25 to 80 for 1e-7.
 * ln flux and ln sigma of each are Chebyshev polynomials in ln(n - 1/2), made when a profile of that range of n is
 * first asked for.  From n = 1/2 to SERSIC_NARROW the mixture is interpolated in n between a Gaussian and that of SERSIC_NARROW.
 */
#ifndef PIXSHEAR_SERSIC_H
#define PIXSHEAR_SERSIC_H

#include "err.h"

#define SIGMA_PER_RE 0.84932180028801904272   /* rms per axis of a Gaussian of half-light radius 1: 1 / sqrt(2 ln 2) */
#define SERSIC_MIN 0.5
#define SERSIC_MAX 8.0
#define SERSIC_NARROW 0.5025

/* Mixtures for every n at one accuracy; parts are added on use: one for each thread that asks. */
struct sersic;

/* eps: error of a pixel over the profile's peak pixel. E_NOMEM. */
MUST_CHECK int sersic_new(struct sersic **s, double eps);
void sersic_free(struct sersic *s);

/*
 * Gaussians of a Sersic profile of half-light radius 1 seen with pixels of side `pixel` (0: infinitely fine):
 * sigma[k] falling and flux[k] (sum 1), at most SERSIC_PARTS; returns their number, 0 when n is outside
 * SERSIC_MIN..SERSIC_MAX.  tol: error of a pixel, in units of the flux, that may be made always.
 * Light of narrower Gaussians than the last is in the last, of wider than the first in the first.
 */
#define SERSIC_PARTS 320
int sersic_gaussians(struct sersic *s, double n, double pixel, double tol, double *sigma, double *flux);

/* The same sum made for this n alone, every Gaussian of the rule: what the polynomials are fitted to. */
int sersic_direct(double n, double eps, double *sigma, double *flux);

#endif
