#include "nodes/common.h"
#include "nodes/extent.h"
#include "nodes/probe.h"

#include <math.h>

/* ---- point, a part --------------------------------------------------------------- */

static const char *const words[] = {"through", NULL};

struct point {
  double at[3], value, radius;
};

static const zs_attribute point_attributes[] = {
  ZS_POINT(struct point, at, "at", NULL, "where f changes most"),
  {.name = "value",
   .type = ZS_NUMBER,
   .offset = offsetof(struct point, value),
   .initial = "through",
   .unit = "length",
   .choices = words,
   .doc = "what is taken from f there: above 0 the surface moves inward, below 0 outward; "
          "`through` is f itself, so that the surface comes to pass through the point"},
  ZS_LENGTH(struct point, radius, "radius", "1", ZS_RANGE_POSITIVE,
            "distance from the point at which half as much is taken"),
};

static const zs_kind point = {
  .name = "point",
  .family = ZS_FAMILY_PART,
  .summary = "where the child is pinched",
  .attributes = point_attributes,
  .attribute_count = ZS_COUNT_OF(point_attributes),
  .parameters_size = sizeof(struct point),
  .children = ZS_CHILDREN_NONE,
};
static const zs_kind *const parts[] = {&point, NULL};

/* ---- pinch ------------------------------------------------------------------------ */

/* What is taken at a point. */
static double amount(zs_compiler *compiler, const zs_node *node, const zs_node *part)
{
  const struct point *p = part->parameters;
  double value = p->value;
  if (!isnan(value))
    return value;
  if (!zs_probe_children(compiler, node, p->at, 1, &value))
    return 0;
  if (isnan(value))
    zs_report(zs_compiler_diag(compiler), ZS_WARNING, ZS_ERROR_GEOMETRY, &part->place, NULL,
              "the child's f is not a number here: the point has no effect without 'value'");
  return isfinite(value) ? value : 0; /* nothing and everything stay what they are */
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  zs_value f = zs_children_emit(compiler, node, at);
  const zs_value one = zs_emit_constant(compiler, 1);
  for (size_t i = 0; i < node->child_count; i++) {
    const zs_node *part = node->children[i];
    if (!zs_node_is_part(part))
      continue;
    const struct point *p = part->parameters;
    const double value = amount(compiler, node, part);
    const double s = 1 / p->radius;
    const double inverse[12] = {s, 0, 0, -p->at[0] * s, 0, s, 0, -p->at[1] * s,
                                0, 0, s, -p->at[2] * s};
    const zs_coordinates own = zs_coordinates_affine(at, inverse);
    zs_value sum = one;
    for (int k = 0; k < 3; k++)
      sum = zs_emit(compiler, ZS_FUNCTION_ADD, sum,
                    zs_emit(compiler, ZS_FUNCTION_SQUARE, zs_emit_coordinate(compiler, &own, k), 0,
                            0), 0);
    const zs_value taken =
      zs_emit(compiler, ZS_FUNCTION_DIVIDE, zs_emit_constant(compiler, value), sum, 0);
    f = zs_emit(compiler, ZS_FUNCTION_SUBTRACT, f, taken, 0);
  }
  return f;
}

/* What is added at a point that the surface goes through is no more than its distance from
 * the child's farthest corner. */
static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)count;
  double most = 0;
  for (size_t i = 0; i < node->child_count; i++) {
    const zs_node *part = node->children[i];
    if (!zs_node_is_part(part))
      continue;
    const struct point *p = part->parameters;
    double far = 0;
    for (int k = 0; k < 3; k++) {
      const double below = p->at[k] - children[0].lo[k], above = children[0].hi[k] - p->at[k];
      far = hypot(far, fmax(fabs(below), fabs(above)));
    }
    most += isnan(p->value) ? far : fmax(-p->value, 0);
  }
  return zs_box_grown(children[0], most);
}

const zs_kind zs_kind_pinch = {
  .name = "pinch",
  .family = ZS_FAMILY_FUNCTION_MAP,
  .summary = "the child with its surface pushed in, or pulled to points",
  .doc = "From f is taken the sum of value / (1 + |x - at|^2 / radius^2) over the points. It fades "
         "slowly: the surface passes through a point exactly only when the others are far away. "
         "For a surface through many points see `fit-points`.",
  .source = "V. Savchenko, A. Pasko, Transformation of functionally defined shapes by extended "
            "space mappings, 1998",
  .children = ZS_CHILDREN_ONE,
  .parts = parts,
  .emit = emit,
  .box = box,
};
