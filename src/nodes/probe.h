/* Values of children at points, for kinds whose meaning depends on them. */
#ifndef ZS_PROBE_H
#define ZS_PROBE_H

#include "nodes/kind.h"

/* f of the union of a node's child nodes, in the node's own coordinates, at `count` points
 * (x, y, z triples).  To be called after they were emitted.  False after reporting. */
bool zs_probe_children(zs_compiler *compiler, const zs_node *node, const double *points,
                       size_t count, double *values);

#endif
