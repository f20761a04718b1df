/* From nodes to operations: placement, shared nodes, and the generic emission
 * of kinds that are defined by formulas. */
#include "nodes/common.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
  FORMULA_BUCKETS = 64,
  MAXIMUM_VARIABLES = 32, /* of a kind's own formula */
  MAXIMUM_DEPTH = 1000,   /* of nested nodes, `use` included: emission recurses */
  FIRST_MEMO_SIZE = 64,
  BOX_BUCKETS = 64,
  MAXIMUM_COPIES = 1000000 /* of children that are emitted again and again, in all */
};

/* Where the value of a formula's variable comes from. */
typedef enum zs_origin { FROM_COORDINATE, FROM_A, FROM_B, FROM_NUMBER, FROM_INTEGER } zs_origin;

typedef struct binding {
  zs_origin origin;
  size_t offset; /* coordinate axis, or bytes into the parameter struct */
} binding;

/* A formula of a kind, parsed once per compilation. */
typedef struct parsed {
  const char *formula; /* compared by address: formulas are constants of the kinds */
  const zs_kind *kind;
  const zs_expression *expression; /* NULL: reported as unusable */
  binding bindings[MAXIMUM_VARIABLES];
  struct parsed *next;
} parsed;

/* A node that is compiled at some coordinates. */
typedef struct memo {
  const zs_node *node;
  zs_coordinates at;
  zs_value value;
} memo;

/* The box of a node's children. */
typedef struct known_box {
  const zs_node *node;
  zs_box box;
  struct known_box *next;
} known_box;

/* What this room keeps in the compiler's client pointer. */
typedef struct client {
  known_box *boxes[BOX_BUCKETS];
  double copies;
  bool too_many; /* reported */
  parsed *formulas[FORMULA_BUCKETS];
  memo **memos; /* open addressing */
  size_t memo_count, memo_size;
  unsigned depth;
  bool too_deep; /* reported */
} client;

static client *client_of(zs_compiler *compiler)
{
  void **slot = zs_compiler_client(compiler);
  if (!*slot) {
    *slot = ZS_ARENA_NEW(zs_compiler_arena(compiler), client, 1);
    if (!*slot)
      zs_fail_memory(zs_compiler_diag(compiler));
  }
  return *slot;
}

/* ---- Copies of children ------------------------------------------------------ */

zs_box *zs_children_box(zs_compiler *compiler, const zs_node *node, bool *known)
{
  client *c = client_of(compiler);
  *known = false;
  if (!c)
    return NULL;
  known_box **bucket = &c->boxes[((uintptr_t)node >> 4 ^ (uintptr_t)node >> 10) % BOX_BUCKETS];
  for (known_box *b = *bucket; b; b = b->next)
    if (b->node == node) {
      *known = true;
      return &b->box;
    }
  known_box *b = ZS_ARENA_NEW(zs_compiler_arena(compiler), known_box, 1);
  if (!b) {
    zs_fail_memory(zs_compiler_diag(compiler));
    return NULL;
  }
  *b = (known_box){.node = node, .next = *bucket};
  *bucket = b;
  return &b->box;
}

bool zs_copies_allowed(zs_compiler *compiler, const zs_node *node, double count)
{
  client *c = client_of(compiler);
  if (!c)
    return false;
  c->copies += count;
  if (c->copies <= MAXIMUM_COPIES)
    return true;
  if (!c->too_many)
    zs_report(zs_compiler_diag(compiler), ZS_ERROR, ZS_ERROR_UNABLE, &node->place, NULL,
              "repeated nodes have more than %d copies of their children at one place in all, "
              "nested ones counted in every copy", MAXIMUM_COPIES);
  c->too_many = true;
  return false;
}

/* ---- Formulas of kinds ----------------------------------------------------- */

/* Whether a variable is an attribute's name, '_' standing for '-'; afterwards
 * `rest` is what follows. */
static bool names_attribute(const char *variable, const char *name, const char **rest)
{
  size_t length = strlen(name);
  for (size_t i = 0; i < length; i++)
    if (variable[i] != (name[i] == '-' ? '_' : name[i]))
      return false;
  /* Formulas write `round_` for an attribute whose name is a function's. */
  *rest = variable + length + !strcmp(variable + length, "_");
  return true;
}

static bool bind_attribute(const zs_attribute *attribute, const char *rest, binding *result)
{
  size_t dimension = attribute->type == ZS_VECTOR2                                     ? 2
                     : attribute->type == ZS_VECTOR3 || attribute->type == ZS_SCALE ? 3
                                                                                       : 0;
  if (!*rest && attribute->type == ZS_NUMBER) {
    *result = (binding){FROM_NUMBER, attribute->offset};
  } else if (!*rest && attribute->type == ZS_INTEGER) {
    *result = (binding){FROM_INTEGER, attribute->offset};
  } else {
    size_t component = (size_t)(rest[0] == '.' && rest[1] && !rest[2] ? rest[1] - 'x' : 3);
    if (component >= dimension)
      return false;
    *result = (binding){FROM_NUMBER, attribute->offset + component * sizeof(double)};
  }
  return true;
}

static bool bind(const zs_kind *kind, const char *variable, binding *result)
{
  const char *rest;
  for (size_t i = 0; i < kind->attribute_count; i++)
    if (names_attribute(variable, kind->attributes[i].name, &rest) &&
        bind_attribute(&kind->attributes[i], rest, result))
      return true;
  if (variable[0] && !variable[1]) {
    const char c = variable[0];
    if (c >= 'x' && c <= 'z') {
      *result = (binding){FROM_COORDINATE, (size_t)(c - 'x')};
      return true;
    }
    if (c == 'a' || c == 'b' || c == 'f') {
      *result = (binding){c == 'b' ? FROM_B : FROM_A, 0};
      return true;
    }
  }
  return false;
}

static void parse(zs_compiler *compiler, parsed *p)
{
  zs_expression_error error;
  const zs_expression *expression =
    zs_expression_parse(zs_compiler_arena(compiler), p->formula, strlen(p->formula), &error);
  zs_diag *diag = zs_compiler_diag(compiler);
  if (!expression) {
    if (error.memory)
      zs_fail_memory(diag);
    else
      zs_fail(diag, ZS_ERROR_UNABLE, NULL, "the formula of <%s> cannot be read: %s",
              p->kind->name, error.message);
    return;
  }
  for (uint32_t i = 0; i < expression->variable_count; i++) {
    if (i >= MAXIMUM_VARIABLES || !bind(p->kind, expression->variables[i], &p->bindings[i])) {
      zs_fail(diag, ZS_ERROR_UNABLE, NULL, "the formula of <%s> names an unknown '%s'",
              p->kind->name, expression->variables[i]);
      return;
    }
  }
  p->expression = expression;
}

static const parsed *parsed_formula(zs_compiler *compiler, const zs_kind *kind,
                                    const char *formula)
{
  client *c = client_of(compiler);
  if (!c)
    return NULL;
  parsed **bucket = &c->formulas[((uintptr_t)formula >> 4 ^ (uintptr_t)formula) % FORMULA_BUCKETS];
  for (const parsed *p = *bucket; p; p = p->next)
    if (p->formula == formula && p->kind == kind)
      return p;
  parsed *p = ZS_ARENA_NEW(zs_compiler_arena(compiler), parsed, 1);
  if (!p) {
    zs_fail_memory(zs_compiler_diag(compiler));
    return NULL;
  }
  *p = (parsed){.formula = formula, .kind = kind, .next = *bucket};
  *bucket = p;
  parse(compiler, p);
  return p;
}

zs_value zs_formula_emit(zs_compiler *compiler, const zs_node *node, const char *formula,
                         const zs_coordinates *at, zs_value a, zs_value b)
{
  const parsed *p = parsed_formula(compiler, node->kind, formula);
  if (!p || !p->expression)
    return 0;
  zs_value variables[MAXIMUM_VARIABLES];
  const unsigned char *parameters = node->parameters;
  for (uint32_t i = 0; i < p->expression->variable_count; i++) {
    const binding *from = &p->bindings[i];
    switch (from->origin) {
    case FROM_COORDINATE:
      variables[i] = zs_emit_coordinate(compiler, at, (int)from->offset);
      break;
    case FROM_A:
      variables[i] = a;
      break;
    case FROM_B:
      variables[i] = b;
      break;
    case FROM_NUMBER:
      variables[i] =
        zs_emit_constant(compiler, *(const double *)(const void *)(parameters + from->offset));
      break;
    case FROM_INTEGER:
      variables[i] =
        zs_emit_constant(compiler, *(const int *)(const void *)(parameters + from->offset));
      break;
    }
  }
  return zs_emit_expression(compiler, p->expression, variables);
}

/* ---- Formulas of authors ---------------------------------------------------- */

zs_value zs_author_formula_emit(zs_compiler *compiler, const zs_formula *formula,
                                const zs_coordinates *at, zs_value f)
{
  const uint32_t count = formula->expression->variable_count;
  zs_value *variables = malloc((count ? count : 1) * sizeof *variables);
  if (!variables) {
    zs_fail_memory(zs_compiler_diag(compiler));
    return 0;
  }
  for (uint32_t i = 0; i < count; i++) {
    int axis = formula->axis[i];
    if (axis < 0)
      variables[i] = zs_emit_constant(compiler, formula->number[i]);
    else
      variables[i] = axis < 3 ? zs_emit_coordinate(compiler, at, axis) : f;
  }
  zs_value value = zs_emit_expression(compiler, formula->expression, variables);
  free(variables);
  return value;
}

/* ---- Generic emission --------------------------------------------------------- */

static const zs_attribute *attribute_of(const zs_kind *kind, const char *name)
{
  for (size_t i = 0; i < kind->attribute_count; i++)
    if (!strcmp(kind->attributes[i].name, name))
      return &kind->attributes[i];
  return NULL;
}

static int choice_of(const zs_node *node, const zs_attribute *attribute)
{
  return *(const int *)(const void *)((const unsigned char *)node->parameters + attribute->offset);
}

static bool variant_applies(const zs_node *node, const zs_variant *variant)
{
  if (!variant->attribute)
    return true;
  const zs_attribute *attribute = attribute_of(node->kind, variant->attribute);
  return attribute && !strcmp(attribute->choices[choice_of(node, attribute)], variant->choice);
}

static const char *formula_of(const zs_node *node)
{
  for (const zs_variant *v = node->kind->variants; v && v->formula; v++)
    if (variant_applies(node, v))
      return v->formula;
  return node->kind->formula;
}

/* The axis that a kind's formulas call z; 2 when they have no choice. */
static int axis_of(const zs_node *node)
{
  const zs_attribute *axis = attribute_of(node->kind, "axis");
  return axis && axis->type == ZS_CHOICE && axis->choices == zs_axis_names ? choice_of(node, axis)
                                                                           : 2;
}

/* Whether only the definitions of the kinds are wanted. */
static bool scalar_only(zs_compiler *compiler)
{
  const zs_control *control = zs_compiler_control(compiler);
  return control && control->scalar;
}

static zs_value combine(zs_compiler *compiler, const zs_node *node, zs_value a, zs_value b)
{
  const zs_coordinates nowhere = zs_coordinates_root();
  return zs_formula_emit(compiler, node, formula_of(node), &nowhere, a, b);
}

static zs_value map_emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const int axis = axis_of(node);
  zs_coordinates along = zs_coordinates_along(at, axis);
  zs_value p[3];
  for (int i = 0; i < 3; i++)
    p[i] = zs_formula_emit(compiler, node, node->kind->map[i], &along, 0, 0);
  zs_coordinates mapped = zs_coordinates_from(p[0], p[1], p[2]);
  mapped = zs_coordinates_back(&mapped, axis);
  zs_value f = zs_children_emit(compiler, node, &mapped);
  const char *formula = formula_of(node);
  return formula ? zs_formula_emit(compiler, node, formula, &along, f, 0) : f;
}

zs_value zs_kind_emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const zs_kind *kind = node->kind;
  if (kind->map[0])
    return map_emit(compiler, node, at);
  if (kind->children == ZS_CHILDREN_MANY || kind->children == ZS_CHILDREN_TWO)
    return zs_children_fold(compiler, node, at,
                            kind->combine && !scalar_only(compiler) ? kind->combine : combine);
  zs_coordinates along = zs_coordinates_along(at, axis_of(node));
  zs_value f = kind->children == ZS_CHILDREN_ONE ? zs_children_emit(compiler, node, at) : 0;
  return zs_formula_emit(compiler, node, formula_of(node), &along, f, 0);
}

static zs_value unite(zs_compiler *compiler, const zs_node *node, zs_value a, zs_value b)
{
  (void)node;
  return zs_emit(compiler, ZS_FUNCTION_MAXIMUM, a, b, 0);
}

zs_value zs_children_emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  return zs_children_fold(compiler, node, at, unite);
}

zs_field *zs_children_field(zs_compiler *compiler, const zs_node *node, zs_diag *diag)
{
  const unsigned errors = diag->errors;
  zs_compiler *own =
    zs_compiler_new(zs_compiler_control(compiler), zs_compiler_cache(compiler), diag);
  if (!own)
    return NULL;
  const zs_coordinates root = zs_coordinates_root();
  const zs_value f = zs_children_emit(own, node, &root);
  zs_field *field = zs_compiler_finish(own, f, 1);
  if (diag->errors == errors)
    return field;
  zs_field_unref(field);
  return NULL;
}

/* ---- Shared nodes ------------------------------------------------------------- */

static bool same_coordinates(const zs_coordinates *a, const zs_coordinates *b)
{
  return a->root == b->root && !memcmp(a->base, b->base, sizeof a->base) &&
         !memcmp(a->matrix, b->matrix, sizeof a->matrix);
}

static size_t hash_of(const zs_node *node, const zs_coordinates *at)
{
  uint64_t hash = (uintptr_t)node, word;
  const uint64_t prime = UINT64_C(0x9e3779b97f4a7c15);
  for (int i = 0; i < 3; i++)
    hash = (hash ^ at->base[i]) * prime;
  for (int i = 0; i < 12; i++) {
    memcpy(&word, &at->matrix[i], sizeof word);
    hash = (hash ^ word) * prime;
    hash ^= hash >> 29;
  }
  return (size_t)hash;
}

/* The entry of a node at coordinates, or the free place for it. */
static memo **memo_place(memo **memos, size_t size, const zs_node *node, const zs_coordinates *at)
{
  size_t i = hash_of(node, at) & (size - 1);
  while (memos[i] && !(memos[i]->node == node && same_coordinates(&memos[i]->at, at)))
    i = (i + 1) & (size - 1);
  return &memos[i];
}

static bool grow_memos(client *c, zs_arena *arena)
{
  size_t size = c->memo_size ? 2 * c->memo_size : FIRST_MEMO_SIZE;
  memo **memos = ZS_ARENA_NEW(arena, memo *, size);
  if (!memos)
    return false;
  for (size_t i = 0; i < c->memo_size; i++)
    if (c->memos[i])
      *memo_place(memos, size, c->memos[i]->node, &c->memos[i]->at) = c->memos[i];
  c->memos = memos;
  c->memo_size = size;
  return true;
}

static void remember(zs_compiler *compiler, client *c, const zs_node *node,
                     const zs_coordinates *at, zs_value value)
{
  zs_arena *arena = zs_compiler_arena(compiler);
  memo *entry = ZS_ARENA_NEW(arena, memo, 1);
  if (!entry || (2 * c->memo_count >= c->memo_size && !grow_memos(c, arena))) {
    zs_fail_memory(zs_compiler_diag(compiler));
    return;
  }
  *entry = (memo){node, *at, value};
  *memo_place(c->memos, c->memo_size, node, at) = entry;
  c->memo_count++;
}

/* Emitting a plain leaf again costs no more than looking it up, and gives the
 * same instructions. */
static bool worth_remembering(const zs_node *node)
{
  return node->child_count || node->kind->family == ZS_FAMILY_DATA ||
         node->kind->family == ZS_FAMILY_SHAPE;
}

/* ---- Files that cannot be read -------------------------------------------------------- */

/* Whoever asked for the diagnostics of a node that is being emitted. */
typedef struct outer {
  const zs_node *node;
  zs_diag diag; /* as it was */
} outer;

/* The attribute of a node that names this file, or any if that is NULL; NULL without one. */
static const char *attribute_with(const zs_node *node, const char *file)
{
  for (size_t i = 0; i < node->kind->attribute_count; i++) {
    const zs_attribute *a = &node->kind->attributes[i];
    const void *field = (const char *)node->parameters + a->offset;
    zs_files files = {.count = 0};
    if (a->type == ZS_FILES)
      files = *(const zs_files *)field;
    else if (a->type == ZS_FILE)
      files = (zs_files){.paths = field, .count = *(const char *const *)field != NULL};
    for (size_t k = 0; k < files.count; k++)
      if (!file || !strcmp(files.paths[k], file))
        return a->name;
  }
  return NULL;
}

/* The node that asks for this file, or any: this one, or a part of it. */
static const zs_node *find_reader(const zs_node *node, const char *file, const char **attribute)
{
  if ((*attribute = attribute_with(node, file)))
    return node;
  for (size_t i = 0; i < node->child_count; i++) {
    const zs_node *child = node->children[i];
    const zs_node *reader =
      child->kind->family == ZS_FAMILY_PART ? find_reader(child, file, attribute) : NULL;
    if (reader)
      return reader;
  }
  return NULL;
}

/* What is wrong inside a data file says where in the scene the file is asked for. */
static void report_reader(void *context, const zs_diagnostic *diagnostic)
{
  const outer *o = context;
  zs_diagnostic d = *diagnostic;
  const char *attribute = NULL;
  const zs_node *reader =
    d.file && !d.element && !d.hint ? find_reader(o->node, d.file, &attribute) : NULL;
  char hint[512];
  if (reader) {
    const zs_place *place = &reader->place;
    snprintf(hint, sizeof hint, "'%s' of <%s> asks for this file, in %s:%" PRIu32, attribute,
             reader->kind->name, place->source ? place->source->name : "the scene", place->line);
    d.hint = hint;
  }
  o->diag.report(o->diag.context, &d);
}

static zs_value placed_emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  zs_coordinates placed = node->placement ? zs_coordinates_affine(at, node->placement) : *at;
  const zs_kind *kind = node->kind;
  zs_value value = kind->fused && !scalar_only(compiler) ? kind->fused(compiler, node, &placed)
                   : kind->emit                          ? kind->emit(compiler, node, &placed)
                                                         : zs_kind_emit(compiler, node, &placed);
  return node->placement ? zs_emit_scaled(compiler, value, node->placement_scale) : value;
}

static zs_value watched_emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  zs_diag *diag = zs_compiler_diag(compiler);
  const char *attribute;
  if (!diag || !diag->report || !find_reader(node, NULL, &attribute))
    return placed_emit(compiler, node, at);
  outer o = {node, *diag};
  diag->report = report_reader;
  diag->context = &o;
  const zs_value value = placed_emit(compiler, node, at);
  diag->report = o.diag.report;
  diag->context = o.diag.context;
  return value;
}

zs_value zs_node_emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  client *c = client_of(compiler);
  if (!c)
    return 0;
  bool shared = worth_remembering(node);
  if (shared && c->memo_size) {
    const memo *known = *memo_place(c->memos, c->memo_size, node, at);
    if (known)
      return known->value;
  }
  if (c->depth == MAXIMUM_DEPTH) {
    if (!c->too_deep)
      zs_report(zs_compiler_diag(compiler), ZS_ERROR, ZS_ERROR_UNABLE, &node->place, NULL,
                "nodes are nested more than %d deep, shared ones counted where they are used",
                MAXIMUM_DEPTH);
    c->too_deep = true;
    return 0;
  }
  c->depth++;
  zs_value value = watched_emit(compiler, node, at);
  c->depth--;
  if (shared)
    remember(compiler, c, node, at, value);
  return value;
}
