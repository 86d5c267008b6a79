/*
 * tiles.h - an image filtered with a large kernel by Fourier transforms of
 * overlapping tiles (overlap and save), in double: errors are 1e-16 of the largest
 * value in a tile times the kernel's largest.
 *
 * Tiles are TILES_TALL rows high and as wide as is cheapest; who begins at
 * multiples of these gets the same bits whatever else is filtered.
 */
#ifndef PIXSHEAR_TILES_H
#define PIXSHEAR_TILES_H

#include "err.h"
#include <stddef.h>

enum { TILES_TALL = 128 };

struct tiles;              /* plans and the kernel's transform, for all threads */

/*
 * out(x, y) = sum w[(j + radius) * (2 reach + 1) + i + reach] in(x + i, y + j) over |i| <= reach, |j| <= radius.
 * E_RANGE: a kernel too large to be transformed; E_NOMEM.
 */
MUST_CHECK int tiles_new(struct tiles **t, const double *w, int radius, int reach);
void tiles_free(struct tiles *t);

/* Doubles of scratch for tiles_filter; to be had from fft_alloc(). */
size_t tiles_room(const struct tiles *t);

/*
 * TILES_TALL rows of nx pixels into out, from TILES_TALL + 2 radius rows of the image, whose pixels -reach .. nx-1+reach
 * exist.  A row that is NULL is 0.
 */
void tiles_filter(const struct tiles *t, const float *const *row, long nx, double *scratch, float *out);

/* Seconds that a pixel takes, good to a factor 2, with such a kernel. */
double tiles_seconds(int radius, int reach);

#endif
