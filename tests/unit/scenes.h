/*
 * scenes.h - the default telescope, and random numbers, for tests of the renderer.
 */
#ifndef TEST_SCENES_H
#define TEST_SCENES_H

#include "check.h"
#include "otf.h"
#include "pupil.h"
#include "rng.h"
#include <stdint.h>
#include <stdlib.h>

#define PI 3.14159265358979323846

static double uniform(int i, int k)
{
    const struct rng r = rng_stream(5, 0, RNG_TEST);
    return rng_uniform(&r, (uint64_t)i, (uint32_t)k);
}

/* The default telescope: 2 m, obscuration 0.3, three vanes, 820 nm. */
static void telescope(struct otf *t)
{
    struct pupil p = telescope_preset(0)->pupil;
    struct err e = {""};
    if (pupil_otf(&p, 128, t, &e)) {
        printf("not ok - %s\n", e.text);
        exit(1);
    }
    if (!t->sre && otf_spline(t))
        exit(1);
}

#endif
