#include "samples/raster.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  BASE = 4,  /* samples of a block along x and y */
  DIRECT = 8 /* ranges of no more samples are looked at one by one */
};

/* What the negative weights of the cubics in a layer, and of one alone, sum up to at the
 * most: (1 + 2/16)^2 / 2 - 1/2 of products, and of slopes 2 * 4/27. */
static const double LAYER_OVERSHOOT = 0.2813, SLOPE_OVERSHOOT = 4.0 / 27;

zs_raster *zs_raster_new(const uint32_t count[3], const float *heights)
{
  zs_raster *r = calloc(1, sizeof *r);
  if (!r)
    return NULL;
  memcpy(r->count, count, sizeof r->count);
  r->row = (size_t)count[0] + 3;
  r->layer = r->row * ((size_t)count[1] + 3);
  if (count[2] <= SIZE_MAX / sizeof(float) / r->layer)
    r->samples = malloc(r->layer * count[2] * sizeof *r->samples);
  r->heights = malloc(count[2] * sizeof *r->heights);
  if (!r->samples || !r->heights) {
    zs_raster_free(r);
    return NULL;
  }
  memcpy(r->heights, heights, count[2] * sizeof *heights);
  return r;
}

void zs_raster_free(void *data)
{
  zs_raster *r = data;
  if (!r)
    return;
  for (unsigned l = 0; l < r->level_count; l++) {
    free(r->levels[l].least);
    free(r->levels[l].greatest);
  }
  free(r->samples);
  free(r->heights);
  free(r);
}

/* ---- Finishing ----------------------------------------------------------------- */

/* Continue rows and columns by their outermost samples. */
static void continue_layer(const zs_raster *r, size_t z)
{
  const size_t nx = r->count[0], ny = r->count[1];
  for (size_t y = 0; y < ny; y++) {
    float *row = zs_raster_sample(r, 0, y, z);
    row[-1] = row[0];
    row[nx] = row[nx + 1] = row[nx - 1];
  }
  float *first = r->samples + z * r->layer, *last = first + ny * r->row;
  memcpy(first, first + r->row, r->row * sizeof *first);
  memcpy(last + r->row, last, r->row * sizeof *first);
  memcpy(last + 2 * r->row, last, r->row * sizeof *first);
}

static bool allocate_level(zs_raster_level *level, const uint32_t count[3])
{
  memcpy(level->count, count, sizeof level->count);
  const size_t blocks = (size_t)count[0] * count[1] * count[2];
  level->least = malloc(blocks * sizeof *level->least);
  level->greatest = malloc(blocks * sizeof *level->greatest);
  return level->least && level->greatest;
}

static size_t block_at(const zs_raster_level *level, size_t x, size_t y, size_t z)
{
  return (z * level->count[1] + y) * level->count[0] + x;
}

static void widen(float *least, float *greatest, float from, float to)
{
  *least = from < *least ? from : *least;
  *greatest = to > *greatest ? to : *greatest;
}

/* The blocks of samples themselves. */
static void fill_first(const zs_raster *r, const zs_raster_level *level)
{
  const size_t blocks = (size_t)level->count[0] * level->count[1] * level->count[2];
  for (size_t i = 0; i < blocks; i++) {
    level->least[i] = INFINITY;
    level->greatest[i] = -INFINITY;
  }
  for (size_t z = 0; z < r->count[2]; z++)
    for (size_t y = 0; y < r->count[1]; y++)
      for (size_t x = 0; x < r->count[0]; x++) {
        const size_t i = block_at(level, x / BASE, y / BASE, z);
        const float f = *zs_raster_sample(r, x, y, z);
        widen(&level->least[i], &level->greatest[i], f, f);
      }
}

/* Blocks of up to eight blocks of the level before. */
static void fill_next(const zs_raster_level *before, const zs_raster_level *level)
{
  const size_t blocks = (size_t)level->count[0] * level->count[1] * level->count[2];
  for (size_t i = 0; i < blocks; i++) {
    level->least[i] = INFINITY;
    level->greatest[i] = -INFINITY;
  }
  for (size_t z = 0; z < before->count[2]; z++)
    for (size_t y = 0; y < before->count[1]; y++)
      for (size_t x = 0; x < before->count[0]; x++) {
        const size_t i = block_at(level, x / 2, y / 2, z / 2), j = block_at(before, x, y, z);
        widen(&level->least[i], &level->greatest[i], before->least[j], before->greatest[j]);
      }
}

/* Slopes are made of secants; that of a wide gap's neighbour counts for more in it. */
static double overshoot_of(const zs_raster *r)
{
  if (r->linear || r->count[2] < 2)
    return 0;
  double stretch = 1;
  for (uint32_t k = 1; k + 1 < r->count[2]; k++) {
    const double a = (double)r->heights[k] - (double)r->heights[k - 1];
    const double b = (double)r->heights[k + 1] - (double)r->heights[k];
    stretch = fmax(stretch, fmax(a / b, b / a));
  }
  return 2 * SLOPE_OVERSHOOT * fmin(stretch, ZS_RASTER_STEEPEST);
}

bool zs_raster_finish(zs_raster *r)
{
  for (size_t z = 0; z < r->count[2]; z++)
    continue_layer(r, z);
  r->overshoot = overshoot_of(r);
  uint32_t count[3] = {(r->count[0] - 1) / BASE + 1, (r->count[1] - 1) / BASE + 1, r->count[2]};
  for (;;) {
    zs_raster_level *level = &r->levels[r->level_count++];
    if (!allocate_level(level, count))
      return false;
    if (r->level_count == 1)
      fill_first(r, level);
    else
      fill_next(level - 1, level);
    if (count[0] * (uint64_t)count[1] * count[2] == 1)
      return true;
    for (int k = 0; k < 3; k++)
      count[k] = (count[k] + 1) / 2;
  }
}

/* ---- Bounds ---------------------------------------------------------------------- */

/* The samples that matter between two coordinates. */
typedef struct range {
  size_t first, last;
} range;

static range samples_between(double lo, double hi, uint32_t count)
{
  const double most = count - 1;
  const double from = floor(lo < 0 ? 0 : lo > most ? most : lo) - 1;
  const double to = floor(hi < 0 ? 0 : hi > most ? most : hi) + 2;
  return (range){from > 0 ? (size_t)from : 0, to < most ? (size_t)to : count - 1};
}

static uint32_t layer_below(const zs_raster *r, double z)
{
  uint32_t below = 0, above = r->count[2];
  while (above - below > 1) {
    const uint32_t middle = (below + above) / 2;
    if (z >= (double)r->heights[middle])
      below = middle;
    else
      above = middle;
  }
  return below;
}

static range layers_between(const zs_raster *r, double lo, double hi)
{
  const uint32_t from = layer_below(r, lo), to = layer_below(r, hi), last = r->count[2] - 1;
  return (range){from > 0 ? from - 1 : 0, to + 2 < last ? to + 2 : last};
}

static void look_at_samples(const zs_raster *r, const range at[3], float *least, float *greatest)
{
  for (size_t z = at[2].first; z <= at[2].last; z++)
    for (size_t y = at[1].first; y <= at[1].last; y++) {
      const float *row = zs_raster_sample(r, 0, y, z);
      for (size_t x = at[0].first; x <= at[0].last; x++)
        widen(least, greatest, row[x], row[x]);
    }
}

static void look_at_blocks(const zs_raster *r, const range at[3], float *least, float *greatest)
{
  size_t widest = (at[0].last - at[0].first) / BASE;
  widest = (at[1].last - at[1].first) / BASE > widest ? (at[1].last - at[1].first) / BASE : widest;
  widest = at[2].last - at[2].first > widest ? at[2].last - at[2].first : widest;
  unsigned l = 0;
  while (widest >> l > 3 && l + 1 < r->level_count)
    l++;
  const zs_raster_level *level = &r->levels[l];
  for (size_t z = at[2].first >> l; z <= at[2].last >> l; z++)
    for (size_t y = at[1].first / BASE >> l; y <= at[1].last / BASE >> l; y++)
      for (size_t x = at[0].first / BASE >> l; x <= at[0].last / BASE >> l; x++) {
        const size_t i = block_at(level, x, y, z);
        widen(least, greatest, level->least[i], level->greatest[i]);
      }
}

/* How far a box is from the samples along an axis, at the least and at the most. */
static void distances(double lo, double hi, uint32_t count, double *least, double *most)
{
  const double end = count - 1;
  *least = lo > end ? lo - end : hi < 0 ? -hi : 0;
  *most = fmax(0, fmax(hi - end, -lo));
}

void zs_raster_bounds(const zs_raster *r, const double lo[3], const double hi[3],
                      float result[2])
{
  const range at[3] = {samples_between(lo[0], hi[0], r->count[0]),
                       samples_between(lo[1], hi[1], r->count[1]),
                       layers_between(r, lo[2], hi[2])};
  float least = INFINITY, greatest = -INFINITY;
  if (at[0].last - at[0].first < DIRECT && at[1].last - at[1].first < DIRECT &&
      at[2].last - at[2].first < DIRECT)
    look_at_samples(r, at, &least, &greatest);
  else
    look_at_blocks(r, at, &least, &greatest);
  double from = (double)least, to = (double)greatest, size = to - from;
  from -= LAYER_OVERSHOOT * size;
  to += LAYER_OVERSHOOT * size;
  size = to - from;
  from -= r->overshoot * size;
  to += r->overshoot * size;
  double near[2], far[2];
  for (int k = 0; k < 2; k++)
    distances(lo[k], hi[k], r->count[k], &near[k], &far[k]);
  from -= hypot(far[0], far[1]);
  to -= hypot(near[0], near[1]);
  const double slack = 1e-6 * (fabs(from) + fabs(to));
  result[0] = (float)(from - slack);
  result[1] = (float)(to + slack);
}

/* ---- The definition ---------------------------------------------------------------- */

/* Between samples 1 and 2, by the part t of the way. */
static zs_raster_weights weigh(double t)
{
  const double s = 1 - t;
  return (zs_raster_weights){
    .value = {-0.5 * t * s * s, 0.5 * (2 + t * t * (3 * t - 5)), 0.5 * (2 + s * s * (3 * s - 5)),
              -0.5 * s * t * t},
    .slope = {-0.5 * s * (s - 2 * t), 0.5 * t * (9 * t - 10), -0.5 * s * (9 * s - 10),
              0.5 * t * (t - 2 * s)}};
}

int zs_raster_layers(const zs_raster *r, double z, zs_raster_weights *w)
{
  const float *h = r->heights;
  const uint32_t last = r->count[2] - 1;
  *w = (zs_raster_weights){.value = {0, 1, 0, 0}};
  if (!(z > (double)h[0]) || last == 0)
    return -1;
  if (z >= (double)h[last]) {
    w->value[1] = 0;
    w->value[2] = 1;
    return (int)last - 2;
  }
  uint32_t below = 0, above = last;
  while (above - below > 1) {
    const uint32_t middle = (below + above) / 2;
    if (z >= (double)h[middle])
      below = middle;
    else
      above = middle;
  }
  const double gap = (double)h[above] - (double)h[below], t = (z - (double)h[below]) / gap;
  const double s = 1 - t;
  double *v = w->value, *d = w->slope;
  d[1] = -1 / gap;
  d[2] = 1 / gap;
  v[1] = s;
  v[2] = t;
  if (!r->linear) {
    /* Hermite's cubic: the slopes, times the gap, count for these. */
    v[1] = s * s * (1 + 2 * t);
    v[2] = t * t * (1 + 2 * s);
    d[1] = -6 * s * t / gap;
    d[2] = -d[1];
    const double from = t * s * s, to = -s * t * t;
    const double from_slope = s * (s - 2 * t) / gap, to_slope = t * (t - 2 * s) / gap;
    /* The secants before, in and behind the gap make up the slopes. */
    double begin = 1, end = 1, q;
    if (below > 0) {
      zs_raster_slope(gap, (double)h[below] - (double)h[below - 1], &begin, &q);
      v[0] = -q * from;
      v[1] += q * from;
      d[0] = -q * from_slope;
      d[1] += q * from_slope;
    }
    if (above < last) {
      zs_raster_slope(gap, (double)h[above + 1] - (double)h[above], &end, &q);
      v[3] = q * to;
      v[2] -= q * to;
      d[3] = q * to_slope;
      d[2] -= q * to_slope;
    }
    const double secant = begin * from + end * to;
    const double secant_slope = begin * from_slope + end * to_slope;
    v[1] -= secant;
    v[2] += secant;
    d[1] -= secant_slope;
    d[2] += secant_slope;
  }
  return (int)below - 1;
}

/* The part of a coordinate within the samples; the cell, and the part of the way in it. */
static double within(double x, uint32_t count, uint32_t *cell)
{
  const double most = count - 1, at = x < 0 ? 0 : x > most ? most : x;
  *cell = (uint32_t)at < count - 2 ? (uint32_t)at : count - 2;
  return at;
}

double zs_raster_value(const zs_raster *r, const double point[3], double slope[3])
{
  if (isnan(point[0] + point[1] + point[2]))
    return NAN;
  uint32_t x, y;
  const double u = within(point[0], r->count[0], &x);
  const double v = within(point[1], r->count[1], &y);
  const zs_raster_weights wx = weigh(u - x), wy = weigh(v - y);
  zs_raster_weights wz;
  const int first = zs_raster_layers(r, point[2], &wz);
  double sum = 0, sum_x = 0, sum_y = 0, sum_z = 0;
  for (int k = 0; k < 4; k++) {
    if (wz.value[k] == 0 && wz.slope[k] == 0)
      continue;
    const float *corner = r->samples + (size_t)(first + k) * r->layer + (size_t)y * r->row + x;
    double f = 0, f_x = 0, f_y = 0;
    for (int j = 0; j < 4; j++) {
      const float *p = corner + (size_t)j * r->row;
      double g = 0, g_x = 0;
      for (int i = 0; i < 4; i++) {
        g += wx.value[i] * (double)p[i];
        g_x += wx.slope[i] * (double)p[i];
      }
      f += wy.value[j] * g;
      f_x += wy.value[j] * g_x;
      f_y += wy.slope[j] * g;
    }
    sum += wz.value[k] * f;
    sum_x += wz.value[k] * f_x;
    sum_y += wz.value[k] * f_y;
    sum_z += wz.slope[k] * f;
  }
  const double away_x = point[0] - u, away_y = point[1] - v, away = hypot(away_x, away_y);
  if (slope) {
    slope[0] = away_x != 0 ? -away_x / away : sum_x;
    slope[1] = away_y != 0 ? -away_y / away : sum_y;
    slope[2] = sum_z;
  }
  return sum - away;
}

/* ---- The operation ----------------------------------------------------------------- */

static double reference(const void *data, const double in[])
{
  return zs_raster_value(data, in, NULL);
}

ZS_DEFINE_KERNEL_TABLE(zs_raster_kernels)

const zs_operation zs_raster_operation = {.name = "raster",
                                          .arity = 3,
                                          .kernels = zs_raster_kernels_table,
                                          .reference = reference};
