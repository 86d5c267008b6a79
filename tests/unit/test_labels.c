/* Labels of pixels against a plain array, from runs of random lengths. */
#include "check.h"
#include "labels.h"
#include "rng.h"
#include <stdlib.h>

enum { NX = 57, NY = 31 };

int main(void)
{
    int good = 0, all = 0;
    for (uint32_t t = 0; t < 40; t++) {
        struct rng g = rng_stream(12, t, RNG_TEST);
        struct label_run *run = malloc(NX * NY * sizeof *run);
        static int32_t want[NX * NY], row[NX];
        size_t n = 0;
        if (!run)
            return 1;
        for (int32_t y = 0; y < NY; y++)
            for (int32_t x = 0, end; x < NX; x = end) {
                uint64_t key = (uint64_t)(y * NX + x);
                int32_t label = (int32_t)(3 * rng_uniform(&g, key, 0));
                end = x + 1 + (int32_t)(6 * rng_uniform(&g, key, 1));
                end = end < NX ? end : NX;
                for (int32_t i = x; i < end; i++)
                    want[y * NX + i] = t ? label : 0;
                if (label && t)
                    run[n++] = (struct label_run){y, x, end, label};
            }
        struct labels l;
        if (labels_new(&l, NX, NY, run, n))
            return 1;
        for (long y = 0; y < NY; y++) {
            labels_row(&l, y, row);
            for (long x = 0; x < NX; x++, all++)
                good += row[x] == want[y * NX + x] && labels_at(&l, x, y) == row[x];
            size_t end = l.row[y + 1];
            for (size_t i = l.row[y] + 1; i < end; i++)
                good -= !(l.run[i].x0 >= l.run[i - 1].x1 && l.run[i].y == y);
        }
        labels_free(&l);
    }
    check_that(good == all, "labels of %d of %d pixels", good, all);
    return check_status();
}
