/*
 * dither.c - N x N ideally interlaced exposures from an image of small pixels.
 */
#include "dither.h"
#include "err.h"
#include "exposure.h"
#include "imageio.h"
#include "opt.h"
#include "progress.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct work {
    int n;                     /* exposures per axis */
    const struct common *c;
    const char *name, *record;
    struct fits_in *in;
    struct fits_out *out;
    struct exposure x;
    struct progress bar;
    double share;              /* factor on the sums: 1/N^2 of the electrons, all of a rate */
};

/* Refuse what cannot be rescaled. */
static void check_input(const struct work *w)
{
    char ctype[72];
    if (header_str(&w->x.hdr, "CTYPE1", ctype, sizeof ctype) == OK && strstr(ctype, "-SIP"))
        die(EXIT_RUN, "%s: SIP distortion cannot be rescaled: use TPV", w->name);
    if (dither_side(w->x.nx, w->n) < 1 || dither_side(w->x.ny, w->n) < 1)
        die(EXIT_RUN, "%s: %ld x %ld pixels are too few for %d x %d exposures: %d give one", w->name, w->x.nx,
            w->x.ny, w->n, w->n, 2 * w->n - 1);
}

/* Header of exposure e, at phase (a,b). */
static int describe(const struct work *w, int e, int a, int b, struct header *h)
{
    const struct exposure *x = &w->x;
    const double n = w->n, middle = 0.5 * (n - 1);
    int st = header_copy(h, &x->hdr);
    if (st == OK)
        st = exposure_rescale_wcs(h, a + middle, b + middle, n);
    if (st == OK && !isnan(x->scale))
        st = header_set_double(h, "PIXSCALE", x->scale * n, "arcsec per pixel");
    if (st == OK && !isnan(x->magzero))
        st = header_set_double(h, "MAGZERO", x->magzero + 2.5 * log10(w->share), "AB magnitude of 1 BUNIT");
    if (st == OK && !isnan(x->exptime))
        st = header_set_double(h, "EXPTIME", x->exptime / (n * n), "exposure time, s");
    if (st == OK && !isnan(x->tottime))
        st = header_set_double(h, "TOTTIME", x->tottime, "time of all exposures together, s");
    if (st == OK)
        st = header_set_long(h, "EXPNUM", e + 1, "number of the exposure");
    if (st == OK)
        st = header_set_double(h, "DITHERX", a / n, "displacement of the grid, pixels");
    if (st == OK)
        st = header_set_double(h, "DITHERY", b / n, "displacement of the grid, pixels");
    double level;
    if (st == OK && header_double(h, "SKYLEVEL", &level) == OK)
        st = header_set_double(h, "SKYLEVEL", level * n * n * w->share, "mean sky and dark per pixel, BUNIT");
    if (st == OK)
        st = header_set_str(h, "EXTNAME", "SCI", NULL);
    if (st == OK)
        st = header_set_long(h, "EXTVER", e + 1, NULL);
    return st == OK ? header_history(h, w->record) : st;
}

/* The rows of one exposure, each from N rows of the input. */
static int write_rows(struct work *w, int a, int b, struct err *e)
{
    const long nx = w->x.nx, side_x = dither_side(nx, w->n), side_y = dither_side(w->x.ny, w->n);
    const long block = 1 + (1 << 20) / (nx * w->n);
    float *in = malloc((size_t)(block * w->n) * (size_t)nx * sizeof *in);
    float *out = malloc((size_t)block * (size_t)side_x * sizeof *out);
    double *sums = malloc((size_t)nx * sizeof *sums);
    int st = in && out && sums ? OK : err_set(e, E_NOMEM, "%s: %s", w->name, err_text(E_NOMEM));
    for (long y = 0; y < side_y && st == OK; y += block) {
        long here = side_y - y < block ? side_y - y : block;
        st = fits_in_rows(w->in, w->x.index, 0, y * w->n + b, here * w->n, in, e);
        for (long j = 0; j < here && st == OK; j++)
            dither_row(w->n, a, nx, in + (size_t)(j * w->n) * (size_t)nx, w->share, sums,
                       out + (size_t)j * (size_t)side_x);
        if (st == OK)
            st = fits_out_rows(w->out, here, out, e);
        progress_tick(&w->bar, here);
    }
    free(in);
    free(out);
    free(sums);
    return st;
}

static int write_exposure(struct work *w, int e, struct err *err)
{
    int a, b;
    struct header h = {0};
    dither_phase(e, w->n, &a, &b);
    int st = describe(w, e, a, b, &h);
    if (st)
        err_set(err, st, "%s: %s", w->name, err_text(st));
    else
        st = fits_out_hdu(w->out, -32, dither_side(w->x.nx, w->n), dither_side(w->x.ny, w->n), 1, &h, err);
    header_free(&h);
    return st == OK ? write_rows(w, a, b, err) : st;
}

/* An empty primary with the HISTORY, then one extension per exposure. */
static int write_all(struct work *w, struct err *e)
{
    const char *inputs[] = {w->name};
    struct header top = {0};
    const int count = w->n * w->n;
    int st = fits_out_open(&w->out, w->c->out, inputs, 1, e);
    if (st)
        return st;
    st = header_history(&top, w->record);
    if (st)
        err_set(e, st, "%s: %s", w->name, err_text(st));
    else
        st = fits_out_hdu(w->out, -32, 0, 0, 1, &top, e);
    header_free(&top);
    progress_begin(&w->bar, "dither", count * dither_side(w->x.ny, w->n), w->c->quiet);
    for (int i = 0; i < count && st == OK; i++)
        st = write_exposure(w, i, e);
    progress_end(&w->bar);
    if (st == OK)
        return fits_out_commit(w->out, e);
    fits_out_abandon(w->out);
    return st;
}

int main(int argc, char **argv)
{
    struct common c = COMMON_DEFAULTS;
    long n = 2;
    const struct program prog = {
        "dither", "Make N x N ideally interlaced exposures from an image of N times smaller pixels.", "[IMAGE]", 0, 1,
        "  simage scene.txt --subpixel 2 -x 0.2 --size 401,401 | dither -n 2 -o four.fits\n"
        "  dither -n 2 fine.fits | addnoise --depth 27.7 | drizzle -x 0.1 --pixfrac 0.5 -o deep.fits\n"
    };
    const struct opt own[] = {
        {"number", 'n', OPT_LONG, &n, 1, DITHER_MAX, "N", "exposures per axis: N*N in all", 0, 0},
        {0}
    };
    opt_parse(&prog, own, &c, argc, argv);
    struct work w = {.n = (int)n, .c = &c, .name = c.argv[0]};
    struct err e;
    if (fits_in_open(&w.in, w.name, c.max_memory, &e))
        die(EXIT_RUN, "%s", e.text);
    int index = fits_in_selected(w.in);
    if (index < 0 || fits_in_hdu(w.in, index)->nz != 1)
        die(EXIT_RUN, "%s: no plain image in it", w.name);
    if (exposure_read(w.in, w.name, index, &w.x, &e))
        die(EXIT_RUN, "%s", e.text);
    check_input(&w);
    w.share = w.x.unit == UNIT_RATE ? 1 : 1.0 / ((double)n * (double)n);
    if (c.verbose || c.check)
        fprintf(stderr, "dither: %s: %ld x %ld -> %ld exposures of %ld x %ld pixels, about %.2g s\n", w.name, w.x.nx, w.x.ny,
                n * n, dither_side(w.x.nx, w.n), dither_side(w.x.ny, w.n), 2e-9 * (double)(n * n) * (double)w.x.nx * (double)w.x.ny);
    char *record = opt_record(&prog, own, &c);
    w.record = record;
    if (!c.check && write_all(&w, &e))
        die(EXIT_RUN, "%s", e.text);
    free(record);
    header_free(&w.x.hdr);
    fits_in_close(w.in);
    return EXIT_DONE;
}
