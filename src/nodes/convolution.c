#include "nodes/skeletal.h"

struct convolution {
  double threshold, sharpness;
};

static const zs_attribute attributes[] = {
  ZS_PLAIN(struct convolution, threshold, "threshold", "0.5", ZS_RANGE_POSITIVE,
           "the field on the surface"),
  {.name = "sharpness",
   .type = ZS_NUMBER,
   .offset = offsetof(struct convolution, sharpness),
   .initial = "1",
   .unit = "1 per length",
   .range = ZS_RANGE_POSITIVE,
   .doc = "how narrow the kernel is: it has fallen to a quarter at the distance 1 / sharpness, "
          "times the part's radius"},
};

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct convolution *p = node->parameters;
  return zs_skeletal_emit(compiler, node, at, ZS_SKELETON_CAUCHY, 1 / p->sharpness, p->threshold);
}

static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)children, (void)count;
  const struct convolution *p = node->parameters;
  return zs_skeletal_box(node, ZS_SKELETON_CAUCHY, 1 / p->sharpness, p->threshold);
}

const zs_kind zs_kind_convolution = {
  .name = "convolution",
  .family = ZS_FAMILY_PRIMITIVE,
  .summary = "a convolution surface: a kernel summed up along lines and over triangles",
  .doc = "f is the sum over the parts of weight times the integral over the part of 1 / (1 + s^2 "
         "r^2)^2, less the threshold; r is the distance from a point of the part, and s is "
         "sharpness / radius. Pieces of a line or a surface join without bulges. The kernel does "
         "not end: the cost grows with the number of pieces.",
  .source = "J. McCormack, A. Sherstyuk, Creating and rendering convolution surfaces, 1998",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct convolution),
  .children = ZS_CHILDREN_NONE,
  .parts = zs_skeletal_parts,
  .check = zs_skeletal_check,
  .emit = emit,
  .box = box,
};
