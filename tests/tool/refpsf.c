/*
 * refpsf.c - errors of PSF images against the square of the pupil's Fourier transform,
 * which shares no code with psfgen: no grid of cells, no transfer function, no period.
 *
 *   refpsf DIAMETER OBSCURATION STRUTS WIDTH ANGLE NM BAND SCALE IMAGE...
 *
 * amplitude(x) = sum over lines of the pupil of the integral of exp(2 pi i p.x / lambda) over its
 * intervals, each in closed form; lines at Chebyshev points of the radius.  Of a band, Simpson's rule
 * over 61 wavelengths, weights 1/lambda.  Prints for each image the largest and rms error of its
 * inner 2 arcsec over the peak, the relative error of the peak, and the flux left out, 1 - sum.
 */
#include "err.h"
#include "load.h"
#include <complex.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { LINES = 3000, WAVES = 61, CUTS = 64 };

struct pupil {
    double r, hole, width, angle;
    int struts;
};

static void *need(size_t n, size_t size)
{
    void *p = calloc(n, size);
    if (!p)
        die(EXIT_RUN, "memory");
    return p;
}

static int rising(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static int open_at(const struct pupil *p, double x, double y)
{
    const double r2 = x * x + y * y;
    if (r2 > p->r * p->r || r2 < p->hole * p->hole)
        return 0;
    for (int s = 0; s < p->struts; s++) {
        const double a = p->angle + 2 * M_PI * s / p->struts, along = x * cos(a) + y * sin(a), across = -x * sin(a) + y * cos(a);
        if (along > 0 && fabs(across) < p->width / 2)
            return 0;
    }
    return 1;
}

/* Open intervals of the line y: pairs in c; returns how many numbers. */
static int intervals(const struct pupil *p, double y, double c[CUTS])
{
    double cut[CUTS];
    int n = 0, m = 0;
    cut[n++] = -sqrt(fmax(0, p->r * p->r - y * y));
    cut[n++] = -cut[0];
    if (fabs(y) < p->hole) {
        cut[n++] = sqrt(p->hole * p->hole - y * y);
        cut[n] = -cut[n - 1];
        n++;
    }
    for (int s = 0; s < p->struts && n < CUTS - 4; s++) {
        const double a = p->angle + 2 * M_PI * s / p->struts;
        if (fabs(sin(a)) > 1e-12)
            for (int side = -1; side <= 1; side += 2)
                cut[n++] = (y * cos(a) - side * p->width / 2) / sin(a);
        if (fabs(cos(a)) > 1e-12)
            cut[n++] = -y * sin(a) / cos(a);
    }
    qsort(cut, (size_t)n, sizeof *cut, rising);
    for (int i = 0; i + 1 < n; i++)
        if (cut[i + 1] > cut[i] && open_at(p, (cut[i] + cut[i + 1]) / 2, y)) {
            if (m && c[m - 1] == cut[i]) {
                c[m - 1] = cut[i + 1];
            } else {
                c[m++] = cut[i];
                c[m++] = cut[i + 1];
            }
        }
    return m;
}

/* Add weight * scale^2 * PSF at one wavelength on m x m samples about the origin. */
static void add(const struct pupil *p, double lambda, double scale, double weight, int m, double *out)
{
    const double k = 2 * M_PI / lambda * scale / 206264.80624709636;
    double complex *line = need((size_t)m * LINES, sizeof *line);
    double *y = need(LINES, sizeof *y), area = 0;
    for (int l = 0; l < LINES; l++) {
        const double t = M_PI * (l + 0.5) / LINES, dy = p->r * sin(t) * M_PI / LINES;
        double c[CUTS];
        y[l] = p->r * cos(t);
        const int n = intervals(p, y[l], c);
        for (int i = 0; i < n; i += 2)
            area += dy * (c[i + 1] - c[i]);
        for (int x = 0; x < m; x++) {
            const double q = k * (x - m / 2);
            double complex s = 0;
            for (int i = 0; i < n; i += 2)
                s += q == 0 ? c[i + 1] - c[i] : (cexp(I * q * c[i + 1]) - cexp(I * q * c[i])) / (I * q);
            line[(size_t)x * LINES + (size_t)l] = s * dy;
        }
    }
    const double norm = weight * (k / (2 * M_PI)) * (k / (2 * M_PI)) / area;
    double complex *turn = need(LINES, sizeof *turn);
    for (int j = 0; j < m; j++) {
        for (int l = 0; l < LINES; l++)
            turn[l] = cexp(I * k * (j - m / 2) * y[l]);
        for (int x = 0; x < m; x++) {
            double complex s = 0;
            for (int l = 0; l < LINES; l++)
                s += line[(size_t)x * LINES + (size_t)l] * turn[l];
            out[j * m + x] += norm * (creal(s) * creal(s) + cimag(s) * cimag(s));
        }
    }
    free(turn);
    free(line);
    free(y);
}

static void compare(const char *name, int m, const double *want)
{
    struct image im = load(name);
    double worst = 0, square = 0, sum = 0, peak = want[(m / 2) * m + m / 2];
    if (im.nx < m || im.ny < m || im.nx % 2 == 0 || im.ny % 2 == 0)
        die(EXIT_RUN, "%s: sides must be odd, %d or more", name, m);
    const long x0 = im.nx / 2 - m / 2, y0 = im.ny / 2 - m / 2;
    for (size_t i = 0; i < image_count(&im); i++)
        sum += (double)im.pix[i];
    for (int i = 0; i < m * m; i++) {
        const double d = ((double)im.pix[(y0 + i / m) * im.nx + x0 + i % m] - want[i]) / peak;
        worst = fmax(worst, fabs(d));
        square += d * d;
    }
    printf("%.2e %.2e %.2e %.2e\n", worst, sqrt(square) / m, (double)im.pix[(im.ny / 2) * im.nx + im.nx / 2] / peak - 1, 1 - sum);
    image_free(&im);
}

int main(int argc, char **argv)
{
    if (argc < 10)
        die(EXIT_USAGE, "usage: refpsf DIAMETER OBSCURATION STRUTS WIDTH ANGLE NM BAND SCALE IMAGE...");
    double v[8];
    for (int i = 0; i < 8; i++)
        v[i] = strtod(argv[i + 1], NULL);
    const struct pupil p = {.r = v[0] / 2, .hole = v[0] * v[1] / 2, .struts = (int)v[2], .width = v[3], .angle = v[4] * M_PI / 180};
    const int m = 2 * (int)(1 / v[7]) + 1;
    double *want = need((size_t)m * (size_t)m, sizeof *want), total = 0;
    const int n = v[6] > 0 ? WAVES : 1;
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < n; i++) {
            const double nm = v[5] + (n > 1 ? v[6] * (i / (WAVES - 1.0) - 0.5) : 0);
            const double w = (n == 1 ? 1 : i == 0 || i == n - 1 ? 1 : i % 2 ? 4 : 2) / nm;
            if (pass)
                add(&p, nm * 1e-9, v[7], w / total, m, want);
            else
                total += w;
        }
    for (int i = 9; i < argc; i++)
        compare(argv[i], m, want);
    free(want);
    return 0;
}
