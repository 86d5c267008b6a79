/* clean.c - spurious detections in the wings of bright objects; see clean.h. */
#include "clean.h"
#include "grow.h"
#include <math.h>
#include <stdlib.h>

enum { CELL = 8, TASK = 128 };             /* pixels; blobs */
static const double REACH = 10;            /* rms radii */

struct wing {
    double x, y, a, cxx, cxy, cyy, peak, k;
};

struct grid {
    long mx, my;
    int32_t *head, *next;                  /* chains of blobs by the cell of their centroid */
    double *centre;                        /* x, y of every blob */
};

/* The light of owner's wing at the victim, more than its margin. */
struct claim {
    int32_t victim, owner;
    double light;
};

struct claims {
    struct claim *claim;
    size_t n, cap;
};

struct cleaning {
    const struct blob_list *list;
    double beta;
    struct grid grid;
    struct claims *of;                     /* one list a task */
};

static struct wing wing_of(const struct blob *b, double beta)
{
    struct wing w;
    double xx, xy, yy, a, s;
    blob_moments(b, &w.x, &w.y, &xx, &xy, &yy);
    ellipse_axes(xx, xy, yy, &a, &s, NULL);
    double det = xx * yy - xy * xy;
    w.a = a;
    w.cxx = yy / det;
    w.cyy = xx / det;
    w.cxy = -2 * xy / det;
    double area = acos(-1) * sqrt(det);
    w.peak = b->smooth_peak;
    double edge2 = (double)b->n / area;    /* r^2 of the isophote in units of the ellipse */
    double fall = pow(w.peak / b->threshold, 1 / beta) - 1;
    w.k = fall > 0 ? fall / edge2 : 0;
    return w;
}

/* Of m cells the one at c pixels; what lies outside goes to the nearest. */
static long cell_at(double c, long m)
{
    return c > 0 ? c < (double)(m * CELL) ? (long)c / CELL : m - 1 : 0;
}

static int grid_new(struct grid *g, const struct blob_list *list, long nx, long ny)
{
    g->mx = nx / CELL + 1;
    g->my = ny / CELL + 1;
    size_t cells = (size_t)g->mx * (size_t)g->my;
    g->head = malloc(cells * sizeof *g->head);
    g->next = malloc((list->n + 1) * sizeof *g->next);
    g->centre = malloc((2 * list->n + 1) * sizeof *g->centre);
    if (!g->head || !g->next || !g->centre)
        return E_NOMEM;
    for (size_t i = 0; i < cells; i++)
        g->head[i] = -1;
    for (size_t i = list->n; i-- > 0;) {
        double *c = &g->centre[2 * i], xx, xy, yy;
        blob_moments(&list->blob[i], &c[0], &c[1], &xx, &xy, &yy);
        long cell = cell_at(c[1], g->my) * g->mx + cell_at(c[0], g->mx);
        g->next[i] = g->head[cell];
        g->head[cell] = (int32_t)i;
    }
    return OK;
}

/* A brighter object claims its victims: fainter ones whose margin its wing exceeds. */
static int claim(const struct cleaning *t, size_t i, struct claims *out)
{
    const struct blob_list *list = t->list;
    const struct grid *g = &t->grid;
    const struct blob *b = &list->blob[i];
    struct wing w = wing_of(b, t->beta);
    double reach = REACH * w.a;
    long c0 = cell_at(w.x - reach, g->mx), c1 = cell_at(w.x + reach, g->mx);
    long r0 = cell_at(w.y - reach, g->my), r1 = cell_at(w.y + reach, g->my);
    for (long r = r0; r <= r1; r++)
        for (long c = c0; c <= c1; c++)
            for (int32_t j = g->head[r * g->mx + c]; j >= 0; j = g->next[j]) {
                const struct blob *o = &list->blob[j];
                if ((size_t)j == i || !(o->s < b->s || (!(o->s > b->s) && (size_t)j > i)))
                    continue;
                double dx = g->centre[2 * j] - w.x, dy = g->centre[2 * j + 1] - w.y;
                if (!(dx * dx + dy * dy < reach * reach))
                    continue;
                double r2 = w.cxx * dx * dx + w.cyy * dy * dy + w.cxy * dx * dy;
                double light = w.peak * pow(1 + w.k * r2, -t->beta);
                if (!(light > o->margin))
                    continue;
                int st = grow(&out->claim, &out->cap, out->n + 1, sizeof *out->claim);
                if (st)
                    return st;
                out->claim[out->n++] = (struct claim){j, (int32_t)i, light};
            }
    return OK;
}

static int claim_some(void *ctx, long begin, long end, int worker)
{
    const struct cleaning *t = ctx;
    int st = OK;
    (void)worker;
    for (long i = begin; i < end && !st; i++)
        st = claim(t, (size_t)i, &t->of[begin / TASK]);
    return st;
}

/* Every victim to the wing that is brightest there, of equal ones to the first; light: n zeros. */
static void settle_claims(const struct claims *of, long tasks, int32_t *into, double *light)
{
    for (long k = 0; k < tasks; k++)
        for (size_t i = 0; i < of[k].n; i++) {
            const struct claim *c = &of[k].claim[i];
            if (c->light > light[c->victim]) {
                light[c->victim] = c->light;
                into[c->victim] = c->owner;
            }
        }
}

int clean_objects(struct blob_list *list, double beta, long nx, long ny, struct par_team *team, int32_t *into)
{
    if (!(beta >= 0.1 && beta <= 10))
        return E_RANGE;
    size_t n = list->n;
    long tasks = (long)((n + TASK - 1) / TASK);
    struct cleaning t = {.list = list, .beta = beta, .of = calloc((size_t)tasks + 1, sizeof(struct claims))};
    double *light = calloc(n + 1, sizeof *light);
    int st = t.of && light ? grid_new(&t.grid, list, nx, ny) : E_NOMEM;
    if (!st)
        st = par_team_for(team, (long)n, TASK, claim_some, &t);
    if (st)
        goto done;
    for (size_t i = 0; i < n; i++)
        into[i] = (int32_t)i;
    settle_claims(t.of, tasks, into, light);
    for (size_t i = 0; i < n; i++) {       /* follow chains: each step leads to a brighter object */
        int32_t end = into[i];
        while (into[end] != end)
            end = into[end];
        for (int32_t k = (int32_t)i; k != end;) {
            int32_t up = into[k];
            into[k] = end;
            k = up;
        }
    }
    for (size_t i = 0; i < n; i++)
        if (into[i] != (int32_t)i)
            blob_absorb(&list->blob[into[i]], &list->blob[i]);
done:
    for (long k = 0; k < tasks && t.of; k++)
        free(t.of[k].claim);
    free(t.of);
    free(t.grid.head);
    free(t.grid.next);
    free(t.grid.centre);
    free(light);
    return st;
}
