/*
 * tableio.h - catalogues as text or FITS.  tableio.c is the only file that
 * parses catalogues, tablewrite.c the only one that prints them.
 *
 * Text form (pixshear(7)): four header parts, then one row per line.  On
 * reading, names come from the last "# NAME NAME ..." line, types and units
 * from "# Column n: NAME [unit,type] ..." where present; without a line of
 * names, from "# n NAME description [unit]" (Source Extractor).  Without types
 * a column is INT when every cell is a whole number, REAL when every cell is a
 * number (nan allowed), TEXT when none is, and an error when some are.  Numbers are read
 * whole or refused: no trailing characters, overflow, decimal comma, hexadecimal or infinity.  A row has
 * as many cells as the header names (at least as many with a ragged last
 * column: name COEFFS).  Lines are at most 64 KiB, 4096 cells; CRLF is read.
 */
#ifndef PIXSHEAR_TABLEIO_H
#define PIXSHEAR_TABLEIO_H

#include "err.h"
#include "table.h"
#include "tablerows.h"

/*
 * Read a catalogue; "-" is standard input; FITS is recognised by its first
 * bytes.  Errors name file and line: "cat.txt: line 12: ...".
 */
MUST_CHECK int table_read(struct table *t, const char *name, double max_memory, struct err *e);

/*
 * Write; "-" is standard output; a name ending in .fits, .fit or .fts gives a binary table.
 * `record` is appended to HISTORY (NULL: none).  Real cells that are not
 * finite are printed nan, empty words -.
 */
MUST_CHECK int table_write(const struct table *t, const char *name, const char *record,
                           const char *const *inputs, size_t n_inputs, struct err *e);

/* The same with the rows of `rows`; t is the header and knows the columns, its own rows are not looked at. */
MUST_CHECK int table_write_rows(const struct table *t, struct table_rows *rows, const char *name, const char *record,
                                const char *const *inputs, size_t n_inputs, struct err *e);

/*
 * Writing in blocks.  table_out_begin() may be left out; it gives the header when that is complete before the rows, which
 * then go out as they come where the format allows (text without words, whose longest a header tells).  Else they wait
 * as tablerows.h says.  Every block has the columns of `head`; table_out_end() makes the file appear and frees *o whatever
 * happens.  Names, `head` and its columns must stay until then.
 */
struct table_out;
MUST_CHECK int table_out_open(struct table_out **o, const char *name, const char *const *inputs, size_t n_inputs, struct err *e);
MUST_CHECK int table_out_begin(struct table_out *o, const struct table *head, const char *record, struct err *e);
MUST_CHECK int table_out_rows(struct table_out *o, const struct table *t, struct err *e);
MUST_CHECK int table_out_end(struct table_out *o, const struct table *head, const char *record, struct err *e);

/*
 * Reading in blocks: t gets the header (columns without rows, keywords,
 * HISTORY), table_in_rows() replaces its rows by the next n at most, none at the
 * end.  Columns that are added to t behind those of the file are left as
 * table_resize() makes them.  A pipe whose header has no types of columns is held
 * whole, as are gzip'ed files and FITS from a pipe.  `name` must stay until table_in_close().
 */
struct table_in;
MUST_CHECK int table_in_open(struct table_in **in, struct table *t, const char *name, double max_memory, struct err *e);
MUST_CHECK int table_in_rows(struct table_in *in, struct table *t, size_t n, struct err *e);
void table_in_close(struct table_in *in);

/* Part of the rows that has been read; 0: not known (a pipe). */
double table_in_part(const struct table_in *in);

/* A number of rows that takes about a megabyte. */
size_t table_block_rows(const struct table *t);

#endif
