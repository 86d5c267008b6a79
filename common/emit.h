/*
 * emit.h - a scene list turned into what the renderer draws.
 *
 * Stars are points, shapelets themselves.  A Gaussian is a shapelet of order 0
 * with beta = RE / sqrt(2 ln 2).  A Sersic profile is a mixture of Gaussians (sersic.h).
 * Axis ratio and position angle are a shear of the round profile.
 */
#ifndef PIXSHEAR_EMIT_H
#define PIXSHEAR_EMIT_H

#include "err.h"
#include "models.h"
#include "plan.h"
#include "scene.h"
#include "sersic.h"

struct emission {
    size_t n, room;
    struct emitter *emitter;
    double *coef;          /* coef[k]: of emitter[k] when that is a Gaussian */
    double pixel, eps, floor;      /* that Sersic profiles are made for */
    struct sersic *sersic; /* NULL before the first of them */
};

/* Room for so many emitters, of profiles that are seen with pixels of `pixel` arcsec at accuracy a. E_NOMEM. */
MUST_CHECK int emission_new(struct emission *e, size_t room, double pixel, const struct accuracy *a);
void emission_free(struct emission *e);

/*
 * Append objects *next, *next + 1, ... of s as long as there is room for all parts of one (SERSIC_PARTS at most); *next
 * becomes the first that was left.  x[i], y[i]: pixel positions (centre of the first is 0).  exptime in s.
 * map, or NULL: a matrix for each object that acts on its shape after its own shear (distort.h); stars are
 * points and stay points.  Coefficients of shapelets stay in m.  E_RANGE: a Sersic index outside 0.5..8; E_NOMEM.
 */
MUST_CHECK int emission_add(struct emission *e, size_t *next, const struct scene *s, const struct models *m, const double *x,
                            const double *y, double (*map)[4], double exptime);

#endif
