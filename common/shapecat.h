/*
 * shapecat.h - shapes of a catalogue of objects on an image: from the columns
 * of a detection to the columns of a shape catalogue, and star-moment tables.
 */
#ifndef PIXSHEAR_SHAPECAT_H
#define PIXSHEAR_SHAPECAT_H

#include "err.h"
#include "moments.h"
#include "region.h"
#include "rrg.h"
#include "starmom.h"
#include "table.h"

struct shapecat_options {
    double mult;              /* width of the weight in units of sqrt(A_IMAGE B_IMAGE) */
    double fixed;             /* width for all objects, px; 0: none */
    double min, max;          /* limits of the width, px */
    double sky_var;           /* variance of the sky noise where there is no BACKRMS */
    int no_background;        /* BACKGROUND is not subtracted */
    double first_width;       /* with rrg.first: width of the PSF's weight, px */
    struct moments_options moments;
    struct rrg_options rrg;
    int keep;                 /* the moments are kept for shapecat_correct() */
    int threads;
};

/*
 * The rows of NUMBER X_IMAGE Y_IMAGE A_IMAGE B_IMAGE [BACKGROUND] [BACKRMS] that may serve as stars; allocated.
 * A_IMAGE, B_IMAGE that are not > 0 give the smallest width.  E_MISSING: e names the column.  Used are those with FLAGS (when
 * there is such a column) below 4, and no brighter object (FLUX_AUTO) within
 * `radius` pixels, so that pieces of a bright star's wings go and the star stays.
 * Blended stars are kept: whether a star is split depends on its place in the
 * pixel, and leaving those out would make the mean PSF that of the others.
 */
MUST_CHECK int shapecat_stars(const struct table *t, const struct shapecat_options *opt, double radius,
                              struct moments_object **stars, size_t *n, struct err *e);

/*
 * Shapes of a catalogue that comes in blocks.  shapecat_open() adds the shape columns to t, or takes those that are there;
 * shapecat_measure() fills them for the rows that t has now, shapecat_correct() with another correction of the
 * same moments (opt->keep).
 * t, map, psf (NULL: no correction, P = 0) and opt must stay; t keeps its columns.  bad: rows with FLAGS_RRG != 0.
 * E_MISSING: a column of the input; E_DATA: a shape column is of another type.
 */
struct shapecat;
MUST_CHECK int shapecat_open(struct shapecat **s, struct table *t, const struct moments_map *map, const struct starmom *psf,
                             const struct shapecat_options *opt, struct err *e);
MUST_CHECK int shapecat_measure(struct shapecat *s, long *bad);
MUST_CHECK int shapecat_correct(struct shapecat *s, const struct rrg_options *rrg);
/* Second moments as observed, as ellipses of twice their rms; red with a flag, the weight where there are none. */
void shapecat_region(const struct shapecat *s, struct region *r);
void shapecat_close(struct shapecat *s);

/*
 * Star moments as a table: WIDTH [pixel] NSTARS PXX .. PYYYY, errors and covariances
 * (PXX_PXY ..), one row per width; keywords DSTAR, DSTARERR, DSTARW [pixel].
 */
MUST_CHECK int starmom_to_table(const struct starmom *s, struct table *t);
MUST_CHECK int starmom_from_table(struct starmom *s, const struct table *t, struct err *e);

/* Median D of the stars, each measured with its own width (as a galaxy would be); NaN when there is none. */
MUST_CHECK int shapecat_own_size(const struct moments_map *map, size_t n, const struct moments_object *stars,
                                 const struct moments_options *opt, double *dstar);

/* Robust rms of an image: 1.4826 x median |I - median| of up to 1e6 pixels spread over it. */
MUST_CHECK int shapecat_noise(const struct moments_map *map, double *rms);

#endif
