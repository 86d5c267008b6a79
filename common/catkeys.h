/*
 * catkeys.h - keywords of catalogues: those that come from their image, and numbers among them (pixshear(7)).
 */
#ifndef PIXSHEAR_CATKEYS_H
#define PIXSHEAR_CATKEYS_H

#include "err.h"
#include "header.h"
#include "table.h"

/* Those of the image's keywords that the next programs need, over the catalogue's own. */
MUST_CHECK int catkeys_copy(struct table *t, const struct header *h);

/*
 * A number of a catalogue's header: NaN when there is none or it is nan.  E_DATA when the keyword
 * has another text; e tells keyword and text, the caller puts the file before it.
 */
MUST_CHECK int catkeys_number(const struct table *t, const char *key, double *value, struct err *e);

/* The HISTORY of the image, appended to the catalogue's. */
MUST_CHECK int catkeys_history(struct table *t, const struct header *h);

#endif
