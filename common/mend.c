/* mend.c - lines over short gaps of bad pixels; see mend.h. */
#include "mend.h"
#include "simd.h"
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

int mend_new(struct mend *m, const struct pixels *im, const struct background *b, const float *rms_map)
{
    *m = (struct mend){im, b, rms_map, 0, calloc((size_t)im->nx, 1), malloc((size_t)im->nx * sizeof(float))};
    if (m->above && m->row)
        return OK;
    mend_free(m);
    return E_NOMEM;
}

void mend_free(struct mend *m)
{
    free(m->above);
    free(m->row);
    *m = (struct mend){0};
}

/* What the n pixels are; returns whether one is bad. */
WIDE static int kinds_of(const float *restrict pix, const float *restrict rms, long n, unsigned char *restrict kind)
{
    int any = 0;
    for (long x = 0; x < n; x++)
        kind[x] = fabsf(pix[x]) <= FLT_MAX ? PIXEL_GOOD : PIXEL_BAD;
    for (long x = 0; rms && x < n; x++)
        kind[x] = rms[x] <= FLT_MAX ? kind[x] : PIXEL_BAD;
    for (long x = 0; x < n; x++)
        any |= kind[x];
    return any;
}

/* Go one row down. */
WIDE static void count_above(const unsigned char *restrict kind, long n, unsigned char *restrict above)
{
    for (long x = 0; x < n; x++) {
        unsigned char more = above[x] <= MEND_MOST ? (unsigned char)(above[x] + 1) : above[x];
        above[x] = kind[x] == PIXEL_GOOD ? 0 : more;
    }
}

static int is_good(const struct mend *m, long x, long y)
{
    return fabsf(pixels_at(m->im, x, y)) <= FLT_MAX && (!m->rms_map || m->rms_map[(size_t)y * (size_t)m->im->nx + (size_t)x] <= FLT_MAX);
}

void mend_seek(struct mend *m, long y)
{
    const long nx = m->im->nx;
    m->y = y;
    memset(m->above, 0, (size_t)nx);
    if (y <= 0 || y > m->im->ny)
        return;
    for (long x = 0; x < nx; x++)
        while (m->above[x] <= MEND_MOST && m->above[x] < y && !is_good(m, x, y - 1 - m->above[x]))
            m->above[x]++;
}

/* The pixels up and down of a bad one with good ones behind them; 0 when there are too many. */
static int column_gap(const struct mend *m, long x, long *up, long *down)
{
    *up = m->y - 1 - m->above[x];
    if (*up < 0)
        return 0;
    for (*down = m->y + 1; *down - *up - 1 <= MEND_MOST && *down < m->im->ny; ++*down)
        if (is_good(m, x, *down))
            return 1;
    return 0;
}

static float sky_less(const struct mend *m, long x, long y)
{
    float v = pixels_at(m->im, x, y);
    background_subtract(m->b, y, x, 1, 0, &v);
    return v;
}

static float between(float a, float b, long at, long n)
{
    return a + (b - a) * ((float)at / (float)n);
}

/* The bad pixels from .. end-1 of the row. */
static void mend_gap(const struct mend *m, long from, long end, float *v, unsigned char *kind, float *rms)
{
    const long nx = m->im->nx;
    const int in_row = from > 0 && end < nx && end - from <= MEND_MOST;
    for (long x = from; x < end; x++) {
        long up, down;
        if (in_row) {
            v[x] = between(v[from - 1], v[end], x - from + 1, end - from + 1);
            if (rms)
                rms[x] = between(rms[from - 1], rms[end], x - from + 1, end - from + 1);
        } else if (column_gap(m, x, &up, &down)) {
            v[x] = between(sky_less(m, x, up), sky_less(m, x, down), m->y - up, down - up);
            if (rms)
                rms[x] = between(m->rms_map[up * nx + x], m->rms_map[down * nx + x], m->y - up, down - up);
        } else {
            v[x] = 0;
            continue;
        }
        kind[x] = PIXEL_MENDED;
    }
}

void mend_row(struct mend *m, float *v, unsigned char *kind, float *rms)
{
    const long nx = m->im->nx;
    if (rms)
        memcpy(rms, m->rms_map + (size_t)m->y * (size_t)nx, (size_t)nx * sizeof *rms);
    pixels_row(m->im, m->y, 0, nx, m->row);
    int any = kinds_of(m->row, rms, nx, kind);
    for (long x = 0, end; any && x < nx; x = end + 1) {
        const unsigned char *bad = memchr(kind + x, PIXEL_BAD, (size_t)(nx - x));
        if (!bad)
            break;
        x = bad - kind;
        for (end = x; end < nx && kind[end] == PIXEL_BAD;)
            end++;
        mend_gap(m, x, end, v, kind, rms);
    }
    count_above(kind, nx, m->above);
    m->y++;
}
