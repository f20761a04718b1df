#include "nodes/common.h"

struct slab {
  double min, max;
  int axis;
};

static const zs_attribute attributes[] = {
  ZS_LENGTH(struct slab, min, "min", NULL, ZS_RANGE_ANY, "where the slab begins on the axis"),
  ZS_LENGTH(struct slab, max, "max", NULL, ZS_RANGE_ANY, "where it ends"),
  ZS_AXIS(struct slab, axis, "direction across the slab"),
};

static bool check(const zs_node *node, zs_diag *diag)
{
  const struct slab *p = node->parameters;
  return zs_node_check_order(node, diag, "min", &p->min, "max", &p->max, 1);
}

const zs_kind zs_kind_slab = {
  .name = "slab",
  .family = ZS_FAMILY_PRIMITIVE,
  .summary = "everything between two parallel planes",
  .doc = "In the formula `min_` and `max_` are the attributes, not the functions of that name.",
  .trait = "exact distance",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct slab),
  .children = ZS_CHILDREN_NONE,
  .formula = "(max_ - min_) / 2 - abs(z - (min_ + max_) / 2)",
  .check = check,
};
