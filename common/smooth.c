/* smooth.c - separable Gaussian filter, 32 pixels at a time in registers; see smooth.h. */
#include "smooth.h"
#include "simd.h"
#include <math.h>
#include <stdlib.h>

enum { MOST = 1280 };          /* radius at 1000 pixels of FWHM: 1274 */

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

typedef float lanes __attribute__((vector_size(32), aligned(4), may_alias));
enum { LANES = sizeof(lanes) / sizeof(float), STEP = 4 * LANES };

static inline const lanes *at(const float *p)
{
    return (const lanes *)(const void *)p;
}

/* out[i] = k[0] row[r][i] + sum_j k[j] (row[r - j][i] + row[r + j][i]) */
WIDE static void weigh(const float *const *row, const float *k, int r, long n, float *out)
{
    long x = 0;
    for (; x + STEP <= n; x += STEP) {
        const lanes *m = at(row[r] + x);
        lanes a = k[0] * m[0], b = k[0] * m[1], c = k[0] * m[2], d = k[0] * m[3];
        for (int j = 1; j <= r; j++) {
            const lanes *p = at(row[r - j] + x), *q = at(row[r + j] + x);
            a += k[j] * (p[0] + q[0]);
            b += k[j] * (p[1] + q[1]);
            c += k[j] * (p[2] + q[2]);
            d += k[j] * (p[3] + q[3]);
        }
        lanes *o = (lanes *)(void *)(out + x);
        o[0] = a;
        o[1] = b;
        o[2] = c;
        o[3] = d;
    }
    for (; x < n; x++) {
        float a = k[0] * row[r][x];
        for (int j = 1; j <= r; j++)
            a += k[j] * (row[r - j][x] + row[r + j][x]);
        out[x] = a;
    }
}

void smooth_row(const struct smooth *s, const float *in, long n, float *out)
{
    const float *shifted[2 * MOST + 1];    /* along a row: the row beside itself */
    for (int j = 0; j <= 2 * s->radius; j++)
        shifted[j] = in + j - s->radius;
    weigh(shifted, s->k, s->radius, n, out);
}

void smooth_column(const struct smooth *s, const float *const *row, long n, float *out)
{
    weigh(row, s->k, s->radius, n, out);
}

double smooth_noise(const struct smooth *s)
{
    double sum = (double)s->k[0] * s->k[0];
    for (int j = 1; j <= s->radius; j++)
        sum += 2 * (double)s->k[j] * s->k[j];
    return sum;            /* sqrt of the square: the kernel is a product of two equal ones */
}
