/*
 * tall.h - stamps too large for a window of rows, made by all threads together.
 *
 * One stamp after the other lies in memory, whatever the number of threads: they share its rows of frequencies, its
 * columns and its rows of pixels, and add each to the image while it is in their caches.
 */
#ifndef PIXSHEAR_TALL_H
#define PIXSHEAR_TALL_H

#include "err.h"
#include "image.h"
#include "par.h"
#include "plan.h"
#include "progress.h"

/* Is this stamp drawn here? */
int tall_is(const struct plan *p, const struct draw *d);

/* Add all of them to im in the order of their numbers: the same bytes for any team. bar may be NULL. */
MUST_CHECK int tall_render(const struct plan *p, struct image *im, struct par_team *team, struct progress *bar);

#endif
