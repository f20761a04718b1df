/* The equations of a fit:
 *
 *   [ A + mu  P ] [d]   [h]     A_ij = sign phi (|x_i - x_j|),
 *   [ P^T     0 ] [c] = [0]     P_ik: monomial k at x_i
 *
 * With an orthonormal basis U of what P spans, and without the part in U of
 * whatever is on either side, the first row alone determines d. */
#ifndef ZS_RBF_SYSTEM_H
#define ZS_RBF_SYSTEM_H

#include "rbf/dense.h"
#include "rbf/fit.h"

typedef struct zs_rbf_system {
  zs_rbf_radial radial;
  unsigned dimension, degree, terms;
  double smoothing; /* mu */
  size_t count;
  const double *points; /* count x dimension, in the unit box */
  unsigned threads;
} zs_rbf_system;

/* How a solver ended; the worst is the greatest. */
typedef enum zs_rbf_result {
  ZS_RBF_DONE,
  ZS_RBF_SINGULAR,
  ZS_RBF_CANCELLED,
  ZS_RBF_MEMORY
} zs_rbf_result;

zs_rbf_result zs_rbf_result_of(zs_dense_result result);

/* P, column-major, for free(); NULL when memory is out. */
double *zs_rbf_system_monomials(const zs_rbf_system *system);

/* The matrix A + mu, column-major. */
void zs_rbf_system_matrix(const zs_rbf_system *system, double *matrix);

/* result = (A + mu) d */
void zs_rbf_system_multiply(const zs_rbf_system *system, const double *d, double *result);

/* Residuals (`count`) of random sign, of size 1.  Weights that solve for them are the roughest
 * that products see: neighbouring ones nearly cancel, and errors show most. */
void zs_rbf_system_roughen(const zs_rbf_system *system, double *residual);

/* The coordinates q (`rank`) of v's part in U. */
void zs_rbf_system_coordinates(const zs_span *span, const double *v, double *q);

/* Take that part out of v. */
void zs_rbf_system_project(const zs_span *span, double *v);

#endif
