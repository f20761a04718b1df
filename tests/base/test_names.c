/* Tables of names: everything that was added is found, nothing else is. */
#include "base/names.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void test_many_names(void **state)
{
  (void)state;
  enum { COUNT = 20000 };
  zs_arena arena = {0};
  zs_names names = {0};
  char text[32];
  assert_null(zs_names_find(&names, "", 0));
  for (uint32_t i = 0; i < COUNT; i++) {
    size_t length = (size_t)snprintf(text, sizeof text, "name%u", i);
    assert_null(zs_names_find(&names, text, length));
    const char *copy = zs_arena_string(&arena, text, length);
    assert_true(zs_names_add(&names, &arena, copy, length, i));
  }
  assert_int_equal(names.count, COUNT);
  for (uint32_t i = 0; i < COUNT; i++) {
    size_t length = (size_t)snprintf(text, sizeof text, "name%u", i);
    const zs_name *found = zs_names_find(&names, text, length);
    assert_non_null(found);
    assert_int_equal(found->value, i);
    assert_int_equal(found->length, length);
  }
  assert_null(zs_names_find(&names, "name", 4));
  assert_null(zs_names_find(&names, "name20000", 9));
  zs_arena_free(&arena);
}

/* Names are stretches of text: zero bytes and empty names count. */
static void test_odd_names(void **state)
{
  (void)state;
  zs_arena arena = {0};
  zs_names names = {0};
  assert_true(zs_names_add(&names, &arena, "a\0b", 3, 1));
  assert_true(zs_names_add(&names, &arena, "a\0c", 3, 2));
  assert_true(zs_names_add(&names, &arena, "", 0, 3));
  assert_int_equal(zs_names_find(&names, "a\0b", 3)->value, 1);
  assert_int_equal(zs_names_find(&names, "a\0c", 3)->value, 2);
  assert_int_equal(zs_names_find(&names, "abc", 0)->value, 3);
  assert_null(zs_names_find(&names, "a", 1));
  zs_arena_free(&arena);
}

static void endings_are_told(void **state)
{
  (void)state;
  assert_true(zs_name_ends_in("a.nii", ".nii"));
  assert_true(zs_name_ends_in("folder.x/A.Nii.GZ", ".nii.gz"));
  assert_false(zs_name_ends_in("a.nii.gz", ".nii"));
  assert_false(zs_name_ends_in("anii", ".nii"));
  assert_false(zs_name_ends_in(".nii", ".nii")); /* nothing before it */
  assert_false(zs_name_ends_in("", ".nii"));
  assert_false(zs_name_ends_in("", ""));
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_many_names),
    cmocka_unit_test(test_odd_names),
    cmocka_unit_test(endings_are_told),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
