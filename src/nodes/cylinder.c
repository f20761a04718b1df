#include "nodes/common.h"

struct cylinder {
  double radius, height;
  int axis;
};

static const zs_attribute attributes[] = {
  ZS_LENGTH(struct cylinder, radius, "radius", "1", ZS_RANGE_POSITIVE, "radius"),
  ZS_LENGTH(struct cylinder, height, "height", "", ZS_RANGE_POSITIVE,
            "length along the axis, centred on the origin; without it the cylinder is infinite"),
  ZS_AXIS(struct cylinder, axis, "direction of the cylinder's axis"),
};

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  if (zs_node_has(node, "height"))
    return zs_kind_emit(compiler, node, at);
  const struct cylinder *p = node->parameters;
  zs_coordinates along = zs_coordinates_along(at, p->axis);
  return zs_formula_emit(compiler, node, "radius - hypot(x, y)", &along, 0, 0);
}

static zs_value fused(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct cylinder *p = node->parameters;
  zs_coordinates along = zs_coordinates_along(at, p->axis);
  if (!zs_node_has(node, "height"))
    return zs_emit_primitive(compiler, ZS_PRIMITIVE_TUBE, (double[4]){p->radius}, &along);
  return zs_emit_primitive(compiler, ZS_PRIMITIVE_CYLINDER, (double[4]){p->radius, p->height / 2},
                           &along);
}

const zs_kind zs_kind_cylinder = {
  .name = "cylinder",
  .family = ZS_FAMILY_PRIMITIVE,
  .summary = "a circular cylinder about the axis",
  .doc = "Without `height` f is `radius - hypot(x, y)`.",
  .trait = "exact distance",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct cylinder),
  .children = ZS_CHILDREN_NONE,
  .formula = "let r = hypot(x, y) - radius; "
             "let h = abs(z) - height / 2; "
             "-(min(max(r, h), 0) + hypot(max(r, 0), max(h, 0)))",
  .emit = emit,
  .fused = fused,
};
