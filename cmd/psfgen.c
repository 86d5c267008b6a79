/*
 * psfgen.c - make a PSF file: telescope pupil, or a PSF from elsewhere, times
 * charge diffusion and pixel, as image and transfer function.
 */
#include "header.h"
#include "opt.h"
#include "progress.h"
#include "psf.h"
#include "psfio.h"
#include "pupil.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct psfgen {
    int telescope;
    struct pupil pupil;
    double wavelength_nm, bandwidth_nm;
    long wavelengths, struts, cells, size;
    const char *zernike, *from;
    double diffusion, pixel, scale, cutoff, from_scale, x, y;
    int normalise, has_pixel, force;
    double seconds;          /* of transform, convolution and image */
};

/* "J:WAVES,J:WAVES": into the pupil; a usage error names the piece. */
static void parse_zernike(const char *text, struct pupil *p)
{
    char *copy = strdup(text), *rest = copy, *piece;
    if (!copy)
        die(EXIT_RUN, "%s", err_text(E_NOMEM));
    while ((piece = strsep(&rest, ","))) {
        char *colon = strchr(piece, ':');
        double j, waves;
        if (colon)
            *colon = 0;
        if (!colon || opt_number(piece, &j) || opt_number(colon + 1, &waves) || !(j >= 1 && j <= ZERNIKE_MAX) || j != floor(j))
            die(EXIT_USAGE, "option --zernike: '%s': J:WAVES,... with J from 1 to %d is needed", text, ZERNIKE_MAX);
        if (p->terms == PUPIL_TERMS)
            die(EXIT_USAGE, "option --zernike: more than %d terms", PUPIL_TERMS);
        for (int k = 0; k < p->terms; k++)
            if (p->noll[k] == (int)j)
                die(EXIT_USAGE, "option --zernike: '%s': Z%d is given twice", text, (int)j);
        p->noll[p->terms] = (int)j;
        p->waves[p->terms++] = waves;
    }
    free(copy);
}

/* Options of what the telescope does not have would do nothing. */
static void check_telescope(const struct pupil *p, const struct opt *own, const struct common *c)
{
    static const char *const band[] = {"wavelengths", NULL}, *const strut[] = {"strut-width", "strut-angle", NULL},
                      *const angle[] = {"strut-angle", NULL}, *const offset[] = {"obscuration-offset", NULL};
    if (!(p->bandwidth > 0))
        opt_idle(own, c, band, "without --bandwidth");
    if (!p->struts)
        opt_idle(own, c, strut, "without struts");
    if (!(p->strut_width > 0))
        opt_idle(own, c, angle, "with struts of no width");
    if (!(p->obscuration > 0))
        opt_idle(own, c, offset, "without an obscuration");
}

/* The preset, changed by what was typed. */
static void choose_telescope(struct psfgen *g, const struct opt *own, const struct common *c)
{
    const struct telescope *t = telescope_preset(g->telescope);
    const struct pupil typed = g->pupil;
    g->pupil = t->pupil;
    if (opt_given(own, c, "diameter"))
        g->pupil.diameter = typed.diameter;
    if (opt_given(own, c, "obscuration"))
        g->pupil.obscuration = typed.obscuration;
    if (opt_given(own, c, "strut-width"))
        g->pupil.strut_width = typed.strut_width;
    if (opt_given(own, c, "strut-angle"))
        g->pupil.strut_angle = typed.strut_angle;
    if (opt_given(own, c, "struts"))
        g->pupil.struts = (int)g->struts;
    if (opt_given(own, c, "wavelength"))
        g->pupil.wavelength = g->wavelength_nm * 1e-9;
    if (opt_given(own, c, "bandwidth") || opt_given(own, c, "wavelength"))
        g->pupil.bandwidth = g->bandwidth_nm * 1e-9;
    if (!(g->pupil.bandwidth < 2 * g->pupil.wavelength))
        die(EXIT_USAGE, "option --bandwidth: %g nm: must be below twice the wavelength, %g nm", g->bandwidth_nm,
            2e9 * g->pupil.wavelength);
    check_telescope(&g->pupil, own, c);
    memcpy(g->pupil.offset, typed.offset, sizeof typed.offset);
    g->pupil.wavelengths = (int)g->wavelengths;
    if (!opt_given(own, c, "diffusion"))
        g->diffusion = t->diffusion;
    if (g->zernike)
        parse_zernike(g->zernike, &g->pupil);
}

/* Cells across the pupil: as asked, more when the image is longer than the period. */
static int choose_cells(const struct psfgen *g, int asked, double max_memory)
{
    double side = (double)g->size * g->scale, need = 1.25 * side * pupil_cutoff(&g->pupil), cells = (double)g->cells;
    if (need > cells) {
        if (asked)
            die(EXIT_USAGE, "option --pupil-grid: %ld cells: an image of %g arcsec needs %.0f", g->cells, side, ceil(need));
        cells = ceil(need / 64) * 64;
    }
    if (cells > PUPIL_CELLS_MAX)
        die(EXIT_RUN, "an image of %g arcsec is %.0f times lambda/D and needs %.0f cells across the pupil, more than %d: "
                      "reduce --size or --scale", side, side * pupil_cutoff(&g->pupil), cells, PUPIL_CELLS_MAX);
    double bytes = pupil_memory((int)cells) + (double)g->size * (double)g->size * 24;
    if (bytes > max_memory)
        die(EXIT_RUN, "%.0f cells across the pupil and %ld^2 samples need %.0f MB: raise --max-memory or reduce --size or --scale",
            cells, g->size, bytes * 1e-6);
    return (int)cells;
}

/* CPU seconds, good to a factor 2: the pupil's transform, a resampling for each further wavelength, the image. */
static double predict(const struct psfgen *g, int cells)
{
    const double further = g->pupil.bandwidth > 0 ? g->pupil.wavelengths - 1 : 0;
    return 4.6e-7 * (1 + 0.19 * further) * cells * cells + 1e-7 * (double)g->size * (double)g->size;
}

static int telescope_otf(struct psfgen *g, const struct common *c, int asked, struct otf *t)
{
    struct err e;
    int cells = choose_cells(g, asked, c->max_memory);
    if (c->check || c->verbose)
        warn("pupil: %d cells across %g m, %d wavelengths, %d aberrations, clear area %.4f m^2, about %.0f MB and %.2g s", cells, g->pupil.diameter,
             g->pupil.bandwidth > 0 ? g->pupil.wavelengths : 1, g->pupil.terms, pupil_area(&g->pupil, 256), pupil_memory(cells) * 1e-6,
             predict(g, cells));
    const double begin = seconds_now();
    if (!c->check && pupil_otf(&g->pupil, cells, t, &e))
        die(EXIT_RUN, "%s", e.text);
    g->seconds += seconds_now() - begin;
    return cells;
}

/* Options of a telescope make no sense with --from, nor those of --from without it. */
static void check_options(const struct psfgen *g, const struct opt *own, const struct common *c)
{
    static const char *const tel[] = {"telescope", "diameter", "wavelength", "bandwidth", "wavelengths", "obscuration",
                                      "obscuration-offset", "struts", "strut-width", "strut-angle", "zernike", "pupil-grid"};
    static const char *const file[] = {"psf-scale", "psf-cutoff", "psf-has-pixel", "x-image", "y-image", "normalise", "force"};
    for (size_t i = 0; g->from && i < sizeof tel / sizeof *tel; i++)
        if (opt_given(own, c, tel[i]))
            die(EXIT_USAGE, "option --%s: a PSF from a file has no telescope: leave out this or --from", tel[i]);
    if (opt_given(own, c, "x-image") != opt_given(own, c, "y-image"))
        die(EXIT_USAGE, "--x-image and --y-image are one position: give both");
    for (size_t i = 0; !g->from && i < sizeof file / sizeof *file; i++)
        if (opt_given(own, c, file[i]))
            die(EXIT_USAGE, "option --%s: only with --from", file[i]);
}

/* A PSF from elsewhere; factors already inside are not applied twice. */
static void foreign_otf(const struct psfgen *g, const struct common *c, struct otf *t)
{
    struct psf_options o = {.scale = g->from_scale, .cutoff = g->cutoff, .has_pixel = g->has_pixel,
                            .at = isfinite(g->x) && isfinite(g->y), .x = g->x, .y = g->y,
                            .normalise = g->normalise, .max_memory = c->max_memory};
    struct psf_info info;
    struct err e;
    if (psf_read(g->from, &o, t, &info, &e))
        die(EXIT_RUN, "%s", e.text);
    if (!g->force && t->chdiff > 0 && g->diffusion > 0)
        die(EXIT_RUN, "%s: CHDIFF: %g arcsec of charge diffusion is in already: leave out --diffusion, or add --force", g->from,
            t->chdiff);
    if (!g->force && t->pixel > 0 && g->pixel > 0)
        die(EXIT_RUN, "%s: PIXRESP: a pixel of %g arcsec is in already: leave out --pixel, or add --force", g->from, t->pixel);
    if (g->force && g->pixel > 0)
        t->pixel = 0;
    if (c->verbose || c->check)
        fprintf(stderr, "%s: flux %.8g%s, FWHM %.4f arcsec\n", info.base, info.flux, g->normalise ? ", divided by it" : "", info.fwhm);
    else if (!c->quiet && !g->normalise && fabs(info.flux - 1) > 0.01)
        warn("%s: its flux is %.6g and kept: --normalise makes it 1", g->from, info.flux);
}

static void must(int status)
{
    if (status)
        die(EXIT_RUN, "%s", err_text(status));
}

/* Cards that tell what the PSF is. */
static void describe(const struct psfgen *g, const struct otf *t, double fwhm, int cells, struct header *h)
{
    const struct pupil *p = &g->pupil;
    must(header_set_double(h, "PIXELSCL", g->scale, "[arcsec] per sample"));
    must(header_set_double(h, "PIXSCALE", g->scale, "[arcsec] per sample"));
    must(header_set_double(h, "PSFFWHM", round(fwhm * 1e7) / 1e7, "[arcsec] FWHM of the azimuthal mean"));
    must(header_set_double(h, "CHDIFF", t->chdiff, "[arcsec] sigma of charge diffusion inside"));
    must(header_set_bool(h, "PIXRESP", t->pixel > 0, "square pixel is inside"));
    if (t->pixel > 0)
        must(header_set_double(h, "PIXSIZE", t->pixel, "[arcsec] pixel inside"));
    must(header_set_double(h, "PSFFLUX", t->re[((size_t)t->n * (size_t)t->n) / 2], "flux of the PSF, T(0)"));
    if (g->from)
        return;
    must(header_set_str(h, "TELESCOP", telescope_preset(g->telescope)->name, "preset, changed as below"));
    must(header_set_double(h, "TELDIAM", p->diameter, "[m] diameter of the pupil"));
    must(header_set_double(h, "OBSCUR", p->obscuration, "linear obscuration"));
    must(header_set_double(h, "OBSCURX", p->offset[0], "its displacement / diameter"));
    must(header_set_double(h, "OBSCURY", p->offset[1], "its displacement / diameter"));
    must(header_set_long(h, "NSTRUTS", p->struts, "vanes"));
    must(header_set_double(h, "STRUTWID", p->strut_width, "[m] width of a vane"));
    must(header_set_double(h, "STRUTANG", p->strut_angle, "[deg] first vane from x towards y"));
    must(header_set_double(h, "TELAREA", round(pupil_area(p, 256) * 1e6) / 1e6, "[m2] clear area"));
    must(header_set_double(h, "WAVELEN", p->wavelength * 1e9, "[nm] middle of the band"));
    must(header_set_double(h, "BANDWID", p->bandwidth * 1e9, "[nm] width of the band"));
    must(header_set_long(h, "NWAVE", p->bandwidth > 0 ? p->wavelengths : 1, "wavelengths in the sum"));
    must(header_set_long(h, "PUPILN", cells, "cells across the pupil"));
    for (int k = 0; k < p->terms; k++) {
        char key[16], what[80];
        snprintf(key, sizeof key, "ZERN%d", p->noll[k]);
        snprintf(what, sizeof what, "[waves] rms of Noll's Z%d", p->noll[k]);
        must(header_set_double(h, key, p->waves[k], what));
    }
}

/* Width of what goes into the file; refuses images that cannot show it. */
static double width(const struct psfgen *g, const struct otf *t)
{
    double fwhm, side = (double)g->size * g->scale;
    int status = psf_fwhm(t, 0, 0, &fwhm);
    if (status == E_NOCONV || (status == OK && g->size > 1 && fwhm > side))
        die(EXIT_RUN, "the PSF's core (%s%.3g arcsec) is wider than the image of %g arcsec: raise --size or --scale",
            status ? "beyond " : "FWHM ", status ? psf_period(t) / 4 : fwhm, side);
    must(status);
    if (fwhm < 0.1 * g->scale)
        die(EXIT_RUN, "the PSF's core (FWHM %.3g arcsec) is below a tenth of a sample of %g arcsec: reduce --scale", fwhm, g->scale);
    return fwhm;
}

static void report(const struct psfgen *g, const struct otf *t, double fwhm, int n, const double *image)
{
    const double r[] = {0.1, 0.2, 0.5, 1, 2};
    double inside[5], sum = 0, lowest = INFINITY;
    for (int i = 0; i < n * n; i++) {
        sum += image[i];
        lowest = fmin(lowest, image[i]);
    }
    fprintf(stderr, "psfgen: made in %.4f s\n", g->seconds);
    fprintf(stderr, "FWHM of the azimuthal mean %.5f arcsec; sum of the image %.6f, lowest sample %.3g\n", fwhm, sum, lowest);
    if (psf_encircled(t, 0, 0, 5, r, inside) == OK)
        fprintf(stderr, "flux within 0.1 0.2 0.5 1 2 arcsec: %.4f %.4f %.4f %.4f %.4f\n", inside[0], inside[1], inside[2], inside[3],
                inside[4]);
}

/* Factors, width, image, file. */
static void make(struct psfgen *g, const struct common *c, struct otf *bare, int cells, const char *record)
{
    struct otf t = {0};
    struct header h = {0};
    struct err e;
    int n = (int)g->size;
    const double begin = seconds_now();
    must(psf_table(bare, g->diffusion, g->pixel, &t));
    otf_free(bare);
    if (n * g->scale > psf_period(&t))
        die(EXIT_RUN, "an image of %g arcsec is longer than the PSF's period of %g arcsec: reduce --size or --scale", n * g->scale,
            psf_period(&t));
    double fwhm = width(g, &t), *image = malloc((size_t)n * (size_t)n * sizeof *image);
    must(image ? psf_image(&t, 0, 0, n, n, g->scale, image) : E_NOMEM);
    g->seconds += seconds_now() - begin;
    describe(g, &t, fwhm, cells, &h);
    if (c->verbose)
        report(g, &t, fwhm, n, image);
    if (psf_write(c->out, n, n, image, &t, &h, record, &g->from, g->from != NULL, &e))
        die(EXIT_RUN, "%s", e.text);
    free(image);
    header_free(&h);
    otf_free(&t);
}

int main(int argc, char **argv)
{
    struct common c = COMMON_DEFAULTS;
    struct psfgen g = {.pupil = telescope_preset(0)->pupil, .wavelength_nm = 820, .wavelengths = 8, .struts = 3, .cells = 256,
                       .size = 513, .diffusion = 0.04, .scale = 0.02, .x = NAN, .y = NAN};
    const struct program prog = {
        .name = "psfgen", .what = "make a PSF file from a telescope's pupil: image and transfer function",
        .operands = "-o FILE", .min_operands = 0, .max_operands = 0,
        .examples = "  psfgen -o psf.fits\n  psfgen --telescope euclid --zernike 4:0.05,8:0.03 --pixel 0.1 --scale 0.02 -o euclid.fits\n", .writes = OUT_FITS,
    };
    const struct opt own[] = {
        {"telescope", 0, OPT_CHOICE, &g.telescope, 0, 0, NULL, "preset; what follows changes it", "snap|hst|euclid|roman", 0},
        {"diameter", 'D', OPT_REAL, &g.pupil.diameter, 1e-3, 1000, "M", "diameter of the pupil, m", NULL, 0},
        {"wavelength", 'w', OPT_REAL, &g.wavelength_nm, 1, 1e7, "NM", "middle of the band, nm", NULL, 0},
        {"bandwidth", 'b', OPT_REAL, &g.bandwidth_nm, 0, 1e7, "NM", "full width of a band of constant F_nu, nm", NULL, 0},
        {"wavelengths", 0, OPT_LONG, &g.wavelengths, 1, 512, "N", "Gauss-Legendre points in the band", NULL, 0},
        {"obscuration", 'O', OPT_REAL, &g.pupil.obscuration, 0, 1, "F", "diameter of the obscuration / diameter", NULL, 0},
        {"obscuration-offset", 0, OPT_PAIR, g.pupil.offset, -0.5, 0.5, "X,Y", "its displacement / diameter", NULL, 0},
        {"struts", 0, OPT_LONG, &g.struts, 0, 360, "N", "vanes, at equal angles", NULL, 0},
        {"strut-width", 0, OPT_REAL, &g.pupil.strut_width, 0, 1000, "M", "width of a vane, m", NULL, 0},
        {"strut-angle", 0, OPT_REAL, &g.pupil.strut_angle, -360, 360, "DEG", "first vane, from x towards y, deg", NULL, 0},
        {"zernike", 0, OPT_STR, &g.zernike, 0, 0, "J:WAVES,...", "aberrations, Noll's order, waves rms", NULL, 0},
        {"pupil-grid", 'M', OPT_LONG, &g.cells, 16, PUPIL_CELLS_MAX, "N", "cells across the pupil, at least", NULL, 0},
        {"diffusion", 'd', OPT_REAL, &g.diffusion, 0, 100, "ARCSEC", "sigma of charge diffusion; 0: none", NULL, 0},
        {"pixel", 0, OPT_REAL, &g.pixel, 0, 100, "ARCSEC", "square pixel to put in; 0: none", NULL, 0},
        {"scale", 'x', OPT_REAL, &g.scale, 1e-6, 1e3, "ARCSEC", "sampling of the image", NULL, 0},
        {"size", 'n', OPT_LONG, &g.size, 1, 16384, "N", "side of the image, samples", NULL, 0},
        {"from", 'f', OPT_STR, &g.from, 0, 0, "FILE", "a PSF image or PSF file instead of a telescope", NULL, 1},
        {"psf-scale", 0, OPT_REAL, &g.from_scale, 1e-6, 1e3, "ARCSEC", "its sampling, over its header's", NULL, 0},
        {"psf-cutoff", 0, OPT_REAL, &g.cutoff, 1e-6, 1e6, "U", "its highest frequency, cycles/arcsec", NULL, 0},
        {"psf-has-pixel", 0, OPT_FLAG, &g.has_pixel, 0, 0, NULL, "its pixel is in, whatever PIXRESP says", NULL, 0},
        {"x-image", 'X', OPT_REAL, &g.x, -1e6, 1e6, "X", "where a PSFEx model is evaluated, FITS pixels", NULL, 0},
        {"y-image", 'Y', OPT_REAL, &g.y, -1e6, 1e6, "Y", "where a PSFEx model is evaluated, FITS pixels", NULL, 0},
        {"normalise", 0, OPT_FLAG, &g.normalise, 0, 0, NULL, "divide it by its flux", NULL, 0},
        {"force", 0, OPT_FLAG, &g.force, 0, 0, NULL, "apply diffusion or pixel a second time", NULL, 0},
        {0}
    };
    opt_parse(&prog, own, &c, argc, argv);
    check_options(&g, own, &c);
    struct otf bare = {0};
    int cells = 0;
    if (g.from) {
        g.diffusion = opt_given(own, &c, "diffusion") ? g.diffusion : 0;
        foreign_otf(&g, &c, &bare);
        double extent = bare.p ? psf_period(&bare) / 2 : psf_period(&bare);
        if (!opt_given(own, &c, "size") && (double)g.size * g.scale > extent)
            g.size = (long)fmax(1, floor(extent / g.scale));
    } else {
        choose_telescope(&g, own, &c);
        cells = telescope_otf(&g, &c, opt_given(own, &c, "pupil-grid"), &bare);
    }
    if (!c.check) {
        char *record = opt_record(&prog, own, &c);
        make(&g, &c, &bare, cells, record);
        free(record);
    }
    otf_free(&bare);
    return EXIT_DONE;
}
