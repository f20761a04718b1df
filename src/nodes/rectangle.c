#include "nodes/common.h"
#include "nodes/outlined.h"

#include <math.h>

struct rectangle {
  double size[2], min[2], max[2];
  double round;
};

static const zs_attribute attributes[] = {
  {.name = "size",
   .type = ZS_VECTOR2,
   .offset = offsetof(struct rectangle, size),
   .initial = "2 2",
   .unit = "length",
   .range = ZS_RANGE_POSITIVE,
   .doc = "extent along x and y of a rectangle centred on the origin"},
  {.name = "min",
   .type = ZS_VECTOR2,
   .offset = offsetof(struct rectangle, min),
   .initial = "",
   .unit = "length",
   .doc = "lower left corner, with `max`, instead of `size`"},
  {.name = "max",
   .type = ZS_VECTOR2,
   .offset = offsetof(struct rectangle, max),
   .initial = "",
   .unit = "length",
   .doc = "upper right corner"},
  ZS_LENGTH(struct rectangle, round, "round", "0", ZS_RANGE_NOT_NEGATIVE,
            "radius of the rounded corners, inside the rectangle"),
};

/* The size of the rectangle, and its centre. */
static void resolve(const zs_node *node, double size[2], double centre[3])
{
  const struct rectangle *p = node->parameters;
  bool corners = zs_node_has(node, "min");
  for (int i = 0; i < 2; i++) {
    size[i] = corners ? p->max[i] - p->min[i] : p->size[i];
    centre[i] = corners ? p->min[i] + size[i] / 2 : 0;
  }
  centre[2] = 0;
}

static bool check(const zs_node *node, zs_diag *diag)
{
  const struct rectangle *p = node->parameters;
  if (zs_node_has(node, "min") || zs_node_has(node, "max")) {
    if (!zs_node_check_span(node, diag, "size", "min", "max") ||
        !zs_node_check_order(node, diag, "min", p->min, "max", p->max, 2))
      return false;
  }
  double size[2], centre[3];
  resolve(node, size, centre);
  for (int i = 0; i < 2; i++)
    if (2 * p->round > size[i])
      return zs_node_fail(node, diag, "round", "%g is too round; expected at most %g, half the "
                          "shorter side", p->round, size[i] / 2);
  return true;
}

/* The formula, with the corners turned into a size and a centre. */
static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  struct rectangle centred = *(const struct rectangle *)node->parameters;
  double centre[3];
  resolve(node, centred.size, centre);
  zs_node copy = *node;
  copy.parameters = &centred;
  zs_coordinates moved = zs_coordinates_moved(at, centre);
  return zs_formula_emit(compiler, &copy, node->kind->formula, &moved, 0, 0);
}

static zs_value fused(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct rectangle *p = node->parameters;
  double size[2], centre[3];
  resolve(node, size, centre);
  const double parameter[4] = {size[0] / 2 - p->round, size[1] / 2 - p->round, INFINITY, p->round};
  zs_coordinates moved = zs_coordinates_moved(at, centre);
  return zs_emit_primitive(compiler, ZS_PRIMITIVE_CUBOID, parameter, &moved);
}

static bool outline(const zs_node *node, zs_fill *fill, zs_diag *diag)
{
  double size[2], centre[3];
  if (((const struct rectangle *)node->parameters)->round > 0)
    return true;
  resolve(node, size, centre);
  const double x = size[0] / 2, y = size[1] / 2, cx = centre[0], cy = centre[1];
  const double corners[8] = {cx - x, cy - y, cx + x, cy - y, cx + x, cy + y, cx - x, cy + y};
  return zs_outlined_ring(corners, 4, node, NULL, fill, diag);
}

const zs_kind zs_kind_rectangle = {
  .name = "rectangle",
  .family = ZS_FAMILY_SHAPE,
  .summary = "an axis-parallel rectangle, optionally rounded",
  .doc = "Centred on the origin with `size`, or between the corners `min` and `max` (the formula "
         "is about the rectangle's centre, and `round_` the attribute of that name).",
  .trait = "exact distance",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct rectangle),
  .children = ZS_CHILDREN_NONE,
  .formula = "let u = abs(x) - (size.x / 2 - round_); "
             "let v = abs(y) - (size.y / 2 - round_); "
             "round_ - (min(max(u, v), 0) + hypot(max(u, 0), max(v, 0)))",
  .check = check,
  .emit = emit,
  .fused = fused,
  .outline = outline,
};
