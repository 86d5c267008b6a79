/*
 * tally.h - what the plans of all blocks of a scene come to together: which paths, how many stamps of which size, what it costs.
 */
#ifndef PIXSHEAR_TALLY_H
#define PIXSHEAR_TALLY_H

#include "plan.h"
#include <stddef.h>

/* Stamps of one size, or objects of one long period. */
struct tally_grid {
    int broad;             /* of a period, not of stamps */
    double pixels;         /* of the image, per side */
    int frequencies;       /* per axis, at most */
    size_t n;
};

#define TALLY_GRIDS 128

struct tally {
    size_t n, count[PATH_COUNT], n_bad, n_short;   /* as in struct plan */
    int n_grid;
    struct tally_grid grid[TALLY_GRIDS];
    size_t fft_plans;      /* of one block, at most */
    int n_matrix;
    double bytes;
    double cost;           /* CPU seconds on one thread, with making and writing the image */
};

/* Add the plan of one more block. */
void tally_add(struct tally *t, const struct plan *p);

#endif
