/*
 * population.h - which galaxies a field holds: counts, sizes, and galaxies
 * built from Gaussians (bulge, disc, knots, arms).
 *
 * Every galaxy is a function of (seed, its number) alone: a fixed set of
 * counter-based uniforms, none of which another galaxy uses.
 */
#ifndef PIXSHEAR_POPULATION_H
#define PIXSHEAR_POPULATION_H

#include "err.h"
#include "gaussians.h"
#include "rng.h"
#include <stdint.h>

#define POPULATION_MAG_MIN 10.0     /* magnitudes the counts are continued to */
#define POPULATION_MAG_MAX 40.0

/* Galaxies per arcmin^2 between two AB magnitudes: log10 N(m) linear between knots, 18..31.25. */
double counts_between(double lo, double hi);

/* Magnitude below which the fraction u, 0 < u < 1, of those galaxies lies (exact inverse). */
double counts_magnitude(double lo, double hi, double u);

/* Recipe; lengths in arcsec. */
struct population {
    double size;           /* median half-light radius at magnitude 22.25 */
    double slope;          /* d log10(median) / d magnitude */
    double scatter;        /* sigma of ln(half-light radius) */
    double smoothing;      /* sigma of the Gaussian every galaxy is convolved with */
};

#define POPULATION_DEFAULTS {.size = 0.36, .slope = -0.105, .scatter = 0.45, .smoothing = 0.03}

/* Median half-light radius at magnitude m, arcsec. */
double population_size(const struct population *p, double m);

/* The two profiles as sums of Gaussians of half-light radius 1 and flux 1. */
struct profile {
    int n;
    double variance[8], weight[8];
};

struct profiles {
    struct profile exponential, vaucouleurs;
};

struct profiles population_profiles(void);

enum { KNOTS_MAX = 24, ARM_GAUSSIANS = 9 };

/* What was drawn; the truth of one galaxy. */
struct galaxy {
    double mag;            /* AB */
    double re;             /* half-light radius of bulge and of disc before smoothing, circularised, arcsec */
    double bt;             /* bulge to total flux */
    double q, q_bulge;     /* axis ratios of disc and bulge */
    double pa;             /* radians anticlockwise from +x, 0..pi */
    double clumpy;         /* fraction of the disc's flux in knots and arms */
    int n_knots;
    int arms;              /* has two spiral arms */
    double pitch, phase;   /* of the arms, radians; pitch < 0 winds the other way */
    double shift_x, shift_y;                             /* common offset of the knots, in units of re */
    double knot_x[KNOTS_MAX], knot_y[KNOTS_MAX], knot_size[KNOTS_MAX];   /* in units of re */
};

/* Galaxy number `id` of magnitude `mag`; r is the stream of RNG_GALAXY. */
void galaxy_draw(const struct population *p, const struct rng *r, uint64_t id, double mag, struct galaxy *g);

/* The galaxy as a sum of Gaussians, flux 1, arcsec. */
MUST_CHECK int galaxy_gaussians(const struct population *p, const struct profiles *f, const struct galaxy *g, struct gaussians *out);

/* Order of the series at a magnitude: 12 below 26, 8 below 28, else 4. */
int galaxy_order(double mag);

/* A galaxy as shapelets. */
struct galaxy_fit {
    double beta;           /* arcsec: of seven values the one that captures most power */
    double power;          /* captured fraction of the power */
    double flux;           /* captured fraction of the flux, before c was scaled to flux 1 */
};

/* Project to order nmax; c has (nmax+1)(nmax+2)/2 values, scaled to unit flux. */
MUST_CHECK int galaxy_project(const struct population *p, const struct galaxy *g, const struct gaussians *s, int nmax,
                              double *c, struct galaxy_fit *fit);

/* Indices of the uniforms of one galaxy; those of position come first. */
enum galaxy_draws {
    DRAW_X, DRAW_Y, DRAW_MAG, DRAW_SIZE, DRAW_KIND, DRAW_BULGE, DRAW_INCLINE = DRAW_BULGE + 5, DRAW_ANGLE, DRAW_CLUMPY, DRAW_KNOTS,
    DRAW_ARMS, DRAW_PITCH, DRAW_PHASE, DRAW_WINDING, DRAW_SHIFT_X, DRAW_SHIFT_Y, DRAW_KNOT,      /* then four for each knot */
    DRAW_END = DRAW_KNOT + 4 * KNOTS_MAX
};

#endif
