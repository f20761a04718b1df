/* Barr's bend.  With K = |rate| in radians and R = 1/K, an arc of radius R about the bend's
 * axis takes the place of the straight axis; a point there belongs to the place on the axis
 * that its angle says, as far as the bend reaches, and beyond to straight pieces. */
#include "nodes/common.h"
#include "nodes/extent.h"

#include <math.h>

static const double PI = 3.14159265358979323846;

/* Radians per length whose radius leaves nothing of the straight axis' digits. */
static const double NO_BEND = 1e-15;

struct bend {
  double rate, min, max;
  int axis, toward;
};

static const zs_attribute attributes[] = {
  ZS_AXIS(struct bend, axis, "the straight axis that is bent"),
  ZS_TOWARD(struct bend, toward,
            "axis that it is bent to, another one; `z` when not written and the axis is `x`"),
  {.name = "rate",
   .type = ZS_NUMBER,
   .offset = offsetof(struct bend, rate),
   .initial = NULL,
   .unit = "degrees per length",
   .doc = "turn per unit of length along the axis; below 0 it bends to the other side"},
  ZS_LENGTH(struct bend, min, "min", "", ZS_RANGE_ANY,
            "where along the axis the bend begins, and what lies before stays straight; not "
            "written: half a turn before the point that stays"),
  ZS_LENGTH(struct bend, max, "max", "", ZS_RANGE_ANY, "where it ends, likewise"),
};

/* The bend in numbers. */
typedef struct bent {
  double k, sign;        /* radians per length, at least 0; 1 or -1: which side */
  double still;          /* the place along the axis that stays where it is */
  double lo, hi;         /* the places between which it is bent */
  int axis, toward;
} bent;

static bent bent_of(const zs_node *node)
{
  const struct bend *p = node->parameters;
  bent b = {.k = fabs(p->rate) * PI / 180,
            .sign = p->rate < 0 ? -1 : 1,
            .axis = p->axis,
            .toward = zs_node_toward(node, p->axis, p->toward)};
  if (b.k < NO_BEND)
    b.k = 0;
  b.still = fmin(fmax(0, isnan(p->min) ? -INFINITY : p->min), isnan(p->max) ? INFINITY : p->max);
  b.lo = isnan(p->min) ? b.still - PI / b.k : p->min;
  b.hi = isnan(p->max) ? b.still + PI / b.k : p->max;
  return b;
}

static bool check(const zs_node *node, zs_diag *diag)
{
  const struct bend *p = node->parameters;
  if (!zs_node_check_toward(node, diag, p->axis, p->toward))
    return false;
  if (!isnan(p->min) && !isnan(p->max) &&
      !zs_node_check_order(node, diag, "min", &p->min, "max", &p->max, 1))
    return false;
  const bent b = bent_of(node);
  const double turn = b.k > 0 ? (b.hi - b.lo) * b.k * 180 / PI : 0;
  return turn <= 360 * (1 + 1e-9) ||
         zs_node_fail(node, diag, "rate", "from %g to %g that is a turn by %g degrees; expected no "
                      "more than 360", b.lo, b.hi, turn);
}

static zs_value constant(zs_compiler *compiler, double number)
{
  return zs_emit_constant(compiler, number);
}

/* The part of an angle beyond least .. most, and the angle without it. */
static zs_value limited(zs_compiler *compiler, zs_value angle, double least, double most,
                        zs_value *beyond)
{
  zs_value within = zs_emit(compiler, ZS_FUNCTION_MAXIMUM, angle, constant(compiler, least), 0);
  within = zs_emit(compiler, ZS_FUNCTION_MINIMUM, within, constant(compiler, most), 0);
  *beyond = zs_emit(compiler, ZS_FUNCTION_SUBTRACT, angle, within, 0);
  return within;
}

/* The distance from the bend's axis without R, (a^2 + c (c - 2 R)) / (distance + R): nothing
 * cancels in bends that are nearly straight. */
static zs_value farther(zs_compiler *compiler, zs_value a, zs_value c, zs_value distance, double r)
{
  zs_value v = zs_emit(compiler, ZS_FUNCTION_SUBTRACT, c, constant(compiler, 2 * r), 0);
  v = zs_emit(compiler, ZS_FUNCTION_MULTIPLY, c, v, 0);
  v = zs_emit(compiler, ZS_FUNCTION_ADD, zs_emit(compiler, ZS_FUNCTION_SQUARE, a, 0, 0), v, 0);
  return zs_emit(compiler, ZS_FUNCTION_DIVIDE, v,
                 zs_emit(compiler, ZS_FUNCTION_ADD, distance, constant(compiler, r), 0), 0);
}

/* The place at angle 0.  Angles jump half a turn away from it, which has to be outside of the
 * bend: the place that stays does unless the bend reaches far to one side, as it cannot when
 * its radius is large and there are digits to lose. */
static double zero_of(const bent *b)
{
  const double most = PI * (1 + 1e-9) / b->k;
  return b->still - b->lo <= most && b->hi - b->still <= most ? b->still
                                                              : b->lo + (b->hi - b->lo) / 2;
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const bent b = bent_of(node);
  if (b.k == 0)
    return zs_children_emit(compiler, node, at);
  const double r = 1 / b.k, zero = zero_of(&b), turn = b.k * (zero - b.still);
  /* Row 0: along the axis from the point that stays; row 1: across, toward the bend's axis.
   * Rows 0 and 1 of `turned`: the same seen from the bend's axis, `zero` at angle 0. */
  double own[12] = {0}, turned[12] = {0};
  own[b.axis] = 1;
  own[3] = -b.still;
  own[4 + b.toward] = b.sign;
  for (int i = 0; i < 4; i++) {
    const double across = (i == 3 ? r : 0) - own[4 + i];
    turned[i] = own[i] * cos(turn) - across * sin(turn);
    turned[4 + i] = across * cos(turn) + own[i] * sin(turn);
  }
  const zs_coordinates straight = zs_coordinates_affine(at, own);
  const zs_coordinates round = zs_coordinates_affine(at, turned);
  const zs_value a = zs_emit_coordinate(compiler, &straight, 0);
  const zs_value c = zs_emit_coordinate(compiler, &straight, 1);
  const zs_value u = zs_emit_coordinate(compiler, &round, 0);
  const zs_value v = zs_emit_coordinate(compiler, &round, 1);
  const zs_value distance = zs_emit(compiler, ZS_FUNCTION_HYPOT, u, v, 0);
  zs_value angle = zs_emit(compiler, ZS_FUNCTION_ATAN2, u, v, 0), beyond = 0;
  const double least = b.k * (b.lo - zero), most = b.k * (b.hi - zero);
  const bool whole = fmin(-least, most) > PI * (1 - 1e-9);
  if (!whole)
    angle = limited(compiler, angle, least, most, &beyond);
  zs_value along = zs_emit(compiler, ZS_FUNCTION_ADD, zs_emit_scaled(compiler, angle, r),
                           constant(compiler, zero), 0);
  zs_value across = farther(compiler, a, c, distance, r);
  if (!whole) { /* along + distance sin beyond; across - distance (1 - cos beyond) */
    zs_value sine = zs_emit(compiler, ZS_FUNCTION_SINE, beyond, 0, 0);
    zs_value chord = zs_emit_scaled(compiler, beyond, 0.5);
    chord = zs_emit(compiler, ZS_FUNCTION_SINE, chord, 0, 0);
    chord = zs_emit_scaled(compiler, zs_emit(compiler, ZS_FUNCTION_SQUARE, chord, 0, 0), 2);
    along = zs_emit(compiler, ZS_FUNCTION_ADD, along,
                    zs_emit(compiler, ZS_FUNCTION_MULTIPLY, distance, sine, 0), 0);
    across = zs_emit(compiler, ZS_FUNCTION_SUBTRACT, across,
                     zs_emit(compiler, ZS_FUNCTION_MULTIPLY, distance, chord, 0), 0);
  }
  zs_value p[3];
  for (int k = 0; k < 3; k++)
    p[k] = k == b.axis ? along : k == b.toward ? zs_emit_scaled(compiler, across, -b.sign)
                                               : zs_emit_coordinate(compiler, at, k);
  const zs_coordinates child = zs_coordinates_from(p[0], p[1], p[2]);
  return zs_children_emit(compiler, node, &child);
}

/* ---- The box ------------------------------------------------------------------- */

/* Take in where the place `along`, `across` of the straight solid comes to lie. */
static void take_in(zs_box *box, const bent *b, double along, double across)
{
  const double r = 1 / b->k, place = fmin(fmax(along, b->lo), b->hi);
  const double angle = b->k * (place - b->still), s = sin(angle), c = cos(angle);
  const double x = b->still + (r - across) * s + (along - place) * c;
  const double y = b->sign * (r - (r - across) * c + (along - place) * s);
  box->lo[b->axis] = fmin(box->lo[b->axis], x);
  box->hi[b->axis] = fmax(box->hi[b->axis], x);
  box->lo[b->toward] = fmin(box->lo[b->toward], y);
  box->hi[b->toward] = fmax(box->hi[b->toward], y);
}

/* Across the arc's centre places come out twice, but no farther from it than they were. */
static zs_box round_box(const zs_box *child, const bent *b, const double along[2],
                        const double side[2])
{
  const double r = 1 / b->k;
  const double longest = fmax(fmax(fabs(along[0] - b->lo), fabs(along[0] - b->hi)),
                              fmax(fabs(along[1] - b->lo), fabs(along[1] - b->hi)));
  const double far = hypot(longest, fmax(fabs(r - side[0]), fabs(r - side[1])));
  zs_box all = *child;
  all.lo[b->axis] = b->still - far;
  all.hi[b->axis] = b->still + far;
  all.lo[b->toward] = b->sign * r - far;
  all.hi[b->toward] = b->sign * r + far;
  return all;
}

/* The ends of a straight piece, or an arc's ends and its places at quarter turns, are the
 * outermost of all places at the same height across. */
static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)count;
  const bent b = bent_of(node);
  zs_box all = children[0];
  if (b.k == 0)
    return all;
  const double along[2] = {all.lo[b.axis], all.hi[b.axis]};
  const double side[2] = {b.sign * all.lo[b.toward], b.sign * all.hi[b.toward]};
  if (!isfinite(along[0]) || !isfinite(along[1]) || !isfinite(side[0]) || !isfinite(side[1])) {
    for (int k = 0; k < 2; k++) {
      all.lo[k ? b.axis : b.toward] = -INFINITY;
      all.hi[k ? b.axis : b.toward] = INFINITY;
    }
    return all;
  }
  if (fmax(side[0], side[1]) > 1 / b.k)
    return round_box(&all, &b, along, side);
  all.lo[b.axis] = all.lo[b.toward] = INFINITY;
  all.hi[b.axis] = all.hi[b.toward] = -INFINITY;
  for (int j = 0; j < 2; j++) {
    for (int i = 0; i < 2; i++) {
      take_in(&all, &b, along[i], side[j]);
      take_in(&all, &b, fmin(fmax(along[i], b.lo), b.hi), side[j]);
    }
    for (int quarter = -4; quarter <= 4; quarter++) {
      const double place = b.still + quarter * (PI / 2) / b.k;
      if (place > fmax(along[0], b.lo) && place < fmin(along[1], b.hi))
        take_in(&all, &b, place, side[j]);
    }
  }
  return all;
}

const zs_kind zs_kind_bend = {
  .name = "bend",
  .family = ZS_FAMILY_COORDINATE_MAP,
  .summary = "the child's axis bent to an arc",
  .doc = "Of `min` to `max` the place nearest to the origin stays where it is: the origin itself "
         "where it lies between them. The axis keeps its length, and what lies beyond `min` and "
         "`max` goes on straight. The child must not reach as far as the centre of the arc, "
         "180 / (pi rate) away.",
  .source = "A. Barr, Global and local deformations of solid primitives, 1984",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct bend),
  .children = ZS_CHILDREN_ONE,
  .check = check,
  .emit = emit,
  .box = box,
};
