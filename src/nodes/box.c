#include "nodes/common.h"

struct box {
  double size[3], min[3], max[3];
  double round;
};

static const zs_attribute attributes[] = {
  {.name = "size",
   .type = ZS_SCALE,
   .offset = offsetof(struct box, size),
   .initial = "2 2 2",
   .unit = "length",
   .range = ZS_RANGE_POSITIVE,
   .doc = "extent along x, y and z of a box centred on the origin; one number for a cube"},
  ZS_POINT(struct box, min, "min", "", "lower corner, with `max`, instead of `size`"),
  ZS_POINT(struct box, max, "max", "", "upper corner"),
  ZS_LENGTH(struct box, round, "round", "0", ZS_RANGE_NOT_NEGATIVE,
            "radius of the rounded edges and corners, inside the box"),
};

/* The size of the box, and its centre. */
static void resolve(const zs_node *node, double size[3], double centre[3])
{
  const struct box *p = node->parameters;
  bool corners = zs_node_has(node, "min");
  for (int i = 0; i < 3; i++) {
    size[i] = corners ? p->max[i] - p->min[i] : p->size[i];
    centre[i] = corners ? p->min[i] + size[i] / 2 : 0;
  }
}

static bool check(const zs_node *node, zs_diag *diag)
{
  const struct box *p = node->parameters;
  if (zs_node_has(node, "min") || zs_node_has(node, "max")) {
    if (!zs_node_check_span(node, diag, "size", "min", "max") ||
        !zs_node_check_order(node, diag, "min", p->min, "max", p->max, 3))
      return false;
  }
  double size[3], centre[3];
  resolve(node, size, centre);
  for (int i = 0; i < 3; i++)
    if (2 * p->round > size[i])
      return zs_node_fail(node, diag, "round", "%g is too round; expected at most %g, half the "
                          "shortest side", p->round, size[i] / 2);
  return true;
}

/* The formula, with the corners turned into a size and a centre. */
static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  struct box centred = *(const struct box *)node->parameters;
  double centre[3];
  resolve(node, centred.size, centre);
  zs_node copy = *node;
  copy.parameters = &centred;
  zs_coordinates moved = zs_coordinates_moved(at, centre);
  return zs_formula_emit(compiler, &copy, node->kind->formula, &moved, 0, 0);
}

static zs_value fused(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct box *p = node->parameters;
  double size[3], centre[3], parameter[4];
  resolve(node, size, centre);
  for (int i = 0; i < 3; i++)
    parameter[i] = size[i] / 2 - p->round;
  parameter[3] = p->round;
  zs_coordinates moved = zs_coordinates_moved(at, centre);
  return zs_emit_primitive(compiler, ZS_PRIMITIVE_CUBOID, parameter, &moved);
}

const zs_kind zs_kind_box = {
  .name = "box",
  .family = ZS_FAMILY_PRIMITIVE,
  .summary = "an axis-parallel box, optionally rounded",
  .doc = "Centred on the origin with `size`, or between the corners `min` and `max` (the formula "
         "is about the box's centre, and `round_` the attribute of that name).",
  .trait = "exact distance",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct box),
  .children = ZS_CHILDREN_NONE,
  .formula = "let u = abs(x) - (size.x / 2 - round_); "
             "let v = abs(y) - (size.y / 2 - round_); "
             "let w = abs(z) - (size.z / 2 - round_); "
             "round_ - (min(max(u, max(v, w)), 0) + "
             "hypot(hypot(max(u, 0), max(v, 0)), max(w, 0)))",
  .check = check,
  .emit = emit,
  .fused = fused,
};
