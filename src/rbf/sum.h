/* Radial sums in space as an operation of programs: three coordinates in, f
 * out.  Coordinates are those of the fit's unit box, where single precision is
 * good to 1e-7 of it; weights of opposite signs nearly cancel, so everything is
 * added up in double precision.
 *
 * The sum of a whole program is added up term by term, which takes a time by the
 * number of centres.  Restricted to any box it is found cell by cell (cells.h),
 * unless centres are few, at a cost that hardly depends on it; near the centres that
 * is off by at most about `accuracy` times what f varies over them. */
#ifndef ZS_RBF_SUM_H
#define ZS_RBF_SUM_H

#include "field/operation.h"
#include "rbf/cells.h"
#include "rbf/fit.h"
#include "rbf/tree.h"

/* Data of the operations; immutable, shared by threads. */
typedef struct zs_rbf_sum {
  zs_rbf_kernel kernel;
  bool restricted; /* to be found cell by cell */
  zs_rbf_terms terms;
  const zs_rbf_cells *cells;
  const zs_rbf_tree *tree;
  const struct zs_rbf_sum *inside; /* the same, restricted */
  double tolerance;
} zs_rbf_sum;

#define ZS_RBF_ACCURACY 1e-6 /* that no picture, mesh or volume shows */

/* Copy a fit and enclose it; NULL after reporting that memory is out, or cancelled.  Its
 * first `space` dimensions, 2 or 3, are those of space, and it is the slice where the others
 * are `extra`, dimension - space numbers in the scene's units (NULL will do for none).  In the
 * plane it must be given 0 as z.  `accuracy` is positive; `control` may be NULL. */
zs_rbf_sum *zs_rbf_sum_new(const zs_rbf *rbf, unsigned space, const double *extra,
                           double accuracy, const zs_control *control, zs_diag *diag);
void zs_rbf_sum_free(void *sum);

/* The sum to use in the box lo .. hi; `data` itself where the cells do not reach, or are not
 * worth it. */
const void *zs_rbf_sum_restricted(const void *data, const float lo[3], const float hi[3],
                                  zs_arena *arena);

/* The operation for sums of a kernel. */
const zs_operation *zs_rbf_sum_operation(zs_rbf_kernel kernel);

typedef zs_kernels zs_rbf_sum_table[ZS_RBF_KERNEL_COUNT];
ZS_DECLARE_VARIANTS(zs_rbf_sum_table, zs_rbf_sum_kernels)

#endif
