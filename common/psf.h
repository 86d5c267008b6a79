/*
 * psf.h - what a transfer function looks like on the sky: image, width,
 * encircled energy, weighted moments.
 *
 * Every function takes a transfer function t and multiplies it by further charge
 * diffusion (Gaussian, rms `diffusion` arcsec) and a further square pixel (`pixel`
 * arcsec); 0 leaves a factor out.  Angles in arcsec; the origin is x = 0, with x to
 * the right and y up.
 *
 * A table of spacing du stands for a PSF of period 1/du in x and y: the light beyond
 * comes back.  With the default pupil (period 21.6") that is 1e-6 of the central
 * surface brightness.  Samples (otf_sample) are given a period of twice their extent.
 */
#ifndef PIXSHEAR_PSF_H
#define PIXSHEAR_PSF_H

#include "err.h"
#include "otf.h"

/* Largest side of an image that fits one period of t, arcsec. */
double psf_period(const struct otf *t);

/*
 * out = table, without spline, of t times the factors; out->chdiff and ->pixel tell all that is in it.  The
 * nodes of a table stay; samples get nodes 1 / (2 period) apart and a cut-off outside of which |T| < 1e-6 T(0).
 */
MUST_CHECK int psf_table(const struct otf *t, double diffusion, double pixel, struct otf *out);

/*
 * image[iy*nx + ix] = scale^2 * PSF at ((ix - (nx-1)/2) scale, (iy - (ny-1)/2) scale): samples, not
 * integrals, unless `pixel` = scale; the sum tends to the flux inside.  Exact sum over the
 * nodes of t.  nx, ny >= 1; E_RANGE when a side is longer than the period.
 */
MUST_CHECK int psf_image(const struct otf *t, double diffusion, double pixel, int nx, int ny, double scale,
                         double *image);

/*
 * Full width at half maximum of the azimuthal mean about the origin, arcsec: twice the
 * first radius where the profile falls to half its central value.  E_NOCONV when it does not within
 * a quarter of the period, or when the central value is not positive.
 */
MUST_CHECK int psf_fwhm(const struct otf *t, double diffusion, double pixel, double *fwhm);

/* mean[i] = azimuthal mean of the PSF, arcsec^-2, at radius r[i] < a quarter period. */
MUST_CHECK int psf_profile(const struct otf *t, double diffusion, double pixel, int n, const double *r,
                           double *mean);

/* inside[i] = flux within radius r[i] <= half a period of the origin. */
MUST_CHECK int psf_encircled(const struct otf *t, double diffusion, double pixel, int n, const double *r,
                             double *inside);

/* Moments under a weight, in the order of psf_moment_index. */
enum { PSF_MOMENTS = 15 };

/* Index of the moment x^a y^b, a + b <= 4: 1; x y; xx xy yy; xxx xxy xyy yyy; xxxx ... yyyy. */
int psf_moment_index(int a, int b);

/*
 * m[0] = S = integral of W PSF, W = exp(-((x-x0)^2 + (y-y0)^2) / 2 width^2); the others
 * integral of W (x-x0)^a (y-y0)^b PSF / S, arcsec^(a+b).  All space, no cut-off, no sampling: with
 * `pixel` the pixel scale this is what sums over the pixels of a star tend to, averaged over its
 * position in the pixel.  Parseval's sum over the nodes of t with the weight's own transform, exact
 * for the periodic PSF while width < period/16; E_RANGE above that.  1 ms for the default table; for samples some 10 ms.
 */
MUST_CHECK int psf_moments(const struct otf *t, double diffusion, double pixel, double width, double x0,
                           double y0, double m[PSF_MOMENTS]);

/* Centre (x0, y0) at which the weighted first moments vanish, |shift| < 1e-10 width. E_NOCONV. */
MUST_CHECK int psf_centroid(const struct otf *t, double diffusion, double pixel, double width, double *x0,
                            double *y0);

#endif
