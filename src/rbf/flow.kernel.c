/* Block, gradient and bounds kernels of flows.  Compiled once per instruction set.
 *
 * Where points have the same s, as rows of a grid do, the weights are found once; elsewhere,
 * as along rays, for as many points at a time as a vector has room for. */
#include "rbf/flow.h"
#include "rbf/phi.h"

#include <math.h>
#include <string.h>

/* Points with the same s, or with s in the same interval, and room for what is added up at
 * them. */
typedef struct run {
  unsigned count; /* a multiple of ZS_WIDTH: the last point may stand more than once */
  double x[ZS_BLOCK], y[ZS_BLOCK];
  double place[ZS_BLOCK]; /* of s in its interval, from -1 to 1 */
  double sum[4][ZS_BLOCK]; /* f and its derivatives by x, y and s */
} run;

static double clamped(float s)
{
  return s > 0 ? s < 1 ? (double)s : 1 : 0;
}

static const zs_rbf_radial plate = {ZS_RBF_TPS2, 0};

static zs_vector load(const double *from)
{
  zs_vector v;
  memcpy(&v, from, sizeof v);
  return v;
}

static void store(double *to, zs_vector v)
{
  memcpy(to, &v, sizeof v);
}

static void add_values(run *r, const zs_flow *flow, const zs_flow_state *v)
{
  for (unsigned i = 0; i < r->count; i += ZS_WIDTH) {
    const zs_vector x = load(r->x + i), y = load(r->y + i);
    zs_vector sum = v->polynomial[0] + v->polynomial[1] * x + v->polynomial[2] * y;
    for (size_t j = 0; j < flow->centres; j++) {
      const zs_vector ux = x - v->x[j], uy = y - v->y[j];
      sum += v->weight[j] * zs_vector_phi(plate, ux * ux + uy * uy);
    }
    store(r->sum[0] + i, sum);
  }
}

/* The series of one channel at some points. */
static inline zs_vector series(const zs_flow *flow, const double *coefficients, int count,
                               const zs_vector *polynomials)
{
  zs_vector sum = {0};
  for (int k = 0; k < count; k++)
    sum += coefficients[(size_t)k * flow->channels] * polynomials[k];
  return sum;
}

/* The same at points with s of their own. */
static void add_moving(run *r, const zs_flow *flow, int component, size_t interval)
{
  const size_t n = flow->centres, own = (size_t)component * (n + 3);
  const double *table = flow->table + interval * ZS_FLOW_ORDER * flow->channels;
  const double *weight = table + own, *polynomial = weight + n;
  const double *place_x = table + 2 * n + 6, *place_y = place_x + n;
  const int weights = flow->used[0], places = flow->used[1];
  for (unsigned i = 0; i < r->count; i += ZS_WIDTH) {
    const zs_vector x = load(r->x + i), y = load(r->y + i), s = load(r->place + i);
    zs_vector t[ZS_FLOW_ORDER] = {(zs_vector){0} + 1, s};
    for (int k = 2; k < ZS_FLOW_ORDER; k++)
      t[k] = 2 * s * t[k - 1] - t[k - 2];
    zs_vector sum = series(flow, polynomial, weights, t) +
                    series(flow, polynomial + 1, weights, t) * x +
                    series(flow, polynomial + 2, weights, t) * y;
    for (size_t j = 0; j < n; j++) {
      const zs_vector ux = x - series(flow, place_x + j, places, t);
      const zs_vector uy = y - series(flow, place_y + j, places, t);
      sum += series(flow, weight + j, weights, t) * zs_vector_phi(plate, ux * ux + uy * uy);
    }
    store(r->sum[0] + i, sum);
  }
}

static void add_slopes(run *r, const zs_flow *flow, const zs_flow_state *v,
                       const zs_flow_state *d)
{
  for (unsigned i = 0; i < r->count; i += ZS_WIDTH) {
    const zs_vector x = load(r->x + i), y = load(r->y + i);
    zs_vector sum = v->polynomial[0] + v->polynomial[1] * x + v->polynomial[2] * y;
    zs_vector sum_x = v->polynomial[1] - (zs_vector){0}, sum_y = v->polynomial[2] - (zs_vector){0};
    zs_vector sum_s = d->polynomial[0] + d->polynomial[1] * x + d->polynomial[2] * y;
    for (size_t j = 0; j < flow->centres; j++) {
      const zs_vector ux = x - v->x[j], uy = y - v->y[j];
      zs_vector slope;
      const zs_vector phi = zs_vector_phi_and_slope(plate, ux * ux + uy * uy, &slope);
      slope *= v->weight[j];
      sum += v->weight[j] * phi;
      sum_x += slope * ux;
      sum_y += slope * uy;
      sum_s += d->weight[j] * phi - slope * (ux * d->x[j] + uy * d->y[j]);
    }
    store(r->sum[0] + i, sum);
    store(r->sum[1] + i, sum_x);
    store(r->sum[2] + i, sum_y);
    store(r->sum[3] + i, sum_s);
  }
}

/* How many points from `first` on have the same s, as far as a run has room: without
 * derivatives blocks may be larger than ZS_BLOCK. */
static unsigned count_equal(const zs_block_arguments *a, unsigned first)
{
  const float *s = a->in[2];
  const unsigned most = a->n - first < ZS_BLOCK ? a->n - first : ZS_BLOCK;
  unsigned n = 1;
  while (n < most && s[first + n] == s[first])
    n++;
  return n;
}

/* How many points from `first` on have s in one interval. */
static unsigned count_moving(const zs_block_arguments *a, const zs_flow *flow, unsigned first,
                             size_t interval)
{
  const float *s = a->in[2];
  const unsigned most = a->n - first < ZS_BLOCK ? a->n - first : ZS_BLOCK;
  unsigned n = 1;
  while (n < most && zs_flow_interval(flow, clamped(s[first + n])) == interval)
    n++;
  return n;
}

/* Take n points from `first` on. */
static void take(run *r, const zs_block_arguments *a, unsigned first, unsigned n)
{
  const float *x = a->in[0], *y = a->in[1];
  r->count = (n + ZS_WIDTH - 1) / ZS_WIDTH * ZS_WIDTH;
  for (unsigned i = 0; i < r->count; i++) {
    const unsigned from = first + (i < n ? i : n - 1);
    r->x[i] = (double)x[from];
    r->y[i] = (double)y[from];
  }
}

/* The same, and where s is in an interval. */
static void take_moving(run *r, const zs_block_arguments *a, const zs_flow *flow, unsigned first,
                        unsigned n, size_t interval)
{
  const double from = flow->ends[interval], scale = 2 / (flow->ends[interval + 1] - from);
  take(r, a, first, n);
  for (unsigned i = 0; i < r->count; i++)
    r->place[i] = scale * (clamped(a->in[2][first + (i < n ? i : n - 1)]) - from) - 1;
}

static void value(const zs_block_arguments *a)
{
  const zs_flow_part *part = a->data;
  const zs_flow *flow = part->flow;
  zs_flow_state v;
  run r;
  for (unsigned first = 0, n; first < a->n; first += n) {
    const double s = clamped(a->in[2][first]);
    n = count_equal(a, first);
    if (n >= ZS_WIDTH) {
      take(&r, a, first, n);
      zs_flow_at(flow, part->component, s, &v, NULL);
      add_values(&r, flow, &v);
    } else {
      const size_t interval = zs_flow_interval(flow, s);
      n = count_moving(a, flow, first, interval);
      take_moving(&r, a, flow, first, n, interval);
      add_moving(&r, flow, part->component, interval);
    }
    for (unsigned i = 0; i < n; i++)
      a->out[first + i] = (float)r.sum[0][i] + 0 * a->in[2][first + i]; /* keeps NaN */
  }
}

static void gradient(const zs_block_arguments *a)
{
  const zs_flow_part *part = a->data;
  const float *x = a->in[0], *y = a->in[1], *s = a->in[2];
  zs_flow_state v, d;
  run r;
  for (unsigned first = 0, n; first < a->n; first += n) {
    const float at = s[first];
    n = count_equal(a, first);
    take(&r, a, first, n);
    zs_flow_at(part->flow, part->component, clamped(at), &v, &d);
    add_slopes(&r, part->flow, &v, &d);
    const double moves = at >= 0 && at <= 1;
    for (unsigned i = 0; i < n; i++) {
      float g[3];
      for (unsigned k = 0; k < 3; k++) {
        const unsigned row = (k + 1) * ZS_BLOCK + first + i;
        g[k] = (float)(r.sum[1][i] * (double)x[row] + r.sum[2][i] * (double)y[row] +
                       moves * r.sum[3][i] * (double)s[row]);
      }
      a->out[first + i] = (float)r.sum[0][i] + 0 * at;
      for (unsigned k = 0; k < 3; k++)
        a->out[(k + 1) * ZS_BLOCK + first + i] = g[k];
    }
  }
}

static void bounds(const zs_bounds_arguments *a)
{
  const zs_flow_part *part = a->data;
  for (unsigned l = 0; l < ZS_LANES; l++) {
    double lo[3], hi[3], sum = 0, result[2] = {NAN, NAN};
    for (int k = 0; k < 3; k++) {
      lo[k] = (double)a->in[k]->lo[l];
      hi[k] = (double)a->in[k]->hi[l];
      sum += lo[k] + hi[k];
    }
    if (isfinite(sum))
      zs_flow_bounds(part->flow, part->component, lo, hi, result);
    const bool known = result[0] <= result[1];
    a->out->lo[l] = known ? (float)result[0] : NAN;
    a->out->hi[l] = known ? (float)result[1] : NAN;
  }
}

const zs_kernels ZS_KERNELS(zs_flow_kernels) = {value, gradient, bounds};
