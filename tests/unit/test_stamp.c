/*
 * test_stamp.c - one object on one stamp, against references that share nothing
 * with the kernels but the basis functions: Gauss-Legendre sums inside pixels,
 * and the Fourier integral written out as a sum over frequencies.
 */
#include "check.h"
#include "fft.h"
#include "image.h"
#include "imageio.h"
#include "otf.h"
#include "quad.h"
#include "shapelet.h"
#include "shear.h"
#include "stamp.h"
#include <complex.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

static unsigned int state = 7;
static double uniform(void)
{
    state = state * 1664525u + 1013904223u;
    return (state >> 8) / 16777216.0;
}

/* Coefficients of unit flux with structure in every order. */
static double *galaxy(int nmax, double beta)
{
    double *c = malloc(shapelet_count(nmax) * sizeof *c), m[6];
    for (int n = 0, i = 0; n <= nmax; n++)
        for (int n1 = 0; n1 <= n; n1++, i++)
            c[i] = i ? (uniform() - 0.5) / (1 + n) : 1;
    shapelet_moments(nmax, beta, c, m);
    for (size_t i = 0; i < shapelet_count(nmax); i++)
        c[i] /= m[0];
    return c;
}

/* Transfer function of a round aperture of cut-off 11.8 /arcsec, with a lateral phase when `odd`. */
static void telescope(struct otf *t, int odd)
{
    enum { N = 129 };
    static double re[N * N], im[N * N];
    const double ucut = 11.8, du = ucut / 63;
    for (int j = 0; j < N; j++)
        for (int i = 0; i < N; i++) {
            double x = (i - N / 2) * du, y = (j - N / 2) * du, v = hypot(x, y) / ucut;
            double a = v < 1 ? 2 / PI * (acos(v) - v * sqrt(1 - v * v)) : 0, p = odd ? 0.3 * v * v * (x - 0.5 * y) / ucut : 0;
            re[j * N + i] = a * cos(p);
            im[j * N + i] = a * sin(p);
        }
    if (otf_tabulate(t, N, du, ucut, re, odd ? im : NULL))
        exit(1);
}

static double peak_of(size_t n, const double *v)
{
    double p = 0;
    for (size_t i = 0; i < n; i++)
        p = fmax(p, fabs(v[i]));
    return p;
}

/* ---- no PSF ---- */

/* Integral over pixel (i, j) by 24 x 24 nodes of f(A^-1 x). */
static double pixel_by_nodes(int nmax, double beta, const double *c, const double a[4], double pixel, double x,
                             double y, int i, int j)
{
    double q[24], w[24], sum = 0;
    if (quad_legendre(24, q, w))
        return NAN;
    for (int k = 0; k < 24; k++)
        for (int l = 0; l < 24; l++) {
            double px = (i - x + 0.5 * q[k]) * pixel, py = (j - y + 0.5 * q[l]) * pixel;
            sum += w[k] * w[l] * shapelet_value(nmax, beta, c, a[3] * px - a[1] * py, a[0] * py - a[2] * px);
        }
    return sum * pixel * pixel / 4;
}

static void no_psf(struct stamp_work *w)
{
    const int nmax = 6, n = 24;
    const double beta = 0.15, pixel = 0.1, x = 11.3, y = 12.45, one[4] = {1, 0, 0, 1};
    double *c = galaxy(nmax, beta), *out = fft_alloc((size_t)(n * n) * sizeof *out), a[4];
    struct shape s = {.nmax = nmax, .beta_x = beta, .beta_y = beta, .coef = c};
    int st = stamp_closed(w, &s, pixel, pixel, n, n, x, y, 3, out);
    double peak = peak_of((size_t)(n * n), out);
    struct check k = check_begin("closed form = 24x24 nodes per pixel, of the peak");
    for (int j = 5; j < 20; j += 3)
        for (int i = 4; i < 20; i += 2)
            check_close(&k, out[j * n + i], 3 * pixel_by_nodes(nmax, beta, c, one, pixel, x, y, i, j), 1e-13 * peak);
    check_end(&k);
    check_that(st == OK, "closed form returns OK");

    st = shear_matrix(0.1, -0.2, a);
    memcpy(s.a, a, sizeof a);
    s.mapped = 1;
    if (st == OK)
        st = stamp_mapped(w, &s, pixel, pixel, n, n, x, y, 3, out);
    k = check_begin("mapped = 24x24 nodes per pixel, g = (.1,-.2), of the peak");
    for (int j = 5; j < 20; j += 3)
        for (int i = 4; i < 20; i += 2)
            check_close(&k, out[j * n + i], 3 * pixel_by_nodes(nmax, beta, c, a, pixel, x, y, i, j), 1e-12 * peak);
    check_end(&k);
    check_that(st == OK && stamp_closed(w, &s, pixel, pixel, n, n, x, y, 3, out) == E_RANGE,
               "closed form refuses a map");
    free(c);
    fft_free(out);
}

/* Flux of everything when nothing leaves the stamp; scales from 0.01 to 50 pixels, orders 0 to 60. */
static void flux_kept(struct stamp_work *w)
{
    static const double scale[] = {0.01, 0.1, 0.7, 3, 50};
    struct check k = check_begin("no PSF: sum of pixels = flux, beta .01 to 50 pixels, nmax 0 to 60");
    for (int a = 0; a < 5; a++)
        for (int order = 0; order <= 60; order += scale[a] < 10 ? 1 : 15) {
            double *c = galaxy(order, scale[a] * 0.1), sum = 0;
            int n = 2 * (int)(scale[a] * (sqrt(2.0 * order + 2) + 9)) + 5;
            double *out = fft_alloc((size_t)n * (size_t)n * sizeof *out);
            struct shape s = {.nmax = order, .beta_x = scale[a] * 0.1, .beta_y = scale[a] * 0.1, .coef = c};
            if (stamp_closed(w, &s, 0.1, 0.1, n, n, n / 2 + 0.5, n / 2 - 0.21, 7, out))
                sum = NAN;
            for (int i = 0; i < n * n; i++)
                sum += out[i];
            check_close(&k, sum / 7, 1, 1e-12);
            fft_free(out);
            free(c);
        }
    check_end(&k);
}

static void point(void)
{
    double out[16];
    struct check k = check_begin("a point without PSF: its pixel; halves on an edge, quarters on a corner");
    stamp_point(4, 4, 1.49, 2.2, 5, out);
    check_close(&k, out[2 * 4 + 1], 5, 0);
    stamp_point(4, 4, 1.5, 2.2, 5, out);
    check_close(&k, out[2 * 4 + 1], 2.5, 0);
    check_close(&k, out[2 * 4 + 2], 2.5, 0);
    stamp_point(4, 4, 0.5, 2.5, 5, out);
    check_close(&k, out[2 * 4], 1.25, 0);
    check_close(&k, out[3 * 4 + 1], 1.25, 0);
    stamp_point(4, 4, -0.5, 1, 5, out);
    check_close(&k, out[4], 2.5, 0);
    stamp_point(4, 4, 1e300, 1, 5, out);
    check_close(&k, peak_of(16, out), 0, 0);
    check_end(&k);
}

/* ---- with a PSF ---- */

/* F T at u by the definitions, object at the origin. */
static double complex transform(const struct shape *s, double ux, double uy, double complex t)
{
    if (!s->coef)
        return t;
    double px[64], py[64], x, y;
    if (s->mapped) {
        x = 2 * PI * s->beta_x * (s->a[0] * ux + s->a[2] * uy);
        y = 2 * PI * s->beta_x * (s->a[1] * ux + s->a[3] * uy);
    } else {
        x = 2 * PI * s->beta_x * ux;
        y = 2 * PI * s->beta_y * uy;
    }
    if (shapelet_basis(s->nmax, 1, 1, &x, px) || shapelet_basis(s->nmax, 1, 1, &y, py))
        return NAN;
    static const double complex turn[4] = {1, -I, -1, I};
    double complex f = 0;
    for (int n = 0; n <= s->nmax; n++)
        for (int n1 = 0; n1 <= n; n1++)
            f += turn[n % 4] * s->coef[shapelet_index(n1, n - n1)] * px[n1] * py[n - n1];
    return 2 * PI * sqrt(s->beta_x * s->beta_y) * f * t;
}

/* Pixels (i, j) of a list by the plain sum over frequencies k/(n pixel), all bands. */
static void by_sum(const struct otf *t, const struct stamp_response *r, const struct shape *s, double pixel, int n,
                   double x, double y, double flux, int m, const int (*at)[2], double *out)
{
    const double du = 1 / (n * pixel);
    const int kmax = (int)(t->ucut / du);
    memset(out, 0, (size_t)m * sizeof *out);
    for (int ky = -kmax; ky <= kmax; ky++)
        for (int kx = -kmax; kx <= kmax; kx++) {
            double ux = kx * du, uy = ky * du, re, im;
            if (otf_grid(t, 1, &ux, 1, &uy, &re, &im))
                exit(1);
            double f = exp(-2 * PI * PI * r->diffusion * r->diffusion * (ux * ux + uy * uy));
            if (r->box > 0 && kx)
                f *= sin(PI * ux * r->box) / (PI * ux * r->box);
            const double tall = r->box_y > 0 ? r->box_y : r->box;
            if (tall > 0 && ky)
                f *= sin(PI * uy * tall) / (PI * uy * tall);
            f *= 1 - 4 * r->ipc + 2 * r->ipc * cos(2 * PI * ux * r->pitch) + 2 * r->ipc * cos(2 * PI * uy * r->pitch);
            double complex g = transform(s, ux, uy, (re + I * im) * f);
            for (int k = 0; k < m; k++)
                out[k] += creal(g * cexp(2 * PI * I * (kx * (at[k][0] - x) + ky * (at[k][1] - y)) / n));
        }
    for (int k = 0; k < m; k++)
        out[k] *= flux / ((double)n * n);
}

/* Four kinds of object, even and odd transfer function, three scales. */
static void with_psf(struct stamp_work *w)
{
    static const int at[6][2] = {{16, 15}, {17, 16}, {15, 12}, {20, 21}, {3, 30}, {0, 0}};
    static const double scale[3] = {0.04, 0.1, 0.21};
    const int n = 32;
    double *c = galaxy(5, 0.12), *out = fft_alloc((size_t)(n * n) * sizeof *out), want[6];
    struct shape s[4] = {{0}, {.nmax = 5, .beta_x = 0.12, .beta_y = 0.12, .coef = c},
                         {.nmax = 5, .beta_x = 0.15, .beta_y = 0.1, .coef = c},
                         {.nmax = 5, .beta_x = 0.12, .beta_y = 0.12, .coef = c, .mapped = 1}};
    if (shear_matrix(0.2, 0.3, s[3].a))
        exit(1);
    struct check k = check_begin("Fourier stamp = sum over all frequencies: star, galaxy, two scales, map; rectangle and neighbours; of the peak");
    for (int odd = 0; odd < 2; odd++)
        for (int b = 0; b < 3; b++) {
            struct otf t = {0};
            struct stamp_grid g = {0};
            const struct stamp_response r = {.diffusion = odd ? 0.04 : 0, .box = scale[b], .box_y = b == 1 ? 0.7 * scale[b] : 0,
                                             .ipc = b > 0 ? 0.01 : 0, .pitch = b == 2 ? 2 * scale[b] : scale[b]};
            telescope(&t, odd);
            if (stamp_grid_new(&g, &t, &r, scale[b], n))
                exit(1);
            for (int o = 0; o < 4; o++) {
                if (stamp_fourier(&g, w, &s[o], 15.71, 16.2, 2, 1e9, out))
                    exit(1);
                by_sum(&t, &r, &s[o], scale[b], n, 15.71, 16.2, 2, 6, at, want);
                double peak = peak_of((size_t)(n * n), out);
                for (int i = 0; i < 6; i++)
                    check_close(&k, out[at[i][1] * n + at[i][0]], want[i], 2e-14 * peak);
            }
            stamp_grid_free(&g);
            otf_free(&t);
        }
    check_end(&k);
    free(c);
    fft_free(out);
}

/* Sum of the stamp = flux; four half pixels = one pixel; nothing changes by a shift of whole pixels. */
static void identities(struct stamp_work *w)
{
    struct otf t = {0};
    struct stamp_grid full = {0}, half = {0};
    telescope(&t, 1);
    const struct stamp_response r = {.diffusion = 0.04, .box = 0.1}, rh = {.diffusion = 0.04, .box = 0.05};
    const int n = 32;
    double *c = galaxy(8, 0.1), *a = fft_alloc((size_t)(n * n) * sizeof *a), *b = fft_alloc((size_t)(4 * n * n) * sizeof *b);
    struct shape s = {.nmax = 8, .beta_x = 0.1, .beta_y = 0.1, .coef = c};
    if (stamp_grid_new(&full, &t, &r, 0.1, n) || stamp_grid_new(&half, &t, &rh, 0.05, 2 * n)
        || stamp_fourier(&full, w, &s, 15.8, 16.3, 1, 1e9, a)
        || stamp_fourier(&half, w, &s, 2 * 15.8 + 0.5, 2 * 16.3 + 0.5, 1, 1e9, b))
        exit(1);
    double peak = peak_of((size_t)(n * n), a), sum = 0;
    struct check k = check_begin("interlacing: 2 x 2 half pixels = one pixel, of the peak");
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            const double *q = b + (2 * j) * 2 * n + 2 * i;
            check_close(&k, (q[0] + q[1] + q[2 * n] + q[2 * n + 1]) / peak, a[j * n + i] / peak, 4e-15);
            sum += a[j * n + i];
        }
    check_end(&k);
    k = check_begin("Fourier stamp: sum of pixels = flux");
    check_close(&k, sum, 1, 1e-13);
    check_end(&k);
    k = check_begin("the same, orders 0 to 60, beta .01 to 50 pixels, PSF");
    for (int order = 0; order <= 60; order++)
        for (int i = 0; i < 4; i++) {
            const double scale[] = {0.001, 0.03, 0.3, 5};
            double *g = galaxy(order, scale[i]);
            struct shape any = {.nmax = order, .beta_x = scale[i], .beta_y = scale[i], .coef = g};
            if (stamp_fourier(&full, w, &any, 15.8, 16.3, 1, 1e9, b))
                exit(1);
            sum = 0;
            for (int j = 0; j < n * n; j++)
                sum += b[j];
            check_close(&k, sum, 1, 1e-12);
            free(g);
        }
    check_end(&k);
    k = check_begin("the same at another whole pixel, of the peak");
    if (stamp_fourier(&full, w, &s, 13.8, 17.3, 1, 1e9, b))
        exit(1);
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++)
            check_close(&k, b[(j + 1) % n * n + (i + n - 2) % n] / peak, a[j * n + i] / peak, 1e-14);
    check_end(&k);
    check_that(stamp_grid_new(&full, &t, &r, 0.1, 31) == E_RANGE && stamp_fourier(&half, w, &s, NAN, 0, 1, 9, b) == E_RANGE,
               "odd sides and positions that are no numbers are refused");
    stamp_grid_free(&full);
    stamp_grid_free(&half);
    otf_free(&t);
    fft_free(a);
    fft_free(b);
    free(c);
}

/* Rows made from the spline are those of the table, bit for bit; interlaced parts make up the whole stamp. */
static void lean(struct stamp_work *w)
{
    const int n = 48;
    double *c = galaxy(8, 0.1), *a = fft_alloc((size_t)(n * n) * sizeof *a), *b = fft_alloc((size_t)n * stamp_stride(n) * sizeof *b);
    const struct shape s[3] = {{0}, {.nmax = 8, .beta_x = 0.1, .beta_y = 0.13, .coef = c},
                               {.nmax = 8, .beta_x = 0.1, .beta_y = 0.1, .coef = c, .mapped = 1, .a = {1.1, 0.2, 0, 1 / 1.1}}};
    struct check parts = check_begin("interlaced parts of a stamp = the stamp, of the peak");
    int same = 1;
    for (int kind = 0; kind < 12; kind++) {
        const double pixel = kind & 1 ? 0.03 : 0.16, kcut = kind < 6 ? 1e9 : 21.5;
        const int divisor = 2 + kind % 3;
        struct otf t = {0};
        struct stamp_grid whole = {0}, spline = {0}, cut = {0};
        const struct stamp_response r = {.diffusion = 0.03, .box = pixel, .edge = {0, 0.02}, .ipc = 0.01, .pitch = pixel};
        telescope(&t, kind / 2 % 2);
        if (stamp_grid_new(&whole, &t, &r, pixel, n) || stamp_grid_lean(&spline, &t, &r, pixel, n, 1, 0)
            || stamp_grid_lean(&cut, &t, &r, pixel, n, divisor, kind / 3 % 2))
            exit(1);
        for (int o = 0; o < 3; o++) {
            if (stamp_fourier(&whole, w, &s[o], 23.71, 24.2, 2, kcut, a) || stamp_fourier(&spline, w, &s[o], 23.71, 24.2, 2, kcut, b))
                exit(1);
            same = same && memcmp(a, b, (size_t)(n * n) * sizeof *a) == 0;
            const double peak = peak_of((size_t)(n * n), a);
            for (int part = 0; part < divisor; part++) {
                if (stamp_fourier_part(&cut, w, &s[o], 23.71, 24.2, 2, kcut, part, b))
                    exit(1);
                for (int y = part; y < n; y += divisor)
                    for (int x = 0; x < n; x++)
                        check_close(&parts, b[(size_t)(y / divisor) * stamp_stride(n) + (size_t)x] / peak, a[y * n + x] / peak, 3e-15);
            }
        }
        check_that(stamp_fourier_part(&cut, w, &s[0], 1, 1, 1, 9, divisor, b) == E_RANGE && stamp_fourier(&cut, w, &s[0], 1, 1, 1, 9, b) == E_RANGE,
                   "%d parts: one more and the whole are refused", divisor);
        stamp_grid_free(&whole);
        stamp_grid_free(&spline);
        stamp_grid_free(&cut);
        otf_free(&t);
    }
    check_end(&parts);
    check_that(same, "stamps without a table have the bits of those with one");
    free(c);
    fft_free(a);
    fft_free(b);
}

/* ---- truth files ---- */

/* PSF of ../shared/truth/galsim as samples with its cut-off. */
static int truth_psf(const char *dir, struct otf *t)
{
    char name[512];
    struct err e = {""};
    struct fits_in *f;
    snprintf(name, sizeof name, "%s/psf_chpsf_0.01.fits.gz", dir);
    if (fits_in_open(&f, name, 1e9, &e))
        return E_IO;
    const struct hdu *h = fits_in_hdu(f, fits_in_selected(f));
    double *p = malloc((size_t)h->nx * (size_t)h->ny * sizeof *p);
    int st = fits_in_rows_double(f, h->index, 0, 0, h->ny, p, &e);
    if (st == OK)
        st = otf_sample(t, (int)h->nx, (int)h->ny, p, 0.01, 384, 384, 11.9);
    fits_in_close(f);
    free(p);
    return st;
}

static double number(const struct header *h, const char *key)
{
    return header_double_or(h, key, NAN);
}

/* One truth file: returns the worst error over the peak, or NaN. */
static double truth_one(struct stamp_work *w, const char *name, const struct otf *t, double scale)
{
    struct err e = {""};
    struct fits_in *f;
    struct header h = {0};
    if (fits_in_open(&f, name, 1e9, &e))
        return NAN;
    double *want = malloc(64 * 64 * sizeof *want), *out = fft_alloc(256 * 256 * sizeof *out), c[136], a[4], worst = NAN;
    int st = fits_in_rows_double(f, 0, 0, 0, 64, want, &e);
    if (st == OK)
        st = fits_in_header(f, 0, &h, &e);
    const int nmax = (int)number(&h, "NMAX");
    for (int i = 0; i < (nmax + 1) * (nmax + 2) / 2 && i < 136; i++) {
        char key[16];
        snprintf(key, sizeof key, "C%d", i);
        c[i] = number(&h, key);
    }
    double g1 = number(&h, "G1"), g2 = number(&h, "G2"), g = hypot(g1, g2), k = g > 0 ? tanh(g) / g : 0;
    if (!isfinite(g1)) {
        g1 = number(&h, "GAMMA1"), g2 = number(&h, "GAMMA2"), g = hypot(g1, g2);
        k = g > 0 ? tanh(g) / g : 0;
    }
    struct shape s = {.nmax = nmax, .beta_x = number(&h, "BETA"), .beta_y = number(&h, "BETA"), .coef = c, .mapped = 1};
    if (st == OK)
        st = shear_matrix(g1 * k, g2 * k, a);
    memcpy(s.a, a, sizeof a);
    double x = 31.5 + number(&h, "OFFX") / scale, y = 31.5 + number(&h, "OFFY") / scale;
    int n = 64, shift = 0;
    if (st == OK && t) {
        struct stamp_grid grid = {0};
        const struct stamp_response r = {.box = scale};
        n = 256, shift = 96;
        st = stamp_grid_new(&grid, t, &r, scale, n);
        if (st == OK)
            st = stamp_fourier(&grid, w, &s, x + shift, y + shift, 1, 1e9, out);
        stamp_grid_free(&grid);
    } else if (st == OK) {
        st = stamp_mapped(w, &s, scale, scale, n, n, x, y, 1, out);
    }
    if (st == OK) {
        double peak = peak_of(64 * 64, want);
        worst = 0;
        for (int j = 0; j < 64; j++)
            for (int i = 0; i < 64; i++)
                worst = fmax(worst, fabs(out[(j + shift) * n + i + shift] - want[j * 64 + i]) / peak);
    } else
        printf("# %s: status %d %s\n", name, st, e.text);
    header_free(&h);
    fits_in_close(f);
    free(want);
    fft_free(out);
    return worst;
}

static void truth(struct stamp_work *w)
{
    const char *shared = getenv("SHARED");
    char dir[256], name[512];
    struct otf t = {0};
    snprintf(dir, sizeof dir, "%s/truth/galsim", shared ? shared : "");
    if (!shared || truth_psf(dir, &t)) {
        check_skip("truth/galsim is not there");
        return;
    }
    static const int object[4] = {1, 3, 5, 11};
    static const double scale[2] = {0.05, 0.10};
    struct check no = check_begin("truth/galsim without PSF, of the peak"), with = check_begin("truth/galsim with PSF, of the peak");
    for (int o = 0; o < 4; o++)
        for (int b = 0; b < 2; b++) {
            snprintf(name, sizeof name, "%s/truth_%02d_nopsf_%.2f.fits.gz", dir, object[o], scale[b]);
            check_close(&no, truth_one(w, name, NULL, scale[b]), 0, 1e-10);
            snprintf(name, sizeof name, "%s/truth_%02d_psf_%.2f.fits.gz", dir, object[o], scale[b]);
            check_close(&with, truth_one(w, name, &t, scale[b]), 0, 1e-6);
        }
    check_end(&no);
    check_end(&with);
    otf_free(&t);
}

/* Single precision against double, over the peak. */
static void single(void)
{
    enum { MOST = 200 };
    static const int side[] = {12, 16, 20, 24, 32, 40, 48, 64, 72, 80, 96, 120, 128, 144, 160, 180, MOST}, orders[] = {-1, 0, 1, 5, 12, 30, 60};
    static double want[MOST * MOST];
    static float got[MOST * MOST];
    struct check c = check_begin("single precision: sides 12 to 200, orders 0 to 60 and a point, all or some frequencies: of the peak");
    struct check whole = check_begin("single precision: the sum of the pixels, over the sum of their sizes");
    double rest;
    struct stamp_work *w = NULL;
    int refused = 0;
    if (!check_that(stamp_work_new(&w) == OK, "work"))
        return;
    for (int odd = 0; odd < 2; odd++)
        for (size_t i = 0; i < sizeof side / sizeof *side; i++) {
            const int n = side[i];
            const size_t pixels = (size_t)n * (size_t)n;
            struct stamp_response r = {.diffusion = 0.02, .box = 0.1, .ipc = odd ? 0.01 : 0, .pitch = 0.1};
            struct stamp_grid g, cut;
            struct otf t;
            telescope(&t, odd);
            if (stamp_grid_new(&g, &t, &r, 0.1, n) || stamp_grid_lean(&cut, &t, &r, 0.1, n, 2, 1))
                exit(1);
            for (size_t o = 0; o < sizeof orders / sizeof *orders; o++)
                for (int some = 0; some < 3; some++) {
                    const double beta = 0.1 * n / 30, kcut = some == 0 ? 1e9 : some == 1 ? 0.9 * n : 0.3 * n;
                    struct shape s = {.nmax = orders[o] < 0 ? 0 : orders[o], .beta_x = beta * 1.1, .beta_y = beta / 1.1};
                    double *coef = orders[o] < 0 ? NULL : galaxy(s.nmax, beta);
                    s.coef = coef;
                    if (stamp_fourier(&g, w, &s, 0.43 * n + 0.2, 0.52 * n - 0.3, 1e4, kcut, want) || stamp_single(&g, w, &s, 0.43 * n + 0.2, 0.52 * n - 0.3, 1e4, kcut, got, &rest))
                        exit(1);
                    const double peak = peak_of(pixels, want);
                    double sum = 0, size = 0;
                    for (size_t k = 0; k < pixels; k++) {
                        check_close(&c, ((double)got[k] + rest) / peak, want[k] / peak, 3e-7);
                        sum += (double)got[k] + rest - want[k];
                        size += fabs(want[k]);
                    }
                    check_close(&whole, sum / size, 0, 1e-12);
                    s.mapped = 1;
                    refused += stamp_single(&g, w, &s, 1, 1, 1, 9, got, &rest) == E_RANGE;
                    s.mapped = 0;
                    refused += stamp_single(&cut, w, &s, 1, 1, 1, 9, got, &rest) == E_RANGE;
                    free(coef);
                }
            stamp_grid_free(&g);
            stamp_grid_free(&cut);
            otf_free(&t);
        }
    stamp_work_free(w);
    check_end(&c);
    check_end(&whole);
    check_that(refused == 2 * 2 * 17 * 7 * 3, "single precision: mapped shapes and grids of parts are refused (%d)", refused);
}

int main(void)
{
    struct stamp_work *w;
    if (stamp_work_new(&w))
        return 1;
    no_psf(w);
    flux_kept(w);
    point();
    with_psf(w);
    identities(w);
    lean(w);
    truth(w);
    stamp_work_free(w);
    single();
    return check_status();
}
