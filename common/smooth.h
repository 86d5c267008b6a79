/*
 * smooth.h - the filter of the detection, row by row: a Gaussian, or any kernel.
 *
 * The Gaussian is exp(-r^2 / 2 sigma^2) sampled at pixel centres, cut at
 * |x|, |y| <= ceil(3 sigma), sum 1.  Another kernel K is laid on the image as it
 * is, out(x, y) = sum K(i, j) in(x + i, y + j) (the matched filter of objects that
 * look like K); one that is a product of a row and a column (to 3e-7 of its largest value, the rounding of floats) is applied as two
 * kernels of one axis, others as the whole sum or, where that takes longer, by
 * transforms of tiles (tiles.h).  For white noise of rms s the filtered image has
 * rms s * smooth_noise().
 */
#ifndef PIXSHEAR_SMOOTH_H
#define PIXSHEAR_SMOOTH_H

#include "err.h"

enum smooth_way {
    SMOOTH_NOTHING,        /* the image as it is */
    SMOOTH_EVEN,           /* one symmetric kernel for both axes */
    SMOOTH_PRODUCT,        /* a kernel for each axis */
    SMOOTH_WHOLE,          /* the sum over all of the kernel */
    SMOOTH_TILES           /* by transforms */
};

struct tiles;

struct smooth {
    enum smooth_way way;
    int radius, reach;     /* rows on either side that a row depends on, and columns */
    /* SMOOTH_EVEN: radius + 1 values, k[0] the centre; else factors of the pixels from the first that counts to the last:
       SMOOTH_PRODUCT 2 reach + 1 along x and 2 radius + 1 along y, SMOOTH_WHOLE 2 radius + 1 rows of 2 reach + 1; owned */
    float *k;
    struct tiles *tiles;   /* SMOOTH_TILES; owned */
    double noise;
};

/* Values of a kernel, v[j * nx + i]; its centre is i = nx / 2, j = ny / 2, rounded down. */
struct kernel {
    long nx, ny;
    double *v;             /* owned */
};

/* fwhm in pixels, 0..1000; 0 makes the identity. */
MUST_CHECK int smooth_new(struct smooth *s, double fwhm_px);

/*
 * Any kernel for images of nx x ny pixels (what can touch none of them costs nothing).  E_DATA: a value that is not finite, or
 * all are 0, or the largest modulus is beyond 1e-20..1e20; E_RANGE: sides; E_NOMEM.
 */
MUST_CHECK int smooth_kernel(struct smooth *s, const struct kernel *k, long nx, long ny);
void smooth_free(struct smooth *s);

/* SMOOTH_EVEN, SMOOTH_PRODUCT: a row filtered along x, 0 <= i < n; in[-reach .. n-1+reach] must exist. in != out. */
void smooth_row(const struct smooth *s, const float *in, long n, float *out);

/* The same: 2 radius + 1 rows that smooth_row made, filtered along y.  SMOOTH_WHOLE: rows of the image instead, in which
   -reach .. n-1+reach must exist. */
void smooth_column(const struct smooth *s, const float *const *row, long n, float *out);

/* sqrt of the sum of squares of the two-dimensional kernel. */
double smooth_noise(const struct smooth *s);

/* Seconds that a pixel takes, good to a factor 2, and bytes that a thread holds for rows of nx pixels. */
double smooth_seconds(const struct smooth *s);
double smooth_bytes(const struct smooth *s, long nx);

#endif
