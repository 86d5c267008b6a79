/*
 * picture.h - from pixel values to shades of grey.
 *
 *   grey = 255 f((v - low) / s) / f((high - low) / s),  f = x, log(1 + x) or asinh x
 *
 * cut at 0 and 255 and rounded.
 */
#ifndef PIXSHEAR_PICTURE_H
#define PIXSHEAR_PICTURE_H

#include "err.h"
#include <stddef.h>

enum stretch { STRETCH_ASINH, STRETCH_LINEAR, STRETCH_LOG };

struct picture {
    enum stretch stretch;
    double low, high;      /* values shown black and white, low < high */
    double soft;           /* s, > 0: asinh and log are linear well below it */
    double edge[256];      /* smallest value of each shade; edge[0] is not used */
};

/*
 * Levels from n sample values (reordered; NaN and infinities ignored): with the
 * median m and sigma = m - the 16th percentile,
 *   low = m - 2 sigma, soft = 2 sigma, high = the 99.9th percentile, at least m + 5 sigma,
 * and soft at least (high - low) / 3000.  Without any finite value, or when all
 * are the same, everything is mid-grey or darker.  low and high that are not NaN
 * on entry stay as they are. E_RANGE when low >= high then.  Fills all but stretch.
 */
MUST_CHECK int picture_levels(struct picture *p, float *sample, size_t n);

/* Shades of n values; those that are not finite get 128 and, when alpha is not NULL, alpha 0 (else 255). */
void picture_row(const struct picture *p, const float *v, size_t n, unsigned char *grey, unsigned char *alpha);

#endif
