#include "nodes/extent.h"

#include <math.h>

struct offset {
  double by;
};

static const zs_attribute attributes[] = {
  ZS_LENGTH(struct offset, by, "by", NULL, ZS_RANGE_ANY,
            "how far the surface moves outward; negative values shrink the solid"),
};

static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)count;
  const struct offset *p = node->parameters;
  return zs_box_grown(children[0], fmax(p->by, 0));
}

const zs_kind zs_kind_offset = {
  .name = "offset",
  .family = ZS_FAMILY_FUNCTION_MAP,
  .summary = "the child grown or shrunk",
  .doc = "The surface moves by `by` where the child's f is the exact distance, and by about that "
         "much where it is close to one.",
  .source = "V. Savchenko, A. Pasko, Transformation of functionally defined shapes by extended "
            "space mappings, 1998",
  .trait = "distance bound of a distance bound",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct offset),
  .children = ZS_CHILDREN_ONE,
  .formula = "f + by",
  .box = box,
};
