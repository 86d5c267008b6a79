/*
 * deblend.h - components split into objects, and the sums over each object.
 *
 * Rule (the multi-threshold rule of Bertin & Arnouts 1996): N levels are spaced
 * exponentially between the component's threshold and its peak.  Where two or
 * more branches that are separate above a level join below it, each with at
 * least min_area pixels and more than `contrast` of the component's flux above
 * that level, they are objects of their own.  Pixels outside the branches go,
 * from bright to faint and outwards from labelled neighbours, to the neighbour
 * object whose Gaussian profile is brightest there; in the moments their light is
 * divided among the objects in the ratio of the profiles.
 *
 * All levels come from one flood from the peak downwards with union-find, so
 * time is linear in the pixels of the component (times 8 neighbours).
 */
#ifndef PIXSHEAR_DEBLEND_H
#define PIXSHEAR_DEBLEND_H

#include "err.h"
#include "segment.h"
#include <stdint.h>

/* Sums over the pixels of one object; coordinates relative to (x0, y0) inside the sums. */
struct blob {
    int32_t x0, y0;            /* pixel the sums refer to */
    int32_t xmin, xmax, ymin, ymax;
    int32_t xpeak, ypeak;      /* brightest unfiltered pixel */
    int32_t flags;             /* DETECT_BLENDED */
    long n;                    /* pixels */
    long above;                /* of them, unfiltered value above the threshold */
    double s, sx, sy, sxx, sxy, syy;   /* of filtered values f: sum f, f x, ... */
    double core_x, core_y;     /* blended: centroid of the branch's pixels, relative to (x0, y0) */
    double flux;               /* sum of unfiltered values */
    double peak, smooth_peak;
    double threshold;          /* filtered level of the isophote */
    double margin;             /* the min_area-th brightest filtered pixel's excess over it */
};

enum { DETECT_BLENDED = 2, DETECT_UNSEPARATED = 64 };

struct blob_list {
    size_t n, cap;
    struct blob *blob;
};

struct deblend_params {
    long levels;               /* 2..1024; 1 or contrast 1: no deblending */
    double contrast;           /* 0..1 */
    long min_area;             /* pixels of an object, for blob.margin */
    long branch_area;          /* least pixels of a branch */
    double threshold;          /* filtered level everywhere; ignored with rms_map */
    const float *rms_map;      /* or NULL; then threshold is in units of it */
    long nx;                   /* of the image, for rms_map */
    size_t most;               /* pixels of a component that is split; larger ones get DETECT_UNSEPARATED; 0: no limit */
};

struct deblend_work;           /* scratch of one thread */
MUST_CHECK int deblend_work_new(struct deblend_work **w);
void deblend_work_free(struct deblend_work *w);

/*
 * Split component c of s; append its objects to `out`.  When they are several,
 * write for each of its pixels owner[at] = index in `out`; this may be the memory
 * of s->smooth, whose values of the component are then gone.
 */
MUST_CHECK int deblend_component(const struct segments *s, size_t c, const struct deblend_params *p,
                                 struct deblend_work *w, int32_t *owner, struct blob_list *out);

/* a takes the pixels and the flux of b, but keeps its own position and shape. */
void blob_absorb(struct blob *a, const struct blob *b);

/*
 * Centroid (pixels from 0) and second moments (pixel^2) of filtered values;
 * for a deblended object the centroid of its branch, which neighbours disturb
 * less, and moments of all its pixels about that.
 * Where the moments are singular (determinant below 1/144), 1/12 is added to
 * both axes.
 */
void blob_moments(const struct blob *b, double *x, double *y, double *xx, double *xy, double *yy);

/* Ellipse of second moments: rms along both axes, pixels, and the angle of the
   major axis from +x, degrees, (-90, 90]; theta NULL: not asked for. */
void ellipse_axes(double xx, double xy, double yy, double *a, double *b, double *theta);

#endif
