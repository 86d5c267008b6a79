/* detect.c - the steps of detection in their order; see detect.h. */
#include "detect.h"
#include "clean.h"
#include "deblend.h"
#include "grow.h"
#include "pages.h"
#include "progress.h"
#include "segment.h"
#include "simd.h"
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BRANCH = 3 };            /* least pixels of a deblended branch */
enum { COMPONENTS = 16, OBJECTS = 8 };      /* per task */
enum { RETURN = 1 << 25 };      /* bytes of objects that go back at a time */

void detect_weights(float *map, size_t n, enum weight_type type)
{
    for (size_t i = 0; i < n; i++) {
        float w = map[i];
        if (!(w > 0 && w <= FLT_MAX))
            map[i] = INFINITY;
        else if (type != WEIGHT_RMS)
            map[i] = type == WEIGHT_INVERSE ? 1 / sqrtf(w) : sqrtf(w);
    }
}

/* ---- noise ---- */

static void cell_box(const struct mesh *m, long i, long j, long box[4])
{
    box[0] = i * m->nx / m->mx;
    box[1] = (i + 1) * m->nx / m->mx;
    box[2] = j * m->ny / m->my;
    box[3] = (j + 1) * m->ny / m->my;
}

/* Median over the cells of measured rms / rms of the map; 0 when there is none. */
static int map_ratio(const struct pixels *im, const struct background *b, const float *map, double *scale)
{
    const struct mesh *m = &b->rms;
    double *ratio = malloc((size_t)m->mx * (size_t)m->my * sizeof *ratio);
    float *pix = malloc((size_t)(im->nx / m->mx + 1) * sizeof *pix);
    long n = 0;
    for (long j = 0; j < m->my && ratio && pix; j++)
        for (long i = 0; i < m->mx; i++) {
            long box[4], good = 0;
            double sum = 0;
            cell_box(m, i, j, box);
            for (long y = box[2]; y < box[3]; y++) {
                const float *rms = map + (size_t)y * (size_t)im->nx + (size_t)box[0];
                pixels_row(im, y, box[0], box[1] - box[0], pix);
                for (long x = 0; x < box[1] - box[0]; x++)
                    if (rms[x] <= FLT_MAX && fabsf(pix[x]) <= FLT_MAX) {
                        sum += (double)rms[x] * (double)rms[x];
                        good++;
                    }
            }
            double sigma = m->pivot + m->node[j * m->mx + i];
            if (good * 4 >= (box[1] - box[0]) * (box[3] - box[2]) && sigma > 0)
                ratio[n++] = sigma / sqrt(sum / (double)good);
        }
    const int st = ratio && pix ? OK : E_NOMEM;
    if (!st)
        *scale = n ? background_median(ratio, n) : 0;
    free(ratio);
    free(pix);
    return st;
}

/* Scale the map to the noise measured, or to rms where that is given. */
static int scale_map(const struct pixels *im, const struct background *b, float *map, double rms)
{
    double scale;
    int st = map_ratio(im, b, map, &scale);
    if (st)
        return st;
    if (rms > 0)
        scale *= rms / b->mean_rms;
    if (!(scale > 0))
        return E_SINGULAR;
    for (size_t i = 0; i < pixels_count(im); i++)
        map[i] *= (float)scale;
    return OK;
}

/*
 * rms of the filtered image over that of the pixels: the white-noise value, or
 * what a sample of cells shows when that is more than 5 % above it (correlated noise).
 */
static int filtered_noise(const struct pixels *im, const struct background *b, const float *map,
                          const struct smooth *filter, int negative, double noise, double *result)
{
    double white = smooth_noise(filter);
    *result = white;
    if (filter->way == SMOOTH_NOTHING)
        return OK;
    const struct mesh *m = &b->rms;
    long strips = m->my < 5 ? m->my : 4 + m->my / 16, tall = m->ny / m->my + 1, n = 0;
    float *rows = malloc((size_t)tall * (size_t)im->nx * sizeof *rows);
    const size_t wide = (size_t)(im->nx / m->mx + 1);
    float *cell = malloc((size_t)(tall + 1) * wide * sizeof *cell), *pix = cell ? cell + (size_t)tall * wide : NULL;
    double *ratio = malloc((size_t)strips * (size_t)m->mx * sizeof *ratio);
    int st = rows && cell && ratio ? OK : E_NOMEM;
    for (long s = 0; s < strips && !st; s++) {
        long j = (2 * s + 1) * m->my / (2 * strips), box[4];
        cell_box(m, 0, j, box);
        st = segment_filtered(im, b, map, filter, negative, box[2], box[3] - box[2], rows);
        for (long i = 0; i < m->mx && !st; i++) {
            long k = 0;
            cell_box(m, i, j, box);
            for (long y = box[2]; y < box[3]; y++) {
                const float *v = rows + (y - box[2]) * im->nx + box[0];
                const float *rms = map ? map + (size_t)y * (size_t)im->nx + (size_t)box[0] : NULL;
                pixels_row(im, y, box[0], box[1] - box[0], pix);
                for (long x = 0; x < box[1] - box[0]; x++)
                    if (fabsf(pix[x]) <= FLT_MAX && (!rms || rms[x] <= FLT_MAX))
                        cell[k++] = rms ? v[x] / rms[x] : v[x];
            }
            double level, sigma, pixel = map ? 1 : m->pivot + m->node[j * m->mx + i];
            if (k * 4 < (box[1] - box[0]) * (box[3] - box[2]) || !(pixel > 0))
                continue;
            background_clip(cell, k, 0, 0, &level, &sigma);
            if (sigma > 0)
                ratio[n++] = sigma / (noise > 0 ? noise : pixel);
        }
    }
    if (!st && n) {
        double measured = background_median(ratio, n);
        *result = measured > 1.05 * white ? measured : white;
    }
    free(rows);
    free(cell);
    free(ratio);
    return st;
}

/* ---- deblending in tasks ---- */

struct split {
    const struct segments *s;
    const struct deblend_params *p;
    int32_t *owner;            /* per detected pixel of components that are split: object inside the task's list */
    int32_t *whole;            /* per component: the object inside the task's list, -1: split */
    struct blob_list *list;    /* one per task */
    struct deblend_work **work;    /* one per worker, made by itself */
    uint16_t *top;             /* per component: its first row */
};

static int split_components(void *ctx, long begin, long end, int worker)
{
    struct split *t = ctx;
    struct deblend_work **w = &t->work[worker];
    int st = *w ? OK : deblend_work_new(w);
    struct blob_list *list = &t->list[begin / COMPONENTS];
    for (long c = begin; c < end && !st; c++) {
        size_t before = list->n;
        st = deblend_component(t->s, (size_t)c, t->p, *w, t->owner, list);
        t->whole[c] = list->n == before + 1 ? (int32_t)before : -1;
    }
    return st;
}

/* All lists end to end; base[task] = index of a task's first object. */
static int join_lists(struct blob_list *all, struct blob_list *list, long n, size_t *base)
{
    size_t total = 0;
    for (long i = 0; i < n; i++) {
        base[i] = total;
        total += list[i].n;
    }
    if (total > INT32_MAX - 1)
        return E_RANGE;
    int st = grow(&all->blob, &all->cap, total + 1, sizeof *all->blob);
    if (st)
        return st;
    size_t freed = 0;
    for (long i = 0; i < n; i++) {         /* a list goes as its objects come */
        if (list[i].n)
            memcpy(all->blob + base[i], list[i].blob, list[i].n * sizeof *all->blob);
        free(list[i].blob);
        freed += list[i].cap * sizeof *all->blob;
        list[i] = (struct blob_list){0};
        if (freed > RETURN) {
            pages_return();
            freed = 0;
        }
    }
    all->n = total;
    return OK;
}

/* A run without its row: the columns of the first of a row after another one change places. */
struct span {
    uint16_t a, b;
};

/* The runs of components become spans, in place and in 2/3 of the memory: a component has runs in each row from its first on. */
static int pack_runs(struct segments *s, uint16_t **top)
{
    *top = malloc((s->ncomponent + 1) * sizeof **top);
    if (!*top)
        return E_NOMEM;
    char *to = (char *)s->run;
    for (size_t c = 0; c < s->ncomponent; c++) {
        uint16_t y = (*top)[c] = s->run[s->first[c]].y;
        for (size_t i = s->first[c]; i < s->first[c + 1]; i++) {
            const struct run r = s->run[i];
            const struct span span = r.y == y ? (struct span){r.x0, r.x1} : (struct span){r.x1, r.x0};
            memcpy(to + i * sizeof span, &span, sizeof span);
            y = r.y;
        }
    }
    struct run *less = realloc(s->run, s->nrun * sizeof(struct span) + 1);
    s->run = less ? less : s->run;
    return OK;
}

/* Count the runs of single objects, or with their labels put them: number[i], that of object i before cleaning. */
static void label_runs(const struct split *t, const size_t *base, const int32_t *number, struct labels *l)
{
    const struct segments *s = t->s;
    for (size_t c = 0; c < s->ncomponent; c++) {
        const int32_t *mine = t->owner + s->at[c], *of = number ? number + base[c / COMPONENTS] : NULL;
        const int32_t whole = t->whole[c];
        long y = t->top[c];
        for (size_t i = s->first[c]; i < s->first[c + 1]; i++) {
            struct span r;
            memcpy(&r, (const char *)s->run + i * sizeof r, sizeof r);
            if (r.a > r.b) {
                r = (struct span){r.b, r.a};
                y++;
            }
            for (int32_t x = r.a, end; x < r.b; x = end) {
                int32_t k = whole >= 0 ? whole : mine[x - r.a];
                for (end = whole >= 0 ? r.b : x + 1; end < r.b && mine[end - r.a] == k;)
                    end++;
                if (of)
                    labels_put(l, y, x, end, of[k]);
                else
                    labels_count(l, y);
            }
            mine += r.b - r.a;
        }
    }
}

static int label_all(const struct pixels *im, const struct split *t, const size_t *base, const int32_t *number, struct labels *l)
{
    struct labels made;
    int st = labels_new(&made, im->nx, im->ny);
    if (st)
        return st;
    label_runs(t, base, NULL, &made);
    st = labels_room(&made);
    if (!st) {
        label_runs(t, base, number, &made);
        st = labels_sort(&made);
    }
    if (st)
        labels_free(&made);
    else
        *l = made;
    return st;
}

/* Clean, number the objects that stay, pack their blobs, label their pixels. */
static int settle(const struct pixels *im, const struct detect_params *p, struct par_team *team, const struct split *t,
                  const size_t *base, struct blob_list *all, struct detection *d)
{
    size_t n = all->n, kept = 0;
    int32_t *number = malloc((n + 1) * sizeof *number), *into = malloc((n + 1) * sizeof *into);
    int st = number && into ? OK : E_NOMEM;
    if (!st && p->clean)
        st = clean_objects(all, p->clean_beta, im->nx, im->ny, team, into);
    for (size_t i = 0; i < n && !st; i++)
        if (!p->clean || into[i] == (int32_t)i)
            number[i] = (int32_t)++kept;
    for (size_t i = 0; i < n && !st; i++) {
        if (p->clean && into[i] != (int32_t)i)
            number[i] = number[into[i]];
        else
            all->blob[number[i] - 1] = all->blob[i];
    }
    if (!st) {
        d->found = n;
        d->cleaned = n - kept;
        all->n = kept;
        st = label_all(im, t, base, number, &d->label);
    }
    free(number);
    free(into);
    return st;
}

/* Segments to blobs and labels. */
static int separate(const struct pixels *im, const float *map, const struct detect_params *p, struct par_team *team,
                    struct segments *s, struct blob_list *all, struct detection *d)
{
    long tasks = (long)((s->ncomponent + COMPONENTS - 1) / COMPONENTS);
    struct deblend_params dp = {
        .levels = p->levels, .contrast = p->contrast, .min_area = p->min_area, .rms_map = map,
        .branch_area = p->min_area < BRANCH ? p->min_area : BRANCH,
        .threshold = map ? d->threshold : d->threshold * d->noise, .nx = im->nx,
        .most = DETECT_MOST + pixels_count(im) / DETECT_PART
    };
    /* the object of a pixel takes the place of its filtered value, which nobody asks for again */
    struct split split = {s, &dp, (int32_t *)(void *)s->smooth, malloc((s->ncomponent + 1) * sizeof(int32_t)),
                          calloc((size_t)tasks + 1, sizeof(struct blob_list)),
                          calloc((size_t)par_team_size(team), sizeof(struct deblend_work *)), NULL};
    size_t *base = malloc(((size_t)tasks + 1) * sizeof *base);
    int st = split.whole && split.list && split.work && base ? OK : E_NOMEM;
    if (!st)
        st = par_team_for(team, (long)s->ncomponent, COMPONENTS, split_components, &split);
    for (int i = 0; i < par_team_size(team) && split.work; i++)
        deblend_work_free(split.work[i]);
    free(split.work);
    if (!st)
        st = join_lists(all, split.list, tasks, base);
    for (long i = 0; i < tasks && split.list; i++)
        free(split.list[i].blob);
    free(split.list);
    free(s->value);                        /* all sums are made: room for the labels */
    s->value = NULL;
    if (!st)
        st = pack_runs(s, &split.top);
    if (!st)
        st = settle(im, p, team, &split, base, all, d);
    free(split.whole);
    free(split.top);
    free(base);
    return st;
}

/* ---- photometry in tasks ---- */

struct measuring {
    struct field f;
    const struct blob_list *all;
    struct detection *d;
    struct progress *progress;
    long steps;                /* of progress for all objects */
    struct photometry_work **work;     /* one per worker, made by itself */
};

static void tick(struct progress *p, long n)
{
    if (p)
        progress_tick(p, n);
}

static int measure_objects(void *ctx, long begin, long end, int worker)
{
    struct measuring *t = ctx;
    struct photometry_work **w = &t->work[worker];
    int st = *w ? OK : photometry_work_new(w);
    size_t m = 2 * t->f.p->napertures + t->f.p->nfractions;
    for (long i = begin; i < end && !st; i++)
        st = photometry_measure(&t->f, &t->all->blob[i], (int32_t)i, *w, &t->d->object[i],
                                m ? t->d->aperture + (size_t)i * m : NULL);
    long n = (long)t->all->n;
    tick(t->progress, t->steps * end / n - t->steps * begin / n);
    return st;
}

static int measure_all(const struct pixels *im, const float *map, int relative, const struct detect_params *p,
                       struct par_team *team, const struct blob_list *all, struct detection *d)
{
    struct photometry_params phot = p->phot;
    phot.noise = d->noise;
    phot.rms_map = map;
    d->n = all->n;
    d->object = malloc((all->n + 1) * sizeof *d->object);
    d->aperture = malloc((all->n * (2 * phot.napertures + phot.nfractions) + 1) * sizeof *d->aperture);
    if (!d->object || !d->aperture)
        return E_NOMEM;
    struct photometry_params here = phot;
    struct field found = {im, &d->background, &d->label, &here, NULL};
    struct measuring t = {{im, &d->background, &d->label, &phot, NULL}, all, d, p->progress, DETECT_STEPS / 2, NULL};
    if (p->measure) {
        struct background_params bp = {p->back_cell, p->back_filter, phot.gain, p->sky_removed, team, p->dark_sky};
        int st = background_measure(&d->measured, p->measure, p->measure_map, &bp);
        if (!st && p->measure_map && relative)
            st = scale_map(p->measure, &d->measured, p->measure_map, 0);
        if (st)
            return st;
        phot.noise = d->measured.mean_rms;
        phot.rms_map = p->measure_map;
        t.f = (struct field){p->measure, &d->measured, &d->label, &phot, &found};
    }
    t.work = calloc((size_t)par_team_size(team), sizeof *t.work);
    int st = t.work ? par_team_for(team, (long)all->n, OBJECTS, measure_objects, &t) : E_NOMEM;
    for (int i = 0; i < par_team_size(team) && t.work; i++)
        photometry_work_free(t.work[i]);
    free(t.work);
    return st;
}

/* Background, noise and threshold into d. */
static int prepare(const struct pixels *im, float *map, int relative, const struct detect_params *p,
                   const struct smooth *filter, struct par_team *team, struct detection *d)
{
    struct background_params bp = {p->back_cell, p->back_filter, p->phot.gain, p->sky_removed, team, p->dark_sky};
    int st = background_measure(&d->background, im, map, &bp);
    if (st)
        return st;
    d->noise = p->rms > 0 ? p->rms : d->background.mean_rms;
    if (map && relative)
        st = scale_map(im, &d->background, map, p->rms);
    if (st)
        return st;
    if (!map && !(d->noise > 0))
        return E_SINGULAR;
    d->filtered_noise = smooth_noise(filter);
    if (!p->pixel_noise)
        st = filtered_noise(im, &d->background, map, filter, p->negative, p->rms, &d->filtered_noise);
    d->threshold = p->threshold * (p->pixel_noise ? 1 : d->filtered_noise);
    return st;
}

int detect_run(const struct pixels *im, float *rms_map, int relative, const struct detect_params *p,
               struct detection *d)
{
    struct detection out = {0};
    struct segments s = {0};
    struct blob_list all = {0};
    const struct smooth nothing = {.noise = 1}, *filter = p->filter ? p->filter : &nothing;
    struct par_team *team = par_team_new(p->threads);
    int st = prepare(im, rms_map, relative, p, filter, team, &out);
    tick(p->progress, DETECT_STEPS / 8);
    if (!st) {
        struct segment_params sp = {out.threshold, out.noise, rms_map, p->min_area, p->negative, team};
        st = segment_find(&s, im, &out.background, filter, &sp);
    }
    if (!st)
        st = separate(im, rms_map, p, team, &s, &all, &out);
    tick(p->progress, DETECT_STEPS * 3 / 8);
    segment_free(&s);
    if (!st && p->negative)
        out.n = all.n;
    else if (!st)
        st = measure_all(im, rms_map, relative, p, team, &all, &out);
    par_team_free(team);
    free(all.blob);
    if (st)
        detection_free(&out);
    else
        *d = out;
    return st;
}

void detection_free(struct detection *d)
{
    background_free(&d->background);
    background_free(&d->measured);
    free(d->object);
    free(d->aperture);
    labels_free(&d->label);
    *d = (struct detection){0};
}
