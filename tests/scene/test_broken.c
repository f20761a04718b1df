/* The corpus of broken scenes: each NAME.xml is refused with exactly the
 * diagnostics of NAME.expected.  Set ZEROSET_REGENERATE to write these files
 * anew after a message has changed, and read the difference. */
#include "zeroset.h"

#include <dirent.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <unistd.h>

#include "print.h"

#include <cmocka.h>

enum { LEAST = 50 }; /* scenes in the corpus */

/* Load, compile and bound a scene, and print what is wrong with it. */
static void examine(const char *name, printed *p)
{
  zs_diag diag = {.report = print_diagnostic, .context = p};
  double lo[3], hi[3];
  zs_scene *scene = zs_scene_load(name, NULL, &diag);
  zs_field *field = scene ? zs_scene_compile(scene, NULL, NULL, &diag) : NULL;
  bool bounded = field && zs_field_box(field, lo, hi, &diag);
  if (bounded)
    fail_msg("%s is not refused", name);
  assert_true(diag.errors > 0);
  assert_int_not_equal(diag.status, ZS_OK);
  zs_field_unref(field);
  zs_scene_free(scene);
}

static void compare(const char *name, const printed *p)
{
  static char expected[sizeof p->text];
  char path[256];
  snprintf(path, sizeof path, "%.*s.expected", (int)(strlen(name) - 4), name);
  if (getenv("ZEROSET_REGENERATE")) {
    FILE *stream = fopen(path, "w");
    assert_non_null(stream);
    fputs(p->text, stream);
    fclose(stream);
  }
  FILE *stream = fopen(path, "r");
  if (!stream)
    fail_msg("%s is missing; the diagnostics are:\n%s", path, p->text);
  size_t length = fread(expected, 1, sizeof expected - 1, stream);
  fclose(stream);
  expected[length] = '\0';
  assert_string_equal(p->text, expected);
}

static void test_corpus(void **state)
{
  (void)state;
  DIR *folder = opendir(".");
  unsigned count = 0;
  assert_non_null(folder);
  for (struct dirent *entry; (entry = readdir(folder)) != NULL;) {
    size_t length = strlen(entry->d_name);
    if (length < 5 || strcmp(entry->d_name + length - 4, ".xml") != 0 ||
        strstr(entry->d_name, "-part.xml"))
      continue;
    static printed p;
    p.length = 0;
    p.text[0] = '\0';
    examine(entry->d_name, &p);
    compare(entry->d_name, &p);
    count++;
  }
  closedir(folder);
  assert_true(count >= LEAST);
}

/* What only compiling shows is found in objects that the main one does not
 * use, and told once however many share it. */
static void test_checking(void **state)
{
  (void)state;
  static const char text[] = "<scene>"
                             "<object id='bad'><variational><point at='0 0 0'/></variational>"
                             "</object>"
                             "<object id='one'><use object='bad' at='1 0 0'/></object>"
                             "<object id='two'><use object='bad'/></object>"
                             "<object id='worse'><variational><point at='1 1 1'/></variational>"
                             "</object>"
                             "<object id='main'><sphere/></object></scene>";
  static printed p;
  p.length = 0;
  zs_diag diag = {.report = print_diagnostic, .context = &p};
  zs_scene *scene = zs_scene_parse(text, sizeof text - 1, "x.xml", NULL, &diag);
  assert_non_null(scene);
  assert_int_equal(diag.errors, 0);
  assert_false(zs_scene_check(scene, NULL, &diag));
  if (diag.errors != 2)
    fail_msg("%u errors: %s", diag.errors, p.text);
  assert_int_equal(diag.status, ZS_ERROR_GEOMETRY);
  zs_diag none = {0};
  zs_field *field = zs_scene_compile(scene, NULL, NULL, &none);
  assert_non_null(field);
  zs_field_unref(field);
  zs_scene_free(scene);
}

int main(void)
{
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_corpus), cmocka_unit_test(test_checking)};
  const char *top = getenv("top_srcdir");
  char folder[4096];
  snprintf(folder, sizeof folder, "%s/tests/scene/broken", top ? top : ".");
  if (chdir(folder) != 0) {
    perror(folder);
    return 1;
  }
  return cmocka_run_group_tests(tests, NULL, NULL);
}
