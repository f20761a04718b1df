/* The whole way from a scene to a field. */
#include "nodes/extent.h"
#include "scene/scene.h"

/* Find the box around the solid now, while the tree is at hand: where bounds
 * cannot, the tree tells where to look. */
static void locate(zs_field *field, const zs_tree *tree, const zs_control *control,
                   struct zs_cache *cache)
{
  double lo[3], hi[3];
  bool found = zs_field_box(field, lo, hi, NULL);
  if (!found) {
    zs_box extent = zs_node_extent_by_children(tree->root, control, cache);
    if (!zs_box_is_finite(&extent))
      return;
    zs_field_set_hint(field, extent.lo, extent.hi);
    found = zs_field_box(field, lo, hi, NULL);
  }
  if (found)
    zs_field_set_box(field, lo, hi);
}

static zs_field *compile(zs_scene *scene, const char *object, const zs_control *control,
                         zs_diag *diag)
{
  zs_compiler *compiler = zs_compiler_new(control, scene->cache, diag);
  if (!compiler)
    return NULL;
  /* Operations may point into the nodes: these live as long as the field. */
  zs_tree tree;
  if (!zs_scene_expand(scene, object, zs_compiler_arena(compiler), &tree, diag)) {
    zs_compiler_free(compiler);
    return NULL;
  }
  zs_coordinates root = zs_coordinates_root();
  zs_value result = zs_node_emit(compiler, tree.root, &root);
  if (diag->errors) {
    zs_compiler_free(compiler);
    return NULL;
  }
  zs_field *field = zs_compiler_finish(compiler, result, tree.node_count);
  if (field && tree.has_domain)
    zs_field_set_box(field, tree.domain_lo, tree.domain_hi);
  else if (field)
    locate(field, &tree, control, scene->cache);
  return field;
}

/* Emit every object, with none of what only a field to evaluate needs. */
static void emit_all(zs_scene *scene, const zs_control *control, zs_diag *diag)
{
  zs_compiler *compiler = zs_compiler_new(control, scene->cache, diag);
  if (!compiler)
    return;
  const zs_node *const *roots;
  size_t count;
  if (zs_scene_expand_all(scene, zs_compiler_arena(compiler), &roots, &count, diag)) {
    const zs_coordinates root = zs_coordinates_root();
    for (size_t i = 0; i < count; i++)
      zs_node_emit(compiler, roots[i], &root);
  }
  /* Any value will do to learn whether memory was enough. */
  zs_field_unref(zs_compiler_finish(compiler, zs_emit_constant(compiler, 0), 0));
}

bool zs_scene_check(zs_scene *scene, const zs_control *control, zs_diag *diag)
{
  zs_gate gate;
  zs_gate_open(&gate, diag, &scene->warned);
  zs_cache_advance(scene->cache);
  emit_all(scene, control, &gate.diag);
  return zs_gate_close(&gate);
}

zs_field *zs_scene_compile(zs_scene *scene, const char *object, const zs_control *control,
                           zs_diag *diag)
{
  zs_gate gate;
  zs_gate_open(&gate, diag, &scene->warned);
  zs_cache_advance(scene->cache);
  zs_field *field = compile(scene, object, control, &gate.diag);
  zs_gate_close(&gate);
  return field;
}
