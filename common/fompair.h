/*
 * fompair.h - the slope of the shear from the same galaxies under opposite
 * shears, the response of the selection, and the two together.
 *
 * Images of one field show the same galaxies and noise.  For component c its
 * pairs +-g give each common galaxy a response
 *   r = sum_p g_p (e+ - e-) / (2 sum_p g_p^2),
 * free of its own ellipticity; 1 + m = <r>/<G>.  With several PSFs in place of
 * shears, r is the slope against the ellipticity of the PSF and <r>/<G> its leakage.  The selection response is the
 * same sum over mean ellipticities measured without shear, of the objects that
 * pass the cuts with it; the total that of the images' own means.
 */
#ifndef PIXSHEAR_FOMPAIR_H
#define PIXSHEAR_FOMPAIR_H

#include "err.h"
#include "fomcat.h"
#include "stats.h"
#include <stdint.h>

struct fom_pairs {
    size_t common;            /* galaxies used in every image of the pairs */
    struct ratio scalar;      /* <r>/<G>, G = (P11 + P22)/2 of the same galaxies */
    struct ratio tensor;      /* <r>/<Pcc> */
    double scalar_block, tensor_block;      /* errors of both by leaving out parts of the skies */
    double response;          /* <G> of the common galaxies */
    double mean, mean_se;     /* of (e+ + e-)/2: what remains at zero shear, with shape noise */
    double selection, selection_se;  /* of the mean e per unit shear; NaN without column CUT */
    double total, total_se;
};

struct fom_pair_options {
    int psf;                  /* slopes against the ellipticity of the PSF */
    int everywhere;           /* a common galaxy is listed (in the bin) in every image, not only in the list */
    double radius;            /* largest distance of common objects, arcsec */
    long draws;               /* bootstrap resamplings */
    uint64_t seed;
};

/*
 * Pairs are found among images with the other component zero.  The g = 0 image
 * of a field is its list of galaxies (without one, and with psf: the first
 * image, and no selection response); only galaxies listed there count as common.  Undefined values are NaN.
 */
MUST_CHECK int fom_pairs(size_t n, const struct fom_image *const *im, int component, const struct fom_pair_options *o,
                         struct fom_pairs *out);

#endif
