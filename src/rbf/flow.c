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

static void fill(const zs_flow *flow, int component, size_t interval, const polynomials *p,
                 zs_flow_state *state)
{
  const size_t n = flow->centres, own = (size_t)component * (n + 3);
  add_up(flow, interval, p, own, n, false, state->weight);
  add_up(flow, interval, p, own + n, 3, false, state->polynomial);
  add_up(flow, interval, p, 2 * n + 6, n, true, state->x);
  add_up(flow, interval, p, 3 * n + 6, n, true, state->y);
}

void zs_flow_at(const zs_flow *flow, int component, double s, zs_flow_state *value,
                zs_flow_state *slope)
{
  const size_t interval = zs_flow_interval(flow, s);
  polynomials slopes;
  const polynomials values = polynomials_at(flow, interval, s, slope ? &slopes : NULL);
  fill(flow, component, interval, &values, value);
  if (slope)
    fill(flow, component, interval, &slopes, slope);
}

/* ---- The value ------------------------------------------------------------------- */

double zs_flow_value(const zs_flow *flow, int component, const double at[3], double slope[3])
{
  zs_flow_state v, d;
  zs_flow_at(flow, component, clamped(at[2]), &v, &d);
  const double x = at[0], y = at[1];
  double f = v.polynomial[0] + v.polynomial[1] * x + v.polynomial[2] * y;
  double g[3] = {v.polynomial[1], v.polynomial[2],
                 d.polynomial[0] + d.polynomial[1] * x + d.polynomial[2] * y};
  for (size_t i = 0; i < flow->centres; i++) {
    const double ux = x - v.x[i], uy = y - v.y[i], r2 = ux * ux + uy * uy;
    if (r2 == 0)
      continue;
    const double l = log(r2), steep = v.weight[i] * (l + 1);
    f += v.weight[i] * 0.5 * r2 * l;
    g[0] += steep * ux;
    g[1] += steep * uy;
    g[2] += d.weight[i] * 0.5 * r2 * l - steep * (ux * d.x[i] + uy * d.y[i]);
  }
  if (slope) {
    memcpy(slope, g, sizeof g);
    if (!(at[2] >= 0 && at[2] <= 1))
      slope[2] = 0;
  }
  return f;
}

/* ---- Bounds ---------------------------------------------------------------------- */

/* What is known of r^2 log r within a distance of a place. */
typedef struct zone {
  double value, slope; /* the largest |r^2 log r| and |r (2 log r + 1)| */
  double bend;         /* how far from the tangent plane */
} zone;

/* The bend is the integral of second derivatives, at most |2 log r| + 3, along the way, which
 * may pass through 0. */
static zone zone_around(double away, double step)
{
  static const double VALUE_PEAK = 0.6065306597126334, SLOPE_PEAK = 0.22313016014842982;
  const double far = away + step, near = away - step, l = log(fmax(far, 1e-300));
  zone z;
  z.value = far < VALUE_PEAK ? far * far * -l : fmax(VALUE_PEAK * VALUE_PEAK / 2, far * far * l);
  z.slope = far < SLOPE_PEAK ? far * fabs(2 * l + 1) : fmax(2 * SLOPE_PEAK, far * (2 * l + 1));
  if (near > 0)
    z.bend = 0.5 * step * step * (2 * fmax(fabs(log(near)), fabs(l)) + 3);
  else
    z.bend = step * step * (fmax(fabs(log(fmax(step, 1e-300))), fabs(l)) + 3.5);
  return z;
}

static double length(double x, double y)
{
  return sqrt(x * x + y * y);
}

/* The tangent at the middle, and what second derivatives can add: of the radial functions
 * as they are there, of all else the largest for any s. */
void zs_flow_bounds(const zs_flow *flow, int component, const double lo[3], const double hi[3],
                    double result[2])
{
  const size_t n = flow->centres;
  const double s_lo = clamped(lo[2]), s_hi = clamped(hi[2]);
  const double at[3] = {(lo[0] + hi[0]) / 2, (lo[1] + hi[1]) / 2, (s_lo + s_hi) / 2};
  const double r[3] = {(hi[0] - lo[0]) / 2, (hi[1] - lo[1]) / 2, (s_hi - s_lo) / 2};
  const zs_flow_reach *weight = flow->reach + (size_t)component * (n + 3), *poly = weight + n;
  const zs_flow_reach *px = flow->reach + 2 * n + 6, *py = px + n;
  double slope[3];
  const double f = zs_flow_value(flow, component, at, slope);
  double beyond = fabs(slope[0]) * r[0] + fabs(slope[1]) * r[1] + fabs(slope[2]) * r[2];
  beyond += r[2] * (poly[1].first * r[0] + poly[2].first * r[1]) +
            r[2] * r[2] / 2 * (poly[0].second + poly[1].second * fabs(at[0]) +
                               poly[2].second * fabs(at[1]));
  zs_flow_state v;
  zs_flow_at(flow, component, at[2], &v, NULL);
  for (size_t i = 0; i < n; i++) {
    const double step = length(r[0] + px[i].first * r[2], r[1] + py[i].first * r[2]);
    const zone z = zone_around(length(at[0] - v.x[i], at[1] - v.y[i]), step);
    beyond += weight[i].value *
                (z.bend + z.slope * r[2] * r[2] / 2 * (px[i].second + py[i].second)) +
              weight[i].first * r[2] * z.slope * step +
              weight[i].second * r[2] * r[2] / 2 * z.value;
  }
  /* Between intervals the channels step by what they are off. */
  const double slack = 1e-6 * (1 + fabs(f) + beyond);
  result[0] = f - beyond - slack;
  result[1] = f + beyond + slack;
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

ZS_DEFINE_KERNEL_TABLE(zs_flow_kernels)

const zs_operation zs_flow_operation = {.name = "flow",
                                        .arity = 3,
                                        .data_size = sizeof(zs_flow_part),
                                        .kernels = zs_flow_kernels_table,
                                        .reference = reference};
