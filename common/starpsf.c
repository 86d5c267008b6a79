/* starpsf.c - star moments of a PSF that is known exactly. */
#include "starpsf.h"
#include "psf.h"
#include <math.h>

int starmom_from_otf(struct starmom *s, const struct otf *t, double scale, double response)
{
    struct starmom r = {.dstar_err = NAN, .dstar_w = fmax(0.8, 0.1 / scale)};
    double pixel = t->pixel > 0 ? 0 : response, hi = fmin(fmax(1, 2 * scale), psf_period(t) / 17), p2 = scale * scale;
    if (!(scale > 0) || !(response >= 0) || (t->pixel > 0 && !(fabs(t->pixel - response) < 1e-6 * response)))
        return E_RANGE;
    int st = starmom_widths(&r, STARMOM_WIDTHS, 0.8, hi / scale);
    for (int i = -1; i < r.n && st == OK; i++) {
        double w = (i < 0 ? r.dstar_w : r.w[i]) * scale, x0, y0, m[PSF_MOMENTS];
        st = psf_centroid(t, 0, pixel, w, &x0, &y0);
        if (st == OK)
            st = psf_moments(t, 0, pixel, w, x0, y0, m);
        if (st)
            return st;
        if (i < 0) {
            r.dstar = sqrt(0.5 * (m[psf_moment_index(2, 0)] + m[psf_moment_index(0, 2)]) / p2);
            continue;
        }
        for (int q = 0; q < STARMOM_N; q++)
            r.m[q][i] = q < 3 ? m[psf_moment_index(2 - q, q)] / p2 : m[psf_moment_index(7 - q, q - 3)] / (p2 * p2);
    }
    if (st == OK)
        st = starmom_prepare(&r);
    if (st == OK)
        *s = r;
    return st;
}
