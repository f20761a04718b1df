#include "nodes/common.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

const char *const zs_axis_names[] = {"x", "y", "z", NULL};

/* Row i of the turned coordinates is coordinate (i + shift) mod 3. */
static zs_coordinates permuted(const zs_coordinates *at, int shift)
{
  double matrix[12] = {0};
  for (int i = 0; i < 3; i++)
    matrix[4 * i + (i + shift) % 3] = 1;
  return zs_coordinates_affine(at, matrix);
}

zs_coordinates zs_coordinates_along(const zs_coordinates *at, int axis)
{
  return permuted(at, (axis + 1) % 3);
}

zs_coordinates zs_coordinates_back(const zs_coordinates *at, int axis)
{
  return permuted(at, 2 - axis);
}

int zs_node_toward(const zs_node *node, int axis, int toward)
{
  return axis == 0 && !zs_node_has(node, "toward") ? 2 : toward;
}

bool zs_node_check_toward(const zs_node *node, zs_diag *diag, int axis, int toward)
{
  if (zs_node_toward(node, axis, toward) != axis)
    return true;
  return zs_node_fail(node, diag, "toward", "'%s' is the axis itself; expected another",
                      zs_axis_names[axis]);
}

double *zs_coordinates_to_scene(zs_compiler *compiler, const zs_coordinates *at,
                                const double *points, size_t count)
{
  double to_scene[12];
  if (!at->root || !zs_affine_invert(at->matrix, to_scene))
    return NULL;
  double *scene = ZS_ARENA_NEW(zs_compiler_arena(compiler), double, 3 * count);
  if (!scene)
    zs_fail_memory(zs_compiler_diag(compiler));
  for (size_t i = 0; scene && i < count; i++)
    for (size_t k = 0; k < 3; k++) {
      const double *row = to_scene + 4 * k, *p = points + 3 * i;
      scene[3 * i + k] = row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3];
    }
  return scene;
}

zs_coordinates zs_coordinates_moved(const zs_coordinates *at, const double origin[3])
{
  const double matrix[12] = {1, 0, 0, -origin[0], 0, 1, 0, -origin[1], 0, 0, 1, -origin[2]};
  return zs_coordinates_affine(at, matrix);
}

bool zs_node_has(const zs_node *node, const char *attribute)
{
  const zs_kind *kind = node->kind;
  for (size_t i = 0; i < kind->attribute_count; i++)
    if (!strcmp(kind->attributes[i].name, attribute))
      return node->given >> i & 1;
  return false;
}

static void report(const zs_node *node, zs_diag *diag, zs_status status, const char *attribute,
                   const char *format, va_list arguments)
{
  char message[256];
  vsnprintf(message, sizeof message, format, arguments);
  zs_place place = attribute ? zs_node_place(node, attribute) : node->place;
  zs_report(diag, ZS_ERROR, status, &place, NULL, "%s", message);
}

bool zs_node_fail(const zs_node *node, zs_diag *diag, const char *attribute, const char *format,
                  ...)
{
  va_list arguments;
  va_start(arguments, format);
  report(node, diag, ZS_ERROR_GEOMETRY, attribute, format, arguments);
  va_end(arguments);
  return false;
}

bool zs_node_misuse(const zs_node *node, zs_diag *diag, const char *attribute, const char *format,
                    ...)
{
  va_list arguments;
  va_start(arguments, format);
  report(node, diag, ZS_ERROR_SCHEMA, attribute, format, arguments);
  va_end(arguments);
  return false;
}

bool zs_node_check_order(const zs_node *node, zs_diag *diag, const char *lower_name,
                         const double *lower, const char *upper_name, const double *upper,
                         int count)
{
  for (int i = 0; i < count; i++)
    if (!(lower[i] < upper[i]))
      return zs_node_fail(node, diag, upper_name, "%g is not greater than '%s', which is %g",
                          upper[i], lower_name, lower[i]);
  return true;
}

bool zs_node_check_direction(const zs_node *node, zs_diag *diag, const char *name,
                             const double direction[3])
{
  if (direction[0] != 0 || direction[1] != 0 || direction[2] != 0)
    return true;
  return zs_node_fail(node, diag, name,
                      "'0 0 0' has no direction; expected a vector that is not 0");
}

bool zs_node_check_span(const zs_node *node, zs_diag *diag, const char *single,
                        const char *lower_name, const char *upper_name)
{
  bool has_single = zs_node_has(node, single);
  bool has_lower = zs_node_has(node, lower_name), has_upper = zs_node_has(node, upper_name);
  if (has_single && (has_lower || has_upper))
    return zs_node_misuse(node, diag, single, "'%s' cannot be combined with '%s' and '%s'", single,
                          lower_name, upper_name);
  if (has_lower != has_upper)
    return zs_node_misuse(node, diag, has_lower ? lower_name : upper_name,
                        "'%s' is missing; '%s' and '%s' are given together",
                        has_lower ? upper_name : lower_name, lower_name, upper_name);
  if (!has_single && !has_lower)
    return zs_node_misuse(node, diag, NULL, "expected '%s', or '%s' and '%s'", single, lower_name,
                        upper_name);
  return true;
}

zs_value zs_children_fold(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at,
                          zs_combine *combine)
{
  zs_value value = 0;
  bool first = true;
  for (size_t i = 0; i < node->child_count; i++) {
    if (zs_node_is_part(node->children[i]))
      continue;
    zs_value child = zs_node_emit(compiler, node->children[i], at);
    value = first ? child : combine(compiler, node, value, child);
    first = false;
  }
  return value;
}

/* One row of an affine map. */
zs_value zs_emit_half_space(zs_compiler *compiler, const zs_coordinates *at,
                            const double normal[3], const double point[3])
{
  const double length = hypot(hypot(normal[0], normal[1]), normal[2]);
  double row[12] = {0};
  for (int i = 0; i < 3; i++) {
    row[i] = -normal[i] / length;
    row[3] += normal[i] / length * point[i];
  }
  const zs_coordinates across = zs_coordinates_affine(at, row);
  return zs_emit_coordinate(compiler, &across, 0);
}

zs_value zs_emit_scaled(zs_compiler *compiler, zs_value value, double factor)
{
  if (factor == 1)
    return value;
  if (factor == 0)
    return zs_emit_constant(compiler, 0);
  return zs_emit(compiler, ZS_FUNCTION_MULTIPLY, value, zs_emit_constant(compiler, factor), 0);
}

zs_value zs_emit_cut(zs_compiler *compiler, zs_value f, const zs_coordinates *at, double lo,
                     double hi)
{
  /* The ends themselves are inside, whichever way coordinates are rounded there. */
  const double rounding = 2.5e-7 * fmax(fabs(lo), fabs(hi));
  zs_value centred = zs_emit(compiler, ZS_FUNCTION_SUBTRACT, zs_emit_coordinate(compiler, at, 2),
                             zs_emit_constant(compiler, lo + (hi - lo) / 2), 0);
  zs_value slab = zs_emit(compiler, ZS_FUNCTION_SUBTRACT,
                          zs_emit_constant(compiler, (hi - lo) / 2 + rounding),
                          zs_emit(compiler, ZS_FUNCTION_ABSOLUTE, centred, 0, 0), 0);
  return zs_emit(compiler, ZS_FUNCTION_MINIMUM, f, slab, 0);
}

zs_value zs_emit_extruded(zs_compiler *compiler, zs_value f, zs_value z_distance)
{
  zs_value zero = zs_emit_constant(compiler, 0), d = zs_emit_negated(compiler, f);
  zs_value inner = zs_emit(compiler, ZS_FUNCTION_MAXIMUM, d, z_distance, 0);
  zs_value outer = zs_emit(compiler, ZS_FUNCTION_HYPOT,
                           zs_emit(compiler, ZS_FUNCTION_MAXIMUM, d, zero, 0),
                           zs_emit(compiler, ZS_FUNCTION_MAXIMUM, z_distance, zero, 0), 0);
  zs_value sum = zs_emit(compiler, ZS_FUNCTION_ADD,
                         zs_emit(compiler, ZS_FUNCTION_MINIMUM, inner, zero, 0), outer, 0);
  return zs_emit_negated(compiler, sum);
}

void zs_correspondence_tell(zs_compiler *compiler, zs_correspondence *correspondence,
                            double *places, const double heights[2],
                            const zs_coordinates *along)
{
  zs_correspondence *c = correspondence;
  const size_t count = c->count * c->places;
  for (size_t k = 0; k < 2; k++)
    memcpy(places + 3 * (count + k), (const double[3]){0, 0, heights[k]}, 3 * sizeof *places);
  const double *ways = zs_coordinates_to_scene(compiler, along, places, count + 2);
  const double *up = along->matrix + 8;
  const double length = hypot(hypot(up[0], up[1]), up[2]);
  for (size_t k = 0; ways && k < 3; k++) {
    c->plane[0][k] = ways[3 * count + k];
    c->plane[1][k] = ways[3 * (count + 1) + k];
    c->normal[k] = up[k] / length;
  }
  c->ways = ways;
  zs_compiler_add_correspondence(compiler, c);
}
