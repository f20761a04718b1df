/* Products with the matrix of a fit that are as accurate as each one has to be. */
#ifndef ZS_RBF_ADAPTIVE_H
#define ZS_RBF_ADAPTIVE_H

#include "rbf/fast.h"
#include "rbf/system.h"

/* Begins with the first two alone, which are borrowed. */
typedef struct zs_adaptive {
  const zs_rbf_system *system;
  const zs_rbf_clusters *clusters; /* whose points, in their order, are the system's */
  zs_fast *fast;  /* the latest products that take clusters together; NULL: none yet */
  unsigned built; /* their order */
  unsigned limit; /* from this order on all pairs cost no more; 0: not known yet */
} zs_adaptive;

/* Products with vectors that have something in common: what is known from those before.  Begins
 * with zeros, or with an order to try first. */
typedef struct zs_adaptive_series {
  unsigned order; /* of the latest one whose error was measured, ... */
  double error;   /* ... and that; 0: none was */
  double growth;  /* the factor by which the next one's may be larger */
} zs_adaptive_series;

/* result = (A + mu) d, off by at most `accuracy` in the root of the mean square at a sample:
 * clusters are taken together where that costs less than all pairs.  `errors`, unless NULL,
 * becomes what was measured.  False when memory is out. */
bool zs_adaptive_multiply(zs_adaptive *adaptive, zs_adaptive_series *series, const double *d,
                          double accuracy, double *result, zs_fast_errors *errors);
void zs_adaptive_clear(zs_adaptive *adaptive);

/* Whether there are so few points that all pairs are always summed. */
bool zs_adaptive_is_exact(const zs_rbf_system *system);

/* About the bytes that it takes. */
double zs_adaptive_bytes(const zs_rbf_system *system);

#endif
