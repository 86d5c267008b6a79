/* test_fft.c - transforms against their defining sums; sizes; zoom. */
#include "fft.h"
#include "check.h"
#include "random.h"
#include <stdlib.h>
#include <string.h>

/* sum over a real image, at frequency (ky, kx), sign of the exponent */
static void direct(int ny, int nx, const double *re, const double *im, double ky, double kx, int sign,
                   double *sre, double *sim)
{
    long double a = 0, b = 0;
    for (int y = 0; y < ny; y++)
        for (int x = 0; x < nx; x++) {
            double t = sign * 2 * M_PI * remainder(ky * y / ny + kx * x / nx, 1);
            double r = re[y * nx + x], i = im ? im[y * nx + x] : 0;
            a += r * cos(t) - i * sin(t);
            b += r * sin(t) + i * cos(t);
        }
    *sre = (double)a;
    *sim = (double)b;
}

static void plain(int ny, int nx)
{
    int h = nx / 2 + 1;
    size_t n = (size_t)ny * (size_t)nx, nh = (size_t)ny * (size_t)h;
    double *re = fft_alloc(n * 8), *im = fft_alloc(n * 8), *half = fft_alloc(nh * 16), *back = fft_alloc(n * 8),
           *full = fft_alloc(n * 16);
    struct fft *r2c = NULL, *c2r = NULL, *fwd = NULL, *bwd = NULL;
    char what[80];
    for (size_t i = 0; i < n; i++) {
        full[2 * i] = re[i] = noise();
        full[2 * i + 1] = im[i] = noise();
    }
    int bad = fft_plan_r2c(&r2c, ny, nx) | fft_plan_c2r(&c2r, ny, nx) | fft_plan_c2c(&fwd, ny, nx, -1) |
              fft_plan_c2c(&bwd, ny, nx, +1);
    check_that(!bad, "plans of %d x %d", ny, nx);
    fft_run(r2c, re, half);
    fft_run(fwd, full, full);
    snprintf(what, sizeof what, "r2c and c2c of %d x %d against sums", ny, nx);
    struct check c = check_begin(what);
    for (int ky = 0; ky < ny; ky++)
        for (int kx = 0; kx < nx; kx++) {
            double a, b;
            if (kx < h) {
                direct(ny, nx, re, NULL, ky, kx, -1, &a, &b);
                check_close(&c, half[2 * (ky * h + kx)], a, 1e-15 * (double)n);
                check_close(&c, half[2 * (ky * h + kx) + 1], b, 1e-15 * (double)n);
            }
            direct(ny, nx, re, im, ky, kx, -1, &a, &b);
            check_close(&c, full[2 * (ky * nx + kx)], a, 1e-15 * (double)n);
            check_close(&c, full[2 * (ky * nx + kx) + 1], b, 1e-15 * (double)n);
        }
    check_end(&c);
    fft_run(c2r, half, back);
    fft_run(bwd, full, full);
    c = check_begin("and back");
    for (size_t i = 0; i < n; i++) {
        check_close(&c, back[i] / (double)n, re[i], 1e-16 * (double)(nx + ny + 8));
        check_close(&c, full[2 * i] / (double)n, re[i], 1e-16 * (double)(nx + ny + 8));
        check_close(&c, full[2 * i + 1] / (double)n, im[i], 1e-16 * (double)(nx + ny + 8));
    }
    check_end(&c);
    fft_done(r2c);
    fft_done(c2r);
    fft_done(fwd);
    fft_done(bwd);
    fft_free(re);
    fft_free(im);
    fft_free(half);
    fft_free(back);
    fft_free(full);
}

/* zoom between grids that share no spacing, both signs, against the sum */
static void zoom(struct fft_grid from, struct fft_grid to, double ax, double ay, int sign, int every)
{
    size_t n = (size_t)from.nx * (size_t)from.ny, m = (size_t)to.nx * (size_t)to.ny;
    double *in = malloc(n * 16), *out = malloc(m * 16), total = 0;
    char what[96];
    for (size_t i = 0; i < 2 * n; i++) {
        in[i] = noise();
        total += fabs(in[i]);
    }
    check_that(fft_zoom(&from, in, &to, out, ax, ay, sign) == OK, "zoom %dx%d -> %dx%d", from.nx, from.ny, to.nx,
               to.ny);
    snprintf(what, sizeof what, "zoom against the sum, 1e-14 of sum|in|, sign %d", sign);
    struct check c = check_begin(what);
    for (size_t k = 0; k < m; k += (size_t)every) {
        int kx = (int)(k % (size_t)to.nx), ky = (int)(k / (size_t)to.nx);
        long double a = 0, b = 0;
        for (int y = 0; y < from.ny; y++)
            for (int x = 0; x < from.nx; x++) {
                long double t = ax * (long double)((x + from.x0) * (kx + to.x0)) +
                                ay * (long double)((y + from.y0) * (ky + to.y0));
                double turn = (double)(2 * 3.14159265358979323846L * sign * remainderl(t, 1));
                double re = in[2 * (y * from.nx + x)], im = in[2 * (y * from.nx + x) + 1];
                a += re * cos(turn) - im * sin(turn);
                b += re * sin(turn) + im * cos(turn);
            }
        check_close(&c, out[2 * k], (double)a, 1e-14 * total);
        check_close(&c, out[2 * k + 1], (double)b, 1e-14 * total);
    }
    check_end(&c);
    free(in);
    free(out);
}

int main(void)
{
    plain(1, 1);
    plain(1, 12);
    plain(7, 1);
    plain(6, 10);
    plain(9, 15);
    plain(32, 24);
    zoom((struct fft_grid){17, 12, -8, -5.5}, (struct fft_grid){9, 31, -4, 0.37}, 0.0123, 0.077, -1, 1);
    zoom((struct fft_grid){1, 5, 0.5, -2}, (struct fft_grid){1, 1, 3, 4}, 0.3, -1.7, +1, 1);
    zoom((struct fft_grid){40, 40, -19.5, -19.5}, (struct fft_grid){40, 40, -20, -20}, 1. / 40, 1. / 40, +1, 1);
    zoom((struct fft_grid){2001, 3, -1000, 1000}, (struct fft_grid){3000, 2, -1500, 900}, 1.234e-3, 0.01, -1, 17);

    int want[][2] = {{-3, 2}, {0, 2}, {1, 2}, {2, 2}, {3, 4}, {7, 8}, {11, 12}, {13, 16}, {17, 18}, {97, 100},
                     {101, 108}, {121, 128}, {1001, 1024}, {4097, 4320}};
    struct check c = check_begin("good sizes: even, 2^a 3^b 5^c, smallest");
    for (size_t i = 0; i < sizeof want / sizeof *want; i++)
        check_close(&c, fft_good_size(want[i][0]), want[i][1], 0.5);
    check_end(&c);

    struct fft *f = (void *)&c;
    struct fft_grid none = {0, 1, 0, 0}, one = {1, 1, 0, 0};
    double v[2] = {7, 7}, w[2] = {1, 0};
    check_that(fft_plan_c2c(&f, 0, 4, 1) == E_RANGE && fft_plan_r2c(&f, 4, -1) == E_RANGE &&
                   fft_plan_c2r(&f, 65536, 65536) == E_RANGE && f == (void *)&c,
               "impossible sizes are refused and leave the plan alone");
    check_that(fft_zoom(&none, w, &one, v, 1, 1, 1) == E_RANGE && fft_zoom(&one, w, &one, v, NAN, 1, 1) == E_RANGE &&
                   v[0] == 7,
               "zoom refuses empty grids and NaN, output untouched");
    fft_done(NULL);
    return check_status();
}
