/*
 * fitsout.c - FITS files, out.
 *
 * An HDU is written card by card and block by block through outfile; its two
 * checksums (FITS 4.0, section 4.4.2.7 and appendix J) are put into the header
 * when the data are complete.  No clock, no library, so the same bytes come
 * out in every run, to a file as to a pipe.
 */
#include "fitsout.h"
#include "fitswalk.h"
#include "outfile.h"
#include "simd.h"
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { BLOCK = 128 << 10, CARD = 80 };

/* An HDU that is not complete. */
struct part {
    int index;
    char *head;            /* its header, whole blocks; NULL: no HDU */
    size_t head_size;
    size_t checksum_at, datasum_at;   /* of the two cards in head */
    uint64_t head_at;      /* of the header in the file */
    uint64_t left;         /* bytes of data to come */
    uint64_t size;         /* bytes of data in all */
    uint32_t sum;          /* ones' complement sum of the data */
    unsigned phase;        /* bytes of the data so far, modulo 4 */
    int bitpix;            /* of an image; 0 in tables */
    long nx, ny, nz;
};

struct fits_out {
    struct outfile *o;
    char *name;
    int n;                 /* HDUs begun */
    struct part now;       /* the one being written */
    struct part *slot;     /* those whose rows come in any order */
    int slots;
    unsigned char *block;
};

/* ---- checksums ---- */

static uint32_t fold(uint64_t sum)
{
    while (sum >> 32)
        sum = (sum & 0xffffffffu) + (sum >> 32);
    return (uint32_t)sum;
}

/* Ones' complement sum of bytes taken as big-endian words, the first at byte `phase` of a word. */
static uint32_t add_bytes(uint32_t sum, unsigned phase, const unsigned char *p, size_t n)
{
    uint64_t total = sum;
    for (; n && phase & 3; n--, phase++)
        total += (uint64_t)*p++ << (24 - 8 * (phase & 3));
    for (; n >= 4; n -= 4, p += 4)
        total += (uint64_t)p[0] << 24 | (uint64_t)p[1] << 16 | (uint64_t)p[2] << 8 | p[3];
    for (unsigned i = 0; i < n; i++)
        total += (uint64_t)p[i] << (24 - 8 * i);
    return fold(total);
}

/* The 16 letters and digits that make the sum of the HDU all ones. */
static void encode(uint32_t sum, char text[17])
{
    uint32_t value = ~sum;
    char by_byte[16];
    for (int i = 0; i < 4; i++) {
        int byte = (int)(value >> (24 - 8 * i) & 0xff);
        int c[4] = {byte / 4 + byte % 4 + '0', byte / 4 + '0', byte / 4 + '0', byte / 4 + '0'};
        for (int again = 1; again;) {          /* step round punctuation, in pairs */
            again = 0;
            for (int j = 0; j < 4; j += 2)
                for (int k = j; k < j + 2; k++)
                    if ((c[k] >= 0x3a && c[k] <= 0x40) || (c[k] >= 0x5b && c[k] <= 0x60)) {
                        c[j]++;
                        c[j + 1]--;
                        again = 1;
                        break;
                    }
        }
        for (int j = 0; j < 4; j++)
            by_byte[4 * j + i] = (char)c[j];
    }
    for (int i = 0; i < 16; i++)
        text[i] = by_byte[(i + 15) % 16];
    text[16] = 0;
}

static void put_card(char *at, const char *text)
{
    size_t n = strnlen(text, CARD);
    memcpy(at, text, n);
    memset(at + n, ' ', CARD - n);
}

/* ---- an HDU as cards and bytes ---- */

static int cannot_write(struct fits_out *f, struct err *e)
{
    return err_set(e, E_IO, "%s: cannot write: %s", f->name, strerror(errno));
}

static int no_memory(struct fits_out *f, struct err *e)
{
    return err_set(e, E_NOMEM, "%s: out of memory", f->name);
}

static int emit(struct fits_out *f, const void *buf, size_t n, struct err *e)
{
    int st = outfile_write(f->o, buf, n);
    return st == E_NOMEM ? no_memory(f, e) : st ? cannot_write(f, e) : OK;
}

/* Bytes that fill the last block of an HDU's data. */
static size_t padding(const struct part *p)
{
    return (FITS_BLOCK - (size_t)(p->size % FITS_BLOCK)) % FITS_BLOCK;
}

/* Checksums of an HDU that has all its data. */
static int seal(struct fits_out *f, struct part *p, struct err *e)
{
    char text[CARD + 1], code[17];
    if (p->left)
        return err_set(e, E_RANGE, "%s: HDU %d: %llu bytes of data were not written", f->name,
                       p->index, (unsigned long long)p->left);
    snprintf(text, sizeof text, "DATASUM = '%-10u'         / data unit checksum", p->sum);
    put_card(p->head + p->datasum_at, text);
    encode(add_bytes(p->sum, 0, (unsigned char *)p->head, p->head_size), code);
    memcpy(p->head + p->checksum_at + 11, code, 16);
    if (outfile_patch(f->o, p->head_at, p->head, p->head_size))
        return cannot_write(f, e);
    free(p->head);
    p->head = NULL;
    return OK;
}

static const unsigned char zeros[FITS_BLOCK];

/* Padding and checksums of the HDU before. */
static int finish(struct fits_out *f, struct err *e)
{
    if (!f->now.head)
        return OK;
    size_t pad = f->now.left ? 0 : padding(&f->now);
    int st = pad ? emit(f, zeros, pad, e) : OK;
    return st ? st : seal(f, &f->now, e);
}

int fits_out_count(const struct fits_out *f)
{
    return f->n;
}

int fits_out_begin(struct fits_out *f, const struct header *cards, uint64_t data_size, struct err *e)
{
    int st = finish(f, e);
    if (st)
        return st;
    size_t n = cards->n + 3;
    size_t size = (n * CARD + FITS_BLOCK - 1) / FITS_BLOCK * FITS_BLOCK;
    char *p = malloc(size);
    if (!p)
        return no_memory(f, e);
    f->now = (struct part){
        .index = f->n, .head = p, .head_size = size, .checksum_at = cards->n * CARD, .datasum_at = (cards->n + 1) * CARD,
        .head_at = outfile_size(f->o), .left = data_size, .size = data_size,
    };
    memset(p, ' ', size);
    for (size_t i = 0; i < cards->n; i++, p += CARD)
        memcpy(p, cards->card[i], CARD);
    put_card(p, "CHECKSUM= '0000000000000000'   / HDU checksum");
    put_card(p + CARD, "DATASUM = '0         '         / data unit checksum");
    put_card(p + 2 * CARD, "END");
    f->n++;
    outfile_expect(f->o, size + data_size + padding(&f->now));
    return emit(f, f->now.head, size, e);
}

int fits_out_bytes(struct fits_out *f, const void *buf, size_t n, struct err *e)
{
    struct part *p = &f->now;
    if (n > p->left)
        return err_set(e, E_RANGE, "%s: HDU %d: too many bytes of data", f->name, p->index);
    p->sum = add_bytes(p->sum, p->phase, buf, n);
    p->phase = (unsigned)((p->phase + n) & 3);
    p->left -= n;
    return emit(f, buf, n, e);
}

/* ---- the file ---- */

int fits_out_open(struct fits_out **out, const char *name, const char *const *inputs,
                  size_t n_inputs, struct err *e)
{
    *out = NULL;
    if (!strcmp(name, "-") && isatty(STDOUT_FILENO))
        return err_set(e, E_IO, "standard output: is a terminal: redirect it or give a file name");
    struct fits_out *f = calloc(1, sizeof *f);
    if (f) {
        f->name = strdup(strcmp(name, "-") ? name : "standard output");
        f->block = malloc(BLOCK);
    }
    int st = f && f->name && f->block ? outfile_open(&f->o, name, inputs, n_inputs, e)
                                      : err_set(e, E_NOMEM, "%s: out of memory", name);
    if (st)
        fits_out_abandon(f);
    else
        *out = f;
    return st;
}

void fits_out_abandon(struct fits_out *f)
{
    if (!f)
        return;
    outfile_abandon(f->o);
    for (int i = 0; i < f->slots; i++)
        free(f->slot[i].head);
    free(f->slot);
    free(f->now.head);
    free(f->block);
    free(f->name);
    free(f);
}

int fits_out_commit(struct fits_out *f, struct err *e)
{
    int st = f->n ? finish(f, e) : err_set(e, E_RANGE, "%s: no HDU was written", f->name);
    for (int i = 0; i < f->slots && st == OK; i++) {
        struct part *p = &f->slot[i];
        const uint64_t end = p->head_at + p->head_size + p->size;
        st = outfile_patch(f->o, end, zeros, padding(p)) ? cannot_write(f, e) : seal(f, p, e);
    }
    if (st == OK) {
        st = outfile_commit(f->o, e);
        f->o = NULL;
    }
    fits_out_abandon(f);
    return st;
}

/* ---- images ---- */

static int continued(const struct header *h)
{
    for (size_t i = 0; i < h->n; i++)
        if (!memcmp(h->card[i], "CONTINUE", 8))
            return 1;
    return 0;
}

/* Structural cards, then the others of h. */
static int image_cards(struct header *c, int first, int bitpix, const long *side, int naxis,
                       const struct header *h)
{
    const struct fits_unit image = {.kind = UNIT_IMAGE};
    int st = first ? header_set_bool(c, "SIMPLE", 1, "conforms to FITS standard")
                   : header_set_str(c, "XTENSION", "IMAGE", "image extension");
    if (st == OK)
        st = header_set_long(c, "BITPIX", bitpix, "type of the pixels");
    if (st == OK)
        st = header_set_long(c, "NAXIS", naxis, "number of axes");
    for (int i = 0; i < naxis && st == OK; i++) {
        char name[24];
        snprintf(name, sizeof name, "NAXIS%d", i + 1);
        st = header_set_long(c, name, side[i], NULL);
    }
    if (st == OK && first)
        st = header_set_bool(c, "EXTEND", 1, NULL);
    if (st == OK && !first)
        st = header_set_long(c, "PCOUNT", 0, NULL);
    if (st == OK && !first)
        st = header_set_long(c, "GCOUNT", 1, NULL);
    if (st == OK && h && continued(h))
        st = header_set_str(c, "LONGSTRN", "OGIP 1.0", "CONTINUE cards may be there");
    for (size_t i = 0; h && i < h->n && st == OK; i++)
        if (!fits_structural(h->card[i], &image))
            st = header_append(c, h->card[i]);
    return st;
}

int fits_out_hdu(struct fits_out *f, int bitpix, long nx, long ny, long nz, const struct header *h,
                 struct err *e)
{
    const long side[3] = {nx, ny, nz};
    if ((bitpix != -32 && bitpix != -64 && bitpix != 32) || nx < 0 || nx > IMAGE_SIDE ||
        (nx > 0 && (ny < 1 || ny > IMAGE_SIDE || nz < 1 || nz > IMAGE_SIDE)))
        return err_set(e, E_RANGE, "%s: an image of %ld x %ld x %ld cannot be written", f->name, nx, ny, nz);

    struct header c = {0};
    uint64_t bytes = (uint64_t)abs(bitpix) / 8;
    uint64_t size = nx ? (uint64_t)nx * (uint64_t)ny * (uint64_t)nz * bytes : 0;
    int st = image_cards(&c, f->n == 0, bitpix, side, nx == 0 ? 0 : nz > 1 ? 3 : 2, h);
    st = st == E_NOMEM ? no_memory(f, e) : st ? err_set(e, st, "%s: %s", f->name, err_text(st))
                                              : fits_out_begin(f, &c, size, e);
    header_free(&c);
    if (st == OK) {
        f->now.bitpix = bitpix;
        f->now.nx = nx;
        f->now.ny = ny;
        f->now.nz = nz;
    }
    return st;
}

/* To big-endian; returns the sum of the words, below 2^56 for the n <= 2^24 there are in a block. */
WIDE static uint64_t swap32(unsigned char *restrict out, const void *restrict in, size_t n)
{
    uint64_t sum = 0;
    for (size_t i = 0; i < n; i++) {
        uint32_t v;
        memcpy(&v, (const char *)in + 4 * i, 4);
        sum += v;
        v = __builtin_bswap32(v);
        memcpy(out + 4 * i, &v, 4);
    }
    return sum;
}

WIDE static uint64_t swap64(unsigned char *restrict out, const void *restrict in, size_t n)
{
    uint64_t sum = 0;
    for (size_t i = 0; i < n; i++) {
        uint64_t v;
        memcpy(&v, (const char *)in + 8 * i, 8);
        sum += (v & 0xffffffffu) + (v >> 32);
        v = __builtin_bswap64(v);
        memcpy(out + 8 * i, &v, 8);
    }
    return sum;
}

/* k values into f->block, and into the sum of p. */
static void swap_block(struct fits_out *f, struct part *p, const char *in, size_t k)
{
    uint64_t sum = abs(p->bitpix) == 32 ? swap32(f->block, in, k) : swap64(f->block, in, k);
    p->sum = fold((uint64_t)p->sum + fold(sum));
    p->left -= k * (size_t)abs(p->bitpix) / 8;
}

static int put_rows(struct fits_out *f, int bitpix, long nrow, const void *pix, struct err *e)
{
    struct part *p = &f->now;
    size_t bytes = (size_t)abs(bitpix) / 8, n = (size_t)nrow * (size_t)p->nx;
    if (nrow < 0 || bitpix != p->bitpix || n > p->left / bytes)
        return err_set(e, E_RANGE, "%s: HDU %d: rows that do not fit the image", f->name, p->index);
    const char *in = pix;
    while (n) {
        size_t k = n < BLOCK / bytes ? n : BLOCK / bytes;
        swap_block(f, p, in, k);
        int st = emit(f, f->block, k * bytes, e);
        if (st)
            return st;
        in += k * bytes;
        n -= k;
    }
    return OK;
}

int fits_out_rows(struct fits_out *f, long nrow, const float *pix, struct err *e)
{
    return put_rows(f, -32, nrow, pix, e);
}

int fits_out_rows_double(struct fits_out *f, long nrow, const double *pix, struct err *e)
{
    return put_rows(f, -64, nrow, pix, e);
}

int fits_out_rows_int(struct fits_out *f, long nrow, const int32_t *pix, struct err *e)
{
    return put_rows(f, 32, nrow, pix, e);
}

int fits_out_slot(struct fits_out *f, int bitpix, long nx, long ny, long nz, const struct header *h, int *slot, struct err *e)
{
    struct part *more = realloc(f->slot, ((size_t)f->slots + 1) * sizeof *more);
    if (!more)
        return no_memory(f, e);
    f->slot = more;
    int st = fits_out_hdu(f, bitpix, nx, ny, nz, h, e);
    if (st)
        return st;
    st = outfile_skip(f->o, f->now.size + padding(&f->now));
    if (st)
        return st == E_NOMEM ? no_memory(f, e) : cannot_write(f, e);
    *slot = f->slots;
    f->slot[f->slots++] = f->now;
    f->now.head = NULL;
    return OK;
}

int fits_out_slot_rows(struct fits_out *f, int slot, long z, long y0, long nrow, const void *pix, struct err *e)
{
    struct part *p = slot >= 0 && slot < f->slots ? &f->slot[slot] : NULL;
    if (!p || z < 0 || z >= p->nz || y0 < 0 || nrow < 0 || nrow > p->ny - y0)
        return err_set(e, E_RANGE, "%s: slot %d: rows that do not fit the image", f->name, slot);
    size_t n = (size_t)nrow * (size_t)p->nx;
    uint64_t at = p->head_at + p->head_size + 4 * ((uint64_t)z * (uint64_t)p->ny + (uint64_t)y0) * (uint64_t)p->nx;
    if (4 * (uint64_t)n > p->left)
        return err_set(e, E_RANGE, "%s: HDU %d: rows that were written already", f->name, p->index);
    for (const char *in = pix; n;) {
        size_t k = n < BLOCK / 4 ? n : BLOCK / 4;
        swap_block(f, p, in, k);
        int st = outfile_patch(f->o, at, f->block, 4 * k);
        if (st)
            return st == E_NOMEM ? no_memory(f, e) : cannot_write(f, e);
        at += 4 * k;
        in += 4 * k;
        n -= k;
    }
    return OK;
}

/* An image that goes block by block from memory to a stream, and the zeros behind it. */
struct whole {
    struct fits_out *f;
    const char *in;
    size_t left, pad;      /* pixels, bytes */
};

static size_t next_block(void *state, const void **p)
{
    struct whole *w = state;
    size_t n = w->left < BLOCK / sizeof(float) ? w->left : BLOCK / sizeof(float), pad = w->pad;
    if (n == 0) {
        *p = zeros;
        w->pad = 0;
        return pad;
    }
    swap32(w->f->block, w->in, n);
    w->in += n * sizeof(float);
    w->left -= n;
    *p = w->f->block;
    return n * sizeof(float);
}

/* All rows of the only HDU; to a stream without a spool, the checksums being known before the first byte goes. */
static int put_whole(struct fits_out *f, const struct image *im, struct whole *w, struct err *e)
{
    struct part *p = &f->now;
    size_t n = image_count(im);
    if (!outfile_is_stream(f->o))
        return fits_out_rows(f, im->ny, im->pix, e);
    *w = (struct whole){.f = f, .in = (const char *)im->pix, .left = n, .pad = padding(p)};
    for (size_t at = 0; at < n; at += BLOCK / sizeof(float))
        swap_block(f, p, (const char *)(im->pix + at), n - at < BLOCK / sizeof(float) ? n - at : BLOCK / sizeof(float));
    outfile_follow(f->o, next_block, w);
    return seal(f, p, e);
}

int image_write(const struct image *im, const char *name, const char *record,
                const char *const *inputs, size_t n_inputs, struct err *e)
{
    struct header h = {0};
    struct fits_out *f;
    struct whole whole;
    int st = header_copy(&h, &im->hdr);
    if (st == OK && record)
        st = header_history(&h, record);
    if (st)
        st = err_set(e, st, "%s: %s", name, err_text(st));
    else
        st = fits_out_open(&f, name, inputs, n_inputs, e);
    if (st) {
        header_free(&h);
        return st;
    }
    st = fits_out_hdu(f, -32, im->nx, im->ny, 1, &h, e);
    if (st == OK)
        st = put_whole(f, im, &whole, e);
    header_free(&h);
    if (st == OK)
        return fits_out_commit(f, e);
    fits_out_abandon(f);
    return st;
}
