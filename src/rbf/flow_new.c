/* Making flows: systems at Chebyshev nodes of intervals, divided until they are smooth. */
#include "rbf/flow.h"

#include "rbf/dense.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  MOST_HALVINGS = 14,  /* of an interval */
  LOOKS = 33,          /* places along the paths where these are looked at */
  TERMS = 3            /* of the polynomial */
};

/* What the last two coefficients of an interval may be, by the largest. */
static const double TAIL = 1e-9;
/* Anchors whose extent across is less than this are on a line; the size is 1. */
static const double FLAT = 0.02;
/* Anchors nearer to each other than this are in the same place. */
static const double SAME = 1e-7;
/* How far out the helping centres stand. */
static const double AROUND = 2;

static const double PI = 3.14159265358979323846;

/* A flow in the making. */
typedef struct maker {
  zs_flow *flow;
  zs_flow_path *paths; /* distinct ones, in the flow's units */
  size_t *origin;      /* which of the caller's each one is */
  double *points;
  size_t count, capacity; /* of paths; of intervals */
  zs_flow_way way;
  bool helpers;
  double *matrix, *monomials, *values, *solution; /* of one system */
} maker;

/* ---- Paths ----------------------------------------------------------------------- */

/* Cubic pieces through the points, with slopes along the chords between neighbours. */
void zs_flow_path_place(const zs_flow_path *path, double s, double at[2])
{
  const double *p = path->points;
  const size_t last = path->count - 1;
  const double along = s * (double)last;
  const size_t k = along < (double)last ? (size_t)along : last - 1;
  const double t = along - (double)k, u = 1 - t;
  for (size_t c = 0; c < 2; c++) {
    const double a = p[2 * k + c], b = p[2 * k + 2 + c];
    const double before = k > 0 ? p[2 * k - 2 + c] : 2 * a - b;
    const double after = k + 1 < last ? p[2 * k + 4 + c] : 2 * b - a;
    at[c] = path->count == 2 ? u * a + t * b
                             : u * u * (1 + 2 * t) * a + t * t * (1 + 2 * u) * b +
                                 t * u * u * (b - before) / 2 - t * t * u * (after - a) / 2;
  }
}

static const double *end_of(const zs_flow_path *path)
{
  return path->points + 2 * (path->count - 1);
}

/* Where anchor i is. */
static void place_of(const maker *m, size_t i, double s, double at[2])
{
  const zs_flow_path *path = &m->paths[i];
  if (m->way == ZS_FLOW_COME || m->way == ZS_FLOW_TO_GO)
    zs_flow_path_place(path, s, at);
  else
    memcpy(at, m->way == ZS_FLOW_AT_START ? path->points : end_of(path), 2 * sizeof *at);
}

/* What the flow is to be there. */
static void way_of(const maker *m, size_t i, double s, const double at[2], double way[2])
{
  const zs_flow_path *path = &m->paths[i];
  const double *from = path->points, *to = end_of(path);
  const bool curved = path->count > 2;
  for (int c = 0; c < 2; c++)
    way[c] = curved && m->way == ZS_FLOW_COME    ? (at[c] - from[c]) / s
             : curved && m->way == ZS_FLOW_TO_GO ? (to[c] - at[c]) / (1 - s)
                                                 : to[c] - from[c];
}

static bool same_path(const zs_flow_path *a, const zs_flow_path *b)
{
  return a->count == b->count &&
         !memcmp(a->points, b->points, 2 * a->count * sizeof *a->points);
}

/* The middle and the size of all paths. */
static void measure(zs_flow *flow, const zs_flow_path *paths, size_t count)
{
  double lo[2] = {INFINITY, INFINITY}, hi[2] = {-INFINITY, -INFINITY};
  for (size_t i = 0; i < count; i++)
    for (size_t j = 0; j < 2 * paths[i].count; j++) {
      lo[j % 2] = fmin(lo[j % 2], paths[i].points[j]);
      hi[j % 2] = fmax(hi[j % 2], paths[i].points[j]);
    }
  for (int c = 0; c < 2; c++)
    flow->middle[c] = lo[c] + (hi[c] - lo[c]) / 2;
  flow->size = hypot(hi[0] - lo[0], hi[1] - lo[1]) / 2;
  if (!(flow->size > 0))
    flow->size = 1;
}

static bool take_paths(maker *m, const zs_flow_path *paths, size_t count)
{
  size_t total = 0, used = 0;
  for (size_t i = 0; i < count; i++)
    total += 2 * paths[i].count;
  m->paths = malloc(count * sizeof *m->paths);
  m->origin = malloc(count * sizeof *m->origin);
  m->points = malloc(total * sizeof *m->points);
  if (!m->paths || !m->origin || !m->points)
    return false;
  for (size_t i = 0; i < count; i++) {
    double *points = m->points + used;
    for (size_t j = 0; j < 2 * paths[i].count; j++)
      points[j] = (paths[i].points[j] - m->flow->middle[j % 2]) / m->flow->size;
    const zs_flow_path path = {paths[i].count, points};
    bool known = false;
    for (size_t j = 0; j < m->count && !known; j++)
      known = same_path(&m->paths[j], &path);
    if (known)
      continue;
    used += 2 * path.count;
    m->origin[m->count] = i;
    m->paths[m->count++] = path;
  }
  return true;
}

/* The least extent of the anchors across their own direction, at s. */
static double extent_across(const maker *m, double s)
{
  double mean[2] = {0, 0}, xx = 0, xy = 0, yy = 0, at[2];
  const double n = (double)m->count;
  for (size_t i = 0; i < m->count; i++) {
    place_of(m, i, s, at);
    mean[0] += at[0] / n;
    mean[1] += at[1] / n;
  }
  for (size_t i = 0; i < m->count; i++) {
    place_of(m, i, s, at);
    const double x = at[0] - mean[0], y = at[1] - mean[1];
    xx += x * x / n;
    xy += x * y / n;
    yy += y * y / n;
  }
  const double least = (xx + yy) / 2 - hypot((xx - yy) / 2, xy);
  return sqrt(fmax(least, 0));
}

static bool need_helpers(const maker *m)
{
  if (m->count < 3)
    return true;
  for (int k = 0; k < LOOKS; k++)
    if (extent_across(m, (double)k / (LOOKS - 1)) < FLAT)
      return true;
  return false;
}

/* ---- Systems --------------------------------------------------------------------- */

/* The similarity that fits the anchors' displacements best, as complex numbers: the mean
 * displacement, and what it grows by with the place from the mean place. */
typedef struct similarity {
  double place[2], mean[2], factor[2];
} similarity;

static similarity fit_similarity(const double *x, const double *y, const double *const way[2],
                                 size_t count)
{
  similarity f = {{0, 0}, {0, 0}, {0, 0}};
  double square = 0, a = 0, b = 0;
  for (size_t i = 0; i < count; i++) {
    const double n = (double)count;
    f.place[0] += x[i] / n;
    f.place[1] += y[i] / n;
    f.mean[0] += way[0][i] / n;
    f.mean[1] += way[1][i] / n;
  }
  for (size_t i = 0; i < count; i++) {
    const double u = x[i] - f.place[0], v = y[i] - f.place[1];
    const double p = way[0][i] - f.mean[0], q = way[1][i] - f.mean[1];
    square += u * u + v * v;
    a += u * p + v * q;
    b += u * q - v * p;
  }
  if (square > 1e-18 * (double)count) {
    f.factor[0] = a / square;
    f.factor[1] = b / square;
  }
  return f;
}

static double thin_plate(double x, double y)
{
  const double r2 = x * x + y * y;
  return r2 > 0 ? 0.5 * r2 * log(r2) : 0;
}

/* Places and displacements of all centres at s: anchors, then helpers. */
static void gather(const maker *m, double s, double *x, double *y, double *const way[2])
{
  for (size_t i = 0; i < m->count; i++) {
    double at[2], here[2];
    place_of(m, i, s, at);
    way_of(m, i, s, at, here);
    x[i] = at[0];
    y[i] = at[1];
    way[0][i] = here[0];
    way[1][i] = here[1];
  }
  if (!m->helpers)
    return;
  const double *const anchors[2] = {way[0], way[1]};
  const similarity f = fit_similarity(x, y, anchors, m->count);
  for (size_t k = 0; k < ZS_FLOW_HELPERS; k++) {
    const double angle = 2 * PI * (double)k / ZS_FLOW_HELPERS;
    const size_t i = m->count + k;
    x[i] = AROUND * cos(angle);
    y[i] = AROUND * sin(angle);
    const double u = x[i] - f.place[0], v = y[i] - f.place[1];
    way[0][i] = f.mean[0] + f.factor[0] * u - f.factor[1] * v;
    way[1][i] = f.mean[1] + f.factor[0] * v + f.factor[1] * u;
  }
}

/* All channels at s. */
static zs_dense_result solve(const maker *m, double s, double *channels)
{
  const size_t n = m->flow->centres;
  double *x = channels + 2 * n + 2 * TERMS, *y = x + n;
  double *const way[2] = {m->values, m->values + n};
  gather(m, s, x, y, way);
  for (size_t j = 0; j < n; j++) {
    for (size_t i = 0; i < n; i++) {
      m->matrix[j * n + i] = thin_plate(x[i] - x[j], y[i] - y[j]);
      if (i != j && hypot(x[i] - x[j], y[i] - y[j]) < SAME)
        return ZS_DENSE_SINGULAR;
    }
    m->monomials[j] = 1;
    m->monomials[n + j] = x[j];
    m->monomials[2 * n + j] = y[j];
  }
  zs_dense dense;
  zs_dense_result result = zs_dense_factorise(&dense, n, TERMS, m->matrix, m->monomials);
  for (size_t c = 0; result == ZS_DENSE_DONE && c < 2; c++) {
    double *own = channels + c * (n + TERMS);
    result = zs_dense_solve(&dense, way[c], own, own + n);
  }
  zs_dense_free(&dense);
  return result;
}

/* ---- Intervals --------------------------------------------------------------------- */

/* Coefficients from values at the nodes of first kind. */
static void transform(const maker *m, double *coefficients)
{
  enum { N = ZS_FLOW_ORDER };
  const size_t channels = m->flow->channels;
  for (size_t i = 0; i < channels; i++)
    for (int k = 0; k < N; k++) {
      double sum = 0;
      for (int j = 0; j < N; j++)
        sum += m->solution[(size_t)j * channels + i] * cos(PI * k * (j + 0.5) / N);
      coefficients[(size_t)k * channels + i] = sum * (k ? 2.0 : 1.0) / N;
    }
}

/* The largest coefficient from the k-th on, of places or of the other channels. */
static double largest(const zs_flow *flow, const double *coefficients, int k, bool places)
{
  const size_t split = flow->channels - 2 * flow->centres;
  const size_t first = places ? split : 0, end = places ? flow->channels : split;
  double most = 0;
  for (; k < ZS_FLOW_ORDER; k++)
    for (size_t i = first; i < end; i++) {
      const double c = fabs(coefficients[(size_t)k * flow->channels + i]);
      if (!(c <= most))
        most = isnan(c) ? INFINITY : c;
    }
  return most;
}

/* Whether the series have ended before their last two terms; notes where they do. */
static bool is_smooth(zs_flow *flow, const double *coefficients)
{
  double little[2];
  for (int places = 0; places < 2; places++) {
    const double most = largest(flow, coefficients, 0, places);
    little[places] = TAIL * fmax(most, 1);
    if (isinf(most) ||
        largest(flow, coefficients, ZS_FLOW_ORDER - 2, places) > little[places])
      return false;
  }
  for (int places = 0; places < 2; places++)
    while (flow->used[places] < ZS_FLOW_ORDER &&
           largest(flow, coefficients, flow->used[places], places) > little[places] / 10)
      flow->used[places]++;
  return true;
}

static double *new_interval(maker *m, double to)
{
  zs_flow *flow = m->flow;
  if (flow->intervals == m->capacity) {
    const size_t capacity = 2 * m->capacity + 4;
    double *table =
      realloc(flow->table, capacity * flow->channels * ZS_FLOW_ORDER * sizeof *table);
    flow->table = table ? table : flow->table;
    double *ends = realloc(flow->ends, (capacity + 1) * sizeof *ends);
    flow->ends = ends ? ends : flow->ends;
    if (!table || !ends)
      return NULL;
    m->capacity = capacity;
  }
  flow->ends[0] = 0;
  flow->ends[++flow->intervals] = to;
  return flow->table + (flow->intervals - 1) * flow->channels * ZS_FLOW_ORDER;
}

/* Add intervals for s from one number to another. */
static zs_flow_result add(maker *m, double from, double to, int halvings)
{
  double *coefficients = new_interval(m, to);
  if (!coefficients)
    return ZS_FLOW_MEMORY;
  bool solved = true;
  for (int k = 0; solved && k < ZS_FLOW_ORDER; k++) {
    const double s = (from + to) / 2 + (to - from) / 2 * cos(PI * (k + 0.5) / ZS_FLOW_ORDER);
    const zs_dense_result result =
      solve(m, s, m->solution + (size_t)k * m->flow->channels);
    if (result == ZS_DENSE_MEMORY)
      return ZS_FLOW_MEMORY;
    solved = result == ZS_DENSE_DONE;
  }
  if (solved) {
    transform(m, coefficients);
    if (is_smooth(m->flow, coefficients))
      return ZS_FLOW_DONE;
  }
  if (halvings == MOST_HALVINGS)
    return ZS_FLOW_MEET;
  m->flow->intervals--;
  const double middle = (from + to) / 2;
  const zs_flow_result result = add(m, from, middle, halvings + 1);
  return result == ZS_FLOW_DONE ? add(m, middle, to, halvings + 1) : result;
}

/* The next number after `s` where a path has a point: curved ones are smooth only between
 * their points.  1 at the end. */
static double next_knot(const maker *m, double s)
{
  double next = 1;
  for (size_t i = 0; i < m->count; i++) {
    const double pieces = (double)(m->paths[i].count - 1);
    const double k = (floor(s * pieces * (1 + 1e-12) + 1e-12) + 1) / pieces;
    if (k < next - 1e-9)
      next = k;
  }
  return next;
}

static zs_flow_result add_all(maker *m)
{
  zs_flow_result result = ZS_FLOW_DONE;
  for (double from = 0; result == ZS_FLOW_DONE && from < 1;) {
    const double to = next_knot(m, from);
    result = add(m, from, to, 0);
    from = to;
  }
  return result;
}

/* |T_k| <= 1, |T_k'| <= k^2, |T_k''| <= k^2 (k^2 - 1) / 3. */
static bool find_reach(zs_flow *flow)
{
  flow->reach = calloc(flow->channels, sizeof *flow->reach);
  for (size_t i = 0; flow->reach && i < flow->channels * flow->intervals; i++) {
    const size_t interval = i / flow->channels, channel = i % flow->channels;
    const double scale = 2 / (flow->ends[interval + 1] - flow->ends[interval]);
    zs_flow_reach sum = {0, 0, 0}, *reach = &flow->reach[channel];
    for (int k = 0; k < flow->used[channel >= flow->channels - 2 * flow->centres]; k++) {
      const size_t row = interval * ZS_FLOW_ORDER + (size_t)k;
      const double c = fabs(flow->table[row * flow->channels + channel]);
      sum.value += c;
      sum.first += c * scale * k * k;
      sum.second += c * scale * scale * k * k * (k * k - 1) / 3;
    }
    reach->value = fmax(reach->value, sum.value);
    reach->first = fmax(reach->first, sum.first);
    reach->second = fmax(reach->second, sum.second);
  }
  return flow->reach != NULL;
}

/* Where two anchors come nearest to each other. */
static void find_meeting(const maker *m, zs_flow_meeting *meeting)
{
  double least = INFINITY;
  for (int k = 0; k < LOOKS; k++)
    for (size_t i = 0; i < m->count; i++)
      for (size_t j = 0; j < i; j++) {
        const double s = (double)k / (LOOKS - 1);
        double a[2], b[2];
        place_of(m, i, s, a);
        place_of(m, j, s, b);
        const double distance = hypot(a[0] - b[0], a[1] - b[1]);
        if (distance < least) {
          least = distance;
          *meeting = (zs_flow_meeting){{m->origin[j], m->origin[i]}, s};
        }
      }
}

static bool allocate(maker *m)
{
  zs_flow *flow = m->flow;
  flow->centres = m->count + (m->helpers ? ZS_FLOW_HELPERS : 0);
  flow->channels = 4 * flow->centres + 2 * TERMS;
  const size_t n = flow->centres;
  m->matrix = malloc(n * n * sizeof *m->matrix);
  m->monomials = malloc(TERMS * n * sizeof *m->monomials);
  m->values = malloc(2 * n * sizeof *m->values);
  m->solution = malloc(ZS_FLOW_ORDER * flow->channels * sizeof *m->solution);
  return m->matrix && m->monomials && m->values && m->solution;
}

zs_flow_result zs_flow_new(zs_flow **flow, const zs_flow_path *paths, size_t count,
                           zs_flow_way way, zs_flow_meeting *meeting)
{
  maker m = {.way = way, .flow = calloc(1, sizeof *m.flow)};
  zs_flow_result result = ZS_FLOW_MEMORY;
  if (m.flow) {
    m.flow->used[0] = m.flow->used[1] = 2;
    measure(m.flow, paths, count);
    if (take_paths(&m, paths, count)) {
      m.helpers = need_helpers(&m);
      if (allocate(&m))
        result = add_all(&m);
      if (result == ZS_FLOW_DONE && !find_reach(m.flow))
        result = ZS_FLOW_MEMORY;
      if (result == ZS_FLOW_MEET && meeting)
        find_meeting(&m, meeting);
    }
  }
  free(m.paths);
  free(m.origin);
  free(m.points);
  free(m.matrix);
  free(m.monomials);
  free(m.values);
  free(m.solution);
  if (result != ZS_FLOW_DONE) {
    zs_flow_free(m.flow);
    m.flow = NULL;
  }
  *flow = m.flow;
  return result;
}
