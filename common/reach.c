/* reach.c - how far objects reach in space and frequency. */
#include "reach.h"
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

/* Largest |pixel| by radius, and flux beyond, from an n x n image of a star at (n/2, n/2). */
static void profile(struct wings *w, int n, const double *image, double scale)
{
    double rest = 0;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            double value = image[(size_t)j * (size_t)n + (size_t)i];
            int k = (int)(hypot(i - n / 2, j - n / 2) + 0.5);
            if (k >= w->n) {
                rest += value;
                continue;
            }
            w->w[k] = fmax(w->w[k], fabs(value) * scale);
            w->out[k] += value;
        }
    for (int k = w->n - 1; k >= 0; k--) {
        rest += w->out[k];
        w->out[k] = fabs(rest);
        if (k < w->n - 1)
            w->w[k] = fmax(w->w[k], w->w[k + 1]);
    }
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

int wings_new(struct wings *w, const struct otf *t, const struct stamp_response *r, double pixel)
{
    if (!(pixel > 0))
        return E_RANGE;
    const int fine = pixel * t->ucut > 0.6 ? (int)ceil(pixel * t->ucut / 0.6) : 1;
    const double step = pixel / fine;
    double side = 26 / step;
    const int n = side < 64 ? 64 : side > 1024 ? 1024 : fft_good_size((int)side);
    struct stamp_grid g = {0};
    struct stamp_work *work = NULL;
    int st = stamp_grid_new(&g, t, r, step, n);
    if (st)
        return st;
    struct wings m = {.pixel = pixel, .n = n / 2, .dr = step, .nu = (int)(1.5 * g.kmax) + 2, .du = g.du};
    m.w = calloc((size_t)m.n, sizeof *m.w);
    m.out = calloc((size_t)m.n, sizeof *m.out);
    m.tail = calloc((size_t)m.nu, sizeof *m.tail);
    double *image = fft_alloc((size_t)n * (size_t)n * sizeof *image);
    st = m.w && m.out && m.tail && image ? stamp_work_new(&work) : E_NOMEM;
    const struct shape star = {0};
    if (st == OK)
        st = stamp_fourier(&g, work, &star, n / 2, n / 2, 1, 2.0 * g.kmax + 1, image);
    if (st == OK) {
        profile(&m, n, image, (double)fine * fine);
        band_tail(&m, &g);
        st = stamp_fourier(&g, work, &star, n / 2 + 0.5 * fine, n / 2 + 0.5 * fine, 1, 2.0 * g.kmax + 1, image);
        m.peak = fine * fine * fmax(image[(size_t)(n / 2) * (size_t)n + (size_t)(n / 2)], 1e-6 * m.w[0]);
        m.core = pixel / sqrt(2 * M_PI * fmin(m.w[0], 1));
    }
    stamp_work_free(work);
    fft_free(image);
    stamp_grid_free(&g);
    if (st)
        wings_free(&m);
    else
        *w = m;
    return st;
}

void wings_free(struct wings *w)
{
    free(w->w);
    free(w->out);
    free(w->tail);
    *w = (struct wings){0};
}

double wings_folded(const struct wings *w, double near, double half, int n)
{
    /* nearer the border of the table its own replicas count: continue by the laws r^-3 and r^-1 */
    const int last = w->n - w->n / 8;
    const int i = near <= 0 ? 0 : near < last * w->dr ? (int)(near / w->dr) : last;
    const int k = half <= 0 ? 0 : half < last * w->dr ? (int)(half / w->dr) : last;
    const double far = near > last * w->dr ? near / (last * w->dr) : 1;
    const double out = half > last * w->dr ? half / (last * w->dr) : 1;
    return w->w[i] / (far * far * far) + w->out[k] / out / ((double)n * n);
}

double wings_tail(const struct wings *w, double u)
{
    double i = u / w->du;
    return i < w->nu ? w->tail[(int)i] : 0;
}
