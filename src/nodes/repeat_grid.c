/* Copies of the child along the axes. */
#include "field/fold.h"
#include "nodes/common.h"
#include "nodes/copies.h"
#include "nodes/extent.h"

#include <math.h>

enum { FIRST, MIDDLE };
static const char *const anchors[] = {"first", "middle", NULL};

/* Single precision still tells that many copies apart. */
static const double MOST_COUNT = 1e6;

struct repeat_grid {
  double spacing[3], count[3];
  int anchor;
};

static const zs_attribute attributes[] = {
  {.name = "spacing",
   .type = ZS_SCALE,
   .offset = offsetof(struct repeat_grid, spacing),
   .initial = NULL,
   .unit = "length",
   .range = ZS_RANGE_NOT_NEGATIVE,
   .doc = "from a copy to the next along x, y and z, or one number for all; 0: no copies along "
          "that axis"},
  {.name = "count",
   .type = ZS_SCALE,
   .offset = offsetof(struct repeat_grid, count),
   .initial = "0",
   .unit = "1",
   .range = ZS_RANGE_NOT_NEGATIVE,
   .doc = "how many copies along x, y and z, or one number for all, up to a million; 0: endlessly "
          "many"},
  ZS_SELECT(struct repeat_grid, anchor, "anchor", "first", anchors,
            "what stays where the child is: its `first` copy, from which the others follow along "
            "the axes, or the `middle` of all; of endlessly many it is the same"),
};

static double count_along(const struct repeat_grid *p, int axis)
{
  return p->spacing[axis] > 0 ? p->count[axis] : 1;
}

static bool check(const zs_node *node, zs_diag *diag)
{
  const struct repeat_grid *p = node->parameters;
  for (int k = 0; k < 3; k++) {
    if (p->count[k] != floor(p->count[k]) || p->count[k] > MOST_COUNT)
      return zs_node_fail(node, diag, "count",
                          "%.10g is not a whole number from 0 to %.0f", p->count[k], MOST_COUNT);
    if (p->spacing[k] == 0 && p->count[k] > 1 && zs_node_has(node, "count") &&
        !(p->count[0] == p->count[1] && p->count[1] == p->count[2]))
      return zs_node_fail(node, diag, "count",
                          "%g copies along %s, where the spacing is 0; expected 0 or 1",
                          p->count[k], zs_axis_names[k]);
  }
  return true;
}

/* How far the first copy is from the child. */
static double moved_along(const struct repeat_grid *p, int axis)
{
  const double count = count_along(p, axis);
  return p->anchor == MIDDLE && count > 1 ? -(count - 1) / 2 * p->spacing[axis] : 0;
}

typedef struct grid {
  zs_compiler *compiler;
  const zs_node *node;
  const struct repeat_grid *parameters;
  const zs_coordinates *at; /* of the first copy */
  zs_copies copies[3];
  bool folded;              /* along any axis */
} grid;

static zs_fold fold_of(const grid *g, int axis, int place, zs_fold_part part)
{
  const zs_copies *c = &g->copies[axis];
  const double count = count_along(g->parameters, axis);
  return (zs_fold){.step = g->parameters->spacing[axis],
                   .shift = c->shift,
                   .least = count > 0 ? 0 : -INFINITY,
                   .most = count > 0 ? count - 1 : INFINITY,
                   .fade = c->fade,
                   .place = place,
                   .part = (int)part};
}

/* The coordinate in a candidate along an axis. */
static zs_value coordinate_of(const grid *g, int axis, int place)
{
  if (g->copies[axis].folded) {
    const zs_fold fold = fold_of(g, axis, place, ZS_FOLD_PLACE);
    return zs_emit_fold(g->compiler, g->at, axis, &fold);
  }
  double by[3] = {0};
  by[axis] = place * g->parameters->spacing[axis];
  const zs_coordinates moved = zs_coordinates_moved(g->at, by);
  return zs_emit_coordinate(g->compiler, &moved, axis);
}

static zs_value child_of(const grid *g, const int place[3])
{
  zs_coordinates child;
  if (g->folded) {
    zs_value p[3];
    for (int k = 0; k < 3; k++)
      p[k] = coordinate_of(g, k, place[k]);
    child = zs_coordinates_from(p[0], p[1], p[2]);
  } else {
    double by[3];
    for (int k = 0; k < 3; k++)
      by[k] = place[k] * g->parameters->spacing[k];
    child = zs_coordinates_moved(g->at, by);
  }
  return zs_children_emit(g->compiler, g->node, &child);
}

/* The union of the candidates along an axis and those behind it. */
static zs_value united(const grid *g, int axis, int place[3])
{
  if (axis == 3)
    return child_of(g, place);
  const int count = (int)g->copies[axis].candidates;
  zs_value all = 0;
  for (int i = 0; i < count; i++) {
    place[axis] = i;
    zs_value f = united(g, axis + 1, place);
    if (g->copies[axis].folded && (i == 0 || i == count - 1)) {
      const zs_fold fold =
        fold_of(g, axis, i, i == 0 ? ZS_FOLD_FADE_FIRST : ZS_FOLD_FADE_LAST);
      f = zs_emit_faded(g->compiler, f, zs_emit_fold(g->compiler, g->at, axis, &fold));
    }
    all = i ? zs_emit(g->compiler, ZS_FUNCTION_MAXIMUM, all, f, 0) : f;
  }
  return all;
}

/* Find how many candidates there are; false after reporting that there are too many. */
static bool plan(grid *g, const zs_box *box)
{
  const struct repeat_grid *p = g->parameters;
  zs_diag *diag = zs_compiler_diag(g->compiler);
  double all = 1;
  for (int k = 0; k < 3; k++) {
    const double count = count_along(p, k);
    g->copies[k] = count == 1 ? (zs_copies){.candidates = 1}
                              : zs_copies_of(box->lo[k], box->hi[k], p->spacing[k], count);
    g->folded |= g->copies[k].folded;
    all *= g->copies[k].candidates;
    if (isinf(all))
      return zs_node_fail(g->node, diag, "spacing",
                          "no ends of the child are found along %s, of which there are endlessly "
                          "many copies; expected a child with ends (intersect it with a <box>), a "
                          "count, or a spacing of 0 along %s",
                          zs_axis_names[k], zs_axis_names[k]);
  }
  if (all <= ZS_MOST_COPIES)
    return zs_copies_allowed(g->compiler, g->node, all);
  return zs_node_fail(g->node, diag, "spacing",
                      "up to %g copies of the child come together at one place; expected at most "
                      "%d: a wider spacing or a smaller child", all, ZS_MOST_COPIES);
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct repeat_grid *p = node->parameters;
  unsigned axes = 0;
  double by[3];
  for (int k = 0; k < 3; k++) {
    const double count = count_along(p, k);
    axes |= (unsigned)(count == 0 || count > 2) << k; /* of two none can be left out */
    by[k] = moved_along(p, k);
  }
  zs_box box = zs_box_everything();
  if (axes && !zs_children_extent(compiler, node, axes, &box))
    return zs_children_emit(compiler, node, at);
  const zs_coordinates first = zs_coordinates_moved(at, by);
  grid g = {.compiler = compiler, .node = node, .parameters = p, .at = &first};
  int place[3];
  return plan(&g, &box) ? united(&g, 0, place) : zs_emit_constant(compiler, -1);
}

static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)count;
  const struct repeat_grid *p = node->parameters;
  zs_box all = children[0];
  for (int k = 0; k < 3; k++) {
    const double copies = count_along(p, k), from = moved_along(p, k);
    all.lo[k] += copies > 0 ? from : -INFINITY;
    all.hi[k] += copies > 0 ? from + (copies - 1) * p->spacing[k] : INFINITY;
  }
  return all;
}

const zs_kind zs_kind_repeat_grid = {
  .name = "repeat-grid",
  .family = ZS_FAMILY_COORDINATE_MAP,
  .summary = "copies of the child at even distances along the axes, counted or endless",
  .doc = "The solid is the union of the copies, also where they overlap. Space is folded instead of "
         "adding copy to copy: what a point costs depends on how many copies come together there, "
         "two along an axis for a child that is a little smaller than the spacing, and not on their "
         "number. Of an exact distance the result is one, outside; any child's values are "
         "continuous, but far away from the copies near to a point they do not count. Of endlessly "
         "many copies the child must have ends along the axis. Intersect them with another solid "
         "to have an end.",
  .source = "J. C. Hart, Sphere tracing: a geometric method for the antialiased ray tracing of "
            "implicit surfaces, 1996",
  .trait = "keeps distances outside",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct repeat_grid),
  .children = ZS_CHILDREN_ONE,
  .check = check,
  .emit = emit,
  .box = box,
};
