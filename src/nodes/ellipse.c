#include "nodes/kind.h"

struct ellipse {
  double radii[2];
};

static const zs_attribute attributes[] = {
  {.name = "radii",
   .type = ZS_VECTOR2,
   .offset = offsetof(struct ellipse, radii),
   .initial = "1 1",
   .unit = "length",
   .range = ZS_RANGE_POSITIVE,
   .doc = "half the extent along x and y"},
};

const zs_kind zs_kind_ellipse = {
  .name = "ellipse",
  .family = ZS_FAMILY_SHAPE,
  .summary = "an ellipse about the origin of the x-y plane",
  .doc = "f is the distance of a unit disc, stretched with the plane and multiplied by the "
         "smaller radius.",
  .trait = "distance bound",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct ellipse),
  .children = ZS_CHILDREN_NONE,
  .formula = "min(radii.x, radii.y) * (1 - hypot(x / radii.x, y / radii.y))",
};
