/* From samples to constraints: offsets, clearance, refusals. */
#include "../random.h"

#include "rbf/constraints.h"
#include "rbf/fit.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void add(zs_rbf_samples *list, double x, double y, double z, double nx, double ny,
                double nz, double value)
{
  const zs_rbf_sample sample = {{x, y, z}, {nx, ny, nz}, value, false};
  assert_true(zs_rbf_samples_add(list, &sample, NULL));
}

static zs_rbf_constraints build(const zs_rbf_samples *list, double offset, bool both)
{
  zs_rbf_constraints c;
  assert_true(zs_rbf_constraints_build(&c, list, &(zs_rbf_rules){3, offset, both}, NULL, NULL, NULL));
  return c;
}

static void offsets_lie_along_normals(void **state)
{
  (void)state;
  zs_rbf_samples list = {0};
  add(&list, 1, 2, 3, 0, 0, 10, 0.5); /* normals of any length */
  add(&list, 5, 6, 7, 0, 0, 0, -1);
  for (int both = 0; both <= 1; both++) {
    zs_rbf_constraints c = build(&list, 0.25, both);
    static const double expected[4][4] = {
      {1, 2, 3, 0.5}, {1, 2, 2.75, 0.75}, {1, 2, 3.25, 0.25}, {5, 6, 7, -1}};
    assert_int_equal(c.count, 3 + both);
    for (size_t i = 0; i < c.count; i++) {
      const double *e = expected[!both && i == 2 ? 3 : i];
      for (size_t k = 0; k < 3; k++)
        assert_true(c.positions[3 * i + k] == e[k]);
      assert_true(c.values[i] == e[3]);
    }
    zs_rbf_constraints_clear(&c);
  }
  zs_rbf_samples_clear(&list);
}

/* No offset point is nearer to another sample than to its own: f would have to
 * be a wrong distance there. */
static void automatic_offsets_keep_clear(void **state)
{
  (void)state;
  const double thickness = 0.004; /* of a plate two units wide */
  uint64_t seed = 5;
  zs_rbf_samples list = {0};
  for (int i = 0; i < 450; i++) {
    double x = random_between(&seed, -1, 1), y = random_between(&seed, -1, 1);
    add(&list, x, y, 0, 0, 0, -1, 0);
    add(&list, x, y, thickness, 0, 0, 1, 0);
  }
  zs_rbf_constraints c = build(&list, NAN, true);
  assert_true(c.count > 2 * list.count);
  double longest = 0;
  for (size_t i = 0; i < c.count; i++) {
    double nearest = INFINITY;
    for (size_t j = 0; j < list.count; j++) {
      const double *p = c.positions + 3 * i, *q = list.samples[j].position;
      nearest = fmin(nearest, hypot(hypot(p[0] - q[0], p[1] - q[1]), p[2] - q[2]));
    }
    assert_true(fabs(nearest - fabs(c.values[i])) < 1e-12);
    longest = fmax(longest, fabs(c.values[i]));
    if (c.values[i] > 0)
      assert_true(c.positions[3 * i + 2] > 0 && c.positions[3 * i + 2] < thickness);
  }
  assert_true(fabs(longest - 0.01 * sqrt(8)) < 1e-3); /* outside there is room */
  zs_rbf_constraints_clear(&c);
  zs_rbf_samples_clear(&list);
}

/* The same point again and again is that point, whatever the rounding of its mean. */
static void one_point_many_times(void **state)
{
  (void)state;
  zs_rbf_samples list = {0};
  for (int i = 0; i < 50; i++)
    add(&list, 1, 2, 3, 0, 0, 1, 0);
  assert_true(zs_rbf_samples_size(&list) == 0);
  zs_rbf_samples_clear(&list);
}

/* One point with a normal is enough: half of space. */
static void one_oriented_point(void **state)
{
  (void)state;
  zs_rbf_samples list = {0};
  add(&list, 1, 1, 1, 0, 3, 4, 0);
  zs_rbf_constraints c = build(&list, NAN, true);
  const zs_rbf_problem problem = {.dimension = 3, .kernel = ZS_RBF_R3, .count = c.count,
                                  .positions = c.positions, .values = c.values};
  zs_rbf *rbf = zs_rbf_fit(&problem, NULL, NULL, NULL);
  assert_non_null(rbf);
  const double above[3] = {9, 4, 5}, below[3] = {1, -2, -3};
  assert_true(fabs(zs_rbf_value(rbf, above) + 5) < 1e-9);
  assert_true(fabs(zs_rbf_value(rbf, below) - 5) < 1e-9);
  zs_rbf_free(rbf);
  zs_rbf_constraints_clear(&c);
  zs_rbf_samples_clear(&list);
}

static void keep_message(void *context, const zs_diagnostic *diagnostic)
{
  snprintf(context, 512, "%s", diagnostic->message);
}

static void fails_with(const zs_rbf_samples *list, zs_status status, const char *part)
{
  char message[512] = "";
  zs_diag diag = {.report = keep_message, .context = message};
  zs_rbf_constraints c;
  assert_false(zs_rbf_constraints_build(&c, list, &(zs_rbf_rules){3, NAN, true}, NULL, NULL, &diag));
  assert_int_equal(diag.status, status);
  assert_non_null(strstr(message, part));
  assert_null(c.positions);
}

static void undirected_sets_are_refused(void **state)
{
  (void)state;
  zs_rbf_samples list = {0};
  fails_with(&list, ZS_ERROR_GEOMETRY, "no points");
  for (int i = 0; i < 10; i++)
    add(&list, i, i * i, 0, 0, 0, 0, 0);
  fails_with(&list, ZS_ERROR_GEOMETRY, "where the inside is");
  /* One point inside settles it. */
  add(&list, 3, 3, 0, 0, 0, 0, 1);
  zs_rbf_constraints c = build(&list, NAN, true);
  assert_int_equal(c.count, 11);
  zs_rbf_constraints_clear(&c);
  while (list.count <= ZS_RBF_MAXIMUM_COUNT)
    add(&list, (double)list.count, 0, 0, 0, 0, 1, 0);
  fails_with(&list, ZS_ERROR_UNABLE, "2000001 points");
  zs_rbf_samples_clear(&list);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(offsets_lie_along_normals),
    cmocka_unit_test(automatic_offsets_keep_clear),
    cmocka_unit_test(one_point_many_times),
    cmocka_unit_test(one_oriented_point),
    cmocka_unit_test(undirected_sets_are_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
