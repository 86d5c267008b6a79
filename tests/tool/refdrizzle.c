/*
 * refdrizzle.c - errors of drizzled images against overlaps of polygons, clipped edge by
 * edge; no kernel, map or strip of drizzle's is used.
 *
 *   refdrizzle PIXFRAC TURN RATIO CX CY EXPOSURE,CX,CY[,...]... -- IMAGE...
 *
 * Output pixel = C_out + RATIO R(TURN) (input pixel - C_in), pixels counted from 1, TURN in radian; the drop
 * is the square of side PIXFRAC about the centre of a pixel.  Value = sum(a d) / sum(a) / RATIO^2, a the area of
 * the drop inside the output pixel.  Prints for each image the largest and the rms difference over the rms of the
 * reference where both are numbers, and how many pixels only one of them has.
 */
#include "load.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct corner {
    double x, y;
};

struct map {
    double c, s, out_x, out_y, pixfrac;
};

/* Keep the part of a polygon where sign * coordinate <= sign * limit (axis 0: x, 1: y). */
static int clip(const struct corner *p, int n, int axis, double sign, double limit, struct corner *q)
{
    int m = 0;
    for (int i = 0; i < n; i++) {
        const struct corner a = p[i], b = p[(i + 1) % n];
        const double da = sign * ((axis ? a.y : a.x) - limit), db = sign * ((axis ? b.y : b.x) - limit);
        if (da <= 0)
            q[m++] = a;
        if ((da < 0 && db > 0) || (da > 0 && db < 0)) {
            const double f = da / (da - db);
            q[m++] = (struct corner){a.x + f * (b.x - a.x), a.y + f * (b.y - a.y)};
        }
    }
    return m;
}

static double area(const struct corner *p, int n, double x0, double y0)
{
    double sum = 0;
    for (int i = 0; i < n; i++) {
        const struct corner a = p[i], b = p[(i + 1) % n];
        sum += (a.x - x0) * (b.y - y0) - (b.x - x0) * (a.y - y0);
    }
    return fabs(sum) / 2;
}

/* Area of the drop inside the pixel centred on (i, j). */
static double overlap(const struct corner drop[4], long i, long j)
{
    struct corner a[12], b[12];
    int n = clip(drop, 4, 0, 1, (double)i + 0.5, a);
    n = clip(a, n, 0, -1, (double)i - 0.5, b);
    n = clip(b, n, 1, 1, (double)j + 0.5, a);
    n = clip(a, n, 1, -1, (double)j - 0.5, b);
    return n > 2 ? area(b, n, (double)i, (double)j) : 0;
}

static void drop_pixel(const struct map *m, double u, double v, double value, long nx, long ny, double *sum, double *weight)
{
    const double h = m->pixfrac / 2, at[4][2] = {{-h, -h}, {h, -h}, {h, h}, {-h, h}};
    struct corner drop[4];
    double lo[2] = {1e300, 1e300}, hi[2] = {-1e300, -1e300};
    for (int k = 0; k < 4; k++) {
        const double x = u + at[k][0], y = v + at[k][1];
        drop[k] = (struct corner){m->out_x + m->c * x - m->s * y, m->out_y + m->s * x + m->c * y};
        lo[0] = fmin(lo[0], drop[k].x), hi[0] = fmax(hi[0], drop[k].x);
        lo[1] = fmin(lo[1], drop[k].y), hi[1] = fmax(hi[1], drop[k].y);
    }
    for (long j = (long)fmax(1, floor(lo[1])); j <= ny && (double)j < hi[1] + 1; j++)
        for (long i = (long)fmax(1, floor(lo[0])); i <= nx && (double)i < hi[0] + 1; i++) {
            const double a = overlap(drop, i, j);
            sum[(j - 1) * nx + i - 1] += a * value;
            weight[(j - 1) * nx + i - 1] += a;
        }
}

static void compare(const char *name, size_t n, const double *sum, const double *weight, double scale)
{
    struct image im = load(name);
    double worst = 0, square = 0, norm = 0;
    size_t both = 0, one = 0;
    if (image_count(&im) != n)
        die(EXIT_RUN, "%s: not of the size of the first", name);
    for (size_t i = 0; i < n; i++) {
        const int there = weight[i] > 0, here = !isnan(im.pix[i]);
        one += there != here;
        if (!there || !here)
            continue;
        const double want = sum[i] / weight[i] * scale, d = im.pix[i] - want;
        worst = fmax(worst, fabs(d));
        square += d * d;
        norm += want * want;
        both++;
    }
    const double rms = sqrt(norm / (double)both);
    printf("%.2e %.2e %zu\n", worst / rms, sqrt(square / (double)both) / rms, one);
    image_free(&im);
}

int main(int argc, char **argv)
{
    if (argc < 8)
        die(EXIT_USAGE, "usage: refdrizzle PIXFRAC TURN RATIO CX CY EXPOSURE,CX,CY... -- IMAGE...");
    const double turn = strtod(argv[2], NULL), ratio = strtod(argv[3], NULL);
    const struct map m = {ratio * cos(turn), ratio * sin(turn), strtod(argv[4], NULL), strtod(argv[5], NULL), strtod(argv[1], NULL)};
    int first = 6;
    while (first < argc && strcmp(argv[first], "--"))
        first++;
    if (first + 1 >= argc)
        die(EXIT_USAGE, "no image to compare");
    struct image like = load(argv[first + 1]);
    const size_t n = image_count(&like);
    double *sum = calloc(2 * n, sizeof *sum);
    if (!sum)
        die(EXIT_RUN, "memory");
    for (int k = 6; k < first; k++) {
        char name[256];
        double cx, cy;
        if (sscanf(argv[k], "%255[^,],%lf,%lf", name, &cx, &cy) != 3)
            die(EXIT_USAGE, "%s: EXPOSURE,CX,CY", argv[k]);
        struct image im = load(name);
        for (long y = 0; y < im.ny; y++)
            for (long x = 0; x < im.nx; x++)
                drop_pixel(&m, (double)x + 1 - cx, (double)y + 1 - cy, im.pix[y * im.nx + x], like.nx, like.ny, sum, sum + n);
        image_free(&im);
    }
    for (int k = first + 1; k < argc; k++)
        compare(argv[k], n, sum, sum + n, 1 / (ratio * ratio));
    free(sum);
    image_free(&like);
    return EXIT_DONE;
}
