/* test_expr.c - conditions on columns: precedence, functions, words, missing values, refusals, random trees. */
#include "check.h"
#include "expr.h"
#include "rng.h"
#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS = 4 };
static const double val[3][ROWS] = {{1, 2, -3, NAN}, {0.5, 4, 2, 7}, {6, 5, 4, 0}};

static struct table sample(void)
{
    static const char *const name[] = {"A", "B_1", "FLAGS"}, *const word[ROWS] = {"odd", "even", "two words", "2"};
    struct table t = {0};
    int st = OK;
    for (int k = 0; k < 3 && st == OK; k++)
        st = table_add(&t, name[k], k == 2 ? COL_INT : COL_REAL, "", "test column");
    if (st == OK)
        st = table_add(&t, "KIND", COL_TEXT, "", "test column");
    if (st == OK)
        st = table_resize(&t, ROWS);
    if (st)
        check_that(0, "no table: status %d", st);
    for (size_t i = 0; i < ROWS; i++) {
        for (int k = 0; k < 2; k++)
            table_reals(&t, name[k])[i] = val[k][i];
        table_ints(&t, "FLAGS")[i] = (long long)val[2][i];
        struct column *kind = table_find(&t, "KIND");
        free(kind->v.s[i]);
        kind->v.s[i] = strdup(word[i]);
    }
    return t;
}

/* "1010": rows where the condition holds; else the status, or what expr_parse said. */
static const char *holds(const struct table *t, const char *text, struct err *e)
{
    static char out[16];
    static struct expr x;
    const struct column *col[EXPR_NODES];
    if (expr_parse(&x, text, e) != OK)
        return "refused";
    int st = expr_bind(&x, t, col, e);
    if (st)
        return st == E_MISSING ? "missing" : "mismatch";
    for (size_t i = 0; i < ROWS; i++)
        out[i] = expr_holds(&x, col, i) ? '1' : '0';
    return out;
}

/* A random tree of numbers as text in brackets, and its value. */
static double tree(const struct rng *r, uint64_t item, uint32_t *k, int depth, char *to, size_t room)
{
    char a[2000], b[2000];
    const double kind = rng_uniform(r, item, (*k)++);
    if (depth == 0 || kind < 0.2) {
        const double v = floor(20 * rng_uniform(r, item, (*k)++)) / 4;
        snprintf(to, room, rng_uniform(r, item, (*k)++) < 0.5 ? "%.2f" : "%.3e", v);
        return v;
    }
    const double x = tree(r, item, k, depth - 1, a, sizeof a / 2), y = tree(r, item, k, depth - 1, b, sizeof b / 2);
    const int op = (int)(kind * 50) % 8;
    static const char *const form[] = {"(%.900s+%.900s)", "(%.900s - %.900s)", "(%.900s*%.900s)", "hypot(%.900s, %.900s)", "min(%.900s,%.900s)",
                                       "(-%.900s-%.900s)", "(abs(%.900s) /(1+%.900s^2))", "max( %.900s,%.900s )"};
    const double v[] = {x + y, x - y, x * y, hypot(x, y), fmin(x, y), -x - y, fabs(x) / (1 + y * y), fmax(x, y)};
    snprintf(to, room, form[op], a, b);
    return v[op];
}

static void random_trees(const struct table *t)
{
    const struct rng r = rng_stream(61, 0, RNG_TEST);
    struct err e;
    int bad = 0, deep = 0;
    for (uint32_t i = 0; i < 2000; i++) {
        char text[1000], line[3000];
        uint32_t k = 0;
        const double v = tree(&r, i, &k, 4, text, 1000);
        snprintf(line, sizeof line, "%s = %.17g && 1+%s > %.17g", text, v, text, v);
        if (v < 0)
            snprintf(line, sizeof line, "%s = -%.17g && 1+%s > -%.17g", text, -v, text, -v);
        const char *got = holds(t, line, &e);
        if (strcmp(got, "refused") == 0 && strstr(e.text, "too long"))
            deep++;
        else if (strcmp(got, "1111") != 0 && bad++ < 3)
            printf("# %s: %s\n", line, got);
    }
    check_that(bad == 0 && deep < 500, "2000 random trees have their values (%d too long)", deep);
}

int main(void)
{
    static const struct { const char *text, *want; } line[] = {
        /* the columns: A 1 2 -3 nan, B_1 .5 4 2 7, FLAGS 6 5 4 0, KIND odd even 'two words' 2 */
        {"A<2", "1010"}, {"A <= 2", "1110"}, {"A>1", "0100"}, {"A>=1", "1100"}, {"A=2", "0100"}, {"A==2", "0100"}, {"A!=2", "1010"},
        {"B_1 > A", "0110"}, {"2*A+1 < B_1*2", "0110"}, {"A-1-1 = -1", "1000"}, {"8/4/2 = A", "1000"}, {"2^3^2 = 512", "1111"}, {"-2^2 = -4", "1111"},
        {"2^-1 = B_1", "1000"}, {"1+2*3 = 7", "1111"}, {"(1+2)*3 = 9", "1111"}, {"- -3 = +3", "1111"},
        {"FLAGS&4 = 4", "1110"}, {"FLAGS & 1 = 0", "1011"}, {"FLAGS&2=2 && A=1", "1000"}, {"B_1&1 = 1", "0001"}, {"A&1 = 1", "1000"},
        {"A<0 || B_1>5", "0011"}, {"A<2 && B_1>1", "0010"}, {"A=1 || A=2 && B_1=0", "1000"}, {"(A=1 || A=2) && B_1>1", "0100"},
        {"!A<2", "0100"}, {"!(A<2)", "0100"}, {"! ! A<2", "1010"}, {"!(A<2 || B_1<0)", "0100"}, {"!(A<2 && B_1>100)", "1111"}, {"A<2 || B_1=7", "1011"},
        {"abs(A) = 3", "0010"}, {"sqrt(B_1) = 2", "0100"}, {"sqrt(A) >= 0", "1100"}, {"log10(100) = 2 && log(exp(1)) = 1 && floor(1.9) = 1", "1111"},
        {"min(A,B_1) < 1", "1010"}, {"max(A,B_1) >= 4", "0100"}, {"hypot(3,4) = 5", "1111"},
        {"A/0 > 1e300", "1100"}, {"0/0 = 0/0", "0000"}, {"0/0 != 1", "0000"},
        {"KIND=odd", "1000"}, {"KIND != odd", "0111"}, {"KIND = 'two words'", "0010"}, {"KIND=\"even\" || KIND=2", "0101"}, {"!KIND=odd && A<5", "0110"}, {"KIND=A", "0000"},
        {"1e0 = A", "1000"}, {".5=B_1", "1000"}, {"A=1e-1*10", "1000"},
        {"NOSUCH<1", "missing"}, {"A<x", "missing"}, {"A=odd", "missing"}, {"sqrt<1", "missing"},
        {"KIND<odd", "mismatch"}, {"KIND=1+1", "mismatch"}, {"A='odd'", "mismatch"}, {"1=KIND", "mismatch"}, {"KIND+1=2", "mismatch"}, {"'a'='a'", "mismatch"},
        {"", "refused"}, {" ", "refused"}, {"A", "refused"}, {"<3", "refused"}, {"A<", "refused"}, {"A!3", "refused"}, {"A<1.5abc", "refused"}, {"A<nan", "refused"},
        {"A<inf", "refused"}, {"A<0x10", "refused"}, {"A<1<2", "refused"}, {"A B<2", "refused"}, {"A<1e400", "refused"}, {"A=>2", "refused"}, {"(A<2", "refused"},
        {"A<2)", "refused"}, {"(A<2)+1 = 2", "refused"}, {"A && B_1<1", "refused"}, {"!A", "refused"}, {"A<1 &&", "refused"}, {"|| A<1", "refused"}, {"sqrt(4,2)=2", "refused"},
        {"min(4)=4", "refused"}, {"abs(A<1)=1", "refused"}, {"KIND='odd", "refused"}, {"KIND=''", "refused"}, {"A<1;B_1<1", "refused"}, {"A<1,5", "refused"}, {"A*<1", "refused"},
        {"A<1 | B_1<1", "refused"}, {"A-<1", "refused"},
    };
    struct table t = sample();
    struct err e;
    for (size_t i = 0; i < sizeof line / sizeof *line; i++) {
        const char *got = holds(&t, line[i].text, &e);
        check_that(strcmp(got, line[i].want) == 0, "%s: %s (want %s)", line[i].text, got, line[i].want);
        if (isalpha((unsigned char)line[i].want[0]))
            check_that(e.text[0] != '\0' && strlen(e.text) < sizeof e.text - 1 && !strchr(e.text, '\n'), "one line: %s", e.text);
    }
    random_trees(&t);
    char text[4000] = "";
    for (int i = 0; i < 500; i++)
        strcat(text, "(");
    check_that(strcmp(holds(&t, text, &e), "refused") == 0, "500 brackets: %.60s", e.text);
    text[0] = '\0';
    for (int i = 0; i < 200; i++)
        strcat(text, "A<1||");
    strcat(text, "A<1");
    check_that(strcmp(holds(&t, text, &e), "refused") == 0 && strstr(e.text, "too long"), "200 comparisons: refused");
    memset(text, 'A', 100);
    strcpy(text + 100, "<1");
    check_that(strcmp(holds(&t, text, &e), "refused") == 0, "a name of 100 characters: refused");
    table_free(&t);
    return check_status();
}
