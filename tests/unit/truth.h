/* truth.h - read one numeric table of $SHARED/truth: tab-separated columns, # comments. */
#ifndef PIXSHEAR_TRUTH_H
#define PIXSHEAR_TRUTH_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TRUTH_COLUMNS 10

struct truth {
    int n;
    double (*row)[TRUTH_COLUMNS];
};

/* Rows of $SHARED/truth/NAME; n = 0 when there is no such file or a row is not numbers. */
__attribute__((unused))
static struct truth truth_read(const char *name)
{
    struct truth t = {0, NULL};
    const char *shared = getenv("SHARED");
    char path[4096], line[1024];
    snprintf(path, sizeof path, "%s/truth/%s", shared ? shared : "../shared", name);
    FILE *f = fopen(path, "r");
    while (f && fgets(line, sizeof line, f)) {
        if (line[0] == '#')
            continue;
        t.row = realloc(t.row, (size_t)(t.n + 1) * sizeof *t.row);
        if (!t.row)
            abort();
        memset(t.row[t.n], 0, sizeof *t.row);
        char *p = line, *end;
        for (int k = 0; k < TRUTH_COLUMNS; k++, p = end) {
            t.row[t.n][k] = strtod(p, &end);
            if (end == p)
                break;
        }
        t.n++;
    }
    if (f)
        fclose(f);
    return t;
}

__attribute__((unused))
static void truth_free(struct truth *t)
{
    free(t->row);
    t->row = NULL;
    t->n = 0;
}

#endif
