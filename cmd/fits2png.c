/*
 * fits2png - a picture of a FITS image: asinh stretch from the median and the
 * 16th percentile, y upwards (north up in this project's images), blank pixels
 * transparent.  The file is read twice, a block of rows at a time.
 */
#include "err.h"
#include "imageio.h"
#include "opt.h"
#include "outfile.h"
#include "picture.h"
#include "png.h"
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

enum { SAMPLE = 1 << 20, ROWS = 64 };

struct view {
    const char *in, *out;      /* file names */
    struct fits_in *f;
    int index;
    long nx, ny;               /* of the image */
    long x0, y0, cx, cy;       /* the part shown, from 0 */
    long zoom;
    int holes;                 /* the part has pixels that are not finite */
    struct picture levels;
};

static void *need(void *p)
{
    if (!p)
        die(EXIT_RUN, "%s", err_text(E_NOMEM));
    return p;
}

/* --crop X0,Y0,NX,NY in FITS pixels, or everything. */
static void set_crop(struct view *v, const struct opt_reals *crop)
{
    if (crop->n == 0)
        return;
    if (crop->n != 4)
        die(EXIT_USAGE, "--crop: four numbers are needed: X0,Y0,NX,NY");
    for (size_t i = 0; i < 4; i++)
        if (crop->v[i] != floor(crop->v[i]))
            die(EXIT_USAGE, "--crop: %g is not a whole number", crop->v[i]);
    v->x0 = (long)crop->v[0] - 1;
    v->y0 = (long)crop->v[1] - 1;
    v->cx = (long)crop->v[2];
    v->cy = (long)crop->v[3];
    if (v->x0 + v->cx > v->nx || v->y0 + v->cy > v->ny)
        die(EXIT_RUN, "%s: --crop: the image has only %ld x %ld pixels", v->in, v->nx, v->ny);
}

/* Every k-th pixel of the part, at most SAMPLE of them, and whether there are holes. */
static void set_levels(struct view *v)
{
    struct err e;
    size_t total = (size_t)v->cx * (size_t)v->cy, k = (total + SAMPLE - 1) / SAMPLE, n = 0;
    float *row = need(malloc(ROWS * (size_t)v->nx * sizeof *row));
    float *sample = need(malloc((total / k + 1) * sizeof *sample));
    for (long y = 0; y < v->cy; y += ROWS) {
        long rows = v->cy - y < ROWS ? v->cy - y : ROWS;
        if (fits_in_rows(v->f, v->index, 0, v->y0 + y, rows, row, &e))
            die(EXIT_RUN, "%s", e.text);
        for (long j = 0; j < rows; j++)
            for (long i = 0; i < v->cx; i++) {
                float p = row[j * v->nx + v->x0 + i];
                v->holes |= !isfinite(p);
                if ((size_t)((y + j) * v->cx + i) % k == 0)
                    sample[n++] = p;
            }
    }
    int st = picture_levels(&v->levels, sample, n);
    free(sample);
    free(row);
    if (st)
        die(EXIT_RUN, "%s: --low and --high leave no range of values to show (%g to %g)", v->in,
            v->levels.low, v->levels.high);
}

/* One row of pixels as `zoom` rows of the picture. */
static int put_row(const struct view *v, struct png *png, const float *row, unsigned char *grey,
                   unsigned char *line)
{
    size_t n = (size_t)v->cx, zoom = (size_t)v->zoom, k = 0;
    unsigned char *alpha = v->holes ? grey + n : NULL;
    picture_row(&v->levels, row + v->x0, n, grey, alpha);
    for (size_t i = 0; i < n; i++)
        for (size_t z = 0; z < zoom; z++) {
            line[k++] = grey[i];
            if (alpha)
                line[k++] = alpha[i];
        }
    int st = OK;
    for (size_t z = 0; z < zoom && !st; z++)
        st = png_row(png, line);
    return st;
}

static void cannot_write(const struct view *v, int st, struct err *e)
{
    const char *why = st == E_IO ? strerror(errno) : err_text(st);
    err_set(e, st, "%s: cannot write: %s", strcmp(v->out, "-") ? v->out : "standard output", why);
}

/* Rows from the top, which is the end of the file. */
static int put_picture(const struct view *v, struct outfile *o, struct err *e)
{
    struct png *png;
    int st = png_open(&png, o, v->cx * v->zoom, v->cy * v->zoom, v->holes);
    if (st) {
        cannot_write(v, st, e);
        return st;
    }
    float *row = need(malloc(ROWS * (size_t)v->nx * sizeof *row));
    unsigned char *grey = need(malloc(2 * (size_t)v->cx));
    unsigned char *line = need(malloc(2 * (size_t)v->cx * (size_t)v->zoom));
    for (long end = v->cy; end > 0 && !st; end -= ROWS) {
        long rows = end < ROWS ? end : ROWS;
        st = fits_in_rows(v->f, v->index, 0, v->y0 + end - rows, rows, row, e);
        for (long j = rows; j-- > 0 && !st;)
            if ((st = put_row(v, png, row + j * v->nx, grey, line)))
                cannot_write(v, st, e);
    }
    free(row);
    free(grey);
    free(line);
    if (st)
        png_abandon(png);
    else if ((st = png_finish(png)))
        cannot_write(v, st, e);
    return st;
}

static void open_image(struct view *v, double max_memory)
{
    struct err e;
    if (fits_in_open(&v->f, v->in, max_memory, &e))
        die(EXIT_RUN, "%s", e.text);
    v->index = fits_in_selected(v->f);
    const struct hdu *h = fits_in_hdu(v->f, v->index);
    float none;
    if ((!h || !h->is_image) && fits_in_rows(v->f, v->index, 0, 0, 0, &none, &e))
        die(EXIT_RUN, "%s", e.text);
    v->nx = v->cx = h->nx;
    v->ny = v->cy = h->ny;
}

int main(int argc, char **argv)
{
    struct common c = COMMON_DEFAULTS;
    struct view v = {.zoom = 1, .levels = {.low = NAN, .high = NAN}};
    struct opt_reals crop = {0};
    int stretch = STRETCH_ASINH;
    struct err e;

    const struct program prog = {
        "fits2png", "make a picture of an image", "[IMAGE]", 0, 1,
        "  fits2png image.fits -o image.png\n"
        "  fits2png --zoom 4 --crop 11,21,100,80 image.fits -o part.png\n", OUT_ANY
    };
    const struct opt own[] = {
        {"low", 'l', OPT_REAL, &v.levels.low, -1e38, 1e38, "VALUE", "value shown black, in the image's unit (median - 2 sigma)", NULL, 0},
        {"high", 'u', OPT_REAL, &v.levels.high, -1e38, 1e38, "VALUE", "value shown white (99.9th percentile)", NULL, 0},
        {"stretch", 0, OPT_CHOICE, &stretch, 0, 0, "KIND", "asinh, linear or log", "asinh|linear|log", 0},
        {"zoom", 0, OPT_LONG, &v.zoom, 1, 64, "N", "N x N dots of the picture for a pixel", NULL, 0},
        {"crop", 0, OPT_REALS, &crop, 1, 65535, "X0,Y0,NX,NY", "first pixel (from 1) and size of the part shown", NULL, 0},
        {0}
    };
    opt_parse(&prog, own, &c, argc, argv);
    v.in = c.argv[0];
    v.out = c.out;
    v.levels.stretch = (enum stretch)stretch;
    int standard = !strcmp(c.out, "-");
    size_t len = strlen(c.out);
    if (!standard && (len < 5 || strcasecmp(c.out + len - 4, ".png")))
        die(EXIT_USAGE, "%s: only PNG is written: the name must end in .png", c.out);
    if (standard && !c.check && isatty(STDOUT_FILENO))
        die(EXIT_USAGE, "standard output is a terminal: redirect it or use -o FILE.png");

    open_image(&v, c.max_memory);
    set_crop(&v, &crop);
    set_levels(&v);
    if (c.verbose || c.check)
        fprintf(stderr, "fits2png: %s: %ld x %ld pixels, black %g, white %g, picture %ld x %ld\n", v.in,
                v.cx, v.cy, v.levels.low, v.levels.high, v.cx * v.zoom, v.cy * v.zoom);
    if (!c.check) {
        struct outfile *o;
        if (outfile_open(&o, c.out, &v.in, 1, &e))
            die(EXIT_RUN, "%s", e.text);
        int st = put_picture(&v, o, &e);
        if (st)
            outfile_abandon(o);
        else
            st = outfile_commit(o, &e);
        if (st)
            die(EXIT_RUN, "%s", e.text);
    }
    fits_in_close(v.f);
    opt_free(own);
    return EXIT_DONE;
}
