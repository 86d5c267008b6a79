/*
 * test_render.c - scenes: same bytes for any number of threads, paths that make no
 * transform, the series of the shear, and objects in strange places.
 * Error requested against error found: test_requests.c.
 */
#include "check.h"
#include "render.h"
#include "scenes.h"
#include "shapelet.h"
#include "shear.h"
#include <stdlib.h>
#include <string.h>

static struct image render(const struct view *v, double eps, int n, const struct emitter *s, int threads, struct plan *kept);
static double sum_of(const struct image *im);

/* n galaxies with counts, sizes and orders like those of deep fields, and every tenth a star. */
static struct emitter *field(int n, long side)
{
    struct emitter *s = calloc((size_t)n, sizeof *s);
    for (int i = 0; i < n; i++) {
        double mag = fmax(20, 30.8 + log10(uniform(i, 0)) / 0.2), m[6];
        int nmax = mag < 24 ? 15 : mag < 26 ? 12 : mag < 28 ? 8 : 4;
        double beta = 0.2 * pow(10, -0.105 * (mag - 22.25)) * exp(0.9 * (uniform(i, 1) - 0.5));
        double *c = malloc(shapelet_count(nmax) * sizeof *c);
        for (int k = 0, j = 0; k <= nmax; k++)
            for (int n1 = 0; n1 <= k; n1++, j++)
                c[j] = j ? 1.2 * (uniform(i, 10 + j) - 0.5) / (1 + k) : 1;
        shapelet_moments(nmax, beta, c, m);
        for (size_t j = 0; j < shapelet_count(nmax); j++)
            c[j] /= fmax(m[0], 0.3 * beta);
        s[i] = (struct emitter){.x = uniform(i, 2) * (double)side, .y = uniform(i, 3) * (double)side,
                                .flux = 2000 * pow(10, -0.4 * (mag - 26.65)), .coef = i % 10 ? c : NULL,
                                .nmax = nmax, .parity = i % 2 ? 1 : -1, .beta = beta, .dilation = i % 7 ? 1 : 1.2,
                                .rotation = i % 3 ? 0 : 6.3 * uniform(i, 4)};
        if (i % 10 == 0)
            free(c);
        if (i % 11 == 3) {
            s[i].g1 = 0.3 * (uniform(i, 5) - 0.5);
            s[i].g2 = 0.3 * (uniform(i, 6) - 0.5);
        }
    }
    return s;
}

static void field_free(struct emitter *s, int n)
{
    for (int i = 0; i < n; i++)
        free((double *)(uintptr_t)s[i].coef);
    free(s);
}

enum { HALF = 30 };                /* of the largest order */

/* Light that n times n pixels of size h about the centre of an object of two coefficients hold, shear g: Gauss-Legendre on each pixel. */
static double inside(double beta, int order, double second, const double g[2], int n, double h)
{
    static const double at[3] = {-0.774596669241483377, 0, 0.774596669241483377}, weight[3] = {5 / 18.0, 8 / 18.0, 5 / 18.0};
    enum { CUTS = 3 };
    double s[4], sum = 0, b[2 * (HALF + 1)];
    if (shear_matrix(-g[0], -g[1], s))
        exit(1);
    for (int y = 0; y < n * CUTS * 3; y++)
        for (int x = 0; x < n * CUTS * 3; x++) {
            const double u = ((x / 3 + 0.5 + 0.5 * at[x % 3]) / CUTS - 0.5 * n) * h, v = ((y / 3 + 0.5 + 0.5 * at[y % 3]) / CUTS - 0.5 * n) * h;
            const double place[2] = {s[0] * u + s[1] * v, s[2] * u + s[3] * v};
            if (shapelet_basis(order, beta, 2, place, b))
                exit(1);
            sum += weight[x % 3] * weight[y % 3] * (b[0] * b[1] + second * b[2 * order] * b[2 * order + 1]);
        }
    return sum / beta * h * h / (CUTS * CUTS);
}

/* Every order, scale and shear: the whole flux in an image that holds it, or what a smaller one without a PSF holds of it. */
static void extremes(const struct otf *t)
{
    static const double beta[] = {0.001, 0.03, 0.1, 5}, shear[] = {0, -0.0, 5e-324, 0.05, 0.5, 0.99};
    static const int order[] = {0, 12, 60};
    struct check k = check_begin("flux for beta 0.01 to 50 pixels, order 0 to 60, g 0 to 0.975; beyond 2000 pixels without a PSF and against a sum over nodes");
    int whole = 0, part = 0;
    for (int i = 0; i < 2 * 4 * 3 * 6; i++) {
        const int n = order[i / 2 % 3];
        const double b = beta[i / 6 % 4], g[2] = {0.4 * shear[i / 24], 0.9 * shear[i / 24]}, strength = hypot(g[0], g[1]);
        const double reach = b * sqrt((1 + strength) / (1 - strength)) * (sqrt(2.0 * n + 2) + 5);
        const int held = reach < 107, side = held ? 2 * (int)fmax(i % 2 ? 100 : 50, 10 * reach + 2) : 60;
        double c[2000] = {0}, m[6];
        if (!held && i % 2)
            continue;
        c[0] = 1 / b;
        c[shapelet_index(n / 2, n / 2)] += 0.3 * c[0];
        shapelet_moments(n, b, c, m);
        const struct emitter s = {.x = 0.5 * (side - 1), .y = 0.5 * (side - 1), .flux = 1000, .coef = c, .nmax = n, .parity = 1, .beta = b, .dilation = 1};
        const struct view v = {.nx = side, .ny = side, .pixel = 0.1, .psf = i % 2 ? t : NULL, .g1 = g[0], .g2 = g[1]};
        struct image im = render(&v, i % 2 ? 1e-4 : 1e-9, 1, &s, 1, NULL);
        const double sum = sum_of(&im) / 1000, want = held ? m[0] : inside(b, n / 2, 0.3, g, side, 0.1);
        check_close(&k, sum / want, 1, 6e-8);
        whole += held;
        part += !held;
        image_free(&im);
    }
    check_end(&k);
    check_that(whole > 130 && part == 4, "%d images that hold the whole object, %d that do not", whole, part);
}

/* Render; returns the image (owned by the caller) and what the plan was. */
static struct image render(const struct view *v, double eps, int n, const struct emitter *s, int threads, struct plan *kept)
{
    struct accuracy a = ACCURACY_DEFAULT;
    struct image im;
    struct plan p;
    a.eps = eps;
    if (image_new(&im, v->nx, v->ny))
        exit(1);
    if (scene_plan(&p, v, &a, (size_t)n, s) || scene_render(&p, &im, threads, NULL))
        for (size_t i = 0; i < image_count(&im); i++)
            im.pix[i] = NAN;
    if (kept)
        *kept = p;
    plan_free(&p);
    return im;
}

static double sum_of(const struct image *im)
{
    double s = 0;
    for (size_t i = 0; i < image_count(im); i++)
        s += im->pix[i];
    return s;
}

static void determinism(const struct otf *t)
{
    for (int psf = 0; psf < 2; psf++) {
        struct view v = {.nx = 400, .ny = 300, .pixel = 0.1, .psf = psf ? t : NULL, .g1 = 0.03, .g2 = 0.04};
        struct emitter *s = field(400, 400);
        struct image a = render(&v, 1e-4, 400, s, 1, NULL), b = render(&v, 1e-4, 400, s, 2, NULL);
        struct image c = render(&v, 1e-4, 400, s, 7, NULL);
        size_t bytes = image_count(&a) * sizeof *a.pix;
        check_that(sum_of(&a) > 0 && !memcmp(a.pix, b.pix, bytes) && !memcmp(a.pix, c.pix, bytes),
                   "%s: 1, 2 and 7 threads give the same bytes", psf ? "PSF" : "no PSF");
        image_free(&a);
        image_free(&b);
        image_free(&c);
        field_free(s, 400);
    }
}

/* The stamps of all objects, each made alone, summed in double; behind that the sum of their absolute values. */
static double *sum_of_stamps(const struct plan *p)
{
    const long nx = p->view.nx, ny = p->view.ny;
    double *sum = calloc((size_t)(2 * nx * ny), sizeof *sum), *scratch = malloc((3 * plan_scratch(p) + 1) * sizeof *scratch);
    struct stamp_work *w;
    if (!sum || !scratch || stamp_work_new(&w))
        exit(1);
    for (size_t i = 0; i < p->n; i++) {
        const struct draw *d = &p->draw[i];
        double *stamp = d->path == PATH_NONE ? NULL : malloc((size_t)d->nx * (size_t)d->ny * sizeof *stamp);
        if (!stamp)
            continue;
        if (scene_stamp(p, i, w, scratch, stamp))
            exit(1);
        for (long y = d->y0 < 0 ? 0 : d->y0; y < ny && y < (long)d->y0 + d->ny; y++)
            for (long x = d->x0 < 0 ? 0 : d->x0; x < nx && x < (long)d->x0 + d->nx; x++) {
                const double value = stamp[(y - d->y0) * d->nx + x - d->x0];
                sum[y * nx + x] += value;
                sum[nx * ny + y * nx + x] += fabs(value);
            }
        free(stamp);
    }
    stamp_work_free(w);
    free(scratch);
    return sum;
}

/* Stamps that all threads make together, some in parts, some larger than the image. */
static void together(const struct otf *t)
{
    enum { N = 8 };
    struct emitter *s = field(N, 300);
    struct view v = {.nx = 300, .ny = 250, .pixel = 0.05, .psf = t, .g1 = 0.03, .g2 = 0.04};
    struct accuracy a = ACCURACY_DEFAULT;
    struct plan p;
    struct image im[4];
    int good = 1, tall = 0, cut = 0;
    a.eps = 6e-8;
    if (scene_plan(&p, &v, &a, N, s))
        exit(1);
    for (size_t i = 0; i < N; i++) {
        tall += p.draw[i].ny > 200;
        cut += p.draw[i].path == PATH_FOURIER && p.grid[p.draw[i].grid].parts > 1;
    }
    for (int k = 0; k < 4; k++) {
        static const int threads[4] = {1, 2, 3, 7};
        good &= image_new(&im[k], v.nx, v.ny) == OK && scene_render(&p, &im[k], threads[k], NULL) == OK
                && !memcmp(im[k].pix, im[0].pix, image_count(&im[0]) * sizeof *im[0].pix);
    }
    check_that(good && tall > cut && cut > 0, "%d tall stamps, %d of them in parts: 1, 2, 3 and 7 threads give the same bytes", tall, cut);
    double *sum = sum_of_stamps(&p);
    struct check k = check_begin("tall stamps in the image = the sum of all stamps, each made alone (a rounding to float for each)");
    for (size_t i = 0; i < image_count(&im[0]); i++)
        check_close(&k, (double)im[0].pix[i], sum[i], N * 6e-8 * sum[image_count(&im[0]) + i]);
    check_end(&k);
    free(sum);
    for (int i = 0; i < 4; i++)
        image_free(&im[i]);
    plan_free(&p);
    field_free(s, N);
}

/* What is not asked for is not made. */
static void only_what_is_needed(const struct otf *t)
{
    struct view v = {.nx = 100, .ny = 100, .pixel = 0.1};
    struct emitter *s = field(50, 100);
    struct plan p;
    struct image im = render(&v, 1e-4, 50, s, 1, &p);
    check_that(p.fft_plans == 0 && p.n_matrix == 0 && p.count[PATH_FOURIER] == 0 && p.count[PATH_CLOSED] > 30,
               "no PSF: no transform is planned, no shear: no matrix");
    image_free(&im);
    v.psf = t;
    im = render(&v, 1e-4, 50, s, 1, &p);
    check_that(p.fft_plans > 1 && p.count[PATH_CLOSED] == 0, "PSF: %zu transforms planned", p.fft_plans);
    image_free(&im);
    field_free(s, 50);
}

/* The series and the exact shear; the table of the reference for n = 2 at gamma = .1 is 1.1e-4 in L2. */
static void series(void)
{
    const double c[6] = {0, 0, 0, 0, 1, 0}, gamma = 0.1;
    struct emitter s = {.x = 40, .y = 40, .flux = 1, .coef = c, .nmax = 2, .parity = 1, .beta = 0.4, .dilation = 1};
    struct view v = {.nx = 81, .ny = 81, .pixel = 0.1, .g1 = tanh(gamma) * cos(1.4), .g2 = tanh(gamma) * sin(1.4)};
    struct image exact = render(&v, 1e-9, 1, &s, 1, NULL);
    double before = 1, error[9] = {0};
    for (int order = 1; order <= 8; order++) {
        v.shear_order = order;
        struct image im = render(&v, 1e-9, 1, &s, 1, NULL);
        double d2 = 0, f2 = 0;
        for (size_t i = 0; i < image_count(&im); i++) {
            d2 += pow((double)im.pix[i] - (double)exact.pix[i], 2);
            f2 += pow((double)exact.pix[i], 2);
        }
        error[order] = sqrt(d2 / f2);
        check_that(error[order] < 0.3 * before, "shear order %d against exact: %.2g in L2", order, error[order]);
        before = fmax(error[order], 1e-7);
        image_free(&im);
    }
    check_that(error[4] > 3e-5 && error[4] < 2.2e-4, "order 4 at gamma = .1, n = 2: %.2g (reference 1.1e-4)", error[4]);
    image_free(&exact);
}

/* Positions that are edges, far away or no numbers; brightness from nothing to everything; shear undone. */
static void strange(const struct otf *t)
{
    const double c[1] = {1 / (2 * sqrt(PI) * 0.1)};
    const struct emitter good = {.x = 20, .y = 20, .flux = 1, .coef = c, .parity = 1, .beta = 0.1, .dilation = 1};
    struct emitter s[13];
    for (int i = 0; i < 13; i++)
        s[i] = good;
    s[1].x = 1e9, s[2].y = -1e300, s[12].y = -INFINITY, s[3].x = NAN, s[4].flux = INFINITY, s[5].beta = -1, s[6].dilation = 0;
    s[7].flux = 0, s[8].g1 = 1.5, s[9].x = -0.5, s[10].x = 39.5, s[11].y = 60;
    enum { SIDE = 40, MARGIN = 60, LARGE = SIDE + 2 * MARGIN };
    struct plan p;
    for (int psf = 0; psf < 2; psf++) {
        struct view v = {.nx = SIDE, .ny = SIDE, .pixel = 0.1, .psf = psf ? t : NULL};
        struct image im = render(&v, 1e-4, 13, s, 2, &p);
        check_that(p.n_bad == 5 && p.count[PATH_NONE] == (psf ? 9 : 10), "%s: %zu impossible objects counted, %zu are not drawn", psf ? "PSF" : "no PSF", p.n_bad,
                   p.count[PATH_NONE]);
        /* the possible ones that shine, on an image that holds them all */
        struct emitter seen[4] = {s[0], s[9], s[10], s[11]};
        for (int i = 0; i < 4; i++) {
            seen[i].x += MARGIN;
            seen[i].y += MARGIN;
        }
        v.nx = v.ny = LARGE;
        struct image all = render(&v, 1e-7, 4, seen, 1, NULL);
        struct check k = check_begin(psf ? "PSF: the others as in a larger image, of the peak" : "no PSF: the others as in a larger image, of the peak");
        const double peak = all.pix[(MARGIN + 20) * LARGE + MARGIN + 20];
        for (int i = 0; i < SIDE * SIDE; i++)
            check_close(&k, im.pix[i] / peak, all.pix[(MARGIN + i / SIDE) * LARGE + MARGIN + i % SIDE] / peak, psf ? 2e-4 : 1e-4);
        check_end(&k);
        if (!psf) {
            k = check_begin("no PSF: flux of one inside and two cut in halves by the border");
            check_close(&k, sum_of(&im), 2, 4e-6);     /* 1e-4 of the peak: a circle beyond 4.3 sigma, where 1e-4 of the light is, is made square */
            check_end(&k);
        }
        image_free(&all);
        image_free(&im);
    }
    /* 1e5 objects on one pixel, faint beside bright */
    enum { MANY = 100000 };
    struct emitter *many = malloc(MANY * sizeof *many);
    for (int i = 0; i < MANY; i++) {
        many[i] = good;
        many[i].coef = NULL;
        many[i].flux = i ? 0.1 : 1e6;
    }
    struct view v = {.nx = 40, .ny = 40, .pixel = 0.1};
    struct image im = render(&v, 1e-4, MANY, many, 1, NULL);
    struct check k = check_begin("1e5 faint points on a bright one: flux");
    check_close(&k, im.pix[20 * 40 + 20], 1e6 + 0.1 * (MANY - 1), 0.07);
    check_end(&k);
    image_free(&im);
    free(many);
    /* own shear undone by the field's */
    struct emitter e = good;
    e.g1 = -0.02, e.g2 = 0.6;
    v.g1 = 0.02, v.g2 = -0.6;
    struct image undone = render(&v, 1e-8, 1, &e, 1, NULL);
    v.g1 = v.g2 = 0;
    struct image plain = render(&v, 1e-8, 1, &good, 1, NULL);
    k = check_begin("a shear undone by its opposite, of the peak");
    for (size_t i = 0; i < image_count(&plain); i++)
        check_close(&k, undone.pix[i] / plain.pix[20 * 40 + 20], plain.pix[i] / plain.pix[20 * 40 + 20], 1e-7);
    check_end(&k);
    image_free(&undone);
    image_free(&plain);
}

/* A galaxy of order 8 with light in every coefficient, in double, on 128 x 128 pixels. */
static double *alone(const struct otf *t, const double own[2], const double field[2])
{
    enum { SIDE = 128 };
    double c[45];
    for (int i = 0; i < 45; i++)
        c[i] = i ? 3 * (uniform(77, i) - 0.5) : 3;
    const struct emitter e = {.x = 63.3, .y = 62.6, .flux = 1, .coef = c, .nmax = 8, .parity = 1, .beta = 0.3, .dilation = 1,
                              .rotation = 0.4, .g1 = own[0], .g2 = own[1]};
    const struct view v = {.nx = SIDE, .ny = SIDE, .pixel = 0.1, .psf = t, .g1 = field[0], .g2 = field[1]};
    struct accuracy a = ACCURACY_DEFAULT;
    struct plan p;
    a.eps = 1e-12;
    a.side_max = SIDE;
    if (scene_plan(&p, &v, &a, 1, &e))
        exit(1);
    double *sum = sum_of_stamps(&p);
    plan_free(&p);
    return sum;
}

enum { AREA = 128 * 128 };

/* All pixels of got, which this frees, against those of want, over the largest of want. */
static void compare(const char *psf, const char *what, double g, double *got, const double *want, double tolerance)
{
    char line[120];
    double peak = 0;
    snprintf(line, sizeof line, "%s: order 8, g = %g, %s, of the peak", psf, g, what);
    struct check k = check_begin(line);
    for (int i = 0; i < AREA; i++)
        peak = fmax(peak, fabs(want[i]));
    for (int i = 0; i < AREA; i++)
        check_close(&k, got[i] / peak, want[i] / peak, tolerance);
    check_end(&k);
    free(got);
}

/* Shears at an angle and their undoing, exactly and all but the last bit; zeros of both signs and the numbers next to them. */
static void undone(const struct otf *t)
{
    static const double strength[] = {0.05, 0.5, 0.9, 0.9999}, nothing[] = {-0.0, 5e-324, 1e-310}, zero[2] = {0, 0};
    for (int psf = 0; psf < 2; psf++) {
        const struct otf *through = psf ? t : NULL;
        const char *name = psf ? "PSF" : "no PSF";
        double *plain = alone(through, zero, zero);
        for (int k = 0; k < 4; k++) {
            const double g[2] = {strength[k] * cos(0.9), strength[k] * sin(0.9)}, back[2] = {-g[0], -g[1]};
            const double almost[2] = {-g[0], -nextafter(g[1], 0)};
            compare(name, "sheared at an angle and back", strength[k], alone(through, g, back), plain, 1e-12);
            if (strength[k] < 0.99)            /* beyond, the last bit is 4e-13 of the shear left */
                compare(name, "back but for a bit", strength[k], alone(through, g, almost), plain, 1e-12);
        }
        for (int k = 0; k < 3; k++) {
            const double g[2] = {nothing[k], nothing[k]};
            double *own = alone(through, g, zero), *field = alone(through, zero, g);
            int others = 0;
            for (int i = 0; i < AREA; i++)
                others += (float)own[i] != (float)plain[i] || (float)field[i] != (float)plain[i];
            check_that(others == 0, "%s: g = %g, own or the field's: %d of %d pixels of a file have other bytes than with 0", name, nothing[k], others, AREA);
            compare(name, "own, against 0", nothing[k], own, plain, nothing[k] != 0 ? 4e-15 : 0);
            compare(name, "the field's, against 0", nothing[k], field, plain, nothing[k] != 0 ? 4e-15 : 0);
        }
        free(plain);
    }
}

int main(void)
{
    struct otf t = {0};
    telescope(&t);
    determinism(&t);
    together(&t);
    only_what_is_needed(&t);
    series();
    strange(&t);
    undone(&t);
    extremes(&t);
    otf_free(&t);
    return check_status();
}
