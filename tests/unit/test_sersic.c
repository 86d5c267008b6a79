/*
 * test_sersic - mixtures of Gaussians against the light of Sersic profiles by the series of the incomplete gamma
 * function, interpolated mixtures against those made for one n.
 */
#include "check.h"
#include "sersic.h"
#include <stdlib.h>
#include <string.h>

/* Light inside r (RE = 1), P(2n, b r^(1/n)), by its series. */
static double inside(double n, double b, double r)
{
    const double x = b * pow(r, 1 / n), a = 2 * n;
    if (x > 600)                           /* 1 - exp(-x) x^(a-1) ..., a <= 16 */
        return 1;
    double term = exp(-x + a * log(x) - lgamma(a + 1)), sum = term;
    for (int k = 1; k < 2000; k++)
        sum += term *= x / (a + k);
    return sum;
}

static double half_light(double n)
{
    double lo = 1e-3, hi = 20;
    for (int j = 0; j < 200; j++) {
        const double b = 0.5 * (lo + hi);
        if (inside(n, b, 1) < 0.5)
            lo = b;
        else
            hi = b;
    }
    return lo;
}

struct mixture {
    int n;
    double sigma[SERSIC_PARTS], flux[SERSIC_PARTS];
};

static double mixed(const struct mixture *m, double r)
{
    double sum = 0;
    for (int j = 0; j < m->n; j++)
        sum += m->flux[j] * -expm1(-0.5 * r * r / (m->sigma[j] * m->sigma[j]));
    return m->n ? sum : NAN;
}

/* The request is kept: light inside any radius over the flux, and light in the middle pixel over itself. */
static void profiles(double eps)
{
    static const double index[] = {0.5, 0.50001, 0.501, 0.5024, 0.5025, 0.503, 0.505, 0.51, 0.53, 0.57, 0.6, 0.65, 0.7, 0.75, 0.8, 0.9, 1, 1.2, 1.5,
                                   2, 2.5, 3, 3.7, 4, 5, 6, 7, 8};
    static const double pixel[] = {10, 1, 0.1, 0.02, 1e-3};
    char what[100], in_pixel[100];
    struct sersic *s;
    struct mixture m;
    int least = SERSIC_PARTS, most = 0;
    if (sersic_new(&s, eps))
        exit(1);
    snprintf(what, sizeof what, "Sersic n = .5 to 8 at %g: light inside 0.001 to 1000 RE", eps);
    snprintf(in_pixel, sizeof in_pixel, "Sersic n = .5 to 8 at %g: the middle pixel, of 0.001 to 10 RE", eps);
    struct check k = check_begin(what), middle = check_begin(in_pixel);
    for (size_t i = 0; i < sizeof index / sizeof *index; i++) {
        const double n = index[i], b = half_light(n), bound = n < SERSIC_NARROW ? fmax(eps, 3e-6) : eps;
        for (size_t j = 0; j < sizeof pixel / sizeof *pixel; j++) {
            const double r = pixel[j] / sqrt(M_PI);
            m.n = sersic_gaussians(s, n, pixel[j], 0, m.sigma, m.flux);
            check_close(&middle, mixed(&m, r) / inside(n, b, r), 1, bound);
            if (n >= SERSIC_NARROW) {
                least = m.n < least ? m.n : least;
                most = m.n > most ? m.n : most;
            }
        }
        m.n = sersic_gaussians(s, n, 0.1, 0, m.sigma, m.flux);
        for (double r = 1e-3; r < 1e3; r *= 1.17)
            check_close(&k, mixed(&m, r), inside(n, b, r), bound);
    }
    check_end(&k);
    check_end(&middle);
    check_that(least >= 1 && most < SERSIC_PARTS, "%d to %d Gaussians at %g", least, most, eps);
    sersic_free(s);
}

/* The polynomials follow the rule; the order of asking does not matter. */
static void interpolated(void)
{
    static const double eps = 1e-9;
    struct sersic *s, *t;
    struct mixture m, d, again;
    int same = 1;
    if (sersic_new(&s, eps) || sersic_new(&t, eps))
        exit(1);
    struct check k = check_begin("interpolated in n against made for that n: light inside 0.001 to 1000 RE");
    for (int i = 0; i < 150; i++) {
        const double n = 0.5 + 0.0025 * pow(3000, (i + 0.5) / 150), other = 0.5 + 0.0025 * pow(3000, (149.5 - i) / 150);
        m.n = sersic_gaussians(s, n, 1e-3, 0, m.sigma, m.flux);
        d.n = sersic_direct(n, eps, d.sigma, d.flux);
        for (double r = 1e-3; r < 1e3; r *= 1.5)
            check_close(&k, mixed(&m, r), mixed(&d, r), 1e-9);
        (void)sersic_gaussians(t, other, 1e-3, 0, again.sigma, again.flux);
        again.n = sersic_gaussians(t, n, 1e-3, 0, again.sigma, again.flux);
        same &= again.n == m.n && !memcmp(again.sigma, m.sigma, (size_t)m.n * sizeof *m.sigma) && !memcmp(again.flux, m.flux, (size_t)m.n * sizeof *m.flux);
    }
    check_end(&k);
    check_that(same, "the same bytes in whatever order profiles are asked for");
    sersic_free(s);
    sersic_free(t);
}

/* Flux is kept, whatever is gathered. */
static void gathered(void)
{
    static const double tol[] = {0, 1e-6, 1e-2, 1, INFINITY};
    struct sersic *s;
    struct mixture m;
    if (sersic_new(&s, 1e-5))
        exit(1);
    struct check k = check_begin("flux of mixtures whose ends are gathered");
    for (double n = 0.5; n <= 8; n *= 1.1)
        for (int i = 0; i < 5; i++) {
            double sum = 0;
            m.n = sersic_gaussians(s, n, 0.1, tol[i], m.sigma, m.flux);
            for (int j = 0; j < m.n; j++)
                sum += m.flux[j];
            check_close(&k, sum, 1, 1e-14);
        }
    check_end(&k);
    const int all = sersic_gaussians(s, 4, 0.1, 0, m.sigma, m.flux), faint = sersic_gaussians(s, 4, 0.1, 1e-2, m.sigma, m.flux);
    check_that(faint < all, "a tolerance spares Gaussians: %d of %d", faint, all);
    check_that(!sersic_gaussians(s, 0.49, 0.1, 0, m.sigma, m.flux) && !sersic_gaussians(s, 8.1, 0.1, 0, m.sigma, m.flux)
               && !sersic_gaussians(s, NAN, 0.1, 0, m.sigma, m.flux), "other indices are refused");
    sersic_free(s);
}

int main(void)
{
    static const double eps[] = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8};
    for (size_t i = 0; i < sizeof eps / sizeof *eps; i++)
        profiles(eps[i]);
    interpolated();
    gathered();
    return check_status();
}
