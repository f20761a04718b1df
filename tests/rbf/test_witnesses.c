/* Places whose side of a surface its samples tell: against closed forms. */
#include "../random.h"

#include "rbf/witnesses.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void add(zs_rbf_samples *list, const double position[3], const double normal[3],
                double value)
{
  zs_rbf_sample sample = {.value = value};
  memcpy(sample.position, position, sizeof sample.position);
  memcpy(sample.normal, normal, sizeof sample.normal);
  assert_true(zs_rbf_samples_add(list, &sample, NULL));
}

/* Evenly over a sphere, by a spiral; on its other half only with `open`. */
static void add_sphere(zs_rbf_samples *list, const double middle[3], double radius, size_t count,
                       bool open)
{
  for (size_t i = 0; i < count; i++) {
    const double z = 1 - (2 * (double)i + 1) / (double)count, turn = 2.399963229728653 * (double)i;
    const double unit[3] = {sqrt(1 - z * z) * cos(turn), sqrt(1 - z * z) * sin(turn), z};
    double at[3];
    for (int k = 0; k < 3; k++)
      at[k] = middle[k] + radius * unit[k];
    if (!open || z > 0)
      add(list, at, unit, 0);
  }
}

static zs_rbf_constraints witnesses_of(const zs_rbf_samples *list, unsigned dimension)
{
  zs_rbf_constraints w;
  assert_true(zs_rbf_witnesses_make(&w, list, dimension, NULL));
  return w;
}

/* Two spheres, and one of them hollow: distances with the right sign, on both sides. */
static void sides_are_those_of_the_solid(void **state)
{
  (void)state;
  static const double a[3] = {10, 0, 0}, b[3] = {13, 0.5, 0};
  zs_rbf_samples list = {0};
  add_sphere(&list, a, 1, 600, false);
  add_sphere(&list, b, 1.5, 1400, false);
  const size_t shell = list.count;
  add_sphere(&list, b, 0.7, 900, false);
  for (size_t i = shell; i < list.count; i++)
    for (int k = 0; k < 3; k++)
      list.samples[i].normal[k] *= -3; /* of any length */
  zs_rbf_constraints w = witnesses_of(&list, 3);
  size_t inside = 0;
  double farthest = 0;
  for (size_t i = 0; i < w.count; i++) {
    const double *p = w.positions + 3 * i;
    const double to_a = sqrt(pow(p[0] - a[0], 2) + pow(p[1], 2) + pow(p[2], 2));
    const double to_b = sqrt(pow(p[0] - b[0], 2) + pow(p[1] - b[1], 2) + pow(p[2], 2));
    const double f = fmax(1 - to_a, fmin(1.5 - to_b, to_b - 0.7));
    assert_true((f > 0) == (w.values[i] > 0));
    assert_true(fabs(fabs(f) - fabs(w.values[i])) < 0.06);
    inside += f > 0;
    farthest = fmin(farthest, f);
  }
  assert_true(inside > 20 && w.count > 1000);
  assert_true(farthest < -1.4); /* beyond the box */
  zs_rbf_constraints_clear(&w);
  zs_rbf_samples_clear(&list);
}

/* Wherever the side is clear, a witness is nearer than the samples: what a fit does wrong there
 * is not much smaller than that. */
static void witnesses_are_the_closer_the_nearer_samples_are(void **state)
{
  (void)state;
  static const double middle[3] = {0, 0, 0};
  uint64_t seed = 5;
  zs_rbf_samples list = {0};
  add_sphere(&list, middle, 1, 4000, false);
  zs_rbf_constraints w = witnesses_of(&list, 3);
  for (int i = 0; i < 400; i++) {
    double p[3], length = 0, nearest = INFINITY;
    for (int k = 0; k < 3; k++) {
      p[k] = random_between(&seed, -1.3, 1.3);
      length += p[k] * p[k];
    }
    const double distance = fabs(1 - sqrt(length));
    for (size_t j = 0; j < w.count; j++) {
      double square = 0;
      for (size_t k = 0; k < 3; k++)
        square += pow(w.positions[3 * j + k] - p[k], 2);
      nearest = fmin(nearest, square);
    }
    if (distance > 0.2) /* samples are 0.06 apart */
      assert_true(sqrt(nearest) < distance);
  }
  zs_rbf_constraints_clear(&w);
  zs_rbf_samples_clear(&list);
}

static void sides_in_the_plane(void **state)
{
  (void)state;
  zs_rbf_samples list = {0};
  for (int i = 0; i < 200; i++) {
    const double turn = 2 * acos(-1.0) * i / 200;
    const double n[3] = {cos(turn), sin(turn), 0}, p[3] = {5 * n[0], 5 * n[1], 0};
    add(&list, p, n, 0);
  }
  zs_rbf_constraints w = witnesses_of(&list, 2);
  assert_true(w.count > 100);
  for (size_t i = 0; i < w.count; i++) {
    const double f = 5 - hypot(w.positions[2 * i], w.positions[2 * i + 1]);
    assert_true((f > 0) == (w.values[i] > 0) && fabs(f - w.values[i]) < 0.05);
  }
  zs_rbf_constraints_clear(&w);
  zs_rbf_samples_clear(&list);
}

/* Without an inside, nothing is known. */
static void open_or_bare_surfaces_have_none(void **state)
{
  (void)state;
  static const double middle[3] = {0, 0, 0}, point[3] = {1, 2, 3}, normal[3] = {0, 0, 1};
  zs_rbf_samples list = {0};
  zs_rbf_constraints w = witnesses_of(&list, 3);
  assert_int_equal(w.count, 0);
  for (int i = 0; i < 9; i++) /* all in one place */
    add(&list, point, normal, 0);
  w = witnesses_of(&list, 3);
  assert_int_equal(w.count, 0);
  zs_rbf_constraints_clear(&w);
  zs_rbf_samples_clear(&list);
  add_sphere(&list, middle, 1, 500, true);
  w = witnesses_of(&list, 3);
  assert_int_equal(w.count, 0);
  zs_rbf_constraints_clear(&w);
  zs_rbf_samples_clear(&list);
  add_sphere(&list, middle, 1, 500, false);
  for (size_t i = 0; i < list.count; i++) {
    list.samples[i].value = i % 2 ? 1 : 0;
    if (i % 2 == 0)
      memset(list.samples[i].normal, 0, sizeof list.samples[i].normal);
  }
  w = witnesses_of(&list, 3);
  assert_int_equal(w.count, 0);
  zs_rbf_constraints_clear(&w);
  zs_rbf_samples_clear(&list);
}

/* Contours of a ball: what lies between their planes is not known from samples alone. */
static void curves_have_none(void **state)
{
  (void)state;
  zs_rbf_samples list = {0};
  for (int plane = -4; plane <= 4; plane++)
    for (int i = 0; i < 120; i++) {
      const double z = 0.2 * plane, turn = 2 * acos(-1.0) * i / 120, r = sqrt(1 - z * z);
      const double n[3] = {cos(turn), sin(turn), 0}, p[3] = {r * n[0], r * n[1], z};
      add(&list, p, n, 0);
    }
  zs_rbf_constraints w = witnesses_of(&list, 3);
  assert_int_equal(w.count, 0);
  zs_rbf_constraints_clear(&w);
  zs_rbf_samples_clear(&list);
}

/* A fit is asked at every witness; those marked are far from each other. */
static bool stop(void *context, const char *stage, double fraction)
{
  (void)context;
  (void)stage;
  (void)fraction;
  return false;
}

static void objections_are_what_the_fit_gets_wrong(void **state)
{
  (void)state;
  enum { COUNT = 900 };
  static double positions[3 * COUNT], values[COUNT];
  static bool against[COUNT];
  uint64_t seed = 3;
  for (size_t i = 0; i < COUNT; i++) {
    for (size_t k = 0; k < 3; k++)
      positions[3 * i + k] = random_between(&seed, -1, 1);
    values[i] = 1 - 2 * positions[3 * i]; /* a half space */
  }
  const zs_rbf_problem problem = {.dimension = 3, .kernel = ZS_RBF_R3, .count = 200,
                                  .positions = positions, .values = values};
  zs_rbf *rbf = zs_rbf_fit(&problem, NULL, NULL, NULL);
  assert_non_null(rbf);
  size_t marked;
  assert_true(
    zs_rbf_witnesses_against(rbf, positions, values, COUNT, NULL, against, &marked, NULL));
  assert_int_equal(marked, 0);
  for (size_t i = 0; i < COUNT; i++) {
    assert_false(against[i]);
    if (positions[3 * i + 2] > 0.5)
      values[i] = -values[i];
  }
  assert_true(
    zs_rbf_witnesses_against(rbf, positions, values, COUNT, NULL, against, &marked, NULL));
  assert_true(marked > 1 && marked < 100);
  size_t found = 0;
  for (size_t i = 0; i < COUNT; i++) {
    found += against[i];
    assert_true(!against[i] || positions[3 * i + 2] > 0.5);
    for (size_t j = 0; against[i] && j < i; j++)
      if (against[j]) {
        double square = 0;
        for (size_t k = 0; k < 3; k++)
          square += pow(positions[3 * i + k] - positions[3 * j + k], 2);
        assert_true(sqrt(square) >= 0.5 * fmin(fabs(values[i]), fabs(values[j])));
      }
  }
  assert_int_equal(found, marked);
  const zs_control control = {.progress = stop};
  zs_diag diag = {0};
  assert_false(zs_rbf_witnesses_against(rbf, positions, values, COUNT, &control, against, &marked,
                                        &diag));
  assert_int_equal(diag.status, ZS_CANCELLED);
  zs_rbf_free(rbf);
}

/* Many samples have as many witnesses as there may be, and no more. */
static void there_are_not_too_many(void **state)
{
  (void)state;
  static const double middle[3] = {0, 0, 0};
  zs_rbf_samples list = {0};
  add_sphere(&list, middle, 1, 30000, false);
  zs_rbf_constraints w = witnesses_of(&list, 3);
  assert_true(w.count > 8000 && w.count < 65536);
  for (size_t i = 0; i < w.count; i++) {
    const double *p = w.positions + 3 * i, far = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    assert_true(fabs(1 - far - w.values[i]) < 0.02);
  }
  zs_rbf_constraints_clear(&w);
  zs_rbf_samples_clear(&list);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(sides_are_those_of_the_solid),
    cmocka_unit_test(witnesses_are_the_closer_the_nearer_samples_are),
    cmocka_unit_test(sides_in_the_plane),
    cmocka_unit_test(open_or_bare_surfaces_have_none),
    cmocka_unit_test(curves_have_none),
    cmocka_unit_test(there_are_not_too_many),
    cmocka_unit_test(objections_are_what_the_fit_gets_wrong),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
