/* <level>: a shape that <interpolate> joins others to. */
#include "nodes/interpolate.h"

struct level {
  double at;
};

static const zs_attribute level_attributes[] = {
  ZS_LENGTH(struct level, at, "at", NULL, ZS_RANGE_ANY, "where on the axis the shape lies"),
};

const zs_kind zs_interpolate_level = {
  .name = "level",
  .family = ZS_FAMILY_PART,
  .summary = "a shape, and where it lies",
  .attributes = level_attributes,
  .attribute_count = ZS_COUNT_OF(level_attributes),
  .parameters_size = sizeof(struct level),
  .children = ZS_CHILDREN_ONE,
};

double zs_level_height(const zs_node *part)
{
  return ((const struct level *)part->parameters)->at;
}

/* By a piece of its cylinder. */
bool zs_level_box(const zs_node *part, double lo[3], double hi[3])
{
  zs_diag diag = {0};
  zs_compiler *compiler = zs_compiler_new(NULL, NULL, &diag);
  if (!compiler)
    return false;
  const zs_coordinates root = zs_coordinates_root();
  const zs_value f = zs_emit_cut(compiler, zs_children_emit(compiler, part, &root), &root, -1, 1);
  zs_field *field = zs_compiler_finish(compiler, f, 1);
  const bool found = field && !diag.errors && zs_field_box(field, lo, hi, &diag);
  zs_field_unref(field);
  return found;
}
