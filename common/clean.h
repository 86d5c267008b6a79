/*
 * clean.h - remove detections that are the wings of brighter neighbours.
 *
 * A neighbour's light is continued beyond its isophote as an elliptical Moffat
 * profile I(r) = P (1 + k r^2)^(-beta), r in units of its second-moment ellipse,
 * with k such that I falls to the threshold where the ellipse has the isophote's
 * area.  A fainter object within 10 rms radii of it that would not have kept
 * min_area pixels on top of that light joins the brighter one.
 */
#ifndef PIXSHEAR_CLEAN_H
#define PIXSHEAR_CLEAN_H

#include "deblend.h"
#include "err.h"
#include "par.h"

/*
 * into[i] = the blob that i joins (a chain end: never one that itself joined),
 * i itself when it stays.  Blobs that stay get the sums of those that joined.
 * beta: slope of the wings, 0.1..10, larger cleans less.  Time is linear in the
 * number of pairs within reach, found through a grid by the threads of `team`
 * (NULL: the calling one alone).
 */
MUST_CHECK int clean_objects(struct blob_list *list, double beta, long nx, long ny, struct par_team *team, int32_t *into);

#endif
