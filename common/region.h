/*
 * region.h - ellipses for DS9 in the image's pixels, the first pixel's centre at 1.
 */
#ifndef PIXSHEAR_REGION_H
#define PIXSHEAR_REGION_H

#include "err.h"
#include <stddef.h>

struct region;

/* Start a region file; name must be none of the inputs. */
MUST_CHECK int region_open(struct region **r, const char *name, const char *const *inputs, size_t n_inputs, struct err *e);

/* Half axes a, b in pixels, theta in degrees from x towards y; number as text; colour NULL: green. Failures show at the end. */
void region_ellipse(struct region *r, double x, double y, double a, double b, double theta, size_t number, const char *colour);

/* Write it out; r is gone in every case, the file only after a failure. */
MUST_CHECK int region_close(struct region *r, struct err *e);

#endif
