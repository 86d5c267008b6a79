/*
 * test_psfio.c - PSF files: round trip, every way a plain image tells its
 * sampling and centre, what is refused and in which words.
 */
#include "psfio.h"
#include "imageio.h"
#include "psf.h"
#include "pupil.h"
#include "sky.h"
#include "check.h"
#include <stdlib.h>
#include <string.h>

static struct err e;

/* image of a Gaussian of rms s pixels about (x0, y0), counting from 0, flux f; cards in h */
static void write_gaussian(const char *name, int nx, int ny, double s, double x0, double y0, double f, struct header *h)
{
    struct image im;
    if (image_new(&im, nx, ny) != OK)
        return;
    for (int y = 0; y < ny; y++)
        for (int x = 0; x < nx; x++)
            im.pix[y * nx + x] = (float)(f / (2 * M_PI * s * s) * exp(-((x - x0) * (x - x0) + (y - y0) * (y - y0)) / 2 / s / s));
    im.hdr = *h;
    check_that(image_write(&im, name, NULL, NULL, 0, &e) == OK, "written: %s", name);
    *h = (struct header){0};
    image_free(&im);
}

static int set(struct header *h, const char *key, double v)
{
    return header_set_double(h, key, v, NULL);
}

/* T of the Gaussian: exp(-2 pi^2 s^2 u^2), real, when the centre is right */
static void expect_gaussian(const char *name, const struct psf_options *o, double scale, double s, double flux)
{
    struct otf t = {0};
    struct psf_info info;
    int st = psf_read(name, o, &t, &info, &e);
    check_that(st == OK && info.scale == scale && fabs(info.flux - flux) < 1e-6 * flux && !info.from_otf, "%s: scale %g, flux %.7f%s",
               name, info.scale, info.flux, st ? e.text : "");
    if (st)
        return;
    double u[] = {-3, 0, 0.5, 2}, re[16], im[16], f = o->normalise ? 1 : flux;
    struct check c = check_begin("its transform");
    if (otf_grid(&t, 4, u, 4, u, re, im) == OK)
        for (int i = 0; i < 16; i++) {
            double k = u[i % 4] * u[i % 4] + u[i / 4] * u[i / 4];
            check_close(&c, re[i], f * exp(-2 * M_PI * M_PI * s * s * scale * scale * k), 1e-7 * f);
            check_close(&c, im[i], 0, 1e-7 * f);
        }
    check_close(&c, info.fwhm, s * scale * sqrt(8 * M_LN2), 1e-6);
    check_end(&c);
    otf_free(&t);
}

static void plain_images(void)
{
    struct header h = {0};
    struct psf_options o = {0};
    int bad = set(&h, "PIXELSCL", 0.03) | set(&h, "PIXSCALE", 0.03);
    write_gaussian("a.fits", 61, 64, 3, 30, 31.5, 1, &h);
    expect_gaussian("a.fits", &o, 0.03, 3, 1);
    bad |= set(&h, "PIXSCALE", 0.02) | set(&h, "CRPIX1", 25.25) | set(&h, "CRPIX2", 41);
    write_gaussian("b.fits", 61, 64, 3, 24.25, 40, 7, &h);
    expect_gaussian("b.fits", &o, 0.02, 3, 7);
    o.scale = 0.04;
    expect_gaussian("b.fits", &o, 0.04, 3, 7);
    o = (struct psf_options){.normalise = 1};
    expect_gaussian("b.fits", &o, 0.02, 3, 7);
    bad |= sky_set_tan(&h, 0.05, 31, 32.5, 150, 2) != OK;
    write_gaussian("c.fits", 61, 64, 3, 30, 31.5, 1, &h);
    o = (struct psf_options){0};
    struct otf t = {0};
    struct psf_info info;
    int st = psf_read("c.fits", &o, &t, &info, &e);
    check_that(st == OK && fabs(info.scale - 0.05) < 1e-12 && t.cx == 30 && t.cy == 31.5 && t.ucut == 0.5 / info.scale,
               "sampling from the WCS: %.12g, centre (%g, %g)", info.scale, t.cx, t.cy);
    otf_free(&t);
    bad |= set(&h, "PIXSCALE", 0.02) | set(&h, "CHDIFF", 0.03) | header_set_bool(&h, "PIXRESP", 1, NULL) | set(&h, "UCUT", 12);
    write_gaussian("d.fits", 61, 64, 3, 30, 31.5, 1, &h);
    st = psf_read("d.fits", &o, &t, NULL, &e);
    check_that(st == OK && t.chdiff == 0.03 && t.pixel == 0.02 && t.ucut == 12, "CHDIFF, PIXRESP and UCUT are read");
    otf_free(&t);
    o.cutoff = 5;
    st = psf_read("d.fits", &o, &t, NULL, &e);
    check_that(st == OK && t.ucut == 5, "the option's cut-off wins");
    otf_free(&t);
    o = (struct psf_options){.has_pixel = 1};
    st = psf_read("a.fits", &o, &t, NULL, &e);
    check_that(st == OK && t.pixel == 0.03 && !bad, "--psf-has-pixel without PIXRESP");
    otf_free(&t);
}

/* must fail with this status and a message that names the word */
static void refused(const char *name, const struct psf_options *o, int status, const char *word)
{
    struct otf t = {.n = 77};
    e.text[0] = 0;
    int st = psf_read(name, o, &t, NULL, &e);
    check_that(st == status && t.n == 77 && strstr(e.text, word), "refused: %s", e.text);
}

static void refusals(void)
{
    struct header h = {0};
    struct psf_options o = {0};
    write_gaussian("none.fits", 20, 20, 2, 10, 10, 1, &h);
    refused("none.fits", &o, E_DATA, "--psf-scale");
    int bad = set(&h, "PIXELSCL", 0.03) | set(&h, "PIXSCALE", 0.5);
    write_gaussian("two.fits", 20, 20, 2, 10, 10, 1, &h);
    refused("two.fits", &o, E_DATA, "PIXELSCL 0.03 and PIXSCALE 0.5 differ");
    bad |= header_set_str(&h, "PIXELSCL", "small", NULL);
    write_gaussian("word.fits", 20, 20, 2, 10, 10, 1, &h);
    refused("word.fits", &o, E_DATA, "PIXELSCL");
    bad |= set(&h, "PIXSCALE", 0.1);
    write_gaussian("minus.fits", 20, 20, 2, 10, 10, -1, &h);
    refused("minus.fits", &o, E_DATA, "positive");
    bad |= set(&h, "PIXSCALE", 0.1);
    write_gaussian("nan.fits", 20, 20, 2, 10, NAN, 1, &h);
    refused("nan.fits", &o, E_DATA, "blank");
    bad |= set(&h, "PIXSCALE", 0.1) | set(&h, "CRPIX1", 900);
    write_gaussian("crpix.fits", 20, 20, 2, 10, 10, 1, &h);
    refused("crpix.fits", &o, E_DATA, "CRPIX");
    bad |= set(&h, "PIXSCALE", 0.1) | set(&h, "CHDIFF", -1);
    write_gaussian("chdiff.fits", 20, 20, 2, 10, 10, 1, &h);
    refused("chdiff.fits", &o, E_DATA, "CHDIFF");
    bad |= set(&h, "PIXSCALE", 0.1) | header_set_long(&h, "PIXRESP", 3, NULL);
    write_gaussian("resp.fits", 20, 20, 2, 10, 10, 1, &h);
    refused("resp.fits", &o, E_DATA, "PIXRESP");
    bad |= set(&h, "PIXSCALE", 0.1);
    write_gaussian("good.fits", 20, 20, 2, 10, 10, 1, &h);
    o.cutoff = 6;
    refused("good.fits", &o, E_DATA, "cut-off");
    o = (struct psf_options){.max_memory = 9000};
    refused("good.fits", &o, E_NOMEM, "memory");
    o = (struct psf_options){0};
    refused("no such file", &o, E_IO, "no such file");
    refused("", &o, E_IO, "");
    check_that(!bad, "cards");
}

static void our_file(void)
{
    struct pupil p = telescope_preset(0)->pupil;
    struct otf t = {0}, all = {0}, back = {0};
    struct psf_options o = {0};
    struct psf_info info;
    struct header h = {0};
    double *im = malloc(40 * 30 * 8);
    p.terms = 1;
    p.noll[0] = 8;
    p.waves[0] = 0.1;
    int bad = pupil_otf(&p, 64, &t, &e) | psf_table(&t, 0.03, 0.1, &all) | psf_image(&all, 0, 0, 40, 30, 0.03, im);
    check_that(psf_write("ours.fits", 40, 30, im, &all, &h, NULL, NULL, 0, &e) == E_RANGE, "no PIXELSCL: %s", e.text);
    bad |= set(&h, "PIXELSCL", 0.03) | set(&h, "CHDIFF", 0.03) | header_set_bool(&h, "PIXRESP", 1, NULL) | set(&h, "PIXSIZE", 0.1);
    bad |= psf_write("ours.fits", 40, 30, im, &all, &h, "test", NULL, 0, &e) | psf_read("ours.fits", &o, &back, &info, &e);
    check_that(!bad && info.from_otf && back.n == all.n && back.du == all.du && back.ucut == all.ucut && back.chdiff == 0.03 &&
                   back.pixel == 0.1 && info.scale == 0.03 && info.flux == 1 && strcmp(info.base, "ours.fits") == 0,
               "our file comes back");
    size_t bytes = (size_t)all.n * (size_t)all.n * sizeof(double);
    check_that(!bad && memcmp(back.re, all.re, bytes) == 0 && memcmp(back.im, all.im, bytes) == 0, "with every bit of its table");
    double f;
    check_that(!bad && psf_fwhm(&all, 0, 0, &f) == OK && fabs(f - info.fwhm) < 1e-12, "FWHM when no keyword tells it");
    otf_free(&back);
    bad = psf_read("ours.fits[0]", &o, &back, &info, &e);
    check_that(!bad && !info.from_otf && back.nx_p == 40 && back.cx == 19.5 && back.cy == 14.5 && back.pixel == 0.1,
               "a suffix chooses the image");
    otf_free(&back);
    bad = psf_read("ours.fits[OTF]", &o, &back, &info, &e);
    check_that(!bad && info.from_otf && back.n == all.n, "or the table");
    otf_free(&back);
    all.im[7 * all.n + 60] += 1e-3;
    all.re[all.n] += 1e-3;
    bad = psf_write("skew.fits", 40, 30, im, &all, &h, "test", NULL, 0, &e);
    check_that(!bad, "a table that no real PSF has");
    refused("skew.fits", &o, E_DATA, "conjugate");
    otf_free(&t);
    otf_free(&all);
    header_free(&h);
    free(im);
}

/* samples to table: what the spline of the table gives against the exact transform */
static void tables(void)
{
    struct otf s = {0}, t = {0};
    enum { N = 101, M = 60 };
    double *im = malloc(N * N * 8), u[M], *a = malloc(M * M * 8), *b = malloc(M * M * 8), *c = malloc(M * M * 8), *d = malloc(M * M * 8);
    for (int i = 0; i < N * N; i++) {
        double x = i % N - 47.3, y = i / N - 51.1;
        im[i] = exp(-(x * x + 0.6 * x * y + 1.4 * y * y) / 60) / 100;
    }
    int bad = otf_sample(&s, N, N, im, 0.02, 50, 50, 25) | psf_table(&s, 0, 0, &t) | otf_spline(&t);
    for (int i = 0; i < M; i++)
        u[i] = (i - 30.3) * 0.21;
    bad |= otf_grid(&s, M, u, M, u, a, b) | otf_grid(&t, M, u, M, u, c, d);
    struct check k = check_begin("table of samples: spline against the exact transform, of T(0)");
    double zero = 0;
    for (int i = 0; i < N * N; i++)
        zero += im[i];
    for (int i = 0; i < M * M; i++) {
        check_close(&k, c[i] / zero, a[i] / zero, 2e-6);
        check_close(&k, d[i] / zero, b[i] / zero, 2e-6);
    }
    check_end(&k);
    check_that(!bad && t.ucut < 12 && t.n < 160 && t.n % 2 == 1, "trimmed to |u| < %g, side %d", t.ucut, t.n);
    otf_free(&s);
    otf_free(&t);
    free(im);
    free(a);
    free(b);
    free(c);
    free(d);
}

int main(void)
{
    plain_images();
    refusals();
    our_file();
    tables();
    return check_status();
}
