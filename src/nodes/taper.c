#include "nodes/common.h"
#include "nodes/extent.h"

#include <math.h>

struct taper {
  double from, to, start, end;
  int axis;
};

static const zs_attribute attributes[] = {
  ZS_AXIS(struct taper, axis, "axis of the taper"),
  ZS_LENGTH(struct taper, from, "from", NULL, ZS_RANGE_ANY, "where the taper begins"),
  ZS_LENGTH(struct taper, to, "to", NULL, ZS_RANGE_ANY, "where it ends"),
  ZS_PLAIN(struct taper, start, "start", "1", ZS_RANGE_POSITIVE,
           "factor across the axis up to `from`"),
  ZS_PLAIN(struct taper, end, "end", NULL, ZS_RANGE_POSITIVE, "factor beyond `to`"),
};

static bool check(const zs_node *node, zs_diag *diag)
{
  const struct taper *p = node->parameters;
  return zs_node_check_order(node, diag, "from", &p->from, "to", &p->to, 1);
}

#define FACTOR "let s = start + (end - start) * clamp((z - from) / (to - from), 0, 1); "

static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)count;
  const struct taper *p = node->parameters;
  const double most = fmax(p->start, p->end);
  zs_box all = children[0];
  for (int k = 0; k < 3; k++) {
    if (k == p->axis)
      continue;
    all.lo[k] = fmin(all.lo[k] * most, 0);
    all.hi[k] = fmax(all.hi[k] * most, 0);
  }
  return all;
}

const zs_kind zs_kind_taper = {
  .name = "taper",
  .family = ZS_FAMILY_COORDINATE_MAP,
  .summary = "the child made narrower or wider along an axis",
  .doc = "The factor across the axis grows evenly from `start` to `end`, and stays the same "
         "beyond them.",
  .source = "A. Barr, Global and local deformations of solid primitives, 1984",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct taper),
  .children = ZS_CHILDREN_ONE,
  .map = {FACTOR "x / s", FACTOR "y / s", "z"},
  .check = check,
  .box = box,
};
