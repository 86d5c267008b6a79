/*
 * simage - scene list, shapelet models and PSF to an image of expected electrons.
 *
 * Noise-free: addnoise draws.  The positions of the list are not sheared; the
 * shapes are, about each object's origin.
 */
#include "catkeys.h"
#include "emit.h"
#include "err.h"
#include "exposure.h"
#include "field.h"
#include "image.h"
#include "imageio.h"
#include "models.h"
#include "opt.h"
#include "outfile.h"
#include "pages.h"
#include "place.h"
#include "plan.h"
#include "progress.h"
#include "psf.h"
#include "psfio.h"
#include "render.h"
#include "scenelist.h"
#include "sky.h"
#include "table.h"
#include "tableio.h"
#include "tally.h"
#include "truth.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define PSF_FLUX_DOUBT 0.05    /* a PSF that lacks more, or has more, is told */
#define BASE_MB 12             /* what --check adds for program, libraries, PSF and the rows being drawn */
#define BLOCK 16384            /* objects, or Gaussians of their profiles, that are planned and drawn together */

/* What the user asks for. */
struct request {
    const char *models, *psf, *set, *truth, *wcs;
    double pixel;            /* arcsec, of the detector */
    double size[2];          /* output pixels; 0: from the list's FIELD */
    double shear[2];
    int order;               /* 0: exact */
    long subpixel;
    double exptime, zeropoint;
    double diffusion, jitter, ipc;
    double box[2], edge[2];  /* arcsec, of the pixel's response; 0: the pixel, no edges */
    double centre[2];        /* deg; NaN: the middle that --wcs says */
    int no_pixel;
    int whole;               /* --method field */
    struct psf_options psf_options;
    struct accuracy accuracy;
};

/* Everything read. */
struct input {
    struct scene_list list;
    struct table catalogue;
    struct models models;
    struct otf otf;
    struct psf_info psf;
    double fwhm;             /* of PSF, jitter and diffusion, arcsec; NaN without a PSF */
    struct header wcs;       /* of --wcs, and the size of its image */
    long nx, ny;
    struct place place;
    struct truth *truth;
};

static void check(int st)
{
    if (st)
        die(EXIT_RUN, "%s", err_text(st));
}

static void check_options(const struct request *r, const struct opt *own, const struct common *c)
{
    for (const char *p = r->set; p && *p; p++)
        if (*p <= ' ' || *p > '~')
            die(EXIT_USAGE, "--set '%s': one word of printable ASCII is needed, catalogues carry it", r->set);
    if (r->truth && outfile_same(r->truth, c->out))
        die(EXIT_USAGE, "--truth and --output cannot both be %s", strcmp(c->out, "-") ? c->out : "standard output");
    if (!opt_given(own, c, "pixscale"))
        die(EXIT_USAGE, "how large are the pixels? Give -x ARCSEC");
    if (!(hypot(r->shear[0], r->shear[1]) < 1))
        die(EXIT_USAGE, "--shear %g,%g: a reduced shear is below 1", r->shear[0], r->shear[1]);
    const double needs[] = {r->diffusion, r->jitter, r->ipc, r->box[0], r->edge[0] + r->edge[1]};
    static const char *const name[] = {"diffusion", "jitter", "ipc", "pixel", "pixel-edge"};
    for (int i = 0; i < 5; i++)
        if (needs[i] > 0 && !r->psf)
            die(EXIT_USAGE, "--%s needs a PSF: give -p FILE", name[i]);
    static const char *const of_psf[] = {"psf-scale", "psf-cutoff", "psf-has-pixel", "psf-normalise", NULL};
    if (!r->psf)
        opt_idle(own, c, of_psf, "without --psf");
    if (!(fabs(r->centre[1]) <= 90))
        die(EXIT_USAGE, "--center %g,%g: declination is -90 to 90 degrees", r->centre[0], r->centre[1]);
    if ((r->box[0] > 0 || r->edge[0] + r->edge[1] > 0) && r->no_pixel)
        die(EXIT_USAGE, "--pixel and --no-pixel: give one");
    for (int i = 0; i < 2; i++)
        if (r->edge[i] > (r->box[i] > 0 ? r->box[i] : r->pixel))
            die(EXIT_USAGE, "--pixel-edge %g: edges are shorter than the pixel is wide at half height", r->edge[i]);
    if (r->wcs && r->subpixel > 1)
        die(EXIT_USAGE, "--wcs and --subpixel: a WCS tells its own pixels: give one");
    if (r->whole && !r->psf)
        die(EXIT_USAGE, "--method field convolves with a PSF: give -p FILE");
    if (opt_given(own, c, "size") && (r->size[0] != floor(r->size[0]) || r->size[1] != floor(r->size[1])))
        die(EXIT_USAGE, "--size %g,%g: whole numbers of pixels, please", r->size[0], r->size[1]);
}

/* ---- input ---- */

static void check_memory(double bytes, const char *name, const struct common *c)
{
    if (bytes > c->max_memory)
        die(EXIT_RUN, "%s: needs %.0f MB, more than --max-memory", name, 1e-6 * bytes);
}

static void must(int st, const struct err *e)
{
    if (st)
        die(EXIT_RUN, "%s", e->text);
}

/* The list's header and the models. */
static void read_scene(struct input *in, const struct request *r, const struct common *c)
{
    struct err e;
    must(scene_list_open(&in->list, c->argv[0], c->max_memory, &e), &e);
    if (!r->models)
        return;
    must(table_read(&in->catalogue, r->models, c->max_memory, &e), &e);
    must(models_open(&in->models, &in->catalogue, r->models, &e), &e);
}

/* The PSF; its response, ready for a view. */
static void read_psf(struct input *in, const struct request *r, const struct common *c, struct view *v)
{
    struct err e;
    in->fwhm = NAN;
    if (!r->psf)
        return;
    struct psf_options o = r->psf_options;
    o.max_memory = c->max_memory;
    if (psf_read(r->psf, &o, &in->otf, &in->psf, &e))
        die(EXIT_RUN, "%s", e.text);
    if (!c->quiet && !o.normalise && !(fabs(in->psf.flux - 1) <= PSF_FLUX_DOUBT))
        warn("%s: its flux is %.6g, not 1, and all objects' is multiplied by it: --psf-normalise divides it out", r->psf, in->psf.flux);
    if (r->diffusion > 0 && in->otf.chdiff > 0)
        die(EXIT_RUN, "%s: charge diffusion of %g\" is in the PSF already (CHDIFF): leave --diffusion out or make the PSF "
            "with psfgen --diffusion 0", r->psf, in->otf.chdiff);
    if (in->otf.pixel > 0 && (r->box[0] > 0 || r->edge[0] + r->edge[1] > 0))
        die(EXIT_RUN, "%s: a pixel of %g\" is in the PSF already (PIXRESP): leave --pixel and --pixel-edge out", r->psf, in->otf.pixel);
    if (in->otf.pixel > 0 && !r->no_pixel && fabs(in->otf.pixel / v->pixel - 1) > 1e-6)
        die(EXIT_RUN, "%s: a pixel of %g\" is in the PSF already (PIXRESP): it does not fit pixels of %g\"; make one "
            "with psfgen without --pixel", r->psf, in->otf.pixel, v->pixel);
    v->psf = &in->otf;
    v->diffusion = hypot(r->diffusion, r->jitter);
    v->ipc = r->ipc;
    v->pitch = r->pixel;
    memcpy(v->box, r->box, sizeof v->box);
    memcpy(v->edge, r->edge, sizeof v->edge);
    v->no_pixel = r->no_pixel || in->otf.pixel > 0;
    if (v->diffusion == 0 && isfinite(in->psf.fwhm))
        in->fwhm = in->psf.fwhm;
    else if (in->otf.n > 0 && psf_fwhm(&in->otf, v->diffusion, 0, &in->fwhm))
        in->fwhm = NAN;
    otf_keep_spline(&in->otf);             /* all that plans need */
}

/* The WCS of --wcs, which must have the pixels that -x says. */
static void read_wcs(struct input *in, const struct request *r, const struct common *c)
{
    struct fits_in *f;
    struct header h = {0};
    struct err e;
    if (!r->wcs)
        return;
    if (fits_in_open(&f, r->wcs, c->max_memory, &e))
        die(EXIT_RUN, "%s", e.text);
    int i = fits_in_selected(f);
    if (i < 0)
        die(EXIT_RUN, "%s: no image in it: give one whose WCS is wanted", r->wcs);
    in->nx = fits_in_hdu(f, i)->nx;
    in->ny = fits_in_hdu(f, i)->ny;
    if (fits_in_header(f, i, &h, &e))
        die(EXIT_RUN, "%s", e.text);
    fits_in_close(f);
    if (sky_open(&in->place.sky, &h, &e))
        die(EXIT_RUN, "%s: %s", r->wcs, e.text);
    if (!(fabs(sky_scale(in->place.sky) / r->pixel - 1) < 0.1))
        die(EXIT_RUN, "%s: its WCS has pixels of %.6g\": give -x %.6g, not %g", r->wcs, sky_scale(in->place.sky), sky_scale(in->place.sky), r->pixel);
    check(exposure_copy_wcs(&in->wcs, &h));
    header_free(&h);
}

/* Sides from --size, or those of the image of --wcs, or from the list's keyword FIELD: enough for whole detector pixels at every dither. */
static void set_size(const struct input *in, const struct request *r, const char *name, struct view *v)
{
    double side[2] = {r->size[0], r->size[1]}, field;
    if (!(side[0] > 0) && r->wcs) {
        side[0] = (double)in->nx;
        side[1] = (double)in->ny;
    } else if (!(side[0] > 0)) {
        struct err e;
        if (catkeys_number(&in->list.table, "FIELD", &field, &e))
            die(EXIT_RUN, "%s: %s", name, e.text);
        if (!(field > 0))
            die(EXIT_USAGE, "%s: no keyword FIELD: give --size NX,NY in output pixels", name);
        double n = fmax(1, rint(field / r->pixel));
        side[0] = side[1] = (double)r->subpixel * n + (double)r->subpixel - 1;
    }
    if (!(side[0] >= 1 && side[1] >= 1 && side[0] <= 65535 && side[1] <= 65535))
        die(EXIT_USAGE, "an image of %.0f x %.0f pixels: sides are 1 to 65535", side[0], side[1]);
    v->nx = (long)side[0];
    v->ny = (long)side[1];
}

/* Header of the image: units, scale, shear, PSF, accuracy, WCS. */
static int describe(struct header *h, const struct input *in, const struct request *r, const struct view *v)
{
    int st = header_set_str(h, "BUNIT", "electron", "expected electrons per pixel");
    const char *seed = table_text(&in->list.table, "SEED");
    const struct { const char *key; double value; const char *what; } card[] = {
        {"EXPTIME", r->exptime, "exposure time, s"},
        {"GAIN", 1, "electron per BUNIT"},
        {"MAGZERO", r->zeropoint + 2.5 * log10(r->exptime), "AB magnitude of 1 electron"},
        {"PIXSCALE", v->pixel, "arcsec per pixel"},
        {"CCDSCALE", r->pixel, "arcsec per detector pixel"},
        {"SHEAR1", r->shear[0], "reduced shear of the field, along x"},
        {"SHEAR2", r->shear[1], "reduced shear of the field, along y = x"},
        {"ACCURACY", r->accuracy.eps, "error of a pixel over the object's peak"},
        {"FLOOR", r->accuracy.floor, "error of a pixel allowed always, electron"},
    };
    for (size_t i = 0; st == OK && i < sizeof card / sizeof *card; i++)
        st = header_set_double(h, card[i].key, card[i].value, card[i].what);
    if (st == OK)
        st = header_set_long(h, "SHEARORD", r->order, "order of the shear series; 0 is exact");
    if (st == OK && r->set)
        st = header_set_str(h, "SETNAME", r->set, "set of simulations");
    if (st == OK && seed)
        st = header_set_str(h, "SEED", seed, "seed of the scene list");
    if (st == OK && r->psf) {
        char what[32];
        snprintf(what, sizeof what, in->psf.sum[0] ? "PSF; DATASUM %s" : "PSF", in->psf.sum);
        st = header_set_str(h, "PSFFILE", in->psf.base, what);
        if (st == OK && isfinite(in->fwhm))
            st = header_set_double(h, "PSFFWHM", in->fwhm, "FWHM of PSF and charge diffusion, arcsec");
        if (st == OK)
            st = header_set_double(h, "CHDIFF", in->otf.chdiff + r->diffusion, "charge diffusion, rms, arcsec");
    }
    if (st == OK && r->jitter > 0)
        st = header_set_double(h, "JITTER", r->jitter, "motion of the line of sight, rms, arcsec");
    if (st == OK && r->ipc > 0)
        st = header_set_double(h, "IPC", r->ipc, "charge to each of four neighbour pixels");
    for (int i = 0; i < 2 && st == OK && r->box[0] > 0; i++)
        st = header_set_double(h, i ? "PIXSIZE2" : "PIXSIZE1", r->box[i], "side of the pixel's response, arcsec");
    for (int i = 0; i < 2 && st == OK && r->edge[0] + r->edge[1] > 0; i++)
        st = header_set_double(h, i ? "PIXEDGE2" : "PIXEDGE1", r->edge[i], "length over which it falls to 0, arcsec");
    if (st == OK)
        st = header_set_bool(h, "PIXRESP", !v->no_pixel || in->otf.pixel > 0, "the pixel is in");
    for (size_t i = 0; i < in->wcs.n && st == OK; i++)
        st = header_append(h, in->wcs.card[i]);
    if (st == OK && !r->wcs)
        st = sky_set_tan(h, v->pixel, 0.5 * ((double)v->nx + 1), 0.5 * ((double)v->ny + 1), r->centre[0], r->centre[1]);
    return st;
}

/* Where objects are: by the WCS of the image, h, or through that of --wcs. */
static void find_places(struct input *in, const struct request *r, const struct view *v, const struct header *h)
{
    struct place *p = &in->place;
    struct err e;
    const double mid[2] = {0.5 * ((double)v->nx - 1), 0.5 * ((double)v->ny - 1)};
    p->view = v;
    p->maps = r->wcs != NULL;
    p->centre[0] = r->centre[0];
    p->centre[1] = r->centre[1];
    if (!p->maps)
        must(sky_open(&p->sky, h, &e), &e);
    else if (isnan(p->centre[0]) && sky_from_pixel(p->sky, 1, &mid[0], &mid[1], &p->centre[0], &p->centre[1]))
        die(EXIT_RUN, "%s: the middle of the image has no place on the sky: give --center", r->wcs);
}

/* ---- plan ---- */

static void print_plan(FILE *f, const struct tally *t, const struct view *v, const struct request *r)
{
    static const char *const path[PATH_COUNT] = {"outside or dark", "points", "closed-form pixels",
                                                 "mapped pixels (Gauss-Legendre)", "Fourier stamps", "larger than stamps"};
    fprintf(f, "simage: %ld x %ld pixels of %g\", %zu parts\n", v->nx, v->ny, v->pixel, t->n);
    fprintf(f, "simage: effects:%s%s%s%s%s%s%s\n", v->psf ? " PSF" : "", r->diffusion > 0 ? " diffusion" : "",
            r->jitter > 0 ? " jitter" : "", r->ipc > 0 ? " IPC" : "", v->no_pixel ? "" : " pixel", r->shear[0] != 0 || r->shear[1] != 0 ? " shear" : "",
            r->wcs ? " distortion" : "");
    for (int i = 0; i < PATH_COUNT; i++)
        if (t->count[i])
            fprintf(f, "simage: %zu %s\n", t->count[i], path[i]);
    for (int g = 0; g < t->n_grid; g++) {
        const struct tally_grid *s = &t->grid[g];
        if (s->broad)
            fprintf(f, "simage: %zu in a period of %g\", %d frequencies per axis\n", s->n, s->pixels * v->pixel, s->frequencies);
        else
            fprintf(f, "simage: %zu stamps of %g x %g, %d frequencies per axis\n", s->n, s->pixels, s->pixels, s->frequencies);
    }
    fprintf(f, "simage: accuracy %g of the peak, floor %g electron; %zu transforms, %d shear matrices; about %.2g s and %.0f MB\n",
            r->accuracy.eps, r->accuracy.floor, t->fft_plans, t->n_matrix, t->cost, 1e-6 * t->bytes + BASE_MB);
}

static void report(size_t bad, size_t cut, const struct common *c)
{
    if (c->quiet)
        return;
    if (bad)
        warn("%s: %zu objects cannot be drawn (no number, order above 66 and turned, or too thin to be integrated): left out",
             c->argv[0], bad);
    if (cut)
        warn("%s: %zu stamps are too small for --accuracy: wings beyond fold back", c->argv[0], cut);
}

static double image_bytes(const struct view *v)
{
    return 4.0 * (double)v->nx * (double)v->ny;
}

static void make_plan(struct plan *p, const struct view *v, const struct request *r, const struct common *c,
                      const struct emission *block)
{
    int st = scene_plan(p, v, &r->accuracy, block->n, block->emitter);
    if (st == E_RANGE)
        die(EXIT_RUN, "%s: the PSF's cut-off and the pixels do not fit: fewer than 64 bands are possible", r->psf ? r->psf : "-");
    check(st);
    p->bytes += (double)block->n * (double)(sizeof *block->emitter + sizeof *block->coef + RENDER_BYTES) + image_bytes(v);
    check_memory(p->bytes, c->argv[0], c);
}

/* ---- drawing ---- */

static void next_block(struct input *in, const struct request *r, struct emission *block)
{
    const struct scene_use use = {.models = r->models ? &in->models : NULL, .zeropoint = r->zeropoint, .exptime = r->exptime,
                                  .place = &in->place, .truth = in->truth};
    struct err e;
    must(scene_list_next(&in->list, &use, block, &e), &e);
}

/* Seconds that it took. */
static double draw(const struct plan *p, struct image *im, double *sums, const struct common *c, struct progress *bar)
{
    struct timespec begin, end;
    timespec_get(&begin, TIME_UTC);
    int st = scene_render_part(p, im, sums, c->threads, bar);
    timespec_get(&end, TIME_UTC);
    check(st);
    progress_tick(bar, (long)p->count[PATH_NONE]);
    return difftime(end.tv_sec, begin.tv_sec) + 1e-9 * (double)(end.tv_nsec - begin.tv_nsec);
}

/* A stamp for each object, block by block. */
static void draw_stamps(struct input *in, const struct view *v, const struct request *r, const struct common *c,
                        struct emission *block, struct image *im)
{
    struct tally tally = {0};
    struct progress bar;
    double seconds = 0;
    int last;
    next_block(in, r, block);
    progress_begin(&bar, "simage", in->list.end ? (long)block->n : -1, c->quiet || c->check);
    double *sums = in->list.end || c->check ? NULL : scene_sums(im);
    do {
        struct plan plan;
        make_plan(&plan, v, r, c, block);
        tally_add(&tally, &plan);
        last = in->list.end;
        if (last && (c->check || c->verbose))
            print_plan(stderr, &tally, v, r);
        if (last)
            report(tally.n_bad, tally.n_short, c);
        if (last && !plan.lean)
            otf_free(&in->otf);            /* the plan holds its own tables */
        if (!c->check)
            seconds += draw(&plan, im, sums, c, &bar);
        plan_free(&plan);
        progress_part(&bar, scene_list_part(&in->list));
        if (!last)
            next_block(in, r, block);
    } while (!last);
    progress_end(&bar);
    if (sums)
        scene_add_sums(sums, im);
    free(sums);
    if (c->verbose && !c->check)
        fprintf(stderr, "simage: drawn in %.3f s\n", seconds);
}

/* The whole scene in one convolution; in place of a plan of stamps. */
static void draw_field(struct input *in, const struct view *v, const struct request *r, const struct common *c, struct emission *block,
                       struct image *im)
{
    struct field f;
    struct field_sum sum = {0};
    struct progress bar;
    size_t n = 0;
    int last;
    int st = field_plan(&f, v, &r->accuracy);
    if (st == E_RANGE)
        die(EXIT_RUN, "%s: the field is too large for one convolution: leave --method field out", c->argv[0]);
    check(st);
    check_memory(f.bytes, c->argv[0], c);
    if (!c->check)
        check(field_begin(&sum, &f, v));
    next_block(in, r, block);
    progress_begin(&bar, "simage", in->list.end ? (long)block->n : -1, c->quiet || c->check);
    do {
        last = in->list.end;
        n += block->n;
        if (last && (c->check || c->verbose))
            fprintf(stderr, "simage: one convolution of %ld x %ld pixels of %g\", blurred by %.4f\"; about %.2g s and %.0f MB\n", (long)f.nx * f.split,
                    (long)f.ny * f.split, v->pixel / f.split, f.sigma, f.cost + 2e-5 * (double)n, 1e-6 * f.bytes);
        if (!c->check)
            check(field_add(&sum, &r->accuracy, block->n, block->emitter, im, c->threads, &bar));
        progress_part(&bar, scene_list_part(&in->list));
        if (!last)
            next_block(in, r, block);
    } while (!last);
    progress_end(&bar);
    if (!c->check) {
        check(field_end(&sum, im));
        report(sum.lost.bad, sum.lost.cut, c);
    }
    if (c->verbose && !c->check)
        fprintf(stderr, "simage: margin of %.0f\"; %zu parts reach farther: a stamp each\n", f.margin, sum.lost.large);
    field_free(&f);
}

/* New pixels; the header stays. */
static void make_image(struct image *im, const struct view *v, const struct common *c)
{
    struct header h = im->hdr;
    check_memory(image_bytes(v), c->argv[0], c);
    check(image_new(im, v->nx, v->ny));
    im->hdr = h;
}

/* Files that no output may replace. */
static void all_inputs(const struct request *r, const struct common *c, const char *inputs[4])
{
    inputs[0] = c->argv[0];
    inputs[1] = r->models ? r->models : c->argv[0];
    inputs[2] = r->psf ? r->psf : c->argv[0];
    inputs[3] = r->wcs ? r->wcs : c->argv[0];
}

/* Both outputs can be opened: told before the scene is drawn. */
static void check_outputs(const struct request *r, const struct common *c, const char *inputs[4])
{
    struct err e;
    if (!c->check && (outfile_ready(c->out, inputs, 4, &e) || (r->truth && outfile_ready(r->truth, inputs, 4, &e))))
        die(EXIT_RUN, "%s", e.text);
}

/* What is in the image, beside it. */
static void open_truth(struct input *in, const struct request *r, const char *inputs[4], const struct header *h, const char *record)
{
    struct err e;
    must(truth_open(&in->truth, &in->list.table, h, in->place.sky, r->truth, record, inputs, 4, &e), &e);
}

static void write_all(struct input *in, struct image *im, const struct common *c, const char *inputs[4], const char *record)
{
    struct err e;
    if (in->truth)
        must(truth_close(in->truth, &e), &e);
    must(image_write(im, c->out, record, inputs, 4, &e), &e);
    must(outfile_appear(&e), &e);
}

static void run(const struct request *r, const struct common *c, const char *record)
{
    struct input in = {0};
    struct view v = {.pixel = r->pixel / (double)r->subpixel, .no_pixel = r->no_pixel, .g1 = r->shear[0], .g2 = r->shear[1],
                     .shear_order = r->order};
    struct image im = {0};
    struct emission block;
    const char *inputs[4];
    all_inputs(r, c, inputs);
    check_outputs(r, c, inputs);
    outfile_together();
    read_scene(&in, r, c);
    read_psf(&in, r, c, &v);
    read_wcs(&in, r, c);
    set_size(&in, r, c->argv[0], &v);
    check(describe(&im.hdr, &in, r, &v));
    find_places(&in, r, &v, &im.hdr);
    header_free(&in.wcs);
    check(emission_new(&block, BLOCK, v.pixel, &r->accuracy));
    if (!c->check) {
        make_image(&im, &v, c);
        if (r->truth)
            open_truth(&in, r, inputs, &im.hdr, record);
    }
    (r->whole ? draw_field : draw_stamps)(&in, &v, r, c, &block, &im);
    emission_free(&block);
    scene_list_close(&in.list);
    otf_free(&in.otf);
    if (!c->check)
        write_all(&in, &im, c, inputs, record);
    sky_close(in.place.sky);
    image_free(&im);
    models_free(&in.models);
    table_free(&in.catalogue);
}

int main(int argc, char **argv)
{
    struct common c = COMMON_DEFAULTS;
    struct request r = {.subpixel = 1, .exptime = 2000, .zeropoint = 26.65, .centre = {150, 2.2}, .accuracy = ACCURACY_DEFAULT};
    const struct program prog = {
        "simage", "draw the expected electrons of a scene: shear, PSF, charge diffusion, pixels", "[SCENE]", 0, 1,
        "  simage scene.txt --models models.txt -p psf.fits -x 0.1 --shear 0.05,0 -o image.fits\n"
        "  simage stars.txt -p psf.fits -x 0.1 --size 800,800 | addnoise --depth 27.7 | detect -\n", OUT_FITS
    };
    const struct opt own[] = {
        {"models", 'm', OPT_STR, &r.models, 0, 0, "FILE", "shapelet catalogue of the objects", 0, 1},
        {"psf", 'p', OPT_STR, &r.psf, 0, 0, "FILE", "PSF; without one there is none", 0, 1},
        {"pixscale", 'x', OPT_REAL, &r.pixel, 1e-6, 1e6, "ARCSEC", "detector pixel, arcsec", 0, 0},
        {"size", 0, OPT_PAIR, r.size, 1, 65535, "NX,NY", "output pixels; else from the list's FIELD", 0, 0},
        {"shear", 'g', OPT_PAIR, r.shear, -1, 1, "G1,G2", "reduced shear of the field, area kept", 0, 0},
        {"shear-order", 0, OPT_CHOICE, &r.order, 0, 0, 0, "exact, or the series of this order", "exact|1|2|3|4|5|6|7|8", 0},
        {"subpixel", 'N', OPT_LONG, &r.subpixel, 1, 64, "N", "output pixels of PIXSCALE/N (for dither)", 0, 0},
        {"exptime", 'T', OPT_REAL, &r.exptime, 1e-9, 1e12, "S", "exposure time, s", 0, 0},
        {"zeropoint", 'z', OPT_REAL, &r.zeropoint, -50, 100, "MAG", "AB magnitude of 1 electron/s", 0, 0},
        {"accuracy", 0, OPT_REAL, &r.accuracy.eps, 1e-12, 0.5, "EPS", "pixel error over the object's peak", 0, 0},
        {"floor", 0, OPT_REAL, &r.accuracy.floor, 0, 1e12, "E", "pixel error allowed always, electrons", 0, 0},
        {"method", 0, OPT_CHOICE, &r.whole, 0, 0, 0, "a stamp each, or the whole field at once", "stamp|field", 0},
        {"no-pixel", 0, OPT_FLAG, &r.no_pixel, 0, 0, 0, "values at pixel centres, not integrals", 0, 0},
        {"diffusion", 0, OPT_REAL, &r.diffusion, 0, 1e3, "ARCSEC", "charge diffusion on top of the PSF, rms", 0, 0},
        {"jitter", 0, OPT_REAL, &r.jitter, 0, 1e3, "ARCSEC", "motion of the line of sight, rms per axis", 0, 0},
        {"ipc", 0, OPT_REAL, &r.ipc, 0, 0.2, "A", "charge shared with each of four neighbours", 0, 0},
        {"pixel", 0, OPT_PAIR, r.box, 1e-9, 1e6, "W,H", "sides of the pixel's response, arcsec", 0, 0},
        {"pixel-edge", 0, OPT_PAIR, r.edge, 0, 1e6, "EX,EY", "lengths over which it falls to 0, arcsec", 0, 0},
        {"wcs", 0, OPT_STR, &r.wcs, 0, 0, "FILE", "see the sky through this image's WCS, distortion included", 0, 1},
        {"center", 0, OPT_PAIR, r.centre, -360, 360, "RA,DEC", "sky position of the field centre, deg", 0, 0},
        {"set", 0, OPT_STR, &r.set, 0, 0, "NAME", "name of the set, keyword SETNAME", 0, 0},
        {"truth", 0, OPT_STR, &r.truth, 0, 0, "FILE", "write the list with position and flux in the image", 0, OPT_OUT(OUT_TABLE)},
        {"psf-scale", 0, OPT_REAL, &r.psf_options.scale, 1e-9, 1e6, "ARCSEC", "sampling of the PSF, over its header", 0, 0},
        {"psf-cutoff", 0, OPT_REAL, &r.psf_options.cutoff, 1e-9, 1e9, "U", "its highest frequency, cycles/arcsec", 0, 0},
        {"psf-has-pixel", 0, OPT_FLAG, &r.psf_options.has_pixel, 0, 0, 0, "the PSF contains the pixel", 0, 0},
        {"psf-normalise", 0, OPT_FLAG, &r.psf_options.normalise, 0, 0, 0, "divide the PSF by its sum", 0, 0},
        {0}
    };
    pages_give_back();
    opt_parse(&prog, own, &c, argc, argv);
    check_options(&r, own, &c);
    if (r.wcs && !opt_given(own, &c, "center"))
        r.centre[0] = r.centre[1] = NAN;
    char *record = opt_record(&prog, own, &c);
    run(&r, &c, record);
    free(record);
    return EXIT_DONE;
}
