#include "base/expression.h"

#include "base/array.h"
#include "base/diagnostic.h"
#include "base/names.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double PI = 3.14159265358979323846;

/* ---- Functions --------------------------------------------------------- */

static const struct {
  const char *name;
  unsigned arity;
} functions[ZS_FUNCTION_COUNT] = {
  [ZS_FUNCTION_NUMBER] = {"number", 0},
  [ZS_FUNCTION_VARIABLE] = {"variable", 0},
  [ZS_FUNCTION_ADD] = {"add", 2},
  [ZS_FUNCTION_SUBTRACT] = {"sub", 2},
  [ZS_FUNCTION_MULTIPLY] = {"mul", 2},
  [ZS_FUNCTION_DIVIDE] = {"div", 2},
  [ZS_FUNCTION_POWER] = {"pow", 2},
  [ZS_FUNCTION_MODULO] = {"mod", 2},
  [ZS_FUNCTION_MINIMUM] = {"min", 2},
  [ZS_FUNCTION_MAXIMUM] = {"max", 2},
  [ZS_FUNCTION_ATAN2] = {"atan2", 2},
  [ZS_FUNCTION_HYPOT] = {"hypot", 2},
  [ZS_FUNCTION_LESS] = {"less", 2},
  [ZS_FUNCTION_LESS_EQUAL] = {"less-equal", 2},
  [ZS_FUNCTION_EQUAL] = {"equal", 2},
  [ZS_FUNCTION_NOT_EQUAL] = {"not-equal", 2},
  [ZS_FUNCTION_NEGATE] = {"neg", 1},
  [ZS_FUNCTION_ABSOLUTE] = {"abs", 1},
  [ZS_FUNCTION_SQUARE] = {"square", 1},
  [ZS_FUNCTION_SQUARE_ROOT] = {"sqrt", 1},
  [ZS_FUNCTION_EXPONENTIAL] = {"exp", 1},
  [ZS_FUNCTION_LOGARITHM] = {"log", 1},
  [ZS_FUNCTION_SINE] = {"sin", 1},
  [ZS_FUNCTION_COSINE] = {"cos", 1},
  [ZS_FUNCTION_TANGENT] = {"tan", 1},
  [ZS_FUNCTION_ARC_SINE] = {"asin", 1},
  [ZS_FUNCTION_ARC_COSINE] = {"acos", 1},
  [ZS_FUNCTION_ARC_TANGENT] = {"atan", 1},
  [ZS_FUNCTION_FLOOR] = {"floor", 1},
  [ZS_FUNCTION_CEILING] = {"ceil", 1},
  [ZS_FUNCTION_ROUND] = {"round", 1},
  [ZS_FUNCTION_SIGN] = {"sign", 1},
  [ZS_FUNCTION_SELECT] = {"select", 3},
};

unsigned zs_function_arity(zs_function function)
{
  return functions[function].arity;
}

const char *zs_function_name(zs_function function)
{
  return functions[function].name;
}

double zs_function_value(zs_function function, double a, double b, double c)
{
  switch (function) {
  case ZS_FUNCTION_ADD: return a + b;
  case ZS_FUNCTION_SUBTRACT: return a - b;
  case ZS_FUNCTION_MULTIPLY: return a * b;
  case ZS_FUNCTION_DIVIDE: return a / b;
  case ZS_FUNCTION_POWER: return pow(a, b);
  case ZS_FUNCTION_MODULO: return a - b * floor(a / b);
  case ZS_FUNCTION_MINIMUM: return a < b ? a : b;
  case ZS_FUNCTION_MAXIMUM: return a > b ? a : b;
  case ZS_FUNCTION_ATAN2: return atan2(a, b);
  case ZS_FUNCTION_HYPOT: return hypot(a, b);
  case ZS_FUNCTION_LESS: return a < b;
  case ZS_FUNCTION_LESS_EQUAL: return a <= b;
  case ZS_FUNCTION_EQUAL: return a == b;
  case ZS_FUNCTION_NOT_EQUAL: return a != b;
  case ZS_FUNCTION_NEGATE: return -a;
  case ZS_FUNCTION_ABSOLUTE: return fabs(a);
  case ZS_FUNCTION_SQUARE: return a * a;
  case ZS_FUNCTION_SQUARE_ROOT: return sqrt(a);
  case ZS_FUNCTION_EXPONENTIAL: return exp(a);
  case ZS_FUNCTION_LOGARITHM: return log(a);
  case ZS_FUNCTION_SINE: return sin(a);
  case ZS_FUNCTION_COSINE: return cos(a);
  case ZS_FUNCTION_TANGENT: return tan(a);
  case ZS_FUNCTION_ARC_SINE: return asin(a);
  case ZS_FUNCTION_ARC_COSINE: return acos(a);
  case ZS_FUNCTION_ARC_TANGENT: return atan(a);
  case ZS_FUNCTION_FLOOR: return floor(a);
  case ZS_FUNCTION_CEILING: return ceil(a);
  /* Halves go up: one rule on both sides of zero, so that steps have one width. */
  case ZS_FUNCTION_ROUND: return floor(a + 0.5);
  case ZS_FUNCTION_SIGN: return (a > 0) - (a < 0);
  case ZS_FUNCTION_SELECT: return a != 0 ? b : c;
  case ZS_FUNCTION_NUMBER:
  case ZS_FUNCTION_VARIABLE:
  case ZS_FUNCTION_COUNT: break;
  }
  return NAN;
}

double zs_expression_value(const zs_expression *expression, const double *values, double *scratch)
{
  for (uint32_t i = 0; i < expression->count; i++) {
    const zs_expression_node *node = &expression->nodes[i];
    const uint32_t *operand = node->operand;
    switch (functions[node->function].arity) {
    case 0:
      scratch[i] = node->function == ZS_FUNCTION_NUMBER ? node->number : values[operand[0]];
      break;
    case 1: scratch[i] = zs_function_value(node->function, scratch[operand[0]], 0, 0); break;
    case 2:
      scratch[i] = zs_function_value(node->function, scratch[operand[0]], scratch[operand[1]], 0);
      break;
    default:
      scratch[i] = zs_function_value(node->function, scratch[operand[0]], scratch[operand[1]],
                                     scratch[operand[2]]);
    }
  }
  return scratch[expression->count - 1];
}

/* ---- Numbers ----------------------------------------------------------- */

enum {
  /* No double needs more than 767 significant digits to be rounded correctly;
   * one more stands for all that follow. */
  DIGITS = 770,
  EXPONENT_LIMIT = 100000
};

static bool is_digit(char c)
{
  return c >= '0' && c <= '9';
}

/* digits x 10^exponent, correctly rounded.  Without a decimal point there is
 * nothing in the text that a locale could change. */
static double convert(char text[DIGITS + 16], size_t digits, long exponent)
{
  if (digits == 0)
    return 0;
  if (digits <= 15 && exponent >= -22 && exponent <= 22) {
    static const double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                    1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                    1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    double number = 0; /* both factors are exact: one rounding */
    for (size_t i = 0; i < digits; i++)
      number = 10 * number + (text[i] - '0');
    return exponent < 0 ? number / powers[-exponent] : number * powers[exponent];
  }
  if (exponent > EXPONENT_LIMIT)
    exponent = EXPONENT_LIMIT;
  if (exponent < -EXPONENT_LIMIT)
    exponent = -EXPONENT_LIMIT;
  snprintf(text + digits, 16, "e%ld", exponent);
  return strtod(text, NULL);
}

/* Length of "e-12" at `at`, and its value; 0 when there is none. */
static size_t parse_exponent(const char *at, const char *end, long *exponent)
{
  const char *digit = at;
  if (digit == end || (*digit != 'e' && *digit != 'E'))
    return 0;
  digit++;
  bool negative = digit < end && *digit == '-';
  if (digit < end && (*digit == '-' || *digit == '+'))
    digit++;
  if (digit == end || !is_digit(*digit))
    return 0;
  long value = 0;
  for (; digit < end && is_digit(*digit); digit++)
    if (value < EXPONENT_LIMIT)
      value = 10 * value + (*digit - '0');
  *exponent = negative ? -value : value;
  return (size_t)(digit - at);
}

size_t zs_number_parse(const char *text, size_t length, double *value)
{
  char digits[DIGITS + 16];
  size_t count = 0;
  long exponent = 0;
  bool any = false, point = false;
  const char *at = text, *end = text + length;
  bool negative = at < end && *at == '-';
  if (at < end && (*at == '-' || *at == '+'))
    at++;
  for (; at < end && (is_digit(*at) || (*at == '.' && !point)); at++) {
    if (*at == '.') {
      point = true;
      continue;
    }
    any = true;
    if (point && exponent > -EXPONENT_LIMIT)
      exponent--;
    if (count == 0 && *at == '0')
      continue;
    if (count < DIGITS) {
      digits[count++] = *at;
    } else {
      if (*at != '0')
        digits[DIGITS - 1] = '1';
      if (exponent < EXPONENT_LIMIT)
        exponent++;
    }
  }
  if (!any)
    return 0;
  long written = 0;
  at += parse_exponent(at, end, &written);
  double number = convert(digits, count, exponent + written);
  *value = negative ? -number : number;
  return (size_t)(at - text);
}

/* ---- The parser -------------------------------------------------------- */

enum {
  MAXIMUM_NESTING = 1000,
  MAXIMUM_ARGUMENTS = 64
};

typedef enum lowering {
  LOWER_PLAIN,  /* one operation */
  LOWER_FOLD,   /* left fold of an operation over two or more arguments */
  LOWER_SCALED, /* times a constant */
  LOWER_CLAMP,
  LOWER_MIX
} lowering;

static const struct known_function {
  const char *name;
  zs_function function;
  lowering lowering;
  unsigned least, most; /* arguments */
  double factor;
} known_functions[] = {
  {"abs", ZS_FUNCTION_ABSOLUTE, LOWER_PLAIN, 1, 1, 0},
  {"min", ZS_FUNCTION_MINIMUM, LOWER_FOLD, 2, MAXIMUM_ARGUMENTS, 0},
  {"max", ZS_FUNCTION_MAXIMUM, LOWER_FOLD, 2, MAXIMUM_ARGUMENTS, 0},
  {"sqrt", ZS_FUNCTION_SQUARE_ROOT, LOWER_PLAIN, 1, 1, 0},
  {"exp", ZS_FUNCTION_EXPONENTIAL, LOWER_PLAIN, 1, 1, 0},
  {"log", ZS_FUNCTION_LOGARITHM, LOWER_PLAIN, 1, 1, 0},
  {"sin", ZS_FUNCTION_SINE, LOWER_PLAIN, 1, 1, 0},
  {"cos", ZS_FUNCTION_COSINE, LOWER_PLAIN, 1, 1, 0},
  {"tan", ZS_FUNCTION_TANGENT, LOWER_PLAIN, 1, 1, 0},
  {"asin", ZS_FUNCTION_ARC_SINE, LOWER_PLAIN, 1, 1, 0},
  {"acos", ZS_FUNCTION_ARC_COSINE, LOWER_PLAIN, 1, 1, 0},
  {"atan", ZS_FUNCTION_ARC_TANGENT, LOWER_PLAIN, 1, 1, 0},
  {"atan2", ZS_FUNCTION_ATAN2, LOWER_PLAIN, 2, 2, 0},
  {"floor", ZS_FUNCTION_FLOOR, LOWER_PLAIN, 1, 1, 0},
  {"ceil", ZS_FUNCTION_CEILING, LOWER_PLAIN, 1, 1, 0},
  {"round", ZS_FUNCTION_ROUND, LOWER_PLAIN, 1, 1, 0},
  {"sign", ZS_FUNCTION_SIGN, LOWER_PLAIN, 1, 1, 0},
  {"clamp", ZS_FUNCTION_MINIMUM, LOWER_CLAMP, 3, 3, 0},
  {"mix", ZS_FUNCTION_ADD, LOWER_MIX, 3, 3, 0},
  {"pow", ZS_FUNCTION_POWER, LOWER_PLAIN, 2, 2, 0},
  {"mod", ZS_FUNCTION_MODULO, LOWER_PLAIN, 2, 2, 0},
  {"hypot", ZS_FUNCTION_HYPOT, LOWER_FOLD, 2, 3, 0},
  {"deg", ZS_FUNCTION_MULTIPLY, LOWER_SCALED, 1, 1, 180 / 3.14159265358979323846},
  {"rad", ZS_FUNCTION_MULTIPLY, LOWER_SCALED, 1, 1, 3.14159265358979323846 / 180},
};

enum { KNOWN_FUNCTIONS = sizeof known_functions / sizeof known_functions[0] };

const char *const zs_expression_function_names[] = {
  "abs",   "min",  "max",   "sqrt",  "exp",  "log",   "sin", "cos", "tan", "asin",  "acos", "atan",
  "atan2", "floor", "ceil", "round", "sign", "clamp", "mix", "pow", "mod", "hypot", "deg",  "rad"};
const size_t zs_expression_function_count = KNOWN_FUNCTIONS;
_Static_assert(sizeof zs_expression_function_names / sizeof zs_expression_function_names[0] ==
                 KNOWN_FUNCTIONS,
               "every function has a name");

typedef enum token_kind {
  TOKEN_END,
  TOKEN_NUMBER,
  TOKEN_NAME,
  TOKEN_OPERATOR, /* one of operators[] */
  TOKEN_MARK,     /* ( ) , ; ? : = */
  TOKEN_UNKNOWN   /* a character with no meaning here */
} token_kind;

typedef struct token {
  token_kind kind;
  const char *text;
  size_t length;
  double number;
} token;

typedef struct parser {
  const char *text, *at, *end;
  token token;      /* the one not consumed yet */
  const char *last; /* end of the one before it */
  zs_arena scratch;
  zs_expression_node *nodes;
  size_t count, capacity;
  zs_names names; /* to the index of the node that a name stands for */
  const char **variables;
  uint32_t *offsets;
  size_t variable_count, variable_capacity;
  unsigned nesting;
  zs_arena *arena;
  zs_expression_error *error;
  bool failed;
} parser;

/* Record the first error; later ones follow from it. */
__attribute__((format(printf, 3, 4))) static uint32_t fail(parser *p, const char *where,
                                                           const char *format, ...)
{
  if (!p->failed) {
    p->failed = true;
    p->error->memory = false;
    p->error->offset = (size_t)(where - p->text);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(p->error->message, sizeof p->error->message, format, arguments);
    va_end(arguments);
  }
  return 0;
}

static uint32_t fail_memory(parser *p)
{
  bool first = !p->failed;
  fail(p, p->text, "out of memory");
  p->error->memory = first || p->error->memory;
  return 0;
}

/* Two-character operators first. */
static const struct binary {
  const char *text;
  int precedence;
  zs_function function;
  bool swap; /* a > b is b < a */
} operators[] = {
  {"<=", 1, ZS_FUNCTION_LESS_EQUAL, false}, {">=", 1, ZS_FUNCTION_LESS_EQUAL, true},
  {"==", 1, ZS_FUNCTION_EQUAL, false},      {"!=", 1, ZS_FUNCTION_NOT_EQUAL, false},
  {"<", 1, ZS_FUNCTION_LESS, false},        {">", 1, ZS_FUNCTION_LESS, true},
  {"+", 2, ZS_FUNCTION_ADD, false},         {"-", 2, ZS_FUNCTION_SUBTRACT, false},
  {"*", 3, ZS_FUNCTION_MULTIPLY, false},    {"/", 3, ZS_FUNCTION_DIVIDE, false},
  {"%", 3, ZS_FUNCTION_MODULO, false},      {"^", 5, ZS_FUNCTION_POWER, false},
};

enum { COMPARISON = 1, NEGATION = 4, POWER = 5 };

static const struct binary *find_operator(const char *text, size_t length)
{
  for (size_t i = 0; i < sizeof operators / sizeof operators[0]; i++) {
    size_t n = strlen(operators[i].text);
    if (n <= length && memcmp(operators[i].text, text, n) == 0)
      return &operators[i];
  }
  return NULL;
}

static bool is_letter(char c)
{
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}

static size_t name_length(const char *at, const char *end)
{
  size_t n = 0;
  while (at + n < end && (is_letter(at[n]) || is_digit(at[n]) || at[n] == '.'))
    n++;
  return n;
}

/* Bytes of the UTF-8 character that starts here. */
static size_t character_length(const char *at, const char *end)
{
  size_t n = 1;
  while (at + n < end && ((unsigned char)at[n] & 0xC0) == 0x80)
    n++;
  return n;
}

/* Read the next token. */
static void advance(parser *p)
{
  p->last = p->at;
  while (p->at < p->end && (*p->at == ' ' || *p->at == '\t' || *p->at == '\n' || *p->at == '\r'))
    p->at++;
  token t = {.kind = TOKEN_END, .text = p->at};
  size_t left = (size_t)(p->end - p->at);
  const struct binary *binary;
  if (left == 0) {
    t.length = 0;
  } else if (is_letter(*p->at)) {
    t.kind = TOKEN_NAME;
    t.length = name_length(p->at, p->end);
  } else if ((is_digit(*p->at) || *p->at == '.') &&
             (t.length = zs_number_parse(p->at, left, &t.number)) > 0) {
    t.kind = TOKEN_NUMBER;
  } else if ((binary = find_operator(p->at, left)) != NULL) {
    t.kind = TOKEN_OPERATOR;
    t.length = strlen(binary->text);
  } else {
    t.kind = *p->at && strchr("(),;?:=", *p->at) ? TOKEN_MARK : TOKEN_UNKNOWN;
    t.length = character_length(p->at, p->end);
  }
  p->at += t.length;
  p->token = t;
}

static bool at_mark(const parser *p, char mark)
{
  return p->token.kind == TOKEN_MARK && *p->token.text == mark;
}

static uint32_t fail_expected(parser *p, const char *expected)
{
  const token *t = &p->token;
  if (t->kind == TOKEN_END)
    return fail(p, p->last, "expected %s at the end", expected);
  int shown = t->length > 40 ? 40 : (int)t->length;
  return fail(p, t->text, "expected %s, found '%.*s'", expected, shown, t->text);
}

static void expect_mark(parser *p, char mark)
{
  char expected[] = {'\'', mark, '\'', '\0'};
  if (at_mark(p, mark))
    advance(p);
  else
    fail_expected(p, expected);
}

static uint32_t add_node(parser *p, zs_expression_node node)
{
  zs_expression_node *nodes = zs_array_grown(p->nodes, p->count + 1, &p->capacity, sizeof *nodes);
  if (!nodes)
    return fail_memory(p);
  p->nodes = nodes;
  nodes[p->count] = node;
  return (uint32_t)p->count++;
}

static uint32_t add_number(parser *p, double number)
{
  return add_node(p, (zs_expression_node){.function = ZS_FUNCTION_NUMBER, .number = number});
}

static uint32_t add_operation(parser *p, zs_function function, uint32_t a, uint32_t b, uint32_t c)
{
  return add_node(p, (zs_expression_node){.function = function, .operand = {a, b, c}});
}

static bool is_number(const parser *p, uint32_t node, double number)
{
  return !p->failed && p->nodes[node].function == ZS_FUNCTION_NUMBER &&
         p->nodes[node].number == number;
}

static uint32_t add_binary(parser *p, const struct binary *binary, uint32_t a, uint32_t b)
{
  if ((binary->function == ZS_FUNCTION_POWER && is_number(p, b, 2)) ||
      (binary->function == ZS_FUNCTION_MULTIPLY && a == b))
    return add_operation(p, ZS_FUNCTION_SQUARE, a, 0, 0);
  return binary->swap ? add_operation(p, binary->function, b, a, 0)
                      : add_operation(p, binary->function, a, b, 0);
}

static uint32_t parse_choice(parser *p);

static const struct known_function *find_function(const char *name, size_t length)
{
  for (size_t i = 0; i < KNOWN_FUNCTIONS; i++)
    if (strlen(known_functions[i].name) == length &&
        memcmp(known_functions[i].name, name, length) == 0)
      return &known_functions[i];
  return NULL;
}

static uint32_t fail_unknown_function(parser *p, const token *name)
{
  char word[64];
  snprintf(word, sizeof word, "%.*s", name->length < 60 ? (int)name->length : 60, name->text);
  const char *near = zs_suggest(word, zs_expression_function_names, zs_expression_function_count);
  if (near)
    return fail(p, name->text, "'%s' is not a function; did you mean '%s'?", word, near);
  return fail(p, name->text, "'%s' is not a function", word);
}

/* The operations that a call stands for. */
static uint32_t lower_call(parser *p, const struct known_function *known, const uint32_t *argument,
                           unsigned count)
{
  uint32_t a = argument[0];
  switch (known->lowering) {
  case LOWER_PLAIN:
    if (known->function == ZS_FUNCTION_POWER && is_number(p, argument[1], 2))
      return add_operation(p, ZS_FUNCTION_SQUARE, a, 0, 0);
    return add_operation(p, known->function, a, count > 1 ? argument[1] : 0, 0);
  case LOWER_FOLD:
    for (unsigned i = 1; i < count; i++)
      a = add_operation(p, known->function, a, argument[i], 0);
    return a;
  case LOWER_SCALED:
    return add_operation(p, ZS_FUNCTION_MULTIPLY, a, add_number(p, known->factor), 0);
  case LOWER_CLAMP:
    a = add_operation(p, ZS_FUNCTION_MAXIMUM, a, argument[1], 0);
    return add_operation(p, ZS_FUNCTION_MINIMUM, a, argument[2], 0);
  case LOWER_MIX: break;
  }
  /* a (1 - t) + b t: exact at both ends. */
  uint32_t t = argument[2];
  uint32_t rest = add_operation(p, ZS_FUNCTION_SUBTRACT, add_number(p, 1), t, 0);
  uint32_t left = add_operation(p, ZS_FUNCTION_MULTIPLY, a, rest, 0);
  uint32_t right = add_operation(p, ZS_FUNCTION_MULTIPLY, argument[1], t, 0);
  return add_operation(p, ZS_FUNCTION_ADD, left, right, 0);
}

/* The rest of a call, whose '(' is the next token. */
static uint32_t parse_call(parser *p, const token *name)
{
  const struct known_function *known = find_function(name->text, name->length);
  if (!known)
    return fail_unknown_function(p, name);
  uint32_t argument[MAXIMUM_ARGUMENTS];
  unsigned count = 0;
  advance(p);
  while (!p->failed && !at_mark(p, ')')) {
    if (count == MAXIMUM_ARGUMENTS)
      return fail(p, p->token.text, "more than %d arguments", MAXIMUM_ARGUMENTS);
    argument[count++] = parse_choice(p);
    if (!at_mark(p, ','))
      break;
    advance(p);
    if (at_mark(p, ')'))
      return fail_expected(p, "an argument");
  }
  if (!p->failed)
    expect_mark(p, ')');
  if (p->failed)
    return 0;
  if (count >= known->least && count <= known->most)
    return lower_call(p, known, argument, count);
  if (known->least == known->most)
    return fail(p, name->text, "'%s' takes %u argument%s, %u given", known->name, known->least,
                known->least == 1 ? "" : "s", count);
  if (count < known->least)
    return fail(p, name->text, "'%s' takes at least %u arguments, %u given", known->name,
                known->least, count);
  return fail(p, name->text, "'%s' takes at most %u arguments, %u given", known->name, known->most,
              count);
}

static uint32_t add_variable(parser *p, const token *name)
{
  size_t capacity = p->variable_capacity;
  const char **variables =
    zs_array_grown(p->variables, p->variable_count + 1, &capacity, sizeof *variables);
  if (!variables)
    return fail_memory(p);
  p->variables = variables;
  uint32_t *offsets =
    zs_array_grown(p->offsets, p->variable_count + 1, &p->variable_capacity, sizeof *offsets);
  if (!offsets)
    return fail_memory(p);
  p->offsets = offsets;
  const char *copy = zs_arena_string(p->arena, name->text, name->length);
  uint32_t node = add_operation(p, ZS_FUNCTION_VARIABLE, (uint32_t)p->variable_count, 0, 0);
  if (!copy || !zs_names_add(&p->names, &p->scratch, name->text, name->length, node))
    return fail_memory(p);
  variables[p->variable_count] = copy;
  offsets[p->variable_count++] = (uint32_t)(name->text - p->text);
  return node;
}

static bool token_is(const token *t, const char *word)
{
  return t->length == strlen(word) && memcmp(t->text, word, t->length) == 0;
}

static uint32_t parse_name(parser *p)
{
  token name = p->token;
  advance(p);
  if (at_mark(p, '('))
    return parse_call(p, &name);
  if (token_is(&name, "pi"))
    return add_number(p, PI);
  if (token_is(&name, "let"))
    return fail(p, name.text, "'let' belongs at the start of a statement");
  const struct known_function *known = find_function(name.text, name.length);
  if (known)
    return fail(p, name.text, "'%s' is a function; expected '(' after it", known->name);
  const zs_name *entry = zs_names_find(&p->names, name.text, name.length);
  return entry ? entry->value : add_variable(p, &name);
}

static uint32_t parse_primary(parser *p)
{
  uint32_t node;
  switch (p->token.kind) {
  case TOKEN_NUMBER:
    if (isinf(p->token.number))
      return fail(p, p->token.text, "the number is too large");
    node = add_number(p, p->token.number);
    advance(p);
    return node;
  case TOKEN_NAME: return parse_name(p);
  case TOKEN_MARK:
    if (!at_mark(p, '('))
      break;
    advance(p);
    node = parse_choice(p);
    expect_mark(p, ')');
    return node;
  case TOKEN_END:
  case TOKEN_OPERATOR:
  case TOKEN_UNKNOWN: break;
  }
  return fail_expected(p, "a number, a name or '('");
}

static uint32_t parse_binary(parser *p, int least);

/* Signs bind less than powers: -x^2 is -(x^2), and 2^-x is allowed. */
static uint32_t parse_signed(parser *p)
{
  if (p->token.kind != TOKEN_OPERATOR || (*p->token.text != '-' && *p->token.text != '+'))
    return parse_primary(p);
  bool negative = *p->token.text == '-';
  advance(p);
  uint32_t operand = parse_binary(p, NEGATION);
  return negative ? add_operation(p, ZS_FUNCTION_NEGATE, operand, 0, 0) : operand;
}

/* Operators of at least a precedence. */
static uint32_t parse_binary(parser *p, int least)
{
  if (p->nesting == MAXIMUM_NESTING)
    return fail(p, p->token.text, "nested more than %d levels deep", MAXIMUM_NESTING);
  p->nesting++;
  uint32_t left = parse_signed(p);
  bool compared = false;
  while (!p->failed && p->token.kind == TOKEN_OPERATOR) {
    const struct binary *binary = find_operator(p->token.text, p->token.length);
    if (binary->precedence < least)
      break;
    if (binary->precedence == COMPARISON && compared) {
      fail(p, p->token.text, "comparisons do not chain; use parentheses");
      break;
    }
    compared = binary->precedence == COMPARISON;
    advance(p);
    /* Powers group from the right, everything else from the left. */
    uint32_t right =
      parse_binary(p, binary->precedence == POWER ? NEGATION : binary->precedence + 1);
    left = add_binary(p, binary, left, right);
  }
  p->nesting--;
  return left;
}

/* c ? a : b, or anything that binds closer. */
static uint32_t parse_choice(parser *p)
{
  uint32_t condition = parse_binary(p, COMPARISON);
  if (p->failed || !at_mark(p, '?'))
    return condition;
  if (p->nesting == MAXIMUM_NESTING)
    return fail(p, p->token.text, "nested more than %d levels deep", MAXIMUM_NESTING);
  p->nesting++;
  advance(p);
  uint32_t yes = parse_choice(p);
  expect_mark(p, ':');
  uint32_t no = p->failed ? 0 : parse_choice(p);
  p->nesting--;
  return add_operation(p, ZS_FUNCTION_SELECT, condition, yes, no);
}

/* let name = expression; */
static void parse_let(parser *p)
{
  advance(p);
  token name = p->token;
  if (name.kind != TOKEN_NAME) {
    fail_expected(p, "a name after 'let'");
    return;
  }
  int shown = name.length < 60 ? (int)name.length : 60;
  if (token_is(&name, "pi") || token_is(&name, "let") || find_function(name.text, name.length)) {
    fail(p, name.text, "'%.*s' has a meaning already", shown, name.text);
    return;
  }
  advance(p);
  expect_mark(p, '=');
  uint32_t value = p->failed ? 0 : parse_choice(p);
  if (!p->failed)
    expect_mark(p, ';');
  if (p->failed)
    return;
  if (zs_names_find(&p->names, name.text, name.length))
    fail(p, name.text, "'%.*s' has been used or defined before", shown, name.text);
  else if (!zs_names_add(&p->names, &p->scratch, name.text, name.length, value))
    fail_memory(p);
}

static uint32_t parse_program(parser *p)
{
  advance(p);
  while (!p->failed && p->token.kind == TOKEN_NAME && token_is(&p->token, "let"))
    parse_let(p);
  if (p->failed)
    return 0;
  uint32_t result = parse_choice(p);
  if (!p->failed && p->token.kind != TOKEN_END)
    fail_expected(p, "an operator or the end");
  return result;
}

/* Copy the result to the arena.  Nodes behind the result belong to definitions
 * that nothing uses. */
static const zs_expression *finish(parser *p, uint32_t result)
{
  zs_expression *expression = ZS_ARENA_NEW(p->arena, zs_expression, 1);
  size_t count = (size_t)result + 1, variables = p->variable_count;
  zs_expression_node *nodes = ZS_ARENA_NEW(p->arena, zs_expression_node, count);
  const char **names = ZS_ARENA_NEW(p->arena, const char *, variables);
  uint32_t *offsets = ZS_ARENA_NEW(p->arena, uint32_t, variables);
  if (!expression || !nodes || !names || !offsets) {
    fail_memory(p);
    return NULL;
  }
  memcpy(nodes, p->nodes, count * sizeof *nodes);
  if (variables) {
    memcpy(names, p->variables, variables * sizeof *names);
    memcpy(offsets, p->offsets, variables * sizeof *offsets);
  }
  *expression = (zs_expression){nodes, (uint32_t)count, names, offsets, (uint32_t)variables};
  return expression;
}

const zs_expression *zs_expression_parse(zs_arena *arena, const char *text, size_t length,
                                         zs_expression_error *error)
{
  parser p = {.text = text, .at = text, .end = text + length, .arena = arena, .error = error};
  const zs_expression *expression = NULL;
  /* Every byte makes at most two nodes. */
  if (length > UINT32_MAX / 4)
    fail(&p, text, "longer than %u bytes", UINT32_MAX / 4);
  uint32_t result = p.failed ? 0 : parse_program(&p);
  if (!p.failed)
    expression = finish(&p, result);
  free(p.nodes);
  free(p.variables);
  free(p.offsets);
  zs_arena_free(&p.scratch);
  return expression;
}
