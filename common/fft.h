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

/* Smallest n' >= n with only factors 2, 3, 5, even. */
int fft_good_size(int n);

#endif
