/*
 * darksky.h - level of the sky between objects, from blocks of pixels.
 *
 * The mean of a cell's pixels is unbiased but for the light of objects, most of
 * which lies below the noise of a pixel.  Averaged over blocks of 4 x 4 pixels,
 * and those over 3 x 3 blocks, the noise is 12 times smaller: blocks whose
 * smoothed value differs by more than twice its noise from the level, on
 * either side, are left out, again until nothing changes.
 */
#ifndef PIXSHEAR_DARKSKY_H
#define PIXSHEAR_DARKSKY_H

#include "err.h"
#include "pixels.h"

enum { DARKSKY_BLOCK = 4 };

struct darksky {
    long nx, ny;               /* blocks */
    double pivot;              /* subtracted from the means */
    float *mean;               /* nx*ny, NaN where most pixels are bad; owned */
};

/* Room for the blocks of an image; one without any (a side below 4) is fine. */
MUST_CHECK int darksky_new(struct darksky *d, const struct pixels *im);
void darksky_free(struct darksky *d);

/* Average the blocks whose first row is one of y0..y1-1. */
MUST_CHECK int darksky_rows(struct darksky *d, const struct pixels *im, const float *rms_map, long y0, long y1);

/*
 * Level of the blocks wholly inside x0 <= x < x1, y0 <= y < y1, starting from
 * *level; sigma: noise of a pixel.  Unchanged when fewer than 16 blocks, or less
 * than a quarter of them, are dark, or the level would move by more than sigma.
 */
MUST_CHECK int darksky_level(const struct darksky *d, long x0, long x1, long y0, long y1, double sigma, double *level);

#endif
