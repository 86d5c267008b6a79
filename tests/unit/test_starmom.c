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

int main(void)
{
    spline();
    field();
    return check_status();
}
