/* Arithmetic expressions as authors write them: parsed once into a flat list
 * in evaluation order, then evaluated to a number (attributes) or lowered to
 * operations (formulas).  Grammar and functions: the scene language manual. */
#ifndef ZS_EXPRESSION_H
#define ZS_EXPRESSION_H

#include "base/arena.h"

#include <stdint.h>

/* The scalar functions.  Comparisons give 1 or 0; SELECT(c, a, b) is a where
 * c is not 0. */
typedef enum zs_function {
  ZS_FUNCTION_NUMBER,   /* expression.number */
  ZS_FUNCTION_VARIABLE, /* operand[0] is the index of the variable */
  ZS_FUNCTION_ADD, ZS_FUNCTION_SUBTRACT, ZS_FUNCTION_MULTIPLY, ZS_FUNCTION_DIVIDE,
  ZS_FUNCTION_POWER, ZS_FUNCTION_MODULO, /* modulo has the divisor's sign: a - b floor(a / b) */
  ZS_FUNCTION_MINIMUM, ZS_FUNCTION_MAXIMUM, ZS_FUNCTION_ATAN2, ZS_FUNCTION_HYPOT,
  ZS_FUNCTION_LESS, ZS_FUNCTION_LESS_EQUAL, ZS_FUNCTION_EQUAL, ZS_FUNCTION_NOT_EQUAL,
  ZS_FUNCTION_NEGATE, ZS_FUNCTION_ABSOLUTE, ZS_FUNCTION_SQUARE, ZS_FUNCTION_SQUARE_ROOT,
  ZS_FUNCTION_EXPONENTIAL, ZS_FUNCTION_LOGARITHM, ZS_FUNCTION_SINE, ZS_FUNCTION_COSINE,
  ZS_FUNCTION_TANGENT, ZS_FUNCTION_ARC_SINE, ZS_FUNCTION_ARC_COSINE, ZS_FUNCTION_ARC_TANGENT,
  ZS_FUNCTION_FLOOR, ZS_FUNCTION_CEILING, ZS_FUNCTION_ROUND, ZS_FUNCTION_SIGN,
  ZS_FUNCTION_SELECT,
  ZS_FUNCTION_COUNT
} zs_function;

/* Number of operands of a function, and its name in listings. */
unsigned zs_function_arity(zs_function function);
const char *zs_function_name(zs_function function);

/* The value of a function: the definition that everything else is held to. */
double zs_function_value(zs_function function, double a, double b, double c);

typedef struct zs_expression_node {
  zs_function function;
  uint32_t operand[3]; /* earlier nodes of the list */
  double number;
} zs_expression_node;

typedef struct zs_expression {
  const zs_expression_node *nodes;
  uint32_t count;                /* the last node is the result */
  const char *const *variables;  /* distinct names that are not bound by let */
  const uint32_t *variable_offsets; /* where each is first named, bytes into the text */
  uint32_t variable_count;
} zs_expression;

typedef struct zs_expression_error {
  size_t offset;      /* bytes into the text */
  char message[160];  /* "expected ')'" */
  bool memory;        /* there is nothing wrong with the text: memory is out */
} zs_expression_error;

/* Parse `length` bytes.  `pi` and the functions are known; every other name is
 * a variable (dots are allowed inside names: `size.x`).  Linear time; nesting
 * is bounded.  NULL with the error filled in. */
const zs_expression *zs_expression_parse(zs_arena *arena, const char *text, size_t length,
                                         zs_expression_error *error);

/* Evaluate with values[i] for variable i.  `scratch` holds count doubles. */
double zs_expression_value(const zs_expression *expression, const double *values, double *scratch);

/* Names of the functions that authors may call, for suggestions. */
extern const char *const zs_expression_function_names[];
extern const size_t zs_expression_function_count;

/* Locale-free decimal number at the start of `text`: returns its length in
 * bytes, 0 if there is none.  Never reads past `length`. */
size_t zs_number_parse(const char *text, size_t length, double *value);

#endif
