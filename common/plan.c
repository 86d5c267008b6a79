/*
 * plan.c - which path every object takes and how large its stamp is.
 *
 * Half side of a stamp = max(radius beyond which PSF wings of that flux stay
 * below the tolerance, radius beyond which the object itself does) + margins;
 * tolerance = max(eps peak, floor).  Objects too large for the largest stamp have few frequencies: a longer period
 * and a plain sum over them (broad.h).
 */
#include "plan.h"
#include "shapelet.h"
#include "shear.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SIDES 34
#define PERIODS 64             /* of large objects: 64, 128, 256 ... pixels */
#define CLASSES (SIDES + PERIODS)
#define BROAD_SIDE 256         /* larger pixels that a long period is counted in */
#define BROAD_KMAX 16000       /* frequencies per axis of a large object */

#define SINGLE_EPS 1e-5        /* of the peak: errors allowed from here on make room for those of single precision, 3e-7 */
#define SINGLE_LEAST 1e-15     /* electrons: fainter and, inversely, brighter objects would leave its range */
#define TABLE_BYTES 4194304.0  /* of all tables of transfer functions; classes of stamps beyond make their rows when drawn */
#define PART_PIXELS 2097152    /* larger stamps are made in parts */
#define LONGEST 10.0           /* seconds for one object without a stamp; those that need more are not drawn */
#define BROAD_X 0.5e-9         /* seconds for one frequency of a large object in one column of the image */
#define BROAD_Y 0.3e-9         /* and for one row of frequencies in one pixel */
#define WINGS_LONGEST 0.3      /* the same for an object that a stamp holds, but not its wings */

/* Sides of stamps: multiples of 8 or nearly, with factors 2, 3 and 5. */
static const int side_of[SIDES] = {12, 16, 20, 24, 32, 40, 48, 64, 72, 80, 96, 120, 128, 144, 160, 180, 200,
                                   216, 240, 256, 288, 320, 360, 400, 480, 512, 600, 640, 720, 800, 1024, 1280, 1600, 2048};

/* An object's transformation: parity, then rotation by `turn`, then shear g. */
struct pose {
    double turn, g1, g2, g;
};

int shear_then(const double first[2], const double then[2], double g[2], double *turn)
{
    double p[4], q[4];
    if (shear_matrix(first[0], first[1], p) || shear_matrix(then[0], then[1], q))
        return E_RANGE;
    const double a[4] = {q[0] * p[0] + q[1] * p[2], q[0] * p[1] + q[1] * p[3], q[2] * p[0] + q[3] * p[2], q[2] * p[1] + q[3] * p[3]};
    struct map_parts m;
    int st = map_split(a, &m);
    if (st)
        return st;
    *turn = m.turn;
    g[0] = m.g[0];
    g[1] = m.g[1];
    return OK;
}

int map_split(const double a[4], struct map_parts *m)
{
    const double det = a[0] * a[3] - a[1] * a[2], way = det < 0 ? -1 : 1;
    const double a11 = a[0], a12 = way * a[1], a21 = a[2], a22 = way * a[3];
    /* polar decomposition: A = S R, S symmetric */
    const double t = atan2(a21 - a12, a11 + a22), c = cos(t), d = sin(t);
    const double s11 = a11 * c - a12 * d, s12 = a11 * d + a12 * c, s22 = a21 * d + a22 * c;
    const struct map_parts made = {sqrt(fabs(det)), t, {(s11 - s22) / (s11 + s22), 2 * s12 / (s11 + s22)}, det < 0};
    if (!(made.scale > 0) || !isfinite(made.scale) || !(hypot(made.g[0], made.g[1]) < 1))
        return E_RANGE;
    *m = made;
    return OK;
}

/* Own shear, then the field's; with a series, the own shear alone. */
static int pose_of(const struct view *v, const struct emitter *s, struct pose *q)
{
    const double own[2] = {s->g1, s->g2}, field[2] = {v->g1, v->g2};
    double g[2] = {v->shear_order ? s->g1 : v->g1, v->shear_order ? s->g2 : v->g2}, turn = 0;
    if (!v->shear_order && (s->g1 != 0 || s->g2 != 0)) {
        int st = shear_then(own, field, g, &turn);
        if (st)
            return st;
    }
    *q = (struct pose){s->rotation + turn, g[0], g[1], hypot(g[0], g[1])};
    return q->g < 1 ? OK : E_RANGE;
}

/* Everything the decision about one object needs, reused for all. */
struct maker {
    struct plan *p;
    struct envelope env;
    double shells[SHAPELET_NMAX + 1];
    double group_tol;      /* electrons, for the parts of one object */
    double group_norm;     /* sum of sqrt |flux| of its parts */
    int group_left;        /* parts still to come */
    int used[CLASSES];     /* objects of a class of sides, or of periods; then its grid number + 1 */
    double top[CLASSES];   /* highest frequency step that an object of the class keeps */
};

/* Period of a class of long ones, in pixels. */
static double period_of(int class)
{
    return ldexp(64, class - SIDES);
}

/* Its grid: side, and pixels in arcsec. */
static int class_side(int class)
{
    return class < SIDES ? side_of[class] : BROAD_SIDE;
}

static double class_pixel(const struct plan *p, int class)
{
    return class < SIDES ? p->view.pixel : p->view.pixel * period_of(class) / BROAD_SIDE;
}

static double stretch_of(double g)
{
    return sqrt((1 + g) / (1 - g));
}

/* Estimates that all decisions share, per object. */
struct light {
    double beta;           /* after dilation */
    double power;          /* sum c^2 after dilation, 1/arcsec^2 */
    double stretch;        /* largest, of all shears */
    double spread;         /* mean square radius weighted by brightness squared, arcsec^2 */
    double mixed;          /* integral of |brightness| over |flux|, about; 1 unless the signs are mixed */
    double peak;           /* lower estimate of the peak pixel, fraction of the flux */
    double tol;            /* allowed error of a pixel over |flux| */
};

/* Peak pixel of a star, fraction of its flux: between those on a centre and on a corner, as a Gaussian. */
static double star_peak(const struct wings *w, double x, double y)
{
    const double dx = x - floor(x + 0.5), dy = y - floor(y + 0.5), centre = w->w[0][0];
    return centre * pow(w->peak / centre, 2 * (dx * dx + dy * dy));
}

double light_peak(double power, double stretch, double pixel, double star)
{
    const double own = 1 / (1.6 * pixel * pixel * power), core = 1 / star, thin = stretch - 1 / stretch;
    /* sum c^2 is the mean brightness weighted by light: half the peak of a Gaussian, less of cuspier ones */
    return power > 0 ? 1 / sqrt((own + core) * (own + core) + own * core * thin * thin) : 0;   /* of an ellipse after a disc */
}

double light_size(double power)
{
    return 0.9 / sqrt(4 * M_PI * power);   /* of a Gaussian of that power, and a margin */
}

/*
 * Light of both signs: when 4 pi power spread, 1 of a Gaussian and below 6 of galaxies, is large after the PSF's core (each shell
 * smoothed as a disc in frequency that shells fill evenly on average), the peak is the rms of a patchwork of that extent and
 * the wings are those of |brightness|.
 */
static void mixed_light(const struct maker *m, int nmax, double core, struct light *l)
{
    const double theta2 = m->p->view.pixel * m->p->view.pixel, s2 = core * core / (l->beta * l->beta);
    double power = 0;
    for (int n = 0; n <= nmax; n++) {
        const double x = 2 * (n + 1) * s2;       /* (1 - e^-x) / x within 6 % */
        power += m->shells[n] * m->shells[n] * (1 + x / 6) / (1 + x * (2 + x / 2) / 3);
    }
    const double mix = 4 * M_PI * power * (l->spread + core * core);
    l->peak = fmin(l->peak, theta2 * power * fmin(2.6, 1.6 / sqrt(fmax(0.1, mix - 2))));
    l->mixed = sqrt(fmax(1, mix - 3));
}

static int light_of(struct maker *m, const struct emitter *s, const struct pose *q, struct light *l)
{
    const struct plan *p = m->p;
    double star = p->view.psf ? star_peak(&p->wings, s->x, s->y) : 1;
    *l = (struct light){.beta = s->beta * s->dilation, .stretch = stretch_of(q->g), .mixed = 1, .peak = star};
    if (p->view.shear_order)
        l->stretch *= stretch_of(hypot(p->view.g1, p->view.g2));
    if (s->coef) {
        envelope_shells(s->nmax, s->coef, m->shells);
        for (int n = 0; n <= s->nmax; n++) {
            m->shells[n] /= s->dilation;
            l->power += m->shells[n] * m->shells[n];
            l->spread += (n + 1) * m->shells[n] * m->shells[n];
        }
        if (l->power > 0)
            l->spread *= l->beta * l->beta / l->power;
        l->peak = light_peak(l->power, l->stretch, p->view.pixel, star);
        if (4 * M_PI * l->power * l->spread > 6)
            mixed_light(m, s->nmax, p->view.psf ? p->view.pixel / sqrt(2 * M_PI * star) : 0, l);
    }
    l->tol = fmax(p->acc.eps * l->peak, p->acc.floor / fabs(s->flux));
    if (m->group_left > 0)
        l->tol = m->group_tol / (m->group_norm * sqrt(fabs(s->flux)));
    return l->tol > 0 && l->beta >= 0 && isfinite(l->beta) && isfinite(l->power) ? OK : E_DATA;
}

/* Radius, arcsec, beyond which the object's own light stays below its share. */
static double own_reach(const struct maker *m, const struct emitter *s, const struct light *l)
{
    const double theta2 = m->p->view.pixel * m->p->view.pixel;
    double limit = m->p->acc.edge * l->tol * l->beta / theta2;
    return envelope_reach(&m->env, s->nmax, m->shells, limit) * l->beta * l->stretch;
}

/* ---- coefficient-space shear ---- */

/* Even number of orders to add so that the cut stays below its share of the tolerance. */
static int growth_of(const struct plan *p, const struct emitter *s, const struct light *l, double g)
{
    const double theta2 = p->view.pixel * p->view.pixel;
    double eps = p->acc.shear * l->tol / (theta2 * l->power + 1e-300);
    eps = eps > 0.1 ? 0.1 : eps < 1e-15 ? 1e-15 : eps;
    int grow = shear_growth(s->nmax, g, eps);
    return grow < 2 ? 2 : (grow + 1) & ~1;
}

/* Number of the matrix (nmax -> nout) of the field's shear, made when new; -1 when there is no memory. */
static int matrix_for(struct plan *p, int nmax, int nout)
{
    for (int i = 0; i < p->n_matrix; i++)
        if (p->matrix[i].nmax == nmax && p->matrix[i].nout == nout)
            return i;
    if (p->n_matrix == 256)
        return -1;
    struct matrix *grown = realloc(p->matrix, ((size_t)p->n_matrix + 1) * sizeof *grown);
    if (!grown)
        return -1;
    p->matrix = grown;
    const size_t in = shapelet_count(nmax), out = shapelet_count(nout);
    double *m = malloc(in * out * sizeof *m), *unit = calloc(in + out, sizeof *unit);
    int st = m && unit ? OK : E_NOMEM;
    if (st == OK && p->view.shear_order == 0)
        st = shear_matrix_coeff(nmax, nout, p->view.g1, p->view.g2, m);
    for (size_t j = 0; st == OK && p->view.shear_order && j < in; j++) {
        unit[j] = 1;
        st = shear_series(nmax, unit, p->view.g1, p->view.g2, p->view.shear_order, unit + in);
        unit[j] = 0;
        for (size_t i = 0; i < out; i++)
            m[i * in + j] = unit[in + i];
    }
    free(unit);
    if (st) {
        free(m);
        return -1;
    }
    p->matrix[p->n_matrix] = (struct matrix){nmax, nout, m};
    p->bytes += (double)(in * out) * sizeof *m;
    return p->n_matrix++;
}

/* How the shear of one object is done: fills mapped, matrix, grown of d. */
static int choose_shear(struct plan *p, const struct emitter *s, const struct pose *q, const struct light *l,
                        struct draw *d)
{
    const int shared = s->g1 == 0 && s->g2 == 0;
    if (p->view.shear_order) {
        int n = s->nmax;
        if (!shared && q->g > 0) {
            n += growth_of(p, s, l, q->g);
            if (n > p->acc.order_max)
                n = p->acc.order_max;
            d->grown = (short)(n > s->nmax ? n : s->nmax);
            n = d->grown;
        }
        int field = p->view.g1 != 0 || p->view.g2 != 0;
        if (field)
            d->matrix = (short)matrix_for(p, n, n + 2 * p->view.shear_order);
        return field && d->matrix < 0 ? E_DATA : OK;
    }
    if (q->g == 0 || q->g2 == 0)           /* along the axes: two scales, exact */
        return OK;
    int n = s->nmax + growth_of(p, s, l, q->g);
    if (n > p->acc.order_max || (p->view.psf && q->g > p->acc.g_matrix)) {
        d->mapped = 1;
        return s->nmax <= SHAPELET_ROTMAX ? OK : E_DATA;
    }
    if (shared)
        d->matrix = (short)matrix_for(p, s->nmax, n);
    else if (p->view.psf)
        d->mapped = 1;
    else
        d->grown = (short)n;
    if (shared && d->matrix < 0)
        d->mapped = 1;
    return OK;
}

/* ---- stamps ---- */

/* Square stamp of n pixels whose middle pixel holds the origin; 0 when it does not touch the image. */
static int place(const struct view *v, const struct emitter *s, int n, struct draw *d)
{
    if (!(fabs(s->x) < 1e8 && fabs(s->y) < 1e8))
        return 0;
    d->nx = d->ny = n;
    d->x0 = (int)floor(s->x + 0.5) - n / 2;
    d->y0 = (int)floor(s->y + 0.5) - n / 2;
    return d->x0 < v->nx && d->y0 < v->ny && d->x0 + n > 0 && d->y0 + n > 0;
}

/* Pixels of an axis of n that touch origin +- reach: first and number; 0 when none does. */
static int span(double origin, double reach, long n, int *first, int *count)
{
    double lo = fmax(ceil(origin - reach - 0.5), 0), hi = fmin(floor(origin + reach + 0.5), (double)n - 1);
    if (!(lo <= hi))
        return 0;
    *first = (int)lo;
    *count = (int)(hi - lo) + 1;
    return 1;
}

/* With a PSF: what an object needs of its stamp. */
struct need {
    double own;            /* arcsec: beyond it there is none of the object's light */
    double size, extent;   /* arcsec: of its finest structure, rms; of its light */
};

static struct need need_of(const struct maker *m, const struct emitter *s, const struct light *l)
{
    const struct plan *p = m->p;
    if (!s->coef)
        return (struct need){0};
    const double core = p->wings.core / (l->beta * l->stretch);
    struct need q = {.own = own_reach(m, s, l) * sqrt(1 + core * core) + (p->view.ipc > 0 ? p->view.pitch : 0),
                     .size = light_size(l->power)};
    q.extent = q.size * l->stretch;
    if (l->mixed > 1) {
        q.extent = sqrt(2 * l->spread) * l->stretch;
        q.size = fmin(q.size, l->beta * l->beta / (sqrt(2 * l->spread) * l->stretch));
    }
    return q;
}

/* A period of n pixels repeats nothing that counts. */
static int period_good(const struct plan *p, const struct need *q, const struct light *l, double n)
{
    const double half = (n / 2 - 1) * p->view.pixel;
    return half >= q->own && l->mixed * wings_folded(&p->wings, q->size, q->extent, half, n) <= p->acc.wing * l->tol;
}

/* Bound of the object's transform at frequency u, times the integral of |T| beyond. */
static double band_beyond(const struct maker *m, const struct emitter *s, const struct light *l, double u)
{
    double f = 1;
    if (s->coef)
        f = fmin(10 * l->mixed, 2 * M_PI * l->beta * envelope_value(&m->env, s->nmax, m->shells, 2 * M_PI * l->beta * u / l->stretch));
    return f * wings_tail(&m->p->wings, u);
}

/* Smallest i of 0..last for which nothing that counts is beyond the frequency i du. */
static int band_end(const struct maker *m, const struct emitter *s, const struct light *l, double du, int last)
{
    int lo = 0, hi = last;
    while (lo < hi) {
        const int mid = (lo + hi) / 2;
        if (band_beyond(m, s, l, mid * du) <= m->p->acc.band * l->tol)
            hi = mid;
        else
            lo = mid + 1;
    }
    return lo;
}

static void enlist(struct maker *m, struct draw *d, int class, double kcut)
{
    d->kcut = (float)kcut;
    d->grid = (short)class;                /* becomes the number of a grid later */
    m->used[class]++;
    m->top[class] = fmax(m->top[class], d->kcut);
}

/* CPU seconds for an object of k frequencies per axis. */
static double broad_cost(const struct emitter *s, const struct draw *d, double k, int turned)
{
    const double orders = s->coef ? s->nmax + 1 : 0, plane = 0.8 * k * k;
    const double rows = plane * (10e-9 + (turned ? 20e-9 + 2e-9 * orders : 0.25e-9 * orders));
    const double pieces = 1 + floor((double)d->nx * d->ny / PART_PIXELS);
    return pieces * (1e-5 + rows) + plane * BROAD_X * d->nx * pieces + k * BROAD_Y * d->nx * d->ny;
}

/* Longer period, fewer frequencies. *seconds: what it takes; infinite when it cannot be. Returns 0 outside the image. */
static int plan_broad(struct maker *m, const struct emitter *s, const struct light *l, const struct need *q, struct draw *d,
                      int *class, double *kcut, double *seconds)
{
    const struct plan *p = m->p;
    *seconds = INFINITY;
    for (*class = SIDES; *class < CLASSES; ++*class)
        if (period_good(p, q, l, period_of(*class)))
            break;
    if (*class == CLASSES)
        return 1;
    const double n = period_of(*class), half = n / 2;
    /* steps of the object's bound, of 1/8 in units of 1/beta, or of T's */
    const double own = s->coef ? l->stretch / (16 * M_PI * l->beta) : INFINITY, du = fmin(own, p->wings.du);
    const double last = own > du ? p->wings.nu : fmin(ceil(p->wings.nu * p->wings.du / du), (double)m->env.steps);
    *kcut = ceil(band_end(m, s, l, du, (int)last) * du * n * p->view.pixel) + 1;
    if (!span(s->x, half, p->view.nx, &d->x0, &d->nx) || !span(s->y, half, p->view.ny, &d->y0, &d->ny))
        return 0;
    if (*kcut < BROAD_KMAX)
        *seconds = broad_cost(s, d, *kcut, d->mapped);
    return 1;
}

/* With a PSF: class and frequencies. Returns 0 when the object does not reach the image or cannot be drawn. */
static int plan_fourier(struct maker *m, const struct emitter *s, const struct light *l, struct draw *d)
{
    struct plan *p = m->p;
    const struct need q = need_of(m, s, l);
    int side = 0, class, good;
    double kcut, seconds;
    d->path = PATH_FOURIER;
    while (!(good = period_good(p, &q, l, side_of[side])) && side < SIDES - 1 && side_of[side + 1] <= p->acc.side_max)
        side++;
    if (!good) {
        const int held = (side_of[side] / 2 - 1) * p->view.pixel >= q.own;
        if (!plan_broad(m, s, l, &q, d, &class, &kcut, &seconds))
            return 0;
        if (seconds < (held ? WINGS_LONGEST : LONGEST)) {
            d->path = PATH_BROAD;
            enlist(m, d, class, kcut);
            return 1;
        }
        if (!held) {
            p->n_bad++;
            d->grid = -1;
            return 0;
        }
    }
    if (!place(&p->view, s, side_of[side], d))
        return 0;
    p->n_short += !good;
    const int end = band_end(m, s, l, p->wings.du, p->wings.nu - 1);
    enlist(m, d, side, ceil(end * p->wings.du * side_of[side] * p->view.pixel) + 1);
    return 1;
}

/*
 * Nodes, at most, that the quadrature of a sheared object without a PSF takes (shear_pixels), and
 * CPU seconds for them.
 */
static double mapped_nodes(const struct emitter *s, double stretch)
{
    const double root = sqrt(2.0 * s->nmax + 1);
    return 2 * (root + 10) * (root + 4) * stretch * stretch;
}

static double mapped_cost(const struct emitter *s, double nodes)
{
    const double orders = s->nmax + 1;
    return 5e-6 + 1.5 * nodes * orders * (60e-9 + 0.6e-9 * orders);
}

/* Without a PSF. */
static int plan_direct(struct maker *m, const struct emitter *s, const struct pose *q, const struct light *l,
                       struct draw *d)
{
    const struct view *v = &m->p->view;
    if (!s->coef) {
        d->path = PATH_POINT;
        return place(v, s, 4, d);
    }
    double reach = own_reach(m, s, l) / v->pixel, rx = reach, ry = reach;
    if (q->g2 == 0 && !v->shear_order) {   /* along the axes */
        double e = sqrt((1 + q->g1) / (1 - q->g1));
        rx = reach / l->stretch * e;
        ry = reach / l->stretch / e;
    }
    d->path = d->mapped ? PATH_MAPPED : PATH_CLOSED;
    const double nodes = mapped_nodes(s, l->stretch);
    if (d->mapped && !(nodes < 1e7 && mapped_cost(s, nodes) < LONGEST)) {
        m->p->n_bad++;
        return 0;
    }
    return span(s->x, rx, v->nx, &d->x0, &d->nx) && span(s->y, ry, v->ny, &d->y0, &d->ny);
}

/* CPU seconds for one object; constants measured on one machine, good to a factor 2. */
static double cost_of(const struct plan *p, const struct emitter *s, const struct draw *d)
{
    double area = (double)d->nx * d->ny, orders = s->coef ? s->nmax + 1 : 0;
    if (d->matrix >= 0)
        orders = p->matrix[d->matrix].nout + 1;
    else if (d->grown)
        orders = d->grown + 1;
    double matrix = d->matrix >= 0 ? 0.2e-9 * (double)shapelet_count(s->nmax) * orders * orders : 0;
    if (d->grown)                          /* turned, squeezed and turned back */
        matrix += 0.55e-9 * orders * orders * orders;
    if (d->path == PATH_CLOSED)
        return 0.8e-6 + matrix + 0.14e-9 * orders * area + 5.6e-9 * orders * (d->nx + d->ny);
    if (d->path == PATH_MAPPED) {
        struct pose q;
        if (s->nmax == 0)
            return 50e-6 + 3.3e-6 * (d->nx + d->ny) + 35e-9 * area;
        return pose_of(&p->view, s, &q) ? 0 : mapped_cost(s, mapped_nodes(s, stretch_of(q.g)));
    }
    if (d->path == PATH_BROAD)
        return matrix + broad_cost(s, d, d->kcut, d->mapped);
    if (d->path != PATH_FOURIER)
        return 1e-7;
    const struct stamp_grid *g = &p->grid[d->grid];
    double k = fmin(d->kcut, g->kmax), plane = 0.8 * k * k;
    double rows = d->mapped ? plane * (20e-9 + 2e-9 * orders) : plane * (0.25e-9 * orders + 1.5e-9);
    if (g->columns)
        rows += 6e-9 * plane;              /* rows of T, made for this stamp */
    double pixel = 0.55e-9 + 0.18e-9 * log2(d->nx);
    if (area > 6e5)                        /* beyond the caches */
        pixel *= 1.8;
    if (plan_single(p, (size_t)(d - p->draw)))
        return 1e-6 + matrix + 0.3 * rows + 0.8e-9 * orders * orders * k / 8 + 0.4 * area * pixel;
    return 1.5e-6 + matrix + rows * g->parts + 1e-9 * orders * orders * k / 8 + area * pixel;
}

/* Tolerance of an object of several parts: from the sum of their peaks, divided as the square root of flux. */
static void start_group(struct maker *m, size_t i)
{
    const struct plan *p = m->p;
    const struct emitter *s = &p->emitter[i];
    double peak = 0;
    m->group_norm = 0;
    for (int k = 0; k < s->parts && i + (size_t)k < p->n; k++) {
        struct pose q;
        struct light l;
        if (!isfinite(s[k].flux) || pose_of(&p->view, &s[k], &q))
            continue;
        if (light_of(m, &s[k], &q, &l) == OK)
            peak += l.peak * fabs(s[k].flux);
        m->group_norm += sqrt(fabs(s[k].flux));
    }
    m->group_tol = fmax(p->acc.eps * peak, p->acc.floor);
    m->group_left = s->parts;
}

static int plan_one(struct maker *m, size_t i)
{
    struct plan *p = m->p;
    const struct emitter *s = &p->emitter[i];
    struct draw *d = &p->draw[i];
    struct pose q;
    struct light l;
    d->matrix = -1;
    if (!isfinite(s->flux) || !isfinite(s->rotation) || isnan(s->x) || isnan(s->y)
        || (s->coef && (!(s->beta > 0) || !(s->dilation > 0))) || pose_of(&p->view, s, &q))
        return E_DATA;
    if (s->flux == 0 || isinf(s->x) || isinf(s->y))
        return OK;
    if (light_of(m, s, &q, &l))
        return s->coef && l.power == 0 ? OK : E_DATA;
    if (s->coef) {
        if (q.turn != 0 && s->nmax > SHAPELET_ROTMAX)
            return E_DATA;
        int st = choose_shear(p, s, &q, &l, d);
        if (st)
            return st;
    }
    if (p->view.psf) {
        if (!plan_fourier(m, s, &l, d))
            d->path = PATH_NONE;
    } else if (!plan_direct(m, s, &q, &l, d)) {
        d->path = PATH_NONE;
    }
    return OK;
}

/* Highest order after shear, for scratch memory; and the rotation table when something is turned. */
static int finish_orders(struct maker *m)
{
    struct plan *p = m->p;
    int turned = -1;
    for (size_t i = 0; i < p->n; i++) {
        const struct emitter *s = &p->emitter[i];
        if (!s->coef || p->draw[i].path == PATH_NONE)
            continue;
        int n = p->draw[i].matrix >= 0 ? p->matrix[p->draw[i].matrix].nout : s->nmax;
        n = p->draw[i].grown > n ? p->draw[i].grown : n;
        p->nmax = n > p->nmax ? n : p->nmax;
        if ((s->rotation != 0 || s->g1 != 0 || s->g2 != 0) && s->nmax > turned)
            turned = s->nmax;
    }
    p->rotation_nmax = turned;
    if (turned < 0)
        return OK;
    p->rotation = malloc(shapelet_rotation_count(turned) * sizeof *p->rotation);
    if (!p->rotation)
        return E_NOMEM;
    return shapelet_rotation_table(turned, p->rotation);
}

struct stamp_response view_response(const struct view *v)
{
    struct stamp_response r = {.diffusion = v->diffusion, .ipc = v->ipc, .pitch = v->pitch, .edge = {v->edge[0], v->edge[1]}};
    if (!v->no_pixel) {
        r.box = v->box[0] > 0 ? v->box[0] : v->pixel;
        r.box_y = v->box[1];
    }
    return r;
}

/* A class's transfer function: a view of the PSF's with a lower cut-off, so that no frequency is tabulated that nobody keeps. */
static struct otf class_otf(const struct maker *m, int class)
{
    struct otf t = *m->p->view.psf;
    t.ucut = fmin(t.ucut, (m->top[class] + 1) / (class_side(class) * class_pixel(m->p, class)));
    return t;
}

/* Which classes get a table: those with most stamps, as long as the tables fit. */
static void choose_tables(const struct maker *m, int table[CLASSES])
{
    const struct plan *p = m->p;
    const int complex_t = !otf_is_real(p->view.psf);
    double left = TABLE_BYTES;
    memset(table, 0, CLASSES * sizeof *table);
    for (;;) {
        int best = -1;
        for (int class = 0; class < CLASSES; class++)
            if (m->used[class] && !table[class] && (best < 0 || m->used[class] > m->used[best]))
                best = class;
        if (best < 0)
            return;
        const struct otf t = class_otf(m, best);
        const double bytes = stamp_grid_bytes(t.ucut, class_pixel(p, best), class_side(best), complex_t);
        table[best] = !t.sre || bytes <= left ? 1 : -1;
        left -= table[best] > 0 ? bytes : 0;
    }
}

/* Parts of a stamp of n x n: the fewest that PART_PIXELS allows. */
static int parts_of(int n)
{
    int parts = 1;
    while ((double)n * n > (double)PART_PIXELS * parts)
        parts *= 2;
    return parts;
}

/* Tables of the side classes in use; draw.grid becomes their numbers. */
static int finish_grids(struct maker *m)
{
    struct plan *p = m->p;
    const struct stamp_response r = view_response(&p->view);
    int table[CLASSES];
    p->grid = calloc(CLASSES, sizeof *p->grid);
    if (!p->grid)
        return E_NOMEM;
    choose_tables(m, table);
    for (int class = 0; class < CLASSES; class++) {
        if (!m->used[class])
            continue;
        const struct otf t = class_otf(m, class);
        const int n = class_side(class), parts = class < SIDES ? parts_of(n) : 1;
        int st = stamp_grid_lean(&p->grid[p->n_grid], &t, &r, class_pixel(p, class), n, parts, table[class] > 0);
        if (st)
            return st;
        p->fft_plans += class < SIDES;
        if (table[class] > 0)
            p->bytes += stamp_grid_bytes(t.ucut, class_pixel(p, class), n, !otf_is_real(p->view.psf));
        else
            p->lean = 1;
        m->used[class] = ++p->n_grid;
    }
    for (size_t i = 0; i < p->n; i++)
        if (p->draw[i].path == PATH_FOURIER || p->draw[i].path == PATH_BROAD)
            p->draw[i].grid = (short)(m->used[p->draw[i].grid] - 1);
    return OK;
}

static int make(struct maker *m)
{
    struct plan *p = m->p;
    int nmax = 0;
    for (size_t i = 0; i < p->n; i++) {
        if (p->emitter[i].coef && (p->emitter[i].nmax < 0 || p->emitter[i].nmax > SHAPELET_NMAX))
            return E_RANGE;
        if (p->emitter[i].coef && p->emitter[i].nmax > nmax)
            nmax = p->emitter[i].nmax;
    }
    int st = envelope_new(&m->env, nmax);
    if (st == OK && p->view.psf) {
        const struct stamp_response r = view_response(&p->view);
        st = wings_new(&p->wings, p->view.psf, &r, p->view.pixel, WINGS_WIDTH);
        p->fft_plans++;
    }
    for (size_t i = 0; i < p->n && st == OK; i++) {
        if (p->emitter[i].parts > 1)
            start_group(m, i);
        st = plan_one(m, i);
        m->group_left -= m->group_left > 0;
        if (st == E_DATA) {
            p->n_bad++;
            p->draw[i].path = PATH_NONE;
            st = OK;
        }
    }
    if (st == OK)
        st = finish_orders(m);
    if (st == OK && p->view.psf)
        st = finish_grids(m);
    for (size_t i = 0; i < p->n && st == OK; i++) {
        p->count[p->draw[i].path]++;
        p->cost += cost_of(p, &p->emitter[i], &p->draw[i]);
    }
    return st;
}

int scene_plan(struct plan *p, const struct view *v, const struct accuracy *a, size_t n,
               const struct emitter *emitter)
{
    if (v->nx < 1 || v->ny < 1 || v->nx > 65535 || v->ny > 65535 || !(v->pixel > 0) || !isfinite(v->pixel)
        || !(hypot(v->g1, v->g2) < 1) || v->shear_order < 0 || v->shear_order > 8 || !(a->eps > 0)
        || !(a->floor >= 0) || !(v->diffusion >= 0) || !(v->ipc >= 0) || !(v->pitch >= 0)
        || !(v->box[0] >= 0) || !(v->box[1] >= 0)
        || ((v->diffusion > 0 || v->ipc > 0 || v->box[0] > 0 || v->box[1] > 0) && !v->psf))
        return E_RANGE;
    struct plan made = {.view = *v, .acc = *a, .n = n, .emitter = emitter, .rotation_nmax = -1};
    struct maker m = {.p = &made};
    made.draw = calloc(n ? n : 1, sizeof *made.draw);
    made.bytes = (double)n * sizeof *made.draw;
    int st = made.draw ? make(&m) : E_NOMEM;
    envelope_free(&m.env);
    if (st)
        plan_free(&made);
    else
        *p = made;
    return st;
}

void plan_free(struct plan *p)
{
    for (int i = 0; i < p->n_grid; i++)
        stamp_grid_free(&p->grid[i]);
    for (int i = 0; i < p->n_matrix; i++)
        free(p->matrix[i].m);
    free(p->grid);
    free(p->matrix);
    free(p->rotation);
    free(p->draw);
    wings_free(&p->wings);
    *p = (struct plan){0};
}

size_t plan_scratch(const struct plan *p)
{
    return shapelet_count(p->nmax);
}

int plan_single(const struct plan *p, size_t i)
{
    const struct draw *d = &p->draw[i];
    const double flux = fabs(p->emitter[i].flux);           /* at least the peak */
    return d->path == PATH_FOURIER && !d->mapped && p->grid[d->grid].parts == 1 && p->grid[d->grid].t_re
           && flux > SINGLE_LEAST && flux < 1 / SINGLE_LEAST && (p->acc.eps >= SINGLE_EPS || p->acc.floor >= SINGLE_EPS * flux);
}

int plan_shape(const struct plan *p, size_t i, double *scratch, struct shape *s)
{
    const struct emitter *o = &p->emitter[i];
    const struct draw *d = &p->draw[i];
    const size_t n = plan_scratch(p);
    double *here = scratch, *next = scratch + n;
    struct pose q;
    *s = (struct shape){0};
    if (!o->coef)
        return OK;
    int st = pose_of(&p->view, o, &q);
    const size_t nc = shapelet_count(o->nmax);
    for (size_t k = 0; k < nc; k++)
        here[k] = o->coef[k] / o->dilation;
    if (o->parity < 0)
        shapelet_mirror(o->nmax, here);
    s->nmax = o->nmax;
    s->beta_x = s->beta_y = o->beta * o->dilation;
    if (st == OK && q.turn != 0) {
        st = shapelet_rotate_by(o->nmax, p->rotation, q.turn, here, next);
        here = next;
        next = scratch;
    }
    if (st == OK && d->grown) {
        st = shear_exact(o->nmax, here, q.g1, q.g2, d->grown, next);
        s->nmax = d->grown;
        double *swap = here;
        here = next;
        next = swap;
    }
    if (st == OK && d->matrix >= 0) {
        const struct matrix *m = &p->matrix[d->matrix];
        shear_apply(m->nmax, m->nout, m->m, here, next);
        s->nmax = m->nout;
        here = next;
    } else if (st == OK && d->mapped) {
        s->mapped = 1;
        st = shear_matrix(q.g1, q.g2, s->a);
    } else if (st == OK && !d->grown && q.g != 0 && !p->view.shear_order) {
        double e = sqrt((1 + q.g1) / (1 - q.g1));   /* g2 = 0 */
        s->beta_x *= e;
        s->beta_y /= e;
    }
    s->coef = here;
    return st;
}
