/* Polygons whose edges are straight or arcs of circles, by a tree of R-functions. */
#include "nodes/common.h"

#include "field/blend.h"
#include "samples/arc_tree.h"

#include <math.h>
#include <stdlib.h>

enum {
  MOST_EDGES = 4000, /* by authors */
  MOST_LEVELS = 60   /* of r0, each of which may make f 3.4 times larger */
};

enum { R0, MIN_MAX };
static const char *const functions[] = {"r0", "min-max", NULL};

struct curved_polygon {
  int function;
};

struct line {
  double to[2];
};

struct arc {
  double to[2], through[2], bulge;
};

static const zs_attribute attributes[] = {
  ZS_SELECT(struct curved_polygon, function, "r-function", "r0", functions,
            "which functions join the edges: `r0`, smooth but on the edges themselves and where "
            "their lines meet; `min-max`, which keeps a distance bound"),
};

#define PLANE_POINT(struct_, member, name_, initial_, doc_) \
  {.name = name_, .type = ZS_VECTOR2, .offset = offsetof(struct_, member), .initial = initial_, \
   .unit = "length", .doc = doc_}

static const zs_attribute line_attributes[] = {
  PLANE_POINT(struct line, to, "to", NULL, "where the edge ends"),
};

static const zs_attribute arc_attributes[] = {
  PLANE_POINT(struct arc, to, "to", NULL, "where the edge ends"),
  PLANE_POINT(struct arc, through, "through", "", "a point of the arc between its ends"),
  ZS_PLAIN(struct arc, bulge, "bulge", "", ZS_RANGE_NOT_ZERO,
           "instead of `through`: how high the arc is, by half of the way between its ends; 1 is "
           "half a circle. Positive: it is to the right of that way"),
};

static bool check_arc(const zs_node *node, zs_diag *diag)
{
  const bool through = zs_node_has(node, "through"), bulge = zs_node_has(node, "bulge");
  if (through == bulge)
    return zs_node_misuse(node, diag, through ? "bulge" : NULL,
                          through ? "'bulge' cannot be combined with 'through'"
                                  : "neither 'through' nor 'bulge' is there; expected one of them");
  return true;
}

static const zs_kind line_kind = {
  .name = "line",
  .family = ZS_FAMILY_PART,
  .summary = "a straight edge, from the end of the edge before",
  .attributes = line_attributes,
  .attribute_count = ZS_COUNT_OF(line_attributes),
  .parameters_size = sizeof(struct line),
  .children = ZS_CHILDREN_NONE,
};

static const zs_kind arc_kind = {
  .name = "arc",
  .family = ZS_FAMILY_PART,
  .summary = "an arc of a circle, from the end of the edge before",
  .attributes = arc_attributes,
  .attribute_count = ZS_COUNT_OF(arc_attributes),
  .parameters_size = sizeof(struct arc),
  .children = ZS_CHILDREN_NONE,
  .check = check_arc,
};

/* ---- Edges ------------------------------------------------------------------------------ */

static const double *end_of(const zs_node *part)
{
  return part->kind == &arc_kind ? ((const struct arc *)part->parameters)->to
                                 : ((const struct line *)part->parameters)->to;
}

/* The edges as written; false after reporting. */
static bool read_edges(const zs_node *node, zs_arc_ring *r, zs_diag *diag)
{
  const size_t count = node->child_count;
  for (size_t i = 0; i < count; i++) {
    const zs_node *part = node->children[i], *before = node->children[i ? i - 1 : count - 1];
    const double *a = end_of(before), *b = end_of(part);
    zs_arc_edge e = {.from = {a[0], a[1]}, .pieces = 1};
    if (a[0] == b[0] && a[1] == b[1])
      return zs_node_fail(part, diag, "to", "the edge ends where it begins, at %g %g", b[0], b[1]);
    if (part->kind == &arc_kind) {
      const struct arc *arc = part->parameters;
      e.bulge = arc->bulge;
      if (isnan(arc->bulge) && !zs_arc_bulge(a, b, arc->through, &e.bulge))
        return zs_node_fail(part, diag, "through", "%g %g is on the line of the arc's ends",
                            arc->through[0], arc->through[1]);
      e.pieces = fabs(e.bulge) > 1 ? 4 : 1;
    }
    r->edges[r->count++] = e;
  }
  return true;
}

/* The edges as written, but counter-clockwise; false after reporting. */
static bool prepare(const zs_node *node, zs_arc_ring *r, zs_diag *diag)
{
  bool memory = true;
  r->edges = malloc((node->child_count + 1) * sizeof *r->edges);
  if (!r->edges)
    return zs_fail_memory(diag);
  if (!read_edges(node, r, diag))
    return false;
  if (zs_arc_area(r) < 0)
    zs_arc_reverse(r);
  if (zs_arc_is_simple(r, &memory)) {
    zs_arc_choose_pieces(r);
    return true;
  }
  return memory ? zs_node_fail(node, diag, NULL,
                               "edges cross or touch each other, or enclose nothing")
                : zs_fail_memory(diag);
}

/* ---- f ----------------------------------------------------------------------------------- */

typedef struct emitter {
  zs_compiler *compiler;
  const zs_coordinates *at;
  const zs_arc_ring *ring;
  int function;
} emitter;

static zs_value join(const emitter *e, bool all, zs_value x, zs_value y)
{
  if (e->function == MIN_MAX)
    return zs_emit(e->compiler, all ? ZS_FUNCTION_MINIMUM : ZS_FUNCTION_MAXIMUM, x, y, 0);
  const zs_blend data = {.side = all ? ZS_BLEND_INTERSECTION : ZS_BLEND_UNION};
  return zs_emit_operation(e->compiler, &zs_r_alpha, &data, x, y, 0);
}

static zs_value emit_edge(const emitter *e, size_t i)
{
  const zs_arc_ring *r = e->ring;
  const double *from = r->edges[i % r->count].from, *to = zs_arc_next(r, i % r->count)->from;
  const double bulge = r->edges[i % r->count].bulge;
  const double x = to[0] - from[0], y = to[1] - from[1], length = hypot(x, y);
  const double rows[12] = {-y / length, x / length, 0, (y * from[0] - x * from[1]) / length,
                           0, 1, 0, 0, 0, 0, 1, 0};
  const zs_coordinates along = zs_coordinates_affine(e->at, rows);
  const zs_value side = zs_emit_coordinate(e->compiler, &along, 0);
  if (bulge == 0)
    return side;
  double centre[3] = {0, 0, 0};
  const double radius = zs_arc_circle(from, to, bulge, centre);
  const zs_coordinates about = zs_coordinates_moved(e->at, centre);
  const zs_value disc =
    zs_emit_primitive(e->compiler, ZS_PRIMITIVE_TUBE, (const double[4]){radius}, &about);
  return bulge > 0 ? join(e, false, side, disc)
                   : join(e, true, side, zs_emit_negated(e->compiler, disc));
}

/* `count` items from `*next` on, which is moved behind them: joined by halves, so that f is not
 * more distorted than it must be. */
static zs_value emit_items(const emitter *e, bool all, const zs_arc_item **next, size_t count)
{
  if (count == 1) {
    const zs_arc_item *i = *next, *first = i->first;
    *next = i->next;
    return i->kind == ZS_ARC_EDGE ? emit_edge(e, i->edge)
                           : emit_items(e, i->kind == ZS_ARC_ALL, &first, i->count);
  }
  const zs_value half = emit_items(e, all, next, count / 2);
  return join(e, all, half, emit_items(e, all, next, count - count / 2));
}

static bool find_tree(const zs_node *node, zs_arc_tree *tree, zs_arc_ring *outline, zs_diag *diag)
{
  const struct curved_polygon *p = node->parameters;
  if (!zs_arc_tree_build(tree, outline))
    return zs_fail_memory(diag);
  if (p->function == R0 && tree->levels > MOST_LEVELS)
    return zs_node_fail(node, diag, "r-function",
                        "the outline needs %u functions on top of each other, too many for r0; "
                        "expected min-max", tree->levels);
  return true;
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  zs_diag *diag = zs_compiler_diag(compiler);
  zs_arc_ring outline = {0};
  zs_arc_tree tree = {.levels = 0};
  zs_value value = zs_emit_constant(compiler, 0);
  if (prepare(node, &outline, diag) && find_tree(node, &tree, &outline, diag)) {
    const struct curved_polygon *p = node->parameters;
    const emitter e = {compiler, at, &tree.ring, p->function};
    const zs_arc_item *next = tree.root.first;
    value = emit_items(&e, true, &next, tree.root.count);
  }
  zs_arc_tree_free(&tree);
  free(outline.edges);
  return value;
}

static bool check(const zs_node *node, zs_diag *diag)
{
  if (node->child_count < 2)
    return zs_node_misuse(node, diag, NULL, "%zu edges enclose nothing; expected two or more",
                          node->child_count);
  return node->child_count <= MOST_EDGES ||
         zs_node_misuse(node, diag, NULL, "%zu edges; expected at most %d", node->child_count,
                        MOST_EDGES);
}

static const zs_kind *const parts[] = {&line_kind, &arc_kind, NULL};

const zs_kind zs_kind_curved_polygon = {
  .name = "curved-polygon",
  .family = ZS_FAMILY_SHAPE,
  .summary = "a polygon whose edges are lines and arcs, as R-functions of its edges",
  .doc = "The edges follow one another, either way round, and the first one begins where the last "
         "one ends. f is positive inside, 0 on the edges and nowhere else, and infinitely often "
         "differentiable but on lines through corners (with `r0`). It is a tree of intersections "
         "and unions of half-planes and discs in which every edge stands once.",
  .source = "V. L. Rvachev, Theory of R-functions (1982); Dobkin, Guibas, Hershberger, Snoeyink, "
            "\"An efficient algorithm for finding the CSG representation of a simple polygon\" (1988)",
  .trait = "distance bound with min-max",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct curved_polygon),
  .children = ZS_CHILDREN_NONE,
  .parts = parts,
  .check = check,
  .emit = emit,
};
