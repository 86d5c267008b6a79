/* labels.c - runs of labelled pixels by row and column; see labels.h. */
#include "labels.h"
#include <stdlib.h>
#include <string.h>

int labels_new(struct labels *l, long nx, long ny, struct label_run *run, size_t n)
{
    size_t *row = malloc(((size_t)ny + 1) * sizeof *row), i = 0;
    if (!row)
        return E_NOMEM;
    for (long y = 0; y <= ny; y++) {
        while (i < n && run[i].y < y)
            i++;
        row[y] = i;
    }
    *l = (struct labels){nx, ny, run, row};
    return OK;
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
