#include "rbf/flow.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Channels ------------------------------------------------------------------ */

static double clamped(double s)
{
  return s < 0 ? 0 : s > 1 ? 1 : s;
}

size_t zs_flow_interval(const zs_flow *flow, double s)
{
  size_t below = 0, above = flow->intervals;
  while (above - below > 1) {
    const size_t middle = (below + above) / 2;
    if (s >= flow->ends[middle])
      below = middle;
    else
      above = middle;
  }
  return below;
}

/* Chebyshev polynomials at some s, or their derivatives by s. */
typedef struct polynomials {
  double t[ZS_FLOW_ORDER];
} polynomials;

static polynomials polynomials_at(const zs_flow *flow, size_t interval, double s,
                                  polynomials *slope)
{
  const double from = flow->ends[interval], to = flow->ends[interval + 1];
  const double scale = 2 / (to - from), x = scale * (s - from) - 1;
  const int most = flow->used[0] > flow->used[1] ? flow->used[0] : flow->used[1];
  polynomials p = {{1, x}};
  for (int k = 2; k < most; k++)
    p.t[k] = 2 * x * p.t[k - 1] - p.t[k - 2];
  if (!slope)
    return p;
  /* T_k' = 2 T_(k-1) + 2 x T_(k-1)' - T_(k-2)' */
  *slope = (polynomials){{0, scale}};
  for (int k = 2; k < most; k++)
    slope->t[k] = 2 * scale * p.t[k - 1] + 2 * x * slope->t[k - 1] - slope->t[k - 2];
  return p;
}

/* The series of neighbouring channels, of weights or of places. */
static void add_up(const zs_flow *flow, size_t interval, const polynomials *p, size_t channel,
                   size_t count, bool places, double *restrict value)
{
  const double *c = flow->table + interval * ZS_FLOW_ORDER * flow->channels + channel;
  memset(value, 0, count * sizeof *value);
  for (int k = 0; k < flow->used[places]; k++, c += flow->channels) {
    const double t = p->t[k];
#pragma omp simd
    for (size_t i = 0; i < count; i++)
      value[i] += c[i] * t;
  }
}

static void fill(const zs_flow *flow, size_t interval, const polynomials *p, zs_flow_state *state)
{
  const size_t n = flow->centres;
  for (size_t k = 0; k < 2; k++) {
    add_up(flow, interval, p, k * (n + 3), n, false, state->weight[k]);
    add_up(flow, interval, p, k * (n + 3) + n, 3, false, state->polynomial[k]);
  }
  add_up(flow, interval, p, 2 * n + 6, n, true, state->x);
  add_up(flow, interval, p, 3 * n + 6, n, true, state->y);
}

void zs_flow_at(const zs_flow *flow, double s, zs_flow_state *value, zs_flow_state *slope)
{
  const size_t interval = zs_flow_interval(flow, s);
  polynomials slopes;
  const polynomials values = polynomials_at(flow, interval, s, slope ? &slopes : NULL);
  fill(flow, interval, &values, value);
  if (slope)
    fill(flow, interval, &slopes, slope);
}

/* ---- The value ------------------------------------------------------------------- */

double zs_flow_value(const zs_flow *flow, int component, const double at[3], double slope[3])
{
  zs_flow_state v, d;
  zs_flow_at(flow, clamped(at[2]), &v, &d);
  const double x = at[0], y = at[1];
  const double *p = v.polynomial[component], *p_slope = d.polynomial[component];
  const double *weight = v.weight[component], *weight_slope = d.weight[component];
  double f = p[0] + p[1] * x + p[2] * y;
  double g[3] = {p[1], p[2], p_slope[0] + p_slope[1] * x + p_slope[2] * y};
  for (size_t i = 0; i < flow->centres; i++) {
    const double ux = x - v.x[i], uy = y - v.y[i], r2 = ux * ux + uy * uy;
    if (r2 == 0)
      continue;
    const double l = log(r2), steep = weight[i] * (l + 1);
    f += weight[i] * 0.5 * r2 * l;
    g[0] += steep * ux;
    g[1] += steep * uy;
    g[2] += weight_slope[i] * 0.5 * r2 * l - steep * (ux * d.x[i] + uy * d.y[i]);
  }
  if (slope) {
    memcpy(slope, g, sizeof g);
    if (!(at[2] >= 0 && at[2] <= 1))
      slope[2] = 0;
  }
  return f;
}

void zs_flow_free(void *data)
{
  zs_flow *flow = data;
  if (!flow)
    return;
  free(flow->ends);
  free(flow->table);
  free(flow->reach);
  free(flow);
}

static double reference(const void *data, const double in[])
{
  const zs_flow_part *part = data;
  return isnan(in[0] + in[1] + in[2]) ? NAN : zs_flow_value(part->flow, part->component, in, NULL);
}

static bool are_siblings(const void *data, const void *other)
{
  const zs_flow_part *a = data, *b = other;
  return a->flow == b->flow && a->local == b->local;
}

ZS_DEFINE_KERNEL_TABLE(zs_flow_kernels)

const zs_operation zs_flow_operation = {.name = "flow",
                                        .arity = 3,
                                        .data_size = sizeof(zs_flow_part),
                                        .kernels = zs_flow_kernels_table,
                                        .reference = reference,
                                        .restricted = zs_flow_restricted,
                                        .are_siblings = are_siblings,
                                        .restricted_like = zs_flow_restricted_like};
