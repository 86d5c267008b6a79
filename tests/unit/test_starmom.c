/* test_starmom.c - star moments against width: spline, averages, choice of stars. */
#include "check.h"
#include "rng.h"
#include "stamps.h"
#include "starmom.h"
#include <string.h>

/* J of a Gaussian of variance v under weight w. */
static double gauss(double v, double w)
{
    return v * w * w / (v + w * w);
}

static void spline(void)
{
    struct starmom s;
    struct rrg_psf p;
    struct check c = check_begin("spline of 24 widths through a Gaussian PSF: moments between the knots");
    check_close(&c, starmom_widths(&s, STARMOM_WIDTHS, 0.8, 10), OK, 0.1);
    for (int i = 0; i < s.n; i++)
        for (int q = 0; q < STARMOM_N; q++) {
            double j = gauss(0.72, s.w[i]);
            s.m[q][i] = q < 3 ? (q == 1 ? 0.01 : 1) * j : j * j;
        }
    check_close(&c, starmom_prepare(&s), OK, 0.1);
    for (double w = 0.8; w < 10; w *= 1.013) {
        starmom_at(&s, w, &p);
        double j = gauss(0.72, w);
        check_close(&c, p.m2[0], j, 3e-6);
        check_close(&c, p.m2[1], 0.01 * j, 3e-8);
        check_close(&c, p.m4[4], j * j, 1e-5);
    }
    for (int i = 0; i < s.n; i++) {
        starmom_at(&s, s.w[i], &p);
        check_close(&c, p.m2[0], s.m[0][i], 1e-14);
    }
    check_end(&c);
    starmom_at(&s, 50, &p);
    check_that(p.w == s.w[23] && p.m2[0] == s.m[0][23], "beyond the table: the last row");
    starmom_at(&s, 0.1, &p);
    check_that(p.w == s.w[0], "below the table: the first row");
    /* a cubic in log w is reproduced exactly by a not-a-knot spline */
    for (int i = 0; i < s.n; i++) {
        double u = log(s.w[i]);
        s.m[0][i] = 1 + u - 2 * u * u + 0.7 * u * u * u;
    }
    c = check_begin("cubic in log w: exact");
    check_close(&c, starmom_prepare(&s), OK, 0.1);
    for (double w = 0.81; w < 10; w *= 1.05) {
        double u = log(w);
        starmom_at(&s, w, &p);
        check_close(&c, p.m2[0], 1 + u - 2 * u * u + 0.7 * u * u * u, 1e-12);
    }
    check_end(&c);
    s.w[5] = s.w[4];
    check_that(starmom_prepare(&s) == E_RANGE, "widths that do not rise: refused");
    check_that(starmom_widths(&s, 3, 1, 2) == E_RANGE && starmom_widths(&s, 24, 2, 1) == E_RANGE &&
                   starmom_widths(&s, 24, NAN, 1) == E_RANGE, "bad widths: refused");
}

static void field(void)
{
    enum { N = 400, STARS = 36 };
    static double pix[N * N];
    struct moments_object o[STARS + 3] = {{0}};
    struct rng r = rng_stream(41, 0, RNG_TEST);
    stamp_fill(pix, N);
    for (int k = 0; k < STARS; k++) {
        double x = 40 + 62 * (k % 6) + rng_uniform(&r, (uint64_t)k, 0), y = 40 + 62 * (k / 6) + rng_uniform(&r, (uint64_t)k, 1);
        for (int j = -25; j <= 25; j++)
            for (int i = -25; i <= 25; i++) {
                double u = (int)x + i - x, v = (int)y + j - y;
                pix[((int)y + j) * N + (int)x + i] += 1000 * exp(-(u * u + v * v) / (2 * 0.81));
            }
        o[k] = (struct moments_object){.x = x + 0.2, .y = y - 0.3, .w = 1};
    }
    /* a galaxy, an empty place, one off the image */
    for (int j = -25; j <= 25; j++)
        for (int i = -25; i <= 25; i++)
            pix[(70 + j) * N + 70 + i] += 100 * exp(-(i * i + j * j) / (2 * 6.25));
    o[STARS] = (struct moments_object){.x = 70, .y = 70, .w = 1};
    o[STARS + 1] = (struct moments_object){.x = 10, .y = 390, .w = 1};
    o[STARS + 2] = (struct moments_object){.x = -10, .y = 390, .w = 1};
    struct moments_map map = {.nx = N, .ny = N, .pix64 = pix};
    struct moments_options opt = MOMENTS_DEFAULTS;
    struct starmom s = {.dstar_w = 1}, two = {.dstar_w = 1};
    struct check c = check_begin("36 Gaussian stars among a galaxy and nothing: mean moments, d*");
    check_close(&c, starmom_widths(&s, 24, 0.8, 5), OK, 0.1);
    check_close(&c, starmom_widths(&two, 24, 0.8, 5), OK, 0.1);
    check_close(&c, starmom_measure(&s, &map, STARS + 3, o, &opt, 0, 0, 1), OK, 0.1);
    check_close(&c, (double)s.stars[0], STARS, 0.1);
    for (int i = 0; i < s.n; i++) {
        /* the disc ends at 4 w: 1e-3 of the weight */
        check_close(&c, s.m[0][i], gauss(0.81, s.w[i]), 2e-3);
        check_close(&c, s.m[2][i], gauss(0.81, s.w[i]), 2e-3);
        check_close(&c, s.m[1][i], 0, 1e-3);
    }
    check_close(&c, s.dstar, sqrt(gauss(0.81, 1)), 3e-3);
    check_end(&c);
    check_that(starmom_measure(&two, &map, STARS + 3, o, &opt, 0, 0, 2) == OK && memcmp(&s, &two, sizeof s) == 0, "two threads: same bits");
    check_that(starmom_measure(&two, &map, STARS + 3, o, &opt, 10, 0, 1) == OK && two.stars[3] == 10, "at most 10 stars");
    check_that(starmom_measure(&two, &map, 1, o, &opt, 0, 0, 1) == E_MISSING, "one star is not enough");
    check_that(starmom_measure(&two, &map, 0, o, &opt, 0, 0, 1) == E_MISSING, "no star");
}

/* A field of 36 noisy, slightly elliptical stars and one galaxy at (70, 70). */
enum { SIDE = 400, NSTARS = 36 };
static void noisy_field(double *pix, struct moments_object *o)
{
    struct rng r = rng_stream(42, 0, RNG_TEST);
    for (size_t i = 0; i < (size_t)SIDE * SIDE; i++)
        pix[i] = 0.5 * rng_normal(&r, i, 5);
    for (int k = 0; k < NSTARS; k++) {
        double x = 40 + 62 * (k % 6) + rng_uniform(&r, (uint64_t)k, 0), y = 40 + 62 * (k / 6) + rng_uniform(&r, (uint64_t)k, 1);
        for (int j = -25; j <= 25; j++)
            for (int i = -25; i <= 25; i++) {
                double u = (int)x + i - x, v = (int)y + j - y;
                pix[((int)y + j) * SIDE + (int)x + i] += 1000 * exp(-(u * u / 0.9 + v * v / 0.75) / 2);
            }
        o[k] = (struct moments_object){.x = x, .y = y, .w = 1};
    }
    for (int j = -25; j <= 25; j++)
        for (int i = -25; i <= 25; i++)
            pix[(70 + j) * SIDE + 70 + i] += 300 * exp(-(i * i / 4.0 + i * j * 0.05 + j * j / 3.0) / 2);
}

/* The error of e by the stars: the formula against leaving out one star after the other, all the way to e. */
static void jackknife(void)
{
    static double pix[SIDE * SIDE];
    struct moments_object o[NSTARS], rest[NSTARS], galaxy = {.x = 70, .y = 70};
    struct moments_options opt = MOMENTS_DEFAULTS;
    struct moments_map map = {.nx = SIDE, .ny = SIDE, .pix64 = pix};
    struct moments_scratch sc = {0};
    struct moments m;
    struct starmom all = {.dstar_w = 1};
    noisy_field(pix, o);
    int st = starmom_widths(&all, 24, 0.8, 5);
    struct starmom less = all;
    if (st == OK)
        st = starmom_measure(&all, &map, NSTARS, o, &opt, 0, 0, 1);
    galaxy.w = all.w[14];
    if (st == OK)
        st = moments_measure(&map, &galaxy, &opt, &sc, &m);
    if (!check_that(st == OK && all.stars[0] == NSTARS, "36 noisy stars and a galaxy are measured"))
        return;
    static const struct rrg_options ways[] = {{0}, {.plain = 1}, {.first = 1}};
    struct check c = check_begin("error of e by the stars = jackknife over 36 of them (linear to 1 %), three ways of correction");
    for (int k = 0; k < 3; k++) {
        struct rrg_psf p;
        struct rrg r, full;
        double cov[8][8], err[2], sum[2] = {0}, sum2[2] = {0};
        starmom_at(&all, m.w, &p);
        starmom_cov(&all, m.w, cov);
        rrg_correct(&m, &p, &ways[k], &full);
        rrg_psf_error(&m, &p, &ways[k], (const double (*)[8])cov, &full, err);
        for (int out = 0; out < NSTARS; out++) {
            memcpy(rest, o, sizeof o);
            rest[out] = rest[NSTARS - 1];
            check_close(&c, starmom_measure(&less, &map, NSTARS - 1, rest, &opt, 0, 0, 1), OK, 0.1);
            starmom_at(&less, m.w, &p);
            rrg_correct(&m, &p, &ways[k], &r);
            for (int i = 0; i < 2; i++) {
                sum[i] += (r.e[i] - full.e[i]) / NSTARS;
                sum2[i] += pow(r.e[i] - full.e[i], 2) / NSTARS;
            }
        }
        for (int i = 0; i < 2; i++)
            check_close(&c, err[i] / sqrt((NSTARS - 1) * (sum2[i] - sum[i] * sum[i])), 1, 0.01);
    }
    check_end(&c);
    struct starmom median = {.dstar_w = 1};
    double a[8][8], b[8][8];
    check_that(starmom_widths(&median, 24, 0.8, 5) == OK && starmom_measure(&median, &map, NSTARS, o, &opt, 0, 1, 1) == OK, "the median of the stars");
    starmom_cov(&all, 2, a);
    starmom_cov(&median, 2, b);
    c = check_begin("variance of the median: pi/2 of the mean's; between rows between theirs");
    for (int q = 0; q < 8; q++)
        for (int r = 0; r < 8; r++)
            check_close(&c, b[q][r], a[q][r] * M_PI / 2, 1e-12 * fabs(a[q][r]));
    starmom_cov(&all, sqrt(all.w[7] * all.w[8]), a);
    check_close(&c, a[0][2], 0.5 * (all.cov[1][7] + all.cov[1][8]), 1e-12 * fabs(a[0][2]));
    check_close(&c, a[1][0], a[0][1], 0);
    check_end(&c);
    struct starmom known = {.dstar_w = 1};
    struct rrg_psf p;
    struct rrg r;
    double zero[8][8] = {{0}}, err[2];
    starmom_at(&all, m.w, &p);
    rrg_correct(&m, &p, &ways[0], &r);
    rrg_psf_error(&m, &p, &ways[0], (const double (*)[8])zero, &r, err);
    check_that(err[0] == 0 && err[1] == 0 && known.err[0][0] == 0, "a known PSF adds no error");
    moments_scratch_free(&sc);
}

int main(void)
{
    spline();
    field();
    jackknife();
    return check_status();
}
