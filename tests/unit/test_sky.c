/*
 * test_sky.c - world coordinates against the formulas written out: TAN by the
 * unit vectors of Calabretta & Greisen (2002), SIP (Shupe et al. 2005) and TPV
 * polynomials by hand.
 */
#include "check.h"
#include "frame.h"
#include "sky.h"
#include <stdlib.h>
#include <string.h>

static const double degree = 0.017453292519943295;

/* Intermediate world coordinates (deg) -> ra, dec (deg), TAN about (ra0, dec0). */
static void untan(double xi, double eta, double ra0, double dec0, double *ra, double *dec)
{
    double a = ra0 * degree, d = dec0 * degree, x = xi * degree, y = eta * degree;
    double e[3] = {-sin(a), cos(a), 0};
    double n[3] = {-sin(d) * cos(a), -sin(d) * sin(a), cos(d)};
    double c[3] = {cos(d) * cos(a), cos(d) * sin(a), sin(d)}, v[3];
    for (int i = 0; i < 3; i++)
        v[i] = c[i] + x * e[i] + y * n[i];
    *ra = atan2(v[1], v[0]) / degree;
    *ra += *ra < 0 ? 360 : 0;
    *dec = atan2(v[2], hypot(v[0], v[1])) / degree;
}

static struct header tan_header(double scale, double p1, double p2, double ra, double dec)
{
    struct header h = {0};
    if (sky_set_tan(&h, scale, p1, p2, ra, dec))
        abort();
    return h;
}

static struct sky *opened(struct header *h)
{
    struct sky *s;
    struct err e = {""};
    if (sky_open(&s, h, &e)) {
        check_that(0, "sky_open: %s", e.text);
        exit(1);
    }
    return s;
}

static void set(struct header *h, const char *key, double v)
{
    if (header_set_double(h, key, v, NULL))
        abort();
}

static void test_tan(void)
{
    static const double place[][2] = {{150, 2.2}, {0, 0}, {359.9999, -45}, {189.2, 62.2}, {10, 89.999}, {10, -90}, {77, 90}};
    struct check sky = check_begin("TAN: ra cos(dec), dec against unit vectors, deg");
    struct check back = check_begin("TAN: back to the pixel");
    for (size_t k = 0; k < sizeof place / sizeof *place; k++) {
        double scale = k % 2 ? 0.04 : 0.16;
        struct header h = tan_header(scale, 400.5, 300.25, place[k][0], place[k][1]);
        struct sky *s = opened(&h);
        double x[700], y[700], ra[700], dec[700], bx[700], by[700];
        for (int i = 0; i < 700; i++) {
            x[i] = -50 + 1.3 * i;
            y[i] = 900 - 2.1 * i;
        }
        check_that(sky_from_pixel(s, 700, x, y, ra, dec) == OK && sky_to_pixel(s, 700, ra, dec, bx, by) == OK,
                   "place %zu: all positions have an answer", k);
        for (int i = 0; i < 700; i++) {
            double r, d;
            untan(-scale / 3600 * (x[i] + 1 - 400.5), scale / 3600 * (y[i] + 1 - 300.25), place[k][0], place[k][1], &r, &d);
            double dr = remainder(ra[i] - r, 360) * cos(d * degree);
            check_close(&sky, dr, 0, 1e-12);            /* 4 nano-arcsec */
            check_close(&sky, dec[i], d, 1e-12);
            check_close(&back, bx[i], x[i], 2e-8);      /* 360 deg eps / scale = 2e-9 px */
            check_close(&back, by[i], y[i], 2e-8);
        }
        if (k == 0) {
            check_that(fabs(sky_scale(s) - scale) < 1e-15, "scale %.17g arcsec", sky_scale(s));
            check_that(sky_is_linear(s), "a plain TAN is linear");
        }
        sky_close(s);
        header_free(&h);
    }
    check_end(&sky);
    check_end(&back);
}

static void test_rotated(void)
{
    struct header h = tan_header(0.1, 10, 20, 150, 2.2);
    double cd[4] = {-1.5e-5, 4e-6, 5e-6, 2e-5}, x = 33, y = 44, ra, dec, r, d;
    set(&h, "CD1_1", cd[0]);
    set(&h, "CD1_2", cd[1]);
    set(&h, "CD2_1", cd[2]);
    set(&h, "CD2_2", cd[3]);
    struct sky *s = opened(&h);
    struct check c = check_begin("rotated and skewed CD matrix");
    int st = sky_from_pixel(s, 1, &x, &y, &ra, &dec);
    untan(cd[0] * 24 + cd[1] * 25, cd[2] * 24 + cd[3] * 25, 150, 2.2, &r, &d);
    check_close(&c, st == OK ? ra : NAN, r, 1e-12);
    check_close(&c, dec, d, 1e-12);
    check_close(&c, sky_scale(s), 3600 * sqrt(fabs(cd[0] * cd[3] - cd[1] * cd[2])), 1e-14);
    check_end(&c);
    sky_close(s);
    header_free(&h);

    h = tan_header(0.1, 10, 20, 150, 2.2);              /* the old way: CDELT and CROTA2 */
    header_remove(&h, "CD*");
    set(&h, "CDELT1", -2e-5);
    set(&h, "CDELT2", 2e-5);
    set(&h, "CROTA2", 30);
    s = opened(&h);
    st = sky_from_pixel(s, 1, &x, &y, &ra, &dec);
    double cs = cos(30 * degree), sn = sin(30 * degree);
    untan(-2e-5 * cs * 24 - 2e-5 * sn * 25, -2e-5 * sn * 24 + 2e-5 * cs * 25, 150, 2.2, &r, &d);
    c = check_begin("CDELT and CROTA2");
    check_close(&c, st == OK ? ra : NAN, r, 1e-12);
    check_close(&c, dec, d, 1e-12);
    check_end(&c);
    sky_close(s);
    header_free(&h);
}

static void test_distorted(void)
{
    double x = 130, y = 70, ra, dec, r, d, bx, by;
    struct header h = tan_header(0.1, 10, 20, 150, 2.2);
    if (header_set_str(&h, "CTYPE1", "RA---TAN-SIP", NULL) || header_set_str(&h, "CTYPE2", "DEC--TAN-SIP", NULL) ||
        header_set_long(&h, "A_ORDER", 2, NULL) || header_set_long(&h, "B_ORDER", 2, NULL))
        abort();
    set(&h, "A_2_0", 1e-5);
    set(&h, "A_1_1", -2e-5);
    set(&h, "B_0_2", 3e-5);
    struct sky *s = opened(&h);
    double u = x + 1 - 10, v = y + 1 - 20, cd = 0.1 / 3600;
    double f = u + 1e-5 * u * u - 2e-5 * u * v, g = v + 3e-5 * v * v;
    int st = sky_from_pixel(s, 1, &x, &y, &ra, &dec);
    untan(-cd * f, cd * g, 150, 2.2, &r, &d);
    struct check c = check_begin("SIP polynomial");
    check_close(&c, st == OK ? ra : NAN, r, 1e-12);
    check_close(&c, dec, d, 1e-12);
    check_end(&c);
    c = check_begin("SIP back to the pixel");
    st = sky_to_pixel(s, 1, &ra, &dec, &bx, &by);
    check_close(&c, st == OK ? bx : NAN, x, 1e-6);
    check_close(&c, by, y, 1e-6);
    check_end(&c);
    check_that(!sky_is_linear(s), "SIP is not linear");
    sky_close(s);
    if (sky_set_tan(&h, 0.1, 10, 20, 150, 2.2))
        abort();
    s = opened(&h);
    check_that(sky_is_linear(s), "sky_set_tan removes the distortion that was there");
    sky_close(s);
    header_free(&h);

    h = tan_header(0.1, 10, 20, 150, 2.2);
    if (header_set_str(&h, "CTYPE1", "RA---TPV", NULL) || header_set_str(&h, "CTYPE2", "DEC--TPV", NULL))
        abort();
    set(&h, "PV1_1", 1);
    set(&h, "PV1_4", 0.5);              /* 0.5 xi^2, deg */
    set(&h, "PV2_1", 1);
    set(&h, "PV2_2", 0.01);             /* 0.01 xi */
    s = opened(&h);
    double xi = -cd * u, eta = cd * v;
    st = sky_from_pixel(s, 1, &x, &y, &ra, &dec);
    untan(xi + 0.5 * xi * xi, eta + 0.01 * xi, 150, 2.2, &r, &d);
    c = check_begin("TPV polynomial");
    check_close(&c, st == OK ? ra : NAN, r, 1e-12);
    check_close(&c, dec, d, 1e-12);
    check_end(&c);
    check_that(!sky_is_linear(s), "TPV is not linear");
    sky_close(s);
    header_free(&h);
}

static void test_failures(void)
{
    struct header h = tan_header(0.1, 10, 20, 150, 2.2);
    struct sky *s = opened(&h);
    double x[3] = {1, NAN, 3}, y[3] = {1, 2, INFINITY}, ra[3], dec[3];
    check_that(sky_from_pixel(s, 3, x, y, ra, dec) == E_RANGE && isfinite(ra[0]) && isfinite(dec[0]) && isnan(ra[1]) &&
               isnan(dec[1]) && isnan(ra[2]), "NaN and infinite positions give NaN, the others an answer");
    double far_ra[2] = {330, 150}, far_dec[2] = {-2.2, 2.2};
    check_that(sky_to_pixel(s, 2, far_ra, far_dec, x, y) == E_RANGE && isnan(x[0]) && isnan(y[0]) &&
               fabs(x[1] - 9) < 1e-8, "the far side of the sky has no pixel");
    sky_close(s);
    header_free(&h);

    struct err e = {""};
    h = (struct header){0};
    check_that(sky_open(&s, &h, &e) == E_MISSING && !s && e.text[0], "an empty header: %s", e.text);
    set(&h, "PIXSCALE", 0.05);
    check_that(sky_open(&s, &h, &e) == E_MISSING && strstr(e.text, "PIXSCALE"), "only PIXSCALE: %s", e.text);
    set(&h, "CRVAL1", 1);
    set(&h, "CRPIX1", 1);
    check_that(sky_open(&s, &h, &e) == E_MISSING, "a linear axis is no sky: %s", e.text);
    header_free(&h);
    h = tan_header(0.1, 10, 20, 150, 2.2);
    set(&h, "CD1_1", 0);
    check_that(sky_open(&s, &h, &e) == E_DATA && !s, "a singular matrix: %s", e.text);
    header_free(&h);
    h = tan_header(0.1, 10, 20, 150, 2.2);
    if (header_set_str(&h, "CUNIT1", "dqg", NULL))
        abort();
    check_that(sky_open(&s, &h, &e) == E_DATA && strstr(e.text, "'dqg', is no angle"), "an unknown unit: %s", e.text);
    header_free(&h);
    h = tan_header(0.1, 10, 20, 150, 2.2);
    if (header_set_str(&h, "CTYPE1", "RA---XYZ", NULL))
        abort();
    check_that(sky_open(&s, &h, &e) == E_DATA || sky_open(&s, &h, &e) == E_MISSING, "an unknown projection: %s", e.text);
    size_t n = h.n;
    check_that(sky_set_tan(&h, 0, 1, 1, 1, 1) == E_RANGE && sky_set_tan(&h, NAN, 1, 1, 1, 1) == E_RANGE &&
               sky_set_tan(&h, 1, 1, 1, 1, 91) == E_RANGE && h.n == n, "sky_set_tan refuses and leaves the header alone");
    header_free(&h);
}

/* A header whose cards wcslib has to read, one of them replaced by `card`: what sky_open says. */
static int with_card(const char *key, const char *card, struct err *e)
{
    struct header h = tan_header(0.1, 10, 20, 150, 2.2);
    struct sky *s;
    set(&h, "LONPOLE", 180);
    header_remove(&h, key);
    if (header_append(&h, card) || header_append(&h, "CNAME1  = 'a quote that comes later, and many letters behind it in another card'"))
        abort();
    const int st = sky_open(&s, &h, e);
    if (st == OK)
        sky_close(s);
    header_free(&h);
    return st;
}

/* wcslib 7.12 reads on to the next quote and ends the program. */
static void test_text_without_end(void)
{
    static const char *const bad[] = {"CTYPE1  = 'RA---TAN:           / gnomonic projection", "CTYPE2  = 'DEC--TAN''", "CUNIT1  ='deg",
                                      "RADESYS = 'ICRS"};
    static const char *const key[] = {"CTYPE1", "CTYPE2", "CUNIT1", "RADESYS"};
    struct err e = {""};
    int refused = 0;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        refused += with_card(key[i], bad[i], &e) == E_DATA && strstr(e.text, "closing quote");
    check_that(with_card("CRVAL1", "CRVAL1  = 150,5", &e) == E_DATA && with_card("CRPIX2", "CRPIX2  = 'abc'", &e) == E_DATA
               && with_card("CD1_2", "CD1_2   = 1E-5x", &e) == E_DATA && with_card("PV1_1", "PV1_1   = one", &e) == E_DATA
               && with_card("LATPOLE", "LATPOLE = 90 deg", &e) == E_DATA && strstr(e.text, "LATPOLE is not a number"),
               "numbers are read whole or refused: %s", e.text);
    check_that(with_card("CRVAL1A", "CRVAL1A = 150,5", &e) == OK && with_card("PCOUNT", "PCOUNT  = no", &e) == OK, "where the map needs them");
    check_that(refused == 4, "%d of 4 keywords without a closing quote are refused: %s", refused, e.text);
    check_that(with_card("OBJECT", "OBJECT  = 'it''s", &e) == OK, "one that no WCS needs is not");
    check_that(with_card("OBJECT", "OBJECT  = 'it''s'", &e) == OK, "nor two quotes for one");
}

/* wcspih takes memory for as many axes as WCSAXES says: 2e9 of them were "out of memory". */
static void test_number_of_axes(void)
{
    static const char *const bad[] = {"WCSAXES =           2000000000", "WCSAXES =                   33", "WCSAXES =                   -1",
                                      "WCSAXES =                  2.5", "WCSAXES = 'two'", "WCSAXESB=           2000000000"};
    static const char *const good[] = {"WCSAXES =                    2", "WCSAXESB=                    2"};
    struct err e = {""};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        e.text[0] = 0;
        check_that(with_card("WCSAXES", bad[i], &e) == E_DATA && strstr(e.text, "WCSAXES") && strstr(e.text, "from 0 to 32"), "%s: %s", bad[i], e.text);
    }
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
        e.text[0] = 0;
        check_that(with_card("WCSAXES", good[i], &e) == OK, "%s is read: %s", good[i], e.text);
    }
    check_that(with_card("WCSAXES", "WCSAXES =                   32", &e) == E_DATA && strstr(e.text, "singular"), "32 axes: what lacks is their matrix: %s", e.text);
}

/* Galactic places and their J2000 as astropy 5.2 has them (by way of FK5, 0.02 arcsec from ICRS). */
static void test_galactic(void)
{
    static const double place[][4] = {{0, 0, 266.4049883, -28.9361778}, {122.93192, 27.12825, 310.1677470, 89.9999947}, {150, 2.2, 63.6051030, 54.0397547}, {236.8, 42.1, 150.0919545, 2.2067208}, {10, 89.9, 192.9629228, 27.0892508}};
    struct check c = check_begin("galactic to J2000 against astropy, arcsec on the sky"), back = check_begin("and back, arcsec");
    for (size_t k = 0; k < sizeof place / sizeof *place; k++) {
        double lon = place[k][0], lat = place[k][1];
        frame_from_galactic(1, &lon, &lat);
        check_close(&c, (lon - place[k][2]) * cos(lat * degree) * 3600, 0, 0.03);
        check_close(&c, (lat - place[k][3]) * 3600, 0, 0.03);
        frame_to_galactic(1, &lon, &lat);
        check_close(&back, (lon - place[k][0]) * cos(lat * degree) * 3600, 0, 1e-8);
        check_close(&back, (lat - place[k][1]) * 3600, 0, 1e-8);
    }
    check_end(&c);
    check_end(&back);

    struct header h = tan_header(0.1, 10, 20, 236.8, 42.1);
    if (header_set_str(&h, "CTYPE1", "GLON-TAN", NULL) || header_set_str(&h, "CTYPE2", "GLAT-TAN", NULL))
        abort();
    struct sky *s = opened(&h);
    const double x = 9, y = 19, px = 500, py = -300;
    double ra, dec, r, d, bx = 0, by = 0;
    sky_reference(s, &r, &d);
    int st = sky_from_pixel(s, 1, &x, &y, &ra, &dec);
    c = check_begin("a galactic map: its reference pixel, arcsec");
    check_close(&c, st == OK ? (ra - place[3][2]) * 3600 : NAN, 0, 0.04);
    check_close(&c, (dec - place[3][3]) * 3600, 0, 0.03);
    check_close(&c, (r - ra) * 3600, 0, 1e-8);
    check_close(&c, (d - dec) * 3600, 0, 1e-8);
    check_end(&c);
    c = check_begin("there and back, pixels");
    if (sky_from_pixel(s, 1, &px, &py, &ra, &dec) || sky_to_pixel(s, 1, &ra, &dec, &bx, &by))
        abort();
    check_close(&c, bx, px, 1e-7);
    check_close(&c, by, py, 1e-7);
    check_end(&c);
    sky_close(s);
    header_free(&h);
}

/* The header of a plain TAN with the cards of a frame: what sky_open says. */
static int with_frame(const char *const card[3], const char *longitude, struct err *e)
{
    struct header h = tan_header(0.1, 10, 20, 150, 2.2);
    struct sky *s = NULL;
    char type[2][9] = {"RA---TAN", "DEC--TAN"};
    header_remove(&h, "RADESYS");
    if (strcmp(longitude, "RA") != 0) {
        memcpy(type[0], longitude, 4);
        memcpy(type[1], (char[]){longitude[0], 'L', 'A', 'T', 0}, 4);
    }
    if (header_set_str(&h, "CTYPE1", type[0], NULL) || header_set_str(&h, "CTYPE2", type[1], NULL))
        abort();
    for (int i = 0; i < 3 && card[i]; i++)
        if (header_append(&h, card[i]))
            abort();
    double scale = 0, ratio = 0;
    const int st = sky_open(&s, &h, e);
    check_that(sky_pixels(&h, &scale, &ratio, NULL) == OK && fabs(scale - 0.1) < 1e-12 && fabs(ratio - 1) < 1e-12, "%s: the pixels are told",
               card[0] ? card[0] : longitude);
    sky_close(s);
    header_free(&h);
    return st;
}

static void test_frames(void)
{
    static const char *const good[][3] = {{0}, {"RADESYS = 'ICRS    '"}, {"RADESYS = 'ICRS    '", "EQUINOX =               2000.0"}, {"RADESYS = 'FK5     '"},
        {"RADESYS = 'FK5     '", "EQUINOX =               2000.0"}, {"RADECSYS= 'FK5     '", "EQUINOX =                 2000"}, {"EQUINOX =               2000.0"},
        {"EQUINOX = 'J2000'"}, {"EPOCH   =               2000.0"}, {"EQUINOX =               2000.0", "EPOCH   =               1953.5"}, {"EPOCH   =                  0.0"},
        {"RADESYS = 'ICRS    '", "EQUINOX =               1950.0"}, {"RADESYS = 'fk5'"}, {"EQUINOX = '2000.0'"}};
    static const char *const bad[][3] = {{"RADESYS = 'FK4     '"}, {"RADESYS = 'FK4     '", "EQUINOX =               1950.0"}, {"EQUINOX =               1950.0"},
        {"EPOCH   =               1950.0"}, {"RADESYS = 'FK5     '", "EQUINOX =               1975.0"}, {"EQUINOX =               2012.5"}, {"EQUINOX = 'B1950'"},
        {"RADESYS = 'GAPPT   '", "EQUINOX =               2000.0"}, {"RADESYS = 'FK4-NO-E'"}, {"RADECSYS= 'FK4     '"}, {"EQUINOX = 'soon'"}, {"RADESYS =                    5"}};
    struct err e = {""};
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
        e.text[0] = 0;
        check_that(with_frame(good[i], "RA", &e) == OK, "%s is J2000: %s", good[i][0] ? good[i][0] : "no word", e.text);
    }
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        check_that(with_frame(bad[i], "RA", &e) == E_DATA, "%s is refused: %s", bad[i][0], e.text);
    check_that(with_frame((const char *const[3]){0}, "ELON", &e) == E_DATA && strstr(e.text, "ELON"), "ecliptic axes: %s", e.text);
    check_that(with_frame((const char *const[3]){"RADESYS = 'FK4     '"}, "GLON", &e) == OK, "galactic axes have no RADESYS");
}

/* Pixels that are not square: rectangles, and squares seen askew. */
static void test_pixels(void)
{
    static const double matrix[][5] = {{-2, 0, 0, 2, 1}, {0, 3, 3, 0, 1}, {-1, 0, 0, 2, 2}, {0.6, 0.8, -0.8, 0.6, 1}, {1, 0.1, 0, 1, 1.105124921972504}, {0.6, -1.6, 0.8, 1.2, 2}};
    struct check c = check_begin("ratio of a pixel's diameters on the sky");
    for (size_t k = 0; k < sizeof matrix / sizeof *matrix; k++) {
        static const char *const key[] = {"CD1_1", "CD1_2", "CD2_1", "CD2_2"};
        struct header h = tan_header(0.1, 10, 20, 150, 2.2);
        double scale = 0, ratio = NAN;
        for (int i = 0; i < 4; i++)
            set(&h, key[i], 1e-5 * matrix[k][i]);
        if (sky_pixels(&h, &scale, &ratio, NULL))
            abort();
        check_close(&c, ratio, matrix[k][4], 1e-12);
        header_free(&h);
    }
    check_end(&c);
}

int main(void)
{
    test_galactic();
    test_frames();
    test_pixels();
    test_text_without_end();
    test_number_of_axes();
    test_tan();
    test_rotated();
    test_distorted();
    test_failures();
    return check_status();
}
