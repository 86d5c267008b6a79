/*
 * smooth.h - Gaussian matched filter, row by row.
 *
 * The kernel is exp(-r^2 / 2 sigma^2) sampled at pixel centres, cut at
 * |x|, |y| <= ceil(3 sigma), sum 1: for white noise of rms s the filtered
 * image has rms s * smooth_noise().
 */
#ifndef PIXSHEAR_SMOOTH_H
#define PIXSHEAR_SMOOTH_H

#include "err.h"

struct smooth {
    int radius;            /* 0: no filter */
    float *k;              /* radius + 1 values of one axis, k[0] the centre; owned */
};

/* fwhm in pixels, 0..1000; 0 makes the identity. */
MUST_CHECK int smooth_new(struct smooth *s, double fwhm_px);
void smooth_free(struct smooth *s);

/* out[i] = sum_j k_|j| in[i + j], 0 <= i < n; in[-radius .. n-1+radius] must exist. in != out. */
void smooth_row(const struct smooth *s, const float *in, long n, float *out);

/* out[i] = sum_j k_|j| row[radius + j][i] over 2 radius + 1 rows. */
void smooth_column(const struct smooth *s, const float *const *row, long n, float *out);

/* sqrt of the sum of squares of the two-dimensional kernel. */
double smooth_noise(const struct smooth *s);

#endif
