/* What holds between trees of nodes built by hand, for tests. */
#ifndef ZS_TEST_LAWS_H
#define ZS_TEST_LAWS_H

#include "build.h"

typedef enum law { EQUAL, SAME_SIGN } law;

static inline void check_law(law law, const char *name, const zs_node *a, const zs_node *b)
{
  zs_eval *p = compiled(a), *q = compiled(b);
  uint64_t state = 11;
  int inside = 0, outside = 0;
  for (int i = 0; i < 1000; i++) {
    const double x = random_between(&state, -2, 2), y = random_between(&state, -2, 2);
    const double z = random_between(&state, -2, 2);
    const double f = value_at(p, x, y, z), g = value_at(q, x, y, z);
    const bool holds = law == EQUAL ? f == g || fabs(f - g) <= 1e-12 * (1 + fabs(f))
                                    : (f >= 0) == (g >= 0) || fabs(f - g) < 1e-12;
    if (!holds)
      fail_msg("%s at %g %g %g: %.15g and %.15g", name, x, y, z, f, g);
    inside += f >= 0;
    outside += f < 0;
  }
  assert_true(inside > 0 && outside > 0);
  zs_eval_free(p);
  zs_eval_free(q);
}

static inline zs_node *wrap(zs_arena *arena, zs_node *outer, zs_node *child)
{
  return adopt(arena, outer, child);
}

static inline void expect_refused(zs_node *node)
{
  zs_diag diag = {0};
  assert_false(node->kind->check(node, &diag));
  assert_int_equal(diag.errors, 1);
}

#endif
