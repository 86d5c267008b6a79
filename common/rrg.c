/* rrg.c - PSF correction of weighted moments and susceptibility to shear; formulas in rrg.h. */
#include "rrg.h"
#include <math.h>

#define RESOLVED 1e-5         /* T corrected / T raw of the smallest object with an ellipticity */

int rrg_psf_free(const struct rrg_psf *psf, int first, double p[3])
{
    const double *j = psf->m2, w2 = psf->w * psf->w, trace = j[0] + j[2];
    double a = 1 - j[0] / w2, b = -j[1] / w2, c = 1 - j[2] / w2;
    double low = 0.5 * (a + c) - sqrt(0.25 * (a - c) * (a - c) + b * b);
    if (first || !(low >= SHAPE_SINGULAR_LIMIT)) {
        p[0] = j[0] + (psf->m4[0] + psf->m4[2] - j[0] * trace) / (2 * w2);
        p[1] = j[1] + (psf->m4[1] + psf->m4[3] - j[1] * trace) / (2 * w2);
        p[2] = j[2] + (psf->m4[2] + psf->m4[4] - j[2] * trace) / (2 * w2);
        return first ? OK : E_SINGULAR;
    }
    /* (J^-1 - 1/w^2)^-1 = (1 - J/w^2)^-1 J */
    double d = a * c - b * b;
    p[0] = (c * j[0] - b * j[1]) / d;
    p[1] = (c * j[1] - b * j[2]) / d;
    p[2] = (a * j[2] - b * j[1]) / d;
    return OK;
}

/* J' = J - q_ij + (q_ik J_kj + q_jk J_ki)/w^2 - q_kl (J_ijkl - J_ij J_kl)/(2 w^4) */
static void round_off(const double j[3], const double f[5], double w2, const double p[3], double out[3])
{
    double qa = 0.5 * (p[0] - p[2]), qb = p[1];               /* q = (qa, qb; qb, -qa) */
    double qj = qa * (j[0] - j[2]) + 2 * qb * j[1];
    double q4[3] = {qa * (f[0] - f[2]) + 2 * qb * f[1], qa * (f[1] - f[3]) + 2 * qb * f[2],
                    qa * (f[2] - f[4]) + 2 * qb * f[3]};
    double q[3] = {qa, qb, -qa};
    double turn[3] = {2 * (qa * j[0] + qb * j[1]), qb * (j[0] + j[2]), 2 * (qb * j[1] - qa * j[2])};
    for (int k = 0; k < 3; k++)
        out[k] = j[k] - q[k] + turn[k] / w2 - (q4[k] - j[k] * qj) / (2 * w2 * w2);
}

/*
 * The same for a star at the PSF's width, less the g_w^2 that should be left:
 * of order q^2.  Subtracted from J' it makes a point source come out at exactly
 * zero size for every PSF.
 */
static void star_residual(const struct rrg_psf *psf, const double p[3], double out[3])
{
    double w2 = psf->w * psf->w, g2 = 0.5 * (p[0] + p[2]), gw2 = g2 * w2 / (w2 + g2);
    round_off(psf->m2, psf->m4, w2, p, out);
    out[0] -= gw2;
    out[2] -= gw2;
}

/* Fourth moments before a round Gaussian of variance gw2 under the product weight. */
static void fourth_exact(const double f[5], const double j[3], double gw2, double s, double out[5])
{
    double s4 = s * s * s * s, g4 = gw2 * gw2;
    out[0] = (f[0] - 6 * gw2 * j[0] + 3 * g4) / s4;
    out[1] = (f[1] - 3 * gw2 * j[1]) / s4;
    out[2] = (f[2] - gw2 * (j[0] + j[2]) + g4) / s4;
    out[3] = (f[3] - 3 * gw2 * j[1]) / s4;
    out[4] = (f[4] - 6 * gw2 * j[2] + 3 * g4) / s4;
}

/* The rule for unweighted moments of a convolution, applied to weighted ones. */
static void fourth_plain(const double f[5], const double j[3], const double pf[5], const double p[3], double out[5])
{
    out[0] = f[0] - pf[0] - 6 * p[0] * j[0] + 6 * p[0] * p[0];
    out[1] = f[1] - pf[1] - 3 * (p[1] * j[0] + p[0] * j[1]) + 6 * p[1] * p[0];
    out[2] = f[2] - pf[2] - p[0] * j[2] - p[2] * j[0] - 4 * p[1] * j[1] + 2 * p[0] * p[2] + 4 * p[1] * p[1];
    out[3] = f[3] - pf[3] - 3 * (p[1] * j[2] + p[2] * j[1]) + 6 * p[1] * p[2];
    out[4] = f[4] - pf[4] - 6 * p[2] * j[2] + 6 * p[2] * p[2];
}

/*
 * Change of e_c by the motion of the centroid under shear component c = 0, 1:
 * f_i = J_ikl Phi_kl, c = -(1 - J/w^2)^-1 f/w^2, dJ_ij = J_ijk c_k/w^2 (w = weff).
 */
static double centroid_term(const struct rrg *r, int component)
{
    const double *t = r->m3, *j = r->m2, w2 = r->weff * r->weff;
    double fx = component ? 2 * t[1] : t[0] - t[2], fy = component ? 2 * t[2] : t[1] - t[3];
    double a = 1 - j[0] / w2, b = -j[1] / w2, c = 1 - j[2] / w2, d = a * c - b * b;
    double cx = -(c * fx - b * fy) / (d * w2), cy = -(a * fy - b * fx) / (d * w2);
    double dxx = (t[0] * cx + t[1] * cy) / w2, dxy = (t[1] * cx + t[2] * cy) / w2,
           dyy = (t[2] * cx + t[3] * cy) / w2;
    double part = component ? 2 * dxy : dxx - dyy;
    return (part - r->e[component] * (dxx + dyy)) / (j[0] + j[2]);
}

static void set_nan(double *v, int n)
{
    for (int i = 0; i < n; i++)
        v[i] = NAN;
}

/* Nothing can be said about an ellipticity. */
static void no_ellipticity(struct rrg *r)
{
    set_nan(r->e, 2);
    set_nan(r->e_err, 2);
    set_nan(r->mu, 2);
    r->lambda = r->p11 = r->p22 = NAN;
}

/* sqrt of a variance; rounding may leave it below zero. */
static double spread(double var)
{
    return sqrt(var > 0 || isnan(var) ? var : 0);
}

/* e, its errors, and the terms of G from the corrected moments. */
static void ellipticity(struct rrg *r, int centroid)
{
    const double *j = r->m2, *f = r->m4, *c = r->cov, t = j[0] + j[2];
    double e1 = r->e[0] = (j[0] - j[2]) / t, e2 = r->e[1] = 2 * j[1] / t;
    double u = 1 - e1, v = 1 + e1;
    r->e_err[0] = spread(u * u * c[0] + v * v * c[5] - 2 * u * v * c[2]) / t;
    r->e_err[1] = spread(4 * c[3] + e2 * e2 * (c[0] + c[5] + 2 * c[2]) - 4 * e2 * (c[1] + c[4])) / t;

    double b = 1 / (r->weff * r->weff * t);
    r->lambda = b * (f[0] + 2 * f[2] + f[4]);
    r->mu[0] = -b * (f[0] - f[4]);
    r->mu[1] = -2 * b * (f[1] + f[3]);
    r->p11 = 2 - 2 * e1 * e1 - b * (f[0] - 2 * f[2] + f[4] - e1 * (f[0] - f[4]));
    r->p22 = 2 - 2 * e2 * e2 - b * (4 * f[2] - 2 * e2 * (f[1] + f[3]));
    if (centroid) {
        r->p11 += centroid_term(r, 0);
        r->p22 += centroid_term(r, 1);
    }
    if (!(hypot(e1, e2) <= 1))
        r->flags |= SHAPE_BIGE;
}

void rrg_correct(const struct moments *m, const struct rrg_psf *psf, const struct rrg_options *opt,
                 struct rrg *out)
{
    struct rrg r = {.flags = m->flags};
    double raw = m->m2[0] + m->m2[2], p[3], round[3], left[3] = {0};
    r.d = raw >= 0 ? sqrt(0.5 * raw) : NAN;
    r.d_err = spread(m->cov[0] + m->cov[5] + 2 * m->cov[2]) / (4 * r.d);
    if (rrg_psf_free(psf, opt->first, p) != OK)
        r.flags |= SHAPE_NEARSINGULAR;

    double g2 = 0.5 * (p[0] + p[2]), w2 = m->w * m->w;
    r.weff = sqrt(w2 + g2);
    double s = w2 / (w2 + g2), gw2 = g2 * s;
    round_off(m->m2, m->m4, w2, p, round);
    if (!opt->first)
        star_residual(psf, p, left);
    for (int k = 0; k < 3; k++)
        r.m2[k] = (round[k] - left[k] - (k == 1 ? 0 : gw2)) / (s * s);
    for (int k = 0; k < 4; k++)
        r.m3[k] = m->m3[k] / (s * s * s);
    if (opt->plain)
        fourth_plain(m->m4, m->m2, psf->m4, p, r.m4);
    else
        fourth_exact(m->m4, round, gw2, s, r.m4);
    for (int k = 0; k < 6; k++)
        r.cov[k] = m->cov[k] / (s * s * s * s);

    if (m->flags & SHAPE_NOFLUX) {
        no_ellipticity(&r);
    } else if (!(r.m2[0] + r.m2[2] > RESOLVED * raw)) {
        r.flags |= SHAPE_UNRESOLVED;
        no_ellipticity(&r);
    } else {
        ellipticity(&r, opt->centroid);
    }
    *out = r;
}

#define DIFFERENCE 1e-2        /* steps of the derivatives, in errors of the PSF's moments */

void rrg_psf_error(const struct moments *m, const struct rrg_psf *psf, const struct rrg_options *opt,
                   const double cov[8][8], const struct rrg *r, double err[2])
{
    double by[2][8], var[2] = {0};
    for (int q = 0; q < 8; q++) {
        const double h = DIFFERENCE * sqrt(cov[q][q]);
        struct rrg up, down;
        struct rrg_psf p = *psf;
        double *v = q < 3 ? &p.m2[q] : &p.m4[q - 3];
        by[0][q] = by[1][q] = 0;
        if (h == 0)
            continue;
        const double at = *v;
        *v = at + h;
        rrg_correct(m, &p, opt, &up);
        *v = at - h;
        rrg_correct(m, &p, opt, &down);
        for (int c = 0; c < 2; c++)
            by[c][q] = (up.e[c] - down.e[c]) / (2 * h);
    }
    for (int c = 0; c < 2; c++) {
        for (int q = 0; q < 8; q++)
            for (int k = 0; k < 8; k++)
                var[c] += by[c][q] * by[c][k] * cov[q][k];
        err[c] = isnan(r->e[c]) ? NAN : spread(var[c]);
    }
}

double rrg_response(const struct rrg *r)
{
    return 0.5 * (r->p11 + r->p22);
}
