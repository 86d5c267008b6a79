/*
 * test_imageio.c - FITS images against bytes put together here, independently
 * of the writer; the writer against a byte-by-byte reading of its file.
 */
#include "check.h"
#include "imageio.h"
#include "pixels.h"
#include <fcntl.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* ---- a FITS file, by hand ---- */

struct bytes {
    unsigned char b[200000];
    size_t n;
};

static void put(struct bytes *f, const void *p, size_t n)
{
    memcpy(f->b + f->n, p, n);
    f->n += n;
}

static void card(struct bytes *f, const char *text)
{
    char c[81];
    snprintf(c, sizeof c, "%-80s", text);
    put(f, c, 80);
}

static void card_int(struct bytes *f, const char *key, long v)
{
    char c[81];
    snprintf(c, sizeof c, "%-8s= %20ld", key, v);
    card(f, c);
}

static void pad(struct bytes *f, int with)
{
    while (f->n % 2880)
        f->b[f->n++] = (unsigned char)with;
}

/* Header of a primary or (ext) image HDU; `more` cards end with NULL. */
static void head(struct bytes *f, int ext, int bitpix, int naxis, const long *side, const char *const *more)
{
    char key[24];
    card(f, ext ? "XTENSION= 'IMAGE   '" : "SIMPLE  =                    T");
    card_int(f, "BITPIX", bitpix);
    card_int(f, "NAXIS", naxis);
    for (int i = 0; i < naxis; i++) {
        snprintf(key, sizeof key, "NAXIS%d", i + 1);
        card_int(f, key, side[i]);
    }
    if (ext) {
        card_int(f, "PCOUNT", 0);
        card_int(f, "GCOUNT", 1);
    }
    for (; more && *more; more++)
        card(f, *more);
    card(f, "END");
    pad(f, ' ');
}

static void big(struct bytes *f, uint64_t v, int n)
{
    while (n--)
        f->b[f->n++] = (unsigned char)(v >> 8 * n);
}

static void save(const struct bytes *f, const char *name)
{
    FILE *o = fopen(name, "wb");
    if (!o || fwrite(f->b, 1, f->n, o) != f->n || fclose(o))
        abort();
}

/* The pixels as they lie in the input are those of image_read, whole and in pieces. */
static void check_open(const char *name, const struct image *read)
{
    struct image im = {0};
    struct pixels at;
    struct fits_in *f;
    struct err e = {""};
    if (!check_that(image_open(&im, &at, &f, name, 1e9, &e) == OK, "%s is opened%s%s", name, *e.text ? ": " : "", e.text))
        return;
    float *all = malloc(image_count(read) * sizeof *all), piece[4];
    int same = all && im.nx == read->nx && im.ny == read->ny && im.hdr.n == read->hdr.n && at.nx == im.nx && at.ny == im.ny;
    if (same) {
        pixels_box(&at, (struct box){0, 0, at.nx, at.ny}, all);
        same = !memcmp(all, read->pix, image_count(read) * sizeof *all);
    }
    for (long y = 0; same && y + 1 < at.ny; y++)
        for (long x = 0; x + 1 < at.nx; x++) {
            const float *p = read->pix + y * at.nx + x, last = pixels_at(&at, x + 1, y + 1);
            pixels_box(&at, (struct box){x, y, 2, 2}, piece);
            same &= !memcmp(piece, p, 8) && !memcmp(piece + 2, p + at.nx, 8) && !memcmp(&last, piece + 3, 4);
        }
    check_that(same, "%s: the same size, header and pixels as read", name);
    check_that(!f || fits_in_unchanged(f, &e) == OK, "%s: unchanged", name);
    free(all);
    fits_in_close(f);
    image_free(&im);
}

static struct image get(const char *name)
{
    struct image im = {0};
    struct err e = {""};
    if (image_read(&im, name, 1e9, &e))
        check_that(0, "%s: %s", name, e.text);
    else
        check_open(name, &im);
    return im;
}

/* ---- types ---- */

static void test_types(void)
{
    static const long side[] = {3, 2};
    static const struct {
        int bitpix;
        const char *more[4];
        uint64_t raw[6];
        double want[6];
    } t[] = {
        {8, {NULL}, {0, 1, 127, 128, 254, 255}, {0, 1, 127, 128, 254, 255}},
        {8, {"BZERO   =               -128.0", NULL}, {0, 1, 127, 128, 254, 255}, {-128, -127, -1, 0, 126, 127}},
        {16, {"BLANK   =               -32768", NULL}, {0, 1, 0x7fff, 0x8000, 0x8001, 0xffff}, {0, 1, 32767, NAN, -32767, -1}},
        {16, {"BZERO   = 32768", "BSCALE  = 1.0", NULL}, {0, 1, 0x7fff, 0x8000, 0x8001, 0xffff}, {32768, 32769, 65535, 0, 1, 32767}},
        {16, {"BZERO   = 10.", "BSCALE  = 0.1", "BLANK   = 7", NULL}, {0, 1, 7, 0xffff, 100, 1000}, {10, 10.1, NAN, 9.9, 20, 110}},
        {32, {NULL}, {0, 1, 0x7fffffff, 0x80000000, 0xffffffff, 16777217}, {0, 1, 2147483647., -2147483648., -1, 16777217}},
        {32, {"BZERO   =         2147483648.0", NULL}, {0, 1, 0x7fffffff, 0x80000000, 0xffffffff, 0x80000005},
         {2147483648., 2147483649., 4294967295., 0, 2147483647., 5}},
        {64, {NULL}, {0, 1, 0x7fffffffffffffff, 0x8000000000000000, 0xffffffffffffffff, 0x0020000000000001},
         {0, 1, 0x1p63, -0x1p63, -1, 0x1p53}},
        {64, {"BZERO   =  9223372036854775808", NULL}, {0x8000000000000000, 0x8000000000000001, 0x7fffffffffffffff, 0, 0x8000000001000001, 0x8000000001000003},
         {0, 1, 0x1p64, 0x1p63, 16777217, 16777219}},
        {64, {"BLANK   = -9223372036854775808", NULL}, {0x8000000000000000, 5, 0, 0, 0x8000000000000001, 0}, {NAN, 5, 0, 0, -0x1p63, 0}},
        {-32, {NULL}, {0x3f800000, 0x7fc00000, 0x7f800000, 0xff800000, 1, 0x80000000}, {1, NAN, INFINITY, -INFINITY, 0x1p-149, -0.0}},
        {-32, {"BSCALE  = 2.0", "BZERO   = 0.5", "BLANK   = 1", NULL}, {0x3f800000, 0x7fc00000, 0x40000000, 0, 0xbf800000, 0x3f000000}, {2.5, NAN, 4.5, 0.5, -1.5, 1.5}},
        {-64, {NULL}, {0x3ff0000000000000, 0x7ff8000000000000, 0x7ff0000000000000, 0x3ff0000010000000, 0xc000000000000000, 0x7fefffffffffffff},
         {1, NAN, INFINITY, 1 + 0x1p-24, -2, 0x1.fffffffffffffp1023}},
    };
    for (size_t i = 0; i < sizeof t / sizeof *t; i++) {
        struct bytes f = {.n = 0};
        head(&f, 0, t[i].bitpix, 2, side, t[i].more);
        for (int k = 0; k < 6; k++)
            big(&f, t[i].raw[k], abs(t[i].bitpix) / 8);
        pad(&f, 0);
        save(&f, "t.fits");

        struct image im = get("t.fits");
        double d[6] = {0};
        float one[3] = {0};
        struct fits_in *in;
        struct err e = {""};
        int st = fits_in_open(&in, "t.fits", 1e9, &e);
        if (!st)
            st = fits_in_rows_double(in, 0, 0, 0, 2, d, &e);
        if (!st)
            st = fits_in_rows(in, 0, 0, 1, 1, one, &e);
        int good = !st && im.nx == 3 && im.ny == 2;
        for (int k = 0; k < 6 && good; k++) {
            double w = t[i].want[k];
            float wf = (float)w;
            good = isnan(w) ? isnan(d[k]) && isnan(im.pix[k]) : d[k] == w && im.pix[k] == wf;
            if (k >= 3 && good)
                good = isnan(w) ? isnan(one[k - 3]) : one[k - 3] == wf;
            if (!good)
                printf("# pixel %d: %.17g %.9g, want %.17g\n", k, d[k], (double)im.pix[k], w);
        }
        check_that(good, "BITPIX %d %s %s", t[i].bitpix, t[i].more[0] ? t[i].more[0] : "", e.text);
        if (im.pix)
            check_that(im.hdr.n == 0, "scaling cards are not passed on");
        fits_in_close(in);
        image_free(&im);
    }
}

/* ---- extensions, names, cubes ---- */

static void test_choice(void)
{
    static const long plain[] = {2, 2}, cube[] = {2, 2, 3}, flat[] = {2, 2, 1, 1}, line[] = {4};
    static const char *const sci1[] = {"EXTNAME = 'SCI     '", "EXTVER  =                    1", "EXPTIME =                500.0", NULL};
    static const char *const sci2[] = {"EXTNAME = 'SCI     '", "EXTVER  =                    2", NULL};
    static const char *const otf[] = {"EXTNAME = 'OTF     '", NULL}, *const deg[] = {"EXTNAME = 'DEEP    '", NULL};
    struct bytes f = {.n = 0};
    head(&f, 0, 8, 0, NULL, NULL);
    head(&f, 1, 8, 1, line, NULL);
    for (int k = 0; k < 4; k++)
        big(&f, 9, 1);
    pad(&f, 0);
    for (int v = 1; v <= 2; v++) {
        head(&f, 1, 8, 2, plain, v == 1 ? sci1 : sci2);
        for (int k = 0; k < 4; k++)
            big(&f, (uint64_t)(10 * v + k), 1);
        pad(&f, 0);
    }
    head(&f, 1, 16, 3, cube, otf);
    for (int k = 0; k < 12; k++)
        big(&f, (uint64_t)(100 + k), 2);
    pad(&f, 0);
    head(&f, 1, 8, 4, flat, deg);
    for (int k = 0; k < 4; k++)
        big(&f, 77, 1);
    pad(&f, 0);
    save(&f, "m.fits");

    static const struct {
        const char *name;
        int status;
        float first;
    } t[] = {
        {"m.fits", E_DATA, 0}, {"m.fits[2]", OK, 10}, {"m.fits[3]", OK, 20}, {"m.fits[SCI]", OK, 10}, {"m.fits[sci,2]", OK, 20},
        {"m.fits[SCI,1]", OK, 10}, {"m.fits[DEEP]", OK, 77}, {"m.fits[0]", E_DATA, 0}, {"m.fits[1]", E_DATA, 0},
        {"m.fits[OTF]", E_DATA, 0}, {"m.fits[9]", E_MISSING, 0}, {"m.fits[SCI,3]", E_MISSING, 0}, {"m.fits[WHT]", E_MISSING, 0},
        {"m.fits[]", E_MISSING, 0}, {"m.fits[1:2,1:2]", E_MISSING, 0}, {"m.fits[SCI][1]", E_IO, 0}, {"m.fits+2", E_IO, 0},
        {"file://m.fits", E_IO, 0}, {"", E_IO, 0}, {".", E_IO, 0}, {"none[1]", E_IO, 0},
    };
    for (size_t i = 0; i < sizeof t / sizeof *t; i++) {
        struct image im = {0};
        struct err e = {""};
        int st = image_read(&im, t[i].name, 1e9, &e);
        check_that(st == t[i].status && (st ? e.text[0] && !im.pix : im.pix[0] == t[i].first), "'%s': %s", t[i].name,
                   st ? e.text : "read");
        if (st == OK && i == 0)
            check_that(header_double_or(&im.hdr, "EXPTIME", 0) == 500, "the extension's cards come with it");
        image_free(&im);
    }
    save(&f, "odd[2]");
    struct image im = get("odd[2][SCI,1]");
    check_that(im.pix && im.pix[0] == 10, "a file whose literal name ends in [2]");
    image_free(&im);

    struct fits_in *in;
    struct err e;
    if (fits_in_open(&in, "m.fits", 1e9, &e))
        abort();
    float p[4];
    int i = fits_in_find(in, "otf", 0);
    check_that(i == 4 && fits_in_hdu(in, i)->nz == 3 && fits_in_rows(in, i, 2, 0, 2, p, &e) == OK && p[0] == 108 && p[3] == 111,
               "a plane of a cube");
    check_that(fits_in_rows(in, i, 3, 0, 1, p, &e) == E_RANGE && fits_in_rows(in, i, 0, 1, 2, p, &e) == E_RANGE &&
               fits_in_rows(in, i, 0, -1, 1, p, &e) == E_RANGE && fits_in_rows(in, i, -1, 0, 1, p, &e) == E_RANGE &&
               fits_in_rows(in, i, 0, LONG_MAX, 1, p, &e) == E_RANGE && fits_in_rows(in, 99, 0, 0, 1, p, &e) != OK,
               "rows that are not there are refused");
    check_that(fits_in_count(in) == 6 && fits_in_find(in, "SCI", 2) == 3 && fits_in_find(in, "SCI", 5) == -1 &&
               fits_in_selected(in) == 2 && !fits_in_hdu(in, 6) && !fits_in_hdu(in, -1), "counting and finding HDUs");
    fits_in_close(in);
    check_that(image_read(&im, "m.fits[SCI,1]", 10, &e) == E_NOMEM, "more than the memory allowed: %s", e.text);
}

/* ---- writing ---- */

/* Ones' complement sum of big-endian words: 0xffffffff over an HDU with its CHECKSUM. */
static uint32_t sum_words(const unsigned char *p, size_t n)
{
    uint64_t s = 0;
    for (size_t i = 0; i < n; i += 4) {
        s += (uint64_t)p[i] << 24 | (uint64_t)p[i + 1] << 16 | (uint64_t)p[i + 2] << 8 | p[i + 3];
        if (s >> 32)
            s = (s & 0xffffffff) + 1;
    }
    return (uint32_t)s;
}

static size_t load(const char *name, unsigned char *b, size_t size)
{
    FILE *f = fopen(name, "rb");
    size_t n = f ? fread(b, 1, size, f) : 0;
    if (f)
        fclose(f);
    return n;
}

static void test_write(void)
{
    static unsigned char b[3000000];
    struct image im;
    struct err e = {""};
    int sums = 1, pixels = 1, cards = 1;
    static const long sizes[][2] = {{1, 1}, {1, 719}, {720, 1}, {7, 13}, {257, 129}, {600, 1000}};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        if (image_new(&im, sizes[k][0], sizes[k][1]))
            abort();
        for (size_t i = 0; i < image_count(&im); i++)
            im.pix[i] = (float)((double)(i * 2654435761u % 1000003) * 1e-3 - 300);
        im.pix[0] = NAN;
        if (header_set_double(&im.hdr, "EXPTIME", 2000, "s") || header_append(&im.hdr, "BSCALE  = 5.0") ||
            header_append(&im.hdr, "CHECKSUM= 'x'") || header_append(&im.hdr, "NAXIS3  = 7"))
            abort();
        if (image_write(&im, "w.fits", "test 1.0: test --option", NULL, 0, &e))
            check_that(0, "image_write: %s", e.text);
        size_t n = load("w.fits", b, sizeof b), data = image_count(&im) * 4;
        sums &= n % 2880 == 0 && n >= 2880 + data && n < 2880 + data + 2880 && sum_words(b, n) == 0xffffffff;
        for (size_t i = 0; i < image_count(&im); i++) {
            const unsigned char *p = b + 2880 + 4 * i;
            uint32_t v = (uint32_t)p[0] << 24 | (uint32_t)p[1] << 16 | (uint32_t)p[2] << 8 | p[3], w;
            memcpy(&w, im.pix + i, 4);
            pixels &= v == w;
        }
        struct image back = get("w.fits");
        cards &= back.hdr.n == 2 && header_double_or(&back.hdr, "EXPTIME", 0) == 2000 &&
                 !strncmp(back.hdr.card[1], "HISTORY test 1.0: test --option ", 32);
        cards &= back.nx == im.nx && back.ny == im.ny && !memcmp(back.pix, im.pix, data);
        image_free(&back);
        image_free(&im);
    }
    check_that(sums, "whole blocks, and the words of the HDU sum to all ones");
    check_that(pixels, "big-endian pixels after one block of header");
    check_that(cards, "pixels and cards come back, structural cards of the input do not");
}

static void test_write_many(void)
{
    static unsigned char b[100000];
    struct fits_out *f;
    struct err e = {""};
    double d[12];
    int32_t n32[6];
    float x[6] = {0};
    for (int i = 0; i < 12; i++)
        d[i] = sqrt(i) * 1e100;
    for (int i = 0; i < 6; i++)
        n32[i] = i * 400000000 - 1000000000;
    struct header h = {0};
    int st = header_set_str(&h, "EXTNAME", "OTF", NULL);
    if (!st)
        st = fits_out_open(&f, "n.fits", NULL, 0, &e);
    if (!st)
        st = fits_out_hdu(f, -32, 0, 0, 1, NULL, &e);
    if (!st)
        st = fits_out_hdu(f, -64, 3, 2, 2, &h, &e);
    for (int k = 0; k < 4 && !st; k++)
        st = fits_out_rows_double(f, 1, d + 3 * k, &e);
    if (!st)
        check_that(fits_out_rows_double(f, 1, d, &e) == E_RANGE, "a row too many: %s", e.text);
    if (!st)
        st = fits_out_hdu(f, 32, 3, 2, 1, NULL, &e);
    if (!st)
        check_that(fits_out_rows(f, 1, x, &e) == E_RANGE, "floats into an integer image: %s", e.text);
    if (!st)
        check_that(fits_out_hdu(f, -32, 1, 1, 1, NULL, &e) == E_RANGE, "an HDU before the last one is full: %s", e.text);
    if (!st)
        st = fits_out_rows_int(f, 2, n32, &e);
    if (!st)
        st = fits_out_commit(f, &e);
    check_that(st == OK, "three HDUs: %s", e.text);
    size_t n = load("n.fits", b, sizeof b);
    check_that(n == 5 * 2880 && sum_words(b, 2880) == 0xffffffff && sum_words(b + 2880, 5760) == 0xffffffff &&
               sum_words(b + 3 * 2880, 5760) == 0xffffffff, "each HDU sums to all ones");
    struct fits_in *in;
    double back[12];
    st = fits_in_open(&in, "n.fits", 1e9, &e);
    if (!st)
        st = fits_in_rows_double(in, fits_in_find(in, "OTF", 0), 1, 0, 2, back, &e);
    check_that(!st && !memcmp(back, d + 6, 48), "doubles come back, plane 1");
    if (!st)
        st = fits_in_rows_double(in, 2, 0, 0, 2, back, &e);
    check_that(!st && back[0] == -1e9 && back[5] == 1e9, "integers come back");
    fits_in_close(in);

    st = fits_out_open(&f, "short.fits", NULL, 0, &e);
    if (!st)
        st = fits_out_hdu(f, -32, 2, 3, 1, NULL, &e);
    if (!st)
        st = fits_out_rows(f, 2, x, &e);
    check_that(!st && fits_out_commit(f, &e) == E_RANGE && access("short.fits", F_OK), "a row too few: no file: %s", e.text);
    const char *inputs[] = {"n.fits[1]"};
    check_that(fits_out_open(&f, "n.fits", inputs, 1, &e) == E_IO, "the input as output: %s", e.text);
    header_free(&h);
}

int main(void)
{
    test_types();
    test_choice();
    test_write();
    test_write_many();
    return check_status();
}
