/*
 * fakefits.c - a library that stands in for cfitsio and misbehaves when pixels
 * are read, as FAKE tells: crash, hang, flood (memory), exit, write (files).
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

int ffomem(void **f, const char *name, int mode, void **buf, size_t *size, size_t delta, void *(*grow)(void *, size_t), int *st);
int ffmahd(void *f, int hdu, int *type, int *st);
int ffgisz(void *f, int n, long *axis, int *st);
int ffgpxv(void *f, int type, long *first, long long n, void *null, void *out, int *any, int *st);
void ffgerr(int st, char *text);

int ffomem(void **f, const char *name, int mode, void **buf, size_t *size, size_t delta, void *(*grow)(void *, size_t), int *st)
{
    (void)name, (void)mode, (void)buf, (void)size, (void)delta, (void)grow;
    *f = NULL;
    return *st;
}

int ffmahd(void *f, int hdu, int *type, int *st)
{
    (void)f, (void)hdu, (void)type;
    return *st;
}

int ffgisz(void *f, int n, long *axis, int *st)
{
    const char *side = getenv("FAKE_SIDE");
    (void)f, (void)n;
    axis[0] = axis[1] = side ? atol(side) : 0;
    return *st;
}

int ffgpxv(void *f, int type, long *first, long long n, void *null, void *out, int *any, int *st)
{
    const char *how = getenv("FAKE") ? getenv("FAKE") : "";
    (void)f, (void)type, (void)first, (void)null, (void)any;
    if (!strcmp(how, "crash"))
        abort();
    for (volatile long i = 0; !strcmp(how, "hang"); i++)
        continue;
    for (char *p; !strcmp(how, "flood");) {
        if (!(p = malloc(1 << 20)))
            return *st = 113;
        memset(p, 1, 1 << 20);
    }
    if (!strcmp(how, "exit"))
        exit(0);
    if (!strcmp(how, "write")) {
        FILE *o = fopen("stray", "w");
        if (o)
            fclose(o);
        printf("noise\n");
        fprintf(stderr, "noise\n");
        fflush(stdout);
    }
    memset(out, 0, (size_t)n * 8);
    return *st;
}

void ffgerr(int st, char *text)
{
    sprintf(text, "status %d", st);
}
