#include "nodes/common.h"

struct half_plane {
  double normal[2], point[2];
};

static const zs_attribute attributes[] = {
  {.name = "normal",
   .type = ZS_VECTOR2,
   .offset = offsetof(struct half_plane, normal),
   .initial = "0 1",
   .unit = "1",
   .doc = "direction out of the shape, of any length"},
  {.name = "point",
   .type = ZS_VECTOR2,
   .offset = offsetof(struct half_plane, point),
   .initial = "0 0",
   .unit = "length",
   .doc = "a point of the line"},
};

static bool check(const zs_node *node, zs_diag *diag)
{
  const struct half_plane *p = node->parameters;
  if (p->normal[0] != 0 || p->normal[1] != 0)
    return true;
  return zs_node_fail(node, diag, "normal",
                      "'0 0' has no direction; expected a vector that is not 0");
}

const zs_kind zs_kind_half_plane = {
  .name = "half-plane",
  .family = ZS_FAMILY_SHAPE,
  .summary = "everything on one side of a line in the x-y plane",
  .doc = "The normal points out of the shape: the default is everything below y = 0.",
  .trait = "exact distance",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct half_plane),
  .children = ZS_CHILDREN_NONE,
  .formula = "((point.x - x) * normal.x + (point.y - y) * normal.y) / hypot(normal.x, normal.y)",
  .check = check,
};
