/* ldac.c - FITS_LDAC output; see ldac.h. */
#include "ldac.h"
#include "fitsout.h"
#include "imageio.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { CARD = 80, STRUCTURE = 5 };         /* SIMPLE BITPIX NAXIS NAXIS1 NAXIS2 */

static void put_card(char *to, const char *text)
{
    size_t n = strlen(text);
    n = n < CARD ? n : CARD;
    memset(to, ' ', CARD);
    memcpy(to, text, n);
}

/* All cards of the image, END included; *n of them. Allocated, NULL without memory. */
static char *image_cards(const struct image *im, size_t *n)
{
    *n = STRUCTURE + im->hdr.n + 1;
    char *cards = malloc(*n * CARD), text[STRUCTURE][CARD + 1];
    if (!cards)
        return NULL;
    snprintf(text[0], sizeof text[0], "SIMPLE  = %20s", "T");
    snprintf(text[1], sizeof text[1], "BITPIX  = %20d", -32);
    snprintf(text[2], sizeof text[2], "NAXIS   = %20d", 2);
    snprintf(text[3], sizeof text[3], "NAXIS1  = %20ld", im->nx);
    snprintf(text[4], sizeof text[4], "NAXIS2  = %20ld", im->ny);
    for (size_t i = 0; i < STRUCTURE; i++)
        put_card(cards + i * CARD, text[i]);
    for (size_t i = 0; i < im->hdr.n; i++)
        put_card(cards + (STRUCTURE + i) * CARD, im->hdr.card[i]);
    put_card(cards + (*n - 1) * CARD, "END");
    return cards;
}

static int head_cards(struct header *h, size_t n)
{
    char form[32], dim[32];
    snprintf(form, sizeof form, "%zuA", n * CARD);
    snprintf(dim, sizeof dim, "(%d,%zu)", CARD, n);
    int st = header_set_str(h, "XTENSION", "BINTABLE", "binary table");
    static const char *const key[] = {"BITPIX", "NAXIS", "NAXIS1", "NAXIS2", "PCOUNT", "GCOUNT", "TFIELDS"};
    const long value[] = {8, 2, (long)(n * CARD), 1, 0, 1, 1};
    for (size_t i = 0; i < sizeof key / sizeof *key && !st; i++)
        st = header_set_long(h, key[i], value[i], "");
    if (!st)
        st = header_set_str(h, "TTYPE1", "Field Header Card", "");
    if (!st)
        st = header_set_str(h, "TFORM1", form, "");
    if (!st)
        st = header_set_str(h, "TDIM1", dim, "");
    return st ? st : header_set_str(h, "EXTNAME", "LDAC_IMHEAD", "");
}

static int put_head(struct fits_out *f, const struct image *im, struct err *e)
{
    size_t n;
    struct header h = {0};
    char *cards = image_cards(im, &n);
    int st = cards ? head_cards(&h, n) : E_NOMEM;
    if (st)
        err_set(e, st, "%s", err_text(st));
    if (!st)
        st = fits_out_begin(f, &h, n * CARD, e);
    if (!st)
        st = fits_out_bytes(f, cards, n * CARD, e);
    header_free(&h);
    free(cards);
    return st;
}

int ldac_write(const struct table *t, const struct image *im, const char *name, const char *record,
               const char *const *inputs, size_t n_inputs, struct err *e)
{
    struct table copy = {0};
    struct fits_out *f;
    if (table_copy(&copy, t) || (record && table_history(&copy, record))) {
        table_free(&copy);
        return err_set(e, E_NOMEM, "%s: %s", name, err_text(E_NOMEM));
    }
    int st = fits_out_open(&f, name, inputs, n_inputs, e);
    if (!st) {
        st = fits_out_hdu(f, -32, 0, 0, 1, NULL, e);
        if (!st)
            st = put_head(f, im, e);
        if (!st)
            st = fits_out_table(f, &copy, "LDAC_OBJECTS", e);
        if (st)
            fits_out_abandon(f);
        else
            st = fits_out_commit(f, e);
    }
    table_free(&copy);
    return st;
}
