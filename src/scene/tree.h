/* The tree that a scene expands to, between the reader and the compiler. */
#ifndef ZS_TREE_H
#define ZS_TREE_H

#include "nodes/kind.h"

/* What a scene looks like for one setting of its parameters.  Owned by the
 * arena it was expanded into. */
typedef struct zs_tree {
  const zs_node *root;
  size_t node_count;
  bool has_domain;
  double domain_lo[3], domain_hi[3];
} zs_tree;

/* Expand an object (NULL: the main one) with the scene's present parameters:
 * expressions, repeat, instance, use, include; kinds' checks are run.  False
 * after reporting every error found. */
bool zs_scene_expand(zs_scene *scene, const char *object, zs_arena *arena, zs_tree *tree,
                     zs_diag *diag);

/* Things worth computing once per scene, found again by a 128-bit hash of all
 * their inputs (fits, transforms).  Reference counted by the cache and by every
 * field that uses one. */
typedef struct zs_cache zs_cache;
zs_cache *zs_scene_cache(zs_scene *scene);

#endif
