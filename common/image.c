/* image.c - pixels in memory. */
#include "image.h"
#include "pages.h"
#include <stdlib.h>

int image_new(struct image *im, long nx, long ny)
{
    if (nx < 1 || ny < 1 || nx > 65535 || ny > 65535)
        return E_RANGE;
    float *pix = calloc((size_t)nx * (size_t)ny, sizeof *pix);
    if (!pix)
        return E_NOMEM;
    pages_large(pix, (size_t)nx * (size_t)ny * sizeof *pix);
    *im = (struct image){.nx = nx, .ny = ny, .pix = pix};
    return OK;
}

void image_free(struct image *im)
{
    free(im->pix);
    header_free(&im->hdr);
    *im = (struct image){0};
}

size_t image_count(const struct image *im)
{
    return (size_t)im->nx * (size_t)im->ny;
}
