/*
 * rrgshape.c - shapes of the objects of a catalogue: weighted moments, PSF
 * correction, ellipticity and response to shear.
 */
#include "catkeys.h"
#include "err.h"
#include "exposure.h"
#include "imageio.h"
#include "opt.h"
#include "outfile.h"
#include "progress.h"
#include "psfio.h"
#include "region.h"
#include "shapecat.h"
#include "starpsf.h"
#include "tableio.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct params {
    const char *stars, *psf, *weight, *segmentation, *region, *plain;
    char *star_image;         /* of --stars IMAGE,CATALOGUE, or NULL */
    const char *star_cat;
    double width, fixed, min, max, cut, scale, pixel;
    int fourth, correction, average;
    int centroid, no_recenter, no_background, stars_only;
    long max_stars;
};

/* One image with what a measurement on it needs. */
struct input {
    const char *name, *cat_name;
    long nx, ny;
    float *pix;
    double *pix64;
    struct header hdr;
    struct table cat;         /* header, and the block of rows read last */
    struct table_in *rows;
    struct image weight, label;
    struct moments_map map;
    double scale;             /* arcsec per pixel; NaN when unknown */
};

static void fail(const char *file, const struct err *e)
{
    die(EXIT_RUN, "%s: %s", file, e->text);
}

static void check(int st, const char *what)
{
    if (st)
        die(EXIT_RUN, "%s: %s", what, err_text(st));
}

/* Pixels as float32, or as doubles when the file has doubles. */
static void read_pixels(struct input *in, const char *name, double max_memory)
{
    struct err e;
    struct fits_in *f;
    if (fits_in_open(&f, name, max_memory, &e))
        die(EXIT_RUN, "%s", e.text);
    int k;
    if (fits_in_single(f, &k, &e))
        die(EXIT_RUN, "%s", e.text);
    if (k < 0)
        die(EXIT_RUN, "%s: no image in this file", name);
    const struct hdu *h = fits_in_hdu(f, k);
    if (h->nz != 1)
        die(EXIT_RUN, "%s: HDU %d has %ld planes: a plain image is needed", name, k, h->nz);
    int deep = h->bitpix == -64;
    size_t n = (size_t)h->nx * (size_t)h->ny, size = deep ? sizeof(double) : sizeof(float);
    if (max_memory > 0 && (double)n * (double)size > max_memory)
        die(EXIT_RUN, "%s: needs %.0f bytes: raise --max-memory", name, (double)n * (double)size);
    void *mem = malloc(n * size);
    if (!mem)
        die(EXIT_RUN, "%s: %s", name, err_text(E_NOMEM));
    in->name = name;
    in->nx = h->nx;
    in->ny = h->ny;
    in->pix = deep ? NULL : mem;
    in->pix64 = deep ? mem : NULL;
    int st = deep ? fits_in_rows_double(f, k, 0, 0, in->ny, mem, &e) : fits_in_rows(f, k, 0, 0, in->ny, mem, &e);
    if (st == OK)
        st = fits_in_header(f, k, &in->hdr, &e);
    if (st)
        die(EXIT_RUN, "%s", e.text);
    fits_in_close(f);
}

/* A number of a catalogue's header, NaN when there is none. */
static double key_or_nan(const struct table *t, const char *file, const char *key)
{
    double v;
    struct err e;
    if (catkeys_number(t, key, &v, &e))
        die(EXIT_RUN, "%s: %s", file, e.text);
    return v;
}

/* arcsec per pixel: option, header, world coordinates, catalogue; else NaN. */
static double pixel_scale(const struct input *in, const char *cat, const struct exposure *x, double option)
{
    const double v = key_or_nan(&in->cat, cat, "PIXSCALE");
    if (v <= 0)
        die(EXIT_RUN, "%s: keyword PIXSCALE = %g is not positive: correct it", cat, v);
    if (option > 0)
        return option;
    /* positions count pixels: those of another scale are not on these objects */
    if (isfinite(x->scale) && isfinite(v) && !(fabs(v / x->scale - 1) <= 1e-3))
        die(EXIT_RUN, "%s: a catalogue of pixels of %g arcsec, but %s has %g: give the catalogue of this image", cat, v, in->name, x->scale);
    return isfinite(x->scale) ? x->scale : v;
}

static void read_map(struct image *im, const struct input *in, const char *name, double max_memory)
{
    struct err e;
    if (image_read(im, name, max_memory, &e))
        die(EXIT_RUN, "%s", e.text);
    if (im->nx != in->nx || im->ny != in->ny)
        die(EXIT_RUN, "%s: %ld x %ld pixels, but %s has %ld x %ld", name, im->nx, im->ny, in->name, in->nx, in->ny);
}

/* Image, catalogue and maps; weight and segmentation may be NULL. */
static void read_input(struct input *in, const char *image, const char *cat, const struct params *p,
                       const char *weight, const char *label, const struct common *c)
{
    struct err e;
    struct exposure x = {0};
    const double max_memory = c->max_memory;
    *in = (struct input){0};
    read_pixels(in, image, max_memory);
    if (exposure_keywords(&in->hdr, image, &x, &e))
        die(EXIT_RUN, "%s", e.text);
    const int square = exposure_square(&x, image, &e);
    if (square == E_DATA)
        die(EXIT_RUN, "%s", e.text);
    if (square && !c->quiet)
        warn("%s", e.text);
    in->cat_name = cat;
    if (table_in_open(&in->rows, &in->cat, cat, max_memory, &e))
        die(EXIT_RUN, "%s", e.text);
    in->map = (struct moments_map){.nx = in->nx, .ny = in->ny, .pix = in->pix, .pix64 = in->pix64,
                                   .gain = isfinite(x.gain) ? x.gain : 0,
                                   .noise_cor = header_double_or(&in->hdr, "NOISECOR", 1)};
    if (weight) {
        char type[72] = "";
        read_map(&in->weight, in, weight, max_memory);
        in->map.weight = in->weight.pix;
        in->map.weight_inverse = header_str(&in->weight.hdr, "WHTTYPE", type, sizeof type) == OK && strcmp(type, "IVM") == 0;
    }
    if (label) {
        read_map(&in->label, in, label, max_memory);
        in->map.label = in->label.pix;
    }
    in->scale = pixel_scale(in, cat, &x, p->scale);
}

/* The next rows of the catalogue, n at most. */
static void read_rows(struct input *in, size_t n)
{
    struct err e;
    if (table_in_rows(in->rows, &in->cat, n, &e))
        die(EXIT_RUN, "%s", e.text);
}

static void free_input(struct input *in)
{
    free(in->pix);
    free(in->pix64);
    header_free(&in->hdr);
    table_in_close(in->rows);
    table_free(&in->cat);
    image_free(&in->weight);
    image_free(&in->label);
}

static void need_scale(const struct input *in)
{
    if (!isfinite(in->scale))
        die(EXIT_RUN, "%s: no PIXSCALE and no world coordinates: give --pixscale", in->name);
}

/* Widths and limits in pixels of this image. */
static struct shapecat_options options(const struct params *p, const struct input *in, int threads)
{
    double px = isfinite(in->scale) ? in->scale : 1;
    struct shapecat_options o = {
        .mult = p->width, .fixed = p->fixed, .threads = threads, .no_background = p->no_background,
        .min = p->min > 0 ? p->min / px : fmax(0.8, 0.1 / px), .max = p->max / px, .first_width = 0.18 / px,
        .moments = MOMENTS_DEFAULTS,
        .rrg = {.first = p->correction == 1, .plain = p->fourth == 1, .centroid = p->centroid}};
    o.moments.cut = p->cut;
    o.moments.fixed_centre = p->no_recenter;
    if (!(o.max >= o.min))
        o.max = o.min;
    double rms = 0;
    if (!table_find(&in->cat, "BACKRMS"))
        check(shapecat_noise(&in->map, &rms), in->name);
    o.sky_var = rms * rms;
    return o;
}

/* NUMBER of the rows read last against the labels under their centres: those of another catalogue would mask the objects themselves. */
static void check_labels(const struct input *in, const char *segmentation)
{
    const struct column *x = table_find(&in->cat, "X_IMAGE"), *y = table_find(&in->cat, "Y_IMAGE"), *number = table_find(&in->cat, "NUMBER");
    size_t own = 0, other = 0;
    for (size_t i = 0; i < in->cat.nrow && in->map.label; i++) {
        const double column = floor(table_number(x, i) - 0.5), row = floor(table_number(y, i) - 0.5);
        if (!(column >= 0 && column < (double)in->nx && row >= 0 && row < (double)in->ny))
            continue;
        const double label = in->map.label[(size_t)row * (size_t)in->nx + (size_t)column];
        own += label == table_number(number, i);
        other += label > 0 && label != table_number(number, i);
    }
    if (other > own)
        die(EXIT_RUN, "%s: %zu of %zu objects lie on labels of others: not the segmentation of %s", segmentation, other, own + other, in->cat_name);
}

/* Measure the stars of an image; the median size with their own widths goes to *own. */
static void measure_stars(struct starmom *s, struct input *in, const char *cat, const struct params *p,
                          int threads, double *own)
{
    struct err e;
    struct moments_object *stars;
    need_scale(in);
    struct shapecat_options o = options(p, in, threads);
    o.fixed = 0;
    o.moments.fixed_centre = 0;
    size_t n;
    read_rows(in, SIZE_MAX);
    if (shapecat_stars(&in->cat, &o, 1 / in->scale, &stars, &n, &e))
        fail(cat, &e);
    check_labels(in, p->segmentation);
    *s = (struct starmom){.dstar_w = fmax(0.8, 0.1 / in->scale)};
    check(starmom_widths(s, STARMOM_WIDTHS, 0.8, fmax(1 / in->scale, 2)), in->name);
    int st = starmom_measure(s, &in->map, n, stars, &o.moments, p->max_stars, p->average == 1, threads);
    if (st == E_MISSING)
        die(EXIT_RUN, "%s: fewer than 2 usable stars of %zu: look at the star catalogue", in->name, n);
    check(st, in->name);
    check(shapecat_own_size(&in->map, n, stars, &o.moments, own), in->name);
    free(stars);
}

/* The moments of stars are in pixels: both files must mean the same ones, or neither say what they are. */
static void same_pixels(const char *name, double scale, const struct input *in)
{
    if (isnan(scale) && isfinite(in->scale))
        die(EXIT_RUN, "%s: no PIXSCALE: stars in unknown pixels, but %s has %g arcsec: add the keyword", name, in->name, in->scale);
    if (isfinite(scale) && isnan(in->scale))
        die(EXIT_RUN, "%s: stars in pixels of %g arcsec, but %s tells none: give --pixscale", name, scale, in->name);
    if (isfinite(scale) && !(fabs(scale / in->scale - 1) < 1e-6))
        die(EXIT_RUN, "%s: stars in pixels of %g arcsec, but %s has %g", name, scale, in->name, in->scale);
}

/* A star-moment file; its pixels must be those of the image. */
static void read_curve(struct starmom *s, const char *name, const struct input *in, double max_memory, double *own)
{
    struct err e;
    struct table t = {0};
    if (table_read(&t, name, max_memory, &e))
        die(EXIT_RUN, "%s", e.text);
    if (starmom_from_table(s, &t, &e))
        fail(name, &e);
    same_pixels(name, key_or_nan(&t, name, "PIXSCALE"), in);
    *own = key_or_nan(&t, name, "DSTAROWN");
    table_free(&t);
}

/* Side of the pixel that collected the light, arcsec: option; the CCD's in a drizzled image; else the image's. */
static double pixel_response(const struct input *in, double option)
{
    double ccd, frac;
    if (option > 0)
        return option;
    if (header_double(&in->hdr, "PIXFRAC", &frac) == OK && header_double(&in->hdr, "CCDSCALE", &ccd) == OK && ccd > 0)
        return ccd;
    return in->scale;
}

/* Moments of a PSF that is known: a file of psfgen or any image of a PSF. */
static void known_psf(struct starmom *s, const char *name, const struct input *in, double option, double max_memory)
{
    struct err e;
    struct otf t;
    struct psf_options po = {.max_memory = max_memory};
    need_scale(in);
    double pixel = pixel_response(in, option);
    if (psf_read(name, &po, &t, NULL, &e))
        die(EXIT_RUN, "%s", e.text);
    if (t.pixel > 0 && !(fabs(t.pixel / pixel - 1) < 1e-6))
        die(EXIT_RUN, "%s: contains a pixel of %g arcsec, but %s was taken with %g", name, t.pixel, in->name, pixel);
    int st = starmom_from_otf(s, &t, in->scale, pixel);
    if (st == E_RANGE)
        die(EXIT_RUN, "%s: PSF too small to be weighed with 1 arcsec: at least 17 arcsec a side", name);
    check(st, name);
    otf_free(&t);
}

/* --psf FILE|none, --stars FILE or --stars IMAGE,CATALOGUE; NULL: no correction. */
static struct starmom *find_psf(struct starmom *s, const struct input *in, const struct params *p,
                                const struct common *c, double *own)
{
    *own = NAN;
    if (p->psf && strcmp(p->psf, "none") == 0)
        return NULL;
    if (p->psf) {
        known_psf(s, p->psf, in, p->pixel, c->max_memory);
        return s;
    }
    if (!p->star_image) {
        read_curve(s, p->stars, in, c->max_memory, own);
        return s;
    }
    struct input stars;
    read_input(&stars, p->star_image, p->star_cat, p, NULL, NULL, c);
    same_pixels(p->star_image, stars.scale, in);
    measure_stars(s, &stars, p->star_cat, p, c->threads, own);
    free_input(&stars);
    return s;
}

/* Size of a star, and the ellipticity of the PSF under a weight of 0.25 arcsec, that of a galaxy. */
static void set_psf(struct table *t, const struct starmom *s, double own, double scale)
{
    struct rrg_psf p;
    starmom_at(s, 0.25 / (isfinite(scale) ? scale : 0.1), &p);
    check(table_set_number(t, "EPSF1", (p.m2[0] - p.m2[2]) / (p.m2[0] + p.m2[2])), "EPSF1");
    check(table_set_number(t, "EPSF2", 2 * p.m2[1] / (p.m2[0] + p.m2[2])), "EPSF2");
    if (isfinite(s->dstar))
        check(table_set_number(t, "DSTAR", s->dstar), "DSTAR");
    if (isfinite(s->dstar_err))
        check(table_set_number(t, "DSTARERR", s->dstar_err), "DSTARERR");
    if (isfinite(own))
        check(table_set_number(t, "DSTAROWN", own), "DSTAROWN");
    if (isfinite(scale))
        check(table_set_number(t, "PIXSCALE", scale), "PIXSCALE");
}

enum { INPUTS = 8 };

/* The files that no output may replace; their number. */
static size_t inputs_of(const struct params *p, const struct common *c, const char *name[INPUTS])
{
    const char *all[INPUTS] = {c->argv[0], c->argv[1], p->stars, p->star_image, p->star_cat, p->psf, p->weight, p->segmentation};
    size_t n = 0;
    for (size_t i = 0; i < INPUTS; i++)
        if (all[i])
            name[n++] = all[i];
    return n;
}

/* Every output can be opened: told before the work, and before one of them appears. */
static void outputs_ready(const struct params *p, const struct common *c)
{
    const char *inputs[INPUTS], *out[] = {c->out, p->region, p->plain};
    const size_t n = inputs_of(p, c, inputs);
    struct err e;
    for (int i = 0; i < 3 && !c->check; i++)
        if (out[i] && outfile_ready(out[i], inputs, n, &e))
            die(EXIT_RUN, "%s", e.text);
}

/* --stars IMAGE,CATALOGUE is two files, unless one has that name. */
static void split_stars(struct params *p)
{
    const char *comma = p->stars && access(p->stars, F_OK) ? strrchr(p->stars, ',') : NULL;
    if (!comma)
        return;
    p->star_cat = comma + 1;
    p->star_image = strndup(p->stars, (size_t)(comma - p->stars));
    if (!p->star_image)
        die(EXIT_RUN, "%s: %s", p->stars, err_text(E_NOMEM));
}

/* The files that blocks of rows go to; NULL: not asked for. */
struct outputs {
    struct table_out *cat, *plain;
    struct region *region;
    char *record;
    const char *inputs[INPUTS];
    size_t n_inputs;
};

static void must(int st, const struct err *e)
{
    if (st)
        die(EXIT_RUN, "%s", e->text);
}

/* `head` has the columns and keywords of the catalogues. */
static void open_outputs(struct outputs *o, const struct table *head, const struct params *p, const struct common *c)
{
    struct err e;
    if (p->region)
        must(region_open(&o->region, p->region, o->inputs, o->n_inputs, &e), &e);
    must(table_out_open(&o->cat, c->out, o->inputs, o->n_inputs, &e), &e);
    must(table_out_begin(o->cat, head, o->record, &e), &e);
    if (p->plain) {
        must(table_out_open(&o->plain, p->plain, o->inputs, o->n_inputs, &e), &e);
        must(table_out_begin(o->plain, head, o->record, &e), &e);
    }
}

static void close_outputs(struct outputs *o, const struct table *head)
{
    struct err e;
    if (o->region)
        must(region_close(o->region, &e), &e);
    if (o->plain)
        must(table_out_end(o->plain, head, o->record, &e), &e);
    must(table_out_end(o->cat, head, o->record, &e), &e);
}

/* What the columns need beside themselves: keywords of the image and the PSF. */
static void set_keywords(struct table *t, const struct input *in, const struct starmom *psf, double own)
{
    check(catkeys_copy(t, &in->hdr), "keywords");
    if (psf)
        set_psf(t, psf, own, in->scale);
}

/* Measure the rows read last and send them on; their number with flags. */
static long measure_block(struct shapecat *s, const struct input *in, const struct outputs *o, const struct rrg_options *plain)
{
    struct err e;
    long bad;
    check(shapecat_measure(s, &bad), in->cat_name);
    must(table_out_rows(o->cat, &in->cat, &e), &e);
    if (o->region)
        shapecat_region(s, o->region);
    if (o->plain) {
        check(shapecat_correct(s, plain), in->cat_name);
        must(table_out_rows(o->plain, &in->cat, &e), &e);
    }
    return bad;
}

/* Shapes of the galaxies, block by block. */
static void measure_objects(struct input *in, const struct params *p, const struct common *c, struct outputs *out)
{
    struct err e;
    struct shapecat *shapes;
    struct starmom stars;
    struct progress bar;
    double own;
    size_t n = 0;
    long bad = 0;
    if (!(p->fixed > 0))
        need_scale(in);
    struct starmom *psf = find_psf(&stars, in, p, c, &own);
    struct shapecat_options o = options(p, in, c->threads);
    struct rrg_options plain = o.rrg;
    o.keep = p->plain != NULL;
    plain.plain = plain.first = 1;
    if (shapecat_open(&shapes, &in->cat, &in->map, psf, &o, &e))
        fail(c->argv[1], &e);
    set_keywords(&in->cat, in, psf, own);
    if (!c->check)
        open_outputs(out, &in->cat, p, c);
    const size_t rows = table_block_rows(&in->cat);
    progress_begin(&bar, "shapes", -1, c->quiet || c->check);
    do {
        read_rows(in, rows);
        check_labels(in, p->segmentation);
        n += in->cat.nrow;
        if (c->check)
            continue;
        bad += measure_block(shapes, in, out, &plain);
        progress_tick(&bar, (long)in->cat.nrow);
        progress_part(&bar, table_in_part(in->rows));
    } while (in->cat.nrow == rows);
    progress_end(&bar);
    shapecat_close(shapes);
    if (c->check)
        warn("%s: %zu objects on %ld x %ld pixels of %g arcsec; widths %g to %g px; %s; about %.2g s", c->argv[1], n,
             in->nx, in->ny, in->scale, o.min, o.max, psf ? "PSF corrected" : "no PSF correction", 1e-5 * (double)n);
    else
        close_outputs(out, &in->cat);
    if (c->verbose && !c->check)
        warn("%s: %zu objects, %ld with flags", c->argv[1], n, bad);
}

/* The star-moment file instead of a catalogue. */
static void measure_curve(struct input *in, const struct params *p, const struct common *c, const struct outputs *o)
{
    struct starmom s;
    struct table curve = {0}, *out = &curve;
    struct err e;
    double own;
    if (c->check) {
        need_scale(in);
        read_rows(in, SIZE_MAX);
        warn("%s: %zu stars on %ld x %ld pixels of %g arcsec; %d widths; about %.2g s", c->argv[1], in->cat.nrow, in->nx, in->ny,
             in->scale, STARMOM_WIDTHS, 2e-3 * (double)in->cat.nrow);
        return;
    }
    measure_stars(&s, in, c->argv[1], p, c->threads, &own);
    check(starmom_to_table(&s, out), c->argv[1]);
    for (size_t i = 0; i < in->cat.nkey; i++)
        check(table_set_text(out, in->cat.key[i].name, in->cat.key[i].value), c->argv[1]);
    for (size_t i = 0; i < in->cat.nhistory; i++)
        check(table_history(out, in->cat.history[i]), c->argv[1]);
    check(catkeys_copy(out, &in->hdr), "keywords");     /* the image knows better than the catalogue of another image */
    set_psf(out, &s, own, in->scale);
    must(table_write(out, c->out, o->record, o->inputs, o->n_inputs, &e), &e);
    table_free(out);
    if (c->verbose)
        warn("%s: %ld stars, d* = %.4f px at w = %.3f px", c->argv[1], s.stars[0], s.dstar, s.dstar_w);
}

int main(int argc, char **argv)
{
    struct common c = COMMON_DEFAULTS;
    struct params p = {.width = 1.5, .max = 0.45, .cut = 4};
    const struct program prog = {
        "rrgshape", "measure shapes: Gaussian-weighted moments corrected for the PSF, response to shear",
        "IMAGE CATALOGUE", 2, 2,
        "  rrgshape --stars-only stars.fits stars.cat -o stars.rrg\n"
        "  rrgshape image.fits image.cat --stars stars.rrg -o image.shapes", OUT_TABLE};
    const struct opt own[] = {
        {"stars", 0, OPT_STR, &p.stars, 0, 0, "FILE", "star-moment file, or STARS_IMAGE,STARS_CATALOGUE", NULL, 1},
        {"psf", 'p', OPT_STR, &p.psf, 0, 0, "FILE", "PSF file instead of stars; none: no correction", NULL, 1},
        {"stars-only", 0, OPT_FLAG, &p.stars_only, 0, 0, NULL, "the operands are stars: write the star-moment file", NULL, 0},
        {"width", 'w', OPT_REAL, &p.width, 1e-3, 1e3, "K", "width of the weight in units of sqrt(A_IMAGE B_IMAGE)", NULL, 0},
        {"fixed-width", 0, OPT_REAL, &p.fixed, 0, 1e4, "PX", "width of the weight for all objects, pixels (0: not fixed)", NULL, 0},
        {"width-min", 0, OPT_REAL, &p.min, 0, 1e4, "ARCSEC", "smallest width, arcsec (0: max(0.8 px, 0.1))", NULL, 0},
        {"width-max", 0, OPT_REAL, &p.max, 1e-6, 1e4, "ARCSEC", "largest width, arcsec", NULL, 0},
        {"weight-cut", 0, OPT_REAL, &p.cut, 0.5, 100, "K", "radius where the weight ends, in widths", NULL, 0},
        {"fourth", 0, OPT_CHOICE, &p.fourth, 0, 0, "HOW", "PSF correction of the fourth moments", "exact|plain", 0},
        {"psf-correction", 0, OPT_CHOICE, &p.correction, 0, 0, "HOW", "PSF freed of its weight; first: width 0.18 arcsec", "resummed|first", 0},
        {"plain", 0, OPT_STR, &p.plain, 0, 0, "FILE", "second catalogue, as --fourth plain --psf-correction first give it", NULL, OPT_OUT(OUT_TABLE)},
        {"centroid-term", 0, OPT_FLAG, &p.centroid, 0, 0, NULL, "add the motion of the centroid to P11, P22", NULL, 0},
        {"no-recenter", 0, OPT_FLAG, &p.no_recenter, 0, 0, NULL, "measure about X_IMAGE, Y_IMAGE", NULL, 0},
        {"no-background", 0, OPT_FLAG, &p.no_background, 0, 0, NULL, "do not subtract the column BACKGROUND", NULL, 0},
        {"weight", 0, OPT_STR, &p.weight, 0, 0, "FILE", "weight map: 1/variance when WHTTYPE is IVM, else relative", NULL, 1},
        {"segmentation", 0, OPT_STR, &p.segmentation, 0, 0, "FILE", "labels of pixels: neighbours are masked", NULL, 1},
        {"region", 0, OPT_STR, &p.region, 0, 0, "FILE", "ellipses of the objects for DS9", NULL, OPT_OUT(OUT_REGION)},
        {"star-average", 0, OPT_CHOICE, &p.average, 0, 0, "HOW", "average over stars", "mean|median", 0},
        {"max-stars", 0, OPT_LONG, &p.max_stars, 0, 1e9, "N", "use N of the good stars, spread over the catalogue (0: all)", NULL, 0},
        {"pixscale", 'x', OPT_REAL, &p.scale, 0, 1e4, "ARCSEC", "pixel scale over the header's, arcsec (0: header)", NULL, 0},
        {"pixel", 0, OPT_REAL, &p.pixel, 0, 1e4, "ARCSEC", "with --psf: side of the pixel that collected the light (0: header)", NULL, 0},
        {0}};
    opt_parse(&prog, own, &c, argc, argv);
    if (!p.stars_only && !p.stars == !p.psf)
        die(EXIT_USAGE, "give one of --stars FILE, --psf FILE, --psf none");

    static const char *const of_galaxies[] = {"stars", "psf", "fixed-width", "no-recenter", "centroid-term", "fourth", "psf-correction", "pixel", NULL},
                      *const of_stars[] = {"max-stars", "star-average", NULL}, *const of_pixel[] = {"pixel", NULL},
                      *const of_psf[] = {"fourth", "psf-correction", NULL}, *const of_width[] = {"width", "width-min", "width-max", NULL};
    split_stars(&p);
    if (p.stars_only)
        opt_idle(own, &c, of_galaxies, "with --stars-only");
    else if (!p.star_image)
        opt_idle(own, &c, of_stars, "unless stars are measured in this run");
    if (!p.psf || strcmp(p.psf, "none") == 0)
        opt_idle(own, &c, of_pixel, "without --psf FILE");
    if (p.psf && strcmp(p.psf, "none") == 0)
        opt_idle(own, &c, of_psf, "with --psf none");
    if (p.fixed > 0 && !p.star_image)
        opt_idle(own, &c, of_width, "with --fixed-width");
    if (p.region && (p.stars_only || outfile_same(p.region, c.out)))
        die(EXIT_USAGE, "--region %s: not with --stars-only, and not the output", p.region);
    if (p.plain && (p.stars_only || outfile_same(p.plain, c.out) || (p.region && outfile_same(p.plain, p.region))))
        die(EXIT_USAGE, "--plain %s: not with --stars-only, and not another output", p.plain);
    outputs_ready(&p, &c);
    outfile_together();
    struct err e;
    struct input in;
    struct outputs out = {.record = opt_record(&prog, own, &c)};
    out.n_inputs = inputs_of(&p, &c, out.inputs);
    read_input(&in, c.argv[0], c.argv[1], &p, p.weight, p.segmentation, &c);
    if (p.stars_only)
        measure_curve(&in, &p, &c, &out);
    else
        measure_objects(&in, &p, &c, &out);
    if (outfile_appear(&e))
        die(EXIT_RUN, "%s", e.text);
    free(out.record);
    free_input(&in);
    free(p.star_image);
    return EXIT_DONE;
}
