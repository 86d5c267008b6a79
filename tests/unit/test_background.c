/* Clipped statistics on known distributions; cells, spline and bad pixels. */
#include "background.h"
#include "check.h"
#include "rng.h"
#include <stdlib.h>
#include <string.h>

static double draw(uint64_t i)
{
    struct rng g = rng_stream(11, 0, RNG_TEST);
    return rng_normal(&g, i, 0);
}

/* Poisson by inversion of one uniform: the slow sum. */
static double poisson(double mean, uint64_t i)
{
    struct rng g = rng_stream(12, 0, RNG_TEST);
    double u = rng_uniform(&g, i, 0), p = exp(-mean), sum = p, k = 0;
    while (sum < u && k < 10 * mean + 100) {
        k++;
        p *= mean / k;
        sum += p;
    }
    return k;
}

/* Mean error of the level over many cells of 64 x 64, in units of the rms, and of the rms. */
static void cells_of(const char *what, double mean, double sigma, int integers, double gain, double removed, double tol)
{
    enum { CELLS = 300, N = 4096 };
    static float v[N];
    double bias = 0, ratio = 0;
    for (int c = 0; c < CELLS; c++) {
        double level, s;
        for (int i = 0; i < N; i++) {
            uint64_t k = (uint64_t)c * N + (uint64_t)i;
            v[i] = integers ? (float)(poisson(mean, k) - removed) : (float)(mean + sigma * draw(k));
        }
        background_clip(v, N, gain, removed, &level, &s);
        bias += (level + removed - mean) / sigma / CELLS;
        ratio += s / sigma / CELLS;
    }
    /* error of 300 means of 2.5 median - 1.5 mean of 4096: 1.9 sigma / sqrt(4096 * 300) = 0.0017 */
    check_that(fabs(bias) < tol && fabs(ratio - 0.987) < 0.02, "%s: bias %+.4f sigma, rms %.4f of the true one",
               what, bias, ratio);
}

/* Natural spline through the cell centres must return a plane. */
static void plane(long nx, long ny, long cell)
{
    struct image im = {0};
    if (image_new(&im, nx, ny)) {
        check_that(0, "image_new");
        return;
    }
    for (long y = 0; y < ny; y++)
        for (long x = 0; x < nx; x++)
            im.pix[y * nx + x] = (float)(1000 + 0.01 * (double)x - 0.02 * (double)y + draw((uint64_t)(y * nx + x)));
    struct background b;
    struct background_params p = {cell, 3, 0, 0, NULL, 0};
    const struct pixels pix = pixels_of(&im);
    int st = background_measure(&b, &pix, NULL, &p);
    if (!check_that(st == OK, "background of %ld x %ld in cells of %ld", nx, ny, cell))
        return;
    double worst = 0;
    for (long y = 0; st == OK && y < ny; y += 3)
        for (long x = 0; x < nx; x += 3)
            worst = fmax(worst, fabs(mesh_at(&b.level, x, y) - (1000 + 0.01 * (double)x - 0.02 * (double)y)));
    /* four sigma of a node's error 1.9 / sqrt(pixels), times 2.5 at an extrapolated corner; one cell in a row knows no slope */
    double cells = (double)(b.level.mx * b.level.my), tol = 4 * 1.9 * sqrt(cells / (double)(nx * ny)) * (cells > 1 ? 2.5 : 1);
    tol += (b.level.mx == 1 ? 0.005 * (double)nx : 0) + (b.level.my == 1 ? 0.01 * (double)ny : 0);
    check_that(worst < tol, "plane: worst %.4f of %.4f", worst, tol);
    float *row = malloc((size_t)nx * sizeof *row), *part = malloc((size_t)nx * sizeof *part);
    int same = 1;
    for (long y = 0; y < ny; y += 7) {
        mesh_row(&b.level, y, 0, nx, row);
        for (long x = 0; x < nx; x += 11) {
            long n = nx - x < 37 ? nx - x : 37;
            mesh_row(&b.level, y, x, n, part);
            same &= memcmp(row + x, part, (size_t)n * sizeof *row) == 0;
        }
    }
    check_that(same, "a piece of a row has the bits of the whole row");
    free(row);
    free(part);
    background_free(&b);
    image_free(&im);
}

static void bad_pixels(void)
{
    struct image im = {0};
    struct background a, b;
    struct par_team *team = par_team_new(2);
    struct background_params p = {32, 3, 0, 0, NULL, 0}, p2 = {32, 3, 0, 0, team, 0};
    if (image_new(&im, 200, 200))
        return;
    const struct pixels pix = pixels_of(&im);
    for (long i = 0; i < 40000; i++)
        im.pix[i] = (float)(5 + draw((uint64_t)i));
    for (long y = 0; y < 70; y++)
        for (long x = 0; x < 200; x++)
            im.pix[y * 200 + x] = x % 3 ? NAN : INFINITY;
    for (long y = 130; y < 200; y++)
        for (long x = 0; x < 200; x++)
            im.pix[y * 200 + x] = 0;
    check_that(background_measure(&a, &pix, NULL, &p) == OK, "bands of NaN and of exact zeros");
    check_that(background_measure(&b, &pix, NULL, &p2) == OK, "the same on two threads");
    par_team_free(team);
    struct check c = check_begin("level and rms where the image is blank or dead");
    for (long y = 0; y < 200; y += 9) {
        check_close(&c, mesh_at(&a.level, 100, y), 5, 0.25);   /* cells of 32: 0.06 sigma, extrapolated */
        check_close(&c, mesh_at(&a.rms, 100, y), 1, 0.2);
    }
    check_end(&c);
    check_that(memcmp(a.level.node, b.level.node, (size_t)(4 * a.level.mx * a.level.my) * sizeof(double)) == 0,
               "1 and 2 threads: same bits");
    background_free(&a);
    background_free(&b);
    for (long i = 0; i < 40000; i++)
        im.pix[i] = NAN;
    check_that(background_measure(&a, &pix, NULL, &p) == E_DATA, "all NaN is E_DATA");
    for (long i = 0; i < 40000; i++)
        im.pix[i] = 7;
    check_that(background_measure(&a, &pix, NULL, &p) == OK && a.mean_rms == 0 && a.mean_level == 7,
               "a constant image has its level and no noise");
    background_free(&a);
    image_free(&im);
}

static void scales(void)
{
    enum { N = 4096 };
    static float v[N];
    double l0, s0, l, s;
    struct check c = check_begin("values times 1e20 and 1e-20, pedestal 1e7");
    for (int i = 0; i < N; i++)
        v[i] = (float)draw((uint64_t)i);
    background_clip(v, N, 0, 0, &l0, &s0);
    for (int k = -1; k <= 1; k += 2) {
        double f = pow(10, 20 * k);
        for (int i = 0; i < N; i++)
            v[i] = (float)(f * draw((uint64_t)i));
        background_clip(v, N, 0, 0, &l, &s);
        check_close(&c, l / f, l0, 1e-3);      /* bins of 0.01 sigma may shift by rounding */
        check_close(&c, s / f, s0, 1e-3);
    }
    for (int i = 0; i < N; i++)
        v[i] = (float)(1e7 + 20 * draw((uint64_t)i));
    background_clip(v, N, 0, 0, &l, &s);
    check_close(&c, (l - 1e7) / 20, l0, 0.01); /* float32 steps of 1 there */
    check_close(&c, s / 20, s0, 0.005);
    check_end(&c);
    double m[7] = {5, 1, 4, 2, 3, 9, 0};
    check_that(background_median(m, 7) == 3 && background_median(m, 2) == 0.5 * (m[0] + m[1]), "medians of 7 and 2");
}

int main(void)
{
    cells_of("Gaussian noise", 0, 1, 0, 0, 0, 0.01);
    cells_of("Gaussian noise on a pedestal, gain given", 1000, 10, 0, 1, 0, 0.01);
    cells_of("Poisson 250, whole numbers, gain 1", 250, sqrt(250), 1, 1, 0, 0.02);
    cells_of("Poisson 40, whole numbers, gain 1", 40, sqrt(40), 1, 1, 0, 0.02);
    cells_of("Poisson 8, whole numbers, gain 1", 8, sqrt(8), 1, 1, 0, 0.02);
    cells_of("Poisson 40 with its sky subtracted", 40, sqrt(40), 1, 1, 40, 0.02);
    plane(512, 300, 64);
    plane(100, 64, 64);
    plane(7, 5, 64);
    bad_pixels();
    scales();
    return check_status();
}
