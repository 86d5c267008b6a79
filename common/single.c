/* single.c - frequencies of one object in single precision. */
#include "single.h"
#include "simd.h"
#include <string.h>

#define LANES SINGLE_LANES

/* Sixteen numbers; the compiler splits them to what the processor has. Loads need no alignment. */
typedef float v16 __attribute__((vector_size(64), aligned(4)));
typedef double d16 __attribute__((vector_size(128), aligned(8)));

static size_t round_up(size_t n)
{
    return (n + LANES - 1) / LANES * LANES;
}

size_t single_floats(int n, int nmax, int columns)
{
    const size_t ld = round_up((size_t)columns), orders = (size_t)nmax + 1;
    return (2 * orders + 2) * ld + 4 * (ld + LANES) + 2 * (size_t)n * round_up((size_t)n / 2 + 1);
}

void single_begin(struct single *q, int n, int nmax, int columns, float *mem)
{
    const size_t ld = round_up((size_t)columns), orders = (size_t)nmax + 1, width = round_up((size_t)n / 2 + 1);
    *q = (struct single){.n = n, .nmax = nmax, .ld = (int)ld, .width = (int)width};
    float **const part[] = {&q->re, &q->im, &q->ve, &q->vo, &q->c, &q->s, &q->line};
    const size_t size[] = {(size_t)n * width, (size_t)n * width, orders * ld, orders * ld, ld, ld, 4 * (ld + LANES)};
    for (size_t i = 0; i < sizeof size / sizeof size[0]; mem += size[i++])
        *part[i] = mem;
    memset(q->re, 0, 2 * size[0] * sizeof *q->re);
}

WIDE static void take_row(size_t n, const double *restrict from, float *restrict to)
{
    for (size_t k = 0; k < n; k++)
        to[k] = (float)from[k];
}

void single_take(int rows, int columns, size_t from_ld, const double *from, size_t ld, float *to)
{
    for (int row = 0; row < rows; row++, from += from_ld, to += ld) {
        take_row((size_t)columns, from, to);
        memset(to + columns, 0, (ld - (size_t)columns) * sizeof *to);
    }
}

/* Sixteen columns of a row: (a + i b) times T times the phase c + i d. */
static inline __attribute__((always_inline)) void finish(const v16 *a, const v16 *b, const struct single_transfer *t, int k, const v16 *c,
                                                         const v16 *d, float *re, float *im)
{
    const v16 r = __builtin_convertvector(*(const d16 *)(t->re + k), v16);
    v16 x = *a * r, y = *b * r;
    if (t->im) {
        const v16 i = __builtin_convertvector(*(const d16 *)(t->im + k), v16);
        x -= *b * i;
        y += *a * i;
    }
    *(v16 *)(re + k) = x * *c - y * *d;
    *(v16 *)(im + k) = x * *d + y * *c;
}

/* Rows +-ky into q->line: real and imaginary part of the first, of the second. */
WIDE static void make_rows(const struct single *q, int m, const float *f, float turn_re, float turn_im, const struct single_transfer *up,
                           const struct single_transfer *down)
{
    const size_t ld = (size_t)q->ld, next = ld + LANES;
    const int nmax = q->nmax;
    float *line = q->line;
    for (int k = 0; k < m; k += LANES) {
        v16 ee = {0}, oe = {0}, oo = {0}, eo = {0};
        const float *ve = q->ve + k, *vo = q->vo + k;
        for (int n2 = 0; n2 <= nmax; n2 += 2) {
            ee += f[n2] * *(const v16 *)(ve + (size_t)n2 * ld);
            oe += f[n2] * *(const v16 *)(vo + (size_t)n2 * ld);
        }
        for (int n2 = 1; n2 <= nmax; n2 += 2) {
            eo += f[n2] * *(const v16 *)(ve + (size_t)n2 * ld);
            oo += f[n2] * *(const v16 *)(vo + (size_t)n2 * ld);
        }
        const v16 c = *(const v16 *)(q->c + k), d = *(const v16 *)(q->s + k);
        const v16 cc = c * turn_re, cd = c * turn_im, dc = d * turn_re, dd = d * turn_im;
        const v16 up_c = cc - dd, up_d = dc + cd, down_c = cc + dd, down_d = dc - cd;
        const v16 pr = ee + oo, pi = oe + eo, mr = ee - oo, mi = oe - eo;
        finish(&pr, &pi, up, k, &up_c, &up_d, line, line + next);
        finish(&mr, &mi, down, k, &down_c, &down_d, line + 2 * next, line + 3 * next);
    }
}

/* Columns 0..m-1 of a row to columns 0..h of the grid: those of whole periods n as they are. Blocks end beyond m and h, with zeros and without harm. */
WIDE static void add_direct(int n, int m, const float *restrict re, const float *restrict im, float *restrict to_re, float *restrict to_im)
{
    for (int k = 0; k < m; k += n)
        for (int j = 0; j <= n / 2 && k + j < m; j += LANES) {
            *(v16 *)(to_re + j) += *(const v16 *)(re + k + j);
            *(v16 *)(to_im + j) += *(const v16 *)(im + k + j);
        }
}

/* The same of the other frequencies, which are conjugate to those of the row. */
WIDE static void add_mirrored(int n, int m, const float *restrict re, const float *restrict im, float *restrict to_re, float *restrict to_im)
{
    const int h = n / 2;
    for (int k = n; k - h < m; k += n) {
        int j = k > m - 1 ? k - (m - 1) : 0;
        for (; j + LANES <= h + 1; j += LANES) {
            const v16 r = *(const v16 *)(re + k - j - LANES + 1), i = *(const v16 *)(im + k - j - LANES + 1);
            *(v16 *)(to_re + j) += __builtin_shufflevector(r, r, 15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0);
            *(v16 *)(to_im + j) -= __builtin_shufflevector(i, i, 15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0);
        }
        for (; j <= h; j++) {
            to_re[j] += re[k - j];
            to_im[j] -= im[k - j];
        }
    }
}

void single_row(const struct single *q, int ky, int m, const float *f, const double turn[2], const struct single_transfer *up,
                const struct single_transfer *down)
{
    const size_t next = (size_t)q->ld + LANES, width = (size_t)q->width;
    const int row = ky % q->n, mirror = (q->n - row) % q->n;
    float *line = q->line, *re = q->re + (size_t)row * width, *im = q->im + (size_t)row * width;
    float *mirror_re = q->re + (size_t)mirror * width, *mirror_im = q->im + (size_t)mirror * width;
    make_rows(q, m, f, (float)turn[0], (float)turn[1], up, down);
    for (int i = 0; i < 4; i++)
        memset(line + (size_t)i * next + (size_t)m, 0, LANES * sizeof *line);
    add_direct(q->n, m, line, line + next, re, im);
    add_mirrored(q->n, m, line + 2 * next, line + 3 * next, re, im);
    if (ky > 0) {
        add_direct(q->n, m, line + 2 * next, line + 3 * next, mirror_re, mirror_im);
        add_mirrored(q->n, m, line, line + next, mirror_re, mirror_im);
    }
}

/* Sixteen sums side by side, then these in order. */
WIDE static double sum_of(size_t n, const float *restrict p)
{
    double part[LANES] = {0}, sum = 0;
    size_t k = 0;
    for (; k + LANES <= n; k += LANES)
        for (int i = 0; i < LANES; i++)
            part[i] += (double)p[k + (size_t)i];
    for (int i = 0; i < LANES; i++)
        sum += part[i];
    for (; k < n; k++)
        sum += (double)p[k];
    return sum;
}

double single_sum(size_t n, const float *p)
{
    return sum_of(n, p);
}
