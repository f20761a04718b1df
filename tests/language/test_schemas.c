/* The schemas accept and reject what the reader does: for every attribute of
 * every kind, and for a corpus. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "language/documents.h"
#include "scene/document.h"

#include <glob.h>
#include <libxml/parser.h>
#include <libxml/relaxng.h>
#include <libxml/xmlschemas.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- The three judges ------------------------------------------------------ */

static xmlRelaxNG *relaxng;
static xmlSchema *xsd;

static void be_quiet(void *context, const char *format, ...)
{
  (void)context;
  (void)format;
}

static int open_schemas(void **state)
{
  (void)state;
  char *text = zs_document_text(ZS_DOCUMENT_RELAX_NG);
  xmlRelaxNGParserCtxt *relaxng_parser = xmlRelaxNGNewMemParserCtxt(text, (int)strlen(text));
  relaxng = xmlRelaxNGParse(relaxng_parser);
  xmlRelaxNGFreeParserCtxt(relaxng_parser);
  free(text);
  text = zs_document_text(ZS_DOCUMENT_XSD);
  xmlSchemaParserCtxt *xsd_parser = xmlSchemaNewMemParserCtxt(text, (int)strlen(text));
  xsd = xmlSchemaParse(xsd_parser);
  xmlSchemaFreeParserCtxt(xsd_parser);
  free(text);
  return !relaxng || !xsd;
}

static int close_schemas(void **state)
{
  (void)state;
  xmlRelaxNGFree(relaxng);
  xmlSchemaFree(xsd);
  return 0;
}

static bool relaxng_accepts_document(xmlDoc *document)
{
  xmlRelaxNGValidCtxt *context = xmlRelaxNGNewValidCtxt(relaxng);
  xmlRelaxNGSetValidErrors(context, be_quiet, be_quiet, NULL);
  bool good = xmlRelaxNGValidateDoc(context, document) == 0;
  xmlRelaxNGFreeValidCtxt(context);
  return good;
}

static bool xsd_accepts_document(xmlDoc *document)
{
  xmlSchemaValidCtxt *context = xmlSchemaNewValidCtxt(xsd);
  xmlSchemaSetValidErrors(context, be_quiet, be_quiet, NULL);
  bool good = xmlSchemaValidateDoc(context, document) == 0;
  xmlSchemaFreeValidCtxt(context);
  return good;
}

static bool accepts(const char *text, bool (*judge)(xmlDoc *document))
{
  xmlDoc *document = xmlReadMemory(text, (int)strlen(text), "x.xml", NULL,
                                   XML_PARSE_NOERROR | XML_PARSE_NONET);
  bool good = document && judge(document);
  xmlFreeDoc(document);
  return good;
}

static bool relaxng_accepts(const char *text)
{
  return accepts(text, relaxng_accepts_document);
}

static bool xsd_accepts(const char *text)
{
  return accepts(text, xsd_accepts_document);
}

static bool reader_accepts(const char *text)
{
  zs_scene *scene = zs_scene_parse(text, strlen(text), "x.xml", NULL, NULL);
  zs_scene_free(scene);
  return scene != NULL;
}

/* ---- Scenes made from the tables -------------------------------------------- */

enum { TEXT_SIZE = 4096 };

/* What makes an element valid where its table alone does not say. */
static const struct {
  const char *kind, *attribute, *value;
} sample_values[] = {
  {"lattice-warp", "max", "4 5 6"},
  {"extrude", "height", "1"},
  {"matrix", "values", "1 0 0 0 0 1 0 0 0 0 1 0"},
  {"path", "d", "M0 0H1V1Z"},
  {"polygon", "points", "0 0 1 0 0 1"},
  {"quadric", "constant", "1"},
  {"quadric", "squares", "-1 -1 -1"},
  {"regular-polygon", "sides", "5"},
  {"slab", "min", "0"},
  {"slab", "max", "1"},
  {"twist", "rate", "1"},
  {"taper", "from", "0"},
  {"taper", "to", "1"},
};

static const struct {
  const char *kind, *body;
} sample_bodies[] = {
  {"bounded-blend", "<sphere/><box/><sphere radius='2'/>"},
  {"convex", "<plane normal='0 0 1'/>"},
  {"convolution", "<segment from='0 0 0' to='1 0 0'/>"},
  {"curved-polygon", "<line to='0 0'/><line to='1 0'/><arc to='0 1' bulge='1'/>"},
  {"distance-morph", "<shape at='0'><sphere/></shape><shape at='1'><box/></shape>"
                     "<pair from='0 0 0' to='1 0 0'/>"},
  {"extrude", "<circle/>"},
  {"fit-points", "<point at='1 0 0'/><sphere/>"},
  {"formula", "1 - x"},
  {"interpolate", "<level at='0'><circle/></level><level at='1'><circle/></level>"},
  {"revolve", "<circle/>"},
  {"soft", "<point/>"},
  {"variational", "<point at='1 0 0' normal='1 0 0'/><point at='-1 0 0' normal='-1 0 0'/>"
                  "<point at='0 1 0' normal='0 1 0'/><point at='0 0 1' normal='0 0 1'/>"},
};

static const char *body_of(const zs_kind *kind)
{
  for (size_t i = 0; i < ZS_COUNT_OF(sample_bodies); i++)
    if (strcmp(sample_bodies[i].kind, kind->name) == 0)
      return sample_bodies[i].body;
  return kind->children == ZS_CHILDREN_NONE  ? ""
         : kind->children == ZS_CHILDREN_ONE ? "<sphere/>"
                                             : "<sphere/><box/>";
}

/* A value that attributes of this type take. */
static const char *value_of_type(const zs_attribute *attribute)
{
  switch (attribute->type) {
  case ZS_NUMBER:
  case ZS_INTEGER:
  case ZS_SCALE:
    return attribute->range == ZS_RANGE_BETWEEN && attribute->minimum > 1 ? "6" : "1";
  case ZS_VECTOR2:
    return "1 2";
  case ZS_VECTOR3:
    return "1 2 3";
  case ZS_NUMBERS:
    return "1 2 3 4";
  case ZS_CHOICE:
    return attribute->choices[0];
  case ZS_BOOLEAN:
    return "true";
  case ZS_FILE:
  case ZS_FILES:
    return "Makefile"; /* of the build folder: a file that is there */
  case ZS_TEXT:
  case ZS_FORMULA:
    break;
  }
  return "x";
}

static bool written(const zs_kind *kind, const zs_attribute *attribute)
{
  return !(kind->text && strcmp(attribute->name, "formula") == 0);
}

/* The value of an attribute in the sample of a kind, or NULL if it is absent. */
static const char *sample_value(const zs_kind *kind, const zs_attribute *attribute)
{
  for (size_t i = 0; i < ZS_COUNT_OF(sample_values); i++)
    if (strcmp(sample_values[i].kind, kind->name) == 0 &&
        strcmp(sample_values[i].attribute, attribute->name) == 0)
      return sample_values[i].value;
  return attribute->initial || !written(kind, attribute) ? NULL : value_of_type(attribute);
}

/* A scene that holds one element of the kind, with `attribute` (unless NULL)
 * written as `value`, or left out when that is NULL, `extra` among its
 * attributes and `child` before its body. */
static void make_scene(char text[TEXT_SIZE], const zs_kind *kind, const zs_attribute *attribute,
                       const char *value, const char *extra, const char *child)
{
  char attributes[TEXT_SIZE / 2] = "";
  size_t used = 0;
  for (size_t i = 0; i < kind->attribute_count; i++) {
    const zs_attribute *a = &kind->attributes[i];
    const char *v = a == attribute ? value : sample_value(kind, a);
    if (v)
      used += (size_t)snprintf(attributes + used, sizeof attributes - used, " %s='%s'", a->name, v);
  }
  snprintf(text, TEXT_SIZE, "<scene xmlns='urn:zeroset:scene:1'><%s%s%s>%s%s</%s></scene>",
           kind->name, attributes, extra, child, body_of(kind), kind->name);
}

static void agree(const char *text, bool expected)
{
  bool reader = reader_accepts(text), rng = relaxng_accepts(text), w3c = xsd_accepts(text);
  if (reader != expected || rng != expected || w3c != expected)
    fail_msg("%s\n%s, but: reader %d, RELAX NG %d, XSD %d", text,
             expected ? "should be accepted" : "should be rejected", reader, rng, w3c);
}

/* What the reader accepts the schemas accept: the reader sees more. */
static void schemas_follow(const char *text)
{
  if (reader_accepts(text))
    agree(text, true);
}

static bool numeric(const zs_attribute *attribute)
{
  return attribute->type <= ZS_SCALE || attribute->type == ZS_NUMBERS;
}

static void test_every_kind_is_accepted(void **state)
{
  (void)state;
  char text[TEXT_SIZE];
  for (const zs_kind *const *kind = zs_kinds; *kind; kind++) {
    make_scene(text, *kind, NULL, NULL, "", "");
    agree(text, true);
    make_scene(text, *kind, NULL, NULL, " at='1,2 , 3' rotate='{1} 0 -9e1' scale='2'", "<!-- -->");
    agree(text, true);
  }
}

static void test_foreign_things_are_ignored(void **state)
{
  (void)state;
  char text[TEXT_SIZE];
  for (const zs_kind *const *kind = zs_kinds; *kind; kind++) {
    make_scene(text, *kind, NULL, NULL, " xmlns:n='urn:n' n:a='?' xml:lang='en'",
               "<n:note a='1'>text <b xmlns=''/> <n:c/></n:note><?p q?>");
    agree(text, true);
  }
}

static void test_unknown_names_are_rejected(void **state)
{
  (void)state;
  char text[TEXT_SIZE];
  for (const zs_kind *const *kind = zs_kinds; *kind; kind++) {
    make_scene(text, *kind, NULL, NULL, " raduis='1'", "");
    agree(text, false);
    make_scene(text, *kind, NULL, NULL, "", "<shpere/>");
    agree(text, false);
    make_scene(text, *kind, NULL, NULL, "", "<object id='o'><sphere/></object>");
    agree(text, false);
    make_scene(text, *kind, NULL, NULL, "", "<sphere xmlns='urn:zeroset:scene:1' />");
    agree(text, (*kind)->children != ZS_CHILDREN_NONE);
  }
}

static void test_text_is_rejected_where_there_is_none(void **state)
{
  (void)state;
  char text[TEXT_SIZE];
  for (const zs_kind *const *kind = zs_kinds; *kind; kind++)
    if (!(*kind)->text) {
      make_scene(text, *kind, NULL, NULL, "", "stray");
      agree(text, false);
    }
}

static void test_missing_children_are_rejected(void **state)
{
  (void)state;
  char text[TEXT_SIZE];
  for (const zs_kind *const *kind = zs_kinds; *kind; kind++) {
    if ((*kind)->children == ZS_CHILDREN_NONE)
      continue;
    char attributes[TEXT_SIZE];
    make_scene(attributes, *kind, NULL, NULL, "", "");
    *strchr(strchr(attributes, '>') + 1, '>') = '\0';
    snprintf(text, sizeof text, "%.4000s/></scene>", attributes);
    agree(text, false);
  }
}

static void each_attribute(void (*test)(const zs_kind *kind, const zs_attribute *attribute))
{
  for (const zs_kind *const *kind = zs_kinds; *kind; kind++)
    for (size_t i = 0; i < (*kind)->attribute_count; i++)
      if (written(*kind, &(*kind)->attributes[i]))
        test(*kind, &(*kind)->attributes[i]);
}

static void required(const zs_kind *kind, const zs_attribute *attribute)
{
  char text[TEXT_SIZE];
  make_scene(text, kind, attribute, NULL, "", "");
  if (!attribute->initial)
    agree(text, false);
  else
    schemas_follow(text);
}

static void test_required_attributes(void **state)
{
  (void)state;
  each_attribute(required);
}

static void malformed(const zs_kind *kind, const zs_attribute *attribute)
{
  static const char *const never[] = {"one", "1 x", "{", "1}", "{1", "--1", "1e", ".", "0x10",
                                      "NaN", "INF", "1;2", "{}"};
  static const char *const counts[] = {"1", "1 2", "1 2 3", "1 2 3 4", "1 2 3 4 5", ""};
  char text[TEXT_SIZE];
  if (!numeric(attribute))
    return;
  for (size_t i = 0; i < ZS_COUNT_OF(never); i++) {
    make_scene(text, kind, attribute, never[i], "", "");
    agree(text, false);
  }
  for (size_t i = 0; i < ZS_COUNT_OF(counts); i++) {
    make_scene(text, kind, attribute, counts[i], "", "");
    bool fits = attribute->type == ZS_NUMBERS || (attribute->type <= ZS_INTEGER && i == 0) ||
                (attribute->type == ZS_VECTOR2 && i == 1) ||
                (attribute->type == ZS_VECTOR3 && i == 2) ||
                (attribute->type == ZS_SCALE && (i == 0 || i == 2));
    if (fits)
      schemas_follow(text);
    else
      agree(text, false);
  }
}

static void test_malformed_numbers(void **state)
{
  (void)state;
  each_attribute(malformed);
}

static void ranges(const zs_kind *kind, const zs_attribute *attribute)
{
  static const struct {
    const char *value;
    int sign;
    bool whole;
  } numbers[] = {{"-1", -1, true},     {"-.5e-3", -1, false}, {"0", 0, true},
                 {"0.00", 0, true},    {"-0", 0, true},       {"0e7", 0, false},
                 {"1", 1, true},       {"+1", 1, true},       {".25", 1, false},
                 {"3.", 1, true},      {"1e-3", 1, false},    {"{1/2}", 1, false},
                 {" 1 ", 1, true},     {"-0.0e1", 0, false},  {"00.10", 1, false},
                 {"{2 + 4}", 1, true}, {"4.0", 1, true},      {"\n2\t", 1, true}};
  char text[TEXT_SIZE];
  if (attribute->type != ZS_NUMBER && attribute->type != ZS_INTEGER)
    return;
  for (size_t i = 0; i < ZS_COUNT_OF(numbers); i++) {
    if (attribute->type == ZS_INTEGER && !numbers[i].whole)
      continue;
    int sign = numbers[i].sign;
    bool outside = (attribute->range == ZS_RANGE_POSITIVE && sign <= 0) ||
                   (attribute->range == ZS_RANGE_NOT_NEGATIVE && sign < 0) ||
                   (attribute->range == ZS_RANGE_NOT_ZERO && sign == 0);
    make_scene(text, kind, attribute, numbers[i].value, "", "");
    if (outside)
      agree(text, false);
    else
      schemas_follow(text);
  }
}

static void test_ranges(void **state)
{
  (void)state;
  each_attribute(ranges);
}

static void limits(const zs_kind *kind, const zs_attribute *attribute)
{
  if (attribute->range != ZS_RANGE_BETWEEN)
    return;
  const double values[] = {attribute->minimum - 1, attribute->maximum + 1, attribute->minimum,
                           attribute->maximum, 0.5 * (attribute->minimum + attribute->maximum)};
  for (size_t i = 0; i < ZS_COUNT_OF(values); i++) {
    char text[TEXT_SIZE], value[32];
    snprintf(value, sizeof value, "%.9g", values[i]);
    make_scene(text, kind, attribute, value, "", "");
    if (i < 2)
      agree(text, false);
    else
      schemas_follow(text);
  }
}

static void test_limits(void **state)
{
  (void)state;
  each_attribute(limits);
}

static void choices(const zs_kind *kind, const zs_attribute *attribute)
{
  char text[TEXT_SIZE];
  if (!attribute->choices)
    return;
  for (const char *const *word = attribute->choices; *word; word++) {
    make_scene(text, kind, attribute, *word, "", "");
    schemas_follow(text);
  }
  make_scene(text, kind, attribute, "nonesuch", "", "");
  agree(text, false);
}

static void test_choices(void **state)
{
  (void)state;
  each_attribute(choices);
}

/* ---- The document elements -------------------------------------------------- */

static const struct {
  bool good;
  const char *text; /* inside <scene> */
} corpus[] = {
  {true, ""},
  {true, "<sphere/>"},
  {true, "<param name='a' value='1'/><sphere radius='{a}'/>"},
  {true, "<param name='a' value='1' min='0' max='2' doc='d'/><sphere/>"},
  {false, "<param value='1'/><sphere/>"},
  {false, "<param name='a'/><sphere/>"},
  {false, "<param name='a' value='b'/><sphere/>"},
  {false, "<param name='a' value='1'><sphere/></param>"},
  {true, "<domain min='0 0 0' max='1 1 1'/><sphere/>"},
  {false, "<domain min='0 0' max='1 1 1'/><sphere/>"},
  {false, "<domain min='0 0 0'/><sphere/>"},
  {true, "<object id='a'><sphere/></object>"},
  {true, "<object id='a' title='t'><sphere/><box/></object>"},
  {false, "<object id='a'></object>"},
  {false, "<object><sphere/></object>"},
  {false, "<object id='a'><object id='b'><sphere/></object></object>"},
  {true, "<object id='a'><use object='b' at='1 2 3'/></object><object id='b'><sphere/></object>"},
  {false, "<object id='a'><use/></object>"},
  {false, "<object id='b'><sphere/></object><use object='b'><sphere/></use>"},
  {true, "<define name='d'><argument name='r'/><argument name='s' value='1'/>"
         "<sphere radius='{r + s}'/></define><instance of='d' r='2' rotate='0 0 90'/>"},
  {true, "<define name='d'><sphere/></define><instance of='d'/>"},
  {false, "<define name='d'><argument name='r'/></define>"},
  {false, "<define><sphere/></define>"},
  {false, "<define name='d'><sphere/></define><instance/>"},
  {false, "<argument name='r' value='1'/>"},
  {true, "<repeat for='i' from='0' to='3'><sphere at='{i} 0 0'/></repeat>"},
  {true, "<union><repeat for='i' from='3' to='0' step='-1'><sphere/><box/></repeat></union>"},
  {false, "<repeat from='0' to='3'><sphere/></repeat>"},
  {false, "<repeat for='i' to='3'><sphere/></repeat>"},
  {false, "<repeat for='i' from='0' to='3' step='0'><sphere/></repeat>"},
  {false, "<repeat for='i' from='0' to='3'/>"},
  {false, "<repeat for='i' from='0' to='3'><object id='a'><sphere/></object></repeat>"},
  {true, "<interpolate><repeat for='i' from='0' to='3'><level at='{i}'><circle/></level></repeat>"
         "</interpolate>"},
  {true, "<interpolate><repeat for='i' from='0' to='1'><repeat for='j' from='0' to='1'>"
         "<level at='{2 * i + j}'><circle/></level></repeat></repeat></interpolate>"},
  {false, "<level at='0'><circle/></level>"},
  {false, "<union><level at='0'><circle/></level><sphere/></union>"},
  {false, "<repeat for='i' from='0' to='3'><level at='{i}'><circle/></level></repeat>"},
  {true, "<view eye='1 2 3' target='0 0 0' up='0 0 1' fov='40'/><sphere/>"},
  {true, "<view id='v' direction='0 1 0'/><sphere/>"},
  {false, "<view eye='1 2'/><sphere/>"},
  {false, "<view eye='1 2 3' fov='180'/><sphere/>"},
  {false, "<include/><sphere/>"},
  {false, "<include href=''/><sphere/>"},
  {false, "<scene/>"},
  {false, "stray<sphere/>"},
  {false, "<sphere xmlns='urn:zeroset:scene:1'>stray</sphere>"},
};

static void judge_corpus(const char *attributes, bool without_xsd)
{
  for (size_t i = 0; i < ZS_COUNT_OF(corpus); i++) {
    char text[TEXT_SIZE];
    snprintf(text, sizeof text, "<scene%s>%s</scene>", attributes, corpus[i].text);
    if (!without_xsd)
      agree(text, corpus[i].good);
    else if (reader_accepts(text) != corpus[i].good || relaxng_accepts(text) != corpus[i].good)
      fail_msg("%s\n%s", text, corpus[i].good ? "should be accepted" : "should be rejected");
  }
}

static void test_corpus(void **state)
{
  (void)state;
  judge_corpus(" xmlns='urn:zeroset:scene:1' units='mm'", false);
}

static void test_corpus_with_a_prefix(void **state)
{
  (void)state;
  const char text[] = "<z:scene xmlns:z='urn:zeroset:scene:1'><z:union><z:sphere radius='1'/>"
                      "</z:union></z:scene>";
  agree(text, true);
}

static void test_a_scene_may_do_without_namespace(void **state)
{
  (void)state;
  judge_corpus("", true);
}

static void test_other_namespaces_are_rejected(void **state)
{
  (void)state;
  agree("<scene xmlns='urn:zeroset:scene:2'><sphere/></scene>", false);
  agree("<sphere xmlns='urn:zeroset:scene:1'/>", false);
}

/* ---- Files -------------------------------------------------------------------- */

static bool accepts_file(const char *path, bool (*judge)(xmlDoc *document))
{
  xmlDoc *document = xmlReadFile(path, NULL, XML_PARSE_NOERROR | XML_PARSE_NONET);
  bool good = document && judge(document);
  xmlFreeDoc(document);
  return good;
}

/* Judge every file of a folder; returns how many there are. */
static size_t judge_files(const char *folder, bool good)
{
  const char *top = getenv("top_srcdir");
  char pattern[4096];
  snprintf(pattern, sizeof pattern, "%s/%s/*.xml", top ? top : ".", folder);
  glob_t files;
  if (glob(pattern, 0, NULL, &files) != 0)
    return 0;
  for (size_t i = 0; i < files.gl_pathc; i++) {
    const char *path = files.gl_pathv[i];
    bool rng = accepts_file(path, relaxng_accepts_document), w3c = accepts_file(path, xsd_accepts_document);
    zs_scene *scene = zs_scene_load(path, NULL, NULL);
    zs_scene_free(scene);
    if ((good || scene) && !(scene && rng && w3c))
      fail_msg("%s: reader %d, RELAX NG %d, XSD %d", path, scene != NULL, rng, w3c);
  }
  size_t count = files.gl_pathc;
  globfree(&files);
  return count;
}

static void test_good_files(void **state)
{
  (void)state;
  assert_true(judge_files("scenes", true) >= 6);
}

/* Scenes of which something else may be wrong than a schema can see. */
static void test_broken_files(void **state)
{
  (void)state;
  assert_true(judge_files("tests/scene/broken", false) >= 30);
}

/* Those that a schema can see, by name. */
static void test_visibly_broken_files(void **state)
{
  (void)state;
  static const char *const names[] = {
    "decimal-comma", "misplaced", "missing-attribute", "misspelt-attribute", "misspelt-choice",
    "misspelt-element", "nan", "negative-length", "no-children", "repeat-step", "several",
    "short-vector", "stray-text", "unclosed-expression", "unit-in-number", "wrong-namespace",
    "wrong-root", "zero-scale"};
  const char *top = getenv("top_srcdir");
  for (size_t i = 0; i < ZS_COUNT_OF(names); i++) {
    char path[4096];
    snprintf(path, sizeof path, "%s/tests/scene/broken/%s.xml", top ? top : ".", names[i]);
    zs_scene *scene = zs_scene_load(path, NULL, NULL);
    assert_null(scene);
    if (accepts_file(path, relaxng_accepts_document) || accepts_file(path, xsd_accepts_document))
      fail_msg("%s is accepted", path);
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_every_kind_is_accepted),
    cmocka_unit_test(test_foreign_things_are_ignored),
    cmocka_unit_test(test_unknown_names_are_rejected),
    cmocka_unit_test(test_text_is_rejected_where_there_is_none),
    cmocka_unit_test(test_missing_children_are_rejected),
    cmocka_unit_test(test_required_attributes),
    cmocka_unit_test(test_malformed_numbers),
    cmocka_unit_test(test_ranges),
    cmocka_unit_test(test_limits),
    cmocka_unit_test(test_choices),
    cmocka_unit_test(test_corpus),
    cmocka_unit_test(test_corpus_with_a_prefix),
    cmocka_unit_test(test_a_scene_may_do_without_namespace),
    cmocka_unit_test(test_other_namespaces_are_rejected),
    cmocka_unit_test(test_good_files),
    cmocka_unit_test(test_broken_files),
    cmocka_unit_test(test_visibly_broken_files),
  };
  return cmocka_run_group_tests(tests, open_schemas, close_schemas);
}
