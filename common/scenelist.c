/* scenelist.c - a scene list turned into emitters, block by block. */
#include "scenelist.h"
#include <stdlib.h>

#define ROWS 2048              /* of the list in memory */

int scene_list_open(struct scene_list *l, const char *name, double max_memory, struct err *e)
{
    struct scene_list got = {.name = name};
    double *space = malloc(6 * ROWS * sizeof *space);
    int st = space ? table_in_open(&got.in, &got.table, name, max_memory, e) : err_set(e, E_NOMEM, "%s: %s", name, err_text(E_NOMEM));
    if (st) {
        free(space);
        return st;
    }
    got.x = space;
    got.y = space + ROWS;
    got.map = (double (*)[4])(space + 2 * ROWS);
    *l = got;
    return OK;
}

void scene_list_close(struct scene_list *l)
{
    table_in_close(l->in);
    table_free(&l->table);
    scene_free(&l->scene);
    free(l->x);
    *l = (struct scene_list){0};
}

double scene_list_part(const struct scene_list *l)
{
    return l->end ? 1 : table_in_part(l->in);
}

/* The next rows, checked, placed and copied to the truth. */
static int read_rows(struct scene_list *l, const struct scene_use *use, struct err *e)
{
    l->before += l->scene.n;
    l->given = 0;
    scene_free(&l->scene);
    int st = table_in_rows(l->in, &l->table, ROWS, e);
    if (st == OK)
        st = scene_open(&l->scene, &l->table, l->before, use->models, use->zeropoint, l->name, e);
    if (st)
        return st;
    st = place_objects(use->place, &l->scene, l->x, l->y, l->map);
    if (st)
        return err_set(e, st, "%s: %s", l->name, err_text(st));
    return use->truth ? truth_rows(use->truth, &l->table, &l->scene, l->x, l->y, use->exptime, e) : OK;
}

int scene_list_next(struct scene_list *l, const struct scene_use *use, struct emission *out, struct err *e)
{
    int st = OK;
    out->n = 0;
    do {
        if (l->given == l->scene.n && (st = read_rows(l, use, e)))
            return st;
        st = emission_add(out, &l->given, &l->scene, use->models, l->x, l->y, use->place->maps ? l->map : NULL, use->exptime);
    } while (st == OK && l->given == l->scene.n && l->scene.n == ROWS);
    l->end = l->given == l->scene.n;
    if (st == E_RANGE)
        return err_set(e, st, "%s: a Sersic index below 0.5: only 0.5 to 8 can be drawn", l->name);
    return st ? err_set(e, st, "%s: %s", l->name, err_text(st)) : OK;
}
