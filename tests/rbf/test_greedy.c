/* Few constraints out of many: all are met, or it is said that they are not. */
#include "../random.h"

#include "rbf/greedy.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

enum { COUNT = 3000 };

static double positions[COUNT][3], values[COUNT];

/* A function with a bump that needs more constraints than the rest. */
static double truth(const double *p)
{
  const double x = p[0] - 0.5, y = p[1] - 0.2;
  return p[2] + 0.3 * p[0] * p[1] + 0.2 * exp(-20 * (x * x + y * y));
}

static int set_up(void **state)
{
  (void)state;
  uint64_t seed = 4;
  for (int i = 0; i < COUNT; i++) {
    for (int k = 0; k < 3; k++)
      positions[i][k] = random_between(&seed, -1, 1);
    values[i] = truth(positions[i]);
  }
  return 0;
}

static zs_rbf *fit(size_t count, size_t budget, double tolerance, bool strict, zs_diag *diag)
{
  const zs_rbf_problem problem = {.dimension = 3,
                                  .kernel = ZS_RBF_R3,
                                  .count = count,
                                  .positions = &positions[0][0],
                                  .values = values};
  zs_rbf *rbf = zs_rbf_fit_greedily(&problem, budget, tolerance, strict, NULL, NULL, diag);
  assert_non_null(rbf);
  return rbf;
}

static double worst(const zs_rbf *rbf)
{
  double result = 0;
  for (int i = 0; i < COUNT; i++)
    result = fmax(result, fabs(zs_rbf_value(rbf, positions[i]) - values[i]));
  return result;
}

static void tolerances_are_met_with_less(void **state)
{
  (void)state;
  size_t before = 0;
  for (double tolerance = 0.03; tolerance > 0.001; tolerance /= 3) {
    zs_diag diag = {0};
    zs_rbf *rbf = fit(COUNT, COUNT, tolerance, true, &diag);
    assert_true(worst(rbf) <= tolerance * (1 + 1e-9));
    assert_true(fabs(rbf->residual - worst(rbf)) < 1e-9);
    assert_true(rbf->count < COUNT / 2 && rbf->count >= before);
    assert_int_equal(diag.warnings, 0);
    before = rbf->count;
    zs_rbf_free(rbf);
  }
}

/* The constraints that are missed most are worth more than any. */
static void budgets_are_kept_and_well_spent(void **state)
{
  (void)state;
  zs_diag diag = {0};
  zs_rbf *chosen = fit(COUNT, 400, 0, false, &diag);
  zs_rbf *any = fit(400, 400, 0, false, &diag); /* the first ones, which are random */
  assert_int_equal(chosen->count, 400);
  assert_int_equal(any->count, 400);
  assert_true(worst(chosen) < 0.5 * worst(any));
  assert_int_equal(diag.warnings, 0);
  zs_rbf_free(chosen);
  zs_rbf_free(any);
  zs_rbf *missed = fit(COUNT, 150, 1e-4, true, &diag);
  assert_int_equal(diag.warnings, 1);
  assert_true(missed->count <= 150);
  zs_rbf_free(missed);
}

/* Few constraints, and a budget for all, are ordinary fits. */
static void small_sets_are_fitted_whole(void **state)
{
  (void)state;
  zs_rbf *small = fit(60, 10, 0, false, NULL), *all = fit(500, 100000, 0, false, NULL);
  assert_int_equal(small->count, 60);
  assert_int_equal(all->count, 500);
  for (int i = 0; i < 60; i++)
    assert_true(fabs(zs_rbf_value(small, positions[i]) - values[i]) < 1e-9);
  for (int i = 0; i < 500; i++)
    assert_true(fabs(zs_rbf_value(all, positions[i]) - values[i]) < 1e-7);
  zs_rbf_free(small);
  zs_rbf_free(all);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(tolerances_are_met_with_less),
    cmocka_unit_test(budgets_are_kept_and_well_spent),
    cmocka_unit_test(small_sets_are_fitted_whole),
  };
  return cmocka_run_group_tests(tests, set_up, NULL);
}
