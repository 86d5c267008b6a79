/*
 * simd.h - mark a loop kernel to be built for several vector widths, chosen
 * when the program starts.  Without contraction and fast-math every width
 * gives the same bits.  Sanitizers cannot start through ifunc resolvers, so
 * those builds take the plain version.
 */
#ifndef PIXSHEAR_SIMD_H
#define PIXSHEAR_SIMD_H

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define SIMD_PLAIN 1
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SIMD_PLAIN 1
#endif

#if defined(__x86_64__) && defined(__linux__) && !defined(SIMD_PLAIN)
#define WIDE __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define WIDE
#endif

#endif
