/*
 * fileio.h - descriptors and names: the system calls that inputs and outputs
 * share, with interrupted and short calls taken care of.
 */
#ifndef PIXSHEAR_FILEIO_H
#define PIXSHEAR_FILEIO_H

#include "err.h"
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

/*
 * open(2) with O_CLOEXEC, never descriptor 0, 1 or 2 (which may be closed when
 * the program starts and must not become a data file).  -1 and errno on failure.
 */
int file_open(const char *name, int flags, mode_t mode);

/* All n bytes at the current position, or -1 and errno. */
MUST_CHECK int file_write(int fd, const void *buf, size_t n);

/* All n bytes at an offset, or -1 and errno. */
MUST_CHECK int file_pwrite(int fd, const void *buf, size_t n, uint64_t offset);

/* Up to n bytes, fewer only at the end of the file; -1 and errno. */
ssize_t file_read(int fd, void *buf, size_t n);
ssize_t file_pread(int fd, void *buf, size_t n, uint64_t offset);

/*
 * The one suffix an input name may have: when no file has the literal name and
 * it ends in "[...]", *path is what stands before and *suffix what stands
 * between the brackets; else *path is the name and *suffix NULL.  Both are
 * allocated.  E_NOMEM.
 */
MUST_CHECK int file_split(const char *name, char **path, char **suffix);

#endif
