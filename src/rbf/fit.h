/* Fits of radial sums to scattered values:
 *
 *   f(x) = sum_j d_j phi(|u - c_j|) + P(u),   u = (x - centre) / size
 *
 * with d orthogonal to P: the interpolant of least bending energy (Duchon 1977;
 * Turk and O'Brien, "Shape transformation using variational implicit
 * functions", SIGGRAPH 1999).  Coordinates are centred and scaled to the unit
 * box in the same way along every axis, so that fits do not depend on units. */
#ifndef ZS_RBF_FIT_H
#define ZS_RBF_FIT_H

#include "base/diagnostic.h"
#include "rbf/kernel.h"

enum {
  ZS_RBF_MAXIMUM_DIMENSION = 5,
  ZS_RBF_MAXIMUM_TERMS = 21, /* monomials up to degree 2 in 5 dimensions */
  ZS_RBF_MAXIMUM_COUNT = 2000000 /* constraints */
};

/* What to fit.  The smoothing adds mu |d|^2 to the energy, with lengths as those of the positions:
 * 0 interpolates, 1e-6 of the points' extent to the kernel's power is a light touch.  The tolerance
 * is for |f - h|, or with smoothing for what is left of the equations, as a part of the largest
 * |value|; 0 is 1e-6. */
typedef struct zs_rbf_problem {
  unsigned dimension; /* 2 .. ZS_RBF_MAXIMUM_DIMENSION */
  zs_rbf_kernel kernel;
  double sigma;     /* of the Gaussian: phi is exp(-(r / sigma)^2); 0: as wide as is good */
  unsigned degree;  /* of the polynomial, up to 2, where the kernel asks for less */
  double smoothing; /* >= 0 */
  double tolerance; /* >= 0 */
  size_t count;
  const double *positions; /* count x dimension */
  const double *values;    /* count */
} zs_rbf_problem;

/* A fit: immutable. */
typedef struct zs_rbf {
  unsigned dimension;
  zs_rbf_radial radial; /* in u */
  size_t count; /* of distinct constraints */
  double centre[ZS_RBF_MAXIMUM_DIMENSION], size;
  double *centres; /* count x dimension, in u */
  double *weights; /* count */
  unsigned terms;
  double polynomial[ZS_RBF_MAXIMUM_TERMS]; /* by the order of zs_rbf_monomials */
  double residual; /* max |f - h| over the constraints */
  const char *method; /* "dense" or "iterative" */
  double seconds;
  uint64_t bytes; /* of working memory while it was made */
} zs_rbf;

/* The fit, or NULL after reporting at `place`: constraints that contradict each
 * other or are not finite (ZS_ERROR_GEOMETRY), too many of them or a singular
 * system (ZS_ERROR_UNABLE), memory, cancelled.  A fit that misses the tolerance,
 * but not by far, comes with a warning.  `control` may be NULL. */
zs_rbf *zs_rbf_fit(const zs_rbf_problem *problem, const zs_control *control,
                   const zs_place *place, zs_diag *diag);
void zs_rbf_free(zs_rbf *rbf);

/* f at one point, `dimension` coordinates. */
double zs_rbf_value(const zs_rbf *rbf, const double *point);

/* f at `count` points: all centres are added up for each.  False after reporting: memory,
 * cancelled. */
bool zs_rbf_values(const zs_rbf *rbf, const double *points, size_t count, double *values,
                   const zs_control *control, zs_diag *diag);

/* The monomials up to `degree` (0 .. 2) at u: 1, the coordinates, then the
 * products u_i u_j with i <= j in lexicographic order.  Returns how many. */
unsigned zs_rbf_monomials(unsigned dimension, unsigned degree, const double *u, double *terms);

#endif
