#include "samples/voxels.h"

#include "base/memory.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  BRICK = 4,     /* numbers along the sides of the smallest bricks */
  FEW = 6,       /* along an axis of a box: looked at one by one */
  FEW_BRICKS = 4 /* along an axis of a box, at the level that is looked at */
};

uint32_t zs_voxels_room(uint32_t samples, bool cubic)
{
  return (samples < 2 ? 2 : samples) + (cubic ? 2 : 0);
}

static size_t count_of(const uint32_t size[3])
{
  return (size_t)size[0] * size[1] * size[2];
}

zs_voxels *zs_voxels_new(const uint32_t samples[3], bool cubic)
{
  zs_voxels *v = calloc(1, sizeof *v);
  if (!v)
    return NULL;
  v->cubic = cubic;
  v->taps = cubic ? 4 : 2;
  for (int k = 0; k < 3; k++) {
    v->size[k] = zs_voxels_room(samples[k], cubic);
    v->top[k] = (float)(samples[k] - 1);
  }
  v->numbers = zs_memory_new(count_of(v->size), sizeof *v->numbers);
  if (!v->numbers) {
    free(v);
    return NULL;
  }
  return v;
}

void zs_voxels_free(void *voxels)
{
  zs_voxels *v = voxels;
  if (!v)
    return;
  for (unsigned l = 0; l < v->level_count; l++)
    free(v->levels[l]);
  free(v->numbers);
  free(v);
}

static size_t index_of(const uint32_t size[3], uint32_t i, uint32_t j, uint32_t k)
{
  return ((size_t)k * size[1] + j) * size[0] + i;
}

float *zs_voxels_row(zs_voxels *v, uint32_t j, uint32_t k)
{
  const uint32_t edge = v->cubic;
  return v->numbers + index_of(v->size, edge, j + edge, k + edge);
}

/* ---- Coefficients ----------------------------------------------------------------- */

/* Samples to the coefficients of the cubic spline through them, mirrored at both ends,
 * in place: the recursive filters of Unser et al. */
static void filter(double *c, uint32_t n)
{
  enum { HORIZON = 32 }; /* beyond, powers of the pole are less than rounding */
  const double pole = -0.26794919243112270647; /* sqrt(3) - 2 */
  if (n < 2)
    return;
  double power = 1, first = 0;
  for (uint32_t i = 0; i < HORIZON; i++, power *= pole) {
    const uint32_t period = 2 * n - 2, at = i % period;
    first += power * c[at < n ? at : period - at];
  }
  c[0] = 6 * first;
  for (uint32_t i = 1; i < n; i++)
    c[i] = 6 * c[i] + pole * c[i - 1];
  c[n - 1] = pole / (pole * pole - 1) * (c[n - 1] + pole * c[n - 2]);
  for (uint32_t i = n - 1; i-- > 0;)
    c[i] = pole * (c[i + 1] - c[i]);
}

/* Filter the line of n samples that begins at `line`, and put mirrored coefficients at
 * its ends. */
static void filter_line(float *line, size_t stride, uint32_t n, uint32_t size, double *scratch)
{
  for (uint32_t i = 0; i < n; i++)
    scratch[i] = (double)line[(i + 1) * stride];
  filter(scratch, n);
  for (uint32_t i = 0; i < n; i++)
    line[(i + 1) * stride] = (float)scratch[i];
  line[0] = line[(n > 1 ? 2 : 1) * stride];
  for (uint32_t i = n + 1; i < size; i++) /* two behind a single sample, else one */
    line[i * stride] = line[(n > 1 ? n - 1 : 1) * stride];
}

static bool filter_axis(zs_voxels *v, int axis, unsigned threads)
{
  const int a = (axis + 1) % 3, b = (axis + 2) % 3;
  const size_t strides[3] = {1, v->size[0], (size_t)v->size[0] * v->size[1]};
  const uint32_t n = (uint32_t)v->top[axis] + 1;
  bool memory = true;
#pragma omp parallel num_threads(threads) reduction(&& : memory)
  {
    double *scratch = malloc(n * sizeof *scratch);
    memory = scratch != NULL;
#pragma omp for
    for (uint32_t j = 0; j < v->size[b]; j++)
      for (uint32_t i = 0; scratch && i < v->size[a]; i++)
        filter_line(v->numbers + i * strides[a] + j * strides[b], strides[axis], n,
                    v->size[axis], scratch);
    free(scratch);
  }
  return memory;
}

/* Before its own axis is filtered, a line beyond the samples of another axis holds
 * nothing yet. */
static void clear_edges(zs_voxels *v)
{
  for (uint32_t k = 0; k < v->size[2]; k++)
    for (uint32_t j = 0; j < v->size[1]; j++) {
      float *row = v->numbers + index_of(v->size, 0, j, k);
      const bool within = j >= 1 && j <= (uint32_t)v->top[1] + 1 && k >= 1 &&
                          k <= (uint32_t)v->top[2] + 1;
      if (!within)
        memset(row, 0, v->size[0] * sizeof *row);
      row[0] = 0;
      for (uint32_t i = (uint32_t)v->top[0] + 2; i < v->size[0]; i++)
        row[i] = 0;
    }
}

/* A second sample behind a single one, along every axis. */
static void repeat_single(zs_voxels *v)
{
  const uint32_t *s = v->size;
  if (v->top[0] == 0)
    for (size_t row = 0; row < (size_t)s[1] * s[2]; row++)
      v->numbers[row * s[0] + 1] = v->numbers[row * s[0]];
  for (uint32_t k = 0; v->top[1] == 0 && k < s[2]; k++)
    memcpy(v->numbers + index_of(s, 0, 1, k), v->numbers + index_of(s, 0, 0, k),
           s[0] * sizeof *v->numbers);
  if (v->top[2] == 0)
    memcpy(v->numbers + index_of(s, 0, 0, 1), v->numbers,
           (size_t)s[0] * s[1] * sizeof *v->numbers);
}

/* ---- The pyramid ---------------------------------------------------------------------- */

static zs_voxels_range joined(zs_voxels_range a, zs_voxels_range b)
{
  return (zs_voxels_range){a.lo < b.lo ? a.lo : b.lo, a.hi > b.hi ? a.hi : b.hi};
}

static const zs_voxels_range nothing = {INFINITY, -INFINITY};

/* Numbers from..to of each axis, both included. */
static zs_voxels_range range_of_numbers(const zs_voxels *v, const uint32_t from[3],
                                        const uint32_t to[3])
{
  zs_voxels_range range = nothing;
  for (uint32_t k = from[2]; k <= to[2]; k++)
    for (uint32_t j = from[1]; j <= to[1]; j++) {
      const float *row = v->numbers + index_of(v->size, 0, j, k);
      for (uint32_t i = from[0]; i <= to[0]; i++)
        range = joined(range, (zs_voxels_range){row[i], row[i]});
    }
  return range;
}

static zs_voxels_range range_of_bricks(const zs_voxels *v, unsigned level, const uint32_t from[3],
                                       const uint32_t to[3])
{
  zs_voxels_range range = nothing;
  for (uint32_t k = from[2]; k <= to[2]; k++)
    for (uint32_t j = from[1]; j <= to[1]; j++) {
      const zs_voxels_range *row =
        v->levels[level] + index_of(v->level_size[level], 0, j, k);
      for (uint32_t i = from[0]; i <= to[0]; i++)
        range = joined(range, row[i]);
    }
  return range;
}

/* A brick from what it consists of. */
static zs_voxels_range range_of_brick(const zs_voxels *v, unsigned level, const uint32_t at[3])
{
  const uint32_t parts = level ? 2 : BRICK;
  const uint32_t *size = level ? v->level_size[level - 1] : v->size;
  uint32_t from[3], to[3];
  for (int k = 0; k < 3; k++) {
    from[k] = parts * at[k];
    to[k] = from[k] + parts < size[k] ? from[k] + parts - 1 : size[k] - 1;
  }
  return level ? range_of_bricks(v, level - 1, from, to) : range_of_numbers(v, from, to);
}

static bool add_level(zs_voxels *v, unsigned threads)
{
  const unsigned level = v->level_count;
  const uint32_t parts = level ? 2 : BRICK;
  const uint32_t *below = level ? v->level_size[level - 1] : v->size;
  uint32_t *size = v->level_size[level];
  for (int k = 0; k < 3; k++)
    size[k] = (below[k] - 1) / parts + 1;
  zs_voxels_range *ranges = malloc(count_of(size) * sizeof *ranges);
  if (!ranges)
    return false;
  v->levels[level] = ranges;
  v->level_count++;
#pragma omp parallel for num_threads(threads)
  for (uint32_t k = 0; k < size[2]; k++)
    for (uint32_t j = 0; j < size[1]; j++)
      for (uint32_t i = 0; i < size[0]; i++)
        ranges[index_of(size, i, j, k)] =
          range_of_brick(v, level, (const uint32_t[3]){i, j, k});
  return true;
}

bool zs_voxels_finish(zs_voxels *v, unsigned threads)
{
  if (!v->cubic)
    repeat_single(v);
  else
    clear_edges(v);
  for (int axis = 0; v->cubic && axis < 3; axis++)
    if (!filter_axis(v, axis, threads))
      return false;
  do {
    if (!add_level(v, threads))
      return false;
  } while (count_of(v->level_size[v->level_count - 1]) > 1);
  return true;
}

/* The first number that matters at coordinate x of an axis. */
static uint32_t first_tap(const zs_voxels *v, int axis, float x)
{
  const uint32_t last = v->size[axis] - v->taps;
  x = x > 0 ? x : 0; /* NaN is 0 */
  x = x < v->top[axis] ? x : v->top[axis];
  return (uint32_t)x < last ? (uint32_t)x : last;
}

void zs_voxels_bounds(const zs_voxels *v, const float lo[3], const float hi[3], float f[2])
{
  uint32_t from[3], to[3], most = 0;
  for (int k = 0; k < 3; k++) {
    from[k] = first_tap(v, k, lo[k]);
    to[k] = first_tap(v, k, hi[k]) + v->taps - 1;
    most = to[k] - from[k] > most ? to[k] - from[k] : most;
  }
  zs_voxels_range range;
  if (most < FEW) {
    range = range_of_numbers(v, from, to);
  } else {
    unsigned level = 0, shift = 2;
    while (level + 1 < v->level_count && most >> shift >= FEW_BRICKS) {
      level++;
      shift++;
    }
    for (int k = 0; k < 3; k++) {
      from[k] >>= shift;
      to[k] >>= shift;
    }
    range = range_of_bricks(v, level, from, to);
  }
  /* The rounding of a dozen steps on the way, of numbers as large as these. */
  const float below = fabsf(range.lo), above = fabsf(range.hi);
  const float slack = 2e-6f * (below > above ? below : above);
  f[0] = range.lo - slack;
  f[1] = range.hi + slack;
}

/* ---- Values ------------------------------------------------------------------------------ */

static double clamped(double x, double top)
{
  return x < 0 ? 0 : x > top ? top : x; /* NaN stays */
}

/* The weights of the taps at a fraction t of a cell. */
static void weigh(double t, bool cubic, double w[4])
{
  if (!cubic) {
    w[0] = 1 - t;
    w[1] = t;
    return;
  }
  const double s = 1 - t;
  w[0] = s * s * s / 6;
  w[1] = (4 - 6 * t * t + 3 * t * t * t) / 6;
  w[2] = (4 - 6 * s * s + 3 * s * s * s) / 6;
  w[3] = t * t * t / 6;
}

double zs_voxels_value(const zs_voxels *v, const double at[3])
{
  uint32_t from[3];
  double w[3][4], sum = 0;
  for (int k = 0; k < 3; k++) {
    const double x = clamped(at[k], (double)v->top[k]);
    if (isnan(x))
      return NAN;
    const uint32_t last = v->size[k] - v->taps;
    from[k] = (uint32_t)x < last ? (uint32_t)x : last;
    weigh(x - from[k], v->cubic, w[k]);
  }
  for (uint32_t k = 0; k < v->taps; k++)
    for (uint32_t j = 0; j < v->taps; j++) {
      const float *row = v->numbers + index_of(v->size, from[0], from[1] + j, from[2] + k);
      for (uint32_t i = 0; i < v->taps; i++)
        sum += w[2][k] * w[1][j] * w[0][i] * (double)row[i];
    }
  return sum;
}

static double reference(const void *data, const double in[])
{
  return zs_voxels_value(data, in);
}

ZS_DEFINE_KERNEL_TABLE(zs_voxels_kernels)

const zs_operation zs_voxels_operation = {
  .name = "voxels", .arity = 3, .kernels = zs_voxels_kernels_table, .reference = reference};
