/*
 * dither.h - ideally interlaced exposures as exact sums of small pixels.
 *
 * With H[row][col] the integrals over pixels of 1/N the size, exposure (a,b),
 * 0 <= a, b < N, has the pixel grid moved by a/N pixels in x and b/N in y:
 *
 *   D[j][i] = sum_{q<N} sum_{p<N} H[N j + b + q][N i + a + p].
 *
 * All N*N exposures have the same size: floor((n - N + 1)/N) pixels per side.
 */
#ifndef PIXSHEAR_DITHER_H
#define PIXSHEAR_DITHER_H

#include "err.h"

#define DITHER_MAX 64

/* Side of every exposure for n small pixels; 0 when there are too few. */
long dither_side(long n, int factor);

/*
 * Phase (a,b) of exposure e = 0..N*N-1: rows of phases bottom to top, walked
 * to and fro, so that each step moves by one small pixel.  For N = 2 these are
 * the paper's offsets (0,0) (.5,0) (.5,.5) (0,.5).
 */
void dither_phase(int e, int factor, int *a, int *b);

/*
 * One row of an exposure: h are `factor` consecutive rows of nx small pixels,
 * out gets `side` sums, from small pixel a on, multiplied by `scale`, formed in
 * double; work has nx doubles; a + side * factor <= nx.
 */
void dither_row(int factor, long a, long nx, long side, const float *h, double scale, double *work, float *out);

#endif
