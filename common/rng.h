/*
 * rng.h - counter-based random numbers, Philox4x32-10 (Salmon et al. 2011,
 * "Parallel random numbers: as easy as 1, 2, 3", SC11).
 *
 * A stream is named by (seed, purpose) and a draw by (item, index).  Nothing
 * is sequential: pixel 17 of exposure 3 gets the same number whatever was
 * drawn before, in whichever thread, tile or order.
 */
#ifndef PIXSHEAR_RNG_H
#define PIXSHEAR_RNG_H

#include <stdint.h>

/* What the numbers are for; keeps streams of one seed apart. Never renumber. */
enum rng_purpose {
    RNG_SHOT = 1,        /* photon noise, item = pixel, one uniform each */
    RNG_READ = 2,        /* read noise, item = pixel */
    RNG_GALAXY = 3,      /* galgen: item = galaxy, index = draw */
    RNG_STAR = 4,        /* galgen --stars: item = star */
    RNG_LIBRARY = 5,     /* galgen --library: item = galaxy */
    RNG_BOOTSTRAP = 6,   /* fom: item = resampling, index = draw */
    RNG_DITHER = 7,      /* random dither offsets */
    RNG_TEST = 99
};

struct rng {
    uint32_t key[2];
    uint32_t purpose;
};

/*
 * The stream of (seed, field, purpose).  `field` separates exposures or fields
 * of one seed (addnoise: EXPNUM; 0 otherwise).  The 64-bit seed and the field
 * are mixed into the key, so neighbouring seeds are unrelated.
 */
struct rng rng_stream(uint64_t seed, uint32_t field, enum rng_purpose purpose);

/* The four 32-bit words of one Philox4x32-10 block. */
void rng_philox(const uint32_t counter[4], const uint32_t key[2], uint32_t out[4]);

/* 64 random bits for (item, index); index < 2^31. */
uint64_t rng_bits(const struct rng *r, uint64_t item, uint32_t index);

/* Uniform in the open interval (0,1): (k + 1/2) 2^-52, k of 52 bits; exact. */
double rng_uniform(const struct rng *r, uint64_t item, uint32_t index);

/*
 * u[i] = rng_uniform(r, item + i, index) for 0 <= i < n, same bits, several
 * times faster (vectorised).
 */
void rng_uniform_run(const struct rng *r, uint64_t item, uint32_t index, long n, double *u);

/* Standard normal by inversion of one uniform (Wichura 1988, AS 241, ~1e-16). */
double rng_normal(const struct rng *r, uint64_t item, uint32_t index);

/* Inverse of the standard normal distribution, p in (0,1); AS 241. */
double rng_normal_inverse(double p);

#endif
