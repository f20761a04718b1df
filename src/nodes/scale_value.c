#include "nodes/extent.h"

struct scale_value {
  double by;
};

static const zs_attribute attributes[] = {
  ZS_PLAIN(struct scale_value, by, "by", NULL, ZS_RANGE_POSITIVE, "the factor"),
};

const zs_kind zs_kind_scale_value = {
  .name = "scale-value",
  .family = ZS_FAMILY_FUNCTION_MAP,
  .summary = "the child with its f multiplied by a factor",
  .doc = "The solid stays the same; how it blends, and how it is displaced, changes.",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct scale_value),
  .children = ZS_CHILDREN_ONE,
  .formula = "f * by",
  .box = zs_box_of_union,
};
