/*
 * smooth.c - separable Gaussian filter; see smooth.h.
 *
 * Rows are worked through in pieces that stay in the first-level cache, one
 * pass for each kernel value, so that the loops vectorise for any radius.
 */
#include "smooth.h"
#include "simd.h"
#include <math.h>
#include <stdlib.h>

enum { PIECE = 1024 };

int smooth_new(struct smooth *s, double fwhm_px)
{
    if (!(fwhm_px >= 0 && fwhm_px <= 1000))
        return E_RANGE;
    double sigma = fwhm_px / sqrt(8 * log(2));
    int r = (int)ceil(3 * sigma);
    float *k = malloc(((size_t)r + 1) * sizeof *k);
    if (!k)
        return E_NOMEM;
    double sum = 1;
    for (int j = 1; j <= r; j++)
        sum += 2 * exp(-0.5 * j * j / (sigma * sigma));
    k[0] = (float)(1 / sum);
    for (int j = 1; j <= r; j++)
        k[j] = (float)(exp(-0.5 * j * j / (sigma * sigma)) / sum);
    s->radius = r;
    s->k = k;
    return OK;
}

void smooth_free(struct smooth *s)
{
    free(s->k);
    *s = (struct smooth){0};
}

/* out = k a */
WIDE static void scale(const float *restrict a, float k, long n, float *restrict out)
{
    for (long i = 0; i < n; i++)
        out[i] = k * a[i];
}

/* out += k (a + b) */
WIDE static void add_pair(const float *restrict a, const float *restrict b, float k, long n,
                          float *restrict out)
{
    for (long i = 0; i < n; i++)
        out[i] += k * (a[i] + b[i]);
}

void smooth_row(const struct smooth *s, const float *in, long n, float *out)
{
    for (long x = 0; x < n; x += PIECE) {
        long m = n - x < PIECE ? n - x : PIECE;
        scale(in + x, s->k[0], m, out + x);
        for (int j = 1; j <= s->radius; j++)
            add_pair(in + x - j, in + x + j, s->k[j], m, out + x);
    }
}

void smooth_column(const struct smooth *s, const float *const *row, long n, float *out)
{
    int r = s->radius;
    for (long x = 0; x < n; x += PIECE) {
        long m = n - x < PIECE ? n - x : PIECE;
        scale(row[r] + x, s->k[0], m, out + x);
        for (int j = 1; j <= r; j++)
            add_pair(row[r - j] + x, row[r + j] + x, s->k[j], m, out + x);
    }
}

double smooth_noise(const struct smooth *s)
{
    double sum = (double)s->k[0] * s->k[0];
    for (int j = 1; j <= s->radius; j++)
        sum += 2 * (double)s->k[j] * s->k[j];
    return sum;            /* sqrt of the square: the kernel is a product of two equal ones */
}
