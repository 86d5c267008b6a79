/*
 * shapelet.h - Cartesian shapelets: basis, pixel integrals, linear maps of
 * coefficients, flux and moments (Refregier 2003; Massey & Refregier 2005).
 *
 *   phi_n(x) = (2^n sqrt(pi) n!)^(-1/2) H_n(x) exp(-x^2/2)
 *   B_n(x; beta) = beta^(-1/2) phi_n(x/beta)
 *   f(x,y) = sum_{n1+n2<=nmax} c_n1n2 B_n1(x;beta) B_n2(y;beta)
 *
 * Coefficient order: n rising, inside n by rising n1:
 * (0,0) (0,1) (1,0) (0,2) (1,1) (2,0) ...; (n1,n2) is at n(n+1)/2 + n1, n = n1+n2.
 * x and beta in one unit u; B_n in u^(-1/2).  No allocation unless stated.
 *
 * Measured: worst error at random points against long double, and time of 64 points, pixels,
 * or 64 x 64 pixels on one AVX-512 core (with SSE2 alone 2.5 to 4 times longer, rotation the same):
 *   function      orders  worst error                      order 12   order 60
 *   basis         <= 200  3.8e-15                          0.24 us    0.74 us
 *   pixel         <= 60   1.7e-14 min(h, 2/sqrt(2n+1))     1.2 us     3 us
 *                 <= 200  2.9e-14 of the same, at h = 0.05
 *                 <= 60   1.4e-14 of itself in the tails
 *   pixel_sum     <= 60   the rounding of its sums         2.7 us     27 us
 *   rotate_by     <= 66   4e-16, 7e-16 there and back      1.2 us     28 us
 *   rotate        <= 66   the same bits                    2.9 us     80 us
 *   polar         <= 60   6e-17
 * A rounding of x / beta adds |x phi'| 1e-16 for beta other than a power of 2.
 */
#ifndef PIXSHEAR_SHAPELET_H
#define PIXSHEAR_SHAPELET_H

#include "err.h"
#include <stddef.h>

#define SHAPELET_NMAX 340      /* highest order the basis functions accept */

/* Number of coefficients up to nmax, and the place of (n1,n2). */
size_t shapelet_count(int nmax);
size_t shapelet_index(int n1, int n2);

/*
 * b[n*m + i] = B_n(x[i]; beta), n = 0..nmax, i = 0..m-1.  Upward recurrence
 * with the half-Gaussian start: absolute error 4e-15 for n <= 200.
 * nmax <= SHAPELET_NMAX, 0 < beta < infinity, m >= 0, else E_RANGE.  x may be
 * anything: infinite gives 0, NaN gives NaN.
 *
 * Fourier space: the transform (integral of f exp(-ikx)) of B_n(.; beta) is
 * sqrt(2 pi) (-i)^n B_n(k; 1/beta), k in rad/u: call it with 1/beta.
 */
MUST_CHECK int shapelet_basis(int nmax, double beta, int m, const double *x, double *b);

/*
 * b[n*m + i] = integral of B_n(x; beta) over [edge[i], edge[i+1]], i = 0..m-1;
 * m+1 rising edges (equal ones give 0, infinite ones are allowed, NaN and
 * falling ones give E_RANGE).  Error below 2e-14 (n <= 60; 4e-14 at 200) times
 * min(h, 2/sqrt(2n+1)) beta^(1/2), h = pixel / beta, whatever h (simulation-math: safe closed form, paired
 * recurrence for small pixels).
 */
MUST_CHECK int shapelet_pixel(int nmax, double beta, int m, const double *edge, double *b);

/*
 * out[j*m1 + i] = sum c_n1n2 bx[n1*m1 + i] by[n2*m2 + j], i < m1, j < m2: a whole
 * stamp from two tables.  With tables of shapelet_basis: surface brightness at
 * a grid of points; of shapelet_pixel: flux in pixels; of shapelet_basis(1/beta)
 * and coefficients of shapelet_fourier: the transform.  The two tables may have
 * different scales: an object sheared along the axes (g2 = 0 once the coefficients
 * are rotated) has beta e^gamma along x, beta e^-gamma along y, exactly.
 */
MUST_CHECK int shapelet_pixel_sum(int nmax, const double *c, int m1, const double *bx,
                                  int m2, const double *by, double *out);

/*
 * Coefficients of the transform F(k) = integral of f(x) exp(-ik.x) d2x:
 *   F = 2 pi sum (-i)^(n1+n2) c_n1n2 B_n1(kx; 1/beta) B_n2(ky; 1/beta).
 * out = c times +1, -1, -1, +1 for n1+n2 = 0, 1, 2, 3 mod 4: even orders sum to the real
 * part, odd orders to the imaginary part (2 pi left to the caller).  out may be c.
 */
void shapelet_fourier(int nmax, const double *c, double *out);

/* I_n = integral of phi_n over the line, n = 0..nmax (0 for odd n): sqrt2 pi^(1/4) at n = 0. */
void shapelet_line_integrals(int nmax, double *in);

/* Flux, and unweighted moments about the origin; flux may be <= 0 (no division is made here):
 * m[0] = F, m[1] = F<x>, m[2] = F<y>, m[3] = F<xx>, m[4] = F<xy>, m[5] = F<yy>.
 * nmax outside 0..SHAPELET_NMAX gives NaN. */
void shapelet_moments(int nmax, double beta, const double *c, double m[6]);

/* f(x,y) at one point; NaN for nmax or beta out of range. */
double shapelet_value(int nmax, double beta, const double *c, double x, double y);

/* Smallest |x|/beta beyond which phi_n stays below eps of its maximum (support table of the
 * reference, by search; n <= 200, 1e-16 <= eps < 1; NaN outside). */
double shapelet_reach(int n, double eps);

#define SHAPELET_ROTMAX 66     /* highest order of rotation and polar elements: exact in 64-bit integers */

/* Rotate the object anticlockwise by rho (exact, same nmax <= 66): out may not be c. */
MUST_CHECK int shapelet_rotate(int nmax, double rho, const double *c, double *out);

/*
 * The same for many objects: the table depends on nmax only and serves every angle
 * and every smaller nmax.  It has shapelet_rotation_count(nmax) doubles, owned by the caller.
 */
size_t shapelet_rotation_count(int nmax);
MUST_CHECK int shapelet_rotation_table(int nmax, double *table);
MUST_CHECK int shapelet_rotate_by(int nmax, const double *table, double rho, const double *c, double *out);

/* Mirror y -> -y (parity -1). In place. */
void shapelet_mirror(int nmax, double *c);

/* Cartesian-polar element <n1 n2 | p q> as real and imaginary part (n1+n2 = p+q <= 66). */
MUST_CHECK int shapelet_polar(int n1, int n2, int p, int q, double z[2]);

#endif
