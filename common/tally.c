/* tally.c - plans of many blocks, together. */
#include "tally.h"
#include <math.h>

#define PIXEL_COST 3.5e-9      /* seconds to sum, convert and write a pixel of the image */
#define AGAIN_COST 1e-9        /* seconds to sum it for one block more */

static struct tally_grid *grid_of(struct tally *t, int broad, double pixels)
{
    int i = 0;
    while (i < t->n_grid && (t->grid[i].broad != broad || t->grid[i].pixels != pixels))
        i++;
    if (i == TALLY_GRIDS)
        return NULL;
    if (i == t->n_grid)
        t->grid[t->n_grid++] = (struct tally_grid){.broad = broad, .pixels = pixels};
    return &t->grid[i];
}

static void add_grids(struct tally *t, const struct plan *p)
{
    for (int g = 0; g < p->n_grid; g++) {
        const struct stamp_grid *s = &p->grid[g];
        size_t n[2] = {0, 0};
        for (size_t i = 0; i < p->n; i++)
            if ((p->draw[i].path == PATH_FOURIER || p->draw[i].path == PATH_BROAD) && p->draw[i].grid == g)
                n[p->draw[i].path == PATH_BROAD]++;
        struct tally_grid *to = grid_of(t, n[1] > 0, s->n * s->pixel / p->view.pixel);
        if (!to)
            continue;
        to->n += n[0] + n[1];
        to->frequencies = 2 * s->kmax + 1 > to->frequencies ? 2 * s->kmax + 1 : to->frequencies;
    }
}

void tally_add(struct tally *t, const struct plan *p)
{
    const double pixels = (double)p->view.nx * (double)p->view.ny;
    t->cost += p->cost + pixels * (t->n ? AGAIN_COST : PIXEL_COST);
    t->n += p->n;
    t->n_bad += p->n_bad;
    t->n_short += p->n_short;
    for (int i = 0; i < PATH_COUNT; i++)
        t->count[i] += p->count[i];
    add_grids(t, p);
    t->fft_plans = p->fft_plans > t->fft_plans ? p->fft_plans : t->fft_plans;
    t->n_matrix = p->n_matrix > t->n_matrix ? p->n_matrix : t->n_matrix;
    t->bytes = fmax(t->bytes, p->bytes);
}
