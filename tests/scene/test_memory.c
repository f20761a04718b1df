/* Memory that runs out at any point is an error like any other. */
#include "zeroset.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "print.h"

#include <cmocka.h>

/* ---- Allocation that fails once ------------------------------------------ */

/* The linker sends the library's calls here (--wrap). */
void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *memory, size_t size);
void *__real_aligned_alloc(size_t alignment, size_t size);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_realloc(void *memory, size_t size);
void *__wrap_aligned_alloc(size_t alignment, size_t size);

static unsigned long until_failure; /* 0: never */
static printed report;

static bool fails(void)
{
  return until_failure && --until_failure == 0;
}

void *__wrap_malloc(size_t size)
{
  return fails() ? NULL : __real_malloc(size);
}

void *__wrap_calloc(size_t count, size_t size)
{
  return fails() ? NULL : __real_calloc(count, size);
}

void *__wrap_realloc(void *memory, size_t size)
{
  return fails() ? NULL : __real_realloc(memory, size);
}

void *__wrap_aligned_alloc(size_t alignment, size_t size)
{
  return fails() ? NULL : __real_aligned_alloc(alignment, size);
}

/* ---- Tests --------------------------------------------------------------- */

static const char text[] =
  "<scene units='mm'><param name='a' value='{1 + 1}' min='0' doc='size'/>"
  "<param name='b' value='3'/>"
  "<define name='ball'><argument name='r'/><sphere radius='{r}'/></define>"
  "<view id='v' eye='1 2 3'/><domain min='-9 -9 -9' max='9 9 9'/>"
  "<object id='one'><union><instance of='ball' r='{a * b}' at='1 0 0'/>"
  "<repeat for='i' from='1' to='20'><box size='{i}' rotate='{i} 0 0'/></repeat></union></object>"
  "<object id='two'><smooth-union><use object='one'/><use object='one' at='0 0 1'/>"
  "<formula>let q = a * x; 1 - hypot(q, y, z) + (x &lt; 0 ? 1 : 2)</formula>"
  "</smooth-union></object>"
  "</scene>";

/* Fail the n-th allocation of a job on a good scene, for every n, until there are
 * fewer. */
static void exhaust(bool (*job)(zs_scene *scene, zs_diag *diag))
{
  zs_scene *scene = zs_scene_parse(text, sizeof text - 1, "x.xml", NULL, NULL);
  assert_non_null(scene);
  unsigned long n = 0;
  bool passed = false;
  while (!passed) {
    assert_true(++n < 100000);
    report.length = 0;
    zs_diag diag = {.report = print_diagnostic, .context = &report};
    until_failure = n;
    bool good = job(scene, &diag);
    passed = until_failure > 0;
    until_failure = 0;
    assert_true(good == (diag.errors == 0));
    if (passed)
      assert_true(good);
    else if (!good && diag.status != ZS_ERROR_MEMORY)
      fail_msg("allocation %lu: %s", n, report.text);
  }
  assert_true(n > 10);
  zs_scene_free(scene);
}

static bool load(zs_scene *unused, zs_diag *diag)
{
  (void)unused;
  zs_scene *scene = zs_scene_parse(text, sizeof text - 1, "x.xml", NULL, diag);
  zs_scene_free(scene);
  return scene;
}

static void test_loading(void **state)
{
  (void)state;
  exhaust(load);
}

static bool compile(zs_scene *scene, zs_diag *diag)
{
  zs_field *field = zs_scene_compile(scene, NULL, NULL, diag);
  zs_field_unref(field);
  return field;
}

static void test_compiling(void **state)
{
  (void)state;
  exhaust(compile);
}

static bool check(zs_scene *scene, zs_diag *diag)
{
  return zs_scene_check(scene, NULL, diag);
}

static void test_checking(void **state)
{
  (void)state;
  exhaust(check);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_loading),
    cmocka_unit_test(test_compiling),
    cmocka_unit_test(test_checking),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
