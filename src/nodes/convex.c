/* Convex polyhedra, as intersections of half-spaces. */
#include "nodes/common.h"

#include <math.h>

/* ---- plane, a part ------------------------------------------------------------- */

struct plane {
  double normal[3], point[3], distance;
};

static const zs_attribute plane_attributes[] = {
  {.name = "normal",
   .type = ZS_VECTOR3,
   .offset = offsetof(struct plane, normal),
   .initial = NULL,
   .unit = "1",
   .doc = "direction out of the solid, of any length"},
  ZS_POINT(struct plane, point, "point", "0 0 0", "a point of the plane"),
  ZS_LENGTH(struct plane, distance, "distance", "", ZS_RANGE_ANY,
            "instead of `point`: how far the plane lies from the origin, in the direction of the "
            "normal"),
};

static bool plane_check(const zs_node *node, zs_diag *diag)
{
  const struct plane *p = node->parameters;
  if (zs_node_has(node, "point") && zs_node_has(node, "distance"))
    return zs_node_misuse(node, diag, "distance", "'distance' cannot be combined with 'point'");
  return zs_node_check_direction(node, diag, "normal", p->normal);
}

static const zs_kind plane = {
  .name = "plane",
  .family = ZS_FAMILY_PART,
  .summary = "a plane that the solid ends at",
  .attributes = plane_attributes,
  .attribute_count = ZS_COUNT_OF(plane_attributes),
  .parameters_size = sizeof(struct plane),
  .children = ZS_CHILDREN_NONE,
  .check = plane_check,
};
static const zs_kind *const parts[] = {&plane, NULL};

/* ---- convex -------------------------------------------------------------------- */

static bool check(const zs_node *node, zs_diag *diag)
{
  return node->child_count > 0 ||
         zs_node_misuse(node, diag, NULL, "there are no planes; expected <plane normal=\"...\"/> "
                        "for every face");
}

static zs_value plane_emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct plane *p = node->parameters;
  if (!zs_node_has(node, "distance"))
    return zs_emit_half_space(compiler, at, p->normal, p->point);
  const double length = hypot(hypot(p->normal[0], p->normal[1]), p->normal[2]);
  double point[3];
  for (int k = 0; k < 3; k++)
    point[k] = p->normal[k] / length * p->distance;
  return zs_emit_half_space(compiler, at, p->normal, point);
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  zs_value least = plane_emit(compiler, node->children[0], at);
  for (size_t i = 1; i < node->child_count; i++)
    least = zs_emit(compiler, ZS_FUNCTION_MINIMUM, least,
                    plane_emit(compiler, node->children[i], at), 0);
  return least;
}

const zs_kind zs_kind_convex = {
  .name = "convex",
  .family = ZS_FAMILY_PRIMITIVE,
  .summary = "the solid behind all of a number of planes: a convex polyhedron",
  .doc = "f is the distance to the nearest plane: exact inside and in front of faces, and less "
         "than the distance in front of edges and corners.",
  .trait = "distance bound",
  .parts = parts,
  .children = ZS_CHILDREN_NONE,
  .check = check,
  .emit = emit,
};
