/*
 * test_fitscopy.c - copies through the whole chain of reading and writing.
 *
 *   test_fitscopy               images and tables of many shapes come back
 *   test_fitscopy IN OUT        copy the selected image (tests/cmd/io.sh, badfits.sh, peer/)
 *   test_fitscopy -d IN OUT     the same in double
 *   test_fitscopy -t IN OUT     copy a table
 *   test_fitscopy -w IN         world coordinates of the first pixel, or why there are none
 */
#include "check.h"
#include "imageio.h"
#include "sky.h"
#include "tableio.h"
#include <stdlib.h>
#include <string.h>

static int copy_double(const char *in, const char *out, struct err *e)
{
    struct fits_in *f;
    struct fits_out *o = NULL;
    int st = fits_in_open(&f, in, 1e9, e);
    if (st)
        return st;
    int index = fits_in_selected(f);
    const struct hdu *h = fits_in_hdu(f, index);
    if (!h || !h->is_image)
        st = fits_in_rows_double(f, index, 0, 0, 0, NULL, e);
    double *row = st ? NULL : malloc((size_t)h->nx * sizeof *row);
    struct header cards = {0};
    if (!st)
        st = fits_in_header(f, index, &cards, e);
    if (!st)
        st = fits_out_open(&o, out, &in, 1, e);
    if (!st)
        st = fits_out_hdu(o, -64, h->nx, h->ny, h->nz, &cards, e);
    for (long z = 0; !st && z < h->nz; z++)
        for (long y = 0; !st && y < h->ny; y++) {
            st = fits_in_rows_double(f, index, z, y, 1, row, e);
            if (!st)
                st = fits_out_rows_double(o, 1, row, e);
        }
    free(row);
    header_free(&cards);
    fits_in_close(f);
    if (!st)
        return fits_out_commit(o, e);
    fits_out_abandon(o);
    return st;
}

static int copy_image(const char *in, const char *out, struct err *e)
{
    struct image im;
    int st = image_read(&im, in, 1e9, e);
    if (st)
        return st;
    st = image_write(&im, out, NULL, &in, 1, e);
    image_free(&im);
    return st;
}

static int copy_table(const char *in, const char *out, struct err *e)
{
    struct table t;
    int st = table_read(&t, in, 1e9, e);
    if (st)
        return st;
    st = table_write(&t, out, NULL, &in, 1, e);
    table_free(&t);
    return st;
}

static int show_sky(const char *in, struct err *e)
{
    struct image im;
    struct sky *s;
    double x = 0, y = 0, ra, dec;
    int st = image_read(&im, in, 1e9, e);
    if (st)
        return st;
    st = sky_open(&s, &im.hdr, e);
    image_free(&im);
    if (st)
        return st;
    st = sky_from_pixel(s, 1, &x, &y, &ra, &dec);
    printf("%.12f %.12f %.9g %d\n", ra, dec, sky_scale(s), sky_is_linear(s));
    sky_close(s);
    return st ? err_set(e, st, "the first pixel has no position") : OK;
}

/* ---- on its own: tables of every column type ---- */

static void fill(struct table *t, size_t nrow)
{
    static const char *const words[] = {"", "a", "star", "a longer word than the others"};
    if (table_resize(t, nrow) || table_add(t, "ID", COL_INT, "", "Running number") ||
        table_add(t, "X", COL_REAL, "pixel", "Position, first pixel centre is 1") ||
        table_add(t, "F", COL_REAL32, "electron", "") || table_add(t, "TYPE", COL_TEXT, "", "Kind of object") ||
        table_add(t, "COEFFS", COL_RAGGED, "1/arcsec", "Coefficients of the model"))
        abort();
    for (size_t i = 0; i < nrow; i++) {
        double v[20];
        t->col[0].v.i[i] = i % 3 ? (int64_t)i * 1000003 : INT64_MIN + (int64_t)i;
        t->col[1].v.r[i] = i % 5 ? sqrt((double)i) : (double)NAN;
        t->col[2].v.r[i] = (double)(float)(1e-3 * (double)i);
        free(t->col[3].v.s[i]);
        if (!(t->col[3].v.s[i] = strdup(words[i % 4])))
            abort();
        for (size_t k = 0; k < i % 20; k++)
            v[k] = 1 / (1.0 + (double)(k + i));
        if (table_ragged(t, &t->col[4], i, v, i % 20))
            abort();
    }
    if (table_set_text(t, "SETNAME", "Sim 1's \"drizzled\"") || table_set_number(t, "PIXSCALE", 0.1) ||
        table_set_number(t, "EXTREMELY_LONG_NAME", -1e-300) || table_set_text(t, "SEED", "18446744073709551615") ||
        table_history(t, "prog 1.0: prog --option"))
        abort();
}

static int same(const struct table *a, const struct table *b)
{
    int good = a->nrow == b->nrow && a->ncol == b->ncol && a->nkey == b->nkey && a->nhistory == b->nhistory;
    for (size_t i = 0; good && i < a->ncol; i++) {
        const struct column *p = &a->col[i], *q = &b->col[i];
        good = !strcmp(p->name, q->name) && !strcmp(p->unit, q->unit) && p->type == q->type &&
               (!p->what[0] || !strcmp(p->what, q->what));
        for (size_t k = 0; good && k < a->nrow; k++)
            if (p->type == COL_TEXT)
                good = !strcmp(p->v.s[k], q->v.s[k]);
            else if (p->type == COL_RAGGED)
                good = p->start[k + 1] == q->start[k + 1];
            else
                good = !memcmp(&p->v.i[k], &q->v.i[k], 8) || (p->type != COL_INT && isnan(p->v.r[k]) && isnan(q->v.r[k]));
        if (good && p->type == COL_RAGGED && p->start[a->nrow])
            good = !memcmp(p->v.r, q->v.r, p->start[a->nrow] * sizeof(double));
        if (!good)
            printf("# column %s differs\n", p->name);
    }
    for (size_t i = 0; good && i < a->nkey; i++) {
        const char *v = table_text(b, a->key[i].name);
        good = v && !strcmp(v, a->key[i].value);
        if (!good)
            printf("# %s = '%s', not '%s'\n", a->key[i].name, v ? v : "nothing", a->key[i].value);
    }
    return good;
}

static void test_tables(void)
{
    static const size_t rows[] = {0, 1, 7, 5000};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct table t = {0}, back = {0};
        struct err e = {""};
        fill(&t, rows[i]);
        int st = table_write(&t, "t.fits", NULL, NULL, 0, &e);
        if (!st)
            st = table_read(&back, "t.fits", 1e9, &e);
        check_that(!st && same(&t, &back), "%zu rows of five types, keywords and history come back: %s", rows[i], e.text);
        table_free(&t);
        table_free(&back);
    }
    struct table t = {0};
    struct err e = {""};
    fill(&t, 1);
    if (table_set_text(&t, "NAXIS1", "7"))
        abort();
    check_that(table_write(&t, "u.fits", NULL, NULL, 0, &e) == E_RANGE, "a keyword that the format owns: %s", e.text);
    table_free(&t);
}

static void test_images(void)
{
    struct image im;
    struct err e = {""};
    int good = 1;
    for (long n = 1; n < 400; n += 37) {
        if (image_new(&im, n, 400 - n))
            abort();
        for (size_t i = 0; i < image_count(&im); i++)
            im.pix[i] = (float)i - 1000;
        good &= image_write(&im, "a.fits", NULL, NULL, 0, &e) == OK && copy_image("a.fits", "b.fits", &e) == OK &&
                copy_double("b.fits", "c.fits", &e) == OK && copy_image("c.fits", "d.fits", &e) == OK;
        struct image back = {0};
        good &= image_read(&back, "d.fits", 1e9, &e) == OK && back.nx == n && back.ny == 400 - n &&
                !memcmp(back.pix, im.pix, image_count(&im) * 4);
        image_free(&back);
        image_free(&im);
    }
    check_that(good, "images of 11 shapes through float, double and float: %s", e.text);
}

int main(int argc, char **argv)
{
    struct err e = {""};
    int st = OK, option = argc > 1 && argv[1][0] == '-' && argv[1][1];
    if (argc == 1) {
        test_tables();
        test_images();
        return check_status();
    }
    if (argc != 3 + (option && argv[1][1] != 'w'))
        die(EXIT_USAGE, "usage: test_fitscopy [-d|-t] IN OUT, or -w IN");
    if (!option)
        st = copy_image(argv[1], argv[2], &e);
    else if (argv[1][1] == 'd')
        st = copy_double(argv[2], argv[3], &e);
    else if (argv[1][1] == 't')
        st = copy_table(argv[2], argv[3], &e);
    else
        st = show_sky(argv[2], &e);
    if (st)
        die(EXIT_RUN, "%s", e.text);
    return EXIT_DONE;
}
