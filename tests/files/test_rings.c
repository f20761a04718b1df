/* Polygons from text. */
#include "set_up.h"

#include "files/rings.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static const char *rings_file(const char *text)
{
  return written("rings.txt", text, strlen(text));
}

static void rings_are_separated_by_blank_lines(void **state)
{
  (void)state;
  static const double expected[] = {0, 0, 1, 0, 1, 1.5, 5, 5, 6, 5, 6, 6};
  zs_rings rings;
  assert_true(zs_rings_read(
    &rings, rings_file("# two\n\n0 0\n1, 0\n# within\n1;1.5 # corner\n\n \n5\t5\n6 5\n6 6\n5 5\n"),
    NULL));
  assert_int_equal(rings.ring_count, 2);
  assert_int_equal(rings.point_count, 6);
  assert_int_equal(rings.ends[0], 3);
  assert_int_equal(rings.ends[1], 6);
  assert_memory_equal(rings.points, expected, sizeof expected);
  zs_rings_clear(&rings);
  assert_null(rings.points);
  assert_true(zs_rings_make(&rings, expected, 3, NULL));
  assert_int_equal(rings.ring_count, 1);
  assert_memory_equal(rings.points, expected, 6 * sizeof *expected);
  zs_rings_clear(&rings);
}

typedef struct seen {
  char message[256];
  unsigned line;
} seen;

static void keep(void *context, const zs_diagnostic *d)
{
  seen *s = context;
  snprintf(s->message, sizeof s->message, "%s", d->message);
  s->line = d->line;
}

static void mistakes_are_located(void **state)
{
  (void)state;
  static const struct {
    const char *text, *message;
    unsigned line;
  } cases[] = {{"", "no points", 0},
               {"# nothing\n\n", "no points", 0},
               {"0 0\n1\n", "1 column", 2},
               {"0 0 0\n", "more than 2 columns", 1},
               {"0 0\n\nx 1\n", "'x' is not a finite number", 3},
               {"0 nan\n", "'nan' is not a finite number", 1}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    seen s = {.message = ""};
    zs_diag diag = {.report = keep, .context = &s};
    zs_rings rings;
    assert_false(zs_rings_read(&rings, rings_file(cases[i].text), &diag));
    assert_null(rings.points);
    if (!strstr(s.message, cases[i].message) || s.line != cases[i].line)
      fail_msg("case %zu: line %u: %s", i, s.line, s.message);
  }
  zs_rings rings;
  zs_diag diag = {0};
  assert_false(zs_rings_read(&rings, scratch_path(&folder, "absent"), &diag));
  assert_int_equal(diag.status, ZS_ERROR_IO);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(rings_are_separated_by_blank_lines),
    cmocka_unit_test(mistakes_are_located),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
