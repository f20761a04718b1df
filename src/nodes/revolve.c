#include "nodes/common.h"

#include <math.h>

struct revolve {
  double offset;
  int axis;
};

static const zs_attribute attributes[] = {
  ZS_AXIS(struct revolve, axis, "axis of revolution"),
  ZS_LENGTH(struct revolve, offset, "offset", "0", ZS_RANGE_ANY,
            "distance of the shape's origin from the axis"),
};

/* The shape's x is the distance from the axis, its y runs along it. */
static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct revolve *p = node->parameters;
  zs_coordinates along = zs_coordinates_along(at, p->axis);
  zs_value radius =
    zs_emit(compiler, ZS_FUNCTION_HYPOT, zs_emit_coordinate(compiler, &along, 0),
            zs_emit_coordinate(compiler, &along, 1), 0);
  zs_value offset = zs_emit_constant(compiler, p->offset);
  radius = zs_emit(compiler, ZS_FUNCTION_SUBTRACT, radius, offset, 0);
  zs_coordinates shape = zs_coordinates_from(radius, zs_emit_coordinate(compiler, &along, 2),
                                             zs_emit_constant(compiler, 0));
  return zs_children_emit(compiler, node, &shape);
}

static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)count;
  const struct revolve *p = node->parameters;
  const double radius = fmax(fmax(children[0].hi[0] + p->offset, 0), -children[0].lo[0] - p->offset);
  zs_box all;
  for (int k = 0; k < 3; k++) {
    all.lo[k] = k == p->axis ? children[0].lo[1] : -radius;
    all.hi[k] = k == p->axis ? children[0].hi[1] : radius;
  }
  return all;
}

const zs_kind zs_kind_revolve = {
  .name = "revolve",
  .family = ZS_FAMILY_SOLID_FROM_SHAPE,
  .summary = "a shape turned about an axis",
  .doc = "The shape's x becomes the distance from the axis, less `offset`, and its y runs along "
         "the axis: f is the shape's f at (hypot(x, y) - offset, z).",
  .trait = "exact distance if the shape's is one and the shape does not cross the axis",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct revolve),
  .children = ZS_CHILDREN_ONE,
  .emit = emit,
  .box = box,
};
