/*
 * drizzle.c - combine exposures on one grid.
 *
 * The output is made in bands of rows; for each band every exposure's rows
 * that reach it are read, in the order of the exposures' keys.
 */
#include "drizzle.h"
#include "err.h"
#include "exposure.h"
#include "imageio.h"
#include "opt.h"
#include "par.h"
#include "progress.h"
#include "sky.h"
#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum units { UNITS_TOTAL, UNITS_MEAN, UNITS_RATE };

enum { BAND_BYTES = 16 << 20, CACHE_BYTES = 4 << 20, CHUNK_PIXELS = 1 << 19, MAX_EXPOSURES = 4096 };

enum maps { MAP_WEIGHT, MAP_VAR, MAP_MASK, MAPS };
enum weighting { WEIGHT_EXPTIME, WEIGHT_MAP, WEIGHT_IVM };

struct request {
    double scale, pixfrac, fill, rotation, size[2], center[2];
    int kernel, units, flat, weighting, turned, sized, centred;
    const char *like;
    struct opt_strs maps[MAPS];
};

/* One exposure. */
struct shot {
    struct fits_in *in, *maps[MAPS];
    int map_index[MAPS];
    struct exposure x;
    char label[400];
    uint64_t key;            /* of the content */
    double area;             /* output pixel / input pixel */
    double w, factor;        /* weight and unit factor of drizzle_rows */
    struct sky *sky;
    struct drizzle_map map;
};

struct work {
    struct request r;
    const struct common *c;
    const char **names;      /* operands, then maps, then like */
    size_t n_names, n;
    struct fits_in **files;  /* operands, then the maps of each kind */
    struct shot *shot;
    long nx, ny;             /* of the output */
    struct header hdr;
    struct sky *sky;
    double total, effective; /* sum of the exposure times; weighted mean of them, s */
    struct progress bar;
};

/* A band of output rows and what is being added to it. */
struct band {
    long y0, ny;
    double *sum;             /* pairs of flux and weight */
    uint32_t *context;       /* planes of ny rows, or NULL */
    double *var;
    float *pix, *map[MAPS];  /* rows of the exposure; inverse variances take the place of weights */
    unsigned char *bad;
    const struct shot *shot;
    struct drizzle_input input;
    uint32_t *plane;
    long parts;
};

/* ---- reading headers ---- */

static const char *const map_names[MAPS] = {"weight", "var", "mask"};

/* Maps of a file: the images named WHT, VAR or DQ, else its exposures. */
static void list_maps(const struct fits_in *f, const char *name, enum maps kind, int **list, size_t *n)
{
    static const char *const extname[MAPS] = {"WHT", "VAR", "DQ"};
    struct err e;
    if (exposure_list(f, name, list, n, &e))
        die(EXIT_RUN, "%s", e.text);
    const size_t length = strlen(name);
    if (length && name[length - 1] == ']')
        return;
    int *found = malloc((size_t)fits_in_count(f) * sizeof *found);
    if (!found)
        die(EXIT_RUN, "%s: %s", name, err_text(E_NOMEM));
    size_t k = 0;
    for (int i = 0; i < fits_in_count(f); i++)
        if (fits_in_hdu(f, i)->is_image && strcasecmp(fits_in_hdu(f, i)->extname, extname[kind]) == 0)
            found[k++] = i;
    if (k == 0) {
        free(found);
        return;
    }
    free(*list);
    *list = found;
    *n = k;
}

static struct fits_in *open_file(const struct work *w, const char *name)
{
    struct err e;
    struct fits_in *f;
    if (fits_in_open(&f, name, w->c->max_memory, &e))
        die(EXIT_RUN, "%s", e.text);
    return f;
}

/* The maps of one kind of operand k, for its n exposures from shot on. */
static void add_maps(struct work *w, size_t k, enum maps kind, struct shot *shot, size_t n)
{
    const char *name = w->r.maps[kind].v[k];
    int *list;
    size_t count;
    struct fits_in *f = w->files[(1 + (size_t)kind) * (size_t)w->c->argc + k] = open_file(w, name);
    list_maps(f, name, kind, &list, &count);
    if (count != n)
        die(EXIT_RUN, "%s: %zu %s images for %zu exposures of %s", name, count, map_names[kind], n, w->c->argv[k]);
    for (size_t i = 0; i < n; i++) {
        const struct hdu *h = fits_in_hdu(f, list[i]);
        shot[i].maps[kind] = f;
        shot[i].map_index[kind] = list[i];
        if (h->nx != shot[i].x.nx || h->ny != shot[i].x.ny)
            die(EXIT_RUN, "%s: the %s image is %ld x %ld, the exposure %ld x %ld", shot[i].label, map_names[kind], h->nx, h->ny,
                shot[i].x.nx, shot[i].x.ny);
    }
    free(list);
}

/* All exposures of one operand. */
static void add_file(struct work *w, size_t k)
{
    const char *name = w->c->argv[k];
    struct err e;
    int *list;
    size_t n;
    struct fits_in *in = w->files[k] = open_file(w, name);
    if (exposure_list(in, name, &list, &n, &e))
        die(EXIT_RUN, "%s", e.text);
    if (w->n + n > MAX_EXPOSURES)
        die(EXIT_RUN, "%s: more than %d exposures", name, MAX_EXPOSURES);
    struct shot *more = realloc(w->shot, (w->n + n) * sizeof *more);
    if (!more)
        die(EXIT_RUN, "%s: %s", name, err_text(E_NOMEM));
    w->shot = more;
    for (size_t i = 0; i < n; i++) {
        struct shot *s = &w->shot[w->n + i];
        *s = (struct shot){.in = in};
        exposure_label(in, name, list[i], s->label, sizeof s->label);
        if (exposure_read(in, name, list[i], &s->x, &e))
            die(EXIT_RUN, "%s", e.text);
        if (sky_open(&s->sky, &s->x.hdr, &e))
            die(EXIT_RUN, "%s: no usable WCS: %s", s->label, e.text);
    }
    for (int kind = 0; kind < MAPS; kind++)
        if (w->r.maps[kind].n)
            add_maps(w, k, (enum maps)kind, &w->shot[w->n], n);
    w->n += n;
    free(list);
}

/* ---- order of the exposures ---- */

/* n bytes, a multiple of 4: FNV-1a over words, folded. */
static void hash(uint64_t *key, const void *data, size_t n)
{
    const unsigned char *p = data;
    for (size_t i = 0; i < n; i += 4) {
        uint32_t word;
        memcpy(&word, p + i, 4);
        *key = (*key ^ word) * 0x100000001B3u;
        *key ^= *key >> 32;
    }
}

static void hash_pixels(uint64_t *key, struct fits_in *f, int index, long nx, long ny)
{
    const long rows = 1 + CHUNK_PIXELS / nx;
    struct err e;
    float *pix = malloc((size_t)rows * (size_t)nx * sizeof *pix);
    if (!pix)
        die(EXIT_RUN, "%s", err_text(E_NOMEM));
    for (long y = 0; y < ny; y += rows) {
        long here = ny - y < rows ? ny - y : rows;
        if (fits_in_rows(f, index, 0, y, here, pix, &e))
            die(EXIT_RUN, "%s", e.text);
        hash(key, pix, (size_t)here * (size_t)nx * sizeof *pix);
    }
    free(pix);
}

static int by_key(const void *a, const void *b)
{
    const struct shot *p = a, *q = b;
    if (p->x.expnum != q->x.expnum)
        return p->x.expnum < q->x.expnum ? -1 : 1;
    return p->key < q->key ? -1 : p->key > q->key;
}

/* By EXPNUM; where that does not tell exposures apart, by their content. Never by name or place. */
static void sort_shots(struct work *w)
{
    qsort(w->shot, w->n, sizeof *w->shot, by_key);
    int tie = 0;
    for (size_t i = 1; i < w->n; i++)
        tie |= w->shot[i].x.expnum == w->shot[i - 1].x.expnum;
    for (size_t i = 0; i < w->n && tie; i++) {
        struct shot *s = &w->shot[i];
        s->key = 0xCBF29CE484222325u;
        for (size_t k = 0; k < s->x.hdr.n; k++)
            hash(&s->key, s->x.hdr.card[k], 80);
        hash_pixels(&s->key, s->in, s->x.index, s->x.nx, s->x.ny);
        for (int kind = 0; kind < MAPS; kind++)
            if (s->maps[kind])
                hash_pixels(&s->key, s->maps[kind], s->map_index[kind], s->x.nx, s->x.ny);
    }
    qsort(w->shot, w->n, sizeof *w->shot, by_key);
}

/* Operands and maps in the order of their first exposures, for the record. */
static void sort_names(struct work *w)
{
    const size_t n = (size_t)w->c->argc;
    const char **argv = malloc((1 + MAPS) * n * sizeof *argv);
    if (!argv)
        die(EXIT_RUN, "%s", err_text(E_NOMEM));
    size_t k = 0;
    for (size_t i = 0; i < w->n; i++)
        for (size_t f = 0; f < n; f++)
            if (w->c->argv[f] && w->shot[i].in == w->files[f]) {
                argv[k] = w->c->argv[f];
                for (size_t kind = 0; kind < MAPS; kind++)
                    argv[(1 + kind) * n + k] = w->r.maps[kind].n ? w->r.maps[kind].v[f] : NULL;
                k++;
                w->c->argv[f] = NULL;
            }
    memcpy(w->c->argv, argv, n * sizeof *argv);
    for (size_t kind = 0; kind < MAPS; kind++)
        if (w->r.maps[kind].n)
            memcpy(w->r.maps[kind].v, argv + (1 + kind) * n, n * sizeof *argv);
    free(argv);
}

static void set(int *st, int now)
{
    if (*st == OK)
        *st = now;
}

/* ---- the output grid ---- */

struct pair {
    struct sky *from, *to;
    double *ra;              /* scratch, 2 * cap */
    size_t cap;
};

static int through_sky(void *ctx, size_t n, const double *x, const double *y, double *X, double *Y)
{
    struct pair *p = ctx;
    if (n > p->cap) {
        double *more = realloc(p->ra, 2 * n * sizeof *more);
        if (!more)
            return E_NOMEM;
        p->ra = more;
        p->cap = n;
    }
    int st = sky_from_pixel(p->from, n, x, y, p->ra, p->ra + n);
    return st ? st : sky_to_pixel(p->to, n, p->ra, p->ra + n, X, Y);
}

static void make_maps(struct work *w)
{
    struct err e;
    sky_close(w->sky);
    if (sky_open(&w->sky, &w->hdr, &e))
        die(EXIT_RUN, "output grid: no usable WCS: %s", e.text);
    for (size_t i = 0; i < w->n; i++) {
        struct shot *s = &w->shot[i];
        struct pair p = {.from = s->sky, .to = w->sky};
        drizzle_map_free(&s->map);
        int st = drizzle_map_make(&s->map, s->x.nx, s->x.ny, through_sky, &p);
        free(p.ra);
        if (st)
            die(EXIT_RUN, "%s: cannot be mapped to the output grid: %s", s->label, err_text(st));
        const double ratio = s->map.node_x ? 1 / s->map.scale : sky_scale(w->sky) / sky_scale(s->sky);
        s->area = ratio * ratio;
    }
}

/*
 * A TAN around --center, else the first exposure's middle, its y axis --rotation
 * degrees from north through east; of --size, else to be grown.
 */
static void chosen_grid(struct work *w, double scale)
{
    const struct shot *first = &w->shot[0];
    const struct request *r = &w->r;
    const double x = 0.5 * (double)(first->x.nx - 1), y = 0.5 * (double)(first->x.ny - 1);
    const double turn = (r->turned ? r->rotation : 0) * (M_PI / 180), c = scale / 3600 * cos(turn), s = scale / 3600 * sin(turn);
    double at[2] = {r->center[0], r->center[1]};
    if (!r->centred && sky_from_pixel(first->sky, 1, &x, &y, &at[0], &at[1]))
        die(EXIT_RUN, "%s: its middle is not on the sky: give --center", first->label);
    w->nx = r->sized ? (long)r->size[0] : 1;
    w->ny = r->sized ? (long)r->size[1] : 1;
    exposure_remove_wcs(&w->hdr);
    int st = sky_set_tan(&w->hdr, scale, 0.5 * (double)(w->nx + 1), 0.5 * (double)(w->ny + 1), at[0], at[1]);
    set(&st, header_set_double(&w->hdr, "CD1_1", -c, "deg per pixel"));
    set(&st, header_set_double(&w->hdr, "CD1_2", s, "deg per pixel"));
    set(&st, header_set_double(&w->hdr, "CD2_1", s, "deg per pixel"));
    set(&st, header_set_double(&w->hdr, "CD2_2", c, "deg per pixel"));
    if (st)
        die(EXIT_RUN, "output grid: %s", err_text(st));
}

/* Grid of the first exposure, finer by the ratio of the scales, grown by whole pixels to hold every drop. */
static void own_grid(struct work *w)
{
    const struct shot *first = &w->shot[0];
    const double in = sky_scale(first->sky), out = isnan(w->r.scale) ? in : w->r.scale;
    int st = exposure_rescale_wcs(&w->hdr, 0, 0, out / in);
    if (st == OK && !sky_is_linear(first->sky)) {
        double crval[2], crpix[2];
        crpix[0] = header_double_or(&w->hdr, "CRPIX1", NAN);
        crpix[1] = header_double_or(&w->hdr, "CRPIX2", NAN);
        crval[0] = header_double_or(&w->hdr, "CRVAL1", NAN);
        crval[1] = header_double_or(&w->hdr, "CRVAL2", NAN);
        exposure_remove_wcs(&w->hdr);
        st = sky_set_tan(&w->hdr, out, crpix[0], crpix[1], crval[0], crval[1]);
    }
    if (st)
        die(EXIT_RUN, "%s: %s", first->label, err_text(st));
    if (w->r.turned || w->r.sized || w->r.centred)
        chosen_grid(w, out);
    make_maps(w);
    if (w->r.sized)
        return;
    const double half = w->r.kernel == DRIZZLE_POINT ? 0 : 0.5 * w->r.pixfrac;
    double least[2] = {0, 0}, most[2] = {0, 0};
    for (size_t i = 0; i < w->n; i++) {
        const struct shot *s = &w->shot[i];
        double lo[2], hi[2];
        const double slack = s->map.node_x ? 2e-3 : 4e-6;
        drizzle_map_bounds(&s->map, -half, -half, (double)(s->x.nx - 1) + half, (double)(s->x.ny - 1) + half, lo, hi);
        for (int k = 0; k < 2; k++) {
            least[k] = fmin(least[k], floor(lo[k] + slack + 0.5));
            most[k] = fmax(most[k], ceil(hi[k] - slack + 0.5) - 1);
        }
    }
    const double side[2] = {most[0] - least[0] + 1, most[1] - least[1] + 1};
    if (!(side[0] <= 65535 && side[1] <= 65535))
        die(EXIT_RUN, "output grid: %.0f x %.0f pixels, more than 65535 per side: give --like or a larger --pixscale",
            side[0], side[1]);
    w->nx = (long)side[0];
    w->ny = (long)side[1];
    for (int k = 0; k < 2 && st == OK; k++) {
        const char *key = k ? "CRPIX2" : "CRPIX1";
        st = header_set_double(&w->hdr, key, header_double_or(&w->hdr, key, 0) - least[k], NULL);
    }
    if (st)
        die(EXIT_RUN, "output grid: %s", err_text(st));
    if (least[0] < 0 || least[1] < 0)
        make_maps(w);
}

static void grid_like(struct work *w)
{
    struct err e;
    struct fits_in *f = open_file(w, w->r.like);
    struct header h = {0};
    const int index = fits_in_selected(f);
    if (index < 0)
        die(EXIT_RUN, "%s: no image in it", w->r.like);
    if (fits_in_header(f, index, &h, &e))
        die(EXIT_RUN, "%s", e.text);
    w->nx = fits_in_hdu(f, index)->nx;
    w->ny = fits_in_hdu(f, index)->ny;
    exposure_remove_wcs(&w->hdr);
    int st = exposure_copy_wcs(&w->hdr, &h);
    if (st)
        die(EXIT_RUN, "%s: %s", w->r.like, err_text(st));
    header_free(&h);
    fits_in_close(f);
    make_maps(w);
}

/* ---- units, weights, keywords ---- */

static int by_area(const void *a, const void *b)
{
    const double p = *(const double *)a, q = *(const double *)b;
    return (p > q) - (p < q);
}

/* The lower median, so that exposures of other scales do not decide. */
static double median_area(const struct work *w)
{
    double *v = malloc(w->n * sizeof *v);
    if (!v)
        die(EXIT_RUN, "%s", err_text(E_NOMEM));
    for (size_t i = 0; i < w->n; i++)
        v[i] = w->shot[i].area;
    qsort(v, w->n, sizeof *v, by_area);
    double m = v[(w->n - 1) / 2];
    free(v);
    return m;
}

/* AB magnitude of one unit per second; NaN when unknown. */
static double zero_point(const struct exposure *x)
{
    return x->unit == UNIT_RATE ? x->magzero : x->magzero - 2.5 * log10(x->exptime);
}

/* Exposures that are added must be in the same photometric system. */
static void check_alike(const struct work *w)
{
    const struct shot *a = &w->shot[0];
    for (size_t i = 1; i < w->n; i++) {
        const struct shot *b = &w->shot[i];
        if (b->x.unit != a->x.unit)
            die(EXIT_RUN, "%s: BUNIT differs from that of %s", b->label, a->label);
        if (fabs(zero_point(&b->x) - zero_point(&a->x)) > 1e-4)
            die(EXIT_RUN, "%s: MAGZERO less 2.5 log10(EXPTIME) is %.4f, that of %s %.4f: scale one of them", b->label,
                zero_point(&b->x), a->label, zero_point(&a->x));
        if (fabs(b->x.gain - a->x.gain) > 1e-6 * a->x.gain)
            die(EXIT_RUN, "%s: GAIN %g, that of %s %g: scale one of them", b->label, b->x.gain, a->label, a->x.gain);
    }
}

static void set_units(struct work *w)
{
    double times = 0, weights = 0;
    w->total = 0;
    check_alike(w);
    for (size_t i = 0; i < w->n; i++) {
        w->total += w->shot[i].x.exptime;              /* NaN when one is missing */
    }
    if (w->r.units < 0)
        w->r.units = isnan(w->total) ? UNITS_MEAN : UNITS_TOTAL;
    if (isnan(w->total) && w->r.units != UNITS_MEAN)
        die(EXIT_RUN, "keyword EXPTIME is missing: --units mean needs none");
    const double area = median_area(w);
    for (size_t i = 0; i < w->n; i++) {
        struct shot *s = &w->shot[i];
        const double time = s->x.unit == UNIT_RATE ? 1 : s->x.exptime;
        s->factor = w->r.units == UNITS_MEAN ? area
                  : w->r.units == UNITS_RATE ? s->area / time : s->area * (w->total / time);
        s->w = w->r.weighting == WEIGHT_IVM ? 1 / (s->factor * s->factor)
             : w->r.weighting == WEIGHT_MAP || isnan(w->total) ? 1 : s->x.exptime;
        times += s->w * s->x.exptime;
        weights += s->w;
    }
    w->effective = times / weights;
}

static const char *const kernel_names[] = {"square", "point", "turbo", "gaussian", "lanczos2", "lanczos3"};

/* Mean of a keyword of the exposures in units of the output; NaN when one lacks it. */
static double mean_level(const struct work *w, const char *key)
{
    double sum = 0, weights = 0;
    for (size_t i = 0; i < w->n; i++) {
        const struct shot *s = &w->shot[i];
        sum += s->w * s->factor * header_double_or(&s->x.hdr, key, NAN);
        weights += s->w;
    }
    return sum / weights;
}

/* Pixels are independent where every drop falls on one of them alone. */
static double noise_factor(const struct work *w)
{
    const enum drizzle_kernel kernel = (enum drizzle_kernel)w->r.kernel;
    int split = 0;
    for (size_t i = 0; i < w->n && !split; i++)
        split = drizzle_splits(kernel, w->r.pixfrac, &w->shot[i].map, w->shot[i].x.nx, w->shot[i].x.ny);
    return split ? drizzle_noise_factor(kernel, w->r.pixfrac, w->shot[0].map.scale) : 1;
}

static const char *weight_type(const struct work *w)
{
    return w->r.weighting == WEIGHT_IVM ? "IVM" : w->r.weighting == WEIGHT_MAP ? "MAP" : isnan(w->total) ? "NUMBER" : "EXPTIME";
}

static void describe(struct work *w, const char *record)
{
    static const char *const gone[] = {"DITHERX", "DITHERY", "EXPNUM", "EXTNAME", "EXTVER", "SKYLEVEL", "SATURATE"};
    const struct exposure *x = &w->shot[0].x;
    struct header *h = &w->hdr;
    const double gain = header_double_or(h, "GAIN", 1), level = mean_level(w, "SKYLEVEL");
    const double full = mean_level(w, "SATURATE");
    const int rate_in = x->unit == UNIT_RATE, rate_out = w->r.units == UNITS_RATE || (rate_in && w->r.units == UNITS_MEAN);
    const double time = rate_out ? 1 : w->r.units == UNITS_MEAN ? w->effective : w->total;
    for (size_t i = 0; i < sizeof gone / sizeof *gone; i++)
        header_remove(h, gone[i]);
    int st = OK;
    if (x->unit == UNIT_ELECTRON || rate_in)
        set(&st, header_set_str(h, "BUNIT", rate_out ? "electron/s" : "electron", NULL));
    if (!isnan(w->total)) {
        set(&st, header_set_double(h, "EXPTIME", w->total, "exposure time, s"));
        set(&st, header_set_double(h, "TOTTIME", w->total, "time of all exposures together, s"));
        set(&st, header_set_double(h, "GAIN", gain * (w->total / time), "electron per BUNIT"));
        if (!isnan(x->magzero)) {
            const double zero = x->magzero - (rate_in ? 0 : 2.5 * log10(x->exptime));
            set(&st, header_set_double(h, "MAGZERO", zero + 2.5 * log10(time), "AB magnitude of 1 BUNIT"));
        }
    }
    if (!isnan(level))
        set(&st, header_set_double(h, "SKYLEVEL", level, "mean sky and dark per pixel, BUNIT"));
    if (!isnan(full))
        set(&st, header_set_double(h, "SATURATE", full, "saturation level, BUNIT"));
    set(&st, header_set_double(h, "PIXSCALE", sky_scale(w->sky), "arcsec per pixel"));
    set(&st, header_set_double(h, "PIXFRAC", w->r.pixfrac, "side of a drop, input pixels"));
    set(&st, header_set_str(h, "KERNEL", kernel_names[w->r.kernel], "shape of a drop"));
    set(&st, header_set_str(h, "WHTTYPE", weight_type(w), "unit of the weight"));
    set(&st, header_set_long(h, "NCOMBINE", (long)w->n, "exposures"));
    set(&st, header_set_double(h, "NOISECOR", noise_factor(w), "noise of large areas over that of pixels"));
    set(&st, header_history(h, record));
    if (st)
        die(EXIT_RUN, "header: %s", err_text(st));
}

/* ---- bands ---- */

/* Part `i` of the band gets its share of the rows in b->input. */
static int add_parts(void *ctx, long begin, long end, int worker)
{
    (void)worker;
    struct band *b = ((void **)ctx)[0];
    const struct work *w = ((void **)ctx)[1];
    int st = OK;
    for (long i = begin; i < end && st == OK; i++) {
        const long from = b->ny * i / b->parts, to = b->ny * (i + 1) / b->parts;
        const size_t at = (size_t)from * (size_t)w->nx;
        struct drizzle_band part = {
            .nx = w->nx, .y0 = b->y0 + from, .ny = to - from, .sum = b->sum + 2 * at,
            .context = b->plane ? b->plane + at : NULL, .var = b->var ? b->var + at : NULL,
        };
        if (to > from)
            st = drizzle_rows((enum drizzle_kernel)w->r.kernel, w->r.pixfrac, &b->shot->map, &b->input, &part);
    }
    return st;
}

/* Rows *first..*end-1 of an exposure hold all that an affine map sends to rows low..high of the output. */
static void needed_rows(const struct shot *s, double low, double high, long *first, long *end)
{
    const struct drizzle_map *m = &s->map;
    *first = 0;
    *end = s->x.ny;
    if (m->node_x || !(fabs(m->yy) > 1e-12))
        return;
    const double across = m->yx * (double)(s->x.nx - 1), lean = fmin(0, across), rest = fmax(0, across);
    const double p = (low - rest - m->y0) / m->yy, q = (high - lean - m->y0) / m->yy;
    *first = (long)fmax(0, fmin(floor(fmin(p, q)), (double)s->x.ny));
    *end = (long)fmin((double)s->x.ny, fmax(ceil(fmax(p, q)) + 1, 0));
}

/* The weights of the n pixels read; masks become bytes. */
static const float *choose_weights(const struct work *w, struct band *b, size_t n)
{
    float *weight = b->map[MAP_WEIGHT], *var = b->map[MAP_VAR], *mask = b->map[MAP_MASK];
    for (size_t i = 0; i < n && mask; i++)
        b->bad[i] = !(mask[i] <= 0 && mask[i] >= 0);
    if (w->r.weighting == WEIGHT_EXPTIME)
        return weight;
    for (size_t i = 0; i < n && !w->r.maps[MAP_WEIGHT].n; i++)
        weight[i] = 1 / var[i];
    return weight;
}

/* All rows of one exposure that reach the band. */
static int add_shot(struct work *w, struct band *b, const struct shot *s, struct err *e)
{
    const long rows = 1 + CHUNK_PIXELS / s->x.nx;
    const double reach = drizzle_reach((enum drizzle_kernel)w->r.kernel, w->r.pixfrac, &s->map) + 1;
    void *ctx[2] = {b, w};
    long first, end;
    b->shot = s;
    needed_rows(s, (double)b->y0 - reach, (double)(b->y0 + b->ny) + reach, &first, &end);
    for (long y = first; y < end; y += rows) {
        const long here = end - y < rows ? end - y : rows;
        double lo[2], hi[2];
        drizzle_map_bounds(&s->map, -0.5, (double)y - 0.5, (double)s->x.nx - 0.5, (double)(y + here) - 0.5, lo, hi);
        if (hi[1] < (double)b->y0 - reach || lo[1] > (double)(b->y0 + b->ny) + reach)
            continue;
        int st = fits_in_rows(s->in, s->x.index, 0, y, here, b->pix, e);
        for (int kind = 0; kind < MAPS && st == OK; kind++)
            if (s->maps[kind])
                st = fits_in_rows(s->maps[kind], s->map_index[kind], 0, y, here, b->map[kind], e);
        if (st)
            return st;
        const float *weight = choose_weights(w, b, (size_t)here * (size_t)s->x.nx);
        b->input = (struct drizzle_input){
            .nx = s->x.nx, .y0 = y, .ny = here, .pix = b->pix, .weight = weight, .var = b->var ? b->map[MAP_VAR] : NULL,
            .bad = s->maps[MAP_MASK] ? b->bad : NULL, .w = s->w, .scale = s->factor, .bit = (uint32_t)1 << ((s - w->shot) & 31),
        };
        st = par_for(b->parts, 1, w->c->threads, add_parts, ctx);
        if (st)
            return err_set(e, st, "%s: %s", s->label, err_text(st));
    }
    return OK;
}

/* Temporary files of what comes after SCI. */
struct spool {
    FILE *weight, *var, **context;
    size_t planes;
};

static int spool_open(struct spool *sp, size_t planes, int var, struct err *e)
{
    sp->context = calloc(planes ? planes : 1, sizeof *sp->context);
    sp->planes = planes;
    sp->weight = tmpfile();
    int good = sp->context && sp->weight && (!var || (sp->var = tmpfile()));
    for (size_t p = 0; p < planes && good; p++)
        good = (sp->context[p] = tmpfile()) != NULL;
    return good ? OK : err_set(e, E_IO, "temporary file: %s", strerror(errno));
}

static void spool_close(struct spool *sp)
{
    if (sp->weight)
        fclose(sp->weight);
    if (sp->var)
        fclose(sp->var);
    for (size_t p = 0; p < sp->planes && sp->context; p++)
        if (sp->context[p])
            fclose(sp->context[p]);
    free(sp->context);
}

static int spool_add(FILE *f, const void *data, size_t n, struct err *e)
{
    return fwrite(data, 4, n, f) == n ? OK : err_set(e, E_IO, "temporary file: %s", strerror(errno));
}

/* SCI of one band to the output, WHT and CTX to their spools. */
static int write_band(const struct work *w, struct band *b, struct fits_out *out, struct spool *sp, struct err *e)
{
    const size_t n = (size_t)b->ny * (size_t)w->nx;
    float *v = malloc(n * sizeof *v);
    if (!v)
        return err_set(e, E_NOMEM, "output: %s", err_text(E_NOMEM));
    for (size_t i = 0; i < n; i++)
        v[i] = b->sum[2 * i + 1] != 0 ? (float)(b->sum[2 * i] / b->sum[2 * i + 1]) : (float)w->r.fill;
    int st = fits_out_rows(out, b->ny, v, e);
    if (st == OK && sp->weight) {
        for (size_t i = 0; i < n; i++)
            v[i] = (float)b->sum[2 * i + 1];
        st = spool_add(sp->weight, v, n, e);
        for (size_t i = 0; i < n && sp->var; i++)
            v[i] = b->sum[2 * i + 1] != 0 ? (float)(b->var[i] / (b->sum[2 * i + 1] * b->sum[2 * i + 1])) : (float)w->r.fill;
        if (st == OK && sp->var)
            st = spool_add(sp->var, v, n, e);
        for (size_t p = 0; p < sp->planes && st == OK; p++)
            st = spool_add(sp->context[p], b->context + p * n, n, e);
    }
    free(v);
    return st;
}

/* One spooled plane to the open HDU. */
static int copy_plane(const struct work *w, FILE *f, int whole, struct fits_out *out, struct err *e)
{
    const size_t nx = (size_t)w->nx;
    void *row = malloc(nx * 4);
    int st = row ? OK : err_set(e, E_NOMEM, "output: %s", err_text(E_NOMEM));
    if (st == OK && (fflush(f) || fseek(f, 0, SEEK_SET)))
        st = err_set(e, E_IO, "temporary file: %s", strerror(errno));
    for (long y = 0; y < w->ny && st == OK; y++) {
        if (fread(row, 4, nx, f) != nx)
            st = err_set(e, E_IO, "temporary file: cannot read back");
        else
            st = whole ? fits_out_rows_int(out, 1, row, e) : fits_out_rows(out, 1, row, e);
    }
    free(row);
    return st;
}

static int write_rest(const struct work *w, struct spool *sp, struct fits_out *out, struct err *e)
{
    struct header h = {0};
    int st = exposure_copy_wcs(&h, &w->hdr);
    set(&st, header_set_str(&h, "EXTNAME", "WHT", NULL));
    set(&st, header_set_str(&h, "WHTTYPE", weight_type(w), "unit of the weight"));
    if (st)
        return err_set(e, st, "header: %s", err_text(st));
    st = fits_out_hdu(out, -32, w->nx, w->ny, 1, &h, e);
    if (st == OK)
        st = copy_plane(w, sp->weight, 0, out, e);
    if (st == OK && sp->var) {
        header_remove(&h, "WHTTYPE");
        st = header_set_str(&h, "EXTNAME", "VAR", "variance of SCI, BUNIT squared");
        if (st == OK)
            st = fits_out_hdu(out, -32, w->nx, w->ny, 1, &h, e);
        if (st == OK)
            st = copy_plane(w, sp->var, 0, out, e);
    }
    if (st == OK && sp->planes) {
        header_remove(&h, "WHTTYPE");
        st = header_set_str(&h, "EXTNAME", "CTX", "bit i of plane p: exposure 32 p + i");
        if (st == OK)
            st = fits_out_hdu(out, 32, w->nx, w->ny, (long)sp->planes, &h, e);
    }
    for (size_t p = 0; p < sp->planes && st == OK; p++)
        st = copy_plane(w, sp->context[p], 1, out, e);
    header_free(&h);
    return st;
}

static void *room(size_t n, size_t size)
{
    void *p = calloc(n ? n : 1, size);
    if (!p)
        die(EXIT_RUN, "%s", err_text(E_NOMEM));
    return p;
}

static long widest(const struct work *w)
{
    long nx = 1;
    for (size_t i = 0; i < w->n; i++)
        nx = w->shot[i].x.nx > nx ? w->shot[i].x.nx : nx;
    return nx;
}

/* 1 when rows of every exposure fall on rows of the output: no row is read for two bands. */
static int upright(const struct work *w)
{
    for (size_t i = 0; i < w->n; i++)
        if (w->shot[i].map.node_x || w->shot[i].map.yx != 0)
            return 0;
    return 1;
}

/* SCI, band by band. */
static int fill_bands(struct work *w, struct fits_out *out, struct spool *sp, struct err *e)
{
    const size_t cell = (sp->var ? 3 : 2) * sizeof(double) + sp->planes * sizeof(uint32_t);
    long rows = (long)((upright(w) ? CACHE_BYTES : BAND_BYTES) / ((size_t)w->nx * cell));
    rows = rows < 16 ? 16 : rows > w->ny ? w->ny : rows;
    const size_t n = (size_t)rows * (size_t)w->nx, chunk = (size_t)(CHUNK_PIXELS + widest(w));
    struct band b = {.parts = w->c->threads};
    b.sum = room(2 * n, sizeof *b.sum);
    b.context = sp->planes ? room(n * sp->planes, sizeof *b.context) : NULL;
    b.pix = room(chunk, sizeof *b.pix);
    for (int kind = 0; kind < MAPS; kind++)
        if (w->r.maps[kind].n || (kind == MAP_WEIGHT && w->r.weighting != WEIGHT_EXPTIME))
            b.map[kind] = room(chunk, sizeof *b.map[kind]);
    b.bad = b.map[MAP_MASK] ? room(chunk, sizeof *b.bad) : NULL;
    b.var = sp->var ? room(n, sizeof *b.var) : NULL;
    int st = OK;
    for (b.y0 = 0; b.y0 < w->ny && st == OK; b.y0 += rows) {
        b.ny = w->ny - b.y0 < rows ? w->ny - b.y0 : rows;
        const size_t here = (size_t)b.ny * (size_t)w->nx;
        memset(b.sum, 0, 2 * here * sizeof *b.sum);
        if (b.var)
            memset(b.var, 0, here * sizeof *b.var);
        if (b.context)
            memset(b.context, 0, here * sp->planes * sizeof *b.context);
        for (size_t i = 0; i < w->n && st == OK; i++) {
            b.plane = b.context ? b.context + i / 32 * here : NULL;
            st = add_shot(w, &b, &w->shot[i], e);
            progress_tick(&w->bar, b.ny);
        }
        if (st == OK)
            st = write_band(w, &b, out, sp, e);
    }
    free(b.sum);
    free(b.context);
    free(b.var);
    free(b.bad);
    free(b.pix);
    for (int kind = 0; kind < MAPS; kind++)
        free(b.map[kind]);
    return st;
}

static int write_all(struct work *w, struct err *e)
{
    struct fits_out *out = NULL;
    struct spool sp = {0};
    struct header h = {0}, top = {0};
    int st = fits_out_open(&out, w->c->out, w->names, w->n_names, e);
    if (st)
        return st;
    if (!w->r.flat)
        st = spool_open(&sp, w->n > 1 ? (w->n + 31) / 32 : 0, w->r.maps[MAP_VAR].n > 0, e);
    progress_begin(&w->bar, "drizzle", (long)w->n * w->ny, w->c->quiet);
    if (st == OK) {
        st = header_copy(&h, &w->hdr);
        if (st == OK && !w->r.flat) {
            st = header_set_str(&h, "EXTNAME", "SCI", NULL);
            if (st == OK)
                st = fits_out_hdu(out, -32, 0, 0, 1, &top, e);
        }
        st = st ? err_set(e, st, "header: %s", err_text(st)) : fits_out_hdu(out, -32, w->nx, w->ny, 1, &h, e);
    }
    if (st == OK)
        st = fill_bands(w, out, &sp, e);
    if (st == OK && sp.weight)
        st = write_rest(w, &sp, out, e);
    progress_end(&w->bar);
    spool_close(&sp);
    header_free(&h);
    if (st == OK)
        return fits_out_commit(out, e);
    fits_out_abandon(out);
    return st;
}

static void plan(const struct work *w)
{
    double pixels = 0;
    long grids = 0;
    for (size_t i = 0; i < w->n; i++) {
        pixels += (double)w->shot[i].x.nx * (double)w->shot[i].x.ny;
        grids += w->shot[i].map.node_x != NULL;
    }
    fprintf(stderr, "drizzle: %zu exposures, %.4g Mpixel, %ld of them through a grid; output %ld x %ld of %.6g arcsec, "
            "%s, pixfrac %g, noise factor %.4f\n", w->n, pixels * 1e-6, grids, w->nx, w->ny, sky_scale(w->sky),
            kernel_names[w->r.kernel], w->r.pixfrac, header_double_or(&w->hdr, "NOISECOR", 1));
}

/* Everything that opens or closes files stands here, in order. */
static void run(struct work *w, const struct program *prog, const struct opt *own)
{
    const size_t n = (size_t)w->c->argc;
    struct err e;
    w->names = room((1 + MAPS) * n + 1, sizeof *w->names);
    w->files = room((1 + MAPS) * n, sizeof *w->files);
    for (size_t i = 0; i < n; i++)
        w->names[w->n_names++] = w->c->argv[i];
    for (int kind = 0; kind < MAPS; kind++)
        for (size_t i = 0; i < w->r.maps[kind].n; i++)
            w->names[w->n_names++] = w->r.maps[kind].v[i];
    if (w->r.like)
        w->names[w->n_names++] = w->r.like;
    for (size_t i = 0; i < n; i++)
        add_file(w, i);
    sort_shots(w);
    sort_names(w);
    if (header_copy(&w->hdr, &w->shot[0].x.hdr))
        die(EXIT_RUN, "%s", err_text(E_NOMEM));
    if (w->r.like)
        grid_like(w);
    else
        own_grid(w);
    set_units(w);
    char *record = opt_record(prog, own, w->c);
    describe(w, record);
    if (w->c->verbose || w->c->check)
        plan(w);
    if (!w->c->check && write_all(w, &e))
        die(EXIT_RUN, "%s", e.text);
    free(record);
    for (size_t i = 0; i < w->n; i++) {
        sky_close(w->shot[i].sky);
        drizzle_map_free(&w->shot[i].map);
        header_free(&w->shot[i].x.hdr);
    }
    for (size_t i = 0; i < (1 + MAPS) * n; i++)
        if (w->files[i])
            fits_in_close(w->files[i]);
    sky_close(w->sky);
    header_free(&w->hdr);
    free(w->shot);
    free(w->files);
    free(w->names);
}

static void check_options(struct request *r, const struct opt *own, const struct common *c)
{
    r->turned = opt_given(own, c, "rotation");
    r->sized = opt_given(own, c, "size");
    r->centred = opt_given(own, c, "center");
    if (r->like && (!isnan(r->scale) || r->turned || r->sized || r->centred))
        die(EXIT_USAGE, "--like and --pixscale, --rotation, --size, --center both set the grid: give one");
    if (r->sized && (r->size[0] != floor(r->size[0]) || r->size[1] != floor(r->size[1])))
        die(EXIT_USAGE, "--size takes whole numbers");
    if (r->centred && !(fabs(r->center[1]) <= 90))
        die(EXIT_USAGE, "--center: declination is -90 to 90 degrees");
    for (int kind = 0; kind < MAPS; kind++)
        if (r->maps[kind].n && r->maps[kind].n != (size_t)c->argc)
            die(EXIT_USAGE, "--%s was given %zu times for %d operands", map_names[kind], r->maps[kind].n, c->argc);
    if (!opt_given(own, c, "weight-type"))
        r->weighting = r->maps[MAP_WEIGHT].n ? WEIGHT_MAP : WEIGHT_EXPTIME;
    if (r->weighting == WEIGHT_MAP && !r->maps[MAP_WEIGHT].n)
        die(EXIT_USAGE, "--weight-type map needs --weight");
    if (r->weighting == WEIGHT_IVM && !r->maps[MAP_WEIGHT].n && !r->maps[MAP_VAR].n)
        die(EXIT_USAGE, "--weight-type ivm needs --weight or --var");
}

int main(int argc, char **argv)
{
    struct common c = COMMON_DEFAULTS;
    struct work w = {.c = &c, .r = {.scale = NAN, .pixfrac = 1, .fill = NAN, .units = -1}};
    struct request *r = &w.r;
    const struct program prog = {
        "drizzle", "Combine exposures on one grid by variable-pixel linear reconstruction.", "[EXPOSURES...]", 0, -1,
        "  drizzle four.fits -x 0.1 --pixfrac 0.5 -o deep.fits\n"
        "  drizzle a.fits b.fits --weight a.fits[WHT] --weight b.fits[WHT] --like grid.fits --flat -o deep.fits\n"
    };
    const struct opt own[] = {
        {"pixscale", 'x', OPT_REAL, &r->scale, 1e-9, 1e6, "ARCSEC", "output pixel, arcsec; default the first exposure's", 0, 0},
        {"pixfrac", 0, OPT_REAL, &r->pixfrac, 0, 8, "P", "side of a drop, input pixels", 0, 0},
        {"kernel", 0, OPT_CHOICE, &r->kernel, 0, 0, 0, "shape of a drop", "square|point|turbo|gaussian|lanczos2|lanczos3", 0},
        {"like", 0, OPT_STR, &r->like, 0, 0, "FILE", "take size and WCS of the output from this image", 0, 1},
        {"rotation", 0, OPT_REAL, &r->rotation, -360, 360, "DEG", "direction of the output's y axis, from north to east", 0, 0},
        {"size", 0, OPT_PAIR, r->size, 1, 65535, "NX,NY", "output pixels; default all that holds a drop", 0, 0},
        {"center", 0, OPT_PAIR, r->center, -360, 360, "RA,DEC", "middle of the output, deg; default the first exposure's", 0, 0},
        {"weight", 'w', OPT_STRS, &r->maps[MAP_WEIGHT], 0, 0, "FILE", "weight map; once per operand, same order", 0, 1},
        {"var", 0, OPT_STRS, &r->maps[MAP_VAR], 0, 0, "FILE", "variance map, likewise: write VAR", 0, 1},
        {"mask", 0, OPT_STRS, &r->maps[MAP_MASK], 0, 0, "FILE", "bad pixels, not 0, likewise", 0, 1},
        {"weight-type", 0, OPT_CHOICE, &r->weighting, 0, 0, 0, "meaning of the weight; default map with --weight, else exptime",
         "exptime|map|ivm", 0},
        {"units", 0, OPT_CHOICE, &r->units, 0, 0, 0, "of SCI; default total when EXPTIME is known", "total|mean|rate", 0},
        {"fill", 0, OPT_REAL, &r->fill, -1e38, 1e38, "V", "value of pixels without weight; default NaN", 0, 0},
        {"flat", 0, OPT_FLAG, &r->flat, 0, 0, 0, "write SCI alone, as primary image", 0, 0},
        {0}
    };
    opt_parse(&prog, own, &c, argc, argv);
    check_options(r, own, &c);
    run(&w, &prog, own);
    opt_free(own);
    return EXIT_DONE;
}
