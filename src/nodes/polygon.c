/* Shapes with straight edges, by the exact distance to them. */
#include "nodes/common.h"

#include "nodes/outlined.h"
#include "samples/polygon.h"

#include <math.h>

/* Farther apart, the corners' distances would not fit single precision. */
static const double MOST_APART = 1e15;

struct polygon {
  zs_numbers points;
};

static const zs_attribute attributes[] = {
  {.name = "points",
   .type = ZS_NUMBERS,
   .offset = offsetof(struct polygon, points),
   .initial = NULL,
   .unit = "length",
   .doc = "x and y of every corner in order, either way round; the last is joined to the first"},
};

static bool check(const zs_node *node, zs_diag *diag)
{
  const zs_numbers *points = &((const struct polygon *)node->parameters)->points;
  const double *v = points->values;
  if (points->count % 2)
    return zs_node_fail(node, diag, "points", "there are %zu numbers; expected an even number, x "
                        "and y of every corner", points->count);
  /* Three corners that are not on one line: the farthest from the first, and
   * one off the line of these two. */
  const size_t count = points->count / 2;
  double dx = 0, dy = 0, off = 0;
  for (size_t i = 1; i < count; i++) {
    const double x = v[2 * i] - v[0], y = v[2 * i + 1] - v[1];
    if (hypot(x, y) > hypot(dx, dy)) {
      dx = x;
      dy = y;
    }
  }
  for (size_t i = 1; i < count; i++)
    off = fmax(off, fabs(dx * (v[2 * i + 1] - v[1]) - dy * (v[2 * i] - v[0])));
  if (!(off > 1e-14 * (dx * dx + dy * dy)))
    return zs_node_fail(node, diag, "points",
                        "the %zu corners enclose nothing; expected at least 3 that are not on one "
                        "line", count);
  if (!(hypot(dx, dy) < MOST_APART))
    return zs_node_fail(node, diag, "points", "corners lie %g apart; expected less than %g",
                        hypot(dx, dy), MOST_APART);
  return true;
}

/* The distance to a polygon that is centred on `centre`: single precision is
 * best spent there. */
static zs_value distance(zs_compiler *compiler, const zs_coordinates *at, const double *points,
                         size_t count, const double centre[3])
{
  const zs_polygon *polygon = zs_polygon_new(zs_compiler_arena(compiler), points, count);
  if (!polygon) {
    zs_fail_memory(zs_compiler_diag(compiler));
    return 0;
  }
  zs_coordinates about = zs_coordinates_moved(at, centre);
  return zs_emit_operation(compiler, &zs_polygon_operation, polygon,
                           zs_emit_coordinate(compiler, &about, 0),
                           zs_emit_coordinate(compiler, &about, 1), 0);
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const zs_numbers *points = &((const struct polygon *)node->parameters)->points;
  const double *v = points->values;
  const size_t count = points->count / 2;
  double centre[3] = {0, 0, 0};
  for (size_t k = 0; k < 2; k++) {
    double lo = v[k], hi = v[k];
    for (size_t i = 1; i < count; i++) {
      lo = fmin(lo, v[2 * i + k]);
      hi = fmax(hi, v[2 * i + k]);
    }
    centre[k] = lo + (hi - lo) / 2;
  }
  double *moved = ZS_ARENA_NEW(zs_compiler_arena(compiler), double, points->count);
  if (!moved) {
    zs_fail_memory(zs_compiler_diag(compiler));
    return 0;
  }
  for (size_t i = 0; i < points->count; i++)
    moved[i] = v[i] - centre[i % 2];
  return distance(compiler, at, moved, count, centre);
}

static bool outline(const zs_node *node, zs_fill *fill, zs_diag *diag)
{
  const zs_numbers *points = &((const struct polygon *)node->parameters)->points;
  return zs_outlined_ring(points->values, points->count / 2, node, "points", fill, diag);
}

const zs_kind zs_kind_polygon = {
  .name = "polygon",
  .family = ZS_FAMILY_SHAPE,
  .summary = "a polygon of any number of corners",
  .doc = "f is the distance to the nearest edge, positive inside. Where edges cross, a point is "
         "inside when a ray from it meets an odd number of them.",
  .trait = "exact distance",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct polygon),
  .children = ZS_CHILDREN_NONE,
  .check = check,
  .emit = emit,
  .outline = outline,
};

/* ---- regular-polygon ------------------------------------------------------- */

enum { MOST_SIDES = 1000 };

struct regular_polygon {
  int sides;
  double radius;
};

static const zs_attribute regular_attributes[] = {
  {.name = "sides",
   .type = ZS_INTEGER,
   .offset = offsetof(struct regular_polygon, sides),
   .initial = NULL,
   .unit = "1",
   .range = ZS_RANGE_BETWEEN,
   .minimum = 3,
   .maximum = MOST_SIDES,
   .doc = "number of sides"},
  ZS_LENGTH(struct regular_polygon, radius, "radius", "1", ZS_RANGE_POSITIVE,
            "distance of the corners from the origin"),
};

static void regular_corners(const struct regular_polygon *p, double corners[2 * MOST_SIDES])
{
  for (int i = 0; i < p->sides; i++) {
    const double angle = 2 * 3.14159265358979323846 * i / p->sides;
    corners[2 * i] = p->radius * cos(angle);
    corners[2 * i + 1] = p->radius * sin(angle);
  }
}

static zs_value regular_emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  static const double origin[3] = {0, 0, 0};
  const struct regular_polygon *p = node->parameters;
  double corners[2 * MOST_SIDES];
  regular_corners(p, corners);
  return distance(compiler, at, corners, (size_t)p->sides, origin);
}

static bool regular_outline(const zs_node *node, zs_fill *fill, zs_diag *diag)
{
  const struct regular_polygon *p = node->parameters;
  double corners[2 * MOST_SIDES];
  regular_corners(p, corners);
  return zs_outlined_ring(corners, (size_t)p->sides, node, NULL, fill, diag);
}

const zs_kind zs_kind_regular_polygon = {
  .name = "regular-polygon",
  .family = ZS_FAMILY_SHAPE,
  .summary = "a polygon of equal sides about the origin",
  .doc = "The first corner lies on the x axis.",
  .trait = "exact distance",
  .attributes = regular_attributes,
  .attribute_count = ZS_COUNT_OF(regular_attributes),
  .parameters_size = sizeof(struct regular_polygon),
  .children = ZS_CHILDREN_NONE,
  .emit = regular_emit,
  .outline = regular_outline,
};
