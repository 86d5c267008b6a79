/*
 * spoil.c - an image as telescopes give it: spoil IN OUT WEIGHT SEED SLOPE EXPOSURE
 * adds a sky that rises by SLOPE from the first to the last column and, bent,
 * from row to row; with EXPOSURE below 1 the upper third has noise as if exposed
 * for that part of the time, four columns and a box are dead, and WEIGHT is the
 * inverse variance relative to the rest.
 */
#include "err.h"
#include "load.h"
#include "rng.h"
#include <math.h>
#include <stdlib.h>

int main(int argc, char **argv)
{
    struct err e;
    if (argc != 7)
        die(EXIT_USAGE, "spoil IN OUT WEIGHT SEED SLOPE EXPOSURE");
    struct image im = load(argv[1]), w = load(argv[1]);
    double slope = atof(argv[5]), exposure = atof(argv[6]);
    struct rng g = rng_stream((uint64_t)atol(argv[4]), 0, RNG_TEST);
    for (long y = 0; y < im.ny; y++)
        for (long x = 0; x < im.nx; x++) {
            size_t at = (size_t)(y * im.nx + x);
            double u = (double)x / (double)im.nx, v = (double)y / (double)im.ny, weight = 1, p = (double)im.pix[at];
            if (exposure < 1 && 3 * y > 2 * im.ny) {
                weight = exposure;
                p += sqrt((1 / exposure - 1) * (p > 0 ? p : 0)) * rng_normal(&g, at, 0);
            }
            p += slope * (u + v * v);
            if (exposure < 1 && ((x >= im.nx / 2 && x < im.nx / 2 + 4) || (x < im.nx / 12 && y > im.ny / 2 && y < im.ny * 5 / 8)))
                p = weight = 0;
            im.pix[at] = (float)p;
            w.pix[at] = (float)weight;
        }
    if (image_write(&im, argv[2], NULL, NULL, 0, &e) || image_write(&w, argv[3], NULL, NULL, 0, &e))
        die(EXIT_RUN, "%s", e.text);
    image_free(&im);
    image_free(&w);
    return 0;
}
