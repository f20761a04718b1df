/* What loading and compiling take grows like the scene, not like its square.
 * Counted are the bytes that the library asks memory for and those that it
 * searches texts through; no clock. */
#include "zeroset.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include "print.h"

#include <cmocka.h>

/* ---- Counting ------------------------------------------------------------- */

/* The linker sends the library's calls here (--wrap). */
void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *memory, size_t size);
void *__real_aligned_alloc(size_t alignment, size_t size);
void *__real_memchr(const void *bytes, int wanted, size_t size);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_realloc(void *memory, size_t size);
void *__wrap_aligned_alloc(size_t alignment, size_t size);
void *__wrap_memchr(const void *bytes, int wanted, size_t size);

static double asked, searched;

void *__wrap_malloc(size_t size)
{
  asked += (double)size;
  return __real_malloc(size);
}

void *__wrap_calloc(size_t count, size_t size)
{
  asked += (double)count * (double)size;
  return __real_calloc(count, size);
}

void *__wrap_realloc(void *memory, size_t size)
{
  asked += (double)size;
  return __real_realloc(memory, size);
}

void *__wrap_aligned_alloc(size_t alignment, size_t size)
{
  asked += (double)size;
  return __real_aligned_alloc(alignment, size);
}

void *__wrap_memchr(const void *bytes, int wanted, size_t size)
{
  const char *found = __real_memchr(bytes, wanted, size);
  searched += found ? (double)(found - (const char *)bytes + 1) : (double)size;
  return (void *)found;
}

/* ---- Scenes ---------------------------------------------------------------- */

typedef struct text {
  char *bytes;
  size_t length, capacity;
} text;

__attribute__((format(printf, 2, 3))) static void put(text *t, const char *format, ...)
{
  va_list arguments;
  va_start(arguments, format);
  t->length += (size_t)vsnprintf(t->bytes + t->length, t->capacity - t->length, format, arguments);
  va_end(arguments);
  assert_true(t->length < t->capacity);
}

static void siblings(text *t, unsigned n)
{
  put(t, "<union>");
  for (unsigned i = 0; i < n; i++)
    put(t, "<sphere radius='0.5' at='%u 0 0'/>\n", i);
  put(t, "</union>");
}

static void repeated(text *t, unsigned n)
{
  put(t, "<union><repeat for='i' from='1' to='%u'><sphere at='{i} 0 0'/></repeat></union>", n);
}

static void used(text *t, unsigned n)
{
  put(t, "<object id='a'><sphere/></object><object id='b'>");
  for (unsigned i = 0; i < n; i++)
    put(t, "<use object='a' at='%u 0 0'/>\n", i);
  put(t, "</object>");
}

static void objects(text *t, unsigned n)
{
  for (unsigned i = 0; i < n; i++)
    put(t, "<object id='o%u'><sphere radius='%u'/></object>\n", i, i + 1);
}

static void instances(text *t, unsigned n)
{
  put(t, "<define name='ball'><argument name='r'/><sphere radius='{r}'/></define>");
  for (unsigned i = 0; i < n; i++)
    put(t, "<instance of='ball' r='%u'/>\n", i + 1);
}

static void parameters(text *t, unsigned n)
{
  put(t, "<param name='p0' value='1'/>\n");
  for (unsigned i = 1; i < n; i++)
    put(t, "<param name='p%u' value='{p%u + 1}'/>\n", i, i - 1);
  put(t, "<sphere radius='{p%u}'/>", n - 1);
}

static void nests(text *t, unsigned n)
{
  enum { DEPTH = 200 };
  for (unsigned i = 0; i < n / DEPTH; i++) {
    for (unsigned d = 0; d < DEPTH; d++)
      put(t, "<translate by='1 0 0'>");
    put(t, "<sphere/>");
    for (unsigned d = 0; d < DEPTH; d++)
      put(t, "</translate>");
  }
}

static void formula(text *t, unsigned n)
{
  put(t, "<formula>let a0 = x;\n");
  for (unsigned i = 1; i < n; i++)
    put(t, "let a%u = a%u * y + %u;\n", i, i - 1, i);
  put(t, "a%u</formula>", n - 1);
}

static void expressions(text *t, unsigned n)
{
  put(t, "<polygon points='");
  for (unsigned i = 0; i < n; i++)
    put(t, "{%u} {%u^2}\n", i, i);
  put(t, "'/>");
}

static void mistakes(text *t, unsigned n)
{
  put(t, "<union>");
  for (unsigned i = 0; i < n; i++)
    put(t, "<sphere radios='0.5'/>\n");
  put(t, "</union>");
}

/* Load and check a scene of n parts; returns what that took. */
static double work(void (*write)(text *, unsigned), unsigned n, unsigned errors)
{
  text t = {.capacity = 100 * (size_t)n + 1000};
  t.bytes = malloc(t.capacity);
  assert_non_null(t.bytes);
  put(&t, "<scene><domain min='-1 -1 -1' max='1 1 1'/>");
  write(&t, n);
  put(&t, "</scene>");
  printed p = {.length = 0};
  zs_diag diag = {.report = print_diagnostic, .context = &p};
  asked = searched = 0;
  zs_scene *scene = zs_scene_parse(t.bytes, t.length, "x.xml", NULL, &diag);
  if (scene)
    zs_scene_check(scene, NULL, &diag);
  double sum = asked + searched;
  if (diag.errors != errors)
    fail_msg("%u errors: %s", diag.errors, p.text);
  zs_scene_free(scene);
  free(t.bytes);
  return sum;
}

static void test_growth(void **state)
{
  (void)state;
  static const struct {
    const char *name;
    void (*write)(text *, unsigned);
    bool wrong; /* an error in every part */
  } scenes[] = {
    {"siblings", siblings, false},     {"repeated", repeated, false},
    {"used", used, false},             {"objects", objects, false},
    {"instances", instances, false},   {"parameters", parameters, false},
    {"nests", nests, false},           {"formula", formula, false},
    {"expressions", expressions, false}, {"mistakes", mistakes, true},
  };
  enum { FEW = 2000, FACTOR = 16 };
  for (size_t i = 0; i < sizeof scenes / sizeof scenes[0]; i++) {
    double little = work(scenes[i].write, FEW, scenes[i].wrong ? FEW : 0);
    double much = work(scenes[i].write, FEW * FACTOR, scenes[i].wrong ? FEW * FACTOR : 0);
    /* Memory is asked for in powers of two: up to twice of either may be idle. */
    if (!(much <= 2.5 * FACTOR * little))
      fail_msg("%s: %g bytes for %d, %g for %d", scenes[i].name, little, FEW, much, FEW * FACTOR);
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_growth)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
