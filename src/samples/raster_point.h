/* f of a raster at a point: what its definition and its kernels share. */
#ifndef ZS_RASTER_POINT_H
#define ZS_RASTER_POINT_H

#include "samples/raster.h"

#include <math.h>

/* What four samples in a row count for, in f and in its derivative. */
typedef struct zs_raster_weights {
  double value[4], slope[4];
} zs_raster_weights;

/* Between samples 1 and 2, by the part t of the way. */
static inline zs_raster_weights zs_raster_cubic(double t)
{
  const double s = 1 - t;
  return (zs_raster_weights){
    .value = {-0.5 * t * s * s, 0.5 * (2 + t * t * (3 * t - 5)), 0.5 * (2 + s * s * (3 * s - 5)),
              -0.5 * s * t * t},
    .slope = {-0.5 * s * (s - 2 * t), 0.5 * t * (9 * t - 10), -0.5 * s * (9 * s - 10),
              0.5 * t * (t - 2 * s)}};
}

/* The first of the four layers, which may be one before the first, and their weights. */
static inline int zs_raster_layers(const zs_raster *r, double z, zs_raster_weights *w)
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
    double before = 0, after = 0, q;
    if (below > 0) {
      const double g = (double)h[below] - (double)h[below - 1];
      before = gap / (g + gap);
      q = gap / g * before;
      v[0] = -q * from;
      v[1] += q * from;
      d[0] = -q * from_slope;
      d[1] += q * from_slope;
    }
    if (above < last) {
      const double g = (double)h[above + 1] - (double)h[above];
      after = gap / (g + gap);
      q = gap / g * after;
      v[3] = q * to;
      v[2] -= q * to;
      d[3] = q * to_slope;
      d[2] -= q * to_slope;
    }
    const double secant = (1 - before) * from + (1 - after) * to;
    const double secant_slope = (1 - before) * from_slope + (1 - after) * to_slope;
    v[1] -= secant;
    v[2] += secant;
    d[1] -= secant_slope;
    d[2] += secant_slope;
  }
  return (int)below - 1;
}

/* The part of a coordinate within the samples; the cell, and the part of the way in it. */
static inline double zs_raster_within(double x, uint32_t count, uint32_t *cell)
{
  const double most = count - 1, at = x < 0 ? 0 : x > most ? most : x;
  *cell = (uint32_t)at < count - 2 ? (uint32_t)at : count - 2;
  return at;
}

static inline double zs_raster_at(const zs_raster *r, const double point[3], double slope[3])
{
  if (isnan(point[0] + point[1] + point[2]))
    return NAN;
  uint32_t x, y;
  const double u = zs_raster_within(point[0], r->count[0], &x);
  const double v = zs_raster_within(point[1], r->count[1], &y);
  const zs_raster_weights wx = zs_raster_cubic(u - x), wy = zs_raster_cubic(v - y);
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

#endif
