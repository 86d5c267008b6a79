/*
 * pix.c - numbers of images for test scripts.
 *
 *   pix noise TRUE1 NOISY1 TRUE2 NOISY2 LIMIT   correlation of the two noises (noisy - true - mean) over
 *                                               pixels whose true values differ by less than LIMIT of the
 *                                               noisy mean; prints correlation and number of pixels
 *   pix diff A B                                largest |a - b| / largest |a|, and number of differing pixels
 *   pix sum A                                   sum of the pixels
 */
#include "load.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void noise(char **name, double limit)
{
    struct image t1 = load(name[0]), n1 = load(name[1]), t2 = load(name[2]), n2 = load(name[3]);
    const size_t n = image_count(&t1);
    double mean = 0;
    for (size_t i = 0; i < n; i++)
        mean += (double)n1.pix[i] / (double)n;
    double a = 0, b = 0, aa = 0, bb = 0, ab = 0, m = 0;
    for (size_t i = 0; i < n; i++) {
        if (!(fabs((double)t1.pix[i] - (double)t2.pix[i]) < limit * mean))
            continue;
        double x = (double)n1.pix[i] - (double)t1.pix[i] - mean, y = (double)n2.pix[i] - (double)t2.pix[i] - mean;
        m++;
        a += x;
        b += y;
        aa += x * x;
        bb += y * y;
        ab += x * y;
    }
    image_free(&t1);
    image_free(&n1);
    image_free(&t2);
    image_free(&n2);
    printf("%.6f %.0f\n", (ab - a * b / m) / sqrt((aa - a * a / m) * (bb - b * b / m)), m);
}

static void diff(char **name)
{
    struct image a = load(name[0]), b = load(name[1]);
    if (a.nx != b.nx || a.ny != b.ny)
        die(EXIT_RUN, "%s: %ld x %ld, not %ld x %ld", name[1], b.nx, b.ny, a.nx, a.ny);
    double worst = 0, peak = 0;
    long other = 0;
    for (size_t i = 0; i < image_count(&a); i++) {
        double d = fabs((double)a.pix[i] - (double)b.pix[i]);
        other += memcmp(&a.pix[i], &b.pix[i], sizeof(float)) != 0;
        if (!(d <= worst))
            worst = d;
        peak = fmax(peak, fabs((double)a.pix[i]));
    }
    image_free(&a);
    image_free(&b);
    printf("%.6g %ld\n", worst / peak, other);
}

static void sum(const char *name)
{
    struct image a = load(name);
    double s = 0;
    for (size_t i = 0; i < image_count(&a); i++)
        s += (double)a.pix[i];
    image_free(&a);
    printf("%.15g\n", s);
}

int main(int argc, char **argv)
{
    if (argc == 7 && !strcmp(argv[1], "noise"))
        noise(argv + 2, strtod(argv[6], NULL));
    else if (argc == 4 && !strcmp(argv[1], "diff"))
        diff(argv + 2);
    else if (argc == 3 && !strcmp(argv[1], "sum"))
        sum(argv[2]);
    else
        die(EXIT_USAGE, "usage: pix noise T1 N1 T2 N2 LIMIT | pix diff A B | pix sum A");
    return 0;
}
