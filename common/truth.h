/*
 * truth.h - the scene list with where and how bright each object is in an image: what detections are compared with.
 */
#ifndef PIXSHEAR_TRUTH_H
#define PIXSHEAR_TRUTH_H

#include "err.h"
#include "header.h"
#include "scene.h"
#include "table.h"

/*
 * To the list t of scene s: X_IMAGE Y_IMAGE (x[i] + 1, y[i] + 1: pixel positions from the
 * first centre = 0), ALPHA_J2000 DELTA_J2000 by the world coordinates of the image's header h, FLUX_IMAGE (the expected
 * electrons of `exptime` seconds), and the keywords of h.  Columns of these names are replaced, all others stay.
 */
MUST_CHECK int truth_add(struct table *t, const struct scene *s, const struct header *h, const double *x, const double *y,
                         double exptime);

#endif
