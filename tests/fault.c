/*
 * fault.c - preloaded library that makes the n-th call of a kind fail.
 *
 *   FAULT_KIND   malloc write read fsync rename linkat open close mmap
 *   FAULT_AT     n, counting from 1; 0 only counts
 *   FAULT_LAST   1: every call after the n-th fails too
 *   FAULT_COUNT  file that gets the number of calls at exit
 *
 * Calls before main() are not counted: the dynamic linker is not under test.
 */
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/types.h>
#include <unistd.h>

enum kind { MALLOC, WRITE, READ, FSYNC, RENAME, LINKAT, OPEN, CLOSE, MMAP, KINDS };
static const char *const names[KINDS] = {"malloc", "write", "read", "fsync", "rename", "linkat", "open", "close", "mmap"};
static int kind = -1, last;
static long at;
static atomic_long calls;

__attribute__((constructor)) static void begin(void)
{
    const char *k = getenv("FAULT_KIND"), *n = getenv("FAULT_AT");
    at = n ? strtol(n, NULL, 10) : 0;
    last = getenv("FAULT_LAST") != NULL;
    for (int i = 0; k && i < KINDS; i++)
        if (strcmp(k, names[i]) == 0)
            kind = i;
}

__attribute__((destructor)) static void end(void)
{
    const char *f = getenv("FAULT_COUNT");
    kind = -1;
    FILE *out = f ? fopen(f, "w") : NULL;
    if (out) {
        fprintf(out, "%ld\n", (long)calls);
        fclose(out);
    }
}

static int fails(int k)
{
    if (k != kind)
        return 0;
    long n = atomic_fetch_add(&calls, 1) + 1;
    return at > 0 && (n == at || (last && n > at));
}

/* declares `real`, the function of that name behind this library */
#define NEXT(name) __typeof__(name) *real = (__typeof__(name) *)dlsym(RTLD_NEXT, #name)

void *__libc_malloc(size_t);
void *__libc_calloc(size_t, size_t);
void *__libc_realloc(void *, size_t);

void *malloc(size_t n)
{
    if (fails(MALLOC)) { errno = ENOMEM; return NULL; }
    return __libc_malloc(n);
}

void *calloc(size_t n, size_t m)
{
    if (fails(MALLOC)) { errno = ENOMEM; return NULL; }
    return __libc_calloc(n, m);
}

void *realloc(void *p, size_t n)
{
    if (fails(MALLOC)) { errno = ENOMEM; return NULL; }
    return __libc_realloc(p, n);
}

ssize_t write(int fd, const void *b, size_t n)
{
    NEXT(write);
    if (fd != 2 && fails(WRITE)) { errno = ENOSPC; return -1; }
    return real(fd, b, n);
}

ssize_t pwrite(int fd, const void *b, size_t n, off_t o)
{
    NEXT(pwrite);
    if (fails(WRITE)) { errno = ENOSPC; return -1; }
    return real(fd, b, n, o);
}

ssize_t pwrite64(int fd, const void *b, size_t n, off_t o)
{
    NEXT(pwrite64);
    if (fails(WRITE)) { errno = ENOSPC; return -1; }
    return real(fd, b, n, o);
}

ssize_t read(int fd, void *b, size_t n)
{
    NEXT(read);
    if (fails(READ)) { errno = EIO; return -1; }
    return real(fd, b, n);
}

ssize_t pread(int fd, void *b, size_t n, off_t o)
{
    NEXT(pread);
    if (fails(READ)) { errno = EIO; return -1; }
    return real(fd, b, n, o);
}

ssize_t pread64(int fd, void *b, size_t n, off_t o)
{
    NEXT(pread64);
    if (fails(READ)) { errno = EIO; return -1; }
    return real(fd, b, n, o);
}

void *mmap(void *p, size_t n, int prot, int flags, int fd, off_t o)
{
    NEXT(mmap);
    if (fails(MMAP)) { errno = ENODEV; return MAP_FAILED; }
    return real(p, n, prot, flags, fd, o);
}

int fsync(int fd)
{
    NEXT(fsync);
    if (fails(FSYNC)) { errno = EIO; return -1; }
    return real(fd);
}

int rename(const char *a, const char *b)
{
    NEXT(rename);
    if (fails(RENAME)) { errno = EACCES; return -1; }
    return real(a, b);
}

int linkat(int d, const char *a, int e, const char *b, int f)
{
    NEXT(linkat);
    if (fails(LINKAT)) { errno = EACCES; return -1; }
    return real(d, a, e, b, f);
}

static int mode_of(int flags, va_list ap)
{
    return flags & (O_CREAT | __O_TMPFILE) ? va_arg(ap, int) : 0;
}

int open(const char *p, int flags, ...)
{
    NEXT(open);
    va_list ap;
    va_start(ap, flags);
    int mode = mode_of(flags, ap);
    va_end(ap);
    if (fails(OPEN)) { errno = EMFILE; return -1; }
    return real(p, flags, mode);
}

int open64(const char *p, int flags, ...)
{
    NEXT(open64);
    va_list ap;
    va_start(ap, flags);
    int mode = mode_of(flags, ap);
    va_end(ap);
    if (fails(OPEN)) { errno = EMFILE; return -1; }
    return real(p, flags, mode);
}

int close(int fd)
{
    NEXT(close);
    if (fails(CLOSE)) { real(fd); errno = EIO; return -1; }
    return real(fd);
}
