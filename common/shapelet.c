/*
 * shapelet.c - Cartesian shapelets: basis functions, pixel integrals, moments,
 * rotation (Refregier 2003; Massey & Refregier 2005).
 *
 * Values come from phi_{n+1} = sqrt(2/(n+1)) x phi_n - sqrt(n/(n+1)) phi_{n-1}, stable
 * upwards everywhere.  The seed is exp(-x^2/4) and every result is multiplied by it
 * again, so that nothing underflows before |x| = 53, where phi_n < 1e-308.
 * Loops run over blocks of points with n outside, so that the points vectorise.
 */
#include "shapelet.h"
#include "simd.h"
#include <math.h>
#include <stdint.h>
#include <string.h>

#define BLOCK 64               /* points worked on together */
#define FAR 53.2               /* |x|/beta beyond which everything is 0: phi_340(53.2) = 1e-338 */
#define STRIP 32               /* columns of a stamp summed together */
#define SMALL_PIXEL 0.1        /* pixel / beta below which the paired recurrence is used */

static const double PI_M14 = 0.75112554446494248286;   /* pi^(-1/4) */
static const double PI_P14 = 1.33133536380038971280;   /* pi^(1/4) */

size_t shapelet_count(int nmax)
{
    return nmax < 0 ? 0 : (size_t)(nmax + 1) * (size_t)(nmax + 2) / 2;
}

size_t shapelet_index(int n1, int n2)
{
    size_t n = (size_t)n1 + (size_t)n2;
    return n * (n + 1) / 2 + (size_t)n1;
}

static int domain(int nmax, double beta, int m)
{
    return nmax >= 0 && nmax <= SHAPELET_NMAX && m >= 0 && beta > 0 && isfinite(beta) ? OK : E_RANGE;
}

/*
 * exp(-z), 0 <= z <= 708, without calls and branches so that it vectorises.  The argument
 * is reduced by k ln 2 in two parts, |r| <= 0.35, Taylor to r^13 (remainder 4e-18).
 */
static inline double exp_minus(double z)
{
    static const double c[] = {1.0 / 6227020800, 1.0 / 479001600, 1.0 / 39916800, 1.0 / 3628800, 1.0 / 362880, 1.0 / 40320,
                               1.0 / 5040, 1.0 / 720, 1.0 / 120, 1.0 / 24, 1.0 / 6, 0.5};
    const double shift = 0x1.8p52;
    const double k = z * -1.4426950408889634 + shift;     /* nearest whole number in the low bits */
    const double whole = k - shift;
    const double r = (-z - whole * 0x1.62e42feep-1) - whole * 0x1.a39ef35793c76p-33;
    double p = c[0];
    for (int i = 1; i < 12; i++)
        p = c[i] + r * p;
    int64_t bits;
    double power;
    memcpy(&bits, &k, sizeof bits);
    bits = (int64_t)((uint64_t)(bits + 1023) << 52);
    memcpy(&power, &bits, sizeof power);
    return power + power * (r + r * r * p);
}

/* exp(-t^2/4), |t| <= FAR, to 3e-16 of itself: t^2 is split into an exact part and a rest. */
static inline double half_gauss(double t)
{
    const double head = (double)(float)t;
    const double q = 0.25 * (t - head) * (t + head);    /* below 6e-5 */
    return exp_minus(0.25 * (head * head)) * (1 - q * (1 - 0.5 * q * (1 - q * (1.0 / 3))));
}

/* sinh(z)/z (odd = 1) or cosh(z) (odd = -1) for |z| < 3: all terms are positive. */
static inline double hyperbolic(double z, int odd)
{
    double p = 1;
    for (int k = 14; k > 0; k--)
        p = 1 + z * z * p * (1.0 / (2 * k * (2 * k + odd)));
    return p;
}

static inline double clamp(double t)
{
    return t > FAR ? FAR : t < -FAR ? -FAR : t;
}

/* Rows of B_n(x[i]; beta), m <= BLOCK points. */
WIDE static void basis_block(int nmax, double beta, int m, const double *x, size_t stride, double *restrict b)
{
    double t[BLOCK], s[BLOCK], before[BLOCK], here[BLOCK];
    const double norm = 1 / sqrt(beta);
    for (int i = 0; i < m; i++)
        t[i] = clamp(x[i] / beta);
    for (int i = 0; i < m; i++) {
        const double e = half_gauss(t[i]);
        s[i] = e * norm;
        before[i] = 0;
        here[i] = PI_M14 * e;
        b[i] = here[i] * s[i];
    }
    for (int n = 0; n < nmax; n++) {
        const double up = sqrt(2.0 / (n + 1)), down = sqrt(n / (n + 1.0));
        double *restrict row = b + (size_t)(n + 1) * stride;
        for (int i = 0; i < m; i++) {
            double next = up * t[i] * here[i] - down * before[i];
            before[i] = here[i];
            here[i] = next;
            row[i] = next * s[i];
        }
    }
}

int shapelet_basis(int nmax, double beta, int m, const double *x, double *b)
{
    if (domain(nmax, beta, m))
        return E_RANGE;
    for (int first = 0; first < m; first += BLOCK)
        basis_block(nmax, beta, m - first < BLOCK ? m - first : BLOCK, x + first, (size_t)m, b + first);
    return OK;
}

/*
 * Integrals of phi_0 over small pixels of centre c and width h, times norm: phi_0(c) h times
 * the sum of even terms He_2k(c) (h/2)^2k / (2k+1)!.  30 terms serve h < 2, h |c| < 6.
 */
WIDE static void small_integral_0(int m, const double *c, const double *h, const double *e,
                                  double norm, double *b)
{
    double below[BLOCK], term[BLOCK], sum[BLOCK];
    for (int i = 0; i < m; i++) {
        below[i] = 0;
        term[i] = sum[i] = 1;
    }
    for (int n = 1; n <= 30; n++) {
        const double step = 0.5 / n, weight = n % 2 ? 0 : 1.0 / (n + 1);
        for (int i = 0; i < m; i++) {
            double next = step * h[i] * (c[i] * term[i] - 0.5 * h[i] * below[i]);
            below[i] = term[i];
            term[i] = next;
            sum[i] += weight * next;
        }
    }
    for (int i = 0; i < m; i++)
        b[i] = PI_M14 * norm * e[i] * e[i] * h[i] * sum[i];
}

/* Is the series the better way?  Elsewhere the tail integrals at the two edges differ by a factor of 7 or more. */
static inline int central(double c, double h)
{
    return h < 2 && h * fabs(c) < (h < 1 ? 5 : 2);
}

/* Integrals of phi_0 over [t[i], t[i+1]], times norm, without subtracting near-equals. */
WIDE static void integral_0(int m, const double *t, const double *c, const double *h, double norm, double *b)
{
    double e[BLOCK], tail = 0;
    int any = 0;
    for (int i = 0; i < m; i++)
        any |= central(c[i], h[i]);
    if (any) {
        for (int i = 0; i < m; i++)
            e[i] = half_gauss(c[i]);
        small_integral_0(m, c, h, e, norm, b);
    }
    int known = -1;             /* edge whose tail integral is in `tail` */
    for (int i = 0; i < m; i++) {
        if (central(c[i], h[i]))
            continue;
        const double near = known == i ? tail : erfc(fabs(t[i]) * M_SQRT1_2);
        tail = erfc(fabs(t[i + 1]) * M_SQRT1_2);
        known = i + 1;
        b[i] = norm * PI_P14 * M_SQRT1_2 * (t[i] > 0 ? near - tail : t[i + 1] < 0 ? tail - near : (1 - near) + (1 - tail));
    }
}

/* Row n >= 1 of the integrals from I_{n-2} and the edge differences of phi_{n-1}. */
static void integral_row(int n, int m, const double *diff, size_t stride, double *b)
{
    const double keep = sqrt((n - 1.0) / n), edge = sqrt(2.0 / n);
    double *row = b + (size_t)n * stride;
    if (n == 1) {
        for (int i = 0; i < m; i++)
            row[i] = -edge * diff[i];
        return;
    }
    const double *two = row - 2 * stride;
    for (int i = 0; i < m; i++)
        row[i] = keep * two[i] - edge * diff[i];
}

/* Closed form on len <= BLOCK pixels; edges t (clamped), centres and widths in beta. */
WIDE static void pixel_block(int nmax, int m, const double *t, const double *c, const double *h,
                             double norm, size_t stride, double *b)
{
    double e[BLOCK + 1], s[BLOCK + 1], before[BLOCK + 1], here[BLOCK + 1], diff[BLOCK];
    for (int i = 0; i <= m; i++) {
        e[i] = half_gauss(t[i]);
        s[i] = e[i] * norm;
        before[i] = 0;
        here[i] = PI_M14 * e[i];
    }
    integral_0(m, t, c, h, norm, b);
    for (int n = 1; n <= nmax; n++) {
        const double up = sqrt(2.0 / n), down = sqrt((n - 1.0) / n);
        for (int i = 0; i < m; i++)
            diff[i] = here[i + 1] * s[i + 1] - here[i] * s[i];
        integral_row(n, m, diff, stride, b);
        for (int i = 0; i <= m; i++) {
            double next = up * t[i] * here[i] - down * before[i];
            before[i] = here[i];
            here[i] = next;
        }
    }
}

/*
 * Small pixels: mean A_n and difference D_n of phi_n at the two edges come from
 * their own recurrence, so that no near-equals are subtracted.
 */
WIDE static void paired_block(int nmax, int m, const double *c, const double *h,
                              double norm, size_t stride, double *b)
{
    double e[BLOCK], s[BLOCK], a0[BLOCK], a1[BLOCK], d0[BLOCK], d1[BLOCK], diff[BLOCK];
    for (int i = 0; i < m; i++) {
        e[i] = half_gauss(c[i]);
        s[i] = e[i] * norm;
        const double seed = PI_M14 * e[i] * exp_minus(0.125 * h[i] * h[i]);
        const double z = 0.5 * c[i] * h[i];
        a0[i] = d0[i] = 0;
        a1[i] = seed * hyperbolic(z, -1);
        d1[i] = -2 * seed * (z * hyperbolic(z, 1));
    }
    small_integral_0(m, c, h, e, norm, b);
    for (int n = 1; n <= nmax; n++) {
        const double up = sqrt(2.0 / n), down = sqrt((n - 1.0) / n);
        for (int i = 0; i < m; i++) {
            diff[i] = d1[i] * s[i];
            double a = up * (c[i] * a1[i] + 0.25 * h[i] * d1[i]) - down * a0[i];
            double d = up * (c[i] * d1[i] + h[i] * a1[i]) - down * d0[i];
            a0[i] = a1[i];
            d0[i] = d1[i];
            a1[i] = a;
            d1[i] = d;
        }
        integral_row(n, m, diff, stride, b);
    }
}

int shapelet_pixel(int nmax, double beta, int m, const double *edge, double *b)
{
    if (domain(nmax, beta, m))
        return E_RANGE;
    for (int i = 0; i < m; i++)
        if (!(edge[i + 1] - edge[i] >= 0))
            return E_RANGE;
    const double norm = sqrt(beta);
    for (int first = 0, len; first < m; first += len) {
        double t[BLOCK + 1], c[BLOCK], h[BLOCK];
        int small = 0;
        t[0] = clamp(edge[first] / beta);
        for (len = 0; len < BLOCK && first + len < m; len++) {
            const double lo = edge[first + len], hi = edge[first + len + 1];
            h[len] = (hi - lo) / beta;
            c[len] = clamp((0.5 * lo + 0.5 * hi) / beta);
            t[len + 1] = clamp(hi / beta);
            if (len == 0)
                small = h[0] < SMALL_PIXEL;
            else if (small != (h[len] < SMALL_PIXEL))
                break;
        }
        if (small)
            paired_block(nmax, len, c, h, norm, (size_t)m, b + first);
        else
            pixel_block(nmax, len, t, c, h, norm, (size_t)m, b + first);
    }
    return OK;
}

/* One strip of w <= STRIP columns of shapelet_pixel_sum. */
WIDE static void sum_strip(int nmax, const double *c, int w, size_t m1, const double *bx,
                           size_t m2, const double *by, double *out)
{
    double v[(SHAPELET_NMAX + 1) * STRIP];
    for (int n2 = 0; n2 <= nmax; n2++) {
        double *restrict row = v + n2 * STRIP;
        for (int i = 0; i < STRIP; i++)
            row[i] = 0;
        for (int n1 = 0; n1 <= nmax - n2; n1++) {
            const double f = c[shapelet_index(n1, n2)];
            const double *restrict x = bx + (size_t)n1 * m1;
            for (int i = 0; i < w; i++)
                row[i] += f * x[i];
        }
    }
    for (size_t j = 0; j < m2; j++) {
        double sum[STRIP] = {0};
        for (int n2 = 0; n2 <= nmax; n2++) {
            const double f = by[(size_t)n2 * m2 + j];
            const double *restrict row = v + n2 * STRIP;
            for (int i = 0; i < STRIP; i++)
                sum[i] += f * row[i];
        }
        memcpy(out + j * m1, sum, (size_t)w * sizeof *sum);
    }
}

int shapelet_pixel_sum(int nmax, const double *c, int m1, const double *bx,
                       int m2, const double *by, double *out)
{
    if (nmax < 0 || nmax > SHAPELET_NMAX || m1 < 0 || m2 < 0)
        return E_RANGE;
    for (int i = 0; i < m1; i += STRIP)
        sum_strip(nmax, c, m1 - i < STRIP ? m1 - i : STRIP, (size_t)m1, bx + i, (size_t)m2, by, out + i);
    return OK;
}

void shapelet_fourier(int nmax, const double *c, double *out)
{
    for (int n = 0; n <= nmax; n++)
        for (int n1 = 0; n1 <= n; n1++) {
            size_t i = shapelet_index(n1, n - n1);
            out[i] = n % 4 == 0 || n % 4 == 3 ? c[i] : -c[i];
        }
}

void shapelet_line_integrals(int nmax, double *in)
{
    for (int n = 0; n <= nmax; n++)
        in[n] = n == 0 ? M_SQRT2 * PI_P14 : n == 1 ? 0 : sqrt((n - 1.0) / n) * in[n - 2];
}

void shapelet_moments(int nmax, double beta, const double *c, double m[6])
{
    if (domain(nmax, beta, 0)) {
        for (int k = 0; k < 6; k++)
            m[k] = NAN;
        return;
    }
    double one[SHAPELET_NMAX + 1], x[SHAPELET_NMAX + 1], xx[SHAPELET_NMAX + 1];
    shapelet_line_integrals(nmax, one);
    for (int n = 0; n <= nmax; n++) {
        x[n] = n == 0 ? 0 : sqrt(2.0 * n) * one[n - 1];
        xx[n] = (2 * n + 1) * one[n];
    }
    double sum[6] = {0};
    for (int n = 0; n <= nmax; n++)
        for (int n1 = 0; n1 <= n; n1++) {
            const int n2 = n - n1;
            const double f = c[shapelet_index(n1, n2)];
            sum[0] += f * (one[n1] * one[n2]);
            sum[1] += f * (x[n1] * one[n2]);
            sum[2] += f * (one[n1] * x[n2]);
            sum[3] += f * (xx[n1] * one[n2]);
            sum[4] += f * (x[n1] * x[n2]);
            sum[5] += f * (one[n1] * xx[n2]);
        }
    for (int k = 0; k < 6; k++)
        m[k] = sum[k] * (k == 0 ? beta : k < 3 ? beta * beta : beta * beta * beta);
}

double shapelet_value(int nmax, double beta, const double *c, double x, double y)
{
    double bx[SHAPELET_NMAX + 1], by[SHAPELET_NMAX + 1];
    if (shapelet_basis(nmax, beta, 1, &x, bx) || shapelet_basis(nmax, beta, 1, &y, by))
        return NAN;
    double sum = 0;
    for (int n2 = 0; n2 <= nmax; n2++) {
        double row = 0;
        for (int n1 = 0; n1 <= nmax - n2; n1++)
            row += c[shapelet_index(n1, n2)] * bx[n1];
        sum += row * by[n2];
    }
    return sum;
}

/* phi_n(x) and, when slope is wanted, its derivative sqrt(2n) phi_{n-1} - x phi_n. */
static double phi(int n, double x, double *slope)
{
    const double e = half_gauss(clamp(x));
    double before = 0, here = PI_M14 * e;
    for (int k = 0; k < n; k++) {
        double next = sqrt(2.0 / (k + 1)) * x * here - sqrt(k / (k + 1.0)) * before;
        before = here;
        here = next;
    }
    if (slope)
        *slope = (sqrt(2.0 * n) * before - x * here) * e;
    return here * e;
}

double shapelet_reach(int n, double eps)
{
    if (n < 0 || n > 200 || !(eps >= 1e-16) || !(eps < 1))
        return NAN;
    /* the outermost extremum is the largest; it lies between the last zero and the turning point */
    const double turn = sqrt(2.0 * n + 1);
    double lo = n == 0 ? 0 : fmax(0, turn - 1.13 / cbrt(sqrt(n + 0.5))), hi = turn, slope;
    for (int i = 0; i < 60; i++) {
        double mid = 0.5 * (lo + hi);
        phi(n, mid, &slope);
        if (slope > 0)
            lo = mid;
        else
            hi = mid;
    }
    const double level = eps * phi(n, lo, NULL);
    for (hi = turn + 20; hi - lo > 1e-13 * hi; ) {
        double mid = 0.5 * (lo + hi);
        if (phi(n, mid, NULL) > level)
            lo = mid;
        else
            hi = mid;
    }
    return hi;
}

void shapelet_mirror(int nmax, double *c)
{
    for (int n = 0; n <= nmax; n++)
        for (int n2 = 1; n2 <= n; n2 += 2) {
            size_t i = shapelet_index(n - n2, n2);
            c[i] = -c[i];
        }
}

/* Krawtchouk values K_k, sum K_k z^k = (1+z)^p (1-z)^q, p+q <= 66: exact. */
static void krawtchouk(int p, int q, int64_t *k)
{
    k[0] = 1;
    for (int i = 1; i <= p + q; i++) {
        k[i] = 0;
        for (int j = i; j > 0; j--)
            k[j] += i <= p ? k[j - 1] : -k[j - 1];
    }
}

/* row[k] = C(n, k), n <= 66: exact. */
static void binomials(int n, int64_t *row)
{
    krawtchouk(n, 0, row);
}

int shapelet_polar(int n1, int n2, int p, int q, double z[2])
{
    const int n = p + q;
    if (n1 < 0 || n2 < 0 || p < 0 || q < 0 || n > SHAPELET_ROTMAX || n1 > n || n1 + n2 != n)
        return E_RANGE;
    int64_t k[SHAPELET_ROTMAX + 1], row[SHAPELET_ROTMAX + 1];
    krawtchouk(p, q, k);
    binomials(n, row);
    /* sqrt(n1! n2! / (p! q!)) as a ratio of binomials */
    const double a = ldexp(sqrt(ldexp((double)row[p] / (double)row[n1], n % 2)), -(n + 1) / 2) * (double)k[n2];
    z[0] = n2 % 2 ? 0 : n2 % 4 ? -a : a;
    z[1] = n2 % 2 == 0 ? 0 : n2 % 4 == 3 ? -a : a;
    return OK;
}

/*
 * Krawtchouk rows of block n, row p = 0..n/2 holding (1+z)^p (1-z)^(n-p), made from those of
 * block n-1 in place: exact.
 */
struct blocks {
    int64_t k[SHAPELET_ROTMAX / 2 + 1][SHAPELET_ROTMAX + 2];
};

static void next_block(int n, struct blocks *s)
{
    if (n == 0) {
        memset(s, 0, sizeof *s);
        s->k[0][0] = 1;
        return;
    }
    if (n % 2 == 0)             /* the new row p = n/2 is row p-1 of block n-1 times 1+z */
        for (int i = n; i >= 0; i--)
            s->k[n / 2][i] = s->k[n / 2 - 1][i] + (i ? s->k[n / 2 - 1][i - 1] : 0);
    for (int p = 0; p <= (n - 1) / 2; p++)
        for (int i = n; i > 0; i--)
            s->k[p][i] -= s->k[p][i - 1];
}

/*
 * Block n of the polar transform without its phases: row p = 0..n/2 (m = n - 2p >= 0),
 * column n2 = 0..n, T[p][n2] = s(n2) <n1 n2|p q> i^-n2 with s = + + - - for n2 = 0 1 2 3 mod 4
 * taken in, so that f = sum_even T c - i sum_odd T c.  <n1 n2|p q> i^-n2 =
 * 2^(-n/2) (C(n,p)/C(n,n2))^(1/2) K.
 */
static void rotation_block(int n, const struct blocks *s, double *t)
{
    int64_t row[SHAPELET_ROTMAX + 1];
    double root[SHAPELET_ROTMAX + 1], scale[SHAPELET_ROTMAX + 1];
    binomials(n, row);
    for (int i = 0; i <= n; i++) {
        root[i] = ldexp(sqrt(ldexp((double)row[i], n % 2)), -(n + 1) / 2);
        scale[i] = (i & 2 ? -1 : 1) / sqrt((double)row[i]);
    }
    for (int p = 0; p <= n / 2; p++)
        for (int n2 = 0; n2 <= n; n2++)
            *t++ = root[p] * ((double)s->k[p][n2] * scale[n2]);
}

static size_t block_count(int n)
{
    return (size_t)(n / 2 + 1) * (size_t)(n + 1);
}

/* Rotate the n+1 coefficients of one block: f_m -> exp(i m rho) f_m, back with the other half conj. */
static void rotate_block(int n, const double *t, const double (*turn)[2], const double *c, double *out)
{
    double sum[SHAPELET_ROTMAX + 2] = {0};
    for (int p = 0; p <= n / 2; p++, t += n + 1) {
        const int m = n - 2 * p;
        double re = 0, im = 0;
        for (int n2 = 0; n2 <= n; n2 += 2)
            re += t[n2] * c[n - n2];
        for (int n2 = 1; n2 <= n; n2 += 2)
            im -= t[n2] * c[n - n2];
        const double twice = m == 0 ? 1 : 2;
        const double fr = twice * (turn[m][0] * re - turn[m][1] * im);
        const double fi = twice * (turn[m][0] * im + turn[m][1] * re);
        for (int n2 = 0; n2 <= n; n2 += 2)
            sum[n2] += t[n2] * fr;
        for (int n2 = 1; n2 <= n; n2 += 2)
            sum[n2] -= t[n2] * fi;
    }
    for (int n2 = 0; n2 <= n; n2++)
        out[n - n2] = sum[n2];
}

/* cos and sin of m rho, m = 0..nmax, with the product in two parts. */
static int turns(int nmax, double rho, double (*turn)[2])
{
    if (nmax < 0 || nmax > SHAPELET_ROTMAX || !isfinite(rho))
        return E_RANGE;
    for (int m = 0; m <= nmax; m++) {
        const double a = m * rho, rest = fma(m, rho, -a), s = sin(a), c = cos(a);
        turn[m][0] = c - rest * s;
        turn[m][1] = s + rest * c;
    }
    return OK;
}

size_t shapelet_rotation_count(int nmax)
{
    size_t sum = 0;
    for (int n = 0; n <= nmax; n++)
        sum += block_count(n);
    return sum;
}

int shapelet_rotation_table(int nmax, double *table)
{
    if (nmax < 0 || nmax > SHAPELET_ROTMAX)
        return E_RANGE;
    struct blocks s;
    for (int n = 0; n <= nmax; table += block_count(n), n++) {
        next_block(n, &s);
        rotation_block(n, &s, table);
    }
    return OK;
}

int shapelet_rotate_by(int nmax, const double *table, double rho, const double *c, double *out)
{
    double turn[SHAPELET_ROTMAX + 1][2];
    if (turns(nmax, rho, turn))
        return E_RANGE;
    for (int n = 0; n <= nmax; table += block_count(n), n++)
        rotate_block(n, table, (const double (*)[2])turn, c + shapelet_index(0, n), out + shapelet_index(0, n));
    return OK;
}

int shapelet_rotate(int nmax, double rho, const double *c, double *out)
{
    double turn[SHAPELET_ROTMAX + 1][2], t[(SHAPELET_ROTMAX / 2 + 1) * (SHAPELET_ROTMAX + 1)];
    if (turns(nmax, rho, turn))
        return E_RANGE;
    struct blocks s;
    for (int n = 0; n <= nmax; n++) {
        next_block(n, &s);
        rotation_block(n, &s, t);
        rotate_block(n, t, (const double (*)[2])turn, c + shapelet_index(0, n), out + shapelet_index(0, n));
    }
    return OK;
}
