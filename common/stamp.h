/*
 * stamp.h - one object on one stamp of pixels.
 *
 * With a PSF, in Fourier space (u in cycles/arcsec):
 *
 *   pixel(i) = flux theta^2 int F(u) T(u) exp(2 pi i u.(x_i - x_0)) d2u
 *
 * F the transform of the object, T that of PSF, charge diffusion and pixel.  T
 * vanishes beyond a cut-off, so on a grid of 1/(N theta) the sum over all
 * frequencies is finite: bands beyond the pixel grid's Nyquist frequency are
 * added onto the grid (exact aliasing), then one real transform is made.  Only
 * the periodicity of N theta is left as an error.
 *
 * Without a PSF, closed-form integrals of the basis over pixels, or closed form
 * along y and Gauss-Legendre nodes along x when the object's axes do not allow it.
 *
 * No function here draws, reads or prints; stamps are doubles, rows of y.
 */
#ifndef PIXSHEAR_STAMP_H
#define PIXSHEAR_STAMP_H

#include "err.h"
#include "lanes.h"
#include "otf.h"
#include <stddef.h>

/*
 * Surface brightness sum c_n1n2 B_n1(x;beta_x) B_n2(y;beta_y), arcsec, after
 * the map x -> A x with A = {a11, a12, a21, a22}, det A = 1.  A point has
 * coef NULL.  With beta_x = beta_y = beta and A = 1 it is a plain shapelet.
 */
struct shape {
    int nmax;
    double beta_x, beta_y;
    const double *coef;
    int mapped;            /* a holds a map that is not the identity */
    double a[4];
};

/* ---- with a PSF ---- */

/* What all stamps of one side share. */
struct stamp_grid {
    int n;                 /* pixels per side, even */
    int parts;             /* made in so many parts: rows y = part, part + parts, ... */
    int kmax;              /* frequencies -kmax..kmax per axis, du apart */
    int ld;                /* row length of t_re, t_im: kmax + 1 rounded up to 8 */
    double du;             /* cycles/arcsec */
    double pixel;          /* arcsec */
    double *t_re, *t_im;   /* (2 kmax + 1) x ld: rows u_y = -kmax du .., columns u_x >= 0; t_im NULL: real */
    double *factor;        /* along x, y, and 2 cos of the neighbours: kmax + 1 each, owned; NULL: none */
    double ipc;
    struct otf_columns *columns;   /* without a table: rows of T are made for each stamp */
    struct otf otf;        /* from this spline, not owned */
    struct lanes *fft;
};

/* Factors of the transfer function beyond the PSF, arcsec; 0 leaves the factor out. */
struct stamp_response {
    double diffusion;      /* sigma of a Gaussian */
    double box;            /* side of the pixel along x, and along y when box_y is 0 */
    double box_y;          /* side along y */
    double edge[2];        /* along x and y: the response falls to 0 over this length, a trapezoid `box` wide at half height */
    double ipc;            /* charge that each of the four neighbours, pitch away, gets: 1 - 4 ipc stays */
    double pitch;
};

/*
 * Multiply f[0..n-1] by what acts along one axis (0: x, 1: y) at frequencies u: diffusion, pixel and its edges;
 * the rest is 1 + ipc (c_x + c_y - 4), c of otf_neighbours.
 */
void stamp_factors(const struct stamp_response *r, int axis, int n, const double *u, double *f);

/* Tabulate; n even, 4..4096. E_RANGE, E_NOMEM. */
MUST_CHECK int stamp_grid_new(struct stamp_grid *g, const struct otf *t, const struct stamp_response *r,
                              double pixel, int n);
/*
 * For stamps made in parts (a divisor of n), with the table or, when t is a table itself and outlives g, without:
 * the same bits, but memory for two rows per thread instead of all, and time for each stamp.
 */
MUST_CHECK int stamp_grid_lean(struct stamp_grid *g, const struct otf *t, const struct stamp_response *r, double pixel, int n,
                               int parts, int table);
void stamp_grid_free(struct stamp_grid *g);
/* Bytes of the table. */
double stamp_grid_bytes(double ucut, double pixel, int n, int complex_t);

/* Scratch memory of one thread, grown when needed. */
struct stamp_work;
MUST_CHECK int stamp_work_new(struct stamp_work **w);
void stamp_work_free(struct stamp_work *w);

/*
 * Object with its origin at (x, y) in pixels of the stamp (centre of the first
 * pixel is 0); flux in electrons; frequencies |u| <= kcut du are used.
 * out: n x n, overwritten.
 */
MUST_CHECK int stamp_fourier(const struct stamp_grid *g, struct stamp_work *w, const struct shape *s,
                             double x, double y, double flux, double kcut, double *out);

/*
 * The same in single precision, for grids of one part with a table and shapes that are not mapped: 3e-7 of the peak, and
 * |flux| such that float holds its squares.  rest: what each pixel lacks for the sum to be that of double precision.
 */
MUST_CHECK int stamp_single(const struct stamp_grid *g, struct stamp_work *w, const struct shape *s, double x, double y, double flux,
                            double kcut, float *out, double *rest);

/*
 * One part of it: rows part, part + parts, ... of the stamp, stamp_stride(n) doubles from one to the next, in
 * n / parts * stamp_stride(n) doubles, aligned to 64 bytes, that also serve for the frequencies.
 */
MUST_CHECK int stamp_fourier_part(const struct stamp_grid *g, struct stamp_work *w, const struct shape *s, double x, double y,
                                  double flux, double kcut, int part, double *plane);
size_t stamp_stride(int n);

/*
 * The same by threads side by side: one starts the part with w; then each joins with work of its `own` (which may be w), and they share
 * the items 0, 1, ... of each stage in any way; nobody begins a stage before the last is ended.  An item of the last makes rows
 * 8 item .. 8 item + 7 of the part (those that there are), `stride` doubles apart, in out: theirs in the plane, or anywhere.
 * The same bits.
 */
enum stamp_stage { STAMP_FREQUENCIES, STAMP_COLUMNS, STAMP_ROWS };
MUST_CHECK int stamp_part_start(const struct stamp_grid *g, struct stamp_work *w, const struct shape *s, double x, double y, double flux,
                                double kcut, int part, double *plane);
MUST_CHECK int stamp_part_join(const struct stamp_work *w, struct stamp_work *own);
int stamp_part_items(const struct stamp_work *w, enum stamp_stage stage);
MUST_CHECK int stamp_part_frequencies(const struct stamp_work *w, struct stamp_work *own, int item);
void stamp_part_columns(const struct stamp_work *w, struct stamp_work *own, int item);
void stamp_part_rows(const struct stamp_work *w, struct stamp_work *own, int item, double *out, size_t stride);

/*
 * Any nx x ny pixels of an object of few frequencies: g has the period, n g->pixel, and one part; the pixels
 * have the side `pixel` and x, y count them.  kcut may be beyond n / 2 (broad.h).
 */
MUST_CHECK int stamp_broad(const struct stamp_grid *g, struct stamp_work *w, const struct shape *s, double pixel, int nx, int ny,
                           double x, double y, double flux, double kcut, double *out);

/* ---- without a PSF ---- */

/*
 * Pixel integrals (box = pixel) or, with box = 0, values times pixel^2 at pixel
 * centres.  s->mapped must be 0: closed form, 1e-14 of the peak.  nx x ny pixels.
 */
MUST_CHECK int stamp_closed(struct stamp_work *w, const struct shape *s, double pixel, double box, int nx,
                            int ny, double x, double y, double flux, double *out);

/* The same for any map A: closed form in y, Gauss-Legendre nodes in x (shear_pixels). nmax <= 66. */
MUST_CHECK int stamp_mapped(struct stamp_work *w, const struct shape *s, double pixel, double box, int nx,
                            int ny, double x, double y, double flux, double *out);

/*
 * A point without a PSF: all flux in the pixel that holds it; on an edge half to either side, on a
 * corner a quarter each.
 */
void stamp_point(int nx, int ny, double x, double y, double flux, double *out);

#endif
