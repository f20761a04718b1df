#include "output/trace_leaf.h"

#include <math.h>
#include <string.h>

enum { MOST_LEAVES = 1024 /* in depth */ };

/* ---- Tiles ------------------------------------------------------------------------- */

/* Where a ray is in its place, along x for its row, or along y for its column. */
static double place_in(const zs_tile *tile, uint32_t other)
{
  return tile->rays_per_pixel == 1 ? 0.5 : other & 2 ? 0.75 : 0.25;
}

void zs_tile_ray(const zs_tile *tile, const zs_camera *camera, uint32_t i, uint32_t j, double *u,
                 double *v)
{
  const double step = camera->pixel / tile->rays_per_pixel;
  *u = camera->left + (tile->x + i + place_in(tile, j)) * step;
  *v = camera->top - (tile->y + j + place_in(tile, i)) * step;
}

void zs_tile_begin(zs_tile *tile, const zs_camera *camera, uint32_t x, uint32_t y,
                   uint32_t rays_per_pixel, const uint8_t *wanted)
{
  tile->x = x;
  tile->y = y;
  tile->rays_per_pixel = rays_per_pixel;
  memset(tile->hits, 0, sizeof tile->hits);
  for (uint32_t j = 0; j < ZS_TILE; j++)
    for (uint32_t i = 0; i < ZS_TILE; i++) {
      const uint32_t px = (x + i) / rays_per_pixel, py = (y + j) / rays_per_pixel;
      uint32_t column, r;
      double u, v;
      zs_tile_place(i, j, &column, &r);
      tile->spans[column][r] = (zs_ray_span){.near = INFINITY, .far = -INFINITY};
      if (!zs_tile_has_ray(tile, i, j) || px >= camera->width || py >= camera->height ||
          (wanted && !wanted[(size_t)py * camera->width + px]))
        continue;
      zs_tile_ray(tile, camera, i, j, &u, &v);
      tile->spans[column][r] = zs_camera_span(camera, u, v);
    }
  for (unsigned column = 0; column < ZS_COLUMNS * ZS_COLUMNS; column++)
    zs_tile_update(tile, column);
}

/* ---- The tree of boxes ------------------------------------------------------------------ */

/* Whether any ray goes on inside a part. */
static bool has_rays(const zs_tracer *tracer, const zs_tile *tile, const zs_trace_part *p)
{
  const float a = zs_leaf_depth(tracer, p->lo[2]), b = zs_leaf_depth(tracer, p->hi[2]);
  for (uint32_t y = p->lo[1]; y < p->hi[1]; y++)
    for (uint32_t x = p->lo[0]; x < p->hi[0]; x++) {
      const unsigned column = y * ZS_COLUMNS + x;
      if (tile->left[column] && tile->near[column] <= b && tile->far[column] >= a)
        return true;
    }
  return false;
}

/* Split a part into as many as there are to be along each side and list those that rays reach,
 * the nearest first.  Returns their number, or ZS_LANES + 1 when they are more than fit. */
static unsigned split(const zs_tracer *tracer, const zs_tile *tile, const zs_trace_part *whole,
                      const uint32_t wanted[3], zs_trace_part parts[ZS_LANES])
{
  uint32_t size[3], at[3];
  unsigned count = 0;
  for (int k = 0; k < 3; k++)
    size[k] = (whole->hi[k] - whole->lo[k] - 1) / wanted[k] + 1;
  for (at[2] = whole->lo[2]; at[2] < whole->hi[2]; at[2] += size[2])
    for (at[1] = whole->lo[1]; at[1] < whole->hi[1]; at[1] += size[1])
      for (at[0] = whole->lo[0]; at[0] < whole->hi[0]; at[0] += size[0]) {
        zs_trace_part p = {.sign = whole->sign, .gradient = whole->gradient};
        for (int k = 0; k < 3; k++) {
          p.lo[k] = at[k];
          p.hi[k] = whole->hi[k] - at[k] < size[k] ? whole->hi[k] : at[k] + size[k];
        }
        if (!has_rays(tracer, tile, &p))
          continue;
        if (count == ZS_LANES)
          return ZS_LANES + 1;
        parts[count++] = p;
      }
  return count;
}

/* Double the number of parts along one side: in depth while they are long.  False when they are
 * single leaves. */
static bool split_finer(const zs_trace_part *whole, uint32_t wanted[3])
{
  uint32_t size[3];
  for (int k = 0; k < 3; k++)
    size[k] = (whole->hi[k] - whole->lo[k] - 1) / wanted[k] + 1;
  const uint32_t across = size[0] > size[1] ? size[0] : size[1];
  const int side = 2 * size[2] > across ? 2 : size[0] > size[1] ? 0 : 1;
  wanted[side] *= 2;
  return size[side] > 1;
}

/* Split a part as finely as bounds of all the parts that rays reach can be taken at once. */
static unsigned split_for_lanes(const zs_tracer *tracer, const zs_tile *tile,
                                const zs_trace_part *whole, zs_trace_part parts[ZS_LANES])
{
  uint32_t wanted[3] = {1, 1, 1};
  unsigned count = 0;
  zs_trace_part finer[ZS_LANES];
  while (split_finer(whole, wanted)) {
    const unsigned more = split(tracer, tile, whole, wanted, finer);
    if (more > ZS_LANES)
      break;
    count = more;
    memcpy(parts, finer, count * sizeof *parts);
  }
  return count;
}

/* Boxes of parts in local coordinates; idle lanes repeat the last. */
static void part_boxes(const zs_tracer *tracer, const zs_tile *tile, const zs_trace_part *parts,
                       unsigned count, zs_boxes *boxes)
{
  const zs_camera *camera = tracer->camera;
  const double step = camera->pixel / tile->rays_per_pixel;
  const double beyond = ZS_LEAF_BEYOND * (camera->far - camera->near) / tracer->leaves;
  for (unsigned l = 0; l < ZS_LANES; l++) {
    const zs_trace_part *p = &parts[l < count ? l : count - 1];
    const double lo[3] = {camera->left + (tile->x + p->lo[0] * ZS_COLUMN) * step,
                          camera->top - (tile->y + p->hi[1] * ZS_COLUMN) * step,
                          zs_leaf_depth(tracer, p->lo[2]) - beyond};
    const double hi[3] = {camera->left + (tile->x + p->hi[0] * ZS_COLUMN) * step,
                          camera->top - (tile->y + p->lo[1] * ZS_COLUMN) * step,
                          zs_leaf_depth(tracer, p->hi[2]) + beyond};
    zs_boxes_set(boxes, l, lo, hi, (double[3]){0});
  }
}

/* Give the parts in `lanes` shorter programs for gradients.  Where those for
 * signs are no shorter, one program, and one set of bounds, will do. */
static bool shorten_gradients(zs_tracer *tracer, const zs_program *gradient, zs_trace_part *parts,
                              unsigned count, unsigned lanes)
{
  const zs_program *programs[ZS_LANES];
  bool shorter = false;
  zs_program_restrict_lanes(tracer->eval, gradient, lanes, ZS_REQUEST_GRADIENT,
                            &tracer->arena, programs);
  for (unsigned l = 0; l < count; l++) {
    if (!(lanes >> l & 1))
      continue;
    parts[l].gradient = programs[l];
    if (programs[l]->count > parts[l].sign->count)
      shorter = true;
    else
      parts[l].sign = programs[l];
  }
  return shorter;
}

/* The programs for signs, after bounds of the present one. */
static void shorten_signs(zs_tracer *tracer, const zs_program *sign, zs_trace_part *parts,
                          unsigned count, unsigned lanes)
{
  const zs_program *programs[ZS_LANES];
  zs_program_restrict_lanes(tracer->eval, sign, lanes, ZS_REQUEST_SIGN, &tracer->arena,
                            programs);
  for (unsigned l = 0; l < count; l++)
    if (lanes >> l & 1)
      parts[l].sign = programs[l];
}

/* Give the parts in `lanes` shorter programs.  The bounds of their program for
 * signs have just been taken.  Those for gradients stay as they are for the
 * last columns, whose gradients are few. */
static void shorten(zs_tracer *tracer, const zs_trace_part *whole, zs_trace_part *parts,
                    unsigned count, unsigned lanes, const zs_boxes *boxes)
{
  const bool wide = whole->hi[0] - whole->lo[0] > 2 || whole->hi[1] - whole->lo[1] > 2;
  const bool same = whole->sign == whole->gradient;
  if (!same || tracer->signs)
    shorten_signs(tracer, whole->sign, parts, count, lanes);
  if (!wide && !same)
    return;
  zs_bounds f;
  if (!same)
    zs_program_bounds(tracer->eval, whole->gradient, &tracer->camera->frame, boxes, &f);
  const bool shorter = shorten_gradients(tracer, whole->gradient, parts, count, lanes);
  /* What does not help the whole tile is not tried on its parts. */
  if (same && whole->hi[2] - whole->lo[2] == tracer->leaves)
    tracer->signs = shorter;
}

/* Leave out parts that are proven empty or that no ray reaches; the others get
 * their programs and move to the front.  Returns how many are left. */
static unsigned prune(zs_tracer *tracer, const zs_tile *tile, const zs_trace_part *whole,
                      zs_trace_part *parts, unsigned count)
{
  zs_boxes boxes;
  zs_bounds f;
  part_boxes(tracer, tile, parts, count, &boxes);
  zs_program_bounds(tracer->eval, whole->sign, &tracer->camera->frame, &boxes, &f);
  unsigned lanes = 0;
  for (unsigned l = 0; l < count; l++)
    if (!(f.hi[l] < 0))
      lanes |= 1u << l;
  shorten(tracer, whole, parts, count, lanes, &boxes);
  unsigned left = 0;
  for (unsigned l = 0; l < count; l++)
    if (lanes >> l & 1)
      parts[left++] = parts[l];
  return left;
}

static void trace_part(zs_tracer *tracer, zs_tile *tile, const zs_trace_part *whole)
{
  if (!has_rays(tracer, tile, whole))
    return;
  if (whole->hi[0] - whole->lo[0] == 1 && whole->hi[1] - whole->lo[1] == 1 &&
      whole->hi[2] - whole->lo[2] == 1) {
    zs_trace_leaf(tracer, tile, whole);
    return;
  }
  zs_trace_part parts[ZS_LANES];
  zs_arena_mark mark = zs_arena_mark_here(&tracer->arena);
  unsigned count = split_for_lanes(tracer, tile, whole, parts);
  if (count && !tracer->brute)
    count = prune(tracer, tile, whole, parts, count);
  for (unsigned l = 0; l < count; l++)
    trace_part(tracer, tile, &parts[l]);
  zs_arena_rewind(&tracer->arena, mark);
}

void zs_tracer_init(zs_tracer *tracer, const zs_camera *camera, zs_eval *eval, bool brute)
{
  *tracer = (zs_tracer){.camera = camera, .eval = eval, .brute = brute, .leaves = 1};
  const double middle = (camera->near + camera->far) / 2;
  const double leaves =
    ceil((camera->far - camera->near) / (ZS_LEAF_DEPTH * zs_camera_footprint(camera, middle)));
  if (leaves > 1)
    tracer->leaves = leaves < MOST_LEAVES ? (uint32_t)leaves : MOST_LEAVES;
}

void zs_tracer_clear(zs_tracer *tracer)
{
  zs_arena_free(&tracer->arena);
}

void zs_tracer_run(zs_tracer *tracer, zs_tile *tile)
{
  if (!(tracer->camera->near < tracer->camera->far))
    return;
  const zs_program *program = zs_field_program(zs_eval_field(tracer->eval));
  const zs_trace_part whole = {.hi = {ZS_COLUMNS, ZS_COLUMNS, tracer->leaves},
                      .sign = program, .gradient = program};
  tracer->signs = true;
  trace_part(tracer, tile, &whole);
}
