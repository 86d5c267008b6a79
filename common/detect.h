/*
 * detect.h - from an image to measured objects: background, filter, threshold,
 * deblending, cleaning, photometry.  Linear in pixels plus detected pixels;
 * 4 bytes per pixel of an image in memory (none of one that stays in its file, pixels.h), 4 with a weight map, plus 8 bytes for
 * each detected pixel and 10 for each run of them while objects are separated (16 together where a run is a pixel by itself), and up to
 * 90 for the pixels of the component in hand: a component larger than DETECT_MOST
 * pixels and a DETECT_PART of the image is not split, gets the flag
 * DETECT_UNSEPARATED, and all stays below 32 MiB + 12.6 bytes per pixel, the pages of the file with it,
 * and what the rows of the catalogue take (about 450 bytes each).
 */
#ifndef PIXSHEAR_DETECT_H
#define PIXSHEAR_DETECT_H

#include "background.h"
#include "err.h"
#include "labels.h"
#include "photometry.h"
#include "pixels.h"
#include "smooth.h"
#include <stdint.h>

struct progress;

enum { DETECT_MOST = 1 << 18, DETECT_PART = 12 };

enum weight_type { WEIGHT_INVERSE, WEIGHT_RMS, WEIGHT_VARIANCE };

struct detect_params {
    const struct smooth *filter;   /* NULL: none */
    double threshold;          /* in units of the noise */
    int pixel_noise;           /* of the pixels instead of the filtered image */
    long min_area;             /* pixels */
    long back_cell, back_filter;
    int dark_sky;              /* sky between the objects instead of the mode */
    double sky_removed;        /* sky already subtracted from the image, its unit */
    double rms;                /* noise per pixel when known, 0: measure */
    long levels;               /* deblending */
    double contrast;
    int clean;
    double clean_beta;
    int negative;
    int threads;
    struct photometry_params phot;     /* noise and rms_map are filled in */
    const struct pixels *measure;      /* photometry in this image of the same size; NULL: in the same one */
    float *measure_map;                /* its rms per pixel, as rms_map of detect_run(), or NULL */
    struct progress *progress;         /* of DETECT_STEPS; or NULL */
};

enum { DETECT_STEPS = 1000 };

#define DETECT_DEFAULTS { \
    .threshold = 3, .min_area = 5, .back_cell = 64, .back_filter = 3, .levels = 32, \
    .contrast = 0.005, .clean = 1, .clean_beta = 1, .threads = 1, \
    .phot = {.kron_factor = 2.5, .kron_min = 3.5, .saturation = INFINITY, .flux_fraction = 0.5}}

struct detection {
    struct background background;
    struct background measured;    /* of the image of the photometry, when it is another */
    double noise;              /* rms of a pixel (without a map) */
    double filtered_noise;     /* rms of the filtered image in units of the pixel's */
    double threshold;          /* in units of the pixel's rms */
    size_t n;
    struct object *object;
    double *aperture;          /* n times 2 * napertures and nfractions */
    struct labels label;       /* 1 + index of the object */
    size_t found, cleaned;     /* objects before cleaning, removed by it */
};

/*
 * Turn a weight map into rms in place: weight^(-1/2), the value, or value^(1/2);
 * infinite where the weight is zero, negative or not finite.
 */
void detect_weights(float *map, size_t n, enum weight_type type);

/*
 * Detect and measure.  rms_map: NULL, or from detect_weights(); with `relative`
 * it is scaled in place so that its median agrees with the noise measured on
 * the meshes.  E_DATA: no usable pixel; E_SINGULAR: no noise (constant image).
 */
MUST_CHECK int detect_run(const struct pixels *im, float *rms_map, int relative,
                          const struct detect_params *p, struct detection *d);
void detection_free(struct detection *d);

#endif
