/* Sums of Gaussians against rendering, quadrature and exact shear; counts, sizes, draws against their distributions. */
#include "check.h"
#include "gaussians.h"
#include "population.h"
#include "shapelet.h"
#include "shear.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { COUNT = (GAUSSIANS_NMAX + 1) * (GAUSSIANS_NMAX + 2) / 2 };

static double gauss_value(const struct gaussians *g, double x, double y)
{
    double sum = 0;
    for (int i = 0; i < g->n; i++) {
        double det = g->sxx[i] * g->syy[i] - g->sxy[i] * g->sxy[i], u = x - g->x[i], v = y - g->y[i];
        sum += g->flux[i] / (2 * M_PI * sqrt(det)) * exp(-0.5 * (g->syy[i] * u * u - 2 * g->sxy[i] * u * v + g->sxx[i] * v * v) / det);
    }
    return sum;
}

/* phi_0..phi_nmax at t by the textbook recurrence. */
static void basis(int nmax, double t, double *b)
{
    b[0] = 0.7511255444649425 * exp(-0.5 * t * t);
    for (int n = 0; n < nmax; n++)
        b[n + 1] = sqrt(2.0 / (n + 1)) * t * b[n] - (n ? sqrt(n / (n + 1.0)) * b[n - 1] : 0);
}

static double series_value(int nmax, double beta, const double *c, double x, double y)
{
    double bx[GAUSSIANS_NMAX + 1], by[GAUSSIANS_NMAX + 1], sum = 0;
    basis(nmax, x / beta, bx);
    basis(nmax, y / beta, by);
    for (int n = 0; n <= nmax; n++)
        for (int n1 = 0; n1 <= n; n1++)
            sum += c[n * (n + 1) / 2 + n1] * bx[n1] * by[n - n1];
    return sum / beta;
}

/* The reference's Gaussian: rendered against its series. */
static void test_rendered(void)
{
    static const int order[] = {4, 8, 12, 20, 30};
    static const double expect[] = {4e-2, 4e-3, 3e-4, 7e-6, 4e-8};
    struct gaussians g = {0};
    double c[COUNT];
    if (!check_that(gaussians_add(&g, 1, 2.5, -1.7, 30, 9, 14) == OK, "one Gaussian"))
        return;
    double peak = gauss_value(&g, 2.5, -1.7);
    for (int k = 0; k < 5; k++) {
        double worst = 0;
        if (gaussians_project(&g, order[k], 4.6, c))
            worst = NAN;
        for (double x = -30; x <= 30; x += 0.5)
            for (double y = -30; y <= 30; y += 0.5)
                worst = fmax(worst, fabs(series_value(order[k], 4.6, c, x, y) - gauss_value(&g, x, y)) / peak);
        check_that(worst > 0.5 * expect[k] && worst < 1.6 * expect[k], "order %d: error %.2e of the peak (reference %.0e)", order[k], worst, expect[k]);
    }
}

/* Nine elongated Gaussians, some far out: more than a group of lanes. */
static int mixed(struct gaussians *g)
{
    *g = (struct gaussians){0};
    for (int i = 0; i < 11; i++) {
        double a = 0.3 + 0.15 * i, b = 0.2 + 0.05 * i, t = 0.7 * i, x = i < 2 ? 0 : 1.1 * cos(1.9 * i), y = i < 2 ? 0 : 0.9 * sin(2.3 * i);
        if (gaussians_add(g, i == 4 ? -0.2 : 1 + 0.1 * i, x, y, a * cos(t) * cos(t) + b * sin(t) * sin(t), (a - b) * cos(t) * sin(t),
                          a * sin(t) * sin(t) + b * cos(t) * cos(t)))
            return 1;
    }
    return 0;
}

static void test_quadrature(void)
{
    struct gaussians g;
    double c[COUNT], want[COUNT] = {0}, beta = 0.8, h = 0.04;
    if (!check_that(mixed(&g) == 0 && g.n_central == 2 && gaussians_project(&g, GAUSSIANS_NMAX, beta, c) == OK, "eleven Gaussians"))
        return;
    for (double x = -9; x <= 9; x += h)          /* the trapezoid rule is exact for such functions */
        for (double y = -9; y <= 9; y += h) {
            double bx[GAUSSIANS_NMAX + 1], by[GAUSSIANS_NMAX + 1], v = gauss_value(&g, x, y) * h * h / beta;
            if (fabs(v) < 1e-20)
                continue;
            basis(GAUSSIANS_NMAX, x / beta, bx);
            basis(GAUSSIANS_NMAX, y / beta, by);
            for (int n = 0; n <= GAUSSIANS_NMAX; n++)
                for (int n1 = 0; n1 <= n; n1++)
                    want[n * (n + 1) / 2 + n1] += v * bx[n1] * by[n - n1];
        }
    struct check k = check_begin("496 coefficients against quadrature");
    for (int i = 0; i < COUNT; i++)
        check_close(&k, c[i], want[i], 1e-13 * fabs(c[0]));
    check_end(&k);
    double low[COUNT];
    int same = gaussians_project(&g, 7, beta, low) == OK;
    check_that(same && memcmp(low, c, 36 * sizeof *c) == 0, "a lower order gives the same bits");
    check_that(gaussians_project(&g, -1, 1, c) == E_RANGE && gaussians_project(&g, GAUSSIANS_NMAX + 1, 1, c) == E_RANGE
               && gaussians_project(&g, 4, 0, c) == E_RANGE && gaussians_project(&g, 4, NAN, c) == E_RANGE, "bad arguments are refused");
}

static void test_moments(void)
{
    struct gaussians g = {0};
    double c[COUNT], m[6], want[6] = {0}, sum = 0;
    int st = OK;
    for (int i = 0; i < 5 && !st; i++)           /* close to the scale: order 30 holds all of them */
        st = gaussians_add(&g, 1 + 0.3 * i, 0.1 * i, -0.08 * i, 0.7 + 0.05 * i, 0.05 * i, 0.85 + 0.03 * i);
    if (!check_that(!st && gaussians_project(&g, GAUSSIANS_NMAX, 0.9, c) == OK, "projected"))
        return;
    shapelet_moments(GAUSSIANS_NMAX, 0.9, c, m);
    for (int i = 0; i < g.n; i++) {
        double f = g.flux[i], all[6] = {1, g.x[i], g.y[i], g.sxx[i] + g.x[i] * g.x[i], g.sxy[i] + g.x[i] * g.y[i], g.syy[i] + g.y[i] * g.y[i]};
        for (int k = 0; k < 6; k++)
            want[k] += f * all[k];
    }
    struct check k = check_begin("flux, centroid and second moments");
    for (int i = 0; i < 6; i++)
        check_close(&k, m[i], want[i], 1e-11);
    check_end(&k);
    for (int i = 0; i < COUNT; i++)
        sum += c[i] * c[i];
    k = check_begin("captured power reaches the exact power");
    check_close(&k, sum, gaussians_power(&g), 1e-13);
    check_end(&k);
}

/* Shear of the Gaussians (S -> M S M', x0 -> M x0) against shear of the coefficients. */
static void test_shear(void)
{
    struct gaussians g, s;
    double c[COUNT], want[COUNT], got[COUNT], a[4], beta = 1.0;
    struct check k = check_begin("sheared Gaussians against sheared coefficients, g = 0.05, -0.03");
    if (mixed(&g) || shear_matrix(0.05, -0.03, a))
        return;
    s = g;
    for (int i = 0; i < g.n; i++) {
        double xx = g.sxx[i], xy = g.sxy[i], yy = g.syy[i];
        s.x[i] = a[0] * g.x[i] + a[1] * g.y[i];
        s.y[i] = a[2] * g.x[i] + a[3] * g.y[i];
        s.sxx[i] = a[0] * a[0] * xx + 2 * a[0] * a[1] * xy + a[1] * a[1] * yy;
        s.sxy[i] = a[0] * a[2] * xx + (a[0] * a[3] + a[1] * a[2]) * xy + a[1] * a[3] * yy;
        s.syy[i] = a[2] * a[2] * xx + 2 * a[2] * a[3] * xy + a[3] * a[3] * yy;
    }
    if (gaussians_project(&g, 30, beta, c) || gaussians_project(&s, 12, beta, want) || shear_exact(30, c, 0.05, -0.03, 30, got))
        return;
    for (int i = 0; i < 91; i++)
        check_close(&k, got[i], want[i], 1e-9);
    check_end(&k);
    k = check_begin("and the shear shows");
    check_close(&k, fabs(want[3] - c[3]) > 1e-3 ? 1 : 0, 1, 0.5);
    check_end(&k);
}

static void test_counts(void)
{
    double sum = 0, h = 1e-4;
    struct check k = check_begin("counts 20..30.8 against the trapezoid rule");
    for (double m = 20; m < 30.8 - h / 2; m += h)     /* fine enough for the kinks between pieces */
        sum += counts_between(m, m + h);
    check_close(&k, counts_between(20, 30.8), sum, 1e-9 * sum);
    check_end(&k);
    /* per magnitude at the knots: the density itself */
    static const double at[][2] = {{18, .08}, {20, .65}, {22.25, 4.5}, {24.25, 20}, {26.25, 54}, {28.25, 128}, {30.25, 260}, {31.25, 350}};
    k = check_begin("counts per magnitude at eight knots");
    for (int i = 0; i < 8; i++)
        check_close(&k, counts_between(at[i][0] - 5e-5, at[i][0] + 5e-5) / 1e-4, at[i][1], 1e-4 * at[i][1]);
    check_end(&k);
    check_that(fabs(counts_between(14, 25) - 45) < 1.5, "%.2f galaxies per arcmin^2 below 25 (COSMOS2020 44, HDF-N 45)", counts_between(14, 25));
    k = check_begin("inverse of the counts");
    for (double u = 0.0005; u < 1; u += 0.001) {
        double m = counts_magnitude(20, 30.8, u);
        check_close(&k, counts_between(20, m), u * counts_between(20, 30.8), 1e-11 * counts_between(20, 30.8));
        m = counts_magnitude(15, 35, u);
        check_close(&k, counts_between(15, m), u * counts_between(15, 35), 1e-11 * counts_between(15, 35));
    }
    check_end(&k);
}

static void test_counts_file(void)
{
    char name[1000], line[200];
    const char *shared = getenv("SHARED");
    snprintf(name, sizeof name, "%s/data/hdf/counts_f814w.txt", shared ? shared : "");
    FILE *f = shared ? fopen(name, "r") : NULL;
    if (!f) {
        check_skip("counts_f814w.txt is not here");
        return;
    }
    struct check k = check_begin("model column of counts_f814w.txt");
    double m, n;
    while (fgets(line, sizeof line, f))
        if (sscanf(line, "%lf %*f %*f %lf", &m, &n) == 2)
            check_close(&k, counts_between(m - 5e-4, m + 5e-4) / 1e-3, n, 0.0051);
    fclose(f);
    check_end(&k);
}

static double inside(const struct profile *p, double r)
{
    double sum = 0;
    for (int k = 0; k < p->n; k++)
        sum -= p->weight[k] * expm1(-0.5 * r * r / p->variance[k]);
    return sum;
}

static void test_profiles(void)
{
    struct profiles f = population_profiles();
    struct check k = check_begin("half-light radius 1, flux 1");
    check_close(&k, inside(&f.exponential, 1), 0.5, 1e-14);
    check_close(&k, inside(&f.vaucouleurs, 1), 0.5, 1e-14);
    check_close(&k, inside(&f.exponential, 1e3), 1, 1e-14);
    check_close(&k, inside(&f.vaucouleurs, 1e3), 1, 1e-14);
    check_end(&k);
    k = check_begin("light inside r of the exponential");
    for (double r = 0.1; r < 5; r += 0.1)
        check_close(&k, inside(&f.exponential, r), 1 - (1 + 1.6783469900166605 * r) * exp(-1.6783469900166605 * r), 2e-3);
    check_end(&k);
    /* de Vaucouleurs cut at 8 re holds gamma(8, x) / gamma(8, 7.669 * 8^(1/4)); half of it lies inside re' = 0.93 re */
    double total = 0, part[80], half = 0, h = 0.01;
    int n = 0;
    for (double r = h / 2; r < 8; r += h) {
        total += 2 * M_PI * r * exp(-7.669 * (pow(r, 0.25) - 1)) * h;
        if (n < 80 && (int)(r / 0.1) > n - 1)
            part[n++] = total;
    }
    for (double r = h / 2, sum = 0; r < 8 && half == 0; r += h)
        if ((sum += 2 * M_PI * r * exp(-7.669 * (pow(r, 0.25) - 1)) * h) > total / 2)
            half = r;
    k = check_begin("light inside r of the truncated de Vaucouleurs profile");
    for (int i = 1; i < 70; i++)
        check_close(&k, inside(&f.vaucouleurs, (0.1 * i + h / 2) / half), part[i] / total, 2e-2);
    check_end(&k);
}

/* Is a mean of n draws within 4.5 of its standard error? */
static void mean_is(const char *what, double sum, double sum2, long n, double want)
{
    double mean = sum / (double)n, error = sqrt((sum2 / (double)n - mean * mean) / (double)n);
    check_that(fabs(mean - want) < 4.5 * error, "%s: mean %.5f, %.5f wanted, error %.5f", what, mean, want, error);
}

static void test_draws(void)
{
    struct population p = POPULATION_DEFAULTS;
    struct rng r = rng_stream(5, 0, RNG_GALAXY);
    long n = 40000, dominated[3] = {0};
    static const double mag[3] = {21, 23, 25};
    double s[8] = {0}, s2[8] = {0};
    long ordinary = 0, big = 0, armed = 0;
    for (long i = 0; i < n; i++) {
        struct galaxy g;
        galaxy_draw(&p, &r, (uint64_t)i, mag[i % 3], &g);
        double d = log(g.re / population_size(&p, mag[i % 3])), q = (g.q * g.q - 0.0484) / (1 - 0.0484);
        double v[8] = {d, d * d, sqrt(q), g.pa, g.n_knots / fmin(1.5, fmax(0.4, g.re / 0.2)), g.shift_x * g.shift_x, 0, 0};
        /* kinds are told apart by the draw itself: bulge-dominated ones have B/T of mean 2/3 */
        int kind = rng_uniform(&r, (uint64_t)i, DRAW_KIND) < 0.35 - 0.05 * (mag[i % 3] - 21);
        dominated[i % 3] += kind;
        if (!kind) {
            ordinary++;
            v[6] = g.bt;
            if (g.re > 0.25) {
                big++;
                armed += g.arms;
            }
        }
        for (int k = 0; k < 8; k++) {
            s[k] += v[k];
            s2[k] += v[k] * v[k];
        }
        if (g.clumpy > 0.75 || g.q < 0.22 || g.q > 1 || g.n_knots > KNOTS_MAX || (kind && g.arms))
            check_that(0, "galaxy %ld is outside the recipe", i);
    }
    mean_is("ln size", s[0], s2[0], n, 0);
    mean_is("scatter of ln size, squared", s[1], s2[1], n, 0.45 * 0.45);
    mean_is("cosine of the inclination", s[2], s2[2], n, 0.5);
    mean_is("position angle", s[3], s2[3], n, M_PI / 2);
    mean_is("knots per clipped size", s[4], s2[4], n, 4);
    mean_is("lopsidedness, squared", s[5], s2[5], n, 0.16);
    mean_is("B/T of ordinary galaxies", s[6], s2[6] * (double)n / (double)ordinary, n, (double)ordinary / (double)n / 9);
    check_that(fabs((double)armed / (double)big - 0.6) < 4.5 * sqrt(0.24 / (double)big), "arms in %.3f of large discs", (double)armed / (double)big);
    double worst = 0;
    for (int k = 0; k < 3; k++)
        worst = fmax(worst, fabs((double)dominated[k] / ((double)n / 3) - (0.35 - 0.1 * k)));
    check_that(worst < 0.02, "bulge-dominated fractions 0.35, 0.25, 0.15 (worst difference %.4f)", worst);
    struct galaxy a, b;
    galaxy_draw(&p, &r, 17, 24, &a);
    galaxy_draw(&p, &r, 18, 24, &b);
    galaxy_draw(&p, &r, 17, 24, &b);
    check_that(memcmp(&a, &b, sizeof a) == 0, "a galaxy does not depend on others");
}

/* A round disc without knots has half of its light inside re; smoothing widens it. */
static void test_sizes(void)
{
    struct population p = POPULATION_DEFAULTS;
    struct profiles f = population_profiles();
    struct galaxy g = {.mag = 24, .re = 0.3, .q = 1, .q_bulge = 1};
    struct gaussians s;
    p.smoothing = 0;
    double light = 0, flux = 0, cx = 0;
    if (galaxy_gaussians(&p, &f, &g, &s))
        return;
    for (int i = 0; i < s.n; i++) {
        light -= s.flux[i] * expm1(-0.5 * 0.09 / s.sxx[i]);
        flux += s.flux[i];
    }
    struct check k = check_begin("half of a disc's light lies inside re");
    check_close(&k, light, 0.5, 1e-13);
    check_close(&k, flux, 1, 1e-14);
    check_end(&k);
    struct rng r = rng_stream(3, 0, RNG_GALAXY);
    struct population usual = POPULATION_DEFAULTS;
    double c[COUNT], m[6], least = 1;
    struct check kf = check_begin("flux of 2000 galaxies as Gaussians and as series"), ka = check_begin("their Gaussians keep the area of the ellipse");
    for (uint64_t i = 0; i < 2000; i++) {
        struct galaxy_fit fit = {0};
        double mag = 20 + 0.005 * (double)i;
        galaxy_draw(&usual, &r, i, mag, &g);
        if (galaxy_gaussians(&p, &f, &g, &s))
            break;
        flux = cx = 0;
        for (int j = 0; j < s.n; j++)
            flux += s.flux[j];
        check_close(&kf, flux, 1, 1e-13);
        double area = s.sxx[3] * s.syy[3] - s.sxy[3] * s.sxy[3], want = pow(g.re * g.re * f.exponential.variance[3], 2);
        check_close(&ka, area / want, 1, 1e-11);
        if (galaxy_gaussians(&usual, &f, &g, &s) || galaxy_project(&usual, &g, &s, galaxy_order(mag), c, &fit))
            break;
        shapelet_moments(galaxy_order(mag), fit.beta, c, m);
        check_close(&kf, m[0], 1, 1e-13);
        least = fmin(least, fit.power);
        if (!(fit.power <= 1 + 1e-12))
            check_that(0, "galaxy %d captures more than all power", (int)i);
    }
    check_that(kf.n == 4000, "all were projected; least captured power %.3f", least);
    check_end(&kf);
    check_end(&ka);
}

/* The scale is the best of seven, 0.25 to 0.95 of the smoothed half-light radius. */
static void test_scale(void)
{
    struct population p = POPULATION_DEFAULTS;
    struct profiles f = population_profiles();
    struct rng r = rng_stream(11, 0, RNG_GALAXY);
    struct check grid = check_begin("steps of the scale are whole, 0..6"), best = check_begin("no step captures more power");
    long used[7] = {0};
    for (uint64_t i = 0; i < 500; i++) {
        double mag = 22 + 0.014 * (double)i, c[COUNT], most = 0;
        struct galaxy g;
        struct gaussians s;
        struct galaxy_fit fit;
        galaxy_draw(&p, &r, i, mag, &g);
        int n = galaxy_order(mag);
        if (galaxy_gaussians(&p, &f, &g, &s) || galaxy_project(&p, &g, &s, n, c, &fit))
            break;
        double size = sqrt(g.re * g.re + 2 * log(2) * 0.03 * 0.03), step = (fit.beta / size - 0.25) / 0.7 * 6;
        check_close(&grid, step, fmin(6, fmax(0, rint(step))), 1e-9);
        for (int k = 0; k < 7; k++) {
            double sum = 0;
            if (gaussians_project(&s, n, size * (0.25 + 0.7 * k / 6), c))
                break;
            for (int j = 0; j < (n + 1) * (n + 2) / 2; j++)
                sum += c[j] * c[j];
            most = fmax(most, sum);
        }
        check_close(&best, fit.power, most / gaussians_power(&s), 1e-12);
        used[(int)fmin(6, fmax(0, rint(step)))]++;
    }
    check_that(grid.n == 500 && best.n == 500, "500 galaxies");
    check_end(&grid);
    check_end(&best);
    check_that(used[0] + used[1] > 5 && used[3] > 50 && used[6] > 10, "steps taken: %ld %ld %ld %ld %ld %ld %ld", used[0], used[1], used[2],
               used[3], used[4], used[5], used[6]);
}

int main(void)
{
    test_scale();
    test_rendered();
    test_quadrature();
    test_moments();
    test_shear();
    test_counts();
    test_counts_file();
    test_profiles();
    test_draws();
    test_sizes();
    return check_status();
}
