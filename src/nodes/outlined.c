#include "nodes/outlined.h"

#include "nodes/common.h"
#include "samples/polygon.h"

#include <math.h>

/* Farther apart, distances would not fit single precision. */
static const double MOST_APART = 1e15;

/* Add the boundary of one shape to `all`. */
static zs_fill_result add_shape(const zs_outline *outline, size_t shape, double tolerance,
                                zs_fill *all, zs_diag *diag)
{
  zs_rings rings;
  zs_fill one = {0};
  if (!zs_outline_flatten(outline, shape, tolerance, &rings, diag))
    return ZS_FILL_MEMORY;
  bool memory = zs_fill_add_rings(&one, rings.points, rings.ends, rings.ring_count);
  zs_rings_clear(&rings);
  zs_fill_result result = ZS_FILL_MEMORY;
  if (memory)
    result = one.count ? zs_fill_resolve(&one, outline->shapes[shape].even_odd) : ZS_FILL_EMPTY;
  if (result == ZS_FILL_DONE && !zs_fill_add(all, &one))
    result = ZS_FILL_MEMORY;
  if (result == ZS_FILL_MEMORY)
    zs_fail_memory(diag);
  zs_fill_clear(&one);
  return result;
}

static bool fail(const zs_node *node, const char *attribute, const char *name,
                 zs_fill_result result, zs_diag *diag)
{
  if (result == ZS_FILL_MEMORY)
    return false; /* reported */
  return zs_node_fail(node, diag, attribute, "%s%.80s%s%s", name ? "'" : "", name ? name : "",
                      name ? "': " : "", result == ZS_FILL_EMPTY
                      ? "the outlines enclose nothing"
                      : "outlines lie too close to each other to tell what they enclose; expected "
                        "some that are equal, or apart by a millionth of the whole");
}

bool zs_outlined_fill(const zs_outline *outline, double tolerance, bool absolute,
                      const zs_node *node, const char *attribute, const char *name, zs_fill *fill,
                      zs_diag *diag)
{
  double lo[2], hi[2];
  *fill = (zs_fill){0};
  if (!zs_outline_box(outline, lo, hi))
    return fail(node, attribute, name, ZS_FILL_EMPTY, diag);
  const double size = fmax(hi[0] - lo[0], hi[1] - lo[1]);
  if (!(size < MOST_APART))
    return zs_node_fail(node, diag, attribute, "points lie %g apart; expected less than %g", size,
                        MOST_APART);
  zs_fill_result result = ZS_FILL_DONE;
  const double apart = absolute ? tolerance : tolerance * fmax(size, 1e-300);
  for (size_t i = 0; i < outline->shape_count; i++) {
    result = add_shape(outline, i, apart, fill, diag);
    if (result == ZS_FILL_MEMORY || result == ZS_FILL_UNCLEAR)
      break;
    result = ZS_FILL_DONE;
  }
  if (result == ZS_FILL_DONE && fill->count == 0)
    result = ZS_FILL_EMPTY;
  if (result == ZS_FILL_DONE && outline->shape_count > 1) {
    result = zs_fill_resolve(fill, false); /* the union of all */
    if (result == ZS_FILL_MEMORY)
      zs_fail_memory(diag);
  }
  if (result == ZS_FILL_DONE)
    return true;
  zs_fill_clear(fill);
  return fail(node, attribute, name, result, diag);
}

bool zs_outlined_ring(const double *points, size_t count, const zs_node *node,
                      const char *attribute, zs_fill *fill, zs_diag *diag)
{
  *fill = (zs_fill){0};
  zs_fill_result result = ZS_FILL_MEMORY;
  if (zs_fill_add_rings(fill, points, &count, 1))
    result = zs_fill_resolve(fill, true);
  if (result == ZS_FILL_DONE)
    return true;
  zs_fill_clear(fill);
  return result == ZS_FILL_MEMORY ? zs_fail_memory(diag)
                                    : fail(node, attribute, NULL, result, diag);
}

/* The edges about the middle of the box around them, where single precision is best spent. */
static void move_to_middle(zs_fill *fill, double centre[3])
{
  double lo[2] = {INFINITY, INFINITY}, hi[2] = {-INFINITY, -INFINITY};
  for (size_t i = 0; i < fill->count; i++)
    for (int k = 0; k < 2; k++) {
      lo[k] = fmin(lo[k], fill->edges[i][k]);
      hi[k] = fmax(hi[k], fill->edges[i][k]);
    }
  for (int k = 0; k < 2; k++)
    centre[k] = lo[k] + (hi[k] - lo[k]) / 2;
  centre[2] = 0;
  for (size_t i = 0; i < fill->count; i++)
    for (int k = 0; k < 4; k++)
      fill->edges[i][k] -= centre[k % 2];
}

zs_value zs_outlined_emit(zs_compiler *compiler, zs_fill *fill, const zs_coordinates *at)
{
  double centre[3];
  move_to_middle(fill, centre);
  const zs_polygon *polygon =
    zs_polygon_of_edges(zs_compiler_arena(compiler), fill->edges, fill->count);
  if (!polygon) {
    zs_fail_memory(zs_compiler_diag(compiler));
    return zs_emit_constant(compiler, 0);
  }
  const zs_coordinates about = zs_coordinates_moved(at, centre);
  return zs_emit_operation(compiler, &zs_polygon_operation, polygon,
                           zs_emit_coordinate(compiler, &about, 0),
                           zs_emit_coordinate(compiler, &about, 1), 0);
}
