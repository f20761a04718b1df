/* Grids of cells. */
#ifndef ZS_GRID_H
#define ZS_GRID_H

#include "zeroset.h"

/* Most cells of a grid along an axis, and in all. */
#define ZS_GRID_LONGEST (UINT32_C(1) << 20)
#define ZS_GRID_LARGEST (UINT64_C(1) << 48)

/* Whether a box has finite corners and lo < hi; reports when not. */
bool zs_box_check(const double lo[3], const double hi[3], zs_diag *diag);

/* Whether a grid that a caller has filled in can be used: counts from 1 to the
 * limits above, finite corners and positive cells.  Reports when not. */
bool zs_grid_check(const zs_grid *grid, zs_diag *diag);

#endif
