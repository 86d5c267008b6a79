/*
 * quad.h - nodes and weights of Gauss quadrature.
 *
 * Newton's method on the orthogonal polynomials from asymptotic first guesses.
 * Nodes rise; the rule is symmetric to the last bit.
 */
#ifndef PIXSHEAR_QUAD_H
#define PIXSHEAR_QUAD_H

#include "err.h"

#define QUAD_NMAX 400     /* most nodes of one rule */

/* Gauss-Legendre on [-1, 1]: integral of f = sum w[i] f(x[i]), exact to degree 2n-1.  1 <= n <= QUAD_NMAX. */
MUST_CHECK int quad_legendre(int n, double *x, double *w);

/*
 * Gauss-Hermite on the whole line for f = exp(-x^2) times a polynomial of degree
 * <= 2n-1: integral of f = sum w[i] f(x[i]).  The weights hold exp(x^2), that is
 * w = 1/(n phi_{n-1}(x)^2): no overflow or underflow.  1 <= n <= QUAD_NMAX.
 */
MUST_CHECK int quad_hermite(int n, double *x, double *w);

#endif
