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

/* Coordinates from the segment's middle, z along it. */
static zs_value fused(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct capsule *p = node->parameters;
  double w[3], middle[3];
  for (int i = 0; i < 3; i++) {
    w[i] = p->to[i] - p->from[i];
    middle[i] = p->from[i] + w[i] / 2;
  }
  const double length = hypot(hypot(w[0], w[1]), w[2]);
  zs_coordinates along = zs_coordinates_moved(at, middle);
  if (length > 0) {
    double u[3], v[3];
    for (int i = 0; i < 3; i++)
      w[i] /= length;
    complete_frame(w, u, v);
    const double turn[12] = {u[0], u[1], u[2], 0, v[0], v[1], v[2], 0, w[0], w[1], w[2], 0};
    along = zs_coordinates_affine(&along, turn);
  }
  return zs_emit_primitive(compiler, ZS_PRIMITIVE_CAPSULE, (double[4]){p->radius, length / 2},
                           &along);
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
  .fused = fused,
};
