/*
 * single.h - frequencies of one object in single precision: its transform, times the transfer function, with all bands
 * beyond the pixel grid's own added onto it, sixteen columns at a time.
 */
#ifndef PIXSHEAR_SINGLE_H
#define PIXSHEAR_SINGLE_H

#include <stddef.h>

#define SINGLE_LANES 16

/* What the rows of one object share. Rows of memory are multiples of SINGLE_LANES long. */
struct single {
    int n, nmax, ld;       /* pixels per side; order; columns of the transform */
    float *ve, *vo;        /* (nmax + 1) x ld: sums over even and odd n1, for each n2 */
    float *c, *s;          /* ld: phases along x */
    float *line;           /* 4 x (ld + SINGLE_LANES): scratch, each row with zeros behind it */
    float *re, *im;        /* the half plane: n rows */
    int width;             /* of so many columns, at least n/2 + 1 */
};

/* Floats that a single of these sides needs. */
size_t single_floats(int n, int nmax, int columns);

/* Lay it out in so many floats, aligned to 64 bytes, and clear the half plane. */
void single_begin(struct single *q, int n, int nmax, int columns, float *mem);

/* Take `columns` values of each of the rows; columns from there on become 0. */
void single_take(int rows, int columns, size_t from_ld, const double *from, size_t ld, float *to);

/* One row of the transfer function, in at least as many doubles as columns, rounded up to SINGLE_LANES; im may be NULL. */
struct single_transfer {
    const double *re, *im;
};

/* Add rows +-ky >= 0, columns 0..m-1: f holds phi_n2(ky), turn the scale and phase of +ky, up and down the transfer function. */
void single_row(const struct single *q, int ky, int m, const float *f, const double turn[2], const struct single_transfer *up,
                const struct single_transfer *down);

/* The sum of n numbers, in double. */
double single_sum(size_t n, const float *p);

#endif
