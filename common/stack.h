/*
 * stack.h - exposures that are combined on one grid: which they are and in
 * what order (stackread.c), displacements from a list (stacklist.c), the grid
 * (stackgrid.c), units, weights and keywords (stackunits.c), sums and output
 * band by band (stackrows.c).
 *
 * A program fills `choice` and calls, in this order, stack_read, stack_place,
 * stack_units, stack_describe, stack_write, stack_free.
 */
#ifndef PIXSHEAR_STACK_H
#define PIXSHEAR_STACK_H

#include "drizzle.h"
#include "err.h"
#include "exposure.h"
#include "imageio.h"
#include "namelist.h"
#include "progress.h"
#include "sky.h"

enum stack_units { STACK_TOTAL, STACK_MEAN, STACK_RATE };
enum stack_map { MAP_WEIGHT, MAP_VAR, MAP_MASK, STACK_MAPS };
enum stack_weight { WEIGHT_EXPTIME, WEIGHT_MAP, WEIGHT_IVM };
enum { STACK_MAX = 4096 };             /* exposures */

/* What is asked for. */
struct stack_choice {
    struct names files, maps[STACK_MAPS];   /* maps: none, or one a file */
    enum drizzle_kernel kernel;
    double pixfrac;
    enum stack_weight weighting;
    int units;                         /* enum stack_units; -1: total where EXPTIME is known */
    double fill;                       /* value of pixels without weight */
    int flat;                          /* SCI alone, as primary image */
    const char *like, *shifts;         /* file whose grid is taken; list of displacements; or NULL */
    double scale;                      /* output pixel, arcsec; NaN: the first exposure's */
    int turned, sized, centred;        /* the following are given */
    double rotation, center[2];        /* deg */
    double size[2];                    /* pixels */
    double max_memory;
    int threads, quiet;
};

/* Where a list places an exposure, see stack_place. */
struct stack_shift {
    double dx, dy;                     /* pixels of the frame */
    double rotation, scale;            /* deg; pixel of the exposure over that of the frame */
};

/* One exposure. */
struct shot {
    struct fits_in *in, *maps[STACK_MAPS];
    int map_index[STACK_MAPS];
    size_t file;                       /* of choice.files */
    struct exposure x;
    char label[400];
    uint64_t key;                      /* of the content */
    double area;                       /* output pixel / input pixel */
    double w, factor;                  /* weight and unit factor of drizzle_rows */
    struct sky *sky;                   /* NULL where a list places it and it has no WCS */
    struct stack_shift shift;
    struct drizzle_map map;
    struct drizzle_comb comb;
};

struct stack {
    struct stack_choice choice;
    size_t n;
    struct shot *shot;
    struct fits_in **in;               /* files, then the maps of each kind */
    long nx, ny;                       /* of the output */
    double scale;                      /* of its pixels, arcsec; NaN when unknown */
    struct header hdr;
    struct sky *sky;                   /* of the output, or NULL */
    double total, effective;           /* sum of the exposure times; weighted mean of them, s */
    struct progress bar;
};

/*
 * Open all files and read the headers; the exposures come out in the order of
 * EXPNUM, and of their content where that does not tell them apart: never by
 * name or place.  With a list of shifts a WCS is not needed.
 */
MUST_CHECK int stack_read(struct stack *s, struct err *e);

/* choice.files and choice.maps in the order of their first exposures. */
MUST_CHECK int stack_sort_names(struct stack *s);

/*
 * The displacement of every exposure from the table choice.shifts: columns DX
 * and DY, optionally ROT and SCALE.  Pixel p of the exposure, with its middle at
 * c, lies at c + SCALE R(ROT) (p - c) + (DX, DY) in the frame, both counted
 * from 1; R turns x towards y.  Rows are told apart by a column FILE (the name
 * as in messages, or its last part) or EXPNUM, else they come in the order of the files.
 */
MUST_CHECK int stack_shifts(struct stack *s, struct err *e);

/*
 * The output grid and the maps to it: the grid of `like`, a chosen one, or that
 * of the first exposure (of the frame, with shifts), finer by the ratio of the
 * scales and grown by whole pixels until it holds every drop.
 */
MUST_CHECK int stack_place(struct stack *s, struct err *e);

/* Weights and unit factors; E_DATA when the exposures are not in one photometric system. */
MUST_CHECK int stack_units(struct stack *s, struct err *e);

/* The keywords of the output; record becomes HISTORY. */
MUST_CHECK int stack_describe(struct stack *s, const char *record, struct err *e);

/* Unit of the weights: EXPTIME, MAP, IVM or NUMBER. */
const char *stack_weight_type(const struct stack *s);

/* All sums, and the file. */
MUST_CHECK int stack_write(struct stack *s, const char *out, struct err *e);

/* Frees everything but what `choice` points to; the names of choice are freed. */
void stack_free(struct stack *s);

extern const char *const stack_map_name[STACK_MAPS];       /* weight, var, mask */
extern const char *const stack_kernel_name[];

#endif
