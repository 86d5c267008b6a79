/*
 * test_broad.c - objects larger than any stamp: the sum over frequencies against the transform of a stamp of the same
 * period, and planned scenes against the Fourier integral as a plain sum over another period.
 */
#include "scenes.h"
#include "broad.h"
#include "fft.h"
#include "render.h"
#include "shapelet.h"
#include "shear.h"
#include <complex.h>
#include <string.h>

/* Coefficients of unit flux with light in every order. */
static double *galaxy(int nmax, double beta, int seed)
{
    double *c = malloc(shapelet_count(nmax) * sizeof *c), m[6];
    for (int n = 0, i = 0; n <= nmax; n++)
        for (int n1 = 0; n1 <= n; n1++, i++)
            c[i] = i ? (uniform(seed, i) - 0.5) / (1 + n) : 1;
    shapelet_moments(nmax, beta, c, m);
    for (size_t i = 0; i < shapelet_count(nmax); i++)
        c[i] /= m[0];
    return c;
}

static double peak_of(size_t n, const double *v)
{
    double p = 0;
    for (size_t i = 0; i < n; i++)
        p = fmax(p, fabs(v[i]));
    return p;
}

/* A window of a stamp, with more frequencies than it has pixels: the same numbers. */
static void same_period(const struct otf *t)
{
    enum { N = 64, X0 = 5, Y0 = 9, NX = 47, NY = 31 };
    const struct stamp_response r = {.box = 0.1, .diffusion = 0.05, .ipc = 0.01, .pitch = 0.1};
    static double whole[N * N], part[NX * NY];
    struct stamp_grid g = {0};
    struct stamp_work *w = NULL;
    struct check k = check_begin("any part of a period = stamp, of the peak; plain, along the axes, mapped, a point");
    int st = stamp_grid_new(&g, t, &r, 0.1, N);
    if (st == OK)
        st = stamp_work_new(&w);
    for (int i = 0; i < 12 && st == OK; i++) {
        static const int order[4] = {0, 5, 24, 60};
        const int nmax = order[i % 4];
        const double beta = 0.3, x = 30.3 + i, y = 27.8 - i, kcut = i < 4 ? 20.5 : 2.0 * g.kmax;
        double *c = galaxy(nmax, beta, i);
        struct shape s = {.nmax = nmax, .beta_x = beta, .beta_y = i == 3 ? 2 * beta : beta, .coef = i == 8 ? NULL : c, .mapped = i % 3 == 2 && nmax < 60};
        st = shear_matrix(0.2, -0.3, s.a);
        if (st == OK)
            st = stamp_fourier(&g, w, &s, x, y, 3, kcut, whole);
        if (st == OK)
            st = stamp_broad(&g, w, &s, 0.1, NX, NY, x - X0, y - Y0, 3, kcut, part);
        const double peak = peak_of(N * N, whole);
        for (int b = 0; b < NY && st == OK; b++)
            for (int a = 0; a < NX; a++)
                check_close(&k, part[b * NX + a] / peak, whole[(b + Y0) * N + a + X0] / peak, 1e-14);
        free(c);
    }
    check_end(&k);
    check_that(st == OK, "no failure");
    stamp_work_free(w);
    stamp_grid_free(&g);
}

/* ---- planned scenes ---- */

/* Transform of shapelets at frequencies (ux, uy): 2 pi beta sum c (-i)^n phi phi. */
static double complex transform(int nmax, double beta, const double *c, double ux, double uy)
{
    static const double complex turn[4] = {1, -I, -1, I};
    const double k[2] = {2 * PI * beta * ux, 2 * PI * beta * uy};
    double b[2 * (SHAPELET_NMAX + 1)];
    double complex sum = 0;
    if (shapelet_basis(nmax, 1, 2, k, b))
        return NAN;
    for (int n = 0; n <= nmax; n++)
        for (int n1 = 0; n1 <= n; n1++, c++)
            sum += turn[n & 3] * *c * b[2 * n1] * b[2 * (n - n1) + 1];
    return 2 * PI * beta * sum;
}

/* Pixel of the view by the integral over frequencies, steps of 1/period, of an object turned and sheared by a (rows). */
static int by_sum(const struct view *v, const struct emitter *e, const double a[4], double period, double top, double *out)
{
    const int m = (int)(top * period), n = 2 * m + 1;
    const struct stamp_response r = view_response(v);
    double *u = malloc((size_t)n * 5 * sizeof *u), *fx = u + n, *fy = fx + n, *t = fy + n, *ti = t + n;
    double complex *ex = malloc((size_t)n * (size_t)v->nx * sizeof *ex), *ey = malloc((size_t)n * (size_t)v->ny * sizeof *ey);
    double complex *row = malloc((size_t)n * sizeof *row), *h = malloc((size_t)v->nx * sizeof *h);
    int st = u && ex && ey && row && h ? OK : E_NOMEM;
    for (int i = 0; i < n && st == OK; i++) {
        u[i] = (i - m) / period;
        fx[i] = fy[i] = 1;
        for (long x = 0; x < v->nx; x++)
            ex[(size_t)i * (size_t)v->nx + (size_t)x] = cexp(2 * PI * I * u[i] * ((double)x - e->x) * v->pixel);
        for (long y = 0; y < v->ny; y++)
            ey[(size_t)i * (size_t)v->ny + (size_t)y] = cexp(2 * PI * I * u[i] * ((double)y - e->y) * v->pixel);
    }
    stamp_factors(&r, 0, n, u, fx);
    stamp_factors(&r, 1, n, u, fy);
    memset(out, 0, (size_t)v->nx * (size_t)v->ny * sizeof *out);
    for (int j = 0; j < n && st == OK; j++) {
        st = otf_grid(v->psf, n, u, 1, &u[j], t, ti);
        for (long x = 0; x < v->nx; x++)
            h[x] = 0;
        for (int i = 0; i < n; i++) {
            const double complex f = transform(e->nmax, e->beta, e->coef, a[0] * u[i] + a[2] * u[j], a[1] * u[i] + a[3] * u[j]);
            row[i] = f * (t[i] + (otf_is_real(v->psf) ? 0 : I * ti[i])) * fx[i] * fy[j];
            for (long x = 0; x < v->nx; x++)
                h[x] += row[i] * ex[(size_t)i * (size_t)v->nx + (size_t)x];
        }
        for (long y = 0; y < v->ny; y++)
            for (long x = 0; x < v->nx; x++)
                out[y * v->nx + x] += e->flux * pow(v->pixel / period, 2) * creal(ey[(size_t)j * (size_t)v->ny + (size_t)y] * h[x]);
    }
    free(u);
    free(ex);
    free(ey);
    free(row);
    free(h);
    return st;
}

static void scene(const struct otf *t, double pixel, double beta, int nmax, double eps, int turned)
{
    enum { NX = 40, NY = 24 };
    const struct view v = {.nx = NX, .ny = NY, .pixel = pixel, .psf = t, .diffusion = 0.04, .g1 = turned ? 0.1 : 0, .g2 = turned ? 0.2 : 0};
    struct accuracy acc = ACCURACY_DEFAULT;
    double *c = galaxy(nmax, beta, nmax), out[NX * NY], a[4] = {1, 0, 0, 1};
    const struct emitter e = {.x = 0.3 * NX, .y = 0.8 * NY, .flux = 2, .coef = c, .nmax = nmax, .parity = 1, .beta = beta,
                              .rotation = turned ? 0.7 : 0, .dilation = 1};
    struct plan p = {0};
    struct image im = {0};
    acc.eps = eps;
    int st = image_new(&im, NX, NY);
    if (st == OK)
        st = scene_plan(&p, &v, &acc, 1, &e);
    if (st == OK)
        st = scene_render(&p, &im, 1, NULL);
    check_that(st == OK && p.count[PATH_BROAD] == 1 && p.n_bad + p.n_short == 0, "beta %g\", order %d, %g\", %g%s: drawn from %d frequencies",
               beta, nmax, pixel, eps, turned ? ", turned and sheared" : "", st ? 0 : p.grid[0].kmax);
    if (turned && st == OK) {
        double s[4];
        st = shear_matrix(v.g1, v.g2, s);
        const double co = cos(e.rotation), si = sin(e.rotation);
        const double r[4] = {s[0] * co + s[1] * si, -s[0] * si + s[1] * co, s[2] * co + s[3] * si, -s[2] * si + s[3] * co};
        memcpy(a, r, sizeof a);
    }
    const double root = sqrt(2.0 * nmax + 1);
    if (st == OK)
        st = by_sum(&v, &e, a, beta * (2 * root + 19) * (turned ? 1.4 : 1) + 20, (root + 7) * (turned ? 1.3 : 1) / (2 * PI * beta), out);
    /* the peak of the whole object, not of this corner, is what the request is about */
    struct check k = check_begin("against the sum over another period, of the peak");
    const double peak = fmax(peak_of(NX * NY, out), 2 * pixel * pixel * fabs(shapelet_value(nmax, beta, c, 0, 0)));
    for (int i = 0; i < NX * NY; i++)
        check_close(&k, st ? NAN : im.pix[i] / peak, out[i] / peak, eps + 6e-8);
    check_end(&k);
    free(c);
    image_free(&im);
    plan_free(&p);
}

int main(void)
{
    struct otf t = {0};
    telescope(&t);
    same_period(&t);
    static const int order[5] = {0, 6, 12, 20, 60};
    for (int i = 0; i < 5; i++) {
        scene(&t, 0.04, 25, order[i], 1e-5, 0);
        scene(&t, 0.04, i < 4 ? 10 : 5, order[i], 1e-7, 0);
    }
    scene(&t, 0.1, 85, 0, 1e-6, 0);
    scene(&t, 0.04, 10, 12, 1e-6, 1);
    scene(&t, 0.1, 20, 8, 1e-4, 1);
    otf_free(&t);
    return check_status();
}
