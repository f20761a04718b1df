/* The reference manual, in Markdown. */
#include "language/documents.h"

#include "scene/document.h"

#include <math.h>
#include <string.h>

/* ---- One element ---------------------------------------------------------- */

static const char *const type_names[] = {
  [ZS_NUMBER] = "number",     [ZS_INTEGER] = "whole number", [ZS_VECTOR2] = "2 numbers",
  [ZS_VECTOR3] = "3 numbers", [ZS_SCALE] = "1 or 3 numbers", [ZS_CHOICE] = "choice",
  [ZS_BOOLEAN] = "choice",    [ZS_TEXT] = "text",            [ZS_FILE] = "file name",
  [ZS_FILES] = "file names",
  [ZS_NUMBERS] = "numbers",   [ZS_FORMULA] = "formula"};

/* Text for a cell of a table: a bar would end the cell. */
static void put_cell(zs_text *text, const char *string)
{
  for (const char *bar; (bar = strchr(string, '|')); string = bar + 1) {
    zs_text_add_bytes(text, string, (size_t)(bar - string));
    zs_text_add(text, "\\|");
  }
  zs_text_add(text, string);
}

static void put_words(zs_text *text, const char *const *words)
{
  for (const char *const *word = words; *word; word++)
    zs_text_format(text, "%s`%s`", word == words ? "" : ", ", *word);
}

static void put_range(zs_text *text, const zs_attribute *attribute)
{
  static const char *const ranges[] = {"", "> 0", "≥ 0", "not 0"};
  if (attribute->choices)
    put_words(text, attribute->choices);
  if (attribute->choices && attribute->type == ZS_NUMBER)
    zs_text_add(text, attribute->range ? ", or " : ", or any number");
  if (attribute->type == ZS_BOOLEAN)
    zs_text_add(text, "`true`, `false`");
  if (attribute->range != ZS_RANGE_BETWEEN) {
    zs_text_add(text, ranges[attribute->range]);
    return;
  }
  if (isinf(attribute->minimum) || isinf(attribute->maximum)) {
    zs_text_add(text, isinf(attribute->maximum) ? "≥ " : "≤ ");
    zs_text_add_number(text, isinf(attribute->maximum) ? attribute->minimum : attribute->maximum);
    return;
  }
  zs_text_add_number(text, attribute->minimum);
  zs_text_add(text, " … ");
  zs_text_add_number(text, attribute->maximum);
}

static void put_attribute(zs_text *text, const zs_attribute *attribute)
{
  zs_text_format(text, "| `%s` | %s | %s | ", attribute->name, type_names[attribute->type],
                 attribute->unit);
  if (!attribute->initial)
    zs_text_add(text, "required");
  else if (*attribute->initial)
    zs_text_format(text, "`%s`", attribute->initial);
  zs_text_add(text, " | ");
  put_range(text, attribute);
  zs_text_add(text, " | ");
  put_cell(text, attribute->doc);
  zs_text_add(text, " |\n");
}

static void put_attributes(zs_text *text, const zs_attribute *attributes, size_t count)
{
  if (count == 0)
    return;
  zs_text_add(text, "\n| attribute | type | unit | default | range | meaning |\n"
                    "|---|---|---|---|---|---|\n");
  for (size_t i = 0; i < count; i++)
    put_attribute(text, &attributes[i]);
}

/* "let a = b; c" as lines: "let a = b" and "left = c". */
static void put_definition(zs_text *text, const char *indent, const char *left,
                           const char *formula)
{
  for (const char *end; strncmp(formula, "let ", 4) == 0 && (end = strchr(formula, ';'));) {
    zs_text_format(text, "%s%.*s\n", indent, (int)(end - formula), formula);
    formula = end + 1 + strspn(end + 1, " ");
  }
  zs_text_format(text, "%s%s = %s\n", indent, left, formula);
}

static void put_variant(zs_text *text, const zs_variant *variant)
{
  if (variant->attribute)
    zs_text_format(text, "%s=\"%s\":\n", variant->attribute, variant->choice);
  put_definition(text, variant->attribute ? "  " : "", "f", variant->formula);
}

static void put_formula(zs_text *text, const zs_kind *kind)
{
  static const char *const axes[] = {"x'", "y'", "z'"};
  bool maps = kind->map[0];
  bool varies = kind->variants && kind->variants->formula;
  if (!maps && !varies && !kind->formula)
    return;
  zs_text_add(text, "\n```\n");
  for (int k = 0; maps && k < 3; k++)
    put_definition(text, "", axes[k], kind->map[k]);
  if (kind->formula)
    put_definition(text, "", "f", kind->formula);
  for (const zs_variant *v = kind->variants; varies && v->formula; v++)
    put_variant(text, v);
  zs_text_add(text, "```\n");
}

static void put_children(zs_text *text, const zs_kind *kind)
{
  static const char *const rules[] = {
    [ZS_CHILDREN_NONE] = NULL,
    [ZS_CHILDREN_ONE] = "one node; several are joined as their union",
    [ZS_CHILDREN_MANY] = "one or more nodes",
    [ZS_CHILDREN_TWO] = "two or more nodes"};
  const char *rule = rules[kind->children];
  if (kind == &zs_document_scene)
    rule = "any number of nodes";
  if (!rule && !kind->parts)
    return;
  zs_text_format(text, "\n**Inside it:** %s", rule ? rule : "");
  const char *separator = rule ? "; and " : "";
  for (const zs_kind *const *part = kind->parts; part && *part; part++) {
    zs_text_format(text, "%s`%s`", separator, (*part)->name);
    separator = ", ";
  }
  zs_text_add(text, ".\n");
}

static void put_capital(zs_text *text, const char *string)
{
  char first = *string >= 'a' && *string <= 'z' ? (char)(*string - 'a' + 'A') : *string;
  zs_text_add_bytes(text, &first, 1);
  zs_text_add(text, string + 1);
}

static void put_section(zs_text *text, const zs_kind *kind, int level)
{
  for (int i = 0; i < level; i++)
    zs_text_add(text, "#");
  zs_text_format(text, " `%s`\n\n", kind->name);
  put_capital(text, kind->summary);
  zs_text_format(text, ".%s%s\n", kind->doc ? " " : "", kind->doc ? kind->doc : "");
  put_formula(text, kind);
  put_attributes(text, kind->attributes, kind->attribute_count);
  put_children(text, kind);
  if (kind->trait)
    zs_text_format(text, "\n**Value:** %s.\n", kind->trait);
  if (kind->source)
    zs_text_format(text, "\n**Source:** %s.\n", kind->source);
}

static bool has_part(const zs_kind *kind, const zs_kind *part)
{
  for (const zs_kind *const *p = kind ? kind->parts : NULL; p && *p; p++)
    if (*p == part)
      return true;
  return false;
}

/* The section of an element, and of its parts unless the element around it,
 * `owner`, has the same ones. */
static void put_kind(zs_text *text, const zs_kind *kind, const zs_kind *owner, int level)
{
  put_section(text, kind, level);
  for (const zs_kind *const *part = kind->parts; part && *part; part++) {
    if (has_part(owner, *part))
      continue;
    zs_text_add(text, "\n");
    put_kind(text, *part, kind, level + 1);
  }
}

void zs_manual_write_kind(zs_text *text, const zs_kind *kind, int level)
{
  put_kind(text, kind, NULL, level);
}

/* ---- The whole -------------------------------------------------------------- */

typedef struct family {
  const char *title, *introduction; /* NULL: none */
} family;

static const family families[ZS_FAMILY_COUNT] = {
  [ZS_FAMILY_PRIMITIVE] = {"Primitives",
                           "Solids that sit at the origin; `at`, `rotate` and `scale` put them "
                           "elsewhere. Those with a `height` or a `size` are centred."},
  [ZS_FAMILY_SHAPE] = {"2D shapes", "Solids that do not depend on z: endless in both directions "
                                    "until something cuts or extrudes them."},
  [ZS_FAMILY_SOLID_FROM_SHAPE] = {"Solids from shapes", NULL},
  [ZS_FAMILY_SET] = {"Set operations",
                     "In the formulas, a and b are the values of two children. With more of them, "
                     "a is the result so far and b the next child, in document order."},
  [ZS_FAMILY_BLEND] = {"Blends", "Set operations with a rounded seam; a and b as above."},
  [ZS_FAMILY_FUNCTION_MAP] = {"Function maps", "They change the value of their child, f."},
  [ZS_FAMILY_COORDINATE_MAP] = {"Coordinate maps",
                                "The child is evaluated at (x', y', z'): the formulas are those of "
                                "the inverse map, from a point of the result to one of the child."},
  [ZS_FAMILY_INTERPOLATION] = {"Interpolation and metamorphosis", NULL},
  [ZS_FAMILY_DATA] = {"Data", NULL},
};

static const char introduction[] =
  "# The elements of the scene language\n"
  "\n"
  "Generated from the program's tables (`make regen`); `zeroset nodes NAME` prints one section. "
  "How a scene is put together is told in [language.md](language.md).\n"
  "\n"
  "A point is inside a solid where f ≥ 0. Angles of attributes are in degrees; lengths are in the "
  "scene's unit. Any number may be an expression in braces, and an attribute that has a default, "
  "or a blank there, may be left out. *Exact distance* means that f is the distance to the "
  "surface, positive inside; a *distance bound* is never more than that in magnitude, and has its "
  "sign. Formulas are in the expression language; attributes are called by their names there, "
  "with `_` for `-`.\n"
  "\n"
  "Every node takes these three attributes beside its own:\n";

static void put_family(zs_text *text, zs_family family)
{
  bool any = false;
  for (const zs_kind *const *kind = zs_kinds; *kind; kind++) {
    if ((*kind)->family != family)
      continue;
    if (!any) {
      zs_text_format(text, "\n## %s\n", families[family].title);
      if (families[family].introduction)
        zs_text_format(text, "\n%s\n", families[family].introduction);
    }
    any = true;
    zs_text_add(text, "\n");
    zs_manual_write_kind(text, *kind, 3);
  }
}

void zs_manual_write(zs_text *text)
{
  zs_text_add(text, introduction);
  put_attributes(text, zs_placement_attributes, ZS_PLACEMENT_ATTRIBUTES);
  zs_text_add(text, "\n## The document\n");
  for (const zs_kind *const *kind = zs_document_kinds; *kind; kind++) {
    zs_text_add(text, "\n");
    put_section(text, *kind, 3);
  }
  for (int i = 0; i < ZS_FAMILY_COUNT; i++)
    put_family(text, (zs_family)i);
}

static void put_line(zs_text *text, const zs_kind *kind)
{
  zs_text_format(text, "%-20s %s\n", kind->name, kind->summary);
}

void zs_manual_write_summary(zs_text *text)
{
  for (const zs_kind *const *kind = zs_kinds; *kind; kind++)
    put_line(text, *kind);
  for (const zs_kind *const *kind = zs_document_kinds; *kind; kind++)
    put_line(text, *kind);
}
