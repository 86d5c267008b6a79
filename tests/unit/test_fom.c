/* test_fom.c - common objects, slopes, selection, lines over scales, on catalogues whose answers are known. */
#include "check.h"
#include "fom.h"
#include "fompair.h"
#include "rng.h"
#include <stdlib.h>
#include <string.h>

static const double shears[9][2] = {{0, 0}, {-.05, 0}, {-.025, 0}, {.025, 0}, {.05, 0}, {0, -.05}, {0, -.025}, {0, .025}, {0, .05}};

struct world {
    size_t n;                 /* galaxies of a field */
    double m;                 /* bias put in */
    double sigma, noise;      /* intrinsic and measurement spread of e */
    double limit;             /* galaxies with e1 above are not used; 0: all are */
    double hidden, jitter;    /* spreads of the response that P does not know: the galaxy's own; the noise's */
    int opposite;             /* opposite noise: the jitter with the other sign */
    uint64_t seed;
};

/* Galaxy i with response P, intrinsic e0; the noise is the same under every shear. */
static struct fom_image image(const struct world *w, const double g[2], double scale, const char *field, uint64_t key)
{
    struct rng r = rng_stream(w->seed, (uint32_t)key, RNG_TEST);
    struct fom_image im = {.scale = scale, .g = {g[0], g[1]}, .area = 4, .count = {900, 890, 880, 870, 860}, .marked = 1, .n = w->n};
    snprintf(im.set, sizeof im.set, "sim");
    snprintf(im.field, sizeof im.field, "%s", field);
    snprintf(im.sky, sizeof im.sky, "%s", field);
    im.object = calloc(w->n + 1, sizeof *im.object);
    for (size_t i = 0; i < w->n; i++) {
        struct fom_object *o = &im.object[i];
        double response = 1.3 + 0.2 * rng_normal(&r, i, 0);
        o->x = 2 * (double)(i % 100) + 0.3 * rng_uniform(&r, i, 1) + 0.2 * g[0];
        o->y = 2 * (double)(i / 100) + 0.3 * rng_uniform(&r, i, 2);
        for (int c = 0; c < 2; c++) {
            o->e[c] = w->sigma * rng_normal(&r, i, 3 + (uint32_t)c) + w->noise * rng_normal(&r, i, 5 + (uint32_t)c) +
                      response * (1 + w->m) * g[c] +
                      g[c] * (w->hidden * rng_normal(&r, i, 7) + (w->opposite ? -1 : 1) * w->jitter * rng_normal(&r, i, 8));
            o->err[c] = w->noise;
            o->p[c] = response;
        }
        o->measured = 1;
        o->listed = 1;
        o->key = (double)(i % 4);
        o->used = o->passes = w->limit == 0 || o->e[0] < w->limit;
    }
    return im;
}

static const struct fom_options standard = {.radius = 0.15, .draws = 50, .seed = 1, .ref_scale = 0.1, .ref_set = "sim"};

/* All nine shears of `fields` fields. */
static struct fom_result measure(const struct world *w, double scale, int fields, const struct fom_options *o)
{
    struct fom_image im[27];
    const struct fom_image *p[27] = {0};
    struct fom_result r = {0};
    size_t n = 0;
    for (int f = 0; f < fields; f++)
        for (int k = 0; k < 9; k++, n++) {
            char name[16];
            snprintf(name, sizeof name, "f%d", f);
            im[n] = image(w, shears[k], scale, name, (uint64_t)f);
            p[n] = &im[n];
        }
    int st = fom_group(n, p, o, &r);
    if (st)
        check_that(0, "fom_group: status %d", st);
    free(r.block);            /* the numbers stay */
    r.block = NULL;
    r.blocks = 0;
    for (size_t i = 0; i < n; i++)
        fom_image_free(&im[i]);
    return r;
}

static void matching(void)
{
    enum { N = 400 };
    struct fom_object a[N] = {{0}}, b[N] = {{0}};
    struct rng r = rng_stream(51, 0, RNG_TEST);
    for (uint32_t i = 0; i < N; i++) {
        a[i] = (struct fom_object){.x = 3 * rng_uniform(&r, i, 0), .y = 3 * rng_uniform(&r, i, 1)};
        b[i] = (struct fom_object){.x = 3 * rng_uniform(&r, i, 2), .y = 3 * rng_uniform(&r, i, 3)};
    }
    a[7].x = NAN;
    struct fom_image ia = {.n = N, .object = a}, ib = {.n = N, .object = b};
    long to[N];
    struct check c = check_begin("mutual nearest neighbours = brute force, 400 x 400 crowded");
    check_close(&c, fom_match(&ia, &ib, 0.15, to), OK, 0.1);
    for (int i = 0; i < N; i++) {
        long best = -1, back = -1;
        double d = 0.15 * 0.15, d2;
        for (int j = 0; j < N; j++)
            if ((d2 = pow(a[i].x - b[j].x, 2) + pow(a[i].y - b[j].y, 2)) <= d) {
                d = d2;
                best = j;
            }
        d = INFINITY;
        for (int j = 0; j < N && best >= 0; j++)
            if ((d2 = pow(a[j].x - b[best].x, 2) + pow(a[j].y - b[best].y, 2)) < d) {
                d = d2;
                back = j;
            }
        check_close(&c, (double)to[i], (double)(back == i ? best : -1), 0.1);
    }
    check_end(&c);
    /* the sky: 0.1" apart across RA 0, at declination 60 */
    struct fom_object p = {.x = 359.9999999, .y = 60}, q = {.x = 0.0000400, .y = 60};
    struct fom_image ip = {.n = 1, .object = &p, .on_sky = 1}, iq = {.n = 1, .object = &q, .on_sky = 1};
    c = check_begin("the sky: 0.072 arcsec across RA = 0 at declination 60");
    check_close(&c, fom_match(&ip, &iq, 0.0730, to), OK, 0.1);
    check_close(&c, (double)to[0], 0, 0.1);
    check_close(&c, fom_match(&ip, &iq, 0.0715, to), OK, 0.1);
    check_close(&c, (double)to[0], -1, 0.1);
    check_end(&c);
}

static void slopes(void)
{
    struct world w = {.n = 3000, .m = 0.07, .sigma = 0.25, .noise = 0.1, .seed = 52};
    struct fom_result r = measure(&w, 0.1, 1, &standard);
    const double *v = r.v;
    struct check c = check_begin("one field: what was put in comes out");
    check_close(&c, v[FOM_G], 1.3, 5 * 0.2 / sqrt(3000));
    check_close(&c, v[FOM_N_GAL], 750, 1e-9);
    check_close(&c, v[FOM_N_GALERR], 0, 1e-9);
    check_close(&c, v[FOM_N_DET], 225, 1e-9);
    check_close(&c, v[FOM_N_DETERR], 0, 1e-9);
    /* of normal values: s/(2 sqrt n), n galaxies seen once */
    check_close(&c, v[FOM_SIGMA_EERR] / (v[FOM_SIGMA_E] / (2 * sqrt(3000))), 1, 0.1);
    check_close(&c, v[FOM_SIGMA_E], sqrt(2) * hypot(0.25, 0.1), 0.01);
    check_close(&c, v[FOM_N_EFF], 750 * 0.0625 / 0.0725, 12);
    check_close(&c, v[FOM_PAIRS1], 3000, 0.1);
    /* r_i = (1+m) P_i exactly, so the ratio has no error left */
    check_close(&c, v[FOM_BP1], 1.07, 1e-12);
    check_close(&c, v[FOM_BP2], 1.07, 1e-12);
    check_close(&c, v[FOM_BT1], 1.07, 1e-12);
    check_close(&c, v[FOM_BP1SE], 0, 1e-12);
    check_close(&c, v[FOM_B1], 1.07, 5 * v[FOM_B1SE]);
    check_close(&c, v[FOM_A1], 0, 5 * v[FOM_A1SE]);
    check_close(&c, v[FOM_DOF], 7, 0.1);
    check_close(&c, v[FOM_TOT1], 0.07, 1e-12);
    check_close(&c, v[FOM_SEL1], 0, 1e-12);
    check_close(&c, v[FOM_B1SE], 12.649 * v[FOM_SIGMA1] / sqrt(3000), 1e-4);
    check_end(&c);
}

/* Errors against the scatter over 120 worlds, with a selection on e1 whose response has a closed form. */
static void selection(void)
{
    enum { M = 120 };
    struct fom_options o = standard;
    o.draws = 0;
    double s[4] = {0}, q[4] = {0}, se[4] = {0};
    const double sigma = 0.25, t = 0.2;
    for (int k = 0; k < M; k++) {
        struct world w = {.n = 3000, .m = 0, .sigma = sigma, .noise = 0, .limit = t, .seed = 900 + (uint64_t)k};
        struct fom_result r = measure(&w, 0.1, 1, &o);
        double x[4] = {r.v[FOM_SEL1], r.v[FOM_TOT1], r.v[FOM_BP1], r.v[FOM_CP1]};
        double err[4] = {r.v[FOM_SEL1SE], r.v[FOM_TOT1SE], r.v[FOM_BP1SE], r.v[FOM_CP1SE]};
        for (int i = 0; i < 4; i++) {
            s[i] += x[i] / M;
            q[i] += x[i] * x[i] / M;
            se[i] += err[i] / M;
        }
    }
    /* <e0 | e0 < t - a g> = -sigma phi(u)/Phi(u), u = (t - a g)/sigma; derivative in g, over G = a */
    double u = t / sigma, phi = exp(-u * u / 2) / sqrt(2 * M_PI), cap = 0.5 * erfc(-u / sqrt(2)), ratio = phi / cap;
    double want = -ratio * (u + ratio);
    struct check c = check_begin("selection on e1: its response = closed form, total = measurement + selection, measurement unbiased");
    double mean_err = sqrt((q[0] - s[0] * s[0]) / M);
    check_close(&c, s[0], want, 5 * mean_err + 2e-3);
    check_close(&c, s[1], want, 5 * sqrt((q[1] - s[1] * s[1]) / M) + 2e-3);
    check_close(&c, s[2], 1, 1e-9);
    check_end(&c);
    printf("# selection %.4f (want %.4f), total m %.4f\n", s[0], want, s[1]);
    c = check_begin("their standard errors against the scatter of 120 worlds (known to 6.5 %; 4 sigma)");
    for (int i = 0; i < 2; i++)
        check_close(&c, se[i] / sqrt(q[i] - s[i] * s[i]), 1, 0.26);
    check_end(&c);
}

static void fields_and_lines(void)
{
    struct world w = {.n = 1000, .m = 0, .sigma = 0.25, .noise = 0.1, .seed = 53};
    struct fom_result two = measure(&w, 0.1, 2, &standard);
    struct check c = check_begin("two fields: both are used, none is mixed up");
    check_close(&c, (double)two.fields, 2, 0.1);
    check_close(&c, (double)two.images, 18, 0.1);
    check_close(&c, two.v[FOM_PAIRS1], 2000, 0.1);
    check_close(&c, two.v[FOM_BP1], 1, 1e-12);
    check_close(&c, two.v[FOM_DOF], 16, 0.1);
    check_end(&c);

    struct fom_result r[5];
    for (int i = 0; i < 5; i++) {
        double scale = 0.06 + 0.02 * i;
        w.m = -0.2 - 0.5 * scale;
        r[i] = measure(&w, scale, 1, &standard);
        r[i].v[FOM_BP1SE] = r[i].v[FOM_BP2SE] = 0.01;      /* exact here: any error will do */
    }
    c = check_begin("line over five scales, sigma and Delta C_l by its formula");
    check_close(&c, fom_compare(5, r, &standard), OK, 0.1);
    for (int i = 0; i < 5; i++) {
        const double *v = r[i].v;
        check_close(&c, v[FOM_L1A], 0.8, 1e-9);
        check_close(&c, v[FOM_L1B], -0.5, 1e-8);
        check_close(&c, v[FOM_L2], 0.8 - 0.5 * r[i].scale, 1e-9);
        double s = hypot(v[FOM_SIGMA1] / v[FOM_L1], v[FOM_SIGMA2] / v[FOM_L2]);
        check_close(&c, v[FOM_SIGMA], s, 1e-12);
        double ref = pow(r[2].v[FOM_SIGMA], 2) / r[2].v[FOM_N_GAL] / 0.1;
        check_close(&c, v[FOM_LOGDC], log10(s * s / v[FOM_N_GAL] / r[i].scale / ref), 1e-12);
    }
    check_close(&c, r[2].v[FOM_LOGDC], 0, 1e-15);
    check_end(&c);
}

/* The same galaxies under two opposite noises: the error by parts of the sky against the scatter of worlds. */
static void mirrored(void)
{
    enum { M = 100 };
    struct fom_options o = standard;
    o.draws = 0;
    double s = 0, q = 0, se[3] = {0}, fit_se = 0, fit = 0, fit2 = 0;
    for (int k = 0; k < M; k++) {
        struct world w = {.n = 1000, .sigma = 0.25, .hidden = 0.3, .jitter = 0.5, .seed = 2000 + (uint64_t)k};
        struct fom_image im[30];
        const struct fom_image *p[30] = {0};
        struct fom_result r = {0};
        for (int f = 0, n = 0; f < 6; f++)
            for (int i = 0; i < 5; i++, n++) {
                char name[16];
                snprintf(name, sizeof name, "f%d", f / 2);
                w.opposite = f % 2;
                im[n] = image(&w, shears[i], 0.1, name, (uint64_t)(f / 2));
                if (w.opposite)
                    strcat(im[n].field, "~");
                p[n] = &im[n];
            }
        if (fom_group(30, p, &o, &r))
            check_that(0, "fom_group failed");
        s += r.v[FOM_BP1] / M;
        q += r.v[FOM_BP1] * r.v[FOM_BP1] / M;
        se[0] += r.v[FOM_BP1SE] / M;
        se[1] += r.v[FOM_BP1BK] / M;
        se[2] += r.v[FOM_BT1BK] / M;
        fit_se += r.v[FOM_B1JK] * r.v[FOM_B1JK] / M;
        fit += r.v[FOM_B1] / M;
        fit2 += r.v[FOM_B1] * r.v[FOM_B1] / M;
        if (k == 0)
            check_that(r.fields == 3 && r.v[FOM_PAIRS1] == 6000, "three skies under two noises: %ld skies, %g pairs", r.fields, r.v[FOM_PAIRS1]);
        fom_result_free(&r);
        for (int i = 0; i < 30; i++)
            fom_image_free(&im[i]);
    }
    const double scatter = sqrt(q - s * s);
    printf("# scatter %.5f, by galaxies %.5f, by parts of the sky %.5f\n", scatter, se[0], se[1]);
    struct check c = check_begin("opposite noises: error by parts of the sky = scatter of 100 worlds (known to 7 %; 4 sigma)");
    check_close(&c, s, 1, 5 * scatter / sqrt(M));
    check_close(&c, se[1] / scatter, 1, 0.28);
    check_close(&c, se[2] / scatter, 1, 0.28);
    check_close(&c, scatter, 0.3 / 1.3 / sqrt(3000), 0.28 * 0.3 / 1.3 / sqrt(3000));
    check_end(&c);
    check_that(se[0] > 1.1 * se[1], "the error by galaxies takes the two noises for independent ones and is larger here");
    c = check_begin("the fit's error by leaving out skies = scatter of 100 worlds (three skies: one world's is known to 50 %; 4 sigma)");
    check_close(&c, sqrt(fit_se / (fit2 - fit * fit)), 1, 0.35);
    check_end(&c);
}

/*
 * Five scales of one sky: the same galaxies with a noise of each scale's own, of which exp(-(theta/0.15)^2) are detected,
 * the same first of all.  sigma^2/(theta n) is least at 0.15/sqrt 2 arcsec.
 */
static void one_sky(struct fom_result r[5], uint64_t seed)
{
    const struct world w = {.n = 1200, .sigma = 0.25, .seed = seed};
    const int used[5] = {0, 1, 4, 5, 8};
    struct fom_options o = standard;
    o.draws = 0;
    for (int k = 0; k < 5; k++) {
        struct fom_image im[5];
        const struct fom_image *p[5];
        const double scale = 0.06 + 0.02 * k, part = exp(-pow(scale / 0.15, 2));
        struct rng own = rng_stream(seed, 100 + (uint32_t)k, RNG_TEST), all = rng_stream(seed, 99, RNG_TEST);
        for (int j = 0; j < 5; j++) {
            im[j] = image(&w, shears[used[j]], scale, "f0", 0);
            p[j] = &im[j];
            for (size_t i = 0; i < w.n; i++) {
                struct fom_object *at = &im[j].object[i];
                at->used = at->passes = 0.9 * rng_uniform(&all, i, 0) + 0.1 * rng_uniform(&own, i, 0) < 0.9 * part + 0.05;
                at->e[0] += 0.15 * rng_normal(&own, i, 1);
                at->e[1] += 0.15 * rng_normal(&own, i, 2);
            }
        }
        r[k] = (struct fom_result){0};
        if (fom_group(5, p, &o, &r[k]))
            check_that(0, "fom_group failed");
        r[k].v[FOM_BP1SE] = r[k].v[FOM_BP2SE] = 0.01;      /* exact here: any error will do */
        for (int j = 0; j < 5; j++)
            fom_image_free(&im[j]);
    }
}

static void one_sky_errors(void)
{
    enum { M = 120 };
    struct fom_options o = standard;
    double s[6] = {0}, q[6] = {0}, v[6] = {0}, formula = 0, zero = 0;
    int found = 0;
    o.draws = 100;
    for (int k = 0; k < M; k++) {
        struct fom_result r[5];
        one_sky(r, 4000 + (uint64_t)k);
        if (fom_compare(5, r, &o) || fom_contrast(5, r, &o) || fom_optimum(5, r, &o))
            check_that(0, "status");
        const int in = isfinite(r[2].v[FOM_OPT]) && isfinite(r[2].v[FOM_OPTERR]);
        for (int i = 0; i < 6; i++) {
            double x = i < 5 ? r[i].v[FOM_LOGDC] : r[0].v[FOM_OPT], e = i < 5 ? r[i].v[FOM_LOGDCBS] : r[0].v[FOM_OPTERR];
            if (i == 5 && !in)
                continue;
            s[i] += x;
            q[i] += x * x;
            v[i] += e * e;
        }
        found += in;
        zero = fmax(zero, fabs(r[2].v[FOM_LOGDCBS]));
        formula += r[4].v[FOM_LOGDCERR] / M;
        for (int i = 0; i < 5; i++)
            fom_result_free(&r[i]);
    }
    struct check c = check_begin("five scales of one sky: bootstrap error of LOGDC, and of the best scale, = scatter of 120 skies (known to 6.5 %; 4 sigma, and 16 parts lose 3 %)");
    for (int i = 0; i < 6; i++) {
        const double m = i < 5 ? M : found, scatter = sqrt(q[i] / m - (s[i] / m) * (s[i] / m)), error = sqrt(v[i] / m);
        printf("# %s: mean %.4f, scatter %.5f, error %.5f\n", i < 5 ? "LOGDC" : "best scale", s[i] / m, scatter, error);
        if (i != 2)
            check_close(&c, error / scatter, 0.97, 0.26);
    }
    check_close(&c, zero, 0, 0);
    /* vertex of the parabola through the five expected values; error of the mean .0005, the middle one is not always the least */
    check_close(&c, s[5] / found, 0.1022, 0.003);
    check_end(&c);
    check_that(found > 100, "%d of %d skies have the best scale inside", found, M);
    printf("# LOGDC by its formula: error %.5f\n", formula);

    struct fom_result r[5];
    one_sky(r, 4000);
    o.ref_scale = 0.3;
    check_that(fom_compare(5, r, &o) == OK && fom_contrast(5, r, &o) == OK && isnan(r[0].v[FOM_LOGDCBS]), "no reference: no error");
    o.ref_scale = 0.1;
    o.draws = 0;
    check_that(fom_compare(5, r, &o) == OK && fom_contrast(5, r, &o) == OK && isnan(r[0].v[FOM_LOGDCBS]), "no draws: no error");
    for (int i = 0; i < 5; i++)
        fom_result_free(&r[i]);
}

/* Bins: each has the objects between its edges, and nothing else. */
static void bins(void)
{
    struct world w = {.n = 800, .m = 0, .sigma = 0.25, .noise = 0.1, .seed = 56};
    struct fom_image im[2] = {image(&w, shears[1], 0.1, "f", 0), image(&w, shears[4], 0.1, "f", 0)};
    const struct fom_image *p[2] = {&im[0], &im[1]};
    struct fom_result all = {0}, r[3] = {{.lo = 0}};
    const double edge[4] = {0, 1, 3, 4};          /* keys are 0 1 2 3, 200 objects each; the one key that is nan is in no bin */
    im[0].object[4].key = im[1].object[4].key = NAN;
    struct check c = check_begin("three bins of 200, 400, 200 objects less one without a key: counts and densities");
    check_close(&c, fom_group(2, p, &standard, &all), OK, 0.1);
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < 2; i++)
            fom_image_bin(&im[i], edge[k], edge[k + 1]);
        check_close(&c, fom_group(2, p, &standard, &r[k]), OK, 0.1);
        check_close(&c, (double)fom_image_used(&im[0]), k == 0 ? 199 : k == 1 ? 400 : 200, 0.1);
        check_close(&c, r[k].v[FOM_PAIRS1], k == 0 ? 199 : k == 1 ? 400 : 200, 0.1);
        check_close(&c, r[k].v[FOM_BP1], 1, 1e-12);
        check_close(&c, r[k].v[FOM_N_GAL], (k == 0 ? 199 : k == 1 ? 400 : 200) / 4.0, 1e-9);
    }
    check_close(&c, all.v[FOM_PAIRS1], 800, 0.1);
    double mean = 0;
    for (int k = 0; k < 3; k++)
        mean += r[k].v[FOM_G] * r[k].v[FOM_PAIRS1] / 799;
    check_close(&c, mean, all.v[FOM_G], 5e-3);
    check_end(&c);
    fom_image_bin(&im[0], 10, 20);
    check_that(fom_image_used(&im[0]) == 0, "a bin beyond all: nothing");
    fom_result_free(&all);
    for (int k = 0; k < 3; k++)
        fom_result_free(&r[k]);
    for (int i = 0; i < 2; i++)
        fom_image_free(&im[i]);
}

static void undefined(void)
{
    struct world w = {.n = 3, .sigma = 0.25, .seed = 54};
    struct fom_result r = measure(&w, 0.1, 1, &standard);
    check_that(isnan(r.v[FOM_G]) && isnan(r.v[FOM_B1]) && isnan(r.v[FOM_BP1]) && isfinite(r.v[FOM_N_GAL]), "27 measurements: no response, no slopes, a density");
    w.n = 0;
    r = measure(&w, 0.1, 1, &standard);
    check_that(r.v[FOM_N_GAL] == 0 && isnan(r.v[FOM_SIGMA1]) && isnan(r.v[FOM_KURT1]), "no survivor: density 0, the rest undefined");
    check_that(fom_compare(1, &r, &standard) == OK && isnan(r.v[FOM_LOGDC]), "no survivor: no power spectrum error");
    w = (struct world){.n = 500, .sigma = 0, .seed = 55};
    r = measure(&w, 0.1, 1, &standard);
    check_that(isfinite(r.v[FOM_G]) && isfinite(r.v[FOM_BP1]) && isfinite(r.v[FOM_B1]), "no intrinsic ellipticity: slopes are defined");
    struct fom_image low = image(&w, shears[4], 0.1, "f", 0);
    const struct fom_image *only[1] = {&low};
    for (size_t i = 0; i < low.n; i++)
        low.object[i].p[0] = low.object[i].p[1] = 0.2;
    int st = fom_group(1, only, &standard, &r);
    check_that(st == OK && isnan(r.v[FOM_G]) && isnan(r.v[FOM_SIGMA1]) && isnan(r.v[FOM_B1]), "a mean response of 0.2: refused, no shear");
    fom_result_free(&r);
    for (size_t i = 0; i < low.n; i++) {
        low.object[i].p[0] = low.object[i].p[1] = 1.3;
        low.object[i].e[0] = low.object[i].e[1] = 0.1;
    }
    st = fom_group(1, only, &standard, &r);
    check_that(st == OK && isfinite(r.v[FOM_G]) && r.v[FOM_SIGMA1] == 0 && isnan(r.v[FOM_SKEW1]) && isnan(r.v[FOM_KURT1]) && isnan(r.v[FOM_KURT1ERR]),
               "zero variance: no skewness, no kurtosis");
    fom_result_free(&r);
    fom_image_free(&low);
    struct fom_image im = image(&w, shears[0], 0.1, "f", 0);
    const struct fom_image *one[2] = {&im, &im};
    check_that(fom_group(2, one, &standard, &r) == OK && isnan(r.v[FOM_B1]) && isnan(r.v[FOM_BP1]), "all-equal shears: no slope");
    fom_result_free(&r);
    fom_image_free(&im);
}

int main(void)
{
    matching();
    slopes();
    selection();
    fields_and_lines();
    mirrored();
    one_sky_errors();
    bins();
    undefined();
    return check_status();
}
