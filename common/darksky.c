/* darksky.c - the sky from blocks without objects; see darksky.h. */
#include "darksky.h"
#include "simd.h"
#include <float.h>
#include <math.h>
#include <stdlib.h>

enum { B = DARKSKY_BLOCK, LANES = 8, PIECE = 64, SAMPLE = 101, LEAST = 16, PASSES = 16 };
static const double CUT = 2;               /* noise of the smoothed blocks */

static int by_value(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return x < y ? -1 : x > y;
}

/* Median of a regular sample of the finite pixels, 0 without any. */
static double typical(const struct pixels *im)
{
    float v[SAMPLE];
    const size_t nx = (size_t)im->nx, all = nx * (size_t)im->ny;
    size_t n = 0;
    for (size_t i = 0; i < SAMPLE; i++) {
        const size_t at = all / SAMPLE * i + all % SAMPLE * i / SAMPLE;
        float p = pixels_at(im, (long)(at % nx), (long)(at / nx));
        if (fabsf(p) <= FLT_MAX)
            v[n++] = p;
    }
    qsort(v, n, sizeof *v, by_value);
    return n ? (double)v[n / 2] : 0;
}

int darksky_new(struct darksky *d, const struct pixels *im)
{
    long nx = im->nx / B, ny = im->ny / B;
    float *mean = malloc(((size_t)nx * (size_t)ny + 1) * sizeof *mean);
    if (!mean)
        return E_NOMEM;
    *d = (struct darksky){nx, ny, typical(im), mean};
    return OK;
}

void darksky_free(struct darksky *d)
{
    free(d->mean);
    *d = (struct darksky){0};
}

/* Sums of 4 x 4 pixels less pivot; not finite when a pixel is not. */
WIDE static void block_sums(const float *a, const float *b, const float *c, const float *d, float pivot, long n,
                            float *restrict out)
{
    float col[PIECE * B];
    for (long x = 0; x < n; x += PIECE) {
        long m = n - x < PIECE ? n - x : PIECE;
        for (long i = 0; i < m * B; i++)
            col[i] = ((a[x * B + i] - pivot) + (b[x * B + i] - pivot)) + ((c[x * B + i] - pivot) + (d[x * B + i] - pivot));
        for (long i = 0; i < m; i++)
            out[x + i] = ((col[B * i] + col[B * i + 1]) + (col[B * i + 2] + col[B * i + 3])) * (1.0f / (B * B));
    }
}

/* Mean of the good pixels of a block that has bad ones, from its upper left pixel and rms on; NaN when more than half are bad. */
static float block_mean(const float *pix, const float *rms, size_t stride, double pivot)
{
    double sum = 0;
    int n = 0;
    for (int y = 0; y < B; y++, pix += stride, rms = rms ? rms + stride : NULL)
        for (int x = 0; x < B; x++) {
            if (!(fabsf(pix[x]) <= FLT_MAX) || (rms && !(rms[x] <= FLT_MAX)))
                continue;
            sum += (double)pix[x] - pivot;
            n++;
        }
    return 2 * n >= B * B ? (float)(sum / n) : NAN;
}

WIDE static int any_bad(const float *v, long n)
{
    int bad = 0;
    for (long i = 0; i < n; i++)
        bad |= !(v[i] <= FLT_MAX);
    return bad;
}

int darksky_rows(struct darksky *d, const struct pixels *im, const float *rms_map, long y0, long y1)
{
    const size_t nx = (size_t)im->nx;
    float *row = malloc(B * nx * sizeof *row);
    if (!row)
        return E_NOMEM;
    for (long j = (y0 + B - 1) / B; j < d->ny && j * B < y1; j++) {
        const float *rms = rms_map ? rms_map + (size_t)(j * B) * nx : NULL;
        float *out = d->mean + j * d->nx;
        int bad = 0;
        for (size_t k = 0; k < B && rms; k++)
            bad |= any_bad(rms + k * nx, d->nx * B);
        pixels_box(im, (struct box){0, j * B, im->nx, B}, row);
        block_sums(row, row + nx, row + 2 * nx, row + 3 * nx, (float)d->pivot, d->nx, out);
        for (long i = 0; i < d->nx; i++)
            if (bad || !(fabsf(out[i]) <= FLT_MAX))
                out[i] = block_mean(row + i * B, rms ? rms + i * B : NULL, nx, d->pivot);
    }
    free(row);
    return OK;
}

/* Mean of 3 x 3 blocks; the border is repeated. NaN next to a bad block. */
static float smoothed(const struct darksky *d, long i, long j)
{
    float sum = 0;
    for (long v = j - 1; v <= j + 1; v++) {
        const float *row = d->mean + (v < 0 ? 0 : v < d->ny ? v : d->ny - 1) * d->nx;
        sum += row[i > 0 ? i - 1 : 0] + row[i] + row[i + 1 < d->nx ? i + 1 : i];
    }
    return sum / 9;
}

struct sums {
    double n, s;               /* blocks within reach: number, sum of their means */
    double low, low2;          /* smoothed values below the centre, within reach: number, sum of squares */
};

/* The sums over n blocks (a multiple of LANES). wide: reach for the width. */
WIDE static void add_up(const float *mean, const float *smooth, long n, float centre, float reach, float wide,
                        struct sums *out)
{
    double c[LANES] = {0}, s[LANES] = {0}, l[LANES] = {0}, q[LANES] = {0};
    for (long i = 0; i < n; i += LANES)
        for (int j = 0; j < LANES; j++) {
            float d = smooth[i + j] - centre;
            int in = fabsf(d) <= reach, low = (d < 0) & (d >= -wide);
            c[j] += in ? 1.0 : 0.0;
            s[j] += in ? (double)mean[i + j] : 0.0;
            l[j] += low ? 1.0 : 0.0;
            q[j] += low ? (double)d * (double)d : 0.0;
        }
    *out = (struct sums){0};
    for (int j = 0; j < LANES; j++) {
        out->n += c[j];
        out->s += s[j];
        out->low += l[j];
        out->low2 += q[j];
    }
}

/* Clipping as darksky.h says; m blocks, padded with NaN to a multiple of LANES. */
static void settle(const float *mean, const float *smooth, long m, double pivot, double sigma, double *level)
{
    double least = sigma / (3 * B), width = 3 * least, centre = *level - pivot;    /* the start may be wrong by half a sigma */
    struct sums t = {0};
    for (int pass = 0; pass < PASSES; pass++) {
        add_up(mean, smooth, (m + LANES - 1) / LANES * LANES, (float)centre, (float)(CUT * width), (float)(3 * width), &t);
        if (!(t.n >= LEAST && t.n * 4 >= (double)m))
            break;
        double next = t.s / t.n, wide = t.low > 0 ? sqrt(t.low2 / t.low) : 0;
        wide = wide > least ? wide : least;
        int done = fabs(next - centre) < 2e-3 * sigma && fabs(wide - width) < 0.05 * width;
        centre = next;
        width = wide;
        if (done)
            break;
    }
    if (t.n >= LEAST && t.n * 4 >= (double)m && fabs(centre - (*level - pivot)) < sigma)
        *level = pivot + centre;
}

int darksky_level(const struct darksky *d, long x0, long x1, long y0, long y1, double sigma, double *level)
{
    long a = (x0 + B - 1) / B, b = x1 / B, c = (y0 + B - 1) / B, e = y1 / B;
    b = b < d->nx ? b : d->nx;
    e = e < d->ny ? e : d->ny;
    if (b <= a || e <= c || (b - a) * (e - c) < LEAST || !(sigma > 0))
        return OK;
    size_t n = (size_t)(b - a) * (size_t)(e - c), room = n + LANES;
    float *mean = malloc(2 * room * sizeof *mean), *smooth = mean ? mean + room : NULL;
    if (!mean)
        return E_NOMEM;
    size_t k = 0, good = 0;
    for (long j = c; j < e; j++)
        for (long i = a; i < b; i++, k++) {
            mean[k] = d->mean[j * d->nx + i];
            smooth[k] = smoothed(d, i, j);
            good += fabsf(smooth[k]) <= FLT_MAX;
        }
    for (; k < room; k++)
        mean[k] = smooth[k] = NAN;
    if (good >= LEAST && good * 4 >= n)
        settle(mean, smooth, (long)n, d->pivot, sigma, level);
    free(mean);
    return OK;
}
