/*
 * broad.c - pixels from few frequencies, summed as they stand.
 *
 * With C = sum_kx Re(A + B) and S = sum_kx Im(B - A), A and B the rows +-ky times their phases along x (twice for kx > 0),
 * a pair of rows adds C cos(ky y) + S sin(ky y).  Phases by recurrence over 32 frequencies, then anew: 4e-15.
 */
#include "broad.h"
#include "simd.h"
#include <math.h>
#include <string.h>

#define TWO_PI 6.283185307179586476925287
#define TILE 64                /* columns of the image at a time */
#define CHUNK 32               /* frequencies at a time */
#define TALL 1024              /* rows of the image at a time */

size_t broad_scratch(int ld)
{
    return (size_t)BROAD_ROWS * (4 * (size_t)ld + 2 * TILE + 2 * TALL);
}

void broad_begin(struct broad *b, double step, int nx, int ny, double *out, int ld, double *scratch)
{
    *b = (struct broad){.step = step, .nx = nx, .ny = ny, .out = out, .ld = ld, .mem = scratch};
    memset(out, 0, (size_t)nx * (size_t)ny * sizeof *out);
}

/* cos and sin of 2 pi k x step. */
static void turn(double k, double x, double step, double *c, double *s)
{
    const double t = k * x * step, a = TWO_PI * (t - rint(t));
    *c = cos(a);
    *s = sin(a);
}

/* Phases of frequencies k0..k0+n-1 on the columns x0..x0+TILE-1. */
WIDE static void phase_table(int k0, int n, int x0, double step, double (*restrict c)[TILE], double (*restrict s)[TILE])
{
    double c1[TILE], s1[TILE];
    for (int x = 0; x < TILE; x++) {
        turn(1, x0 + x, step, &c1[x], &s1[x]);
        turn(k0, x0 + x, step, &c[0][x], &s[0][x]);
    }
    for (int k = 1; k < n; k++)
        for (int x = 0; x < TILE; x++) {
            c[k][x] = c[k - 1][x] * c1[x] - s[k - 1][x] * s1[x];
            s[k][x] = c[k - 1][x] * s1[x] + s[k - 1][x] * c1[x];
        }
}

/* C and S of one pair of rows += the frequencies k0..k0+n-1; a, b, c, d as broad_take leaves them. */
WIDE static void along_x(int n, const double *a, const double *b, const double *c, const double *d, double (*restrict co)[TILE],
                         double (*restrict si)[TILE], double *restrict even, double *restrict odd)
{
    for (int k = 0; k < n; k++)
        for (int x = 0; x < TILE; x++) {
            even[x] += a[k] * co[k][x] - b[k] * si[k][x];
            odd[x] += c[k] * co[k][x] + d[k] * si[k][x];
        }
}

/* n pixels of a row += C cos + S sin of all pairs of rows. */
WIDE static void along_y(int rows, int n, double (*restrict even)[TILE], double (*restrict odd)[TILE], const double *restrict co,
                         const double *restrict si, double *restrict out)
{
    double sum[TILE] = {0};
    for (int r = 0; r < rows; r++)
        for (int x = 0; x < TILE; x++)
            sum[x] += even[r][x] * co[r] + odd[r][x] * si[r];
    for (int x = 0; x < n; x++)
        out[x] += sum[x];
}

/* Add the rows kept to the image rows y0..y0+ny-1. */
static void add(const struct broad *b, int y0, int ny)
{
    const size_t ld = (size_t)b->ld;
    double (*even)[TILE] = (void *)(b->mem + BROAD_ROWS * 4 * ld), (*odd)[TILE] = even + BROAD_ROWS;
    double *co = (double *)(odd + BROAD_ROWS), *si = co + BROAD_ROWS * TALL;
    for (int y = 0; y < ny; y++)
        for (int r = 0; r < b->rows; r++)
            turn(b->ky[r], y0 + y, b->step, &co[y * BROAD_ROWS + r], &si[y * BROAD_ROWS + r]);
    for (int x0 = 0; x0 < b->nx; x0 += TILE) {
        double c[CHUNK][TILE], s[CHUNK][TILE];
        memset(even, 0, 2 * BROAD_ROWS * TILE * sizeof(double));
        for (int k0 = 0; k0 < b->ld; k0 += CHUNK) {
            phase_table(k0, CHUNK, x0, b->step, c, s);
            for (int r = 0; r < b->rows; r++) {
                const double *row = b->mem + 4 * (size_t)r * ld + k0;
                const int n = b->m[r] - k0 < CHUNK ? b->m[r] - k0 : CHUNK;
                along_x(n, row, row + ld, row + 2 * ld, row + 3 * ld, c, s, even[r], odd[r]);
            }
        }
        const int n = b->nx - x0 < TILE ? b->nx - x0 : TILE;
        for (int y = 0; y < ny; y++)
            along_y(b->rows, n, even, odd, co + y * BROAD_ROWS, si + y * BROAD_ROWS, b->out + (size_t)(y0 + y) * (size_t)b->nx + x0);
    }
}

void broad_end(struct broad *b)
{
    for (int y = 0; y < b->ny && b->rows; y += TALL)
        add(b, y, b->ny - y < TALL ? b->ny - y : TALL);
    b->rows = 0;
}

void broad_take(struct broad *b, int ky, int m, const double *p_re, const double *p_im, const double *m_re, const double *m_im)
{
    const size_t ld = (size_t)b->ld;
    double *a = b->mem + 4 * (size_t)b->rows * ld;
    for (int k = 0; k < m; k++) {
        const double w = k ? 2 : 1, down_re = ky ? m_re[k] : 0, down_im = ky ? m_im[k] : 0;
        a[k] = w * (p_re[k] + down_re);
        a[ld + (size_t)k] = w * (p_im[k] + down_im);
        a[2 * ld + (size_t)k] = w * (down_im - p_im[k]);
        a[3 * ld + (size_t)k] = w * (down_re - p_re[k]);
    }
    b->ky[b->rows] = ky;
    b->m[b->rows++] = m;
    if (b->rows == BROAD_ROWS)
        broad_end(b);
}
