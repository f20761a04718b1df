/* Expressions: grammar, functions, errors, and numbers in any locale. */
#include "base/expression.h"

#include "../comma_locale.h"
#include "../random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* ---- Helpers ------------------------------------------------------------ */

/* Value of an expression in x, y, z = 2, -3, 0.5. */
static double value_of(const char *text)
{
  zs_arena arena = {0};
  zs_expression_error error;
  const zs_expression *e = zs_expression_parse(&arena, text, strlen(text), &error);
  if (!e)
    fail_msg("'%s' at %zu: %s", text, error.offset, error.message);
  double values[8], *scratch = malloc(e->count * sizeof *scratch);
  assert_true(e->variable_count <= 8);
  for (uint32_t i = 0; i < e->variable_count; i++)
    values[i] = e->variables[i][0] == 'x' ? 2 : e->variables[i][0] == 'y' ? -3 : 0.5;
  double value = zs_expression_value(e, values, scratch);
  free(scratch);
  zs_arena_free(&arena);
  return value;
}

static void assert_same(double a, double b)
{
  if (!(a == b || (isnan(a) && isnan(b))))
    fail_msg("%.17g is not %.17g", a, b);
}

/* ---- Grammar ------------------------------------------------------------ */

static void test_precedence(void **state)
{
  (void)state;
  static const struct {
    const char *text;
    double value;
  } cases[] = {
    {"1 + 2 * 3", 7},
    {"(1 + 2) * 3", 9},
    {"10 - 4 - 3", 3},
    {"16 / 4 / 2", 2},
    {"-2^2", -4},
    {"(-2)^2", 4},
    {"2^3^2", 512},
    {"2^-1", 0.5},
    {"-2^-2", -0.25},
    {"2 * -3", -6},
    {"- -3", 3},
    {"+3", 3},
    {"7 % 3", 1},
    {"-7 % 3", 2},
    {"7 % -3", -2},
    {"2 * 7 % 4", 2},
    {"1 + 1 < 3", 1},
    {"1 < 2", 1},
    {"2 < 1", 0},
    {"2 > 1", 1},
    {"2 >= 2", 1},
    {"2 <= 1", 0},
    {"1 >= 2", 0},
    {"1 == 1", 1},
    {"1 != 1", 0},
    {"(1 < 2) == (3 > 2)", 1},
    {"1 < 2 ? 10 : 20", 10},
    {"0 ? 1 : 0 ? 2 : 3", 3},
    {"1 ? 0 ? 4 : 5 : 6", 5},
    {"0.5 ? 1 : 2", 1},
    {"let a = 3; let b = a * a; a + b", 12},
    {"let a = x; a", 2},
    {".5 + 5. + 1e1 + 1.5E-1", 15.65},
    {"\t1\n+\r1 ", 2},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
    if (value_of(cases[i].text) != cases[i].value)
      fail_msg("%s: %.17g", cases[i].text, value_of(cases[i].text));
}

static void test_functions(void **state)
{
  (void)state;
  static const double pi = 3.14159265358979323846;
  assert_same(value_of("pi"), pi);
  assert_same(value_of("abs(y)"), 3);
  assert_same(value_of("min(x, y)"), -3);
  assert_same(value_of("min(4, 3, 5, 2, 6)"), 2);
  assert_same(value_of("max(4, 3, 5, 2, 6)"), 6);
  assert_same(value_of("sqrt(x)"), sqrt(2));
  assert_same(value_of("exp(z)"), exp(0.5));
  assert_same(value_of("log(x)"), log(2));
  assert_same(value_of("sin(x) + cos(x) - tan(x)"), sin(2) + cos(2) - tan(2));
  assert_same(value_of("asin(z)"), asin(0.5));
  assert_same(value_of("acos(z)"), acos(0.5));
  assert_same(value_of("atan(z)"), atan(0.5));
  assert_same(value_of("atan2(y, x)"), atan2(-3, 2));
  assert_same(value_of("floor(-1.5)"), -2);
  assert_same(value_of("ceil(-1.5)"), -1);
  assert_same(value_of("round(1.5)"), 2);
  assert_same(value_of("round(-1.5)"), -1); /* halves go up */
  assert_same(value_of("round(0.49)"), 0);
  assert_same(value_of("sign(y)"), -1);
  assert_same(value_of("sign(0)"), 0);
  assert_same(value_of("sign(x)"), 1);
  assert_same(value_of("clamp(5, 0, 1)"), 1);
  assert_same(value_of("clamp(-5, 0, 1)"), 0);
  assert_same(value_of("clamp(z, 0, 1)"), 0.5);
  assert_same(value_of("mix(0.1, 0.7, 0)"), 0.1);
  assert_same(value_of("mix(0.1, 0.7, 1)"), 0.7);
  assert_same(value_of("mix(1, 3, z)"), 2);
  assert_same(value_of("pow(x, y)"), 0.125);
  assert_same(value_of("mod(-7, 3)"), 2);
  assert_same(value_of("hypot(3, 4)"), 5);
  assert_same(value_of("hypot(1, 2, 2)"), 3);
  assert_same(value_of("deg(pi)"), 180);
  assert_same(value_of("rad(180)"), pi);
}

static void test_every_function_has_a_name_and_an_arity(void **state)
{
  (void)state;
  for (int f = 0; f < ZS_FUNCTION_COUNT; f++) {
    assert_non_null(zs_function_name((zs_function)f));
    assert_true(zs_function_arity((zs_function)f) <= 3);
    for (int g = 0; g < f; g++)
      assert_string_not_equal(zs_function_name((zs_function)f), zs_function_name((zs_function)g));
  }
  /* Every known function can be called with some number of arguments. */
  for (size_t i = 0; i < zs_expression_function_count; i++) {
    static const char *const arguments[] = {"(1)", "(1, 1)", "(1, 1, 1)"};
    unsigned accepted = 0;
    for (size_t k = 0; k < 3; k++) {
      char text[64];
      zs_arena arena = {0};
      zs_expression_error error;
      snprintf(text, sizeof text, "%s%s", zs_expression_function_names[i], arguments[k]);
      accepted += zs_expression_parse(&arena, text, strlen(text), &error) != NULL;
      zs_arena_free(&arena);
    }
    assert_true(accepted > 0);
  }
}

/* A random expression as text and its value, computed on the way. */
static double random_expression(uint64_t *seed, unsigned depth, char *text, size_t size)
{
  char a[2048], b[2048], c[2048];
  if (depth == 0) {
    static const char *const names[] = {"x", "y", "z"};
    static const double values[] = {2, -3, 0.5};
    unsigned k = random_below(seed, 4);
    if (k < 3) {
      snprintf(text, size, "%s", names[k]);
      return values[k];
    }
    double number = random_below(seed, 1000) / 8.0;
    snprintf(text, size, "%.17g", number);
    return number;
  }
  unsigned kind = random_below(seed, 9);
  double u = random_expression(seed, depth - 1, a, sizeof a);
  double v = random_expression(seed, random_below(seed, depth), b, sizeof b);
  switch (kind) {
  case 0: snprintf(text, size, "(%.900s)+(%.900s)", a, b); return u + v;
  case 1: snprintf(text, size, "(%.900s) - (%.900s)", a, b); return u - v;
  case 2: snprintf(text, size, "(%.900s)*(%.900s)", a, b); return u * v;
  case 3: snprintf(text, size, "(%.900s)/(%.900s)", a, b); return u / v;
  case 4: snprintf(text, size, "-(%.900s)", a); return -u;
  case 5: snprintf(text, size, "max(%.900s, %.900s)", a, b); return u > v ? u : v;
  case 6: snprintf(text, size, "(%.900s) > (%.900s)", a, b); return u > v;
  case 7: snprintf(text, size, "(%.900s)^2", a); return u * u;
  default: {
    double w = random_expression(seed, 0, c, sizeof c);
    snprintf(text, size, "(%.900s) <= (%.900s) ? (%.900s) : (%.50s)", a, b, a, c);
    return u <= v ? u : w;
  }
  }
}

static void test_random_expressions(void **state)
{
  (void)state;
  uint64_t seed = 1;
  unsigned compared = 0;
  for (unsigned i = 0; i < 5000; i++) {
    char text[4096];
    double expected = random_expression(&seed, 1 + random_below(&seed, 4), text, sizeof text);
    if (strlen(text) > 600)
      continue; /* operands may have been cut */
    assert_same(value_of(text), expected);
    compared++;
  }
  assert_true(compared > 3000);
}

static void test_variables(void **state)
{
  (void)state;
  static const char text[] = "let r = b + size.x; r * b + a_1";
  zs_arena arena = {0};
  zs_expression_error error;
  const zs_expression *e = zs_expression_parse(&arena, text, strlen(text), &error);
  assert_non_null(e);
  assert_int_equal(e->variable_count, 3);
  assert_string_equal(e->variables[0], "b");
  assert_string_equal(e->variables[1], "size.x");
  assert_string_equal(e->variables[2], "a_1");
  assert_int_equal(e->variable_offsets[0], 8);
  assert_int_equal(e->variable_offsets[1], 12);
  assert_int_equal(e->variable_offsets[2], 28);
  for (uint32_t i = 0; i < e->count; i++)
    for (unsigned k = 0; k < zs_function_arity(e->nodes[i].function); k++)
      assert_true(e->nodes[i].operand[k] < i);
  zs_arena_free(&arena);
}

static void test_squares(void **state)
{
  (void)state;
  static const char *const texts[] = {"x^2", "x*x", "pow(x, 2)", "let a = x; a * x"};
  for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
    zs_arena arena = {0};
    zs_expression_error error;
    const zs_expression *e = zs_expression_parse(&arena, texts[i], strlen(texts[i]), &error);
    assert_non_null(e);
    assert_int_equal(e->nodes[e->count - 1].function, ZS_FUNCTION_SQUARE);
    zs_arena_free(&arena);
  }
}

/* ---- Errors ------------------------------------------------------------- */

static void test_errors(void **state)
{
  (void)state;
  static const struct {
    const char *text;
    size_t offset;
    const char *message;
  } cases[] = {
    {"", 0, "expected a number, a name or '(' at the end"},
    {"1 +", 3, "expected a number, a name or '(' at the end"},
    {"(1", 2, "expected ')' at the end"},
    {"1)", 1, "expected an operator or the end, found ')'"},
    {"2x", 1, "expected an operator or the end, found 'x'"},
    {"1 $ 2", 2, "expected an operator or the end, found '$'"},
    {"\xC3\xA9", 0, "expected a number, a name or '(', found '\xC3\xA9'"},
    {"sqr(2)", 0, "'sqr' is not a function; did you mean 'sqrt'?"},
    {"frobnicate(2)", 0, "'frobnicate' is not a function"},
    {"1 + sin", 4, "'sin' is a function; expected '(' after it"},
    {"sin(1, 2)", 0, "'sin' takes 1 argument, 2 given"},
    {"atan2(1)", 0, "'atan2' takes 2 arguments, 1 given"},
    {"min(1)", 0, "'min' takes at least 2 arguments, 1 given"},
    {"hypot(1, 2, 3, 4)", 0, "'hypot' takes at most 3 arguments, 4 given"},
    {"max()", 0, "'max' takes at least 2 arguments, 0 given"},
    {"max(1, )", 7, "expected an argument, found ')'"},
    {"1 < 2 < 3", 6, "comparisons do not chain; use parentheses"},
    {"1 ? 2", 5, "expected ':' at the end"},
    {"let = 3; 1", 4, "expected a name after 'let', found '='"},
    {"let a 3; 1", 6, "expected '=', found '3'"},
    {"let a = 3 a", 10, "expected ';', found 'a'"},
    {"let a = 3;", 10, "expected a number, a name or '(' at the end"},
    {"let a = 1; let a = 2; a", 15, "'a' has been used or defined before"},
    {"let x = x; x", 4, "'x' has been used or defined before"},
    {"let pi = 3; pi", 4, "'pi' has a meaning already"},
    {"let sin = 3; 1", 4, "'sin' has a meaning already"},
    {"1 + let", 4, "'let' belongs at the start of a statement"},
    {"1e999", 0, "the number is too large"},
    {"0x10", 1, "expected an operator or the end, found 'x10'"},
    {"1,5", 1, "expected an operator or the end, found ','"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    zs_arena arena = {0};
    zs_expression_error error = {0};
    assert_null(zs_expression_parse(&arena, cases[i].text, strlen(cases[i].text), &error));
    assert_string_equal(error.message, cases[i].message);
    assert_int_equal(error.offset, cases[i].offset);
    zs_arena_free(&arena);
  }
}

/* Parse `count` times `open`, "1" and `count` times `close`. */
static bool nested(const char *open, const char *close, size_t count)
{
  size_t a = strlen(open), b = strlen(close), n = 0;
  char *text = malloc(count * (a + b) + 2);
  for (size_t i = 0; i < count; i++, n += a)
    memcpy(text + n, open, a);
  text[n++] = '1';
  for (size_t i = 0; i < count; i++, n += b)
    memcpy(text + n, close, b);
  zs_arena arena = {0};
  zs_expression_error error = {0};
  const zs_expression *e = zs_expression_parse(&arena, text, n, &error);
  if (!e)
    assert_string_equal(error.message, "nested more than 1000 levels deep");
  zs_arena_free(&arena);
  free(text);
  return e;
}

static void test_nesting_is_bounded(void **state)
{
  (void)state;
  static const struct {
    const char *open, *close;
  } cases[] = {{"(", ")"}, {"-", ""}, {"sin(", ")"}, {"1^", ""}, {"1 ? 1 : ", ""},
               {"1 ? ", " : 1"}};
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    assert_true(nested(cases[i].open, cases[i].close, 400));
    assert_false(nested(cases[i].open, cases[i].close, 100000));
  }
  assert_true(nested("1+", "", 100000)); /* a chain is not nested */
}

/* Machine-made formulas are long: names are found without searching. */
static void test_long_formula(void **state)
{
  (void)state;
  enum { LINES = 50000, WIDTH = 40 };
  char *text = malloc(LINES * WIDTH);
  size_t n = (size_t)sprintf(text, "let v0 = x;\n");
  for (int i = 1; i < LINES; i++)
    n += (size_t)sprintf(text + n, "let v%d = v%d + 1;\n", i, i - 1);
  n += (size_t)sprintf(text + n, "v%d", LINES - 1);
  text[n] = '\0';
  assert_same(value_of(text), 2 + LINES - 1);
  free(text);
}

/* Every beginning of a formula is parsed or refused, and not read beyond. */
static void test_truncated(void **state)
{
  (void)state;
  static const char text[] =
    "let r = hypot(x, y, 1.5e-3); r >= 2 ? clamp(r, -1, 1)^2 % 3 : mix(r, z, 0.25) != 1";
  for (size_t length = 0; length < strlen(text); length++) {
    zs_arena arena = {0};
    zs_expression_error error = {0};
    char *copy = malloc(length + 1);
    memcpy(copy, text, length);
    copy[length] = '7'; /* would change the last number */
    const zs_expression *e = zs_expression_parse(&arena, copy, length, &error);
    if (!e)
      assert_true(error.offset <= length && error.message[0]);
    free(copy);
    zs_arena_free(&arena);
  }
}

/* ---- Numbers ------------------------------------------------------------ */

static void test_number_syntax(void **state)
{
  (void)state;
  static const struct {
    const char *text;
    size_t length;
    double value;
  } cases[] = {
    {"1", 1, 1},           {"-1.5x", 4, -1.5},   {"+2", 2, 2},          {".5", 2, 0.5},
    {"5.", 2, 5},          {"1e3", 3, 1000},     {"1e", 1, 1},          {"1e+", 1, 1},
    {"1E-2", 4, 0.01},     {"1.2.3", 3, 1.2},    {"0x10", 1, 0},        {"00012", 5, 12},
    {"", 0, 0},            {"-", 0, 0},          {".", 0, 0},           {"e5", 0, 0},
    {"inf", 0, 0},         {"nan", 0, 0},        {" 1", 0, 0},          {"-.e1", 0, 0},
    {"1e999", 5, INFINITY}, {"1e-999", 6, 0},    {"0e999999999", 11, 0}, {"1,5", 1, 1},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    double value = 0;
    size_t length = zs_number_parse(cases[i].text, strlen(cases[i].text), &value);
    if (length != cases[i].length || (length && value != cases[i].value))
      fail_msg("'%s': %zu bytes, %.17g", cases[i].text, length, value);
  }
  double value = 0;
  assert_int_equal(zs_number_parse("12345", 3, &value), 3);
  assert_same(value, 123);
  assert_true(zs_number_parse("-0", 2, &value) == 2 && signbit(value));
}

/* One random decimal number: doubles, digit strings, numbers near halfway. */
static void random_number(uint64_t *seed, char *text, size_t size)
{
  switch (random_below(seed, 4)) {
  case 0: {
    uint64_t bits = random_bits(seed);
    double number;
    memcpy(&number, &bits, sizeof number);
    snprintf(text, size, "%.*g", 1 + (int)random_below(seed, 25), isfinite(number) ? number : 1.0);
    break;
  }
  case 1:
    snprintf(text, size, "%u.%06u", random_below(seed, 100000), random_below(seed, 1000000));
    break;
  case 2: /* exactly between two doubles, and one digit beside it */
    snprintf(text, size, "%llu%s",
             (unsigned long long)((random_bits(seed) >> 11 | UINT64_C(1) << 52) * 2 + 1),
             random_below(seed, 2) ? ".00000000000000000000000000000000001" : "");
    break;
  default: snprintf(text, size, "%u.%ue%d", random_below(seed, 10), random_below(seed, 1000000000),
                    (int)random_below(seed, 640) - 330);
  }
}

static void test_numbers_are_rounded_correctly_in_any_locale(void **state)
{
  (void)state;
  enum { COUNT = 20000, SIZE = 420 };
  char (*texts)[SIZE] = malloc(COUNT * sizeof *texts);
  double *expected = malloc(COUNT * sizeof *expected);
  uint64_t seed = 7;
  for (size_t i = 0; i < COUNT; i++) {
    random_number(&seed, texts[i], SIZE);
    expected[i] = strtod(texts[i], NULL);
  }
  /* Halfway cases with more digits than any table holds. */
  snprintf(texts[0], SIZE, "9007199254740993");
  expected[0] = 9007199254740992.0;
  snprintf(texts[1], SIZE, "9007199254740993.%0300d1", 0);
  expected[1] = 9007199254740994.0;
  for (int comma = 0; comma < 2; comma++) {
    if (comma && !set_comma_locale())
      break; /* another C library: nothing to try */
    for (size_t i = 0; i < COUNT; i++) {
      double value = NAN;
      if (zs_number_parse(texts[i], strlen(texts[i]), &value) != strlen(texts[i]) ||
          value != expected[i])
        fail_msg("'%s': %.17g, not %.17g", texts[i], value, expected[i]);
    }
    assert_same(value_of("1.5 + 0.25"), 1.75);
  }
  setlocale(LC_NUMERIC, "C");
  free(texts);
  free(expected);
}

static void test_very_long_numbers(void **state)
{
  (void)state;
  enum { DIGITS = 5000 };
  char *text = malloc(DIGITS + 16);
  double value = 0;
  memset(text, '0', DIGITS);
  memcpy(text + DIGITS, "1", 2);
  assert_int_equal(zs_number_parse(text, DIGITS + 1, &value), DIGITS + 1);
  assert_same(value, 1);
  /* 2^53 + 1 and then nothing but zeros, and a last digit that decides. */
  memcpy(text, "9007199254740993.", 17);
  text[DIGITS - 1] = '1';
  assert_int_equal(zs_number_parse(text, DIGITS, &value), DIGITS);
  assert_same(value, 9007199254740994.0);
  text[DIGITS - 1] = '0';
  assert_int_equal(zs_number_parse(text, DIGITS, &value), DIGITS);
  assert_same(value, 9007199254740992.0);
  /* 0.000...1 with an exponent that brings it back. */
  memset(text, '0', DIGITS);
  text[1] = '.';
  int n = snprintf(text + DIGITS - 1, 17, "1e%d", DIGITS - 2);
  assert_int_equal(zs_number_parse(text, DIGITS - 1 + (size_t)n, &value), DIGITS - 1 + n);
  assert_same(value, 1);
  free(text);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_precedence),
    cmocka_unit_test(test_functions),
    cmocka_unit_test(test_every_function_has_a_name_and_an_arity),
    cmocka_unit_test(test_random_expressions),
    cmocka_unit_test(test_variables),
    cmocka_unit_test(test_squares),
    cmocka_unit_test(test_errors),
    cmocka_unit_test(test_nesting_is_bounded),
    cmocka_unit_test(test_long_formula),
    cmocka_unit_test(test_truncated),
    cmocka_unit_test(test_number_syntax),
    cmocka_unit_test(test_numbers_are_rounded_correctly_in_any_locale),
    cmocka_unit_test(test_very_long_numbers),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
