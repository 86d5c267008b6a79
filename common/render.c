/* render.c - sums the stamps of a plan into an image. */
#include "render.h"
#include "fft.h"
#include "par.h"
#include "simd.h"
#include "tall.h"
#include <limits.h>
#include <stdlib.h>
#include <string.h>

#define HELD 4                 /* chunks that a thread holds, drawn and not yet added, at most */
#define CHUNK_PIXELS 16384     /* doubles of a chunk of stamps: with HELD of them 512 KiB, half a core's cache */
#define SPACE_PIXELS 1310720   /* doubles that all threads may hold together, and a chunk more each: 10 MiB */
#define WINDOW_PIXELS 1048576  /* doubles of the window, at most */
#define PART_PIXELS 131072     /* pixels, about, of one part of a stamp without a PSF */
#define BROAD_PIXELS 1048576   /* and of an object larger than stamps: each part costs its frequencies again */
#define PAGE_FLOATS 1024       /* in the smallest page of memory */
#define BLOCK 32               /* rows of the image in which stamps begin that are drawn from left to right */
#define STRIPS 8               /* of columns of the image, in each of which one thread adds */
#define TALL 200               /* rows; taller stamps without a PSF, always few, are added to the image itself */

/*
 * Objects to draw: tall stamps first, then blocks of rows, from left to right in each: what a stamp adds to is then still in the
 * caches of who added the last one.
 */
struct entry {
    int row;                       /* first of the block in which its own first row is; -1: tall */
    int place;                     /* first column; of a tall one the part */
    unsigned int index;
};

/* Rows of a stamp that are made together, as doubles, or as floats behind HEAD doubles, whose first is added to all of them. */
struct piece {
    int first, rows, single;
};

enum { HEAD = 8 };                 /* a line of the cache */

static int part_rows(const struct draw *d)
{
    const int pixels = d->path == PATH_BROAD ? BROAD_PIXELS : PART_PIXELS;
    return pixels / d->nx < 1 ? 1 : pixels / d->nx;
}

/* Large stamps come in parts, so that memory does not grow with them. */
static int parts_of(const struct draw *d, int tall)
{
    return tall ? (d->ny + part_rows(d) - 1) / part_rows(d) : 1;
}

static struct piece piece_of(const struct plan *p, const struct entry *e)
{
    const struct draw *d = &p->draw[e->index];
    if (e->row >= 0)
        return (struct piece){0, d->ny, plan_single(p, e->index)};
    const int rows = part_rows(d), first = e->place * rows;
    return (struct piece){first, d->ny - first < rows ? d->ny - first : rows, 0};
}

static int draw_piece(const struct plan *p, const struct entry *e, const struct piece *q, struct stamp_work *w, double *scratch, double *out)
{
    const size_t i = e->index;
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
        return stamp_closed(w, &shape, v->pixel, box, d->nx, q->rows, x, y - q->first, s->flux, out);
    case PATH_MAPPED:
        return stamp_mapped(w, &shape, v->pixel, box, d->nx, q->rows, x, y - q->first, s->flux, out);
    case PATH_FOURIER:
        if (q->single)
            return stamp_single(&p->grid[d->grid], w, &shape, x, y, s->flux, d->kcut, (float *)(out + HEAD), out);
        return stamp_fourier(&p->grid[d->grid], w, &shape, x, y, s->flux, d->kcut, out);
    case PATH_BROAD:
        return stamp_broad(&p->grid[d->grid], w, &shape, v->pixel, d->nx, q->rows, x, y - q->first, s->flux, d->kcut, out);
    case PATH_NONE:
        break;
    }
    return E_RANGE;
}

/* A Fourier stamp that comes in interlaced parts. */
static int stamp_of_parts(const struct plan *p, size_t i, struct stamp_work *w, double *scratch, double *out)
{
    const struct draw *d = &p->draw[i];
    const struct emitter *s = &p->emitter[i];
    const struct stamp_grid *g = &p->grid[d->grid];
    const size_t stride = stamp_stride(d->nx), n = (size_t)d->nx, parts = (size_t)g->parts, rows = n / parts;
    double *plane = fft_alloc(rows * stride * sizeof *plane);
    struct shape shape;
    int st = plane ? plan_shape(p, i, scratch, &shape) : E_NOMEM;
    for (size_t part = 0; part < parts && st == OK; part++) {
        st = stamp_fourier_part(g, w, &shape, s->x - d->x0, s->y - d->y0, s->flux, d->kcut, (int)part, plane);
        for (size_t k = 0; k < rows && st == OK; k++)
            memcpy(out + (part + k * parts) * n, plane + k * stride, n * sizeof *out);
    }
    fft_free(plane);
    return st;
}

int scene_stamp(const struct plan *p, size_t i, struct stamp_work *w, double *scratch, double *out)
{
    const struct draw *d = &p->draw[i];
    if (d->path == PATH_FOURIER && p->grid[d->grid].parts > 1)
        return stamp_of_parts(p, i, w, scratch, out);
    return draw_piece(p, &(struct entry){0, 0, (unsigned int)i}, &(struct piece){0, d->ny, 0}, w, scratch, out);
}

static int by_row(const void *a, const void *b)
{
    const struct entry *p = a, *q = b;
    if (p->row != q->row)
        return p->row < q->row ? -1 : 1;
    if (p->row >= 0 && p->place != q->place)
        return p->place < q->place ? -1 : 1;
    if (p->index != q->index)
        return p->index < q->index ? -1 : 1;
    return p->place - q->place;
}

struct worker {
    struct stamp_work *work;
    double *scratch;
    double *space;                 /* of the stamps of all chunks held */
    int held;                      /* chunks drawn and not yet added */
    long chunk[HELD];              /* their numbers, the oldest first */
    double *stamp[HELD];           /* and stamps */
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

WIDE static void add_singles(long n, const float *restrict from, double rest, double *restrict to)
{
    for (long i = 0; i < n; i++)
        to[i] += (double)from[i] + rest;
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

/* What the window still holds. */
static int end_strips(void *ctx, long begin, long end, int worker)
{
    struct window *w = ctx;
    (void)worker;
    for (long strip = begin; strip < end; strip++)
        window_move(w, (int)strip, w->im->ny);
    return OK;
}

/* The part of a piece inside the strip: to the window, or to the image itself when it is tall. */
static void strip_add(struct window *w, int strip, const struct draw *d, const struct piece *q, int row, const double *stamp)
{
    const long nx = w->im->nx, left = strip_start(w, strip), right = strip_start(w, strip + 1);
    const long x0 = d->x0 < left ? left : d->x0, x1 = d->x0 + (long)d->nx > right ? right : d->x0 + (long)d->nx;
    if (x0 >= x1)
        return;
    if (row >= 0)
        window_move(w, strip, row);
    for (int k = 0; k < q->rows; k++) {
        const long y = d->y0 + (long)q->first + k;
        const size_t from = (size_t)k * (size_t)d->nx + (size_t)(x0 - d->x0);
        if (y < 0 || y >= w->im->ny)
            continue;
        if (row < 0)
            add_floats(x1 - x0, stamp + from, w->im->pix + (size_t)y * (size_t)nx + x0);
        else if (q->single)
            add_singles(x1 - x0, (const float *)(stamp + HEAD) + from, stamp[0], w->row + (size_t)(y % w->height) * (size_t)nx + x0);
        else
            add_doubles(x1 - x0, stamp + from, w->row + (size_t)(y % w->height) * (size_t)nx + x0);
    }
}

static size_t doubles_of(const struct plan *p, const struct entry *e)
{
    const struct piece q = piece_of(p, e);
    const size_t numbers = (size_t)q.rows * (size_t)p->draw[e->index].nx;
    return ((q.single ? HEAD + (numbers + 1) / 2 : numbers) + 7) / 8 * 8;
}

/* Entries that are drawn together, and the strips that they reach. */
struct chunk {
    unsigned int first, end;
    unsigned char left, right;
};

/*
 * A thread draws a chunk and adds it to one strip after the other, to each in its turn.  The sums of
 * a strip are so formed in the order of the chunks, whoever forms them.  Nobody waits for a turn who can draw
 * one more chunk instead.
 */
struct job {
    const struct plan *p;
    const struct entry *entry;
    const struct chunk *chunk;
    long chunks;
    struct window *w;
    struct worker *worker;
    int hold;                      /* chunks that each may hold, 1..HELD */
    struct progress *bar;
    struct par_turns *turns;       /* of the chunks in each strip */
};

/* The first chunk from `from` on that reaches the strip. */
static long next_in_strip(const struct job *j, int strip, long from)
{
    while (from < j->chunks && (strip < j->chunk[from].left || strip > j->chunk[from].right))
        from++;
    return from;
}

static int chunk_draw(const struct job *j, struct worker *w, long chunk)
{
    const struct chunk *c = &j->chunk[chunk];
    double *stamp = w->stamp[w->held];
    long drawn = 0;
    for (const struct entry *e = j->entry + c->first; e < j->entry + c->end; stamp += doubles_of(j->p, e++)) {
        const struct piece q = piece_of(j->p, e);
        int st = draw_piece(j->p, e, &q, w->work, w->scratch, stamp);
        if (st)
            return st;
        drawn += e->row >= 0 || e->place == 0;
    }
    w->chunk[w->held++] = chunk;
    if (j->bar && drawn)
        progress_tick(j->bar, drawn);
    return OK;
}

/* Add the oldest chunk held. */
static int chunk_add(const struct job *j, struct worker *w)
{
    const long chunk = w->chunk[0];
    const struct chunk *c = &j->chunk[chunk];
    double *space = w->stamp[0];
    for (int strip = c->left; strip <= c->right; strip++) {
        int st = par_turn_wait(j->turns, strip, chunk);
        if (st)
            return st;
        const double *stamp = space;
        for (const struct entry *e = j->entry + c->first; e < j->entry + c->end; stamp += doubles_of(j->p, e++)) {
            const struct piece q = piece_of(j->p, e);
            strip_add(j->w, strip, &j->p->draw[e->index], &q, e->row, stamp);
        }
        par_turn_give(j->turns, strip, next_in_strip(j, strip, chunk + 1));
    }
    w->held--;
    for (int k = 0; k < w->held; k++) {
        w->chunk[k] = w->chunk[k + 1];
        w->stamp[k] = w->stamp[k + 1];
    }
    w->stamp[w->held] = space;
    return OK;
}

static int draw_and_add(void *ctx, long begin, long end, int worker)
{
    const struct job *j = ctx;
    struct worker *w = &j->worker[begin];
    (void)end;
    (void)worker;
    for (;;) {
        const long chunk = par_turn_take(j->turns);
        int st = chunk < 0 ? OK : chunk_draw(j, w, chunk);
        while (st == OK && w->held && (chunk < 0 || w->held == j->hold || par_turn_ready(j->turns, j->chunk[w->chunk[0]].right, w->chunk[0])))
            st = chunk_add(j, w);
        if (st)
            par_turns_fail(j->turns, st);
        if (st || chunk < 0)
            return st;
    }
}

/* Of so many halves of the image, from left to right, in which entry e begins. */
static int half_of(const struct plan *p, const struct entry *e)
{
    return e->row >= 0 && e->place > p->view.nx / 2;
}

static int strip_of(long nx, long x)
{
    int strip = 0;
    while (strip < STRIPS - 1 && x >= nx * (strip + 1) / STRIPS)
        strip++;
    return strip;
}

/* Cut n entries into chunks of at most CHUNK_PIXELS (or of one entry), each in one block and half. Returns their number; c may be NULL. */
static long cut_chunks(const struct plan *p, const struct entry *e, size_t n, struct chunk *c)
{
    long chunks = 0;
    size_t used = 0;
    for (size_t i = 0; i < n; i++) {
        const size_t need = doubles_of(p, &e[i]);
        if (i == 0 || used + need > CHUNK_PIXELS || e[i].row != e[i - 1].row || half_of(p, &e[i]) != half_of(p, &e[i - 1])) {
            if (c)
                c[chunks] = (struct chunk){(unsigned int)i, (unsigned int)i, STRIPS - 1, 0};
            chunks++;
            used = 0;
        }
        used += need;
        if (!c)
            continue;
        const struct draw *d = &p->draw[e[i].index];
        const int left = strip_of(p->view.nx, d->x0), right = strip_of(p->view.nx, d->x0 + (long)d->nx - 1);
        struct chunk *last = &c[chunks - 1];
        last->end++;
        last->left = left < last->left ? (unsigned char)left : last->left;
        last->right = right > last->right ? (unsigned char)right : last->right;
    }
    return chunks;
}

/* The end of the block of rows that begins with chunk i. */
static long block_end(const struct entry *e, long n, const struct chunk *c, long i)
{
    const int row = e[c[i].first].row;
    while (i < n && e[c[i].first].row == row)
        i++;
    return i;
}

/* Chunks of the two halves of one block in turn, so that two threads seldom meet. */
static void deal_block(const struct plan *p, const struct entry *e, long n, const struct chunk *from, struct chunk *to)
{
    long half = 0;
    while (half < n && !half_of(p, &e[from[half].first]))
        half++;
    for (long a = 0, b = half; a < half || b < n;) {
        if (a < half)
            *to++ = from[a++];
        if (b < n)
            *to++ = from[b++];
    }
}

/* All chunks, in the order in which they are drawn. NULL: no memory. */
static struct chunk *make_chunks(const struct plan *p, const struct entry *e, size_t n, long *chunks)
{
    *chunks = cut_chunks(p, e, n, NULL);
    struct chunk *c = malloc((size_t)*chunks * sizeof *c), *block;
    if (!c)
        return NULL;
    (void)cut_chunks(p, e, n, c);
    long most = 0;
    for (long i = 0, end; i < *chunks; i = end) {
        end = block_end(e, *chunks, c, i);
        most = end - i > most ? end - i : most;
    }
    if (!(block = malloc((size_t)most * sizeof *block))) {
        free(c);
        return NULL;
    }
    for (long i = 0, end; i < *chunks; i = end) {
        end = block_end(e, *chunks, c, i);
        memcpy(block, c + i, (size_t)(end - i) * sizeof *block);
        deal_block(p, e, end - i, block, c + i);
    }
    free(block);
    return c;
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

static int workers_new(struct worker *w, int threads, size_t scratch, size_t space, int hold)
{
    int st = OK;
    for (int t = 0; t < threads && st == OK; t++) {
        st = stamp_work_new(&w[t].work);
        w[t].scratch = malloc((3 * scratch + 1) * sizeof *w[t].scratch);
        w[t].space = fft_alloc((size_t)hold * space * sizeof *w[t].space);
        if (!w[t].scratch || !w[t].space)
            st = E_NOMEM;
        for (int k = 0; k < hold && w[t].space; k++)
            w[t].stamp[k] = w[t].space + (size_t)k * space;
    }
    return st;
}

static void workers_free(struct worker *w, int threads)
{
    for (int t = 0; w && t < threads; t++) {
        stamp_work_free(w[t].work);
        free(w[t].scratch);
        fft_free(w[t].space);
    }
    free(w);
}

/* What the entries of one pass need. */
enum { PASSES = 2 };

struct pass {
    size_t n;
    int tallest;           /* rows of the window; 0: none */
    size_t largest;        /* doubles of the largest piece */
};

/* Stamps that go to the image itself: those of many rows, of more than a window holds, or of many pixels; without a PSF. */
static int is_tall(const struct plan *p, const struct draw *d)
{
    return d->ny > TALL || (d->ny > 16 && (long)d->ny * p->view.nx > WINDOW_PIXELS) || (size_t)d->nx * (size_t)d->ny > WINDOW_PIXELS;
}

/* Drawn here, not in tall.c. */
static int is_entry(const struct plan *p, const struct draw *d)
{
    return d->path != PATH_NONE && !tall_is(p, d);
}

/* Entries in drawing order: pass 0 of tall stamps, pass 1 of the rest. */
static void order(const struct plan *p, struct entry *e, struct pass pass[PASSES])
{
    size_t n = 0;
    for (size_t i = 0; i < p->n; i++) {
        const struct draw *d = &p->draw[i];
        if (!is_entry(p, d))
            continue;
        const int tall = is_tall(p, d), parts = parts_of(d, tall);
        struct pass *q = &pass[!tall];
        for (int k = 0; k < parts; k++, n++) {
            e[n] = (struct entry){tall ? -1 : d->y0 < 0 ? 0 : d->y0 / BLOCK * BLOCK, tall ? k : d->x0, (unsigned int)i};
            const size_t need = doubles_of(p, &e[n]);
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
        if (is_entry(p, &p->draw[i]))
            n += (size_t)parts_of(&p->draw[i], is_tall(p, &p->draw[i]));
    return n;
}

/* All chunks of one pass on the threads. */
static int run(struct job *j, int threads, struct par_team *team)
{
    j->turns = par_turns_new(STRIPS, j->chunks);
    if (!j->turns)
        return E_NOMEM;
    for (int strip = 0; strip < STRIPS; strip++)
        par_turn_give(j->turns, strip, next_in_strip(j, strip, 0));
    int st = par_team_for(team, threads, 1, draw_and_add, j);
    par_turns_free(j->turns);
    return st;
}

/* The rows of a pass: its own, or those that stay, which hold the whole image and never move. */
static int window_new(struct window *w, struct image *im, int tallest, double *sums)
{
    *w = (struct window){.im = im, .height = tallest > im->ny - BLOCK || sums ? (int)im->ny : tallest + BLOCK, .row = sums};
    for (int strip = 0; strip < STRIPS && sums; strip++)
        w->next[strip] = im->ny;
    if (tallest == 0 || sums)
        return OK;
    const size_t bytes = (size_t)w->height * (size_t)im->nx * sizeof *w->row;
    w->row = malloc(bytes);
    if (!w->row)
        return E_NOMEM;
    memset(w->row, 0, bytes);              /* here, not by threads that meet in its pages */
    return OK;
}

/* One pass has its own memory: that of tall stamps is given back before the window is made. */
static int render_pass(const struct plan *p, const struct pass *q, const struct entry *e, struct image *im, double *sums,
                       struct par_team *team, struct progress *bar)
{
    if (q->n == 0)
        return OK;
    int threads = par_team_size(team);
    struct window w;
    const size_t space = (q->largest > CHUNK_PIXELS ? q->largest : CHUNK_PIXELS) + 8, most = (SPACE_PIXELS + (size_t)threads * CHUNK_PIXELS) / space;
    int hold = most / (size_t)threads > HELD ? HELD : (int)(most / (size_t)threads);
    if (hold < 1) {                                /* few large stamps at a time */
        threads = most < 1 ? 1 : (int)most;
        hold = 1;
    }
    long chunks;
    struct chunk *chunk = make_chunks(p, e, q->n, &chunks);
    struct worker *workers = calloc((size_t)threads, sizeof *workers);
    int st = window_new(&w, im, q->tallest, sums);
    if (st == OK)
        st = chunk && workers ? workers_new(workers, threads, plan_scratch(p), space, hold) : E_NOMEM;
    if (st == OK) {
        struct job job = {.p = p, .entry = e, .chunk = chunk, .chunks = chunks, .w = &w, .worker = workers, .hold = hold, .bar = bar};
        st = run(&job, threads, team);
    }
    if (st == OK && w.row)
        st = par_team_for(team, STRIPS, 1, end_strips, &w);
    workers_free(workers, threads);
    free(chunk);
    if (!sums)
        free(w.row);
    return st;
}

double *scene_sums(const struct image *im)
{
    return image_count(im) <= WINDOW_PIXELS ? calloc(image_count(im), sizeof(double)) : NULL;
}

void scene_add_sums(const double *sums, struct image *im)
{
    add_floats((long)image_count(im), sums, im->pix);
}

int scene_render(const struct plan *p, struct image *im, int threads, struct progress *bar)
{
    return scene_render_part(p, im, NULL, threads, bar);
}

int scene_render_part(const struct plan *p, struct image *im, double *sums, int threads, struct progress *bar)
{
    if (im->nx != p->view.nx || im->ny != p->view.ny || threads < 1 || threads > 256 || p->n > UINT_MAX)
        return E_RANGE;
    struct pass pass[PASSES] = {{0}};
    struct entry *e = malloc((entries(p) + 1) * sizeof *e), *from = e;
    struct par_team *team = par_team_new(threads);
    int st = e ? OK : E_NOMEM;
    if (st == OK && team)
        st = par_team_for(team, im->ny, 1 + im->ny / 16, touch_rows, im);
    if (st == OK)
        st = tall_render(p, im, team, bar);
    if (st == OK)
        order(p, e, pass);
    for (int k = 0; k < PASSES && st == OK; from += pass[k++].n)
        st = render_pass(p, &pass[k], from, im, sums, team, bar);
    par_team_free(team);
    free(e);
    return st;
}
