/* Runs and components against a plain flood fill on random images. */
#include "check.h"
#include "rng.h"
#include "segment.h"
#include <float.h>
#include <stdlib.h>
#include <string.h>

/* A background of level 0 and rms 1 everywhere. */
static void flat(struct background *b, long nx, long ny, double node[8])
{
    memset(node, 0, 8 * sizeof *node);
    b->level = (struct mesh){nx, ny, 1, 1, 0, node, NULL, NULL};
    b->rms = (struct mesh){nx, ny, 1, 1, 1, node + 4, NULL, NULL};
}

/* Labels by repeated relaxation of indices: slow and obvious. */
static void relax(const unsigned char *on, long nx, long ny, long *label)
{
    for (long i = 0; i < nx * ny; i++)
        label[i] = on[i] ? i : -1;
    for (int changed = 1; changed;) {
        changed = 0;
        for (long y = 0; y < ny; y++)
            for (long x = 0; x < nx; x++)
                for (long v = -1; v <= 1; v++)
                    for (long u = -1; u <= 1; u++) {
                        if (x + u < 0 || x + u >= nx || y + v < 0 || y + v >= ny)
                            continue;
                        long a = y * nx + x, b = (y + v) * nx + x + u;
                        if (label[a] >= 0 && label[b] >= 0 && label[b] < label[a]) {
                            label[a] = label[b];
                            changed = 1;
                        }
                    }
    }
}

static int compare(long nx, long ny, double threshold, long min_area, int nans, const float *rms, uint64_t seed)
{
    struct image im = {0};
    struct background b = {0};
    struct smooth filter = {0};
    struct segments s = {0};
    double node[8];
    struct rng g = rng_stream(seed, 0, RNG_TEST);
    if (image_new(&im, nx, ny) || smooth_new(&filter, 0))
        return 0;
    flat(&b, nx, ny, node);
    const struct pixels pix = pixels_of(&im);
    size_t n = (size_t)(nx * ny);
    unsigned char *on = calloc(n, 1);
    long *label = malloc(n * sizeof *label), *size = calloc(n, sizeof *size), wanted = 0, pixels = 0;
    for (size_t i = 0; i < n; i++) {
        im.pix[i] = (float)rng_normal(&g, i, 0);
        if (nans && rng_uniform(&g, i, 1) < 0.1)
            im.pix[i] = i % 2 ? NAN : INFINITY;
        on[i] = fabsf(im.pix[i]) <= FLT_MAX && (double)im.pix[i] > (double)(float)threshold * (rms ? (double)rms[i] : 1);
    }
    relax(on, nx, ny, label);
    for (size_t i = 0; i < n; i++)
        if (on[i])
            size[label[i]]++;
    for (size_t i = 0; i < n; i++)
        wanted += size[i] >= min_area;
    struct par_team *team = par_team_new(2);
    struct segment_params p = {threshold, 1, rms, min_area, 0, team};
    int good = segment_find(&s, &pix, &b, &filter, &p) == OK && (long)s.ncomponent == wanted;
    par_team_free(team);
    long *of = malloc((s.ncomponent + 1) * sizeof *of);
    for (size_t c = 0; good && c < s.ncomponent; c++) {
        long here = 0;
        of[c] = -1;
        const float *value = s.value + s.at[c];
        for (size_t i = s.first[c]; i < s.first[c + 1]; i++)
            for (long x = s.run[i].x0; x < s.run[i].x1; x++) {
                long at = s.run[i].y * nx + x;
                good &= on[at] && (of[c] < 0 || label[at] == of[c]);
                good &= *value++ == im.pix[at];
                of[c] = label[at];
                here++;
            }
        good &= here == size[of[c]] && value == s.value + s.at[c + 1];
        good &= c == 0 || of[c] > of[c - 1];     /* in the order of their first pixels */
        pixels += here;
    }
    good &= pixels <= (long)s.npix;
    free(of);
    free(on);
    free(label);
    free(size);
    segment_free(&s);
    smooth_free(&filter);
    image_free(&im);
    return good;
}

static void random_images(void)
{
    static const long side[][2] = {{1, 1}, {1, 50}, {50, 1}, {3, 3}, {63, 40}, {64, 64}, {65, 300}, {200, 130}};
    int good = 0, all = 0;
    static float rms[40000];
    for (int i = 0; i < 40000; i++)
        rms[i] = i % 13 == 0 ? INFINITY : 0.5f + (float)(i % 7) * 0.2f;
    for (size_t k = 0; k < sizeof side / sizeof *side; k++)
        for (int t = 0; t < 8; t++) {
            double threshold = 0.05 + 0.25 * t;
            all += 3;
            good += compare(side[k][0], side[k][1], threshold, 1, 0, NULL, (uint64_t)(10 * k + (size_t)t));
            good += compare(side[k][0], side[k][1], threshold, 4, 1, NULL, (uint64_t)(1000 + 10 * k + (size_t)t));
            good += compare(side[k][0], side[k][1], threshold, 2, 1, rms, (uint64_t)(2000 + 10 * k + (size_t)t));
        }
    check_that(good == all, "components equal a plain flood fill: %d of %d images", good, all);
}

/* The filtered image in strips equals that of one pass, and noise has the promised rms. */
static void filtered(void)
{
    struct image im = {0};
    struct background b = {0};
    struct smooth f;
    double node[8];
    enum { NX = 300, NY = 290 };
    struct rng g = rng_stream(5, 0, RNG_TEST);
    if (image_new(&im, NX, NY) || smooth_new(&f, 2.5))
        return;
    flat(&b, NX, NY, node);
    const struct pixels pix = pixels_of(&im);
    for (uint64_t i = 0; i < NX * NY; i++)
        im.pix[i] = (float)rng_normal(&g, i, 0);
    static float whole[NX * NY], row[NX];
    check_that(segment_filtered(&pix, &b, NULL, &f, 0, 0, NY, whole) == OK, "all rows");
    int same = 1;
    for (long y = 0; y < NY; y += 17)
        same &= segment_filtered(&pix, &b, NULL, &f, 0, y, 1, row) == OK && !memcmp(row, whole + y * NX, sizeof row);
    check_that(same, "single rows have the same bits");
    double q = 0;
    for (long y = 10; y < NY - 10; y++)
        for (long x = 10; x < NX - 10; x++)
            q += (double)whole[y * NX + x] * (double)whole[y * NX + x];
    struct check c = check_begin("rms of filtered white noise");
    /* about (280 * 270)/(4 pi sigma^2 = 14) independent values: 1 % */
    check_close(&c, sqrt(q / ((NX - 20) * (NY - 20.0))), smooth_noise(&f), 0.03 * smooth_noise(&f));
    check_end(&c);
    struct segments one, two;
    struct par_team *team = par_team_new(2);
    struct segment_params p = {0.3, 1, NULL, 3, 0, NULL}, p2 = {0.3, 1, NULL, 3, 0, team};
    check_that(par_team_size(team) == 2 && par_team_size(NULL) == 1, "a team of two");
    if (segment_find(&one, &pix, &b, &f, &p) || segment_find(&two, &pix, &b, &f, &p2))
        return;
    par_team_free(team);
    int own = 1;
    for (size_t i = 0, at = 0; i < one.nrun; i++)
        for (long x = one.run[i].x0; x < one.run[i].x1; x++, at++)
            own &= one.smooth[at] == whole[one.run[i].y * NX + x] && one.value[at] == im.pix[one.run[i].y * NX + x];
    check_that(own && one.npix > 1000, "pixels have their filtered and their unfiltered value");
    check_that(one.nrun == two.nrun && !memcmp(one.run, two.run, one.nrun * sizeof *one.run)
               && !memcmp(one.smooth, two.smooth, one.npix * sizeof(float)), "1 and 2 threads: same runs, %zu", one.nrun);
    segment_free(&one);
    segment_free(&two);
    smooth_free(&f);
    image_free(&im);
}

int main(void)
{
    random_images();
    filtered();
    return check_status();
}
