/* Arenas: alignment, zeroes, no overlap, marks. */
#include "base/arena.h"
#include "base/memory.h"

#include "../random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static bool all_are(const unsigned char *bytes, size_t count, unsigned char value)
{
  for (size_t i = 0; i < count; i++)
    if (bytes[i] != value)
      return false;
  return true;
}

/* Pieces of random sizes are zeroed, aligned, and keep what is written. */
static void test_pieces(void **state)
{
  (void)state;
  enum { COUNT = 2000 };
  static struct {
    unsigned char *bytes;
    size_t size;
  } pieces[COUNT];
  zs_arena arena = {0};
  uint64_t seed = 3;
  size_t total = 0;
  for (unsigned i = 0; i < COUNT; i++) {
    size_t size = random_below(&seed, 10) ? random_below(&seed, 300) : random_below(&seed, 20000);
    pieces[i].bytes = zs_arena_alloc(&arena, size, 1);
    pieces[i].size = size;
    assert_non_null(pieces[i].bytes);
    assert_int_equal((uintptr_t)pieces[i].bytes % (size >= 64 ? 64 : 16), 0);
    assert_true(all_are(pieces[i].bytes, size, 0));
    memset(pieces[i].bytes, (int)(i & 255), size);
    total += size;
  }
  for (unsigned i = 0; i < COUNT; i++)
    assert_true(all_are(pieces[i].bytes, pieces[i].size, (unsigned char)(i & 255)));
  assert_true(arena.bytes >= total);
  zs_arena_free(&arena);
  assert_null(arena.block);
}

/* Memory of all sizes can be had, written and freed; it is aligned, or zeroed though it has been
 * written before. */
static void test_memory(void **state)
{
  (void)state;
  static const size_t counts[] = {0, 1, 63, 64, 65, 524287, 524288, 524289, 1048575, 1048576,
                                  1048577, 2097152, 2097153, 5000001};
  for (unsigned i = 0; i < sizeof counts / sizeof *counts; i++)
    for (int times = 0; times < 2; times++) {
      const size_t room = zs_memory_room(counts[i]);
      unsigned char *memory = zs_memory_new(counts[i], 1);
      assert_non_null(memory);
      assert_int_equal((uintptr_t)memory % 64, 0);
      assert_true(room >= counts[i] && room > 0);
      memset(memory, 1, room);
      free(memory);
      memory = zs_memory_zeroed(counts[i], 1);
      assert_non_null(memory);
      assert_true(all_are(memory, counts[i], 0));
      memset(memory, 1, counts[i]);
      free(memory);
    }
  assert_null(zs_memory_new(SIZE_MAX / 8, 64));
  assert_null(zs_memory_zeroed(SIZE_MAX / 8, 64));
}

/* Pieces beyond what fits a large page. */
static void test_large_pieces(void **state)
{
  (void)state;
  enum { COUNT = 6 };
  static const size_t sizes[COUNT] = {3000000, 1, 2097024, 2097152, 100, 5000001};
  unsigned char *pieces[COUNT];
  zs_arena arena = {0};
  size_t total = 0;
  for (int i = 0; i < COUNT; i++) {
    pieces[i] = zs_arena_alloc(&arena, sizes[i], 1);
    assert_non_null(pieces[i]);
    assert_true(all_are(pieces[i], sizes[i], 0));
    memset(pieces[i], i + 1, sizes[i]);
    total += sizes[i];
  }
  for (int i = 0; i < COUNT; i++)
    assert_true(all_are(pieces[i], sizes[i], (unsigned char)(i + 1)));
  assert_true(arena.bytes >= total);
  zs_arena_free(&arena);
}

static void test_impossible_sizes(void **state)
{
  (void)state;
  zs_arena arena = {0};
  assert_null(zs_arena_alloc(&arena, SIZE_MAX, 2));
  assert_null(zs_arena_alloc(&arena, SIZE_MAX / 2, 4));
  assert_null(zs_arena_alloc(&arena, 1, SIZE_MAX - 8));
  assert_non_null(zs_arena_alloc(&arena, 0, 8)); /* still usable */
  zs_arena_free(&arena);
}

static void test_strings(void **state)
{
  (void)state;
  zs_arena arena = {0};
  assert_string_equal(zs_arena_string(&arena, "abcdef", 3), "abc");
  assert_string_equal(zs_arena_string(&arena, NULL, 0), "");
  zs_arena_free(&arena);
}

/* What was there before a mark survives any use and rewinding behind it, and
 * memory is used again instead of growing. */
static void test_rewinding(void **state)
{
  (void)state;
  zs_arena arena = {0};
  uint64_t seed = 5;
  unsigned char *kept = zs_arena_alloc(&arena, 1000, 1);
  memset(kept, 77, 1000);
  zs_arena_mark mark = zs_arena_mark_here(&arena);
  size_t most = 0;
  for (unsigned round = 0; round < 200; round++) {
    for (unsigned i = 0; i < 50; i++) {
      size_t size = random_below(&seed, 3000);
      unsigned char *bytes = zs_arena_alloc(&arena, size, 1);
      assert_true(all_are(bytes, size, 0));
      memset(bytes, 99, size);
    }
    if (round == 20)
      most = arena.bytes;
    zs_arena_rewind(&arena, mark);
  }
  assert_true(all_are(kept, 1000, 77));
  assert_true(arena.bytes <= 4 * most);
  zs_arena_free(&arena);
}

static void test_rewinding_to_nothing(void **state)
{
  (void)state;
  zs_arena arena = {0};
  zs_arena_mark empty = zs_arena_mark_here(&arena);
  zs_arena_rewind(&arena, empty);
  for (int i = 0; i < 5; i++) {
    assert_non_null(zs_arena_alloc(&arena, 100000, 1));
    zs_arena_rewind(&arena, empty);
  }
  unsigned char *bytes = zs_arena_alloc(&arena, 10, 1);
  assert_true(all_are(bytes, 10, 0));
  zs_arena_free(&arena);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_pieces),
    cmocka_unit_test(test_memory),
    cmocka_unit_test(test_large_pieces),
    cmocka_unit_test(test_impossible_sizes),
    cmocka_unit_test(test_strings),
    cmocka_unit_test(test_rewinding),
    cmocka_unit_test(test_rewinding_to_nothing),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
