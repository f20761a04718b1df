/* Numbers and words of the command line. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "cli/text.h"

#include <stdlib.h>
#include <string.h>

static void test_numbers(void **state)
{
  (void)state;
  static const struct {
    const char *text;
    size_t count;
    double first;
  } cases[] = {
    {"1", 1, 1},        {" -2.5e1 ", 1, -25}, {".5", 1, 0.5},  {"5.", 1, 5},      {"1 2 3", 3, 1},
    {"1,2,3", 3, 1},    {"1 , 2\t3", 3, 1},   {"", 0, 0},      {" ", 0, 0},       {"x", 0, 0},
    {"1x", 0, 0},       {"1 2 3 4", 0, 0},    {"0x10", 0, 0},  {"inf", 0, 0},     {"nan", 0, 0},
    {"1e400", 0, 0},    {",1", 0, 0},         {"1,", 0, 0},    {"1,,2", 0, 0},    {"--1", 0, 0},
    {"1-2", 0, 0},      {"1e", 0, 0},         {"+.", 0, 0},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    double values[3] = {0};
    if (cli_numbers_parse(cases[i].text, values, 3) != cases[i].count)
      fail_msg("'%s' is not %zu numbers", cases[i].text, cases[i].count);
    if (cases[i].count)
      assert_true(values[0] == cases[i].first);
  }
}

static void test_integers(void **state)
{
  (void)state;
  uint64_t value;
  assert_true(cli_integer_parse("1", 1, 9, &value) && value == 1);
  assert_true(cli_integer_parse("009", 1, 9, &value) && value == 9);
  static const char *const wrong[] = {"", "0", "10", "-1", "+1", " 1", "1 ", "1.0", "1e0", "x",
                                      "18446744073709551617"};
  for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
    assert_false(cli_integer_parse(wrong[i], 1, 9, &value));
}

static void test_bytes(void **state)
{
  (void)state;
  static const struct {
    const char *text;
    uint64_t value; /* 0: not understood */
  } cases[] = {
    {"1", 1},           {"100", 100},    {"1k", 1024}, {"2M", 2097152}, {"0.5G", 536870912},
    {"1T", 1ull << 40}, {"8GiB", 8ull << 30}, {"8GB", 8ull << 30}, {"7B", 7},
    {"0", 0},           {"-1", 0},       {"", 0},      {"G", 0},        {"1Q", 0},
    {"1 G", 0},         {"1Gi", 0},      {"1e30", 0},  {"1GG", 0},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    uint64_t value = 0;
    bool good = cli_bytes_parse(cases[i].text, &value);
    if (good != (cases[i].value != 0) || (good && value != cases[i].value))
      fail_msg("'%s'", cases[i].text);
  }
}

static void test_suggestions(void **state)
{
  (void)state;
  static const char *const names[] = {"check", "mesh", "voxel", "z"};
  assert_string_equal(cli_suggest("chekc", names, 4), "check");
  assert_string_equal(cli_suggest("mash", names, 4), "mesh");
  assert_string_equal(cli_suggest("voxels", names, 4), "voxel");
  assert_null(cli_suggest("telescope", names, 4));
  assert_null(cli_suggest("", names, 4));
  assert_null(cli_suggest("a", names, 4)); /* one letter is no hint at another */
}

static void test_characters(void **state)
{
  (void)state;
  static const struct {
    const char *text;
    size_t length;
  } cases[] = {
    {"a", 1},         {" ", 1},         {"~", 1},            {"", 0},
    {"\t", 0},        {"\033[m", 0},    {"\x7f", 0},         {"\xc3\xa4x", 2},
    {"\xc2\xa0", 2},  {"\xc2\x9b", 0},  {"\xc0\xaf", 0},     {"\xe2\x82\xac", 3},
    {"\xe0\x80\xaf", 0}, {"\xed\xa0\x80", 0}, {"\xf0\x9f\x98\x80", 4}, {"\xf4\x90\x80\x80", 0},
    {"\x80", 0},      {"\xc3", 0},      {"\xe2\x82", 0},     {"\xff\xff\xff\xff", 0},
    {"\xfc\x80\x80\x80", 0},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
    if (cli_character_length(cases[i].text) != cases[i].length)
      fail_msg("case %zu: %zu", i, cli_character_length(cases[i].text));
}

static void test_endings(void **state)
{
  (void)state;
  assert_true(cli_ends_with("a.stl", ".stl"));
  assert_true(cli_ends_with("A.STL", ".stl"));
  assert_false(cli_ends_with("stl", ".stl"));
  assert_false(cli_ends_with("a.stl.gz", ".stl"));
}

static void test_frame_names(void **state)
{
  (void)state;
  static const char *const cases[][2] = {
    {"a%d.png", "a7.png"},      {"%04d", "0007"}, {"%3d", "  7"}, {"100%%-%d%%", "100%-7%"},
    {"%020d", "00000000000000000007"},
    {"a.png", NULL}, {"%d%d", NULL}, {"%s", NULL}, {"%", NULL}, {"%04", NULL}, {"%d%", NULL},
    {"%ld", NULL},   {"%-4d", NULL}, {"%21d", NULL}, {"%99999999999d", NULL}, {"%%d", NULL},
    {"", NULL},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char *name = cli_frame_name(cases[i][0], 7);
    if (!cases[i][1])
      assert_null(name);
    else
      assert_string_equal(name, cases[i][1]);
    free(name);
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_numbers),     cmocka_unit_test(test_integers),
    cmocka_unit_test(test_bytes),       cmocka_unit_test(test_suggestions),
    cmocka_unit_test(test_characters),  cmocka_unit_test(test_endings),
    cmocka_unit_test(test_frame_names),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
