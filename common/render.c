/* render.c - sums the stamps of a plan into an image. */
#include "render.h"
#include "fft.h"
#include "par.h"
#include "simd.h"
#include <limits.h>
#include <stdlib.h>
#include <string.h>

#define BATCH_PIXELS 524288    /* doubles held by one batch of stamps: 4 MiB */
#define PAIR_PIXELS 1310720    /* of two batches, one drawn while the other is added, for several threads: 10 MiB */
#define WINDOW_PIXELS 1048576  /* doubles of the window, at most */
#define PART_PIXELS 1048576    /* pixels, about, of one part of a stamp without a PSF */
#define SHARES 48              /* pieces into which a batch is cut for the threads */
#define PAGE_FLOATS 1024       /* in the smallest page of memory */
#define STRIPS 8               /* columns of the image added by one thread */
#define TALL 200               /* rows; taller stamps, always few, are added to the image itself */

/* Objects to draw: tall stamps first, then in order of their first row in the image, then of their number. */
struct entry {
    int row;                       /* -1: tall */
    int part;
    unsigned int index;
};

/* Rows of a stamp that are made together: first, first + step, ... (`rows` of them), `stride` doubles apart. */
struct piece {
    int first, step, rows;
    size_t stride;
};

/* Large stamps come in parts, so that memory does not grow with them. */
static int parts_of(const struct plan *p, const struct draw *d, int tall)
{
    if (!tall || d->nx < 1)
        return 1;
    if (d->path == PATH_FOURIER)
        return p->grid[d->grid].parts;
    const int rows = PART_PIXELS / d->nx < 1 ? 1 : PART_PIXELS / d->nx;
    return (d->ny + rows - 1) / rows;
}

static struct piece piece_of(const struct plan *p, const struct entry *e)
{
    const struct draw *d = &p->draw[e->index];
    struct piece q = {0, 1, d->ny, (size_t)d->nx};
    if (e->row >= 0)
        return q;
    const int parts = parts_of(p, d, 1);
    if (d->path == PATH_FOURIER)
        return (struct piece){e->part, parts, d->ny / parts, stamp_stride(d->nx)};
    const int rows = PART_PIXELS / d->nx < 1 ? 1 : PART_PIXELS / d->nx;
    q.first = e->part * rows;
    q.rows = d->ny - q.first < rows ? d->ny - q.first : rows;
    return q;
}

/* Draw one piece; a tall Fourier stamp in place, with its stride. */
static int draw_piece(const struct plan *p, const struct entry *e, struct stamp_work *w, double *scratch, double *out)
{
    const size_t i = e->index;
    const struct draw *d = &p->draw[i];
    const struct emitter *s = &p->emitter[i];
    const struct view *v = &p->view;
    const struct piece q = piece_of(p, e);
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
        return stamp_closed(w, &shape, v->pixel, box, d->nx, q.rows, x, y - q.first, s->flux, out);
    case PATH_MAPPED:
        return stamp_mapped(w, &shape, v->pixel, box, d->nx, q.rows, x, y - q.first, s->flux, out);
    case PATH_FOURIER:
        if (e->row < 0)
            return stamp_fourier_part(&p->grid[d->grid], w, &shape, x, y, s->flux, d->kcut, q.first, out);
        return stamp_fourier(&p->grid[d->grid], w, &shape, x, y, s->flux, d->kcut, out);
    case PATH_NONE:
        break;
    }
    return E_RANGE;
}

int scene_stamp(const struct plan *p, size_t i, struct stamp_work *w, double *scratch, double *out)
{
    const struct draw *d = &p->draw[i];
    struct entry e = {0, 0, (unsigned int)i};
    const int parts = d->path == PATH_FOURIER ? p->grid[d->grid].parts : 1;
    if (parts == 1)
        return draw_piece(p, &e, w, scratch, out);
    const size_t stride = stamp_stride(d->nx), n = (size_t)d->nx, rows = n / (size_t)parts;
    double *plane = fft_alloc(rows * stride * sizeof *plane);
    int st = plane ? OK : E_NOMEM;
    for (e.row = -1; e.part < parts && st == OK; e.part++) {
        st = draw_piece(p, &e, w, scratch, plane);
        for (size_t k = 0; k < rows && st == OK; k++)
            memcpy(out + ((size_t)e.part + k * (size_t)parts) * n, plane + k * stride, n * sizeof *out);
    }
    fft_free(plane);
    return st;
}

static int by_row(const void *a, const void *b)
{
    const struct entry *p = a, *q = b;
    if (p->row != q->row)
        return p->row < q->row ? -1 : 1;
    if (p->index != q->index)
        return p->index < q->index ? -1 : 1;
    return p->part - q->part;
}

struct worker {
    struct stamp_work *work;
    double *scratch;
};

/* Pieces drawn together, and the space that they share. */
struct batch {
    const struct entry *entry;
    size_t n;
    double **stamp;                /* where each goes */
    double *space;
    size_t size;                   /* doubles */
};

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

/* The part of a piece inside the strip: to the window, or to the image itself when it is tall. */
static void strip_add(struct window *w, int strip, const struct draw *d, const struct piece *q, int tall, const double *stamp)
{
    const long nx = w->im->nx, left = strip_start(w, strip), right = strip_start(w, strip + 1);
    const long x0 = d->x0 < left ? left : d->x0, x1 = d->x0 + (long)d->nx > right ? right : d->x0 + (long)d->nx;
    if (x0 >= x1)
        return;
    if (!tall)
        window_move(w, strip, d->y0 < 0 ? 0 : d->y0);
    for (int k = 0; k < q->rows; k++) {
        const long y = d->y0 + (long)q->first + (long)k * q->step;
        const double *from = stamp + (size_t)k * q->stride + (x0 - d->x0);
        if (y < 0 || y >= w->im->ny)
            continue;
        if (tall)
            add_floats(x1 - x0, from, w->im->pix + (size_t)y * (size_t)nx + x0);
        else
            add_doubles(x1 - x0, from, w->row + (size_t)(y % w->height) * (size_t)nx + x0);
    }
}

/* One step: add the pieces of one batch, strip by strip, and draw those of the next. */
struct job {
    const struct plan *p;
    struct window *w;
    struct worker *worker;
    struct progress *bar;
    const struct batch *add, *draw;
};

static void add_strip(const struct job *j, int strip)
{
    for (size_t i = 0; i < j->add->n; i++) {
        const struct entry *e = &j->add->entry[i];
        const struct piece q = piece_of(j->p, e);
        strip_add(j->w, strip, &j->p->draw[e->index], &q, e->row < 0, j->add->stamp[i]);
    }
}

static int add_and_draw(void *ctx, long begin, long end, int worker)
{
    const struct job *j = ctx;
    const struct worker *w = &j->worker[worker];
    const long strips = j->add->n ? STRIPS : 0;
    long drawn = 0;
    for (long i = begin; i < end; i++) {
        if (i < strips) {
            add_strip(j, (int)i);
            continue;
        }
        const struct entry *e = &j->draw->entry[i - strips];
        int st = draw_piece(j->p, e, w->work, w->scratch, j->draw->stamp[i - strips]);
        if (st)
            return st;
        drawn += e->part == 0;
    }
    if (j->bar && drawn)
        progress_tick(j->bar, drawn);
    return OK;
}

static size_t doubles_of(const struct plan *p, const struct entry *e)
{
    const struct piece q = piece_of(p, e);
    return ((size_t)q.rows * q.stride + 7) / 8 * 8;
}

/* Take as many of n entries as the space holds (at least one). */
static void batch_fill(const struct plan *p, const struct entry *e, size_t n, struct batch *b)
{
    size_t used = 0;
    b->entry = e;
    for (b->n = 0; b->n < n && b->n < BATCH_PIXELS / 16; b->n++) {
        const size_t need = doubles_of(p, &e[b->n]);
        if (b->n > 0 && used + need > b->size)
            break;
        b->stamp[b->n] = b->space + used;
        used += need;
    }
}

/* Rows of the image come into memory, each by one thread: two that meet in a fresh page wait for the kernel, five times as long. */
static int touch_rows(void *ctx, long begin, long end, int worker)
{
    (void)worker;
    const struct image *im = ctx;
    float *from = im->pix + (size_t)begin * (size_t)im->nx, *end_row = im->pix + (size_t)end * (size_t)im->nx;
    for (; from < end_row; from += PAGE_FLOATS)            /* a write at once, that changes nothing: a read first would cost a second fault */
        __atomic_fetch_or((unsigned int *)(void *)from, 0, __ATOMIC_RELAXED);
    return OK;
}

/* All batches in turn; with two of them one is added while the other is drawn, so that no thread waits. */
static int run(struct job *j, size_t n, const struct entry *e, struct batch *b, int batches, struct par_team *team)
{
    const struct batch none = {0};
    int turn = 0, st = OK;
    j->add = &none;
    for (size_t begin = 0; begin < n && st == OK; turn = (turn + 1) % batches) {
        struct batch *next = &b[turn];
        batch_fill(j->p, e + begin, n - begin, next);
        begin += next->n;
        j->draw = next;
        const long items = (long)next->n + (j->add->n ? STRIPS : 0);
        st = par_team_for(team, items, 1 + items / SHARES, add_and_draw, j);
        j->add = next;
        j->draw = &none;
        if (st == OK && (batches == 1 || begin == n)) {
            st = par_team_for(team, STRIPS, 1, add_and_draw, j);
            j->add = &none;
        }
    }
    for (int strip = 0; st == OK && j->w->row && strip < STRIPS; strip++)
        window_move(j->w, strip, j->w->im->ny);
    return st;
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
    size_t largest;        /* doubles of the largest piece */
};

/* Stamps that go to the image itself: those of many rows, of more than a window holds, or of many pixels. */
static int is_tall(const struct plan *p, const struct draw *d)
{
    return d->ny > TALL || (d->ny > 16 && (long)d->ny * p->view.nx > WINDOW_PIXELS) || (size_t)d->nx * (size_t)d->ny > PART_PIXELS;
}

/* Entries in drawing order: pass 0 of tall stamps, pass 1 of the others. */
static void order(const struct plan *p, struct entry *e, struct pass pass[2])
{
    size_t n = 0;
    for (size_t i = 0; i < p->n; i++) {
        const struct draw *d = &p->draw[i];
        if (d->path == PATH_NONE)
            continue;
        const int tall = is_tall(p, d), parts = parts_of(p, d, tall);
        struct pass *q = &pass[!tall];
        for (int k = 0; k < parts; k++) {
            e[n] = (struct entry){tall ? -1 : d->y0 < 0 ? 0 : d->y0, k, (unsigned int)i};
            const size_t need = doubles_of(p, &e[n++]);
            q->largest = need > q->largest ? need : q->largest;
        }
        q->n += (size_t)parts;
        q->tallest = !tall && d->ny > q->tallest ? d->ny : q->tallest;
    }
    qsort(e, n, sizeof *e, by_row);
}

/* Entries of all parts. */
static size_t entries(const struct plan *p)
{
    size_t n = 0;
    for (size_t i = 0; i < p->n; i++)
        if (p->draw[i].path != PATH_NONE)
            n += (size_t)parts_of(p, &p->draw[i], is_tall(p, &p->draw[i]));
    return n;
}

/* One pass has its own memory: that of tall stamps is given back before the window is made. */
static int render_pass(const struct plan *p, const struct pass *q, const struct entry *e, struct image *im, int threads,
                       struct progress *bar)
{
    if (q->n == 0)
        return OK;
    struct window w = {.im = im, .height = q->tallest > im->ny ? (int)im->ny : q->tallest};
    struct worker *workers = calloc((size_t)threads, sizeof *workers);
    size_t size = threads > 1 ? PAIR_PIXELS : BATCH_PIXELS;
    const int batches = threads > 1 && q->largest <= size / 4 ? 2 : 1;
    size = q->largest > size ? q->largest : size;
    double *space = fft_alloc((size + 8) * sizeof *space);
    double **stamp = malloc(2 * (BATCH_PIXELS / 16) * sizeof *stamp);
    if (q->tallest)
        w.row = malloc((size_t)w.height * (size_t)im->nx * sizeof *w.row);
    if (w.row)
        memset(w.row, 0, (size_t)w.height * (size_t)im->nx * sizeof *w.row);    /* here, not by threads that meet in its pages */
    int st = workers && stamp && space && (w.row || !q->tallest) ? workers_new(workers, threads, plan_scratch(p)) : E_NOMEM;
    if (st == OK) {
        const size_t half = size / (size_t)batches / 8 * 8;
        struct batch b[2] = {{.stamp = stamp, .space = space, .size = half},
                             {.stamp = stamp + BATCH_PIXELS / 16, .space = space + half, .size = half}};
        struct job job = {.p = p, .w = &w, .worker = workers, .bar = bar};
        struct par_team *team = par_team_new(threads);
        if (team)
            st = par_team_for(team, im->ny, 1 + im->ny / 16, touch_rows, im);
        if (st == OK)
            st = run(&job, q->n, e, b, batches, team);
        par_team_free(team);
    }
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
    struct entry *e = malloc((entries(p) + 1) * sizeof *e);
    if (!e)
        return E_NOMEM;
    order(p, e, pass);
    int st = render_pass(p, &pass[0], e, im, threads, bar);
    if (st == OK)
        st = render_pass(p, &pass[1], e + pass[0].n, im, threads, bar);
    free(e);
    return st;
}
