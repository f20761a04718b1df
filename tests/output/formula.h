/* Fields for tests, from formulas in x, y and z. */
#ifndef ZS_TEST_FORMULA_H
#define ZS_TEST_FORMULA_H

#include "base/expression.h"
#include "field/compiler.h"
#include "field/program.h"

#include <string.h>

/* The field of a formula moved by `at`, or NULL. */
static inline zs_field *formula_field_at(const char *text, const double at[3])
{
  const double inverse[12] = {1, 0, 0, -at[0], 0, 1, 0, -at[1], 0, 0, 1, -at[2]};
  zs_compiler *compiler = zs_compiler_new(NULL, NULL, NULL);
  if (!compiler)
    return NULL;
  zs_expression_error error;
  const zs_expression *expression =
    zs_expression_parse(zs_compiler_arena(compiler), text, strlen(text), &error);
  if (!expression) {
    zs_compiler_free(compiler);
    return NULL;
  }
  zs_coordinates root = zs_coordinates_root();
  zs_coordinates moved = zs_coordinates_affine(&root, inverse);
  zs_value variables[3];
  for (uint32_t i = 0; i < expression->variable_count; i++)
    variables[i] = zs_emit_coordinate(compiler, &moved, expression->variables[i][0] - 'x');
  zs_value f = zs_emit_expression(compiler, expression, variables);
  return zs_compiler_finish(compiler, f, 1);
}

/* The field of a formula, or NULL. */
static inline zs_field *formula_field(const char *text)
{
  const double nowhere[3] = {0, 0, 0};
  return formula_field_at(text, nowhere);
}

#endif
