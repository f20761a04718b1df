/* Gaps between slices filled by distances that move with the shapes. */
#include "stack/join.h"

#include "base/array.h"
#include "samples/raster.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  MOST_STEPS = 16, /* of an iteration for a place on a frame half-way */
  BENDS = 2        /* rounds of making ways across slices smooth */
};

/* Such a place is good enough when it moves by less, in pixels. */
static const float SETTLED = 1e-3F;

/* How stiff motions are: between neighbours in a stack, and between two shapes alone, of
 * which there is nothing else to know. */
static const float STIFF = 100, PLIANT = 30;

/* What moved distances count for where the gate is open: radial functions still know better
 * how the solid bends. */
static const double MOST_SHARE = 0.8;

/* ---- Motions ---------------------------------------------------------------------------- */

bool zs_join_find_motions(zs_joiner *j, bool align)
{
  const zs_slices *s = j->slices;
  const size_t gaps = s->count - 1, width = j->raster->count[0], height = j->raster->count[1];
  j->motions = calloc(gaps, sizeof *j->motions);
  if (!j->motions)
    return false;
  bool memory = true;
#pragma omp parallel for schedule(dynamic, 1) num_threads(j->threads) reduction(&& : memory)
  for (size_t gap = 0; gap < gaps; gap++)
    if (memory && s->slices[gap].distance && s->slices[gap + 1].distance)
      memory = zs_motion_find(&j->motions[gap], j->fields[gap], j->fields[gap + 1], width, height,
                              gaps == 1 ? PLIANT : STIFF, align);
  return memory;
}

static bool moves(const zs_joiner *j, ptrdiff_t gap)
{
  return gap >= 0 && gap + 1 < (ptrdiff_t)j->slices->count && j->motions[gap].gate;
}

/* The displacement on the frame of a gap; none where nothing moves. */
static void displacement(const zs_joiner *j, ptrdiff_t gap, const float m[2], float u[2])
{
  for (int k = 0; k < 2; k++)
    u[k] = moves(j, gap) ? zs_motion_sample(j->motions[gap].u[k], j->motions[gap].width,
                                            j->motions[gap].height, m[0], m[1])
                         : 0;
}

/* Where on the frame half-way something is that has moved on from there by the part `on` of
 * the displacement, to p. */
static void find_half_way(const zs_joiner *j, ptrdiff_t gap, const float p[2], float on,
                          float m[2])
{
  float u[2], step = INFINITY;
  memcpy(m, p, 2 * sizeof *m);
  for (int k = 0; k < MOST_STEPS && step > SETTLED; k++) {
    displacement(j, gap, m, u);
    float off[2] = {p[0] - on * u[0] - m[0], p[1] - on * u[1] - m[1]};
    if (moves(j, gap))
      zs_motion_shrink(&j->motions[gap].growth, on, off);
    step = fabsf(off[0]) + fabsf(off[1]);
    m[0] += off[0];
    m[1] += off[1];
  }
}

/* Where something that is at m half-way through a gap is in the two slices beside it and in
 * those beyond. */
static void follow(const zs_joiner *j, size_t gap, const float m[2], float p[4][2])
{
  float u[2], beyond[2];
  displacement(j, (ptrdiff_t)gap, m, u);
  for (int k = 0; k < 2; k++) {
    p[1][k] = m[k] - u[k] / 2;
    p[2][k] = m[k] + u[k] / 2;
  }
  for (int up = 0; up < 2; up++) {
    const ptrdiff_t other = (ptrdiff_t)gap + (up ? 1 : -1);
    const float *from = p[up ? 2 : 1];
    find_half_way(j, other, from, up ? -0.5F : 0.5F, beyond);
    displacement(j, other, beyond, u);
    for (int k = 0; k < 2; k++)
      p[up ? 3 : 0][k] = beyond[k] + (up ? u[k] : -u[k]) / 2;
  }
}

/* The distances of the four slices around a layer where the point at (x, y) is in them,
 * joined by the cubic through them; so is the way from one to the next. */
static double carried(const zs_joiner *j, size_t gap, double part, const zs_raster_weights *w,
                      float x, float y)
{
  const size_t width = j->raster->count[0], height = j->raster->count[1];
  const float at[2] = {x, y};
  float m[2], p[4][2];
  find_half_way(j, (ptrdiff_t)gap, at, (float)part - 0.5F, m);
  follow(j, gap, m, p);
  for (int round = 0; round < BENDS; round++) {
    float off[2] = {x, y};
    for (int i = 0; i < 4; i++)
      for (int k = 0; k < 2; k++)
        off[k] -= (float)w->value[i] * p[i][k];
    m[0] += off[0];
    m[1] += off[1];
    follow(j, gap, m, p);
  }
  double f = 0;
  for (int i = 0; i < 4; i++) {
    const size_t slice = gap + (size_t)i - 1; /* of no weight beyond the ends */
    if (w->value[i] != 0)
      f += w->value[i] *
           (double)zs_motion_sample(j->fields[slice], width, height, p[i][0], p[i][1]);
  }
  return f;
}

/* ---- Layers ------------------------------------------------------------------------------ */

static double gate_of(const zs_joiner *j, ptrdiff_t gap, size_t pixel)
{
  const ptrdiff_t last = (ptrdiff_t)j->slices->count - 2;
  gap = gap < 0 ? 0 : gap > last ? last : gap;
  return moves(j, gap) ? (double)j->motions[gap].gate[pixel] : 0;
}

/* How much the moved distances count: as the gates of the two nearest gaps say, but all in
 * a gap whose slices have nothing in common, which fades in the gaps beside it. */
static double share(const zs_joiner *j, size_t gap, double part, size_t pixel)
{
  const double position = (double)gap + part - 0.5;
  const ptrdiff_t below = (ptrdiff_t)floor(position);
  const double t = zs_smooth_step(position - (double)below);
  double g = (1 - t) * gate_of(j, below, pixel) + t * gate_of(j, below + 1, pixel);
  g *= MOST_SHARE;
  for (ptrdiff_t k = (ptrdiff_t)gap - 1; k <= (ptrdiff_t)gap + 1; k++)
    if (moves(j, k) && j->motions[k].apart) {
      const double away = k < (ptrdiff_t)gap ? part : k > (ptrdiff_t)gap ? 1 - part : 0;
      g = fmax(g, zs_smooth_step(1 - away));
    }
  return g;
}

static void carry_layer(const zs_joiner *j, uint32_t layer, bool all)
{
  const zs_raster *r = j->raster;
  const size_t gap = zs_joiner_gap(j, layer), n = r->count[0];
  const float *h = r->heights;
  const double from = (double)h[j->level[gap]], to = (double)h[j->level[gap + 1]];
  const double part = ((double)h[layer] - from) / (to - from);
  zs_raster_weights w;
  zs_raster_layers(&j->carrier, (double)h[layer], &w);
  for (size_t i = 0; i < n * r->count[1]; i++) {
    const double g = all ? 1 : share(j, gap, part, i);
    if (g == 0)
      continue;
    float *sample = zs_raster_sample(r, i % n, i / n, layer);
    const double f = carried(j, gap, part, &w, (float)(i % n), (float)(i / n));
    *sample = (float)(all ? f : (1 - g) * (double)*sample + g * f);
  }
}

void zs_join_carry(const zs_joiner *j, bool all)
{
#pragma omp parallel for schedule(dynamic, 1) num_threads(j->threads)
  for (uint32_t layer = 0; layer < j->raster->count[2]; layer++)
    carry_layer(j, layer, all);
}

/* ---- Ways -------------------------------------------------------------------------------- */

/* The way of a point on the outline of a gap's lower slice; false when it is not on the outline,
 * or the moved distances do not count there. */
static bool find_way(const zs_joiner *j, size_t gap, const zs_slice_point *p, bool all,
                     zs_join_way *way)
{
  const zs_motion *motion = &j->motions[gap];
  const float at[2] = {p->x - (float)j->first[0], p->y - (float)j->first[1]};
  float m[2], u[2];
  if (p->value != 0)
    return false;
  find_half_way(j, (ptrdiff_t)gap, at, -0.5F, m);
  displacement(j, (ptrdiff_t)gap, m, u);
  for (int k = 0; k < 2; k++) {
    way->from[k] = at[k];
    way->to[k] = m[k] + u[k] / 2;
  }
  way->from[2] = j->raster->heights[j->level[gap]];
  way->to[2] = j->raster->heights[j->level[gap + 1]];
  return all || motion->apart ||
         zs_motion_sample(motion->gate, motion->width, motion->height, m[0], m[1]) > 0.5F;
}

/* Append at most MOST_WAYS of a gap's, spread over all. */
static bool add_ways(const zs_joiner *j, size_t gap, bool all, zs_joined *joined, size_t *capacity)
{
  enum { MOST_WAYS = 32 };
  const zs_stack_slice *slice = &j->slices->slices[gap];
  zs_join_way way;
  size_t count = 0, next = 0, added = 0;
  for (size_t i = 0; i < slice->count; i++)
    count += find_way(j, gap, &slice->points[i], all, &way);
  const size_t most = count < MOST_WAYS ? count : MOST_WAYS;
  for (size_t i = 0; i < slice->count && added < most; i++) {
    if (!find_way(j, gap, &slice->points[i], all, &way) || next++ * most < added * count)
      continue;
    zs_join_way *ways =
      zs_array_grown(joined->ways, joined->way_count + 1, capacity, sizeof *ways);
    if (!ways)
      return false;
    joined->ways = ways;
    ways[joined->way_count++] = way;
    added++;
  }
  return true;
}

bool zs_join_find_ways(const zs_joiner *j, bool all, zs_joined *joined)
{
  size_t capacity = 0;
  for (size_t gap = 0; gap + 1 < j->slices->count; gap++)
    if (moves(j, (ptrdiff_t)gap) && !add_ways(j, gap, all, joined, &capacity))
      return false;
  return true;
}
