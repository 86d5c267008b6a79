/* decimal.c - doubles and decimals, exactly, in whole numbers of 128 bits. */
#include "decimal.h"
#include <math.h>
#include <string.h>

#ifdef __SIZEOF_INT128__

__extension__ typedef unsigned __int128 wide;

#define P5(n) UINT64_C(n)
static const uint64_t five_to[28] = {
    P5(1), P5(5), P5(25), P5(125), P5(625), P5(3125), P5(15625), P5(78125), P5(390625), P5(1953125), P5(9765625), P5(48828125),
    P5(244140625), P5(1220703125), P5(6103515625), P5(30517578125), P5(152587890625), P5(762939453125), P5(3814697265625),
    P5(19073486328125), P5(95367431640625), P5(476837158203125), P5(2384185791015625), P5(11920928955078125),
    P5(59604644775390625), P5(298023223876953125), P5(1490116119384765625), P5(7450580596923828125)};
#undef P5

static const uint64_t ten_to[20] = {
    1, 10, 100, 1000, 10000, 100000, 1000000, 10000000, 100000000, 1000000000, 10000000000, 100000000000, 1000000000000,
    10000000000000, 100000000000000, 1000000000000000, 10000000000000000, 100000000000000000, 1000000000000000000,
    UINT64_C(10000000000000000000)};

/* a = m 2^q, and a 10^p = (m 5^p) / 2^s. */
struct scaled {
    uint64_t m;
    int p, s;
    wide product;             /* m 5^p */
};

/* a = m 2^(q - 53), m of 53 bits, so that 2^(q - 1) <= a < 2^q; a normal. */
static int split(double a, uint64_t *m)
{
    uint64_t bits;
    memcpy(&bits, &a, sizeof bits);
    *m = (bits & ((UINT64_C(1) << 52) - 1)) | UINT64_C(1) << 52;
    return (int)(bits >> 52) - 1022;
}

/* 17 digits before the point, the rest behind it: the whole part, or 0 where the range ends. */
static uint64_t scale(double a, int e, struct scaled *x)
{
    const int q = split(a, &x->m);
    x->p = 16 - e;
    x->s = 53 - q - x->p;
    if (x->p < 0 || x->p > 27 || x->s < 1 || x->s > 100)
        return 0;
    x->product = (wide)x->m * five_to[x->p];
    return (uint64_t)(x->product >> x->s);
}

/* The whole part n without its last digits (divided by cut), rounded to the nearest, ties to even. */
static uint64_t shorten(const struct scaled *x, uint64_t n, uint64_t cut)
{
    const wide rest = x->product - ((wide)n << x->s), half = (wide)1 << (x->s - 1);
    uint64_t k = n / cut;
    const uint64_t left = n % cut;
    int up, tie;
    if (cut == 1) {
        up = rest > half;
        tie = rest == half;
    } else {
        up = left > cut / 2 || (left == cut / 2 && rest > 0);
        tie = left == cut / 2 && rest == 0;
    }
    k += (uint64_t)(up || (tie && (k & 1)));
    return k;
}

/* Does n 10^-p, rounded to the nearest double (ties to even), give m again? */
static int reads_back(const struct scaled *x, uint64_t n)
{
    const wide there = (wide)n << x->s;
    const int below = there < x->product;
    const wide gap = below ? x->product - there : there - x->product;
    /* half the distance to the next double in units of the product, times 2 (times 4: below a power of two) */
    const wide twice = gap * (below && x->m == UINT64_C(1) << 52 ? 4 : 2);
    return twice < five_to[x->p] || (twice == five_to[x->p] && (x->m & 1) == 0);
}

int decimal_of(double a, struct decimal *d)
{
    struct scaled x;
    if (!(a >= 1e-10 && a < 1e15))
        return E_RANGE;
    int e = (int)floor(0.30102999566398120 * (split(a, &x.m) - 1));     /* of the power of two below a: right or 1 too low */
    uint64_t n = scale(a, e, &x);
    if (n >= ten_to[17])
        n = scale(a, ++e, &x);
    if (n < ten_to[16] || n >= ten_to[17])
        return E_RANGE;
    for (int digits = 15; digits <= 17; digits++) {
        const uint64_t cut = ten_to[17 - digits], k = shorten(&x, n, cut);
        if (digits < 17 && !reads_back(&x, k * cut))
            continue;
        const int carry = k == ten_to[digits];
        *d = (struct decimal){carry ? k / 10 : k, digits, e + carry};
        break;
    }
    return OK;
}

int decimal_value(uint64_t m, long e, double *v)
{
    if (e < -27 || e > 19)
        return E_RANGE;
    if (e >= 0 || m == 0) {
        *v = (double)((wide)m * (m ? ten_to[e] : 0));
        return OK;
    }
    const uint64_t by = five_to[-e];
    const int shift = __builtin_clzll(m) + 64;
    const wide top = (wide)m << shift;
    wide quotient = top / by;                     /* at least 64 bits: by < 2^63 */
    quotient |= top % by != 0;                    /* a remainder is more than no remainder: no tie */
    *v = ldexp((double)quotient, (int)e - shift);
    return OK;
}

#else

int decimal_of(double a, struct decimal *d)
{
    (void)a;
    (void)d;
    return E_RANGE;
}

int decimal_value(uint64_t m, long e, double *v)
{
    (void)m;
    (void)e;
    (void)v;
    return E_RANGE;
}

#endif
