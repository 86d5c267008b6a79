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
enum { FIELDS = sizeof fields / sizeof *fields, CHUNK = 32 };

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

enum { NUMBER, X, Y, A, B, SKY, RMS, INPUTS };

/* The columns that a measurement starts from; SKY and RMS may be NULL. */
static int find_inputs(const struct table *t, const struct column *c[INPUTS], struct err *e)
{
    static const char *const name[] = {"NUMBER", "X_IMAGE", "Y_IMAGE", "A_IMAGE", "B_IMAGE", "BACKGROUND", "BACKRMS"};
    for (int k = 0; k < INPUTS; k++) {
        c[k] = table_find(t, name[k]);
        if (k < SKY && (!c[k] || c[k]->type == COL_TEXT || c[k]->type == COL_RAGGED))
            return err_set(e, E_MISSING, "no column of numbers %s: rrgshape needs NUMBER X_IMAGE Y_IMAGE A_IMAGE B_IMAGE", name[k]);
    }
    return OK;
}

/* Start position, width, sky of row i. */
static struct moments_object object_of(const struct column *const c[INPUTS], const struct shapecat_options *opt, size_t i)
{
    double w = opt->mult * sqrt(table_number(c[A], i) * table_number(c[B], i));
    if (!(w > opt->min))
        w = opt->min;
    if (w > opt->max)
        w = opt->max;
    const double noise = c[RMS] ? table_number(c[RMS], i) : NAN, level = c[SKY] ? table_number(c[SKY], i) : 0;
    return (struct moments_object){
        .x = table_number(c[X], i) - 1, .y = table_number(c[Y], i) - 1, .w = opt->fixed > 0 ? opt->fixed : w,
        .label = table_number(c[NUMBER], i), .sky = opt->no_background || !isfinite(level) ? 0 : level,
        .sky_var = noise >= 0 ? noise * noise : opt->sky_var};
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
    const struct column *c[INPUTS], *flags = table_find(t, "FLAGS"), *flux = table_find(t, "FLUX_AUTO");
    int st = find_inputs(t, c, e);
    if (st)
        return st;
    struct moments_object *all = calloc(t->nrow + 1, sizeof *all), *out = calloc(t->nrow + 1, sizeof *out);
    if (!all || !out) {
        free(all);
        free(out);
        return err_set(e, E_NOMEM, "%s", err_text(E_NOMEM));
    }
    for (size_t i = 0; i < t->nrow; i++)
        all[i] = object_of(c, opt, i);
    *n = 0;
    for (size_t i = 0; i < t->nrow; i++)
        if ((!flags || table_number(flags, i) < 4) && (!flux || !outshone(t->nrow, all, flux, radius, i)))
            out[(*n)++] = all[i];
    free(all);
    *stars = out;
    return OK;
}

struct shapecat {
    struct table *t;
    const struct moments_map *map;
    const struct starmom *psf;
    const struct shapecat_options *opt;
    const struct rrg_options *rrg;            /* of the correction at work */
    struct rrg_psf first;                     /* the PSF under opt->first_width, its errors */
    double first_cov[STARMOM_N][STARMOM_N];
    const struct column *input[INPUTS];
    size_t column[FIELDS], flags;             /* of the table, in the order of fields[] */
    size_t cap;
    struct moments *kept;                     /* of every row, with opt->keep */
    struct par_team *team;
    struct moments_scratch *scratch;          /* of every thread */
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
static void correct(const struct shapecat *s, const struct moments *m, const struct rrg_psf *own, struct rrg *r, double stars[2])
{
    const int first = s->rrg->first && s->psf;
    const struct rrg_psf *psf = first ? &s->first : own;
    double here[STARMOM_N][STARMOM_N];
    rrg_correct(m, psf, s->rrg, r);
    stars[0] = stars[1] = isnan(r->e[0]) ? NAN : 0;
    if (!s->psf || !(s->psf->err[0][0] > 0))
        return;
    if (!first)
        starmom_cov(s->psf, m->w, here);
    rrg_psf_error(m, psf, s->rrg, first ? s->first_cov : here, r, stars);
}

static int measure_row(const struct shapecat *s, size_t i, int worker, struct moments *m)
{
    const struct moments_object o = object_of(s->input, s->opt, i);
    int st = moments_measure(s->map, &o, &s->opt->moments, &s->scratch[worker], m);
    if (st == E_RANGE) {
        *m = unmeasured(&o);
        st = OK;
    }
    return st;
}

static void correct_row(const struct shapecat *s, size_t i, const struct moments *m)
{
    struct rrg_psf psf = {.w = m->w};
    struct rrg r;
    double v[FIELDS], stars[2];
    if (s->psf)
        starmom_at(s->psf, m->w, &psf);
    correct(s, m, &psf, &r, stars);
    fill_row(m, &r, sqrt(0.5 * (psf.m2[0] + psf.m2[2])), stars, v);
    for (int k = 0; k < FIELDS; k++)
        s->t->col[s->column[k]].v.r[i] = v[k];
    s->t->col[s->flags].v.i[i] = r.flags;
}

static int shape_rows(void *ctx, long begin, long end, int worker)
{
    const struct shapecat *s = ctx;
    for (size_t i = (size_t)begin; i < (size_t)end; i++) {
        struct moments m;
        int st = measure_row(s, i, worker, &m);
        if (st)
            return st;
        correct_row(s, i, &m);
        if (s->kept)
            s->kept[i] = m;
    }
    return OK;
}

static int correct_rows(void *ctx, long begin, long end, int worker)
{
    const struct shapecat *s = ctx;
    (void)worker;
    for (size_t i = (size_t)begin; i < (size_t)end; i++)
        correct_row(s, i, &s->kept[i]);
    return OK;
}

/* The column to write to: a new one, or the one of an earlier measurement. */
static int column_for(struct table *t, const char *name, enum col_type type, const char *unit, const char *what, size_t *index)
{
    const struct column *c = table_find(t, name);
    if (!c) {
        *index = t->ncol;
        return table_add(t, name, type, unit, what);
    }
    *index = (size_t)(c - t->col);
    int same = type == COL_INT ? c->type == COL_INT : c->type == COL_REAL || c->type == COL_REAL32;
    return same ? OK : E_DATA;
}

static int add_columns(struct shapecat *s)
{
    int st = OK;
    for (int k = 0; k < FIELDS && st == OK; k++)
        st = column_for(s->t, fields[k].name, COL_REAL, fields[k].unit, fields[k].what, &s->column[k]);
    return st ? st : column_for(s->t, "FLAGS_RRG", COL_INT, "", "what went wrong, see rrgshape(1)", &s->flags);
}

int shapecat_open(struct shapecat **out, struct table *t, const struct moments_map *map, const struct starmom *psf,
                  const struct shapecat_options *opt, struct err *e)
{
    const struct column *c[INPUTS];
    int st = find_inputs(t, c, e);
    if (st)
        return st;
    struct shapecat *s = calloc(1, sizeof *s);
    if (!s || !(s->scratch = calloc((size_t)opt->threads, sizeof *s->scratch))) {
        free(s);
        return err_set(e, E_NOMEM, "%s", err_text(E_NOMEM));
    }
    s->t = t;
    s->map = map;
    s->psf = psf;
    s->opt = opt;
    if ((st = add_columns(s))) {
        shapecat_close(s);
        return err_set(e, st, "%s", st == E_DATA ? "a column with the name of a shape column is of another type"
                                  : st == E_RANGE ? "no column fits behind COEFFS, whose rows have any length" : err_text(st));
    }
    if (psf) {
        starmom_at(psf, opt->first_width, &s->first);
        starmom_cov(psf, opt->first_width, s->first_cov);
    }
    *out = s;
    return OK;
}

void shapecat_close(struct shapecat *s)
{
    if (!s)
        return;
    par_team_free(s->team);
    for (int k = 0; k < s->opt->threads; k++)
        moments_scratch_free(&s->scratch[k]);
    free(s->scratch);
    free(s->kept);
    free(s);
}

int shapecat_measure(struct shapecat *s, long *bad)
{
    struct err e;
    int st = find_inputs(s->t, s->input, &e);
    if (st)
        return st;
    if (s->opt->keep && s->t->nrow > s->cap) {
        struct moments *kept = realloc(s->kept, s->t->nrow * sizeof *kept);
        if (!kept)
            return E_NOMEM;
        s->kept = kept;
        s->cap = s->t->nrow;
    }
    if (!s->team && s->t->nrow > CHUNK)
        s->team = par_team_new(s->opt->threads);
    s->rrg = &s->opt->rrg;
    st = par_team_for(s->team, (long)s->t->nrow, CHUNK, shape_rows, s);
    *bad = 0;
    for (size_t i = 0; i < s->t->nrow && st == OK; i++)
        *bad += s->t->col[s->flags].v.i[i] != 0;
    return st;
}

int shapecat_correct(struct shapecat *s, const struct rrg_options *rrg)
{
    s->rrg = rrg;
    return s->t->nrow > s->cap ? E_RANGE : par_team_for(s->team, (long)s->t->nrow, CHUNK, correct_rows, s);
}

void shapecat_region(const struct shapecat *s, struct region *r)
{
    const struct table *t = s->t;
    const double *x = table_reals(t, "X_RRG"), *y = table_reals(t, "Y_RRG"), *w = table_reals(t, "WIDTH");
    const double *xx = table_reals(t, "JXX_RAW"), *xy = table_reals(t, "JXY_RAW"), *yy = table_reals(t, "JYY_RAW");
    const int64_t *flags = table_ints(t, "FLAGS_RRG");
    const struct column *number = table_find(t, "NUMBER");
    for (size_t i = 0; i < t->nrow; i++) {
        const double mean = 0.5 * (xx[i] + yy[i]), half = 0.5 * hypot(xx[i] - yy[i], 2 * xy[i]);
        const int good = mean - half > 0;
        if (isfinite(x[i]) && isfinite(y[i]))
            region_ellipse(r, x[i], y[i], good ? 2 * sqrt(mean + half) : w[i], good ? 2 * sqrt(mean - half) : w[i],
                           good ? 90 / M_PI * atan2(2 * xy[i], xx[i] - yy[i]) : 0, (size_t)table_number(number, i),
                           flags[i] ? "red" : NULL);
    }
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
