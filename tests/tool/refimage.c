/*
 * refimage.c - errors of simage against plain integrals that share no code with it.
 *
 *   refimage PSF SCALE U PIXEL HALF OBJECTS IMAGE...
 *
 * PSF: image sampled every SCALE arcsec, cut off at |ux|, |uy| = U cycles/arcsec, or "none".
 * OBJECTS: lines "x y g1 g2 beta nmax coefficients": FITS pixels, reduced shear,
 * arcsec; nmax -1 is a star.  Flux 1.  IMAGE: every object's pixels within HALF arcsec of it are compared.
 *
 * With a PSF, pixel = flux PIXEL^2 int F(u) T(u) sinc sinc exp(2 pi i u.x) d2u by Gauss-Legendre nodes
 * over the whole band (no stamp, no period, no transform); without, Gauss-Legendre inside each
 * pixel.  Hermite functions come from the coefficients of their polynomials in long double.
 *
 * Prints one line per image: median and worst over the objects of the largest pixel error over
 * the object's peak, then worst error of the flux inside HALF, and of the size
 * sqrt(<r^2>) under a Gaussian weight of 0.3 arcsec.
 */
#include "err.h"
#include "load.h"
#include <complex.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ORDERS = 32, OBJECTS = 64, INSIDE = 14 };

struct object {
    double x, y, g[2], beta;
    int nmax;
    double c[ORDERS * (ORDERS + 1) / 2];
};

/* Band nodes: u[i] > 0 half, all v; T at (v, u). */
struct band {
    int n, half;             /* nodes of the whole axis, of u > 0 */
    double *u, *w;
    double complex *t;       /* n x half */
};

static long double herm[ORDERS][ORDERS];     /* coefficients of x^k in phi_n exp(x^2/2) */

static void *need(size_t n, size_t size)
{
    void *p = calloc(n, size);
    if (!p)
        die(EXIT_RUN, "memory");
    return p;
}

static void hermite_table(void)
{
    herm[0][0] = 1 / sqrtl(sqrtl(acosl(-1)));
    for (int n = 1; n < ORDERS; n++)          /* H_n = 2 x H_n-1 - H_n-1', with the norm put in */
        for (int k = 0; k <= n; k++) {
            long double up = k > 0 ? 2 * herm[n - 1][k - 1] : 0;
            long double slope = k + 1 < n ? (long double)(k + 1) * herm[n - 1][k + 1] : 0;
            herm[n][k] = (up - slope) / sqrtl(2 * (long double)n);
        }
}

static void hermite(int nmax, long double x, long double *f)
{
    const long double e = expl(-x * x / 2);
    for (int n = 0; n <= nmax; n++) {
        long double s = 0;
        for (int k = n; k >= 0; k--)
            s = s * x + herm[n][k];
        f[n] = s * e;
    }
}

/* Gauss-Legendre on [a, b] by Newton steps on the Legendre polynomial. */
static void gauss(int n, double a, double b, double *x, double *w)
{
    for (int i = 0; i < n; i++) {
        long double z = cosl(acosl(-1) * (i + 0.75L) / (n + 0.5L)), slope = 1, p = 1;
        for (int it = 0; it < 100 && fabsl(p) > 1e-19L; it++) {
            long double p0 = 1, p1 = z;
            for (int k = 2; k <= n; k++) {
                long double p2 = ((2 * k - 1) * z * p1 - (k - 1) * p0) / k;
                p0 = p1;
                p1 = p2;
            }
            p = p1;
            slope = n * (z * p1 - p0) / (z * z - 1);
            z -= p / slope;
        }
        x[i] = (double)((a + b) / 2 - (b - a) / 2 * z);
        w[i] = (double)((b - a) / ((1 - z * z) * slope * slope));
    }
}

/* exp(+Gamma s) of a reduced shear. */
static void shear(const double g[2], double s, double a[4])
{
    const double n = 1 / sqrt(1 - g[0] * g[0] - g[1] * g[1]);
    a[0] = n * (1 + s * g[0]);
    a[1] = a[2] = n * s * g[1];
    a[3] = n * (1 - s * g[0]);
}

static double complex transform(const struct object *o, double u, double v)
{
    static const double complex turn[4] = {1, -I, -1, I};
    if (o->nmax < 0)
        return 1;
    double a[4];
    shear(o->g, 1, a);
    long double fx[ORDERS], fy[ORDERS];
    const double k = 2 * M_PI * o->beta;
    hermite(o->nmax, k * (a[0] * u + a[1] * v), fx);
    hermite(o->nmax, k * (a[2] * u + a[3] * v), fy);
    double complex s = 0;
    const double *c = o->c;
    for (int n = 0; n <= o->nmax; n++)
        for (int n1 = 0; n1 <= n; n1++)
            s += turn[n & 3] * (*c++ * (double)(fx[n1] * fy[n - n1]));
    return 2 * M_PI * o->beta * s;
}

static double brightness(const struct object *o, const double a[4], double x, double y)
{
    long double fx[ORDERS], fy[ORDERS], s = 0;
    hermite(o->nmax, (a[0] * x + a[1] * y) / o->beta, fx);
    hermite(o->nmax, (a[2] * x + a[3] * y) / o->beta, fy);
    const double *c = o->c;
    for (int n = 0; n <= o->nmax; n++)
        for (int n1 = 0; n1 <= n; n1++)
            s += *c++ * fx[n1] * fy[n - n1];
    return (double)s / o->beta;
}

/* T of the samples at the nodes, by two sums. */
static void band_open(struct band *b, const char *name, double scale, double cut, double reach)
{
    struct image p = load(name);
    const double extent = reach + 0.5 * scale * (double)p.nx;
    b->n = 2 * (int)(0.5 * 1.15 * M_PI * cut * extent + 40);
    b->half = b->n / 2;
    b->u = need((size_t)b->n, sizeof *b->u);
    b->w = need((size_t)b->n, sizeof *b->w);
    b->t = need((size_t)b->n * (size_t)b->half, sizeof *b->t);
    gauss(b->n, -cut, cut, b->u, b->w);
    double complex *row = need((size_t)p.ny, sizeof *row), *turn = need((size_t)p.nx + (size_t)p.ny, sizeof *turn);
    for (int i = 0; i < b->half; i++) {
        for (long x = 0; x < p.nx; x++)
            turn[x] = cexp(-2 * M_PI * I * b->u[b->half + i] * scale * ((double)x - 0.5 * (double)(p.nx - 1)));
        for (long y = 0; y < p.ny; y++) {
            row[y] = 0;
            for (long x = 0; x < p.nx; x++)
                row[y] += (double)p.pix[y * p.nx + x] * turn[x];
        }
        for (int j = 0; j < b->n; j++) {
            double complex s = 0, f = cexp(-2 * M_PI * I * b->u[j] * scale), z = cexp(M_PI * I * b->u[j] * scale * (double)(p.ny - 1));
            for (long y = 0; y < p.ny; y++, z *= f)
                s += row[y] * z;
            b->t[(size_t)j * (size_t)b->half + (size_t)i] = s;
        }
    }
    free(row);
    free(turn);
    image_free(&p);
}

static double sinc(double x)
{
    return x == 0 ? 1 : sin(M_PI * x) / (M_PI * x);
}

/* m x m pixels from (x0, y0), counting from 0, object at (x, y). */
static void with_psf(const struct band *b, const struct object *o, double pixel, int m, double x, double y, double *out)
{
    double complex *half = need((size_t)m * (size_t)b->half, sizeof *half);
    for (int i = 0; i < b->half; i++) {
        const double u = b->u[b->half + i];
        for (int j = 0; j < b->n; j++) {
            const double v = b->u[j];
            double complex g = 2 * b->w[b->half + i] * b->w[j] * pixel * pixel * sinc(u * pixel) * sinc(v * pixel)
                * b->t[(size_t)j * (size_t)b->half + (size_t)i] * transform(o, u, v);
            const double complex f = cexp(2 * M_PI * I * v * pixel);
            g *= cexp(-2 * M_PI * I * v * pixel * y);
            for (int r = 0; r < m; r++, g *= f)
                half[(size_t)r * (size_t)b->half + (size_t)i] += g;
        }
    }
    memset(out, 0, (size_t)m * (size_t)m * sizeof *out);
    for (int i = 0; i < b->half; i++) {
        const double a = 2 * M_PI * b->u[b->half + i] * pixel;
        for (int c = 0; c < m; c++) {
            const double complex f = cexp(I * a * (c - x));
            for (int r = 0; r < m; r++)
                out[r * m + c] += creal(half[(size_t)r * (size_t)b->half + (size_t)i] * f);
        }
    }
    free(half);
}

static void without(const struct object *o, double pixel, int m, double x, double y, double *out)
{
    double a[4], node[INSIDE], weight[INSIDE];
    shear(o->g, -1, a);
    gauss(INSIDE, -0.5, 0.5, node, weight);
    for (int r = 0; r < m; r++)
        for (int c = 0; c < m; c++) {
            double s = 0;
            for (int j = 0; j < INSIDE; j++)
                for (int i = 0; i < INSIDE; i++)
                    s += weight[i] * weight[j] * brightness(o, a, (c + node[i] - x) * pixel, (r + node[j] - y) * pixel);
            out[r * m + c] = s * pixel * pixel;
        }
}

/* Flux, size under the weight, peak. */
static void measure(int m, double pixel, double x, double y, const double *v, double q[3])
{
    double weight = 0, second = 0;
    q[0] = q[2] = 0;
    for (int r = 0; r < m; r++)
        for (int c = 0; c < m; c++) {
            const double r2 = ((c - x) * (c - x) + (r - y) * (r - y)) * pixel * pixel, w = exp(-r2 / (2 * 0.09));
            q[0] += v[r * m + c];
            weight += w * v[r * m + c];
            second += w * r2 * v[r * m + c];
            q[2] = fmax(q[2], fabs(v[r * m + c]));
        }
    q[1] = sqrt(fabs(second / weight));
}

static int read_objects(const char *name, struct object *o)
{
    FILE *f = fopen(name, "r");
    int n = 0;
    if (!f)
        die(EXIT_RUN, "%s: cannot be read", name);
    while (n < OBJECTS && fscanf(f, "%lf %lf %lf %lf %lf %d", &o[n].x, &o[n].y, &o[n].g[0], &o[n].g[1], &o[n].beta, &o[n].nmax) == 6) {
        if (o[n].nmax >= ORDERS)
            die(EXIT_RUN, "%s: order above %d", name, ORDERS - 1);
        for (int k = 0; k < (o[n].nmax + 1) * (o[n].nmax + 2) / 2; k++)
            if (fscanf(f, "%lf", &o[n].c[k]) != 1)
                die(EXIT_RUN, "%s: a coefficient is missing", name);
        n++;
    }
    fclose(f);
    return n;
}

static int rising(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Compare one image with the answers. */
static void compare(const char *name, int n, const struct object *o, double pixel, int m, const double *want)
{
    struct image im = load(name);
    double worst[OBJECTS], flux = 0, size = 0, *got = need((size_t)m * (size_t)m, sizeof *got);
    for (int k = 0; k < n; k++) {
        const long x0 = lround(o[k].x) - 1 - m / 2, y0 = lround(o[k].y) - 1 - m / 2;
        const double x = o[k].x - 1 - (double)x0, y = o[k].y - 1 - (double)y0;
        const double *w = want + (size_t)k * (size_t)m * (size_t)m;
        double a[3], b[3];
        if (x0 < 0 || y0 < 0 || x0 + m > im.nx || y0 + m > im.ny)
            die(EXIT_RUN, "%s: object %d is too near the border", name, k + 1);
        for (int i = 0; i < m * m; i++)
            got[i] = (double)im.pix[(y0 + i / m) * im.nx + x0 + i % m];
        measure(m, pixel, x, y, w, a);
        measure(m, pixel, x, y, got, b);
        worst[k] = 0;
        for (int i = 0; i < m * m; i++)
            worst[k] = fmax(worst[k], fabs(got[i] - w[i]) / a[2]);
        flux = fmax(flux, fabs(b[0] - a[0]));
        size = fmax(size, fabs(b[1] / a[1] - 1));
    }
    qsort(worst, (size_t)n, sizeof *worst, rising);
    printf("%.2e %.2e %.2e %.2e\n", worst[n / 2], worst[n - 1], flux, size);
    fflush(stdout);
    image_free(&im);
    free(got);
}

int main(int argc, char **argv)
{
    static struct object o[OBJECTS];
    if (argc < 8)
        die(EXIT_USAGE, "usage: refimage PSF|none SCALE U PIXEL HALF OBJECTS IMAGE...");
    const double scale = strtod(argv[2], NULL), cut = strtod(argv[3], NULL), pixel = strtod(argv[4], NULL);
    const double half = strtod(argv[5], NULL);
    const int n = read_objects(argv[6], o), m = 2 * (int)ceil(half / pixel) + 1, none = !strcmp(argv[1], "none");
    struct band b = {0};
    hermite_table();
    if (!none)
        band_open(&b, argv[1], scale, cut, 1.5 * half);
    double *want = need((size_t)n * (size_t)m * (size_t)m, sizeof *want);
    for (int k = 0; k < n; k++) {
        const double x = o[k].x - (double)(lround(o[k].x) - m / 2), y = o[k].y - (double)(lround(o[k].y) - m / 2);
        double *w = want + (size_t)k * (size_t)m * (size_t)m;
        if (none)
            without(&o[k], pixel, m, x, y, w);
        else
            with_psf(&b, &o[k], pixel, m, x, y, w);
    }
    for (int i = 7; i < argc; i++)
        compare(argv[i], n, o, pixel, m, want);
    free(want);
    free(b.u);
    free(b.w);
    free(b.t);
    return 0;
}
