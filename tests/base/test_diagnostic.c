/* Diagnostics: counting, places, source lines, suggestions. */
#include "base/diagnostic.h"

#include "../random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* The last diagnostic, as text, since its strings do not outlive the call. */
static char last[4096];

static void keep(void *context, const zs_diagnostic *d)
{
  (*(unsigned *)context)++;
  snprintf(last, sizeof last, "%d %d %s:%u:%u <%s> %s: %s | %s | %s", d->severity, d->code,
           d->file ? d->file : "-", d->line, d->column, d->element ? d->element : "-",
           d->attribute ? d->attribute : "-", d->message, d->hint ? d->hint : "-",
           d->source_line ? d->source_line : "-");
}

static void test_counting(void **state)
{
  (void)state;
  unsigned calls = 0;
  zs_diag diag = {.report = keep, .context = &calls};
  assert_false(zs_report(&diag, ZS_NOTE, ZS_OK, NULL, NULL, "a note"));
  assert_false(zs_report(&diag, ZS_WARNING, ZS_OK, NULL, NULL, "a warning"));
  assert_int_equal(diag.errors, 0);
  assert_int_equal(diag.status, ZS_OK);
  assert_false(zs_fail(&diag, ZS_ERROR_IO, "file.xml", "cannot %s", "open"));
  assert_string_equal(last, "2 3 file.xml:0:0 <-> -: cannot open | - | -");
  assert_false(zs_fail(&diag, ZS_ERROR_SCHEMA, NULL, "second"));
  assert_false(zs_fail_memory(&diag));
  assert_string_equal(last, "2 2 -:0:0 <-> -: out of memory | - | -");
  assert_int_equal(diag.errors, 3);
  assert_int_equal(diag.warnings, 1);
  assert_int_equal(diag.status, ZS_ERROR_IO); /* of the first error */
  assert_int_equal(calls, 5);
}

static void test_without_a_sink(void **state)
{
  (void)state;
  assert_false(zs_fail(NULL, ZS_ERROR_IO, NULL, "nobody listens"));
  zs_diag diag = {0};
  assert_false(zs_fail(&diag, ZS_ERROR_IO, NULL, "only counted"));
  assert_int_equal(diag.errors, 1);
}

static void test_source_lines(void **state)
{
  (void)state;
  static const char text[] = "first\r\nsecond\n\nlast";
  zs_source source = {.name = "scene.xml", .text = text, .length = sizeof text - 1};
  static const char *const lines[] = {"-", "first", "second", "", "last", "-"};
  unsigned calls = 0;
  zs_diag diag = {.report = keep, .context = &calls};
  for (uint32_t i = 0; i < 6; i++) {
    zs_place place = {&source, i, 3, "sphere", "radius"};
    char expected[128];
    zs_report(&diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, "a hint", "wrong");
    snprintf(expected, sizeof expected, "2 5 scene.xml:%u:3 <sphere> radius: wrong | a hint | %s",
             i, lines[i]);
    assert_string_equal(last, expected);
  }
}

/* A source with a list of its lines tells the same as one without, whichever
 * lines are asked for first. */
static void test_source_lines_in_any_order(void **state)
{
  (void)state;
  enum { LINES = 300 };
  static char text[2 * LINES * 10];
  size_t length = 0;
  uint64_t seed = 1;
  for (unsigned i = 0; i < LINES; i++)
    length += (size_t)sprintf(text + length, "%.*u\n", (int)random_below(&seed, 8), i);
  unsigned calls = 0;
  zs_diag diag = {.report = keep, .context = &calls};
  for (unsigned round = 0; round < 50; round++) {
    zs_arena arena = {0};
    zs_lines lines = {.arena = &arena};
    zs_source plain = {.name = "x", .text = text, .length = length - round % 2};
    zs_source listed = plain;
    listed.lines = &lines;
    for (unsigned i = 0; i < 20; i++) {
      zs_place place = {&plain, random_below(&seed, LINES + 4), 1, NULL, NULL};
      char expected[sizeof last];
      zs_report(&diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL, "wrong");
      strcpy(expected, last);
      place.source = &listed;
      zs_report(&diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL, "wrong");
      assert_string_equal(last, expected);
    }
    zs_arena_free(&arena);
  }
}

static void test_long_messages_are_cut(void **state)
{
  (void)state;
  char word[5000];
  unsigned calls = 0;
  memset(word, 'a', sizeof word - 1);
  word[sizeof word - 1] = '\0';
  zs_source source = {.name = "scene.xml", .text = word, .length = sizeof word - 1};
  zs_place place = {&source, 1, 1, NULL, NULL};
  zs_diag diag = {.report = keep, .context = &calls};
  zs_report(&diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL, "%s", word);
  assert_int_equal(calls, 1);
  assert_true(strlen(last) > 1000 && strlen(last) < 4000);
}

static void test_suggestions(void **state)
{
  (void)state;
  static const char *const names[] = {"sphere", "radius", "smooth-union", "top-radius", "at"};
  const size_t count = sizeof names / sizeof names[0];
  assert_string_equal(zs_suggest("radus", names, count), "radius");
  assert_string_equal(zs_suggest("raduis", names, count), "radius");
  assert_string_equal(zs_suggest("spheer", names, count), "sphere");
  assert_string_equal(zs_suggest("smoothunion", names, count), "smooth-union");
  assert_string_equal(zs_suggest("smooth_union", names, count), "smooth-union");
  assert_string_equal(zs_suggest("ta", names, count), "at");
  assert_null(zs_suggest("cylinder", names, count));
  assert_null(zs_suggest("radius", names, 0));
  char longer[2000];
  memset(longer, 'r', sizeof longer - 1);
  longer[sizeof longer - 1] = '\0';
  assert_null(zs_suggest(longer, names, count));
  /* An exact name is its own best suggestion. */
  for (size_t i = 0; i < count; i++)
    assert_ptr_equal(zs_suggest(names[i], names, count), names[i]);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_counting),
    cmocka_unit_test(test_without_a_sink),
    cmocka_unit_test(test_source_lines),
    cmocka_unit_test(test_source_lines_in_any_order),
    cmocka_unit_test(test_long_messages_are_cut),
    cmocka_unit_test(test_suggestions),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
