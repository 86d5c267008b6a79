/*
 * dither.c - N x N ideally interlaced exposures from an image of small pixels.
 */
#include "dither.h"
#include "err.h"
#include "exposure.h"
#include "imageio.h"
#include "opt.h"
#include "progress.h"
#include "table.h"
#include "tableio.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct work {
    int n;                     /* small pixels per pixel and axis */
    int count;                 /* exposures */
    long (*phase)[2];          /* their displacements, small pixels, >= 0 */
    long side[2];              /* pixels of every exposure */
    const char *offsets;
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
    if (w->side[0] < 1 || w->side[1] < 1)
        die(EXIT_RUN, "%s: %ld x %ld pixels are too few for displaced pixels of %d x %d: no exposure would have one", w->name,
            w->x.nx, w->x.ny, w->n, w->n);
}

/* All N x N phases. */
static void ideal_phases(struct work *w)
{
    w->count = w->n * w->n;
    w->phase = malloc((size_t)w->count * sizeof *w->phase);
    if (!w->phase)
        die(EXIT_RUN, "%s", err_text(E_NOMEM));
    for (int e = 0; e < w->count; e++) {
        int a, b;
        dither_phase(e, w->n, &a, &b);
        w->phase[e][0] = a;
        w->phase[e][1] = b;
    }
}

/* Columns DX DY of a list, pixels of the exposure: multiples of a small pixel. */
static void listed_phases(struct work *w)
{
    static const char *const name[2] = {"DX", "DY"};
    struct table t = {0};
    struct err e;
    if (table_read(&t, w->offsets, w->c->max_memory, &e))
        die(EXIT_RUN, "%s", e.text);
    if (t.nrow < 1 || t.nrow > 4096)
        die(EXIT_RUN, "%s: %zu offsets: 1 to 4096 are possible", w->offsets, t.nrow);
    w->count = (int)t.nrow;
    w->phase = malloc(t.nrow * sizeof *w->phase);
    if (!w->phase)
        die(EXIT_RUN, "%s", err_text(E_NOMEM));
    for (int k = 0; k < 2; k++) {
        const struct column *c = table_find(&t, name[k]);
        if (!c)
            die(EXIT_RUN, "%s: column %s is missing", w->offsets, name[k]);
        for (size_t i = 0; i < t.nrow; i++) {
            const double v = table_number(c, i) * w->n, whole = floor(v + 0.5);
            if (!(whole >= 0 && whole < 1e6))
                die(EXIT_RUN, "%s: row %zu: offsets are 0 to 1e6 small pixels", w->offsets, i + 1);
            if (!(fabs(v - whole) <= 1e-6 * w->n))
                die(EXIT_RUN, "%s: row %zu: %s is no multiple of 1/%d pixel: render smaller pixels", w->offsets, i + 1, name[k], w->n);
            w->phase[i][k] = (long)whole;
        }
    }
    table_free(&t);
}

/* The same size for all: what every displacement leaves. */
static void set_sides(struct work *w)
{
    const long size[2] = {w->x.nx, w->x.ny};
    for (int k = 0; k < 2; k++) {
        long most = 0;
        for (int e = 0; e < w->count; e++)
            most = w->phase[e][k] > most ? w->phase[e][k] : most;
        w->side[k] = size[k] > most ? (size[k] - most) / w->n : 0;
    }
}

/* Header of exposure e, at phase (a,b). */
static int describe(const struct work *w, int e, struct header *h)
{
    const struct exposure *x = &w->x;
    const double n = w->n, middle = 0.5 * (n - 1), a = (double)w->phase[e][0], b = (double)w->phase[e][1];
    int st = header_copy(h, &x->hdr);
    if (st == OK)
        st = exposure_rescale_wcs(h, a + middle, b + middle, n);
    if (st == OK && !isnan(x->scale))
        st = header_set_double(h, "PIXSCALE", x->scale * n, "arcsec per pixel");
    if (st == OK && !isnan(x->magzero))
        st = header_set_double(h, "MAGZERO", x->magzero + 2.5 * log10(w->share), "AB magnitude of 1 BUNIT");
    if (st == OK && !isnan(x->exptime))
        st = header_set_double(h, "EXPTIME", x->exptime / w->count, "exposure time, s");
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
static int write_rows(struct work *w, long a, long b, struct err *e)
{
    const long nx = w->x.nx, side_x = w->side[0], side_y = w->side[1];
    const long block = 1 + (1 << 20) / (nx * w->n);
    float *in = malloc((size_t)(block * w->n) * (size_t)nx * sizeof *in);
    float *out = malloc((size_t)block * (size_t)side_x * sizeof *out);
    double *sums = malloc((size_t)nx * sizeof *sums);
    int st = in && out && sums ? OK : err_set(e, E_NOMEM, "%s: %s", w->name, err_text(E_NOMEM));
    for (long y = 0; y < side_y && st == OK; y += block) {
        long here = side_y - y < block ? side_y - y : block;
        st = fits_in_rows(w->in, w->x.index, 0, y * w->n + b, here * w->n, in, e);
        for (long j = 0; j < here && st == OK; j++)
            dither_row(w->n, a, nx, side_x, in + (size_t)(j * w->n) * (size_t)nx, w->share, sums,
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
    struct header h = {0};
    int st = describe(w, e, &h);
    if (st)
        err_set(err, st, "%s: %s", w->name, err_text(st));
    else
        st = fits_out_hdu(w->out, -32, w->side[0], w->side[1], 1, &h, err);
    header_free(&h);
    return st == OK ? write_rows(w, w->phase[e][0], w->phase[e][1], err) : st;
}

/* An empty primary with the HISTORY, then one extension per exposure. */
static int write_all(struct work *w, struct err *e)
{
    const char *inputs[] = {w->name, w->offsets};
    struct header top = {0};
    int st = fits_out_open(&w->out, w->c->out, inputs, w->offsets ? 2 : 1, e);
    if (st)
        return st;
    st = header_history(&top, w->record);
    if (st)
        err_set(e, st, "%s: %s", w->name, err_text(st));
    else
        st = fits_out_hdu(w->out, -32, 0, 0, 1, &top, e);
    header_free(&top);
    progress_begin(&w->bar, "dither", w->count * w->side[1], w->c->quiet);
    for (int i = 0; i < w->count && st == OK; i++)
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
    const char *offsets = NULL;
    const struct program prog = {
        "dither", "Make N x N ideally interlaced exposures from an image of N times smaller pixels.", "[IMAGE]", 0, 1,
        "  simage scene.txt --subpixel 2 -x 0.2 --size 401,401 | dither -n 2 -o four.fits\n"
        "  dither -n 2 fine.fits | addnoise --depth 27.7 | drizzle -x 0.1 --pixfrac 0.5 -o deep.fits\n"
    };
    const struct opt own[] = {
        {"number", 'n', OPT_LONG, &n, 1, DITHER_MAX, "N", "small pixels per pixel and axis: N*N exposures", 0, 0},
        {"offsets", 0, OPT_STR, &offsets, 0, 0, "FILE", "columns DX DY: one exposure a row, multiples of 1/N pixel", 0, 1},
        {0}
    };
    opt_parse(&prog, own, &c, argc, argv);
    struct work w = {.n = (int)n, .c = &c, .name = c.argv[0], .offsets = offsets};
    struct err e;
    if (fits_in_open(&w.in, w.name, c.max_memory, &e))
        die(EXIT_RUN, "%s", e.text);
    int index = fits_in_selected(w.in);
    if (index < 0 || fits_in_hdu(w.in, index)->nz != 1)
        die(EXIT_RUN, "%s: no plain image in it", w.name);
    if (exposure_read(w.in, w.name, index, &w.x, &e))
        die(EXIT_RUN, "%s", e.text);
    if (offsets)
        listed_phases(&w);
    else
        ideal_phases(&w);
    set_sides(&w);
    check_input(&w);
    w.share = w.x.unit == UNIT_RATE ? 1 : 1.0 / w.count;
    if (c.verbose || c.check)
        fprintf(stderr, "dither: %s: %ld x %ld -> %d exposures of %ld x %ld pixels, about %.2g s\n", w.name, w.x.nx, w.x.ny,
                w.count, w.side[0], w.side[1], 2e-9 * w.count * (double)w.x.nx * (double)w.x.ny);
    char *record = opt_record(&prog, own, &c);
    w.record = record;
    if (!c.check && write_all(&w, &e))
        die(EXIT_RUN, "%s", e.text);
    free(record);
    free(w.phase);
    header_free(&w.x.hdr);
    fits_in_close(w.in);
    return EXIT_DONE;
}
