/*
 * cuts.h - which objects of a shape catalogue are used: the paper's cuts in
 * their order, and any conditions on any columns.
 */
#ifndef PIXSHEAR_CUTS_H
#define PIXSHEAR_CUTS_H

#include "err.h"
#include "expr.h"
#include "starmom.h"
#include "table.h"
#include <stddef.h>
#include <stdint.h>

/* Column CUT: which cuts an object fails; 0 = used. */
enum cut_bit {
    CUT_STAR = 1,
    CUT_ELLIPTICITY = 2,
    CUT_SIZE = 4,
    CUT_SNR = 8,
    CUT_WHERE = 16
};

/* Definitions of d*, the size of a star. */
enum dstar { DSTAR_MIN, DSTAR_OWN, DSTAR_EACH };

struct cuts {
    int only_where;           /* the conditions alone: no column but theirs is needed */
    double star_prob;         /* an object with STAR_PROB above is a star */
    double locus_mag;         /* and one with MAG_AUTO below this whose size is that of a star under its own weight */
    double locus_width;       /* to this fraction; 0: no such test */
    double max_e;             /* |e| < max_e */
    double factor, floor;     /* d > factor sqrt(d*^2 + floor), pixels */
    double snr;               /* FLUX_AUTO/FLUXERR_AUTO >= snr */
    double sentinel;          /* d >= sentinel is no size */
    long flags;               /* FLAGS_RRG with one of these bits: no size */
    enum dstar which;
    double dstar;             /* DSTAR_MIN, DSTAR_OWN: pixels */
    const struct starmom *stars;     /* DSTAR_EACH: star at the object's WIDTH; NULL: column D_PSF */
};

/* NOFLUX, EDGE, SHIFT, NOCONV, UNRESOLVED: what the sentinel of the paper stands for. */
#define CUTS_DEFAULTS {.star_prob = 0.9, .max_e = 1, .factor = 1.2, .floor = 0.4, .snr = 10, \
                       .sentinel = 2000, .flags = 1 | 4 | 8 | 16 | 32}

struct cut_count {
    size_t all, stars, ellipticity, size, snr, where;    /* objects left after each cut, in this order */
};

/*
 * bits[i] for every row, and the counts; a missing value fails every cut.
 * E_MISSING: e names the column.
 */
MUST_CHECK int cuts_apply(const struct table *t, const struct cuts *c, size_t n_where, const struct expr *where,
                          int64_t *bits, struct cut_count *count, struct err *e);

/* factor sqrt(dstar^2 + floor) */
double cuts_size(const struct cuts *c, double dstar);

#endif
