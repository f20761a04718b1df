/* Values of flows within a box, in single precision.  Compiled once per instruction set. */
#include "field/lanes.h"
#include "rbf/flow.h"

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

/* ZS_LANES points. */
static void add_all(const zs_flow_part *part, const float *x, const float *y, const float *s,
                    float *out)
{
  const zs_flow_local *local = part->local;
  const float *table = local->table;
  const float inverse = local->half > 0 ? 1 / local->half : 0;
  zs_lanes at_x[PARTS], at_y[PARTS], t[PARTS], sum[PARTS], c[3][PARTS];
  for (int p = 0; p < PARTS; p++) {
    at_x[p] = zs_lanes_load(x + p * ZS_WIDTH);
    at_y[p] = zs_lanes_load(y + p * ZS_WIDTH);
    const zs_lanes height = zs_lanes_load(s + p * ZS_WIDTH);
    t[p] = (zs_lanes_clamped(height, zs_lanes_all(0), zs_lanes_all(1)) - local->middle) * inverse;
  }
  for (int k = 0; k < 3; k++)
    polynomial(&table, local->weights, t, c[k]);
  for (int p = 0; p < PARTS; p++)
    sum[p] = c[0][p] + c[1][p] * at_x[p] + c[2][p] * at_y[p];
  for (size_t i = 0; i < part->flow->centres; i++) {
    polynomial(&table, local->weights, t, c[0]);
    polynomial(&table, local->places, t, c[1]);
    polynomial(&table, local->places, t, c[2]);
    for (int p = 0; p < PARTS; p++) {
      const zs_lanes ux = at_x[p] - c[1][p], uy = at_y[p] - c[2][p];
      const zs_lanes r2 = zs_lanes_multiply_add(ux, ux, uy * uy);
      sum[p] = zs_lanes_multiply_add(c[0][p] * r2, 0.5f * logarithm(r2), sum[p]);
    }
  }
  for (int p = 0; p < PARTS; p++) /* keeps NaN */
    zs_lanes_store(out + p * ZS_WIDTH, sum[p] + 0 * zs_lanes_load(s + p * ZS_WIDTH));
}

static void value(const zs_block_arguments *a)
{
  for (unsigned i = 0; i < a->n; i += ZS_LANES)
    add_all(a->data, a->in[0] + i, a->in[1] + i, a->in[2] + i, a->out + i);
}

const zs_kernels ZS_KERNELS(zs_flow_local_kernels) = {.value = value};
