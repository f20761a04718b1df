#include "stack/join.h"

#include "field/program.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Pixels around all slices that are sampled too, and layers: about a pixel apart, no more
 * than so many to a gap, nor in all than take so many bytes. */
enum { AROUND = 12, MOST_LAYERS = 64 };
static const double MOST_BYTES = 4e8;

size_t zs_joiner_gap(const zs_joiner *j, uint32_t layer)
{
  size_t gap = 0;
  while (gap + 2 < j->slices->count && layer >= j->level[gap + 1])
    gap++;
  return gap;
}

/* The box of all that is inside, and some more. */
static void find_box(zs_joiner *j, uint32_t count[3])
{
  const zs_slices *s = j->slices;
  size_t lo[2] = {s->width, s->height}, hi[2] = {0, 0};
  for (size_t i = 0; i < s->count; i++)
    for (size_t p = 0; s->slices[i].distance && p < s->width * s->height; p++) {
      if (s->slices[i].distance[p] < 0)
        continue;
      const size_t at[2] = {p % s->width, p / s->width};
      for (int k = 0; k < 2; k++) {
        lo[k] = at[k] < lo[k] ? at[k] : lo[k];
        hi[k] = at[k] > hi[k] ? at[k] : hi[k];
      }
    }
  for (int k = 0; k < 2; k++) {
    const size_t end = (k ? s->height : s->width) - 1;
    j->first[k] = lo[k] > AROUND ? lo[k] - AROUND : 0;
    count[k] = (uint32_t)((hi[k] + AROUND < end ? hi[k] + AROUND : end) - j->first[k] + 1);
  }
}

static double layers_of(double length, double step)
{
  const double layers = ceil(length / step - 1e-9);
  return layers < 1 ? 1 : layers > MOST_LAYERS ? MOST_LAYERS : layers;
}

/* How far layers are apart at the most. */
static double choose_step(const zs_slices *s, const uint32_t count[3])
{
  for (double step = 1;; step *= 2) {
    double layers = 1;
    for (size_t i = 0; i + 1 < s->count; i++)
      layers += layers_of(s->slices[i + 1].height - s->slices[i].height, step);
    const double bytes = layers * count[0] * count[1] * sizeof(float);
    if (bytes <= MOST_BYTES || layers <= (double)s->count)
      return step;
  }
}

/* The layers and the raster that they make. */
static bool lay_out(zs_joiner *j, uint32_t count[3], double step)
{
  const zs_slices *s = j->slices;
  float *heights = malloc((s->count * MOST_LAYERS + 1) * sizeof *heights);
  j->level = malloc(s->count * sizeof *j->level);
  j->carrier.heights = malloc(s->count * sizeof *j->carrier.heights);
  if (!heights || !j->level || !j->carrier.heights) {
    free(heights);
    return false;
  }
  uint32_t layers = 0;
  for (size_t i = 0; i < s->count; i++) {
    const double from = s->slices[i].height - s->slices[0].height;
    j->carrier.heights[i] = (float)from;
    j->level[i] = layers;
    heights[layers++] = (float)from;
    if (i + 1 == s->count)
      break;
    const double length = s->slices[i + 1].height - s->slices[i].height;
    const double parts = layers_of(length, step);
    for (double k = 1; k < parts; k++)
      heights[layers++] = (float)(from + length * k / parts);
  }
  count[2] = layers;
  j->carrier.count[2] = (uint32_t)s->count;
  j->raster = zs_raster_new(count, heights);
  free(heights);
  return j->raster != NULL;
}

/* What an empty slice is everywhere. */
static float emptiness(const zs_slices *s, size_t i)
{
  const double below = i > 0 ? s->slices[i].height - s->slices[i - 1].height : 0;
  const double above = i + 1 < s->count ? s->slices[i + 1].height - s->slices[i].height : 0;
  return -(float)fmax(below, above);
}

static bool crop_fields(zs_joiner *j, const uint32_t count[3])
{
  const zs_slices *s = j->slices;
  const size_t width = count[0], height = count[1];
  j->fields = calloc(s->count, sizeof *j->fields);
  for (size_t i = 0; j->fields && i < s->count; i++) {
    float *field = j->fields[i] = malloc(width * height * sizeof *field);
    const float *distance = s->slices[i].distance;
    if (!field)
      return false;
    for (size_t y = 0; distance && y < height; y++)
      memcpy(field + y * width, distance + (y + j->first[1]) * s->width + j->first[0],
             width * sizeof *field);
    for (size_t k = 0; !distance && k < width * height; k++)
      field[k] = emptiness(s, i);
  }
  return j->fields;
}

/* Write one value, or the slices' distances on their layers. */
static void fill(const zs_joiner *j, bool distances)
{
  const zs_raster *r = j->raster;
  for (size_t z = 0; z < r->count[2]; z++)
    for (size_t y = 0; y < r->count[1]; y++)
      for (size_t x = 0; x < r->count[0]; x++)
        *zs_raster_sample(r, x, y, z) = distances ? j->fields[z][y * r->count[0] + x] : 0;
}

/* Whether the slices' distances alone are joined: nothing has to be sampled between them. */
static bool is_plain(zs_join_method method)
{
  return method == ZS_JOIN_LINEAR || method == ZS_JOIN_CUBIC;
}

/* All layers, but for what is to be mended, and what moves between them. */
static zs_join_result write_layers(zs_joiner *j, zs_join_method method, zs_joined *joined)
{
  const bool two = j->slices->count == 2;
  const bool extended = method == ZS_JOIN_EXTENDED || (method == ZS_JOIN_AUTO && two);
  j->raster->linear = method == ZS_JOIN_LINEAR;
  fill(j, is_plain(method));
  if (is_plain(method))
    return ZS_JOIN_DONE;
  if (method != ZS_JOIN_VARIATIONAL &&
      !(zs_join_find_motions(j, two) && zs_join_find_ways(j, extended, joined)))
    return ZS_JOIN_MEMORY;
  const zs_join_result result = extended ? ZS_JOIN_DONE : zs_join_variational(j);
  if (result == ZS_JOIN_DONE && method != ZS_JOIN_VARIATIONAL)
    zs_join_carry(j, extended);
  return result;
}

static void free_joiner(zs_joiner *j)
{
  for (size_t i = 0; j->fields && i < j->slices->count; i++)
    free(j->fields[i]);
  for (size_t i = 0; j->motions && i + 1 < j->slices->count; i++)
    zs_motion_clear(&j->motions[i]);
  free(j->fields);
  free(j->motions);
  free(j->level);
  free(j->carrier.heights);
}

zs_join_result zs_slices_join(zs_joined *joined, const zs_slices *slices, zs_join_method method,
                              const zs_control *control)
{
  zs_joiner j = {.slices = slices, .control = control, .threads = zs_control_threads(control)};
  uint32_t count[3];
  zs_join_result result = ZS_JOIN_MEMORY;
  *joined = (zs_joined){.raster = NULL};
  find_box(&j, count);
  if (crop_fields(&j, count) &&
      lay_out(&j, count, is_plain(method) ? INFINITY : choose_step(slices, count)))
    result = write_layers(&j, method, joined);
  if (result == ZS_JOIN_DONE && !is_plain(method)) {
    zs_join_mend_levels(&j);
    result = zs_join_drop_islands(&j) ? ZS_JOIN_DONE : ZS_JOIN_MEMORY;
  }
  if (result == ZS_JOIN_DONE && !zs_raster_finish(j.raster))
    result = ZS_JOIN_MEMORY;
  free_joiner(&j);
  joined->raster = j.raster;
  memcpy(joined->first, j.first, sizeof joined->first);
  if (result != ZS_JOIN_DONE)
    zs_joined_clear(joined);
  return result;
}

void zs_joined_clear(zs_joined *joined)
{
  zs_raster_free(joined->raster);
  free(joined->ways);
  *joined = (zs_joined){.raster = NULL};
}
