/*
 * growth.h - pixels cut by circles: exact overlaps, and the radii of circles
 * that hold given fluxes.
 */
#ifndef PIXSHEAR_GROWTH_H
#define PIXSHEAR_GROWTH_H

#include "err.h"

/* Area of overlap of a unit pixel centred at (dx, dy) with a circle of radius r about 0. */
double circle_overlap(double dx, double dy, double r);

struct growth;                 /* scratch of one thread */
MUST_CHECK int growth_new(struct growth **g);
void growth_free(struct growth *g);

/* Take the nx x ny pixels v about (cx, cy) (pixels from 0) as far as `reach`, pixels. v must stay. */
MUST_CHECK int growth_open(struct growth *g, const float *v, long nx, long ny, double cx, double cy, double reach);

/*
 * The smallest radius, as far as one-pixel rings tell, that holds `flux` (> 0),
 * within 1e-5 of the flux; `reach` when none does.
 */
MUST_CHECK int growth_radius(struct growth *g, double flux, double *radius);

#endif
