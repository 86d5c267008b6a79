/*
 * table.h - named columns in memory, with the header a catalogue carries.
 *
 * A catalogue is columns (name, unit, description, type), keywords that travel
 * with the data ("# Keyword: NAME = VALUE"), and HISTORY lines.  The last
 * column may be ragged: a list of doubles whose length differs from row to row
 * (COEFFS of a shapelet catalogue).
 */
#ifndef PIXSHEAR_TABLE_H
#define PIXSHEAR_TABLE_H

#include "err.h"
#include <stddef.h>
#include <stdint.h>

enum col_type {
    COL_INT,       /* int64, never missing */
    COL_REAL,      /* double, printed %.17g shortest form that gives the bits back */
    COL_REAL32,    /* double in memory, printed %.9g */
    COL_TEXT,      /* word without blanks */
    COL_RAGGED     /* doubles to the end of the row; last column only */
};

struct column {
    char *name;            /* [A-Z][A-Z0-9_]* */
    char *unit;            /* "" when dimensionless */
    char *what;            /* description, at least two words */
    enum col_type type;
    union {
        int64_t *i;
        double *r;
        char **s;
    } v;                   /* nrow values; ragged: v.r holds all rows end to end */
    size_t *start;         /* ragged: nrow + 1 offsets into v.r */
    size_t room;           /* ragged: values v.r has room for */
    int logical;           /* a column of T and F in a FITS file, which stand as 1 and 0 */
};

struct keyword {
    char *name;
    char *value;           /* text as in the file */
};

struct table {
    size_t nrow, cap;
    size_t ncol;
    struct column *col;
    size_t nkey;
    struct keyword *key;
    size_t nhistory;
    char **history;
};

void table_free(struct table *t);

/* 1 when `name` is [A-Z][A-Z0-9_]*. */
int table_good_name(const char *name);

/* Add an empty column (nrow zeros / NaN-free zeros / empty words). Names are unique: E_RANGE. */
MUST_CHECK int table_add(struct table *t, const char *name, enum col_type type, const char *unit,
                         const char *what);

/* Room for cap rows, so that table_resize() has only to clear cells. */
MUST_CHECK int table_reserve(struct table *t, size_t cap);

/* Make nrow rows; new cells are 0, NaN for reals, "" for words. Not for ragged columns' contents. */
MUST_CHECK int table_resize(struct table *t, size_t nrow);

/* Column by name, NULL when there is none. Case matters. */
struct column *table_find(const struct table *t, const char *name);

/* Values of a numeric column as doubles: real columns themselves, NULL otherwise. */
double *table_reals(const struct table *t, const char *name);
int64_t *table_ints(const struct table *t, const char *name);

/* Number in a cell of an INT or REAL column as double (NaN for text). */
double table_number(const struct column *c, size_t row);

/* Replace the word in a cell of a TEXT column by a copy of `text`. */
MUST_CHECK int table_set_word(struct column *c, size_t row, const char *text);

/* Append a ragged row's n values to column c for row `row`: every row once, in order. */
MUST_CHECK int table_ragged(struct table *t, struct column *c, size_t row, const double *v, size_t n);

/* Keep rows with keep[i] != 0, in order. */
MUST_CHECK int table_keep(struct table *t, const unsigned char *keep);

/* Keep columns with keep[k] != 0, in order. */
void table_keep_columns(struct table *t, const unsigned char *keep);

/* to = deep copy of from; on failure `to` is empty. */
MUST_CHECK int table_copy(struct table *to, const struct table *from);

/* Keywords: text as printed; numbers as few digits as give the bits back. */
MUST_CHECK int table_set_text(struct table *t, const char *name, const char *value);
MUST_CHECK int table_set_number(struct table *t, const char *name, double value);
const char *table_text(const struct table *t, const char *name);          /* NULL: none */
MUST_CHECK int table_key_number(const struct table *t, const char *name, double *value); /* E_MISSING, E_DATA */

MUST_CHECK int table_history(struct table *t, const char *line);

/*
 * One whole token as a number, exactly rounded, in any locale: [+-] digits with at most one
 * point, optional exponent; "nan" as well.  E_DATA when there is anything else (infinity,
 * hexadecimal, a comma), E_RANGE when it is larger than a double.  `len` bytes, no terminator.
 */
MUST_CHECK int table_scan_real(const char *text, size_t len, double *value);
/* [+-] digits; E_DATA, or E_RANGE beyond int64. */
MUST_CHECK int table_scan_int(const char *text, size_t len, int64_t *value);

/* Rounded as a FITS table holds a COL_REAL32, so that both forms give the same number. */
double table_as_float(double v);

#define TABLE_PRINT 32     /* room for any printed number */

/*
 * Print x as few digits as give the bits back (at most 17); returns the length, no terminator.
 * What is not finite is printed as nan.
 */
size_t table_print_real(char *to, double x);
/* Print x with up to 9 significant digits, as %.9g. */
size_t table_print_real32(char *to, double x);
size_t table_print_int(char *to, int64_t x);

#endif
