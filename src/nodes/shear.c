#include "nodes/common.h"
#include "nodes/extent.h"

#include <math.h>

struct shear {
  double by;
  int axis, toward;
};

static const zs_attribute attributes[] = {
  ZS_AXIS(struct shear, axis, "axis that leans"),
  ZS_TOWARD(struct shear, toward,
            "axis that it leans to, another one; `z` when not written and the axis is `x`"),
  ZS_PLAIN(struct shear, by, "by", NULL, ZS_RANGE_ANY,
           "how far points move per unit of length along the axis"),
};

static bool check(const zs_node *node, zs_diag *diag)
{
  const struct shear *p = node->parameters;
  return zs_node_check_toward(node, diag, p->axis, p->toward);
}

static void find_inverse(const zs_node *node, double inverse[12])
{
  const struct shear *p = node->parameters;
  for (int i = 0; i < 12; i++)
    inverse[i] = i % 5 == 0;
  inverse[4 * zs_node_toward(node, p->axis, p->toward) + p->axis] = -p->by;
}

/* The least stretch of a vector is 2 / (|by| + sqrt (by^2 + 4)). */
static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct shear *p = node->parameters;
  double inverse[12];
  find_inverse(node, inverse);
  const zs_coordinates child = zs_coordinates_affine(at, inverse);
  return zs_emit_scaled(compiler, zs_children_emit(compiler, node, &child),
                        2 / (fabs(p->by) + hypot(p->by, 2)));
}

static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)count;
  double inverse[12];
  find_inverse(node, inverse);
  return zs_box_image(&children[0], inverse);
}

const zs_kind zs_kind_shear = {
  .name = "shear",
  .family = ZS_FAMILY_COORDINATE_MAP,
  .summary = "the child leaning to a side",
  .doc = "With the axis z, toward x, the child is evaluated at (x - by z, y, z). f is multiplied "
         "by the least factor by which the map stretches, 2 / (|by| + sqrt(by^2 + 4)), so that a "
         "distance bound stays one.",
  .trait = "keeps distance bounds",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct shear),
  .children = ZS_CHILDREN_ONE,
  .check = check,
  .emit = emit,
  .box = box,
};
