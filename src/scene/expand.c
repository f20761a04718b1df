/* From elements to nodes: use, instance, repeat and expressions resolved. */
#include "scene/scene.h"

#include "base/array.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
  MAXIMUM_ITERATIONS = 1000000, /* of all repeats together */
  MAXIMUM_NESTING = 1000        /* of nodes, through use and instance: this recurses */
};

/* An object or a definition that is being expanded. */
typedef struct frame {
  const zs_element *element;
  const char *name;
  const struct frame *outer;
} frame;

typedef enum object_state { OBJECT_NEW, OBJECT_OPEN, OBJECT_DONE } object_state;

typedef struct object_memo {
  object_state state;
  zs_node *node; /* NULL after an error */
} object_memo;

typedef struct expansion {
  zs_scene *scene;
  zs_arena *arena;
  zs_diag *diag;
  const zs_scope *scope;
  const frame *frame;
  object_memo *objects;
  zs_node **stack; /* children of the nodes that are being made */
  size_t stack_count, stack_capacity;
  size_t nodes, iterations;
  uint32_t depth;
  bool unknown; /* a repeat's count is not known: numbers of children are not */
  bool halted;  /* a limit is reached, or memory is out: stop quietly */
} expansion;

/* What the children of an element may be. */
typedef struct context {
  const zs_kind *kind;
  const zs_element *element; /* the node's, not that of a repeat between */
} context;

static void expand_children(expansion *x, const zs_element *parent, context c);

static void halt(expansion *x)
{
  x->halted = true;
}

static void halt_for_memory(expansion *x)
{
  if (!x->halted)
    zs_fail_memory(x->diag);
  halt(x);
}

static bool push(expansion *x, zs_node *node)
{
  zs_node **stack =
    zs_array_grown(x->stack, x->stack_count + 1, &x->stack_capacity, sizeof(zs_node *));
  if (!stack) {
    halt_for_memory(x);
    return false;
  }
  x->stack = stack;
  stack[x->stack_count++] = node;
  return true;
}

static zs_reading reading_of(const expansion *x)
{
  return (zs_reading){.scene = x->scene, .arena = x->arena, .diag = x->diag, .scope = x->scope};
}

/* ---- Placement --------------------------------------------------------- */

/* Sine and cosine of an angle in degrees, exact at quarter turns. */
static void turn(double degrees, double *sine, double *cosine)
{
  static const double sines[] = {0, 1, 0, -1};
  if (degrees == 0) {
    *sine = 0;
    *cosine = 1;
    return;
  }
  double quarters = degrees / 90;
  if (quarters == floor(quarters)) {
    int quarter = (int)(quarters - 4 * floor(quarters / 4));
    *sine = sines[quarter];
    *cosine = sines[(quarter + 1) & 3];
    return;
  }
  double radians = degrees * (3.14159265358979323846 / 180);
  *sine = sin(radians);
  *cosine = cos(radians);
}

/* The inverse of scale, then rotate about x, y, z, then translate: the rows of
 * the transposed rotation over the scale. */
static bool set_placement(expansion *x, zs_node *node, const struct zs_placement *p)
{
  double sx, cx, sy, cy, sz, cz;
  turn(p->rotate[0], &sx, &cx);
  turn(p->rotate[1], &sy, &cy);
  turn(p->rotate[2], &sz, &cz);
  const double columns[3][3] = {
    {cy * cz, cy * sz, -sy},
    {sx * sy * cz - cx * sz, sx * sy * sz + cx * cz, sx * cy},
    {cx * sy * cz + sx * sz, cx * sy * sz - sx * cz, cx * cy}};
  double *inverse = ZS_ARENA_NEW(x->arena, double, 12);
  if (!inverse) {
    halt_for_memory(x);
    return false;
  }
  node->placement_scale = INFINITY;
  for (int i = 0; i < 3; i++) {
    double moved = 0;
    for (int j = 0; j < 3; j++) {
      inverse[4 * i + j] = columns[i][j] / p->scale[i];
      moved += columns[i][j] * p->at[j];
    }
    inverse[4 * i + 3] = -moved / p->scale[i];
    node->placement_scale = fmin(node->placement_scale, fabs(p->scale[i]));
  }
  node->placement = inverse;
  return true;
}

/* ---- Nodes ------------------------------------------------------------- */

static zs_node *new_node(expansion *x, const zs_element *element, const zs_kind *kind)
{
  if (x->nodes == x->scene->options.maximum_nodes) {
    zs_place place = zs_element_place(element);
    if (!x->halted)
      zs_report(x->diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL,
                "the scene has more than %u nodes", x->scene->options.maximum_nodes);
    halt(x);
    return NULL;
  }
  zs_node *node = ZS_ARENA_NEW(x->arena, zs_node, 1);
  if (!node) {
    halt_for_memory(x);
    return NULL;
  }
  x->nodes++;
  node->kind = kind;
  node->placement_scale = 1;
  node->place = zs_element_place(element);
  node->element = element;
  return node;
}

/* Give the node what has been pushed since the stack held `base`. */
static bool take_children(expansion *x, zs_node *node, size_t base)
{
  size_t count = x->stack_count - base;
  zs_node **children = ZS_ARENA_NEW(x->arena, zs_node *, count);
  x->stack_count = base;
  if (!children) {
    halt_for_memory(x);
    return false;
  }
  if (count)
    memcpy(children, x->stack + base, count * sizeof(zs_node *));
  node->children = children;
  node->child_count = count;
  return true;
}

/* The union of what has been pushed since the stack held `base`, at the place
 * of an element that is no node itself.  `placement` may be NULL. */
static zs_node *unite(expansion *x, const zs_element *element, size_t base,
                      const struct zs_placement *placement)
{
  if (x->stack_count - base == 1 && !placement)
    return x->stack[--x->stack_count];
  static const zs_element nothing = {.name = "union"};
  const zs_kind *kind = zs_kind_find("union");
  zs_node *node = new_node(x, element, kind);
  zs_reading reading = reading_of(x);
  if (!node || !take_children(x, node, base))
    return NULL;
  node->parameters = zs_attributes_read(&reading, &nothing, (zs_attribute_rule){.kind = kind},
                                        NULL, NULL, NULL);
  if (!node->parameters) {
    halt(x);
    return NULL;
  }
  return !placement || set_placement(x, node, placement) ? node : NULL;
}

static bool check_children(expansion *x, const zs_element *element, const zs_kind *kind,
                           size_t base)
{
  size_t count = 0;
  for (size_t i = base; i < x->stack_count; i++)
    count += x->stack[i]->kind->family != ZS_FAMILY_PART;
  size_t least = kind->children == ZS_CHILDREN_NONE  ? 0
                 : kind->children == ZS_CHILDREN_TWO ? 2
                                                     : 1;
  if (count >= least)
    return true;
  zs_place place = zs_element_place(element);
  return zs_report(x->diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL,
                   count == 0 ? "no node inside; expected %s" : "one node inside; expected %s",
                   least == 2 ? "at least two" : "at least one");
}

/* Enter one more level; false after reporting that there are too many. */
static bool enter(expansion *x, const zs_element *element)
{
  if (x->depth == MAXIMUM_NESTING) {
    zs_place place = zs_element_place(element);
    if (!x->halted)
      zs_report(x->diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL,
                "nodes are nested more than %d deep", MAXIMUM_NESTING);
    halt(x);
    return false;
  }
  x->depth++;
  return true;
}

static void expand_node(expansion *x, const zs_element *element, const zs_kind *kind)
{
  unsigned errors = x->diag->errors;
  zs_node *node = new_node(x, element, kind);
  if (!node || !enter(x, element))
    return;
  struct zs_placement placement;
  unsigned placed = 0;
  zs_reading reading = reading_of(x);
  zs_attribute_rule rule = {.kind = kind, .placed = kind->family != ZS_FAMILY_PART};
  node->parameters =
    zs_attributes_read(&reading, element, rule, &node->given, &placement, &placed);
  bool outer_unknown = x->unknown;
  x->unknown = false;
  size_t base = x->stack_count;
  expand_children(x, element, (context){kind, element});
  x->depth--;
  bool good = node->parameters && !x->halted && x->diag->errors == errors;
  bool unknown = reading.unknown || x->unknown;
  x->unknown = outer_unknown || unknown;
  if (good && !unknown)
    good = check_children(x, element, kind, base);
  if (good && placed)
    good = set_placement(x, node, &placement);
  good = take_children(x, node, base) && good;
  if (good && !unknown && kind->check)
    good = kind->check(node, x->diag);
  if (good)
    push(x, node);
}

/* ---- use --------------------------------------------------------------- */

/* Write "a -> b -> " for the frames from `first` to the innermost one, `f`. */
static void write_path(const frame *f, const zs_element *first, char *text, size_t size)
{
  if (f->element != first)
    write_path(f->outer, first, text, size);
  size_t used = strlen(text);
  snprintf(text + used, size - used, "%s -> ", f->name);
}

/* Report a circle that begins with the frame of `first` and ends here. */
static void fail_circle(expansion *x, const zs_element *element, const zs_xml_attribute *attribute,
                        const zs_element *first)
{
  char path[512] = "";
  write_path(x->frame, first, path, sizeof path);
  zs_place place = zs_attribute_place(element, attribute, 0);
  zs_report(x->diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL, "refers to itself: %s%s", path,
            attribute->value);
}

/* Expand the children of an object or a definition to one node; NULL after an
 * error. */
static zs_node *expand_body(expansion *x, const zs_element *element, const zs_kind *kind,
                            const zs_scope *scope, const char *name,
                            const struct zs_placement *placement)
{
  const zs_scope *outer_scope = x->scope;
  frame f = {element, name, x->frame};
  unsigned errors = x->diag->errors;
  size_t base = x->stack_count;
  zs_node *node = NULL;
  if (!enter(x, element))
    return NULL;
  x->scope = scope;
  x->frame = &f;
  bool outer_unknown = x->unknown;
  x->unknown = false;
  expand_children(x, element, (context){kind, element});
  bool good = !x->halted && x->diag->errors == errors;
  if (good && !x->unknown)
    good = check_children(x, element, kind, base);
  if (good && x->stack_count > base)
    node = unite(x, element, base, placement);
  x->unknown = x->unknown || outer_unknown;
  x->stack_count = base;
  x->frame = f.outer;
  x->scope = outer_scope;
  x->depth--;
  return node;
}

/* The node of an object, made once; NULL after an error. */
static zs_node *object_node(expansion *x, size_t index)
{
  object_memo *memo = &x->objects[index];
  const zs_scene_object_state *object = &x->scene->objects.items[index];
  if (memo->state == OBJECT_DONE)
    return memo->node;
  memo->state = OBJECT_OPEN;
  memo->node = expand_body(x, object->element, &zs_document_object, NULL, object->id, NULL);
  memo->state = OBJECT_DONE;
  return memo->node;
}

static void expand_use(expansion *x, const zs_element *element)
{
  unsigned errors = x->diag->errors;
  struct zs_placement placement;
  unsigned placed = 0;
  zs_reading reading = reading_of(x);
  const struct zs_document_use *use =
    zs_attributes_read(&reading, element, (zs_attribute_rule){&zs_document_use, true, false}, NULL,
                       &placement, &placed);
  const zs_xml_attribute *attribute = zs_element_attribute(element, "object");
  expand_children(x, element, (context){&zs_document_use, element});
  if (!use) {
    halt(x);
    return;
  }
  if (!attribute)
    return;
  const zs_name *entry = zs_names_find(&x->scene->object_names, use->object, strlen(use->object));
  if (!entry) {
    zs_place place = zs_attribute_place(element, attribute, 0);
    zs_fail_reference(&place, "object", use->object, &x->scene->object_names, x->diag);
    return;
  }
  if (x->objects[entry->value].state == OBJECT_OPEN) {
    fail_circle(x, element, attribute, x->scene->objects.items[entry->value].element);
    return;
  }
  zs_node *node = object_node(x, entry->value);
  if (!node)
    x->unknown = true; /* its errors have been reported: a child is missing */
  if (!node || x->diag->errors != errors || !push(x, node))
    return;
  if (placed) {
    node = unite(x, element, x->stack_count - 1, &placement);
    if (node)
      push(x, node);
  }
}

/* ---- instance ---------------------------------------------------------- */

static bool is_argument(const zs_definition *definition, const char *name)
{
  for (size_t i = 0; i < definition->argument_count; i++)
    if (strcmp(definition->argument_names[i], name) == 0)
      return true;
  return false;
}

static bool is_instance_attribute(const char *name)
{
  bool known = strcmp(name, "of") == 0;
  for (size_t i = 0; i < ZS_PLACEMENT_ATTRIBUTES; i++)
    known = known || strcmp(name, zs_placement_attributes[i].name) == 0;
  return known;
}

/* Report attributes that are no arguments of the definition. */
static void check_arguments(expansion *x, const zs_element *element,
                            const zs_definition *definition)
{
  for (size_t i = 0; i < element->attribute_count; i++) {
    const zs_xml_attribute *a = &element->attributes[i];
    if (is_instance_attribute(a->name) || is_argument(definition, a->name))
      continue;
    char hint[128];
    const char *near =
      zs_suggest(a->name, definition->argument_names, definition->argument_count);
    if (near)
      snprintf(hint, sizeof hint, "did you mean '%s'?", near);
    zs_place place = zs_attribute_name_place(element, a);
    zs_report(x->diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, near ? hint : NULL,
              "'%s' has no such argument", definition->name);
  }
}

/* Fill in the scopes of a definition's arguments, the instance's values first;
 * `instance` NULL: what has no default is unknown. */
static void bind_arguments(expansion *x, const zs_element *instance,
                           const zs_definition *definition, zs_scope *scopes)
{
  for (size_t i = 0; i < definition->argument_count; i++) {
    const char *name = definition->argument_names[i];
    const zs_scope *before = i ? &scopes[i - 1] : NULL;
    zs_xml_attribute *given = instance ? zs_element_attribute(instance, name) : NULL;
    zs_xml_attribute *initial = zs_element_attribute(definition->arguments[i], "value");
    zs_reading reading = reading_of(x);
    double value = 1;
    if (given) {
      zs_number_read(&reading, instance, given, &value);
    } else if (initial) {
      reading.scope = before;
      zs_number_read(&reading, definition->arguments[i], initial, &value);
    } else if (instance) {
      zs_place place = zs_element_place(instance);
      place.attribute = name;
      zs_report(x->diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL,
                "missing; expected a number, an argument of '%s'", definition->name);
    } else {
      reading.unknown = true;
    }
    scopes[i] = (zs_scope){name, value, !reading.unknown, before};
  }
}

static zs_node *instantiate(expansion *x, const zs_element *instance,
                            const zs_definition *definition, const struct zs_placement *placement)
{
  size_t count = definition->argument_count;
  zs_scope *scopes = ZS_ARENA_NEW(x->arena, zs_scope, count);
  if (!scopes) {
    halt_for_memory(x);
    return NULL;
  }
  unsigned errors = x->diag->errors;
  bind_arguments(x, instance, definition, scopes);
  if (x->diag->errors != errors)
    return NULL;
  return expand_body(x, definition->element, &zs_document_define,
                     count ? &scopes[count - 1] : NULL, definition->name, placement);
}

static void expand_instance(expansion *x, const zs_element *element)
{
  unsigned errors = x->diag->errors;
  struct zs_placement placement;
  unsigned placed = 0;
  zs_reading reading = reading_of(x);
  const struct zs_document_instance *instance =
    zs_attributes_read(&reading, element, (zs_attribute_rule){&zs_document_instance, true, true},
                       NULL, &placement, &placed);
  const zs_xml_attribute *of = zs_element_attribute(element, "of");
  expand_children(x, element, (context){&zs_document_instance, element});
  if (!instance) {
    halt(x);
    return;
  }
  if (!of)
    return;
  const zs_scene *scene = x->scene;
  const zs_name *entry = zs_names_find(&scene->definition_names, of->value, of->length);
  if (!entry) {
    zs_place place = zs_attribute_place(element, of, 0);
    zs_fail_reference(&place, "definition", of->value, &scene->definition_names, x->diag);
    return;
  }
  const zs_definition *definition = &scene->definitions.items[entry->value];
  check_arguments(x, element, definition);
  for (const frame *f = x->frame; f; f = f->outer) {
    if (f->element == definition->element) {
      fail_circle(x, element, of, f->element);
      return;
    }
  }
  if (x->diag->errors != errors)
    return;
  zs_node *node = instantiate(x, element, definition, placed ? &placement : NULL);
  if (node)
    push(x, node);
}

/* ---- repeat ------------------------------------------------------------ */

/* How many values a counter takes.  The last one counts although it may be
 * missed by rounding. */
static double iterations_of(const struct zs_document_repeat *repeat)
{
  double steps = (repeat->to - repeat->from) / repeat->step;
  return floor(steps + 1e-9 * fmax(1, fabs(steps))) + 1;
}

static void run_repeat(expansion *x, const zs_element *element, context c,
                       const struct zs_document_repeat *repeat, bool unknown)
{
  double count = unknown ? 1 : iterations_of(repeat);
  unsigned errors = x->diag->errors;
  zs_scope scope = {repeat->variable, repeat->from, !unknown, x->scope};
  /* One error in the children tells enough; more of them would be the same. */
  for (double i = 0; i < count && !x->halted && x->diag->errors == errors; i++) {
    if (x->iterations == MAXIMUM_ITERATIONS) {
      zs_place place = zs_element_place(element);
      zs_report(x->diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL,
                "more than %d repetitions in all", MAXIMUM_ITERATIONS);
      halt(x);
      break;
    }
    size_t before = x->iterations;
    scope.value = repeat->from + i * repeat->step;
    x->scope = &scope;
    expand_children(x, element, c);
    x->scope = scope.outer;
    /* Of nested repeats the innermost are counted. */
    x->iterations += x->iterations == before;
  }
}

static void expand_repeat(expansion *x, const zs_element *element, context c)
{
  unsigned errors = x->diag->errors;
  zs_reading reading = reading_of(x);
  const struct zs_document_repeat *repeat = zs_attributes_read(
    &reading, element, (zs_attribute_rule){.kind = &zs_document_repeat}, NULL, NULL, NULL);
  if (!repeat) {
    halt(x);
    return;
  }
  const zs_xml_attribute *variable = zs_element_attribute(element, "for");
  if (variable)
    zs_identifier_check(element, variable, x->diag);
  if (!element->first) {
    zs_place place = zs_element_place(element);
    zs_report(x->diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL, "nothing to repeat inside");
  }
  /* Look at the children even when there is no telling how often. */
  bool failed = x->diag->errors != errors;
  if (!variable || !enter(x, element))
    return;
  run_repeat(x, element, c, repeat, reading.unknown || failed);
  x->unknown = x->unknown || reading.unknown;
  x->depth--;
}

/* ---- Children ---------------------------------------------------------- */

static const zs_kind *find_part(const zs_kind *kind, const char *name)
{
  for (const zs_kind *const *part = kind->parts; part && *part; part++)
    if (strcmp((*part)->name, name) == 0)
      return *part;
  return NULL;
}

/* The first kind that has a part of that name, or NULL. */
static const zs_kind *owner_of_part(const char *name)
{
  for (const zs_kind *const *kind = zs_document_kinds; *kind; kind++)
    if (find_part(*kind, name))
      return *kind;
  for (const zs_kind *const *kind = zs_kinds; *kind; kind++)
    if (find_part(*kind, name))
      return *kind;
  return NULL;
}

static void fail_child(expansion *x, const zs_element *element, const zs_kind *parent)
{
  enum { MOST = 512 };
  const char *names[MOST];
  size_t count = 0;
  zs_place place = zs_element_place(element);
  const zs_kind *owner = owner_of_part(element->name);
  if (owner) {
    zs_report(x->diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL,
              "only allowed in <%s>, not in <%s>", owner->name, parent->name);
    return;
  }
  for (const zs_kind *const *part = parent->parts; part && *part && count < MOST; part++)
    names[count++] = (*part)->name;
  if (parent->children != ZS_CHILDREN_NONE) {
    for (const zs_kind *const *kind = zs_kinds; *kind && count < MOST - 3; kind++)
      names[count++] = (*kind)->name;
    names[count++] = "use";
    names[count++] = "instance";
    names[count++] = "repeat";
  }
  char hint[128];
  const char *near = zs_suggest(element->name, names, count);
  if (near)
    snprintf(hint, sizeof hint, "did you mean <%s>?", near);
  zs_report(x->diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, near ? hint : NULL, "unknown element");
}

static void expand_child(expansion *x, const zs_element *child, context c)
{
  const zs_kind *part = find_part(c.kind, child->name);
  const zs_kind *document = part ? NULL : zs_document_kind_find(child->name);
  if (document && !zs_document_kind_is_node(document))
    document = NULL;
  const zs_kind *kind = part || document ? NULL : zs_kind_find(child->name);
  bool nodes = c.kind->children != ZS_CHILDREN_NONE;
  if (part && zs_document_kind_find(c.kind->name)) {
    /* The scene's and a definition's own elements have been read already. */
    if (child->parent != c.element)
      fail_child(x, child, zs_document_kind_find(child->parent->name));
  } else if (part) {
    expand_node(x, child, part);
  } else if (document == &zs_document_repeat && (nodes || c.kind->parts)) {
    expand_repeat(x, child, c);
  } else if ((document || kind) && !nodes) {
    zs_place place = zs_element_place(child);
    zs_report(x->diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL, "<%s> takes no node inside",
              c.kind->name);
  } else if (document == &zs_document_use) {
    expand_use(x, child);
  } else if (document == &zs_document_instance) {
    expand_instance(x, child);
  } else if (kind) {
    expand_node(x, child, kind);
  } else {
    fail_child(x, child, c.kind);
  }
}

static void expand_children(expansion *x, const zs_element *parent, context c)
{
  for (const zs_element *child = parent->first; child && !x->halted; child = child->next)
    expand_child(x, child, c);
}

/* ---- Whole scenes ------------------------------------------------------ */

static bool begin(expansion *x, zs_scene *scene, zs_arena *arena, zs_diag *diag)
{
  *x = (expansion){.scene = scene, .arena = arena, .diag = diag};
  x->objects = calloc(scene->objects.count + 1, sizeof *x->objects);
  return x->objects || zs_fail_memory(diag);
}

static void end(expansion *x)
{
  free(x->objects);
  free(x->stack);
}

/* The first node of a file that stands outside of its objects, or NULL. */
static const zs_element *bare_node(const zs_file *file)
{
  for (const zs_element *e = file->root->first; e; e = e->next)
    if (!find_part(&zs_document_scene, e->name))
      return e;
  return NULL;
}

/* The index of the last object that stands in a file (NULL: in any), or
 * SIZE_MAX. */
static size_t last_object(const zs_scene *scene, const zs_file *file)
{
  for (size_t i = scene->objects.count; i > 0; i--)
    if (!file || zs_file_of(scene->objects.items[i - 1].element) == file)
      return i - 1;
  return SIZE_MAX;
}

/* The main object: `main`, or the last object of the scene's own file, or else
 * the nodes in its root (SIZE_MAX), or else the last object it includes. */
static size_t main_object(const zs_scene *scene)
{
  const char *name = scene->attributes.main;
  const zs_name *entry = zs_names_find(&scene->object_names, name, strlen(name));
  if (entry)
    return entry->value;
  size_t own = last_object(scene, scene->files);
  return own == SIZE_MAX && !bare_node(scene->files) ? last_object(scene, NULL) : own;
}

static void warn_of_unused_nodes(const zs_scene *scene, zs_diag *diag)
{
  const zs_element *bare = bare_node(scene->files);
  size_t index = main_object(scene);
  if (!bare || index == SIZE_MAX)
    return;
  zs_place place = zs_element_place(bare);
  zs_report(diag, ZS_WARNING, ZS_OK, &place, NULL, "not part of the main object, '%s'",
            scene->objects.items[index].id);
}

void zs_scene_validate(zs_scene *scene, zs_diag *diag)
{
  zs_arena arena = {0};
  expansion x;
  if (begin(&x, scene, &arena, diag)) {
    for (size_t i = 0; i < scene->definitions.count && !x.halted; i++)
      instantiate(&x, NULL, &scene->definitions.items[i], NULL);
    for (size_t i = 0; i < scene->objects.count && !x.halted; i++)
      object_node(&x, i);
    for (const zs_file *file = scene->files; file && !x.halted; file = file->next)
      expand_children(&x, file->root, (context){&zs_document_scene, file->root});
    warn_of_unused_nodes(scene, diag);
    end(&x);
  }
  zs_arena_free(&arena);
}

static zs_node *main_node(expansion *x)
{
  const zs_scene *scene = x->scene;
  const zs_element *root = scene->files->root;
  size_t index = main_object(scene);
  if (index != SIZE_MAX)
    return object_node(x, index);
  if (bare_node(scene->files))
    return expand_body(x, root, &zs_document_scene, NULL, "scene", NULL);
  zs_place place = zs_element_place(root);
  zs_report(x->diag, ZS_ERROR, ZS_ERROR_SCHEMA, &place, NULL,
            "the scene describes no solid; expected an object or a node");
  return NULL;
}

static zs_node *named_node(expansion *x, const char *object)
{
  const zs_scene *scene = x->scene;
  const zs_name *entry = zs_names_find(&scene->object_names, object, strlen(object));
  if (entry)
    return object_node(x, entry->value);
  zs_fail_reference(NULL, "object", object, &scene->object_names, x->diag);
  return NULL;
}

bool zs_scene_expand(zs_scene *scene, const char *object, zs_arena *arena, zs_tree *tree,
                     zs_diag *diag)
{
  zs_gate gate;
  expansion x;
  *tree = (zs_tree){0};
  zs_gate_open(&gate, diag, &scene->warned);
  zs_scene_update(scene, &gate.diag);
  if (gate.diag.errors == 0 && begin(&x, scene, arena, &gate.diag)) {
    tree->root = object ? named_node(&x, object) : main_node(&x);
    tree->node_count = x.nodes;
    tree->has_domain = zs_scene_domain(scene, tree->domain_lo, tree->domain_hi, &gate.diag);
    end(&x);
  }
  return zs_gate_close(&gate) && tree->root;
}

bool zs_scene_expand_all(zs_scene *scene, zs_arena *arena, const zs_node *const **roots,
                         size_t *count, zs_diag *diag)
{
  zs_gate gate;
  expansion x;
  zs_gate_open(&gate, diag, &scene->warned);
  zs_scene_update(scene, &gate.diag);
  *count = 1 + scene->objects.count;
  const zs_node **nodes = ZS_ARENA_NEW(arena, const zs_node *, *count);
  if (!nodes) {
    zs_fail_memory(&gate.diag);
  } else if (gate.diag.errors == 0 && begin(&x, scene, arena, &gate.diag)) {
    nodes[0] = main_node(&x);
    for (size_t i = 0; i < scene->objects.count; i++)
      nodes[1 + i] = object_node(&x, i);
    end(&x);
  }
  *roots = nodes;
  return zs_gate_close(&gate);
}

/* ---- Places of nodes --------------------------------------------------- */

zs_place zs_node_place(const zs_node *node, const char *attribute)
{
  const zs_xml_attribute *written =
    node->element ? zs_element_attribute(node->element, attribute) : NULL;
  if (written)
    return zs_attribute_place(node->element, written, 0);
  zs_place place = node->place;
  place.attribute = attribute;
  if (node->element && node->element->text && node->kind->text &&
      strcmp(attribute, "formula") == 0)
    return zs_text_place(node->element, 0);
  return place;
}
