/* Pasko and Savchenko's blending set operations. */
#include "nodes/common.h"
#include "nodes/extent.h"

#include <math.h>

#include "field/blend.h"

struct blend {
  double a0, a1, a2;
};

static const zs_attribute attributes[] = {
  ZS_LENGTH(struct blend, a0, "a0", "0.5", ZS_RANGE_ANY,
            "displacement where both operands are 0: above 0 adds material, below 0 removes it"),
  ZS_LENGTH(struct blend, a1, "a1", "1", ZS_RANGE_POSITIVE,
            "how far the blend reaches along the first operand's values"),
  ZS_LENGTH(struct blend, a2, "a2", "1", ZS_RANGE_POSITIVE,
            "how far it reaches along the second's"),
};

static zs_value join(zs_compiler *compiler, const zs_node *node, zs_blend_side side, zs_value a,
                     zs_value b)
{
  const struct blend *p = node->parameters;
  const zs_blend data = {.side = side, .parameter = {p->a0, p->a1, p->a2}};
  return zs_emit_operation(compiler, &zs_r_displaced, &data, a, b, 0);
}

static zs_value union_pair(zs_compiler *compiler, const zs_node *node, zs_value a, zs_value b)
{
  return join(compiler, node, ZS_BLEND_UNION, a, b);
}

static zs_value intersection_pair(zs_compiler *compiler, const zs_node *node, zs_value a,
                                  zs_value b)
{
  return join(compiler, node, ZS_BLEND_INTERSECTION, a, b);
}

static zs_value difference_pair(zs_compiler *compiler, const zs_node *node, zs_value a, zs_value b)
{
  return join(compiler, node, ZS_BLEND_INTERSECTION, a, zs_emit_negated(compiler, b));
}

#define DISPLACEMENT " + a0 / (1 + (a / a1)^2 + (b / a2)^2)"
#define SOURCE \
  "A. Pasko, V. Savchenko, Blending operations for the functionally based constructive geometry, " \
  "1994"
#define DOC \
  "The displacement is a0 where both operands are 0, and fades with the square of their values, " \
  "so that it reaches everywhere, if little. More than two children are blended from left to " \
  "right."

/* How far the displacement can move the surface of distances: the R-union of
 * two depths d is (2 - sqrt 2) d, and more material means a0 above it. */
static double swelling(const zs_node *node)
{
  const struct blend *p = node->parameters;
  return 1.71 * fmax(p->a0, 0);
}

static zs_box union_box(const zs_node *node, const zs_box *children, size_t count)
{
  return zs_box_grown(zs_box_of_union(node, children, count), swelling(node) * (double)count);
}

static zs_box intersection_box(const zs_node *node, const zs_box *children, size_t count)
{
  return zs_box_grown(zs_box_of_intersection(node, children, count),
                      swelling(node) * (double)count);
}

static zs_box difference_box(const zs_node *node, const zs_box *children, size_t count)
{
  return zs_box_grown(children[0], swelling(node) * (double)count);
}

const zs_kind zs_kind_blend_union = {
  .name = "blend-union",
  .family = ZS_FAMILY_BLEND,
  .summary = "a union with added or removed material along the seam",
  .doc = DOC,
  .source = SOURCE,
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct blend),
  .children = ZS_CHILDREN_MANY,
  .formula = "a + b + sqrt(a^2 + b^2)" DISPLACEMENT,
  .combine = union_pair,
  .box = union_box,
};

const zs_kind zs_kind_blend_intersection = {
  .name = "blend-intersection",
  .family = ZS_FAMILY_BLEND,
  .summary = "an intersection with added or removed material along the edge",
  .doc = DOC,
  .source = SOURCE,
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct blend),
  .children = ZS_CHILDREN_MANY,
  .formula = "a + b - sqrt(a^2 + b^2)" DISPLACEMENT,
  .combine = intersection_pair,
  .box = intersection_box,
};

const zs_kind zs_kind_blend_difference = {
  .name = "blend-difference",
  .family = ZS_FAMILY_BLEND,
  .summary = "a difference with added or removed material along the edge",
  .doc = DOC,
  .source = SOURCE,
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct blend),
  .children = ZS_CHILDREN_MANY,
  .formula = "a - b - sqrt(a^2 + b^2)" DISPLACEMENT,
  .combine = difference_pair,
  .box = difference_box,
};
