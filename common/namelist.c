/*
 * namelist.c - names of files, some of them in lists.
 */
#include "namelist.h"
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

void names_free(struct names *s)
{
    for (size_t i = 0; i < s->n; i++)
        free(s->v[i]);
    free(s->v);
    *s = (struct names){0};
}

static int add(struct names *s, const char *name)
{
    char **more = realloc(s->v, (s->n + 1) * sizeof *more);
    if (!more)
        return E_NOMEM;
    s->v = more;
    s->v[s->n] = strdup(name);
    if (!s->v[s->n])
        return E_NOMEM;
    s->n++;
    return OK;
}

/* Without blanks at both ends; NULL when nothing is left or it is a comment, and for control characters *bad. */
static char *name_of(char *line, size_t length, int *bad)
{
    char *end = line + length;
    while (end > line && strchr(" \t\r\n", end[-1]))
        *--end = 0;
    line += strspn(line, " \t");
    for (const char *p = line; p < end; p++)
        *bad |= (unsigned char)*p < 32 || *p == 127;
    return *line && *line != '#' ? line : NULL;
}

static int add_list(struct names *s, const char *file, struct err *e)
{
    FILE *f = fopen(file, "re");
    if (!f)
        return err_set(e, E_IO, "@%s: cannot read the list: %s", file, strerror(errno));
    char *line = NULL;
    size_t room = 0, number = 0;
    ssize_t length;
    int st = OK;
    while (st == OK && (errno = 0, length = getline(&line, &room, f)) >= 0) {
        int bad = 0;
        const char *name = name_of(line, (size_t)length, &bad);
        number++;
        if (bad || s->n >= NAMES_MAX)
            st = err_set(e, E_DATA, "@%s: line %zu: %s", file, number,
                         bad ? "not a name: a list is text, one file name a line" : "too many names");
        else if (name && add(s, name))
            st = err_set(e, E_NOMEM, "@%s: %s", file, err_text(E_NOMEM));
    }
    if (st == OK && (ferror(f) || !feof(f)))
        st = errno == ENOMEM ? err_set(e, E_NOMEM, "@%s: %s", file, err_text(E_NOMEM))
                             : err_set(e, E_IO, "@%s: cannot read the list: %s", file, strerror(errno));
    free(line);
    fclose(f);
    return st;
}

int names_expand(struct names *out, size_t n, const char *const *word, struct err *e)
{
    struct names s = {0};
    int st = OK;
    for (size_t i = 0; i < n && st == OK; i++) {
        const size_t before = s.n;
        if (word[i][0] != '@' || access(word[i], F_OK) == 0) {
            st = add(&s, word[i]) ? err_set(e, E_NOMEM, "%s: %s", word[i], err_text(E_NOMEM)) : OK;
            continue;
        }
        st = add_list(&s, word[i] + 1, e);
        if (st == OK && s.n == before)
            st = err_set(e, E_DATA, "%s: no name in the list", word[i]);
    }
    if (st)
        names_free(&s);
    else
        *out = s;
    return st;
}
