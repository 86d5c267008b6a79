/*
 * png.h - grey PNG pictures of 8 bits, row by row into an outfile (PNG
 * specification, second edition).  The only other user of zlib is source.c.
 */
#ifndef PIXSHEAR_PNG_H
#define PIXSHEAR_PNG_H

#include "err.h"
#include "outfile.h"

struct png;

/* Begin a picture of nx x ny pixels, 1 to 2^31-1 a side; with alpha, rows are grey, alpha pairs. */
MUST_CHECK int png_open(struct png **p, struct outfile *o, long nx, long ny, int alpha);

/* The next row from the top: nx bytes, or 2 nx with alpha. */
MUST_CHECK int png_row(struct png *p, const unsigned char *row);

/* Finish after ny rows (E_RANGE else); frees p whatever happens, leaves the outfile open. */
MUST_CHECK int png_finish(struct png *p);
void png_abandon(struct png *p);

#endif
