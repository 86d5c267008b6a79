/*
 * unpack.h - tile-compressed images (FITS 4.0, section 10.1), decoded by
 * cfitsio in a child process that has little memory, little time and no files.
 *
 * The decoders are the part of the FITS stack that broken data can crash; a
 * crash, a hang or a flood is then an error of this one image.  The library is
 * loaded by the child when the first such image is read: it costs 7 ms.
 * Private to the FITS readers.
 */
#ifndef PIXSHEAR_UNPACK_H
#define PIXSHEAR_UNPACK_H

#include "err.h"
#include "fitswalk.h"
#include "source.h"

/* What the Z keywords of a compressed HDU say about its image. */
struct unpack_shape {
    int bitpix, naxis;
    long axis[3];          /* pixels; 1 where there is no axis */
    int more_axes;         /* an axis after the third is longer than 1 */
    double tile, cached;   /* pixels of a tile, and of the tiles side by side */
};

/*
 * Read and check the Z keywords: a known algorithm, sides of 1..65535, as many
 * rows of the table as tiles, tiles no larger than the length of the data backs
 * (1100 bytes a byte, which gzip reaches, over 4 MiB).  *why tells what is wrong (E_DATA).
 */
MUST_CHECK int unpack_shape(struct unpack_shape *s, const struct fits_unit *u, const char **why);

struct unpack;             /* a child process and the memory shared with it */

/* Start a decoder of this HDU.  It holds the compressed bytes: at most max_memory.  Messages say `hdu`. */
MUST_CHECK int unpack_open(struct unpack **u, struct source *src, const struct fits_unit *unit, int hdu,
                           double max_memory, struct err *e);
/* Ends the child; u may be NULL. */
void unpack_close(struct unpack *u);

/*
 * Rows y0, y0 + 1, ... of plane z: *pix points at *got * nx values (scaled, missing
 * ones NaN) until the next call; 1 <= *got <= nrow.  E_DATA, E_NOMEM with the cause.
 */
MUST_CHECK int unpack_rows(struct unpack *u, long z, long y0, long nrow, const double **pix, long *got,
                           struct err *e);

#endif
