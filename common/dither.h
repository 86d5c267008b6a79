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

/*
 * Between small pixels the image is taken as band-limited: H at n + f is the
 * sum of H[n + k] sinc(k - f) under a Kaiser window (beta 12) of DITHER_REACH small
 * pixels to either side, normalised to sum 1.  Frequencies up to 0.44 cycles
 * per small pixel pass to 2e-6, slow ones and sums to rounding.
 */
enum { DITHER_REACH = 32 };

/* Weights along one axis of the small pixels first .. first + n - 1, counted from the cell's first one. */
struct dither_axis {
    int first, n;
    double w[DITHER_MAX + 2 * DITHER_REACH];
};

/* Sum of `factor` small pixels moved by `fraction`, 0 <= fraction < 1; 0 gives ones. */
void dither_sum(int factor, double fraction, struct dither_axis *a);

/*
 * The same sum of the upper quarter of the band.  What the sampling has folded
 * into the band is moved wrongly, and is no larger than that where spectra fall.
 */
void dither_rest(int factor, struct dither_axis *a);

/* Element i of n, mirrored at both ends. */
long dither_mirror(long i, long n);

/* out[i] = scale sum_t a->w[t] line[factor i + from + a->first + t], i < side, mirrored in the line of nx; padded has nx + 4 DITHER_REACH + DITHER_MAX doubles. */
void dither_cells(const struct dither_axis *a, int factor, long from, long nx, long side, const double *line, double scale,
                  double *padded, double *out);

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
