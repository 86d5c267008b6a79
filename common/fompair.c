/* fompair.c - slopes from the same galaxies under opposite shears. */
#include "fompair.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PAIRS 16              /* different |g| of one component */
#define LEVELS (2 * PAIRS)    /* different values of what the ellipticities answer to */
#define LEAST_SPAN 0.005      /* of the PSF's ellipticities */

/* One image of a pair, matched to the list of its field. */
struct side {
    const struct fom_image *im;
    long *at;                 /* object of im for every object of the list; -1: none */
    unsigned char *taken;     /* object of im belongs to one of the list */
    double weight;            /* (x - <x>) / sum (x - <x>)^2 over the levels x */
    int slot;                 /* which level: means are over all fields */
};

struct field {
    const struct fom_image *list;
    size_t sky;               /* number of the first image of its sky */
    int has_zero;             /* the list is unsheared */
    size_t n;
    struct side side[LEVELS];
};

/* The values of shear (or PSF ellipticity) whose slope is taken: all present in every field. */
struct levels {
    int n;
    int psf;
    double x[LEVELS], weight[LEVELS];
};

struct sums {
    double e, n;              /* own selection: sum of e, number */
    double s, m;              /* selection alone: sum of unsheared e, number */
};

/* Values of the common galaxies of all fields. */
struct common {
    size_t n, cap;
    double *r, *g, *p, *mean;
    size_t *block;            /* part of the sky, FOM_PARTS a sky */
};

static int same(double a, double b)
{
    return fabs(a - b) < 1e-9;
}

/* The image of this field at x in component c and, for a shear, at none in the other. */
static const struct fom_image *find(size_t n, const struct fom_image *const *im, const char *field, int c, int psf, double x)
{
    for (size_t i = 0; i < n; i++)
        if (strcmp(im[i]->field, field) == 0 && same(psf ? im[i]->epsf[c] : im[i]->g[c], x) && (psf || same(im[i]->g[1 - c], 0)))
            return im[i];
    return NULL;
}

/* Every field has an image at x. */
static int everywhere(size_t n, const struct fom_image *const *im, int c, int psf, double x)
{
    for (size_t j = 0; j < n; j++)
        if (!find(n, im, im[j]->field, c, psf, x))
            return 0;
    return 1;
}

/* Pairs +-g of component c; for the PSF every ellipticity, when they differ enough. */
static void find_levels(struct levels *l, size_t n, const struct fom_image *const *im, int c, int psf)
{
    double mean = 0, norm = 0;
    *l = (struct levels){.psf = psf};
    for (size_t i = 0; i < n && l->n < LEVELS; i++) {
        double v = psf ? im[i]->epsf[c] : im[i]->g[c];
        int known = psf ? !isfinite(v) : !(v > 1e-9) || !same(im[i]->g[1 - c], 0);
        for (int k = 0; k < l->n; k++)
            known |= same(l->x[k], v);
        if (known || !everywhere(n, im, c, psf, v) || !(psf || everywhere(n, im, c, psf, -v)))
            continue;
        l->x[l->n++] = v;
        if (!psf)
            l->x[l->n++] = -v;
    }
    for (int k = 0; k < l->n; k++)
        mean += l->x[k] / l->n;
    for (int k = 0; k < l->n; k++)
        norm += (l->x[k] - mean) * (l->x[k] - mean);
    for (int k = 0; k < l->n; k++)
        l->weight[k] = (l->x[k] - mean) / norm;
    if (psf && !(norm > 0.5 * LEAST_SPAN * LEAST_SPAN))
        l->n = 0;
}

static void field_free(struct field *f)
{
    for (size_t k = 0; k < f->n; k++) {
        free(f->side[k].at);
        free(f->side[k].taken);
    }
    f->n = 0;
}

static int field_open(struct field *f, size_t n, const struct fom_image *const *im, const char *name, int c,
                      const struct levels *l, double radius)
{
    *f = (struct field){.list = l->psf ? NULL : find(n, im, name, c, 0, 0)};
    f->has_zero = f->list != NULL;
    while (strcmp(im[f->sky]->field, name) != 0)
        f->sky++;
    for (size_t i = f->sky; i-- > 0;)
        if (strcmp(im[i]->sky, im[f->sky]->sky) == 0)
            f->sky = i;
    if (!f->list)
        f->list = find(n, im, name, c, l->psf, l->x[0]);
    for (int k = 0; k < l->n; k++) {
        struct side *s = &f->side[f->n];
        *s = (struct side){.im = find(n, im, name, c, l->psf, l->x[k]), .weight = l->weight[k], .slot = k};
        s->at = malloc((f->list->n + 1) * sizeof *s->at);
        s->taken = calloc(s->im->n + 1, 1);
        f->n++;
        int st = s->at && s->taken ? fom_match(f->list, s->im, radius, s->at) : E_NOMEM;
        if (st) {
            field_free(f);
            return st;
        }
        for (size_t i = 0; i < f->list->n; i++)
            if (s->at[i] >= 0)
                s->taken[s->at[i]] = 1;
    }
    return OK;
}

static const struct fom_object *matched(const struct side *s, size_t i)
{
    return s->at[i] < 0 ? NULL : &s->im->object[s->at[i]];
}

static int add_common(struct common *all, const struct field *f, int c, int everywhere)
{
    if (all->n + f->list->n > all->cap) {
        size_t cap = all->n + f->list->n;
        double **to[] = {&all->r, &all->g, &all->p, &all->mean};
        for (int k = 0; k < 4; k++) {
            double *mem = realloc(*to[k], cap * sizeof *mem);
            if (!mem)
                return E_NOMEM;
            *to[k] = mem;
        }
        size_t *block = realloc(all->block, cap * sizeof *block);
        if (!block)
            return E_NOMEM;
        all->block = block;
        all->cap = cap;
    }
    int *part = malloc((f->list->n + 1) * sizeof *part), st = part ? fom_parts(f->list, part) : E_NOMEM;
    if (st) {
        free(part);
        return st;
    }
    for (size_t i = 0; i < f->list->n; i++) {
        double r = 0, g = 0, p = 0, mean = 0, m = (double)f->n;
        size_t k = f->list->object[i].listed ? 0 : f->n + 1;
        for (; k < f->n; k++) {
            const struct fom_object *o = matched(&f->side[k], i);
            if (!o || !o->passes || (everywhere && !o->listed))
                break;
            r += f->side[k].weight * o->e[c];
            g += 0.5 * (o->p[0] + o->p[1]) / m;
            p += o->p[c] / m;
            mean += o->e[c] / m;
        }
        if (k != f->n)
            continue;
        all->r[all->n] = r;
        all->g[all->n] = g;
        all->p[all->n] = p;
        all->block[all->n] = FOM_PARTS * f->sky + (size_t)part[i];
        all->mean[all->n++] = mean;
    }
    free(part);
    return OK;
}

/* e of the object as the list has it, when it may count in the selection response. */
static int unsheared(const struct field *f, size_t i, int c, double *e)
{
    *e = f->list->object[i].e[c];
    return f->list->object[i].measured;
}

static void add_sums(struct sums *sum, const struct field *f, int c)
{
    for (size_t k = 0; k < f->n; k++) {
        const struct side *s = &f->side[k];
        struct sums *to = &sum[s->slot];
        for (size_t i = 0; i < s->im->n; i++)
            if (s->im->object[i].used) {
                to->e += s->im->object[i].e[c];
                to->n++;
            }
        for (size_t i = 0; i < f->list->n; i++) {
            const struct fom_object *o = matched(s, i);
            double e;
            if (o && o->used && unsheared(f, i, c, &e)) {
                to->s += e;
                to->m++;
            }
        }
    }
}

/*
 * Variances of the sums over slots of weight * mean, by the contributions of
 * single galaxies: a galaxy in several images counts with the sum of its parts.
 */
static void add_variance(double var[2], const struct sums *sum, const struct field *f, int c)
{
    for (size_t i = 0; i < f->list->n; i++) {
        double u = 0, v = 0, e;
        for (size_t k = 0; k < f->n; k++) {
            const struct side *s = &f->side[k];
            const struct sums *m = &sum[s->slot];
            const struct fom_object *o = matched(s, i);
            if (!o || !o->used)
                continue;
            u += s->weight * (o->e[c] - m->e / m->n) / m->n;
            if (unsheared(f, i, c, &e))
                v += s->weight * (e - m->s / m->m) / m->m;
        }
        var[0] += u * u;
        var[1] += v * v;
    }
    for (size_t k = 0; k < f->n; k++) {
        const struct side *s = &f->side[k];
        const struct sums *m = &sum[s->slot];
        for (size_t i = 0; i < s->im->n; i++)
            if (s->im->object[i].used && !s->taken[i]) {
                double u = s->weight * (s->im->object[i].e[c] - m->e / m->n) / m->n;
                var[0] += u * u;
            }
    }
}

/*
 * Error of sum r / sum g when the parts of the skies are left out one at a time: galaxies near each other, and the same
 * galaxy under several noises, are not independent.  NaN below 8 parts.
 */
static int block_error(const struct common *all, const double *g, double value, size_t skies, double *error)
{
    size_t n = FOM_PARTS * skies, used = 0;
    double *sum = calloc(2 * n + 1, sizeof *sum), total = 0, var = 0;
    if (!sum)
        return E_NOMEM;
    for (size_t i = 0; i < all->n; i++) {
        sum[2 * all->block[i]] += all->r[i];
        sum[2 * all->block[i] + 1] += g[i];
        total += g[i];
    }
    for (size_t k = 0; k < n; k++) {
        const double d = (sum[2 * k] - value * sum[2 * k + 1]) / (total - sum[2 * k + 1]);
        used += sum[2 * k] != 0 || sum[2 * k + 1] != 0;
        var += d * d;
    }
    *error = used >= 8 ? sqrt(var * (double)(used - 1) / (double)used) : NAN;
    free(sum);
    return OK;
}

static int ratios(struct fom_pairs *out, const struct common *all, size_t skies, long draws, uint64_t seed)
{
    struct stats t;
    int st = stats_ratio(all->n, all->r, all->g, draws, seed, &out->scalar);
    if (st == OK)
        st = stats_ratio(all->n, all->r, all->p, 0, seed, &out->tensor);
    if (st == OK)
        st = block_error(all, all->g, out->scalar.value, skies, &out->scalar_block);
    if (st == OK)
        st = block_error(all, all->p, out->tensor.value, skies, &out->tensor_block);
    stats_sum(all->n, all->g, &t);
    out->response = t.mean;
    stats_sum(all->n, all->mean, &t);
    out->mean = t.mean;
    out->mean_se = sqrt(t.var / (double)all->n);
    out->common = all->n;
    return st == E_RANGE || st == E_SINGULAR ? OK : st;
}

/* Totals over the slots; selection only where every catalogue has marked rows and a g = 0 list. */
static void means(struct fom_pairs *out, const struct sums *sum, const double var[2], const struct field *f,
                  size_t fields)
{
    double total = 0, selection = 0;
    int marked = 1;
    for (size_t j = 0; j < fields; j++) {
        marked &= f[j].has_zero && f[j].list->marked;
        for (size_t k = 0; k < f[j].n; k++)
            marked &= f[j].side[k].im->marked;
    }
    for (size_t k = 0; k < f[0].n; k++) {
        const struct side *s = &f[0].side[k];
        total += s->weight * sum[s->slot].e / sum[s->slot].n;
        selection += s->weight * sum[s->slot].s / sum[s->slot].m;
    }
    out->total = total;
    out->total_se = sqrt(var[0]);
    out->selection = marked ? selection : NAN;
    out->selection_se = marked ? sqrt(var[1]) : NAN;
}

static int is_first(size_t n, const struct fom_image *const *im, size_t i)
{
    for (size_t j = 0; j < i && j < n; j++)
        if (strcmp(im[j]->field, im[i]->field) == 0)
            return 0;
    return 1;
}

int fom_pairs(size_t n, const struct fom_image *const *im, int component, const struct fom_pair_options *o,
              struct fom_pairs *out)
{
    const struct ratio none = {.value = NAN, .se = NAN, .jackknife = NAN, .bootstrap = NAN};
    struct fom_pairs r = {.scalar = none, .tensor = none, .scalar_block = NAN, .tensor_block = NAN, .response = NAN, .mean = NAN, .mean_se = NAN, .total = NAN,
                          .total_se = NAN, .selection = NAN, .selection_se = NAN};
    double var[2] = {0};
    struct sums sum[LEVELS] = {{0}};
    struct common all = {0};
    struct levels levels;
    find_levels(&levels, n, im, component, o->psf);
    int st = OK;
    struct field *f = calloc(n + 1, sizeof *f);
    size_t fields = 0;
    if (!f)
        return E_NOMEM;
    for (size_t i = 0; i < n && levels.n > 0 && st == OK; i++)
        if (is_first(n, im, i)) {
            st = field_open(&f[fields], n, im, im[i]->field, component, &levels, o->radius);
            if (st == OK)
                st = add_common(&all, &f[fields++], component, o->everywhere);
        }
    if (st == OK && fields > 0) {
        for (size_t j = 0; j < fields; j++)
            add_sums(sum, &f[j], component);
        for (size_t j = 0; j < fields; j++)
            add_variance(var, sum, &f[j], component);
        means(&r, sum, var, f, fields);
        st = ratios(&r, &all, n, o->draws, o->seed);
    }
    for (size_t j = 0; j < fields; j++)
        field_free(&f[j]);
    free(f);
    free(all.r);
    free(all.g);
    free(all.p);
    free(all.mean);
    free(all.block);
    if (st == OK)
        *out = r;
    return st;
}
