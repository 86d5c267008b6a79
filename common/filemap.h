/*
 * filemap.h - a plain file in the address space: nothing is copied, nothing held but what the system keeps of the file anyway.
 *
 * A page that cannot be had any more (the file was cut, or the disk fails) ends the process where it is read, with the message
 * "program: name: ..." and status 1; so nothing may be mapped while an output is half written under its own name.
 */
#ifndef PIXSHEAR_FILEMAP_H
#define PIXSHEAR_FILEMAP_H

#include "err.h"
#include <stdint.h>

struct filemap;

/* The first `size` bytes of a regular file, `name` in messages. E_IO: it cannot be mapped; E_NOMEM. */
MUST_CHECK int filemap_open(struct filemap **m, int fd, uint64_t size, const char *name);
const unsigned char *filemap_bytes(const struct filemap *m);

/* Has the file the size and the time of its last change that it had when it was mapped? */
int filemap_unchanged(const struct filemap *m);
void filemap_close(struct filemap *m);

#endif
