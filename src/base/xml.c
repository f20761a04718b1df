/* The only file that knows libxml2, which checks that the document is well
 * formed and resolves namespaces.  Places come from the source text itself:
 * libxml2's line numbers are sixteen bits wide and it has none for values.
 *
 * Nothing is ever fetched or expanded.  A document type declaration, where
 * entities would be declared, is an error before it is read, unless the language
 * lets it name a document type and nothing more. */
#include "base/xml.h"

#include "base/names.h"

#include <libxml/parser.h>
#include <libxml/parserInternals.h>
#include <libxml/xmlerror.h>
#include <limits.h>
#include <string.h>

/* A place in the source that moves forward with the parser. */
typedef struct cursor {
  size_t offset;
  uint32_t line, column;
} cursor;

typedef struct reader {
  xmlParserCtxtPtr context;
  const zs_source *source;
  const zs_xml_language *language;
  zs_arena *arena;
  zs_diag *diag;
  uint32_t maximum_depth, depth;
  uint32_t foreign; /* depth inside an element of another namespace, or 0 */
  cursor cursor;
  zs_names names; /* each name is stored once */
  zs_element *root, *open;
  bool stopped;   /* an error has been reported */
  bool exhausted; /* a part of libxml2 that knows no parser ran out of memory */
} reader;

const zs_xml_language zs_xml_scene = {.name_space = ZS_NAMESPACE, .root = "scene"};

static const char BYTE_ORDER_MARK[] = "\xEF\xBB\xBF";

static bool has_mark(const zs_source *source)
{
  return source->length >= 3 && memcmp(source->text, BYTE_ORDER_MARK, 3) == 0;
}

static cursor start_of(const zs_source *source)
{
  return (cursor){has_mark(source) ? 3 : 0, 1, 1};
}

/* Characters that begin among bytes of UTF-8: all bytes but those 10xxxxxx. */
static size_t count_characters(const char *text, size_t length)
{
  static const uint64_t low_bits = UINT64_C(0x0101010101010101);
  size_t count = length, i = 0;
  for (uint64_t word; i + sizeof word <= length; i += sizeof word) {
    memcpy(&word, text + i, sizeof word);
    word = (word >> 7) & ~(word >> 6) & low_bits;
    count -= (word * low_bits) >> 56; /* the sum of the eight bytes */
  }
  for (; i < length; i++)
    count -= ((unsigned char)text[i] & 0xC0) == 0x80;
  return count;
}

/* Move over bytes of UTF-8, counting lines and characters. */
static void step(cursor *c, const char *text, size_t length)
{
  const char *end = text + length, *newline;
  while (text < end && (newline = memchr(text, '\n', (size_t)(end - text))) != NULL) {
    c->line++;
    c->column = 1;
    text = newline + 1;
  }
  c->column += (uint32_t)count_characters(text, (size_t)(end - text));
  c->offset += length;
}

static void move(reader *r, size_t offset)
{
  if (offset > r->source->length)
    offset = r->source->length;
  if (offset < r->cursor.offset)
    r->cursor = start_of(r->source);
  if (offset > r->cursor.offset)
    step(&r->cursor, r->source->text + r->cursor.offset, offset - r->cursor.offset);
}

/* ---- Errors ------------------------------------------------------------ */

static void stop(reader *r)
{
  r->stopped = true;
  xmlStopParser(r->context);
}

static void stop_for_memory(reader *r)
{
  if (!r->stopped)
    zs_fail_memory(r->diag);
  stop(r);
}

/* Where the parser is, in bytes. */
static size_t position(const reader *r)
{
  const xmlParserInput *input = r->context->input;
  if (!input)
    return r->source->length;
  size_t offset = (size_t)input->consumed + (size_t)(input->cur - input->base);
  return offset < r->source->length ? offset : r->source->length;
}

static bool is_space(char c)
{
  return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

static bool is_blank(const char *text, size_t length)
{
  for (size_t i = 0; i < length; i++)
    if (!is_space(text[i]))
      return false;
  return true;
}

/* Offset of the last `c` before `offset`, or `offset`. */
static size_t last_before(const reader *r, size_t offset, char c)
{
  for (size_t i = offset; i > 0; i--)
    if (r->source->text[i - 1] == c)
      return i - 1;
  return offset;
}

/* What is behind the element's name in the start tag at `start`, which may end
 * without its '>'. */
static size_t behind_name(const char *text, size_t start, size_t end)
{
  size_t at = start + 1;
  while (at < end && !is_space(text[at]) && text[at] != '>' && text[at] != '/')
    at++;
  return at;
}

/* Offset of a text that libxml2 hands out, or SIZE_MAX when it is a copy. */
static size_t offset_of(const reader *r, const char *text)
{
  const xmlParserInput *input = r->context->input;
  const char *base = (const char *)input->base, *last = (const char *)input->end;
  return text >= base && text < last ? (size_t)input->consumed + (size_t)(text - base) : SIZE_MAX;
}

/* An attribute as it stands in a start tag. */
typedef struct written {
  size_t name, length, value;
  bool declaration; /* of a namespace */
} written;

/* The next attribute of a well-formed start tag at or behind `at`. */
static written next_written(const char *text, size_t at)
{
  written w;
  while (is_space(text[at]))
    at++;
  w.name = at;
  while (!is_space(text[at]) && text[at] != '=')
    at++;
  w.length = at - w.name;
  w.declaration = w.length >= 5 && memcmp(text + w.name, "xmlns", 5) == 0 &&
                  (w.length == 5 || text[w.name + 5] == ':');
  while (text[at] != '"' && text[at] != '\'')
    at++;
  w.value = at + 1;
  return w;
}

static size_t end_of_value(const char *text, size_t value)
{
  char quote = text[value - 1];
  while (text[value] != quote)
    value++;
  return value + 1;
}

/* Where an attribute stands for the second time in the tag that the parser has
 * read up to `end`; `end` when it cannot be found. */
static size_t second_attribute(const reader *r, size_t end, const char *name)
{
  const char *text = r->source->text;
  size_t length = strlen(name), found = 0;
  size_t at = behind_name(text, last_before(r, end, '<'), end);
  while (at < end && memchr(text + at, '=', end - at)) {
    written w = next_written(text, at);
    found += w.length == length && memcmp(text + w.name, name, length) == 0;
    if (found == 2)
      return w.name;
    at = end_of_value(text, w.value);
  }
  return end;
}

static void report_at(reader *r, size_t offset, const char *hint, const char *format,
                      const char *word)
{
  move(r, offset);
  zs_place place = {.source = r->source, .line = r->cursor.line, .column = r->cursor.column};
  zs_report(r->diag, ZS_ERROR, ZS_ERROR_SYNTAX, &place, hint, format, word);
}

/* What libxml2 says, in our style: lower case, no line end, no full stop. */
static void report_message(reader *r, size_t offset, const char *message)
{
  char text[256];
  size_t length = strlen(message);
  while (length > 0 && (is_space(message[length - 1]) || message[length - 1] == '.'))
    length--;
  if (length >= sizeof text)
    length = sizeof text - 1;
  memcpy(text, message, length);
  text[length] = '\0';
  if (text[0] >= 'A' && text[0] <= 'Z' && text[1] >= 'a' && text[1] <= 'z')
    text[0] = (char)(text[0] - 'A' + 'a');
  report_at(r, offset, NULL, "not well-formed XML: %s", text);
}

static void report_end(reader *r)
{
  move(r, r->source->length);
  zs_place place = {.source = r->source, .line = r->cursor.line, .column = r->cursor.column};
  if (r->open)
    zs_report(r->diag, ZS_ERROR, ZS_ERROR_SYNTAX, &place, NULL,
              "the file ends inside <%s>, opened in line %u", r->open->name, r->open->line);
  else
    zs_report(r->diag, ZS_ERROR, ZS_ERROR_SYNTAX, &place, NULL,
              "the file ends before its root element does");
}

static void report_mismatch(reader *r, size_t offset, const xmlError *error)
{
  move(r, last_before(r, offset, '<'));
  zs_place place = {.source = r->source, .line = r->cursor.line, .column = r->cursor.column};
  const char *closed = error->str2 ? error->str2 : "";
  if (r->open && !r->foreign)
    zs_report(r->diag, ZS_ERROR, ZS_ERROR_SYNTAX, &place, NULL,
              "</%s> does not close <%s>, opened in line %u", closed, r->open->name,
              r->open->line);
  else
    zs_report(r->diag, ZS_ERROR, ZS_ERROR_SYNTAX, &place, NULL, "</%s> closes nothing", closed);
}

static void report_libxml(reader *r, const xmlError *error)
{
  size_t offset = position(r);
  const char *word = error->str1 ? error->str1 : "";
  bool over = is_blank(r->source->text + offset, r->source->length - offset);
  if (over && error->code != XML_ERR_TAG_NAME_MISMATCH && error->code != XML_ERR_DOCUMENT_END) {
    report_end(r); /* whatever else was expected: the text is over */
    return;
  }
  switch (error->code) {
  case XML_ERR_TAG_NAME_MISMATCH: report_mismatch(r, offset, error); break;
  case XML_ERR_ATTRIBUTE_NOT_STARTED:
    report_at(r, offset, NULL, "expected a value in quotes%s", "");
    break;
  case XML_ERR_ATTRIBUTE_WITHOUT_VALUE:
    report_at(r, offset, NULL, "attribute '%s' has no value", word);
    break;
  case XML_ERR_ATTRIBUTE_REDEFINED:
    report_at(r, second_attribute(r, offset, word), NULL, "attribute '%s' is given twice", word);
    break;
  case XML_ERR_LT_IN_ATTRIBUTE:
    report_at(r, offset, "write &lt;", "'<' is not allowed inside a value%s", "");
    break;
  case XML_ERR_GT_REQUIRED: report_at(r, offset, NULL, "expected '>'%s", ""); break;
  case XML_ERR_SPACE_REQUIRED: report_at(r, offset, NULL, "expected a space%s", ""); break;
  case XML_ERR_DOCUMENT_END:
    report_at(r, offset, NULL, "text after the end of the root element%s", "");
    break;
  case XML_ERR_DOCUMENT_EMPTY:
    report_at(r, offset, NULL, "not an XML document: expected '<'%s", "");
    break;
  case XML_ERR_UNDECLARED_ENTITY:
  case XML_WAR_UNDECLARED_ENTITY:
    report_at(r, last_before(r, offset, '&'), "only &amp; &lt; &gt; &quot; and &apos; are",
              "entity '&%s;' is not known", word);
    break;
  case XML_NS_ERR_UNDEFINED_NAMESPACE:
    report_at(r, last_before(r, offset, '<'), NULL, "namespace prefix '%s' is not declared", word);
    break;
  default: report_message(r, offset, error->message ? error->message : "unknown error");
  }
}

#if LIBXML_VERSION >= 21200
typedef const xmlError *error_pointer;
#else
typedef xmlError *error_pointer;
#endif

static void on_error(void *data, error_pointer error)
{
  reader *r = ((xmlParserCtxtPtr)data)->_private;
  if (r->stopped || error->level == XML_ERR_WARNING)
    return;
  if (r->exhausted || error->code == XML_ERR_NO_MEMORY) {
    stop_for_memory(r);
    return;
  }
  /* Errors of a malformed document follow from the first. */
  r->stopped = true;
  report_libxml(r, error);
  xmlStopParser(r->context);
}

/* Errors of the parts that know no parser, such as that for URIs: out of memory, which
 * would else be printed, and then look like an error of the document. */
static void on_error_elsewhere(void *data, error_pointer error)
{
  reader *r = data;
  if (error->code == XML_ERR_NO_MEMORY)
    r->exhausted = true;
}

/* ---- Events ------------------------------------------------------------ */

/* One copy of each name. */
static const char *intern(reader *r, const xmlChar *name)
{
  const char *text = (const char *)name;
  size_t length = strlen(text);
  const zs_name *known = zs_names_find(&r->names, text, length);
  if (known)
    return known->text;
  char *copy = zs_arena_string(r->arena, text, length);
  return copy && zs_names_add(&r->names, r->arena, copy, length, 0) ? copy : NULL;
}

static bool is_ours(const reader *r, const xmlChar *uri)
{
  return !uri || strcmp((const char *)uri, r->language->name_space) == 0;
}

/* A copy of a value.  libxml2 leaves '&' as "&#38;" when it expands no
 * entities. */
static char *copy_value(reader *r, const char *value, size_t *length)
{
  static const char ampersand[] = "&#38;";
  enum { WRITTEN = sizeof ampersand - 1 };
  char *copy = zs_arena_string(r->arena, value, *length);
  if (!copy || !memchr(copy, '&', *length))
    return copy;
  size_t n = 0;
  for (size_t i = 0; i < *length; n++) {
    bool escaped = *length - i >= WRITTEN && memcmp(copy + i, ampersand, WRITTEN) == 0;
    copy[n] = copy[i];
    i += escaped ? WRITTEN : 1;
  }
  copy[n] = '\0';
  *length = n;
  return copy;
}

/* The attribute whose value is at `value`, as libxml2 lists it. */
static written written_around(const reader *r, size_t value, const xmlChar **entry)
{
  const char *text = r->source->text;
  size_t at = value - 1; /* the quote */
  while (text[--at] != '=')
    ;
  while (is_space(text[at - 1]))
    at--;
  size_t prefix = entry[1] ? strlen((const char *)entry[1]) + 1 : 0;
  size_t length = prefix + strlen((const char *)entry[0]);
  return (written){.name = at - length, .length = length, .value = value};
}

/* Fill in the attributes from libxml2's list and from the tag's text, which
 * lists the same ones in the same order. */
static bool add_attributes(reader *r, zs_element *element, size_t at, int count,
                           const xmlChar **list)
{
  element->attributes = ZS_ARENA_NEW(r->arena, zs_xml_attribute, (size_t)count);
  if (!element->attributes)
    return false;
  for (int i = 0; i < count; i++) {
    const xmlChar **entry = list + 5 * i; /* name, prefix, namespace, value, end */
    size_t value = offset_of(r, (const char *)entry[3]);
    written w = value < SIZE_MAX ? written_around(r, value, entry)
                                 : next_written(r->source->text, at);
    while (w.declaration)
      w = next_written(r->source->text, end_of_value(r->source->text, w.value));
    at = end_of_value(r->source->text, w.value);
    if (entry[1] && !is_ours(r, entry[2]))
      continue;
    zs_xml_attribute *a = &element->attributes[element->attribute_count++];
    a->name = intern(r, entry[0]);
    a->length = (size_t)(entry[4] - entry[3]);
    a->value = copy_value(r, (const char *)entry[3], &a->length);
    if (!a->name || !a->value)
      return false;
    move(r, w.name);
    a->name_line = r->cursor.line;
    a->name_column = r->cursor.column;
    move(r, w.value);
    a->line = r->cursor.line;
    a->column = r->cursor.column;
    a->offset = (uint32_t)w.value;
  }
  return true;
}

static void stop_for_namespace(reader *r, const zs_element *element, const char *name)
{
  zs_place place = zs_element_place(element);
  zs_report(r->diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL,
            "namespace '%s' is not known; expected '%s'", name, r->language->name_space);
  stop(r);
}

static void stop_for_depth(reader *r, const zs_element *element)
{
  zs_place place = zs_element_place(element);
  zs_report(r->diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL,
            "elements are nested more than %u deep", r->maximum_depth);
  stop(r);
}

/* Make an element the innermost open one. */
static void open_element(reader *r, zs_element *element)
{
  zs_element *parent = r->open;
  if (!parent)
    r->root = element;
  else if (parent->last)
    parent->last->next = element;
  else
    parent->first = element;
  if (parent)
    parent->last = element;
  r->open = element;
}

static void on_start(void *data, const xmlChar *name, const xmlChar *prefix, const xmlChar *uri,
                     int namespace_count, const xmlChar **namespaces, int attribute_count,
                     int defaulted, const xmlChar **attributes)
{
  (void)prefix, (void)namespace_count, (void)namespaces, (void)defaulted;
  reader *r = ((xmlParserCtxtPtr)data)->_private;
  if (r->stopped)
    return;
  r->depth++;
  bool foreign = !is_ours(r, uri);
  if (r->foreign || (foreign && r->open)) {
    if (!r->foreign)
      r->foreign = r->depth;
    return;
  }
  zs_element *element = ZS_ARENA_NEW(r->arena, zs_element, 1);
  const char *word = element ? intern(r, name) : NULL;
  if (!word) {
    stop_for_memory(r);
    return;
  }
  /* The parser is at the end of the tag, in which there is no other '<'. */
  size_t end = position(r);
  size_t value = attribute_count ? offset_of(r, (const char *)attributes[3]) : SIZE_MAX;
  size_t start = last_before(r, value < SIZE_MAX ? value : end, '<');
  move(r, start);
  *element = (zs_element){.name = word, .source = r->source, .parent = r->open,
                          .line = r->cursor.line, .column = r->cursor.column};
  if (foreign) {
    stop_for_namespace(r, element, (const char *)uri);
    return;
  }
  if (r->depth > r->maximum_depth) {
    stop_for_depth(r, element);
    return;
  }
  size_t at = behind_name(r->source->text, start, end);
  if (attribute_count > 0 && !add_attributes(r, element, at, attribute_count, attributes)) {
    stop_for_memory(r);
    return;
  }
  open_element(r, element);
}

/* Join an element's runs of text. */
static bool join_text(reader *r, zs_element *element)
{
  size_t length = 0;
  for (const zs_text_run *run = element->runs; run; run = run->next)
    length += run->length;
  element->text_length = length;
  if (!element->runs->next) {
    element->text = element->runs->text;
    return true;
  }
  char *text = ZS_ARENA_NEW(r->arena, char, length + 1), *at = text;
  if (!text)
    return false;
  for (const zs_text_run *run = element->runs; run; run = run->next) {
    memcpy(at, run->text, run->length);
    at += run->length;
  }
  element->text = text;
  return true;
}

static void on_end(void *data, const xmlChar *name, const xmlChar *prefix, const xmlChar *uri)
{
  (void)name, (void)prefix, (void)uri;
  reader *r = ((xmlParserCtxtPtr)data)->_private;
  if (r->stopped)
    return;
  if (r->foreign) {
    if (r->foreign == r->depth)
      r->foreign = 0;
    r->depth--;
    return;
  }
  r->depth--;
  zs_element *element = r->open;
  if (element->runs && !join_text(r, element)) {
    stop_for_memory(r);
    return;
  }
  r->open = element->parent;
}

/* Where a piece of text begins, the parser being at its end.  A reference
 * stands for its character. */
static size_t start_of_text(const reader *r, const char *text, size_t length)
{
  size_t end = position(r), start = offset_of(r, text);
  if (start < SIZE_MAX)
    return start;
  if (end >= length && memcmp(r->source->text + end - length, text, length) == 0)
    return end - length;
  return last_before(r, end, '&');
}

/* Where the content of the CDATA section that the parser is at the end of
 * begins. */
static size_t start_of_section(const reader *r)
{
  static const char opening[] = "<![CDATA[";
  enum { LENGTH = sizeof opening - 1 };
  size_t at = position(r);
  for (size_t i = at; i >= LENGTH; i--)
    if (memcmp(r->source->text + i - LENGTH, opening, LENGTH) == 0)
      return i;
  return at;
}

static void add_text(reader *r, const char *text, size_t length, size_t start)
{
  zs_text_run *run = ZS_ARENA_NEW(r->arena, zs_text_run, 1);
  char *copy = run ? zs_arena_string(r->arena, text, length) : NULL;
  if (!copy) {
    stop_for_memory(r);
    return;
  }
  move(r, start);
  *run = (zs_text_run){NULL, copy, length, r->cursor.line, r->cursor.column};
  if (r->open->runs)
    r->open->last_run->next = run;
  else
    r->open->runs = run;
  r->open->last_run = run;
}

/* Text outside of the scene, and blanks before any text, mean nothing. */
static bool is_text(const reader *r, const char *text, size_t length)
{
  return !r->stopped && !r->foreign && r->open && (r->open->runs || !is_blank(text, length));
}

static void on_text(void *data, const xmlChar *bytes, int count)
{
  reader *r = ((xmlParserCtxtPtr)data)->_private;
  const char *text = (const char *)bytes;
  if (is_text(r, text, (size_t)count))
    add_text(r, text, (size_t)count, start_of_text(r, text, (size_t)count));
}

static void on_section(void *data, const xmlChar *bytes, int count)
{
  reader *r = ((xmlParserCtxtPtr)data)->_private;
  const char *text = (const char *)bytes;
  if (is_text(r, text, (size_t)count))
    add_text(r, text, (size_t)count, start_of_section(r));
}

static void on_document_type(void *data, const xmlChar *name, const xmlChar *external,
                             const xmlChar *system)
{
  (void)name, (void)external, (void)system;
  reader *r = ((xmlParserCtxtPtr)data)->_private;
  const size_t at = position(r);
  const bool declares = at < r->source->length && r->source->text[at] == '[';
  if (r->stopped || (r->language->document_type && !declares))
    return;
  report_at(r, last_before(r, at, '<'), NULL,
            declares && r->language->document_type
              ? "a document type declaration that declares something is not allowed%s"
              : "a document type declaration is not allowed: scenes have no entities%s",
            "");
  stop(r);
}

/* ---- The document ------------------------------------------------------ */

/* Length of the valid UTF-8 character at `at`, or 0. */
static size_t utf8_length(const unsigned char *at, size_t left)
{
  static const uint32_t least[] = {0, 0, 0x80, 0x800, 0x10000};
  size_t n = at[0] < 0x80 ? 1 : at[0] >= 0xF0 ? 4 : at[0] >= 0xE0 ? 3 : at[0] >= 0xC0 ? 2 : 0;
  if (n <= 1)
    return n;
  if (n > left)
    return 0;
  uint32_t code = at[0] & (0x7Fu >> n);
  for (size_t i = 1; i < n; i++) {
    if ((at[i] & 0xC0) != 0x80)
      return 0;
    code = code << 6 | (at[i] & 0x3Fu);
  }
  bool valid = code >= least[n] && code <= 0x10FFFF && !(code >= 0xD800 && code < 0xE000);
  return valid ? n : 0;
}

/* The encoding that the XML declaration names, as a stretch of the source. */
static size_t declared_encoding(const zs_source *source, size_t *length)
{
  size_t at = has_mark(source) ? 3 : 0;
  static const char opening[] = "<?xml", word[] = "encoding";
  if (source->length - at < sizeof opening - 1 ||
      memcmp(source->text + at, opening, sizeof opening - 1) != 0)
    return 0;
  const char *close = memchr(source->text + at, '>', source->length - at);
  size_t end = close ? (size_t)(close - source->text) : source->length;
  for (; at + sizeof word < end; at++) {
    if (memcmp(source->text + at, word, sizeof word - 1) != 0)
      continue;
    at += sizeof word - 1;
    while (at < end && source->text[at] != '"' && source->text[at] != '\'')
      at++;
    size_t value = at + 1, n = 0;
    while (value + n < end && source->text[value + n] != '"' && source->text[value + n] != '\'')
      n++;
    *length = n;
    return value;
  }
  return 0;
}

static bool same_word(const char *text, size_t length, const char *word)
{
  if (length != strlen(word))
    return false;
  for (size_t i = 0; i < length; i++) {
    char c = text[i];
    if (c >= 'A' && c <= 'Z')
      c = (char)(c - 'A' + 'a');
    if (c != word[i])
      return false;
  }
  return true;
}

/* Whether eight bytes are ASCII, and none is zero. */
static bool is_plain(const unsigned char *text)
{
  static const uint64_t low_bits = UINT64_C(0x0101010101010101);
  uint64_t word;
  memcpy(&word, text, sizeof word);
  return (((word - low_bits) | word) & (low_bits << 7)) == 0;
}

/* Everything that follows may rely on valid UTF-8. */
static bool check_text(reader *r)
{
  const zs_source *source = r->source;
  if (is_blank(source->text, source->length) || (has_mark(source) && source->length == 3)) {
    report_at(r, 0, NULL, "the file is empty; expected <%s>", r->language->root);
    return false;
  }
  const unsigned char *text = (const unsigned char *)source->text;
  if (source->length >= 2 && ((text[0] == 0xFF && text[1] == 0xFE) ||
                              (text[0] == 0xFE && text[1] == 0xFF))) {
    report_at(r, 0, NULL, "the file is encoded as UTF-16; expected UTF-8%s", "");
    return false;
  }
  for (size_t at = 0, n; at < source->length; at += n) {
    n = source->length - at >= 8 && is_plain(text + at) ? 8
        : text[at] ? utf8_length(text + at, source->length - at)
                   : 0;
    if (n)
      continue;
    if (text[at] == 0)
      report_at(r, at, NULL, "not a text file: it contains a zero byte%s", "");
    else
      report_at(r, at, NULL, "not valid UTF-8%s", "");
    return false;
  }
  size_t length = 0, at = declared_encoding(source, &length);
  if (at && !same_word(source->text + at, length, "utf-8") &&
      !same_word(source->text + at, length, "us-ascii")) {
    char word[32] = {0};
    memcpy(word, source->text + at, length < sizeof word ? length : sizeof word - 1);
    report_at(r, at, NULL, "encoding '%s' is not supported; expected UTF-8", word);
    return false;
  }
  return true;
}

static zs_element *parse(reader *r)
{
  xmlParserCtxtPtr context = xmlCreateMemoryParserCtxt(r->source->text, (int)r->source->length);
  if (!context) {
    zs_fail_memory(r->diag);
    return NULL;
  }
  int options = XML_PARSE_NONET | XML_PARSE_IGNORE_ENC;
  /* What libxml2 allows otherwise. */
  enum { LIBXML_DEPTH = 256 };
  if (r->maximum_depth > LIBXML_DEPTH)
    options |= XML_PARSE_HUGE;
  xmlCtxtUseOptions(context, options);
  memset(context->sax, 0, sizeof *context->sax);
  context->sax->initialized = XML_SAX2_MAGIC;
  context->sax->startElementNs = on_start;
  context->sax->endElementNs = on_end;
  context->sax->characters = on_text;
  context->sax->ignorableWhitespace = on_text;
  context->sax->cdataBlock = on_section;
  context->sax->internalSubset = on_document_type;
  context->sax->serror = on_error;
  context->userData = context;
  context->_private = r;
  r->context = context;
  xmlParseDocument(context);
  if (r->exhausted)
    stop_for_memory(r);
  bool complete = context->wellFormed && !r->stopped && r->root;
  if (!complete && !r->stopped)
    report_at(r, position(r), NULL, "not well-formed XML%s", "");
  xmlFreeParserCtxt(context);
  return complete ? r->root : NULL;
}

zs_element *zs_xml_parse(const zs_source *source, const zs_xml_language *language,
                         uint32_t maximum_depth, zs_arena *arena, zs_diag *diag)
{
  reader r = {.source = source, .language = language, .arena = arena, .diag = diag, .maximum_depth = maximum_depth,
              .cursor = start_of(source)};
  if (source->length > INT_MAX) {
    report_at(&r, 0, NULL, "the file is larger than 2 GiB%s", "");
    return NULL;
  }
  if (!check_text(&r))
    return NULL;
  /* The thread's own handler, which its host may use too. */
  xmlStructuredErrorFunc handler = xmlStructuredError;
  void *handler_data = xmlStructuredErrorContext;
  xmlSetStructuredErrorFunc(&r, on_error_elsewhere);
  zs_element *root = parse(&r);
  xmlSetStructuredErrorFunc(handler_data, handler);
  return root;
}

/* ---- Places ------------------------------------------------------------ */

zs_place zs_element_place(const zs_element *element)
{
  return (zs_place){.source = element->source, .line = element->line, .column = element->column,
                    .element = element->name};
}

zs_xml_attribute *zs_element_attribute(const zs_element *element, const char *name)
{
  for (size_t i = 0; i < element->attribute_count; i++)
    if (strcmp(element->attributes[i].name, name) == 0)
      return &element->attributes[i];
  return NULL;
}

zs_place zs_attribute_name_place(const zs_element *element, const zs_xml_attribute *attribute)
{
  return (zs_place){.source = element->source, .line = attribute->name_line,
                    .column = attribute->name_column, .element = element->name,
                    .attribute = attribute->name};
}

/* Bytes that the reference at `text` stands for; `length` gets its own. */
static size_t reference_length(const char *text, size_t *length)
{
  *length = strcspn(text, ";") + 1;
  unsigned long code = 0;
  if (text[1] == '#') {
    bool hexadecimal = text[2] == 'x';
    for (size_t i = hexadecimal ? 3 : 2; i + 1 < *length; i++) {
      unsigned digit = text[i] <= '9' ? (unsigned)(text[i] - '0') : (unsigned)(text[i] & 7) + 9;
      code = code * (hexadecimal ? 16 : 10) + digit;
    }
  }
  return code < 0x80 ? 1 : code < 0x800 ? 2 : code < 0x10000 ? 3 : 4;
}

zs_place zs_attribute_place(const zs_element *element, const zs_xml_attribute *attribute,
                            size_t at)
{
  cursor c = {.line = attribute->line, .column = attribute->column};
  const char *text = element->source && element->source->text
                       ? element->source->text + attribute->offset
                       : NULL;
  if (at > attribute->length)
    at = attribute->length;
  for (size_t decoded = 0; text && decoded < at;) {
    size_t length = 1, stands_for = 1;
    if (*text == '&')
      stands_for = reference_length(text, &length);
    else if (text[0] == '\r' && text[1] == '\n')
      length = 2;
    step(&c, text, length);
    text += length;
    decoded += stands_for;
  }
  return (zs_place){.source = element->source, .line = c.line, .column = c.column,
                    .element = element->name, .attribute = attribute->name};
}

zs_place zs_text_place(const zs_element *element, size_t at)
{
  zs_place place = zs_element_place(element);
  for (const zs_text_run *run = element->runs; run; run = run->next) {
    if (at <= run->length && (at < run->length || !run->next)) {
      cursor c = {.line = run->line, .column = run->column};
      step(&c, run->text, at);
      place.line = c.line;
      place.column = c.column;
      return place;
    }
    at -= run->length;
  }
  return place;
}
