#include "nodes/common.h"

#include <math.h>

struct capsule {
  double from[3], to[3];
  double radius;
};

static const zs_attribute attributes[] = {
  ZS_POINT(struct capsule, from, "from", NULL, "one end of the segment"),
  ZS_POINT(struct capsule, to, "to", NULL, "the other end; may be the same point"),
  ZS_LENGTH(struct capsule, radius, "radius", "1", ZS_RANGE_POSITIVE,
            "distance from the segment to the surface"),
};

/* Unit vectors u, v across the unit vector w, and w: a right-handed frame. */
static void complete_frame(const double w[3], double u[3], double v[3])
{
  int least = fabs(w[0]) <= fabs(w[1]) && fabs(w[0]) <= fabs(w[2]) ? 0
              : fabs(w[1]) <= fabs(w[2])                           ? 1
                                                                   : 2;
  double length = 0;
  for (int i = 0; i < 3; i++) {
    u[i] = (i == least) - w[least] * w[i];
    length += u[i] * u[i];
  }
  length = sqrt(length);
  for (int i = 0; i < 3; i++)
    u[i] /= length;
  for (int i = 0; i < 3; i++)
    v[i] = w[(i + 1) % 3] * u[(i + 2) % 3] - w[(i + 2) % 3] * u[(i + 1) % 3];
}

/* In coordinates whose z runs along the segment the clamped projection is one
 * clamp, and the rotation costs nothing. */
static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct capsule *p = node->parameters;
  double w[3] = {p->to[0] - p->from[0], p->to[1] - p->from[1], p->to[2] - p->from[2]};
  const double length = hypot(hypot(w[0], w[1]), w[2]);
  zs_coordinates moved = zs_coordinates_moved(at, p->from);
  if (length > 0) {
    double u[3], v[3];
    for (int i = 0; i < 3; i++)
      w[i] /= length;
    complete_frame(w, u, v);
    const double turn[12] = {u[0], u[1], u[2], 0, v[0], v[1], v[2], 0, w[0], w[1], w[2], 0};
    moved = zs_coordinates_affine(&moved, turn);
  }
  zs_value x = zs_emit_coordinate(compiler, &moved, 0), y = zs_emit_coordinate(compiler, &moved, 1);
  zs_value z = zs_emit_coordinate(compiler, &moved, 2);
  /* How far z is outside [0, length]; its sign does not matter. */
  zs_value half = zs_emit_constant(compiler, length / 2);
  zs_value beyond = zs_emit(
    compiler, ZS_FUNCTION_MAXIMUM,
    zs_emit(compiler, ZS_FUNCTION_SUBTRACT,
            zs_emit(compiler, ZS_FUNCTION_ABSOLUTE,
                    zs_emit(compiler, ZS_FUNCTION_SUBTRACT, z, half, 0), 0, 0),
            half, 0),
    zs_emit_constant(compiler, 0), 0);
  zs_value across = zs_emit(compiler, ZS_FUNCTION_HYPOT, x, y, 0);
  return zs_emit(compiler, ZS_FUNCTION_SUBTRACT, zs_emit_constant(compiler, p->radius),
                 zs_emit(compiler, ZS_FUNCTION_HYPOT, across, beyond, 0), 0);
}

const zs_kind zs_kind_capsule = {
  .name = "capsule",
  .family = ZS_FAMILY_PRIMITIVE,
  .summary = "all points within a distance of a segment",
  .trait = "exact distance",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct capsule),
  .children = ZS_CHILDREN_NONE,
  .formula = "let u = to.x - from.x; let v = to.y - from.y; let w = to.z - from.z; "
             "let l = max(u^2 + v^2 + w^2, 1e-300); "
             "let t = clamp(((x - from.x) * u + (y - from.y) * v + (z - from.z) * w) / l, 0, 1); "
             "radius - hypot(hypot(x - from.x - t * u, y - from.y - t * v), z - from.z - t * w)",
  .emit = emit,
};
