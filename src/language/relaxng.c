/* The RELAX NG schema.  Elements are accepted in the language's namespace and
 * without one, as the reader accepts them. */
#include "language/documents.h"
#include "language/grammar.h"
#include "scene/document.h"

static void reference(zs_grammar *grammar, const char *path, const char *name)
{
  (void)name;
  zs_grammar_line(grammar, "<ref name=\"%s\"/>", path);
}

static void put_documentation(zs_grammar *grammar, const zs_attribute *attribute)
{
  zs_grammar_indent(grammar);
  zs_text_add(&grammar->text, "<a:documentation>");
  zs_grammar_describe(&grammar->text, attribute);
  zs_text_add(&grammar->text, "</a:documentation>\n");
}

static void put_words(zs_grammar *grammar, const char *const *words)
{
  for (; *words; words++)
    zs_grammar_line(grammar, "<value>%s</value>", *words);
}

/* A number within limits, or an expression. */
static void put_limited(zs_grammar *grammar, const zs_attribute *attribute)
{
  zs_grammar_open(grammar, "<data type=\"double\">");
  zs_grammar_limit(grammar, "<param name=\"minInclusive\">", attribute->minimum, "</param>");
  zs_grammar_limit(grammar, "<param name=\"maxInclusive\">", attribute->maximum, "</param>");
  zs_grammar_line(grammar, "<param name=\"pattern\">%s</param>",
                  attribute->type == ZS_INTEGER ? zs_grammar_whole : zs_grammar_decimal);
  zs_grammar_close(grammar, "</data>");
  zs_grammar_line(grammar, "<ref name=\"type.expression\"/>");
}

static void put_value(zs_grammar *grammar, const zs_attribute *attribute)
{
  static const char *const booleans[] = {"true", "false", NULL};
  const char *name = zs_grammar_type_name(attribute);
  zs_grammar_open(grammar, "<choice>");
  if (attribute->choices)
    put_words(grammar, attribute->choices);
  if (name)
    zs_grammar_line(grammar, "<ref name=\"%s\"/>", name);
  else if (attribute->type == ZS_BOOLEAN)
    put_words(grammar, booleans);
  else if (attribute->type == ZS_NUMBER || attribute->type == ZS_INTEGER)
    put_limited(grammar, attribute);
  else if (attribute->type != ZS_CHOICE)
    zs_grammar_line(grammar, zs_grammar_may_be_empty(attribute)
                               ? "<text/>"
                               : "<data type=\"string\"><param name=\"minLength\">1</param></data>");
  zs_grammar_close(grammar, "</choice>");
}

static void put_attribute(zs_grammar *grammar, const zs_attribute *attribute)
{
  if (attribute->initial)
    zs_grammar_open(grammar, "<optional>");
  zs_grammar_line(grammar, "<attribute name=\"%s\" ns=\"\">", attribute->name);
  grammar->depth++;
  put_documentation(grammar, attribute);
  put_value(grammar, attribute);
  zs_grammar_close(grammar, "</attribute>");
  if (attribute->initial)
    zs_grammar_close(grammar, "</optional>");
}

/* Arguments: attributes of any name but those the element has itself.  What is
 * not in the language's namespace goes with them, since libxml2 cannot tell two
 * open name classes apart. */
static void put_arguments(zs_grammar *grammar, const zs_kind *kind)
{
  zs_grammar_open(grammar, "<zeroOrMore>");
  zs_grammar_open(grammar, "<attribute>");
  zs_grammar_open(grammar, "<anyName>");
  zs_grammar_open(grammar, "<except>");
  zs_grammar_line(grammar, "<nsName/>");
  for (size_t i = 0; i < kind->attribute_count; i++)
    zs_grammar_line(grammar, "<name ns=\"\">%s</name>", kind->attributes[i].name);
  for (size_t i = 0; i < ZS_PLACEMENT_ATTRIBUTES; i++)
    zs_grammar_line(grammar, "<name ns=\"\">%s</name>", zs_placement_attributes[i].name);
  zs_grammar_close(grammar, "</except>");
  zs_grammar_close(grammar, "</anyName>");
  zs_grammar_close(grammar, "</attribute>");
  zs_grammar_close(grammar, "</zeroOrMore>");
}

static void put_body(zs_grammar *grammar, const char *owner, const zs_kind *kind)
{
  if (zs_grammar_open_attributes(kind))
    put_arguments(grammar, kind);
  else
    zs_grammar_line(grammar, "<ref name=\"any.foreign-attributes\"/>");
  if (zs_grammar_placed(kind))
    zs_grammar_line(grammar, "<ref name=\"any.placement\"/>");
  for (size_t i = 0; i < kind->attribute_count; i++)
    if (zs_grammar_is_written(kind, &kind->attributes[i]))
      put_attribute(grammar, &kind->attributes[i]);
  if (kind->text)
    zs_grammar_open(grammar, "<mixed>");
  zs_grammar_content(grammar, owner, kind);
  if (kind->text)
    zs_grammar_close(grammar, "</mixed>");
}

/* Two elements with one body: a choice of names in one element would do, but
 * libxml2 says on standard error that it cannot compare those. */
static void define(zs_grammar *grammar, const char *path, const char *owner,
                   const zs_kind *kind)
{
  static const char *const namespaces[] = {ZS_SCENE_NAMESPACE, ""};
  zs_grammar_line(grammar, "<define name=\"%s\">", path);
  grammar->depth++;
  zs_grammar_open(grammar, "<choice>");
  for (int i = 0; i < 2; i++) {
    zs_grammar_line(grammar, "<element name=\"%s\" ns=\"%s\">", kind->name, namespaces[i]);
    grammar->depth++;
    zs_grammar_indent(grammar);
    zs_text_add(&grammar->text, "<a:documentation>");
    zs_text_add_xml(&grammar->text, kind->summary);
    zs_text_add(&grammar->text, "</a:documentation>\n");
    zs_grammar_line(grammar, "<ref name=\"%s.body\"/>", path);
    zs_grammar_close(grammar, "</element>");
  }
  zs_grammar_close(grammar, "</choice>");
  zs_grammar_close(grammar, "</define>");
  zs_grammar_line(grammar, "<define name=\"%s.body\">", path);
  grammar->depth++;
  put_body(grammar, owner, kind);
  zs_grammar_close(grammar, "</define>");
}

static const zs_grammar_syntax syntax = {
  .many_open = "<zeroOrMore><choice>",
  .many_close = "</choice></zeroOrMore>",
  .choice_open = "<choice>",
  .choice_close = "</choice>",
  .sequence_open = "<group>",
  .sequence_close = "</group>",
  .any_node = "<ref name=\"any.node\"/>",
  .foreign = "<ref name=\"any.foreign\"/>",
  .element = reference,
  .define = define,
};

static void put_nodes(zs_grammar *grammar)
{
  zs_grammar_open(grammar, "<define name=\"any.node\">");
  zs_grammar_open(grammar, "<choice>");
  zs_grammar_nodes(grammar);
  zs_grammar_close(grammar, "</choice>");
  zs_grammar_close(grammar, "</define>");
}

static void put_placement(zs_grammar *grammar)
{
  zs_grammar_open(grammar, "<define name=\"any.placement\">");
  for (size_t i = 0; i < ZS_PLACEMENT_ATTRIBUTES; i++)
    put_attribute(grammar, &zs_placement_attributes[i]);
  zs_grammar_close(grammar, "</define>");
}

static void put_types(zs_grammar *grammar)
{
  for (size_t i = 0; i < zs_grammar_type_count; i++) {
    zs_grammar_line(grammar, "<define name=\"%s\">", zs_grammar_types[i].name);
    grammar->depth++;
    zs_grammar_line(grammar, "<data type=\"token\"><param name=\"pattern\">%s</param></data>",
                    zs_grammar_types[i].pattern);
    zs_grammar_close(grammar, "</define>");
  }
}

static const char foreign[] =
  "  <define name=\"any.foreign-attributes\">\n"
  "    <zeroOrMore>\n"
  "      <attribute>\n"
  "        <anyName><except><nsName/><nsName ns=\"\"/></except></anyName>\n"
  "      </attribute>\n"
  "    </zeroOrMore>\n"
  "  </define>\n"
  "  <define name=\"any.foreign\">\n"
  "    <element>\n"
  "      <anyName><except><nsName/><nsName ns=\"\"/></except></anyName>\n"
  "      <ref name=\"any.anything\"/>\n"
  "    </element>\n"
  "  </define>\n"
  "  <define name=\"any.anything\">\n"
  "    <zeroOrMore>\n"
  "      <choice>\n"
  "        <attribute><anyName/></attribute>\n"
  "        <text/>\n"
  "        <element><anyName/><ref name=\"any.anything\"/></element>\n"
  "      </choice>\n"
  "    </zeroOrMore>\n"
  "  </define>\n";

void zs_relaxng_write(zs_text *text)
{
  zs_grammar grammar = {.text = *text, .depth = 1, .syntax = &syntax};
  zs_text_add(&grammar.text,
              "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
              "<!-- Generated from the tables of the scene language: make regen -->\n"
              "<grammar xmlns=\"http://relaxng.org/ns/structure/1.0\"\n"
              "         xmlns:a=\"http://relaxng.org/ns/compatibility/annotations/1.0\"\n"
              "         datatypeLibrary=\"http://www.w3.org/2001/XMLSchema-datatypes\"\n"
              "         ns=\"" ZS_SCENE_NAMESPACE "\">\n"
              "  <start><ref name=\"scene\"/></start>\n");
  put_nodes(&grammar);
  put_placement(&grammar);
  zs_grammar_define_all(&grammar);
  put_types(&grammar);
  zs_text_add(&grammar.text, foreign);
  zs_text_add(&grammar.text, "</grammar>\n");
  *text = grammar.text;
}
