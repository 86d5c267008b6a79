/* shapecat.c - shapes of a catalogue of objects on an image. */
#include "shapecat.h"
#include "catkeys.h"
#include "par.h"
#include "stats.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct field {
    const char *name, *unit, *what;
};

/* In the order of the output; fill_row() writes the same order. */
static const struct field fields[] = {
    {"WIDTH", "pixel", "rms width of the weight"},
    {"X_RRG", "pixel", "weighted centroid, first pixel centre is 1"},
    {"Y_RRG", "pixel", "weighted centroid, first pixel centre is 1"},
    {"S_RRG", "", "weighted flux, unit of the image"},
    {"SERR_RRG", "", "error of S_RRG"},
    {"JXX_RAW", "pixel2", "weighted moment as observed"},
    {"JXY_RAW", "pixel2", "weighted moment as observed"},
    {"JYY_RAW", "pixel2", "weighted moment as observed"},
    {"JXXERR_RAW", "pixel2", "error of JXX_RAW"},
    {"JXYERR_RAW", "pixel2", "error of JXY_RAW"},
    {"JYYERR_RAW", "pixel2", "error of JYY_RAW"},
    {"JXXX_RAW", "pixel3", "weighted moment as observed"},
    {"JXXY_RAW", "pixel3", "weighted moment as observed"},
    {"JXYY_RAW", "pixel3", "weighted moment as observed"},
    {"JYYY_RAW", "pixel3", "weighted moment as observed"},
    {"JXXXX_RAW", "pixel4", "weighted moment as observed"},
    {"JXXXY_RAW", "pixel4", "weighted moment as observed"},
    {"JXXYY_RAW", "pixel4", "weighted moment as observed"},
    {"JXYYY_RAW", "pixel4", "weighted moment as observed"},
    {"JYYYY_RAW", "pixel4", "weighted moment as observed"},
    {"WEFF", "pixel", "width of the weight the corrected moments belong to"},
    {"JXX", "pixel2", "moment before the PSF"},
    {"JXY", "pixel2", "moment before the PSF"},
    {"JYY", "pixel2", "moment before the PSF"},
    {"JXXERR", "pixel2", "error of JXX"},
    {"JXYERR", "pixel2", "error of JXY"},
    {"JYYERR", "pixel2", "error of JYY"},
    {"TERR", "pixel2", "error of JXX + JYY"},
    {"JXXX", "pixel3", "moment before the PSF"},
    {"JXXY", "pixel3", "moment before the PSF"},
    {"JXYY", "pixel3", "moment before the PSF"},
    {"JYYY", "pixel3", "moment before the PSF"},
    {"JXXXX", "pixel4", "moment before the PSF"},
    {"JXXXY", "pixel4", "moment before the PSF"},
    {"JXXYY", "pixel4", "moment before the PSF"},
    {"JXYYY", "pixel4", "moment before the PSF"},
    {"JYYYY", "pixel4", "moment before the PSF"},
    {"D_RRG", "pixel", "rms size as observed"},
    {"DERR_RRG", "pixel", "error of D_RRG"},
    {"D_PSF", "pixel", "rms size of a star under the same weight"},
    {"E1", "", "ellipticity along x"},
    {"E2", "", "ellipticity along the diagonal"},
    {"E1ERR", "", "error of E1, by noise and stars"},
    {"E2ERR", "", "error of E2, by noise and stars"},
    {"E1ERR_STARS", "", "error of E1 by the stars alone, common to all objects"},
    {"E2ERR_STARS", "", "error of E2 by the stars alone, common to all objects"},
    {"LAMBDA", "", "trace term of the response"},
    {"MU1", "", "term of the response along x"},
    {"MU2", "", "term of the response along the diagonal"},
    {"P11", "", "response of E1 to shear 1"},
    {"P22", "", "response of E2 to shear 2"},
    {"MASKED", "", "part of the weight covered by neighbours"},
};
enum { FIELDS = sizeof fields / sizeof *fields };

static double root(double var)
{
    return sqrt(var > 0 || isnan(var) ? var : 0);
}

static double *put(double *to, const double *from, int n)
{
    for (int i = 0; i < n; i++)
        *to++ = from[i];
    return to;
}

/* stars: errors of e by the stars. */
static void fill_row(const struct moments *m, const struct rrg *r, double dpsf, const double stars[2], double v[FIELDS])
{
    const double *c = m->cov, *k = r->cov;
    double *p = put(v, (double[]){m->w, m->x + 1, m->y + 1, m->s, root(m->s_var)}, 5);
    p = put(p, m->m2, 3);
    p = put(p, (double[]){root(c[0]), root(c[3]), root(c[5])}, 3);
    p = put(p, m->m3, 4);
    p = put(p, m->m4, 5);
    p = put(p, &r->weff, 1);
    p = put(p, r->m2, 3);
    p = put(p, (double[]){root(k[0]), root(k[3]), root(k[5]), root(k[0] + k[5] + 2 * k[2])}, 4);
    p = put(p, r->m3, 4);
    p = put(p, r->m4, 5);
    p = put(p, (double[]){r->d, r->d_err, dpsf}, 3);
    p = put(p, r->e, 2);
    p = put(p, (double[]){hypot(r->e_err[0], stars[0]), hypot(r->e_err[1], stars[1])}, 2);
    p = put(p, stars, 2);
    p = put(p, (double[]){r->lambda, r->mu[0], r->mu[1], r->p11, r->p22, m->masked}, 6);
}

int shapecat_objects(const struct table *t, const struct shapecat_options *opt, struct moments_object **objects,
                     struct err *e)
{
    static const char *const need[] = {"NUMBER", "X_IMAGE", "Y_IMAGE", "A_IMAGE", "B_IMAGE"};
    const struct column *c[5];
    for (int k = 0; k < 5; k++) {
        c[k] = table_find(t, need[k]);
        if (!c[k] || c[k]->type == COL_TEXT || c[k]->type == COL_RAGGED)
            return err_set(e, E_MISSING, "no column of numbers %s: rrgshape needs NUMBER X_IMAGE Y_IMAGE A_IMAGE B_IMAGE", need[k]);
    }
    const struct column *sky = table_find(t, "BACKGROUND"), *rms = table_find(t, "BACKRMS");
    struct moments_object *o = calloc(t->nrow + 1, sizeof *o);
    if (!o)
        return err_set(e, E_NOMEM, "%s", err_text(E_NOMEM));
    for (size_t i = 0; i < t->nrow; i++) {
        double w = opt->mult * sqrt(table_number(c[3], i) * table_number(c[4], i));
        if (!(w > opt->min))
            w = opt->min;
        if (w > opt->max)
            w = opt->max;
        double noise = rms ? table_number(rms, i) : NAN, level = sky ? table_number(sky, i) : 0;
        o[i] = (struct moments_object){
            .x = table_number(c[1], i) - 1, .y = table_number(c[2], i) - 1, .w = opt->fixed > 0 ? opt->fixed : w,
            .label = table_number(c[0], i), .sky = opt->no_background || !isfinite(level) ? 0 : level,
            .sky_var = noise >= 0 ? noise * noise : opt->sky_var};
    }
    *objects = o;
    return OK;
}

/* A brighter object of the catalogue is nearer than radius. */
static int outshone(size_t n, const struct moments_object *o, const struct column *flux, double radius, size_t i)
{
    for (size_t j = 0; j < n; j++)
        if (fabs(o[j].y - o[i].y) < radius && table_number(flux, j) > table_number(flux, i) &&
            hypot(o[j].x - o[i].x, o[j].y - o[i].y) < radius)
            return 1;
    return 0;
}

int shapecat_stars(const struct table *t, const struct shapecat_options *opt, double radius,
                   struct moments_object **stars, size_t *n, struct err *e)
{
    struct moments_object *all = NULL, *out;
    int st = shapecat_objects(t, opt, &all, e);
    if (st)
        return st;
    out = calloc(t->nrow + 1, sizeof *out);
    if (!out) {
        free(all);
        return err_set(e, E_NOMEM, "%s", err_text(E_NOMEM));
    }
    const struct column *flags = table_find(t, "FLAGS"), *flux = table_find(t, "FLUX_AUTO");
    *n = 0;
    for (size_t i = 0; i < t->nrow; i++)
        if ((!flags || table_number(flags, i) < 4) && (!flux || !outshone(t->nrow, all, flux, radius, i)))
            out[(*n)++] = all[i];
    free(all);
    *stars = out;
    return OK;
}

struct job {
    const struct moments_map *map;            /* NULL: the moments are in opt->raw */
    const struct moments_object *objects;
    const struct starmom *psf;
    const struct shapecat_options *opt;
    struct rrg_psf first;
    double first_cov[STARMOM_N][STARMOM_N];
    struct moments_scratch *scratch;
    double *out[FIELDS];
    int64_t *flags;
    struct progress *bar;
};

/* A row that cannot be measured at all: position or width is not a number. */
static struct moments unmeasured(const struct moments_object *o)
{
    struct moments m = {.x = o->x, .y = o->y, .w = o->w, .s = NAN, .s_var = NAN, .flags = SHAPE_NOFLUX};
    double *all[] = {m.m2, m.m3, m.m4, m.cov};
    const int n[] = {3, 4, 5, 6};
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < n[k]; i++)
            all[k][i] = NAN;
    return m;
}

/* PSF correction, and the errors of e that the stars leave. */
static void correct(const struct job *job, const struct moments *m, const struct rrg_psf *own, struct rrg *r, double stars[2])
{
    const int first = job->opt->rrg.first && job->psf;
    const struct rrg_psf *psf = first ? &job->first : own;
    double here[STARMOM_N][STARMOM_N];
    rrg_correct(m, psf, &job->opt->rrg, r);
    stars[0] = stars[1] = isnan(r->e[0]) ? NAN : 0;
    if (!job->psf || !(job->psf->err[0][0] > 0))
        return;
    if (!first)
        starmom_cov(job->psf, m->w, here);
    rrg_psf_error(m, psf, &job->opt->rrg, first ? job->first_cov : here, r, stars);
}

/* Moments of row i: measured, or from what an earlier measurement kept. */
static int row_moments(const struct job *job, long i, int worker, struct moments *m)
{
    struct moments *raw = job->opt->raw ? &job->opt->raw[i] : m;
    int st = OK;
    if (job->map)
        st = moments_measure(job->map, &job->objects[i], &job->opt->moments, &job->scratch[worker], raw);
    if (st == E_RANGE)
        *raw = unmeasured(&job->objects[i]);
    else if (st)
        return st;
    if (raw != m)
        *m = *raw;
    return OK;
}

static int measure_rows(void *ctx, long begin, long end, int worker)
{
    struct job *job = ctx;
    for (long i = begin; i < end; i++) {
        const struct moments_object *o = &job->objects[i];
        struct moments m;
        struct rrg_psf psf = {.w = o->w};
        struct rrg r;
        double v[FIELDS];
        int st = row_moments(job, i, worker, &m);
        if (st)
            return st;
        if (job->psf)
            starmom_at(job->psf, o->w, &psf);
        double dpsf = sqrt(0.5 * (psf.m2[0] + psf.m2[2])), stars[2];
        correct(job, &m, &psf, &r, stars);
        fill_row(&m, &r, dpsf, stars, v);
        for (int k = 0; k < FIELDS; k++)
            job->out[k][i] = v[k];
        job->flags[i] = r.flags;
    }
    if (job->bar)
        progress_tick(job->bar, end - begin);
    return OK;
}

/* The column to write to: a new one, or the one of an earlier measurement. */
static int column_for(struct table *t, const char *name, enum col_type type, const char *unit, const char *what)
{
    const struct column *c = table_find(t, name);
    if (!c)
        return table_add(t, name, type, unit, what);
    int same = type == COL_INT ? c->type == COL_INT : c->type == COL_REAL || c->type == COL_REAL32;
    return same ? OK : E_DATA;
}

double shapecat_bytes(size_t rows)
{
    return 8.0 * (FIELDS + 1) * (double)rows;
}

static int fill_columns(struct table *t, const struct moments_map *map, const struct moments_object *objects,
                        const struct starmom *psf, const struct shapecat_options *opt, struct progress *bar, long *bad)
{
    struct job job = {.map = map, .objects = objects, .psf = psf, .opt = opt, .bar = bar};
    int st = OK;
    for (int k = 0; k < FIELDS && st == OK; k++)
        st = column_for(t, fields[k].name, COL_REAL, fields[k].unit, fields[k].what);
    if (st == OK)
        st = column_for(t, "FLAGS_RRG", COL_INT, "", "what went wrong, see rrgshape(1)");
    if (st)
        return st;
    for (int k = 0; k < FIELDS; k++)
        job.out[k] = table_reals(t, fields[k].name);
    job.flags = table_ints(t, "FLAGS_RRG");
    if (opt->rrg.first && psf) {
        starmom_at(psf, opt->first_width, &job.first);
        starmom_cov(psf, opt->first_width, job.first_cov);
    }
    job.scratch = calloc((size_t)opt->threads, sizeof *job.scratch);
    if (!job.scratch)
        return E_NOMEM;
    st = par_for((long)t->nrow, 64, opt->threads, measure_rows, &job);
    for (int k = 0; k < opt->threads; k++)
        moments_scratch_free(&job.scratch[k]);
    free(job.scratch);
    *bad = 0;
    for (size_t i = 0; i < t->nrow && st == OK; i++)
        *bad += job.flags[i] != 0;
    return st;
}

int shapecat_measure(struct table *t, const struct moments_map *map, const struct moments_object *objects,
                     const struct starmom *psf, const struct shapecat_options *opt, struct progress *bar, long *bad)
{
    return fill_columns(t, map, objects, psf, opt, bar, bad);
}

int shapecat_correct(struct table *t, const struct moments_object *objects, const struct starmom *psf,
                     const struct shapecat_options *opt)
{
    long bad;
    return opt->raw ? fill_columns(t, NULL, objects, psf, opt, NULL, &bad) : E_RANGE;
}

/* Column names: PXXERR, and PXX_PXY for the covariance of two moments. */
static void error_name(char to[16], int q)
{
    snprintf(to, 16, "%sERR", starmom_name[q]);
}

static void cov_name(char to[16], int q, int r)
{
    snprintf(to, 16, "%s_%s", starmom_name[q], starmom_name[r]);
}

static int add_star_columns(struct table *t)
{
    static const char *const unit[] = {"pixel2", "pixel4", "pixel4", "pixel6", "pixel8"};
    char name[16];
    int st = table_add(t, "WIDTH", COL_REAL, "pixel", "rms width of the weight");
    if (st == OK)
        st = table_add(t, "NSTARS", COL_INT, "", "stars in the mean");
    for (int q = 0; q < STARMOM_N && st == OK; q++)
        st = table_add(t, starmom_name[q], COL_REAL, q < 3 ? "pixel2" : "pixel4", "mean normalised moment");
    for (int q = 0; q < STARMOM_N && st == OK; q++) {
        error_name(name, q);
        st = table_add(t, name, COL_REAL, q < 3 ? "pixel2" : "pixel4", "standard error of the mean");
    }
    for (int q = 0; q < STARMOM_N && st == OK; q++)
        for (int r = q + 1; r < STARMOM_N && st == OK; r++) {
            cov_name(name, q, r);
            st = table_add(t, name, COL_REAL, unit[2 + (q >= 3) + (r >= 3)], "covariance of two means");
        }
    return st;
}

int starmom_to_table(const struct starmom *s, struct table *t)
{
    char name[16];
    int st = add_star_columns(t);
    if (st == OK)
        st = table_resize(t, (size_t)s->n);
    if (st)
        return st;
    for (int i = 0; i < s->n; i++) {
        table_reals(t, "WIDTH")[i] = s->w[i];
        table_ints(t, "NSTARS")[i] = s->stars[i];
        for (int q = 0, pair = 0; q < STARMOM_N; q++) {
            error_name(name, q);
            table_reals(t, starmom_name[q])[i] = s->m[q][i];
            table_reals(t, name)[i] = s->err[q][i];
            for (int r = q + 1; r < STARMOM_N; r++, pair++) {
                cov_name(name, q, r);
                table_reals(t, name)[i] = s->cov[pair][i];
            }
        }
    }
    st = table_set_number(t, "DSTAR", s->dstar);
    if (st == OK)
        st = table_set_number(t, "DSTARW", s->dstar_w);
    if (st == OK && isfinite(s->dstar_err))
        st = table_set_number(t, "DSTARERR", s->dstar_err);
    return st;
}

/* Errors and covariances, where the file has them; a file without is of a PSF that is known. */
static void star_errors(struct starmom *s, const struct table *t)
{
    char name[16];
    for (int q = 0, pair = 0; q < STARMOM_N; q++) {
        error_name(name, q);
        const double *v = table_reals(t, name);
        if (v)
            memcpy(s->err[q], v, t->nrow * sizeof *v);
        for (int r = q + 1; r < STARMOM_N; r++, pair++) {
            cov_name(name, q, r);
            v = table_reals(t, name);
            if (v)
                memcpy(s->cov[pair], v, t->nrow * sizeof *v);
        }
    }
}

int starmom_from_table(struct starmom *s, const struct table *t, struct err *e)
{
    struct starmom r = {0};
    const double *w = table_reals(t, "WIDTH");
    if (!w || t->nrow < 4 || t->nrow > STARMOM_MAX)
        return err_set(e, E_DATA, "not a star-moment file (column WIDTH, 4 to %d rows): make one with rrgshape --stars-only",
                       STARMOM_MAX);
    r.n = (int)t->nrow;
    for (int q = 0; q < STARMOM_N; q++) {
        const double *m = table_reals(t, starmom_name[q]);
        if (!m)
            return err_set(e, E_MISSING, "no column %s: make the file with rrgshape --stars-only", starmom_name[q]);
        memcpy(r.m[q], m, t->nrow * sizeof *m);
    }
    memcpy(r.w, w, t->nrow * sizeof *w);
    star_errors(&r, t);
    int st = catkeys_number(t, "DSTAR", &r.dstar, e);
    if (st == OK)
        st = catkeys_number(t, "DSTARERR", &r.dstar_err, e);
    if (st == OK)
        st = catkeys_number(t, "DSTARW", &r.dstar_w, e);
    if (st)
        return st;
    if (starmom_prepare(&r) != OK)
        return err_set(e, E_DATA, "widths do not rise, or a moment is not a number");
    *s = r;
    return OK;
}

int shapecat_own_size(const struct moments_map *map, size_t n, const struct moments_object *stars,
                      const struct moments_options *opt, double *dstar)
{
    double *d = malloc((n + 1) * sizeof *d);
    struct moments_scratch sc = {0};
    size_t used = 0;
    int st = d ? OK : E_NOMEM;
    for (size_t i = 0; i < n && st == OK; i++) {
        struct moments m;
        st = moments_measure(map, &stars[i], opt, &sc, &m);
        if (st == OK && (m.flags & ~SHAPE_NEARSINGULAR) == 0 && m.m2[0] + m.m2[2] > 0)
            d[used++] = sqrt(0.5 * (m.m2[0] + m.m2[2]));
        if (st == E_RANGE)
            st = OK;
    }
    if (st == OK)
        *dstar = stats_median(used, d);
    moments_scratch_free(&sc);
    free(d);
    return st;
}

int shapecat_noise(const struct moments_map *map, double *rms)
{
    size_t n = (size_t)map->nx * (size_t)map->ny, step = n / 1000000 + 1, used = 0;
    double *v = malloc((n / step + 1) * sizeof *v);
    if (!v)
        return E_NOMEM;
    for (size_t i = 0; i < n; i += step) {
        double x = map->pix64 ? map->pix64[i] : (double)map->pix[i];
        if (isfinite(x))
            v[used++] = x;
    }
    double mid = stats_median(used, v);
    for (size_t i = 0; i < used; i++)
        v[i] = fabs(v[i] - mid);
    *rms = used ? 1.4826 * stats_median(used, v) : 0;
    free(v);
    return OK;
}
