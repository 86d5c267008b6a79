/*
 * Photometry: overlap of a pixel with a circle by brute force; Gaussians with
 * known flux, widths and half-light radii; mirrored neighbours; hard cases.
 */
#include "check.h"
#include "detect.h"
#include "rng.h"
#include <stdlib.h>
#include <string.h>

enum { SIDE = 160 };

static void overlap(void)
{
    struct rng g = rng_stream(4, 0, RNG_TEST);
    struct check c = check_begin("pixel and circle, against 400 x 400 points");
    for (uint64_t t = 0; t < 60; t++) {
        double r = 0.05 + 4 * rng_uniform(&g, t, 0), a = 6.2831853 * rng_uniform(&g, t, 1);
        double d = r + 1.6 * (rng_uniform(&g, t, 2) - 0.5), dx = d * cos(a), dy = d * sin(a);
        long in = 0;
        for (int j = 0; j < 400; j++)
            for (int i = 0; i < 400; i++)
                in += pow(dx - 0.5 + (i + 0.5) / 400, 2) + pow(dy - 0.5 + (j + 0.5) / 400, 2) < r * r;
        check_close(&c, circle_overlap(dx, dy, r), (double)in / 160000, 1e-4);  /* error of the points: perimeter/400^1.5 */
    }
    check_end(&c);
    struct check s = check_begin("pixels of a circle add up to its area");
    for (double r = 0.1; r < 12; r *= 1.7) {
        double sum = 0;
        for (int j = -14; j <= 14; j++)
            for (int i = -14; i <= 14; i++)
                sum += circle_overlap(i + 0.3, j - 0.45, r);
        check_close(&s, sum / (acos(-1) * r * r), 1, 1e-12);
    }
    check_end(&s);
}

/* Image with flat noise-free sky; rms given. */
static int run(struct image *im, float *map, struct detect_params *p, struct detection *d)
{
    p->rms = 1e-3;
    p->threshold = 10;
    const struct pixels pix = pixels_of(im);
    return detect_run(&pix, map, 0, p, d);
}

static void add_gauss(struct image *im, double x0, double y0, double flux, double sx, double sy, double theta)
{
    double c = cos(theta), s = sin(theta);
    for (long y = 0; y < im->ny; y++)
        for (long x = 0; x < im->nx; x++) {
            double u = ((double)x - x0) * c + ((double)y - y0) * s, v = -((double)x - x0) * s + ((double)y - y0) * c;
            im->pix[y * im->nx + x] += (float)(flux / (2 * acos(-1) * sx * sy) * exp(-0.5 * (u * u / (sx * sx) + v * v / (sy * sy))));
        }
}

static void gaussians(void)
{
    struct image im = {0};
    struct detection d = {0};
    struct detect_params p = DETECT_DEFAULTS;
    double diameter[2] = {6, 20};
    p.phot.napertures = 2;
    p.phot.aperture = diameter;
    p.phot.windowed = 1;
    if (image_new(&im, SIDE, SIDE))
        return;
    add_gauss(&im, 70.3, 81.8, 1e5, 3, 3, 0);
    if (!check_that(run(&im, NULL, &p, &d) == OK && d.n == 1, "a round Gaussian is found"))
        return;
    const struct object *o = &d.object[0];
    struct check c = check_begin("round Gaussian: position, width, fluxes, half-light radius");
    check_close(&c, o->x, 70.3, 1e-4);
    check_close(&c, o->y, 81.8, 1e-4);
    check_close(&c, o->xwin, 70.3, 2e-3);                  /* steps stop at 2e-4 px */
    check_close(&c, o->ywin, 81.8, 2e-3);
    check_close(&c, o->a, 3, 1e-3);
    check_close(&c, o->b, 3, 1e-3);
    check_close(&c, o->fwhm, 3 * 2.3548, 0.01);            /* 1e-3 of the variance */
    check_close(&c, o->flux_iso, 1e5, 10);                 /* light below the isophote */
    /* first moment of the ellipse of 6 sigma: sqrt(pi/2); AUTO radius max(2.5 * 1.2533, 3.5) */
    check_close(&c, o->kron_radius, 3.5, 1e-9);
    check_close(&c, o->flux_auto, 1e5 * (1 - exp(-0.5 * 3.5 * 3.5)), 30);  /* 0.1 pixel rings on the border */
    /* pixels hold point values here, spread over the pixel by the exact overlap: variance 9 + 1/12 */
    double wide = 9 + 1 / 12.0;
    check_close(&c, o->flux_radius, sqrt(-2 * wide * log(1 - 0.5 * (1 - exp(-0.5 * 3.5 * 3.5)))), 3e-3);
    for (int k = 0; k < 2; k++)
        check_close(&c, d.aperture[2 * k], 1e5 * (1 - exp(-0.125 * diameter[k] * diameter[k] / wide)), 50);
    check_close(&c, d.aperture[1], 1e-3 * sqrt(acos(-1) * 9), 1e-6);
    check_end(&c);
    check_that(o->flags == 0 && o->area > 100 && o->xpeak == 70 && o->ypeak == 82, "flags, peak");
    detection_free(&d);
    memset(im.pix, 0, image_count(&im) * sizeof(float));
    add_gauss(&im, 80, 80, 1e5, 5, 2, 0.6);
    add_gauss(&im, 2, 30, 1e4, 2, 2, 0);
    if (!check_that(run(&im, NULL, &p, &d) == OK && d.n == 2, "an ellipse and an object at the border"))
        return;
    int e = d.object[0].flux_auto > d.object[1].flux_auto ? 0 : 1;
    o = &d.object[e];
    struct check q = check_begin("ellipse: axes, angle");
    check_close(&q, o->a, 5, 2e-3);
    check_close(&q, o->b, 2, 2e-3);
    check_close(&q, o->theta, 0.6 * 180 / acos(-1), 0.01);
    check_close(&q, o->flux_auto, 1e5 * (1 - exp(-0.5 * 3.5 * 3.5)), 100);
    check_end(&q);
    check_that((d.object[1 - e].flags & (DETECT_EDGE | DETECT_APERTURE)) == (DETECT_EDGE | DETECT_APERTURE), "the one at the border is flagged 8 + 16");
    detection_free(&d);
    image_free(&im);
}

/* A neighbour inside the AUTO ellipse is replaced by the mirrored pixels. */
static void neighbours(void)
{
    struct image im = {0};
    struct detection d = {0};
    struct detect_params p = DETECT_DEFAULTS;
    if (image_new(&im, SIDE, SIDE))
        return;
    add_gauss(&im, 70, 80, 1e5, 3, 3, 0);
    add_gauss(&im, 85, 80, 1e5, 3, 3, 0);
    if (!check_that(run(&im, NULL, &p, &d) == OK && d.n == 2, "two neighbours"))
        return;
    struct check c = check_begin("AUTO fluxes of two equal Gaussians 5 sigma apart");
    for (size_t i = 0; i < 2; i++)
        check_close(&c, d.object[i].flux_auto, 1e5, 2500);     /* 2.5 %: without masking it is 15 % */
    check_end(&c);
    check_that((d.object[0].flags & DETECT_BLENDED) && (d.object[1].flags & DETECT_BLENDED), "both carry flag 2");
    detection_free(&d);
    image_free(&im);
}

static void bad_pixels(void)
{
    struct image im = {0};
    struct detection d = {0};
    struct detect_params p = DETECT_DEFAULTS;
    if (image_new(&im, SIDE, SIDE))
        return;
    static float map[SIDE * SIDE];
    add_gauss(&im, 40, 40, 1e5, 3, 3, 0);
    add_gauss(&im, 120, 40, 1e5, 3, 3, 0);
    add_gauss(&im, 120, 120, 1e5, 3, 3, 0);
    for (long i = 0; i < SIDE * SIDE; i++)
        map[i] = 1e-3f;
    for (long x = 119; x < 122; x++)
        map[43 * SIDE + x] = INFINITY;
    im.pix[40 * SIDE + 42] = NAN;
    im.pix[41 * SIDE + 42] = INFINITY;
    p.phot.saturation = 1e5 / (2 * acos(-1) * 9) - 1;
    int st = run(&im, map, &p, &d);
    if (!check_that(st == OK && d.n == 3, "objects with holes: status %d, %zu objects", st, d.n))
        return;
    struct check c = check_begin("their AUTO fluxes, the missing pixels mirrored");
    int flags = 0, clean = 0, finite = 1;
    for (size_t i = 0; i < d.n; i++) {
        const struct object *o = &d.object[i];
        check_close(&c, o->flux_auto, 1e5, 1500);          /* the hole moves the centroid by 0.1 px and so the mirror */
        flags += (o->flags & DETECT_ISOPHOTE) != 0;
        clean += (o->flags & ~DETECT_SATURATED) == 0;
        finite &= isfinite(o->fwhm) && isfinite(o->flux_radius) && isfinite(o->err_auto) && isfinite(o->star_prob);
    }
    check_end(&c);
    check_that(flags == 2 && clean == 1 && finite, "two flagged 32, one clean, nothing NaN");
    detection_free(&d);
    image_free(&im);
}

static void stars(void)
{
    check_that(star_probability(0.25, 25, 1.2) > 0.9 && star_probability(0.25, 1000, 1.2) > 0.95 && star_probability(0, 100, 1.2) > 0.9,
               "a PSF-sized object: %.3f at S/N 25, %.3f at 1000; a Gaussian one %.3f", star_probability(0.25, 25, 1.2),
               star_probability(0.25, 1000, 1.2), star_probability(0, 100, 1.2));
    check_that(star_probability(0.7, 30, 1.2) < 0.1 && star_probability(-1.5, 100, 1.2) < 0.1,
               "twice the PSF's second moment is no star, nor is a cosmic ray");
    check_that(star_probability(0.3, 20, 0) == 0.5, "without a PSF 0.5");
    /* on images: a Gaussian star and a galaxy of three times its variance, pixel phases of a whole pixel */
    struct image im = {0};
    struct detection d = {0};
    struct detect_params p = DETECT_DEFAULTS;
    p.phot.psf_fwhm = 2;
    double t0 = pow(2 / 2.3548200450309493, 2) + 1 / 12.0, low = 1, high = 0;
    for (int k = 0; k < 9; k++) {
        if (image_new(&im, SIDE, SIDE))
            return;
        add_gauss(&im, 50 + k / 3 / 3.0, 50 + k % 3 / 3.0, 1e4, sqrt(t0), sqrt(t0), 0);
        add_gauss(&im, 110 + k / 3 / 3.0, 100 + k % 3 / 3.0, 1e4, sqrt(3 * t0), sqrt(3 * t0), 0);
        p.phot.gain = 0;
        if (run(&im, NULL, &p, &d) || d.n != 2)
            break;
        int first = d.object[0].x < 80;
        low = fmin(low, d.object[!first].star_prob);
        high = fmax(high, d.object[first].star_prob);
        detection_free(&d);
        image_free(&im);
    }
    check_that(low > 0.9 && high < 0.1, "images of stars and galaxies: at least %.3f, at most %.3g", low, high);
}

/* 1e20 and 1e-20 give the same objects; noise images give finite rows. */
static void scales(void)
{
    struct image im = {0};
    struct detect_params p = DETECT_DEFAULTS;
    struct detection a = {0}, d = {0};
    struct rng g = rng_stream(9, 0, RNG_TEST);
    struct smooth filter = {0};
    if (image_new(&im, SIDE, SIDE) || smooth_new(&filter, 3))
        return;
    p.filter = &filter;
    struct check c = check_begin("values times 1e20 and 1e-20");
    for (int k = 0; k < 3; k++) {
        double f = k == 0 ? 1 : k == 1 ? 1e20 : 1e-20;
        for (uint64_t i = 0; i < SIDE * SIDE; i++)
            im.pix[i] = (float)(rng_normal(&g, i, 0));
        add_gauss(&im, 50, 60, 500, 2, 2, 0);
        add_gauss(&im, 110, 90, 300, 3, 2, 1);
        for (uint64_t i = 0; i < SIDE * SIDE; i++)
            im.pix[i] = (float)((double)im.pix[i] * f);
        const struct pixels pix = pixels_of(&im);
        int st = detect_run(&pix, NULL, 0, &p, k ? &d : &a);
        if (st || (k && d.n != a.n)) {
            check_that(0, "scaled by %g: status %d, %zu of %zu objects", f, st, d.n, a.n);
            continue;
        }
        for (size_t i = 0; k && i < a.n; i++) {
            check_close(&c, d.object[i].flux_auto / f, a.object[i].flux_auto, 1e-3);   /* float32 rounding of pixels */
            check_close(&c, d.object[i].fwhm, a.object[i].fwhm, 0.02);                 /* stops at 1e-3 of the variance */
            check_close(&c, d.object[i].err_auto / f, a.object[i].err_auto, 1e-3);
        }
        if (k)
            detection_free(&d);
    }
    check_end(&c);
    smooth_free(&filter);
    detection_free(&a);
    image_free(&im);
}

int main(void)
{
    overlap();
    gaussians();
    neighbours();
    bad_pixels();
    stars();
    scales();
    return check_status();
}
