/* test_moments.c - weighted moments: closed forms, the truth stamps, the hard cases. */
#include "check.h"
#include "moments.h"
#include "rng.h"
#include "stamps.h"
#include <string.h>
#include <time.h>

static const struct moments_options standard = MOMENTS_DEFAULTS;
static struct moments_scratch scratch;

static struct moments measure(const struct moments_map *map, struct moments_object o, int fixed)
{
    struct moments_options opt = standard;
    struct moments m;
    opt.fixed_centre = fixed;
    int st = moments_measure(map, &o, &opt, &scratch, &m);
    if (st != OK)
        check_that(0, "moments_measure gave status %d", st);
    return m;
}

/* Sums over all pixels in the plainest way. */
static void slow_sums(const double *pix, long n, double cx, double cy, double w, double cut, double out[9])
{
    static const int px[8] = {2, 1, 0, 4, 3, 2, 1, 0}, py[8] = {0, 1, 2, 0, 1, 2, 3, 4};
    double s = 0, v[8] = {0};
    for (long j = 0; j < n; j++)
        for (long i = 0; i < n; i++) {
            double x = (double)i - cx, y = (double)j - cy, r2 = x * x + y * y;
            if (!(r2 < cut * cut * w * w))
                continue;
            double f = pix[j * n + i] * exp(-r2 / (2 * w * w));
            s += f;
            for (int k = 0; k < 8; k++)
                v[k] += f * pow(x, px[k]) * pow(y, py[k]);
        }
    out[0] = s;
    for (int k = 0; k < 8; k++)
        out[k + 1] = v[k] / s;
}

static void against_slow_sums(void)
{
    struct check c = check_begin("all sums equal the plain double loop, 300 random stamps");
    enum { N = 33 };
    double pix[N * N];
    struct rng r = rng_stream(11, 0, RNG_TEST);
    for (uint32_t t = 0; t < 300; t++) {
        for (int k = 0; k < N * N; k++)
            pix[k] = rng_uniform(&r, t, (uint32_t)k + 10);
        struct moments_object o = {.x = 32 * rng_uniform(&r, t, 0), .y = 32 * rng_uniform(&r, t, 1),
                                   .w = 0.4 + 5 * rng_uniform(&r, t, 2)};
        struct moments_map map = {.nx = N, .ny = N, .pix64 = pix};
        struct moments m = measure(&map, o, 1);
        double want[9];
        slow_sums(pix, N, o.x, o.y, o.w, 4, want);
        check_close(&c, m.s, want[0], 1e-12 * want[0]);
        for (int k = 0; k < 3; k++)
            check_close(&c, m.m2[k], want[k + 1], 1e-12 * (want[1] + want[3]));
        for (int k = 0; k < 5; k++)
            check_close(&c, m.m4[k], want[k + 4], 1e-12 * (want[4] + want[8]));
    }
    check_end(&c);
}

/* A Gaussian of covariance C under the weight: J = (C^-1 + 1/w^2)^-1, fourth moments by Wick. */
static void gaussian_closed_form(void)
{
    struct check c = check_begin("Gaussian: closed form of S, J and fourth moments, centroid found to 1e-9 px");
    enum { N = 65 };
    static double pix[N * N];
    struct rng r = rng_stream(12, 0, RNG_TEST);
    for (uint32_t t = 0; t < 100; t++) {
        double w = 2.5 + rng_uniform(&r, t, 0), a = 3 + 3 * rng_uniform(&r, t, 1), b = 3 + 3 * rng_uniform(&r, t, 2),
               d = 1.5 * (rng_uniform(&r, t, 3) - 0.5), cx = 32 + rng_uniform(&r, t, 4), cy = 32 + rng_uniform(&r, t, 5);
        stamp_fill(pix, N);
        stamp_gauss(pix, N, cx, cy, 500, a, d, b);
        struct moments_map map = {.nx = N, .ny = N, .pix64 = pix};
        struct moments_options opt = standard;
        struct moments m;
        opt.cut = 8;
        struct moments_object o = {.x = cx + 0.8, .y = cy - 0.6, .w = w};
        if (moments_measure(&map, &o, &opt, &scratch, &m) != OK)
            check_that(0, "status");
        double det = a * b - d * d, ia = b / det + 1 / (w * w), ib = a / det + 1 / (w * w), id = -d / det;
        double jd = ia * ib - id * id, xx = ib / jd, yy = ia / jd, xy = -id / jd;
        check_close(&c, m.x, cx, 1e-9);
        check_close(&c, m.y, cy, 1e-9);
        check_close(&c, m.s, 500 / sqrt(det * jd), 1e-8);
        check_close(&c, m.m2[0], xx, 1e-9);
        check_close(&c, m.m2[1], xy, 1e-9);
        check_close(&c, m.m2[2], yy, 1e-9);
        check_close(&c, m.m4[0], 3 * xx * xx, 1e-8);
        check_close(&c, m.m4[1], 3 * xx * xy, 1e-8);
        check_close(&c, m.m4[2], xx * yy + 2 * xy * xy, 1e-8);
        check_close(&c, m.m4[3], 3 * yy * xy, 1e-8);
        check_close(&c, m.m4[4], 3 * yy * yy, 1e-8);
        check_close(&c, m.flags, 0, 0.1);
        check_close(&c, m.steps <= 7, 1, 0.1);
    }
    check_end(&c);
}

/* Scaling, swapping and mirroring an image changes nothing but the obvious. */
static void symmetries(void)
{
    struct check c = check_begin("image scaled by 1e+-30, swapped, mirrored: same numbers");
    enum { N = 61 };
    static double pix[N * N], turned[N * N];
    stamp_fill(pix, N);
    stamp_gauss(pix, N, 30.3, 29.8, 400, 5, 1.2, 3);
    stamp_gauss(pix, N, 32.1, 31.0, 150, 2, -0.5, 2.5);
    struct moments_map map = {.nx = N, .ny = N, .pix64 = pix}, other = {.nx = N, .ny = N, .pix64 = turned};
    struct moments_object o = {.x = 30, .y = 30, .w = 3};
    struct moments a = measure(&map, o, 0), b;
    for (int k = -1; k <= 1; k += 2) {
        for (int i = 0; i < N * N; i++)
            turned[i] = pix[i] * pow(10, 30 * k);
        b = measure(&other, o, 0);
        check_close(&c, b.s / a.s * pow(10, -30 * k), 1, 1e-12);
        check_close(&c, b.m2[0], a.m2[0], 1e-12 * a.m2[0]);
        check_close(&c, b.m4[1], a.m4[1], 1e-12 * a.m4[0]);
        check_close(&c, b.x, a.x, 1e-12 * a.x);
    }
    for (int j = 0; j < N; j++)
        for (int i = 0; i < N; i++)
            turned[j * N + i] = pix[i * N + j];
    b = measure(&other, o, 0);
    for (int k = 0; k < 3; k++)
        check_close(&c, b.m2[k], a.m2[2 - k], 1e-12 * a.m2[0]);
    for (int k = 0; k < 4; k++)
        check_close(&c, b.m3[k], a.m3[3 - k], 1e-11);
    for (int k = 0; k < 5; k++)
        check_close(&c, b.m4[k], a.m4[4 - k], 1e-12 * a.m4[0]);
    for (int j = 0; j < N; j++)
        for (int i = 0; i < N; i++)
            turned[j * N + i] = pix[j * N + N - 1 - i];
    b = measure(&other, o, 0);
    check_close(&c, b.x, N - 1 - a.x, 1e-11);
    for (int k = 0; k < 3; k++)
        check_close(&c, b.m2[k], (k == 1 ? -1 : 1) * a.m2[k], 1e-12 * a.m2[0]);
    for (int k = 0; k < 5; k++)
        check_close(&c, b.m4[k], (k % 2 ? -1 : 1) * a.m4[k], 1e-12 * a.m4[0]);
    check_end(&c);
}

/* Predicted errors against the scatter over noise realisations. */
static void errors_monte_carlo(void)
{
    enum { N = 41, M = 2000 };
    static double clean[N * N], pix[N * N];
    struct rng r = rng_stream(13, 0, RNG_TEST);
    stamp_fill(clean, N);
    stamp_gauss(clean, N, 20.2, 19.7, 2000, 4, 0.8, 3);
    double s[4] = {0}, q[4] = {0}, err[4] = {0}, gain = 2;
    for (uint32_t t = 0; t < M; t++) {
        for (int k = 0; k < N * N; k++)
            pix[k] = clean[k] + sqrt(4 + clean[k] / gain) * rng_normal(&r, t, (uint32_t)k);
        struct moments_map map = {.nx = N, .ny = N, .pix64 = pix, .gain = gain};
        struct moments m = measure(&map, (struct moments_object){.x = 20, .y = 20, .w = 3, .sky_var = 4}, 0);
        double v[4] = {m.m2[0], m.m2[1], m.m2[2], m.s}, e[4] = {m.cov[0], m.cov[3], m.cov[5], m.s_var};
        for (int k = 0; k < 4; k++) {
            s[k] += v[k];
            q[k] += v[k] * v[k];
            err[k] += e[k] / M;
        }
    }
    /* a standard deviation of 2000 values is known to 1.6 %; 5 sigma */
    struct check c = check_begin("errors of J and S: scatter of 2000 noise fields over prediction is 1");
    for (int k = 0; k < 4; k++)
        check_close(&c, sqrt((q[k] / M - s[k] / M * s[k] / M) / err[k]), 1, 0.08);
    check_end(&c);
}

static void masks(void)
{
    enum { N = 61 };
    static double pix[N * N], both[N * N];
    static float label[N * N];
    stamp_fill(pix, N);
    stamp_gauss(pix, N, 30.0, 30.0, 1000, 4, 0.5, 4);
    memcpy(both, pix, sizeof both);
    stamp_gauss(both, N, 39.0, 30.0, 800, 2, 0, 2);
    for (int k = 0; k < N * N; k++)
        label[k] = k % N >= 35 ? 2 : 1;
    struct moments_map clean = {.nx = N, .ny = N, .pix64 = pix}, blend = {.nx = N, .ny = N, .pix64 = both, .label = label};
    struct moments_object o = {.x = 30.2, .y = 29.9, .w = 3, .label = 1};
    struct moments a = measure(&clean, o, 0), b = measure(&blend, o, 0);
    struct check c = check_begin("neighbour behind a mask: moments as without it (its wings reach over: 2e-3)");
    check_close(&c, b.x, a.x, 2e-3);
    check_close(&c, b.m2[0], a.m2[0], 1e-2);
    check_close(&c, b.m2[2], a.m2[2], 1e-2);
    check_close(&c, b.flags, 0, 0.1);
    check_end(&c);
    check_that(fabs(b.masked - 0.0668) < 0.004, "masked part of the weight %.4f (Gaussian beyond 1.5 sigma: .0668)", b.masked);
    blend.label = NULL;
    b = measure(&blend, o, 0);
    check_that(fabs(b.m2[0] - a.m2[0]) > 0.3, "without the mask the neighbour shows: Jxx %.3f against %.3f", b.m2[0], a.m2[0]);
    blend.label = label;
    for (int k = 0; k < N * N; k++)
        label[k] = k % N >= 33 ? 2 : 1;
    check_that(measure(&blend, o, 0).flags == SHAPE_CROWDED, "16 %% of the weight masked: CROWDED");
    for (int k = 0; k < N * N; k++)
        label[k] = k % N >= 36 || k % N <= 24 ? 2 : 1;
    check_that(measure(&blend, o, 0).flags == SHAPE_CROWDED, "neighbours on both sides: CROWDED");
}

/* Weight maps: inverse variance, relative, pixels without weight. */
static void weights(void)
{
    enum { N = 41 };
    static double pix[N * N];
    static float inverse[N * N], relative[N * N];
    stamp_fill(pix, N);
    stamp_gauss(pix, N, 20, 20, 1000, 4, 0, 4);
    for (int k = 0; k < N * N; k++) {
        inverse[k] = 0.25f;
        relative[k] = k % N < 20 ? 2 : 4;
    }
    struct moments_object o = {.x = 20, .y = 20, .w = 3, .sky_var = 4};
    struct moments_map map = {.nx = N, .ny = N, .pix64 = pix};
    struct moments plain = measure(&map, o, 0), m;
    map.weight = inverse;
    map.weight_inverse = 1;
    o.sky_var = 99;
    m = measure(&map, o, 0);
    struct check c = check_begin("weight maps: 1/variance 0.25 is a variance of 4; half the weight on one side, twice its variance");
    check_close(&c, m.s_var, plain.s_var, 1e-12 * plain.s_var);
    check_close(&c, m.cov[0], plain.cov[0], 1e-12 * plain.cov[0]);
    map.weight = relative;
    map.weight_inverse = 0;
    o.sky_var = 4;
    m = measure(&map, o, 0);
    /* columns left of the centre count twice; the central one, sum exp(0) of sum exp(-x^2/9), once */
    double all = 0;
    for (int i = -12; i <= 12; i++)
        all += exp(-i * i / 9.);
    check_close(&c, m.s_var / plain.s_var, 1 + 0.5 * (1 - 1 / all), 1e-4);
    check_close(&c, m.flags, 0, 0.1);
    relative[20 * N + 23] = 0;
    m = measure(&map, o, 0);
    check_close(&c, m.flags, SHAPE_BADPIX, 0.1);
    relative[20 * N + 23] = 4;
    relative[0] = -1;
    m = measure(&map, o, 0);
    check_close(&c, m.flags, 0, 0.1);
    check_end(&c);
}

/* Expected of the hard stamps: x y S Jxx Jxy Jyy (0-based), NaN: not checked; flags. */
static void hard_stamps(const char *dir)
{
    static const struct { const char *name; double v[6]; double tol; int flags; } want[] = {
        {"zero", {NAN, NAN, NAN, NAN, NAN, NAN}, 0, SHAPE_NOFLUX},
        {"negative", {NAN, NAN, NAN, NAN, NAN, NAN}, 0, SHAPE_NOFLUX},
        {"noise_only", {NAN, NAN, NAN, NAN, NAN, NAN}, 0, SHAPE_NOFLUX},
        {"nan_core", {20.2170, 19.6774, 592, 3.8907, .0032, 3.2422}, 6e-5, SHAPE_BADPIX},
        {"nan_outside", {20.2, 19.7, 621, 3.7140, 0, 3.0978}, 6e-5, 0},
        {"delta_pixel", {NAN, NAN, NAN, 0, 0, 0}, 1e-12, 0},
        {"w_too_small", {NAN, NAN, NAN, .0070, 0, .0069}, 6e-5, 0},
        {"tiny_flux", {20.2, 19.7, 6.21e-28, 3.7140, 0, 3.0978}, 6e-5, 0},
        {"edge", {12.5, 20.0, NAN, NAN, NAN, NAN}, 5e-2, SHAPE_EDGE | SHAPE_SHIFT | SHAPE_NEARSINGULAR},
        {"cosmic_hit", {26.1028, 24.0656, NAN, NAN, NAN, NAN}, 6e-5, SHAPE_SHIFT},
        {"pedestal", {NAN, NAN, NAN, 5.3606, -.0002, 4.9372}, 6e-5, 0},
        {"sn5", {18.5921, 17.8807, NAN, 4.7879, 1.6249, 2.8003}, 6e-5, 0},
        {"blend_equal", {23.7, 19.7, NAN, 7.9397, 0, 3.0978}, 6e-5, 0},
    };
    for (size_t i = 0; i < sizeof want / sizeof *want; i++) {
        struct truth_stamp t;
        char name[64];
        snprintf(name, sizeof name, "hard_%s", want[i].name);
        if (!stamp_read(&t, dir, name, 0)) {
            check_that(0, "cannot read %s", name);
            continue;
        }
        struct moments_map map = {.nx = t.nx, .ny = t.ny, .pix64 = t.pix};
        struct moments m = measure(&map, (struct moments_object){.x = t.x, .y = t.y, .w = t.w}, 0);
        double got[6] = {m.x, m.y, m.s, m.m2[0], m.m2[1], m.m2[2]};
        struct check c = check_begin(name);
        check_close(&c, m.flags, want[i].flags, 0.1);
        for (int k = 0; k < 6; k++)
            if (isfinite(want[i].v[k]))
                check_close(&c, got[k], want[i].v[k], k == 2 ? 1e-3 * want[i].v[k] : want[i].tol);
        if (want[i].flags & SHAPE_NOFLUX)
            check_close(&c, isnan(m.s) && isnan(m.m2[0]) && isnan(m.m4[4]) && isnan(m.cov[0]), 1, 0.1);
        if (!check_end(&c))
            printf("# got x %.4f y %.4f S %g J %.4f %.4f %.4f flags %d steps %d\n", m.x, m.y, m.s, m.m2[0], m.m2[1],
                   m.m2[2], m.flags, m.steps);
        stamp_done(&t);
    }
}

/* Groups 2 and 3 of truth.txt. */
static void truth_stamps(const char *dir)
{
    struct truth_line line[16];
    int n = truth_read(line, 16, dir);
    struct check two = check_begin("truth group 2 (sums about the given centre)"),
                 three = check_begin("truth group 3 from POINT, well-sampled stamps (cut 7)"),
                 alias = check_begin("truth group 3 from POINT, aliased stamps: within the closed-form bound");
    for (int i = 0; i < n; i++) {
        struct truth_stamp t;
        for (int ext = 0; ext < 2; ext++) {
            if (!stamp_read(&t, dir, line[i].name, ext)) {
                check_that(0, "cannot read %s", line[i].name);
                continue;
            }
            const double *want = ext ? line[i].point : line[i].sum;
            double w = line[i].w, j = fmin(want[1], want[3]), k = 4 * M_PI * M_PI * j;
            double bound = 2 * exp(-k / 2) * fabs(k - 1);
            int aliased = bound > 1e-10;
            struct moments_map map = {.nx = t.nx, .ny = t.ny, .pix64 = t.pix};
            struct moments_object o = {.x = line[i].x, .y = line[i].y, .w = w};
            struct moments_options opt = {.cut = ext ? 7 : line[i].cut, .tol = 1e-6, .max_steps = 60, .fixed_centre = 1};
            struct moments m;
            if (moments_measure(&map, &o, &opt, &scratch, &m) != OK)
                check_that(0, "status");
            struct check *c = !ext ? &two : aliased ? &alias : &three;
            double tol = !ext ? 1e-12 : aliased ? 3 * bound : 1e-9;
            check_close(c, m.s, want[0], tol * want[0]);
            for (int q = 0; q < 3; q++)
                check_close(c, m.m2[q], want[1 + q], tol * want[1]);
            for (int q = 0; q < 5; q++)
                check_close(c, m.m4[q], want[4 + q], tol * want[4] * (aliased && ext ? 10 : 1));
            stamp_done(&t);
        }
    }
    check_end(&two);
    check_end(&three);
    check_end(&alias);
}

static void refusals(void)
{
    double pix[4] = {1, 2, 3, 4};
    struct moments_map map = {.nx = 2, .ny = 2, .pix64 = pix};
    struct moments m = {.x = 7};
    struct moments_object o = {.x = 0, .y = 0, .w = 0};
    struct check c = check_begin("width 0, negative, NaN, infinite; position NaN: E_RANGE, output untouched");
    const double w[] = {0, -1, NAN, INFINITY};
    for (int k = 0; k < 4; k++) {
        o.w = w[k];
        check_close(&c, moments_measure(&map, &o, &standard, &scratch, &m), E_RANGE, 0.1);
    }
    o = (struct moments_object){.x = NAN, .y = 0, .w = 1};
    check_close(&c, moments_measure(&map, &o, &standard, &scratch, &m), E_RANGE, 0.1);
    check_close(&c, m.x, 7, 0.1);
    check_end(&c);
    o = (struct moments_object){.x = 0.4, .y = 0.5, .w = 1};
    check_that(measure(&map, o, 0).flags & SHAPE_EDGE, "2 x 2 image: EDGE");
    o.x = 50;
    check_that(measure(&map, o, 0).flags & SHAPE_NOFLUX, "position off the image: NOFLUX");
    pix[0] = pix[1] = pix[2] = pix[3] = 1;
    map.nx = map.ny = 1;
    o = (struct moments_object){.x = 0, .y = 0, .w = 2};
    m = measure(&map, o, 0);
    check_that(m.m2[0] == 0 && (m.flags & SHAPE_EDGE), "1 x 1 image: J = 0, EDGE");
}

/* Not a test of speed: the number for the man page. */
static void cost(void)
{
    enum { N = 61, M = 4000 };
    static double pix[N * N];
    static float fpix[N * N];
    stamp_fill(pix, N);
    stamp_gauss(pix, N, 30.3, 29.8, 400, 5, 1.2, 3);
    for (int k = 0; k < N * N; k++)
        fpix[k] = (float)pix[k];
    struct moments_map map = {.nx = N, .ny = N, .pix = fpix};
    struct timespec a, b;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &a);
    for (int i = 0; i < M; i++)
        measure(&map, (struct moments_object){.x = 30.4, .y = 30, .w = 3, .sky_var = 1}, 0);
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &b);
    printf("# %.1f us per object (w = 3 px, centroid from 0.2 px off)\n",
           1e6 / M * ((double)(b.tv_sec - a.tv_sec) + 1e-9 * (double)(b.tv_nsec - a.tv_nsec)));
}

/* One window for many widths: the same bits as a window for each, also where neighbours are mirrored and at edges. */
static void series(void)
{
    enum { N = 81, W = 9 };
    static double pix[N * N];
    static float label[N * N];
    const double width[W] = {0.8, 1.1, 1.5, 2, 2.7, 3.6, 4.9, 6.5, 8.8};
    struct rng r = rng_stream(12, 0, RNG_TEST);
    long masked = 0, other = 0;
    for (uint32_t t = 0; t < 100; t++) {
        const double cx = 8 + 64 * rng_uniform(&r, t, 0), cy = 8 + 64 * rng_uniform(&r, t, 1), s = 1.5 + rng_uniform(&r, t, 2);
        const double ox = N * rng_uniform(&r, t, 3), oy = N * rng_uniform(&r, t, 4);
        for (long k = 0; k < N * N; k++) {
            const double x = (double)(k % N), y = (double)(k / N), mine = (x - cx) * (x - cx) + (y - cy) * (y - cy);
            const double theirs = (x - ox) * (x - ox) + (y - oy) * (y - oy);
            pix[k] = exp(-mine / (2 * s * s)) + 2 * exp(-theirs / 8) + 0.002 * rng_uniform(&r, t, (uint32_t)k + 10);
            label[k] = theirs < 25 && theirs < mine ? 2 : 0;
        }
        struct moments_map map = {.nx = N, .ny = N, .pix64 = pix, .label = label, .gain = 2};
        struct moments_object o = {.x = cx + 0.3, .y = cy - 0.2, .label = 1, .sky = 0.001, .sky_var = 1e-6};
        struct moments all[W];
        if (moments_series(&map, &o, W, width, &standard, &scratch, all) != OK)
            check_that(0, "moments_series failed");
        for (int k = 0; k < W; k++) {
            o.w = width[k];
            const struct moments one = measure(&map, o, 0);
            masked += one.masked > 0;
            other += memcmp(one.m2, all[k].m2, sizeof one.m2) || memcmp(one.m4, all[k].m4, sizeof one.m4) ||
                     memcmp(one.cov, all[k].cov, sizeof one.cov) || one.flags != all[k].flags || one.steps != all[k].steps;
        }
    }
    check_that(other == 0, "nine widths at once: the bits of nine measurements (%ld of 900 differ)", other);
    check_that(masked > 100, "masked neighbours among them: %ld", masked);
}

int main(void)
{
    const char *shared = getenv("SHARED");
    char dir[400];
    snprintf(dir, sizeof dir, "%.300s/truth/rrg", shared ? shared : "../shared");
    against_slow_sums();
    gaussian_closed_form();
    symmetries();
    errors_monte_carlo();
    masks();
    series();
    weights();
    refusals();
    if (stamps_present(dir)) {
        truth_stamps(dir);
        hard_stamps(dir);
    } else {
        check_skip("no reference stamps in %s", dir);
    }
    cost();
    moments_scratch_free(&scratch);
    return check_status();
}
