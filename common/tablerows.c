/*
 * tablerows.c - rows in blocks; see tablerows.h.
 *
 * A block on disk is its columns one after the other: numbers as they are in
 * memory, words with their final zero, a ragged column as its offsets and its
 * values.  Every part begins at a multiple of 8 bytes, so that a block read
 * back is used where it lies.
 */
#include "tablerows.h"
#include "fileio.h"
#include "outfile.h"
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* ---- longest words and rows ---- */

static void measure(struct table_rows *r, const struct table *t)
{
    for (size_t i = 0; i < t->ncol; i++) {
        const struct column *c = &t->col[i];
        for (size_t k = 0; k < t->nrow && (c->type == COL_TEXT || c->type == COL_RAGGED); k++) {
            const size_t n = c->type == COL_TEXT ? strlen(c->v.s[k]) : c->start[k + 1] - c->start[k];
            r->longest[i] = n > r->longest[i] ? n : r->longest[i];
        }
        if (c->type == COL_RAGGED)
            r->values += c->start[t->nrow] - c->start[0];
    }
    r->nrow += t->nrow;
}

static int begin(struct table_rows *r, size_t ncol)
{
    r->longest = malloc((ncol + 1) * sizeof *r->longest);
    for (size_t i = 0; r->longest && i < ncol; i++)
        r->longest[i] = 1;
    return r->longest ? OK : E_NOMEM;
}

/* ---- a table in memory ---- */

static int whole_next(struct table_rows *r, const struct table **block, struct err *e)
{
    struct table_whole *w = (struct table_whole *)r;
    (void)e;
    *block = w->given ? NULL : w->t;
    w->given = 1;
    return OK;
}

static void whole_again(struct table_rows *r)
{
    ((struct table_whole *)r)->given = 0;
}

int table_whole_init(struct table_whole *w, const struct table *t)
{
    *w = (struct table_whole){.rows = {.next = whole_next, .again = whole_again}, .t = t};
    if (begin(&w->rows, t->ncol))
        return E_NOMEM;
    measure(&w->rows, t);
    return OK;
}

void table_whole_free(struct table_whole *w)
{
    free(w->rows.longest);
    w->rows.longest = NULL;
}

/* ---- rows on disk ---- */

enum { HELD = 4 << 20 };

struct block {
    uint64_t offset;
    size_t size, nrow;
};

struct row_spool {
    struct table_rows rows;
    int fd;
    uint64_t base;            /* bytes in the file; buf goes on from there */
    char *buf;
    size_t n, cap;
    size_t blocks, room, at;
    struct block *block;
    struct table view;        /* the block given last: its columns point into buf or `back` */
    char ***word;             /* of every column of words: room for a block's */
    char *back;
    size_t back_cap;
};

static size_t padded(size_t n)
{
    return (n + 7) / 8 * 8;
}

int row_spool_open(struct row_spool **s)
{
    *s = calloc(1, sizeof **s);
    if (!*s)
        return E_NOMEM;
    (*s)->fd = -1;
    return OK;
}

void row_spool_close(struct row_spool *s)
{
    if (!s)
        return;
    if (s->fd >= 0)
        close(s->fd);
    for (size_t i = 0; s->word && i < s->view.ncol; i++)
        free(s->word[i]);
    free(s->word);
    free(s->view.col);
    free(s->rows.longest);
    free(s->block);
    free(s->back);
    free(s->buf);
    free(s);
}

static size_t column_size(const struct column *c, size_t nrow)
{
    size_t n = 0;
    if (c->type == COL_RAGGED)
        return 8 * (nrow + 1 + c->start[nrow] - c->start[0]);
    if (c->type != COL_TEXT)
        return 8 * nrow;
    for (size_t i = 0; i < nrow; i++)
        n += strlen(c->v.s[i]) + 1;
    return padded(n);
}

static void column_store(const struct column *c, size_t nrow, char *to)
{
    if (c->type == COL_RAGGED) {
        uint64_t *start = (uint64_t *)(void *)to;
        for (size_t i = 0; i <= nrow; i++)
            start[i] = c->start[i] - c->start[0];
        if (start[nrow])
            memcpy(to + 8 * (nrow + 1), c->v.r + c->start[0], 8 * start[nrow]);
    } else if (c->type == COL_TEXT) {
        for (size_t i = 0; i < nrow; i++)
            to = stpcpy(to, c->v.s[i]) + 1;
    } else if (nrow) {
        memcpy(to, c->v.r, 8 * nrow);
    }
}

/* Room for n bytes more behind those in the buffer, which goes to the file when it has enough. */
static int make_room(struct row_spool *s, size_t n)
{
    if (s->n && s->n + n > HELD) {
        if (s->fd < 0 && (s->fd = outfile_spool()) < 0)
            return E_IO;
        if (file_pwrite(s->fd, s->buf, s->n, s->base))
            return E_IO;
        s->base += s->n;
        s->n = 0;
    }
    if (s->n + n > s->cap) {
        size_t cap = s->n + n + s->cap / 2;
        char *buf = realloc(s->buf, cap);
        if (!buf)
            return E_NOMEM;
        s->buf = buf;
        s->cap = cap;
    }
    return OK;
}

int row_spool_add(struct row_spool *s, const struct table *t)
{
    size_t size = 0;
    if (!s->rows.longest && begin(&s->rows, t->ncol))
        return E_NOMEM;
    if (s->blocks == s->room) {
        struct block *b = realloc(s->block, (2 * s->room + 16) * sizeof *b);
        if (!b)
            return E_NOMEM;
        s->block = b;
        s->room = 2 * s->room + 16;
    }
    for (size_t i = 0; i < t->ncol; i++)
        size += column_size(&t->col[i], t->nrow);
    int st = make_room(s, size);
    if (st)
        return st;
    char *to = s->buf + s->n;
    for (size_t i = 0; i < t->ncol; to += column_size(&t->col[i++], t->nrow))
        column_store(&t->col[i], t->nrow, to);
    s->block[s->blocks++] = (struct block){.offset = s->base + s->n, .size = size, .nrow = t->nrow};
    s->n += size;
    measure(&s->rows, t);
    return OK;
}

/* The bytes of a block: in the buffer, or read back. NULL: failure. */
static char *fetch(struct row_spool *s, const struct block *b)
{
    if (b->offset >= s->base)
        return s->buf + (b->offset - s->base);
    if (b->size > s->back_cap) {
        char *back = realloc(s->back, b->size);
        if (!back) {
            errno = ENOMEM;
            return NULL;
        }
        s->back = back;
        s->back_cap = b->size;
    }
    ssize_t got = file_pread(s->fd, s->back, b->size, b->offset);
    if (got >= 0 && (size_t)got != b->size)
        errno = EIO;
    return got >= 0 && (size_t)got == b->size ? s->back : NULL;
}

/* Point the words of a block to where they lie. */
static int find_words(struct row_spool *s, size_t i, size_t nrow, char *from)
{
    char **word = realloc(s->word[i], (nrow + 1) * sizeof *word);
    if (!word)
        return E_NOMEM;
    s->word[i] = s->view.col[i].v.s = word;
    for (size_t k = 0; k < nrow; k++, from += strlen(from) + 1)
        word[k] = from;
    return OK;
}

static int spool_next(struct table_rows *r, const struct table **block, struct err *e)
{
    struct row_spool *s = (struct row_spool *)r;
    *block = NULL;
    if (s->at == s->blocks)
        return OK;
    const struct block *b = &s->block[s->at++];
    char *from = fetch(s, b);
    if (!from && b->size)
        return err_set(e, errno == ENOMEM ? E_NOMEM : E_IO, "cannot read the spool: %s", strerror(errno));
    s->view.nrow = s->view.cap = b->nrow;
    for (size_t i = 0; i < s->view.ncol; i++) {
        struct column *c = &s->view.col[i];
        c->v.r = (double *)(void *)from;
        if (c->type == COL_TEXT && find_words(s, i, b->nrow, from))
            return err_set(e, E_NOMEM, "%s", err_text(E_NOMEM));
        if (c->type == COL_RAGGED) {
            c->start = (size_t *)(void *)from;
            c->v.r = (double *)(void *)(from + 8 * (b->nrow + 1));
        }
        from += column_size(c, b->nrow);
    }
    *block = &s->view;
    return OK;
}

static void spool_again(struct table_rows *r)
{
    ((struct row_spool *)r)->at = 0;
}

int row_spool_rows(struct row_spool *s, const struct table *head, struct table_rows **rows)
{
    if (!s->rows.longest && begin(&s->rows, head->ncol))
        return E_NOMEM;
    s->view = (struct table){.ncol = head->ncol, .col = malloc((head->ncol + 1) * sizeof *s->view.col)};
    s->word = calloc(head->ncol + 1, sizeof *s->word);
    if (!s->view.col || !s->word) {
        s->view.ncol = 0;
        return E_NOMEM;
    }
    if (head->ncol)
        memcpy(s->view.col, head->col, head->ncol * sizeof *s->view.col);
    s->rows.next = spool_next;
    s->rows.again = spool_again;
    s->at = 0;
    *rows = &s->rows;
    return OK;
}
