#include "nodes/kind.h"

const zs_kind zs_kind_displace = {
  .name = "displace",
  .family = ZS_FAMILY_FUNCTION_MAP,
  .summary = "the first child, its surface moved by the values of the others",
  .doc = "Their f is added: where it is above 0 the surface moves outward, by about that much.",
  .source = "V. Savchenko, A. Pasko, Transformation of functionally defined shapes by extended "
            "space mappings, 1998",
  .children = ZS_CHILDREN_TWO,
  .formula = "a + b",
};
