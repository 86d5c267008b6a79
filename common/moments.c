/*
 * moments.c - Gaussian-weighted moments of one object.
 *
 * A stamp round the object is copied once to double, sky subtracted.  Sums are
 * made column by column: A_k[x] = sum_y Wy ty^k I over the rows of the disc,
 * which vectorises without reordering a sum, then sum_x Wx tx^j A_k[x].
 * Cost: 5 multiply-adds per pixel for all 15 sums to 4th order.
 */
#include "moments.h"
#include "simd.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { GOOD = 0, BAD = 1, NEIGHBOUR = 2, MIRRORED = 3 };

/* A window of the image, clipped to it: pixel (x0 + i, y0 + j) is [j*nx + i]. */
struct stamp {
    long x0, y0, nx, ny;
    double *pix, *var;
    double *a[5];             /* column sums, nx each */
    double *state;            /* GOOD .. MIRRORED, nx*ny; doubles keep one block of scratch */
    double *other;            /* pixels of other labels, `neighbours` of them */
    size_t neighbours;
    int bad;                  /* there are blank pixels */
    long mx, my;              /* 2 x centre, rounded: mirror the masked pixels were filled with */
};

void moments_scratch_free(struct moments_scratch *s)
{
    free(s->mem);
    *s = (struct moments_scratch){0};
}

/* n pixels from `row` on, sky subtracted, and their variance. */
static void row_take(const struct moments_map *m, size_t row, long n, double sky, double sky_var,
                     double *restrict pix, double *restrict var)
{
    double per = m->gain > 0 ? 1 / m->gain : 0;
    if (m->pix64)
        for (long i = 0; i < n; i++)
            pix[i] = m->pix64[row + (size_t)i] - sky;
    else
        for (long i = 0; i < n; i++)
            pix[i] = (double)m->pix[row + (size_t)i] - sky;
    for (long i = 0; i < n; i++)
        var[i] = sky_var + per * (pix[i] > 0 ? pix[i] : 0);
}

/* Put the sky variance of the weight map in; blanks where the weight is none. */
static void row_weigh(const struct moments_map *m, size_t row, long n, double here, double sky_var,
                      double *restrict var, double *restrict state)
{
    for (long i = 0; i < n; i++) {
        double wt = (double)m->weight[row + (size_t)i];
        if (wt > 0 && isfinite(wt))
            var[i] += (m->weight_inverse ? 1 / wt : sky_var * here / wt) - sky_var;
        else
            state[i] = BAD;
    }
}

static long clip(double v, long lo, long hi)
{
    return v < (double)lo ? lo : v > (double)hi ? hi : (long)v;
}

/* Reserve and address the arrays of a window; its sides are set. */
static int stamp_reserve(struct stamp *st, struct moments_scratch *sc)
{
    size_t nx = (size_t)st->nx, n = nx * (size_t)st->ny, need = 4 * n + 5 * nx;
    if (need > sc->cap) {
        double *mem = realloc(sc->mem, (need + need / 2) * sizeof *mem);
        if (!mem)
            return E_NOMEM;
        sc->mem = mem;
        sc->cap = need + need / 2;
    }
    st->pix = sc->mem;
    st->var = st->pix + n;
    st->state = st->var + n;
    st->other = st->state + n;
    for (int k = 0; k < 5; k++)
        st->a[k] = st->other + n + (size_t)k * nx;
    return OK;
}

/* Cut the window that holds the disc of radius r about (cx, cy) and a margin. */
static int stamp_cut(struct stamp *st, const struct moments_map *m, const struct moments_object *o,
                     double cx, double cy, double r, struct moments_scratch *sc)
{
    double reach = r + 2 + 0.5 * o->w;
    st->x0 = clip(floor(cx - reach), 0, m->nx - 1);
    st->y0 = clip(floor(cy - reach), 0, m->ny - 1);
    st->nx = clip(ceil(cx + reach), 0, m->nx - 1) - st->x0 + 1;
    st->ny = clip(ceil(cy + reach), 0, m->ny - 1) - st->y0 + 1;
    if (stamp_reserve(st, sc))
        return E_NOMEM;
    st->neighbours = 0;
    st->bad = 0;
    st->mx = st->my = -1;

    size_t own = (size_t)clip(floor(o->y + 0.5), 0, m->ny - 1) * (size_t)m->nx +
                 (size_t)clip(floor(o->x + 0.5), 0, m->nx - 1);
    double here = m->weight && m->weight[own] > 0 ? (double)m->weight[own] : 1;
    memset(st->state, 0, (size_t)st->nx * (size_t)st->ny * sizeof *st->state);
    for (long j = 0; j < st->ny; j++) {
        size_t row = (size_t)(st->y0 + j) * (size_t)m->nx + (size_t)st->x0, k = (size_t)j * (size_t)st->nx;
        row_take(m, row, st->nx, o->sky, o->sky_var, st->pix + k, st->var + k);
        for (long i = 0; i < st->nx; i++)
            if (!isfinite(st->pix[k + (size_t)i]))
                st->state[k + (size_t)i] = BAD;
        if (m->weight)
            row_weigh(m, row, st->nx, here, o->sky_var, st->var + k, st->state + k);
        for (long i = 0; m->label && i < st->nx; i++)
            if (m->label[row + (size_t)i] > 0 && (double)m->label[row + (size_t)i] != o->label) {
                st->state[k + (size_t)i] = NEIGHBOUR;
                st->other[st->neighbours++] = (double)(k + (size_t)i);
            }
        for (long i = 0; i < st->nx; i++)
            if (st->state[k + (size_t)i] != GOOD) {
                st->bad |= st->state[k + (size_t)i] == BAD;
                st->pix[k + (size_t)i] = st->var[k + (size_t)i] = 0;
            }
    }
    return OK;
}

/* Fill the neighbours' pixels from the other side of (cx, cy), where that is free. */
static void stamp_mirror(struct stamp *st, double cx, double cy)
{
    long mx = lround(2 * cx), my = lround(2 * cy);
    if (!st->neighbours || (mx == st->mx && my == st->my))
        return;
    st->mx = mx;
    st->my = my;
    for (size_t n = 0; n < st->neighbours; n++) {
        size_t k = (size_t)st->other[n];
        long i = (long)k % st->nx, j = (long)k / st->nx;
        long u = mx - st->x0 - i - st->x0, v = my - st->y0 - j - st->y0;
        int in = u >= 0 && u < st->nx && v >= 0 && v < st->ny;
        size_t from = in ? (size_t)v * (size_t)st->nx + (size_t)u : k;
        int free_there = in && st->state[from] == GOOD;
        st->state[k] = free_there ? MIRRORED : NEIGHBOUR;
        st->pix[k] = free_there ? st->pix[from] : 0;
        st->var[k] = free_there ? st->var[from] : 0;
    }
}

/* Columns i0..i1-1 of row j (absolute) whose pixels are nearer than r to (cx, cy). */
static void disc_row(const struct stamp *st, long j, double cx, double cy, double r2, long *i0, long *i1)
{
    double ty = (double)j - cy, left = r2 - ty * ty;
    *i0 = *i1 = 0;
    if (!(left > 0))
        return;
    double half = sqrt(left);
    long a = (long)floor(cx - half), b = (long)ceil(cx + half);
    while (a <= b && !(((double)a - cx) * ((double)a - cx) + ty * ty < r2))
        a++;
    while (b >= a && !(((double)b - cx) * ((double)b - cx) + ty * ty < r2))
        b--;
    a = a < st->x0 ? st->x0 : a;
    b = b > st->x0 + st->nx - 1 ? st->x0 + st->nx - 1 : b;
    if (b >= a) {
        *i0 = a - st->x0;
        *i1 = b + 1 - st->x0;
    }
}

WIDE static void add3(long n, const double *restrict p, double f, double t, double *restrict a0,
                      double *restrict a1, double *restrict a2)
{
    double f1 = f * t, f2 = f1 * t;
    for (long i = 0; i < n; i++) {
        a0[i] += f * p[i];
        a1[i] += f1 * p[i];
        a2[i] += f2 * p[i];
    }
}

WIDE static void add2(long n, const double *restrict p, double f3, double f4, double *restrict a3,
                      double *restrict a4)
{
    for (long i = 0; i < n; i++) {
        a3[i] += f3 * p[i];
        a4[i] += f4 * p[i];
    }
}

/*
 * sum[k*5 + j] = sum over the disc of map exp(-t^2/2w^2) tx^j ty^k, j + k <= order
 * (2 or 4), about (cx, cy).
 */
static void disc_sums(const struct stamp *st, const double *map, double cx, double cy, double w, double r,
                      int order, double sum[25])
{
    double h = -0.5 / (w * w);
    long left = st->nx, right = 0;
    for (int k = 0; k <= order; k++)
        memset(st->a[k], 0, (size_t)st->nx * sizeof(double));
    for (long j = 0; j < st->ny; j++) {
        long i0, i1;
        disc_row(st, st->y0 + j, cx, cy, r * r, &i0, &i1);
        if (i1 <= i0)
            continue;
        double t = (double)(st->y0 + j) - cy, f = exp(h * t * t);
        const double *p = map + (size_t)j * (size_t)st->nx + (size_t)i0;
        add3(i1 - i0, p, f, t, st->a[0] + i0, st->a[1] + i0, st->a[2] + i0);
        if (order > 2)
            add2(i1 - i0, p, f * t * t * t, f * t * t * t * t, st->a[3] + i0, st->a[4] + i0);
        left = i0 < left ? i0 : left;
        right = i1 > right ? i1 : right;
    }
    memset(sum, 0, 25 * sizeof *sum);
    for (long i = left; i < right; i++) {
        double t = (double)(st->x0 + i) - cx, f = exp(h * t * t);
        double power[5] = {f, f * t, f * t * t, f * t * t * t, f * t * t * t * t};
        for (int k = 0; k <= order; k++)
            for (int j = 0; j + k <= order; j++)
                sum[k * 5 + j] += power[j] * st->a[k][i];
    }
}

/* Fractions of the weight inside the disc that are replaced (of[0]) and lost (of[1]); 1 if a blank is inside. */
static int disc_masked(const struct stamp *st, double cx, double cy, double w, double r, double of[2])
{
    double h = -0.5 / (w * w), all = 0, replaced = 0, lost = 0;
    int bad = 0;
    for (long j = 0; j < st->ny; j++) {
        long i0, i1;
        disc_row(st, st->y0 + j, cx, cy, r * r, &i0, &i1);
        double ty = (double)(st->y0 + j) - cy;
        for (long i = i0; i < i1; i++) {
            double t = (double)(st->x0 + i) - cx, f = exp(h * (t * t + ty * ty));
            double state = st->state[(size_t)j * (size_t)st->nx + (size_t)i];
            all += f;
            replaced += state == MIRRORED ? f : 0;
            lost += state == NEIGHBOUR ? f : 0;
            bad |= state == BAD;
        }
    }
    of[0] = all > 0 ? replaced / all : 0;
    of[1] = all > 0 ? lost / all : 0;
    return bad;
}

/* Smaller eigenvalue of 1 - J/w^2, J = (xx, xy, yy). */
static double smallest(const double j[3], double w)
{
    double a = 1 - j[0] / (w * w), b = -j[1] / (w * w), c = 1 - j[2] / (w * w);
    return 0.5 * (a + c) - sqrt(0.25 * (a - c) * (a - c) + b * b);
}

/* The next centroid step from the sums at the present centre. */
static void newton_step(const double sum[25], double w, double step[2])
{
    double s = sum[0], tx = sum[1] / s, ty = sum[5] / s;
    double j[3] = {sum[2] / s, sum[6] / s, sum[10] / s};
    step[0] = 2 * tx;
    step[1] = 2 * ty;
    if (smallest(j, w) >= SHAPE_SINGULAR_LIMIT) {
        double a = 1 - j[0] / (w * w), b = -j[1] / (w * w), c = 1 - j[2] / (w * w), d = a * c - b * b;
        step[0] = (c * tx - b * ty) / d;
        step[1] = (a * ty - b * tx) / d;
    }
    double len = hypot(step[0], step[1]);
    if (len > 0.5 * w) {
        step[0] *= 0.5 * w / len;
        step[1] *= 0.5 * w / len;
    }
}

/* The disc lies within the window, or the window ends where the image does. */
static int stamp_holds(const struct stamp *st, const struct moments_map *m, double cx, double cy, double r)
{
    return (cx - r >= (double)st->x0 || st->x0 == 0) && (cy - r >= (double)st->y0 || st->y0 == 0) &&
           (cx + r <= (double)(st->x0 + st->nx - 1) || st->x0 + st->nx == m->nx) &&
           (cy + r <= (double)(st->y0 + st->ny - 1) || st->y0 + st->ny == m->ny);
}

/* The box of whole pixels that holds the disc wherever in its pixel the centre is leaves the image. */
static int at_edge(const struct moments_map *m, double cx, double cy, double r)
{
    double half = floor(r) + 1;
    return floor(cx) - half < 0 || floor(cy) - half < 0 || ceil(cx) + half > (double)(m->nx - 1) ||
           ceil(cy) + half > (double)(m->ny - 1);
}

/* Move (x, y) of `out` to the weighted centroid; sets SHIFT, NOCONV, NOFLUX. */
static int centre(struct stamp *st, const struct moments_map *m, const struct moments_object *o,
                  const struct moments_options *opt, double r, struct moments_scratch *sc, struct moments *out)
{
    double best = INFINITY;
    int settled = 0;
    for (out->steps = 0; out->steps < opt->max_steps && !settled; out->steps++) {
        double sum[25], step[2];
        if (!stamp_holds(st, m, out->x, out->y, r) && stamp_cut(st, m, o, out->x, out->y, r, sc))
            return E_NOMEM;
        if (out->steps < 5)               /* later the filling stays, or it could alternate for ever */
            stamp_mirror(st, out->x, out->y);
        disc_sums(st, st->pix, out->x, out->y, o->w, r, 2, sum);
        if (!(sum[0] > 0)) {
            out->flags |= SHAPE_NOFLUX;
            return OK;
        }
        newton_step(sum, o->w, step);
        double len = hypot(step[0], step[1]);
        settled = len < opt->tol;
        /* pixels that enter and leave the disc can make the last 1e-3 px alternate: halve the steps then */
        double damp = out->steps > 10 && !(len < 0.9 * best) ? 0.5 : 1;
        best = len < best ? len : best;
        double x = out->x + damp * step[0], y = out->y + damp * step[1];
        if (!(x > -0.5 && y > -0.5 && x < (double)m->nx - 0.5 && y < (double)m->ny - 0.5))
            break;                        /* wandered off the image */
        out->x = x;
        out->y = y;
        if (hypot(x - o->x, y - o->y) > fmax(2 * o->w, 2)) {
            out->flags |= SHAPE_SHIFT;
            return OK;
        }
    }
    if (!settled)
        out->flags |= SHAPE_NOCONV;
    return OK;
}

/* J from the sums. */
static void set_moments(const double sum[25], struct moments *out)
{
    double s = out->s = sum[0];
    for (int k = 0; k < 3; k++)
        out->m2[k] = sum[k * 5 + 2 - k] / s;
    for (int k = 0; k < 4; k++)
        out->m3[k] = sum[k * 5 + 3 - k] / s;
    for (int k = 0; k < 5; k++)
        out->m4[k] = sum[k * 5 + 4 - k] / s;
}

/* Covariance of m2 from the sums of W^2 v. */
static void set_errors(const double sum[25], struct moments *out)
{
    double s2 = out->s * out->s, v2[3] = {sum[2], sum[6], sum[10]};
    double v4[6] = {sum[4], sum[8], sum[12], sum[12], sum[16], sum[20]};
    int n = 0;
    out->s_var = sum[0];
    for (int a = 0; a < 3; a++)
        for (int b = a; b < 3; b++, n++)
            out->cov[n] = (v4[n] - out->m2[a] * v2[b] - out->m2[b] * v2[a] +
                           out->m2[a] * out->m2[b] * sum[0]) / s2;
}

static void set_empty(struct moments *out)
{
    out->s = out->s_var = NAN;
    for (int k = 0; k < 6; k++)
        out->cov[k] = NAN;
    for (int k = 0; k < 5; k++)
        out->m4[k] = NAN;
    for (int k = 0; k < 4; k++)
        out->m3[k] = NAN;
    for (int k = 0; k < 3; k++)
        out->m2[k] = NAN;
}

/* Moments of one width in a window that was cut for it or for more, or that is still empty. */
static int measure(struct stamp *st, const struct moments_map *map, const struct moments_object *obj,
                   const struct moments_options *opt, struct moments_scratch *scratch, struct moments *out)
{
    struct moments m = {.x = obj->x, .y = obj->y, .w = obj->w};
    double r = opt->cut * obj->w;
    int inside = obj->x > -0.5 && obj->y > -0.5 && obj->x < (double)map->nx - 0.5 && obj->y < (double)map->ny - 0.5;
    if (!stamp_holds(st, map, m.x, m.y, r) && stamp_cut(st, map, obj, m.x, m.y, r, scratch))
        return E_NOMEM;
    stamp_mirror(st, m.x, m.y);
    if (inside && !opt->fixed_centre && centre(st, map, obj, opt, r, scratch, &m))
        return E_NOMEM;
    if (!stamp_holds(st, map, m.x, m.y, r)) {
        if (stamp_cut(st, map, obj, m.x, m.y, r, scratch))
            return E_NOMEM;
        stamp_mirror(st, m.x, m.y);
    }
    if (at_edge(map, m.x, m.y, r))
        m.flags |= SHAPE_EDGE;
    if (st->bad || st->neighbours) {
        double of[2];
        if (disc_masked(st, m.x, m.y, m.w, r, of))
            m.flags |= SHAPE_BADPIX;
        if (of[0] + of[1] > 0.10 || of[1] > 0.01)
            m.flags |= SHAPE_CROWDED;
        m.masked = of[0] + of[1];
    }

    double sum[25];
    disc_sums(st, st->pix, m.x, m.y, m.w, r, 4, sum);
    if (!inside || (m.flags & SHAPE_NOFLUX) || !(sum[0] > 0)) {
        m.flags |= SHAPE_NOFLUX;
        set_empty(&m);
        *out = m;
        return OK;
    }
    set_moments(sum, &m);
    if (!opt->no_errors) {
        disc_sums(st, st->var, m.x, m.y, m.w * M_SQRT1_2, r, 4, sum);
        for (int k = 0; k < 25 && map->noise_cor > 0; k++)
            sum[k] *= map->noise_cor * map->noise_cor;
        set_errors(sum, &m);
    }
    if (!(smallest(m.m2, m.w) >= SHAPE_SINGULAR_LIMIT))
        m.flags |= SHAPE_NEARSINGULAR;
    *out = m;
    return OK;
}

static int measurable(const struct moments_map *map, const struct moments_object *o, const struct moments_options *opt)
{
    return o->w > 0 && isfinite(o->w) && opt->cut > 0 && isfinite(o->x) && isfinite(o->y) && map->nx > 0 &&
           map->ny > 0 && isfinite(opt->cut * o->w);
}

int moments_measure(const struct moments_map *map, const struct moments_object *obj,
                    const struct moments_options *opt, struct moments_scratch *scratch, struct moments *out)
{
    struct stamp st = {0};
    return measurable(map, obj, opt) ? measure(&st, map, obj, opt, scratch, out) : E_RANGE;
}

int moments_series(const struct moments_map *map, const struct moments_object *obj, int n, const double *w,
                   const struct moments_options *opt, struct moments_scratch *scratch, struct moments *out)
{
    struct stamp st = {0};
    struct moments_object o = *obj;
    int bad = OK;
    for (int k = n - 1; k >= 0 && bad == OK; k--) {       /* the widest window serves the others */
        o.w = w[k];
        bad = measurable(map, &o, opt) ? measure(&st, map, &o, opt, scratch, &out[k]) : E_RANGE;
    }
    return bad;
}
