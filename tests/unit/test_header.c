/* test_header.c - cards: what is read, what is refused, what comes back. */
#include "check.h"
#include "header.h"
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static struct header of(const char *card)
{
    struct header h = {0};
    if (header_append(&h, card))
        abort();
    return h;
}

/* ---- values as other programs write them ---- */

static void test_doubles(void)
{
    static const struct {
        const char *card;
        int status;
        double value;
    } t[] = {
        {"KEY     =                  1.5", OK, 1.5},
        {"KEY     = 1.5", OK, 1.5},
        {"KEY     =       -1.25E-3 / comment", OK, -1.25e-3},
        {"KEY     = 1.0D2", OK, 100},
        {"KEY     = 1d-2/c", OK, 0.01},
        {"KEY     = +.5", OK, 0.5},
        {"KEY     = 7", OK, 7},
        {"KEY     = 0.1", OK, 0.1},
        {"KEY     = 4.9406564584124654E-324", OK, 0x1p-1074},
        {"KEY     = 1.5abc", E_DATA, 0},
        {"KEY     = 1.5 2", E_DATA, 0},
        {"KEY     = 1e400", E_DATA, 0},
        {"KEY     = nan", E_DATA, 0},
        {"KEY     = inf", E_DATA, 0},
        {"KEY     = 0x10", E_DATA, 0},
        {"KEY     = 1,5", E_DATA, 0},
        {"KEY     = +-1", E_DATA, 0},
        {"KEY     = --1", E_DATA, 0},
        {"KEY     = .", E_DATA, 0},
        {"KEY     = -", E_DATA, 0},
        {"KEY     = E5", E_DATA, 0},
        {"KEY     = '1.5'", E_DATA, 0},
        {"KEY     = T", E_DATA, 0},
        {"KEY     = (1, 2)", E_DATA, 0},
        {"KEY     =", E_MISSING, 0},
        {"KEY     = / no value", E_MISSING, 0},
        {"KEY     =1.5", E_MISSING, 0},
        {"KEY       1.5", E_MISSING, 0},
        {"KEYS    = 1.5", E_MISSING, 0},
        {"KE      = 1.5", E_MISSING, 0},
        {"HIERARCH KEY = 2.5 / long way", OK, 2.5},
    };
    int good = 1;
    for (size_t i = 0; i < sizeof t / sizeof *t; i++) {
        struct header h = of(t[i].card);
        double v = 99;
        int st = header_double(&h, "KEY", &v);
        if (st != t[i].status || v != (st ? 99 : t[i].value)) {
            good = 0;
            check_that(0, "'%s': status %d, value %g", t[i].card, st, v);
        }
        header_free(&h);
    }
    check_that(good, "%zu ways to write a real number, as listed", sizeof t / sizeof *t);
}

static void test_longs(void)
{
    static const struct {
        const char *text;
        int status;
        long value;
    } t[] = {
        {"42", OK, 42}, {"-7", OK, -7}, {"+7", OK, 7}, {"007", OK, 7}, {"4.0", OK, 4}, {"1E3", OK, 1000},
        {"9223372036854775807", OK, INT64_MAX}, {"-9223372036854775808", OK, INT64_MIN},
        {"9223372036854775808", E_DATA, 0}, {"4.5", E_DATA, 0}, {"1e30", E_DATA, 0}, {"4 2", E_DATA, 0},
        {"", E_MISSING, 0}, {"'4'", E_DATA, 0}, {"T", E_DATA, 0}, {"4x", E_DATA, 0}, {"-", E_DATA, 0},
    };
    int good = 1;
    for (size_t i = 0; i < sizeof t / sizeof *t; i++) {
        char card[81];
        snprintf(card, sizeof card, "KEY     = %20s / c", t[i].text);
        struct header h = of(card);
        long v = 99;
        int st = header_long(&h, "KEY", &v);
        if (st != t[i].status || v != (st ? 99 : t[i].value)) {
            good = 0;
            check_that(0, "whole number '%s': status %d, value %ld", t[i].text, st, v);
        }
        header_free(&h);
    }
    check_that(good, "%zu ways to write a whole number, as listed", sizeof t / sizeof *t);
}

static void test_strings(void)
{
    static const struct {
        const char *card, *value;
    } t[] = {
        {"KEY     = 'abc'", "abc"},
        {"KEY     = 'abc     '           / comment with ' in it", "abc"},
        {"KEY     = '  abc'", "  abc"},
        {"KEY     = 'it''s'", "it's"},
        {"KEY     = ''''", "'"},
        {"KEY     = ''", ""},
        {"KEY     = '        '", ""},
        {"KEY     = 'a / b'", "a / b"},
        {"KEY     = 'abc&'", "abc&"},
        {"KEY     = 'abc", NULL},
        {"KEY     = abc", NULL},
        {"KEY     = 1.5", NULL},
        {"KEY     =", NULL},
    };
    int good = 1;
    char s[100];
    for (size_t i = 0; i < sizeof t / sizeof *t; i++) {
        struct header h = of(t[i].card);
        int st = header_str(&h, "KEY", s, sizeof s);
        if (t[i].value ? st != OK || strcmp(s, t[i].value) : st == OK) {
            good = 0;
            check_that(0, "'%s': status %d, value '%s'", t[i].card, st, s);
        }
        header_free(&h);
    }
    check_that(good, "%zu strings, as listed", sizeof t / sizeof *t);

    struct header h = of("KEY     = 'abcdefgh'");
    char small[4];
    check_that(header_str(&h, "KEY", small, 4) == OK && !strcmp(small, "abc"), "a short buffer gets a start");
    header_free(&h);
    int v = 9;
    h = of("KEY     =                    F");
    check_that(header_bool(&h, "KEY", &v) == OK && v == 0, "F is read");
    header_free(&h);
    h = of("KEY     = TRUE");
    check_that(header_bool(&h, "KEY", &v) == E_DATA && v == 0, "TRUE is refused, the value left alone");
    header_free(&h);
}

/* ---- what is set comes back ---- */

static uint64_t state = 88172645463325252u;
static uint64_t next(void)
{
    state ^= state << 13;
    state ^= state >> 7;
    return state ^= state << 17;
}

static void test_doubles_back(void)
{
    struct header h = {0};
    long wrong = 0, form = 0, n = 200000;
    for (long i = 0; i < n; i++) {
        uint64_t bits = next();
        double v, back = 0;
        memcpy(&v, &bits, 8);
        if (i % 2)
            v = (double)(int64_t)(bits >> 40) / 1000;
        if (!isfinite(v))
            continue;
        int st = header_set_double(&h, "KEY", v, "a comment");
        if (st == OK)
            st = header_double(&h, "KEY", &back);
        wrong += st != OK || memcmp(&v, &back, 8) != 0;
        const char *c = h.card[0];
        form += strlen(c) != 80 || memcmp(c, "KEY     = ", 10) != 0 || !strchr(c + 10, '.');
    }
    check_that(wrong == 0, "%ld doubles give the same bits back (%ld do not)", n, wrong);
    check_that(form == 0 && h.n == 1, "one card of 80 characters, with a point (%ld without)", form);
    header_free(&h);

    h = (struct header){0};
    check_that(header_set_double(&h, "KEY", 0.1, "s") == OK &&
               !strncmp(h.card[0], "KEY     =                  0.1 / s   ", 36), "0.1 takes three characters");
    check_that(header_set_double(&h, "KEY", NAN, NULL) == E_RANGE &&
               header_set_double(&h, "KEY", INFINITY, NULL) == E_RANGE && strstr(h.card[0], " 0.1 / s"),
               "NaN and infinity are refused, the card left alone");
    header_free(&h);
}

static void test_strings_back(void)
{
    static const char alphabet[] = "abc XYZ''&/=0";
    struct header h = {0};
    long wrong = 0;
    for (long i = 0; i < 20000; i++) {
        char v[400], back[500] = "";
        size_t n = (size_t)(next() % 300);
        for (size_t k = 0; k < n; k++)
            v[k] = alphabet[next() % (sizeof alphabet - 1)];
        while (n && v[n - 1] == ' ')
            n--;
        v[n] = 0;
        int st = header_set_str(&h, "KEY", v, i % 2 ? "a comment" : NULL);
        if (st == OK)
            st = header_str(&h, "KEY", back, sizeof back);
        int same = st == OK && !strcmp(v, back);
        for (size_t k = 0; k < h.n; k++)
            same &= strlen(h.card[k]) == 80;
        same &= header_set_long(&h, "AFTER", i, NULL) == OK;
        if (!same && !wrong++)
            printf("# '%s' became '%s'\n", v, back);
    }
    check_that(wrong == 0, "20000 strings of 0 to 299 characters come back (%ld do not)", wrong);
    header_free(&h);
}

static void test_changes(void)
{
    struct header h = {0};
    static const char *const cards[] = {
        "A       =                    1", "COMMENT one", "B       =                    2",
        "A       =                    3", "PV1_1   =                  0.5", "PV2_10  =                  0.5",
        "PVX     = 'x'", "L       = 'long &'", "CONTINUE  'er'", "B_1_2   =                  1.0", "HISTORY old"};
    int st = OK;
    for (size_t i = 0; i < sizeof cards / sizeof *cards && !st; i++)
        st = header_append(&h, cards[i]);
    long a = 0;
    char s[40] = "";
    check_that(st == OK && header_long(&h, "A", &a) == OK && a == 1, "the first card of a name counts");
    check_that(header_str(&h, "L", s, sizeof s) == OK && !strcmp(s, "long er"), "CONTINUE is followed");
    check_that(header_set_long(&h, "A", 9, NULL) == OK && h.n == 10 && !strncmp(h.card[0], "A  ", 3) &&
               header_long(&h, "A", &a) == OK && a == 9, "replaced in place, the second one removed");
    check_that(header_set_str(&h, "L", "short", NULL) == OK && h.n == 9 && header_str(&h, "L", s, sizeof s) == OK &&
               !strcmp(s, "short"), "the CONTINUE card goes with its string");
    header_remove(&h, "PV*");
    check_that(h.n == 6, "PV* removes by prefix (%zu cards left)", h.n);
    header_remove(&h, "B");
    check_that(h.n == 5 && header_double_or(&h, "B_1_2", -1) == 1, "B leaves B_1_2 alone");
    check_that(header_set_double(&h, "long.name of it", 2.5, "c") == OK &&
               !strncmp(h.card[5], "HIERARCH long.name of it = 2.5 / c ", 35) &&
               header_double_or(&h, "long.name of it", 0) == 2.5, "other names by HIERARCH");
    check_that(header_set_long(&h, "", 1, NULL) == E_RANGE && header_set_long(&h, "A=B", 1, NULL) == E_RANGE &&
               h.n == 6, "names that cannot be are refused");
    struct header copy;
    check_that(header_copy(&copy, &h) == OK && copy.n == h.n && copy.card != h.card &&
               !memcmp(copy.card, h.card, h.n * sizeof *h.card), "copied");
    header_free(&copy);
    header_free(&h);
    char long_card[100];
    memset(long_card, 'x', 81);
    long_card[81] = 0;
    h = (struct header){0};
    check_that(header_append(&h, long_card) == E_RANGE && h.n == 0, "a card of 81 characters is refused");
    check_that(header_append(&h, "COMMENT a\tb\x80") == OK && !strncmp(h.card[0], "COMMENT a?b? ", 13) &&
               strlen(h.card[0]) == 80, "what is not printable becomes ?");
    header_free(&h);
}

static void test_history(void)
{
    struct header h = {0};
    char text[400] = "prog 1.0: prog", line[81], joined[800] = "";
    for (int i = 0; i < 20; i++)
        sprintf(text + strlen(text), " --option%d 'a b'", i);
    int st = header_history(&h, text), good = 1;
    for (size_t i = 0; i < h.n; i++) {
        memcpy(line, h.card[i], 81);
        good &= !strncmp(line, "HISTORY ", 8) && strlen(line) == 80;
        for (size_t n = 80; n && line[n - 1] == ' ';)
            line[--n] = 0;
        sprintf(joined + strlen(joined), "%s%s", i ? " " : "", line + 8);
    }
    check_that(st == OK && good && !strcmp(joined, text), "%zu HISTORY cards, broken at blanks, join to the text", h.n);
    header_free(&h);
    memset(text, 'x', 200);
    text[200] = 0;
    check_that(header_history(&h, text) == OK && h.n == 3 && strspn(h.card[0] + 8, "x") == 72, "a word of 200 letters is cut");
    header_free(&h);
}

int main(void)
{
    test_doubles();
    test_longs();
    test_strings();
    test_doubles_back();
    test_strings_back();
    test_changes();
    test_history();
    return check_status();
}
