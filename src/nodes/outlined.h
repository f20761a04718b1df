/* From outlines to the edges of what they fill, for nodes. */
#ifndef ZS_NODES_OUTLINED_H
#define ZS_NODES_OUTLINED_H

#include "files/outline.h"
#include "nodes/kind.h"
#include "samples/fill.h"

/* The boundary of the union of an outline's shapes, each filled by its own rule, with chords
 * no farther than `tolerance` times the size of the whole from curves; or, when `absolute`,
 * no farther than `tolerance`.  False after reporting about the attribute, and the `name` of
 * the outline unless it is NULL: nothing is filled, or coordinates are too far apart for
 * single precision. */
bool zs_outlined_fill(const zs_outline *outline, double tolerance, bool absolute,
                      const zs_node *node, const char *attribute, const char *name, zs_fill *fill,
                      zs_diag *diag);

/* The boundary of one ring of `count` corners (x, y), by the even-odd rule, resolved.  False after
 * reporting about the attribute, or the element (NULL). */
bool zs_outlined_ring(const double *points, size_t count, const zs_node *node,
                      const char *attribute, zs_fill *fill, zs_diag *diag);

/* The distance to edges, positive on their left, which together are the boundary of something; 0
 * when memory is out, which is reported.  The edges are moved. */
zs_value zs_outlined_emit(zs_compiler *compiler, zs_fill *fill, const zs_coordinates *at);

#endif
