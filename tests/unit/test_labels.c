/* Labels of pixels against a plain array, runs given in a random order. */
#include "check.h"
#include "labels.h"
#include "rng.h"
#include <stdlib.h>

enum { NX = 257, NY = 31 };

struct piece {
    int32_t y, x0, x1, label;
};

static int make(struct labels *l, const struct piece *run, size_t n)
{
    int st = labels_new(l, NX, NY);
    for (size_t i = 0; i < n && !st; i++)
        labels_count(l, run[i].y);
    if (!st)
        st = labels_room(l);
    for (size_t i = 0; i < n && !st; i++)
        labels_put(l, run[i].y, run[i].x0, run[i].x1, run[i].label);
    return st ? st : labels_sort(l);
}

int main(void)
{
    int good = 0, all = 0;
    for (uint32_t t = 0; t < 40; t++) {
        struct rng g = rng_stream(12, t, RNG_TEST);
        static struct piece run[NX * NY];
        static int32_t want[NX * NY], row[NX];
        size_t n = 0;
        for (int32_t y = 0; y < NY; y++)
            for (int32_t x = 0, end; x < NX; x = end) {
                uint64_t key = (uint64_t)(y * NX + x);
                int32_t label = (int32_t)(3 * rng_uniform(&g, key, 0));
                end = x + 1 + (int32_t)((t % 2 ? 6 : 1) * rng_uniform(&g, key, 1));
                end = end < NX ? end : NX;
                for (int32_t i = x; i < end; i++)
                    want[y * NX + i] = t ? label : 0;
                if (label && t)
                    run[n++] = (struct piece){y, x, end, label};
            }
        for (size_t i = n; i > 1; i--) {       /* shuffle */
            size_t k = (size_t)((double)i * rng_uniform(&g, i, 2));
            struct piece s = run[k];
            run[k] = run[i - 1];
            run[i - 1] = s;
        }
        struct labels l;
        if (make(&l, run, n))
            return 1;
        for (long y = 0; y < NY; y++) {
            labels_row(&l, y, row);
            for (long x = 0; x < NX; x++, all++)
                good += row[x] == want[y * NX + x] && labels_at(&l, x, y) == row[x];
            size_t end = l.row[y + 1];
            for (size_t i = l.row[y] + 1; i < end; i++)
                good -= !(l.run[i].x0 >= l.run[i - 1].x1);
        }
        labels_free(&l);
    }
    check_that(good == all, "labels of %d of %d pixels", good, all);
    return check_status();
}
