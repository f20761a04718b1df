/* Flexible GMRES: solves A x = b for any A and with a preconditioner that may
 * differ from step to step.  Saad, "A flexible inner-outer preconditioned GMRES
 * algorithm", SIAM J. Sci. Comput. 14 (1993). */
#ifndef ZS_RBF_FGMRES_H
#define ZS_RBF_FGMRES_H

#include <stdbool.h>
#include <stddef.h>

enum { ZS_FGMRES_STEPS = 40 }; /* at most */

/* What is solved.  Callbacks return false to stop. */
typedef struct zs_fgmres {
  size_t n;
  void *context;
  bool (*multiply)(void *context, const double *x, double *result);
  bool (*precondition)(void *context, const double *r, double *z);
  /* After every step, with the estimated norm of the residual. */
  bool (*step)(void *context, double norm);
} zs_fgmres;

/* Bytes that it works in. */
double zs_fgmres_bytes(size_t n);

typedef enum zs_fgmres_result {
  ZS_FGMRES_DONE,    /* the estimated norm is as asked */
  ZS_FGMRES_STALLED, /* as good as it gets */
  ZS_FGMRES_STOPPED, /* by a callback */
  ZS_FGMRES_MEMORY
} zs_fgmres_result;

/* Add to x the solution for b: until the norm of the residual is estimated to be
 * at most `norm`. */
zs_fgmres_result zs_fgmres_solve(const zs_fgmres *fgmres, const double *b, double norm, double *x);

#endif
