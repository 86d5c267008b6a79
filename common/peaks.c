/*
 * peaks.c - can a component be more than one object?  See peaks.h.
 *
 * A branch that does not hold the component's highest maximum has a maximum of its own on top.  Water that sinks from there
 * finds the branch: the highest neighbour is added again and again until it is higher than the maximum.  What was there when
 * the water last sank is the branch at its largest; pixels that came later lie beyond the saddle.
 */
#include "peaks.h"
#include "grow.h"
#include <string.h>

enum { WIDEST = 4096, MEMBERS = 16 };      /* pixels of a grid; of a branch before one gives up */

void peaks_free(struct peaks *w)
{
    free(w->line);
    *w = (struct peaks){0};
}

/* The runs' box. */
static struct box box_of(const struct run *first, const struct run *end)
{
    int32_t left = first->x0, right = first->x1;
    for (const struct run *r = first; r < end; r++) {
        left = r->x0 < left ? r->x0 : left;
        right = r->x1 > right ? r->x1 : right;
    }
    return (struct box){left, first->y, right - left, (end - 1)->y - first->y + 1};
}

/* ---- two maxima, straight from the runs ---- */

/* The runs of one row, [begin, end), and their values at x0 - left + 1 of a line that is 0 elsewhere; rest: the values behind. */
struct line {
    float *v;
    const struct run *begin, *end;
    const float *rest;
};

static struct line take_line(const float *value, const struct run *from, const struct run *stop, int32_t left, float *v)
{
    const struct run *r = from;
    for (; r < stop && r->y == from->y; value += r->x1 - r->x0, r++)
        memcpy(v + (r->x0 - left + 1), value, (size_t)(r->x1 - r->x0) * sizeof *v);
    return (struct line){v, from, r, value};
}

static void clear_line(struct line l, int32_t left)
{
    for (const struct run *r = l.begin; r < l.end; r++)
        memset(l.v + (r->x0 - left + 1), 0, (size_t)(r->x1 - r->x0) * sizeof *l.v);
}

/* Local maxima of the line; every top, be it flat, counts at least once. */
static int count_maxima(struct line l, const float *up, const float *down, int32_t left)
{
    int n = 0;
    for (const struct run *r = l.begin; r < l.end; r++)
        for (int32_t i = r->x0 - left + 1; i <= r->x1 - left; i++) {
            float v = l.v[i];
            n += (up[i - 1] < v) & (up[i] < v) & (up[i + 1] < v) & (l.v[i - 1] < v) & (l.v[i + 1] <= v)
                 & (down[i - 1] <= v) & (down[i] <= v) & (down[i + 1] <= v);
        }
    return n;
}

/* *several = 1 when the component has at least two local maxima. */
static int several_maxima(const struct segments *s, size_t c, struct box box, struct peaks *w, int *several)
{
    const struct run *first = s->run + s->first[c], *end = s->run + s->first[c + 1];
    size_t wide = (size_t)box.nx + 2;      /* not more than the pixels: they are connected */
    int st = grow(&w->line, &w->cap_line, 3 * wide, sizeof *w->line);
    if (st)
        return st;
    memset(w->line, 0, 3 * wide * sizeof *w->line);
    struct line up = {w->line, first, first, NULL};
    struct line here = take_line(s->smooth + s->at[c], first, end, (int32_t)box.x0, w->line + wide);
    int n = 0;
    for (float *free_line = w->line + 2 * wide; here.begin < end && n < 2;) {
        struct line down = take_line(here.rest, here.end, end, (int32_t)box.x0, free_line);
        n += count_maxima(here, up.v, down.v, (int32_t)box.x0);
        clear_line(up, (int32_t)box.x0);
        free_line = up.v;
        up = here;
        here = down;
    }
    *several = n >= 2;
    return OK;
}

/* ---- branches, on a grid ---- */

/* Values with a frame of zeros; those of the members of a branch are negated. */
struct grid {
    float *v;
    long stride, first, last;              /* places of the first pixel and of the last */
    double total;
};

static int take_grid(const struct segments *s, size_t c, struct box box, struct peaks *w, struct grid *g)
{
    size_t n = (size_t)(box.nx + 2) * (size_t)(box.ny + 2);
    int st = grow(&w->line, &w->cap_line, n, sizeof *w->line);
    if (st)
        return st;
    *g = (struct grid){w->line, box.nx + 2, box.nx + 3, (box.nx + 2) * (box.ny + 1) - 2, 0};
    memset(g->v, 0, n * sizeof *g->v);
    const float *v = s->smooth + s->at[c];
    for (size_t i = s->first[c]; i < s->first[c + 1]; i++) {
        const struct run *r = &s->run[i];
        float *to = g->v + (r->y - box.y0 + 1) * g->stride + (r->x0 - box.x0 + 1);
        for (int32_t x = 0; x < r->x1 - r->x0; x++) {
            to[x] = *v++;
            g->total += (double)to[x];
        }
    }
    return OK;
}

/* A maximum, as in count_maxima(). */
static int is_top(const struct grid *g, long i)
{
    const float *here = g->v + i, *up = here - g->stride, *down = here + g->stride, v = *here;
    return (v > 0) & (up[-1] < v) & (up[0] < v) & (up[1] < v) & (here[-1] < v) & (here[1] <= v)
         & (down[-1] <= v) & (down[0] <= v) & (down[1] <= v);
}

/* The highest neighbour of a place that is no member, if it is higher than *most. */
static void look_around(const struct grid *g, long at, long *best, float *most)
{
    for (long row = at - g->stride; row <= at + g->stride; row += g->stride)
        for (long i = row - 1; i <= row + 1; i++)
            if (g->v[i] > *most) {
                *most = g->v[i];
                *best = i;
            }
}

/* 1 when the branch of the top at `at` may be large and bright enough for an object. */
static int may_stand(const struct grid *g, long at, long area, double least)
{
    const float top = g->v[at];
    long member[MEMBERS], n = 0, next = at;
    float level = top, v = top;
    double sum = 0;                        /* of the members */
    int answer = -1;
    while (answer < 0) {
        if (v < level && n >= area && sum - (double)v * (double)n > least)
            answer = 1;                    /* all members are above the water that sinks to v */
        level = v < level ? v : level;
        member[n++] = next;
        sum += (double)v;
        g->v[next] = -v;
        v = 0;
        for (long k = 0; k < n; k++)
            look_around(g, member[k], &next, &v);
        if (v > top)
            answer = answer < 0 ? 0 : answer;
        else if (!(v > 0) || n == MEMBERS)
            answer = 1;
    }
    for (long k = 0; k < n; k++)
        g->v[member[k]] = -g->v[member[k]];
    return answer;
}

int peaks_several(const struct segments *s, size_t c, long area, double contrast, struct peaks *w, int *several)
{
    const struct run *first = s->run + s->first[c], *end = s->run + s->first[c + 1];
    struct box box = box_of(first, end);
    int st = several_maxima(s, c, box, w, several);
    if (st || !*several || (box.nx + 2) * (box.ny + 2) > WIDEST)
        return st;
    struct grid g;
    st = take_grid(s, c, box, w, &g);
    if (st)
        return st;
    long tops = 0, highest = -1;
    for (long i = g.first; i <= g.last; i++)
        if (is_top(&g, i) && (highest < 0 || g.v[i] > g.v[highest]))
            highest = i;
    const double least = contrast * g.total * (1 - 1e-6);      /* sums in another order than the flood's */
    for (long i = g.first; i <= g.last && !tops; i++)
        tops += i != highest && is_top(&g, i) && may_stand(&g, i, area, least);
    *several = tops > 0;
    return OK;
}
