/* stored.c - big-endian values of a FITS image as numbers; see stored.h. */
#include "stored.h"
#include "simd.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PART = 1024 };

static uint32_t load32(const unsigned char *p)
{
    uint32_t v;
    memcpy(&v, p, 4);
    return __builtin_bswap32(v);
}

static uint64_t load64(const unsigned char *p)
{
    uint64_t v;
    memcpy(&v, p, 8);
    return __builtin_bswap64(v);
}

/* Rows of n values, `stride` bytes apart. */
WIDE static void copy_f32(float *restrict out, const unsigned char *restrict in, size_t stride, size_t n, size_t rows)
{
    for (size_t y = 0; y < rows; y++, in += stride, out += n)
        for (size_t i = 0; i < n; i++) {
            uint32_t v = load32(in + 4 * i);
            memcpy(out + i, &v, 4);
        }
}

WIDE static void from_f32(double *restrict out, const unsigned char *restrict in, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        uint32_t v = load32(in + 4 * i);
        float x;
        memcpy(&x, &v, 4);
        out[i] = (double)x;
    }
}

WIDE static void from_f64(double *restrict out, const unsigned char *restrict in, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        uint64_t v = load64(in + 8 * i);
        memcpy(out + i, &v, 8);
    }
}

WIDE static void from_u8(double *restrict out, const unsigned char *restrict in, size_t n)
{
    for (size_t i = 0; i < n; i++)
        out[i] = in[i];
}

WIDE static void from_i16(double *restrict out, const unsigned char *restrict in, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        uint16_t v;
        memcpy(&v, in + 2 * i, 2);
        out[i] = (int16_t)__builtin_bswap16(v);
    }
}

WIDE static void from_i32(double *restrict out, const unsigned char *restrict in, size_t n)
{
    for (size_t i = 0; i < n; i++)
        out[i] = (int32_t)load32(in + 4 * i);
}

/* The unsigned convention BZERO = 2^63 does not go through double. */
static int is_u64(const struct fits_unit *u)
{
    return u->bitpix == 64 && u->bscale == 1 && u->bzero == 0x1p63;
}

static void from_i64(double *restrict out, const unsigned char *restrict in, size_t n,
                     const struct fits_unit *u)
{
    int is_unsigned = is_u64(u);
    for (size_t i = 0; i < n; i++) {
        uint64_t v = load64(in + 8 * i);
        if (u->has_blank && (int64_t)v == u->blank)
            out[i] = NAN;
        else if (is_unsigned)
            out[i] = (double)(v ^ (uint64_t)1 << 63);
        else
            out[i] = u->bzero + u->bscale * (double)(int64_t)v;
    }
}

/* 64-bit integers without scaling: one rounding, to float. */
static void copy_i64(float *restrict out, const unsigned char *restrict in, size_t n,
                     const struct fits_unit *u)
{
    int is_unsigned = is_u64(u);
    for (size_t i = 0; i < n; i++) {
        uint64_t v = load64(in + 8 * i);
        if (u->has_blank && (int64_t)v == u->blank)
            out[i] = NAN;
        else
            out[i] = is_unsigned ? (float)(v ^ (uint64_t)1 << 63) : (float)(int64_t)v;
    }
}

void stored_double(const struct fits_unit *u, const unsigned char *in, size_t n, double *out)
{
    switch (u->bitpix) {
    case 8: from_u8(out, in, n); break;
    case 16: from_i16(out, in, n); break;
    case 32: from_i32(out, in, n); break;
    case 64: from_i64(out, in, n, u); return;
    case -32: from_f32(out, in, n); break;
    default: from_f64(out, in, n); break;
    }
    double scale = u->bscale, zero = u->bzero, blank = (double)u->blank;
    if (u->has_blank)
        for (size_t i = 0; i < n; i++)
            out[i] = out[i] == blank ? NAN : out[i];
    if (scale != 1 || zero != 0)
        for (size_t i = 0; i < n; i++)
            out[i] = zero + scale * out[i];
}

static int is_plain(const struct fits_unit *u)
{
    return u->bscale == 1 && u->bzero == 0;
}

static size_t bytes_of(const struct fits_unit *u)
{
    return (size_t)abs(u->bitpix) / 8;
}

void stored_float(const struct fits_unit *u, const unsigned char *in, size_t n, float *out)
{
    double part[PART];
    const int plain = is_plain(u);
    const size_t bytes = bytes_of(u);
    if (u->bitpix == -32 && plain) {
        copy_f32(out, in, 0, n, 1);
        return;
    }
    if (u->bitpix == 64 && (plain || is_u64(u))) {
        copy_i64(out, in, n, u);
        return;
    }
    for (size_t at = 0; at < n; at += PART) {
        size_t k = n - at < PART ? n - at : PART;
        stored_double(u, in + at * bytes, k, part);
        for (size_t i = 0; i < k; i++)
            out[at + i] = (float)part[i];
    }
}

void stored_box(const struct fits_unit *u, const unsigned char *in, size_t stride, size_t n, size_t rows, float *out)
{
    const size_t apart = stride * bytes_of(u);
    if (u->bitpix == -32 && is_plain(u))
        copy_f32(out, in, apart, n, rows);
    else
        for (size_t y = 0; y < rows; y++)
            stored_float(u, in + y * apart, n, out + y * n);
}
