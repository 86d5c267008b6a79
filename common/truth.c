/* truth.c - the scene list with where and how bright each object is in an image. */
#include "truth.h"
#include "catkeys.h"
#include "tableio.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TRUTH_X, TRUTH_Y, TRUTH_RA, TRUTH_DEC, TRUTH_FLUX, TRUTH_COLUMNS };

static const struct { const char *name, *unit, *what; } column[TRUTH_COLUMNS] = {
    {"X_IMAGE", "pixel", "Position, first pixel centre is 1"},
    {"Y_IMAGE", "pixel", "Position, first pixel centre is 1"},
    {"ALPHA_J2000", "deg", "Right ascension of it"},
    {"DELTA_J2000", "deg", "Declination of it"},
    {"FLUX_IMAGE", "electron", "Expected electrons, whole object"}};

struct truth {
    struct table head;         /* what is written, without rows: columns of the list that stay, then our own */
    struct table rows;         /* a block: the list's columns and ours, not owned */
    struct table own;          /* ours */
    struct sky *sky;
    const char *record;
    struct table_out *out;
};

static int is_own(const char *name)
{
    for (int c = 0; c < TRUTH_COLUMNS; c++)
        if (strcmp(name, column[c].name) == 0)
            return 1;
    return 0;
}

/* Append our columns to t. */
static int add_own(struct table *t)
{
    int st = OK;
    for (int c = 0; c < TRUTH_COLUMNS && st == OK; c++)
        st = table_add(t, column[c].name, COL_REAL, column[c].unit, column[c].what);
    return st;
}

/* Header of the list without our columns, then with new ones; the keywords of h. */
static int make_head(struct table *head, const struct table *list, const struct header *h)
{
    struct table empty = *list;
    empty.nrow = 0;
    int st = table_copy(head, &empty);
    unsigned char *keep = malloc(list->ncol + 1);
    if (st == OK && !keep)
        st = E_NOMEM;
    for (size_t k = 0; st == OK && k < list->ncol; k++)
        keep[k] = !is_own(list->col[k].name);
    if (st == OK) {
        table_keep_columns(head, keep);
        st = add_own(head);
    }
    free(keep);
    return st == OK ? catkeys_copy(head, h) : st;
}

static void give_up(struct truth *t)
{
    table_free(&t->head);
    table_free(&t->own);
    free(t->rows.col);
    free(t);
}

int truth_open(struct truth **made, const struct table *list, const struct header *h, struct sky *sky, const char *name,
               const char *record, const char *const *inputs, size_t n_inputs, struct err *e)
{
    struct truth *t = calloc(1, sizeof *t);
    int st = t ? make_head(&t->head, list, h) : E_NOMEM;
    if (st == OK)
        st = add_own(&t->own);
    if (st == OK && !(t->rows.col = malloc(t->head.ncol * sizeof *t->rows.col)))
        st = E_NOMEM;
    if (st)
        err_set(e, st, "%s: %s", name, err_text(st));
    else
        st = table_out_open(&t->out, name, inputs, n_inputs, e);
    if (st) {
        if (t)
            give_up(t);
        return st;
    }
    t->sky = sky;
    t->record = record;
    t->rows.ncol = t->head.ncol;
    *made = t;
    return OK;
}

/* Our columns for the objects of s. */
static int fill(struct truth *t, const struct scene *s, const double *x, const double *y, double exptime)
{
    int st = table_resize(&t->own, s->n);
    if (st)
        return st;
    double *to[TRUTH_COLUMNS];
    for (int c = 0; c < TRUTH_COLUMNS; c++)
        to[c] = t->own.col[c].v.r;
    for (size_t i = 0; i < s->n; i++) {
        to[TRUTH_X][i] = isfinite(x[i]) ? x[i] + 1 : NAN;
        to[TRUTH_Y][i] = isfinite(y[i]) ? y[i] + 1 : NAN;
        to[TRUTH_FLUX][i] = s->object[i].flux * exptime;
    }
    st = sky_from_pixel(t->sky, s->n, x, y, to[TRUTH_RA], to[TRUTH_DEC]);
    return st == E_RANGE ? OK : st;        /* where there is no sky: nan */
}

int truth_rows(struct truth *t, const struct table *list, const struct scene *s, const double *x, const double *y,
               double exptime, struct err *e)
{
    int st = fill(t, s, x, y, exptime);
    if (st)
        return err_set(e, st, "%s", err_text(st));
    size_t n = 0;
    for (size_t k = 0; k < list->ncol; k++)
        if (!is_own(list->col[k].name))
            t->rows.col[n++] = list->col[k];
    memcpy(t->rows.col + n, t->own.col, TRUTH_COLUMNS * sizeof *t->rows.col);
    t->rows.nrow = s->n;
    return table_out_rows(t->out, &t->rows, e);
}

int truth_close(struct truth *t, struct err *e)
{
    int st = table_out_end(t->out, &t->head, t->record, e);
    give_up(t);
    return st;
}
