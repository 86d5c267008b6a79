/*
 * place.h - where on an image the objects of a scene list are: from the field centre, on the sky or in pixels, by the
 * WCS of the image to be made, or through that of another with its distortions (distort.h).
 */
#ifndef PIXSHEAR_PLACE_H
#define PIXSHEAR_PLACE_H

#include "err.h"
#include "plan.h"
#include "scene.h"
#include "sky.h"

struct place {
    const struct view *view;
    struct sky *sky;       /* of the image; NULL where no object has RA DEC */
    int maps;              /* the sky is seen through a WCS of its own: shapes follow it */
    double centre[2];      /* of that, deg: what DX DY are counted from */
};

/*
 * Pixel positions x[i], y[i] (the first centre is 0) of the objects of s, and with p->maps the matrix map[i] that acts on
 * the shape after its own shear.  NaN: the WCS cannot place it; infinite: on the other side of the sky. E_NOMEM, E_DATA.
 */
MUST_CHECK int place_objects(const struct place *p, const struct scene *s, double *x, double *y, double (*map)[4]);

#endif
