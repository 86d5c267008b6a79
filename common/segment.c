/*
 * segment.c - threshold and connected components; see segment.h.
 *
 * The image is worked through in strips of rows, one strip per task.  Each
 * strip filters its own rows (repeating 2 radius rows at its borders), so strips
 * are independent and their order fixes the result for any number of threads.
 */
#include "segment.h"
#include "grow.h"
#include "par.h"
#include "simd.h"
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STRIP = 128, BLOCK = 64 };

/* ---- filtered rows in order ---- */

struct feeder {
    const struct image *im;
    const struct background *b;
    const float *rms_map;
    const struct smooth *filter;
    int negative;
    long next;             /* the row that enters the ring next */
    float *plain;          /* ring of 2r+1 rows above background, each with r zeros at both ends */
    float *across;         /* ring of 2r+1 rows filtered along x */
    const float **window;  /* 2r+1 pointers for the column filter */
    float *zero;           /* nx zeros */
};

static void feeder_free(struct feeder *f)
{
    free(f->plain);
    free(f->across);
    free(f->window);
    free(f->zero);
}

static int feeder_open(struct feeder *f, long y0)
{
    size_t nx = (size_t)f->im->nx, r = (size_t)f->filter->radius, n = 2 * r + 1;
    f->plain = calloc(n * (nx + 2 * r), sizeof(float));
    f->across = malloc(n * nx * sizeof(float));
    f->window = malloc(n * sizeof *f->window);
    f->zero = calloc(nx, sizeof(float));
    if (!f->plain || !f->across || !f->window || !f->zero) {
        feeder_free(f);
        return E_NOMEM;
    }
    f->next = y0 - (long)r;
    return OK;
}

WIDE static void blank_bad(const float *restrict rms, long n, float *restrict v)
{
    for (long i = 0; i < n; i++)
        v[i] = rms[i] <= FLT_MAX ? v[i] : 0;
}

WIDE static void negate(long n, float *v)
{
    for (long i = 0; i < n; i++)
        v[i] = -v[i];
}

static size_t ring_place(const struct feeder *f, long y)
{
    long n = 2 * f->filter->radius + 1;
    return (size_t)(((y % n) + n) % n);
}

static float *plain_row(const struct feeder *f, long y)
{
    size_t r = (size_t)f->filter->radius;
    return f->plain + ring_place(f, y) * ((size_t)f->im->nx + 2 * r) + r;
}

static float *across_row(const struct feeder *f, long y)
{
    return f->across + ring_place(f, y) * (size_t)f->im->nx;
}

/* Row y above background (0 where bad) into the rings. */
static void feeder_take(struct feeder *f, long y)
{
    long nx = f->im->nx, r = f->filter->radius;
    if (y < 0 || y >= f->im->ny)
        return;
    float *plain = plain_row(f, y);
    size_t at = (size_t)y * (size_t)nx;
    background_subtract(f->b, f->im->pix + at, y, 0, nx, 0, plain);
    if (f->rms_map)
        blank_bad(f->rms_map + at, nx, plain);
    if (f->negative)
        negate(nx, plain);
    if (r == 0)
        return;
    smooth_row(f->filter, plain, nx, across_row(f, y));
}

/* Filtered row y into out; *plain the same row unfiltered. Rows come in order. */
static void feeder_row(struct feeder *f, long y, float *out, const float **plain)
{
    long nx = f->im->nx, r = f->filter->radius;
    while (f->next <= y + r)
        feeder_take(f, f->next++);
    *plain = plain_row(f, y);
    if (r == 0) {
        memcpy(out, *plain, (size_t)nx * sizeof(float));
        return;
    }
    for (long j = -r; j <= r; j++)
        f->window[j + r] = y + j < 0 || y + j >= f->im->ny ? f->zero : across_row(f, y + j);
    smooth_column(f->filter, f->window, nx, out);
}

int segment_filtered(const struct image *im, const struct background *b, const float *rms_map,
                     const struct smooth *filter, int negative, long y0, long n, float *out)
{
    struct feeder f = {.im = im, .b = b, .rms_map = rms_map, .filter = filter, .negative = negative};
    int st = feeder_open(&f, y0);
    if (st)
        return st;
    const float *plain;
    for (long y = y0; y < y0 + n; y++)
        feeder_row(&f, y, out + (size_t)(y - y0) * (size_t)im->nx, &plain);
    feeder_free(&f);
    return OK;
}

/* ---- runs of one strip ---- */

struct strip {
    size_t nrun, cap_run, npix, cap_smooth, cap_value;
    struct run *run;
    float *smooth, *value;
};

struct search {
    const struct image *im;
    const struct background *b;
    const struct smooth *filter;
    const struct segment_params *p;
    struct strip *strip;
    struct feeder *feeder;     /* one per worker */
    float **smooth;            /* a row for each worker */
};

static void strip_free(struct strip *s)
{
    free(s->run);
    free(s->smooth);
    free(s->value);
    *s = (struct strip){0};
}

/* How many of the BLOCK values exceed the threshold. */
WIDE static int count_above(const float *v, float threshold)
{
    int n = 0;
    for (int i = 0; i < BLOCK; i++)
        n += v[i] > threshold;
    return n;
}

/* v = 0 where it does not exceed k * rms; bad pixels have infinite rms. */
WIDE static void cut_by_map(const float *restrict rms, float k, long n, float *restrict v)
{
    for (long i = 0; i < n; i++)
        v[i] = v[i] > k * rms[i] ? v[i] : 0;
}

static int add_run(struct strip *s, long y, long x0, long x1, const float *smooth, const float *plain)
{
    size_t n = (size_t)(x1 - x0);
    int st = grow(&s->run, &s->cap_run, s->nrun + 1, sizeof *s->run);
    if (!st)
        st = grow(&s->smooth, &s->cap_smooth, s->npix + n, sizeof *s->smooth);
    if (!st)
        st = grow(&s->value, &s->cap_value, s->npix + n, sizeof *s->value);
    if (st)
        return st;
    s->run[s->nrun++] = (struct run){(int32_t)y, (int32_t)x0, (int32_t)x1, -1, s->npix};
    memcpy(s->smooth + s->npix, smooth + x0, n * sizeof *smooth);
    memcpy(s->value + s->npix, plain + x0, n * sizeof *plain);
    s->npix += n;
    return OK;
}

/* Runs of one row. raw: the image's row, whose pixels that are not finite end a run. */
static int scan_row(struct strip *s, long y, long nx, float threshold, const float *raw,
                    const float *smooth, const float *plain)
{
    long start = -1;
    for (long x = 0; x < nx; x += BLOCK) {
        long end = nx - x < BLOCK ? nx : x + BLOCK;
        if (start < 0 && end - x == BLOCK && count_above(smooth + x, threshold) == 0)
            continue;
        for (long i = x; i < end; i++) {
            int above = smooth[i] > threshold && fabsf(raw[i]) <= FLT_MAX;
            if (above && start < 0)
                start = i;
            if (!above && start >= 0) {
                int st = add_run(s, y, start, i, smooth, plain);
                if (st)
                    return st;
                start = -1;
            }
        }
    }
    return start >= 0 ? add_run(s, y, start, nx, smooth, plain) : OK;
}

/* One strip with a feeder that is open. */
static int search_strip(const struct search *s, long i, struct feeder *f, float *smooth)
{
    const struct segment_params *p = s->p;
    long nx = s->im->nx, y0 = i * STRIP, y1 = y0 + STRIP < s->im->ny ? y0 + STRIP : s->im->ny;
    int st = OK;
    f->next = y0 - f->filter->radius;
    for (long y = y0; y < y1 && !st; y++) {
        const float *plain, *raw = s->im->pix + (size_t)y * (size_t)nx;
        feeder_row(f, y, smooth, &plain);
        if (p->rms_map)
            cut_by_map(p->rms_map + (size_t)y * (size_t)nx, (float)p->threshold, nx, smooth);
        st = scan_row(&s->strip[i], y, nx, p->rms_map ? 0 : (float)(p->threshold * p->noise), raw, smooth, plain);
    }
    return st;
}

static int search_strips(void *ctx, long begin, long end, int worker)
{
    const struct search *s = ctx;
    struct feeder *f = &s->feeder[worker];
    if (!f->im) {
        *f = (struct feeder){.im = s->im, .b = s->b, .rms_map = s->p->rms_map, .filter = s->filter,
                             .negative = s->p->negative};
        int st = feeder_open(f, 0);
        if (st) {
            *f = (struct feeder){0};
            return st;
        }
    }
    if (!s->smooth[worker] && !(s->smooth[worker] = malloc((size_t)s->im->nx * sizeof(float))))
        return E_NOMEM;
    int st = OK;
    for (long i = begin; i < end && !st; i++)
        st = search_strip(s, i, f, s->smooth[worker]);
    return st;
}

/* Search with scratch for every worker. */
static int search_all(struct search *s, long n)
{
    size_t workers = (size_t)s->p->threads;
    s->feeder = calloc(workers, sizeof *s->feeder);
    s->smooth = calloc(workers, sizeof *s->smooth);
    int st = s->feeder && s->smooth ? par_for(n, 1, s->p->threads, search_strips, s) : E_NOMEM;
    for (size_t i = 0; i < workers && s->feeder; i++)
        feeder_free(&s->feeder[i]);
    for (size_t i = 0; i < workers && s->smooth; i++)
        free(s->smooth[i]);
    free(s->feeder);
    free(s->smooth);
    return st;
}

/* All strips end to end; strips are freed on the way. */
static int join_strips(struct segments *s, struct strip *strip, long n)
{
    for (long i = 0; i < n; i++) {
        s->nrun += strip[i].nrun;
        s->npix += strip[i].npix;
    }
    s->run = malloc((s->nrun + 1) * sizeof *s->run);
    s->smooth = malloc((s->npix + 1) * sizeof *s->smooth);
    s->value = malloc((s->npix + 1) * sizeof *s->value);
    if (!s->run || !s->smooth || !s->value)
        return E_NOMEM;
    size_t run = 0, pix = 0;
    for (long i = 0; i < n; i++) {
        struct strip *t = &strip[i];
        for (size_t k = 0; k < t->nrun; k++) {
            s->run[run] = t->run[k];
            s->run[run++].at += pix;
        }
        if (t->npix) {
            memcpy(s->smooth + pix, t->smooth, t->npix * sizeof *s->smooth);
            memcpy(s->value + pix, t->value, t->npix * sizeof *s->value);
        }
        pix += t->npix;
        strip_free(t);
    }
    return OK;
}

/* ---- components ---- */

static size_t find_root(size_t *parent, size_t i)
{
    while (parent[i] != i) {
        parent[i] = parent[parent[i]];     /* path halving */
        i = parent[i];
    }
    return i;
}

/* Join runs of neighbouring rows that touch; the smaller index becomes the root. */
static void join_rows(const struct run *run, size_t a, size_t a_end, size_t b, size_t b_end,
                      size_t *parent)
{
    while (a < a_end && b < b_end) {
        if (run[a].x1 < run[b].x0) {
            a++;
        } else if (run[b].x1 < run[a].x0) {
            b++;
        } else {
            size_t u = find_root(parent, a), v = find_root(parent, b);
            if (u < v)
                parent[v] = u;
            else
                parent[u] = v;
            if (run[a].x1 < run[b].x1)
                a++;
            else
                b++;
        }
    }
}

static void join_runs(const struct segments *s, size_t *parent)
{
    for (size_t i = 0; i < s->nrun; i++)
        parent[i] = i;
    size_t above = 0, above_end = 0;
    for (size_t i = 0; i < s->nrun;) {
        size_t end = i;
        while (end < s->nrun && s->run[end].y == s->run[i].y)
            end++;
        if (above_end > above && s->run[above].y + 1 == s->run[i].y)
            join_rows(s->run, above, above_end, i, end, parent);
        above = i;
        above_end = end;
        i = end;
    }
}

/* Number the components that are large enough, in order of their first run, and group the runs. */
static int group_runs(struct segments *s, long min_area)
{
    size_t n = s->nrun;
    size_t *parent = malloc((n + 1) * sizeof *parent), *area = calloc(n + 1, sizeof *area);
    struct run *sorted = malloc((n + 1) * sizeof *sorted);
    size_t ncomp = 0;
    size_t *first = NULL;
    if (!parent || !area || !sorted)
        goto fail;
    join_runs(s, parent);
    for (size_t i = 0; i < n; i++) {
        parent[i] = find_root(parent, i);
        area[parent[i]] += (size_t)(s->run[i].x1 - s->run[i].x0);
    }
    for (size_t i = 0; i < n; i++) {
        size_t root = parent[i];
        if (root == i)
            s->run[i].component = area[i] >= (size_t)min_area ? (int32_t)ncomp++ : -1;
        else
            s->run[i].component = s->run[root].component;
    }
    first = calloc(ncomp + 2, sizeof *first);
    if (!first)
        goto fail;
    for (size_t i = 0; i < n; i++)         /* counting sort by component, order kept */
        if (s->run[i].component >= 0)
            first[s->run[i].component + 2]++;
    for (size_t c = 0; c < ncomp; c++)
        first[c + 2] += first[c + 1];
    size_t kept = 0;
    for (size_t i = 0; i < n; i++)
        if (s->run[i].component >= 0) {
            sorted[first[s->run[i].component + 1]++] = s->run[i];
            kept++;
        }
    free(s->run);
    free(parent);
    free(area);
    s->run = sorted;
    s->nrun = kept;
    s->first = first;
    s->ncomponent = ncomp;
    return OK;
fail:
    free(parent);
    free(area);
    free(sorted);
    return E_NOMEM;
}

int segment_find(struct segments *s, const struct image *im, const struct background *b,
                 const struct smooth *filter, const struct segment_params *p)
{
    if (!(p->threshold > 0) || p->min_area < 1 || (!p->rms_map && !(p->noise > 0)))
        return E_RANGE;
    long n = (im->ny + STRIP - 1) / STRIP;
    struct segments out = {0};
    struct search search = {im, b, filter, p, calloc((size_t)n, sizeof(struct strip)), NULL, NULL};
    if (!search.strip)
        return E_NOMEM;
    int st = search_all(&search, n);
    if (!st)
        st = join_strips(&out, search.strip, n);
    if (!st)
        st = group_runs(&out, p->min_area);
    for (long i = 0; i < n; i++)
        strip_free(&search.strip[i]);
    free(search.strip);
    if (st)
        segment_free(&out);
    else
        *s = out;
    return st;
}

void segment_free(struct segments *s)
{
    free(s->run);
    free(s->smooth);
    free(s->value);
    free(s->first);
    *s = (struct segments){0};
}
