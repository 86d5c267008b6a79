/*
 * shapeconv.c - convolution in shapelet coefficients.
 *
 * The transform of B_n(x; beta) is sqrt(2 pi) (-i)^n B_n(k; 1/beta), so every element is an
 * integral over k of a polynomial times a Gaussian, exact by Gauss-Hermite.
 */
#include "shapeconv.h"
#include "quad.h"
#include "shapelet.h"
#include <math.h>
#include <string.h>

#define TOP SHAPECONV_NMAX
#define NODES (3 * TOP / 2 + 2)

double shapeconv_scale(double alpha, double beta)
{
    return hypot(alpha, beta);
}

static int good(int n, double scale)
{
    return n >= 0 && n <= TOP && scale > 0 && isfinite(scale);
}

/* Nodes and weights in k for exp(-k^2 s^2) times a polynomial of degree <= sum; returns their number. */
static int nodes_in_k(int sum, double s, double *k, double *w, int *count)
{
    *count = sum / 2 + 2;
    int st = quad_hermite(*count, k, w);
    for (int i = 0; i < *count && !st; i++) {
        k[i] /= s;
        w[i] /= s;
    }
    return st;
}

/* sqrt((a^2 + b^2 + c^2)/2) without overflow. */
static double width(double a, double b, double c)
{
    return hypot(hypot(a, b), c) * M_SQRT1_2;
}

int shapeconv_tensor(int nout, double gamma, int nm, double alpha, int nl, double beta, double *c)
{
    if (!good(nout, gamma) || !good(nm, alpha) || !good(nl, beta))
        return E_RANGE;
    double k[NODES], w[NODES], a[TOP + 1], b[TOP + 1], g[TOP + 1];
    const size_t rows = (size_t)nm + 1, cols = (size_t)nl + 1;
    int count, st = nodes_in_k(nout + nm + nl, width(alpha, beta, gamma), k, w, &count);
    memset(c, 0, (size_t)(nout + 1) * rows * cols * sizeof *c);
    for (int i = count / 2; i < count && !st; i++) {
        if ((st = shapelet_basis(nout, 1 / gamma, 1, k + i, g)) || (st = shapelet_basis(nm, 1 / alpha, 1, k + i, a))
            || (st = shapelet_basis(nl, 1 / beta, 1, k + i, b)))
            break;
        const double weight = sqrt(2 * M_PI) * w[i] * (k[i] > 0 ? 2 : 1);
        for (int n = 0; n <= nout; n++)
            for (int m = 0; m <= nm; m++) {
                const double f = weight * g[n] * a[m];
                for (int l = (n + m) % 2; l <= nl; l += 2)
                    c[((size_t)n * rows + (size_t)m) * cols + (size_t)l] += (n - m - l) % 4 ? -f * b[l] : f * b[l];
            }
    }
    return st;
}

int shapeconv_gauss(int nin, double beta, double sigma, int nout, double gamma, double *m)
{
    if (!good(nin, beta) || !good(nout, gamma) || !(sigma >= 0) || !isfinite(sigma))
        return E_RANGE;
    double k[NODES], w[NODES], a[TOP + 1], g[TOP + 1];
    const size_t cols = (size_t)nin + 1;
    int count, st = nodes_in_k(nout + nin, width(beta, gamma, sigma), k, w, &count);
    memset(m, 0, (size_t)(nout + 1) * cols * sizeof *m);
    for (int i = count / 2; i < count && !st; i++) {
        if ((st = shapelet_basis(nout, 1 / gamma, 1, k + i, g)) || (st = shapelet_basis(nin, 1 / beta, 1, k + i, a)))
            break;
        const double q = sigma * k[i], weight = w[i] * exp(-0.5 * q * q) * (k[i] > 0 ? 2 : 1);
        for (int o = 0; o <= nout; o++)
            for (int n = o % 2; n <= nin; n += 2)
                m[(size_t)o * cols + (size_t)n] += (o - n) % 4 ? -weight * g[o] * a[n] : weight * g[o] * a[n];
    }
    return st;
}

int shapeconv_gauss_object(int nmax, double beta, double sigma, const double *c, double *out)
{
    double m[(TOP + 1) * (TOP + 1)], half[(TOP + 1) * (TOP + 1)];
    int st = shapeconv_gauss(nmax, beta, sigma, nmax, shapeconv_scale(beta, sigma), m);
    if (st)
        return st;
    const size_t row = (size_t)nmax + 1;
    /* m is upper triangular in the natural scale: orders only fall */
    for (int k = 0; k <= nmax; k++)
        for (int n2 = 0; n2 <= nmax - k; n2++) {
            double sum = 0;
            for (int n1 = k; n1 <= nmax - n2; n1 += 2)
                sum += m[(size_t)k * row + (size_t)n1] * c[shapelet_index(n1, n2)];
            half[(size_t)k * row + (size_t)n2] = sum;
        }
    for (int k1 = 0; k1 <= nmax; k1++)
        for (int k2 = 0; k2 <= nmax - k1; k2++) {
            double sum = 0;
            for (int n2 = k2; n2 <= nmax - k1; n2 += 2)
                sum += m[(size_t)k2 * row + (size_t)n2] * half[(size_t)k1 * row + (size_t)n2];
            out[shapelet_index(k1, k2)] = sum;
        }
    return OK;
}

/* One row of nodes of a transform: even and odd orders at (k[i], k[row]), i < count. */
static void transform_row(int nmax, const double *c, int count, const double *b, int row, double *even, double *odd)
{
    for (int i = 0; i < count; i++)
        even[i] = odd[i] = 0;
    for (int n1 = 0; n1 <= nmax; n1++) {
        double v[2] = {0, 0};
        for (int n2 = 0; n2 <= nmax - n1; n2++)
            v[(n1 + n2) % 2] += c[shapelet_index(n1, n2)] * b[n2 * count + row];
        for (int i = 0; i < count; i++) {
            even[i] += v[0] * b[n1 * count + i];
            odd[i] += v[1] * b[n1 * count + i];
        }
    }
}

/* out += weight times the projection of the product's row on B_n1(k) B_n2(k[row]). */
static void project_row(int nout, int count, const double *b, int row, double weight,
                        const double *re, const double *im, double *out)
{
    for (int n1 = 0; n1 <= nout; n1++) {
        double v[2] = {0, 0};
        for (int i = 0; i < count; i++) {
            v[0] += re[i] * b[n1 * count + i];
            v[1] += im[i] * b[n1 * count + i];
        }
        for (int n2 = 0; n2 <= nout - n1; n2++)
            out[shapelet_index(n1, n2)] += weight * b[n2 * count + row] * v[(n1 + n2) % 2];
    }
}

int shapeconv_object(int nf, double alpha, const double *f, int nh, double beta, const double *h,
                     int nout, double gamma, double *out)
{
    if (!good(nf, alpha) || !good(nh, beta) || !good(nout, gamma))
        return E_RANGE;
    enum { SIZE = (TOP + 1) * (TOP + 2) / 2 };
    double k[NODES], w[NODES], bf[(TOP + 1) * NODES], bh[(TOP + 1) * NODES], bo[(TOP + 1) * NODES];
    double tf[SIZE], th[SIZE], sum[SIZE] = {0}, fe[NODES], fo[NODES], he[NODES], ho[NODES];
    int count, st = nodes_in_k(nf + nh + nout, width(alpha, beta, gamma), k, w, &count);
    if (st || (st = shapelet_basis(nf, 1 / alpha, count, k, bf)) || (st = shapelet_basis(nh, 1 / beta, count, k, bh))
        || (st = shapelet_basis(nout, 1 / gamma, count, k, bo)))
        return st;
    shapelet_fourier(nf, f, tf);
    shapelet_fourier(nh, h, th);
    /* the lower half plane is the conjugate of the upper one */
    for (int j = count / 2; j < count; j++) {
        transform_row(nf, tf, count, bf, j, fe, fo);
        transform_row(nh, th, count, bh, j, he, ho);
        for (int i = 0; i < count; i++) {
            const double re = fe[i] * he[i] - fo[i] * ho[i], im = fe[i] * ho[i] + fo[i] * he[i];
            fe[i] = w[i] * re;
            fo[i] = w[i] * im;
        }
        project_row(nout, count, bo, j, 2 * M_PI * w[j] * (k[j] > 0 ? 2 : 1), fe, fo, sum);
    }
    shapelet_fourier(nout, sum, out);
    return OK;
}
