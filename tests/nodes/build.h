/* Trees of nodes built by hand, without the scene reader, for tests. */
#ifndef ZS_TEST_BUILD_H
#define ZS_TEST_BUILD_H

#include "../random.h"

#include "nodes/kind.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static inline const zs_attribute *attribute_named(const zs_kind *kind, const char *name)
{
  for (size_t i = 0; i < kind->attribute_count; i++)
    if (!strcmp(kind->attributes[i].name, name))
      return &kind->attributes[i];
  fail_msg("<%s> has no attribute '%s'", kind->name, name);
  return NULL;
}

static inline void *field_of(const zs_node *node, const zs_attribute *attribute)
{
  return (unsigned char *)node->parameters + attribute->offset;
}

static inline void mark_given(zs_node *node, const zs_attribute *attribute)
{
  node->given |= UINT64_C(1) << (attribute - node->kind->attributes);
}

/* How many doubles an attribute of numbers has, 0 for other types. */
static inline int components(const zs_attribute *attribute)
{
  switch (attribute->type) {
  case ZS_NUMBER:
    return 1;
  case ZS_VECTOR2:
    return 2;
  case ZS_VECTOR3:
  case ZS_SCALE:
    return 3;
  default:
    return 0;
  }
}

/* Numbers separated by spaces; returns how many. */
static inline int parse_numbers(const char *text, double *values, int most)
{
  int count = 0;
  while (*text && count < most) {
    size_t used = zs_number_parse(text, strlen(text), &values[count]);
    if (!used)
      return -1;
    text += used;
    text += strspn(text, " ");
    count++;
  }
  return *text ? -1 : count;
}

/* Index of a choice, -1 if there is none of that name. */
static inline int choice_index(const zs_attribute *attribute, const char *choice)
{
  for (int i = 0; attribute->choices[i]; i++)
    if (!strcmp(attribute->choices[i], choice))
      return i;
  return -1;
}

/* Whether the default is a word that stands for a number. */
static inline bool is_word(const zs_attribute *attribute)
{
  return attribute->type == ZS_NUMBER && attribute->choices && attribute->initial &&
         choice_index(attribute, attribute->initial) >= 0;
}

static inline void set_default(zs_node *node, const zs_attribute *attribute)
{
  void *field = field_of(node, attribute);
  const int count = components(attribute);
  if (!attribute->initial || !*attribute->initial || is_word(attribute)) {
    for (int i = 0; i < count; i++)
      ((double *)field)[i] = NAN;
    return;
  }
  double values[3];
  if (count) {
    int read = parse_numbers(attribute->initial, values, 3);
    for (int i = 0; i < count; i++)
      ((double *)field)[i] = values[read == 1 ? 0 : i];
  } else if (attribute->type == ZS_INTEGER) {
    parse_numbers(attribute->initial, values, 1);
    *(int *)field = (int)values[0];
  } else if (attribute->type == ZS_CHOICE) {
    *(int *)field = choice_index(attribute, attribute->initial);
  } else if (attribute->type == ZS_BOOLEAN) {
    *(bool *)field = !strcmp(attribute->initial, "true");
  }
}

static inline zs_node *node_of_kind(zs_arena *arena, const zs_kind *kind)
{
  zs_node *node = ZS_ARENA_NEW(arena, zs_node, 1);
  node->kind = kind;
  node->parameters = zs_arena_alloc(arena, 1, kind->parameters_size ? kind->parameters_size : 1);
  node->placement_scale = 1;
  node->place.element = kind->name;
  for (size_t i = 0; i < kind->attribute_count; i++)
    set_default(node, &kind->attributes[i]);
  return node;
}

static inline zs_node *node_named(zs_arena *arena, const char *name)
{
  const zs_kind *kind = zs_kind_find(name);
  if (!kind)
    fail_msg("there is no <%s>", name);
  return node_of_kind(arena, kind);
}

static inline zs_node *set_vector(zs_node *node, const char *name, const double *values)
{
  const zs_attribute *attribute = attribute_named(node->kind, name);
  memcpy(field_of(node, attribute), values, (size_t)components(attribute) * sizeof *values);
  mark_given(node, attribute);
  return node;
}

static inline zs_node *set(zs_node *node, const char *name, double value)
{
  const zs_attribute *attribute = attribute_named(node->kind, name);
  if (attribute->type == ZS_INTEGER)
    *(int *)field_of(node, attribute) = (int)value;
  else
    *(double *)field_of(node, attribute) = value;
  mark_given(node, attribute);
  return node;
}

static inline zs_node *set3(zs_node *node, const char *name, double x, double y, double z)
{
  const double values[3] = {x, y, z};
  return set_vector(node, name, values);
}

static inline zs_node *choose(zs_node *node, const char *name, const char *choice)
{
  const zs_attribute *attribute = attribute_named(node->kind, name);
  int index = choice_index(attribute, choice);
  assert_true(index >= 0);
  *(int *)field_of(node, attribute) = index;
  mark_given(node, attribute);
  return node;
}

static inline zs_node *set_numbers(zs_arena *arena, zs_node *node, const char *name,
                                   const double *values, size_t count)
{
  const zs_attribute *attribute = attribute_named(node->kind, name);
  double *copy = ZS_ARENA_NEW(arena, double, count);
  memcpy(copy, values, count * sizeof *values);
  *(zs_numbers *)field_of(node, attribute) = (zs_numbers){copy, count};
  mark_given(node, attribute);
  return node;
}

/* A formula in x, y, z and f. */
static inline zs_node *set_formula(zs_arena *arena, zs_node *node, const char *name,
                                   const char *text)
{
  const zs_attribute *attribute = attribute_named(node->kind, name);
  zs_expression_error error;
  const zs_expression *e = zs_expression_parse(arena, text, strlen(text), &error);
  if (!e)
    fail_msg("%s: %s", text, error.message);
  int *axis = ZS_ARENA_NEW(arena, int, e->variable_count + 1);
  for (uint32_t i = 0; i < e->variable_count; i++)
    axis[i] = e->variables[i][0] == 'f' ? 3 : e->variables[i][0] - 'x';
  *(zs_formula *)field_of(node, attribute) = (zs_formula){.expression = e, .axis = axis};
  mark_given(node, attribute);
  return node;
}

/* Add a child behind those it has. */
static inline zs_node *adopt(zs_arena *arena, zs_node *node, zs_node *child)
{
  zs_node **children = ZS_ARENA_NEW(arena, zs_node *, node->child_count + 1);
  for (size_t i = 0; i < node->child_count; i++)
    children[i] = node->children[i];
  children[node->child_count++] = child;
  node->children = children;
  return node;
}

/* Place a node: the inverse of a rotation about z, a factor, and a move. */
static inline zs_node *place_at(zs_arena *arena, zs_node *node, const double at[3], double degrees,
                                double scale)
{
  double *m = ZS_ARENA_NEW(arena, double, 12);
  const double c = cos(degrees * 3.14159265358979323846 / 180) / scale;
  const double s = sin(degrees * 3.14159265358979323846 / 180) / scale;
  const double rows[9] = {c, s, 0, -s, c, 0, 0, 0, 1 / scale};
  for (int i = 0; i < 3; i++) {
    m[4 * i + 3] = 0;
    for (int j = 0; j < 3; j++) {
      m[4 * i + j] = rows[3 * i + j];
      m[4 * i + 3] -= rows[3 * i + j] * at[j];
    }
  }
  node->placement = m;
  node->placement_scale = scale;
  return node;
}

static inline void print_diagnostic(void *context, const zs_diagnostic *d)
{
  (void)context;
  print_error("<%s> %s: %s\n", d->element ? d->element : "?", d->attribute ? d->attribute : "",
              d->message);
}

/* The root of a tree compiled and ready to evaluate; the field goes with it. */
static inline zs_eval *compiled(const zs_node *node)
{
  zs_diag diag = {.report = print_diagnostic};
  zs_compiler *compiler = zs_compiler_new(NULL, NULL, &diag);
  assert_non_null(compiler);
  zs_coordinates at = zs_coordinates_root();
  zs_value value = zs_node_emit(compiler, node, &at);
  assert_int_equal(diag.errors, 0);
  zs_field *field = zs_compiler_finish(compiler, value, 1);
  assert_non_null(field);
  zs_eval *eval = zs_eval_new(field, &diag);
  assert_non_null(eval);
  zs_field_unref(field);
  return eval;
}

static inline double value_at(zs_eval *eval, double x, double y, double z)
{
  const double point[3] = {x, y, z};
  return zs_eval_point(eval, point);
}

/* Gradient of the double-precision value by central differences; false where
 * the one-sided differences do not agree: at a kink. */
static inline bool difference_gradient(zs_eval *eval, const double p[3], double h, double g[3])
{
  const double f = zs_eval_point(eval, p);
  for (int k = 0; k < 3; k++) {
    double q[3] = {p[0], p[1], p[2]};
    q[k] = p[k] + h;
    const double above = zs_eval_point(eval, q);
    q[k] = p[k] - h;
    const double below = zs_eval_point(eval, q);
    g[k] = (above - below) / (2 * h);
    if (!(fabs(above - 2 * f + below) <= 2e-4 * h * (1 + fabs(g[k]))))
      return false;
  }
  return true;
}

#endif
