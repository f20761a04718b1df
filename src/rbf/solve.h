/* The two ways to solve the equations of a fit. */
#ifndef ZS_RBF_SOLVE_H
#define ZS_RBF_SOLVE_H

#include "rbf/clusters.h"
#include "rbf/system.h"

#include <math.h>

/* A fit to be solved. */
typedef struct zs_rbf_job {
  zs_rbf_system system;
  const zs_rbf_clusters *clusters; /* whose points, in their order, are the system's */
  const double *values;            /* h */
  double largest;                  /* of |h| */
  double tolerance;                /* what |f - h|, or what is left of the equations, may be */
  /* Told now and then, from the calling thread, the part that is done;
   * false cancels. */
  bool (*progress)(void *context, double fraction);
  void *context;
} zs_rbf_job;

/* What was found: the best so far when the tolerance could not be met. */
typedef struct zs_rbf_solution {
  double *weights;                         /* d, `count`, from the caller */
  double polynomial[ZS_RBF_MAXIMUM_TERMS]; /* c */
  double left;     /* the largest part of the equations that is left */
  double residual; /* max |f - h| */
} zs_rbf_solution;

/* Take what one equation leaves over into account; `smoothed` is what smoothing
 * adds to the left of it. */
static inline void zs_rbf_solution_note(zs_rbf_solution *solution, double left, double smoothed)
{
  const double off = fabs(left + smoothed);
  /* Written so that a NaN counts as infinite. */
  if (!(fabs(left) <= solution->left))
    solution->left = isnan(left) ? INFINITY : fabs(left);
  if (!(off <= solution->residual))
    solution->residual = isnan(off) ? INFINITY : off;
}

/* By a factorisation: n^3 / 3 operations, n^2 memory. */
zs_rbf_result zs_rbf_solve_directly(const zs_rbf_job *job, zs_rbf_solution *solution);
double zs_rbf_direct_bytes(const zs_rbf_system *system);

/* By flexible GMRES with the preconditioner of schwarz.h: memory grows with n,
 * time with the products. */
zs_rbf_result zs_rbf_solve_iteratively(const zs_rbf_job *job, zs_rbf_solution *solution);
double zs_rbf_iterative_bytes(const zs_rbf_system *system);

#endif
