/* Normals of bare points: across the surface, all of them out of the solid. */
#include "../random.h"

#include "rbf/normals.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static void add(zs_rbf_samples *list, double x, double y, double z)
{
  const zs_rbf_sample sample = {.position = {x, y, z}, .estimate = true};
  assert_true(zs_rbf_samples_add(list, &sample, NULL));
}

static double dot(const double a[3], const double b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The least cosine between the normals and the true ones. */
static double least_cosine(const zs_rbf_samples *list, void (*normal)(const double *, double *))
{
  double least = 1;
  for (size_t i = 0; i < list->count; i++) {
    double n[3];
    normal(list->samples[i].position, n);
    least = fmin(least, dot(list->samples[i].normal, n));
    assert_false(list->samples[i].estimate);
  }
  return least;
}

static void of_sphere(const double *p, double *n)
{
  const double r = sqrt(dot(p, p));
  for (int k = 0; k < 3; k++)
    n[k] = p[k] / r;
}

static void of_torus(const double *p, double *n)
{
  const double r = hypot(p[0], p[1]), c[3] = {3 * p[0] / r, 3 * p[1] / r, 0};
  for (int k = 0; k < 3; k++)
    n[k] = p[k] - c[k];
}

static void of_plate(const double *p, double *n)
{
  n[0] = n[1] = 0;
  n[2] = p[2] > 0 ? 1 : -1;
}

static void on_spheres_and_tori(void **state)
{
  (void)state;
  zs_rbf_samples sphere = {0}, torus = {0};
  for (int i = 0; i < 500; i++) {
    const double z = 1 - (2 * i + 1) / 500.0, r = sqrt(1 - z * z), a = 2.399963229728653 * i;
    add(&sphere, r * cos(a), r * sin(a), z);
  }
  uint64_t seed = 1;
  for (int i = 0; i < 4000; i++) {
    const double u = random_between(&seed, 0, 6.283185), v = random_between(&seed, 0, 6.283185);
    add(&torus, (3 + cos(v)) * cos(u), (3 + cos(v)) * sin(u), sin(v));
  }
  assert_true(zs_rbf_normals_estimate(&sphere, 3, NULL, NULL, NULL));
  assert_true(zs_rbf_normals_estimate(&torus, 3, NULL, NULL, NULL));
  assert_true(least_cosine(&sphere, of_sphere) > 0.99);
  assert_true(least_cosine(&torus, of_torus) > 0.7);
  zs_rbf_samples_clear(&sphere);
  zs_rbf_samples_clear(&torus);
}

/* The two sides of plates, little farther from each other than neighbouring points
 * are: there are as many on the other side as around a point.  Two that do not
 * touch. */
static void on_both_sides_of_plates(void **state)
{
  (void)state;
  zs_rbf_samples plate = {0};
  for (int i = 0; i < 30; i++)
    for (int j = 0; j < 30; j++) {
      add(&plate, i, j, 0.75);
      add(&plate, i, j, -0.75);
    }
  for (int i = 0; i < 30; i++)
    for (int j = 0; j < 30; j++) {
      add(&plate, i + 100, j, 1.1);
      add(&plate, i + 100, j, -1.1);
    }
  assert_true(zs_rbf_normals_estimate(&plate, 3, NULL, NULL, NULL));
  size_t good = 0, bad = 0;
  for (size_t i = 0; i < plate.count; i++) {
    double n[3];
    of_plate(plate.samples[i].position, n);
    good += dot(plate.samples[i].normal, n) > 0.9;
    bad += dot(plate.samples[i].normal, n) < 0;
  }
  /* The rims have no side of their own. */
  assert_true(good > plate.count * 80 / 100 && bad < plate.count / 100);
  zs_rbf_samples_clear(&plate);
}

static void in_the_plane(void **state)
{
  (void)state;
  zs_rbf_samples circle = {0};
  for (int i = 0; i < 40; i++)
    add(&circle, cos(i * 0.15708), sin(i * 0.15708), 0);
  assert_true(zs_rbf_normals_estimate(&circle, 2, NULL, NULL, NULL));
  assert_true(least_cosine(&circle, of_sphere) > 0.97);
  for (size_t i = 0; i < circle.count; i++)
    assert_true(circle.samples[i].normal[2] == 0);
  zs_rbf_samples_clear(&circle);
}

/* Samples that are not asked for keep what they have. */
static void others_are_left_alone(void **state)
{
  (void)state;
  zs_rbf_samples list = {0};
  for (int i = 0; i < 20; i++)
    add(&list, i % 5, i / 5, 0);
  list.samples[3].estimate = false;
  list.samples[3].normal[0] = 5;
  list.samples[4].estimate = false;
  assert_true(zs_rbf_normals_estimate(&list, 3, NULL, NULL, NULL));
  assert_true(list.samples[3].normal[0] == 5 && list.samples[3].normal[2] == 0);
  assert_true(list.samples[4].normal[2] == 0);
  assert_true(fabs(list.samples[5].normal[2]) > 0.999);
  for (size_t i = 5; i < 20; i++)
    assert_true(list.samples[i].normal[2] * list.samples[5].normal[2] > 0);
  zs_rbf_samples_clear(&list);
}

static void keep_message(void *context, const zs_diagnostic *diagnostic)
{
  snprintf(context, 512, "%s", diagnostic->message);
}

static void fails_with(zs_rbf_samples *list, unsigned dimension, const char *part)
{
  char message[512] = "";
  zs_diag diag = {.report = keep_message, .context = message};
  assert_false(zs_rbf_normals_estimate(list, dimension, NULL, NULL, &diag));
  assert_int_equal(diag.status, ZS_ERROR_GEOMETRY);
  if (!strstr(message, part))
    fail_msg("%s", message);
  zs_rbf_samples_clear(list);
}

static void sets_without_normals_are_refused(void **state)
{
  (void)state;
  zs_rbf_samples list = {0};
  assert_true(zs_rbf_normals_estimate(&list, 3, NULL, NULL, NULL)); /* nothing is asked for */
  for (int i = 0; i < 5; i++)
    add(&list, i, i * i, 1 - i);
  fails_with(&list, 3, "5 points are too few");
  for (int i = 0; i < 3; i++)
    add(&list, i, i * i, 0);
  fails_with(&list, 2, "3 points are too few");
  for (int i = 0; i < 30; i++)
    add(&list, i, 2 * i + 1, 3 * i);
  fails_with(&list, 3, "on one line");
  for (int i = 0; i < 30; i++)
    add(&list, 1, 2, 3);
  fails_with(&list, 3, "all in one place");
  for (int i = 0; i < 30; i++)
    add(&list, 1, 2, 0);
  fails_with(&list, 2, "all in one place");
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(on_spheres_and_tori),
    cmocka_unit_test(on_both_sides_of_plates),
    cmocka_unit_test(in_the_plane),
    cmocka_unit_test(others_are_left_alone),
    cmocka_unit_test(sets_without_normals_are_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
