/*
 * png.c - grey PNG pictures of 8 bits.
 *
 * Each row is predicted from nothing, its left or its upper neighbour,
 * whichever leaves the smallest sum of absolute differences, and deflated into
 * chunks of 64 KiB.
 */
#include "png.h"
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

enum { CHUNK = 64 << 10, FILTERS = 3 };

struct png {
    struct outfile *o;
    z_stream z;
    int deflating;
    size_t width, step;    /* bytes in a row, in a pixel */
    long left;             /* rows to come */
    unsigned char *above;  /* the row before */
    unsigned char *line[FILTERS];   /* filter number and filtered row */
    unsigned char *out;
};

static void put32(unsigned char *p, uint32_t v)
{
    for (int i = 3; i >= 0; i--, v >>= 8)
        p[i] = (unsigned char)v;
}

static int chunk(struct outfile *o, const char *type, const unsigned char *data, size_t n)
{
    unsigned char head[8], tail[4];
    put32(head, (uint32_t)n);
    memcpy(head + 4, type, 4);
    uLong crc = crc32(0, head + 4, 4);
    if (n)
        crc = crc32(crc, data, (uInt)n);
    put32(tail, (uint32_t)crc);
    int st = outfile_write(o, head, 8);
    if (st == OK && n)
        st = outfile_write(o, data, n);
    return st ? st : outfile_write(o, tail, 4);
}

void png_abandon(struct png *p)
{
    if (!p)
        return;
    if (p->deflating)
        deflateEnd(&p->z);
    for (int i = 0; i < FILTERS; i++)
        free(p->line[i]);
    free(p->above);
    free(p->out);
    free(p);
}

static int begin(struct png *p, long nx, long ny, int alpha)
{
    static const unsigned char magic[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    unsigned char header[13] = {0};
    p->above = calloc(p->width, 1);
    p->out = malloc(CHUNK);
    int good = p->above && p->out;
    for (int i = 0; i < FILTERS; i++)
        good &= (p->line[i] = malloc(p->width + 1)) != NULL;
    if (!good || deflateInit(&p->z, 6) != Z_OK)
        return E_NOMEM;
    p->deflating = 1;
    p->z.next_out = p->out;
    p->z.avail_out = CHUNK;
    put32(header, (uint32_t)nx);
    put32(header + 4, (uint32_t)ny);
    header[8] = 8;
    header[9] = alpha ? 4 : 0;
    int st = outfile_write(p->o, magic, 8);
    return st ? st : chunk(p->o, "IHDR", header, 13);
}

int png_open(struct png **out, struct outfile *o, long nx, long ny, int alpha)
{
    *out = NULL;
    if (nx < 1 || ny < 1 || nx > INT32_MAX || ny > INT32_MAX)
        return E_RANGE;
    struct png *p = calloc(1, sizeof *p);
    if (!p)
        return E_NOMEM;
    p->o = o;
    p->left = ny;
    p->step = alpha ? 2 : 1;
    p->width = (size_t)nx * p->step;
    int st = begin(p, nx, ny, alpha);
    if (st)
        png_abandon(p);
    else
        *out = p;
    return st;
}

/* Deflate n bytes; whole chunks go out, all of it with Z_FINISH. */
static int squeeze(struct png *p, unsigned char *data, size_t n, int flush)
{
    p->z.next_in = data;
    p->z.avail_in = (uInt)n;
    for (;;) {
        int z = deflate(&p->z, flush);
        if (z == Z_STREAM_ERROR)
            return E_NOMEM;
        if (p->z.avail_out == 0 || z == Z_STREAM_END) {
            int st = chunk(p->o, "IDAT", p->out, CHUNK - p->z.avail_out);
            if (st)
                return st;
            p->z.next_out = p->out;
            p->z.avail_out = CHUNK;
        }
        if (flush == Z_FINISH ? z == Z_STREAM_END : p->z.avail_in == 0)
            return OK;
    }
}

int png_row(struct png *p, const unsigned char *row)
{
    uint64_t cost[FILTERS] = {0};
    int best = 0;
    if (p->left < 1)
        return E_RANGE;
    for (int f = 0; f < FILTERS; f++) {
        unsigned char *to = p->line[f];
        *to++ = (unsigned char)f;
        for (size_t i = 0; i < p->width; i++) {
            unsigned char left = i < p->step ? 0 : row[i - p->step];
            to[i] = (unsigned char)(row[i] - (f == 0 ? 0 : f == 1 ? left : p->above[i]));
            cost[f] += (uint64_t)abs((signed char)to[i]);
        }
        if (cost[f] < cost[best])
            best = f;
    }
    memcpy(p->above, row, p->width);
    p->left--;
    return squeeze(p, p->line[best], p->width + 1, Z_NO_FLUSH);
}

int png_finish(struct png *p)
{
    int st = p->left ? E_RANGE : squeeze(p, NULL, 0, Z_FINISH);
    if (st == OK)
        st = chunk(p->o, "IEND", NULL, 0);
    png_abandon(p);
    return st;
}
