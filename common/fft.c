/*
 * fft.c - two-dimensional transforms by FFTW, and zoom transforms between any
 * two regular grids (Bluestein 1970; Rabiner, Schafer & Rader 1969).
 *
 * Plans are made with FFTW_ESTIMATE: the same plan and the same bits in every
 * run.  FFTW's planner keeps state, so planning goes through one lock.
 */
#include "fft.h"
#include <fftw3.h>
#include <math.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum kind { C2R, R2C, C2C };

struct fft {
    fftw_plan plan;
    enum kind kind;
};

/* FFTW makes plans one at a time in a process. */
static atomic_flag planner = ATOMIC_FLAG_INIT;

static void lock(void)
{
    while (atomic_flag_test_and_set_explicit(&planner, memory_order_acquire))
        sched_yield();
}

static void unlock(void)
{
    atomic_flag_clear_explicit(&planner, memory_order_release);
}

void *fft_alloc(size_t bytes)
{
    return fftw_malloc(bytes ? bytes : 1);
}

void fft_free(void *p)
{
    fftw_free(p);
}

/* Make a plan of one kind on scratch arrays, which FFTW_ESTIMATE does not touch. */
static int plan(struct fft **f, enum kind kind, int ny, int nx, int sign)
{
    if (ny < 1 || nx < 1 || (int64_t)ny * nx > INT32_MAX)
        return E_RANGE;
    size_t half = (size_t)ny * ((size_t)nx / 2 + 1) * 2, full = (size_t)ny * (size_t)nx;
    struct fft *made = malloc(sizeof *made);
    double *in = fft_alloc(sizeof *in * (kind == C2R ? half : kind == R2C ? full : 2 * full));
    double *out = kind == C2C ? in : fft_alloc(sizeof *out * (kind == R2C ? half : full));
    int status = E_NOMEM;

    if (made && in && out) {
        made->kind = kind;
        lock();
        if (kind == C2R)
            made->plan = fftw_plan_dft_c2r_2d(ny, nx, (fftw_complex *)in, out, FFTW_ESTIMATE);
        else if (kind == R2C)
            made->plan = fftw_plan_dft_r2c_2d(ny, nx, in, (fftw_complex *)out, FFTW_ESTIMATE);
        else
            made->plan = fftw_plan_dft_2d(ny, nx, (fftw_complex *)in, (fftw_complex *)in,
                                          sign < 0 ? FFTW_FORWARD : FFTW_BACKWARD, FFTW_ESTIMATE);
        unlock();
        if (made->plan)
            status = OK;
    }
    fft_free(in);
    if (out != in)
        fft_free(out);
    if (status == OK)
        *f = made;
    else
        free(made);
    return status;
}

int fft_plan_c2r(struct fft **f, int ny, int nx)
{
    return plan(f, C2R, ny, nx, 0);
}

int fft_plan_r2c(struct fft **f, int ny, int nx)
{
    return plan(f, R2C, ny, nx, 0);
}

int fft_plan_c2c(struct fft **f, int ny, int nx, int sign)
{
    return plan(f, C2C, ny, nx, sign);
}

void fft_run(const struct fft *f, double *in, double *out)
{
    if (f->kind == C2R)
        fftw_execute_dft_c2r(f->plan, (fftw_complex *)in, out);
    else if (f->kind == R2C)
        fftw_execute_dft_r2c(f->plan, in, (fftw_complex *)out);
    else
        fftw_execute_dft(f->plan, (fftw_complex *)in, (fftw_complex *)out);
}

void fft_done(struct fft *f)
{
    if (!f)
        return;
    lock();
    fftw_destroy_plan(f->plan);
    unlock();
    free(f);
}

int fft_good_size(int n)
{
    if (n < 2)
        return 2;
    for (int64_t m = n + (n & 1); m <= INT32_MAX; m += 2) {
        int64_t r = m;
        for (int p = 2; p <= 5; p += p == 2 ? 1 : 2)
            while (r % p == 0)
                r /= p;
        if (r == 1)
            return (int)m;
    }
    return n;    /* beyond the largest such int; no caller can hold that many */
}

/*
 * One zoom transform: X_k = sum_j x_j exp(i sign 2 pi a (j + j0)(k + k0)),
 * j < n, k < m, as a convolution: 2 j k = j^2 + k^2 - (k - j)^2.
 */
struct zoom {
    int n, m, len;
    struct fft *forward, *back;    /* of length len */
    double *in, *out;              /* chirps, complex: n and m; out holds 1/len */
    double *kernel;                /* transform of the conjugate chirp, complex: len */
    double *work;                  /* complex: len */
};

/* exp(i pi t), with t reduced first. */
static void turn(long double t, double *re, double *im)
{
    double r = (double)remainderl(t, 2);
    *re = cos(M_PI * r);
    *im = sin(M_PI * r);
}

static void zoom_done(struct zoom *z)
{
    fft_done(z->forward);
    fft_done(z->back);
    fft_free(z->in);
    fft_free(z->out);
    fft_free(z->kernel);
    fft_free(z->work);
    *z = (struct zoom){0};
}

static int zoom_new(struct zoom *made, int n, double j0, int m, double k0, double a, int sign)
{
    struct zoom z = {.n = n, .m = m, .len = fft_good_size(n + m - 1)};
    size_t pair = 2 * sizeof(double);
    z.in = fft_alloc((size_t)n * pair);
    z.out = fft_alloc((size_t)m * pair);
    z.kernel = fft_alloc((size_t)z.len * pair);
    z.work = fft_alloc((size_t)z.len * pair);
    int status = z.in && z.out && z.kernel && z.work ? OK : E_NOMEM;
    if (status == OK)
        status = fft_plan_c2c(&z.forward, 1, z.len, -1);
    if (status == OK)
        status = fft_plan_c2c(&z.back, 1, z.len, +1);
    if (status) {
        zoom_done(&z);
        return status;
    }
    /* (j + j0)(k + k0) = j k + j k0 + j0 (k + k0) */
    for (int j = 0; j < n; j++)
        turn(sign * (long double)a * ((double)j * j + 2.0 * j * k0), &z.in[2 * j], &z.in[2 * j + 1]);
    for (int k = 0; k < m; k++) {
        double re, im;
        turn(sign * (long double)a * ((double)k * k + 2.0 * j0 * (k + k0)), &re, &im);
        z.out[2 * k] = re / z.len;
        z.out[2 * k + 1] = im / z.len;
    }
    memset(z.kernel, 0, (size_t)z.len * pair);
    for (int d = 0; d < m; d++)
        turn(-sign * (long double)a * d * d, &z.kernel[2 * d], &z.kernel[2 * d + 1]);
    for (int d = 1; d < n; d++)
        turn(-sign * (long double)a * d * d, &z.kernel[2 * (z.len - d)], &z.kernel[2 * (z.len - d) + 1]);
    fft_run(z.forward, z.kernel, z.kernel);
    *made = z;
    return OK;
}

/* x: complex, `step` complex values apart; y likewise. */
static void zoom_run(struct zoom *z, const double *x, size_t step, double *y, size_t ystep)
{
    double *w = z->work;
    memset(w + 2 * z->n, 0, (size_t)(z->len - z->n) * 2 * sizeof *w);
    for (int j = 0; j < z->n; j++) {
        double re = x[2 * (size_t)j * step], im = x[2 * (size_t)j * step + 1];
        w[2 * j] = re * z->in[2 * j] - im * z->in[2 * j + 1];
        w[2 * j + 1] = re * z->in[2 * j + 1] + im * z->in[2 * j];
    }
    fft_run(z->forward, w, w);
    for (int i = 0; i < z->len; i++) {
        double re = w[2 * i] * z->kernel[2 * i] - w[2 * i + 1] * z->kernel[2 * i + 1];
        w[2 * i + 1] = w[2 * i] * z->kernel[2 * i + 1] + w[2 * i + 1] * z->kernel[2 * i];
        w[2 * i] = re;
    }
    fft_run(z->back, w, w);
    for (int k = 0; k < z->m; k++) {
        y[2 * (size_t)k * ystep] = w[2 * k] * z->out[2 * k] - w[2 * k + 1] * z->out[2 * k + 1];
        y[2 * (size_t)k * ystep + 1] = w[2 * k] * z->out[2 * k + 1] + w[2 * k + 1] * z->out[2 * k];
    }
}

int fft_zoom(const struct fft_grid *from, const double *in, const struct fft_grid *to, double *out,
             double ax, double ay, int sign)
{
    int nx = from->nx, ny = from->ny, mx = to->nx, my = to->ny;
    if (nx < 1 || ny < 1 || mx < 1 || my < 1 || (int64_t)nx + mx > INT32_MAX / 2 ||
        (int64_t)ny + my > INT32_MAX / 2 || !isfinite(ax) || !isfinite(ay))
        return E_RANGE;
    struct zoom zx = {0}, zy = {0};
    double *half = fft_alloc((size_t)ny * (size_t)mx * 2 * sizeof *half);
    int status = half ? zoom_new(&zx, nx, from->x0, mx, to->x0, ax, sign < 0 ? -1 : 1) : E_NOMEM;
    if (status == OK)
        status = zoom_new(&zy, ny, from->y0, my, to->y0, ay, sign < 0 ? -1 : 1);
    if (status == OK) {
        for (int y = 0; y < ny; y++)
            zoom_run(&zx, in + 2 * (size_t)y * (size_t)nx, 1, half + 2 * (size_t)y * (size_t)mx, 1);
        for (int x = 0; x < mx; x++)
            zoom_run(&zy, half + 2 * x, (size_t)mx, out + 2 * x, (size_t)mx);
    }
    zoom_done(&zx);
    zoom_done(&zy);
    fft_free(half);
    return status;
}
