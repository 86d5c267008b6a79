/*
 * sersic.h - Sersic profiles as mixtures of Gaussians.
 *
 * exp(-b (r/RE)^(1/n)), n >= 1/2, is exactly a mixture of Gaussians (a completely monotone function of
 * r^2), here summed at 20 to 220 widths: error of the flux in any ring below 1e-3, 1e-4 from n = 0.52 on (tests/unit/test_render.c);
 * 0.5 <= n < 0.5025 is drawn as a Gaussian.
 */
#ifndef PIXSHEAR_SERSIC_H
#define PIXSHEAR_SERSIC_H

#define SIGMA_PER_RE 0.84932180028801904272   /* rms per axis of a Gaussian of half-light radius 1: 1 / sqrt(2 ln 2) */

/*
 * Gaussians of a Sersic profile of half-light radius 1: sigma[k] and flux[k] (sum 1), at
 * most SERSIC_PARTS; returns their number, 0 when n is outside 0.5..8.
 */
#define SERSIC_PARTS 256
int sersic_gaussians(double n, double *sigma, double *flux);

#endif
