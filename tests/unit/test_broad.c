/*
 * test_broad.c - objects larger than any stamp: the sum over frequencies against the transform of a stamp of the same
 * period, and planned scenes against the Fourier integral as a plain sum over another period; objects of all sizes and
 * orders against such a sum, too.
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

/* ---- every order, every scale ---- */

enum { SIDE = 500, AT = 32 };

/* Middle pixels one by one, then fewer and fewer outwards, to the edge of the image. */
static const int from_middle[AT] = {-249, -160, -100, -60, -40, -28, -20, -14, -10, -8, -6, -5, -4, -3, -2, -1, 0,
                                    1, 2, 3, 4, 5, 6, 8, 10, 14, 20, 28, 40, 60, 100, 160};

/* (-i)^n c of one row of frequencies: re[n1] + i im[n1] = sum over n2 with b[n2 stride], phi_n2 at u_y. */
static void row_of(int nmax, const double *c, const double *b, size_t stride, double *re, double *im)
{
    static const double co[4] = {1, 0, -1, 0}, si[4] = {0, -1, 0, 1};
    memset(re, 0, (size_t)(nmax + 1) * sizeof *re);
    memset(im, 0, (size_t)(nmax + 1) * sizeof *im);
    for (int n = 0; n <= nmax; n++)
        for (int n1 = 0; n1 <= n; n1++, c++) {
            re[n1] += co[n & 3] * *c * b[(size_t)(n - n1) * stride];
            im[n1] += si[n & 3] * *c * b[(size_t)(n - n1) * stride];
        }
}

/*
 * Pixels of the list around the middle of the view: frequencies k / period, |k| <= top period, line by line, of basis functions,
 * spline of the transfer function and sinc of the pixel; the half u_y > 0 twice.
 */
static int by_lines(const struct view *v, const struct emitter *e, double period, double top, double *out)
{
    const int m = (int)(top * period), nmax = e->nmax;
    const size_t n = (size_t)(2 * m + 1);
    double *u = malloc(n * (size_t)(7 + nmax + 1 + 4 * AT) * sizeof *u), *k = u + n, *box = k + n, *t = box + n, *ti = t + n, *fr = ti + n, *fi = fr + n;
    double *b = fi + n, *xc = b + n * (size_t)(nmax + 1), *xs = xc + n * AT, *yc = xs + n * AT, *ys = yc + n * AT;
    double ar[SHAPELET_NMAX + 1], ai[SHAPELET_NMAX + 1];
    for (size_t i = 0; u && i < n; i++) {
        u[i] = ((double)i - m) / period;
        k[i] = 2 * PI * e->beta * u[i];
        box[i] = i == (size_t)m ? 1 : sin(PI * u[i] * v->pixel) / (PI * u[i] * v->pixel);
        for (size_t a = 0; a < AT; a++) {
            const double x = 2 * PI * u[i] * v->pixel * (SIDE / 2 + from_middle[a] - e->x), y = 2 * PI * u[i] * v->pixel * (SIDE / 2 + from_middle[a] - e->y);
            xc[a * n + i] = cos(x), xs[a * n + i] = sin(x), yc[a * n + i] = cos(y), ys[a * n + i] = sin(y);
        }
    }
    int st = u ? shapelet_basis(nmax, 1, (int)n, k, b) : E_NOMEM;
    memset(out, 0, AT * AT * sizeof *out);
    for (size_t j = (size_t)m; j < n && st == OK; j++) {
        st = otf_grid(v->psf, (int)n, u, 1, &u[j], t, ti);
        row_of(nmax, e->coef, b + j, n, ar, ai);
        memset(fr, 0, 2 * n * sizeof *fr);
        for (int n1 = 0; n1 <= nmax; n1++)
            for (size_t i = 0; i < n; i++) {
                fr[i] += ar[n1] * b[(size_t)n1 * n + i];
                fi[i] += ai[n1] * b[(size_t)n1 * n + i];
            }
        const double weight = (j == (size_t)m ? 1 : 2) * e->flux * 2 * PI * e->beta * pow(v->pixel / period, 2) * box[j];
        for (size_t i = 0; i < n; i++) {
            const double re = fr[i], im = fi[i], tim = otf_is_real(v->psf) ? 0 : ti[i];
            fr[i] = weight * box[i] * (re * t[i] - im * tim);
            fi[i] = weight * box[i] * (re * tim + im * t[i]);
        }
        for (size_t a = 0; a < AT; a++) {
            double re = 0, im = 0;
            for (size_t i = 0; i < n; i++) {
                re += fr[i] * xc[a * n + i] - fi[i] * xs[a * n + i];
                im += fr[i] * xs[a * n + i] + fi[i] * xc[a * n + i];
            }
            for (size_t y = 0; y < AT; y++)
                out[y * AT + a] += re * yc[y * n + j] - im * ys[y * n + j];
        }
    }
    free(u);
    return st;
}

/* Orders 0 to 60, beta .01 to 50 pixels: pixels of the planned scene at a request of 1e-6. */
static void orders_and_scales(const struct otf *t)
{
    static const int order[7] = {0, 1, 2, 5, 12, 30, 60};
    static const double scale[5] = {0.01, 0.1, 1, 10, 50};
    const double pixel = 0.1, eps = 1e-6;
    double want[AT * AT];
    for (int b = 0; b < 5; b++) {
        char what[100];
        snprintf(what, sizeof what, "beta %g pixels, orders 0 to 60, PSF: pixels against a sum over frequencies, of the peak", scale[b]);
        struct check k = check_begin(what);
        for (int o = 0; o < 7; o++) {
            const double beta = scale[b] * pixel, root = sqrt(2.0 * order[o] + 1);
            double *c = galaxy(order[o], beta, 100 + order[o]);
            const struct view v = {.nx = SIDE, .ny = SIDE, .pixel = pixel, .psf = t};
            const struct emitter e = {.x = SIDE / 2 + 0.31, .y = SIDE / 2 - 0.17, .flux = 1, .coef = c, .nmax = order[o], .parity = 1, .beta = beta, .dilation = 1};
            struct accuracy acc = ACCURACY_DEFAULT;
            struct plan p = {0};
            struct image im = {0};
            acc.eps = eps;
            int st = image_new(&im, SIDE, SIDE);
            if (st == OK)
                st = scene_plan(&p, &v, &acc, 1, &e);
            if (st == OK)
                st = scene_render(&p, &im, 1, NULL);
            const double period = fmax(2 * pixel * fmax(p.draw ? p.draw[0].nx : 0, SIDE / 4), 2 * beta * (root + 9) + pixel * SIDE);
            if (st == OK)
                st = by_lines(&v, &e, period, fmin(t->ucut, (root + 7) / (2 * PI * beta)), want);
            const double peak = peak_of(AT * AT, want);
            for (int i = 0; i < AT * AT; i++) {
                const long x = SIDE / 2 + from_middle[i % AT], y = SIDE / 2 + from_middle[i / AT];
                check_close(&k, st ? NAN : (double)im.pix[y * SIDE + x] / peak, want[i] / peak, eps);
            }
            plan_free(&p);
            image_free(&im);
            free(c);
        }
        check_end(&k);
    }
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
    orders_and_scales(&t);
    otf_free(&t);
    return check_status();
}
