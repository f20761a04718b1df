#include "nodes/kind.h"

struct formula {
  zs_formula formula;
  double lipschitz;
};

static const zs_attribute attributes[] = {
  {.name = "formula",
   .type = ZS_FORMULA,
   .offset = offsetof(struct formula, formula),
   .initial = NULL,
   .unit = "",
   .doc = "the element's text: an expression in `x`, `y`, `z` and the scene's parameters, after "
          "any number of `let name = expression;`"},
  {.name = "lipschitz",
   .type = ZS_NUMBER,
   .offset = offsetof(struct formula, lipschitz),
   .initial = "",
   .unit = "1",
   .range = ZS_RANGE_POSITIVE,
   .doc = "a promise that the value changes by no more than this per unit of length, for people "
          "and tools that read the scene; evaluation does not need it, since bounds come from "
          "the expression itself"},
};

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct formula *p = node->parameters;
  return zs_author_formula_emit(compiler, &p->formula, at, 0);
}

const zs_kind zs_kind_formula = {
  .name = "formula",
  .family = ZS_FAMILY_PRIMITIVE,
  .summary = "any function of x, y and z, written as an expression",
  .doc = "The solid is where the expression is not negative. Everything the expression language "
         "has may be used; trigonometric functions are in radians.",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct formula),
  .children = ZS_CHILDREN_NONE,
  .text = true,
  .emit = emit,
};
