/*
 * starmom.h - moments of the PSF against the width of the weight.
 *
 * Stars (or the exact ePSF) are measured at up to 32 widths; the moments at any
 * other width come from a cubic spline in log w (not-a-knot), so that a point
 * source is corrected to zero size at every width.  Widths outside the table
 * take the value at its end.  Pixels throughout.
 */
#ifndef PIXSHEAR_STARMOM_H
#define PIXSHEAR_STARMOM_H

#include "err.h"
#include "moments.h"
#include "rrg.h"
#include <stddef.h>

#define STARMOM_WIDTHS 24     /* rows of a star-moment file */
#define STARMOM_MAX 64
#define STARMOM_N 8           /* xx xy yy xxxx xxxy xxyy xyyy yyyy */
#define STARMOM_PAIRS 28      /* pairs of different ones: (0,1) (0,2) .. (0,7) (1,2) .. (6,7) */

extern const char *const starmom_name[STARMOM_N];      /* PXX PXY PYY PXXXX .. PYYYY */

struct starmom {
    int n;                            /* widths, rising, 4..STARMOM_MAX */
    double w[STARMOM_MAX];
    double m[STARMOM_N][STARMOM_MAX]; /* mean normalised moments */
    double err[STARMOM_N][STARMOM_MAX];       /* standard errors of the means: the jackknife over stars */
    double cov[STARMOM_PAIRS][STARMOM_MAX];   /* covariances of pairs of means, likewise */
    long stars[STARMOM_MAX];          /* stars in each mean */
    double curve[STARMOM_N][STARMOM_MAX];     /* second derivatives of the spline */
    double dstar, dstar_err;          /* median d of the stars at width dstar_w, and its error */
    double dstar_w;
};

/* n widths, logarithmic from lo to hi (0 < lo < hi). */
MUST_CHECK int starmom_widths(struct starmom *s, int n, double lo, double hi);

/*
 * Measure n stars (start positions; w of each is ignored) at the widths set
 * and at dstar_w.  Left out: flagged stars, those of signal to noise below 20
 * at dstar_w, and those whose d there is farther from the median than 10 sigma
 * (by the median deviation, at least 2 %: wide enough for every place in the
 * pixel), which drops blends and noise.  max_stars > 0 keeps so many of the
 * rest, evenly spread over the list.  use_median replaces the mean by the median, whose variance is
 * pi/2 times larger.
 * E_MISSING when fewer than 2 stars are left at some width.
 */
MUST_CHECK int starmom_measure(struct starmom *s, const struct moments_map *map, size_t n,
                               const struct moments_object *stars, const struct moments_options *opt,
                               long max_stars, int use_median, int threads);

/* Prepare the spline after w and m were filled in. E_RANGE when widths do not rise. */
MUST_CHECK int starmom_prepare(struct starmom *s);

/* Moments at width w. */
void starmom_at(const struct starmom *s, double w, struct rrg_psf *out);

/* Covariance of the moments at width w, linear in log w between the rows; 0 for a PSF that is known. */
void starmom_cov(const struct starmom *s, double w, double cov[STARMOM_N][STARMOM_N]);

#endif
