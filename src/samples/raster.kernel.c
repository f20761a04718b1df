/* Block, gradient and bounds kernels of rasters, in single precision.  Compiled once per
 * instruction set.
 *
 * Of the 4 x 4 x 4 samples around a point those in a row along x, which lie side by side, are
 * one vector: rows are added up by their weights first, and the row that is left along x. */
#include "samples/raster.h"

#include <math.h>
#include <string.h>
#if defined __FMA__
#include <immintrin.h>
#endif

typedef float four __attribute__((vector_size(16)));

/* sum += by * row, rounded once where the machine can. */
static inline void add_scaled(four *sum, float by, const four *row)
{
#if defined __FMA__
  *sum = (four)_mm_fmadd_ps(_mm_set1_ps(by), (__m128)*row, (__m128)*sum);
#else
  *sum += by * *row;
#endif
}

static inline float product(const four *a, const four *b)
{
  const four p = *a * *b;
  return (p[0] + p[2]) + (p[1] + p[3]);
}

/* ---- Weights ------------------------------------------------------------------------- */

/* What four samples in a row count for, and in the derivative. */
typedef struct weights {
  four value, slope;
} weights;

/* Catmull and Rom's cubics: between samples 1 and 2, by the part t of the way. */
static inline void weigh(float t, weights *w)
{
  static const four linear = {-0.5f, 0, 0.5f, 0}, square = {1, -2.5f, 2, -0.5f},
                    cube = {-0.5f, 1.5f, -1.5f, 0.5f}, constant = {0, 1, 0, 0};
  w->value = constant + t * (linear + t * (square + t * cube));
  w->slope = linear + t * (2 * square + t * (3 * cube));
}

/* The gap between two layers, or the space below or above all, and how layers are weighed
 * there: Hermite's cubic, with slopes made up of the secants before, in and behind the gap. */
typedef struct gap {
  float from, to, inverse; /* heights, and the inverse of the distance */
  int first;               /* the first of four layers */
  int begin, end;          /* those of the four that count */
  four below, above;       /* what the slopes at both ends are by samples, by the gap's size */
  four fixed;              /* the weights outside, where none varies */
  bool varies, linear;
} gap;

static gap gap_outside(float from, float to, int first, int layer)
{
  gap g = {.from = from, .to = to, .first = first, .begin = layer, .end = layer + 1};
  g.fixed[layer] = 1;
  return g;
}

static gap gap_at(const zs_raster *r, float z)
{
  const float *h = r->heights;
  const uint32_t last = r->count[2] - 1;
  if (!(z > h[0]) || last == 0)
    return gap_outside(-INFINITY, last == 0 ? INFINITY : h[0], -1, 1);
  if (z >= h[last])
    return gap_outside(h[last], INFINITY, (int)last - 2, 2);
  uint32_t low = 0, high = last;
  while (high - low > 1) {
    const uint32_t middle = (low + high) / 2;
    if (z >= h[middle])
      low = middle;
    else
      high = middle;
  }
  const float size = h[high] - h[low];
  gap g = {.from = h[low], .to = h[high], .inverse = 1 / size, .first = (int)low - 1, .begin = 1,
           .end = 3, .below = {0, -1, 1, 0}, .above = {0, -1, 1, 0}, .varies = true,
           .linear = r->linear};
  double by_gap, by_beyond;
  if (low > 0 && !r->linear) {
    zs_raster_slope((double)size, (double)h[low] - (double)h[low - 1], &by_gap, &by_beyond);
    const float own = (float)by_gap, other = (float)by_beyond;
    g.below = (four){-other, other - own, own, 0};
    g.begin = 0;
  }
  if (high < last && !r->linear) {
    zs_raster_slope((double)size, (double)h[high + 1] - (double)h[high], &by_gap, &by_beyond);
    const float own = (float)by_gap, other = (float)by_beyond;
    g.above = (four){0, -own, own - other, other};
    g.end = 4;
  }
  return g;
}

static inline void weigh_layers(const gap *g, float z, weights *w)
{
  if (!g->varies) {
    *w = (weights){.value = g->fixed};
    return;
  }
  const float t = (z - g->from) * g->inverse, s = 1 - t;
  if (g->linear) {
    *w = (weights){{0, s, t, 0}, {0, -g->inverse, g->inverse, 0}};
    return;
  }
  w->value = (four){0, s * s * (1 + 2 * t), t * t * (1 + 2 * s), 0} + t * s * s * g->below -
             s * t * t * g->above;
  w->slope = g->inverse * ((four){0, -6 * s * t, 6 * s * t, 0} + s * (s - 2 * t) * g->below +
                           t * (t - 2 * s) * g->above);
}

/* ---- Points -------------------------------------------------------------------------- */

/* The nearest coordinate within the samples, its cell, and the part of the way in it. */
static inline float within(float x, uint32_t count, uint32_t *cell, float *part)
{
  const float most = (float)(count - 1), at = x > 0 ? x < most ? x : most : 0; /* NaN is 0 */
  *cell = (uint32_t)at < count - 2 ? (uint32_t)at : count - 2;
  *part = at - (float)*cell;
  return at;
}

/* Where a point is among the samples, and how far from these along x and y. */
typedef struct place {
  const float *corner; /* the first sample of the first row of layer 0 */
  float x, y;          /* parts of the way */
  float away[2], distance;
} place;

static inline void place_at(const zs_raster *r, float x, float y, place *p)
{
  uint32_t i, j;
  p->away[0] = x - within(x, r->count[0], &i, &p->x);
  p->away[1] = y - within(y, r->count[1], &j, &p->y);
  p->corner = r->samples + (size_t)j * r->row + i;
  p->distance = 0;
  if (p->away[0] != 0 || p->away[1] != 0)
    p->distance = sqrtf(p->away[0] * p->away[0] + p->away[1] * p->away[1]);
}

/* Look the gap up where the last one is not that of z; a layer may be the lowest, where nothing
 * varies. */
static inline void go_to(gap *g, const zs_raster *r, float z)
{
  if (!(z > g->from && z < g->to))
    *g = gap_at(r, z);
}

/* f at a point, and with `slopes` its derivatives by x, y and z behind it. */
__attribute__((always_inline)) static inline void evaluate(const zs_raster *r, gap *g, float x,
                                                           float y, float z, bool slopes,
                                                           float tangent[])
{
  place p;
  weights wx, wy, wz;
  place_at(r, x, y, &p);
  go_to(g, r, z);
  weigh(p.x, &wx);
  weigh(p.y, &wy);
  weigh_layers(g, z, &wz);
  four sum = {0}, by_y = {0}, by_z = {0};
  for (int k = g->begin; k < g->end; k++) {
    const float *corner = p.corner + (ptrdiff_t)(g->first + k) * (ptrdiff_t)r->layer;
    four f = {0}, f_y = {0};
    for (int j = 0; j < 4; j++, corner += r->row) {
      four row;
      memcpy(&row, corner, sizeof row);
      add_scaled(&f, wy.value[j], &row);
      if (slopes)
        add_scaled(&f_y, wy.slope[j], &row);
    }
    add_scaled(&sum, wz.value[k], &f);
    if (slopes) {
      add_scaled(&by_y, wz.value[k], &f_y);
      add_scaled(&by_z, wz.slope[k], &f);
    }
  }
  tangent[0] = product(&sum, &wx.value) - p.distance;
  if (!slopes)
    return;
  tangent[1] = p.away[0] != 0 ? -p.away[0] / p.distance : product(&sum, &wx.slope);
  tangent[2] = p.away[1] != 0 ? -p.away[1] / p.distance : product(&by_y, &wx.value);
  tangent[3] = product(&by_z, &wx.value);
}

static void value(const zs_block_arguments *a)
{
  const zs_raster *r = a->data;
  const float *x = a->in[0], *y = a->in[1], *z = a->in[2];
  gap g = gap_at(r, z[0]);
  for (unsigned i = 0; i < a->n; i++) {
    float f;
    evaluate(r, &g, x[i], y[i], z[i], false, &f);
    a->out[i] = f + 0 * (x[i] + y[i] + z[i]); /* keeps NaN */
  }
}

static void gradient(const zs_block_arguments *a)
{
  const zs_raster *r = a->data;
  const float *x = a->in[0], *y = a->in[1], *z = a->in[2];
  gap g = gap_at(r, z[0]);
  for (unsigned i = 0; i < a->n; i++) {
    const float unknown = 0 * (x[i] + y[i] + z[i]); /* keeps NaN */
    float f[4], by[3];
    evaluate(r, &g, x[i], y[i], z[i], true, f);
    for (unsigned k = 0; k < 3; k++) {
      const unsigned row = (k + 1) * ZS_BLOCK + i;
      by[k] = f[1] * x[row] + f[2] * y[row] + f[3] * z[row] + unknown;
    }
    a->out[i] = f[0] + unknown; /* the output may be one of the inputs */
    for (unsigned k = 0; k < 3; k++)
      a->out[(k + 1) * ZS_BLOCK + i] = by[k];
  }
}

/* ---- Bounds ------------------------------------------------------------------------- */

static void bounds(const zs_bounds_arguments *a)
{
  for (unsigned l = 0; l < ZS_LANES; l++) {
    double lo[3], hi[3], sum = 0;
    for (int k = 0; k < 3; k++) {
      lo[k] = (double)a->in[k]->lo[l];
      hi[k] = (double)a->in[k]->hi[l];
      sum += lo[k] + hi[k];
    }
    float result[2] = {NAN, NAN};
    if (isfinite(sum))
      zs_raster_bounds(a->data, lo, hi, result);
    a->out->lo[l] = result[0];
    a->out->hi[l] = result[1];
  }
}

const zs_kernels ZS_KERNELS(zs_raster_kernels) = {value, gradient, bounds};
