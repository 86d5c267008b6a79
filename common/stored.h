/*
 * stored.h - the values of a FITS image from its bytes:
 * BZERO + BSCALE * stored (FITS 4.0, section 4.4.2.5) in double, rounded once to float.
 * Private to the FITS readers.
 */
#ifndef PIXSHEAR_STORED_H
#define PIXSHEAR_STORED_H

#include "fitswalk.h"

/* n values from `in` on, as the unit's header says. */
void stored_float(const struct fits_unit *u, const unsigned char *in, size_t n, float *out);
void stored_double(const struct fits_unit *u, const unsigned char *in, size_t n, double *out);

/* `rows` rows of n values, `stride` values apart, one after the other in out. */
void stored_box(const struct fits_unit *u, const unsigned char *in, size_t stride, size_t n, size_t rows, float *out);

#endif
