/* render.c - sums the stamps of a plan into an image. */
#include "render.h"
#include "fft.h"
#include "par.h"
#include "simd.h"
#include <limits.h>
#include <stdlib.h>
#include <string.h>

#define BATCH_PIXELS 524288    /* doubles held by one batch of stamps: 4 MiB */
#define SHARES 48              /* pieces into which a batch is cut for the threads */
#define STRIPS 8               /* columns of the image added by one thread */
#define TALL 200               /* rows; taller stamps, always few, are added to the image itself */

int scene_stamp(const struct plan *p, size_t i, struct stamp_work *w, double *scratch, double *out)
{
    const struct draw *d = &p->draw[i];
    const struct emitter *s = &p->emitter[i];
    const struct view *v = &p->view;
    const double x = s->x - d->x0, y = s->y - d->y0, box = v->no_pixel ? 0 : v->pixel;
    struct shape shape;
    int st = plan_shape(p, i, scratch, &shape);
    if (st)
        return st;
    switch ((enum path)d->path) {
    case PATH_POINT:
        stamp_point(d->nx, d->ny, x, y, s->flux, out);
        return OK;
    case PATH_CLOSED:
        return stamp_closed(w, &shape, v->pixel, box, d->nx, d->ny, x, y, s->flux, out);
    case PATH_MAPPED:
        return stamp_mapped(w, &shape, v->pixel, box, d->nx, d->ny, x, y, s->flux, out);
    case PATH_FOURIER:
        return stamp_fourier(&p->grid[d->grid], w, &shape, x, y, s->flux, d->kcut, out);
    case PATH_NONE:
        break;
    }
    return E_RANGE;
}

/* Objects to draw: tall stamps first, then in order of their first row in the image, then of their number. */
struct entry {
    int row;
    unsigned int index;
};

static int by_row(const void *a, const void *b)
{
    const struct entry *p = a, *q = b;
    if (p->row != q->row)
        return p->row < q->row ? -1 : 1;
    return p->index < q->index ? -1 : p->index > q->index;
}

struct worker {
    struct stamp_work *work;
    double *scratch;
};

struct job {
    const struct plan *p;
    const struct entry *entry;     /* of this batch */
    double **stamp;                /* where each of its stamps goes */
    struct worker *worker;
    struct progress *bar;
};

static int draw_some(void *ctx, long begin, long end, int worker)
{
    const struct job *j = ctx;
    for (long i = begin; i < end; i++) {
        int st = scene_stamp(j->p, j->entry[i].index, j->worker[worker].work, j->worker[worker].scratch,
                             j->stamp[i]);
        if (st)
            return st;
    }
    if (j->bar)
        progress_tick(j->bar, end - begin);
    return OK;
}

/*
 * Rows of doubles that slide up the image: row y lives at y % height; the image starts as
 * zeros.  Columns are cut into strips that move by themselves, so that threads can share a batch.
 */
struct window {
    struct image *im;
    double *row;
    int height;
    long next[STRIPS];             /* first row of each strip not yet added to the image */
};

WIDE static void add_doubles(long n, const double *restrict from, double *restrict to)
{
    for (long i = 0; i < n; i++)
        to[i] += from[i];
}

WIDE static void add_floats(long n, const double *restrict from, float *restrict to)
{
    for (long i = 0; i < n; i++)
        to[i] = (float)(to[i] + from[i]);
}

static long strip_start(const struct window *w, int strip)
{
    return w->im->nx * strip / STRIPS;
}

/* Add rows below `end` of a strip to the image and clear them. */
static void window_move(struct window *w, int strip, long end)
{
    const long x0 = strip_start(w, strip), n = strip_start(w, strip + 1) - x0;
    for (; w->next[strip] < end; w->next[strip]++) {
        const long y = w->next[strip];
        double *from = w->row + (size_t)(y % w->height) * (size_t)w->im->nx + x0;
        add_floats(n, from, w->im->pix + (size_t)y * (size_t)w->im->nx + x0);
        memset(from, 0, (size_t)n * sizeof *from);
    }
}

/* The part of a stamp inside the strip: to the window, or to the image itself when it is tall. */
static void strip_add(struct window *w, int strip, const struct draw *d, int tall, const double *stamp)
{
    const long nx = w->im->nx, left = strip_start(w, strip), right = strip_start(w, strip + 1);
    const long x0 = d->x0 < left ? left : d->x0, x1 = d->x0 + (long)d->nx > right ? right : d->x0 + (long)d->nx;
    const long y0 = d->y0 < 0 ? 0 : d->y0, y1 = d->y0 + (long)d->ny > w->im->ny ? w->im->ny : d->y0 + (long)d->ny;
    if (x0 >= x1)
        return;
    if (!tall)
        window_move(w, strip, y0);
    for (long y = y0; y < y1; y++) {
        const double *from = stamp + (size_t)(y - d->y0) * (size_t)d->nx + (x0 - d->x0);
        if (tall)
            add_floats(x1 - x0, from, w->im->pix + (size_t)y * (size_t)nx + x0);
        else
            add_doubles(x1 - x0, from, w->row + (size_t)(y % w->height) * (size_t)nx + x0);
    }
}

struct addition {
    const struct plan *p;
    const struct entry *entry;
    double *const *stamp;
    size_t n;
    struct window *w;
};

static int add_strips(void *ctx, long begin, long end, int worker)
{
    const struct addition *a = ctx;
    (void)worker;
    for (long strip = begin; strip < end; strip++)
        for (size_t i = 0; i < a->n; i++)
            strip_add(a->w, (int)strip, &a->p->draw[a->entry[i].index], a->entry[i].row < 0, a->stamp[i]);
    return OK;
}

/* Number of entries from `begin` whose stamps fit one batch (at least one), and where they go. */
static size_t batch(const struct plan *p, const struct entry *e, size_t begin, size_t end, double *space,
                    double **stamp)
{
    size_t used = 0, n = 0;
    for (; begin + n < end && n < BATCH_PIXELS / 16; n++) {
        const struct draw *d = &p->draw[e[begin + n].index];
        size_t need = ((size_t)d->nx * (size_t)d->ny + 7) / 8 * 8;
        if (n > 0 && used + need > BATCH_PIXELS)
            break;
        stamp[n] = space + used;
        used += need;
    }
    return n;
}

static int run(const struct plan *p, size_t n, const struct entry *e, struct window *w, struct job *job,
               double *space, int threads)
{
    for (size_t begin = 0; begin < n;) {
        size_t m = batch(p, e, begin, n, space, job->stamp);
        job->entry = e + begin;
        int st = par_for((long)m, 1 + (long)m / SHARES, threads, draw_some, job);
        if (st)
            return st;
        struct addition add = {p, e + begin, job->stamp, m, w};
        st = par_for(STRIPS, 1, threads, add_strips, &add);
        if (st)
            return st;
        begin += m;
    }
    for (int strip = 0; w->row && strip < STRIPS; strip++)
        window_move(w, strip, w->im->ny);
    return OK;
}

static int workers_new(struct worker *w, int threads, size_t scratch)
{
    int st = OK;
    for (int t = 0; t < threads && st == OK; t++) {
        st = stamp_work_new(&w[t].work);
        w[t].scratch = malloc((3 * scratch + 1) * sizeof *w[t].scratch);
        if (!w[t].scratch)
            st = E_NOMEM;
    }
    return st;
}

/* What the entries of one pass need. */
struct pass {
    size_t n;
    int tallest;           /* rows of the window; 0: none */
    size_t largest;        /* doubles of the largest stamp */
};

/* Entries in drawing order: pass 0 of tall stamps, pass 1 of the others. */
static void order(const struct plan *p, struct entry *e, struct pass pass[2])
{
    size_t n = 0;
    for (size_t i = 0; i < p->n; i++) {
        const struct draw *d = &p->draw[i];
        if (d->path == PATH_NONE)
            continue;
        const int tall = d->ny > TALL;
        const size_t area = (size_t)d->nx * (size_t)d->ny;
        struct pass *q = &pass[!tall];
        e[n++] = (struct entry){tall ? -1 : d->y0 < 0 ? 0 : d->y0, (unsigned int)i};
        q->n++;
        q->tallest = !tall && d->ny > q->tallest ? d->ny : q->tallest;
        q->largest = area > q->largest ? area : q->largest;
    }
    qsort(e, n, sizeof *e, by_row);
}

/* One pass has its own memory: that of tall stamps is given back before the window is made. */
static int render_pass(const struct plan *p, const struct pass *q, const struct entry *e, struct image *im, int threads,
                       struct progress *bar)
{
    if (q->n == 0)
        return OK;
    struct window w = {.im = im, .height = q->tallest > im->ny ? (int)im->ny : q->tallest};
    struct worker *workers = calloc((size_t)threads, sizeof *workers);
    double **stamp = malloc((BATCH_PIXELS / 16 + 1) * sizeof *stamp);
    double *space = fft_alloc(((q->largest > BATCH_PIXELS ? q->largest : BATCH_PIXELS) + 8) * sizeof *space);
    if (q->tallest)
        w.row = calloc((size_t)w.height * (size_t)im->nx, sizeof *w.row);
    struct job job = {.p = p, .stamp = stamp, .worker = workers, .bar = bar};
    int st = workers && stamp && space && (w.row || !q->tallest) ? workers_new(workers, threads, plan_scratch(p)) : E_NOMEM;
    if (st == OK)
        st = run(p, q->n, e, &w, &job, space, threads);
    for (int t = 0; workers && t < threads; t++) {
        stamp_work_free(workers[t].work);
        free(workers[t].scratch);
    }
    free(workers);
    free(stamp);
    free(w.row);
    fft_free(space);
    return st;
}

int scene_render(const struct plan *p, struct image *im, int threads, struct progress *bar)
{
    if (im->nx != p->view.nx || im->ny != p->view.ny || threads < 1 || threads > 256 || p->n > UINT_MAX)
        return E_RANGE;
    struct pass pass[2] = {{0}};
    struct entry *e = malloc((p->n + 1) * sizeof *e);
    if (!e)
        return E_NOMEM;
    order(p, e, pass);
    int st = render_pass(p, &pass[0], e, im, threads, bar);
    if (st == OK)
        st = render_pass(p, &pass[1], e + pass[0].n, im, threads, bar);
    free(e);
    return st;
}
