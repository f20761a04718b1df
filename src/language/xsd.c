/* The W3C XML Schema, version 1.0.  It covers documents in the language's
 * namespace; a scene without a namespace needs the RELAX NG schema. */
#include "language/documents.h"
#include "language/grammar.h"
#include "scene/document.h"

static void element(zs_grammar *grammar, const char *path, const char *name)
{
  zs_grammar_line(grammar, "<xs:element name=\"%s\" type=\"%s\"/>", name, path);
}

static void put_words(zs_grammar *grammar, const char *const *words)
{
  zs_grammar_open(grammar, "<xs:simpleType>");
  zs_grammar_open(grammar, "<xs:restriction base=\"xs:token\">");
  for (; *words; words++)
    zs_grammar_line(grammar, "<xs:enumeration value=\"%s\"/>", *words);
  zs_grammar_close(grammar, "</xs:restriction>");
  zs_grammar_close(grammar, "</xs:simpleType>");
}

static void put_limited(zs_grammar *grammar, const zs_attribute *attribute)
{
  zs_grammar_open(grammar, "<xs:simpleType>");
  zs_grammar_open(grammar, "<xs:restriction base=\"xs:double\">");
  zs_grammar_limit(grammar, "<xs:minInclusive value=\"", attribute->minimum, "\"/>");
  zs_grammar_limit(grammar, "<xs:maxInclusive value=\"", attribute->maximum, "\"/>");
  zs_grammar_line(grammar, "<xs:pattern value=\"%s\"/>",
                  attribute->type == ZS_INTEGER ? zs_grammar_whole : zs_grammar_decimal);
  zs_grammar_close(grammar, "</xs:restriction>");
  zs_grammar_close(grammar, "</xs:simpleType>");
}

static void put_not_empty(zs_grammar *grammar)
{
  zs_grammar_open(grammar, "<xs:simpleType>");
  zs_grammar_line(grammar, "<xs:restriction base=\"xs:string\"><xs:minLength value=\"1\"/>"
                           "</xs:restriction>");
  zs_grammar_close(grammar, "</xs:simpleType>");
}

static void put_value(zs_grammar *grammar, const zs_attribute *attribute)
{
  static const char *const booleans[] = {"true", "false", NULL};
  const char *name = zs_grammar_type_name(attribute);
  bool limited = !name && (attribute->type == ZS_NUMBER || attribute->type == ZS_INTEGER);
  const char *named = name ? name : limited ? "type.expression" : NULL;
  zs_grammar_open(grammar, "<xs:simpleType>");
  if (named)
    zs_grammar_line(grammar, "<xs:union memberTypes=\"%s\">", named);
  else
    zs_grammar_line(grammar, "<xs:union>");
  grammar->depth++;
  if (attribute->choices)
    put_words(grammar, attribute->choices);
  else if (attribute->type == ZS_BOOLEAN)
    put_words(grammar, booleans);
  if (limited)
    put_limited(grammar, attribute);
  else if (!name && attribute->type != ZS_CHOICE && attribute->type != ZS_BOOLEAN)
    put_not_empty(grammar);
  zs_grammar_close(grammar, "</xs:union>");
  zs_grammar_close(grammar, "</xs:simpleType>");
}

/* The type that needs no definition in place, or NULL. */
static const char *plain_type(const zs_attribute *attribute)
{
  if (zs_grammar_may_be_empty(attribute))
    return "xs:string";
  return attribute->choices ? NULL : zs_grammar_type_name(attribute);
}

static void put_attribute(zs_grammar *grammar, const zs_attribute *attribute)
{
  const char *type = plain_type(attribute);
  const char *required = attribute->initial ? "" : " use=\"required\"";
  if (type)
    zs_grammar_line(grammar, "<xs:attribute name=\"%s\"%s type=\"%s\">", attribute->name, required,
                    type);
  else
    zs_grammar_line(grammar, "<xs:attribute name=\"%s\"%s>", attribute->name, required);
  grammar->depth++;
  zs_grammar_indent(grammar);
  zs_text_add(&grammar->text, "<xs:annotation><xs:documentation>");
  zs_grammar_describe(&grammar->text, attribute);
  zs_text_add(&grammar->text, "</xs:documentation></xs:annotation>\n");
  if (!type)
    put_value(grammar, attribute);
  zs_grammar_close(grammar, "</xs:attribute>");
}

static void define(zs_grammar *grammar, const char *path, const char *owner,
                   const zs_kind *kind)
{
  zs_grammar_line(grammar, "<xs:complexType name=\"%s\"%s>", path,
                  kind->text ? " mixed=\"true\"" : "");
  grammar->depth++;
  zs_grammar_indent(grammar);
  zs_text_add(&grammar->text, "<xs:annotation><xs:documentation>");
  zs_text_add_xml(&grammar->text, kind->summary);
  zs_text_add(&grammar->text, "</xs:documentation></xs:annotation>\n");
  zs_grammar_content(grammar, owner, kind);
  for (size_t i = 0; i < kind->attribute_count; i++)
    if (zs_grammar_is_written(kind, &kind->attributes[i]))
      put_attribute(grammar, &kind->attributes[i]);
  if (zs_grammar_placed(kind))
    zs_grammar_line(grammar, "<xs:attributeGroup ref=\"any.placement\"/>");
  zs_grammar_line(grammar, "<xs:anyAttribute namespace=\"##%s\" processContents=\"skip\"/>",
                  zs_grammar_open_attributes(kind) ? "any" : "other");
  zs_grammar_close(grammar, "</xs:complexType>");
}

static const zs_grammar_syntax syntax = {
  .many_open = "<xs:choice minOccurs=\"0\" maxOccurs=\"unbounded\">",
  .many_close = "</xs:choice>",
  .choice_open = "<xs:choice>",
  .choice_close = "</xs:choice>",
  .sequence_open = "<xs:sequence>",
  .sequence_close = "</xs:sequence>",
  .any_node = "<xs:group ref=\"any.node\"/>",
  .foreign = "<xs:any namespace=\"##other\" processContents=\"skip\"/>",
  .element = element,
  .define = define,
};

static void put_nodes(zs_grammar *grammar)
{
  zs_grammar_open(grammar, "<xs:group name=\"any.node\">");
  zs_grammar_open(grammar, "<xs:choice>");
  zs_grammar_nodes(grammar);
  zs_grammar_close(grammar, "</xs:choice>");
  zs_grammar_close(grammar, "</xs:group>");
}

static void put_placement(zs_grammar *grammar)
{
  zs_grammar_open(grammar, "<xs:attributeGroup name=\"any.placement\">");
  for (size_t i = 0; i < ZS_PLACEMENT_ATTRIBUTES; i++)
    put_attribute(grammar, &zs_placement_attributes[i]);
  zs_grammar_close(grammar, "</xs:attributeGroup>");
}

static void put_types(zs_grammar *grammar)
{
  for (size_t i = 0; i < zs_grammar_type_count; i++) {
    zs_grammar_line(grammar, "<xs:simpleType name=\"%s\">", zs_grammar_types[i].name);
    grammar->depth++;
    zs_grammar_line(grammar,
                    "<xs:restriction base=\"xs:token\"><xs:pattern value=\"%s\"/></xs:restriction>",
                    zs_grammar_types[i].pattern);
    zs_grammar_close(grammar, "</xs:simpleType>");
  }
}

void zs_xsd_write(zs_text *text)
{
  zs_grammar grammar = {.text = *text, .depth = 1, .syntax = &syntax};
  zs_text_add(&grammar.text,
              "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
              "<!-- Generated from the tables of the scene language: make regen -->\n"
              "<xs:schema xmlns:xs=\"http://www.w3.org/2001/XMLSchema\"\n"
              "           xmlns=\"" ZS_SCENE_NAMESPACE "\"\n"
              "           targetNamespace=\"" ZS_SCENE_NAMESPACE "\"\n"
              "           elementFormDefault=\"qualified\">\n"
              "  <xs:element name=\"scene\" type=\"scene\"/>\n");
  put_nodes(&grammar);
  put_placement(&grammar);
  zs_grammar_define_all(&grammar);
  put_types(&grammar);
  zs_text_add(&grammar.text, "</xs:schema>\n");
  *text = grammar.text;
}
