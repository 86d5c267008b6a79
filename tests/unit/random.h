/* random.h - numbers for tests: a fixed sequence, good enough to hit what nobody thought of. */
#ifndef PIXSHEAR_TEST_RANDOM_H
#define PIXSHEAR_TEST_RANDOM_H

#include <math.h>
#include <stddef.h>

/* 0 <= u < 1. */
__attribute__((unused))
static double uniform(unsigned long *state)
{
    *state = *state * 6364136223846793005ul + 1442695040888963407ul;
    return (double)(*state >> 11) * 0x1p-53;
}

/* -1 <= u < 1. */
__attribute__((unused))
static double noise(void)
{
    static unsigned long state = 88172645463325252ul;
    return 2 * uniform(&state) - 1;
}

/* n numbers whose squares add up to 1. */
__attribute__((unused))
static void random_unit(size_t n, unsigned long seed, double *c)
{
    double norm = 0;
    for (size_t i = 0; i < n; i++) {
        c[i] = 2 * uniform(&seed) - 1;
        norm += c[i] * c[i];
    }
    for (size_t i = 0; i < n; i++)
        c[i] /= sqrt(norm);
}

#endif
