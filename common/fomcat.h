/*
 * fomcat.h - what the figures of merit need of a shape catalogue, and which
 * objects two catalogues have in common.
 */
#ifndef PIXSHEAR_FOMCAT_H
#define PIXSHEAR_FOMCAT_H

#include "err.h"
#include "table.h"
#include "tableio.h"
#include <stddef.h>

struct fom_object {
    double x, y;              /* sky: right ascension and declination, deg; else arcsec */
    double e[2], err[2];
    double p[2];              /* P11, P22 */
    double key;               /* what bins are made of; NaN: in no bin */
    int passes;               /* passes the cuts and has an ellipticity */
    int listed;               /* its key is in the bin */
    int used;                 /* both */
    int measured;             /* has an ellipticity below 2 */
};

struct fom_image {
    char set[64];             /* SETNAME */
    char sky[64];             /* FIELDID or SEED: images of one sky show the same galaxies */
    char field[112];          /* the same with NOISSEED, and a sign for MIRROR: one sky and noise under all shears */
    double scale;             /* CCDSCALE, arcsec */
    double g[2];              /* SHEAR1, SHEAR2 */
    double epsf[2];           /* EPSF1, EPSF2: ellipticity of the PSF; NaN: unknown */
    double area;              /* arcmin^2; NaN: unknown */
    double count[5];          /* left after: detection, stars, ellipticity, size, S/N; NaN: unknown */
    int marked;               /* has a column CUT: rows that fail are there too */
    int on_sky;               /* positions are on the sky */
    size_t n;
    struct fom_object *object;
};

/*
 * What fom needs of one catalogue, read to its end with t as its header and block (in NULL: all of t); all objects listed.  `name` is for messages; the objects take at most max_memory bytes.  key: a column of
 * numbers, or SNR (FLUX_AUTO/FLUXERR_AUTO), SIZE (D_RRG in arcsec), DISTANCE (arcsec to the nearest
 * other row of the catalogue); NULL: none.  E_MISSING: e names the column or
 * keyword.  Free with fom_image_free.
 */
MUST_CHECK int fom_image_read(struct fom_image *im, struct table_in *in, struct table *t, const char *name, const char *key,
                              double max_memory, struct err *e);

/* List the objects with lo <= key < hi. */
void fom_image_bin(struct fom_image *im, double lo, double hi);
void fom_image_free(struct fom_image *im);

/* Number of used objects. */
size_t fom_image_used(const struct fom_image *im);

/*
 * Mutual nearest neighbours: to[i] is the object of b that is nearest to object
 * i of a and whose nearest in a is i, not farther than radius (arcsec); -1: none.
 */
MUST_CHECK int fom_match(const struct fom_image *a, const struct fom_image *b, double radius, long *to);

#define FOM_PARTS 16

/* part[i], 0..FOM_PARTS - 1: which of 4 x 4 parts of the sky between the outermost objects object i lies in. */
MUST_CHECK int fom_parts(const struct fom_image *im, int *part);

#endif
