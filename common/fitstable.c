/*
 * fitstable.c - catalogues as FITS binary tables (FITS 4.0, section 7.3).
 *
 * Read: columns L B I J K (whole numbers; reals when scaled or with missing
 * values), E D, nA, and one variable-length numeric column at the end; other
 * columns are refused by name.  Written: K D E nA and PD or QD.  A keyword of
 * the catalogue is a card, a description is TCOMMn.
 */
#include "fitsout.h"
#include "fitswalk.h"
#include "imageio.h"
#include "table.h"
#include "tablerows.h"
#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK = 128 << 10, MOST_FIELDS = 999 };

/* One column of the file. */
struct field {
    char name[72];
    char letter;           /* of TFORM; P and Q: a descriptor */
    char item;             /* type of the elements of a variable-length column */
    size_t repeat, width, offset;   /* bytes in a row */
    double scale, zero;
    int has_null;          /* TNULL, or a logical 0 */
    int64_t null;
    int missing;           /* a null does occur */
    enum col_type type;
};

/* The rows of one table, read from the first on. */
struct fits_rows {
    struct fits_in *in;
    const struct fits_unit *u;
    int index;
    size_t n;
    struct field *field;
    struct table *t;
    struct err *e;
    uint64_t next;         /* first row that has not been read */
    uint64_t used;         /* bytes of the heap that rows so far take */
};

__attribute__((format(printf, 3, 4)))
static int bad(struct fits_rows *r, const struct field *c, const char *fmt, ...)
{
    char what[200];
    va_list ap;
    va_start(ap, fmt);
    vsnprintf(what, sizeof what, fmt, ap);
    va_end(ap);
    return err_set(r->e, E_DATA, "%s: HDU %d%s%s: %s", source_name(r->in->src), r->index,
                   c ? ": column " : "", c ? c->name : "", what);
}

static int no_memory(struct fits_rows *r)
{
    return err_set(r->e, E_NOMEM, "%s: out of memory", source_name(r->in->src));
}

/* ---- columns of the file ---- */

static size_t item_size(char letter)
{
    switch (letter) {
    case 'L': case 'B': case 'A': return 1;
    case 'I': return 2;
    case 'J': case 'E': return 4;
    case 'K': case 'D': case 'P': return 8;
    case 'Q': return 16;
    default: return 0;
    }
}

/* TFORM: [repeat]letter[...] */
static int parse_form(struct fits_rows *r, struct field *c, const char *form)
{
    char *end;
    unsigned long repeat = 1;
    if (isdigit((unsigned char)form[0])) {
        repeat = strtoul(form, &end, 10);
        form = end;
    }
    if (repeat > INT32_MAX)
        return bad(r, c, "its repeat count is too large");
    c->letter = (char)toupper((unsigned char)form[0]);
    c->repeat = repeat;
    c->width = repeat * item_size(c->letter);
    if (c->letter && strchr("XCM", c->letter))
        return bad(r, c, "type %c (bits, complex) is not read", c->letter);
    if (!item_size(c->letter))
        return bad(r, c, "type '%s' is unknown", form);
    if (c->letter == 'A') {
        if (isdigit((unsigned char)form[1]) && strtoul(form + 1, NULL, 10) != repeat)
            return bad(r, c, "an array of words in one cell is not read");
    } else if (strchr("PQ", c->letter)) {
        c->item = (char)toupper((unsigned char)form[1]);
        if (repeat != 1 || !c->item || !strchr("BIJKED", c->item))
            return bad(r, c, "a variable-length column must hold one array of numbers");
    } else if (repeat != 1) {
        return bad(r, c, "%zu values in one cell: split it into columns", c->repeat);
    }
    return repeat ? OK : bad(r, c, "is empty");
}

/* Names in capital letters, digits and _, as catalogues have them. */
static void plain_name(char *s)
{
    for (; *s; s++)
        *s = isalnum((unsigned char)*s) ? (char)toupper((unsigned char)*s) : '_';
}

/* Scaling and missing values: which type of the catalogue the column becomes. */
static int parse_meaning(struct fits_rows *r, struct field *c, size_t number)
{
    const struct header *h = &r->u->cards;
    char key[32];
    long null;
    snprintf(key, sizeof key, "TSCAL%zu", number);
    c->scale = 1;
    int st = header_double(h, key, &c->scale);
    if ((st && st != E_MISSING) || c->scale == 0)
        return bad(r, c, "%s is not a number, or 0", key);
    snprintf(key, sizeof key, "TZERO%zu", number);
    st = header_double(h, key, &c->zero);
    if (st && st != E_MISSING)
        return bad(r, c, "%s is not a number", key);
    snprintf(key, sizeof key, "TNULL%zu", number);
    st = header_long(h, key, &null);
    if (st != OK && st != E_MISSING)
        return bad(r, c, "%s is not a whole number", key);
    if (st == OK && strchr("PQ", c->letter))
        return bad(r, c, "%s of a variable-length column is not read", key);
    c->has_null = st == OK;
    c->null = c->has_null ? null : 0;
    switch (c->letter) {
    case 'A': c->type = COL_TEXT; break;
    case 'P': case 'Q': c->type = COL_RAGGED; break;
    case 'D': c->type = COL_REAL; break;
    case 'E': c->type = c->scale == 1 && c->zero == 0 ? COL_REAL32 : COL_REAL; break;
    case 'L':
        c->has_null = 1;
        c->null = 0;
        c->scale = 1;
        c->zero = 0;
        c->type = COL_INT;
        break;
    default:
        c->type = c->scale == 1 && c->zero == floor(c->zero) && fabs(c->zero) <= 0x1p63 ? COL_INT : COL_REAL;
    }
    return OK;
}

static int parse_fields(struct fits_rows *r)
{
    const struct header *h = &r->u->cards;
    long n;
    if (header_long(h, "TFIELDS", &n) || n < 1 || n > MOST_FIELDS)
        return bad(r, NULL, "TFIELDS is not in 1..%d", MOST_FIELDS);
    r->field = calloc((size_t)n, sizeof *r->field);
    if (!r->field)
        return no_memory(r);
    r->n = (size_t)n;
    size_t at = 0;
    for (size_t i = 0; i < r->n; i++) {
        struct field *c = &r->field[i];
        char key[32], form[72];
        snprintf(key, sizeof key, "TTYPE%zu", i + 1);
        if (header_str(h, key, c->name, sizeof c->name) || !c->name[0])
            snprintf(c->name, sizeof c->name, "COL%zu", i + 1);
        plain_name(c->name);
        snprintf(key, sizeof key, "TFORM%zu", i + 1);
        if (header_str(h, key, form, sizeof form))
            return bad(r, c, "has no %s", key);
        int st = parse_form(r, c, form);
        if (st == OK)
            st = parse_meaning(r, c, i + 1);
        if (st)
            return st;
        if (c->type == COL_RAGGED && i + 1 != r->n)
            return bad(r, c, "a variable-length column must be the last one");
        c->offset = at;
        at += c->width;
    }
    if (at != r->u->axis[0])
        return bad(r, NULL, "the columns have %zu bytes a row, NAXIS1 says %llu", at,
                   (unsigned long long)r->u->axis[0]);
    return OK;
}

/* ---- cells ---- */

static uint64_t big_endian(const unsigned char *p, size_t n)
{
    uint64_t v = 0;
    while (n--)
        v = v << 8 | *p++;
    return v;
}

/* A stored whole number. */
static int64_t stored_int(char letter, const unsigned char *p)
{
    switch (letter) {
    case 'B': return *p;
    case 'I': return (int16_t)big_endian(p, 2);
    case 'J': return (int32_t)big_endian(p, 4);
    case 'K': return (int64_t)big_endian(p, 8);
    default: return *p == 'T' ? 1 : *p == 'F' ? 2 : *p;   /* L: 0 is missing */
    }
}

static double stored_number(char letter, const unsigned char *p)
{
    uint64_t v = big_endian(p, item_size(letter));
    if (letter == 'D') {
        double d;
        memcpy(&d, &v, 8);
        return d;
    }
    if (letter == 'E') {
        uint32_t w = (uint32_t)v;
        float f;
        memcpy(&f, &w, 4);
        return (double)f;
    }
    return (double)stored_int(letter, p);
}

static int read_text(struct fits_rows *r, const struct field *c, const unsigned char *p, size_t row, char **to)
{
    size_t n = strnlen((const char *)p, c->width);
    while (n && p[n - 1] == ' ')
        n--;
    for (size_t i = 0; i < n; i++)
        if (p[i] < ' ' || p[i] > '~')
            return bad(r, c, "row %zu has a byte 0x%02X, which is not text", row + 1, p[i]);
    char *s = strndup((const char *)p, n);
    if (!s)
        return no_memory(r);
    free(*to);
    *to = s;
    return OK;
}

static int read_int(struct fits_rows *r, const struct field *c, const unsigned char *p, size_t row, int64_t *to)
{
    int64_t v = stored_int(c->letter, p);
    if (c->letter == 'L') {
        if (v != 1 && v != 2)
            return bad(r, c, "row %zu is neither T nor F", row + 1);
        *to = v == 1;
        return OK;
    }
    if (c->zero == 0x1p63) {
        uint64_t w = (uint64_t)v ^ (uint64_t)1 << 63;
        *to = (int64_t)w;
        return w <= INT64_MAX ? OK : bad(r, c, "row %zu does not fit 63 bits", row + 1);
    }
    if (!(fabs(c->zero) < 0x1p63) || __builtin_add_overflow(v, (int64_t)c->zero, to))
        return bad(r, c, "row %zu does not fit 63 bits", row + 1);
    return OK;
}

static int read_ragged(struct fits_rows *r, const struct field *c, struct column *to, const unsigned char *p,
                       size_t row)
{
    size_t half = c->width / 2, size = item_size(c->item);
    uint64_t n = big_endian(p, half), at = big_endian(p + half, half);
    uint64_t main = r->u->axis[0] * r->u->axis[1], heap = main;
    long theap;
    const int given = header_long(&r->u->cards, "THEAP", &theap);
    if (given != E_MISSING)
        heap = given || theap < 0 ? UINT64_MAX : (uint64_t)theap;
    if (heap < main || heap > r->u->data_size)
        return bad(r, c, "THEAP is out of range");
    uint64_t room = r->u->data_size - heap;
    if (n > room / size || at > room - n * size)
        return bad(r, c, "row %zu points outside the heap", row + 1);
    r->used += n * size;
    if (r->used > room)
        return bad(r, c, "its rows share parts of the heap, which is not read");

    unsigned char *raw = malloc(n ? n * size : 1);
    double *v = malloc(n ? n * sizeof *v : 1);
    int st = raw && v ? source_read(r->in->src, r->u->data_at + heap + at, raw, n * size, r->e) : no_memory(r);
    if (st == OK) {
        for (size_t i = 0; i < n; i++)
            v[i] = c->zero + c->scale * stored_number(c->item, raw + i * size);
        if (table_ragged(r->t, to, row, v, n))
            st = no_memory(r);
    }
    free(raw);
    free(v);
    return st;
}

static int read_cell(struct fits_rows *r, size_t i, const unsigned char *p, size_t row)
{
    const struct field *c = &r->field[i];
    struct column *to = &r->t->col[i];
    if (to->type == COL_TEXT)
        return read_text(r, c, p, row, &to->v.s[row]);
    if (to->type == COL_INT)
        return read_int(r, c, p, row, &to->v.i[row]);
    if (to->type == COL_RAGGED)
        return read_ragged(r, c, to, p, row);
    if (strchr("LBIJK", c->letter)) {
        int64_t v = stored_int(c->letter, p);
        to->v.r[row] = c->has_null && v == c->null ? NAN : c->letter == 'L' ? v == 1 : c->zero + c->scale * (double)v;
    } else {
        to->v.r[row] = c->scale == 1 && c->zero == 0 ? stored_number(c->letter, p)
                                                     : c->zero + c->scale * stored_number(c->letter, p);
    }
    return OK;
}

/* Visit n rows from `from` on: fill those of the table from its row 0, or look for missing whole numbers. */
static int each_row(struct fits_rows *r, uint64_t from, size_t n, int fill)
{
    size_t width = (size_t)r->u->axis[0];
    size_t rows = width < BLOCK ? BLOCK / width : 1;
    unsigned char *block = malloc(rows * width);
    int st = block ? OK : no_memory(r);
    for (size_t row = 0; row < n && !st; row += rows) {
        size_t k = n - row < rows ? n - row : rows;
        st = source_read(r->in->src, r->u->data_at + (from + row) * width, block, k * width, r->e);
        for (size_t j = 0; j < k && !st; j++)
            for (size_t i = 0; i < r->n && !st; i++) {
                struct field *c = &r->field[i];
                const unsigned char *p = block + j * width + c->offset;
                if (fill)
                    st = read_cell(r, i, p, row + j);
                else if (c->type == COL_INT && c->has_null)
                    c->missing |= stored_int(c->letter, p) == c->null;
            }
    }
    free(block);
    return st;
}

/* Only a pass over all rows can tell whether a whole number is missing. */
static int find_missing(struct fits_rows *r)
{
    int can = 0;
    for (size_t i = 0; i < r->n; i++)
        can |= r->field[i].type == COL_INT && r->field[i].has_null;
    return can ? each_row(r, 0, (size_t)r->u->axis[1], 0) : OK;
}

/* ---- the whole table ---- */

static int add_columns(struct fits_rows *r)
{
    char key[32], unit[72], what[512];
    int st = OK;
    for (size_t i = 0; i < r->n && !st; i++) {
        const struct field *c = &r->field[i];
        snprintf(key, sizeof key, "TUNIT%zu", i + 1);
        if (header_str(&r->u->cards, key, unit, sizeof unit))
            unit[0] = 0;
        snprintf(key, sizeof key, "TCOMM%zu", i + 1);
        if (header_str(&r->u->cards, key, what, sizeof what) || !what[0])
            snprintf(what, sizeof what, "no description");
        if (table_find(r->t, c->name))
            return bad(r, c, "appears twice");
        if (strcmp(c->name, "HISTORY") == 0)
            return bad(r, c, "a line of names that begins so would be one of history: call it otherwise");
        if (!isupper((unsigned char)c->name[0]))
            return bad(r, c, "the name does not begin with a letter");
        st = table_add(r->t, c->name, c->missing ? COL_REAL : c->type, unit, what);
        if (st == OK)
            r->t->col[r->t->ncol - 1].logical = c->letter == 'L';
    }
    return st == E_NOMEM ? no_memory(r) : st ? bad(r, NULL, "%s", err_text(st)) : OK;
}

/* The value of a card that is not text, as it stands there but for a small e. */
static void bare_value(const char *card, char *to)
{
    const char *v = strchr(card, '=') + 1;
    while (*v == ' ')
        v++;
    size_t n = strcspn(v, "/");
    while (n && v[n - 1] == ' ')
        n--;
    for (size_t i = 0; i < n; i++)
        to[i] = v[i] == 'E' && n > 1 ? 'e' : v[i];
    to[n] = 0;
}

static int add_keyword(struct fits_rows *r, const char *card)
{
    char name[81], value[2048];
    int long_name = !memcmp(card, "HIERARCH ", 9);
    const char *eq = strchr(card, '=');
    if (!eq || (!long_name && (eq != card + 8 || card[9] != ' ')))
        return OK;
    const char *from = card + (long_name ? 9 : 0);
    size_t n = (size_t)(eq - from);
    while (n && from[n - 1] == ' ')
        n--;
    memcpy(name, from, n);
    name[n] = 0;
    int st = header_str(&r->u->cards, name, value, sizeof value);
    if (st == E_MISSING)
        return OK;
    if (st)
        bare_value(card, value);
    plain_name(name);
    if (!isupper((unsigned char)name[0]) || !value[0])
        return OK;
    return table_set_text(r->t, name, value) ? no_memory(r) : OK;
}

static int add_header(struct fits_rows *r)
{
    static const char *const own[] = {"EXTNAME ", "EXTVER  ", "EXTLEVEL", "COMMENT ", "CONTINUE", "        "};
    int st = OK;
    for (size_t i = 0; i < r->u->cards.n && !st; i++) {
        const char *card = r->u->cards.card[i];
        int skip = fits_structural(card, r->u);
        for (size_t k = 0; k < sizeof own / sizeof *own; k++)
            skip |= !memcmp(card, own[k], 8);
        if (skip)
            continue;
        if (!memcmp(card, "HISTORY ", 8)) {
            char text[81];
            memcpy(text, card + 8, 73);
            size_t n = 72;
            while (n && text[n - 1] == ' ')
                n--;
            text[n] = 0;
            st = table_history(r->t, text) ? no_memory(r) : OK;
        } else {
            st = add_keyword(r, card);
        }
    }
    return st;
}

static int choose(const struct fits_in *f)
{
    if (f->chosen >= 0)
        return f->chosen;
    for (int i = 0; i < f->n; i++)
        if (f->unit[i].kind == UNIT_BINTABLE && !f->unit[i].compressed)
            return i;
    return -1;
}

int fits_table_open(struct fits_rows **out, struct fits_in *f, struct table *t, struct err *e)
{
    struct table new = {0};
    struct fits_rows r = {.in = f, .index = choose(f), .t = &new, .e = e};
    *out = NULL;
    if (r.index < 0)
        return err_set(e, E_MISSING, "%s: has no binary table", source_name(f->src));
    r.u = &f->unit[r.index];
    if (r.u->kind != UNIT_BINTABLE || r.u->compressed)
        return bad(&r, NULL, "is not a binary table");
    int st = parse_fields(&r);
    if (st == OK)
        st = find_missing(&r);
    if (st == OK)
        st = add_columns(&r);
    if (st == OK)
        st = add_header(&r);
    struct fits_rows *kept = st ? NULL : malloc(sizeof *kept);
    if (!st && !kept)
        st = no_memory(&r);
    if (st) {
        free(r.field);
        table_free(&new);
        return st;
    }
    *kept = r;
    *out = kept;
    *t = new;
    return OK;
}

int fits_table_rows(struct fits_rows *r, struct table *t, size_t n, struct err *e)
{
    uint64_t left = r->u->axis[1] - r->next;
    n = n < left ? n : (size_t)left;
    r->t = t;
    r->e = e;
    if (table_resize(t, 0) || table_resize(t, n))
        return no_memory(r);
    int st = each_row(r, r->next, n, 1);
    r->next += n;
    return st;
}

double fits_table_part(const struct fits_rows *r)
{
    return r->u->axis[1] ? (double)r->next / (double)r->u->axis[1] : 1;
}

void fits_table_close(struct fits_rows *r)
{
    if (r)
        free(r->field);
    free(r);
}

int fits_in_table(struct fits_in *f, struct table *t, struct err *e)
{
    struct table new = {0};
    struct fits_rows *r;
    int st = fits_table_open(&r, f, &new, e);
    if (st == OK)
        st = fits_table_rows(r, &new, SIZE_MAX, e);
    fits_table_close(r);
    if (st)
        table_free(&new);
    else
        *t = new;
    return st;
}

/* ---- writing ---- */

/* Bytes of a column in a row; longest: of its words. */
static size_t column_width(const struct column *c, int wide, size_t longest)
{
    if (c->type == COL_REAL32)
        return 4;
    if (c->type == COL_RAGGED)
        return wide ? 16 : 8;
    return c->type == COL_TEXT ? longest : 8;
}

static const struct column *ragged_column(const struct table *t)
{
    return t->ncol && t->col[t->ncol - 1].type == COL_RAGGED ? &t->col[t->ncol - 1] : NULL;
}

static int column_cards(struct header *h, const struct column *c, size_t number, size_t longest, int wide)
{
    char key[32], form[48];
    if (c->type == COL_TEXT)
        snprintf(form, sizeof form, "%zuA", longest);
    else if (c->type == COL_RAGGED)
        snprintf(form, sizeof form, "1%cD(%zu)", wide ? 'Q' : 'P', longest);
    else
        snprintf(form, sizeof form, "%c", c->type == COL_INT ? 'K' : c->type == COL_REAL32 ? 'E' : 'D');
    snprintf(key, sizeof key, "TTYPE%zu", number);
    int st = header_set_str(h, key, c->name, NULL);
    if (st == OK) {
        snprintf(key, sizeof key, "TFORM%zu", number);
        st = header_set_str(h, key, form, NULL);
    }
    if (st == OK && c->unit[0]) {
        snprintf(key, sizeof key, "TUNIT%zu", number);
        st = header_set_str(h, key, c->unit, NULL);
    }
    if (st == OK && c->what[0]) {
        snprintf(key, sizeof key, "TCOMM%zu", number);
        st = header_set_str(h, key, c->what, NULL);
    }
    return st;
}

/* A number stays a number, anything else is text. E_RANGE: the name is taken by the format. */
static int keyword_card(struct header *h, const struct keyword *k)
{
    static const char *const taken[] = {"HISTORY", "COMMENT", "CONTINUE", "HIERARCH", "EXTNAME"};
    const struct fits_unit table = {.kind = UNIT_BINTABLE};
    char card[120];
    double v;
    size_t n = strlen(k->value);
    snprintf(card, sizeof card, "%-8.60s= ", k->name);
    for (size_t i = 0; i < sizeof taken / sizeof *taken; i++)
        if (!strcmp(k->name, taken[i]))
            return E_RANGE;
    if (strlen(k->name) <= 8 && fits_structural(card, &table))
        return E_RANGE;
    if (n > 40 || table_scan_real(k->value, n, &v) || !isfinite(v))
        return header_set_str(h, k->name, k->value, NULL);
    snprintf(card, sizeof card, "%s%-8s= %*s", strlen(k->name) > 8 ? "HIERARCH " : "", k->name,
             strlen(k->name) > 8 ? 0 : 20, k->value);
    for (char *p = strchr(card, '='); *p; p++)
        *p = *p == 'e' ? 'E' : *p;
    return header_append(h, card);
}

static int table_cards(struct header *h, const struct table *t, const struct table_rows *rows, const char *extname,
                       size_t width, uint64_t heap, int wide, struct err *e)
{
    const struct {
        const char *key;
        long value;
    } fixed[] = {{"BITPIX", 8}, {"NAXIS", 2}, {"NAXIS1", (long)width}, {"NAXIS2", (long)rows->nrow},
                 {"PCOUNT", (long)heap}, {"GCOUNT", 1}, {"TFIELDS", (long)t->ncol}};
    int st = header_set_str(h, "XTENSION", "BINTABLE", "binary table");
    for (size_t i = 0; i < sizeof fixed / sizeof *fixed && !st; i++)
        st = header_set_long(h, fixed[i].key, fixed[i].value, NULL);
    for (size_t i = 0; i < t->ncol && !st; i++)
        st = column_cards(h, &t->col[i], i + 1, rows->longest[i], wide);
    if (st == OK && extname && *extname)
        st = header_set_str(h, "EXTNAME", extname, NULL);
    for (size_t i = 0; i < t->nkey && !st; i++) {
        st = keyword_card(h, &t->key[i]);
        if (st == E_RANGE)
            return err_set(e, st, "keyword %s cannot be written to FITS", t->key[i].name);
    }
    for (size_t i = 0; i < t->nhistory && !st; i++)
        st = header_history(h, t->history[i]);
    for (size_t i = 0; i < h->n && !st; i++)
        if (!memcmp(h->card[i], "CONTINUE", 8)) {
            st = header_set_str(h, "LONGSTRN", "OGIP 1.0", "CONTINUE cards are there");
            break;
        }
    return st ? err_set(e, st, "%s", err_text(st)) : OK;
}

static void put_big_endian(unsigned char *p, size_t n, uint64_t v)
{
    while (n--) {
        p[n] = (unsigned char)v;
        v >>= 8;
    }
}

static void put_double(unsigned char *p, double d)
{
    uint64_t v;
    memcpy(&v, &d, 8);
    put_big_endian(p, 8, v);
}

/* `heap`: values of the ragged column before this block. */
static void put_cell(unsigned char *p, const struct column *c, size_t row, size_t width, uint64_t heap)
{
    float f;
    uint32_t w;
    size_t n;
    switch (c->type) {
    case COL_INT:
        put_big_endian(p, 8, (uint64_t)c->v.i[row]);
        break;
    case COL_REAL:
        put_double(p, c->v.r[row]);
        break;
    case COL_REAL32:
        f = (float)c->v.r[row];
        memcpy(&w, &f, 4);
        put_big_endian(p, 4, w);
        break;
    case COL_TEXT:
        n = strlen(c->v.s[row]);
        memcpy(p, c->v.s[row], n);
        memset(p + n, ' ', width - n);
        break;
    case COL_RAGGED:
        put_big_endian(p, width / 2, c->start[row + 1] - c->start[row]);
        put_big_endian(p + width / 2, width / 2, (heap + c->start[row] - c->start[0]) * sizeof(double));
        break;
    }
}

/* The rows of one block; *heap goes on by its ragged values. */
static int put_block(struct fits_out *f, const struct table *t, const size_t *cell, unsigned char *buf, size_t rows, uint64_t *heap,
                     struct err *e)
{
    int st = OK;
    for (size_t row = 0; row < t->nrow && !st; row += rows) {
        size_t k = t->nrow - row < rows ? t->nrow - row : rows;
        unsigned char *p = buf;
        for (size_t j = row; j < row + k; j++)
            for (size_t i = 0; i < t->ncol; p += cell[i++])
                put_cell(p, &t->col[i], j, cell[i], *heap);
        st = fits_out_bytes(f, buf, (size_t)(p - buf), e);
    }
    const struct column *ragged = ragged_column(t);
    *heap += ragged ? ragged->start[t->nrow] - ragged->start[0] : 0;
    return st;
}

static int put_rows(struct fits_out *f, struct table_rows *r, const size_t *cell, size_t width, struct err *e)
{
    size_t rows = width < BLOCK ? BLOCK / (width ? width : 1) : 1;
    unsigned char *buf = malloc(rows * width + 1);
    const struct table *t;
    uint64_t heap = 0;
    int st = buf ? OK : err_set(e, E_NOMEM, "out of memory");
    r->again(r);
    while (!st && !(st = r->next(r, &t, e)) && t)
        st = put_block(f, t, cell, buf, rows, &heap, e);
    free(buf);
    return st;
}

static int put_heap(struct fits_out *f, const struct column *c, size_t nrow, struct err *e)
{
    unsigned char block[8192];
    size_t n = 0;
    int st = OK;
    for (size_t i = c->start[0]; i < c->start[nrow] && !st; i++) {
        put_double(block + n, c->v.r[i]);
        n += 8;
        if (n == sizeof block || i + 1 == c->start[nrow]) {
            st = fits_out_bytes(f, block, n, e);
            n = 0;
        }
    }
    return st;
}

static int put_heaps(struct fits_out *f, struct table_rows *r, struct err *e)
{
    const struct table *t;
    int st = OK;
    r->again(r);
    while (!st && !(st = r->next(r, &t, e)) && t)
        st = put_heap(f, ragged_column(t), t->nrow, e);
    return st;
}

int fits_out_blocks(struct fits_out *f, const struct table *t, struct table_rows *rows, const char *extname, struct err *e)
{
    if (t->ncol < 1 || t->ncol > MOST_FIELDS)
        return err_set(e, E_RANGE, "a FITS table has 1 to %d columns, not %zu", MOST_FIELDS, t->ncol);
    uint64_t heap = ragged_column(t) ? rows->values * sizeof(double) : 0;
    int wide = heap > INT32_MAX, st = OK;
    size_t *cell = malloc(t->ncol * sizeof *cell), width = 0;
    if (!cell)
        return err_set(e, E_NOMEM, "out of memory");
    for (size_t i = 0; i < t->ncol; i++)
        width += cell[i] = column_width(&t->col[i], wide, rows->longest[i]);

    struct header h = {0};
    if (fits_out_count(f) == 0)
        st = fits_out_hdu(f, -32, 0, 0, 1, NULL, e);
    if (st == OK)
        st = table_cards(&h, t, rows, extname, width, heap, wide, e);
    if (st == OK)
        st = fits_out_begin(f, &h, (uint64_t)width * rows->nrow + heap, e);
    if (st == OK)
        st = put_rows(f, rows, cell, width, e);
    if (st == OK && heap)
        st = put_heaps(f, rows, e);
    header_free(&h);
    free(cell);
    return st;
}

int fits_out_table(struct fits_out *f, const struct table *t, const char *extname, struct err *e)
{
    struct table_whole whole;
    if (table_whole_init(&whole, t))
        return err_set(e, E_NOMEM, "out of memory");
    int st = fits_out_blocks(f, t, &whole.rows, extname, e);
    table_whole_free(&whole);
    return st;
}
