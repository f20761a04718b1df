/* The documents that are generated and committed are those the tables give. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "language/documents.h"
#include "scene/document.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static char *read_file(const char *path)
{
  const char *folder = getenv("top_srcdir");
  char name[4096];
  snprintf(name, sizeof name, "%s/%s", folder ? folder : ".", path);
  FILE *file = fopen(name, "rb");
  if (!file)
    fail_msg("%s cannot be opened", name);
  zs_text text = {0};
  char block[4096];
  size_t got;
  while ((got = fread(block, 1, sizeof block, file)))
    zs_text_add_bytes(&text, block, got);
  fclose(file);
  return zs_text_finish(&text);
}

static void current(zs_document document, const char *path)
{
  char *committed = read_file(path), *generated = zs_document_text(document);
  assert_non_null(generated);
  if (strcmp(committed, generated) != 0)
    fail_msg("%s is not what the tables give: make regen", path);
  free(committed);
  free(generated);
}

static void test_relax_ng_is_current(void **state)
{
  (void)state;
  current(ZS_DOCUMENT_RELAX_NG, "schema/zeroset.rng");
}

static void test_xsd_is_current(void **state)
{
  (void)state;
  current(ZS_DOCUMENT_XSD, "schema/zeroset.xsd");
}

static void test_manual_is_current(void **state)
{
  (void)state;
  current(ZS_DOCUMENT_NODES, "doc/nodes.md");
}

/* Count the sections "# `name`" of any level. */
static size_t count_sections(const char *manual, const char *name)
{
  char heading[128];
  snprintf(heading, sizeof heading, "# `%s`\n", name);
  size_t count = 0;
  for (const char *at = manual; (at = strstr(at, heading)); at++)
    count++;
  return count;
}

static void test_manual_tells_of_everything(void **state)
{
  (void)state;
  char *manual = zs_document_text(ZS_DOCUMENT_NODES);
  char *summary = zs_document_text(ZS_DOCUMENT_SUMMARY);
  for (int list = 0; list < 2; list++)
    for (const zs_kind *const *kind = list ? zs_document_kinds : zs_kinds; *kind; kind++) {
      assert_true(count_sections(manual, (*kind)->name) >= 1);
      assert_non_null(strstr(summary, (*kind)->summary));
      char *section = zs_document_node((*kind)->name, NULL);
      assert_non_null(strstr(section, (*kind)->name));
      for (size_t i = 0; i < (*kind)->attribute_count; i++)
        assert_non_null(strstr(section, (*kind)->attributes[i].name));
      free(section);
    }
  free(manual);
  free(summary);
}

static void keep_message(void *context, const zs_diagnostic *diagnostic)
{
  snprintf(context, 256, "%s", diagnostic->message);
}

static void test_unknown_element_gets_a_suggestion(void **state)
{
  (void)state;
  char message[256] = "";
  zs_diag diag = {.report = keep_message, .context = message};
  assert_null(zs_document_node("torsu", &diag));
  assert_int_equal(diag.status, ZS_ERROR_ARGUMENT);
  assert_non_null(strstr(message, "'torsu'"));
  assert_non_null(strstr(message, "'torus'"));
}

static void test_parts_are_found(void **state)
{
  (void)state;
  char *section = zs_document_node("level", NULL);
  assert_non_null(section);
  free(section);
}

static void test_text(void **state)
{
  (void)state;
  zs_text text = {0};
  zs_text_add(&text, "a");
  zs_text_add_xml(&text, "<b & \"c\">");
  zs_text_format(&text, " %s %d ", "d", -3);
  zs_text_add_number(&text, -0.25);
  zs_text_add_number(&text, 1e300);
  char *string = zs_text_finish(&text);
  assert_string_equal(string, "a&lt;b &amp; &quot;c&quot;&gt; d -3 -0.251e+300");
  free(string);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_relax_ng_is_current),
    cmocka_unit_test(test_xsd_is_current),
    cmocka_unit_test(test_manual_is_current),
    cmocka_unit_test(test_manual_tells_of_everything),
    cmocka_unit_test(test_unknown_element_gets_a_suggestion),
    cmocka_unit_test(test_parts_are_found),
    cmocka_unit_test(test_text),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
