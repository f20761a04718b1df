/* Where planes meet: eigenvalues against LAPACK, places against search. */
#include "../random.h"

#include "output/quadric.h"

#include <lapacke.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const double BELOW[3] = {-INFINITY, -INFINITY, -INFINITY},
                    ABOVE[3] = {INFINITY, INFINITY, INFINITY};

/* A symmetric matrix of rank 1, 2 or 3 whose entries have very different sizes. */
static void random_symmetric(uint64_t *seed, double a[3][3])
{
  unsigned rank = 1 + random_below(seed, 3);
  memset(a, 0, 9 * sizeof(double));
  for (unsigned i = 0; i < rank; i++) {
    double u[3], weight = pow(10, random_between(seed, -8, 4));
    for (int k = 0; k < 3; k++)
      u[k] = random_below(seed, 4) ? random_between(seed, -1, 1) : 0;
    for (int k = 0; k < 3; k++)
      for (int l = 0; l < 3; l++)
        a[k][l] += weight * u[k] * u[l] * (i == 2 ? -1 : 1);
  }
}

static int compare_numbers(const void *a, const void *b)
{
  double p = *(const double *)a, q = *(const double *)b;
  return (p > q) - (p < q);
}

/* Eigenvalues as LAPACK has them; a v = v diag, and v is orthogonal. */
static void eigenvalues_agree_with_lapack(void **state)
{
  (void)state;
  uint64_t seed = 11;
  for (int n = 0; n < 2000; n++) {
    double a[3][3], diagonal[3][3], v[3][3], reference[9], expected[3], found[3];
    random_symmetric(&seed, a);
    memcpy(diagonal, a, sizeof a);
    memcpy(reference, a, sizeof a);
    zs_symmetric_diagonalize(diagonal, v);
    assert_int_equal(LAPACKE_dsyev(LAPACK_ROW_MAJOR, 'N', 'U', 3, reference, 3, expected), 0);
    double size = fmax(fabs(expected[0]), fabs(expected[2]));
    for (int k = 0; k < 3; k++)
      found[k] = diagonal[k][k];
    qsort(found, 3, sizeof *found, compare_numbers);
    for (int k = 0; k < 3; k++) {
      assert_true(fabs(found[k] - expected[k]) <= 1e-14 * size);
      for (int l = 0; l < 3; l++) {
        double product = 0, dot = 0;
        for (int m = 0; m < 3; m++) {
          product += a[k][m] * v[m][l];
          dot += v[m][k] * v[m][l];
        }
        assert_true(fabs(product - v[k][l] * diagonal[l][l]) <= 1e-14 * size);
        assert_true(fabs(dot - (k == l)) <= 1e-14);
      }
    }
  }
}

static void random_unit(uint64_t *seed, float unit[3])
{
  double u[3], length = 0;
  while (length < 0.1) {
    for (int k = 0; k < 3; k++)
      u[k] = random_between(seed, -1, 1);
    length = hypot(hypot(u[0], u[1]), u[2]);
  }
  for (int k = 0; k < 3; k++)
    unit[k] = (float)(u[k] / length);
}

static double along(const float normal[3], const double x[3])
{
  return normal[0] * x[0] + normal[1] * x[1] + normal[2] * x[2];
}

/* Planes through one point have it in common: all of it in a corner, the nearest
 * place on the edge or plane else. */
static void planes_meet_where_they_do(void **state)
{
  (void)state;
  static const float normals[3][3] = {{1, 0, 0}, {0, 0.6f, 0.8f}, {0, -0.8f, 0.6f}};
  static const double point[3] = {0.3, -0.2, 0.4};
  for (unsigned rank = 1; rank <= 3; rank++) {
    zs_quadric q = {{{0}}, {0}};
    double place[3], square = 0;
    for (unsigned i = 0; i < 5; i++)
      zs_quadric_add(&q, normals[i % rank], along(normals[i % rank], point));
    assert_int_equal(zs_quadric_minimize(&q, BELOW, ABOVE, place), rank);
    for (unsigned i = 0; i < rank; i++) {
      double d = along(normals[i], point);
      assert_true(fabs(along(normals[i], place) - d) < 1e-7);
      square += d * d; /* the normals are perpendicular to each other */
    }
    assert_true(fabs(sqrt(square) - hypot(hypot(place[0], place[1]), place[2])) < 1e-7);
  }
}

static double energy(const zs_quadric *q, const double x[3])
{
  double sum = 0;
  for (int k = 0; k < 3; k++) {
    sum -= 2 * q->b[k] * x[k];
    for (int l = 0; l < 3; l++)
      sum += q->a[k][l] * x[k] * x[l];
  }
  return sum;
}

/* The place is in the box, and no other in the box is better. */
static void boxes_hold_the_best_place(void **state)
{
  (void)state;
  uint64_t seed = 3;
  unsigned sides = 0;
  for (int n = 0; n < 300; n++) {
    zs_quadric q = {{{0}}, {0}};
    for (unsigned i = 0; i < 5; i++) {
      float normal[3];
      random_unit(&seed, normal);
      zs_quadric_add(&q, normal, random_between(&seed, -1, 1));
    }
    double lo[3], hi[3], place[3];
    for (int k = 0; k < 3; k++) {
      lo[k] = random_between(&seed, -0.5, 0);
      hi[k] = random_below(&seed, 8) ? random_between(&seed, 0, 0.5) : lo[k];
    }
    unsigned rank = zs_quadric_minimize(&q, lo, hi, place);
    for (int k = 0; k < 3; k++) {
      assert_true(place[k] >= lo[k] && place[k] <= hi[k]);
      sides += place[k] == lo[k] || place[k] == hi[k];
    }
    if (rank < 3)
      continue; /* directions left alone may have had a little to win */
    double least = energy(&q, place);
    for (int i = 0; i < 500; i++) {
      double x[3];
      for (int k = 0; k < 3; k++) {
        double other = random_between(&seed, lo[k], hi[k]);
        x[k] = i % 2 ? other : place[k] + 0.01 * (other - place[k]);
      }
      assert_true(energy(&q, x) >= least - 1e-12);
    }
  }
  assert_true(sides > 100);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(eigenvalues_agree_with_lapack),
    cmocka_unit_test(planes_meet_where_they_do),
    cmocka_unit_test(boxes_hold_the_best_place),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
