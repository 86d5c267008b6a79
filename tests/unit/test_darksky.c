/* Level between objects: pure noise, faint light below the noise of a pixel, bad pixels, cells without dark blocks. */
#include "check.h"
#include "darksky.h"
#include "rng.h"
#include <stdlib.h>

enum { SIDE = 256 };

static int level_of(const struct image *im, double start, double *level)
{
    struct darksky d;
    const struct pixels pix = pixels_of(im);
    *level = start;
    if (darksky_new(&d, &pix))
        return E_NOMEM;
    int st = darksky_rows(&d, &pix, NULL, 0, im->ny);
    if (!st)
        st = darksky_level(&d, 0, im->nx, 0, im->ny, 1, level);
    darksky_free(&d);
    return st;
}

int main(void)
{
    struct image im;
    if (image_new(&im, SIDE, SIDE))
        return 1;
    struct rng g = rng_stream(5, 0, RNG_TEST);
    for (long i = 0; i < SIDE * SIDE; i++)
        im.pix[i] = (float)(100 + rng_normal(&g, (uint64_t)i, 0));
    double level = 0, plain = 0;
    struct check c = check_begin("level of 100 with noise 1, from starts 0.3 off");
    for (int k = -1; k <= 1; k++) {
        check_that(level_of(&im, 100 + 0.3 * k, &level) == OK, "start %.1f", 100 + 0.3 * k);
        check_close(&c, level, 100, 3.0 / SIDE * 1.3);      /* 3 sigma of the mean of three quarters of the pixels */
    }
    check_end(&c);
    for (long y = 0; y < SIDE; y++)                         /* light of 0.5 in every sixth square of 16 */
        for (long x = 0; x < SIDE; x++) {
            float light = (x / 16 * 5 + y / 16) % 6 == 0 ? 0.5f : 0;
            im.pix[y * SIDE + x] += light;
            plain += light;
        }
    struct check f = check_begin("with faint light that moves the mean by 0.08: a third of that at most");
    if (!check_that(level_of(&im, 100.08, &level) == OK && plain > 0.07 * SIDE * SIDE, "faint light"))
        return 1;
    check_close(&f, level, 100, 0.027);
    check_end(&f);
    for (long y = 0; y < SIDE; y++)
        for (long x = 0; x < SIDE; x += x % 7 ? 1 : 2)
            im.pix[y * SIDE + x] = x % 14 ? im.pix[y * SIDE + x] : NAN;
    check_that(level_of(&im, 100.05, &level) == OK && fabs(level - 100) < 0.03, "dead columns: %.4f", level);
    for (long i = 0; i < SIDE * SIDE; i++)
        im.pix[i] = (float)NAN;
    check_that(level_of(&im, 7, &level) == OK && fabs(level - 7) < 1e-12, "nothing usable: the start stays");
    for (long i = 0; i < SIDE * SIDE; i++)
        im.pix[i] = i % 2 ? 1e30f : -1e30f;
    check_that(level_of(&im, 7, &level) == OK && fabs(level - 7) < 1e-12, "values out of proportion: the start stays");
    image_free(&im);
    if (image_new(&im, 3, 300))
        return 1;
    check_that(level_of(&im, 7, &level) == OK && fabs(level - 7) < 1e-12, "an image narrower than a block: the start stays");
    image_free(&im);
    return check_status();
}
