/* Certified roots on lines: close to the sign change whatever the field, for
 * any number of lines, on every instruction set. */
#include "../random.h"
#include "formula.h"
#include "output/polygonize_roots.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

static const float TOLERANCE = 1e-6f;
static const double ROUNDING = 3e-7; /* of places and of f near 1 */
static const char *const ISAS[] = {"baseline", "avx2", "avx512"};

/* Zero on the unit sphere, each in its own way. */
#define DISTANCE "let d = 1 - sqrt(x*x + y*y + z*z); "
static const char *const fields[] = {
  DISTANCE "d",
  DISTANCE "d*d*d",
  DISTANCE "(d < 0 ? -1 : 1) * abs(d)^(1/3)",
  DISTANCE "d < 0 ? -1 : 1",
  DISTANCE "d < 0 ? 1e-3*d : d",
  DISTANCE "d < 0 ? d : 1e-3*d",
  DISTANCE "d * 1e30",
  DISTANCE "d * 1e-30",
  DISTANCE "d < 0 ? d : 1/0", /* infinite inside */
};

static void random_direction(uint64_t *seed, double u[3])
{
  double square;
  do {
    square = 0;
    for (int k = 0; k < 3; k++) {
      u[k] = random_between(seed, -1, 1);
      square += u[k] * u[k];
    }
  } while (square > 1 || square < 0.01);
  for (int k = 0; k < 3; k++)
    u[k] /= sqrt(square);
}

/* A line across the sphere; `known` says whether f at its ends is. */
static void add_line(zs_roots *roots, zs_eval *eval, uint64_t *seed, bool known)
{
  double u[3];
  float end[2][3], f[2] = {NAN, NAN};
  random_direction(seed, u);
  for (int e = 0; e < 2; e++) {
    double radius = e ? random_between(seed, 1.001, 1.05) : random_between(seed, 0.95, 0.999);
    double place[3];
    for (int k = 0; k < 3; k++) {
      end[e][k] = (float)(radius * u[k] + random_between(seed, -2e-4, 2e-4));
      place[k] = end[e][k];
    }
    if (known)
      f[e] = (float)zs_eval_point(eval, place);
  }
  zs_roots_add(roots, end[0], end[1], f[0], f[1]);
}

static double distance_of(float block[3][ZS_BLOCK], unsigned i)
{
  return sqrt(pow(block[0][i], 2) + pow(block[1][i], 2) + pow(block[2][i], 2)) - 1;
}

static void check_block(const char *formula, unsigned count, bool known, uint64_t *seed)
{
  zs_field *field = formula_field(formula);
  zs_eval *eval = zs_eval_new(field, NULL);
  zs_roots *roots = aligned_alloc(64, sizeof *roots);
  assert_non_null(eval);
  assert_non_null(roots);
  roots->count = 0;
  while (roots->count < count)
    add_line(roots, eval, seed, known);
  const zs_frame frame = zs_frame_at(NULL);
  uint64_t evaluations =
    zs_roots_solve(roots, eval, zs_field_program(field), &frame, TOLERANCE, 0);
  assert_true(evaluations <= 25 * (uint64_t)count); /* bisection takes 17 */
  for (unsigned i = 0; i < count; i++) {
    assert_true(fabs(distance_of(roots->found, i)) <= TOLERANCE + ROUNDING);
    double inside = distance_of(roots->inside, i);
    assert_true(inside <= ROUNDING && inside >= -5 * TOLERANCE);
  }
  free(roots);
  zs_eval_free(eval);
  zs_field_unref(field);
}

static void roots_are_certified_on_every_instruction_set(void **state)
{
  (void)state;
  for (size_t isa = 0; isa < sizeof ISAS / sizeof *ISAS; isa++) {
    uint64_t seed = 20070501;
    setenv("ZEROSET_ISA", ISAS[isa], 1);
    for (size_t i = 0; i < sizeof fields / sizeof *fields; i++)
      for (unsigned count = 1; count <= ZS_BLOCK; count += count < 34 ? 1 : 37)
        for (int known = 0; known < 2; known++)
          check_block(fields[i], count, known, &seed);
  }
  unsetenv("ZEROSET_ISA");
}

/* Roots at the very ends of their lines keep away from them. */
static void roots_stay_off_the_ends(void **state)
{
  (void)state;
  const float least = 0.125f;
  zs_field *field = formula_field("0.75 - x");
  zs_eval *eval = zs_eval_new(field, NULL);
  zs_roots *roots = aligned_alloc(64, sizeof *roots);
  assert_non_null(eval);
  assert_non_null(roots);
  const float a[3] = {0.25f, 0, 0}, b[3] = {0.75f, 0, 0}, c[3] = {1.25f, 0, 0},
              d[3] = {0.7500001f, 0, 0};
  roots->count = 0;
  zs_roots_add(roots, b, c, 0, -0.5f);
  zs_roots_add(roots, a, d, 0.5f, -1e-7f);
  const zs_frame frame = zs_frame_at(NULL);
  zs_roots_solve(roots, eval, zs_field_program(field), &frame, TOLERANCE, least);
  assert_float_equal(roots->found[0][0], 0.75f + least, 1e-6f);
  assert_float_equal(roots->found[0][1], 0.75f - least, 1e-6f);
  free(roots);
  zs_eval_free(eval);
  zs_field_unref(field);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(roots_are_certified_on_every_instruction_set),
    cmocka_unit_test(roots_stay_off_the_ends),
  };
  return cmocka_run_group_tests_name("roots", tests, NULL, NULL);
}
