/*
 * lanes.c - mixed-radix transforms (Stockham's, sign +) of eight sequences side
 * by side: columns in full length n, rows as complex sequences of length n/2 whose
 * real and imaginary parts are the even and odd pixels.
 */
#include "lanes.h"
#include "simd.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LANES 8
#define SINGLES 16
#define STAGES 16
#define RADIX_MAX 8192

/* Eight doubles, sixteen floats; the compiler splits them to what the processor has. Loads need no alignment. */
typedef double v8 __attribute__((vector_size(64), aligned(8)));
typedef float v16 __attribute__((vector_size(64), aligned(4)));

/* One length: factors and turns exp(2 pi i k / n), k < n. */
struct sequence {
    int n, stages;
    int radix[STAGES];
    double *c_double, *s_double;
    float *c_float, *s_float;
};

struct lanes {
    int n, rows;
    struct sequence column, row;
    double *c_double, *s_double;   /* exp(2 pi i k / n), k <= n/2: of the rows */
    float *c_float, *s_float;      /* only when rows are as many as pixels in them */
    double *own;                   /* the doubles when the columns' length is not n, owned */
};

static int sequence_new(struct sequence *q, int n)
{
    static const int order[4] = {4, 5, 3, 2};
    int rest = n;
    *q = (struct sequence){.n = n};
    for (int i = 0; i < 4; i++)
        while (rest % order[i] == 0) {
            q->radix[q->stages++] = order[i];
            rest /= order[i];
        }
    for (int p = 7; rest > 1; p += 2)
        while (rest % p == 0) {
            q->radix[q->stages++] = p;
            rest /= p;
        }
    if (q->stages == 1 && q->radix[0] > 5)
        q->radix[q->stages++] = 1;     /* so that no stage but those of small radix works in place */
    q->c_double = malloc(2 * (size_t)n * sizeof *q->c_double);
    q->c_float = malloc(2 * (size_t)n * sizeof *q->c_float);
    if (!q->c_double || !q->c_float)
        return E_NOMEM;
    q->s_double = q->c_double + n;
    q->s_float = q->c_float + n;
    for (int k = 0; k < n; k++) {
        q->c_double[k] = cos(2 * M_PI * k / n);
        q->s_double[k] = sin(2 * M_PI * k / n);
        q->c_float[k] = (float)q->c_double[k];
        q->s_float[k] = (float)q->s_double[k];
    }
    return OK;
}

/* exp(2 pi i k / n), k <= n/2, for transforms whose columns are of another length. */
static int own_turns(struct lanes *p, int n)
{
    const int h = n / 2 + 1;
    p->own = malloc(2 * (size_t)h * sizeof *p->own);
    if (!p->own)
        return E_NOMEM;
    p->c_double = p->own;
    p->s_double = p->own + h;
    for (int k = 0; k < h; k++) {
        p->c_double[k] = cos(2 * M_PI * k / n);
        p->s_double[k] = sin(2 * M_PI * k / n);
    }
    return OK;
}

int lanes_new_rows(struct lanes **made, int n, int rows)
{
    if (n < 2 || n > RADIX_MAX || n % 2 || rows < 2 || rows > RADIX_MAX)
        return E_RANGE;
    struct lanes *p = calloc(1, sizeof *p);
    int st = p ? OK : E_NOMEM;
    if (st == OK)
        st = sequence_new(&p->column, rows);
    if (st == OK)
        st = sequence_new(&p->row, n / 2);
    if (st == OK && rows != n)
        st = own_turns(p, n);
    if (st) {
        lanes_free(p);
        return st;
    }
    p->n = n;
    p->rows = rows;
    if (rows == n) {
        p->c_double = p->column.c_double;
        p->s_double = p->column.s_double;
        p->c_float = p->column.c_float;
        p->s_float = p->column.s_float;
    }
    *made = p;
    return OK;
}

int lanes_new(struct lanes **made, int n)
{
    return lanes_new_rows(made, n, n);
}

void lanes_free(struct lanes *p)
{
    if (!p)
        return;
    free(p->column.c_double);
    free(p->column.c_float);
    free(p->row.c_double);
    free(p->row.c_float);
    free(p->own);
    free(p);
}

size_t lanes_scratch(const struct lanes *p)
{
    return 6 * LANES * (size_t)(p->n > p->rows ? p->n : p->rows) + 4 * SINGLES * LANES;
}

/* Rows become columns. */
static inline __attribute__((always_inline)) void transpose_double(const v8 *x, v8 *y)
{
    v8 a[8], b[8];
    for (int i = 0; i < 8; i += 2) {
        a[i] = __builtin_shufflevector(x[i], x[i + 1], 0, 8, 2, 10, 4, 12, 6, 14);
        a[i + 1] = __builtin_shufflevector(x[i], x[i + 1], 1, 9, 3, 11, 5, 13, 7, 15);
    }
    for (int i = 0; i < 8; i += 4)
        for (int k = 0; k < 2; k++) {
            b[i + k] = __builtin_shufflevector(a[i + k], a[i + k + 2], 0, 1, 8, 9, 4, 5, 12, 13);
            b[i + k + 2] = __builtin_shufflevector(a[i + k], a[i + k + 2], 2, 3, 10, 11, 6, 7, 14, 15);
        }
    for (int k = 0; k < 4; k++) {
        y[k] = __builtin_shufflevector(b[k], b[k + 4], 0, 1, 2, 3, 8, 9, 10, 11);
        y[k + 4] = __builtin_shufflevector(b[k], b[k + 4], 4, 5, 6, 7, 12, 13, 14, 15);
    }
}

static inline __attribute__((always_inline)) void transpose_float(const v16 *x, v16 *y)
{
    v16 a[16], b[16];
    for (int i = 0; i < 16; i += 2) {
        a[i] = __builtin_shufflevector(x[i], x[i + 1], 0, 16, 2, 18, 4, 20, 6, 22, 8, 24, 10, 26, 12, 28, 14, 30);
        a[i + 1] = __builtin_shufflevector(x[i], x[i + 1], 1, 17, 3, 19, 5, 21, 7, 23, 9, 25, 11, 27, 13, 29, 15, 31);
    }
    for (int i = 0; i < 16; i += 4)
        for (int k = i; k < i + 2; k++) {
            b[k] = __builtin_shufflevector(a[k], a[k + 2], 0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29);
            b[k + 2] = __builtin_shufflevector(a[k], a[k + 2], 2, 3, 18, 19, 6, 7, 22, 23, 10, 11, 26, 27, 14, 15, 30, 31);
        }
    for (int i = 0; i < 16; i += 8)
        for (int k = i; k < i + 4; k++) {
            a[k] = __builtin_shufflevector(b[k], b[k + 4], 0, 1, 2, 3, 16, 17, 18, 19, 8, 9, 10, 11, 24, 25, 26, 27);
            a[k + 4] = __builtin_shufflevector(b[k], b[k + 4], 4, 5, 6, 7, 20, 21, 22, 23, 12, 13, 14, 15, 28, 29, 30, 31);
        }
    for (int k = 0; k < 8; k++) {
        y[k] = __builtin_shufflevector(a[k], a[k + 8], 0, 1, 2, 3, 4, 5, 6, 7, 16, 17, 18, 19, 20, 21, 22, 23);
        y[k + 8] = __builtin_shufflevector(a[k], a[k + 8], 8, 9, 10, 11, 12, 13, 14, 15, 24, 25, 26, 27, 28, 29, 30, 31);
    }
}

#define REAL double
#define VEC v8
#define WIDTH LANES
#define NAME(x) x##_double
#include "lanes_stages.h"
#undef REAL
#undef VEC
#undef WIDTH
#undef NAME

#define REAL float
#define VEC v16
#define WIDTH SINGLES
#define NAME(x) x##_float
#include "lanes_stages.h"

void lanes_columns(const struct lanes *p, int k, double *re, double *im, int ld, double *scratch)
{
    columns_double(p, k, re, im, ld, scratch);
}

void lanes_rows(const struct lanes *p, int y, int m, const double *re, const double *im, int ld, double *scratch, double *out, size_t stride)
{
    rows_double(p, y, m, re, im, ld, scratch, out, stride);
}

void lanes_run(const struct lanes *p, int m, double *re, double *im, int ld, double *scratch, double *out)
{
    run_double(p, m, re, im, ld, scratch, out);
}

void lanes_run_single(const struct lanes *p, int m, float *re, float *im, int ld, float *scratch, float *out)
{
    run_float(p, m, re, im, ld, scratch, out);
}
