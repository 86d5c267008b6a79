/* stats.c - means, spreads, straight lines, errors by resampling. */
#include "stats.h"
#include "rng.h"
#include <math.h>
#include <stdlib.h>

void sum_add(struct sum *s, double x)
{
    double t = s->s + x;
    s->c += fabs(s->s) >= fabs(x) ? (s->s - t) + x : (x - t) + s->s;
    s->s = t;
}

double sum_value(const struct sum *s)
{
    return s->s + s->c;
}

void stats_sum(size_t n, const double *x, struct stats *out)
{
    struct stats r = {.n = n, .mean = NAN, .var = NAN, .skew = NAN, .skew_err = NAN, .kurt = NAN, .kurt_err = NAN};
    struct sum s1 = {0}, s2 = {0}, s3 = {0}, s4 = {0}, left = {0};
    double m = (double)n;
    for (size_t i = 0; i < n; i++)
        sum_add(&s1, x[i]);
    if (n >= 1)
        r.mean = sum_value(&s1) / m;
    for (size_t i = 0; i < n; i++) {
        double d = x[i] - r.mean, d2 = d * d;
        sum_add(&left, d);
        sum_add(&s2, d2);
        sum_add(&s3, d2 * d);
        sum_add(&s4, d2 * d2);
    }
    /* what rounding left in the mean is moved out of the central moments */
    double e = sum_value(&left) / m;
    double mu2 = sum_value(&s2) / m - e * e;
    double mu3 = sum_value(&s3) / m - 3 * e * mu2 - e * e * e;
    double mu4 = sum_value(&s4) / m - 4 * e * mu3 - 6 * e * e * mu2;
    if (n >= 2)
        r.var = mu2 * m / (m - 1);
    if (n >= 3 && mu2 > 0) {
        r.skew = mu3 / (mu2 * sqrt(mu2));
        r.skew_err = sqrt(6 / m);
    }
    if (n >= 4 && mu2 > 0) {
        r.kurt = mu4 / (mu2 * mu2) - 3;
        r.kurt_err = sqrt(24 / m);
    }
    *out = r;
}

static void swap(double *a, double *b)
{
    double t = *a;
    *a = *b;
    *b = t;
}

/* Put the k-th smallest value at x[k], smaller ones before it. */
static void select_kth(size_t n, double *x, size_t k)
{
    size_t lo = 0, hi = n - 1;
    while (lo < hi) {
        double pivot = x[lo + (hi - lo) / 2];
        size_t i = lo, j = hi;
        for (;;) {
            while (x[i] < pivot)
                i++;
            while (x[j] > pivot)
                j--;
            if (i >= j)
                break;
            swap(&x[i++], &x[j--]);
        }
        /* x[lo..j] <= pivot <= x[j+1..hi]; when i == j, x[j] is the pivot */
        if (k <= j)
            hi = j;
        else
            lo = j + 1;
    }
}

double stats_median(size_t n, double *x)
{
    if (n == 0)
        return NAN;
    size_t k = n / 2;
    select_kth(n, x, k);
    if (n % 2)
        return x[k];
    double below = x[0];
    for (size_t i = 1; i < k; i++)
        below = x[i] > below ? x[i] : below;
    return 0.5 * (below + x[k]);
}

int stats_line(size_t n, const double *x, const double *y, const double *s, struct line_fit *out)
{
    struct line_fit r = {.n = n, .a = NAN, .se_a = NAN, .b = NAN, .se_b = NAN, .chi2 = NAN, .dof = (long)n - 2};
    *out = r;
    if (n < 2)
        return E_RANGE;
    double w = 0, mx = 0, my = 0;
    for (size_t i = 0; i < n; i++) {
        double wi = s ? 1 / (s[i] * s[i]) : 1;
        if (!(wi > 0) || !isfinite(wi) || !isfinite(x[i]) || !isfinite(y[i]))
            return E_RANGE;
        w += wi;
        mx += wi * x[i];
        my += wi * y[i];
    }
    mx /= w;
    my /= w;
    double sxx = 0, sxy = 0, top = 0;
    for (size_t i = 0; i < n; i++) {
        double wi = s ? 1 / (s[i] * s[i]) : 1;
        sxx += wi * (x[i] - mx) * (x[i] - mx);
        sxy += wi * (x[i] - mx) * (y[i] - my);
        top = fmax(top, wi * x[i] * x[i]);
    }
    if (!(sxx > 1e-24 * (double)n * top))
        return E_SINGULAR;
    r.b = sxy / sxx;
    r.a = my - r.b * mx;
    r.chi2 = 0;
    for (size_t i = 0; i < n; i++) {
        double d = (y[i] - my) - r.b * (x[i] - mx);
        r.chi2 += (s ? 1 / (s[i] * s[i]) : 1) * d * d;
    }
    double scale = s ? 1 : n > 2 ? sqrt(r.chi2 / (double)(n - 2)) : NAN;
    r.se_b = scale / sqrt(sxx);
    r.se_a = scale * sqrt(1 / w + mx * mx / sxx);
    *out = r;
    return OK;
}

void stats_resample(size_t n, size_t m, uint64_t seed, uint64_t draw, uint32_t *index)
{
    struct rng r = rng_stream(seed, 0, RNG_BOOTSTRAP);
    for (size_t i = 0; i < m; i++) {
        size_t k = (size_t)(rng_uniform(&r, draw, (uint32_t)i) * (double)n);
        index[i] = (uint32_t)(k < n ? k : n - 1);
    }
}

/* Spread of the ratio when pair k is left out, for every k. */
static double jackknife(size_t n, const double *a, const double *b, double sa, double sb)
{
    struct sum s = {0}, s2 = {0};
    for (size_t i = 0; i < n; i++)
        sum_add(&s, (sa - a[i]) / (sb - (b ? b[i] : 1)));
    double mean = sum_value(&s) / (double)n;
    for (size_t i = 0; i < n; i++) {
        double d = (sa - a[i]) / (sb - (b ? b[i] : 1)) - mean;
        sum_add(&s2, d * d);
    }
    return sqrt((double)(n - 1) / (double)n * sum_value(&s2));
}

static double bootstrap(size_t n, const double *a, const double *b, long draws, uint64_t seed, uint32_t *index)
{
    double mean = 0, m2 = 0;
    long used = 0;
    for (long k = 0; k < draws; k++) {
        double sa = 0, sb = 0;
        stats_resample(n, n, seed, (uint64_t)k, index);
        for (size_t i = 0; i < n; i++) {
            sa += a[index[i]];
            sb += b ? b[index[i]] : 1;
        }
        double v = sa / sb;
        if (!isfinite(v))
            continue;
        double d = v - mean;
        mean += d / (double)++used;
        m2 += d * (v - mean);
    }
    return used > 1 ? sqrt(m2 / (double)(used - 1)) : NAN;
}

int stats_ratio(size_t n, const double *a, const double *b, long draws, uint64_t seed, struct ratio *out)
{
    struct ratio r = {.n = n, .value = NAN, .se = NAN, .jackknife = NAN, .bootstrap = NAN};
    *out = r;
    if (n < 2 || n > UINT32_MAX || draws < 0)
        return E_RANGE;
    struct sum sa = {0}, sb = {0}, s2 = {0};
    for (size_t i = 0; i < n; i++) {
        sum_add(&sa, a[i]);
        sum_add(&sb, b ? b[i] : 1);
    }
    double ta = sum_value(&sa), tb = sum_value(&sb);
    if (!isfinite(ta) || !isfinite(tb) || tb == 0)
        return E_SINGULAR;
    r.value = ta / tb;
    for (size_t i = 0; i < n; i++) {
        double d = a[i] - r.value * (b ? b[i] : 1);
        sum_add(&s2, d * d);
    }
    r.se = sqrt(sum_value(&s2) / (double)(n - 1) / (double)n) / fabs(tb / (double)n);
    r.jackknife = jackknife(n, a, b, ta, tb);
    if (draws > 1) {
        uint32_t *index = malloc(n * sizeof *index);
        if (!index)
            return E_NOMEM;
        r.bootstrap = bootstrap(n, a, b, draws, seed, index);
        free(index);
    }
    *out = r;
    return OK;
}
