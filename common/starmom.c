/* starmom.c - moments of the PSF against the width of the weight. */
#include "starmom.h"
#include "par.h"
#include "stats.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LEAST_SNR 20          /* of the weighted flux at dstar_w: noise peaks are no stars */

const char *const starmom_name[STARMOM_N] = {"PXX", "PXY", "PYY", "PXXXX", "PXXXY", "PXXYY", "PXYYY", "PYYYY"};

int starmom_widths(struct starmom *s, int n, double lo, double hi)
{
    if (n < 4 || n > STARMOM_MAX || !(lo > 0) || !(hi > lo) || !isfinite(hi))
        return E_RANGE;
    s->n = n;
    for (int i = 0; i < n; i++)
        s->w[i] = lo * pow(hi / lo, i / (n - 1.0));
    s->w[n - 1] = hi;
    return OK;
}

/* Stars at all widths: value[(width * N + quantity) * n + star], NaN where flagged. */
struct job {
    const struct starmom *s;
    const struct moments_map *map;
    const struct moments_object *stars;
    const struct moments_options *opt;
    size_t n;
    const unsigned char *keep;
    double *value;
    double *d;                /* d at dstar_w */
    struct moments_scratch *scratch;
};

static int good(const struct moments *m)
{
    return (m->flags & ~SHAPE_NEARSINGULAR) == 0;
}

static int measure_sizes(void *ctx, long begin, long end, int worker)
{
    struct job *job = ctx;
    for (long i = begin; i < end; i++) {
        struct moments_object o = job->stars[i];
        struct moments m;
        o.w = job->s->dstar_w;
        int st = moments_measure(job->map, &o, job->opt, &job->scratch[worker], &m);
        if (st)
            return st;
        job->d[i] = good(&m) && m.s * m.s >= LEAST_SNR * LEAST_SNR * m.s_var ? sqrt(0.5 * (m.m2[0] + m.m2[2])) : NAN;
    }
    return OK;
}

static int measure_widths(void *ctx, long begin, long end, int worker)
{
    struct job *job = ctx;
    struct moments m[STARMOM_MAX];
    struct moments_options opt = *job->opt;
    opt.no_errors = 1;
    for (long i = begin; i < end; i++) {
        if (!job->keep[i])
            continue;
        int st = moments_series(job->map, &job->stars[i], job->s->n, job->s->w, &opt, &job->scratch[worker], m);
        if (st)
            return st;
        for (int k = 0; k < job->s->n; k++)
            for (int q = 0; q < STARMOM_N; q++)
                job->value[((size_t)k * STARMOM_N + (size_t)q) * job->n + (size_t)i] =
                    !good(&m[k]) ? NAN : q < 3 ? m[k].m2[q] : m[k].m4[q - 3];
    }
    return OK;
}

/* Of `kept` stars keep `most`, evenly spread over the list. */
static void thin(size_t n, unsigned char *keep, size_t kept, size_t most)
{
    size_t seen = 0, taken = 0;
    for (size_t i = 0; i < n; i++)
        if (keep[i]) {
            /* star number `seen` is the middle of one of `most` equal parts */
            const size_t middle = (size_t)(((double)taken + 0.5) * (double)kept / (double)most);
            keep[i] = taken < most && seen++ == middle;
            taken += keep[i];
        }
}

/* keep[i]: the star is like the others, or one of max_stars of them. Sets dstar. */
static int choose(struct starmom *s, const double *d, size_t n, long max_stars, unsigned char *keep)
{
    double *v = malloc((n + 1) * sizeof *v);
    if (!v)
        return E_NOMEM;
    memset(keep, 1, n);
    size_t kept = 0;
    double width = INFINITY, mid = 0;
    for (int round = 0; round < 4; round++) {
        if (round == 3) {
            if (max_stars <= 0 || kept <= (size_t)max_stars)
                break;
            thin(n, keep, kept, (size_t)max_stars);
        }
        kept = 0;
        for (size_t i = 0; i < n; i++) {
            keep[i] = (round < 3 || keep[i]) && isfinite(d[i]) && fabs(d[i] - mid) <= width;
            if (keep[i])
                v[kept++] = d[i];
        }
        if (kept == 0)
            break;
        mid = stats_median(kept, v);
        for (size_t i = 0; i < kept; i++)
            v[i] = fabs(v[i] - mid);
        width = fmax(10 * 1.4826 * stats_median(kept, v), 0.02 * mid);
    }
    s->dstar = mid;
    /* standard error of a median of normal values: 1.2533 sigma/sqrt(n) */
    s->dstar_err = kept > 1 ? 1.2533 * width / 10 / sqrt((double)kept) : NAN;
    free(v);
    return kept > 1 ? OK : E_MISSING;
}

/*
 * Means at width k and their covariance.  Leaving out one star after the other
 * gives sum (x - mean)(y - mean) / (n (n - 1)): the jackknife of a mean.
 * v has room for STARMOM_N * n.
 */
static int average_width(struct starmom *s, int k, const double *value, size_t n, const unsigned char *keep, int use_median, double *v)
{
    const double factor = use_median ? M_PI / 2 : 1;
    size_t m = 0;
    for (size_t i = 0; i < n; i++)
        if (keep[i] && isfinite(value[i])) {            /* all moments of a star are, or none */
            for (size_t q = 0; q < STARMOM_N; q++)
                v[q * n + m] = value[q * n + i];
            m++;
        }
    s->stars[k] = (long)m;
    if (m < 2)
        return E_MISSING;
    double mean[STARMOM_N];
    for (size_t q = 0; q < STARMOM_N; q++) {
        struct stats sum;
        stats_sum(m, v + q * n, &sum);
        mean[q] = sum.mean;
        s->err[q][k] = sqrt(factor * sum.var / (double)m);
    }
    size_t pair = 0;
    for (size_t q = 0; q < STARMOM_N; q++)
        for (size_t r = q + 1; r < STARMOM_N; r++) {
            struct sum c = {0};
            for (size_t i = 0; i < m; i++)
                sum_add(&c, (v[q * n + i] - mean[q]) * (v[r * n + i] - mean[r]));
            s->cov[pair++][k] = factor * sum_value(&c) / ((double)m * (double)(m - 1));
        }
    for (size_t q = 0; q < STARMOM_N; q++)
        s->m[q][k] = use_median ? stats_median(m, v + q * n) : mean[q];
    return OK;
}

static int average(struct starmom *s, const double *value, size_t n, const unsigned char *keep, int use_median)
{
    double *v = malloc((STARMOM_N * n + 1) * sizeof *v);
    int st = v ? OK : E_NOMEM;
    for (int k = 0; k < s->n && st == OK; k++)
        st = average_width(s, k, value + (size_t)k * STARMOM_N * n, n, keep, use_median, v);
    free(v);
    return st;
}

int starmom_measure(struct starmom *s, const struct moments_map *map, size_t n,
                    const struct moments_object *stars, const struct moments_options *opt,
                    long max_stars, int use_median, int threads)
{
    if (s->n < 4 || !(s->dstar_w > 0) || threads < 1 || threads > 256)
        return E_RANGE;
    unsigned char *keep = malloc(n + 1);
    struct job job = {.s = s, .map = map, .stars = stars, .opt = opt, .n = n, .keep = keep};
    job.value = malloc((n + 1) * (size_t)s->n * STARMOM_N * sizeof(double));
    job.d = malloc((n + 1) * sizeof(double));
    job.scratch = calloc((size_t)threads, sizeof *job.scratch);
    int st = job.value && job.d && job.scratch && keep ? OK : E_NOMEM;
    if (st == OK)
        st = par_for((long)n, 8, threads, measure_sizes, &job);
    if (st == OK)
        st = choose(s, job.d, n, max_stars, keep);
    if (st == OK)
        st = par_for((long)n, 8, threads, measure_widths, &job);
    if (st == OK)
        st = average(s, job.value, n, keep, use_median);
    if (st == OK)
        st = starmom_prepare(s);
    for (int t = 0; job.scratch && t < threads; t++)
        moments_scratch_free(&job.scratch[t]);
    free(job.value);
    free(job.d);
    free(job.scratch);
    free(keep);
    return st;
}

/* Second derivatives of the not-a-knot cubic spline through (x, y), n >= 4. */
static void spline_curve(int n, const double *x, const double *y, double *out)
{
    double diag[STARMOM_MAX], up[STARMOM_MAX], low[STARMOM_MAX], rhs[STARMOM_MAX];
    for (int i = 1; i < n - 1; i++) {
        double h = x[i] - x[i - 1], g = x[i + 1] - x[i];
        low[i] = h;
        diag[i] = 2 * (h + g);
        up[i] = g;
        rhs[i] = 6 * ((y[i + 1] - y[i]) / g - (y[i] - y[i - 1]) / h);
    }
    /* third derivative continuous at the second and the last but one knot */
    double h0 = x[1] - x[0], h1 = x[2] - x[1], hn = x[n - 1] - x[n - 2], hm = x[n - 2] - x[n - 3];
    diag[1] += h0 * (1 + h0 / h1);
    up[1] -= h0 * h0 / h1;
    diag[n - 2] += hn * (1 + hn / hm);
    low[n - 2] -= hn * hn / hm;
    for (int i = 2; i < n - 1; i++) {
        double f = low[i] / diag[i - 1];
        diag[i] -= f * up[i - 1];
        rhs[i] -= f * rhs[i - 1];
    }
    out[n - 2] = rhs[n - 2] / diag[n - 2];
    for (int i = n - 3; i > 0; i--)
        out[i] = (rhs[i] - up[i] * out[i + 1]) / diag[i];
    out[0] = out[1] - h0 / h1 * (out[2] - out[1]);
    out[n - 1] = out[n - 2] + hn / hm * (out[n - 2] - out[n - 3]);
}

int starmom_prepare(struct starmom *s)
{
    double x[STARMOM_MAX];
    if (s->n < 4 || s->n > STARMOM_MAX)
        return E_RANGE;
    for (int i = 0; i < s->n; i++) {
        if (!(s->w[i] > 0) || !isfinite(s->w[i]) || (i > 0 && !(s->w[i] > s->w[i - 1])))
            return E_RANGE;
        for (int q = 0; q < STARMOM_N; q++)
            if (!isfinite(s->m[q][i]))
                return E_RANGE;
        x[i] = log(s->w[i]);
    }
    for (int q = 0; q < STARMOM_N; q++)
        spline_curve(s->n, x, s->m[q], s->curve[q]);
    return OK;
}

/* The width within the table; rows i, i + 1 on both sides, b of the way in log w from one to the other, h between them. */
static double locate(const struct starmom *s, double w, int *at, double *b, double *h)
{
    double u = fmin(fmax(w, s->w[0]), s->w[s->n - 1]);
    int i = 0;
    while (i < s->n - 2 && u > s->w[i + 1])
        i++;
    double x0 = log(s->w[i]);
    *at = i;
    *h = log(s->w[i + 1]) - x0;
    *b = (log(u) - x0) / *h;
    return u;
}

void starmom_cov(const struct starmom *s, double w, double cov[STARMOM_N][STARMOM_N])
{
    int i, pair = 0;
    double b, h;
    locate(s, w, &i, &b, &h);
    for (int q = 0; q < STARMOM_N; q++) {
        cov[q][q] = (1 - b) * s->err[q][i] * s->err[q][i] + b * s->err[q][i + 1] * s->err[q][i + 1];
        for (int r = q + 1; r < STARMOM_N; r++, pair++)
            cov[q][r] = cov[r][q] = (1 - b) * s->cov[pair][i] + b * s->cov[pair][i + 1];
    }
}

void starmom_at(const struct starmom *s, double w, struct rrg_psf *out)
{
    int i;
    double b, h, u = locate(s, w, &i, &b, &h), a = 1 - b;
    double ca = (a * a * a - a) * h * h / 6, cb = (b * b * b - b) * h * h / 6;
    out->w = u;
    for (int q = 0; q < STARMOM_N; q++) {
        double v = a * s->m[q][i] + b * s->m[q][i + 1] + ca * s->curve[q][i] + cb * s->curve[q][i + 1];
        *(q < 3 ? out->m2 + q : out->m4 + (q - 3)) = v;
    }
}
