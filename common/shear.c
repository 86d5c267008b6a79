/*
 * shear.c - shear acting on shapelets.
 *
 * Input is the reduced shear g; the map is area preserving, f'(x) = f(A x) with
 * A = exp(-Gamma), cosh|gamma| = (1 - |g|^2)^(-1/2).  In coefficients: rotate to
 * the shear axis, squeeze x and y in opposite senses, rotate back; or a power
 * series of the generators S1, S2 (Massey & Refregier 2005).  In space: A = R L
 * with R a rotation (exact in coefficients) and L lower triangular, which leaves one
 * small product per column.
 */
#include "shear.h"
#include "quad.h"
#include "shapelet.h"
#include "simd.h"
#include <math.h>
#include <string.h>

#define TOP SHAPELET_ROTMAX
#define SERIES_TOP (SHAPELET_ROTMAX + 16)
#define TILE 64
#define NOWHERE 1000000

int shear_matrix(double g1, double g2, double a[4])
{
    const double g = hypot(g1, g2);
    if (!(g < 1))
        return E_RANGE;
    const double cosh_gamma = 1 / sqrt((1 - g) * (1 + g));
    a[0] = cosh_gamma * (1 + g1);
    a[1] = a[2] = cosh_gamma * g2;
    a[3] = cosh_gamma * (1 - g1);
    return OK;
}

/* M += w * u v^T on the elements of even m+n. */
WIDE static void add_outer(int nin, int nout, double w, const double *u, const double *v, double *m)
{
    for (int i = 0; i <= nout; i++) {
        double *restrict row = m + (size_t)i * (size_t)(nin + 1);
        const double f = w * u[i];
        for (int n = i % 2; n <= nin; n += 2)
            row[n] += f * v[n];
    }
}

int shear_squeeze(int nin, int nout, double t, double *m)
{
    if (nin < 0 || nin > SHAPELET_NMAX || nout < 0 || nout > SHAPELET_NMAX || !(fabs(t) < 1))
        return E_RANGE;
    memset(m, 0, (size_t)(nin + 1) * (size_t)(nout + 1) * sizeof *m);
    if (t == 0) {
        for (int n = 0; n <= nin && n <= nout; n++)
            m[(size_t)n * (size_t)(nin + 2)] = 1;
        return OK;
    }
    const int nodes = (nin + nout) / 2 + 2;
    double y[QUAD_NMAX], w[QUAD_NMAX], u[SHAPELET_NMAX + 1], v[SHAPELET_NMAX + 1];
    int st = quad_hermite(nodes, y, w);
    /* x = y / sqrt((1 + e^-2r)/2) = y sqrt(1+t), e^-r x = y sqrt(1-t), e^-r/2 dx = (1-t^2)^1/4 dy */
    const double sx = sqrt(1 + t), sn = sqrt(1 - t), norm = sqrt(sx * sn);
    for (int k = nodes - 1; k >= nodes / 2 && !st; k--) {
        const double xm = y[k] * sx, xn = y[k] * sn;
        st = shapelet_basis(nout, 1, 1, &xm, u);
        if (!st)
            st = shapelet_basis(nin, 1, 1, &xn, v);
        /* the mirrored node gives the same product */
        add_outer(nin, nout, (y[k] > 0 ? 2 : 1) * norm * w[k], u, v, m);
    }
    return st;
}

/* Reduced shear as modulus and axis angle; the angle's rounding does not touch |g|. */
static int polar_shear(double g1, double g2, double *g, double *angle)
{
    *g = hypot(g1, g2);
    *angle = 0.5 * atan2(g2, g1);
    return *g < 1 ? OK : E_RANGE;
}

/* c (nmax) squeezed by +t in x, -t in y onto orders <= nout; mx: shear_squeeze(nmax, nout, t). */
static void squeeze_both(int nmax, int nout, const double *mx, const double *c, double *out)
{
    double half[(TOP + 1) * (TOP + 1)];
    const size_t row = (size_t)nmax + 1;
    for (int m1 = 0; m1 <= nout; m1++)
        for (int n2 = 0; n2 <= nmax; n2++) {
            double sum = 0;
            for (int n1 = m1 % 2; n1 <= nmax - n2; n1 += 2)
                sum += mx[(size_t)m1 * row + (size_t)n1] * c[shapelet_index(n1, n2)];
            half[(size_t)m1 * row + (size_t)n2] = sum;
        }
    for (int m1 = 0; m1 <= nout; m1++)
        for (int m2 = 0; m2 <= nout - m1; m2++) {
            /* M(-t) = (-1)^((m-n)/2) M(t) */
            double sum[2] = {0, 0};
            for (int n2 = m2 % 2, k = 0; n2 <= nmax; n2 += 2, k ^= 1)
                sum[k] += mx[(size_t)m2 * row + (size_t)n2] * half[(size_t)m1 * row + (size_t)n2];
            const double s = m2 % 4 < 2 ? sum[0] - sum[1] : sum[1] - sum[0];
            out[shapelet_index(m1, m2)] = s;
        }
}

int shear_exact(int nmax, const double *c, double g1, double g2, int nout, double *out)
{
    double g, angle;
    if (nmax < 0 || nout < nmax || nout > TOP || polar_shear(g1, g2, &g, &angle))
        return E_RANGE;
    if (g == 0) {
        memmove(out, c, shapelet_count(nmax) * sizeof *c);
        memset(out + shapelet_count(nmax), 0, (shapelet_count(nout) - shapelet_count(nmax)) * sizeof *c);
        return OK;
    }
    double m[(TOP + 1) * (TOP + 1)], turned[(TOP + 1) * (TOP + 2) / 2], wide[(TOP + 1) * (TOP + 2) / 2];
    int st = shear_squeeze(nmax, nout, g, m);
    if (!st)
        st = shapelet_rotate(nmax, -angle, c, turned);
    if (!st) {
        squeeze_both(nmax, nout, m, turned, wide);
        st = shapelet_rotate(nout, angle, wide, out);
    }
    return st;
}

int shear_matrix_coeff(int nmax, int nout, double g1, double g2, double *m)
{
    if (nmax < 0 || nout < nmax || nout > TOP || !(hypot(g1, g2) < 1))
        return E_RANGE;
    const size_t in = shapelet_count(nmax), n = shapelet_count(nout);
    double unit[(TOP + 1) * (TOP + 2) / 2] = {0}, column[(TOP + 1) * (TOP + 2) / 2];
    for (size_t j = 0; j < in; j++) {
        unit[j] = 1;
        int st = shear_exact(nmax, unit, g1, g2, nout, column);
        if (st)
            return st;
        unit[j] = 0;
        for (size_t i = 0; i < n; i++)
            m[i * in + j] = column[i];
    }
    return OK;
}

/* Eight running sums, so that the products vectorise; elements of unlike parity are stored zeros. */
WIDE static void multiply(size_t n, size_t in, const double *m, const double *c, double *out)
{
    for (size_t i = 0; i < n; i++, m += in) {
        double part[8] = {0}, rest = 0;
        size_t j = 0;
        for (; j + 8 <= in; j += 8)
            for (int k = 0; k < 8; k++)
                part[k] += m[j + (size_t)k] * c[j + (size_t)k];
        for (; j < in; j++)
            rest += m[j] * c[j];
        out[i] = ((part[0] + part[4]) + (part[1] + part[5])) + ((part[2] + part[6]) + (part[3] + part[7])) + rest;
    }
}

void shear_apply(int nmax, int nout, const double *m, const double *c, double *out)
{
    multiply(shapelet_count(nout), shapelet_count(nmax), m, c, out);
}

int shear_growth(int nmax, double g, double eps)
{
    g = fabs(g);
    if (nmax < 0 || !(g < 1) || !(eps > 0))
        return NOWHERE;
    if (g == 0 || eps >= 1)
        return 0;
    /* nmax (e^{2|gamma|} - 1), the tail of a Gaussian, and a mixed term fitted to exact tails */
    const double reach = nmax * (2 * g / (1 - g)), depth = fmax(-log(eps), 4.6);
    const double tail = 2 * (depth - log(1.0 + nmax)) / -log(g) + 1.7 * sqrt(reach * depth);
    const double sum = 2 * ceil(0.5 * fmax(reach + tail, 0));      /* shear moves orders by 2 */
    return sum < NOWHERE ? (int)sum : NOWHERE;
}

/* out (orders <= n+2) = gamma1 S1 f + gamma2 S2 f, f of orders <= n. */
static void generator(int n, double gamma1, double gamma2, const double *f, double *out)
{
    memset(out, 0, shapelet_count(n + 2) * sizeof *out);
    for (int k = 0; k <= n; k++)
        for (int n1 = 0; n1 <= k; n1++) {
            const int n2 = k - n1;
            const double v = f[shapelet_index(n1, n2)], s1 = 0.5 * gamma1 * v, s2 = gamma2 * v;
            out[shapelet_index(n1 + 2, n2)] += s1 * sqrt((n1 + 1.0) * (n1 + 2));
            out[shapelet_index(n1, n2 + 2)] -= s1 * sqrt((n2 + 1.0) * (n2 + 2));
            out[shapelet_index(n1 + 1, n2 + 1)] += s2 * sqrt((n1 + 1.0) * (n2 + 1));
            if (n1 >= 2)
                out[shapelet_index(n1 - 2, n2)] -= s1 * sqrt(n1 * (n1 - 1.0));
            if (n2 >= 2)
                out[shapelet_index(n1, n2 - 2)] += s1 * sqrt(n2 * (n2 - 1.0));
            if (n1 >= 1 && n2 >= 1)
                out[shapelet_index(n1 - 1, n2 - 1)] -= s2 * sqrt((double)n1 * n2);
        }
}

int shear_series(int nmax, const double *c, double g1, double g2, int order, double *out)
{
    const double g = hypot(g1, g2);
    if (nmax < 0 || nmax > TOP || order < 1 || order > 8 || !(g < 1))
        return E_RANGE;
    const double stretch = g > 0 ? atanh(g) / g : 1;
    double term[2][(SERIES_TOP + 1) * (SERIES_TOP + 2) / 2], sum[(SERIES_TOP + 1) * (SERIES_TOP + 2) / 2] = {0};
    memcpy(term[0], c, shapelet_count(nmax) * sizeof *c);
    memcpy(sum, c, shapelet_count(nmax) * sizeof *c);
    for (int j = 1; j <= order; j++) {
        const double *last = term[(j - 1) % 2];
        double *here = term[j % 2];
        generator(nmax + 2 * (j - 1), g1 * stretch / j, g2 * stretch / j, last, here);
        for (size_t i = 0; i < shapelet_count(nmax + 2 * j); i++)
            sum[i] += here[i];
    }
    memcpy(out, sum, shapelet_count(nmax + 2 * order) * sizeof *out);
    return OK;
}

/* A = R L: turned = coefficients of f(R .), l = {L11, L21, L22}, L22 > 0. */
static int triangular(int nmax, double beta, const double *c, const double a[4], double *turned, double l[3])
{
    l[2] = hypot(a[1], a[3]);
    const double sin_r = -a[1] / l[2], cos_r = a[3] / l[2];
    l[0] = cos_r * a[0] + sin_r * a[2];
    l[1] = -sin_r * a[0] + cos_r * a[2];
    if (nmax < 0 || nmax > TOP || !(beta > 0) || !isfinite(beta) || !(fabs(l[0]) > 0) || !isfinite(l[0])
        || !isfinite(l[1]) || !(l[2] > 0) || !isfinite(l[2]))
        return E_RANGE;
    return shapelet_rotate(nmax, -atan2(sin_r, cos_r), c, turned);
}

/* v[n2] = sum_n1 c_n1n2 bx[n1], n1+n2 even (parity 0), odd (1) or all (2). */
static void column_sums(int nmax, const double *c, const double *bx, int parity, double *v)
{
    for (int n2 = 0; n2 <= nmax; n2++) {
        double sum = 0;
        const int first = parity == 2 ? 0 : (n2 + parity) % 2, step = parity == 2 ? 1 : 2;
        size_t i = shapelet_index(first, n2);
        for (int n1 = first; n1 <= nmax - n2; n1 += step) {
            const size_t n = (size_t)(n1 + n2);
            sum += c[i] * bx[n1];
            i += step == 1 ? n + 2 : 2 * n + 5;    /* index of n1 + step */
        }
        v[n2] = sum;
    }
}

/* sum[j] += sum_n v[n] b[n*len + j] */
WIDE static void add_rows(int nmax, int len, const double *v, const double *b, double *restrict sum)
{
    for (int n = 0; n <= nmax; n++) {
        const double *restrict row = b + (size_t)n * (size_t)len;
        for (int j = 0; j < len; j++)
            sum[j] += v[n] * row[j];
    }
}

int shear_grid(int nmax, double beta, const double *c, const double a[4],
               int nx, const double *x, int ny, const double *y, double *even, double *odd)
{
    double turned[(TOP + 1) * (TOP + 2) / 2], l[3];
    if (nx < 0 || ny < 0 || triangular(nmax, beta, c, a, turned, l))
        return E_RANGE;
    double bx[TOP + 1], v[TOP + 1], at[TILE], by[(TOP + 1) * TILE];
    int st = OK;
    for (int j0 = 0; j0 < ny; j0 += TILE)
        for (int i = 0; i < nx && !st; i++) {
            const int len = ny - j0 < TILE ? ny - j0 : TILE;
            const double u = l[0] * x[i];
            for (int j = 0; j < len; j++)
                at[j] = l[1] * x[i] + l[2] * y[j0 + j];
            st = shapelet_basis(nmax, beta, 1, &u, bx);
            if (!st)
                st = shapelet_basis(nmax, beta, len, at, by);
            for (int parity = odd ? 0 : 2; parity < (odd ? 2 : 3); parity++) {
                double sum[TILE] = {0};
                double *to = parity == 1 ? odd : even;
                column_sums(nmax, turned, bx, parity, v);
                add_rows(nmax, len, v, by, sum);
                for (int j = 0; j < len; j++)
                    to[(size_t)(j0 + j) * (size_t)nx + (size_t)i] = sum[j];
            }
        }
    return st;
}

/* Nodes and weights in x over [lo, hi], cut to |x| <= reach: `panels` equal panels of q nodes. */
struct strip {
    double lo, width;
    int panels;
};

/* Add the integral over one column strip and one tile of y edges to sum[0..len-1]. */
static int strip_integral(int nmax, double beta, const double *c, const double l[3], const struct strip *s,
                          int q, const double *node, const double *weight, int len, const double *ye, double *sum)
{
    const double reach = beta * (sqrt(2.0 * nmax + 2) + 10);   /* beyond, phi_n < 1e-16 */
    double bx[TOP + 1], v[TOP + 1], edge[TILE + 1], by[(TOP + 1) * TILE];
    int st = OK;
    for (int k = 0; k < s->panels * q && !st; k++) {
        const double x = s->lo + s->width * (k / q + 0.5 + 0.5 * node[k % q]);
        const double u = l[0] * x, w = 0.5 * s->width * weight[k % q] / l[2];
        int first = 0, last = len;
        for (int j = 0; j <= len; j++)
            edge[j] = l[1] * x + l[2] * ye[j];
        while (first < last && edge[first + 1] < -reach)
            first++;
        while (last > first && edge[last - 1] > reach)
            last--;
        if (first == last)
            continue;
        st = shapelet_basis(nmax, beta, 1, &u, bx);
        if (!st)
            st = shapelet_pixel(nmax, beta, last - first, edge + first, by);
        column_sums(nmax, c, bx, 2, v);
        for (int n = 0; n <= nmax; n++)
            v[n] *= w;
        add_rows(nmax, last - first, v, by, sum + first);
    }
    return st;
}

int shear_pixels(int nmax, double beta, const double *c, const double a[4],
                 int nx, const double *xe, int ny, const double *ye, double *out)
{
    double turned[(TOP + 1) * (TOP + 2) / 2], l[3], node[QUAD_NMAX], weight[QUAD_NMAX];
    if (nx < 0 || ny < 0 || triangular(nmax, beta, c, a, turned, l))
        return E_RANGE;
    for (int i = 0; i < nx; i++)
        if (!(xe[i + 1] >= xe[i]))
            return E_RANGE;
    /* largest wave number along x in rad/u: turning point and tail, times the stretch of A along x */
    const double root = sqrt(2.0 * nmax + 1), stretch = hypot(a[0], a[2]);
    const double k = (root + 4) * stretch / beta, reach = (root + 10) * beta / fabs(l[0]);
    if (!(2 * reach * k < 1e7))
        return E_RANGE;
    int st = OK;
    for (int i = 0; i < nx && !st; i++) {
        struct strip s = {.lo = fmax(xe[i], -reach)};
        const double span = fmax(0, fmin(xe[i + 1], reach) - s.lo);
        s.panels = span > 0 ? (int)ceil(span * k / 12) : 0;
        s.width = span / (s.panels ? s.panels : 1);
        const int q = 6 + (int)ceil(s.width * k);
        st = quad_legendre(q, node, weight);
        for (int j0 = 0; j0 < ny && !st; j0 += TILE) {
            const int len = ny - j0 < TILE ? ny - j0 : TILE;
            double sum[TILE] = {0};
            st = strip_integral(nmax, beta, turned, l, &s, q, node, weight, len, ye + j0, sum);
            for (int j = 0; j < len; j++)
                out[(size_t)(j0 + j) * (size_t)nx + (size_t)i] = sum[j];
        }
    }
    return st;
}
