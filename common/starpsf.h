/*
 * starpsf.h - star moments of a PSF that is known exactly, from its transfer
 * function: what the mean over many stars at random places in the pixel tends to.
 */
#ifndef PIXSHEAR_STARPSF_H
#define PIXSHEAR_STARPSF_H

#include "err.h"
#include "otf.h"
#include "starmom.h"

/*
 * Moments at STARMOM_WIDTHS widths from 0.8 px to max(1", 2 px), at most 1/17
 * of the period of t; d* at max(0.8 px, 0.1").  scale: arcsec per pixel;
 * response: side of the square pixel that collected the light, arcsec (larger
 * than scale in interlaced images), multiplied in unless t contains it.
 * Pixels of `scale` in s.  E_RANGE: the PSF is too small for the widths, or
 * contains another pixel.
 */
MUST_CHECK int starmom_from_otf(struct starmom *s, const struct otf *t, double scale, double response);

#endif
