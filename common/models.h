/*
 * models.h - a shapelet catalogue in memory: ID, BETA (arcsec), NMAX, MAG and
 * COEFFS (1/arcsec, unit flux, order n rising, then n1 rising) of each model.
 */
#ifndef PIXSHEAR_MODELS_H
#define PIXSHEAR_MODELS_H

#include "err.h"
#include "table.h"
#include <stddef.h>
#include <stdint.h>

#define MODELS_NMAX 60     /* highest order a catalogue may hold */

struct models {
    size_t n;
    const int64_t *id;
    double *beta;          /* arcsec, > 0 */
    double *mag;           /* AB; NaN where the catalogue has none */
    int *nmax;             /* 0..MODELS_NMAX */
    const size_t *offset;  /* n + 1: coefficients of model i are coef[offset[i] .. offset[i+1]) */
    const double *coef;
    size_t *by_id;         /* indices in rising order of id */
};

/*
 * Check the catalogue t (read from `name`, for messages) and describe it.  The
 * description points into t, which must stay as it is.  E_MISSING: no such
 * column; E_DATA: BETA <= 0, NMAX outside 0..60, a row whose coefficients are
 * not (NMAX+1)(NMAX+2)/2 finite numbers, an ID used twice; e names the row.
 */
MUST_CHECK int models_open(struct models *m, const struct table *t, const char *name, struct err *e);
void models_free(struct models *m);

/* Index of the model with this ID, or m->n when there is none. */
size_t models_find(const struct models *m, int64_t id);

#endif
