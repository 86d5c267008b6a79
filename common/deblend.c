/*
 * deblend.c - multi-level deblending by one downward flood; see deblend.h.
 *
 * A "peak" is a tree of pixels that grew from one local maximum; union-find over
 * peaks tells which pixels are connected so far.  After each level every
 * connected set that changed gets a "branch": its flux, pixels and the objects
 * found inside.  When a set holds several branches of the level above, the
 * contrast rule decides which become objects.  Pixel lists are chained so that
 * the pixels of a branch stay contiguous when sets are joined.
 */
#include "deblend.h"
#include "grow.h"
#include "peaks.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct pixel {
    float v;               /* filtered value */
    uint16_t x, y;
    int32_t up, down;      /* first neighbour in the row above and below */
    int32_t next;          /* chain of a connected set */
    int32_t set;           /* peak it grew from; later its object */
    uint16_t level;
    uint8_t core;          /* 1: belongs to a branch, not shared */
    uint8_t ups, downs, left, right;   /* how many neighbours there are */
};

struct peak {
    double flux;
    int32_t parent, head, tail, first_branch, last_branch, n;
    int32_t seen;          /* last level at which the set was looked at */
};

struct branch {
    double flux;
    int32_t n, head;       /* pixels: n of the chain from head */
    int32_t first_part, last_part;
    int32_t next;
};

struct part {              /* an object in the making: its core */
    int32_t head, n, next;
    double log_peak, x, y, cxx, cxy, cyy;
};

struct deblend_work {
    struct pixel *pixel;
    int32_t *order, *queue;
    float *level, *sorted;
    struct peak *peak;
    struct branch *branch;
    struct part *part;
    struct peaks peaks;
    size_t cap_pixel, cap_order, cap_queue, cap_level, cap_sorted, cap_peak, cap_branch, cap_part;
    int32_t npixel, npeak, nbranch, npart;
};

int deblend_work_new(struct deblend_work **w)
{
    *w = calloc(1, sizeof **w);
    return *w ? OK : E_NOMEM;
}

void deblend_work_free(struct deblend_work *w)
{
    if (!w)
        return;
    free(w->pixel);
    free(w->order);
    free(w->queue);
    free(w->level);
    free(w->sorted);
    peaks_free(&w->peaks);
    free(w->peak);
    free(w->branch);
    free(w->part);
    free(w);
}

/* ---- pixels of a component and their neighbours ---- */

static int load(struct deblend_work *w, const struct segments *s, size_t c)
{
    size_t n = s->at[c + 1] - s->at[c];
    if (n > INT32_MAX - 8)
        return E_RANGE;
    int st = grow(&w->pixel, &w->cap_pixel, n, sizeof *w->pixel);
    if (st)
        return st;
    int32_t k = 0;
    const float *v = s->smooth + s->at[c];
    for (size_t i = s->first[c]; i < s->first[c + 1]; i++)
        for (int32_t x = s->run[i].x0; x < s->run[i].x1; x++)
            w->pixel[k++] = (struct pixel){.v = *v++, .x = (uint16_t)x, .y = s->run[i].y, .next = -1, .set = -1};
    w->npixel = k;
    return OK;
}

/* The neighbours of the pixels from .. end-1 of a row in the row other .. stop-1 beside it. */
static void link_row(struct pixel *p, int32_t from, int32_t end, int32_t other, int32_t stop, int below)
{
    int32_t j = other;
    for (int32_t k = from; k < end; k++) {
        uint8_t n = 0;
        while (j < stop && p[j].x + 1 < p[k].x)
            j++;
        while (j + n < stop && p[j + n].x <= p[k].x + 1)
            n++;
        if (below) {
            p[k].down = j;
            p[k].downs = n;
        } else {
            p[k].up = j;
            p[k].ups = n;
        }
    }
}

static void link_rows(struct deblend_work *w)
{
    struct pixel *p = w->pixel;
    int32_t n = w->npixel, above = 0;
    for (int32_t i = 0, end; i < n; above = i, i = end) {
        for (end = i; end < n && p[end].y == p[i].y; end++) {
            p[end].left = end > i && p[end - 1].x + 1 == p[end].x;
            p[end].right = end + 1 < n && p[end + 1].y == p[i].y && p[end + 1].x == p[end].x + 1;
        }
        if (above < i && p[above].y + 1 == p[i].y) {
            link_row(p, i, end, above, i, 0);
            link_row(p, above, i, i, end, 1);
        }
    }
}

/* Indices of the up to 8 neighbours of pixel i inside the component. */
static int neighbours(const struct deblend_work *w, int32_t i, int32_t out[8])
{
    const struct pixel *p = &w->pixel[i];
    int n = 0;
    for (int k = 0; k < p->ups; k++)
        out[n++] = p->up + k;
    if (p->left)
        out[n++] = i - 1;
    if (p->right)
        out[n++] = i + 1;
    for (int k = 0; k < p->downs; k++)
        out[n++] = p->down + k;
    return n;
}

/* ---- the flood ---- */

/* log2 of v > 0 within 0.01. */
static double rough_log2(float v)
{
    uint32_t bits;
    memcpy(&bits, &v, sizeof bits);
    double part = (double)(bits & 0x7fffff) * 0x1p-23;
    return (double)(bits >> 23) + part * (1.3465 - 0.3465 * part);
}

/* Levels, the level of every pixel, and pixels ordered from the highest level down. */
static int sort_levels(struct deblend_work *w, double threshold, long levels)
{
    size_t n = (size_t)w->npixel, m = (size_t)levels;
    int st = grow(&w->level, &w->cap_level, m + 1, sizeof *w->level);
    if (!st)
        st = grow(&w->order, &w->cap_order, n + m + 1, sizeof *w->order);
    if (st)
        return st;
    double peak = 0;
    for (size_t i = 0; i < n; i++)
        peak = (double)w->pixel[i].v > peak ? (double)w->pixel[i].v : peak;
    const double span = peak > threshold ? log2(peak / threshold) : 0, step = exp2(span / (double)m);
    double per_level = span > 0 ? (double)m / span : 0, low = rough_log2((float)threshold), at = threshold;
    for (size_t k = 0; k < m; k++, at *= step)
        w->level[k] = (float)at;
    int32_t *start = w->order + n;         /* counts, then first index of each level */
    memset(start, 0, (m + 1) * sizeof *start);
    for (size_t i = 0; i < n; i++) {
        double t = (rough_log2(w->pixel[i].v) - low) * per_level;
        size_t a = t > 0 ? t < (double)(m - 1) ? (size_t)t : m - 1 : 0;
        while (a > 0 && !(w->pixel[i].v > w->level[a]))
            a--;
        while (a + 1 < m && w->pixel[i].v > w->level[a + 1])
            a++;
        w->pixel[i].level = (uint16_t)a;
        start[m - 1 - a + 1]++;
    }
    for (size_t k = 0; k < m; k++)
        start[k + 1] += start[k];
    for (size_t i = 0; i < n; i++)
        w->order[start[m - 1 - w->pixel[i].level]++] = (int32_t)i;
    return OK;                             /* start[k] is now the end of level m-1-k */
}

static int32_t set_of(struct deblend_work *w, int32_t a)
{
    struct peak *p = w->peak;
    while (p[a].parent != a) {
        p[a].parent = p[p[a].parent].parent;
        a = p[a].parent;
    }
    return a;
}

static int32_t join_sets(struct deblend_work *w, int32_t a, int32_t b)
{
    struct peak *p = w->peak;
    if (p[b].n > p[a].n) {
        int32_t t = a;
        a = b;
        b = t;
    }
    w->pixel[p[a].tail].next = p[b].head;
    p[a].tail = p[b].tail;
    p[a].n += p[b].n;
    p[a].flux += p[b].flux;
    p[b].parent = a;
    if (p[b].first_branch >= 0) {
        if (p[a].first_branch >= 0)
            w->branch[p[a].last_branch].next = p[b].first_branch;
        else
            p[a].first_branch = p[b].first_branch;
        p[a].last_branch = p[b].last_branch;
    }
    return a;
}

/* Add pixel i to the sets it touches, joining them, or start a new peak. */
static int add_pixel(struct deblend_work *w, int32_t i)
{
    int32_t near[8], set = -1;
    int n = neighbours(w, i, near);
    for (int k = 0; k < n; k++) {
        int32_t other = w->pixel[near[k]].set;
        if (other < 0 || other == set)
            continue;
        other = set_of(w, other);
        set = set < 0 ? other : other == set ? set : join_sets(w, set, other);
    }
    double v = (double)w->pixel[i].v;
    if (set < 0) {
        int st = grow(&w->peak, &w->cap_peak, (size_t)w->npeak + 1, sizeof *w->peak);
        if (st)
            return st;
        set = w->npeak++;
        w->peak[set] = (struct peak){v, set, i, i, -1, -1, 1, -1};
    } else {
        struct peak *p = &w->peak[set];
        w->pixel[p->tail].next = i;
        p->tail = i;
        p->n++;
        p->flux += v;
    }
    w->pixel[i].set = set;
    return OK;
}

/* The core of a branch becomes an object. */
static int make_part(struct deblend_work *w, struct branch *b)
{
    int st = grow(&w->part, &w->cap_part, (size_t)w->npart + 1, sizeof *w->part);
    if (st)
        return st;
    w->part[w->npart] = (struct part){.head = b->head, .n = b->n, .next = -1};
    b->first_part = b->last_part = w->npart++;
    return OK;
}

/*
 * The branches of one set at level `above` become one branch of this level.
 * least: flux above the level that a branch needs.
 */
static int close_set(struct deblend_work *w, int32_t set, double above, double least, long min_area)
{
    struct peak *p = &w->peak[set];
    struct branch all = {p->flux, p->n, p->head, -1, -1, -1};
    int strong = 0;
    for (int32_t i = p->first_branch; i >= 0; i = w->branch[i].next) {
        const struct branch *b = &w->branch[i];
        strong += b->n >= min_area && b->flux - above * b->n > least;
    }
    for (int32_t i = p->first_branch; i >= 0; i = w->branch[i].next) {
        struct branch *b = &w->branch[i];
        if (strong > 1 && b->first_part < 0 && b->n >= min_area && b->flux - above * b->n > least) {
            int st = make_part(w, b);
            if (st)
                return st;
        }
        if (b->first_part < 0)
            continue;
        if (all.first_part < 0)
            all.first_part = b->first_part;
        else
            w->part[all.last_part].next = b->first_part;
        all.last_part = b->last_part;
    }
    int32_t at = p->first_branch;          /* reuse the first branch's place */
    if (at < 0) {
        int st = grow(&w->branch, &w->cap_branch, (size_t)w->nbranch + 1, sizeof *w->branch);
        if (st)
            return st;
        at = w->nbranch++;
    }
    w->branch[at] = all;
    p->first_branch = p->last_branch = at;
    return OK;
}

/* Returns the first part of the whole component in *first (-1: it is one object). */
static int flood(struct deblend_work *w, const struct deblend_params *p, double threshold, int32_t *first)
{
    int st = sort_levels(w, threshold, p->levels);
    double total = 0;
    w->npeak = w->nbranch = w->npart = 0;
    for (int32_t i = 0; i < w->npixel; i++)
        total += (double)w->pixel[i].v;
    const int32_t *end = w->order + w->npixel;
    for (long k = 0; k < p->levels && !st; k++) {
        long level = p->levels - 1 - k;
        int32_t from = k > 0 ? end[k - 1] : 0;
        double above = level + 1 < p->levels ? (double)w->level[level + 1] : INFINITY;
        for (int32_t i = from; i < end[k] && !st; i++)
            st = add_pixel(w, w->order[i]);
        for (int32_t i = from, last = -1; i < end[k] && !st; i++) {
            int32_t set = w->pixel[w->order[i]].set;
            if (set == last)
                continue;
            last = set;
            set = set_of(w, set);
            if (w->peak[set].seen == (int32_t)k)
                continue;
            w->peak[set].seen = (int32_t)k;
            st = close_set(w, set, above, p->contrast * total, p->branch_area);
        }
    }
    if (st)
        return st;
    *first = w->branch[w->peak[set_of(w, w->pixel[0].set)].first_branch].first_part;
    return OK;
}

/* ---- pixels to objects ---- */

/* Gaussian of the part's core: second moments corrected for the cut at the faintest pixel. */
static void fit_part(const struct deblend_work *w, struct part *t)
{
    double s = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0, low = INFINITY, high = 0;
    int32_t x0 = w->pixel[t->head].x, y0 = w->pixel[t->head].y, i = t->head;
    for (int32_t k = 0; k < t->n; k++, i = w->pixel[i].next) {
        double v = (double)w->pixel[i].v, x = w->pixel[i].x - x0, y = w->pixel[i].y - y0;
        s += v;
        sx += v * x;
        sy += v * y;
        sxx += v * x * x;
        sxy += v * x * y;
        syy += v * y * y;
        low = v < low ? v : low;
        high = v > high ? v : high;
    }
    double mx = sx / s, my = sy / s;
    double u = log(high / low), cut = u > 1e-3 ? 1 - u / expm1(u) : 0.5 * u;
    cut = cut > 0.1 ? cut : 0.1;
    double xx = (sxx / s - mx * mx) / cut + 1 / 12.0, yy = (syy / s - my * my) / cut + 1 / 12.0;
    double xy = (sxy / s - mx * my) / cut, det = xx * yy - xy * xy;
    if (!(det > 1 / 144.0)) {
        xy = 0;
        det = xx * yy;
    }
    t->x = mx + x0;
    t->y = my + y0;
    t->log_peak = log(high);
    t->cxx = yy / det;
    t->cyy = xx / det;
    t->cxy = -xy / det;
}

static double log_profile(const struct part *t, const struct pixel *p)
{
    double dx = p->x - t->x, dy = p->y - t->y;
    return t->log_peak - 0.5 * (t->cxx * dx * dx + t->cyy * dy * dy + 2 * t->cxy * dx * dy);
}

enum { FREE = -1, QUEUED = -2, SHARERS = 64 };

/* The object of a free pixel: the brightest of its labelled neighbours' objects, FREE if none. */
static int32_t best_part(const struct deblend_work *w, int32_t i)
{
    int32_t near[8], best = FREE;
    double most = 0;
    int n = neighbours(w, i, near);
    for (int k = 0; k < n; k++) {
        int32_t set = w->pixel[near[k]].set;
        if (set < 0 || set == best)
            continue;
        double here = log_profile(&w->part[set], &w->pixel[i]);
        if (best < 0 || here > most) {
            best = set;
            most = here;
        }
    }
    return best;
}

/* Label every pixel with its part; parts are numbered 0.. in the order of the chain from `first`. */
static int share_pixels(struct deblend_work *w, int32_t first, long levels)
{
    int st = grow(&w->queue, &w->cap_queue, (size_t)w->npixel, sizeof *w->queue);
    if (st)
        return st;
    for (int32_t i = 0; i < w->npixel; i++)
        w->pixel[i].set = FREE;
    for (int32_t t = first; t >= 0; t = w->part[t].next) {
        fit_part(w, &w->part[t]);
        int32_t i = w->part[t].head;
        for (int32_t k = 0; k < w->part[t].n; k++, i = w->pixel[i].next) {
            w->pixel[i].set = t;
            w->pixel[i].core = 1;
        }
    }
    const int32_t *end = w->order + w->npixel;
    for (long k = 0; k < levels; k++) {
        int32_t head = 0, tail = 0;
        for (int32_t i = k > 0 ? end[k - 1] : 0; i < end[k]; i++)
            if (w->pixel[w->order[i]].set == FREE && best_part(w, w->order[i]) >= 0) {
                w->pixel[w->order[i]].set = QUEUED;
                w->queue[tail++] = w->order[i];
            }
        while (head < tail) {
            int32_t i = w->queue[head++], near[8];
            w->pixel[i].set = best_part(w, i);
            int n = neighbours(w, i, near);
            for (int j = 0; j < n; j++) {
                struct pixel *q = &w->pixel[near[j]];
                if (q->set == FREE && q->level >= levels - 1 - k) {
                    q->set = QUEUED;
                    w->queue[tail++] = near[j];
                }
            }
        }
    }
    return OK;
}

/* ---- sums ---- */

static void add_moments(struct blob *b, int32_t x, int32_t y, double f)
{
    double dx = x - b->x0, dy = y - b->y0;
    b->s += f;
    b->sx += f * dx;
    b->sy += f * dy;
    b->sxx += f * dx * dx;
    b->sxy += f * dx * dy;
    b->syy += f * dy * dy;
}

static void add_pixel_to(struct blob *b, int32_t x, int32_t y, double f, double v)
{
    b->n++;
    b->above += v > b->threshold;
    b->flux += v;
    if (v > b->peak) {
        b->peak = v;
        b->xpeak = x;
        b->ypeak = y;
    }
    b->smooth_peak = f > b->smooth_peak ? f : b->smooth_peak;
    b->xmin = x < b->xmin ? x : b->xmin;
    b->xmax = x > b->xmax ? x : b->xmax;
    b->ymin = y < b->ymin ? y : b->ymin;
    b->ymax = y > b->ymax ? y : b->ymax;
}

void blob_absorb(struct blob *a, const struct blob *b)
{
    a->n += b->n;
    a->above += b->above;
    a->flux += b->flux;
    if (b->peak > a->peak) {
        a->peak = b->peak;
        a->xpeak = b->xpeak;
        a->ypeak = b->ypeak;
    }
    a->xmin = b->xmin < a->xmin ? b->xmin : a->xmin;
    a->xmax = b->xmax > a->xmax ? b->xmax : a->xmax;
    a->ymin = b->ymin < a->ymin ? b->ymin : a->ymin;
    a->ymax = b->ymax > a->ymax ? b->ymax : a->ymax;
}

void blob_moments(const struct blob *b, double *x, double *y, double *xx, double *xy, double *yy)
{
    double mx = b->sx / b->s, my = b->sy / b->s, dx = 0, dy = 0;
    if (b->flags & DETECT_BLENDED) {
        dx = b->core_x - mx;
        dy = b->core_y - my;
    }
    *x = mx + dx + b->x0;
    *y = my + dy + b->y0;
    *xx = b->sxx / b->s - mx * mx + dx * dx;
    *yy = b->syy / b->s - my * my + dy * dy;
    *xy = b->sxy / b->s - mx * my + dx * dy;
    if (!(*xx * *yy - *xy * *xy >= 1 / 144.0)) {
        *xx = (*xx > 0 ? *xx : 0) + 1 / 12.0;
        *yy = (*yy > 0 ? *yy : 0) + 1 / 12.0;
        if (!(*xx * *yy > *xy * *xy))
            *xy = 0;
    }
}

void ellipse_axes(double xx, double xy, double yy, double *a, double *b, double *theta)
{
    double half = 0.5 * (xx + yy), d = 0.5 * (xx - yy), r = hypot(d, xy);
    *a = sqrt(half + r);
    *b = sqrt(half - r > 0 ? half - r : 0);
    if (!theta)
        return;
    *theta = r > 0 ? 0.5 * atan2(xy, d) * 180 / acos(-1) : 0;
    if (!(*theta > -90))
        *theta = 90;
}

enum { FEW = 16 };

/* The `room` largest values so far, from the largest; n of them. */
struct largest {
    long room, n;
    float v[FEW];
};

static void largest_add(struct largest *t, float v)
{
    if (t->n == t->room && !(v > t->v[t->room - 1]))
        return;
    long j = t->n < t->room ? t->n++ : t->room - 1;
    for (; j > 0 && t->v[j - 1] < v; j--)
        t->v[j] = t->v[j - 1];
    t->v[j] = v;
}

/* The k-th largest of the n values (k from 1); v is reordered. */
static double kth_largest(float *v, long n, long k)
{
    if (k <= FEW) {
        struct largest top = {.room = k};
        for (long i = 0; i < n; i++)
            largest_add(&top, v[i]);
        return (double)top.v[k - 1];
    }
    long lo = 0, hi = n - 1, at = k - 1;
    while (lo < hi) {
        float p = v[lo + (hi - lo) / 2];
        long i = lo, j = hi;
        while (i <= j) {
            while (v[i] > p)
                i++;
            while (v[j] < p)
                j--;
            if (i <= j) {
                float t = v[i];
                v[i++] = v[j];
                v[j--] = t;
            }
        }
        if (at <= j)
            hi = j;
        else if (at >= i)
            lo = i;
        else
            break;
    }
    return (double)v[at];
}

/* margin of every object of the component: blobs from `base` on, pixels labelled with them. */
static int find_margins(struct deblend_work *w, struct blob_list *out, size_t base, long min_area)
{
    int st = grow(&w->sorted, &w->cap_sorted, (size_t)w->npixel, sizeof *w->sorted);
    if (!st)
        st = grow(&w->queue, &w->cap_queue, out->n - base + 1, sizeof *w->queue);
    if (st)
        return st;
    int32_t at = 0;
    for (size_t b = base; b < out->n; b++) {
        w->queue[b - base] = at;
        at += (int32_t)out->blob[b].n;
    }
    for (int32_t i = 0; i < w->npixel; i++)
        w->sorted[w->queue[w->pixel[i].set]++] = w->pixel[i].v;
    for (size_t b = base; b < out->n; b++) {
        struct blob *o = &out->blob[b];
        long k = min_area < o->n ? min_area : o->n;
        o->margin = kth_largest(w->sorted + w->queue[b - base] - o->n, o->n, k) - o->threshold;
    }
    return OK;
}

/* Lowest threshold inside the component. */
static double component_threshold(const struct segments *s, size_t c, const struct deblend_params *p)
{
    if (!p->rms_map)
        return p->threshold;
    double low = INFINITY;
    for (size_t i = s->first[c]; i < s->first[c + 1]; i++) {
        const float *rms = p->rms_map + (size_t)s->run[i].y * (size_t)p->nx;
        for (int32_t x = s->run[i].x0; x < s->run[i].x1; x++) {
            double t = p->threshold * (double)rms[x];
            low = t < low ? t : low;
        }
    }
    return low;
}

/*
 * Moments of a pixel outside the cores: its light is divided among all parts of
 * the component as their Gaussians divide it there (with more than SHARERS
 * parts it all goes to the part that owns it).
 */
static void share_moments(const struct deblend_work *w, int32_t first, const struct pixel *p, struct blob *blob,
                          size_t parts)
{
    double light[SHARERS], most = -INFINITY, sum = 0;
    size_t k = 0;
    for (int32_t t = first; t >= 0; t = w->part[t].next, k++) {
        light[k] = log_profile(&w->part[t], p);
        most = light[k] > most ? light[k] : most;
    }
    for (k = 0; k < parts; k++) {
        light[k] = light[k] > most - 10 ? exp(light[k] - most) : 0;
        sum += light[k];
    }
    for (k = 0; k < parts; k++)
        if (light[k] > 0)
            add_moments(&blob[k], p->x, p->y, (double)p->v * light[k] / sum);
}

static const struct blob no_blob = {.xmin = INT32_MAX, .ymin = INT32_MAX, .xmax = -1, .ymax = -1, .peak = -INFINITY};

/* Sums of the labelled pixels of at least two parts; objects are numbered in the order of their parts. */
static int measure_parts(const struct segments *s, size_t c, const struct deblend_params *p,
                         struct deblend_work *w, double threshold, int32_t first, int32_t *owner, struct blob_list *out)
{
    size_t base = out->n, parts = 0;
    int st = grow(&w->queue, &w->cap_queue, (size_t)w->npart, sizeof *w->queue);
    if (st)
        return st;
    for (int32_t t = first; t >= 0; t = w->part[t].next)   /* rename sets to 0..parts-1 */
        w->queue[t] = (int32_t)parts++;
    st = grow(&out->blob, &out->cap, base + parts, sizeof *out->blob);
    if (st)
        return st;
    size_t k = 0;
    for (int32_t t = first; t >= 0; t = w->part[t].next, k++) {
        struct blob *b = &out->blob[base + k];
        *b = no_blob;
        b->flags = DETECT_BLENDED;
        b->threshold = threshold;
        b->x0 = (int32_t)w->part[t].x;
        b->y0 = (int32_t)w->part[t].y;
        b->core_x = w->part[t].x - b->x0;
        b->core_y = w->part[t].y - b->y0;
    }
    int32_t i = 0;
    for (size_t r = s->first[c]; r < s->first[c + 1]; r++)
        for (int32_t x = s->run[r].x0; x < s->run[r].x1; x++, i++) {
            size_t at = s->at[c] + (size_t)i;
            w->pixel[i].set = w->queue[w->pixel[i].set];
            struct blob *b = &out->blob[base + (size_t)w->pixel[i].set];
            add_pixel_to(b, x, s->run[r].y, (double)s->smooth[at], (double)s->value[at]);
            if (parts <= SHARERS && !w->pixel[i].core)
                share_moments(w, first, &w->pixel[i], out->blob + base, parts);
            else
                add_moments(b, x, s->run[r].y, (double)s->smooth[at]);
            const int32_t number = (int32_t)base + w->pixel[i].set;
            memcpy(&owner[at], &number, sizeof number);        /* where the pixel's value was, perhaps */
        }
    out->n = base + parts;
    return find_margins(w, out, base, p->min_area);
}

/* A component as one object, straight from its runs. with_margin 0: so large an object is no wing of another. */
static int measure_whole(const struct segments *s, size_t c, const struct deblend_params *p, double threshold,
                         int with_margin, struct deblend_work *w, struct blob_list *out)
{
    const struct run *first = &s->run[s->first[c]], *end = &s->run[s->first[c + 1]];
    int st = grow(&out->blob, &out->cap, out->n + 1, sizeof *out->blob);
    if (st)
        return st;
    struct blob b = no_blob;
    b.x0 = first->x0;
    b.y0 = first->y;
    b.threshold = threshold;
    size_t at = s->at[c];
    for (const struct run *r = first; r < end; r++)
        for (int32_t x = r->x0; x < r->x1; x++, at++) {
            add_pixel_to(&b, x, r->y, (double)s->smooth[at], (double)s->value[at]);
            add_moments(&b, x, r->y, (double)s->smooth[at]);
        }
    b.margin = b.smooth_peak - threshold;
    long k = p->min_area < b.n ? p->min_area : b.n;
    if (with_margin && k <= FEW) {
        struct largest top = {.room = k};
        for (const float *v = s->smooth + s->at[c], *stop = s->smooth + at; v < stop; v++)
            largest_add(&top, *v);
        b.margin = (double)top.v[k - 1] - threshold;
    } else if (with_margin) {
        st = grow(&w->sorted, &w->cap_sorted, (size_t)b.n, sizeof *w->sorted);
        if (st)
            return st;
        memcpy(w->sorted, s->smooth + s->at[c], (size_t)b.n * sizeof *w->sorted);
        b.margin = kth_largest(w->sorted, b.n, k) - threshold;
    }
    out->blob[out->n++] = b;
    return OK;
}

int deblend_component(const struct segments *s, size_t c, const struct deblend_params *p,
                      struct deblend_work *w, int32_t *owner, struct blob_list *out)
{
    if (p->levels < 1 || p->levels > 1024 || !(p->contrast >= 0))
        return E_RANGE;
    size_t size = s->at[c + 1] - s->at[c];
    double threshold = component_threshold(s, c, p);
    if (p->most && size > p->most) {
        int st = measure_whole(s, c, p, threshold, 0, w, out);
        if (!st)
            out->blob[out->n - 1].flags = DETECT_UNSEPARATED;
        return st;
    }
    int32_t first = -1;
    int st = OK, several = p->levels > 1 && p->contrast < 1 && size > 2 * (size_t)p->branch_area;
    if (several)
        st = peaks_several(s, c, p->branch_area, p->contrast, &w->peaks, &several);
    if (!st && several) {
        st = load(w, s, c);
        if (!st) {
            link_rows(w);
            st = flood(w, p, threshold, &first);
        }
        if (!st && first >= 0)
            st = share_pixels(w, first, p->levels);
    }
    if (st)
        return st;
    return first < 0 ? measure_whole(s, c, p, threshold, 1, w, out)
                     : measure_parts(s, c, p, w, threshold, first, owner, out);
}
