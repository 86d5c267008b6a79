/* reach.c - how far objects reach in space and frequency. */
#include "reach.h"
#include "fft.h"
#include "shapelet.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PER_BETA 8
#define TAIL_BETA 10           /* beyond the turning point phi_n < 1e-16 */

/* ---- shapelets ---- */

int envelope_new(struct envelope *e, int nmax)
{
    if (nmax < 0 || nmax > SHAPELET_NMAX)
        return E_RANGE;
    const int steps = (int)((sqrt(2.0 * nmax + 2) + TAIL_BETA) * PER_BETA) + 2;
    const size_t rows = (size_t)nmax + 1;
    double *k = malloc((size_t)steps * rows * sizeof *k);
    double *phi = malloc(2 * rows * sizeof *phi), *centre = phi + rows;
    int st = k && phi ? OK : E_NOMEM;
    const double zero = 0;
    if (st == OK)
        st = shapelet_basis(nmax, 1, 1, &zero, centre);
    for (int i = 0; i < steps && st == OK; i++) {
        const double r = (double)i / PER_BETA;
        st = shapelet_basis(nmax, 1, 1, &r, phi);
        for (int n = 0; n <= nmax; n++) {
            double sum = 0;
            for (int n2 = 0; n2 <= n; n2 += 2)
                sum += phi[n - n2] * phi[n - n2] * centre[n2] * centre[n2];
            k[(size_t)i * rows + (size_t)n] = sqrt(sum);
        }
    }
    free(phi);
    if (st) {
        free(k);
        return st;
    }
    for (int i = steps - 2; i >= 0; i--)
        for (size_t n = 0; n < rows; n++)
            k[(size_t)i * rows + n] = fmax(k[(size_t)i * rows + n], k[((size_t)i + 1) * rows + n]);
    *e = (struct envelope){nmax, steps, k};
    return OK;
}

void envelope_free(struct envelope *e)
{
    free(e->k);
    *e = (struct envelope){0};
}

void envelope_shells(int nmax, const double *c, double *p)
{
    for (int n = 0; n <= nmax; n++) {
        double sum = 0;
        for (int n1 = 0; n1 <= n; n1++, c++)
            sum += *c * *c;
        p[n] = sqrt(sum);
    }
}

static double at_step(const struct envelope *e, int nmax, const double *p, int i)
{
    const double *k = e->k + (size_t)i * ((size_t)e->nmax + 1);
    double sum = 0;
    for (int n = 0; n <= nmax; n++)
        sum += p[n] * k[n];
    return sum;
}

double envelope_reach(const struct envelope *e, int nmax, const double *p, double limit)
{
    int lo = 0, hi = e->steps - 1;   /* the last step is far beyond every order */
    while (lo < hi) {
        int mid = (lo + hi) / 2;
        if (at_step(e, nmax, p, mid) <= limit)
            hi = mid;
        else
            lo = mid + 1;
    }
    return (double)lo / PER_BETA;
}

double envelope_value(const struct envelope *e, int nmax, const double *p, double r)
{
    int i = r * PER_BETA < e->steps - 1 ? (int)(r * PER_BETA) : e->steps - 1;
    return at_step(e, nmax, p, i);
}

/* ---- PSF ---- */

/*
 * Largest |pixel| by radius from an n x n image of a star at (n/2, n/2) with pixels of
 * `every` dr; out (or NULL): flux beyond.
 */
static void profile(const struct wings *m, int n, int every, const double *image, double *w, double *out)
{
    const double scale = m->pixel * m->pixel / (m->dr * m->dr * every * every);
    double rest = 0;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            double value = image[(size_t)j * (size_t)n + (size_t)i];
            const int dx = abs(i - n / 2), dy = abs(j - n / 2), k = (int)(((dx > dy ? dx : dy) + 0.5) * every);
            if (k >= m->n) {
                rest += value;
                continue;
            }
            w[k] = fmax(w[k], fabs(value) * scale);
            if (out)
                out[k] += value;
        }
    for (int k = m->n - 1; k >= 0; k--) {
        if (k < m->n - 1)
            w[k] = fmax(w[k], w[k + 1]);
        if (!out)
            continue;
        rest += out[k];
        out[k] = fabs(rest);
    }
}

/* Multiply the table by the transform of a Gaussian of variance `var` arcsec^2. */
static int smooth(struct stamp_grid *g, double var)
{
    double *f = malloc(((size_t)g->kmax + 1) * sizeof *f);
    if (!f)
        return E_NOMEM;
    for (int i = 0; i <= g->kmax; i++)
        f[i] = exp(-2 * M_PI * M_PI * var * (i * g->du) * (i * g->du));
    for (int row = 0; row <= 2 * g->kmax; row++)
        for (int i = 0; i <= g->kmax; i++) {
            const size_t at = (size_t)row * (size_t)g->ld + (size_t)i;
            const double factor = f[abs(row - g->kmax)] * f[i];
            g->t_re[at] *= factor;
            if (g->t_im)
                g->t_im[at] *= factor;
        }
    free(f);
    return OK;
}

/* Profiles of broad objects: the same frequencies on coarser pixels. */
static int broad_levels(struct wings *m, struct stamp_grid *g, struct stamp_work *work, double *image)
{
    static const double sigma[WINGS_LEVELS] = {0, 0.1, 0.2, 0.4};
    static const int every[WINGS_LEVELS] = {1, 2, 4, 4};
    const struct shape star = {0};
    for (int l = 1; l < WINGS_LEVELS; l++) {
        struct stamp_grid coarse = *g;
        coarse.n = g->n / every[l];
        coarse.pixel = g->pixel * every[l];
        int st = smooth(g, sigma[l] * sigma[l] - sigma[l - 1] * sigma[l - 1]);
        if (st == OK)
            st = lanes_new(&coarse.fft, coarse.n);
        if (st)
            return st;
        st = stamp_fourier(&coarse, work, &star, coarse.n / 2, coarse.n / 2, 1, 1.1 / (sigma[l] * g->du), image);
        lanes_free(coarse.fft);
        if (st)
            return st;
        m->sigma[l] = sigma[l];
        profile(m, coarse.n, every[l], image, m->w[l], NULL);
    }
    return OK;
}

/* tail[i] from the table of T; every |u| <= (i+1) du counts as i. */
static void band_tail(struct wings *w, const struct stamp_grid *g)
{
    const double cell = w->pixel * w->pixel * g->du * g->du;
    for (int row = 0; row <= 2 * g->kmax; row++)
        for (int i = 0; i <= g->kmax; i++) {
            size_t at = (size_t)row * (size_t)g->ld + (size_t)i;
            double t = hypot(g->t_re[at], g->t_im ? g->t_im[at] : 0);
            int k = (int)hypot(row - g->kmax, i);
            w->tail[k < w->nu - 1 ? k : w->nu - 1] += (i ? 2 : 1) * cell * t;
        }
    for (int k = w->nu - 2; k >= 0; k--)
        w->tail[k] += w->tail[k + 1];
}

/* Peak of a star on the corner of four pixels: its value half a pixel away in x and y. */
static double star_peak(const struct wings *m, int n, int fine, const double *image)
{
    const double scale = fine * fine;
    if (fine == 1)                     /* well sampled: the geometric mean of its neighbours is below it */
        return scale * sqrt(fabs(m->w[0][0] / scale * image[(size_t)(n / 2 + 1) * (size_t)n + (size_t)(n / 2 + 1)]));
    const int d = fine / 2 + fine % 2;
    return scale * fmax(image[(size_t)(n / 2 + d) * (size_t)n + (size_t)(n / 2 + d)], 1e-6 * m->w[0][0]);
}

int wings_new(struct wings *w, const struct otf *t, const struct stamp_response *r, double pixel, double width)
{
    if (!(pixel > 0) || !(width >= WINGS_WIDTH))
        return E_RANGE;
    const int fine = pixel * t->ucut > 0.6 ? (int)ceil(pixel * t->ucut / 0.6) : 1;
    const double step = pixel / fine;
    const double side = width / step, most = width > WINGS_WIDTH ? 2048 : 1024;
    const int n = 4 * (side < 64 ? 16 : side > most ? (int)most / 4 : fft_good_size((int)(side / 4)));
    struct stamp_grid g = {0};
    struct stamp_work *work = NULL;
    int st = stamp_grid_new(&g, t, r, step, n);
    if (st)
        return st;
    struct wings m = {.pixel = pixel, .n = n / 2, .dr = step, .nu = (int)(1.5 * g.kmax) + 2, .du = g.du};
    double *space = calloc((WINGS_LEVELS + 1) * (size_t)m.n + (size_t)m.nu, sizeof *space);
    for (int l = 0; space && l < WINGS_LEVELS; l++)
        m.w[l] = space + (size_t)l * (size_t)m.n;
    double *image = fft_alloc((size_t)n * (size_t)n * sizeof *image);
    st = space && image ? stamp_work_new(&work) : E_NOMEM;
    const struct shape star = {0};
    if (st == OK)
        st = stamp_fourier(&g, work, &star, n / 2, n / 2, 1, 2.0 * g.kmax + 1, image);
    if (st == OK) {
        m.out = space + WINGS_LEVELS * (size_t)m.n;
        m.tail = m.out + m.n;
        profile(&m, n, 1, image, m.w[0], m.out);
        band_tail(&m, &g);
        m.core = pixel / sqrt(2 * M_PI * fmin(m.w[0][0], 1));
        m.peak = star_peak(&m, n, fine, image);
        st = broad_levels(&m, &g, work, image);
    }
    stamp_work_free(work);
    fft_free(image);
    stamp_grid_free(&g);
    if (st)
        free(space);
    else
        *w = m;
    return st;
}

void wings_free(struct wings *w)
{
    free(w->w[0]);
    *w = (struct wings){0};
}

double wings_folded(const struct wings *w, double sigma, double extent, double half, double n)
{
    /* nearer the border of the table its own replicas count: continue by the laws r^-3 and r^-1 */
    const int last = w->n - w->n / 8;
    int l = WINGS_LEVELS - 1;
    while (w->sigma[l] > sigma)
        l--;
    const double near = half - (extent - w->sigma[l]);
    const int i = near <= 0 ? 0 : near < last * w->dr ? (int)(near / w->dr) : last;
    const int k = half <= 0 ? 0 : half < last * w->dr ? (int)(half / w->dr) : last;
    const double far = near > last * w->dr ? near / (last * w->dr) : 1;
    const double out = half > last * w->dr ? half / (last * w->dr) : 1;
    return w->w[l][i] / (far * far * far) + w->out[k] / out / (n * n);
}

double wings_tail(const struct wings *w, double u)
{
    double i = u / w->du * (1 + 1e-12);
    return i < w->nu ? w->tail[(int)i] : 0;
}
