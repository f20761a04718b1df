/* Nodes with random attributes, made from the table of kinds, for tests. */
#ifndef ZS_TEST_RANDOM_NODES_H
#define ZS_TEST_RANDOM_NODES_H

#include "build.h"

/* Kinds that need input from files, or fit many functions; tests of their own hold them. */
static inline bool needs_data(const zs_kind *kind)
{
  return !strcmp(kind->name, "variational") || !strcmp(kind->name, "image") ||
         !strcmp(kind->name, "fit-points") || !strcmp(kind->name, "space-map") ||
         !strcmp(kind->name, "lattice-warp") ||
         !strcmp(kind->name, "path") || !strcmp(kind->name, "curved-polygon") ||
         !strcmp(kind->name, "stack") || !strcmp(kind->name, "minkowski-morph") ||
         kind->family == ZS_FAMILY_DATA;
}

static inline double random_number(const zs_attribute *attribute, uint64_t *state)
{
  const char *unit = attribute->unit;
  double size = !strcmp(unit, "degrees") ? 180 : !strcmp(unit, "degrees per length") ? 40 : 1.5;
  switch (attribute->range) {
  case ZS_RANGE_POSITIVE:
    return random_between(state, 0.2, size);
  case ZS_RANGE_NOT_NEGATIVE:
    return random_below(state, 4) ? random_between(state, 0.05, size / 3) : 0;
  case ZS_RANGE_NOT_ZERO:
    return random_between(state, 0.4, size) * (random_below(state, 2) ? 1 : -1);
  case ZS_RANGE_BETWEEN:
    return random_between(state, attribute->minimum, attribute->maximum);
  default:
    return random_between(state, -size, size);
  }
}

/* Kinds that want children with ends. */
static inline bool wants_ends(const zs_kind *kind)
{
  return !strcmp(kind->name, "repeat-grid") || !strcmp(kind->name, "repeat-polar");
}

static inline void random_polygon(zs_arena *arena, zs_node *node, uint64_t *state)
{
  double points[2 * 60];
  const size_t count = 3 + random_below(state, 58);
  for (size_t i = 0; i < count; i++) {
    const double angle = 6.283185307179586 * (double)i / (double)count;
    const double r = random_between(state, 0.3, 1.5);
    points[2 * i] = r * cos(angle);
    points[2 * i + 1] = r * sin(angle);
  }
  set_numbers(arena, node, "points", points, 2 * count);
}

static inline void random_triangle(zs_arena *arena, zs_node *node, uint64_t *state)
{
  double points[9];
  for (int i = 0; i < 9; i++)
    points[i] = random_between(state, -1.5, 1.5);
  set_numbers(arena, node, "points", points, 9);
}

static inline void random_matrix(zs_arena *arena, zs_node *node, uint64_t *state)
{
  double values[12];
  for (int i = 0; i < 12; i++)
    values[i] = random_between(state, -0.5, 0.5) + (i % 5 == 0);
  set_numbers(arena, node, "values", values, 12);
}

static inline void random_formula(zs_arena *arena, zs_node *node, const zs_attribute *attribute,
                           uint64_t *state)
{
  static const char *const coordinates[] = {"x + 0.2 * sin(y)", "y - 0.3 * z * z", "z * 1.2 + x",
                                            "x * cos(z / 3) - y * sin(z / 3)"};
  static const char *const values[] = {"f - 0.1 * x", "0.5 * f + 0.1", "max(f, -0.2)"};
  static const char *const solids[] = {"let r = hypot(x, y); 0.3 - hypot(r - 1, z)",
                                       "1 - x^2 - y^2 - z^4", "sin(2*x) + cos(3*y) - z"};
  const char *text = !strcmp(attribute->name, "value")     ? values[random_below(state, 3)]
                     : !strcmp(attribute->name, "formula") ? solids[random_below(state, 3)]
                                                           : coordinates[random_below(state, 4)];
  set_formula(arena, node, attribute->name, text);
}

static inline void random_attribute(zs_arena *arena, zs_node *node, const zs_attribute *attribute,
                             uint64_t *state)
{
  const int count = components(attribute);
  double values[3];
  if (count) {
    for (int i = 0; i < count; i++)
      values[i] = !strcmp(attribute->name, "count") ? (double)random_below(state, 7)
                  : !strcmp(attribute->name, "spacing") && random_below(state, 4)
                    ? random_between(state, 0.5, 1.5)
                  : !strcmp(attribute->name, "spacing") ? 0 : random_number(attribute, state);
    set_vector(node, attribute->name, values);
  } else if (attribute->type == ZS_INTEGER) {
    int step = (int)(attribute->maximum - attribute->minimum) + 1;
    unsigned few = step < 6 ? (unsigned)step : 6;
    set(node, attribute->name, attribute->minimum + random_below(state, few));
  } else if (attribute->type == ZS_CHOICE) {
    unsigned n = 0;
    while (attribute->choices[n])
      n++;
    choose(node, attribute->name, attribute->choices[random_below(state, n)]);
  } else if (attribute->type == ZS_BOOLEAN) {
    *(bool *)field_of(node, attribute) = random_below(state, 2);
    mark_given(node, attribute);
  } else if (attribute->type == ZS_FORMULA) {
    random_formula(arena, node, attribute, state);
  } else if (!strcmp(node->kind->name, "triangle")) {
    random_triangle(arena, node, state);
  } else if (!strcmp(attribute->name, "points")) {
    random_polygon(arena, node, state);
  } else if (!strcmp(attribute->name, "values")) {
    random_matrix(arena, node, state);
  } else {
    fail_msg("<%s> %s: the test does not know how to make one", node->kind->name, attribute->name);
  }
}

/* Whether a kind's children stand in parts of it, or its parts are numbers only. */
static inline bool has_children_in_parts(const zs_kind *kind)
{
  return kind->parts && kind->parts[0]->children != ZS_CHILDREN_NONE &&
         kind->children == ZS_CHILDREN_NONE;
}

static inline bool has_plain_parts(const zs_kind *kind)
{
  return kind->parts && !has_children_in_parts(kind);
}

static inline bool needs_file(const zs_kind *kind)
{
  for (size_t i = 0; i < kind->attribute_count; i++)
    if (kind->attributes[i].type == ZS_FILE)
      return true;
  return false;
}

static inline zs_node *random_child(zs_arena *arena, uint64_t *state);

/* A node with random attributes and plain parts that its check accepts; no children yet. */
static inline zs_node *random_leaf(zs_arena *arena, const zs_kind *kind, uint64_t *state)
{
  for (int attempt = 0; attempt < 2000; attempt++) {
    zs_node *node = node_of_kind(arena, kind);
    for (size_t i = 0; i < kind->attribute_count; i++) {
      const zs_attribute *attribute = &kind->attributes[i];
      if (!attribute->initial || random_below(state, 2))
        random_attribute(arena, node, attribute, state);
    }
    size_t kinds = 0;
    while (has_plain_parts(kind) && kind->parts[kinds] && !needs_file(kind->parts[kinds]))
      kinds++;
    for (unsigned i = 0, n = kinds ? 2 + random_below(state, 3) : 0; i < n; i++) {
      zs_node *part = random_leaf(arena, kind->parts[random_below(state, kinds)], state);
      if (part->kind->children != ZS_CHILDREN_NONE)
        adopt(arena, part, random_child(arena, state));
      adopt(arena, node, part);
    }
    const bool later = has_children_in_parts(kind) || kind->children == ZS_CHILDREN_TWO;
    if (!kind->check || later || kind->check(node, NULL))
      return node;
  }
  fail_msg("<%s>: no random attributes are accepted", kind->name);
  return NULL;
}

static inline zs_node *random_child(zs_arena *arena, uint64_t *state)
{
  static const char *const names[] = {"sphere",    "box",     "torus",   "cylinder", "capsule",
                                      "ellipsoid", "polygon", "rectangle", "cone",   "slab"};
  zs_node *child =
    random_leaf(arena, zs_kind_find(names[random_below(state, ZS_COUNT_OF(names))]), state);
  if (random_below(state, 2)) {
    const double at[3] = {random_between(state, -0.5, 0.5), random_between(state, -0.5, 0.5),
                          random_between(state, -0.5, 0.5)};
    place_at(arena, child, at, random_between(state, -180, 180), random_between(state, 0.7, 1.4));
  }
  return child;
}

/* One more child than it has, in a part of its own at `at` where there are such. */
static inline void add_child(zs_arena *arena, zs_node *node, zs_node *child, double at)
{
  if (has_children_in_parts(node->kind))
    child = adopt(arena, set(node_of_kind(arena, node->kind->parts[0]), "at", at), child);
  if (wants_ends(node->kind)) {
    zs_node *room = set3(node_named(arena, "box"), "size", 1.2, 0.9, 0.8);
    child = adopt(arena, adopt(arena, node_named(arena, "intersection"), room), child);
  }
  adopt(arena, node, child);
}

/* Whether children are missing, by the kind's own account. */
static inline bool wants_more(const zs_node *node)
{
  return node->kind->check && !node->kind->check(node, NULL);
}

static inline bool takes_children(const zs_kind *kind)
{
  return kind->children != ZS_CHILDREN_NONE || has_children_in_parts(kind);
}

/* Anchors of a morph between the shapes that it has, near to where they were. */
static inline void add_anchors(zs_arena *arena, zs_node *morph, uint64_t *state)
{
  const size_t shapes = morph->child_count;
  for (size_t n = random_below(state, 6); n > 0; n--) {
    zs_node *pair = node_of_kind(arena, morph->kind->parts[1]);
    double ends[3 * 9];
    for (size_t i = 0; i < 3 * shapes; i++)
      ends[i] = i < 3 ? random_between(state, -1.5, 1.5)
                      : ends[i - 3] + random_between(state, -0.2, 0.2);
    set_vector(pair, "from", ends);
    adopt(arena, morph, set_numbers(arena, pair, "to", ends + 3, 3 * (shapes - 1)));
  }
}

static inline zs_node *random_node(zs_arena *arena, const zs_kind *kind, uint64_t *state)
{
  zs_node *node = random_leaf(arena, kind, state);
  if (!takes_children(kind))
    return node;
  double at = -1.5;
  const unsigned few = has_children_in_parts(kind) ? 2 : 1;
  for (unsigned i = 0, n = few + random_below(state, 3); i < n || i < 2 || wants_more(node); i++) {
    add_child(arena, node, random_child(arena, state), at);
    at += random_between(state, 0.3, 1.2);
    assert_true(i < 9);
  }
  if (!strcmp(kind->name, "distance-morph"))
    add_anchors(arena, node, state);
  return node;
}

#endif
