#include "nodes/kind.h"

struct gyroid {
  double period, thickness;
};

static const zs_attribute attributes[] = {
  ZS_LENGTH(struct gyroid, period, "period", "1", ZS_RANGE_POSITIVE,
            "length after which the surface repeats along x, y and z"),
  ZS_LENGTH(struct gyroid, thickness, "thickness", "0.1", ZS_RANGE_POSITIVE,
            "thickness of the wall along it, about"),
};

const zs_kind zs_kind_gyroid = {
  .name = "gyroid",
  .family = ZS_FAMILY_PRIMITIVE,
  .summary = "a wall along the gyroid, a surface that divides space into two equal mazes",
  .doc = "It has no end: intersect it with the solid that it is to fill.",
  .source = "A. Schoen, Infinite periodic minimal surfaces without self-intersections, 1970",
  .trait = "distance bound",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct gyroid),
  .children = ZS_CHILDREN_NONE,
  .formula = "let k = 2 * pi / period; "
             "let g = sin(k * x) * cos(k * y) + sin(k * y) * cos(k * z) + sin(k * z) * cos(k * x); "
             "thickness / 2 - abs(g) / (k * sqrt(3))",
};
