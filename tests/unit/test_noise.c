/*
 * test_noise.c - the detector model: each effect alone, keys, threads, hard
 * pixels, and the noise that two nearly equal fields share.
 */
#include "check.h"
#include "noise.h"
#include "poisson.h"
#include <stdlib.h>
#include <string.h>

enum { NX = 512, NY = 300, N = NX * NY };
static float a[N], b[N], c[N];

static const struct noise plain = {.qe = 1, .saturate = INFINITY, .gain = 1};

static void fill(float *p, float v)
{
    for (int i = 0; i < N; i++)
        p[i] = v;
}

static void moments(const float *p, double *mean, double *var)
{
    double s = 0, ss = 0;
    for (int i = 0; i < N; i++)
        s += (double)p[i];
    s /= N;
    for (int i = 0; i < N; i++)
        ss += ((double)p[i] - s) * ((double)p[i] - s);
    *mean = s;
    *var = ss / (N - 1);
}

static int run(const struct noise *m, uint64_t seed, uint32_t exposure, int threads, float *p)
{
    struct noise_counts n = {0};
    return noise_add(m, seed, exposure, 0, N, threads, p, &n);
}

static void each_effect(void)
{
    struct check k = check_begin("mean and variance of sky, dark, read noise, qe, gain (z-scores)");
    static const struct { struct noise m; double source, mean, var; } cases[] = {
        {{.qe = 1, .saturate = INFINITY, .gain = 1}, 50, 50, 50},
        {{.qe = 1, .sky = 100, .saturate = INFINITY, .gain = 1}, 50, 150, 150},
        {{.qe = 0.5, .dark = 20, .saturate = INFINITY, .gain = 1}, 50, 45, 45},
        {{.qe = 1, .read_noise = 4, .saturate = INFINITY, .gain = 1}, 50, 50, 66},
        {{.qe = 1, .sky = 428, .read_noise = 4, .saturate = INFINITY, .gain = 2.5}, 0, 428 / 2.5, 444 / 6.25},
        {{.qe = 1, .sky = 428, .saturate = INFINITY, .gain = 1, .subtract = 428}, 0, 0, 428},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        double mean, var;
        fill(a, (float)cases[i].source);
        if (run(&cases[i].m, 1 + i, 0, 1, a))
            check_that(0, "case %zu ran", i);
        moments(a, &mean, &var);
        check_close(&k, mean, cases[i].mean, 4.5 * sqrt(cases[i].var / N));
        check_close(&k, var, cases[i].var, 4.5 * cases[i].var * sqrt(2.1 / N));
    }
    check_end(&k);
    struct noise m = plain;
    m.saturate = 60;
    fill(a, 50);
    struct noise_counts n = {0};
    int st = noise_add(&m, 1, 0, 0, N, 1, a, &n);
    long at = 0, above = 0;
    for (int i = 0; i < N; i++) {
        at += a[i] == 60;
        above += a[i] > 60;
    }
    check_that(!st && above == 0 && n.saturated > N / 20 && at >= n.saturated,
               "saturation cuts at 60: %ld pixels cut, %ld at the level, %ld above", n.saturated, at, above);
}

static void keys(void)
{
    struct noise m = plain;
    m.sky = 97;
    m.read_noise = 3;
    fill(a, 1);
    fill(b, 1);
    fill(c, 1);
    int st = run(&m, 9, 2, 1, a) | run(&m, 9, 2, 3, b);
    struct noise_counts n = {0};
    for (long i = 0; i < N;) {
        long step = 1 + (i * 37) % 5000;
        if (step > N - i)
            step = N - i;
        st |= noise_add(&m, 9, 2, (uint64_t)i, step, 1, c + i, &n);
        i += step;
    }
    check_that(!st && !memcmp(a, b, sizeof a), "1 and 3 threads, same bytes");
    check_that(!memcmp(a, c, sizeof a), "any tiling, same bytes");
    fill(b, 1);
    st = run(&m, 9, 3, 1, b);
    double sab = 0, ma, va, mb, vb;
    moments(a, &ma, &va);
    moments(b, &mb, &vb);
    for (int i = 0; i < N; i++)
        sab += ((double)a[i] - ma) * ((double)b[i] - mb);
    check_that(!st && fabs(sab / N / sqrt(va * vb)) < 4.5 / sqrt(N), "exposures 2 and 3 are unrelated: correlation %.4f",
               sab / N / sqrt(va * vb));
}

/* A bump on a sky of 428, and the same bump moved by 0.3 % of its height. */
static void shared(void)
{
    struct noise m = plain;
    m.sky = 428;
    double sab = 0, saa = 0, sbb = 0;
    for (int i = 0; i < N; i++) {
        double x = i % NX - NX / 2, y = i / NX - NY / 2, s = 300 * exp(-(x * x + y * y) / 5000);
        a[i] = (float)s;
        b[i] = (float)(s * (1 + 0.009 * x / 100));
        c[i] = a[i];
    }
    static float b0[N];
    memcpy(b0, b, sizeof b0);
    int st = run(&m, 1, 1, 1, a) | run(&m, 1, 1, 1, b);
    for (int i = 0; i < N; i++) {
        double na = (double)a[i] - (double)c[i] - 428, nb = (double)b[i] - (double)b0[i] - 428;
        sab += na * nb;
        saa += na * na;
        sbb += nb * nb;
    }
    double r = sab / sqrt(saa * sbb);
    check_that(!st && r > 0.999, "noise of two fields, means within 1 %%: correlation %.6f", r);
}

static void hard_pixels(void)
{
    struct noise m = plain;
    m.sky = 10;
    float p[8] = {NAN, -20, 3e7f, 2e15f, INFINITY, 0, -10, -9.99f};
    struct noise_counts n = {0};
    int st = noise_add(&m, 1, 1, 0, 8, 1, p, &n);
    check_that(!st && isnan(p[0]) && p[1] == 0 && p[2] > 2.9e7f && isnan(p[3]) && isnan(p[4]) && p[6] == 0,
               "NaN stays, negative means draw 0, means beyond 1e15 give NaN");
    check_that(n.blank == 1 && n.negative == 1 && n.large == 1 && n.refused == 2,
               "and are counted: %ld %ld %ld %ld", n.blank, n.negative, n.large, n.refused);
    struct noise bad[] = {plain, plain, plain, plain, plain};
    bad[0].sky = -1;
    bad[1].gain = 0;
    bad[2].qe = NAN;
    bad[3].read_noise = INFINITY;
    bad[4].saturate = NAN;
    int refused = 0;
    for (int i = 0; i < 5; i++) {
        float before = p[5];
        refused += noise_add(&bad[i], 1, 1, 0, 8, 1, p, &n) == E_RANGE && p[5] == before;
    }
    check_that(refused == 5, "parameters outside their range are refused, pixels untouched");
}

static void depth(void)
{
    /* 27.7 AB with zero point 26.65 in 2000 s: B = 10^(-0.8*1.05) 2000 / (100 * 0.2) */
    double rate = pow(10, -0.4 * (27.7 - 26.65)), sky = noise_depth_sky(rate, 2000, 0.2, 10);
    struct check k = check_begin("depth 27.7, 10 sigma in 0.2 arcsec^2");
    check_close(&k, sky, 14.454397707459275, 1e-12);
    check_close(&k, rate * 2000 / sqrt(0.2 * sky * 2000), 10, 1e-12);
    check_end(&k);
    /* a Gaussian of sigma s: 1/int P^2 = 4 pi s^2 */
    for (int i = 0; i < N; i++) {
        double x = i % NX - 255.5, y = i / NX - 149.5;
        a[i] = (float)exp(-(x * x + y * y) / (2 * 64));
    }
    struct check g = check_begin("effective area of a Gaussian");
    check_close(&g, noise_psf_area(N, a, 0.05), 4 * M_PI * 0.16, 1e-6);
    check_end(&g);
}

int main(void)
{
    each_effect();
    keys();
    shared();
    hard_pixels();
    depth();
    return check_status();
}
