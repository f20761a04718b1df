#include "field/compiler.h"

#include "base/memory.h"
#include "field/chain.h"
#include "field/field.h"
#include "field/scalar.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* An instruction in the table.  With its hash beside it, most instructions that
 * are not the one looked for need not be fetched. */
typedef struct entry {
  uint32_t hash;
  uint32_t number; /* index + 1; 0: free */
} entry;

struct zs_compiler {
  zs_diag *diag;
  const zs_control *control;
  struct zs_cache *cache;
  void *client;
  zs_field *field; /* under construction; owns the arena */
  bool failed;     /* memory is out */
  zs_instruction *instructions;
  uint32_t count, capacity;
  /* Equal instructions are emitted once, found by an open-addressing table. */
  entry *table;
  uint32_t table_size;
  size_t fit_capacity, correspondence_capacity;
};

enum { FIRST_CAPACITY = 256 };

static bool is_constant(const zs_instruction *instruction)
{
  return instruction->operation == &zs_constant;
}

/* ---- Equal instructions ----------------------------------------------------- */

static uint64_t mix(uint64_t hash, uint64_t word)
{
  hash = (hash ^ word) * UINT64_C(0x9e3779b97f4a7c15);
  return hash ^ (hash >> 29);
}

static uint64_t hash_of(const zs_instruction *i)
{
  uint64_t hash = mix(0, (uintptr_t)i->operation);
  for (int k = 0; k < ZS_MAXIMUM_INPUTS; k++)
    hash = mix(hash, i->in[k]);
  if (!i->operation->data_size)
    return mix(hash, (uintptr_t)i->data);
  const unsigned char *bytes = i->data;
  for (size_t at = 0; at < i->operation->data_size; at += sizeof(uint64_t)) {
    uint64_t word = 0;
    size_t left = i->operation->data_size - at;
    memcpy(&word, bytes + at, left < sizeof word ? left : sizeof word);
    hash = mix(hash, word);
  }
  return hash;
}

static bool equal(const zs_instruction *a, const zs_instruction *b)
{
  return !memcmp(a->in, b->in, sizeof a->in) && zs_instruction_same_operation(a, b);
}

/* The place of an instruction in the table, or the free one it would take. */
static entry *find(const zs_compiler *c, const zs_instruction *instruction, uint32_t hash)
{
  const uint32_t mask = c->table_size - 1;
  uint32_t at = hash & mask;
  while (c->table[at].number &&
         (c->table[at].hash != hash || !equal(&c->instructions[c->table[at].number - 1], instruction)))
    at = (at + 1) & mask;
  return &c->table[at];
}

/* Move the entries to a table of another size. */
static void rehash(zs_compiler *c, entry *table, uint32_t size)
{
  for (uint32_t i = 0; i < c->table_size; i++) {
    if (!c->table[i].number)
      continue;
    uint32_t at = c->table[i].hash & (size - 1);
    while (table[at].number)
      at = (at + 1) & (size - 1);
    table[at] = c->table[i];
  }
  free(c->table);
  c->table = table;
  c->table_size = size;
}

static bool grow(zs_compiler *c)
{
  if (c->capacity > UINT32_MAX / 8)
    return false;
  uint32_t capacity = c->capacity ? 2 * c->capacity : FIRST_CAPACITY;
  zs_instruction *instructions = realloc(c->instructions, capacity * sizeof *instructions);
  if (!instructions)
    return false;
  c->instructions = instructions;
  zs_memory_is_large(instructions, capacity * sizeof *instructions);
  entry *table = calloc(2 * (size_t)capacity, sizeof *table);
  zs_memory_is_large(table, 2 * capacity * sizeof *table);
  if (!table)
    return false;
  rehash(c, table, 2 * capacity);
  c->capacity = capacity;
  return true;
}

static zs_value append(zs_compiler *c, zs_instruction instruction)
{
  if (c->failed)
    return 0;
  if (c->count == c->capacity && !grow(c)) {
    c->failed = true;
    return 0;
  }
  const uint32_t hash = (uint32_t)hash_of(&instruction);
  entry *place = find(c, &instruction, hash);
  if (place->number)
    return place->number - 1;
  size_t size = instruction.operation->data_size;
  if (size) {
    void *copy = zs_arena_alloc(&c->field->arena, 1, size);
    if (!copy) {
      c->failed = true;
      return 0;
    }
    instruction.data = memcpy(copy, instruction.data, size);
  }
  c->instructions[c->count] = instruction;
  *place = (entry){hash, ++c->count};
  return c->count - 1;
}

/* ---- Emitting --------------------------------------------------------------- */

zs_value zs_emit_constant(zs_compiler *compiler, double number)
{
  if (number == 0)
    number = 0; /* one zero: -0 would make equal constants differ */
  return append(compiler, (zs_instruction){.operation = &zs_constant, .data = &number});
}

bool zs_value_constant(const zs_compiler *compiler, zs_value value, double *number)
{
  if (compiler->failed || !is_constant(&compiler->instructions[value]))
    return false;
  *number = *(const double *)compiler->instructions[value].data;
  return true;
}

zs_value zs_emit_operation(zs_compiler *compiler, const zs_operation *operation, const void *data,
                           zs_value a, zs_value b, zs_value c)
{
  zs_instruction instruction = {.operation = operation, .data = data};
  const zs_value in[ZS_MAXIMUM_INPUTS] = {a, b, c};
  memcpy(instruction.in, in, operation->arity * sizeof in[0]);
  return append(compiler, instruction);
}

/* a op b where an operand is a number that makes the other the result. */
static bool is_identity(zs_function function, bool right, double number)
{
  switch (function) {
  case ZS_FUNCTION_ADD:
    return number == 0;
  case ZS_FUNCTION_SUBTRACT:
    return right && number == 0;
  case ZS_FUNCTION_MULTIPLY:
    return number == 1;
  case ZS_FUNCTION_DIVIDE:
  case ZS_FUNCTION_POWER:
    return right && number == 1;
  default:
    return false;
  }
}

static zs_value emit_binary(zs_compiler *compiler, zs_function function, zs_value a, zs_value b)
{
  double number;
  if (zs_value_constant(compiler, b, &number)) {
    if (is_identity(function, true, number))
      return a;
    if (function == ZS_FUNCTION_POWER && number == 2)
      return zs_emit(compiler, ZS_FUNCTION_SQUARE, a, 0, 0);
    return zs_emit_operation(compiler, zs_scalar_operation(function, ZS_FORM_CONSTANT_RIGHT),
                             &number, a, 0, 0);
  }
  if (zs_value_constant(compiler, a, &number)) {
    if (is_identity(function, false, number))
      return b;
    return zs_emit_operation(compiler, zs_scalar_operation(function, ZS_FORM_CONSTANT_LEFT),
                             &number, b, 0, 0);
  }
  if (a == b && function == ZS_FUNCTION_MULTIPLY)
    return zs_emit(compiler, ZS_FUNCTION_SQUARE, a, 0, 0);
  if (a == b && (function == ZS_FUNCTION_MINIMUM || function == ZS_FUNCTION_MAXIMUM))
    return a;
  return zs_emit_operation(compiler, zs_scalar_operation(function, ZS_FORM_REGISTERS), NULL, a, b,
                           0);
}

zs_value zs_emit(zs_compiler *compiler, zs_function function, zs_value a, zs_value b, zs_value c)
{
  unsigned arity = zs_function_arity(function);
  double x[3] = {0, 0, 0};
  const zs_value in[3] = {a, b, c};
  unsigned constants = 0;
  for (unsigned k = 0; k < arity; k++)
    constants += zs_value_constant(compiler, in[k], &x[k]);
  if (constants == arity)
    return zs_emit_constant(compiler, zs_function_value(function, x[0], x[1], x[2]));
  if (function == ZS_FUNCTION_SELECT && zs_value_constant(compiler, a, &x[0]))
    return x[0] != 0 ? b : c;
  if (arity == 2)
    return emit_binary(compiler, function, a, b);
  return zs_emit_operation(compiler, zs_scalar_operation(function, ZS_FORM_REGISTERS), NULL, a, b,
                           c);
}

zs_value zs_emit_expression(zs_compiler *compiler, const zs_expression *expression,
                            const zs_value *variables)
{
  zs_value *values = malloc((size_t)expression->count * sizeof *values);
  if (!values) {
    compiler->failed = true;
    return 0;
  }
  for (uint32_t i = 0; i < expression->count; i++) {
    const zs_expression_node *node = &expression->nodes[i];
    if (node->function == ZS_FUNCTION_NUMBER) {
      values[i] = zs_emit_constant(compiler, node->number);
    } else if (node->function == ZS_FUNCTION_VARIABLE) {
      values[i] = variables[node->operand[0]];
    } else {
      zs_value in[3] = {0, 0, 0};
      for (unsigned k = 0; k < zs_function_arity(node->function); k++)
        in[k] = values[node->operand[k]];
      values[i] = zs_emit(compiler, node->function, in[0], in[1], in[2]);
    }
  }
  zs_value result = values[expression->count - 1];
  free(values);
  return result;
}

/* ---- Coordinates -------------------------------------------------------------- */

static const double IDENTITY[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

zs_coordinates zs_coordinates_root(void)
{
  zs_coordinates at = {.root = true, .base = {0, 1, 2}};
  memcpy(at.matrix, IDENTITY, sizeof IDENTITY);
  return at;
}

zs_coordinates zs_coordinates_from(zs_value x, zs_value y, zs_value z)
{
  zs_coordinates at = {.root = false, .base = {x, y, z}};
  memcpy(at.matrix, IDENTITY, sizeof IDENTITY);
  return at;
}

zs_coordinates zs_coordinates_affine(const zs_coordinates *coordinates, const double inverse[12])
{
  zs_coordinates at = *coordinates;
  const double *m = coordinates->matrix;
  for (int i = 0; i < 3; i++) {
    const double *r = inverse + 4 * i;
    for (int j = 0; j < 4; j++)
      at.matrix[4 * i + j] =
        r[0] * m[j] + r[1] * m[4 + j] + r[2] * m[8 + j] + (j == 3 ? r[3] : 0);
  }
  return at;
}

zs_value zs_emit_coordinate(zs_compiler *compiler, const zs_coordinates *coordinates, int axis)
{
  zs_linear linear;
  memcpy(linear.row, coordinates->matrix + 4 * (size_t)axis, sizeof linear.row);
  for (int j = 0; j < 4; j++)
    if (linear.row[j] == 0)
      linear.row[j] = 0; /* no -0: equal rows must be equal bytes */
  const zs_value *base = coordinates->base;
  if (coordinates->root)
    return zs_emit_operation(compiler, &zs_linear_root, &linear, base[0], base[1], base[2]);
  const double *identity = IDENTITY + 4 * (size_t)axis;
  if (!memcmp(linear.row, identity, sizeof linear.row))
    return base[axis];
  return zs_emit_operation(compiler, &zs_linear_registers, &linear, base[0], base[1], base[2]);
}

/* The factor of a map that turns and scales evenly, or 0 of any other. */
static double even_stretch(const double matrix[12])
{
  double product[3][3], square = 0;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      product[i][j] = 0;
      for (int k = 0; k < 3; k++)
        product[i][j] += matrix[4 * k + i] * matrix[4 * k + j];
    }
  for (int i = 0; i < 3; i++)
    square += product[i][i] / 3;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      if (!(fabs(product[i][j] - (i == j ? square : 0)) <= 1e-12 * square))
        return 0;
  return fabs(square - 1) <= 1e-12 ? 1 : sqrt(square);
}

/* By how much a map stretches at most; for uneven ones too large by up to
 * sqrt(3). */
static double greatest_stretch(const double matrix[12])
{
  double square = 0, even = even_stretch(matrix);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      square += matrix[4 * i + j] * matrix[4 * i + j];
  return (even > 0 ? even : sqrt(square)) * (1 + 1e-6);
}

/* A ball looks the same from all sides: a rotation is of no account, and
 * without it a block takes fewer steps and a box has sharper bounds. */
static void forget_rotation(double matrix[12])
{
  const double stretch = even_stretch(matrix);
  if (!(stretch > 0))
    return;
  double moved[12] = {0};
  for (int i = 0; i < 3; i++) {
    moved[5 * i] = stretch;
    for (int j = 0; j < 3; j++)
      moved[4 * i + 3] += matrix[4 * j + i] * matrix[4 * j + 3] / stretch;
  }
  memcpy(matrix, moved, sizeof moved);
}

zs_value zs_emit_primitive(zs_compiler *compiler, zs_primitive_shape shape,
                           const double parameter[4], const zs_coordinates *coordinates)
{
  zs_primitive primitive;
  double *matrix = primitive.matrix;
  memcpy(matrix, coordinates->matrix, sizeof primitive.matrix);
  memcpy(primitive.parameter, parameter, sizeof primitive.parameter);
  if (shape == ZS_PRIMITIVE_BALL)
    forget_rotation(matrix);
  if (shape == ZS_PRIMITIVE_TUBE || (shape == ZS_PRIMITIVE_CUBOID && isinf(parameter[2])))
    memset(matrix + 8, 0, 4 * sizeof *matrix); /* z is of no account */
  for (int i = 0; i < 12; i++)
    if (matrix[i] == 0)
      matrix[i] = 0; /* no -0: equal matrices must be equal bytes */
  primitive.stretch = greatest_stretch(matrix);
  primitive.moved = 1;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      primitive.moved &= matrix[4 * i + j] == (double)(i == j);
  zs_value in[3];
  memcpy(in, coordinates->base, sizeof in);
  for (int j = 1; j < 3; j++) /* nothing is computed that is not used */
    if (matrix[j] == 0 && matrix[4 + j] == 0 && matrix[8 + j] == 0 && !coordinates->root)
      in[j] = in[0];
  return zs_emit_operation(compiler, zs_primitive_operation(shape, coordinates->root), &primitive,
                           in[0], in[1], in[2]);
}

/* ---- Life ------------------------------------------------------------------- */

zs_arena *zs_compiler_arena(zs_compiler *compiler)
{
  return &compiler->field->arena;
}

bool zs_compiler_keep(zs_compiler *compiler, void *data, void (*release)(void *data))
{
  zs_kept *kept = ZS_ARENA_NEW(&compiler->field->arena, zs_kept, 1);
  if (!kept) {
    compiler->failed = true;
    release(data);
    return false;
  }
  *kept = (zs_kept){.next = compiler->field->kept, .data = data, .release = release};
  compiler->field->kept = kept;
  return true;
}

zs_diag *zs_compiler_diag(zs_compiler *compiler)
{
  return compiler->diag;
}

const zs_control *zs_compiler_control(zs_compiler *compiler)
{
  return compiler->control;
}

struct zs_cache *zs_compiler_cache(zs_compiler *compiler)
{
  return compiler->cache;
}

void **zs_compiler_client(zs_compiler *compiler)
{
  return &compiler->client;
}

/* Room for one more of `count` things of a size; the capacity doubles.  NULL when memory is
 * out. */
static void *room(zs_compiler *compiler, void *things, size_t count, size_t *capacity, size_t size)
{
  if (count < *capacity)
    return things;
  const size_t next = count ? 2 * count : 4;
  void *more = zs_arena_alloc(&compiler->field->arena, next, size);
  if (!more) {
    compiler->failed = true;
    return NULL;
  }
  if (count)
    memcpy(more, things, count * size);
  *capacity = next;
  return more;
}

void zs_compiler_add_fit(zs_compiler *compiler, const zs_fit_info *info)
{
  zs_field *field = compiler->field;
  zs_fit_info *fits =
    room(compiler, field->fits, field->fit_count, &compiler->fit_capacity, sizeof *fits);
  if (!fits)
    return;
  field->fits = fits;
  fits[field->fit_count++] = *info;
}

void zs_compiler_add_correspondence(zs_compiler *compiler, const zs_correspondence *correspondence)
{
  zs_field *field = compiler->field;
  zs_correspondence *all = room(compiler, field->correspondences, field->correspondence_count,
                                &compiler->correspondence_capacity, sizeof *all);
  if (!all)
    return;
  field->correspondences = all;
  all[field->correspondence_count++] = *correspondence;
}

zs_compiler *zs_compiler_new(const zs_control *control, struct zs_cache *cache, zs_diag *diag)
{
  zs_compiler *c = calloc(1, sizeof *c);
  zs_field *field = calloc(1, sizeof *field);
  if (!c || !field) {
    free(c);
    free(field);
    zs_fail_memory(diag);
    return NULL;
  }
  atomic_init(&field->references, 1);
  field->plain = control && control->scalar;
  *c = (zs_compiler){.diag = diag, .control = control, .cache = cache, .field = field};
  if (!grow(c)) {
    zs_compiler_free(c);
    zs_fail_memory(diag);
    return NULL;
  }
  for (; c->count < ZS_COORDINATES; c->count++)
    c->instructions[c->count] = (zs_instruction){.operation = &zs_coordinate};
  return c;
}

void zs_compiler_free(zs_compiler *compiler)
{
  if (!compiler)
    return;
  zs_field_unref(compiler->field);
  free(compiler->instructions);
  free(compiler->table);
  free(compiler);
}

static const zs_program *finish_program(zs_compiler *c, zs_value result)
{
  zs_shortener shortener = {0};
  const zs_program *program = NULL;
  uint32_t links;
  if (zs_chains_form(c->instructions, result, &c->field->arena, &links) &&
      zs_shortener_init(&shortener, result + 1, links, 0)) {
    zs_find_demands(c->instructions, result + 1);
    zs_find_signed_zeros(c->instructions, result + 1);
    zs_shortener_list(&shortener, c->instructions, result + 1, NULL, 1, ZS_REQUEST_GRADIENT);
    program = zs_shortener_emit(&shortener, c->instructions, 0, ZS_REQUEST_GRADIENT, false,
                                &c->field->arena);
  }
  zs_shortener_free(&shortener);
  return program;
}

zs_field *zs_compiler_finish(zs_compiler *compiler, zs_value result, size_t nodes)
{
  zs_field *field = compiler->field;
  field->nodes = nodes;
  if (!compiler->failed)
    field->program = finish_program(compiler, result);
  zs_diag *diag = compiler->diag;
  bool done = field->program != NULL;
  if (done)
    zs_field_ref(field);
  zs_compiler_free(compiler);
  if (!done)
    zs_fail_memory(diag);
  return done ? field : NULL;
}
