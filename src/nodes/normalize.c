#include "nodes/common.h"
#include "nodes/extent.h"

#include <math.h>

struct normalize {
  double step;
};

static const zs_attribute attributes[] = {
  ZS_LENGTH(struct normalize, step, "step", "0.05", ZS_RANGE_POSITIVE,
            "how far to either side the child is looked at to find its slopes: less than the "
            "smallest detail, and more than a 10000th of the solid"),
};

/* The slope of the child along an axis, by the two sides' difference. */
static zs_value slope(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at,
                      int axis)
{
  const struct normalize *p = node->parameters;
  double step[3] = {0};
  zs_value side[2];
  for (int i = 0; i < 2; i++) {
    step[axis] = i ? p->step : -p->step;
    const zs_coordinates moved = zs_coordinates_moved(at, step);
    side[i] = zs_children_emit(compiler, node, &moved);
  }
  return zs_emit_scaled(compiler,
                        zs_emit(compiler, ZS_FUNCTION_SUBTRACT, side[0], side[1], 0),
                        1 / (2 * p->step));
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const zs_value f = zs_children_emit(compiler, node, at);
  double number;
  if (zs_value_constant(compiler, f, &number) && isinf(number))
    return f; /* nothing, or everything */
  zs_value steep = zs_emit(compiler, ZS_FUNCTION_HYPOT, slope(compiler, node, at, 0),
                           slope(compiler, node, at, 1), 0);
  steep = zs_emit(compiler, ZS_FUNCTION_HYPOT, steep, slope(compiler, node, at, 2), 0);
  return zs_formula_emit(compiler, node, "clamp(a / max(hypot(a, b), 1e-30), -1, 1)", at, f, steep);
}

const zs_kind zs_kind_normalize = {
  .name = "normalize",
  .family = ZS_FAMILY_FUNCTION_MAP,
  .summary = "the child with an f that is like a distance near its surface",
  .doc = "f / sqrt(f^2 + |grad f|^2): the solid stays the same, values become comparable, as "
         "blends and interpolation want them. They go from -1 to 1, with a slope of 1 on the "
         "surface. The child is evaluated seven times.",
  .source = "V. Rvachev, Theory of R-functions and some applications, 1982",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct normalize),
  .children = ZS_CHILDREN_ONE,
  .emit = emit,
  .box = zs_box_of_union,
};
