/* Arrays that grow: contents, capacities, and sizes that no array can have. */
#include "base/array.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

/* Added one by one, elements stay; as many moves as there are doublings. */
static void elements_are_kept(void **state)
{
  (void)state;
  enum { COUNT = 100000 };
  uint32_t *numbers = NULL;
  size_t capacity = 0, changes = 0;
  for (uint32_t i = 0; i < COUNT; i++) {
    const size_t before = capacity;
    uint32_t *grown = zs_array_grown(numbers, i + 1, &capacity, sizeof *grown);
    assert_non_null(grown);
    assert_true(capacity > i);
    if (capacity == before)
      assert_ptr_equal(grown, numbers);
    else
      assert_true(capacity >= 2 * before);
    changes += capacity != before;
    numbers = grown;
    numbers[i] = 3 * i;
  }
  assert_in_range(changes, 1, 17); /* log2 of 100000 */
  for (uint32_t i = 0; i < COUNT; i++)
    assert_int_equal(numbers[i], 3 * i);
  free(numbers);
}

/* Room for many at once, whatever there was. */
static void many_at_once(void **state)
{
  (void)state;
  size_t capacity = 0;
  char *bytes = zs_array_grown(NULL, 5000, &capacity, 3);
  assert_non_null(bytes);
  assert_true(capacity >= 5000);
  bytes[0] = 'a';
  bytes[3 * capacity - 1] = 'z';
  const size_t before = capacity;
  char *grown = zs_array_grown(bytes, 9 * before, &capacity, 3);
  assert_non_null(grown);
  assert_true(capacity >= 9 * before);
  assert_int_equal(grown[0], 'a');
  assert_int_equal(grown[3 * before - 1], 'z');
  assert_ptr_equal(zs_array_grown(grown, capacity, &capacity, 3), grown);
  free(grown);
}

/* Nothing changes when a size overflows. */
static void impossible_sizes(void **state)
{
  (void)state;
  static const size_t counts[] = {SIZE_MAX, SIZE_MAX / 2, SIZE_MAX / 8 + 2, PTRDIFF_MAX / 8 + 1};
  size_t capacity = 0;
  double *numbers = zs_array_grown(NULL, 1, &capacity, sizeof *numbers);
  assert_non_null(numbers);
  numbers[0] = 7;
  const size_t before = capacity;
  for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
    assert_null(zs_array_grown(numbers, counts[i], &capacity, sizeof *numbers));
    assert_int_equal(capacity, before);
    assert_true(numbers[0] == 7);
  }
  /* An array that could not be doubled may still be as long as an array can be. */
  capacity = PTRDIFF_MAX / 8 - 1;
  assert_null(zs_array_grown(NULL, PTRDIFF_MAX / 8 + 1, &capacity, 8));
  assert_int_equal(capacity, PTRDIFF_MAX / 8 - 1);
  free(numbers);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(elements_are_kept),
    cmocka_unit_test(many_at_once),
    cmocka_unit_test(impossible_sizes),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
