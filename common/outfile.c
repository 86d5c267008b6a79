/*
 * outfile.c - output that appears whole or not at all.
 *
 * A regular file is collected in a file without a name (O_TMPFILE) in the
 * folder of the target; at commit its size is checked, it is synced, linked
 * under a temporary name and renamed.  Where the file system cannot do that it
 * has the temporary name ".NAME.XXXXXXXX.tmp" from the start.  Standard output,
 * devices and FIFOs get their bytes at commit, from memory up to 8 MiB and
 * from an unlinked temporary file beyond.
 *
 * This file alone changes signals: SIGPIPE and SIGXFSZ are ignored, so that
 * write() tells the cause, and INT, TERM and HUP remove temporary names.
 */
#include "outfile.h"
#include "fileio.h"
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum { FILE_BUFFER = 512 << 10, SPOOL = 8 << 20, COPY = 256 << 10, EXPECT_LEAST = 1 << 20, TEMPS = 64 };

struct outfile {
    char *name;            /* as the user gave it */
    char *path;            /* resolved target; NULL for standard output */
    char *temp;            /* temporary name, NULL while there is none */
    int stream;            /* copied at commit instead of renamed */
    int replaces;          /* the target exists, with this mode */
    int ready;             /* on disk under the temporary name: only the rename is left */
    mode_t mode;
    int fd;                /* where flushed bytes are; -1 none yet */
    unsigned char *buf;    /* bytes base .. base + n of the output */
    size_t n, cap, limit;
    uint64_t base;
    int status, why;       /* first failure and its errno */
    size_t (*more)(void *state, const void **p);   /* NULL: nothing follows */
    void *state;
};

/*
 * Names that must go when the program ends or a signal ends it.  A handler has
 * no other way to know them, nor writers of one of several outputs that there
 * are others; with the lock of FFTW's planner (fft.c) and the files mapped (filemap.c)
 * these are the only variables at file scope in the project.
 */
static char *volatile doomed[TEMPS];
static int watching;
static struct outfile *waiting[TEMPS];     /* ready, for outfile_appear() */
static size_t n_waiting;
static int together;

static void remove_doomed(void)
{
    for (int i = 0; i < TEMPS; i++)
        if (doomed[i])
            unlink(doomed[i]);
}

static void on_signal(int sig)
{
    remove_doomed();
    signal(sig, SIG_DFL);
    raise(sig);
}

static void watch_signals(void)
{
    static const int fatal[] = {SIGINT, SIGTERM, SIGHUP};
    struct sigaction old, act = {.sa_handler = on_signal};
    if (watching)
        return;
    watching = 1;
    atexit(remove_doomed);
    for (size_t i = 0; i < sizeof fatal / sizeof *fatal; i++)
        if (sigaction(fatal[i], NULL, &old) == 0 && old.sa_handler == SIG_DFL)
            sigaction(fatal[i], &act, NULL);
}

static void signals(int how, sigset_t *set)
{
    if (how == SIG_BLOCK) {
        sigset_t block;
        sigemptyset(&block);
        sigaddset(&block, SIGINT);
        sigaddset(&block, SIGTERM);
        sigaddset(&block, SIGHUP);
        sigprocmask(SIG_BLOCK, &block, set);
    } else {
        sigprocmask(SIG_SETMASK, set, NULL);
    }
}

/* ---- temporary names ---- */

/* folder/.NAME.XXXXXXXX.tmp, another one at each call; allocated. */
static char *temp_name(const char *path)
{
    static const char digit[] = "0123456789abcdefghijklmnopqrstuv";
    const char *slash = strrchr(path, '/');
    const char *base = slash ? slash + 1 : path;
    uint64_t r;
    if (getrandom(&r, sizeof r, GRND_NONBLOCK) != sizeof r) {
        struct timespec t;
        clock_gettime(CLOCK_MONOTONIC, &t);
        r = (uint64_t)t.tv_nsec * 0x9E3779B97F4A7C15u ^ (uint64_t)getpid();
    }
    char word[9] = "";
    for (int i = 0; i < 8; i++, r >>= 5)
        word[i] = digit[r & 31];
    char *s;
    if (asprintf(&s, "%.*s.%.200s.%s.tmp", (int)(base - path), path, base, word) < 0)
        return NULL;
    return s;
}

/* A new file of a temporary name (fd < 0), or such a name for fd; the name is watched. */
static int take_name(struct outfile *o, int fd)
{
    char self[40];
    snprintf(self, sizeof self, "/proc/self/fd/%d", fd);
    for (int tries = 0; tries < 100; tries++) {
        char *temp = temp_name(o->path);
        if (!temp) {
            errno = ENOMEM;
            return -1;
        }
        sigset_t mask;
        signals(SIG_BLOCK, &mask);
        int got = fd < 0 ? file_open(temp, O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW, 0666)
                         : linkat(AT_FDCWD, self, AT_FDCWD, temp, AT_SYMLINK_FOLLOW);
        int why = errno;
        if (got >= 0) {
            o->temp = temp;
            for (int i = 0; i < TEMPS; i++)
                if (!doomed[i]) {
                    doomed[i] = temp;
                    break;
                }
        }
        signals(SIG_SETMASK, &mask);
        if (got >= 0)
            return got;
        free(temp);
        errno = why;
        if (why != EEXIST)
            return -1;
    }
    return -1;
}

/* Forget the temporary name, after it was renamed or when it must go. */
static void drop_name(struct outfile *o, int renamed)
{
    if (!o->temp)
        return;
    if (!renamed)
        unlink(o->temp);
    for (int i = 0; i < TEMPS; i++)
        if (doomed[i] == o->temp)
            doomed[i] = NULL;
    free(o->temp);
    o->temp = NULL;
}

/* Without a name where possible (and /proc can give it one later), else with one. */
static int make_hidden(struct outfile *o)
{
    const char *slash = strrchr(o->path, '/');
    char *folder = slash ? strndup(o->path, (size_t)(slash - o->path) + 1) : strdup(".");
    if (!folder) {
        errno = ENOMEM;
        return -1;
    }
    int fd = -1;
    if (access("/proc/self/fd", X_OK) == 0)
        fd = file_open(folder, O_RDWR | O_TMPFILE, 0666);
    free(folder);
    if (fd >= 0)
        return fd;
    watch_signals();
    return take_name(o, -1);
}

int outfile_spool(void)
{
    const char *folder = getenv("TMPDIR");
    if (!folder || !*folder)
        folder = "/tmp";
    int fd = file_open(folder, O_RDWR | O_TMPFILE | O_EXCL, 0600);
    if (fd >= 0)
        return fd;
    struct outfile o = {.fd = -1};
    if (asprintf(&o.path, "%s/pixshear", folder) < 0) {
        errno = ENOMEM;
        return -1;
    }
    fd = take_name(&o, -1);
    int why = errno;
    drop_name(&o, 0);
    free(o.path);
    errno = why;
    return fd;
}

/* ---- opening ---- */

static void destroy(struct outfile *o)
{
    if (o->fd >= 0)
        close(o->fd);
    drop_name(o, 0);
    free(o->buf);
    free(o->path);
    free(o->name);
    free(o);
}

/* 1 when one of the inputs is the file sb. */
static int is_input(const struct stat *sb, const char *const *inputs, size_t n, int *st)
{
    for (size_t i = 0; i < n; i++) {
        struct stat in;
        char *path, *suffix;
        if (!inputs[i])
            continue;
        *st = file_split(inputs[i], &path, &suffix);
        if (*st)
            return 0;
        int got = strcmp(path, "-") ? stat(path, &in) : fstat(STDIN_FILENO, &in);
        free(path);
        free(suffix);
        if (got == 0 && S_ISREG(in.st_mode) && in.st_dev == sb->st_dev && in.st_ino == sb->st_ino)
            return 1;
    }
    return 0;
}

/* Find out what the target is; o->path, o->stream, o->replaces. */
static int look_at_target(struct outfile *o, const char *const *inputs, size_t n, struct err *e)
{
    struct stat sb;
    int st = OK, standard = !strcmp(o->name, "-");
    if (standard ? fstat(STDOUT_FILENO, &sb) : stat(o->name, &sb)) {
        if (standard)
            return err_set(e, E_IO, "standard output: %s", strerror(errno));
        if (errno != ENOENT)
            return err_set(e, E_IO, "%s: cannot write: %s", o->name, strerror(errno));
        if (lstat(o->name, &sb) == 0)
            return err_set(e, E_IO, "%s: a link to nothing: remove it or give another name", o->name);
        size_t len = strlen(o->name);
        if (len && o->name[len - 1] == '/')
            return err_set(e, E_IO, "%s: a folder, not a file name", o->name);
        o->path = strdup(o->name);
        return o->path ? OK : err_set(e, E_NOMEM, "%s: out of memory", o->name);
    }
    if (S_ISDIR(sb.st_mode))
        return err_set(e, E_IO, "%s: is a folder: give a file name", o->name);
    if (S_ISREG(sb.st_mode) && is_input(&sb, inputs, n, &st))
        return err_set(e, E_IO, "%s: is also an input: give another output", o->name);
    if (st)
        return err_set(e, st, "%s: %s", o->name, err_text(st));
    o->stream = standard || !S_ISREG(sb.st_mode);
    if (standard)
        return OK;
    if (access(o->name, W_OK))
        return err_set(e, E_IO, "%s: cannot write: %s", o->name, strerror(errno));
    o->replaces = !o->stream;
    o->mode = sb.st_mode & 0777;
    o->path = o->stream ? strdup(o->name) : realpath(o->name, NULL);
    return o->path ? OK : err_set(e, E_IO, "%s: cannot write: %s", o->name, strerror(errno));
}

int outfile_open(struct outfile **o, const char *name, const char *const *inputs, size_t n_inputs,
                 struct err *e)
{
    *o = NULL;
    if (!*name)
        return err_set(e, E_IO, "the name of the output is empty");
    signal(SIGPIPE, SIG_IGN);
    signal(SIGXFSZ, SIG_IGN);

    struct outfile *f = calloc(1, sizeof *f);
    if (f) {
        f->fd = -1;
        f->name = strdup(name);
    }
    if (!f || !f->name) {
        free(f);
        return err_set(e, E_NOMEM, "%s: out of memory", name);
    }
    int st = look_at_target(f, inputs, n_inputs, e);
    if (st == OK && !f->stream) {
        f->fd = make_hidden(f);
        if (f->fd < 0)
            st = err_set(e, E_IO, "%s: cannot write: %s", name, strerror(errno));
    }
    if (st) {
        destroy(f);
        return st;
    }
    f->limit = f->stream ? SPOOL : FILE_BUFFER;
    *o = f;
    return OK;
}

int outfile_ready(const char *name, const char *const *inputs, size_t n_inputs, struct err *e)
{
    struct outfile *o;
    int st = outfile_open(&o, name, inputs, n_inputs, e);
    if (st == OK)
        outfile_abandon(o);
    return st;
}

/* ---- writing ---- */

static int failed(struct outfile *o, int status)
{
    if (o->status == OK) {
        o->status = status;
        o->why = errno;
    }
    errno = o->why;
    return o->status;
}

/*
 * Move the buffer to the file.  A buffer begins at a multiple of its size wherever it can: what is written so lies in large pieces in the
 * cache of the system (ext4), and a reader that maps 64 MiB of it takes 0.4 ms for the pages, not 4.
 */
static int flush(struct outfile *o)
{
    if (o->fd < 0 && (o->fd = outfile_spool()) < 0)
        return failed(o, E_IO);
    if (file_pwrite(o->fd, o->buf, o->n, o->base))
        return failed(o, E_IO);
    o->base += o->n;
    o->n = 0;
    return OK;
}

static int reserve(struct outfile *o, size_t n)
{
    if (n <= o->cap)
        return OK;
    size_t cap = o->cap ? o->cap : 64 << 10;
    while (cap < n)
        cap *= 2;
    unsigned char *p = realloc(o->buf, cap);
    if (!p) {
        errno = ENOMEM;
        return failed(o, E_NOMEM);
    }
    o->buf = p;
    o->cap = cap;
    return OK;
}

/* Bytes that the buffer takes: up to a multiple of its size. */
static size_t room_left(const struct outfile *o)
{
    return o->limit - (size_t)(o->base % o->limit) - o->n;
}

int outfile_write(struct outfile *o, const void *buf, size_t n)
{
    const unsigned char *from = buf;
    if (o->status)
        return failed(o, o->status);
    while (n) {
        const size_t room = room_left(o), k = n < room ? n : room;
        int st = reserve(o, o->n + k);
        if (st)
            return st;
        memcpy(o->buf + o->n, from, k);
        o->n += k;
        from += k;
        n -= k;
        if (n)
            st = flush(o);
        if (st)
            return st;
    }
    return OK;
}

/* ext4 writes a byte that has its block already in 3/4 of the time.  Whatever goes wrong, the write will tell. */
void outfile_expect(struct outfile *o, uint64_t n)
{
#ifdef FALLOC_FL_KEEP_SIZE
    const uint64_t at = o->base + o->n;
    if (!o->stream && o->fd >= 0 && n >= EXPECT_LEAST && at < INT64_MAX - n)
        (void)!fallocate(o->fd, FALLOC_FL_KEEP_SIZE, (off_t)at, (off_t)n);
#else
    (void)o;
    (void)n;
#endif
}

int outfile_skip(struct outfile *o, uint64_t n)
{
    if (o->status)
        return failed(o, o->status);
    if (n <= room_left(o)) {
        int st = reserve(o, o->n + (size_t)n);
        if (st)
            return st;
        memset(o->buf + o->n, 0, (size_t)n);
        o->n += (size_t)n;
        return OK;
    }
    int st = flush(o);
    o->base += st == OK ? n : 0;
    return st;
}

int outfile_patch(struct outfile *o, uint64_t offset, const void *buf, size_t n)
{
    if (o->status)
        return failed(o, o->status);
    uint64_t end = o->base + o->n;
    if (offset > end || n > end - offset)
        return E_RANGE;
    size_t low = offset >= o->base ? 0 : o->base - offset < n ? (size_t)(o->base - offset) : n;
    if (low && file_pwrite(o->fd, buf, low, offset))
        return failed(o, E_IO);
    if (low < n)
        memcpy(o->buf + (offset + low - o->base), (const char *)buf + low, n - low);
    return OK;
}

int outfile_is_stream(const struct outfile *o)
{
    return o->stream;
}

void outfile_follow(struct outfile *o, size_t (*more)(void *state, const void **p), void *state)
{
    o->more = more;
    o->state = state;
}

uint64_t outfile_size(const struct outfile *o)
{
    return o->base + o->n;
}

/* ---- finishing ---- */

/* Copy everything to fd. */
static int copy_out(struct outfile *o, int fd)
{
    if (o->fd < 0)
        return file_write(fd, o->buf, o->n);
    unsigned char *block = malloc(COPY);
    if (!block)
        return -1;
    int bad = 0;
    for (uint64_t at = 0; !bad && at < o->base;) {
        size_t want = o->base - at < COPY ? (size_t)(o->base - at) : COPY;
        ssize_t got = file_pread(o->fd, block, want, at);
        if (got >= 0 && (size_t)got != want)
            errno = EIO;
        bad = got < 0 || (size_t)got != want || file_write(fd, block, want);
        at += want;
    }
    int why = errno;
    free(block);
    errno = why;
    return bad ? -1 : 0;
}

/* What follows. */
static int copy_more(struct outfile *o, int fd)
{
    const void *p;
    int bad = 0;
    for (size_t n; o->more && !bad && (n = o->more(o->state, &p)) > 0;)
        bad = file_write(fd, p, n);
    return bad;
}

/* fsync, where the object can be synced at all, and unless the user does without. */
static int sync_fd(int fd)
{
    const char *wish = getenv("PIXSHEAR_SYNC");
    int bad;
    if (wish && strcmp(wish, "0") == 0)
        return 0;
    do
        bad = fsync(fd);
    while (bad && errno == EINTR);
    return bad && errno != EINVAL && errno != EROFS && errno != ENOTSUP ? -1 : 0;
}

static int commit_stream(struct outfile *o, struct err *e)
{
    int standard = !o->path;
    const char *who = standard ? "standard output" : o->name;
    struct stat sb;
    if (o->fd >= 0 && o->n && flush(o))
        return err_set(e, E_IO, "%s: cannot spool: %s", who, strerror(errno));
    int fd = standard ? fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 3) : file_open(o->path, O_WRONLY, 0);
    if (fd < 0 || fstat(fd, &sb)) {
        int st = err_set(e, E_IO, "%s: cannot write: %s", who, strerror(errno));
        if (fd >= 0)
            close(fd);
        return st;
    }
    off_t start = -1;                         /* where a regular file is cut again on failure */
    if (S_ISREG(sb.st_mode))
        start = fcntl(fd, F_GETFL) & O_APPEND ? sb.st_size : lseek(fd, 0, SEEK_CUR);
    int bad = copy_out(o, fd) || copy_more(o, fd) || sync_fd(fd), why = errno;
    if (bad && start >= 0 && ftruncate(fd, start) == 0)
        lseek(fd, start, SEEK_SET);
    if (close(fd) && !bad && errno != EINTR) {
        bad = 1;
        why = errno;
    }
    if (!bad)
        return OK;
    if (why == EPIPE)
        return err_set(e, E_IO, "%s: reader went away", who);
    return err_set(e, E_IO, "%s: cannot write: %s", who, strerror(why));
}

/* The folder's entry on disk, too; file systems that cannot are no failure. */
static void sync_folder(const char *path)
{
    const char *slash = strrchr(path, '/');
    char *folder = slash ? strndup(path, (size_t)(slash - path) + 1) : strdup(".");
    int fd = folder ? file_open(folder, O_RDONLY | O_DIRECTORY, 0) : -1;
    if (fd >= 0) {
        (void)sync_fd(fd);
        close(fd);
    }
    free(folder);
}

/* Everything on disk, under a temporary name: what may fail for want of room has been done. */
static int make_ready(struct outfile *o, struct err *e)
{
    struct stat sb;
    if (o->n && flush(o))
        return err_set(e, E_IO, "%s: cannot write: %s", o->name, strerror(errno));
    if (fstat(o->fd, &sb))
        return err_set(e, E_IO, "%s: cannot write: %s", o->name, strerror(errno));
    if ((uint64_t)sb.st_size != o->base)
        return err_set(e, E_IO, "%s: cannot write: %lld bytes arrived of %llu", o->name,
                       (long long)sb.st_size, (unsigned long long)o->base);
    if ((o->replaces && fchmod(o->fd, o->mode) && errno != EPERM) || sync_fd(o->fd) ||
        (!o->temp && (watch_signals(), take_name(o, o->fd) < 0)))
        return err_set(e, E_IO, "%s: cannot write: %s", o->name, strerror(errno));

    const int bad = close(o->fd) && errno != EINTR;
    o->fd = -1;
    if (bad)
        return err_set(e, E_IO, "%s: cannot write: %s", o->name, strerror(errno));
    free(o->buf);
    o->buf = NULL;
    o->ready = 1;
    return OK;
}

static int rename_ready(struct outfile *o, struct err *e)
{
    sigset_t mask;
    signals(SIG_BLOCK, &mask);
    const int bad = rename(o->temp, o->path), why = errno;
    drop_name(o, !bad);
    signals(SIG_SETMASK, &mask);
    return bad ? err_set(e, E_IO, "%s: cannot write: %s", o->name, strerror(why)) : OK;
}

static int commit_file(struct outfile *o, struct err *e)
{
    int st = make_ready(o, e);
    if (st || (together && n_waiting < TEMPS))
        return st;
    st = rename_ready(o, e);
    o->ready = 0;
    if (st == OK)
        sync_folder(o->path);
    return st;
}

int outfile_commit(struct outfile *o, struct err *e)
{
    int st;
    if (o->status == E_NOMEM)
        st = err_set(e, E_NOMEM, "%s: out of memory", o->name);
    else if (o->status)
        st = err_set(e, o->status, "%s: cannot write: %s", o->name, strerror(o->why));
    else
        st = o->stream ? commit_stream(o, e) : commit_file(o, e);
    if (st == OK && o->ready)
        waiting[n_waiting++] = o;
    else
        destroy(o);
    return st;
}

void outfile_together(void)
{
    together = 1;
}

int outfile_appear(struct err *e)
{
    int st = OK;
    size_t n = 0;
    while (n < n_waiting && st == OK) {
        st = rename_ready(waiting[n], e);
        n += st == OK;
    }
    for (size_t i = 0; i < n; i++) {
        if (st && !waiting[i]->replaces)
            unlink(waiting[i]->path);
        sync_folder(waiting[i]->path);
    }
    for (size_t i = 0; i < n_waiting; i++)
        destroy(waiting[i]);
    n_waiting = 0;
    together = 0;
    return st;
}

void outfile_abandon(struct outfile *o)
{
    if (o)
        destroy(o);
}

/* The folder of a name that need not exist; 0 on success. */
static int folder_of(const char *name, struct stat *sb)
{
    const char *slash = strrchr(name, '/');
    if (!slash)
        return stat(".", sb);
    char *folder = strndup(name, slash == name ? 1 : (size_t)(slash - name));
    const int st = folder ? stat(folder, sb) : -1;
    free(folder);
    return st;
}

int outfile_same(const char *a, const char *b)
{
    struct stat sa, sb;
    if (strcmp(a, b) == 0)
        return 1;
    if (strcmp(a, "-") == 0 || strcmp(b, "-") == 0)
        return 0;
    const int has_a = stat(a, &sa) == 0, has_b = stat(b, &sb) == 0;
    if (has_a && has_b)
        return sa.st_dev == sb.st_dev && sa.st_ino == sb.st_ino && !S_ISCHR(sa.st_mode);
    const char *base_a = strrchr(a, '/'), *base_b = strrchr(b, '/');
    return !has_a && !has_b && strcmp(base_a ? base_a + 1 : a, base_b ? base_b + 1 : b) == 0 && folder_of(a, &sa) == 0 &&
           folder_of(b, &sb) == 0 && sa.st_dev == sb.st_dev && sa.st_ino == sb.st_ino;
}
