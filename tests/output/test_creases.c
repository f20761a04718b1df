/* Where the tangent planes of loops meet: against least squares of LAPACK, for any
 * number of loops, on every instruction set. */
#include "../random.h"

#include "output/polygonize_creases.h"

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

static const double LEAST_RATIO = 0.02; /* of eigenvalues that count */

static void random_unit(uint64_t *seed, double n[3])
{
  double length;
  do {
    for (int k = 0; k < 3; k++)
      n[k] = random_between(seed, -1, 1);
    length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  } while (length < 0.1 || length > 1);
  for (int k = 0; k < 3; k++)
    n[k] /= length;
}

/* A loop with normals of one to three sides, sometimes without one of them. */
static void add_random_loop(uint64_t *seed, zs_loops *loops)
{
  const unsigned at = loops->count++, length = 3 + random_below(seed, 5);
  const unsigned sides = 1 + random_below(seed, 3), missing = random_below(seed, 40);
  double side[3][3];
  for (unsigned i = 0; i < sides; i++)
    random_unit(seed, side[i]);
  loops->length[at] = (float)length;
  for (unsigned i = 0; i < length; i++)
    for (unsigned k = 0; k < 3; k++) {
      loops->point[i][k][at] = (float)random_between(seed, 4, 5);
      loops->normal[i][k][at] = i == missing ? 0 : (float)side[i % sides][k];
    }
}

static double dot(const zs_loops *loops, unsigned at, unsigned i, unsigned j)
{
  double sum = 0;
  for (int k = 0; k < 3; k++)
    sum += (double)loops->normal[i][k][at] * loops->normal[j][k][at];
  return sum;
}

/* Whether a loop is sharp; false in `clear` when rounding may decide. */
static bool is_sharp(const zs_loops *loops, unsigned at, bool *clear)
{
  const unsigned length = (unsigned)loops->length[at];
  double least = 1;
  bool there = true;
  for (unsigned i = 0; i < length; i++) {
    there = there && dot(loops, at, i, i) > 0;
    for (unsigned j = 0; j < i; j++)
      least = fmin(least, dot(loops, at, i, j));
  }
  *clear = fabs(least - ZS_SHARP) > 1e-5;
  return there && least < ZS_SHARP;
}

/* The shortest x closest to n x = distance for all planes, less the first vertex, and
 * to n x = 1.  False when rounding may decide how many directions count. */
static bool solve(const zs_loops *loops, unsigned at, double place[3], double direction[3])
{
  const int length = (int)loops->length[at];
  double a[ZS_LONGEST_LOOP * 3], b[ZS_LONGEST_LOOP * 2], mean[3] = {0}, s[3], size = 0;
  for (int i = 0; i < length; i++)
    for (int k = 0; k < 3; k++)
      mean[k] += (double)loops->point[i][k][at] / length;
  for (int i = 0; i < length; i++) {
    b[2 * i] = 0;
    b[2 * i + 1] = 1;
    for (int k = 0; k < 3; k++) {
      a[3 * i + k] = loops->normal[i][k][at];
      b[2 * i] += a[3 * i + k] * (loops->point[i][k][at] - mean[k]);
    }
  }
  lapack_int rank;
  if (LAPACKE_dgelsd(LAPACK_ROW_MAJOR, length, 3, 2, a, 3, b, 2, s, sqrt(LEAST_RATIO), &rank))
    return false;
  for (int k = 0; k < 3; k++) {
    place[k] = b[2 * k] + mean[k] - loops->point[0][k][at];
    direction[k] = b[2 * k + 1];
    size += direction[k] * direction[k];
    if (fabs(s[k] * s[k] / (s[0] * s[0]) - LEAST_RATIO) < 1e-4)
      return false;
  }
  for (int k = 0; k < 3; k++)
    direction[k] /= sqrt(size);
  return size > 1e-6;
}

static unsigned compare(const zs_loops *loops, uint64_t met)
{
  unsigned compared = 0;
  for (unsigned at = 0; at < loops->count; at++) {
    double place[3], direction[3];
    bool clear;
    const bool sharp = is_sharp(loops, at, &clear);
    if (!clear)
      continue;
    assert_int_equal(met >> at & 1, sharp);
    if (!sharp || !solve(loops, at, place, direction))
      continue;
    compared++;
    for (int k = 0; k < 3; k++) {
      assert_float_equal(loops->place[k][at], place[k], 2e-4);
      assert_float_equal(loops->direction[k][at], direction[k], 2e-4);
    }
  }
  return compared;
}

static void planes_meet_where_lapack_says(void **state)
{
  (void)state;
  static zs_loops loops;
  for (unsigned isa = 0; isa <= (unsigned)zs_isa_select(); isa++) {
    const zs_crease_kernels *kernels = zs_crease_kernels_of((zs_isa_kind)isa);
    uint64_t seed = 3;
    unsigned compared = 0;
    for (int n = 0; n < 400; n++) {
      const unsigned count = random_below(&seed, ZS_LOOPS + 1);
      loops.count = 0;
      while (loops.count < count)
        add_random_loop(&seed, &loops);
      const uint64_t met = kernels->meet(&loops);
      assert_int_equal(count < ZS_LOOPS ? met >> count : 0, 0);
      compared += compare(&loops, met);
    }
    assert_true(compared > 5000);
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {cmocka_unit_test(planes_meet_where_lapack_says)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
