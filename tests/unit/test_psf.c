/*
 * test_psf.c - images, widths, encircled energy and moments: Gaussians with
 * closed forms, the Airy disc, the study's table of widths, brute-force sums.
 */
#include "psf.h"
#include "pupil.h"
#include "check.h"
#include <stdlib.h>
#include <string.h>

/* table of an elliptical Gaussian with covariance (cxx, cxy, cyy) arcsec^2, centre (x0, y0) */
static struct otf gaussian(double cxx, double cxy, double cyy, double x0, double y0, double du, int n)
{
    double *re = malloc((size_t)(n * n) * 8), *im = malloc((size_t)(n * n) * 8);
    struct otf t = {0};
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            double u = (i - n / 2) * du, v = (j - n / 2) * du;
            double g = exp(-2 * M_PI * M_PI * (cxx * u * u + 2 * cxy * u * v + cyy * v * v)), t0 = 2 * M_PI * (u * x0 + v * y0);
            re[j * n + i] = g * cos(t0);
            im[j * n + i] = -g * sin(t0);
        }
    if (otf_nodes(&t, n, du, (n / 2) * du, re, im) != OK)
        check_that(0, "table of a Gaussian");
    return t;
}

static void gaussians(void)
{
    double s = 0.06, fwhm = 0, im[35], r[] = {0, 0.01, 0.1, 0.3, 0.6}, v[5], w[5];
    struct otf t = gaussian(s * s, 0, s * s, 0, 0, 0.25, 241);
    int bad = psf_fwhm(&t, 0, 0, &fwhm);
    check_that(!bad && fabs(fwhm - s * sqrt(8 * M_LN2)) < 1e-9, "FWHM of a Gaussian %.9f", fwhm);
    bad = psf_fwhm(&t, 0.08, 0, &fwhm);
    check_that(!bad && fabs(fwhm - 0.1 * sqrt(8 * M_LN2)) < 1e-9, "with diffusion %.9f", fwhm);
    check_that(psf_profile(&t, 0, 0, 5, r, v) == OK && psf_encircled(&t, 0, 0, 5, r, w) == OK, "profile, encircled energy");
    struct check c = check_begin("against the closed forms");
    for (int i = 0; i < 5; i++) {
        check_close(&c, v[i], exp(-r[i] * r[i] / 2 / s / s) / (2 * M_PI * s * s), 1e-12);
        check_close(&c, w[i], 1 - exp(-r[i] * r[i] / 2 / s / s), 1e-13);
    }
    check_end(&c);
    /* pixel integrals of a displaced elliptical Gaussian without cross term, odd x even image */
    struct otf e = gaussian(s * s, 0, 0.0049, 0.013, -0.021, 0.25, 241);
    check_that(psf_image(&e, 0, 0.05, 7, 5, 0.05, im) == OK, "image 7 x 5");
    c = check_begin("pixel integrals against erf");
    for (int j = 0; j < 5; j++)
        for (int i = 0; i < 7; i++) {
            double x = (i - 3) * 0.05 - 0.013, y = (j - 2) * 0.05 + 0.021;
            double fx = (erf((x + 0.025) / s / M_SQRT2) - erf((x - 0.025) / s / M_SQRT2)) / 2;
            double fy = (erf((y + 0.025) / 0.07 / M_SQRT2) - erf((y - 0.025) / 0.07 / M_SQRT2)) / 2;
            check_close(&c, im[j * 7 + i], fx * fy, 1e-14);
        }
    check_end(&c);
    double one;
    check_that(psf_image(&t, 0, 0, 1, 1, 0.05, &one) == OK && fabs(one - 0.0025 / (2 * M_PI * s * s)) < 1e-14, "image of one pixel");
    otf_free(&t);
    otf_free(&e);
}

/* weight times Gaussian is a Gaussian: moments in closed form */
static void gaussian_moments(void)
{
    double cxx = 0.004, cxy = -0.0012, cyy = 0.0025, w = 0.09, m[PSF_MOMENTS], x0 = 9, y0 = 9;
    struct otf t = gaussian(cxx, cxy, cyy, 0.03, 0.05, 0.2, 201);
    int bad = psf_centroid(&t, 0.02, 0, w, &x0, &y0);
    check_that(!bad && hypot(x0 - 0.03, y0 - 0.05) < 1e-12,
               "centroid of a displaced Gaussian (%.15f, %.15f)", x0, y0);
    check_that(psf_moments(&t, 0.02, 0, w, 0.03, 0.05, m) == OK, "moments about it");
    cxx += 0.0004;
    cyy += 0.0004;
    /* (C^-1 + 1/w^2)^-1 */
    double det = cxx * cyy - cxy * cxy, a = cyy / det + 1 / (w * w), b = -cxy / det, d = cxx / det + 1 / (w * w), D = a * d - b * b;
    double pxx = d / D, pxy = -b / D, pyy = a / D, s = sqrt((pxx * pyy - pxy * pxy) / det);
    double want[PSF_MOMENTS] = {s, 0, 0, pxx, pxy, pyy, 0, 0, 0, 0, 3 * pxx * pxx, 3 * pxx * pxy,
                                pxx * pyy + 2 * pxy * pxy, 3 * pyy * pxy, 3 * pyy * pyy};
    struct check c = check_begin("moments of a Gaussian under a Gaussian, in units of the width");
    for (int k = 0; k < PSF_MOMENTS; k++) {
        int order = k < 1 ? 0 : k < 3 ? 1 : k < 6 ? 2 : k < 10 ? 3 : 4;
        check_close(&c, m[k] / pow(w, order), want[k] / pow(w, order), 1e-13);
    }
    check_end(&c);
    check_that(psf_moment_index(0, 0) == 0 && psf_moment_index(2, 0) == 3 && psf_moment_index(1, 1) == 4 &&
                   psf_moment_index(3, 0) == 6 && psf_moment_index(0, 4) == 14, "order of the moments");
    check_that(psf_moments(&t, 0, 0, NAN, 0, 0, m) == E_RANGE && psf_moments(&t, 0, 0, 2, 0, 0, m) == E_RANGE &&
                   psf_moments(&t, NAN, 0, 0.1, 0, 0, m) == E_RANGE && psf_moments(&t, 0, 0, 0.1, NAN, 0, m) == E_RANGE,
               "impossible widths and places are refused");
    otf_free(&t);
}

/* every moment of a comatic ePSF against the sum over a fine image */
static void telescope_moments(void)
{
    struct pupil p = telescope_preset(0)->pupil;
    p.terms = 2;
    p.noll[0] = 8;
    p.waves[0] = 0.07;
    p.noll[1] = 5;
    p.waves[1] = 0.05;
    struct otf t = {0};
    struct err e;
    enum { N = 401 };
    double w = 0.13, scale = 0.01, x0 = 0.006, y0 = -0.011, m[PSF_MOMENTS], sum[PSF_MOMENTS] = {0}, *im = malloc(N * N * 8);
    int bad = pupil_otf(&p, 128, &t, &e) | psf_image(&t, 0.04, 0.1, N, N, scale, im) | psf_moments(&t, 0.04, 0.1, w, x0, y0, m);
    for (int j = 0; j < N; j++)
        for (int i = 0; i < N; i++) {
            double x = (i - N / 2) * scale - x0, y = (j - N / 2) * scale - y0, f = im[j * N + i] * exp(-(x * x + y * y) / 2 / w / w);
            for (int a = 0; a < 5; a++)
                for (int b = 0; a + b < 5; b++)
                    sum[psf_moment_index(a, b)] += f * pow(x, a) * pow(y, b);
        }
    check_that(!bad, "comatic, astigmatic ePSF");
    struct check c = check_begin("moments against sums over samples of 0.01\", in units of the width");
    for (int k = 0; k < PSF_MOMENTS; k++) {
        int order = k < 1 ? 0 : k < 3 ? 1 : k < 6 ? 2 : k < 10 ? 3 : 4;
        check_close(&c, m[k] / pow(w, order), sum[k] / (k ? sum[0] : 1) / pow(w, order), 1e-13);
    }
    check_end(&c);
    double cx, cy;
    bad = psf_centroid(&t, 0.04, 0.1, w, &cx, &cy) | psf_moments(&t, 0.04, 0.1, w, cx, cy, m);
    check_that(!bad && hypot(m[1], m[2]) < 1e-11 && hypot(cx, cy) > 1e-3, "centroid (%.5f, %.5f): first moments %.1e %.1e", cx, cy,
               m[1], m[2]);
    otf_free(&t);
    free(im);
}

static void airy(void)
{
    struct pupil p = telescope_preset(0)->pupil;
    p.obscuration = 0;
    p.struts = 0;
    struct otf t = {0};
    struct err e;
    double unit = p.wavelength / p.diameter / 4.84813681109536e-6, fwhm = 0;
    double r[] = {0, 0.3 * unit, 1.2196699 * unit, 1.6347 * unit, 5 * unit}, v[5], in[5];
    int bad = pupil_otf(&p, 256, &t, &e) | psf_fwhm(&t, 0, 0, &fwhm) | psf_profile(&t, 0, 0, 5, r, v) | psf_encircled(&t, 0, 0, 5, r, in);
    /* J1(x)/x = 1/2/sqrt 2 at x = 1.61633995 */
    check_that(!bad && fabs(fwhm / unit - 2 * 1.61633995 / M_PI) < 2e-6, "Airy disc: FWHM %.7f lambda/D", fwhm / unit);
    struct check c = check_begin("Airy disc: profile and encircled energy (1 - J0^2 - J1^2), wings of other periods 3e-6 of the peak");
    double peak = M_PI / 4 / unit / unit;
    for (int i = 0; i < 5; i++) {
        double x = M_PI * r[i] / unit;
        check_close(&c, v[i] / peak, x > 0 ? pow(2 * j1(x) / x, 2) : 1, 3e-6);
        check_close(&c, in[i], 1 - j0(x) * j0(x) - j1(x) * j1(x), 3e-4);
    }
    check_end(&c);
    otf_free(&t);
}

/* simulation-math 8.1 and 8.2: widths with 4 decimals */
static void widths(void)
{
    static const double sim[][5] = {    /* theta, Sim 1 ePSF, sigma, Sim 2 chPSF, Sim 2 ePSF */
        {0.04, .1262, .016, .0886, .0918}, {0.05, .1282, .020, .0920, .0974}, {0.06, .1308, .024, .0963, .1045},
        {0.07, .1339, .028, .1015, .1131}, {0.08, .1376, .032, .1077, .1233}, {0.09, .1418, .036, .1148, .1346},
        {0.10, .1467, .040, .1227, .1467}, {0.11, .1523, .044, .1313, .1593}, {0.12, .1585, .048, .1404, .1720},
        {0.13, .1653, .052, .1499, .1846}, {0.14, .1727, .056, .1596, .1970}, {0.15, .1807, .060, .1694, .2093},
        {0.16, .1891, .064, .1791, .2214}, {0.18, .2069, .072, .1985, .2454}, {0.20, .2257, .080, .2175, .2691},
        {0.22, .2450, .088, .2363, .2928}, {0.24, .2647, .096, .2549, .3165}};
    static const double eps[][5] = {    /* obscuration, vanes, Z6, chPSF, ePSF at 0.10" */
        {0, 0, 0, .1241, .1445}, {.15, 3, 0, .1234, .1448}, {.225, 3, 0, .1230, .1454}, {.30, 3, 0, .1227, .1467},
        {.32, 3, 0, .1226, .1472}, {.36, 3, 0, .1226, .1484}, {.40, 3, 0, .1227, .1500}, {.40, 3, .05, .1268, .1552}};
    struct otf t = {0};
    struct err e;
    struct check c = check_begin("widths of 17 pixel scales, both kinds of diffusion (1.5e-4\")");
    int bad = pupil_otf(&telescope_preset(0)->pupil, 256, &t, &e);
    for (size_t i = 0; i < sizeof sim / sizeof *sim; i++) {
        double f[4] = {0};
        bad |= psf_fwhm(&t, 0.04, 0, &f[0]) | psf_fwhm(&t, 0.04, sim[i][0], &f[1]) | psf_fwhm(&t, sim[i][2], 0, &f[2]) |
               psf_fwhm(&t, sim[i][2], sim[i][0], &f[3]);
        check_close(&c, f[0], 0.1227, 1.5e-4);
        check_close(&c, f[1], sim[i][1], 1.5e-4);
        check_close(&c, f[2], sim[i][3], 1.5e-4);
        check_close(&c, f[3], sim[i][4], 1.5e-4);
    }
    check_end(&c);
    otf_free(&t);
    c = check_begin("widths of 8 pupils (1.5e-4\")");
    for (size_t i = 0; i < sizeof eps / sizeof *eps; i++) {
        struct pupil p = telescope_preset(0)->pupil;
        double f[2] = {0};
        p.obscuration = eps[i][0];
        p.struts = (int)eps[i][1];
        p.terms = eps[i][2] > 0;
        p.noll[0] = 6;
        p.waves[0] = eps[i][2];
        bad |= pupil_otf(&p, 256, &t, &e) | psf_fwhm(&t, 0.04, 0, &f[0]) | psf_fwhm(&t, 0.04, 0.1, &f[1]);
        check_close(&c, f[0], eps[i][3], 1.5e-4);
        check_close(&c, f[1], eps[i][4], 1.5e-4);
        otf_free(&t);
    }
    check_end(&c);
    check_that(!bad, "all of them");
}

/* image: positive, sum is the encircled flux, independent of scale; odd, even, coarser than Nyquist */
static void images(void)
{
    struct otf t = {0};
    struct err e;
    enum { N = 600 };
    double *a = malloc(N * N * 8), *b = malloc(N * N * 8), sum = 0, lowest = 1, inside, r = 3;
    int bad = pupil_otf(&telescope_preset(0)->pupil, 256, &t, &e) | psf_image(&t, 0.04, 0, N, N, 0.02, a) |
              psf_encircled(&t, 0.04, 0, 1, &r, &inside);
    for (int i = 0; i < N * N; i++) {
        double x = (i % N - 299.5) * 0.02, y = (i / N - 299.5) * 0.02;
        sum += hypot(x, y) < r ? a[i] : 0;
        lowest = fmin(lowest, a[i]);
    }
    check_that(!bad && lowest > 0, "every pixel of a 600 x 600 image is positive: lowest %.2g", lowest);
    check_that(fabs(sum - inside) < 2e-6, "sum of pixels within 3\" %.7f, encircled energy %.7f", sum, inside);
    bad = psf_image(&t, 0.04, 0, 60, 60, 0.2, b);
    /* scale 0.2": samples of the same function, at places (k + 1/2) 0.2" = sample 10 k + 5 of 0.02" + half a step */
    bad |= psf_image(&t, 0.04, 0, 591, 591, 0.02, a);
    struct check c = check_begin("coarse samples are the fine ones");
    for (int j = 0; j < 60; j++)
        for (int i = 0; i < 60; i++)
            check_close(&c, b[j * 60 + i], 100 * a[(j * 10) * 591 + i * 10], 1e-13);
    check_end(&c);
    check_that(!bad && psf_image(&t, 0, 0, 2, 1100, 0.02, a) == E_RANGE && psf_image(&t, 0, 0, 0, 1, 0.02, a) == E_RANGE &&
                   psf_image(&t, 0, 0, 4, 4, NAN, a) == E_RANGE, "longer than the period, empty, NaN: refused");
    double f0 = 0, f1 = 0, f2 = 0;
    bad = psf_fwhm(&t, 0, 0, &f0) | psf_fwhm(&t, 1e-9, 0, &f1) | psf_fwhm(&t, 1e-3, 0, &f2);
    check_that(!bad && fabs(f0 - f1) < 1e-9 && f2 > f0 && f2 - f0 < 1e-4, "diffusion tends to none: %.9f %.9f %.9f", f0, f1, f2);
    otf_free(&t);
    free(a);
    free(b);
}

/* samples of a PSF: the same numbers as its table */
static void samples(void)
{
    struct otf t = gaussian(0.0036, 0.0008, 0.0049, 0.02, -0.01, 0.25, 161), s = {0};
    enum { NX = 81, NY = 90 };
    double *im = malloc(NX * NY * 8), m[PSF_MOMENTS], k[PSF_MOMENTS], f = 0, g = 0, *back = malloc(NX * NY * 8);
    int bad = psf_image(&t, 0, 0, NX, NY, 0.02, im);
    bad |= otf_sample(&s, NX, NY, im, 0.02, (NX - 1) / 2., (NY - 1) / 2., 25);
    bad |= psf_moments(&t, 0.03, 0.1, 0.08, 0.01, 0, m) | psf_moments(&s, 0.03, 0.1, 0.08, 0.01, 0, k);
    bad |= psf_fwhm(&t, 0.03, 0.1, &f) | psf_fwhm(&s, 0.03, 0.1, &g) | psf_image(&s, 0, 0, NX, NY, 0.02, back);
    check_that(!bad && fabs(f - g) < 1e-8, "FWHM of samples %.10f, of the table %.10f", g, f);
    struct check c = check_begin("moments of samples, in units of the width; their image");
    for (int i = 0; i < PSF_MOMENTS; i++) {
        int order = i < 1 ? 0 : i < 3 ? 1 : i < 6 ? 2 : i < 10 ? 3 : 4;
        check_close(&c, k[i] / pow(0.08, order), m[i] / pow(0.08, order), 1e-11);
    }
    for (int i = 0; i < NX * NY; i++)
        check_close(&c, back[i], im[i], 1e-13);
    check_end(&c);
    otf_free(&t);
    otf_free(&s);
    free(im);
    free(back);
}

int main(void)
{
    gaussians();
    gaussian_moments();
    telescope_moments();
    airy();
    widths();
    images();
    samples();
    struct otf none = {0};
    double v;
    check_that(psf_fwhm(&none, 0, 0, &v) == E_RANGE, "nothing has no width");
    return check_status();
}
