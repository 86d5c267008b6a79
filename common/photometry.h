/*
 * photometry.h - fluxes, sizes and positions of one object.
 *
 * Names and meanings are Source Extractor's where they coincide (Kron 1980;
 * Bertin & Arnouts 1996).  Pixels that belong to other objects, and bad ones,
 * are replaced by the pixel mirrored at the object's centre where that is free,
 * else by 0.
 */
#ifndef PIXSHEAR_PHOTOMETRY_H
#define PIXSHEAR_PHOTOMETRY_H

#include "background.h"
#include "deblend.h"
#include "err.h"
#include "growth.h"
#include "labels.h"
#include "pixels.h"
#include <stdint.h>

/* FLAGS; DETECT_BLENDED (2) and DETECT_UNSEPARATED (64) are in deblend.h. */
enum {
    DETECT_CROWDED = 1,        /* more than a tenth of the AUTO ellipse is neighbours or bad pixels */
    DETECT_SATURATED = 4,      /* a pixel of the isophote is at or above the saturation level */
    DETECT_EDGE = 8,           /* the isophote touches the border of the image */
    DETECT_APERTURE = 16,      /* an aperture is cut by the border, or its sum has no meaning (flux <= 0) or is beyond float32 */
    DETECT_ISOPHOTE = 32       /* the isophote touches a bad pixel */
};

struct photometry_params {
    double kron_factor;        /* 2.5 */
    double kron_min;           /* 3.5 rms radii */
    double gain;               /* electrons per unit; 0: no photon noise of the objects */
    double noise;              /* rms per pixel where rms_map is NULL */
    const float *rms_map;      /* or NULL */
    double noise_cor;          /* sky noise of large areas over what pixels let expect (NOISECOR); 0 counts as 1 */
    double saturation;         /* level in the image's unit, INFINITY: none */
    double flux_fraction;      /* of FLUX_RADIUS, 0.5 */
    size_t nfractions;         /* more fractions for FLUX_RADIUS_2, ... */
    const double *fraction;
    size_t napertures;
    const double *aperture;    /* diameters, pixels */
    double psf_fwhm;           /* pixels, of the PSF before the pixel; 0 unknown: STAR_PROB 0.5 */
    int windowed;              /* also XWIN, YWIN */
    int errors;                /* also the errors of the position */
    int plain_sizes;           /* leave out FWHM and STAR_PROB */
};

/* One measured object. Positions in pixels counting from 0. */
struct object {
    double x, y, xx, xy, yy, a, b, theta;
    double err_xx, err_xy, err_yy;         /* variances of the position */
    double xwin, ywin;
    double flux_iso, err_iso, flux_auto, err_auto;
    double kron_radius, flux_radius, fwhm;
    double background, rms, threshold, peak, star_prob;
    long area, area_above, xpeak, ypeak, xmin, xmax, ymin, ymax, flags;
};

/* What photometry of one field needs; shared by threads. */
struct field {
    const struct pixels *im;
    const struct background *b;
    const struct labels *label;
    const struct photometry_params *p;
    const struct field *found; /* of the image of the detection, when that is another: isophotes are summed
                                  here, errors of positions there; else NULL */
};

struct photometry_work;        /* scratch of one thread */
MUST_CHECK int photometry_work_new(struct photometry_work **w);
void photometry_work_free(struct photometry_work *w);

/*
 * Measure object `index` (label index + 1) from its sums.  aperture: room for
 * 2 * napertures, flux and error alternating, and the nfractions radii (NULL
 * when there are none).
 * The result has no NaN: where a quantity has no value (flux <= 0), sizes
 * fall back on the isophote and DETECT_APERTURE is set.
 */
MUST_CHECK int photometry_measure(const struct field *f, const struct blob *blob, int32_t index,
                                  struct photometry_work *w, struct object *out, double *aperture);

/*
 * Probability that an object is a point source.  log_ratio: ln of its second
 * moment under a Gaussian weight of variance w2 = 2.4 T0 + 0.5 pixel^2 about the
 * windowed centroid, over T0 w2 / (T0 + w2), what a Gaussian of the PSF's
 * variance T0 = (psf_fwhm/2.355)^2 + 1/12 pixel^2 would have; snr: that of the
 * weighted flux; psf_fwhm in pixels.  Both kinds are normal in log_ratio, stars
 * (0.22, 0.09 and a term for undersampling), galaxies (0.92, 0.24), each
 * widened by 2/snr; stars are rarer by 1 + (15/snr)^2.  0.5 when psf_fwhm is 0.
 */
double star_probability(double log_ratio, double snr, double psf_fwhm);

#endif
