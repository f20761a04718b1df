/* One field, many threads: each with its own evaluator, and no lock.  Meant to
 * be run under the thread sanitizer too, hence plain threads. */
#include "field/compiler.h"
#include "field/program.h"

#include <math.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { THREADS = 4, POINTS = 3000, ROUNDS = 20 };

typedef struct job {
  zs_field *field;
  float f[POINTS];
  float lo, hi;
  bool done;
} job;

static void fill(float x[POINTS], float y[POINTS], float z[POINTS])
{
  for (int i = 0; i < POINTS; i++) {
    x[i] = sinf((float)i);
    y[i] = cosf((float)i * 1.7f);
    z[i] = sinf((float)i * 0.3f);
  }
}

static void *work(void *argument)
{
  job *j = argument;
  static const double lo[3] = {-1, -1, -1}, hi[3] = {1, 1, 1};
  float x[POINTS], y[POINTS], z[POINTS];
  fill(x, y, z);
  for (int round = 0; round < ROUNDS; round++) {
    zs_field *mine = zs_field_ref(j->field);
    zs_eval *eval = zs_eval_new(mine, NULL);
    if (!eval)
      return NULL;
    zs_field_unref(mine);
    zs_eval_bounds(eval, 1, (const double(*)[3])lo, (const double(*)[3])hi, &j->lo, &j->hi);
    bool restricted = zs_eval_restrict(eval, lo, hi, ZS_REQUEST_VALUE);
    zs_eval_values(eval, NULL, POINTS, x, y, z, j->f);
    if (restricted)
      zs_eval_release(eval);
    zs_eval_free(eval);
  }
  j->done = true;
  return NULL;
}

static void threads_share_a_field(void **state)
{
  (void)state;
  zs_compiler *c = zs_compiler_new(NULL, NULL, NULL);
  assert_non_null(c);
  zs_coordinates at = zs_coordinates_root();
  zs_value f = zs_emit_constant(c, -1);
  for (int i = 0; i < 30; i++) {
    zs_value x = zs_emit(c, ZS_FUNCTION_ADD, zs_emit_coordinate(c, &at, 0),
                         zs_emit_constant(c, 0.1 * i), 0);
    zs_value r = zs_emit(c, ZS_FUNCTION_HYPOT, x, zs_emit_coordinate(c, &at, 1), 0);
    f = zs_emit(c, ZS_FUNCTION_MAXIMUM, f, zs_emit(c, ZS_FUNCTION_SINE, r, 0, 0), 0);
  }
  zs_field *field = zs_compiler_finish(c, f, 1);
  assert_non_null(field);
  pthread_t threads[THREADS];
  job *jobs = calloc(THREADS, sizeof *jobs);
  assert_non_null(jobs);
  for (int t = 0; t < THREADS; t++) {
    jobs[t].field = field;
    assert_int_equal(pthread_create(&threads[t], NULL, work, &jobs[t]), 0);
  }
  for (int t = 0; t < THREADS; t++)
    assert_int_equal(pthread_join(threads[t], NULL), 0);
  for (int t = 0; t < THREADS; t++) {
    assert_true(jobs[t].done);
    assert_memory_equal(jobs[t].f, jobs[0].f, sizeof jobs[0].f);
    assert_true(jobs[t].lo == jobs[0].lo && jobs[t].hi == jobs[0].hi);
  }
  free(jobs);
  zs_field_unref(field);
}

static void threads_are_not_too_many(void **state)
{
  (void)state;
  const zs_control three = {.threads = 3}, many = {.threads = 1000000};
  assert_int_equal(zs_control_threads(&three), 3);
  assert_int_equal(zs_control_threads(&many), ZS_MOST_THREADS);
  assert_true(zs_control_threads(NULL) >= 1);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(threads_share_a_field),
    cmocka_unit_test(threads_are_not_too_many),
  };
  return cmocka_run_group_tests_name("threads", tests, NULL, NULL);
}
