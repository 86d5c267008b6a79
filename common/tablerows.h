/*
 * tablerows.h - the rows of a catalogue block by block, so that a writer needs
 * no more of them in memory than one block; and rows that wait on disk until
 * the header is known.
 */
#ifndef PIXSHEAR_TABLEROWS_H
#define PIXSHEAR_TABLEROWS_H

#include "err.h"
#include "table.h"
#include <stddef.h>
#include <stdint.h>

struct table_rows {
    size_t nrow;
    size_t *longest;          /* of every column: bytes of its longest word, values of its longest row (ragged); at least 1 */
    uint64_t values;          /* of the ragged column */
    /* The next block, NULL after the last one; valid until the next call. */
    int (*next)(struct table_rows *r, const struct table **block, struct err *e);
    void (*again)(struct table_rows *r);       /* back to the first block */
};

/* The rows of a table in memory. */
struct table_whole {
    struct table_rows rows;
    const struct table *t;
    int given;
};

MUST_CHECK int table_whole_init(struct table_whole *w, const struct table *t);      /* E_NOMEM */
void table_whole_free(struct table_whole *w);

/* Rows kept for later: the last 4 MiB in memory, the others in a file without a name in $TMPDIR. */
struct row_spool;

MUST_CHECK int row_spool_open(struct row_spool **s);
void row_spool_close(struct row_spool *s);

/* Append the rows of t; every block must have the same columns. E_NOMEM, E_IO (errno tells). */
MUST_CHECK int row_spool_add(struct row_spool *s, const struct table *t);

/* What was added, from the first row on. The columns' names are those of `head`, which must outlive its use. */
MUST_CHECK int row_spool_rows(struct row_spool *s, const struct table *head, struct table_rows **rows);

#endif
