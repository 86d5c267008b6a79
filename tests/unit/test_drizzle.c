/*
 * test_drizzle.c - drops against a polygon clipped cell by cell (Sutherland and
 * Hodgman, a method the kernel does not use), bands, maps, hard geometries,
 * the paper's interlace, the noise factor of Fruchter and Hook.
 */
#include "check.h"
#include "drizzle.h"
#include "overlap.h"
#include "rng.h"
#include <stdlib.h>
#include <string.h>

static const struct rng R = {{0x12345, 0x678}, RNG_TEST};

static double uni(uint64_t i, uint32_t k)
{
    return rng_uniform(&R, i, k);
}

/* A band with flux and weight in planes. */
struct planes {
    long nx, y0, ny;
    double *flux, *weight;
    uint32_t *context;
    int split;
};

static int add_rows(enum drizzle_kernel kernel, double pixfrac, const struct drizzle_map *m,
                    const struct drizzle_input *in, struct planes *p)
{
    const size_t n = (size_t)(p->nx * p->ny);
    double *sum = malloc(2 * n * sizeof *sum);
    struct drizzle_band b = {.nx = p->nx, .y0 = p->y0, .ny = p->ny, .sum = sum, .context = p->context, .split = p->split};
    if (!sum)
        exit(1);
    for (size_t i = 0; i < n; i++) {
        sum[2 * i] = p->flux[i];
        sum[2 * i + 1] = p->weight[i];
    }
    const int st = drizzle_rows(kernel, pixfrac, m, in, &b);
    for (size_t i = 0; i < n; i++) {
        p->flux[i] = sum[2 * i];
        p->weight[i] = sum[2 * i + 1];
    }
    p->split = b.split;
    free(sum);
    return st;
}

/* ---- reference: clip a polygon at the four sides of a cell ---- */

static int clip_side(int n, double (*p)[2], int axis, double at, int keep_above, double (*q)[2])
{
    int m = 0;
    for (int i = 0; i < n; i++) {
        const double *a = p[i], *b = p[(i + 1) % n];
        double da = keep_above ? a[axis] - at : at - a[axis], db = keep_above ? b[axis] - at : at - b[axis];
        if (da >= 0)
            memcpy(q[m++], a, 2 * sizeof(double));
        if ((da > 0 && db < 0) || (da < 0 && db > 0)) {
            double t = da / (da - db);
            q[m][0] = a[0] + t * (b[0] - a[0]);
            q[m][1] = a[1] + t * (b[1] - a[1]);
            m++;
        }
    }
    return m;
}

static double clip_area(const double x[4], const double y[4], double cx, double cy)
{
    double p[16][2], q[16][2], s = 0;
    for (int i = 0; i < 4; i++) {
        p[i][0] = x[i];
        p[i][1] = y[i];
    }
    int n = clip_side(4, p, 0, cx, 1, q);
    n = clip_side(n, q, 0, cx + 1, 0, p);
    n = clip_side(n, p, 1, cy, 1, q);
    n = clip_side(n, q, 1, cy + 1, 0, p);
    for (int i = 0; i < n; i++) {
        const double *a = p[i], *b = p[(i + 1) % n];
        s += (a[0] - cx) * (b[1] - cy) - (b[0] - cx) * (a[1] - cy);
    }
    return 0.5 * s;
}

static double near20(double v)
{
    return floor(v * 0x1p20 + 0.5) * 0x1p-20;
}

enum { NI = 9, NO = 40 };

static void reference(const struct drizzle_map *m, double pf, const float *pix, const float *wht, double *flux, double *weight)
{
    static const double side[4][2] = {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}};
    for (int j = 0; j < NI; j++)
        for (int i = 0; i < NI; i++) {
            double X[4], Y[4], total = 0;
            if (isnan(pix[j * NI + i]) || !(wht[j * NI + i] > 0))
                continue;
            for (int k = 0; k < 4; k++) {
                double ox = 0, oy = 0;               /* affine: centre and shape are rounded apart */
                if (!m->node_x)
                    drizzle_map_at(m, i, j, &ox, &oy);
                drizzle_map_at(m, i + pf * side[k][0], j + pf * side[k][1], &X[k], &Y[k]);
                X[k] = near20(ox) + near20(X[k] - ox) + 0.5;
                Y[k] = near20(oy) + near20(Y[k] - oy) + 0.5;
            }
            for (int k = 0; k < 4; k++)
                total += 0.5 * (X[k] * Y[(k + 1) & 3] - X[(k + 1) & 3] * Y[k]);
            for (int r = 0; r < NO; r++)
                for (int c = 0; c < NO; c++) {
                    double a = clip_area(X, Y, c, r) / total;
                    flux[r * NO + c] += (double)wht[j * NI + i] * a * (double)pix[j * NI + i];
                    weight[r * NO + c] += (double)wht[j * NI + i] * a;
                }
        }
}

static struct drizzle_map random_map(uint64_t i, double scale)
{
    double t = 2 * M_PI * uni(i, 0), s = scale, g = 0.6 * uni(i, 1) - 0.3, flip = uni(i, 2) < 0.5 ? -1 : 1;
    struct drizzle_map m = {
        .xx = s * (cos(t) + g * sin(t)) * flip, .xy = -s * sin(t) + g * s * cos(t),
        .yx = s * sin(t) * flip, .yy = s * cos(t),
    };
    if (i % 7 == 0) {                /* 0, 45, 90 degrees without shear */
        double q = 0.25 * M_PI * (double)(i % 8), c = cos(q), n = sin(q);
        c = fabs(c) < 1e-9 ? 0 : c;
        n = fabs(n) < 1e-9 ? 0 : n;
        m.xx = s * c * flip;
        m.xy = -s * n;
        m.yx = s * n * flip;
        m.yy = s * c;
    }
    m.x0 = 20 - m.xx * 4 - m.xy * 4 + uni(i, 3);
    m.y0 = 20 - m.yx * 4 - m.yy * 4 + uni(i, 4);
    m.scale = sqrt(fabs(m.xx * m.yy - m.xy * m.yx));
    return m;
}

static void against_clip(void)
{
    struct check f = check_begin("200 random maps, square kernel: flux against polygon clipping");
    struct check w = check_begin("their weight");
    struct check t = check_begin("their total flux (what falls inside)");
    long uncovered = 0;
    for (uint64_t n = 0; n < 200; n++) {
        struct drizzle_map m = random_map(n, 0.2 + 3 * uni(n, 5));
        double pf = 0.2 + 1.3 * uni(n, 6), flux[NO * NO] = {0}, weight[NO * NO] = {0}, rf[NO * NO] = {0}, rw[NO * NO] = {0};
        float pix[NI * NI], wht[NI * NI];
        double sum = 0, got = 0;
        for (int i = 0; i < NI * NI; i++) {
            pix[i] = (float)(100 * uni(n, 10 + (uint32_t)i));
            wht[i] = (float)floor(4 * uni(n, 200 + (uint32_t)i));
            if (i % 11 == 5)
                pix[i] = NAN;
            else
                sum += (double)pix[i] * (double)wht[i];
        }
        struct drizzle_input in = {.nx = NI, .ny = NI, .pix = pix, .weight = wht, .w = 1, .scale = 1};
        struct planes band = {.nx = NO, .ny = NO, .flux = flux, .weight = weight};
        if (add_rows(DRIZZLE_SQUARE, pf, &m, &in, &band))
            check_that(0, "map %lu", (unsigned long)n);
        reference(&m, pf, pix, wht, rf, rw);
        for (int i = 0; i < NO * NO; i++) {
            check_close(&f, flux[i], rf[i], 3e-11);
            check_close(&w, weight[i], rw[i], 3e-13 * 4);
            uncovered += (weight[i] > 0) != (rw[i] > 1e-12);
            got += flux[i];
        }
        if (m.scale * (4 + 1.5) * 1.5 < 18)
            check_close(&t, got, sum, 1e-9);
    }
    check_end(&f);
    check_end(&w);
    check_end(&t);
    check_that(uncovered == 0, "covered pixels are the same (%ld differ)", uncovered);
}

static void interlace(void)
{
    enum { N = 30 };
    static float in[4][N * N];
    static double flux[4 * N * N], weight[4 * N * N];
    static const int phase[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    long bad = 0;
    memset(flux, 0, sizeof flux);
    memset(weight, 0, sizeof weight);
    struct planes b = {.nx = 2 * N, .ny = 2 * N, .flux = flux, .weight = weight};
    for (int e = 0; e < 4; e++) {
        for (int i = 0; i < N * N; i++)
            in[e][i] = (float)(428 + 20 * (uni((uint64_t)i, (uint32_t)e) - 0.5));
        struct drizzle_map m = {.x0 = phase[e][0] + 1e-8, .y0 = phase[e][1] - 2e-8, .xx = 2 + 1e-9, .yy = 2 - 1e-9, .scale = 2};
        struct drizzle_input x = {.nx = N, .ny = N, .pix = in[e], .w = 500, .scale = 0.25 * (2000 / 500.0)};
        if (add_rows(DRIZZLE_SQUARE, 0.5, &m, &x, &b) || drizzle_splits(DRIZZLE_SQUARE, 0.5, &m, N, N)
            || !drizzle_splits(DRIZZLE_SQUARE, 0.6, &m, N, N))
            bad++;
    }
    for (int y = 0; y < 2 * N; y++)
        for (int x = 0; x < 2 * N; x++) {
            int e = 0;
            while (phase[e][0] != (x & 1) || phase[e][1] != (y & 1))
                e++;
            size_t at = (size_t)(y * 2 * N + x);
            bad += (float)(flux[at] / weight[at]) != in[e][(y / 2) * N + x / 2];
        }
    check_that(bad == 0 && !b.split, "2 x 2 interlace with pixfrac 0.5: a copy, bit for bit; no drop is split");
}

/* Where columns fall is told beforehand: the same bytes with it, for shifts, flips, a grid that cuts columns off, and NaN. */
static void combs(void)
{
    enum { N = 23, W = 40, H = 50 };
    float pix[N * N];
    long told = 0, differ = 0;
    for (int i = 0; i < N * N; i++)
        pix[i] = i % 13 == 5 ? NAN : (float)uni((uint64_t)i, 41);
    static const double at[6][4] = {{0, 2, 1, 2}, {3, 1, 2, 1}, {41, -2, 1, 2}, {-7, 2, 45, -2}, {0.4, 0.5, 0.4, 1}, {5, 1.5, 0, 2}};
    for (int k = 0; k < 6; k++) {
        double f[2][W * H] = {{0}}, w[2][W * H] = {{0}};
        uint32_t c[2][W * H] = {{0}};
        const struct drizzle_map m = {.x0 = at[k][0], .xx = at[k][1], .y0 = at[k][2], .yy = at[k][3], .scale = sqrt(fabs(at[k][1] * at[k][3]))};
        struct drizzle_comb comb;
        drizzle_comb_make(&comb, DRIZZLE_SQUARE, 0.4, &m, N, N, W);
        told += comb.stride != 0;
        for (int with = 0; with < 2; with++) {
            struct drizzle_input in = {.nx = N, .ny = N, .pix = pix, .w = 3, .scale = 0.7, .bit = 2, .comb = with ? &comb : NULL};
            struct planes b = {.nx = W, .ny = H, .flux = f[with], .weight = w[with], .context = c[with]};
            if (add_rows(DRIZZLE_SQUARE, 0.4, &m, &in, &b))
                differ++;
        }
        differ += memcmp(f[0], f[1], sizeof f[0]) || memcmp(w[0], w[1], sizeof w[0]) || memcmp(c[0], c[1], sizeof c[0]);
    }
    check_that(told == 4 && differ == 0, "columns told beforehand: the same bytes (%ld of 4 told, %ld differ)", told, differ);
}

/* The same bytes for any cut of input rows and output bands. */
static void bands(void)
{
    enum { NX = 37, NY = 29, OX = 61, OY = 53 };
    static float pix[NX * NY], wht[NX * NY];
    static double f1[OX * OY], w1[OX * OY], f2[OX * OY], w2[OX * OY];
    static uint32_t c1[OX * OY], c2[OX * OY];
    for (int i = 0; i < NX * NY; i++) {
        pix[i] = (float)uni((uint64_t)i, 1);
        wht[i] = (float)uni((uint64_t)i, 2);
    }
    for (int kernel = DRIZZLE_SQUARE; kernel <= DRIZZLE_LANCZOS3; kernel++)
        for (int aligned = 0; aligned < 2; aligned++) {
            struct drizzle_map m = {.x0 = 3.3, .y0 = aligned ? 2.2 : 14.1, .xx = aligned ? 1.5 : 1.3, .xy = aligned ? 0 : 0.4,
                                    .yx = aligned ? 0 : -0.37, .yy = 1.6, .scale = 1.5};
            memset(f1, 0, sizeof f1);
            memset(w1, 0, sizeof w1);
            memset(f2, 0, sizeof f2);
            memset(w2, 0, sizeof w2);
            memset(c1, 0, sizeof c1);
            memset(c2, 0, sizeof c2);
            struct drizzle_input in = {.nx = NX, .ny = NY, .pix = pix, .weight = wht, .w = 3, .scale = 0.7, .bit = 4};
            struct planes b = {.nx = OX, .ny = OY, .flux = f1, .weight = w1, .context = c1};
            int st = add_rows((enum drizzle_kernel)kernel, 0.8, &m, &in, &b);
            for (long y = 0; y < OY; y += 7) {
                struct planes part = {.nx = OX, .y0 = y, .ny = OY - y < 7 ? OY - y : 7, .flux = f2 + y * OX,
                                            .weight = w2 + y * OX, .context = c2 + y * OX};
                for (long r = 0; r < NY; r += 5) {
                    struct drizzle_input rows = {.nx = NX, .y0 = r, .ny = NY - r < 5 ? NY - r : 5, .pix = pix + r * NX,
                                                 .weight = wht + r * NX, .w = 3, .scale = 0.7, .bit = 4};
                    st |= add_rows((enum drizzle_kernel)kernel, 0.8, &m, &rows, &part);
                }
            }
            double total = 0;
            for (int i = 0; i < OX * OY; i++)
                total += w1[i];
            check_that(!st && total > 0 && !memcmp(f1, f2, sizeof f1) && !memcmp(w1, w2, sizeof w1) && !memcmp(c1, c2, sizeof c1),
                       "kernel %d, %s: any bands, same bytes", kernel, aligned ? "aligned" : "turned");
        }
}

/* ---- maps ---- */

struct bend { double a, b, turn; };

static int bend_fn(void *ctx, size_t n, const double *x, const double *y, double *X, double *Y)
{
    const struct bend *k = ctx;
    const double c = 1.7 * cos(k->turn), s = 1.7 * sin(k->turn);
    for (size_t i = 0; i < n; i++) {
        X[i] = 10 + c * x[i] - s * y[i] + k->a * x[i] * x[i] + k->b * x[i] * y[i] * y[i];
        Y[i] = 20 + s * x[i] + c * y[i] - k->a * y[i] * x[i] + k->b * y[i] * y[i] * y[i];
    }
    return OK;
}

static int flat_fn(void *ctx, size_t n, const double *x, const double *y, double *X, double *Y)
{
    (void)ctx;
    (void)y;
    for (size_t i = 0; i < n; i++)
        X[i] = Y[i] = x[i];
    return OK;
}

static int nowhere_fn(void *ctx, size_t n, const double *x, const double *y, double *X, double *Y)
{
    (void)ctx;
    (void)x;
    (void)y;
    for (size_t i = 0; i < n; i++)
        X[i] = Y[i] = NAN;
    return E_RANGE;
}

static void maps(void)
{
    struct drizzle_map m;
    struct bend straight = {0, 0, 0.3}, along = {0, 0, 1e-11}, bent = {1e-5, 3e-8, 0.3};
    int st = drizzle_map_make(&m, 500, 400, bend_fn, &straight);
    check_that(!st && !m.node_x && fabs(m.scale - 1.7) < 1e-9, "an affine map is found");
    st = drizzle_map_make(&m, 500, 400, bend_fn, &along);
    check_that(!st && !m.node_x && m.xy == 0 && m.yx == 0, "axes within 5e-7 px are made parallel");
    st = drizzle_map_make(&m, 500, 400, bend_fn, &bent);
    check_that(!st && m.node_x, "a bent map gets a grid, step %ld", m.step);
    struct check c = check_begin("its error at 20000 random places, limit 1e-4 px");
    double lo[2], hi[2];
    long outside = 0;
    drizzle_map_bounds(&m, 100.3, 50, 300, 399.5, lo, hi);
    for (uint64_t i = 0; i < 20000; i++) {
        double x = 501 * uni(i, 1) - 1, y = 401 * uni(i, 2) - 1, X, Y, px, py;
        bend_fn(&bent, 1, &x, &y, &X, &Y);
        drizzle_map_at(&m, x, y, &px, &py);
        check_close(&c, px, X, 1e-4);
        check_close(&c, py, Y, 1e-4);
        if (x >= 100.3 && x <= 300 && y >= 50 && y <= 399.5)
            outside += px < lo[0] || px > hi[0] || py < lo[1] || py > hi[1];
    }
    check_end(&c);
    check_that(outside == 0 && hi[0] - lo[0] < 1.7 * 200 + 1.7 * 350, "bounds hold every point");
    drizzle_map_free(&m);
    check_that(drizzle_map_make(&m, 50, 40, flat_fn, NULL) == E_SINGULAR, "a map without area is refused");
    check_that(drizzle_map_make(&m, 50, 40, nowhere_fn, NULL) == E_RANGE, "a map that does not exist is refused");
}

/* A bent map: flux is kept, weights agree with clipping at the mapped corners. */
static void bent_drops(void)
{
    struct bend bent = {3e-3, 1e-4, 0.2};
    struct drizzle_map m;
    double flux[NO * NO] = {0}, weight[NO * NO] = {0}, rf[NO * NO] = {0}, rw[NO * NO] = {0}, sum = 0, got = 0;
    float pix[NI * NI], wht[NI * NI];
    for (int i = 0; i < NI * NI; i++) {
        pix[i] = (float)uni((uint64_t)i, 77);
        wht[i] = 1;
        sum += (double)pix[i];
    }
    int st = drizzle_map_make(&m, NI, NI, bend_fn, &bent);
    struct drizzle_input in = {.nx = NI, .ny = NI, .pix = pix, .w = 1, .scale = 1};
    struct planes band = {.nx = NO, .ny = NO, .flux = flux, .weight = weight};
    if (st == OK)
        st = add_rows(DRIZZLE_SQUARE, 0.9, &m, &in, &band);
    check_that(st == OK && m.node_x, "bent map drizzled");
    reference(&m, 0.9, pix, wht, rf, rw);
    struct check c = check_begin("bent map: weights against clipping, and the flux");
    for (int i = 0; i < NO * NO; i++) {
        check_close(&c, weight[i], rw[i], 3e-13);
        got += flux[i];
    }
    check_close(&c, got, sum, 1e-11);
    check_end(&c);
    drizzle_map_free(&m);
}

/* Forty distortions, turns and drop sizes against clipping; bands of three rows give the same bytes. */
static void bent_many(void)
{
    struct check c = check_begin("40 distorted maps: weights against clipping");
    long differ = 0, failed = 0;
    for (uint64_t n = 0; n < 40; n++) {
        struct bend bent = {6e-3 * (uni(n, 31) - 0.5), 4e-4 * (uni(n, 32) - 0.5), 0.8 * uni(n, 33) - 0.2};
        struct drizzle_map m;
        const double pf = 0.3 + uni(n, 34);
        double flux[NO * NO] = {0}, weight[NO * NO] = {0}, rf[NO * NO] = {0}, rw[NO * NO] = {0}, bf[NO * NO] = {0}, bw[NO * NO] = {0};
        float pix[NI * NI], wht[NI * NI];
        for (int i = 0; i < NI * NI; i++) {
            pix[i] = (float)uni(n, 300 + (uint32_t)i);
            wht[i] = (float)floor(3 * uni(n, 500 + (uint32_t)i));
        }
        if (drizzle_map_make(&m, NI, NI, bend_fn, &bent)) {
            failed++;
            continue;
        }
        struct drizzle_input in = {.nx = NI, .ny = NI, .pix = pix, .weight = wht, .w = 1, .scale = 1};
        struct planes whole = {.nx = NO, .ny = NO, .flux = flux, .weight = weight};
        failed += add_rows(DRIZZLE_SQUARE, pf, &m, &in, &whole) != OK;
        for (long y = 0; y < NO; y += 3) {
            struct planes part = {.nx = NO, .y0 = y, .ny = NO - y < 3 ? NO - y : 3, .flux = bf + y * NO, .weight = bw + y * NO};
            failed += add_rows(DRIZZLE_SQUARE, pf, &m, &in, &part) != OK;
        }
        differ += memcmp(flux, bf, sizeof flux) != 0 || memcmp(weight, bw, sizeof weight) != 0;
        reference(&m, pf, pix, wht, rf, rw);
        for (int i = 0; i < NO * NO; i++)
            check_close(&c, weight[i], rw[i], 2e-12);
        drizzle_map_free(&m);
    }
    check_end(&c);
    check_that(differ == 0 && failed == 0, "40 distorted maps: the same bytes from bands of three rows");
}

static void hard(void)
{
    enum { N = 5 };
    float pix[N * N];
    for (int i = 0; i < N * N; i++)
        pix[i] = (float)(1 + i);
    double flux[3][400], weight[3][400];
    memset(flux, 0, sizeof flux);
    memset(weight, 0, sizeof weight);
    const double pf[3] = {1, 0, 1e-9};
    const enum drizzle_kernel kernel[3] = {DRIZZLE_POINT, DRIZZLE_SQUARE, DRIZZLE_SQUARE};
    struct drizzle_input in = {.nx = N, .ny = N, .pix = pix, .w = 1, .scale = 1};
    struct drizzle_map turned = random_map(3, 2);
    turned.x0 -= 10;
    turned.y0 -= 10;
    int st = OK;
    for (int k = 0; k < 3; k++) {
        struct planes b = {.nx = 20, .ny = 20, .flux = flux[k], .weight = weight[k]};
        st |= add_rows(kernel[k], pf[k], &turned, &in, &b);
    }
    check_that(!st && !memcmp(flux[0], flux[1], sizeof flux[0]) && !memcmp(flux[0], flux[2], sizeof flux[0]),
               "pixfrac 0 and 1e-9 are the point kernel");

    /* one output pixel swallows all; one input pixel covers a thousand by a thousand */
    double f = 0, w = 0;
    struct drizzle_map tiny = {.x0 = 0, .y0 = 0, .xx = 1e-3, .yy = 1e-3, .scale = 1e-3};
    struct drizzle_map tiny_turned = {.xx = 7e-4, .xy = -7e-4, .yx = 7e-4, .yy = 7e-4, .scale = 1e-3};
    struct planes one = {.nx = 1, .ny = 1, .flux = &f, .weight = &w};
    st = add_rows(DRIZZLE_SQUARE, 1, &tiny, &in, &one) | add_rows(DRIZZLE_SQUARE, 1, &tiny_turned, &in, &one);
    check_that(!st && fabs(f - 650) < 1e-9 && fabs(w - 50) < 1e-12, "scale 1e-3: %g in one pixel", f);
    enum { BIG = 1000 };
    double *bf = calloc(2 * (size_t)BIG * BIG, sizeof *bf);
    if (!bf)
        exit(1);
    struct planes big = {.nx = BIG, .ny = BIG, .flux = bf, .weight = bf + BIG * BIG};
    struct drizzle_map huge = {.x0 = 499.5 - 2000, .y0 = 499.5 - 2000, .xx = 1000, .yy = 1000, .scale = 1000};
    struct drizzle_map huge_turned = {.x0 = 499.5 - 3 * BIG, .y0 = 499.5, .xx = 1000, .xy = 500, .yx = -500, .yy = 1000, .scale = 1118};
    st = add_rows(DRIZZLE_SQUARE, 1, &huge, &in, &big);
    double sum = 0, worst = 0;
    for (int i = 0; i < BIG * BIG; i++) {
        sum += bf[i];
        worst = fmax(worst, fabs(bf[i] - 13e-6));
    }
    check_that(!st && fabs(sum - 13) < 1e-9 && worst < 1e-17, "scale 1e3: one pixel spread over 10^6, worst error %.2g of 1.3e-5", worst);
    memset(bf, 0, 2 * sizeof *bf * BIG * BIG);
    st = add_rows(DRIZZLE_SQUARE, 1, &huge_turned, &in, &big);
    double least = 1, most = 0;
    for (int i = BIG * BIG; i < 2 * BIG * BIG; i++) {
        least = fmin(least, bf[i]);
        most = fmax(most, bf[i]);
    }
    check_that(!st && fabs(least * 1.25e6 - 1) < 1e-5 && fabs(most * 1.25e6 - 1) < 1e-5,
               "scale 1e3 turned: cover is even, %.9f to %.9f", least * 1.25e6, most * 1.25e6);
    free(bf);

    float bad[3] = {NAN, 5, 7}, zero[3] = {1, 0, -2};
    double g[3] = {0}, v[3] = {0};
    struct drizzle_map same = {.xx = 1, .yy = 1, .scale = 1};
    struct drizzle_input masked = {.nx = 3, .ny = 1, .pix = bad, .weight = zero, .w = 1, .scale = 1};
    struct planes row = {.nx = 3, .ny = 1, .flux = g, .weight = v};
    st = add_rows(DRIZZLE_SQUARE, 1, &same, &masked, &row);
    check_that(!st && v[0] == 0 && v[1] == 0 && v[2] == 0 && g[0] == 0, "NaN pixels and weights <= 0 do not count");
    struct drizzle_map away = {.x0 = 1e8, .y0 = -1e8, .xx = 1, .xy = 0.5, .yx = -0.5, .yy = 1, .scale = 1};
    st = add_rows(DRIZZLE_SQUARE, 1, &away, &in, &row) | add_rows(DRIZZLE_GAUSSIAN, 1, &away, &in, &row);
    check_that(!st && v[0] == 0, "an exposure elsewhere adds nothing");
    check_that(add_rows(DRIZZLE_SQUARE, -1, &same, &in, &row) == E_RANGE
               && add_rows(DRIZZLE_SQUARE, NAN, &same, &in, &row) == E_RANGE, "pixfrac outside its range is refused");
}

/* Gaussian and Lanczos kernels: sums over a wide grid tend to their integrals. */
static void smooth(void)
{
    const float d = 2;
    struct check c = check_begin("gaussian: centre value and total; lanczos: values");
    static double f[41 * 41], w[41 * 41];
    struct drizzle_map m = {.x0 = 20.25, .y0 = 19.875, .xx = 3, .xy = 0, .yx = 0, .yy = 3, .scale = 3};
    struct drizzle_input in = {.nx = 1, .ny = 1, .pix = &d, .w = 1, .scale = 1};
    struct planes b = {.nx = 41, .ny = 41, .flux = f, .weight = w};
    int st = add_rows(DRIZZLE_GAUSSIAN, 2, &m, &in, &b);
    double s = 6 / 2.3548, sum = 0;
    for (int i = 0; i < 41 * 41; i++)
        sum += w[i];
    check_close(&c, w[20 * 41 + 20], exp(-(0.0625 + 0.015625) / (2 * s * s)) / (2 * M_PI * s * s), 1e-15);
    check_close(&c, sum, pow(erf(2.5 / sqrt(2)), 2), 0.01);
    memset(w, 0, sizeof w);
    st |= add_rows(DRIZZLE_LANCZOS3, 1, &m, &in, &b);
    double x = M_PI * 0.25 / 3, y = M_PI * 1.125 / 3;
    check_close(&c, w[21 * 41 + 20], sin(x) / x * sin(x / 3) / (x / 3) * sin(y) / y * sin(y / 3) / (y / 3), 1e-14);
    check_end(&c);
    check_that(st == OK && f[0] == 0, "far pixels get nothing");
}

static void noise(void)
{
    static const double r[5] = {0.5, 1, 1.2, 1.5, 2}, want[5] = {1.2, 1.5, 1.6615, 1.9286, 2.4};
    struct check c = check_begin("noise factor of Fruchter and Hook, r = .5 1 1.2 1.5 2");
    for (int i = 0; i < 5; i++)
        check_close(&c, drizzle_noise_factor(DRIZZLE_SQUARE, r[i] / 2, 2), want[i], 5e-5);
    check_end(&c);
    /* by drops at random places: R^2 = (sum a)^2 / sum a^2 in the mean */
    double one = 1, squares = 0;
    const float d = 1;
    for (uint64_t i = 0; i < 4000; i++) {
        double f[64] = {0}, w[64] = {0};
        struct drizzle_map m = {.x0 = 3 + uni(i, 8), .y0 = 3 + uni(i, 9), .xx = 1.5, .yy = 1.5, .scale = 1.5};
        struct drizzle_input in = {.nx = 1, .ny = 1, .pix = &d, .w = 1, .scale = 1};
        struct planes b = {.nx = 8, .ny = 8, .flux = f, .weight = w};
        if (add_rows(DRIZZLE_SQUARE, 0.8, &m, &in, &b))
            one = 0;
        for (int k = 0; k < 64; k++)
            squares += w[k] * w[k] / 4000;
    }
    check_that(fabs(one / sqrt(squares) / drizzle_noise_factor(DRIZZLE_SQUARE, 0.8, 1.5) - 1) < 0.01,
               "measured on drops at random places, r = 1.2: %.4f", 1 / sqrt(squares));
    check_that(drizzle_noise_factor(DRIZZLE_POINT, 1, 2) == 1 && drizzle_noise_factor(DRIZZLE_SQUARE, 0, 2) == 1, "points are uncorrelated");
    double g = drizzle_noise_factor(DRIZZLE_GAUSSIAN, 1, 4), s = 4 / 2.3548;
    check_that(fabs(g / (2 * sqrt(M_PI) * s) - 1) < 1e-6, "gaussian, wide: 2 sqrt(pi) sigma = %.4f", g);
}

int main(void)
{
    against_clip();
    interlace();
    combs();
    bands();
    maps();
    bent_drops();
    bent_many();
    hard();
    smooth();
    noise();
    return check_status();
}
