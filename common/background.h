/*
 * background.h - level and noise of the sky, on meshes, and their interpolation.
 *
 * The image is divided into mx x my cells of nearly `cell` pixels.  In each the
 * level is 2.5 median - 1.5 mean of the pixels left by iterated clipping at
 * 3 sigma about the median, or the median where the two differ by more than
 * 0.3 sigma (crowded), or the mean of the dark part of the cell (darksky.h);
 * cells without enough good pixels take their neighbours' mean, a median filter
 * (its window shrinks at the border) removes cells that an object fills, and a
 * natural bicubic spline joins the cell centres (linear beyond the outermost).
 */
#ifndef PIXSHEAR_BACKGROUND_H
#define PIXSHEAR_BACKGROUND_H

#include "err.h"
#include "par.h"
#include "pixels.h"

/* A smooth function on nx x ny pixels, given at the centres of mx x my cells. */
struct mesh {
    long nx, ny, mx, my;
    double pivot;          /* subtracted from the nodes, exact in float32 */
    double *node;          /* my*mx values minus pivot, owned; then the three derivative tables */
    long *first;           /* mx + 1: first pixel at or after node k; owned */
    float *row;            /* ny*mx pairs: value and second derivative along x in every pixel row; or NULL */
};

struct background {
    struct mesh level;     /* of the sky, unit of the image */
    struct mesh rms;       /* of a pixel's noise */
    double mean_level;     /* median over the cells */
    double mean_rms;
    long bad;              /* pixels that do not count */
};

struct background_params {
    long cell;             /* wanted side of a cell, pixels, >= 4 */
    long filter;           /* side of the median filter, cells, odd, 1: none */
    double gain;           /* for `dark`: electrons per unit of the image, 0 unknown: the median of photon
                              noise lies 1/6 electron below its mean and is moved there */
    double removed;        /* sky already subtracted from the image, in its unit: its photon noise is still there */
    struct par_team *team; /* threads; NULL: the calling one alone */
    int dark;              /* mean of the dark part of each cell, else Source Extractor's mode, which lies
                              2.5/6 electron below the mean of photon noise */
};

/*
 * Level and standard deviation of n values, by the clipping described above.
 * gain, removed: as below.  All values finite, n >= 1.
 */
void background_clip(const float *v, long n, double gain, double removed, double *level, double *sigma);

/*
 * Measure.  Pixels that are not finite do not count, nor do those where rms_map
 * (NULL, or one value per pixel) is not finite.  E_DATA when no cell has a
 * usable pixel.  When some cells have noise, cells without any (borders of
 * exact zeros) count as bad.
 */
MUST_CHECK int background_measure(struct background *b, const struct pixels *im, const float *rms_map,
                                  const struct background_params *p);
void background_free(struct background *b);

/* out[i] = map at (x0 + i, y), i < n, minus the pivot. */
void mesh_row(const struct mesh *m, long y, long x0, long n, float *out);

/* Value at one pixel, pivot included. */
double mesh_at(const struct mesh *m, long x, long y);

/* v[i] -= level at (x0 + i, y); NaN and infinite pixels become `blank`. */
void background_subtract(const struct background *b, long y, long x0, long n, float blank, float *v);

/* The same for a box of pixels, its rows one after the other in v. */
void background_subtract_box(const struct background *b, struct box box, float blank, float *v);

/* Median of n doubles (v is reordered); mean of the middle two for even n. */
double background_median(double *v, long n);

#endif
