/*
 * psf.c - image, profile, width, encircled energy and weighted moments of a
 * transfer function, all as sums over its nodes.
 *
 * Round averages need T only by |u|: nodes are summed by i^2 + j^2 first, so
 *   profile(r) = du^2 sum_q S_q J0(2 pi r du sqrt q),
 *   inside(r)  = du^2 sum_q S_q r J1(2 pi r du sqrt q) / (du sqrt q).
 */
#include "psf.h"
#include "simd.h"
#include "fft.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* T on a regular grid, n x n (n odd), centred on u = 0, to be multiplied by f[i] f[j]. */
struct nodes {
    int n;
    double du;
    double *re, *im;           /* im NULL when T is real */
    double *f;                 /* factors along an axis; 0 beyond the cut-off */
    int borrowed;              /* re and im belong to the transfer function */
};

static void nodes_free(struct nodes *g)
{
    if (!g->borrowed) {
        free(g->re);
        free(g->im);
    }
    free(g->f);
}

double psf_period(const struct otf *t)
{
    if (t->n)
        return 1 / t->du;
    return 2 * t->scale * (t->nx_p > t->ny_p ? t->nx_p : t->ny_p);
}

/* Factors along an axis for n nodes du apart. */
static double *axis_factors(const struct otf *t, double diffusion, double pixel, int n, double du, double *u)
{
    double *f = malloc((size_t)n * sizeof *f);
    if (!f)
        return NULL;
    for (int i = 0; i < n; i++) {
        u[i] = (i - n / 2) * du;
        f[i] = fabs(u[i]) <= t->ucut * (1 + 1e-12);
    }
    if (diffusion > 0)
        otf_diffusion(n, u, diffusion, f);
    if (pixel > 0)
        otf_box(n, u, pixel, f);
    return f;
}

/* `finer` = 2 halves the spacing of the nodes of samples; only |u_x|, |u_y| <= reach are wanted of them. */
static int nodes_fine(const struct otf *t, double diffusion, double pixel, int finer, double reach, struct nodes *made)
{
    if (!(diffusion >= 0) || !isfinite(diffusion) || !(pixel >= 0) || !isfinite(pixel) || (!t->n && !t->p))
        return E_RANGE;
    struct nodes g = {.n = t->n, .du = t->du, .re = t->re, .im = t->im, .borrowed = 1};
    if (t->p) {
        g.du = 1 / psf_period(t) / finer;
        double half = floor(fmin(t->ucut, reach) / g.du + 1e-9);
        if (!(half < 8192))
            return E_RANGE;
        g.n = 2 * (int)half + 1;
    }
    double *u = malloc((size_t)g.n * sizeof *u);
    g.f = u ? axis_factors(t, diffusion, pixel, g.n, g.du, u) : NULL;
    int status = g.f ? OK : E_NOMEM;
    if (status == OK && t->p) {
        size_t bytes = (size_t)g.n * (size_t)g.n * sizeof *g.re;
        g.re = malloc(bytes);
        g.im = malloc(bytes);
        g.borrowed = 0;
        status = g.re && g.im ? otf_grid(t, g.n, u, g.n, u, g.re, g.im) : E_NOMEM;
    }
    free(u);
    if (status)
        nodes_free(&g);
    else
        *made = g;
    return status;
}

static int nodes_make(const struct otf *t, double diffusion, double pixel, struct nodes *made)
{
    return nodes_fine(t, diffusion, pixel, 1, INFINITY, made);
}

/* Nodes beyond which all are below 1e-6 of T(0): half side. */
static int nodes_extent(const struct nodes *g)
{
    int h = g->n / 2, keep = 0;
    double least = 1e-6 * fabs(g->re[(size_t)h * (size_t)g->n + (size_t)h] * g->f[h] * g->f[h]);
    for (int j = -h; j <= h; j++)
        for (int i = -h; i <= h; i++) {
            size_t at = (size_t)(j + h) * (size_t)g->n + (size_t)(i + h);
            int reach = abs(i) > abs(j) ? abs(i) : abs(j);
            if (reach > keep && hypot(g->re[at], g->im ? g->im[at] : 0) * fabs(g->f[j + h] * g->f[i + h]) >= least)
                keep = reach;
        }
    return keep < h ? keep + 1 : h;
}

/* The inner n x n values of one plane times the factors, allocated. */
static double *nodes_plane(const struct nodes *g, const double *v, int n)
{
    double *out = malloc((size_t)n * (size_t)n * sizeof *out);
    int skip = (g->n - n) / 2;
    for (int j = 0; out && j < n; j++)
        for (int i = 0; i < n; i++)
            out[(size_t)j * (size_t)n + (size_t)i] = v[(size_t)(j + skip) * (size_t)g->n + (size_t)(i + skip)] *
                                                     g->f[j + skip] * g->f[i + skip];
    return out;
}

int psf_table(const struct otf *t, double diffusion, double pixel, struct otf *out)
{
    struct nodes g;
    if (pixel > 0 && t->pixel > 0)
        return E_RANGE;
    int status = nodes_fine(t, diffusion, pixel, 2, INFINITY, &g);
    if (status)
        return status;
    int n = t->p ? 2 * nodes_extent(&g) + 1 : g.n;
    double ucut = t->p ? fmin(t->ucut, (n / 2) * g.du) : t->ucut;
    double *re = nodes_plane(&g, g.re, n), *im = g.im ? nodes_plane(&g, g.im, n) : NULL;
    struct otf made = {0};
    status = re && (im || !g.im) ? otf_nodes(&made, n, g.du, ucut, re, im) : E_NOMEM;
    nodes_free(&g);
    if (status) {
        free(re);
        free(im);
        return status;
    }
    made.chdiff = hypot(t->chdiff, diffusion);
    made.pixel = fmax(t->pixel, pixel);
    *out = made;
    return OK;
}

int psf_image(const struct otf *t, double diffusion, double pixel, int nx, int ny, double scale, double *image)
{
    if (nx < 1 || ny < 1 || !(scale > 0) || !((nx > ny ? nx : ny) * scale <= psf_period(t)))
        return E_RANGE;
    struct nodes g;
    int status = nodes_make(t, diffusion, pixel, &g);
    if (status)
        return status;
    /*
     * T(-u) is the conjugate of T(u): the rows u_y > 0 count twice, the others not at all.  Nodes on the cut-off itself,
     * where the T of samples need not vanish, count half: the sum then gives those samples back.
     */
    int h = g.n / 2;
    if (h > 0 && h * g.du >= t->ucut * (1 - 1e-9)) {
        g.f[0] *= 0.5;
        g.f[2 * h] *= 0.5;
    }
    size_t pixels = (size_t)nx * (size_t)ny;
    double *in = malloc(2 * (size_t)(h + 1) * (size_t)g.n * sizeof *in), *out = malloc(2 * pixels * sizeof *out);
    status = in && out ? OK : E_NOMEM;
    for (int j = 0; status == OK && j <= h; j++)
        for (int i = 0; i < g.n; i++) {
            size_t from = (size_t)(j + h) * (size_t)g.n + (size_t)i, to = (size_t)j * (size_t)g.n + (size_t)i;
            double f = (j ? 2 : 1) * g.f[j + h] * g.f[i];
            in[2 * to] = f * g.re[from];
            in[2 * to + 1] = g.im ? f * g.im[from] : 0;
        }
    if (status == OK) {
        struct fft_grid from = {g.n, h + 1, -h, 0}, to = {nx, ny, -(nx - 1) / 2.0, -(ny - 1) / 2.0};
        status = fft_zoom(&from, in, &to, out, g.du * scale, g.du * scale, +1);
    }
    double area = g.du * scale * g.du * scale;
    for (size_t i = 0; status == OK && i < pixels; i++)
        image[i] = out[2 * i] * area;
    free(in);
    free(out);
    nodes_free(&g);
    return status;
}

/* Round sums: S[k] at u[k] = du sqrt q, for the q that occur with S != 0; S includes du^2. */
struct rings {
    size_t n;
    double *u, *s;
};

static void rings_free(struct rings *r)
{
    free(r->u);
    free(r->s);
}

static int rings_make(const struct otf *t, double diffusion, double pixel, struct rings *made)
{
    struct nodes g;
    int status = nodes_make(t, diffusion, pixel, &g);
    if (status)
        return status;
    size_t h = (size_t)g.n / 2, q_count = 2 * h * h + 1;
    struct rings r = {.u = malloc(q_count * sizeof *r.u), .s = calloc(q_count, sizeof *r.s)};
    if (!r.u || !r.s) {
        rings_free(&r);
        nodes_free(&g);
        return E_NOMEM;
    }
    for (int j = 0; j < g.n; j++)
        for (int i = 0; i < g.n; i++) {
            long x = i - (long)h, y = j - (long)h;
            r.s[x * x + y * y] += g.re[(size_t)j * (size_t)g.n + (size_t)i] * g.f[j] * g.f[i];
        }
    for (size_t q = 0; q < q_count; q++)
        if (r.s[q] != 0) {
            r.u[r.n] = g.du * sqrt((double)q);
            r.s[r.n++] = r.s[q] * g.du * g.du;
        }
    nodes_free(&g);
    *made = r;
    return OK;
}

static double rings_profile(const struct rings *r, double radius)
{
    double sum = 0, k = 2 * M_PI * radius;
    for (size_t i = 0; i < r->n; i++)
        sum += r->s[i] * j0(k * r->u[i]);
    return sum;
}

static double rings_inside(const struct rings *r, double radius)
{
    double sum = 0, k = 2 * M_PI * radius;
    for (size_t i = 0; i < r->n; i++)
        sum += r->s[i] * (r->u[i] > 0 ? j1(k * r->u[i]) / r->u[i] : M_PI * radius);
    return sum * radius;
}

/* out[i] = value(rings, radius[i]) for radii up to `part` of the period. */
static int at_radii(const struct otf *t, double diffusion, double pixel, int n, const double *radius, double part,
                    double (*value)(const struct rings *, double), double *out)
{
    for (int i = 0; i < n; i++)
        if (!(radius[i] >= 0 && radius[i] <= psf_period(t) * part))
            return E_RANGE;
    struct rings r;
    int status = rings_make(t, diffusion, pixel, &r);
    if (status)
        return status;
    for (int i = 0; i < n; i++)
        out[i] = value(&r, radius[i]);
    rings_free(&r);
    return OK;
}

int psf_profile(const struct otf *t, double diffusion, double pixel, int n, const double *radius, double *mean)
{
    return at_radii(t, diffusion, pixel, n, radius, 0.25, rings_profile, mean);
}

int psf_encircled(const struct otf *t, double diffusion, double pixel, int n, const double *radius, double *inside)
{
    return at_radii(t, diffusion, pixel, n, radius, 0.5, rings_inside, inside);
}

/*
 * Steps of a quarter of the finest detail outwards until the profile is below half, then
 * the Illinois variant of regula falsi to 1e-9 of the radius.
 */
static int half_radius(const struct rings *r, double limit, double *radius)
{
    double peak = rings_profile(r, 0), finest = 0;
    for (size_t i = 0; i < r->n; i++)
        if (fabs(r->s[i]) > 1e-6 * fabs(r->s[0]))
            finest = r->u[i];
    if (!(peak > 0) || !(finest > 0))
        return E_NOCONV;
    double step = 0.25 / finest, a = 0, fa = peak / 2, b = step, fb;
    while ((fb = rings_profile(r, b) - peak / 2) > 0) {
        a = b;
        fa = fb;
        b += fmax(step, b / 8);
        if (!(b <= limit))
            return E_NOCONV;
    }
    for (int i = 0; i < 60 && b - a > 1e-9 * b; i++) {
        double c = (a * fb - b * fa) / (fb - fa), fc = rings_profile(r, c) - peak / 2;
        if (fc > 0) {
            a = c;
            fa = fc;
            fb /= 2;
        } else {
            b = c;
            fb = fc;
            fa /= 2;
        }
        if (fc == 0)
            a = b = c;
    }
    *radius = (a + b) / 2;
    return OK;
}

int psf_fwhm(const struct otf *t, double diffusion, double pixel, double *fwhm)
{
    struct rings r;
    int status = rings_make(t, diffusion, pixel, &r);
    if (status)
        return status;
    double radius;
    status = half_radius(&r, psf_period(t) / 4, &radius);
    rings_free(&r);
    if (status == OK)
        *fwhm = 2 * radius;
    return status;
}

int psf_moment_index(int a, int b)
{
    int n = a + b;
    return n * (n + 1) / 2 + b;
}

/*
 * Transforms of x^a W(x), a = 0..4, at each u, times the factors, with the shift to x0: f[2*a*n + i], imaginary parts n behind,
 * int x^a exp(-x^2/2w^2 + 2 pi i u (x + x0)) dx; 0 where the Gaussian is below 1e-40.
 */
static void weight_terms(const struct nodes *grid, double w, double x0, double *f)
{
    int n = grid->n;
    for (int i = 0; i < n; i++) {
        double u = (i - n / 2) * grid->du, k = 2 * M_PI * u, s = w * w * k;
        double g = grid->f[i] * w * sqrt(2 * M_PI) * exp(-0.5 * s * k);
        double h[5] = {1, s, w * w - s * s, 3 * w * w * s - s * s * s,
                       3 * w * w * w * w - 6 * w * w * s * s + s * s * s * s};
        double turn = remainder(u * x0, 1), c = g * cos(2 * M_PI * turn), d = g * sin(2 * M_PI * turn);
        for (int a = 0; a < 5; a++) {
            double *at = f + 2 * (size_t)a * (size_t)n + i;
            /* odd a carry a factor i */
            at[0] = h[a] * (a % 2 ? -d : c);
            at[n] = h[a] * (a % 2 ? c : d);
        }
    }
}

typedef double v8 __attribute__((vector_size(64), aligned(8), may_alias));

/* out[0] = sum p[i] f[i], out[1] = sum p[i] f[n + i], i = from..to-1: eight sums each, added at the end. */
WIDE static void two_sums(const double *p, const double *f, int n, int from, int to, double out[2])
{
    v8 a = {0}, b = {0};
    int i = from;
    for (; i + 8 <= to; i += 8) {
        const v8 q = *(const v8 *)(p + i);
        a += q * *(const v8 *)(f + i);
        b += q * *(const v8 *)(f + n + i);
    }
    out[0] = out[1] = 0;
    for (int k = 0; k < 8; k++) {
        out[0] += a[k];
        out[1] += b[k];
    }
    for (; i < to; i++) {
        out[0] += p[i] * f[i];
        out[1] += p[i] * f[n + i];
    }
}

/* The nodes where the transform of the weight is not 0: from..to-1. */
static void extent(const double *f, int n, int *from, int *to)
{
    for (*from = 0; *from < n && hypot(f[*from], f[n + *from]) < 1e-40; ++*from)
        ;
    for (*to = n; *to > *from && hypot(f[*to - 1], f[n + *to - 1]) < 1e-40; --*to)
        ;
}

/* Raw moments int W x^a y^b PSF over the nodes. */
static void raw_moments(const struct nodes *g, const double *fx, const double *fy, double m[PSF_MOMENTS])
{
    const int n = g->n;
    int left, right, low, high;
    memset(m, 0, PSF_MOMENTS * sizeof *m);
    extent(fx, n, &left, &right);
    extent(fy, n, &low, &high);
    for (int j = low; j < high; j++) {
        const double *re = g->re + (size_t)j * (size_t)n, *im = g->im ? g->im + (size_t)j * (size_t)n : NULL;
        for (int a = 0; a < 5; a++) {
            const double *f = fx + 2 * (size_t)a * (size_t)n;
            double r[2], s[2] = {0};
            two_sums(re, f, n, left, right, r);
            if (im)
                two_sums(im, f, n, left, right, s);
            const double sr = r[0] - s[1], si = r[1] + s[0];
            for (int b = 0; a + b < 5; b++) {
                const double *q = fy + 2 * (size_t)b * (size_t)n + j;
                m[psf_moment_index(a, b)] += sr * q[0] - si * q[n];
            }
        }
    }
    for (int k = 0; k < PSF_MOMENTS; k++)
        m[k] *= g->du * g->du;
}

/* The transform of a weight of width w is below 1e-22 of its peak beyond |u| = this / w. */
#define WEIGHT_REACH 1.6

/* Moments on nodes already made. */
static int nodes_moments(const struct nodes *g, double width, double x0, double y0, double m[PSF_MOMENTS])
{
    double *f = malloc(20 * (size_t)g->n * sizeof *f), v[PSF_MOMENTS];
    if (!f)
        return E_NOMEM;
    weight_terms(g, width, x0, f);
    weight_terms(g, width, y0, f + 10 * (size_t)g->n);
    raw_moments(g, f, f + 10 * (size_t)g->n, v);
    free(f);
    if (!(v[0] > 0))
        return E_NOCONV;
    for (int k = 1; k < PSF_MOMENTS; k++)
        v[k] /= v[0];
    memcpy(m, v, sizeof v);
    return OK;
}

static int moments_valid(const struct otf *t, double width, double x0, double y0)
{
    double period = psf_period(t);
    return width > 0 && width <= period / 16 && fabs(x0) <= period / 4 && fabs(y0) <= period / 4;
}

int psf_moments(const struct otf *t, double diffusion, double pixel, double width, double x0, double y0,
                double m[PSF_MOMENTS])
{
    if (!moments_valid(t, width, x0, y0))
        return E_RANGE;
    struct nodes g;
    int status = nodes_fine(t, diffusion, pixel, 1, WEIGHT_REACH / width, &g);
    if (status)
        return status;
    status = nodes_moments(&g, width, x0, y0, m);
    nodes_free(&g);
    return status;
}

int psf_centroid(const struct otf *t, double diffusion, double pixel, double width, double *x0, double *y0)
{
    if (!moments_valid(t, width, 0, 0))
        return E_RANGE;
    struct nodes g = {0};
    int status = nodes_fine(t, diffusion, pixel, 1, WEIGHT_REACH / width, &g);
    double x = 0, y = 0, m[PSF_MOMENTS], w2 = width * width;
    for (int i = 0; status == OK; i++) {
        status = i < 100 && moments_valid(t, width, x, y) ? nodes_moments(&g, width, x, y, m) : E_NOCONV;
        if (status)
            break;
        /* Newton on S J_x, S J_y: the derivative by the centre is S (J_xx / w^2 - 1) etc. */
        double a = 1 - m[3] / w2, b = -m[4] / w2, d = 1 - m[5] / w2, det = a * d - b * b;
        double dx = m[1], dy = m[2];
        if (a > 0.05 && d > 0.05 && det > 0.01) {
            dx = (d * m[1] - b * m[2]) / det;
            dy = (a * m[2] - b * m[1]) / det;
        }
        double reach = hypot(dx, dy) / width;
        x += dx / fmax(1, reach);
        y += dy / fmax(1, reach);
        if (reach < 1e-10)
            break;
    }
    nodes_free(&g);
    if (status == OK) {
        *x0 = x;
        *y0 = y;
    }
    return status;
}
