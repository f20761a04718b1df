/* Copies of the child around an axis. */
#include "field/fold.h"
#include "nodes/common.h"
#include "nodes/copies.h"
#include "nodes/extent.h"

#include <math.h>

static const double PI = 3.14159265358979323846;

struct repeat_polar {
  double angle;
  int count, axis;
};

static const zs_attribute attributes[] = {
  {.name = "count",
   .type = ZS_INTEGER,
   .offset = offsetof(struct repeat_polar, count),
   .initial = NULL,
   .unit = "1",
   .range = ZS_RANGE_BETWEEN,
   .minimum = 1,
   .maximum = 100000,
   .doc = "how many copies, the child itself counted"},
  ZS_ANGLE(struct repeat_polar, angle, "angle", "",
           "from a copy to the next, counter-clockwise seen from the axis' positive end; not "
           "written: 360 / count, all around"),
  ZS_AXIS(struct repeat_polar, axis, "direction of the axis, which goes through the origin"),
};

/* The copies in radians: the first at `from`, the others counter-clockwise. */
typedef struct ring {
  double from, step, count;
  bool closed; /* the first follows the last */
} ring;

static ring ring_of(const struct repeat_polar *p)
{
  const bool around = isnan(p->angle);
  const double degrees = around ? 360.0 / p->count : fabs(p->angle);
  ring r = {.step = degrees * PI / 180, .count = p->count};
  r.closed = around || fabs(degrees * p->count - 360) < 1e-9 * 360;
  if (!around && p->angle < 0 && !r.closed)
    r.from = -r.step * (p->count - 1);
  if (p->angle == 0)
    r.count = 1;
  return r;
}

/* Angles of a rectangle's points, from `middle` to both sides; all when it holds the origin. */
typedef struct span {
  double middle, below, above, radius;
} span;

static span span_of(const double lo[2], const double hi[2])
{
  span s = {0, -PI, PI, hypot(fmax(-lo[0], hi[0]), fmax(-lo[1], hi[1]))};
  if ((lo[0] <= 0 && hi[0] >= 0 && lo[1] <= 0 && hi[1] >= 0) || !isfinite(s.radius))
    return s;
  s.middle = atan2((lo[1] + hi[1]) / 2, (lo[0] + hi[0]) / 2);
  s.below = s.above = 0;
  for (int corner = 0; corner < 4; corner++) {
    const double angle = atan2(corner & 2 ? hi[1] : lo[1], corner & 1 ? hi[0] : lo[0]);
    const double apart = remainder(angle - s.middle, 2 * PI);
    s.below = fmin(s.below, apart);
    s.above = fmax(s.above, apart);
  }
  return s;
}

/* Coordinates turned about z, clockwise for what is at them. */
static zs_coordinates turned(const zs_coordinates *at, double angle)
{
  const double c = cos(angle), s = sin(angle);
  const double inverse[12] = {c, s, 0, 0, -s, c, 0, 0, 0, 0, 1, 0};
  return zs_coordinates_affine(at, inverse);
}

typedef struct job {
  zs_compiler *compiler;
  const zs_node *node;
  zs_coordinates at; /* z along the axis */
  int axis;
  ring ring;
} job;

static zs_value child_at(const job *j, const zs_coordinates *along)
{
  const zs_coordinates child = zs_coordinates_back(along, j->axis);
  return zs_children_emit(j->compiler, j->node, &child);
}

static zs_value copy_at(const job *j, double i)
{
  const zs_coordinates own = turned(&j->at, j->ring.from + i * j->ring.step);
  return child_at(j, &own);
}

static zs_value either(const job *j, zs_value a, zs_value b)
{
  return zs_emit(j->compiler, ZS_FUNCTION_MAXIMUM, a, b, 0);
}

static zs_value all_copies(const job *j)
{
  const double count = j->ring.count;
  if (count > ZS_MOST_COPIES) {
    zs_node_fail(j->node, zs_compiler_diag(j->compiler), "count",
                 "the child reaches as far as the axis, or around it, where all of %g copies come "
                 "together; expected at most %d", count, ZS_MOST_COPIES);
    return zs_emit_constant(j->compiler, -1);
  }
  if (!zs_copies_allowed(j->compiler, j->node, count))
    return zs_emit_constant(j->compiler, -1);
  zs_value all = copy_at(j, 0);
  for (double i = 1; i < count; i++)
    all = either(j, all, copy_at(j, i));
  return all;
}

/* Angles are measured from the middle of all copies, so that they jump where an open ring is
 * open: there the first copy and the last are next to each other and both count. */
static zs_value folded(const job *j, const zs_copies *copies, const span *s)
{
  const ring *r = &j->ring;
  const double half = r->closed ? 0 : (r->count - 1) / 2 * r->step;
  const zs_coordinates middle = turned(&j->at, r->from + half + s->middle);
  zs_value p[3];
  for (int k = 0; k < 3; k++)
    p[k] = zs_emit_coordinate(j->compiler, &middle, k);
  const zs_value angle = zs_emit(j->compiler, ZS_FUNCTION_ATAN2, p[1], p[0], 0);
  zs_turn turn = {.step = r->step,
                  .shift = copies->shift,
                  .least = r->closed ? -INFINITY : 0,
                  .most = r->closed ? INFINITY : r->count - 1,
                  .fade = copies->fade,
                  .zero = -half,
                  .start = -half - s->middle,
                  .length = s->radius * r->step};
  const int count = (int)copies->candidates;
  zs_value all = 0;
  for (int i = 0; i < count; i++) {
    turn.place = i;
    turn.part = ZS_TURN_X;
    const zs_value x = zs_emit_turn(j->compiler, p[0], p[1], angle, &turn);
    turn.part = ZS_TURN_Y;
    const zs_value y = zs_emit_turn(j->compiler, p[0], p[1], angle, &turn);
    const zs_coordinates along = zs_coordinates_from(x, y, p[2]);
    zs_value f = child_at(j, &along);
    if (i == 0 || i == count - 1) {
      turn.place = 0;
      turn.part = i == 0 ? ZS_TURN_FADE_FIRST : ZS_TURN_FADE_LAST;
      f = zs_emit_faded(j->compiler, f, zs_emit_turn(j->compiler, p[0], p[1], angle, &turn));
    }
    all = i ? either(j, all, f) : f;
  }
  return r->closed ? all : either(j, either(j, all, copy_at(j, 0)), copy_at(j, r->count - 1));
}

/* Whether an open ring's copies, and what fades beyond them, end before angles jump. */
static bool has_opening(const ring *r, const zs_copies *copies, const span *s)
{
  const double beyond = r->step * copies->shift - s->above;
  return (r->count - 1) / 2 * r->step + fmax(s->above, -s->below) + beyond < PI;
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct repeat_polar *p = node->parameters;
  job j = {.compiler = compiler, .node = node, .axis = p->axis, .ring = ring_of(p)};
  j.at = zs_coordinates_along(at, p->axis);
  if (j.ring.count <= 2)
    return all_copies(&j);
  const int x = (p->axis + 1) % 3, y = (p->axis + 2) % 3;
  zs_box box;
  if (!zs_children_extent(compiler, node, 1u << x | 1u << y, &box))
    return zs_children_emit(compiler, node, at);
  const span s = span_of((const double[2]){box.lo[x], box.lo[y]},
                         (const double[2]){box.hi[x], box.hi[y]});
  const zs_copies copies = zs_copies_of(s.below, s.above, j.ring.step, j.ring.count);
  if (!copies.folded || s.above - s.below >= 2 * PI || !(s.radius * j.ring.step > 0) ||
      (!j.ring.closed && !has_opening(&j.ring, &copies, &s)))
    return all_copies(&j);
  if (copies.candidates > ZS_MOST_COPIES)
    return all_copies(&j); /* reports */
  return zs_copies_allowed(compiler, node, copies.candidates + 2)
           ? folded(&j, &copies, &s)
           : zs_emit_constant(compiler, -1);
}

static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)count;
  const struct repeat_polar *p = node->parameters;
  zs_box all = children[0];
  const int x = (p->axis + 1) % 3, y = (p->axis + 2) % 3;
  const double r = hypot(fmax(-all.lo[x], all.hi[x]), fmax(-all.lo[y], all.hi[y]));
  all.lo[x] = all.lo[y] = -r;
  all.hi[x] = all.hi[y] = r;
  return all;
}

const zs_kind zs_kind_repeat_polar = {
  .name = "repeat-polar",
  .family = ZS_FAMILY_COORDINATE_MAP,
  .summary = "copies of the child around an axis",
  .doc = "The first copy is the child where it stands, away from the axis. The solid is the union of "
         "the copies, also where they overlap. What a point costs depends on how many come together "
         "there, not on their number, if the child does not reach the axis; where it does, all "
         "copies are next to one another, and up to 4096 are allowed. Of an exact distance the "
         "result is one, outside; any child's values are continuous.",
  .trait = "keeps distances outside",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct repeat_polar),
  .children = ZS_CHILDREN_ONE,
  .emit = emit,
  .box = box,
};
