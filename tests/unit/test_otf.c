/* test_otf.c - spline of a table, exact transform of samples, factors. */
#include "otf.h"
#include "check.h"
#include "random.h"
#include <stdlib.h>
#include <string.h>

/* a smooth, asymmetric transfer function: two Gaussians, one displaced */
static void smooth(double x, double y, double *re, double *im)
{
    double g = exp(-0.03 * (x * x + 1.3 * y * y)), phase = 0.4 * x - 0.25 * y;
    *re = g * (0.7 + 0.3 * cos(phase));
    *im = -0.3 * g * sin(phase);
}

/* error of the spline at random points for a table of spacing du */
static double spline_error(double du, struct check *nodes)
{
    int n = 2 * (int)(20 / du) + 1, h = n / 2, m = 60;
    double *re = malloc((size_t)n * (size_t)n * 8), *im = malloc((size_t)n * (size_t)n * 8), worst = 0;
    double ux[60], uy[60], *gr = malloc(3600 * 8), *gi = malloc(3600 * 8);
    struct otf t = {0};
    for (int y = 0; y < n; y++)
        for (int x = 0; x < n; x++)
            smooth((x - h) * du, (y - h) * du, &re[y * n + x], &im[y * n + x]);
    if (otf_tabulate(&t, n, du, h * du, re, im) != OK)
        return INFINITY;
    for (int i = 0; i < m; i++) {
        ux[i] = 15 * noise();
        uy[i] = 15 * noise();
    }
    if (otf_grid(&t, m, ux, m, uy, gr, gi) != OK)
        return INFINITY;
    for (int j = 0; j < m; j++)
        for (int i = 0; i < m; i++) {
            double a, b;
            smooth(ux[i], uy[j], &a, &b);
            worst = fmax(worst, fmax(fabs(gr[j * m + i] - a), fabs(gi[j * m + i] - b)));
        }
    for (int i = 0; i < m; i++) {
        ux[i] = (i - 30) * du;
        uy[i] = (29 - i) * du;
    }
    if (nodes && otf_grid(&t, m, ux, m, uy, gr, gi) == OK)
        for (int j = 0; j < m; j++)
            for (int i = 0; i < m; i++) {
                check_close(nodes, gr[j * m + i], re[(h + 29 - j) * n + h + i - 30], 1e-15);
                check_close(nodes, gi[j * m + i], im[(h + 29 - j) * n + h + i - 30], 1e-15);
            }
    otf_free(&t);
    free(re);
    free(im);
    free(gr);
    free(gi);
    return worst;
}

static void edges(void)
{
    double re[25], ux[] = {-3, -2.001, -2, -1, 0, 1, 2, 2.001, 3, NAN, INFINITY, -1e300}, out[144], im[144];
    struct otf t = {0};
    for (int i = 0; i < 25; i++)
        re[i] = 1 + i;
    check_that(otf_tabulate(&t, 5, 1, 2, re, NULL) == OK && otf_is_real(&t), "a real 5 x 5 table");
    check_that(otf_grid(&t, 12, ux, 12, ux, out, im) == OK, "points at, beyond and far beyond the edge");
    struct check c = check_begin("zero beyond the cut-off, nodes inside, imaginary part 0");
    for (int j = 0; j < 12; j++)
        for (int i = 0; i < 12; i++) {
            int in = i >= 2 && i <= 6 && j >= 2 && j <= 6;
            check_close(&c, out[j * 12 + i], in ? re[5 * (j - 2) + i - 2] : 0, 4e-15);
            check_close(&c, im[j * 12 + i], 0, 1e-300);
        }
    check_end(&c);
    check_that(otf_grid(&t, 2, ux, 2, ux, out, NULL) == OK, "a real table needs no imaginary part");
    otf_free(&t);

    struct otf keep = {.n = 77};
    re[7] = NAN;
    check_that(otf_tabulate(&keep, 5, 1, 2, re, NULL) == E_RANGE && otf_tabulate(&keep, 4, 1, 2, re, NULL) == E_RANGE &&
                   otf_tabulate(&keep, 5, -1, 2, re, NULL) == E_RANGE &&
                   otf_tabulate(&keep, 5, 1, NAN, re, NULL) == E_RANGE && keep.n == 77,
               "NaN samples, even side, bad spacing are refused and leave the table alone");
    check_that(otf_sample(&keep, 5, 5, re, 1, 2, 2, 0.5) == E_RANGE && otf_sample(&keep, 5, 1, re, 0, 2, 2, 0.5) == E_RANGE &&
                   keep.n == 77,
               "NaN or unscaled PSF samples too");
    struct otf empty = {0};
    check_that(otf_grid(&empty, 1, ux, 1, ux, out, im) == E_RANGE, "an empty transfer function has no values");
    double one = 3;
    check_that(otf_tabulate(&t, 1, 0.1, 5, &one, NULL) == OK && otf_grid(&t, 1, ux + 4, 1, ux + 4, out, NULL) == OK &&
                   fabs(out[0] - 3) < 1e-15,
               "a table of one point");
    otf_free(&t);
}

/* both ways of transforming samples against the sum */
static void samples(int nx_p, int ny_p, int n, double du, int is_regular)
{
    double scale = 0.013, cx = (nx_p - 1) / 2. + 0.21, cy = 3.4, total = 0, ucut = 9;
    double *p = malloc((size_t)(nx_p * ny_p) * 8), *u = malloc((size_t)n * 8), *v = malloc((size_t)n * 8);
    double *re = malloc((size_t)(n * n) * 8), *im = malloc((size_t)(n * n) * 8);
    struct otf t = {0};
    char what[96];
    for (int i = 0; i < nx_p * ny_p; i++) {
        p[i] = noise();
        total += fabs(p[i]);
    }
    for (int i = 0; i < n; i++) {
        u[i] = (i - n / 2) * du;
        v[i] = is_regular ? (i - n / 3) * du * 0.7 : noise() * 10;
    }
    check_that(otf_sample(&t, nx_p, ny_p, p, scale, cx, cy, ucut) == OK && !otf_is_real(&t), "samples %d x %d", nx_p, ny_p);
    check_that(otf_grid(&t, n, u, n, v, re, NULL) == E_RANGE, "samples have an imaginary part");
    check_that(otf_grid(&t, n, u, n, v, re, im) == OK, "transform on %d x %d points", n, n);
    snprintf(what, sizeof what, "%s against the sum, 3e-16 of sum|p|", is_regular ? "regular axes" : "any axes");
    struct check c = check_begin(what);
    for (int k = 0; k < n * n; k += 1 + n * n / 400) {
        double a = 0, b = 0, ux = u[k % n], uy = v[k / n];
        for (int i = 0; i < nx_p * ny_p; i++) {
            double turn = remainder(((i % nx_p - cx) * ux + (i / nx_p - cy) * uy) * scale, 1);
            a += p[i] * cos(2 * M_PI * turn);
            b -= p[i] * sin(2 * M_PI * turn);
        }
        int in = fabs(ux) <= ucut && fabs(uy) <= ucut;
        check_close(&c, re[k], in ? a : 0, 3e-16 * total);
        check_close(&c, im[k], in ? b : 0, 3e-16 * total);
    }
    check_end(&c);
    otf_free(&t);
    free(p);
    free(u);
    free(v);
    free(re);
    free(im);
}

int main(void)
{
    struct check nodes = check_begin("spline goes through the nodes");
    double e1 = spline_error(0.5, &nodes), e2 = spline_error(0.25, &nodes), e4 = spline_error(0.125, NULL);
    check_end(&nodes);
    check_that(e4 < 6e-8, "spline error of a smooth function %.3g at du = 0.125", e4);
    check_that(e1 / e2 > 12 && e1 / e2 < 22 && e2 / e4 > 12 && e2 / e4 < 22,
               "spline converges as du^4: %.3g %.3g %.3g", e1, e2, e4);
    edges();
    samples(9, 7, 20, 0.41, 0);
    samples(301, 211, 120, 0.13, 1);
    samples(1, 8, 3, 4, 1);

    double u[] = {0, 1e-7, -2e-4, 0.5, -3, 10, 12.5, 700}, f[8], g[8], h[8];
    for (int i = 0; i < 8; i++)
        f[i] = g[i] = h[i] = 2;
    otf_diffusion(8, u, 0.04, f);
    otf_box(8, u, 0.1, g);
    otf_diffusion(8, u, 0, h);
    struct check c = check_begin("diffusion and pixel against long double");
    for (int i = 0; i < 8; i++) {
        long double x = 3.14159265358979323846264338L * (long double)u[i];
        check_close(&c, f[i], 2 * (double)expl(-2 * x * x * 0.04L * 0.04L), 1e-14);
        check_close(&c, g[i], x == 0 ? 2 : 2 * (double)(sinl(x * 0.1L) / (x * 0.1L)), 1e-15);
        check_close(&c, h[i], 2, 1e-300);
    }
    check_end(&c);
    return check_status();
}
