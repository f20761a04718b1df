/* Leaves of the tree of boxes that a tile is traced as: 8 x 8 rays, and a few samples of each.
 * Inside the renderer: trace.c has the tree. */
#ifndef ZS_TRACE_LEAF_H
#define ZS_TRACE_LEAF_H

#include "output/trace.h"

/* Samples are taken a little before and behind a leaf, too: this part of its depth. */
#define ZS_LEAF_BEYOND 0.03f

/* Depth of a leaf in pixels. */
#define ZS_LEAF_DEPTH 12

/* Columns and leaves lo <= i < hi of a tile.  The surface is where the sign
 * changes, for which a program is often much shorter than for all of f. */
typedef struct zs_trace_part {
  uint32_t lo[3], hi[3];
  const zs_program *sign, *gradient;
} zs_trace_part;

/* Take stock of the rays of a column that go on. */
void zs_tile_update(zs_tile *tile, unsigned column);

/* Depth of the boundary before a leaf. */
float zs_leaf_depth(const zs_tracer *tracer, uint32_t index);

/* Trace the rays of a part that is one leaf. */
void zs_trace_leaf(zs_tracer *tracer, zs_tile *tile, const zs_trace_part *part);

#endif
