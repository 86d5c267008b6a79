/* labels.c - runs of labelled pixels sorted by row and column; see labels.h. */
#include "labels.h"
#include <stdlib.h>
#include <string.h>

/* Stable counting sort by x0 (by_row 0) or y; first: room for keys + 1, then where each key begins. */
static void sort_by(const struct label_run *in, size_t n, int by_row, size_t keys, size_t *first, struct label_run *out)
{
    memset(first, 0, (keys + 1) * sizeof *first);
    for (size_t i = 0; i < n; i++)
        first[by_row ? in[i].y : in[i].x0]++;
    for (size_t k = 0, at = 0; k <= keys; k++) {
        size_t here = first[k];
        first[k] = at;
        at += here;
    }
    for (size_t i = 0; i < n; i++)
        out[first[by_row ? in[i].y : in[i].x0]++] = in[i];
    memmove(first + 1, first, keys * sizeof *first);
    first[0] = 0;
}

int labels_new(struct labels *l, long nx, long ny, const struct label_run *run, size_t n)
{
    struct label_run *by_column = malloc((n + 1) * sizeof *by_column), *sorted = malloc((n + 1) * sizeof *sorted);
    size_t *column = malloc(((size_t)nx + 1) * sizeof *column), *row = malloc(((size_t)ny + 1) * sizeof *row);
    int st = by_column && sorted && column && row ? OK : E_NOMEM;
    if (!st) {
        sort_by(run, n, 0, (size_t)nx, column, by_column);
        sort_by(by_column, n, 1, (size_t)ny, row, sorted);
        *l = (struct labels){nx, ny, sorted, row};
    } else {
        free(sorted);
        free(row);
    }
    free(by_column);
    free(column);
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
