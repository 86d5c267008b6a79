/* sersic.c - Sersic profiles as mixtures of Gaussians. */
#include "sersic.h"
#include <math.h>

/* Regularised incomplete gamma function P(a, x) by its series; a <= 16, x <= 30. */
static double gamma_p(double a, double x)
{
    double term = exp(-x + a * log(x) - lgamma(a + 1)), sum = term;
    for (int k = 1; k < 500 && term > 1e-17 * sum; k++)
        sum += term *= x / (a + k);
    return sum;
}

/* b with P(2n, b) = 1/2: half the light inside r = RE. */
static double sersic_b(double n)
{
    double lo = 1e-3, hi = 20;
    for (int i = 0; i < 100; i++) {
        double mid = 0.5 * (lo + hi);
        if (gamma_p(2 * n, mid) < 0.5)
            lo = mid;
        else
            hi = mid;
    }
    return 0.5 * (lo + hi);
}

/*
 * Density of ln t of the one-sided stable law of index a < 1, the mixture
 * exp(-s^a) = E exp(-s t), by Kanter's (1975) representation: average over u
 * of W exp(-W) a/(1-a), W = A(u) t^(-a/(1-a)).
 */
static double stable_density(double a, double lnt)
{
    const int angles = (int)(300 + 12 * a / (1 - a));   /* the integrand is narrow when a is near 1 */
    double sum = 0;
    for (int i = 0; i < angles; i++) {
        double u = (i + 0.5) * M_PI / angles;
        double lna = log(sin((1 - a) * u)) + a / (1 - a) * log(sin(a * u)) - 1 / (1 - a) * log(sin(u));
        double lnw = lna - a / (1 - a) * lnt;
        if (lnw < 7)
            sum += exp(lnw - exp(lnw));
    }
    return sum / angles * a / (1 - a);
}

int sersic_gaussians(double n, double *sigma, double *flux)
{
    if (!(n >= 0.5 && n <= 8))
        return 0;
    if (n < 0.5025) {
        sigma[0] = SIGMA_PER_RE;
        flux[0] = 1;
        return 1;
    }
    const double a = 1 / (2 * n), b = sersic_b(n), lnb = log(b) / a;
    const double step = 0.6 * fmin(1, 1.4 * (1 - a) / a);
    const double range = 4 * (1 - a) / a + 3;
    double best = 0, at = 0, sum = 0;
    for (double l = -range; l < range; l += fmax(step, 0.01)) {   /* weights of flux: density / t */
        double f = stable_density(a, l) * exp(-l);
        if (f > best) {
            best = f;
            at = l;
        }
    }
    int k = 0;
    for (int way = -1; way <= 1; way += 2)
        for (double l = way < 0 ? at - step : at; k < SERSIC_PARTS; l += way * step) {
            double f = stable_density(a, l) * exp(-l);
            if (!(f > 2e-7 * best))
                break;
            sigma[k] = 1 / sqrt(2 * exp(l + lnb));
            flux[k] = f;
            sum += f;
            k++;
        }
    for (int i = 0; i < k; i++)
        flux[i] /= sum;
    return k;
}
