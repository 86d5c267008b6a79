/*
 * scene.h - rows of a scene list in memory: what stands where, how bright, how shaped.
 *
 * Columns (pixshear(7)): a position, FLUX or MAG, TYPE, and per type
 *   star      nothing
 *   shapelet  MODEL; optional ROT PARITY DILATION G1 G2
 *   gauss     RE; optional Q PA G1 G2 and the above
 *   sersic    RE N; the same
 * Order of action: parity, rotation, dilation, own shear (then the field's).
 */
#ifndef PIXSHEAR_SCENE_H
#define PIXSHEAR_SCENE_H

#include "err.h"
#include "models.h"
#include "table.h"
#include <stddef.h>
#include <stdint.h>

enum scene_where {
    SCENE_FIELD,           /* DX DY: arcsec from the field centre, x right, y up */
    SCENE_SKY,             /* RA DEC: degrees */
    SCENE_PIXEL            /* X_IMAGE Y_IMAGE: pixels, first centre is 1 */
};

enum object_type { OBJECT_STAR, OBJECT_SHAPELET, OBJECT_GAUSS, OBJECT_SERSIC };

struct object {
    int64_t id;            /* ID, else the row number from 1 */
    double x, y;           /* in the unit of scene.where */
    double flux;           /* electron/s */
    double rot;            /* radians anticlockwise */
    double dilation;       /* > 0: all lengths times this, same flux (beta d, coefficients / d) */
    double g1, g2;         /* own reduced shear, |g| < 1 */
    double re;             /* arcsec, circularised half-light radius (gauss, sersic) */
    double n;              /* Sersic index, 0.5..8 */
    double q;              /* axis ratio, 0 < q <= 1 */
    double pa;             /* radians anticlockwise from +x */
    unsigned int model;    /* index into the models (shapelet) */
    unsigned char type;    /* enum object_type */
    signed char parity;    /* +1, or -1: y -> -y first of all */
};

struct scene {
    size_t n;
    enum scene_where where;
    struct object *object;
    size_t count[4];       /* objects of each type */
};

/*
 * Check rows of a list (read from `name`, for messages; `before` rows come before them) and convert them.  DX DY win
 * over RA DEC over X_IMAGE Y_IMAGE, FLUX over MAG.  m may be NULL when no
 * object is a shapelet.  `zeropoint` is the magnitude of 1 electron/s.  A cell that an object
 * uses must be a number in range; e names row and column otherwise.
 */
MUST_CHECK int scene_open(struct scene *s, const struct table *t, size_t before, const struct models *m, double zeropoint,
                          const char *name, struct err *e);
void scene_free(struct scene *s);

#endif
