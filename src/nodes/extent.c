#include "nodes/extent.h"

#include "nodes/common.h"
#include "nodes/copies.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

zs_box zs_box_everything(void)
{
  return (zs_box){{-INFINITY, -INFINITY, -INFINITY}, {INFINITY, INFINITY, INFINITY}};
}

bool zs_box_is_finite(const zs_box *box)
{
  for (int k = 0; k < 3; k++)
    if (!isfinite(box->lo[k]) || !isfinite(box->hi[k]))
      return false;
  return true;
}

zs_box zs_box_grown(zs_box box, double by)
{
  for (int k = 0; k < 3; k++) {
    box.lo[k] -= by;
    box.hi[k] += by;
  }
  return box;
}

zs_box zs_box_of_union(const zs_node *node, const zs_box *children, size_t count)
{
  (void)node;
  zs_box all = children[0];
  for (size_t i = 1; i < count; i++)
    for (int k = 0; k < 3; k++) {
      all.lo[k] = fmin(all.lo[k], children[i].lo[k]);
      all.hi[k] = fmax(all.hi[k], children[i].hi[k]);
    }
  return all;
}

zs_box zs_box_of_intersection(const zs_node *node, const zs_box *children, size_t count)
{
  (void)node;
  zs_box common = children[0];
  for (size_t i = 1; i < count; i++)
    for (int k = 0; k < 3; k++) {
      common.lo[k] = fmax(common.lo[k], children[i].lo[k]);
      common.hi[k] = fmin(common.hi[k], children[i].hi[k]);
    }
  for (int k = 0; k < 3; k++) /* nothing in common is a point somewhere */
    common.hi[k] = fmax(common.lo[k], common.hi[k]);
  return common;
}

zs_box zs_box_of_first(const zs_node *node, const zs_box *children, size_t count)
{
  (void)node, (void)count;
  return children[0];
}

zs_box zs_box_image(const zs_box *box, const double inverse[12])
{
  double forward[12];
  if (!zs_affine_invert(inverse, forward))
    return zs_box_everything();
  zs_box image;
  for (int i = 0; i < 3; i++) {
    image.lo[i] = image.hi[i] = forward[4 * i + 3];
    for (int j = 0; j < 3; j++) {
      if (forward[4 * i + j] == 0) /* sides of endless boxes count only where they lead */
        continue;
      double a = forward[4 * i + j] * box->lo[j], b = forward[4 * i + j] * box->hi[j];
      image.lo[i] += fmin(a, b);
      image.hi[i] += fmax(a, b);
    }
  }
  return image;
}

/* The box that bounds of the node's own program find. */
static bool find_alone(const zs_node *node, const zs_control *control, struct zs_cache *cache,
                       zs_box *box)
{
  zs_diag diag = {0};
  zs_compiler *compiler = zs_compiler_new(control, cache, &diag);
  if (!compiler)
    return false;
  zs_coordinates root = zs_coordinates_root();
  zs_value f = zs_node_emit(compiler, node, &root);
  zs_field *field = zs_compiler_finish(compiler, f, 1);
  bool found = field && !diag.errors && zs_field_box(field, box->lo, box->hi, &diag);
  zs_field_unref(field);
  return found;
}

/* The boxes of the child nodes; NULL when there are none or memory is out. */
static zs_box *child_extents(const zs_node *node, const zs_control *control,
                             struct zs_cache *cache, size_t *count)
{
  zs_box *boxes = node->child_count ? malloc(node->child_count * sizeof *boxes) : NULL;
  *count = 0;
  for (size_t i = 0; boxes && i < node->child_count; i++)
    if (!zs_node_is_part(node->children[i]))
      boxes[(*count)++] = zs_node_extent(node->children[i], control, cache);
  if (*count && node->kind->children == ZS_CHILDREN_ONE) {
    boxes[0] = zs_box_of_union(node, boxes, *count);
    *count = 1;
  }
  return boxes;
}

zs_box zs_node_extent_by_children(const zs_node *node, const zs_control *control,
                                  struct zs_cache *cache)
{
  if (!node->kind->box)
    return zs_box_everything();
  size_t count;
  zs_box *children = child_extents(node, control, cache, &count);
  const zs_box box = count || node->kind->children == ZS_CHILDREN_NONE
                       ? node->kind->box(node, children, count)
                       : zs_box_everything();
  free(children);
  return node->placement ? zs_box_image(&box, node->placement) : box;
}

zs_box zs_node_extent(const zs_node *node, const zs_control *control, struct zs_cache *cache)
{
  zs_box box;
  return find_alone(node, control, cache, &box) ? box
                                                : zs_node_extent_by_children(node, control, cache);
}

/* The ends along axes where none were found together with those along others. */
static void find_one_by_one(zs_field *field, unsigned axes, zs_box *box)
{
  for (unsigned k = 0; k < 3; k++) {
    zs_box one;
    if (axes >> k & 1 && !(isfinite(box->lo[k]) && isfinite(box->hi[k])) &&
        zs_field_extent(field, 1u << k, one.lo, one.hi)) {
      box->lo[k] = one.lo[k];
      box->hi[k] = one.hi[k];
    }
  }
}

/* What bounds of the children's program say, or else the boxes of their own. */
static bool find_together(zs_compiler *compiler, const zs_node *node, unsigned axes, zs_box *box)
{
  zs_diag quiet = {0};
  zs_field *field = zs_children_field(compiler, node, &quiet);
  if (!field)
    return false;
  /* Ends are found more surely all at once. */
  if (!zs_field_extent(field, ZS_ALL_AXES, box->lo, box->hi) &&
      !zs_field_extent(field, axes, box->lo, box->hi)) {
    size_t count;
    zs_box *children =
      child_extents(node, zs_compiler_control(compiler), zs_compiler_cache(compiler), &count);
    *box = children && count ? children[0] : zs_box_everything();
    free(children);
    find_one_by_one(field, axes, box);
  }
  zs_field_unref(field);
  return true;
}

bool zs_children_extent(zs_compiler *compiler, const zs_node *node, unsigned axes, zs_box *box)
{
  bool known;
  zs_box *place = zs_children_box(compiler, node, &known);
  if (!place)
    return false;
  if (!known && !find_together(compiler, node, axes, place))
    return false;
  *box = *place;
  return true;
}
