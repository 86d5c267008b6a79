/*
 * sky.h - world coordinates by wcslib; sky.c is the only file that includes
 * wcs.h.  TAN with CD is written; whatever wcslib reads (SIP, TPV) is read.
 *
 * Pixel coordinates here count from 0 (centre of the first pixel is 0,0);
 * angles are degrees; positions on the sky are right ascension and declination
 * J2000, whatever the axes of the header (frame.h).
 */
#ifndef PIXSHEAR_SKY_H
#define PIXSHEAR_SKY_H

#include "err.h"
#include "header.h"
#include <stddef.h>

struct sky;

/*
 * From the WCS cards of a header. E_MISSING when there is no celestial WCS, E_DATA when it cannot be
 * used or its frame cannot be converted to J2000; e tells the cause.
 */
MUST_CHECK int sky_open(struct sky **s, const struct header *h, struct err *e);
void sky_close(struct sky *s);

/* n positions; failures give NaN and the status E_RANGE after all were tried; E_NOMEM. */
MUST_CHECK int sky_from_pixel(struct sky *s, size_t n, const double *x, const double *y,
                              double *ra, double *dec);
MUST_CHECK int sky_to_pixel(struct sky *s, size_t n, const double *ra, const double *dec,
                            double *x, double *y);

/* 1 for a place 60 degrees or more from the reference point: where a projection does not show it, it is outside of any image. */
int sky_far(const struct sky *s, double ra, double dec);

/* 1 when the map is a plain TAN without distortion: linear pixel -> intermediate coordinates. */
int sky_is_linear(const struct sky *s);

/* Pixel scale, arcsec: sqrt |det CD| * 3600 at the reference point. */
double sky_scale(const struct sky *s);

/* Its reference point CRVAL, J2000. */
void sky_reference(const struct sky *s, double *ra, double *dec);

/*
 * Pixels of the WCS of a header, in whatever frame: scale as above, and the ratio of the longest to
 * the shortest diameter of a round pixel's image on the sky, 1 when pixels are square.
 */
MUST_CHECK int sky_pixels(const struct header *h, double *scale, double *ratio, struct err *e);

/*
 * How far apart, in pixels of `a`, two headers place the first and the last of nx x ny pixels: the
 * greater of both; NaN when one of them has no positions on the sky.  E_NOMEM.
 */
MUST_CHECK int sky_apart(const struct header *a, const struct header *b, long nx, long ny, double *pixels);

/*
 * Write the standard TAN of this project into h: RA---TAN, DEC--TAN, ICRS,
 * CD1_1 = -scale/3600, CD2_2 = scale/3600, CRPIX (FITS, from 1), CRVAL (deg).
 */
MUST_CHECK int sky_set_tan(struct header *h, double scale, double crpix1, double crpix2,
                           double crval1, double crval2);

#endif
