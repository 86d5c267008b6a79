/* kernelio.c - detection kernels from FITS images and text; see kernelio.h. */
#include "kernelio.h"
#include "fileio.h"
#include "grow.h"
#include "imageio.h"
#include "opt.h"
#include "source.h"
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static const char magic[] = "CONV";
enum { MAGIC = sizeof magic - 1 };

void kernel_free(struct kernel *k)
{
    free(k->v);
    *k = (struct kernel){0};
}

/* Divide by the sum of the moduli. */
static int scale(struct kernel *k, const char *name, struct err *e)
{
    double sum = 0, most = 0;
    for (long i = 0; i < k->nx * k->ny; i++)
        most = fmax(most, fabs(k->v[i]));
    for (long i = 0; i < k->nx * k->ny; i++)
        sum += fabs(k->v[i] / most);
    if (!(sum > 0))
        return err_set(e, E_DATA, "%s: all values of the kernel are 0", name);
    for (long i = 0; i < k->nx * k->ny; i++)
        k->v[i] = k->v[i] / most / sum;
    return OK;
}

/* ---- text ---- */

/* A row of numbers, which are appended to v; *n is their number. The line is cut to pieces. */
static int text_row(char *line, const char *name, long number, double **v, size_t *cap, size_t used, size_t *n, struct err *e)
{
    char *rest = line;
    *n = 0;
    for (char *word; (word = strsep(&rest, " \t\r"));) {
        if (!*word)
            continue;
        int st = grow(v, cap, used + *n + 1, sizeof **v);
        if (st)
            return err_set(e, st, "%s: %s", name, err_text(st));
        if (opt_number(word, *v + used + *n))
            return err_set(e, E_DATA, "%s: line %ld: '%.40s' is not a number", name, number, word);
        ++*n;
    }
    return OK;
}

/* NORM or not, from the first line. */
static int text_norm(char *line, const char *name, int *norm, struct err *e)
{
    char *rest = line;
    const char *words[3] = {NULL, "NORM", NULL};
    int n = 0;
    for (char *word; (word = strsep(&rest, " \t\r"));)
        if (*word && n < 3)
            words[n++] = word;
    *norm = strcmp(words[1], "NORM") == 0;
    if (n < 1 || n > 2 || strcmp(words[0], magic) || (!*norm && strcmp(words[1], "NONORM")))
        return err_set(e, E_DATA, "%s: the first line of a kernel is CONV NORM or CONV NONORM", name);
    return OK;
}

/* text ends with a 0. */
static int text_kernel(struct kernel *k, char *text, const char *name, struct err *e)
{
    struct kernel made = {0};
    size_t cap = 0, n;
    long number = 1;
    int norm, st = text_norm(strsep(&text, "\n"), name, &norm, e);
    for (char *line; !st && (line = strsep(&text, "\n"));) {
        number++;
        line += strspn(line, " \t\r");
        if (*line == '#' || !*line)
            continue;
        st = text_row(line, name, number, &made.v, &cap, (size_t)(made.nx * made.ny), &n, e);
        if (!st && made.ny > 0 && (long)n != made.nx)
            st = err_set(e, E_DATA, "%s: line %ld: %zu numbers, the rows before have %ld", name, number, n, made.nx);
        made.nx = (long)n;
        made.ny++;
    }
    if (!st && made.ny == 0)
        st = err_set(e, E_DATA, "%s: a kernel without numbers", name);
    if (!st && norm)
        st = scale(&made, name, e);
    if (st)
        kernel_free(&made);
    else
        *k = made;
    return st;
}

static int read_text(struct kernel *k, struct source *src, const char *name, double max_memory, struct err *e)
{
    uint64_t have = 0, end = 65536;
    int st = source_need(src, end, &have, e);
    while (!st && have == end && (double)end < max_memory) {
        end *= 2;
        st = source_need(src, end, &have, e);
    }
    if (!st && have == end)
        st = err_set(e, E_NOMEM, "%s: %.0f MB of text are too many for a kernel", name, (double)have / 1e6);
    if (st)
        return st;
    char *text = malloc((size_t)have + 1);
    if (!text)
        return err_set(e, E_NOMEM, "%s: %s", name, err_text(E_NOMEM));
    st = source_read(src, 0, text, (size_t)have, e);
    text[have] = 0;
    if (!st && memchr(text, 0, (size_t)have))
        st = err_set(e, E_DATA, "%s: a text with bytes of value 0", name);
    if (!st)
        st = text_kernel(k, text, name, e);
    free(text);
    return st;
}

/* ---- images ---- */

static int read_image(struct kernel *k, struct fits_in *f, const char *name, double max_memory, struct err *e)
{
    const int index = fits_in_selected(f);
    const struct hdu *d = index < 0 ? NULL : fits_in_hdu(f, index);
    if (!d || !d->is_image)
        return err_set(e, E_DATA, "%s: no image in it: a kernel is a FITS image or text that begins with CONV", name);
    if (d->nz != 1)
        return err_set(e, E_DATA, "%s: a cube of %ld planes: write one kernel as an image", name, d->nz);
    struct kernel made = {d->nx, d->ny, NULL};
    const size_t n = (size_t)d->nx * (size_t)d->ny;
    if (8 * (double)n > max_memory)
        return err_set(e, E_NOMEM, "%s: a kernel of %ld x %ld values needs %.0f MB: raise --max-memory", name, d->nx, d->ny, 8e-6 * (double)n);
    made.v = malloc(n * sizeof *made.v);
    int st = made.v ? fits_in_rows_double(f, index, 0, 0, d->ny, made.v, e) : err_set(e, E_NOMEM, "%s: %s", name, err_text(E_NOMEM));
    for (size_t i = 0; i < n && !st; i++)
        if (!isfinite(made.v[i]))
            st = err_set(e, E_DATA, "%s: pixel (%zu, %zu) of the kernel is not finite", name, i % (size_t)d->nx + 1, i / (size_t)d->nx + 1);
    if (!st)
        st = scale(&made, name, e);
    if (st)
        kernel_free(&made);
    else
        *k = made;
    return st;
}

int kernel_read(struct kernel *k, const char *name, double max_memory, struct err *e)
{
    char *path, *suffix;
    int st = file_split(name, &path, &suffix);
    if (st)
        return err_set(e, st, "%s: %s", name, err_text(st));
    struct source *src = NULL;
    struct fits_in *f = NULL;
    uint64_t have = 0;
    char head[MAGIC] = {0};
    st = source_open(&src, path, max_memory, e);
    if (!st)
        st = source_need(src, MAGIC, &have, e);
    if (!st && have >= MAGIC)
        st = source_read(src, 0, head, MAGIC, e);
    if (!st && !memcmp(head, magic, MAGIC) && !suffix) {
        st = read_text(k, src, name, max_memory, e);
    } else if (!st) {
        if (strcmp(name, "-") == 0) {
            st = fits_in_from(&f, src, max_memory, e);
            src = NULL;
        } else {
            st = fits_in_open(&f, name, max_memory, e);
        }
        if (!st)
            st = read_image(k, f, name, max_memory, e);
        fits_in_close(f);
    }
    source_close(src);
    free(path);
    free(suffix);
    return st;
}
