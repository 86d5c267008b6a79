/*
 * moments.h - Gaussian-weighted moments of one object, to 4th order, about its
 * weighted centroid.
 *
 *   S = sum W I,   J_ab.. = sum W I t_a t_b .. / S,   W = exp(-t^2 / 2 w^2), |t| < cut w
 *
 * t is the position from the centroid, where sum W I t = 0; W is taken at pixel
 * centres (pixels are samples of the image convolved with the pixel, so no
 * integration of W is wanted).  Lengths in pixels; (0,0) is the centre of the
 * first pixel.
 */
#ifndef PIXSHEAR_MOMENTS_H
#define PIXSHEAR_MOMENTS_H

#include "err.h"
#include <stddef.h>

/* What went wrong with one object (FLAGS_RRG of a catalogue). */
enum shape_flag {
    SHAPE_NOFLUX = 1,         /* S <= 0: no moments */
    SHAPE_BADPIX = 2,         /* blank pixels inside the disc, left out */
    SHAPE_EDGE = 4,           /* the disc leaves the image */
    SHAPE_SHIFT = 8,          /* centroid left for more than max(2 w, 2 px), where the search stopped */
    SHAPE_NOCONV = 16,        /* centroid did not settle */
    SHAPE_UNRESOLVED = 32,    /* not larger than the PSF: no ellipticity */
    SHAPE_BIGE = 64,          /* |e| > 1 */
    SHAPE_CROWDED = 128,      /* neighbours cover too much of the weight */
    SHAPE_NEARSINGULAR = 256  /* 1 - J/w^2 or 1 - P/w^2 has an eigenvalue below 0.05 */
};

#define SHAPE_SINGULAR_LIMIT 0.05

/* The maps an object is measured on; all nx * ny, only one of pix, pix64 is set. */
struct moments_map {
    long nx, ny;
    const float *pix;
    const double *pix64;
    const float *label;       /* segmentation, 0 = sky; NULL: nothing is masked */
    const float *weight;      /* NULL: none; <= 0 or not finite: blank pixel */
    int weight_inverse;       /* weight is 1/variance; else relative to its value at the object */
    double gain;              /* electrons per unit of pix; 0: no photon noise in the errors */
    double noise_cor;         /* noise of large areas over what independent pixels give; 0: 1 */
};

struct moments_object {
    double x, y;              /* start of the centroid search */
    double w;                 /* rms of the weight, > 0 */
    double label;             /* own label in the segmentation */
    double sky;               /* subtracted from every pixel */
    double sky_var;           /* variance of the sky noise per pixel */
};

struct moments_options {
    double cut;               /* radius of the disc in units of w */
    double tol;               /* the centroid has settled when a step is shorter, px */
    int max_steps;
    int fixed_centre;         /* measure about the given position */
    int no_errors;            /* s_var and cov stay 0 */
};

#define MOMENTS_DEFAULTS {.cut = 4, .tol = 1e-6, .max_steps = 60}

struct moments {
    double x, y, w;           /* centre of the moments and width of the weight */
    double s, s_var;          /* sum W I and its variance */
    double m2[3];             /* xx xy yy */
    double m3[4];             /* xxx xxy xyy yyy */
    double m4[5];             /* xxxx xxxy xxyy xyyy yyyy */
    double cov[6];            /* of m2: (xx,xx) (xx,xy) (xx,yy) (xy,xy) (xy,yy) (yy,yy) */
    double masked;            /* part of the weight that neighbours cover, 0..1 */
    int steps;                /* centroid steps made */
    int flags;                /* enum shape_flag; with SHAPE_NOFLUX all numbers but x, y, w are NaN */
};

/* Work space of one thread, grown when needed; start with {0}. */
struct moments_scratch {
    size_t cap;
    double *mem;
};

void moments_scratch_free(struct moments_scratch *s);

/*
 * Measure one object.  The centroid is found by Newton steps
 * (1 - J/w^2)^-1 <t>, limited to w/2; where that matrix is near-singular the
 * step is 2<t>.  Pixels of other labels are replaced by the pixel mirrored
 * through the centre; where that is not free either the pixel is left out and
 * more than 1 % of the weight lost in this way flags SHAPE_CROWDED, as does
 * more than 10 % replaced.
 * Errors: cov(J_a,J_b) = sum W^2 v (t_a - J_a)(t_b - J_b)/S^2 with
 * v = [sky_var (or by the weight map) + max(I,0)/gain] noise_cor^2: right where
 * the noise is correlated over lengths short of w.
 * Returns OK (also for a flagged object), E_RANGE, E_NOMEM.
 */
MUST_CHECK int moments_measure(const struct moments_map *map, const struct moments_object *obj,
                               const struct moments_options *opt, struct moments_scratch *scratch,
                               struct moments *out);

/* The same at n rising widths w (obj->w is ignored) for less: one window of pixels serves all. */
MUST_CHECK int moments_series(const struct moments_map *map, const struct moments_object *obj, int n, const double *w,
                              const struct moments_options *opt, struct moments_scratch *scratch,
                              struct moments *out);

#endif
