/*
 * ldac.h - catalogues as FITS_LDAC: a table LDAC_IMHEAD that holds the cards
 * of the image's header in one cell, then the table LDAC_OBJECTS.
 */
#ifndef PIXSHEAR_LDAC_H
#define PIXSHEAR_LDAC_H

#include "err.h"
#include "image.h"
#include "table.h"

/* Write as table_write does; the cards are those of a float32 image of im's size with im's header. */
MUST_CHECK int ldac_write(const struct table *t, const struct image *im, const char *name, const char *record,
                          const char *const *inputs, size_t n_inputs, struct err *e);

#endif
