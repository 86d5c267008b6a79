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

enum { STRIP = TILES_TALL, BLOCK = 64, RETURN = 1 << 19 };

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
    uint16_t y, x0, x1;
    uint16_t good;         /* pixels that are not bad */
};

/* Runs in reading order with their pixels. */
struct stretches {
    size_t nrun, cap_run, npix, cap_pair;
    struct stretch *run;
    float *pair;           /* of every pixel its filtered and its unfiltered value */
};

struct strip {
    struct stretches s;
    uint32_t *parent;      /* of every run: the first one of its component inside the strip */
    const uint32_t *place; /* of every run that stays the place of its pixels among those of the image, else NOWHERE; not owned */
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
    free(s->s.pair);
    free(s->parent);
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
    if (!st)
        st = grow(&s->pair, &s->cap_pair, 2 * (s->npix + n), sizeof *s->pair);
    if (st)
        return st;
    for (long x = x0; row->kind && x < x1; x++)
        good -= row->kind[x] != PIXEL_GOOD;
    s->run[s->nrun++] = (struct stretch){(uint16_t)row->y, (uint16_t)x0, (uint16_t)x1, (uint16_t)good};
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

/* parent[i] = the first run of run i's component. */
static void join_strip(const struct stretches *s, uint32_t *parent)
{
    struct row up = {0}, here = {0};
    for (size_t i = 0; i < s->nrun; i++)
        parent[i] = (uint32_t)i;
    for (size_t i = 0; i < s->nrun; i += here.n) {
        here.run = s->run + i;
        for (here.n = 1; i + here.n < s->nrun && here.run[here.n].y == here.run->y;)
            here.n++;
        if (up.n && up.run->y + 1 == here.run->y)
            join_rows(up, here, parent);
        up = here;
        here.number += (uint32_t)here.n;
    }
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
    to->s.pair = malloc((2 * pixels + 1) * sizeof *to->s.pair);
    to->parent = malloc((runs + 1) * sizeof *to->parent);
    return to->s.run && to->s.pair && to->parent ? OK : E_NOMEM;
}

/*
 * Find the components of what was found and leave out those of fewer than min_area good pixels that no row before `first` or
 * behind `last` can go on with: most runs of an image are noise.  What stays keeps its order.
 */
static int prune_strip(struct scratch *w, long first, long last, long min_area, struct strip *to)
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
    for (size_t i = 0; i < s->nrun; i++) {
        const struct stretch *r = &s->run[i];
        count[parent[i]] = (count[parent[i]] + r->good) | (r->y < first || r->y > last ? OPEN : 0);
    }
    st = strip_new(to, s, parent, count, min_area);
    const float *from = s->pair;
    for (size_t i = 0; i < s->nrun && !st; i++) {
        const struct stretch r = s->run[i];
        const size_t many = (size_t)(r.x1 - r.x0);
        if (parent[i] == i)                /* from here on: 1 + the place of the first run, 0 left out */
            count[i] = count[i] >= (size_t)min_area ? (uint32_t)to->s.nrun + 1 : 0;
        if (count[parent[i]]) {
            memcpy(to->s.pair + 2 * to->s.npix, from, 2 * many * sizeof *from);
            to->s.npix += many;
            to->s.run[to->s.nrun] = r;
            to->parent[to->s.nrun++] = count[parent[i]] - 1;
        }
        from += 2 * many;
    }
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
    if (!st)
        st = prune_strip(w, y0 > 0 ? y0 + 1 : 0, y1 < s->im->ny ? y1 - 2 : y1, min_area, &s->strip[i]);
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
        free(s->scratch[i].found.pair);
        free(s->scratch[i].parent);
        free(s->scratch[i].count);
    }
    free(s->scratch);
    return st;
}

/* ---- components of the image: runs are numbered through all strips; there are fewer than 2^15 of them in a row, 2^31 in all ---- */

/* The runs of a strip's first row, or of its last one; number: that of the strip's first run. */
static struct row border_row(const struct stretches *s, int last, uint32_t number)
{
    size_t n = 0;
    if (s->nrun == 0)
        return (struct row){0};
    const struct stretch *end = s->run + (last ? s->nrun - 1 : 0);
    while (n < s->nrun && (last ? end - n : end + n)->y == end->y)
        n++;
    return last ? (struct row){s->run + s->nrun - n, n, number + (uint32_t)(s->nrun - n)} : (struct row){s->run, n, number};
}

/* parent[i] = the first run of run i's component. */
static void join_strips(struct strip *strip, long n, uint32_t *parent, size_t nrun)
{
    struct row up = {0};
    uint32_t number = 0;
    for (long k = 0; k < n; k++) {
        for (size_t i = 0; i < strip[k].s.nrun; i++)
            parent[number + i] = number + strip[k].parent[i];
        free(strip[k].parent);
        strip[k].parent = NULL;
        struct row here = border_row(&strip[k].s, 0, number);
        if (up.n && here.n && up.run->y + 1 == here.run->y)
            join_rows(up, here, parent);
        up = border_row(&strip[k].s, 1, number);
        number += (uint32_t)strip[k].s.nrun;
    }
    for (size_t i = 0; i < nrun; i++)
        parent[i] = parent[parent[i]];
    if (nrun > RETURN)
        pages_return();
}

/*
 * Number the components of at least min_area good pixels from 1, in order of their first runs, into number[] at these, 0
 * for the others; count the runs of number c into first[c + 1], their pixels into at[c + 1].
 */
static int count_components(struct segments *s, const struct strip *strip, long n, const uint32_t *parent,
                            uint32_t *number, size_t nrun, long min_area)
{
    size_t i = 0, ncomp = 0;
    for (long k = 0; k < n; k++)
        for (size_t j = 0; j < strip[k].s.nrun; j++, i++)
            number[parent[i]] += strip[k].s.run[j].good;
    for (i = 0; i < nrun; i++)
        ncomp += number[i] >= (size_t)min_area;
    s->first = calloc(ncomp + 2, sizeof *s->first);
    s->at = calloc(ncomp + 2, sizeof *s->at);
    if (!s->first || !s->at)
        return E_NOMEM;
    i = 0;
    for (long k = 0; k < n; k++)
        for (size_t j = 0; j < strip[k].s.nrun; j++, i++) {
            const struct stretch *r = &strip[k].s.run[j];
            if (parent[i] == i)
                number[i] = number[i] >= (size_t)min_area ? (uint32_t)++s->ncomponent : 0;
            uint32_t c = number[parent[i]];
            if (c == 0)
                continue;
            s->first[c + 1]++;
            s->nrun++;
            s->at[c + 1] += (size_t)(r->x1 - r->x0);
            s->npix += (size_t)(r->x1 - r->x0);
        }
    return OK;
}

/* Every run that stays gets its place, and one for its pixels, which is put where its parent was: nobody asks for that again. */
static void place_runs(struct segments *s, struct strip *strip, long n, uint32_t *parent, const uint32_t *number)
{
    size_t i = 0;
    for (size_t c = 0; c < s->ncomponent; c++) {       /* now number c begins at first[c] and at[c] */
        s->first[c + 2] += s->first[c + 1];
        s->at[c + 2] += s->at[c + 1];
    }
    for (long k = 0; k < n; k++) {
        strip[k].place = parent + i;
        for (size_t j = 0; j < strip[k].s.nrun; j++, i++) {
            const struct stretch *r = &strip[k].s.run[j];
            uint32_t c = number[parent[i]];
            parent[i] = NOWHERE;
            if (!c)
                continue;
            s->run[s->first[c]++] = (struct run){r->y, r->x0, r->x1};
            parent[i] = (uint32_t)s->at[c];
            s->at[c] += (size_t)(r->x1 - r->x0);
        }
    }
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

/* The runs and pixels that stay, grouped by component; strips are freed on the way. */
static int group_runs(struct segments *s, struct strip *strip, long n, long min_area, struct par_team *team)
{
    size_t nrun = 0;
    for (long k = 0; k < n; k++)
        nrun += strip[k].s.nrun;
    uint32_t *parent = malloc((nrun + 1) * sizeof *parent), *number = calloc(nrun + 1, sizeof *number);
    int st = parent && number ? OK : E_NOMEM;
    if (!st) {
        join_strips(strip, n, parent, nrun);
        st = count_components(s, strip, n, parent, number, nrun, min_area);
    }
    if (!st) {
        s->run = malloc((s->nrun + 1) * sizeof *s->run);
        s->smooth = malloc((s->npix + 1) * sizeof *s->smooth);
        s->value = malloc((s->npix + 1) * sizeof *s->value);
        st = s->run && s->smooth && s->value ? OK : E_NOMEM;
    }
    if (!st) {
        struct moving m = {s, strip};
        place_runs(s, strip, n, parent, number);
        free(number);
        number = NULL;
        st = par_team_for(team, n, 1, move_pixels, &m);
    }
    free(parent);
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
