/* tiles.c - overlap and save in two dimensions; see tiles.h. */
#include "tiles.h"
#include "fft.h"
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

struct tiles {
    int radius, reach;
    int h, w, wide;        /* of the transforms; columns that a tile gives */
    struct fft *to, *back;
    double *kernel;        /* conjugate of its transform over h w: h x (w/2 + 1) complex */
};

static size_t complexes(int h, int w)
{
    return (size_t)h * ((size_t)w / 2 + 1);
}

/* Seconds for each of the pixels that a tile h x w gives. */
static double seconds(int h, int w, int reach)
{
    const double n = (double)h * w;
    return n * (2e-9 + 0.35e-9 * log2(n) * (n > 1e5 ? 1.5 : 1)) / (TILES_TALL * (double)(w - 2 * reach));
}

/* The cheapest size; E_RANGE where there is none. */
static int choose(int radius, int reach, int *h, int *w)
{
    const long rows = TILES_TALL + 2L * radius, most = 1L << 28;
    if (rows > most || reach > most / 4)
        return E_RANGE;
    *h = fft_good_size((int)rows);
    *w = 0;
    for (int wide = 32; wide <= 4 * (reach + 64); wide += wide / 8) {
        int candidate = fft_good_size(2 * reach + wide);
        if ((int64_t)*h * candidate <= most && (!*w || seconds(*h, candidate, reach) < seconds(*h, *w, reach)))
            *w = candidate;
    }
    return *w ? OK : E_RANGE;
}

double tiles_seconds(int radius, int reach)
{
    int h, w;
    return choose(radius, reach, &h, &w) ? INFINITY : seconds(h, w, reach);
}

int tiles_new(struct tiles **t, const double *w, int radius, int reach)
{
    struct tiles *made = calloc(1, sizeof *made);
    if (!made)
        return E_NOMEM;
    made->radius = radius;
    made->reach = reach;
    int st = choose(radius, reach, &made->h, &made->w);
    made->wide = made->w - 2 * reach;
    if (!st)
        st = fft_plan_r2c(&made->to, made->h, made->w);
    if (!st)
        st = fft_plan_c2r(&made->back, made->h, made->w);
    const size_t n = (size_t)made->h * (size_t)made->w, half = complexes(made->h, made->w), side = 2 * (size_t)reach + 1;
    double *place = st ? NULL : fft_alloc(n * sizeof *place);
    made->kernel = st ? NULL : fft_alloc(2 * half * sizeof *made->kernel);
    if (!st && (!place || !made->kernel))
        st = E_NOMEM;
    if (!st) {
        memset(place, 0, n * sizeof *place);
        for (int j = 0; j <= 2 * radius; j++)
            memcpy(place + (size_t)j * (size_t)made->w, w + (size_t)j * side, side * sizeof *w);
        fft_run(made->to, place, made->kernel);
        for (size_t i = 0; i < half; i++) {
            made->kernel[2 * i] /= (double)n;
            made->kernel[2 * i + 1] /= -(double)n;
        }
    }
    fft_free(place);
    if (st)
        tiles_free(made);
    else
        *t = made;
    return st;
}

void tiles_free(struct tiles *t)
{
    if (!t)
        return;
    fft_done(t->to);
    fft_done(t->back);
    fft_free(t->kernel);
    free(t);
}

/* Doubles of a transformed tile, up to a multiple of 64 bytes: what is behind it is aligned as it is. */
static size_t transformed(const struct tiles *t)
{
    return (2 * complexes(t->h, t->w) + 7) & ~(size_t)7;
}

size_t tiles_room(const struct tiles *t)
{
    return (size_t)t->h * (size_t)t->w + transformed(t);
}

/* The pixels of a tile whose first column is x, and zeros beyond them. */
static void load(const struct tiles *t, const float *const *row, long nx, long x, double *in)
{
    const long n = nx + t->reach - x < t->wide + t->reach ? nx + t->reach - x : t->wide + t->reach;
    for (long j = 0; j < t->h; j++) {
        double *to = in + (size_t)j * (size_t)t->w;
        const float *from = j < TILES_TALL + 2L * t->radius && row[j] ? row[j] + x : NULL;
        long i = 0;
        for (; from && i < t->reach + n; i++)
            to[i] = (double)from[i - t->reach];
        memset(to + i, 0, (size_t)(t->w - i) * sizeof *to);
    }
}

/* a *= b */
static void multiply(size_t n, double *restrict a, const double *restrict b)
{
    for (size_t i = 0; i < n; i++) {
        double re = a[2 * i] * b[2 * i] - a[2 * i + 1] * b[2 * i + 1], im = a[2 * i] * b[2 * i + 1] + a[2 * i + 1] * b[2 * i];
        a[2 * i] = re;
        a[2 * i + 1] = im;
    }
}

void tiles_filter(const struct tiles *t, const float *const *row, long nx, double *scratch, float *out)
{
    double *half = scratch, *full = scratch + transformed(t);
    for (long x = 0; x < nx; x += t->wide) {
        load(t, row, nx, x, full);
        fft_run(t->to, full, half);
        multiply(complexes(t->h, t->w), half, t->kernel);
        fft_run(t->back, half, full);
        const long n = nx - x < t->wide ? nx - x : t->wide;
        for (long j = 0; j < TILES_TALL; j++)
            for (long i = 0; i < n; i++)
                out[(size_t)j * (size_t)nx + (size_t)(x + i)] = (float)full[(size_t)j * (size_t)t->w + (size_t)i];
    }
}
