/*
 * test_requests.c - error requested against error found, object by object: all models of the
 * Hubble Deep Field (when ../shared is there), generated galaxies, random shapelets of order 0 to 60 with
 * light of both signs, stars, Gaussians and Sersic profiles, turned, mirrored, dilated, with shears of their own, at
 * random phases.
 *
 * The reference has four times the period of the object's largest stamp, always, all frequencies, in double, and a shear that
 * is evaluated, not expanded; without a PSF nothing comes back, and it is the middle 2560 pixels of the object itself.
 * The promise (accuracy.h): 99 % within the request, none beyond 3 times.  Alone, each request takes every step-th object
 * (9 to 131); REQUESTS=all takes all 398 (tests/large/requests_*.sh: 1e-2 to 1e-7 at each of .04", .10" and .16").
 * Objects larger than any stamp are in test_broad.c.
 */
#include "emit.h"
#include "fft.h"
#include "population.h"
#include "render.h"
#include "scenes.h"
#include "sersic.h"
#include "shapelet.h"
#include "shear.h"
#include "tableio.h"
#include <string.h>

enum { GENERATED = 240, RANDOM = 60, STARS = 30, GAUSS = 30, SERSIC = 10, VIEW = 4096, ROOM = 2560, TILE = 4096, LEAN = 1500 };

/* ---- objects ---- */

/* The catalogue of the Hubble Deep Field; n = 0 when it is not there. */
static void open_hdf(struct table *list, struct models *m)
{
    const char *shared = getenv("SHARED");
    char name[512];
    struct err e = {""};
    snprintf(name, sizeof name, "%s/data/hdf/hdfn_shapelets.txt", shared ? shared : "");
    if (!shared || table_read(list, name, 1e9, &e) || models_open(m, list, name, &e)) {
        check_skip("data/hdf is not there: generated galaxies only");
        *m = (struct models){0};
    }
}

/*
 * Shapelets of any order and scale up to 0.3": a third smooth, a third with as much light in every order, a third with nearly no
 * flux for that light.
 */
static int random_model(int k, struct models *m, size_t i, double *c)
{
    const int nmax = (int)(61 * pow(uniform(k, 40), 1.5));
    const double fall = k % 3 ? 0 : 2 * uniform(k, 41);
    double moment[6];
    m->nmax[i] = nmax;
    m->beta[i] = pow(10, -3 + 2.5 * uniform(k, 42));
    for (int n = 0, j = 0; n <= nmax; n++)
        for (int n1 = 0; n1 <= n; n1++, j++)
            c[j] = j ? (uniform(k, 50 + j) - 0.5) * pow(1 + n, -fall) : k % 3 == 2 ? 0.05 : 1;
    shapelet_moments(nmax, m->beta[i], c, moment);
    for (size_t j = 0; j < shapelet_count(nmax); j++)
        c[j] /= moment[0];
    return nmax;
}

/* Models of the catalogue, generated galaxies of 20 to 30.8 mag, random ones; struct models that owns all it points to. */
static void all_models(const struct models *hdf, struct models *m)
{
    const struct population recipe = POPULATION_DEFAULTS;
    const struct profiles profiles = population_profiles();
    const struct rng r = rng_stream(11, 0, RNG_GALAXY);
    const size_t n = hdf->n + GENERATED + RANDOM, most = 91, any = shapelet_count(60);
    size_t *offset = calloc(n + 1, sizeof *offset), given = hdf->n ? hdf->offset[hdf->n] : 0;
    double *coef = calloc(given + GENERATED * most + RANDOM * any, sizeof *coef);
    *m = (struct models){.n = n, .beta = malloc(n * sizeof *m->beta), .mag = malloc(n * sizeof *m->mag),
                         .nmax = malloc(n * sizeof *m->nmax), .offset = offset, .coef = coef};
    for (size_t i = 0; i < hdf->n; i++) {
        m->beta[i] = hdf->beta[i];
        m->mag[i] = 21 + 9 * uniform((int)i, 2);
        m->nmax[i] = hdf->nmax[i];
        offset[i + 1] = hdf->offset[i + 1];
    }
    if (given)
        memcpy(coef, hdf->coef, given * sizeof *coef);
    for (size_t i = hdf->n; i < hdf->n + GENERATED; i++) {
        struct galaxy g;
        struct gaussians s;
        struct galaxy_fit fit;
        m->mag[i] = counts_magnitude(20, 30.8, uniform((int)i, 3));
        m->nmax[i] = galaxy_order(m->mag[i]);
        galaxy_draw(&recipe, &r, i, m->mag[i], &g);
        if (galaxy_gaussians(&recipe, &profiles, &g, &s) || galaxy_project(&recipe, &g, &s, m->nmax[i], coef + offset[i], &fit))
            exit(1);
        m->beta[i] = fit.beta;
        offset[i + 1] = offset[i] + shapelet_count(m->nmax[i]);
    }
    for (size_t i = hdf->n + GENERATED; i < n; i++) {
        m->mag[i] = 21 + 9 * uniform((int)i, 2);
        offset[i + 1] = offset[i] + shapelet_count(random_model((int)(i - hdf->n), m, i, coef + offset[i]));
    }
}

static void models_drop(struct models *m)
{
    free(m->beta);
    free(m->mag);
    free(m->nmax);
    free((size_t *)(uintptr_t)m->offset);
    free((double *)(uintptr_t)m->coef);
}

/* One object of each model, then the others. */
static struct scene all_objects(const struct models *m)
{
    static const double index[] = {0.5, 0.8, 1, 1.5, 2.5, 4, 6};
    struct scene s = {.n = m->n + STARS + GAUSS + SERSIC, .where = SCENE_PIXEL};
    s.object = calloc(s.n, sizeof *s.object);
    for (size_t i = 0; i < s.n; i++) {
        const int k = (int)i;
        const size_t other = i < m->n ? 0 : i - m->n;
        struct object *o = &s.object[i];
        *o = (struct object){.type = i < m->n ? OBJECT_SHAPELET : other < STARS ? OBJECT_STAR : other < STARS + GAUSS ? OBJECT_GAUSS : OBJECT_SERSIC,
                             .model = i < m->n ? (unsigned int)i : 0, .parity = k % 2 ? 1 : -1, .dilation = k % 7 ? 1 : 0.7 + 0.6 * uniform(k, 4),
                             .rot = k % 3 ? 0 : 6.3 * uniform(k, 5), .re = 0.08 * pow(10, 0.9 * uniform(k, 6)), .q = 0.3 + 0.7 * uniform(k, 7),
                             .pa = 3.1 * uniform(k, 8), .n = index[other % 7]};
        if (k % 11 == 3) {
            o->g1 = 0.3 * (uniform(k, 9) - 0.5);
            o->g2 = 0.3 * (uniform(k, 10) - 0.5);
        }
        const double mag = i < m->n ? m->mag[i] : 18 + 11 * uniform(k, 11);
        o->flux = pow(10, -0.4 * (mag - 26.65));
    }
    return s;
}

/* ---- reference ---- */

/* Exact map of one part: coefficients after parity and rotation, and the product of both shears. */
static int exact_shape(const struct view *v, const struct emitter *s, double *tmp, double *c, struct shape *shape)
{
    double own[4], all[4];
    *shape = (struct shape){.nmax = s->nmax, .beta_x = s->beta * s->dilation, .beta_y = s->beta * s->dilation};
    if (!s->coef)
        return OK;
    for (size_t i = 0; i < shapelet_count(s->nmax); i++)
        tmp[i] = s->coef[i] / s->dilation;
    if (s->parity < 0)
        shapelet_mirror(s->nmax, tmp);
    int st = shapelet_rotate(s->nmax, s->rotation, tmp, c);
    if (!st)
        st = shear_matrix(s->g1, s->g2, own);
    if (!st)
        st = shear_matrix(v->g1, v->g2, all);
    shape->coef = c;
    shape->mapped = 1;
    shape->a[0] = all[0] * own[0] + all[1] * own[2];
    shape->a[1] = all[0] * own[1] + all[1] * own[3];
    shape->a[2] = all[2] * own[0] + all[3] * own[2];
    shape->a[3] = all[2] * own[1] + all[3] * own[3];
    return st;
}

/* Tables and memory that references of one width share. */
struct ruler {
    struct stamp_grid grid;
    struct stamp_work *work;
    double *scratch, *sum, *part;      /* two tiles */
    double *ours, *stamp;              /* VIEW x VIEW */
    int wide, every;                   /* pixels per side; a tile has every `every`-th pixel of each axis */
};

static int ruler_set(struct ruler *r, const struct view *v, int wide)
{
    if (r->wide == wide)
        return OK;
    stamp_grid_free(&r->grid);
    r->wide = 0;
    for (r->every = 1; wide / r->every > TILE || wide % (2 * r->every); r->every++)
        ;
    const struct stamp_response response = {.diffusion = v->diffusion, .box = v->pixel};
    const int table = v->psf && v->psf->ucut * v->pixel * wide < LEAN;
    int st = v->psf ? stamp_grid_lean(&r->grid, v->psf, &response, v->pixel * r->every, wide / r->every, 1, table) : OK;
    r->wide = st ? 0 : wide;
    return st;
}

/* Every `every`-th pixel of each axis, from the one at (x, y) on; frequencies 8/beta beyond the last turning point are nothing (1e-16). */
static int reference(struct ruler *r, const struct view *v, const struct emitter *e, double x, double y, double *out)
{
    static double tmp[2000], c[2000];
    struct shape shape;
    int st = exact_shape(v, e, tmp, c, &shape);
    if (st)
        return st;
    const double area = r->every * r->every, f = shape.a[0] * shape.a[0] + shape.a[1] * shape.a[1] + shape.a[2] * shape.a[2] + shape.a[3] * shape.a[3];
    const double stretch = sqrt((f + sqrt(fmax(0, f * f - 4))) / 2);
    const double top = shape.coef ? stretch * (sqrt(2.0 * e->nmax + 1) + 8) / (2 * PI * shape.beta_x * r->grid.du) : 1e9;
    if (v->psf)
        return stamp_fourier(&r->grid, r->work, &shape, x / r->every, y / r->every, e->flux / area, top, out);
    if (shape.coef)
        return stamp_mapped(r->work, &shape, v->pixel, v->pixel, r->wide, r->wide, x, y, e->flux, out);
    stamp_point(r->wide, r->wide, x, y, e->flux, out);
    return OK;
}

/* Parts of the object that begins with i. */
static size_t parts_of(const struct plan *p, size_t i)
{
    return p->emitter[i].parts > 1 ? (size_t)p->emitter[i].parts : 1;
}

/* Side of the reference of the object whose first part is i: four times its largest stamp's. */
static int reference_side(const struct plan *p, size_t i)
{
    int side = 2;
    for (size_t k = i; k < i + parts_of(p, i); k++) {
        const struct draw *d = &p->draw[k];
        const int larger = d->path == PATH_BROAD ? p->acc.side_max : d->nx > d->ny ? d->nx : d->ny;
        side = d->path != PATH_NONE && larger > side ? larger : side;
    }
    return p->view.psf || 4 * side < ROOM ? 4 * side : ROOM;
}

/* All parts of the object as they are drawn, in r->ours: the pixels of the view inside `box` (first and last + 1 of x, y). */
static int draw_ours(const struct plan *p, size_t i, struct ruler *r, int box[4])
{
    box[0] = box[2] = VIEW;
    box[1] = box[3] = 0;
    for (size_t k = i; k < i + parts_of(p, i); k++) {
        const struct draw *d = &p->draw[k];
        if (d->path == PATH_NONE)
            continue;
        if (d->x0 < 0 || d->y0 < 0 || d->x0 + d->nx > VIEW || d->y0 + d->ny > VIEW)
            return E_RANGE;
        box[0] = d->x0 < box[0] ? d->x0 : box[0];
        box[1] = d->x0 + d->nx > box[1] ? d->x0 + d->nx : box[1];
        box[2] = d->y0 < box[2] ? d->y0 : box[2];
        box[3] = d->y0 + d->ny > box[3] ? d->y0 + d->ny : box[3];
    }
    for (int y = box[2]; y < box[3]; y++)
        memset(r->ours + (size_t)y * VIEW + box[0], 0, (size_t)(box[1] - box[0]) * sizeof *r->ours);
    for (size_t k = i; k < i + parts_of(p, i); k++) {
        const struct draw *d = &p->draw[k];
        if (d->path == PATH_NONE)
            continue;
        int st = scene_stamp(p, k, r->work, r->scratch, r->stamp);
        if (st)
            return st;
        for (int b = 0; b < d->ny; b++)
            for (int a = 0; a < d->nx; a++)
                r->ours[(size_t)(b + d->y0) * VIEW + (size_t)(a + d->x0)] += r->stamp[(size_t)b * (size_t)d->nx + (size_t)a];
    }
    return OK;
}

/* Worst pixel error of the object whose first part is i over what was requested; NaN when something fails. */
static double error_of(const struct plan *p, size_t i, struct ruler *r)
{
    const struct view *v = &p->view;
    const int wide = reference_side(p, i);
    const int x0 = (int)floor(p->emitter[i].x + 0.5) - wide / 2, y0 = (int)floor(p->emitter[i].y + 0.5) - wide / 2;
    double peak = 0, worst = 0;
    int box[4];
    if (ruler_set(r, v, wide) || draw_ours(p, i, r, box))
        return NAN;
    const int n = wide / r->every, every = r->every;
    const size_t area = (size_t)n * (size_t)n;
    for (int tile = 0; tile < every * every; tile++) {
        const int left = x0 + tile % every, low = y0 + tile / every;
        memset(r->sum, 0, area * sizeof *r->sum);
        for (size_t k = i; k < i + parts_of(p, i); k++) {
            if (reference(r, v, &p->emitter[k], p->emitter[k].x - left, p->emitter[k].y - low, r->part))
                return NAN;
            for (size_t j = 0; j < area; j++)
                r->sum[j] += r->part[j];
        }
        for (int b = 0; b < n; b++) {
            double *row = r->sum + (size_t)b * (size_t)n;
            const int y = low + b * every;
            for (int a = 0; a < n; a++)
                peak = fmax(peak, fabs(row[a]));
            for (int a = 0; y >= box[2] && y < box[3] && a < n; a++)
                if (left + a * every >= box[0] && left + a * every < box[1])
                    row[a] -= r->ours[(size_t)y * VIEW + (size_t)(left + a * every)];
            for (int a = 0; a < n; a++)
                worst = row[a] == row[a] ? fmax(worst, fabs(row[a])) : INFINITY;
        }
    }
    return worst / fmax(p->acc.eps * peak, p->acc.floor);
}

/* ---- requests ---- */

struct request {
    double pixel, eps, floor;
    int psf, step;         /* every step-th object, without REQUESTS=all; 0: none */
};

struct found {
    double ratio;
    enum object_type type;
};

static int rising(const void *a, const void *b)
{
    double x = ((const struct found *)a)->ratio, y = ((const struct found *)b)->ratio;
    return x < y ? -1 : x > y;
}

/* First parts of the objects, in order of their references' sides. */
static int by_side(const void *a, const void *b)
{
    const size_t *x = a, *y = b;
    return x[0] != y[0] ? (x[0] < y[0] ? -1 : 1) : x[1] < y[1] ? -1 : x[1] > y[1];
}

static void report(const struct request *q, int n, struct found *f)
{
    int good = 0, bad = 0;
    double worst[4] = {0};
    for (int i = 0; i < n; i++) {
        good += f[i].ratio <= 1;
        bad += !(f[i].ratio <= 3);
        worst[f[i].type] = f[i].ratio > worst[f[i].type] || isnan(f[i].ratio) ? f[i].ratio : worst[f[i].type];
    }
    qsort(f, (size_t)n, sizeof *f, rising);
    check_that(n > 0 && !bad && good >= 0.99 * n,
               "%s, %.2f\", request %g%s: %d objects, found/requested median %.2g, 99 %% %.2g, worst of stars %.2g, shapelets %.2g, "
               "Gaussians %.2g, Sersics %.2g; %.1f %% within, %d beyond 3 times",
               q->psf ? "PSF" : "no PSF", q->pixel, q->eps, q->floor > 0 ? " and floor" : "", n, f[n / 2].ratio, f[(int)ceil(0.99 * n) - 1].ratio,
               worst[OBJECT_STAR], worst[OBJECT_SHAPELET], worst[OBJECT_GAUSS], worst[OBJECT_SERSIC], 100.0 * good / n, bad);
}

static void requested(const struct request *q, const struct otf *t, const struct scene *all, const struct models *m, int step)
{
    struct view v = {.nx = VIEW, .ny = VIEW, .pixel = q->pixel, .diffusion = q->psf ? 0.04 : 0, .psf = q->psf ? t : NULL, .g1 = -0.03, .g2 = 0.04};
    struct accuracy a = ACCURACY_DEFAULT;
    struct scene s = {.where = SCENE_PIXEL, .object = calloc(all->n, sizeof *s.object)};
    double *x = malloc(2 * all->n * sizeof *x);
    struct emission e;
    struct plan p;
    struct ruler r = {0};
    a.eps = q->eps;
    a.floor = q->floor;
    for (size_t i = 0; i < all->n; i += (size_t)step) {
        if (all->object[i].type == OBJECT_SERSIC && s.n % 3 == 2 && step > 1)
            continue;
        x[s.n] = VIEW / 2 + uniform((int)i, 12);
        x[all->n + s.n] = VIEW / 2 + uniform((int)i, 13);
        s.object[s.n++] = all->object[i];
    }
    size_t next = 0;
    if (emission_new(&e, s.n * SERSIC_PARTS, v.pixel, &a) || emission_add(&e, &next, &s, m, x, x + all->n, NULL, 2000)
        || scene_plan(&p, &v, &a, e.n, e.emitter) || stamp_work_new(&r.work))
        exit(1);
    r.scratch = malloc((3 * plan_scratch(&p) + 1) * sizeof *r.scratch);
    r.sum = fft_alloc((size_t)TILE * TILE * sizeof *r.sum);
    r.part = fft_alloc((size_t)TILE * TILE * sizeof *r.part);
    r.ours = fft_alloc((size_t)VIEW * VIEW * sizeof *r.ours);
    r.stamp = fft_alloc((size_t)VIEW * VIEW * sizeof *r.stamp);
    size_t (*order)[3] = malloc(s.n * sizeof *order), n = 0;
    for (size_t i = 0, k = 0; k < s.n; k++) {
        order[n][0] = (size_t)reference_side(&p, i);
        order[n][1] = i;
        order[n++][2] = k;
        i += parts_of(&p, i);
    }
    qsort(order, n, sizeof *order, by_side);
    struct found *f = calloc(n, sizeof *f);
    for (size_t k = 0; k < n; k++)
        f[k] = (struct found){error_of(&p, order[k][1], &r), s.object[order[k][2]].type};
    report(q, (int)n, f);
    free(f);
    free(order);
    free(r.scratch);
    fft_free(r.sum);
    fft_free(r.part);
    fft_free(r.ours);
    fft_free(r.stamp);
    stamp_grid_free(&r.grid);
    stamp_work_free(r.work);
    plan_free(&p);
    emission_free(&e);
    free(s.object);
    free(x);
}

int main(void)
{
    static const struct request q[] = {
        {0.10, 1e-2, 0, 1, 3},     {0.10, 1e-3, 0, 1, 4},      {0.10, 1e-4, 0, 1, 8},       /* 0 */
        {0.16, 1e-2, 0, 1, 9},     {0.16, 1e-3, 0, 1, 9},      {0.16, 1e-4, 0, 1, 14},
        {0.04, 1e-2, 0, 1, 9},     {0.04, 1e-3, 0, 1, 14},     {0.04, 1e-4, 0, 1, 14},
        {0.10, 1e-5, 0, 1, 14},    {0.16, 1e-5, 0, 1, 14},     {0.04, 1e-5, 0, 1, 25},      /* 9 */
        {0.10, 1e-6, 0, 1, 25},    {0.16, 1e-6, 0, 1, 25},     {0.04, 1e-6, 0, 1, 45},      /* 12 */
        {0.10, 1e-7, 0, 1, 45},    {0.16, 1e-7, 0, 1, 45},     {0.04, 1e-7, 0, 1, 0},       /* 15 */
        {0.24, 1e-3, 0, 1, 13},    {0.10, 1e-4, 0, 0, 8},      {0.10, 1e-7, 0, 0, 8},       /* 18 */
        {0.10, 1e-7, 0.1, 1, 9},   {0.16, 1e-7, 0.17, 1, 25},  {0.04, 1e-7, 0.034, 1, 25}}; /* 21 */
    const int all = getenv("REQUESTS") && !strcmp(getenv("REQUESTS"), "all");
    const char *only = getenv("REQUEST");      /* the number of one of them, to try things */
    struct otf t = {0};
    struct table list = {0};
    struct models hdf = {0}, m;
    telescope(&t);
    open_hdf(&list, &hdf);
    all_models(&hdf, &m);
    struct scene s = all_objects(&m);
    check_that(!all || !hdf.n || s.n >= 300, "%zu objects, %zu of the HDF", s.n, hdf.n);
    for (size_t i = 0; i < sizeof q / sizeof *q; i++)
        if ((all || q[i].step) && (!only || (size_t)atoi(only) == i))
            requested(&q[i], &t, &s, &m, all ? 1 : q[i].step);
    scene_free(&s);
    models_drop(&m);
    models_free(&hdf);
    table_free(&list);
    otf_free(&t);
    return check_status();
}
