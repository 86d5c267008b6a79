/*
 * namelist.h - names of files, some of them in lists.
 *
 * "@FILE" stands for the names in the text file FILE, one a line; blank lines
 * and lines that begin with # do not count.  A file that is itself called
 * "@FILE" is taken literally.
 */
#ifndef PIXSHEAR_NAMELIST_H
#define PIXSHEAR_NAMELIST_H

#include "err.h"
#include <stddef.h>

struct names {
    size_t n;
    char **v;
};

enum { NAMES_MAX = 65536 };

/* All names that the n words stand for, in order.  E_IO, E_DATA (no list of names, too many), E_NOMEM; then *out is empty. */
MUST_CHECK int names_expand(struct names *out, size_t n, const char *const *word, struct err *e);
void names_free(struct names *s);

#endif
