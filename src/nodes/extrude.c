#include "nodes/common.h"

#include <math.h>

struct extrude {
  double height, min, max, twist, end_scale;
  int axis;
};

static const zs_attribute attributes[] = {
  ZS_LENGTH(struct extrude, height, "height", "", ZS_RANGE_POSITIVE,
            "length of the solid, centred on the origin"),
  ZS_LENGTH(struct extrude, min, "min", "", ZS_RANGE_ANY,
            "where the solid begins on the axis, with `max`, instead of `height`"),
  ZS_LENGTH(struct extrude, max, "max", "", ZS_RANGE_ANY, "where it ends"),
  ZS_ANGLE(struct extrude, twist, "twist", "0",
           "turn of the shape between the two ends, counter-clockwise seen from the upper one"),
  ZS_PLAIN(struct extrude, end_scale, "end-scale", "1", ZS_RANGE_NOT_NEGATIVE,
           "size of the shape at the upper end, 1 at the lower; 0 comes to a point"),
  ZS_AXIS(struct extrude, axis, "direction of the extrusion; the shape's plane is across it"),
};

static bool check(const zs_node *node, zs_diag *diag)
{
  const struct extrude *p = node->parameters;
  if (!zs_node_check_span(node, diag, "height", "min", "max"))
    return false;
  return zs_node_has(node, "height") ||
         zs_node_check_order(node, diag, "min", &p->min, "max", &p->max, 1);
}

static zs_value call(zs_compiler *c, zs_function function, zs_value a, zs_value b)
{
  return zs_emit(c, function, a, b, 0);
}

/* The coordinates turned and shrunk back to the lower end's; `size` becomes the
 * size of the shape where the point is. */
static zs_coordinates unwound(zs_compiler *c, const struct extrude *p, const zs_coordinates *at,
                              zs_value t, zs_value *size)
{
  zs_value x = zs_emit_coordinate(c, at, 0), y = zs_emit_coordinate(c, at, 1);
  if (p->twist != 0) {
    zs_value angle = zs_emit_scaled(c, t, p->twist * 3.14159265358979323846 / 180);
    zs_value cosine = call(c, ZS_FUNCTION_COSINE, angle, 0);
    zs_value sine = call(c, ZS_FUNCTION_SINE, angle, 0);
    zs_value u = call(c, ZS_FUNCTION_ADD, call(c, ZS_FUNCTION_MULTIPLY, x, cosine),
                      call(c, ZS_FUNCTION_MULTIPLY, y, sine));
    y = call(c, ZS_FUNCTION_SUBTRACT, call(c, ZS_FUNCTION_MULTIPLY, y, cosine),
             call(c, ZS_FUNCTION_MULTIPLY, x, sine));
    x = u;
  }
  if (p->end_scale != 1) {
    *size = call(c, ZS_FUNCTION_ADD, zs_emit_constant(c, 1),
                 zs_emit_scaled(c, t, p->end_scale - 1));
    /* At the point of a pyramid the shape has no size to divide by. */
    *size = call(c, ZS_FUNCTION_MAXIMUM, *size, zs_emit_constant(c, 1e-6));
    x = call(c, ZS_FUNCTION_DIVIDE, x, *size);
    y = call(c, ZS_FUNCTION_DIVIDE, y, *size);
  }
  return zs_coordinates_from(x, y, zs_emit_coordinate(c, at, 2));
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct extrude *p = node->parameters;
  const bool centred = zs_node_has(node, "height");
  const double height = centred ? p->height : p->max - p->min;
  const double middle[3] = {0, 0, centred ? 0 : p->min + height / 2};
  zs_coordinates along = zs_coordinates_along(at, p->axis);
  zs_coordinates moved = zs_coordinates_moved(&along, middle);
  zs_value z = zs_emit_coordinate(compiler, &moved, 2);
  zs_value f;
  if (p->twist == 0 && p->end_scale == 1) {
    f = zs_children_emit(compiler, node, &along);
  } else {
    /* How far up the point is, from 0 to 1. */
    const double row[12] = {0, 0, 1 / height, 0.5};
    zs_coordinates relative = zs_coordinates_affine(&moved, row);
    zs_value t = zs_emit_coordinate(compiler, &relative, 0);
    t = call(compiler, ZS_FUNCTION_MAXIMUM, t, zs_emit_constant(compiler, 0));
    t = call(compiler, ZS_FUNCTION_MINIMUM, t, zs_emit_constant(compiler, 1));
    zs_value size = zs_emit_constant(compiler, 1);
    zs_coordinates shape = unwound(compiler, p, &along, t, &size);
    f = zs_children_emit(compiler, node, &shape);
    f = call(compiler, ZS_FUNCTION_MULTIPLY, f, size);
  }
  zs_value beyond = call(compiler, ZS_FUNCTION_SUBTRACT, call(compiler, ZS_FUNCTION_ABSOLUTE, z, 0),
                         zs_emit_constant(compiler, height / 2));
  return zs_emit_extruded(compiler, f, beyond);
}

/* A turned shape may be anywhere in a circle. */
static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)count;
  const struct extrude *p = node->parameters;
  const int x = (p->axis + 1) % 3, y = (p->axis + 2) % 3;
  const bool centred = zs_node_has(node, "height");
  zs_box shape = children[0], all;
  const double grown = fmax(1, p->end_scale);
  const double radius =
    hypot(fmax(-shape.lo[0], shape.hi[0]), fmax(-shape.lo[1], shape.hi[1]));
  for (int k = 0; k < 2; k++) {
    /* Where the shape shrinks it may leave its box towards the axis. */
    shape.lo[k] = p->end_scale == 1 ? shape.lo[k] : grown * fmin(shape.lo[k], 0);
    shape.hi[k] = p->end_scale == 1 ? shape.hi[k] : grown * fmax(shape.hi[k], 0);
  }
  all.lo[x] = p->twist == 0 ? shape.lo[0] : -grown * radius;
  all.hi[x] = p->twist == 0 ? shape.hi[0] : grown * radius;
  all.lo[y] = p->twist == 0 ? shape.lo[1] : -grown * radius;
  all.hi[y] = p->twist == 0 ? shape.hi[1] : grown * radius;
  all.lo[p->axis] = centred ? -p->height / 2 : p->min;
  all.hi[p->axis] = centred ? p->height / 2 : p->max;
  return all;
}

const zs_kind zs_kind_extrude = {
  .name = "extrude",
  .family = ZS_FAMILY_SOLID_FROM_SHAPE,
  .summary = "a shape drawn out along an axis, optionally twisted and scaled",
  .doc = "With d = -f of the shape, and e the distance beyond the nearer end, f is "
         "-(min(max(d, e), 0) + hypot(max(d, 0), max(e, 0))); the shape is taken at the point "
         "turned and scaled back, and its f multiplied by the scale.",
  .trait = "exact distance if the shape's is one, and without twist and end-scale",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct extrude),
  .children = ZS_CHILDREN_ONE,
  .check = check,
  .emit = emit,
  .box = box,
};
