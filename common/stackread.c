/*
 * stackread.c - the exposures of a stack, their maps, and their order.
 */
#include "stack.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { HASH_PIXELS = 1 << 19 };

const char *const stack_map_name[STACK_MAPS] = {"weight", "var", "mask"};

/* Maps of a file: the images named WHT, VAR or DQ, else its exposures. */
static int list_maps(const struct fits_in *f, const char *name, enum stack_map kind, int **list, size_t *n, struct err *e)
{
    static const char *const extname[STACK_MAPS] = {"WHT", "VAR", "DQ"};
    int st = exposure_list(f, name, list, n, e);
    const size_t length = strlen(name);
    if (st || (length && name[length - 1] == ']'))
        return st;
    int *found = malloc((size_t)fits_in_count(f) * sizeof *found);
    if (!found) {
        free(*list);
        return err_set(e, E_NOMEM, "%s: %s", name, err_text(E_NOMEM));
    }
    size_t k = 0;
    for (int i = 0; i < fits_in_count(f); i++)
        if (fits_in_hdu(f, i)->is_image && strcasecmp(fits_in_hdu(f, i)->extname, extname[kind]) == 0)
            found[k++] = i;
    if (k == 0) {
        free(found);
        return OK;
    }
    free(*list);
    *list = found;
    *n = k;
    return OK;
}

/* The maps of one kind of file k, for its n exposures from shot on. */
static int add_maps(struct stack *s, size_t k, enum stack_map kind, struct shot *shot, size_t n, struct err *e)
{
    const struct stack_choice *c = &s->choice;
    const char *name = c->maps[kind].v[k];
    struct fits_in **in = &s->in[(1 + (size_t)kind) * c->files.n + k];
    int *list;
    size_t count;
    int st = fits_in_open(in, name, c->max_memory, e);
    if (st == OK)
        st = list_maps(*in, name, kind, &list, &count, e);
    if (st)
        return st;
    if (count != n)
        st = err_set(e, E_DATA, "%s: %zu %s images for %zu exposures of %s", name, count, stack_map_name[kind], n, c->files.v[k]);
    for (size_t i = 0; i < n && st == OK; i++) {
        const struct hdu *h = fits_in_hdu(*in, list[i]);
        shot[i].maps[kind] = *in;
        shot[i].map_index[kind] = list[i];
        if (h->nx != shot[i].x.nx || h->ny != shot[i].x.ny)
            st = err_set(e, E_DATA, "%s: the %s image is %ld x %ld, the exposure %ld x %ld", shot[i].label,
                         stack_map_name[kind], h->nx, h->ny, shot[i].x.nx, shot[i].x.ny);
    }
    free(list);
    return st;
}

/* One exposure, appended; s->shot has room for it. */
static int add_shot(struct stack *s, size_t k, int index, struct err *e)
{
    struct shot *t = &s->shot[s->n];
    *t = (struct shot){.in = s->in[k], .file = k};
    exposure_label(t->in, s->choice.files.v[k], index, t->label, sizeof t->label);
    int st = exposure_read(t->in, s->choice.files.v[k], index, &t->x, e);
    if (st)
        return st;
    s->n++;
    struct err why;
    st = sky_open(&t->sky, &t->x.hdr, &why);
    if (st == E_NOMEM || (st && !s->choice.shifts))
        return err_set(e, st, "%s: no usable WCS: %s%s", t->label, why.text, st == E_MISSING ? " (or give --shift)" : "");
    if (st)
        t->sky = NULL;
    return OK;
}

/* All exposures of one file. */
static int add_file(struct stack *s, size_t k, struct err *e)
{
    const char *name = s->choice.files.v[k];
    int *list;
    size_t n;
    const size_t before = s->n;
    int st = fits_in_open(&s->in[k], name, s->choice.max_memory, e);
    if (st == OK)
        st = exposure_list(s->in[k], name, &list, &n, e);
    if (st)
        return st;
    struct shot *more = s->n + n > STACK_MAX ? NULL : realloc(s->shot, (s->n + n) * sizeof *more);
    if (!more) {
        free(list);
        return s->n + n > STACK_MAX ? err_set(e, E_DATA, "%s: more than %d exposures", name, STACK_MAX)
                                    : err_set(e, E_NOMEM, "%s: %s", name, err_text(E_NOMEM));
    }
    s->shot = more;
    for (size_t i = 0; i < n && st == OK; i++)
        st = add_shot(s, k, list[i], e);
    for (int kind = 0; kind < STACK_MAPS && st == OK; kind++)
        if (s->choice.maps[kind].n)
            st = add_maps(s, k, (enum stack_map)kind, &s->shot[before], n, e);
    free(list);
    return st;
}

/* ---- order ---- */

/* n bytes, a multiple of 4: FNV-1a over words, folded. */
static void hash(uint64_t *key, const void *data, size_t n)
{
    const unsigned char *p = data;
    for (size_t i = 0; i < n; i += 4) {
        uint32_t word;
        memcpy(&word, p + i, 4);
        *key = (*key ^ word) * 0x100000001B3u;
        *key ^= *key >> 32;
    }
}

static int hash_pixels(uint64_t *key, struct fits_in *f, int index, long nx, long ny, struct err *e)
{
    const long rows = 1 + HASH_PIXELS / nx;
    float *pix = malloc((size_t)rows * (size_t)nx * sizeof *pix);
    int st = pix ? OK : err_set(e, E_NOMEM, "%s", err_text(E_NOMEM));
    for (long y = 0; y < ny && st == OK; y += rows) {
        const long here = ny - y < rows ? ny - y : rows;
        st = fits_in_rows(f, index, 0, y, here, pix, e);
        if (st == OK)
            hash(key, pix, (size_t)here * (size_t)nx * sizeof *pix);
    }
    free(pix);
    return st;
}

static int hash_shot(struct shot *t, struct err *e)
{
    t->key = 0xCBF29CE484222325u;
    for (size_t k = 0; k < t->x.hdr.n; k++)
        hash(&t->key, t->x.hdr.card[k], 80);
    int st = hash_pixels(&t->key, t->in, t->x.index, t->x.nx, t->x.ny, e);
    for (int kind = 0; kind < STACK_MAPS && st == OK; kind++)
        if (t->maps[kind])
            st = hash_pixels(&t->key, t->maps[kind], t->map_index[kind], t->x.nx, t->x.ny, e);
    hash(&t->key, &t->shift, sizeof t->shift);
    return st;
}

static int by_key(const void *a, const void *b)
{
    const struct shot *p = a, *q = b;
    if (p->x.expnum != q->x.expnum)
        return p->x.expnum < q->x.expnum ? -1 : 1;
    return p->key < q->key ? -1 : p->key > q->key;
}

static int sort_shots(struct stack *s, struct err *e)
{
    qsort(s->shot, s->n, sizeof *s->shot, by_key);
    int tie = 0, st = OK;
    for (size_t i = 1; i < s->n; i++)
        tie |= s->shot[i].x.expnum == s->shot[i - 1].x.expnum;
    for (size_t i = 0; i < s->n && tie && st == OK; i++)
        st = hash_shot(&s->shot[i], e);
    qsort(s->shot, s->n, sizeof *s->shot, by_key);
    for (size_t i = 1; i < s->n && tie && st == OK; i++)
        if (by_key(&s->shot[i], &s->shot[i - 1]) == 0)
            st = err_set(e, E_DATA, "%s: the same exposure as %s, header and pixels: leave one out", s->shot[i].label, s->shot[i - 1].label);
    return st;
}

int stack_sort_names(struct stack *s)
{
    struct names *list[1 + STACK_MAPS] = {&s->choice.files};
    const size_t n = s->choice.files.n;
    char *done = calloc(n, 1), **sorted = malloc((1 + STACK_MAPS) * n * sizeof *sorted);
    for (int kind = 0; kind < STACK_MAPS; kind++)
        list[1 + kind] = &s->choice.maps[kind];
    if (!done || !sorted) {
        free(done);
        free(sorted);
        return E_NOMEM;
    }
    size_t k = 0;
    for (size_t i = 0; i < s->n; i++) {
        const size_t f = s->shot[i].file;
        if (done[f])
            continue;
        for (size_t l = 0; l < 1 + STACK_MAPS; l++)
            sorted[l * n + k] = list[l]->n ? list[l]->v[f] : NULL;
        done[f] = 1;
        k++;
    }
    for (size_t l = 0; l < 1 + STACK_MAPS; l++)
        if (list[l]->n)
            memcpy(list[l]->v, sorted + l * n, n * sizeof *sorted);
    free(done);
    free(sorted);
    return OK;
}

int stack_read(struct stack *s, struct err *e)
{
    const size_t n = s->choice.files.n;
    s->in = calloc((1 + STACK_MAPS) * n, sizeof *s->in);
    int st = s->in ? OK : err_set(e, E_NOMEM, "%s", err_text(E_NOMEM));
    for (size_t k = 0; k < n && st == OK; k++)
        st = add_file(s, k, e);
    if (st == OK && s->choice.shifts)
        st = stack_shifts(s, e);
    return st ? st : sort_shots(s, e);
}

void stack_free(struct stack *s)
{
    for (size_t i = 0; i < s->n; i++) {
        sky_close(s->shot[i].sky);
        drizzle_map_free(&s->shot[i].map);
        header_free(&s->shot[i].x.hdr);
    }
    for (size_t i = 0; s->in && i < (1 + STACK_MAPS) * s->choice.files.n; i++)
        fits_in_close(s->in[i]);
    sky_close(s->sky);
    header_free(&s->hdr);
    free(s->shot);
    free(s->in);
    names_free(&s->choice.files);
    for (int kind = 0; kind < STACK_MAPS; kind++)
        names_free(&s->choice.maps[kind]);
}
