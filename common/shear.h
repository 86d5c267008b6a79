/*
 * shear.h - shear acting on shapelets.  Input is the reduced shear g, area
 * preserving: f'(x) = f(A x), A = exp(-Gamma), |gamma| = atanh |g|.
 *
 * Which way to draw a sheared object:
 *   with a PSF (k-space)       shear_grid with A^-T on the frequencies: no truncation, any g
 *   no PSF, g along an axis    shapelet_pixel with scales beta e^gamma, beta e^-gamma and
 *   (after rotation)           shapelet_pixel_sum
 *   no PSF, nout <= 60         shear_exact with nout = nmax + shear_growth, then shapelet_pixel
 *   no PSF, anything           shear_pixels: closed form in y, Gauss-Legendre in x
 * Many objects under one shear: shear_matrix_coeff once per order, then shear_apply.
 *
 * Measured: worst error, and time on one AVX-512 core at nmax 12:
 *   squeeze   7e-15 for orders <= 60, |t| <= 0.9             12 -> 28        8 us
 *   exact     1.6e-15, flux kept to 2e-15                    12 -> 28       28 us
 *   apply     the same                                       12 -> 28        3 us
 *   series    3e-14 (elements up to 30) of its own formula   order 4         8 us
 *   grid      1e-14 of peak, nmax <= 60, |g| <= 0.9          64 x 64        36 us
 *   pixels    8e-15 of the flux, nmax <= 60, |g| <= 0.999    64 x 64, 0.4 beta  1.2 ms
 */
#ifndef PIXSHEAR_SHEAR_H
#define PIXSHEAR_SHEAR_H

#include "err.h"

/* a = {A11, A12, A21, A22} = exp(+Gamma) for reduced shear g (|g| < 1): image of a unit vector. */
MUST_CHECK int shear_matrix(double g1, double g2, double a[4]);

/*
 * 1-D squeeze elements M[m*(nin+1) + n] = <phi_m | e^{-r/2} phi_n(e^{-r} x)>, t = tanh r,
 * m = 0..nout, n = 0..nin, by Gauss-Hermite (exact by degree, 7e-15).  -1 < t < 1; orders
 * up to SHAPELET_NMAX.  Exactly 0 for odd m+n; the unit matrix for t = 0.
 */
MUST_CHECK int shear_squeeze(int nin, int nout, double t, double *m);

/*
 * Exact shear in coefficient space: c (nmax) -> out (nout >= nmax): the projection of the
 * exactly sheared object on orders <= nout <= SHAPELET_ROTMAX.  Rotation, two squeezes,
 * rotation back.  g = 0 copies.  About 150 kB of stack.
 */
MUST_CHECK int shear_exact(int nmax, const double *c, double g1, double g2, int nout, double *out);

/*
 * The same as a matrix, for many objects of one nmax: m[i*shapelet_count(nmax) + j],
 * i < shapelet_count(nout); shear_apply multiplies.
 */
MUST_CHECK int shear_matrix_coeff(int nmax, int nout, double g1, double g2, double *m);
void shear_apply(int nmax, int nout, const double *m, const double *c, double *out);

/*
 * Orders beyond nmax needed for truncation below eps in L2, for the worst object of unit
 * norm: fitted from above to exact tails (nmax <= 60, 1e-4 <= g <= 0.7, 1e-12 <= eps <= 0.01;
 * a few orders too many: 4 at nmax 12, g 0.05, eps 1e-6).  eps above 0.01 counts as 0.01.  1000000
 * when eps or g is out of range (0 < eps, |g| < 1): fits nowhere.
 */
int shear_growth(int nmax, double g, double eps);

/*
 * The series exp(gamma.S) to `order` (1..8), growth kept: out has orders up to nmax + 2*order,
 * nmax <= SHAPELET_ROTMAX.  gamma = atanh|g| along g.
 */
MUST_CHECK int shear_series(int nmax, const double *c, double g1, double g2, int order, double *out);

/*
 * even[j*nx + i], odd[j*nx + i]: parts of even and odd n1+n2 of f(A (x[i], y[j])), c of
 * scale beta, nmax <= SHAPELET_ROTMAX; a = {A11, A12, A21, A22} any matrix with finite non-zero
 * determinant (no factor |det A| is applied).  odd NULL: even gets the whole.
 * Image: a from shear_matrix(-g).  Transform: scale 1/beta, x and y frequencies in rad/u,
 * a = inverse transpose of the image's matrix (shear alone: shear_matrix(+g)), coefficients of
 * shapelet_fourier, result 2 pi (even + i odd).
 */
MUST_CHECK int shear_grid(int nmax, double beta, const double *c, const double a[4],
                          int nx, const double *x, int ny, const double *y, double *even, double *odd);

/*
 * out[j*nx + i] = integral of f(A x) over [xe[i], xe[i+1]] x [ye[j], ye[j+1]], same c, beta and a.
 * Rising edges.  Closed form in y at Gauss-Legendre nodes in x, as many as the
 * pixel needs.  E_RANGE also for a matrix so skew that it would take 1e7 nodes (|g| > 0.9999).
 */
MUST_CHECK int shear_pixels(int nmax, double beta, const double *c, const double a[4],
                            int nx, const double *xe, int ny, const double *ye, double *out);

#endif
