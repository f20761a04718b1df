#include "nodes/common.h"

struct cone {
  double radius, top_radius, height;
  int axis;
};

static const zs_attribute attributes[] = {
  ZS_LENGTH(struct cone, radius, "radius", "1", ZS_RANGE_NOT_NEGATIVE,
            "radius at the lower end of the axis"),
  ZS_LENGTH(struct cone, top_radius, "top-radius", "0", ZS_RANGE_NOT_NEGATIVE,
            "radius at the upper end"),
  ZS_LENGTH(struct cone, height, "height", NULL, ZS_RANGE_POSITIVE,
            "length along the axis, centred on the origin"),
  ZS_AXIS(struct cone, axis, "direction from the lower to the upper end"),
};

static bool check(const zs_node *node, zs_diag *diag)
{
  const struct cone *p = node->parameters;
  if (p->radius > 0 || p->top_radius > 0)
    return true;
  return zs_node_fail(node, diag, "radius",
                      "'radius' and 'top-radius' are both 0; expected one of them to be > 0");
}

const zs_kind zs_kind_cone = {
  .name = "cone",
  .family = ZS_FAMILY_PRIMITIVE,
  .summary = "a circular cone, or a frustum when `top-radius` is not 0",
  .doc = "Inside, f is the distance to the nearest of the mantle and the two end planes; outside, "
         "to the nearest of the mantle and the two end discs.",
  .source = "I. Quilez, Distance functions (capped cone)",
  .trait = "exact distance",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct cone),
  .children = ZS_CHILDREN_NONE,
  /* m: the greatest of the signed distances to the mantle's line and to the end
   * planes.  u, v: from the nearest point of the mantle. */
  .formula = "let s = top_radius - radius; "
             "let n = hypot(s, height); "
             "let r = hypot(x, y) - radius; "
             "let h = z + height / 2; "
             "let cap = abs(z) - height / 2; "
             "let m = max((r * height - h * s) / n, cap); "
             "let t = clamp((r * s + h * height) / (n * n), 0, 1); "
             "let u = r - t * s; "
             "let v = h - t * height; "
             "let disc = max(r - (z < 0 ? 0 : s), 0); "
             "m < 0 ? -m : -min(hypot(u, v), hypot(disc, cap))",
  .check = check,
};
