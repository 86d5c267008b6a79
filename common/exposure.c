/*
 * exposure.c - the exposures of a FITS file.
 */
#include "exposure.h"
#include "fileio.h"
#include "sky.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* 1 when the name's suffix, not the file itself, selects an HDU; -1 without memory. */
static int has_suffix(const char *name)
{
    char *path, *suffix;
    if (file_split(name, &path, &suffix))
        return -1;
    int has = suffix != NULL;
    free(path);
    free(suffix);
    return has;
}

int exposure_list(const struct fits_in *f, const char *name, int **list, size_t *n, struct err *e)
{
    const int count = fits_in_count(f), one = fits_in_selected(f), suffix = has_suffix(name);
    int *found = suffix < 0 ? NULL : malloc((size_t)count * sizeof *found);
    if (!found)
        return err_set(e, E_NOMEM, "%s: %s", name, err_text(E_NOMEM));
    size_t k = 0;
    for (int i = 0; i < count && !suffix; i++) {
        const struct hdu *h = fits_in_hdu(f, i);
        if (h->is_image && strcasecmp(h->extname, "SCI") == 0)
            found[k++] = i;
    }
    if (k == 0 && one >= 0 && fits_in_hdu(f, one)->is_image)
        found[k++] = one;
    int st = k ? OK : err_set(e, E_DATA, "%s: no image in it", name);
    for (size_t i = 0; i < k && st == OK; i++)
        if (fits_in_hdu(f, found[i])->nz != 1)
            st = err_set(e, E_DATA, "%s: HDU %d is a cube: select planes before", name, found[i]);
    if (st) {
        free(found);
        return st;
    }
    *list = found;
    *n = k;
    return OK;
}

void exposure_label(const struct fits_in *f, const char *name, int index, char *label, size_t size)
{
    const struct hdu *h = fits_in_hdu(f, index);
    if (index == 0 || has_suffix(name) > 0)
        snprintf(label, size, "%s", name);
    else if (h->extname[0])
        snprintf(label, size, "%s[%s,%ld]", name, h->extname, h->extver);
    else
        snprintf(label, size, "%s[%d]", name, index);
}

static enum exposure_unit unit_of(const struct header *h)
{
    char unit[72];
    static const struct { const char *text; enum exposure_unit unit; } names[] = {
        {"electron", UNIT_ELECTRON}, {"electrons", UNIT_ELECTRON}, {"e-", UNIT_ELECTRON}, {"e", UNIT_ELECTRON},
        {"electron/s", UNIT_RATE}, {"electrons/s", UNIT_RATE}, {"electron s-1", UNIT_RATE}, {"e-/s", UNIT_RATE},
        {"adu", UNIT_ADU}, {"dn", UNIT_ADU}, {"count", UNIT_ADU}, {"counts", UNIT_ADU},
    };
    if (header_str(h, "BUNIT", unit, sizeof unit) || !unit[0])
        return UNIT_NONE;
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strcasecmp(unit, names[i].text) == 0)
            return names[i].unit;
    return UNIT_OTHER;
}

/* A number of the header: NaN when missing; a card that holds something else is an error. */
static int number(const struct header *h, const char *label, const char *key, double *v, struct err *e)
{
    *v = NAN;
    if (header_double(h, key, v) == E_DATA)
        return err_set(e, E_DATA, "%s: %s is not a number: correct the keyword", label, key);
    return OK;
}

/* PIXSCALE against the scale of the WCS; either may be missing. */
static int check_scale(const struct header *h, const char *label, double *scale, double *ratio, struct err *e)
{
    double found;
    *ratio = 1;
    const int wcs = sky_pixels(h, &found, ratio, NULL);
    if (wcs == E_NOMEM)
        return err_set(e, wcs, "%s: %s", label, err_text(wcs));
    if (wcs == OK) {
        if (isnan(*scale))
            *scale = found;
        else if (!(fabs(found - *scale) <= 1e-3 * *scale))
            return err_set(e, E_DATA, "%s: PIXSCALE %g and the WCS's %g arcsec differ: correct one", label, *scale, found);
    }
    if (*scale <= 0)
        return err_set(e, E_DATA, "%s: PIXSCALE %g is not positive", label, *scale);
    return OK;
}

int exposure_keywords(const struct header *h, const char *label, struct exposure *x, struct err *e)
{
    struct exposure new = *x;
    const struct { const char *key; double *v; } want[] = {
        {"EXPTIME", &new.exptime}, {"TOTTIME", &new.tottime}, {"MAGZERO", &new.magzero},
        {"PIXSCALE", &new.scale}, {"GAIN", &new.gain},
    };
    static const char *const others[] = {"SKYLEVEL", "SATURATE", "RDNOISE", "NOISECOR", "PSFFWHM", "CCDSCALE", "SHEAR1", "SHEAR2", "CHDIFF"};   /* read where they are needed */
    double v;
    int st = OK;
    for (size_t i = 0; i < sizeof want / sizeof *want && st == OK; i++)
        st = number(h, label, want[i].key, want[i].v, e);
    for (size_t i = 0; i < sizeof others / sizeof *others && st == OK; i++)
        st = number(h, label, others[i], &v, e);
    if (st)
        return st;
    int subtracted;
    long whole;
    if (header_bool(h, "SKYSUB", &subtracted) == E_DATA)
        return err_set(e, E_DATA, "%s: SKYSUB is neither T nor F: correct the keyword", label);
    if (header_long(h, "EXPNUM", &whole) == E_DATA)
        return err_set(e, E_DATA, "%s: EXPNUM is not a whole number: correct the keyword", label);
    new.unit = unit_of(h);
    if (isnan(new.tottime))
        new.tottime = new.exptime;
    if (header_long(h, "EXPNUM", &new.expnum))
        new.expnum = -1;
    if (new.exptime <= 0 || new.tottime <= 0)
        return err_set(e, E_DATA, "%s: EXPTIME or TOTTIME is not positive", label);
    if (new.gain <= 0)
        return err_set(e, E_DATA, "%s: GAIN %g is not positive: correct the keyword", label, new.gain);
    st = check_scale(h, label, &new.scale, &new.ratio, e);
    if (st == OK)
        *x = new;
    return st;
}

int exposure_square(const struct exposure *x, const char *label, struct err *e)
{
    if (x->ratio <= 1.01)
        return OK;
    if (x->ratio <= 1.5)
        return err_set(e, E_RANGE, "%s: pixels on the sky are longer one way than the other by a factor %.3f: taken as squares of %g arcsec",
                       label, x->ratio, x->scale);
    return err_set(e, E_DATA, "%s: pixels on the sky are longer one way than the other by a factor %.3g: squares are needed, drizzle makes them",
                   label, x->ratio);
}

int exposure_read(struct fits_in *f, const char *name, int index, struct exposure *x, struct err *e)
{
    const struct hdu *hdu = fits_in_hdu(f, index);
    struct exposure new = {.index = index, .nx = hdu->nx, .ny = hdu->ny, .expnum = -1};
    char label[400];
    exposure_label(f, name, index, label, sizeof label);
    int st = fits_in_header(f, index, &new.hdr, e);
    if (st == OK)
        st = exposure_keywords(&new.hdr, label, &new, e);
    if (st == OK)
        st = fits_in_provenance(f, index, &new.hdr, e);
    if (st)
        header_free(&new.hdr);
    else
        *x = new;
    return st;
}

int exposure_rescale_wcs(struct header *h, double shift_x, double shift_y, double factor)
{
    static const char *const scaled[] = {"CD1_1", "CD1_2", "CD2_1", "CD2_2", "CDELT1", "CDELT2"};
    const double shift[2] = {shift_x, shift_y};
    double v;
    int st = OK;
    for (int i = 0; i < 2 && st == OK; i++) {
        const char *key = i ? "CRPIX2" : "CRPIX1";
        if (header_double(h, key, &v) == OK)
            st = header_set_double(h, key, (v - 1 - shift[i]) / factor + 1, "reference pixel, first is 1");
    }
    for (size_t i = 0; i < sizeof scaled / sizeof *scaled && st == OK; i++)
        if (header_double(h, scaled[i], &v) == OK)
            st = header_set_double(h, scaled[i], v * factor, i < 4 ? "deg per pixel" : NULL);
    return st;
}

/* Keywords of world coordinates; a trailing star stands for the rest of the name. */
static const char *const wcs_keys[] = {
    "WCSAXES*", "WCSNAME*", "CTYPE*", "CRVAL*", "CRPIX*", "CDELT*", "CUNIT*", "CROTA*", "CD1_*", "CD2_*",
    "PC1_*", "PC2_*", "PV1_*", "PV2_*", "PS1_*", "PS2_*", "LONPOLE*", "LATPOLE*", "RADESYS*", "RADECSYS",
    "EQUINOX*", "A_*", "B_*", "AP_*", "BP_*",
};
enum { WCS_KEYS = sizeof wcs_keys / sizeof *wcs_keys };

void exposure_remove_wcs(struct header *h)
{
    for (size_t i = 0; i < WCS_KEYS; i++)
        header_remove(h, wcs_keys[i]);
}

static int is_wcs(const char *card)
{
    const size_t length = strcspn(card, " =");
    for (size_t i = 0; i < WCS_KEYS; i++) {
        const size_t n = strcspn(wcs_keys[i], "*");
        if (strncmp(card, wcs_keys[i], n) == 0 && (wcs_keys[i][n] == '*' || length == n))
            return 1;
    }
    return 0;
}

int exposure_copy_wcs(struct header *to, const struct header *from)
{
    int st = OK;
    for (size_t i = 0; i < from->n && st == OK; i++)
        if (is_wcs(from->card[i]))
            st = header_append(to, from->card[i]);
    return st;
}
