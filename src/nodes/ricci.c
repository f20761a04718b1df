#include "nodes/common.h"
#include "nodes/extent.h"

#include <math.h>

struct ricci {
  double exponent, threshold;
};

static const zs_attribute attributes[] = {
  {.name = "exponent",
   .type = ZS_NUMBER,
   .offset = offsetof(struct ricci, exponent),
   .initial = "2",
   .unit = "1",
   .range = ZS_RANGE_BETWEEN,
   .minimum = 1,
   .maximum = 1000,
   .doc = "1 adds the fields of the children, larger ones come closer and closer to their union"},
  ZS_LENGTH(struct ricci, threshold, "threshold", "0.5", ZS_RANGE_POSITIVE,
            "the field on the surface: how far outside of a child it has faded to 0. That of "
            "`soft` children, or the reach of the blend about solids"),
};

static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  const struct ricci *p = node->parameters;
  const double swelling = p->threshold * (1 - pow((double)count, -1 / p->exponent));
  return zs_box_grown(zs_box_of_union(node, children, count), swelling);
}

const zs_kind zs_kind_ricci = {
  .name = "ricci",
  .family = ZS_FAMILY_BLEND,
  .summary = "a union blended by a p-norm of fields",
  .doc = "With the fields g = max(f + threshold, 0) of the children, f is (g1^n + g2^n + "
         "...)^(1/n) - threshold, where n is the exponent; where no field reaches, it is the largest of "
         "the children's f.",
  .source = "A. Ricci, A constructive geometry for computer graphics, 1973; B. Wyvill, A. Guy, "
            "E. Galin, Extending the CSG tree, 1999",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct ricci),
  .children = ZS_CHILDREN_MANY,
  /* By the ratio of the smaller field to the larger no power is too large. */
  .formula = "let g = max(max(a, b) + threshold, 0); let h = max(min(a, b) + threshold, 0); "
             "let t = clamp(h / max(g, 1e-30), 0, 1); "
             "max(a, b) + g * ((1 + t^exponent)^(1 / exponent) - 1)",
  .box = box,
};
