/*
 * image.h - pixels in memory.
 *
 * Pixel (x, y) is pix[y*nx + x] with its centre at (x, y), counting from 0;
 * x grows with FITS axis 1.  FITS counts from 1: imageio and sky convert.
 * A pixel holds the integral over its area in the unit the header names; a
 * blank pixel is NaN.
 */
#ifndef PIXSHEAR_IMAGE_H
#define PIXSHEAR_IMAGE_H

#include "err.h"
#include "header.h"
#include <stddef.h>

enum { IMAGE_SIDE = 65535 };   /* the longest */

struct image {
    long nx, ny;
    float *pix;            /* nx * ny, owned */
    struct header hdr;     /* cards of the HDU, without the structural ones */
};

/* nx*ny zeros and an empty header; sides 1..IMAGE_SIDE. E_RANGE, E_NOMEM. */
MUST_CHECK int image_new(struct image *im, long nx, long ny);

/* The same with pixels of no particular value, for whoever sets all of them. */
MUST_CHECK int image_room(struct image *im, long nx, long ny);

/* Free what im owns and clear it; im may be empty. */
void image_free(struct image *im);

/* Number of pixels; sides were checked, so the product fits. */
size_t image_count(const struct image *im);

#endif
