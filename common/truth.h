/*
 * truth.h - the scene list with where and how bright each object is in an image: what detections are compared with.
 *
 * All columns of the list and, behind them, X_IMAGE Y_IMAGE (first pixel centre is 1), ALPHA_J2000 DELTA_J2000, FLUX_IMAGE
 * (expected electrons); columns of these names are replaced.  The rows go to the file block by block.
 */
#ifndef PIXSHEAR_TRUTH_H
#define PIXSHEAR_TRUTH_H

#include "err.h"
#include "header.h"
#include "scene.h"
#include "sky.h"
#include "table.h"
#include <stddef.h>

struct truth;

/*
 * The catalogue `name` for a list with the columns, keywords and history of `list`; the keywords of the image h are added and
 * `record` to HISTORY.  sky: the world coordinates of h.  Everything but list and h must stay until truth_close().
 */
MUST_CHECK int truth_open(struct truth **t, const struct table *list, const struct header *h, struct sky *sky, const char *name,
                          const char *record, const char *const *inputs, size_t n_inputs, struct err *e);

/* Append the rows of `list`, whose objects are those of s at pixels x[i], y[i] (first centre is 0); exptime in s. */
MUST_CHECK int truth_rows(struct truth *t, const struct table *list, const struct scene *s, const double *x, const double *y,
                          double exptime, struct err *e);

/* Make the file appear; frees t whatever happens. */
MUST_CHECK int truth_close(struct truth *t, struct err *e);

#endif
