/*
 * tableio.c - catalogues as text or FITS, read; tablewrite.c writes them.
 *
 * Text is read through one buffer, a line at a time, without copying cells.
 * When the header does not give the type of every column the rows are read
 * twice, first to find out which columns are whole numbers, numbers or words;
 * those of a pipe stay in the buffer in between.
 */
#include "tableio.h"
#include "fileio.h"
#include "imageio.h"
#include "source.h"
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { LINE_MAX_BYTES = 65536, CELLS_MAX = 4096, BLOCK = 1 << 18, STEP = 64 };
enum { UNTYPED = -1 };

/* ---- lines of a file ---- */

struct lines {
    int fd;
    struct source *gzip;     /* instead of fd when the file is compressed */
    uint64_t offset;         /* bytes taken from it */
    const char *name;        /* for messages */
    char *buf;
    size_t begin, end, cap;  /* unread bytes are buf[begin..end) */
    size_t keep;             /* bytes from here on stay in the buffer; SIZE_MAX: none */
    int eof;
    long line;               /* number of the line returned last */
    double max_memory;       /* bytes that may be held */
    double held;             /* bytes held by the table */
    struct err *e;
};

/* Up to n more bytes of the input; 0 at its end, -1 on failure. */
static ssize_t more_bytes(struct lines *s, char *to, size_t n)
{
    if (!s->gzip) {
        ssize_t got = file_read(s->fd, to, n);
        if (got < 0)
            err_set(s->e, E_IO, "%s: %s", s->name, strerror(errno));
        return got;
    }
    uint64_t have = 0;
    if (source_need(s->gzip, s->offset + n, &have, s->e))
        return -1;
    n = (size_t)(have - s->offset);
    if (n && source_read(s->gzip, s->offset, to, n, s->e))
        return -1;
    s->offset = have;
    return (ssize_t)n;
}

static int lines_fill(struct lines *s)
{
    size_t from = s->begin < s->keep ? s->begin : s->keep;
    if (from) {
        memmove(s->buf, s->buf + from, s->end - from);
        s->begin -= from;
        s->end -= from;
        s->keep -= s->keep == SIZE_MAX ? 0 : from;
    }
    if (s->cap - s->end < BLOCK) {
        size_t cap = s->cap + s->cap / 2 + 2 * BLOCK;
        if ((double)cap + s->held > s->max_memory)
            return err_set(s->e, E_NOMEM, "%s: needs more than --max-memory", s->name);
        char *b = realloc(s->buf, cap);
        if (!b)
            return err_set(s->e, E_NOMEM, "%s: %s", s->name, err_text(E_NOMEM));
        s->buf = b;
        s->cap = cap;
    }
    ssize_t n = more_bytes(s, s->buf + s->end, BLOCK);
    if (n < 0)
        return E_IO;
    s->eof = n == 0;
    s->end += (size_t)n;
    return OK;
}

/* The next line without its end; *line = NULL at the end of the file. */
static int lines_next(struct lines *s, char **line, size_t *len)
{
    size_t seen = 0;
    char *nl;
    while (!(nl = s->end - s->begin > seen ? memchr(s->buf + s->begin + seen, '\n', s->end - s->begin - seen) : NULL)
           && !s->eof && s->end - s->begin <= LINE_MAX_BYTES) {
        seen = s->end - s->begin;
        int st = lines_fill(s);
        if (st)
            return st;
    }
    *line = NULL;
    *len = (nl ? (size_t)(nl - s->buf) : s->end) - s->begin;
    if (!nl && *len == 0)
        return OK;
    s->line++;
    if (*len > LINE_MAX_BYTES)
        return err_set(s->e, E_DATA, "%s: line %ld: longer than %d bytes", s->name, s->line, LINE_MAX_BYTES);
    *line = s->buf + s->begin;
    s->begin += *len + (nl != NULL);
    if (memchr(*line, '\0', *len))
        return err_set(s->e, E_DATA, "%s: line %ld: a NUL byte: this is not a text catalogue", s->name, s->line);
    if (*len && (*line)[*len - 1] == '\r')
        --*len;
    return OK;
}

static int is_blank(char c)
{
    return c == ' ' || c == '\t';
}

/* The next word of [*p, end): its length, 0 when there is none; *p moves to its first byte. */
static size_t next_word(const char **p, const char *end)
{
    const char *s = *p;
    while (s < end && is_blank(*s))
        s++;
    *p = s;
    while (s < end && !is_blank(*s))
        s++;
    return (size_t)(s - *p);
}

/* ---- header ---- */

struct label {               /* what the header says about one column */
    char *name, *unit, *what;
    int type;                /* enum col_type or UNTYPED */
};

struct labels {
    size_t n;                /* columns named by "# NAME NAME ..." */
    struct label *col;
    size_t n_about;          /* columns described by number */
    struct label *about;     /* index: number - 1 */
};

static void labels_free(struct labels *h)
{
    for (size_t i = 0; i < h->n + h->n_about; i++) {
        struct label *l = i < h->n ? &h->col[i] : &h->about[i - h->n];
        free(l->name);
        free(l->unit);
        free(l->what);
    }
    free(h->col);
    free(h->about);
    *h = (struct labels){0};
}

static int no_memory(struct lines *s)
{
    return err_set(s->e, E_NOMEM, "%s: line %ld: %s", s->name, s->line, err_text(E_NOMEM));
}

/* Replace *to by a copy of n bytes without blanks at both ends. */
static int set_text(struct lines *s, char **to, const char *from, size_t n)
{
    while (n && is_blank(*from))
        from++, n--;
    while (n && is_blank(from[n - 1]))
        n--;
    char *c = strndup(from, n);
    if (!c)
        return no_memory(s);
    free(*to);
    *to = c;
    return OK;
}

/* "i64", "f32", "str8" -> column type; -2 when unknown. */
static int type_from_tag(const char *s, size_t n)
{
    static const struct { char tag[4]; int type; } known[] = {
        {"i8", COL_INT}, {"i16", COL_INT}, {"i32", COL_INT}, {"i64", COL_INT}, {"u8", COL_INT}, {"u16", COL_INT},
        {"u32", COL_INT}, {"u64", COL_INT}, {"f32", COL_REAL32}, {"f64", COL_REAL}
    };
    while (n && is_blank(*s))
        s++, n--;
    while (n && is_blank(s[n - 1]))
        n--;
    if (n == 0)
        return UNTYPED;
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++)
        if (strlen(known[i].tag) == n && memcmp(known[i].tag, s, n) == 0)
            return known[i].type;
    int64_t width;
    return n > 3 && memcmp(s, "str", 3) == 0 && table_scan_int(s + 3, n - 3, &width) == OK ? COL_TEXT : -2;
}

/* The entry for column `number` among the described ones. */
static int label_about(struct lines *s, struct labels *h, int64_t number, struct label **out)
{
    if (number < 1 || number > CELLS_MAX)
        return err_set(s->e, E_DATA, "%s: line %ld: column number %lld is not in 1..%d", s->name, s->line,
                       (long long)number, CELLS_MAX);
    if ((size_t)number > h->n_about) {
        struct label *a = realloc(h->about, (size_t)number * sizeof *a);
        if (!a)
            return no_memory(s);
        for (h->about = a; h->n_about < (size_t)number; h->n_about++)
            a[h->n_about] = (struct label){.type = UNTYPED};
    }
    *out = &h->about[number - 1];
    return OK;
}

static int label_name(struct lines *s, struct label *l, const char *name, size_t n, int64_t number)
{
    if (l->name && (strlen(l->name) != n || memcmp(l->name, name, n) != 0))
        return err_set(s->e, E_DATA, "%s: line %ld: column %lld is called %.*s here and %s above", s->name, s->line,
                       (long long)number, (int)(n < 64 ? n : 64), name, l->name);
    return set_text(s, &l->name, name, n);
}

/* After "# Column ": "3: NAME [unit,type] description". */
static int header_typed(struct lines *s, struct labels *h, const char *p, const char *end)
{
    size_t n = next_word(&p, end);
    int64_t number;
    struct label *l;
    if (n < 2 || p[n - 1] != ':' || table_scan_int(p, n - 1, &number))
        return err_set(s->e, E_DATA, "%s: line %ld: '# Column' must be followed by a number and a colon", s->name, s->line);
    int st = label_about(s, h, number, &l);
    if (st)
        return st;
    p += n;
    n = next_word(&p, end);
    if ((st = label_name(s, l, p, n, number)))
        return st;
    p += n;
    next_word(&p, end);
    if (p < end && *p == '[') {
        const char *close = memchr(p, ']', (size_t)(end - p));
        if (!close)
            return err_set(s->e, E_DATA, "%s: line %ld: a bracket is not closed", s->name, s->line);
        const char *comma = memchr(p, ',', (size_t)(close - p));
        if ((st = set_text(s, &l->unit, p + 1, (size_t)((comma ? comma : close) - p - 1))))
            return st;
        if (comma) {
            const char *second = memchr(comma + 1, ',', (size_t)(close - comma - 1));
            size_t len = (size_t)((second ? second : close) - comma - 1);
            if ((l->type = type_from_tag(comma + 1, len)) < UNTYPED)
                return err_set(s->e, E_DATA, "%s: line %ld: type '%.*s' is unknown (i64, f64, f32, str16)", s->name,
                               s->line, (int)(len < 40 ? len : 40), comma + 1);
        }
        p = close + 1;
    }
    return set_text(s, &l->what, p, (size_t)(end - p));
}

/* "3 NAME description [unit]" (Source Extractor's way; ours too). */
static int header_numbered(struct lines *s, struct labels *h, int64_t number, const char *p, const char *end)
{
    struct label *l;
    int st = label_about(s, h, number, &l);
    size_t n = next_word(&p, end);
    if (st || n == 0 || (st = label_name(s, l, p, n, number)))
        return st;
    p += n;
    while (end > p && is_blank(end[-1]))
        end--;
    if (end > p && end[-1] == ']') {
        const char *open = end - 1;
        while (open > p && *open != '[')
            open--;
        if (*open == '[') {
            if ((st = set_text(s, &l->unit, open + 1, (size_t)(end - open - 2))))
                return st;
            end = open;
        }
    }
    return l->what && l->what[0] ? OK : set_text(s, &l->what, p, (size_t)(end - p));
}

/* Are all words of the line column names?  Then they replace the names known so far. */
static int header_names(struct lines *s, struct labels *h, const char *p, const char *end)
{
    char name[256];
    size_t count = 0, n;
    for (const char *q = p; (n = next_word(&q, end)); q += n, count++) {
        if (n >= sizeof name)
            return OK;
        memcpy(name, q, n);
        name[n] = '\0';
        if (!table_good_name(name))
            return OK;
    }
    if (count == 0)
        return OK;
    if (count > CELLS_MAX)
        return err_set(s->e, E_DATA, "%s: line %ld: more than %d columns", s->name, s->line, CELLS_MAX);
    struct label *l = calloc(count, sizeof *l);
    if (!l)
        return no_memory(s);
    for (size_t i = 0; i < h->n; i++)
        free(h->col[i].name);
    free(h->col);
    h->col = l;
    h->n = count;
    int st = OK;
    for (size_t i = 0; i < count && !st; i++) {
        n = next_word(&p, end);
        st = set_text(s, &l[i].name, p, n);
        p += n;
    }
    return st;
}

/* "NAME = VALUE" of a Keyword line. */
static int header_keyword(struct lines *s, struct table *t, const char *p, const char *end)
{
    size_t n = next_word(&p, end);
    const char *eq = p + n;
    char *name = NULL, *value = NULL;
    size_t one = next_word(&eq, end);
    if (n == 0 || one == 0 || *eq != '=')
        return err_set(s->e, E_DATA, "%s: line %ld: a Keyword line must be '# Keyword: NAME = VALUE'", s->name, s->line);
    int st = set_text(s, &name, p, n);
    if (!st)
        st = set_text(s, &value, eq + 1, (size_t)(end - eq - 1));
    if (!st && !table_good_name(name))
        st = err_set(s->e, E_DATA, "%s: line %ld: keyword '%.64s' is not in capital letters, digits and _", s->name, s->line, name);
    else if (!st && table_text(t, name))
        st = err_set(s->e, E_DATA, "%s: line %ld: keyword %s is given twice", s->name, s->line, name);
    else if (!st && table_set_text(t, name, value))
        st = no_memory(s);
    free(name);
    free(value);
    return st;
}

static int starts(const char *p, const char *end, const char *word)
{
    size_t n = strlen(word);
    return (size_t)(end - p) >= n && memcmp(p, word, n) == 0;
}

/* One line that begins with '#'; p is behind the '#'. */
static int header_line(struct lines *s, struct labels *h, struct table *t, const char *p, const char *end)
{
    int64_t number;
    size_t n = next_word(&p, end);
    if (n == 0)
        return OK;
    if (starts(p, end, "Keyword: "))
        return header_keyword(s, t, p + 9, end);
    if (starts(p, end, "HISTORY ")) {
        char *text = NULL;
        int st = set_text(s, &text, p + 8, (size_t)(end - p - 8));
        if (!st && table_history(t, text))
            st = no_memory(s);
        free(text);
        return st;
    }
    if (starts(p, end, "Column "))
        return header_typed(s, h, p + 7, end);
    if (table_scan_int(p, n, &number) == OK)
        return header_numbered(s, h, number, p + n, end);
    return header_names(s, h, p, end);
}

/* Without a line of names the numbered ones are taken; gaps belong to the column before. */
static int labels_from_numbers(struct lines *s, struct labels *h)
{
    if (!h->n_about)
        return err_set(s->e, E_DATA, "%s: no column names: the header needs a line '# NAME NAME ...' in capital letters", s->name);
    size_t base = 0;
    for (size_t i = 0; i < h->n_about; i++) {
        struct label *l = &h->about[i];
        char name[300];
        if (l->name) {
            if (!table_good_name(l->name))
                return err_set(s->e, E_DATA, "%s: column %zu: the name '%.64s' is not in capital letters, digits and _",
                               s->name, i + 1, l->name);
            base = i;
            continue;
        }
        if (i == 0)
            return err_set(s->e, E_DATA, "%s: the header does not name column 1", s->name);
        snprintf(name, sizeof name, "%.250s_%zu", h->about[base].name, i - base);
        int st = set_text(s, &l->name, name, strlen(name));
        if (st)
            return st;
    }
    h->col = h->about;
    h->n = h->n_about;
    h->about = NULL;
    h->n_about = 0;
    return OK;
}

/* Move what is known by number to the named columns. */
static int labels_join(struct lines *s, struct labels *h)
{
    if (h->n == 0)
        return labels_from_numbers(s, h);
    if (h->n_about > h->n)
        return err_set(s->e, E_DATA, "%s: the header describes %zu columns and names %zu", s->name, h->n_about, h->n);
    for (size_t i = 0; i < h->n; i++)
        h->col[i].type = UNTYPED;
    for (size_t i = 0; i < h->n_about; i++) {
        struct label *a = &h->about[i], *l = &h->col[i];
        if (!a->name)
            continue;
        if (strcmp(a->name, l->name) != 0)
            return err_set(s->e, E_DATA, "%s: the header calls column %zu both %.64s and %.64s", s->name, i + 1, a->name, l->name);
        l->unit = a->unit;
        l->what = a->what;
        l->type = a->type;
        a->unit = a->what = NULL;
    }
    return OK;
}

/* ---- rows ---- */

struct rows {
    struct lines *s;
    struct table *t;
    size_t ncol;             /* columns of the file; the table may have more behind them */
    double *ragged;          /* cells of one ragged row */
    size_t ragged_cap;
};

static int cell_error(struct lines *s, const char *column, const char *p, size_t n, const char *what)
{
    return err_set(s->e, E_DATA, "%s: line %ld: column %s: '%.*s' %s", s->name, s->line, column,
                   (int)(n < 60 ? n : 60), p, what);
}

/* The cell is not a number: say why. */
static int number_error(struct lines *s, const char *column, const char *p, size_t n, int st)
{
    return st == E_NOMEM ? no_memory(s)
         : cell_error(s, column, p, n, st == E_RANGE ? "is too large" : "is not a number");
}

static int count_error(const struct rows *r, size_t got)
{
    return err_set(r->s->e, E_DATA, "%s: line %ld: %zu cells where the header names %zu columns", r->s->name, r->s->line, got, r->ncol);
}

static size_t count_cells(const char *p, const char *end)
{
    size_t n, count = 0;
    for (; (n = next_word(&p, end)); p += n)
        count++;
    return count;
}

/* The cells of a ragged column to the end of the line. */
static int parse_ragged(struct rows *r, struct column *c, size_t row, const char *p, const char *end)
{
    size_t n, count = 0;
    for (; (n = next_word(&p, end)); p += n) {
        if (count == r->ragged_cap) {
            size_t cap = 2 * r->ragged_cap + 64;
            double *v = realloc(r->ragged, cap * sizeof *v);
            if (!v)
                return no_memory(r->s);
            r->ragged = v;
            r->ragged_cap = cap;
        }
        int st = table_scan_real(p, n, &r->ragged[count++]);
        if (st)
            return number_error(r->s, c->name, p, n, st);
    }
    if (count + r->ncol - 1 > CELLS_MAX)
        return err_set(r->s->e, E_DATA, "%s: line %ld: more than %d cells", r->s->name, r->s->line, CELLS_MAX);
    if (count == 0)
        return count_error(r, r->ncol - 1);
    if (table_ragged(r->t, c, row, r->ragged, count))
        return no_memory(r->s);
    r->s->held += 8.0 * (double)count;
    return OK;
}

static int parse_word(struct rows *r, struct column *c, size_t row, const char *p, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if ((unsigned char)p[i] < 32 || p[i] == 127 || p[0] == '#')
            return cell_error(r->s, c->name, p, n, "is not one plain word");
    char *w = strndup(p, n);
    if (!w)
        return no_memory(r->s);
    free(c->v.s[row]);
    c->v.s[row] = w;
    r->s->held += 32.0 + (double)n;
    return OK;
}

static int scan_real(const char *p, size_t n, enum col_type type, double *v)
{
    const int st = table_scan_real(p, n, v);
    if (st == OK && type == COL_REAL32)
        *v = table_as_float(*v);
    return st;
}

/* Make row `row`, and some more behind it: clearing many cells of a column at once is cheaper.  Of n rows, SIZE_MAX: of all. */
static int make_rows(struct rows *r, size_t row, size_t n)
{
    struct table *t = r->t;
    const size_t want = n - row > STEP ? row + STEP : n;
    if (want > t->cap) {
        const size_t more = t->cap + t->cap / 2, cap = n < SIZE_MAX ? n : more > want ? more : want;
        if ((double)cap * (double)(t->ncol + 1) * 8 + r->s->held + (double)r->s->cap > r->s->max_memory)
            return err_set(r->s->e, E_NOMEM, "%s: line %ld: needs more than --max-memory", r->s->name, r->s->line);
        if (table_reserve(t, cap))
            return no_memory(r->s);
    }
    return table_resize(t, want) ? no_memory(r->s) : OK;
}

/* The cells of a line as row `row` of the table. */
static int parse_row(struct rows *r, size_t row, const char *p, const char *end)
{
    struct table *t = r->t;
    size_t n, i;
    const char *line = p;
    for (i = 0; i < r->ncol; i++, p += n) {
        struct column *c = &t->col[i];
        if (c->type == COL_RAGGED)
            return parse_ragged(r, c, row, p, end);
        if (!(n = next_word(&p, end)))
            return count_error(r, i);
        int st = OK;
        if (c->type == COL_TEXT)
            st = parse_word(r, c, row, p, n);
        else if (c->type != COL_INT)
            st = scan_real(p, n, c->type, &c->v.r[row]);
        else if ((st = table_scan_int(p, n, &c->v.i[row])) == E_DATA)
            return cell_error(r->s, c->name, p, n, "is not a whole number");
        if (st)
            return c->type == COL_TEXT ? st : number_error(r->s, c->name, p, n, st);
    }
    if (next_word(&p, end))
        return count_error(r, count_cells(line, end));
    return OK;
}

/* A comment among the rows of ncol cells: only a second, different header is an error. */
static int check_comment(struct lines *s, const struct table *t, size_t ncol, const char *p, const char *end)
{
    size_t n = next_word(&p, end), i = 0;
    int other = 0;
    if (starts(p, end, "Column ") || starts(p, end, "Keyword: ") || starts(p, end, "HISTORY "))
        return OK;
    for (; n && i < ncol; i++) {
        char name[256];
        if (n >= sizeof name)
            return OK;
        memcpy(name, p, n);
        name[n] = '\0';
        if (!table_good_name(name))
            return OK;
        other |= strcmp(name, t->col[i].name) != 0;
        p += n;
        n = next_word(&p, end);
    }
    if (n == 0 && i == ncol && other)
        return err_set(s->e, E_DATA, "%s: line %ld: a second header with other columns", s->name, s->line);
    return OK;
}

/*
 * Read rows to the end of the file with what(ctx, begin, end).  `line` is the
 * first row (NULL: none).
 */
typedef int row_fn(void *ctx, const char *p, const char *end);

static int each_row(struct lines *s, const struct table *t, char *line, size_t len, row_fn *what, void *ctx)
{
    int st = OK;
    while (line && !st) {
        const char *p = line, *end = line + len;
        if (next_word(&p, end))
            st = *p == '#' ? check_comment(s, t, t->ncol, p + 1, end) : what(ctx, p, end);
        if (!st)
            st = lines_next(s, &line, &len);
    }
    return st;
}

/* ---- types from the cells ---- */

struct guess {
    struct lines *s;
    const struct labels *h;
    int ragged;              /* the last column is */
    struct { long word, number; int real; } *col;   /* first line with a word, with a number */
    char (*word)[64];        /* that word */
};

static int each_guess(void *ctx, const char *p, const char *end)
{
    struct guess *g = ctx;
    for (size_t i = 0, n; i < g->h->n - (size_t)g->ragged && (n = next_word(&p, end)); i++, p += n) {
        double v;
        int64_t k;
        if (g->h->col[i].type != UNTYPED)
            continue;
        if (table_scan_int(p, n, &k) != E_DATA) {
            g->col[i].number = g->s->line;
        } else if (table_scan_real(p, n, &v) != E_DATA) {
            g->col[i].number = g->s->line;
            g->col[i].real = 1;
        } else if (!g->col[i].word) {
            g->col[i].word = g->s->line;
            snprintf(g->word[i], sizeof g->word[i], "%.*s", (int)(n < 60 ? n : 60), p);
        }
    }
    return OK;
}

/* Where in the file the byte at `from` of the buffer is; -1 where the file cannot be read again from there. */
static off_t place_in_file(const struct lines *s, const char *from)
{
    const off_t read = s->gzip ? -1 : lseek(s->fd, 0, SEEK_CUR);
    return read < 0 ? -1 : read - (off_t)(s->end - (size_t)(from - s->buf));
}

/* Read on at `place`, which is before line `line`. */
static int read_again(struct lines *s, off_t place, long line)
{
    if (lseek(s->fd, place, SEEK_SET) < 0)
        return err_set(s->e, E_IO, "%s: %s", s->name, strerror(errno));
    s->begin = s->end = 0;
    s->eof = 0;
    s->line = line - 1;
    return OK;
}

/* Find the types of untyped columns from all rows; *line is the first row before and after. */
static int guess_types(struct lines *s, struct labels *h, const struct table *t, int ragged, char **line, size_t *len)
{
    struct guess g = {.s = s, .h = h, .ragged = ragged};
    g.col = calloc(h->n, sizeof *g.col);
    g.word = calloc(h->n, sizeof *g.word);
    size_t offset = (size_t)(*line - s->buf), behind = s->begin;
    long first = s->line;
    const off_t place = place_in_file(s, *line);
    if (place < 0)
        s->keep = offset;            /* a pipe: the rows stay in the buffer */
    int st = g.col && g.word ? each_row(s, t, *line, *len, each_guess, &g) : no_memory(s);
    for (size_t i = 0; i < h->n && !st; i++) {
        if (h->col[i].type != UNTYPED)
            continue;
        if (g.col[i].word && g.col[i].number) {
            s->line = g.col[i].word;
            st = cell_error(s, h->col[i].name, g.word[i], strlen(g.word[i]), "is not a number");
        }
        h->col[i].type = g.col[i].word ? COL_TEXT : g.col[i].real ? COL_REAL : COL_INT;
    }
    free(g.col);
    free(g.word);
    if (st)
        return st;
    if (place >= 0) {
        st = read_again(s, place, first);
        return st ? st : lines_next(s, line, len);
    }
    /* the buffer may have moved its first byte; bytes from keep on are all there */
    s->begin = s->keep + (behind - offset);
    s->line = first;
    *line = s->buf + s->keep;
    return OK;
}

/* ---- reading ---- */

static int add_columns(struct lines *s, const struct labels *h, struct table *t, int ragged)
{
    for (size_t i = 0; i < h->n; i++) {
        const struct label *l = &h->col[i];
        int last = ragged && i + 1 == h->n;
        if (table_find(t, l->name))
            return err_set(s->e, E_DATA, "%s: the header names column %s twice", s->name, l->name);
        if (strcmp(l->name, "HISTORY") == 0)
            return err_set(s->e, E_DATA, "%s: a column HISTORY: such a line of names would be one of history: call it otherwise", s->name);
        int type = last ? COL_RAGGED : l->type == UNTYPED ? COL_REAL : l->type;
        if (table_add(t, l->name, (enum col_type)type, l->unit, l->what))
            return err_set(s->e, E_NOMEM, "%s: %s", s->name, err_text(E_NOMEM));
    }
    return OK;
}

/* Header lines up to the first row, which is returned. */
static int read_header(struct lines *s, struct labels *h, struct table *t, char **line, size_t *len)
{
    for (;;) {
        int st = lines_next(s, line, len);
        if (st || !*line)
            return st;
        const char *p = *line, *end = *line + *len;
        if (!next_word(&p, end))
            continue;
        if (*p != '#')
            return OK;
        if ((st = header_line(s, h, t, p + 1, end)))
            return st;
    }
}

struct table_in {
    struct lines s;
    struct rows r;
    char *line;              /* of text: the next row, NULL at the end */
    size_t len;
    struct fits_in *fits;    /* instead of lines */
    struct fits_rows *rows;
};

/* The header of a text, up to its first row. */
static int open_text(struct table_in *in, struct table *t)
{
    struct lines *s = &in->s;
    struct labels h = {0};
    int st = read_header(s, &h, t, &in->line, &in->len);
    if (!st && !in->line && s->line == 0)
        st = err_set(s->e, E_DATA, "%s: the file is empty", s->name);
    if (!st)
        st = labels_join(s, &h);
    if (st) {
        labels_free(&h);
        return st;
    }
    int ragged = h.n && strcmp(h.col[h.n - 1].name, "COEFFS") == 0, open = 0;
    for (size_t i = 0; i < h.n; i++)
        open |= h.col[i].type == UNTYPED && !(ragged && i + 1 == h.n);
    if (open && in->line) {
        struct table names = {0};
        st = add_columns(s, &h, &names, ragged);
        if (!st)
            st = guess_types(s, &h, &names, ragged, &in->line, &in->len);
        if (st)
            in->line = NULL;
        table_free(&names);
    }
    if (!st)
        st = add_columns(s, &h, t, ragged);
    in->r = (struct rows){.s = s, .ncol = t->ncol};
    labels_free(&h);
    return st;
}

/* The next n rows of a text at most; t has none. */
static int text_rows(struct table_in *in, struct table *t, size_t n)
{
    size_t row = 0;
    int st = OK;
    in->r.t = t;
    while (in->line && !st && row < n) {
        const char *p = in->line, *end = in->line + in->len;
        if (next_word(&p, end) && *p == '#')
            st = check_comment(&in->s, t, in->r.ncol, p + 1, end);
        else if (p < end && (row < t->nrow || !(st = make_rows(&in->r, row, n))) && !(st = parse_row(&in->r, row, p, end)))
            row++;
        if (!st)
            st = lines_next(&in->s, &in->line, &in->len);
    }
    return !st && table_resize(t, row) ? no_memory(&in->s) : st;
}

/* Is there no file of this literal name, but "[...]" at its end? */
static int has_suffix_only(const char *name)
{
    size_t n = strlen(name);
    return n > 2 && name[n - 1] == ']' && strchr(name, '[') && access(name, F_OK) != 0;
}

/* An input that is FITS or gzip of anything: a FITS table, or text. */
static int open_source(struct table_in *in, struct table *t, struct source *src)
{
    unsigned char first = 0;
    uint64_t have;
    int st = source_need(src, 1, &have, in->s.e);
    if (!st && have)
        st = source_read(src, 0, &first, 1, in->s.e);
    if (!st && first == 'S') {
        st = fits_in_from(&in->fits, src, in->s.max_memory, in->s.e);
        return st ? st : fits_table_open(&in->rows, in->fits, t, in->s.e);
    }
    in->s.gzip = src;
    in->s.begin = in->s.end = 0;
    in->s.eof = 0;
    return st ? st : open_text(in, t);
}

/* What the first bytes, which are in the buffer, announce. */
static int open_any(struct table_in *in, struct table *t, const char *name)
{
    struct lines *s = &in->s;
    int gzip = s->end >= 2 && s->buf[0] == '\x1f' && s->buf[1] == '\x8b', fits = s->end >= 1 && s->buf[0] == 'S', st;
    struct source *src;
    if (!gzip && !fits)
        return open_text(in, t);
    if (strcmp(name, "-") == 0 && lseek(0, -(off_t)s->end, SEEK_CUR) < 0)
        st = source_open_begun(&src, s->buf, s->end, s->max_memory, s->e);
    else
        st = source_open(&src, name, s->max_memory, s->e);
    return st ? st : open_source(in, t, src);
}

int table_in_open(struct table_in **out, struct table *t, const char *name, double max_memory, struct err *e)
{
    struct table got = {0};
    int standard = strcmp(name, "-") == 0, st;
    *out = NULL;
    if (name[0] == '\0')
        return err_set(e, E_MISSING, "an empty file name");
    struct table_in *in = calloc(1, sizeof *in);
    if (!in)
        return err_set(e, E_NOMEM, "%s: %s", name, err_text(E_NOMEM));
    in->s = (struct lines){.fd = -1, .name = standard ? "standard input" : name, .keep = SIZE_MAX, .max_memory = max_memory, .e = e};
    if (!standard && has_suffix_only(name)) {
        st = fits_in_open(&in->fits, name, max_memory, e);
        if (!st)
            st = fits_table_open(&in->rows, in->fits, &got, e);
    } else if ((in->s.fd = standard ? STDIN_FILENO : file_open(name, O_RDONLY, 0)) < 0) {
        st = err_set(e, E_IO, "%s: %s", name, strerror(errno));
    } else {
        st = lines_fill(&in->s);
        if (!st)
            st = open_any(in, &got, name);
    }
    if (st) {
        table_in_close(in);
        table_free(&got);
        return st;
    }
    *out = in;
    *t = got;
    return OK;
}

int table_in_rows(struct table_in *in, struct table *t, size_t n, struct err *e)
{
    if (in->fits)
        return fits_table_rows(in->rows, t, n, e);
    in->s.e = e;
    in->s.held = 0;                 /* of the block before nothing stays */
    if (table_resize(t, 0))
        return no_memory(&in->s);
    return text_rows(in, t, n);
}

double table_in_part(const struct table_in *in)
{
    const struct lines *s = &in->s;
    struct stat sb;
    if (in->rows)
        return fits_table_part(in->rows);
    const off_t read = s->gzip ? -1 : lseek(s->fd, 0, SEEK_CUR);
    if (read < 0 || fstat(s->fd, &sb) || sb.st_size < 1)
        return 0;
    return (double)(read - (off_t)(s->end - s->begin)) / (double)sb.st_size;
}

void table_in_close(struct table_in *in)
{
    if (!in)
        return;
    fits_table_close(in->rows);
    if (in->fits)
        fits_in_close(in->fits);
    if (in->s.gzip)
        source_close(in->s.gzip);
    if (in->s.fd > STDIN_FILENO)
        close(in->s.fd);
    free(in->r.ragged);
    free(in->s.buf);
    free(in);
}

size_t table_block_rows(const struct table *t)
{
    size_t width = 8 * (t->ncol + 1), rows;
    if (t->ncol && t->col[t->ncol - 1].type == COL_RAGGED)
        width += 8 * CELLS_MAX;
    rows = ((size_t)1 << 20) / width;
    return rows > 64 ? rows : 64;
}

int table_read(struct table *t, const char *name, double max_memory, struct err *e)
{
    struct table got = {0};
    struct table_in *in;
    int st = table_in_open(&in, &got, name, max_memory, e);
    if (!st)
        st = table_in_rows(in, &got, SIZE_MAX, e);
    table_in_close(in);
    if (st)
        table_free(&got);
    else
        *t = got;
    return st;
}
