/*
 * fitsout.h - what the writers of images and tables share: one HDU as cards
 * and a stream of bytes, with its checksums.  Private to the FITS writers.
 */
#ifndef PIXSHEAR_FITSOUT_H
#define PIXSHEAR_FITSOUT_H

#include "err.h"
#include "header.h"
#include "imageio.h"
#include <stddef.h>
#include <stdint.h>

/* HDUs begun so far. */
int fits_out_count(const struct fits_out *f);

/*
 * Finish the HDU before and begin one: `cards` are all of its cards but
 * CHECKSUM, DATASUM and END; data_size bytes will follow.
 */
MUST_CHECK int fits_out_begin(struct fits_out *f, const struct header *cards, uint64_t data_size,
                              struct err *e);

/* The next n bytes of the data. */
MUST_CHECK int fits_out_bytes(struct fits_out *f, const void *buf, size_t n, struct err *e);

#endif
