/*
 * segment.c - threshold and connected components; see segment.h.
 *
 * The image is worked through in strips of rows, one strip per task.  Each
 * strip filters its own rows (repeating 2 radius rows at its borders), so strips
 * are independent and their order fixes the result for any number of threads.
 */
#include "segment.h"
#include "fft.h"
#include "grow.h"
#include "mend.h"
#include "pages.h"
#include "simd.h"
#include "tiles.h"
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STRIP = TILES_TALL, BLOCK = 64, TOGETHER = 1 << 18, RETURN = 1 << 19 };

/* ---- filtered rows in order ---- */

struct feeder {
    const struct pixels *im;
    const struct background *b;
    const float *rms_map;
    const struct smooth *filter;
    int negative;
    long next;             /* the row that enters the ring next */
    long ring;             /* rows at hand: those a filtered row depends on, one stays behind; with tiles those of a tile */
    float *plain;          /* ring of rows above background, each with zeros at both ends as far as the filter reaches */
    float *across;         /* ring of rows filtered along x; NULL where the filter is not made of two of one axis */
    const float **window;  /* pointers to the rows that the filter takes */
    float *zero;           /* a row of zeros */
    float *band;           /* with tiles: TILES_TALL filtered rows from row `banded` on */
    double *scratch;
    long banded;
    struct mend mend;      /* of images with bad pixels, else empty */
    unsigned char *kind;   /* ring of rows, what the pixels are; NULL without bad ones */
    float *rms;            /* ring of rows of the map; NULL likewise */
};

static void feeder_free(struct feeder *f)
{
    free(f->plain);
    free(f->across);
    free(f->window);
    free(f->zero);
    free(f->band);
    fft_free(f->scratch);
    mend_free(&f->mend);
    free(f->kind);
    free(f->rms);
}

/* Row y0 is filtered next. */
static void feeder_seek(struct feeder *f, long y0)
{
    if (f->band)
        y0 -= y0 % TILES_TALL;
    f->banded = -1;
    f->next = y0 - (long)f->filter->radius;
    if (f->kind)
        mend_seek(&f->mend, f->next > 0 ? f->next : 0);
}

/* Columns of a row in the ring. */
static size_t plain_width(const struct feeder *f)
{
    return (size_t)f->im->nx + 2 * (size_t)f->filter->reach;
}

static int feeder_open(struct feeder *f, long y0)
{
    const enum smooth_way way = f->filter->way;
    const int tiled = way == SMOOTH_TILES, twice = way == SMOOTH_EVEN || way == SMOOTH_PRODUCT;
    f->ring = 2L * f->filter->radius + (tiled ? TILES_TALL + 1 : 2);
    size_t nx = (size_t)f->im->nx, n = (size_t)f->ring;
    f->plain = calloc(n * plain_width(f), sizeof(float));
    f->across = twice ? malloc(n * nx * sizeof(float)) : NULL;
    f->window = malloc(n * sizeof *f->window);
    f->zero = calloc(plain_width(f), sizeof(float));
    f->band = tiled ? malloc(TILES_TALL * nx * sizeof(float)) : NULL;
    f->scratch = tiled ? fft_alloc(tiles_room(f->filter->tiles) * sizeof(double)) : NULL;
    int st = f->plain && (f->across || !twice) && f->window && f->zero && ((f->band && f->scratch) || !tiled) ? OK : E_NOMEM;
    if (!st && f->b->bad) {
        f->kind = malloc(n * nx);
        f->rms = f->rms_map ? malloc(n * nx * sizeof(float)) : NULL;
        st = f->kind && (f->rms || !f->rms_map) ? mend_new(&f->mend, f->im, f->b, f->rms_map) : E_NOMEM;
    }
    if (st) {
        feeder_free(f);
        return st;
    }
    feeder_seek(f, y0);
    return OK;
}

WIDE static void negate(long n, float *v)
{
    for (long i = 0; i < n; i++)
        v[i] = -v[i];
}

static size_t ring_place(const struct feeder *f, long y)
{
    return (size_t)(((y % f->ring) + f->ring) % f->ring);
}

static float *plain_row(const struct feeder *f, long y)
{
    return f->plain + ring_place(f, y) * plain_width(f) + f->filter->reach;
}

static float *across_row(const struct feeder *f, long y)
{
    return f->across + ring_place(f, y) * (size_t)f->im->nx;
}

static unsigned char *kind_row(const struct feeder *f, long y)
{
    return f->kind ? f->kind + ring_place(f, y) * (size_t)f->im->nx : NULL;
}

/* rms of the pixels of row y, which is in the ring; NULL without a map. */
static float *rms_row(const struct feeder *f, long y)
{
    return f->rms ? f->rms + ring_place(f, y) * (size_t)f->im->nx : NULL;
}

/* Row y above background, bad pixels bridged or 0, into the rings. */
static void feeder_take(struct feeder *f, long y)
{
    long nx = f->im->nx;
    if (y < 0 || y >= f->im->ny)
        return;
    float *plain = plain_row(f, y);
    pixels_row(f->im, y, 0, nx, plain);
    background_subtract(f->b, y, 0, nx, 0, plain);
    if (f->kind)
        mend_row(&f->mend, plain, kind_row(f, y), rms_row(f, y));
    if (f->negative)
        negate(nx, plain);
    if (f->across)
        smooth_row(f->filter, plain, nx, across_row(f, y));
}

/* With tiles: the rows around row y, filtered. */
static void feeder_band(struct feeder *f, long y)
{
    const long r = f->filter->radius, first = y - y % TILES_TALL, last = first + TILES_TALL - 1 + r;
    while (f->next <= last)
        feeder_take(f, f->next++);
    for (long i = first - r; i <= last; i++)
        f->window[i - first + r] = i < 0 || i >= f->im->ny ? NULL : plain_row(f, i);
    tiles_filter(f->filter->tiles, f->window, f->im->nx, f->scratch, f->band);
    f->banded = first;
}

/* Filtered row y into out; *plain the same row unfiltered. Rows come in order. */
static void feeder_row(struct feeder *f, long y, float *out, const float **plain)
{
    long nx = f->im->nx, r = f->filter->radius;
    if (f->band) {
        if (f->banded < 0 || y >= f->banded + TILES_TALL)
            feeder_band(f, y);
        *plain = plain_row(f, y);
        memcpy(out, f->band + (size_t)(y - f->banded) * (size_t)nx, (size_t)nx * sizeof(float));
        return;
    }
    while (f->next <= y + r)
        feeder_take(f, f->next++);
    *plain = plain_row(f, y);
    if (f->filter->way == SMOOTH_NOTHING) {
        memcpy(out, *plain, (size_t)nx * sizeof(float));
        return;
    }
    for (long j = -r; j <= r; j++)
        f->window[j + r] = y + j < 0 || y + j >= f->im->ny ? f->zero + f->filter->reach : f->across ? across_row(f, y + j) : plain_row(f, y + j);
    smooth_column(f->filter, f->window, nx, out);
}

int segment_filtered(const struct pixels *im, const struct background *b, const float *rms_map,
                     const struct smooth *filter, int negative, long y0, long n, float *out)
{
    struct feeder f = {.im = im, .b = b, .rms_map = rms_map, .filter = filter, .negative = negative};
    int st = feeder_open(&f, y0);
    if (st)
        return st;
    const float *plain;
    for (long y = y0; y < y0 + n; y++)
        feeder_row(&f, y, out + (size_t)(y - y0) * (size_t)im->nx, &plain);
    feeder_free(&f);
    return OK;
}

/* ---- runs of one strip ---- */

struct stretch {
    uint16_t x0, x1;
};

/* Runs of a strip in reading order with their pixels. */
struct stretches {
    size_t nrun, cap_run, cap_good, npix, cap_pair;
    struct stretch *run;
    uint16_t *good;        /* of every run the pixels that are not bad; NULL: all are good */
    float *pair;           /* of every pixel its filtered and its unfiltered value */
    uint32_t row[STRIP + 1];       /* the first run of each row */
};

struct strip {
    struct stretches s;
    uint32_t *place;       /* of every run that stays the place of its pixels among those of the image, else NOWHERE */
};

static const uint32_t NOWHERE = UINT32_MAX;

struct search {
    const struct pixels *im;
    const struct background *b;
    const struct smooth *filter;
    const struct segment_params *p;
    struct strip *strip;
    struct scratch *scratch;   /* one per worker */
};

struct scratch {
    struct feeder feeder;
    float *smooth;             /* two rows */
    unsigned char *above;      /* a row and zeros up to a multiple of BLOCK */
    uint64_t *bits;            /* three rows and one of ones: a bit a pixel above the threshold, a word before and behind */
    struct stretches found;    /* in the strip in hand */
    uint32_t *parent, *count;  /* of its runs */
    size_t cap_parent, cap_count;
};

static void strip_free(struct strip *s)
{
    free(s->s.run);
    free(s->s.good);
    free(s->s.pair);
    free(s->place);
    *s = (struct strip){0};
}

/* above[i] = 1 where v exceeds the threshold, else 0. */
WIDE static void mark_above(const float *restrict v, float threshold, long n, unsigned char *restrict above)
{
    for (long i = 0; i < n; i++)
        above[i] = v[i] > threshold;
}

/* Take back the bad pixels. */
WIDE static void unmark_bad(const unsigned char *restrict kind, long n, unsigned char *restrict above)
{
    for (long i = 0; i < n; i++)
        above[i] = kind[i] == PIXEL_BAD ? 0 : above[i];
}

/* v = 0 where it does not exceed k * rms; bad pixels have infinite rms. */
WIDE static void cut_by_map(const float *restrict rms, float k, long n, float *restrict v)
{
    for (long i = 0; i < n; i++)
        v[i] = v[i] > k * rms[i] ? v[i] : 0;
}

/* What is known of the pixels of a row. */
struct scanned {
    long y;
    const float *smooth, *plain;
    const unsigned char *kind;         /* NULL: all are good */
};

static int add_run(struct stretches *s, const struct scanned *row, long x0, long x1)
{
    size_t n = (size_t)(x1 - x0), good = n;
    int st = grow(&s->run, &s->cap_run, s->nrun + 1, sizeof *s->run);
    if (!st && row->kind)
        st = grow(&s->good, &s->cap_good, s->nrun + 1, sizeof *s->good);
    if (!st)
        st = grow(&s->pair, &s->cap_pair, 2 * (s->npix + n), sizeof *s->pair);
    if (st)
        return st;
    for (long x = x0; row->kind && x < x1; x++)
        good -= row->kind[x] != PIXEL_GOOD;
    if (row->kind)
        s->good[s->nrun] = (uint16_t)good;
    s->run[s->nrun++] = (struct stretch){(uint16_t)x0, (uint16_t)x1};
    float *to = s->pair + 2 * s->npix;
    const float *smooth = row->smooth + x0, *plain = row->plain + x0;
    for (size_t i = 0; i < n; i++) {
        to[2 * i] = smooth[i] <= FLT_MAX ? smooth[i] : FLT_MAX;    /* sums of two values above 1.7e38 overflow */
        to[2 * i + 1] = plain[i];
    }
    s->npix += n;
    return OK;
}

/* Bit i of the result is byte i of the BLOCK bytes 0 or 1. */
static uint64_t bits_of(const unsigned char *byte)
{
    uint64_t w[BLOCK / 8], any = 0, bits = 0;
    memcpy(w, byte, sizeof w);
    for (int k = 0; k < BLOCK / 8; k++)
        any |= w[k];
    for (int k = 0; any && k < BLOCK / 8; k++)     /* the product brings byte i to bit 56 + i */
        bits |= (w[k] * 0x0102040810204080u >> 56) << 8 * k;
    return bits;
}

/* Words of a row of bits. */
static size_t words_of(const struct search *s)
{
    return ((size_t)s->im->nx + BLOCK - 1) / BLOCK + 2;
}

/* The pixels of a word beside and between those of its row. */
static uint64_t beside(const uint64_t *w)
{
    return w[0] << 1 | w[-1] >> 63 | w[0] >> 1 | w[1] << 63;
}

/* Three rows of bits; one of ones instead of a row that another strip has. */
struct rows {
    const uint64_t *up, *here, *down;
    int alone;                         /* keep pixels that touch no other */
};

/* The runs of a row. */
static int scan_row(struct stretches *s, const struct scanned *row, long nx, struct rows r)
{
    long start = -1;
    s->row[row->y % STRIP] = (uint32_t)s->nrun;
    for (long x = 0, k = 1; x < nx; x += BLOCK, k++) {
        uint64_t bits = r.here[k];
        if (bits && !r.alone)
            bits &= beside(r.here + k) | r.up[k] | beside(r.up + k) | r.down[k] | beside(r.down + k);
        for (uint64_t change = bits ^ (bits << 1 | (start >= 0)); change; change &= change - 1) {
            long i = x + __builtin_ctzll(change);
            if (start < 0) {
                start = i;
                continue;
            }
            int st = add_run(s, row, start, i);
            if (st)
                return st;
            start = -1;
        }
    }
    return start >= 0 ? add_run(s, row, start, nx) : OK;
}

/* ---- components of one strip ---- */

static uint32_t find_root(uint32_t *parent, uint32_t i)
{
    while (parent[i] != i) {
        parent[i] = parent[parent[i]];     /* path halving */
        i = parent[i];
    }
    return i;
}

/* A row's runs and the number of the first. */
struct row {
    const struct stretch *run;
    size_t n;
    uint32_t number;
};

/* Join runs of neighbouring rows that touch; the smaller number becomes the root. */
static void join_rows(struct row up, struct row here, uint32_t *parent)
{
    for (size_t a = 0, b = 0; a < up.n && b < here.n;) {
        if (up.run[a].x1 < here.run[b].x0) {
            a++;
        } else if (here.run[b].x1 < up.run[a].x0) {
            b++;
        } else {
            uint32_t u = find_root(parent, up.number + (uint32_t)a), v = find_root(parent, here.number + (uint32_t)b);
            if (u < v)
                parent[v] = u;
            else
                parent[u] = v;
            if (up.run[a].x1 < here.run[b].x1)
                a++;
            else
                b++;
        }
    }
}

/* The runs of a row of a strip, 0..STRIP-1; number: that of the strip's first run. */
static struct row row_of(const struct stretches *s, int y, uint32_t number)
{
    return (struct row){s->run + s->row[y], s->row[y + 1] - s->row[y], number + s->row[y]};
}

static size_t good_of(const struct stretches *s, size_t i)
{
    return s->good ? s->good[i] : (size_t)(s->run[i].x1 - s->run[i].x0);
}

/* parent[i] = the first run of run i's component. */
static void join_strip(const struct stretches *s, uint32_t *parent)
{
    for (size_t i = 0; i < s->nrun; i++)
        parent[i] = (uint32_t)i;
    for (int y = 1; y < STRIP; y++)
        join_rows(row_of(s, y - 1, 0), row_of(s, y, 0), parent);
    for (size_t i = 0; i < s->nrun; i++)   /* parents come first and know their roots */
        parent[i] = parent[parent[i]];
}

/* Make room for what stays; the runs and pixels are counted. */
static int strip_new(struct strip *to, const struct stretches *s, const uint32_t *parent, const uint32_t *count, long min_area)
{
    size_t runs = 0, pixels = 0;
    for (size_t i = 0; i < s->nrun; i++)
        if (count[parent[i]] >= (size_t)min_area) {
            runs++;
            pixels += (size_t)(s->run[i].x1 - s->run[i].x0);
        }
    to->s.run = malloc((runs + 1) * sizeof *to->s.run);
    to->s.good = s->good ? malloc((runs + 1) * sizeof *to->s.good) : NULL;
    to->s.pair = malloc((2 * pixels + 1) * sizeof *to->s.pair);
    return to->s.run && (to->s.good || !s->good) && to->s.pair ? OK : E_NOMEM;
}

/*
 * Find the components of what was found and leave out those of fewer than min_area good pixels that no row before `first` or
 * behind `last` of the strip can go on with: most runs of an image are noise.  What stays keeps its order.
 */
static int prune_strip(struct scratch *w, int first, int last, long min_area, struct strip *to)
{
    const uint32_t OPEN = 1u << 31;        /* a strip has fewer pixels */
    const struct stretches *s = &w->found;
    int st = grow(&w->count, &w->cap_count, s->nrun + 1, sizeof *w->count);
    if (!st)
        st = grow(&w->parent, &w->cap_parent, s->nrun + 1, sizeof *w->parent);
    if (st)
        return st;
    uint32_t *parent = w->parent, *count = w->count;
    join_strip(s, parent);
    memset(count, 0, s->nrun * sizeof *count);
    for (int y = 0; y < STRIP; y++)
        for (size_t i = s->row[y]; i < s->row[y + 1]; i++)
            count[parent[i]] = (count[parent[i]] + (uint32_t)good_of(s, i)) | (y < first || y > last ? OPEN : 0);
    st = strip_new(to, s, parent, count, min_area);
    const float *from = s->pair;
    for (int y = 0; y < STRIP && !st; y++) {
        to->s.row[y] = (uint32_t)to->s.nrun;
        for (size_t i = s->row[y]; i < s->row[y + 1]; i++) {
            const size_t many = (size_t)(s->run[i].x1 - s->run[i].x0);
            if (count[parent[i]] >= (size_t)min_area) {
                memcpy(to->s.pair + 2 * to->s.npix, from, 2 * many * sizeof *from);
                to->s.npix += many;
                if (s->good)
                    to->s.good[to->s.nrun] = s->good[i];
                to->s.run[to->s.nrun++] = s->run[i];
            }
            from += 2 * many;
        }
    }
    to->s.row[STRIP] = (uint32_t)to->s.nrun;
    return st;
}

/* ---- all strips ---- */

/* Filter row y of a strip; its bits above the threshold. */
static void mark_row(const struct search *s, struct scratch *w, struct scanned *row, uint64_t *bits)
{
    const struct segment_params *p = s->p;
    long nx = s->im->nx, y = row->y;
    float *smooth = w->smooth + (y % 2) * nx;
    feeder_row(&w->feeder, y, smooth, &row->plain);
    const float *rms = rms_row(&w->feeder, y);
    row->smooth = smooth;
    row->kind = kind_row(&w->feeder, y);
    if (p->rms_map)
        cut_by_map(rms ? rms : p->rms_map + (size_t)y * (size_t)nx, (float)p->threshold, nx, smooth);
    mark_above(smooth, p->rms_map ? 0 : (float)(p->threshold * p->noise), nx, w->above);
    if (row->kind)
        unmark_bad(row->kind, nx, w->above);
    bits[0] = bits[words_of(s) - 1] = 0;
    for (long x = 0; x < nx; x += BLOCK)
        bits[1 + x / BLOCK] = bits_of(w->above + x);
}

/*
 * One strip with a feeder that is open.  A row waits for the next one: most pixels above the threshold are noise and touch no
 * other, and with a minimum area above 1 they are left out before they become runs.
 */
static int search_strip(const struct search *s, long i, struct scratch *w)
{
    long nx = s->im->nx, y0 = i * STRIP, y1 = y0 + STRIP < s->im->ny ? y0 + STRIP : s->im->ny, min_area = s->p->min_area;
    size_t words = words_of(s);
    uint64_t *ones = w->bits + 3 * words, *last = w->bits + (y0 + 2) % 3 * (long)words;     /* of the row before y0 */
    struct scanned row = {.y = y0}, next = {0};
    int st = OK;
    memset(last, y0 > 0 ? 0xff : 0, words * sizeof *last);
    w->found.nrun = w->found.npix = 0;
    feeder_seek(&w->feeder, y0);
    mark_row(s, w, &row, w->bits + y0 % 3 * (long)words);
    for (; row.y < y1 && !st; row = next) {
        struct rows r = {w->bits + (row.y + 2) % 3 * (long)words, w->bits + row.y % 3 * (long)words, ones, min_area < 2};
        next = (struct scanned){.y = row.y + 1};
        if (next.y < y1) {
            uint64_t *bits = w->bits + next.y % 3 * (long)words;
            mark_row(s, w, &next, bits);
            r.down = bits;
        }
        st = scan_row(&w->found, &row, nx, r);
    }
    for (long y = y1 - y0; y <= STRIP; y++)
        w->found.row[y] = (uint32_t)w->found.nrun;
    if (!st)
        st = prune_strip(w, y0 > 0 ? 1 : 0, y1 < s->im->ny ? STRIP - 2 : STRIP, min_area, &s->strip[i]);
    return st;
}

static int search_strips(void *ctx, long begin, long end, int worker)
{
    const struct search *s = ctx;
    struct scratch *w = &s->scratch[worker];
    int st = OK;
    if (!w->above) {
        w->feeder = (struct feeder){.im = s->im, .b = s->b, .rms_map = s->p->rms_map, .filter = s->filter,
                                    .negative = s->p->negative};
        st = feeder_open(&w->feeder, 0);
        if (st)
            w->feeder = (struct feeder){0};
        w->smooth = malloc(2 * (size_t)s->im->nx * sizeof(float));
        w->bits = calloc(4 * words_of(s), sizeof *w->bits);
        w->above = calloc((size_t)s->im->nx + BLOCK, 1);
        if (!w->smooth || !w->above || !w->bits)
            st = E_NOMEM;
        else
            memset(w->bits + 3 * words_of(s), 0xff, words_of(s) * sizeof *w->bits);
    }
    for (long i = begin; i < end && !st; i++)
        st = search_strip(s, i, w);
    return st;
}

/* Search with scratch for every worker. */
static int search_all(struct search *s, long n)
{
    size_t workers = (size_t)par_team_size(s->p->team);
    s->scratch = calloc(workers, sizeof *s->scratch);
    int st = s->scratch ? par_team_for(s->p->team, n, 1, search_strips, s) : E_NOMEM;
    for (size_t i = 0; i < workers && s->scratch; i++) {
        feeder_free(&s->scratch[i].feeder);
        free(s->scratch[i].smooth);
        free(s->scratch[i].above);
        free(s->scratch[i].bits);
        free(s->scratch[i].found.run);
        free(s->scratch[i].found.good);
        free(s->scratch[i].found.pair);
        free(s->scratch[i].parent);
        free(s->scratch[i].count);
    }
    free(s->scratch);
    return st;
}

/* ---- components of the image: runs are numbered through all strips; there are fewer than 2^15 of them in a row, 2^31 in all ---- */

struct joining {
    const struct strip *strip;
    const size_t *number;      /* of each strip's first run */
    uint32_t *parent;
};

/* Components inside strips. */
static int join_inside(void *ctx, long begin, long end, int worker)
{
    const struct joining *t = ctx;
    (void)worker;
    for (long k = begin; k < end; k++) {
        uint32_t *parent = t->parent + t->number[k];
        join_strip(&t->strip[k].s, parent);
        for (size_t i = 0; i < t->strip[k].s.nrun; i++)
            parent[i] += (uint32_t)t->number[k];
    }
    return OK;
}

/* parent[i] = the first run of run i's component. */
static int join_strips(const struct strip *strip, long n, const size_t *number, uint32_t *parent, struct par_team *team)
{
    struct joining t = {strip, number, parent};
    int st = par_team_for(team, n, 1, join_inside, &t);
    for (long k = 1; k < n && !st; k++)
        join_rows(row_of(&strip[k - 1].s, STRIP - 1, (uint32_t)number[k - 1]), row_of(&strip[k].s, 0, (uint32_t)number[k]), parent);
    for (size_t i = 0; i < number[n] && !st; i++)
        parent[i] = parent[parent[i]];
    return st;
}

/* What `parent` holds of a first run, once all are joined: this bit and a count, then the number of its component. */
static const uint32_t ROOT = 1u << 31;

/* The number of run i's component, 0: left out. */
static uint32_t component_of(const uint32_t *parent, size_t i)
{
    return (parent[i] & ROOT ? parent[i] : parent[parent[i]]) & ~ROOT;
}

/* Count the good pixels of each component at its first run, as far as min_area; how many components have as many. */
static size_t count_good(const struct strip *strip, long n, uint32_t *parent, long min_area)
{
    size_t i = 0, ncomp = 0;
    for (long k = 0; k < n; k++)
        for (size_t j = 0; j < strip[k].s.nrun; j++, i++) {
            const size_t root = parent[i] == i ? i : parent[i];
            if (root == i)
                parent[i] = ROOT;
            const uint32_t before = parent[root] & ~ROOT, now = before + (uint32_t)good_of(&strip[k].s, j);
            parent[root] = ROOT | (now < (uint32_t)min_area ? now : (uint32_t)min_area);
            ncomp += before < (uint32_t)min_area && now >= (uint32_t)min_area;
        }
    return ncomp;
}

/*
 * Number the components of at least min_area good pixels from 1, in order of their first runs, into `parent` at these, 0
 * for the others; count the runs of number c into first[c + 1], their pixels into at[c + 1].
 */
static int count_components(struct segments *s, const struct strip *strip, long n, uint32_t *parent, long min_area)
{
    const size_t ncomp = count_good(strip, n, parent, min_area);
    s->first = calloc(ncomp + 2, sizeof *s->first);
    s->at = calloc(ncomp + 2, sizeof *s->at);
    if (!s->first || !s->at)
        return E_NOMEM;
    size_t i = 0;
    for (long k = 0; k < n; k++)
        for (size_t j = 0; j < strip[k].s.nrun; j++, i++) {
            const struct stretch *r = &strip[k].s.run[j];
            if (parent[i] & ROOT)
                parent[i] = ROOT | ((parent[i] & ~ROOT) >= (uint32_t)min_area ? (uint32_t)++s->ncomponent : 0);
            uint32_t c = component_of(parent, i);
            if (c == 0)
                continue;
            s->first[c + 1]++;
            s->nrun++;
            s->at[c + 1] += (size_t)(r->x1 - r->x0);
            s->npix += (size_t)(r->x1 - r->x0);
        }
    for (size_t c = 0; c < s->ncomponent; c++) {       /* now number c ends at first[c + 1] and at[c + 1] */
        s->first[c + 2] += s->first[c + 1];
        s->at[c + 2] += s->at[c + 1];
    }
    return OK;
}

/* Every run of strip k that stays gets its place, and one for its pixels, from the last on; number: of the strip's first run. */
static int place_runs(struct segments *s, struct strip *strip, long k, const uint32_t *parent, size_t number)
{
    strip->place = malloc((strip->s.nrun + 1) * sizeof *strip->place);
    if (!strip->place)
        return E_NOMEM;
    for (long y = STRIP - 1; y >= 0; y--)
        for (size_t j = strip->s.row[y + 1]; j-- > strip->s.row[y];) {
            const struct stretch *r = &strip->s.run[j];
            uint32_t c = component_of(parent, number + j);
            strip->place[j] = NOWHERE;
            if (!c)
                continue;
            s->run[--s->first[c + 1]] = (struct run){(uint16_t)(k * STRIP + y), r->x0, r->x1};
            s->at[c + 1] -= (size_t)(r->x1 - r->x0);
            strip->place[j] = (uint32_t)s->at[c + 1];
        }
    return OK;
}

struct moving {
    struct segments *s;
    struct strip *strip;
};

/* The pixels of strips to their components; the strips are freed. */
static int move_pixels(void *ctx, long begin, long end, int worker)
{
    const struct moving *m = ctx;
    (void)worker;
    for (long k = begin; k < end; k++) {
        struct strip *strip = &m->strip[k];
        const float *pair = strip->s.pair;
        for (size_t j = 0; j < strip->s.nrun; j++) {
            size_t many = (size_t)(strip->s.run[j].x1 - strip->s.run[j].x0);
            size_t to = strip->place[j];
            for (size_t x = 0; x < many && to != NOWHERE; x++) {
                m->s->smooth[to + x] = pair[2 * x];
                m->s->value[to + x] = pair[2 * x + 1];
            }
            pair += 2 * many;
        }
        size_t freed = 2 * strip->s.npix * sizeof *pair;
        strip_free(strip);
        if (freed > RETURN)            /* a strip full of objects: what goes here is written anew there */
            pages_return();
    }
    return OK;
}

/* Runs and pixels to their components, a block of runs at a time from the last on: what these took goes before the next are placed. */
static int move_strips(struct segments *s, struct strip *strip, long n, const size_t *number, uint32_t **parent, struct par_team *team)
{
    int st = OK;
    for (long end = n, k; end > 0 && !st; end = k) {
        for (k = end; k > 0 && (k == end || number[end] - number[k - 1] <= TOGETHER) && !st; k--)
            st = place_runs(s, &strip[k - 1], k - 1, *parent, number[k - 1]);
        struct moving m = {s, strip + k};
        if (!st)
            st = par_team_for(team, end - k, 1, move_pixels, &m);
        uint32_t *less = realloc(*parent, (number[k] + 1) * sizeof **parent);
        *parent = less ? less : *parent;
    }
    for (size_t c = 0; c <= s->ncomponent && !st; c++) {       /* number c + 1 begins at first[c + 2] now */
        s->first[c] = c < s->ncomponent ? s->first[c + 2] : s->nrun;
        s->at[c] = c < s->ncomponent ? s->at[c + 2] : s->npix;
    }
    return st;
}

/* The runs and pixels that stay, grouped by component; strips are freed on the way. */
static int group_runs(struct segments *s, struct strip *strip, long n, long min_area, struct par_team *team)
{
    size_t *number = malloc(((size_t)n + 1) * sizeof *number);
    if (!number)
        return E_NOMEM;
    number[0] = 0;
    for (long k = 0; k < n; k++)
        number[k + 1] = number[k] + strip[k].s.nrun;
    uint32_t *parent = malloc((number[n] + 1) * sizeof *parent);
    int st = parent ? join_strips(strip, n, number, parent, team) : E_NOMEM;
    if (!st)
        st = count_components(s, strip, n, parent, min_area);
    if (!st) {
        s->run = malloc((s->nrun + 1) * sizeof *s->run);
        s->smooth = malloc((s->npix + 1) * sizeof *s->smooth);
        s->value = malloc((s->npix + 1) * sizeof *s->value);
        st = s->run && s->smooth && s->value ? OK : E_NOMEM;
    }
    if (!st)
        st = move_strips(s, strip, n, number, &parent, team);
    free(parent);
    if (number[n] > RETURN)
        pages_return();
    free(number);
    return st;
}

int segment_find(struct segments *s, const struct pixels *im, const struct background *b,
                 const struct smooth *filter, const struct segment_params *p)
{
    if (!(p->threshold > 0) || p->min_area < 1 || (!p->rms_map && !(p->noise > 0)))
        return E_RANGE;
    long n = (im->ny + STRIP - 1) / STRIP;
    struct segments out = {0};
    struct search search = {im, b, filter, p, calloc((size_t)n, sizeof(struct strip)), NULL};
    if (!search.strip)
        return E_NOMEM;
    int st = search_all(&search, n);
    if (!st)
        st = group_runs(&out, search.strip, n, p->min_area, p->team);
    for (long i = 0; i < n; i++)
        strip_free(&search.strip[i]);
    free(search.strip);
    if (st)
        segment_free(&out);
    else
        *s = out;
    return st;
}

void segment_free(struct segments *s)
{
    free(s->run);
    free(s->smooth);
    free(s->value);
    free(s->first);
    free(s->at);
    *s = (struct segments){0};
}
