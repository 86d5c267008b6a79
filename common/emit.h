/*
 * emit.h - a scene list turned into what the renderer draws.
 *
 * Stars are points, shapelets themselves.  A Gaussian is a shapelet of order 0
 * with beta = RE / sqrt(2 ln 2).  A Sersic profile exp(-b (r/RE)^(1/n)), n >= 1/2, is
 * exactly a mixture of Gaussians (a completely monotone function of
 * r^2), here summed at 20 to 220 widths: error of the flux in any ring below 1e-3, 1e-4 from n = 0.52 on (tests/unit/test_render.c);
 * 0.5 <= n < 0.5025 is drawn as a Gaussian.
 * Axis ratio and position angle are a shear of the round profile.
 */
#ifndef PIXSHEAR_EMIT_H
#define PIXSHEAR_EMIT_H

#include "err.h"
#include "models.h"
#include "plan.h"
#include "scene.h"

struct emission {
    size_t n;
    struct emitter *emitter;
    double *coef;          /* of the Gaussians */
};

/*
 * x[i], y[i]: pixel positions (centre of the first is 0) of the objects of s.  exptime in s.
 * map, or NULL: a matrix for each object that acts on its shape after its own shear (distort.h); stars are
 * points and stay points.  Coefficients of shapelets stay in m.  E_RANGE: a Sersic index outside 0.5..8; E_NOMEM.
 */
MUST_CHECK int emission_new(struct emission *e, const struct scene *s, const struct models *m, const double *x,
                            const double *y, double (*map)[4], double exptime);
void emission_free(struct emission *e);

/* Bytes that emission_new takes, and that plan and drawing take for each emitter. E_RANGE as there. */
MUST_CHECK int emission_bytes(const struct scene *s, double *emission, double *drawing);

/*
 * Gaussians of a Sersic profile of half-light radius 1: sigma[k] and flux[k] (sum 1), at
 * most SERSIC_PARTS; returns their number, 0 when n is outside 0.5..8.
 */
#define SERSIC_PARTS 256
int sersic_gaussians(double n, double *sigma, double *flux);

#endif
