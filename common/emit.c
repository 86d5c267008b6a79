/* emit.c - a scene list turned into what the renderer draws. */
#include "emit.h"
#include "render.h"
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

/* n Gaussians of width sigma (units of RE) for a round object. */
static int emit_round(struct emission *e, const struct object *o, struct emitter base, int n, const double *sigma,
                      const double *flux, const double *map, double *coef)
{
    double g[2];
    int st = round_shear(o, g);
    for (int k = 0; k < n; k++) {
        struct emitter *to = &e->emitter[e->n++];
        *to = base;
        to->beta = sigma[k] * o->re;
        to->flux = base.flux * flux[k];
        to->g1 = st ? NAN : g[0];
        to->g2 = st ? NAN : g[1];
        if (map)
            bend(to, map);
        to->rotation = 0;
        to->parity = 1;
        to->parts = (short)(k ? 0 : n);
        coef[k] = 1 / (2 * sqrt(M_PI) * to->beta);
        to->coef = &coef[k];
    }
    return n;
}

static int round_parts(const struct object *o, double *sigma, double *flux)
{
    if (o->type == OBJECT_GAUSS) {
        sigma[0] = SIGMA_PER_RE;
        flux[0] = 1;
        return 1;
    }
    return sersic_gaussians(o->n, sigma, flux);
}

/* Number of emitters of every object, or an error. */
static int count_parts(const struct scene *s, size_t *total)
{
    double sigma[SERSIC_PARTS], flux[SERSIC_PARTS], last = NAN;
    int parts = 0;
    *total = 0;
    for (size_t i = 0; i < s->n; i++) {
        const struct object *o = &s->object[i];
        if (o->type == OBJECT_SERSIC && o->n != last) {
            parts = sersic_gaussians(o->n, sigma, flux);
            last = o->n;
            if (parts == 0)
                return E_RANGE;
        }
        *total += o->type == OBJECT_SERSIC ? (size_t)parts : 1;
    }
    return OK;
}

int emission_bytes(const struct scene *s, double *emission, double *drawing)
{
    size_t total = 0;
    int st = count_parts(s, &total);
    if (st)
        return st;
    *emission = (double)total * (double)(sizeof(struct emitter) + sizeof(double));
    *drawing = (double)total * (double)(sizeof(struct draw) + RENDER_BYTES);
    return OK;
}

int emission_new(struct emission *e, const struct scene *s, const struct models *m, const double *x,
                 const double *y, double (*map)[4], double exptime)
{
    size_t total = 0, used = 0;
    int st = count_parts(s, &total);
    if (st)
        return st;
    struct emission made = {.emitter = calloc(total + 1, sizeof *made.emitter), .coef = malloc((total + 1) * sizeof(double))};
    if (!made.emitter || !made.coef) {
        emission_free(&made);
        return E_NOMEM;
    }
    double sigma[SERSIC_PARTS], flux[SERSIC_PARTS], last = NAN;
    int parts = 0;
    for (size_t i = 0; i < s->n; i++) {
        const struct object *o = &s->object[i];
        struct emitter base = {.x = x[i], .y = y[i], .flux = o->flux * exptime, .parity = o->parity, .rotation = o->rot,
                               .dilation = o->dilation, .g1 = o->g1, .g2 = o->g2, .parts = 1};
        if (o->type == OBJECT_STAR) {
            base.dilation = 1;
            base.parity = 1;
            base.rotation = base.g1 = base.g2 = 0;
        } else if (o->type == OBJECT_SHAPELET) {
            base.beta = m->beta[o->model];
            base.nmax = m->nmax[o->model];
            base.coef = m->coef + m->offset[o->model];
            if (map)
                bend(&base, map[i]);
        } else {
            if (o->type == OBJECT_GAUSS || o->n != last)
                parts = round_parts(o, sigma, flux);
            last = o->type == OBJECT_GAUSS ? NAN : o->n;
            used += (size_t)emit_round(&made, o, base, parts, sigma, flux, map ? map[i] : NULL, made.coef + used);
            continue;
        }
        made.emitter[made.n++] = base;
    }
    *e = made;
    return OK;
}

void emission_free(struct emission *e)
{
    free(e->emitter);
    free(e->coef);
    *e = (struct emission){0};
}
