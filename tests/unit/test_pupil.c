/*
 * test_pupil.c - coverage by brute force, Zernike polynomials against Noll's
 * table and by orthogonality, closed-form and numerical transfer functions.
 */
#include "pupil.h"
#include "check.h"
#include <stdlib.h>
#include <string.h>

/* 1 inside the clear pupil, the definition itself; x, y in diameters */
static int clear_at(const struct pupil *p, double x, double y)
{
    int in = hypot(x, y) < 0.5 && hypot(x - p->offset[0], y - p->offset[1]) > p->obscuration / 2;
    for (int k = 0; k < p->struts; k++) {
        double a = M_PI / 180 * (p->strut_angle + 360.0 * k / p->struts), c = cos(a), s = sin(a);
        in &= !(x * c + y * s > 0 && fabs(y * c - x * s) < p->strut_width / p->diameter / 2);
    }
    for (int k = 0; k < p->pads; k++)
        in &= hypot(x - p->pad[k][0] / 2, y - p->pad[k][1] / 2) > p->pad[k][2] / 2;
    return in;
}

/* cells against 64 x 64 points each; sum against the sum of points */
static void coverage(const char *name, const struct pupil *p, int m)
{
    double *a = malloc((size_t)(m * m) * 8), h = 1.0 / m, sum = 0, want = 0;
    int bad = pupil_coverage(p, h, m, a), off = 0;
    for (int j = 0; j < m; j++)
        for (int i = 0; i < m; i++) {
            double n = 0;
            for (int k = 0; k < 4096; k++)
                n += clear_at(p, (i - m / 2. + (k % 64 + 0.5) / 64) * h, (j - m / 2. + (k / 64 + 0.5) / 64) * h);
            sum += a[j * m + i];
            want += n / 4096;
            off += !(fabs(a[j * m + i] - n / 4096) < 0.03);
        }
    check_that(!bad && off <= 12, "%s: coverage of %d x %d cells, %d differ by more than 0.03", name, m, m, off);
    /* at crossings of edges the covered parts are multiplied: of order one cell each */
    check_that(fabs(sum / want - 1) < 3e-4, "%s: covered area, relative error %.2g", name, sum / want - 1);
    free(a);
}

static void zernikes(void)
{
    static const double x = 0.37, y = -0.52;
    double r2 = x * x + y * y;
    /* Noll 1976, table 1, written out */
    double want[] = {NAN, 1, 2 * x, 2 * y, sqrt(3) * (2 * r2 - 1), 2 * sqrt(6) * x * y, sqrt(6) * (x * x - y * y),
                     sqrt(8) * (3 * r2 - 2) * y, sqrt(8) * (3 * r2 - 2) * x, sqrt(8) * (3 * x * x * y - y * y * y),
                     sqrt(8) * (x * x * x - 3 * x * y * y), sqrt(5) * (6 * r2 * r2 - 6 * r2 + 1),
                     sqrt(10) * (4 * r2 - 3) * (x * x - y * y), sqrt(10) * (4 * r2 - 3) * 2 * x * y,
                     sqrt(10) * (x * x * x * x - 6 * x * x * y * y + y * y * y * y), sqrt(10) * 4 * x * y * (x * x - y * y)};
    struct check c = check_begin("Z1 to Z15 are Noll's");
    for (int j = 1; j < 16; j++)
        check_close(&c, zernike(j, x, y), want[j], 1e-15 * 10);
    double rho = hypot(x, y), r6 = 20 * pow(rho, 6) - 30 * pow(rho, 4) + 12 * r2 - 1;
    check_close(&c, zernike(22, x, y), sqrt(7) * r6, 1e-14);
    check_end(&c);

    /* orthonormality of all j <= 66: midpoint in r^2, equal angles; exact to 1/200^2 */
    enum { J = 66, R = 400, A = 64 };
    static double z[J + 1][R * A];
    for (int j = 1; j <= J; j++)
        for (int k = 0; k < R * A; k++) {
            double r = sqrt((k / A + 0.5) / R), t = 2 * M_PI * (k % A) / A;
            z[j][k] = zernike(j, r * cos(t), r * sin(t));
        }
    c = check_begin("orthonormal over the disc, j <= 66");
    for (int i = 1; i <= J; i++)
        for (int j = 1; j <= i; j++) {
            double s = 0;
            for (int k = 0; k < R * A; k++)
                s += z[i][k] * z[j][k];
            check_close(&c, s / (R * A), i == j, 3e-3);
        }
    check_end(&c);
    check_that(isnan(zernike(0, 0, 0)) && isnan(zernike(ZERNIKE_MAX + 1, 0, 0)) && fabs(zernike(496, 0, 1)) < 10,
               "orders outside 1..%d are NaN, the last one is finite at the edge", ZERNIKE_MAX);
}

static void annulus_table(void)
{
    char name[4096], line[256];
    const char *shared = getenv("SHARED");
    snprintf(name, sizeof name, "%s/truth/shapelets/annulus_otf.tsv", shared ? shared : "../shared");
    FILE *f = fopen(name, "r");
    if (!f) {
        check_skip("annulus_otf.tsv: no reference data");
        return;
    }
    struct check c = check_begin("closed form against annulus_otf.tsv");
    while (fgets(line, sizeof line, f)) {
        double eps, u, t;
        if (line[0] != '#' && sscanf(line, "%lf %lf %lf", &eps, &u, &t) == 3) {
            check_close(&c, pupil_annulus(eps, 0, 0, u, 0), t, 2e-15);
            check_close(&c, pupil_annulus(eps, 0, 0, 0.6 * u, -0.8 * u), t, 4e-15);
        }
    }
    fclose(f);
    check_end(&c);
}

/* largest and rms difference of two tables; coarse nodes of b */
static double compare(const struct otf *a, const struct otf *b, double *rms)
{
    int k = (b->n - 1) / (a->n - 1), h = a->n / 2;
    double worst = 0, sum = 0;
    for (int j = -h; j <= h; j++)
        for (int i = -h; i <= h; i++) {
            size_t at = (size_t)(j + h) * (size_t)a->n + (size_t)(i + h);
            size_t bt = (size_t)(j * k + b->n / 2) * (size_t)b->n + (size_t)(i * k + b->n / 2);
            double d = hypot(a->re[at] - b->re[bt], (a->im ? a->im[at] : 0) - (b->im ? b->im[bt] : 0));
            worst = fmax(worst, d);
            sum += d * d;
        }
    *rms = sqrt(sum) / a->n;
    return worst;
}

/* the numerical path (Z4 of 0 waves forces it; struts of width 0 do not) against closed forms */
static void numerical(double eps, double ox, double oy)
{
    struct pupil p = telescope_preset(0)->pupil;
    p.struts = 0;
    p.obscuration = eps;
    p.offset[0] = ox;
    p.offset[1] = oy;
    struct otf exact = {0}, grid = {0};
    struct err e;
    int bad = pupil_otf(&p, 128, &exact, &e);
    p.terms = 1;
    p.noll[0] = 4;
    bad |= pupil_otf(&p, 128, &grid, &e);
    double rms, worst = compare(&grid, &exact, &rms), h = exact.n / 2;
    check_that(!bad && worst < 8e-4 && rms < 1.5e-5 && exact.re[(size_t)(h * exact.n + h)] == 1,
               "obscuration %g at (%g,%g): cells against closed form at M = 128: max %.2g rms %.2g", eps, ox, oy, worst, rms);
    otf_free(&exact);
    otf_free(&grid);
}

static void convergence(void)
{
    struct pupil p = telescope_preset(0)->pupil;
    struct otf t[3] = {{0}};
    struct err e;
    double rms, worst;
    int bad = pupil_otf(&p, 64, &t[0], &e) | pupil_otf(&p, 256, &t[1], &e) | pupil_otf(&p, 1024, &t[2], &e);
    worst = compare(&t[1], &t[2], &rms);
    check_that(!bad && worst < 6e-4 && rms < 1e-5, "three vanes, M = 256 against 1024: max %.3g rms %.3g", worst, rms);
    worst = compare(&t[0], &t[2], &rms);
    check_that(worst > 1.5e-3 && worst < 3e-3, "and M = 64: max %.3g rms %.3g", worst, rms);
    /* T from the definition: overlap of the shifted pupil on 2000 x 2000 points, along a vane and across */
    struct check c = check_begin("against counted overlaps");
    double shift[][2] = {{0.1, 0.02}, {-0.31, 0.25}, {0.5, 0.5}, {0.015625, 0}, {0, 0.75}};
    for (int s = 0; s < 5; s++) {
        long both = 0, lit = 0;
        for (int j = 0; j < 2000; j++)
            for (int i = 0; i < 2000; i++) {
                double x = (i + 0.5) / 2000 - 0.5, y = (j + 0.5) / 2000 - 0.5;
                int in = clear_at(&p, x, y);
                lit += in;
                both += in && clear_at(&p, x + shift[s][0], y + shift[s][1]);
            }
        double u[2] = {shift[s][0] * t[2].ucut, shift[s][1] * t[2].ucut}, got;
        bad |= otf_spline(&t[2]) | otf_grid(&t[2], 1, &u[0], 1, &u[1], &got, NULL);
        check_close(&c, got, (double)both / (double)lit, 5e-4);
    }
    check_end(&c);
    for (int i = 0; i < 3; i++)
        otf_free(&t[i]);
}

/* a tilt moves the image, whatever else is there: T gets exp(-2 pi i u.x0), x0 = 4 c lambda / D */
static void tilt(void)
{
    struct pupil p = telescope_preset(0)->pupil;
    p.terms = 1;
    p.noll[0] = 8;
    p.waves[0] = 0.08;
    struct otf a = {0}, b = {0};
    struct err e;
    int bad = pupil_otf(&p, 64, &a, &e);
    p.terms = 3;
    p.noll[1] = 2;
    p.waves[1] = 0.31;
    p.noll[2] = 3;
    p.waves[2] = -0.17;
    bad |= pupil_otf(&p, 64, &b, &e);
    struct check c = check_begin("Z2 = .31, Z3 = -.17 waves: 1.24 and -.68 lambda/D");
    for (int j = 0; j < a.n; j++)
        for (int i = 0; i < a.n; i++) {
            size_t at = (size_t)j * (size_t)a.n + (size_t)i;
            double t = 2 * M_PI * (1.24 * (i - 64) - 0.68 * (j - 64)) / 64;
            check_close(&c, b.re[at], a.re[at] * cos(t) + a.im[at] * sin(t), 1e-14);
            check_close(&c, b.im[at], a.im[at] * cos(t) - a.re[at] * sin(t), 1e-14);
        }
    check_end(&c);
    check_that(!bad, "coma and tilt");
    c = check_begin("T(-u) is the conjugate of T(u)");
    for (size_t i = 0, n = (size_t)b.n * (size_t)b.n; i < n; i++) {
        check_close(&c, b.re[i], b.re[n - 1 - i], 1e-14);
        check_close(&c, b.im[i], -b.im[n - 1 - i], 1e-14);
    }
    check_end(&c);
    otf_free(&a);
    otf_free(&b);
}

static void band(void)
{
    struct pupil p = telescope_preset(0)->pupil;
    p.struts = 0;
    p.bandwidth = 0.2 * p.wavelength;
    struct otf t[4] = {{0}}, g = {0};
    struct err e;
    int n[] = {1, 3, 6, 48}, bad = 0;
    double rms, worst[3];
    for (int i = 0; i < 4; i++) {
        p.wavelengths = n[i];
        bad |= pupil_otf(&p, 64, &t[i], &e);
    }
    for (int i = 0; i < 3; i++)
        worst[i] = compare(&t[i], &t[3], &rms);
    check_that(!bad && worst[0] > 4e-3 && worst[0] < 1.2e-2 && worst[1] < 6e-4 && worst[2] < 1.5e-4,
               "band of +-10 %%: 1, 3, 6 wavelengths against 48: %.2g %.2g %.2g", worst[0], worst[1], worst[2]);
    p.wavelengths = 6;
    p.terms = 1;
    p.noll[0] = 4;
    bad |= pupil_otf(&p, 64, &g, &e);
    worst[0] = compare(&g, &t[2], &rms);
    check_that(!bad && worst[0] < 4e-3 && rms < 1.5e-4, "cells of each wavelength share the nodes: max %.2g rms %.2g", worst[0],
               rms);
    for (int i = 0; i < 4; i++)
        otf_free(&t[i]);
    otf_free(&g);
}

static void hard(void)
{
    struct pupil p = telescope_preset(0)->pupil, q = p;
    struct otf t = {.n = 77};
    struct err e;
    q.obscuration = 1;
    check_that(pupil_otf(&q, 64, &t, &e) == E_SINGULAR && t.n == 77, "wholly obscured: %s", e.text);
    q = p;
    q.strut_width = 9;
    check_that(pupil_otf(&q, 64, &t, &e) == E_SINGULAR && t.n == 77, "vanes that cover everything: %s", e.text);
    q = p;
    q.terms = 1;
    q.noll[0] = 4;
    q.waves[0] = 40;
    check_that(pupil_otf(&q, 64, &t, &e) == E_RANGE && t.n == 77, "40 waves of defocus: %s", e.text);
    q.waves[0] = NAN;
    check_that(pupil_otf(&q, 64, &t, &e) == E_RANGE && t.n == 77, "NaN waves: %s", e.text);
    q = p;
    q.wavelength = NAN;
    check_that(pupil_otf(&q, 64, &t, &e) == E_RANGE && pupil_otf(&p, 7, &t, &e) == E_RANGE && t.n == 77, "NaN wavelength, tiny grid");
    q = p;
    q.obscuration = 0.99;
    q.struts = 0;
    check_that(pupil_otf(&q, 256, &t, &e) == OK && t.re[t.n / 2 * t.n + t.n / 2] == 1, "a ring of 1 %%");
    otf_free(&t);
    struct check c = check_begin("a vane thinner than a cell counts by its coverage: area");
    for (double w = 1e-4; w < 0.1; w *= 3) {
        q = p;
        q.strut_width = w;
        double want = M_PI * (1 - 0.09) - 3 * w * 0.7;
        check_close(&c, pupil_area(&q, 256), want, 5e-5 + 1.5 * w * w);
    }
    check_end(&c);
    c = check_begin("collecting areas of the presets, m^2 (roman: public figure)");
    const double area[] = {2.775, 3.893, 0.979, 3.757};
    for (int i = 0; i < 4; i++)
        check_close(&c, pupil_area(&telescope_preset(i)->pupil, 512), area[i], 0.002);
    check_end(&c);
    check_that(!telescope_preset(-1) && !telescope_preset(4), "four presets");
}

int main(void)
{
    struct pupil p = telescope_preset(0)->pupil;
    coverage("snap", &p, 64);
    coverage("hst", &telescope_preset(1)->pupil, 64);
    p.offset[0] = 0.07;
    p.offset[1] = -0.11;
    p.struts = 5;
    p.strut_angle = -17;
    coverage("obscuration off the axis, five vanes", &p, 51);
    zernikes();
    annulus_table();
    numerical(0, 0, 0);
    numerical(0.4, 0, 0);
    numerical(0.3, 0.12, -0.2);
    convergence();
    tilt();
    band();
    hard();
    return check_status();
}
