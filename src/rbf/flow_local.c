/* What a flow is within a box: its channels as short polynomials of s, in single precision. */
#include "rbf/flow.h"

#include <math.h>
#include <string.h>

enum {
  NODES = 8, /* values of a channel that its polynomial is found from */
  SHORT = 3  /* coefficients that are few enough for every smaller box */
};

/* What polynomials may leave out of both components of a displacement, by the flow's size. */
static const double LEFT_OUT = 2e-7;
/* What single precision costs, and may cost. */
static const double ROUNDING = 6e-8, MOST_ROUNDING = 1e-6;
/* Half of the largest range of s, and the largest x and y, that are worth a try. */
static const float WIDEST = 0.12f, FARTHEST = 8;
/* Polynomials over ranges of s larger than this part of others will hardly be shorter. */
static const float SMALLER = 0.4f;

/* Rows of numbers, one of each channel, in the order of a flow's: of both components the weights
 * of the centres and the polynomial's three, then x and y of the centres. */
typedef struct rows {
  size_t centres, channels;
  int count;          /* 1 or NODES */
  double *row[NODES]; /* values at Chebyshev nodes, then coefficients of these polynomials */
  double *out[NODES];
} rows;

static size_t place_channel(const rows *r, size_t centre)
{
  return 2 * (r->centres + 3) + centre;
}

/* The larger weight of a centre. */
static double weight_of(const rows *r, size_t centre)
{
  return fmax(fabs(r->out[0][centre]), fabs(r->out[0][r->centres + 3 + centre]));
}

/* What a channel's coefficient counts for, which is that of a place by the weight of its centre. */
static double importance(const rows *r, size_t channel)
{
  const size_t first = place_channel(r, 0);
  return channel < first ? 1 : weight_of(r, (channel - first) % r->centres);
}

/* ---- Within one interval ------------------------------------------------------------- */

/* Chebyshev polynomials T_k (a + b u) by those of u: by[k][i] T_i (u), summed over i. */
typedef struct expansions {
  double by[ZS_FLOW_ORDER][ZS_FLOW_ORDER + 1];
} expansions;

/* T_k = 2 (a + b u) T_(k-1) - T_(k-2), and u T_i (u) = (T_(i+1) + T_|i-1|) / 2. */
static void find_expansions(double a, double b, int count, expansions *e)
{
  memset(e, 0, sizeof *e);
  e->by[0][0] = 1;
  e->by[1][0] = a;
  e->by[1][1] = b;
  for (int k = 2; k < count; k++) {
    const double *last = e->by[k - 1];
    for (int i = 0; i <= k; i++) {
      const double below = i == 0 ? 0 : i == 1 ? 2 * last[0] : last[i - 1];
      e->by[k][i] = 2 * a * last[i] + b * (below + last[i + 1]) - e->by[k - 2][i];
    }
  }
}

/* The i-th coefficients of neighbouring channels. */
static void expand_channels(const zs_flow *flow, const double *table, size_t count, int used,
                            const expansions *e, int i, double *restrict sums)
{
  memset(sums, 0, count * sizeof *sums);
  for (int k = i; k < used; k++) {
    const double by = e->by[k][i];
    const double *restrict series = table + (size_t)k * flow->channels;
#pragma omp simd
    for (size_t c = 0; c < count; c++)
      sums[c] += by * series[c];
  }
}

/* The i-th coefficients of all channels. */
static void expand_row(const rows *r, const zs_flow *flow, size_t interval, const expansions *e,
                       int i, double *out)
{
  const size_t places = place_channel(r, 0);
  const double *table = flow->table + interval * ZS_FLOW_ORDER * flow->channels;
  expand_channels(flow, table, places, flow->used[0], e, i, out);
  expand_channels(flow, table + places, 2 * r->centres, flow->used[1], e, i, out + places);
}

/* The polynomials from the series of an interval that the range lies in.  False when there would
 * have to be more coefficients. */
static bool expand(rows *r, const zs_flow *flow, size_t interval, double middle, double half)
{
  const int most = flow->used[0] > flow->used[1] ? flow->used[0] : flow->used[1];
  const double from = flow->ends[interval], scale = 2 / (flow->ends[interval + 1] - from);
  expansions e;
  find_expansions(scale * (middle - from) - 1, scale * half, most, &e);
  for (int i = 0; i < r->count; i++)
    expand_row(r, flow, interval, &e, i, r->out[i]);
  double rest = 0;
  for (int i = r->count; i < most && half > 0; i++) {
    expand_row(r, flow, interval, &e, i, r->row[0]);
    for (size_t c = 0; c < r->channels; c++)
      rest += importance(r, c) * fabs(r->row[0][c]);
  }
  return rest <= LEFT_OUT;
}

/* ---- Across intervals ------------------------------------------------------------------- */

/* cos (pi k (j + 1/2) / NODES) */
static double node_cosine(int k, int j)
{
  static const double quarter[NODES + 1] = {1, 0.98078528040323045, 0.92387953251128676,
                                            0.83146961230254524, 0.70710678118654752,
                                            0.55557023301960222, 0.38268343236508977,
                                            0.19509032201612827, 0};
  const int angle = k * (2 * j + 1) % (4 * NODES); /* in parts of half a turn, 2 NODES of them */
  const int turned = angle > 2 * NODES ? 4 * NODES - angle : angle;
  return turned > NODES ? -quarter[2 * NODES - turned] : quarter[turned];
}

static void transform(rows *r)
{
  for (int k = 0; k < r->count; k++) {
    memset(r->out[k], 0, r->channels * sizeof(double));
    for (int j = 0; j < r->count; j++) {
      const double by = node_cosine(k, j) * (k ? 2.0 : 1.0) / r->count;
      const double *restrict values = r->row[j];
      double *restrict sums = r->out[k];
#pragma omp simd
      for (size_t i = 0; i < r->channels; i++)
        sums[i] += by * values[i];
    }
  }
}

/* All channels at some s. */
static void evaluate(const rows *r, const zs_flow *flow, double s, double *out)
{
  zs_flow_state state;
  const size_t n = r->centres;
  zs_flow_at(flow, fmin(fmax(s, 0), 1), &state, NULL);
  for (size_t k = 0; k < 2; k++) {
    memcpy(out + k * (n + 3), state.weight[k], n * sizeof(double));
    memcpy(out + k * (n + 3) + n, state.polynomial[k], sizeof state.polynomial[k]);
  }
  memcpy(out + place_channel(r, 0), state.x, n * sizeof(double));
  memcpy(out + place_channel(r, n), state.y, n * sizeof(double));
}

/* The polynomials, by values at the nodes of a range of s. */
static void interpolate(rows *r, const zs_flow *flow, double middle, double half)
{
  for (int k = 0; k < r->count; k++)
    evaluate(r, flow, r->count == 1 ? middle : middle + half * node_cosine(1, k), r->row[k]);
  transform(r);
}

/* The paths of anchors have corners in their second derivatives, where values at nodes can
 * only be off when they are off at the ends too. */
static bool holds_at_ends(const rows *r, const zs_flow *flow, double middle, double half)
{
  for (int end = -1; end <= 1 && r->count > 1; end += 2) {
    double rest = 0;
    evaluate(r, flow, middle + end * half, r->row[0]);
    for (size_t i = 0; i < r->channels; i++) {
      double sum = 0;
      for (int k = 0; k < r->count; k++)
        sum += k % 2 && end < 0 ? -r->out[k][i] : r->out[k][i];
      rest += importance(r, i) * fabs(sum - r->row[0][i]);
    }
    if (!(rest <= LEFT_OUT))
      return false;
  }
  return true;
}

/* The polynomials of a range of s; false when these are not short. */
static bool find_polynomials(rows *r, const zs_flow *flow, double middle, double half)
{
  static const double WITHIN = 1 - 1e-6; /* rounding does not lead to the next interval */
  const size_t interval = zs_flow_interval(flow, middle - WITHIN * half);
  if (interval == zs_flow_interval(flow, middle + WITHIN * half))
    return expand(r, flow, interval, middle, half);
  interpolate(r, flow, middle, half);
  return holds_at_ends(r, flow, middle, half);
}

/* ---- The table ------------------------------------------------------------------------ */

/* How large r^2 log r and its derivative become up to a distance, together. */
static double steepness(double far)
{
  const double l = log(fmax(far, 1e-300));
  return fmax(0.19, far * far * l) + fmax(0.45, far * (2 * l + 1));
}

/* Whether single precision will do in a box: terms are not much larger than their sum, in either
 * component. */
static bool is_precise(const rows *r, const float lo[], const float hi[])
{
  const double *x = r->out[0] + place_channel(r, 0), *y = x + r->centres;
  double sum[2] = {0, 0};
  for (size_t i = 0; i < r->centres; i++) {
    const double dx = fmax(fabs((double)lo[0] - x[i]), fabs((double)hi[0] - x[i]));
    const double dy = fmax(fabs((double)lo[1] - y[i]), fabs((double)hi[1] - y[i]));
    const double steep = steepness(sqrt(dx * dx + dy * dy));
    for (size_t k = 0; k < 2; k++)
      sum[k] += fabs(r->out[0][k * (r->centres + 3) + i]) * steep;
  }
  return fmax(sum[0], sum[1]) * ROUNDING < MOST_ROUNDING;
}

/* How many coefficients are needed, of weights and the polynomial or of places. */
static int count_needed(const rows *r, bool places)
{
  double rest = 0;
  const size_t from = places ? place_channel(r, 0) : 0;
  const size_t to = places ? r->channels : place_channel(r, 0);
  for (int k = r->count - 1; k > 0; k--) {
    for (size_t c = from; c < to; c++)
      rest += importance(r, c) * fabs(r->out[k][c]);
    if (!(rest <= LEFT_OUT))
      return k + 1;
  }
  return 1;
}

/* Coefficients of powers, in the place of values, from the first `count` of Chebyshev's, of the
 * channels first <= c < end. */
static void find_powers(rows *r, size_t first, size_t end, int count)
{
  static const double powers[NODES - 1][NODES - 1] = {
    {1},
    {0, 1},
    {-1, 0, 2},
    {0, -3, 0, 4},
    {1, 0, -8, 0, 8},
    {0, 5, 0, -20, 0, 16},
    {-1, 0, 18, 0, -48, 0, 32}};
  for (int i = 0; i < count; i++) {
    double *restrict sums = r->row[i];
    memset(sums + first, 0, (end - first) * sizeof *sums);
    for (int k = i; k < count; k += 2) { /* odd or even like the polynomial */
      const double by = powers[k][i];
      const double *restrict series = r->out[k];
#pragma omp simd
      for (size_t c = first; c < end; c++)
        sums[c] += by * series[c];
    }
  }
}

static float *put_channel(const rows *r, size_t channel, int count, float *out)
{
  for (int i = 0; i < count; i++)
    *out++ = (float)r->row[i][channel];
  return out;
}

static void put_table(rows *r, const zs_flow_local *local, float *out)
{
  const size_t n = r->centres, places = place_channel(r, 0);
  find_powers(r, 0, places, local->weights);
  find_powers(r, places, r->channels, local->places);
  for (size_t k = 0; k < 2; k++)
    for (size_t i = 0; i < 3; i++)
      out = put_channel(r, k * (n + 3) + n + i, local->weights, out);
  for (size_t i = 0; i < n; i++) {
    out = put_channel(r, i, local->weights, out);
    out = put_channel(r, n + 3 + i, local->weights, out);
    out = put_channel(r, places + i, local->places, out);
    out = put_channel(r, places + n + i, local->places, out);
  }
}

/* False when memory is out. */
static bool make_rows(rows *r, size_t centres, int count, zs_arena *arena)
{
  *r = (rows){.centres = centres, .channels = 6 + 4 * centres, .count = count};
  double *numbers = zs_arena_reserve(arena, 2 * (size_t)count * r->channels, sizeof *numbers);
  for (int k = 0; k < count && numbers; k++) {
    r->row[k] = numbers + 2 * (size_t)k * r->channels;
    r->out[k] = r->row[k] + r->channels;
  }
  return numbers;
}

/* The range of s in a box; false when the box is too large for a try. */
static bool find_range(const float lo[], const float hi[], zs_flow_local *local)
{
  const float from = fminf(fmaxf(lo[2], 0), 1), to = fminf(fmaxf(hi[2], 0), 1);
  *local = (zs_flow_local){.middle = (from + to) / 2, .half = (to - from) / 2};
  return local->half <= WIDEST && lo[0] >= -FARTHEST && lo[1] >= -FARTHEST && hi[0] <= FARTHEST &&
         hi[1] <= FARTHEST;
}

const void *zs_flow_restricted(const void *data, const float lo[], const float hi[],
                               zs_arena *arena)
{
  const zs_flow_part *part = data;
  const zs_flow_local *known = part->local;
  zs_flow_local found;
  if ((known && known->weights <= SHORT) || !find_range(lo, hi, &found) ||
      (known && found.half > SMALLER * known->half))
    return data;
  const size_t n = part->flow->centres;
  const double middle = (double)found.middle, half = (double)found.half;
  zs_flow_part *own = ZS_ARENA_NEW(arena, zs_flow_part, 1);
  zs_flow_local *local = ZS_ARENA_NEW(arena, zs_flow_local, 1);
  float *table = zs_arena_reserve(arena, (6 + 4 * n) * NODES, sizeof *table);
  const zs_arena_mark mark = zs_arena_mark_here(arena);
  rows r;
  if (!own || !local || !table || !make_rows(&r, n, half > 0 ? NODES : 1, arena))
    return data;
  const bool whole = find_polynomials(&r, part->flow, middle, half);
  found.weights = count_needed(&r, false);
  found.places = count_needed(&r, true);
  found.table = table;
  const bool good =
    whole && found.weights < NODES && found.places < NODES && is_precise(&r, lo, hi);
  if (good)
    put_table(&r, &found, table);
  zs_arena_rewind(arena, mark);
  *local = found;
  *own = (zs_flow_part){part->flow, local, part->component, 0};
  return good ? own : data;
}

const void *zs_flow_restricted_like(const void *data, const void *sibling,
                                    const void *restricted_sibling, zs_arena *arena)
{
  const zs_flow_part *part = data, *like = restricted_sibling;
  zs_flow_part *own = restricted_sibling == sibling ? NULL : ZS_ARENA_NEW(arena, zs_flow_part, 1);
  if (own)
    *own = (zs_flow_part){part->flow, like->local, part->component, 0};
  return own ? own : data;
}
