#include "nodes/common.h"

struct map {
  zs_formula coordinate[3], value;
};

#define FORMULA(member, name_, doc_) \
  {.name = name_, .type = ZS_FORMULA, .offset = offsetof(struct map, member), .initial = "", \
   .unit = "", .doc = doc_}

static const zs_attribute attributes[] = {
  FORMULA(coordinate[0], "x", "x of the point where the child is evaluated; left out: x"),
  FORMULA(coordinate[1], "y", "y of that point"),
  FORMULA(coordinate[2], "z", "z of that point"),
  FORMULA(value, "value", "the result, of `f` at that point and of x, y, z; left out: f"),
};

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct map *p = node->parameters;
  zs_coordinates child = *at;
  if (p->coordinate[0].expression || p->coordinate[1].expression || p->coordinate[2].expression) {
    zs_value v[3];
    for (int i = 0; i < 3; i++)
      v[i] = p->coordinate[i].expression
               ? zs_author_formula_emit(compiler, &p->coordinate[i], at, 0)
               : zs_emit_coordinate(compiler, at, i);
    child = zs_coordinates_from(v[0], v[1], v[2]);
  }
  zs_value f = zs_children_emit(compiler, node, &child);
  return p->value.expression ? zs_author_formula_emit(compiler, &p->value, at, f) : f;
}

const zs_kind zs_kind_map = {
  .name = "map",
  .family = ZS_FAMILY_COORDINATE_MAP,
  .summary = "any extended space mapping, written as formulas",
  .doc = "`x`, `y` and `z` give the inverse coordinate map: the point at which the child is "
         "evaluated. `value` gives the function map. All are formulas in x, y, z, the scene's "
         "parameters and, for `value`, f.",
  .source = "V. Savchenko, A. Pasko, Transformation of functionally defined shapes by extended "
            "space mappings, 1998",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct map),
  .children = ZS_CHILDREN_ONE,
  .emit = emit,
};
