/*
 * kernelio.h - detection kernels from files: a FITS image, or Source Extractor's
 * text:
 *
 *   CONV NORM          (or NONORM: the numbers as they are; CONV alone is NORM)
 *   # a comment
 *   1 2 1              rows as long as the first, the lowest y first
 *
 * NORM, and an image, is divided by the sum of the moduli, as Source Extractor does.
 */
#ifndef PIXSHEAR_KERNELIO_H
#define PIXSHEAR_KERNELIO_H

#include "err.h"
#include "smooth.h"

/* E_IO, E_DATA (no kernel, a value that is none, all are 0, a cube), E_NOMEM; then k is left alone. */
MUST_CHECK int kernel_read(struct kernel *k, const char *name, double max_memory, struct err *e);
void kernel_free(struct kernel *k);

#endif
