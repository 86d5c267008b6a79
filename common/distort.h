/*
 * distort.h - objects of a scene seen through the WCS of an image, with its distortions.
 *
 * The sky is a plane of x (west) and y (north), arcsec, that touches the sphere at the middle of
 * the field.  The WCS maps it to pixels; an object is small, so that its shape follows the first
 * derivative at its place.  PSF and pixel belong to the detector and are not mapped.
 */
#ifndef PIXSHEAR_DISTORT_H
#define PIXSHEAR_DISTORT_H

#include "err.h"
#include "scene.h"
#include "sky.h"
#include <stddef.h>

/*
 * x[i], y[i]: positions of n objects as `where` says (pixels count from 0); replaced by pixels.
 * map[i]: d(pixel)/d(plane) times `pixel` arcsec, rows: the unit matrix for a plain TAN of that
 * pixel, east to the left.  centre: RA, Dec of the middle, deg.  An object that the WCS cannot
 * place gets NaN, one on the other side of the sky infinity and the unit matrix.  E_NOMEM, E_DATA.
 */
MUST_CHECK int distort(struct sky *wcs, const double centre[2], enum scene_where where, double pixel, size_t n, double *x,
                       double *y, double (*map)[4]);

/* map = S(-g) map S(g): what acts before a shear g of the field so that the map acts after it. E_RANGE. */
MUST_CHECK int distort_before(const double g[2], double map[4]);

#endif
