/*
 * catkeys.h - keywords that go from an image to the catalogues made of it (pixshear(7)).
 */
#ifndef PIXSHEAR_CATKEYS_H
#define PIXSHEAR_CATKEYS_H

#include "err.h"
#include "header.h"
#include "table.h"

/* Those of the image's keywords that the next programs need, over the catalogue's own. */
MUST_CHECK int catkeys_copy(struct table *t, const struct header *h);

/* The HISTORY of the image, appended to the catalogue's. */
MUST_CHECK int catkeys_history(struct table *t, const struct header *h);

#endif
