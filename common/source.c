/*
 * source.c - the bytes of an input at any offset.
 *
 * gzip (RFC 1952) is inflated by zlib with its checksum verified; several
 * members one after the other are one input, as gunzip reads them.
 */
#include "source.h"
#include "fileio.h"
#include "filemap.h"
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

enum { IN = 64 << 10, BLOCK = 64 << 10 };

struct source {
    char *name;
    int fd;
    int plain;             /* read by pread from start; nothing is held */
    uint64_t start, size;  /* of a plain file */
    struct filemap *map;   /* of it, or NULL */
    unsigned char *mem;    /* bytes 0 .. held of anything else */
    uint64_t held, cap, limit;
    int ended;
    unsigned char *in;     /* bytes of the descriptor not used yet */
    size_t in_at, in_n;
    int gzip, in_member;
    z_stream z;
};

const char *source_name(const struct source *s)
{
    return s->name;
}

void source_close(struct source *s)
{
    if (!s)
        return;
    if (s->gzip)
        inflateEnd(&s->z);
    filemap_close(s->map);
    if (s->fd >= 0)
        close(s->fd);
    free(s->in);
    free(s->mem);
    free(s->name);
    free(s);
}

/* ---- opening ---- */

/* Look at the first two bytes and decide how to read on. head (n bytes): what was read before, or NULL. */
static int choose(struct source *s, const struct stat *sb, const void *head, size_t n, struct err *e)
{
    unsigned char magic[2] = {0};
    off_t at = S_ISREG(sb->st_mode) && !head ? lseek(s->fd, 0, SEEK_CUR) : -1;
    ssize_t got;
    if (at >= 0) {
        got = file_pread(s->fd, magic, 2, (uint64_t)at);
    } else {
        if (!(s->in = malloc(n > IN ? n : IN)))
            return err_set(e, E_NOMEM, "%s: out of memory", s->name);
        if (head)
            memcpy(s->in, head, n);
        got = head ? (ssize_t)n : file_read(s->fd, s->in, 2);
        s->in_n = got > 0 ? (size_t)got : 0;
        memcpy(magic, s->in, 2);
    }
    if (got < 0)
        return err_set(e, E_IO, "%s: cannot read: %s", s->name, strerror(errno));
    s->gzip = got >= 2 && magic[0] == 0x1f && magic[1] == 0x8b;
    s->plain = at >= 0 && !s->gzip;
    if (s->plain) {
        s->start = (uint64_t)at;
        s->size = sb->st_size > at ? (uint64_t)(sb->st_size - at) : 0;
        return OK;
    }
    if (!s->in && !(s->in = malloc(IN)))
        return err_set(e, E_NOMEM, "%s: out of memory", s->name);
    if (s->gzip && inflateInit2(&s->z, 15 + 16) != Z_OK) {
        s->gzip = 0;
        return err_set(e, E_NOMEM, "%s: out of memory", s->name);
    }
    s->in_member = s->gzip;
    return OK;
}

static int open_source(struct source **out, const char *path, const void *head, size_t n, double max_memory,
                       struct err *e)
{
    struct stat sb;
    int standard = !strcmp(path, "-"), st;
    *out = NULL;
    if (!*path)
        return err_set(e, E_IO, "the name of the input is empty");
    if (!(max_memory >= 1))
        return err_set(e, E_RANGE, "%s: no memory is allowed to hold it", path);
    struct source *s = calloc(1, sizeof *s);
    if (s)
        s->name = strdup(standard ? "standard input" : path);
    if (!s || !s->name) {
        free(s);
        return err_set(e, E_NOMEM, "%s: out of memory", path);
    }
    s->limit = max_memory < 0x1p60 ? (uint64_t)max_memory : (uint64_t)1 << 60;
    s->fd = standard ? fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 3) : file_open(path, O_RDONLY, 0);
    if (s->fd < 0 || fstat(s->fd, &sb))
        st = err_set(e, E_IO, "%s: cannot read: %s", s->name, strerror(errno));
    else if (S_ISDIR(sb.st_mode))
        st = err_set(e, E_IO, "%s: is a folder", s->name);
    else
        st = choose(s, &sb, head, n, e);
    if (st) {
        source_close(s);
        return st;
    }
    *out = s;
    return OK;
}

int source_open(struct source **s, const char *path, double max_memory, struct err *e)
{
    return open_source(s, path, NULL, 0, max_memory, e);
}

int source_open_begun(struct source **s, const void *head, size_t n, double max_memory, struct err *e)
{
    return open_source(s, "-", head, n, max_memory, e);
}

/* ---- reading on ---- */

/* More bytes into `in`; *got = 0 at the end. */
static int refill(struct source *s, size_t *got, struct err *e)
{
    ssize_t k;
    do
        k = read(s->fd, s->in, IN);
    while (k < 0 && errno == EINTR);
    if (k < 0)
        return err_set(e, E_IO, "%s: cannot read: %s", s->name, strerror(errno));
    s->in_at = 0;
    s->in_n = *got = (size_t)k;
    return OK;
}

/* After a gzip member: another one, zero padding, or the end. */
static int next_member(struct source *s, struct err *e)
{
    size_t got = 0;
    for (;;) {
        if (s->in_at == s->in_n) {
            int st = refill(s, &got, e);
            if (st)
                return st;
            if (got == 0) {
                s->ended = 1;
                return OK;
            }
        }
        if (s->in[s->in_at])
            break;
        s->in_at++;
    }
    if (s->in[s->in_at] != 0x1f || inflateReset(&s->z) != Z_OK)
        return err_set(e, E_DATA, "%s: gzip data followed by something else", s->name);
    s->in_member = 1;
    return OK;
}

/* Up to n bytes of gzip output; *got is less only at the end. */
static int inflate_some(struct source *s, unsigned char *to, size_t n, size_t *got, struct err *e)
{
    *got = 0;
    while (*got < n && !s->ended) {
        if (!s->in_member) {
            int st = next_member(s, e);
            if (st)
                return st;
            continue;
        }
        if (s->in_at == s->in_n) {
            size_t k = 0;
            int st = refill(s, &k, e);
            if (st)
                return st;
            if (k == 0)
                return err_set(e, E_DATA, "%s: gzip data end too early: file is cut", s->name);
        }
        s->z.next_in = s->in + s->in_at;
        s->z.avail_in = (uInt)(s->in_n - s->in_at);
        s->z.next_out = to + *got;
        s->z.avail_out = (uInt)(n - *got);
        int z = inflate(&s->z, Z_NO_FLUSH);
        s->in_at = s->in_n - s->z.avail_in;
        *got = n - s->z.avail_out;
        if (z == Z_STREAM_END)
            s->in_member = 0;
        else if (z == Z_MEM_ERROR)
            return err_set(e, E_NOMEM, "%s: out of memory", s->name);
        else if (z != Z_OK && z != Z_BUF_ERROR)
            return err_set(e, E_DATA, "%s: broken gzip data (%s)", s->name,
                           s->z.msg ? s->z.msg : "wrong checksum");
    }
    return OK;
}

/* Up to n bytes of the stream, whatever it is. */
static int take(struct source *s, unsigned char *to, size_t n, size_t *got, struct err *e)
{
    *got = 0;
    if (s->gzip)
        return inflate_some(s, to, n, got, e);
    while (*got < n && !s->ended) {
        if (s->in_at < s->in_n) {
            size_t k = s->in_n - s->in_at;
            if (k > n - *got)
                k = n - *got;
            memcpy(to + *got, s->in + s->in_at, k);
            s->in_at += k;
            *got += k;
            continue;
        }
        ssize_t k = file_read(s->fd, to + *got, n - *got);
        if (k < 0)
            return err_set(e, E_IO, "%s: cannot read: %s", s->name, strerror(errno));
        s->ended = (size_t)k < n - *got;
        *got += (size_t)k;
    }
    return OK;
}

int source_need(struct source *s, uint64_t end, uint64_t *have, struct err *e)
{
    if (s->plain) {
        *have = end < s->size ? end : s->size;
        return OK;
    }
    while (s->held < end && !s->ended) {
        if (s->held == s->cap) {
            uint64_t cap = s->cap ? 2 * s->cap : BLOCK;
            if (s->held >= s->limit)
                return err_set(e, E_NOMEM, "%s: needs more than --max-memory (%.3g MB)", s->name,
                               (double)s->limit * 1e-6);
            if (cap > s->limit)
                cap = s->limit;
            unsigned char *p = realloc(s->mem, (size_t)cap);
            if (!p)
                return err_set(e, E_NOMEM, "%s: out of memory", s->name);
            s->mem = p;
            s->cap = cap;
        }
        uint64_t want = s->cap - s->held;
        if (want > end - s->held)
            want = end - s->held;
        if (want > (1 << 30))
            want = 1 << 30;
        size_t got;
        int st = take(s, s->mem + s->held, (size_t)want, &got, e);
        if (st)
            return st;
        s->held += got;
    }
    *have = end < s->held ? end : s->held;
    return OK;
}

int source_map(struct source *s)
{
    return s->plain && !s->map ? filemap_open(&s->map, s->fd, s->start + s->size, s->name) : OK;
}

int source_unchanged(const struct source *s, struct err *e)
{
    if (s->map && !filemap_unchanged(s->map))
        return err_set(e, E_DATA, "%s: was changed while it was read", s->name);
    return OK;
}

const unsigned char *source_at(const struct source *s, uint64_t offset, size_t n)
{
    if (s->map)
        return offset <= s->size && n <= s->size - offset ? filemap_bytes(s->map) + s->start + offset : NULL;
    if (s->plain || offset > s->held || n > s->held - offset)
        return NULL;
    return s->mem + offset;
}

int source_read(struct source *s, uint64_t offset, void *buf, size_t n, struct err *e)
{
    const unsigned char *p = source_at(s, offset, n);
    if (p) {
        memcpy(buf, p, n);
        return OK;
    }
    ssize_t got = 0;
    if (s->plain && offset <= s->size && n <= s->size - offset) {
        got = file_pread(s->fd, buf, n, s->start + offset);
        if (got < 0)
            return err_set(e, E_IO, "%s: cannot read: %s", s->name, strerror(errno));
    }
    if ((size_t)got != n)
        return err_set(e, E_DATA, "%s: ends too early: file is cut", s->name);
    return OK;
}

int source_drain(struct source *s, uint64_t from, uint64_t *rest, int *blank, struct err *e)
{
    unsigned char *block = malloc(BLOCK);
    if (!block)
        return err_set(e, E_NOMEM, "%s: out of memory", s->name);
    int st = OK;
    *rest = 0;
    *blank = 1;
    for (;;) {
        uint64_t at = from + *rest;
        size_t n = 0;
        if (s->plain) {
            n = s->size - at < BLOCK ? (size_t)(s->size - at) : BLOCK;
            if (n)
                st = source_read(s, at, block, n, e);
        } else if (at < s->held) {
            n = s->held - at < BLOCK ? (size_t)(s->held - at) : BLOCK;
            memcpy(block, s->mem + at, n);
        } else if (!s->ended) {
            st = take(s, block, BLOCK, &n, e);
        }
        if (st || n == 0)
            break;
        for (size_t i = 0; i < n && *blank; i++)
            *blank = block[i] == 0 || block[i] == ' ';
        *rest += n;
    }
    free(block);
    return st;
}
