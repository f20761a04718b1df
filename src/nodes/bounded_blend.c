#include "nodes/bounded_blend.h"

#include "nodes/common.h"
#include "nodes/extent.h"

enum { UNION, INTERSECTION, DIFFERENCE };
static const char *const operations[] = {"union", "intersection", "difference", NULL};

struct bounded_blend {
  int operation;
  zs_bounded_blend blend;
};

static const zs_attribute attributes[] = {
  ZS_SELECT(struct bounded_blend, operation, "operation", "union", operations,
            "what the first two children are joined by"),
  ZS_LENGTH(struct bounded_blend, blend.a0, "a0", "0.5", ZS_RANGE_ANY,
            "displacement where both are 0, inside the third: above 0 adds material, below 0 "
            "removes it"),
  ZS_LENGTH(struct bounded_blend, blend.a1, "a1", "1", ZS_RANGE_POSITIVE,
            "how far the blend reaches along the first child's values"),
  ZS_LENGTH(struct bounded_blend, blend.a2, "a2", "1", ZS_RANGE_POSITIVE,
            "how far it reaches along the second's"),
  ZS_LENGTH(struct bounded_blend, blend.a3, "a3", "1", ZS_RANGE_POSITIVE,
            "how far into the third child the blend is held back: small values let it come to its "
            "full strength near the boundary"),
};

static bool check(const zs_node *node, zs_diag *diag)
{
  return node->child_count >= 3 ||
         zs_node_misuse(node, diag, NULL, "there are %zu children; expected 3: the two that are "
                        "blended, and the solid that bounds the blend", node->child_count);
}

/* With w = r1/r2, r^2 is w^2 / (1 + w^2), and with q = 1 - r^2 the displacement a0 q^3 / (2 - q):
 * nothing in it can overflow or be 0/0, and its bounds are sharp. */
zs_value zs_bounded_displacement_emit(zs_compiler *compiler, const zs_bounded_blend *blend,
                                      zs_value f1, zs_value f2, zs_value f3)
{
  static const double LEAST = 1e-15;
  const zs_value none = zs_emit_constant(compiler, 0), one = zs_emit_constant(compiler, 1);
  const zs_value r1 =
    zs_emit(compiler, ZS_FUNCTION_HYPOT, zs_emit_scaled(compiler, f1, 1 / blend->a1),
            zs_emit_scaled(compiler, f2, 1 / blend->a2), 0);
  const zs_value r2 = zs_emit(compiler, ZS_FUNCTION_MAXIMUM,
                              zs_emit_scaled(compiler, f3, 1 / blend->a3),
                              zs_emit_constant(compiler, LEAST), 0);
  zs_value w = zs_emit(compiler, ZS_FUNCTION_DIVIDE, r1, r2, 0);
  w = zs_emit(compiler, ZS_FUNCTION_MINIMUM, w, zs_emit_constant(compiler, 1 / LEAST), 0);
  w = zs_emit(compiler, ZS_FUNCTION_SQUARE, w, 0, 0);
  const zs_value q =
    zs_emit(compiler, ZS_FUNCTION_DIVIDE, one, zs_emit(compiler, ZS_FUNCTION_ADD, one, w, 0), 0);
  const zs_value cube = zs_emit(compiler, ZS_FUNCTION_MULTIPLY, q,
                                zs_emit(compiler, ZS_FUNCTION_SQUARE, q, 0, 0), 0);
  const zs_value below =
    zs_emit(compiler, ZS_FUNCTION_SUBTRACT, zs_emit_constant(compiler, 2), q, 0);
  const zs_value rise = zs_emit_scaled(
    compiler, zs_emit(compiler, ZS_FUNCTION_DIVIDE, cube, below, 0), blend->a0);
  return zs_emit(compiler, ZS_FUNCTION_SELECT,
                 zs_emit(compiler, ZS_FUNCTION_LESS, none, f3, 0), rise, none);
}

zs_value zs_bounded_blend_emit(zs_compiler *compiler, zs_blend_side side,
                               const zs_bounded_blend *blend, zs_value f1, zs_value f2,
                               zs_value f3)
{
  const zs_blend r0 = {.side = side};
  return zs_emit(compiler, ZS_FUNCTION_ADD,
                 zs_emit_operation(compiler, &zs_r_alpha, &r0, f1, f2, 0),
                 zs_bounded_displacement_emit(compiler, blend, f1, f2, f3), 0);
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct bounded_blend *p = node->parameters;
  zs_value f[3];
  for (size_t i = 0; i < node->child_count; i++) {
    const zs_value child = zs_node_emit(compiler, node->children[i], at);
    if (i < 3)
      f[i] = child;
    else
      f[2] = zs_emit(compiler, ZS_FUNCTION_MAXIMUM, f[2], child, 0);
  }
  if (p->operation == DIFFERENCE)
    f[1] = zs_emit_negated(compiler, f[1]);
  return zs_bounded_blend_emit(compiler,
                               p->operation == UNION ? ZS_BLEND_UNION : ZS_BLEND_INTERSECTION,
                               &p->blend, f[0], f[1], f[2]);
}

/* Material is added in the third child only. */
static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  const struct bounded_blend *p = node->parameters;
  const zs_box joined = p->operation == UNION          ? zs_box_of_union(node, children, 2)
                        : p->operation == INTERSECTION ? zs_box_of_intersection(node, children, 2)
                                                       : children[0];
  const zs_box both[2] = {joined, zs_box_of_union(node, children + 2, count - 2)};
  return zs_box_of_union(node, both, p->blend.a0 > 0 ? 2 : 1);
}

const zs_kind zs_kind_bounded_blend = {
  .name = "bounded-blend",
  .family = ZS_FAMILY_BLEND,
  .summary = "a blend of two children that ends where a third one does",
  .doc = "Of the children's values f1, f2 and f3, f is the R-function f1 + f2 + sqrt(f1^2 + f2^2), "
         "or its like, plus a0 (1 - r^2)^3 / (1 + r^2), where r^2 = r1^2 / (r1^2 + r2^2), r1^2 = "
         "(f1/a1)^2 + (f2/a2)^2 and r2 = f3/a3. Outside of the third child nothing is added; it is "
         "the union of all children behind the second.",
  .source = "G. Pasko, A. Pasko, M. Ikeda, T. Kunii, Bounded blending operations, 2002",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct bounded_blend),
  .children = ZS_CHILDREN_TWO,
  .check = check,
  .emit = emit,
  .box = box,
};
