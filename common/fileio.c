/* fileio.c - descriptors and names. */
#include "fileio.h"
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* A call larger than this is cut: Linux moves at most 2 GiB - 4 KiB at once. */
static const size_t most = (size_t)1 << 30;

int file_open(const char *name, int flags, mode_t mode)
{
    int fd;
    do
        fd = open(name, flags | O_CLOEXEC, mode);
    while (fd < 0 && errno == EINTR);
    if (fd < 0 || fd > 2)
        return fd;
    int high = fcntl(fd, F_DUPFD_CLOEXEC, 3), why = errno;
    close(fd);
    errno = why;
    return high;
}

/* To the file's own position (at < 0) or to a given one. */
static int write_all(int fd, const void *buf, size_t n, int64_t at)
{
    for (size_t done = 0; done < n;) {
        const size_t want = n - done < most ? n - done : most;
        const char *from = (const char *)buf + done;
        ssize_t k = at < 0 ? write(fd, from, want) : pwrite(fd, from, want, (off_t)at + (off_t)done);
        if (k < 0 && errno == EINTR)
            continue;
        if (k <= 0) {
            errno = k ? errno : EIO;
            return -1;
        }
        done += (size_t)k;
    }
    return 0;
}

int file_write(int fd, const void *buf, size_t n)
{
    return write_all(fd, buf, n, -1);
}

int file_pwrite(int fd, const void *buf, size_t n, uint64_t offset)
{
    return write_all(fd, buf, n, (int64_t)offset);
}

/* Until n bytes or the end, from the file's own position (at < 0) or from a given one. */
static ssize_t read_all(int fd, void *buf, size_t n, int64_t at)
{
    size_t got = 0;
    while (got < n) {
        size_t want = n - got < most ? n - got : most;
        char *to = (char *)buf + got;
        ssize_t k = at < 0 ? read(fd, to, want) : pread(fd, to, want, (off_t)at + (off_t)got);
        if (k < 0 && errno == EINTR)
            continue;
        if (k < 0)
            return -1;
        if (k == 0)
            break;
        got += (size_t)k;
    }
    return (ssize_t)got;
}

ssize_t file_read(int fd, void *buf, size_t n)
{
    return read_all(fd, buf, n, -1);
}

ssize_t file_pread(int fd, void *buf, size_t n, uint64_t offset)
{
    return read_all(fd, buf, n, (int64_t)offset);
}

int file_split(const char *name, char **path, char **suffix)
{
    struct stat sb;
    size_t n = strlen(name);
    const char *open = strrchr(name, '[');
    int has = n > 2 && name[n - 1] == ']' && open && open > name && lstat(name, &sb) != 0;

    char *p = has ? strndup(name, (size_t)(open - name)) : strdup(name);
    char *s = has ? strndup(open + 1, n - (size_t)(open - name) - 2) : NULL;
    if (!p || (has && !s)) {
        free(p);
        free(s);
        return E_NOMEM;
    }
    *path = p;
    *suffix = s;
    return OK;
}
