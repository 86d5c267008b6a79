/* place.c - where on an image the objects of a scene list are. */
#include "place.h"
#include "distort.h"
#include <math.h>

/* Through a WCS of its own; the field's shear, which is drawn, acts before it. */
static int through(const struct place *p, const struct scene *s, double *x, double *y, double (*map)[4])
{
    const struct view *v = p->view;
    for (size_t i = 0; i < s->n; i++) {
        x[i] = s->object[i].x - (s->where == SCENE_PIXEL);
        y[i] = s->object[i].y - (s->where == SCENE_PIXEL);
    }
    int st = distort(p->sky, p->centre, s->where, v->pixel, s->n, x, y, map);
    for (size_t i = 0; i < s->n && st == OK && (v->g1 != 0 || v->g2 != 0); i++)
        st = distort_before((double[]){v->g1, v->g2}, map[i]);
    return st;
}

int place_objects(const struct place *p, const struct scene *s, double *x, double *y, double (*map)[4])
{
    const struct view *v = p->view;
    if (p->maps)
        return through(p, s, x, y, map);
    for (size_t i = 0; i < s->n; i++) {
        x[i] = s->object[i].x;
        y[i] = s->object[i].y;
        if (s->where == SCENE_FIELD) {
            x[i] = 0.5 * ((double)v->nx - 1) + x[i] / v->pixel;
            y[i] = 0.5 * ((double)v->ny - 1) + y[i] / v->pixel;
        } else if (s->where == SCENE_PIXEL) {
            x[i] -= 1;
            y[i] -= 1;
        }
    }
    if (s->where != SCENE_SKY || s->n == 0)
        return OK;
    int st = sky_to_pixel(p->sky, s->n, x, y, x, y);   /* what is no position becomes NaN: counted by the plan */
    for (size_t i = 0; i < s->n; i++)
        if (isnan(x[i]) && sky_far(p->sky, s->object[i].x, s->object[i].y))
            x[i] = y[i] = INFINITY;                    /* on the other side of the sky: outside */
    return st == E_RANGE ? OK : st;
}
