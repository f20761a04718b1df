/* Block, gradient and bounds kernels of flows.  Compiled once per instruction set.
 *
 * Where points have the same s, as rows of a grid do, the weights are found once; elsewhere,
 * as along rays, for as many points at a time as a vector has room for. */
#include "rbf/flow.h"
#include "rbf/phi.h"

#include <math.h>
#include <string.h>

typedef zs_vector zs_real;
typedef double zs_real_number;
typedef zs_integers zs_real_mask;
typedef zs_flow_reach zs_real_reach;

static inline ZS_ALWAYS zs_vector zs_real_chosen(zs_integers mask, zs_vector yes, zs_vector no)
{
  return (zs_vector)(((zs_integers)yes & mask) | ((zs_integers)no & ~mask));
}

static inline ZS_ALWAYS zs_vector zs_real_larger(zs_vector a, zs_vector b)
{
  return zs_real_chosen(a > b, a, b);
}

static inline ZS_ALWAYS zs_vector zs_real_absolute(zs_vector a)
{
  return (zs_vector)((zs_integers)a & INT64_MAX);
}

static inline ZS_ALWAYS zs_vector zs_real_root(zs_vector a)
{
  return zs_vector_root(a);
}

/* The exponent and the mantissa as they stand. */
static inline ZS_ALWAYS zs_vector zs_real_rough_logarithm(zs_vector a)
{
  const zs_integers magic = (zs_integers){0} + INT64_C(0x4338000000000000); /* 1.5 * 2^52 */
  const zs_integers one = (zs_integers){0} + INT64_C(0x3ff0000000000000);
  const zs_integers exponent = ((zs_integers)a - one) >> 52;
  const zs_vector whole = (zs_vector)(exponent + magic) - (zs_vector)magic;
  const zs_vector mantissa = (zs_vector)((zs_integers)a - (exponent << 52)) - 1;
  return (whole + mantissa) * 0.6931471805599453;
}

#include "rbf/flow_terms.h"

/* Points with the same s, or with s in the same interval, and room for what is added up at
 * them, by component. */
typedef struct run {
  unsigned count; /* a multiple of ZS_WIDTH: the last point may stand more than once */
  double x[ZS_BLOCK], y[ZS_BLOCK];
  double place[ZS_BLOCK]; /* of s in its interval, from -1 to 1 */
  double sum[2][4][ZS_BLOCK]; /* f and its derivatives by x, y and s */
} run;

static double clamped(float s)
{
  return s > 0 ? s < 1 ? (double)s : 1 : 0;
}

static const zs_rbf_radial plate = {ZS_RBF_TPS2, 0};

static void add_values(run *r, const zs_flow *flow, const zs_flow_state *v)
{
  for (unsigned i = 0; i < r->count; i += ZS_WIDTH) {
    const zs_vector x = zs_vector_load(r->x + i), y = zs_vector_load(r->y + i);
    zs_vector sum[2];
    for (int k = 0; k < 2; k++) {
      const double *c = v->polynomial[k];
      sum[k] = c[0] + c[1] * x + c[2] * y;
    }
    for (size_t j = 0; j < flow->centres; j++) {
      const zs_vector ux = x - v->x[j], uy = y - v->y[j];
      const zs_vector phi = zs_vector_phi(plate, ux * ux + uy * uy);
      for (int k = 0; k < 2; k++)
        sum[k] += v->weight[k][j] * phi;
    }
    for (int k = 0; k < 2; k++)
      zs_vector_store(r->sum[k][0] + i, sum[k]);
  }
}

/* Chebyshev polynomials of an interval at some places, and their derivatives by s. */
typedef struct series {
  const zs_flow *flow;
  const double *weight[2], *polynomial[2], *x, *y; /* coefficients */
  zs_vector t[ZS_FLOW_ORDER], slope[ZS_FLOW_ORDER];
} series;

/* `place` is that of s in the interval, from -1 to 1. */
static inline ZS_ALWAYS series series_at(const zs_flow *flow, size_t interval, zs_vector place,
                                         bool slopes)
{
  const size_t n = flow->centres;
  const double *table = flow->table + interval * ZS_FLOW_ORDER * flow->channels;
  const double scale = 2 / (flow->ends[interval + 1] - flow->ends[interval]);
  const int most = flow->used[0] > flow->used[1] ? flow->used[0] : flow->used[1];
  series p = {.flow = flow,
              .weight = {table, table + n + 3},
              .polynomial = {table + n, table + 2 * n + 3},
              .x = table + 2 * n + 6,
              .y = table + 3 * n + 6};
  p.t[0] = p.slope[1] = (zs_vector){0} + 1;
  p.t[1] = place;
  p.slope[0] = (zs_vector){0};
  for (int k = 2; k < most; k++) {
    p.t[k] = 2 * place * p.t[k - 1] - p.t[k - 2];
    if (slopes)
      p.slope[k] = 2 * p.t[k - 1] + 2 * place * p.slope[k - 1] - p.slope[k - 2];
  }
  for (int k = 1; k < most && slopes; k++)
    p.slope[k] *= scale;
  return p;
}

/* A channel, of `count` coefficients, and unless `slope` is NULL its derivative. */
static inline ZS_ALWAYS zs_vector channel(const series *p, const double *coefficients, int count,
                                          zs_vector *slope)
{
  zs_vector sum = {0}, sum_slope = {0};
  for (int k = 0; k < count; k++) {
    const double c = coefficients[(size_t)k * p->flow->channels];
    sum += c * p->t[k];
    if (slope)
      sum_slope += c * p->slope[k];
  }
  if (slope)
    *slope = sum_slope;
  return sum;
}

/* Where s is in an interval, from -1 to 1. */
static double place_in(const zs_flow *flow, size_t interval, double s)
{
  const double from = flow->ends[interval];
  return 2 / (flow->ends[interval + 1] - from) * (s - from) - 1;
}

/* The same at points with s of their own. */
static void add_moving(run *r, const zs_flow *flow, size_t interval)
{
  const size_t n = flow->centres;
  const int weights = flow->used[0], places = flow->used[1];
  for (unsigned i = 0; i < r->count; i += ZS_WIDTH) {
    const zs_vector x = zs_vector_load(r->x + i), y = zs_vector_load(r->y + i);
    const series p = series_at(flow, interval, zs_vector_load(r->place + i), false);
    zs_vector sum[2];
    for (int k = 0; k < 2; k++)
      sum[k] = channel(&p, p.polynomial[k], weights, NULL) +
               channel(&p, p.polynomial[k] + 1, weights, NULL) * x +
               channel(&p, p.polynomial[k] + 2, weights, NULL) * y;
    for (size_t j = 0; j < n; j++) {
      const zs_vector ux = x - channel(&p, p.x + j, places, NULL);
      const zs_vector uy = y - channel(&p, p.y + j, places, NULL);
      const zs_vector phi = zs_vector_phi(plate, ux * ux + uy * uy);
      for (int k = 0; k < 2; k++)
        sum[k] += channel(&p, p.weight[k] + j, weights, NULL) * phi;
    }
    for (int k = 0; k < 2; k++)
      zs_vector_store(r->sum[k][0] + i, sum[k]);
  }
}

static inline ZS_ALWAYS centre centre_at(const series *p, size_t j, zs_vector x, zs_vector y)
{
  const int places = p->flow->used[1];
  centre c;
  c.x = x - channel(p, p->x + j, places, &c.x_slope);
  c.y = y - channel(p, p->y + j, places, &c.y_slope);
  return c;
}

static inline ZS_ALWAYS weight weight_at(const series *p, int component, size_t j)
{
  weight w;
  w.value = channel(p, p->weight[component] + j, p->flow->used[0], &w.slope);
  return w;
}

static inline ZS_ALWAYS tangent polynomial_at(const series *p, int component, zs_vector x,
                                              zs_vector y)
{
  const int weights = p->flow->used[0];
  zs_vector slope[3], c[3];
  for (int k = 0; k < 3; k++)
    c[k] = channel(p, p->polynomial[component] + k, weights, &slope[k]);
  return (tangent){c[0] + c[1] * x + c[2] * y, c[1], c[2], slope[0] + slope[1] * x + slope[2] * y};
}

static void add_slopes(run *r, const zs_flow *flow, size_t interval)
{
  for (unsigned i = 0; i < r->count; i += ZS_WIDTH) {
    const zs_vector x = zs_vector_load(r->x + i), y = zs_vector_load(r->y + i);
    const series p = series_at(flow, interval, zs_vector_load(r->place + i), true);
    tangent t[2] = {polynomial_at(&p, 0, x, y), polynomial_at(&p, 1, x, y)};
    for (size_t j = 0; j < flow->centres; j++) {
      const centre c = centre_at(&p, j, x, y);
      zs_vector slope;
      const zs_vector phi = zs_vector_phi_and_slope(plate, c.x * c.x + c.y * c.y, &slope);
      for (int k = 0; k < 2; k++) {
        const weight w = weight_at(&p, k, j);
        add_centre(&t[k], &c, &w, phi, slope);
      }
    }
    for (int k = 0; k < 2; k++) {
      zs_vector_store(r->sum[k][0] + i, t[k].f);
      zs_vector_store(r->sum[k][1] + i, t[k].x);
      zs_vector_store(r->sum[k][2] + i, t[k].y);
      zs_vector_store(r->sum[k][3] + i, t[k].s);
    }
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
  take(r, a, first, n);
  for (unsigned i = 0; i < r->count; i++)
    r->place[i] = place_in(flow, interval, clamped(a->in[2][first + (i < n ? i : n - 1)]));
}

static void value(const zs_block_arguments *a)
{
  const zs_flow_part *part = a->data;
  const zs_flow *flow = part->flow;
  if (part->local) {
    ZS_KERNELS(zs_flow_local_kernels).value(a);
    return;
  }
  ZS_FLOW_OUTPUTS(float, out, a);
  zs_flow_state v;
  run r;
  for (unsigned first = 0, n; first < a->n; first += n) {
    const double s = clamped(a->in[2][first]);
    n = count_equal(a, first);
    if (n >= ZS_WIDTH) {
      take(&r, a, first, n);
      zs_flow_at(flow, s, &v, NULL);
      add_values(&r, flow, &v);
    } else {
      const size_t interval = zs_flow_interval(flow, s);
      n = count_moving(a, flow, first, interval);
      take_moving(&r, a, flow, first, n, interval);
      add_moving(&r, flow, interval);
    }
    for (unsigned i = 0; i < n; i++) {
      const float unknown = 0 * a->in[2][first + i]; /* keeps NaN */
      for (int k = 0; k < 2; k++)
        if (out[k])
          out[k][first + i] = (float)r.sum[k][0][i] + unknown;
    }
  }
}

/* By the frame's coordinates, through the inputs' own derivatives `by`. */
static void put(float *out, unsigned at, const run *r, int component, unsigned i, bool moves,
                float unknown, const double by[3][3])
{
  const double *f = &r->sum[component][0][i];
  out[at] = (float)f[0] + unknown;
  for (unsigned k = 0; k < 3; k++)
    out[(k + 1) * ZS_BLOCK + at] =
      (float)(f[ZS_BLOCK] * by[0][k] + f[2 * ZS_BLOCK] * by[1][k] +
              (moves ? 1.0 : 0.0) * f[3 * ZS_BLOCK] * by[2][k]);
}

static void gradient(const zs_block_arguments *a)
{
  const zs_flow *flow = ((const zs_flow_part *)a->data)->flow;
  const float *s = a->in[2];
  ZS_FLOW_OUTPUTS(float, out, a);
  run r;
  for (unsigned first = 0, n; first < a->n; first += n) {
    const size_t interval = zs_flow_interval(flow, clamped(s[first]));
    n = count_moving(a, flow, first, interval);
    take_moving(&r, a, flow, first, n, interval);
    add_slopes(&r, flow, interval);
    for (unsigned i = 0; i < n; i++) {
      const float at = s[first + i];
      double by[3][3];
      for (int k = 0; k < 3; k++) /* the outputs may be the inputs */
        for (unsigned j = 0; j < 3; j++)
          by[k][j] = (double)a->in[k][(j + 1) * ZS_BLOCK + first + i];
      for (int k = 0; k < 2; k++)
        if (out[k])
          put(out[k], first + i, &r, k, i, at >= 0 && at <= 1, 0 * at, (const double(*)[3])by);
    }
  }
}

/* ---- Bounds ---------------------------------------------------------------------- */

/* Boxes as many as a vector has room for, and enclosures over them. */
typedef struct boxes {
  zs_vector at[3], r[3]; /* their middles, s between 0 and 1, and half their sides */
  zs_vector lo[2], hi[2]; /* by component */
} boxes;

/* The tangent at the middle, and what second derivatives and more can add: of the radial functions
 * as they are there, of all else the largest for any s.  For boxes whose middle is in one
 * interval. */
static void enclose(boxes *b, const zs_flow *flow, size_t interval)
{
  const size_t n = flow->centres;
  const zs_flow_reach *px = flow->reach + 2 * n + 6, *py = px + n;
  const zs_vector *r = b->r, half = r[2] * r[2] / 2;
  zs_vector place;
  for (int l = 0; l < ZS_WIDTH; l++)
    place[l] = place_in(flow, interval, b->at[2][l]);
  const series p = series_at(flow, interval, place, true);
  tangent t[2];
  curvature h[2] = {{.xx = {0}}, {.xx = {0}}};
  zs_vector beyond[2];
  for (int k = 0; k < 2; k++) {
    const zs_flow_reach *poly = flow->reach + (size_t)k * (n + 3) + n;
    t[k] = polynomial_at(&p, k, b->at[0], b->at[1]);
    beyond[k] = r[2] * (poly[1].first * r[0] + poly[2].first * r[1]) +
                half * (poly[0].second + poly[1].second * zs_real_absolute(b->at[0]) +
                        poly[2].second * zs_real_absolute(b->at[1]));
  }
  for (size_t i = 0; i < n; i++) {
    const centre c = centre_at(&p, i, b->at[0], b->at[1]);
    const zs_vector r2 = c.x * c.x + c.y * c.y;
    zs_vector slope;
    const zs_vector phi = zs_vector_phi_and_slope(plate, r2, &slope);
    const bend bent = bend_at(&px[i], &py[i], r, r2);
    const zs_vector zero = {0}, curving = zs_real_chosen(bent.curved, slope, zero);
    const zs_vector twice = zs_real_chosen(bent.curved, 2 / r2, zero);
    for (int k = 0; k < 2; k++) {
      const weight w = weight_at(&p, k, i);
      add_centre(&t[k], &c, &w, phi, slope);
      add_curvature(&h[k], &c, &w, curving, twice);
      beyond[k] += bend_of_term(&bent, &flow->reach[(size_t)k * (n + 3) + i]);
    }
  }
  for (int k = 0; k < 2; k++) {
    beyond[k] += zs_real_absolute(t[k].x) * r[0] + zs_real_absolute(t[k].y) * r[1] +
                 zs_real_absolute(t[k].s) * r[2] + curved_away(&h[k], r);
    /* Between intervals the channels step by what they are off. */
    beyond[k] += 1e-6 * (1 + zs_real_absolute(t[k].f) + beyond[k]);
    b->lo[k] = t[k].f - beyond[k];
    b->hi[k] = t[k].f + beyond[k];
  }
}

/* Middles and half sides of boxes from lane `first` on, any where they are not known. */
static void take_boxes(boxes *b, const zs_bounds_arguments *a, unsigned first)
{
  for (int l = 0; l < ZS_WIDTH; l++)
    for (int k = 0; k < 3; k++) {
      const float least = a->in[k]->lo[first + (unsigned)l];
      const float most = a->in[k]->hi[first + (unsigned)l];
      const double lo = k == 2 ? clamped(least) : (double)least;
      const double hi = k == 2 ? clamped(most) : (double)most;
      b->at[k][l] = (lo + hi) / 2;
      b->r[k][l] = (hi - lo) / 2;
    }
}

/* Whether the lanes of a vector repeat the one before them, as idle lanes do. */
static bool are_idle(const zs_bounds_arguments *a, unsigned first)
{
  for (unsigned l = first; first > 0 && l < first + ZS_WIDTH; l++)
    for (int k = 0; k < 3; k++)
      if (a->in[k]->lo[l] != a->in[k]->lo[first - 1] || a->in[k]->hi[l] != a->in[k]->hi[first - 1])
        return false; /* NaN, too */
  return first > 0;
}

static void put_bounds(zs_bounds *out, unsigned lane, double lo, double hi)
{
  const bool known = lo <= hi;
  out->lo[lane] = known ? (float)lo : NAN;
  out->hi[lane] = known ? (float)hi : NAN;
}

static void bounds(const zs_bounds_arguments *a)
{
  const zs_flow_part *part = a->data;
  if (part->local) {
    ZS_KERNELS(zs_flow_local_kernels).bounds(a);
    return;
  }
  ZS_FLOW_OUTPUTS(zs_bounds, out, a);
  boxes b;
  unsigned idle = 0; /* known before inputs become outputs */
  for (unsigned first = 0; first < ZS_LANES; first += ZS_WIDTH)
    idle |= are_idle(a, first) ? 1u << first : 0;
  for (unsigned first = 0; first < ZS_LANES; first += ZS_WIDTH) {
    if (idle >> first & 1) {
      for (unsigned l = first; l < first + ZS_WIDTH; l++)
        for (int k = 0; k < 2; k++)
          if (out[k])
            put_bounds(out[k], l, (double)out[k]->lo[first - 1], (double)out[k]->hi[first - 1]);
      continue;
    }
    take_boxes(&b, a, first);
    size_t last = SIZE_MAX;
    for (unsigned l = first; l < first + ZS_WIDTH; l++) {
      double sum = 0;
      for (int k = 0; k < 3; k++)
        sum += (double)a->in[k]->lo[l] + (double)a->in[k]->hi[l];
      if (isfinite(sum)) {
        const size_t interval = zs_flow_interval(part->flow, b.at[2][l - first]);
        if (interval != last)
          enclose(&b, part->flow, interval);
        last = interval;
      }
      for (int k = 0; k < 2; k++)
        if (out[k])
          put_bounds(out[k], l, isfinite(sum) ? b.lo[k][l - first] : (double)NAN,
                     b.hi[k][l - first]);
    }
  }
}

const zs_kernels ZS_KERNELS(zs_flow_kernels) = {value, gradient, bounds};
