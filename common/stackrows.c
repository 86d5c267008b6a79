/*
 * stackrows.c - the sums of a stack and its file, band by band of output rows:
 * for each band the rows of every exposure that reach it are read, in order.
 */
#include "par.h"
#include "simd.h"
#include "stack.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BAND_BYTES = 16 << 20, CACHE_BYTES = 1 << 20, CHUNK_PIXELS = 1 << 19 };

/* A band of output rows and what is being added to it. */
struct band {
    const struct stack *stack;
    long y0, ny;
    size_t planes;           /* of the context */
    double *sum;             /* pairs of flux and weight */
    uint32_t *context;       /* planes of ny rows, or NULL */
    double *var;
    float *out[3];           /* SCI, WHT, VAR of the band; the last two may be NULL */
    float *pix, *map[STACK_MAPS];  /* rows of the exposure; inverse variances take the place of weights */
    unsigned char *bad;
    long chunk;              /* pixels they have room for, besides one row */
    const struct shot *shot;
    struct drizzle_input input;
    uint32_t *plane;
    long parts;
};

/* HDUs of the output. */
struct target {
    struct fits_out *out;
    int slot[3], context;    /* SCI, WHT, VAR, CTX; -1 when not wanted */
};

/* ---- sums ---- */

/* Part `i` of the band gets its share of the rows in b->input. */
static int add_parts(void *ctx, long begin, long end, int worker)
{
    (void)worker;
    const struct band *b = ctx;
    const long nx = b->stack->nx;
    int st = OK;
    for (long i = begin; i < end && st == OK; i++) {
        const long from = b->ny * i / b->parts, to = b->ny * (i + 1) / b->parts;
        const size_t at = (size_t)from * (size_t)nx;
        struct drizzle_band part = {
            .nx = nx, .y0 = b->y0 + from, .ny = to - from, .sum = b->sum + 2 * at,
            .context = b->plane ? b->plane + at : NULL, .var = b->var ? b->var + at : NULL,
        };
        if (to > from)
            st = drizzle_rows(b->stack->choice.kernel, b->stack->choice.pixfrac, &b->shot->map, &b->input, &part);
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
static const float *choose_weights(const struct stack_choice *c, struct band *b, size_t n)
{
    float *weight = b->map[MAP_WEIGHT], *var = b->map[MAP_VAR], *mask = b->map[MAP_MASK];
    for (size_t i = 0; i < n && mask; i++)
        b->bad[i] = !(mask[i] <= 0 && mask[i] >= 0);
    if (c->weighting == WEIGHT_EXPTIME)
        return weight;
    for (size_t i = 0; i < n && !c->maps[MAP_WEIGHT].n; i++)
        weight[i] = 1 / var[i];
    return weight;
}

/* All rows of one exposure that reach the band. */
static int add_shot(struct band *b, const struct shot *t, struct err *e)
{
    const struct stack *s = b->stack;
    const long rows = 1 + b->chunk / t->x.nx;
    const double reach = drizzle_reach(s->choice.kernel, s->choice.pixfrac, &t->map) + 1;
    long first, end;
    b->shot = t;
    needed_rows(t, (double)b->y0 - reach, (double)(b->y0 + b->ny) + reach, &first, &end);
    for (long y = first; y < end; y += rows) {
        const long here = end - y < rows ? end - y : rows;
        double lo[2], hi[2];
        drizzle_map_bounds(&t->map, -0.5, (double)y - 0.5, (double)t->x.nx - 0.5, (double)(y + here) - 0.5, lo, hi);
        if (hi[1] < (double)b->y0 - reach || lo[1] > (double)(b->y0 + b->ny) + reach)
            continue;
        int st = fits_in_rows(t->in, t->x.index, 0, y, here, b->pix, e);
        for (int kind = 0; kind < STACK_MAPS && st == OK; kind++)
            if (t->maps[kind])
                st = fits_in_rows(t->maps[kind], t->map_index[kind], 0, y, here, b->map[kind], e);
        if (st)
            return st;
        const float *weight = choose_weights(&s->choice, b, (size_t)here * (size_t)t->x.nx);
        b->input = (struct drizzle_input){
            .nx = t->x.nx, .y0 = y, .ny = here, .pix = b->pix, .weight = weight, .var = b->var ? b->map[MAP_VAR] : NULL,
            .bad = t->maps[MAP_MASK] ? b->bad : NULL, .w = t->w, .scale = t->factor, .bit = (uint32_t)1 << ((t - s->shot) & 31), .comb = &t->comb,
        };
        st = par_for(b->parts, 1, s->choice.threads, add_parts, b);
        if (st)
            return err_set(e, st, "%s: %s", t->label, err_text(st));
    }
    return OK;
}

/* ---- output ---- */

enum { LANES = 16 };

static inline uint64_t bits_of(double v)
{
    uint64_t b;
    memcpy(&b, &v, sizeof b);
    return b;
}

/* Flux times the reciprocal of the weight, `fill` where that is 0. */
static inline float quotient(const double *sum, float fill)
{
    const double w = sum[1];
    return w < 0 || w > 0 ? (float)(sum[0] * (1 / w)) : fill;
}

/* n quotients; neighbours mostly have the same weight. */
WIDE static void divide(const double *restrict sum, size_t n, float fill, float *restrict image)
{
    double inverse = 0;
    uint64_t same = 0;                 /* bits of the weight with that inverse */
    size_t i = 0;
    for (; i + LANES <= n; i += LANES) {
        const double *s = sum + 2 * i;
        if (bits_of(s[1]) != same) {
            same = bits_of(s[1]);
            inverse = 1 / s[1];
        }
        uint64_t differ = 0;
        for (int k = 0; k < LANES; k++)
            differ |= bits_of(s[2 * k + 1]) ^ same;
        if (differ || !(s[1] < 0 || s[1] > 0))
            for (int k = 0; k < LANES; k++)
                image[i + (size_t)k] = quotient(s + 2 * k, fill);
        else
            for (int k = 0; k < LANES; k++)
                image[i + (size_t)k] = (float)(s[2 * k] * inverse);
    }
    for (; i < n; i++)
        image[i] = quotient(sum + 2 * i, fill);
}

/* The weights. */
WIDE static void weights(const double *restrict sum, size_t n, float *restrict weight)
{
    for (size_t i = 0; i < n; i++)
        weight[i] = (float)sum[2 * i + 1];
}

static int write_band(const struct stack *s, struct band *b, struct target *t, struct err *e)
{
    const size_t n = (size_t)b->ny * (size_t)s->nx;
    divide(b->sum, n, (float)s->choice.fill, b->out[0]);
    if (s->choice.flat)
        return fits_out_rows(t->out, b->ny, b->out[0], e);
    weights(b->sum, n, b->out[1]);
    for (size_t i = 0; i < n && b->var; i++)
        b->out[2][i] = b->sum[2 * i + 1] != 0 ? (float)(b->var[i] / (b->sum[2 * i + 1] * b->sum[2 * i + 1])) : (float)s->choice.fill;
    int st = OK;
    for (int k = 0; k < 3 && st == OK; k++)
        if (t->slot[k] >= 0)
            st = fits_out_slot_rows(t->out, t->slot[k], 0, b->y0, b->ny, b->out[k], e);
    for (size_t p = 0; p < b->planes && st == OK; p++)
        st = fits_out_slot_rows(t->out, t->context, (long)p, b->y0, b->ny, b->context + p * n, e);
    return st;
}

/* The HDU of SCI, or all of them; their rows follow. */
static int begin_hdus(const struct stack *s, struct target *t, size_t planes, struct err *e)
{
    static const char *const name[4] = {"SCI", "WHT", "VAR", "CTX"};
    const int wanted[4] = {1, 1, s->choice.maps[MAP_VAR].n > 0, planes > 0};
    struct header top = {0};
    if (s->choice.flat)
        return fits_out_hdu(t->out, -32, s->nx, s->ny, 1, &s->hdr, e);
    int st = fits_out_hdu(t->out, -32, 0, 0, 1, &top, e);
    for (int k = 0; k < 4 && st == OK; k++) {
        struct header h = {0};
        if (!wanted[k])
            continue;
        st = k == 0 ? header_copy(&h, &s->hdr) : exposure_copy_wcs(&h, &s->hdr);
        if (st == OK)
            st = header_set_str(&h, "EXTNAME", name[k], k == 2 ? "variance of SCI, BUNIT squared"
                                                      : k == 3 ? "bit i of plane p: exposure 32 p + i" : NULL);
        if (st == OK && k == 1)
            st = header_set_str(&h, "WHTTYPE", stack_weight_type(s), "unit of the weight");
        if (st)
            err_set(e, st, "header: %s", err_text(st));
        else
            st = fits_out_slot(t->out, k == 3 ? 32 : -32, s->nx, s->ny, k == 3 ? (long)planes : 1, &h,
                               k == 3 ? &t->context : &t->slot[k], e);
        header_free(&h);
    }
    return st;
}

/* ---- bands ---- */

static long widest(const struct stack *s)
{
    long nx = 1;
    for (size_t i = 0; i < s->n; i++)
        nx = s->shot[i].x.nx > nx ? s->shot[i].x.nx : nx;
    return nx;
}

/* 1 when rows of every exposure fall on rows of the output: no row is read for two bands. */
static int upright(const struct stack *s)
{
    for (size_t i = 0; i < s->n; i++)
        if (s->shot[i].map.node_x || s->shot[i].map.yx != 0)
            return 0;
    return 1;
}

static void band_free(struct band *b)
{
    free(b->sum);
    free(b->context);
    free(b->var);
    free(b->bad);
    free(b->pix);
    for (int k = 0; k < 3; k++)
        free(b->out[k]);
    for (int kind = 0; kind < STACK_MAPS; kind++)
        free(b->map[kind]);
}

static void *room(int wanted, size_t n, size_t size, int *st)
{
    void *p = wanted ? malloc(n * size) : NULL;
    if (wanted && !p)
        *st = E_NOMEM;
    return p;
}

/* Memory of a band of at most `rows` rows. */
static int band_make(struct band *b, const struct stack *s, long rows)
{
    const struct stack_choice *c = &s->choice;
    const size_t n = (size_t)rows * (size_t)s->nx, chunk = (size_t)(b->chunk + widest(s));
    int st = OK;
    b->sum = room(1, 2 * n, sizeof *b->sum, &st);
    b->context = room(b->planes > 0, n * b->planes, sizeof *b->context, &st);
    b->var = room(c->maps[MAP_VAR].n && !c->flat, n, sizeof *b->var, &st);
    b->pix = room(1, chunk, sizeof *b->pix, &st);
    for (int kind = 0; kind < STACK_MAPS; kind++)
        b->map[kind] = room(c->maps[kind].n || (kind == MAP_WEIGHT && c->weighting != WEIGHT_EXPTIME), chunk,
                            sizeof *b->map[kind], &st);
    b->bad = room(b->map[MAP_MASK] != NULL, chunk, sizeof *b->bad, &st);
    for (int k = 0; k < 3; k++)
        b->out[k] = room(k == 0 || !c->flat, n, sizeof *b->out[k], &st);
    return st;
}

/* Rows of a band, and pixels read at a time, within the memory of BAND_BYTES for all of it. */
static long band_rows(const struct stack *s, struct band *b)
{
    const int maps = (b->stack->choice.maps[MAP_WEIGHT].n || s->choice.weighting != WEIGHT_EXPTIME)
                   + (s->choice.maps[MAP_VAR].n > 0) + (s->choice.maps[MAP_MASK].n > 0);
    const size_t cell = (s->choice.maps[MAP_VAR].n ? 3 : 2) * sizeof(double) + b->planes * sizeof(uint32_t)
                      + (s->choice.flat ? 1 : 3) * sizeof(float);
    b->chunk = CHUNK_PIXELS / (1 + maps);
    const long rows = (long)((size_t)(upright(s) ? CACHE_BYTES : BAND_BYTES) / ((size_t)s->nx * cell));
    return rows < 16 ? 16 : rows > s->ny ? s->ny : rows;
}

static int fill_bands(struct stack *s, struct target *t, size_t planes, struct err *e)
{
    struct band b = {.stack = s, .planes = planes, .parts = s->choice.threads};
    const long rows = band_rows(s, &b);
    int st = band_make(&b, s, rows);
    for (size_t i = 0; i < s->n; i++)
        drizzle_comb_make(&s->shot[i].comb, s->choice.kernel, s->choice.pixfrac, &s->shot[i].map, s->shot[i].x.nx,
                          s->shot[i].x.ny, s->nx);
    if (st)
        err_set(e, st, "a band of %ld rows: %s", rows, err_text(st));
    for (b.y0 = 0; b.y0 < s->ny && st == OK; b.y0 += rows) {
        b.ny = s->ny - b.y0 < rows ? s->ny - b.y0 : rows;
        const size_t here = (size_t)b.ny * (size_t)s->nx;
        memset(b.sum, 0, 2 * here * sizeof *b.sum);
        if (b.var)
            memset(b.var, 0, here * sizeof *b.var);
        if (b.context)
            memset(b.context, 0, here * planes * sizeof *b.context);
        for (size_t i = 0; i < s->n && st == OK; i++) {
            b.plane = b.context ? b.context + i / 32 * here : NULL;
            st = add_shot(&b, &s->shot[i], e);
            progress_tick(&s->bar, b.ny);
        }
        if (st == OK)
            st = write_band(s, &b, t, e);
    }
    band_free(&b);
    return st;
}

int stack_write(struct stack *s, const char *name, struct err *e)
{
    const struct stack_choice *c = &s->choice;
    const char **inputs = malloc(((1 + STACK_MAPS) * c->files.n + 2) * sizeof *inputs);
    size_t n = 0;
    if (!inputs)
        return err_set(e, E_NOMEM, "%s", err_text(E_NOMEM));
    for (size_t i = 0; i < c->files.n; i++)
        inputs[n++] = c->files.v[i];
    for (int kind = 0; kind < STACK_MAPS; kind++)
        for (size_t i = 0; i < c->maps[kind].n; i++)
            inputs[n++] = c->maps[kind].v[i];
    inputs[n++] = c->like;
    inputs[n++] = c->shifts;
    struct target t = {.slot = {-1, -1, -1}, .context = -1};
    int st = fits_out_open(&t.out, name, inputs, n, e);
    free(inputs);
    if (st)
        return st;
    const size_t planes = c->flat || s->n == 1 ? 0 : (s->n + 31) / 32;
    progress_begin(&s->bar, "drizzle", (long)s->n * s->ny, c->quiet);
    st = begin_hdus(s, &t, planes, e);
    if (st == OK)
        st = fill_bands(s, &t, planes, e);
    progress_end(&s->bar);
    if (st == OK)
        return fits_out_commit(t.out, e);
    fits_out_abandon(t.out);
    return st;
}
