/* The solids that are the same everywhere. */
#include "nodes/kind.h"

#include <math.h>

static zs_value empty_emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  (void)node, (void)at;
  return zs_emit_constant(compiler, -INFINITY);
}

static zs_value everything_emit(zs_compiler *compiler, const zs_node *node,
                                const zs_coordinates *at)
{
  (void)node, (void)at;
  return zs_emit_constant(compiler, INFINITY);
}

const zs_kind zs_kind_empty = {
  .name = "empty",
  .family = ZS_FAMILY_PRIMITIVE,
  .summary = "nothing",
  .doc = "f is minus infinity: the neutral element of unions.",
  .children = ZS_CHILDREN_NONE,
  .emit = empty_emit,
};

const zs_kind zs_kind_everything = {
  .name = "everything",
  .family = ZS_FAMILY_PRIMITIVE,
  .summary = "all of space",
  .doc = "f is infinity: the neutral element of intersections.",
  .children = ZS_CHILDREN_NONE,
  .emit = everything_emit,
};
