/*
 * refhard.c - naive against stable method for the parameters that are hard, and the
 * exactness of photon noise, against references that share no code with either.
 *
 *   refhard table               order of basis functions, pixel and distance over beta, shear: "what value naive stable"
 *   refhard poisson             mean, share of draws that differ from the exact quantile: float sum, double sum, ours
 *   refhard flat N VALUE OUT    N x N image of one value
 *   refhard chi2 MEAN IMAGE     z-score of chi-square of the pixels against the Poisson distribution
 *
 * Hermite functions: Cauchy's integral of their generating function on the saddle's circle, long
 * double.  Poisson: sums of exp(k log m - m - lgamma(k+1)) in long double.
 */
#include "err.h"
#include "load.h"
#include "poisson.h"
#include "shapelet.h"
#include "shear.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NODES = 160 };

static long double hermite(int n, long double x)
{
    const long double pi = acosl(-1), r = x * x > 2 * n ? (x - sqrtl(x * x - 2 * n)) / 2 : sqrtl(n / 2.0L);
    long double s = 0;
    if (n == 0)
        return expl(-x * x / 2) / sqrtl(sqrtl(pi));
    if (x < 0)
        return (n % 2 ? -1 : 1) * hermite(n, -x);
    for (int i = 0; i < NODES; i++) {
        const long double t = 2 * pi * i / NODES, c = r * cosl(t), d = r * sinl(t);
        s += expl(2 * x * c - (c * c - d * d) - x * x / 2 - r * r) * cosl(2 * x * d - 2 * c * d - n * t);
    }
    return s / NODES * expl(r * r - n * logl(r) + 0.5L * (lgammal(n + 1.0L) - n * logl(2) - 0.5L * logl(pi)));
}

/* phi_n from the coefficients of H_n, as a first program would do. */
static double monomials(int n, double x)
{
    double a[64] = {1}, b[64] = {0}, s = 0, norm = sqrt(sqrt(M_PI));
    for (int k = 1; k <= n; k++) {
        double c[64] = {0};
        for (int i = 0; i <= k; i++)
            c[i] = (i ? 2 * a[i - 1] : 0) - 2 * (k - 1) * b[i];
        memcpy(b, a, sizeof a);
        memcpy(a, c, sizeof c);
        norm *= sqrt(2.0 * k);
    }
    for (int i = n; i >= 0; i--)
        s = s * x + a[i];
    return s / norm * exp(-x * x / 2);
}

static void orders(void)
{
    const int list[] = {2, 5, 10, 15, 20, 30, 40, 50, 60};
    for (size_t k = 0; k < sizeof list / sizeof *list; k++) {
        double bad = 0, good = 0, b[61];
        for (int i = 0; i <= 90; i++) {
            const double x = 0.1 * i;
            const double want = (double)hermite(list[k], x);
            if (shapelet_basis(list[k], 1, 1, &x, b))
                exit(1);
            bad = fmax(bad, fabs(monomials(list[k], x) - want));
            good = fmax(good, fabs(b[list[k]] - want));
        }
        printf("order %d %.1e %.1e\n", list[k], bad, good);
    }
}

/* I_n over [a, a+h] by differences of erf and of the functions. */
static double pixel_naive(int n, double a, double h)
{
    const double b = a + h, root = M_SQRT1_2;
    double even = sqrt(sqrt(M_PI)) * root * (erf(b * root) - erf(a * root)), odd, fa[61], fb[61];
    if (shapelet_basis(n, 1, 1, &a, fa) || shapelet_basis(n, 1, 1, &b, fb))
        exit(1);
    odd = -M_SQRT2 * (fb[0] - fa[0]);
    for (int k = 2; k <= n; k++) {
        const double next = sqrt((k - 1.0) / k) * (k % 2 ? odd : even) - sqrt(2.0 / k) * (fb[k - 1] - fa[k - 1]);
        if (k % 2)
            odd = next;
        else
            even = next;
    }
    return n % 2 ? odd : even;
}

/* Largest error over the integral of |phi_n|, n = 0, 4, 8, 12, of the naive and of our integral over [a, a+h]. */
static void pixel_errors(double a, double h, double *bad, double *good)
{
    static const long double x[8] = {-0.96028985649753623168L, -0.79666647741362673959L, -0.52553240991632898582L, -0.18343464249564980494L,
                                     0.18343464249564980494L, 0.52553240991632898582L, 0.79666647741362673959L, 0.96028985649753623168L};
    static const long double w[8] = {0.10122853629037625915L, 0.22238103445337447054L, 0.31370664587788728734L, 0.36268378337836198297L,
                                     0.36268378337836198297L, 0.31370664587788728734L, 0.22238103445337447054L, 0.10122853629037625915L};
    const int parts = (int)ceil(h / 0.1);
    const double edge[2] = {a, a + h};
    double b[13];
    if (shapelet_pixel(12, 1, 1, edge, b))
        exit(1);
    for (int n = 0; n <= 12; n += 4) {
        long double s = 0, scale = 0;
        for (int p = 0; p < parts; p++)
            for (int g = 0; g < 8; g++) {
                const long double width = (long double)(edge[1] - edge[0]) / parts;
                const long double f = hermite(n, edge[0] + (p + 0.5L + x[g] / 2) * width) * w[g] * width / 2;
                s += f;
                scale += fabsl(f);
            }
        *bad = fmax(*bad, (double)(fabsl(pixel_naive(n, a, h) - s) / scale));
        *good = fmax(*good, (double)(fabsl(b[n] - s) / scale));
    }
}

/* Sizes of pixels within 4 beta of the centre; distances of pixels of 0.1 beta. */
static void pixels(void)
{
    const double sizes[] = {1e-4, 1e-3, 1e-2, 0.1, 0.5, 1, 2}, places[] = {0, 2, 4, 6, 8, 10, 12};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        double bad = 0, good = 0;
        for (int i = 0; i <= 16; i++)
            pixel_errors(0.25 * i, sizes[k], &bad, &good);
        printf("pixel/beta %g %.1e %.1e\n", sizes[k], bad, good);
    }
    for (size_t k = 0; k < sizeof places / sizeof *places; k++) {
        double bad = 0, good = 0;
        pixel_errors(places[k], 0.1, &bad, &good);
        printf("distance/beta %g %.1e %.1e\n", places[k], bad, good);
    }
}

/* Of an object of order 8: the series of order 4 with all its orders, and the map. */
static void shears(void)
{
    enum { N = 8, GRID = 13 };
    const double list[] = {0.01, 0.025, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9};
    double c[45] = {0}, grown[153];
    for (int i = 0; i < 45; i++)
        c[i] = cos(1.0 + 2.0 * i);
    for (size_t k = 0; k < sizeof list / sizeof *list; k++) {
        const double g1 = list[k] * 0.8, g2 = list[k] * 0.6;
        double a[4], bad = 0, good = 0, peak = 0, even, x, y;
        if (shear_matrix(-g1, -g2, a) || shear_series(N, c, g1, g2, 4, grown))
            exit(1);
        for (int i = 0; i < GRID * GRID; i++) {
            x = 1.17 * (i % GRID - GRID / 2);
            y = 1.21 * (i / GRID - GRID / 2);
            const double norm = 1 / sqrt(1 - list[k] * list[k]);
            const double u = norm * ((1 - g1) * x - g2 * y), v = norm * (-g2 * x + (1 + g1) * y);
            long double fx[N + 1], fy[N + 1], s = 0;
            for (int n = 0; n <= N; n++) {
                fx[n] = hermite(n, u);
                fy[n] = hermite(n, v);
            }
            for (int n = 0, at = 0; n <= N; n++)
                for (int n1 = 0; n1 <= n; n1++, at++)
                    s += c[at] * fx[n1] * fy[n - n1];
            if (shear_grid(N, 1, c, a, 1, &x, 1, &y, &even, NULL))
                exit(1);
            good = fmax(good, (double)fabsl(even - s));
            bad = fmax(bad, (double)fabsl(shapelet_value(N + 8, 1, grown, x, y) - s));
            peak = fmax(peak, (double)fabsl(s));
        }
        printf("shear %g %.1e %.1e\n", list[k], bad / peak, good / peak);
    }
}

static long double pmf(double mean, double k)
{
    return expl(k * logl(mean) - mean - lgammal(k + 1.0L));
}

static void poissons(void)
{
    enum { DRAWS = 20000 };
    const double list[] = {0.01, 0.5, 5, 30, 70, 90, 120, 428, 800, 5000, 1e5};
    for (size_t i = 0; i < sizeof list / sizeof *list; i++) {
        const double m = list[i], low = floor(fmax(0, m - 40 * sqrt(m) - 20));
        long wrong[3] = {0};
        float pf = expf(-(float)m), sf = pf;
        double pd = exp(-m), sd = pd, kf = 0, kd = 0, k = low;
        long double sum = pmf(m, k);
        for (int d = 0; d < DRAWS; d++) {          /* rising levels: each sum goes on where it was */
            const double u = (d + 0.5) / DRAWS, last = m + 40 * sqrt(m) + 40;
            for (; sum < u; sum += pmf(m, ++k)) { }
            for (; sf < (float)u && kf < last; sf += pf)
                pf *= (float)m / (float)++kf;
            for (; sd < u && kd < last; sd += pd)
                pd *= m / ++kd;
            wrong[0] += kf != k;
            wrong[1] += kd != k;
            wrong[2] += poisson_inverse(u, m) != k;
        }
        printf("mean %g %.1e %.1e %.1e\n", m, (double)wrong[0] / DRAWS, (double)wrong[1] / DRAWS, (double)wrong[2] / DRAWS);
    }
}

static void flat(const char *side, double value, const char *out)
{
    struct image im;
    struct err e;
    const long n = strtol(side, NULL, 10);
    if (n < 1 || image_new(&im, n, n))
        die(EXIT_RUN, "memory");
    for (size_t i = 0; i < image_count(&im); i++)
        im.pix[i] = (float)value;
    if (image_write(&im, out, "refhard", NULL, 0, &e))
        die(EXIT_RUN, "%s", e.text);
    image_free(&im);
}

static void chi2(double mean, const char *name)
{
    struct image im = load(name);
    const double n = (double)image_count(&im), m = (double)(float)mean, low = floor(fmax(0, m - 6 * sqrt(m))), high = m + 6 * sqrt(m) + 10;
    const size_t cells = (size_t)(high - low) + 2;
    double *seen = calloc(cells, sizeof *seen), sum = 0, want = 0, have = 0, bins = 0;
    if (!seen)
        die(EXIT_RUN, "memory");
    for (size_t i = 0; i < image_count(&im); i++) {
        const double at = fmin(fmax((double)im.pix[i] - low, 0), (double)cells - 1);
        seen[(size_t)at]++;
    }
    for (size_t k = 0; k < cells; k++) {           /* cells of at least 20 */
        want += n * (double)pmf(m, low + (double)k);
        have += seen[k];
        if (want >= 20) {
            sum += (have - want) * (have - want) / want;
            bins++;
            want = have = 0;
        }
    }
    const double dof = fmax(bins - 1, 1);
    printf("%.2f %.0f\n", bins > 1 ? (sum - dof) / sqrt(2 * dof) : 0, bins);
    free(seen);
    image_free(&im);
}

int main(int argc, char **argv)
{
    if (argc == 2 && !strcmp(argv[1], "table")) {
        orders();
        pixels();
        shears();
    } else if (argc == 2 && !strcmp(argv[1], "poisson")) {
        poissons();
    } else if (argc == 5 && !strcmp(argv[1], "flat")) {
        flat(argv[2], strtod(argv[3], NULL), argv[4]);
    } else if (argc == 4 && !strcmp(argv[1], "chi2")) {
        chi2(strtod(argv[2], NULL), argv[3]);
    } else {
        die(EXIT_USAGE, "usage: refhard table | poisson | flat N VALUE OUT | chi2 MEAN IMAGE");
    }
    return 0;
}
