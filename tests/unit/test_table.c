/* Columns in memory; text to number and back against the C library. */
#include "check.h"
#include "table.h"
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint64_t state = 88172645463325252u;

static uint64_t bits(void)      /* xorshift64: independent of the project's generator */
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return state;
}

static int scan(const char *s, double *v)
{
    return table_scan_real(s, strlen(s), v);
}

static void test_scan_real(void)
{
    static const char *const good[] = {
        "0", "-0", "1", "+1", "1.", ".5", "-.5e1", "1e22", "1e23", "9007199254740993", "9007199254740992e22", "0.1", "1E-5",
        "123456789012345678901234567890", "0.00000000000000000000000000000000001", "4.9e-324", "1e-400", "2.2250738585072014e-308",
        "1.7976931348623157e308", "8.98846567431158e307", "0e99999", "0.000e-5", "179769313486231570000e288",
        "9007199254740993.0000000000000000000000000000000000000001", "0000000000000000000000001.5"
    };
    int bad = 0;
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        double v = -1, want = strtod(good[i], NULL);
        if (scan(good[i], &v) || v != want || signbit(v) != signbit(want)) {
            bad++;
            printf("# %s gives %.17g, not %.17g\n", good[i], v, want);
        }
    }
    check_that(bad == 0, "25 chosen numbers are read exactly");
    static const char *const wrong[] = {
        "", "+", "-", ".", "e5", "1e", "1e+", "1.5abc", "1,5", "0x10", "inf", "-inf", "infinity", "1.2.3", "1e5.0", "--1",
        "1_000", "1d5", "nan(1)", "na", "1 ", "0x1p3", "INF", "1e5e5", ("\xef\xbb\xbf" "1"), "+-1", "$1", "1f"
    };
    bad = 0;
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        double v = 7;
        if (scan(wrong[i], &v) != E_DATA || v != 7) {
            bad++;
            printf("# '%s' is accepted\n", wrong[i]);
        }
    }
    check_that(bad == 0, "28 words that are no numbers are refused");
    double v = 7;
    check_that(scan("1e309", &v) == E_RANGE && scan("-1e99999999999999999999", &v) == E_RANGE && v == 7, "overflow is refused");
    check_that(scan("nan", &v) == OK && v != v && scan("-NaN", &v) == OK, "nan is read");
}

static void test_scan_random(void)
{
    long bad = 0, n = 300000;
    for (long i = 0; i < n; i++) {
        char s[64];
        uint64_t b = bits();
        double x, v = 0;
        memcpy(&x, &b, sizeof x);
        if (i % 3 == 0)
            x = (double)(int64_t)(b >> 20) * pow(10, (int)(bits() % 40) - 25);
        if (!isfinite(x))
            continue;
        int len = snprintf(s, sizeof s, "%.*g", 1 + (int)(bits() % 21), x);
        if (!isfinite(strtod(s, NULL)))
            continue;
        if (table_scan_real(s, (size_t)len, &v) || v != strtod(s, NULL))
            bad++;
    }
    check_that(bad == 0, "%ld random numbers of 1 to 21 digits are read as strtod does", n);
}

/* The shortest of %.15g, %.16g, %.17g that reads back. */
static void reference_print(char *s, size_t size, double x)
{
    for (int d = 15; d <= 17; d++) {
        snprintf(s, size, "%.*g", d, x);
        if (strtod(s, NULL) == x)
            return;
    }
}

static void test_print(void)
{
    static const double chosen[] = {
        0, -0.0, 1, -1, 0.1, 0.3, 1e15, 1e14, 999999999999999, 1e-4, 1e-5, 9.9999e-5, 123456.789, 1e100, 1e-300, 5e-324, 0.09999999999999999,
        99999999.95, 999999999.6, 0.999999999999999, 9.999999999999999, 1e9, 123456789, 2.5, 1234567890.5, 1e22, 4503599627370497.5, 1e-7, 9.99999999999999e-8
    };
    long bad = 0, bad32 = 0, n = 300000;
    size_t k = sizeof chosen / sizeof chosen[0];
    for (long i = 0; i < n; i++) {
        char want[64], got[TABLE_PRINT + 1];
        uint64_t b = bits();
        double x;
        memcpy(&x, &b, sizeof x);
        if (i % 3 == 1)
            x = (double)(int64_t)(b >> 24) * pow(10, -(int)(bits() % 14)) * (b & 1 ? 1 : -1);
        if (i % 3 == 2)
            x = ldexp((double)(b >> 11), -53) * pow(10, (int)(bits() % 24) - 9);
        if ((size_t)i < k)
            x = chosen[i];
        if (!isfinite(x))
            continue;
        reference_print(want, sizeof want, x);
        got[table_print_real(got, x)] = '\0';
        bad += strcmp(want, got) != 0;
        if (strcmp(want, got) != 0 && bad < 4)
            printf("# %s printed %s\n", want, got);
        snprintf(want, sizeof want, "%.9g", x);
        got[table_print_real32(got, x)] = '\0';
        bad32 += strcmp(want, got) != 0;
        if (strcmp(want, got) != 0 && bad32 < 4)
            printf("# %s printed %s\n", want, got);
    }
    check_that(bad == 0, "%ld numbers are printed in the shortest form that reads back", n);
    check_that(bad32 == 0, "%ld numbers are printed as %%.9g prints them", n);
    char s[TABLE_PRINT + 1];
    s[table_print_real(s, (double)NAN)] = '\0';
    check_that(strcmp(s, "nan") == 0, "NaN is printed nan");
    s[table_print_real32(s, (double)INFINITY)] = '\0';
    check_that(strcmp(s, "nan") == 0, "what is not finite is printed nan");
}

static void test_int(void)
{
    int64_t v = 7;
    char s[TABLE_PRINT + 1];
    long bad = 0;
    check_that(table_scan_int("9223372036854775807", 19, &v) == OK && v == INT64_MAX, "largest int64");
    check_that(table_scan_int("-9223372036854775808", 20, &v) == OK && v == INT64_MIN, "smallest int64");
    v = 7;
    check_that(table_scan_int("9223372036854775808", 19, &v) == E_RANGE && table_scan_int("-9223372036854775809", 20, &v) == E_RANGE
               && table_scan_int("18446744073709551617", 20, &v) == E_RANGE && v == 7, "beyond int64 is refused, no wrap-around");
    check_that(table_scan_int("1.0", 3, &v) == E_DATA && table_scan_int("", 0, &v) == E_DATA && table_scan_int("-", 1, &v) == E_DATA
               && table_scan_int("0x1", 3, &v) == E_DATA && v == 7, "what is not a whole number is refused");
    for (long i = 0; i < 100000; i++) {
        int64_t x = (int64_t)bits() >> (bits() % 64), back = 0;
        char want[32];
        s[table_print_int(s, x)] = '\0';
        snprintf(want, sizeof want, "%" PRId64, x);
        bad += strcmp(s, want) != 0 || table_scan_int(s, strlen(s), &back) || back != x;
    }
    s[table_print_int(s, INT64_MIN)] = '\0';
    check_that(bad == 0 && strcmp(s, "-9223372036854775808") == 0, "100000 whole numbers printed and read back");
}

static int fill(struct table *t)
{
    double v[3] = {1, 2, 3};
    if (table_add(t, "ID", COL_INT, "", "Running number") || table_add(t, "X", COL_REAL, "pixel", "Position along x")
        || table_add(t, "TYPE", COL_TEXT, "", "Kind of object") || table_add(t, "COEFFS", COL_RAGGED, "", "Some coefficients")
        || table_set_text(t, "SETNAME", "one") || table_set_number(t, "PIXSCALE", 0.1) || table_history(t, "made by a test"))
        return 1;
    for (size_t i = 0; i < 100; i++) {
        if (table_resize(t, i + 1) || table_ragged(t, &t->col[3], i, v, i % 4))
            return 1;
        t->col[0].v.i[i] = (int64_t)i;
        t->col[1].v.r[i] = 0.5 * (double)i;
        if (table_set_word(&t->col[2], i, i % 2 ? "odd" : "even"))
            return 1;
    }
    return 0;
}

/* Row i must be what fill() made of `was`. */
static int row_is(const struct table *t, size_t i, size_t was)
{
    const struct column *c = &t->col[3];
    size_t n = c->start[i + 1] - c->start[i];
    int good = t->col[0].v.i[i] == (int64_t)was && t->col[1].v.r[i] == 0.5 * (double)was && n == was % 4
        && strcmp(t->col[2].v.s[i], was % 2 ? "odd" : "even") == 0;
    for (size_t j = 0; j < n; j++)
        good &= c->v.r[c->start[i] + j] == (double)(j + 1);
    return good;
}

static void test_columns(void)
{
    struct table t = {0}, copy;
    unsigned char keep[100];
    check_that(fill(&t) == 0, "a table of four columns and 100 rows");
    check_that(table_add(&t, "Y", COL_REAL, "", "") == E_RANGE, "no column behind a ragged one");
    check_that(table_find(&t, "x") == NULL && table_find(&t, "X") == &t.col[1], "names are found with their case");
    check_that(table_reals(&t, "ID") == NULL && table_ints(&t, "ID") == t.col[0].v.i && table_reals(&t, "X") == t.col[1].v.r
               && table_number(&t.col[0], 7) == 7 && isnan(table_number(&t.col[2], 7)), "columns by type");
    if (!check_that(table_copy(&copy, &t) == OK && copy.nrow == 100 && copy.ncol == 4, "copy"))
        return;
    table_free(&t);
    int good = 1;
    for (size_t i = 0; i < 100; i++)
        good &= row_is(&copy, i, i);
    double v = 0;
    good &= table_key_number(&copy, "PIXSCALE", &v) == OK && v == 0.1 && strcmp(table_text(&copy, "SETNAME"), "one") == 0
        && strcmp(copy.history[0], "made by a test") == 0;
    check_that(good, "a copy holds everything");
    size_t k = 0, left[100];
    for (size_t i = 0; i < 100; i++)
        if ((keep[i] = (unsigned char)(i % 7 == 0 || i > 90)))
            left[k++] = i;
    good = table_keep(&copy, keep) == OK && copy.nrow == k;
    for (size_t i = 0; i < k && good; i++)
        good &= row_is(&copy, i, left[i]);
    check_that(good, "kept rows keep their cells, ragged ones too");
    check_that(table_resize(&copy, 2) == OK && row_is(&copy, 1, 7) && table_resize(&copy, 5) == OK && isnan(copy.col[1].v.r[4])
               && copy.col[0].v.i[4] == 0 && strcmp(copy.col[2].v.s[4], "") == 0, "new cells are 0, NaN and empty words");
    table_free(&copy);
    check_that(table_add(&t, "A", COL_INT, "", "") == OK && table_add(&t, "A", COL_REAL, "", "") == E_RANGE
               && table_add(&t, "b", COL_REAL, "", "") == E_RANGE && table_add(&t, "", COL_REAL, "", "") == E_RANGE
               && table_add(&t, "1A", COL_REAL, "", "") == E_RANGE, "names are unique and in capital letters");
    check_that(table_key_number(&t, "NONE", &v) == E_MISSING && table_set_text(&t, "K", "1.5x") == OK
               && table_key_number(&t, "K", &v) == E_DATA && table_set_text(&t, "K", "2") == OK && t.nkey == 1
               && table_key_number(&t, "K", &v) == OK && v == 2, "keywords: missing, bad, replaced");
    table_free(&t);
}

int main(void)
{
    test_scan_real();
    test_scan_random();
    test_print();
    test_int();
    test_columns();
    return check_status();
}
