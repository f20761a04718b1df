#include "output/grid.h"

#include "base/diagnostic.h"

#include <float.h>
#include <math.h>

static const char axis_names[] = "xyz";

/* Largest coordinate and smallest cell, relative to coordinates, that still
 * tell neighbouring samples apart. */
static const double LARGEST_COORDINATE = 1e30, SMALLEST_CELL = 4 * DBL_EPSILON;

bool zs_box_check(const double lo[3], const double hi[3], zs_diag *diag)
{
  for (int k = 0; k < 3; k++) {
    if (!(fabs(lo[k]) <= LARGEST_COORDINATE && fabs(hi[k]) <= LARGEST_COORDINATE))
      return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL,
                     "the box goes from %g to %g in %c; expected numbers up to %g", lo[k], hi[k],
                     axis_names[k], LARGEST_COORDINATE);
    if (!(lo[k] < hi[k]))
      return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL,
                     "the box is empty: it goes from %g to %g in %c", lo[k], hi[k],
                     axis_names[k]);
  }
  return true;
}

bool zs_grid_check(const zs_grid *grid, zs_diag *diag)
{
  uint64_t cells = 1;
  for (int k = 0; k < 3; k++) {
    double hi = grid->lo[k] + grid->cell[k] * grid->count[k];
    double reach = fmax(fabs(grid->lo[k]), fabs(hi));
    if (!(grid->cell[k] > 0 && reach <= LARGEST_COORDINATE))
      return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL,
                     "the grid has cells of %g from %g in %c; expected finite numbers and a "
                     "size > 0",
                     grid->cell[k], grid->lo[k], axis_names[k]);
    if (grid->cell[k] < SMALLEST_CELL * reach)
      return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL,
                     "the grid's cells are too small: %g at %g in %c cannot be told apart",
                     grid->cell[k], reach, axis_names[k]);
    if (grid->count[k] < 1 || grid->count[k] > ZS_GRID_LONGEST)
      return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL,
                     "the grid has %u cells in %c; expected 1 to %u", grid->count[k],
                     axis_names[k], ZS_GRID_LONGEST);
    cells *= grid->count[k];
  }
  if (cells > ZS_GRID_LARGEST)
    return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL,
                   "the grid has %u x %u x %u cells; expected at most 2^48 in all",
                   grid->count[0], grid->count[1], grid->count[2]);
  return true;
}

/* Cells of size `cell` that cover a length; one that is covered but for
 * rounding needs no further cell.  UINT32_MAX when they are too many. */
static uint32_t cells_across(double length, double cell)
{
  double cells = ceil(length / cell * (1 - 1e-9));
  if (!(cells <= ZS_GRID_LONGEST))
    return UINT32_MAX;
  return cells < 1 ? 1 : (uint32_t)cells;
}

static bool fit(zs_grid *grid, const double lo[3], const double hi[3], const double cell[3],
                zs_diag *diag)
{
  for (int k = 0; k < 3; k++) {
    grid->lo[k] = lo[k];
    grid->cell[k] = cell[k];
    grid->count[k] = cells_across(hi[k] - lo[k], cell[k]);
    if (grid->count[k] == UINT32_MAX)
      return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL,
                     "cells of %g are too many over a length of %g in %c; expected at most %u",
                     cell[k], hi[k] - lo[k], axis_names[k], ZS_GRID_LONGEST);
  }
  return zs_grid_check(grid, diag);
}

bool zs_grid_fit(zs_grid *grid, const double lo[3], const double hi[3], uint32_t resolution,
                 zs_diag *diag)
{
  if (resolution < 1 || resolution > ZS_GRID_LONGEST)
    return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL, "the resolution is %u; expected 1 to %u",
                   resolution, ZS_GRID_LONGEST);
  if (!zs_box_check(lo, hi, diag))
    return false;
  double longest = 0;
  for (int k = 0; k < 3; k++)
    longest = fmax(longest, hi[k] - lo[k]);
  const double side = longest / resolution, cell[3] = {side, side, side};
  return fit(grid, lo, hi, cell, diag);
}

bool zs_grid_fit_cell(zs_grid *grid, const double lo[3], const double hi[3], const double cell[3],
                      zs_diag *diag)
{
  if (!zs_box_check(lo, hi, diag))
    return false;
  for (int k = 0; k < 3; k++)
    if (!(cell[k] > 0 && cell[k] <= LARGEST_COORDINATE))
      return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL,
                     "the cell's size is %g in %c; expected a length > 0", cell[k],
                     axis_names[k]);
  return fit(grid, lo, hi, cell, diag);
}
