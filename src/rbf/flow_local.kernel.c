/* Values and bounds of flows within a box, in single precision.  Compiled once per instruction
 * set. */
#include "field/lanes.h"

typedef zs_lanes zs_real;
typedef float zs_real_number;
typedef zs_lanes_mask zs_real_mask;
typedef struct zs_real_reach {
  float value, first, second;
} zs_real_reach;
#define zs_real_larger zs_lanes_larger
#define zs_real_chosen zs_lanes_select
#define zs_real_absolute zs_lanes_absolute
#define zs_real_root zs_lanes_square_root

/* The exponent and the mantissa as they stand. */
ZS_INLINE zs_lanes zs_real_rough_logarithm(zs_lanes a)
{
  const zs_lanes_mask exponent = ((zs_lanes_mask)a - 0x3f800000) >> 23;
  const zs_lanes mantissa = (zs_lanes)((zs_lanes_mask)a - (exponent << 23)) - 1;
  return (__builtin_convertvector(exponent, zs_lanes) + mantissa) * 0.69314718f;
}

#include "rbf/flow_terms.h"

enum { PARTS = ZS_LANES / ZS_WIDTH }; /* vectors that are done together */

/* The natural logarithm of positive normal numbers; finite at 0, where it is multiplied by
 * 0.  log m = 2 artanh ((m - 1) / (m + 1)) with m around 1. */
ZS_INLINE zs_lanes logarithm(zs_lanes a)
{
  const zs_lanes_mask half_exponent = (zs_lanes_mask){0} + 0x3f3504f3; /* sqrt(1/2) */
  const zs_lanes_mask exponent = ((zs_lanes_mask)a - half_exponent) >> 23;
  const zs_lanes m = (zs_lanes)((zs_lanes_mask)a - (exponent << 23));
  const zs_lanes t = (m - 1) / (m + 1), q = t * t;
  zs_lanes p = zs_lanes_all(1.0f / 9);
  p = zs_lanes_multiply_add(p, q, zs_lanes_all(1.0f / 7));
  p = zs_lanes_multiply_add(p, q, zs_lanes_all(1.0f / 5));
  p = zs_lanes_multiply_add(p, q, zs_lanes_all(1.0f / 3));
  p = 2 * zs_lanes_multiply_add(t * q, p, t);
  return zs_lanes_multiply_add(__builtin_convertvector(exponent, zs_lanes),
                               zs_lanes_all(0.69314718f), p);
}

/* The next polynomial of a table. */
ZS_INLINE void polynomial(const float **table, int count, const zs_lanes t[PARTS],
                          zs_lanes sum[PARTS])
{
  const float *c = *table;
  *table += count;
  for (int p = 0; p < PARTS; p++)
    sum[p] = zs_lanes_all(c[count - 1]);
  for (int k = count - 2; k >= 0; k--)
    for (int p = 0; p < PARTS; p++)
      sum[p] = zs_lanes_multiply_add(sum[p], t[p], zs_lanes_all(c[k]));
}

/* ZS_LANES points, from `first` on. */
static void add_all(const zs_flow_part *part, const float *const in[3], unsigned first,
                    float *const out[2])
{
  const float *x = in[0] + first, *y = in[1] + first, *s = in[2] + first;
  const zs_flow_local *local = part->local;
  const float *table = local->table;
  const float inverse = local->half > 0 ? 1 / local->half : 0;
  zs_lanes at_x[PARTS], at_y[PARTS], t[PARTS], unknown[PARTS], sum[2][PARTS], c[4][PARTS];
  for (int p = 0; p < PARTS; p++) {
    at_x[p] = zs_lanes_load(x + p * ZS_WIDTH);
    at_y[p] = zs_lanes_load(y + p * ZS_WIDTH);
    const zs_lanes height = zs_lanes_load(s + p * ZS_WIDTH);
    t[p] = (zs_lanes_clamped(height, zs_lanes_all(0), zs_lanes_all(1)) - local->middle) * inverse;
    unknown[p] = 0 * height; /* keeps NaN */
  }
  for (int component = 0; component < 2; component++) {
    for (int k = 0; k < 3; k++)
      polynomial(&table, local->weights, t, c[k]);
    for (int p = 0; p < PARTS; p++)
      sum[component][p] = c[0][p] + c[1][p] * at_x[p] + c[2][p] * at_y[p];
  }
  for (size_t i = 0; i < part->flow->centres; i++) {
    polynomial(&table, local->weights, t, c[0]);
    polynomial(&table, local->weights, t, c[1]);
    polynomial(&table, local->places, t, c[2]);
    polynomial(&table, local->places, t, c[3]);
    for (int p = 0; p < PARTS; p++) {
      const zs_lanes ux = at_x[p] - c[2][p], uy = at_y[p] - c[3][p];
      const zs_lanes r2 = zs_lanes_multiply_add(ux, ux, uy * uy);
      const zs_lanes phi = r2 * (0.5f * logarithm(r2));
      for (int component = 0; component < 2; component++)
        sum[component][p] = zs_lanes_multiply_add(c[component][p], phi, sum[component][p]);
    }
  }
  for (int component = 0; component < 2; component++)
    for (int p = 0; p < PARTS && out[component]; p++)
      zs_lanes_store(out[component] + first + p * ZS_WIDTH, sum[component][p] + unknown[p]);
}

static void value(const zs_block_arguments *a)
{
  ZS_FLOW_OUTPUTS(float, out, a);
  for (unsigned i = 0; i < a->n; i += ZS_LANES)
    add_all(a->data, a->in, i, out);
}

/* ---- Bounds ---------------------------------------------------------------------- */

/* What single precision and what polynomials leave out can add to a displacement: local parts
 * are made where this is little. */
static const float SLACK = 4e-6f;

/* Boxes: their middles and half sides, those of s in the range of the polynomials, from -1 to
 * 1. */
typedef struct boxes {
  zs_lanes at[3], r[3];
} boxes;

static boxes take_boxes(const zs_bounds_arguments *a, unsigned part)
{
  const zs_flow_local *local = ((const zs_flow_part *)a->data)->local;
  const float inverse = local->half > 0 ? 1 / local->half : 0;
  boxes b;
  for (int k = 0; k < 3; k++) {
    zs_intervals in = zs_intervals_load(a->in[k], part);
    if (k == 2) {
      in.lo = zs_lanes_clamped(in.lo, zs_lanes_all(0), zs_lanes_all(1));
      in.hi = zs_lanes_clamped(in.hi, zs_lanes_all(0), zs_lanes_all(1));
      in.lo = (in.lo - local->middle) * inverse;
      in.hi = (in.hi - local->middle) * inverse;
    }
    b.at[k] = 0.5f * (in.lo + in.hi);
    b.r[k] = 0.5f * (in.hi - in.lo) + 2e-7f * (zs_lanes_absolute(in.lo) + zs_lanes_absolute(in.hi));
  }
  return b;
}

/* A polynomial and its derivative, and how large they become from -1 to 1. */
typedef struct channel {
  zs_lanes value, slope;
  zs_real_reach reach;
} channel;

ZS_INLINE channel next_channel(const float **table, int count, zs_lanes t)
{
  const float *c = *table;
  channel p = {zs_lanes_all(c[count - 1]), zs_lanes_all(0), {fabsf(c[0]), 0, 0}};
  *table += count;
  for (int k = count - 2; k >= 0; k--) {
    p.slope = zs_lanes_multiply_add(p.slope, t, p.value);
    p.value = zs_lanes_multiply_add(p.value, t, zs_lanes_all(c[k]));
  }
  for (int k = 1; k < count; k++) {
    const float size = fabsf(c[k]), times = (float)k;
    p.reach.value += size;
    p.reach.first += times * size;
    p.reach.second += times * (times - 1) * size;
  }
  return p;
}

/* The tangent of the polynomial of x and y, whose coefficients are channels; returns how far
 * from it the polynomial gets. */
ZS_INLINE zs_lanes plane_tangent(const float **table, int count, const boxes *b, tangent *t)
{
  channel c[3];
  for (int k = 0; k < 3; k++)
    c[k] = next_channel(table, count, b->at[2]);
  *t = (tangent){c[0].value + c[1].value * b->at[0] + c[2].value * b->at[1], c[1].value,
                 c[2].value, c[0].slope + c[1].slope * b->at[0] + c[2].slope * b->at[1]};
  return b->r[2] * (c[1].reach.first * b->r[0] + c[2].reach.first * b->r[1]) +
         0.5f * b->r[2] * b->r[2] *
           (c[0].reach.second + c[1].reach.second * zs_lanes_absolute(b->at[0]) +
            c[2].reach.second * zs_lanes_absolute(b->at[1]));
}

/* Add the terms of the next centre to the tangents and second derivatives of both components,
 * and how far from them the terms get. */
ZS_INLINE void add_terms(const float **table, const zs_flow_local *local, const boxes *b,
                         tangent t[2], curvature h[2], zs_lanes beyond[2])
{
  const channel w[2] = {next_channel(table, local->weights, b->at[2]),
                        next_channel(table, local->weights, b->at[2])};
  const channel x = next_channel(table, local->places, b->at[2]);
  const channel y = next_channel(table, local->places, b->at[2]);
  const centre c = {b->at[0] - x.value, x.slope, b->at[1] - y.value, y.slope};
  const zs_lanes r2 = c.x * c.x + c.y * c.y, l = logarithm(r2);
  const bend bent = bend_at(&x.reach, &y.reach, b->r, r2);
  const zs_lanes zero = zs_lanes_all(0), slope = zs_lanes_select(bent.curved, l + 1, zero);
  const zs_lanes twice = zs_lanes_select(bent.curved, 2 / r2, zero);
  for (int k = 0; k < 2; k++) {
    const weight own = {w[k].value, w[k].slope};
    add_centre(&t[k], &c, &own, 0.5f * r2 * l, l + 1);
    add_curvature(&h[k], &c, &own, slope, twice);
    beyond[k] += bend_of_term(&bent, &w[k].reach);
  }
}

/* Tangents at the middles of boxes, and what second derivatives and more can add. */
static void bounds(const zs_bounds_arguments *a)
{
  const zs_flow_part *flow_part = a->data;
  const zs_flow_local *local = flow_part->local;
  ZS_FLOW_OUTPUTS(zs_bounds, out, a);
  ZS_FOR_PARTS (part) {
    const boxes b = take_boxes(a, part);
    const zs_lanes_mask known =
      zs_lanes_load(a->in[2]->lo + part) <= zs_lanes_load(a->in[2]->hi + part);
    const float *table = local->table;
    tangent t[2];
    curvature h[2] = {{.xx = zs_lanes_all(0)}, {.xx = zs_lanes_all(0)}};
    zs_lanes beyond[2];
    for (int k = 0; k < 2; k++)
      beyond[k] = plane_tangent(&table, local->weights, &b, &t[k]);
    for (size_t i = 0; i < flow_part->flow->centres; i++)
      add_terms(&table, local, &b, t, h, beyond);
    for (int k = 0; k < 2; k++) {
      beyond[k] += zs_lanes_absolute(t[k].x) * b.r[0] + zs_lanes_absolute(t[k].y) * b.r[1] +
                   zs_lanes_absolute(t[k].s) * b.r[2] + curved_away(&h[k], b.r);
      beyond[k] += SLACK * (1 + zs_lanes_absolute(t[k].f) + beyond[k]);
      if (out[k])
        zs_intervals_store(out[k], part,
                           zs_intervals_checked(t[k].f - beyond[k], t[k].f + beyond[k], known));
    }
  }
}

const zs_kernels ZS_KERNELS(zs_flow_local_kernels) = {value, NULL, bounds};
