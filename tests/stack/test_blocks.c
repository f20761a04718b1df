/* Fits in blocks: constraints are met, and what one fit gives is given by many. */
#include "../random.h"

#include "stack/blocks.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

enum { COUNT = 2000, SIDE = 60 };

static double smooth(double x, double y, double z)
{
  return sin(x / 9) * cos(y / 11) + z / 20;
}

static double value_at(const zs_blocks *blocks, double x, double y, double z)
{
  const bool wanted = true;
  double sum = 0, weight = 0;
  const zs_block_plane plane = {
    .z = z, .first = {x, y}, .size = {1, 1}, .wanted = &wanted, .sums = &sum, .weights = &weight};
  zs_blocks_add(blocks, &plane);
  assert_true(weight > 0);
  return sum / weight;
}

static void scatter(zs_block_constraint *c, uint64_t *state)
{
  for (int i = 0; i < COUNT; i++) {
    for (int k = 0; k < 3; k++)
      c[i].at[k] = random_between(state, 0, k < 2 ? SIDE : 12);
    c[i].value = smooth(c[i].at[0], c[i].at[1], c[i].at[2]);
  }
}

static void test_constraints_are_met(void **unused)
{
  (void)unused;
  static zs_block_constraint c[COUNT];
  uint64_t state = 1;
  scatter(c, &state);
  for (size_t most = 200; most <= 800; most *= 2) {
    zs_blocks blocks;
    assert_true(zs_blocks_make(&blocks, c, COUNT, &(zs_block_rules){most, 4, 0, 2}));
    assert_true(blocks.count >= COUNT / most);
    for (int i = 0; i < COUNT; i += 7)
      assert_true(fabs(value_at(&blocks, c[i].at[0], c[i].at[1], c[i].at[2]) - c[i].value) < 1e-4);
    for (int i = 0; i < 100; i++) {
      const double x = random_between(&state, 3, SIDE - 3), y = random_between(&state, 3, SIDE - 3);
      const double z = random_between(&state, 2, 10);
      assert_true(fabs(value_at(&blocks, x, y, z) - smooth(x, y, z)) < 0.02);
    }
    zs_blocks_clear(&blocks);
  }
}

/* Smoothing takes noise away, the more of it the greater it is, whatever the unit of length. */
static void test_smoothing(void **unused)
{
  (void)unused;
  static zs_block_constraint c[COUNT], far[COUNT];
  static const double smoothings[] = {0, 10, 1000};
  double before = INFINITY;
  uint64_t state = 3;
  scatter(c, &state);
  for (int i = 0; i < COUNT; i++) {
    c[i].value += random_between(&state, -0.3, 0.3);
    far[i] = c[i];
    for (int k = 0; k < 3; k++)
      far[i].at[k] *= 100;
  }
  for (int s = 0; s < 3; s++) {
    zs_blocks near_blocks, far_blocks;
    assert_true(zs_blocks_make(&near_blocks, c, COUNT, &(zs_block_rules){400, 4, smoothings[s], 1}));
    assert_true(zs_blocks_make(&far_blocks, far, COUNT,
                               &(zs_block_rules){400, 400, smoothings[s] * 1e6, 1}));
    double wrong = 0;
    for (int i = 0; i < COUNT; i += 5) {
      const double *p = c[i].at;
      const double f = value_at(&near_blocks, p[0], p[1], p[2]);
      assert_true(fabs(f - value_at(&far_blocks, 100 * p[0], 100 * p[1], 100 * p[2])) < 1e-3);
      wrong += pow(f - smooth(p[0], p[1], p[2]), 2);
    }
    assert_true(wrong < 0.8 * before);
    before = wrong;
    zs_blocks_clear(&near_blocks);
    zs_blocks_clear(&far_blocks);
  }
}

/* The sums of rows are those of their places, wanted ones only. */
static void test_rows(void **unused)
{
  (void)unused;
  static zs_block_constraint c[COUNT];
  static bool wanted[SIDE * SIDE];
  static double sums[SIDE * SIDE], weights[SIDE * SIDE];
  uint64_t state = 2;
  zs_blocks blocks;
  scatter(c, &state);
  assert_true(zs_blocks_make(&blocks, c, COUNT, &(zs_block_rules){400, 4, 0, 1}));
  for (int i = 0; i < SIDE * SIDE; i++) {
    wanted[i] = random_below(&state, 3) == 0;
    sums[i] = weights[i] = 0;
  }
  const zs_block_plane plane = {.z = 5, .size = {SIDE, SIDE}, .wanted = wanted, .sums = sums,
                                .weights = weights};
  zs_blocks_add(&blocks, &plane);
  for (int i = 0; i < SIDE * SIDE; i++) {
    if (!wanted[i])
      assert_true(sums[i] == 0 && weights[i] == 0);
    else if (i % 11 == 0)
      assert_true(fabs(sums[i] / weights[i] - value_at(&blocks, i % SIDE, i / SIDE, 5)) < 1e-9);
  }
  zs_blocks_clear(&blocks);
}

static void test_little(void **unused)
{
  (void)unused;
  const zs_block_constraint c[2] = {{{0, 0, 0}, 1}, {{1, 0, 0}, -1}};
  const bool wanted = true;
  double sum = 0, weight = 0;
  zs_blocks blocks;
  for (size_t count = 0; count <= 2; count++) { /* too few to say anything */
    assert_true(zs_blocks_make(&blocks, c, count, &(zs_block_rules){100, 4, 0, 1}));
    const zs_block_plane plane = {
      .size = {1, 1}, .wanted = &wanted, .sums = &sum, .weights = &weight};
    zs_blocks_add(&blocks, &plane);
    assert_true(weight == 0);
    zs_blocks_clear(&blocks);
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_constraints_are_met),
    cmocka_unit_test(test_smoothing),
    cmocka_unit_test(test_rows),
    cmocka_unit_test(test_little),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
