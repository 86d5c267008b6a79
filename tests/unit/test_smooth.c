/* Filters against a direct two-dimensional sum, and their noise factors. */
#include "check.h"
#include "segment.h"
#include "tiles.h"
#include "rng.h"
#include "smooth.h"
#include <stdlib.h>
#include <string.h>

static void against_direct_sum(double fwhm)
{
    enum { NX = 1100, NY = 21 };
    struct smooth s;
    if (smooth_new(&s, fwhm)) {
        check_that(0, "smooth_new(%g)", fwhm);
        return;
    }
    int r = s.radius;
    float *im = calloc((size_t)(NX + 2 * r) * NY, sizeof *im), *across = malloc(sizeof(float) * NX * NY), out[NX];
    struct rng g = rng_stream(1, 0, RNG_TEST);
    long w = NX + 2 * r;
    for (long y = 0; y < NY; y++)
        for (long x = 0; x < NX; x++)
            im[y * w + r + x] = (float)rng_normal(&g, (uint64_t)(y * NX + x), 0);
    for (long y = 0; y < NY; y++)
        smooth_row(&s, im + y * w + r, NX, across + y * NX);
    double sigma = fwhm / sqrt(8 * log(2)), sum = 0;
    for (int j = -r; j <= r; j++)
        for (int i = -r; i <= r; i++)
            sum += fwhm > 0 ? exp(-0.5 * (i * i + j * j) / (sigma * sigma)) : 1;
    struct check c = check_begin("filtered row against the double sum");
    const float *row[64];
    long y = NY / 2;
    for (int j = -r; j <= r; j++)
        row[j + r] = across + (y + j) * NX;
    smooth_column(&s, row, NX, out);
    for (long x = 0; x < NX; x += 7) {
        double want = 0;
        for (int j = -r; j <= r; j++)
            for (int i = -r; i <= r; i++)
                want += (fwhm > 0 ? exp(-0.5 * (i * i + j * j) / (sigma * sigma)) / sum : 1) * (double)im[(y + j) * w + r + x + i];
        check_close(&c, (double)out[x], want, 5e-7);    /* float sums of values of order 1 */
    }
    check_end(&c);
    double q = 0;
    for (int j = -r; j <= r; j++)
        for (int i = -r; i <= r; i++)
            q += pow(fwhm > 0 ? exp(-0.5 * (i * i + j * j) / (sigma * sigma)) / sum : 1, 2);
    struct check n = check_begin("noise factor");
    check_close(&n, smooth_noise(&s), sqrt(q), 1e-7);   /* kernel values are float32 */
    check_end(&n);
    free(im);
    free(across);
    smooth_free(&s);
}

/* ---- any kernel ---- */

/* Kernels whose values say which way they must go. */
enum shape { OUTER, RANDOM, ALONE };

static struct kernel made(long nx, long ny, enum shape shape, uint64_t seed)
{
    struct kernel k = {nx, ny, calloc((size_t)(nx * ny), sizeof *k.v)};
    struct rng g = rng_stream(seed, 1, RNG_TEST);
    for (long j = 0; k.v && j < ny; j++)
        for (long i = 0; i < nx; i++) {
            double product = rng_normal(&g, (uint64_t)i, 0) * rng_normal(&g, (uint64_t)j, 2);
            k.v[j * nx + i] = shape == OUTER ? (double)(float)product : shape == RANDOM ? rng_normal(&g, (uint64_t)(j * nx + i), 4)
                              : i == nx - 1 && j == 0 ? -2 : 0;
        }
    return k;
}

/* The definition. */
static double filtered(const struct image *im, const struct kernel *k, long x, long y)
{
    double sum = 0;
    for (long j = 0; j < k->ny; j++)
        for (long i = 0; i < k->nx; i++) {
            long u = x + i - k->nx / 2, v = y + j - k->ny / 2;
            if (u >= 0 && v >= 0 && u < im->nx && v < im->ny)
                sum += k->v[j * k->nx + i] * (double)im->pix[v * im->nx + u];
        }
    return sum;
}

static struct image noise_image(long nx, long ny)
{
    struct image im = {0};
    struct rng g = rng_stream(7, 0, RNG_TEST);
    if (image_new(&im, nx, ny) == OK)
        for (uint64_t i = 0; i < (uint64_t)(nx * ny); i++)
            im.pix[i] = (float)rng_normal(&g, i, 0);
    return im;
}

static struct background flat(long nx, long ny, double node[2])
{
    struct background b = {0};
    node[0] = 0;
    node[1] = 0;
    b.level = (struct mesh){nx, ny, 1, 1, 0, node, NULL, NULL};
    b.rms = (struct mesh){nx, ny, 1, 1, 1, node + 1, NULL, NULL};
    return b;
}

/* A kernel of kx x ky on an image of nx x ny, by the program's way through rows, at every 7th pixel. */
static void kernel_sum(long kx, long ky, enum shape shape, long nx, long ny, enum smooth_way way)
{
    struct kernel k = made(kx, ky, shape, (uint64_t)(100 * kx + ky));
    struct image im = noise_image(nx, ny);
    const struct pixels pix = pixels_of(&im);
    struct smooth s = {0};
    double node[2];
    struct background b = flat(nx, ny, node);
    float *out = malloc((size_t)(nx * ny) * sizeof *out), *row = malloc((size_t)nx * sizeof *row);
    int st = smooth_kernel(&s, &k, nx, ny);
    check_that(st == OK && s.way == way, "%ld x %ld for %ld x %ld pixels: way %d", kx, ky, nx, ny, (int)s.way);
    if (st == OK && segment_filtered(&pix, &b, NULL, &s, 0, 0, ny, out) == OK) {
        struct check c = check_begin("rows against the sum over the kernel"), n = check_begin("noise factor");
        double sum = 0;
        for (long i = 0; i < kx * ky; i++)
            sum += k.v[i] * k.v[i];
        check_close(&n, smooth_noise(&s), sqrt(sum), 1e-12 * sqrt(sum));
        /* each of the terms is rounded to float, some 6 sigma of them all */
        double tol = 6e-8 * 6 * sqrt(sum) * (way == SMOOTH_TILES ? 3 : 2 + sqrt((double)(kx * ky)));
        for (long i = 0; i < nx * ny; i += nx * ny > 400 ? 7 : 1)
            check_close(&c, (double)out[i], filtered(&im, &k, i % nx, i / nx), tol);
        check_end(&c);
        check_end(&n);
        int same = 1;
        for (long y = 0; y < ny; y += 13)
            same &= segment_filtered(&pix, &b, NULL, &s, 0, y, 1, row) == OK && !memcmp(row, out + y * nx, (size_t)nx * sizeof *row);
        check_that(same, "single rows have the same bits");
    }
    free(out);
    free(row);
    free(k.v);
    smooth_free(&s);
    image_free(&im);
}

/* What a pixel gets does not depend on the image's other side, and large values stay where they are. */
static void tiles_alone(void)
{
    enum { R = 12, C = 20, SIDE = 2 * C + 1, NX = 700 };
    static double w[(2 * R + 1) * SIDE];
    static float in[TILES_TALL + 2 * R][NX + 2 * C], out[TILES_TALL * NX], again[TILES_TALL * 300];
    struct rng g = rng_stream(11, 0, RNG_TEST);
    for (uint64_t i = 0; i < sizeof w / sizeof *w; i++)
        w[i] = rng_normal(&g, i, 0);
    for (uint64_t i = 0; i < sizeof in / sizeof **in; i++)
        ((float *)in)[i] = (float)rng_normal(&g, i, 2);
    const float *row[TILES_TALL + 2 * R];
    for (int j = 0; j < TILES_TALL + 2 * R; j++)
        row[j] = j == 5 ? NULL : in[j] + C;
    memset(in[5], 0, sizeof in[5]);
    struct tiles *t;
    if (tiles_new(&t, w, R, C)) {
        check_that(0, "tiles_new");
        return;
    }
    double *scratch = calloc(tiles_room(t) + 8, sizeof *scratch), *aligned = scratch + (8 - (uintptr_t)scratch / 8 % 8) % 8;
    tiles_filter(t, row, NX, aligned, out);
    struct check c = check_begin("tiles against the sum");
    for (long y = 0; y < TILES_TALL; y += 3)
        for (long x = 0; x < NX; x += 5) {
            double sum = 0;
            for (long j = 0; j <= 2 * R; j++)
                for (long i = 0; i < SIDE; i++)
                    sum += w[j * SIDE + i] * (double)in[y + j][x + i];
            check_close(&c, (double)out[y * NX + x], sum, 1e-5);    /* rounding of values of 100 to float */
        }
    check_end(&c);
    tiles_filter(t, row, 300, aligned, again);
    int same = 1;
    for (long y = 0; y < TILES_TALL; y++)
        same &= !memcmp(out + y * NX, again + y * 300, 100 * sizeof *out);
    check_that(same, "a narrower piece of the same sky has the same bits where its tiles are the same");
    free(scratch);
    tiles_free(t);
    check_that(tiles_new(&t, w, 1 << 20, 1 << 29) == E_RANGE, "a kernel of 2^30 columns is refused");
}

static void kernels(void)
{
    kernel_sum(1, 1, RANDOM, 40, 30, SMOOTH_PRODUCT);
    kernel_sum(5, 5, OUTER, 100, 90, SMOOTH_PRODUCT);
    kernel_sum(4, 9, OUTER, 100, 300, SMOOTH_PRODUCT);
    kernel_sum(1, 8, RANDOM, 70, 60, SMOOTH_PRODUCT);
    kernel_sum(3, 3, RANDOM, 65, 64, SMOOTH_WHOLE);
    kernel_sum(6, 4, RANDOM, 65, 140, SMOOTH_WHOLE);
    kernel_sum(7, 7, ALONE, 50, 50, SMOOTH_PRODUCT);
    kernel_sum(31, 24, RANDOM, 300, 290, SMOOTH_TILES);
    kernel_sum(24, 31, RANDOM, 129, 127, SMOOTH_TILES);
    kernel_sum(60, 90, RANDOM, 9, 7, SMOOTH_WHOLE);
    kernel_sum(60, 90, RANDOM, 40, 30, SMOOTH_TILES);
    kernel_sum(9, 9, RANDOM, 3, 2, SMOOTH_WHOLE);
    kernel_sum(9, 9, RANDOM, 1, 1, SMOOTH_PRODUCT);
    kernel_sum(151, 1, OUTER, 500, 9, SMOOTH_PRODUCT);
    kernel_sum(1, 601, OUTER, 30, 500, SMOOTH_PRODUCT);
    kernel_sum(301, 1, OUTER, 500, 9, SMOOTH_TILES);
}

static void refused(void)
{
    double v[4] = {0};
    struct kernel k = {2, 2, v};
    struct smooth s = {0};
    check_that(smooth_kernel(&s, &k, 9, 9) == E_DATA, "a kernel of zeros is refused");
    v[2] = NAN;
    v[1] = 1;
    check_that(smooth_kernel(&s, &k, 9, 9) == E_DATA, "one with a NaN");
    v[2] = 1e21;
    check_that(smooth_kernel(&s, &k, 9, 9) == E_DATA, "one beyond 1e20");
    v[2] = 1;
    k.nx = 0;
    check_that(smooth_kernel(&s, &k, 9, 9) == E_RANGE && !s.k, "one without columns; nothing is left");
}

int main(void)
{
    against_direct_sum(0);
    against_direct_sum(1.5);
    against_direct_sum(5);
    struct smooth s;
    check_that(smooth_new(&s, -1) == E_RANGE && smooth_new(&s, (double)NAN) == E_RANGE, "a width that is none is refused");
    kernels();
    tiles_alone();
    refused();
    return check_status();
}
