/*
 * detect.c - find and measure the objects of an image.
 *
 * Background on meshes, matched filter, threshold, deblending,
 * cleaning, Kron photometry, star/galaxy class; a catalogue comes out.
 */
#include "catkeys.h"
#include "detect.h"
#include "detectcat.h"
#include "exposure.h"
#include "header.h"
#include "imageio.h"
#include "kernelio.h"
#include "ldac.h"
#include "opt.h"
#include "outfile.h"
#include "pages.h"
#include "region.h"
#include "progress.h"
#include "segment.h"
#include "sky.h"
#include "smooth.h"
#include "tableio.h"
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

struct options {
    struct detect_params p;
    double kernel, psf_fwhm, pixscale, zeropoint, gain, saturation;
    int no_clean, weight_type;
    const char *kernel_file, *weight, *mask, *region, *columns, *measure, *measure_weight;
    int format;
    struct opt_strs checks;
    struct opt_reals apertures, fractions;
};

/* The image with what its header says, options first. */
struct frame {
    struct image im, other;    /* other: --measure */
    struct pixels pixels, other_pixels;
    struct fits_in *in;        /* has the pixels where im has none, else NULL */
    float *map, *other_map;    /* rms per pixel or NULL */
    char unit[72];             /* of the fluxes */
    double scale;              /* arcsec per pixel, 0 unknown */
    double psf_fwhm;           /* arcsec, 0 unknown */
    double zeropoint;
    double gain;               /* electrons per unit, 0 unknown */
    int has_zeropoint, has_gain;
    struct sky *sky;
};

static const char *const check_name[] = {"background", "rms", "filtered", "segmentation", "objects", "subtracted",
                                         "apertures"};
enum check_type { BACKGROUND, RMS, FILTERED, SEGMENTATION, OBJECTS, SUBTRACTED, APERTURES, CHECKS };

enum { BAND = 128 };           /* rows that are filtered at a time for a check image */

enum format { BY_NAME, LDAC };

static void run(int st, const char *what)
{
    if (st)
        die(EXIT_RUN, "%s: %s", what, err_text(st));
}

/* Split TYPE=FILE; a type that does not exist is a mistake of the command line. */
static enum check_type check_of(const char *text, const char **file)
{
    const char *eq = strchr(text, '=');
    for (int i = 0; eq && eq[1] && i < CHECKS; i++)
        if (strlen(check_name[i]) == (size_t)(eq - text) && strncmp(text, check_name[i], strlen(check_name[i])) == 0) {
            *file = eq + 1;
            return (enum check_type)i;
        }
    die(EXIT_USAGE, "--check-image %s: give TYPE=FILE with TYPE background, rms, filtered, segmentation, "
        "objects, subtracted or apertures", text);
}

/* Read a second image of the same size and place on the sky. */
static void read_beside(struct image *out, const char *name, const struct image *im, double max_memory)
{
    struct err e;
    double apart;
    if (image_read(out, name, max_memory, &e))
        die(EXIT_RUN, "%s", e.text);
    if (out->nx != im->nx || out->ny != im->ny)
        die(EXIT_RUN, "%s: %ld x %ld pixels, the image has %ld x %ld", name, out->nx, out->ny, im->nx, im->ny);
    run(sky_apart(&im->hdr, &out->hdr, im->nx, im->ny, &apart), name);
    if (apart > 0.5)
        die(EXIT_RUN, "%s: its WCS places the same pixels %.3g pixels away from those of the image: give one of the same field", name, apart);
}

/* A weight map as rms per pixel, NULL without a name. */
static float *read_weights(const char *name, const struct image *im, const struct options *o, const struct common *c)
{
    struct image w = {0};
    if (!name)
        return NULL;
    read_beside(&w, name, im, c->max_memory);
    detect_weights(w.pix, image_count(im), (enum weight_type)o->weight_type);
    float *map = w.pix;
    w.pix = NULL;
    image_free(&w);
    return map;
}

static void read_maps(struct frame *f, const struct options *o, const struct common *c)
{
    size_t n = image_count(&f->im);
    if (o->mask) {
        struct image mask = {0};
        read_beside(&mask, o->mask, &f->im, c->max_memory);
        for (size_t i = 0; i < n; i++)
            if (mask.pix[i] > 0 || mask.pix[i] < 0 || isnan(mask.pix[i]))
                f->im.pix[i] = NAN;
        image_free(&mask);
    }
    f->map = read_weights(o->weight, &f->im, o, c);
    f->other_map = read_weights(o->measure_weight, &f->im, o, c);
}

/* Unit of the catalogue's fluxes: BUNIT, electron when GAIN is 1 without one, else count. */
static void flux_unit(struct frame *f, const struct header *h, const struct exposure *x)
{
    if (x->unit == UNIT_ELECTRON || (x->unit == UNIT_NONE && f->gain >= 1 && f->gain <= 1))
        snprintf(f->unit, sizeof f->unit, "electron");
    else if (header_str(h, "BUNIT", f->unit, sizeof f->unit) || !f->unit[0])
        snprintf(f->unit, sizeof f->unit, "count");
}

/* Every output has a file of its own. */
static void check_outputs(const struct options *o, const char *out)
{
    const char *file, *before;
    if (o->region && outfile_same(o->region, out))
        die(EXIT_USAGE, "--region and --output cannot both be %s", out);
    for (size_t i = 0; i < o->checks.n; i++) {
        check_of(o->checks.v[i], &file);
        if (outfile_same(file, out) || (o->region && outfile_same(file, o->region)))
            die(EXIT_USAGE, "--check-image %s: another output has that name", o->checks.v[i]);
        for (size_t k = 0; k < i; k++) {
            check_of(o->checks.v[k], &before);
            if (outfile_same(file, before))
                die(EXIT_USAGE, "--check-image %s: another output has that name", o->checks.v[i]);
        }
    }
}

/* Images and maps, and `more`, must fit. */
static void check_memory(const struct frame *f, const char *in, const struct options *o, const struct common *c, double more)
{
    double need = (double)image_count(&f->im) * ((f->im.pix ? 4 : 0) + (o->weight ? 4 : 0) + (o->measure ? 4 : 0) + (o->measure_weight ? 4 : 0)) + 32 * 1048576.0 + more;
    if (need > c->max_memory)
        die(EXIT_RUN, "%s: needs %.0f MB of memory: raise --max-memory", in, need / 1e6);
}

/* The image: its pixels stay in the file, unless they are changed or asked for again when outputs are being written. */
static void read_image(struct frame *f, const char *in, const struct options *o, const struct common *c)
{
    struct err e;
    const int keep = !o->mask && o->checks.n == 0;
    if (keep ? image_open(&f->im, &f->pixels, &f->in, in, c->max_memory, &e) : image_read(&f->im, in, c->max_memory, &e))
        die(EXIT_RUN, "%s", e.text);
    if (!f->in)
        f->pixels = pixels_of(&f->im);
}

static void read_frame(struct frame *f, const char *in, const struct options *o, const struct opt *own,
                       const struct common *c)
{
    struct err e;
    read_image(f, in, o, c);
    pages_keep(image_count(&f->im) * sizeof(float));
    check_memory(f, in, o, c, 0);
    if (o->measure)
        read_beside(&f->other, o->measure, &f->im, c->max_memory);
    f->other_pixels = pixels_of(&f->other);
    const struct header *h = &f->im.hdr, *flux = o->measure ? &f->other.hdr : h;
    struct exposure x = {0};
    if (exposure_keywords(h, in, &x, &e))
        die(EXIT_RUN, "%s", e.text);
    const int square = exposure_square(&x, in, &e);
    if (square == E_DATA)
        die(EXIT_RUN, "%s", e.text);
    if (square && !c->quiet)
        warn("%s", e.text);
    int wcs = sky_open(&f->sky, h, &e);
    if (wcs == E_NOMEM)
        die(EXIT_RUN, "%s: %s", in, e.text);
    if (wcs == E_DATA && !c->quiet)
        warn("%s: %s: no positions on the sky", in, e.text);
    if (wcs)
        f->sky = NULL;
    f->scale = o->pixscale > 0 ? o->pixscale : x.scale > 0 ? x.scale : 0;
    const double here = x.scale;
    if (o->measure && exposure_keywords(flux, o->measure, &x, &e))
        die(EXIT_RUN, "%s", e.text);
    if (fabs(x.scale / here - 1) > 1e-3)
        die(EXIT_RUN, "%s: pixels of %g arcsec, but %s has %g: objects would be measured elsewhere", o->measure, x.scale, in, here);
    f->gain = opt_given(own, c, "gain") ? o->gain : x.gain > 0 ? x.gain : x.unit == UNIT_ELECTRON ? 1 : 0;
    f->has_gain = f->gain > 0 || opt_given(own, c, "gain");
    f->psf_fwhm = o->psf_fwhm > 0 ? o->psf_fwhm : header_double_or(flux, "PSFFWHM", header_double_or(h, "PSFFWHM", 0));
    f->has_zeropoint = opt_given(own, c, "zeropoint") || header_double(flux, "MAGZERO", &f->zeropoint) == OK;
    if (opt_given(own, c, "zeropoint"))
        f->zeropoint = o->zeropoint;
    flux_unit(f, flux, &x);
    read_maps(f, o, c);
}

/* The filter: from a file, or a Gaussian of the FWHM asked for, else of the PSF, else of 2 pixels. */
static void make_filter(struct smooth *s, const struct frame *f, const char *in, const struct options *o, const struct opt *own,
                        const struct common *c)
{
    if (o->kernel_file) {
        struct kernel k;
        struct err e;
        if (kernel_read(&k, o->kernel_file, c->max_memory, &e))
            die(EXIT_RUN, "%s", e.text);
        int st = smooth_kernel(s, &k, f->im.nx, f->im.ny);
        kernel_free(&k);
        if (st == E_DATA)
            die(EXIT_RUN, "%s: the largest value of a kernel must be between 1e-20 and 1e20: scale it, or write CONV NORM", o->kernel_file);
        run(st, o->kernel_file);
    } else {
        double fwhm = f->psf_fwhm > 0 && f->scale > 0 ? f->psf_fwhm / f->scale : 2;
        if (opt_given(own, c, "kernel"))
            fwhm = o->kernel > 0 ? o->kernel / f->scale : 0;
        if (fwhm > 1000)
            die(EXIT_RUN, "%s: a kernel of %g pixels is more than 1000: check --kernel and the pixel scale", in, fwhm);
        run(smooth_new(s, fwhm), in);
    }
    check_memory(f, in, o, c, c->threads * smooth_bytes(s, f->im.nx));
}

/* Parameters of the kernel, in pixels. */
static struct detect_params plan(const struct frame *f, const char *in, const struct options *o,
                                 const struct opt *own, const struct common *c)
{
    struct detect_params p = o->p;
    const struct header *h = o->measure ? &f->other.hdr : &f->im.hdr;
    p.measure = o->measure ? &f->other_pixels : NULL;
    p.measure_map = f->other_map;
    p.threads = c->threads;
    p.clean = !o->no_clean;
    p.phot.gain = f->gain;
    p.phot.noise_cor = header_double_or(h, "NOISECOR", 1);
    p.phot.saturation = opt_given(own, c, "saturation") ? o->saturation : header_double_or(h, "SATURATE", INFINITY);
    p.phot.windowed = detectcat_windowed(o->columns);
    p.phot.errors = detectcat_errors(o->columns);
    p.phot.plain_sizes = !detectcat_sizes(o->columns);
    if (o->fractions.n) {
        p.phot.flux_fraction = o->fractions.v[0];
        p.phot.nfractions = o->fractions.n - 1;
        p.phot.fraction = o->fractions.v + 1;
    }
    int subtracted;
    if (header_bool(h, "SKYSUB", &subtracted) == OK && subtracted)
        p.sky_removed = header_double_or(h, "SKYLEVEL", 0);
    if (f->psf_fwhm > 0 && f->scale > 0)
        p.phot.psf_fwhm = f->psf_fwhm / f->scale;
    int sizes = (opt_given(own, c, "kernel") && o->kernel > 0) || o->apertures.n > 0;
    if (sizes && !(f->scale > 0))
        die(EXIT_RUN, "%s: no PIXSCALE and no world coordinates in the header: give --pixscale", in);
    return p;
}

/* Keywords that the next programs need, and the HISTORY of the image. */
static void copy_keywords(struct table *t, const struct frame *f, const struct detect_params *p,
                          const struct detection *d)
{
    int st = catkeys_copy(t, &f->im.hdr);
    if (!st && f->scale > 0) {
        st = table_set_number(t, "PIXSCALE", f->scale);
        if (!st)
            st = table_set_number(t, "AREA", (double)image_count(&f->im) * f->scale * f->scale / 3600);
    }
    if (!st && f->has_zeropoint)
        st = table_set_number(t, "MAGZERO", f->zeropoint);
    if (!st && p->phot.gain > 0)
        st = table_set_number(t, "GAIN", p->phot.gain);
    if (!st)
        st = table_set_number(t, "SKYRMS", d->noise);
    if (!st)
        st = table_set_number(t, "THRESH", d->threshold * d->noise);
    if (!st)
        st = catkeys_history(t, &f->im.hdr);
    run(st, "keywords");
}

/* DS9: one ellipse for each object, the one of FLUX_AUTO. */
static void write_region(const char *name, const struct detection *d, const char *const *inputs, size_t n)
{
    struct err e;
    struct region *r;
    if (region_open(&r, name, inputs, n, &e))
        die(EXIT_RUN, "%s", e.text);
    for (size_t i = 0; i < d->n; i++) {
        const struct object *o = &d->object[i];
        region_ellipse(r, o->x + 1, o->y + 1, o->a * o->kron_radius, o->b * o->kron_radius, o->theta, i + 1, NULL);
    }
    if (region_close(r, &e))
        die(EXIT_RUN, "%s", e.text);
}

/* Row y of a check image that holds floats, but FILTERED. */
static int check_row(enum check_type type, const struct frame *f, const struct detection *d, long y, float *row)
{
    long nx = f->im.nx;
    size_t at = (size_t)y * (size_t)nx;
    if (type == RMS && f->map) {
        memcpy(row, f->map + at, (size_t)nx * sizeof *row);
        return OK;
    }
    if (type == RMS || type == BACKGROUND) {
        const struct mesh *m = type == RMS ? &d->background.rms : &d->background.level;
        mesh_row(m, y, 0, nx, row);
        for (long x = 0; x < nx; x++)
            row[x] += (float)m->pivot;
        return OK;
    }
    if (type == SUBTRACTED) {
        pixels_row(&f->pixels, y, 0, nx, row);
        background_subtract(&d->background, y, 0, nx, NAN, row);
        return OK;
    }
    memset(row, 0, (size_t)nx * sizeof *row);
    for (size_t i = d->label.row[y]; i < d->label.row[y + 1]; i++) {
        const struct label_run *r = &d->label.run[i];
        pixels_row(&f->pixels, y, r->x0, r->x1 - r->x0, row + r->x0);
        background_subtract(&d->background, y, r->x0, r->x1 - r->x0, 0, row + r->x0);
        for (long x = r->x0; f->map && x < r->x1; x++)
            row[x] = f->map[at + (size_t)x] <= FLT_MAX ? row[x] : 0;
    }
    return OK;
}

/* Mark the pixels that the circle or ellipse xx dx^2 + yy dy^2 + xy dx dy = 1 passes, half sides hx, hy. */
static void draw(unsigned char *mark, long nx, long ny, double x, double y, const double form[3], double hx, double hy)
{
    long steps = 16 + (long)(8 * (hx + hy));
    for (long k = 0; k < steps; k++) {
        double t = 2 * acos(-1) * (double)k / (double)steps, c = cos(t), s = sin(t);
        double r = 1 / sqrt(form[0] * c * c + form[1] * s * s + form[2] * c * s);
        long u = lround(x + r * c), v = lround(y + r * s);
        if (u >= 0 && v >= 0 && u < nx && v < ny)
            mark[(size_t)v * (size_t)nx + (size_t)u] = 1;
    }
}

/* Ellipses of FLUX_AUTO and the circular apertures. */
static unsigned char *draw_apertures(const struct frame *f, const struct detect_params *p, const struct detection *d)
{
    unsigned char *mark = calloc(image_count(&f->im), 1);
    if (!mark)
        run(E_NOMEM, "check image apertures");
    for (size_t i = 0; i < d->n; i++) {
        const struct object *o = &d->object[i];
        double k2 = o->kron_radius * o->kron_radius, det = (o->xx * o->yy - o->xy * o->xy) * k2;
        draw(mark, f->im.nx, f->im.ny, o->x, o->y, (double[3]){o->yy / det, o->xx / det, -2 * o->xy / det},
             o->kron_radius * sqrt(o->xx), o->kron_radius * sqrt(o->yy));
        for (size_t j = 0; j < p->phot.napertures; j++) {
            double r = 0.5 * p->phot.aperture[j];
            draw(mark, f->im.nx, f->im.ny, o->x, o->y, (double[3]){1 / (r * r), 1 / (r * r), 0}, r, r);
        }
    }
    return mark;
}

static void write_check(const char *text, const struct frame *f, const struct detect_params *p,
                        const struct detection *d, const char *record, const char *const *inputs, size_t n)
{
    const char *name;
    enum check_type type = check_of(text, &name);
    struct err e;
    struct header h = {0};
    run(header_copy(&h, &f->im.hdr), name);
    header_remove(&h, "EXTNAME");
    if (type == SEGMENTATION)
        header_remove(&h, "BUNIT");
    run(header_history(&h, record), name);
    struct fits_out *out;
    if (fits_out_open(&out, name, inputs, n, &e))
        die(EXIT_RUN, "%s", e.text);
    float *row = malloc((type == FILTERED ? BAND : 1) * (size_t)f->im.nx * sizeof *row);
    int32_t *label = malloc((size_t)f->im.nx * sizeof *label);
    unsigned char *mark = type == APERTURES ? draw_apertures(f, p, d) : NULL;
    int st = row && label ? fits_out_hdu(out, type == SEGMENTATION ? 32 : -32, f->im.nx, f->im.ny, 1, &h, &e)
                 : err_set(&e, E_NOMEM, "%s: %s", name, err_text(E_NOMEM));
    for (long y = 0; y < f->im.ny && type == SEGMENTATION && !st; y++) {
        labels_row(&d->label, y, label);
        st = fits_out_rows_int(out, 1, label, &e);
    }
    for (long y = 0; y < f->im.ny && type == FILTERED && !st; y += BAND) {
        const long many = f->im.ny - y < BAND ? f->im.ny - y : BAND;
        st = segment_filtered(&f->pixels, &d->background, f->map, p->filter, p->negative, y, many, row);
        st = st ? err_set(&e, st, "%s: %s", name, err_text(st)) : fits_out_rows(out, many, row, &e);
    }
    for (long y = 0; y < f->im.ny && type != SEGMENTATION && type != FILTERED && !st; y++) {
        st = check_row(type, f, d, y, row);
        for (long x = 0; x < f->im.nx && mark; x++)
            row[x] = mark[(size_t)y * (size_t)f->im.nx + (size_t)x] ? (float)(10 * d->noise) : row[x];
        if (st)
            err_set(&e, st, "%s: %s", name, err_text(st));
        else
            st = fits_out_rows(out, 1, row, &e);
    }
    free(row);
    free(label);
    free(mark);
    header_free(&h);
    if (st) {
        fits_out_abandon(out);
        die(EXIT_RUN, "%s", e.text);
    }
    if (fits_out_commit(out, &e))
        die(EXIT_RUN, "%s", e.text);
}

static void write_catalogue(const struct frame *f, const struct options *o, const struct common *c,
                            const struct detect_params *p, const struct detection *d, const char *record,
                            const char *const *inputs, size_t n)
{
    struct table t = {0};
    struct err e;
    struct detectcat dc = {o->columns, f->has_zeropoint ? f->zeropoint : 0, f->scale, f->sky, o->apertures.n,
                           o->fractions.n ? o->fractions.n - 1 : 0, f->unit};
    if (detectcat_fill(&t, d, &dc, &e))
        die(EXIT_RUN, "%s", e.text);
    copy_keywords(&t, f, p, d);
    size_t len = strlen(c->out);
    int ldac = o->format == LDAC || (o->format == BY_NAME && len > 5 && strcmp(c->out + len - 5, ".ldac") == 0);
    if (ldac ? ldac_write(&t, &f->im, c->out, record, inputs, n, &e) : table_write(&t, c->out, record, inputs, n, &e))
        die(EXIT_RUN, "%s", e.text);
    table_free(&t);
    if (!f->has_gain && !c->quiet)
        warn("%s: no GAIN in the header: errors leave out the photon noise of objects; give --gain", inputs[0]);
    if (!f->has_zeropoint && !c->quiet)
        warn("%s: no MAGZERO in the header: magnitudes are -2.5 log10(flux); give --zeropoint", inputs[0]);
}

/* --negative: the number of false detections, a line. */
static void write_count(const struct common *c, const struct detection *d, const char *const *inputs, size_t n)
{
    struct err e;
    struct outfile *f;
    char line[64];
    int len = snprintf(line, sizeof line, "%zu\n", d->n);
    if (outfile_open(&f, c->out, inputs, n, &e))
        die(EXIT_RUN, "%s", e.text);
    if (outfile_write(f, line, (size_t)len)) {
        outfile_abandon(f);
        die(EXIT_RUN, "%s: %s", c->out, err_text(E_IO));
    }
    if (outfile_commit(f, &e))
        die(EXIT_RUN, "%s", e.text);
}

static int has_pixel(const struct pixels *p, float *row)
{
    for (long y = 0; y < p->ny; y++) {
        pixels_row(p, y, 0, p->nx, row);
        for (long x = 0; x < p->nx; x++)
            if (isfinite(row[x]))
                return 1;
    }
    return 0;
}

static int has_weight(size_t n, const float *map)
{
    size_t k = 0;
    while (k < n && !(map[k] > 0 && map[k] < INFINITY))
        k++;
    return k < n;
}

/* The input that has no pixel for us; NULL: each has some, but not the same. */
static const char *without_pixels(const struct frame *f, const char *in, const struct options *o)
{
    const size_t n = (size_t)f->im.nx * (size_t)f->im.ny;
    float *row = malloc((size_t)f->im.nx * sizeof *row);
    const char *name = NULL;
    if (!row)
        return NULL;
    if (!has_pixel(&f->pixels, row))
        name = o->mask ? o->mask : in;
    else if (f->map && !has_weight(n, f->map))
        name = o->weight;
    else if (o->measure && !has_pixel(&f->other_pixels, row))
        name = o->measure;
    else if (f->other_map && !has_weight(n, f->other_map))
        name = o->measure_weight;
    free(row);
    return name;
}

static void detect_or_die(const struct frame *f, const char *in, const struct options *o,
                          const struct detect_params *p, struct detection *d)
{
    int st = detect_run(&f->pixels, f->map, o->weight_type != WEIGHT_RMS, p, d);
    const char *empty = st == E_DATA ? without_pixels(f, in, o) : NULL;
    if (st == E_DATA)
        die(EXIT_RUN, "%s: no usable pixel: %s", empty ? empty : in, empty ? "all are blank, masked or without weight"
                                                                           : "those that are not blank are masked or without weight");
    if (st == E_SINGULAR)
        die(EXIT_RUN, "%s: the background has no noise (constant image): give --rms", in);
    run(st, in);
}

/* The pixels are not needed any more: were they the same to the end? */
static void leave_image(struct frame *f)
{
    struct err e;
    if (f->in && fits_in_unchanged(f->in, &e))
        die(EXIT_RUN, "%s", e.text);
    fits_in_close(f->in);
    f->in = NULL;
}

/* CPU seconds, good to a factor 2 at the depth of the experiment: a start, the pixels, some hundred objects per arcmin^2. */
static double predict(const struct frame *f, const struct detect_params *p)
{
    const double n = (double)image_count(&f->im);
    return 0.004 + (5.6e-9 + smooth_seconds(p->filter)) * n + (f->scale > 0 ? fmin(1.75e-7 * f->scale * f->scale, 1e-8) * n : 3e-9 * n);
}

static void describe(const struct frame *f, const char *in, const struct detect_params *p)
{
    static const char *const way[] = {"none", "a Gaussian", "a row times a column", "summed as a whole", "by transforms of tiles"};
    double mb = ((double)image_count(&f->im) * ((f->im.pix ? 4 : 0) + (f->map ? 4 : 0)) + p->threads * smooth_bytes(p->filter, f->im.nx)) / 1e6;
    fprintf(stderr, "detect: %s: %ld x %ld pixels of %g arcsec, kernel %d x %d (%s), gain %g, zero point %g, "
            "about %.0f MB and %.2g s\n", in, f->im.nx, f->im.ny, f->scale, 2 * p->filter->reach + 1, 2 * p->filter->radius + 1, way[p->filter->way],
            p->phot.gain, f->zeropoint, mb + 8, predict(f, p));
}

/* Every output can be opened: told before the work, and before one of them appears. */
static void outputs_ready(const struct options *o, const struct common *c, const char *const *inputs, size_t n)
{
    struct err e;
    const char *file;
    int st = outfile_ready(c->out, inputs, n, &e);
    if (st == OK && o->region)
        st = outfile_ready(o->region, inputs, n, &e);
    for (size_t i = 0; i < o->checks.n && st == OK; i++) {
        check_of(o->checks.v[i], &file);
        st = outfile_ready(file, inputs, n, &e);
    }
    if (st)
        die(EXIT_RUN, "%s", e.text);
}

/* Detect and write everything that was asked for. */
static void search(struct frame *f, const struct program *prog, const struct opt *own, const struct options *o,
                   const struct common *c, const struct detect_params *p, const char *const *inputs, size_t n_inputs)
{
    const char *in = inputs[0];
    struct detection d = {0};
    struct progress bar;
    struct timespec begin, end;
    struct detect_params with_bar = *p;
    with_bar.progress = &bar;
    outputs_ready(o, c, inputs, n_inputs);
    progress_begin(&bar, "detect", DETECT_STEPS, c->quiet);
    timespec_get(&begin, TIME_UTC);
    detect_or_die(f, in, o, &with_bar, &d);
    leave_image(f);
    timespec_get(&end, TIME_UTC);
    progress_end(&bar);
    if (c->verbose)
        fprintf(stderr, "detect: %s: sky %g, rms %g, threshold %g rms, filtered noise %.4f; %zu found, %zu cleaned\n"
                "detect: found and measured in %.4f s\n", in,
                d.background.mean_level, d.noise, d.threshold, d.filtered_noise, d.found, d.cleaned,
                difftime(end.tv_sec, begin.tv_sec) + 1e-9 * (double)(end.tv_nsec - begin.tv_nsec));
    char *record = opt_record(prog, own, c);
    struct err e;
    outfile_together();
    for (size_t i = 0; i < o->checks.n; i++)
        write_check(o->checks.v[i], f, p, &d, record, inputs, n_inputs);
    if (o->region && !p->negative)
        write_region(o->region, &d, inputs, n_inputs);
    if (p->negative)
        write_count(c, &d, inputs, n_inputs);
    else
        write_catalogue(f, o, c, p, &d, record, inputs, n_inputs);
    if (outfile_appear(&e))
        die(EXIT_RUN, "%s", e.text);
    free(record);
    detection_free(&d);
}

/* Options that contradict each other, or would do nothing. */
static void check_options(const struct options *o, const struct opt *own, const struct common *c)
{
    if (o->p.back_filter % 2 == 0)
        die(EXIT_USAGE, "--back-filter %ld: give an odd number", o->p.back_filter);
    char unknown[64];
    if (detectcat_unknown(o->columns, unknown))
        die(EXIT_USAGE, "--columns: there is no column '%s': see detect(1)", unknown);
    if (o->measure_weight && !o->measure)
        die(EXIT_USAGE, "--measure-weight %s: is the weight of another image: give --measure", o->measure_weight);
    static const char *const of_weight[] = {"weight-type", NULL}, *const of_clean[] = {"clean-slope", NULL}, *const of_levels[] = {"deblend-contrast", NULL},
                      *const of_objects[] = {"columns", "apertures", "flux-fraction", "format", "measure", NULL};
    if (!o->weight && !o->measure_weight)
        opt_idle(own, c, of_weight, "without --weight");
    if (o->no_clean)
        opt_idle(own, c, of_clean, "with --no-clean");
    if (o->p.levels == 1)
        opt_idle(own, c, of_levels, "with --deblend-levels 1");
    if (o->p.negative)
        opt_idle(own, c, of_objects, "with --negative, which prints a count");
    if (o->p.negative && o->region)
        die(EXIT_USAGE, "--negative and --region: only a count is written");
    if (o->kernel_file && opt_given(own, c, "kernel"))
        die(EXIT_USAGE, "--kernel and --kernel-file: there is one filter: give one of them");
    if (o->p.negative)
        opt_output(c->out, OUT_LINES);
}

/* The files read, the image first. */
static size_t list_inputs(const struct options *o, const char *image, const char *inputs[6])
{
    size_t n = 0, streams = 0;
    inputs[n++] = image;
    if (o->kernel_file)
        inputs[n++] = o->kernel_file;
    if (o->weight)
        inputs[n++] = o->weight;
    if (o->mask)
        inputs[n++] = o->mask;
    if (o->measure)
        inputs[n++] = o->measure;
    if (o->measure_weight)
        inputs[n++] = o->measure_weight;
    for (size_t i = 0; i < n; i++)
        streams += strcmp(inputs[i], "-") == 0;
    if (streams > 1)
        die(EXIT_USAGE, "standard input can be read once only");
    return n;
}

int main(int argc, char **argv)
{
    struct common c = COMMON_DEFAULTS;
    struct options o = {.p = DETECT_DEFAULTS};
    const struct program prog = {
        "detect", "find and measure the objects of an image", "[IMAGE]", 0, 1,
        "  detect field.fits -o field.cat\n"
        "  detect --kernel 0.12 --threshold 1.5 --threshold-noise pixel --region field.reg field.fits -o field.cat\n", OUT_LDAC
    };
    const struct opt own[] = {
        {.name = "kernel", .letter = 'k', .type = OPT_REAL, .value = &o.kernel, .lo = 0, .hi = 1e5, .arg = "ARCSEC",
         .help = "FWHM of the Gaussian filter, 0 none (default: PSFFWHM, else 2 pixels)"},
        {.name = "kernel-file", .type = OPT_STR, .value = &o.kernel_file, .arg = "FILE", .in_file = 1,
         .help = "another filter: FITS image, or text (CONV NORM or NONORM and rows of numbers)"},
        {.name = "threshold", .letter = 't', .type = OPT_REAL, .value = &o.p.threshold, .lo = 1e-6, .hi = 1e9, .arg = "K",
         .help = "detection threshold in units of the noise"},
        {.name = "threshold-noise", .type = OPT_CHOICE, .value = &o.p.pixel_noise, .choices = "filtered|pixel",
         .arg = "WHICH", .help = "which noise: of the filtered image or of a pixel"},
        {.name = "min-area", .type = OPT_LONG, .value = &o.p.min_area, .lo = 1, .hi = 1e9, .arg = "N",
         .help = "least number of pixels above the threshold"},
        {.name = "deblend-levels", .type = OPT_LONG, .value = &o.p.levels, .lo = 1, .hi = 1024, .arg = "N",
         .help = "levels between threshold and peak, 1 none"},
        {.name = "deblend-contrast", .type = OPT_REAL, .value = &o.p.contrast, .lo = 0, .hi = 1, .arg = "F",
         .help = "least part of the flux of a branch, 1 no deblending"},
        {.name = "no-clean", .type = OPT_FLAG, .value = &o.no_clean, .help = "keep detections in the wings of others"},
        {.name = "clean-slope", .type = OPT_REAL, .value = &o.p.clean_beta, .lo = 0.1, .hi = 10, .arg = "BETA",
         .help = "Moffat slope of the wings that cleaning assumes"},
        {.name = "back-size", .letter = 'b', .type = OPT_LONG, .value = &o.p.back_cell, .lo = 4, .hi = 65535, .arg = "N",
         .help = "side of the background cells, pixels"},
        {.name = "back-filter", .type = OPT_LONG, .value = &o.p.back_filter, .lo = 1, .hi = 101, .arg = "N",
         .help = "median filter over N x N cells, odd"},
        {.name = "back-type", .type = OPT_CHOICE, .value = &o.p.dark_sky, .choices = "mode|dark", .arg = "TYPE",
         .help = "level of a cell: 2.5 median - 1.5 mean, or the mean of its dark part"},
        {.name = "rms", .type = OPT_REAL, .value = &o.p.rms, .lo = 1e-30, .hi = 1e30, .arg = "R",
         .help = "noise of a pixel, unit of the image (default: measured)"},
        {.name = "weight", .letter = 'w', .type = OPT_STR, .value = &o.weight, .arg = "FILE", .in_file = 1,
         .help = "weight map of the image's size"},
        {.name = "weight-type", .type = OPT_CHOICE, .value = &o.weight_type, .choices = "weight|rms|variance", .arg = "TYPE",
         .help = "what it holds; weight and variance are relative, rms is absolute"},
        {.name = "mask", .type = OPT_STR, .value = &o.mask, .arg = "FILE", .in_file = 1,
         .help = "image whose pixels other than 0 are bad"},
        {.name = "gain", .letter = 'g', .type = OPT_REAL, .value = &o.gain, .lo = 0, .hi = 1e30, .arg = "G",
         .help = "electrons per unit (default: GAIN; 0: no photon noise of objects)"},
        {.name = "zeropoint", .letter = 'z', .type = OPT_REAL, .value = &o.zeropoint, .lo = -1000, .hi = 1000, .arg = "MAG",
         .help = "magnitude of one unit of the image (default: MAGZERO)"},
        {.name = "pixscale", .letter = 'x', .type = OPT_REAL, .value = &o.pixscale, .lo = 0, .hi = 1e6, .arg = "ARCSEC",
         .help = "pixel scale (default: PIXSCALE, else the world coordinates)"},
        {.name = "psf-fwhm", .type = OPT_REAL, .value = &o.psf_fwhm, .lo = 0, .hi = 1e5, .arg = "ARCSEC",
         .help = "FWHM of the PSF for the default kernel and STAR_PROB (default: PSFFWHM)"},
        {.name = "saturation", .type = OPT_REAL, .value = &o.saturation, .lo = -1e30, .hi = 1e30, .arg = "LEVEL",
         .help = "level of saturated pixels (default: SATURATE)"},
        {.name = "apertures", .type = OPT_REALS, .value = &o.apertures, .lo = 1e-6, .hi = 1e5, .arg = "D,...",
         .help = "diameters of circular apertures, arcsec"},
        {.name = "flux-fraction", .type = OPT_REALS, .value = &o.fractions, .lo = 0.001, .hi = 0.999, .arg = "F,...",
         .help = "parts of FLUX_AUTO inside FLUX_RADIUS, FLUX_RADIUS_2, ... (default: 0.5)"},
        {.name = "measure", .letter = 'm', .type = OPT_STR, .value = &o.measure, .arg = "FILE", .in_file = 1,
         .help = "detect in IMAGE, measure in this one"},
        {.name = "measure-weight", .type = OPT_STR, .value = &o.measure_weight, .arg = "FILE", .in_file = 1,
         .help = "weight map of that image, of the type of --weight"},
        {.name = "format", .type = OPT_CHOICE, .value = &o.format, .choices = "name|ldac", .arg = "FORMAT",
         .help = "of the catalogue: as the name says (.fits, .ldac, else text), or FITS_LDAC"},
        {.name = "columns", .letter = 'c', .type = OPT_STR, .value = &o.columns, .arg = "LIST",
         .help = "NAME,NAME,... instead of the default columns; +NAME,... beside them"},
        {.name = "check-image", .type = OPT_STRS, .value = &o.checks, .arg = "TYPE=FILE",
         .help = "background, rms, filtered, segmentation, objects, subtracted or apertures", .in_file = OPT_OUT(OUT_FITS)},
        {.name = "region", .type = OPT_STR, .value = &o.region, .arg = "FILE", .in_file = OPT_OUT(OUT_REGION),
         .help = "ellipses for DS9"},
        {.name = "negative", .type = OPT_FLAG, .value = &o.p.negative,
         .help = "detect on the negated image and print only the count"},
        {0}
    };
    opt_parse(&prog, own, &c, argc, argv);
    const char *in = c.argv[0], *inputs[6];
    const size_t n_inputs = list_inputs(&o, in, inputs);
    check_options(&o, own, &c);
    check_outputs(&o, c.out);
    struct frame f = {0};
    read_frame(&f, in, &o, own, &c);
    struct detect_params p = plan(&f, in, &o, own, &c);
    struct smooth filter = {0};
    make_filter(&filter, &f, in, &o, own, &c);
    p.filter = &filter;
    double *diameter = calloc(o.apertures.n + 1, sizeof *diameter);
    if (!diameter)
        run(E_NOMEM, in);
    for (size_t i = 0; i < o.apertures.n; i++)
        diameter[i] = o.apertures.v[i] / f.scale;
    p.phot.napertures = o.apertures.n;
    p.phot.aperture = diameter;
    if (c.check || c.verbose)
        describe(&f, in, &p);
    if (!c.check)
        search(&f, &prog, own, &o, &c, &p, inputs, n_inputs);
    free(diameter);
    smooth_free(&filter);
    free(f.map);
    free(f.other_map);
    sky_close(f.sky);
    fits_in_close(f.in);
    image_free(&f.im);
    image_free(&f.other);
    opt_free(own);
    return EXIT_DONE;
}
