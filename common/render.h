/*
 * render.h - sums the stamps of a plan into an image of expected electrons.
 *
 * Stamps are made in parallel, a few at a time, and added in one fixed order, in
 * double precision, to a window of rows that slides up the image: the same bytes
 * for any number of threads.
 */
#ifndef PIXSHEAR_RENDER_H
#define PIXSHEAR_RENDER_H

#include "err.h"
#include "image.h"
#include "plan.h"
#include "progress.h"

#define RENDER_BYTES 20        /* that drawing takes for each emitter */

/* Add to im (of the view's size, as image_new made it). bar may be NULL. */
MUST_CHECK int scene_render(const struct plan *p, struct image *im, int threads, struct progress *bar);

/* Object i alone, in double: stamp of draw[i].nx x draw[i].ny (fft_alloc'ed by the caller). */
MUST_CHECK int scene_stamp(const struct plan *p, size_t i, struct stamp_work *w, double *scratch, double *out);

#endif
