#include "language/grammar.h"

#include "scene/document.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { LONGEST_PATH = 128 };

/* ---- Lines --------------------------------------------------------------- */

void zs_grammar_indent(zs_grammar *grammar)
{
  for (int i = 0; i < grammar->depth; i++)
    zs_text_add(&grammar->text, "  ");
}

void zs_grammar_line(zs_grammar *grammar, const char *format, ...)
{
  char line[1024];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(line, sizeof line, format, arguments);
  va_end(arguments);
  zs_grammar_indent(grammar);
  zs_text_add(&grammar->text, line);
  zs_text_add(&grammar->text, "\n");
}

void zs_grammar_open(zs_grammar *grammar, const char *tag)
{
  zs_grammar_line(grammar, "%s", tag);
  grammar->depth++;
}

void zs_grammar_close(zs_grammar *grammar, const char *tag)
{
  grammar->depth--;
  zs_grammar_line(grammar, "%s", tag);
}

/* ---- Elements ------------------------------------------------------------ */

bool zs_grammar_placed(const zs_kind *kind)
{
  return kind->family != ZS_FAMILY_PART || kind == &zs_document_use ||
         kind == &zs_document_instance;
}

bool zs_grammar_open_attributes(const zs_kind *kind)
{
  return kind == &zs_document_instance;
}

bool zs_grammar_is_written(const zs_kind *kind, const zs_attribute *attribute)
{
  return !(kind->text && strcmp(attribute->name, "formula") == 0);
}

static bool takes_nodes(const zs_kind *kind)
{
  return kind->children != ZS_CHILDREN_NONE;
}

/* A repeat stands for what it repeats, so inside an element with parts it may
 * hold those too.  What a scene and a define have beside nodes is no part of a
 * solid and cannot be repeated. */
static bool repeats_parts(const zs_kind *kind)
{
  return kind->parts && kind != &zs_document_scene && kind != &zs_document_define;
}

static void repeat_path(char out[LONGEST_PATH], const char *path, const zs_kind *kind)
{
  bool own = repeats_parts(kind);
  snprintf(out, LONGEST_PATH, "%s%srepeat", own ? path : "", own ? "." : "");
}

static void put_repeat(zs_grammar *grammar, const char *path, const zs_kind *kind)
{
  char repeat[LONGEST_PATH];
  repeat_path(repeat, path, kind);
  grammar->syntax->element(grammar, repeat, "repeat");
}

static void put_parts(zs_grammar *grammar, const char *path, const zs_kind *kind)
{
  for (const zs_kind *const *part = kind->parts; part && *part; part++) {
    char name[LONGEST_PATH];
    snprintf(name, sizeof name, "%s.%s", path, (*part)->name);
    grammar->syntax->element(grammar, name, (*part)->name);
  }
}

/* Any number of parts and foreign elements; with nodes and repeats, or without. */
static void put_many(zs_grammar *grammar, const char *path, const zs_kind *kind, bool nodes)
{
  zs_grammar_open(grammar, grammar->syntax->many_open);
  if (nodes && takes_nodes(kind))
    zs_grammar_line(grammar, "%s", grammar->syntax->any_node);
  if (nodes)
    put_repeat(grammar, path, kind);
  put_parts(grammar, path, kind);
  zs_grammar_line(grammar, "%s", grammar->syntax->foreign);
  zs_grammar_close(grammar, grammar->syntax->many_close);
}

static void put_one(zs_grammar *grammar, const char *path, const zs_kind *kind)
{
  zs_grammar_open(grammar, grammar->syntax->choice_open);
  zs_grammar_line(grammar, "%s", grammar->syntax->any_node);
  put_repeat(grammar, path, kind);
  zs_grammar_close(grammar, grammar->syntax->choice_close);
}

/* Two nodes, or a repeat that may stand for as many. */
static void put_two(zs_grammar *grammar, const char *path, const zs_kind *kind)
{
  zs_grammar_open(grammar, grammar->syntax->choice_open);
  zs_grammar_open(grammar, grammar->syntax->sequence_open);
  zs_grammar_line(grammar, "%s", grammar->syntax->any_node);
  put_many(grammar, path, kind, false);
  put_one(grammar, path, kind);
  zs_grammar_close(grammar, grammar->syntax->sequence_close);
  put_repeat(grammar, path, kind);
  zs_grammar_close(grammar, grammar->syntax->choice_close);
}

void zs_grammar_content(zs_grammar *grammar, const char *path, const zs_kind *kind)
{
  if (kind == &zs_document_scene) {
    put_many(grammar, path, kind, true);
    return;
  }
  if (!takes_nodes(kind)) {
    put_many(grammar, path, kind, kind->parts != NULL);
    return;
  }
  zs_grammar_open(grammar, grammar->syntax->sequence_open);
  put_many(grammar, path, kind, false);
  if (kind->children == ZS_CHILDREN_TWO)
    put_two(grammar, path, kind);
  else
    put_one(grammar, path, kind);
  put_many(grammar, path, kind, true);
  zs_grammar_close(grammar, grammar->syntax->sequence_close);
}

/* An element, its parts, and the repeat of its content. */
static void define(zs_grammar *grammar, const char *path, const zs_kind *kind)
{
  grammar->syntax->define(grammar, path, path, kind);
  for (const zs_kind *const *part = kind->parts; part && *part; part++) {
    char name[LONGEST_PATH];
    snprintf(name, sizeof name, "%s.%s", path, (*part)->name);
    define(grammar, name, *part);
  }
  if (!repeats_parts(kind))
    return;
  zs_kind repeat = zs_document_repeat;
  repeat.children = takes_nodes(kind) ? ZS_CHILDREN_ONE : ZS_CHILDREN_NONE;
  repeat.parts = kind->parts;
  char name[LONGEST_PATH];
  repeat_path(name, path, kind);
  grammar->syntax->define(grammar, name, path, &repeat);
}

void zs_grammar_define_all(zs_grammar *grammar)
{
  define(grammar, "scene", &zs_document_scene);
  for (const zs_kind *const *kind = zs_document_kinds; *kind; kind++)
    if (zs_document_kind_is_node(*kind))
      define(grammar, (*kind)->name, *kind);
  for (const zs_kind *const *kind = zs_kinds; *kind; kind++)
    define(grammar, (*kind)->name, *kind);
}

void zs_grammar_nodes(zs_grammar *grammar)
{
  grammar->syntax->element(grammar, "use", "use");
  grammar->syntax->element(grammar, "instance", "instance");
  for (const zs_kind *const *kind = zs_kinds; *kind; kind++)
    grammar->syntax->element(grammar, (*kind)->name, (*kind)->name);
}

/* ---- Values -------------------------------------------------------------- */

#define EXPONENT "([eE][+\\-]?[0-9]+)?"
#define EXPRESSION "\\{[^{}]+\\}"
#define DECIMAL "[+\\-]?([0-9]+(\\.[0-9]*)?|\\.[0-9]+)" EXPONENT
#define NUMBER "(" DECIMAL "|" EXPRESSION ")"
#define SOMETHING "([0-9]*[1-9][0-9]*(\\.[0-9]*)?|[0-9]*\\.[0-9]*[1-9][0-9]*)" EXPONENT
#define NOTHING "(0+(\\.0*)?|\\.0+)" EXPONENT
#define POSITIVE "(\\+?" SOMETHING "|" EXPRESSION ")"
#define NOT_NEGATIVE "(\\+?([0-9]+(\\.[0-9]*)?|\\.[0-9]+)" EXPONENT "|-" NOTHING "|" EXPRESSION ")"
#define NOT_ZERO "([+\\-]?" SOMETHING "|" EXPRESSION ")"
#define WHOLE "(\\.0*)?" /* "2.0" is a whole number too */
#define INTEGER "([+\\-]?[0-9]+" WHOLE "|" EXPRESSION ")"
#define POSITIVE_INTEGER "(\\+?[0-9]*[1-9][0-9]*" WHOLE "|" EXPRESSION ")"
#define NOT_NEGATIVE_INTEGER "(\\+?[0-9]+" WHOLE "|-0+" WHOLE "|" EXPRESSION ")"
#define NOT_ZERO_INTEGER "([+\\-]?[0-9]*[1-9][0-9]*" WHOLE "|" EXPRESSION ")"
#define COMMA "( ?, ?| )"
#define TWO(item) item COMMA item
#define THREE(item) item COMMA item COMMA item
#define SCALE(item) item "(" COMMA item COMMA item ")?"

/* Rows of one type stand in the order of zs_range, without BETWEEN. */
const zs_grammar_type zs_grammar_types[] = {
  {"type.number", NUMBER},
  {"type.number.positive", POSITIVE},
  {"type.number.not-negative", NOT_NEGATIVE},
  {"type.number.not-zero", NOT_ZERO},
  {"type.integer", INTEGER},
  {"type.integer.positive", POSITIVE_INTEGER},
  {"type.integer.not-negative", NOT_NEGATIVE_INTEGER},
  {"type.integer.not-zero", NOT_ZERO_INTEGER},
  {"type.vector2", TWO(NUMBER)},
  {"type.vector2.positive", TWO(POSITIVE)},
  {"type.vector2.not-negative", TWO(NOT_NEGATIVE)},
  {"type.vector2.not-zero", TWO(NOT_ZERO)},
  {"type.vector3", THREE(NUMBER)},
  {"type.vector3.positive", THREE(POSITIVE)},
  {"type.vector3.not-negative", THREE(NOT_NEGATIVE)},
  {"type.vector3.not-zero", THREE(NOT_ZERO)},
  {"type.scale", SCALE(NUMBER)},
  {"type.scale.positive", SCALE(POSITIVE)},
  {"type.scale.not-negative", SCALE(NOT_NEGATIVE)},
  {"type.scale.not-zero", SCALE(NOT_ZERO)},
  {"type.numbers", "(" NUMBER "(" COMMA NUMBER ")*)?"},
  {"type.expression", EXPRESSION},
};
const size_t zs_grammar_type_count = ZS_COUNT_OF(zs_grammar_types);

/* Not every validator collapses the blanks before it looks at the pattern. */
const char zs_grammar_decimal[] = "\\s*" DECIMAL "\\s*";
const char zs_grammar_whole[] = "\\s*[+\\-]?[0-9]+" WHOLE "\\s*";

static const int first_row[] = {
  [ZS_NUMBER] = 0, [ZS_INTEGER] = 4, [ZS_VECTOR2] = 8, [ZS_VECTOR3] = 12, [ZS_SCALE] = 16};
enum { NUMBERS_ROW = 20 };

static bool is_vector(zs_attribute_type type)
{
  return type == ZS_VECTOR2 || type == ZS_VECTOR3 || type == ZS_SCALE;
}

const char *zs_grammar_type_name(const zs_attribute *attribute)
{
  zs_attribute_type type = attribute->type;
  if (type == ZS_NUMBERS)
    return zs_grammar_types[NUMBERS_ROW].name;
  if (!is_vector(type) && type != ZS_NUMBER && type != ZS_INTEGER)
    return NULL;
  if (attribute->range != ZS_RANGE_BETWEEN)
    return zs_grammar_types[first_row[type] + (int)attribute->range].name;
  return is_vector(type) ? zs_grammar_types[first_row[type]].name : NULL;
}

void zs_grammar_limit(zs_grammar *grammar, const char *before, double limit, const char *after)
{
  if (isinf(limit))
    return;
  zs_grammar_indent(grammar);
  zs_text_add(&grammar->text, before);
  zs_text_add_number(&grammar->text, limit);
  zs_text_format(&grammar->text, "%s\n", after);
}

bool zs_grammar_may_be_empty(const zs_attribute *attribute)
{
  return attribute->type == ZS_TEXT && attribute->initial;
}

void zs_grammar_describe(zs_text *text, const zs_attribute *attribute)
{
  zs_text_add_xml(text, attribute->doc);
  if (*attribute->unit && strcmp(attribute->unit, "1") != 0)
    zs_text_format(text, " (%s)", attribute->unit);
  if (attribute->initial && *attribute->initial) {
    zs_text_add(text, "; default: ");
    zs_text_add_xml(text, attribute->initial);
  }
}
