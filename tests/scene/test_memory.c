/* Memory that runs out at any point is an error like any other. */
#include "../failing_allocation.h"

#include "zeroset.h"

#include <libxml/xmlerror.h>
#include <libxml/xmlmemory.h>
#include <libxml/xmlversion.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "print.h"

#include <cmocka.h>

static printed report;

/* libxml2's calls come here by its own means. */
static char *failing_strdup(const char *text)
{
  char *copy = __wrap_malloc(strlen(text) + 1);
  return copy ? strcpy(copy, text) : NULL;
}

#if LIBXML_VERSION >= 21200
typedef const xmlError *error_pointer;
#else
typedef xmlError *error_pointer;
#endif

/* What the host of the library asks libxml2 to tell it: nothing of the library's concern. */
static void tell_host(void *data, error_pointer error)
{
  (void)data;
  fail_msg("libxml2 told the host: %s", error->message);
}

static int share_failures(void **state)
{
  (void)state;
  xmlSetStructuredErrorFunc(&report, tell_host);
  return xmlMemSetup(free, __wrap_malloc, __wrap_realloc, failing_strdup);
}

/* ---- Tests --------------------------------------------------------------- */

static const char text[] =
  "<scene xmlns='urn:zeroset:scene:1' units='mm'><param name='a' value='{1 + 1}' min='0' doc='size'/>"
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
static void exhaust(bool (*job)(zs_scene *scene, zs_diag *diag), const char *document)
{
  zs_scene *scene = zs_scene_parse(document, strlen(document), "x.xml", NULL, NULL);
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
  assert_ptr_equal(xmlStructuredError, tell_host);
  assert_ptr_equal(xmlStructuredErrorContext, &report);
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
  exhaust(load, text);
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
  exhaust(compile, text);
}

static bool check(zs_scene *scene, zs_diag *diag)
{
  return zs_scene_check(scene, NULL, diag);
}

static void test_checking(void **state)
{
  (void)state;
  exhaust(check, text);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_loading),
    cmocka_unit_test(test_compiling),
    cmocka_unit_test(test_checking),
  };
  return cmocka_run_group_tests(tests, share_failures, NULL);
}
