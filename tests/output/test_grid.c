/* Grids: cells that cover a box, and boxes and cells that cannot be. */
#include "../random.h"

#include "output/grid.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

/* A grid covers its box, and not by a whole cell too much. */
static void assert_covers(const zs_grid *grid, const double lo[3], const double hi[3])
{
  for (int k = 0; k < 3; k++) {
    double end = grid->lo[k] + grid->cell[k] * grid->count[k];
    assert_true(grid->lo[k] == lo[k]);
    assert_true(end >= hi[k] - 1e-6 * grid->cell[k]);
    assert_true(grid->count[k] == 1 || end - grid->cell[k] < hi[k]);
  }
}

static void random_box(uint64_t *seed, double lo[3], double hi[3])
{
  for (int k = 0; k < 3; k++) {
    lo[k] = random_between(seed, -1000, 1000);
    hi[k] = lo[k] + pow(10, random_between(seed, -1, 3));
  }
}

static void test_resolution(void **state)
{
  (void)state;
  uint64_t seed = 1;
  for (int i = 0; i < 1000; i++) {
    double lo[3], hi[3];
    random_box(&seed, lo, hi);
    uint32_t resolution = 1 + random_below(&seed, 2000);
    zs_grid grid;
    assert_true(zs_grid_fit(&grid, lo, hi, resolution, NULL));
    assert_covers(&grid, lo, hi);
    assert_true(grid.cell[0] == grid.cell[1] && grid.cell[1] == grid.cell[2]);
    uint32_t most = 0;
    for (int k = 0; k < 3; k++)
      most = grid.count[k] > most ? grid.count[k] : most;
    assert_int_equal(most, resolution);
  }
}

/* Sides that are whole numbers of cells get no further cell from rounding. */
static void test_whole_cells(void **state)
{
  (void)state;
  for (uint32_t n = 1; n <= 300; n++) {
    const double lo[3] = {-0.3, 0.1, 7}, hi[3] = {-0.3 + 0.1 * n, 0.1 + 0.1 * n, 7.1};
    const double cell[3] = {0.1, 0.1, 0.1};
    zs_grid grid;
    assert_true(zs_grid_fit(&grid, lo, hi, n, NULL));
    assert_int_equal(grid.count[0], n);
    assert_int_equal(grid.count[1], n);
    assert_int_equal(grid.count[2], 1);
    assert_true(zs_grid_fit_cell(&grid, lo, hi, cell, NULL));
    assert_int_equal(grid.count[0], n);
    assert_int_equal(grid.count[1], n);
    assert_int_equal(grid.count[2], 1);
  }
}

static void test_cell(void **state)
{
  (void)state;
  uint64_t seed = 2;
  for (int i = 0; i < 1000; i++) {
    double lo[3], hi[3], cell[3];
    random_box(&seed, lo, hi);
    for (int k = 0; k < 3; k++)
      cell[k] = pow(10, random_between(&seed, -2, 4)); /* larger than the box, too */
    zs_grid grid;
    assert_true(zs_grid_fit_cell(&grid, lo, hi, cell, NULL));
    assert_covers(&grid, lo, hi);
    for (int k = 0; k < 3; k++)
      assert_true(grid.cell[k] == cell[k]);
  }
}

static void assert_argument_error(bool good, zs_diag *diag)
{
  assert_false(good);
  assert_int_equal(diag->errors, 1);
  assert_int_equal(diag->status, ZS_ERROR_ARGUMENT);
  *diag = (zs_diag){0};
}

static void test_bad(void **state)
{
  (void)state;
  const double zero[3] = {0, 0, 0}, one[3] = {1, 1, 1}, flat[3] = {1, 0, 1}, nan[3] = {1, NAN, 1},
               infinite[3] = {1, 1, INFINITY}, huge[3] = {1e300, 1e300, 1e300},
               minute[3] = {1e-12, 1, 1}, negative[3] = {1, -1, 1};
  zs_grid grid;
  zs_diag diag = {0};
  assert_argument_error(zs_grid_fit(&grid, zero, one, 0, &diag), &diag);
  assert_argument_error(zs_grid_fit(&grid, zero, one, 1000000000, &diag), &diag);
  assert_argument_error(zs_grid_fit(&grid, zero, one, 1000000, &diag), &diag); /* 10^18 cells */
  assert_argument_error(zs_grid_fit(&grid, zero, flat, 8, &diag), &diag);
  assert_argument_error(zs_grid_fit(&grid, one, zero, 8, &diag), &diag);
  assert_argument_error(zs_grid_fit(&grid, zero, nan, 8, &diag), &diag);
  assert_argument_error(zs_grid_fit(&grid, nan, infinite, 8, &diag), &diag);
  assert_argument_error(zs_grid_fit(&grid, zero, infinite, 8, &diag), &diag);
  assert_argument_error(zs_grid_fit(&grid, zero, huge, 8, &diag), &diag);
  assert_argument_error(zs_grid_fit_cell(&grid, zero, one, zero, &diag), &diag);
  assert_argument_error(zs_grid_fit_cell(&grid, zero, one, negative, &diag), &diag);
  assert_argument_error(zs_grid_fit_cell(&grid, zero, one, nan, &diag), &diag);
  assert_argument_error(zs_grid_fit_cell(&grid, zero, one, infinite, &diag), &diag);
  assert_argument_error(zs_grid_fit_cell(&grid, zero, one, minute, &diag), &diag);
  assert_argument_error(zs_grid_fit_cell(&grid, zero, flat, one, &diag), &diag);
}

static void test_check(void **state)
{
  (void)state;
  const zs_grid good = {{0, 0, 0}, {1, 1, 1}, {1, 2, 3}};
  zs_diag diag = {0};
  assert_true(zs_grid_check(&good, &diag));
  zs_grid bad = good;
  bad.count[1] = 0;
  assert_argument_error(zs_grid_check(&bad, &diag), &diag);
  bad = good;
  bad.cell[2] = NAN;
  assert_argument_error(zs_grid_check(&bad, &diag), &diag);
  bad = good;
  bad.lo[0] = INFINITY;
  assert_argument_error(zs_grid_check(&bad, &diag), &diag);
  bad = (zs_grid){{0, 0, 0}, {1, 1, 1}, {ZS_GRID_LONGEST, ZS_GRID_LONGEST, ZS_GRID_LONGEST}};
  assert_argument_error(zs_grid_check(&bad, &diag), &diag);
  /* Cells that doubles cannot tell apart so far from the origin. */
  bad = (zs_grid){{1e20, 0, 0}, {1, 1, 1}, {8, 8, 8}};
  assert_argument_error(zs_grid_check(&bad, &diag), &diag);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_resolution), cmocka_unit_test(test_whole_cells),
    cmocka_unit_test(test_cell), cmocka_unit_test(test_bad), cmocka_unit_test(test_check)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
