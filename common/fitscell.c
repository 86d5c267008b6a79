/*
 * fitscell.c - the array in one cell of a binary table, as PSF models keep it.
 */
#include "fitswalk.h"
#include "imageio.h"
#include "source.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Bytes of an element of TFORM's letter, 0 for what has no fixed size here. */
static size_t element_size(char letter)
{
    static const struct { char letter; size_t size; } of[] = {
        {'L', 1}, {'B', 1}, {'A', 1}, {'I', 2}, {'J', 4}, {'E', 4}, {'K', 8}, {'D', 8}, {'C', 8}, {'P', 8}, {'M', 16}, {'Q', 16}};
    for (size_t i = 0; i < sizeof of / sizeof *of; i++)
        if (of[i].letter == letter)
            return of[i].size;
    return 0;
}

/* Repeat count and letter of "10E" or "E"; 0 on success. */
static int parse_form(const char *form, size_t *repeat, char *letter)
{
    char *end = NULL;
    unsigned long n = form[0] >= '0' && form[0] <= '9' ? strtoul(form, &end, 10) : 1;
    *letter = end ? *end : form[0];
    *repeat = n;
    return n > (1UL << 30) || !element_size(*letter);
}

/* Offset of a column in a row and its form. */
static int find_column(const struct fits_in *f, int index, const char *column, size_t *at, size_t *repeat, char *letter,
                       struct err *e)
{
    const struct header *h = &f->unit[index].cards;
    long n = 0;
    if (header_long(h, "TFIELDS", &n) || n < 1 || n > 999)
        return err_set(e, E_DATA, "%s: HDU %d: TFIELDS is not in 1..999", source_name(f->src), index);
    *at = 0;
    for (long i = 1; i <= n; i++) {
        char key[32], name[72] = "", form[72] = "";
        snprintf(key, sizeof key, "TTYPE%ld", i);
        if (header_str(h, key, name, sizeof name))
            name[0] = 0;
        snprintf(key, sizeof key, "TFORM%ld", i);
        if (header_str(h, key, form, sizeof form) || parse_form(form, repeat, letter))
            return err_set(e, E_DATA, "%s: HDU %d: %s '%s' is not understood", source_name(f->src), index, key, form);
        if (strcasecmp(name, column) == 0)
            return OK;
        *at += *repeat * element_size(*letter);
    }
    return err_set(e, E_MISSING, "%s: HDU %d: has no column %s", source_name(f->src), index, column);
}

/* Big-endian float or double. */
static double number(const unsigned char *p, size_t size)
{
    uint64_t v = 0;
    for (size_t i = 0; i < size; i++)
        v = v << 8 | p[i];
    if (size == 4) {
        uint32_t w = (uint32_t)v;
        float x;
        memcpy(&x, &w, sizeof x);
        return x;
    }
    double d;
    memcpy(&d, &v, sizeof d);
    return d;
}

int fits_in_cell(struct fits_in *f, int index, const char *column, double **value, size_t *count, struct err *e)
{
    size_t at = 0, repeat = 0;
    char letter = 0;
    if (index < 0 || index >= f->n || f->unit[index].kind != UNIT_BINTABLE || f->unit[index].compressed)
        return err_set(e, E_DATA, "%s: HDU %d: is not a binary table", source_name(f->src), index);
    const struct fits_unit *u = &f->unit[index];
    int status = find_column(f, index, column, &at, &repeat, &letter, e);
    if (status)
        return status;
    size_t size = element_size(letter);
    if ((letter != 'E' && letter != 'D') || repeat < 1 || u->axis[1] < 1 || at + repeat * size > u->axis[0])
        return err_set(e, E_DATA, "%s: HDU %d: column %s holds no array of real numbers", source_name(f->src), index, column);
    unsigned char *raw = malloc(repeat * size);
    double *v = malloc(repeat * sizeof *v);
    status = raw && v ? source_read(f->src, u->data_at + at, raw, repeat * size, e)
                      : err_set(e, E_NOMEM, "%s: %s", source_name(f->src), err_text(E_NOMEM));
    for (size_t i = 0; status == OK && i < repeat; i++)
        v[i] = number(raw + i * size, size);
    free(raw);
    if (status) {
        free(v);
        return status;
    }
    *value = v;
    *count = repeat;
    return OK;
}
