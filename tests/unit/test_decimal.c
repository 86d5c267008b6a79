/* test_decimal.c - doubles and decimals against the C library, digit for digit. */
#include "check.h"
#include "decimal.h"
#include "rng.h"
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* %.15g, %.16g or %.17g, the first that reads back: digits and exponent. */
static void library(double a, struct decimal *d)
{
    char s[40];
    for (int digits = 15; digits <= 17; digits++) {
        snprintf(s, sizeof s, "%.*e", digits - 1, a);
        if (digits < 17 && strtod(s, NULL) != a)
            continue;
        char only[24] = {s[0]};
        memcpy(only + 1, s + 2, (size_t)digits - 1);
        *d = (struct decimal){strtoull(only, NULL, 10), digits, (int)strtol(strchr(s, 'e') + 1, NULL, 10)};
        return;
    }
}

static long wrong_digits(double a)
{
    struct decimal ours = {0}, theirs = {0};
    library(a, &theirs);
    if (decimal_of(a, &ours) == OK && ours.n == theirs.n && ours.digits == theirs.digits && ours.e == theirs.e)
        return 0;
    printf("# %.17g: %llu of %d digits, not %llu of %d\n", a, (unsigned long long)ours.n, ours.digits,
           (unsigned long long)theirs.n, theirs.digits);
    return 1;
}

static void to_decimals(void)
{
    struct rng r = rng_stream(61, 0, RNG_TEST);
    long wrong = 0;
    for (uint32_t i = 0; i < 300000; i++)
        wrong += wrong_digits(exp(log(1e-10) + (log(9.99e14) - log(1e-10)) * rng_uniform(&r, i, 0)));
    check_that(wrong == 0, "300000 doubles from 1e-10 to 1e15: digits of the C library");
    wrong = 0;
    for (uint32_t i = 0; i < 100000; i++)            /* few digits: 15 suffice */
        wrong += wrong_digits(floor(1e6 * rng_uniform(&r, i, 1) + 1) / pow(10, floor(10 * rng_uniform(&r, i, 2))));
    check_that(wrong == 0, "100000 decimals of few digits");
    wrong = 0;
    for (int q = -33; q < 50; q++)                   /* where the distance of doubles changes */
        for (int k = -3; k <= 3; k++) {
            double a = ldexp(1, q);
            for (int j = 0; j < abs(k); j++)
                a = nextafter(a, k < 0 ? 0 : INFINITY);
            wrong += wrong_digits(a);
        }
    for (int e = -10; e < 15; e++)
        for (int k = -3; k <= 3; k++) {
            double a = strtod((char[]){'1', 'e', e < 0 ? '-' : '+', (char)('0' + abs(e) / 10), (char)('0' + abs(e) % 10), 0}, NULL);
            for (int j = 0; j < abs(k); j++)
                a = nextafter(a, k < 0 ? 0 : INFINITY);
            if (a >= 1e-10 && a < 1e15)
                wrong += wrong_digits(a);
        }
    check_that(wrong == 0, "neighbours of powers of 2 and of 10");
    wrong = 0;
    for (int k = 3; k <= 17; k++)                    /* 18 digits, the last a 5: exactly between two decimals of 17 */
        for (uint32_t i = 0; i < 2000; i++) {
            double top = fmin(pow(10, 18 - k), ldexp(1, 52 - k));
            double a = floor(top * (0.1 + 0.9 * rng_uniform(&r, i, (uint32_t)(2 + k)))) + ldexp(2 * (double)(i % 4) + 1, -k);
            if (a < 1e15)
                wrong += wrong_digits(a);
        }
    check_that(wrong == 0, "30000 exact ties of 17 digits: rounded to even");
    struct decimal d;
    check_that(decimal_of(9.999e-11, &d) == E_RANGE && decimal_of(1e15, &d) == E_RANGE && decimal_of((double)NAN, &d) == E_RANGE &&
               decimal_of(-1, &d) == E_RANGE, "outside the range: E_RANGE");
}

static long wrong_value(uint64_t m, long e)
{
    char s[64];
    double v = 0;
    snprintf(s, sizeof s, "%llue%ld", (unsigned long long)m, e);
    double want = strtod(s, NULL);
    if (decimal_value(m, e, &v) == OK && v == want)
        return 0;
    printf("# %s: %.17g, not %.17g\n", s, v, want);
    return 1;
}

static void to_doubles(void)
{
    struct rng r = rng_stream(62, 0, RNG_TEST);
    long wrong = 0;
    for (uint32_t i = 0; i < 300000; i++) {
        uint64_t m = rng_bits(&r, i, 0) >> (rng_bits(&r, i, 1) % 64);
        wrong += wrong_value(m, (long)(rng_bits(&r, i, 2) % 47) - 27);
    }
    check_that(wrong == 0, "300000 whole numbers times 10^-27 to 10^19: values of the C library");
    wrong = 0;
    for (uint32_t i = 0; i < 100000; i++) {          /* between two doubles: 17 digits of a double with one more bit, exact */
        uint64_t odd = 2 * ((UINT64_C(1) << 52) + (rng_bits(&r, i, 3) >> 12)) + 1;
        wrong += wrong_value(odd, 0);
        wrong += wrong_value(odd * 5, -1) + wrong_value(odd * 25, -2) + wrong_value(odd * 125, -3);
        wrong += wrong_value(odd * 125 + 1, -3) + wrong_value(odd * 125 - 1, -3);
    }
    check_that(wrong == 0, "600000 decimals on and next to the middle of two doubles");
    double v;
    check_that(decimal_value(1, -28, &v) == E_RANGE && decimal_value(1, 20, &v) == E_RANGE, "outside the range: E_RANGE");
    check_that(decimal_value(0, -5, &v) == OK && v == 0 && decimal_value(0, 5, &v) == OK && v == 0, "zero");
}

int main(void)
{
#ifdef __SIZEOF_INT128__
    to_decimals();
    to_doubles();
#else
    check_skip("no whole numbers of 128 bits: the C library converts");
#endif
    return check_status();
}
