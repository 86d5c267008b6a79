/* tablewrite.c - catalogues as text or FITS, written; see tableio.h. */
#include "imageio.h"
#include "outfile.h"
#include "outname.h"
#include "tableio.h"
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct sink {
    struct outfile *o;
    char *buf;
    size_t n;
    int st, why;             /* first failure and its errno */
};

enum { SINK = 1 << 16 };

static void sink_flush(struct sink *k)
{
    if (!k->st && (k->st = outfile_write(k->o, k->buf, k->n)))
        k->why = errno;
    k->n = 0;
}

static void put(struct sink *k, const char *text, size_t n)
{
    while (n) {
        if (k->n == SINK)
            sink_flush(k);
        size_t part = n < SINK - k->n ? n : SINK - k->n;
        memcpy(k->buf + k->n, text, part);
        k->n += part;
        text += part;
        n -= part;
    }
}

static void put_text(struct sink *k, const char *text)
{
    put(k, text, strlen(text));
}

/* Text of a header line: control characters would end or hide it. */
static void put_safe(struct sink *k, const char *text)
{
    for (; *text; text++)
        put(k, (unsigned char)*text < 32 || *text == 127 ? "?" : text, 1);
}

/* A unit or a description: in a header, brackets surround the unit and a comma ends it. */
static void put_plain(struct sink *k, const char *text, int unit)
{
    for (; *text; text++)
        if (*text == '[' || *text == ']')
            put(k, *text == '[' ? "(" : ")", 1);
        else if (unit && *text == ',')
            put(k, ";", 1);
        else
            put(k, (unsigned char)*text < 32 || *text == 127 ? "?" : text, 1);
}

static void put_padded(struct sink *k, const char *text, size_t width)
{
    size_t n = strlen(text);
    put(k, text, n);
    for (; n < width; n++)
        put(k, " ", 1);
}

/* A number in a cell, printed into the buffer itself. */
static void put_number(struct sink *k, enum col_type type, const struct column *c, size_t i)
{
    if (SINK - k->n < TABLE_PRINT)
        sink_flush(k);
    char *to = k->buf + k->n;
    k->n += type == COL_INT ? table_print_int(to, c->v.i[i])
          : type == COL_REAL32 ? table_print_real32(to, table_as_float(c->v.r[i])) : table_print_real(to, c->v.r[i]);
}

static void put_names(struct sink *k, const struct table *t)
{
    put_text(k, "#");
    for (size_t i = 0; i < t->ncol; i++) {
        put_text(k, " ");
        put_text(k, t->col[i].name);
    }
    put_text(k, "\n");
}

/* Type as gnuastro spells it; words need their longest length. */
static void put_type(struct sink *k, const struct column *c, size_t longest)
{
    static const char *const tag[] = {[COL_INT] = "i64", [COL_REAL] = "f64", [COL_REAL32] = "f32", [COL_RAGGED] = "f64"};
    if (c->type != COL_TEXT) {
        put_text(k, tag[c->type]);
        return;
    }
    char s[32];
    snprintf(s, sizeof s, "str%zu", longest);
    put_text(k, s);
}

/* `longest`: of every column, looked at for words only. */
static void put_header(struct sink *k, const struct table *t, const size_t *longest, const char *record)
{
    char s[64];
    size_t width = 8;
    for (size_t i = 0; i < t->ncol; i++)
        width = strlen(t->col[i].name) > width ? strlen(t->col[i].name) : width;
    put_names(k, t);
    for (size_t i = 0; i < t->ncol; i++) {
        const struct column *c = &t->col[i];
        snprintf(s, sizeof s, "# %3zu ", i + 1);
        put_text(k, s);
        put_padded(k, c->name, width + 1);
        put_plain(k, c->what[0] ? c->what : "no description", 0);
        if (c->unit[0]) {
            put_text(k, " [");
            put_plain(k, c->unit, 1);
            put_text(k, "]");
        }
        put_text(k, "\n");
    }
    for (size_t i = 0; i < t->ncol; i++) {
        const struct column *c = &t->col[i];
        snprintf(s, sizeof s, "# Column %zu: ", i + 1);
        put_text(k, s);
        put_padded(k, c->name, width + 1);
        put_text(k, "[");
        put_plain(k, c->unit, 1);
        put_text(k, ",");
        put_type(k, c, c->type == COL_TEXT ? longest[i] : 0);
        put_text(k, "] ");
        put_plain(k, c->what[0] ? c->what : "no description", 0);
        put_text(k, "\n");
    }
    for (size_t i = 0; i < t->nkey; i++) {
        put_text(k, "# Keyword: ");
        put_safe(k, t->key[i].name);
        put_text(k, " = ");
        put_safe(k, t->key[i].value);
        put_text(k, "\n");
    }
    for (size_t i = 0; i < t->nhistory + (record != NULL); i++) {
        put_text(k, "# HISTORY ");
        put_safe(k, i < t->nhistory ? t->history[i] : record);
        put_text(k, "\n");
    }
    put_names(k, t);
}

/* A word must come back as one cell. */
static int word_fits(const char *w)
{
    for (const char *p = w; *p; p++)
        if ((unsigned char)*p <= 32 || *p == 127)
            return 0;
    return w[0] && w[0] != '#';
}

/* `before`: rows of the blocks before this one. */
static int put_row(struct sink *k, const struct table *t, size_t row, size_t before, const char *name, struct err *e)
{
    for (size_t i = 0; i < t->ncol; i++) {
        const struct column *c = &t->col[i];
        if (i)
            put(k, " ", 1);
        if (c->type == COL_RAGGED) {
            if (c->start[row + 1] <= c->start[row])
                return err_set(e, E_DATA, "%s: row %zu: column %s has no values", name, before + row + 1, c->name);
            for (size_t j = c->start[row]; j < c->start[row + 1]; j++) {
                if (j > c->start[row])
                    put(k, " ", 1);
                put_number(k, COL_REAL, c, j);
            }
        } else if (c->type == COL_TEXT) {
            if (c->v.s[row][0] && !word_fits(c->v.s[row]))
                return err_set(e, E_DATA, "%s: row %zu: column %s: '%.60s' is not one word: write FITS", name,
                               before + row + 1, c->name, c->v.s[row]);
            put_text(k, c->v.s[row][0] ? c->v.s[row] : "-");
        } else {
            put_number(k, c->type, c, row);
        }
    }
    put(k, "\n", 1);
    return OK;
}

/* The rows of one block; st of the sink tells what became of the bytes. */
static int put_block(struct sink *k, const struct table *t, size_t before, const char *name, struct err *e)
{
    int st = OK;
    for (size_t i = 0; i < t->nrow && !st && !k->st; i++)
        st = put_row(k, t, i, before, name, e);
    return st;
}

static int put_rows(struct sink *k, struct table_rows *rows, const char *name, struct err *e)
{
    const struct table *t;
    size_t before = 0;
    int st;
    for (rows->again(rows); !(st = rows->next(rows, &t, e)) && t && !k->st; before += t->nrow)
        if ((st = put_block(k, t, before, name, e)))
            break;
    return st;
}

static const char *shown(const char *name)
{
    return strcmp(name, "-") == 0 ? "standard output" : name;
}

static int sink_open(struct sink *k, const char *name, const char *const *inputs, size_t n_inputs, struct err *e)
{
    *k = (struct sink){.buf = malloc(SINK)};
    if (!k->buf)
        return err_set(e, E_NOMEM, "%s: %s", shown(name), err_text(E_NOMEM));
    int st = outfile_open(&k->o, name, inputs, n_inputs, e);
    if (st)
        free(k->buf);
    return st;
}

/* A failure to write, in words. */
static int sink_error(const struct sink *k, const char *name, struct err *e)
{
    return k->st ? err_set(e, k->st, "%s: %s", shown(name), k->st == E_IO ? strerror(k->why) : err_text(k->st)) : OK;
}

/* Make the file appear, unless something failed before (st). */
static int sink_end(struct sink *k, const char *name, int st, struct err *e)
{
    if (!st) {
        sink_flush(k);
        st = sink_error(k, name, e);
    }
    if (st)
        outfile_abandon(k->o);
    else
        st = outfile_commit(k->o, e);
    free(k->buf);
    return st;
}

static int write_text(const struct table *t, struct table_rows *rows, const char *name, const char *record,
                      const char *const *inputs, size_t n_inputs, struct err *e)
{
    struct sink k;
    int st = sink_open(&k, name, inputs, n_inputs, e);
    if (st)
        return st;
    put_header(&k, t, rows->longest, record);
    return sink_end(&k, name, put_rows(&k, rows, shown(name), e), e);
}

static int write_fits(const struct table *t, struct table_rows *rows, const char *name, const char *record,
                      const char *const *inputs, size_t n_inputs, struct err *e)
{
    struct table view = *t;                      /* the same columns with one HISTORY line more */
    struct fits_out *f;
    view.history = malloc((t->nhistory + 1) * sizeof *view.history);
    char *line = record ? strdup(record) : NULL;
    if (!view.history || (record && !line)) {
        free(view.history);
        free(line);
        return err_set(e, E_NOMEM, "%s: %s", name, err_text(E_NOMEM));
    }
    for (size_t i = 0; i < t->nhistory; i++)
        view.history[i] = t->history[i];
    if (record)
        view.history[view.nhistory++] = line;
    int st = fits_out_open(&f, name, inputs, n_inputs, e);
    if (!st) {
        st = fits_out_hdu(f, -32, 0, 0, 1, NULL, e);
        if (!st)
            st = fits_out_blocks(f, &view, rows, "CATALOGUE", e);
        if (st)
            fits_out_abandon(f);
        else
            st = fits_out_commit(f, e);
    }
    free(view.history);
    free(line);
    return st;
}

int table_write_rows(const struct table *t, struct table_rows *rows, const char *name, const char *record,
                     const char *const *inputs, size_t n_inputs, struct err *e)
{
    if (outname_is_fits(name))
        return write_fits(t, rows, name, record, inputs, n_inputs, e);
    return write_text(t, rows, name, record, inputs, n_inputs, e);
}

int table_write(const struct table *t, const char *name, const char *record, const char *const *inputs,
                size_t n_inputs, struct err *e)
{
    struct table_whole whole;
    if (table_whole_init(&whole, t))
        return err_set(e, E_NOMEM, "%s: %s", name, err_text(E_NOMEM));
    int st = table_write_rows(t, &whole.rows, name, record, inputs, n_inputs, e);
    table_whole_free(&whole);
    return st;
}

/* ---- in blocks ---- */

struct table_out {
    const char *name, *const *inputs;
    size_t n_inputs;
    struct row_spool *spool;  /* where rows wait; NULL: they go to `k` */
    struct sink k;
    size_t before;            /* rows that went out */
};

int table_out_open(struct table_out **out, const char *name, const char *const *inputs, size_t n_inputs, struct err *e)
{
    struct table_out *o = calloc(1, sizeof *o);
    if (!o || row_spool_open(&o->spool)) {
        free(o);
        return err_set(e, E_NOMEM, "%s: %s", shown(name), err_text(E_NOMEM));
    }
    o->name = name;
    o->inputs = inputs;
    o->n_inputs = n_inputs;
    *out = o;
    return OK;
}

int table_out_begin(struct table_out *o, const struct table *head, const char *record, struct err *e)
{
    int waits = outname_is_fits(o->name);
    for (size_t i = 0; i < head->ncol; i++)
        waits |= head->col[i].type == COL_TEXT;
    if (waits)
        return OK;
    int st = sink_open(&o->k, o->name, o->inputs, o->n_inputs, e);
    if (st)
        return st;
    row_spool_close(o->spool);
    o->spool = NULL;
    put_header(&o->k, head, NULL, record);
    return OK;
}

int table_out_rows(struct table_out *o, const struct table *t, struct err *e)
{
    int st = o->spool ? row_spool_add(o->spool, t) : put_block(&o->k, t, o->before, shown(o->name), e);
    if (o->spool)
        return st ? err_set(e, st, "%s: cannot spool: %s", shown(o->name), st == E_IO ? strerror(errno) : err_text(st)) : OK;
    o->before += t->nrow;
    return st ? st : sink_error(&o->k, o->name, e);
}

/* The rows that waited. */
static int write_spool(struct table_out *o, const struct table *head, const char *record, struct err *e)
{
    struct table_rows *rows;
    if (row_spool_rows(o->spool, head, &rows))
        return err_set(e, E_NOMEM, "%s: %s", shown(o->name), err_text(E_NOMEM));
    return table_write_rows(head, rows, o->name, record, o->inputs, o->n_inputs, e);
}

int table_out_end(struct table_out *o, const struct table *head, const char *record, struct err *e)
{
    int st = o->spool ? write_spool(o, head, record, e) : sink_end(&o->k, o->name, OK, e);
    row_spool_close(o->spool);
    free(o);
    return st;
}
