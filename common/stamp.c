/*
 * stamp.c - one object on one stamp of pixels: Fourier space with exact alias
 * folding when there is a PSF, pixel integrals when there is none.
 *
 * The Fourier path works on a quarter plane of real sums: even n1 + n2 give
 * the real part of the transform, odd ones the imaginary part, and
 * phi_n(-k) = (-1)^n phi_n(k) gives the rows -u_y from the rows u_y.
 */
#include "stamp.h"
#include "broad.h"
#include "shapelet.h"
#include "shear.h"
#include "simd.h"
#include "single.h"
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define TWO_PI 6.283185307179586476925287
#define LANES 8

/* Eight doubles; the compiler splits them to what the processor has. Loads need no alignment. */
typedef double v8 __attribute__((vector_size(64), aligned(8)));

/* One row of the transform at +u_y (p) and -u_y (m): columns 0..m-1. */
struct row {
    double *p_re, *p_im, *m_re, *m_im;
};

/* Everything the rows of one object need and no row changes. */
struct transform {
    const struct stamp_grid *g;
    const struct shape *s;
    int nmax, ld;              /* ld: columns, a multiple of 8 */
    double *phi;               /* (nmax+1) x ld basis at u_x >= 0 */
    double *phi_y;             /* the same along y (phi itself when the axes are alike) */
    double *ve, *vo;           /* (nmax+1) x ld sums over even and odd n1, for each n2 */
    double *coef;              /* coefficients with the factors (-i)^n taken out */
    double u[3];               /* mapped: (u0 kx + u1 ky, u2 ky) */
    double *p_re, *p_im, *y_re, *y_im;   /* phases along x and y */
};

/* Where one thread makes its rows. */
struct lines {
    struct row row;
    double *arg;               /* ld abscissae */
    double *phi;               /* of a mapped object: (nmax+1) x ld basis at them */
    double *acc[4];            /* folded rows */
    double *line, *t[4];       /* without a table: scratch of otf_row; rows +-ky of T */
    double *fft;               /* scratch of the transform to pixels */
};

/* The half plane of frequencies: two planes, rows of ld. */
struct plane {
    double *re, *im;
    size_t ld;
    int columns;           /* 0..columns-1 hold something */
};

/* A part of a stamp on its way. */
struct drawing {
    struct transform t;
    struct shape shape;
    struct plane f;
    double kcut, scale;
};

struct stamp_work {
    double *mem;           /* arena of `cap` doubles */
    size_t cap, used;
    double *freq;          /* two planes of n x round8(n/2+1), and what lines points to */
    size_t freq_cap;
    struct drawing d;
    struct lines lines;
};

int stamp_work_new(struct stamp_work **w)
{
    *w = calloc(1, sizeof **w);
    return *w ? OK : E_NOMEM;
}

void stamp_work_free(struct stamp_work *w)
{
    if (!w)
        return;
    free(w->mem);
    free(w->freq);
    free(w);
}

static size_t round8(size_t n)
{
    return (n + LANES - 1) / LANES * LANES;
}

/* Make *mem hold at least `doubles`, of no value; the old block goes first. */
static int need(double **mem, size_t *cap, size_t doubles)
{
    if (doubles <= *cap)
        return OK;
    free(*mem);
    *mem = aligned_alloc(64, round8(doubles) * sizeof **mem);
    *cap = *mem ? round8(doubles) : 0;
    return *mem ? OK : E_NOMEM;
}

/* Make the arena hold `doubles` and forget what it held. */
static int arena_reset(struct stamp_work *w, size_t doubles)
{
    w->used = 0;
    return need(&w->mem, &w->cap, doubles);
}

/* The next n doubles of the arena; arena_reset was asked for enough. */
static double *arena_take(struct stamp_work *w, size_t n)
{
    double *p = w->mem + w->used;
    w->used += round8(n);
    return p;
}

/* ---- transfer function ---- */

static int last_frequency(double ucut, double pixel, int n)
{
    return (int)floor(ucut * pixel * n * (1 + 1e-12));
}

double stamp_grid_bytes(double ucut, double pixel, int n, int complex_t)
{
    double k = floor(ucut * pixel * n) + 1;
    return (complex_t ? 2 : 1) * 8.0 * 2 * k * (k + LANES);
}

/* Row ky of T, columns 0..m-1, times the factors y (row), x (column) and 1 + ipc (cx[column] + cx[row] - 4), cx = 2 cos. */
static void apply_factors(const struct stamp_grid *g, int ky, int m, double *re, double *im)
{
    if (!g->factor)
        return;
    const int j = abs(ky), n = g->kmax + 1;
    const double *x = g->factor, *y = x + n, *cx = y + n;
    for (int i = 0; i < m; i++) {
        double f = y[j] * x[i];
        if (g->ipc > 0)
            f *= 1 + g->ipc * (cx[i] + cx[j] - 4);
        re[i] *= f;
        if (im)
            im[i] *= f;
    }
}

void stamp_factors(const struct stamp_response *r, int axis, int n, const double *u, double *f)
{
    const double box = axis && r->box_y > 0 ? r->box_y : r->box;
    if (r->diffusion > 0)
        otf_diffusion(n, u, r->diffusion, f);
    if (box > 0)
        otf_box(n, u, box, f);
    if (r->edge[axis] > 0)
        otf_box(n, u, r->edge[axis], f);
}

/* The factors beyond the PSF. u: 0..kmax du. */
static int factors(struct stamp_grid *g, const struct stamp_response *r, const double *u)
{
    const int n = g->kmax + 1;
    if (!(r->diffusion > 0) && !(r->box > 0) && !(r->box_y > 0) && !(r->edge[0] > 0) && !(r->edge[1] > 0) && !(r->ipc > 0))
        return OK;
    double *x = g->factor = malloc(3 * (size_t)n * sizeof *x), *y = x + n;
    if (!x)
        return E_NOMEM;
    for (int i = 0; i < 2 * n; i++)
        x[i] = 1;
    stamp_factors(r, 0, n, u, x);
    stamp_factors(r, 1, n, u, y);
    g->ipc = r->ipc;
    if (r->ipc > 0)
        otf_neighbours(n, u, r->pitch, y + n);
    return OK;
}

/* Rows of a table from the samples of a PSF, by way of a second copy. u: the 2 kmax + 1 frequencies. */
static int rows_of_samples(struct stamp_grid *g, const struct otf *t, const double *u)
{
    const size_t k = (size_t)g->kmax, cols = k + 1, rows = 2 * k + 1;
    double *re = malloc(2 * rows * cols * sizeof *re), *im = re + rows * cols;
    int st = re ? otf_grid(t, (int)cols, u + k, (int)rows, u, re, im) : E_NOMEM;
    for (size_t row = 0; st == OK && row < rows; row++) {
        memcpy(g->t_re + row * (size_t)g->ld, re + row * cols, cols * sizeof *re);
        if (g->t_im)
            memcpy(g->t_im + row * (size_t)g->ld, im + row * cols, cols * sizeof *im);
    }
    free(re);
    return st;
}

/* Fill t_re, t_im. */
static int tabulate(struct stamp_grid *g, const struct otf *t, const double *u)
{
    const int k = g->kmax, rows = 2 * k + 1;
    double *line = calloc((size_t)t->n + 8, sizeof *line);
    const size_t size = (size_t)rows * (size_t)g->ld + SINGLE_LANES;     /* blocks of so many may end beyond the last row */
    g->t_re = calloc(size, sizeof *g->t_re);
    if (!otf_is_real(t))
        g->t_im = calloc(size, sizeof *g->t_im);
    int st = line && g->t_re && (g->t_im || otf_is_real(t)) ? OK : E_NOMEM;
    if (st == OK && !g->columns)
        st = rows_of_samples(g, t, u);
    for (int row = 0; st == OK && row < rows; row++) {
        double *re = g->t_re + (size_t)row * (size_t)g->ld, *im = g->t_im ? g->t_im + (size_t)row * (size_t)g->ld : NULL;
        if (g->columns)
            otf_row(t, g->columns, k + 1, u[row], line, re, im);
        apply_factors(g, row - k, k + 1, re, im);
    }
    free(line);
    return st;
}

int stamp_grid_lean(struct stamp_grid *g, const struct otf *t, const struct stamp_response *r, double pixel, int n, int parts,
                    int table)
{
    if (n < 4 || n > 4096 || n % 2 || parts < 1 || n % parts || n / parts < 2 || !(pixel > 0) || !(t->ucut > 0)
        || !(t->ucut * pixel < 64) || !(r->diffusion >= 0) || !(r->box >= 0) || !(r->box_y >= 0)
        || !(r->edge[0] >= 0) || !(r->edge[1] >= 0) || !(r->ipc >= 0) || !(r->pitch >= 0) || (!table && !t->sre))
        return E_RANGE;
    struct stamp_grid s = {.n = n, .parts = parts, .pixel = pixel, .du = 1 / (n * pixel), .otf = *t};
    s.kmax = last_frequency(t->ucut, pixel, n);
    s.ld = (int)round8((size_t)s.kmax + 1);
    const int k = s.kmax;
    double *u = malloc((2 * (size_t)k + 1) * sizeof *u);
    int st = u ? OK : E_NOMEM;
    for (int i = -k; st == OK && i <= k; i++)
        u[i + k] = i * s.du;
    if (st == OK)
        st = factors(&s, r, u + k);
    if (st == OK && t->sre)
        st = otf_columns_new(&s.columns, t, k + 1, u + k);
    if (st == OK && table)
        st = tabulate(&s, t, u);
    if (st == OK)
        st = lanes_new_rows(&s.fft, n, n / parts);
    free(u);
    if (table) {
        otf_columns_free(s.columns);
        free(s.factor);
        s.columns = NULL;
        s.factor = NULL;
    }
    if (st)
        stamp_grid_free(&s);
    else
        *g = s;
    return st;
}

int stamp_grid_new(struct stamp_grid *g, const struct otf *t, const struct stamp_response *r, double pixel, int n)
{
    return stamp_grid_lean(g, t, r, pixel, n, 1, 1);
}

void stamp_grid_free(struct stamp_grid *g)
{
    free(g->t_re);
    free(g->t_im);
    free(g->factor);
    otf_columns_free(g->columns);
    lanes_free(g->fft);
    *g = (struct stamp_grid){0};
}

/* ---- Fourier path ---- */

/* re + i im of exp(-2 pi i k s / n), k = 0..m-1, by eight chains (error 1e-16 m/8); m rounded up to 8. */
WIDE static void phases(int m, double s, int n, double *re, double *im)
{
    for (int k = 0; k < LANES; k++) {
        double a = -TWO_PI * k * (s / n);
        re[k] = cos(a);
        im[k] = sin(a);
    }
    double a8 = -TWO_PI * LANES * (s / n), c = cos(a8), d = sin(a8);
    for (int k = LANES; k < m; k += LANES) {
        v8 r = *(v8 *)(re + k - LANES), i = *(v8 *)(im + k - LANES);
        *(v8 *)(re + k) = r * c - i * d;
        *(v8 *)(im + k) = r * d + i * c;
    }
}

/* c (-i)^(n1+n2) as a real number that belongs to the real (n even) or imaginary part (n odd). */
static void take_phase_out(int nmax, const double *c, double *out)
{
    static const double sign[4] = {1, -1, -1, 1};
    size_t i = 0;
    for (int n = 0; n <= nmax; n++)
        for (int n1 = 0; n1 <= n; n1++, i++)
            out[i] = sign[n & 3] * c[i];
}

/* ve[n2], vo[n2] = sums over even, odd n1 of coef phi_n1(k_x). */
WIDE static void sum_over_n1(int nmax, int ld, int m, const double *coef, const double *phi, double *ve, double *vo)
{
    for (int n2 = 0; n2 <= nmax; n2++)
        for (int odd = 0; odd < 2; odd++) {
            double *v = (odd ? vo : ve) + (size_t)n2 * (size_t)ld;
            for (int k = 0; k < m; k += LANES) {
                v8 sum = {0};
                for (int n1 = odd; n1 <= nmax - n2; n1 += 2) {
                    int n = n1 + n2;
                    sum += coef[n * (n + 1) / 2 + n1] * *(const v8 *)(phi + (size_t)n1 * (size_t)ld + k);
                }
                *(v8 *)(v + k) = sum;
            }
        }
}

/* Rows +-u_y: f points at phi_n2(k_y), n2 rising with stride ld. */
WIDE static void row_separable(int nmax, int ld, int m, const double *f, const double *ve, const double *vo,
                               const struct row *r)
{
    for (int k = 0; k < m; k += LANES) {
        v8 ee = {0}, oe = {0}, oo = {0}, eo = {0};
        for (int n2 = 0; n2 <= nmax; n2 += 2) {
            double y = f[(size_t)n2 * (size_t)ld];
            ee += y * *(const v8 *)(ve + (size_t)n2 * (size_t)ld + k);
            oe += y * *(const v8 *)(vo + (size_t)n2 * (size_t)ld + k);
        }
        for (int n2 = 1; n2 <= nmax; n2 += 2) {
            double y = f[(size_t)n2 * (size_t)ld];
            eo += y * *(const v8 *)(ve + (size_t)n2 * (size_t)ld + k);
            oo += y * *(const v8 *)(vo + (size_t)n2 * (size_t)ld + k);
        }
        *(v8 *)(r->p_re + k) = ee + oo;
        *(v8 *)(r->m_re + k) = ee - oo;
        *(v8 *)(r->p_im + k) = oe + eo;
        *(v8 *)(r->m_im + k) = oe - eo;
    }
}

/* Row at u_y = ky du of a mapped object, from phi_n1 at its own abscissae. */
static int row_mapped(const struct transform *t, const struct lines *l, int ky, int m, double *re, double *im)
{
    const int nmax = t->nmax, ld = t->ld;
    const double b = TWO_PI * t->s->beta_x * t->g->du;
    double y = b * t->u[2] * ky, fy[SHAPELET_NMAX + 1], even[SHAPELET_NMAX + 1], odd[SHAPELET_NMAX + 1];
    int st = shapelet_basis(nmax, 1, 1, &y, fy);
    if (st)
        return st;
    for (int n1 = 0; n1 <= nmax; n1++) {
        double s[2] = {0, 0};
        for (int n2 = 0; n2 <= nmax - n1; n2++)
            s[(n1 + n2) & 1] += t->coef[shapelet_index(n1, n2)] * fy[n2];
        even[n1] = s[0];
        odd[n1] = s[1];
    }
    for (int i = 0; i < m; i++)
        l->arg[i] = b * (t->u[0] * i + t->u[1] * ky);
    st = shapelet_basis(nmax, 1, m, l->arg, l->phi);
    memset(re, 0, (size_t)ld * sizeof *re);
    memset(im, 0, (size_t)ld * sizeof *im);
    for (int n1 = 0; n1 <= nmax && st == OK; n1++) {
        const double *f = l->phi + (size_t)n1 * (size_t)m;
        for (int i = 0; i < m; i++) {
            re[i] += even[n1] * f[i];
            im[i] += odd[n1] * f[i];
        }
    }
    return st;
}

/* Row times transfer function times phase along x, in place. */
WIDE static void row_transfer(int m, const double *t_re, const double *t_im, const double *c, const double *d,
                              double *re, double *im)
{
    for (int k = 0; k < m; k += LANES) {
        v8 a = *(v8 *)(re + k), b = *(v8 *)(im + k), x = *(const v8 *)(c + k), y = *(const v8 *)(d + k);
        v8 t = *(const v8 *)(t_re + k);
        v8 u = a * t, v = b * t;
        if (t_im) {
            v8 s = *(const v8 *)(t_im + k);
            u -= b * s;
            v += a * s;
        }
        *(v8 *)(re + k) = u * x - v * y;
        *(v8 *)(im + k) = u * y + v * x;
    }
}

/* Add columns 0..m-1 of a half-plane row to the folded row `d` and, conjugated, to `c` (columns 0..n/2). */
WIDE static void row_fold(int n, int m, const double *re, const double *im, double *d_re, double *d_im,
                          double *c_re, double *c_im)
{
    const int h = n / 2;
    for (int k = 0; k < m; k += n) {
        int last = m - 1 - k < h ? m - 1 - k : h;
        for (int j = 0; j <= last; j++) {
            d_re[j] += re[k + j];
            d_im[j] += im[k + j];
        }
    }
    for (int k = n; k - h < m; k += n) {
        int first = k > m - 1 ? k - (m - 1) : 0;
        for (int j = first; j <= h; j++) {
            c_re[j] += re[k - j];
            c_im[j] -= im[k - j];
        }
    }
}

/* re + i im += (a + i b) (c + i d), columns 0..h. */
WIDE static void row_add(int h, const double *a, const double *b, double c, double d, double *re, double *im)
{
    for (int j = 0; j <= h; j++) {
        re[j] += a[j] * c - b[j] * d;
        im[j] += a[j] * d + b[j] * c;
    }
}

/* to = (a + i b) (c + i d) in columns 0..m-1, 0 from there to the next multiple of 8 beyond `last`. */
WIDE static void row_store(int m, int last, const double *a, const double *b, double c, double d, double *re, double *im)
{
    for (int j = 0; j < m; j++) {
        re[j] = a[j] * c - b[j] * d;
        im[j] = a[j] * d + b[j] * c;
    }
    for (int j = m; j < last; j++)
        re[j] = im[j] = 0;
}

/* U of A' = R U (R a rotation by rho), A' = {a, b, c, d} = rows. */
static double upper_triangle(double a, double b, double c, double d, double u[3])
{
    double l = hypot(a, c), co = a / l, si = c / l;
    u[0] = l;
    u[1] = co * b + si * d;
    u[2] = co * d - si * b;
    return atan2(si, co);
}

/* Basis along an axis: phi_n(2 pi beta du k), k = 0..ld-1. */
static int axis_basis(const struct transform *t, double beta, double *x, double *phi)
{
    for (int k = 0; k < t->ld; k++)
        x[k] = TWO_PI * beta * t->g->du * k;
    return shapelet_basis(t->nmax, 1, t->ld, x, phi);
}

/* Lay out a thread's lines for t, behind `before` doubles of w->freq. */
static int lay_lines(struct stamp_work *w, const struct transform *t, size_t before)
{
    const struct stamp_grid *g = t->g;
    const size_t ld = (size_t)t->ld, h = round8((size_t)g->n / 2 + 1), fft = round8(lanes_scratch(g->fft));
    const size_t made = g->columns ? ld : 0, line = g->columns ? round8((size_t)g->otf.n + 8) : 0, phi = t->s->mapped ? (size_t)(t->nmax + 1) * ld : 0;
    int st = need(&w->freq, &w->freq_cap, before + fft + 5 * ld + 4 * h + 4 * made + line + phi);
    if (st)
        return st;
    struct lines *l = &w->lines;
    double *at = w->freq + before;
    double **const part[] = {&l->fft, &l->row.p_re, &l->row.p_im, &l->row.m_re, &l->row.m_im, &l->arg, &l->acc[0], &l->acc[1], &l->acc[2], &l->acc[3],
                             &l->t[0], &l->t[1], &l->t[2], &l->t[3], &l->line, &l->phi};
    const size_t size[] = {fft, ld, ld, ld, ld, ld, h, h, h, h, made, made, made, made, line, phi};
    for (size_t i = 0; i < sizeof size / sizeof size[0]; at += size[i++])
        *part[i] = at;
    if (!g->otf.sim)
        l->t[2] = l->t[3] = NULL;
    memset(l->line, 0, line * sizeof *l->line);
    return OK;
}

/* Compute what does not depend on the row, with w->lines laid out and t->g, s, nmax, ld set. */
static int transform_start(struct transform *t, struct stamp_work *w)
{
    const struct shape *s = t->s;
    const size_t ld = (size_t)t->ld, orders = (size_t)(t->nmax + 1), nc = s->coef ? shapelet_count(s->nmax) : 0;
    const int alike = s->beta_y == s->beta_x;
    int st = arena_reset(w, 4 * ld + 2 * round8(nc) + (s->mapped ? 0 : alike ? 3 : 4) * orders * ld);
    if (st)
        return st;
    t->p_re = arena_take(w, ld);
    t->p_im = arena_take(w, ld);
    t->y_re = arena_take(w, ld);
    t->y_im = arena_take(w, ld);
    if (!s->coef)
        return OK;
    t->coef = arena_take(w, nc);
    if (s->mapped) {
        double *rotated = arena_take(w, nc);
        double rho = upper_triangle(s->a[0], s->a[2], s->a[1], s->a[3], t->u);
        st = shapelet_rotate(s->nmax, -rho, s->coef, rotated);
        take_phase_out(s->nmax, rotated, t->coef);
        return st;
    }
    take_phase_out(s->nmax, s->coef, t->coef);
    t->phi = t->phi_y = arena_take(w, orders * ld);
    t->ve = arena_take(w, orders * ld);
    t->vo = arena_take(w, orders * ld);
    st = axis_basis(t, s->beta_x, w->lines.arg, t->phi);
    if (st == OK && !alike) {
        t->phi_y = arena_take(w, orders * ld);
        st = axis_basis(t, s->beta_y, w->lines.arg, t->phi_y);
    }
    if (st == OK)
        sum_over_n1(t->nmax, t->ld, t->ld, t->coef, t->phi, t->ve, t->vo);
    return st;
}

/* The object's transform on rows +-ky, columns 0..m-1. */
static int transform_row(const struct transform *t, const struct lines *l, int ky, int m)
{
    const struct row *r = &l->row;
    if (!t->s->coef) {
        for (int k = 0; k < m; k++) {
            r->p_re[k] = r->m_re[k] = 1;
            r->p_im[k] = r->m_im[k] = 0;
        }
        return OK;
    }
    if (!t->s->mapped) {
        row_separable(t->nmax, t->ld, m, t->phi_y + ky, t->ve, t->vo, r);
        return OK;
    }
    int st = row_mapped(t, l, ky, m, r->p_re, r->p_im);
    return st ? st : row_mapped(t, l, -ky, m, r->m_re, r->m_im);
}

/* Rows +-ky, all bands beyond the grid's own frequencies added onto it. */
static void add_folded(const struct transform *t, const struct lines *l, int ky, int m, double c, double d, const struct plane *f)
{
    const struct row *r = &l->row;
    const int n = t->g->n, h = n / 2, rows = n / t->g->parts, row = ky % rows, mirror = (rows - row) % rows;
    for (int i = 0; i < 4; i++)
        memset(l->acc[i], 0, ((size_t)h + 1) * sizeof(double));
    row_fold(n, m, r->p_re, r->p_im, l->acc[0], l->acc[1], l->acc[2], l->acc[3]);
    row_fold(n, m, r->m_re, r->m_im, l->acc[2], l->acc[3], l->acc[0], l->acc[1]);
    row_add(h, l->acc[0], l->acc[1], c, d, f->re + (size_t)row * f->ld, f->im + (size_t)row * f->ld);
    if (ky > 0)
        row_add(h, l->acc[2], l->acc[3], c, -d, f->re + (size_t)mirror * f->ld, f->im + (size_t)mirror * f->ld);
}

/* Rows +-ky when there is only the one band. */
static void put_row(const struct transform *t, const struct lines *l, int ky, int m, double c, double d, const struct plane *f)
{
    const struct row *r = &l->row;
    const size_t up = (size_t)ky * f->ld, down = (size_t)(t->g->n / t->g->parts - ky) * f->ld;
    row_store(m, f->columns, r->p_re, r->p_im, c, d, f->re + up, f->im + up);
    if (ky > 0)
        row_store(m, f->columns, r->m_re, r->m_im, c, -d, f->re + down, f->im + down);
}

/* Row ky of T, columns 0..m-1: of the table, or made in `side` 0, 1 of the scratch. */
static void transfer_row(const struct transform *t, const struct lines *l, int ky, int m, int side, const double **re, const double **im)
{
    const struct stamp_grid *g = t->g;
    if (!g->columns) {
        const size_t at = (size_t)(g->kmax + ky) * (size_t)g->ld;
        *re = g->t_re + at;
        *im = g->t_im ? g->t_im + at : NULL;
        return;
    }
    otf_row(&g->otf, g->columns, m, ky * g->du, l->line, l->t[side], l->t[2 + side]);
    apply_factors(g, ky, m, l->t[side], l->t[2 + side]);
    *re = l->t[side];
    *im = l->t[2 + side];
}

/* Rows +-ky: transform, transfer function, phases along x; into columns 0..*m-1 of the lines. */
static int make_rows(const struct drawing *d, const struct lines *l, int ky, int *m)
{
    const struct transform *t = &d->t;
    const struct row *r = &l->row;
    const double reach = sqrt(d->kcut * d->kcut - (double)ky * ky);
    const double *up[2], *down[2];
    *m = 1 + (reach < t->g->kmax ? (int)reach : t->g->kmax);
    int st = transform_row(t, l, ky, *m);
    if (st)
        return st;
    transfer_row(t, l, ky, *m, 0, &up[0], &up[1]);
    row_transfer(*m, up[0], up[1], t->p_re, t->p_im, r->p_re, r->p_im);
    transfer_row(t, l, -ky, *m, 1, &down[0], &down[1]);
    row_transfer(*m, down[0], down[1], t->p_re, t->p_im, r->m_re, r->m_im);
    return OK;
}

/* The same with the phase along y, into the plane. */
static int fold_row(const struct drawing *d, const struct lines *l, int ky, int single)
{
    const struct transform *t = &d->t;
    int m, st = make_rows(d, l, ky, &m);
    if (st == OK)
        (single ? put_row : add_folded)(t, l, ky, m, d->scale * t->y_re[ky], d->scale * t->y_im[ky], &d->f);
    return st;
}

static void clear_row(const struct plane *f, int row)
{
    memset(f->re + (size_t)row * f->ld, 0, (size_t)f->columns * sizeof(double));
    memset(f->im + (size_t)row * f->ld, 0, (size_t)f->columns * sizeof(double));
}

/* Rows k and rows - k of the plane, k <= rows / 2, with all bands that fall onto them: no other row of it is touched. */
static int fold_pair(const struct drawing *d, const struct lines *l, int k)
{
    const struct stamp_grid *g = d->t.g;
    const int rows = g->n / g->parts, top = d->kcut < g->kmax ? (int)d->kcut : g->kmax, single = top < rows / 2, mirror = (rows - k) % rows;
    if (!single || k > top) {
        clear_row(&d->f, k);
        clear_row(&d->f, mirror);
    }
    int st = OK;
    for (int band = 0; band + k <= top && st == OK; band += rows) {
        st = fold_row(d, l, band + k, single);
        if (mirror != k && band + mirror <= top && st == OK)
            st = fold_row(d, l, band + mirror, single);
    }
    return st;
}

/* All rows, the same bits, in the order of the transfer function's in memory. */
static int fold_rows(const struct drawing *d, const struct lines *l)
{
    const struct stamp_grid *g = d->t.g;
    const int n = g->n, top = d->kcut < g->kmax ? (int)d->kcut : g->kmax, single = top < n / 2;
    for (int row = single ? top + 1 : 0; row < (single ? n - top : n); row++)
        clear_row(&d->f, row);
    int st = OK;
    for (int ky = 0; ky <= top && st == OK; ky++)
        st = fold_row(d, l, ky, single);
    return st;
}

/* Half planes of width stamp_width(n): columns 0..n/2 and more, a multiple of 8. */
static size_t stamp_width(int n)
{
    return round8((size_t)n / 2 + 1);
}

size_t stamp_stride(int n)
{
    return 2 * stamp_width(n);
}

static int drawable(const struct shape *s, double x, double y, double flux, double kcut)
{
    return kcut >= 0 && isfinite(x) && isfinite(y) && isfinite(flux)
           && (!s->coef || (s->nmax >= 0 && s->nmax <= SHAPELET_NMAX && s->beta_x > 0 && s->beta_y > 0));
}

/* What a part needs before its first row; `planes` doubles of w->freq are left for the frequencies. */
static int start(const struct stamp_grid *g, struct stamp_work *w, const struct shape *s, double x, double y, double flux, double kcut, size_t planes)
{
    const int columns = 1 + (kcut < g->kmax ? (int)kcut : g->kmax);
    struct drawing *d = &w->d;
    struct transform *t = &d->t;
    *d = (struct drawing){.shape = *s, .kcut = kcut, .scale = flux / ((double)g->n * g->n)};
    *t = (struct transform){.g = g, .s = &d->shape, .nmax = s->coef ? s->nmax : -1, .ld = (int)round8((size_t)columns)};
    int st = lay_lines(w, t, planes);
    if (st == OK)
        st = transform_start(t, w);
    if (st)
        return st;
    phases(t->ld, x, g->n, t->p_re, t->p_im);
    phases(t->ld, y, g->n, t->y_re, t->y_im);
    d->f.columns = columns < g->n / 2 + 1 ? columns : g->n / 2 + 1;
    if (s->coef)
        d->scale *= TWO_PI * sqrt(s->beta_x * s->beta_y);
    return OK;
}

int stamp_fourier(const struct stamp_grid *g, struct stamp_work *w, const struct shape *s, double x, double y,
                  double flux, double kcut, double *out)
{
    if (!drawable(s, x, y, flux, kcut) || g->parts != 1)
        return E_RANGE;
    const size_t width = stamp_width(g->n), nfreq = (size_t)g->n * width;
    int st = start(g, w, s, x, y, flux, kcut, 2 * nfreq);
    struct plane *f = &w->d.f;
    *f = (struct plane){w->freq, w->freq + nfreq, width, f->columns};
    if (st == OK)
        st = fold_rows(&w->d, &w->lines);
    if (st == OK)
        lanes_run(g->fft, f->columns, f->re, f->im, (int)width, w->lines.fft, out);
    return st;
}

/* What all rows share, in single precision. */
static void take_single(const struct transform *t, struct single *q, int columns, float *mem)
{
    const int point = !t->s->coef, orders = point ? 1 : t->nmax + 1;
    const size_t from = (size_t)t->ld, ld = round8((size_t)columns);
    single_begin(q, t->g->n, orders - 1, columns, mem);
    const size_t to = (size_t)q->ld;
    single_take(1, (int)ld, from, t->p_re, to, q->c);
    single_take(1, (int)ld, from, t->p_im, to, q->s);
    if (point) {
        for (size_t k = 0; k < to; k++)
            q->ve[k] = 1;
        memset(q->vo, 0, to * sizeof *q->vo);
        return;
    }
    single_take(orders, (int)ld, from, t->ve, to, q->ve);
    single_take(orders, (int)ld, from, t->vo, to, q->vo);
}

/* The frequency 0 in double, where phases are 1 and odd orders 0; re: the transfer function there. */
static double at_zero(const struct drawing *d, double re)
{
    const struct transform *t = &d->t;
    double sum = t->s->coef ? 0 : 1;
    for (int n2 = 0; n2 <= t->nmax; n2 += 2)
        sum += t->phi_y[(size_t)n2 * (size_t)t->ld] * t->ve[(size_t)n2 * (size_t)t->ld];
    return sum * re * d->scale;
}

int stamp_single(const struct stamp_grid *g, struct stamp_work *w, const struct shape *s, double x, double y, double flux, double kcut,
                 float *out, double *rest)
{
    if (!drawable(s, x, y, flux, kcut) || g->parts != 1 || s->mapped || g->columns)
        return E_RANGE;
    const int top = kcut < g->kmax ? (int)kcut : g->kmax;
    int st = start(g, w, s, x, y, flux, kcut, round8(single_floats(g->n, s->coef ? s->nmax : 0, top + 1)) / 2);
    if (st)
        return st;
    const struct drawing *d = &w->d;
    const struct transform *t = &d->t;
    const size_t pixels = (size_t)g->n * (size_t)g->n;
    double mean = 0;                       /* of the pixels, the frequency 0: what rounding took of it first */
    struct single q;
    take_single(t, &q, top + 1, (float *)w->freq);
    for (int ky = 0; ky <= top; ky++) {
        const double reach = sqrt(kcut * kcut - (double)ky * ky), turn[2] = {d->scale * t->y_re[ky], d->scale * t->y_im[ky]};
        const int m = 1 + (reach < g->kmax ? (int)reach : g->kmax);
        struct single_transfer up, down;
        float f[SHAPELET_NMAX + 1] = {1};
        transfer_row(t, &w->lines, ky, m, 0, &up.re, &up.im);
        transfer_row(t, &w->lines, -ky, m, 1, &down.re, &down.im);
        for (int n2 = 0; n2 <= t->nmax; n2++)
            f[n2] = (float)t->phi_y[(size_t)n2 * (size_t)t->ld + (size_t)ky];
        single_row(&q, ky, m, f, turn, &up, &down);
        if (ky == 0)
            mean = at_zero(d, up.re[0]) - (double)q.line[0];
    }
    mean += (double)q.re[0];
    lanes_run_single(g->fft, d->f.columns, q.re, q.im, q.width, (float *)w->lines.fft, out);
    *rest = mean - single_sum(pixels, out) / (double)pixels;
    return OK;
}

int stamp_part_start(const struct stamp_grid *g, struct stamp_work *w, const struct shape *s, double x, double y, double flux,
                     double kcut, int part, double *plane)
{
    if (!drawable(s, x, y, flux, kcut) || part < 0 || part >= g->parts)
        return E_RANGE;
    const size_t width = stamp_width(g->n);
    int st = start(g, w, s, x, y - part, flux, kcut, 0);
    struct plane *f = &w->d.f;
    *f = (struct plane){plane, plane + width, 2 * width, f->columns};
    return st;
}

int stamp_part_items(const struct stamp_work *w, enum stamp_stage stage)
{
    const struct stamp_grid *g = w->d.t.g;
    const int rows = g->n / g->parts;
    return ((stage == STAMP_FREQUENCIES ? rows / 2 + 1 : stage == STAMP_COLUMNS ? w->d.f.columns : rows) + LANES - 1) / LANES;
}

int stamp_part_join(const struct stamp_work *w, struct stamp_work *own)
{
    return w == own ? OK : lay_lines(own, &w->d.t, 0);
}

int stamp_part_frequencies(const struct stamp_work *w, struct stamp_work *own, int item)
{
    const int half = w->d.t.g->n / w->d.t.g->parts / 2, end = (item + 1) * LANES;
    int st = OK;
    for (int k = item * LANES; k < end && k <= half && st == OK; k++)
        st = fold_pair(&w->d, &own->lines, k);
    return st;
}

void stamp_part_columns(const struct stamp_work *w, struct stamp_work *own, int item)
{
    const struct plane *f = &w->d.f;
    lanes_columns(w->d.t.g->fft, item * LANES, f->re, f->im, (int)f->ld, own->lines.fft);
}

void stamp_part_rows(const struct stamp_work *w, struct stamp_work *own, int item, double *out, size_t stride)
{
    const struct plane *f = &w->d.f;
    lanes_rows(w->d.t.g->fft, item * LANES, f->columns, f->re, f->im, (int)f->ld, own->lines.fft, out, stride);
}

int stamp_fourier_part(const struct stamp_grid *g, struct stamp_work *w, const struct shape *s, double x, double y, double flux,
                       double kcut, int part, double *plane)
{
    const size_t stride = stamp_stride(g->n);
    int st = stamp_part_start(g, w, s, x, y, flux, kcut, part, plane);
    for (int k = 0; st == OK && k < stamp_part_items(w, STAMP_FREQUENCIES); k++)
        st = stamp_part_frequencies(w, w, k);
    for (int k = 0; st == OK && k < stamp_part_items(w, STAMP_COLUMNS); k++)
        stamp_part_columns(w, w, k);
    for (int k = 0; st == OK && k < stamp_part_items(w, STAMP_ROWS); k++)
        stamp_part_rows(w, w, k, plane + (size_t)k * LANES * stride, stride);
    return st;
}

/* (re + i im) times c + i d, columns 0..m-1. */
static void row_turn(int m, double c, double d, double *re, double *im)
{
    for (int k = 0; k < m; k++) {
        const double a = re[k], b = im[k];
        re[k] = a * c - b * d;
        im[k] = a * d + b * c;
    }
}

int stamp_broad(const struct stamp_grid *g, struct stamp_work *w, const struct shape *s, double pixel, int nx, int ny, double x,
                double y, double flux, double kcut, double *out)
{
    if (!drawable(s, x, y, flux, kcut) || g->parts != 1 || !(pixel > 0) || nx < 1 || ny < 1)
        return E_RANGE;
    const int top = kcut < g->kmax ? (int)kcut : g->kmax;
    const size_t ld = round8((size_t)top + 1);
    const double step = pixel / (g->n * g->pixel);
    struct broad b;
    int st = start(g, w, s, x * pixel / g->pixel, y * pixel / g->pixel, flux, kcut, round8(broad_scratch((int)ld)));
    if (st)
        return st;
    const struct transform *t = &w->d.t;
    const struct row *r = &w->lines.row;
    double scale = flux * step * step;
    if (s->coef)
        scale *= TWO_PI * sqrt(s->beta_x * s->beta_y);
    broad_begin(&b, step, nx, ny, out, (int)ld, w->freq);
    for (int ky = 0; ky <= top; ky++) {
        int m;
        st = make_rows(&w->d, &w->lines, ky, &m);
        if (st)
            return st;
        row_turn(m, scale * t->y_re[ky], scale * t->y_im[ky], r->p_re, r->p_im);
        row_turn(m, scale * t->y_re[ky], -scale * t->y_im[ky], r->m_re, r->m_im);
        broad_take(&b, ky, m, r->p_re, r->p_im, r->m_re, r->m_im);
    }
    broad_end(&b);
    return OK;
}

/* ---- without a PSF ---- */

/* Pixel integrals or centre values along one axis, (nmax+1) x m; edge: m + 1 doubles of scratch. */
static int axis_pixels(int nmax, double beta, double pixel, double box, int m, double origin, double *edge,
                       double *b)
{
    if (box > 0) {
        for (int i = 0; i <= m; i++)
            edge[i] = (i - 0.5 - origin) * pixel;
        return shapelet_pixel(nmax, beta, m, edge, b);
    }
    for (int i = 0; i < m; i++)
        edge[i] = (i - origin) * pixel;
    int st = shapelet_basis(nmax, beta, m, edge, b);
    for (size_t i = 0; st == OK && i < (size_t)m * (size_t)(nmax + 1); i++)
        b[i] *= pixel;
    return st;
}

int stamp_closed(struct stamp_work *w, const struct shape *s, double pixel, double box, int nx, int ny,
                 double x, double y, double flux, double *out)
{
    if (!s->coef || s->mapped || nx < 1 || ny < 1 || !(pixel > 0) || !isfinite(x) || !isfinite(y) ||
        !isfinite(flux) || (box > 0 && box != pixel))
        return E_RANGE;
    const size_t orders = (size_t)s->nmax + 1, m = (size_t)(nx > ny ? nx : ny);
    int st = arena_reset(w, 2 * round8(orders * m) + round8(m + 1));
    if (st)
        return st;
    double *edge = arena_take(w, m + 1);
    double *bx = arena_take(w, orders * m), *by = arena_take(w, orders * m);
    st = axis_pixels(s->nmax, s->beta_x, pixel, box, nx, x, edge, bx);
    if (st == OK)
        st = axis_pixels(s->nmax, s->beta_y, pixel, box, ny, y, edge, by);
    if (st == OK)
        st = shapelet_pixel_sum(s->nmax, s->coef, nx, bx, ny, by, out);
    for (size_t i = 0; st == OK && i < (size_t)nx * (size_t)ny; i++)
        out[i] *= flux;
    return st;
}

int stamp_mapped(struct stamp_work *w, const struct shape *s, double pixel, double box, int nx, int ny, double x,
                 double y, double flux, double *out)
{
    if (!s->coef || s->beta_x != s->beta_y || nx < 1 || ny < 1 || !(pixel > 0) || !isfinite(x) || !isfinite(y) ||
        !isfinite(flux) || (box > 0 && box != pixel))
        return E_RANGE;
    int st = arena_reset(w, round8((size_t)nx + 1) + round8((size_t)ny + 1));
    if (st)
        return st;
    double *ex = arena_take(w, (size_t)nx + 1), *ey = arena_take(w, (size_t)ny + 1);
    const double *a = s->a, half = box > 0 ? 0.5 : 0;
    const double inverse[4] = {a[3], -a[1], -a[2], a[0]};   /* det A = 1 */
    for (int i = 0; i <= nx; i++)
        ex[i] = (i - half - x) * pixel;
    for (int j = 0; j <= ny; j++)
        ey[j] = (j - half - y) * pixel;
    if (box > 0)
        st = shear_pixels(s->nmax, s->beta_x, s->coef, inverse, nx, ex, ny, ey, out);
    else
        st = shear_grid(s->nmax, s->beta_x, s->coef, inverse, nx, ex, ny, ey, out, NULL);
    const double scale = box > 0 ? flux : flux * pixel * pixel;
    for (size_t i = 0; st == OK && i < (size_t)nx * (size_t)ny; i++)
        out[i] *= scale;
    return st;
}

/* Pixels and shares of a coordinate: one pixel, or two at an edge. */
static int point_axis(double x, double share[2])
{
    double i = floor(x + 0.5);
    int edge = x + 0.5 == i;
    share[0] = edge ? 0.5 : 1;
    share[1] = edge ? 0.5 : 0;
    return (int)i - edge;
}

void stamp_point(int nx, int ny, double x, double y, double flux, double *out)
{
    double sx[2], sy[2];
    memset(out, 0, (size_t)nx * (size_t)ny * sizeof *out);
    if (!(x > -1 && y > -1 && x < nx && y < ny))
        return;
    int i0 = point_axis(x, sx), j0 = point_axis(y, sy);
    for (int j = 0; j < 2; j++)
        for (int i = 0; i < 2; i++)
            if (i0 + i >= 0 && i0 + i < nx && j0 + j >= 0 && j0 + j < ny)
                out[(size_t)(j0 + j) * (size_t)nx + (size_t)(i0 + i)] += flux * sx[i] * sy[j];
}
