/*
 * decimal.h - doubles and decimals, exactly, in whole numbers of 128 bits.
 *
 * A double is m 2^q with m < 2^53, and 10^p = 5^p 2^p with 5^27 < 2^64: products and
 * quotients by such powers are exact, with a remainder that decides every rounding.
 * Where that does not reach (or the compiler has no such type) E_RANGE says so, and the
 * C library must do it.
 */
#ifndef PIXSHEAR_DECIMAL_H
#define PIXSHEAR_DECIMAL_H

#include "err.h"
#include <stdint.h>

/* n 10^(e + 1 - digits): n has `digits` digits and its first one stands for 10^e. */
struct decimal {
    uint64_t n;
    int digits, e;
};

/*
 * The nearest decimal of 15 digits to a that reads back as a, else of 16, else of
 * 17: what %.15g, %.16g or %.17g print.  1e-10 <= a < 1e15, else E_RANGE.
 */
MUST_CHECK int decimal_of(double a, struct decimal *d);

/* *v = m 10^e, correctly rounded; -27 <= e <= 19, else E_RANGE. */
MUST_CHECK int decimal_value(uint64_t m, long e, double *v);

#endif
