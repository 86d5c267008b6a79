/* load.h - an image for a tool, or the end. */
#ifndef PIXSHEAR_TOOL_LOAD_H
#define PIXSHEAR_TOOL_LOAD_H

#include "err.h"
#include "imageio.h"

static struct image load(const char *name)
{
    struct image im;
    struct err e;
    if (image_read(&im, name, 4e9, &e))
        die(EXIT_RUN, "%s", e.text);
    return im;
}

#endif
