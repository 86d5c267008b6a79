/* truth.c - the scene list with where and how bright each object is in an image. */
#include "truth.h"
#include "catkeys.h"
#include "sky.h"
#include <stdlib.h>
#include <string.h>

enum { TRUTH_X, TRUTH_Y, TRUTH_RA, TRUTH_DEC, TRUTH_FLUX, TRUTH_COLUMNS };

static const struct { const char *name, *unit, *what; } column[TRUTH_COLUMNS] = {
    {"X_IMAGE", "pixel", "Position, first pixel centre is 1"},
    {"Y_IMAGE", "pixel", "Position, first pixel centre is 1"},
    {"ALPHA_J2000", "deg", "Right ascension of it"},
    {"DELTA_J2000", "deg", "Declination of it"},
    {"FLUX_IMAGE", "electron", "Expected electrons, whole object"}};

/* Columns of these names leave, new ones come, all real. */
static int renew(struct table *t)
{
    unsigned char *keep = malloc(t->ncol + 1);
    if (!keep)
        return E_NOMEM;
    for (size_t k = 0; k < t->ncol; k++) {
        keep[k] = 1;
        for (int c = 0; c < TRUTH_COLUMNS; c++)
            if (strcmp(t->col[k].name, column[c].name) == 0)
                keep[k] = 0;
    }
    table_keep_columns(t, keep);
    free(keep);
    int st = OK;
    for (int c = 0; c < TRUTH_COLUMNS && st == OK; c++)
        st = table_add(t, column[c].name, COL_REAL, column[c].unit, column[c].what);
    return st;
}

int truth_add(struct table *t, const struct scene *s, const struct header *h, const double *x, const double *y, double exptime)
{
    struct sky *sky;
    struct err e;
    double *to[TRUTH_COLUMNS];
    int st = renew(t);
    if (st == OK)
        st = catkeys_copy(t, h);
    for (int c = 0; c < TRUTH_COLUMNS && st == OK; c++)
        to[c] = table_reals(t, column[c].name);
    if (st)
        return st;
    for (size_t i = 0; i < s->n; i++) {
        to[TRUTH_X][i] = x[i] + 1;
        to[TRUTH_Y][i] = y[i] + 1;
        to[TRUTH_FLUX][i] = s->object[i].flux * exptime;
    }
    st = sky_open(&sky, h, &e);
    if (st)
        return st;
    st = sky_from_pixel(sky, s->n, x, y, to[TRUTH_RA], to[TRUTH_DEC]);
    sky_close(sky);
    return st == E_RANGE ? OK : st;        /* where there is no sky: nan */
}
