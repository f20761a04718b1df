/* What several node kinds share. */
#ifndef ZS_NODES_COMMON_H
#define ZS_NODES_COMMON_H

#include "nodes/kind.h"

/* ---- Axes ---------------------------------------------------------------- */

/* "x", "y", "z": the choices of an attribute `axis`. */
extern const char *const zs_axis_names[];

#define ZS_AXIS(struct_, member, doc_) \
  ZS_SELECT(struct_, member, "axis", "z", zs_axis_names, doc_)

/* Coordinates turned (cyclically permuted) so that their z runs along `axis`. */
zs_coordinates zs_coordinates_along(const zs_coordinates *at, int axis);
/* The way back. */
zs_coordinates zs_coordinates_back(const zs_coordinates *at, int axis);

/* A second axis that an `axis` leans to: x, or z where the axis is x, when not written. */
#define ZS_TOWARD(struct_, member, doc_) \
  ZS_SELECT(struct_, member, "toward", "x", zs_axis_names, doc_)

/* Check that `toward` is another axis than `axis`. */
bool zs_node_check_toward(const zs_node *node, zs_diag *diag, int axis, int toward);
int zs_node_toward(const zs_node *node, int axis, int toward);

/* Coordinates whose origin is at `origin`. */
zs_coordinates zs_coordinates_moved(const zs_coordinates *at, const double origin[3]);

/* Where points of some coordinates (x, y, z triples) are in the scene, for as long as the field;
 * NULL where no affine map leads there, or memory is out. */
double *zs_coordinates_to_scene(zs_compiler *compiler, const zs_coordinates *at,
                                const double *points, size_t count);

/* Tell in the field of what becomes what between two levels, which lie at these heights across z
 * of `along`.  `places`: the ways there, and room for two more places. */
void zs_correspondence_tell(zs_compiler *compiler, zs_correspondence *correspondence,
                            double *places, const double heights[2],
                            const zs_coordinates *along);

/* Invert a 3 x 4 affine matrix; false when it is singular to working
 * precision. */
bool zs_affine_invert(const double matrix[12], double inverse[12]);

/* ---- Nodes --------------------------------------------------------------- */

/* Whether an attribute was written. */
bool zs_node_has(const zs_node *node, const char *attribute);

/* True for a node, false for a part of its parent. */
static inline bool zs_node_is_part(const zs_node *node)
{
  return node->kind->family == ZS_FAMILY_PART;
}

/* Report about an attribute, or the whole element (NULL); both return false.
 * zs_node_fail: what is written describes nothing that can exist.
 * zs_node_misuse: it is not how the attributes are used. */
bool zs_node_fail(const zs_node *node, zs_diag *diag, const char *attribute, const char *format,
                  ...) __attribute__((format(printf, 4, 5)));
bool zs_node_misuse(const zs_node *node, zs_diag *diag, const char *attribute, const char *format,
                    ...) __attribute__((format(printf, 4, 5)));

/* Check `from` < `to` or min < max, component by component. */
bool zs_node_check_order(const zs_node *node, zs_diag *diag, const char *lower_name,
                         const double *lower, const char *upper_name, const double *upper,
                         int count);

/* Check that a direction is not 0 0 0. */
bool zs_node_check_direction(const zs_node *node, zs_diag *diag, const char *name,
                             const double direction[3]);

/* Either one attribute or a pair must be written, and the pair only together:
 * "height" or "min" and "max". */
bool zs_node_check_span(const zs_node *node, zs_diag *diag, const char *single,
                        const char *lower_name, const char *upper_name);

/* ---- Values -------------------------------------------------------------- */

/* Fold the child nodes from the left.  `first` is the value of the first child,
 * `combine` joins the value so far and that of a later child. */
typedef zs_value zs_combine(zs_compiler *compiler, const zs_node *node, zs_value a, zs_value b);
zs_value zs_children_fold(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at,
                          zs_combine *combine);

static inline zs_value zs_emit_negated(zs_compiler *compiler, zs_value a)
{
  return zs_emit(compiler, ZS_FUNCTION_NEGATE, a, 0, 0);
}

/* The distance into the half-space whose outward normal, of any length, stands on a point. */
zs_value zs_emit_half_space(zs_compiler *compiler, const zs_coordinates *at,
                            const double normal[3], const double point[3]);

/* value * factor: the value itself for 1, and 0 for 0, whatever the value. */
zs_value zs_emit_scaled(zs_compiler *compiler, zs_value value, double factor);

/* The smaller of f and the distance to the slab lo <= z <= hi in `at`'s coordinates. */
zs_value zs_emit_cut(zs_compiler *compiler, zs_value f, const zs_coordinates *at, double lo,
                     double hi);

/* f cut by the slab lo <= z <= hi, in `at`'s coordinates, as an exact distance
 * when `f` is one that does not depend on z. */
zs_value zs_emit_extruded(zs_compiler *compiler, zs_value f, zs_value z_distance);

#endif
