#include "nodes/kind.h"

struct circle {
  double radius;
};

static const zs_attribute attributes[] = {
  ZS_LENGTH(struct circle, radius, "radius", "1", ZS_RANGE_POSITIVE, "radius of the disc"),
};

const zs_kind zs_kind_circle = {
  .name = "circle",
  .family = ZS_FAMILY_SHAPE,
  .summary = "a disc about the origin of the x-y plane",
  .trait = "exact distance",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct circle),
  .children = ZS_CHILDREN_NONE,
  .formula = "radius - hypot(x, y)",
};
