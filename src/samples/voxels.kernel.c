/* Block, gradient and bounds kernels of interpolated samples.  Compiled once per
 * instruction set. */
#include "samples/voxels.h"

#include <math.h>

/* Where a block's points are among the numbers: the first tap, and the fraction of the
 * cell by axis.  Beyond the samples `inside` is 0. */
typedef struct block {
  _Alignas(64) int32_t first[ZS_BLOCK];
  _Alignas(64) float t[3][ZS_BLOCK], inside[3][ZS_BLOCK];
} block;

static void place(block *b, const zs_voxels *v, const float *const in[3], unsigned n)
{
  int32_t stride = 1;
  for (int k = 0; k < 3; k++) {
    const float *x = in[k], top = v->top[k];
    const int32_t last = (int32_t)(v->size[k] - v->taps);
    float *t = b->t[k], *inside = b->inside[k];
#pragma omp simd
    for (unsigned i = 0; i < n; i++) {
      float p = x[i] > 0 ? x[i] : 0; /* NaN is 0 */
      p = p < top ? p : top;
      int32_t cell = (int32_t)p;
      cell = cell < last ? cell : last;
      t[i] = p - (float)cell;
      inside[i] = x[i] >= 0 && x[i] <= top ? 1.0f : 0.0f;
      b->first[i] = (k ? b->first[i] : 0) + cell * stride;
    }
    stride *= (int32_t)v->size[k];
  }
}

/* NaN where a coordinate is. */
static inline float unknown(const float *const in[3], unsigned i)
{
  const float x = in[0][i], y = in[1][i], z = in[2][i];
  return x == x && y == y && z == z ? 0.0f : NAN;
}

static inline float between(float a, float b, float t)
{
  return a + t * (b - a);
}

/* ---- Linear -------------------------------------------------------------------------- */

typedef struct corners {
  float a, b, c, d, e, f, g, h; /* x fastest */
} corners;

static inline corners corners_at(const zs_voxels *v, int32_t first)
{
  const int32_t row = (int32_t)v->size[0], layer = row * (int32_t)v->size[1];
  const float *p = v->numbers;
  return (corners){p[first],         p[first + 1],         p[first + row],
                   p[first + row + 1], p[first + layer],   p[first + layer + 1],
                   p[first + layer + row], p[first + layer + row + 1]};
}

static void linear_values(const block *b, const zs_voxels *v, unsigned n, float *f)
{
#pragma omp simd
  for (unsigned i = 0; i < n; i++) {
    const corners c = corners_at(v, b->first[i]);
    const float x = b->t[0][i], y = b->t[1][i], z = b->t[2][i];
    const float near = between(between(c.a, c.b, x), between(c.c, c.d, x), y);
    const float far = between(between(c.e, c.f, x), between(c.g, c.h, x), y);
    f[i] = between(near, far, z);
  }
}

static void linear_gradients(const block *b, const zs_voxels *v, unsigned n,
                             float g[4][ZS_BLOCK])
{
#pragma omp simd
  for (unsigned i = 0; i < n; i++) {
    const corners c = corners_at(v, b->first[i]);
    const float x = b->t[0][i], y = b->t[1][i], z = b->t[2][i];
    const float ab = between(c.a, c.b, x), cd = between(c.c, c.d, x);
    const float ef = between(c.e, c.f, x), gh = between(c.g, c.h, x);
    const float near = between(ab, cd, y), far = between(ef, gh, y);
    g[0][i] = between(near, far, z);
    g[1][i] = between(between(c.b - c.a, c.d - c.c, y), between(c.f - c.e, c.h - c.g, y), z);
    g[2][i] = between(cd - ab, gh - ef, z);
    g[3][i] = far - near;
  }
}

/* ---- Cubic ----------------------------------------------------------------------------- */

/* Weights of four coefficients, and their derivatives by t. */
static inline void weigh(float t, float w[4], float d[4])
{
  const float s = 1 - t;
  w[0] = s * s * s * (1.0f / 6);
  w[3] = t * t * t * (1.0f / 6);
  w[1] = 2.0f / 3 - t * t * (1 - 0.5f * t);
  w[2] = 2.0f / 3 - s * s * (1 - 0.5f * s);
  d[0] = -0.5f * s * s;
  d[3] = 0.5f * t * t;
  d[1] = t * (1.5f * t - 2);
  d[2] = s * (2 - 1.5f * s);
}

static inline void cubic_at(const zs_voxels *v, int32_t first, const float t[3], float out[4])
{
  const size_t row = v->size[0], layer = row * v->size[1];
  float w[3][4], d[3][4];
  for (int k = 0; k < 3; k++)
    weigh(t[k], w[k], d[k]);
  out[0] = out[1] = out[2] = out[3] = 0;
  for (size_t k = 0; k < 4; k++) {
    float f = 0, fx = 0, fy = 0;
    for (size_t j = 0; j < 4; j++) {
      const float *p = v->numbers + first + k * layer + j * row;
      const float along = w[0][0] * p[0] + w[0][1] * p[1] + w[0][2] * p[2] + w[0][3] * p[3];
      const float slope = d[0][0] * p[0] + d[0][1] * p[1] + d[0][2] * p[2] + d[0][3] * p[3];
      f += w[1][j] * along;
      fx += w[1][j] * slope;
      fy += d[1][j] * along;
    }
    out[0] += w[2][k] * f;
    out[1] += w[2][k] * fx;
    out[2] += w[2][k] * fy;
    out[3] += d[2][k] * f;
  }
}

static void cubic_gradients(const block *b, const zs_voxels *v, unsigned n, float g[4][ZS_BLOCK])
{
  for (unsigned i = 0; i < n; i++) {
    const float t[3] = {b->t[0][i], b->t[1][i], b->t[2][i]};
    float out[4];
    cubic_at(v, b->first[i], t, out);
    for (int k = 0; k < 4; k++)
      g[k][i] = out[k];
  }
}

/* ---- Both ------------------------------------------------------------------------------- */

/* At most a block's points. */
static void block_values(const zs_voxels *v, const float *const in[3], unsigned n, float *out)
{
  block b;
  _Alignas(64) float f[ZS_BLOCK];
  place(&b, v, in, n);
  if (v->cubic)
    for (unsigned i = 0; i < n; i++) {
      float g[4];
      cubic_at(v, b.first[i], (const float[3]){b.t[0][i], b.t[1][i], b.t[2][i]}, g);
      f[i] = g[0];
    }
  else
    linear_values(&b, v, n, f);
  for (unsigned i = 0; i < n; i++)
    out[i] = f[i] + unknown(in, i);
}

static void value(const zs_block_arguments *a)
{
  for (unsigned at = 0; at < a->n; at += ZS_BLOCK) {
    const float *const in[3] = {a->in[0] + at, a->in[1] + at, a->in[2] + at};
    block_values(a->data, in, a->n - at < ZS_BLOCK ? a->n - at : ZS_BLOCK, a->out + at);
  }
}

/* The gradient by the frame's coordinates through the inputs' own. */
static void gradient(const zs_block_arguments *a)
{
  const zs_voxels *v = a->data;
  block b;
  _Alignas(64) float g[4][ZS_BLOCK], f[ZS_BLOCK];
  place(&b, v, a->in, a->n);
  if (v->cubic)
    cubic_gradients(&b, v, a->n, g);
  else
    linear_gradients(&b, v, a->n, g);
  for (unsigned i = 0; i < a->n; i++) {
    f[i] = g[0][i] + unknown(a->in, i);
    for (int k = 0; k < 3; k++)
      g[k + 1][i] *= b.inside[k][i];
  }
  for (unsigned r = 1; r < 4; r++) {
    float by_frame[ZS_BLOCK];
    for (unsigned i = 0; i < a->n; i++)
      by_frame[i] = g[1][i] * a->in[0][r * ZS_BLOCK + i] + g[2][i] * a->in[1][r * ZS_BLOCK + i] +
                    g[3][i] * a->in[2][r * ZS_BLOCK + i];
    for (unsigned i = 0; i < a->n; i++)
      a->out[r * ZS_BLOCK + i] = by_frame[i];
  }
  for (unsigned i = 0; i < a->n; i++)
    a->out[i] = f[i];
}

static void bounds(const zs_bounds_arguments *a)
{
  for (unsigned l = 0; l < ZS_LANES; l++) {
    float lo[3], hi[3], f[2] = {NAN, NAN};
    bool known = true;
    for (int k = 0; k < 3; k++) {
      lo[k] = a->in[k]->lo[l];
      hi[k] = a->in[k]->hi[l];
      known &= lo[k] <= hi[k];
    }
    if (known)
      zs_voxels_bounds(a->data, lo, hi, f);
    a->out->lo[l] = f[0];
    a->out->hi[l] = f[1];
  }
}

const zs_kernels ZS_KERNELS(zs_voxels_kernels) = {value, gradient, bounds};
