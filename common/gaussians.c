/*
 * gaussians.c - exact shapelet coefficients of sums of Gaussians.
 *
 * Gaussians are taken eight at a time, one per vector lane; lanes are added in
 * a fixed order, so that every vector width gives the same bits.  A group that
 * stands at the origin has even orders only.
 */
#include "gaussians.h"
#include "simd.h"
#include <math.h>
#include <string.h>

enum { LANES = 8, COUNT = (GAUSSIANS_NMAX + 1) * (GAUSSIANS_NMAX + 2) / 2 };

int gaussians_add(struct gaussians *g, double flux, double x, double y, double sxx, double sxy, double syy)
{
    int i = g->n, central = x == 0 && y == 0 && g->n_central == i;
    if (i >= GAUSSIANS_MAX)
        return E_RANGE;
    g->flux[i] = flux;
    g->x[i] = x;
    g->y[i] = y;
    g->sxx[i] = sxx;
    g->sxy[i] = sxy;
    g->syy[i] = syy;
    g->n++;
    g->n_central += central;
    return OK;
}

/* What the recurrence needs, one Gaussian per lane. */
struct group {
    double c00[LANES], b1[LANES], b2[LANES], a11[LANES], a12[LANES], a22[LANES];
};

/* Gaussians first..end-1 (at most LANES) at scale beta; unused lanes are 0. */
static void group_make(struct group *p, const struct gaussians *g, int first, int end, double beta)
{
    memset(p, 0, sizeof *p);
    double v = beta * beta;
    for (int k = 0, i = first; i < end; i++, k++) {
        double xx = g->sxx[i], xy = g->sxy[i], yy = g->syy[i], x = g->x[i], y = g->y[i];
        double det = 1 / ((xx + v) * (yy + v) - xy * xy);
        double txx = (yy + v) * det, tyy = (xx + v) * det, txy = -xy * det;
        double bx = txx * x + txy * y, by = txy * x + tyy * y, far = x * bx + y * by;
        p->a11[k] = (xx - v) * txx + xy * txy;
        p->a12[k] = (xx - v) * txy + xy * tyy;
        p->a22[k] = xy * txy + (yy - v) * tyy;
        p->b1[k] = 1.4142135623730951 * beta * bx;
        p->b2[k] = 1.4142135623730951 * beta * by;
        p->c00[k] = g->flux[i] * beta * 0.5641895835477563 * sqrt(det) * (far > 0 ? exp(-0.5 * far) : 1);
    }
}

/*
 * Coefficients of one group: c[index][lane], orders 0..nmax, every order
 * (step 1) or the even ones (step 2, b = 0).  root[n] = sqrt(n).
 */
static WIDE void group_recur(const struct group *restrict p, int nmax, int step, const double *restrict root,
                             double (*restrict c)[LANES])
{
    for (int k = 0; k < LANES; k++)
        c[0][k] = p->c00[k];
    for (int n = step; n <= nmax; n += step) {
        double (*here)[LANES] = c + n * (n + 1) / 2;
        double (*one)[LANES] = c + (n - 1) * n / 2;                      /* order n - 1 */
        double (*two)[LANES] = n >= 2 ? c + (n - 2) * (n - 1) / 2 : c;   /* order n - 2; times 0 when there is none */
        double u = 1 / root[n], r = n >= 2 ? root[n - 1] * u : 0;
        if (step == 2) {
            for (int k = 0; k < LANES; k++)
                here[0][k] = p->a22[k] * r * two[0][k];
            for (int n1 = 1; n1 <= n; n1++) {
                double v = 1 / root[n1], r1 = root[n1 - 1] * v, r2 = root[n - n1] * v;
                const double *left = two[n1 >= 2 ? n1 - 2 : 0], *below = two[n1 < n ? n1 - 1 : 0];
                for (int k = 0; k < LANES; k++)
                    here[n1][k] = p->a11[k] * r1 * left[k] + p->a12[k] * r2 * below[k];
            }
        } else {
            for (int k = 0; k < LANES; k++)
                here[0][k] = p->b2[k] * u * one[0][k] + p->a22[k] * r * two[0][k];
            for (int n1 = 1; n1 <= n; n1++) {
                double v = 1 / root[n1], r1 = root[n1 - 1] * v, r2 = root[n - n1] * v;
                const double *left = two[n1 >= 2 ? n1 - 2 : 0], *below = two[n1 < n ? n1 - 1 : 0];
                for (int k = 0; k < LANES; k++)
                    here[n1][k] = p->b1[k] * v * one[n1 - 1][k] + p->a11[k] * r1 * left[k] + p->a12[k] * r2 * below[k];
            }
        }
    }
}

/* sum[i] += the lanes of c[i], as ((0+4)+(2+6)) + ((1+5)+(3+7)). */
static void group_sum(int nmax, int step, double (*c)[LANES], double *sum)
{
    for (int n = 0; n <= nmax; n += step)
        for (int i = n * (n + 1) / 2; i < (n + 1) * (n + 2) / 2; i++)
            sum[i] += ((c[i][0] + c[i][4]) + (c[i][2] + c[i][6])) + ((c[i][1] + c[i][5]) + (c[i][3] + c[i][7]));
}

int gaussians_project(const struct gaussians *g, int nmax, double beta, double *c)
{
    double work[COUNT][LANES], root[GAUSSIANS_NMAX + 1];
    if (nmax < 0 || nmax > GAUSSIANS_NMAX || !(beta > 0) || !isfinite(beta))
        return E_RANGE;
    for (int n = 0; n <= nmax; n++)
        root[n] = sqrt(n);
    memset(c, 0, (size_t)((nmax + 1) * (nmax + 2) / 2) * sizeof *c);
    for (int first = 0; first < g->n;) {
        int central = first < g->n_central, last = central ? g->n_central : g->n;
        int end = last < first + LANES ? last : first + LANES;
        struct group p;
        group_make(&p, g, first, end, beta);
        group_recur(&p, nmax, central ? 2 : 1, root, work);
        group_sum(nmax, central ? 2 : 1, work, c);
        first = end;
    }
    return OK;
}

double gaussians_power(const struct gaussians *g)
{
    double sum = 0;
    for (int i = 0; i < g->n; i++)
        for (int j = 0; j <= i; j++) {
            double xx = g->sxx[i] + g->sxx[j], xy = g->sxy[i] + g->sxy[j], yy = g->syy[i] + g->syy[j];
            double x = g->x[i] - g->x[j], y = g->y[i] - g->y[j], det = xx * yy - xy * xy;
            double far = (yy * x * x - 2 * xy * x * y + xx * y * y) / det;
            double one = g->flux[i] * g->flux[j] * 0.15915494309189535 / sqrt(det);
            sum += (i == j ? 1 : 2) * one * (far > 0 ? exp(-0.5 * far) : 1);
        }
    return sum;
}
