/*
 * check.h - the few functions unit tests need.  Every check prints one line,
 * "ok ..." or "not ok ...", with the worst error as a fraction of its
 * tolerance, so that a slack tolerance shows.  A NaN never passes.
 */
#ifndef PIXSHEAR_CHECK_H
#define PIXSHEAR_CHECK_H

#include <math.h>
#include <stdarg.h>
#include <stdio.h>

/* Sanitizers have an allocator of their own and shadow pages beside each page. */
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define CHECK_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define CHECK_SANITIZED 1
#endif
#endif
#ifndef CHECK_SANITIZED
#define CHECK_SANITIZED 0
#endif

struct check {
    const char *what;
    double worst;        /* largest |got - want| / tolerance so far */
    double got, want, tol;
    long n;
};

static int check_failures;

/* One line for a condition. */
__attribute__((format(printf, 2, 3), unused))
static int check_that(int good, const char *fmt, ...)
{
    va_list ap;
    va_start(ap, fmt);
    printf(good ? "ok - " : "not ok - ");
    vprintf(fmt, ap);
    putchar('\n');
    va_end(ap);
    check_failures += !good;
    return good;
}

/* Start a series of comparisons that gives one line. */
__attribute__((unused))
static struct check check_begin(const char *what)
{
    return (struct check){.what = what};
}

/* Compare with an absolute tolerance; remembers the worst. */
__attribute__((unused))
static void check_close(struct check *c, double got, double want, double tol)
{
    double r = fabs(got - want) / tol;
    if (got == want)
        r = 0;
    if (!(r <= c->worst) || c->n == 0) {
        if (!(r == r))
            r = INFINITY;
        if (r >= c->worst || c->n == 0) {
            c->worst = r;
            c->got = got;
            c->want = want;
            c->tol = tol;
        }
    }
    c->n++;
}

/* The line of a series; no comparison at all is a failure. */
__attribute__((unused))
static int check_end(const struct check *c)
{
    int good = c->n > 0 && c->worst <= 1;
    printf("%s - %s: %ld values, worst %.3g of tolerance", good ? "ok" : "not ok", c->what, c->n, c->worst);
    if (c->n)
        printf(" (got %.17g, want %.17g, tolerance %.3g)", c->got, c->want, c->tol);
    putchar('\n');
    check_failures += !good;
    return good;
}

__attribute__((format(printf, 1, 2), unused))
static void check_skip(const char *fmt, ...)
{
    va_list ap;
    va_start(ap, fmt);
    printf("skip - ");
    vprintf(fmt, ap);
    putchar('\n');
    va_end(ap);
}

/* For main: exit status. */
__attribute__((unused))
static int check_status(void)
{
    return check_failures ? 1 : 0;
}

#endif
