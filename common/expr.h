/*
 * expr.h - conditions on the columns of a catalogue, like
 * "FLUX_AUTO/FLUXERR_AUTO >= 20 && (FLAGS&4 = 0 || MASKED < 0.01)".
 *
 * Rising in strength: || && ! then < <= > >= = != then + - then * / & then the
 * sign, then ^ (power).  & is the bits that two whole numbers share.  Functions:
 * abs sqrt exp log log10 floor of one number, hypot min max of two.  A column of
 * words can be compared by = and != with one word or 'a quoted one'.
 *
 * A missing value (nan) is neither true nor false: what depends on it does not hold.
 */
#ifndef PIXSHEAR_EXPR_H
#define PIXSHEAR_EXPR_H

#include "err.h"
#include "table.h"
#include <stddef.h>

#define EXPR_NODES 128

struct expr_node {
    int op;                   /* enum in expr.c */
    int a, b;                 /* operands, nodes before this one */
    double v;                 /* a number; which function */
    char text[64];            /* a number as typed, a name, a word */
};

struct expr {
    size_t n;
    struct expr_node node[EXPR_NODES];      /* the last is the whole condition */
};

/* E_DATA: e tells what is wrong and where. */
MUST_CHECK int expr_parse(struct expr *x, const char *text, struct err *e);

/* Columns of t for the nodes of x, until the columns of t change; col has room for EXPR_NODES. E_MISSING, E_DATA: e names the column. */
MUST_CHECK int expr_bind(const struct expr *x, const struct table *t, const struct column **col, struct err *e);

/* Whether the condition holds for a row. */
int expr_holds(const struct expr *x, const struct column *const *col, size_t row);

#endif
