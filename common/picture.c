/* picture.c - from pixel values to shades of grey. */
#include "picture.h"
#include <math.h>

/* The k-th smallest of v[0..n-1], which is reordered (Hoare's selection). */
static double select_nth(float *v, size_t n, size_t k)
{
    size_t lo = 0, hi = n - 1;
    while (lo < hi) {
        float pivot = v[lo + (hi - lo) / 2];
        size_t i = lo, j = hi;
        for (;;) {
            while (v[i] < pivot)
                i++;
            while (v[j] > pivot)
                j--;
            if (i >= j)
                break;
            float t = v[i];
            v[i++] = v[j];
            v[j--] = t;
        }
        if (v[j] > pivot)
            j--;
        if (k <= j)
            hi = j;
        else
            lo = j + 1;
    }
    return (double)v[k];
}

static double stretched(enum stretch kind, double x)
{
    return kind == STRETCH_LINEAR ? x : kind == STRETCH_LOG ? log1p(x) : asinh(x);
}

static double relaxed(enum stretch kind, double f)
{
    return kind == STRETCH_LINEAR ? f : kind == STRETCH_LOG ? expm1(f) : sinh(f);
}

/* Shade k begins where 255 f / f(top) = k - 1/2, so that a pixel costs eight comparisons and no asinh. */
static void set_edges(struct picture *p)
{
    double top = stretched(p->stretch, (p->high - p->low) / p->soft);
    p->edge[0] = -INFINITY;
    for (int k = 1; k < 256; k++)
        p->edge[k] = p->low + p->soft * relaxed(p->stretch, top * (k - 0.5) / 255);
}

int picture_levels(struct picture *p, float *sample, size_t n)
{
    size_t good = 0;
    for (size_t i = 0; i < n; i++)
        if (isfinite(sample[i]))
            sample[good++] = sample[i];
    double median = 0, low16 = 0, top = 0;
    if (good) {
        median = select_nth(sample, good, good / 2);
        low16 = select_nth(sample, good, (size_t)(0.16 * (double)good));
        top = select_nth(sample, good, (size_t)(0.999 * (double)(good - 1)));
    }
    double sigma = median - low16, low = p->low, high = p->high;
    if (isnan(low))
        low = median - 2 * sigma;
    if (isnan(high)) {
        high = fmax(top, median + 5 * sigma);
        if (!(high > low) && isnan(p->low))
            high = low + 1;
    }
    if (!(low < high) || !isfinite(high - low))
        return E_RANGE;
    p->low = low;
    p->high = high;
    p->soft = fmax(2 * sigma, (high - low) / 3000);
    set_edges(p);
    return OK;
}

void picture_row(const struct picture *p, const float *v, size_t n, unsigned char *grey, unsigned char *alpha)
{
    for (size_t i = 0; i < n; i++) {
        double x = (double)v[i];
        int k = 0, good = isfinite(v[i]);
        for (int step = 128; step; step /= 2)
            k += x >= p->edge[k + step] ? step : 0;
        grey[i] = (unsigned char)(good ? k : 128);
        if (alpha)
            alpha[i] = good ? 255 : 0;
    }
}
