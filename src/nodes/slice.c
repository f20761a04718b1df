#include "nodes/kind.h"

#include <math.h>

struct slice {
  double z;
};

static const zs_attribute attributes[] = {
  ZS_LENGTH(struct slice, z, "z", "0", ZS_RANGE_ANY, "height of the cut"),
};

/* A row of the affine map that is constant. */
static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct slice *p = node->parameters;
  const double flat[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, p->z};
  zs_coordinates child = zs_coordinates_affine(at, flat);
  return zs_children_emit(compiler, node, &child);
}

static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)node, (void)count;
  zs_box all = children[0];
  all.lo[2] = -INFINITY;
  all.hi[2] = INFINITY;
  return all;
}

const zs_kind zs_kind_slice = {
  .name = "slice",
  .family = ZS_FAMILY_COORDINATE_MAP,
  .summary = "the cross-section of a solid, as a shape",
  .doc = "The child is evaluated at (x, y, `z`) for all heights: what it is there becomes a shape "
         "of the x-y plane.",
  .trait = "distance bound of a distance bound",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct slice),
  .children = ZS_CHILDREN_ONE,
  .emit = emit,
  .box = box,
};
