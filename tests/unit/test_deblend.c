/*
 * Deblending: blends of Gaussians, the contrast rule at its edge, against a
 * slow version that labels every level anew, sums, and hard shapes.
 */
#include "check.h"
#include "deblend.h"
#include "rng.h"
#include <stdlib.h>
#include <string.h>

enum { SIDE = 96 };

struct scene {
    struct image im;
    struct segments s;
    int32_t *owner;
    struct blob_list list;
};

static int split(struct scene *c, double threshold, const struct deblend_params *p)
{
    struct background b = {0};
    struct smooth f;
    double node[8] = {0};
    b.level = (struct mesh){c->im.nx, c->im.ny, 1, 1, 0, node, NULL, NULL};
    struct segment_params sp = {threshold, 1, NULL, 1, 0, NULL};
    struct deblend_work *w;
    const struct pixels pix = pixels_of(&c->im);
    if (smooth_new(&f, 0) || deblend_work_new(&w) || segment_find(&c->s, &pix, &b, &f, &sp))
        return 0;
    c->owner = malloc((c->s.npix + 1) * sizeof *c->owner);
    int good = 1;
    for (size_t k = 0; k < c->s.ncomponent; k++)
        good &= deblend_component(&c->s, k, p, w, c->owner, &c->list) == OK;
    deblend_work_free(w);
    smooth_free(&f);
    return good;
}

static void done(struct scene *c)
{
    image_free(&c->im);
    segment_free(&c->s);
    free(c->owner);
    free(c->list.blob);
    *c = (struct scene){0};
}

static void add_gauss(struct image *im, double x0, double y0, double peak, double sigma)
{
    for (long y = 0; y < im->ny; y++)
        for (long x = 0; x < im->nx; x++)
            im->pix[y * im->nx + x] += (float)(peak * exp(-0.5 * (pow((double)x - x0, 2) + pow((double)y - y0, 2)) / (sigma * sigma)));
}

/* Number of objects of two Gaussians `distance` apart, the second with `ratio` of the peak. */
static size_t pair(double distance, double ratio, double contrast)
{
    struct scene c = {0};
    struct deblend_params p = {32, contrast, 5, 5, 1, NULL, 0, 0};
    if (image_new(&c.im, SIDE, SIDE))
        return 99;
    add_gauss(&c.im, 40.3, 45.8, 100, 3);
    add_gauss(&c.im, 40.3 + distance, 45.8, 100 * ratio, 3);
    size_t n = split(&c, 1, &p) ? c.list.n : 99;
    done(&c);
    return n;
}

static void pairs(void)
{
    check_that(pair(0, 1, 0.005) == 1 && pair(5, 1, 0.005) == 1, "equal Gaussians without a dip stay one");
    check_that(pair(9, 1, 0.005) == 2 && pair(14, 1, 0.005) == 2 && pair(12, 0.2, 0.005) == 2, "with a dip they are two");
    check_that(pair(12, 1, 0.5) == 1 && pair(12, 1, 1) == 1, "contrast 0.5 and 1: one");
    check_that(pair(12, 0.02, 0.005) == 1, "a bump of 2 %% below the contrast stays");
}

/* ---- the slow version: every level labelled anew, the tree walked from the root ---- */

struct slow {
    const float *v;
    const struct deblend_params *p;
    double total, level[64];
};

/* Pixels connected to `seed` above `t`: marks them `mark` in m, returns flux and count. */
static long spread(const struct slow *s, long seed, double t, int mark, int *m, double *flux)
{
    static long stack[SIDE * SIDE];
    long n = 0, top = 0;
    stack[top++] = seed;
    m[seed] = mark;
    *flux = 0;
    while (top) {
        long a = stack[--top], x = a % SIDE, y = a / SIDE;
        n++;
        *flux += (double)s->v[a];
        for (long v = y - 1; v <= y + 1; v++)
            for (long u = x - 1; u <= x + 1; u++)
                if (u >= 0 && v >= 0 && u < SIDE && v < SIDE && m[v * SIDE + u] != mark
                    && s->v[v * SIDE + u] > (float)t) {
                    m[v * SIDE + u] = mark;
                    stack[top++] = v * SIDE + u;
                }
    }
    return n;
}

/* Objects inside the branch that contains `seed` above level k: 0 when it is not split further. */
static int count_parts(const struct slow *s, long seed, int k)
{
    int *in = calloc(SIDE * SIDE, sizeof *in), *sub = calloc(SIDE * SIDE, sizeof *sub);
    int mark = 0, strong = 0, parts = 0, inner = 0;
    double flux;
    if (k + 1 < s->p->levels) {
        spread(s, seed, s->level[k], 1, in, &flux);
        for (long i = 0; i < SIDE * SIDE; i++) {
            if (in[i] != 1 || sub[i] || !(s->v[i] > (float)s->level[k + 1]))
                continue;
            long n = spread(s, i, s->level[k + 1], ++mark, sub, &flux);
            int own = count_parts(s, i, k + 1);
            inner += own;
            if (n >= s->p->branch_area && flux - (double)(float)s->level[k + 1] * (double)n > s->p->contrast * s->total) {
                strong++;
                parts += own ? own : 1;
            }
        }
    }
    free(in);
    free(sub);
    return strong > 1 ? parts : inner;
}

static void against_slow(void)
{
    int good = 0, all = 0, objects = 0;
    struct rng g = rng_stream(3, 0, RNG_TEST);
    for (uint64_t t = 0; t < 80; t++) {
        const int noisy = t >= 40;         /* small components with maxima of noise: most are spared the flood */
        struct scene c = {0};
        struct deblend_params p = {t % 2 ? 32 : 8, t % 3 ? 0.005 : 0.0005, 3, 3, 1, NULL, 0, 0};
        if (image_new(&c.im, SIDE, SIDE))
            return;
        for (uint64_t k = 0; k < 8; k++)
            add_gauss(&c.im, 20 + 55 * rng_uniform(&g, t, (uint32_t)(4 * k)), 20 + 55 * rng_uniform(&g, t, (uint32_t)(4 * k + 1)),
                      pow(10, 1 + 1.5 * rng_uniform(&g, t, (uint32_t)(4 * k + 2))), 1.5 + 3 * rng_uniform(&g, t, (uint32_t)(4 * k + 3)));
        for (long i = 0; noisy && i < SIDE * SIDE; i++)
            c.im.pix[i] *= 0.05f;
        if (t % 4 == 0 || noisy)
            for (uint64_t i = 0; i < SIDE * SIDE; i++)
                c.im.pix[i] += (noisy ? 1.5f : 0.5f) * (float)rng_normal(&g, 1000 * t * SIDE + i, 99);
        if (!split(&c, 1, &p))
            return;
        struct slow s = {c.im.pix, &p, 0, {0}};
        size_t wanted = 0;
        for (size_t k = 0; k < c.s.ncomponent; k++) {
            double peak = 0;
            long seed = -1, n = 0;
            s.total = 0;
            for (size_t i = c.s.first[k]; i < c.s.first[k + 1]; i++)
                for (long x = c.s.run[i].x0; x < c.s.run[i].x1; x++) {
                    seed = c.s.run[i].y * SIDE + x;
                    s.total += (double)c.im.pix[seed];
                    peak = fmax(peak, (double)c.im.pix[seed]);
                    n++;
                }
            for (int l = 0; l < p.levels; l++)
                s.level[l] = pow(peak, (double)l / (double)p.levels);
            int want = n > 2 * p.branch_area ? count_parts(&s, seed, 0) : 0;
            objects += want ? want : 1;
            wanted += (size_t)(want ? want : 1);
        }
        all++;
        good += wanted == c.list.n;
        done(&c);
    }
    check_that(good == all && objects > all, "as many objects as a slow labelling of every level: %d of %d images, %d objects", good, all, objects);
}

/* Sums over the objects of a component add up; centroids and axes of a lone Gaussian. */
static void sums(void)
{
    struct scene c = {0};
    struct deblend_params p = {32, 0.005, 5, 5, 0.01, NULL, 0, 0};
    if (image_new(&c.im, SIDE, SIDE))
        return;
    add_gauss(&c.im, 30.25, 40.5, 100, 3);
    add_gauss(&c.im, 45.25, 44.5, 80, 3);
    check_that(split(&c, 0.01, &p) && c.list.n == 2, "a pair");
    struct check t = check_begin("flux, pixels and moments of the parts and of their union");
    double flux = 0, want = 0, mx = 0, x, y, xx, xy, yy;
    long n = 0, on = 0;
    for (size_t i = 0; i < SIDE * SIDE; i++)
        if (c.im.pix[i] > 0.01f) {
            want += (double)c.im.pix[i];
            mx += (double)c.im.pix[i] * (double)(i % SIDE);
            on++;
        }
    struct blob u = c.list.blob[0];
    blob_absorb(&u, &c.list.blob[1]);
    double sum = 0;
    for (size_t i = 0; i < 2; i++) {
        flux += c.list.blob[i].flux;
        n += c.list.blob[i].n;
        sum += c.list.blob[i].sx + c.list.blob[i].x0 * c.list.blob[i].s;
    }
    check_close(&t, u.flux, want, 1e-9 * want);
    check_close(&t, (double)u.n, (double)on, 0.5);
    check_close(&t, flux, want, 1e-9 * want);          /* sums of 3000 doubles */
    check_close(&t, (double)n, (double)on, 0.5);
    check_close(&t, sum, mx, 1e-9 * mx);
    check_end(&t);
    done(&c);
    if (image_new(&c.im, SIDE, SIDE))
        return;
    add_gauss(&c.im, 50.37, 40.81, 1e6, 2.5);
    check_that(split(&c, 0.001, &p) && c.list.n == 1, "a lone Gaussian is one object");
    struct check m = check_begin("its centroid and variances");
    blob_moments(&c.list.blob[0], &x, &y, &xx, &xy, &yy);
    check_close(&m, x, 50.37, 1e-6);
    check_close(&m, y, 40.81, 1e-6);
    check_close(&m, xx, 6.25, 1e-5);                    /* tail below 1e-9 of the peak, float32 pixels */
    check_close(&m, yy, 6.25, 1e-5);
    check_close(&m, xy, 0, 1e-5);
    check_end(&m);
    done(&c);
    double a, b, th;
    struct check e = check_begin("axes and angles");
    ellipse_axes(9, 0, 4, &a, &b, &th);
    check_close(&e, a, 3, 1e-14);
    check_close(&e, b, 2, 1e-14);
    check_close(&e, th, 0, 1e-14);
    ellipse_axes(4, 0, 9, &a, &b, &th);
    check_close(&e, th, 90, 1e-14);
    ellipse_axes(4, -0.0, 9, &a, &b, &th);
    check_close(&e, th, 90, 1e-14);
    ellipse_axes(5, -1, 5, &a, &b, &th);
    check_close(&e, th, -45, 1e-13);
    check_end(&e);
}

static double profile(const double g[6], double x, double y)
{
    const double dx = x - g[0], dy = y - g[1], det = g[3] * g[5] - g[4] * g[4];
    return g[2] * exp(-0.5 * (g[5] * dx * dx - 2 * g[4] * dx * dy + g[3] * dy * dy) / det);
}

/* Pixels below the saddle of two long Gaussians (x, y, peak, xx, xy, yy) go to the one that is brighter there. */
static void sharing(void)
{
    static const double of[3][2][6] = {
        {{35, 48, 100, 64, 0, 9}, {58, 48, 100, 9, 0, 64}},
        {{38, 40, 100, 40, 30, 40}, {52, 56, 60, 40, -30, 40}},
        {{36, 48, 300, 9, 0, 9}, {60, 46, 40, 60, 20, 30}}};
    struct check t = check_begin("pixels of two long Gaussians and their mean places against the brighter one's at each pixel");
    for (int k = 0; k < 3; k++) {
        struct scene c = {0};
        struct deblend_params p = {32, 0.005, 5, 5, 0.1, NULL, 0, 0};
        double n[2] = {0}, x[2] = {0}, s[2] = {0};
        if (image_new(&c.im, SIDE, SIDE))
            return;
        for (long i = 0; i < SIDE * SIDE; i++) {
            const double u = (double)(i % SIDE), v = (double)(i / SIDE), a = profile(of[k][0], u, v), b = profile(of[k][1], u, v);
            c.im.pix[i] = (float)(a + b);
            if (c.im.pix[i] > 0.1f) {
                n[b > a]++;
                s[b > a] += a + b;
                x[b > a] += (a + b) * u;
            }
        }
        if (split(&c, 0.1, &p) && c.list.n == 2) {
            const int swap = c.list.blob[0].xpeak > c.list.blob[1].xpeak;
            for (int i = 0; i < 2; i++) {
                const struct blob *b = &c.list.blob[i ^ swap];
                check_close(&t, (double)b->n, n[i], 0.03 * n[i]);
                check_close(&t, b->sx / b->s + b->x0, x[i] / s[i], 0.1);
            }
        } else {
            check_that(0, "two long Gaussians are two: %zu", c.list.n);
        }
        done(&c);
    }
    check_end(&t);
}

/* A plateau, a checkerboard of plateaus, a spiral: no recursion, every pixel owned. */
static void hard_shapes(void)
{
    for (int kind = 0; kind < 3; kind++) {
        struct scene c = {0};
        long nx = kind == 2 ? SIDE : 700, ny = kind == 2 ? SIDE : 500;
        struct deblend_params p = {32, 0, 1, 1, 1, NULL, 0, 0};
        if (image_new(&c.im, nx, ny))
            return;
        for (long y = 0; y < ny; y++)
            for (long x = 0; x < nx; x++)
                c.im.pix[y * nx + x] = kind == 0 ? 5 : kind == 1 ? ((x + y) % 2 ? 5 : 2) : 0;
        for (double t = 0; kind == 2 && t < 60; t += 0.01)     /* r = 0.7 t: turns 4.4 px apart */
            c.im.pix[lround(48 + 0.7 * t * sin(t)) * nx + lround(48 + 0.7 * t * cos(t))] = (float)(3 + sin(9 * t));
        int good = split(&c, 1, &p);
        long owned = 0;
        for (size_t i = 0; i < c.list.n; i++)
            owned += c.list.blob[i].n;
        long on = 0;
        for (size_t i = 0; i < image_count(&c.im); i++)
            on += c.im.pix[i] > 1;
        check_that(good && owned == on && c.list.n >= 1 && (kind || c.list.n == 1), "%s: %zu objects own %ld pixels",
                   kind == 0 ? "plateau" : kind == 1 ? "checkerboard" : "spiral", c.list.n, owned);
        done(&c);
    }
}

/* A component larger than `most` stays one object, with the sums of the whole. */
static void too_large(void)
{
    struct scene c = {0}, d = {0};
    struct deblend_params p = {32, 1, 5, 5, 1, NULL, 0, 0}, q = {32, 1e-3, 5, 5, 1, NULL, 0, 100};
    if (image_new(&c.im, SIDE, SIDE) || image_new(&d.im, SIDE, SIDE))
        return;
    for (int k = 0; k < 2; k++) {
        add_gauss(k ? &d.im : &c.im, 20, 20, 100, 3);
        add_gauss(k ? &d.im : &c.im, 32, 22, 80, 3);
    }
    if (!check_that(split(&c, 1, &p) && split(&d, 1, &q) && c.list.n == 1 && d.list.n == 1, "one object both"))
        return;
    const struct blob *a = &c.list.blob[0], *b = &d.list.blob[0];
    struct check t = check_begin("sums of a component that is not split, straight from its runs");
    check_close(&t, b->flux, a->flux, 1e-9 * a->flux);
    check_close(&t, b->s, a->s, 1e-9 * a->s);
    check_close(&t, b->sx / b->s + b->x0, a->sx / a->s + a->x0, 1e-9);
    check_close(&t, b->peak, a->peak, 0);
    check_end(&t);
    check_that(b->n == a->n && b->above == a->above && b->xpeak == a->xpeak && b->flags == DETECT_UNSEPARATED
               && a->flags == 0, "pixels and flag");
    done(&c);
    done(&d);
}

/* Filtered and unfiltered values differ: each sum takes its own.  1 or 2 objects; owners in a place of their own, or in that of the values. */
static void two_values(int objects, int in_place)
{
    enum { W = 31, H = 9, X0 = 40, Y0 = 7 };
    static struct run run[H];
    float smooth[W * H], value[W * H];
    int32_t apart[W * H];
    size_t first[2] = {0, H}, at[2] = {0, W * H};
    double flux = 0, sum = 0, mx = 0, most = 0;
    long above = 0, top = 0;
    for (int y = 0; y < H; y++) {
        run[y] = (struct run){(uint16_t)(Y0 + y), X0, X0 + W};
        for (int x = 0; x < W; x++) {
            double f = 2 + 90 * exp(-0.3 * (pow(x - 5, 2) + pow(y - 3, 2))) + (objects > 1 ? 80 : 0) * exp(-0.3 * (pow(x - 24, 2) + pow(y - 5, 2)));
            int i = y * W + x;
            smooth[i] = (float)f;
            value[i] = (float)(7 * exp(-0.02 * (pow(x - 17, 2) + pow(y - 6, 2))) - 1);
            flux += (double)value[i];
            sum += (double)smooth[i];
            mx += (double)smooth[i] * x;
            most = (double)smooth[i] > most ? (double)smooth[i] : most;
            above += (double)value[i] > 1.5;
            top = value[i] > value[top] ? i : top;
        }
    }
    struct segments s = {H, W * H, run, smooth, value, 1, first, at};
    struct deblend_params p = {32, 0.005, 5, 3, 1.5, NULL, 0, 0};
    struct deblend_work *w;
    struct blob_list list = {0};
    int32_t *owner = in_place ? (int32_t *)(void *)smooth : apart;
    if (deblend_work_new(&w) || deblend_component(&s, 0, &p, w, owner, &list)) {
        check_that(0, "two kinds of values");
        return;
    }
    check_that((int)list.n == objects, "two kinds of values: %d objects, %zu found", objects, list.n);
    struct check c = check_begin("flux and peak of the image, moments and highest value of the filtered one");
    double got = 0, s_got = 0, sx = 0, highest = 0, peak = -1;
    long n = 0, over = 0, place = -1;
    for (size_t k = 0; k < list.n; k++) {
        const struct blob *b = &list.blob[k];
        got += b->flux;
        s_got += b->s;
        sx += b->sx + b->s * (b->x0 - X0);
        highest = b->smooth_peak > highest ? b->smooth_peak : highest;
        n += b->n;
        over += b->above;
        if (b->peak > peak) {
            peak = b->peak;
            place = (b->ypeak - Y0) * W + b->xpeak - X0;
        }
    }
    check_close(&c, got, flux, 1e-9 * fabs(flux));
    check_close(&c, s_got, sum, 1e-6 * sum);       /* shared light is divided in doubles */
    check_close(&c, sx, mx, 1e-6 * mx);
    check_close(&c, highest, most, 0.001 * (objects > 1) + 1e-12);
    check_close(&c, peak, (double)value[top], 1e-12);
    check_close(&c, (double)place, (double)top, 0.5);
    check_close(&c, (double)over, (double)above, 0.5);
    check_close(&c, (double)n, W * H, 0.5);
    check_end(&c);
    if (objects > 1) {
        int32_t left, right;
        memcpy(&left, &owner[3 * W + 5], sizeof left);
        memcpy(&right, &owner[5 * W + 24], sizeof right);
        check_that(left != right && left >= 0 && right >= 0 && left < 2 && right < 2, "owners of the two");
    }
    deblend_work_free(w);
    free(list.blob);
}

int main(void)
{
    two_values(1, 0);
    two_values(2, 0);
    two_values(2, 1);
    pairs();
    too_large();
    against_slow();
    sums();
    sharing();
    hard_shapes();
    return check_status();
}
