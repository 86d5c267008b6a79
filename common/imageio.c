/*
 * imageio.c - FITS images, in.
 *
 * fitswalk checks the structure, stored converts; here HDUs are chosen and rows read.
 */
#include "imageio.h"
#include "fileio.h"
#include "fitswalk.h"
#include "pixels.h"
#include "source.h"
#include "stored.h"
#include "unpack.h"
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { BLOCK = 128 << 10 };

/* ---- opening and choosing ---- */

static struct hdu describe(const struct fits_unit *u, int index)
{
    struct hdu h = {.index = index, .bitpix = u->bitpix, .nx = 0, .ny = 0, .nz = 1, .extver = u->extver};
    memcpy(h.extname, u->extname, sizeof h.extname);
    int fits = u->axis[0] <= INT_MAX && u->axis[1] <= INT_MAX && u->axis[2] <= INT_MAX;
    if (u->kind == UNIT_IMAGE && u->naxis >= 2 && fits) {
        h.nx = (long)u->axis[0];
        h.ny = (long)u->axis[1];
        h.nz = (long)u->axis[2];
        h.is_image = !u->more_axes && h.nx > 0 && h.ny > 0 && h.nz > 0;
    }
    return h;
}

/* A tile-compressed image looks like the image that it was. */
static int describe_packed(struct fits_in *f, int index, struct err *e)
{
    const struct fits_unit *u = &f->unit[index];
    struct hdu *h = &f->hdu[index];
    struct unpack_shape s;
    const char *why;
    int st = unpack_shape(&s, u, &why);
    if (st)
        return err_set(e, st, "%s: HDU %d: tile-compressed image: %s", source_name(f->src), index, why);
    h->bitpix = s.bitpix;
    h->nx = s.axis[0];
    h->ny = s.axis[1];
    h->nz = s.axis[2];
    h->is_image = s.naxis >= 2 && !s.more_axes;
    return OK;
}

/* Index of "n", "NAME" or "NAME,ver", -1 when there is none. */
static int by_suffix(const struct fits_in *f, const char *suffix)
{
    size_t len = strlen(suffix);
    if (len == 0)
        return -1;
    if (strspn(suffix, "0123456789") == len) {
        long n = len < 9 ? strtol(suffix, NULL, 10) : LONG_MAX;
        return n < f->n ? (int)n : -1;
    }
    const char *comma = strrchr(suffix, ',');
    long ver = 0;
    if (comma && comma[1] && strspn(comma + 1, "0123456789") == strlen(comma + 1) && strlen(comma) < 10) {
        ver = strtol(comma + 1, NULL, 10);
        len = (size_t)(comma - suffix);
    }
    for (int i = 0; i < f->n; i++)
        if (strlen(f->hdu[i].extname) == len && !strncasecmp(f->hdu[i].extname, suffix, len) &&
            (ver == 0 || f->hdu[i].extver == ver))
            return i;
    return -1;
}

/* f->src is open; it has the HDU `suffix`, or NULL. */
static int open_parts(struct fits_in *f, const char *suffix, double max_memory, struct err *e)
{
    const char *path = source_name(f->src);
    int st = fits_walk(f->src, &f->unit, &f->n, e);
    if (st)
        return st;
    f->max_memory = max_memory;
    f->hdu = calloc((size_t)f->n, sizeof *f->hdu);
    f->unpack = calloc((size_t)f->n, sizeof *f->unpack);
    if (!f->hdu || !f->unpack)
        return err_set(e, E_NOMEM, "%s: out of memory", path);
    for (int i = 0; i < f->n && !st; i++) {
        f->hdu[i] = describe(&f->unit[i], i);
        if (f->unit[i].compressed)
            st = describe_packed(f, i, e);
    }
    if (st)
        return st;
    f->chosen = suffix ? by_suffix(f, suffix) : -1;
    if (suffix && f->chosen < 0)
        return err_set(e, E_MISSING, "%s: has no HDU [%s] (there are %d)", path, suffix, f->n);
    return OK;
}

int fits_in_open(struct fits_in **out, const char *name, double max_memory, struct err *e)
{
    char *path, *suffix;
    *out = NULL;
    int st = file_split(name, &path, &suffix);
    if (st)
        return err_set(e, st, "%s: %s", name, err_text(st));
    struct fits_in *f = calloc(1, sizeof *f);
    st = f ? source_open(&f->src, path, max_memory, e) : err_set(e, E_NOMEM, "%s: out of memory", name);
    if (st == OK)
        st = open_parts(f, suffix, max_memory, e);
    free(path);
    free(suffix);
    if (st)
        fits_in_close(f);
    else
        *out = f;
    return st;
}

int fits_in_from(struct fits_in **out, struct source *src, double max_memory, struct err *e)
{
    *out = NULL;
    struct fits_in *f = calloc(1, sizeof *f);
    if (!f) {
        err_set(e, E_NOMEM, "%s: out of memory", source_name(src));
        source_close(src);
        return E_NOMEM;
    }
    f->src = src;
    int st = open_parts(f, NULL, max_memory, e);
    if (st)
        fits_in_close(f);
    else
        *out = f;
    return st;
}

void fits_in_close(struct fits_in *f)
{
    if (!f)
        return;
    for (int i = 0; f->unpack && i < f->n; i++)
        unpack_close(f->unpack[i]);
    free(f->unpack);
    fits_walk_free(f->unit, f->n);
    source_close(f->src);
    free(f->hdu);
    free(f);
}

int fits_in_count(const struct fits_in *f)
{
    return f->n;
}

const struct hdu *fits_in_hdu(const struct fits_in *f, int index)
{
    return index >= 0 && index < f->n ? &f->hdu[index] : NULL;
}

int fits_in_selected(const struct fits_in *f)
{
    if (f->chosen >= 0)
        return f->chosen;
    for (int i = 0; i < f->n; i++)
        if (f->hdu[i].is_image)
            return i;
    return -1;
}

int fits_in_single(const struct fits_in *f, int *index, struct err *e)
{
    const char *name = source_name(f->src);
    int n = 0;
    for (int i = 0; i < f->n && f->chosen < 0; i++)
        n += f->hdu[i].is_image && !strcasecmp(f->hdu[i].extname, "SCI");
    if (n > 1)
        return err_set(e, E_DATA, "%s: %d images named SCI: say which, %s[SCI,1] or another", name, n, name);
    *index = fits_in_selected(f);
    return OK;
}

int fits_in_find(const struct fits_in *f, const char *extname, long extver)
{
    for (int i = 0; i < f->n; i++)
        if (f->hdu[i].is_image && !strcasecmp(f->hdu[i].extname, extname) &&
            (extver == 0 || f->hdu[i].extver == extver))
            return i;
    return -1;
}

int fits_in_datasum(const struct fits_in *f, int index, char sum[SUM_TEXT])
{
    char text[72];
    const struct fits_unit *u = &f->unit[index];
    if (header_str(&u->cards, u->compressed ? "ZDATASUM" : "DATASUM", text, sizeof text))
        return 0;
    size_t n = strspn(text, "0123456789");
    if (n == 0 || n >= SUM_TEXT || text[n] || !strcmp(text, "0"))
        return 0;
    memcpy(sum, text, n + 1);
    return 1;
}

int fits_in_header(struct fits_in *f, int index, struct header *h, struct err *e)
{
    if (index < 0 || index >= f->n)
        return err_set(e, E_RANGE, "%s: has no HDU %d", source_name(f->src), index);
    const struct fits_unit *u = &f->unit[index];
    for (size_t i = 0; i < u->cards.n; i++) {
        if (fits_structural(u->cards.card[i], u) ||
            (u->compressed && !strncmp(u->cards.card[i], "EXTNAME = 'COMPRESSED_IMAGE'", 28)))
            continue;
        int st = header_append(h, u->cards.card[i]);
        if (st)
            return err_set(e, st, "%s: %s", source_name(f->src), err_text(st));
    }
    return OK;
}

int fits_in_provenance(const struct fits_in *f, int index, struct header *h, struct err *e)
{
    char sum[SUM_TEXT], line[SUM_TEXT + 16];
    if (!fits_in_datasum(f, index, sum))
        return OK;
    snprintf(line, sizeof line, "read DATASUM %s", sum);
    int st = header_history(h, line);
    return st ? err_set(e, st, "%s: %s", source_name(f->src), err_text(st)) : OK;
}

/* ---- pixels ---- */

static int not_an_image(const struct fits_in *f, int index, struct err *e)
{
    const char *name = source_name(f->src), *why = "has no pixels";
    if (index < 0)
        return err_set(e, E_MISSING, "%s: has no image", name);
    const struct fits_unit *u = &f->unit[index];
    if (u->compressed)
        why = "is a tile-compressed image of one axis, or of more than three";
    else if (u->kind == UNIT_BINTABLE || u->kind == UNIT_ASCII)
        why = "is a table, not an image";
    else if (u->kind != UNIT_IMAGE)
        why = "is not an image";
    else if (u->naxis == 1)
        why = "has one axis: an image needs two";
    else if (u->more_axes)
        why = "has more than three axes";
    else if (u->axis[0] > INT_MAX || u->axis[1] > INT_MAX || u->axis[2] > INT_MAX)
        why = "has an axis that is too long";
    return err_set(e, E_DATA, "%s: HDU %d %s", name, index, why);
}

/* The same of a tile-compressed image, whose values come scaled. */
static int read_packed(struct fits_in *f, int index, long z, long y0, long nrow, float *out, double *out2,
                       struct err *e)
{
    struct unpack **u = &f->unpack[index];
    const size_t nx = (size_t)f->hdu[index].nx;
    int st = *u ? OK : unpack_open(u, f->src, &f->unit[index], index, f->max_memory, e);
    for (long done = 0, got; done < nrow && !st; done += got) {
        const double *pix;
        st = unpack_rows(*u, z, y0 + done, nrow - done, &pix, &got, e);
        if (st)
            break;
        const size_t at = (size_t)done * nx, n = (size_t)got * nx;
        if (out2)
            memcpy(out2 + at, pix, n * sizeof *pix);
        for (size_t i = 0; out && i < n; i++)
            out[at + i] = (float)pix[i];
    }
    return st;
}

/* Rows as float (out) or double (out2), whichever is not NULL. */
static int read_rows(struct fits_in *f, int index, long z, long y0, long nrow, float *out, double *out2,
                     struct err *e)
{
    if (index < 0 || index >= f->n || !f->hdu[index].is_image)
        return not_an_image(f, index < f->n ? index : -1, e);
    const struct hdu *h = &f->hdu[index];
    const struct fits_unit *u = &f->unit[index];
    if (z < 0 || z >= h->nz || y0 < 0 || nrow < 0 || nrow > h->ny - y0)
        return err_set(e, E_RANGE, "%s: HDU %d: rows out of range", source_name(f->src), index);
    if (u->compressed)
        return read_packed(f, index, z, y0, nrow, out, out2, e);

    size_t bytes = (size_t)abs(u->bitpix) / 8, n = (size_t)nrow * (size_t)h->nx;
    size_t row = (size_t)z * (size_t)h->ny + (size_t)y0;
    uint64_t at = u->data_at + (uint64_t)row * (uint64_t)h->nx * bytes;
    unsigned char *block = NULL;
    if (!source_at(f->src, at, n * bytes) && !(block = malloc(BLOCK)))
        return err_set(e, E_NOMEM, "%s: out of memory", source_name(f->src));

    int st = OK;
    for (size_t done = 0; done < n;) {
        size_t k = n - done < BLOCK / bytes ? n - done : BLOCK / bytes;
        const unsigned char *in = block;
        if (!block)
            in = source_at(f->src, at, k * bytes);
        else if ((st = source_read(f->src, at, block, k * bytes, e)))
            break;
        if (out)
            stored_float(u, in, k, out + done);
        else
            stored_double(u, in, k, out2 + done);
        done += k;
        at += k * bytes;
    }
    free(block);
    return st;
}

int fits_in_rows(struct fits_in *f, int index, long z, long y0, long nrow, float *out, struct err *e)
{
    return read_rows(f, index, z, y0, nrow, out, NULL, e);
}

int fits_in_rows_double(struct fits_in *f, int index, long z, long y0, long nrow, double *out,
                        struct err *e)
{
    return read_rows(f, index, z, y0, nrow, NULL, out, e);
}

/* Size and header of the selected image of an open file. */
static int read_frame(struct image *im, struct fits_in *f, struct err *e)
{
    int index, st = fits_in_single(f, &index, e);
    if (st)
        return st;
    const struct hdu *h = fits_in_hdu(f, index);
    const char *name = source_name(f->src);
    if (!h || !h->is_image)
        return not_an_image(f, index, e);
    if (h->nz != 1)
        return err_set(e, E_DATA, "%s: HDU %d has %ld planes: a plain image is needed", name, index, h->nz);
    if (h->nx > IMAGE_SIDE || h->ny > IMAGE_SIDE)
        return err_set(e, E_RANGE, "%s: %ld x %ld pixels: a side is longer than %d", name, h->nx, h->ny, IMAGE_SIDE);
    im->nx = h->nx;
    im->ny = h->ny;
    return fits_in_header(f, index, &im->hdr, e);
}

/* Its pixels. */
static int read_pixels(struct image *im, struct fits_in *f, double max_memory, struct err *e)
{
    const char *name = source_name(f->src);
    const double bytes = 4.0 * (double)im->nx * (double)im->ny;
    if (!(bytes <= max_memory))
        return err_set(e, E_NOMEM, "%s: %ld x %ld pixels need %.3g MB, more than --max-memory", name, im->nx, im->ny, bytes * 1e-6);
    struct image room;
    int st = image_room(&room, im->nx, im->ny);
    if (st)
        return err_set(e, st, "%s: %ld x %ld pixels: %s", name, im->nx, im->ny, err_text(st));
    im->pix = room.pix;
    return fits_in_rows(f, fits_in_selected(f), 0, 0, im->ny, im->pix, e);
}

int image_read(struct image *im, const char *name, double max_memory, struct err *e)
{
    struct fits_in *f;
    struct image new = {0};
    int st = fits_in_open(&f, name, max_memory, e);
    if (st)
        return st;
    st = read_frame(&new, f, e);
    if (st == OK)
        st = read_pixels(&new, f, max_memory, e);
    fits_in_close(f);
    if (st)
        image_free(&new);
    else
        *im = new;
    return st;
}

/* ---- pixels that stay where they are ---- */

static void copy_shown(const void *of, size_t at, size_t stride, long n, long rows, float *out)
{
    const struct fits_in *f = of;
    const size_t bytes = (size_t)abs(f->shown->bitpix) / 8;
    stored_box(f->shown, f->shown_at + at * bytes, stride, (size_t)n, (size_t)rows, out);
}

/* Are the bytes of the selected image in memory, as they are in the file? */
static int show(struct fits_in *f)
{
    const struct fits_unit *u = &f->unit[fits_in_selected(f)];
    f->shown = u;
    f->shown_at = u->compressed || source_map(f->src) ? NULL : source_at(f->src, u->data_at, (size_t)u->data_size);
    return f->shown_at != NULL;
}

int image_open(struct image *im, struct pixels *at, struct fits_in **out, const char *name, double max_memory, struct err *e)
{
    struct fits_in *f;
    struct image new = {0};
    *out = NULL;
    int st = fits_in_open(&f, name, max_memory, e);
    if (st)
        return st;
    st = read_frame(&new, f, e);
    if (st == OK && show(f)) {
        *im = new;
        *at = (struct pixels){new.nx, new.ny, NULL, copy_shown, f};
        *out = f;
        return OK;
    }
    if (st == OK)
        st = read_pixels(&new, f, max_memory, e);
    fits_in_close(f);
    if (st) {
        image_free(&new);
        return st;
    }
    *im = new;
    *at = pixels_of(im);
    return OK;
}

int fits_in_unchanged(const struct fits_in *f, struct err *e)
{
    return source_unchanged(f->src, e);
}
