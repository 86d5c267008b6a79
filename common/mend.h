/*
 * mend.h - bad pixels of an image bridged for its detection, row by row.
 *
 * A bad pixel takes the value on the line between the good ones on both sides
 * in its row when at most MEND_MOST bad ones lie between them, else in its
 * column; so a star that dead columns cut is found in one piece.  What lies
 * deeper stays bad.
 */
#ifndef PIXSHEAR_MEND_H
#define PIXSHEAR_MEND_H

#include "background.h"
#include "err.h"
#include "pixels.h"

enum { MEND_MOST = 16 };

enum { PIXEL_GOOD, PIXEL_BAD, PIXEL_MENDED };

struct mend {
    const struct pixels *im;
    const struct background *b;
    const float *rms_map;  /* per pixel, not finite: bad; or NULL */
    long y;                /* the row that comes next */
    unsigned char *above;  /* per column: bad pixels directly above it, not counted beyond MEND_MOST + 1; owned */
    float *row;            /* the pixels of the row; owned */
};

/* Scratch for the image; what it points to must stay. */
MUST_CHECK int mend_new(struct mend *m, const struct pixels *im, const struct background *b, const float *rms_map);
void mend_free(struct mend *m);

/* Row y comes next. */
void mend_seek(struct mend *m, long y);

/*
 * The next row: v (its pixels above background, anything where bad) is bridged,
 * 0 where it stays bad; kind: what each pixel is; rms (NULL without a map): its
 * rms, bridged likewise.
 */
void mend_row(struct mend *m, float *v, unsigned char *kind, float *rms);

#endif
