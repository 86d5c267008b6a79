/* test_cuts.c - the paper's cuts, their order and counts, comparisons. */
#include "check.h"
#include "cuts.h"
#include <stdlib.h>
#include <string.h>

static struct table sample(void)
{
    static const char *const name[] = {"E1", "E2", "D_RRG", "FLUX_AUTO", "FLUXERR_AUTO", "STAR_PROB", "WIDTH", "D_PSF"};
    /* the limit for d* = .6: 1.2 sqrt(.36 + .4) = 1.04613.. */
    static const double v[][8] = {
        {0.1, 0.2, 1.2, 100, 5, 0.1, 2, 0.7},        /* used */
        {0.1, 0.2, 1.2, 100, 5, 0.95, 2, 0.7},       /* star */
        {0.8, 0.6, 1.2, 100, 5, 0.1, 2, 0.7},        /* |e| = 1: not below 1 */
        {NAN, 0.2, 1.2, 100, 5, 0.1, 2, 0.7},        /* no ellipticity */
        {0.1, 0.2, 1.046, 100, 5, 0.1, 2, 0.7},      /* small */
        {0.1, 0.2, 1.047, 100, 5, 0.1, 2, 0.7},      /* just used; too small against its own star */
        {0.1, 0.2, 2000, 100, 5, 0.1, 2, 0.7},       /* sentinel */
        {0.1, 0.2, NAN, 100, 5, 0.1, 2, 0.7},        /* no size */
        {0.1, 0.2, 1.2, 50, 5, 0.1, 2, 0.7},         /* S/N 10: used */
        {0.1, 0.2, 1.2, 49.9, 5, 0.1, 2, 0.7},       /* faint */
        {0.1, 0.2, 1.2, 100, 0, 0.1, 2, 0.7},        /* S/N infinite: used */
        {0.1, 0.2, 1.2, 0, 0, 0.1, 2, 0.7},          /* S/N 0/0: removed */
    };
    enum { N = sizeof v / sizeof *v };
    static const long long flags[N] = {0, 0, 0, 0, 0, 0, 0, 0, 128 + 2, 0, 0, 0};
    struct table t = {0};
    int st = OK;
    for (int k = 0; k < 8 && st == OK; k++)
        st = table_add(&t, name[k], COL_REAL, "", "test column");
    if (st == OK)
        st = table_add(&t, "FLAGS_RRG", COL_INT, "", "test column");
    if (st == OK)
        st = table_add(&t, "KIND", COL_TEXT, "", "test column");
    if (st == OK)
        st = table_resize(&t, N);
    if (st)
        check_that(0, "no table: status %d", st);
    for (size_t i = 0; i < N; i++) {
        for (int k = 0; k < 8; k++)
            table_reals(&t, name[k])[i] = v[i][k];
        table_ints(&t, "FLAGS_RRG")[i] = flags[i];
        struct column *kind = table_find(&t, "KIND");
        free(kind->v.s[i]);
        kind->v.s[i] = strdup(i % 2 ? "odd" : "even");
    }
    return t;
}

static void bits_are(const char *what, const struct table *t, const struct cuts *c, const char *expr, const int *want)
{
    int64_t bits[64];
    struct cut_count n;
    struct expr w;
    struct err e;
    if (expr && expr_parse(&w, expr, &e) != OK) {
        check_that(0, "%s: %s", what, e.text);
        return;
    }
    if (cuts_apply(t, c, expr != NULL, &w, bits, &n, &e) != OK) {
        check_that(0, "%s: %s", what, e.text);
        return;
    }
    struct check k = check_begin(what);
    size_t used = 0;
    for (size_t i = 0; i < t->nrow; i++) {
        check_close(&k, (double)bits[i], want[i], 0.1);
        used += bits[i] == 0;
    }
    check_close(&k, (double)n.where, (double)used, 0.1);
    check_close(&k, n.all >= n.stars && n.stars >= n.ellipticity && n.ellipticity >= n.size && n.size >= n.snr && n.snr >= n.where, 1, 0.1);
    check_end(&k);
}

int main(void)
{
    struct table t = sample();
    struct cuts c = CUTS_DEFAULTS;
    c.dstar = 0.6;
    bits_are("the paper's cuts", &t, &c, NULL, (int[]){0, 1, 2, 2, 4, 0, 4, 4, 0, 8, 0, 8});
    struct cuts each = c;
    each.which = DSTAR_EACH;
    bits_are("d* of each object's width: 1.2 sqrt(.49 + .4) = 1.132", &t, &each, NULL, (int[]){0, 1, 2, 2, 4, 4, 4, 4, 0, 8, 0, 8});
    struct cuts flagged = c;
    flagged.flags = 128;
    bits_are("flags fail the size cut", &t, &flagged, NULL, (int[]){0, 1, 2, 2, 4, 0, 4, 4, 4, 8, 0, 8});
    struct cuts none = c;
    none.floor = 0;
    none.snr = 0;
    none.star_prob = 1;
    bits_are("without the 0.4, S/N and stars: 1.2 d* = .72", &t, &none, NULL, (int[]){0, 0, 2, 2, 0, 0, 4, 4, 0, 0, 0, 0});
    bits_are("FLUX_AUTO>=100", &t, &none, "FLUX_AUTO>=100", (int[]){0, 0, 2, 2, 0, 0, 4, 4, 16, 16, 0, 16});
    bits_are("E1 != .1: a missing value fails", &t, &none, "E1 != 0.1", (int[]){16, 16, 2, 18, 16, 16, 20, 20, 16, 16, 16, 16});
    bits_are("two columns and a bit", &t, &none, "FLUX_AUTO/FLUXERR_AUTO>=20 && FLAGS_RRG&2=0", (int[]){0, 0, 2, 2, 0, 0, 4, 4, 16, 16, 0, 16});
    bits_are("words", &t, &none, "KIND=odd", (int[]){16, 0, 18, 2, 16, 0, 20, 4, 16, 0, 16, 0});
    bits_are("FLAGS_RRG==0", &t, &none, "FLAGS_RRG==0", (int[]){0, 0, 2, 2, 0, 0, 4, 4, 16, 0, 0, 0});

    struct expr w;
    struct err e;
    int64_t bits[64];
    struct cut_count n;
    check_that(expr_parse(&w, "NOSUCH<1", &e) == OK && cuts_apply(&t, &c, 1, &w, bits, &n, &e) == E_MISSING, "unknown column: %s", e.text);
    check_that(expr_parse(&w, "KIND<1", &e) == OK && cuts_apply(&t, &c, 1, &w, bits, &n, &e) == E_DATA, "words are not smaller: %s", e.text);
    check_that(expr_parse(&w, "E1=odd", &e) == OK && cuts_apply(&t, &c, 1, &w, bits, &n, &e) == E_MISSING, "a number is no word, and odd no column: %s", e.text);
    c.dstar = NAN;
    check_that(cuts_apply(&t, &c, 0, NULL, bits, &n, &e) == E_MISSING, "no d*: %s", e.text);
    table_free(&t);
    return check_status();
}
