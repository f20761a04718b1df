/* The set operations, as R-functions of their operands. */
#include "nodes/common.h"
#include "nodes/extent.h"

#include "field/blend.h"

#include <math.h>

enum { MIN_MAX, R0, R_ALPHA, R_M };
static const char *const functions[] = {"min-max", "r0", "r-alpha", "r-m", NULL};

struct set {
  int function, m;
  double alpha;
};

static const zs_attribute attributes[] = {
  ZS_SELECT(struct set, function, "r-function", "min-max", functions,
            "which functions stand for union and intersection: `min-max` keeps distance bounds; "
            "`r0` and `r-alpha` are smooth except where both operands are 0; `r-m` is m times "
            "differentiable everywhere, but not a distance"),
  {.name = "alpha",
   .type = ZS_NUMBER,
   .offset = offsetof(struct set, alpha),
   .initial = "0",
   .unit = "1",
   .range = ZS_RANGE_BETWEEN,
   .minimum = -1,
   .maximum = 1,
   .doc = "for `r-alpha`: above -1; 0 is `r0`, 1 is `min-max`"},
  {.name = "m",
   .type = ZS_INTEGER,
   .offset = offsetof(struct set, m),
   .initial = "2",
   .unit = "1",
   .range = ZS_RANGE_BETWEEN,
   .minimum = 2,
   .maximum = ZS_R_M_MAXIMUM,
   .doc = "for `r-m`: how many times differentiable; even"},
};

/* An attribute that only one R-function has, written with another. */
static void warn_unused(const zs_node *node, zs_diag *diag, const char *attribute, int function)
{
  const struct set *p = node->parameters;
  if (p->function == function || !zs_node_has(node, attribute))
    return;
  zs_place place = zs_node_place(node, attribute);
  zs_report(diag, ZS_WARNING, ZS_ERROR_SCHEMA, &place, NULL,
            "has no effect: it belongs to r-function=\"%s\", and this is \"%s\"",
            functions[function], functions[p->function]);
}

static bool check(const zs_node *node, zs_diag *diag)
{
  const struct set *p = node->parameters;
  if (!(p->alpha > -1))
    return zs_node_fail(node, diag, "alpha", "%g is too small; expected a number above -1, up to 1",
                        p->alpha);
  if (p->m % 2)
    return zs_node_fail(node, diag, "m", "%d is odd; expected an even number", p->m);
  warn_unused(node, diag, "alpha", R_ALPHA);
  warn_unused(node, diag, "m", R_M);
  return true;
}

/* Whether a value is infinite: of `empty`, `everything` and their like. */
static bool is_extreme(const zs_compiler *compiler, zs_value value, bool *positive)
{
  double number;
  bool extreme = zs_value_constant(compiler, value, &number) && isinf(number);
  *positive = extreme && number > 0;
  return extreme;
}

/* a or b (side UNION), a and b (side INTERSECTION). */
static zs_value join(zs_compiler *compiler, const struct set *p, zs_blend_side side, zs_value a,
                     zs_value b)
{
  bool positive;
  /* Nothing and everything decide, or leave the decision to the other. */
  if (is_extreme(compiler, a, &positive))
    return positive == (side == ZS_BLEND_UNION) ? a : b;
  if (is_extreme(compiler, b, &positive))
    return positive == (side == ZS_BLEND_UNION) ? b : a;
  if (p->function == MIN_MAX || (p->function == R_ALPHA && p->alpha == 1))
    return zs_emit(compiler, side == ZS_BLEND_UNION ? ZS_FUNCTION_MAXIMUM : ZS_FUNCTION_MINIMUM, a,
                   b, 0);
  zs_blend data = {.side = side};
  if (p->function == R_M) {
    data.parameter[0] = p->m;
    return zs_emit_operation(compiler, &zs_r_m, &data, a, b, 0);
  }
  data.parameter[0] = p->function == R_ALPHA ? p->alpha : 0;
  return zs_emit_operation(compiler, &zs_r_alpha, &data, a, b, 0);
}

static zs_value union_pair(zs_compiler *compiler, const zs_node *node, zs_value a, zs_value b)
{
  return join(compiler, node->parameters, ZS_BLEND_UNION, a, b);
}

static zs_value intersection_pair(zs_compiler *compiler, const zs_node *node, zs_value a,
                                  zs_value b)
{
  return join(compiler, node->parameters, ZS_BLEND_INTERSECTION, a, b);
}

static zs_value difference_pair(zs_compiler *compiler, const zs_node *node, zs_value a, zs_value b)
{
  return join(compiler, node->parameters, ZS_BLEND_INTERSECTION, a, zs_emit_negated(compiler, b));
}

static zs_value symmetric_difference_pair(zs_compiler *compiler, const zs_node *node, zs_value a,
                                          zs_value b)
{
  return union_pair(compiler, node, difference_pair(compiler, node, a, b),
                    difference_pair(compiler, node, b, a));
}

#define Q0 "sqrt(a^2 + b^2)"
#define Q_ALPHA "sqrt(a^2 + b^2 - 2 * alpha * a * b)"
#define Q_ALPHA_NEGATED "sqrt(a^2 + b^2 + 2 * alpha * a * b)"
#define W_M "(a^2 + b^2) ^ (m / 2)"

static const zs_variant union_variants[] = {
  {"r-function", "min-max", "max(a, b)"},
  {"r-function", "r0", "a + b + " Q0},
  {"r-function", "r-alpha", "(a + b + " Q_ALPHA ") / (1 + alpha)"},
  {"r-function", "r-m", "(a + b + " Q0 ") * " W_M},
  {NULL, NULL, NULL},
};

static const zs_variant intersection_variants[] = {
  {"r-function", "min-max", "min(a, b)"},
  {"r-function", "r0", "a + b - " Q0},
  {"r-function", "r-alpha", "(a + b - " Q_ALPHA ") / (1 + alpha)"},
  {"r-function", "r-m", "(a + b - " Q0 ") * " W_M},
  {NULL, NULL, NULL},
};

static const zs_variant difference_variants[] = {
  {"r-function", "min-max", "min(a, -b)"},
  {"r-function", "r0", "a - b - " Q0},
  {"r-function", "r-alpha", "(a - b - " Q_ALPHA_NEGATED ") / (1 + alpha)"},
  {"r-function", "r-m", "(a - b - " Q0 ") * " W_M},
  {NULL, NULL, NULL},
};

/* p: a without b, q: b without a; then their union. */
static const zs_variant symmetric_difference_variants[] = {
  {"r-function", "min-max", "max(min(a, -b), min(b, -a))"},
  {"r-function", "r0",
   "let p = a - b - " Q0 "; let q = b - a - " Q0 "; p + q + sqrt(p^2 + q^2)"},
  {"r-function", "r-alpha",
   "let p = (a - b - " Q_ALPHA_NEGATED ") / (1 + alpha); "
   "let q = (b - a - " Q_ALPHA_NEGATED ") / (1 + alpha); "
   "(p + q + sqrt(p^2 + q^2 - 2 * alpha * p * q)) / (1 + alpha)"},
  {"r-function", "r-m",
   "let p = (a - b - " Q0 ") * " W_M "; let q = (b - a - " Q0 ") * " W_M "; "
   "(p + q + sqrt(p^2 + q^2)) * (p^2 + q^2) ^ (m / 2)"},
  {NULL, NULL, NULL},
};

#define SOURCE \
  "V. L. Rvachev, Theory of R-functions, 1982; A. Pasko, V. Adzhiev, A. Sourin, V. Savchenko, " \
  "Function representation in geometric modeling, 1995"
#define TRAIT "distance bound of distance bounds with min-max; others have the right sign"

const zs_kind zs_kind_union = {
  .name = "union",
  .family = ZS_FAMILY_SET,
  .summary = "everything that is in at least one of the children",
  .doc = "Several children are joined from left to right; with R-functions other than `min-max` "
         "the value, not the solid, depends on their order.",
  .source = SOURCE,
  .trait = TRAIT,
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct set),
  .children = ZS_CHILDREN_MANY,
  .variants = union_variants,
  .check = check,
  .combine = union_pair,
  .box = zs_box_of_union,
};

const zs_kind zs_kind_intersection = {
  .name = "intersection",
  .family = ZS_FAMILY_SET,
  .summary = "everything that is in all of the children",
  .doc = "Several children are joined from left to right.",
  .source = SOURCE,
  .trait = TRAIT,
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct set),
  .children = ZS_CHILDREN_MANY,
  .variants = intersection_variants,
  .check = check,
  .combine = intersection_pair,
  .box = zs_box_of_intersection,
};

const zs_kind zs_kind_difference = {
  .name = "difference",
  .family = ZS_FAMILY_SET,
  .summary = "the first child without all the others",
  .doc = "The others are taken away from left to right. The difference of a and b is the "
         "intersection of a and -b.",
  .source = SOURCE,
  .trait = TRAIT,
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct set),
  .children = ZS_CHILDREN_MANY,
  .variants = difference_variants,
  .check = check,
  .combine = difference_pair,
  .box = zs_box_of_first,
};

const zs_kind zs_kind_symmetric_difference = {
  .name = "symmetric-difference",
  .family = ZS_FAMILY_SET,
  .summary = "everything that is in an odd number of the children",
  .doc = "The union of a without b and b without a, from left to right.",
  .source = SOURCE,
  .trait = TRAIT,
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct set),
  .children = ZS_CHILDREN_MANY,
  .variants = symmetric_difference_variants,
  .check = check,
  .combine = symmetric_difference_pair,
  .box = zs_box_of_union,
};

const zs_kind zs_kind_complement = {
  .name = "complement",
  .family = ZS_FAMILY_SET,
  .summary = "everything outside the child",
  .doc = "The surface belongs to both.",
  .trait = "exact distance of an exact distance",
  .children = ZS_CHILDREN_ONE,
  .formula = "-f",
};
