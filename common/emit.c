/* emit.c - a scene list turned into what the renderer draws. */
#include "emit.h"
#include "render.h"
#include "shear.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double SIGMA_PER_RE = 0.84932180028801904272;   /* 1 / sqrt(2 ln 2) */

/* ---- Sersic profiles ---- */

/* Regularised incomplete gamma function P(a, x) by its series; a <= 16, x <= 30. */
static double gamma_p(double a, double x)
{
    double term = exp(-x + a * log(x) - lgamma(a + 1)), sum = term;
    for (int k = 1; k < 500 && term > 1e-17 * sum; k++)
        sum += term *= x / (a + k);
    return sum;
}

/* b with P(2n, b) = 1/2: half the light inside r = RE. */
static double sersic_b(double n)
{
    double lo = 1e-3, hi = 20;
    for (int i = 0; i < 100; i++) {
        double mid = 0.5 * (lo + hi);
        if (gamma_p(2 * n, mid) < 0.5)
            lo = mid;
        else
            hi = mid;
    }
    return 0.5 * (lo + hi);
}

/*
 * Density of ln t of the one-sided stable law of index a < 1, the mixture
 * exp(-s^a) = E exp(-s t), by Kanter's (1975) representation: average over u
 * of W exp(-W) a/(1-a), W = A(u) t^(-a/(1-a)).
 */
static double stable_density(double a, double lnt)
{
    const int angles = (int)(300 + 12 * a / (1 - a));   /* the integrand is narrow when a is near 1 */
    double sum = 0;
    for (int i = 0; i < angles; i++) {
        double u = (i + 0.5) * M_PI / angles;
        double lna = log(sin((1 - a) * u)) + a / (1 - a) * log(sin(a * u)) - 1 / (1 - a) * log(sin(u));
        double lnw = lna - a / (1 - a) * lnt;
        if (lnw < 7)
            sum += exp(lnw - exp(lnw));
    }
    return sum / angles * a / (1 - a);
}

int sersic_gaussians(double n, double *sigma, double *flux)
{
    if (!(n >= 0.5 && n <= 8))
        return 0;
    if (n < 0.5025) {
        sigma[0] = SIGMA_PER_RE;
        flux[0] = 1;
        return 1;
    }
    const double a = 1 / (2 * n), b = sersic_b(n), lnb = log(b) / a;
    const double step = 0.6 * fmin(1, 1.4 * (1 - a) / a);
    const double range = 4 * (1 - a) / a + 3;
    double best = 0, at = 0, sum = 0;
    for (double l = -range; l < range; l += fmax(step, 0.01)) {   /* weights of flux: density / t */
        double f = stable_density(a, l) * exp(-l);
        if (f > best) {
            best = f;
            at = l;
        }
    }
    int k = 0;
    for (int way = -1; way <= 1; way += 2)
        for (double l = way < 0 ? at - step : at; k < SERSIC_PARTS; l += way * step) {
            double f = stable_density(a, l) * exp(-l);
            if (!(f > 2e-7 * best))
                break;
            sigma[k] = 1 / sqrt(2 * exp(l + lnb));
            flux[k] = f;
            sum += f;
            k++;
        }
    for (int i = 0; i < k; i++)
        flux[i] /= sum;
    return k;
}

/* ---- objects ---- */

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
