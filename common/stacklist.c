/*
 * stacklist.c - where a list places the exposures of a stack.
 */
#include "stack.h"
#include "table.h"
#include "tableio.h"
#include <math.h>
#include <string.h>

/* The columns of a list; FILE and EXPNUM name exposures, NULL where missing. */
struct columns {
    const struct column *file, *expnum, *dx, *dy, *rotation, *scale;
};

static const char *base_of(const char *name)
{
    const char *slash = strrchr(name, '/');
    return slash ? slash + 1 : name;
}

/* 1 when row i is meant for the exposure. */
static int is_for(const struct columns *c, size_t i, const struct shot *t)
{
    if (c->file)
        return strcmp(c->file->v.s[i], t->label) == 0 || strcmp(c->file->v.s[i], base_of(t->label)) == 0;
    return c->expnum->v.i[i] == t->x.expnum;
}

/* The row of exposure k; nrow and a cause when there is none, or more than one. */
static size_t row_of(const struct stack *s, const struct table *t, const struct columns *c, size_t k, struct err *e)
{
    const struct shot *shot = &s->shot[k];
    if (!c->file && !c->expnum)
        return k;
    size_t row = t->nrow;
    for (size_t i = 0; i < t->nrow; i++) {
        if (!is_for(c, i, shot))
            continue;
        if (row < t->nrow) {
            err_set(e, E_DATA, "%s: rows %zu and %zu are both for %s", s->choice.shifts, row + 1, i + 1, shot->label);
            return t->nrow;
        }
        row = i;
    }
    if (row == t->nrow && c->file)
        err_set(e, E_DATA, "%s: no row with FILE %s", s->choice.shifts, base_of(shot->label));
    else if (row == t->nrow)
        err_set(e, E_DATA, "%s: no row with EXPNUM %ld, for %s", s->choice.shifts, shot->x.expnum, shot->label);
    return row;
}

static int find_columns(const struct stack *s, const struct table *t, struct columns *c, struct err *e)
{
    const char *name = s->choice.shifts;
    *c = (struct columns){table_find(t, "FILE"), table_find(t, "EXPNUM"), table_find(t, "DX"), table_find(t, "DY"),
                          table_find(t, "ROT"), table_find(t, "SCALE")};
    if (!c->dx || !c->dy)
        return err_set(e, E_DATA, "%s: column %s is missing", name, c->dx ? "DY" : "DX");
    if ((c->file && c->file->type != COL_TEXT) || (c->expnum && c->expnum->type != COL_INT))
        return err_set(e, E_DATA, "%s: FILE must be words, EXPNUM whole numbers", name);
    if (t->nrow != s->n && !c->file && !c->expnum)
        return err_set(e, E_DATA, "%s: %zu rows for %zu exposures: a column FILE or EXPNUM tells which is which", name,
                       t->nrow, s->n);
    return OK;
}

static int read_row(const struct stack *s, const struct columns *c, size_t i, struct stack_shift *v, struct err *e)
{
    *v = (struct stack_shift){
        .dx = table_number(c->dx, i), .dy = table_number(c->dy, i),
        .rotation = c->rotation ? table_number(c->rotation, i) : 0, .scale = c->scale ? table_number(c->scale, i) : 1,
    };
    if (!(fabs(v->dx) <= 1e6 && fabs(v->dy) <= 1e6))
        return err_set(e, E_DATA, "%s: row %zu: DX and DY are -1e6 to 1e6 pixels", s->choice.shifts, i + 1);
    if (!(fabs(v->rotation) <= 360))
        return err_set(e, E_DATA, "%s: row %zu: ROT is -360 to 360 degrees", s->choice.shifts, i + 1);
    if (!(v->scale >= 1e-6 && v->scale <= 1e6))
        return err_set(e, E_DATA, "%s: row %zu: SCALE is 1e-6 to 1e6", s->choice.shifts, i + 1);
    return OK;
}

int stack_shifts(struct stack *s, struct err *e)
{
    struct table t = {0};
    struct columns c;
    int st = table_read(&t, s->choice.shifts, s->choice.max_memory, e);
    if (st == OK)
        st = find_columns(s, &t, &c, e);
    for (size_t k = 0; k < s->n && st == OK; k++) {
        const size_t row = row_of(s, &t, &c, k, e);
        st = row == t.nrow ? E_DATA : read_row(s, &c, row, &s->shot[k].shift, e);
    }
    table_free(&t);
    return st;
}
