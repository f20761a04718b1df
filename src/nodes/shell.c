#include "nodes/extent.h"

static const char *const sides[] = {"both", "in", "out", NULL};

struct shell {
  double thickness;
  int side;
};

static const zs_attribute attributes[] = {
  ZS_LENGTH(struct shell, thickness, "thickness", "0.1", ZS_RANGE_POSITIVE,
            "thickness of the wall"),
  ZS_SELECT(struct shell, side, "side", "both", sides,
            "where the wall lies: half on either side of the child's surface, inside or outside "
            "it"),
};

static const zs_variant variants[] = {
  {"side", "both", "thickness / 2 - abs(f)"},
  {"side", "in", "min(f, thickness - f)"},
  {"side", "out", "min(-f, f + thickness)"},
  {NULL, NULL, NULL},
};

static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)count;
  const struct shell *p = node->parameters;
  return zs_box_grown(children[0], p->thickness);
}

const zs_kind zs_kind_shell = {
  .name = "shell",
  .family = ZS_FAMILY_FUNCTION_MAP,
  .summary = "a wall along the child's surface",
  .doc = "The wall is as thick as asked for where the child's f is the exact distance.",
  .trait = "distance bound of a distance bound",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct shell),
  .children = ZS_CHILDREN_ONE,
  .variants = variants,
  .box = box,
};
