/* The XML layer: exact places of everything, in documents made at random. */
#include "base/xml.h"

#include "../random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "../scene/print.h"

#include <cmocka.h>

/* ---- Documents with known places ---------------------------------------- */

typedef struct known {
  uint32_t line, column;
  size_t attributes;
  struct {
    uint32_t line, column;
    char value[32];
  } attribute[4];
} known;

typedef struct writer {
  char *text;
  size_t length, capacity;
  uint32_t line, column;
  known *elements;
  size_t count;
  uint64_t seed;
} writer;

static void put(writer *w, const char *text)
{
  size_t n = strlen(text);
  assert_true(w->length + n < w->capacity);
  memcpy(w->text + w->length, text, n);
  w->length += n;
  for (; *text; text++) {
    if (*text == '\n') {
      w->line++;
      w->column = 1;
    } else if (((unsigned char)*text & 0xC0) != 0x80) {
      w->column++;
    }
  }
}

static void put_filler(writer *w)
{
  static const char *const fillers[] = {
    "", "\n", "  ", "\r\n\t", "<!-- <sphere/> \xE2\x82\xAC -->", "<?pi a=\"b\"?>",
    "<f:g xmlns:f=\"urn:else\" a='1'>text<b c=\"d\"/></f:g>"};
  put(w, fillers[random_below(&w->seed, 7)]);
}

static void put_space(writer *w)
{
  static const char *const spaces[] = {" ", "\n  ", "\t", "\r\n"};
  put(w, spaces[random_below(&w->seed, 4)]);
}

static void put_attribute(writer *w, known *k)
{
  static const struct {
    const char *written, *value;
  } values[] = {{"1", "1"},         {"a b", "a b"},          {"\xC3\xA9", "\xC3\xA9"},
                {"a&amp;b", "a&b"}, {"&lt;&#38;&#xE9;", "<&\xC3\xA9"}, {"1\n2", "1 2"},
                {"", ""},           {"&amp;#38;", "&#38;"}};
  unsigned v = random_below(&w->seed, 8);
  char name[16];
  put_space(w);
  if (k->attributes == 1) {
    put(w, "xmlns:q='urn:q'");
    put_space(w);
  }
  snprintf(name, sizeof name, "a%zu", k->attributes);
  put(w, name);
  put(w, random_below(&w->seed, 2) ? "=" : " = ");
  const char *quote = random_below(&w->seed, 2) ? "\"" : "'";
  put(w, quote);
  k->attribute[k->attributes].line = w->line;
  k->attribute[k->attributes].column = w->column;
  strcpy(k->attribute[k->attributes].value, values[v].value);
  k->attributes++;
  put(w, values[v].written);
  put(w, quote);
}

static void put_element(writer *w, unsigned depth)
{
  known *k = &w->elements[w->count++];
  k->line = w->line;
  k->column = w->column;
  put(w, depth ? "<node" : "<scene");
  for (unsigned n = random_below(&w->seed, 4); n > 0; n--)
    put_attribute(w, k);
  if (random_below(&w->seed, 3) == 0)
    put(w, " xml:id=\"x\"");
  put(w, random_below(&w->seed, 2) ? ">" : "\n>");
  put_filler(w);
  for (unsigned n = depth < 5 ? random_below(&w->seed, 4) : 0; n > 0; n--) {
    put_element(w, depth + 1);
    put_filler(w);
  }
  put(w, depth ? "</node>" : "</scene>");
}

static void check_element(const zs_element *element, const known *elements, size_t *index)
{
  const known *k = &elements[(*index)++];
  assert_int_equal(element->line, k->line);
  assert_int_equal(element->column, k->column);
  assert_int_equal(element->attribute_count, k->attributes);
  for (size_t i = 0; i < k->attributes; i++) {
    const zs_xml_attribute *a = &element->attributes[i];
    assert_string_equal(a->value, k->attribute[i].value);
    assert_int_equal(a->length, strlen(a->value));
    assert_int_equal(a->line, k->attribute[i].line);
    assert_int_equal(a->column, k->attribute[i].column);
  }
  for (const zs_element *child = element->first; child; child = child->next) {
    assert_ptr_equal(child->parent, element);
    check_element(child, elements, index);
  }
}

static void test_places_in_random_documents(void **state)
{
  (void)state;
  writer w = {.text = malloc(1 << 20), .capacity = 1 << 20,
              .elements = calloc(20000, sizeof(known))};
  size_t total = 0;
  for (uint64_t seed = 0; seed < 300; seed++) {
    w.length = w.count = 0;
    w.line = w.column = 1;
    w.seed = seed;
    memset(w.elements, 0, 20000 * sizeof(known));
    put(&w, "<?xml version='1.0' encoding=\"UTF-8\"?>\n");
    put_element(&w, 0);
    zs_source source = {.name = "random.xml", .text = w.text, .length = w.length};
    zs_arena arena = {0};
    printed p = {.length = 0};
    zs_diag diag = {.report = print_diagnostic, .context = &p};
    const zs_element *root = zs_xml_parse(&source, &zs_xml_scene, 256, &arena, &diag);
    if (!root)
      fail_msg("%s in\n%.*s", p.text, (int)w.length, w.text);
    size_t index = 0;
    check_element(root, w.elements, &index);
    assert_int_equal(index, w.count);
    total += index;
    zs_arena_free(&arena);
  }
  assert_true(total > 3000);
  free(w.text);
  free(w.elements);
}

/* ---- Single cases ------------------------------------------------------- */

static const zs_element *parse(const char *text, zs_source *source, zs_arena *arena)
{
  static printed p;
  p.length = 0;
  zs_diag diag = {.report = print_diagnostic, .context = &p};
  *source = (zs_source){.name = "x.xml", .text = text, .length = strlen(text)};
  const zs_element *root = zs_xml_parse(source, &zs_xml_scene, 256, arena, &diag);
  if (!root)
    fail_msg("%s", p.text);
  return root;
}

static void test_places_inside_values(void **state)
{
  (void)state;
  zs_arena arena = {0};
  zs_source source;
  const zs_element *root = parse("<scene a='x&lt;y&#xE9;z\n w'/>", &source, &arena);
  /* Byte offsets of x < y e-acute z newline space w, and their columns. */
  static const struct {
    size_t at;
    uint32_t line, column;
  } cases[] = {{0, 1, 11}, {1, 1, 12}, {2, 1, 16}, {3, 1, 17}, {5, 1, 23},
               {6, 1, 24}, {7, 2, 1},  {8, 2, 2},  {9, 2, 3},  {99, 2, 3}};
  assert_string_equal(root->attributes[0].value, "x<y\xC3\xA9z  w");
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    zs_place place = zs_attribute_place(root, &root->attributes[0], cases[i].at);
    assert_int_equal(place.line, cases[i].line);
    assert_int_equal(place.column, cases[i].column);
  }
  zs_place name = zs_attribute_name_place(root, &root->attributes[0]);
  assert_int_equal(name.column, 8);
  zs_arena_free(&arena);
}

static void test_text(void **state)
{
  (void)state;
  zs_arena arena = {0};
  zs_source source;
  const zs_element *root = parse("<scene>\n <a> x &lt; <!-- y -->y\r\n<![CDATA[&& <z>]]> \xC3\xA9 w"
                                 "</a><b>  \n </b></scene>",
                                 &source, &arena);
  const zs_element *a = root->first, *b = a->next;
  assert_null(root->text);
  assert_null(b->text);
  assert_int_equal(a->text_length, strlen(a->text));
  assert_string_equal(a->text, " x < y\n&& <z> \xC3\xA9 w");
  static const struct {
    char character;
    uint32_t line, column;
  } cases[] = {{'x', 2, 6}, {'<', 2, 8}, {'y', 2, 23}, {'&', 3, 10}, {'z', 3, 14}, {'w', 3, 22}};
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    zs_place place = zs_text_place(a, (size_t)(strchr(a->text, cases[i].character) - a->text));
    assert_int_equal(place.line, cases[i].line);
    assert_int_equal(place.column, cases[i].column);
  }
  zs_arena_free(&arena);
}

static void test_namespaces(void **state)
{
  (void)state;
  zs_arena arena = {0};
  zs_source source;
  const zs_element *root =
    parse("<z:scene xmlns:z='" ZS_NAMESPACE "' xmlns:o='urn:other' o:a='1' b='2' z:c='3'>"
          "<z:sphere/><o:sphere><z:box/></o:sphere><torus/></z:scene>",
          &source, &arena);
  assert_string_equal(root->name, "scene");
  assert_int_equal(root->attribute_count, 2);
  assert_string_equal(root->attributes[0].name, "b");
  assert_string_equal(root->attributes[1].name, "c");
  assert_string_equal(root->first->name, "sphere");
  assert_string_equal(root->first->next->name, "torus");
  assert_null(root->first->next->next);
  zs_arena_free(&arena);
}

static void test_byte_order_mark(void **state)
{
  (void)state;
  zs_arena arena = {0};
  zs_source source;
  const zs_element *root = parse("\xEF\xBB\xBF<scene a=\"1\"/>", &source, &arena);
  assert_int_equal(root->column, 1);
  assert_int_equal(root->attributes[0].column, 11);
  zs_arena_free(&arena);
}

/* libxml2 itself cannot count lines so far. */
static void test_many_lines(void **state)
{
  (void)state;
  enum { LINES = 100000 };
  char *text = malloc(LINES + 64);
  size_t n = (size_t)sprintf(text, "<scene>");
  memset(text + n, '\n', LINES);
  strcpy(text + n + LINES, " <sphere radius='1'/></scene>");
  zs_arena arena = {0};
  zs_source source;
  const zs_element *root = parse(text, &source, &arena);
  assert_int_equal(root->first->line, LINES + 1);
  assert_int_equal(root->first->attributes[0].line, LINES + 1);
  assert_int_equal(root->first->attributes[0].column, 18);
  zs_arena_free(&arena);
  free(text);
}

static void test_depth(void **state)
{
  (void)state;
  for (uint32_t limit = 2; limit <= 1000; limit *= 5) {
    for (uint32_t depth = limit - 1; depth <= limit + 1; depth++) {
      char *text = malloc(8 * depth + 1), *at = text;
      for (uint32_t i = 0; i < depth; i++)
        at += sprintf(at, "<a>");
      for (uint32_t i = 0; i < depth; i++)
        at += sprintf(at, "</a>");
      zs_source source = {.name = "x.xml", .text = text, .length = (size_t)(at - text)};
      zs_arena arena = {0};
      zs_diag diag = {0};
      const zs_element *root = zs_xml_parse(&source, &zs_xml_scene, limit, &arena, &diag);
      assert_true((root != NULL) == (depth <= limit));
      assert_int_equal(diag.errors, root ? 0 : 1);
      zs_arena_free(&arena);
      free(text);
    }
  }
}

/* A document that is cut anywhere is refused with one error, and is not read
 * beyond its end. */
static void test_truncated(void **state)
{
  (void)state;
  static const char text[] =
    "<?xml version=\"1.0\" encoding=\"utf-8\"?><!-- c --><scene xmlns='" ZS_NAMESPACE "' units='m'>"
    "<formula lipschitz = \"1\">x &lt; 1<![CDATA[ ? 2 : 3]]>\xC3\xA9</formula><?p q?></scene>";
  for (size_t length = 0; length < sizeof text - 1; length++) {
    char *copy = malloc(length + 1);
    memcpy(copy, text, length);
    zs_source source = {.name = "x.xml", .text = copy, .length = length};
    zs_arena arena = {0};
    zs_diag diag = {0};
    assert_null(zs_xml_parse(&source, &zs_xml_scene, 256, &arena, &diag));
    assert_int_equal(diag.errors, 1);
    zs_arena_free(&arena);
    free(copy);
  }
}

/* Bytes that no text has are found wherever they stand. */
static void test_bad_bytes(void **state)
{
  (void)state;
  for (uint32_t at = 9; at < 40; at++) {
    for (int bad = 0; bad < 2; bad++) {
      char text[] = "<scene><!--..................................................--></scene>";
      text[at] = bad ? '\xFF' : '\0';
      text[at + 3] = '\0'; /* another one behind it is not the first */
      printed p = {.length = 0};
      zs_diag diag = {.report = print_diagnostic, .context = &p};
      zs_source source = {.name = "x.xml", .text = text, .length = sizeof text - 1};
      zs_arena arena = {0};
      assert_null(zs_xml_parse(&source, &zs_xml_scene, 256, &arena, &diag));
      char expected[128];
      snprintf(expected, sizeof expected, "x.xml:1:%u: error: %s\n", at + 1,
               bad ? "not valid UTF-8" : "not a text file: it contains a zero byte");
      assert_string_equal(p.text, expected);
      zs_arena_free(&arena);
    }
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_places_in_random_documents),
    cmocka_unit_test(test_places_inside_values),
    cmocka_unit_test(test_text),
    cmocka_unit_test(test_namespaces),
    cmocka_unit_test(test_byte_order_mark),
    cmocka_unit_test(test_many_lines),
    cmocka_unit_test(test_depth),
    cmocka_unit_test(test_truncated),
    cmocka_unit_test(test_bad_bytes),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
