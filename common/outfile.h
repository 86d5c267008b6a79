/*
 * outfile.h - output that appears whole or not at all.
 *
 * A named regular file is written under a temporary name in the same folder
 * (without a name at all where the system has O_TMPFILE), its size checked,
 * synced (not with PIXSHEAR_SYNC=0 in the environment) and renamed.  Standard output and devices get their bytes only at
 * commit, from a spool; a reader that went away or a full device is an error.
 */
#ifndef PIXSHEAR_OUTFILE_H
#define PIXSHEAR_OUTFILE_H

#include "err.h"
#include <stddef.h>
#include <stdint.h>

struct outfile;

/*
 * Open for writing; "-" is standard output.  Refused: a folder, a dangling
 * link, and a file that is one of the n_inputs inputs by name, link or hard
 * link.  On failure e tells the cause and *o is NULL.
 */
MUST_CHECK int outfile_open(struct outfile **o, const char *name, const char *const *inputs,
                            size_t n_inputs, struct err *e);

/* OK when the file could be opened now, else the cause: told before hours of work, and before another output appears. */
MUST_CHECK int outfile_ready(const char *name, const char *const *inputs, size_t n_inputs, struct err *e);

/*
 * 1 when two output names mean one file (by name, link or folder; "-" is one
 * file with itself), also when neither exists yet.
 */
int outfile_same(const char *a, const char *b);

/* Append n bytes, buffered. */
MUST_CHECK int outfile_write(struct outfile *o, const void *buf, size_t n);

/* n more bytes will come: a hint that makes them cheaper. */
void outfile_expect(struct outfile *o, uint64_t n);

/* Append n zero bytes, to be overwritten; a large number of them costs nothing. */
MUST_CHECK int outfile_skip(struct outfile *o, uint64_t n);

/* Overwrite bytes already appended (FITS headers whose checksums come last). */
MUST_CHECK int outfile_patch(struct outfile *o, uint64_t offset, const void *buf, size_t n);

/* 1 when the target gets its bytes at commit: standard output, a device, a FIFO. */
int outfile_is_stream(const struct outfile *o);

/*
 * Bytes that a stream gets at commit after those appended, straight from the
 * caller's memory: `more` points *p to the next bytes and tells how many there
 * are, 0 at the end.  It must not fail.  Nothing may be appended afterwards.
 */
void outfile_follow(struct outfile *o, size_t (*more)(void *state, const void **p), void *state);

/* Bytes appended so far. */
uint64_t outfile_size(const struct outfile *o);

/* Make the file appear; frees o whatever happens. e tells the cause. */
MUST_CHECK int outfile_commit(struct outfile *o, struct err *e);

/*
 * For programs with several outputs: from here on outfile_commit() makes files
 * ready on disk but does not let them appear (streams get their bytes), and
 * outfile_appear() renames all that wait.  When one cannot be made, or renamed,
 * none of the new ones is there.
 */
void outfile_together(void);
MUST_CHECK int outfile_appear(struct err *e);

/* Descriptor of a file without a name in $TMPDIR or /tmp, for what does not fit in memory; -1 and errno. */
int outfile_spool(void);

/* Give up: leave nothing behind. o may be NULL. */
void outfile_abandon(struct outfile *o);

#endif
