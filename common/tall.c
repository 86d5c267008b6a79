/* tall.c - large stamps, each made by all threads together. */
#include "tall.h"
#include "pages.h"
#include "simd.h"
#include <stdlib.h>

#define TALL 200               /* rows, at most, that a window of the image holds with ease */
#define WINDOW_PIXELS 1048576  /* doubles of a window, at most */
#define ROWS 8                 /* that stamp_part_rows makes */

int tall_is(const struct plan *p, const struct draw *d)
{
    return d->path == PATH_FOURIER && (d->ny > TALL || (d->ny > 16 && (long)d->ny * p->view.nx > WINDOW_PIXELS) || p->grid[d->grid].parts > 1);
}

/* Stamps are drawn in the order of their first row in the image, then of their number: what they add to is still in the last cache. */
struct place {
    int row;
    unsigned int index;
};

static int by_row(const void *a, const void *b)
{
    const struct place *p = a, *q = b;
    if (p->row != q->row)
        return p->row < q->row ? -1 : 1;
    return p->index < q->index ? -1 : p->index > q->index;
}

/* One thread's own memory. */
struct hand {
    struct stamp_work *work;
    double *rows;              /* eight, of the widest stamp */
};

struct job {
    const struct plan *p;
    struct image *im;
    size_t n;
    const struct place *place;
    double *plane;             /* of the stamp that all work on */
    double *scratch;           /* of its shape */
    struct stamp_work *work;   /* it itself: the first hand's */
    struct hand *hand;
    struct par_crew *crew;
    struct progress *bar;
};

WIDE static void add_row(long n, const double *restrict from, float *restrict to)
{
    for (long i = 0; i < n; i++)
        to[i] = (float)(to[i] + from[i]);
}

/* Make eight rows and add those inside the image; what lies outside is not made. */
static void rows_to_image(const struct job *j, const struct draw *d, int part, struct hand *h, int item)
{
    const int parts = j->p->grid[d->grid].parts, rows = d->ny / parts, first = item * ROWS, end = first + ROWS < rows ? first + ROWS : rows;
    const long nx = j->im->nx, x0 = d->x0 < 0 ? 0 : d->x0, x1 = d->x0 + (long)d->nx > nx ? nx : d->x0 + (long)d->nx;
    const long below = d->y0 + part + (long)first * parts, above = d->y0 + part + (long)(end - 1) * parts;
    if (x0 >= x1 || above < 0 || below >= j->im->ny)
        return;
    stamp_part_rows(j->work, h->work, item, h->rows, (size_t)d->nx);
    for (int k = first; k < end; k++) {
        const long y = d->y0 + part + (long)k * parts;
        if (y >= 0 && y < j->im->ny)
            add_row(x1 - x0, h->rows + (size_t)(k - first) * (size_t)d->nx + (x0 - d->x0), j->im->pix + (size_t)y * (size_t)nx + x0);
    }
}

static int start(const struct job *j, size_t i, int part)
{
    const struct draw *d = &j->p->draw[i];
    const struct emitter *s = &j->p->emitter[i];
    struct shape shape;
    int st = plan_shape(j->p, i, j->scratch, &shape);
    return st ? st : stamp_part_start(&j->p->grid[d->grid], j->work, &shape, s->x - d->x0, s->y - d->y0, s->flux, d->kcut, part, j->plane);
}

static int do_item(const struct job *j, const struct draw *d, int part, struct hand *h, enum stamp_stage stage, int item)
{
    if (stage == STAMP_FREQUENCIES)
        return stamp_part_frequencies(j->work, h->work, item);
    if (stage == STAMP_COLUMNS)
        stamp_part_columns(j->work, h->work, item);
    else
        rows_to_image(j, d, part, h, item);
    return OK;
}

/* A thread's share of one part. */
static int share(const struct job *j, size_t i, int part, struct hand *h)
{
    static const enum stamp_stage stages[] = {STAMP_FREQUENCIES, STAMP_COLUMNS, STAMP_ROWS};
    int st = par_crew_meet(j->crew, h->work == j->work ? start(j, i, part) : OK);
    if (st)
        return st;
    st = stamp_part_join(j->work, h->work);
    for (int s = 0; s < 3; s++) {
        const long items = st == OK ? stamp_part_items(j->work, stages[s]) : 0;
        for (long k; st == OK && (k = par_crew_take(j->crew)) < items;)
            st = do_item(j, &j->p->draw[i], part, h, stages[s], (int)k);
        st = par_crew_meet(j->crew, st);
        if (st)
            return st;
    }
    return OK;
}

static int draw_together(void *ctx, long begin, long end, int worker)
{
    const struct job *j = ctx;
    int st = OK;
    (void)end;
    (void)worker;
    for (size_t k = 0; k < j->n && st == OK; k++) {
        const size_t i = j->place[k].index;
        for (int part = 0; part < j->p->grid[j->p->draw[i].grid].parts && st == OK; part++)
            st = share(j, i, part, &j->hand[begin]);
        if (begin == 0 && j->bar)
            progress_tick(j->bar, 1);
    }
    return st;
}

static int hands_new(struct hand *h, int n, size_t width)
{
    int st = OK;
    for (int t = 0; t < n && st == OK; t++) {
        st = stamp_work_new(&h[t].work);
        h[t].rows = malloc(ROWS * width * sizeof *h[t].rows);
        if (!h[t].rows)
            st = E_NOMEM;
    }
    return st;
}

static void hands_free(struct hand *h, int n)
{
    for (int t = 0; h && t < n; t++) {
        stamp_work_free(h[t].work);
        free(h[t].rows);
    }
    free(h);
}

/* What all tall stamps need: their number, the doubles of the largest part, the widest. */
struct need {
    size_t n, doubles, width;
};

/* Their places, in order, to `place` unless it is NULL. */
static struct need find(const struct plan *p, struct place *place)
{
    struct need most = {0, 0, 0};
    for (size_t i = 0; i < p->n; i++) {
        const struct draw *d = &p->draw[i];
        if (!tall_is(p, d))
            continue;
        const size_t width = (size_t)d->nx, doubles = (size_t)(d->ny / p->grid[d->grid].parts) * stamp_stride(d->nx);
        most.doubles = doubles > most.doubles ? doubles : most.doubles;
        most.width = width > most.width ? width : most.width;
        if (place)
            place[most.n] = (struct place){d->y0 < 0 ? 0 : d->y0, (unsigned int)i};
        most.n++;
    }
    if (place)
        qsort(place, most.n, sizeof *place, by_row);
    return most;
}

int tall_render(const struct plan *p, struct image *im, struct par_team *team, struct progress *bar)
{
    const int threads = par_team_size(team);
    const struct need need = find(p, NULL);
    if (need.n == 0)
        return OK;
    struct place *place = malloc(need.n * sizeof *place);
    struct job j = {.p = p, .im = im, .bar = bar, .n = need.n, .place = place};
    j.plane = pages_block(need.doubles * sizeof *j.plane);
    pages_large(j.plane, need.doubles * sizeof *j.plane);
    j.scratch = malloc((3 * plan_scratch(p) + 1) * sizeof *j.scratch);
    j.hand = calloc((size_t)threads, sizeof *j.hand);
    j.crew = par_crew_new(threads);
    int st = place && j.plane && j.scratch && j.hand && j.crew ? hands_new(j.hand, threads, need.width) : E_NOMEM;
    if (st == OK) {
        find(p, place);
        j.work = j.hand[0].work;
        st = par_team_for(team, threads, 1, draw_together, &j);
    }
    par_crew_free(j.crew);
    hands_free(j.hand, threads);
    free(j.scratch);
    free(j.plane);
    free(place);
    return st;
}
