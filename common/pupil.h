/*
 * pupil.h - telescope pupil -> optical transfer function.
 *
 * Amplitude A(p) = (disc - obscuration - vanes - pads) exp(2 pi i W(p)), PSF = |FT A|^2,
 *
 *   T(u) = int A(p) A*(p + lambda u) dp / int |A|^2 dp,
 *
 * p in the pupil, x to the right and y up as on the sky.  W = sum c_j Z_j in waves of the central
 * wavelength, rms over the unobscured disc, Zernike polynomials in the order and normalisation of
 * Noll (1976, JOSA 66, 207).  Positive Z2 moves the image to the right, positive Z3 up.
 */
#ifndef PIXSHEAR_PUPIL_H
#define PIXSHEAR_PUPIL_H

#include "err.h"
#include "otf.h"

enum { PUPIL_TERMS = 64, PUPIL_PADS = 4, PUPIL_CELLS_MAX = 8192, ZERNIKE_MAX = 496 };

struct pupil {
    double diameter;           /* m */
    double obscuration;        /* diameter of the central obscuration / diameter, 0..1 */
    double offset[2];          /* centre of the obscuration / diameter */
    int struts;                /* vanes from the middle to the edge, at equal angles */
    double strut_width;        /* m */
    double strut_angle;        /* of the first vane, deg from x towards y */
    int pads;                  /* circular pads: x, y, radius / (diameter/2) */
    double pad[PUPIL_PADS][3];
    int terms;                 /* aberrations */
    int noll[PUPIL_TERMS];
    double waves[PUPIL_TERMS]; /* rms at the central wavelength */
    double wavelength;         /* m, centre of the band */
    double bandwidth;          /* m, full width of a band of constant F_nu; 0: one wavelength */
    int wavelengths;           /* Gauss-Legendre points in the band */
};

/* What a telescope's name stands for besides its pupil. */
struct telescope {
    const char *name, *what;
    struct pupil pupil;
    double diffusion;          /* arcsec */
};

/* Presets, number i = 0, 1, ...; NULL past the last. */
const struct telescope *telescope_preset(int i);

/*
 * a[y*m + x] = covered fraction of m x m cells of size h (in diameters), the pupil's centre in the
 * middle: exact for straight edges, and for circles to second order in h / radius.
 */
MUST_CHECK int pupil_coverage(const struct pupil *p, double h, int m, double *a);

/* Clear area, m^2, from the coverage on m cells across. NaN when there is no memory. */
double pupil_area(const struct pupil *p, int m);

/* Z_j(x, y), unit rms over the unit disc; 1 <= j <= ZERNIKE_MAX, else NaN. */
double zernike(int j, double x, double y);

/* Highest frequency passed, cycles/arcsec: diameter / shortest wavelength. */
double pupil_cutoff(const struct pupil *p);

/*
 * T of a clear aperture with a round obscuration wholly inside, in closed form (O'Neill 1956, JOSA 46,
 * 285, and the same overlaps for a displaced obscuration): vx, vy = lambda u / diameter. 1e-15.
 */
double pupil_annulus(double eps, double offx, double offy, double vx, double vy);

/*
 * Table (without spline: otf_spline) of T with 2 cells + 1 points a side, du = cut-off / cells.  By closed form when only discs are involved,
 * otherwise by FFT of cells over the diameter at the shortest wavelength.  T(0) = 1.
 * E_RANGE: parameters out of range, or an aberration that turns the phase by more than half a wave
 * from cell to cell (e says which); E_SINGULAR: no light passes; E_NOMEM.
 */
MUST_CHECK int pupil_otf(const struct pupil *p, int cells, struct otf *t, struct err *e);

/* Memory pupil_otf needs at most, bytes. */
double pupil_memory(int cells);

#endif
