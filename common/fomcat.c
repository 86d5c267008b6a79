/* fomcat.c - what the figures of merit need of a shape catalogue; common objects. */
#include "fomcat.h"
#include "catkeys.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void fom_image_free(struct fom_image *im)
{
    free(im->object);
    *im = (struct fom_image){0};
}

static void copy_word(char to[64], const char *from, const char *otherwise)
{
    snprintf(to, 64, "%s", from && *from ? from : otherwise);
}

static int read_keywords(struct fom_image *im, const struct table *t, struct err *e)
{
    static const char *const count[5] = {"NDET", "NSTARCUT", "NELLCUT", "NSIZECUT", "NSNRCUT"};
    copy_word(im->set, table_text(t, "SETNAME"), "-");
    copy_word(im->sky, table_text(t, "FIELDID") ? table_text(t, "FIELDID") : table_text(t, "SEED"), "-");
    const char *noise = table_text(t, "NOISSEED");
    double mirror, pixel;
    const struct { const char *key; double *value; } want[] = {
        {"MIRROR", &mirror}, {"SHEAR1", &im->g[0]}, {"SHEAR2", &im->g[1]}, {"CCDSCALE", &im->scale}, {"PIXSCALE", &pixel},
        {"EPSF1", &im->epsf[0]}, {"EPSF2", &im->epsf[1]}, {"AREA", &im->area}};
    int st = OK;
    for (size_t i = 0; i < sizeof want / sizeof *want && st == OK; i++)
        st = catkeys_number(t, want[i].key, want[i].value, e);
    for (int k = 0; k < 5 && st == OK; k++)
        st = catkeys_number(t, count[k], &im->count[k], e);
    if (st)
        return st;
    snprintf(im->field, sizeof im->field, "%s:%.40s%s", im->sky, noise ? noise : "", mirror > 0 ? "~" : "");
    for (int k = 0; k < 2; k++)
        if (isnan(im->g[k]))
            return err_set(e, E_MISSING, "no keyword SHEAR%d: shapes must be measured on an image that has it", k + 1);
    if (isnan(im->scale))
        im->scale = pixel;
    if (isnan(im->scale))
        return err_set(e, E_MISSING, "no keyword CCDSCALE or PIXSCALE");
    if (!(im->scale > 0))
        return err_set(e, E_DATA, "keyword CCDSCALE or PIXSCALE is %g: it must be positive", im->scale);
    if (im->area <= 0)
        return err_set(e, E_DATA, "keyword AREA = %g is not positive: correct it", im->area);
    return OK;
}

struct place {
    double x, y;
    size_t i;
};

static int by_y(const void *a, const void *b)
{
    const struct place *p = a, *q = b;
    return p->y < q->y ? -1 : p->y > q->y ? 1 : p->i < q->i ? -1 : p->i > q->i;
}

/* Positions in arcsec about the origin (sky: flat, cos of the origin's declination), sorted by y. */
static size_t sorted(struct place *p, const struct fom_image *im, const double origin[2])
{
    size_t m = 0;
    double scale = cos(origin[1] * M_PI / 180) * 3600;
    for (size_t i = 0; i < im->n; i++) {
        const struct fom_object *o = &im->object[i];
        if (!isfinite(o->x) || !isfinite(o->y))
            continue;
        p[m] = (struct place){o->x, o->y, i};
        if (im->on_sky)
            p[m] = (struct place){remainder(o->x - origin[0], 360) * scale, (o->y - origin[1]) * 3600, i};
        m++;
    }
    qsort(p, m, sizeof *p, by_y);
    return m;
}

/* Where the positions are laid flat about: the first that is a number (not on the sky: zero). */
static void find_origin(const struct fom_image *im, double origin[2])
{
    origin[0] = origin[1] = 0;
    for (size_t i = im->n; im->on_sky && i-- > 0;)
        if (isfinite(im->object[i].x) && isfinite(im->object[i].y)) {
            origin[0] = im->object[i].x;
            origin[1] = im->object[i].y;
        }
}

/* Distance of every object to the nearest other one, arcsec; INFINITY when there is none. */
static int distances(struct fom_image *im)
{
    struct place *p = malloc((im->n + 1) * sizeof *p);
    if (!p)
        return E_NOMEM;
    double origin[2];
    find_origin(im, origin);
    size_t m = sorted(p, im, origin);
    for (size_t k = 0; k < m; k++) {
        double best = INFINITY;
        for (size_t j = k + 1; j < m && p[j].y - p[k].y < best; j++)
            best = fmin(best, hypot(p[j].x - p[k].x, p[j].y - p[k].y));
        for (size_t j = k; j-- > 0 && p[k].y - p[j].y < best;)
            best = fmin(best, hypot(p[j].x - p[k].x, p[j].y - p[k].y));
        im->object[p[k].i].key = best;
    }
    free(p);
    return OK;
}

/* The columns of one block, all that fom looks at. */
struct used {
    const struct column *shape[6], *x, *y, *cut, *key[2];
    double px, key_px;        /* factors of positions and of the key */
    int ratio;                /* the key is key[0]/key[1] */
};

static int need(const struct table *t, const char *name, const char *why, const struct column **c, struct err *e)
{
    *c = table_find(t, name);
    if (!*c || (*c)->type == COL_TEXT || (*c)->type == COL_RAGGED)
        return err_set(e, E_MISSING, "no column of numbers %s%s", name, why);
    return OK;
}

static int find_key(struct used *u, const struct table *t, const char *key, struct err *e)
{
    int own = table_find(t, key) != NULL, size = !own && strcmp(key, "SIZE") == 0;
    u->ratio = !own && strcmp(key, "SNR") == 0;
    int st = need(t, u->ratio ? "FLUX_AUTO" : size ? "D_RRG" : key, " for the bins", &u->key[0], e);
    if (st == OK && u->ratio)
        st = need(t, "FLUXERR_AUTO", " for the bins", &u->key[1], e);
    u->key_px = 1;
    if (st == OK && size && (table_key_number(t, "PIXSCALE", &u->key_px) != OK || !(u->key_px > 0)))
        return err_set(e, E_MISSING, "no PIXSCALE above 0 for bins of SIZE");
    return st;
}

static int find_columns(struct used *u, int *on_sky, const struct table *t, const char *key, struct err *e)
{
    static const char *const name[] = {"E1", "E2", "E1ERR", "E2ERR", "P11", "P22"};
    *u = (struct used){.px = 1};
    for (int k = 0; k < 6; k++) {
        u->shape[k] = table_find(t, name[k]);
        if (!u->shape[k])
            return err_set(e, E_MISSING, "no column %s: measure shapes with rrgshape first", name[k]);
    }
    const struct column *ra = table_find(t, "ALPHA_J2000"), *dec = table_find(t, "DELTA_J2000");
    *on_sky = ra && dec;
    u->x = *on_sky ? ra : table_find(t, "X_IMAGE");
    u->y = *on_sky ? dec : table_find(t, "Y_IMAGE");
    if (!u->x || !u->y)
        return err_set(e, E_MISSING, "no positions: columns ALPHA_J2000 DELTA_J2000 or X_IMAGE Y_IMAGE");
    if (!*on_sky && (table_key_number(t, "PIXSCALE", &u->px) != OK || !(u->px > 0)))
        return err_set(e, E_MISSING, "no PIXSCALE above 0 and no sky positions");
    u->cut = table_find(t, "CUT");
    return key && strcmp(key, "DISTANCE") != 0 ? find_key(u, t, key, e) : OK;
}

static struct fom_object object_at(const struct used *u, size_t i)
{
    struct fom_object o = {
        .x = table_number(u->x, i) * u->px, .y = table_number(u->y, i) * u->px,
        .e = {table_number(u->shape[0], i), table_number(u->shape[1], i)},
        .err = {table_number(u->shape[2], i), table_number(u->shape[3], i)},
        .p = {table_number(u->shape[4], i), table_number(u->shape[5], i)}, .listed = 1, .key = NAN};
    int good = isfinite(o.e[0]) && isfinite(o.e[1]) && isfinite(o.p[0]) && isfinite(o.p[1]);
    o.measured = good && hypot(o.e[0], o.e[1]) < 2;
    o.used = o.passes = good && (!u->cut || table_number(u->cut, i) == 0);
    if (u->key[0])
        o.key = u->ratio ? table_number(u->key[0], i) / table_number(u->key[1], i) : table_number(u->key[0], i) * u->key_px;
    return o;
}

/* The rows of t behind the objects of im, which have room for *cap. */
static int add_rows(struct fom_image *im, size_t *cap, const struct table *t, const struct used *u, double max_memory, struct err *e)
{
    if (im->n + t->nrow > *cap || !im->object) {
        size_t room = im->n + t->nrow + im->n / 4 + 1;
        if ((double)room * sizeof *im->object > max_memory)
            return err_set(e, E_NOMEM, "needs more than --max-memory");
        struct fom_object *o = realloc(im->object, room * sizeof *o);
        if (!o)
            return err_set(e, E_NOMEM, "%s", err_text(E_NOMEM));
        im->object = o;
        *cap = room;
    }
    for (size_t i = 0; i < t->nrow; i++)
        im->object[im->n + i] = object_at(u, i);
    im->n += t->nrow;
    return OK;
}

void fom_image_bin(struct fom_image *im, double lo, double hi)
{
    for (size_t i = 0; i < im->n; i++) {
        struct fom_object *o = &im->object[i];
        o->listed = o->key >= lo && o->key < hi;
        o->used = o->passes && o->listed;
    }
}

/* The message of e with the name of the catalogue before it. */
static int about(const char *name, int st, struct err *e)
{
    if (!e)
        return st;
    const struct err cause = *e;
    return err_set(e, st, "%s: %s", name, cause.text);
}

int fom_image_read(struct fom_image *im, struct table_in *in, struct table *t, const char *name, const char *key, double max_memory,
                   struct err *e)
{
    struct fom_image r = {0};
    struct used u;
    size_t cap = 0, rows = table_block_rows(t);
    int st = read_keywords(&r, t, e);
    if (st)
        return about(name, st, e);
    r.marked = table_find(t, "CUT") != NULL;
    do {
        if (in && (st = table_in_rows(in, t, rows, e)))
            break;
        st = find_columns(&u, &r.on_sky, t, key, e);
        if (st == OK)
            st = add_rows(&r, &cap, t, &u, max_memory, e);
        if (st)
            about(name, st, e);
    } while (in && st == OK && t->nrow == rows);
    if (st == OK && key && strcmp(key, "DISTANCE") == 0 && distances(&r))
        st = err_set(e, E_NOMEM, "%s: %s", name, err_text(E_NOMEM));
    if (st)
        fom_image_free(&r);
    else
        *im = r;
    return st;
}

size_t fom_image_used(const struct fom_image *im)
{
    size_t n = 0;
    for (size_t i = 0; i < im->n; i++)
        n += (size_t)im->object[i].used;
    return n;
}

/* near[i] of every object of a: nearest of b within radius, -1 when there is none; both sorted by y. */
static void nearest(size_t na, const struct place *a, size_t nb, const struct place *b, double radius, long *near)
{
    size_t first = 0;
    for (size_t k = 0; k < na; k++) {
        double best = radius * radius;
        near[a[k].i] = -1;
        while (first < nb && b[first].y < a[k].y - radius)
            first++;
        for (size_t j = first; j < nb && b[j].y <= a[k].y + radius; j++) {
            double dx = b[j].x - a[k].x, dy = b[j].y - a[k].y, d = dx * dx + dy * dy;
            if (d < best || (d <= best && near[a[k].i] < 0)) {
                best = d;
                near[a[k].i] = (long)b[j].i;
            }
        }
    }
}

int fom_match(const struct fom_image *a, const struct fom_image *b, double radius, long *to)
{
    struct place *p = malloc((a->n + 1) * sizeof *p), *q = malloc((b->n + 1) * sizeof *q);
    long *back = malloc((b->n + 1) * sizeof *back);
    int st = p && q && back ? OK : E_NOMEM;
    if (st == OK) {
        double origin[2];
        find_origin(a, origin);
        for (size_t i = 0; i < a->n; i++)
            to[i] = -1;
        for (size_t j = 0; j < b->n; j++)
            back[j] = -1;
        size_t na = sorted(p, a, origin), nb = sorted(q, b, origin);
        nearest(na, p, nb, q, radius, to);
        nearest(nb, q, na, p, radius, back);
        for (size_t i = 0; i < a->n; i++)
            if (to[i] >= 0 && back[to[i]] != (long)i)
                to[i] = -1;
    }
    free(p);
    free(q);
    free(back);
    return st;
}

int fom_parts(const struct fom_image *im, int *part)
{
    struct place *p = malloc((im->n + 1) * sizeof *p);
    double origin[2], box[4] = {INFINITY, -INFINITY, INFINITY, -INFINITY};
    if (!p)
        return E_NOMEM;
    find_origin(im, origin);
    size_t m = sorted(p, im, origin);
    for (size_t k = 0; k < m; k++) {
        box[0] = fmin(box[0], p[k].x);
        box[1] = fmax(box[1], p[k].x);
        box[2] = fmin(box[2], p[k].y);
        box[3] = fmax(box[3], p[k].y);
    }
    for (size_t i = 0; i < im->n; i++)
        part[i] = 0;
    for (size_t k = 0; k < m; k++) {
        double u = 4 * (p[k].x - box[0]) / (box[1] - box[0]), v = 4 * (p[k].y - box[2]) / (box[3] - box[2]);
        int i = u > 0 ? u < 4 ? (int)u : 3 : 0, j = v > 0 ? v < 4 ? (int)v : 3 : 0;
        part[p[k].i] = 4 * j + i;
    }
    free(p);
    return OK;
}
