/* fomopt.c - how well the power spectrum error is known against the reference, and the pixel scale where it is least. */
#include "fom.h"
#include "stats.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LEAST_SCALES 4

/* One set, its scales in rising order, or all sets; and the blocks of sky they share. */
struct curve {
    size_t n, room;           /* scales of the set, or groups; how many the arrays hold */
    const struct fom_result **r;
    uint32_t **label;         /* of every block of every scale, 0..labels-1 */
    size_t labels;
    double *theta, *y;        /* log scale, log of sigma^2/(theta n) */
};

static int by_scale(const void *a, const void *b)
{
    const struct fom_result *const *p = a, *const *q = b;
    return (*p)->scale < (*q)->scale ? -1 : (*p)->scale > (*q)->scale;
}

static int same_bin(const struct fom_result *a, const struct fom_result *b)
{
    return a->lo == b->lo || (isnan(a->lo) && isnan(b->lo));
}

static int same_set(const struct fom_result *a, const struct fom_result *b)
{
    return strcmp(a->set, b->set) == 0 && same_bin(a, b);
}

static void curve_free(struct curve *c)
{
    for (size_t k = 0; k < c->room && c->label; k++)
        free(c->label[k]);
    free(c->r);
    free(c->label);
    free(c->theta);
    free(c->y);
}

/* An empty curve with room for n groups; curve_free also after failure. */
static int curve_new(struct curve *c, size_t n)
{
    *c = (struct curve){.room = n, .r = calloc(n + 1, sizeof *c->r), .label = calloc(n + 1, sizeof *c->label),
                        .theta = calloc(n + 1, sizeof *c->theta), .y = calloc(n + 1, sizeof *c->y)};
    return c->r && c->label && c->theta && c->y ? OK : E_NOMEM;
}

/* Equal labels for equal (field, part): parts come in groups of 16 in order. */
static void set_labels(struct curve *c)
{
    c->labels = 0;
    for (size_t i = 0; i < c->n; i++)
        for (size_t k = 0; k < c->r[i]->blocks; k += 16) {
            size_t found = c->labels;
            for (size_t a = 0; a < i && found == c->labels; a++)
                for (size_t b = 0; b < c->r[a]->blocks && found == c->labels; b += 16)
                    if (strcmp(c->r[a]->block[b].sky, c->r[i]->block[k].sky) == 0)
                        found = c->label[a][b];
            for (size_t j = 0; j < 16; j++)
                c->label[i][k + j] = (uint32_t)(found + j);
            c->labels += found == c->labels ? 16 : 0;
        }
}

/* y of every scale when block `label` counts weight[label] times (NULL: once). */
static void weigh(struct curve *c, const double *weight)
{
    for (size_t i = 0; i < c->n; i++) {
        const struct fom_result *r = c->r[i];
        double n = 0, p = 0, s2 = 0, area = 0;
        for (size_t k = 0; k < r->blocks; k++) {
            double w = weight ? weight[c->label[i][k]] : 1;
            area += w;
            n += w * r->block[k].n;
            p += w * r->block[k].p;
            s2 += w * r->block[k].s2;
        }
        double line = 0.5 * (r->v[FOM_L1] + r->v[FOM_L2]), spread = s2 * n / (p * p * line * line);
        c->theta[i] = log(r->scale);
        c->y[i] = log(spread * area / n) - c->theta[i];
    }
}

/* Vertex of the least-squares parabola through up to five points about the least; NaN at an end. */
static double lowest(size_t n, const double *x, const double *y)
{
    size_t at = 0;
    for (size_t i = 0; i < n; i++) {
        if (!isfinite(y[i]))
            return NAN;
        at = y[i] < y[at] ? i : at;
    }
    size_t lo = at > 2 ? at - 2 : 0, hi = at + 2 < n ? at + 2 : n - 1;
    double s[5] = {0}, t[3] = {0}, x0 = x[at];
    for (size_t i = lo; i <= hi; i++) {
        double d = x[i] - x0, power = 1;
        for (int k = 0; k < 5; k++, power *= d) {
            s[k] += power;
            if (k < 3)
                t[k] += power * (y[i] - y[at]);
        }
    }
    double det = s[0] * (s[2] * s[4] - s[3] * s[3]) - s[1] * (s[1] * s[4] - s[2] * s[3]) + s[2] * (s[1] * s[3] - s[2] * s[2]);
    double b = s[0] * (t[1] * s[4] - s[3] * t[2]) - t[0] * (s[1] * s[4] - s[2] * s[3]) + s[2] * (s[1] * t[2] - t[1] * s[2]);
    double a = s[0] * (s[2] * t[2] - t[1] * s[3]) - s[1] * (s[1] * t[2] - t[1] * s[2]) + t[0] * (s[1] * s[3] - s[2] * s[2]);
    if (!(a / det > 0))
        return NAN;
    double v = x0 - 0.5 * b / a;
    return v > x[0] && v < x[n - 1] ? exp(v) : NAN;
}

/* Blocks drawn with replacement: how often each, and what the draws gave. */
struct draws {
    double *weight, *v;
    uint32_t *index;
};

static void draws_free(struct draws *d)
{
    free(d->weight);
    free(d->v);
    free(d->index);
}

/* Room for the blocks of c and n values; draws_free also after failure. */
static int draws_new(struct draws *d, const struct curve *c, size_t n)
{
    *d = (struct draws){malloc((c->labels + 1) * sizeof *d->weight), malloc((n + 1) * sizeof *d->v),
                        malloc((c->labels + 1) * sizeof *d->index)};
    return d->weight && d->v && d->index ? OK : E_NOMEM;
}

/* y of every scale with the blocks of draw k. */
static void draw(struct curve *c, const struct fom_options *o, long k, struct draws *d)
{
    memset(d->weight, 0, c->labels * sizeof *d->weight);
    stats_resample(c->labels, c->labels, o->seed, (uint64_t)k, d->index);
    for (size_t i = 0; i < c->labels; i++)
        d->weight[d->index[i]]++;
    weigh(c, d->weight);
}

/* Scatter of the values of n draws, moved together; NaN, no error is known, when half of the draws or more gave none. */
static double scatter(size_t n, double *v)
{
    size_t used = 0;
    struct stats s;
    for (size_t k = 0; k < n; k++)
        if (isfinite(v[k]))
            v[used++] = v[k];
    stats_sum(used, v, &s);
    return 2 * used > n ? sqrt(s.var) : NAN;
}

/* The groups that `same` finds like `first` (one set: by scale) and their labels into c. */
static int collect(struct curve *c, size_t n, const struct fom_result *r, const struct fom_result *first,
                   int (*same)(const struct fom_result *, const struct fom_result *))
{
    c->n = 0;
    for (size_t i = 0; i < n; i++)
        if (same(&r[i], first) && r[i].blocks > 0)
            c->r[c->n++] = &r[i];
    if (same == same_set)
        qsort(c->r, c->n, sizeof *c->r, by_scale);
    for (size_t i = 0; i < c->n; i++) {
        free(c->label[i]);
        c->label[i] = malloc(c->r[i]->blocks * sizeof **c->label);
        if (!c->label[i])
            return E_NOMEM;
    }
    set_labels(c);
    return OK;
}

static int optimum_of_set(size_t n, struct fom_result *r, size_t first, const struct fom_options *o, struct curve *c)
{
    const size_t draws = (size_t)o->draws;
    struct draws d = {0};
    double at = NAN, err = NAN;
    int st = collect(c, n, r, &r[first], same_set);
    if (st == OK)
        st = draws_new(&d, c, draws);
    if (st == OK && c->n >= LEAST_SCALES) {
        weigh(c, NULL);
        at = lowest(c->n, c->theta, c->y);
    }
    if (isfinite(at)) {
        for (size_t k = 0; k < draws; k++) {
            draw(c, o, (long)k, &d);
            d.v[k] = lowest(c->n, c->theta, c->y);
        }
        err = scatter(draws, d.v);
    }
    for (size_t i = 0; i < n && st == OK; i++)
        if (same_set(&r[i], &r[first])) {
            r[i].v[FOM_OPT] = at;
            r[i].v[FOM_OPTERR] = err;
        }
    draws_free(&d);
    return st;
}

int fom_optimum(size_t n, struct fom_result *r, const struct fom_options *o)
{
    struct curve c;
    int st = curve_new(&c, n);
    for (size_t i = 0; i < n && st == OK; i++) {
        size_t j = 0;
        while (j < i && !same_set(&r[j], &r[i]))
            j++;
        if (j == i)
            st = optimum_of_set(n, r, i, o, &c);
    }
    curve_free(&c);
    return st;
}

/* LOGDCBS of the groups of one bin against `to`, one of them. */
static int contrast_of_bin(size_t n, struct fom_result *r, const struct fom_result *to, const struct fom_options *o, struct curve *c)
{
    const size_t draws = (size_t)o->draws;
    struct draws d = {0};
    size_t ref = 0;
    int st = collect(c, n, r, to, same_bin);
    if (st == OK)
        st = draws_new(&d, c, draws * c->n);
    while (ref < c->n && c->r[ref] != to)
        ref++;
    for (size_t k = 0; k < draws && st == OK && ref < c->n; k++) {
        draw(c, o, (long)k, &d);
        for (size_t i = 0; i < c->n; i++)
            d.v[i * draws + k] = c->y[i] - c->y[ref];
    }
    for (size_t i = 0; i < c->n && st == OK && ref < c->n; i++)
        r[c->r[i] - r].v[FOM_LOGDCBS] = M_LOG10E * scatter(draws, d.v + i * draws);
    draws_free(&d);
    return st;
}

int fom_contrast(size_t n, struct fom_result *r, const struct fom_options *o)
{
    struct curve c;
    int st = curve_new(&c, n);
    for (size_t i = 0; i < n && st == OK; i++) {
        const struct fom_result *to = fom_reference(n, r, &r[i], o);
        size_t first = 0;
        while (!same_bin(&r[first], &r[i]))
            first++;
        if (first == i && to)
            st = contrast_of_bin(n, r, to, o, &c);
    }
    curve_free(&c);
    return st;
}
