/*
 * dither.c - sums of small pixels.
 */
#include "dither.h"
#include <stddef.h>

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
