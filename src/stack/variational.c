/* Gaps between slices filled by sums of radial functions through their outlines. */
#include "stack/join.h"

#include "base/array.h"
#include "samples/raster.h"
#include "stack/blocks.h"

#include <math.h>
#include <stdlib.h>

static const double PI = 3.14159265358979323846;

/* f is found where the distances, joined, are less than this, by the length of the gap in
 * pixels; towards there it goes over into these. */
static const double BAND = 4, BAND_OF_GAP = 0.6, MOST_BAND = 40, PURE = 0.6;

/* Where it is more, in pixels, f does not change sign within a pixel's reach. */
static const double NEAR = 2.5;

/* Half-way across gaps that are not wide, distances joined by cubics count for this part: the two
 * err in different ways, the mean of both less.  At slices, where distances know but the stairs
 * of pixels, they do not. */
static const double DISTANCES = 0.2;

/* Across wide gaps, in pixels, heights also count for less, so that more goes straight from
 * slice to slice; f is then the mean of both, each bounded so that none outweighs the other
 * far from its surface. */
static const double WIDE = 12, SCALES[] = {1, 0.6}, BOUND = 8;
enum { SCALE_COUNT = sizeof SCALES / sizeof SCALES[0] };

/* Gaps beside one count as no more than so many times as long or as short; the one itself is at
 * least so many pixels long. */
static const double UNEVEN = 3, LEAST_GAP = 0.25;

/* Blocks overlap by this many pixels, or this part of the gap. */
static const double OVERLAP = 6, OVERLAP_OF_GAP = 0.5, MOST_OVERLAP = 24;

/* Constraints of a block: they have to reach across several gaps, and so are more where these
 * are wide. */
static const double MOST_OF_GAP = 150, LEAST_MOST = 600, MOST_MOST = 1400;

/* What outlines that follow the stairs of pixels are smoothed by, in pixels to the third: so
 * much that of waves along an outline, its points 0.8 pixels apart, half is left where they are
 * 6 pixels long.  Shorter ones are made by stairs, longer ones not. */
static const double STAIRS = 30;

/* Pixels between points of empty slices. */
enum { LATTICE = 6 };

static double length_of(const zs_joiner *j, size_t gap)
{
  return j->slices->slices[gap + 1].height - j->slices->slices[gap].height;
}

static double own_length_of(const zs_joiner *j, size_t gap)
{
  return fmax(length_of(j, gap), LEAST_GAP);
}

/* How much longer than it is a gap beside another one counts as. */
static double stretch_of(const zs_joiner *j, size_t gap, size_t beside)
{
  const double own = own_length_of(j, gap), length = length_of(j, beside);
  return fmin(fmax(length, own / UNEVEN), own * UNEVEN) / length;
}

/* A height, in or beside a gap, as its sums have it: what slices that are near on one side say of
 * slopes is not carried far to the other. */
static double height_in(const zs_joiner *j, size_t gap, double height)
{
  const zs_slices *s = j->slices;
  const double from = s->slices[gap].height, to = s->slices[gap + 1].height;
  const double own = own_length_of(j, gap);
  if (height < from)
    return from + (gap > 0 ? stretch_of(j, gap, gap - 1) : 1) * (height - from);
  if (height > to)
    return from + own +
           (gap + 2 < s->count ? stretch_of(j, gap, gap + 1) : 1) * (height - to);
  return from + own * (height - from) / (to - from);
}

static int scales_of(const zs_joiner *j, size_t gap)
{
  return length_of(j, gap) >= WIDE ? SCALE_COUNT : 1;
}

/* ---- Constraints ------------------------------------------------------------------------ */

typedef struct list {
  zs_block_constraint *items;
  size_t count, capacity;
} list;

static bool append(list *l, double x, double y, double z, double value)
{
  zs_block_constraint *items =
    zs_array_grown(l->items, l->count + 1, &l->capacity, sizeof *items);
  if (!items)
    return false;
  l->items = items;
  items[l->count++] = (zs_block_constraint){{x, y, z}, value};
  return true;
}

/* What is above and below an empty slice ends before it. */
static bool append_empty(list *l, const zs_joiner *j, size_t i, double height)
{
  const zs_slices *s = j->slices;
  const double value = (double)j->fields[i][0] / 2;
  for (size_t y = 0; y < s->height; y += LATTICE)
    for (size_t x = 0; x < s->width; x += LATTICE) {
      const size_t pixel = y * s->width + x;
      const bool below = i > 0 && zs_slice_inside(&s->slices[i - 1], pixel);
      const bool above = i + 1 < s->count && zs_slice_inside(&s->slices[i + 1], pixel);
      if ((below || above) &&
          !append(l, (double)x, (double)y, height, value))
        return false;
    }
  return true;
}

/* Those of the two slices of a gap and of their neighbours. */
static bool gather(list *l, const zs_joiner *j, size_t gap)
{
  const zs_slices *s = j->slices;
  for (size_t i = gap > 0 ? gap - 1 : 0; i < s->count && i <= gap + 2; i++) {
    const zs_stack_slice *slice = &s->slices[i];
    const double height = height_in(j, gap, slice->height);
    if (!slice->distance && !append_empty(l, j, i, height))
      return false;
    for (size_t k = 0; k < slice->count; k++) {
      const zs_slice_point *p = &slice->points[k];
      if (!append(l, (double)p->x, (double)p->y, height, (double)p->value))
        return false;
    }
  }
  return true;
}

/* ---- Layers ----------------------------------------------------------------------------- */

/* Where a layer is, counted in gaps. */
static double position_of(const zs_joiner *j, uint32_t layer, size_t gap)
{
  const float *h = j->raster->heights;
  const double from = (double)h[j->level[gap]], to = (double)h[j->level[gap + 1]];
  return (double)gap + ((double)h[layer] - from) / (to - from);
}

/* How much the sum of a gap counts at a position.  The first and the last reach to the
 * ends. */
static double weight_of(const zs_joiner *j, size_t gap, double position)
{
  const size_t last = j->slices->count - 2;
  const double away = position - (double)gap - 0.5;
  if ((gap == 0 && away < 0) || (gap == last && away > 0))
    return fabs(away) < 1 ? 1 : 0;
  const double c = cos(PI / 2 * fmin(fabs(away), 1));
  return c * c;
}

/* The distances of all slices around a layer, joined by cubics. */
static void carry(const zs_joiner *j, uint32_t layer, double *carried)
{
  const zs_raster *r = j->raster;
  const size_t count = (size_t)r->count[0] * r->count[1];
  zs_raster_weights w;
  const int first = zs_raster_layers(&j->carrier, (double)r->heights[layer], &w);
  for (size_t i = 0; i < count; i++)
    carried[i] = 0;
  for (int k = 0; k < 4; k++)
    for (size_t i = 0; w.value[k] != 0 && i < count; i++)
      carried[i] += w.value[k] * (double)j->fields[(size_t)(first + k)][i];
}

/* Room for one layer. */
typedef struct room {
  double *carried, *sums, *weights;
  bool *wanted;
} room;

static bool make_room(room *r, size_t count)
{
  *r = (room){malloc(count * sizeof *r->carried), malloc(count * sizeof *r->sums),
              malloc(count * sizeof *r->weights), malloc(count * sizeof *r->wanted)};
  return r->carried && r->sums && r->weights && r->wanted;
}

static void free_room(room *r)
{
  free(r->carried);
  free(r->sums);
  free(r->weights);
  free(r->wanted);
}

/* The mean of the nodes around a place, where they tell enough of it. */
static bool find_between(const room *m, size_t width, size_t height, size_t place, double *f)
{
  const size_t x = place % width, y = place / width, right = x + x % 2, below = y + y % 2;
  if (right >= width || below >= height)
    return false;
  const size_t nodes[] = {y / 2 * 2 * width + x / 2 * 2, y / 2 * 2 * width + right,
                          below * width + x / 2 * 2, below * width + right};
  double least = INFINITY, greatest = -INFINITY, sum = 0;
  for (int k = 0; k < 4; k++) {
    if (m->weights[nodes[k]] == 0)
      return false;
    const double value = m->sums[nodes[k]] / m->weights[nodes[k]];
    least = fmin(least, value);
    greatest = fmax(greatest, value);
    sum += value;
  }
  *f = sum / 4;
  return least > NEAR || greatest < -NEAR;
}

/* Where a node is: on every other pixel of every other row. */
static bool is_node(size_t width, size_t place)
{
  return place % width % 2 == 0 && place / width % 2 == 0;
}

/* The sums of blocks, at a height that is theirs, within the band.  Away from the surface they are
 * found on nodes alone, and between these from them. */
static void find_sums(const zs_joiner *j, const zs_blocks *blocks, double height, double band,
                      const room *m)
{
  const zs_raster *r = j->raster;
  const zs_block_plane plane = {
    .z = height,
    .first = {(double)j->first[0], (double)j->first[1]},
    .size = {r->count[0], r->count[1]},
    .wanted = m->wanted, .sums = m->sums, .weights = m->weights};
  const size_t width = r->count[0], count = width * r->count[1];
  for (size_t i = 0; i < count; i++) {
    m->sums[i] = m->weights[i] = 0;
    m->wanted[i] = fabs(m->carried[i]) < band && is_node(width, i);
  }
  zs_blocks_add(blocks, &plane);
  for (size_t i = 0; i < count; i++) {
    double f;
    m->wanted[i] = fabs(m->carried[i]) < band && !is_node(width, i);
    if (m->wanted[i] && find_between(m, width, r->count[1], i, &f)) {
      m->wanted[i] = false;
      m->sums[i] = f;
      m->weights[i] = 1;
    }
  }
  zs_blocks_add(blocks, &plane);
}

/* Add what the sums of a gap give in a layer, by their weight. */
static bool add_layer(const zs_joiner *j, const zs_blocks *blocks, size_t gap, uint32_t layer)
{
  const zs_raster *r = j->raster;
  const size_t own = zs_joiner_gap(j, layer), count = (size_t)r->count[0] * r->count[1];
  const double position = position_of(j, layer, own), weight = weight_of(j, gap, position);
  const double half_way = sin(PI * (position - (double)own));
  const double distances = DISTANCES * half_way * half_way;
  const double band = fmin(BAND + BAND_OF_GAP * length_of(j, own), MOST_BAND);
  if (weight == 0)
    return true;
  room m;
  const bool memory = make_room(&m, count);
  if (memory) {
    carry(j, layer, m.carried);
    const int scales = scales_of(j, gap);
    const double height =
      height_in(j, gap, j->slices->slices[0].height + (double)r->heights[layer]);
    for (int k = 0; k < scales; k++) {
      find_sums(j, &blocks[k], SCALES[k] * height, band, &m);
      for (size_t i = 0; i < count; i++) {
        double f = m.carried[i];
        if (m.weights[i] > 0) {
          const double beyond = zs_smooth_step((fabs(f) / band - PURE) / (1 - PURE));
          f = beyond * f + (1 - beyond) * m.sums[i] / m.weights[i];
        }
        f = scales > 1 ? BOUND * tanh(f / BOUND) : (1 - distances) * f + distances * m.carried[i];
        *zs_raster_sample(r, i % r->count[0], i / r->count[0], layer) +=
          (float)(weight * f / scales);
      }
    }
  }
  free_room(&m);
  return memory;
}

static size_t most_of(double length)
{
  return (size_t)fmin(fmax(MOST_OF_GAP * length, LEAST_MOST), MOST_MOST);
}

/* The blocks of a gap at all scales. */
static bool make_blocks(const zs_joiner *j, size_t gap, zs_blocks *blocks)
{
  const double length = length_of(j, gap);
  const zs_slices *s = j->slices;
  const zs_block_rules rules = {
    .most = most_of(length),
    .overlap = fmin(fmax(OVERLAP, OVERLAP_OF_GAP * length), MOST_OVERLAP),
    .smoothing = s->crossings ? STAIRS * (double)s->stairs / (double)s->crossings : 0,
    .threads = j->threads};
  list l = {0};
  bool memory = gather(&l, j, gap);
  for (int k = 0; memory && k < scales_of(j, gap); k++) {
    for (size_t i = 0; i < l.count; i++)
      l.items[i].at[2] *= SCALES[k] / (k ? SCALES[k - 1] : 1);
    memory = zs_blocks_make(&blocks[k], l.items, l.count, &rules);
  }
  free(l.items);
  return memory;
}

static bool add_gap(const zs_joiner *j, size_t gap)
{
  zs_blocks blocks[SCALE_COUNT] = {{0}};
  bool memory = make_blocks(j, gap, blocks);
  const size_t last = j->slices->count - 1;
  const uint32_t from = j->level[gap > 0 ? gap - 1 : 0];
  const uint32_t to = j->level[gap + 2 < last ? gap + 2 : last];
  if (memory) {
#pragma omp parallel for schedule(dynamic, 1) num_threads(j->threads) reduction(&& : memory)
    for (uint32_t layer = from; layer <= to; layer++)
      memory = memory && add_layer(j, blocks, gap, layer);
  }
  for (int k = 0; k < SCALE_COUNT; k++)
    zs_blocks_clear(&blocks[k]);
  return memory;
}

zs_join_result zs_join_variational(const zs_joiner *j)
{
  const zs_control *control = j->control;
  const size_t gaps = j->slices->count - 1;
  for (size_t gap = 0; gap < gaps; gap++) {
    if (control && control->progress &&
        !control->progress(control->context, "joining slices", (double)gap / (double)gaps))
      return ZS_JOIN_CANCELLED;
    if (!add_gap(j, gap))
      return ZS_JOIN_MEMORY;
  }
  return ZS_JOIN_DONE;
}
