/*
 * source.h - the bytes of an input, at any offset: a plain file by pread, a
 * pipe or gzip data in memory, taken in only as far as somebody asks.
 */
#ifndef PIXSHEAR_SOURCE_H
#define PIXSHEAR_SOURCE_H

#include "err.h"
#include <stddef.h>
#include <stdint.h>

struct source;

/*
 * "-" is standard input.  gzip is recognised by its first bytes.  At most
 * max_memory bytes are held.  E_IO, E_NOMEM, E_DATA.
 */
MUST_CHECK int source_open(struct source **s, const char *path, double max_memory, struct err *e);
/* The same of a standard input whose first n bytes, `head`, have been read already. */
MUST_CHECK int source_open_begun(struct source **s, const void *head, size_t n, double max_memory, struct err *e);
void source_close(struct source *s);

/*
 * Make bytes up to `end` readable; *have gets how many there are, up to `end`.
 * For a plain file `end` costs nothing; for others memory grows as data come,
 * never on the word of a header.  A read error, broken gzip data or the memory
 * limit are failures; a short input is not.
 */
MUST_CHECK int source_need(struct source *s, uint64_t end, uint64_t *have, struct err *e);

/* n bytes from offset into buf. E_DATA when the input ends before. */
MUST_CHECK int source_read(struct source *s, uint64_t offset, void *buf, size_t n, struct err *e);

/*
 * Bring everything that source_need made readable within reach of source_at: a plain file is mapped (filemap.h), anything else
 * is in memory already.  A plain file that cannot be mapped is a failure without harm: source_read goes on.
 * source_unchanged: E_DATA when a file that was mapped is not the one it was.
 */
MUST_CHECK int source_map(struct source *s);
MUST_CHECK int source_unchanged(const struct source *s, struct err *e);

/* The n bytes at offset when they are in memory, else NULL (and source_read must be used). */
const unsigned char *source_at(const struct source *s, uint64_t offset, size_t n);

/*
 * Read to the end without keeping it, so that a gzip checksum is checked and a
 * writer is not cut off.  *rest: bytes after `from`; *blank: 1 when all are 0 or ' '.
 */
MUST_CHECK int source_drain(struct source *s, uint64_t from, uint64_t *rest, int *blank,
                            struct err *e);

const char *source_name(const struct source *s);     /* for messages */

#endif
