/* Radial sums in space as an operation of programs: three coordinates in, f
 * out.  Coordinates are those of the fit's unit box, where single precision is
 * good to 1e-7 of it; weights of opposite signs nearly cancel, so everything is
 * added up in double precision. */
#ifndef ZS_RBF_SUM_H
#define ZS_RBF_SUM_H

#include "field/operation.h"
#include "rbf/fit.h"
#include "rbf/series.h"
#include "rbf/tree.h"

/* Data of the operations; immutable, shared by threads.
 *
 * Restricted to a box, a sum keeps the centres near it; all others are one
 * series about the box's middle.  They are chosen such that what their series
 * leave out is at most `tolerance` in all: less than what the rounding of
 * coordinates to single precision makes of f anyway. */
typedef struct zs_rbf_sum {
  zs_rbf_kernel kernel;
  size_t count;
  const zs_rbf_centre *centres;
  double polynomial[10]; /* 1 x y z xx xy xz yy yz zz, when there is no series */
  double middle[3];
  const double *series; /* nested by x, y, z: zs_series_layout; NULL: not restricted */
  double tolerance;
  size_t whole_count;                /* of centres, before any restriction */
  const zs_series_layout *layout;    /* of long series */
  const zs_rbf_tree *tree;
  zs_series_expand *expand;
} zs_rbf_sum;

/* Copy a fit and enclose it; NULL when memory is out.  Of a fit in more than three
 * dimensions it is the slice where the others are `extra`, dimension - 3 numbers
 * in the scene's units (else NULL will do); a fit in the plane must be given 0 as
 * z. */
zs_rbf_sum *zs_rbf_sum_new(const zs_rbf *rbf, const double *extra, unsigned threads);
void zs_rbf_sum_free(void *sum);

/* A cheaper sum for the box lo .. hi, from `arena`, or `data` itself where
 * most centres are near.  Restrictions nest. */
const void *zs_rbf_sum_restricted(const void *data, const float lo[3], const float hi[3],
                                  zs_arena *arena);

/* The operation for sums of a kernel. */
const zs_operation *zs_rbf_sum_operation(zs_rbf_kernel kernel);

typedef zs_kernels zs_rbf_sum_table[ZS_RBF_KERNEL_COUNT];
ZS_DECLARE_VARIANTS(zs_rbf_sum_table, zs_rbf_sum_kernels)

#endif
