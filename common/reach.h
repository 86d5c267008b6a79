/*
 * reach.h - how far objects reach: wings of the PSF as measured on the transfer
 * function itself, and rigorous bounds of shapelets in space and frequency.
 *
 * Shell n of a shapelet (all n1+n2 = n) with power p_n^2 = sum c^2 obeys
 *   |f_n(x)| <= (p_n/beta) K_n(r/beta),  K_n(r)^2 = sum phi_n1(r)^2 phi_n2(0)^2,
 * by the Cauchy-Schwarz inequality and because the sum over a shell of squared
 * basis functions has no direction; in frequency K_n(2 pi beta u) 2 pi beta.
 */
#ifndef PIXSHEAR_REACH_H
#define PIXSHEAR_REACH_H

#include "err.h"
#include "otf.h"
#include "stamp.h"

/* ---- shapelets ---- */

struct envelope {
    int nmax;
    int steps;             /* radii i * 1/8, i = 0..steps-1 */
    double *k;             /* steps x (nmax+1): largest K_n at that radius or beyond */
};

MUST_CHECK int envelope_new(struct envelope *e, int nmax);
void envelope_free(struct envelope *e);

/* p[n], n = 0..nmax: square root of the power of each shell. */
void envelope_shells(int nmax, const double *c, double *p);

/* Smallest tabulated r (units of beta) with sum p_n K_n(r') <= limit for all r' >= r. */
double envelope_reach(const struct envelope *e, int nmax, const double *p, double limit);

/* sum p_n K_n at r or beyond (not below the true supremum). */
double envelope_value(const struct envelope *e, int nmax, const double *p, double r);

/* ---- PSF ---- */

#define WINGS_LEVELS 4

/*
 * Level l is the profile of an object that is a Gaussian of rms sigma[l]: 0 for a star; broad objects
 * smooth spikes and rings.
 */
struct wings {
    double pixel;          /* arcsec of the pixel the profile is for */
    int n;
    double dr;             /* arcsec */
    double sigma[WINGS_LEVELS];    /* arcsec, rising from 0 */
    double *w[WINGS_LEVELS];       /* w[l][i]: largest |fraction of flux in a pixel| at i dr or beyond */
    double *out;           /* out[i]: |fraction of the flux beyond| i dr */
    int nu;
    double du;             /* cycles/arcsec */
    double *tail;          /* pixel^2 times the integral of |T| over |u| >= i du */
    double peak;           /* smallest peak pixel of a star at any phase, fraction of its flux */
    double core;           /* Gaussian-equivalent sigma of the core, arcsec, pixel / sqrt(2 pi peak) */
};

/* Measure on an image of a star `width` arcsec wide or, when pixels are small, as wide as 1024 samples are, 2048 above WINGS_WIDTH. */
#define WINGS_WIDTH 26.0
MUST_CHECK int wings_new(struct wings *w, const struct otf *t, const struct stamp_response *r, double pixel, double width);
void wings_free(struct wings *w);

/*
 * Error at the border of a periodic stamp of n x n pixels, `half` arcsec from centre to border, fraction of
 * the flux, for an object without structure finer than that of a Gaussian of rms sigma (arcsec), whose light
 * reaches to `extent` (sigma for a Gaussian): the nearest replica's
 * wing and the mean of all replicas, the flux outside spread over the stamp.
 */
double wings_folded(const struct wings *w, double sigma, double extent, double half, double n);

/* pixel^2 times the integral of |T| beyond u. */
double wings_tail(const struct wings *w, double u);

#endif
