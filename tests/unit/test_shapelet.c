/*
 * Shapelets against long double recurrences and quadrature with an independent rule,
 * identities, and the tables of $SHARED/truth/shapelets (mpmath, 70 digits).
 */
#include "shapelet.h"
#include "check.h"
#include "random.h"
#include "truth.h"
#include <float.h>

/* phi_0..phi_n at x in long double, plain recurrence (its exponent range needs no tricks). */
static void phi_long(int nmax, long double x, long double *p)
{
    p[0] = expl(-0.5L * x * x) / sqrtl(sqrtl(acosl(-1)));
    if (nmax > 0)
        p[1] = sqrtl(2) * x * p[0];
    for (int n = 1; n < nmax; n++)
        p[n + 1] = sqrtl(2.0L / (n + 1)) * x * p[n] - sqrtl(n / (n + 1.0L)) * p[n - 1];
}

/* 20 Gauss-Legendre nodes by bisection of sign changes of P_20: shares no code with quad.c. */
static void legendre_20(long double *x, long double *w)
{
    const int n = 20;
    int found = 0;
    long double last = 1;
    for (int i = 1; i <= 2000 && found < n; i++) {
        long double lo = -1 + 2.0L * (i - 1) / 2000, hi = -1 + 2.0L * i / 2000, slope = 0;
        long double sign = 0;
        for (int step = 0; step < 70; step++) {
            long double t = step == 0 ? hi : 0.5L * (lo + hi), p0 = 1, p1 = t;
            for (int k = 2; k <= n; k++) {
                long double p2 = ((2 * k - 1) * t * p1 - (k - 1) * p0) / k;
                p0 = p1;
                p1 = p2;
            }
            slope = n * (t * p1 - p0) / (t * t - 1);
            if (step == 0) {
                sign = last;
                last = p1;
                if ((sign > 0) == (p1 > 0))
                    break;
            } else if ((p1 > 0) == (sign > 0)) {
                lo = t;
            } else {
                hi = t;
            }
        }
        if ((sign > 0) != (last > 0)) {
            x[found] = 0.5L * (lo + hi);
            w[found] = 2 / ((1 - x[found] * x[found]) * slope * slope);
            found++;
        }
    }
}

/* Integrals of phi_0..phi_nmax over [a, b] by panels of at most 0.2. */
static void pixel_long(int nmax, long double a, long double b, long double *sum)
{
    long double x[20], w[20], p[SHAPELET_NMAX + 1];
    const long double far = sqrtl(2 * nmax + 1) + 14;
    legendre_20(x, w);
    for (int n = 0; n <= nmax; n++)
        sum[n] = 0;
    if (a < -far)
        a = -far;
    if (b > far)
        b = far;
    if (!(b > a))
        return;
    const int panels = (int)ceill((b - a) / 0.2L);
    for (int i = 0; i < panels; i++)
        for (int k = 0; k < 20; k++) {
            const long double h = (b - a) / panels;
            phi_long(nmax, a + h * (i + 0.5L + 0.5L * x[k]), p);
            for (int n = 0; n <= nmax; n++)
                sum[n] += 0.5L * h * w[k] * p[n];
        }
}

static void test_basis_random(void)
{
    struct check a = check_begin("basis: 4000 random points, orders to 200, absolute error / 1e-14");
    struct check r = check_begin("basis: the same, relative to max(|phi_n|, |phi_n-1|), 2e-13");
    unsigned long s = 1;
    static double b[201];
    static long double p[201];
    for (int i = 0; i < 4000; i++) {
        const double x = i % 2 ? 40 * (2 * uniform(&s) - 1) : 22 * (2 * uniform(&s) - 1);
        if (shapelet_basis(200, 1, 1, &x, b))
            check_that(0, "basis refuses %g", x);
        phi_long(200, x, p);
        for (int n = 0; n <= 200; n++) {
            check_close(&a, b[n], (double)p[n], 1e-14);
            long double scale = fabsl(p[n]);
            if (n && fabsl(p[n - 1]) > scale)
                scale = fabsl(p[n - 1]);
            if (scale > 1e-280L)
                check_close(&r, (double)((b[n] - p[n]) / scale), 0, 2e-13);
        }
    }
    check_end(&a);
    check_end(&r);
}

static void test_basis_scale(void)
{
    struct check c = check_begin("basis: B_n(x; beta) = beta^-1/2 phi_n(x/beta), blocks and odd lengths");
    static double x[131], b[13 * 131], one[13];
    for (int m = 0; m <= 131; m += m < 4 ? 1 : 21) {
        for (int i = 0; i < m; i++)
            x[i] = 0.31 * (i - 60);
        if (shapelet_basis(12, 2.5, m, x, b))
            check_that(0, "basis with m = %d", m);
        for (int i = 0; i < m; i++) {
            double t = x[i] / 2.5;
            if (shapelet_basis(12, 1, 1, &t, one))
                check_that(0, "basis");
            for (int n = 0; n <= 12; n++)
                check_close(&c, b[n * m + i], one[n] / sqrt(2.5), 4e-16);
        }
    }
    check_end(&c);
    const double far[6] = {INFINITY, -INFINITY, 1e308, -70, 53, 54};
    double v[6 * 61];
    int st = shapelet_basis(60, 1, 6, far, v), zero = 1;
    for (int i = 0; i < 6 * 61; i++)
        zero &= fabs(v[i]) < 1e-300;
    check_that(st == OK && zero, "basis: 0 at infinity and beyond 53");
    double bad = NAN;
    check_that(shapelet_basis(3, 1, 1, &bad, v) == OK && isnan(v[0]) && isnan(v[3]), "basis: NaN in, NaN out");
    v[0] = 7;
    check_that(shapelet_basis(-1, 1, 1, far, v) == E_RANGE && shapelet_basis(341, 1, 1, far, v) == E_RANGE
               && shapelet_basis(2, 0, 1, far, v) == E_RANGE && shapelet_basis(2, NAN, 1, far, v) == E_RANGE
               && shapelet_basis(2, INFINITY, 1, far, v) == E_RANGE && shapelet_basis(2, -1, 1, far, v) == E_RANGE
               && shapelet_basis(2, 1, -1, far, v) == E_RANGE && v[0] == 7,
               "basis: bad order, scale and length are refused and write nothing");
    struct check e = check_begin("basis: beta 1e-300 and 1e300");
    const double tiny = 1e-300, big = 1e300;
    if (shapelet_basis(4, 1e-300, 1, &tiny, v) || shapelet_basis(4, 1e300, 1, &big, v + 8) || shapelet_basis(4, 1, 1, (double[]){1}, v + 16))
        check_that(0, "basis at extreme scales");
    for (int n = 0; n < 5; n++) {
        check_close(&e, v[n] * 1e-150, v[16 + n], 1e-15);
        check_close(&e, v[8 + n] * 1e150, v[16 + n], 1e-15);
    }
    check_end(&e);
}

/* Worst |got - want| / min(h, 2/sqrt(2n+1)) over random pixels of width h: at order 200 the rounding of
 * the edges alone, h |phi'| 22 eps, takes 1e-14. */
static void test_pixel_random(void)
{
    static const double width[] = {1e-4, 1e-3, 1e-2, 0.05, 0.0999, 0.1, 0.12, 0.2, 0.5, 1, 2, 5, 20, 100};
    static double b[201];
    static long double want[201];
    unsigned long s = 2;
    for (int order = 60; order <= 200; order += 140)
        for (size_t k = 0; k < sizeof width / sizeof *width; k++) {
            const double tol = order == 60 ? 2e-14 : 4e-14;
            char name[100];
            snprintf(name, sizeof name, "pixel integrals: order %d, h = %g, random positions / (%g scale)", order, width[k], tol);
            struct check c = check_begin(name);
            for (int i = 0; i < (width[k] > 1 ? 20 : 150); i++) {
                const double h = width[k], at = (i % 3 ? 21 : 36) * (2 * uniform(&s) - 1);
                const double edge[2] = {at - 0.5 * h, at + 0.5 * h};
                if (shapelet_pixel(order, 1, 1, edge, b))
                    check_that(0, "pixel refuses");
                pixel_long(order, edge[0], edge[1], want);
                for (int n = 0; n <= order; n++)
                    check_close(&c, (double)(b[n] - want[n]), 0, tol * fmin(h, 2 / sqrt(2 * n + 1)));
            }
            check_end(&c);
        }
}

/* Far outside the turning point nothing cancels, so the integrals keep their relative accuracy. */
static void test_pixel_tails(void)
{
    static double b[61];
    static long double want[61];
    unsigned long s = 3;
    for (int k = 0; k < 8; k++) {
        const double h = (double[]){1e-4, 1e-2, 0.09, 0.1, 0.3, 0.99, 1.5, 4}[k];
        char name[100];
        snprintf(name, sizeof name, "pixel integrals: relative in the tails to 36, h = %g / 5e-14", h);
        struct check c = check_begin(name);
        for (int i = 0; i < 150; i++) {
            const double at = 36 * (2 * uniform(&s) - 1);
            const double edge[2] = {at - 0.5 * h, at + 0.5 * h};
            if (shapelet_pixel(60, 1, 1, edge, b))
                check_that(0, "pixel refuses");
            pixel_long(60, edge[0], edge[1], want);
            for (int n = 0; n <= 60; n++)
                if (fabs(at) - 0.5 * h > sqrt(2 * n + 1) + 1 && fabs(at) < sqrt(2 * n + 1) + 11)
                    check_close(&c, (double)(b[n] / want[n]), 1, 5e-14);
        }
        check_end(&c);
    }
}

static void test_pixel_identities(void)
{
    struct check c = check_begin("pixel integrals: mixed widths add up to the line, beta 0.3, order 40");
    static double edge[402], b[41 * 401], line[41];
    for (int i = 0; i <= 401; i++)        /* pixels on both sides of every switch */
        edge[i] = i <= 200 ? -6 + 0.015 * i : i <= 300 ? -3 + 0.05 * (i - 200) : 2 + 0.2 * (i - 300);
    if (shapelet_pixel(40, 0.3, 401, edge, b))
        check_that(0, "pixel refuses");
    shapelet_line_integrals(40, line);
    for (int n = 0; n <= 40; n++) {
        double sum = 0;
        for (int i = 0; i < 401; i++)
            sum += b[n * 401 + i];
        check_close(&c, sum, sqrt(0.3) * line[n], 2e-14);
    }
    check_end(&c);
    struct check one = check_begin("pixel integrals: a block of many pixels equals pixel by pixel");
    for (int i = 0; i < 401; i++) {
        double alone[41];
        if (shapelet_pixel(40, 0.3, 1, edge + i, alone))
            check_that(0, "pixel refuses");
        for (int n = 0; n <= 40; n++)
            check_close(&one, b[n * 401 + i], alone[n], 1e-300);
    }
    check_end(&one);
    struct check l = check_begin("pixel integrals: the whole line and half of it");
    const double inf[3] = {-INFINITY, 0, INFINITY};
    double two[2 * 41], all[41];
    if (shapelet_pixel(40, 1, 2, inf, two) || shapelet_pixel(40, 1, 1, (double[]){-INFINITY, INFINITY}, all))
        check_that(0, "pixel refuses infinite edges");
    for (int n = 0; n <= 40; n++) {
        check_close(&l, all[n], line[n], 1e-15);
        check_close(&l, two[2 * n] + two[2 * n + 1], line[n], 1e-15);
    }
    check_end(&l);
    check_that(shapelet_pixel(4, 1, 0, inf, two) == OK && shapelet_pixel(4, 1, 1, (double[]){3, 3}, two) == OK && two[0] == 0 && two[4] == 0,
               "pixel integrals: no pixel, and a pixel of no width");
    two[0] = 7;
    check_that(shapelet_pixel(4, 1, 1, (double[]){1, 0}, two) == E_RANGE && shapelet_pixel(4, 1, 1, (double[]){0, NAN}, two) == E_RANGE
               && shapelet_pixel(4, 1, 2, (double[]){0, 1, NAN}, two) == E_RANGE && shapelet_pixel(4, -1, 1, inf, two) == E_RANGE && two[0] == 7,
               "pixel integrals: falling or undefined edges are refused");
    struct check h = check_begin("pixel integrals: a pixel of 1e-300 and of 1e300");
    if (shapelet_pixel(2, 1, 1, (double[]){0, 1e-300}, all) || shapelet_pixel(2, 1, 1, (double[]){-1e300, 1e300}, two))
        check_that(0, "pixel refuses");
    check_close(&h, all[0] * 1e300, 0.75112554446494248286, 1e-15);
    check_close(&h, all[2] * 1e300, -0.75112554446494248286 * M_SQRT1_2, 1e-15);
    check_close(&h, two[2], line[2], 1e-15);
    check_end(&h);
}

static void test_sums(void)
{
    struct check c = check_begin("pixel_sum of basis tables is shapelet_value");
    static double f[400], x[70], y[9], bx[21 * 70], by[21 * 9], out[630];
    for (int m1 = 1; m1 <= 70; m1 += 23) {
        random_unit(shapelet_count(20), 5, f);
        for (int i = 0; i < m1; i++)
            x[i] = 0.2 * i - 3;
        for (int i = 0; i < 9; i++)
            y[i] = 0.7 * i - 2;
        if (shapelet_basis(20, 0.8, m1, x, bx) || shapelet_basis(20, 0.8, 9, y, by) || shapelet_pixel_sum(20, f, m1, bx, 9, by, out))
            check_that(0, "sum refuses");
        for (int j = 0; j < 9; j++)
            for (int i = 0; i < m1; i++)
                check_close(&c, out[j * m1 + i], shapelet_value(20, 0.8, f, x[i], y[j]), 2e-15);
    }
    check_end(&c);
    check_that(isnan(shapelet_value(-1, 1, f, 0, 0)) && isnan(shapelet_value(2, NAN, f, 0, 0)) && isnan(shapelet_value(2, 1, f, NAN, 0)),
               "value: NaN outside its domain");
    check_that(shapelet_count(0) == 1 && shapelet_count(12) == 91 && shapelet_count(-1) == 0
               && shapelet_index(0, 2) == 3 && shapelet_index(2, 0) == 5 && shapelet_index(1, 2) == 7, "count and index");
    static double b0[2] = {1, 2};
    check_that(shapelet_pixel_sum(0, (double[]){3}, 2, b0, 1, (double[]){5}, out) == OK && out[0] == 15 && out[1] == 30
               && shapelet_pixel_sum(0, b0, 0, b0, 4, b0, out) == OK && shapelet_pixel_sum(-1, b0, 1, b0, 1, b0, out) == E_RANGE,
               "pixel_sum: order 0, no pixel, bad order");
}

/* Transform by brute force: trapezium sums converge exponentially for these functions. */
static void test_fourier(void)
{
    struct check c = check_begin("fourier: coefficients and scale 1/beta against a direct transform");
    static double f[28], t[28];
    const int n = 6;
    const double beta = 0.7, h = 0.05, k[3][2] = {{0.3, -1.1}, {2, 1}, {-4, 3.5}};
    random_unit(shapelet_count(n), 11, f);
    shapelet_fourier(n, f, t);
    for (int q = 0; q < 3; q++) {
        double re = 0, im = 0, even[28] = {0}, odd[28] = {0};
        for (int i = -160; i <= 160; i++)
            for (int j = -160; j <= 160; j++) {
                double v = shapelet_value(n, beta, f, i * h, j * h) * h * h, a = k[q][0] * i * h + k[q][1] * j * h;
                re += v * cos(a);
                im -= v * sin(a);
            }
        for (int o = 0; o <= n; o++)
            for (int n1 = 0; n1 <= o; n1++)
                (o % 2 ? odd : even)[shapelet_index(n1, o - n1)] = t[shapelet_index(n1, o - n1)];
        check_close(&c, 2 * M_PI * shapelet_value(n, 1 / beta, even, k[q][0], k[q][1]), re, 1e-13);
        check_close(&c, 2 * M_PI * shapelet_value(n, 1 / beta, odd, k[q][0], k[q][1]), im, 1e-13);
    }
    check_end(&c);
}

static void test_moments(void)
{
    struct check c = check_begin("moments against trapezium sums");
    static double f[66];
    const double beta = 0.9, h = 0.05;
    double m[6], sum[6] = {0};
    random_unit(shapelet_count(10), 21, f);
    shapelet_moments(10, beta, f, m);
    for (int i = -240; i <= 240; i++)
        for (int j = -240; j <= 240; j++) {
            const double x = i * h, y = j * h, v = shapelet_value(10, beta, f, x, y) * h * h;
            const double w[6] = {1, x, y, x * x, x * y, y * y};
            for (int k = 0; k < 6; k++)
                sum[k] += v * w[k];
        }
    for (int k = 0; k < 6; k++)
        check_close(&c, m[k], sum[k], 1e-12);
    check_end(&c);
    shapelet_moments(-1, 1, f, m);
    check_that(isnan(m[0]) && isnan(m[5]), "moments: NaN for a bad order");
}

static void test_reach(void)
{
    /* table of the reference, 0.005 of rounding */
    static const int order[] = {0, 2, 6, 12, 20, 30, 60};
    static const double eps[] = {1e-3, 1e-4, 1e-6, 1e-8};
    static const double want[4][7] = {{3.72, 4.58, 5.69, 6.91, 8.18, 9.48, 12.50}, {4.29, 5.10, 6.17, 7.35, 8.59, 9.87, 12.86},
                                      {5.26, 5.99, 6.99, 8.11, 9.31, 10.56, 13.48}, {6.07, 6.75, 7.70, 8.78, 9.95, 11.16, 14.04}};
    struct check c = check_begin("reach against the support table");
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 7; k++)
            check_close(&c, shapelet_reach(order[k], eps[i]), want[i][k], 0.0051);
    check_end(&c);
    struct check d = check_begin("reach by its definition, orders 0..200: |phi_n(reach)| = eps max |phi_n|");
    long double p[201];
    for (int n = 0; n <= 200; n++) {
        long double top = 0;
        for (int i = 0; i <= 4000; i++) {
            phi_long(n, i * (sqrtl(2 * n + 1) / 4000), p);
            top = fabsl(p[n]) > top ? fabsl(p[n]) : top;
        }
        phi_long(n, shapelet_reach(n, 1e-16), p);
        check_close(&d, (double)(p[n] / top * 1e16L), 1, 2e-3);     /* the scan finds the maximum to 1e-3 */
        phi_long(n, shapelet_reach(n, 0.5), p);
        check_close(&d, (double)(p[n] / top * 2), 1, 2e-3);
    }
    check_end(&d);
    check_that(isnan(shapelet_reach(-1, 0.1)) && isnan(shapelet_reach(201, 0.1)) && isnan(shapelet_reach(3, 1))
               && isnan(shapelet_reach(3, NAN)) && isnan(shapelet_reach(3, 0)), "reach: NaN outside its domain");
}

static void test_rotation(void)
{
    static double c[2278], r[2278], back[2278], table[60000];
    static const int order[] = {0, 1, 2, 5, 12, 30, 60, 66};
    struct check v = check_begin("rotate: the rotated object at the rotated point, orders to 66");
    struct check o = check_begin("rotate: there and back");
    struct check t = check_begin("rotate: by table, a larger one, the same bits");
    struct check f = check_begin("rotate: flux kept");
    for (int k = 0; k < 8; k++)
        for (int a = 0; a < 4; a++) {
            const int n = order[k];
            const double rho = (double[]){0.7, -2.1, M_PI / 2, 100.3}[a];
            random_unit(shapelet_count(n), (unsigned long)(31 + k), c);
            if (shapelet_rotate(n, rho, c, r) || shapelet_rotate(n, -rho, r, back))
                check_that(0, "rotate refuses");
            for (size_t i = 0; i < shapelet_count(n); i++)
                check_close(&o, back[i], c[i], 3e-15);
            for (int i = 0; i < 30; i++) {
                const double x = 0.37 * (i % 6) - 1, y = 0.6 * (i / 6) - 1.3;
                check_close(&v, shapelet_value(n, 1.2, r, x * cos(rho) - y * sin(rho), x * sin(rho) + y * cos(rho)),
                            shapelet_value(n, 1.2, c, x, y), 3e-15);
            }
            if (shapelet_rotation_table(66, table) || shapelet_rotate_by(n, table, rho, c, back))
                check_that(0, "rotate by table refuses");
            for (size_t i = 0; i < shapelet_count(n); i++)
                check_close(&t, back[i], r[i], 1e-300);
            double m[6], mr[6];
            shapelet_moments(n, 1, c, m);
            shapelet_moments(n, 1, r, mr);
            check_close(&f, mr[0], m[0], 5e-15);
        }
    check_end(&v);
    check_end(&o);
    check_end(&t);
    check_end(&f);
    check_that(shapelet_rotate(67, 1, c, r) == E_RANGE && shapelet_rotate(-1, 1, c, r) == E_RANGE && shapelet_rotate(2, NAN, c, r) == E_RANGE
               && shapelet_rotate(2, INFINITY, c, r) == E_RANGE && shapelet_rotation_table(67, table) == E_RANGE, "rotate: domain");
    check_that(shapelet_rotation_count(66) <= sizeof table / sizeof *table, "rotation table of order 66: %zu doubles", shapelet_rotation_count(66));
    struct check w = check_begin("rotate: many turns are their remainder, order 66");
    random_unit(shapelet_count(66), 8, c);
    for (int k = 0; k < 3; k++) {
        const double rho = (double[]){1000.7, -3141.59, 200.3}[k];
        const double rest = (double)remainderl(rho, 2 * acosl(-1));
        if (shapelet_rotate(66, rho, c, r) || shapelet_rotate(66, rest, c, back))
            check_that(0, "rotate refuses");
        for (size_t i = 0; i < shapelet_count(66); i++)
            check_close(&w, r[i], back[i], 1e-14);
    }
    check_end(&w);
    random_unit(shapelet_count(5), 3, c);
    memcpy(r, c, sizeof c);
    shapelet_mirror(5, r);
    struct check m = check_begin("mirror: f(x, -y)");
    for (int i = 0; i < 20; i++)
        check_close(&m, shapelet_value(5, 1, r, 0.1 * i, 0.3 - 0.05 * i), shapelet_value(5, 1, c, 0.1 * i, 0.05 * i - 0.3), 1e-15);
    check_end(&m);
}

static void test_polar(void)
{
    struct check u = check_begin("polar: rows are orthonormal, order 60");
    for (int p = 0; p <= 60; p += 7)
        for (int q = 0; q <= 60; q += 6) {
            double re = 0, im = 0, a[2], b[2];
            for (int n1 = 0; n1 <= 60; n1++) {
                if (shapelet_polar(n1, 60 - n1, p, 60 - p, a) || shapelet_polar(n1, 60 - n1, q, 60 - q, b))
                    check_that(0, "polar refuses");
                re += a[0] * b[0] + a[1] * b[1];
                im += a[1] * b[0] - a[0] * b[1];
            }
            check_close(&u, re, p == q, 1e-15);
            check_close(&u, im, 0, 1e-15);
        }
    check_end(&u);
    double z[2];
    check_that(shapelet_polar(1, 1, 1, 0, z) == E_RANGE && shapelet_polar(34, 33, 33, 34, z) == E_RANGE && shapelet_polar(-1, 2, 0, 1, z) == E_RANGE,
               "polar: domain");
}

/* Tables of $SHARED/truth/shapelets. */
static void truth_phi(void)
{
    struct truth t = truth_read("shapelets/phi.tsv");
    if (!t.n) {
        check_skip("truth/shapelets/phi.tsv is not there");
        return;
    }
    struct check a = check_begin("truth phi: absolute, 1e-14"), r = check_begin("truth phi: relative, 1e-12, |phi| > 1e-280");
    for (int i = 0; i < t.n; i++) {
        const int n = (int)t.row[i][0];
        const double x = t.row[i][1], want = t.row[i][2];
        double b[100];
        if (n > 99 || shapelet_basis(n, 1, 1, &x, b))
            check_that(0, "truth phi: row %d", i);
        check_close(&a, b[n], want, 1e-14);
        if (fabs(want) > 1e-280)
            check_close(&r, b[n] / want, 1, 1e-12);
    }
    check_end(&a);
    check_end(&r);
    truth_free(&t);
}

static void truth_pixels(void)
{
    struct truth t = truth_read("shapelets/pixint.tsv");
    if (!t.n) {
        check_skip("truth/shapelets/pixint.tsv is not there");
        return;
    }
    struct check a = check_begin("truth pixint: 2e-14 min(b-a, 2/sqrt(2n+1))");
    for (int i = 0; i < t.n; i++) {
        const int n = (int)t.row[i][0];
        double b[100];
        if (n > 99 || shapelet_pixel(n, 1, 1, t.row[i] + 1, b))
            check_that(0, "truth pixint: row %d", i);
        check_close(&a, b[n], t.row[i][3], 2e-14 * fmin(t.row[i][2] - t.row[i][1], 2 / sqrt(2 * n + 1)));
    }
    check_end(&a);
    truth_free(&t);
}

static void truth_polar(void)
{
    struct truth t = truth_read("shapelets/polar.tsv");
    if (!t.n) {
        check_skip("truth/shapelets/polar.tsv is not there");
        return;
    }
    struct check a = check_begin("truth polar: 1e-15");
    for (int i = 0; i < t.n; i++) {
        const int n = (int)t.row[i][2], m = (int)t.row[i][3];
        double z[2];
        if (shapelet_polar((int)t.row[i][0], (int)t.row[i][1], (n - m) / 2, (n + m) / 2, z))
            check_that(0, "truth polar: row %d", i);
        check_close(&a, z[0], t.row[i][4], 1e-15);
        check_close(&a, z[1], t.row[i][5], 1e-15);
    }
    check_end(&a);
    truth_free(&t);
}

static void truth_moments(void)
{
    struct truth o = truth_read("shapelets/objects.tsv"), t = truth_read("shapelets/moments.tsv");
    if (!t.n || !o.n) {
        check_skip("truth/shapelets/moments.tsv is not there");
        return;
    }
    struct check a = check_begin("truth moments: 1e-13");
    for (int i = 0; i < t.n; i++) {
        double c[2278] = {0}, m[6], beta = 0;
        int nmax = 0;
        for (int k = 0; k < o.n; k++)
            if (o.row[k][0] == t.row[i][0]) {
                const int n1 = (int)o.row[k][2], n2 = (int)o.row[k][3];
                beta = o.row[k][1];
                nmax = n1 + n2 > nmax ? n1 + n2 : nmax;
                c[shapelet_index(n1, n2)] = o.row[k][4];
            }
        shapelet_moments(nmax, beta, c, m);
        check_close(&a, m[0] / t.row[i][1], 1, 1e-13);
        for (int k = 1; k < 6; k++)
            check_close(&a, m[k] / m[0], t.row[i][k + 1], 1e-13 * fmax(1, fabs(t.row[i][k + 1])));
    }
    check_end(&a);
    truth_free(&t);
    truth_free(&o);
}

int main(void)
{
    if (LDBL_MANT_DIG < 64)
        check_skip("long double is no wider than double: references below are only as good as double");
    test_basis_random();
    test_basis_scale();
    test_pixel_random();
    test_pixel_tails();
    test_pixel_identities();
    test_sums();
    test_fourier();
    test_moments();
    test_reach();
    test_rotation();
    test_polar();
    truth_phi();
    truth_pixels();
    truth_polar();
    truth_moments();
    return check_status();
}
