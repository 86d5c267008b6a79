/*
 * labels.h - which object a pixel belongs to, as runs of each row: memory goes
 * with the objects, not with the image, and looking at a piece of sky costs
 * nothing.
 */
#ifndef PIXSHEAR_LABELS_H
#define PIXSHEAR_LABELS_H

#include "err.h"
#include <stddef.h>
#include <stdint.h>

/* Pixels x0 <= x < x1 of a row; sides of images are below 2^16. */
struct label_run {
    uint16_t x0, x1;
    int32_t label;             /* 1 + index of the object */
};

struct labels {
    long nx, ny;
    struct label_run *run;     /* row by row, x rising, no two overlap */
    size_t *row;               /* ny + 1: where each row begins (and one more until labels_sort()) */
};

/*
 * To fill: count every run, make room, put every run (in any order; no two overlap), sort.  Then they can be read.
 * Linear time; beyond the runs themselves memory of one row.
 */
MUST_CHECK int labels_new(struct labels *l, long nx, long ny);
void labels_free(struct labels *l);
MUST_CHECK int labels_room(struct labels *l);
MUST_CHECK int labels_sort(struct labels *l);

static inline void labels_count(struct labels *l, long y)
{
    l->row[y + 2]++;
}

static inline void labels_put(struct labels *l, long y, long x0, long x1, int32_t label)
{
    l->run[l->row[y + 1]++] = (struct label_run){(uint16_t)x0, (uint16_t)x1, label};
}

/* The first run of row y that ends beyond x, or l->row[y + 1]. */
static inline size_t labels_from(const struct labels *l, long y, long x)
{
    size_t a = l->row[y], n = l->row[y + 1] - a;
    while (n) {                            /* halves without a branch that the processor would have to guess */
        size_t half = n / 2;
        size_t skip = l->run[a + half].x1 <= x ? half + 1 : 0;
        a += skip;
        n = skip ? n - half - 1 : half;
    }
    return a;
}

/* Label of a pixel, 0 none. */
static inline int32_t labels_at(const struct labels *l, long x, long y)
{
    size_t i = labels_from(l, y, x);
    return i < l->row[y + 1] && l->run[i].x0 <= x ? l->run[i].label : 0;
}

/* The labels of row y into out, nx values. */
void labels_row(const struct labels *l, long y, int32_t *out);

#endif
