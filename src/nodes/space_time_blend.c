#include "nodes/common.h"
#include "nodes/extent.h"
#include "nodes/space_time.h"

#include <math.h>

/* Where the half-cylinders of the paper end and begin. */
static const double END = 0, START = 1;

struct space_time_blend {
  double time, min, max, b0;
  zs_bounded_blend blend;
};

#define TIME(member, name_, initial_, least, most, doc_) \
  {.name = name_, .type = ZS_NUMBER, .offset = offsetof(struct space_time_blend, member), \
   .initial = initial_, .unit = "length", .range = ZS_RANGE_BETWEEN, .minimum = least, \
   .maximum = most, .doc = doc_}

static const zs_attribute attributes[] = {
  ZS_LENGTH(struct space_time_blend, time, "time", "", ZS_RANGE_ANY,
            "the time, from `min` (the first child) to `max` (the second). Absent, time runs along "
            "z: the solid is the whole of the blend, cut at `min` and `max`"),
  TIME(min, "min", "-10", -1e6, -1e-3, "when the first child begins to change: below 0, where its "
       "half-cylinder ends"),
  TIME(max, "max", "10", 1.001, 1e6, "when the second child is complete: above 1, where its "
       "half-cylinder begins"),
  ZS_LENGTH(struct space_time_blend, blend.a0, "a0", "0.5", ZS_RANGE_ANY,
            "what is added to f where both half-cylinders are 0"),
  ZS_LENGTH(struct space_time_blend, blend.a1, "a1", "1", ZS_RANGE_POSITIVE,
            "how far the blend reaches along the first child's values"),
  ZS_LENGTH(struct space_time_blend, blend.a2, "a2", "1", ZS_RANGE_POSITIVE,
            "how far it reaches along the second's"),
  ZS_LENGTH(struct space_time_blend, blend.a3, "a3", "1", ZS_RANGE_POSITIVE,
            "how long after `min`, and before `max`, the blend is held back: the smaller, the "
            "longer it lasts"),
  ZS_LENGTH(struct space_time_blend, b0, "b0", "0", ZS_RANGE_ANY,
            "what is added where each half-cylinder ends: with a number below 0 shapes fade before "
            "they end, and do not vanish at once"),
};

static bool check(const zs_node *node, zs_diag *diag)
{
  return node->child_count >= 2 ||
         zs_node_misuse(node, diag, NULL, "there are %zu children; expected 2: the shape that is "
                        "there first, and the one that it becomes", node->child_count);
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct space_time_blend *p = node->parameters;
  const zs_space_time blend = {.min = p->min, .end = END, .start = START, .max = p->max,
                               .blend = p->blend, .smoothing = p->b0};
  zs_value f[3];
  for (size_t i = 0; i < node->child_count; i++) {
    const zs_value child = zs_node_emit(compiler, node->children[i], at);
    f[i < 3 ? i : 2] =
      i < 3 ? child : zs_emit(compiler, ZS_FUNCTION_MAXIMUM, f[2], child, 0);
  }
  const bool spatial = isnan(p->time);
  const zs_value t = spatial ? zs_emit_coordinate(compiler, at, 2)
                             : zs_emit_constant(compiler, p->time);
  const zs_value all =
    zs_space_time_emit(compiler, &blend, f[0], f[1], t, node->child_count > 2 ? &f[2] : NULL);
  return spatial ? zs_emit_cut(compiler, all, at, p->min, p->max) : all;
}

/* Around both children and what is added to them, if their values are distances. */
static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  const struct space_time_blend *p = node->parameters;
  const double swelling = ZS_BOUNDED_BLEND_SWELLING * (fmax(p->blend.a0, 0) + fmax(p->b0, 0));
  (void)count;
  zs_box all = zs_box_grown(zs_box_of_union(node, children, 2), swelling);
  if (isnan(p->time)) {
    all.lo[2] = p->min;
    all.hi[2] = p->max;
  }
  return all;
}

const zs_kind zs_kind_space_time_blend = {
  .name = "space-time-blend",
  .family = ZS_FAMILY_INTERPOLATION,
  .summary = "one child becomes another by a blend of both in time",
  .doc = "The first child is there until the time 0, the second from the time 1 on: half-cylinders "
         "in time, which a bounded blend of operation \"union\" joins between the times `min` and "
         "`max`. No points have to be matched, and the shapes need not overlap if `a0` is large "
         "enough for their distance. Its bound is the time between, as an R-function of the two "
         "half-spaces, within the union of all children behind the second if there are such. The "
         "half-spaces t <= 0 and t >= 1 are those of the paper, their functions -t and t - 1 are "
         "not: they have the same slope at the planes, but grow without end towards `min` and "
         "`max`, so that there f is that of the child. Where a half-cylinder ends, `b0` is added "
         "as a bounded blend of the child and the half-space adds it, from the middle between 0 "
         "and `min`, or 1 and `max`, on.",
  .source = "G. Pasko, A. Pasko, T. Kunii, Space-time blending, Computer Animation and Virtual "
            "Worlds, 2004; Bounded blending for function-based shape modeling, 2005",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct space_time_blend),
  .children = ZS_CHILDREN_TWO,
  .check = check,
  .emit = emit,
  .box = box,
};
