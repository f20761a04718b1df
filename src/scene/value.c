/* From attribute values as written to parameter structs, by the table entries
 * of the attributes: types, ranges, choices, expressions. */
#include "files/number.h"
#include "scene/scene.h"

#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SHOWN = 60, DESCRIPTION_SIZE = 320 };

/* An attribute that is being read. */
typedef struct input {
  zs_reading *reading;
  const zs_attribute *row;
  const zs_element *element;
  zs_xml_attribute *written;
} input;

/* A number that is written as an expression. */
typedef struct term {
  size_t index;                    /* of the number in the list */
  const char *text;                /* with its braces */
  size_t length;
  size_t offset;                   /* of the expression in the value */
  const zs_expression *expression;
  const struct term *next;
} term;

/* A value as a list of numbers, some of which are known only when evaluated. */
typedef struct terms {
  double *numbers;
  size_t count;
  const term *expressions;
  bool malformed; /* reported */
} terms;

/* ---- What is expected -------------------------------------------------- */

/* Add to a description, cut at its end. */
__attribute__((format(printf, 2, 3))) static void describe_more(char text[DESCRIPTION_SIZE],
                                                                const char *format, ...)
{
  size_t used = strlen(text);
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text + used, DESCRIPTION_SIZE - used, format, arguments);
  va_end(arguments);
}

static void describe_noun(const zs_attribute *row, char text[DESCRIPTION_SIZE])
{
  bool length = strcmp(row->unit, "length") == 0, angle = strcmp(row->unit, "degrees") == 0;
  const char *one = length ? "a length" : angle ? "an angle in degrees" : "a number";
  const char *many = length ? "lengths" : angle ? "angles in degrees" : "numbers";
  switch (row->type) {
  case ZS_NUMBER:
    for (const char *const *word = row->choices; word && *word; word++)
      describe_more(text, "'%s' or ", *word);
    describe_more(text, "%s", one);
    break;
  case ZS_INTEGER: describe_more(text, "a whole number"); break;
  case ZS_VECTOR2: describe_more(text, "two %s", many); break;
  case ZS_VECTOR3: describe_more(text, "three %s", many); break;
  case ZS_SCALE: describe_more(text, "one or three %s", many); break;
  case ZS_NUMBERS: describe_more(text, "%s", many); break;
  case ZS_CHOICE:
    for (const char *const *choice = row->choices; *choice; choice++)
      describe_more(text, "%s'%s'", choice == row->choices ? "" : choice[1] ? ", " : " or ",
                    *choice);
    break;
  case ZS_BOOLEAN: describe_more(text, "'true' or 'false'"); break;
  case ZS_TEXT: describe_more(text, "a text"); break;
  case ZS_FILE: describe_more(text, "the name of a file"); break;
  case ZS_FILES: describe_more(text, "the name of a file, or a pattern with '*'"); break;
  case ZS_FORMULA: describe_more(text, "a formula"); break;
  }
}

/* "a length > 0". */
static const char *describe(const zs_attribute *row, char text[DESCRIPTION_SIZE])
{
  char lower[ZS_NUMBER_SIZE], upper[ZS_NUMBER_SIZE];
  text[0] = '\0';
  describe_noun(row, text);
  switch (row->range) {
  case ZS_RANGE_ANY: break;
  case ZS_RANGE_POSITIVE: describe_more(text, " > 0"); break;
  case ZS_RANGE_NOT_NEGATIVE: describe_more(text, " >= 0"); break;
  case ZS_RANGE_NOT_ZERO: describe_more(text, " other than 0"); break;
  case ZS_RANGE_BETWEEN:
    zs_number_format(lower, row->minimum);
    zs_number_format(upper, row->maximum);
    if (isinf(row->maximum))
      describe_more(text, " >= %s", lower);
    else if (isinf(row->minimum))
      describe_more(text, " <= %s", upper);
    else
      describe_more(text, " from %s to %s", lower, upper);
  }
  return text;
}

/* At most SHOWN bytes of a text, without cutting a character. */
static const char *shorten(const char *value, size_t length, char text[SHOWN + 8])
{
  size_t shown = length;
  if (length > SHOWN) {
    shown = SHOWN;
    while (shown > 0 && ((unsigned char)value[shown] & 0xC0) == 0x80)
      shown--;
  }
  snprintf(text, SHOWN + 8, "%.*s%s", (int)shown, value, length > SHOWN ? "..." : "");
  return text;
}

/* "'VALUE' PROBLEM; expected DESCRIPTION", at byte `at` of the value. */
static bool fail(const input *in, size_t at, zs_status status, const char *hint,
                 const char *value, size_t length, const char *problem)
{
  char shown[SHOWN + 8], expected[DESCRIPTION_SIZE];
  zs_place place = zs_attribute_place(in->element, in->written, at);
  return zs_report(in->reading->diag, ZS_ERROR, status, &place, hint, "'%s' %s; expected %s",
                   shorten(value, length, shown), problem, describe(in->row, expected));
}

static bool fail_value(const input *in, zs_status status, const char *hint, const char *problem)
{
  return fail(in, 0, status, hint, in->written->value, in->written->length, problem);
}

/* Report why an expression cannot be parsed. */
static bool fail_expression(const input *in, const zs_place *place, const char *hint,
                            const zs_expression_error *error)
{
  zs_diag *diag = in->reading->diag;
  if (error->memory)
    return zs_fail_memory(diag);
  return zs_report(diag, ZS_ERROR, ZS_ERROR_SYNTAX, place, hint, "%s", error->message);
}

/* ---- Lists of numbers and expressions ---------------------------------- */

static bool is_space(char c)
{
  return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

static bool is_letter(char c)
{
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

static size_t skip_space(const char *text, size_t at, size_t length)
{
  while (at < length && is_space(text[at]))
    at++;
  return at;
}

static bool ends_number(const char *text, size_t at, size_t length)
{
  return at == length || is_space(text[at]) || text[at] == ',';
}

static size_t word_length(const char *text, size_t at, size_t length)
{
  size_t end = at;
  while (!ends_number(text, end, length) && text[end] != '{')
    end++;
  return end - at;
}

/* Read an expression in braces at `at`; returns what is behind it, or 0. */
static size_t parse_braces(const input *in, size_t at, term *t)
{
  const char *text = in->written->value;
  size_t length = in->written->length;
  const char *close = memchr(text + at, '}', length - at);
  zs_expression_error error;
  if (!close) {
    fail(in, at, ZS_ERROR_SYNTAX, NULL, text + at, length - at, "has no closing '}'");
    return 0;
  }
  size_t end = (size_t)(close - text);
  t->text = text + at;
  t->length = end + 1 - at;
  t->offset = at + 1;
  t->expression =
    zs_expression_parse(&in->reading->scene->arena, text + t->offset, end - t->offset, &error);
  if (!t->expression) {
    zs_place place = zs_attribute_place(in->element, in->written, t->offset + error.offset);
    fail_expression(in, &place, NULL, &error);
    return 0;
  }
  if (!ends_number(text, end + 1, length)) {
    fail(in, at, ZS_ERROR_SYNTAX, NULL, text + at, word_length(text, end, length) + end - at,
         "has no space after '}'");
    return 0;
  }
  return end + 1;
}

/* Read a plain number at `at`, the `index`-th of the list; returns what is
 * behind it, or 0. */
static size_t parse_plain(const input *in, size_t at, size_t index, double *number)
{
  const char *text = in->written->value, *problem = NULL, *hint = NULL;
  size_t length = in->written->length, word = word_length(text, at, length);
  size_t n = zs_number_parse(text + at, word, number);
  if (n == 0 || n < word) {
    problem = "is not a number";
    /* "3mm" or "3 mm" */
    if (word > n && is_letter(text[at + n]) && (n > 0 || index > 0))
      hint = "numbers have no unit; lengths are in the scene's units";
  } else if (isinf(*number)) {
    problem = "is too large";
  } else if (at + n < length && text[at + n] == '{') {
    problem = "has no space before '{'";
  }
  if (!problem)
    return at + n;
  fail(in, at, ZS_ERROR_SYNTAX, hint, text + at, word ? word : length - at, problem);
  return 0;
}

/* Count what is at most the number of terms. */
static size_t count_words(const char *text, size_t length)
{
  size_t count = 0;
  bool between = true;
  for (size_t i = 0; i < length; i++) {
    bool ends = ends_number(text, i, length);
    count += between && !ends;
    between = ends;
  }
  return count;
}

/* Fill in the list; false after reporting. */
static bool parse_list(const input *in, terms *list)
{
  zs_arena *arena = &in->reading->scene->arena;
  const char *text = in->written->value;
  size_t length = in->written->length, at = skip_space(text, 0, length);
  list->numbers = ZS_ARENA_NEW(arena, double, count_words(text, length));
  if (!list->numbers)
    return zs_fail_memory(in->reading->diag);
  const term **tail = &list->expressions;
  while (at < length) {
    if (text[at] == '{') {
      term *t = ZS_ARENA_NEW(arena, term, 1);
      if (!t)
        return zs_fail_memory(in->reading->diag);
      at = parse_braces(in, at, t);
      t->index = list->count;
      *tail = t;
      tail = &t->next;
    } else {
      at = parse_plain(in, at, list->count, &list->numbers[list->count]);
    }
    if (at == 0)
      return false;
    list->count++;
    at = skip_space(text, at, length);
    if (at < length && text[at] == ',') {
      at = skip_space(text, at + 1, length);
      if (at == length)
        return fail_value(in, ZS_ERROR_SYNTAX, NULL, "ends with ','");
    }
  }
  return true;
}

/* The list that a value is, parsed once. */
static const terms *terms_of(const input *in)
{
  if (!in->written->parsed) {
    terms *list = ZS_ARENA_NEW(&in->reading->scene->arena, terms, 1);
    if (!list) {
      zs_fail_memory(in->reading->diag);
      return NULL;
    }
    list->malformed = !parse_list(in, list);
    in->written->parsed = list;
  }
  const terms *list = in->written->parsed;
  if (!list->malformed)
    return list;
  in->reading->unknown = true; /* the error has been reported */
  return NULL;
}

/* ---- Names in expressions ---------------------------------------------- */

/* Look a name up: the innermost scope first, then the parameters. */
static bool find_name(const zs_reading *reading, const char *name, double *value, bool *known)
{
  for (const zs_scope *scope = reading->scope; scope; scope = scope->outer) {
    if (strcmp(scope->name, name) == 0) {
      *value = scope->value;
      *known = scope->known;
      return true;
    }
  }
  const zs_scene *scene = reading->scene;
  const zs_name *entry = zs_names_find(&scene->parameter_names, name, strlen(name));
  if (!entry || entry->value >= scene->visible_parameters)
    return false;
  *value = scene->parameters.items[entry->value].at.value;
  *known = scene->parameters.items[entry->value].known;
  return true;
}

/* A name near a misspelt one, or NULL. */
static const char *suggest_name(const zs_reading *reading, const char *word, bool coordinates)
{
  static const char *const axes[] = {"x", "y", "z"};
  const zs_scene *scene = reading->scene;
  size_t count = 0, scopes = 0;
  for (const zs_scope *scope = reading->scope; scope; scope = scope->outer)
    scopes++;
  const char **names = malloc((scene->visible_parameters + scopes + 3) * sizeof *names);
  if (!names)
    return NULL;
  for (const zs_scope *scope = reading->scope; scope; scope = scope->outer)
    names[count++] = scope->name;
  for (size_t i = 0; i < scene->visible_parameters; i++)
    names[count++] = scene->parameters.items[i].at.name;
  for (size_t i = 0; coordinates && i < 3; i++)
    names[count++] = axes[i];
  const char *near = zs_suggest(word, names, count);
  free(names);
  return near;
}

static bool fail_name(const zs_reading *reading, const zs_place *place, const char *name,
                      bool coordinates)
{
  char hint[128];
  /* Any letter is near another one. */
  const char *near = name[1] ? suggest_name(reading, name, coordinates) : NULL;
  if (near)
    snprintf(hint, sizeof hint, "did you mean '%s'?", near);
  bool later = zs_names_find(&reading->scene->parameter_names, name, strlen(name));
  return zs_report(reading->diag, ZS_ERROR, ZS_ERROR_SCHEMA, place, near ? hint : NULL,
                   later         ? "parameter '%s' is not known yet; it is defined further below"
                   : coordinates ? "'%s' is neither a coordinate nor a parameter"
                                 : "'%s' is not a parameter",
                   name);
}

/* Values of an expression's variables; false after reporting an unknown one. */
static bool find_variables(const input *in, const term *t, double *values)
{
  bool good = true;
  for (uint32_t i = 0; i < t->expression->variable_count; i++) {
    const char *name = t->expression->variables[i];
    bool known = true;
    if (!find_name(in->reading, name, &values[i], &known)) {
      zs_place place = zs_attribute_place(in->element, in->written,
                                          t->offset + t->expression->variable_offsets[i]);
      good = fail_name(in->reading, &place, name, false);
    } else if (!known) {
      in->reading->unknown = true;
    }
  }
  return good;
}

/* Whether a division by zero is among the operations. */
static bool divides_by_zero(const zs_expression *expression, const double *scratch)
{
  for (uint32_t i = 0; i < expression->count; i++) {
    const zs_expression_node *node = &expression->nodes[i];
    if ((node->function == ZS_FUNCTION_DIVIDE || node->function == ZS_FUNCTION_MODULO) &&
        scratch[node->operand[1]] == 0)
      return true;
  }
  return false;
}

/* The value of one expression. */
static bool evaluate(const input *in, const term *t, double *number)
{
  const zs_expression *e = t->expression;
  double *scratch = malloc(((size_t)e->count + e->variable_count) * sizeof *scratch);
  if (!scratch)
    return zs_fail_memory(in->reading->diag);
  bool good = find_variables(in, t, scratch + e->count);
  if (good) {
    *number = zs_expression_value(e, scratch + e->count, scratch);
    if (!isfinite(*number) && !in->reading->unknown) {
      bool zero = divides_by_zero(e, scratch);
      const char *problem = isnan(*number)
                              ? zero ? "is NaN (division by zero)" : "is NaN"
                              : zero ? "is infinite (division by zero)" : "is infinite";
      good = fail(in, t->offset - 1, ZS_ERROR_GEOMETRY, NULL, t->text, t->length, problem);
    }
  }
  free(scratch);
  return good;
}

/* The numbers of a value, for as long as the result arena lives where a list is
 * kept; NULL after reporting. */
static const double *numbers_of(const input *in, size_t *count)
{
  const terms *list = terms_of(in);
  if (!list)
    return NULL;
  *count = list->count;
  if (!list->expressions && in->row->type != ZS_NUMBERS)
    return list->numbers;
  double *numbers = ZS_ARENA_NEW(in->reading->arena, double, list->count);
  if (!numbers) {
    zs_fail_memory(in->reading->diag);
    return NULL;
  }
  if (list->count)
    memcpy(numbers, list->numbers, list->count * sizeof *numbers);
  bool good = true;
  for (const term *t = list->expressions; t; t = t->next)
    good = evaluate(in, t, &numbers[t->index]) && good;
  return good ? numbers : NULL;
}

/* ---- Types ------------------------------------------------------------- */

/* What is wrong with one number, or with one of several. */
static const char *range_problem(const zs_attribute *row, double number, bool several)
{
  const char *negative = several ? "has a negative number" : "is negative";
  const char *zero = several ? "has a zero" : "is zero";
  switch (row->range) {
  case ZS_RANGE_ANY: return NULL;
  case ZS_RANGE_POSITIVE: return number > 0 ? NULL : number < 0 ? negative : zero;
  case ZS_RANGE_NOT_NEGATIVE: return number >= 0 ? NULL : negative;
  case ZS_RANGE_NOT_ZERO: return number != 0 ? NULL : zero;
  case ZS_RANGE_BETWEEN:
    if (number < row->minimum)
      return several ? "has a number that is too small" : "is too small";
    if (number > row->maximum)
      return several ? "has a number that is too large" : "is too large";
  }
  return NULL;
}

/* The expression that gives number `i` of a list, or NULL. */
static const term *expression_at(const terms *list, size_t i)
{
  const term *t = list->expressions;
  while (t && t->index != i)
    t = t->next;
  return t;
}

/* Report a problem of number `i`, with its value where an expression gave it. */
static bool fail_number(const input *in, const double *numbers, size_t i, const char *problem)
{
  const term *t = expression_at(in->written->parsed, i);
  if (!t)
    return fail_value(in, ZS_ERROR_SCHEMA, NULL, problem);
  char number[ZS_NUMBER_SIZE], text[ZS_NUMBER_SIZE + 32];
  snprintf(text, sizeof text, "= %s %s", zs_number_format(number, numbers[i]), problem);
  return fail(in, t->offset - 1, ZS_ERROR_SCHEMA, NULL, t->text, t->length, text);
}

static bool check_ranges(const input *in, const double *numbers, size_t count)
{
  const term *next = ((const terms *)in->written->parsed)->expressions;
  for (size_t i = 0; i < count; i++) {
    bool expression = next && next->index == i, several = count > 1 && !expression;
    next = expression ? next->next : next;
    const char *problem = range_problem(in->row, numbers[i], several);
    if (!problem && in->row->type == ZS_INTEGER &&
        (numbers[i] != floor(numbers[i]) || fabs(numbers[i]) > INT_MAX))
      problem = "is not a whole number";
    if (problem)
      return fail_number(in, numbers, i, problem);
  }
  return true;
}

static bool check_count(const input *in, size_t count)
{
  size_t wanted = in->row->type == ZS_VECTOR2                                       ? 2
                  : in->row->type == ZS_VECTOR3 || (in->row->type == ZS_SCALE && count != 1) ? 3
                                                                                              : 1;
  if (count == wanted || in->row->type == ZS_NUMBERS)
    return true;
  char problem[48];
  snprintf(problem, sizeof problem, count == 1 ? "is one number" : "has %zu numbers", count);
  if (count == 0)
    snprintf(problem, sizeof problem, "is empty");
  const char *hint = count > 1 && memchr(in->written->value, ',', in->written->length)
                       ? "decimals are written with a point"
                       : NULL;
  return fail_value(in, ZS_ERROR_SYNTAX, hint, problem);
}

/* A value without the space around it. */
static const char *trimmed(const zs_xml_attribute *attribute, size_t *length)
{
  size_t at = skip_space(attribute->value, 0, attribute->length), end = attribute->length;
  while (end > at && is_space(attribute->value[end - 1]))
    end--;
  *length = end - at;
  return attribute->value + at;
}

/* The index of the choice that is written, or -1. */
static int find_choice(const input *in)
{
  size_t length;
  const char *text = trimmed(in->written, &length);
  for (int i = 0; in->row->choices[i]; i++)
    if (strlen(in->row->choices[i]) == length && memcmp(in->row->choices[i], text, length) == 0)
      return i;
  return -1;
}

static bool read_numbers(const input *in, void *field)
{
  const int word = in->row->type == ZS_NUMBER && in->row->choices ? find_choice(in) : -1;
  if (word >= 0) {
    *(double *)field = word == 0 ? NAN : INFINITY;
    return true;
  }
  size_t count = 0;
  const double *numbers = numbers_of(in, &count);
  if (!numbers || !check_count(in, count))
    return false;
  /* In a definition's body nothing is known of numbers that depend on its
   * arguments; the default stands for them. */
  if (in->reading->unknown)
    return true;
  if (!check_ranges(in, numbers, count))
    return false;
  switch (in->row->type) {
  case ZS_INTEGER: *(int *)field = (int)numbers[0]; break;
  case ZS_NUMBERS: *(zs_numbers *)field = (zs_numbers){numbers, count}; break;
  case ZS_SCALE:
    for (size_t i = 0; i < 3; i++)
      ((double *)field)[i] = numbers[count == 1 ? 0 : i];
    break;
  default: memcpy(field, numbers, count * sizeof(double));
  }
  return true;
}

static bool read_choice(const input *in, int *field)
{
  int choice = find_choice(in);
  if (choice >= 0) {
    *field = choice;
    return true;
  }
  size_t count = 0;
  while (in->row->choices[count])
    count++;
  char hint[128];
  const char *near = zs_suggest(in->written->value, in->row->choices, count);
  if (near)
    snprintf(hint, sizeof hint, "did you mean '%s'?", near);
  return fail_value(in, ZS_ERROR_SCHEMA, near ? hint : NULL, "is not one of the choices");
}

static bool read_boolean(const input *in, bool *field)
{
  size_t length;
  const char *text = trimmed(in->written, &length);
  bool yes = length == 4 && memcmp(text, "true", 4) == 0;
  bool no = length == 5 && memcmp(text, "false", 5) == 0;
  *field = yes;
  return yes || no || fail_value(in, ZS_ERROR_SCHEMA, NULL, "is neither");
}

static bool read_text(const input *in, const char **field)
{
  *field = zs_arena_string(in->reading->arena, in->written->value, in->written->length);
  return *field || zs_fail_memory(in->reading->diag);
}

static bool read_file(const input *in, const char **field)
{
  zs_place place = zs_attribute_place(in->element, in->written, 0);
  const zs_file *file = zs_file_of(in->element);
  *field = zs_path_resolve(in->reading->scene, file->folder, in->written->value,
                           in->reading->arena, &place, in->reading->diag);
  return *field;
}

static bool read_files(const input *in, zs_files *field)
{
  zs_place place = zs_attribute_place(in->element, in->written, 0);
  const zs_file *file = zs_file_of(in->element);
  return zs_paths_find(in->reading->scene, file->folder, in->written->value, in->reading->arena,
                       field, &place, in->reading->diag);
}

/* ---- Formulas ---------------------------------------------------------- */

/* A formula as it is written: an attribute, or the text when `written` is
 * NULL. */
static zs_place formula_place(const input *in, size_t at)
{
  return in->written ? zs_attribute_place(in->element, in->written, at)
                     : zs_text_place(in->element, at);
}

/* Parse a formula once; NULL after reporting. */
static const zs_expression *expression_of(const input *in, const char *text, size_t length,
                                          const void **parsed)
{
  if (!*parsed) {
    zs_expression_error error;
    *parsed = zs_expression_parse(&in->reading->scene->arena, text, length, &error);
    if (!*parsed) {
      zs_place place = formula_place(in, error.offset);
      fail_expression(in, &place,
                      memchr(text, '{', length) ? "names need no braces in formulas" : NULL,
                      &error);
    }
  }
  return *parsed;
}

/* x, y, z and, in a formula called `value`, f; otherwise a number by name. */
static int axis_of(const zs_attribute *row, const char *name)
{
  if (!name[0] || name[1])
    return -1;
  if (name[0] >= 'x' && name[0] <= 'z')
    return name[0] - 'x';
  return name[0] == 'f' && strcmp(row->name, "value") == 0 ? 3 : -1;
}

static bool bind_formula(const input *in, const zs_expression *expression, zs_formula *formula)
{
  zs_reading *reading = in->reading;
  uint32_t count = expression->variable_count;
  int *axis = ZS_ARENA_NEW(reading->arena, int, count);
  double *number = ZS_ARENA_NEW(reading->arena, double, count);
  if (!axis || !number)
    return zs_fail_memory(reading->diag);
  bool good = true;
  for (uint32_t i = 0; i < count; i++) {
    const char *name = expression->variables[i];
    bool known = true;
    axis[i] = axis_of(in->row, name);
    if (axis[i] >= 0)
      continue;
    if (!find_name(reading, name, &number[i], &known)) {
      zs_place place = formula_place(in, expression->variable_offsets[i]);
      good = fail_name(reading, &place, name, true);
    }
    reading->unknown = reading->unknown || !known;
  }
  *formula = (zs_formula){expression, axis, number};
  return good;
}

static bool read_formula(const input *in, zs_formula *field)
{
  zs_xml_attribute *a = in->written;
  const zs_expression *expression = expression_of(in, a->value, a->length, &a->parsed);
  return expression && bind_formula(in, expression, field);
}

static bool read_text_formula(const input *in, zs_formula *field)
{
  /* What has been parsed is remembered by an element that does not change else. */
  zs_element *e = (zs_element *)in->element;
  const zs_expression *expression = expression_of(in, e->text, e->text_length, &e->parsed);
  return expression && bind_formula(in, expression, field);
}

static bool read_value(const input *in, void *field)
{
  switch (in->row->type) {
  case ZS_NUMBER:
  case ZS_INTEGER:
  case ZS_VECTOR2:
  case ZS_VECTOR3:
  case ZS_SCALE:
  case ZS_NUMBERS: return read_numbers(in, field);
  case ZS_CHOICE: return read_choice(in, field);
  case ZS_BOOLEAN: return read_boolean(in, field);
  case ZS_TEXT: return read_text(in, field);
  case ZS_FILE: return read_file(in, field);
  case ZS_FILES: return read_files(in, field);
  case ZS_FORMULA: return read_formula(in, field);
  }
  return false;
}

/* ---- Defaults ---------------------------------------------------------- */

static void fill(double *numbers, size_t count, double number)
{
  for (size_t i = 0; i < count; i++)
    numbers[i] = number;
}

/* What an absent attribute without a default leaves: no number. */
static void set_absent(const zs_attribute *row, void *field)
{
  switch (row->type) {
  case ZS_NUMBER: fill(field, 1, NAN); break;
  case ZS_VECTOR2: fill(field, 2, NAN); break;
  case ZS_VECTOR3:
  case ZS_SCALE: fill(field, 3, NAN); break;
  case ZS_TEXT: *(const char **)field = ""; break;
  default: break;
  }
}

/* Fill in the defaults of a table. */
static bool set_defaults(zs_reading *reading, const char *name, const zs_attribute *rows,
                         size_t count, void *parameters)
{
  zs_element element = {.name = name};
  zs_reading defaults = {.scene = reading->scene, .arena = &reading->scene->arena,
                         .diag = reading->diag};
  bool good = true;
  for (size_t i = 0; i < count; i++) {
    void *field = (char *)parameters + rows[i].offset;
    set_absent(&rows[i], field);
    if (!rows[i].initial || !*rows[i].initial)
      continue;
    zs_xml_attribute written = {.name = rows[i].name, .value = rows[i].initial,
                                .length = strlen(rows[i].initial)};
    input in = {&defaults, &rows[i], &element, &written};
    good = read_value(&in, field) && good;
  }
  return good;
}

/* A kind's parameters by default, made when they are first needed. */
static const void *defaults_of(zs_reading *reading, const zs_kind *kind)
{
  zs_scene *scene = reading->scene;
  for (size_t i = 0; i < scene->defaults.count; i++)
    if (scene->defaults.items[i].kind == kind)
      return scene->defaults.items[i].parameters;
  zs_defaults *entry = ZS_LIST_ADD(scene->defaults, scene, reading->diag);
  if (!entry)
    return NULL;
  void *parameters = zs_arena_alloc(&scene->arena, 1, kind->parameters_size);
  if (!parameters) {
    scene->defaults.count--;
    zs_fail_memory(reading->diag);
    return NULL;
  }
  set_defaults(reading, kind->name, kind->attributes, kind->attribute_count, parameters);
  *entry = (zs_defaults){kind, parameters};
  return parameters;
}

/* ---- Elements ---------------------------------------------------------- */

size_t zs_kind_attribute(const zs_kind *kind, const char *name)
{
  for (size_t i = 0; i < kind->attribute_count; i++)
    if (strcmp(kind->attributes[i].name, name) == 0)
      return i;
  return SIZE_MAX;
}

static size_t placement_attribute(const char *name)
{
  for (size_t i = 0; i < ZS_PLACEMENT_ATTRIBUTES; i++)
    if (strcmp(zs_placement_attributes[i].name, name) == 0)
      return i;
  return SIZE_MAX;
}

/* The text of an element is not an attribute, though its row is in the table. */
static bool is_text_row(const zs_kind *kind, size_t i)
{
  return kind->text && kind->attributes[i].type == ZS_FORMULA &&
         strcmp(kind->attributes[i].name, "formula") == 0;
}

static void fail_unknown_attribute(zs_reading *reading, const zs_element *element,
                                   const zs_xml_attribute *attribute, zs_attribute_rule rule)
{
  enum { MOST = 96 };
  const char *names[MOST];
  size_t count = 0;
  for (size_t i = 0; i < rule.kind->attribute_count && count < MOST; i++)
    if (!is_text_row(rule.kind, i))
      names[count++] = rule.kind->attributes[i].name;
  for (size_t i = 0; rule.placed && i < ZS_PLACEMENT_ATTRIBUTES && count < MOST; i++)
    names[count++] = zs_placement_attributes[i].name;
  char hint[128];
  const char *near = zs_suggest(attribute->name, names, count);
  if (near)
    snprintf(hint, sizeof hint, "did you mean '%s'?", near);
  zs_place place = zs_attribute_name_place(element, attribute);
  zs_report(reading->diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, near ? hint : NULL,
            "unknown attribute");
}

/* Read what is written in the tag. */
static void read_written(zs_reading *reading, const zs_element *element, zs_attribute_rule rule,
                         void *parameters, uint64_t *given, struct zs_placement *placement,
                         unsigned *placed)
{
  const zs_kind *kind = rule.kind;
  for (size_t i = 0; i < element->attribute_count; i++) {
    zs_xml_attribute *written = &element->attributes[i];
    size_t own = zs_kind_attribute(kind, written->name);
    size_t common = rule.placed ? placement_attribute(written->name) : SIZE_MAX;
    bool unknown = reading->unknown;
    reading->unknown = false; /* of this attribute */
    if (own != SIZE_MAX && !is_text_row(kind, own)) {
      *given |= (uint64_t)1 << own;
      input in = {reading, &kind->attributes[own], element, written};
      read_value(&in, (char *)parameters + kind->attributes[own].offset);
    } else if (common != SIZE_MAX) {
      *placed |= 1u << common;
      input in = {reading, &zs_placement_attributes[common], element, written};
      read_value(&in, (char *)placement + zs_placement_attributes[common].offset);
    } else if (!rule.open) {
      fail_unknown_attribute(reading, element, written, rule);
    }
    reading->unknown = reading->unknown || unknown;
  }
}

/* Read the text, and report what is missing. */
static void read_rest(zs_reading *reading, const zs_element *element, const zs_kind *kind,
                      void *parameters, uint64_t *given)
{
  zs_place place = zs_element_place(element);
  if (element->text && !kind->text) {
    zs_place there = zs_text_place(element, skip_space(element->text, 0, element->text_length));
    zs_report(reading->diag, ZS_ERROR, ZS_ERROR_SCHEMA, &there, NULL,
              "text is not allowed in this element");
  }
  for (size_t i = 0; i < kind->attribute_count; i++) {
    const zs_attribute *row = &kind->attributes[i];
    if (is_text_row(kind, i)) {
      input in = {reading, row, element, NULL};
      if (element->text) {
        *given |= (uint64_t)1 << i;
        read_text_formula(&in, (zs_formula *)((char *)parameters + row->offset));
      } else if (!row->initial) {
        zs_report(reading->diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL,
                  "no text; expected a formula");
      }
    } else if (!row->initial && !(*given >> i & 1)) {
      char expected[DESCRIPTION_SIZE];
      place.attribute = row->name;
      zs_report(reading->diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL, "missing; expected %s",
                describe(row, expected));
      place.attribute = NULL;
    }
  }
}

void *zs_attributes_read(zs_reading *reading, const zs_element *element, zs_attribute_rule rule,
                         uint64_t *given, struct zs_placement *placement, unsigned *placed)
{
  const zs_kind *kind = rule.kind;
  const void *defaults = defaults_of(reading, kind);
  void *parameters = zs_arena_alloc(reading->arena, 1, kind->parameters_size);
  if (!defaults || !parameters) {
    if (defaults)
      zs_fail_memory(reading->diag);
    return NULL;
  }
  if (kind->parameters_size)
    memcpy(parameters, defaults, kind->parameters_size);
  uint64_t written = 0;
  unsigned moved = 0;
  if (placement)
    *placement = (struct zs_placement){.scale = {1, 1, 1}};
  rule.placed = rule.placed && placement;
  read_written(reading, element, rule, parameters, &written, placement, &moved);
  read_rest(reading, element, kind, parameters, &written);
  if (given)
    *given = written;
  if (placed)
    *placed = moved;
  return parameters;
}

bool zs_fail_reference(const zs_place *place, const char *what, const char *word,
                       const zs_names *names, zs_diag *diag)
{
  const char **list = malloc((names->count + (size_t)1) * sizeof *list);
  size_t count = 0;
  for (uint32_t i = 0; list && i < names->capacity; i++)
    if (names->slots[i].text)
      list[count++] = names->slots[i].text;
  const char *near = list ? zs_suggest(word, list, count) : NULL;
  char hint[128];
  if (near)
    snprintf(hint, sizeof hint, "did you mean '%s'?", near);
  free(list);
  return zs_report(diag, ZS_ERROR, place ? ZS_ERROR_SCHEMA : ZS_ERROR_ARGUMENT, place,
                   near ? hint : NULL, "there is no %s '%s'", what, word);
}

bool zs_number_read(zs_reading *reading, const zs_element *element, zs_xml_attribute *attribute,
                    double *value)
{
  static const zs_attribute any_number = {.name = "value", .type = ZS_NUMBER, .unit = "1"};
  input in = {reading, &any_number, element, attribute};
  return read_value(&in, value);
}

bool zs_identifier_check(const zs_element *element, const zs_xml_attribute *attribute,
                         zs_diag *diag)
{
  zs_place place = zs_attribute_place(element, attribute, 0);
  const char *name = attribute->value;
  size_t length = strspn(name, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_0123456789");
  char shown[SHOWN + 8];
  if (!length || name[length] || (name[0] >= '0' && name[0] <= '9'))
    return zs_report(diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL,
                     "'%s' is not a name; expected letters, digits and '_'",
                     shorten(name, attribute->length, shown));
  bool taken = strcmp(name, "pi") == 0 || strcmp(name, "let") == 0;
  for (size_t i = 0; i < zs_expression_function_count; i++)
    taken = taken || strcmp(name, zs_expression_function_names[i]) == 0;
  return !taken || zs_report(diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL,
                             "'%s' has a meaning in expressions; expected another name", name);
}
