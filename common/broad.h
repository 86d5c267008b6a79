/*
 * broad.h - pixels of an image from few frequencies: for objects too large for a stamp of their own.
 *
 *   out[y][x] = sum_kx,ky F[ky][kx] exp(2 pi i step (kx x + ky y)),   F[-ky][-kx] = conj F[ky][kx],
 *
 * summed as it stands, along x and then along y.  An object n times larger has n times fewer frequencies in a
 * period: period times bandwidth, the frequencies per axis, stays.  Any period and any part of it serve.
 */
#ifndef PIXSHEAR_BROAD_H
#define PIXSHEAR_BROAD_H

#include <stddef.h>

#define BROAD_ROWS 16      /* pairs of rows +-ky that are added together */

struct broad {
    double step;           /* pixel over period */
    int nx, ny;
    double *out;           /* ny x nx */
    int ld;                /* columns kept of a row, at most */
    int rows, ky[BROAD_ROWS], m[BROAD_ROWS];
    double *mem;
};

/* Doubles of scratch for rows of at most ld columns. */
size_t broad_scratch(int ld);

/* Zeros; out and scratch are the caller's. */
void broad_begin(struct broad *b, double step, int nx, int ny, double *out, int ld, double *scratch);

/* Columns 0..m-1 of row ky >= 0 (p) and of row -ky (m; not read when ky is 0). */
void broad_take(struct broad *b, int ky, int m, const double *p_re, const double *p_im, const double *m_re, const double *m_im);

/* All rows taken are in out. */
void broad_end(struct broad *b);

#endif
