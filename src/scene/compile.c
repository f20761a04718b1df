/* The whole way from a scene to a field. */
#include "scene/scene.h"

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
  return zs_compiler_finish(compiler, result, tree.node_count,
                            tree.has_domain ? tree.domain_lo : NULL,
                            tree.has_domain ? tree.domain_hi : NULL, NULL, NULL);
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
