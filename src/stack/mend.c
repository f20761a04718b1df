/* What joined slices are put right by: the signs of given pixels, and parts from nowhere. */
#include "stack/join.h"

#include "base/array.h"

#include <math.h>
#include <stdlib.h>

/* What a given pixel becomes, in pixels, when it has the wrong sign, unless it is nearer to
 * the outline; and how near to 0 it may be before it counts as that. */
static const float MENDED = 0.1F, DOUBTFUL = 1e-3F;

/* ---- Signs ------------------------------------------------------------------------------- */

/* Add to a pixel's column what the sample at slice i lacks, fading to nothing at the slices
 * beside it. */
static void spread(const zs_joiner *j, size_t i, size_t x, size_t y, float lack)
{
  const zs_raster *r = j->raster;
  const uint32_t at = j->level[i];
  const uint32_t from = i > 0 ? j->level[i - 1] : at;
  const uint32_t to = i + 1 < j->slices->count ? j->level[i + 1] : at;
  for (uint32_t z = from; z <= to; z++) {
    const double length = (double)(z < at ? at - from : to - at);
    const double away = z == at ? 0 : fabs((double)z - (double)at) / length;
    *zs_raster_sample(r, x, y, z) += (float)zs_smooth_step(1 - away) * lack;
  }
}

void zs_join_mend_levels(const zs_joiner *j)
{
  const zs_raster *r = j->raster;
  for (size_t i = 0; i < j->slices->count; i++)
    for (size_t y = 0; y < r->count[1]; y++)
      for (size_t x = 0; x < r->count[0]; x++) {
        const float f = *zs_raster_sample(r, x, y, j->level[i]);
        const float given = j->fields[i][y * r->count[0] + x];
        const bool inside = given >= 0;
        const float mended = fmaxf(fminf(fabsf(given), MENDED), 2 * DOUBTFUL);
        if (!(inside ? f >= DOUBTFUL : f <= -DOUBTFUL))
          spread(j, i, x, y, (inside ? mended : -mended) - f);
      }
}

/* ---- Islands ------------------------------------------------------------------------------ */

/* Pixels beside each other in a row that are inside. */
typedef struct run {
  uint32_t from, to; /* pixels from .. to - 1 */
  uint32_t parent;   /* another run of the same part, or itself */
  bool given;        /* of a root: whether a slice has some of the part */
} run;

typedef struct runs {
  run *items;
  size_t count, capacity;
  size_t *rows; /* where each row's runs begin; one more for the end */
} runs;

static uint32_t root_of(run *items, uint32_t i)
{
  while (items[i].parent != i)
    i = items[i].parent = items[items[i].parent].parent;
  return i;
}

static void unite(run *items, uint32_t a, uint32_t b)
{
  a = root_of(items, a);
  b = root_of(items, b);
  items[a].parent = b;
  items[b].given = items[b].given || items[a].given;
}

/* Unite the runs of two rows that touch, along edges or corners. */
static void unite_rows(runs *all, size_t row, size_t other)
{
  size_t k = all->rows[other];
  for (size_t i = all->rows[row]; i < all->rows[row + 1]; i++) {
    while (k < all->rows[other + 1] && all->items[k].to < all->items[i].from)
      k++;
    for (size_t l = k; l < all->rows[other + 1] && all->items[l].from <= all->items[i].to; l++)
      unite(all->items, (uint32_t)i, (uint32_t)l);
  }
}

static bool add_run(runs *all, uint32_t from, uint32_t to, bool given)
{
  run *items = all->count < UINT32_MAX
                 ? zs_array_grown(all->items, all->count + 1, &all->capacity, sizeof *items)
                 : NULL;
  if (!items)
    return false;
  all->items = items;
  items[all->count] = (run){from, to, (uint32_t)all->count, given};
  all->count++;
  return true;
}

static bool add_row(runs *all, const float *row, uint32_t count, bool given)
{
  for (uint32_t x = 0; x < count; x++) {
    const uint32_t from = x;
    while (x < count && row[x] >= 0)
      x++;
    if (x > from && !add_run(all, from, x, given))
      return false;
  }
  return true;
}

static bool is_level(const zs_joiner *j, size_t layer, size_t *next)
{
  if (*next == j->slices->count || j->level[*next] != layer)
    return false;
  ++*next;
  return true;
}

static bool find_runs(const zs_joiner *j, runs *all)
{
  const zs_raster *r = j->raster;
  const size_t ny = r->count[1];
  size_t next = 0;
  for (size_t z = 0; z < r->count[2]; z++) {
    const bool given = is_level(j, z, &next);
    for (size_t y = 0; y < ny; y++) {
      const size_t row = z * ny + y;
      all->rows[row] = all->count;
      if (!add_row(all, zs_raster_sample(r, 0, y, z), r->count[0], given))
        return false;
      all->rows[row + 1] = all->count;
      for (size_t k = 0; z > 0 && k < 3; k++) /* the rows below and beside that */
        if (y + k >= 1 && y + k - 1 < ny)
          unite_rows(all, row, row - ny + k - 1);
      if (y > 0)
        unite_rows(all, row, row - 1);
    }
  }
  return true;
}

bool zs_join_drop_islands(const zs_joiner *j)
{
  const zs_raster *r = j->raster;
  const size_t ny = r->count[1], rows = ny * r->count[2];
  runs all = {.rows = malloc((rows + 1) * sizeof *all.rows)};
  const bool memory = all.rows && find_runs(j, &all);
  for (size_t row = 0; memory && row < rows; row++)
    for (size_t i = all.rows[row]; i < all.rows[row + 1]; i++) {
      float *samples = zs_raster_sample(r, 0, row % ny, row / ny);
      if (all.items[root_of(all.items, (uint32_t)i)].given)
        continue;
      for (uint32_t x = all.items[i].from; x < all.items[i].to; x++)
        samples[x] = -fmaxf(samples[x], DOUBTFUL);
    }
  free(all.items);
  free(all.rows);
  return memory;
}
