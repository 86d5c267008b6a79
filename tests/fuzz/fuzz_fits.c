/*
 * fuzz_fits.c - the FITS readers on any bytes: images, world coordinates, tables.
 */
#include "fuzz.h"
#include "imageio.h"
#include "sky.h"
#include "table.h"
#include <stdlib.h>

static void read_images(struct fits_in *f)
{
    struct err e;
    for (int i = 0; i < fits_in_count(f); i++) {
        const struct hdu *h = fits_in_hdu(f, i);
        struct header cards = {0};
        struct sky *s;
        if (fits_in_header(f, i, &cards, &e) == OK && sky_open(&s, &cards, &e) == OK) {
            double x = 3, y = 4, ra, dec;
            if (sky_from_pixel(s, 1, &x, &y, &ra, &dec) == OK && sky_to_pixel(s, 1, &ra, &dec, &x, &y) != OK)
                x = 0;
            sky_close(s);
        }
        header_free(&cards);
        if (!h->is_image || h->nx > 100000)
            continue;
        float *row = malloc((size_t)h->nx * sizeof *row);
        double *wide = malloc((size_t)h->nx * sizeof *wide);
        for (long y = 0; row && wide && y < h->ny && y < 100; y++)
            if (fits_in_rows(f, i, 0, y, 1, row, &e) || fits_in_rows_double(f, i, h->nz - 1, y, 1, wide, &e))
                break;
        free(row);
        free(wide);
    }
}

/* A file of these bytes is read as images and as a table; nothing may crash, leak or grow. */
void fuzz_file(const char *name)
{
    struct err e = {""};
    struct fits_in *f;
    struct table t;
    if (fits_in_open(&f, name, 64e6, &e) == OK) {
        read_images(f);
        if (fits_in_table(f, &t, &e) == OK)
            table_free(&t);
        fits_in_close(f);
    } else if (!e.text[0]) {
        abort();           /* a failure without a cause */
    }
}
