/*
 * drizzle.h - variable-pixel linear reconstruction (Fruchter & Hook 2002, PASP
 * 114, 144).
 *
 * Each input pixel shrinks to a drop of `pixfrac` of its side and falls on the
 * output grid.  With a the part of the drop that an output pixel gets,
 *
 *   flux   = sum w a d s,    weight = sum w a,    image = flux / weight,
 *
 * s being a factor for units.  Positions count from 0 at the centre of the
 * first pixel.  Positions of drop edges are rounded to 2^-20 (1e-6) of an output pixel,
 * so that edges meant to coincide do.
 */
#ifndef PIXSHEAR_DRIZZLE_H
#define PIXSHEAR_DRIZZLE_H

#include "err.h"
#include <stddef.h>
#include <stdint.h>

enum drizzle_kernel {
    DRIZZLE_SQUARE,      /* the mapped pixel itself, exact overlap with any geometry */
    DRIZZLE_POINT,       /* all in the pixel under its centre */
    DRIZZLE_TURBO,       /* a square along the output axes, of the same mean scale */
    DRIZZLE_GAUSSIAN,    /* FWHM of pixfrac input pixels, cut at 2.5 sigma (at least 1.2 input pixels) */
    DRIZZLE_LANCZOS2,    /* sinc(x) sinc(x/2), x in pixfrac input pixels; x and y apart */
    DRIZZLE_LANCZOS3
};

/* Input pixel -> output pixel. */
struct drizzle_map {
    double x0, xx, xy;       /* X = x0 + xx x + xy y, when there is no grid */
    double y0, yx, yy;
    double scale;            /* output pixels per input pixel, sqrt |det| at the centre */
    long step, gx, gy;       /* grid of nodes every `step` pixels from -1; bilinear between */
    double *node_x, *node_y; /* gx * gy each, NULL for an affine map */
};

/* A transformation of n points; not OK when any cannot be transformed. */
typedef int drizzle_transform(void *ctx, size_t n, const double *x, const double *y, double *X, double *Y);

/* Error of a grid between its nodes, output pixels, at most. */
#define DRIZZLE_MAP_ERROR 1e-4

/*
 * The map of an nx x ny image: affine where the transformation is to 3e-7
 * pixels (checked on a lattice), else a grid fine enough for
 * DRIZZLE_MAP_ERROR (checked in the middle of every cell and edge).
 * Axes that cross less than 5e-7 pixels over the image are made parallel.
 * E_SINGULAR when the map has no area, E_NOMEM, or what the transformation returned.
 */
MUST_CHECK int drizzle_map_make(struct drizzle_map *m, long nx, long ny, drizzle_transform *fn, void *ctx);
void drizzle_map_free(struct drizzle_map *m);
void drizzle_map_at(const struct drizzle_map *m, double x, double y, double *X, double *Y);

/* The m->gx positions at x = -1, step - 1, ... of the line y of a grid; between them the map is linear. */
void drizzle_map_line(const struct drizzle_map *m, double y, double *X, double *Y);

/* lo[2], hi[2]: bounds of the image of the rectangle [x0,x1] x [y0,y1], grown for a grid by 1e-3. */
void drizzle_map_bounds(const struct drizzle_map *m, double x0, double y0, double x1, double y1,
                        double lo[2], double hi[2]);

/* Columns first..end-1 of an exposure fall on cells cell, cell + stride, ..., the others elsewhere; stride 0: they do not. */
struct drizzle_comb {
    long first, end, cell, stride;
};

/* Some rows of an exposure. */
struct drizzle_input {
    long nx, y0, ny;
    const float *pix;        /* nx * ny; NaN counts as weight 0 */
    const float *weight;     /* the same, or NULL; NaN, infinite and <= 0 count as 0 */
    const float *var;        /* variance of pix, or NULL; NaN and < 0 count as weight 0 */
    const unsigned char *bad;    /* not 0: weight 0; or NULL */
    double w;                /* weight of the exposure, multiplied with the map */
    double scale;            /* s above */
    uint32_t bit;            /* set in `context` where the exposure contributes */
    const struct drizzle_comb *comb;     /* what drizzle_comb_make tells of it, or NULL */
};

/* Some rows of the output. */
struct drizzle_band {
    long nx, y0, ny;
    double *sum;             /* nx * ny pairs of flux and weight, added to */
    double *var;             /* nx * ny or NULL: sum of (w a s)^2 var */
    uint32_t *context;       /* nx * ny or NULL */
    int split;               /* set when a drop falls on more than one pixel */
};

/*
 * Add rows of an exposure to a band, in the order of the input's pixels.
 * pixfrac 0..8; drops smaller than the rounding fall like points.  E_RANGE, E_NOMEM.
 */
MUST_CHECK int drizzle_rows(enum drizzle_kernel kernel, double pixfrac, const struct drizzle_map *map,
                            const struct drizzle_input *in, struct drizzle_band *band);

/*
 * 0 when every drop of an nx x ny exposure falls on one output pixel (points, and
 * interlaced squares), so that output pixels stay independent.
 */
int drizzle_splits(enum drizzle_kernel kernel, double pixfrac, const struct drizzle_map *map, long nx, long ny);

/* Where the columns of an nx x ny exposure fall when every drop falls on one pixel of an output of this width; saves time. */
void drizzle_comb_make(struct drizzle_comb *comb, enum drizzle_kernel kernel, double pixfrac, const struct drizzle_map *map,
                       long nx, long ny, long width);

/* Largest distance in output pixels between a drop's centre and a pixel centre it reaches. */
double drizzle_reach(enum drizzle_kernel kernel, double pixfrac, const struct drizzle_map *map);

/*
 * Noise of a large area over what single pixels let expect, for uniformly
 * spread drops; ratio = output pixels per input pixel.  With r = pixfrac * ratio
 * the square gives r/(1 - 1/3r) for r >= 1, 1/(1 - r/3) below (Fruchter & Hook, section 7).
 */
double drizzle_noise_factor(enum drizzle_kernel kernel, double pixfrac, double ratio);

#endif
