/* Set operations with a fillet of bounded size. */
#include "nodes/common.h"
#include "nodes/extent.h"

#include "field/blend.h"

static const char *const profiles[] = {"quadratic", "cubic",       "circular",
                                       "chamfer",   "exponential", NULL};
static const zs_operation *const operations[] = {&zs_smooth_quadratic, &zs_smooth_cubic,
                                                 &zs_smooth_circular, &zs_smooth_chamfer,
                                                 &zs_smooth_exponential};

/* A radius whose square is nothing in single precision is none. */
static const double NO_RADIUS = 1e-18;

struct smooth {
  double radius;
  int profile;
};

static const zs_attribute attributes[] = {
  ZS_LENGTH(struct smooth, radius, "radius", "0.25", ZS_RANGE_NOT_NEGATIVE,
            "the operands blend where their values differ by less than this; 0 is a sharp seam"),
  ZS_SELECT(struct smooth, profile, "profile", "quadratic", profiles,
            "how: `quadratic` (smooth tangents), `cubic` (smooth curvature), `circular` (a round "
            "fillet where the operands are at right angles), `chamfer` (a flat cut), "
            "`exponential` (smooth everywhere, fading beyond the radius instead of ending there)"),
};

static zs_value join(zs_compiler *compiler, const zs_node *node, zs_blend_side side, zs_value a,
                     zs_value b)
{
  const struct smooth *p = node->parameters;
  if (p->radius < NO_RADIUS)
    return zs_emit(compiler, side == ZS_BLEND_UNION ? ZS_FUNCTION_MAXIMUM : ZS_FUNCTION_MINIMUM, a,
                   b, 0);
  const zs_blend data = {.side = side, .parameter = {p->radius}};
  return zs_emit_operation(compiler, operations[p->profile], &data, a, b, 0);
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

/* d: how far the operands are apart; h: how far they are inside the blend. */
#define QUADRATIC "let h = max(radius - d, 0); let c = h^2 / (4 * radius); "
#define CUBIC "let h = max(radius - d, 0); let c = h^3 / (6 * radius^2); "
#define CIRCULAR \
  "let e = min(d, radius); let c = radius - e / 2 - sqrt(2 * radius^2 - e^2) / 2; "
#define CHAMFER "let c = max(radius - d, 0) / 2; "
#define EXPONENTIAL \
  "let k = radius / (4 * log(2)); let c = k * log(1 + exp(-d / k)); "

#define VARIANTS(DISTANCE, RESULT) \
  { \
    {"profile", "quadratic", DISTANCE QUADRATIC RESULT}, \
    {"profile", "cubic", DISTANCE CUBIC RESULT}, \
    {"profile", "circular", DISTANCE CIRCULAR RESULT}, \
    {"profile", "chamfer", DISTANCE CHAMFER RESULT}, \
    {"profile", "exponential", DISTANCE EXPONENTIAL RESULT}, \
    {NULL, NULL, NULL}, \
  }

static const zs_variant union_variants[] = VARIANTS("let d = abs(a - b); ", "max(a, b) + c");
static const zs_variant intersection_variants[] = VARIANTS("let d = abs(a - b); ", "min(a, b) - c");
static const zs_variant difference_variants[] = VARIANTS("let d = abs(a + b); ", "min(a, -b) - c");

#define SOURCE \
  "I. Quilez, Smooth minimum (quadratic, cubic, exponential); ImplicitCAD, rounded unions " \
  "(circular)"
#define TRAIT "distance bound of distance bounds"

/* The seam swells by less than the radius. */
static zs_box union_box(const zs_node *node, const zs_box *children, size_t count)
{
  const struct smooth *p = node->parameters;
  return zs_box_grown(zs_box_of_union(node, children, count), p->radius);
}

const zs_kind zs_kind_smooth_union = {
  .name = "smooth-union",
  .family = ZS_FAMILY_BLEND,
  .summary = "a union with a fillet along the seam",
  .doc = "The greater value plus a correction c. More than two children are joined from left to "
         "right.",
  .source = SOURCE,
  .trait = TRAIT,
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct smooth),
  .children = ZS_CHILDREN_MANY,
  .variants = union_variants,
  .combine = union_pair,
  .box = union_box,
};

const zs_kind zs_kind_smooth_intersection = {
  .name = "smooth-intersection",
  .family = ZS_FAMILY_BLEND,
  .summary = "an intersection with rounded or chamfered edges",
  .doc = "The smaller value less a correction c. More than two children are joined from left to "
         "right.",
  .source = SOURCE,
  .trait = TRAIT,
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct smooth),
  .children = ZS_CHILDREN_MANY,
  .variants = intersection_variants,
  .combine = intersection_pair,
  .box = zs_box_of_intersection,
};

const zs_kind zs_kind_smooth_difference = {
  .name = "smooth-difference",
  .family = ZS_FAMILY_BLEND,
  .summary = "the first child without the others, with rounded or chamfered edges",
  .doc = "The smooth intersection of the first child and the complements of the others, from "
         "left to right.",
  .source = SOURCE,
  .trait = TRAIT,
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct smooth),
  .children = ZS_CHILDREN_MANY,
  .variants = difference_variants,
  .combine = difference_pair,
  .box = zs_box_of_first,
};
