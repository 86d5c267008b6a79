/* Bridged pixels against a search from every bad one outwards. */
#include "check.h"
#include "mend.h"
#include "rng.h"
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { NX = 150, NY = 90, N = NX * NY };

static float map[N];
static struct image im;

static int good(long x, long y)
{
    return isfinite(im.pix[y * NX + x]) && map[y * NX + x] <= FLT_MAX;
}

/* Line through the nearest good pixels along (dx, dy), NAN when more than MEND_MOST bad ones lie between. */
static double line(const float *v, long x, long y, long dx, long dy)
{
    long a = 1, b = 1;
    for (; x - a * dx >= 0 && y - a * dy >= 0 && !good(x - a * dx, y - a * dy);)
        a++;
    for (; x + b * dx < NX && y + b * dy < NY && !good(x + b * dx, y + b * dy);)
        b++;
    if (x - a * dx < 0 || y - a * dy < 0 || x + b * dx >= NX || y + b * dy >= NY || a + b - 1 > MEND_MOST)
        return NAN;
    double left = (double)v[(y - a * dy) * NX + x - a * dx], right = (double)v[(y + b * dy) * NX + x + b * dx];
    return left + (right - left) * (double)a / (double)(a + b);
}

/* Bad: dead columns and rows, islands, a border, single pixels; each number once by the pixel and once by the map. */
static void spoil(void)
{
    struct rng g = rng_stream(7, 0, RNG_TEST);
    for (long i = 0; i < N; i++) {
        long x = i % NX, y = i / NX;
        im.pix[i] = (float)(0.01 * (double)(x * x) - 3 * (double)y + rng_normal(&g, (uint64_t)i, 0));
        map[i] = (float)(1 + 0.01 * (double)x);
        int bad = (x >= 20 && x < 36) || (x >= 60 && x < 77 && y > 9) || (y >= 40 && y < 56 && x > 80) || (y >= 70 && x > 100)
                  || x > 146 || rng_uniform(&g, (uint64_t)i, 1) < 0.03;
        if (bad && y % 2)
            im.pix[i] = y % 4 == 1 ? NAN : -INFINITY;
        else if (bad)
            map[i] = INFINITY;
    }
}

int main(void)
{
    if (image_new(&im, NX, NY))
        return 1;
    spoil();
    double node[4] = {0};
    struct background b = {.level = {NX, NY, 1, 1, 0, node, NULL, NULL}, .bad = 1};
    struct mend m;
    const struct pixels pix = pixels_of(&im);
    if (!check_that(mend_new(&m, &pix, &b, map) == OK, "scratch"))
        return check_status();
    static float v[N], rms[N], again[NX], rms_again[NX];
    static unsigned char kind[N], kind_again[NX];
    mend_seek(&m, 0);
    for (long y = 0; y < NY; y++) {
        pixels_row(&pix, y, 0, NX, v + y * NX);
        background_subtract(&b, y, 0, NX, 0, v + y * NX);
        mend_row(&m, v + y * NX, kind + y * NX, rms + y * NX);
    }
    struct check c = check_begin("bridged values and rms");
    long mended = 0, left = 0, kept = 0, wrong = 0;
    for (long y = 0; y < NY; y++)
        for (long x = 0; x < NX; x++) {
            long at = y * NX + x;
            double row = good(x, y) ? 0 : line(im.pix, x, y, 1, 0), value = isnan(row) ? line(im.pix, x, y, 0, 1) : row;
            double noise = isnan(row) ? line(map, x, y, 0, 1) : good(x, y) ? 0 : line(map, x, y, 1, 0);
            if (good(x, y)) {
                wrong += kind[at] != PIXEL_GOOD || v[at] < im.pix[at] || v[at] > im.pix[at] || rms[at] < map[at] || rms[at] > map[at];
                kept++;
            } else if (isnan(value)) {
                wrong += kind[at] != PIXEL_BAD || v[at] < 0 || v[at] > 0 || memcmp(&rms[at], &map[at], sizeof *map) != 0;
                left++;
            } else {
                wrong += kind[at] != PIXEL_MENDED;
                check_close(&c, (double)v[at], value, 1e-6 * (300 + fabs(value)));
                check_close(&c, (double)rms[at], noise, 1e-6);
                mended++;
            }
        }
    check_end(&c);
    check_that(wrong == 0 && mended > 1000 && left > 500 && kept > 5000, "%ld pixels bridged, %ld too deep, %ld good: each as it should be", mended, left, kept);
    int same = 1;
    for (long y = NY - 1; y >= 0; y -= 7) {
        mend_seek(&m, y);
        pixels_row(&pix, y, 0, NX, again);
        background_subtract(&b, y, 0, NX, 0, again);
        mend_row(&m, again, kind_again, rms_again);
        same &= !memcmp(again, v + y * NX, sizeof again) && !memcmp(kind_again, kind + y * NX, sizeof kind_again)
                && !memcmp(rms_again, rms + y * NX, sizeof rms_again);
    }
    check_that(same, "a row has the same bits wherever one begins");
    mend_free(&m);
    image_free(&im);
    return check_status();
}
