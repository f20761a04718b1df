#include "output/trace_leaf.h"

#include <math.h>
#include <string.h>

enum {
  SAMPLES = 10, /* of a ray in a leaf ... */
  TOGETHER = ZS_BLOCK / ZS_COLUMN_RAYS, /* ... this many of all rays at a time */
  PEAK_STEPS = 8,
  ROOT_STEPS = 40
};

/* A leaf is sampled evenly, and once more a little before and after it, to know
 * how f comes in and goes out.  These two samples hit nothing. */
enum { FIRST = 1, LAST = SAMPLES - 2 };

/* How well a surface is located, and how far beneath it gradients are taken, in pixels. */
static const double ROOT_TOLERANCE = 1e-3, INSET = 2e-3;

/* How far beyond its place the surface is looked for, in tolerances, to have it between. */
static const float ROOT_BEYOND = 0.4f;

/* Slopes between samples may be this much too small for what lies between. */
static const float SLOPE_SLACK = 1.5f;

/* A ray that enters solid deeper than this, in pixels, has met a cut. */
static const float CUT_DEPTH = 0.25f;

/* Of two numbers, as fminf and fmaxf, which compilers must call. */
static float smaller(float a, float b)
{
  return a < b ? a : b;
}

static float larger(float a, float b)
{
  return a > b ? a : b;
}

/* ---- Shared with the tree ---------------------------------------------------------------- */

void zs_tile_update(zs_tile *tile, unsigned column)
{
  float near = INFINITY, far = -INFINITY;
  tile->left[column] = 0;
  for (unsigned r = 0; r < ZS_COLUMN_RAYS; r++) {
    const zs_ray_span *span = &tile->spans[column][r];
    if (span->near > span->far)
      continue;
    tile->left[column]++;
    near = smaller(near, span->near);
    far = larger(far, span->far);
  }
  tile->near[column] = near;
  tile->far[column] = far;
}

float zs_leaf_depth(const zs_tracer *tracer, uint32_t index)
{
  const zs_camera *camera = tracer->camera;
  if (index == tracer->leaves)
    return (float)camera->far;
  return (float)(camera->near + (camera->far - camera->near) * index / tracer->leaves);
}

/* ---- Leaves -------------------------------------------------------------------------- */

/* The rays of a leaf that are not done, and what is known of each. */
typedef struct leaf {
  zs_tracer *tracer;
  const zs_program *sign, *gradient; /* programs that tell where f >= 0, and all of f */
  zs_tile *tile;
  unsigned column, count;
  uint8_t ray[ZS_COLUMN_RAYS];  /* in the column */
  float u[ZS_COLUMN_RAYS], v[ZS_COLUMN_RAYS];
  float t[SAMPLES][ZS_COLUMN_RAYS], f[SAMPLES][ZS_COLUMN_RAYS]; /* depths and values */
  /* Samples that are of use, those around where the ray may meet the surface. */
  uint8_t from[ZS_COLUMN_RAYS], to[ZS_COLUMN_RAYS];
  uint8_t first[ZS_COLUMN_RAYS]; /* sample that is inside; LAST + 1 if none */
  /* f < 0 or unknown at lo, f >= 0 at hi: a surface is between; where `found`. */
  bool found[ZS_COLUMN_RAYS];
  float lo[ZS_COLUMN_RAYS], hi[ZS_COLUMN_RAYS], f_lo[ZS_COLUMN_RAYS], f_hi[ZS_COLUMN_RAYS];
} leaf;

/* Some rays of a leaf with a depth for each, to be evaluated together. */
typedef struct batch {
  unsigned count;
  uint8_t index[ZS_COLUMN_RAYS]; /* in the leaf's arrays */
  _Alignas(64) float u[ZS_BLOCK], v[ZS_BLOCK], w[ZS_BLOCK], f[ZS_BLOCK];
} batch;

static void evaluate(leaf *l, unsigned n, float *u, float *v, float *w, float *f)
{
  zs_program_values(l->tracer->eval, l->sign, &l->tracer->camera->frame, n, u, v, w, f);
  l->tracer->evaluations += n;
}

static void evaluate_batch(leaf *l, batch *b, const float depth[ZS_COLUMN_RAYS])
{
  for (unsigned k = 0; k < b->count; k++) {
    b->u[k] = l->u[b->index[k]];
    b->v[k] = l->v[b->index[k]];
    b->w[k] = depth[k];
  }
  evaluate(l, b->count, b->u, b->v, b->w, b->f);
}

/* The rays that go on between depths a and b. */
static void gather(leaf *l, float a, float b)
{
  l->count = 0;
  for (unsigned r = 0; r < ZS_COLUMN_RAYS; r++) {
    const zs_ray_span *span = &l->tile->spans[l->column][r];
    if (span->near > span->far || span->near > b || span->far < a)
      continue;
    const unsigned i = l->count++;
    double u, v;
    zs_tile_ray(l->tile, l->tracer->camera, l->column % ZS_COLUMNS * ZS_COLUMN + r % ZS_COLUMN,
                l->column / ZS_COLUMNS * ZS_COLUMN + r / ZS_COLUMN, &u, &v);
    l->ray[i] = (uint8_t)r;
    l->from[i] = 0;
    l->to[i] = SAMPLES - 1;
    l->u[i] = (float)u;
    l->v[i] = (float)v;
    const float lo = larger(a, span->near), hi = smaller(b, span->far);
    for (int s = FIRST; s < LAST; s++)
      l->t[s][i] = lo + (hi - lo) * (float)(s - FIRST) / (LAST - FIRST);
    l->t[0][i] = lo - ZS_LEAF_BEYOND * (b - a);
    l->t[LAST][i] = hi;
    l->t[LAST + 1][i] = hi + ZS_LEAF_BEYOND * (b - a);
  }
}

/* The parts of a leaf that are bounded once more before it is sampled: 2 x 2 or 1 across, the
 * rest in depth. */
typedef struct pieces {
  uint32_t across, slabs;
  float depth[ZS_LANES + 1]; /* between slabs */
  bool open[ZS_LANES];       /* f < 0 is not proven; those across first */
} pieces;

static pieces bound_pieces(const leaf *l, float a, float b)
{
  const zs_camera *camera = l->tracer->camera;
  const uint32_t across = l->tile->rays_per_pixel > 1 ? 1 : 2;
  pieces p = {.across = across, .slabs = ZS_LANES / (across * across)};
  const double step = camera->pixel / l->tile->rays_per_pixel, side = step * ZS_COLUMN / across;
  const double left = camera->left + (l->tile->x + l->column % ZS_COLUMNS * ZS_COLUMN) * step;
  const double top = camera->top - (l->tile->y + l->column / ZS_COLUMNS * ZS_COLUMN) * step;
  for (uint32_t k = 0; k <= p.slabs; k++)
    p.depth[k] = a + (b - a) * (float)k / (float)p.slabs;
  p.depth[0] -= ZS_LEAF_BEYOND * (b - a);
  p.depth[p.slabs] += ZS_LEAF_BEYOND * (b - a);
  zs_boxes boxes;
  zs_bounds f;
  for (unsigned n = 0; n < ZS_LANES; n++) {
    const uint32_t x = n % across, y = n / across % across, k = n / (across * across);
    const double lo[3] = {left + x * side, top - (y + 1) * side, p.depth[k]};
    const double hi[3] = {left + (x + 1) * side, top - y * side, p.depth[k + 1]};
    zs_boxes_set(&boxes, n, lo, hi, (double[3]){0});
  }
  zs_program_bounds(l->tracer->eval, l->sign, &camera->frame, &boxes, &f);
  for (unsigned n = 0; n < ZS_LANES; n++)
    p.open[n] = !(f.hi[n] < 0);
  return p;
}

/* Keep the samples around the open pieces that a ray passes, two to each side to know how f
 * comes in and goes out.  False when it passes none. */
static bool limit(leaf *l, unsigned i, const pieces *p)
{
  const uint32_t side = ZS_COLUMN / p->across, r = l->ray[i];
  const uint32_t across = r / ZS_COLUMN / side * p->across + r % ZS_COLUMN / side;
  uint32_t first = p->slabs, end = 0;
  for (uint32_t k = 0; k < p->slabs; k++)
    if (p->open[k * p->across * p->across + across]) {
      first = first < k ? first : k;
      end = k + 1;
    }
  if (!end)
    return false;
  while (l->from[i] + 2 < SAMPLES && l->t[l->from[i] + 2][i] < p->depth[first])
    l->from[i]++;
  while (l->to[i] >= 2 && l->t[l->to[i] - 2][i] > p->depth[end])
    l->to[i]--;
  return l->from[i] < l->to[i];
}

/* Leave out rays, and samples of others, that bounds of smaller pieces have no use for. */
static void narrow(leaf *l, float a, float b)
{
  const pieces p = bound_pieces(l, a, b);
  const unsigned count = l->count;
  l->count = 0;
  for (unsigned i = 0; i < count; i++) {
    if (!limit(l, i, &p))
      continue;
    const unsigned to = l->count++;
    l->ray[to] = l->ray[i];
    l->u[to] = l->u[i];
    l->v[to] = l->v[i];
    l->from[to] = l->from[i];
    l->to[to] = l->to[i];
    for (int s = 0; s < SAMPLES; s++)
      l->t[s][to] = l->t[s][i];
  }
}

/* Sample s of a ray is inside: a surface is between it and the one before. */
static void bracket(leaf *l, unsigned i, uint8_t s)
{
  const uint8_t before = s > FIRST ? s - 1 : FIRST;
  l->found[i] = true;
  l->first[i] = s;
  l->lo[i] = l->t[before][i];
  l->hi[i] = l->t[s][i];
  l->f_lo[i] = l->f[before][i];
  l->f_hi[i] = l->f[s][i];
}

/* Take the samples of use of rays that have not met any inside yet, and look for such: at most
 * `most` of each ray, the first of them `skip` after the first of use. */
static void sample(leaf *l, uint8_t skip, uint8_t most)
{
  _Alignas(64) float u[ZS_BLOCK], v[ZS_BLOCK], w[ZS_BLOCK], f[ZS_BLOCK];
  uint8_t end[ZS_COLUMN_RAYS];
  unsigned n = 0;
  for (unsigned i = 0; i < l->count; i++) {
    const uint8_t last = l->from[i] + skip + most;
    end[i] = l->found[i] ? 0 : last <= l->to[i] ? last : l->to[i] + 1;
    for (uint8_t s = l->from[i] + skip; s < end[i]; s++) {
      u[n] = l->u[i];
      v[n] = l->v[i];
      w[n++] = l->t[s][i];
    }
  }
  evaluate(l, n, u, v, w, f);
  n = 0;
  for (unsigned i = 0; i < l->count; i++)
    for (uint8_t s = l->from[i] + skip; s < end[i]; s++) {
      l->f[s][i] = f[n++];
      if (l->f[s][i] >= 0 && s >= FIRST && s <= LAST && !l->found[i])
        bracket(l, i, s);
    }
}

/* All samples of use at once when they fit into one block, else the nearer ones of each ray
 * first. */
static void sample_all(leaf *l)
{
  unsigned n = 0;
  for (unsigned i = 0; i < l->count; i++)
    n += l->to[i] - l->from[i] + 1u;
  memset(l->first, LAST + 1, l->count);
  if (n <= ZS_BLOCK) {
    sample(l, 0, SAMPLES);
    return;
  }
  for (uint8_t skip = 0; skip < SAMPLES; skip += TOGETHER)
    sample(l, skip, TOGETHER);
}

/* Four depths along a ray with f < 0, where f may rise to a peak between the
 * middle two: it stays below the lines through the first and the last two
 * when it is concave. */
typedef struct peak {
  float t[4], f[4];
} peak;

/* Where the two lines meet. */
static float peak_depth(const peak *p)
{
  const float rise = (p->f[1] - p->f[0]) / (p->t[1] - p->t[0]);
  const float fall = (p->f[2] - p->f[3]) / (p->t[3] - p->t[2]);
  const float width = p->t[2] - p->t[1];
  return p->t[1] + fminf(fmaxf((p->f[2] - p->f[1] + fall * width) / (rise + fall), 0), width);
}

/* How high f may be there; -INFINITY unless it rises and falls. */
static float peak_height(const peak *p)
{
  const float rise = SLOPE_SLACK * (p->f[1] - p->f[0]) / (p->t[1] - p->t[0]);
  const float fall = SLOPE_SLACK * (p->f[2] - p->f[3]) / (p->t[3] - p->t[2]);
  const float at = peak_depth(p);
  if (!(rise > 0 && fall > 0))
    return -INFINITY;
  return fminf(p->f[1] + rise * (at - p->t[1]), p->f[2] + fall * (p->t[2] - at));
}

/* Go on in the part before or after a new sample between the middle two. */
static peak narrowed(const peak *p, float t, float f)
{
  const peak before = {{p->t[0], p->t[1], t, p->t[2]}, {p->f[0], p->f[1], f, p->f[2]}};
  const peak after = {{p->t[1], t, p->t[2], p->t[3]}, {p->f[1], f, p->f[2], p->f[3]}};
  return peak_height(&before) > peak_height(&after) ? before : after;
}

/* Between samples s - 1 and s of a ray. */
static peak peak_of(const leaf *l, unsigned i, int s)
{
  peak p;
  for (int k = 0; k < 4; k++) {
    p.t[k] = l->t[s - 2 + k][i];
    p.f[k] = l->f[s - 2 + k][i];
  }
  return p;
}

/* Look for f >= 0 between samples s - 1 and s of a batch of rays, and bracket
 * the surface where it is found. */
static void search_peaks(leaf *l, batch *b, int s)
{
  peak peaks[ZS_COLUMN_RAYS];
  float depth[ZS_COLUMN_RAYS];
  for (unsigned k = 0; k < b->count; k++)
    peaks[k] = peak_of(l, b->index[k], s);
  for (int step = 0; step < PEAK_STEPS; step++) {
    unsigned left = 0;
    for (unsigned k = 0; k < b->count; k++) {
      const float at = peak_depth(&peaks[k]);
      if (!(peak_height(&peaks[k]) >= 0 && at > peaks[k].t[1] && at < peaks[k].t[2]))
        continue;
      b->index[left] = b->index[k];
      depth[left] = at;
      peaks[left++] = peaks[k];
    }
    b->count = left;
    if (!left)
      return;
    evaluate_batch(l, b, depth);
    left = 0;
    for (unsigned k = 0; k < b->count; k++) {
      const unsigned i = b->index[k];
      if (b->f[k] >= 0) {
        l->found[i] = true;
        l->first[i] = (uint8_t)s;
        l->lo[i] = peaks[k].t[1];
        l->f_lo[i] = peaks[k].f[1];
        l->hi[i] = depth[k];
        l->f_hi[i] = b->f[k];
        continue;
      }
      b->index[left] = (uint8_t)i;
      peaks[left++] = narrowed(&peaks[k], depth[k], b->f[k]);
    }
    b->count = left;
  }
}

/* Thin solid between samples, in front of what they show. */
static void look_closer(leaf *l)
{
  batch b;
  for (int s = FIRST + 1; s <= LAST; s++) {
    b.count = 0;
    for (unsigned i = 0; i < l->count; i++) {
      if (s >= l->first[i] || s < l->from[i] + 2 || s >= l->to[i] ||
          !(l->f[s - 1][i] > l->f[s - 2][i] && l->f[s][i] > l->f[s + 1][i]))
        continue;
      const peak p = peak_of(l, i, s);
      if (peak_height(&p) >= 0)
        b.index[b.count++] = (uint8_t)i;
    }
    if (b.count)
      search_peaks(l, &b, s);
  }
}

/* A point between the ends of a bracket: where the chord meets zero, and a little
 * beyond from the nearer end, so that the farther one comes near too; in every
 * fourth step the middle. */
static float root_guess(float lo, float hi, float f_lo, float f_hi, float tolerance, int step)
{
  const float middle = lo + (hi - lo) / 2, beyond = ROOT_BEYOND * tolerance;
  const float zero = lo + (hi - lo) * (f_lo / (f_lo - f_hi));
  const float chord = f_hi > -f_lo ? zero + beyond : zero - beyond;
  return step % 4 != 3 && chord > lo && chord < hi ? chord : middle;
}

/* Close in on the surface in all brackets, by false position with the Illinois
 * rule: an end that stays twice has its value halved. */
static void close_in(leaf *l, float tolerance)
{
  batch b = {.count = 0};
  float depth[ZS_COLUMN_RAYS];
  int8_t stayed[ZS_COLUMN_RAYS] = {0}; /* the end that was kept last: -1 lo, 1 hi */
  for (unsigned i = 0; i < l->count; i++)
    if (l->found[i] && l->first[i] > FIRST)
      b.index[b.count++] = (uint8_t)i;
  for (int step = 0; step < ROOT_STEPS; step++) {
    unsigned left = 0;
    for (unsigned k = 0; k < b.count; k++) {
      const unsigned i = b.index[k];
      if (!(l->hi[i] - l->lo[i] > tolerance))
        continue;
      depth[left] = root_guess(l->lo[i], l->hi[i], l->f_lo[i], l->f_hi[i], tolerance, step);
      if (depth[left] > l->lo[i] && depth[left] < l->hi[i])
        b.index[left++] = (uint8_t)i;
    }
    b.count = left;
    if (!left)
      return;
    evaluate_batch(l, &b, depth);
    for (unsigned k = 0; k < left; k++) {
      const unsigned i = b.index[k];
      const bool inside = b.f[k] >= 0;
      *(inside ? &l->hi[i] : &l->lo[i]) = depth[k];
      *(inside ? &l->f_hi[i] : &l->f_lo[i]) = b.f[k];
      if (stayed[i] == (inside ? -1 : 1))
        *(inside ? &l->f_lo[i] : &l->f_hi[i]) /= 2;
      stayed[i] = inside ? -1 : 1;
    }
  }
}

/* The outward normal where a ray enters the box, or the eye's own plane. */
static void cut_normal(const zs_camera *camera, const zs_ray_span *span, double u, double v,
                       float normal[3])
{
  double direction[3];
  zs_camera_direction(camera, u, v, direction);
  for (int k = 0; k < 3; k++)
    normal[k] = span->axis < 0    ? (float)-direction[k]
                : span->axis == k ? (float)span->side
                                  : 0;
}

/* Write down what one ray hits, given f and its gradient there. */
static void settle(leaf *l, unsigned i, float f, const float gradient[3])
{
  const zs_camera *camera = l->tracer->camera;
  zs_ray_span *span = &l->tile->spans[l->column][l->ray[i]];
  zs_hit *hit = &l->tile->hits[l->column][l->ray[i]];
  hit->kind = ZS_HIT_SURFACE;
  hit->depth = l->hi[i];
  float length = sqrtf(gradient[0] * gradient[0] + gradient[1] * gradient[1] +
                       gradient[2] * gradient[2]);
  bool known = length > 0 && length < INFINITY;
  float deep = CUT_DEPTH * (float)zs_camera_footprint(camera, (double)hit->depth);
  if (l->first[i] == FIRST && hit->depth == span->near && !(known && f < deep * length))
    hit->kind = ZS_HIT_CUT;
  if (hit->kind == ZS_HIT_CUT || !known)
    cut_normal(camera, span, (double)l->u[i], (double)l->v[i], hit->normal);
  else
    for (int k = 0; k < 3; k++)
      hit->normal[k] = -gradient[k] / length;
  *span = (zs_ray_span){.near = INFINITY, .far = -INFINITY};
}

/* Gradients at all hits, in axis-parallel coordinates about the first one.  They
 * are taken `inset` deeper: many distances have no gradient at f = 0 itself. */
static void settle_all(leaf *l, double inset)
{
  _Alignas(64) float at[3][ZS_BLOCK], gradient[4][ZS_BLOCK];
  uint8_t index[ZS_COLUMN_RAYS];
  unsigned n = 0;
  double origin[3] = {0, 0, 0}, point[3];
  for (unsigned i = 0; i < l->count; i++) {
    if (!l->found[i])
      continue;
    zs_camera_point(l->tracer->camera, (double)l->u[i], (double)l->v[i],
                    (double)l->hi[i] + inset, point);
    if (n == 0)
      memcpy(origin, point, sizeof origin);
    for (int k = 0; k < 3; k++)
      at[k][n] = (float)(point[k] - origin[k]);
    index[n++] = (uint8_t)i;
  }
  if (!n)
    return;
  zs_frame frame = zs_frame_at(origin);
  zs_program_gradients(l->tracer->eval, l->gradient, &frame, n, at[0], at[1], at[2], gradient[0]);
  l->tracer->evaluations += n;
  for (unsigned k = 0; k < n; k++) {
    const float g[3] = {gradient[1][k], gradient[2][k], gradient[3][k]};
    settle(l, index[k], gradient[0][k], g);
  }
  zs_tile_update(l->tile, l->column);
}

void zs_trace_leaf(zs_tracer *tracer, zs_tile *tile, const zs_trace_part *p)
{
  const float a = zs_leaf_depth(tracer, p->lo[2]), b = zs_leaf_depth(tracer, p->hi[2]);
  leaf l = {.tracer = tracer,
            .sign = p->sign,
            .gradient = p->gradient,
            .tile = tile,
            .column = p->lo[1] * ZS_COLUMNS + p->lo[0]};
  gather(&l, a, b);
  if (l.count && !tracer->brute)
    narrow(&l, a, b);
  if (!l.count)
    return;
  sample_all(&l);
  look_closer(&l);
  const double ray = zs_camera_footprint(tracer->camera, (double)b) / tile->rays_per_pixel;
  close_in(&l, (float)(ROOT_TOLERANCE * ray));
  settle_all(&l, INSET * ray);
}
