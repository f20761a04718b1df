/* The cache of fits: references are counted, and old entries are let go. */
#include "scene/scene.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

typedef struct thing {
  int references;
} thing;

static void *ref(void *data)
{
  ((thing *)data)->references++;
  return data;
}

static void unref(void *data)
{
  ((thing *)data)->references--;
}

static const zs_cache_type type = {ref, unref}, other_type = {ref, unref};

static void test_references(void **state)
{
  (void)state;
  zs_cache *cache = zs_cache_new();
  thing a = {1}, b = {1}, c = {1};
  static const uint64_t key_a[2] = {1, 2}, key_b[2] = {2, 1};
  assert_null(zs_cache_find(cache, key_a, &type));
  assert_true(zs_cache_add(cache, key_a, &type, &a));
  assert_true(zs_cache_add(cache, key_b, &type, &b));
  assert_int_equal(a.references, 2);
  assert_ptr_equal(zs_cache_find(cache, key_a, &type), &a);
  assert_int_equal(a.references, 3);
  assert_null(zs_cache_find(cache, key_a, &other_type));
  assert_true(zs_cache_add(cache, key_b, &type, &c)); /* replaces */
  assert_int_equal(b.references, 1);
  assert_ptr_equal(zs_cache_find(cache, key_b, &type), &c);
  zs_cache_free(cache);
  assert_int_equal(a.references, 2);
  assert_int_equal(c.references, 2);
}

static void test_without_a_cache(void **state)
{
  (void)state;
  static const uint64_t key[2] = {1, 2};
  thing a = {1};
  assert_null(zs_cache_find(NULL, key, &type));
  assert_true(zs_cache_add(NULL, key, &type, &a));
  assert_int_equal(a.references, 1);
  zs_cache_free(NULL);
}

/* Of a long sweep, in which one fit stays and one changes, few are kept. */
static void test_old_entries_are_let_go(void **state)
{
  (void)state;
  enum { FRAMES = 100 };
  thing steady = {1}, changing[FRAMES];
  static const uint64_t steady_key[2] = {7, 7};
  zs_cache *cache = zs_cache_new();
  assert_true(zs_cache_add(cache, steady_key, &type, &steady));
  for (uint64_t i = 0; i < FRAMES; i++) {
    zs_cache_advance(cache);
    const uint64_t key[2] = {i, 0};
    changing[i].references = 1;
    assert_ptr_equal(zs_cache_find(cache, steady_key, &type), &steady);
    unref(&steady);
    assert_true(zs_cache_add(cache, key, &type, &changing[i]));
  }
  size_t kept = 0;
  for (size_t i = 0; i < FRAMES; i++)
    kept += changing[i].references == 2;
  assert_in_range(kept, 2, 20);
  assert_int_equal(changing[FRAMES - 1].references, 2);
  assert_int_equal(steady.references, 2);
  zs_cache_free(cache);
  for (size_t i = 0; i < FRAMES; i++)
    assert_int_equal(changing[i].references, 1);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_references),
    cmocka_unit_test(test_without_a_cache),
    cmocka_unit_test(test_old_entries_are_let_go),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
