/* detectcat.c - columns of the catalogue of detections; see detectcat.h. */
#include "detectcat.h"
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum how {
    NUMBER, REAL, PIXEL, WHOLE, WHOLE_PIXEL, RIGHT_ASCENSION, DECLINATION, MAGNITUDE,
    MAGNITUDE_ERROR, SURFACE, ELLIPTICITY, ERROR_A, ERROR_B, ERROR_THETA
};

struct definition {
    const char *name;
    enum how how;
    enum col_type type;
    size_t at, error;          /* offsets in struct object */
    int by_default;
    const char *unit, *what;
};

static const char COUNT[] = "count";       /* stands for the unit of the image */

#define AT(member) offsetof(struct object, member)

static const struct definition all[] = {
    {"NUMBER", NUMBER, COL_INT, 0, 0, 1, "", "Running object number"},
    {"X_IMAGE", PIXEL, COL_REAL, AT(x), 0, 1, "pixel", "Centroid along x, first pixel centre is 1"},
    {"Y_IMAGE", PIXEL, COL_REAL, AT(y), 0, 1, "pixel", "Centroid along y, first pixel centre is 1"},
    {"ALPHA_J2000", RIGHT_ASCENSION, COL_REAL, 0, 0, 1, "deg", "Right ascension of the centroid"},
    {"DELTA_J2000", DECLINATION, COL_REAL, 0, 0, 1, "deg", "Declination of the centroid"},
    {"FLUX_AUTO", REAL, COL_REAL32, AT(flux_auto), 0, 1, COUNT, "Flux in the Kron ellipse"},
    {"FLUXERR_AUTO", REAL, COL_REAL32, AT(err_auto), 0, 1, COUNT, "Rms error of FLUX_AUTO"},
    {"MAG_AUTO", MAGNITUDE, COL_REAL32, AT(flux_auto), AT(err_auto), 1, "mag", "Kron magnitude, 99 without flux"},
    {"MAGERR_AUTO", MAGNITUDE_ERROR, COL_REAL32, AT(flux_auto), AT(err_auto), 1, "mag", "Rms error of MAG_AUTO"},
    {"A_IMAGE", REAL, COL_REAL32, AT(a), 0, 1, "pixel", "Rms along the major axis of the isophote"},
    {"B_IMAGE", REAL, COL_REAL32, AT(b), 0, 1, "pixel", "Rms along the minor axis of the isophote"},
    {"THETA_IMAGE", REAL, COL_REAL32, AT(theta), 0, 1, "deg", "Angle of the major axis from x towards y"},
    {"FWHM_IMAGE", REAL, COL_REAL32, AT(fwhm), 0, 1, "pixel", "Width at half maximum of the fitted Gaussian"},
    {"FLUX_RADIUS", REAL, COL_REAL32, AT(flux_radius), 0, 1, "pixel", "Radius of the circle with the given fraction of FLUX_AUTO"},
    {"ISOAREA_IMAGE", WHOLE, COL_INT, AT(area_above), 0, 1, "pixel2", "Unfiltered pixels of the object above THRESHOLD"},
    {"BACKGROUND", REAL, COL_REAL, AT(background), 0, 1, COUNT, "Sky level at the centroid"},
    {"BACKRMS", REAL, COL_REAL32, AT(rms), 0, 1, COUNT, "Noise of a pixel at the centroid"},
    {"FLUX_MAX", REAL, COL_REAL32, AT(peak), 0, 1, COUNT, "Brightest pixel above the sky"},
    {"STAR_PROB", REAL, COL_REAL32, AT(star_prob), 0, 1, "", "Probability of a point source"},
    {"FLAGS", WHOLE, COL_INT, AT(flags), 0, 1, "", "Sum of the flag bits"},
    {"ISOAREAF_IMAGE", WHOLE, COL_INT, AT(area), 0, 0, "pixel2", "Pixels of the object in the filtered image"},
    {"FLUX_ISO", REAL, COL_REAL32, AT(flux_iso), 0, 0, COUNT, "Flux of the isophote"},
    {"FLUXERR_ISO", REAL, COL_REAL32, AT(err_iso), 0, 0, COUNT, "Rms error of FLUX_ISO"},
    {"MAG_ISO", MAGNITUDE, COL_REAL32, AT(flux_iso), AT(err_iso), 0, "mag", "Isophotal magnitude, 99 without flux"},
    {"MAGERR_ISO", MAGNITUDE_ERROR, COL_REAL32, AT(flux_iso), AT(err_iso), 0, "mag", "Rms error of MAG_ISO"},
    {"KRON_RADIUS", REAL, COL_REAL32, AT(kron_radius), 0, 0, "", "Kron ellipse in units of A_IMAGE"},
    {"X2_IMAGE", REAL, COL_REAL32, AT(xx), 0, 0, "pixel2", "Variance along x"},
    {"Y2_IMAGE", REAL, COL_REAL32, AT(yy), 0, 0, "pixel2", "Variance along y"},
    {"XY_IMAGE", REAL, COL_REAL32, AT(xy), 0, 0, "pixel2", "Covariance of x and y"},
    {"ERRX2_IMAGE", REAL, COL_REAL32, AT(err_xx), 0, 0, "pixel2", "Variance of X_IMAGE"},
    {"ERRY2_IMAGE", REAL, COL_REAL32, AT(err_yy), 0, 0, "pixel2", "Variance of Y_IMAGE"},
    {"ERRXY_IMAGE", REAL, COL_REAL32, AT(err_xy), 0, 0, "pixel2", "Covariance of X_IMAGE and Y_IMAGE"},
    {"ERRA_IMAGE", ERROR_A, COL_REAL32, 0, 0, 0, "pixel", "Rms position error along its major axis"},
    {"ERRB_IMAGE", ERROR_B, COL_REAL32, 0, 0, 0, "pixel", "Rms position error along its minor axis"},
    {"ERRTHETA_IMAGE", ERROR_THETA, COL_REAL32, 0, 0, 0, "deg", "Angle of the error ellipse"},
    {"ELLIPTICITY", ELLIPTICITY, COL_REAL32, 0, 0, 0, "", "One minus B_IMAGE over A_IMAGE"},
    {"XWIN_IMAGE", PIXEL, COL_REAL, AT(xwin), 0, 0, "pixel", "Windowed centroid along x"},
    {"YWIN_IMAGE", PIXEL, COL_REAL, AT(ywin), 0, 0, "pixel", "Windowed centroid along y"},
    {"MU_MAX", SURFACE, COL_REAL32, AT(peak), 0, 0, "mag/arcsec2", "Peak surface brightness"},
    {"THRESHOLD", REAL, COL_REAL32, AT(threshold), 0, 0, COUNT, "Detection level above the sky in the filtered image"},
    {"XPEAK_IMAGE", WHOLE_PIXEL, COL_INT, AT(xpeak), 0, 0, "pixel", "Brightest pixel along x"},
    {"YPEAK_IMAGE", WHOLE_PIXEL, COL_INT, AT(ypeak), 0, 0, "pixel", "Brightest pixel along y"},
    {"XMIN_IMAGE", WHOLE_PIXEL, COL_INT, AT(xmin), 0, 0, "pixel", "First column of the isophote"},
    {"XMAX_IMAGE", WHOLE_PIXEL, COL_INT, AT(xmax), 0, 0, "pixel", "Last column of the isophote"},
    {"YMIN_IMAGE", WHOLE_PIXEL, COL_INT, AT(ymin), 0, 0, "pixel", "First row of the isophote"},
    {"YMAX_IMAGE", WHOLE_PIXEL, COL_INT, AT(ymax), 0, 0, "pixel", "Last row of the isophote"}
};

enum { COLUMNS = sizeof all / sizeof *all };

const char *detectcat_name(size_t i)
{
    return i < COLUMNS ? all[i].name : NULL;
}

/* The list's next name into `name`; the position after it, NULL at the end. */
static const char *next_name(const char *list, char name[64])
{
    size_t n = strcspn(list, ",");
    size_t keep = n < 63 ? n : 63;
    memcpy(name, list, keep);
    name[keep] = 0;
    return list[n] ? list + n + 1 : NULL;
}

/* FLUX_APER, MAGERR_APER_2, FLUX_RADIUS_3, ...: they come with --apertures and --flux-fraction, asked for or not. */
static int numbered(const char *name)
{
    static const char *const stem[] = {"FLUX_APER", "FLUXERR_APER", "MAG_APER", "MAGERR_APER", "FLUX_RADIUS"};
    for (size_t k = 0; k < sizeof stem / sizeof *stem; k++) {
        size_t n = strlen(stem[k]);
        if (strncmp(name, stem[k], n))
            continue;
        if (!name[n])
            return k < 4;
        if (name[n] == '_' && name[n + 1] > '0' && name[n + 1] <= '9' && strspn(name + n + 1, "0123456789") == strlen(name + n + 1))
            return 1;
    }
    return 0;
}

static size_t find_definition(const char *name)
{
    size_t i = 0;
    while (i < COLUMNS && strcmp(all[i].name, name) != 0)
        i++;
    return i;
}

int detectcat_unknown(const char *columns, char name[64])
{
    const char *list = columns && *columns == '+' ? columns + 1 : columns;
    while (list) {
        list = next_name(list, name);
        if (find_definition(name) == COLUMNS && !numbered(name))
            return 1;
    }
    return 0;
}

int detectcat_windowed(const char *columns)
{
    return columns && (strstr(columns, "XWIN_IMAGE") || strstr(columns, "YWIN_IMAGE"));
}

int detectcat_errors(const char *columns)
{
    static const char *const name[] = {"ERRX2_", "ERRY2_", "ERRXY_", "ERRA_", "ERRB_", "ERRTHETA_"};
    int any = 0;
    for (size_t k = 0; columns && k < sizeof name / sizeof *name; k++)
        any |= strstr(columns, name[k]) != NULL;
    return any;
}

int detectcat_sizes(const char *columns)
{
    return !columns || *columns == '+' || strstr(columns, "FWHM_IMAGE") || strstr(columns, "STAR_PROB");
}

static double magnitude(double flux, double zeropoint)
{
    return flux > 0 ? zeropoint - 2.5 * log10(flux) : 99;
}

static double magnitude_error(double flux, double error)
{
    return flux > 0 ? 2.5 / log(10) * error / flux : 99;
}

static double number_at(const struct object *o, size_t at)
{
    return *(const double *)(const void *)((const char *)o + at);
}

static long whole_at(const struct object *o, size_t at)
{
    return *(const long *)(const void *)((const char *)o + at);
}

static double real_value(const struct definition *def, const struct object *o, const struct detectcat *c)
{
    double a, b, theta;
    switch (def->how) {
    case PIXEL:
        return number_at(o, def->at) + 1;
    case MAGNITUDE:
        return magnitude(number_at(o, def->at), c->zeropoint);
    case MAGNITUDE_ERROR:
        return magnitude_error(number_at(o, def->at), number_at(o, def->error));
    case SURFACE:
        return magnitude(number_at(o, def->at) / (c->scale * c->scale), c->zeropoint);
    case ELLIPTICITY:
        return 1 - o->b / o->a;
    case ERROR_A:
    case ERROR_B:
    case ERROR_THETA:
        ellipse_axes(o->err_xx, o->err_xy, o->err_yy, &a, &b, &theta);
        return def->how == ERROR_A ? a : def->how == ERROR_B ? b : theta;
    default:
        return number_at(o, def->at);
    }
}

static int fill_sky(struct table *t, const struct detection *d, const struct detectcat *c)
{
    struct column *ra = table_find(t, "ALPHA_J2000"), *dec = table_find(t, "DELTA_J2000");
    if ((!ra && !dec) || d->n == 0)
        return OK;
    double *xy = malloc(4 * d->n * sizeof *xy);
    if (!xy)
        return E_NOMEM;
    double *out = xy + 2 * d->n;
    for (size_t i = 0; i < d->n; i++) {
        xy[i] = d->object[i].x;
        xy[d->n + i] = d->object[i].y;
    }
    int st = sky_from_pixel(c->sky, d->n, xy, xy + d->n, out, out + d->n);
    if (ra)
        memcpy(ra->v.r, out, d->n * sizeof *out);
    if (dec)
        memcpy(dec->v.r, out + d->n, d->n * sizeof *out);
    free(xy);
    return st == E_RANGE ? OK : st;        /* positions off the sky stay NaN */
}

static void fill_column(struct column *col, const struct definition *def, const struct detection *d,
                        const struct detectcat *c)
{
    for (size_t i = 0; i < d->n; i++) {
        const struct object *o = &d->object[i];
        if (def->how == NUMBER)
            col->v.i[i] = (int64_t)i + 1;
        else if (def->how == WHOLE || def->how == WHOLE_PIXEL)
            col->v.i[i] = whole_at(o, def->at) + (def->how == WHOLE_PIXEL);
        else if (def->how != RIGHT_ASCENSION && def->how != DECLINATION)
            col->v.r[i] = real_value(def, o, c);
    }
}

/* FLUX_APER, FLUXERR_APER, MAG_APER, MAGERR_APER and the same with _2, _3, ... */
static int add_apertures(struct table *t, int fill, const struct detection *d, const struct detectcat *c)
{
    size_t n = c->napertures, stride = 2 * n + c->nfractions;
    static const char *const stem[4] = {"FLUX_APER", "FLUXERR_APER", "MAG_APER", "MAGERR_APER"};
    static const char *const what[4] = {"Flux in a circular aperture", "Rms error of the aperture flux",
                                        "Aperture magnitude, 99 without flux", "Rms error of the magnitude"};
    for (size_t k = 0; k < n; k++)
        for (int j = 0; j < 4; j++) {
            char name[64];
            int st = OK;
            if (k == 0)
                snprintf(name, sizeof name, "%s", stem[j]);
            else
                snprintf(name, sizeof name, "%s_%zu", stem[j], k + 1);
            if (!fill)
                st = table_add(t, name, COL_REAL32, j < 2 ? c->unit : "mag", what[j]);
            if (st)
                return st;
            struct column *col = fill ? table_find(t, name) : NULL;
            for (size_t i = 0; col && i < d->n; i++) {
                double f = d->aperture[i * stride + 2 * k], e = d->aperture[i * stride + 2 * k + 1];
                col->v.r[i] = j == 0 ? f : j == 1 ? e : j == 2 ? magnitude(f, c->zeropoint) : magnitude_error(f, e);
            }
        }
    return OK;
}

/* FLUX_RADIUS_2, ... */
static int add_radii(struct table *t, int fill, const struct detection *d, const struct detectcat *c)
{
    size_t stride = 2 * c->napertures + c->nfractions;
    for (size_t k = 0; k < c->nfractions; k++) {
        char name[64];
        snprintf(name, sizeof name, "FLUX_RADIUS_%zu", k + 2);
        int st = fill ? OK : table_add(t, name, COL_REAL32, "pixel", "Radius of the circle with a further fraction of FLUX_AUTO");
        if (st)
            return st;
        struct column *col = fill ? table_find(t, name) : NULL;
        for (size_t i = 0; col && i < d->n; i++)
            col->v.r[i] = d->aperture[i * stride + 2 * c->napertures + k];
    }
    return OK;
}

static int add_column(struct table *t, const struct definition *def, const struct detectcat *c,
                      struct err *e)
{
    if ((def->how == RIGHT_ASCENSION || def->how == DECLINATION) && !c->sky)
        return err_set(e, E_MISSING, "column %s: the image has no world coordinates", def->name);
    if (def->how == SURFACE && !(c->scale > 0))
        return err_set(e, E_MISSING, "column %s: the pixel scale is unknown: give --pixscale", def->name);
    int st = table_add(t, def->name, def->type, def->unit == COUNT ? c->unit : def->unit, def->what);
    if (st == E_RANGE)
        return err_set(e, E_MISSING, "column %s is asked for twice", def->name);
    return st ? err_set(e, st, "%s", err_text(st)) : OK;
}

static int add_named(struct table *t, const char *list, const struct detectcat *c, struct err *e)
{
    while (list) {
        char name[64];
        list = next_name(list, name);
        size_t i = find_definition(name);
        int radius = strncmp(name, "FLUX_RADIUS", 11) == 0;
        if (i == COLUMNS && !numbered(name))
            return err_set(e, E_MISSING, "there is no column '%s': see detect(1)", name);
        if (numbered(name) && (radius ? c->nfractions : c->napertures) == 0)
            return err_set(e, E_MISSING, "column %s: give %s", name, radius ? "--flux-fraction" : "--apertures");
        if (numbered(name))
            continue;
        int st = add_column(t, &all[i], c, e);
        if (st)
            return st;
    }
    return OK;
}

int detectcat_fill(struct table *t, const struct detection *d, const struct detectcat *c, struct err *e)
{
    int st = OK;
    const char *list = c->columns;
    if (!list || *list == '+') {
        for (size_t i = 0; i < COLUMNS && !st; i++) {
            int sky = all[i].how == RIGHT_ASCENSION || all[i].how == DECLINATION;
            if (all[i].by_default && (c->sky || !sky))
                st = add_column(t, &all[i], c, e);
        }
        list = list ? list + 1 : NULL;
    }
    if (!st)
        st = add_named(t, list, c, e);
    if (st)
        return st;
    st = add_apertures(t, 0, d, c);
    if (!st)
        st = add_radii(t, 0, d, c);
    if (!st)
        st = table_resize(t, d->n);
    if (!st)
        st = add_apertures(t, 1, d, c);
    if (!st)
        st = add_radii(t, 1, d, c);
    for (size_t k = 0; k < t->ncol && !st; k++)
        for (size_t i = 0; i < COLUMNS; i++)
            if (strcmp(all[i].name, t->col[k].name) == 0)
                fill_column(&t->col[k], &all[i], d, c);
    if (!st)
        st = fill_sky(t, d, c);
    return st ? err_set(e, st, "%s", err_text(st)) : OK;
}
