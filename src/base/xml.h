/* An XML document as a light tree of elements that know where they stand. */
#ifndef ZS_XML_H
#define ZS_XML_H

#include "base/arena.h"
#include "base/diagnostic.h"

#include <stdint.h>

#define ZS_NAMESPACE "urn:zeroset:scene:1"

/* What kind of document is read. */
typedef struct zs_xml_language {
  const char *name_space;  /* what is in others is left out; elements in none are in it */
  const char *root;        /* name of the root element, for messages */
  bool document_type;      /* a document type declaration may name one, but declare nothing */
} zs_xml_language;

extern const zs_xml_language zs_xml_scene;

/* Values are decoded: references replaced, line ends turned into spaces. */
typedef struct zs_xml_attribute {
  const char *name, *value;
  size_t length;
  uint32_t offset;       /* of the value as written, bytes into the source */
  uint32_t line, column; /* of its first character */
  uint32_t name_line, name_column;
  const void *parsed; /* what the reader makes of it, kept for the next time */
} zs_xml_attribute;

/* A stretch of text that stands in the source as it is. */
typedef struct zs_text_run {
  struct zs_text_run *next;
  const char *text;
  size_t length;
  uint32_t line, column;
} zs_text_run;

typedef struct zs_element zs_element;
struct zs_element {
  const char *name;
  const zs_source *source;
  zs_element *parent, *first, *last, *next; /* first, last child; next sibling */
  zs_xml_attribute *attributes;
  size_t attribute_count;
  const char *text; /* of the element itself, NULL where it is blank */
  size_t text_length;
  zs_text_run *runs, *last_run;
  uint32_t line, column; /* of its '<' */
  const void *parsed;    /* what the reader makes of the text */
};

/* Read a document whose text is in `source`.  Elements and attributes of other
 * namespaces, comments and processing instructions are left out.  The tree
 * lives in the arena.  NULL after an error; there is no tree of a part of a
 * malformed document. */
zs_element *zs_xml_parse(const zs_source *source, const zs_xml_language *language,
                         uint32_t maximum_depth, zs_arena *arena, zs_diag *diag);

zs_place zs_element_place(const zs_element *element);
zs_xml_attribute *zs_element_attribute(const zs_element *element, const char *name);

/* The place of an attribute's name, of byte `at` of its value, and of byte `at`
 * of an element's text. */
zs_place zs_attribute_name_place(const zs_element *element, const zs_xml_attribute *attribute);
zs_place zs_attribute_place(const zs_element *element, const zs_xml_attribute *attribute,
                            size_t at);
zs_place zs_text_place(const zs_element *element, size_t at);

#endif
