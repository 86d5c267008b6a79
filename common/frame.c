/*
 * frame.c - celestial frames: RADESYS and EQUINOX of a header, galactic coordinates.
 *
 * The galactic pole lies at RA 192.85948, Dec 27.12825 of ICRS, and the celestial
 * pole at galactic longitude 122.93192, by definition (ESA 1997, Hipparcos and Tycho
 * Catalogues, vol. 1, section 1.5.3).
 */
#include "frame.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static const double degree = 0.017453292519943295;
static const double pole_ra = 192.85948, pole_dec = 27.12825, pole_longitude = 122.93192;

/* 2000, 2000.0, 'J2000', 'B1950': a year; NaN without the keyword or with 0, which some writers mean by that. E_DATA: none. */
static int year(const struct header *h, const char *key, double *value)
{
    char text[72], *end;
    *value = NAN;
    int st = header_double(h, key, value);
    if (st == E_DATA && header_str(h, key, text, sizeof text) == OK && *text) {
        const char *digits = text + (strchr("JjBb", *text) != NULL);
        *value = strtod(digits, &end);
        st = *end || end == digits || !isfinite(*value) ? E_DATA : OK;
    }
    if (st || !(fabs(*value) > 0))
        *value = NAN;
    return st == E_DATA ? E_DATA : OK;
}

static int one_of(const char *word, const char *const *list)
{
    while (*list && strcasecmp(word, *list) != 0)
        list++;
    return *list != NULL;
}

int frame_read(const struct header *h, const char *longitude, enum frame *f, struct err *e)
{
    static const char *const icrs[] = {"ICRS", "ICRF", "ICRF2", "ICRF3", NULL}, *const fk5[] = {"FK5", "J2000", "", NULL};
    static const char only[] = "only ICRS, FK5 of 2000 and galactic axes are known: convert them";
    char name[72] = "";
    double equinox;
    if (strcmp(longitude, "GLON") == 0) {
        *f = FRAME_GALACTIC;
        return OK;
    }
    if (strcmp(longitude, "RA") != 0)
        return err_set(e, E_DATA, "WCS: axes %.16s are no right ascension: %s", longitude, only);
    int st = header_str(h, "RADESYS", name, sizeof name);
    if (st == E_MISSING)
        st = header_str(h, "RADECSYS", name, sizeof name);
    if (st && st != E_MISSING)
        return err_set(e, E_DATA, "WCS: RADESYS is not a word: correct the keyword");
    const char *key = "EQUINOX";
    st = year(h, key, &equinox);
    if (st == OK && isnan(equinox))
        st = year(h, key = "EPOCH", &equinox);
    if (st)
        return err_set(e, E_DATA, "WCS: %s is not a year: correct the keyword", key);
    if (!one_of(name, icrs) && (!one_of(name, fk5) || fabs(equinox - 2000) > 1e-3)) {
        char of[40] = "";
        if (!isnan(equinox))
            snprintf(of, sizeof of, " of %s %g", key, equinox);
        return err_set(e, E_DATA, "WCS: positions in %.20s%s: %s", *name ? name : equinox < 1984 ? "FK4" : "FK5", of, only);
    }
    *f = FRAME_J2000;
    return OK;
}

/* Positions about another pole: it has longitude `from` here, the pole of this frame has `to` there. */
static void turn(size_t n, double *lon, double *lat, double from, double to)
{
    const double s = sin(pole_dec * degree), c = cos(pole_dec * degree);
    for (size_t i = 0; i < n; i++) {
        const double l = (lon[i] - from) * degree, b = lat[i] * degree;
        const double x = sin(b) * c - cos(b) * s * cos(l), y = cos(b) * sin(l), z = sin(b) * s + cos(b) * c * cos(l);
        const double turned = to - atan2(y, x) / degree;
        lon[i] = turned < 0 ? turned + 360 : turned >= 360 ? turned - 360 : turned;
        lat[i] = atan2(z, hypot(x, y)) / degree;
    }
}

void frame_from_galactic(size_t n, double *lon, double *lat)
{
    turn(n, lon, lat, pole_longitude, pole_ra);
}

void frame_to_galactic(size_t n, double *lon, double *lat)
{
    turn(n, lon, lat, pole_ra, pole_longitude);
}
