/* Inside <interpolate>: what stands between two levels. */
#ifndef ZS_NODES_INTERPOLATE_H
#define ZS_NODES_INTERPOLATE_H

#include "nodes/common.h"
#include "nodes/space_time.h"
#include "rbf/flow.h"

/* <level>: a shape. */
extern const zs_kind zs_interpolate_level;
/* <between>: pairs, weights and filling of one gap, and its <pair>. */
extern const zs_kind zs_interpolate_between, zs_interpolate_pair;

/* How shapes move in a gap. */
typedef enum zs_interpolate_centers { ZS_CENTERS_MOVING, ZS_CENTERS_FIXED } zs_interpolate_centers;

/* Whether a <between> says nothing that only space-time blends have a use for, or everything
 * but them; reports what does. */
bool zs_between_check_method(const zs_node *between, bool space_time, zs_diag *diag);

/* Whether a <between> leaves slopes at its levels as they are; reports what does not. */
bool zs_between_check_smooth(const zs_node *between, zs_diag *diag);

/* How far the shapes of a gap have moved (0 .. 1) at the part t of the way between its
 * levels, 0 <= t <= 1; how much the upper one counts; and how much filling there is. */
zs_value zs_between_motion(zs_compiler *compiler, const zs_node *between, zs_value t);
zs_value zs_between_weight(zs_compiler *compiler, const zs_node *between, zs_value t);
zs_value zs_between_filling(zs_compiler *compiler, const zs_node *between, zs_value t);

/* The blend in a gap of a length, by heights over the lower level; `between` may be NULL. */
zs_space_time zs_between_space_time(const zs_node *between, double length);

/* Whether its pairs are to be found; the time that pairs move by, `common` where it has none
 * of its own. */
bool zs_between_is_auto(const zs_node *between);
double zs_between_time(const zs_node *between, double common);

/* The displacements of a gap's lower (0) and upper (1) shape; NULL where there are none. */
typedef struct zs_between_flows {
  zs_interpolate_centers centers;
  const zs_flow *side[2];
  const zs_flow_path *paths; /* that they follow */
  size_t count;
} zs_between_flows;

/* Those of a <between>, which may be NULL, from one of two levels to the other, for as long
 * as the field.  `time` as for zs_between_time.  Reports pairs that cannot be followed. */
zs_between_flows zs_between_flows_make(zs_compiler *compiler, const zs_node *between,
                                       const zs_node *const levels[2],
                                       zs_interpolate_centers centers, double time);

/* Tell of them in the field (zs_field_correspondence).  `along`: where the interpolation is, with
 * the levels across z. */
void zs_between_flows_tell(zs_compiler *compiler, const zs_node *between,
                           const zs_node *const levels[2], const zs_between_flows *flows,
                           const zs_coordinates *along);

/* Where to evaluate one of a gap's shapes at a point when the shapes have moved by
 * `motion`. */
zs_coordinates zs_between_warp(zs_compiler *compiler, const zs_between_flows *flows, int side,
                               zs_value motion, const zs_coordinates *at);

/* Pairs that two shapes alone suggest (interpolate_auto.c): x and y of where each comes from
 * and goes, in the compiler's arena; none, with a warning, where a shape has no box.  False after
 * reporting. */
bool zs_between_find_pairs(zs_compiler *compiler, const zs_node *between,
                           const zs_node *const levels[2], double (**ends)[4], size_t *count);

/* Where a level lies on the axis. */
double zs_level_height(const zs_node *part);

/* The box of a level's shape across the axis; false when none is found. */
bool zs_level_box(const zs_node *part, double lo[3], double hi[3]);

#endif
