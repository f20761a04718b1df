/* The bounded blend as what other kinds are made of. */
#ifndef ZS_NODES_BOUNDED_BLEND_H
#define ZS_NODES_BOUNDED_BLEND_H

#include "nodes/kind.h"

#include "field/blend.h"

/* How much is added, and how far it reaches along each of the three values. */
typedef struct zs_bounded_blend {
  double a0, a1, a2, a3; /* a1, a2, a3 > 0 */
} zs_bounded_blend;

/* No value of the R-function alone that is farther below 0 than this many a0 is lifted to 0:
 * that of two equal values is -0.586 times them. */
#define ZS_BOUNDED_BLEND_SWELLING 1.7072

/* a0 (1 - r^2)^3 / (1 + r^2) where f3 > 0, and 0 elsewhere, with r^2 = r1^2 / (r1^2 + r2^2),
 * r1 = hypot(f1/a1, f2/a2), r2 = f3/a3: between 0 and a0 everywhere. */
zs_value zs_bounded_displacement_emit(zs_compiler *compiler, const zs_bounded_blend *blend,
                                      zs_value f1, zs_value f2, zs_value f3);

/* The R0-function of f1 and f2 with that added. */
zs_value zs_bounded_blend_emit(zs_compiler *compiler, zs_blend_side side,
                               const zs_bounded_blend *blend, zs_value f1, zs_value f2,
                               zs_value f3);

#endif
