/* The blends: blocks, gradients, bounds and choices of every operation on every
 * instruction set, against the definitions in double precision. */
#include "../random.h"

#include "field/blend.h"
#include "field/field.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

typedef struct example {
  const zs_operation *operation;
  zs_blend data;
} example;

static const example EXAMPLES[] = {
  {&zs_r_alpha, {1, {0}}},
  {&zs_r_alpha, {-1, {0}}},
  {&zs_r_alpha, {1, {0.7}}},
  {&zs_r_alpha, {-1, {-0.8}}},
  {&zs_r_alpha, {1, {-0.999}}},
  {&zs_r_alpha, {-1, {0.9999}}},
  {&zs_r_m, {1, {2}}},
  {&zs_r_m, {-1, {4}}},
  {&zs_r_displaced, {1, {0.5, 1, 1}}},
  {&zs_r_displaced, {-1, {-0.4, 0.3, 2}}},
  {&zs_smooth_quadratic, {1, {0.5}}},
  {&zs_smooth_quadratic, {-1, {2}}},
  {&zs_smooth_cubic, {1, {0.5}}},
  {&zs_smooth_cubic, {-1, {2}}},
  {&zs_smooth_circular, {1, {0.5}}},
  {&zs_smooth_circular, {-1, {2}}},
  {&zs_smooth_chamfer, {1, {0.5}}},
  {&zs_smooth_chamfer, {-1, {2}}},
  {&zs_smooth_exponential, {1, {0.5}}},
  {&zs_smooth_exponential, {-1, {2}}},
  {&zs_interpolation, {0, {0}}},
};
enum { EXAMPLE_COUNT = sizeof EXAMPLES / sizeof EXAMPLES[0] };

static bool is_r_m(const example *e)
{
  return e->operation == &zs_r_m;
}

/* Call `test` for every example with every set of kernels the machine has. */
static void for_every_example(void (*test)(const example *, const zs_kernels *, uint64_t *))
{
  uint64_t state = 17;
  for (int i = 0; i < EXAMPLE_COUNT; i++)
    for (unsigned isa = 0; isa <= zs_isa_select(); isa++)
      test(&EXAMPLES[i], EXAMPLES[i].operation->kernels[isa], &state);
}

/* A value as blends meet them: of all sizes, now and then 0 or equal to the
 * other. */
static float random_value(float other, uint64_t *state)
{
  switch (random_below(state, 8)) {
  case 0:
    return 0;
  case 1:
    return other;
  case 2:
    return -other;
  case 3:
    return (float)(exp(random_between(state, -12, 5)) * (random_below(state, 2) ? 1 : -1));
  default:
    return (float)random_between(state, -3, 3);
  }
}

/* Rows of values and gradients in registers. */
typedef struct block {
  _Alignas(64) float in[3][4 * ZS_BLOCK];
  _Alignas(64) float out[4 * ZS_BLOCK];
} block;

static void fill(block *b, uint64_t *state)
{
  for (unsigned i = 0; i < ZS_BLOCK; i++) {
    b->in[0][i] = random_value(1, state);
    b->in[1][i] = random_value(b->in[0][i], state);
    b->in[2][i] = (float)random_between(state, -0.5, 1.5);
    /* Input k changes along axis k only: the result's rows are its derivatives. */
    for (unsigned k = 0; k < 3; k++)
      for (unsigned row = 1; row < 4; row++)
        b->in[k][row * ZS_BLOCK + i] = row == k + 1;
  }
}

static void run(const example *e, void (*kernel)(const zs_block_arguments *), block *b)
{
  const zs_block_arguments arguments = {
    .data = &e->data, .n = ZS_BLOCK, .in = {b->in[0], b->in[1], b->in[2]}, .out = b->out};
  kernel(&arguments);
}

static double reference(const example *e, const float in[3])
{
  const double x[3] = {in[0], in[1], in[2]};
  return e->operation->reference(&e->data, x);
}

static void check_value(const example *e, const float in[3], float out)
{
  const double expected = reference(e, in);
  const double size = fabs(in[0]) + fabs(in[1]);
  const double scale = is_r_m(e) ? size * pow(size, e->data.parameter[0])
                                 : size + fabs(e->data.parameter[0]);
  const double tolerance = 1e-20 + 1e-6 * fmax(scale, fabs(expected));
  if (!(fabs(out - expected) <= tolerance) && out != (float)expected)
    fail_msg("%s (%g, %g, %g): %.9g, expected %.9g", e->operation->name, in[0], in[1], in[2], out,
             expected);
}

static void check_values(const example *e, const zs_kernels *kernels, uint64_t *state)
{
  static block b;
  for (int repeat = 0; repeat < 20; repeat++) {
    fill(&b, state);
    run(e, kernels->value, &b);
    for (unsigned i = 0; i < ZS_BLOCK; i++)
      check_value(e, (const float[]){b.in[0][i], b.in[1][i], b.in[2][i]}, b.out[i]);
    run(e, kernels->gradient, &b);
    for (unsigned i = 0; i < ZS_BLOCK; i++)
      check_value(e, (const float[]){b.in[0][i], b.in[1][i], b.in[2][i]}, b.out[i]);
  }
}

static void test_values(void **unused)
{
  (void)unused;
  for_every_example(check_values);
}

/* The output may be an input. */
static void check_in_place(const example *e, const zs_kernels *kernels, uint64_t *state)
{
  static block b;
  for (unsigned k = 0; k < e->operation->arity; k++) {
    fill(&b, state);
    run(e, kernels->gradient, &b);
    const zs_block_arguments arguments = {
      .data = &e->data, .n = ZS_BLOCK, .in = {b.in[0], b.in[1], b.in[2]}, .out = b.in[k]};
    kernels->gradient(&arguments);
    assert_memory_equal(b.in[k], b.out, sizeof b.out);
  }
}

static void test_in_place(void **unused)
{
  (void)unused;
  for_every_example(check_in_place);
}

static void check_gradients(const example *e, const zs_kernels *kernels, uint64_t *state)
{
  static block b;
  int smooth = 0;
  for (int repeat = 0; repeat < 20; repeat++) {
    fill(&b, state);
    run(e, kernels->gradient, &b);
    for (unsigned i = 0; i < ZS_BLOCK; i++) {
      const double x[3] = {b.in[0][i], b.in[1][i], b.in[2][i]};
      const double h = 1e-6, f = e->operation->reference(&e->data, x);
      for (unsigned k = 0; k < e->operation->arity; k++) {
        double y[3] = {x[0], x[1], x[2]};
        y[k] = x[k] + h;
        const double above = e->operation->reference(&e->data, y);
        y[k] = x[k] - h;
        const double below = e->operation->reference(&e->data, y);
        const double slope = (above - below) / (2 * h);
        if (fabs(above - 2 * f + below) > 1e-4 * h * (1 + fabs(slope)))
          continue; /* a kink */
        smooth++;
        if (!(fabs(b.out[(k + 1) * ZS_BLOCK + i] - slope) <= 1e-3 * (1 + fabs(slope))))
          fail_msg("%s (%g, %g, %g): derivative by %u is %g, differences %g", e->operation->name,
                   x[0], x[1], x[2], k, b.out[(k + 1) * ZS_BLOCK + i], slope);
      }
    }
  }
  assert_true(smooth > 20 * ZS_BLOCK);
}

static void test_gradients(void **unused)
{
  (void)unused;
  for_every_example(check_gradients);
}

/* Infinite operands: union with nothing, intersection with everything, and
 * their opposites. */
static void check_infinities(const example *e, const zs_kernels *kernels, uint64_t *state)
{
  (void)state;
  static block b;
  static const float values[] = {-INFINITY, -2, 0, 3, INFINITY};
  if (e->operation == &zs_interpolation)
    return;
  memset(&b, 0, sizeof b);
  for (unsigned i = 0; i < 25; i++) {
    b.in[0][i] = values[i / 5];
    b.in[1][i] = values[i % 5];
  }
  run(e, kernels->value, &b);
  for (unsigned i = 0; i < 25; i++) {
    const float p = b.in[0][i], q = b.in[1][i];
    if (!isinf(p) && !isinf(q))
      continue;
    const float one = e->data.side > 0 ? fmaxf(p, q) : fminf(p, q);
    /* r-m multiplies by a power of the operands: only the sign is left. */
    if (is_r_m(e))
      assert_true((b.out[i] > 0) - (b.out[i] < 0) == (one > 0) - (one < 0));
    else
      assert_true(b.out[i] == one || fabsf(b.out[i] - one) < 1e-6f);
    const float in[3] = {p, q, 0};
    if (!is_r_m(e))
      assert_true(reference(e, in) == (double)b.out[i]);
  }
}

static void test_infinities(void **unused)
{
  (void)unused;
  for_every_example(check_infinities);
}

/* Whether nothing but the signs of the operands matters for the sign of f. */
static bool is_sign_transparent(const example *e)
{
  const zs_demand sign = {0, 0};
  if (!e->operation->demand)
    return false;
  const zs_demand inputs = e->operation->demand(&e->data, sign);
  return inputs.below == 0 && inputs.above == 0;
}

/* The signs alone decide, down to the rounding. */
static void check_signs(const example *e, const zs_kernels *kernels, uint64_t *state)
{
  static block b;
  if (!is_sign_transparent(e))
    return;
  for (int repeat = 0; repeat < 50; repeat++) {
    fill(&b, state);
    for (unsigned i = 0; i < ZS_BLOCK; i++) {
      const double scale = exp(random_between(state, -60, 60));
      b.in[0][i] *= (float)scale;
      b.in[1][i] *= random_below(state, 2) ? (float)scale : 1;
    }
    run(e, kernels->value, &b);
    for (unsigned i = 0; i < ZS_BLOCK; i++) {
      const float p = b.in[0][i], q = b.in[1][i];
      const float one = e->data.side > 0 ? fmaxf(p, q) : fminf(p, q);
      if ((b.out[i] > 0) - (b.out[i] < 0) != (one > 0) - (one < 0))
        fail_msg("%s (%g, %g) is %g", e->operation->name, p, q, b.out[i]);
    }
  }
}

static void test_signs(void **unused)
{
  (void)unused;
  for_every_example(check_signs);
}

/* ---- Bounds ------------------------------------------------------------------------- */

typedef struct intervals {
  zs_bounds in[3], out;
  zs_choice choice;
  zs_demand demand;
} intervals;

static void random_interval(zs_bounds *bounds, unsigned lane, bool unit, uint64_t *state)
{
  const double size = exp(random_between(state, -9, 1.5));
  const double middle = unit ? random_between(state, -0.5, 1.5) : random_between(state, -3, 3);
  bounds->lo[lane] = (float)(middle - size / 2);
  bounds->hi[lane] = (float)(middle + size / 2);
  if (random_below(state, 20) == 0)
    bounds->hi[lane] = bounds->lo[lane];
  if (random_below(state, 20) == 0)
    bounds->lo[lane] = 0;
  if (bounds->lo[lane] > bounds->hi[lane])
    bounds->lo[lane] = bounds->hi[lane];
}

static void run_bounds(const example *e, const zs_kernels *kernels, intervals *b)
{
  memset(&b->choice, 0, sizeof b->choice);
  const zs_bounds_arguments arguments = {.data = &e->data,
                                         .in = {&b->in[0], &b->in[1], &b->in[2]},
                                         .out = &b->out,
                                         .demand = b->demand,
                                         .choice = e->operation->choice ? &b->choice : NULL};
  kernels->bounds(&arguments);
}

static float between(float lo, float hi, uint64_t *state)
{
  switch (random_below(state, 6)) {
  case 0:
    return lo;
  case 1:
    return hi;
  case 2:
    return lo <= 0 && hi >= 0 ? 0 : lo;
  default:
    return fminf(fmaxf((float)random_between(state, lo, hi), lo), hi);
  }
}

/* Whether one value does as well as another where the demand is such: both are
 * beyond it on the same side, or they are equal.  Signs have no rounding. */
static bool does_as_well(zs_demand demand, float a, float b)
{
  if (demand.below == 0 && demand.above == 0)
    return (a > 0) - (a < 0) == (b > 0) - (b < 0);
  return a == b || (a < -demand.below && b < -demand.below) ||
         (a > demand.above && b > demand.above);
}

/* Samples of one lane's box: values are within, copies are copies, and what is
 * said to do as well does. */
static void check_lane(const example *e, const zs_kernels *kernels, const intervals *b,
                       unsigned lane, uint64_t *state)
{
  static block x;
  const float lo = b->out.lo[lane], hi = b->out.hi[lane];
  if (!(lo <= hi))
    fail_msg("%s (%g .. %g, %g .. %g, %g .. %g): %g .. %g", e->operation->name, b->in[0].lo[lane],
             b->in[0].hi[lane], b->in[1].lo[lane], b->in[1].hi[lane], b->in[2].lo[lane],
             b->in[2].hi[lane], lo, hi);
  for (unsigned i = 0; i < ZS_BLOCK; i++)
    for (unsigned k = 0; k < 3; k++)
      x.in[k][i] = between(b->in[k].lo[lane], b->in[k].hi[lane], state);
  run(e, kernels->value, &x);
  for (unsigned i = 0; i < ZS_BLOCK; i++) {
    const float in[3] = {x.in[0][i], x.in[1][i], x.in[2][i]};
    const double exact = reference(e, in);
    if (!(x.out[i] >= lo && x.out[i] <= hi) || !(exact >= lo && exact <= hi))
      fail_msg("%s (%.9g, %.9g, %.9g): %.9g, %.12g outside %.9g .. %.9g", e->operation->name, in[0],
               in[1], in[2], x.out[i], exact, lo, hi);
    for (unsigned k = 0; k < e->operation->arity; k++) {
      if (b->choice.copy[k] >> lane & 1)
        assert_memory_equal(&x.out[i], &in[k], sizeof in[k]);
      if (b->choice.sign[k] >> lane & 1)
        assert_true(does_as_well(b->demand, x.out[i], in[k]));
    }
  }
}

static void check_bounds(const example *e, const zs_kernels *kernels, uint64_t *state)
{
  static intervals b;
  unsigned chosen = 0;
  for (int repeat = 0; repeat < 40; repeat++) {
    for (unsigned l = 0; l < ZS_LANES; l++)
      for (unsigned k = 0; k < 3; k++)
        random_interval(&b.in[k], l, k == 2, state);
    b.demand = (zs_demand){0, 0};
    if (repeat % 2)
      b.demand = (zs_demand){(float)random_between(state, -1, 2), (float)random_between(state, -1, 2)};
    run_bounds(e, kernels, &b);
    for (unsigned l = 0; l < ZS_LANES; l++)
      check_lane(e, kernels, &b, l, state);
    for (unsigned k = 0; k < 3; k++)
      chosen |= b.choice.copy[k] | b.choice.sign[k];
  }
  assert_true(!e->operation->choice || chosen);
}

static void test_bounds(void **unused)
{
  (void)unused;
  for_every_example(check_bounds);
}

/* A single point has a narrow interval; what is unknown stays so; and infinite
 * ends are not lost. */
static void check_special_bounds(const example *e, const zs_kernels *kernels, uint64_t *state)
{
  static intervals b;
  for (unsigned l = 0; l < ZS_LANES; l++)
    for (unsigned k = 0; k < 3; k++) {
      const float v = k == 2 ? 0.5f : (float)random_between(state, -3, 3);
      b.in[k].lo[l] = b.in[k].hi[l] = v;
    }
  b.in[0].lo[3] = b.in[0].hi[3] = NAN;
  b.in[1].lo[4] = b.in[1].hi[4] = NAN;
  b.in[0].lo[5] = -INFINITY;
  b.in[1].hi[6] = INFINITY;
  run_bounds(e, kernels, &b);
  for (unsigned l = 0; l < ZS_LANES; l++) {
    const float lo = b.out.lo[l], hi = b.out.hi[l];
    if (l == 3 || l == 4) {
      assert_true(isnan(lo) && isnan(hi));
      for (unsigned k = 0; k < 3; k++)
        assert_false((b.choice.copy[k] | b.choice.sign[k]) >> l & 1);
      continue;
    }
    const float below[3] = {l == 5 ? -9e9f : b.in[0].lo[l], b.in[1].lo[l], 0.5f};
    const float above[3] = {b.in[0].hi[l], l == 6 ? 9e9f : b.in[1].hi[l], 0.5f};
    if (isnan(lo) && isnan(hi) && (l == 5 || l == 6) && is_r_m(e))
      continue; /* infinity times the power's interval: unknown is honest */
    assert_true(reference(e, below) >= lo && reference(e, above) <= hi);
    const float size = 1 + fabsf(hi);
    if (l != 5 && l != 6 && !(hi - lo <= 1e-4f * size))
      fail_msg("%s (%g, %g): %g .. %g", e->operation->name, b.in[0].hi[l], b.in[1].hi[l], lo, hi);
  }
}

static void test_special_bounds(void **unused)
{
  (void)unused;
  for_every_example(check_special_bounds);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_values),     cmocka_unit_test(test_in_place),
    cmocka_unit_test(test_gradients),  cmocka_unit_test(test_infinities),
    cmocka_unit_test(test_signs),      cmocka_unit_test(test_bounds),
    cmocka_unit_test(test_special_bounds),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
