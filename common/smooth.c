/* smooth.c - the filter, 32 pixels at a time in registers; see smooth.h. */
#include "smooth.h"
#include "simd.h"
#include "tiles.h"
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

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
    *s = (struct smooth){.way = r > 0 ? SMOOTH_EVEN : SMOOTH_NOTHING, .radius = r, .reach = r, .k = k};
    s->noise = (double)k[0] * (double)k[0];
    for (int j = 1; j <= r; j++)
        s->noise += 2 * (double)k[j] * (double)k[j];   /* sqrt of the square: the kernel is a product of two equal ones */
    return OK;
}

void smooth_free(struct smooth *s)
{
    free(s->k);
    tiles_free(s->tiles);
    *s = (struct smooth){0};
}

/* ---- any kernel ---- */

/* Half sides of the part of the kernel that is not 0 and can touch pixels of an image. */
static void extent(const struct kernel *k, long nx, long ny, struct smooth *s)
{
    for (long j = 0; j < k->ny; j++)
        for (long i = 0; i < k->nx; i++) {
            long dx = labs(i - k->nx / 2), dy = labs(j - k->ny / 2);
            if (dx >= nx || dy >= ny || !(fabs(k->v[j * k->nx + i]) > 0))
                continue;
            s->reach = dx > s->reach ? (int)dx : s->reach;
            s->radius = dy > s->radius ? (int)dy : s->radius;
        }
}

/* Factor of the pixel (dx, dy) from the one that is filtered. */
static double factor(const struct kernel *k, long dx, long dy)
{
    long i = k->nx / 2 + dx, j = k->ny / 2 + dy;
    return i >= 0 && i < k->nx && j >= 0 && j < k->ny ? k->v[j * k->nx + i] : 0;
}

/* The row and the column through the largest value, when the kernel is their product; one array, NULL: it is none. */
static int product(const double *w, int radius, int reach, float **factors)
{
    const size_t across = 2 * (size_t)reach + 1, down = 2 * (size_t)radius + 1;
    size_t top = 0;
    double worst = 0;
    for (size_t i = 0; i < across * down; i++)
        top = fabs(w[i]) > fabs(w[top]) ? i : top;
    const double *row = w + top / across * across, *column = w + top % across;
    for (size_t j = 0; j < down; j++)
        for (size_t i = 0; i < across; i++)
            worst = fmax(worst, fabs(w[j * across + i] - row[i] * column[j * across] / w[top]));
    *factors = NULL;
    if (!(worst <= 3e-7 * fabs(w[top])))
        return OK;
    float *f = malloc((across + down) * sizeof *f);
    if (!f)
        return E_NOMEM;
    for (size_t i = 0; i < across; i++)
        f[i] = (float)(row[i] / w[top]);
    for (size_t j = 0; j < down; j++)
        f[across + j] = (float)column[j * across];
    *factors = f;
    return OK;
}

/* The way that takes least time. */
static int choose(struct smooth *s, const double *w)
{
    const size_t n = (2 * (size_t)s->radius + 1) * (2 * (size_t)s->reach + 1);
    int st = product(w, s->radius, s->reach, &s->k);
    if (st)
        return st;
    s->way = s->k ? SMOOTH_PRODUCT : SMOOTH_WHOLE;
    if (smooth_seconds(s) > tiles_seconds(s->radius, s->reach)) {
        s->way = SMOOTH_TILES;
        free(s->k);
        s->k = NULL;
        return tiles_new(&s->tiles, w, s->radius, s->reach);
    }
    if (s->way == SMOOTH_PRODUCT)
        return OK;
    s->k = malloc(n * sizeof *s->k);
    for (size_t i = 0; i < n && s->k; i++)
        s->k[i] = (float)w[i];
    return s->k ? OK : E_NOMEM;
}

int smooth_kernel(struct smooth *s, const struct kernel *k, long nx, long ny)
{
    if (k->nx < 1 || k->ny < 1 || nx < 1 || ny < 1 || k->nx > UINT16_MAX || k->ny > UINT16_MAX)
        return E_RANGE;
    double most = 0;
    struct smooth made = {0};
    for (long i = 0; i < k->nx * k->ny; i++) {
        if (!isfinite(k->v[i]))
            return E_DATA;
        most = fmax(most, fabs(k->v[i]));
    }
    if (!(most >= 1e-20 && most <= 1e20))
        return E_DATA;
    for (long i = 0; i < k->nx * k->ny; i++)
        made.noise += k->v[i] * k->v[i];
    made.noise = sqrt(made.noise);
    extent(k, nx, ny, &made);
    double *w = malloc((2 * (size_t)made.radius + 1) * (2 * (size_t)made.reach + 1) * sizeof *w), *to = w;
    if (!w)
        return E_NOMEM;
    for (long dy = -made.radius; dy <= made.radius; dy++)
        for (long dx = -made.reach; dx <= made.reach; dx++)
            *to++ = factor(k, dx, dy);
    int st = choose(&made, w);
    free(w);
    if (st)
        smooth_free(&made);
    else
        *s = made;
    return st;
}

/* ---- rows ---- */

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

/* out[i] = sum_j k[j] in[i + j] over n values of k */
static inline void weigh_step(const float *in, const float *k, int n, lanes acc[4])
{
    for (int j = 0; j < n; j++) {
        const lanes *p = at(in + j);
        acc[0] += k[j] * p[0];
        acc[1] += k[j] * p[1];
        acc[2] += k[j] * p[2];
        acc[3] += k[j] * p[3];
    }
}

/* out[i] = sum over `rows` rows of 2 reach + 1 factors: k[j (2 reach + 1) + l] row[j][i + l - reach] */
WIDE static void weigh_whole(const float *const *row, const float *k, long rows, int reach, long n, float *out)
{
    const int across = 2 * reach + 1;
    long x = 0;
    for (; x + STEP <= n; x += STEP) {
        lanes acc[4] = {0};
        for (long j = 0; j < rows; j++)
            weigh_step(row[j] - reach + x, k + j * across, across, acc);
        memcpy(out + x, acc, sizeof acc);
    }
    for (; x < n; x++) {
        float a = 0;
        for (long j = 0; j < rows; j++)
            for (int l = 0; l < across; l++)
                a += k[j * across + l] * row[j][x + l - reach];
        out[x] = a;
    }
}

void smooth_row(const struct smooth *s, const float *in, long n, float *out)
{
    if (s->way == SMOOTH_PRODUCT) {
        weigh_whole(&in, s->k, 1, s->reach, n, out);
        return;
    }
    const float *shifted[2 * MOST + 1];    /* along a row: the row beside itself */
    for (int j = 0; j <= 2 * s->radius; j++)
        shifted[j] = in + j - s->radius;
    weigh(shifted, s->k, s->radius, n, out);
}

void smooth_column(const struct smooth *s, const float *const *row, long n, float *out)
{
    if (s->way == SMOOTH_EVEN)
        weigh(row, s->k, s->radius, n, out);
    else if (s->way == SMOOTH_PRODUCT)
        weigh_whole(row, s->k + 2 * s->reach + 1, 2L * s->radius + 1, 0, n, out);
    else
        weigh_whole(row, s->k, 2L * s->radius + 1, s->reach, n, out);
}

double smooth_noise(const struct smooth *s)
{
    return s->noise;
}

double smooth_seconds(const struct smooth *s)
{
    const double across = 2.0 * s->reach + 1, down = 2.0 * s->radius + 1;
    switch (s->way) {
    case SMOOTH_NOTHING: return 0;
    case SMOOTH_EVEN: return 3e-10 + 7.5e-11 * down;
    case SMOOTH_PRODUCT: return 4e-10 + 4.2e-11 * (across + down);
    case SMOOTH_WHOLE: return 5e-10 + 3e-11 * across * down;
    case SMOOTH_TILES: break;
    }
    return tiles_seconds(s->radius, s->reach);
}

double smooth_bytes(const struct smooth *s, long nx)
{
    const double rows = 2.0 * s->radius + (s->way == SMOOTH_TILES ? TILES_TALL + 1 : 2), wide = (double)nx + 2.0 * s->reach;
    const double more = s->way == SMOOTH_EVEN || s->way == SMOOTH_PRODUCT ? rows * (double)nx : s->way == SMOOTH_TILES ? TILES_TALL * (double)nx : 0;
    return 4 * (rows * wide + more) + (s->tiles ? 8 * (double)tiles_room(s->tiles) : 0);
}
