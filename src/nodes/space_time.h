/* Two shapes as half-cylinders in time, blended where both are near. */
#ifndef ZS_NODES_SPACE_TIME_H
#define ZS_NODES_SPACE_TIME_H

#include "nodes/bounded_blend.h"

/* The first shape is there up to `end`, the second from `start` on; material is added between
 * the times `min` and `max`.  min < end, start < max. */
typedef struct zs_space_time {
  double min, end, start, max;
  zs_bounded_blend blend;
  double smoothing; /* added (or below 0: taken away) where a half-cylinder ends */
} zs_space_time;

/* f of the blend of the shapes' values f1 and f2 at the time t.  It is f1 up to `min` and f2
 * from `max` on, to 1e-11 of f^2 over their distance, and its rate of change is 0 there.
 * `bound`, if not NULL, is another solid that material is added in. */
zs_value zs_space_time_emit(zs_compiler *compiler, const zs_space_time *blend, zs_value f1,
                            zs_value f2, zs_value t, const zs_value *bound);

#endif
