/* test_lanes.c - images from half planes, against the sum by definition and another transform. */
#include "check.h"
#include "fft.h"
#include "lanes.h"
#include "rng.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static double uniform(int i, int k)
{
    const struct rng r = rng_stream(9, 0, RNG_TEST);
    return rng_uniform(&r, (uint64_t)i, (uint32_t)k) - 0.5;
}

/* Largest difference of lanes_run_single from `want`, the same half plane in double. */
static double single_error(const struct lanes *p, int n, int m, int from, const double *re, const double *im, const double *want)
{
    const int ld = (n / 2 + 16) / 16 * 16;
    const size_t rows = (size_t)n;
    float *a = malloc(2 * rows * (size_t)ld * sizeof *a), *b = a + rows * (size_t)ld, *got = malloc(rows * rows * sizeof *got);
    float *scratch = malloc(2 * lanes_scratch(p) * sizeof *scratch);
    double worst = 0;
    for (size_t y = 0; y < rows; y++)
        for (int k = 0; k < ld; k++) {
            a[y * (size_t)ld + (size_t)k] = k < from ? (float)re[y * (size_t)from + (size_t)k] : 3;
            b[y * (size_t)ld + (size_t)k] = k < from ? (float)im[y * (size_t)from + (size_t)k] : 3;
        }
    lanes_run_single(p, m, a, b, ld, scratch, got);
    for (size_t i = 0; i < rows * rows; i++)
        worst = got[i] == got[i] ? fmax(worst, fabs((double)got[i] - want[i])) : NAN;
    free(a), free(got), free(scratch);
    return worst;
}

/* Largest difference from fft_plan_c2r over n times the rms sum, columns 0..m-1 filled. */
static double error_of(int n, int m, double *single)
{
    const int h = n / 2, ld = (h + 8) / 8 * 8;
    const size_t rows = (size_t)n;
    struct lanes *p;
    struct fft *f;
    if (lanes_new(&p, n) || fft_plan_c2r(&f, n, n))
        return NAN;
    double *re = malloc(2 * rows * (size_t)ld * sizeof *re), *im = re + rows * (size_t)ld;
    double *x = calloc(rows * rows, sizeof *x), *scratch = malloc(lanes_scratch(p) * sizeof *scratch);
    double *full = fft_alloc(rows * 2 * ((size_t)h + 1) * sizeof *full), *want = fft_alloc(rows * rows * sizeof *want);
    double *got = malloc(rows * rows * sizeof *got), worst = 0, norm = 0;
    memset(full, 0, rows * 2 * ((size_t)h + 1) * sizeof *full);
    for (int y = 0; y < n; y++)
        for (int k = 0; k < ld; k++) {
            const size_t i = (size_t)(y * ld + k);
            /* columns 0 and h must be those of a real image: even re, odd im */
            int other = (n - y) % n, own = k == 0 || k == h;
            double a = uniform(y * ld + k, 0), b = uniform(y * ld + k, 1);
            if (own) {
                a += uniform(other * ld + k, 0);
                b -= uniform(other * ld + k, 1);
            }
            re[i] = a, im[i] = b;
            if (k <= h && k < m) {
                full[2 * (y * (h + 1) + k)] = a;
                full[2 * (y * (h + 1) + k) + 1] = b;
                norm += a * a + b * b;
            }
        }
    fft_run(f, full, want);
    *single = single_error(p, n, m, ld, re, im, want) / sqrt(norm);
    lanes_run(p, m, re, im, ld, scratch, got);
    for (size_t i = 0; i < rows * rows; i++)
        worst = fmax(worst, fabs(got[i] - want[i]));
    for (size_t i = 0; i < rows * rows; i++)
        if (!(got[i] == got[i]))
            worst = NAN;
    free(re), free(x), free(scratch), free(got), fft_free(full), fft_free(want);
    lanes_free(p), fft_done(f);
    return worst / sqrt(norm);
}

/* One frequency is one wave, by definition. */
static void waves(void)
{
    enum { N = 60, LD = 32 };
    struct lanes *p;
    static double re[N * LD], im[N * LD], out[N * N];
    if (!check_that(lanes_new(&p, N) == OK, "a plan for 60"))
        return;
    double *scratch = malloc(lanes_scratch(p) * sizeof *scratch);
    struct check c = check_begin("waves of 60 x 60 pixels");
    for (int k = 0; k < 30; k += 7)
        for (int v = 0; v < N; v += 11) {
            memset(re, 0, sizeof re);
            memset(im, 0, sizeof im);
            re[v * LD + k] = 1;
            if (k == 0)
                re[(N - v) % N * LD] = 1;
            lanes_run(p, 31, re, im, LD, scratch, out);
            for (int y = 0; y < N; y++)
                for (int x = 0; x < N; x++)
                    check_close(&c, out[y * N + x], (k == 0 && v == 0 ? 1 : 2) * cos(2 * M_PI * ((k * x + v * y) % N) / N), 1e-14);
        }
    check_end(&c);
    free(scratch);
    lanes_free(p);
}

int main(void)
{
    static const int side[] = {2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 30, 32, 34, 40, 46, 48, 50, 64, 72, 80, 90, 94, 96, 98,
                               120, 128, 144, 160, 180, 200, 216, 240, 242, 256, 360};
    double one = 0, worst = 0;
    struct check c = check_begin("sides 2 to 360, also with prime factors up to 47, and with empty columns");
    for (size_t i = 0; i < sizeof side / sizeof *side; i++)
        for (int cut = 0; cut < 3; cut++) {
            const int h = side[i] / 2;
            check_close(&c, error_of(side[i], cut == 0 ? h + 1 : cut == 1 ? 1 : (h + 2) / 2, &one), 0, 1e-14);
            worst = one > worst || !(one == one) ? one : worst;
        }
    check_end(&c);
    check_that(worst < 2e-6, "the same in single precision: largest error %.2g of the rms sum", worst);
    waves();
    struct lanes *p = NULL;
    check_that(lanes_new(&p, 0) == E_RANGE && lanes_new(&p, 7) == E_RANGE && lanes_new(&p, 8194) == E_RANGE && !p,
               "odd, empty and huge sides are refused");
    return check_status();
}
