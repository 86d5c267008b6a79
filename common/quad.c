/*
 * quad.c - nodes and weights of Gauss quadrature.
 *
 * Legendre: cos((i - 1/4) pi / (n + 1/2)) and Newton.  Hermite: zeros of the
 * WKB phase of the Hermite function, tau - sin(tau) = y (Tricomi), then Newton on
 * phi_n itself, whose derivative is sqrt(2n) phi_{n-1} - x phi_n.
 */
#include "quad.h"
#include <math.h>

int quad_legendre(int n, double *x, double *w)
{
    if (n < 1 || n > QUAD_NMAX)
        return E_RANGE;
    for (int i = 0; i < (n + 1) / 2; i++) {
        double t = 2 * i + 1 == n ? 0 : cos(M_PI * (i + 0.75) / (n + 0.5));
        double slope = 0;
        for (int step = 0; step < 6; step++) {
            double below = 1, here = t;
            for (int k = 2; k <= n; k++) {
                double next = ((2 * k - 1) * t * here - (k - 1) * below) / k;
                below = here;
                here = next;
            }
            slope = n * (below - t * here) / ((1 - t) * (1 + t));
            if (step == 5 || 2 * i + 1 == n)
                break;
            t -= here / slope;
        }
        x[i] = -t;
        x[n - 1 - i] = t;
        w[i] = w[n - 1 - i] = 2 / ((1 - t) * (1 + t) * slope * slope);
    }
    return OK;
}

/* phi_{n-1}(x) and phi_n(x), n >= 1, by the half-Gaussian recurrence of shapelet.c. */
static void hermite_pair(int n, const double *up, const double *down, double x, double *below, double *here)
{
    const double e = exp(-0.25 * x * x);
    double p = 0, q = 0.75112554446494248286 * e;     /* pi^(-1/4) */
    for (int k = 0; k < n; k++) {
        double next = up[k] * x * q - down[k] * p;
        p = q;
        q = next;
    }
    *below = p * e;
    *here = q * e;
}

/* i-th largest zero of phi_n (i = 0, 1, ...) in the WKB approximation. */
static double hermite_guess(int n, int i)
{
    const double y = (4 * i + 3) * M_PI / (2 * n + 1);
    double tau = cbrt(6 * y);
    for (int step = 0; step < 8; step++)
        tau -= (tau - sin(tau) - y) / (1 - cos(tau));
    return sqrt(2.0 * n + 1) * cos(0.5 * tau);
}

int quad_hermite(int n, double *x, double *w)
{
    if (n < 1 || n > QUAD_NMAX)
        return E_RANGE;
    double up[QUAD_NMAX], down[QUAD_NMAX];
    for (int k = 0; k < n; k++) {
        up[k] = sqrt(2.0 / (k + 1));
        down[k] = sqrt(k / (k + 1.0));
    }
    for (int i = 0; i < (n + 1) / 2; i++) {
        double t = 2 * i + 1 == n ? 0 : hermite_guess(n, i);
        double below, here, step = 1;
        hermite_pair(n, up, down, t, &below, &here);
        /* quadratic convergence: after a step of 1e-9 nothing is left to gain */
        for (int k = 0; k < 8 && t > 0 && fabs(step) > 1e-9; k++) {
            step = here / (sqrt(2.0 * n) * below - t * here);
            t -= step;
            hermite_pair(n, up, down, t, &below, &here);
        }
        x[i] = -t;
        x[n - 1 - i] = t;
        w[i] = w[n - 1 - i] = 1 / (n * below * below);
    }
    return OK;
}
