#include "nodes/interpolate.h"

#include "nodes/extent.h"

#include <math.h>
#include <string.h>

static const zs_kind *const parts[] = {&zs_interpolate_level, &zs_interpolate_between, NULL};

/* ---- interpolate ----------------------------------------------------------- */

enum { EXTENDED, LINEAR, SPACE_TIME };
enum { CLOSED, OPEN, ROUND };
enum { C0, C1 };
static const char *const methods[] = {"extended", "linear", "space-time", NULL};
static const char *const caps[] = {"closed", "open", "round", NULL};
static const char *const centers[] = {"moving", "fixed", NULL};
static const char *const continuities[] = {"c0", "c1", NULL};

struct interpolate {
  int axis, method, centers, continuity, caps;
  double time;
};

static const zs_attribute attributes[] = {
  ZS_AXIS(struct interpolate, axis,
          "direction in which the levels follow each other; the shapes' plane is across it"),
  ZS_SELECT(struct interpolate, method, "method", "extended", methods,
            "`linear`: f of the two levels beside the point, weighted by how near they are; "
            "`extended`: the same of shapes that move and fill as `between` parts say; "
            "`space-time`: shapes that do not change until the middle of the gap, and then end, "
            "joined by a `space-time-blend`"),
  ZS_SELECT(struct interpolate, centers, "centers", "moving", centers,
            "`moving`: the points of pairs are where their paths lead at every height; `fixed`: "
            "displacements belong to the ends of pairs, and between the levels points keep to "
            "their paths only about"),
  ZS_SELECT(struct interpolate, continuity, "continuity", "c0", continuities,
            "`c1`: no creases across levels. Movements begin and end at rest, and between their "
            "values f is a cubic that has no more extremes than they"),
  ZS_SELECT(struct interpolate, caps, "caps", "closed", caps,
            "`closed`: the solid ends at the first and the last level; `open`: it goes on as they "
            "are; `round`: beyond them f falls with the square of the distance over the nearest "
            "gap's height"),
  {.name = "time", .type = ZS_NUMBER, .offset = offsetof(struct interpolate, time), .initial = "0",
   .unit = "1", .range = ZS_RANGE_BETWEEN, .minimum = 0, .maximum = 1,
   .doc = "how far pairs have moved to their `from-end` and `to-end`: a parameter here animates "
          "them"},
};

/* Whether a part of <interpolate> may stand where it does. */
static bool check_between(const struct interpolate *p, const zs_node *part, const zs_node *before,
                          const zs_node *next, zs_diag *diag)
{
  if (!before || before->kind != &zs_interpolate_level || !next)
    return zs_node_misuse(part, diag, NULL, "expected one between two levels");
  return zs_between_check_method(part, p->method == SPACE_TIME, diag) &&
         (p->continuity == C0 || zs_between_check_smooth(part, diag));
}

static bool check(const zs_node *node, zs_diag *diag)
{
  const struct interpolate *p = node->parameters;
  const zs_node *below = NULL;
  size_t count = 0;
  for (size_t i = 0; i < node->child_count; i++) {
    const zs_node *part = node->children[i];
    if (part->kind == &zs_interpolate_between) {
      const zs_node *next = i + 1 < node->child_count ? node->children[i + 1] : NULL;
      if (!check_between(p, part, i ? node->children[i - 1] : NULL, next, diag))
        return false;
    }
    if (part->kind != &zs_interpolate_level)
      continue;
    if (below && !(zs_level_height(below) < zs_level_height(part)))
      return zs_node_fail(part, diag, "at", "%g does not lie beyond the level before, at %g",
                          zs_level_height(part), zs_level_height(below));
    below = part;
    count++;
  }
  if (count < 2)
    return zs_node_misuse(node, diag, NULL, "found %zu of at least 2 levels", count);
  return true;
}

/* ---- Gaps ------------------------------------------------------------------------- */

/* Two levels and what is between them. */
typedef struct gap {
  const zs_node *below, *above, *between; /* between: NULL for linear interpolation */
  zs_between_flows flows;
} gap;

/* What f is put together from. */
typedef struct builder {
  zs_compiler *compiler;
  const struct interpolate *settings;
  const zs_coordinates *along;
  size_t count;
  gap *gaps;
} builder;

static double length_of(const gap *g)
{
  return zs_level_height(g->above) - zs_level_height(g->below);
}

static bool find_gaps(builder *b, const zs_node *node)
{
  const zs_node *below = NULL, *between = NULL;
  b->gaps = ZS_ARENA_NEW(zs_compiler_arena(b->compiler), gap, node->child_count + 1);
  if (!b->gaps)
    return zs_fail_memory(zs_compiler_diag(b->compiler));
  for (size_t i = 0; i < node->child_count; i++) {
    const zs_node *part = node->children[i];
    if (part->kind != &zs_interpolate_level) {
      between = b->settings->method == LINEAR ? NULL : part;
      continue;
    }
    if (below) {
      const zs_interpolate_centers how = (zs_interpolate_centers)b->settings->centers;
      const zs_node *const levels[2] = {below, part};
      const zs_between_flows flows =
        zs_between_flows_make(b->compiler, between, levels, how, b->settings->time);
      zs_between_flows_tell(b->compiler, between, levels, &flows, b->along);
      b->gaps[b->count++] = (gap){below, part, between, flows};
    }
    below = part;
    between = NULL;
  }
  return true;
}

/* ---- Linear ----------------------------------------------------------------------- */

/* The relative position of z between two heights. */
static zs_value position(zs_compiler *compiler, const zs_coordinates *along, double from,
                         double to)
{
  const double row[12] = {0, 0, 1 / (to - from), -from / (to - from)};
  zs_coordinates relative = zs_coordinates_affine(along, row);
  return zs_emit_coordinate(compiler, &relative, 0);
}

static zs_value shape(const builder *b, const zs_node *part, const zs_coordinates *at)
{
  return zs_children_emit(b->compiler, part, at);
}

/* f folded over the levels: above a level everything before it has faded, and
 * below it nothing has changed yet. */
static zs_value emit_linear(const builder *b)
{
  zs_value f = shape(b, b->gaps[0].below, b->along);
  for (size_t i = 0; i < b->count; i++) {
    const zs_node *above = b->gaps[i].above;
    f = zs_emit_operation(b->compiler, &zs_interpolation, NULL, f, shape(b, above, b->along),
                          position(b->compiler, b->along, zs_level_height(b->gaps[i].below),
                                   zs_level_height(above)));
  }
  return f;
}

/* ---- Extended --------------------------------------------------------------------- */

static zs_value binary(const builder *b, zs_function function, zs_value left, zs_value right)
{
  return zs_emit(b->compiler, function, left, right, 0);
}

static zs_value number(const builder *b, double value)
{
  return zs_emit_constant(b->compiler, value);
}

static zs_value scaled(const builder *b, zs_value value, double factor)
{
  return zs_emit_scaled(b->compiler, value, factor);
}

/* The product of two finite values. */
static zs_value product(const builder *b, zs_value left, zs_value right)
{
  double factor;
  if (zs_value_constant(b->compiler, right, &factor))
    return scaled(b, left, factor);
  return binary(b, ZS_FUNCTION_MULTIPLY, left, right);
}

/* t (t (3 - 2 t)): at rest at both ends. */
static zs_value smooth_step(const builder *b, zs_value t)
{
  zs_value v = binary(b, ZS_FUNCTION_SUBTRACT, number(b, 3), scaled(b, t, 2));
  return binary(b, ZS_FUNCTION_MULTIPLY, binary(b, ZS_FUNCTION_MULTIPLY, t, t), v);
}

/* t (1 - t)^2 or, turned round, (1 - t) t^2. */
static zs_value bump(const builder *b, zs_value t, bool turned)
{
  zs_value u = binary(b, ZS_FUNCTION_SUBTRACT, number(b, 1), t);
  zs_value both = binary(b, ZS_FUNCTION_MULTIPLY, t, u);
  return binary(b, ZS_FUNCTION_MULTIPLY, both, turned ? t : u);
}

/* Where a point of level i (0: the lowest) comes from on the level below it, or goes to on
 * the one above. */
static zs_coordinates follow(const builder *b, size_t i, bool up, const zs_coordinates *at)
{
  const gap *g = &b->gaps[up ? i : i - 1];
  return zs_between_warp(b->compiler, &g->flows, up, number(b, up ? 0 : 1), at);
}

/* The slope of f by z on level i, at a point there: that of the parabola through the values
 * that follow each other on its way through three levels, but no more than twice the
 * smaller of the two differences, and 0 where these have different signs (van Leer, "Towards
 * the ultimate conservative difference scheme IV", 1977).  At the ends the difference. */
static zs_value slope_at(const builder *b, size_t i, const zs_coordinates *at)
{
  zs_value difference[2] = {0, 0};
  double length[2] = {0, 0};
  for (size_t up = 0; up < 2; up++) {
    if (up ? i == b->count : i == 0)
      continue;
    const gap *g = &b->gaps[up ? i : i - 1];
    const zs_coordinates other = follow(b, i, up, at);
    const zs_value here = shape(b, up ? g->below : g->above, at);
    const zs_value there = shape(b, up ? g->above : g->below, &other);
    length[up] = length_of(g);
    difference[up] = scaled(b, up ? binary(b, ZS_FUNCTION_SUBTRACT, there, here)
                                  : binary(b, ZS_FUNCTION_SUBTRACT, here, there),
                            1 / length[up]);
  }
  if (i == 0 || i == b->count)
    return b->settings->caps == ROUND ? number(b, 0) : difference[i == 0];
  const double sum = length[0] + length[1];
  const zs_value middle =
    binary(b, ZS_FUNCTION_ADD, scaled(b, difference[0], length[1] / sum),
           scaled(b, difference[1], length[0] / sum));
  const zs_value below = scaled(b, difference[0], 2), above = scaled(b, difference[1], 2);
  const zs_function least = ZS_FUNCTION_MINIMUM, most = ZS_FUNCTION_MAXIMUM;
  const zs_value up = binary(b, least, binary(b, least, below, above), middle);
  const zs_value down = binary(b, most, binary(b, most, below, above), middle);
  return binary(b, ZS_FUNCTION_ADD, binary(b, most, up, number(b, 0)),
                binary(b, least, down, number(b, 0)));
}

/* f between the two shapes of gap i, each at the point that it is moved from, at the part t of
 * the way. */
static zs_value join(const builder *b, size_t i, zs_value t, const zs_coordinates at[2])
{
  const gap *g = &b->gaps[i];
  const bool smooth = b->settings->continuity == C1;
  const zs_value below = shape(b, g->below, &at[0]), above = shape(b, g->above, &at[1]);
  const double length = length_of(g);
  if (b->settings->method == SPACE_TIME) { /* which is smooth of itself */
    const zs_space_time blend = zs_between_space_time(g->between, length);
    return zs_space_time_emit(b->compiler, &blend, below, above, scaled(b, t, length), NULL);
  }
  const zs_value weight =
    smooth ? smooth_step(b, t) : zs_between_weight(b->compiler, g->between, t);
  const zs_value f =
    zs_emit_operation(b->compiler, &zs_interpolation, NULL, below, above, weight);
  if (!smooth)
    return f;
  const zs_value from =
    product(b, bump(b, t, false), scaled(b, slope_at(b, i, &at[0]), length));
  const zs_value to = product(b, bump(b, t, true), scaled(b, slope_at(b, i + 1, &at[1]), length));
  return binary(b, ZS_FUNCTION_ADD, f, binary(b, ZS_FUNCTION_SUBTRACT, from, to));
}

/* f in gap i, beyond it as on its levels. */
static zs_value emit_gap(const builder *b, size_t i)
{
  const gap *g = &b->gaps[i];
  const double lo = zs_level_height(g->below), hi = zs_level_height(g->above);
  zs_value t = position(b->compiler, b->along, lo, hi);
  t = binary(b, ZS_FUNCTION_MINIMUM, binary(b, ZS_FUNCTION_MAXIMUM, t, number(b, 0)),
             number(b, 1));
  zs_coordinates at[2] = {*b->along, *b->along};
  if (g->flows.side[0]) {
    const bool smooth = b->settings->continuity == C1;
    const zs_value motion =
      zs_between_motion(b->compiler, g->between, smooth ? smooth_step(b, t) : t);
    for (int side = 0; side < 2; side++)
      at[side] = zs_between_warp(b->compiler, &g->flows, side, motion, b->along);
  }
  const zs_value f = join(b, i, t, at);
  return g->between
           ? binary(b, ZS_FUNCTION_ADD, f, zs_between_filling(b->compiler, g->between, t))
           : f;
}

static zs_value emit_extended(const builder *b)
{
  const zs_value z = zs_emit_coordinate(b->compiler, b->along, 2);
  zs_value f = emit_gap(b, 0);
  for (size_t i = 1; i < b->count; i++) {
    const zs_value beyond =
      binary(b, ZS_FUNCTION_LESS_EQUAL, number(b, zs_level_height(b->gaps[i].below)), z);
    f = zs_emit(b->compiler, ZS_FUNCTION_SELECT, beyond, emit_gap(b, i), f);
  }
  return f;
}

/* ---- Ends --------------------------------------------------------------------------- */

/* f less the square of how far z is beyond a level, over a gap's length. */
static zs_value rounded(const builder *b, zs_value f, double height, double sign, double length)
{
  const double row[12] = {0, 0, sign, -sign * height};
  const zs_coordinates beyond = zs_coordinates_affine(b->along, row);
  zs_value d = zs_emit_coordinate(b->compiler, &beyond, 0);
  d = binary(b, ZS_FUNCTION_MAXIMUM, d, number(b, 0));
  d = zs_emit(b->compiler, ZS_FUNCTION_SQUARE, d, 0, 0);
  return binary(b, ZS_FUNCTION_SUBTRACT, f, scaled(b, d, 1 / length));
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct interpolate *p = node->parameters;
  zs_coordinates along = zs_coordinates_along(at, p->axis);
  builder b = {.compiler = compiler, .settings = p, .along = &along};
  if (!find_gaps(&b, node) || !b.count)
    return number(&b, 0);
  bool plain = p->continuity == C0 && p->method != SPACE_TIME;
  for (size_t i = 0; i < b.count; i++)
    plain = plain && !b.gaps[i].between;
  const zs_value f = plain ? emit_linear(&b) : emit_extended(&b);
  const gap *first = &b.gaps[0], *last = &b.gaps[b.count - 1];
  const double lo = zs_level_height(first->below), hi = zs_level_height(last->above);
  if (p->caps == CLOSED)
    return zs_emit_cut(compiler, f, &along, lo, hi);
  if (p->caps == OPEN)
    return f;
  return rounded(&b, rounded(&b, f, lo, -1, length_of(first)), hi, 1, length_of(last));
}

/* ---- Where it is ---------------------------------------------------------------------- */

/* How far from the shapes, if their values are distances, a gap's blend may reach. */
static double swelling_of(const zs_node *between, double length)
{
  const zs_space_time blend = zs_between_space_time(between, length);
  return ZS_BOUNDED_BLEND_SWELLING * (fmax(blend.blend.a0, 0) + fmax(blend.smoothing, 0));
}

/* Around all shapes, with room for what moves between them. */
static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)children, (void)count;
  enum { MOST_LEVELS = 64 }; /* to look for one by one */
  static const double MARGIN = 0.25;
  const struct interpolate *p = node->parameters;
  zs_box around = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
  size_t levels = 0;
  double last = 0, gap_before = 0, gap_first = NAN, swelling = 0;
  const zs_node *between = NULL;
  for (size_t i = 0; i < node->child_count; i++) {
    const zs_node *part = node->children[i];
    double lo[3], hi[3];
    if (part->kind != &zs_interpolate_level) {
      between = part;
      continue;
    }
    if (levels++ == MOST_LEVELS || !zs_level_box(part, lo, hi))
      return zs_box_everything();
    for (int k = 0; k < 2; k++) {
      around.lo[k] = fmin(around.lo[k], lo[k]);
      around.hi[k] = fmax(around.hi[k], hi[k]);
    }
    around.lo[2] = fmin(around.lo[2], zs_level_height(part));
    around.hi[2] = fmax(around.hi[2], zs_level_height(part));
    gap_before = levels > 1 ? zs_level_height(part) - last : 0;
    gap_first = levels == 2 ? gap_before : gap_first;
    if (levels > 1 && p->method == SPACE_TIME)
      swelling = fmax(swelling, swelling_of(between, gap_before));
    between = NULL;
    last = zs_level_height(part);
  }
  const double width = fmax(around.hi[0] - around.lo[0], around.hi[1] - around.lo[1]);
  for (int k = 0; k < 2; k++) {
    around.lo[k] -= MARGIN * width + swelling;
    around.hi[k] += MARGIN * width + swelling;
  }
  if (p->caps == ROUND) { /* no shape is deeper than half its width */
    around.lo[2] -= sqrt(width / 2 * gap_first);
    around.hi[2] += sqrt(width / 2 * gap_before);
  } else if (p->caps == OPEN) {
    around.lo[2] = -INFINITY;
    around.hi[2] = INFINITY;
  }
  zs_box turned;
  for (int k = 0; k < 3; k++) {
    turned.lo[(k + p->axis + 1) % 3] = around.lo[k];
    turned.hi[(k + p->axis + 1) % 3] = around.hi[k];
  }
  return turned;
}

const zs_kind zs_kind_interpolate = {
  .name = "interpolate",
  .family = ZS_FAMILY_INTERPOLATION,
  .summary = "shapes on levels along an axis, joined into one solid",
  .doc = "Between two levels with values f1 and f2, f is (1 - t) f1 + t f2, with t growing from 0 "
         "to 1. A `between` part in the gap moves the shapes while they become each other: points "
         "of its pairs are carried from level to level, and everything around them by the thin "
         "plate spline through them; one pair is a translation, two a turn and a change of size as "
         "well. A space-time blend adds material half-way instead of weighting, so that shapes "
         "need not overlap; it has no creases across levels. On every level f is that of its "
         "shape. Closed ends are cut by the slab between the "
         "first and the last level, which are inside, however their heights are rounded. "
         "With continuity=\"c1\" gaps have no `weight` of their own, and filling needs a `wd` "
         "above 1. Pairs that are found automatically are none, with a warning, where a shape "
         "is empty or has no bounds.",
  .source = "J. Parulek, M. Sramek, Implicit modeling by metamorphosis of 2D shapes, 2007, "
            "equations 9 to 18, with pull-backs and weights put right; D. Cohen-Or, D. Levin, A. "
            "Solomovici, Three-dimensional distance field metamorphosis, 1998, equations 16 and "
            "17; G. Pasko, A. Pasko, T. Kunii, Space-time blending, 2004; B. Payne, "
            "A. Toga, Distance field manipulation of surface models, 1992",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct interpolate),
  .children = ZS_CHILDREN_NONE,
  .parts = parts,
  .check = check,
  .emit = emit,
  .box = box,
};
