/*
 * dither.c - sums of small pixels.
 */
#include "dither.h"
#include "simd.h"
#include <math.h>
#include <stddef.h>
#include <string.h>

#define KAISER 12.0
#define UPPER 0.75            /* of the Nyquist frequency */

long dither_side(long n, int factor)
{
    long side = (n - factor + 1) / factor;
    return n < factor || side < 0 ? 0 : side;
}

void dither_phase(int e, int factor, int *a, int *b)
{
    *b = e / factor;
    *a = *b & 1 ? factor - 1 - e % factor : e % factor;
}

void dither_row(int factor, long a, long nx, long side, const float *h, double scale, double *work, float *out)
{
    for (long x = 0; x < nx; x++)
        work[x] = (double)h[x];
    for (int q = 1; q < factor; q++) {
        const float *row = h + (size_t)q * (size_t)nx;
        for (long x = 0; x < nx; x++)
            work[x] += (double)row[x];
    }
    for (long i = 0; i < side; i++) {
        const double *cell = work + (size_t)i * (size_t)factor + a;
        double sum = cell[0];
        for (int p = 1; p < factor; p++)
            sum += cell[p];
        out[i] = (float)(sum * scale);
    }
}

/* Modified Bessel function of order 0, by its series. */
static double bessel0(double x)
{
    double term = 1, sum = 1;
    for (int k = 1; term > 1e-17 * sum; k++) {
        term *= 0.25 * x * x / ((double)k * k);
        sum += term;
    }
    return sum;
}

static double sinc(double x)
{
    return fabs(x) < 1e-8 ? 1 : sin(M_PI * x) / (M_PI * x);
}

/* Windowed sinc of the given band, 1 = Nyquist; x in small pixels. */
static double kernel(double x, double band)
{
    const double t = x / DITHER_REACH;
    return fabs(t) < 1 ? band * sinc(band * x) * bessel0(KAISER * sqrt(1 - t * t)) / bessel0(KAISER) : 0;
}

/* The window over one small pixel, moved; its sum is 1. */
static void taps(double fraction, double band, double w[2 * DITHER_REACH])
{
    double sum = 0;
    for (int k = 0; k < 2 * DITHER_REACH; k++)
        sum += w[k] = kernel(k - (DITHER_REACH - 1) - fraction, band);
    for (int k = 0; k < 2 * DITHER_REACH; k++)
        w[k] /= sum;
}

/* `factor` of them, one small pixel apart. */
static void add_up(int factor, const double w[2 * DITHER_REACH], struct dither_axis *a)
{
    *a = (struct dither_axis){.first = 1 - DITHER_REACH, .n = 2 * DITHER_REACH + factor - 1};
    for (int p = 0; p < factor; p++)
        for (int k = 0; k < 2 * DITHER_REACH; k++)
            a->w[p + k] += w[k];
}

void dither_sum(int factor, double fraction, struct dither_axis *a)
{
    double w[2 * DITHER_REACH];
    if (fraction > 0) {
        taps(fraction, 1, w);
        add_up(factor, w, a);
        return;
    }
    *a = (struct dither_axis){.n = factor};
    for (int p = 0; p < factor; p++)
        a->w[p] = 1;
}

void dither_rest(int factor, struct dither_axis *a)
{
    double w[2 * DITHER_REACH];
    taps(0, UPPER, w);
    for (int k = 0; k < 2 * DITHER_REACH; k++)
        w[k] = (k == DITHER_REACH - 1 ? 1 : 0) - w[k];
    add_up(factor, w, a);
}

long dither_mirror(long i, long n)
{
    i = ((i % (2 * n)) + 2 * n) % (2 * n);
    return i < n ? i : 2 * n - 1 - i;
}

WIDE static double dot(const double *restrict w, const double *restrict v, int n)
{
    double sum[8] = {0};
    int t = 0;
    for (; t + 8 <= n; t += 8)
        for (int k = 0; k < 8; k++)
            sum[k] += w[t + k] * v[t + k];
    for (; t < n; t++)
        sum[0] += w[t] * v[t];
    return ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]));
}

void dither_cells(const struct dither_axis *a, int factor, long from, long nx, long side, const double *line, double scale,
                  double *padded, double *out)
{
    const long start = from + a->first, end = factor * (side - 1) + start + a->n, pad = start < 0 ? -start : 0;
    memcpy(padded + pad, line, (size_t)nx * sizeof *line);
    for (long i = 0; i < pad; i++)
        padded[i] = line[dither_mirror(i - pad, nx)];
    for (long i = nx; i < end; i++)
        padded[pad + i] = line[dither_mirror(i, nx)];
    for (long i = 0; i < side; i++)
        out[i] = scale * dot(a->w, padded + pad + factor * i + start, a->n);
}
