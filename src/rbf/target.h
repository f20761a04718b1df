/* Cells of a radial sum in the making (cells.h). */
#ifndef ZS_RBF_TARGET_H
#define ZS_RBF_TARGET_H

#include "rbf/cells.h"
#include "rbf/swarms.h"

enum { ZS_TARGET_TERMS = ZS_CHEBYSHEV_ORDER * ZS_CHEBYSHEV_ORDER * ZS_CHEBYSHEV_ORDER,
       ZS_TARGET_ROUNDS = 6 };

/* What is the same for all cells of a sum. */
typedef struct zs_target_maker {
  const zs_rbf_terms *terms;
  const zs_swarms *swarms;
  const zs_cells_kernels *kernels;
  double tolerance;
  zs_chebyshev_halves halves;
  /* For each number of nodes along a side: values there to coefficients, and how far the
   * kernel's expansion has fallen by then, beside powers of the distance. */
  double fit[ZS_TARGET_ROUNDS][ZS_CHEBYSHEV_ORDER * ZS_CHEBYSHEV_ORDER];
  double decay[ZS_TARGET_ROUNDS], grid_decay[ZS_SWARM_GRIDS];
} zs_target_maker;

/* A cell: the series of all that is far from it, and the swarms that are near. */
typedef struct zs_target {
  double middle[3], half;
  double series[ZS_TARGET_TERMS];
  double allowance; /* what it may be off by, in tolerances */
  uint32_t *near;
  size_t near_count, near_capacity, near_centres;
  double pairs; /* of nodes and centres that it took */
} zs_target;

void zs_target_maker_init(zs_target_maker *maker, const zs_rbf_terms *terms,
                          const zs_swarms *swarms, double tolerance);

/* The cube, to which everything is near, and one of the eight parts of a target.
 * NULL when memory is out. */
zs_target *zs_target_cube(const zs_target_maker *maker);
zs_target *zs_target_part(const zs_target_maker *maker, const zs_target *whole, unsigned child);
void zs_target_free(zs_target *target);

/* Turn a target into a leaf; false when memory is out. */
bool zs_target_finish(const zs_target_maker *maker, const zs_target *target, zs_rbf_cell *leaf);

#endif
