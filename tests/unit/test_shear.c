/*
 * Shear against its definition f'(x) = f(exp(-Gamma) x) at points and in pixels, long double
 * quadrature, round trips, and the tables of $SHARED/truth/shapelets (mpmath, 70 digits).
 */
#include "shear.h"
#include "quad.h"
#include "shapelet.h"
#include "check.h"
#include "random.h"
#include "truth.h"

/* f(exp(-Gamma) x) from the definition. */
static double sheared_value(int nmax, double beta, const double *c, double g1, double g2, double x, double y)
{
    const double s = 1 / sqrt(1 - g1 * g1 - g2 * g2);
    return shapelet_value(nmax, beta, c, s * ((1 - g1) * x - g2 * y), s * (-g2 * x + (1 + g1) * y));
}

static void test_quad(void)
{
    static const int sizes[] = {1, 2, 3, 4, 5, 10, 17, 40, 101, 256, 399, 400};
    static double x[QUAD_NMAX], w[QUAD_NMAX];
    struct check l = check_begin("quad: Legendre integrates x^k to degree 2n-1 (k <= 60)");
    struct check h = check_begin("quad: Hermite keeps phi_j phi_k orthonormal, j+k <= 2n-1");
    struct check s = check_begin("quad: nodes rise and mirror");
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        const int n = sizes[i];
        if (quad_legendre(n, x, w))
            check_that(0, "Legendre refuses %d", n);
        for (int k = 0; k <= 2 * n - 1 && k <= 60; k++) {
            double sum = 0;
            for (int j = 0; j < n; j++)
                sum += w[j] * pow(x[j], k);
            check_close(&l, sum, k % 2 ? 0 : 2.0 / (k + 1), 1e-14);
        }
        for (int j = 1; j < n; j++)
            check_close(&s, x[j] > x[j - 1] && x[j] == -x[n - 1 - j] && w[j] == w[n - 1 - j] && w[j] > 0, 1, 0.1);
        if (quad_hermite(n, x, w))
            check_that(0, "Hermite refuses %d", n);
        static double b[61 * QUAD_NMAX];
        const int top = n - 1 < 60 ? n - 1 : 60;
        if (shapelet_basis(top, 1, n, x, b))
            check_that(0, "basis");
        for (int a = 0; a <= top; a++) {
            double sum = 0, cross = 0;
            for (int j = 0; j < n; j++) {
                sum += w[j] * b[a * n + j] * b[a * n + j];
                cross += w[j] * b[a * n + j] * b[top * n + j];
            }
            check_close(&h, sum, 1, 1e-14);
            check_close(&h, cross, a == top, 1e-14);
        }
        for (int j = 1; j < n; j++)
            check_close(&s, x[j] > x[j - 1] && x[j] == -x[n - 1 - j] && w[j] == w[n - 1 - j] && w[j] > 0, 1, 0.1);
    }
    check_end(&l);
    check_end(&h);
    check_end(&s);
    check_that(quad_legendre(0, x, w) == E_RANGE && quad_legendre(401, x, w) == E_RANGE && quad_hermite(0, x, w) == E_RANGE
               && quad_hermite(401, x, w) == E_RANGE, "quad: sizes");
}

static void test_matrix(void)
{
    double a[4], b[4] = {7, 7, 7, 7};
    struct check c = check_begin("matrix: exp(Gamma) exp(-Gamma) = 1, determinant 1, axis ratio (1-g)/(1+g)");
    for (int i = 0; i < 12; i++) {
        const double g = (double[]){0, -0.0, 5e-324, 1e-8, 0.05, 0.3, 0.5, 0.7, 0.9, 0.99, 0.999, 0.9999}[i];
        const double g1 = g * cos(1.1), g2 = g * sin(1.1);
        if (shear_matrix(g1, g2, a) || shear_matrix(-g1, -g2, b))
            check_that(0, "matrix refuses %g", g);
        const double big = a[0] * a[0] + a[3] * a[3];
        check_close(&c, a[0] * b[0] + a[1] * b[2], 1, 4e-16 * big);
        check_close(&c, a[0] * b[1] + a[1] * b[3], 0, 4e-16 * big);
        check_close(&c, a[0] * a[3] - a[1] * a[2], 1, 4e-16 * big);
        const double mean = 0.5 * (a[0] + a[3]), half = hypot(0.5 * (a[0] - a[3]), a[1]);
        check_close(&c, half / mean, hypot(g1, g2), 4e-16);
    }
    check_end(&c);
    b[0] = 7;
    check_that(shear_matrix(1, 0, b) == E_RANGE && shear_matrix(0.8, 0.6, b) == E_RANGE && shear_matrix(NAN, 0, b) == E_RANGE
               && shear_matrix(0, -INFINITY, b) == E_RANGE && b[0] == 7, "matrix: |g| >= 1 and NaN are refused");
}

/* Elements by trapezium sums in long double, which converge exponentially. */
static void test_squeeze(void)
{
    static double m[61 * 61];
    static long double p[61], q[61], sum[61][61];
    struct check c = check_begin("squeeze: against long double sums of the definition, orders to 60 / 2e-14");
    for (int i = 0; i < 4; i++) {
        const double t = (double[]){0.05, -0.3, 0.5, 0.9}[i];
        const long double er = sqrtl((1 - (long double)t) / (1 + (long double)t)), h = fminl(1, 1 / er) / 16;
        const int top = (int)(16 * fmaxl(1, 1 / er) / h);
        memset(sum, 0, sizeof sum);
        for (int k = -top; k <= top; k++) {
            for (int side = 0; side < 2; side++) {
                const long double x = k * h * (side ? er : 1);
                long double *f = side ? q : p;
                f[0] = expl(-0.5L * x * x) / sqrtl(sqrtl(acosl(-1)));
                f[1] = sqrtl(2) * x * f[0];
                for (int n = 1; n < 60; n++)
                    f[n + 1] = sqrtl(2.0L / (n + 1)) * x * f[n] - sqrtl(n / (n + 1.0L)) * f[n - 1];
            }
            for (int a = 0; a <= 60; a++)
                for (int b = a % 2; b <= 60; b += 2)
                    sum[a][b] += h * sqrtl(er) * p[a] * q[b];
        }
        if (shear_squeeze(60, 60, t, m))
            check_that(0, "squeeze refuses");
        for (int a = 0; a <= 60; a++)
            for (int b = 0; b <= 60; b++)
                check_close(&c, m[a * 61 + b], (double)sum[a][b], 2e-14);
    }
    check_end(&c);
    struct check u = check_begin("squeeze: M(t) M(-t) = 1 and M(-t) = M(t)^T, low orders in 340");
    static double big[341 * 13], inv[13 * 341];
    for (int i = 0; i < 3; i++) {
        const double t = (double[]){1e-9, 0.2, 0.6}[i];
        if (shear_squeeze(12, 340, t, big) || shear_squeeze(340, 12, -t, inv))
            check_that(0, "squeeze refuses");
        for (int a = 0; a <= 12; a++)
            for (int b = 0; b <= 12; b++) {
                double s = 0;
                for (int k = 0; k <= 340; k++)
                    s += inv[a * 341 + k] * big[k * 13 + b];
                check_close(&u, s, a == b, 2e-14);
            }
        for (int a = 0; a <= 12; a++)
            for (int k = 0; k <= 340; k++)
                check_close(&u, inv[a * 341 + k], big[k * 13 + a], 2e-14);
    }
    check_end(&u);
    if (shear_squeeze(3, 2, -0.0, m))
        check_that(0, "squeeze refuses 0");
    check_that(m[0] == 1 && m[5] == 1 && m[10] == 1 && m[1] == 0 && m[2] == 0 && m[3] == 0 && m[11] == 0, "squeeze: unit matrix at t = 0");
    m[0] = 7;
    check_that(shear_squeeze(3, 3, 1, m) == E_RANGE && shear_squeeze(3, 3, NAN, m) == E_RANGE && shear_squeeze(-1, 3, 0.1, m) == E_RANGE
               && shear_squeeze(3, 341, 0.1, m) == E_RANGE && m[0] == 7, "squeeze: domain");
}

static const double shears[][2] = {{0, 0}, {-0.0, -0.0}, {5e-324, 0}, {1e-300, -1e-300}, {0.05, 0}, {0, -0.05}, {-0.05, 0.02}, {0.1, 0.1}, {-0.1, 0}};

static void test_exact(void)
{
    static double c[28], out[2278], back[2278], dense[2278 * 28], again[2278];
    struct check v = check_begin("exact: the definition at points, nmax 6, |g| to 0.14, nout 60");
    struct check r = check_begin("exact: shear and unshear");
    struct check f = check_begin("exact: flux kept");
    struct check l = check_begin("exact: L2 norm kept");
    struct check d = check_begin("exact: as a matrix");
    for (size_t k = 0; k < sizeof shears / sizeof *shears; k++) {
        const double g1 = shears[k][0], g2 = shears[k][1];
        random_unit(shapelet_count(6), 40 + k, c);
        if (shear_exact(6, c, g1, g2, 60, out) || shear_exact(60, out, -g1, -g2, 66, back))
            check_that(0, "exact refuses");
        double norm = 0, m[6], mo[6];
        for (size_t i = 0; i < shapelet_count(66); i++)
            check_close(&r, back[i], i < 28 ? c[i] : 0, 1e-14);
        for (size_t i = 0; i < shapelet_count(60); i++)
            norm += out[i] * out[i];
        check_close(&l, norm, 1, 3e-15);
        shapelet_moments(6, 1, c, m);
        shapelet_moments(60, 1, out, mo);
        check_close(&f, mo[0], m[0], 5e-15);
        for (int i = 0; i < 40; i++) {
            const double x = 0.7 * (i % 8) - 2.5, y = 0.9 * (i / 8) - 2.1;
            check_close(&v, shapelet_value(60, 1.3, out, x, y), sheared_value(6, 1.3, c, g1, g2, x, y), 1e-14);
        }
        if (shear_matrix_coeff(6, 60, g1, g2, dense))
            check_that(0, "matrix refuses");
        shear_apply(6, 60, dense, c, again);
        for (size_t i = 0; i < shapelet_count(60); i++)
            check_close(&d, again[i], out[i], 2e-15);
    }
    check_end(&v);
    check_end(&r);
    check_end(&f);
    check_end(&l);
    check_end(&d);
    random_unit(shapelet_count(6), 1, c);
    int same = shear_exact(6, c, 0, -0.0, 7, out) == OK && memcmp(c, out, sizeof c) == 0;
    for (int i = 28; i < 36; i++)
        same &= out[i] == 0;
    check_that(same, "exact: g = 0 copies, zeros above");
    double one = 2.5, s0;
    check_that(shear_exact(0, &one, 0.6, 0, 0, &s0) == OK && fabs(s0 - 2.5 * 0.8) < 4e-15, "exact: order 0 alone is sqrt(1-g^2)");
    s0 = 7;
    check_that(shear_exact(6, c, 0.1, 0, 5, &s0) == E_RANGE && shear_exact(6, c, 0.1, 0, 67, &s0) == E_RANGE && shear_exact(-1, c, 0.1, 0, 5, &s0) == E_RANGE
               && shear_exact(6, c, 1, 0, 8, &s0) == E_RANGE && shear_exact(6, c, NAN, 0, 8, &s0) == E_RANGE
               && shear_matrix_coeff(6, 5, 0.1, 0, &s0) == E_RANGE && s0 == 7, "exact: domain");
}

static void test_growth(void)
{
    static double c[231], out[2278];
    double worst = 0;
    int n_checked = 0;
    for (int nmax = 0; nmax <= 20; nmax += nmax < 4 ? 1 : 4)
        for (int k = 0; k < 5; k++)
            for (int e = 0; e < 4; e++)
                for (int kind = 0; kind < 4; kind++) {
                    const double g = (double[]){0.02, 0.05, 0.1, 0.3, 0.5}[k], eps = (double[]){1e-2, 1e-3, 1e-6, 1e-9}[e];
                    const int nout = nmax + shear_growth(nmax, g, eps);
                    if (nout > 60)
                        continue;
                    random_unit(shapelet_count(nmax), (unsigned long)kind + 1, c);
                    if (kind > 0) {
                        memset(c, 0, sizeof c);      /* single states are the worst */
                        c[kind == 1 ? shapelet_index(nmax, 0) : kind == 2 ? shapelet_index(nmax / 2, nmax - nmax / 2) : shapelet_index(0, nmax)] = 1;
                    }
                    if (shear_exact(nmax, c, g, 0, 66, out))
                        check_that(0, "exact refuses");
                    double kept = 0, lost = 0;
                    for (size_t i = 0; i < shapelet_count(66); i++)
                        *(i < shapelet_count(nout) ? &kept : &lost) += out[i] * out[i];
                    worst = fmax(worst, sqrt(lost) / eps);
                    n_checked++;
                }
    check_that(n_checked > 100 && worst <= 1, "growth: L2 lost beyond it at most %.3g of eps in %d cases", worst, n_checked);
    check_that(shear_growth(12, 0, 1e-6) == 0 && shear_growth(12, 0.05, 1e-3) <= 12 && shear_growth(12, 0.05, 1e-6) <= 18
               && shear_growth(12, 0.1, 1e-6) <= 26, "growth: %d %d %d at nmax 12 for (0.05, 1e-3) (0.05, 1e-6) (0.1, 1e-6): useful",
               shear_growth(12, 0.05, 1e-3), shear_growth(12, 0.05, 1e-6), shear_growth(12, 0.1, 1e-6));
    check_that(shear_growth(3, 1, 0.1) >= 100000 && shear_growth(3, NAN, 0.1) >= 100000 && shear_growth(3, 0.1, 0) >= 100000
               && shear_growth(3, 0.1, NAN) >= 100000 && shear_growth(3, 0.999999999, 1e-6) >= 100000, "growth: never fits outside the domain");
}

static void test_series(void)
{
    static double c[91], out[500], exact[2278];
    /* the error of order k falls as gamma^(k+1) */
    struct check c1 = check_begin("series: error falls 2^(order+1) when g is halved, orders 1..8, 15 %");
    for (int order = 1; order <= 8; order++) {
        double err[2] = {0, 0};
        for (int k = 0; k < 2; k++) {
            const double g1 = (k ? 0.006 : 0.012) * (order > 4 ? 6 : 1), g2 = 0.5 * g1;
            random_unit(shapelet_count(2), 77, c);
            if (shear_series(2, c, g1, g2, order, out) || shear_exact(2, c, g1, g2, 60, exact))
                check_that(0, "series refuses");
            for (size_t i = 0; i < shapelet_count(60); i++) {
                const double d = (i < shapelet_count(2 + 2 * order) ? out[i] : 0) - exact[i];
                err[k] += d * d;
            }
        }
        check_close(&c1, sqrt(err[0] / err[1]) / exp2(order + 1), 1, 0.15);
    }
    check_end(&c1);
    struct check f = check_begin("series: flux kept with its growth");
    for (int order = 1; order <= 8; order++) {
        double m[6], mo[6];
        random_unit(shapelet_count(12), 78, c);
        if (shear_series(12, c, 0.05, -0.02, order, out))
            check_that(0, "series refuses");
        shapelet_moments(12, 1, c, m);
        shapelet_moments(12 + 2 * order, 1, out, mo);
        check_close(&f, mo[0], m[0], 5e-15);
    }
    check_end(&f);
    check_that(shear_series(12, c, 0, 0, 4, out) == OK && memcmp(c, out, sizeof c) == 0 && out[91] == 0, "series: g = 0 copies");
    out[0] = 7;
    check_that(shear_series(67, c, 0.1, 0, 4, out) == E_RANGE && shear_series(2, c, 0.1, 0, 9, out) == E_RANGE && shear_series(2, c, 0.1, 0, 0, out) == E_RANGE
               && shear_series(2, c, 1, 0, 4, out) == E_RANGE && shear_series(2, c, NAN, 0, 4, out) == E_RANGE && out[0] == 7, "series: domain");
}

/* One unit in the last digit of a number written like 3.7e-3 or 0.25. */
static double last_digit(const char *s)
{
    const char *e = strchr(s, 'e'), *point = strchr(s, '.');
    const int digits = point ? (int)(e ? e - point : (long)strlen(point)) - 1 : 0;
    return pow(10, (e ? atoi(e + 1) : 0) - digits);
}

/*
 * Truncation error of the series in L2, full growth, direction 2 phi = 0.7, worst of |n,0> and |n/2,n/2>: table of the
 * reference (simulation-math.md, 5), orders 1 2 3 4 6 8, to its last printed digit.
 */
static void test_series_table(void)
{
    static const int orders[] = {1, 2, 3, 4, 6, 8};
    static const struct { int n; double gamma; const char *error[6]; } row[] = {
        {0, 0.05, {"2.8e-3", "1.6e-4", "9.7e-6", "5.8e-7", "2e-9", "8e-12"}}, {2, 0.05, {"8.3e-3", "6.6e-4", "4.9e-5", "3.6e-6", "2e-8", "9e-11"}},
        {8, 0.05, {"4.9e-2", "7.1e-3", "8.9e-4", "1.0e-4", "1e-6", "9e-9"}},  {12, 0.05, {"9.8e-2", "1.9e-2", "3.1e-3", "4.4e-4", "7e-6", "8e-8"}},
        {20, 0.05, {"0.25", "7.4e-2", "1.8e-2", "3.7e-3", "1e-4", "2e-6"}},   {2, 0.1, {"3.3e-2", "5.2e-3", "7.9e-4", "1.1e-4", "2e-6", "4e-8"}},
        {12, 0.1, {"0.38", "0.15", "4.9e-2", "1.4e-2", "8e-4", "4e-5"}},      {20, 0.1, {"0.93", "0.56", "0.28", "0.11", "1.4e-2", "1e-3"}},
        {2, 0.3, {"0.28", "0.13", "6e-2", "2.6e-2", "5e-3", "8e-4"}},         {12, 0.3, {"2.6", "3.2", "3.2", "2.8", "1.6", "0.7"}},
        {2, 0.5, {"0.72", "0.56", "0.42", "0.31", "0.15", "7e-2"}},           {12, 0.5, {"4.4", "10", "18", "28", "46", "57"}}};
    static double c[231], out[2278], exact[2278];
    struct check k = check_begin("series: table of truncation errors, orders 1 to 8, gamma .05 to .5, n 0 to 20");
    for (size_t r = 0; r < sizeof row / sizeof *row; r++)
        for (int o = 0; o < 6; o++) {
            const int n = row[r].n, nout = n + 2 * orders[o];
            const double g = tanh(row[r].gamma), g1 = g * cos(0.7), g2 = g * sin(0.7);
            double worst = 0;
            for (int state = 0; state < 2; state++) {
                memset(c, 0, sizeof c);
                c[shapelet_index(state ? n / 2 : n, state ? n / 2 : 0)] = 1;
                if (shear_series(n, c, g1, g2, orders[o], out) || shear_exact(n, c, g1, g2, 66, exact))
                    check_that(0, "series refuses");
                double d2 = 0, beyond = 1;   /* power of the exact one above order 66 */
                for (size_t i = 0; i < shapelet_count(66); i++) {
                    const double d = (i < shapelet_count(nout) ? out[i] : 0) - exact[i];
                    d2 += d * d;
                    beyond -= exact[i] * exact[i];
                }
                worst = fmax(worst, sqrt(d2 + (beyond > 1e-13 ? beyond : 0)));
            }
            check_close(&k, worst, atof(row[r].error[o]), 0.5 * last_digit(row[r].error[o]));
        }
    check_end(&k);
}

static void test_grid(void)
{
    static double c[1891], even[70 * 3], odd[70 * 3], all[70 * 3], x[3] = {-0.8, 0.3, 1.9}, y[70], half[1891];
    struct check v = check_begin("grid: f(A x) at points, even and odd orders, nmax to 60, |g| to 0.9 / 2e-14");
    for (int k = 0; k < 6; k++) {
        const int nmax = (int[]){0, 1, 7, 12, 30, 60}[k];
        const double g = (double[]){0.9, -0.5, 0.05, 0.9, 0.3, 0.9}[k];
        random_unit(shapelet_count(nmax), 60 + (unsigned long)k, c);
        double a[4];
        if (shear_matrix(-g * 0.6, -g * 0.8, a))
            check_that(0, "matrix");
        for (int j = 0; j < 70; j++)
            y[j] = 0.13 * j - 4;
        if (shear_grid(nmax, 1.1, c, a, 3, x, 70, y, even, odd) || shear_grid(nmax, 1.1, c, a, 3, x, 70, y, all, NULL))
            check_that(0, "grid refuses");
        for (int part = 0; part < 2; part++) {
            for (int n = 0; n <= nmax; n++)
                for (int n1 = 0; n1 <= n; n1++)
                    half[shapelet_index(n1, n - n1)] = n % 2 == part ? c[shapelet_index(n1, n - n1)] : 0;
            for (int j = 0; j < 70; j++)
                for (int i = 0; i < 3; i++)
                    check_close(&v, (part ? odd : even)[j * 3 + i], sheared_value(nmax, 1.1, half, g * 0.6, g * 0.8, x[i], y[j]), 2e-14);
        }
        for (int i = 0; i < 210; i++)
            check_close(&v, all[i], even[i] + odd[i], 1e-15);
    }
    check_end(&v);
    const double a[4] = {-1.2, 0.4, 0.3, 2};
    struct check m = check_begin("grid: any matrix, negative determinant too");
    random_unit(shapelet_count(9), 3, c);
    if (shear_grid(9, 0.9, c, a, 3, x, 70, y, all, NULL))
        check_that(0, "grid refuses");
    for (int j = 0; j < 70; j++)
        for (int i = 0; i < 3; i++)
            check_close(&m, all[j * 3 + i], shapelet_value(9, 0.9, c, a[0] * x[i] + a[1] * y[j], a[2] * x[i] + a[3] * y[j]), 2e-14);
    check_end(&m);
    all[0] = 7;
    check_that(shear_grid(9, 0.9, c, (double[]){1, 1, 1, 1}, 1, x, 1, y, all, NULL) == E_RANGE
               && shear_grid(9, 0.9, c, (double[]){1, NAN, 1, 2}, 1, x, 1, y, all, NULL) == E_RANGE
               && shear_grid(67, 0.9, c, a, 1, x, 1, y, all, NULL) == E_RANGE && shear_grid(9, 0, c, a, 1, x, 1, y, all, NULL) == E_RANGE
               && all[0] == 7 && shear_grid(9, 1, c, a, 0, x, 0, y, all, NULL) == OK, "grid: singular, undefined and empty");
}

/* Pixels by coefficients where they serve, and by subdivision where not. */
static void test_pixels(void)
{
    static double c[1891], out[70 * 5], want[70 * 5], wide[2278], bx[61 * 5], by[61 * 70], xe[6], ye[71];
    struct check v = check_begin("pixels: against coefficients of order 60 and closed forms, nmax 6, pixel / beta 1e-3..8 / (1e-14 area)");
    for (int k = 0; k < 5; k++) {
        const double h = (double[]){1e-3, 0.05, 0.3, 1.7, 8}[k], g1 = 0.05, g2 = -0.1;
        double a[4];
        random_unit(shapelet_count(6), 90 + (unsigned long)k, c);
        for (int i = 0; i <= 5; i++)
            xe[i] = h * (i - 2.3);
        for (int i = 0; i <= 70; i++)
            ye[i] = h * (i - 31.2);
        if (shear_matrix(-g1, -g2, a) || shear_pixels(6, 1, c, a, 5, xe, 70, ye, out) || shear_exact(6, c, g1, g2, 60, wide)
            || shapelet_pixel(60, 1, 5, xe, bx) || shapelet_pixel(60, 1, 70, ye, by) || shapelet_pixel_sum(60, wide, 5, bx, 70, by, want))
            check_that(0, "pixels refuses");
        for (int i = 0; i < 350; i++)
            check_close(&v, out[i], want[i], 1e-14 * fmin(h * h, 1));
    }
    check_end(&v);
    struct check d = check_begin("pixels: along the axes against scales beta e^+-gamma, nmax 60, |g| to 0.9");
    for (int k = 0; k < 4; k++) {
        const double g = (double[]){0.9, -0.9, 0.5, 0.999}[k], h = (double[]){0.05, 1, 4, 0.2}[k], e = sqrt((1 + g) / (1 - g));
        double a[4];
        random_unit(shapelet_count(60), 190 + (unsigned long)k, c);
        for (int i = 0; i <= 5; i++)
            xe[i] = h * (i - 2.3);
        for (int i = 0; i <= 70; i++)
            ye[i] = h * (i - 31.2);
        if (shear_matrix(-g, 0, a) || shear_pixels(60, 1, c, a, 5, xe, 70, ye, out) || shapelet_pixel(60, e, 5, xe, bx)
            || shapelet_pixel(60, 1 / e, 70, ye, by) || shapelet_pixel_sum(60, c, 5, bx, 70, by, want))
            check_that(0, "pixels refuses");
        for (int i = 0; i < 350; i++)
            check_close(&d, out[i], want[i], 5e-14 * fmin(h * h, 1));
    }
    check_end(&d);
    struct check f = check_begin("pixels: they add up to the flux, |g| = 0.9");
    double a[4], m[6], sum = 0;
    random_unit(shapelet_count(8), 5, c);
    for (int i = 0; i <= 5; i++)
        xe[i] = 20 * (i - 2.4);
    for (int i = 0; i <= 70; i++)
        ye[i] = 2 * (i - 34.3);
    if (shear_matrix(0.54, 0.72, a) || shear_pixels(8, 1, c, a, 5, xe, 70, ye, out))
        check_that(0, "pixels refuses");
    for (int i = 0; i < 350; i++)
        sum += out[i];
    shapelet_moments(8, 1, c, m);
    check_close(&f, sum, m[0], 1e-13);
    double whole[2] = {-1e4, 1e4}, one = 0;      /* a single pixel holds everything: 1e4 nodes */
    random_unit(shapelet_count(60), 6, c);
    if (shear_matrix(0.54, 0.72, a) || shear_pixels(60, 1, c, a, 1, whole, 1, whole, &one))
        check_that(0, "one large pixel is refused");
    shapelet_moments(60, 1, c, m);
    check_close(&f, one, m[0], 1e-13);
    random_unit(shapelet_count(8), 5, c);
    check_end(&f);
    out[0] = 7;
    xe[1] = -100;
    check_that(shear_pixels(8, 1, c, a, 5, xe, 70, ye, out) == E_RANGE && shear_pixels(67, 1, c, a, 0, xe, 0, ye, out) == E_RANGE
               && shear_pixels(8, 1, c, (double[]){0, 0, 0, 0}, 0, xe, 0, ye, out) == E_RANGE && out[0] == 7, "pixels: domain");
}

static void truth_squeeze(void)
{
    struct truth t = truth_read("shapelets/squeeze.tsv");
    static double m[200 * 200];
    if (!t.n) {
        check_skip("truth/shapelets/squeeze.tsv is not there");
        return;
    }
    struct check c = check_begin("truth squeeze: 2e-14, t to 0.9, n to 60");
    for (int i = 0; i < t.n; i++) {
        const int mo = (int)t.row[i][0], n = (int)t.row[i][1];
        if (mo > 199 || n > 199 || shear_squeeze(n, mo, t.row[i][2], m))
            check_that(0, "squeeze refuses row %d", i);
        check_close(&c, m[mo * (n + 1) + n], t.row[i][3], 2e-14);
    }
    check_end(&c);
    truth_free(&t);
}

static void truth_elements(void)
{
    struct truth t = truth_read("shapelets/shear_exact.tsv"), s = truth_read("shapelets/shear_series4.tsv");
    static double c[2278], out[4000];
    if (!t.n || !s.n) {
        check_skip("truth/shapelets/shear_exact.tsv or shear_series4.tsv is not there");
        return;
    }
    struct check e = check_begin("truth shear_exact: 1e-14, |g| to 0.9");
    for (int i = 0; i < t.n; i++) {
        const int m1 = (int)t.row[i][0], m2 = (int)t.row[i][1], n1 = (int)t.row[i][2], n2 = (int)t.row[i][3];
        const int nmax = n1 + n2, nout = m1 + m2 > nmax ? m1 + m2 : nmax;
        memset(c, 0, sizeof c);
        c[shapelet_index(n1, n2)] = 1;
        if (shear_exact(nmax, c, t.row[i][4], t.row[i][5], nout, out))
            check_that(0, "exact refuses row %d", i);
        check_close(&e, out[shapelet_index(m1, m2)], t.row[i][6], 1e-14);
    }
    check_end(&e);
    struct check f = check_begin("truth shear_series4: 1e-12, gamma to 0.5");
    for (int i = 0; i < s.n; i++) {
        const int m1 = (int)s.row[i][0], m2 = (int)s.row[i][1], n1 = (int)s.row[i][2], n2 = (int)s.row[i][3];
        const double gamma = hypot(s.row[i][4], s.row[i][5]), k = gamma > 0 ? tanh(gamma) / gamma : 1;
        memset(c, 0, sizeof c);
        c[shapelet_index(n1, n2)] = 1;
        if (m1 + m2 > n1 + n2 + 8 || shear_series(n1 + n2, c, k * s.row[i][4], k * s.row[i][5], 4, out))
            check_that(0, "series refuses row %d", i);
        check_close(&f, out[shapelet_index(m1, m2)], s.row[i][6], 1e-12);
    }
    check_end(&f);
    truth_free(&t);
    truth_free(&s);
}

static void truth_values(void)
{
    struct truth o = truth_read("shapelets/objects.tsv"), t = truth_read("shapelets/sheared_values.tsv");
    static double c[2278];
    if (!t.n || !o.n) {
        check_skip("truth/shapelets/sheared_values.tsv is not there");
        return;
    }
    struct check p = check_begin("truth sheared_values: shapelet_value on the mapped point, 5e-15 (1 + |f|)");
    struct check q = check_begin("truth sheared_values: shear_grid");
    for (int i = 0; i < t.n; i++) {
        double beta = 0, a[4], v = 0;
        int nmax = 0;
        memset(c, 0, sizeof c);
        for (int k = 0; k < o.n; k++)
            if (o.row[k][0] == t.row[i][0]) {
                const int n1 = (int)o.row[k][2], n2 = (int)o.row[k][3];
                beta = o.row[k][1];
                nmax = n1 + n2 > nmax ? n1 + n2 : nmax;
                c[shapelet_index(n1, n2)] = o.row[k][4];
            }
        const double x = t.row[i][3], y = t.row[i][4], want = t.row[i][5];
        if (shear_matrix(-t.row[i][1], -t.row[i][2], a) || shear_grid(nmax, beta, c, a, 1, &x, 1, &y, &v, NULL))
            check_that(0, "grid refuses row %d", i);
        check_close(&p, shapelet_value(nmax, beta, c, a[0] * x + a[1] * y, a[2] * x + a[3] * y), want, 5e-15 * (1 + fabs(want)));
        check_close(&q, v, want, 5e-15 * (1 + fabs(want)));
    }
    check_end(&p);
    check_end(&q);
    truth_free(&t);
    truth_free(&o);
}

int main(void)
{
    test_quad();
    test_matrix();
    test_squeeze();
    test_exact();
    test_growth();
    test_series();
    test_series_table();
    test_grid();
    test_pixels();
    truth_squeeze();
    truth_elements();
    truth_values();
    return check_status();
}
