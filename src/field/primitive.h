/* Solids whose value is one short function of a point: each is one operation
 * from the coordinates to f, so that a block passes through memory once, and
 * its bounds are those of the solid, not of the steps of its formula. */
#ifndef ZS_PRIMITIVE_H
#define ZS_PRIMITIVE_H

#include "field/operation.h"

/* Data of the operations below.  A primitive's own coordinates x, y, z are
 * `matrix` (3 x 4, row-major) applied to the three inputs. */
typedef struct zs_primitive {
  double matrix[12];
  double parameter[4];
  /* Points as far apart as 1 are this far apart in the primitive's coordinates,
   * or closer. */
  double stretch;
  uint64_t moved; /* 1: the matrix is the identity but for its last column */
} zs_primitive;

typedef enum zs_primitive_shape {
  ZS_PRIMITIVE_BALL,     /* r - |(x, y, z)|; parameter: r */
  ZS_PRIMITIVE_TUBE,     /* r - |(x, y)|; parameter: r */
  ZS_PRIMITIVE_CUBOID,   /* half sides a, b, c, which may be infinite, rounded outward by r;
                            parameter: a, b, c, r */
  ZS_PRIMITIVE_CYLINDER, /* |(x, y)| <= r, |z| <= h; parameter: r, h */
  ZS_PRIMITIVE_TORUS,    /* about z; parameter: radius of the middle circle, of the tube */
  ZS_PRIMITIVE_CAPSULE,  /* closer than r to |z| <= h on the axis; parameter: r, h */
  ZS_PRIMITIVE_COUNT
} zs_primitive_shape;

/* The operation on the frame's coordinates (root), or on three registers. */
const zs_operation *zs_primitive_operation(zs_primitive_shape shape, bool root);

/* The reverse.  False for operations that are no primitives. */
bool zs_primitive_of(const zs_operation *operation, zs_primitive_shape *shape, bool *root);

/* By shape; [0]: of registers, [1]: of the frame's coordinates. */
typedef zs_kernels zs_primitive_table[ZS_PRIMITIVE_COUNT][2];
ZS_DECLARE_VARIANTS(zs_primitive_table, zs_primitive_kernels)

#endif
