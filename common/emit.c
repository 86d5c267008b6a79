/* emit.c - a scene list turned into what the renderer draws. */
#include "emit.h"
#include "sersic.h"
#include "shear.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Own shear of a round profile of axis ratio q at pa that is mirrored, turned and then sheared by g. */
static int round_shear(const struct object *o, double g[2])
{
    const double e = (1 - o->q) / (1 + o->q), angle = o->parity * o->pa + o->rot;
    const double shape[2] = {e * cos(2 * angle), e * sin(2 * angle)}, own[2] = {o->g1, o->g2};
    double turn;                       /* turns a round profile: no matter */
    return shear_then(shape, own, g, &turn);
}

/* A map after the own shear becomes part of dilation, rotation, parity and own shear. */
static void bend(struct emitter *to, const double map[4])
{
    double s[4], a[4];
    struct map_parts p;
    int st = shear_matrix(to->g1, to->g2, s);
    for (int i = 0; i < 4 && st == OK; i++)
        a[i] = map[i / 2 * 2] * s[i % 2] + map[i / 2 * 2 + 1] * s[2 + i % 2];
    if (st || map_split(a, &p)) {
        to->g1 = to->g2 = NAN;             /* cannot be drawn: the plan counts it */
        return;
    }
    to->dilation *= p.scale;
    to->rotation = p.turn + (p.mirror ? -to->rotation : to->rotation);
    to->parity = p.mirror ? -to->parity : to->parity;
    to->g1 = p.g[0];
    to->g2 = p.g[1];
}

/* Gaussians of a round object, of width 1 and flux 1. */
struct round {
    int n;
    double sigma[SERSIC_PARTS], flux[SERSIC_PARTS];
};

static int round_parts(struct emission *e, const struct object *o, double electrons, struct round *r)
{
    if (o->type == OBJECT_GAUSS) {
        *r->sigma = SIGMA_PER_RE;
        *r->flux = 1;
        r->n = 1;
        return OK;
    }
    int st = e->sersic ? OK : sersic_new(&e->sersic, e->eps);
    if (st)
        return st;
    r->n = sersic_gaussians(e->sersic, o->n, e->pixel / (o->re * o->dilation), e->floor / fabs(electrons), r->sigma, r->flux);
    return r->n ? OK : E_RANGE;
}

/* Append the parts of a round object. */
static void emit_round(struct emission *e, const struct object *o, struct emitter base, const struct round *r, const double *map)
{
    double g[2];
    int st = round_shear(o, g);
    for (int k = 0; k < r->n; k++, e->n++) {
        struct emitter *to = &e->emitter[e->n];
        *to = base;
        to->beta = r->sigma[k] * o->re;
        to->flux = base.flux * r->flux[k];
        to->g1 = st ? NAN : g[0];
        to->g2 = st ? NAN : g[1];
        if (map)
            bend(to, map);
        to->rotation = 0;
        to->parity = 1;
        to->parts = (short)(k ? 0 : r->n);
        e->coef[e->n] = 1 / (2 * sqrt(M_PI) * to->beta);
        to->coef = &e->coef[e->n];
    }
}

int emission_new(struct emission *e, size_t room, double pixel, const struct accuracy *a)
{
    struct emission made = {.room = room, .pixel = pixel, .eps = a->eps, .floor = a->floor,
                            .emitter = malloc((room + 1) * sizeof *made.emitter), .coef = malloc((room + 1) * sizeof(double))};
    if (!made.emitter || !made.coef) {
        emission_free(&made);
        return E_NOMEM;
    }
    *e = made;
    return OK;
}

int emission_add(struct emission *e, size_t *next, const struct scene *s, const struct models *m, const double *x,
                 const double *y, double (*map)[4], double exptime)
{
    struct round r;
    for (; *next < s->n; ++*next) {
        const struct object *o = &s->object[*next];
        const int is_round = o->type == OBJECT_GAUSS || o->type == OBJECT_SERSIC;
        struct emitter base = {.x = x[*next], .y = y[*next], .flux = o->flux * exptime, .parity = o->parity, .rotation = o->rot,
                               .dilation = o->dilation, .g1 = o->g1, .g2 = o->g2, .parts = 1};
        int st = is_round ? round_parts(e, o, base.flux, &r) : OK;
        if (st)
            return st;
        if (e->n + (is_round ? (size_t)r.n : 1) > e->room)
            return OK;
        if (is_round) {
            emit_round(e, o, base, &r, map ? map[*next] : NULL);
            continue;
        }
        if (o->type == OBJECT_STAR) {
            base.dilation = 1;
            base.parity = 1;
            base.rotation = base.g1 = base.g2 = 0;
        } else {
            base.beta = m->beta[o->model];
            base.nmax = m->nmax[o->model];
            base.coef = m->coef + m->offset[o->model];
            if (map)
                bend(&base, map[*next]);
        }
        e->emitter[e->n++] = base;
    }
    return OK;
}

void emission_free(struct emission *e)
{
    free(e->emitter);
    free(e->coef);
    sersic_free(e->sersic);
    *e = (struct emission){0};
}
