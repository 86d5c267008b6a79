/*
 * exposure.h - the exposures of a FITS file and what their headers say.
 *
 * A file holds its exposures as image extensions named SCI, or one exposure as
 * its first image.  A name with a suffix ([2], [SCI,3]) selects one HDU.
 */
#ifndef PIXSHEAR_EXPOSURE_H
#define PIXSHEAR_EXPOSURE_H

#include "err.h"
#include "header.h"
#include "imageio.h"
#include <stddef.h>

enum exposure_unit { UNIT_NONE, UNIT_ELECTRON, UNIT_RATE, UNIT_ADU, UNIT_OTHER };

struct exposure {
    int index;             /* HDU */
    long nx, ny;
    struct header hdr;
    enum exposure_unit unit;   /* BUNIT, case and plural ignored; UNIT_NONE without one */
    double exptime;        /* EXPTIME, s; NaN when missing */
    double tottime;        /* TOTTIME, s, of all exposures of the observation; else EXPTIME */
    double magzero;        /* MAGZERO of BUNIT; NaN when missing */
    double scale;          /* PIXSCALE, else of the WCS, arcsec; NaN when unknown */
    double ratio;          /* longest diameter of a pixel on the sky over the shortest, by the WCS; 1 without one */
    double gain;           /* GAIN, electrons per unit; NaN when missing */
    long expnum;           /* EXPNUM, -1 when missing */
};

/*
 * What a header says of its exposure, into the fields of x from `unit` on; the
 * others stay.  E_DATA, and x is left alone, when a keyword that must be a
 * number (those here, SKYLEVEL, SATURATE, RDNOISE, NOISECOR, PSFFWHM, CCDSCALE) is not, a time, gain or scale is not positive, or PIXSCALE contradicts
 * the WCS by more than 1e-3.  `label` begins the messages.
 */
MUST_CHECK int exposure_keywords(const struct header *h, const char *label, struct exposure *x, struct err *e);

/*
 * For programs to which a pixel is a square: OK to 1 %, E_RANGE (to be told: cameras distort, HST's by up to 15 %) to a factor 1.5,
 * E_DATA (refuse) beyond; e tells.
 */
MUST_CHECK int exposure_square(const struct exposure *x, const char *label, struct err *e);

/*
 * HDU indices of the exposures of an open file: *list is allocated, *n of them.
 * E_DATA when there is none or one is a cube.
 */
MUST_CHECK int exposure_list(const struct fits_in *f, const char *name, int **list, size_t *n, struct err *e);

/*
 * Header and keywords of one HDU, checked as above; x->hdr is the caller's to free.
 */
MUST_CHECK int exposure_read(struct fits_in *f, const char *name, int index, struct exposure *x, struct err *e);

/* "name[EXTNAME,EXTVER]" or "name", for messages. */
void exposure_label(const struct fits_in *f, const char *name, int index, char *label, size_t size);

/* Scale CRPIX and the matrix of a WCS: CRPIX = (CRPIX - 1 - shift)/factor + 1, CD and CDELT times factor. */
MUST_CHECK int exposure_rescale_wcs(struct header *h, double shift_x, double shift_y, double factor);

/* Remove every WCS card (alternative systems and distortions too). */
void exposure_remove_wcs(struct header *h);

/* Append the WCS cards of `from`. */
MUST_CHECK int exposure_copy_wcs(struct header *to, const struct header *from);

#endif
