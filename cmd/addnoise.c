/*
 * addnoise.c - photon, dark and read noise for images of expected electrons.
 */
#include "err.h"
#include "exposure.h"
#include "imageio.h"
#include "noise.h"
#include "opt.h"
#include "progress.h"
#include "psfio.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum definition { DEPTH_AREA, DEPTH_POINT5, DEPTH_POINT10 };

#define AREA_ARCSEC2 0.2           /* of the default depth definition */
#define SECONDS_PER_PIXEL 3e-8     /* for --check */

/* What the user asks for; NaN means not asked. */
struct request {
    double exptime, zeropoint, scale;
    double sky_mag, sky_rate, depth;
    int definition;
    const char *psf;
    double psf_scale;
    double dark, read_noise, gain, saturate, qe;
    int subtract, mirror;
};

/* One exposure and what will be done to it. */
struct plan {
    struct exposure x;
    struct noise noise;
    double time;             /* s, NaN when neither known nor needed */
    double rate;             /* sky, electron/s/arcsec^2 */
    double level;            /* mean of sky and dark in the result, electron/pixel */
    int subtracted;          /* the input's sky was */
    char label[400];
};

struct work {
    const struct request *r;
    const struct common *c;
    struct fits_in *in;
    struct fits_out *out;
    struct progress bar;
    const char *name;
    double psf_area;         /* arcsec^2, of --depth-definition point* */
    struct noise_counts counts;
    double seconds;          /* of drawing alone */
};

/* Effective area of the PSF file's image, arcsec^2. */
static double psf_area(const struct request *r, const struct common *c)
{
    struct image im;
    struct err e;
    if (image_read(&im, r->psf, c->max_memory, &e))
        die(EXIT_RUN, "%s", e.text);
    double scale;
    if (psf_sampling(r->psf, &im.hdr, r->psf_scale, &scale, &e))
        die(EXIT_RUN, "%s", e.text);
    double area = noise_psf_area((long)image_count(&im), im.pix, scale);
    if (!(area > 0 && area < INFINITY))
        die(EXIT_RUN, "%s: not a PSF: sum or sum of squares is not positive", r->psf);
    image_free(&im);
    return area;
}

/* Sky of one exposure, electron/s/arcsec^2. */
static double sky_rate(const struct work *w, const struct plan *p)
{
    const struct request *r = w->r;
    if (!isnan(r->sky_rate))
        return r->sky_rate;
    if (isnan(r->sky_mag) && isnan(r->depth))
        return 0;
    double zero = r->zeropoint;      /* magnitude of 1 detected electron/s */
    if (isnan(zero)) {
        if (isnan(p->x.magzero))
            die(EXIT_RUN, "%s: no keyword MAGZERO: give --zeropoint, the magnitude of 1 electron/s", p->label);
        zero = p->x.magzero - 2.5 * log10(p->time) + 2.5 * log10(r->qe);
    }
    if (!isnan(r->sky_mag))
        return pow(10, -0.4 * (r->sky_mag - zero));
    const double area = r->definition == DEPTH_AREA ? AREA_ARCSEC2 : w->psf_area;
    const double snr = r->definition == DEPTH_POINT5 ? 5 : 10;
    const double total = isnan(p->x.tottime) ? p->time : p->x.tottime;
    return noise_depth_sky(pow(10, -0.4 * (r->depth - zero)), total, area, snr);
}

/* The noise of one exposure from its header and the options. */
static void decide(const struct work *w, struct plan *p)
{
    const struct request *r = w->r;
    const struct exposure *x = &p->x;
    char seed[72];
    if (header_str(&x->hdr, "NOISSEED", seed, sizeof seed) == OK)
        die(EXIT_RUN, "%s: has noise already (NOISSEED): noise is drawn from expected electrons", p->label);
    if (x->unit != UNIT_NONE && x->unit != UNIT_ELECTRON)
        die(EXIT_RUN, "%s: BUNIT is not electron: noise is drawn from expected electrons", p->label);
    struct err e;
    if (r->definition != DEPTH_AREA && exposure_square(x, p->label, &e) == E_DATA)
        die(EXIT_RUN, "%s", e.text);
    p->time = isnan(x->exptime) ? r->exptime : x->exptime;
    const double scale = isnan(x->scale) ? r->scale : x->scale;
    if (fabs(r->exptime / x->exptime - 1) > 1e-9)
        die(EXIT_RUN, "%s: EXPTIME is %g s: --exptime %g is for images without it: leave it out", p->label, x->exptime, r->exptime);
    if (fabs(r->scale / x->scale - 1) > 1e-3)
        die(EXIT_RUN, "%s: pixels of %g arcsec: --pixscale %g is for images that do not tell: leave it out", p->label, x->scale, r->scale);
    const int timed = !isnan(r->sky_mag) || !isnan(r->sky_rate) || !isnan(r->depth) || r->dark > 0;
    if (timed && isnan(p->time))
        die(EXIT_RUN, "%s: no keyword EXPTIME: give --exptime", p->label);
    p->rate = sky_rate(w, p);
    if (p->rate > 0 && isnan(scale))
        die(EXIT_RUN, "%s: no keyword PIXSCALE and no WCS: give --pixscale", p->label);

    if (!isnan(r->zeropoint) && !timed && isnan(p->time))
        die(EXIT_RUN, "%s: no sky and no keyword EXPTIME: --zeropoint would do nothing: leave it out or give --exptime", p->label);

    struct noise *m = &p->noise;
    *m = (struct noise){.qe = r->qe, .read_noise = r->read_noise, .saturate = r->saturate, .gain = r->gain};
    m->sky = p->rate > 0 ? p->rate * scale * scale * p->time : 0;
    m->dark = r->dark > 0 ? r->dark * p->time : 0;
    if (header_bool(&x->hdr, "SKYSUB", &p->subtracted))
        p->subtracted = 0;
    const double before = p->subtracted ? 0 : header_double_or(&x->hdr, "SKYLEVEL", 0) * r->qe;
    p->level = before + m->sky + m->dark;
    if (r->subtract && !(p->level > 0) && isnan(r->sky_mag) && isnan(r->sky_rate) && isnan(r->depth) && !(r->dark > 0))
        die(EXIT_RUN, "%s: no sky and no dark: --subtract-sky would do nothing: leave it out", p->label);
    m->subtract = r->subtract ? p->level : 0;
    m->mirror = r->mirror;
    if (w->c->verbose || w->c->check)
        fprintf(stderr, "addnoise: %s: %ld x %ld, sky %.6g e/s/arcsec2 = %.6g e, dark %.6g e, read noise %g e, "
                "gain %g, about %.2g s\n", p->label, x->nx, x->ny, p->rate, m->sky, m->dark, m->read_noise, m->gain,
                SECONDS_PER_PIXEL * (double)x->nx * (double)x->ny);
}

/* The header of the result. */
static int describe(const struct work *w, struct plan *p, const char *record)
{
    const struct request *r = w->r;
    struct header *h = &p->x.hdr;
    double magzero = p->x.magzero;
    if (!isnan(r->zeropoint) && !isnan(p->time))
        magzero = r->zeropoint + 2.5 * log10(p->time / r->qe);
    char seed[24];
    snprintf(seed, sizeof seed, "%llu", (unsigned long long)w->c->seed);
    int st = header_set_str(h, "BUNIT", r->gain == 1 ? "electron" : "adu", NULL);
    if (st == OK)
        st = header_set_double(h, "GAIN", r->gain, "electron per BUNIT");
    if (st == OK && !isnan(p->time))
        st = header_set_double(h, "EXPTIME", p->time, "exposure time, s");
    if (st == OK && !isnan(magzero))
        st = header_set_double(h, "MAGZERO", magzero + 2.5 * log10(r->qe / r->gain), "AB magnitude of 1 BUNIT");
    if (st == OK && r->read_noise > 0)
        st = header_set_double(h, "RDNOISE", r->read_noise, "read noise, electron rms per pixel");
    const double full = isfinite(r->saturate) ? r->saturate : header_double_or(h, "SATURATE", INFINITY);
    if (st == OK && isfinite(full))
        st = header_set_double(h, "SATURATE", (full - p->noise.subtract) / r->gain, "saturation level, BUNIT");
    if (st == OK && (p->level > 0 || r->subtract)) {
        st = header_set_double(h, "SKYLEVEL", p->level / r->gain, "mean sky and dark per pixel, BUNIT");
        if (st == OK)
            st = header_set_bool(h, "SKYSUB", r->subtract || p->subtracted, "SKYLEVEL is subtracted");
    }
    if (st == OK)
        st = header_set_str(h, "NOISSEED", seed, "seed of the noise");
    if (st == OK && r->mirror)
        st = header_set_long(h, "MIRROR", 1, "the opposite noise of this seed");
    return st == OK ? header_history(h, record) : st;
}

/* Read, draw and write one exposure, a few rows at a time. */
static int expose(struct work *w, const struct plan *p, struct err *e)
{
    const struct exposure *x = &p->x;
    const long rows = 1 + (1 << 20) / x->nx;
    float *pix = malloc((size_t)rows * (size_t)x->nx * sizeof *pix);
    if (!pix)
        return err_set(e, E_NOMEM, "%s: %s", p->label, err_text(E_NOMEM));
    const uint32_t number = x->expnum > 0 ? (uint32_t)x->expnum : 0;
    int st = fits_out_hdu(w->out, -32, x->nx, x->ny, 1, &x->hdr, e);
    for (long y = 0; y < x->ny && st == OK; y += rows) {
        long here = x->ny - y < rows ? x->ny - y : rows;
        st = fits_in_rows(w->in, x->index, 0, y, here, pix, e);
        if (st == OK) {
            const double begin = seconds_now();
            st = noise_add(&p->noise, w->c->seed, number, (uint64_t)y * (uint64_t)x->nx, here * x->nx,
                           w->c->threads, pix, &w->counts);
            w->seconds += seconds_now() - begin;
            if (st)
                err_set(e, st, "%s: %s", p->label, err_text(st));
        }
        if (st == OK)
            st = fits_out_rows(w->out, here, pix, e);
        progress_tick(&w->bar, here);
    }
    free(pix);
    return st;
}

static int write_all(struct work *w, const struct plan *p, size_t n, struct err *e)
{
    const char *inputs[] = {w->name, w->r->psf};
    struct header top = {0};
    long rows = 0;
    for (size_t i = 0; i < n; i++)
        rows += p[i].x.ny;
    int st = fits_out_open(&w->out, w->c->out, inputs, w->r->psf ? 2 : 1, e);
    if (st)
        return st;
    if (n > 1)                             /* SCI extensions below an empty primary */
        st = fits_in_header(w->in, 0, &top, e);
    if (st == OK && n > 1 && p[0].x.index > 0)
        st = fits_out_hdu(w->out, -32, 0, 0, 1, &top, e);
    header_free(&top);
    progress_begin(&w->bar, "addnoise", rows, w->c->quiet);
    for (size_t i = 0; i < n && st == OK; i++)
        st = expose(w, &p[i], e);
    progress_end(&w->bar);
    if (st == OK)
        return fits_out_commit(w->out, e);
    fits_out_abandon(w->out);
    return st;
}

static void report(const struct noise_counts *n, const char *name)
{
    if (n->negative)
        warn("%s: %ld pixels with a negative mean: drawn with mean 0", name, n->negative);
    if (n->refused)
        warn("%s: %ld pixels with a mean above 1e15 or infinite: set to NaN", name, n->refused);
    if (n->large)
        warn("%s: %ld pixels with a mean above 2^24: float32 rounds their draws", name, n->large);
    if (n->saturated)
        warn("%s: %ld pixels saturated", name, n->saturated);
}

static void check_options(const struct request *r, const struct opt *own, const struct common *c)
{
    static const char *const point[] = {"psf", "psf-scale", NULL}, *const depth[] = {"depth-definition", NULL},
                      *const pixel[] = {"pixscale", NULL};
    if (isnan(r->depth) && isnan(r->sky_mag) && isnan(r->sky_rate))
        opt_idle(own, c, pixel, "without a sky");
    if (isnan(r->depth))
        opt_idle(own, c, depth, "without --depth");
    if (r->definition == DEPTH_AREA)
        opt_idle(own, c, point, "without --depth-definition point5 or point10");
    if (!isnan(r->sky_mag) + !isnan(r->sky_rate) + !isnan(r->depth) > 1)
        die(EXIT_USAGE, "--sky, --sky-rate and --depth each set the sky: give one");
    if (r->definition != DEPTH_AREA && !r->psf)
        die(EXIT_USAGE, "--depth-definition point5 and point10 need --psf FILE");
}

/* Exposures of one file need numbers of their own, else they would get the same noise. */
static void check_numbers(const struct plan *p, size_t n)
{
    for (size_t i = 1; i < n; i++)
        for (size_t k = 0; k < i; k++)
            if (p[i].x.expnum == p[k].x.expnum)
                die(EXIT_RUN, p[i].x.expnum < 0 ? "%s: no EXPNUM, nor has %s one: number them, or both get the same noise"
                                                : "%s: has the EXPNUM of %s: number them, or both get the same noise",
                    p[i].label, p[k].label);
}

/* All headers and models are made first, so that nothing is drawn for a bad one. */
static void run(struct work *w, const char *record)
{
    struct err e;
    int *list;
    size_t n;
    if (exposure_list(w->in, w->name, &list, &n, &e))
        die(EXIT_RUN, "%s", e.text);
    struct plan *p = calloc(n, sizeof *p);
    if (!p)
        die(EXIT_RUN, "%s: %s", w->name, err_text(E_NOMEM));
    for (size_t i = 0; i < n; i++) {
        exposure_label(w->in, w->name, list[i], p[i].label, sizeof p[i].label);
        if (exposure_read(w->in, w->name, list[i], &p[i].x, &e))
            die(EXIT_RUN, "%s", e.text);
        decide(w, &p[i]);
        int st = describe(w, &p[i], record);
        if (st)
            die(EXIT_RUN, "%s: %s", p[i].label, err_text(st));
    }
    check_numbers(p, n);
    if (!w->c->check && write_all(w, p, n, &e))
        die(EXIT_RUN, "%s", e.text);
    for (size_t i = 0; i < n; i++)
        header_free(&p[i].x.hdr);
    free(p);
    free(list);
}

int main(int argc, char **argv)
{
    struct common c = COMMON_DEFAULTS;
    struct request r = {
        .exptime = NAN, .zeropoint = NAN, .scale = NAN, .sky_mag = NAN, .sky_rate = NAN, .depth = NAN,
        .psf_scale = NAN, .gain = 1, .saturate = INFINITY, .qe = 1,
    };
    const struct program prog = {
        "addnoise", "draw what a detector reads from an image of expected electrons", "[IMAGE]", 0, 1,
        "  addnoise --depth 27.7 clean.fits -o noisy.fits\n"
        "  simage stars.txt -p psf.fits -x 0.1 | addnoise --sky 23.3 --read-noise 4 -s 7 | detect -\n", OUT_FITS
    };
    const struct opt own[] = {
        {"exptime", 'T', OPT_REAL, &r.exptime, 1e-9, 1e12, "S", "exposure time, s, where EXPTIME is missing", 0, 0},
        {"sky", 0, OPT_REAL, &r.sky_mag, -50, 100, "MAG", "sky, AB magnitude per arcsec^2", 0, 0},
        {"sky-rate", 0, OPT_REAL, &r.sky_rate, 0, 1e12, "RATE", "sky, electron/s/arcsec^2", 0, 0},
        {"depth", 0, OPT_REAL, &r.depth, -50, 100, "MAG", "sky that gives this limiting AB magnitude", 0, 0},
        {"depth-definition", 0, OPT_CHOICE, &r.definition, 0, 0, 0,
         "10 sigma in 0.2 arcsec^2; 5, 10 sigma for a point source", "area|point5|point10", 0},
        {"psf", 'p', OPT_STR, &r.psf, 0, 0, "FILE", "PSF image of the point source", 0, 1},
        {"psf-scale", 0, OPT_REAL, &r.psf_scale, 1e-9, 1e6, "ARCSEC", "its sampling, over PIXELSCL", 0, 0},
        {"zeropoint", 'z', OPT_REAL, &r.zeropoint, -50, 100, "MAG", "AB magnitude of 1 electron/s, over MAGZERO", 0, 0},
        {"pixscale", 'x', OPT_REAL, &r.scale, 1e-9, 1e6, "ARCSEC", "pixel, arcsec, where PIXSCALE and WCS are missing", 0, 0},
        {"dark", 0, OPT_REAL, &r.dark, 0, 1e12, "RATE", "dark current, electron/s/pixel", 0, 0},
        {"read-noise", 'r', OPT_REAL, &r.read_noise, 0, 1e9, "E", "read noise, electron rms per exposure", 0, 0},
        {"gain", 'g', OPT_REAL, &r.gain, 1e-9, 1e9, "G", "electron per adu; the output is in adu unless 1", 0, 0},
        {"saturate", 0, OPT_REAL, &r.saturate, 1e-9, 1e15, "E", "electrons at which a pixel is cut", 0, 0},
        {"qe", 0, OPT_REAL, &r.qe, 1e-9, 1e9, "F", "factor on the input image", 0, 0},
        {"subtract-sky", 0, OPT_FLAG, &r.subtract, 0, 0, 0, "take the mean of sky and dark off again", 0, 0},
        {"mirror", 0, OPT_FLAG, &r.mirror, 0, 0, 0, "the opposite noise: 1 - u for every uniform number u", 0, 0},
        {0}
    };
    opt_parse(&prog, own, &c, argc, argv);
    check_options(&r, own, &c);
    struct work w = {.r = &r, .c = &c, .name = c.argv[0]};
    struct err e;
    if (r.definition != DEPTH_AREA)
        w.psf_area = psf_area(&r, &c);
    if (fits_in_open(&w.in, w.name, c.max_memory, &e))
        die(EXIT_RUN, "%s", e.text);
    char *record = opt_record(&prog, own, &c);
    run(&w, record);
    if (c.verbose && !c.check)
        fprintf(stderr, "addnoise: drawn in %.4f s\n", w.seconds);
    if (!c.quiet)
        report(&w.counts, w.name);
    free(record);
    fits_in_close(w.in);
    return EXIT_DONE;
}
