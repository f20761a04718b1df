/* Volume warping: space carried along by a lattice of control points. */
#include "field/program.h"
#include "nodes/common.h"
#include "nodes/extent.h"
#include "rbf/dense.h"
#include "samples/warp.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  INVERSE,
  PUSH_FORWARD,
  MOST_DRAGS = 1000,
  MOST_RESOLUTION = 256
};
static const char *const methods[] = {"inverse", "push-forward", NULL};

/* ---- move and drag, parts --------------------------------------------------------- */

struct move {
  double control[3], by[3];
};

static const zs_attribute move_attributes[] = {
  {.name = "control", .type = ZS_VECTOR3, .offset = offsetof(struct move, control), .initial = NULL,
   .unit = "1", .range = ZS_RANGE_NOT_NEGATIVE,
   .doc = "a control point: how many there are before it along x, y and z"},
  ZS_POINT(struct move, by, "by", NULL, "how far it moves"),
};

static const zs_kind move = {
  .name = "move",
  .family = ZS_FAMILY_PART,
  .summary = "a control point and how far it moves",
  .doc = "Several moves of a control point add up.",
  .attributes = move_attributes,
  .attribute_count = ZS_COUNT_OF(move_attributes),
  .parameters_size = sizeof(struct move),
  .children = ZS_CHILDREN_NONE,
};

struct drag {
  double from[3], to[3], radius;
};

static const zs_attribute drag_attributes[] = {
  ZS_POINT(struct drag, from, "from", NULL, "a point of the child"),
  ZS_POINT(struct drag, to, "to", NULL, "where it goes"),
  ZS_LENGTH(struct drag, radius, "radius", "", ZS_RANGE_POSITIVE,
            "control points farther than that stay; not written: all that the point depends on "
            "may move, two spacings around it"),
};

static const zs_kind drag = {
  .name = "drag",
  .family = ZS_FAMILY_PART,
  .summary = "a point of the child and where it is dragged",
  .attributes = drag_attributes,
  .attribute_count = ZS_COUNT_OF(drag_attributes),
  .parameters_size = sizeof(struct drag),
  .children = ZS_CHILDREN_NONE,
};
static const zs_kind *const parts[] = {&move, &drag, NULL};

/* ---- lattice-warp ------------------------------------------------------------------- */

struct lattice_warp {
  double min[3], max[3], size[3];
  int method, resolution;
};

static const zs_attribute attributes[] = {
  ZS_POINT(struct lattice_warp, min, "min", NULL, "corner of the lattice: its first control point"),
  ZS_POINT(struct lattice_warp, max, "max", NULL, "the opposite corner: its last control point"),
  {.name = "size", .type = ZS_SCALE, .offset = offsetof(struct lattice_warp, size), .initial = "9",
   .unit = "1", .range = ZS_RANGE_NOT_NEGATIVE,
   .doc = "control points along x, y and z, 2 to 64, or one number for all"},
  ZS_SELECT(struct lattice_warp, method, "method", "inverse", methods,
            "`inverse`: moves say where f is taken from, and the solid goes the other way; "
            "`push-forward`: the solid goes where the control points go. What is dragged goes "
            "where it is dragged, with both"),
  {.name = "resolution", .type = ZS_INTEGER, .offset = offsetof(struct lattice_warp, resolution),
   .initial = "32", .unit = "1", .range = ZS_RANGE_BETWEEN, .minimum = 1,
   .maximum = MOST_RESOLUTION,
   .doc = "`push-forward`: cells along the longest side of a grid on which the map is inverted "
          "beforehand, as starting points; finer ones cost memory and make values come quicker, "
          "not more exact"},
};

static double spacing_of(const struct lattice_warp *p, int axis)
{
  return (p->max[axis] - p->min[axis]) / (p->size[axis] - 1);
}

/* In units of the lattice. */
static void to_lattice(const struct lattice_warp *p, const double at[3], double result[3])
{
  for (int k = 0; k < 3; k++)
    result[k] = (at[k] - p->min[k]) / spacing_of(p, k);
}

/* The next part of a kind from index *i on, or NULL. */
static const zs_node *next_part(const zs_node *node, const zs_kind *kind, size_t *i)
{
  while (*i < node->child_count)
    if (node->children[(*i)++]->kind == kind)
      return node->children[*i - 1];
  return NULL;
}

/* ---- Drags ---------------------------------------------------------------------------- */

/* Drags as a linear system: every row says that the moves of control points, in the weights
 * of the basis functions, add up to what a point lacks. */
typedef struct drags {
  const zs_node *node;
  zs_warp *warp;
  size_t rows, columns;
  uint32_t *column; /* by control point, 1 more than its column; 0: stays */
  double *a, *b;
} drags;

static size_t index_of(const zs_warp *warp, const uint32_t at[3])
{
  return ((size_t)at[2] * warp->size[1] + at[1]) * warp->size[0] + at[0];
}

/* Where D is asked for, and what it has to be there: the child's point `from` comes to `to` if
 * to + D(to) = from, or from + D(from) = to in a map that is pushed forward. */
static void place_of(const struct lattice_warp *p, const struct drag *q, double at[3],
                     double wanted[3])
{
  double from[3], to[3];
  to_lattice(p, q->from, from);
  to_lattice(p, q->to, to);
  for (int k = 0; k < 3; k++) {
    at[k] = p->method == INVERSE ? to[k] : from[k];
    wanted[k] = p->method == INVERSE ? from[k] - to[k] : to[k] - from[k];
  }
}

/* Call for the control points that a point depends on: true and which, with its weight, for
 * 0 <= n < 64. */
static bool control_of(const zs_warp *warp, const double at[3], int n, uint32_t control[3],
                       double *weight)
{
  int first[3];
  double w[3][4];
  const int step[3] = {n % 4, n / 4 % 4, n / 16};
  for (int k = 0; k < 3; k++) /* whole numbers far beyond are no cells */
    if (!(at[k] > -2 && at[k] < (double)warp->size[k] + 1))
      return false;
  zs_warp_basis(at, first, w);
  *weight = 1;
  for (int k = 0; k < 3; k++) {
    const int i = first[k] + step[k];
    if (i < 0 || i >= (int)warp->size[k])
      return false;
    control[k] = (uint32_t)i;
    *weight *= w[k][step[k]];
  }
  return *weight > 0;
}

/* The control points that may move; false after reporting that none can. */
static bool choose_columns(drags *d, zs_diag *diag)
{
  const struct lattice_warp *p = d->node->parameters;
  const zs_node *part;
  for (size_t i = 0; (part = next_part(d->node, &drag, &i)); d->rows++) {
    const struct drag *q = part->parameters;
    double at[3], wanted[3], weight, nearest = INFINITY;
    bool any = false;
    place_of(p, q, at, wanted);
    for (int n = 0; n < 64; n++) {
      uint32_t control[3];
      if (!control_of(d->warp, at, n, control, &weight))
        continue;
      double away = 0;
      for (int k = 0; k < 3; k++)
        away = hypot(away, (control[k] - at[k]) * spacing_of(p, k));
      nearest = fmin(nearest, away);
      if (away > q->radius) /* none when it is not written: NaN */
        continue;
      any = true;
      uint32_t *column = &d->column[index_of(d->warp, control)];
      if (!*column)
        *column = (uint32_t)++d->columns;
    }
    if (any)
      continue;
    if (isinf(nearest))
      return zs_node_fail(part, diag, p->method == INVERSE ? "to" : "from",
                          "the point is two spacings or more away from the lattice, which does not "
                          "move it");
    return zs_node_fail(part, diag, "radius", "%g is less than the %g to the nearest control "
                        "point: there is none to move", q->radius, nearest);
  }
  return true;
}

static void fill_rows(drags *d)
{
  const zs_node *part;
  size_t row = 0;
  const size_t most = d->rows > d->columns ? d->rows : d->columns;
  for (size_t i = 0; (part = next_part(d->node, &drag, &i)); row++) {
    double at[3], wanted[3], moved[3], weight;
    place_of(d->node->parameters, part->parameters, at, wanted);
    zs_warp_at(d->warp, at, moved, NULL);
    for (size_t k = 0; k < 3; k++)
      d->b[k * most + row] = wanted[k] - moved[k];
    for (int n = 0; n < 64; n++) {
      uint32_t control[3];
      if (!control_of(d->warp, at, n, control, &weight))
        continue;
      const uint32_t column = d->column[index_of(d->warp, control)];
      if (column)
        d->a[(column - 1) * d->rows + row] = weight;
    }
  }
}

static void add_moves(drags *d)
{
  const size_t most = d->rows > d->columns ? d->rows : d->columns;
  uint32_t at[3];
  for (at[2] = 0; at[2] < d->warp->size[2]; at[2]++)
    for (at[1] = 0; at[1] < d->warp->size[1]; at[1]++)
      for (at[0] = 0; at[0] < d->warp->size[0]; at[0]++) {
        const uint32_t column = d->column[index_of(d->warp, at)];
        for (size_t k = 0; k < 3 && column; k++)
          zs_warp_move(d->warp, at)[k] += d->b[k * most + column - 1];
      }
}

/* Whether all points are where they are dragged. */
static bool are_met(const drags *d, zs_diag *diag)
{
  const zs_node *part;
  for (size_t i = 0; (part = next_part(d->node, &drag, &i));) {
    double at[3], wanted[3], moved[3];
    place_of(d->node->parameters, part->parameters, at, wanted);
    zs_warp_at(d->warp, at, moved, NULL);
    for (int k = 0; k < 3; k++)
      if (!(fabs(moved[k] - wanted[k]) <= 1e-6 * (1 + fabs(wanted[k]))))
        return zs_node_fail(part, diag, "to", "drags contradict one another here; expected points "
                            "farther apart, a finer lattice, or wider radii");
  }
  return true;
}

/* The least moves with which all drags are met (Hsu, Hughes, Kaufman 1992). */
static bool solve_drags(const zs_node *node, zs_warp *warp, zs_diag *diag)
{
  drags d = {.node = node, .warp = warp};
  d.column = calloc((size_t)warp->size[0] * warp->size[1] * warp->size[2], sizeof *d.column);
  if (!d.column)
    return zs_fail_memory(diag);
  bool done = choose_columns(&d, diag);
  if (done && d.rows) {
    const size_t most = d.rows > d.columns ? d.rows : d.columns;
    d.a = calloc(d.rows * d.columns, sizeof *d.a);
    d.b = calloc(3 * most, sizeof *d.b);
    done = d.a && d.b;
    zs_dense_result result = ZS_DENSE_MEMORY;
    if (done) {
      fill_rows(&d);
      result = zs_dense_least(d.rows, d.columns, 3, d.a, d.b);
    }
    if (result == ZS_DENSE_MEMORY)
      done = zs_fail_memory(diag);
    else if (result == ZS_DENSE_DONE)
      add_moves(&d);
    done = done && are_met(&d, diag); /* reports when it is singular, too */
  }
  free(d.column);
  free(d.a);
  free(d.b);
  return done;
}

/* ---- The lattice ------------------------------------------------------------------------ */

/* The lattice with all control points where they are moved to; NULL after reporting. */
static zs_warp *warp_of(const zs_node *node, zs_diag *diag)
{
  const struct lattice_warp *p = node->parameters;
  const uint32_t size[3] = {(uint32_t)p->size[0], (uint32_t)p->size[1], (uint32_t)p->size[2]};
  zs_warp *warp = zs_warp_new(size);
  if (!warp) {
    zs_fail_memory(diag);
    return NULL;
  }
  warp->backward = p->method == PUSH_FORWARD;
  const zs_node *part;
  for (size_t i = 0; (part = next_part(node, &move, &i));) {
    const struct move *q = part->parameters;
    const uint32_t control[3] = {(uint32_t)q->control[0], (uint32_t)q->control[1],
                                 (uint32_t)q->control[2]};
    double *moved = zs_warp_move(warp, control);
    for (int k = 0; k < 3; k++)
      moved[k] += q->by[k] / spacing_of(p, k);
  }
  if (!solve_drags(node, warp, diag)) {
    zs_warp_free(warp);
    return NULL;
  }
  zs_warp_finish(warp);
  return warp;
}

static bool check_parts(const zs_node *node, zs_diag *diag)
{
  const struct lattice_warp *p = node->parameters;
  const zs_node *part;
  size_t count = 0;
  for (size_t i = 0; (part = next_part(node, &move, &i));) {
    const struct move *q = part->parameters;
    for (int k = 0; k < 3; k++)
      if (q->control[k] != floor(q->control[k]) || q->control[k] >= p->size[k])
        return zs_node_fail(part, diag, "control",
                            "there is no control point %g along %s; expected 0 to %g",
                            q->control[k], zs_axis_names[k], p->size[k] - 1);
  }
  for (size_t i = 0; (part = next_part(node, &drag, &i));)
    if (++count > MOST_DRAGS)
      return zs_node_fail(part, diag, NULL, "there are more than %d drags", MOST_DRAGS);
  return true;
}

static void warn_of_folds(const zs_node *node, const zs_warp *warp, zs_diag *diag)
{
  const struct lattice_warp *p = node->parameters;
  double at[3], determinant;
  if (!zs_warp_fold(warp, at, &determinant))
    return;
  for (int k = 0; k < 3; k++)
    at[k] = p->min[k] + at[k] * spacing_of(p, k);
  zs_report(diag, ZS_WARNING, ZS_ERROR_GEOMETRY, &node->place, NULL,
            "space folds over at %g %g %g, where the determinant of the map's derivatives is %g: "
            "what moves there is moved too far", at[0], at[1], at[2], determinant);
}

static bool check(const zs_node *node, zs_diag *diag)
{
  const struct lattice_warp *p = node->parameters;
  if (!zs_node_check_order(node, diag, "min", p->min, "max", p->max, 3))
    return false;
  for (int k = 0; k < 3; k++) {
    if (p->size[k] != floor(p->size[k]) || p->size[k] < 2 || p->size[k] > ZS_WARP_MOST)
      return zs_node_fail(node, diag, "size", "%g is not a whole number from 2 to %d", p->size[k],
                          ZS_WARP_MOST);
    if (!isfinite(spacing_of(p, k)) || !isfinite(1 / spacing_of(p, k)))
      return zs_node_fail(node, diag, "max", "%g is too far from or too near to 'min', which is %g",
                          p->max[k], p->min[k]);
  }
  if (!check_parts(node, diag))
    return false;
  zs_warp *warp = warp_of(node, diag);
  if (!warp)
    return false;
  warn_of_folds(node, warp, diag);
  zs_warp_free(warp);
  return true;
}

/* Invert the map on a grid; false after reporting. */
static bool prepare_inverse(zs_compiler *compiler, const zs_node *node, zs_warp *warp)
{
  const struct lattice_warp *p = node->parameters;
  const zs_control *control = zs_compiler_control(compiler);
  zs_diag *diag = zs_compiler_diag(compiler);
  const double bytes = zs_warp_start_bytes(warp, (uint32_t)p->resolution);
  if (!zs_control_allows(control, bytes)) {
    const zs_place place = zs_node_place(node, "resolution");
    return zs_report(diag, ZS_ERROR, ZS_ERROR_MEMORY, &place, NULL,
                     "%d cells along the longest side take %.0f MB, more than is allowed",
                     p->resolution, bytes / 1e6);
  }
  return zs_warp_prepare_inverse(warp, (uint32_t)p->resolution, zs_control_threads(control)) ||
         zs_fail_memory(diag);
}

static bool moves_along(const zs_warp *warp, int axis)
{
  return warp->all.lo[axis] != 0 || warp->all.hi[axis] != 0;
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct lattice_warp *p = node->parameters;
  zs_warp *warp = warp_of(node, zs_compiler_diag(compiler));
  if (!warp || zs_warp_is_identity(warp)) {
    zs_warp_free(warp);
    return zs_children_emit(compiler, node, at);
  }
  if (!zs_compiler_keep(compiler, warp, zs_warp_free))
    return zs_emit_constant(compiler, -1);
  if (warp->backward && !prepare_inverse(compiler, node, warp))
    return zs_emit_constant(compiler, -1);
  double inverse[12] = {0};
  for (int k = 0; k < 3; k++) {
    inverse[5 * k] = 1 / spacing_of(p, k);
    inverse[4 * k + 3] = -p->min[k] / spacing_of(p, k);
  }
  const zs_coordinates own = zs_coordinates_affine(at, inverse);
  zs_value in[3], by[3] = {0}, moved[3];
  for (int k = 0; k < 3; k++)
    in[k] = zs_emit_coordinate(compiler, &own, k);
  for (int k = 0; k < 3; k++)
    moved[k] = zs_emit_coordinate(compiler, at, k);
  for (int k = 0; k < 3; k++) { /* next to each other: siblings */
    const zs_warp_part part = {.warp = warp, .component = k};
    if (moves_along(warp, k))
      by[k] = zs_emit_operation(compiler, &zs_warp_operation, &part, in[0], in[1], in[2]);
  }
  for (int k = 0; k < 3; k++)
    if (moves_along(warp, k))
      moved[k] = zs_emit(compiler, ZS_FUNCTION_ADD, moved[k],
                         zs_emit_scaled(compiler, by[k], spacing_of(p, k)), 0);
  const zs_coordinates child = zs_coordinates_from(moved[0], moved[1], moved[2]);
  return zs_children_emit(compiler, node, &child);
}

/* No point moves farther than the farthest control points: what is pulled back from the box
 * came from so far on the other side. */
static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)count;
  const struct lattice_warp *p = node->parameters;
  zs_diag quiet = {0};
  zs_warp *warp = warp_of(node, &quiet);
  if (!warp)
    return zs_box_everything();
  zs_box all = children[0];
  for (int k = 0; k < 3; k++) {
    const double least = warp->all.lo[k] * spacing_of(p, k);
    const double most = warp->all.hi[k] * spacing_of(p, k);
    all.lo[k] += warp->backward ? least : -most;
    all.hi[k] += warp->backward ? most : -least;
  }
  zs_warp_free(warp);
  return all;
}

const zs_kind zs_kind_lattice_warp = {
  .name = "lattice-warp",
  .family = ZS_FAMILY_COORDINATE_MAP,
  .summary = "the child with space around it warped by a lattice of control points",
  .doc = "Control points stand evenly from `min` to `max`, the corners included, and beyond as "
         "many more that cannot be moved. A point x moves by D(x), the uniform cubic B-spline of "
         "the control points' moves: together they move everything between them alike, one alone "
         "what is less than two spacings away. So the map is smooth, with two continuous "
         "derivatives, and leaves alone what is two spacings or more away from the lattice. f(x) "
         "is the child's at x + D(x) (`inverse`), or at the y with y + D(y) = x (`push-forward`), "
         "found by Newton's method. Where space folds over, which is warned of, there may be "
         "several y, or it ends with four steps of y = x - D(y) from y = x. `drag` moves control "
         "points by the least squares with which all points get where they are dragged, moves by "
         "`move` counted in. What a point costs does not depend on how many control points there "
         "are; `push-forward` costs some five times as much as `inverse`.",
  .source = "T. True, J. Hughes, Volume warping, 1992; W. Hsu, J. Hughes, H. Kaufman, Direct "
            "manipulation of free-form deformations, 1992",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct lattice_warp),
  .children = ZS_CHILDREN_ONE,
  .parts = parts,
  .check = check,
  .emit = emit,
  .box = box,
};
