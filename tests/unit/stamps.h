/*
 * stamps.h - small images for the shape tests: sums of Gaussians, and the
 * reference stamps of ../shared/truth/rrg.
 *
 * The reader of this header knows only the plain FITS of those stamps (float64,
 * cards KEY = number); it shares nothing with the reader of the project.
 */
#ifndef PIXSHEAR_STAMPS_H
#define PIXSHEAR_STAMPS_H

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

__attribute__((unused))
static void stamp_fill(double *pix, int n)
{
    memset(pix, 0, (size_t)n * (size_t)n * sizeof *pix);
}

/* Add a Gaussian of this flux and covariance, sampled at pixel centres. */
__attribute__((unused))
static void stamp_gauss(double *pix, int n, double cx, double cy, double flux, double xx, double xy, double yy)
{
    double det = xx * yy - xy * xy, a = yy / det, b = xx / det, c = -xy / det;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            double x = i - cx, y = j - cy;
            pix[j * n + i] += flux / (2 * M_PI * sqrt(det)) * exp(-0.5 * (a * x * x + b * y * y + 2 * c * x * y));
        }
}

struct truth_stamp {
    long nx, ny;
    double x, y, w;          /* start, from 0; width */
    double *pix;
};

static double card_number(const char *block, const char *key, double otherwise)
{
    char name[10];
    snprintf(name, sizeof name, "%-8s=", key);
    for (const char *p = block; strncmp(p, "END ", 4) != 0; p += 80)
        if (strncmp(p, name, 9) == 0)
            return strtod(p + 10, NULL);
    return otherwise;
}

/* HDU 0 or 1 of dir/name.fits; one header block each, doubles. 1 when read. */
__attribute__((unused))
static int stamp_read(struct truth_stamp *t, const char *dir, const char *name, int ext)
{
    char path[512], block[2881];
    snprintf(path, sizeof path, "%.400s/%.80s.fits", dir, name);
    FILE *f = fopen(path, "rb");
    if (!f)
        return 0;
    memset(t, 0, sizeof *t);
    for (int k = 0; k <= ext; k++) {
        block[2880] = '\0';
        if (fread(block, 1, 2880, f) != 2880) {
            fclose(f);
            return 0;
        }
        t->nx = (long)card_number(block, "NAXIS1", 0);
        t->ny = (long)card_number(block, "NAXIS2", 0);
        long bytes = 8 * t->nx * t->ny;
        if (k < ext)
            fseek(f, (bytes + 2879) / 2880 * 2880, SEEK_CUR);
    }
    t->x = card_number(block, "XIN", card_number(block, "XC", NAN)) - 1;
    t->y = card_number(block, "YIN", card_number(block, "YC", NAN)) - 1;
    t->w = card_number(block, "WIDTH", NAN);
    size_t n = (size_t)t->nx * (size_t)t->ny;
    t->pix = malloc(n * 8);
    int good = t->pix && fread(t->pix, 8, n, f) == n;
    fclose(f);
    for (size_t i = 0; good && i < n; i++) {
        uint64_t u;
        memcpy(&u, &t->pix[i], 8);
        u = __builtin_bswap64(u);
        memcpy(&t->pix[i], &u, 8);
    }
    return good;
}

__attribute__((unused))
static void stamp_done(struct truth_stamp *t)
{
    free(t->pix);
}

__attribute__((unused))
static int stamps_present(const char *dir)
{
    char path[512];
    snprintf(path, sizeof path, "%.400s/truth.txt", dir);
    FILE *f = fopen(path, "r");
    if (f)
        fclose(f);
    return f != NULL;
}

/* A line of truth.txt; x, y from 0. Moments: S xx xy yy xxxx xxxy xxyy xyyy yyyy. */
struct truth_line {
    char name[40];
    double x, y, w, cut;
    double sum[9], point[9], psf[3], galaxy[8];
};

__attribute__((unused))
static int truth_read(struct truth_line *t, int max, const char *dir)
{
    char path[512], text[4096];
    snprintf(path, sizeof path, "%.400s/truth.txt", dir);
    FILE *f = fopen(path, "r");
    int n = 0;
    while (f && n < max && fgets(text, sizeof text, f)) {
        if (text[0] == '#')
            continue;
        double v[34];
        int k = 0;
        char *save, *word = strtok_r(text, " |\n", &save);
        snprintf(t[n].name, sizeof t[n].name, "%s", word);
        while ((word = strtok_r(NULL, " |\n", &save)) && k < 34)
            v[k++] = strtod(word, NULL);
        if (k != 34)
            continue;
        t[n].x = v[1] - 1;
        t[n].y = v[2] - 1;
        t[n].w = v[3];
        t[n].cut = v[4];
        memcpy(t[n].sum, v + 5, sizeof t[n].sum);
        memcpy(t[n].point, v + 14, sizeof t[n].point);
        memcpy(t[n].psf, v + 23, sizeof t[n].psf);
        memcpy(t[n].galaxy, v + 26, sizeof t[n].galaxy);
        n++;
    }
    if (f)
        fclose(f);
    return n;
}

#endif
