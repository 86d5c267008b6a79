/*
 * detectcat.h - detections as a catalogue: which columns exist, their units
 * and meanings, and how they follow from a measured object.
 */
#ifndef PIXSHEAR_DETECTCAT_H
#define PIXSHEAR_DETECTCAT_H

#include "detect.h"
#include "err.h"
#include "sky.h"
#include "table.h"

struct detectcat {
    const char *columns;       /* "NAME,NAME,..." in that order; "+NAME,..." after the default ones; NULL: default */
    double zeropoint;          /* magnitude of 1 unit of the image */
    double scale;              /* arcsec per pixel; 0 unknown: no MU_MAX */
    struct sky *sky;           /* NULL: no ALPHA_J2000 and DELTA_J2000 */
    size_t napertures;         /* columns FLUX_APER, FLUX_APER_2, ... and errors and magnitudes */
    size_t nfractions;         /* columns FLUX_RADIUS_2, ... */
    const char *unit;          /* of fluxes: the image's */
};

/* Fill an empty table. E_MISSING: a column that does not exist or cannot be made; e names it. */
MUST_CHECK int detectcat_fill(struct table *t, const struct detection *d, const struct detectcat *c,
                              struct err *e);

/* Name of column i, NULL after the last. */
const char *detectcat_name(size_t i);

/* 1, and the name, when the list has one that is not a column. */
int detectcat_unknown(const char *columns, char name[64]);

/* 1 when the list asks for XWIN_IMAGE or YWIN_IMAGE. */
int detectcat_windowed(const char *columns);

/* 1 when the list asks for errors of positions. */
int detectcat_errors(const char *columns);

/* 1 when FWHM_IMAGE or STAR_PROB will be there. */
int detectcat_sizes(const char *columns);

#endif
