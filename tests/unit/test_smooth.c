/* The separable filter against a direct two-dimensional sum, and its noise factor. */
#include "check.h"
#include "rng.h"
#include "smooth.h"
#include <stdlib.h>

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

int main(void)
{
    against_direct_sum(0);
    against_direct_sum(1.5);
    against_direct_sum(5);
    struct smooth s;
    check_that(smooth_new(&s, -1) == E_RANGE && smooth_new(&s, (double)NAN) == E_RANGE, "a width that is none is refused");
    return check_status();
}
