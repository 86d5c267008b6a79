/*
 * filemap.c - plain files in the address space; see filemap.h.
 *
 * SIGBUS is raised in the thread that touches the page, and there is no way back: the handler knows the mapped ranges and their
 * names, tells the first one hit, and ends.
 */
#include "filemap.h"
#include <errno.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MOST = 8, TEXT = 1024 };

struct filemap {
    int fd, place;             /* among the ranges watched */
    unsigned char *p;
    size_t size;
    struct stat then;
    size_t length;             /* of the message */
    char text[TEXT];
};

static _Atomic(struct filemap *) watched[MOST];
static atomic_flag told = ATOMIC_FLAG_INIT;

static void on_bus_error(int sig, siginfo_t *info, void *context)
{
    (void)context;
    for (int i = 0; i < MOST; i++) {
        const struct filemap *m = atomic_load(&watched[i]);
        if (!m || (uintptr_t)info->si_addr - (uintptr_t)m->p >= m->size)
            continue;
        while (atomic_flag_test_and_set(&told))
            pause();                   /* another thread is about to end all */
        (void)!write(STDERR_FILENO, m->text, m->length);
        _exit(EXIT_RUN);
    }
    signal(sig, SIG_DFL);              /* not ours: it comes again */
}

/* Take a place among the ranges watched; -1: there is none. */
static int watch(struct filemap *m)
{
    struct sigaction act = {.sa_sigaction = on_bus_error, .sa_flags = SA_SIGINFO};
    sigemptyset(&act.sa_mask);
    for (int i = 0; i < MOST; i++) {
        struct filemap *none = NULL;
        if (atomic_compare_exchange_strong(&watched[i], &none, m))
            return sigaction(SIGBUS, &act, NULL) == 0 ? i : (atomic_store(&watched[i], NULL), -1);
    }
    return -1;
}

static void set_text(struct filemap *m, const char *name)
{
    const int n = snprintf(m->text, TEXT - 1, "%s: %.700s: cannot be read any more: the file was cut, or the disk fails",
                           program_invocation_short_name, name);
    m->length = n < TEXT - 2 ? (size_t)n : TEXT - 2;
    for (size_t i = 0; i < m->length; i++)
        if ((unsigned char)m->text[i] < 0x20 || m->text[i] == 0x7f)
            m->text[i] = '?';
    m->text[m->length++] = '\n';
}

int filemap_open(struct filemap **out, int fd, uint64_t size, const char *name)
{
    struct filemap *m = size > 0 && size <= SIZE_MAX / 2 ? calloc(1, sizeof *m) : NULL;
    *out = NULL;
    if (!m)
        return size > 0 && size <= SIZE_MAX / 2 ? E_NOMEM : E_IO;
    *m = (struct filemap){.fd = fd, .size = (size_t)size, .p = MAP_FAILED};
    set_text(m, name);
    if (fstat(fd, &m->then) == 0 && S_ISREG(m->then.st_mode) && (uint64_t)m->then.st_size >= size)
        m->p = mmap(NULL, m->size, PROT_READ, MAP_PRIVATE, fd, 0);
    if (m->p == MAP_FAILED || (m->place = watch(m)) < 0) {
        if (m->p != MAP_FAILED)
            munmap(m->p, m->size);
        free(m);
        return E_IO;
    }
    *out = m;
    return OK;
}

const unsigned char *filemap_bytes(const struct filemap *m)
{
    return m->p;
}

int filemap_unchanged(const struct filemap *m)
{
    struct stat now;
    return fstat(m->fd, &now) == 0 && now.st_size == m->then.st_size && now.st_mtim.tv_sec == m->then.st_mtim.tv_sec
           && now.st_mtim.tv_nsec == m->then.st_mtim.tv_nsec;
}

void filemap_close(struct filemap *m)
{
    if (!m)
        return;
    atomic_store(&watched[m->place], NULL);
    munmap(m->p, m->size);
    free(m);
}
