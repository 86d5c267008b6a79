/*
 * fft.h - the only file that knows which FFT library we link (FFTW, double,
 * FFTW_ESTIMATE, so that plans and bits are the same in every run).
 * Planning is serialised inside; execution is thread-safe.
 */
#ifndef PIXSHEAR_FFT_H
#define PIXSHEAR_FFT_H

#include "err.h"
#include <stddef.h>

struct fft;      /* a plan for one size and direction, reusable by all threads */

/* Memory aligned for the transforms; free with fft_free. NULL when there is none. */
void *fft_alloc(size_t bytes);
void fft_free(void *p);

/* ny x (nx/2+1) complex (interleaved re, im) -> ny x nx real, unnormalised, exp(+i). Input is destroyed. */
MUST_CHECK int fft_plan_c2r(struct fft **f, int ny, int nx);
/* ny x nx real -> ny x (nx/2+1) complex, exp(-i). */
MUST_CHECK int fft_plan_r2c(struct fft **f, int ny, int nx);
/* ny x nx complex in place, sign -1 or +1. */
MUST_CHECK int fft_plan_c2c(struct fft **f, int ny, int nx, int sign);
/* Same plan on other (fft_alloc'ed) arrays; in == out only for c2c. */
void fft_run(const struct fft *f, double *in, double *out);
void fft_done(struct fft *f);

/*
 * Zoom transform between two regular grids of any spacing and origin:
 *   out[ky][kx] = sum in[jy][jx] exp(sign 2 pi i (ax (jx+from.x0)(kx+to.x0) + ay (jy+from.y0)(ky+to.y0))),
 * complex interleaved, from->ny x from->nx values to to->ny x to->nx, rows first.
 * ax, ay = spacing of one grid times spacing of the other.  Exact as a sum; rounding
 * stays below 1e-14 of sum |in| for grids of a few thousand (tests/unit/test_fft.c).
 */
struct fft_grid {
    int nx, ny;
    double x0, y0;         /* coordinate of element (0,0) in steps of the grid */
};
MUST_CHECK int fft_zoom(const struct fft_grid *from, const double *in, const struct fft_grid *to,
                        double *out, double ax, double ay, int sign);

/* Smallest n' >= n with only factors 2, 3, 5, even. */
int fft_good_size(int n);

#endif
