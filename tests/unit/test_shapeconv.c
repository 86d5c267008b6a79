/*
 * Convolution in coefficients against direct sums of the convolution integral in long double,
 * associativity and moments, and the tables of $SHARED/truth/shapelets.
 */
#include "shapeconv.h"
#include "shapelet.h"
#include "check.h"
#include "random.h"
#include "truth.h"

static void random_coeff(int nmax, unsigned long seed, double *c)
{
    for (size_t i = 0; i < shapelet_count(nmax); i++)
        c[i] = 2 * uniform(&seed) - 1;
}

/* B_0..B_n(x; beta) in long double. */
static void basis_long(int nmax, long double beta, long double x, long double *p)
{
    x /= beta;
    p[0] = expl(-0.5L * x * x) / sqrtl(sqrtl(acosl(-1)) * beta);
    p[1] = sqrtl(2) * x * p[0];
    for (int n = 1; n < nmax; n++)
        p[n + 1] = sqrtl(2.0L / (n + 1)) * x * p[n] - sqrtl(n / (n + 1.0L)) * p[n - 1];
}

/* C_nml as a double sum in real space: no transform is used. */
static void test_tensor(void)
{
    enum { N = 7 };
    static double c[8 * 8 * 8];
    static long double want[8][8][8], a[8], b[8], g[8];
    struct check t = check_begin("tensor: against sums of the convolution in real space, orders to 7");
    const double alpha = 0.8, beta = 1.1, gamma = 1.5;
    const long double h = 0.1L;
    for (int i = -120; i <= 120; i++) {
        basis_long(N, gamma, i * h, g);
        for (int j = -120; j <= 120; j++) {
            basis_long(N, alpha, j * h, a);
            basis_long(N, beta, (i - j) * h, b);
            for (int n = 0; n <= N; n++)
                for (int m = 0; m <= N; m++)
                    for (int l = 0; l <= N; l++)
                        want[n][m][l] += h * h * g[n] * a[m] * b[l];
        }
    }
    if (shapeconv_tensor(N, gamma, N, alpha, N, beta, c))
        check_that(0, "tensor refuses");
    for (int i = 0; i < 512; i++)
        check_close(&t, c[i], (double)want[i / 64][i / 8 % 8][i % 8], 2e-14);
    check_end(&t);
    struct check z = check_begin("tensor: nothing above n = m+l at the natural scale, odd sums exactly 0");
    if (shapeconv_tensor(N, shapeconv_scale(alpha, beta), 3, alpha, 3, beta, c))
        check_that(0, "tensor refuses");
    for (int i = 0; i < 128; i++) {
        const int n = i / 16, m = i / 4 % 4, l = i % 4;
        if (n > m + l)
            check_close(&z, c[i], 0, 2e-15);
        if ((n + m + l) % 2)
            check_close(&z, c[i], 0, 1e-300);
    }
    check_end(&z);
    c[0] = 7;
    check_that(shapeconv_tensor(67, 1, 1, 1, 1, 1, c) == E_RANGE && shapeconv_tensor(1, 0, 1, 1, 1, 1, c) == E_RANGE
               && shapeconv_tensor(1, 1, 1, NAN, 1, 1, c) == E_RANGE && c[0] == 7, "tensor: domain");
}

static void test_gauss(void)
{
    static double m[61 * 61], n[61 * 61];
    struct check u = check_begin("gauss: sigma 0 is the unit matrix, order 60");
    if (shapeconv_gauss(60, 0.7, 0, 60, 0.7, m))
        check_that(0, "gauss refuses");
    for (int i = 0; i < 61 * 61; i++)
        check_close(&u, m[i], i / 61 == i % 61, 1e-14);
    check_end(&u);
    struct check s = check_begin("gauss: two widths in turn are their quadratic sum, order 30");
    const double b0 = 0.5, s1 = 0.3, s2 = 0.6, b1 = hypot(b0, s1), b2 = hypot(b1, s2);
    static double both[31 * 31];
    if (shapeconv_gauss(30, b0, s1, 30, b1, m) || shapeconv_gauss(30, b1, s2, 30, b2, n) || shapeconv_gauss(30, b0, hypot(s1, s2), 30, b2, both))
        check_that(0, "gauss refuses");
    for (int i = 0; i < 31; i++)
        for (int k = 0; k < 31; k++) {
            double sum = 0;
            for (int j = 0; j < 31; j++)
                sum += n[i * 31 + j] * m[j * 31 + k];
            check_close(&s, sum, both[i * 31 + k], 1e-14);
        }
    check_end(&s);
    struct check o = check_begin("gauss object: flux and centroid kept, second moments grow by F sigma^2");
    struct check v = check_begin("gauss object: values against a direct sum");
    static double c[91], d[91];
    double a[6], b[6];
    random_coeff(12, 9, c);
    if (shapeconv_gauss_object(12, 0.9, 0.4, c, d))
        check_that(0, "gauss object refuses");
    shapelet_moments(12, 0.9, c, a);
    shapelet_moments(12, shapeconv_scale(0.9, 0.4), d, b);
    for (int i = 0; i < 6; i++)
        check_close(&o, b[i], a[i] + (i == 3 || i == 5 ? a[0] * 0.16 : 0), 1e-12);
    check_end(&o);
    for (int p = 0; p < 3; p++) {
        double sum = 0;
        const double h = 0.08, x = 0.5 * p, y = 1 - p;
        for (int i = -40; i <= 40; i++)
            for (int j = -40; j <= 40; j++)
                sum += h * h * exp(-(i * i + j * j) * h * h / 0.32) / (2 * M_PI * 0.16) * shapelet_value(12, 0.9, c, x - i * h, y - j * h);
        check_close(&v, shapelet_value(12, shapeconv_scale(0.9, 0.4), d, x, y), sum, 1e-13);
    }
    check_end(&v);
    d[0] = 7;
    check_that(shapeconv_gauss(3, 1, -1, 3, 1, d) == E_RANGE && shapeconv_gauss(3, 1, NAN, 3, 1, d) == E_RANGE
               && shapeconv_gauss_object(67, 1, 1, c, d) == E_RANGE && d[0] == 7, "gauss: domain");
}

static void test_object(void)
{
    static double f[36], h[28], out[300], back[300];
    struct check a = check_begin("object: flux multiplies, second moments add");
    struct check v = check_begin("object: values against a direct sum");
    struct check s = check_begin("object: f*h = h*f; a Gaussian h is shapeconv_gauss_object");
    const double g = shapeconv_scale(0.6, 0.8);
    double mf[6], mh[6], mo[6];
    random_coeff(7, 1, f);
    random_coeff(6, 2, h);
    if (shapeconv_object(7, 0.6, f, 6, 0.8, h, 13, g, out) || shapeconv_object(6, 0.8, h, 7, 0.6, f, 13, g, back))
        check_that(0, "object refuses");
    for (size_t i = 0; i < shapelet_count(13); i++)
        check_close(&s, back[i], out[i], 1e-14);
    shapelet_moments(7, 0.6, f, mf);
    shapelet_moments(6, 0.8, h, mh);
    shapelet_moments(13, g, out, mo);
    check_close(&a, mo[0], mf[0] * mh[0], 1e-12);
    check_close(&a, mo[1], mf[1] * mh[0] + mf[0] * mh[1], 1e-12);
    check_close(&a, mo[4], mf[4] * mh[0] + mf[0] * mh[4] + mf[1] * mh[2] + mf[2] * mh[1], 1e-12);
    check_close(&a, mo[5], mf[5] * mh[0] + mf[0] * mh[5] + 2 * mf[2] * mh[2], 1e-12);
    for (int p = 0; p < 3; p++) {
        double sum = 0;
        const double step = 0.08, x = 0.5 * p - 0.3, y = 1 - p;
        for (int i = -75; i <= 75; i++)
            for (int j = -75; j <= 75; j++)
                sum += step * step * shapelet_value(7, 0.6, f, i * step, j * step) * shapelet_value(6, 0.8, h, x - i * step, y - j * step);
        check_close(&v, shapelet_value(13, g, out, x, y), sum, 2e-13);
    }
    const double gauss = 1 / (2 * sqrt(M_PI) * 0.8);      /* unit flux in B_00(0.8) */
    if (shapeconv_object(7, 0.6, f, 0, 0.8, &gauss, 7, g, out) || shapeconv_gauss_object(7, 0.6, 0.8, f, back))
        check_that(0, "object refuses");
    for (size_t i = 0; i < shapelet_count(7); i++)
        check_close(&s, back[i], out[i], 1e-14);
    check_end(&a);
    check_end(&v);
    check_end(&s);
    out[0] = 7;
    check_that(shapeconv_object(67, 1, f, 6, 1, h, 3, 1, out) == E_RANGE && shapeconv_object(1, 1, f, 6, -1, h, 3, 1, out) == E_RANGE && out[0] == 7,
               "object: domain");
}

static void truth_tables(void)
{
    struct truth t = truth_read("shapelets/conv_tensor1d.tsv"), g = truth_read("shapelets/conv_gauss1d.tsv");
    static double c[67 * 67 * 67];
    if (!t.n || !g.n) {
        check_skip("truth/shapelets/conv_tensor1d.tsv or conv_gauss1d.tsv is not there");
        return;
    }
    struct check a = check_begin("truth conv_tensor1d: 1e-14");
    for (int i = 0; i < t.n; i++) {
        const int n = (int)t.row[i][0], m = (int)t.row[i][1], l = (int)t.row[i][2];
        if (shapeconv_tensor(n, t.row[i][3], m, t.row[i][4], l, t.row[i][5], c))
            check_that(0, "tensor refuses row %d", i);
        check_close(&a, c[(n * (m + 1) + m) * (l + 1) + l], t.row[i][6], 1e-14);
    }
    check_end(&a);
    struct check p = check_begin("truth conv_gauss1d: pixel integrals, 2e-14"), v = check_begin("truth conv_gauss1d: values, 2e-14");
    for (int i = 0; i < g.n; i++) {
        const int n = (int)g.row[i][0];
        const double sigma = g.row[i][1], gamma = shapeconv_scale(1, sigma), mid = 0.5 * (g.row[i][2] + g.row[i][3]);
        double pix[67], val[67], sp = 0, sv = 0;
        if (shapeconv_gauss(n, 1, sigma, n, gamma, c) || shapelet_pixel(n, gamma, 1, g.row[i] + 2, pix) || shapelet_basis(n, gamma, 1, &mid, val))
            check_that(0, "gauss refuses row %d", i);
        for (int k = 0; k <= n; k++) {
            sp += c[k * (n + 1) + n] * pix[k];
            sv += c[k * (n + 1) + n] * val[k];
        }
        check_close(&p, sp, g.row[i][4], 2e-14);
        check_close(&v, sv, g.row[i][5], 2e-14);
    }
    check_end(&p);
    check_end(&v);
    truth_free(&t);
    truth_free(&g);
}

int main(void)
{
    test_tensor();
    test_gauss();
    test_object();
    truth_tables();
    return check_status();
}
