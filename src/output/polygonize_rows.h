/* Loops over the rows of a brick, built for one instruction set. */
#ifndef ZS_POLYGONIZE_ROWS_H
#define ZS_POLYGONIZE_ROWS_H

#include "output/polygonize.h"

typedef uint16_t zs_row_bits[ZS_BRICK_ROWS]; /* bit x of a row: a corner */

typedef struct zs_row_kernels {
  /* Corners that are inside: f >= 0. */
  void (*signs)(const float f[ZS_BRICK_CORNERS], zs_row_bits signs);
  /* By axis, starts of the edges that lie in the brick and cross the surface.
   * Only edges between corners in `real` count.  Returns how many there are. */
  unsigned (*inner)(const zs_row_bits signs, const zs_row_bits real, zs_row_bits crossing[3]);
  /* Corners closer to the surface than `limit`, as far as the slope can be told
   * from the steps of f to their neighbours in the brick.  Only corners at the
   * brick's sides and those of edges in `crossing` count.  There are finite
   * numbers at f[-1] and behind the last corner too. */
  void (*close)(const float *f, const zs_row_bits crossing[3],
                const float per_cell[3], float limit, zs_row_bits close);
  /* How far along its gradient, in units of its length, each of n corners has to
   * be moved to be `reach` away from the surface; 0 for those that are. */
  void (*steps)(unsigned n, const float *f, const float gradient[3][ZS_BLOCK], float reach,
                float *step);
} zs_row_kernels;

/* Those of an instruction set. */
const zs_row_kernels *zs_row_kernels_of(zs_isa_kind isa);

#endif
