/*
 * scenelist.h - a scene list of any length, turned into emitters so many at a time that memory does not grow with it.
 */
#ifndef PIXSHEAR_SCENELIST_H
#define PIXSHEAR_SCENELIST_H

#include "emit.h"
#include "err.h"
#include "models.h"
#include "place.h"
#include "scene.h"
#include "table.h"
#include "tableio.h"
#include "truth.h"

/* What becomes of the rows. */
struct scene_use {
    const struct models *models;   /* NULL: no shapelets */
    double zeropoint, exptime;     /* magnitude of 1 electron/s; s */
    const struct place *place;
    struct truth *truth;           /* where the rows go as well; NULL: nowhere */
};

struct scene_list {
    struct table table;            /* header of the list; rows read last */
    int end;                       /* all objects were given */

    /* how far it is */
    const char *name;
    struct table_in *in;
    struct scene scene;            /* objects of those rows */
    size_t before, given;          /* rows before them; objects of them that were given */
    double *x, *y, (*map)[4];
};

/* Read the header; `name` must stay. */
MUST_CHECK int scene_list_open(struct scene_list *l, const char *name, double max_memory, struct err *e);

/* Replace what is in `out` by the next objects: as many as it has room for. */
MUST_CHECK int scene_list_next(struct scene_list *l, const struct scene_use *use, struct emission *out, struct err *e);

/* Part of the list, about, that was given: 0..1; 0: not known. */
double scene_list_part(const struct scene_list *l);

void scene_list_close(struct scene_list *l);

#endif
