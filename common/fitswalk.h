/*
 * fitswalk.h - the structure of a FITS file, checked HDU by HDU against the
 * standard and the length of the file before anything is believed.
 * Private to the FITS readers (imageio.c, fitstable.c).
 */
#ifndef PIXSHEAR_FITSWALK_H
#define PIXSHEAR_FITSWALK_H

#include "err.h"
#include "header.h"
#include "source.h"
#include <stdint.h>

enum unit_kind { UNIT_IMAGE, UNIT_BINTABLE, UNIT_ASCII, UNIT_GROUPS, UNIT_OTHER };

enum { FITS_BLOCK = 2880 };

/* One HDU. */
struct fits_unit {
    enum unit_kind kind;
    int compressed;            /* a tile-compressed image in a binary table */
    int bitpix, naxis;
    uint64_t axis[3];          /* lengths of the first axes, 1 where there is none */
    int more_axes;             /* an axis after the third is longer than 1 */
    uint64_t pcount;
    uint64_t data_at, data_size;   /* bytes of the file; size without padding */
    double bscale, bzero;
    int has_blank;
    int64_t blank;
    char extname[72];
    long extver;
    struct header cards;       /* all of them but END */
};

/*
 * Walk the file.  *unit (n of them) is allocated; free with fits_walk_free.
 * E_DATA with the cause for anything the standard forbids: mandatory cards
 * missing, repeated or out of order, sizes that overflow or that the file does
 * not have, characters that are not printable ASCII, bytes after the last HDU
 * that are neither padding nor whole special records; more than 4096 HDUs or
 * 200000 cards (a small gzip file could hold millions).
 */
MUST_CHECK int fits_walk(struct source *s, struct fits_unit **unit, int *n, struct err *e);
void fits_walk_free(struct fits_unit *unit, int n);

/* 1 for cards that describe the structure of an HDU of this kind, not its content. */
int fits_structural(const char *card, const struct fits_unit *u);

/* Whole number of a card "NAME    = 123"; 0 on success. */
int fits_card_integer(const char *card, int64_t *value);

/* An open file, as imageio.c makes it and fitstable.c sees it. */
struct fits_in {
    struct source *src;
    struct fits_unit *unit;
    struct hdu *hdu;           /* what imageio.h shows of each unit */
    int n;
    struct unpack **unpack;    /* decoder of each tile-compressed HDU, NULL until its pixels are read */
    double max_memory;
    int chosen;                /* HDU of the name's suffix, -1 without a suffix */
    const struct fits_unit *shown;     /* of image_open: the HDU, and its data in memory */
    const unsigned char *shown_at;
};

#endif
