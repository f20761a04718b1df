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

#endif
