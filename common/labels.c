/* labels.c - runs of labelled pixels sorted by row and column; see labels.h. */
#include "labels.h"
#include <stdlib.h>
#include <string.h>

enum { FEW = 64 };             /* runs that are sorted one by one */

int labels_new(struct labels *l, long nx, long ny)
{
    size_t *row = calloc((size_t)ny + 2, sizeof *row);
    if (!row)
        return E_NOMEM;
    *l = (struct labels){nx, ny, NULL, row};
    return OK;
}

int labels_room(struct labels *l)
{
    for (long y = 0; y < l->ny; y++)
        l->row[y + 2] += l->row[y + 1];    /* row y is put from row[y + 1] on */
    l->run = malloc((l->row[l->ny + 1] + 1) * sizeof *l->run);
    return l->run ? OK : E_NOMEM;
}

static void insert_each(struct label_run *run, size_t n)
{
    for (size_t i = 1; i < n; i++) {
        struct label_run r = run[i];
        size_t k = i;
        for (; k > 0 && run[k - 1].x0 > r.x0; k--)
            run[k] = run[k - 1];
        run[k] = r;
    }
}

/* By a list of what begins in each column. at: nx values below `mark`; copy: room for n. */
static void sort_row(struct label_run *run, size_t n, long nx, int64_t mark, int64_t *at, struct label_run *copy)
{
    size_t k = 0;
    memcpy(copy, run, n * sizeof *run);
    for (size_t i = 0; i < n; i++)
        at[copy[i].x0] = mark + (int64_t)i;
    for (long x = 0; x < nx && k < n; x++)
        if (at[x] >= mark)
            run[k++] = copy[at[x] - mark];
}

int labels_sort(struct labels *l)
{
    int64_t *at = calloc((size_t)l->nx, sizeof *at), mark = 1;
    struct label_run *copy = malloc((size_t)l->nx * sizeof *copy);
    int st = at && copy ? OK : E_NOMEM;
    for (long y = 0; y < l->ny && !st; y++) {
        struct label_run *run = l->run + l->row[y];
        size_t n = l->row[y + 1] - l->row[y];
        if (n <= FEW)
            insert_each(run, n);
        else
            sort_row(run, n, l->nx, mark, at, copy);
        mark += l->nx;
    }
    free(at);
    free(copy);
    return st;
}

void labels_free(struct labels *l)
{
    free(l->run);
    free(l->row);
    *l = (struct labels){0};
}

void labels_row(const struct labels *l, long y, int32_t *out)
{
    memset(out, 0, (size_t)l->nx * sizeof *out);
    for (size_t i = l->row[y]; i < l->row[y + 1]; i++)
        for (int32_t x = l->run[i].x0; x < l->run[i].x1; x++)
            out[x] = l->run[i].label;
}
