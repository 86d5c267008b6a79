/*
 * table.c - named columns in memory, keywords, history, and the conversion
 * between numbers and text that catalogues use.
 *
 * Text to number is exact: up to 15 digits and powers of ten up to 22 by one
 * correctly rounded operation, up to 19 digits by decimal.h, the rest by the C library.  Number to
 * text gives as few digits as read back to the same bits.  Nothing depends on
 * the locale as long as no program sets one.
 */
#include "table.h"
#include "decimal.h"
#include <assert.h>
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- numbers ---- */

static const double ten_to[23] = {
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11,
    1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22
};

static int is_digit(char c)
{
    return c >= '0' && c <= '9';
}

/* The slow way, for a token whose form has been checked. */
static int scan_library(const char *text, size_t len, double *value)
{
    char small[128], *s = small;
    if (len >= sizeof small && !(s = malloc(len + 1)))
        return E_NOMEM;
    memcpy(s, text, len);
    s[len] = '\0';
    double v = strtod(s, NULL);
    if (s != small)
        free(s);
    if (!isfinite(v))
        return E_RANGE;
    *value = v;
    return OK;
}

int table_scan_int(const char *text, size_t len, int64_t *value)
{
    size_t i = len > 0 && (text[0] == '-' || text[0] == '+');
    int minus = i && text[0] == '-', big = 0;
    uint64_t v = 0, limit = (uint64_t)INT64_MAX + (uint64_t)minus;
    if (i == len)
        return E_DATA;
    for (; i < len; i++) {
        if (!is_digit(text[i]))
            return E_DATA;
        unsigned d = (unsigned)(text[i] - '0');
        if (v > (limit - d) / 10)
            big = 1;
        else
            v = 10 * v + d;
    }
    if (big)
        return E_RANGE;
    *value = minus ? (int64_t)(0 - v) : (int64_t)v;
    return OK;
}

int table_scan_real(const char *text, size_t len, double *value)
{
    size_t i = len > 0 && (text[0] == '-' || text[0] == '+');
    int minus = i && text[0] == '-';
    if (len - i == 3 && (text[i] | 32) == 'n' && (text[i + 1] | 32) == 'a' && (text[i + 2] | 32) == 'n') {
        *value = (double)NAN;
        return OK;
    }
    uint64_t m = 0;
    int digits = 0, kept = 0;       /* digits seen; digits in m after leading zeros */
    long e10 = 0;
    for (int point = 0; i < len; i++) {
        if (is_digit(text[i])) {
            digits++;
            if (kept < 19 && (kept || text[i] != '0')) {
                m = 10 * m + (uint64_t)(text[i] - '0');
                kept++;
            } else if (kept) {
                kept++;             /* too many for m: the library decides */
            }
            e10 -= point;
        } else if (text[i] == '.' && !point) {
            point = 1;
        } else {
            break;
        }
    }
    if (!digits)
        return E_DATA;
    if (i < len) {
        if ((text[i] | 32) != 'e' || ++i == len)
            return E_DATA;
        int down = text[i] == '-';
        long e = 0;
        if (text[i] == '-' || text[i] == '+')
            i++;
        if (i == len)
            return E_DATA;
        for (; i < len; i++) {
            if (!is_digit(text[i]))
                return E_DATA;
            if (e < 100000)
                e = 10 * e + (text[i] - '0');
        }
        e10 += down ? -e : e;
    }
    double v;
    if (m == 0)
        v = 0;
    else if (kept <= 19 && m <= (UINT64_C(1) << 53) && e10 >= -22 && e10 <= 22)
        v = e10 < 0 ? (double)m / ten_to[-e10] : (double)m * ten_to[e10];
    else if (kept > 19 || decimal_value(m, e10, &v))
        return scan_library(text, len, value);
    *value = minus ? -v : v;
    return OK;
}

double table_as_float(double v)
{
    return fabs(v) <= (double)FLT_MAX ? (double)(float)v : v;
}

size_t table_print_int(char *to, int64_t x)
{
    char back[24];
    size_t n = 0, k = 0;
    uint64_t v = x < 0 ? 0 - (uint64_t)x : (uint64_t)x;
    if (x < 0)
        to[n++] = '-';
    do
        back[k++] = (char)('0' + v % 10);
    while (v /= 10);
    while (k)
        to[n++] = back[--k];
    return n;
}

/*
 * The decimal n * 10^-p (n of at most `digits` digits, its first one standing
 * for 10^e), as %g prints it.
 */
static size_t print_decimal(char *to, int minus, uint64_t n, int digits, int e)
{
    char d[24];
    size_t k = 0;
    for (int i = digits; i-- > 0; n /= 10)
        d[i] = (char)('0' + n % 10);
    while (digits > 1 && d[digits - 1] == '0')
        digits--;
    if (minus)
        to[k++] = '-';
    if (e < -4 || e >= 15) {
        to[k++] = d[0];
        if (digits > 1) {
            to[k++] = '.';
            for (int i = 1; i < digits; i++)
                to[k++] = d[i];
        }
        to[k++] = 'e';
        to[k++] = e < 0 ? '-' : '+';
        int a = abs(e);
        if (a >= 100)
            to[k++] = (char)('0' + a / 100);
        to[k++] = (char)('0' + a / 10 % 10);
        to[k++] = (char)('0' + a % 10);
    } else if (e < 0) {
        to[k++] = '0';
        to[k++] = '.';
        for (int i = -1; i > e; i--)
            to[k++] = '0';
        for (int i = 0; i < digits; i++)
            to[k++] = d[i];
    } else {
        for (int i = 0; i <= e || i < digits; i++) {
            if (i == e + 1)
                to[k++] = '.';
            to[k++] = i < digits ? d[i] : '0';
        }
    }
    return k;
}

/* floor(log10(a)) for 1e-7 <= a < 1e15, exact because the powers used are doubles compared as such. */
static int decade(double a)
{
    int e = 0;
    while (e < 15 && a >= ten_to[e + 1])
        e++;
    if (a < 1)
        for (e = -1; e > -8 && a * ten_to[-e] < 1; e--)
            ;
    return e;
}

size_t table_print_real(char *to, double x)
{
    double a = fabs(x);
    if (a == 0) {
        memcpy(to, "-0", 2);
        if (signbit(x))
            return 2;
        to[0] = '0';
        return 1;
    }
    struct decimal d;
    if (decimal_of(a, &d) == OK)
        return print_decimal(to, x < 0, d.n, d.digits, d.e);
    char s[TABLE_PRINT + 8];
    int len = 0;
    for (int digits = 15; digits <= 17; digits++) {
        len = snprintf(s, sizeof s, "%.*g", digits, x);
        if (digits == 17 || !isfinite(x) || strtod(s, NULL) == x)
            break;
    }
    if (!isfinite(x))
        len = snprintf(s, sizeof s, "nan");
    memcpy(to, s, (size_t)len);
    return (size_t)len;
}

size_t table_print_real32(char *to, double x)
{
    double a = fabs(x);
    if (a >= 1e-5 && a < 1e9) {
        int e = decade(a), p = 8 - e;
        double y = a * ten_to[p], n = floor(y), part = y - n;
        if (fabs(part - 0.5) > 1e-5) {      /* y is right to 1e-7: the rounding is certain */
            n += part > 0.5;
            if (n >= 1e9) {
                n /= 10;
                e++;
            }
            if (n >= 1e8 && e < 9)
                return print_decimal(to, x < 0, (uint64_t)n, 9, e);
        }
    }
    char s[TABLE_PRINT + 8];
    int len = isfinite(x) ? snprintf(s, sizeof s, "%.9g", x) : snprintf(s, sizeof s, "nan");
    memcpy(to, s, (size_t)len);
    return (size_t)len;
}

/* ---- columns ---- */

static void words_free(struct column *c, size_t from, size_t to)
{
    for (size_t i = from; i < to; i++)
        free(c->v.s[i]);
}

static void column_free(struct column *c, size_t nrow)
{
    if (c->type == COL_TEXT && c->v.s)
        words_free(c, 0, nrow);
    free(c->v.r);
    free(c->start);
    free(c->name);
    free(c->unit);
    free(c->what);
}

void table_free(struct table *t)
{
    for (size_t i = 0; i < t->ncol; i++)
        column_free(&t->col[i], t->nrow);
    for (size_t i = 0; i < t->nkey; i++) {
        free(t->key[i].name);
        free(t->key[i].value);
    }
    for (size_t i = 0; i < t->nhistory; i++)
        free(t->history[i]);
    free(t->col);
    free(t->key);
    free(t->history);
    *t = (struct table){0};
}

void table_keep_columns(struct table *t, const unsigned char *keep)
{
    size_t n = 0;
    for (size_t i = 0; i < t->ncol; i++)
        if (keep[i])
            t->col[n++] = t->col[i];
        else
            column_free(&t->col[i], t->nrow);
    t->ncol = n;
}

/* Room for `cap` rows; cells beyond the rows in use are undefined. */
static int column_reserve(struct column *c, size_t cap)
{
    if (cap > SIZE_MAX / 16)
        return E_NOMEM;
    if (c->type == COL_RAGGED) {
        size_t *start = realloc(c->start, (cap + 1) * sizeof *start);
        if (!start)
            return E_NOMEM;
        if (!c->start)
            start[0] = 0;
        c->start = start;
        return OK;
    }
    double *v = realloc(c->v.r, (cap ? cap : 1) * sizeof *v);
    if (!v)
        return E_NOMEM;
    c->v.r = v;
    return OK;
}

/* Give the rows from..to-1 their first value. Words already made are freed on failure. */
static int column_clear(struct column *c, size_t from, size_t to)
{
    for (size_t i = from; i < to; i++) {
        if (c->type == COL_INT) {
            c->v.i[i] = 0;
        } else if (c->type == COL_RAGGED) {
            c->start[i + 1] = c->start[i];
        } else if (c->type == COL_TEXT) {
            if (!(c->v.s[i] = strdup(""))) {
                words_free(c, from, i);
                return E_NOMEM;
            }
        } else {
            c->v.r[i] = (double)NAN;
        }
    }
    return OK;
}

int table_good_name(const char *s)
{
    if (!(s[0] >= 'A' && s[0] <= 'Z'))
        return 0;
    for (; *s; s++)
        if (!((*s >= 'A' && *s <= 'Z') || is_digit(*s) || *s == '_'))
            return 0;
    return 1;
}

int table_add(struct table *t, const char *name, enum col_type type, const char *unit, const char *what)
{
    if (!table_good_name(name) || table_find(t, name))
        return E_RANGE;
    if (t->ncol && t->col[t->ncol - 1].type == COL_RAGGED)
        return E_RANGE;                     /* a ragged column is the last one */
    struct column *col = realloc(t->col, (t->ncol + 1) * sizeof *col);
    if (!col)
        return E_NOMEM;
    t->col = col;
    struct column c = {.type = type};
    c.name = strdup(name);
    c.unit = strdup(unit ? unit : "");
    c.what = strdup(what ? what : "");
    if (!c.name || !c.unit || !c.what || column_reserve(&c, t->cap > t->nrow ? t->cap : t->nrow)
        || column_clear(&c, 0, t->nrow)) {
        column_free(&c, 0);
        return E_NOMEM;
    }
    t->col[t->ncol++] = c;
    return OK;
}

int table_reserve(struct table *t, size_t cap)
{
    if (cap <= t->cap)
        return OK;
    for (size_t i = 0; i < t->ncol; i++)
        if (column_reserve(&t->col[i], cap))
            return E_NOMEM;
    t->cap = cap;
    return OK;
}

int table_resize(struct table *t, size_t nrow)
{
    const size_t more = t->cap + t->cap / 2;
    if (nrow > t->cap && table_reserve(t, more > nrow ? more : nrow))
        return E_NOMEM;
    for (size_t i = 0; i < t->ncol && nrow > t->nrow; i++)
        if (column_clear(&t->col[i], t->nrow, nrow)) {
            while (i-- > 0)
                if (t->col[i].type == COL_TEXT)
                    words_free(&t->col[i], t->nrow, nrow);
            return E_NOMEM;
        }
    for (size_t i = 0; i < t->ncol && nrow < t->nrow; i++)
        if (t->col[i].type == COL_TEXT)
            words_free(&t->col[i], nrow, t->nrow);
    t->nrow = nrow;
    return OK;
}

struct column *table_find(const struct table *t, const char *name)
{
    for (size_t i = 0; i < t->ncol; i++)
        if (strcmp(t->col[i].name, name) == 0)
            return &t->col[i];
    return NULL;
}

double *table_reals(const struct table *t, const char *name)
{
    struct column *c = table_find(t, name);
    return c && (c->type == COL_REAL || c->type == COL_REAL32) ? c->v.r : NULL;
}

int64_t *table_ints(const struct table *t, const char *name)
{
    struct column *c = table_find(t, name);
    return c && c->type == COL_INT ? c->v.i : NULL;
}

double table_number(const struct column *c, size_t row)
{
    if (c->type == COL_INT)
        return (double)c->v.i[row];
    return c->type == COL_REAL || c->type == COL_REAL32 ? c->v.r[row] : (double)NAN;
}

int table_set_word(struct column *c, size_t row, const char *text)
{
    char *s = strdup(text);
    if (!s)
        return E_NOMEM;
    free(c->v.s[row]);
    c->v.s[row] = s;
    return OK;
}

int table_ragged(struct table *t, struct column *c, size_t row, const double *v, size_t n)
{
    if (c->type != COL_RAGGED || row >= t->nrow)
        return E_RANGE;
    size_t used = c->start[row];
    if (n > SIZE_MAX / 32 - used)
        return E_NOMEM;
    if (used + n > c->room || !c->v.r) {
        size_t room = c->room + c->room / 2;
        room = room > used + n ? room : used + n;
        double *r = realloc(c->v.r, (room ? room : 1) * sizeof *r);
        if (!r)
            return E_NOMEM;
        c->v.r = r;
        c->room = room;
    }
    if (n)
        memcpy(c->v.r + used, v, n * sizeof *v);
    c->start[row + 1] = used + n;
    return OK;
}

static void column_keep(struct column *c, size_t nrow, const unsigned char *keep)
{
    size_t k = 0;
    for (size_t i = 0; i < nrow; i++) {
        if (!keep[i]) {
            if (c->type == COL_TEXT)
                free(c->v.s[i]);
            continue;
        }
        if (c->type == COL_RAGGED) {
            size_t from = c->start[i], n = c->start[i + 1] - from;
            if (n)
                memmove(c->v.r + c->start[k], c->v.r + from, n * sizeof *c->v.r);
            /* start[k+1] <= start[i+1], which was read: nothing unread is overwritten */
            c->start[k + 1] = c->start[k] + n;
        } else if (c->type == COL_TEXT) {
            c->v.s[k] = c->v.s[i];
        } else if (c->type == COL_INT) {
            c->v.i[k] = c->v.i[i];
        } else {
            c->v.r[k] = c->v.r[i];
        }
        k++;
    }
}

int table_keep(struct table *t, const unsigned char *keep)
{
    size_t n = 0;
    for (size_t i = 0; i < t->nrow; i++)
        n += keep[i] != 0;
    for (size_t i = 0; i < t->ncol; i++)
        column_keep(&t->col[i], t->nrow, keep);
    t->nrow = n;
    return OK;
}

static int column_copy(struct column *to, const struct column *from, size_t nrow)
{
    if (from->type == COL_RAGGED) {
        size_t n = from->start[nrow];
        memcpy(to->start, from->start, (nrow + 1) * sizeof *to->start);
        if (n) {
            if (!(to->v.r = malloc(n * sizeof *to->v.r)))
                return E_NOMEM;
            memcpy(to->v.r, from->v.r, n * sizeof *to->v.r);
        }
        to->room = n;
    } else if (from->type == COL_TEXT) {
        for (size_t i = 0; i < nrow; i++)
            if (table_set_word(to, i, from->v.s[i]))
                return E_NOMEM;
    } else if (nrow) {
        memcpy(to->v.r, from->v.r, nrow * sizeof *to->v.r);
    }
    return OK;
}

int table_copy(struct table *to, const struct table *from)
{
    struct table t = {0};
    int st = table_resize(&t, from->nrow);
    for (size_t i = 0; i < from->ncol && !st; i++) {
        const struct column *c = &from->col[i];
        if (!(st = table_add(&t, c->name, c->type, c->unit, c->what)))
            st = column_copy(&t.col[i], c, from->nrow);
    }
    for (size_t i = 0; i < from->nkey && !st; i++)
        st = table_set_text(&t, from->key[i].name, from->key[i].value);
    for (size_t i = 0; i < from->nhistory && !st; i++)
        st = table_history(&t, from->history[i]);
    if (st)
        table_free(&t);
    *to = t;
    return st;
}

/* ---- keywords and history ---- */

static struct keyword *key_find(const struct table *t, const char *name)
{
    for (size_t i = 0; i < t->nkey; i++)
        if (strcmp(t->key[i].name, name) == 0)
            return &t->key[i];
    return NULL;
}

int table_set_text(struct table *t, const char *name, const char *value)
{
    char *v = strdup(value);
    if (!v)
        return E_NOMEM;
    struct keyword *k = key_find(t, name);
    if (k) {
        free(k->value);
        k->value = v;
        return OK;
    }
    char *n = strdup(name);
    k = realloc(t->key, (t->nkey + 1) * sizeof *k);
    if (k)
        t->key = k;
    if (!n || !k) {
        free(n);
        free(v);
        return E_NOMEM;
    }
    t->key[t->nkey++] = (struct keyword){n, v};
    return OK;
}

int table_set_number(struct table *t, const char *name, double value)
{
    char s[TABLE_PRINT + 1];
    s[table_print_real(s, value)] = '\0';
    return table_set_text(t, name, s);
}

const char *table_text(const struct table *t, const char *name)
{
    const struct keyword *k = key_find(t, name);
    return k ? k->value : NULL;
}

int table_key_number(const struct table *t, const char *name, double *value)
{
    const struct keyword *k = key_find(t, name);
    double v;
    if (!k)
        return E_MISSING;
    if (table_scan_real(k->value, strlen(k->value), &v) || !isfinite(v))
        return E_DATA;
    *value = v;
    return OK;
}

int table_history(struct table *t, const char *line)
{
    char *s = strdup(line);
    char **h = realloc(t->history, (t->nhistory + 1) * sizeof *h);
    if (h)
        t->history = h;
    if (!s || !h) {
        free(s);
        return E_NOMEM;
    }
    t->history[t->nhistory++] = s;
    return OK;
}
