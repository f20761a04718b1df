/* The plane of a slice, and its samples. */
#include "output/slice.h"

#include "base/diagnostic.h"
#include "base/memory.h"
#include "field/program.h"
#include "files/image.h"
#include "output/grid.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BRICK = ZS_LATTICE_SIDE /* pixels along the sides of a brick */ };

void zs_slice_options_init(zs_slice_options *options)
{
  *options = (zs_slice_options){.width = 1024, .height = 1024, .axis = 2};
}

/* Cells of one axis: the pixels whose centres are in lo..hi, when `pixels` of
 * them are centred on it.  Returns the number of pixels before them. */
static uint32_t plane_side(zs_slice_plane *p, int side, double lo, double hi, uint32_t pixels)
{
  double middle = pixels * 0.5, half = (hi - lo) / (2 * p->pixel);
  double first = ceil(middle - half - 0.5 - 1e-9), last = floor(middle + half - 0.5 + 1e-9);
  first = fmin(fmax(first, 0), pixels - 1.0);
  last = fmin(fmax(last, first), pixels - 1.0);
  p->count[side] = (uint32_t)(last - first) + 1;
  p->lo[side] = (lo + hi) / 2 + (first - middle) * p->pixel;
  return (uint32_t)first;
}

zs_slice_plane zs_slice_plane_of(const double lo[3], const double hi[3],
                                 const zs_slice_options *options)
{
  static const int rights[3] = {1, 0, 0}, ups[3] = {2, 2, 1};
  zs_slice_plane p = {.axis = options->axis,
             .right = rights[options->axis],
             .up = ups[options->axis],
             .mirrored = options->axis == 1,
             .at = options->at,
             .width = options->width,
             .height = options->height};
  p.pixel = fmax((hi[p.right] - lo[p.right]) / p.width, (hi[p.up] - lo[p.up]) / p.height);
  uint32_t before = plane_side(&p, 0, lo[p.right], hi[p.right], p.width);
  p.column = p.mirrored ? p.width - before - p.count[0] : before;
  before = plane_side(&p, 1, lo[p.up], hi[p.up], p.height);
  p.row = p.height - before - p.count[1];
  return p;
}

/* Index of the leftmost pixel of those that show `count` cells from (i, j) on. */
static size_t pixel_index(const zs_slice_plane *p, uint32_t i, uint32_t j, uint32_t count)
{
  size_t column = p->column + (p->mirrored ? p->count[0] - i - count : i);
  size_t row = p->row + (p->count[1] - 1 - j);
  return row * p->width + column;
}

static uint32_t smaller(uint32_t a, uint32_t b)
{
  return a < b ? a : b;
}

static void uniform(void *visitor, const uint32_t lo[3], const uint32_t hi[3], bool inside)
{
  zs_slicer *s = visitor;
  const zs_slice_plane *p = &s->plane;
  const uint32_t i = lo[p->right] * BRICK, count = smaller(hi[p->right] * BRICK, p->count[0]) - i;
  const uint32_t end = smaller(hi[p->up] * BRICK, p->count[1]);
  for (uint32_t j = lo[p->up] * BRICK; j < end; j++)
    memset(s->pixels + pixel_index(p, i, j, count), inside ? 255 : 0, count);
}

/* A row of cells into its pixels; their values are `stride` apart. */
static void store_row(const zs_slicer *s, uint32_t i, uint32_t j, uint32_t count, const float *f,
                      size_t stride)
{
  const size_t at = pixel_index(&s->plane, i, j, count);
  float turned[BRICK];
  const float *row = f;
  if (s->plane.mirrored || stride != 1) {
    for (uint32_t k = 0; k < count; k++)
      turned[s->plane.mirrored ? count - 1 - k : k] = f[k * stride];
    row = turned;
  }
  if (s->values) {
    memcpy(s->values + at, row, count * sizeof *row);
    return;
  }
  uint8_t *pixels = s->pixels + at;
#pragma omp simd
  for (uint32_t k = 0; k < count; k++)
    pixels[k] = row[k] >= 0 ? 255 : 0;
}

static void brick(void *visitor, unsigned thread, const uint32_t index[3], zs_eval *eval,
                  const zs_program *program)
{
  static const size_t stride[3] = {1, ZS_LATTICE_SIDE, ZS_LATTICE_SIDE * ZS_LATTICE_SIDE};
  zs_slicer *s = visitor;
  const zs_slice_plane *p = &s->plane;
  const int axis[2] = {p->right, p->up};
  const float pixel = (float)p->pixel;
  zs_lattice lattice;
  double origin[3];
  uint32_t from[2];
  origin[p->axis] = p->at;
  lattice.count[p->axis] = 1;
  lattice.at[p->axis][0] = 0;
  for (int k = 0; k < 2; k++) {
    from[k] = index[axis[k]] * BRICK;
    origin[axis[k]] = p->lo[k] + p->pixel * from[k];
    lattice.count[axis[k]] = smaller(BRICK, p->count[k] - from[k]);
    for (unsigned i = 0; i < BRICK; i++)
      lattice.at[axis[k]][i] = ((float)i + 0.5f) * pixel;
  }
  lattice.frame = zs_frame_at(origin);
  float f[ZS_LATTICE_SIDE * ZS_LATTICE_SIDE * ZS_LATTICE_SIDE];
  s->evaluations[thread].count +=
    zs_program_lattice(eval, program, &lattice, ZS_REQUEST_VALUE, false, f);
  for (uint32_t j = 0; j < lattice.count[p->up]; j++)
    store_row(s, from[0], from[1] + j, lattice.count[p->right], f + j * stride[p->up],
              stride[p->right]);
}

bool zs_slicer_sample(zs_slicer *s, zs_field *field, const zs_control *control, zs_diag *diag)
{
  const zs_slice_plane *p = &s->plane;
  zs_walk walk = {.field = field,
                  .request = s->values ? ZS_REQUEST_VALUE : ZS_REQUEST_SIGN,
                  .control = control,
                  .stage = "slice",
                  .progress_to = 1,
                  .visitor = s,
                  .uniform = s->values ? NULL : uniform,
                  .brick = brick};
  walk.lo[p->axis] = p->at;
  walk.size[p->axis] = 0;
  walk.count[p->axis] = 1;
  walk.lo[p->right] = p->lo[0];
  walk.lo[p->up] = p->lo[1];
  walk.size[p->right] = walk.size[p->up] = p->pixel * BRICK;
  walk.count[p->right] = (p->count[0] - 1) / BRICK + 1;
  walk.count[p->up] = (p->count[1] - 1) / BRICK + 1;
  return zs_walk_run(&walk, diag);
}

bool zs_slice_options_check(const double lo[3], const double hi[3],
                            const zs_slice_options *options, zs_diag *diag)
{
  static const char axes[] = "xyz";
  if (options->axis < 0 || options->axis > 2)
    return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL, "the axis is %d; expected 0, 1 or 2",
                   options->axis);
  if (!zs_image_size_check(options->width, options->height, diag) ||
      !zs_quantity_check(options->quantity, diag) || !zs_box_check(lo, hi, diag))
    return false;
  const int axis = options->axis;
  if (!(options->at >= lo[axis] && options->at <= hi[axis]))
    return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL,
                   "the slice at %c = %g misses the box, which goes from %g to %g", axes[axis],
                   options->at, lo[axis], hi[axis]);
  return true;
}

bool zs_slicer_prepare(zs_slicer *s, zs_quantity quantity, unsigned threads)
{
  const size_t n = (size_t)s->plane.width * s->plane.height;
  const bool coloured = quantity == ZS_QUANTITY_VALUE;
  const bool filled = s->plane.count[0] == s->plane.width && s->plane.count[1] == s->plane.height;
  s->evaluations = zs_counters_new(threads);
  s->values = coloured ? zs_memory_new(n, sizeof *s->values) : NULL;
  s->pixels = coloured ? NULL : filled ? zs_memory_new(n, 1) : zs_memory_zeroed(n, 1);
  if (!s->evaluations || !(coloured ? (void *)s->values : (void *)s->pixels))
    return false;
  for (size_t i = 0; coloured && i < n; i++)
    s->values[i] = NAN;
  return true;
}

uint64_t zs_slicer_inside(const zs_slicer *s)
{
  const size_t n = (size_t)s->plane.width * s->plane.height;
  if (!s->values)
    return zs_count_odd(s->pixels, n);
  uint64_t count = 0;
  for (size_t i = 0; i < n; i++)
    count += s->values[i] >= 0;
  return count;
}

/* ---- Places ----------------------------------------------------------------------- */

void zs_slice_place(const zs_slice_plane *plane, const double picture[2], double space[3])
{
  const double across = (picture[0] - plane->column) * plane->pixel;
  const double down = (picture[1] - plane->row) * plane->pixel;
  const double width = plane->count[0] * plane->pixel, height = plane->count[1] * plane->pixel;
  space[plane->axis] = plane->at;
  space[plane->right] = plane->lo[0] + (plane->mirrored ? width - across : across);
  space[plane->up] = plane->lo[1] + height - down;
}

void zs_slice_picture(const zs_slice_plane *plane, const double space[3], double picture[2])
{
  const double across = (space[plane->right] - plane->lo[0]) / plane->pixel;
  const double up = (space[plane->up] - plane->lo[1]) / plane->pixel;
  picture[0] = plane->column + (plane->mirrored ? plane->count[0] - across : across);
  picture[1] = plane->row + plane->count[1] - up;
}
