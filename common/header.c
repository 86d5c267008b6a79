/*
 * header.c - FITS header cards in memory.
 *
 * A card is "KEYWORD = value / comment" in 80 columns (FITS 4.0, section 4);
 * names of more than eight characters or with small letters are kept under the
 * HIERARCH convention, text that does not fit one card under CONTINUE.
 * Numbers are read whole or refused; they are written so that the same bits
 * come back.
 */
#include "header.h"
#include <ctype.h>
#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 80, NAME = 8, TEXT = 67, HISTORY_TEXT = 72 };

void header_free(struct header *h)
{
    free(h->card);
    *h = (struct header){0};
}

int header_copy(struct header *to, const struct header *from)
{
    struct header h = {0};
    if (from->n) {
        h.card = malloc(from->n * sizeof *h.card);
        if (!h.card)
            return E_NOMEM;
        memcpy(h.card, from->card, from->n * sizeof *h.card);
        h.n = h.cap = from->n;
    }
    *to = h;
    return OK;
}

/* Room for `more` cards. */
static int grow(struct header *h, size_t more)
{
    if (h->cap - h->n >= more)
        return OK;
    size_t cap = h->cap ? h->cap : 36;
    while (cap - h->n < more)
        cap *= 2;
    void *p = realloc(h->card, cap * sizeof *h->card);
    if (!p)
        return E_NOMEM;
    h->card = p;
    h->cap = cap;
    return OK;
}

/* Copy to exactly 80 printable characters. */
static void fill(char card[81], const char *text)
{
    size_t n = strnlen(text, WIDTH);
    for (size_t i = 0; i < n; i++)
        card[i] = text[i] >= ' ' && text[i] <= '~' ? text[i] : '?';
    memset(card + n, ' ', WIDTH - n);
    card[WIDTH] = 0;
}

int header_append(struct header *h, const char *card)
{
    if (strnlen(card, WIDTH + 1) > WIDTH)
        return E_RANGE;
    int st = grow(h, 1);
    if (st == OK)
        fill(h->card[h->n++], card);
    return st;
}

/* ---- finding and reading ---- */

static int named(const char *card, const char *key)
{
    size_t n = strlen(key);
    if (n <= NAME && !memcmp(card, key, n)) {
        size_t i = n;
        while (i < NAME && card[i] == ' ')
            i++;
        if (i == NAME)
            return 1;
    }
    if (memcmp(card, "HIERARCH ", 9))
        return 0;
    const char *p = card + 9, *eq = strchr(p, '=');
    while (*p == ' ')
        p++;
    if (!eq || eq < p)
        return 0;
    while (eq > p && eq[-1] == ' ')
        eq--;
    return (size_t)(eq - p) == n && !memcmp(p, key, n);
}

static int is_continue(const char *card)
{
    return !memcmp(card, "CONTINUE  ", 10);
}

static size_t find(const struct header *h, const char *key)
{
    size_t i = 0;
    while (i < h->n && !named(h->card[i], key))
        i++;
    return i;
}

/* Text after "= ", NULL when the card has no value. */
static const char *value_of(const char *card)
{
    if (!memcmp(card, "HIERARCH ", 9)) {
        const char *eq = strchr(card, '=');
        return eq ? eq + 1 : NULL;
    }
    return card[8] == '=' && card[9] == ' ' ? card + 10 : NULL;
}

/* The value of `key` that is not text, without blanks round it. */
static int token(const struct header *h, const char *key, char out[81])
{
    size_t i = find(h, key);
    const char *v = i < h->n ? value_of(h->card[i]) : NULL;
    if (!v)
        return E_MISSING;
    while (*v == ' ')
        v++;
    if (*v == '\'')
        return E_DATA;
    size_t n = strcspn(v, "/");
    while (n && v[n - 1] == ' ')
        n--;
    if (n == 0)
        return E_MISSING;
    memcpy(out, v, n);
    out[n] = 0;
    return OK;
}

/* A decimal number that fills the text; Fortran's D exponent is read. */
static int decimal(char *s, double *value)
{
    const char *p = s + strspn(s, "+-");
    if (p - s > 1 || !(isdigit((unsigned char)*p) || *p == '.'))
        return E_DATA;
    if (strspn(s, "0123456789+-.EeDd") != strlen(s))
        return E_DATA;
    for (char *q = s; *q; q++)
        if (*q == 'D' || *q == 'd')
            *q = 'E';
    char *end;
    double v = strtod(s, &end);
    if (*end || end == s || !isfinite(v))
        return E_DATA;
    *value = v;
    return OK;
}

int header_double(const struct header *h, const char *key, double *value)
{
    char t[81];
    int st = token(h, key, t);
    return st ? st : decimal(t, value);
}

int header_long(const struct header *h, const char *key, long *value)
{
    char t[81], *end;
    int st = token(h, key, t);
    if (st)
        return st;
    if (strspn(t + strspn(t, "+-"), "0123456789") + strspn(t, "+-") == strlen(t)) {
        errno = 0;
        long v = strtol(t, &end, 10);
        if (errno || *end || end == t)
            return E_DATA;
        *value = v;
        return OK;
    }
    double d;
    st = decimal(t, &d);
    if (st)
        return st;
    if (!(fabs(d) <= 9007199254740992.0) || d != floor(d))
        return E_DATA;
    *value = (long)d;
    return OK;
}

int header_bool(const struct header *h, const char *key, int *value)
{
    char t[81];
    int st = token(h, key, t);
    if (st)
        return st;
    if (strcmp(t, "T") && strcmp(t, "F"))
        return E_DATA;
    *value = t[0] == 'T';
    return OK;
}

/* Text between quotes into out (at least 81 bytes); E_DATA without a closing quote. */
static int quoted(const char *v, char *out)
{
    while (*v == ' ')
        v++;
    if (*v == 0 || *v == '/')
        return E_MISSING;
    if (*v++ != '\'')
        return E_DATA;
    size_t n = 0;
    for (; *v; v++) {
        if (*v == '\'' && *++v != '\'') {
            while (n && out[n - 1] == ' ')
                n--;
            out[n] = 0;
            return OK;
        }
        out[n++] = *v;
    }
    return E_DATA;
}

int header_str(const struct header *h, const char *key, char *value, size_t size)
{
    char part[81];
    size_t i = find(h, key), n = 0;
    const char *v = i < h->n ? value_of(h->card[i]) : NULL;
    if (!v)
        return E_MISSING;
    int st = quoted(v, part);
    if (st)
        return st;
    if (size == 0)
        return E_RANGE;
    for (;;) {
        size_t len = strlen(part);
        int more = len && part[len - 1] == '&' && i + 1 < h->n && is_continue(h->card[i + 1]);
        len -= (size_t)more;
        if (len > size - 1 - n)
            len = size - 1 - n;
        memcpy(value + n, part, len);
        n += len;
        if (!more || quoted(h->card[++i] + 10, part))
            break;
    }
    value[n] = 0;
    return OK;
}

double header_double_or(const struct header *h, const char *key, double otherwise)
{
    double v;
    return header_double(h, key, &v) == OK ? v : otherwise;
}

/* ---- changing ---- */

/* Drop n cards from index i. */
static void drop(struct header *h, size_t i, size_t n)
{
    memmove(h->card + i, h->card + i + n, (h->n - i - n) * sizeof *h->card);
    h->n -= n;
}

static size_t with_continues(const struct header *h, size_t i)
{
    size_t n = 1;
    while (i + n < h->n && is_continue(h->card[i + n]))
        n++;
    return n;
}

void header_remove(struct header *h, const char *key)
{
    size_t len = strlen(key);
    int star = len && key[len - 1] == '*';
    for (size_t i = 0; i < h->n;)
        if (star ? !strncmp(h->card[i], key, len - 1) : named(h->card[i], key))
            drop(h, i, with_continues(h, i));
        else
            i++;
}

/* Put n cards in the place of the first card named key, or at the end. */
static int replace(struct header *h, const char *key, char (*card)[81], size_t n)
{
    int st = grow(h, n);
    if (st)
        return st;
    size_t at = find(h, key);
    header_remove(h, key);
    if (at > h->n)
        at = h->n;
    memmove(h->card + at + n, h->card + at, (h->n - at) * sizeof *h->card);
    memcpy(h->card + at, card, n * sizeof *card);
    h->n += n;
    return OK;
}

/* "KEY     = " or "HIERARCH key = "; its length, 0 when key cannot be a name. */
static int opening(char out[81], const char *key)
{
    size_t n = strlen(key);
    if (n == 0 || n > 60)
        return 0;
    if (n <= NAME && strspn(key, "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") == n)
        return snprintf(out, 81, "%-8s= ", key);
    for (size_t i = 0; i < n; i++)
        if (key[i] < ' ' || key[i] > '~' || key[i] == '=' || key[i] == '/' || key[i] == '\'')
            return 0;
    if (key[0] == ' ' || key[n - 1] == ' ')
        return 0;
    return snprintf(out, 81, "HIERARCH %s = ", key);
}

/* Value as in the card; comment cut at column 80. */
static int set(struct header *h, const char *key, const char *value, int left, const char *comment)
{
    char text[512], open[81];
    char card[1][81];
    int n = opening(open, key);
    if (n == 0)
        return E_RANGE;
    const char *format = n > 10 ? "%s%s%s%s" : left ? "%s%-20s%s%s" : "%s%20s%s%s";
    if ((size_t)n + strlen(value) > WIDTH)
        return E_RANGE;
    snprintf(text, sizeof text, format, open, value, comment && *comment ? " / " : "",
             comment ? comment : "");
    text[WIDTH] = 0;
    fill(card[0], text);
    return replace(h, key, card, 1);
}

int header_set_double(struct header *h, const char *key, double v, const char *comment)
{
    char s[40], text[48];
    if (!isfinite(v))
        return E_RANGE;
    for (int digits = 15; digits <= 17; digits++) {
        snprintf(s, sizeof s, "%.*G", digits, v);
        if (strtod(s, NULL) == v)
            break;
    }
    /* a real number shows a point, also before an exponent */
    size_t mantissa = strcspn(s, "E");
    int point = strcspn(s, ".") < mantissa;
    snprintf(text, sizeof text, "%.*s%s%s", (int)mantissa, s, point ? "" : ".0", s + mantissa);
    return set(h, key, text, 0, comment);
}

int header_set_long(struct header *h, const char *key, long v, const char *comment)
{
    char text[32];
    snprintf(text, sizeof text, "%ld", v);
    return set(h, key, text, 0, comment);
}

int header_set_bool(struct header *h, const char *key, int v, const char *comment)
{
    return set(h, key, v ? "T" : "F", 0, comment);
}

/* Length of the longest start of v whose quoted form has at most `room` characters. */
static size_t fits(const char *v, size_t room)
{
    size_t n = 0, used = 0;
    for (; v[n]; n++) {
        used += v[n] == '\'' ? 2 : 1;
        if (used > room)
            break;
    }
    return n;
}

static void quote(char *out, const char *v, size_t n, const char *end)
{
    *out++ = '\'';
    for (size_t i = 0; i < n; i++) {
        if (v[i] == '\'')
            *out++ = '\'';
        *out++ = v[i];
    }
    memcpy(out, end, strlen(end) + 1);
}

int header_set_str(struct header *h, const char *key, const char *v, const char *comment)
{
    char open[81], text[256], value[160];
    int n = opening(open, key);
    if (n == 0)
        return E_RANGE;
    size_t room = (size_t)(WIDTH - n - 2);
    if (fits(v, room) == strlen(v)) {
        quote(value, v, strlen(v), "");
        size_t len = strlen(value);
        while (len < 9)                       /* at least eight characters in quotes */
            value[len++] = ' ';
        memcpy(value + len, "'", 2);
        if ((size_t)n + strlen(value) > WIDTH)
            quote(value, v, strlen(v), "'");
        return set(h, key, value, 1, comment);
    }
    if (n > 10)
        return E_RANGE;                       /* CONTINUE does not go with HIERARCH */

    size_t cap = strlen(v) / (TEXT / 2) + 2, k = 0;
    char (*card)[81] = malloc(cap * sizeof *card);
    if (!card)
        return E_NOMEM;
    while (*v) {
        size_t part = fits(v, TEXT);
        quote(value, v, part, v[part] ? "&'" : "'");
        snprintf(text, sizeof text, "%s%s", k ? "CONTINUE  " : open, value);
        fill(card[k++], text);
        v += part;
    }
    int st = replace(h, key, card, k);
    free(card);
    return st;
}

int header_history(struct header *h, const char *text)
{
    size_t before = h->n;
    while (*text) {
        size_t line = strcspn(text, "\n"), n = line;
        if (n > HISTORY_TEXT) {
            n = HISTORY_TEXT;
            while (n && text[n] != ' ')
                n--;
            if (n == 0)
                n = HISTORY_TEXT;
        }
        char card[81];
        snprintf(card, sizeof card, "HISTORY %.*s", (int)n, text);
        int st = header_append(h, card);
        if (st) {
            h->n = before;
            return st;
        }
        text += n;
        while (n < line && *text == ' ')
            text++;
        if (*text == '\n')
            text++;
    }
    return OK;
}
