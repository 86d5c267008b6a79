/* distort.c - objects of a scene seen through a WCS. */
#include "distort.h"
#include "shear.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define STEP 0.5               /* pixels to either side for the derivative */

/* Plane (arcsec) of a TAN that touches the sky at the middle, as a WCS of pixels of one arcsec. */
static int plane_open(struct sky **plane, const double centre[2])
{
    struct header h = {0};
    struct err e;
    int st = sky_set_tan(&h, 1, 1, 1, centre[0], centre[1]);
    if (st == OK)
        st = sky_open(plane, &h, &e);
    header_free(&h);
    return st;
}

/* Failures of single positions are NaN, not errors. */
static int lenient(int st)
{
    return st == E_RANGE ? OK : st;
}

/* RA and Dec of the objects into ra, dec. */
static int to_sky(struct sky *wcs, struct sky *plane, enum scene_where where, size_t n, const double *x, const double *y, double *ra,
                  double *dec)
{
    if (where == SCENE_PIXEL)
        return lenient(sky_from_pixel(wcs, n, x, y, ra, dec));
    if (where == SCENE_FIELD)
        return lenient(sky_from_pixel(plane, n, x, y, ra, dec));
    for (size_t i = 0; i < n; i++) {
        ra[i] = x[i];
        dec[i] = y[i];
    }
    return OK;
}

/* Plane positions of pixels, in place. */
static int to_plane(struct sky *wcs, struct sky *plane, size_t n, double *x, double *y)
{
    int st = lenient(sky_from_pixel(wcs, n, x, y, x, y));
    return st ? st : lenient(sky_to_pixel(plane, n, x, y, x, y));
}

/* px, py: the four neighbours of each object, 4 n; x0 its place. */
static void derivative(double pixel, size_t n, const double *x0, const double *px, const double *py, double (*map)[4])
{
    for (size_t i = 0; i < n; i++) {
        const double *x = px + 4 * i, *y = py + 4 * i;     /* left, right, below, above */
        const double xx = x[1] - x[0], xy = x[3] - x[2], yx = y[1] - y[0], yy = y[3] - y[2];
        if (isinf(x0[i])) {
            memcpy(map[i], (double[4]){1, 0, 0, 1}, sizeof map[i]);
            continue;
        }
        const double scale = 2 * STEP * pixel / (xx * yy - xy * yx);
        map[i][0] = yy * scale;
        map[i][1] = -xy * scale;
        map[i][2] = -yx * scale;
        map[i][3] = xx * scale;
    }
}

/* Objects on the other side of the sky are outside: infinitely far. */
static void outside(const struct sky *wcs, size_t n, const double *ra, const double *dec, double *x, double *y)
{
    for (size_t i = 0; i < n; i++)
        if (isnan(x[i]) && sky_far(wcs, ra[i], dec[i]))
            x[i] = y[i] = INFINITY;
}

int distort(struct sky *wcs, const double centre[2], enum scene_where where, double pixel, size_t n, double *x, double *y,
            double (*map)[4])
{
    static const double dx[4] = {-STEP, STEP, 0, 0}, dy[4] = {0, 0, -STEP, STEP};
    struct sky *plane = NULL;
    double *px = malloc((8 * n + 1) * sizeof *px), *py = px + 4 * n;
    int st = px ? plane_open(&plane, centre) : E_NOMEM;
    if (st == OK)
        st = to_sky(wcs, plane, where, n, x, y, px, py);
    if (st == OK && where != SCENE_PIXEL) {
        st = lenient(sky_to_pixel(wcs, n, px, py, x, y));
        outside(wcs, n, px, py, x, y);
    }
    for (size_t i = 0; i < 4 * n && st == OK; i++) {
        px[i] = x[i / 4] + dx[i % 4];
        py[i] = y[i / 4] + dy[i % 4];
    }
    if (st == OK)
        st = to_plane(wcs, plane, 4 * n, px, py);
    if (st == OK)
        derivative(pixel, n, x, px, py, map);
    sky_close(plane);
    free(px);
    return st;
}

int distort_before(const double g[2], double map[4])
{
    double s[4], back[4], t[4];
    int st = shear_matrix(g[0], g[1], s);
    if (st == OK)
        st = shear_matrix(-g[0], -g[1], back);
    if (st)
        return st;
    for (int i = 0; i < 4; i++)
        t[i] = map[i / 2 * 2] * s[i % 2] + map[i / 2 * 2 + 1] * s[2 + i % 2];
    for (int i = 0; i < 4; i++)
        map[i] = back[i / 2 * 2] * t[i % 2] + back[i / 2 * 2 + 1] * t[2 + i % 2];
    return OK;
}
