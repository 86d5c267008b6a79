/*
 * fuzz_fits.c - the FITS readers on any bytes.
 *
 *   clang -fsanitize=fuzzer,address,undefined: libFuzzer's main calls the function below
 *   otherwise: fuzz_fits FILE...   runs each file once, prints how it ended
 *
 * Build by hand, for example
 *   clang -std=c11 -D_GNU_SOURCE -g -O1 -fsanitize=fuzzer,address,undefined -Icommon $(pkg-config --cflags wcslib)
 *       tests/fuzz/fuzz_fits.c $(ls common/[^q]*.c) $(pkg-config --libs wcslib fftw3 gsl zlib) -lm -o fuzz_fits
 * and -DFUZZER, and start it with a folder of the files that tests/cmd/badfits.sh makes.
 */
#include "imageio.h"
#include "sky.h"
#include "table.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

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
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char name[64];
    struct err e = {""};
    struct fits_in *f;
    struct table t;
    int fd = memfd_create("fuzz", 0);
    if (fd < 0 || write(fd, data, size) != (ssize_t)size)
        abort();
    snprintf(name, sizeof name, "/proc/self/fd/%d", fd);
    if (fits_in_open(&f, name, 64e6, &e) == OK) {
        read_images(f);
        if (fits_in_table(f, &t, &e) == OK)
            table_free(&t);
        fits_in_close(f);
    } else if (!e.text[0]) {
        abort();           /* a failure without a cause */
    }
    close(fd);
    return 0;
}

#ifndef FUZZER
int main(int argc, char **argv)
{
    static uint8_t data[1 << 24];
    for (int i = 1; i < argc; i++) {
        FILE *f = fopen(argv[i], "rb");
        if (!f)
            die(EXIT_RUN, "%s: cannot read", argv[i]);
        size_t n = fread(data, 1, sizeof data, f);
        fclose(f);
        LLVMFuzzerTestOneInput(data, n);
        printf("%s: survived\n", argv[i]);
    }
    return EXIT_DONE;
}
#endif
