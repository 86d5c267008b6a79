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
 * with the half-Gaussian start: absolute error <= 1e-14 for n <= 200.
 */
MUST_CHECK int shapelet_basis(int nmax, double beta, int m, const double *x, double *b);

/*
 * b[n*m + i] = integral of B_n(x; beta) over [edge[i], edge[i+1]], i = 0..m-1;
 * m+1 rising edges.  Error below 2e-14 min(h, 2/sqrt(2n+1)) beta^(1/2),
 * h = pixel / beta, whatever h (simulation-math: safe closed form, paired
 * recurrence for small pixels).
 */
MUST_CHECK int shapelet_pixel(int nmax, double beta, int m, const double *edge, double *b);

/* I_n = integral of phi_n over the line, n = 0..nmax (0 for odd n). */
void shapelet_line_integrals(int nmax, double *in);

/* Flux, and unweighted moments about the origin; flux may be <= 0 (no division is made here):
 * m[0] = F, m[1] = F<x>, m[2] = F<y>, m[3] = F<xx>, m[4] = F<xy>, m[5] = F<yy>. */
void shapelet_moments(int nmax, double beta, const double *c, double m[6]);

/* f(x,y) at one point. */
double shapelet_value(int nmax, double beta, const double *c, double x, double y);

/* Smallest |x|/beta beyond which phi_n stays below eps of its maximum (support table of the
 * reference, by search; n <= 200, 1e-16 <= eps < 1). */
double shapelet_reach(int n, double eps);

/* Rotate the object anticlockwise by rho (exact, same nmax <= 66): out may not be c. */
MUST_CHECK int shapelet_rotate(int nmax, double rho, const double *c, double *out);

/* Mirror y -> -y (parity -1). In place. */
void shapelet_mirror(int nmax, double *c);

/* Cartesian-polar element <n1 n2 | p q> as real and imaginary part (n1+n2 = p+q <= 66). */
MUST_CHECK int shapelet_polar(int n1, int n2, int p, int q, double z[2]);

#endif
