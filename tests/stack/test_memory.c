/* Memory that runs out while slices are joined is told, or has changed nothing. */
#include "../failing_allocation.h"

#include "stack/join.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = 10, SLICES = 3 };

/* Discs that move aside and become smaller. */
static zs_slices make_slices(void)
{
  zs_slices s = {0};
  for (int i = 0; i < SLICES; i++) {
    float pixels[SIDE * SIDE];
    for (int p = 0; p < SIDE * SIDE; p++)
      pixels[p] = hypot(p % SIDE - 4.0 - i, p / SIDE - 4.5) < 3.2 - 0.5 * i;
    const zs_picture picture = {SIDE, SIDE, pixels, 0.5F};
    assert_true(zs_slices_add(&s, &picture, 3.0 * i));
  }
  return s;
}

static bool is_same(const zs_raster *a, const zs_raster *b)
{
  if (memcmp(a->count, b->count, sizeof a->count) != 0)
    return false;
  for (size_t z = 0; z < a->count[2]; z++)
    for (size_t y = 0; y < a->count[1]; y++)
      if (memcmp(zs_raster_sample(a, 0, y, z), zs_raster_sample(b, 0, y, z),
                 a->count[0] * sizeof(float)) != 0)
        return false;
  return true;
}

/* Fail the n-th allocation, for every n, until there are fewer. */
static void exhaust(zs_join_method method)
{
  zs_slices slices = make_slices();
  const zs_control control = {.threads = 1};
  zs_joined whole, joined;
  assert_int_equal(zs_slices_join(&whole, &slices, method, &control), ZS_JOIN_DONE);
  unsigned long n = 0;
  for (bool passed = false; !passed;) {
    assert_true(++n < 100000);
    until_failure = n;
    const zs_join_result result = zs_slices_join(&joined, &slices, method, &control);
    passed = until_failure > 0;
    until_failure = 0;
    assert_true(result == ZS_JOIN_DONE || (!passed && result == ZS_JOIN_MEMORY));
    if (result == ZS_JOIN_DONE && !is_same(whole.raster, joined.raster))
      fail_msg("allocation %lu changed the solid", n);
    if (result == ZS_JOIN_DONE)
      zs_joined_clear(&joined);
  }
  assert_true(n > 5);
  zs_joined_clear(&whole);
  zs_slices_clear(&slices);
}

static void test_linear(void **state)
{
  (void)state;
  exhaust(ZS_JOIN_LINEAR);
}

static void test_extended(void **state)
{
  (void)state;
  exhaust(ZS_JOIN_EXTENDED);
}

static void test_auto(void **state)
{
  (void)state;
  exhaust(ZS_JOIN_AUTO);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_linear),
    cmocka_unit_test(test_extended),
    cmocka_unit_test(test_auto),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
