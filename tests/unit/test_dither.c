/*
 * test_dither.c - exposures against direct sums over every small pixel and
 * against closed-form integrals; the order of the phases; odd sizes.
 */
#include "check.h"
#include "dither.h"
#include "rng.h"
#include <stdlib.h>

/* Integral of exp(-(x^2+y^2)/2s^2) over a rectangle. */
static double gauss_box(double x0, double x1, double y0, double y1, double s)
{
    double t = s * sqrt(2);
    return M_PI / 2 * s * s * (erf(x1 / t) - erf(x0 / t)) * (erf(y1 / t) - erf(y0 / t));
}

static void sums(int n, long nx, long ny)
{
    float *h = malloc((size_t)(nx * ny) * sizeof *h), *out = malloc((size_t)nx * sizeof *out);
    double *work = malloc((size_t)nx * sizeof *work);
    if (!h || !out || !work)
        exit(1);
    const struct rng r = rng_stream(1, (uint32_t)n, RNG_TEST);
    for (long i = 0; i < nx * ny; i++)
        h[i] = (float)floor(1000 * rng_uniform(&r, (uint64_t)i, 0));
    char what[80];
    snprintf(what, sizeof what, "N = %d, %ld x %ld: direct sums", n, nx, ny);
    struct check c = check_begin(what);
    for (int e = 0; e < n * n; e++) {
        int a, b;
        dither_phase(e, n, &a, &b);
        for (long j = 0; j < dither_side(ny, n); j++) {
            dither_row(n, a, nx, dither_side(nx, n), h + (size_t)((n * j + b) * nx), 1, work, out);
            for (long i = 0; i < dither_side(nx, n); i++) {
                long sum = 0;
                for (int p = 0; p < n; p++)
                    for (int q = 0; q < n; q++)
                        sum += (long)h[(n * j + b + q) * nx + n * i + a + p];
                check_close(&c, (double)out[i], (double)sum, 1e-9);
            }
        }
    }
    check_end(&c);
    free(h);
    free(out);
    free(work);
}

static void integrals(void)
{
    enum { N = 2, NX = 41, NY = 37 };
    static float h[NX * NY], out[NX];
    static double work[NX];
    const double s = 5, cx = 19.3, cy = 17.8;
    for (int y = 0; y < NY; y++)
        for (int x = 0; x < NX; x++)
            h[y * NX + x] = (float)gauss_box(x - cx, x + 1 - cx, y - cy, y + 1 - cy, s);
    struct check c = check_begin("2 x 2 exposures of a Gaussian against integrals over the large pixels (float32 input)");
    for (int e = 0; e < N * N; e++) {
        int a, b;
        dither_phase(e, N, &a, &b);
        for (int j = 0; j < dither_side(NY, N); j++) {
            dither_row(N, a, NX, dither_side(NX, N), h + (N * j + b) * NX, 0.25, work, out);
            for (int i = 0; i < dither_side(NX, N); i++) {
                double x = N * i + a - cx, y = N * j + b - cy;
                check_close(&c, (double)out[i], gauss_box(x, x + N, y, y + N, s) / 4, 1.3e-7 * (double)out[i] + 1e-12);
            }
        }
    }
    check_end(&c);
}

static void order(void)
{
    static const int want[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    int good = 1;
    for (int e = 0; e < 4; e++) {
        int a, b;
        dither_phase(e, 2, &a, &b);
        good &= a == want[e][0] && b == want[e][1];
    }
    check_that(good, "N = 2: the paper's order");
    int seen[25] = {0}, steps = 0;
    for (int e = 0, la = 0, lb = -1; e < 25; e++) {
        int a, b;
        dither_phase(e, 5, &a, &b);
        seen[5 * b + a]++;
        steps += abs(a - la) + abs(b - lb) == 1;
        la = a;
        lb = b;
    }
    for (int i = 0; i < 25; i++)
        good &= seen[i] == 1;
    check_that(good && steps == 25, "N = 5: every phase once, one small pixel a step");
    check_that(dither_side(9, 2) == 4 && dither_side(8, 2) == 3 && dither_side(1, 2) == 0 && dither_side(2, 3) == 0
               && dither_side(5, 3) == 1 && dither_side(7, 1) == 7 && dither_side(0, 1) == 0,
               "sides: N n + N - 1 small pixels give n");
}

int main(void)
{
    order();
    sums(1, 5, 4);
    sums(2, 17, 23);
    sums(2, 18, 24);
    sums(3, 20, 31);
    sums(7, 48, 20);
    integrals();
    return check_status();
}
