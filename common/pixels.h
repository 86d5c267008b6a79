/*
 * pixels.h - the pixels of an image wherever they are: in memory, or as an
 * input has them, converted piece by piece for whoever asks.
 */
#ifndef PIXSHEAR_PIXELS_H
#define PIXSHEAR_PIXELS_H

#include "image.h"
#include <stddef.h>

struct box {
    long x0, y0, nx, ny;
};

/* `rows` rows of n pixels from pixel number `at` on, `stride` pixels apart there, one after the other in out. Cannot fail. */
typedef void pixels_copy(const void *of, size_t at, size_t stride, long n, long rows, float *out);

struct pixels {
    long nx, ny;
    const float *pix;          /* nx*ny, or NULL: copy has them */
    pixels_copy *copy;
    const void *of;
};

/* Those of an image in memory, which must stay. */
struct pixels pixels_of(const struct image *im);

size_t pixels_count(const struct pixels *p);

/* A box inside the image, its rows one after the other in out. */
void pixels_box(const struct pixels *p, struct box box, float *out);

/* n pixels of row y from x0 on; one pixel. */
void pixels_row(const struct pixels *p, long y, long x0, long n, float *out);
float pixels_at(const struct pixels *p, long x, long y);

#endif
