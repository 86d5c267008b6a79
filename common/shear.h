/*
 * shear.h - shear acting on shapelets.  Input is the reduced shear g, area
 * preserving: f'(x) = f(A x), A = exp(-Gamma), |gamma| = atanh |g|.
 */
#ifndef PIXSHEAR_SHEAR_H
#define PIXSHEAR_SHEAR_H

#include "err.h"

/* a = {A11, A12, A21, A22} = exp(+Gamma) for reduced shear g (|g| < 1): image of a unit vector. */
MUST_CHECK int shear_matrix(double g1, double g2, double a[4]);

/*
 * 1-D squeeze elements M[m*(nin+1) + n] = <phi_m | e^{-r/2} phi_n(e^{-r} x)>, t = tanh r,
 * m = 0..nout, n = 0..nin, by Gauss-Hermite (exact by degree, 5e-15).  -1 < t < 1.
 */
MUST_CHECK int shear_squeeze(int nin, int nout, double t, double *m);

/*
 * Exact shear in coefficient space: c (nmax) -> out (nout >= nmax): the projection of the
 * exactly sheared object on orders <= nout.  Rotation, two squeezes, rotation back.
 */
MUST_CHECK int shear_exact(int nmax, const double *c, double g1, double g2, int nout, double *out);

/* Orders beyond nmax needed for truncation below eps in L2 (reference 5(b), conservative). */
int shear_growth(int nmax, double g, double eps);

/*
 * The series exp(gamma.S) to `order` (1..8), growth kept: out has orders up to nmax + 2*order.
 * gamma = atanh|g| along g.
 */
MUST_CHECK int shear_series(int nmax, const double *c, double g1, double g2, int order, double *out);

#endif
