/* Around a group of tests: a folder of their own for files. */
#ifndef ZS_TEST_SET_UP_H
#define ZS_TEST_SET_UP_H

#include "scratch.h"

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

#endif
