/* Constraints that differ, in the unit box. */
#ifndef ZS_RBF_DISTINCT_H
#define ZS_RBF_DISTINCT_H

#include "rbf/fit.h"

typedef struct zs_rbf_distinct {
  double centre[ZS_RBF_MAXIMUM_DIMENSION], size; /* of the unit box */
  size_t count;
  double *points; /* count x dimension: (position - centre) / size */
  double *values;
  double largest; /* |value| */
} zs_rbf_distinct;

/* False after reporting: numbers that are not finite, constraints that
 * contradict each other without smoothing, memory.  At least one constraint. */
bool zs_rbf_distinct_make(zs_rbf_distinct *distinct, const zs_rbf_problem *problem,
                          const zs_place *place, zs_diag *diag);
void zs_rbf_distinct_clear(zs_rbf_distinct *distinct);

#endif
