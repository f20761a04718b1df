/* Rows of sampled Minkowski sums.  Compiled once per instruction set. */
#include "samples/minkowski.h"

#include <math.h>

enum { CHUNK = 256 /* samples of a row that are done at a time */ };

/* Where the differences of lattice points and a point start in `a` along one axis, and how far
 * they are on the way to the next sample: the same for all of them. */
static size_t start_of(const zs_lattice_samples *a, int32_t first, double point, int k, float *part)
{
  const double at = first - point - a->lo[k];
  const double whole = a->count[k] > 1 ? floor(at) : 0;
  *part = a->count[k] > 1 ? (float)(at - whole) : 0;
  return (size_t)whole;
}

/* Up to CHUNK numbers f: those between rows, which are `row` and `layer` apart, mixed by parts v
 * and w, and then between neighbours by u. */
static void raise_chunk(float *restrict f, unsigned n, const float *g, size_t row, size_t layer,
                        float u, float v, float w)
{
  float mixed[CHUNK + 1];
  const float *above = g + row, *behind = g + layer, *beyond = behind + row;
  const float c = (1 - v) * (1 - w), d = v * (1 - w), e = (1 - v) * w, h = v * w, t = 1 - u;
#pragma omp simd
  for (unsigned i = 0; i <= n; i++)
    mixed[i] = c * g[i] + d * above[i] + e * behind[i] + h * beyond[i];
#pragma omp simd
  for (unsigned i = 0; i < n; i++) {
    const float value = t * mixed[i] + u * mixed[i + 1];
    f[i] = value > f[i] ? value : f[i];
  }
}

static void raise_row(const zs_lattice_samples *a, const zs_lattice_points *points,
                      const zs_lattice_samples *sum, uint32_t j, uint32_t k)
{
  float *f = sum->f + ((size_t)k * sum->count[1] + j) * sum->count[0];
  const uint32_t n = sum->count[0];
  const size_t row = a->count[0], layer = a->count[2] > 1 ? row * a->count[1] : 0;
  for (size_t p = 0; p < points->count; p++) {
    float u, v, w;
    const double *b = points->at[p];
    const size_t x = start_of(a, sum->lo[0], b[0], 0, &u);
    const size_t y = start_of(a, sum->lo[1] + (int32_t)j, b[1], 1, &v);
    const size_t z = start_of(a, sum->lo[2] + (int32_t)k, b[2], 2, &w);
    const float *g = a->f + (z * a->count[1] + y) * row + x;
    for (uint32_t i = 0; i < n; i += CHUNK)
      raise_chunk(f + i, n - i < CHUNK ? n - i : CHUNK, g + i, row, layer, u, v, w);
  }
}

const zs_minkowski_kernels ZS_KERNELS(zs_minkowski_table) = {raise_row};
