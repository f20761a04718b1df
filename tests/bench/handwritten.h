/* Scenes of the benchmark as a good C programmer writes them: one function of
 * n points whose coordinates are in arrays, built at -O3 for this machine
 * alone, which the compiler vectorises over the points. */
#ifndef ZS_BENCH_HANDWRITTEN_H
#define ZS_BENCH_HANDWRITTEN_H

#include "scenes.h"

#include <stddef.h>

/* Points that are in registers at once: four vectors of the widest kind, so
 * that their latencies overlap. */
enum { HANDWRITTEN_POINTS = 64 };

/* f at n points; n is a multiple of HANDWRITTEN_POINTS. */
void handwritten_spheres(const spheres *scene, size_t n, const float *restrict x,
                         const float *restrict y, const float *restrict z, float *restrict f);
void handwritten_gyroid(size_t n, const float *restrict x, const float *restrict y,
                        const float *restrict z, float *restrict f);
void handwritten_column(size_t n, const float *restrict x, const float *restrict y,
                        const float *restrict z, float *restrict f);

#if defined ZS_HAVE_LIBMVEC && defined __GNUC__ && !defined __clang__
/* glibc's vector variants, without asking for -ffast-math. */
float sinf(float) __attribute__((simd("notinbranch"), const));
float cosf(float) __attribute__((simd("notinbranch"), const));
#endif

#endif
