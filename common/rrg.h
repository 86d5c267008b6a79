/*
 * rrg.h - from raw Gaussian-weighted moments to an ellipticity and its response
 * to shear (Rhodes, Refregier & Groth 2000, with the second-order consistent
 * treatment of the fourth moments).
 *
 *   P       PSF covariance freed of its own weight: (Pw^-1 - 1/wp^2)^-1
 *   J' = J - dJ(q)           anisotropic part of P: first order in q, and for point
 *                            sources exact (a star's own residual is subtracted)
 *   J(weff) = (J' - gw^2)/s^2, weff^2 = w^2 + g^2, g^2 = tr P / 2, s = w^2/weff^2
 *   e = (Jxx - Jyy, 2 Jxy)/(Jxx + Jyy),   gamma = <e>/G
 *
 * Exact for a Gaussian PSF; what it gets wrong is PSF wings, pixels and noise.
 * All lengths in pixels.
 */
#ifndef PIXSHEAR_RRG_H
#define PIXSHEAR_RRG_H

#include "err.h"
#include "moments.h"

struct rrg_options {
    int first;                /* P = Pw + (Pw_ijkk - Pw_ij Pw_kk)/(2 wp^2) instead of the resummed form */
    int plain;                /* fourth moments by the rule for unweighted cumulants (public codes) */
    int centroid;             /* add the motion of the weighted centroid to P11, P22 */
};

/* Weighted, normalised moments of the PSF at width w. */
struct rrg_psf {
    double w;
    double m2[3];             /* xx xy yy */
    double m4[5];             /* xxxx xxxy xxyy xyyy yyyy */
};

struct rrg {
    double d, d_err;          /* sqrt((Jxx + Jyy)/2) of the raw moments */
    double weff;
    double m2[3], m3[4], m4[5];      /* before the PSF, under the weight weff */
    double cov[6];            /* of m2, as in struct moments */
    double e[2], e_err[2];
    double lambda, mu[2];     /* G = 2 - <e^2> - <lambda>/2 - <e.mu>/2 */
    double p11, p22;          /* de1/dg1, de2/dg2 of this object */
    int flags;                /* those of the moments, UNRESOLVED, BIGE, NEARSINGULAR */
};

/*
 * Covariance of the PSF freed of the weight it was measured with.  Returns OK,
 * or E_SINGULAR after falling back to the first-order form because an
 * eigenvalue of 1 - Pw/wp^2 is below 0.05 (p is set in both cases).
 */
MUST_CHECK int rrg_psf_free(const struct rrg_psf *psf, int first, double p[3]);

/*
 * Correct one object.  psf must be measured at the object's own width, except
 * with opt->first.  Never fails: an object without flux gets NaN throughout,
 * one whose corrected Jxx + Jyy is below 1e-5 of the raw one is UNRESOLVED and
 * gets NaN in e, lambda, mu, p11, p22.
 */
void rrg_correct(const struct moments *m, const struct rrg_psf *psf, const struct rrg_options *opt,
                 struct rrg *out);

/*
 * Errors of e of an object because the moments of the PSF have errors: cov of m2[0..2],
 * m4[0..4] of psf.  e is linear in so small changes; derivatives by differences.
 * r is what rrg_correct() gave.  NaN where e is.
 */
void rrg_psf_error(const struct moments *m, const struct rrg_psf *psf, const struct rrg_options *opt,
                   const double cov[8][8], const struct rrg *r, double err[2]);

/*
 * G of one object, (p11 + p22)/2: equal to 2 - e^2 - lambda/2 - e.mu/2 without
 * the centroid term.  The shear estimator divides by its mean over many
 * objects, never object by object.
 */
double rrg_response(const struct rrg *r);

#endif
