/*
 * lanes.h - image of n x n pixels from its half plane of frequencies, eight
 * columns and then eight rows at a time, one to a lane of the processor's vectors.
 *
 *   out[y][x] = sum F[v][u] exp(2 pi i (u x + v y) / n),   F[-v][-u] = conj F[v][u].
 *
 * Two to four times faster than FFTW for the sides of stamps; columns that hold nothing cost
 * nothing.  Same bits for every vector width.
 */
#ifndef PIXSHEAR_LANES_H
#define PIXSHEAR_LANES_H

#include "err.h"
#include <stddef.h>

struct lanes;              /* read-only once made: serves all threads */

/* n even, 2..8192; prime factors beyond 5 are right but slow. E_RANGE, E_NOMEM. */
MUST_CHECK int lanes_new(struct lanes **p, int n);

/* The same for images of `rows` rows of n pixels: v y / rows takes the place of v y / n. rows >= 2. */
MUST_CHECK int lanes_new_rows(struct lanes **p, int n, int rows);
void lanes_free(struct lanes *p);

/* Doubles of scratch that lanes_run needs, or twice as many floats for lanes_run_single. */
size_t lanes_scratch(const struct lanes *p);

/*
 * re, im: n rows of ld doubles, ld >= n/2 + 1 and a multiple of 8, columns 0..m-1 filled (those up
 * to the next multiple of 8 are read but their values do not matter); destroyed.  Columns from m on are
 * zero and are not read.  Imaginary parts that symmetry makes 0 are ignored.  out: n x n (rows x n).
 */
void lanes_run(const struct lanes *p, int m, double *re, double *im, int ld, double *scratch, double *out);

/* The same in single precision, sixteen at a time: ld a multiple of 16, of plans from lanes_new. Errors of 1e-7 of the rms sum. */
void lanes_run_single(const struct lanes *p, int m, float *re, float *im, int ld, float *scratch, float *out);

/*
 * Its two passes in shares, which threads may do side by side: all columns before any row.  Transforms columns
 * k .. k + 7 (k a multiple of 8, k < m) in place, or makes rows y .. y + 7 (those that there are), `stride` doubles apart; out, which
 * gets row y, may be re + y ld when im lies within its rows: each row of the image takes the place of its frequencies.
 */
void lanes_columns(const struct lanes *p, int k, double *re, double *im, int ld, double *scratch);
void lanes_rows(const struct lanes *p, int y, int m, const double *re, const double *im, int ld, double *scratch, double *out, size_t stride);

#endif
