/*
 * header.h - FITS header cards in memory: get, set, copy by class.
 *
 * Cards are kept as the 80 characters of the file, so that what a program does
 * not know passes through it unchanged.  Structural cards (SIMPLE, BITPIX,
 * NAXISn, EXTEND, PCOUNT, GCOUNT, XTENSION, END, CHECKSUM, DATASUM, BSCALE,
 * BZERO, BLANK) never are in a struct header: imageio makes them.
 */
#ifndef PIXSHEAR_HEADER_H
#define PIXSHEAR_HEADER_H

#include "err.h"
#include <stddef.h>
#include <stdint.h>

struct header {
    size_t n, cap;
    char (*card)[81];      /* NUL-terminated, exactly 80 characters each */
};

void header_free(struct header *h);

/* to = a copy of from (to is overwritten, not freed). */
MUST_CHECK int header_copy(struct header *to, const struct header *from);

/* Append one card of up to 80 characters, padded with blanks. */
MUST_CHECK int header_append(struct header *h, const char *card);

/*
 * Value of the first card named `key`.  OK; E_MISSING when there is none;
 * E_DATA when it is of another type, not a whole number, or not finite.
 * header_str copies at most size-1 characters, trailing blanks removed, and
 * follows CONTINUE cards.
 */
MUST_CHECK int header_double(const struct header *h, const char *key, double *value);
MUST_CHECK int header_long(const struct header *h, const char *key, long *value);
MUST_CHECK int header_bool(const struct header *h, const char *key, int *value);
MUST_CHECK int header_str(const struct header *h, const char *key, char *value, size_t size);

/* The value if there is a valid one, else `otherwise`. */
double header_double_or(const struct header *h, const char *key, double otherwise);

/*
 * Replace the first card named `key`, or append one; later cards of that name
 * are removed.  Doubles are written with up to 17 significant digits, as few
 * as give the same bits back.  `comment` may be NULL.
 */
MUST_CHECK int header_set_double(struct header *h, const char *key, double v, const char *comment);
MUST_CHECK int header_set_long(struct header *h, const char *key, long v, const char *comment);
MUST_CHECK int header_set_bool(struct header *h, const char *key, int v, const char *comment);
MUST_CHECK int header_set_str(struct header *h, const char *key, const char *v, const char *comment);

/* Remove every card named `key`; "PV*" and "A_*" style trailing stars match a prefix. */
void header_remove(struct header *h, const char *key);

/* Append `text` as HISTORY cards of at most 72 characters, wrapped at blanks. */
MUST_CHECK int header_history(struct header *h, const char *text);

#endif
