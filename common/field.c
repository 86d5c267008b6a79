/* field.c - a whole scene in one convolution. */
#include "field.h"
#include "fft.h"
#include "render.h"
#include "shapelet.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MARGIN 13.0            /* arcsec around the field, at least */
#define ALIAS 21.0             /* aliases below exp(-21) = 8e-10 of what they are added to */
#define CUT 28.0               /* the Gaussian ends at exp(-28) = 7e-13 */
#define BLOCK 64               /* rows of frequencies tabulated at a time */

/* Where wings of a star are below the share of an object whose peak is a tenth of a star's; as far as they are known at most. */
static double margin_for(const struct wings *w, const struct accuracy *a)
{
    const double limit = 0.1 * a->wing * a->eps * w->peak, last = (w->n - w->n / 8) * w->dr;
    double r = fmin(MARGIN, last);
    while (r + 1 < last && w->w[0][(int)(r / w->dr)] > limit)
        r++;
    return r;
}

static int choose_grid(struct field *f, const struct view *v)
{
    const double u = v->psf->ucut, fine = v->pixel / f->split, rate = 1 / fine, pad = 2 * f->margin / v->pixel;
    const double nx = (double)v->nx + pad, ny = (double)v->ny + pad;
    if (!(fmax(nx, ny) * 1.1 * f->split < 32768))
        return E_RANGE;
    f->nx = fft_good_size((int)ceil(nx));
    f->ny = fft_good_size((int)ceil(ny));
    f->x0 = (int)((f->nx - v->nx) / 2);
    f->y0 = (int)((f->ny - v->ny) / 2);
    f->sigma = sqrt(ALIAS / (2 * M_PI * M_PI * rate * (rate - 2 * u)));
    f->cost = 25e-9 * f->split * f->split * f->nx * f->ny;
    f->bytes = 17.0 * f->split * f->split * f->nx * f->ny + 16.0 * f->nx * f->ny;
    return OK;
}

int field_plan(struct field *f, const struct view *v, const struct accuracy *a)
{
    const double u = v->psf ? v->psf->ucut : 0;
    if (!(u > 0) || !(v->pixel > 0) || v->nx < 1 || v->ny < 1)
        return E_RANGE;
    struct field g = {.split = (int)ceil(3 * u * v->pixel)};     /* 1.5 times the Nyquist rate or more */
    const struct stamp_response response = view_response(v);
    int st = wings_new(&g.wings, v->psf, &response, v->pixel, 4 * WINGS_WIDTH);
    if (st == OK) {
        g.margin = margin_for(&g.wings, a);
        st = choose_grid(&g, v);
    }
    if (st)
        field_free(&g);
    else
        *f = g;
    return st;
}

void field_free(struct field *f)
{
    if (f->wings.w[0])
        wings_free(&f->wings);
}

/* A transfer function of 1, that of a single sample, for objects that only the Gaussian blurs. */
static int flat(struct otf *t, double ucut)
{
    const double one = 1;
    return otf_sample(t, 1, 1, &one, 0.25 / ucut, 0, 0, ucut);
}

int field_begin(struct field_sum *s, const struct field *f, const struct view *v)
{
    *s = (struct field_sum){.f = f, .v = v};
    return image_new(&s->fine, (long)f->nx * f->split, (long)f->ny * f->split);
}

/* The fine grid as an image to be made, of objects that `one` and the Gaussian alone blur. */
static struct view fine_view(const struct field_sum *s, const struct otf *one)
{
    struct view w = *s->v;
    w.nx = s->fine.nx;
    w.ny = s->fine.ny;
    w.pixel = s->v->pixel / s->f->split;
    w.no_pixel = 1;
    w.psf = one;
    w.diffusion = s->f->sigma;
    w.ipc = 0;
    w.edge[0] = w.edge[1] = 0;
    return w;
}

/* Nothing, in the place of a part that is drawn elsewhere. */
static struct emitter dark(const struct emitter *e)
{
    return (struct emitter){.parts = e->parts};
}

/* sum c^2 of an object, after dilation. */
static double power_of(const struct emitter *e)
{
    double sum = 0;
    for (size_t k = 0; k < shapelet_count(e->nmax); k++)
        sum += e->coef[k] * e->coef[k];
    return sum / (e->dilation * e->dilation);
}

/* Mark objects, with all their parts, whose wings fold back by more than their share of the tolerance. */
static void mark_folding(const struct field_sum *s, const struct accuracy *a, size_t n, const struct emitter *e, unsigned char *large)
{
    const struct field *f = s->f;
    const double side = sqrt((double)f->nx * f->ny);
    size_t parts;
    for (size_t i = 0; i < n; i += parts) {
        double folded = 0, peak = 0;
        parts = e[i].parts > 1 ? (size_t)e[i].parts : 1;
        for (size_t k = i; k < i + parts && k < n; k++) {
            const double power = e[k].coef ? power_of(&e[k]) : 0, flux = fabs(e[k].flux);
            const double size = e[k].coef ? light_size(power) : 0;
            folded += flux * wings_folded(&f->wings, size, size, f->margin, side);
            peak += flux * (e[k].coef ? light_peak(power, 1, s->v->pixel, f->wings.peak) : f->wings.peak);
        }
        if (folded > a->wing * fmax(a->eps * peak, a->floor))
            memset(large + i, 1, parts);
    }
}

/* The objects, blurred, as samples times area to the fine grid; those that are, or become, large are left out. */
static int blurred(struct field_sum *s, const struct accuracy *a, size_t n, const struct emitter *e, int threads, struct progress *bar,
                   unsigned char *large)
{
    const struct field *f = s->f;
    struct otf one = {0};
    struct plan p = {0};
    struct accuracy own = *a;
    struct emitter *moved = malloc((n + 1) * sizeof *moved);
    int st = moved ? flat(&one, sqrt(CUT / 2) / (M_PI * f->sigma)) : E_NOMEM;
    if (st) {
        free(moved);
        return st;
    }
    for (size_t i = 0; i < n; i++) {
        moved[i] = large[i] ? dark(&e[i]) : e[i];
        moved[i].x = (e[i].x + f->x0) * f->split;
        moved[i].y = (e[i].y + f->y0) * f->split;
    }
    const struct view w = fine_view(s, &one);
    own.eps = fmax(0.1 * a->eps, 1e-11);
    own.floor = 0.1 * a->floor / ((double)f->split * f->split);
    own.side_max = (int)fmin(own.side_max, 2 * f->margin / w.pixel);
    st = scene_plan(&p, &w, &own, n, moved);
    if (st == OK) {
        s->lost.bad += p.n_bad;
        s->lost.cut += p.n_short;
    }
    for (size_t i = 0; st == OK && i < n; i++)
        if (p.draw[i].path == PATH_BROAD || p.draw[i].grid < 0) {
            large[i] = 1;
            s->lost.bad -= p.draw[i].path == PATH_NONE;   /* refused on the fine grid only, perhaps */
            p.draw[i].path = PATH_NONE;
        }
    if (st == OK)
        st = scene_render(&p, &s->fine, threads, bar);
    plan_free(&p);
    otf_free(&one);
    free(moved);
    return st;
}

/* Add value at frequency (kx >= 0, ky) and its conjugate to the half plane of the output grid. */
static void fold(const struct field *f, int kx, int ky, double re, double im, double *out)
{
    const int h = f->nx / 2, x = kx % f->nx, y = (ky % f->ny + f->ny) % f->ny;
    if (x <= h) {
        double *to = out + 2 * ((size_t)y * ((size_t)h + 1) + (size_t)x);
        to[0] += re;
        to[1] += im;
    }
    const int cx = (f->nx - x) % f->nx, cy = (f->ny - y) % f->ny;
    if (kx > 0 && cx <= h) {
        double *to = out + 2 * ((size_t)cy * ((size_t)h + 1) + (size_t)cx);
        to[0] += re;
        to[1] -= im;
    }
}

/* Factors of one axis: what the detector does, over the Gaussian. */
static void factors(const struct field *f, const struct stamp_response *r, int axis, int n, const double *u, double *x)
{
    for (int i = 0; i < n; i++)
        x[i] = exp(2 * M_PI * M_PI * f->sigma * f->sigma * u[i] * u[i]);
    stamp_factors(r, axis, n, u, x);
}

/* Spectrum of the fine grid times T over Gaussian, folded into out. */
static int transfer(const struct field *f, const struct view *v, const double *spectrum, double *out)
{
    const int fx = f->nx * f->split, fy = f->ny * f->split;
    const double lx = f->nx * v->pixel, ly = f->ny * v->pixel;
    const int kx = (int)floor(v->psf->ucut * lx), ky = (int)floor(v->psf->ucut * ly), rows = 2 * ky + 1;
    const size_t cols = (size_t)kx + 1;
    const struct stamp_response response = view_response(v);
    double *u = malloc((3 * (cols + (size_t)rows) + 2 * BLOCK * cols) * sizeof *u);
    if (!u)
        return E_NOMEM;
    double *uy = u + cols, *gx = uy + rows, *gy = gx + cols, *cx = gy + rows, *cy = cx + cols, *re = cy + rows, *im = re + BLOCK * cols;
    for (int i = 0; i <= kx; i++)
        u[i] = i / lx;
    for (int j = 0; j < rows; j++)
        uy[j] = (j - ky) / ly;
    factors(f, &response, 0, kx + 1, u, gx);
    factors(f, &response, 1, rows, uy, gy);
    if (response.ipc > 0) {
        otf_neighbours(kx + 1, u, response.pitch, cx);
        otf_neighbours(rows, uy, response.pitch, cy);
    }
    int st = OK;
    for (int j = 0; j < rows && st == OK; j += BLOCK) {
        const int m = rows - j < BLOCK ? rows - j : BLOCK;
        st = otf_grid(v->psf, kx + 1, u, m, uy + j, re, im);
        for (int r = 0; r < m && st == OK; r++) {
            const int k = j + r - ky;
            const double *s = spectrum + 2 * (size_t)((k + fy) % fy) * ((size_t)fx / 2 + 1);
            for (int i = 0; i <= kx; i++) {
                const size_t t = (size_t)r * cols + (size_t)i;
                const double share = response.ipc > 0 ? 1 + response.ipc * (cx[i] + cy[j + r] - 4) : 1;
                const double g = gx[i] * gy[j + r] * share, a = g * re[t], b = otf_is_real(v->psf) ? 0 : g * im[t];
                fold(f, i, k, a * s[2 * i] - b * s[2 * i + 1], a * s[2 * i + 1] + b * s[2 * i], out);
            }
        }
    }
    free(u);
    return st;
}

/* The fine image convolved and sampled: ny x nx doubles, times nx ny. */
static int convolve(const struct field *f, const struct view *v, struct image *fine, double **made)
{
    const size_t n = image_count(fine), half = 2 * (size_t)fine->ny * ((size_t)fine->nx / 2 + 1);
    const size_t folded = 2 * (size_t)f->ny * ((size_t)f->nx / 2 + 1);
    struct fft *forward = NULL, *back = NULL;
    double *real = fft_alloc(n * sizeof *real), *spectrum = NULL, *sum = NULL, *out = NULL;
    int st = real ? fft_plan_r2c(&forward, (int)fine->ny, (int)fine->nx) : E_NOMEM;
    for (size_t i = 0; st == OK && i < n; i++)
        real[i] = fine->pix[i];
    image_free(fine);
    if (st == OK && !(spectrum = fft_alloc(half * sizeof *spectrum)))
        st = E_NOMEM;
    if (st == OK)
        fft_run(forward, real, spectrum);
    fft_done(forward);
    fft_free(real);
    if (st == OK && !(sum = fft_alloc(folded * sizeof *sum)))
        st = E_NOMEM;
    if (st == OK) {
        memset(sum, 0, folded * sizeof *sum);
        st = transfer(f, v, spectrum, sum);
    }
    fft_free(spectrum);
    if (st == OK)
        st = fft_plan_c2r(&back, f->ny, f->nx);
    if (st == OK && !(out = fft_alloc((size_t)f->ny * (size_t)f->nx * sizeof *out)))
        st = E_NOMEM;
    if (st == OK)
        fft_run(back, sum, out);
    fft_done(back);
    fft_free(sum);
    if (st)
        fft_free(out);
    else
        *made = out;
    return st;
}

/* Add the objects marked, each by itself. */
static int draw_large(struct field_sum *s, const struct accuracy *a, size_t n, const struct emitter *e, const unsigned char *large,
                      struct image *im, int threads)
{
    struct plan p = {0};
    size_t marked = 0;
    for (size_t i = 0; i < n; i++)
        marked += large[i];
    s->lost.large += marked;
    struct emitter *own = marked ? malloc(n * sizeof *own) : NULL;
    if (!own)
        return marked ? E_NOMEM : OK;
    for (size_t i = 0; i < n; i++)
        own[i] = large[i] ? e[i] : dark(&e[i]);
    int st = scene_plan(&p, s->v, a, n, own);
    if (st == OK)
        st = scene_render(&p, im, threads, NULL);
    s->lost.bad += p.n_bad;
    s->lost.cut += p.n_short;
    plan_free(&p);
    free(own);
    return st;
}

int field_add(struct field_sum *s, const struct accuracy *a, size_t n, const struct emitter *e, struct image *im, int threads,
              struct progress *bar)
{
    unsigned char *large = calloc(n + 1, 1);
    int st = large ? OK : E_NOMEM;
    if (st == OK) {
        mark_folding(s, a, n, e, large);
        st = blurred(s, a, n, e, threads, bar, large);
    }
    if (st == OK)
        st = draw_large(s, a, n, e, large, im, threads);
    free(large);
    return st;
}

int field_end(struct field_sum *s, struct image *im)
{
    const struct field *f = s->f;
    double *out = NULL;
    int st = im->nx == s->v->nx && im->ny == s->v->ny ? convolve(f, s->v, &s->fine, &out) : E_RANGE;
    image_free(&s->fine);
    const double scale = 1 / ((double)f->nx * f->ny);
    for (long y = 0; st == OK && y < im->ny; y++)
        for (long x = 0; x < im->nx; x++)
            im->pix[y * im->nx + x] += (float)(scale * out[(size_t)(y + f->y0) * (size_t)f->nx + (size_t)(x + f->x0)]);
    fft_free(out);
    return st;
}
