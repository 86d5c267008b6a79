/*
 * pupil.c - coverage of pupil cells, Zernike aberrations, autocorrelation.
 *
 * The autocorrelation of M cells across the diameter (or of 2M, every second value), padded to twice the
 * size, is the table of T at multiples of (D/lambda)/M.  It is divided by the sum of coverage, T(0) set to 1: the sum of squares of
 * partly covered cells falls short of the area by 1.1/M.  Each wavelength of a band has cells of size
 * lambda du / D, so that all share the nodes u and no table is interpolated.
 */
#include "pupil.h"
#include "fft.h"
#include <gsl/gsl_errno.h>
#include <gsl/gsl_integration.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double ARCSEC = 4.84813681109535993590e-6;    /* rad */

/*
 * Public figures.  hst: Tiny Tim's pupil tables (vanes .022 and pads of the radius), WFC3/ACS at 814 nm;
 * euclid: 1.2 m, secondary .42 m from the collecting area of .993 m^2, 550-900 nm, nominal vanes;
 * roman: 2.37 m, .32, vane width from the collecting area of 3.757 m^2, F158, diffusion .1 pixel of .11".
 */
static const struct telescope presets[] = {
    {"snap", "2 m, three vanes, 820 nm, charge diffusion 0.04\"",
     {.diameter = 2, .obscuration = 0.30, .struts = 3, .strut_width = 0.04, .strut_angle = 90,
      .wavelength = 820e-9}, 0.04},
    {"hst", "2.4 m, four vanes, three pads, 814 nm",
     {.diameter = 2.4, .obscuration = 0.33, .struts = 4, .strut_width = 0.0264, .strut_angle = 0,
      .pads = 3, .pad = {{0.8921, 0, 0.065}, {-0.4615, 0.7555, 0.065}, {-0.4564, -0.7606, 0.065}},
      .wavelength = 814e-9}, 0},
    {"euclid", "1.2 m, three vanes, 550-900 nm",
     {.diameter = 1.2, .obscuration = 0.35, .struts = 3, .strut_width = 0.012, .strut_angle = 90,
      .wavelength = 725e-9, .bandwidth = 350e-9}, 0},
    {"roman", "2.37 m, six vanes, 1380-1774 nm, charge diffusion 0.011\"",
     {.diameter = 2.37, .obscuration = 0.32, .struts = 6, .strut_width = 0.042, .strut_angle = 90,
      .wavelength = 1577e-9, .bandwidth = 394e-9}, 0.011},
};

const struct telescope *telescope_preset(int i)
{
    return i >= 0 && (size_t)i < sizeof presets / sizeof *presets ? &presets[i] : NULL;
}

/*
 * Fraction of a unit square on the near side of a line: d = signed distance of the line from the
 * square's centre, positive when the centre is covered; (c, s) its normal.
 */
static double half_plane(double d, double c, double s)
{
    c = fabs(c);
    s = fabs(s);
    double a = fmax(c, s), b = fmin(c, s), t = (a + b) / 2 - fabs(d), f;
    if (t <= 0)
        f = 0;
    else if (t < b)
        f = t * t / (2 * a * b);
    else
        f = 0.5 - fabs(d) / a;
    return d > 0 ? 1 - f : f;
}

/* Covered fraction by a disc of radius r about (x0, y0), all in diameters. */
static double disc(double x, double y, double x0, double y0, double r, double h)
{
    double dx = x - x0, dy = y - y0, s = hypot(dx, dy);
    if (!(r > 0))
        return 0;
    if (fabs(r - s) > h)
        return s < r;
    return s > 0 ? half_plane((r - s) / h, dx / s, dy / s) : 1;
}

/* Covered fraction by a vane of the given width from the origin outwards along (c, s). */
static double vane(double x, double y, double c, double s, double width, double h)
{
    double along = x * c + y * s, across = y * c - x * s;
    if (along < -h || fabs(across) > width / 2 + h)
        return 0;
    double end = half_plane(along / h, c, s);
    double side = half_plane((width / 2 - across) / h, s, c) + half_plane((width / 2 + across) / h, s, c) - 1;
    return end * fmax(side, 0);
}

static int pupil_valid(const struct pupil *p)
{
    if (!(p->diameter > 0) || !isfinite(p->diameter) || !(p->obscuration >= 0 && p->obscuration <= 1) ||
        !(hypot(p->offset[0], p->offset[1]) <= 1) || p->struts < 0 || p->struts > 360 ||
        !(p->strut_width >= 0) || !isfinite(p->strut_angle) || p->pads < 0 || p->pads > PUPIL_PADS ||
        p->terms < 0 || p->terms > PUPIL_TERMS || !(p->wavelength > 0) || !isfinite(p->wavelength) ||
        !(p->bandwidth >= 0 && p->bandwidth < 2 * p->wavelength) ||
        (p->bandwidth > 0 && (p->wavelengths < 0 || p->wavelengths > 512)))
        return 0;
    for (int i = 0; i < p->terms; i++)
        if (p->noll[i] < 1 || p->noll[i] > ZERNIKE_MAX || !isfinite(p->waves[i]))
            return 0;
    return 1;
}

int pupil_coverage(const struct pupil *p, double h, int m, double *a)
{
    if (!pupil_valid(p) || !(h > 0) || m < 1)
        return E_RANGE;
    double width = p->strut_width / p->diameter, c[360], s[360];
    int struts = width > 0 ? p->struts : 0;
    for (int k = 0; k < struts; k++) {
        double turn = fmod(p->strut_angle / 360 + (double)k / struts, 1);
        c[k] = cos(2 * M_PI * turn);
        s[k] = sin(2 * M_PI * turn);
    }
    for (int j = 0; j < m; j++)
        for (int i = 0; i < m; i++) {
            double x = (i - (m - 1) / 2.0) * h, y = (j - (m - 1) / 2.0) * h;
            double f = disc(x, y, 0, 0, 0.5, h);
            if (f > 0)
                f *= 1 - disc(x, y, p->offset[0], p->offset[1], p->obscuration / 2, h);
            for (int k = 0; f > 0 && k < struts; k++)
                f *= 1 - vane(x, y, c[k], s[k], width, h);
            for (int k = 0; f > 0 && k < p->pads; k++)
                f *= 1 - disc(x, y, p->pad[k][0] / 2, p->pad[k][1] / 2, p->pad[k][2] / 2, h);
            a[(size_t)j * (size_t)m + (size_t)i] = f;
        }
    return OK;
}

double pupil_area(const struct pupil *p, int m)
{
    double sum = 0, *a = m > 0 ? malloc((size_t)m * (size_t)m * sizeof *a) : NULL;
    if (!a || pupil_coverage(p, 1.0 / m, m, a) != OK)
        sum = NAN;
    else
        for (size_t i = 0; i < (size_t)m * (size_t)m; i++)
            sum += a[i];
    free(a);
    return sum * p->diameter * p->diameter / m / m;
}

double pupil_cutoff(const struct pupil *p)
{
    return p->diameter / (p->wavelength - p->bandwidth / 2) * ARCSEC;
}

/* Jacobi polynomial P_k^(0,m)(z), DLMF 18.9.2. */
static double jacobi(int k, int m, double z)
{
    double below = 0, here = 1;
    for (int n = 0; n < k; n++) {
        double above;
        if (n == 0) {
            above = ((2.0 + m) * z - m) / 2;
        } else {
            double t = 2.0 * n + m;
            above = ((t + 1) * ((t + 2) * t * z - (double)m * m) * here - 2.0 * n * (n + m) * (t + 2) * below) /
                    (2 * (n + 1.0) * (n + m + 1.0) * t);
        }
        below = here;
        here = above;
    }
    return here;
}

double zernike(int j, double x, double y)
{
    if (j < 1 || j > ZERNIKE_MAX)
        return NAN;
    int n = 0, first = 1;    /* first j of order n */
    while (first + n + 1 <= j)
        first += ++n;
    int k = j - first, m = n % 2 ? k / 2 * 2 + 1 : (k + 1) / 2 * 2;
    double r2 = x * x + y * y, re = 1, im = 0;    /* (x + iy)^m */
    for (int i = 0; i < m; i++) {
        double t = re * x - im * y;
        im = re * y + im * x;
        re = t;
    }
    double radial = sqrt(n + 1.0) * jacobi((n - m) / 2, m, 2 * r2 - 1);
    if (m == 0)
        return radial;
    return M_SQRT2 * radial * (j % 2 ? im : re);
}

/* Overlap area of two discs of radii a, b at distance d. */
static double overlap(double a, double b, double d)
{
    if (d >= a + b)
        return 0;
    double small = fmin(a, b);
    if (d <= fabs(a - b))
        return M_PI * small * small;
    double ca = fmin(1, fmax(-1, ((d - b) * (d + b) + a * a) / (2 * a * d)));
    double cb = fmin(1, fmax(-1, ((d - a) * (d + a) + b * b) / (2 * b * d)));
    return a * a * (acos(ca) - ca * sqrt((1 - ca) * (1 + ca))) + b * b * (acos(cb) - cb * sqrt((1 - cb) * (1 + cb)));
}

double pupil_annulus(double eps, double offx, double offy, double vx, double vy)
{
    double v = hypot(vx, vy), r = eps / 2, clear = M_PI / 4 * (1 - eps * eps);
    if (v == 0)
        return 1;
    double sum = overlap(0.5, 0.5, v);
    if (eps > 0)
        sum += overlap(r, r, v) - overlap(0.5, r, hypot(vx - offx, vy - offy)) -
               overlap(0.5, r, hypot(vx + offx, vy + offy));
    return sum / clear;
}

double pupil_memory(int cells)
{
    double side = 2.0 * cells + 1;
    return side * side * 8 * (cells < 512 ? 11 : 4.5);    /* cells, their padded transform, sums: of both planes */
}

/* Nothing but discs, and the obscuration inside: the closed form holds. */
static int only_discs(const struct pupil *p)
{
    return (p->struts == 0 || p->strut_width == 0) && p->pads == 0 && p->terms == 0 &&
           hypot(p->offset[0], p->offset[1]) + p->obscuration / 2 <= 0.5;
}

/*
 * Phase exp(2 pi i W) times coverage into the padded complex array z (side n), W in waves of this wavelength.
 * E_RANGE when W changes by more than half a wave between neighbours that are lit.
 */
static int aberrate(const struct pupil *p, double waves, double h, int m, const double *cover, double *z, int n)
{
    double *last = calloc((size_t)m + 1, sizeof *last);    /* W of the row below, NaN where dark; W to the left */
    if (!last)
        return E_NOMEM;
    int steep = 0;
    for (int i = 0; i <= m; i++)
        last[i] = NAN;
    for (int j = 0; j < m; j++) {
        double left = NAN;
        for (int i = 0; i < m; i++) {
            double f = cover[(size_t)j * (size_t)m + (size_t)i], w = NAN;
            double *at = z + 2 * ((size_t)j * (size_t)n + (size_t)i);
            if (f > 0) {
                double x = 2 * (i - (m - 1) / 2.0) * h, y = 2 * (j - (m - 1) / 2.0) * h;
                w = 0;
                for (int k = 0; k < p->terms; k++)
                    w += p->waves[k] * zernike(p->noll[k], x, y);
                w *= waves;
                double turn = remainder(w, 1);
                at[0] = f * cos(2 * M_PI * turn);
                at[1] = f * sin(2 * M_PI * turn);
                steep |= fabs(w - left) > 0.5 || fabs(w - last[i]) > 0.5 || !isfinite(w);
            }
            left = last[i] = w;
        }
    }
    free(last);
    return steep ? E_RANGE : OK;
}

/* |FT|^2 of a complex array, then its transform: the autocorrelation, n x n complex, in place. */
static int correlate(double *z, int n)
{
    struct fft *f = NULL;
    int status = fft_plan_c2c(&f, n, n, -1);
    if (status)
        return status;
    fft_run(f, z, z);
    for (size_t i = 0; i < (size_t)n * (size_t)n; i++) {
        z[2 * i] = z[2 * i] * z[2 * i] + z[2 * i + 1] * z[2 * i + 1];
        z[2 * i + 1] = 0;
    }
    fft_run(f, z, z);
    fft_done(f);
    return OK;
}

/* The same for a real array: autocorrelation, n x n real, into a (n x n). */
static int correlate_real(double *a, int n)
{
    struct fft *there = NULL, *back = NULL;
    size_t half = (size_t)n * ((size_t)n / 2 + 1);
    double *z = fft_alloc(half * 2 * sizeof *z);
    int status = z ? fft_plan_r2c(&there, n, n) : E_NOMEM;
    if (status == OK)
        status = fft_plan_c2r(&back, n, n);
    if (status == OK) {
        fft_run(there, a, z);
        for (size_t i = 0; i < half; i++) {
            z[2 * i] = z[2 * i] * z[2 * i] + z[2 * i + 1] * z[2 * i + 1];
            z[2 * i + 1] = 0;
        }
        fft_run(back, z, a);
    }
    fft_done(there);
    fft_done(back);
    fft_free(z);
    return status;
}

/*
 * Cells are halved where that costs little: the errors of their edges fall by 3-5.  In a band
 * the edges of the wavelengths' cells differ and average out.
 */
static int subdivide(const struct pupil *p, int cells)
{
    return p->bandwidth == 0 && cells < 512 ? 2 : 1;
}

/* Add weight * T at one wavelength to the table re, im (side 2 cells + 1). */
static int add_wavelength(const struct pupil *p, double lambda, double weight, double du, int cells, double *re,
                          double *im)
{
    int finer = subdivide(p, cells);
    double h = lambda * du / ARCSEC / p->diameter / finer;
    int m = (int)ceil(1 / h - 1e-9), n = fft_good_size(2 * cells * finer), side = 2 * cells + 1;
    size_t count = (size_t)n * (size_t)n;
    int step = p->terms ? 2 : 1;    /* doubles per element */
    double *cover = malloc((size_t)m * (size_t)m * sizeof *cover), *z = fft_alloc(count * (size_t)step * sizeof *z);
    int status = cover && z ? pupil_coverage(p, h, m, cover) : E_NOMEM;
    double sum = 0;
    for (size_t i = 0; status == OK && i < (size_t)m * (size_t)m; i++)
        sum += cover[i];
    if (status == OK && !(sum > 0))
        status = E_SINGULAR;
    if (status == OK) {
        memset(z, 0, count * (size_t)step * sizeof *z);
        if (p->terms)
            status = aberrate(p, p->wavelength / lambda, h, m, cover, z, n);
        else
            for (int j = 0; j < m; j++)
                memcpy(z + (size_t)j * (size_t)n, cover + (size_t)j * (size_t)m, (size_t)m * sizeof *z);
    }
    if (status == OK)
        status = p->terms ? correlate(z, n) : correlate_real(z, n);
    double norm = weight / sum / (double)count;
    for (int j = 0; status == OK && j < side; j++)
        for (int i = 0; i < side; i++) {
            size_t at = (size_t)(((j - cells) * finer + n) % n) * (size_t)n + (size_t)(((i - cells) * finer + n) % n);
            size_t to = (size_t)j * (size_t)side + (size_t)i;
            if (i == cells && j == cells) {
                re[to] += weight;
                continue;
            }
            re[to] += norm * z[at * (size_t)step];
            if (p->terms)
                im[to] += norm * z[2 * at + 1];
        }
    free(cover);
    fft_free(z);
    return status;
}

static void add_annulus(const struct pupil *p, double lambda, double weight, double du, int cells, double *re)
{
    int side = 2 * cells + 1;
    double step = lambda * du / ARCSEC / p->diameter;
    for (int j = 0; j < side; j++)
        for (int i = 0; i < side; i++)
            re[(size_t)j * (size_t)side + (size_t)i] +=
                weight * pupil_annulus(p->obscuration, p->offset[0], p->offset[1], (i - cells) * step, (j - cells) * step);
}

/* Sum over the band: photon weights of a source of constant F_nu, dlambda / lambda. */
static int add_band(const struct pupil *p, double du, int cells, double *re, double *im)
{
    int n = p->bandwidth > 0 ? p->wavelengths > 0 ? p->wavelengths : 8 : 1;
    double lambda[512], weight[512], total = 0;
    gsl_set_error_handler_off();    /* GSL is to report by status */
    gsl_integration_glfixed_table *gl = gsl_integration_glfixed_table_alloc((size_t)n);
    if (!gl)
        return E_NOMEM;
    for (int k = 0; k < n; k++) {
        double x, w;
        gsl_integration_glfixed_point(-1, 1, (size_t)k, &x, &w, gl);
        lambda[k] = p->wavelength + p->bandwidth / 2 * x;
        weight[k] = w / lambda[k];
        total += weight[k];
    }
    gsl_integration_glfixed_table_free(gl);
    int status = OK;
    for (int k = 0; k < n && status == OK; k++)
        if (only_discs(p))
            add_annulus(p, lambda[k], weight[k] / total, du, cells, re);
        else
            status = add_wavelength(p, lambda[k], weight[k] / total, du, cells, re, im);
    return status;
}

int pupil_otf(const struct pupil *p, int cells, struct otf *t, struct err *e)
{
    if (!pupil_valid(p))
        return err_set(e, E_RANGE, "telescope: value out of range");
    if (cells < 8 || cells > PUPIL_CELLS_MAX)
        return err_set(e, E_RANGE, "pupil grid of %d cells: must be 8 to %d", cells, PUPIL_CELLS_MAX);
    if (!(p->obscuration < 1) && hypot(p->offset[0], p->offset[1]) == 0)
        return err_set(e, E_SINGULAR, "the pupil is wholly obscured: no light passes");
    int side = 2 * cells + 1;
    size_t count = (size_t)side * (size_t)side;
    double cutoff = pupil_cutoff(p), du = cutoff / cells;
    double *re = calloc(count, sizeof *re), *im = p->terms ? calloc(count, sizeof *im) : NULL;
    int status = re && (im || !p->terms) ? add_band(p, du, cells, re, im) : E_NOMEM;
    if (status == OK)
        status = otf_nodes(t, side, du, cutoff, re, im);
    if (status) {
        free(re);
        free(im);
    }
    if (status == E_SINGULAR)
        return err_set(e, status, "the pupil is wholly obscured: no light passes");
    if (status == E_RANGE)
        return err_set(e, status, "the aberration turns the phase by more than half a wave between cells of the pupil: "
                                  "use a larger --pupil-grid than %d", cells);
    return status ? err_set(e, status, "%s", err_text(status)) : OK;
}
