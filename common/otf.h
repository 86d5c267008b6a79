/*
 * otf.h - transfer functions: sampled OTF of a telescope or of a PSF image, and
 * the analytic factors of charge diffusion and pixel.
 *
 * Frequencies u in cycles/arcsec.  T(u) = integral of PSF(x) exp(-2 pi i u.x),
 * T(0) = flux of the PSF (1 when normalised).
 */
#ifndef PIXSHEAR_OTF_H
#define PIXSHEAR_OTF_H

#include "err.h"
#include <stddef.h>

/*
 * A transfer function in one of two forms, zero outside |u_x|,|u_y| <= ucut:
 * a table on a square grid of n x n points (n odd), du apart, centred on u = 0,
 * rows of u_y, re and im as sampled (not spline coefficients); or, with n = 0,
 * the nx_p x ny_p samples p of a PSF, whose transform is evaluated exactly.
 */
struct otf {
    int n;
    double du;
    double ucut;
    double *re, *im;       /* n * n, owned; im NULL when T is real */
    double *sre, *sim;     /* bicubic B-spline coefficients, owned */
    int nx_p, ny_p;
    double *p;             /* PSF integrated over scale^2, owned; NULL for a table */
    double scale, cx, cy;  /* arcsec per sample; position of the origin, counting from 0 */
    double chdiff;         /* charge diffusion already inside, arcsec (0: none) */
    double pixel;          /* square pixel already inside, arcsec (0: none) */
};

void otf_free(struct otf *t);

/*
 * Table of n x n samples without a spline: re and im (malloc'ed, im may be NULL) become t's on
 * success.  Serves the sums of psf.h; otf_grid needs otf_spline first. E_RANGE.
 */
MUST_CHECK int otf_nodes(struct otf *t, int n, double du, double ucut, double *re, double *im);
/* Prepare the spline of such a table. E_NOMEM. */
MUST_CHECK int otf_spline(struct otf *t);

/* Give back the samples once the spline is there: otf_grid and otf_row still work. */
void otf_keep_spline(struct otf *t);

/* Both, samples copied. E_RANGE, E_NOMEM. */
MUST_CHECK int otf_tabulate(struct otf *t, int n, double du, double ucut, const double *re, const double *im);

/* Take the samples of a PSF (copied), as in otf_from_samples. E_RANGE, E_NOMEM. */
MUST_CHECK int otf_sample(struct otf *t, int nx_p, int ny_p, const double *p, double scale, double cx,
                          double cy, double ucut);

/* 1 when T is real everywhere: im of a table is NULL. */
int otf_is_real(const struct otf *t);

/*
 * T on the tensor grid ux[0..nx-1] x uy[0..ny-1]: re[j*nx + i], im likewise (NULL
 * allowed when T is real).  Table: bicubic spline in u, exact at the nodes.  Samples:
 * exact; by FFT when both axes are regular (one line of ascending, equally
 * spaced u), else by matrix products.
 */
MUST_CHECK int otf_grid(const struct otf *t, int nx, const double *ux, int ny, const double *uy,
                        double *re, double *im);

/*
 * A table's rows one at a time, for those too many to be kept: the columns ux[0..nx-1], then T in the
 * first m of them on the row uy, with the bits of otf_grid.  line: n + 8 doubles whose 4 outer ones on each
 * side are 0.
 */
struct otf_columns;
MUST_CHECK int otf_columns_new(struct otf_columns **c, const struct otf *t, int nx, const double *ux);
void otf_columns_free(struct otf_columns *c);
void otf_row(const struct otf *t, const struct otf_columns *c, int m, double uy, double *line, double *re, double *im);

/*
 * Exact transform of a sampled PSF (n x n' samples p of scale arcsec, centre at
 * (cx, cy) counting from 0): T(u) = sum p_j exp(-2 pi i u.x_j) for |u_x|,|u_y| <= ucut,
 * tensor grid as above, by two matrix products or, on regular axes, by fft_zoom.
 */
MUST_CHECK int otf_from_samples(int nx_p, int ny_p, const double *p, double scale, double cx, double cy,
                                double ucut, int nx, const double *ux, int ny, const double *uy,
                                double *re, double *im);

/* exp(-2 pi^2 sigma^2 u^2), 1 for sigma = 0, and sin(pi u w)/(pi u w): 1-D factors, f[i] *= ... */
void otf_diffusion(int n, const double *u, double sigma, double *f);
void otf_box(int n, const double *u, double width, double *f);
/* c[i] = 2 cos(2 pi u pitch): transform of two points, pitch to either side. */
void otf_neighbours(int n, const double *u, double pitch, double *c);

#endif
