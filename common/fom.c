/* fom.c - figures of merit of one group of shape catalogues, and of groups together. */
#include "fom.h"
#include "fompair.h"
#include "stats.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LEAST_OBJECTS 30      /* below these no response is given */
#define LEAST_RESPONSE 0.2

#define PAIR_TEXTS(c) \
    {"NPAIR" c, "", "objects common to the sheared images"}, \
    {"BPAIR" c, "", "slope by common objects, ratio of means"}, \
    {"BPAIR" c "SE", "", "its standard error"}, \
    {"BPAIR" c "JK", "", "its error by jackknife"}, \
    {"BPAIR" c "BS", "", "its error by bootstrap"}, \
    {"BPAIR" c "BK", "", "its error by leaving out 16 parts of each sky"}, \
    {"BTENSOR" c, "", "slope by common objects, own response component"}, \
    {"BTENSOR" c "SE", "", "its standard error"}, \
    {"BTENSOR" c "BK", "", "its error by leaving out 16 parts of each sky"}, \
    {"CPAIR" c, "", "mean shear of common objects"}, \
    {"CPAIR" c "SE", "", "its standard error"}

const struct fom_text fom_column[FOM_QUANTITIES] = {
    {"N_DET", "arcmin-2", "detected objects"}, {"N_DETERR", "arcmin-2", "its spread over the images"},
    {"N_STARCUT", "arcmin-2", "left after the star cut"}, {"N_STARCUTERR", "arcmin-2", "its spread over the images"},
    {"N_ELLCUT", "arcmin-2", "left after the ellipticity cut"}, {"N_ELLCUTERR", "arcmin-2", "its spread over the images"},
    {"N_SIZECUT", "arcmin-2", "left after the size cut"}, {"N_SIZECUTERR", "arcmin-2", "its spread over the images"},
    {"N_SNRCUT", "arcmin-2", "left after the signal-to-noise cut"}, {"N_SNRCUTERR", "arcmin-2", "its spread over the images"},
    {"N_GAL", "arcmin-2", "galaxies used"},
    {"N_GALERR", "arcmin-2", "its spread over the images"},
    {"N_EFF", "arcmin-2", "effective number for equal weights"},
    {"G", "", "mean response"},
    {"SIGMA_E", "", "spread of the ellipticity"}, {"SIGMA_EERR", "", "its standard error"},
    {"B1", "", "slope of shear 1, fit"}, {"B1SE", "", "its standard error"}, {"B1JK", "", "its error by leaving out skies"},
    {"A1", "", "intercept of shear 1"}, {"A1SE", "", "its standard error"}, {"CHISQ1", "", "chi squared of the fit"},
    {"B2", "", "slope of shear 2, fit"}, {"B2SE", "", "its standard error"}, {"B2JK", "", "its error by leaving out skies"},
    {"A2", "", "intercept of shear 2"}, {"A2SE", "", "its standard error"}, {"CHISQ2", "", "chi squared of the fit"},
    {"DOF", "", "degrees of freedom"},
    {"SIGMA1", "", "spread of shear 1 before the line"}, {"SIGMA2", "", "spread of shear 2 before the line"},
    {"SIGMA_GAMMA", "", "spread of the shear, both components"}, {"SIGMA_GAMMAERR", "", "its standard error"},
    {"STDERR", "arcmin", "shear error of one square arcmin"}, {"STDERRERR", "arcmin", "its standard error"},
    {"SKEW1", "", "skewness of shear 1"}, {"SKEW1ERR", "", "its bootstrap error"},
    {"KURT1", "", "kurtosis of shear 1, less 3"}, {"KURT1ERR", "", "its bootstrap error"},
    {"SKEW2", "", "skewness of shear 2"}, {"SKEW2ERR", "", "its bootstrap error"},
    {"KURT2", "", "kurtosis of shear 2, less 3"}, {"KURT2ERR", "", "its bootstrap error"},
    PAIR_TEXTS("1"), PAIR_TEXTS("2"),
    {"MSEL1", "", "selection bias of shear 1"}, {"MSEL1SE", "", "its standard error"},
    {"MTOT1", "", "total bias, own selections"}, {"MTOT1SE", "", "its standard error"},
    {"MSEL2", "", "selection bias of shear 2"}, {"MSEL2SE", "", "its standard error"},
    {"MTOT2", "", "total bias, own selections"}, {"MTOT2SE", "", "its standard error"},
    {"LINE1", "", "slope 1 on the line"}, {"LINE1A", "", "line: slope at scale 0"}, {"LINE1ASE", "", "its standard error"},
    {"LINE1B", "arcsec-1", "line: change with scale"}, {"LINE1BSE", "arcsec-1", "its standard error"},
    {"LINE2", "", "slope 2 on the line"}, {"LINE2A", "", "line: slope at scale 0"}, {"LINE2ASE", "", "its standard error"},
    {"LINE2B", "arcsec-1", "line: change with scale"}, {"LINE2BSE", "arcsec-1", "its standard error"},
    {"LOGDC", "", "log10 of the power spectrum error"}, {"LOGDCERR", "", "its standard error"},
    {"LOGDCBS", "", "its bootstrap error against the reference"},
    {"OPTSCALE", "arcsec", "scale of the least power spectrum error of the set"}, {"OPTSCALEERR", "arcsec", "its bootstrap error"},
};

struct group {
    size_t n;
    const struct fom_image *const *im;
    const struct fom_options *o;
    double *v;
    size_t used;              /* used objects of all images */
    double g;                 /* response */
    size_t fields;
};

/* Number densities: means over the images, spread over the images (one image: sqrt N). */
static int densities(struct group *s)
{
    static const int to[5] = {FOM_N_DET, FOM_N_STARCUT, FOM_N_ELLCUT, FOM_N_SIZECUT, FOM_N_SNRCUT};
    double *per = malloc(s->n * sizeof *per), total = 0, area = 0;
    struct stats t;
    if (!per)
        return E_NOMEM;
    for (int k = 0; k < 5; k++) {
        for (size_t i = 0; i < s->n; i++)
            per[i] = s->im[i]->count[k] / s->im[i]->area;
        stats_sum(s->n, per, &t);
        s->v[to[k]] = t.mean;
        s->v[to[k] + 1] = s->n > 1 ? sqrt(t.var) : sqrt(s->im[0]->count[k]) / s->im[0]->area;
    }
    for (size_t i = 0; i < s->n; i++) {
        per[i] = (double)fom_image_used(s->im[i]) / s->im[i]->area;
        total += (double)fom_image_used(s->im[i]);
        area += s->im[i]->area;
    }
    stats_sum(s->n, per, &t);
    s->v[FOM_N_GAL] = t.mean;
    s->v[FOM_N_GALERR] = s->n > 1 ? sqrt(t.var) : sqrt(total) / area;
    free(per);
    return OK;
}

/* One G for the ensemble; NaN with fewer than 30 objects or G <= 0.2. */
static int response(struct group *s)
{
    double *v = malloc((s->used + 1) * sizeof *v);
    size_t n = 0;
    struct stats t;
    if (!v)
        return E_NOMEM;
    for (size_t k = 0; k < s->n; k++)
        for (size_t i = 0; i < s->im[k]->n; i++) {
            const struct fom_object *o = &s->im[k]->object[i];
            if (o->used)
                v[n++] = 0.5 * (o->p[0] + o->p[1]);
        }
    stats_sum(n, v, &t);
    s->g = s->o->median ? stats_median(n, v) : t.mean;
    if (n < LEAST_OBJECTS || !(s->g > LEAST_RESPONSE))
        s->g = NAN;
    s->v[FOM_G] = s->g;
    free(v);
    return OK;
}

/* Errors of skewness and kurtosis: m values drawn with replacement from the n pooled ones. */
static int shape_errors(const struct group *s, size_t n, const double *x, size_t m, double err[2])
{
    long draws = m > 3 ? s->o->draws : 0;
    double *draw = malloc((m + 1) * sizeof *draw), *skew = malloc(((size_t)draws + 1) * 2 * sizeof *skew);
    uint32_t *index = malloc((m + 1) * sizeof *index);
    int st = draw && skew && index ? OK : E_NOMEM;
    struct stats t;
    if (st == OK) {
        size_t used = 0;
        double *kurt = skew + draws;
        for (long k = 0; k < draws; k++) {
            stats_resample(n, m, s->o->seed, (uint64_t)k, index);
            for (size_t i = 0; i < m; i++)
                draw[i] = x[index[i]];
            stats_sum(m, draw, &t);
            if (isfinite(t.skew) && isfinite(t.kurt)) {
                skew[used] = t.skew;
                kurt[used++] = t.kurt;
            }
        }
        stats_sum(used, skew, &t);
        err[0] = sqrt(t.var);
        stats_sum(used, kurt, &t);
        err[1] = sqrt(t.var);
    }
    free(draw);
    free(skew);
    free(index);
    return st;
}

/* Spread, skewness and kurtosis of component c about the mean of each image; sigma of e. */
static int spread(struct group *s, int c, double *var_e)
{
    static const int at[2] = {FOM_SKEW1, FOM_SKEW2}, sigma[2] = {FOM_SIGMA1, FOM_SIGMA2};
    double *x = malloc((s->used + 1) * sizeof *x);
    if (!x)
        return E_NOMEM;
    size_t n = 0;
    for (size_t k = 0; k < s->n; k++) {
        size_t begin = n;
        struct stats t;
        for (size_t i = 0; i < s->im[k]->n; i++)
            if (s->im[k]->object[i].used)
                x[n++] = s->im[k]->object[i].e[c];
        stats_sum(n - begin, x + begin, &t);
        for (size_t i = begin; i < n; i++)
            x[i] -= t.mean;
    }
    struct stats t;
    double err[2] = {NAN, NAN};
    /* images of one field show the same galaxies: so many independent ones */
    size_t m = s->n ? n * s->fields / s->n : 0;
    stats_sum(n, x, &t);
    *var_e = n > s->n ? t.var * (double)(n - 1) / (double)(n - s->n) : NAN;
    s->v[sigma[c]] = sqrt(*var_e) / s->g;
    int st = shape_errors(s, n, x, m, err);
    s->v[at[c]] = t.skew;
    s->v[at[c] + 1] = err[0];
    s->v[at[c] + 2] = t.kurt;
    s->v[at[c] + 3] = err[1];
    free(x);
    return st;
}

/* The points of the fit: x the shear put in, y = <e>/G, err sigma/sqrt(n); sky[k] is the sky of point k. */
struct points {
    size_t n;
    double *x, *y, *err;
    size_t *sky;
};

static void gather(const struct group *s, int c, double sigma, struct points *p)
{
    for (size_t k = 0; k < s->n; k++) {
        struct sum sum = {0};
        size_t n = fom_image_used(s->im[k]), sky = 0;
        for (size_t i = 0; i < s->im[k]->n; i++)
            if (s->im[k]->object[i].used)
                sum_add(&sum, s->im[k]->object[i].e[c]);
        if (n < 2)
            continue;
        while (strcmp(s->im[sky]->sky, s->im[k]->sky) != 0)
            sky++;
        p->x[p->n] = s->o->psf ? s->im[k]->epsf[c] : s->im[k]->g[c];
        p->y[p->n] = sum_value(&sum) / (double)n / s->g;
        p->err[p->n] = sigma / sqrt((double)n);
        p->sky[p->n++] = sky;
    }
}

/* Jackknife of the slope over skies, whose images share their galaxies; NaN below three. */
static double fit_jackknife(const struct group *s, const struct points *p, struct points *rest)
{
    double sum = 0, sum2 = 0, m = 0;
    for (size_t out = 0; out < s->n; out++) {
        struct line_fit f;
        rest->n = 0;
        for (size_t k = 0; k < p->n; k++)
            if (p->sky[k] != out) {
                rest->x[rest->n] = p->x[k];
                rest->y[rest->n] = p->y[k];
                rest->err[rest->n++] = p->err[k];
            }
        if (rest->n == p->n)
            continue;
        if (stats_line(rest->n, rest->x, rest->y, rest->err, &f))
            return NAN;
        sum += f.b;
        sum2 += f.b * f.b;
        m++;
    }
    return m >= 3 ? sqrt((m - 1) * fmax(sum2 / m - (sum / m) * (sum / m), 0)) : NAN;
}

/* The paper's fit: every image a point. */
static int fit(struct group *s, int c)
{
    static const int at[2] = {FOM_B1, FOM_B2}, sigma[2] = {FOM_SIGMA1, FOM_SIGMA2};
    double *m = malloc(6 * (s->n + 1) * sizeof *m);
    size_t *sky = malloc((s->n + 1) * sizeof *sky);
    struct line_fit f;
    int st = m && sky ? OK : E_NOMEM;
    if (st == OK) {
        struct points p = {0, m, m + s->n, m + 2 * s->n, sky}, rest = {0, m + 3 * s->n, m + 4 * s->n, m + 5 * s->n, NULL};
        gather(s, c, s->v[sigma[c]], &p);
        st = stats_line(p.n, p.x, p.y, p.err, &f);
        s->v[at[c] + 2] = st ? NAN : fit_jackknife(s, &p, &rest);
    }
    free(m);
    free(sky);
    if (st == E_NOMEM)
        return st;
    if (st == E_RANGE || st == E_SINGULAR)
        st = OK;                          /* undefined: NaN */
    s->v[at[c]] = f.b;
    s->v[at[c] + 1] = f.se_b;
    s->v[at[c] + 3] = f.a;
    s->v[at[c] + 4] = f.se_a;
    s->v[at[c] + 5] = f.chi2;
    s->v[FOM_DOF] = (double)f.dof;
    return st;
}

/* Sum over used objects of sigma_SN^2/(sigma_SN^2 + sigma_m^2) per area, per component. */
static void effective(struct group *s, const double var_e[2])
{
    double noise = 0, sum = 0, area = 0;
    for (size_t k = 0; k < s->n; k++) {
        area += s->im[k]->area;
        for (size_t i = 0; i < s->im[k]->n; i++) {
            const struct fom_object *o = &s->im[k]->object[i];
            if (o->used)
                noise += 0.5 * (o->err[0] * o->err[0] + o->err[1] * o->err[1]);
        }
    }
    double intrinsic = 0.5 * (var_e[0] + var_e[1]) - noise / (double)s->used;
    for (size_t k = 0; k < s->n; k++)
        for (size_t i = 0; i < s->im[k]->n; i++) {
            const struct fom_object *o = &s->im[k]->object[i];
            if (o->used)
                sum += intrinsic / (intrinsic + 0.5 * (o->err[0] * o->err[0] + o->err[1] * o->err[1]));
        }
    s->v[FOM_N_EFF] = intrinsic > 0 ? sum / area : NAN;
}

/* What common objects and each image's own selection tell. */
static int pairs(struct group *s, int c)
{
    struct fom_pairs p;
    const struct fom_pair_options o = {.psf = s->o->psf, .everywhere = s->o->everywhere, .radius = s->o->radius,
                                       .draws = s->o->draws, .seed = s->o->seed};
    int st = fom_pairs(s->n, s->im, c, &o, &p);
    double *v = s->v + (c ? FOM_PAIRS2 : FOM_PAIRS1), *m = s->v + (c ? FOM_SEL2 : FOM_SEL1);
    if (st)
        return st;
    v[0] = (double)p.common;
    if (p.common < LEAST_OBJECTS || !(p.response > LEAST_RESPONSE))
        return OK;
    v[1] = p.scalar.value;
    v[2] = p.scalar.se;
    v[3] = p.scalar.jackknife;
    v[4] = p.scalar.bootstrap;
    v[5] = p.scalar_block;
    v[6] = p.tensor.value;
    v[7] = p.tensor.se;
    v[8] = p.tensor_block;
    v[9] = p.mean / p.response;
    v[10] = p.mean_se / p.response;
    m[0] = p.selection / s->g;
    m[1] = p.selection_se / s->g;
    m[2] = p.total / s->g - (s->o->psf ? 0 : 1);
    m[3] = p.total_se / s->g;
    return OK;
}

void fom_result_free(struct fom_result *r)
{
    free(r->block);
    *r = (struct fom_result){0};
}

/* Add one image to the blocks of its sky; part has room for n. */
static int add_blocks(struct fom_block *b, const struct fom_image *im, int *part)
{
    double mean[2] = {0}, n = 0;
    int st = fom_parts(im, part);
    for (size_t i = 0; i < im->n && st == OK; i++) {
        if (!im->object[i].used)
            continue;
        mean[0] += im->object[i].e[0];
        mean[1] += im->object[i].e[1];
        n++;
    }
    for (size_t i = 0; i < im->n && st == OK; i++) {
        const struct fom_object *o = &im->object[i];
        if (!o->used)
            continue;
        struct fom_block *to = &b[part[i]];
        double d1 = o->e[0] - mean[0] / n, d2 = o->e[1] - mean[1] / n;
        to->n++;
        to->p += 0.5 * (o->p[0] + o->p[1]);
        to->s2 += d1 * d1 + d2 * d2;
    }
    return st;
}

static int blocks(const struct group *s, struct fom_result *out)
{
    size_t most = 0, made = 0;
    for (size_t k = 0; k < s->n; k++)
        most = s->im[k]->n > most ? s->im[k]->n : most;
    int *part = malloc((most + 1) * sizeof *part);
    out->block = calloc(FOM_PARTS * s->fields, sizeof *out->block);
    int st = part && out->block ? OK : E_NOMEM;
    for (size_t k = 0; k < s->n && st == OK; k++) {
        size_t f = 0;
        while (f < made && strcmp(out->block[FOM_PARTS * f].sky, s->im[k]->sky) != 0)
            f++;
        for (int j = 0; f == made && j < FOM_PARTS; j++) {
            struct fom_block *b = &out->block[FOM_PARTS * f + (size_t)j];
            memcpy(b->sky, s->im[k]->sky, sizeof b->sky);
            b->part = j;
        }
        made += f == made;
        st = add_blocks(out->block + FOM_PARTS * f, s->im[k], part);
    }
    out->blocks = FOM_PARTS * made;
    free(part);
    return st;
}

static size_t count_fields(size_t n, const struct fom_image *const *im)
{
    size_t fields = 0;
    for (size_t i = 0; i < n; i++) {
        size_t j = 0;
        while (j < i && strcmp(im[i]->sky, im[j]->sky) != 0)
            j++;
        fields += j == i;
    }
    return fields;
}

/* Galaxies of all fields, each counted once. */
static double independent(const struct fom_result *r)
{
    return r->v[FOM_N_GAL] * r->area * (double)r->fields;
}

/* Variance of s1 + s2, the variances of both components: s^2 (kurtosis + 2)/n each. */
static double spread_variance(const struct fom_result *r, double s1, double s2)
{
    return (s1 * s1 * (r->v[FOM_KURT1] + 2) + s2 * s2 * (r->v[FOM_KURT2] + 2)) / independent(r);
}

int fom_group(size_t n, const struct fom_image *const *im, const struct fom_options *o, struct fom_result *r)
{
    if (n < 1 || o->draws < 0 || !(o->radius > 0))
        return E_RANGE;
    struct fom_result out = {.lo = NAN, .hi = NAN, .images = (long)n, .scale = im[0]->scale, .area = im[0]->area};
    struct group s = {.n = n, .im = im, .o = o, .v = out.v, .fields = count_fields(n, im)};
    memcpy(out.set, im[0]->set, sizeof out.set);
    out.fields = (long)s.fields;
    for (int k = 0; k < FOM_QUANTITIES; k++)
        out.v[k] = NAN;
    for (size_t k = 0; k < n; k++)
        s.used += fom_image_used(im[k]);
    double var_e[2];
    int st = densities(&s);
    if (st == OK)
        st = response(&s);
    for (int c = 0; c < 2 && st == OK; c++)
        st = spread(&s, c, &var_e[c]);
    for (int c = 0; c < 2 && st == OK; c++)
        st = fit(&s, c);
    for (int c = 0; c < 2 && st == OK; c++)
        st = pairs(&s, c);
    if (st == OK)
        st = blocks(&s, &out);
    if (st) {
        free(out.block);
        return st;
    }
    out.v[FOM_SIGMA_E] = sqrt(var_e[0] + var_e[1]);
    out.v[FOM_SIGMA_EERR] = sqrt(spread_variance(&out, var_e[0], var_e[1])) / (2 * out.v[FOM_SIGMA_E]);
    effective(&s, var_e);
    *r = out;
    return OK;
}

/* ---- groups together ---- */

/* Of one set and one bin. */
static int same_set(const struct fom_result *a, const struct fom_result *b)
{
    return strcmp(a->set, b->set) == 0 && (a->lo == b->lo || (isnan(a->lo) && isnan(b->lo)));
}

/* The slope the correction uses: by pairs where it is known, else by the fit. */
static void slope_of(const struct fom_result *r, int c, int fit_line, double *b, double *se)
{
    int pair = c ? FOM_BP2 : FOM_BP1, line = c ? FOM_B2 : FOM_B1;
    int at = fit_line || !isfinite(r->v[pair]) || !(r->v[pair + 1] > 0) ? line : pair;
    *b = r->v[at];
    *se = r->v[at + 1];
}

/* Line (or, below three scales, weighted mean) of component c through the slopes of one set. */
static int line_of_set(size_t n, struct fom_result *r, const struct fom_result *set, int c, int fit_line)
{
    static const int at[2] = {FOM_L1, FOM_L2};
    double *x = malloc(3 * (n + 1) * sizeof *x);
    if (!x)
        return E_NOMEM;
    double *y = x + n, *s = y + n;
    size_t m = 0, scales = 0;
    for (size_t i = 0; i < n; i++) {
        if (!same_set(&r[i], set))
            continue;
        slope_of(&r[i], c, fit_line, &y[m], &s[m]);
        x[m] = r[i].scale;
        if (!isfinite(y[m]) || !(s[m] > 0))
            continue;
        size_t j = 0;
        while (j < m && x[j] != x[m])
            j++;
        scales += j == m++;
    }
    struct line_fit f = {.a = NAN, .b = NAN, .se_a = NAN, .se_b = NAN};
    int st = scales >= 3 ? stats_line(m, x, y, s, &f) : OK;
    double sum = 0, weight = 0;
    for (size_t i = 0; i < m; i++) {
        sum += y[i] / (s[i] * s[i]);
        weight += 1 / (s[i] * s[i]);
    }
    for (size_t i = 0; i < n && st == OK; i++) {
        if (!same_set(&r[i], set))
            continue;
        double *v = r[i].v + at[c];
        v[0] = isfinite(f.b) ? f.a + f.b * r[i].scale : sum / weight;
        v[1] = f.a;
        v[2] = f.se_a;
        v[3] = f.b;
        v[4] = f.se_b;
    }
    free(x);
    return st;
}

/* Sigma over the line, its error from the kurtosis and the number of independent galaxies. */
static void corrected_spread(struct fom_result *r)
{
    double *v = r->v, s1 = v[FOM_SIGMA1] / v[FOM_L1], s2 = v[FOM_SIGMA2] / v[FOM_L2];
    v[FOM_SIGMA] = sqrt(s1 * s1 + s2 * s2);
    v[FOM_SIGMAERR] = sqrt(spread_variance(r, s1 * s1, s2 * s2)) / (2 * v[FOM_SIGMA]);
    v[FOM_STDERR] = v[FOM_SIGMA] / sqrt(v[FOM_N_GAL]);
    v[FOM_STDERRERR] = v[FOM_STDERR] * hypot(v[FOM_SIGMAERR] / v[FOM_SIGMA], 0.5 * v[FOM_N_GALERR] / v[FOM_N_GAL]);
}

const struct fom_result *fom_reference(size_t n, const struct fom_result *r, const struct fom_result *of, const struct fom_options *o)
{
    for (size_t i = 0; i < n; i++)
        if ((!o->ref_set || strcmp(o->ref_set, r[i].set) == 0) && fabs(r[i].scale - o->ref_scale) < 1e-6 &&
            (r[i].lo == of->lo || (isnan(r[i].lo) && isnan(of->lo))))
            return &r[i];
    return NULL;
}

int fom_compare(size_t n, struct fom_result *r, const struct fom_options *o)
{
    int st = OK;
    for (size_t i = 0; i < n && st == OK; i++) {
        size_t j = 0;
        while (j < i && !same_set(&r[j], &r[i]))
            j++;
        for (int c = 0; c < 2 && j == i && st == OK && !o->psf; c++)
            st = line_of_set(n, r, &r[i], c, o->fit_line);
        if (o->psf)                       /* a leakage is no calibration */
            r[i].v[FOM_L1] = r[i].v[FOM_L2] = 1;
    }
    if (st)
        return st;
    for (size_t i = 0; i < n; i++) {
        double *v = r[i].v;
        corrected_spread(&r[i]);
        v[FOM_LOGDC] = v[FOM_SIGMA] * v[FOM_SIGMA] / (v[FOM_N_GAL] * r[i].scale);
    }
    double *ref = calloc(n + 1, sizeof *ref);
    if (!ref)
        return E_NOMEM;
    for (size_t i = 0; i < n; i++) {
        const struct fom_result *to = fom_reference(n, r, &r[i], o);
        ref[i] = to ? to->v[FOM_LOGDC] : NAN;
    }
    for (size_t i = 0; i < n; i++) {
        double *v = r[i].v, ds = v[FOM_SIGMAERR] / v[FOM_SIGMA], dn = v[FOM_N_GALERR] / v[FOM_N_GAL];
        v[FOM_LOGDC] = log10(v[FOM_LOGDC] / ref[i]);
        v[FOM_LOGDCERR] = M_LOG10E * sqrt(4 * ds * ds + dn * dn);
    }
    free(ref);
    return OK;
}

int fom_to_table(size_t n, const struct fom_result *r, struct table *t)
{
    int st = table_add(t, "SETNAME", COL_TEXT, "", "name of the set");
    if (st == OK)
        st = table_add(t, "CCDSCALE", COL_REAL, "arcsec", "pixel scale of the detector");
    if (st == OK)
        st = table_add(t, "NIMAGES", COL_INT, "", "catalogues of this group");
    if (st == OK)
        st = table_add(t, "NFIELDS", COL_INT, "", "different fields among them");
    int binned = n > 0 && !isnan(r[0].lo);
    if (st == OK && binned)
        st = table_add(t, "BINLO", COL_REAL, "", "lower limit of the bin");
    if (st == OK && binned)
        st = table_add(t, "BINHI", COL_REAL, "", "upper limit of the bin");
    for (int k = 0; k < FOM_QUANTITIES && st == OK; k++)
        st = table_add(t, fom_column[k].name, COL_REAL32, fom_column[k].unit, fom_column[k].what);
    if (st == OK)
        st = table_resize(t, n);
    for (size_t i = 0; i < n && st == OK; i++) {
        char *word = strdup(r[i].set);
        if (!word)
            return E_NOMEM;
        struct column *set = table_find(t, "SETNAME");
        free(set->v.s[i]);
        set->v.s[i] = word;
        table_reals(t, "CCDSCALE")[i] = r[i].scale;
        table_ints(t, "NIMAGES")[i] = r[i].images;
        table_ints(t, "NFIELDS")[i] = r[i].fields;
        if (binned) {
            table_reals(t, "BINLO")[i] = r[i].lo;
            table_reals(t, "BINHI")[i] = r[i].hi;
        }
        for (int k = 0; k < FOM_QUANTITIES; k++)
            table_reals(t, fom_column[k].name)[i] = r[i].v[k];
    }
    return st;
}
