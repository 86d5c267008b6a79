/*
 * refshape.c - ellipticities by Gaussian-weighted second moments of an image, summed as
 * defined: every pixel, no end of the weight, centroids by Newton's method to rounding.
 *
 *   refshape IMAGE < "X Y SIGMA" lines, pixels from 1
 *
 * Prints e1 e2 of each line: (Jxx - Jyy, 2 Jxy) / (Jxx + Jyy), J the moments about the
 * weighted centroid with weight exp(-r^2 / (2 SIGMA^2)).  Shares nothing with rrgshape but the reading of images.
 */
#include "err.h"
#include "load.h"
#include <math.h>
#include <stdio.h>

/* sums[0..5]: 1, dx, dy, dx^2, dx dy, dy^2, weighted. */
static void sums_at(const struct image *im, double x, double y, double sigma, double sums[6])
{
    const double reach = 9 * sigma;
    const long y0 = (long)fmax(0, ceil(y - reach)), x0 = (long)fmax(0, ceil(x - reach));
    for (int k = 0; k < 6; k++)
        sums[k] = 0;
    for (long j = y0; j < im->ny && (double)j <= y + reach; j++)
        for (long i = x0; i < im->nx && (double)i <= x + reach; i++) {
            const double dx = (double)i - x, dy = (double)j - y;
            const double a = im->pix[j * im->nx + i] * exp(-(dx * dx + dy * dy) / (2 * sigma * sigma));
            const double term[6] = {a, a * dx, a * dy, a * dx * dx, a * dx * dy, a * dy * dy};
            for (int k = 0; k < 6; k++)
                sums[k] += term[k];
        }
}

int main(int argc, char **argv)
{
    double x, y, sigma, s[6];
    if (argc != 2)
        die(EXIT_USAGE, "usage: refshape IMAGE < list");
    struct image im = load(argv[1]);
    while (scanf("%lf %lf %lf", &x, &y, &sigma) == 3) {
        double step = 1;
        x -= 1;
        y -= 1;
        for (int k = 0; k < 60 && step > 1e-13; k++) {
            sums_at(&im, x, y, sigma, s);
            /* derivative of the weighted mean offset: (second moments / sigma^2 - 1), a 2 x 2 system */
            const double a = 1 - (s[3] / s[0] - s[1] * s[1] / (s[0] * s[0])) / (sigma * sigma);
            const double b = -(s[4] / s[0] - s[1] * s[2] / (s[0] * s[0])) / (sigma * sigma);
            const double d = 1 - (s[5] / s[0] - s[2] * s[2] / (s[0] * s[0])) / (sigma * sigma);
            const double det = a * d - b * b, u = s[1] / s[0], v = s[2] / s[0];
            const double dx = (d * u - b * v) / det, dy = (a * v - b * u) / det;
            x += dx;
            y += dy;
            step = hypot(dx, dy);
        }
        sums_at(&im, x, y, sigma, s);
        printf("%.12f %.12f\n", (s[3] - s[5]) / (s[3] + s[5]), 2 * s[4] / (s[3] + s[5]));
    }
    image_free(&im);
    return EXIT_DONE;
}
