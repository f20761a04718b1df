/* Around a group of tests: a folder of their own for files. */
#ifndef ZS_TEST_SET_UP_H
#define ZS_TEST_SET_UP_H

#include "scratch.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static scratch folder;

static inline int set_up(void **state)
{
  (void)state;
  return scratch_make(&folder) ? 0 : -1;
}

static inline int tear_down(void **state)
{
  (void)state;
  scratch_remove(&folder);
  return 0;
}

/* The path of a new file in the folder that holds some bytes; valid until the next path. */
static inline const char *written(const char *name, const void *bytes, size_t length)
{
  const char *path = scratch_path(&folder, name);
  FILE *file = fopen(path, "wb");
  assert_non_null(file);
  assert_int_equal(fwrite(bytes, 1, length, file), length);
  assert_int_equal(fclose(file), 0);
  return path;
}

#endif
