/*
 * plan.h - what a scene needs: which path every object takes, how large its
 * stamp is, which frequencies and orders are kept, what that costs.
 *
 * An effect costs nothing unless the view calls for it: without a PSF no
 * transfer function, wing profile or transform is made; without shear no matrix.
 */
#ifndef PIXSHEAR_PLAN_H
#define PIXSHEAR_PLAN_H

#include "accuracy.h"
#include "err.h"
#include "otf.h"
#include "reach.h"
#include "stamp.h"
#include <stddef.h>

/* One object of the scene.  Order of action: parity, rotation, dilation, own shear, field shear. */
struct emitter {
    double x, y;           /* pixels of the image, centre of the first is 0; infinite: outside */
    double flux;           /* electrons in the whole exposure */
    const double *coef;    /* shapelet coefficients of unit flux, 1/arcsec; NULL: a point */
    double beta;           /* arcsec */
    double rotation;       /* rad, anticlockwise */
    double dilation;       /* > 0 */
    double g1, g2;         /* own reduced shear */
    int nmax;
    short parts;           /* this and the next parts-1 are one object and share its tolerance; 0, 1: alone */
    signed char parity;    /* -1: mirrored, y -> -y */
};

/* Shear `first`, then `then` = rotation by *turn (rad), then shear g. E_RANGE for |g| >= 1. */
MUST_CHECK int shear_then(const double first[2], const double then[2], double g[2], double *turn);

/*
 * Any matrix a (rows) = scale times shear g times rotation by turn (rad), and before all that y -> -y when
 * mirror is 1. E_RANGE: singular or not finite.
 */
struct map_parts {
    double scale, turn, g[2];
    int mirror;
};
MUST_CHECK int map_split(const double a[4], struct map_parts *m);

/* The image to be made. */
struct view {
    long nx, ny;
    double pixel;          /* arcsec */
    int no_pixel;          /* values at pixel centres times pixel^2 instead of integrals */
    double diffusion;      /* sigma of charge diffusion beyond what psf holds, arcsec; needs psf */
    double box[2];         /* sides of the pixel's response, arcsec; 0: the pixel; needs psf */
    double edge[2];        /* lengths over which it falls to 0, arcsec; needs psf */
    double ipc;            /* charge to each of four neighbours, pitch arcsec away; needs psf */
    double pitch;
    const struct otf *psf; /* NULL: none */
    double g1, g2;         /* field shear, reduced */
    int shear_order;       /* 0: exact; 1..8: series of that order */
};

enum path {
    PATH_NONE,             /* outside, or no light */
    PATH_POINT,            /* all flux into one pixel (no PSF) */
    PATH_CLOSED,           /* pixel integrals in closed form (no PSF) */
    PATH_MAPPED,           /* sheared pixel integrals, Gauss-Legendre along x (no PSF) */
    PATH_FOURIER,          /* k-space with alias folding */
    PATH_BROAD             /* too large for a stamp: few frequencies of a long period, summed (broad.h) */
};
#define PATH_COUNT 6

/* How one object is drawn. */
struct draw {
    unsigned char path;
    unsigned char mapped;  /* shear by evaluating the mapped basis */
    short grid;            /* plan.grid; -1 with PATH_NONE: too large and thin to be drawn in reasonable time */
    short matrix;          /* plan.matrix or -1 */
    short grown;           /* orders after an own coefficient-space shear, or 0 */
    int x0, y0, nx, ny;    /* stamp: first pixel in the image, sides */
    float kcut;            /* frequency steps kept */
};

/* Field shear in coefficients, shared by objects of one order. */
struct matrix {
    int nmax, nout;
    double *m;             /* see shear_matrix_coeff; NULL until a thread-safe build */
};

struct plan {
    struct view view;
    struct accuracy acc;
    size_t n;
    const struct emitter *emitter;      /* not owned */
    struct draw *draw;                /* n */
    int n_grid;
    struct stamp_grid *grid;          /* classes of sides and of long periods in use */
    int lean;                         /* some have no table: the PSF's spline must outlive the plan */
    int n_matrix;
    struct matrix *matrix;
    int rotation_nmax;                /* table for turned objects; -1: none turned */
    double *rotation;
    struct wings wings;               /* with a PSF */
    int nmax;                         /* highest order drawn */

    /* for reports */
    size_t count[PATH_COUNT];
    size_t n_short;                   /* stamps of side_max whose wings, beyond it, repeat above the wanted accuracy */
    size_t n_bad;                     /* objects that are not numbers, of an order that cannot be turned, or too thin to be summed */
    double cost;                      /* predicted CPU seconds on one thread, for the objects */
    double bytes;                     /* memory of tables and draws */
    size_t fft_plans;                 /* FFT plans made: 0 without a PSF */
};

/*
 * Estimates for a shapelet of unit flux with sum c^2 = power (1/arcsec^2): peak pixel, not too large, stretched by a shear and
 * behind a PSF that leaves a star with a peak of `star`; rms size along an axis, arcsec, not too large either.
 */
double light_peak(double power, double stretch, double pixel, double star);
double light_size(double power);

/* What the detector does to the light, of the view. */
struct stamp_response view_response(const struct view *v);

/* Decide for n objects (kept by reference). E_RANGE, E_NOMEM. */
MUST_CHECK int scene_plan(struct plan *p, const struct view *v, const struct accuracy *a, size_t n,
                          const struct emitter *emitter);
void plan_free(struct plan *p);

/* Does the tolerance of object i, and how it is drawn, allow single precision (stamp_single)? */
int plan_single(const struct plan *p, size_t i);

/*
 * The shape to draw for object i: coefficients turned and sheared as planned.
 * scratch: 3 * plan_scratch(p) doubles, one per thread; s->coef points into it or to the emitter.
 */
size_t plan_scratch(const struct plan *p);
MUST_CHECK int plan_shape(const struct plan *p, size_t i, double *scratch, struct shape *s);

#endif
