/*
 * render.h - sums the stamps of a plan into an image of expected electrons.
 *
 * Stamps are made in parallel, a few at a time, and added in one fixed order, in
 * double precision, to a window of rows that slides up the image: the same bytes
 * for any number of threads.  Stamps themselves are made in single precision where the accuracy asked for allows it.
 */
#ifndef PIXSHEAR_RENDER_H
#define PIXSHEAR_RENDER_H

#include "err.h"
#include "image.h"
#include "plan.h"
#include "progress.h"

#define RENDER_BYTES 24        /* that drawing takes for each emitter */

/* Add to im (of the view's size, as image_new made it). bar may be NULL. */
MUST_CHECK int scene_render(const struct plan *p, struct image *im, int threads, struct progress *bar);

/*
 * Scenes of several plans: pixels in double that stay from one to the next, where the image is so small that they take no more
 * memory than a window of rows does; NULL for others, whose pixels each plan rounds to float32.  They are added to im at the end.
 */
double *scene_sums(const struct image *im);
void scene_add_sums(const double *sums, struct image *im);
MUST_CHECK int scene_render_part(const struct plan *p, struct image *im, double *sums, int threads, struct progress *bar);

/* Object i alone, in double: stamp of draw[i].nx x draw[i].ny (fft_alloc'ed by the caller). */
MUST_CHECK int scene_stamp(const struct plan *p, size_t i, struct stamp_work *w, double *scratch, double *out);

#endif
