/* What <soft> and <convolution> share: the parts that make a skeleton, and a field about it. */
#ifndef ZS_SKELETAL_H
#define ZS_SKELETAL_H

#include "nodes/kind.h"

#include "samples/skeleton.h"

/* point, segment, polyline, triangle; NULL-terminated. */
extern const zs_kind *const zs_skeletal_parts[];

bool zs_skeletal_check(const zs_node *node, zs_diag *diag);

/* The field of the node's skeleton, less the threshold; radii are multiplied by `scale`. */
zs_value zs_skeletal_emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at,
                          zs_skeleton_field field, double scale, double threshold);

/* Where it can be above the threshold. */
zs_box zs_skeletal_box(const zs_node *node, zs_skeleton_field field, double scale,
                       double threshold);

#endif
