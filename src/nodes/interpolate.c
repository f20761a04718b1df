#include "nodes/common.h"

#include "field/blend.h"

/* ---- level, a part ----------------------------------------------------------- */

struct level {
  double at;
};

static const zs_attribute level_attributes[] = {
  ZS_LENGTH(struct level, at, "at", NULL, ZS_RANGE_ANY, "where on the axis the shape lies"),
};

static const zs_kind level = {
  .name = "level",
  .family = ZS_FAMILY_PART,
  .summary = "a shape, and where it lies",
  .attributes = level_attributes,
  .attribute_count = ZS_COUNT_OF(level_attributes),
  .parameters_size = sizeof(struct level),
  .children = ZS_CHILDREN_ONE,
};

static const zs_kind *const parts[] = {&level, NULL};

static double height_of(const zs_node *part)
{
  return ((const struct level *)part->parameters)->at;
}

/* ---- interpolate ----------------------------------------------------------- */

enum { CLOSED, OPEN };
static const char *const methods[] = {"linear", NULL};
static const char *const caps[] = {"closed", "open", NULL};

struct interpolate {
  int axis, method, caps;
};

static const zs_attribute attributes[] = {
  ZS_AXIS(struct interpolate, axis,
          "direction in which the levels follow each other; the shapes' plane is across it"),
  ZS_SELECT(struct interpolate, method, "method", "linear", methods,
            "`linear`: f of the two levels beside the point, weighted by how near they are"),
  ZS_SELECT(struct interpolate, caps, "caps", "closed", caps,
            "`closed`: the solid ends at the first and the last level; `open`: it goes on as they "
            "are"),
};

static bool check(const zs_node *node, zs_diag *diag)
{
  const zs_node *before = NULL;
  size_t count = 0;
  for (size_t i = 0; i < node->child_count; i++) {
    const zs_node *part = node->children[i];
    if (part->kind != &level)
      continue;
    if (before && !(height_of(before) < height_of(part)))
      return zs_node_fail(part, diag, "at", "%g does not lie beyond the level before, at %g",
                          height_of(part), height_of(before));
    before = part;
    count++;
  }
  if (count < 2)
    return zs_node_misuse(node, diag, NULL, "found %zu of at least 2 levels", count);
  return true;
}

/* The relative position of z between two heights. */
static zs_value position(zs_compiler *compiler, const zs_coordinates *along, double from,
                         double to)
{
  const double row[12] = {0, 0, 1 / (to - from), -from / (to - from)};
  zs_coordinates relative = zs_coordinates_affine(along, row);
  return zs_emit_coordinate(compiler, &relative, 0);
}

/* f folded over the levels: above a level everything before it has faded, and
 * below it nothing has changed yet. */
static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct interpolate *p = node->parameters;
  zs_coordinates along = zs_coordinates_along(at, p->axis);
  const zs_node *first = NULL, *before = NULL;
  zs_value f = 0;
  for (size_t i = 0; i < node->child_count; i++) {
    const zs_node *part = node->children[i];
    if (part->kind != &level)
      continue;
    zs_value shape = zs_children_emit(compiler, part, &along);
    if (before)
      f = zs_emit_operation(compiler, &zs_interpolation, NULL, f, shape,
                            position(compiler, &along, height_of(before), height_of(part)));
    else
      f = shape;
    first = first ? first : part;
    before = part;
  }
  if (p->caps == OPEN || !before)
    return f;
  const double lo = height_of(first), hi = height_of(before);
  zs_value z = zs_emit_coordinate(compiler, &along, 2);
  zs_value centred = zs_emit(compiler, ZS_FUNCTION_SUBTRACT, z,
                             zs_emit_constant(compiler, lo + (hi - lo) / 2), 0);
  zs_value slab = zs_emit(compiler, ZS_FUNCTION_SUBTRACT,
                          zs_emit_constant(compiler, (hi - lo) / 2),
                          zs_emit(compiler, ZS_FUNCTION_ABSOLUTE, centred, 0, 0), 0);
  return zs_emit(compiler, ZS_FUNCTION_MINIMUM, f, slab, 0);
}

const zs_kind zs_kind_interpolate = {
  .name = "interpolate",
  .family = ZS_FAMILY_INTERPOLATION,
  .summary = "shapes on levels along an axis, joined into one solid",
  .doc = "Between two levels with values f1 and f2, f is (1 - t) f1 + t f2, with t growing from 0 "
         "to 1. Closed ends are cut by the slab between the first and the last level.",
  .source = "B. Payne, A. Toga, Distance field manipulation of surface models, 1992; J. Parulek, "
            "M. Sramek, Implicit modeling by metamorphosis of 2D shapes, 2007, equation 9",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct interpolate),
  .children = ZS_CHILDREN_NONE,
  .parts = parts,
  .check = check,
  .emit = emit,
};
