/* test_rrg.c - PSF correction and response to shear: closed forms on Gaussian mixtures, truth stamps. */
#include "check.h"
#include "rng.h"
#include "rrg.h"
#include "stamps.h"
#include <string.h>

/* A galaxy is a sum of Gaussians; all closed forms follow from that. */
struct part {
    double flux, x, y, xx, xy, yy;
};

struct galaxy {
    int n;
    struct part p[4];
};

/* Random lopsided galaxy, rms size about `size`. */
static struct galaxy random_galaxy(const struct rng *r, uint64_t item, double size, int n)
{
    struct galaxy g = {.n = n};
    for (int k = 0; k < n; k++) {
        uint32_t i = (uint32_t)(k * 8);
        double a = size * size * (0.4 + 1.2 * rng_uniform(r, item, i)), q = 0.4 + 0.6 * rng_uniform(r, item, i + 1);
        double t = M_PI * rng_uniform(r, item, i + 2), c = cos(t), s = sin(t);
        g.p[k] = (struct part){.flux = 0.3 + rng_uniform(r, item, i + 3),
                               .x = size * (rng_uniform(r, item, i + 4) - 0.5),
                               .y = size * (rng_uniform(r, item, i + 5) - 0.5),
                               .xx = a * (c * c + q * s * s), .yy = a * (s * s + q * c * c), .xy = a * (1 - q) * c * s};
    }
    return g;
}

/* Area-preserving shear with reduced shear (g1, g2), after a turn by `angle`. */
static struct galaxy moved(const struct galaxy *g, double angle, double g1, double g2)
{
    struct galaxy out = {.n = g->n};
    double f = 1 / sqrt(1 - g1 * g1 - g2 * g2), c = cos(angle), s = sin(angle);
    double a11 = f * ((1 + g1) * c + g2 * s), a12 = f * (-(1 + g1) * s + g2 * c);
    double a21 = f * (g2 * c + (1 - g1) * s), a22 = f * (-g2 * s + (1 - g1) * c);
    for (int k = 0; k < g->n; k++) {
        struct part p = g->p[k];
        double bxx = a11 * p.xx + a12 * p.xy, bxy = a11 * p.xy + a12 * p.yy;
        double byx = a21 * p.xx + a22 * p.xy, byy = a21 * p.xy + a22 * p.yy;
        out.p[k] = (struct part){.flux = p.flux, .x = a11 * p.x + a12 * p.y, .y = a21 * p.x + a22 * p.y,
                                 .xx = bxx * a11 + bxy * a12, .xy = bxx * a21 + bxy * a22, .yy = byx * a21 + byy * a22};
    }
    return out;
}

static struct galaxy convolved(struct galaxy g, double xx, double xy, double yy)
{
    for (int k = 0; k < g.n; k++) {
        g.p[k].xx += xx;
        g.p[k].xy += xy;
        g.p[k].yy += yy;
    }
    return g;
}

/* E[tx^a ty^b] of a normal of mean (mx, my), covariance (xx, xy, yy), a + b <= 4. */
static double normal_moment(int a, int b, double mx, double my, double xx, double xy, double yy)
{
    if (a == 0 && b == 0)
        return 1;
    if (a > 0)
        return mx * normal_moment(a - 1, b, mx, my, xx, xy, yy) +
               (a > 1 ? (a - 1) * xx * normal_moment(a - 2, b, mx, my, xx, xy, yy) : 0) +
               (b > 0 ? b * xy * normal_moment(a - 1, b - 1, mx, my, xx, xy, yy) : 0);
    return my * normal_moment(0, b - 1, mx, my, xx, xy, yy) +
           (b > 1 ? (b - 1) * yy * normal_moment(0, b - 2, mx, my, xx, xy, yy) : 0);
}

/* Closed-form weighted moments about (cx, cy). */
static struct moments about(const struct galaxy *g, double cx, double cy, double w, double first[2])
{
    double sum[5][5] = {{0}};
    for (int k = 0; k < g->n; k++) {
        struct part p = g->p[k];
        double w2 = w * w, dx = p.x - cx, dy = p.y - cy;
        double axx = p.xx + w2, ayy = p.yy + w2, det = axx * ayy - p.xy * p.xy;
        /* product of N(d, C) and exp(-t^2/2w^2): covariance w^2 C (C + w^2)^-1, mean w^2 (C + w^2)^-1 d */
        double mx = w2 * (ayy * dx - p.xy * dy) / det, my = w2 * (axx * dy - p.xy * dx) / det;
        double xx = w2 * (p.xx * ayy - p.xy * p.xy) / det, yy = w2 * (p.yy * axx - p.xy * p.xy) / det;
        double xy = w2 * (p.xy * axx - p.xx * p.xy) / det;
        double s = p.flux * w2 / sqrt(det) * exp(-0.5 * (ayy * dx * dx - 2 * p.xy * dx * dy + axx * dy * dy) / det);
        for (int a = 0; a <= 4; a++)
            for (int b = 0; a + b <= 4; b++)
                sum[a][b] += s * normal_moment(a, b, mx, my, xx, xy, yy);
    }
    struct moments m = {.x = cx, .y = cy, .w = w, .s = sum[0][0]};
    first[0] = sum[1][0] / m.s;
    first[1] = sum[0][1] / m.s;
    for (int k = 0; k <= 2; k++)
        m.m2[k] = sum[2 - k][k] / m.s;
    for (int k = 0; k <= 3; k++)
        m.m3[k] = sum[3 - k][k] / m.s;
    for (int k = 0; k <= 4; k++)
        m.m4[k] = sum[4 - k][k] / m.s;
    return m;
}

/* About the weighted centroid. */
static struct moments centred(const struct galaxy *g, double w)
{
    double cx = 0, cy = 0, f[2];
    struct moments m = about(g, cx, cy, w, f);
    for (int i = 0; i < 200 && hypot(f[0], f[1]) > 1e-15 * w; i++) {
        double a = 1 - m.m2[0] / w / w, b = -m.m2[1] / w / w, c = 1 - m.m2[2] / w / w, d = a * c - b * b;
        cx += (c * f[0] - b * f[1]) / d;
        cy += (a * f[1] - b * f[0]) / d;
        m = about(g, cx, cy, w, f);
    }
    return m;
}

/* A Gaussian PSF of this covariance under weight w. */
static struct rrg_psf gauss_psf(double xx, double xy, double yy, double w)
{
    struct galaxy star = {1, {{1, 0, 0, xx, xy, yy}}};
    struct moments m = centred(&star, w);
    struct rrg_psf p = {.w = w};
    memcpy(p.m2, m.m2, sizeof p.m2);
    memcpy(p.m4, m.m4, sizeof p.m4);
    return p;
}

static const struct rrg_options exact = {0};

/* 1.2: PSF freed of its weight. */
static void psf_weight(void)
{
    static const double ratio[] = {1, 1.5, 2, 3, 5}, first[] = {0.750, 0.905, 0.960, 0.990, 0.9985};
    struct check a = check_begin("PSF freed of its weight, resummed: exact"),
                 b = check_begin("the same to first order: .750 .905 .960 .990 .9985 of the truth");
    for (int k = 0; k < 5; k++) {
        double p[3];
        struct rrg_psf psf = gauss_psf(1.3, 0.2, 1.1, 1.1 * ratio[k]);
        check_close(&a, rrg_psf_free(&psf, 0, p), OK, 0.1);
        check_close(&a, p[0], 1.3, 1e-12);
        check_close(&a, p[1], 0.2, 1e-12);
        check_close(&a, p[2], 1.1, 1e-12);
        psf = gauss_psf(1, 0, 1, ratio[k]);
        check_close(&b, rrg_psf_free(&psf, 1, p), OK, 0.1);
        check_close(&b, p[0], first[k], 6e-4);
    }
    check_end(&a);
    check_end(&b);
    double p[3] = {0};
    struct rrg_psf flat = {.w = 2, .m2 = {3.99, 0, 3.99}, .m4 = {48, 0, 16, 0, 48}};
    int st = rrg_psf_free(&flat, 0, p);
    check_that(st == E_SINGULAR && p[0] > 0 && p[0] < 100, "flat PSF: E_SINGULAR and a finite value (%g)", p[0]);
}

/* 1.4 on mixtures: moments of the galaxy before the PSF under weff. */
static void round_psf_exact(void)
{
    struct check c = check_begin("round Gaussian PSF: 2nd, 3rd, 4th moments of the unconvolved mixture under weff");
    struct rng r = rng_stream(21, 0, RNG_TEST);
    for (uint32_t t = 0; t < 200; t++) {
        struct galaxy g = random_galaxy(&r, t, 1 + 2 * rng_uniform(&r, t, 90), 3);
        double g2 = 0.3 + 2 * rng_uniform(&r, t, 91), w = 1.5 + 4.5 * rng_uniform(&r, t, 92);
        struct galaxy seen = convolved(g, g2, 0, g2);
        struct moments m = centred(&seen, w);
        struct rrg_psf psf = gauss_psf(g2, 0, g2, w);
        struct rrg got;
        rrg_correct(&m, &psf, &exact, &got);
        struct moments want = centred(&g, sqrt(w * w + g2));
        double j = want.m2[0] + want.m2[2];
        check_close(&c, got.weff, sqrt(w * w + g2), 1e-12);
        for (int k = 0; k < 3; k++)
            check_close(&c, got.m2[k], want.m2[k], 2e-12 * j);
        for (int k = 0; k < 4; k++)
            check_close(&c, got.m3[k], want.m3[k], 2e-11 * j * sqrt(j));
        for (int k = 0; k < 5; k++)
            check_close(&c, got.m4[k], want.m4[k], 2e-11 * j * j);
        check_close(&c, got.d, sqrt((m.m2[0] + m.m2[2]) / 2), 1e-14);
        double of[2] = {got.e[0] * got.e[0] + got.e[1] * got.e[1], got.e[0] * got.mu[0] + got.e[1] * got.mu[1]};
        check_close(&c, rrg_response(&got), 2 - of[0] - got.lambda / 2 - of[1] / 2, 1e-12);
    }
    check_end(&c);
}

/* 1.3: what first order in q leaves falls as q^2. */
static void anisotropic_order(void)
{
    struct rng r = rng_stream(22, 0, RNG_TEST);
    struct galaxy g = random_galaxy(&r, 3, 2, 3);
    double left[4];
    for (int k = 0; k < 4; k++) {
        double q = 0.2 / (1 << k), w = 2.5, g2 = 1.3;
        struct galaxy seen = convolved(g, g2 + q, 0.5 * q, g2 - q);
        struct moments m = centred(&seen, w);
        struct rrg_psf psf = gauss_psf(g2 + q, 0.5 * q, g2 - q, w);
        struct rrg got;
        rrg_correct(&m, &psf, &exact, &got);
        struct moments want = centred(&g, sqrt(w * w + g2));
        left[k] = fmax(fabs(got.m2[0] - want.m2[0]), fmax(fabs(got.m2[1] - want.m2[1]), fabs(got.m2[2] - want.m2[2])));
    }
    struct check c = check_begin("elliptical PSF: residual falls as q^2 (ratio 4 per halving)");
    for (int k = 0; k < 3; k++)
        check_close(&c, left[k] / left[k + 1], 4, 0.6);
    check_end(&c);
    check_that(left[0] < 2e-2 && left[3] < 3e-4, "residual %.2g %.2g %.2g %.2g px^2 for q = .2 .1 .05 .025", left[0], left[1], left[2], left[3]);
}

/* <e1> over a ring of orientations under shear (s, 0); also mean response. */
static double ring(const struct galaxy *g, double s, double w, double g2, const struct rrg_options *opt, double *response)
{
    double e = 0, resp = 0;
    enum { N = 64 };
    for (int k = 0; k < N; k++) {
        struct galaxy turned = moved(g, 2 * M_PI * k / N, s, 0), seen = convolved(turned, g2, 0, g2);
        struct moments m = centred(&seen, w);
        struct rrg_psf psf = gauss_psf(g2, 0, g2, w);
        struct rrg got;
        rrg_correct(&m, &psf, opt, &got);
        e += got.e[0] / N;
        resp += rrg_response(&got) / N;
    }
    *response = resp;
    return e;
}

static void response(void)
{
    struct rng r = rng_stream(23, 0, RNG_TEST);
    struct check c = check_begin("round-centroid galaxies: G = d<e>/dg over a ring of 64, w = 1, 2, 4, 1e4"),
                 p = check_begin("P11, P22 of one galaxy with the centroid term = numerical derivative");
    static const double width[] = {1, 2, 4, 1e4};
    for (int t = 0; t < 4; t++)
        for (int k = 0; k < 4; k++) {
            struct galaxy g = random_galaxy(&r, (uint64_t)t, 1.5, 3);
            for (int i = 0; i < 3; i++)
                g.p[i].x = g.p[i].y = 0;
            double h = 1e-4, none;
            double d = (ring(&g, h, width[k], 0.8, &exact, &none) - ring(&g, -h, width[k], 0.8, &exact, &none)) / (2 * h);
            double gg;
            ring(&g, 0, width[k], 0.8, &exact, &gg);
            check_close(&c, gg, d, 2e-7);
        }
    check_end(&c);

    const struct rrg_options with = {.centroid = 1};
    double largest = 0;
    for (int t = 0; t < 40; t++) {
        struct galaxy g = random_galaxy(&r, 100 + (uint64_t)t, 1.5, 3);
        double w = 1.5 + 0.1 * t, g2 = 0.8, h = 1e-4, e[4];
        struct rrg_psf psf = gauss_psf(g2, 0, g2, w);
        struct rrg got, off;
        for (int k = 0; k < 4; k++) {
            struct galaxy turned = moved(&g, 0, k == 0 ? h : k == 1 ? -h : 0, k == 2 ? h : k == 3 ? -h : 0);
            struct galaxy seen = convolved(turned, g2, 0, g2);
            struct moments m = centred(&seen, w);
            rrg_correct(&m, &psf, &with, &got);
            e[k] = got.e[k / 2];
        }
        struct galaxy seen = convolved(g, g2, 0, g2);
        struct moments m = centred(&seen, w);
        rrg_correct(&m, &psf, &with, &got);
        rrg_correct(&m, &psf, &exact, &off);
        check_close(&p, got.p11, (e[0] - e[1]) / (2 * h), 3e-7);
        check_close(&p, got.p22, (e[2] - e[3]) / (2 * h), 3e-7);
        largest = fmax(largest, fabs(off.p11 / got.p11 - 1));
    }
    check_end(&p);
    check_that(largest > 1e-4, "without the centroid term P11 is off by up to %.2g", largest);
}

/* Whole chain with a Gaussian PSF: shear back from arbitrary mixtures. */
static void chain(void)
{
    struct rng r = rng_stream(24, 0, RNG_TEST);
    struct check c = check_begin("Gaussian PSF, mixtures, ring of 64: |m| <= 3e-4 at g = .01"),
                 c5 = check_begin("the same at g = .05: |m| <= 2e-3 (g^2)"),
                 pl = check_begin("plain fourth moments: m between -30 % and -1 %");
    const struct rrg_options with = {.centroid = 1}, plain = {.plain = 1};
    double sum[3] = {0};
    for (uint32_t t = 0; t < 12; t++) {
        struct galaxy g = random_galaxy(&r, 300 + t, 1.5, 3);
        double w = 2 + 2 * rng_uniform(&r, t, 95), g2 = 1.3, gg, unused;
        ring(&g, 0, w, g2, &with, &gg);
        double m1 = ring(&g, 0.01, w, g2, &with, &unused) / gg / 0.01 - 1;
        double m5 = ring(&g, 0.05, w, g2, &with, &unused) / gg / 0.05 - 1;
        check_close(&c, m1, 0, 3e-4);
        check_close(&c5, m5, 0, 2e-3);
        ring(&g, 0, w, g2, &plain, &gg);
        double m0 = ring(&g, 0.01, w, g2, &plain, &unused) / gg / 0.01 - 1;
        check_close(&pl, m0, -0.155, 0.145);
        sum[0] += m1 / 12;
        sum[1] += m5 / 12;
        sum[2] += m0 / 12;
    }
    check_end(&c);
    check_end(&c5);
    check_end(&pl);
    printf("# mean m: %.2e (g .01), %.2e (g .05), plain %.3f\n", sum[0], sum[1], sum[2]);
}

/* Errors of e by the moments' covariance against direct propagation by differences. */
static void error_propagation(void)
{
    struct check c = check_begin("errors of e and D: linear propagation of the covariance of J");
    struct rng r = rng_stream(25, 0, RNG_TEST);
    for (uint32_t t = 0; t < 20; t++) {
        struct galaxy g = random_galaxy(&r, t, 2, 2), seen = convolved(g, 1, 0, 1);
        struct moments m = centred(&seen, 3);
        double a[3][3];
        for (int i = 0; i < 9; i++)
            a[i / 3][i % 3] = 1e-3 * (rng_uniform(&r, t, (uint32_t)i + 60) - 0.5);
        int n = 0;
        for (int i = 0; i < 3; i++)
            for (int j = i; j < 3; j++, n++)
                m.cov[n] = a[i][0] * a[j][0] + a[i][1] * a[j][1] + a[i][2] * a[j][2];
        struct rrg_psf psf = gauss_psf(1, 0, 1, 3);
        struct rrg base, up;
        rrg_correct(&m, &psf, &exact, &base);
        double v[3] = {0};
        for (int k = 0; k < 3; k++) {
            struct moments step = m;
            for (int i = 0; i < 3; i++)
                step.m2[i] += 1e-3 * a[i][k];
            rrg_correct(&step, &psf, &exact, &up);
            v[0] += pow(1e3 * (up.e[0] - base.e[0]), 2);
            v[1] += pow(1e3 * (up.e[1] - base.e[1]), 2);
            v[2] += pow(1e3 * (up.d - base.d), 2);
        }
        check_close(&c, base.e_err[0], sqrt(v[0]), 1e-5 * sqrt(v[0]));
        check_close(&c, base.e_err[1], sqrt(v[1]), 1e-5 * sqrt(v[1]));
        check_close(&c, base.d_err, sqrt(v[2]), 1e-5 * sqrt(v[2]));
    }
    check_end(&c);
}

static void flags(void)
{
    struct galaxy star = {1, {{1, 0, 0, 1.2, 0, 1.2}}}, needle = {1, {{1, 0, 0, 4.2, 0, 0.9}}};
    struct rrg_psf psf = gauss_psf(1.3, 0, 1.3, 3);
    struct moments m = centred(&star, 3);
    struct rrg r;
    rrg_correct(&m, &psf, &exact, &r);
    check_that(r.flags == SHAPE_UNRESOLVED && isnan(r.e[0]) && isnan(r.p11) && isfinite(r.m2[0]) && r.d > 0,
               "smaller than the PSF: UNRESOLVED, e is NaN, moments kept");
    m = centred(&needle, 3);
    rrg_correct(&m, &psf, &exact, &r);
    check_that(r.flags == SHAPE_BIGE && r.e[0] > 1, "|e| = %.3f: BIGE, value kept", r.e[0]);
    m.flags = SHAPE_NOFLUX;
    rrg_correct(&m, &psf, &exact, &r);
    check_that(r.flags == SHAPE_NOFLUX && isnan(r.e[0]), "NOFLUX: nothing is added");
}

/* Group 5 of truth.txt from group 3, and the hard stamps' corrected values. */
static void truth(const char *dir)
{
    struct truth_line line[16];
    int n = truth_read(line, 16, dir);
    struct check c = check_begin("truth group 5 from group 3, round PSF"),
                 q = check_begin("truth group 5, elliptical PSF: within O(q^2)"),
                 st = check_begin("truth star: |J| corrected < 1e-6, UNRESOLVED");
    for (int i = 0; i < n; i++) {
        struct moments m = {.w = line[i].w, .s = line[i].point[0]};
        memcpy(m.m2, line[i].point + 1, sizeof m.m2);
        memcpy(m.m4, line[i].point + 4, sizeof m.m4);
        const double *p = line[i].psf, *want = line[i].galaxy;
        struct rrg_psf psf = gauss_psf(p[0], p[1], p[2], line[i].w);
        struct rrg r;
        rrg_correct(&m, &psf, &exact, &r);
        double quad = hypot(0.5 * (p[0] - p[2]), p[1]);
        int is_star = want[0] < 1e-9;
        struct check *to = is_star ? &st : quad > 0 ? &q : &c;
        double tol = is_star ? 1e-6 : quad > 0 ? 0.2 * quad * quad : 1e-13 * 20;
        if (is_star)
            check_close(&st, r.flags, SHAPE_UNRESOLVED, 0.1);
        for (int k = 0; k < 3; k++)
            check_close(to, r.m2[k], want[k], tol * (quad > 0 ? 1 : fmax(1, want[0])));
        for (int k = 0; k < 5 && quad == 0; k++)
            check_close(to, r.m4[k], want[3 + k], tol * fmax(1, want[3]));
    }
    check_end(&c);
    check_end(&q);
    check_end(&st);

    static const struct { const char *name; double t, e; int flags; } hard[] = {
        {"star", .0008, NAN, 0}, {"delta_pixel", NAN, NAN, SHAPE_UNRESOLVED}, {"w_too_small", NAN, NAN, SHAPE_UNRESOLVED},
        {"cosmic_hit", NAN, NAN, SHAPE_UNRESOLVED | SHAPE_SHIFT}, {"needle", NAN, 1.134, SHAPE_BIGE}, {"nan_outside", NAN, NAN, 0},
    };
    struct moments_scratch sc = {0};
    for (size_t i = 0; i < sizeof hard / sizeof *hard; i++) {
        struct truth_stamp t;
        char name[64];
        snprintf(name, sizeof name, "hard_%s", hard[i].name);
        if (!stamp_read(&t, dir, name, 0)) {
            check_that(0, "cannot read %s", name);
            continue;
        }
        struct moments_map map = {.nx = t.nx, .ny = t.ny, .pix64 = t.pix};
        struct moments_options opt = MOMENTS_DEFAULTS;
        struct moments m;
        struct rrg r;
        if (moments_measure(&map, &(struct moments_object){.x = t.x, .y = t.y, .w = t.w}, &opt, &sc, &m) != OK)
            check_that(0, "status");
        double p = 1.44 + 1 / 12.;
        struct rrg_psf psf = gauss_psf(p, 0, p, t.w);
        rrg_correct(&m, &psf, &exact, &r);
        double size = r.m2[0] + r.m2[2], e = hypot(r.e[0], r.e[1]);
        check_that(r.flags == hard[i].flags && (isnan(hard[i].t) || fabs(size - hard[i].t) < 5e-4) &&
                       (isnan(hard[i].e) || fabs(e - hard[i].e) < 1e-3),
                   "%s: flags %d (want %d), T = %.4f, |e| = %.4f", name, r.flags, hard[i].flags, size, e);
        stamp_done(&t);
    }
    moments_scratch_free(&sc);
}

/* The columns of field_010.truth: corrected moments and e from the table's own raw moments and PSF. */
static void field(const char *dir)
{
    char path[512], text[1024];
    snprintf(path, sizeof path, "%.400s/field_010.truth", dir);
    FILE *f = fopen(path, "r");
    if (!f) {
        check_skip("no %s", path);
        return;
    }
    struct check c = check_begin("field_010.truth: corrected moments, weff and e from its raw moments (8 digits)");
    while (fgets(text, sizeof text, f)) {
        double v[26];
        int k = 0;
        for (char *save, *w = strtok_r(text, " \n", &save); w && *w != '#' && k < 26; w = strtok_r(NULL, " \n", &save))
            v[k++] = strtod(w, NULL);
        if (k < 26)
            continue;
        struct moments m = {.w = v[3], .s = v[4]};
        memcpy(m.m2, v + 5, sizeof m.m2);
        memcpy(m.m4, v + 8, sizeof m.m4);
        struct rrg_psf psf = {.w = v[3]};
        memcpy(psf.m2, v + 14, sizeof psf.m2);
        double p[3];
        if (rrg_psf_free(&psf, 0, p) == OK)       /* fourth moments are not in the table: a Gaussian's */
            memcpy(psf.m4, gauss_psf(p[0], p[1], p[2], v[3]).m4, sizeof psf.m4);
        struct rrg r;
        rrg_correct(&m, &psf, &exact, &r);
        for (k = 0; k < 3; k++)
            check_close(&c, r.m2[k], v[17 + k], 1e-6 * (v[17] + v[19]));
        check_close(&c, r.weff, v[20], 1e-6);
        check_close(&c, r.e[0], v[21], 1e-6);
        check_close(&c, r.e[1], v[22], 1e-6);
    }
    fclose(f);
    check_end(&c);
}

int main(void)
{
    const char *shared = getenv("SHARED");
    char dir[400];
    snprintf(dir, sizeof dir, "%.300s/truth/rrg", shared ? shared : "../shared");
    psf_weight();
    round_psf_exact();
    anisotropic_order();
    response();
    chain();
    error_propagation();
    flags();
    if (stamps_present(dir)) {
        truth(dir);
        field(dir);
    } else {
        check_skip("no reference stamps in %s", dir);
    }
    return check_status();
}
