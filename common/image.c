/* image.c - pixels in memory. */
#include "image.h"
#include "pages.h"
#include <stdlib.h>

static int take(struct image *im, long nx, long ny, int clear)
{
    if (nx < 1 || ny < 1 || nx > IMAGE_SIDE || ny > IMAGE_SIDE)
        return E_RANGE;
    size_t n = (size_t)nx * (size_t)ny;
    float *pix = clear ? calloc(n, sizeof *pix) : pages_block(n * sizeof *pix);
    if (!pix)
        return E_NOMEM;
    pages_large(pix, n * sizeof *pix);
    *im = (struct image){.nx = nx, .ny = ny, .pix = pix};
    return OK;
}

int image_new(struct image *im, long nx, long ny)
{
    return take(im, nx, ny, 1);
}

int image_room(struct image *im, long nx, long ny)
{
    return take(im, nx, ny, 0);
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
