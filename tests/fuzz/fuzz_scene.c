/* One input for the scene reader and the expression parser, as libFuzzer gives
 * it.  To run with it:
 *
 *   clang -fsanitize=fuzzer,address,undefined -Isrc tests/fuzz/fuzz_scene.c ...
 *
 * Without, tests/fuzz/test_fuzz.c calls it with the corpus and mutations. */
#include "base/expression.h"
#include "zeroset.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Parse, and evaluate at some values. */
static void run_expression(const char *text, size_t size)
{
  zs_arena arena = {0};
  zs_expression_error error;
  const zs_expression *e = zs_expression_parse(&arena, text, size, &error);
  if (e) {
    double *values = calloc((size_t)e->variable_count + e->count, sizeof *values);
    if (values)
      zs_expression_value(e, values, values + e->variable_count);
    free(values);
  } else if (error.offset > size || !error.message[0]) {
    abort();
  }
  zs_arena_free(&arena);
}

/* Load, compile and evaluate.  A scene is refused if and only if that is
 * reported. */
static void run_scene(const char *text, size_t size)
{
  zs_diag diag = {0};
  zs_scene_options options;
  zs_scene_options_init(&options);
  options.maximum_nodes = 2000;
  zs_scene *scene = zs_scene_parse(text, size, "fuzz.xml", &options, &diag);
  if ((scene == NULL) != (diag.errors > 0))
    abort();
  zs_field *field = scene ? zs_scene_compile(scene, NULL, NULL, &diag) : NULL;
  if (scene && (field == NULL) != (diag.errors > 0))
    abort();
  zs_eval *eval = field ? zs_eval_new(field, &diag) : NULL;
  if (eval)
    zs_eval_point(eval, (const double[3]){0.1, 0.2, 0.3});
  zs_eval_free(eval);
  zs_field_unref(field);
  zs_scene_free(scene);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
  run_expression((const char *)data, size);
  run_scene((const char *)data, size);
  return 0;
}
