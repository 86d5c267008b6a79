/* pixels.c - pieces of an image, from memory or from its input; see pixels.h. */
#include "pixels.h"
#include <string.h>

struct pixels pixels_of(const struct image *im)
{
    return (struct pixels){.nx = im->nx, .ny = im->ny, .pix = im->pix};
}

size_t pixels_count(const struct pixels *p)
{
    return (size_t)p->nx * (size_t)p->ny;
}

void pixels_box(const struct pixels *p, struct box box, float *out)
{
    const size_t stride = (size_t)p->nx, at = (size_t)box.y0 * stride + (size_t)box.x0, n = (size_t)box.nx;
    if (!p->pix) {
        p->copy(p->of, at, stride, box.nx, box.ny, out);
        return;
    }
    const float *from = p->pix + at;
    for (long y = 0; y < box.ny; y++, from += stride, out += n)
        memcpy(out, from, n * sizeof *out);
}

void pixels_row(const struct pixels *p, long y, long x0, long n, float *out)
{
    pixels_box(p, (struct box){x0, y, n, 1}, out);
}

float pixels_at(const struct pixels *p, long x, long y)
{
    float v;
    pixels_row(p, y, x, 1, &v);
    return v;
}
