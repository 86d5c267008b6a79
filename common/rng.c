/*
 * rng.c - Philox4x32-10 and what is made of it.
 *
 * Counter words: block (64 bits), index, purpose.  One block serves two
 * neighbouring items: the even item takes words 0 and 1, the odd one 2 and 3.
 */
#include "rng.h"
#include "simd.h"
#include <math.h>
#include <stddef.h>

#define ROUND_A 0xD2511F53u
#define ROUND_B 0xCD9E8D57u
#define WEYL_A 0x9E3779B9u
#define WEYL_B 0xBB67AE85u

/* Finaliser of splitmix64 (Steele et al. 2014): a bijection that mixes all bits. */
static uint64_t mix(uint64_t z)
{
    z += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

struct rng rng_stream(uint64_t seed, uint32_t field, enum rng_purpose purpose)
{
    uint64_t k = mix(mix(seed) ^ field);
    return (struct rng){{(uint32_t)k, (uint32_t)(k >> 32)}, (uint32_t)purpose};
}

void rng_philox(const uint32_t counter[4], const uint32_t key[2], uint32_t out[4])
{
    uint32_t c0 = counter[0], c1 = counter[1], c2 = counter[2], c3 = counter[3];
    uint32_t k0 = key[0], k1 = key[1];
    for (int r = 0; r < 10; r++) {
        uint64_t a = (uint64_t)ROUND_A * c0, b = (uint64_t)ROUND_B * c2;
        uint32_t n0 = (uint32_t)(b >> 32) ^ c1 ^ k0, n2 = (uint32_t)(a >> 32) ^ c3 ^ k1;
        c1 = (uint32_t)b;
        c3 = (uint32_t)a;
        c0 = n0;
        c2 = n2;
        k0 += WEYL_A;
        k1 += WEYL_B;
    }
    out[0] = c0;
    out[1] = c1;
    out[2] = c2;
    out[3] = c3;
}

uint64_t rng_bits(const struct rng *r, uint64_t item, uint32_t index)
{
    const uint64_t block = item >> 1;
    const uint32_t c[4] = {(uint32_t)block, (uint32_t)(block >> 32), index, r->purpose};
    uint32_t w[4];
    rng_philox(c, r->key, w);
    return item & 1 ? (uint64_t)w[2] << 32 | w[3] : (uint64_t)w[0] << 32 | w[1];
}

/* 52 bits of two words as (k + 1/2) 2^-52; every step is exact. */
static inline double unit(uint32_t hi, uint32_t lo)
{
    return ((double)(int32_t)(hi >> 6) * 0x1p26 + (double)(int32_t)(lo >> 6) + 0.5) * 0x1p-52;
}

double rng_uniform(const struct rng *r, uint64_t item, uint32_t index)
{
    uint64_t b = rng_bits(r, item, index);
    return unit((uint32_t)(b >> 32), (uint32_t)b);
}

enum { LANES = 64 };

/* Uniforms of 2*LANES items that start at an even one. */
WIDE static void uniform_lanes(const struct rng *r, uint64_t block, uint32_t index, double *restrict u)
{
    uint32_t c0[LANES], c1[LANES], c2[LANES], c3[LANES];
    for (int i = 0; i < LANES; i++) {
        uint64_t b = block + (uint64_t)i;
        c0[i] = (uint32_t)b;
        c1[i] = (uint32_t)(b >> 32);
        c2[i] = index;
        c3[i] = r->purpose;
    }
    uint32_t k0 = r->key[0], k1 = r->key[1];
    for (int round = 0; round < 10; round++) {
        for (int i = 0; i < LANES; i++) {
            uint64_t a = (uint64_t)ROUND_A * c0[i], b = (uint64_t)ROUND_B * c2[i];
            uint32_t n0 = (uint32_t)(b >> 32) ^ c1[i] ^ k0, n2 = (uint32_t)(a >> 32) ^ c3[i] ^ k1;
            c1[i] = (uint32_t)b;
            c3[i] = (uint32_t)a;
            c0[i] = n0;
            c2[i] = n2;
        }
        k0 += WEYL_A;
        k1 += WEYL_B;
    }
    for (int i = 0; i < LANES; i++) {
        u[2 * i] = unit(c0[i], c1[i]);
        u[2 * i + 1] = unit(c2[i], c3[i]);
    }
}

void rng_uniform_run(const struct rng *r, uint64_t item, uint32_t index, long n, double *u)
{
    double lanes[2 * LANES];
    for (long i = 0; i < n;) {
        uint64_t at = item + (uint64_t)i;
        size_t skip = at & 1;
        long left = n - i, here = 2 * LANES - (long)skip;
        uniform_lanes(r, at >> 1, index, lanes);
        if (here > left)
            here = left;
        for (long k = 0; k < here; k++)
            u[i + k] = lanes[skip + (size_t)k];
        i += here;
    }
}

static double ratio(const double *num, const double *den, double x)
{
    double p = num[7], q = den[7];
    for (int i = 6; i >= 0; i--) {
        p = p * x + num[i];
        q = q * x + den[i];
    }
    return p / q;
}

double rng_normal_inverse(double p)
{
    static const double a[8] = {3.3871328727963666080e0, 1.3314166789178437745e+2,
        1.9715909503065514427e+3, 1.3731693765509461125e+4, 4.5921953931549871457e+4,
        6.7265770927008700853e+4, 3.3430575583588128105e+4, 2.5090809287301226727e+3};
    static const double b[8] = {1, 4.2313330701600911252e+1, 6.8718700749205790830e+2,
        5.3941960214247511077e+3, 2.1213794301586595867e+4, 3.9307895800092710610e+4,
        2.8729085735721942674e+4, 5.2264952788528545610e+3};
    static const double c[8] = {1.42343711074968357734e0, 4.63033784615654529590e0,
        5.76949722146069140550e0, 3.64784832476320460504e0, 1.27045825245236838258e0,
        2.41780725177450611770e-1, 2.27238449892691845833e-2, 7.74545014278341407640e-4};
    static const double d[8] = {1, 2.05319162663775882187e0, 1.67638483018380384940e0,
        6.89767334985100004550e-1, 1.48103976427480074590e-1, 1.51986665636164571966e-2,
        5.47593808499534494600e-4, 1.05075007164441684324e-9};
    static const double e[8] = {6.65790464350110377720e0, 5.46378491116411436990e0,
        1.78482653991729133580e0, 2.96560571828504891230e-1, 2.65321895265761230930e-2,
        1.24266094738807843860e-3, 2.71155556874348757815e-5, 2.01033439929228813265e-7};
    static const double f[8] = {1, 5.99832206555887937690e-1, 1.36929880922735805310e-1,
        1.48753612908506148525e-2, 7.86869131145613259100e-4, 1.84631831751005468180e-5,
        1.42151175831644588870e-7, 2.04426310338993978564e-15};
    const double q = p - 0.5;
    if (fabs(q) <= 0.425)
        return q * ratio(a, b, 0.180625 - q * q);
    const double r = sqrt(-log(q < 0 ? p : 1 - p));
    const double z = r <= 5 ? ratio(c, d, r - 1.6) : ratio(e, f, r - 5);
    return q < 0 ? -z : z;
}

double rng_normal(const struct rng *r, uint64_t item, uint32_t index)
{
    return rng_normal_inverse(rng_uniform(r, item, index));
}
