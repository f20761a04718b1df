#include "nodes/skeletal.h"

#include "nodes/common.h"
#include "nodes/extent.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- The parts ------------------------------------------------------------------ */

/* All parts have the same parameters; which corners are written depends on the kind. */
struct part {
  double corner[2][3], radius, weight;
  zs_numbers points;
};

#define RADIUS_AND_WEIGHT \
  ZS_LENGTH(struct part, radius, "radius", "1", ZS_RANGE_POSITIVE, \
            "how far the field reaches, or how wide its kernel is"), \
  ZS_PLAIN(struct part, weight, "weight", "1", ZS_RANGE_NOT_ZERO, \
           "factor of the field; below 0 it takes away")

static const zs_attribute point_attributes[] = {
  ZS_POINT(struct part, corner[0], "at", "0 0 0", "where it is"),
  RADIUS_AND_WEIGHT,
};
static const zs_attribute segment_attributes[] = {
  ZS_POINT(struct part, corner[0], "from", NULL, "one end"),
  ZS_POINT(struct part, corner[1], "to", NULL, "the other end"),
  RADIUS_AND_WEIGHT,
};

#define POINTS(doc_) \
  {.name = "points", .type = ZS_NUMBERS, .offset = offsetof(struct part, points), \
   .initial = NULL, .unit = "length", .doc = doc_}

static const zs_attribute polyline_attributes[] = {
  POINTS("x, y and z of every corner in order"),
  RADIUS_AND_WEIGHT,
};
static const zs_attribute triangle_attributes[] = {
  POINTS("x, y and z of the three corners"),
  RADIUS_AND_WEIGHT,
};

static bool polyline_check(const zs_node *node, zs_diag *diag)
{
  const size_t count = ((const struct part *)node->parameters)->points.count;
  return (count % 3 == 0 && count >= 6) ||
         zs_node_fail(node, diag, "points", "there are %zu numbers; expected x, y and z of at "
                      "least 2 corners", count);
}

static bool triangle_check(const zs_node *node, zs_diag *diag)
{
  const zs_numbers *points = &((const struct part *)node->parameters)->points;
  if (points->count != 9)
    return zs_node_fail(node, diag, "points", "there are %zu numbers; expected 9: x, y and z of 3 "
                        "corners", points->count);
  const double *v = points->values;
  double normal = 0, longest = 0;
  for (int k = 0; k < 3; k++) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    normal = hypot(normal, (v[3 + i] - v[i]) * (v[6 + j] - v[j]) -
                             (v[3 + j] - v[j]) * (v[6 + i] - v[i]));
    longest = fmax(longest, fmax(fabs(v[3 + k] - v[k]), fabs(v[6 + k] - v[k])));
  }
  return normal > 1e-12 * longest * longest ||
         zs_node_fail(node, diag, "points", "the three corners lie on one line; expected a "
                      "triangle, or use <polyline>");
}

#define PART(NAME, SUMMARY, CHECK) \
  static const zs_kind NAME = { \
    .name = #NAME, \
    .family = ZS_FAMILY_PART, \
    .summary = SUMMARY, \
    .attributes = NAME##_attributes, \
    .attribute_count = ZS_COUNT_OF(NAME##_attributes), \
    .parameters_size = sizeof(struct part), \
    .children = ZS_CHILDREN_NONE, \
    .check = CHECK, \
  };
PART(point, "a point of the skeleton", NULL)
PART(segment, "a straight piece of the skeleton", NULL)
PART(polyline, "straight pieces of the skeleton, one after another", polyline_check)
PART(triangle, "a flat piece of the skeleton", triangle_check)

const zs_kind *const zs_skeletal_parts[] = {&point, &segment, &polyline, &triangle, NULL};

/* ---- The skeleton ------------------------------------------------------------------ */

bool zs_skeletal_check(const zs_node *node, zs_diag *diag)
{
  return node->child_count > 0 ||
         zs_node_misuse(node, diag, NULL, "there is no skeleton; expected <point>, <segment>, "
                        "<polyline> or <triangle>");
}

static size_t piece_count(const zs_node *part)
{
  const size_t numbers = ((const struct part *)part->parameters)->points.count;
  return part->kind == &polyline ? numbers / 3 - 1 : 1;
}

/* Fill in one part's pieces. */
static void put_pieces(const zs_node *node, zs_skeleton_piece *pieces)
{
  const struct part *p = node->parameters;
  if (node->kind == &point || node->kind == &segment) {
    pieces->shape = node->kind == &point ? ZS_SKELETON_POINT : ZS_SKELETON_SEGMENT;
    memcpy(pieces->corner, p->corner, sizeof p->corner);
    return;
  }
  const bool flat = node->kind == &triangle;
  const size_t corners = flat ? 3 : 2;
  for (size_t i = 0; i < piece_count(node); i++) {
    pieces[i].shape = flat ? ZS_SKELETON_TRIANGLE : ZS_SKELETON_SEGMENT;
    memcpy(pieces[i].corner, p->points.values + 3 * i, 3 * corners * sizeof(double));
  }
}

/* The skeleton in memory of the arena; NULL when it is out. */
static zs_skeleton *skeleton_of(zs_arena *arena, const zs_node *node, zs_skeleton_field field,
                                double scale)
{
  size_t count = 0;
  for (size_t i = 0; i < node->child_count; i++)
    count += piece_count(node->children[i]);
  zs_skeleton_part *parts = ZS_ARENA_NEW(arena, zs_skeleton_part, node->child_count);
  zs_skeleton_piece *pieces = ZS_ARENA_NEW(arena, zs_skeleton_piece, count);
  if (!parts || !pieces)
    return NULL;
  uint32_t first = 0;
  for (size_t i = 0; i < node->child_count; i++) {
    const struct part *p = node->children[i]->parameters;
    parts[i] = (zs_skeleton_part){.radius = p->radius * scale,
                                  .weight = p->weight,
                                  .first = first,
                                  .count = (uint32_t)piece_count(node->children[i])};
    put_pieces(node->children[i], pieces + first);
    first += parts[i].count;
  }
  return zs_skeleton_new(arena, field, parts, (uint32_t)node->child_count, pieces);
}

zs_value zs_skeletal_emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at,
                          zs_skeleton_field field, double scale, double threshold)
{
  const zs_skeleton *skeleton = skeleton_of(zs_compiler_arena(compiler), node, field, scale);
  if (!skeleton) {
    zs_fail_memory(zs_compiler_diag(compiler));
    return 0;
  }
  const zs_value sum = zs_emit_operation(
    compiler, &zs_skeleton_operation, skeleton, zs_emit_coordinate(compiler, at, 0),
    zs_emit_coordinate(compiler, at, 1), zs_emit_coordinate(compiler, at, 2));
  return zs_emit(compiler, ZS_FUNCTION_SUBTRACT, sum, zs_emit_constant(compiler, threshold), 0);
}

/* Where no field is above its share of the threshold their sum is not above the threshold. */
zs_box zs_skeletal_box(const zs_node *node, zs_skeleton_field field, double scale,
                       double threshold)
{
  zs_arena arena = {0};
  const zs_skeleton *skeleton = skeleton_of(&arena, node, field, scale);
  zs_box all = zs_box_everything();
  for (uint32_t i = 0; skeleton && i < skeleton->part_count; i++) {
    const zs_skeleton_part *part = &skeleton->parts[i];
    zs_box own = {{part->lo[0], part->lo[1], part->lo[2]}, {part->hi[0], part->hi[1], part->hi[2]}};
    own = zs_box_grown(own, zs_skeleton_reach(field, part, threshold / skeleton->part_count));
    all = i ? zs_box_of_union(node, (const zs_box[2]){all, own}, 2) : own;
  }
  zs_arena_free(&arena);
  return all;
}
