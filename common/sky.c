/*
 * sky.c - world coordinates by wcslib (Calabretta & Greisen 2002; SIP and TPV
 * as wcslib knows them).  The cards of the header are given to wcspih, pixel
 * coordinates are shifted by one (FITS counts from 1).
 */
#include "sky.h"
#include "frame.h"
#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <wcslib/dis.h>
#include <wcslib/wcs.h>
#include <wcslib/wcserr.h>
#include <wcslib/wcsfix.h>
#include <wcslib/wcshdr.h>

enum { PART = 256, MOST_AXES = 32 };

struct sky {
    int nwcs;
    struct wcsprm *all;        /* as wcspih made them; NULL for a plain TAN */
    struct wcsprm two;         /* the two celestial axes of the primary one */
    int has_two;
    enum frame frame;          /* of the two axes; positions that go in and out are J2000 */
    double scale;
};

void sky_close(struct sky *s)
{
    if (!s)
        return;
    if (s->has_two)
        wcsfree(&s->two);
    if (s->all)
        wcsvfree(&s->nwcs, &s->all);
    free(s);
}

static int wcs_failed(struct err *e, const struct wcsprm *w, const char *what, int code)
{
    const char *why = w->err && w->err->msg[0] ? w->err->msg : code > 0 && code < 14 ? wcs_errmsg[code] : "";
    char line[200];
    snprintf(line, sizeof line, "%s", why);
    line[strcspn(line, "\n")] = 0;
    return err_set(e, code == WCSERR_MEMORY ? E_NOMEM : E_DATA, "%s: %s", what, line);
}

/* Text without its closing quote: wcspih would go on to the quote of another card, and write beyond its memory. */
static int without_end(const char *card)
{
    const char *p = card + 9;
    while (*p == ' ')
        p++;
    if (*p++ != '\'')
        return 0;
    for (; *p; p++)
        if (*p == '\'' && *++p != '\'')
            return 0;
    return 1;
}

/* The cards as one string for wcspih; those without a value are not needed, those without an end not wanted. */
static char *join(const struct header *h, int *n)
{
    char *text = malloc(h->n * 80 + 1);
    if (!text)
        return NULL;
    *n = 0;
    for (size_t i = 0; i < h->n; i++)
        if (h->card[i][8] == '=' && !without_end(h->card[i]))
            memcpy(text + 80 * (size_t)(*n)++, h->card[i], 80);
    text[80 * (size_t)*n] = 0;
    return text;
}

/* A keyword of the primary map that must be a number: CRVAL1, CD1_2, PV2_1, A_2_0, LONPOLE, but not CRVAL1A. */
static int is_number(const char *key)
{
    static const char *const numbered[] = {"CRVAL", "CRPIX", "CDELT", "CROTA", "CD", "PC", "PV", "A_", "B_", "AP_", "BP_"};
    const size_t last = strlen(key);
    if (!strcmp(key, "LONPOLE") || !strcmp(key, "LATPOLE"))
        return 1;
    for (size_t k = 0; k < sizeof numbered / sizeof *numbered; k++) {
        const size_t n = strlen(numbered[k]);
        if (!strncmp(key, numbered[k], n) && isdigit((unsigned char)key[n]) && isdigit((unsigned char)key[last - 1]))
            return 1;
    }
    return 0;
}

/* WCSAXES, or that of an alternate map: wcspih takes n^2 numbers of memory for whatever it says, wcsset knows 32. */
static int bad_axes(const struct header *one, const char *key)
{
    long n;
    return !strncmp(key, "WCSAXES", 7) && header_long(one, key, &n) != E_MISSING && (header_long(one, key, &n) || n < 0 || n > MOST_AXES);
}

/* What wcslib would leave out without a word, or stumble over. */
static int check_cards(const struct header *h, struct err *e)
{
    static const char *const text[] = {"CTYPE", "CUNIT", "RADESYS", "CPDIS", "CQDIS"};
    for (size_t i = 0; i < h->n; i++) {
        const struct header one = {.card = h->card + i, .n = 1, .cap = 1};
        char key[9];
        double v;
        if (h->card[i][8] != '=')
            continue;
        snprintf(key, sizeof key, "%.*s", (int)strcspn(h->card[i], " ="), h->card[i]);
        if (is_number(key) && header_double(&one, key, &v) == E_DATA)
            return err_set(e, E_DATA, "WCS: %s is not a number: correct the keyword", key);
        if (bad_axes(&one, key))
            return err_set(e, E_DATA, "WCS: %s is not a whole number from 0 to %d: correct the keyword", key, MOST_AXES);
        for (size_t k = 0; k < sizeof text / sizeof *text; k++)
            if (!strncmp(key, text[k], strlen(text[k])) && without_end(h->card[i]))
                return err_set(e, E_DATA, "WCS: %s is text without a closing quote", key);
    }
    return OK;
}

static int parse(struct sky *s, const struct header *h, struct err *e)
{
    int n, rejected;
    if (check_cards(h, e))
        return E_DATA;
    char *text = h->n < 1000000 ? join(h, &n) : NULL;
    if (!text)
        return err_set(e, E_NOMEM, "out of memory");
    int st = n ? wcspih(text, n, WCSHDR_all, 0, &rejected, &s->nwcs, &s->all) : 0;
    free(text);
    if (st)
        return err_set(e, st == 2 ? E_NOMEM : E_DATA, "WCS: cannot be read (wcslib status %d)", st);
    return OK;
}

/* A card whose keyword may change a plain TAN map: distortion, other poles, rotations, units. */
static int beyond_plain(const char *card)
{
    static const char *const numbered[] = {"PV", "PC", "PS", "CROTA", "CDELT", "CPDIS", "CQDIS", "DP", "DQ", "DVERR"};
    static const char *const other[] = {"LONPOLE", "LATPOLE", "WCSAXES", "A_", "B_", "AP_", "BP_"};
    if (strncmp(card, "CUNIT", 5) == 0)
        return !strstr(card, "'deg");
    for (size_t i = 0; i < sizeof numbered / sizeof *numbered; i++) {
        size_t n = strlen(numbered[i]);
        if (strncmp(card, numbered[i], n) == 0 && isdigit((unsigned char)card[n]))
            return 1;
    }
    for (size_t i = 0; i < sizeof other / sizeof *other; i++)
        if (strncmp(card, other[i], strlen(other[i])) == 0)
            return 1;
    return 0;
}

/*
 * The TAN with CD that this project writes, put into wcslib's struct by hand:
 * the scanners behind wcspih end the program when memory does.  E_MISSING when
 * the header says anything else.
 */
static int parse_plain(struct sky *s, const struct header *h)
{
    static const char *const cd[4] = {"CD1_1", "CD1_2", "CD2_1", "CD2_2"};
    char ctype[2][72];
    double v[8];
    for (size_t i = 0; i < h->n; i++)
        if (beyond_plain(h->card[i]))
            return E_MISSING;
    if (header_str(h, "CTYPE1", ctype[0], sizeof ctype[0]) || header_str(h, "CTYPE2", ctype[1], sizeof ctype[1]) ||
        strcmp(ctype[0], "RA---TAN") || strcmp(ctype[1], "DEC--TAN") || header_double(h, "CRPIX1", &v[0]) ||
        header_double(h, "CRPIX2", &v[1]) || header_double(h, "CRVAL1", &v[2]) || header_double(h, "CRVAL2", &v[3]))
        return E_MISSING;
    for (int i = 0; i < 4; i++)
        if (header_double(h, cd[i], &v[4 + i]))
            return E_MISSING;
    s->two.flag = -1;
    if (wcsinit(1, 2, &s->two, 0, 0, 0))
        return E_NOMEM;
    s->has_two = 1;
    for (int i = 0; i < 2; i++) {
        memcpy(s->two.ctype[i], ctype[i], sizeof ctype[i]);
        s->two.crpix[i] = v[i];
        s->two.crval[i] = v[2 + i];
    }
    memcpy(s->two.cd, v + 4, 4 * sizeof *v);
    s->two.altlin = 2;
    return OK;
}

/* wcslib would put 1 degree where a row of CD is zero. */
static int zero_row(const struct wcsprm *w)
{
    for (int i = 0; i < 2 && (w->altlin & 2) && w->naxis == 2; i++)
        if (w->cd[2 * i] == 0 && w->cd[2 * i + 1] == 0)
            return 1;
    return 0;
}

/* A celestial axis whose unit is no angle; wcslib 7.12 refuses it too, and loses memory. */
static const char *not_an_angle(const struct wcsprm *w)
{
    static const char *const angle[] = {"", "deg", "arcmin", "arcsec", "mas", "rad"};
    for (int i = 0; i < w->naxis; i++) {
        size_t k = 0;
        const size_t n = sizeof angle / sizeof *angle;
        while (k < n && strcmp(w->cunit[i], angle[k]) != 0)
            k++;
        if (k == n && w->ctype[i][4] == '-')
            return w->cunit[i];
    }
    return NULL;
}

/* Set up the primary WCS that wcspih found and reduce it to its two celestial axes. */
static int reduce(struct sky *s, struct err *e)
{
    int axes[2] = {WCSSUB_LONGITUDE, WCSSUB_LATITUDE}, two = 2;
    struct wcsprm *w = s->nwcs > 0 ? s->all : NULL;
    if (!w || w->naxis < 2)
        return E_MISSING;
    if (zero_row(w))
        return err_set(e, E_DATA, "WCS: the CD matrix is singular");
    (void)unitfix(0, w);                      /* old spellings of degree; the rest wcsset refuses */
    if (not_an_angle(w))
        return err_set(e, E_DATA, "WCS: the unit of an axis, '%.16s', is no angle", not_an_angle(w));
    int st = wcsset(w);
    if (st)
        return wcs_failed(e, w, "WCS", st);
    if (w->lng < 0 || w->lat < 0)
        return E_MISSING;
    s->two.flag = -1;
    if (w->naxis == 2) {
        axes[0] = 1;                          /* keep the order of the pixel axes */
        axes[1] = 2;
    }
    st = wcssub(1, w, &two, axes, &s->two);
    s->has_two = 1;
    if (st)
        return wcs_failed(e, &s->two, "WCS", st);
    return two == 2 ? OK : E_MISSING;
}

static int set_up(struct sky *s, struct err *e)
{
    if (zero_row(&s->two))
        return err_set(e, E_DATA, "WCS: the CD matrix is singular");
    int st = wcsset(&s->two);
    if (st) {
        s->has_two = st != WCSERR_MEMORY;     /* wcslib 7.12 then frees some of it twice */
        return wcs_failed(e, &s->two, "WCS", st);
    }
    const double *pc = s->two.pc, *d = s->two.cdelt;
    double det = d[0] * d[1] * (pc[0] * pc[3] - pc[1] * pc[2]);
    s->scale = sqrt(fabs(det)) * 3600;
    if (!(s->scale > 0) || !isfinite(s->scale))
        return err_set(e, E_DATA, "WCS: the CD matrix is singular");
    return OK;
}

/* A WCS in whatever frame. */
static int open_any(struct sky **out, const struct header *h, struct err *e)
{
    *out = NULL;
    struct sky *s = calloc(1, sizeof *s);
    if (!s)
        return err_set(e, E_NOMEM, "out of memory");
    wcserr_enable(1);
    int st = parse_plain(s, h);
    if (st == E_MISSING) {
        st = parse(s, h, e);
        if (st == OK)
            st = reduce(s, e);
    } else if (st) {
        err_set(e, st, "%s", err_text(st));
    }
    if (st == OK)
        st = set_up(s, e);
    if (st == E_MISSING) {
        double scale;
        if (header_double(h, "PIXSCALE", &scale) == OK)
            err_set(e, st, "no celestial WCS (CTYPE1, CRVAL1, ...), only PIXSCALE = %g arcsec", scale);
        else
            err_set(e, st, "no celestial WCS (CTYPE1, CRVAL1, ...) in the header");
    }
    if (st)
        sky_close(s);
    else
        *out = s;
    return st;
}

int sky_open(struct sky **out, const struct header *h, struct err *e)
{
    int st = open_any(out, h, e);
    if (st == OK)
        st = frame_read(h, (*out)->two.lngtyp, &(*out)->frame, e);
    if (st) {
        sky_close(*out);
        *out = NULL;
    }
    return st;
}

/* Ratio of the singular values of a matrix (a b; c d), >= 1. */
static double axis_ratio(double a, double b, double c, double d)
{
    const double sum = hypot(a + d, b - c), difference = hypot(a - d, b + c);
    return (sum + difference) / fabs(sum - difference);
}

int sky_pixels(const struct header *h, double *scale, double *ratio, struct err *e)
{
    struct sky *s;
    const int st = open_any(&s, h, e);
    if (st)
        return st;
    const double *pc = s->two.pc, *d = s->two.cdelt;
    *scale = s->scale;
    *ratio = axis_ratio(d[0] * pc[0], d[0] * pc[1], d[1] * pc[2], d[1] * pc[3]);
    sky_close(s);
    return OK;
}

/* One part of at most PART positions, forward (pixel to sky) or back: OK, E_RANGE for one or more of them, E_NOMEM. */
static int part(struct sky *s, int forward, size_t n, const double *a, const double *b, double *to_a,
                double *to_b)
{
    double in[2 * PART], mid[2 * PART], out[2 * PART], phi[PART], theta[PART];
    int stat[PART], failures = 0, lng = s->two.lng, lat = s->two.lat;
    for (size_t i = 0; i < n; i++) {
        int good = isfinite(a[i]) && isfinite(b[i]);
        in[2 * i + (forward ? 0 : (size_t)lng)] = !good ? (forward ? s->two.crpix[0] : s->two.crval[lng])
                                                        : forward ? a[i] + 1 : a[i];
        in[2 * i + (forward ? 1 : (size_t)lat)] = !good ? (forward ? s->two.crpix[1] : s->two.crval[lat])
                                                        : forward ? b[i] + 1 : b[i];
        stat[i] = 0;
    }
    int st = forward ? wcsp2s(&s->two, (int)n, 2, in, mid, phi, theta, out, stat)
                     : wcss2p(&s->two, (int)n, 2, in, phi, theta, mid, out, stat);
    int all = st && st != WCSERR_BAD_PIX && st != WCSERR_BAD_WORLD;
    if (st == WCSERR_MEMORY)
        return E_NOMEM;
    for (size_t i = 0; i < n; i++) {
        double u = out[2 * i + (forward ? (size_t)lng : 0)] - (forward ? 0 : 1);
        double v = out[2 * i + (forward ? (size_t)lat : 1)] - (forward ? 0 : 1);
        int bad = all || stat[i] || !isfinite(a[i]) || !isfinite(b[i]) || !isfinite(u) || !isfinite(v);
        failures += bad;
        to_a[i] = bad ? NAN : u;
        to_b[i] = bad ? NAN : v;
    }
    return failures ? E_RANGE : OK;
}

static int convert(struct sky *s, int forward, size_t n, const double *a, const double *b, double *to_a,
                   double *to_b)
{
    int all = OK;
    for (size_t at = 0; at < n && all != E_NOMEM; at += PART) {
        size_t k = n - at < PART ? n - at : PART;
        double lon[PART], lat[PART];
        const int there = !forward && s->frame == FRAME_GALACTIC;
        if (there) {
            memcpy(lon, a + at, k * sizeof *lon);
            memcpy(lat, b + at, k * sizeof *lat);
            frame_to_galactic(k, lon, lat);
        }
        int st = part(s, forward, k, there ? lon : a + at, there ? lat : b + at, to_a + at, to_b + at);
        if (forward && s->frame == FRAME_GALACTIC)
            frame_from_galactic(k, to_a + at, to_b + at);
        all = st ? st : all;
    }
    return all;
}

int sky_from_pixel(struct sky *s, size_t n, const double *x, const double *y, double *ra, double *dec)
{
    return convert(s, 1, n, x, y, ra, dec);
}

int sky_to_pixel(struct sky *s, size_t n, const double *ra, const double *dec, double *x, double *y)
{
    return convert(s, 0, n, ra, dec, x, y);
}

int sky_far(const struct sky *s, double ra, double dec)
{
    const double degree = 3.14159265358979324 / 180, a = (ra - s->two.crval[s->two.lng]) * degree;
    const double d = dec * degree, d0 = s->two.crval[s->two.lat] * degree;
    return fabs(dec) <= 90 && sin(d) * sin(d0) + cos(d) * cos(d0) * cos(a) <= 0.5;
}

int sky_is_linear(const struct sky *s)
{
    return !strcmp(s->two.cel.prj.code, "TAN") && !s->two.lin.dispre && !s->two.lin.disseq;
}

void sky_reference(const struct sky *s, double *ra, double *dec)
{
    *ra = s->two.crval[s->two.lng];
    *dec = s->two.crval[s->two.lat];
    if (s->frame == FRAME_GALACTIC)
        frame_from_galactic(1, ra, dec);
}

double sky_scale(const struct sky *s)
{
    return s->scale;
}

/* Remove every card that could contradict a new WCS. */
static void clear(struct header *h)
{
    static const char *const plain[] = {
        "WCSAXES", "WCSNAME", "CTYPE1", "CTYPE2", "CRPIX1", "CRPIX2", "CRVAL1", "CRVAL2", "CDELT1",
        "CDELT2", "CROTA1", "CROTA2", "CUNIT1", "CUNIT2", "LONPOLE", "LATPOLE", "RADESYS", "RADECSYS",
        "EQUINOX", "EPOCH", "CPDIS1", "CPDIS2", "CQDIS1", "CQDIS2", "DP1", "DP2", "DQ1", "DQ2",
        "A_*", "B_*", "AP_*", "BP_*"};
    static const char *const matrix[] = {"PC%d_%d", "CD%d_%d", "PV%d_%d", "PS%d_%d"};
    char name[16];
    for (size_t i = 0; i < sizeof plain / sizeof *plain; i++)
        header_remove(h, plain[i]);
    for (size_t m = 0; m < sizeof matrix / sizeof *matrix; m++)
        for (int i = 1; i <= 2; i++)
            for (int j = 0; j < (m < 2 ? 3 : 40); j++) {
                snprintf(name, sizeof name, matrix[m], i, j);
                header_remove(h, name);
            }
}

int sky_set_tan(struct header *h, double scale, double crpix1, double crpix2, double crval1, double crval2)
{
    double cd = scale / 3600;
    if (!(scale > 0) || !isfinite(scale) || !isfinite(crpix1) || !isfinite(crpix2) ||
        !isfinite(crval1) || !(fabs(crval2) <= 90))
        return E_RANGE;
    const struct {
        const char *name;
        double value;
        const char *comment;
    } number[] = {{"CRPIX1", crpix1, "reference pixel"},        {"CRPIX2", crpix2, "reference pixel"},
                  {"CRVAL1", crval1, "[deg] right ascension"},  {"CRVAL2", crval2, "[deg] declination"},
                  {"CD1_1", -cd, "[deg] east is left"},         {"CD1_2", 0, NULL},
                  {"CD2_1", 0, NULL},                           {"CD2_2", cd, "[deg] north is up"}};
    struct header new;
    int st = header_copy(&new, h);
    if (st)
        return st;
    clear(&new);
    st = header_set_str(&new, "CTYPE1", "RA---TAN", "gnomonic projection");
    if (st == OK)
        st = header_set_str(&new, "CTYPE2", "DEC--TAN", "gnomonic projection");
    if (st == OK)
        st = header_set_str(&new, "CUNIT1", "deg", NULL);
    if (st == OK)
        st = header_set_str(&new, "CUNIT2", "deg", NULL);
    for (size_t i = 0; i < sizeof number / sizeof *number && st == OK; i++)
        st = header_set_double(&new, number[i].name, number[i].value, number[i].comment);
    if (st == OK && crval2 == 90)             /* the default there would turn the field by 180 degrees */
        st = header_set_double(&new, "LONPOLE", 180, "[deg] north is up at the pole, too");
    if (st == OK)
        st = header_set_str(&new, "RADESYS", "ICRS", NULL);
    if (st) {
        header_free(&new);
        return st;
    }
    header_free(h);
    *h = new;
    return OK;
}

int sky_apart(const struct header *a, const struct header *b, long nx, long ny, double *pixels)
{
    struct sky *ours = NULL, *theirs = NULL;
    struct err e;
    double x[2] = {0, (double)nx - 1}, y[2] = {0, (double)ny - 1}, ra[2], dec[2], far = NAN;
    int st = sky_open(&ours, a, &e), other = st == OK ? sky_open(&theirs, b, &e) : OK;
    if (st == OK && other == OK && sky_from_pixel(theirs, 2, x, y, ra, dec) == OK) {
        int seen = sky_to_pixel(ours, 2, ra, dec, ra, dec);      /* E_RANGE: on the other side of the sky */
        far = seen == OK ? fmax(hypot(ra[0] - x[0], dec[0] - y[0]), hypot(ra[1] - x[1], dec[1] - y[1])) : INFINITY;
    }
    sky_close(ours);
    sky_close(theirs);
    if (st == E_NOMEM || other == E_NOMEM)
        return E_NOMEM;
    *pixels = far;
    return OK;
}
