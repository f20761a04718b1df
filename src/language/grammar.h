/* What the two schemas have in common: which content and which values the
 * tables of kinds allow.  A schema language adds only its syntax. */
#ifndef ZS_LANGUAGE_GRAMMAR_H
#define ZS_LANGUAGE_GRAMMAR_H

#include "language/text.h"
#include "nodes/kind.h"

#define ZS_SCENE_NAMESPACE "urn:zeroset:scene:1"

typedef struct zs_grammar zs_grammar;

/* The syntax of a schema language.  Paths name definitions: "interpolate" for
 * an element, "interpolate.level" for a part of it. */
typedef struct zs_grammar_syntax {
  const char *many_open, *many_close;         /* any number of any of ... */
  const char *choice_open, *choice_close;     /* one of ... */
  const char *sequence_open, *sequence_close; /* ... in order */
  const char *any_node;                       /* a node that is no repeat */
  const char *foreign;                        /* an element of another namespace */
  void (*element)(zs_grammar *grammar, const char *path, const char *name);
  /* The definition of an element, whose parts have paths that begin with
   * `owner`: its own path, or for a repeat that of the element around it. */
  void (*define)(zs_grammar *grammar, const char *path, const char *owner, const zs_kind *kind);
} zs_grammar_syntax;

struct zs_grammar {
  zs_text text;
  int depth; /* of indentation */
  const zs_grammar_syntax *syntax;
};

void zs_grammar_indent(zs_grammar *grammar);
/* One line at the present depth; an opening tag is followed by depth + 1, and a
 * closing tag preceded by depth - 1. */
void zs_grammar_line(zs_grammar *grammar, const char *format, ...)
  __attribute__((format(printf, 2, 3)));
void zs_grammar_open(zs_grammar *grammar, const char *tag);
void zs_grammar_close(zs_grammar *grammar, const char *tag);

/* Define every element of the language, calling syntax->define for each. */
void zs_grammar_define_all(zs_grammar *grammar);

/* The content that an element may have. */
void zs_grammar_content(zs_grammar *grammar, const char *owner, const zs_kind *kind);

/* The names of the elements that stand where a node may, except repeat. */
void zs_grammar_nodes(zs_grammar *grammar);

/* Whether an element takes at, rotate and scale; whether it takes attributes of
 * any name. */
bool zs_grammar_placed(const zs_kind *kind);
bool zs_grammar_open_attributes(const zs_kind *kind);

/* Whether the rows of a kind's attributes are attributes in the file: the row of
 * an element's text is not. */
bool zs_grammar_is_written(const zs_kind *kind, const zs_attribute *attribute);

/* ---- Values ------------------------------------------------------------- */

/* Named data types, each a regular expression over the text with its blanks
 * collapsed. */
typedef struct zs_grammar_type {
  const char *name;    /* "type.vector3.positive" */
  const char *pattern;
} zs_grammar_type;

extern const zs_grammar_type zs_grammar_types[];
extern const size_t zs_grammar_type_count;

/* The named type of an attribute, or NULL for those that a schema writes in
 * place: choices, numbers within limits, texts. */
const char *zs_grammar_type_name(const zs_attribute *attribute);

/* The patterns that keep "NaN", "INF" and what libxml2 lets pass ("1e") out of a
 * schema's own numbers; of whole numbers, fractions too. */
extern const char zs_grammar_decimal[], zs_grammar_whole[];

/* A limit of a number, between two texts, on its own line; nothing for an
 * infinite one. */
void zs_grammar_limit(zs_grammar *grammar, const char *before, double limit, const char *after);

/* Whether an attribute is a text that may have no characters. */
bool zs_grammar_may_be_empty(const zs_attribute *attribute);

/* The meaning of an attribute in one sentence, for annotations: its doc, unit
 * and default. */
void zs_grammar_describe(zs_text *text, const zs_attribute *attribute);

#endif
