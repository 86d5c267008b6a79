/*
 * frame.h - celestial frames: what the two numbers of a position on the sky are.
 *
 * This project's positions are right ascension and declination in ICRS; FK5 of
 * equinox 2000 is within 0.03 arcsec of it and taken as the same.
 */
#ifndef PIXSHEAR_FRAME_H
#define PIXSHEAR_FRAME_H

#include "err.h"
#include "header.h"
#include <stddef.h>

enum frame { FRAME_J2000, FRAME_GALACTIC };

/*
 * The frame of a header whose longitude is named `longitude` (RA, GLON, ELON, ...).  RADESYS, else
 * RADECSYS, and EQUINOX, else EPOCH, tell it, as the FITS standard says: without them ICRS; with an
 * equinox alone FK4 before 1984, else FK5.  E_DATA, and e names it, for any but the two above.
 */
MUST_CHECK int frame_read(const struct header *h, const char *longitude, enum frame *f, struct err *e);

/* n positions, degrees, in place: galactic to J2000 and back; NaN stays NaN. */
void frame_from_galactic(size_t n, double *lon, double *lat);
void frame_to_galactic(size_t n, double *lon, double *lat);

#endif
