/*
 * fuzz_table.c - the catalogue reader on any bytes, and what is read as scene list, models and shapes; what was read is
 * written and read again: the same rows, columns, keywords and bits.
 */
#include "fomcat.h"
#include "fuzz.h"
#include "models.h"
#include "scene.h"
#include "tableio.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static int same_column(const struct column *a, const struct column *b, size_t nrow)
{
    if (a->type != b->type || strcmp(a->name, b->name))
        return 0;
    for (size_t i = 0; i < nrow; i++) {
        if (a->type == COL_TEXT && strcmp(a->v.s[i], b->v.s[i]))
            return 0;
        if (a->type == COL_INT && a->v.i[i] != b->v.i[i])
            return 0;
        if (a->type == COL_REAL && a->v.r[i] != b->v.r[i] && !(a->v.r[i] != a->v.r[i] && b->v.r[i] != b->v.r[i]))
            return 0;
    }
    return 1;
}

static void round_trip(const struct table *t, struct table *back)
{
    char name[64];
    struct err e = {""};
    snprintf(name, sizeof name, "/tmp/fuzz_table.%ld", (long)getpid());
    if (table_write(t, name, NULL, NULL, 0, &e) || table_read(back, name, 64e6, &e)) {
        fprintf(stderr, "%s\n", e.text);
        abort();
    }
    unlink(name);
    if (back->nrow != t->nrow || back->ncol != t->ncol || back->nkey != t->nkey || back->nhistory != t->nhistory)
        abort();
    for (size_t k = 0; k < t->ncol; k++)
        if (!same_column(&t->col[k], &back->col[k], t->nrow))
            abort();
}

/* A second time units and descriptions are as the first left them. */
static void twice(const struct table *t)
{
    struct table once, again;
    round_trip(t, &once);
    round_trip(&once, &again);
    for (size_t k = 0; k < t->ncol; k++)
        if (strcmp(once.col[k].unit, again.col[k].unit) || strcmp(once.col[k].what, again.col[k].what))
            abort();
    table_free(&once);
    table_free(&again);
}

void fuzz_file(const char *name)
{
    struct err e = {""};
    struct table t;
    struct models m = {0};
    struct scene s;
    struct fom_image im;
    if (table_read(&t, name, 64e6, &e)) {
        if (!e.text[0])
            abort();       /* a failure without a cause */
        return;
    }
    int models = models_open(&m, &t, name, &e) == OK;
    if (scene_open(&s, &t, 0, models ? &m : NULL, 26.65, name, &e) == OK)
        scene_free(&s);
    if (models)
        models_free(&m);
    if (fom_image_read(&im, NULL, &t, "fuzz", "S_N", 64e6, &e) == OK)
        fom_image_free(&im);
    twice(&t);
    table_free(&t);
}
