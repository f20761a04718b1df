#include "nodes/skeletal.h"

static const char *const falloffs[] = {"wyvill", "blobtree", "blinn", "metaball", NULL};
static const zs_skeleton_field fields[] = {ZS_SKELETON_WYVILL, ZS_SKELETON_BLOBTREE,
                                           ZS_SKELETON_BLINN, ZS_SKELETON_METABALL};

struct soft {
  double threshold;
  int falloff;
};

static const zs_attribute attributes[] = {
  ZS_PLAIN(struct soft, threshold, "threshold", "0.5", ZS_RANGE_POSITIVE,
           "the sum of the fields on the surface"),
  ZS_SELECT(struct soft, falloff, "falloff", "wyvill", falloffs,
            "field at u = distance / radius: `wyvill` 1 - 22/9 u^2 + 17/9 u^4 - 4/9 u^6, "
            "`blobtree` (1 - u^2)^3, `metaball` 1 - 3 u^2 up to 1/3 and then 3/2 (1 - u)^2, all of "
            "which end at u = 1, or `blinn` 2^(-4 u^2), which does not end. `wyvill` and "
            "`blinn` are 1/2 where u is"),
};

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct soft *p = node->parameters;
  return zs_skeletal_emit(compiler, node, at, fields[p->falloff], 1, p->threshold);
}

static zs_box box(const zs_node *node, const zs_box *children, size_t count)
{
  (void)children, (void)count;
  const struct soft *p = node->parameters;
  return zs_skeletal_box(node, fields[p->falloff], 1, p->threshold);
}

const zs_kind zs_kind_soft = {
  .name = "soft",
  .family = ZS_FAMILY_PRIMITIVE,
  .summary = "a soft object: fields about points, lines and triangles that flow together",
  .doc = "f is the sum over the parts of weight * falloff(distance / radius), less the threshold. "
         "A polyline's distance is that of its nearest piece. Where no field reaches f is "
         "-threshold. Parts cost nothing where they do not reach, but for those of `blinn`.",
  .source = "G. Wyvill, C. McPheeters, B. Wyvill, Data structure for soft objects, 1986; J. Blinn, "
            "A generalization of algebraic surface drawing, 1982; H. Nishimura et al., Object "
            "modeling by distribution function, 1985; B. Wyvill, A. Guy, E. Galin, Extending the "
            "CSG tree, 1999",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct soft),
  .children = ZS_CHILDREN_NONE,
  .parts = zs_skeletal_parts,
  .check = zs_skeletal_check,
  .emit = emit,
  .box = box,
};
