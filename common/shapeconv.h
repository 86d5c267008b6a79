/*
 * shapeconv.h - convolution in shapelet coefficients (Refregier 2003; Refregier & Bacon 2003).
 *
 * B_m(alpha) * B_l(beta) = sum_n C_nml B_n(gamma), C real, zero unless n+m+l is even; with
 * the natural scale gamma^2 = alpha^2 + beta^2 the sum ends exactly at n = m+l.  The integrals
 * are Gauss-Hermite sums, exact by degree: 2e-15 against 70-digit tables.
 *
 * Which to use: a Gaussian (charge diffusion without a PSF) shapeconv_gauss_object, exact at
 * the same nmax; two shapelet models shapeconv_object; a telescope PSF neither: its r^-3
 * wings are not spanned by shapelets (error 1e-3, 4-8 % of the flux lost), use k-space.
 */
#ifndef PIXSHEAR_SHAPECONV_H
#define PIXSHEAR_SHAPECONV_H

#include "err.h"

#define SHAPECONV_NMAX 66     /* highest order of any of the three functions */

/* Natural scale: hypot(alpha, beta). */
double shapeconv_scale(double alpha, double beta);

/* c[(n*(nm+1) + m)*(nl+1) + l] = C_nml, n = 0..nout, m = 0..nm, l = 0..nl. */
MUST_CHECK int shapeconv_tensor(int nout, double gamma, int nm, double alpha, int nl, double beta, double *c);

/*
 * m[k*(nin+1) + n] = coefficient on B_k(gamma) of B_n(beta) convolved with the Gaussian of unit
 * area and rms sigma >= 0 (all in one unit), k = 0..nout, n = 0..nin.
 */
MUST_CHECK int shapeconv_gauss(int nin, double beta, double sigma, int nout, double gamma, double *m);

/* The 2-D object c of scale beta convolved with the round Gaussian: exact, same nmax, in the
 * natural scale.  out may be c. */
MUST_CHECK int shapeconv_gauss_object(int nmax, double beta, double sigma, const double *c, double *out);

/*
 * Object f (nf, alpha) convolved with object h (nh, beta), projected on out (nout, gamma): the
 * transforms are multiplied at Gauss-Hermite nodes, no tensor is formed.  out may be f or h when
 * it is long enough.  About 200 kB of stack.
 */
MUST_CHECK int shapeconv_object(int nf, double alpha, const double *f, int nh, double beta, const double *h,
                                int nout, double gamma, double *out);

#endif
