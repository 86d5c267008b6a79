/*
 * fom.h - figures of merit of a survey from its shape catalogues: number
 * density, bias of the shear, spread of the shear, and what they make of the
 * power spectrum's error.
 *
 * A group is all images of one set and one CCD pixel scale: nine shears of one
 * or more fields.  Shear estimate: e/G with one G, the mean of (P11 + P22)/2
 * over all used objects of the group.  What cannot be had from so few objects
 * is NaN, which programs write as "undefined".
 */
#ifndef PIXSHEAR_FOM_H
#define PIXSHEAR_FOM_H

#include "err.h"
#include "fomcat.h"
#include "table.h"
#include <stddef.h>
#include <stdint.h>

struct fom_options {
    double radius;            /* largest distance of common objects, arcsec */
    int everywhere;           /* common objects lie in the bin in every image, not only in the g = 0 one */
    int psf;                  /* slopes are against the PSF's ellipticity (leakage), not the shear */
    int median;               /* median instead of mean in G */
    int fit_line;             /* correct sigma with the slopes of the fits even where pairs give better ones */
    long draws;               /* bootstrap resamplings */
    uint64_t seed;
    const char *ref_set;      /* Delta C_l is normalised to this set and scale */
    double ref_scale;
};

/* Columns of the result after SETNAME CCDSCALE NIMAGES NFIELDS; fom_column[] describes them. */
enum fom_quantity {
    FOM_N_DET, FOM_N_DETERR, FOM_N_STARCUT, FOM_N_STARCUTERR, FOM_N_ELLCUT, FOM_N_ELLCUTERR, FOM_N_SIZECUT, FOM_N_SIZECUTERR,
    FOM_N_SNRCUT, FOM_N_SNRCUTERR, FOM_N_GAL, FOM_N_GALERR, FOM_N_EFF,
    FOM_G, FOM_SIGMA_E, FOM_SIGMA_EERR,
    FOM_B1, FOM_B1SE, FOM_B1JK, FOM_A1, FOM_A1SE, FOM_CHI1, FOM_B2, FOM_B2SE, FOM_B2JK, FOM_A2, FOM_A2SE, FOM_CHI2, FOM_DOF,
    FOM_SIGMA1, FOM_SIGMA2, FOM_SIGMA, FOM_SIGMAERR, FOM_STDERR, FOM_STDERRERR,
    FOM_SKEW1, FOM_SKEW1ERR, FOM_KURT1, FOM_KURT1ERR, FOM_SKEW2, FOM_SKEW2ERR, FOM_KURT2, FOM_KURT2ERR,
    FOM_PAIRS1, FOM_BP1, FOM_BP1SE, FOM_BP1JK, FOM_BP1BS, FOM_BP1BK, FOM_BT1, FOM_BT1SE, FOM_BT1BK, FOM_CP1, FOM_CP1SE,
    FOM_PAIRS2, FOM_BP2, FOM_BP2SE, FOM_BP2JK, FOM_BP2BS, FOM_BP2BK, FOM_BT2, FOM_BT2SE, FOM_BT2BK, FOM_CP2, FOM_CP2SE,
    FOM_SEL1, FOM_SEL1SE, FOM_TOT1, FOM_TOT1SE, FOM_SEL2, FOM_SEL2SE, FOM_TOT2, FOM_TOT2SE,
    FOM_L1, FOM_L1A, FOM_L1ASE, FOM_L1B, FOM_L1BSE, FOM_L2, FOM_L2A, FOM_L2ASE, FOM_L2B, FOM_L2BSE,
    FOM_LOGDC, FOM_LOGDCERR, FOM_LOGDCBS, FOM_OPT, FOM_OPTERR,
    FOM_QUANTITIES
};

struct fom_text {
    const char *name, *unit, *what;
};
extern const struct fom_text fom_column[FOM_QUANTITIES];

/* Sums over the used objects of one part of a sky, all images of that sky. */
struct fom_block {
    char sky[64];
    int part;
    double n, p, s2;          /* number, sum of (P11 + P22)/2, sum of squared e about the image's mean */
};

struct fom_result {
    char set[64];
    double lo, hi;            /* the bin; NaN: none */
    double scale;             /* CCDSCALE, arcsec */
    double area;              /* of one image, arcmin^2 */
    long images, fields;
    double v[FOM_QUANTITIES];
    size_t blocks;
    struct fom_block *block;
};

void fom_result_free(struct fom_result *r);

/* Everything one group can tell by itself. Images all of one set and scale. Free with fom_result_free. */
MUST_CHECK int fom_group(size_t n, const struct fom_image *const *im, const struct fom_options *o, struct fom_result *r);

/*
 * Scale where sigma^2/(theta n) of a set is least: the lowest point of a
 * parabola in log theta through the least value and two neighbours on each side
 * (five scales; fewer at the end of the range), and its spread over draws of
 * blocks of sky with replacement, the same blocks at all scales that show the
 * same field.  NaN below four scales, and when it lies at an end of the range.
 * After fom_compare().
 */
MUST_CHECK int fom_optimum(size_t n, struct fom_result *r, const struct fom_options *o);

/*
 * LOGDCBS, the error of LOGDC: spread of the difference to the reference over the same draws of blocks of sky, in all
 * sets at once, so that what galaxies in common share cancels (0 for the reference itself).  The slopes stay as they are.  After fom_compare().
 */
MUST_CHECK int fom_contrast(size_t n, struct fom_result *r, const struct fom_options *o);

/* What `of` is compared with: the reference set and scale, in the same bin; NULL: not there. */
const struct fom_result *fom_reference(size_t n, const struct fom_result *r, const struct fom_result *of, const struct fom_options *o);

/*
 * Lines b = a + slope * CCDSCALE through the slopes of each set (three scales
 * or more; else their mean), sigma divided by them, Delta C_l = sigma^2/(theta
 * n) against the reference.
 */
MUST_CHECK int fom_compare(size_t n, struct fom_result *r, const struct fom_options *o);

/* The results as a catalogue, one row per group. */
MUST_CHECK int fom_to_table(size_t n, const struct fom_result *r, struct table *t);

#endif
