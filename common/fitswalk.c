/*
 * fitswalk.c - the structure of a FITS file, checked before it is believed.
 *
 * FITS 4.0: a header is cards of 80 printable characters in blocks of 2880
 * bytes, the mandatory ones first and in order (sections 4.4.1, 7), END last.
 * The data have |BITPIX|/8 * GCOUNT * (PCOUNT + NAXIS1 * NAXIS2 * ...) bytes,
 * padded to whole blocks.  Every product is checked for overflow and against
 * the length of the file.
 */
#include "fitswalk.h"
#include <ctype.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The last two bound what a small file, inflated, can make us hold; surveys stay far below. */
enum { CARD = 80, MOST_AXES = 999, MOST_HDUS = 4096, MOST_CARDS = 200000 };

/* What the messages need: which file, which HDU. */
struct walk {
    struct source *s;
    struct err *e;
    int hdu;
    size_t cards;          /* of the HDUs before */
};

__attribute__((format(printf, 2, 3)))
static int broken(const struct walk *w, const char *fmt, ...)
{
    char what[256];
    va_list ap;
    va_start(ap, fmt);
    vsnprintf(what, sizeof what, fmt, ap);
    va_end(ap);
    return err_set(w->e, E_DATA, "%s: HDU %d: %s", source_name(w->s), w->hdu, what);
}

void fits_walk_free(struct fits_unit *unit, int n)
{
    for (int i = 0; i < n; i++)
        header_free(&unit[i].cards);
    free(unit);
}

/* ---- cards ---- */

int fits_card_integer(const char *card, int64_t *value)
{
    if (card[8] != '=' || card[9] != ' ')
        return E_DATA;
    const char *p = card + 10;
    while (*p == ' ')
        p++;
    int minus = *p == '-';
    p += *p == '-' || *p == '+';
    if (!isdigit((unsigned char)*p))
        return E_DATA;
    int64_t v = 0;
    for (; isdigit((unsigned char)*p); p++)
        if (__builtin_mul_overflow(v, 10, &v) || __builtin_sub_overflow(v, *p - '0', &v))
            return E_DATA;
    while (*p == ' ')
        p++;
    if ((*p && *p != '/') || (!minus && v == INT64_MIN))
        return E_DATA;
    *value = minus ? v : -v;
    return OK;
}

static int is_card(const char *card, const char *name)
{
    int i = 0;
    while (i < 8 && name[i] && card[i] == name[i])
        i++;
    if (name[i] && i < 8)
        return 0;
    while (i < 8 && card[i] == ' ')
        i++;
    return i == 8;
}

/* Index of NAMEn in 1.., 0 when the card is not one. */
static int indexed(const char *card, const char *name)
{
    size_t len = strlen(name), i = len;
    int n = 0;
    if (strncmp(card, name, len) || card[i] == '0')
        return 0;
    for (; i < 8 && isdigit((unsigned char)card[i]); i++)
        n = 10 * n + (card[i] - '0');
    for (; i < 8; i++)
        if (card[i] != ' ')
            return 0;
    return n;
}

int fits_structural(const char *card, const struct fits_unit *u)
{
    static const char *const always[] = {
        "SIMPLE", "XTENSION", "BITPIX", "NAXIS", "EXTEND", "PCOUNT", "GCOUNT", "GROUPS", "END",
        "CHECKSUM", "DATASUM", "BSCALE", "BZERO", "BLANK", "DATAMIN", "DATAMAX", "BLOCKED",
        "INHERIT", "TFIELDS", "THEAP", "LONGSTRN"};
    static const char *const column[] = {"TTYPE", "TFORM", "TUNIT", "TNULL", "TSCAL", "TZERO",
                                         "TDISP", "TBCOL", "TDIM", "TCOMM", "TLMIN", "TLMAX",
                                         "TDMIN", "TDMAX"};
    static const char *const squeezed[] = {
        "ZIMAGE", "ZCMPTYPE", "ZBITPIX", "ZNAXIS", "ZMASKCMP", "ZQUANTIZ", "ZDITHER0", "ZSIMPLE",
        "ZEXTEND", "ZTENSION", "ZPCOUNT", "ZGCOUNT", "ZBLOCKED", "ZHECKSUM", "ZDATASUM", "ZBLANK",
        "ZSCALE", "ZZERO"};
    static const char *const squeezed_n[] = {"ZNAXIS", "ZTILE", "ZNAME", "ZVAL"};
    for (size_t i = 0; i < sizeof always / sizeof *always; i++)
        if (is_card(card, always[i]))
            return 1;
    if (indexed(card, "NAXIS"))
        return 1;
    for (size_t i = 0; u->kind != UNIT_IMAGE && i < sizeof column / sizeof *column; i++)
        if (indexed(card, column[i]))
            return 1;
    for (size_t i = 0; u->compressed && i < sizeof squeezed / sizeof *squeezed; i++)
        if (is_card(card, squeezed[i]))
            return 1;
    for (size_t i = 0; u->compressed && i < sizeof squeezed_n / sizeof *squeezed_n; i++)
        if (indexed(card, squeezed_n[i]))
            return 1;
    return 0;
}

/* ---- one header ---- */

/* Cards from `at` to END into u->cards; u->data_at is set. */
static int read_cards(const struct walk *w, uint64_t at, struct fits_unit *u)
{
    char block[FITS_BLOCK];
    uint64_t have;
    for (int ended = 0; !ended;) {
        int st = source_need(w->s, at + FITS_BLOCK, &have, w->e);
        if (st)
            return st;
        if (have < at + FITS_BLOCK)
            return broken(w, "header without END: file is cut");
        st = source_read(w->s, at, block, FITS_BLOCK, w->e);
        if (st)
            return st;
        at += FITS_BLOCK;
        for (int i = 0; i < FITS_BLOCK; i++)
            if (block[i] < ' ' || block[i] > '~')
                return broken(w, "header card %zu has a byte 0x%02X, which is not text",
                              u->cards.n + 1 + (size_t)i / CARD, (unsigned char)block[i]);
        for (const char *c = block; c < block + FITS_BLOCK; c += CARD) {
            char card[CARD + 1];
            memcpy(card, c, CARD);
            card[CARD] = 0;
            size_t blank = strspn(card, " ");
            if (w->cards + u->cards.n >= MOST_CARDS)
                return broken(w, "more than %d header cards", MOST_CARDS);
            if (ended) {
                if (blank != CARD)
                    return broken(w, "text after the END card");
            } else if (is_card(card, "END") && strspn(card + 3, " ") == CARD - 3) {
                ended = 1;
            } else {
                st = header_append(&u->cards, card);
                if (st)
                    return err_set(w->e, st, "%s: %s", source_name(w->s), err_text(st));
            }
        }
    }
    u->data_at = at;
    return OK;
}

/* Card number i must be NAME with a whole number in lo..hi. */
static int expect(const struct walk *w, const struct fits_unit *u, size_t i, const char *name,
                  int64_t lo, int64_t hi, int64_t *value)
{
    if (i >= u->cards.n || !is_card(u->cards.card[i], name))
        return broken(w, "card %zu is not %s", i + 1, name);
    if (fits_card_integer(u->cards.card[i], value))
        return broken(w, "%s is not a whole number", name);
    if (*value < lo || *value > hi)
        return broken(w, "%s = %lld is out of range", name, (long long)*value);
    return OK;
}

/* A mandatory card must not come a second time with another meaning. */
static int no_second(const struct walk *w, const struct fits_unit *u, size_t first)
{
    static const char *const once[] = {"SIMPLE", "XTENSION", "BITPIX", "NAXIS"};
    for (size_t i = first; i < u->cards.n; i++) {
        const char *c = u->cards.card[i];
        for (size_t k = 0; k < sizeof once / sizeof *once; k++)
            if (is_card(c, once[k]))
                return broken(w, "%s appears twice", once[k]);
        if (indexed(c, "NAXIS"))
            return broken(w, "%.8s appears twice or beyond NAXIS", c);
    }
    return OK;
}

static int first_card(const struct walk *w, struct fits_unit *u)
{
    static const struct {
        const char *name;
        enum unit_kind kind;
    } known[] = {{"IMAGE", UNIT_IMAGE}, {"BINTABLE", UNIT_BINTABLE}, {"A3DTABLE", UNIT_BINTABLE},
                 {"TABLE", UNIT_ASCII}};
    char name[72];
    int simple;
    if (w->hdu == 0) {
        if (u->cards.n == 0 || !is_card(u->cards.card[0], "SIMPLE") ||
            header_bool(&u->cards, "SIMPLE", &simple) || !simple)
            return broken(w, "does not start with SIMPLE = T: not a FITS file");
        u->kind = UNIT_IMAGE;
        return OK;
    }
    if (u->cards.n == 0 || !is_card(u->cards.card[0], "XTENSION") ||
        header_str(&u->cards, "XTENSION", name, sizeof name))
        return broken(w, "XTENSION is not text");
    u->kind = UNIT_OTHER;
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        if (!strcmp(name, known[i].name))
            u->kind = known[i].kind;
    return OK;
}

/* PCOUNT and GCOUNT: next two cards of an extension, anywhere with random groups. */
static int counts(const struct walk *w, struct fits_unit *u, size_t next, int64_t *pcount,
                  int64_t *gcount)
{
    int groups = 0;
    *pcount = 0;
    *gcount = 1;
    if (w->hdu > 0) {
        int st = expect(w, u, next, "PCOUNT", 0, INT64_MAX, pcount);
        return st ? st : expect(w, u, next + 1, "GCOUNT", 1, INT64_MAX, gcount);
    }
    if (u->naxis > 0 && u->axis[0] == 0 && header_bool(&u->cards, "GROUPS", &groups) == OK && groups) {
        long p, g;
        if (header_long(&u->cards, "PCOUNT", &p) || header_long(&u->cards, "GCOUNT", &g) || p < 0 || g < 1)
            return broken(w, "random groups without PCOUNT and GCOUNT");
        *pcount = p;
        *gcount = g;
        u->kind = UNIT_GROUPS;
    }
    return OK;
}

/* Mandatory cards in order; u->data_size. */
static int read_structure(const struct walk *w, struct fits_unit *u)
{
    int64_t bitpix, naxis, length, pcount, gcount;
    uint64_t product = 1;
    int overflow = 0;
    int st = first_card(w, u);
    if (st == OK)
        st = expect(w, u, 1, "BITPIX", -64, 64, &bitpix);
    if (st)
        return st;
    if (bitpix != 8 && bitpix != 16 && bitpix != 32 && bitpix != 64 && bitpix != -32 && bitpix != -64)
        return broken(w, "BITPIX = %lld is not one of 8 16 32 64 -32 -64", (long long)bitpix);
    st = expect(w, u, 2, "NAXIS", 0, MOST_AXES, &naxis);
    if (st)
        return st;
    u->bitpix = (int)bitpix;
    u->naxis = (int)naxis;
    u->axis[0] = u->axis[1] = u->axis[2] = 1;
    for (int i = 0; i < naxis; i++) {
        char name[24];
        snprintf(name, sizeof name, "NAXIS%d", i + 1);
        st = expect(w, u, 3 + (size_t)i, name, 0, INT64_MAX, &length);
        if (st)
            return st;
        if (i < 3)
            u->axis[i] = (uint64_t)length;
        else if (length != 1)
            u->more_axes = 1;
        if (i > 0 || length > 0)              /* NAXIS1 = 0: empty, or random groups */
            overflow |= __builtin_mul_overflow(product, (uint64_t)length, &product);
    }
    size_t next = 3 + (size_t)naxis;
    st = counts(w, u, next, &pcount, &gcount);
    if (st == OK)
        st = no_second(w, u, next);
    if (st)
        return st;
    if (naxis == 0 || (u->axis[0] == 0 && u->kind != UNIT_GROUPS))
        product = 0;
    u->pcount = (uint64_t)pcount;
    overflow |= __builtin_add_overflow(product, (uint64_t)pcount, &product);
    overflow |= __builtin_mul_overflow(product, (uint64_t)gcount, &product);
    overflow |= __builtin_mul_overflow(product, (uint64_t)(llabs(bitpix) / 8), &product);
    if (overflow || product > INT64_MAX / 2)
        return broken(w, "the size of the data overflows");
    if (u->kind == UNIT_BINTABLE && (bitpix != 8 || naxis != 2 || gcount != 1))
        return broken(w, "a binary table needs BITPIX = 8, NAXIS = 2, GCOUNT = 1");
    if (u->kind == UNIT_IMAGE && w->hdu > 0 && (pcount != 0 || gcount != 1))
        return broken(w, "an image needs PCOUNT = 0, GCOUNT = 1");
    u->data_size = product;
    return OK;
}

/* An optional real card; E_DATA with a message when it is there but no number. */
static int optional(const struct walk *w, const struct fits_unit *u, const char *name, double *value)
{
    int st = header_double(&u->cards, name, value);
    return st == OK || st == E_MISSING ? OK : broken(w, "%s is not a number", name);
}

static int read_meaning(const struct walk *w, struct fits_unit *u)
{
    u->bscale = 1;
    u->bzero = 0;
    u->extver = 1;
    if (header_str(&u->cards, "EXTNAME", u->extname, sizeof u->extname))
        u->extname[0] = 0;
    if (header_long(&u->cards, "EXTVER", &u->extver))
        u->extver = 1;
    int z;
    u->compressed = u->kind == UNIT_BINTABLE && header_bool(&u->cards, "ZIMAGE", &z) == OK && z;
    if (u->kind != UNIT_IMAGE)
        return OK;
    int st = optional(w, u, "BSCALE", &u->bscale);
    if (st == OK)
        st = optional(w, u, "BZERO", &u->bzero);
    if (st)
        return st;
    if (u->bscale == 0)
        return broken(w, "BSCALE = 0 makes every pixel the same");
    for (size_t i = 0; i < u->cards.n && u->bitpix > 0; i++)
        if (is_card(u->cards.card[i], "BLANK")) {
            if (fits_card_integer(u->cards.card[i], &u->blank))
                return broken(w, "BLANK is not a whole number");
            u->has_blank = 1;
            break;
        }
    return OK;
}

/* ---- the file ---- */

/* What follows the last HDU: nothing, padding, or whole special records. */
static int read_end(const struct walk *w, uint64_t at)
{
    uint64_t rest;
    int blank;
    int st = source_drain(w->s, at, &rest, &blank, w->e);
    if (st || rest == 0 || blank || rest % FITS_BLOCK == 0)
        return st;
    return err_set(w->e, E_DATA, "%s: %llu bytes after HDU %d that are neither an HDU nor padding",
                   source_name(w->s), (unsigned long long)rest, w->hdu - 1);
}

/* 1 when another HDU starts at `at`. */
static int another(const struct walk *w, uint64_t at, int *more)
{
    char start[8];
    uint64_t have;
    int st = source_need(w->s, at + 8, &have, w->e);
    *more = 0;
    if (st || have < at + 8)
        return st;
    st = source_read(w->s, at, start, 8, w->e);
    if (st)
        return st;
    if (!memcmp(start, "SIMPLE  ", 8))
        return broken(w, "a second FITS file begins here");
    *more = !memcmp(start, "XTENSION", 8);
    return OK;
}

static int walk_unit(const struct walk *w, uint64_t at, struct fits_unit *u, uint64_t *end)
{
    uint64_t have;
    int st = read_cards(w, at, u);
    if (st == OK)
        st = read_structure(w, u);
    if (st == OK)
        st = read_meaning(w, u);
    if (st)
        return st;
    *end = u->data_at + (u->data_size + FITS_BLOCK - 1) / FITS_BLOCK * FITS_BLOCK;
    st = source_need(w->s, *end, &have, w->e);
    if (st == OK && have < *end)
        st = broken(w, "file is cut: the header asks for %llu bytes up to here, %llu are there",
                    (unsigned long long)*end, (unsigned long long)have);
    return st;
}

/* Tell an empty file and other formats apart before speaking of headers. */
static int first_bytes(struct source *s, uint64_t have, struct err *e)
{
    char start[8];
    if (have == 0)
        return err_set(e, E_DATA, "%s: is empty", source_name(s));
    int st = have < 8 ? OK : source_read(s, 0, start, 8, e);
    if (st == OK && (have < 8 || memcmp(start, "SIMPLE  ", 8)))
        st = err_set(e, E_DATA, "%s: is not a FITS file (it does not start with SIMPLE)", source_name(s));
    return st;
}

int fits_walk(struct source *s, struct fits_unit **unit, int *n, struct err *e)
{
    struct walk w = {.s = s, .e = e};
    struct fits_unit *list = NULL;
    uint64_t at = 0, have;
    int cap = 0, more = 1, st = source_need(s, 8, &have, e);
    if (st == OK)
        st = first_bytes(s, have, e);
    while (st == OK && more) {
        if (w.hdu == MOST_HDUS) {
            st = broken(&w, "more than %d HDUs", MOST_HDUS);
            break;
        }
        if (w.hdu == cap) {
            cap = cap ? 2 * cap : 4;
            void *p = realloc(list, (size_t)cap * sizeof *list);
            if (!p) {
                st = err_set(e, E_NOMEM, "%s: out of memory", source_name(s));
                break;
            }
            list = p;
        }
        list[w.hdu] = (struct fits_unit){0};
        st = walk_unit(&w, at, &list[w.hdu], &at);
        w.cards += list[w.hdu].cards.n;
        w.hdu++;
        if (st == OK)
            st = another(&w, at, &more);
    }
    if (st == OK)
        st = read_end(&w, at);
    if (st) {
        fits_walk_free(list, w.hdu);
        return st;
    }
    *unit = list;
    *n = w.hdu;
    return OK;
}
