/*
 * noise.h - from expected electrons to a detector's reading.
 *
 * A pixel with S expected source electrons becomes
 *
 *   v = min(K + r z, saturate) / gain - subtracted,   K ~ Poisson(qe S + sky + dark),
 *
 * K the inverse of the distribution at one uniform per pixel (poisson.h) and z
 * standard normal; each effect is computed only when asked for.  Numbers are
 * keyed by (seed, exposure, pixel): tiles, order and threads change nothing.
 */
#ifndef PIXSHEAR_NOISE_H
#define PIXSHEAR_NOISE_H

#include "err.h"
#include "rng.h"
#include <stdint.h>

struct noise {
    double qe;           /* factor on the source, > 0; 1 for none */
    double sky;          /* added mean of the sky, electron/pixel, >= 0 */
    double dark;         /* added mean of the dark current, electron/pixel, >= 0 */
    double read_noise;   /* electron rms, >= 0; 0 for none */
    double saturate;     /* electrons a pixel can show, > 0; INFINITY for no limit */
    double gain;         /* electron per output unit, > 0 */
    double subtract;     /* electrons taken off afterwards (mean of sky and dark), or 0 */
    int mirror;          /* 1 - u in place of every uniform number u: the opposite noise */
};

/* Pixels that were not ordinary. */
struct noise_counts {
    long blank;          /* NaN in, NaN out */
    long negative;       /* mean below 0, drawn as 0 */
    long large;          /* mean above 2^24: float32 no longer holds every whole number */
    long saturated;      /* cut at `saturate` */
    long refused;        /* mean above 1e15 or infinite: NaN */
};

/*
 * Draw n pixels in place; pixel i of the exposure's image has item first + i.
 * `exposure` separates exposures of one seed.  *counts is added to.  E_RANGE
 * for parameters outside the ranges above.
 */
MUST_CHECK int noise_add(const struct noise *m, uint64_t seed, uint32_t exposure, uint64_t first,
                         long n, int threads, float *pix, struct noise_counts *counts);

/*
 * The sky, electron/s/arcsec^2, against which a source of `rate` electron/s
 * reaches signal-to-noise `snr` in an area A (arcsec^2) and t seconds, sky
 * noise alone: snr = rate t / sqrt(A B t), so B = rate^2 t / (snr^2 A).
 */
double noise_depth_sky(double rate, double time, double area, double snr);

/*
 * Effective area of a matched filter, 1 / integral of P^2, arcsec^2, for
 * n samples of P on a grid of `scale` arcsec: scale^2 (sum p)^2 / sum p^2.
 */
double noise_psf_area(long n, const float *p, double scale);

#endif
