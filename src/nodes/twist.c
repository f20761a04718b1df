#include "nodes/common.h"
#include "nodes/extent.h"

#include <math.h>

struct twist {
  double rate, from, to, angle;
  int axis;
};

static const zs_attribute attributes[] = {
  ZS_AXIS(struct twist, axis, "axis of the twist"),
  {.name = "rate",
   .type = ZS_NUMBER,
   .offset = offsetof(struct twist, rate),
   .initial = "",
   .unit = "degrees per length",
   .doc = "turn per unit of length along the axis, everywhere"},
  ZS_LENGTH(struct twist, from, "from", "", ZS_RANGE_ANY,
            "with `to` and `angle`, instead of `rate`: where the twist begins"),
  ZS_LENGTH(struct twist, to, "to", "", ZS_RANGE_ANY, "where it ends"),
  ZS_ANGLE(struct twist, angle, "angle", "",
           "turn of everything beyond `to`; what lies before `from` stays"),
};

static bool check(const zs_node *node, zs_diag *diag)
{
  const struct twist *p = node->parameters;
  if (!zs_node_check_span(node, diag, "rate", "from", "to"))
    return false;
  bool has_rate = zs_node_has(node, "rate"), has_angle = zs_node_has(node, "angle");
  if (has_rate && has_angle)
    return zs_node_misuse(node, diag, "angle", "'angle' cannot be combined with 'rate'");
  if (has_rate)
    return true;
  if (!has_angle)
    return zs_node_misuse(node, diag, NULL,
                          "'angle' is missing; expected it beside 'from' and 'to'");
  return zs_node_check_order(node, diag, "from", &p->from, "to", &p->to, 1);
}

/* The turn grows evenly from 0 at `from` to `angle` at `to`. */
#define TURN "let t = rad(angle) * clamp((z - from) / (to - from), 0, 1); "
static const char *const between[] = {TURN "x * cos(t) + y * sin(t)",
                                      TURN "y * cos(t) - x * sin(t)"};

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  if (zs_node_has(node, "rate"))
    return zs_kind_emit(compiler, node, at);
  const struct twist *p = node->parameters;
  zs_coordinates along = zs_coordinates_along(at, p->axis);
  zs_coordinates child =
    zs_coordinates_from(zs_formula_emit(compiler, node, between[0], &along, 0, 0),
                        zs_formula_emit(compiler, node, between[1], &along, 0, 0),
                        zs_emit_coordinate(compiler, &along, 2));
  child = zs_coordinates_back(&child, p->axis);
  return zs_children_emit(compiler, node, &child);
}

/* Every cross-section may turn any way. */
static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)count;
  const struct twist *p = node->parameters;
  const int x = (p->axis + 1) % 3, y = (p->axis + 2) % 3;
  zs_box all = children[0];
  double radius = hypot(fmax(-all.lo[x], all.hi[x]), fmax(-all.lo[y], all.hi[y]));
  all.lo[x] = all.lo[y] = -radius;
  all.hi[x] = all.hi[y] = radius;
  return all;
}

const zs_kind zs_kind_twist = {
  .name = "twist",
  .family = ZS_FAMILY_COORDINATE_MAP,
  .summary = "the child twisted about an axis",
  .doc = "With `from`, `to` and `angle` the turn at z is angle * clamp((z - from) / (to - from), "
         "0, 1). Positive angles turn counter-clockwise, seen from the axis' positive end.",
  .source = "A. Barr, Global and local deformations of solid primitives, 1984",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct twist),
  .children = ZS_CHILDREN_ONE,
  .map = {"let t = rad(rate * z); x * cos(t) + y * sin(t)",
          "let t = rad(rate * z); y * cos(t) - x * sin(t)", "z"},
  .check = check,
  .emit = emit,
  .box = box,
};
