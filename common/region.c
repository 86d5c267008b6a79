/* region.c - ellipses for DS9. */
#include "region.h"
#include "outfile.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const double REACH = 1e9;       /* pixels */

struct region {
    struct outfile *f;
    const char *name;
    int st;
};

int region_open(struct region **r, const char *name, const char *const *inputs, size_t n_inputs, struct err *e)
{
    static const char head[] = "# Region file format: DS9 version 4.1\nglobal color=green\nimage\n";
    struct region *made = calloc(1, sizeof *made);
    if (!made)
        return err_set(e, E_NOMEM, "%s: %s", name, err_text(E_NOMEM));
    int st = outfile_open(&made->f, name, inputs, n_inputs, e);
    if (st) {
        free(made);
        return st;
    }
    made->name = name;
    made->st = outfile_write(made->f, head, sizeof head - 1);
    *r = made;
    return OK;
}

void region_ellipse(struct region *r, double x, double y, double a, double b, double theta, size_t number, const char *colour)
{
    char line[256];
    if (!(fabs(x) < REACH && fabs(y) < REACH && a < REACH && b < REACH && fabs(theta) < REACH))
        return;
    int len = snprintf(line, sizeof line, "ellipse(%.3f,%.3f,%.3f,%.3f,%.2f) # %s%s%stext={%zu}\n", x, y, a, b, theta,
                       colour ? "color=" : "", colour ? colour : "", colour ? " " : "", number);
    if (!r->st)
        r->st = outfile_write(r->f, line, (size_t)len);
}

int region_close(struct region *r, struct err *e)
{
    int st = r->st;
    if (st) {
        err_set(e, st, "%s: %s", r->name, err_text(st));
        outfile_abandon(r->f);
    } else {
        st = outfile_commit(r->f, e);
    }
    free(r);
    return st;
}
