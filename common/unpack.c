/*
 * unpack.c - tile-compressed images through cfitsio in a child process.
 *
 * The child gets a FITS file in memory that holds this HDU alone, with nothing
 * but its structural cards, so that no name and no other part of the input
 * reaches the library.  Pixels come back in shared memory; a byte on a socket
 * says "read" and "done".  Limits: address space 16 MiB + the compressed bytes
 * + 64 bytes a pixel of the tiles it caches; processor time 0.5 s + 0.5 us a
 * pixel for each request (cfitsio needs 0.005 to 0.05 us); no descriptors.
 */
#include "unpack.h"
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <fitsio.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#ifndef CFITSIO_LIBRARY
#define CFITSIO_LIBRARY "libcfitsio.so"
#endif

/* AddressSanitizer and ThreadSanitizer reserve terabytes of addresses. */
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define LIMIT_ADDRESSES 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define LIMIT_ADDRESSES 0
#endif
#endif
#ifndef LIMIT_ADDRESSES
#define LIMIT_ADDRESSES 1
#endif

enum { CARD = 80, MOST_DIM = 6, MOST_SIDE = 65535, BUFFER = 1 << 20, MiB = 1 << 20 };

/* How a request ended, beside a status of cfitsio (> 0). */
enum { DONE = 0, NO_LIBRARY = -1, OTHER_SHAPE = -2, NO_LIMIT = -3 };

/* What parent and child see both. */
struct shared {
    long z, y0, nrow;      /* the request */
    int status;            /* the answer */
    char why[200];
    double pix[];
};

struct unpack {
    struct source *src;
    struct unpack_shape shape;
    int hdu, keep_all;     /* keep_all: floats stored without loss, no value means "missing" */
    pid_t child;
    int socket;
    long rows;             /* that fit the buffer */
    size_t bytes;          /* of the shared memory */
    struct shared *shared;
};

/* ---- the keywords ---- */

static int known_algorithm(const struct header *h)
{
    static const char *const known[] = {"RICE_1", "RICE_ONE", "GZIP_1", "GZIP_2", "PLIO_1", "HCOMPRESS_1"};
    char name[72];
    if (header_str(h, "ZCMPTYPE", name, sizeof name) == OK)
        for (size_t i = 0; i < sizeof known / sizeof *known; i++)
            if (!strcmp(name, known[i]))
                return 1;
    return 0;
}

int unpack_shape(struct unpack_shape *s, const struct fits_unit *u, const char **why)
{
    const struct header *h = &u->cards;
    struct unpack_shape new = {.axis = {1, 1, 1}, .tile = 1, .cached = 1};
    long bitpix, naxis;
    double tiles = 1;
    *why = "ZCMPTYPE is not a known algorithm";
    if (!known_algorithm(h))
        return E_DATA;
    *why = "ZBITPIX is not one of 8 16 32 64 -32 -64";
    if (header_long(h, "ZBITPIX", &bitpix) || !(bitpix == 8 || bitpix == 16 || labs(bitpix) == 32 || labs(bitpix) == 64))
        return E_DATA;
    *why = "ZNAXIS is not in 1..6";
    if (header_long(h, "ZNAXIS", &naxis) || naxis < 1 || naxis > MOST_DIM)
        return E_DATA;
    for (int i = 0; i < naxis; i++) {
        char key[32];
        long side, tile;
        snprintf(key, sizeof key, "ZNAXIS%d", i + 1);
        *why = "a ZNAXISn is not in 1..65535";
        if (header_long(h, key, &side) || side < 1 || side > MOST_SIDE)
            return E_DATA;
        snprintf(key, sizeof key, "ZTILE%d", i + 1);
        int st = header_long(h, key, &tile);
        *why = "a ZTILEn is not a whole number above 0";
        if (st == E_MISSING)
            tile = i == 0 ? side : 1;
        else if (st || tile < 1)
            return E_DATA;
        tile = tile < side ? tile : side;
        tiles *= (double)((side + tile - 1) / tile);
        new.tile *= (double)tile;
        new.cached *= (double)(i == 0 ? side : tile);
        if (i < 3)
            new.axis[i] = side;
        else
            new.more_axes |= side > 1;
    }
    *why = "the table has not one row a tile";
    if (u->naxis != 2 || tiles != (double)u->axis[1])
        return E_DATA;
    *why = "a tile is larger than the length of the data can back";
    if (new.tile * (double)labs(bitpix) / 8 > 4.0 * MiB + 1100.0 * (double)u->data_size)
        return E_DATA;
    new.bitpix = (int)bitpix;
    new.naxis = (int)naxis;
    *s = new;
    return OK;
}

/* Floats stored as they are: neither a column nor a keyword ZSCALE. */
static int lossless(const struct fits_unit *u, const struct unpack_shape *s)
{
    char key[32], name[72];
    double v;
    long n = 0;
    if (s->bitpix > 0 || header_double(&u->cards, "ZSCALE", &v) == OK)
        return 0;
    if (header_long(&u->cards, "TFIELDS", &n))
        n = 0;
    for (long i = 1; i <= n && i <= 999; i++) {
        snprintf(key, sizeof key, "TTYPE%ld", i);
        if (header_str(&u->cards, key, name, sizeof name) == OK && !strcmp(name, "ZSCALE"))
            return 0;
    }
    return 1;
}

/* ---- the child ---- */

/* What is used of the library. */
struct library {
    __typeof__(ffomem) *open_memory;
    __typeof__(ffmahd) *move;
    __typeof__(ffgisz) *size;
    __typeof__(ffgpxv) *read;
    __typeof__(ffgerr) *text;
};

static int load(struct library *l)
{
    void *so = dlopen(CFITSIO_LIBRARY, RTLD_NOW | RTLD_LOCAL);
    if (!so)
        return NO_LIBRARY;
    *(void **)&l->open_memory = dlsym(so, "ffomem");
    *(void **)&l->move = dlsym(so, "ffmahd");
    *(void **)&l->size = dlsym(so, "ffgisz");
    *(void **)&l->read = dlsym(so, "ffgpxv");
    *(void **)&l->text = dlsym(so, "ffgerr");
    return l->open_memory && l->move && l->size && l->read && l->text ? DONE : NO_LIBRARY;
}

/* Only the socket stays, as descriptor 0; output goes nowhere; signals kill. */
static void leave_parent(int socket)
{
    for (int i = 1; i < NSIG; i++)
        signal(i, SIG_DFL);
    int nowhere = open("/dev/null", O_RDWR), s = fcntl(socket, F_DUPFD, 3), n = fcntl(nowhere, F_DUPFD, 3);
    if (nowhere < 0 || s < 0 || n < 0 || dup2(s, 0) < 0 || dup2(n, 1) < 0 || dup2(n, 2) < 0)
        _exit(EXIT_RUN);
    closefrom(3);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, NULL);
}

static int limit(int what, double bytes)
{
    const struct rlimit l = {(rlim_t)bytes, (rlim_t)bytes};
    return setrlimit((__rlimit_resource_t)what, &l);
}

/* Nothing but memory from now on, and `room` bytes more than there are. */
static int confine(double room)
{
    unsigned long pages = 0;
    FILE *f = fopen("/proc/self/statm", "r");
    int known = f && fscanf(f, "%lu", &pages) == 1;
    if (f)
        fclose(f);
    if (!known || limit(RLIMIT_CORE, 0) || limit(RLIMIT_FSIZE, 0) || limit(RLIMIT_NOFILE, 0))
        return NO_LIMIT;
    if (LIMIT_ADDRESSES && limit(RLIMIT_AS, (double)pages * (double)sysconf(_SC_PAGESIZE) + room) && errno != EPERM)
        return NO_LIMIT;
    return DONE;
}

/* SIGPROF ends the process after so much processor time; 0 stops the clock. */
static void clock_for(double seconds)
{
    const double whole = floor(seconds);
    const struct itimerval t = {.it_value = {(time_t)whole, (suseconds_t)((seconds - whole) * 1e6)}};
    setitimer(ITIMER_PROF, &t, NULL);
}

static int open_image(const struct library *l, const struct unpack *u, void **file, size_t *size, fitsfile **f)
{
    long axis[MOST_DIM] = {1, 1, 1, 1, 1, 1};
    int st = 0;
    l->open_memory(f, "image", READONLY, file, size, 0, NULL, &st);
    l->move(*f, 2, NULL, &st);
    l->size(*f, MOST_DIM, axis, &st);
    if (st == 0 && memcmp(axis, u->shape.axis, sizeof u->shape.axis))
        st = OTHER_SHAPE;
    return st;
}

static int decode(const struct library *l, const struct unpack *u, fitsfile *f)
{
    struct shared *s = u->shared;
    long first[MOST_DIM] = {1, s->y0 + 1, s->z + 1, 1, 1, 1};
    double missing = NAN;
    int any, st = 0;
    l->read(f, TDOUBLE, first, (LONGLONG)s->nrow * u->shape.axis[0], u->keep_all ? NULL : &missing, s->pix, &any, &st);
    return st;
}

_Noreturn static void serve(struct unpack *u, int socket, void *file, size_t size)
{
    struct library l = {0};
    fitsfile *f = NULL;
    struct shared *s = u->shared;
    char go = 0;
    leave_parent(socket);
    s->status = load(&l);
    if (s->status)
        snprintf(s->why, sizeof s->why, "%s", dlerror());
    else
        s->status = confine(16.0 * MiB + (double)size + 64 * u->shape.cached);
    clock_for(0.5);
    if (s->status == DONE)
        s->status = open_image(&l, u, &file, &size, &f);
    clock_for(0);
    while (read(0, &go, 1) == 1) {
        clock_for(0.5 + 5e-7 * (u->shape.cached + (double)s->nrow * (double)u->shape.axis[0]));
        if (s->status == DONE)
            s->status = decode(&l, u, f);
        clock_for(0);
        if (s->status > 0) {
            char text[FLEN_STATUS] = "";
            l.text(s->status, text);
            snprintf(s->why, sizeof s->why, "%s", text);
        }
        if (write(0, &go, 1) != 1)
            break;
    }
    _exit(EXIT_DONE);
}

/* ---- the parent ---- */

static size_t blocks(size_t n)
{
    return (n + FITS_BLOCK - 1) / FITS_BLOCK * FITS_BLOCK;
}

static char *put_card(char *to, const char *card)
{
    memset(to, ' ', CARD);
    memcpy(to, card, strlen(card));
    return to + CARD;
}

/* The HDU as a file of its own; munmap(*file, *size). */
static int small_file(struct source *src, const struct fits_unit *unit, double max_memory, void **file, size_t *size,
                      struct err *e)
{
    static const char *const primary[] = {"SIMPLE  =                    T", "BITPIX  =                    8",
                                          "NAXIS   =                    0", "EXTEND  =                    T", "END"};
    const struct header *h = &unit->cards;
    size_t n = 1;
    for (size_t i = 0; i < h->n; i++)
        n += fits_structural(h->card[i], unit) != 0;
    double all = (double)unit->data_size + (double)blocks(n * CARD) + 2.0 * FITS_BLOCK;
    if (!(all <= max_memory))
        return err_set(e, E_NOMEM, "%s: its compressed image has %.3g MB, more than --max-memory", source_name(src), all * 1e-6);
    *size = FITS_BLOCK + blocks(n * CARD) + blocks((size_t)unit->data_size);
    char *p = mmap(NULL, *size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0), *at = p;
    if (p == MAP_FAILED)
        return err_set(e, E_NOMEM, "%s: out of memory", source_name(src));
    memset(p, ' ', FITS_BLOCK + blocks(n * CARD));
    for (size_t i = 0; i < sizeof primary / sizeof *primary; i++)
        at = put_card(at, primary[i]);
    at = p + FITS_BLOCK;
    for (size_t i = 0; i < h->n; i++)
        if (fits_structural(h->card[i], unit))
            at = put_card(at, h->card[i]);
    put_card(at, "END");
    *file = p;
    int st = source_read(src, unit->data_at, p + FITS_BLOCK + blocks(n * CARD), (size_t)unit->data_size, e);
    if (st)
        munmap(p, *size);
    return st;
}

/* Fork; no handler of the parent may run in the child. */
static int start(struct unpack *u, void *file, size_t size, struct err *e)
{
    int pair[2];
    sigset_t all, old;
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair))
        return err_set(e, E_IO, "%s: cannot start a decoder: %s", source_name(u->src), strerror(errno));
    sigfillset(&all);
    sigprocmask(SIG_SETMASK, &all, &old);
    u->child = fork();
    int why = errno;
    if (u->child == 0)
        serve(u, pair[1], file, size);
    sigprocmask(SIG_SETMASK, &old, NULL);
    close(pair[1]);
    u->socket = pair[0];
    return u->child > 0 ? OK : err_set(e, E_IO, "%s: cannot start a decoder: %s", source_name(u->src), strerror(why));
}

int unpack_open(struct unpack **out, struct source *src, const struct fits_unit *unit, int hdu, double max_memory,
                struct err *e)
{
    const char *why;
    void *file = NULL;
    size_t size = 0;
    *out = NULL;
    struct unpack *u = calloc(1, sizeof *u);
    if (!u)
        return err_set(e, E_NOMEM, "%s: out of memory", source_name(src));
    *u = (struct unpack){.src = src, .hdu = hdu, .socket = -1};
    int st = unpack_shape(&u->shape, unit, &why);
    if (st)
        err_set(e, st, "%s: HDU %d: %s", source_name(src), hdu, why);
    if (st == OK)
        st = small_file(src, unit, max_memory, &file, &size, e);
    if (st) {
        free(u);
        return st;
    }
    size_t row = (size_t)u->shape.axis[0] * sizeof(double);
    u->keep_all = lossless(unit, &u->shape);
    u->rows = row < BUFFER ? (long)(BUFFER / row) : 1;
    u->bytes = sizeof *u->shared + (size_t)u->rows * row;
    void *p = mmap(NULL, u->bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    u->shared = p == MAP_FAILED ? NULL : p;
    st = u->shared ? start(u, file, size, e) : err_set(e, E_NOMEM, "%s: out of memory", source_name(src));
    munmap(file, size);
    if (st)
        unpack_close(u);
    else
        *out = u;
    return st;
}

/* The child's end; its wait status. */
static int stop(struct unpack *u)
{
    int status = 0;
    if (u->child > 0) {
        while (waitpid(u->child, &status, 0) < 0 && errno == EINTR)
            continue;
    }
    u->child = 0;
    return status;
}

void unpack_close(struct unpack *u)
{
    if (!u)
        return;
    if (u->child > 0)
        kill(u->child, SIGKILL);
    stop(u);
    if (u->socket >= 0)
        close(u->socket);
    if (u->shared)
        munmap(u->shared, u->bytes);
    free(u);
}

/* The child went away: tell how. */
static int ended(struct unpack *u, struct err *e)
{
    int status = stop(u);
    const char *name = source_name(u->src);
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGPROF)
        return err_set(e, E_DATA, "%s: HDU %d: decoding takes longer than such an image may: its tiles are broken", name, u->hdu);
    if (WIFSIGNALED(status))
        return err_set(e, E_DATA, "%s: HDU %d: the decoder crashed (%s): its tiles are broken", name, u->hdu,
                       strsignal(WTERMSIG(status)));
    return err_set(e, E_IO, "%s: HDU %d: the decoder ended early", name, u->hdu);
}

static int refused(const struct unpack *u, struct err *e)
{
    const char *name = source_name(u->src);
    const struct shared *s = u->shared;
    char why[sizeof s->why];
    memcpy(why, s->why, sizeof why);
    why[sizeof why - 1] = 0;
    switch (s->status) {
    case NO_LIBRARY:
        return err_set(e, E_IO, "%s: tile-compressed images need cfitsio, or run funpack first (%s)", name, why);
    case NO_LIMIT:
        return err_set(e, E_IO, "%s: a decoder's memory and time cannot be limited here: run funpack first", name);
    case OTHER_SHAPE:
        return err_set(e, E_DATA, "%s: HDU %d: its ZNAXISn cards contradict each other", name, u->hdu);
    case MEMORY_ALLOCATION:
        return err_set(e, E_DATA, "%s: HDU %d: decoding needs more memory than such an image may: its tiles are broken", name,
                       u->hdu);
    default:
        return err_set(e, E_DATA, "%s: HDU %d: cannot decode: %s", name, u->hdu, why);
    }
}

int unpack_rows(struct unpack *u, long z, long y0, long nrow, const double **pix, long *got, struct err *e)
{
    char go = 1;
    struct shared *s = u->shared;
    ssize_t k;
    if (u->child <= 0)
        return err_set(e, E_IO, "%s: HDU %d: the decoder ended early", source_name(u->src), u->hdu);
    s->z = z;
    s->y0 = y0;
    s->nrow = nrow < u->rows ? nrow : u->rows;
    const long n = s->nrow;
    do
        k = send(u->socket, &go, 1, MSG_NOSIGNAL);
    while (k < 0 && errno == EINTR);
    if (k == 1)
        do
            k = recv(u->socket, &go, 1, 0);
        while (k < 0 && errno == EINTR);
    if (k != 1)
        return ended(u, e);
    if (s->status != DONE)
        return refused(u, e);
    *pix = s->pix;
    *got = n;
    return OK;
}
