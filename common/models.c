/*
 * models.c - a shapelet catalogue checked, described and searched by ID.
 */
#include "models.h"
#include "unitname.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

void models_free(struct models *m)
{
    free(m->beta);
    free(m->mag);
    free(m->nmax);
    free(m->by_id);
    *m = (struct models){0};
}

struct key {
    int64_t id;
    size_t at;
};

static int key_order(const void *a, const void *b)
{
    const struct key *x = a, *y = b;
    if (x->id != y->id)
        return x->id < y->id ? -1 : 1;
    return (x->at > y->at) - (x->at < y->at);
}

/* by_id, and no ID twice. */
static int sort_ids(struct models *m, const char *name, struct err *e)
{
    struct key *k = malloc((m->n + 1) * sizeof *k);
    if (!k)
        return err_set(e, E_NOMEM, "%s: %s", name, err_text(E_NOMEM));
    for (size_t i = 0; i < m->n; i++)
        k[i] = (struct key){m->id[i], i};
    qsort(k, m->n, sizeof *k, key_order);
    int st = OK;
    for (size_t i = 0; i < m->n; i++) {
        m->by_id[i] = k[i].at;
        if (i && k[i].id == k[i - 1].id && !st)
            st = err_set(e, E_DATA, "%s: rows %zu and %zu both have ID %lld", name, k[i - 1].at + 1, k[i].at + 1, (long long)k[i].id);
    }
    free(k);
    return st;
}

/* One row: its numbers and its coefficients. */
static int check_row(struct models *m, size_t i, int64_t nmax, const char *name, struct err *e)
{
    size_t have = m->offset[i + 1] - m->offset[i];
    long long id = (long long)m->id[i];
    if (!(m->beta[i] > 0) || !isfinite(m->beta[i]))
        return err_set(e, E_DATA, "%s: row %zu (ID %lld): BETA %g must be > 0", name, i + 1, id, m->beta[i]);
    if (nmax < 0 || nmax > MODELS_NMAX)
        return err_set(e, E_DATA, "%s: row %zu (ID %lld): NMAX %lld must be in 0..%d", name, i + 1, id, (long long)nmax, MODELS_NMAX);
    size_t want = (size_t)(nmax + 1) * (size_t)(nmax + 2) / 2;
    if (have != want)
        return err_set(e, E_DATA, "%s: row %zu (ID %lld): %zu COEFFS where NMAX %lld needs %zu", name, i + 1, id, have, (long long)nmax, want);
    for (size_t j = 0; j < have; j++)
        if (!isfinite(m->coef[m->offset[i] + j]))
            return err_set(e, E_DATA, "%s: row %zu (ID %lld): coefficient %zu is not finite", name, i + 1, id, j + 1);
    m->nmax[i] = (int)nmax;
    return OK;
}

static int fill(struct models *m, const struct table *t, const char *name, struct err *e)
{
    const struct column *beta = table_find(t, "BETA"), *mag = table_find(t, "MAG"), *c = table_find(t, "COEFFS");
    const int64_t *nmax = table_ints(t, "NMAX");
    m->id = table_ints(t, "ID");
    static const char *const needed[] = {"ID", "BETA", "NMAX", "COEFFS"};
    for (size_t i = 0; i < 4; i++)
        if (!table_find(t, needed[i]))
            return err_set(e, E_MISSING, "%s: no column %s: a shapelet catalogue has ID BETA NMAX MAG and last COEFFS", name, needed[i]);
    if (t->nrow && (!m->id || !nmax))
        return err_set(e, E_DATA, "%s: column %s must hold whole numbers", name, m->id ? "NMAX" : "ID");
    if (!unitname_is(beta->unit, "arcsec"))
        return err_set(e, E_DATA, "%s: column BETA is in '%.40s', not in arcsec: convert it", name, beta->unit);
    if (beta->type == COL_TEXT || beta->type == COL_RAGGED || (mag && mag->type == COL_TEXT))
        return err_set(e, E_DATA, "%s: column %s must hold numbers", name, mag && mag->type == COL_TEXT ? "MAG" : "BETA");
    if (c->type != COL_RAGGED)
        return err_set(e, E_DATA, "%s: COEFFS must be the last column", name);
    m->n = t->nrow;
    m->beta = malloc((m->n + 1) * sizeof *m->beta);
    m->mag = malloc((m->n + 1) * sizeof *m->mag);
    m->nmax = malloc((m->n + 1) * sizeof *m->nmax);
    m->by_id = malloc((m->n + 1) * sizeof *m->by_id);
    if (!m->beta || !m->mag || !m->nmax || !m->by_id)
        return err_set(e, E_NOMEM, "%s: %s", name, err_text(E_NOMEM));
    m->offset = c->start;
    m->coef = c->v.r;
    for (size_t i = 0; i < m->n; i++) {
        m->beta[i] = table_number(beta, i);
        m->mag[i] = mag ? table_number(mag, i) : (double)NAN;
        int st = check_row(m, i, nmax[i], name, e);
        if (st)
            return st;
    }
    return sort_ids(m, name, e);
}

int models_open(struct models *m, const struct table *t, const char *name, struct err *e)
{
    struct models got = {0};
    int st = fill(&got, t, name, e);
    if (st)
        models_free(&got);
    else
        *m = got;
    return st;
}

size_t models_find(const struct models *m, int64_t id)
{
    size_t lo = 0, hi = m->n;
    while (lo < hi) {
        size_t mid = lo + (hi - lo) / 2;
        if (m->id[m->by_id[mid]] < id)
            lo = mid + 1;
        else
            hi = mid;
    }
    return lo < m->n && m->id[m->by_id[lo]] == id ? m->by_id[lo] : m->n;
}
