/*
 * scene.c - a scene list checked and converted, row by row.
 */
#include "scene.h"
#include "unitname.h"
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double degree = 0.017453292519943295;

/* Columns by what they mean; NULL: not there. */
struct columns {
    const struct column *x, *y, *flux, *mag, *type, *id, *model, *parity, *rot, *dilation, *g1, *g2, *re, *n, *q, *pa;
};

/* One row being read. */
struct reader {
    const char *name;
    size_t row, before;    /* of the block; rows of the list before it */
    struct err *e;
    int st;                /* first failure */
};

/* In the list, from 1. */
static size_t row_number(const struct reader *r)
{
    return r->before + r->row + 1;
}

/* A column of numbers in `unit`; "" for a pure number, whose unit is not looked at. */
static const struct column *numeric(struct reader *r, const struct table *t, const char *name, const char *unit)
{
    const struct column *c = table_find(t, name);
    if (c && (c->type == COL_TEXT || c->type == COL_RAGGED || c->logical) && !r->st)
        r->st = err_set(r->e, E_DATA, "%s: column %s must hold numbers", r->name, name);
    if (c && *unit && !unitname_is(c->unit, unit) && !r->st)
        r->st = err_set(r->e, E_DATA, "%s: column %s is in '%.40s', not in %s: convert it", r->name, name, c->unit, unit);
    return c;
}

static int find_columns(struct reader *r, const struct table *t, struct columns *c, enum scene_where *where)
{
    static const char *const place[3][2] = {{"DX", "DY"}, {"RA", "DEC"}, {"X_IMAGE", "Y_IMAGE"}};
    static const char *const unit[3] = {"arcsec", "deg", "pixel"};
    static const enum scene_where kind[3] = {SCENE_FIELD, SCENE_SKY, SCENE_PIXEL};
    for (int i = 0; i < 3; i++) {
        const struct column *x = numeric(r, t, place[i][0], unit[i]), *y = numeric(r, t, place[i][1], unit[i]);
        if (!x || !y)
            continue;
        if (c->x && !r->st)
            r->st = err_set(r->e, E_DATA, "%s: positions in %s and in %s: keep one pair of columns", r->name, c->x->name, x->name);
        c->x = x;
        c->y = y;
        *where = kind[i];
    }
    c->flux = numeric(r, t, "FLUX", "electron/s");
    c->mag = numeric(r, t, "MAG", "mag");
    c->model = table_find(t, "MODEL");
    c->id = table_find(t, "ID");
    c->type = table_find(t, "TYPE");
    c->parity = numeric(r, t, "PARITY", "");
    c->rot = numeric(r, t, "ROT", "deg");
    c->dilation = numeric(r, t, "DILATION", "");
    c->g1 = numeric(r, t, "G1", "");
    c->g2 = numeric(r, t, "G2", "");
    c->re = numeric(r, t, "RE", "arcsec");
    c->n = numeric(r, t, "N", "");
    c->q = numeric(r, t, "Q", "");
    c->pa = numeric(r, t, "PA", "deg");
    if (r->st)
        return r->st;
    if (!c->x || !c->y)
        return err_set(r->e, E_MISSING, "%s: no positions: a scene list has DX DY, RA DEC or X_IMAGE Y_IMAGE", r->name);
    if (c->flux && c->mag)
        return err_set(r->e, E_DATA, "%s: both MAG and FLUX: keep one of the columns", r->name);
    if (!c->flux && !c->mag)
        return err_set(r->e, E_MISSING, "%s: no column MAG or FLUX", r->name);
    if (!c->type)
        return err_set(r->e, E_MISSING, "%s: no column TYPE (star, shapelet, gauss or sersic)", r->name);
    if (t->nrow && c->type->type != COL_TEXT)
        return err_set(r->e, E_DATA, "%s: column TYPE must hold words (star, shapelet, gauss or sersic)", r->name);
    if (t->nrow == 0)
        return OK;
    if ((c->id && c->id->type != COL_INT) || (c->model && c->model->type != COL_INT))
        return err_set(r->e, E_DATA, "%s: column %s must hold whole numbers", r->name, c->id && c->id->type != COL_INT ? "ID" : "MODEL");
    return OK;
}

/* A cell in lo..hi (NaN fails); `otherwise` when there is no such column. */
static double cell(struct reader *r, const struct column *c, double lo, double hi, double otherwise)
{
    if (!c)
        return otherwise;
    double v = table_number(c, r->row);
    if (!(v >= lo && v <= hi) && !r->st)
        r->st = err_set(r->e, E_DATA, "%s: row %zu: %s %.9g is not in %g..%g", r->name, row_number(r), c->name, v, lo, hi);
    return v;
}

/* A length: > 0. */
static double length(struct reader *r, const struct column *c, double otherwise)
{
    if (!c)
        return otherwise;
    double v = table_number(c, r->row);
    if (!(v > 0 && v <= 1e6) && !r->st)
        r->st = err_set(r->e, E_DATA, "%s: row %zu: %s %.9g must be > 0 and <= 1e6", r->name, row_number(r), c->name, v);
    return v;
}

static void need(struct reader *r, const struct column *c, const char *column, const char *type)
{
    if (!c && !r->st)
        r->st = err_set(r->e, E_MISSING, "%s: row %zu: TYPE %s needs a column %s", r->name, row_number(r), type, column);
}

static enum object_type read_type(struct reader *r, const struct columns *c)
{
    static const char *const names[] = {"star", "shapelet", "gauss", "sersic"};
    for (int i = 0; i < 4; i++)
        if (strcmp(c->type->v.s[r->row], names[i]) == 0)
            return (enum object_type)i;
    r->st = err_set(r->e, E_DATA, "%s: row %zu: TYPE '%.40s' is unknown (star, shapelet, gauss or sersic)", r->name, row_number(r),
                    c->type->v.s[r->row]);
    return OBJECT_STAR;
}

/* Position and brightness, which every object has. */
static void read_place(struct reader *r, const struct columns *c, enum scene_where where, double zeropoint, struct object *o)
{
    double limit = where == SCENE_SKY ? 360 : 1e30;   /* what is far outside is skipped, not refused */
    o->id = c->id ? c->id->v.i[r->row] : (int64_t)row_number(r);
    o->x = cell(r, c->x, -limit, limit, 0);
    o->y = cell(r, c->y, where == SCENE_SKY ? -90 : -limit, where == SCENE_SKY ? 90 : limit, 0);
    o->flux = c->flux ? cell(r, c->flux, -1e30, 1e30, 0) : pow(10, 0.4 * (zeropoint - cell(r, c->mag, -50, 100, 0)));
}

/* Parity, rotation, dilation and own shear of an extended object. */
static void read_map(struct reader *r, const struct columns *c, struct object *o)
{
    double parity = cell(r, c->parity, -1, 1, 1);
    if (fabs(parity) != 1 && !r->st)
        r->st = err_set(r->e, E_DATA, "%s: row %zu: PARITY %.9g is neither 1 nor -1", r->name, row_number(r), parity);
    o->parity = parity < 0 ? -1 : 1;
    o->rot = degree * cell(r, c->rot, -3600, 3600, 0);
    o->dilation = length(r, c->dilation, 1);
    o->g1 = cell(r, c->g1, -1, 1, 0);
    o->g2 = cell(r, c->g2, -1, 1, 0);
    if (!(hypot(o->g1, o->g2) < 1) && !r->st)
        r->st = err_set(r->e, E_DATA, "%s: row %zu: shear G1 %.9g, G2 %.9g must have |g| < 1", r->name, row_number(r), o->g1, o->g2);
}

static void read_model(struct reader *r, const struct columns *c, const struct models *m, struct object *o)
{
    need(r, c->model, "MODEL", "shapelet");
    if (!m && !r->st)
        r->st = err_set(r->e, E_MISSING, "%s: row %zu: TYPE shapelet needs a shapelet catalogue", r->name, row_number(r));
    if (r->st)
        return;
    const size_t model = models_find(m, c->model->v.i[r->row]);
    o->model = (unsigned int)model;
    if (model == m->n || model > UINT_MAX)
        r->st = err_set(r->e, E_MISSING, "%s: row %zu: MODEL %lld is not in the shapelet catalogue", r->name, row_number(r),
                        (long long)c->model->v.i[r->row]);
}

static void read_profile(struct reader *r, const struct columns *c, struct object *o)
{
    const char *type = o->type == OBJECT_GAUSS ? "gauss" : "sersic";
    need(r, c->re, "RE", type);
    o->re = length(r, c->re, 1);
    if (o->type == OBJECT_SERSIC) {
        need(r, c->n, "N", type);
        o->n = cell(r, c->n, 0.5, 8, 1);
    }
    o->q = cell(r, c->q, 1e-3, 1, 1);
    o->pa = degree * cell(r, c->pa, -3600, 3600, 0);
}

static int read_row(struct reader *r, const struct columns *c, const struct models *m, enum scene_where where, double zeropoint,
                    struct object *to)
{
    struct object o = {.parity = 1, .dilation = 1, .re = 0, .n = 0.5, .q = 1};
    o.type = (unsigned char)read_type(r, c);
    read_place(r, c, where, zeropoint, &o);
    if (o.type != OBJECT_STAR)
        read_map(r, c, &o);
    if (o.type == OBJECT_SHAPELET)
        read_model(r, c, m, &o);
    else if (o.type != OBJECT_STAR)
        read_profile(r, c, &o);
    *to = o;
    return r->st;
}

int scene_open(struct scene *s, const struct table *t, size_t before, const struct models *m, double zeropoint, const char *name,
               struct err *e)
{
    struct columns c = {0};
    struct reader r = {.name = name, .before = before, .e = e};
    struct scene got = {.n = t->nrow};
    int st = find_columns(&r, t, &c, &got.where);
    if (st)
        return st;
    if (got.n > SIZE_MAX / sizeof *got.object - 1 || !(got.object = malloc((got.n + 1) * sizeof *got.object)))
        return err_set(e, E_NOMEM, "%s: %s", name, err_text(E_NOMEM));
    for (r.row = 0; r.row < got.n && !st; r.row++) {
        st = read_row(&r, &c, m, got.where, zeropoint, &got.object[r.row]);
        got.count[got.object[r.row].type]++;
    }
    if (st)
        scene_free(&got);
    else
        *s = got;
    return st;
}

void scene_free(struct scene *s)
{
    free(s->object);
    *s = (struct scene){0};
}
