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
    long (*phase)[2];          /* their displacements, whole small pixels */
    double (*rest)[2];         /* and what remains, 0 <= rest < 1 */
    long skip[2];              /* pixels left out at the beginning of all, for negative displacements */
    long side[2];              /* pixels of every exposure */
    double peak, error;        /* of the exposure: largest value, largest part that the shift may miss */
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
    char seed[72];
    if (header_str(&w->x.hdr, "NOISSEED", seed, sizeof seed) == OK)
        warn("%s: has noise already (NOISSEED): its exposures will share it, and have less than they should", w->name);
    if (w->side[0] < 1 || w->side[1] < 1)
        die(EXIT_RUN, "%s: %ld x %ld pixels are too few for displaced pixels of %d x %d: no exposure would have one", w->name,
            w->x.nx, w->x.ny, w->n, w->n);
}

static void make_room(struct work *w, size_t n)
{
    w->count = (int)n;
    w->phase = calloc(n, sizeof *w->phase);
    w->rest = calloc(n, sizeof *w->rest);
    if (!w->phase || !w->rest)
        die(EXIT_RUN, "%s", err_text(E_NOMEM));
}

/* All N x N phases. */
static void ideal_phases(struct work *w)
{
    make_room(w, (size_t)(w->n * w->n));
    for (int e = 0; e < w->count; e++) {
        int a, b;
        dither_phase(e, w->n, &a, &b);
        w->phase[e][0] = a;
        w->phase[e][1] = b;
    }
}

/* Columns DX DY of a list, pixels of the exposure; within 1e-6 pixel of a small pixel's multiple they are that. */
static void listed_phases(struct work *w)
{
    static const char *const name[2] = {"DX", "DY"};
    struct table t = {0};
    struct err e;
    if (table_read(&t, w->offsets, w->c->max_memory, &e))
        die(EXIT_RUN, "%s", e.text);
    if (t.nrow < 1 || t.nrow > 4096)
        die(EXIT_RUN, "%s: %zu offsets: 1 to 4096 are possible", w->offsets, t.nrow);
    make_room(w, t.nrow);
    for (int k = 0; k < 2; k++) {
        const struct column *c = table_find(&t, name[k]);
        if (!c)
            die(EXIT_RUN, "%s: column %s is missing", w->offsets, name[k]);
        for (size_t i = 0; i < t.nrow; i++) {
            const double v = table_number(c, i) * w->n, nearest = floor(v + 0.5);
            if (!(fabs(v) <= 1e6))
                die(EXIT_RUN, "%s: row %zu: offsets are -1e6 to 1e6 small pixels", w->offsets, i + 1);
            const int whole = fabs(v - nearest) <= 1e-6 * w->n;
            w->phase[i][k] = (long)(whole ? nearest : floor(v));
            w->rest[i][k] = whole ? 0 : v - floor(v);
        }
    }
    table_free(&t);
}

/* The same pixels for all: what every displacement leaves. */
static void set_sides(struct work *w)
{
    const long size[2] = {w->x.nx, w->x.ny};
    for (int k = 0; k < 2; k++) {
        long most = 0, least = 0;
        for (int e = 0; e < w->count; e++) {
            const long from = w->phase[e][k], to = from + (w->rest[e][k] > 0);
            most = to > most ? to : most;
            least = from < least ? from : least;
        }
        w->skip[k] = (w->n - 1 - least) / w->n;
        most += w->skip[k] * w->n;
        w->side[k] = size[k] > most ? (size[k] - most) / w->n : 0;
        for (int e = 0; e < w->count; e++)
            w->phase[e][k] += w->skip[k] * w->n;
    }
}

/* Header of exposure e, at phase (a,b). */
static int describe(const struct work *w, int e, struct header *h)
{
    const struct exposure *x = &w->x;
    const double n = w->n, middle = 0.5 * (n - 1);
    const double a = (double)w->phase[e][0] + w->rest[e][0], b = (double)w->phase[e][1] + w->rest[e][1];
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
        st = header_set_double(h, "DITHERX", a / n - (double)w->skip[0], "displacement of the grid, pixels");
    if (st == OK)
        st = header_set_double(h, "DITHERY", b / n - (double)w->skip[1], "displacement of the grid, pixels");
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

/* What moves an exposure: sums along y and x, and what they may miss. */
struct shift {
    struct dither_axis y, x, rest_y, rest_x;
};

struct lines {
    float *rows, *out;         /* of the input, mirrored where there are none; of the exposure */
    double *sum, *missed, *padded, *cells;
};

/* sum[x] = sum of the weighted rows. */
static void add_rows(const struct dither_axis *a, const float *rows, long nx, double *sum)
{
    for (long x = 0; x < nx; x++)
        sum[x] = 0;
    for (int t = 0; t < a->n; t++, rows += nx)
        for (long x = 0; x < nx; x++)
            sum[x] += a->w[t] * (double)rows[x];
}

/* One row of an exposure from the rows that begin DITHER_REACH - 1 before its own. */
static void shift_row(struct work *w, const struct shift *s, const struct lines *l, const float *rows, long a, float *out)
{
    const long nx = w->x.nx, side = w->side[0];
    const float *at = rows + (DITHER_REACH - 1) * nx;
    const struct dither_axis *missed[2][2] = {{&s->y, &s->rest_x}, {&s->rest_y, &s->x}};
    add_rows(&s->y, at + s->y.first * nx, nx, l->sum);
    dither_cells(&s->x, w->n, a, nx, side, l->sum, w->share, l->padded, l->cells);
    for (long i = 0; i < side; i++) {
        out[i] = (float)l->cells[i];
        w->peak = fmax(w->peak, fabs(l->cells[i]));
    }
    for (int k = 0; k < 2; k++) {
        if (missed[k][k == 0]->n == 0)
            continue;
        add_rows(missed[k][0], at + missed[k][0]->first * nx, nx, l->missed);
        dither_cells(missed[k][1], w->n, a, nx, side, l->missed, w->share, l->padded, l->cells);
        for (long i = 0; i < side; i++)
            w->error = fmax(w->error, fabs(l->cells[i]));
    }
}

/* Rows first .. first + n - 1 of the input, mirrored at its borders. */
static int read_mirrored(struct work *w, long first, long n, float *rows, struct err *e)
{
    const long nx = w->x.nx, ny = w->x.ny, low = first < 0 ? 0 : first, high = first + n > ny ? ny : first + n;
    int st = OK;
    if (low < high)
        st = fits_in_rows(w->in, w->x.index, 0, low, high - low, rows + (low - first) * nx, e);
    for (long y = first; y < first + n && st == OK; y++)
        if (y < low || y >= high)
            st = fits_in_rows(w->in, w->x.index, 0, dither_mirror(y, ny), 1, rows + (y - first) * nx, e);
    return st;
}

/* The rows of one exposure between small pixels. */
static int write_shifted(struct work *w, int exposure, struct err *e)
{
    const long nx = w->x.nx, side_x = w->side[0], side_y = w->side[1], more = 2 * DITHER_REACH - 1;
    const long block = 1 + (1 << 20) / (nx * w->n), a = w->phase[exposure][0], b = w->phase[exposure][1];
    const size_t room = (size_t)nx + 4 * DITHER_REACH + DITHER_MAX;
    struct shift s = {.rest_x.n = 0};
    struct lines l = {
        .rows = malloc((size_t)(block * w->n + more) * (size_t)nx * sizeof *l.rows),
        .out = malloc((size_t)block * (size_t)side_x * sizeof *l.out),
        .sum = malloc((size_t)nx * sizeof *l.sum), .missed = malloc((size_t)nx * sizeof *l.missed),
        .padded = malloc(room * sizeof *l.padded), .cells = malloc((size_t)side_x * sizeof *l.cells),
    };
    dither_sum(w->n, w->rest[exposure][0], &s.x);
    dither_sum(w->n, w->rest[exposure][1], &s.y);
    if (w->rest[exposure][0] > 0)
        dither_rest(w->n, &s.rest_x);
    if (w->rest[exposure][1] > 0)
        dither_rest(w->n, &s.rest_y);
    w->peak = w->error = 0;
    int st = l.rows && l.out && l.sum && l.missed && l.padded && l.cells ? OK
                                                                        : err_set(e, E_NOMEM, "%s: %s", w->name, err_text(E_NOMEM));
    for (long y = 0; y < side_y && st == OK; y += block) {
        const long here = side_y - y < block ? side_y - y : block;
        st = read_mirrored(w, y * w->n + b - (DITHER_REACH - 1), here * w->n + more, l.rows, e);
        for (long j = 0; j < here && st == OK; j++)
            shift_row(w, &s, &l, l.rows + j * w->n * nx, a, l.out + j * side_x);
        if (st == OK)
            st = fits_out_rows(w->out, here, l.out, e);
        progress_tick(&w->bar, here);
    }
    free(l.rows);
    free(l.out);
    free(l.sum);
    free(l.missed);
    free(l.padded);
    free(l.cells);
    return st;
}

/* What lies between small pixels is as good as the image is smooth. */
static void tell_error(const struct work *w, int e)
{
    const double part = w->peak > 0 ? w->error / w->peak : 0;
    if (part > 1e-2)
        warn("%s: exposure %d: its shift may be wrong by %.1e of the peak: render smaller pixels", w->name, e + 1, part);
    else if (w->c->verbose)
        fprintf(stderr, "dither: %s: exposure %d: shift right to about %.1e of the peak\n", w->name, e + 1, part);
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
    if (st)
        return st;
    if (!(w->rest[e][0] > 0 || w->rest[e][1] > 0))
        return write_rows(w, w->phase[e][0], w->phase[e][1], err);
    st = write_shifted(w, e, err);
    if (st == OK && !w->c->quiet)
        tell_error(w, e);
    return st;
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
        "dither", "make N x N ideally interlaced exposures from an image of N times smaller pixels", "[IMAGE]", 0, 1,
        "  simage stars.txt --subpixel 2 -x 0.2 --size 401,401 | dither -n 2 -o four.fits\n"
        "  dither -n 2 fine.fits | addnoise --depth 27.7 | drizzle -x 0.1 --pixfrac 0.5 -o deep.fits\n", OUT_FITS
    };
    const struct opt own[] = {
        {"number", 'n', OPT_LONG, &n, 1, DITHER_MAX, "N", "small pixels per pixel and axis: N*N exposures", 0, 0},
        {"offsets", 0, OPT_STR, &offsets, 0, 0, "FILE", "columns DX DY, pixels: one exposure a row", 0, 1},
        {0}
    };
    opt_parse(&prog, own, &c, argc, argv);
    struct work w = {.n = (int)n, .c = &c, .name = c.argv[0], .offsets = offsets};
    struct err e;
    if (fits_in_open(&w.in, w.name, c.max_memory, &e))
        die(EXIT_RUN, "%s", e.text);
    int index;
    if (fits_in_single(w.in, &index, &e))
        die(EXIT_RUN, "%s", e.text);
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
                w.count, w.side[0], w.side[1], 1.2e-9 * w.count * (double)w.x.nx * (double)w.x.ny);
    char *record = opt_record(&prog, own, &c);
    w.record = record;
    if (!c.check && write_all(&w, &e))
        die(EXIT_RUN, "%s", e.text);
    free(record);
    free(w.phase);
    free(w.rest);
    header_free(&w.x.hdr);
    fits_in_close(w.in);
    return EXIT_DONE;
}
